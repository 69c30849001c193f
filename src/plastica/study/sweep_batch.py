"""Members of a sweep that differ in thrust, material and start only: all of a chunk through `solve_many` at once."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from plastica.motion.many import CHUNK, solve_many
from plastica.motion.regimes import Rows, thrust_alone
from plastica.numerics.grid import Grid
from plastica.physics.batch import batch_laws
from plastica.physics.initial import initial_shape
from plastica.physics.program import Program
from plastica.physics.strut import Strut
from plastica.study import schema
from plastica.study.building import initial, number
from plastica.study.loads import load
from plastica.study.problems import Problems
from plastica.study.sweep_axes import AMPLITUDE, Axis
from plastica.study.sweep_judged import for_each, inadmissible, own_parameters, shape_at_nodes
from plastica.study.sweep_outputs import FINAL, HISTORY, LIMITS, METHODS, REFUSED, REGIMES, STATUSES, empty_chunk
from plastica.study.sweep_plan import Plan, amplified
from plastica.units import looks_like_quantity

__all__ = ["compute_together"]

Array = NDArray[np.float64]
Columns = dict[str, NDArray[Any]]


@dataclass(frozen=True, eq=False)
class _Start:
    """First states: what `solve_many` takes, and the largest tangent angle of each."""

    curvature: Any
    natural: Array
    angle: Array
    shape_parameters: dict[str, Array]


def compute_together(plan: Plan, values: Array) -> Columns:
    """Compute some members, those that share a grid in one batch; see `sweep_tasks.compute`."""
    columns = plan.columns(values)
    strut = plan.base.model
    if not isinstance(strut, Strut):
        raise TypeError("a batch is of struts")
    thrust, shapes = _thrust(plan, columns), _shapes(plan, columns)
    usable = _all_there(thrust, len(values)) & _all_there(shapes, len(values))
    usable[usable] &= ~inadmissible(plan, values[usable], _chosen(thrust, usable), _chosen(shapes, usable))
    made = empty_chunk(plan, len(values))
    batches = [usable & some for some in _alike(plan, columns, shapes)]
    _fill_refused(made, ~np.logical_or.reduce([np.zeros_like(usable), *batches]))
    for some in batches:
        if some.any():
            chosen = {key: column[some] for key, column in columns.items()}
            _compute_batch(plan, strut, chosen, _chosen(thrust, some), _chosen(shapes, some), made, some)
    return made


def _compute_batch(
    plan: Plan,
    strut: Strut,
    columns: dict[str, Array],
    thrust: Any,
    shapes: list[Any] | None,
    made: Columns,
    some: NDArray[np.bool_],
) -> None:
    """Compute the members that are told, and put what is found where `some` says."""
    base = plan.base
    start = _start(plan, columns, shapes)
    own = own_parameters(columns)
    end = number(base.until, "s")
    times = None if plan.times is None else np.union1d(plan.times, [end])
    also = [each for name, each in (("state", "curvature"), ("limit", "limit")) if name in plan.outputs]
    found = solve_many(
        strut,
        start.curvature,
        start.natural,
        thrust,
        own,
        end,
        base.rtol,
        base.atol,
        times,
        shape_parameters=start.shape_parameters,
        also=also,
        chunk=min(start.natural.size, CHUNK),
        library=plan.library,
    )
    _fill(made, some, plan, found)
    if "verdict" in plan.outputs:
        pushed = _pushed(strut, thrust, end, start.natural.size)
        rows = _rows(strut, _last(found), start, own, pushed)
        ended = np.asarray(found["status"].values) == "done"
        made["regime"][some] = np.where(ended, rows.regime, REGIMES.index("untold"))
        made["yielding"][some] = rows.yielding


def _alike(plan: Plan, columns: dict[str, Array], shapes: list[Any] | None) -> list[NDArray[np.bool_]]:
    """Members by the places where their initial curvature jumps or bends, at which elements end.

    A batch has one grid: on that of all of its members none would be computed as it is alone. Members whose grid the
    sweep cannot keep are left out.
    """
    count = len(next(iter(columns.values())))
    if shapes is None:
        same = plan.base.curvature if "initial.curvature" not in columns else 0.0
        return [np.ones(count, dtype=bool)] if plan.keeps(_grid(plan, same)) else []
    grids = for_each(shapes, lambda shape: None if shape is None else _grid(plan, shape))
    ends = [() if grid is None else grid.breaks for grid in grids]
    known = {grid.breaks: grid for grid in grids if grid is not None}
    known = {breaks: grid for breaks, grid in known.items() if plan.keeps(grid)}
    return [np.array([each == breaks for each in ends]) for breaks in known]


def _grid(plan: Plan, curvature: Any) -> Grid:
    model = plan.base.model
    return initial_shape(curvature, model.grid, model.scales, si=model.specimen is not None)[1]


def _all_there(each: Any, count: int) -> NDArray[np.bool_]:
    """Which members have what was read for each of them; numbers and what all share are there."""
    if not isinstance(each, list):
        return np.ones(count, dtype=bool)
    return np.array([one is not None for one in each])


def _chosen(each: Any, usable: NDArray[np.bool_]) -> Any:
    """The same for the members that are usable."""
    if isinstance(each, np.ndarray):
        return np.ascontiguousarray(each[usable])
    return [one for one, there in zip(each, usable, strict=True) if there] if isinstance(each, list) else each


def _fill_refused(made: Columns, refused: NDArray[np.bool_]) -> None:
    for name, value in REFUSED.items():
        if name in made:
            made[name][refused] = value


def _shapes(plan: Plan, columns: dict[str, Array]) -> list[Any] | None:
    """The initial curvature of each member where it is a text or a table, None in place of what cannot be read."""
    axis = next((each for each in plan.axes if each.key == "initial.curvature"), None)
    if axis is None or axis.kind != "label":
        return None
    known = {value: _shape(plan, axis, float(value)) for value in np.unique(columns[axis.key])}
    return [known[value] for value in columns[axis.key]]


def _shape(plan: Plan, axis: Axis, value: float) -> Any:
    model, problems = plan.base.model, Problems(plan.document)
    given = {**plan.document.data.get("initial", {}), "curvature": axis.inserted(value)}
    si, folder = model.specimen is not None, plan.document.file.parent
    section = schema.validate(schema.Initial, given, ("initial",), problems, si=si)
    if section is None:
        return None
    start = initial(section, folder, model.scales.length, problems, si=si)
    return None if problems.within("initial") else start.curvature


def _start(plan: Plan, columns: dict[str, Array], shapes: list[Any] | None) -> _Start:
    """First states of all members."""
    base, count = plan.base, len(next(iter(columns.values())))
    natural = columns.get("initial.natural_curvature", np.full(count, float(np.asarray(base.natural_curvature))))
    factor = columns.get(AMPLITUDE, np.ones(count))
    if shapes is not None:
        angle = np.array(for_each(shapes, lambda shape: _angle(plan, shape)))
        made = [amplified(base.model, shape, float(one)) for shape, one in zip(shapes, factor, strict=True)]
        return _Start(made, natural, np.abs(factor) * angle, {})
    given, curvature = columns.get("initial.curvature"), base.curvature
    uniform = _constant(curvature) if given is None else given
    if uniform is not None:
        return _uniform(plan, uniform * factor, natural)
    if AMPLITUDE not in columns:
        return _Start(curvature, natural, np.full(count, _angle(plan, curvature)), {})
    angle = np.abs(factor) * _angle(plan, curvature)
    if isinstance(curvature, str):
        return _Start(f"amplitude*({curvature})", natural, angle, {"amplitude": factor})
    return _Start([amplified(base.model, curvature, float(one)) for one in factor], natural, angle, {})


def _constant(curvature: Any) -> float | None:
    """A curvature that is one number, in the user's units; None where it is a shape."""
    if isinstance(curvature, int | float):
        return float(curvature)
    if isinstance(curvature, str) and looks_like_quantity(curvature):
        return number(curvature, "1/m")
    return None


