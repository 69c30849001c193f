"""Which members of a sweep have a material that violates the theory: judged for many at once, at little cost."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from plastica.errors import InadmissibleError
from plastica.material.rows import DOUBTFUL, FAILS, by_formula, sorted_rows
from plastica.numerics.grid import AUTO_NODES, Grid
from plastica.physics.initial import initial_shape, nodal_values
from plastica.physics.program import Program
from plastica.study.sweep_axes import AMPLITUDE
from plastica.study.sweep_plan import Plan

__all__ = ["for_each", "inadmissible", "own_parameters", "shape_at_nodes"]

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]


def inadmissible(plan: Plan, values: Array, thrust: Any, shapes: list[Any] | None) -> Flags:
    """Tell which members would be refused alone for their material.

    All are sorted in numbers; those that the numbers leave in doubt are judged as their scenarios would be.

    Parameters
    ----------
    plan : Plan
        The sweep.
    values : ndarray, shape (members, axes)
        What the members take.
    thrust : ndarray, list of Program, or None
        What each is pushed by, in the user's units; None where all are pushed as the scenario says.
    shapes : list or None
        The initial curvature of each, where it is a text or a table.

    Returns
    -------
    ndarray of bool, shape (members,)
    """
    columns = plan.columns(values)
    own = own_parameters(columns)
    if plan.base.allow_inadmissible or not own or not len(values):
        return np.zeros(len(values), dtype=bool)
    material, unit = plan.base.model.material, plan.base.model.scales.curvature
    if not by_formula(material):
        same = np.full(len(values), float(np.asarray(plan.base.natural_curvature)))
        natural = columns.get("initial.natural_curvature", same)
        energy = _energy(plan, columns, natural / unit, thrust, shapes)
        return _judged(plan, values, sorted_rows(material, own, unit, energy, natural))
    # What is read off formulas depends on the parameters alone.
    rows, first, which = np.unique(np.stack([*own.values()], axis=1), axis=0, return_index=True, return_inverse=True)
    codes = sorted_rows(material, dict(zip(own, rows.T, strict=True)), unit)
    return np.asarray(_judged(plan, values[first], codes)[which.ravel()])


def own_parameters(columns: Mapping[str, Array]) -> dict[str, Array]:
    """Return the parameters of the material among what members take, by their names."""
    return {key.rsplit(".", 1)[1]: each for key, each in columns.items() if key.startswith("material.parameters.")}


def for_each(items: Sequence[Any], function: Callable[[Any], Any]) -> list[Any]:
    """Return what a function gives for each of many items, few of which are different objects; asked once for each."""
    found = {number: function(item) for number, item in {id(item): item for item in items}.items()}
    return [found[id(item)] for item in items]


def _judged(plan: Plan, values: Array, codes: NDArray[np.int8]) -> Flags:
    """Which members are refused: those that fail for certain, and those in doubt whose own scenario is."""
    refused = np.asarray(codes == FAILS)
    for i in np.flatnonzero(codes == DOUBTFUL):
        try:
            plan.scenario(values[i])
        except InadmissibleError:
            refused[i] = True
    return refused


def _energy(plan: Plan, columns: dict[str, Array], natural: Array, thrust: Any, shapes: Any) -> Array | None:
    """What the energy of each member can rise to (N), but for the preference energy at its start; None without a bound.

    1/2 |mu - mu_nat|^2 + 2 max int |n_load| + variation of the loads, the norm by its largest value: never less than
    the a-priori bound of `physics.bounds`.
    """
    base = plan.base
    loads, end, scales = base.problem.strut.loads, base.plan.end, base.model.scales
    others = dict(loads.sources())
    if "couple" in others:
        return None
    energy = 0.5 * (_largest(plan, columns, shapes) + np.abs(natural)) ** 2
    for name, program in others.items():
        energy = energy + (_most(program, end) if thrust is None or name != "thrust" else 0.0)
    if isinstance(thrust, list):
        energy = energy + np.array(for_each(thrust, lambda each: _most(each, end * scales.time))) / scales.force
    elif thrust is not None:
        energy = energy + 2.0 * np.abs(thrust) / scales.force
    return np.asarray(energy * scales.preference)


def _most(program: Program, end: float) -> float:
    return 2.0 * max(map(abs, program.extreme(end))) + program.variation(end)


def _largest(plan: Plan, columns: dict[str, Array], shapes: list[Any] | None) -> Array:
    """The largest initial curvature of each member, in units of 1/L."""
    factor = np.abs(columns.get(AMPLITUDE, np.ones(len(next(iter(columns.values()))))))
    if shapes is not None:
        most = np.array(for_each(shapes, lambda each: np.abs(shape_at_nodes(plan, each)[1]).max()))
    elif "initial.curvature" in columns:
        most = np.abs(columns["initial.curvature"]) * plan.base.model.scales.length
    else:
        most = np.abs(shape_at_nodes(plan, plan.base.curvature)[1]).max()
    return np.asarray(factor * most)


def shape_at_nodes(plan: Plan, curvature: Any) -> tuple[Grid, Array]:
    """Return an initial curvature on a grid fine enough to tell its extremes, dimensionless."""
    model = plan.base.model
    grid = model.grid.with_nodes(AUTO_NODES[3]) if model.grid.nodes == "auto" else model.grid
    shape, grid = initial_shape(curvature, grid, model.scales, si=model.specimen is not None)
    return grid, nodal_values(shape, grid)
