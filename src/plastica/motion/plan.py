"""What a run sets out to do: its times and tolerances, its first state, the knots it lands on."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from plastica.errors import ArgumentError
from plastica.motion.integrate import METHODS, Ending, Stop
from plastica.motion.itinerary import short_changes
from plastica.numerics.grid import Grid
from plastica.physics.amounts import plain
from plastica.physics.initial import (
    Curvature,
    NaturalCurvature,
    Shape,
    initial_natural_curvature,
    initial_shape,
    nodal_values,
)
from plastica.physics.kernel import Kernel
from plastica.physics.model import Model
from plastica.physics.narrow import met, missed, missing, swung, unbounded
from plastica.physics.rod import Rod
from plastica.units import quantity

if TYPE_CHECKING:
    from plastica.motion.solution import Solution

__all__ = [
    "LONGEST_WAIT",
    "Plan",
    "Problem",
    "Until",
    "check_max_steps",
    "check_method",
    "check_rtol",
    "make_plan",
    "make_problem",
    "met_start",
    "rest",
]

Array = NDArray[np.float64]
Until = float | str

SMALLEST_ATOL = 1e-290
"""Solvers divide by it: what is smaller would overflow."""

LIGHT = 1e-3
"""Damping over the square root of the inertia, about half the damping ratio of the lowest mode, below which Gauss is
faster than BDF at equal error."""

LONGEST_WAIT = 1e9
"""Dimensionless time after which `until="equilibrium"` gives up."""


@dataclass(frozen=True)
class Plan:
    """What does not depend on the grid: when to stop, how, and what to report."""

    t0: float
    end: float
    settle: bool
    rtol: float
    method: str
    times: Array | None
    """Times of the dataset in the user's units, as given."""
    max_steps: int


@dataclass(frozen=True)
class Problem:
    """A model on a definite grid with its first state."""

    strut: Model
    y0: Array
    atol: Array
    words: str
    notes: tuple[str, ...]
    first_natural: Array
    missed: float = 0.0
    """How far the free end is off for what the nodes miss of the first state, in L."""


def check_rtol(rtol: object) -> None:
    """Refuse a relative tolerance that no method here can keep, or that means nothing."""
    number = plain(rtol)
    # A number in single precision is not quite the decimal that was meant.
    if not (isinstance(number, float) and 0.999e-13 <= number <= 1.001e-2):
        raise ArgumentError("must lie in [1e-13, 1e-2]", where="rtol", value=rtol)


def check_method(method: object) -> None:
    """Refuse a method that is not offered."""
    if not isinstance(method, str) or method not in ("auto", *METHODS):
        raise ArgumentError(f"must be one of auto, {', '.join(METHODS)}", where="method", value=method)


def check_max_steps(max_steps: object) -> None:
    """Refuse a number of steps that is none."""
    if isinstance(max_steps, bool) or not isinstance(max_steps, (int, np.integer)) or max_steps < 1:
        raise ArgumentError("must be a positive integer", where="max_steps", value=max_steps)


def make_plan(
    model: Model,
    until: Until,
    rtol: float,
    method: str,
    times: Sequence[float] | Array | None,
    start: Solution | None,
    max_steps: int,
) -> Plan:
    """Check when to stop, how, and what to report.

    Raises
    ------
    ArgumentError
        Where one of them cannot be used.
    """
    check_rtol(rtol)
    check_method(method)
    check_max_steps(max_steps)
    if start is not None and not hasattr(start, "history"):
        raise ArgumentError("must be a Solution to go on from", where="start", value=start)
    t0 = 0.0 if start is None else start.history.end * start.model.scales.time / model.scales.time
    settle = isinstance(until, str) and until == "equilibrium"
    end = _settling_end(model, t0) if settle else _end(until, model, t0)
    if not model.load.is_constant:
        model.load.check(end * model.scales.time)
    chosen = _method(model) if method == "auto" else method
    return Plan(t0, end, settle, float(rtol), chosen, _times(times, model, t0, end), int(max_steps))


def _method(model: Model) -> str:
    """The fastest method at equal error, as measured, that does not fail.

    On rods with inertia LSODA, which starts every leg with explicit steps, gives up at some; and where damping is light
    BDF follows, or is unstable on, every mode of the grid.
    """
    if not isinstance(model, Rod) or not model.has_inertia:
        return "LSODA"
    inertia = (model.translational_inertia or 0.0) + (model.rotary_inertia or 0.0)
    return "Gauss" if model.damping < LIGHT * np.sqrt(inertia) else "BDF"


def _end(until: Until, model: Model, t0: float) -> float:
    scale = model.scales.time
    if isinstance(until, str):
        if model.specimen is None:
            raise ArgumentError(
                'must be a number of retardation times or "equilibrium" where there is no specimen',
                where="until",
                value=until,
            )
        seconds = quantity(until, "s", where="until", bare=False)
    else:
        seconds = plain(until)
        if not isinstance(seconds, float):
            raise ArgumentError('must be a time or "equilibrium"', where="until", value=until)
    end = seconds / scale
    if not (np.isfinite(end) and end > t0):
        raise ArgumentError(f"must be finite and later than the start, {t0 * scale:g}", where="until", value=until)
    return end


