"""Zero curves of functions of two variables: marching squares on quadrilaterals, vertices exact to the last bits."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from plastica.numerics.roots import bracketed

__all__ = ["Critical", "Edge", "Polyline", "critical_points", "straight", "zero_curves"]

Array: TypeAlias = NDArray[np.float64]
Index: TypeAlias = NDArray[np.int64]
Function: TypeAlias = Callable[[Array, Array], Array]
Edge: TypeAlias = Callable[[Array, Array, Array, Array, Array], tuple[Array, Array]]
"""Ends (x0, y0), (x1, y1) of edges and shares t in [0, 1] in, the points of the edges there out."""

SHARE = 1e-5
"""Step of the central differences of `critical_points`, relative to the size of the coordinate or one."""

FAR = 4.0
"""How many lengths of its segment, or of the longer one next to it, a critical point may lie away."""

HALVINGS = 16
"""How often a piece of a curve is halved where Newton's method is led astray."""


@dataclass(frozen=True)
class Polyline:
    """One zero curve: its vertices in order; a closed one does not repeat the first."""

    x: Array
    y: Array
    closed: bool


class Critical(NamedTuple):
    """A point of a zero curve: number of the curve, the vertex before it, where it is, and whether to rounding."""

    curve: int
    vertex: int
    x: float
    y: float
    exact: bool


def straight(x0: Array, y0: Array, x1: Array, y1: Array, t: Array) -> tuple[Array, Array]:
    """Return the points of straight edges.

    Parameters
    ----------
    x0, y0, x1, y1 : ndarray
        Their ends.
    t : ndarray
        Share of the way, in [0, 1].

    Returns
    -------
    x, y : ndarray
    """
    return x0 + t * (x1 - x0), y0 + t * (y1 - y0)


