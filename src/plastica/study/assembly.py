"""The checks that need the whole rod: times, loads, first state, variables, admissibility."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from plastica.errors import ArgumentError, shown
from plastica.material.admissibility import Verdict
from plastica.motion.dataset import VARIABLES
from plastica.motion.itinerary import itinerary
from plastica.motion.plan import Plan, Problem, make_plan, make_problem, met_start
from plastica.motion.solution import Solution
from plastica.motion.solve import MOST_STEPS
from plastica.numerics.grid import AUTO_NODES, LARGEST_SIZE
from plastica.physics.bounds import bounds
from plastica.physics.model import Model
from plastica.physics.rod import Rod
from plastica.study import schema
from plastica.study.building import Start, number, sorted_under
from plastica.study.problems import Problems

__all__ = ["available_variables", "check_loads", "check_output", "first_problem", "plan", "verdicts"]

Array = NDArray[np.float64]

MOST_TIMES = 10_000
STEPS_ALLOWED = 10_000_000
_OF_A_ROD = {"velocity_x", "velocity_y", "kinetic_energy", "clamp_force_x", "clamp_force_y", "clamp_couple"}

LARGEST_LOAD = 1e6
"""Dimensionless; Euler's load is 2.5, so that more is a mistake of units."""


def plan(
    model: Model, solve: schema.Solve, start: Solution | None, problems: Problems
) -> tuple[Plan | None, Array | None]:
    """Make the plan of the run, and the times of its result in the units of the scenario."""
    max_steps = MOST_STEPS if solve.max_steps is None else solve.max_steps
    if max_steps > STEPS_ALLOWED:
        problems.add(("solve", "max_steps"), f"must be at most {STEPS_ALLOWED}, but is {max_steps}.")
    with sorted_under(problems, "solve"), _as_force(problems):
        made = make_plan(model, solve.until, solve.rtol, solve.method, None, start, max_steps)
        times = _times(solve.times, model, made, problems)
        if times is not None:
            made = make_plan(model, solve.until, solve.rtol, solve.method, times, start, max_steps)
        return made, times
    return None, None


def _times(given: Any, model: Model, made: Plan, problems: Problems) -> Array | None:
    si, path = model.specimen is not None, ("solve", "times")
    if given is None:
        return None
    if isinstance(given, dict):
        checked = schema.validate(schema.Spacing, given, path, problems, si=si)
        return None if checked is None else _spread(checked, model, made)
    rows = schema.validate(schema.Times, {"times": given}, ("solve",), problems, si=si)
    if rows is None:
        return None
    return np.array([number(each, "s") for each in rows.times])


def _spread(spacing: schema.Spacing, model: Model, made: Plan) -> Array:
    """Times from the first to the last, evenly or in equal ratios of the time since the start."""
    if made.settle:
        raise ArgumentError(
            'can only be spread where `until` is a time, not "equilibrium"',
            where="times",
            next_step="Give the times as an array, or leave them out to get every step.",
        )
    if not 2 <= spacing.count <= MOST_TIMES:
        raise ArgumentError(f"must lie in [2, {MOST_TIMES}]", where="times.count", value=spacing.count)
    scale = model.scales.time
    first, last = made.t0 * scale, made.end * scale
    if spacing.spacing == "linear":
        if spacing.first is not None:
            raise ArgumentError('belongs to spacing = "log" only', where="times.first", value=spacing.first)
        return np.linspace(first, last, spacing.count)
    least = 1e-6 * (last - first) if spacing.first is None else number(spacing.first, "s")
    if not 0.0 < least < last - first:
        raise ArgumentError("must be positive and before the end", where="times.first", value=spacing.first)
    ladder = first + np.geomspace(least, last - first, spacing.count - 1)
    return np.concatenate([[first], ladder[:-1], [last]])


def check_loads(model: Model, made: Plan, problems: Problems) -> None:
    """Refuse loads that fail, or become tension that was not asked for, before the end of the run."""
    with sorted_under(problems, "load"), _as_force(problems), np.errstate(all="ignore"):
        model.loads.check(made.end)
        for name, program in model.loads.items():
            largest = max(map(abs, program.extreme(made.end)))
            if largest > LARGEST_LOAD:
                rule = f"must stay below {LARGEST_LOAD:g} times the rod's own measure of it (EI/L**2 for a force)"
                raise ArgumentError(rule, where=name, value=largest, next_step="Check its unit.")
        itinerary(model, made.t0, made.end)


@contextmanager
def _as_force(problems: Problems) -> Iterator[None]:
    """Name the force at an angle where the file has it, not the thrust and the transverse force it was made into."""
    try:
        yield
    except ArgumentError as error:
        if error.where not in ("thrust", "transverse") or ("load", "force") not in problems.document.lines:
            raise
        named = ArgumentError(error.rule, where="force", next_step=error.next_step)
        named.args = (str(error).replace(f"`{error.where}`", "`force`", 1),)
        raise named from None


def first_problem(model: Model, made: Plan, start: Start, atol: float | None, problems: Problems) -> Problem | None:
    """Make the first state on the grid, or on every grid that may be tried; return the coarsest."""
    auto = model.grid.nodes == "auto"
    found: list[Problem] = []
    with sorted_under(problems, "initial"), np.errstate(all="ignore"):
        curvature, rate = start.curvature, start.curvature_rate
        if auto:
            curvature, rate = met_start(model, curvature, rate)
        for nodes in AUTO_NODES if auto else (model.grid.per_element,):
            if found and nodes * found[0].strut.grid.elements > LARGEST_SIZE:
                most = LARGEST_SIZE // AUTO_NODES[-1]
                rule = f'must be a number where there are more than {most} elements, but is "auto".'
                problems.add(("grid", "nodes"), f"{rule} Write nodes = 16, or take fewer breaks.")
                break
            chosen = model.with_grid(model.grid.with_nodes(nodes)) if auto else model
            found.append(make_problem(chosen, made, curvature, start.natural_curvature, atol, start.solution, rate))
    # What nodes miss is told of the most that may be chosen.
    return replace(found[0], notes=found[-1].notes) if found else None


def available_variables(model: Model) -> tuple[str, ...]:
    """Return the names of the variables that a result of this model has."""
    missing = set() if isinstance(model, Rod) else _OF_A_ROD
    if model.material.well is None:
        missing = {*missing, "volume_fraction"}
    return tuple(name for name in VARIABLES if name not in missing)


def check_output(model: Model, output: schema.Output, problems: Problems) -> None:
    """Refuse names in `csv` that the result will not have, and a film that cannot be made here."""
    if output.film == "mp4" and shutil.which("ffmpeg") is None:
        rule = 'can be "mp4" only where ffmpeg is installed.'
        problems.add(("output", "film"), f'{rule} Install ffmpeg, or write film = "gif".')
    known = available_variables(model)
    for i, name in enumerate(output.csv):
        if name not in known:
            sentence = schema.unknown_key(name, known).removeprefix("is not a known key")
            problems.add(("output", "csv", i), f"must be a variable of the result, but is {shown(name)}{sentence}")


def verdicts(problem: Problem, made: Plan) -> tuple[Verdict, ...]:
    """Judge the hypotheses on the material, on the natural curvatures that the a-priori bound allows."""
    strut, layout, y = problem.strut, problem.strut.layout, problem.y0
    with np.errstate(all="ignore"):
        found = bounds(strut, layout.mu(y), layout.natural(y), made.t0, made.end, layout.mu_t(y))
        limit = found.natural_curvature
        usable = np.isfinite(limit) and limit > 0.0
        return strut.material.admissibility(float(limit * strut.scales.curvature) if usable else None)