def _uniform(plan: Plan, curvature: Array, natural: Array) -> _Start:
    length = plan.base.model.scales.length
    return _Start(np.ascontiguousarray(curvature[:, None]), natural, np.abs(curvature) * length, {})


def _angle(plan: Plan, curvature: Any) -> float:
    """Largest tangent angle of an initial shape."""
    grid, mu = shape_at_nodes(plan, curvature)
    return float(np.abs(grid.even_integrals @ mu).max())


def _thrust(plan: Plan, columns: dict[str, Array]) -> Any:
    """What members are pushed by: numbers, or programs (None what cannot be read); None where all are pushed alike."""
    axes = [axis for axis in plan.axes if axis.path[:2] == ("load", "thrust")]
    if not axes:
        return None
    if len(axes) == 1 and axes[0].key == "load.thrust" and axes[0].kind != "label":
        return np.ascontiguousarray(columns["load.thrust"])
    rows = np.stack([columns[axis.key] for axis in axes], axis=1)
    some, which = np.unique(rows, axis=0, return_inverse=True)
    made = [_program(plan, axes, row) for row in some]
    return [made[i] for i in which.ravel()]


def _program(plan: Plan, axes: list[Axis], row: Array) -> Program | None:
    """The thrust of a member, read from its section [load] as the whole scenario's reader would."""
    one = replace(plan, members=replace(plan.members, axes=tuple(axes)))
    model, problems = plan.base.model, Problems(plan.document)
    si = model.specimen is not None
    with problems.at("load"):
        section = schema.validate(schema.Load, one.changed(row).data["load"], ("load",), problems, si=si)
        made = None if section is None else load(section, problems, si=si)
        if made is not None:
            made.check(plan.base.plan.end * model.scales.time)
        return None if made is None or problems.within("load") else made.thrust
    return None


