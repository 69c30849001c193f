"""A motion in legs: stretches of time on which the problem is smooth, each started afresh.

A leg ends where a load jumps or bends, where yielding starts or stops, and after a fixed number of steps. Since every
leg starts from nothing but its first state, a run taken up again at a leg's end repeats the arithmetic of the
uninterrupted run bit for bit; and a natural curvature that is frozen stays the same to the last bit.
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
from plastica.physics.kernel import Kernel, kernel
from plastica.physics.layout import Layout
from plastica.physics.model import Model

__all__ = ["METHODS", "Ending", "Leg", "Options", "Stop", "Stretch", "integrate"]

Array = NDArray[np.float64]

METHODS = ("LSODA", "DOP853", "Radau", "BDF", "Gauss")
"""SciPy's solvers that a run may use, and Gauss collocation; which of them "auto" is, see `motion.plan`."""

Ending = Literal["landed", "switched", "full", "at_rest", "too_coarse", "solver_failed", "not_finite"]
Stop = Callable[[float, Array, Kernel], Ending | None]
"""Looks at every accepted state; what it returns ends the run."""


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
        State at the start of the first stretch, as in `physics.layout`.
    stretches : sequence of Stretch
        Stretches that follow each other, within which no load jumps.
    options : Options
        Method and tolerances.
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
    for stretch in stretches:
        kern = kernel(model, stretch.start, stretch.end)
        t, end = stretch.start, stretch.end
        if moving is None:
            moving = kern.yields(y)
        while t < end:
            ending = None if stop is None else stop(t, y, kern)
            if ending is not None:
                yield Leg(History.at_rest(t, y), ending, moving, moving, "", 1, 0)
                return
            if taken >= options.most_steps:
                return
            record = _Recorder(t, y, options.method, model.layout, moving)
            leg = _leg(kern, record, stretch, options, options.most_steps - taken, stop)
            yield leg
            taken += leg.history.steps
            t, y, moving = leg.history.end, leg.history.y[-1], leg.moving_next
            if leg.ending not in ("landed", "switched", "full"):
                return


def _solver(kern: Kernel, record: _Recorder, stretch: Stretch, options: Options) -> Any:
    from scipy.integrate import BDF, DOP853, LSODA, Radau

    from plastica.numerics.gauss import Gauss

    t, y, frozen = record.t, record.y, record.frozen

    def jacobian(t: float, y: Array) -> Array:
        # With the column of what does not move, pivoting would round that, too. Without it, its Newton steps are 0.
        out = kern.jacobian(t, y)
        out[:, frozen] = 0.0
        return out

    if options.method == "Gauss":
        watch, longest = kern.watch(options.atol), stretch.longest_step
        return Gauss(kern.rate, t, y, stretch.end, jac=jacobian, rtol=options.rtol, watch=watch, max_step=longest)
    common: dict[str, Any] = {"rtol": options.rtol, "atol": options.atol, "max_step": stretch.longest_step}
    if options.method == "DOP853":
        return DOP853(kern.rate, t, y, stretch.end, **common)
    kind = {"LSODA": LSODA, "Radau": Radau, "BDF": BDF}[options.method]
    return kind(kern.rate, t, y, stretch.end, jac=jacobian, **common)


class _Recorder:
    """Collects the accepted steps of one leg, and turns their dense outputs into a history at its end."""

    def __init__(self, t: float, y: Array, method: str, layout: Layout, moving: tuple[bool, ...]) -> None:
        self.method, self.t, self.y, self.layout, self.moving = method, t, y, layout, moving
        self.steps: list[tuple[Any, float, float, Array]] = []
        self.cut = False

    @property
    def frozen(self) -> list[int]:
        """Columns that do not change on the leg: natural curvatures that do not move, and what only they dissipate."""
        first = self.layout.natural_columns.start
        columns = [first + j for j, moves in enumerate(self.moving) if not moves]
        return columns if any(self.moving) else [*columns, self.layout.ledger_columns.stop - 1]

    def add(self, dense: Any, lower: float, upper: float, last: Array) -> None:
        self.steps.append((dense, lower, upper, last))

    def history(self) -> History:
        if not self.steps:
            return History.at_rest(self.t, self.y)
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
        if self.cut:
            # The step that met the onset already holds some of what follows it: what was frozen keeps its bits.
            y[first[-2] :, self.frozen] = self.y[self.frozen]
        return History(t, y, first)

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
    moving = record.moving
    ending: Ending = "full"
    message = ""
    with warnings.catch_warnings(record=True) as caught, np.errstate(all="ignore"):
        warnings.simplefilter("always")
        solver = _solver(kern, record, stretch, options)
        while len(record.steps) < min(options.leg_steps, allowed):
            message = solver.step() or ""
            if solver.status == "failed":
                ending = "solver_failed"
                break
            lower, upper, last = solver.t_old, solver.t, solver.y
            if upper == lower:
                ending, message = "solver_failed", "its step became too small to change the time"
                break
            excess = kern.excess(last)
            if not _finite(last, excess):
                ending = "not_finite"
                break
            dense = solver.dense_output()
            changed = [j for j, each in enumerate(excess) if (each > 0.0) != moving[j]]
            if changed:
                switch, moving = _first_switch(kern, dense, lower, upper, moving, changed)
                if switch > record.t:
                    if switch > lower:
                        record.add(dense, lower, switch, dense(switch))
                    record.cut = True
                    ending = "switched"
                    break
                record.moving = moving
            record.add(dense, lower, upper, last)
            stopped = None if stop is None else stop(upper, last, kern)
            if stopped is not None:
                ending = stopped
                break
            if solver.status == "finished":
                ending = "landed"
                break
    if ending == "solver_failed" and caught:
        message = f"{message} {caught[-1].message}".strip()
    return Leg(record.history(), ending, record.moving, moving, message, int(solver.nfev), int(solver.njev))


def _finite(state: Array, excess: Sequence[float]) -> bool:
    # All weights are positive: the means, and with them the drives, are finite only where every curvature is.
    if not all(math.isfinite(each) for each in excess):
        return False
    return math.isfinite(float(state.sum()))


def _first_switch(
    kern: Kernel, dense: Any, lower: float, upper: float, moving: tuple[bool, ...], changed: Sequence[int]
) -> tuple[float, tuple[bool, ...]]:
    """Time of the first of the switches that a step has passed, and what moves after it."""
    times = {j: _switch(kern, dense, lower, upper, moving[j], j) for j in changed}
    first = min(times.values())
    # Segments that switch together, such as those of a straight rod let go, do so in one leg.
    together = {j for j, t in times.items() if t - first <= 4.0 * np.spacing(first)}
    return first, tuple(moves != (j in together) for j, moves in enumerate(moving))


def _switch(kern: Kernel, dense: Any, lower: float, upper: float, moving: bool, segment: int) -> float:
    """Time at which a drive passes its threshold, on the frozen side; `lower` where it already had."""
    from scipy.optimize import brentq

    def excess(t: float) -> float:
        return kern.excess(dense(t))[segment]

    if (excess(lower) > 0.0) != moving:
        return lower
    if (excess(upper) > 0.0) == moving:
        return upper
    t = float(brentq(excess, lower, upper, xtol=1e-15, rtol=8.881784197001252e-16))
    # Onset must lie before the natural curvature has moved, arrest after it has stopped, to the last bit.
    direction, ulp = (1.0, np.spacing(t)) if moving else (-1.0, np.spacing(t))
    while excess(t) > 0.0 and lower < t < upper:
        t = min(max(t + direction * ulp, lower), upper)
        ulp *= 2.0
    return t