def _settling_end(model: Model, t0: float) -> float:
    settled = model.loads.settled
    if settled is None:
        raise ArgumentError(
            'can be "equilibrium" only where the loads become constant',
            where="until",
            next_step="Give a time, or a load that ends in a constant.",
        )
    if model.damping == 0.0:
        raise ArgumentError(
            'can be "equilibrium" only where there is damping: a purely elastic rod swings for ever',
            where="until",
            next_step="Give a time, or a damping.",
        )
    return max(t0, settled) + LONGEST_WAIT


def _times(times: ArrayLike | None, model: Model, t0: float, end: float) -> Array | None:
    if times is None:
        return None
    try:
        given = np.asarray(times, dtype=float) / model.scales.time
    except (TypeError, ValueError):
        raise ArgumentError("must be a sequence of numbers", where="times", value=times) from None
    asked = np.array(times, dtype=float)
    inside = given.ndim == 1 and given.size > 0 and np.isfinite(given).all()
    # A time that the user wrote as `until` must count as inside even where unit conversion rounded it up.
    slack = 4.0 * np.finfo(float).eps * end
    if not inside or np.any(np.diff(given) <= 0.0) or given[0] < t0 or given[-1] > end + slack:
        scale = model.scales.time
        raise ArgumentError(
            f"must increase within [{t0 * scale:g}, {end * scale:g}]",
            where="times",
            value=np.asarray(times).tolist(),
        )
    return asked


def make_problem(
    model: Model,
    plan: Plan,
    curvature: Curvature,
    natural_curvature: NaturalCurvature,
    atol: float | None,
    start: Solution | None,
    curvature_rate: Curvature = 0.0,
) -> Problem:
    """Bring the first state onto the model's grid, and set the tolerances.

    Raises
    ------
    ArgumentError
        Where the initial data cannot be used.
    """
    si, off = model.specimen is not None, 0.0
    narrow: tuple[str, ...] = ()
    if start is None:
        shape, grid = initial_shape(curvature, model.grid, model.scales, si=si)
        speed, grid = _initial_rate(curvature_rate, model, grid)
        strut = model if grid is model.grid else model.with_grid(grid)
        mu, words = nodal_values(shape, grid), shape.words
        mu_nat = initial_natural_curvature(natural_curvature, model.scales, si=si, segments=model.segments)
        y0 = strut.layout.pack(mu, mu_nat, None if speed is None else nodal_values(speed, grid, "curvature_rate"))
        off, narrow = _narrow(strut, shape, speed, plan.rtol)
        first = np.array(mu_nat)
    else:
        _refuse_starts(curvature=curvature, natural_curvature=natural_curvature, curvature_rate=curvature_rate)
        strut, y0 = _taken_up(model, start)
        words, first = "the last state of a former run", start.first_natural
    added = sorted(set(strut.grid.breaks) - set(model.grid.breaks))
    notes: tuple[str, ...] = ()
    if added:
        places = ", ".join(f"{b:.6g}" for b in added)
        notes = (f"element ends added at s = {places} L, where the shape jumps, bends or changes fast",)
    notes += narrow
    notes += short_changes(strut, plan.t0, plan.end)
    bending = ("transverse", "couple", *(("weight",) if strut.loads.weight_angle else ()))
    across = (program for name, program in strut.loads.sources() if name in bending)
    loads = max((max(map(abs, program.extreme(plan.end))) for program in across), default=0.0)
    amplitude = max(float(np.abs(y0[: strut.layout.natural_columns.stop]).max()), loads, _swing(strut, y0))
    return Problem(strut, y0, _tolerance(atol, plan.rtol, amplitude, strut), words, notes, first, off)


def met_start(model: Model, curvature: Curvature, curvature_rate: Curvature) -> tuple[Curvature, Curvature]:
    """Return curvature and rate of curvature with element ends where they are too narrow for nodes to be chosen."""
    grid, scales, si = model.grid, model.scales, model.specimen is not None
    return met(curvature, grid, scales, si=si), met(curvature_rate, grid, scales, si=si, where="curvature_rate")


def _narrow(strut: Model, shape: Shape, speed: Shape | None, rtol: float) -> tuple[float, tuple[str, ...]]:
    """How far the nodes put the free end off for what they miss of the first state, in L, and what is told of it."""
    off, length = missed(shape, strut.grid), strut.scales.length
    told = missing(shape, off, rtol, length) + unbounded(shape, length)
    if speed is None:
        return off, told
    later = missed(speed, strut.grid, swung) * _period(strut)
    where = "curvature_rate"
    return max(off, later), told + missing(speed, later, rtol, length, where) + unbounded(speed, length, where)