def _pushed(strut: Strut, thrust: Any, end: float, count: int) -> NDArray[np.bool_]:
    """Which members are under thrust alone at the end."""
    if thrust is None:
        present = np.full(count, float(strut.load.thrust(end)))
    elif isinstance(thrust, np.ndarray):
        present = thrust
    else:
        present = np.array([float(program(end)) for program in thrust])
    return thrust_alone(strut.loads, present)


def _last(found: Any) -> dict[str, Array]:
    """What is told of the last states."""
    return {name: values if (values := found[name].values).ndim == 1 else values[:, -1] for name in FINAL}


def _fill(made: Columns, usable: NDArray[np.bool_], plan: Plan, found: Any) -> None:
    """Put what was found where the store wants it."""
    for name, values in _last(found).items():
        if name in made:
            made[name][usable] = values
    for name in ("steps", "nodes", "time_reached", "curvature", "limit_natural_curvature"):
        if name in made:
            made[name][usable] = found[name].values
    for name, codes, other in (("status", STATUSES, "solver_failed"), ("method", METHODS, "none")):
        made[name][usable] = _codes(found[name].values, codes, other)
    if "limit_kind" in made:
        made["limit_kind"][usable] = _codes(found["limit_kind"].values, LIMITS, "none")
        stable = found["limit_stable"].values
        made["limit_stable"][usable] = np.where(stable < 0, 2, stable)
    if plan.times is not None:
        at = np.searchsorted(found["t"].values, plan.times)
        for name in HISTORY:
            made[f"{name}_history"][usable] = found[name].values[:, at]


def _codes(words: NDArray[Any], known: tuple[str, ...], other: str) -> NDArray[np.int8]:
    place = {word: code for code, word in enumerate(known)}
    return np.array([place.get(str(word), place[other]) for word in words], dtype=np.int8)


def _rows(
    strut: Strut, last: dict[str, Array], start: _Start, own: dict[str, Array], pushed: NDArray[np.bool_]
) -> Rows:
    """What decides what becomes of the members."""
    scales = strut.scales
    first = (start.natural * scales.length) * scales.curvature
    laws = batch_laws(strut, tuple(own), np)
    with np.errstate(all="ignore"):
        relaxed = laws.preference_slope(last["natural_curvature"] / scales.curvature, *own.values()) * scales.drive
    return Rows(
        pushed=pushed,
        angle=last["largest_angle"],
        began=np.maximum(start.angle, np.abs(start.natural * scales.length)),
        moved=last["natural_curvature"] != first,
        drive=last["drive"],
        let_go=last["drive"],
        relaxed=relaxed,
        threshold=last["threshold"],
    )
