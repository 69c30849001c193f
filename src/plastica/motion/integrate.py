"""A motion in legs: stretches of time on which the problem is smooth, each started afresh.

A leg ends where a load jumps or bends, where yielding starts or stops, and after a fixed number of steps. Its solver
counts time from its start: how short a step may be, and how long the first one is, does not depend on when it comes.
Since every leg starts from nothing but its first state, a run taken up again at a leg's end repeats the arithmetic of
the uninterrupted run bit for bit. What does not yield at the start of a leg is held on it, to the last bit.
"""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from plastica.motion.history import History, chebyshev_points
from plastica.motion.instant import Instant, split
from plastica.motion.switches import Lookout, first_switch
from plastica.physics.kernel import Kernel, Rate, kernel
from plastica.physics.layout import Layout
from plastica.physics.model import Model

__all__ = ["METHODS", "Ending", "Leg", "Options", "Stop", "Stretch", "integrate"]

Array = NDArray[np.float64]

METHODS = ("LSODA", "DOP853", "Radau", "BDF", "Gauss")
"""SciPy's solvers that a run may use, and Gauss collocation; which of them "auto" is, see `motion.plan`."""

Ending = Literal["landed", "switched", "full", "at_rest", "too_coarse", "solver_failed", "not_finite"]
Stop = Callable[[float, Array, Kernel], Ending | None]
"""Looks at every accepted state; what it returns ends the run."""

TURNS = 3
"""How often, at the very start of a leg, what moves may turn out to be wrong by rounding."""

FINE = 2.0**-33
"""Of the time since the start of a leg: where a step is shorter its ends are not sharp, and the leg ends with it."""


@dataclass(frozen=True)
class Options:
    """How to integrate: method, tolerances (atol per component), steps in a leg and in all."""

    method: str
    rtol: float
    atol: Array
    leg_steps: int = 2000
    most_steps: int = 200_000


@dataclass(frozen=True)
class Stretch:
    """A stretch of time without a jump of a load, and the longest step that overlooks no change of one."""

    start: float
    end: float
    longest_step: float = np.inf


@dataclass(frozen=True, eq=False)
class Leg:
    """One leg of a motion.

    Attributes
    ----------
    history : History
        The state on the leg, its first and last state included.
    ending : str
        "landed" on the end asked for, "switched" between yielding and frozen, "full" (the steps of a leg are used up),
        "at_rest" or "too_coarse" (by the stop criterion), "solver_failed", "not_finite".
    moving : tuple of bool
        Whether the natural curvature of each segment moves at the start of the leg.
    moving_next : tuple of bool
        Whether it moves at the start of what follows.
    message : str
        The solver's own words where it failed.
    rates, jacobians : int
        Evaluations spent.
    taken : int or None
        Steps taken where the history keeps only some of them.
    """

    history: History
    ending: Ending
    moving: tuple[bool, ...]
    moving_next: tuple[bool, ...]
    message: str
    rates: int
    jacobians: int
    taken: int | None = None

    @property
    def steps(self) -> int:
        """The number of steps taken."""
        return self.history.steps if self.taken is None else self.taken


def integrate(
    model: Model,
    y: Array,
    stretches: Sequence[Stretch],
    options: Options,
    *,
    since: Instant | None = None,
    moving: tuple[bool, ...] | None = None,
    taken: int = 0,
    stop: Stop | None = None,
) -> Iterator[Leg]:
    """Advance the state through stretches of time, yielding leg after leg.

    Parameters
    ----------
    model : Model
        The model, on a grid with a number of nodes.
    y : ndarray, shape (size,)
        First state, as in `physics.layout`.
    stretches : sequence of Stretch
        Stretches that follow each other, within which no load jumps.
    options : Options
        Method and tolerances.
    since : Instant, optional
        Where to begin in the first stretch; by default at its start.
    moving : tuple of bool, optional
        Whether the natural curvature of each segment moves at the start; None looks at the state. A run taken up again
        passes the former leg's `moving_next`.
    taken : int
        Steps taken before; the run ends where they reach `options.most_steps`.
    stop : callable, optional
        Called at the start of every leg and after every step with (t, y, kernel); an ending ends the run.

    Yields
    ------
    Leg
        The last one tells by its `ending` how it all ended.
    """
    now = since or Instant(stretches[0].start)
    for stretch in stretches:
        kern = kernel(model, stretch.start, stretch.end)
        if moving is None:
            moving = kern.yields(y)
        while now.until(stretch.end) > 0.0:
            ending = None if stop is None else stop(now.t, y, kern)
            if ending is not None:
                yield Leg(History.at_rest(now, y), ending, moving, moving, "", 1, 0)
                return
            if taken >= options.most_steps:
                return
            record = _Recorder(now, y, options.method, model.layout, moving)
            leg = _leg(kern, record, stretch, options, options.most_steps - taken, stop)
            yield leg
            taken += leg.history.steps
            now, y, moving = leg.history.last, leg.history.y[-1], leg.moving_next
            if leg.ending not in ("landed", "switched", "full"):
                return
        now = Instant(stretch.end)


