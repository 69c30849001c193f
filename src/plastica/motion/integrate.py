"""A motion in legs: stretches of time on which the problem is smooth, each started afresh.

A leg ends where a load jumps or bends, where yielding starts or stops, and after a fixed number of steps. Since every
leg starts from nothing but its first state, a run taken up again at a leg's end repeats the arithmetic of the
uninterrupted run bit for bit; and a natural curvature that is frozen stays the same to the last bit.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import pairwise
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from plastica.motion.history import History, chebyshev_points
from plastica.physics.kernel import Kernel, kernel
from plastica.physics.strut import Strut

__all__ = ["METHODS", "Leg", "Options", "integrate"]

Array = NDArray[np.float64]
Stop = Callable[[float, Array, Kernel], bool]

METHODS = ("LSODA", "DOP853", "Radau", "BDF")
"""SciPy's solvers that a run may use; "auto" is LSODA, the fastest at equal error in every measured case."""

Ending = Literal["landed", "switched", "full", "stopped", "solver_failed", "not_finite"]


@dataclass(frozen=True)
class Options:
    """How to integrate: method, tolerances (atol per component), steps in a leg, longest step."""

    method: str
    rtol: float
    atol: Array
    leg_steps: int = 2000
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
        "stopped" (by the stop criterion), "solver_failed", "not_finite".
    moving : bool
        Whether the natural curvature moves at the start of the leg.
    moving_next : bool
        Whether it moves at the start of what follows.
    message : str
        The solver's own words where it failed.
    rates, jacobians : int
        Evaluations spent.
    """

    history: History
    ending: Ending
    moving: bool
    moving_next: bool
    message: str
    rates: int
    jacobians: int


def integrate(
    strut: Strut,
    y: Array,
    times: tuple[float, ...],
    options: Options,
    *,
    moving: bool | None = None,
    stop: Stop | None = None,
) -> Iterator[Leg]:
    """Advance the state through `times`, yielding leg after leg.

    Parameters
    ----------
    strut : Strut
        The model, on a grid with a number of nodes.
    y : ndarray, shape (n + 4,)
        State at times[0], as in `physics.kernel`.
    times : tuple of float
        Start, the knots of the loads to land on, and the end; increasing.
    options : Options
        Method and tolerances.
    moving : bool, optional
        Whether the natural curvature moves at the start; None looks at the state. A run taken up again passes the
        former leg's `moving_next`.
    stop : callable, optional
        Called after every step with (t, y, kernel); a true value ends the run.

    Yields
    ------
    Leg
        The last one tells by its `ending` how it all ended.
    """
    for start, end in pairwise(times):
        kern = kernel(strut, start, end)
        t = start
        if moving is None:
            moving = kern.excess(y)[1] > 0.0
        if stop is not None and stop(t, y, kern):
            yield Leg(History.at_rest(t, y), "stopped", moving, moving, "", 1, 0)
            return
        while t < end:
            leg = _leg(kern, t, y, end, options, moving, stop)
            yield leg
            t, y, moving = leg.history.end, leg.history.y[-1], leg.moving_next
            if leg.ending not in ("landed", "switched", "full"):
                return


def _solver(kern: Kernel, t: float, y: Array, end: float, options: Options) -> Any:
    from scipy.integrate import BDF, DOP853, LSODA, Radau

    common: dict[str, Any] = {"rtol": options.rtol, "atol": options.atol, "max_step": options.longest_step}
    if options.method == "DOP853":
        return DOP853(kern.rate, t, y, end, **common)
    kind = {"LSODA": LSODA, "Radau": Radau, "BDF": BDF}[options.method]
    return kind(kern.rate, t, y, end, jac=kern.jacobian, **common)


def _degree(dense: Any, method: str) -> int:
    """Degree of the polynomial that a solver's dense output is on one step."""
    if method == "LSODA":
        return max(1, int(dense.p[-1]))
    if method == "BDF":
        return max(1, int(dense.order))
    return {"DOP853": 7, "Radau": 3}[method]


class _Recorder:
    """Collects the nodes of the steps of one leg."""

    def __init__(self, t: float, y: Array, method: str) -> None:
        self.method = method
        self.times: list[Array] = []
        self.states: list[Array] = []
        self.start = t, y

    @property
    def steps(self) -> int:
        return len(self.times)

    def add(self, dense: Any, lower: float, upper: float, last: Array) -> None:
        points = chebyshev_points(_degree(dense, self.method))
        times = lower + (upper - lower) * points
        times[-1] = upper
        # Row order is part of the result: sums over strided rows round otherwise than over those read from a file.
        states = np.ascontiguousarray(dense(times).T)
        states[-1] = last
        if not self.times:
            states[0] = self.start[1]
        self.times.append(times)
        self.states.append(states)

    def history(self) -> History:
        if not self.times:
            return History.at_rest(*self.start)
        first = np.cumsum([0] + [times.size for times in self.times]).astype(np.int64)
        return History(np.concatenate(self.times), np.concatenate(self.states), first)


def _leg(kern: Kernel, t: float, y: Array, end: float, options: Options, moving: bool, stop: Stop | None) -> Leg:
    started_moving = moving
    record = _Recorder(t, y, options.method)
    ending: Ending = "full"
    message = ""
    with warnings.catch_warnings(record=True) as caught, np.errstate(all="ignore"):
        warnings.simplefilter("always")
        solver = _solver(kern, t, y, end, options)
        while record.steps < options.leg_steps:
            message = solver.step() or ""
            if solver.status == "failed":
                ending = "solver_failed"
                break
            lower, upper, last = solver.t_old, solver.t, solver.y
            if upper == lower:
                ending, message = "solver_failed", "its step became too small to change the time"
                break
            if not np.isfinite(last).all():
                ending = "not_finite"
                break
            dense = solver.dense_output()
            if (kern.excess(last)[1] > 0.0) != moving:
                switch = _switch(kern, dense, lower, upper, moving)
                moving = not moving
                if switch > t:
                    _land(record, dense, lower, switch, frozen=moving)
                    ending = "switched"
                    break
            record.add(dense, lower, upper, last)
            if stop is not None and stop(upper, last, kern):
                ending = "stopped"
                break
            if solver.status == "finished":
                ending = "landed"
                break
    if ending == "solver_failed" and caught:
        message = f"{message} {caught[-1].message}".strip()
    return Leg(record.history(), ending, started_moving, moving, message, int(solver.nfev), int(solver.njev))


def _switch(kern: Kernel, dense: Any, lower: float, upper: float, moving: bool) -> float:
    """Time at which the drive passes its threshold, on the frozen side; `lower` where it already had."""
    from scipy.optimize import brentq

    def excess(t: float) -> float:
        return kern.excess(dense(t))[1]

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


def _land(record: _Recorder, dense: Any, lower: float, switch: float, *, frozen: bool) -> None:
    """Record the part of the last step up to the switch; what was frozen until then is kept to the last bit."""
    if switch > lower:
        record.add(dense, lower, switch, dense(switch))
    if frozen:
        n = record.start[1].size - 4
        record.states[-1][:, n] = record.start[1][n]
        record.states[-1][:, n + 3] = record.start[1][n + 3]
