"""The members of a sweep: which values each of them takes."""

from __future__ import annotations

import csv
import io
import math
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from plastica.errors import ArgumentError, FileError
from plastica.files import read_bytes
from plastica.study.sweep_axes import MOST_AXES, Axis, column
from plastica.study.sweep_schema import is_drawn

__all__ = ["MOST_DRAWN", "MOST_MEMBERS", "Members", "members_of", "read_columns"]

Array = NDArray[np.float64]

MOST_MEMBERS: Final = 2_000_000_000
MOST_DRAWN: Final = 10_000_000
"""Members of a Latin hypercube times its axes: they are drawn all at once."""

LARGEST_CSV: Final = 200_000_000

_HEADING: Final = re.compile(r"\s*([A-Za-z][\w.-]*)\s*(?:\[([^\]]*)\])?\s*")


@dataclass(frozen=True)
class Members:
    """All members in their order.

    Attributes
    ----------
    axes : tuple of Axis
        What is varied.
    sampling : str
        "grid", "list", "latin-hypercube", "random" or "csv".
    count : int
        How many there are.
    seed : int
        Of those that are drawn.
    """

    axes: tuple[Axis, ...]
    sampling: str
    count: int
    seed: int = 0

    @property
    def shape(self) -> tuple[int, ...]:
        """Of a grid the number of values of each axis, the first varying slowest; else the number of members."""
        return tuple(axis.values.size for axis in self.axes) if self.sampling == "grid" else (self.count,)

    def blocks(self, size: int) -> Iterator[Array]:
        """Yield the values of `size` members at a time, each block of shape (members, axes)."""
        return (self.between(first, min(first + size, self.count)) for first in range(0, self.count, size))

    def between(self, first: int, last: int) -> Array:
        """Return the values of members first to last, of shape (members, axes), whatever was asked for before."""
        if self.sampling == "random":
            return self._drawn(_stream(self.seed, first, last, len(self.axes)))
        if self.sampling == "latin-hypercube":
            return self._drawn(self._sample[first:last])
        return self._at(np.arange(first, last))

    def picked(self, places: NDArray[np.int64]) -> Array:
        """Return the values of some members; of drawn ones, as many of the first."""
        return self.between(0, places.size) if is_drawn(self.sampling) else self._at(places)

    def _at(self, places: NDArray[np.int64]) -> Array:
        if self.sampling != "grid":
            return np.stack([axis.values[places] for axis in self.axes], axis=1)
        along = np.unravel_index(places, self.shape)
        return np.stack([axis.values[place] for axis, place in zip(self.axes, along, strict=True)], axis=1)

    def _drawn(self, shares: Array) -> Array:
        return np.stack([axis.drawn(share) for axis, share in zip(self.axes, shares.T, strict=True)], axis=1)

    @cached_property
    def _sample(self) -> Array:
        """Shares in [0, 1) of all members of a Latin hypercube, which are drawn at once."""
        from scipy.stats import qmc

        rng = np.random.default_rng(self.seed)
        return np.asarray(qmc.LatinHypercube(len(self.axes), rng=rng).random(self.count))


