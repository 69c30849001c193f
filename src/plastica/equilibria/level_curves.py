"""Curves f(gamma, alpha) = 0, followed through their folds: columns of all roots, joined, and refined by Newton.

At the thrusts of a few columns all roots are known. Between two columns, roots are joined in their order; where the
numbers differ, neighbours meet in folds, f = f_alpha = 0, which are solved for, and the gap is halved until as many are
found as are missing. Then every piece between folds is a graph over gamma, on which Newton's method fills in any
column. Curves that run into one another have been joined wrongly, and everything is done again on closer columns.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from plastica.equilibria.refinement import Curve, Level, Line, refined

__all__ = ["Curve", "Level", "curves"]

Array = NDArray[np.float64]

PER_UNIT = 3.0
"""Columns to begin with, per unit of gamma^(1/2)."""

CLOSER = (1.0, 3.0, 9.0)
"""By how much columns are put closer together where curves have run into one another."""

DEEPEST = 14
"""How often a gap between columns is halved."""


NEWTON = 12
EPS = float(np.finfo(float).eps)


@dataclass(frozen=True)
class _Fold:
    """Where two roots j, j + 1 of a column meet, in the gap behind (side 1) or before it (side -1)."""

    gamma: float
    alpha: float
    j: int


@dataclass(frozen=True)
class _Gap:
    """How the roots of two neighbouring columns are joined: pairs of their numbers, and folds of either column."""

    pairs: tuple[tuple[int, int], ...]
    left: tuple[_Fold, ...]
    right: tuple[_Fold, ...]


def curves(level: Level, low: float, high: float, gamma: Array) -> tuple[tuple[Curve, ...], bool]:
    """Follow all zeros between two thrusts.

    Parameters
    ----------
    level : Level
        The function.
    low, high : float
        The range of thrusts.
    gamma : ndarray
        Thrusts at which every curve shall have points, ascending from `low` to `high`.

    Returns
    -------
    tuple of Curve
        Each from one end to the other, in ascending order of their first point.
    bool
        Whether all columns could be joined.
    """
    for closer in CLOSER:
        columns, found, gaps = _columns(level, low, high, closer * PER_UNIT)
        known = [gap or _Gap((), (), ()) for gap in gaps]
        lines = refined(level, _walked(columns, found, known), gamma)
        if None not in gaps and _apart(lines):
            return lines, True
    return lines, False


def _columns(level: Level, low: float, high: float, per_unit: float) -> tuple[Array, list[Array], list[_Gap | None]]:
    """Find all roots on columns, and more columns until the roots of any two neighbours can be joined."""
    steps = max(4, math.ceil(per_unit * (math.sqrt(high) - math.sqrt(low))))
    columns = np.linspace(math.sqrt(low), math.sqrt(high), steps + 1) ** 2
    columns[0], columns[-1] = low, high
    found = level.columns(columns)
    for halving in range(DEEPEST + 1):
        gaps = [_joined(level, columns[i : i + 2], found[i], found[i + 1]) for i in range(columns.size - 1)]
        wide = [i for i, gap in enumerate(gaps) if gap is None and columns[i + 1] - columns[i] > 1e-9 * columns[i + 1]]
        if not wide or halving == DEEPEST:
            break
        middle = np.array([0.5 * (columns[i] + columns[i + 1]) for i in wide])
        found = _inserted(found, wide, level.columns(middle))
        columns = np.insert(columns, [i + 1 for i in wide], middle)
    return columns, found, gaps


def _apart(lines: tuple[Curve, ...]) -> bool:
    """Tell whether no two curves, or pieces of one, run into one another."""
    if not lines:
        return True
    g, a = np.concatenate([line.gamma for line in lines]), np.concatenate([line.alpha for line in lines])
    order = np.lexsort((a, g))
    closed = sum(line.gamma[0] == line.gamma[-1] and line.alpha[0] == line.alpha[-1] for line in lines)
    same = (np.diff(g[order]) == 0.0) & (np.abs(np.diff(a[order])) <= 64.0 * EPS * (1.0 + np.abs(a[order][1:])))
    return bool(np.count_nonzero(same) <= closed)


def _inserted(found: list[Array], places: list[int], new: list[Array]) -> list[Array]:
    out = []
    at = dict(zip(places, new, strict=True))
    for i, roots in enumerate(found):
        out += [roots, at[i]] if i in at else [roots]
    return out


def _joined(level: Level, thrust: Array, left: Array, right: Array) -> _Gap | None:
    """Join two columns; None where the folds between them could not be told."""
    missing = left.size - right.size
    if missing == 0:
        return _Gap(tuple((j, j) for j in range(left.size)), (), ())
    if missing % 2:
        return None
    rich, other = (left, thrust) if missing > 0 else (right, thrust[::-1])
    folds = _folds(level, other, rich)
    if len(folds) != abs(missing) // 2 or any(b.j - a.j < 2 for a, b in pairwise(folds)):
        return None
    gone = {j for fold in folds for j in (fold.j, fold.j + 1)}
    stay = [j for j in range(rich.size) if j not in gone]
    if missing > 0:
        return _Gap(tuple((j, i) for i, j in enumerate(stay)), tuple(folds), ())
    return _Gap(tuple((i, j) for i, j in enumerate(stay)), (), tuple(folds))


def _folds(level: Level, thrust: Array, rich: Array) -> list[_Fold]:
    """Solve f = f_alpha = 0 from the middle of every pair of neighbours in the column that has more roots."""
    low, high = float(thrust.min()), float(thrust.max())
    middle, apart = 0.5 * (rich[:-1] + rich[1:]), np.diff(rich)
    a, g = middle.copy(), np.full(middle.size, thrust[0])
    near, live = np.zeros(a.size, dtype=bool), np.arange(a.size)
    for _ in range(NEWTON):
        step_g, step_a = _fold_step(level, g[live], a[live], apart[live])
        step_g, step_a = np.clip(step_g, low - high, high - low), np.clip(step_a, -apart[live], apart[live])
        g[live], a[live] = np.maximum(g[live] + step_g, 0.0), a[live] + step_a
        away = np.abs(g[live] - thrust[0]) > 2.0 * (high - low)
        away |= np.abs(a[live] - middle[live]) > 2.0 * apart[live]
        moved = np.abs(step_g) / high + np.abs(step_a) / np.maximum(np.abs(a[live]), apart[live])
        near[live] = (moved < 1e-9) & ~away
        live = live[(moved > 1e-15) & ~away]
        if not live.size:
            break
    slack = 1e-9 * high
    chosen = np.flatnonzero(near & (low - slack <= g) & (g <= high + slack))
    found = _told_apart(level, thrust[0], rich, [_Fold(float(g[j]), float(a[j]), int(j)) for j in chosen])
    if not level.symmetric or rich.size % 2:
        return found
    centre = rich.size // 2 - 1
    thrusts = [((n + 0.5) * math.pi) ** 2 for n in range(math.ceil(math.sqrt(high) / math.pi) + 1)]
    pitchforks = [_Fold(x, 0.0, centre) for x in thrusts if low <= x <= high]
    rest = [fold for fold in found if fold.j != centre]
    return sorted(rest + (pitchforks if len(pitchforks) == 1 else []), key=lambda fold: fold.j)


def _told_apart(level: Level, thrust: float, rich: Array, found: list[_Fold]) -> list[_Fold]:
    """Keep the folds whose f bends as it must between that pair, and for each the nearest of several such pairs."""
    if not found:
        return []
    g, a, j = (np.array([getattr(fold, name) for fold in found]) for name in ("gamma", "alpha", "j"))
    h = 1e-3 * (rich[j + 1] - rich[j])
    bend = level.plane(g, a + h)[1] - level.plane(g, a - h)[1]
    between = level.plane(np.full(j.size, thrust), 0.5 * (rich[j] + rich[j + 1]))[0]
    off = np.maximum(np.maximum(rich[j] - a, a - rich[j + 1]), 0.0)
    out: list[_Fold] = []
    for i in np.lexsort((rich[j + 1] - rich[j], off)):
        new = all(abs(a[i] - fold.alpha) > 1e-6 * (1.0 + abs(a[i])) for fold in out)
        if new and np.sign(bend[i]) == -np.sign(between[i]):
            out.append(found[i])
    return sorted(out, key=lambda fold: fold.j)


def _fold_step(level: Level, g: Array, a: Array, apart: Array) -> tuple[Array, Array]:
    """One step of Newton's method for f = f_alpha = 0, with differences for the second derivatives."""
    h, e = 1e-3 * apart, 1e-5 * np.maximum(g, 1e-3)
    together = level.plane(np.concatenate([g, g, g, g + e]), np.concatenate([a, a + h, a - h, a]))
    f, slope, fg = (part.reshape(4, -1) for part in together)
    fa, faa, fag = slope[0], (slope[1] - slope[2]) / (2.0 * h), (slope[3] - slope[0]) / e
    det = fa * fag - fg[0] * faa
    with np.errstate(all="ignore"):
        step_g, step_a = (faa * f[0] - fa * fa) / det, (fg[0] * fa - f[0] * fag) / det
    return np.nan_to_num(step_g), np.nan_to_num(step_a)


