"""Files that appear whole or not at all, and files from outside that are read with a limit."""

from __future__ import annotations

import contextlib
import os
import tempfile
from collections.abc import Callable
from pathlib import Path

from plastica.errors import FileError

__all__ = ["read_bytes", "write_whole"]


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
    FileError
        Where the folder does not exist or cannot be written to.
    """
    target = Path(path)
    try:
        handle, name = tempfile.mkstemp(suffix=target.suffix, prefix=f".{target.stem}.", dir=target.parent)
    except OSError as error:
        raise FileError(
            f"cannot be written: {error.strerror}",
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


def read_bytes(path: str | Path, *, limit: int) -> bytes:
    """Read a file from outside, of at most `limit` bytes.

    Raises
    ------
    FileError
        Where there is no such file, it is a folder, may not be read, or is larger than the limit.
    """
    source = Path(path)
    try:
        if not source.is_file():
            what = "does not exist"
            if source.exists():
                what = "is a folder, not a file" if source.is_dir() else "is not a regular file"
            raise FileError(what, where=str(source), next_step="Check the path.")
        size = source.stat().st_size
        if size > limit:
            raise FileError(f"must have at most {limit} bytes", where=str(source), value=size)
        return source.read_bytes()
    except FileError:
        raise
    except (OSError, ValueError) as error:
        raise FileError(f"cannot be read: {error}", where=str(source)) from None
