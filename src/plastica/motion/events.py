"""What happened on the way, read off a finished history."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from plastica.motion.itinerary import landing_points
from plastica.motion.record import Event
from plastica.motion.yielding import moving_on_legs

if TYPE_CHECKING:
    from plastica.motion.solution import Solution

__all__ = ["events", "moments"]

MOST_KNOTS = 10_000

Array = NDArray[np.float64]


def events(solution: Solution) -> tuple[Event, ...]:
    """Return onsets and arrests of yielding, knots of the loads and quarter turns of the tip, in order of time.

    Onset and arrest are the switches at which the integrator landed, but for arrests after which the drive stays within
    the tolerance of the run below the threshold; a quarter turn, the passage of the tip angle
    through +-pi/2, is located on the history to rounding.
    """
    found = [*_yielding(solution), *_loads(solution), *_quarter_turns(solution)]
    return tuple(sorted(found, key=lambda event: event.t))


def moments(solution: Solution) -> Array:
    """Return the dimensionless times of events and knots within a solution, which its dataset shows with its steps.

    Of loads with more than 10 000 knots, only those on which the integrator landed.
    """
    strut, history = solution.model, solution.history
    knots = () if strut.loads.is_constant else strut.loads.knots(history.end)
    times = [event.t / strut.scales.time for event in _quarter_turns(solution)]
    if len(knots) <= MOST_KNOTS:
        times += [knot.t for knot in knots]
    found = np.array([t for t in times if history.start < t < history.end])
    steps = history.t[history.accepted]
    if found.size == 0:
        return found
    # What the integrator landed on is there already; rounding must not make it two.
    near = np.searchsorted(steps, found)
    gap = np.minimum(np.abs(found - steps[near - 1]), np.abs(steps[np.minimum(near, steps.size - 1)] - found))
    return np.unique(found[gap > 64.0 * np.spacing(found)])


def _yielding(solution: Solution) -> list[Event]:
    history = solution.history
    starts, moving = moving_on_legs(solution)
    out = []
    ends = np.append(starts[1:], history.end)
    for segment, flags in enumerate(moving.T):
        if flags[0]:
            out.append(_switch(solution, starts[0], segment, onset=True, sentence="yields from the start"))
        for before, after, t in zip(flags[:-1], flags[1:], ends, strict=True):
            if before != after:
                out.append(_switch(solution, t, segment, onset=bool(after), sentence=""))
    return out


def _switch(solution: Solution, t: float, segment: int, *, onset: bool, sentence: str) -> Event:
    strut, layout = solution.model, solution.model.layout
    state = solution.history([t])[0]
    drive = np.atleast_1d(strut.drive(layout.mu(state), layout.natural(state)))[segment]
    side = 1 if drive > 0.0 else -1
    words = sentence or ("starts to yield" if onset else "stops yielding")
    if strut.segments > 1:
        words = f"segment {segment + 1} {words}"
    toward = "positive" if side > 0 else "negative"
    return Event(float(t) * strut.scales.time, "onset" if onset else "arrest", side, f"{words}, drive {toward}")


def _loads(solution: Solution) -> list[Event]:
    strut, history = solution.model, solution.history
    landed = set(landing_points(strut, history.end))
    return [
        Event(
            knot.t * strut.scales.time,
            knot.kind,
            0,
            "a load jumps" if knot.kind == "jump" else "a load bends",
        )
        for knot in strut.loads.knots(history.end)
        if knot.t in landed and history.start < knot.t
    ]


def _quarter_turns(solution: Solution) -> list[Event]:
    from scipy.optimize import brentq

    strut, history = solution.model, solution.history
    n, w = strut.grid.size, strut.grid.w
    tip = history.y[:, :n] @ w
    out = []
    for side in (1, -1):
        beyond = tip * side - 0.5 * np.pi
        for i in np.nonzero((beyond[:-1] < 0.0) != (beyond[1:] < 0.0))[0]:
            lower, upper = history.t[i], history.t[i + 1]
            if upper <= lower:
                continue

            def gap(t: float, side: int = side) -> float:
                return float(history([t])[0, :n] @ w) * side - 0.5 * np.pi

            if gap(lower) * gap(upper) > 0.0:
                continue
            t = brentq(gap, lower, upper, xtol=1e-14)
            outward = beyond[i + 1] > beyond[i]
            words = "turns past" if outward else "comes back through"
            out.append(Event(t * strut.scales.time, "quarter_turn", side, f"the tip {words} {90 * side:+d} degrees"))
    return out
