"""How fast a formula changes, and where: stretches of time with the longest step that overlooks nothing in them.

Nothing is concluded from samples alone. The range is halved until, on every piece, interval arithmetic on the formula
and its first two derivatives shows that the formula is slow there, or as fast throughout as it is seen to be, or can do
no more than a negligible push. What cannot be shown within a bounded number of pieces is told.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, Final, TypeAlias

import numpy as np
from numpy.typing import NDArray

from plastica.material import functions as fn
from plastica.material.enclosure import Bounds, Enclosure, enclosure
from plastica.material.expression import symbol
from plastica.physics.polyline import near
from plastica.physics.program import BURST

__all__ = ["Paces", "joined", "paces_of"]

Array: TypeAlias = NDArray[np.float64]
Span: TypeAlias = tuple[float, float]

MOST_PIECES: Final = 40_000
"""Pieces that are looked at for each term of a formula, and again for the zeros of each argument of pos or abs."""

MOST_BENDS: Final = 2000
"""Zeros of an argument of pos or abs beyond which it is followed like a term, whatever becomes of its sign."""

MOST_TERMS: Final = 40
MOST_STEPS: Final = 20_000
"""Steps beyond which what is fastest and does least is no longer followed, and told."""

MOST_LOST: Final = 1e-3
"""How much of its range times a unit of time may be given up for that; a formula that is as fast for longer than that
is followed, whatever it costs."""

NEGLIGIBLE: Final = 1e-11
"""A push (change times duration) that no run resolves, relative to the range of the formula, at most to 1."""

BENT: Final = 1e-9
"""The same for what a formula can push beside the straight line through a piece."""

BOW: Final = 1.0 / 32.0
"""The share of the range of a formula, at most of 1, by which it may part from a straight line in such a step."""

MOST_STRETCHES: Final = 1000
_SAMPLES: Final = 24
_EPS: Final = float(np.finfo(float).eps)
# Three irregular places in each eighth of a piece, so that no wave is met at the same phase throughout.
_PLACES: Final = (np.arange(_SAMPLES) // 3 + (0.31 + 0.6180339887498949 * np.arange(_SAMPLES)) % 1.0) * 3.0 / _SAMPLES


@dataclass(frozen=True, eq=False)
class Paces:
    """Pieces of [0, until] and the longest step on each.

    Attributes
    ----------
    edges : ndarray, shape (n + 1,)
        Where the pieces begin and end.
    steps : ndarray, shape (n,)
        The longest step that overlooks no change; infinite where any step will do.
    hidden : tuple of (float, float)
        Where changes too short to be followed cannot be excluded.
    """

    edges: Array
    steps: Array
    hidden: tuple[Span, ...]

    def longest(self, a: float, b: float) -> float:
        """Return the longest step on [a, b]."""
        # Neighbours that are only touched, but for rounding, do not count.
        inside = (self.edges[:-1] < b - 4.0 * near(b)) & (self.edges[1:] > a + 4.0 * near(a))
        return float(self.steps[inside].min(initial=np.inf))

    @cached_property
    def turns(self) -> tuple[float, ...]:
        """The times at which the pace changes so much that a step must end there."""
        return self.changes(MOST_STRETCHES)

    def changes(self, most: int) -> tuple[float, ...]:
        """Return where the pace changes so much that a step or an element must end there: at most so many places."""
        ratio = BURST
        while True:
            found = self._turns(ratio)
            if len(found) <= most:
                return tuple(found)
            ratio *= 2.0

    def scaled(self, factor: float) -> Paces:
        """Return the paces of the same formula over a variable that is `factor` times as large."""
        spans = tuple((low * factor, high * factor) for low, high in self.hidden)
        return Paces(self.edges * factor, self.steps * factor, spans)

    def between(self, a: float, b: float) -> Paces:
        """Return the part on [a, b]."""
        inside = (self.edges[:-1] < b) & (self.edges[1:] > a)
        edges = np.clip(np.append(self.edges[:-1][inside], b), a, b)
        spans = tuple((max(low, a), min(high, b)) for low, high in self.hidden if low < b and high > a)
        return Paces(edges, self.steps[inside], spans)

    def _turns(self, ratio: float) -> list[float]:
        found: list[float] = []
        capped = np.minimum(self.steps, self.edges[-1])
        least = most = float(capped[0])
        for edge, step in zip(self.edges[1:-1].tolist(), capped[1:].tolist(), strict=True):
            least, most = min(least, step), max(most, step)
            if most > ratio * least:
                found.append(edge)
                least = most = step
        return found

    @cached_property
    def looks(self) -> Array:
        """Times to look at, dense where the formula changes fast."""
        width = np.diff(self.edges)
        busy = np.isfinite(self.steps)
        return np.unique(np.ravel(self.edges[:-1][busy, None] + width[busy, None] * _PLACES))


def paces_of(
    tree: Any, variable: str, values: Mapping[str, float], breaks: Sequence[float], until: float, scale: float
) -> Paces:
    """Find how fast a formula changes on [0, until].

    Parameters
    ----------
    tree : sympy.Expr
        The formula.
    variable : str
        The name of its variable, which is `scale` times the time here.
    values : mapping of str to float
        Its parameters.
    breaks : sequence of float
        Times at which it jumps or bends where the argument of a step, pos or abs is linear.
    until : float
        End of the range, positive.
    scale : float
        The variable per unit of time.

    Returns
    -------
    Paces
        With at most `MOST_PIECES` evaluations per term and per argument.
    """
    search = _Search(variable, values, until, scale)
    inner = [t for t in breaks if 0.0 < t < until]
    terms = tree.args if tree.is_Add and len(tree.args) <= MOST_TERMS else (tree,)
    for term in terms if until > 0.0 else ():
        if fn.depends(term, symbol(variable)):
            search.term(term, inner)
    return search.found(inner)


def joined(parts: Sequence[Paces]) -> Paces:
    """Return the paces of what is one formula after another, each on its own stretch."""
    edges = [*(part.edges[:-1] for part in parts), parts[-1].edges[-1:]]
    spans = tuple(span for part in parts for span in part.hidden)
    return Paces(np.concatenate(edges), np.concatenate([part.steps for part in parts]), spans)


@dataclass(eq=False)
class _Pieces:
    """Pieces that are done with: ends, longest steps, and the most that the formula can push in them."""

    low: Array = field(default_factory=lambda: np.empty(0))
    high: Array = field(default_factory=lambda: np.empty(0))
    step: Array = field(default_factory=lambda: np.empty(0))
    push: Array = field(default_factory=lambda: np.empty(0))

    def add(self, low: Array, high: Array, step: Array, push: Array) -> None:
        self.low, self.high = np.append(self.low, low), np.append(self.high, high)
        self.step, self.push = np.append(self.step, step), np.append(self.push, push)


_FIELDS: Final = ("low", "high", "step", "push")


class _Search:
    """The search through the terms of one formula."""

    def __init__(self, variable: str, values: Mapping[str, float], until: float, scale: float) -> None:
        self.variable, self.values, self.until, self.scale = variable, values, until, scale
        self.pieces: list[_Pieces] = []
        self.bends: list[float] = []
        self.extent = 0.0
        self.hidden: list[Span] = []

    def enclosure(self, tree: Any) -> Enclosure:
        return enclosure(tree, self.variable, self.values, self.scale)

    def slope(self, tree: Any) -> Any:
        return fn.derive(tree, symbol(self.variable))

    def term(self, tree: Any, breaks: Sequence[float]) -> None:
        """Find the pieces of one term."""
        bends, crowded = self._bends(tree)
        self.bends += bends
        edges = self._ends(*breaks, *bends)
        low, high = edges[:-1].copy(), edges[1:].copy()
        low[1:] += 4.0 * np.array([near(t) for t in edges[1:-1]])
        high[:-1] -= 4.0 * np.array([near(t) for t in edges[1:-1]])
        home = 0.5 * (low + high)
        if crowded:
            home[:] = np.nan
        fits = low < high
        # Zeros too many to be found lie no closer than their argument changes: it is followed like a term.
        for each in (tree, *crowded):
            slope = self.slope(each)
            formulas = [self.enclosure(formula) for formula in (each, slope, self.slope(slope))]
            pieces, hidden, extent = _refined(formulas, low[fits], high[fits], home[fits])
            at = np.clip(np.searchsorted(edges, pieces.low + 4.0 * (high - low).min() * _EPS) - 1, 0, low.size - 1)
            pieces.low = np.where(pieces.low == low[at], edges[at], pieces.low)
            self.pieces.append(pieces)
            self.extent += extent
            self.hidden += hidden

    def _ends(self, *breaks: float) -> Array:
        """Ends of what lies between breaks; those that rounding alone tells apart are one."""
        ends = [0.0]
        for t in sorted(breaks):
            if t - ends[-1] > 8.0 * near(t) and self.until - t > 8.0 * near(t):
                ends.append(t)
        return np.array([*ends, self.until])

    def _bends(self, tree: Any) -> tuple[list[float], list[Any]]:
        """Zeros of those arguments of pos and abs that are not linear, and the arguments that have too many."""
        bends: list[float] = []
        crowded: list[Any] = []
        for node in sorted(tree.atoms(fn.pos, fn.absolute), key=str):
            inner = node.args[0]
            slope = self.slope(inner)
            if fn.depends(slope, symbol(self.variable)):
                zeros = _zeros(self.enclosure(inner), self.enclosure(slope), self.until)
                if zeros is None:
                    crowded.append(inner)
                bends += zeros or []
        return bends, crowded

    def found(self, breaks: Sequence[float]) -> Paces:
        """Join the pieces of all terms."""
        pieces = [each for each in self.pieces if each.low.size]
        joined = _Pieces(*(np.concatenate([getattr(each, name) for each in (_Pieces(), *pieces)]) for name in _FIELDS))
        self.hidden += _given_up(joined, self.extent)
        ends = self._ends(*breaks, *self.bends)
        # No step is longer than the way from one break of the formula to the next.
        alone = _Pieces(ends[:-1], ends[1:], np.diff(ends) if ends.size > 2 else np.array([np.inf]), np.diff(ends))
        edges = np.unique(np.concatenate([joined.low, ends]))
        steps, first = np.full(edges.size - 1, np.inf), 0
        for each in (*pieces, alone):
            mine = joined.step[first : first + each.low.size] if each is not alone else alone.step
            first, order = first + each.low.size, np.argsort(each.low)
            at = np.clip(np.searchsorted(each.low[order], edges[:-1], side="right") - 1, 0, order.size - 1)
            steps = np.minimum(steps, mine[order][at])
        return Paces(edges, steps, _joined(self.hidden))


def _refined(formulas: Sequence[Enclosure], low: Array, high: Array, home: Array) -> tuple[_Pieces, list[Span], float]:
    """Halve pieces until each is shown to be slow, evenly fast or negligible; and those for which that fails.

    The range of the values that were seen comes with them.
    """
    done, hidden = _Pieces(), list[Span]()
    least, most, looked = np.inf, -np.inf, 0
    while low.size:
        looked += low.size
        width = high - low
        value, slope, bend = (each(low, high, home) for each in formulas)
        points = low[:, None] + width[:, None] * _PLACES
        seen = formulas[0].at(points)
        finite = seen[np.isfinite(seen)]
        least, most = min(least, float(finite.min(initial=np.inf))), max(most, float(finite.max(initial=-np.inf)))
        extent = max(most - least, 0.0)
        with np.errstate(all="ignore"):
            change, size = value[1] - value[0], np.maximum(np.abs(value[0]), np.abs(value[1]))
            push = change * width
            small = (push <= NEGLIGIBLE * min(extent, 1.0)) | (np.isfinite(change) & (change <= 4.0 * _EPS * size))
            pace, shown = _pace(formulas, points, slope, bend, width, min(extent, 1.0))
        known = small | shown
        step = np.where(small, np.inf, pace)
        middle = 0.5 * (low + high)
        narrow = ~known & (width <= 8.0 * np.spacing(np.abs(high)))
        if looked > MOST_PIECES:
            narrow = ~known
        hidden += zip(low[narrow].tolist(), high[narrow].tolist(), strict=True)
        step[narrow & ~(step > 0.0)] = np.inf
        over = known | narrow
        done.add(low[over], high[over], step[over], push[over])
        split = ~over
        low, high = np.concatenate([low[split], middle[split]]), np.concatenate([middle[split], high[split]])
        home = np.concatenate([home[split], home[split]])
    return done, hidden, max(most - least, 0.0)


def _pace(
    formulas: Sequence[Enclosure], points: Array, slope: Bounds, bend: Bounds, width: Array, extent: float
) -> tuple[Array, NDArray[np.bool_]]:
    """Longest steps on pieces, and whether they are shown to overlook nothing.

    The time scale is that in which the slope changes as much as it is seen to, or by its own size: at the fastest that
    it can on a piece that is evenly fast, at the fastest that is seen where the piece is shown to hold no more.
    """
    seen = formulas[1].at(points)
    spread = seen.max(axis=1) - seen.min(axis=1)
    steepest = np.maximum(np.abs(bend[0]), np.abs(bend[1]))
    eighths = np.abs(formulas[2].at(points)).reshape(len(width), 8, -1).max(axis=2)
    bounded = np.isfinite(steepest) & np.isfinite(slope[0]) & np.isfinite(slope[1])
    straight = steepest * width <= 8.0 * _EPS * np.maximum(np.abs(slope[0]), np.abs(slope[1]))
    slow = (steepest * width <= 4.0 * spread) & (spread > 0.0)
    even = (4.0 * eighths >= steepest[:, None]).all(axis=1) & (spread > 0.0)
    # Bounds are too wide near what is straight. Where they allow no push to speak of, a step may be so long that the
    # formula, bent like that throughout, would part from a straight line by a small share of its range.
    flat = steepest * width**3 <= 8.0 * BENT * extent
    gentle = np.maximum(4.0 * width, np.sqrt(2.0 * BOW * extent / steepest))
    # Next to a point of inflection the slope changes little on a short piece: its size is the measure there.
    varied = np.maximum(spread, np.abs(seen).max(axis=1))
    least, likely = 0.5 * varied / steepest, 0.5 * varied / eighths.max(axis=1)
    pace = np.where(slow, np.clip(likely, least, np.maximum(width, least)), np.where(even, least, likely))
    pace = np.where(straight, np.inf, np.where(flat, np.fmax(pace, gentle), pace))
    return pace, bounded & (straight | flat | slow | even)


def _zeros(inner: Enclosure, slope: Enclosure, until: float) -> list[float] | None:
    """Changes of sign of an argument to the last bit; None where there are too many."""
    low, high = np.array([0.0]), np.array([until])
    zeros, looked = list[float](), 0
    while low.size:
        looked += low.size
        if looked > MOST_PIECES or len(zeros) > MOST_BENDS:
            return None
        value, rate = inner(low, high), slope(low, high)
        may = (value[0] <= 0.0) & (value[1] >= 0.0) & ~((value[0] == 0.0) & (value[1] == 0.0))
        last = (rate[0] > 0.0) | (rate[1] < 0.0) | (high - low <= 8.0 * np.spacing(high))
        for a, b in zip(low[may & last], high[may & last], strict=True):
            zeros += _bisected(inner.at, float(a), float(b))
        split = may & ~last
        middle = 0.5 * (low + high)[split]
        low, high = np.concatenate([low[split], middle]), np.concatenate([middle, high[split]])
    return zeros


def _bisected(function: Callable[[Array], Array], low: float, high: float) -> list[float]:
    """The first double at or beyond a change of sign, from the left; nothing where there is none."""
    first, last = (bool(function(np.array([t]))[0] >= 0.0) for t in (low, high))
    if first == last:
        return []
    while True:
        middle = 0.5 * (low + high)
        if not low < middle < high:
            return [high]
        if bool(function(np.array([middle]))[0] >= 0.0) == first:
            low = middle
        else:
            high = middle


def _given_up(pieces: _Pieces, extent: float) -> list[Span]:
    """Give up following what does least where following all would take too many steps; where, if that is enough."""
    width = pieces.high - pieces.low
    count = width / np.minimum(pieces.step, width)
    if count.sum() <= MOST_STEPS:
        return []
    order = np.argsort(pieces.push / count)
    lost = np.cumsum(pieces.push[order])
    left = count.sum() - np.cumsum(count[order])
    enough = int(np.argmax(left <= MOST_STEPS))
    if lost[enough] > MOST_LOST * extent:
        return []
    chosen = order[: enough + 1]
    chosen = chosen[pieces.step[chosen] < width[chosen]]
    pieces.step[chosen] = width[chosen]
    return list(zip(pieces.low[chosen].tolist(), pieces.high[chosen].tolist(), strict=True))


def _joined(spans: Sequence[Span]) -> tuple[Span, ...]:
    """Spans in order, those that touch made one."""
    joined: list[Span] = []
    for low, high in sorted(spans):
        if joined and low <= joined[-1][1] + 8.0 * near(low):
            joined[-1] = joined[-1][0], max(joined[-1][1], high)
        else:
            joined.append((low, high))
    return tuple(joined)
