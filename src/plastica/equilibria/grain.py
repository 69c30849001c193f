"""On which scale the laws vary, place by place: how long the first pieces may be so that nothing hides in one.

The range of natural curvatures is cut into cells. In a cell either no equilibrium can be limiting, which the ranges of
the laws there and the bound on the lever of the thrust show; or the laws are bounded in a complex disc four times as
wide as the cell, so that their polynomial of degree 19 in it is exact to rounding; or the search gives the cell up, and
says so. Both follow from the formulas of the laws, by interval arithmetic (`plastica.material.discs`), and not
from samples.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from plastica.equilibria.elastica import ends
from plastica.equilibria.reach import free
from plastica.material.discs import enclosed
from plastica.material.material import Laws
from plastica.numerics import chebyshev as ch

__all__ = ["Grain", "first_cuts", "grain"]

Array = NDArray[np.float64]
Flags = NDArray[np.bool_]

DISC: Final = 4.0
"""Radius of the discs in half widths of a cell."""

SHARE: Final = 0.75
"""Of the width of a cell, what a piece may span: the disc about the piece's middle is then in that about the cell's."""

LARGEST: Final = 300.0
"""Bound in the disc, relative to the terms of the drive, at which 4e-17 of it is rounding."""

NARROWEST: Final = 1e-8
"""Width, relative to its place and to a millionth of the range, at which a cell is given up."""

MOST: Final = 40_000
"""Cells looked at; what is left then is given up."""


@dataclass(frozen=True)
class Grain:
    """Cells of natural curvature, in ascending order and without gaps.

    Attributes
    ----------
    edges : ndarray, shape (n + 1,)
        Ends of the cells.
    longest : ndarray, shape (n,)
        What a piece may span in each: infinite where no equilibrium is limiting.
    unknown : ndarray of bool, shape (n,)
        Where the laws could not be bounded.
    """

    edges: Array
    longest: Array
    unknown: Flags

    @property
    def complete(self) -> bool:
        """Whether all cells are known."""
        return not self.unknown.any()

    @property
    def sentence(self) -> str:
        """What is not known."""
        low, high = self.edges[:-1][self.unknown], self.edges[1:][self.unknown]
        where = f"between {low.min():.6g}/L and {high.max():.6g}/L" if low.size else "nowhere"
        return f"The laws could not be bounded at natural curvatures {where}, so that something narrow may hide there."

    def allowed(self, low: Array, high: Array) -> Array:
        """Return what pieces may span, given the least and the largest natural curvature in each."""
        last = self.longest.size - 1
        first = np.clip(np.searchsorted(self.edges, low, side="right") - 1, 0, last)
        end = np.clip(np.searchsorted(self.edges, high, side="left"), first + 1, last + 1)
        padded = np.append(self.longest, np.inf)
        return np.asarray(np.minimum.reduceat(padded, np.column_stack([first, end]).ravel())[::2])


def grain(gamma: float, laws: Laws, bound: float, rough: Sequence[float] | Array) -> Grain:
    """Cut natural curvatures up to a bound into cells, in each of which the laws are known well enough.

    Parameters
    ----------
    gamma : float
        Thrust.
    laws : Laws
        Dimensionless laws.
    bound : float
        Largest natural curvature.
    rough : sequence of float
        Where a law may fail to be analytic; cells next to these may stay unknown.

    Returns
    -------
    Grain
    """
    doubling = bound * 2.0 ** -np.arange(0.0, 21.0)
    whole = np.concatenate([-doubling, [0.0], doubling, [x for x in rough if abs(x) < bound]])
    edges = np.unique(whole)
    a, b = edges[:-1], edges[1:]
    done: list[tuple[Array, Array, Array, Flags]] = []
    looked = 0
    while a.size:
        looked += a.size
        free, fine = _judged(gamma, laws, a, b)
        narrow = b - a <= NARROWEST * np.maximum(np.maximum(np.abs(a), np.abs(b)), 1e-6 * bound)
        stop = free | fine | narrow | (looked > MOST)
        unknown = ~free & ~fine
        longest = np.where(free, np.inf, SHARE * (b - a))
        done.append((a[stop], b[stop], longest[stop], unknown[stop]))
        middle = 0.5 * (a + b)[~stop]
        a, b = np.concatenate([a[~stop], middle]), np.concatenate([middle, b[~stop]])
    a, b, longest, unknown = (np.concatenate(column) for column in zip(*done, strict=True))
    order = np.argsort(a)
    unknown &= ~_beside(a, b, rough, bound)
    return Grain(np.append(a[order], b[order][-1:]), longest[order], unknown[order])


def _beside(a: Array, b: Array, rough: Sequence[float] | Array, bound: float) -> Flags:
    """Tell which cells end next to a place where a law is known to be rough."""
    at = np.asarray(rough, dtype=float)[:, None]
    near = 2.0 * NARROWEST * np.maximum(np.abs(at), 1e-6 * bound)
    return np.asarray(((a <= at + near) & (b >= at - near) & (b - a <= 2.0 * near)).any(axis=0))


def _judged(gamma: float, laws: Laws, a: Array, b: Array) -> tuple[Flags, Flags]:
    """Tell in which cells nothing is limiting, and in which the laws are bounded well enough."""
    slope, threshold = enclosed(laws.preference, 1, a, b, DISC), enclosed(laws.threshold, 0, a, b, DISC)
    size = np.maximum(np.abs(a), np.abs(b)) + np.abs(slope.centre) + np.abs(threshold.centre)
    fine = slope.radius + threshold.radius <= LARGEST * size
    return free(gamma, slope, threshold, a, b), np.asarray(fine & np.isfinite(size))


def first_cuts(gamma: float, searched: float, cuts: Sequence[float], pieces: int, known: Grain) -> Array:
    """Cut the clamp curvatures so that the natural curvature spans no more on any piece than the laws allow.

    Parameters
    ----------
    gamma : float
        Thrust.
    searched : float
        The range is [0, searched].
    cuts : sequence of float
        Where to cut in any case.
    pieces : int
        How many pieces to begin with, at least.
    known : Grain
        What the laws allow.

    Returns
    -------
    ndarray
        In ascending order, without the ends.
    """

    def natural(x: Array, _row: NDArray[np.int64]) -> Array:
        return ends(gamma, x).mu_nat

    def size(x: Array, _row: NDArray[np.int64]) -> Array:
        return np.abs(x) + 0.5 * gamma

    inside = [x for x in cuts if 0.0 < x < searched]
    live = ch.resolve(natural, size, [np.unique(np.concatenate([np.linspace(0.0, searched, pieces + 1), inside]))])
    edges = [live.a]
    while live.row.size:
        mean, spread = ch.span(live.c)
        low, high = mean - spread - live.tolerance, mean + spread + live.tolerance
        # both signs of alpha: the natural curvature is odd in it
        allowed = np.minimum(known.allowed(low, high), known.allowed(-high, -low))
        wide = (high - low > allowed) & ~live.unresolved & (live.b - live.a > 1e-12 * np.abs(live.b))
        live = ch.halves(live.only(wide))
        edges.append(live.a)
    return np.unique(np.concatenate(edges))[1:]
