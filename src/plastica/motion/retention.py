"""What of a run stays in memory: all of it while it is small, then only what its result needs.

Where the times of the result are given, and the states of the whole run would take more than `WHOLE`, a leg keeps the
steps in which one of these times lies, its first and its last one, those in which the tip passes a quarter turn, those
with the largest curvatures, and the one that the grid resolves least: dataset, events, verdict, bounds and status come
out the same, and memory grows with times and events, not with steps. The checkpoint keeps every step in any case.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Final

import numpy as np
from numpy.typing import NDArray

from plastica.motion.history import History
from plastica.motion.integrate import Leg
from plastica.physics.model import Model
from plastica.physics.resolution import coarsest

__all__ = ["WHOLE", "Retention", "needed_steps"]

Array = NDArray[np.float64]

WHOLE: Final = 2**28
"""Bytes of states up to which a run is kept whole: more than all but very long runs take."""


class Retention:
    """The legs of a run as they are kept.

    Parameters
    ----------
    model : Model
        The model, on the grid of the run.
    times : ndarray, shape (k,), or None
        Dimensionless times of the result, increasing; None keeps everything.
    """

    def __init__(self, model: Model, times: Array | None) -> None:
        self.model, self.times = model, times
        self.legs: list[Leg] = []
        self._bytes = 0

    @property
    def whole(self) -> bool:
        """Whether every step is kept."""
        return self.times is None or self._bytes <= WHOLE

    def add(self, leg: Leg) -> None:
        """Take a finished leg."""
        was_whole = self.whole
        self._bytes += leg.history.y.nbytes
        self.legs.append(leg)
        if not self.whole:
            new = range(len(self.legs)) if was_whole else [len(self.legs) - 1]
            for i in new:
                self.legs[i] = self._thinned(self.legs[i])

    def history(self) -> History:
        """Return the legs' histories as one; the legs' own are given up as they are joined."""
        parts = [leg.history for leg in self.legs]
        return parts[0] if len(parts) == 1 else History.join(parts)

    def _thinned(self, leg: Leg) -> Leg:
        if self.times is None or leg.history.steps == 0:
            return leg
        kept = needed_steps(leg.history, self.times, self.model)
        kept[[0, -1]] = True
        return replace(leg, history=leg.history.only(kept), taken=leg.steps)


def needed_steps(history: History, times: Array, model: Model) -> NDArray[np.bool_]:
    """Return which steps of a history the times, the quarter turns of the tip and the bounds need; shape (steps,)."""
    first, last = history.first[:-1], history.first[1:] - 1
    lower, upper = history.t[first], history.t[last]
    needed = np.searchsorted(times, lower, side="left") < np.searchsorted(times, upper, side="right")
    mu, natural = model.layout.mu(history.y), np.atleast_2d(model.layout.natural(history.y).T).T
    tip = np.abs(mu @ model.grid.w) < 0.5 * np.pi
    # A step ends in the state with which the next one begins.
    turns = np.maximum.reduceat(tip, first) & ~np.minimum.reduceat(tip, first)
    sizes = (np.abs(mu).max(axis=1), mu**2 @ model.grid.w, np.abs(natural).max(axis=1))
    largest = [int(np.searchsorted(last, size.argmax())) for size in sizes]
    needed |= turns
    needed[[*largest, coarsest(model, upper, mu[last])]] = True
    return np.asarray(needed)
