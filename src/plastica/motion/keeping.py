"""Where a long run is kept, and whether a former one is taken up."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from os import PathLike
from pathlib import Path

import numpy as np
import scipy

from plastica._version import __version__
from plastica.errors import ArgumentError
from plastica.files import as_path
from plastica.locks import Held, held, make_folder
from plastica.motion.checkpoint import Checkpoint, fingerprint
from plastica.motion.integrate import Leg
from plastica.motion.plan import Plan, Problem
from plastica.motion.store import model_to_dict
from plastica.physics.amounts import plain

__all__ = ["Keeping", "keeping_in"]


@dataclass(frozen=True)
class Keeping:
    """Where and how often a run is kept, and whether a former one is taken up.

    Attributes
    ----------
    folder : Path
        The folder of the segments.
    every : float
        Wall seconds between two segments.
    resume : bool
        Whether to take up what is there; else it is removed.
    lock : Held or None
        What whoever holds the folder already was given.
    """

    folder: Path
    every: float
    resume: bool
    lock: Held | None = None

    @contextmanager
    def held(self) -> Iterator[None]:
        """Keep other processes out of the folder.

        Raises
        ------
        StorageError
            Where another process works in it.
        """
        with held(self.lock or self.folder):
            yield

    def open(self, problem: Problem, plan: Plan) -> tuple[Checkpoint, Iterable[Leg]]:
        """Return the checkpoint of a problem, and the legs in it that are to be taken as done, one after another.

        Raises
        ------
        FileError
            Where the folder cannot be made, or holds the checkpoint of another run.
        """
        described = {
            "model": model_to_dict(problem.strut),
            "plan": [plan.t0, plan.end, plan.settle, plan.rtol, plan.method, plan.max_steps],
            "versions": [__version__, np.__version__, scipy.__version__],
        }
        identity = fingerprint(described, problem.y0, problem.atol)
        checkpoint = Checkpoint(self.folder, identity, every=self.every)
        if self.resume:
            return checkpoint, checkpoint.load()
        checkpoint.clear(keep_folder=True)
        return checkpoint, ()

    def fresh(self) -> None:
        """Make the folder, and unless a run is taken up remove what former runs on other nodes left in it."""
        make_folder(self.folder)
        if not self.resume:
            for former in self.folder.glob("nodes-*"):
                if former.is_dir() and not former.is_symlink():
                    Checkpoint(former, "").clear()

    def on(self, nodes: int) -> Keeping:
        """Return the part for one number of nodes, of several that are tried."""
        return replace(self, folder=self.folder / f"nodes-{nodes}")


def keeping_in(folder: str | PathLike[str] | None, every: float, resume: bool) -> Keeping | None:
    """Read the arguments of `solve`; None where nothing is kept.

    Raises
    ------
    ArgumentError
        Where the folder is no path or the seconds are no number.
    """
    if folder is None:
        return None
    seconds = plain(every)
    if not isinstance(seconds, float) or not 0.0 <= seconds < float("inf"):
        raise ArgumentError("must be a number of seconds, not negative", where="checkpoint_every", value=every)
    lock = folder if isinstance(folder, Held) else None
    return Keeping(as_path(folder, "checkpoint"), seconds, bool(resume), lock)