def _walked(columns: Array, found: list[Array], gaps: list[_Gap]) -> list[Line]:
    """Follow neighbours from end to end, and around closed curves."""
    links: dict[tuple[int, float], list[tuple[int, float]]] = {}
    place: dict[tuple[int, float], tuple[float, float, float]] = {}
    for i, roots in enumerate(found):
        for j, x in enumerate(roots.tolist()):
            others = [abs(roots[k] - x) for k in (j - 2, j + 2) if 0 <= k < roots.size]
            place[i, j], links[i, j] = (float(columns[i]), x, float(min(others, default=math.inf))), []

    def link(one: tuple[int, float], other: tuple[int, float]) -> None:
        links[one].append(other)
        links[other].append(one)

    for i, gap in enumerate(gaps):
        for j, k in gap.pairs:
            link((i, j), (i + 1, k))
        for column, folds in ((i, gap.left), (i + 1, gap.right)):
            for fold in folds:
                name = (-1 - i, fold.alpha)
                place[name], links[name] = (fold.gamma, fold.alpha, math.inf), []
                link((column, fold.j), name)
                link(name, (column, fold.j + 1))
    lines = []
    ends = [name for name in sorted(links, key=lambda n: place[n]) if len(links[name]) == 1]
    left = set(links)
    for start in [*ends, *sorted(links, key=lambda n: place[n])]:
        if start not in left:
            continue
        walk = _walk(start, links, left)
        points = np.array([place[name] for name in walk])
        turns = tuple(i for i, name in enumerate(walk) if name[0] < 0)
        lines.append(Line(points[:, 0], points[:, 1], points[:, 2], turns))
    return lines


def _walk(
    start: tuple[int, float], links: dict[tuple[int, float], list[tuple[int, float]]], left: set[tuple[int, float]]
) -> list[tuple[int, float]]:
    walk, here = [start], start
    left.discard(start)
    while True:
        onward = [name for name in links[here] if name in left]
        if not onward:
            closed = len(walk) > 2 and start in links[here]
            return [*walk, start] if closed else walk
        here = onward[0]
        left.discard(here)
        walk.append(here)