def _stream(seed: int, first: int, last: int, axes: int) -> Array:
    """Return the shares in [0, 1) of members first to last: a part of one stream, which is not drawn up to there."""
    source = np.random.Philox(seed)
    # One step of this generator makes four numbers.
    source.advance(first * axes // 4)
    stream = np.random.Generator(source)
    stream.random(first * axes % 4)
    return stream.random((last - first, axes))


def members_of(axes: Sequence[Axis], sampling: str, members: int | None, seed: int) -> Members:
    """Put axes together.

    Raises
    ------
    ArgumentError
        Where there are too many members or axes, or lists are of different lengths.
    """
    if not 1 <= len(axes) <= MOST_AXES:
        raise ArgumentError(f"must vary 1 to {MOST_AXES} keys", where="over", value=len(axes))
    sizes = {axis.key: axis.values.size for axis in axes}
    if sampling == "grid":
        count = math.prod(sizes.values())
    elif members is not None:
        count = members
    else:
        count = next(iter(sizes.values()))
        if len(set(sizes.values())) > 1:
            told = ", ".join(f"{size} of {key}" for key, size in sizes.items())
            raise ArgumentError(f"must have as many values of each key where they are a list ({told})", where="over")
    if count > MOST_MEMBERS:
        raise ArgumentError(f"must come to at most {MOST_MEMBERS} members", where="over", value=count)
    if sampling == "latin-hypercube" and count * len(axes) > MOST_DRAWN:
        rule = f"must be at most {MOST_DRAWN // len(axes)} for a Latin hypercube of {len(axes)} keys"
        raise ArgumentError(rule, where="members", value=count, next_step='Take sampling = "random".')
    return Members(tuple(axes), sampling, count, seed)


def read_columns(file: Path, *, si: bool) -> list[Axis]:
    """Read members from a CSV file: one row each, the heading of each column a key, with its unit in brackets.

    Raises
    ------
    FileError, ArgumentError
        Where the file cannot be read, or is no such table.
    """
    try:
        text = read_bytes(file, limit=LARGEST_CSV).decode("utf-8-sig")
    except UnicodeDecodeError:
        raise FileError("must be UTF-8 text", where=str(file)) from None
    try:
        rows = [(i, row) for i, row in enumerate(csv.reader(io.StringIO(text)), start=1) if row]
    except csv.Error as error:
        raise FileError(f"is not a table that can be read ({error})", where=str(file)) from None
    if len(rows) < 2:
        raise FileError("must have a heading and at least one row", where=str(file))
    heads = [_HEADING.fullmatch(cell) for cell in rows[0][1]]
    if len(heads) > MOST_AXES or not all(heads):
        rule = f'must begin with at most {MOST_AXES} headings such as "load.thrust [N]"'
        raise FileError(rule, where=str(file), value=",".join(rows[0][1])[:80])
    keys = [head[1] for head in heads if head is not None]
    _check_rows(rows[1:], keys, file)
    if len(set(keys)) < len(keys):
        raise FileError("must name each key once", where=str(file), value=",".join(keys))
    return [_column(head, [row[i].strip() for _, row in rows[1:]], file, si=si) for i, head in enumerate(heads)]


def _check_rows(rows: Sequence[tuple[int, list[str]]], keys: list[str], file: Path) -> None:
    """Refuse rows, told by their place in the file, that do not say everything of a member."""
    for i, row in rows:
        if len(row) != len(keys):
            raise FileError(f"must have {len(keys)} cells in every row, but row {i} has {len(row)}", where=str(file))
        empty = [key for key, cell in zip(keys, row, strict=True) if not cell.strip()]
        if empty:
            rule = f"must have a value in every cell, but row {i} has none for `{empty[0]}`"
            raise FileError(rule, where=str(file))


def _column(head: Any, cells: list[str], file: Path, *, si: bool) -> Axis:
    key, unit = head[1], (head[2] or "").strip()
    try:
        numbers: list[Any] = [float(cell) for cell in cells]
    except ValueError:
        numbers = []
    if unit and not si:
        raise FileError(f"must not give `{key}` a unit in a dimensionless scenario", where=str(file), value=unit)
    if unit and not numbers:
        raise FileError(f"must have numbers below the heading of `{key}`, which has a unit", where=str(file))
    if numbers and not unit and all(re.fullmatch(r"[+-]?\d+", cell) for cell in cells):
        numbers = [int(cell) for cell in cells]
    given = [f"{number!r} {unit}" for number in numbers] if unit else numbers or cells
    try:
        return column(key, given, si=si)
    except ArgumentError as error:
        said = str(error).removesuffix(".")
        raise FileError(f"has a column `{key}` that cannot be used: {said}", where=str(file)) from None
