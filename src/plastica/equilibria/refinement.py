"""Polylines of coarse points made into curves: Newton's method at any column, looked at again where it may stray."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

__all__ = ["Curve", "Level", "Line", "refined"]

Array = NDArray[np.float64]
Plane = Callable[[Array, Array], tuple[Array, Array, Array]]

GRADED = 6
"""Points between a fold and the next column on either side, closer the nearer to the fold."""

APART = 1e-10
"""Relative distance in gamma from a fold within which no other points are put."""

MOST = 12
SETTLED = 1e-9
"""Newton's method is done after a step of this relative size: the next would be rounding."""


@dataclass(frozen=True)
class Level:
    """A function whose zeros are followed.

    Attributes
    ----------
    plane : callable
        (gamma, alpha) in; f, df/d alpha and df/d gamma out. At folds the second is a residual too; elsewhere the
        derivatives only steer Newton's method.
    columns : callable
        Thrusts in; for each all roots alpha in ascending order.
    symmetric : bool
        Whether the zeros are symmetric in alpha, so that two may meet at alpha = 0: they do at gamma = ((k+1/2) pi)^2.
    """

    plane: Plane
    columns: Callable[[Array], list[Array]]
    symmetric: bool


@dataclass(frozen=True)
class Curve:
    """One curve as a polyline; `folds` are the numbers of its points at which gamma turns."""

    gamma: Array
    alpha: Array
    folds: tuple[int, ...]


@dataclass(frozen=True)
class Line:
    """A polyline of column points and folds, with the distance of each to the next root of its kind in its column."""

    gamma: Array
    alpha: Array
    room: Array
    folds: tuple[int, ...]


@dataclass(frozen=True)
class _Piece:
    """What lies between two folds or ends, in ascending gamma: a graph, its coarse points and its new ones."""

    gamma: Array
    alpha: Array
    forward: bool
    known: tuple[float, float]
    inside: Array
    guess: Array
    room: Array


def refined(level: Level, lines: list[Line], gamma: Array) -> tuple[Curve, ...]:
    """Put points at the given thrusts, and closer ones next to the folds, on all pieces of all lines.

    Parameters
    ----------
    level : Level
        The function.
    lines : list of Line
        Polylines of points on the curves.
    gamma : ndarray
        Thrusts, ascending.

    Returns
    -------
    tuple of Curve
        One for each line.
    """
    pieces = [_pieces(line, gamma) for line in lines]
    every = [piece for each in pieces for piece in each]
    solved = iter(_checked(level, every))
    return tuple(_put_together(each, [next(solved) for _ in each]) for each in pieces)


def _pieces(line: Line, gamma: Array) -> list[_Piece]:
    last = line.gamma.size - 1
    cuts = [0, *(i for i in line.folds if 0 < i < last), last]
    return [_piece(line, slice(i, j + 1), gamma, (i in line.folds, j in line.folds)) for i, j in pairwise(cuts)]


def _piece(line: Line, part: slice, gamma: Array, turns: tuple[bool, bool]) -> _Piece:
    forward = bool(line.gamma[part][-1] > line.gamma[part][0])
    way = slice(None, None, 1 if forward else -1)
    g, a, free = line.gamma[part][way], line.alpha[part][way], line.room[part][way]
    at_low, at_high = turns if forward else (turns[1], turns[0])
    # a column that goes through a fold to rounding is that fold
    inside = gamma[(gamma > g[0] * (1.0 + APART * at_low)) & (gamma < g[-1] * (1.0 - APART * at_high))]
    near = (np.arange(1, GRADED + 1) / (GRADED + 1.0)) ** 2
    around = np.concatenate([g[:1], inside, g[-1:]])
    low = around[0] + near * (around[1] - around[0]) if at_low else near[:0]
    high = around[-1] - near[::-1] * (around[-1] - around[-2]) if at_high else near[:0]
    inside = np.unique(np.concatenate([low, inside, high]))
    stretch, target = (_stretched(x, g[0], g[-1] - g[0], at_low, at_high) for x in (g, inside))
    behind = np.clip(np.searchsorted(g, inside), 1, g.size - 1)
    room = 0.3 * np.minimum(free[behind - 1], free[behind])
    known = 0 if not at_low else g.size - 1 if not at_high else g.size // 2
    return _Piece(g, a, forward, (float(g[known]), float(a[known])), inside, _smooth(stretch, a, target), room)


