"""What of a run stays in memory: all of it while it is small, then only what its result needs.

Where the times of the result are given, and the states of the whole run would take more than `WHOLE`, a leg keeps the
steps in which one of these times lies, its first and its last one, those in which the tip passes a quarter turn, those
with the largest curvatures, and the one that the grid resolves least: dataset, events, verdict, bounds and status come
out the same, and memory grows with times and events, not with steps. The checkpoint keeps every step in any case.
Where no times are given the states go into a file beside the checkpoint, from which the system takes and drops them.
"""

from __future__ import annotations

import tempfile
from dataclasses import replace
from pathlib import Path
from typing import IO, Final

import numpy as np
from numpy.typing import NDArray

from plastica.errors import unusable
from plastica.motion.history import History
from plastica.motion.integrate import Leg
from plastica.physics.model import Model
from plastica.physics.resolution import coarsest

__all__ = ["WHOLE", "Retention", "needed_steps"]

Array = NDArray[np.float64]

WHOLE: Final = 2**28
"""Bytes of states up to which a run is kept whole in memory: more than all but very long runs take."""


class Retention:
    """The legs of a run as they are kept.

    Parameters
    ----------
    model : Model
        The model, on the grid of the run.
    times : ndarray, shape (k,), or None
        Dimensionless times of the result, increasing; None keeps everything.
    folder : Path or None
        The folder of the checkpoint, for the states of a run that is kept whole and large; None keeps all in memory.
    """

    def __init__(self, model: Model, times: Array | None, folder: Path | None = None) -> None:
        self.model, self.times, self.folder = model, times, folder
        self.legs: list[Leg] = []
        self.met = np.zeros(model.layout.size)
        """Largest magnitude of every component of the accepted states."""
        self._bytes, self._lightened = 0, 0
        self._file: IO[bytes] | None = None

    @property
    def steps(self) -> int:
        """The number of steps taken."""
        return sum(leg.steps for leg in self.legs)

    @property
    def whole(self) -> bool:
        """Whether every step is kept."""
        return self.times is None or self._bytes <= WHOLE

    def add(self, leg: Leg) -> None:
        """Take a finished leg."""
        history = leg.history
        self.met = np.maximum(self.met, np.abs(history.y[history.accepted]).max(axis=0))
        self._bytes += history.y.nbytes
        self.legs.append(leg)
        if self._bytes <= WHOLE:
            return
        lighter = self._thinned if not self.whole else self._on_disk if self.folder is not None else None
        if lighter is not None:
            for i in range(self._lightened, len(self.legs)):
                self.legs[i] = lighter(self.legs[i])
            self._lightened = len(self.legs)

    def history(self) -> History:
        """Return the legs' histories as one."""
        parts = [leg.history for leg in self.legs]
        if self._file is None:
            return History.join(parts)
        joined = History.join([replace(part, y=part.y[:, :0]) for part in parts])
        shape = (joined.t.size, self.model.layout.size)
        return replace(joined, y=np.memmap(self._file, dtype=float, mode="r", shape=shape))

    def close(self) -> None:
        """Let go of the file of the states; a history that was made of it keeps its own hold."""
        if self._file is not None:
            self._file.close()

    def _thinned(self, leg: Leg) -> Leg:
        if self.times is None or leg.history.steps == 0:
            return leg
        kept = needed_steps(leg.history, self.times, self.model)
        kept[[0, -1]] = True
        return replace(leg, history=leg.history.only(kept), taken=leg.steps)

    def _on_disk(self, leg: Leg) -> Leg:
        """Write the states of a leg behind those before it; all that stays is the last one."""
        history = leg.history
        try:
            if self._file is None:
                # It has no name: it vanishes with the last that uses it, however that ends.
                self._file = tempfile.TemporaryFile(dir=self.folder)  # noqa: SIM115  (`close` does it)
            if history.steps:
                self._file.write(np.ascontiguousarray(history.y).data)
                self._file.flush()
        except OSError as error:
            raise unusable(self.folder, "written", error) from None
        # A copy: a view of the last state would hold all of them.
        last = history.y[-1].copy()
        return replace(leg, history=replace(history, y=np.broadcast_to(last, history.y.shape)))


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
