"""Zero curves of functions of two variables: marching squares on quadrilaterals, vertices exact to the last bits."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from plastica.numerics.roots import bracketed

__all__ = ["Critical", "Polyline", "critical_points", "zero_curves"]

Array: TypeAlias = NDArray[np.float64]
Index: TypeAlias = NDArray[np.int64]
Function: TypeAlias = Callable[[Array, Array], Array]

SHARE = 1e-5
"""Step of the central differences of `critical_points`, relative to the size of the coordinate or one."""

FAR = 4.0
"""How many lengths of its segment a critical point may lie away from it."""


@dataclass(frozen=True)
class Polyline:
    """One zero curve: its vertices in order; a closed one does not repeat the first."""

    x: Array
    y: Array
    closed: bool


class Critical(NamedTuple):
    """A point of a zero curve: number of the curve, the vertex before it, and where it is."""

    curve: int
    vertex: int
    x: float
    y: float


def zero_curves(f: Function, x: Array, y: Array, values: Array | None = None) -> tuple[Polyline, ...]:
    """Trace f(x, y) = 0 through a grid of quadrilaterals.

    Parameters
    ----------
    f : callable
        Arrays (x, y) of one shape in, values out; continuous.
    x, y : ndarray, shape (n, m)
        Corners of the cells.
    values : ndarray, shape (n, m), optional
        f there, where it is known already.

    Returns
    -------
    tuple of Polyline
        Every vertex lies on an edge of the grid and is a root of f there to the last bits. Where a cell has roots on
        all four edges, the sign of f at its centre tells which belong together. What passes a cell without
        separating its corners is not seen.
    """
    at = np.asarray(f(x, y) if values is None else values, dtype=float)
    sign = at > 0.0
    n, m = at.shape
    along, across = sign[:-1, :] != sign[1:, :], sign[:, :-1] != sign[:, 1:]
    # edges are numbered by their lower corner: those along the first index first
    number = np.arange(n * m).reshape(n, m)
    first, second = number[:-1, :][along], number[:, :-1][across]
    edges = np.concatenate([first, second + n * m])
    if not edges.size:
        return ()
    starts, stops = np.concatenate([first, second]), np.concatenate([first + m, second + 1])
    px, py = _vertices(f, x.ravel(), y.ravel(), at.ravel(), starts, stops)
    rank = np.full(2 * n * m, -1, dtype=np.int64)
    rank[edges] = np.arange(edges.size)
    pairs = rank[_segments(f, x, y, sign)]
    return tuple(Polyline(px[chain], py[chain], closed) for chain, closed in _chains(pairs, edges.size))


def critical_points(f: Function, g: Function, curves: tuple[Polyline, ...]) -> tuple[Critical, ...]:
    """Find where a second function vanishes on zero curves of a first one.

    Parameters
    ----------
    f, g : callable
        The functions; the curves are those of f.
    curves : tuple of Polyline
        From `zero_curves`.

    Returns
    -------
    tuple of Critical
        One for each change of the sign of g between neighbouring vertices, in order. They solve f = g = 0 by Newton's
        method with exact residuals, and differences for slopes.
    """
    out: list[Critical] = []
    for i, curve in enumerate(curves):
        x, y = (np.append(z, z[:1]) if curve.closed else z for z in (curve.x, curve.y))
        value = g(x, y)
        turns = np.flatnonzero(np.sign(value[:-1]) * np.sign(value[1:]) < 0.0)
        if not turns.size:
            continue
        share = value[turns] / (value[turns] - value[turns + 1])
        start = [z[turns] + share * (z[turns + 1] - z[turns]) for z in (x, y)]
        size = np.hypot(x[turns + 1] - x[turns], y[turns + 1] - y[turns])
        px, py = _newton(f, g, start[0], start[1], FAR * size)
        out += [Critical(i, int(k), float(a), float(b)) for k, a, b in zip(turns, px, py, strict=True)]
    return tuple(out)


def _vertices(f: Function, x: Array, y: Array, at: Array, starts: Index, stops: Index) -> tuple[Array, Array]:
    """The root of f on each edge whose corners have different signs."""
    x0, y0, dx, dy = x[starts], y[starts], x[stops] - x[starts], y[stops] - y[starts]

    def on_edge(t: Array, edge: Index) -> Array:
        return np.asarray(f(x0[edge] + t * dx[edge], y0[edge] + t * dy[edge]), dtype=float)

    zeros = np.zeros(starts.size)
    t = bracketed(on_edge, np.arange(starts.size), zeros, zeros + 1.0, at[starts], at[stops])
    return x0 + t * dx, y0 + t * dy


def _segments(f: Function, x: Array, y: Array, sign: NDArray[np.bool_]) -> Index:
    """Pairs of edges joined within a cell, shape (segments, 2), by the numbers of `zero_curves`."""
    n, m = sign.shape
    corner = np.arange(n * m).reshape(n, m)[:-1, :-1]
    # the four edges of a cell in turn: y low, x high, y high, x low
    edges = np.stack([corner, corner + m + n * m, corner + 1, corner + n * m], axis=-1)
    turn = np.stack([sign[:-1, :-1], sign[1:, :-1], sign[1:, 1:], sign[:-1, 1:]], axis=-1)
    crossed = turn != np.roll(turn, -1, axis=-1)
    count = crossed.sum(axis=-1)
    single, double = count == 2, count == 4
    out = [edges[single][crossed[single]].reshape(-1, 2)]
    if double.any():
        middle = [0.25 * (z[:-1, :-1] + z[1:, :-1] + z[1:, 1:] + z[:-1, 1:])[double] for z in (x, y)]
        # where the centre is like the first corner, the second and the fourth are cut off
        cut = np.where(((f(*middle) > 0.0) == turn[double][:, 0])[:, None], [0, 1, 2, 3], [3, 0, 1, 2])
        out.append(np.take_along_axis(edges[double], cut, axis=-1).reshape(-1, 2))
    return np.concatenate(out)


def _chains(pairs: Index, count: int) -> list[tuple[Index, bool]]:
    """Join segments into chains of vertices; each vertex belongs to one or two segments."""
    neighbours: list[list[int]] = [[] for _ in range(count)]
    for a, b in pairs.tolist():
        neighbours[a].append(b)
        neighbours[b].append(a)
    seen = [False] * count
    out = []
    ends = [i for i in range(count) if len(neighbours[i]) == 1]
    for start in [*ends, *range(count)]:
        if seen[start]:
            continue
        chain, here = [start], start
        seen[start] = True
        while (following := next((j for j in neighbours[here] if not seen[j]), None)) is not None:
            seen[following] = True
            chain.append(following)
            here = following
        out.append((np.array(chain, dtype=np.int64), len(neighbours[start]) == 2))
    return out


def _newton(f: Function, g: Function, x: Array, y: Array, reach: Array) -> tuple[Array, Array]:
    """Solve f = g = 0 from several starts at once; one that is led astray stays where it began."""
    x0, y0 = x.copy(), y.copy()
    for _ in range(20):
        hx, hy = SHARE * np.maximum(1.0, np.abs(x)), SHARE * np.maximum(1.0, np.abs(y))
        # both functions may be one-sided at x = 0
        left = np.maximum(x - hx, 0.0)
        fx, gx = ((h(x + hx, y) - h(left, y)) / (x + hx - left) for h in (f, g))
        fy, gy = ((h(x, y + hy) - h(x, y - hy)) / (2.0 * hy) for h in (f, g))
        a, b = f(x, y), g(x, y)
        determinant = fx * gy - fy * gx
        with np.errstate(divide="ignore", invalid="ignore"):
            dx, dy = (a * gy - b * fy) / determinant, (b * fx - a * gx) / determinant
        good = np.isfinite(dx) & np.isfinite(dy)
        x, y = np.where(good, x - dx, x), np.where(good, y - dy, y)
        lost = (np.hypot(x - x0, y - y0) > reach + 1e-9) | (x < 0.0)
        x, y = np.where(lost, x0, x), np.where(lost, y0, y)
        change = np.where(good, np.hypot(dx, dy), 0.0)
        if np.all(change <= 1e-15 * np.maximum(1.0, np.hypot(x, y))):
            break
    return x, y
