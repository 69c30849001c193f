"""The hypotheses on many materials of the same formulas at once, in numbers, on a ladder of arguments.

`admissibility.judge` is the judge, and takes milliseconds for each material. Here many are sorted, at some microseconds
each, into those that hold, those that fail for certain, and those that only the judge can tell.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import Any, Final

import numpy as np
import sympy as sp
from numpy.typing import NDArray

from plastica.material import functions as fn
from plastica.material.anywhere import function_of
from plastica.material.examined import DEFAULT_BOUND, Examined, is_smooth, magnitude
from plastica.material.expression import symbol
from plastica.material.material import LAWS, Material

__all__ = ["DOUBTFUL", "FAILS", "HOLDS", "by_formula", "sorted_rows"]

Array = NDArray[np.float64]
Codes = NDArray[np.int8]
Rows = tuple[Array, ...]
Part = Callable[..., Any]

HOLDS, DOUBTFUL, FAILS = 0, 1, 2

LADDER: Final = np.logspace(-6, 8, 14 * 12 + 1)
"""Natural curvatures, in units of 1/L, at which preference and threshold are looked at on both sides of 0."""

EXCESS: Final = np.logspace(-6, 8, 14 * 8 + 1)
"""Excess drives at which the flow law is looked at, in units of its own scale."""

ROUNDING: Final = 64 * float(np.finfo(float).eps)
CLEAR: Final = 1e-9
"""Share of the terms of a law by which it must be below 0 to fail for certain, or above to hold."""

WELLS: Final = 2
"""Local minima on a side that are looked at more closely."""

CLOSER, AROUND = 10, 9
"""How often, and at how many points."""

NEAR: Final = np.array([2.0**-10, 2.0**-20, 2.0**-30])
"""How near to 0 kinks are looked for, in thousandths of the range."""

BLOCK: Final = 256


@dataclass(frozen=True, eq=False)
class _Law:
    """One law as functions of (arguments beside one another, one column for each parameter that varies).

    Attributes
    ----------
    parts : tuple of callable
        The law and those of its derivatives that must be continuous.
    size : callable
        The sum of the magnitudes of its terms.
    formula : bool
        Whether the judge reads off the formula what holds, for all arguments.
    even, rough : bool
        Whether it is even whatever the parameters are; whether it may have a kink.
    scale : float
        Of the arguments.
    """

    parts: tuple[Part, ...]
    size: Part
    formula: bool
    even: bool
    rough: bool
    scale: float


def by_formula(material: Material) -> bool:
    """Whether nothing that is told of a material by its formulas depends on the range of natural curvatures."""
    return all(_law(material, name, ()).formula for name in LAWS)


def sorted_rows(
    material: Material,
    own: Mapping[str, Array],
    unit: float,
    energy: Array | None = None,
    natural: Array | None = None,
) -> Codes:
    """Sort materials that differ in some parameters.

    Parameters
    ----------
    material : Material
        The formulas, and the parameters that all share.
    own : mapping of str to ndarray, shape (rows,)
        The parameters that differ, as numbers in the units of the material; there is at least one.
    unit : float
        1/L: the unit of the natural curvatures that are looked at.
    energy, natural : ndarray, shape (rows,), optional
        Laws that are judged on a range are judged where the preference energy (N) stays below `energy` plus what it is
        at the natural curvature `natural`; everywhere, where these are left out.

    Returns
    -------
    ndarray of int8, shape (rows,)
        `HOLDS`, `DOUBTFUL` or `FAILS`. Looked at are: the preference energy even, 0 and flat at 0, not negative,
        growing; the threshold even and positive; the flow law 0 up to 0 and positive beyond, each on a ladder of
        arguments and around its lowest minima; and whether derivatives jump at 0.
    """
    laws = {name: _law(material, name, tuple(own)) for name in LAWS}
    count = len(next(iter(own.values())))
    codes = np.empty(count, dtype=np.int8)
    with np.errstate(all="ignore"):
        for first in range(0, count, BLOCK):
            some = slice(first, first + BLOCK)
            rows = tuple(values[some, None] for values in own.values())
            reach = np.full((len(rows[0]), 1), np.inf)
            if energy is not None and natural is not None:
                reach = _reach(laws["preference"], unit * LADDER, rows, energy[some, None], natural[some, None])
            codes[some] = _sorted(laws, rows, unit, reach)
    return codes


@lru_cache(maxsize=64)
def _law(material: Material, name: str, varying: tuple[str, ...]) -> _Law:
    expression, letter, values = material.expressions[name], LAWS[name], material.values
    variable, tree = symbol(letter), expression.tree
    fixed = {each: value for each, value in values.items() if each not in varying}

    def compiled(made: Any) -> Part:
        return function_of(made, letter, fixed, varying, np)

    nodes = [each for each in tree.atoms(sp.Function, sp.Pow) if fn.depends(each.args[0], variable)]
    powers = [each for each in nodes if isinstance(each, sp.Pow)]
    moving = any(fn.depends(each.args[1], symbol(other)) for each in powers for other in varying)
    orders = range(3 if name == "preference" else 2)
    return _Law(
        tuple(compiled(expression.derivative(order).tree) for order in orders),
        compiled(magnitude(tree)),
        Examined(name, expression, values, None).sides is not None,
        bool(tree.xreplace({variable: -variable}) == tree),
        moving or not all(is_smooth(each, values, variable) for each in nodes),
        material.variable_scale(name),
    )


def _sorted(laws: Mapping[str, _Law], rows: Rows, unit: float, reach: Array) -> Codes:
    preference, threshold, flow = laws["preference"], laws["threshold"], laws["flow"]
    m, x = unit * LADDER, flow.scale * EXCESS
    at_rest = _at(threshold.parts[0], 0.0, rows)[:, 0]
    found = [
        _large_enough(preference, _sides(preference, m), rows, reach, lambda low, size: low >= -16 * ROUNDING * size),
        _large_enough(threshold, _sides(threshold, m), rows, reach, lambda low, _: low > CLEAR * np.abs(at_rest)),
        _large_enough(flow, (x,), rows, DEFAULT_BOUND * flow.scale, lambda low, _: low > 0.0),
        np.where(at_rest <= 0.0, FAILS, HOLDS),
        _fine(_at(flow.parts[0], np.append(-x, 0.0), rows) == 0.0),
        _even(preference, m, rows, reach),
        _even(threshold, m, rows, reach),
        _flat_at_0(preference, rows),
        _growing(preference, np.where(preference.formula | np.isinf(reach), m[-1], reach), rows),
        *(_without_kink(law, unit, rows) for law in (preference, threshold)),
        _without_kink(flow, flow.scale, rows),
    ]
    return np.asarray(np.maximum.reduce(found), dtype=np.int8)


def _at(part: Part, x: Array | float, rows: Rows) -> Array:
    """A law at arguments beside one another, for all rows; or at other arguments for each."""
    given = np.atleast_2d(x)
    return np.broadcast_to(np.asarray(part(given, *rows), dtype=float), (len(rows[0]), given.shape[1]))


def _fine(holds: NDArray[np.bool_]) -> Codes:
    """Doubtful where something does not hold at every argument."""
    return np.where(holds.all(axis=1), HOLDS, DOUBTFUL).astype(np.int8)


def _sides(law: _Law, x: Array) -> tuple[Array, ...]:
    return (x,) if law.even else (x, -x)


def _reach(preference: _Law, m: Array, rows: Rows, energy: Array, natural: Array) -> Array:
    """Natural curvatures beyond which the preference energy is above a bound, or a step of the ladder farther."""
    within = ~(_at(preference.parts[0], m, rows) > energy + _at(preference.parts[0], natural, rows))
    last = np.where(within.any(axis=1), m.size - 1 - np.argmax(within[:, ::-1], axis=1), 0)
    return np.asarray(np.append(m, np.inf)[last + 1][:, None])


def _large_enough(
    law: _Law, sides: tuple[Array, ...], rows: Rows, reach: Array | float, enough: Callable[[Array, Array], Any]
) -> Codes:
    """Whether the least values of a law are large enough; for certain not, where all of its terms are far below 0."""
    codes = np.full(len(rows[0]), HOLDS, dtype=np.int8)
    for x in sides:
        values = _at(law.parts[0], x, rows)
        used = np.broadcast_to(law.formula | (np.abs(x) <= reach), values.shape)
        codes = np.maximum(codes, _fine(~(used & np.isnan(values))))
        values = np.where(used & ~np.isnan(values), values, np.inf)
        least = np.argmin(values, axis=1)
        for low, where in ((values.min(axis=1), x[least]), *_wells(law, x, values, rows)):
            size = _at(law.size, where[:, None], rows)[:, 0]
            lost = np.where(law.formula & (low < -CLEAR * size), FAILS, DOUBTFUL)
            codes = np.maximum(codes, np.where(enough(low, size), HOLDS, lost))
    return codes


def _wells(law: _Law, x: Array, values: Array, rows: Rows) -> Iterator[tuple[Array, Array]]:
    """Yield the lowest minima between the arguments, and where they are; infinite for rows that have none."""
    middle = values[:, 1:-1]
    local = (middle <= values[:, :-2]) & (middle < values[:, 2:]) & np.isfinite(values[:, 2:])
    for _ in range(WELLS):
        has = np.flatnonzero(local.any(axis=1))
        if has.size == 0:
            return
        place = np.argmin(np.where(local[has], middle[has], np.inf), axis=1)
        local[has, place] = False
        low, where = np.full(len(values), np.inf), np.full(len(values), x[0])
        some = tuple(column[has] for column in rows)
        low[has], where[has] = _bottom(law.parts[0], x[place], x[place + 2], some)
        yield low, where


def _bottom(part: Part, left: Array, right: Array, rows: Rows) -> tuple[Array, Array]:
    """Close in on the least value between two arguments."""
    every = np.arange(left.size)
    for _ in range(CLOSER):
        around = left[:, None] + (right - left)[:, None] * np.linspace(0.0, 1.0, AROUND)
        values = _at(part, around, rows)
        best = np.clip(np.argmin(np.where(np.isnan(values), np.inf, values), axis=1), 1, AROUND - 2)
        left, right = around[every, best - 1], around[every, best + 1]
    return values[every, best], around[every, best]


def _even(law: _Law, x: Array, rows: Rows, reach: Array) -> Codes:
    """Whether a law is the same on both sides of 0."""
    if law.even:
        return np.full(len(rows[0]), HOLDS, dtype=np.int8)
    right, left = _at(law.parts[0], x, rows), _at(law.parts[0], -x, rows)
    size, odd = _at(law.size, x, rows) + _at(law.size, -x, rows), np.abs(right - left)
    for_sure = law.formula & (odd > CLEAR * size).any(axis=1)
    fine = _fine((right == left) | (odd <= 1e3 * ROUNDING * size) | ~(law.formula | (x <= reach)))
    return np.where(for_sure, FAILS, fine).astype(np.int8)


def _flat_at_0(law: _Law, rows: Rows) -> Codes:
    """Whether a law and its slope are 0 at 0, to the rounding of their terms."""
    near = _at(law.size, 0.0, rows)
    return _fine(np.hstack([np.abs(_at(part, 0.0, rows)) <= ROUNDING * near for part in law.parts[:2]]))


def _growing(law: _Law, top: Array, rows: Rows) -> Codes:
    """Whether the least value of a law farther out is larger, on both sides."""
    window = np.linspace(1.0, 2.0, 9)
    lows = []
    for share in (0.25, 0.5):
        sides = [_at(law.parts[0], side * share * top * window, rows) for side in (1.0, -1.0)]
        lows.append(np.minimum(*(side.min(axis=1) for side in sides)))
    return _fine(((lows[1] == np.inf) | (lows[1] - lows[0] > 1e-6 * np.abs(lows[0])))[:, None])


def _without_kink(law: _Law, scale: float, rows: Rows) -> Codes:
    """Whether differences of a law and its derivatives shrink near 0, where formulas mostly have their kinks."""
    if not law.rough:
        return np.full(len(rows[0]), HOLDS, dtype=np.int8)
    codes = np.full(len(rows[0]), HOLDS, dtype=np.int8)
    near = 1e-3 * DEFAULT_BOUND * scale * NEAR
    for part in law.parts:
        right, left, centre = (_at(part, x, rows) for x in (near, -near, 0.0))
        off = np.maximum(np.abs(right - centre), np.abs(left - centre))
        size = np.maximum(np.maximum(np.abs(right), np.abs(left)).max(axis=1), np.abs(centre[:, 0]))
        shrinks = (off[:, 2] <= 0.3 * off[:, 0]) | (off[:, 2] <= 1e-9 * size)
        stays = (off[:, 1:] > 0.7 * off[:, :-1]).all(axis=1) & (off[:, 2] > 1e-6 * size)
        stays |= ~np.isfinite(off).all(axis=1)
        codes = np.maximum(codes, np.where(shrinks, HOLDS, np.where(stays, FAILS, DOUBTFUL)).astype(np.int8))
    return codes
