"""Many brackets closed at once."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final, TypeAlias

import numpy as np
from numpy.typing import NDArray

__all__ = ["bracketed"]

Array: TypeAlias = NDArray[np.float64]
Rows: TypeAlias = NDArray[np.int64]
RowFunction: TypeAlias = Callable[[Array, Rows], Array]

_ROUNDING: Final = 4.0 * float(np.finfo(float).eps)
_MOST: Final = 200


def bracketed(f: RowFunction, row: Rows, u: Array, v: Array, fu: Array, fv: Array) -> Array:
    """Close brackets to neighbouring floats or a zero, all at once (Chandrupatla 1997).

    Parameters
    ----------
    f : callable
        Points and row numbers in, values out.
    row : ndarray of int, shape (m,)
        The row of each bracket.
    u, v, fu, fv : ndarray, shape (m,)
        The ends of each, and the values there, of opposite signs or 0.

    Returns
    -------
    ndarray, shape (m,)
        The end of each final bracket at which |f| is least.
    """
    a, b, c, fa, fb, fc = (np.array(x, dtype=float) for x in (v, u, v, fv, fu, fv))
    t = np.full(a.shape, 0.5)
    best, least = np.where(np.abs(fa) < np.abs(fb), a, b), np.minimum(np.abs(fa), np.abs(fb))
    live = np.flatnonzero((least > 0.0) & (a != b))
    for _ in range(_MOST):
        if not live.size:
            break
        x = a[live] + t[live] * (b[live] - a[live])
        y = f(x, row[live])
        same = np.sign(y) == np.sign(fa[live])
        c[live], fc[live] = np.where(same, a[live], b[live]), np.where(same, fa[live], fb[live])
        b[live], fb[live] = np.where(same, b[live], a[live]), np.where(same, fb[live], fa[live])
        a[live], fa[live] = x, y
        nearer = np.abs(fa[live]) < np.abs(fb[live])
        best[live] = np.where(nearer, a[live], b[live])
        least[live] = np.where(nearer, np.abs(fa[live]), np.abs(fb[live]))
        width = np.abs(b[live] - a[live])
        margin = (0.5 * _ROUNDING * np.abs(best[live]) + 1e-300) / np.where(width > 0.0, width, 1.0)
        t[live] = np.clip(_next(*(z[live] for z in (a, b, c, fa, fb, fc))), margin, 1.0 - margin)
        live = live[(margin <= 0.5) & (least[live] > 0.0) & (width > 0.0)]
    return best


def _next(a: Array, b: Array, c: Array, fa: Array, fb: Array, fc: Array) -> Array:
    """Where between a and b to go next: inverse quadratic interpolation where it is safe, else the middle."""
    with np.errstate(all="ignore"):
        xi, phi = (a - b) / (c - b), (fa - fb) / (fc - fb)
        safe = (1.0 - np.sqrt(1.0 - xi) < phi) & (phi < np.sqrt(xi))
        t = fa / (fb - fa) * fc / (fb - fc) + (c - a) / (b - a) * fa / (fc - fa) * fb / (fc - fb)
    return np.where(safe & np.isfinite(t), t, 0.5)
