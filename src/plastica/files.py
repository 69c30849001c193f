"""Files that appear whole or not at all, and files from outside that are read with a limit."""

from __future__ import annotations

import contextlib
import errno
import os
import platform
import re
import tempfile
import time
from collections.abc import Callable, Iterator
from io import BytesIO, FileIO
from pathlib import Path
from typing import Final

from plastica.errors import ArgumentError, FileError, unusable
from plastica.locks import give_up, is_at, take_lock

__all__ = [
    "Medium",
    "as_path",
    "check_schema",
    "read_bytes",
    "refuse_overwriting",
    "regular_file",
    "remove_leftovers",
    "replace_whole",
    "write_whole",
]

LONG: Final = 86400.0
"""Seconds without a write after which a file that nobody has locked, or can lock, is taken for left behind."""

MARK: Final = ".writing"
"""What the name of the locked file adds to that of the one that a process fills aside."""


def as_path(given: object, where: str = "path") -> Path:
    """Return a path that was given as text or as a path.

    Raises
    ------
    ArgumentError
        Where it is neither.
    """
    if isinstance(given, (str, os.PathLike)):
        with contextlib.suppress(TypeError):
            return Path(given)
    raise ArgumentError("must be a path, as text or a Path", where=where, value=given)


def write_whole(path: str | Path, write: Callable[[Path], object]) -> Path:
    """Let `write` fill a file beside `path`, then rename it into place.

    Whoever looks at `path`, whenever and whatever is killed in between, finds the former file or the new one. What
    killed processes have left aside for the same path is removed first.

    Parameters
    ----------
    path : str or Path
        Where the file shall be; its folder must exist.
    write : callable
        Called with the path of the file to fill, which has the same suffix.

    Returns
    -------
    Path
        The path of the finished file.

    Raises
    ------
    ArgumentError
        Where the path is neither text nor a Path.
    FileError
        Where the folder does not exist.
    StorageError
        Where the folder or the disk cannot be written to.
    """
    target = as_path(path)
    remove_leftovers(target)
    return replace_whole(target, write)


def replace_whole(target: Path, write: Callable[[Path], object]) -> Path:
    """Do what `write_whole` does in a folder that is `held`, where its holder removes what is left over."""
    try:
        with _aside(target) as aside:
            write(aside)
            _settle(aside)
            aside.replace(target)
        _settle_folder(target.parent)
    except FileError:
        raise
    except OSError as error:
        raise unusable(target, "written", error, next_step="Name a folder that exists.") from None
    return target


class Medium:
    """An open file for a library that crashes where the system refuses to write: it is never told.

    From then on it writes to memory, and `check` raises what the system said.

    Parameters
    ----------
    file : FileIO
        Open for reading and writing, without a buffer.
    """

    def __init__(self, file: FileIO) -> None:
        self._file: FileIO | BytesIO = file
        self._refusal: OSError | None = None

    def read(self, size: int = -1) -> bytes:
        """Read, as a file does."""
        return self._file.read(size) or b""

    def readinto(self, buffer: memoryview) -> int:
        """Read into a buffer, as a file does."""
        return self._file.readinto(buffer) or 0

    def seek(self, offset: int, whence: int = 0) -> int:
        """Go to a place, as a file does."""
        return self._file.seek(offset, whence)

    def tell(self) -> int:
        """Return the place, as a file does."""
        return self._file.tell()

    def write(self, data: bytes) -> int:
        """Write all of the data."""
        left = memoryview(data).cast("B")
        while len(left):
            place = self.tell()
            try:
                left = left[self._file.write(left) or 0 :]
            except OSError as error:
                self._give_way(error, place)
        return memoryview(data).nbytes

    def truncate(self, size: int) -> int:
        """Cut or extend, as a file does."""
        place = self.tell()
        try:
            return self._file.truncate(size)
        except OSError as error:
            self._give_way(error, place)
            return self._file.truncate(size)

    def flush(self) -> None:
        """Do nothing: there is no buffer."""

    def check(self) -> None:
        """Raise what the system has said, if it has refused.

        Raises
        ------
        OSError
            Where it has.
        """
        if self._refusal is not None:
            raise self._refusal

    def _give_way(self, refusal: OSError, place: int) -> None:
        """Go on in memory, with all that could be written."""
        self._refusal = refusal
        self._file.seek(0)
        self._file = BytesIO(self._file.read() or b"")
        self._file.seek(place)


@contextlib.contextmanager
def _aside(target: Path) -> Iterator[Path]:
    """Give an empty file beside `target`, and hold the mark that says that a living process fills it."""
    descriptor, mark = _marked(target)
    aside = mark.with_name(mark.name.removesuffix(MARK))
    try:
        os.close(os.open(aside, os.O_CREAT | os.O_EXCL | os.O_WRONLY, 0o600))
        yield aside
    finally:
        _forget(aside)
        give_up(descriptor, mark)


def _marked(target: Path) -> tuple[int, Path]:
    """Return the descriptor and path of a new mark that is locked."""
    while True:
        try:
            descriptor, name = tempfile.mkstemp(f"{target.suffix}{MARK}", f".{target.stem}.", target.parent)
        except ValueError as error:
            raise OSError(errno.EINVAL, str(error)) from None
        # Another process may have taken the mark for one that is left over before it was locked.
        if take_lock(descriptor) is not False and is_at(descriptor, Path(name)):
            try:
                os.write(descriptor, _here())
            except OSError:
                give_up(descriptor, Path(name))
                raise
            return descriptor, Path(name)
        os.close(descriptor)


