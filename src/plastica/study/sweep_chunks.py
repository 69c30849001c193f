"""Look at the files of a sweep's store before they are read: they may be no plain files, or unpack to anything."""

from __future__ import annotations

import os
import stat
from pathlib import Path
from typing import Final

__all__ = ["check_chunk"]

MAGIC: Final = b"\x28\xb5\x2f\xfd"
"""Beginning of a frame of Zstandard (RFC 8878, section 3.1.1)."""

LONGEST_HEADER: Final = 18

OVERHEAD: Final = 1024
"""Bytes by which a chunk that cannot be compressed may be longer than what it holds, beside a share of it."""


def check_chunk(path: Path, size: int, *, compressed: bool) -> None:
    """Refuse a file that cannot be the chunk of an array; one that does not exist may be.

    Parameters
    ----------
    path : Path
        The file.
    size : int
        Bytes that the chunk unpacks to.
    compressed : bool
        Whether it is a frame of Zstandard, which says what it unpacks to.

    Raises
    ------
    ValueError
        Where it is a folder, a device or a pipe, too long, or would unpack to another size.
    OSError
        Where it cannot be looked at.
    """
    try:
        found = path.stat()
    except FileNotFoundError:
        if os.path.lexists(path):
            raise ValueError(f"{path.name} is a link to nothing") from None
        return
    if not stat.S_ISREG(found.st_mode):
        raise ValueError(f"{path.name} is not a plain file")
    if found.st_size > size + size // 64 + OVERHEAD:
        raise ValueError(f"{path.name} is too long for a chunk")
    if compressed:
        with path.open("rb") as stream:
            if _unpacked(stream.read(LONGEST_HEADER)) != size:
                raise ValueError(f"{path.name} would unpack to another size than that of a chunk")


def _unpacked(header: bytes) -> int:
    """Return the bytes that a frame of Zstandard says it unpacks to; -1 where it is none, or does not say."""
    if len(header) < 5 or header[:4] != MAGIC:
        return -1
    descriptor = header[4]
    kind, single = descriptor >> 6, descriptor >> 5 & 1
    begin = 5 + (1 - single) + (0, 1, 2, 4)[descriptor & 3]
    length = (single, 2, 4, 8)[kind]
    if not length or len(header) < begin + length:
        return -1
    # Two bytes begin where one ends.
    return int.from_bytes(header[begin : begin + length], "little") + (256 if length == 2 else 0)
