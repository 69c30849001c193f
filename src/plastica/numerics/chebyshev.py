"""Piecewise Chebyshev interpolants of many functions at once, with bounds read off their coefficients."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Final, TypeAlias

import numpy as np
from numpy.polynomial import chebyshev as polynomials
from numpy.typing import NDArray

__all__ = ["DEGREE", "Pieces", "derivative", "halves", "resolve", "restricted", "span", "values"]

Array: TypeAlias = NDArray[np.float64]
Rows: TypeAlias = NDArray[np.int64]
RowFunction: TypeAlias = Callable[[Array, Rows], Array]

DEGREE: Final = 19
"""Degree of every interpolant; what needs more is cut in half."""

_EPS: Final = float(np.finfo(float).eps)
_ROUNDING: Final = 64.0 * _EPS
_FLOOR: Final = 4.0 * _EPS
_TAIL: Final = 4
_DEEPEST: Final = 60
_DEEP, _SHARE_OF_ALL = 30, 2.0**-20
"""After so many halvings that share of the whole function is its scale: a root like |x|^(3/2) has none of its own."""

_TINY: Final = 1e-280
"""What is smaller has lost digits, or will: it counts as 0."""

_MOST: Final = 20_000
_SHARE: Final = 400
_NARROW: Final = 2.0**14 * _EPS
"""Pieces cut down to this width, relative to where they are, are given up: doubles cannot follow what varies there."""

_N: Final = DEGREE + 1
_ANGLES: Final = (2.0 * np.arange(_N) + 1.0) * np.pi / (2.0 * _N)
_NODES: Final = np.cos(_ANGLES)
_WEIGHTS: Final = np.where(np.arange(_N) == 0, 1.0, 2.0) / _N
_TO_COEFFICIENTS: Final = np.cos(np.outer(np.arange(_N), _ANGLES)) * _WEIGHTS[:, None]
_CHECKS: Final = np.array([-1.0, -0.93, -0.71, -0.39, 0.052, 0.47, 0.78, 0.96, 1.0])
_AT_CHECKS: Final = polynomials.chebvander(_CHECKS, DEGREE)
_LEFT: Final = _TO_COEFFICIENTS @ polynomials.chebvander(0.5 * (_NODES - 1.0), DEGREE)
_RIGHT: Final = _TO_COEFFICIENTS @ polynomials.chebvander(0.5 * (_NODES + 1.0), DEGREE)
_DERIVATIVE: Final = np.pad(polynomials.chebder(np.eye(_N), axis=0), ((0, 1), (0, 0)))
_SLOPES: Final = (polynomials.chebvander(_NODES, DEGREE) @ _DERIVATIVE).T


@dataclass(frozen=True)
class Pieces:
    """Interpolants on pieces, in no particular order.

    Attributes
    ----------
    row : ndarray of int, shape (m,)
        Which function each belongs to.
    a, b : ndarray, shape (m,)
        The pieces.
    c : ndarray, shape (m, DEGREE + 1)
        Chebyshev coefficients on each piece.
    tolerance : ndarray, shape (m,)
        Bound of interpolation and rounding error of each.
    unresolved : ndarray of bool, shape (m,)
        Where the function could not be resolved; its coefficients say nothing there.
    """

    row: Rows
    a: Array
    b: Array
    c: Array
    tolerance: Array
    unresolved: NDArray[np.bool_]

    def only(self, chosen: NDArray[np.bool_] | Rows) -> Pieces:
        """Return some of the pieces."""
        tolerance, unresolved = self.tolerance[chosen], self.unresolved[chosen]
        return Pieces(self.row[chosen], self.a[chosen], self.b[chosen], self.c[chosen], tolerance, unresolved)

    @staticmethod
    def joined(parts: Sequence[Pieces]) -> Pieces:
        """Return all pieces of several sets."""
        return Pieces(
            row=np.concatenate([part.row for part in parts]),
            a=np.concatenate([part.a for part in parts]),
            b=np.concatenate([part.b for part in parts]),
            c=np.concatenate([part.c for part in parts]),
            tolerance=np.concatenate([part.tolerance for part in parts]),
            unresolved=np.concatenate([part.unresolved for part in parts]),
        )


def values(c: Array, t: Array) -> Array:
    """Evaluate interpolants by Clenshaw's recurrence: sum_k c[:, k] T_k(t), with t of shape (m,) or (m, points)."""
    c = c[..., None] if t.ndim == 2 else c
    ahead, last = np.zeros_like(t), np.zeros_like(t)
    for k in range(c.shape[1] - 1, 0, -1):
        ahead, last = 2.0 * t * ahead - last + c[:, k], ahead
    return np.asarray(t * ahead - last + c[:, 0])


def span(c: Array) -> tuple[Array, Array]:
    """Return the mean coefficient of each, and a bound on how far it departs from that: sum_{k > 0} |c_k|."""
    return c[:, 0], np.abs(c[:, 1:]).sum(axis=1)


