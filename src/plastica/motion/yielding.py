"""When a motion yields, as far as its tolerance can tell.

Where drive and threshold agree to within the tolerance, as they do late in a motion toward a limiting equilibrium, the
errors of the steps alone take the drive below the threshold and back. The integration stops and starts yielding there,
as it must, but this says nothing of the rod: between an onset and the next arrest that can be told, it yields.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Final

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from plastica.motion.solution import Solution

__all__ = ["moving_on_legs"]

Array = NDArray[np.float64]

ROUNDING: Final = 64.0 * float(np.finfo(float).eps)
"""Relative error of the drive in which the tolerance has no part."""


def moving_on_legs(solution: Solution) -> tuple[Array, NDArray[np.bool_]]:
    """Return the start times of the legs, and whether each segment yields on them and after the last.

    Returns
    -------
    starts : ndarray, shape (legs,)
        Dimensionless.
    moving : ndarray of bool, shape (legs + 1, m)
        As the integration has it, but for stretches without yielding that follow on yielding and in which the drive
        stays below the threshold by no more than the tolerance of the run allows to tell: in these the rod yields.
    """
    starts, moving = solution.legs
    told = np.array(moving).reshape(starts.size + 1, -1)
    times = np.append(starts, solution.history.end)
    for segment, flags in enumerate(told.T):
        stops = np.flatnonzero(flags[:-1] & ~flags[1:]) + 1
        for first in stops:
            later = np.flatnonzero(flags[first:])
            end = first + int(later[0]) if later.size else flags.size
            if not _below(solution, float(times[first]), float(times[min(end, starts.size)]), segment):
                told[first:end, segment] = True
    return starts, told


def _below(solution: Solution, start: float, end: float, segment: int) -> bool:
    """Whether the drive of a segment falls below the threshold between two times, by more than the run's tolerance."""
    model, history = solution.model, solution.history
    first, last = np.searchsorted(history.t, [start, end])
    states = history.y[first : last + 1]
    mu, natural = model.layout.mu(states), model.layout.natural(states)
    drive, threshold = model.drive(mu, natural), model.threshold(natural)
    slope = model.laws.preference.slope(np.asarray(natural, dtype=float))
    terms = model.division.mean(np.abs(mu)) + np.abs(natural) + np.abs(slope) + threshold
    under = threshold - np.abs(drive) > max(solution.rtol, ROUNDING) * terms
    return bool(under.reshape(states.shape[0], -1)[:, segment].any())