def _put_together(pieces: list[_Piece], solved: list[Array]) -> Curve:
    gamma, alpha, folds = [], [], []
    for n, (piece, inner) in enumerate(zip(pieces, solved, strict=True)):
        way = slice(None, None, 1 if piece.forward else -1)
        first = 1 if n else 0
        gamma.append(np.concatenate([piece.gamma[:1], piece.inside, piece.gamma[-1:]])[way][first:])
        alpha.append(np.concatenate([piece.alpha[:1], inner, piece.alpha[-1:]])[way][first:])
        folds.append(sum(part.size for part in gamma) - 1)
    return Curve(np.concatenate(gamma), np.concatenate(alpha), tuple(folds[:-1]))


def _stretched(g: Array, low: float, span: float, at_low: bool, at_high: bool) -> Array:
    """Return a coordinate in which alpha is smooth: the square root of the distance next to a fold, else gamma."""
    t = np.clip((g - low) / span, 0.0, 1.0) if span > 0.0 else np.zeros_like(g)
    if at_low and at_high:
        return np.arcsin(np.sqrt(t))
    if at_low:
        return np.sqrt(t)
    return 1.0 - np.sqrt(1.0 - t) if at_high else t


def _smooth(x: Array, y: Array, at: Array) -> Array:
    """Interpolate by the cubic through the four nearest points, or a lower degree where there are fewer."""
    if x.size < 3:
        return np.asarray(np.interp(at, x, y))
    width = min(4, x.size)
    first = np.clip(np.searchsorted(x, at) - width // 2, 0, x.size - width)
    near = first[:, None] + np.arange(width)
    total = np.zeros_like(at)
    for i in range(width):
        others = [j for j in range(width) if j != i]
        factor = [(at - x[near[:, j]]) / (x[near[:, i]] - x[near[:, j]]) for j in others]
        total += y[near[:, i]] * np.prod(factor, axis=0)
    return total


def _checked(level: Level, pieces: list[_Piece]) -> list[Array]:
    """Newton's method, and all roots of the column where it may have left its piece.

    It has where f_alpha has the other sign, which is one on a piece, or where it went too far toward the next root
    with the same sign.
    """
    if not pieces:
        return []
    sizes = [piece.inside.size for piece in pieces]
    owner = np.repeat(np.arange(len(pieces)), sizes)
    g, guess, room = (np.concatenate([getattr(p, name) for p in pieces]) for name in ("inside", "guess", "room"))
    known = np.array([piece.known for piece in pieces])
    a = _solved(level, g, guess)
    f, slope, _ = level.plane(np.concatenate([g, known[:, 0]]), np.concatenate([a, known[:, 1]]))
    sign = np.sign(slope[g.size :])[owner]
    with np.errstate(all="ignore"):
        good = np.abs(f / slope)[: g.size] <= 1e-9 * (1.0 + np.abs(a))
    good &= (np.sign(slope[: g.size]) == sign) & (np.abs(a - guess) <= room)
    wrong = np.flatnonzero(~good)
    for i, roots in zip(wrong, level.columns(g[wrong]) if wrong.size else [], strict=True):
        same = roots[np.sign(level.plane(np.full(roots.size, g[i]), roots)[1]) == sign[i]]
        a[i] = same[np.argmin(np.abs(same - guess[i]))] if same.size else guess[i]
    return np.split(a, np.cumsum(sizes)[:-1])


def _solved(level: Level, g: Array, guess: Array) -> Array:
    """Newton's method in alpha at all points at once, each until its steps are rounding."""
    a, live = guess.copy(), np.arange(guess.size)
    for _ in range(MOST):
        f, slope, _ = level.plane(g[live], a[live])
        size = 1.0 + np.abs(a[live])
        with np.errstate(all="ignore"):
            step = np.clip(np.nan_to_num(f / slope), -size, size)
        a[live] -= step
        live = live[np.abs(step) > SETTLED * size]
        if not live.size:
            break
    return a