def derivative(c: Array) -> Array:
    """Return the coefficients of the derivatives with respect to t in [-1, 1]."""
    return c @ _DERIVATIVE.T


def halves(pieces: Pieces) -> Pieces:
    """Cut every piece in two, without a new evaluation of the function."""
    middle = 0.5 * (pieces.a + pieces.b)
    left = Pieces(pieces.row, pieces.a, middle, pieces.c @ _LEFT.T, pieces.tolerance, pieces.unresolved)
    right = Pieces(pieces.row, middle, pieces.b, pieces.c @ _RIGHT.T, pieces.tolerance, pieces.unresolved)
    return Pieces.joined([left, right])


def restricted(pieces: Pieces, a: Array, b: Array) -> Pieces:
    """Return the same interpolants on parts of their pieces."""
    centre, half = 0.5 * (pieces.a + pieces.b), 0.5 * (pieces.b - pieces.a)
    t = ((0.5 * (a + b) - centre) / half)[:, None] + (0.5 * (b - a) / half)[:, None] * _NODES
    return replace(pieces, a=a, b=b, c=values(pieces.c, t) @ _TO_COEFFICIENTS.T)


def resolve(f: RowFunction, size: RowFunction | None, cuts: Sequence[Array]) -> Pieces:
    """Cut intervals in halves until every piece carries a verified interpolant.

    A piece is accepted when the last coefficients, and the difference to f at both ends and at seven points between
    the nodes, are below 64 eps (max |f| + |x| max |f'| + size): what rounding makes unknowable anyway.

    Parameters
    ----------
    f : callable
        Points and row numbers in, values out.
    size : callable or None
        Magnitude of the terms that f is made from, as f.
    cuts : sequence of ndarray
        For each row the points at which to cut to begin with, its ends among them.

    Returns
    -------
    Pieces
    """
    row = np.repeat(np.arange(len(cuts)), [cut.size - 1 for cut in cuts])
    a, b = np.concatenate([cut[:-1] for cut in cuts]), np.concatenate([cut[1:] for cut in cuts])
    done: list[Pieces] = []
    count, floor = 0, np.full(len(cuts), _TINY)
    for depth in range(_DEEPEST + 1):
        tried = _interpolate(f, size, row, a, b, floor[row] if depth >= _DEEP else np.full(row.size, _TINY))
        if depth == 0:
            np.maximum.at(floor, row, _SHARE_OF_ALL * np.nan_to_num(np.abs(tried.c).sum(axis=1)))
        narrow = np.asarray(b - a <= _NARROW * np.maximum(np.abs(a), np.abs(b)))
        if depth > 0:
            tried = replace(tried, unresolved=tried.unresolved | narrow)
        stop = narrow | (depth == _DEEPEST) | (count + row.size > _MOST + _SHARE * len(cuts))
        done.append(tried.only(~tried.unresolved | stop))
        count += done[-1].row.size
        again = tried.only(tried.unresolved & ~stop)
        if not again.row.size:
            break
        middle = 0.5 * (again.a + again.b)
        row = np.concatenate([again.row, again.row])
        a, b = np.concatenate([again.a, middle]), np.concatenate([middle, again.b])
    return Pieces.joined(done)


def _interpolate(f: RowFunction, size: RowFunction | None, row: Rows, a: Array, b: Array, floor: Array) -> Pieces:
    centre, half = 0.5 * (a + b), 0.5 * (b - a)

    def at(g: RowFunction, t: Array, chosen: Rows) -> Array:
        x = centre[chosen, None] + half[chosen, None] * t
        return g(x.ravel(), np.repeat(row[chosen], t.size)).reshape(chosen.size, t.size)

    every = np.arange(row.size)
    sampled = at(f, _NODES, every)
    finite = np.isfinite(sampled).min(axis=1)
    c = np.where(finite[:, None], sampled, 0.0) @ _TO_COEFFICIENTS.T
    slope = np.abs(c @ _SLOPES).max(axis=1) / half
    known = floor + np.abs(sampled).max(axis=1) + np.maximum(np.abs(a), np.abs(b)) * slope
    if size is not None:
        known = known + at(size, _NODES[:: _N // 4], every).max(axis=1)
    # a size that overflows says nothing of the rounding, and would make anything pass
    finite &= np.isfinite(known)
    known = np.where(finite, known, 0.0)
    tail = np.abs(c[:, -_TAIL:]).max(axis=1)
    good = np.asarray(finite & (tail <= _ROUNDING * known), dtype=bool)
    off = np.zeros(row.size)
    chosen = np.flatnonzero(good)
    if chosen.size:
        off[chosen] = np.abs(at(f, _CHECKS, chosen) - c[chosen] @ _AT_CHECKS.T).max(axis=1)
    good &= off <= _ROUNDING * known
    tolerance = np.maximum(_FLOOR * known, np.maximum(4.0 * tail, 2.0 * off))
    return Pieces(row, a, b, c, tolerance, ~good)
