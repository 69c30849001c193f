"""Legs of a long run on disk, so that whatever kills it, it can be taken up again and end the same to the last bit.

Each segment is an .npz file of one or more finished legs, written aside and renamed: a killed run leaves whole
segments or none. A leg starts from nothing but the last state of the one before it, so which legs were read back and
which computed makes no difference to the result.

A segment bears the seal of the one that it continues, and a seal of its own over that and all that it holds: what is
read back is one unbroken run from the first state on. Where a segment is missing, damaged or continues another one, it
and all after it are removed, and their legs computed anew.
"""

from __future__ import annotations

import contextlib
import hashlib
import json
import math
import re
import struct
import time
import zipfile
import zlib
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, cast

import numpy as np

from plastica.errors import ArgumentError, FileError
from plastica.files import MARK, as_path, replace_whole
from plastica.locks import make_folder
from plastica.motion.history import History
from plastica.motion.integrate import Ending, Leg
from plastica.physics.amounts import plain

__all__ = ["Checkpoint", "fingerprint"]

NAME = "legs-{:06d}.npz"
PATTERN = "legs-*.npz"
OURS = re.compile(rf"legs-\d{{6,}}\.npz|\.legs-\d{{6,}}\.[a-z0-9_]{{8}}\.npz({re.escape(MARK)})?")
"""Segments, and what a killed process leaves of one that it was writing."""


MOST_WAITING = 2**26
"""Bytes of states that wait to be written at the most, however far apart segments shall be."""


UNREADABLE = (zipfile.BadZipFile, RuntimeError, zlib.error, struct.error)
"""What the library of archives raises where one bit of its headers is turned: "encrypted", "version", "compression"."""


def fingerprint(problem: dict[str, Any], *arrays: np.ndarray) -> str:
    """Return a digest of all that determines a run: its description and its first state, to the bit."""
    digest = hashlib.sha256(json.dumps(problem, sort_keys=True).encode())
    for array in arrays:
        digest.update(np.ascontiguousarray(array).tobytes())
    return digest.hexdigest()


class Checkpoint:
    """A folder of segments of one run, in which no other process may work: see `locks.held`.

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
        make_folder(self.folder)
        self._waiting: list[Leg] = []
        self._next, self._seal = 0, identity
        self._written = time.monotonic()

    def load(self) -> Iterator[Leg]:
        """Give the legs on disk up to the first segment that does not continue the one before it; remove the rest.

        Yields
        ------
        Leg
            One after another, so that no more of them than one segment need be in memory.

        Raises
        ------
        FileError
            Where the segments belong to another run.
        """
        self._next, self._seal = 0, self.identity
        while (path := self._path(self._next)).is_file() and (found := self._segment(path)) is not None:
            legs, self._seal = found
            self._next += 1
            yield from legs
        self._remove(kept=self._next)

    def clear(self, *, keep_folder: bool = False) -> None:
        """Remove the segments, and the folder if nothing else is in it."""
        self._remove(kept=0)
        self._next, self._seal, self._waiting = 0, self.identity, []
        if not keep_folder and not any(self.folder.iterdir()):
            self.folder.rmdir()

    def keep(self, leg: Leg) -> None:
        """Take a finished leg, and write what waits if it is time."""
        self._waiting.append(leg)
        size = sum(each.history.y.nbytes for each in self._waiting)
        if size > MOST_WAITING or time.monotonic() - self._written >= self.every:
            self.flush()

    def flush(self) -> None:
        """Write what waits."""
        if self._waiting:
            arrays = _arrays(self.identity, self._seal, self._waiting)
            seal = _seal(arrays)
            replace_whole(self._path(self._next), lambda aside: _write(aside, arrays | {"seal": np.array(seal)}))
            self._next, self._seal, self._waiting = self._next + 1, seal, []
        self._written = time.monotonic()

    def _path(self, number: int) -> Path:
        return self.folder / NAME.format(number)

    def _remove(self, *, kept: int) -> None:
        """Remove all segments but the first ones, and what was left of those that were being written."""
        names = {self._path(i).name for i in range(kept)}
        for path in self.folder.iterdir():
            if OURS.fullmatch(path.name) and path.name not in names:
                with contextlib.suppress(FileNotFoundError):
                    path.unlink()

    def _segment(self, path: Path) -> tuple[list[Leg], str] | None:
        """Read one segment, with its seal; None where it is damaged or does not continue the one before it."""
        try:
            arrays = _read(path)
            identity, follows, seal = (str(arrays[name]) for name in ("identity", "follows", "seal"))
            sound = seal == _seal({name: each for name, each in arrays.items() if name != "seal"})
            legs = [_leg(arrays, i) for i in range(int(arrays["count"]))]
        except (*UNREADABLE, OSError, ValueError, TypeError, KeyError, EOFError, MemoryError):
            return None
        if sound and identity != self.identity:
            raise FileError(
                "holds the checkpoint of another run (scenario, tolerances or versions differ)",
                where=str(self.folder),
                next_step="Run without resuming to start afresh.",
            )
        return (legs, seal) if sound and follows == self._seal else None


def _arrays(identity: str, follows: str, legs: Sequence[Leg]) -> dict[str, np.ndarray]:
    arrays = {"identity": np.array(identity), "follows": np.array(follows), "count": np.array(len(legs))}
    for i, leg in enumerate(legs):
        described = (leg.ending, leg.moving, leg.moving_next, leg.message, leg.rates, leg.jacobians)
        arrays[f"leg{i}"] = np.array(json.dumps(described))
        arrays[f"t{i}"], arrays[f"y{i}"], arrays[f"first{i}"] = leg.history.t, leg.history.y, leg.history.first
    return arrays


def _seal(arrays: Mapping[str, np.ndarray]) -> str:
    """Return a digest over names, shapes and values, among them the seal of the segment that this one continues."""
    digest = hashlib.sha256()
    for name, each in sorted(arrays.items()):
        digest.update(f"{name} {each.dtype.str} {each.shape}".encode())
        digest.update(np.ascontiguousarray(each).tobytes())
    return digest.hexdigest()


def _write(aside: Path, arrays: Mapping[str, np.ndarray]) -> None:
    with aside.open("wb") as stream:
        np.savez(stream, **cast(dict[str, Any], arrays))


def _read(path: Path) -> dict[str, np.ndarray]:
    """Return what a segment holds, which is stored as it is: what would unpack to more than the file is not read."""
    with path.open("rb") as stream, np.load(stream, allow_pickle=False) as archive:
        if any(each.compress_type != zipfile.ZIP_STORED for each in archive.zip.infolist()):
            raise ValueError("it is compressed")
        return {name: archive[name] for name in archive.files}


def _leg(arrays: Mapping[str, np.ndarray], i: int) -> Leg:
    ending, moving, moving_next, message, rates, jacobians = json.loads(str(arrays[f"leg{i}"]))
    history = History(arrays[f"t{i}"], arrays[f"y{i}"], arrays[f"first{i}"])
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
