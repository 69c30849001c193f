"""The rod cut into segments, on each of which the natural curvature is uniform.

One segment is the rod of the paper. Values "by segment" have a last axis of length m, which is left out where m = 1:
the natural curvature of the paper's rod is a number, not a row of one.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from plastica.errors import ArgumentError
from plastica.numerics.grid import LARGEST_ELEMENTS, Grid

__all__ = ["Division", "segment_breaks"]

Array = NDArray[np.float64]

LARGEST_SEGMENTS = LARGEST_ELEMENTS


def segment_breaks(given: int | Sequence[float]) -> tuple[float, ...]:
    """Return the ends of the segments, from 0 to 1: equal lengths for a number, else the break points as given.

    Raises
    ------
    ArgumentError
        Where neither a positive integer nor increasing numbers from 0 to 1 are given.
    """
    if isinstance(given, (int, np.integer)) and not isinstance(given, bool):
        if not 1 <= int(given) <= LARGEST_SEGMENTS:
            raise ArgumentError(f"must lie in [1, {LARGEST_SEGMENTS}]", where="natural_segments", value=given)
        return tuple(float(b) for b in np.arange(int(given) + 1) / int(given))
    wrong = ArgumentError(
        "must be a number of segments, or their ends in units of the length, increasing from 0 to 1",
        where="natural_segments",
        value=given,
        next_step="Give e.g. 4, or (0, 0.3, 1).",
    )
    if isinstance(given, str) or not isinstance(given, (Sequence, np.ndarray)):
        raise wrong
    try:
        return Grid(2, tuple(given)).breaks
    except (ArgumentError, TypeError):
        raise wrong from None


@dataclass(frozen=True)
class Division:
    """The segments of a rod on its grid.

    Parameters
    ----------
    breaks : tuple of float
        Ends of the segments, from 0 to 1; each is the end of an element of the grid.
    grid : Grid
        The grid.
    """

    breaks: tuple[float, ...]
    grid: Grid

    @property
    def count(self) -> int:
        """The number m of segments."""
        return len(self.breaks) - 1

    @cached_property
    def lengths(self) -> Array:
        """Lengths of the segments, of sum 1; shape (m,)."""
        return np.diff(self.breaks)

    @cached_property
    def owner(self) -> NDArray[np.intp]:
        """Index of the segment in which each node lies; shape (n,)."""
        return np.searchsorted(np.asarray(self.breaks), self.grid.s, side="right") - 1

    @cached_property
    def means(self) -> Array:
        """Matrix from nodal values to their means over the segments; shape (m, n)."""
        inside = self.owner == np.arange(self.count)[:, None]
        return np.where(inside, self.grid.w, 0.0) / self.lengths[:, None]

    def mean(self, values: ArrayLike) -> Array:
        """Means over the segments of nodal values (..., n); shape (..., m), or (...) where m = 1."""
        nodal = np.asarray(values, dtype=float)
        return np.asarray(nodal @ self.grid.w if self.count == 1 else nodal @ self.means.T)

    def spread(self, by_segment: ArrayLike) -> Array:
        """Nodal values (..., n) of a quantity given by segment: (..., m), or (...) where m = 1."""
        values = np.asarray(by_segment, dtype=float)
        return values[..., None] if self.count == 1 else values[..., self.owner]

    def total(self, by_segment: ArrayLike) -> Array:
        """Integral over the rod of a density given by segment: (..., m), or (...) where m = 1; shape (...)."""
        values = np.asarray(by_segment, dtype=float)
        return values if self.count == 1 else np.asarray(values @ self.lengths)

    def integral(self, by_segment: ArrayLike, s: ArrayLike) -> Array:
        """Integral from 0 to s of a density given by segment; shape (..., k) for s of shape (k,)."""
        values, places = np.asarray(by_segment, dtype=float), np.asarray(s, dtype=float)
        if self.count == 1:
            return np.asarray(values[..., None] * places)
        inside = np.clip(places[:, None] - np.asarray(self.breaks[:-1]), 0.0, self.lengths)
        return np.asarray(values @ inside.T)
