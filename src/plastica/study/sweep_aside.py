"""The hidden folder in which a sweep is made until it is whole, and what killed processes have left of such folders.

While it is made, the file of the plan names the machine and is locked. The system gives the lock up with the process,
however that ends; but not every file system tells a lock to other machines, so what another machine has left is only
taken for left behind once nothing has been written there for a day.
"""

from __future__ import annotations

import contextlib
import platform
import re
import shutil
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Final

from plastica.locks import take_lock
from plastica.study.sweep_store import PLAN

__all__ = ["folder_aside", "remove_leftovers"]

LONG: Final = 86400.0
"""Seconds without a write after which a folder that nobody has locked is taken for left behind."""


@contextlib.contextmanager
def folder_aside(target: Path) -> Iterator[Path]:
    """Give a hidden folder beside `target` that others leave alone; it is gone in the end, unless it was renamed.

    Raises
    ------
    OSError
        Where it cannot be made.
    """
    aside = Path(tempfile.mkdtemp(prefix=f".{target.name}.", dir=target.parent))
    try:
        with (aside / PLAN).open("x", encoding="utf-8") as mark:
            take_lock(mark.fileno(), wait=True)
            # Written once the lock is held: whoever finds these words and no lock finds no living process either.
            mark.write(_being_made())
            mark.flush()
            yield aside
    finally:
        shutil.rmtree(aside, ignore_errors=True)


def remove_leftovers(target: Path) -> None:
    """Remove what processes that were killed while they made `target` have left beside it; others' folders stay."""
    # The ending is that of `tempfile`: nothing that a user has named is taken for one of these folders.
    ours = re.compile(rf"\.{re.escape(target.name)}\.[a-z0-9_]{{8}}")
    with contextlib.suppress(OSError):
        for folder in target.parent.iterdir():
            if ours.fullmatch(folder.name) and folder.is_dir() and not folder.is_symlink():
                with contextlib.suppress(OSError):
                    _remove_if_left(folder)


def _remove_if_left(folder: Path) -> None:
    if not (folder / PLAN).exists():
        if _rested(folder):
            # This fails where something is in it, which then is not of a sweep.
            folder.rmdir()
        return
    with (folder / PLAN).open("r+", encoding="utf-8", errors="replace") as mark:
        free = take_lock(mark.fileno(), wait=False)
        if free is False:
            return
        if (free and mark.read(1000) == _being_made()) or _rested(folder):
            _remove(folder)


def _remove(folder: Path) -> None:
    for path in folder.iterdir():
        if path.name == PLAN:
            continue
        if path.is_dir() and not path.is_symlink():
            shutil.rmtree(path)
        else:
            path.unlink()
    # The mark goes last, so that a removal that is killed can be taken up as well.
    (folder / PLAN).unlink()
    folder.rmdir()


def _being_made() -> str:
    return f"being made on {platform.node()}\n"


def _rested(folder: Path) -> bool:
    """Whether nothing was written in a folder for long."""
    return time.time() - max(path.lstat().st_mtime for path in (folder, *folder.rglob("*"))) > LONG
