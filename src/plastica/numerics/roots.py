"""All roots of piecewise analytic functions on an interval, double roots included.

A function is replaced by Chebyshev interpolants on pieces, each verified (Battles and Trefethen's functions as numbers,
with bisection in place of high degrees). What is asked of the function afterwards is asked of the interpolants, where
it can be answered without gaps: a piece is done with when its coefficients show that it has no root, or that it is
monotone, or that it is convex or concave. Then the signs of the function itself at the ends of the monotone parts
decide, and every bracket is closed to the last bits.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Final, TypeAlias

import numpy as np
from numpy.typing import NDArray

from plastica.errors import ArgumentError
from plastica.numerics import chebyshev as ch
from plastica.numerics.brackets import bracketed

__all__ = ["Root", "Roots", "bracketed", "roots", "roots_of_rows"]

Array: TypeAlias = NDArray[np.float64]
Rows: TypeAlias = NDArray[np.int64]
RowFunction: TypeAlias = Callable[[Array, Rows], Array]

_FLAT: Final = 4.0
_DEEPEST: Final = 64
_WIDE: Final = 1e-3


@dataclass(frozen=True)
class Root:
    """One root.

    Attributes
    ----------
    x : float
        Where it is.
    kind : str
        "crossing" where the function changes sign, "tangency" where it touches 0 as far as doubles can tell.
    error : float
        How far the true root may lie from x: rounding of the function over its slope; at a tangency the distance in
        which the function leaves its rounding, (2 tolerance/|f''|)^(1/2), so that two roots nearer than this are one.
    tolerance : float
        What of |f| counts as 0 here: its interpolation and rounding error.
    value : float
        The function there.
    multiplicity : int
        How many roots this may stand for: 1, 2 at a tangency (or none), 3 where three meet as far as doubles can tell.
    """

    x: float
    kind: str
    error: float
    tolerance: float
    value: float
    multiplicity: int = 1


@dataclass(frozen=True)
class Roots:
    """All roots on an interval, in ascending order.

    Attributes
    ----------
    points : tuple of Root
        The roots.
    vanishing : tuple of (float, float)
        Intervals longer than a thousandth of the whole on which the function is 0 to rounding; none of their points
        is in `points`.
    complete : bool
        Whether every piece was resolved, so that no root is missing.
    sentence : str
        The same in words.
    """

    points: tuple[Root, ...]
    vanishing: tuple[tuple[float, float], ...]
    complete: bool
    sentence: str

    @property
    def x(self) -> Array:
        """Where the roots are, shape (number of roots,)."""
        return np.array([root.x for root in self.points], dtype=float)


def roots(
    f: Callable[[Array], Array],
    lo: float,
    hi: float,
    *,
    breaks: Sequence[float] = (),
    size: Callable[[Array], Array] | None = None,
    pieces: int = 8,
) -> Roots:
    """Find all roots of a function that is continuous, and analytic between its breaks.

    Parameters
    ----------
    f : callable
        Array of points in, array of values out.
    lo, hi : float
        The interval, lo < hi.
    breaks : sequence of float
        Where f may fail to be analytic (a kink, a power that is not whole); those outside the interval are ignored.
    size : callable, optional
        Magnitude of what is added up to make f, where terms cancel: f is taken to be known to some eps times this.
    pieces : int
        How many pieces to begin with, at least; a feature of f much narrower than a twentieth of one, away from
        everything else that makes f hard to resolve, could be overlooked.

    Returns
    -------
    Roots

    Raises
    ------
    ArgumentError
        Where the interval is empty or not finite.

    Notes
    -----
    *What is shown.* On every piece the interpolant's last coefficients are below the rounding of f, and it agrees with
    f at points between its nodes; the error bound d is the larger of the two, with a margin. Bounds on the coefficients
    then exclude |p| <= d, or show p' or p'' to be of one sign. *What could be missed*: a feature that hides between all
    samples of a piece, and roots in pairs nearer than `Root.error`, which are reported as one tangency.

    Checked by test_every_sign_change_is_accounted_for, test_double_roots.
    """
    return roots_of_rows(
        lambda x, _row: f(x),
        np.array([lo], dtype=float),
        np.array([hi], dtype=float),
        breaks=(breaks,),
        size=None if size is None else lambda x, _row: size(x),
        pieces=pieces,
    )[0]


def roots_of_rows(
    f: RowFunction,
    lo: Array,
    hi: Array,
    *,
    breaks: Sequence[Sequence[float]] | None = None,
    size: RowFunction | None = None,
    pieces: int | Sequence[int] = 8,
) -> tuple[Roots, ...]:
    """Find all roots of many functions at once: see `roots`.

    Parameters
    ----------
    f : callable
        Points and the number of the function (from 0) at each in, values out.
    lo, hi : ndarray, shape (rows,)
        The interval of each.
    breaks : sequence of sequence of float, optional
        The breaks of each.
    size : callable, optional
        As f.
    pieces : int or sequence of int
        How many pieces each begins with.

    Returns
    -------
    tuple of Roots
        One for each row.

    Raises
    ------
    ArgumentError
        Where an interval is empty or not finite.
    """
    lo, hi = np.atleast_1d(np.asarray(lo, dtype=float)), np.atleast_1d(np.asarray(hi, dtype=float))
    for a, b in zip(lo, hi, strict=True):
        if not (np.isfinite(a) and np.isfinite(b) and a < b):
            raise ArgumentError("must be a finite interval, lo < hi", where="lo, hi", value=(float(a), float(b)))
    given = [()] * lo.size if breaks is None else breaks
    counts = [pieces] * lo.size if isinstance(pieces, int) else pieces
    cuts = [_cuts(a, b, cut, count) for a, b, cut, count in zip(lo, hi, given, counts, strict=True)]
    found = ch.resolve(f, size, cuts)
    monotone, flat = _parts(found)
    every = [*_flats(f, flat, lo, hi), *_simple(f, monotone, lo, hi)]
    missed = found.only(found.unresolved)
    return tuple(_row(f, i, lo[i], hi[i], every, missed) for i in range(lo.size))


def _cuts(lo: float, hi: float, breaks: Sequence[float], pieces: int) -> Array:
    ends = np.unique([lo, *(float(x) for x in breaks if lo < x < hi), hi])
    if pieces == 1:
        return np.asarray(ends, dtype=float)
    parts = []
    for a, b in pairwise(ends):
        cut = np.linspace(a, b, max(int(np.ceil(pieces * (b - a) / (hi - lo))), 1) + 1)
        parts.append(np.concatenate([[a], cut[1:-1]]))
    return np.unique(np.concatenate([*parts, [hi]]))


def _parts(found: ch.Pieces) -> tuple[ch.Pieces, ch.Pieces]:
    """Sort what may hold a root into pieces on which the interpolant is monotone, and pieces on which it vanishes."""
    live = found.only(~found.unresolved)
    monotone, flat = [], []
    for _ in range(_DEEPEST):
        mean, spread = ch.span(live.c)
        first = ch.derivative(live.c)
        rise, bend = ch.span(first), ch.span(ch.derivative(first))
        possible = np.abs(mean) - spread <= live.tolerance
        vanishing = possible & (spread <= _FLAT * live.tolerance)
        rest = possible & ~vanishing
        single = rest & (np.abs(rise[0]) > rise[1])
        convex = rest & ~single & (np.abs(bend[0]) > bend[1])
        flat.append(live.only(vanishing))
        monotone += [live.only(single), _split(live.only(convex))]
        live = ch.halves(live.only(rest & ~single & ~convex))
        if not live.row.size:
            break
    flat.append(live)
    return ch.Pieces.joined(monotone), ch.Pieces.joined(flat)


def _split(pieces: ch.Pieces) -> ch.Pieces:
    """Cut convex and concave pieces where their derivative changes sign."""
    first = ch.derivative(pieces.c)
    left, right = np.full(pieces.row.shape, -1.0), np.full(pieces.row.shape, 1.0)
    d_left, d_right = ch.values(first, left), ch.values(first, right)
    turns = np.flatnonzero(np.sign(d_left) * np.sign(d_right) < 0.0)
    whole, inner = pieces.only(np.flatnonzero(np.sign(d_left) * np.sign(d_right) >= 0.0)), pieces.only(turns)
    t = bracketed(lambda t, i: ch.values(first[i], t), turns, left[turns], right[turns], d_left[turns], d_right[turns])
    x = 0.5 * (inner.a + inner.b) + 0.5 * (inner.b - inner.a) * t
    apart = (inner.a < x) & (x < inner.b)
    whole, inner, x = ch.Pieces.joined([whole, inner.only(~apart)]), inner.only(apart), x[apart]
    return ch.Pieces.joined([whole, ch.restricted(inner, inner.a, x), ch.restricted(inner, x, inner.b)])


@dataclass(frozen=True)
class _Found:
    """One root, and the interval within which other roots are the same one."""

    row: int
    a: float
    b: float
    root: Root


def _flats(f: RowFunction, flat: ch.Pieces, lo: Array, hi: Array) -> list[_Found]:
    """Make one root of every run of pieces on which f vanishes to rounding: its kind from the signs on either side."""
    found: list[_Found] = []
    runs: list[list[int]] = []
    for i in np.lexsort((flat.a, flat.row)):
        last = runs[-1][-1] if runs else -1
        if runs and flat.row[last] == flat.row[i] and flat.a[i] <= flat.b[last]:
            runs[-1].append(int(i))
        else:
            runs.append([int(i)])
    for run in runs:
        row, a, b = int(flat.row[run[0]]), float(flat.a[run[0]]), float(flat.b[run[-1]])
        width = b - a
        inner = np.unique(np.concatenate([flat.a[run], [0.5 * (a + b)], flat.b[run]]))
        places = np.concatenate([inner, [max(a - width, lo[row]), min(b + width, hi[row])]])
        value = f(places, np.full(places.size, row))
        best = np.lexsort((np.abs(inner - 0.5 * (a + b)), np.abs(value[:-2])))[0]
        x, kind = float(inner[best]), "crossing" if value[-2] * value[-1] < 0.0 else "tangency"
        root = Root(x, kind, max(b - x, x - a), float(flat.tolerance[run].max()), float(value[best]), _of_kind(kind))
        found.append(_Found(row, a - width, b + width, root))
    return found


def _of_kind(kind: str) -> int:
    """Return of how many roots one stands that is made of several: an odd or an even number."""
    return 3 if kind == "crossing" else 2


def _simple(f: RowFunction, pieces: ch.Pieces, lo: Array, hi: Array) -> list[_Found]:
    """Close every bracket of a monotone piece, and find the extrema between them at which f is 0 to rounding."""
    if not pieces.row.size:
        return []
    pieces = pieces.only(np.lexsort((pieces.a, pieces.row)))
    ends = np.column_stack([np.tile(pieces.row, 2), np.concatenate([pieces.a, pieces.b])])
    points, back = np.unique(ends, axis=0, return_inverse=True)
    left, right = np.split(f(points[:, 1], points[:, 0].astype(np.int64))[back.ravel()], 2)
    return [*_crossings(f, pieces, left, right), *_extrema(pieces, left, right, lo, hi)]


def _crossings(f: RowFunction, pieces: ch.Pieces, left: Array, right: Array) -> list[_Found]:
    chosen = np.flatnonzero(np.sign(left) * np.sign(right) <= 0.0)
    part = pieces.only(chosen)
    x = bracketed(f, part.row, part.a, part.b, left[chosen], right[chosen])
    at_root = f(x, part.row)
    half = 0.5 * (part.b - part.a)
    steep = np.abs(ch.values(ch.derivative(part.c), np.clip((x - 0.5 * (part.a + part.b)) / half, -1.0, 1.0))) / half
    error = 2.0 * half / np.maximum(1.0, 2.0 * half * steep / part.tolerance)
    found = {}
    for i in range(chosen.size):
        row, place = int(part.row[i]), float(x[i])
        root = Root(place, "crossing", float(error[i]), float(part.tolerance[i]), float(at_root[i]))
        found[row, place] = _Found(row, place, place, root)
    return list(found.values())


def _extrema(pieces: ch.Pieces, left: Array, right: Array, lo: Array, hi: Array) -> list[_Found]:
    """Tangencies: common ends of a rising and a falling piece, and ends of the range, at which f is 0 to rounding."""
    first = ch.derivative(pieces.c)
    half = 0.5 * (pieces.b - pieces.a)
    rising = np.sign(ch.values(first, np.zeros(half.shape)))
    meets = (pieces.b[:-1] == pieces.a[1:]) & (pieces.row[:-1] == pieces.row[1:])
    turns = np.concatenate([meets & (rising[:-1] * rising[1:] < 0.0), [False]])
    at_b = (turns | (pieces.b == hi[pieces.row])) & (np.abs(right) <= pieces.tolerance)
    at_a = (pieces.a == lo[pieces.row]) & (np.abs(left) <= pieces.tolerance)
    ends = [(int(i), 1.0, float(right[i])) for i in np.flatnonzero(at_b)]
    ends += [(int(i), -1.0, float(left[i])) for i in np.flatnonzero(at_a)]
    return [_extremum(pieces, first, half, *end) for end in ends]


def _extremum(pieces: ch.Pieces, first: Array, half: Array, i: int, end: float, value: float) -> _Found:
    t, tolerance = np.array([end]), float(pieces.tolerance[i])
    slope = abs(float(ch.values(first[i : i + 1], t)[0])) / half[i]
    second = abs(float(ch.values(ch.derivative(first[i : i + 1]), t)[0])) / half[i] ** 2
    # f leaves its rounding where slope d + second d^2 / 2 = tolerance
    error = 2.0 * tolerance / (slope + np.sqrt(slope * slope + 2.0 * second * tolerance))
    x = float(pieces.b[i] if end > 0.0 else pieces.a[i])
    reach = 2.0 * float(error)
    return _Found(int(pieces.row[i]), x - reach, x + reach, Root(x, "tangency", float(error), tolerance, value, 2))


def _row(f: RowFunction, row: int, lo: float, hi: float, every: list[_Found], missed: ch.Pieces) -> Roots:
    """Put one row together: what lies within reach of a tangency is that tangency."""
    mine = sorted((each for each in every if each.row == row), key=lambda each: each.a)
    wide = [(each.a, each.b) for each in mine if each.b - each.a > 3.0 * _WIDE * (hi - lo)]
    regions: list[list[_Found]] = []
    for each in mine:
        if any(a <= each.root.x <= b for a, b in wide):
            continue
        if regions and each.a <= max(other.b for other in regions[-1]):
            regions[-1].append(each)
        else:
            regions.append([each])
    points = tuple(_one(f, region, lo, hi) for region in regions)
    vanishing = tuple(((2.0 * a + b) / 3.0, (a + 2.0 * b) / 3.0) for a, b in wide)
    return Roots(points, vanishing, *_judged(missed.only(missed.row == row), vanishing, lo, hi))


def _one(f: RowFunction, region: list[_Found], lo: float, hi: float) -> Root:
    """Make one root of those within each other's reach: an odd or an even one, by the signs on either side."""
    if len(region) == 1:
        return region[0].root
    a, b = max(min(each.a for each in region), lo), min(max(each.b for each in region), hi)
    left, right = f(np.array([a, b]), np.full(2, region[0].row))
    centre = 0.5 * (a + b)
    even = [each.root for each in region if each.a < each.b]
    exact = [each.root for each in region if each.root.value == 0.0]
    near = min(exact + even, key=lambda root: (abs(root.value), abs(root.x - centre)))
    kind = "crossing" if left * right < 0.0 else "tangency"
    error = max(root.error + abs(root.x - near.x) for root in even)
    return replace(near, kind=kind, error=error, multiplicity=_of_kind(kind))


def _judged(missed: ch.Pieces, vanishing: tuple[tuple[float, float], ...], lo: float, hi: float) -> tuple[bool, str]:
    words = f"All roots in [{lo:.6g}, {hi:.6g}]: every piece is resolved to rounding"
    if vanishing:
        words += f"; it vanishes on {', '.join(f'[{a:.6g}, {b:.6g}]' for a, b in vanishing)}"
    if not missed.row.size:
        return True, f"{words}."
    a, b, total = float(missed.a.min()), float(missed.b.max()), float((missed.b - missed.a).sum())
    where = f"in {missed.row.size} pieces between {a:.6g} and {b:.6g}"
    where = f"near {a:.10g}" if b - a <= 1e-6 * (hi - lo) else where
    return False, f"Roots may be missing {where}, {total:.3g} long together, where the function could not be resolved."