def remove_leftovers(target: Path) -> None:
    """Remove the files that killed processes have left beside `target` while they wrote it; others' files stay.

    Ours are named as `write_whole` names them. One whose mark a living process has locked stays; one without a mark, or
    where files cannot be locked, goes once nothing was written to it for a day.
    """
    ours = re.compile(rf"\.{re.escape(target.stem)}\.[a-z0-9_]{{8}}{re.escape(target.suffix)}({re.escape(MARK)})?")
    with contextlib.suppress(OSError, ValueError):
        with os.scandir(target.parent) as entries:
            names = sorted(each.name for each in entries if ours.fullmatch(each.name))
        for name in {each.removesuffix(MARK) for each in names}:
            with contextlib.suppress(OSError):
                _remove_if_left(target.with_name(name), target.with_name(name + MARK))


def _remove_if_left(aside: Path, mark: Path) -> None:
    try:
        descriptor = os.open(mark, os.O_RDWR | getattr(os, "O_NOFOLLOW", 0))
    except FileNotFoundError:
        if _rested(aside):
            _forget(aside)
        return
    # Not every file system tells a lock to other machines: of theirs only what has rested is taken for left behind.
    free = take_lock(descriptor)
    ours = bool(free) and os.read(descriptor, 1000) == _here()
    if ours or (free is not False and _rested(mark) and (not aside.exists() or _rested(aside))):
        _forget(aside)
        # The mark goes last, so that a removal that is killed can be taken up as well.
        give_up(descriptor, mark)
    else:
        os.close(descriptor)


def _here() -> bytes:
    """What a mark says once it is locked: the machine."""
    return f"being written on {platform.node()}\n".encode()


def _rested(path: Path) -> bool:
    return time.time() - path.lstat().st_mtime > LONG


def _forget(path: Path) -> None:
    with contextlib.suppress(OSError):
        path.unlink()


def _settle(path: Path) -> None:
    """Bring the bytes to the disk before the rename, with the permissions that a plain `open` would give."""
    umask = os.umask(0)
    os.umask(umask)
    path.chmod(0o666 & ~umask)
    # Open for writing: Windows refuses to settle what was opened for reading.
    with path.open("r+b") as stream:
        os.fsync(stream.fileno())


def _settle_folder(folder: Path) -> None:
    """Bring a rename to the disk, where the system lets folders be opened."""
    with contextlib.suppress(OSError):
        descriptor = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(descriptor)
        finally:
            os.close(descriptor)


def refuse_overwriting(output: Path, *sources: Path) -> None:
    """Refuse to write a file in the place of one that is read.

    Raises
    ------
    FileError
        Where the output is one of the sources, by whatever name.
    """
    for source in sources:
        same = os.path.realpath(output) == os.path.realpath(source)
        with contextlib.suppress(OSError, ValueError):
            same = same or os.path.samefile(output, source)
        if same:
            raise FileError(
                f"would be overwritten: it is the file that is read ({source})",
                where=str(output),
                next_step="Name another file.",
            )


def regular_file(path: str | Path, *, limit: int) -> Path:
    """Return the path of a file from outside that can be read, of at most `limit` bytes.

    Raises
    ------
    ArgumentError
        Where the path is neither text nor a Path.
    FileError
        Where there is no such file, it is a folder or a device, or is larger than the limit.
    """
    source = as_path(path)
    try:
        if not source.is_file():
            what = "does not exist"
            if source.exists():
                what = "is a folder, not a file" if source.is_dir() else "is not a regular file"
            raise FileError(what, where=str(source), next_step="Check the path.")
        size = source.stat().st_size
    except FileError:
        raise
    except (OSError, ValueError) as error:
        raise unusable(source, "read", error) from None
    if size > limit:
        raise FileError(f"must have at most {limit} bytes", where=str(source), value=size)
    return source


def read_bytes(path: str | Path, *, limit: int) -> bytes:
    """Read a file from outside, of at most `limit` bytes; see `regular_file`.

    Raises
    ------
    ArgumentError
        Where the path is neither text nor a Path.
    FileError
        Where there is no such file, it is a folder, may not be read, or is larger than the limit.
    """
    source = regular_file(path, limit=limit)
    try:
        return source.read_bytes()
    except OSError as error:
        raise unusable(source, "read", error) from None


def check_schema(found: int, known: int, source: Path) -> None:
    """Refuse a file whose layout is of a version that this package cannot read.

    Parameters
    ----------
    found : int
        The version that the file bears.
    known : int
        The latest version that is read; all versions from 1 to it are.
    source : Path
        The file.

    Raises
    ------
    FileError
        Where the version is a later one.
    ValueError
        Where there never was such a version: the file is damaged, which its reader says in its own words.
    """
    if found < 1:
        raise ValueError(f"its schema version is {found}")
    if found > known:
        raise FileError(
            f"must have schema version {'1' if known == 1 else f'1 to {known}'}",
            where=str(source),
            value=found,
            next_step="It was written by a later plastica: read it with that one.",
        )