def _refuse_starts(**starts: Curvature | NaturalCurvature) -> None:
    for name, given in starts.items():
        if not (isinstance(plain(given), float) and given == 0.0):
            raise ArgumentError(
                "must not be given together with `start`, whose last state is gone on from", where=name, value=given
            )


def _initial_rate(given: Curvature, model: Model, grid: Grid) -> tuple[Shape | None, Grid]:
    """Read the initial rate of curvature; None where it is 0, and an error where the model has no inertia."""
    if isinstance(plain(given), float) and given == 0.0:
        return None, grid
    if not model.has_inertia:
        raise ArgumentError(
            "must be 0 without inertia: the rate of curvature then follows from the curvature",
            where="curvature_rate",
            value=given,
            next_step="Leave it out, or take a pl.Rod with an inertia.",
        )
    return initial_shape(given, grid, model.scales, si=model.specimen is not None, where="curvature_rate")


def _swing(strut: Model, y0: Array) -> float:
    """About the curvature that an initial rate of curvature leads to: the rate over a frequency."""
    mu_t = strut.layout.mu_t(y0)
    if mu_t is None or not isinstance(strut, Rod):
        return 0.0
    return float(np.abs(mu_t).max()) * _period(strut)


def _period(strut: Model) -> float:
    """About the time over which a rod with inertia swings: 1 over a frequency."""
    if not isinstance(strut, Rod):
        return 0.0
    return float(np.sqrt((strut.translational_inertia or 0.0) + (strut.rotary_inertia or 0.0)))


def _taken_up(model: Model, start: Solution) -> tuple[Model, Array]:
    """State of a former solution, on a grid that holds its elements too."""
    if (start.model.specimen is None) != (model.specimen is None):
        raise ArgumentError("must be a solution in the same kind of units as the model", where="start")
    ratio = model.scales.length / start.model.scales.length
    if abs(ratio - 1.0) > 1e-12:
        raise ArgumentError("must be a solution of a rod of the same length", where="start", value=1.0 / ratio)
    if start.model.segments != model.segments or start.model.division.breaks != model.division.breaks:
        raise ArgumentError("must be a solution of a rod with the same natural segments", where="start")
    if start.model.has_inertia != model.has_inertia:
        raise ArgumentError(
            "must be a solution with inertia where the model has it, and without where it has none",
            where="start",
            next_step="Give its last curvature as `curvature` to a fresh start.",
        )
    former = start.model.grid
    grid = model.grid.with_breaks(former.breaks)
    state, layout = start.history.y[-1], start.model.layout
    mu, mu_t = layout.mu(state), layout.mu_t(state)
    if grid.nodes == "auto" or grid.per_element != former.per_element or grid.breaks != former.breaks:
        carry = former.interpolation(grid.s)
        mu, mu_t = carry @ mu, None if mu_t is None else carry @ mu_t
    strut = model.with_grid(grid)
    # A rod measured in another time scale has the same rate of curvature in other units.
    rate = None if mu_t is None else mu_t * (model.scales.time / start.model.scales.time)
    return strut, strut.layout.pack(mu, layout.natural(state), rate)


def _tolerance(atol: float | None, rtol: float, amplitude: float, strut: Model) -> Array:
    """Absolute tolerance of each component: curvatures as given or by amplitude, energies as its square."""
    if atol is None:
        scale = amplitude if amplitude > 0.0 else 1.0
        curvature = 1e-3 * rtol * min(scale, 1.0)
        energy = 1e-3 * rtol * min(scale, 1.0) ** 2
    else:
        number = plain(atol)
        if not (isinstance(number, float) and 0.0 < number < np.inf):
            raise ArgumentError("must be a positive number or None", where="atol", value=atol)
        curvature = energy = number * strut.scales.length
    both = np.full(strut.layout.size, curvature)
    both[strut.layout.ledger_columns] = energy
    return np.asarray(np.maximum(both, SMALLEST_ATOL))


def rest(plan: Plan, problem: Problem, largest: float) -> Stop:
    """Return the criterion of rest: the rate is below rtol times the largest curvature met, under settled loads.

    A run that is to report certain times goes on to the last of them.

    Parameters
    ----------
    plan, problem
        What is run.
    largest : float
        Largest curvature met so far.
    """
    curvatures = slice(0, problem.strut.layout.natural_columns.stop)
    settled = max(plan.t0, problem.strut.loads.settled or 0.0)
    if plan.times is not None:
        settled = max(settled, float(plan.times[-1]) / problem.strut.scales.time)

    def resting(t: float, y: Array, kern: Kernel) -> Ending | None:
        nonlocal largest
        largest = max(largest, float(np.abs(y[curvatures]).max()))
        if t < settled:
            return None
        return "at_rest" if kern.unrest(t, y) <= plan.rtol * largest else None

    return resting