def zero_curves(
    f: Function, x: Array, y: Array, values: Array | None = None, edge: Edge = straight
) -> tuple[Polyline, ...]:
    """Trace f(x, y) = 0 through a grid of quadrilaterals.

    Parameters
    ----------
    f : callable
        Arrays (x, y) of one shape in, values out; continuous.
    x, y : ndarray, shape (n, m)
        Corners of the cells.
    values : ndarray, shape (n, m), optional
        f there, where it is known already.
    edge : callable
        The edges between the corners: straight, or what follows the features of f.

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
    px, py = _vertices(f, edge, x.ravel(), y.ravel(), at.ravel(), starts, stops)
    rank = np.full(2 * n * m, -1, dtype=np.int64)
    rank[edges] = np.arange(edges.size)
    pairs = rank[_segments(f, edge, x, y, sign)]
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
    which: list[tuple[int, int]] = []
    parts: list[tuple[Array, ...]] = []
    for i, curve in enumerate(curves):
        x, y = (np.append(z, z[:1]) if curve.closed else z for z in (curve.x, curve.y))
        value = g(x, y)
        k = np.flatnonzero(np.sign(value[:-1]) * np.sign(value[1:]) < 0.0)
        which += [(i, j) for j in k.tolist()]
        # at the tip of a tongue the curve goes on for longer than from one side to the other
        length = np.pad(np.hypot(np.diff(x), np.diff(y)), 1)
        size = np.maximum(np.maximum(length[k], length[k + 1]), length[k + 2])
        parts.append((x[k], y[k], value[k], x[k + 1], y[k + 1], value[k + 1], size))
    if not which:
        return ()
    x0, y0, g0, x1, y1, g1, size = (np.concatenate(column) for column in zip(*parts, strict=True))
    share = g0 / (g0 - g1)
    x, y = x0 + share * (x1 - x0), y0 + share * (y1 - y0)
    px, py, found = _newton(f, g, x, y, FAR * size)
    if not found.all():
        lost = ~found
        nearer = _halved(f, g, *(z[lost] for z in (x0, y0, g0, x1, y1)))
        px[lost], py[lost], found[lost] = _newton(f, g, *nearer, FAR * size[lost])
    rows = zip(which, px.tolist(), py.tolist(), found.tolist(), strict=True)
    return tuple(Critical(i, k, a, b, exact) for (i, k), a, b, exact in rows)


def _vertices(
    f: Function, edge: Edge, x: Array, y: Array, at: Array, starts: Index, stops: Index
) -> tuple[Array, Array]:
    """The root of f on each edge whose corners have different signs."""
    ends = (x[starts], y[starts], x[stops], y[stops])

    def on_edge(t: Array, which: Index) -> Array:
        here = [each[which] for each in ends]
        return f(*edge(here[0], here[1], here[2], here[3], t))

    zeros = np.zeros(starts.size)
    t = bracketed(on_edge, np.arange(starts.size), zeros, zeros + 1.0, at[starts], at[stops])
    return edge(*ends, t)


def _segments(f: Function, edge: Edge, x: Array, y: Array, sign: NDArray[np.bool_]) -> Index:
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
        half = np.full(int(double.sum()), 0.5)
        (a, b), (c, d) = (tuple((x[i][double], y[i][double]) for i in ends) for ends in _SIDES)
        low, high = edge(*a, *b, half), edge(*c, *d, half)
        middle = edge(*low, *high, half)
        # where the centre is like the first corner, the second and the fourth are cut off
        cut = np.where(((f(*middle) > 0.0) == turn[double][:, 0])[:, None], [0, 1, 2, 3], [3, 0, 1, 2])
        out.append(np.take_along_axis(edges[double], cut, axis=-1).reshape(-1, 2))
    return np.concatenate(out)


_HERE, _NEXT = slice(None, -1), slice(1, None)
_SIDES = (((_HERE, _HERE), (_NEXT, _HERE)), ((_HERE, _NEXT), (_NEXT, _NEXT)))
"""Corners at the ends of the two edges of a cell along the first index."""


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


def _slopes(f: Function, x: Array, y: Array) -> tuple[Array, Array]:
    """Both first derivatives by central differences, one-sided at x = 0."""
    hx, hy = SHARE * np.maximum(1.0, np.abs(x)), SHARE * np.maximum(1.0, np.abs(y))
    left = np.maximum(x - hx, 0.0)
    return (f(x + hx, y) - f(left, y)) / (x + hx - left), (f(x, y + hy) - f(x, y - hy)) / (2.0 * hy)


def _newton(f: Function, g: Function, x: Array, y: Array, reach: Array) -> tuple[Array, Array, NDArray[np.bool_]]:
    """Solve f = g = 0 from several starts at once; one that is led astray goes back to where it began, and is told."""
    x0, y0, astray = x.copy(), y.copy(), np.zeros(x.shape, dtype=bool)
    for _ in range(20):
        (fx, fy), (gx, gy) = _slopes(f, x, y), _slopes(g, x, y)
        a, b = f(x, y), g(x, y)
        determinant = fx * gy - fy * gx
        with np.errstate(divide="ignore", invalid="ignore"):
            dx, dy = (a * gy - b * fy) / determinant, (b * fx - a * gx) / determinant
        astray |= ~(np.hypot(x - dx - x0, y - dy - y0) <= reach + 1e-9) | (x - dx < 0.0)
        x, y = np.where(astray, x0, x - dx), np.where(astray, y0, y - dy)
        change = np.where(astray, 0.0, np.hypot(dx, dy))
        if np.all(change <= 1e-15 * np.maximum(1.0, np.hypot(x, y))):
            break
    return x, y, ~astray & (change <= 1e-9)


def _halved(f: Function, g: Function, x0: Array, y0: Array, g0: Array, x1: Array, y1: Array) -> tuple[Array, Array]:
    """Halve the pieces of the curve f = 0 between pairs of points toward the sign change of g; return their middles."""
    for _ in range(HALVINGS):
        x, y = 0.5 * (x0 + x1), 0.5 * (y0 + y1)
        limit = 0.5 * np.hypot(x1 - x0, y1 - y0)
        for _ in range(4):
            fx, fy = _slopes(f, x, y)
            steep = np.hypot(fx, fy)
            step = np.clip(f(x, y) / np.where(steep > 0.0, steep, 1.0), -limit, limit)
            x, y = np.maximum(x - step * fx / steep, 0.0), y - step * fy / steep
        first = np.sign(g(x, y)) != np.sign(g0)
        x0, y0 = np.where(first, x0, x), np.where(first, y0, y)
        x1, y1 = np.where(first, x, x1), np.where(first, y, y1)
    return 0.5 * (x0 + x1), 0.5 * (y0 + y1)