def _solver(kern: Kernel, record: _Recorder, stretch: Stretch, options: Options) -> Any:
    from scipy.integrate import BDF, DOP853, LSODA, Radau

    from plastica.numerics.gauss import Gauss

    y, frozen, length = record.y, record.frozen, record.start.until(stretch.end)
    offset, sound = record.start.since(stretch.start), kern.rate

    def held(t: float, y: Array) -> Array:
        out = sound(offset + t, y)
        for column in frozen:
            out[column] = 0.0
        return out

    def jacobian(t: float, y: Array) -> Array:
        # With the column of what does not move, pivoting would round that, too. Without it, its Newton steps are 0.
        out = kern.jacobian(offset + t, y)
        out[:, frozen] = 0.0
        out[frozen] = 0.0
        return out

    rate = held if frozen or offset else sound
    first = _first_step(kern, rate, jacobian, y, record.moving, length)
    if options.method == "Gauss":
        watch, longest = kern.watch(options.atol), stretch.longest_step
        solver = Gauss(rate, 0.0, y, length, jac=jacobian, rtol=options.rtol, watch=watch, max_step=longest)
        solver.h = min(solver.h, first)
        return solver
    common: dict[str, Any] = {"rtol": options.rtol, "atol": options.atol, "max_step": stretch.longest_step}
    if options.method != "DOP853":
        common["jac"] = jacobian
    kind = {"LSODA": LSODA, "DOP853": DOP853, "Radau": Radau, "BDF": BDF}[options.method]
    solver = kind(rate, 0.0, y, length, **common)
    # LSODA begins with steps of order 1, which are shorter.
    if options.method != "LSODA" and solver.h_abs > first:
        return kind(rate, 0.0, y, length, first_step=first, **common)
    return solver


def _first_step(kern: Kernel, rate: Rate, jacobian: Rate, y: Array, moving: tuple[bool, ...], length: float) -> float:
    """A quarter of the time for which what has just begun to yield does so, were its drive a parabola; else infinite.

    A longer step may pass over it all, and find nothing that moves.
    """
    fresh = [j for j, (each, moves) in enumerate(zip(kern.excess(y), moving, strict=True)) if moves and each <= 0.0]
    if not fresh:
        return math.inf
    moment = 1e-8 * min(1.0, length)
    slope = rate(0.0, y)
    bend = jacobian(0.0, y).dot(slope) + (rate(moment, y) - slope) / moment
    drive = kern.drives.linear[fresh]
    rising, turning = np.abs(drive.dot(slope)), np.abs(drive.dot(bend))
    lasts = 2.0 * float((rising / np.maximum(turning, 1e-300)).min())
    return min(max(0.25 * lasts, 1e-9 * min(1.0, length)), length)


class _Recorder:
    """Collects the accepted steps of one leg, and turns their dense outputs into a history at its end."""

    def __init__(self, start: Instant, y: Array, method: str, layout: Layout, moving: tuple[bool, ...]) -> None:
        self.method, self.start, self.y, self.layout, self.moving = method, start, y, layout, moving
        self.steps: list[tuple[Any, float, float, Array]] = []
        self.after: tuple[bool, ...] | None = None

    def switch(self, moving: tuple[bool, ...]) -> None:
        """Note what moves after the leg's end."""
        self.after = moving

    @property
    def frozen(self) -> list[int]:
        """Columns that do not change on the leg: natural curvatures that do not move, and what only they dissipate."""
        first = self.layout.natural_columns.start
        columns = [first + j for j, moves in enumerate(self.moving) if not moves]
        return columns if any(self.moving) else [*columns, self.layout.ledger_columns.stop - 1]

    def add(self, dense: Any, lower: float, upper: float, last: Array) -> None:
        self.steps.append((dense, lower, upper, last))

    def history(self, landing: float | None) -> History:
        """The steps on the clock of the run; the last ends at `landing` exactly where that is given."""
        if not self.steps:
            return History.at_rest(self.start, self.y)
        degrees = np.array([self._degree(dense) for dense, *_ in self.steps])
        first = np.concatenate([[0], np.cumsum(degrees + 1)]).astype(np.int64)
        lower, upper = (np.array([step[k] for step in self.steps]) for k in (1, 2))
        t, y = np.empty(first[-1]), np.empty((first[-1], self.y.size))
        for degree in np.unique(degrees):
            chosen = np.nonzero(degrees == degree)[0]
            nodes = first[chosen, None] + np.arange(degree + 1)
            times = lower[chosen, None] + (upper - lower)[chosen, None] * chebyshev_points(int(degree))
            times[:, -1] = upper[chosen]
            t[nodes] = times
            y[nodes] = self._states([self.steps[k][0] for k in chosen], times)
        y[first[1:] - 1] = [step[3] for step in self.steps]
        y[0] = self.y
        if self.after is not None:
            # The step that met the onset already holds some of what follows it: what was frozen keeps its bits.
            y[first[-2] :, self.frozen] = self.y[self.frozen]
        whole, rest = split(self.start, t)
        if landing is not None:
            whole[-1], rest[-1] = landing, 0.0
        return History(whole, y, first, rest)

    def _degree(self, dense: Any) -> int:
        """Degree of the polynomial that the solver's dense output is on one step."""
        if self.method == "LSODA":
            return max(1, int(dense.p[-1]))
        if self.method == "BDF":
            return max(1, int(dense.order))
        if self.method == "Gauss":
            return int(dense.degree)
        return {"DOP853": 7, "Radau": 3}[self.method]

    def _states(self, denses: list[Any], times: Array) -> Array:
        """Values of steps of one degree at their nodes; shape (steps, nodes, size)."""
        if self.method != "LSODA":
            return np.stack([np.ascontiguousarray(dense(t).T) for dense, t in zip(denses, times, strict=True)])
        # All Nordsieck arrays at once: one call for each step would cost a quarter of the whole run.
        end, h = np.array([dense.t for dense in denses]), np.array([dense.h for dense in denses])
        x = (times - end[:, None]) / h[:, None]
        powers = x[:, :, None] ** np.arange(denses[0].p.size)
        return np.asarray(powers @ np.stack([dense.yh for dense in denses]).transpose(0, 2, 1))


