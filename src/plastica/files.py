"""Files that appear whole or not at all, and files from outside that are read with a limit."""

from __future__ import annotations

import contextlib
import os
import tempfile
from collections.abc import Callable
from pathlib import Path

from plastica.errors import ArgumentError, FileError

__all__ = ["as_path", "check_schema", "read_bytes", "regular_file", "write_whole"]


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

    Whoever looks at `path`, whenever and whatever is killed in between, finds the former file or the new one.

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
        Where the folder does not exist or cannot be written to.
    """
    target = as_path(path)
    try:
        handle, name = tempfile.mkstemp(suffix=target.suffix, prefix=f".{target.stem}.", dir=target.parent)
    except (OSError, ValueError) as error:
        raise FileError(
            f"cannot be written: {getattr(error, 'strerror', None) or error}",
            where=str(target),
            next_step="Name a folder that exists and may be written to.",
        ) from None
    os.close(handle)
    aside = Path(name)
    try:
        write(aside)
        _settle(aside)
        aside.replace(target)
    except OSError as error:
        raise FileError(f"cannot be written: {error.strerror or error}", where=str(target)) from None
    finally:
        with contextlib.suppress(FileNotFoundError):
            aside.unlink()
    return target


def _settle(path: Path) -> None:
    """Bring the bytes to the disk before the rename, with the permissions that a plain `open` would give."""
    umask = os.umask(0)
    os.umask(umask)
    path.chmod(0o666 & ~umask)
    with path.open("rb") as stream:
        os.fsync(stream.fileno())


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
        raise _unreadable(source, error) from None
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
        raise _unreadable(source, error) from None


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


def _unreadable(source: Path, error: Exception) -> FileError:
    return FileError(f"cannot be read: {error}", where=str(source))
