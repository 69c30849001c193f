"""Legs of a long run on disk, so that whatever kills it, it can be taken up again and end the same to the last bit.

Each segment is an .npz file of one or more finished legs, written aside and renamed: a killed run leaves whole
segments or none. A leg starts from nothing but the last state of the one before it, so which legs were read back and
which computed makes no difference to the result.
"""

from __future__ import annotations

import hashlib
import json
import math
import time
import zipfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any, cast

import numpy as np

from plastica.errors import ArgumentError, FileError
from plastica.files import as_path, write_whole
from plastica.motion.history import History
from plastica.motion.integrate import Ending, Leg
from plastica.physics.amounts import plain

__all__ = ["Checkpoint", "fingerprint"]

NAME = "legs-{:06d}.npz"
PATTERN = "legs-*.npz"


def fingerprint(problem: dict[str, Any], *arrays: np.ndarray) -> str:
    """Return a digest of all that determines a run: its description and its first state, to the bit."""
    digest = hashlib.sha256(json.dumps(problem, sort_keys=True).encode())
    for array in arrays:
        digest.update(np.ascontiguousarray(array).tobytes())
    return digest.hexdigest()


class Checkpoint:
    """A folder of segments of one run.

    Parameters
    ----------
    folder : str or Path
        Made if it does not exist (its parent must).
    identity : str
        `fingerprint` of the run; segments of another run are never mixed in.
    every : float
        Seconds between two segments: what a kill can cost at most. 0 writes every leg.

    Raises
    ------
    ArgumentError
        Where the folder is no path, or `every` no finite number from 0 on.
    FileError
        Where the folder cannot be made.
    """

    def __init__(self, folder: str | Path, identity: str, *, every: float = 5.0) -> None:
        self.folder, self.identity, self.every = as_path(folder, "checkpoint"), identity, _seconds(every)
        try:
            self.folder.mkdir(exist_ok=True)
        except (OSError, ValueError) as error:
            reason = getattr(error, "strerror", None) or error
            raise FileError(f"cannot be made a folder: {reason}", where=str(folder)) from None
        self._waiting: list[Leg] = []
        self._next = 0
        self._written = time.monotonic()

    def load(self) -> list[Leg]:
        """Return the legs on disk, up to the first segment that is missing or damaged.

        Raises
        ------
        FileError
            Where the segments belong to another run.
        """
        legs: list[Leg] = []
        self._next = 0
        while (path := self.folder / NAME.format(self._next)).is_file():
            found = self._segment(path)
            if found is None:
                break
            legs += found
            self._next += 1
        return legs

    def clear(self, *, keep_folder: bool = False) -> None:
        """Remove the segments, and the folder if nothing else is in it."""
        for path in self.folder.glob(PATTERN):
            path.unlink()
        self._next, self._waiting = 0, []
        if not keep_folder and not any(self.folder.iterdir()):
            self.folder.rmdir()

    def keep(self, leg: Leg) -> None:
        """Take a finished leg, and write what waits if it is time."""
        self._waiting.append(leg)
        if time.monotonic() - self._written >= self.every:
            self.flush()

    def flush(self) -> None:
        """Write what waits."""
        if self._waiting:
            legs, self._waiting = self._waiting, []
            write_whole(self.folder / NAME.format(self._next), lambda aside: self._write(aside, legs))
            self._next += 1
        self._written = time.monotonic()

    def _write(self, aside: Path, legs: Sequence[Leg]) -> None:
        arrays: dict[str, Any] = {"identity": np.array(self.identity), "count": np.array(len(legs))}
        for i, leg in enumerate(legs):
            described = (leg.ending, leg.moving, leg.moving_next, leg.message, leg.rates, leg.jacobians)
            arrays[f"leg{i}"] = np.array(json.dumps(described))
            arrays[f"t{i}"], arrays[f"y{i}"], arrays[f"first{i}"] = (
                leg.history.t,
                leg.history.y,
                leg.history.first,
            )
        with aside.open("wb") as stream:
            np.savez(stream, **arrays)

    def _segment(self, path: Path) -> list[Leg] | None:
        """Read one segment; None where it is damaged (its legs are then computed anew)."""
        try:
            with path.open("rb") as stream, np.load(stream, allow_pickle=False) as archive:
                identity = str(archive["identity"])
                legs = [self._leg(archive, i) for i in range(int(archive["count"]))]
        except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile):
            return None
        if identity != self.identity:
            raise FileError(
                "holds the checkpoint of another run (scenario, tolerances or versions differ)",
                where=str(self.folder),
                next_step="Run without resuming to start afresh.",
            )
        return legs

    @staticmethod
    def _leg(archive: Any, i: int) -> Leg:
        ending, moving, moving_next, message, rates, jacobians = json.loads(str(archive[f"leg{i}"]))
        history = History(archive[f"t{i}"], archive[f"y{i}"], archive[f"first{i}"])
        return Leg(history, cast(Ending, ending), tuple(moving), tuple(moving_next), message, rates, jacobians)


def _seconds(every: object) -> float:
    seconds = plain(every)
    if not isinstance(seconds, float) or not math.isfinite(seconds) or seconds < 0.0:
        raise ArgumentError(
            "must be a finite number of seconds, 0 or more",
            where="checkpoint_every",
            value=every,
            next_step="0 keeps every leg; the default is 5.",
        )
    return seconds