def _leg(kern: Kernel, record: _Recorder, stretch: Stretch, options: Options, allowed: int, stop: Stop | None) -> Leg:
    rates = jacobians = 0
    steps, lookout = min(options.leg_steps, allowed), Lookout(kern, options.method)
    ended: tuple[Ending, str] | None = None
    with warnings.catch_warnings(record=True) as caught, np.errstate(all="ignore"):
        warnings.simplefilter("always")
        for turns in range(TURNS, -1, -1):
            solver = _solver(kern, record, stretch, options)
            ended = _walk(kern, solver, record, lookout, steps, stop, turns > 0)
            rates, jacobians = rates + int(solver.nfev), jacobians + int(solver.njev)
            if ended is not None:
                break
    ending, message = ended or ("full", "")
    if ending == "solver_failed" and caught:
        message = f"{message} {caught[-1].message}".strip()
    history = record.history(stretch.end if ending == "landed" else None)
    return Leg(history, ending, record.moving, record.after or record.moving, message, rates, jacobians)


def _walk(
    kern: Kernel, solver: Any, record: _Recorder, lookout: Lookout, steps: int, stop: Stop | None, turn: bool
) -> tuple[Ending, str] | None:
    """Step to the end of a leg, and return how it ended; None where what moves was wrong from its start: turned now."""
    before = kern.excess(record.y)
    while len(record.steps) < steps:
        try:
            message = solver.step() or ""
        except ValueError as error:
            # SciPy's implicit solvers refuse a Jacobian that is not finite.
            return "solver_failed", str(error)
        lower, upper, last, after = solver.t_old, solver.t, solver.y, kern.excess(solver.y)
        trouble = _trouble(solver, message, after)
        if trouble is not None:
            return trouble
        dense = solver.dense_output()
        if lookout(dense, last, before, after, record.moving):
            found = first_switch(kern, dense, lower, upper, record.moving)
            if found is not None and found[0] > 0.0:
                if found[0] > lower:
                    record.add(dense, lower, found[0], dense(found[0]))
                record.switch(found[1])
                return "switched", ""
            if found is not None and turn:
                record.moving = found[1]
                return None
        record.add(dense, lower, upper, last)
        ending = None if stop is None else stop(record.start.t + upper, last, kern)
        if ending is None and solver.status == "finished":
            ending = "landed"
        if ending is not None:
            return ending, ""
        if upper - lower < FINE * upper:
            break
        before = after
    return "full", ""


def _trouble(solver: Any, message: str, after: Sequence[float]) -> tuple[Ending, str] | None:
    """Return how a step went wrong, if it did."""
    if solver.status == "failed":
        return "solver_failed", message
    if solver.t == solver.t_old:
        return "solver_failed", "its step became too small to change the time"
    return None if _finite(solver.y, after) else ("not_finite", "")


def _finite(state: Array, excess: Sequence[float]) -> bool:
    # All weights are positive: the means, and with them the drives, are finite only where every curvature is.
    if not all(math.isfinite(each) for each in excess):
        return False
    return math.isfinite(float(state.sum()))
