"""Locks of the operating system, and folders that one process at a time works in.

Such a lock vanishes with the process that holds it, however it ends: nothing that a killed process leaves behind can
block the next one.
"""

from __future__ import annotations

import contextlib
import os
import shutil
import warnings
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from plastica.errors import FileError, StorageError, one_line, unusable

__all__ = ["Held", "give_up", "held", "is_at", "make_folder", "take_lock"]

LOCK: Final = "lock"
"""The file in a held folder that is locked while a process works there."""


@dataclass(frozen=True)
class Held(os.PathLike[str]):
    """A folder that no other process works in, as `held` gives it: a path like any other.

    Attributes
    ----------
    folder : Path
        The folder.
    """

    folder: Path

    def __fspath__(self) -> str:
        return os.fspath(self.folder)

    def clear(self) -> None:
        """Remove everything in the folder, as far as the system lets it be removed."""
        for path in self.folder.iterdir():
            if path.is_dir() and not path.is_symlink():
                shutil.rmtree(path, ignore_errors=True)
            elif path.name != LOCK:
                with contextlib.suppress(OSError):
                    path.unlink()


@contextlib.contextmanager
def held(folder: Path | Held) -> Iterator[Held]:
    """Make a folder if need be, and keep other processes out of it; if it is empty in the end, what was made goes.

    Parameters
    ----------
    folder : Path or Held
        The folder, whose parent must exist; one that is held already is given back.

    Yields
    ------
    Held
        The same folder.

    Raises
    ------
    FileError
        Where it is a link or cannot be a folder.
    StorageError
        Where another process works in it, or the system refuses.
    """
    if isinstance(folder, Held):
        yield folder
        return
    path = Path(folder)
    descriptor, made = _entered(path)
    try:
        yield Held(path)
    finally:
        give_up(descriptor, path / LOCK)
        if made:
            with contextlib.suppress(OSError):
                path.rmdir()


def _entered(path: Path) -> tuple[int, bool]:
    """Return the descriptor of a folder's lock, and whether the folder was made."""
    made = False
    while True:
        made = make_folder(path) or made
        mark = path / LOCK
        try:
            descriptor = os.open(mark, os.O_RDWR | os.O_CREAT | getattr(os, "O_NOFOLLOW", 0), 0o666)
        except FileNotFoundError:
            # Another process has just removed the folder.
            continue
        except OSError as error:
            raise unusable(path, "written", error) from None
        locked = take_lock(descriptor)
        if locked is False:
            os.close(descriptor)
            raise StorageError(
                "is in use: another process is at work there",
                where=str(path),
                next_step="Wait until it has ended, or name another folder.",
            )
        if locked is None:
            told = f"{one_line(path)}: files cannot be locked here; see that no other process uses it"
            warnings.warn(told, stacklevel=4)
        if is_at(descriptor, mark):
            return descriptor, made
        os.close(descriptor)


def make_folder(path: Path) -> bool:
    """Make a folder, whose parent must exist; return whether it was not there yet.

    Raises
    ------
    FileError
        Where it is a link or cannot be a folder.
    StorageError
        Where the system refuses.
    """
    if path.is_symlink():
        raise FileError(
            "must be a folder, but is a link, which is not followed",
            where=str(path),
            next_step="Remove the link, or name the folder that it leads to.",
        )
    try:
        path.mkdir()
    except FileExistsError as error:
        if not path.is_dir():
            raise unusable(path, "made a folder", error, next_step="Name another folder.") from None
        return False
    except (OSError, ValueError) as error:
        raise unusable(path, "made a folder", error, next_step="Name a folder in one that exists.") from None
    return True


def take_lock(descriptor: int, *, wait: bool = False) -> bool | None:
    """Lock an open file until it is closed; False where another process has, None where files cannot be locked."""
    from filelock import lock_descriptor

    try:
        return lock_descriptor(descriptor, blocking=wait)
    except OSError:
        return None


def is_at(descriptor: int, path: Path) -> bool:
    """Whether an open file is still the one that is found at a path."""
    try:
        return os.path.samestat(os.fstat(descriptor), path.lstat())
    except FileNotFoundError:
        return False


def give_up(descriptor: int, mark: Path) -> None:
    """Remove a mark, and with it its lock: while it is locked, so that no mark of another process is removed."""
    with contextlib.suppress(OSError):
        mark.unlink()
    os.close(descriptor)
    if os.name == "nt":
        # There an open file cannot be removed.
        with contextlib.suppress(OSError):
            mark.unlink()
