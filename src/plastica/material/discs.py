"""Enclosures of laws over intervals of their argument: ranges on the real line, and discs in the complex plane.

The range shows where a law cannot have a given value. The disc shows on which scale the law can vary: a function that
is analytic and bounded by B on a disc differs, on an interval of a quarter of the disc's width about its centre, by
some 4e-17 B from its polynomial of degree 19 (Trefethen, Approximation Theory and Approximation Practice, theorem 8.2),
so that nothing hides between the samples. All values are those of exact arithmetic, up to the rounding of doubles.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
import sympy as sp
from numpy.typing import NDArray

from plastica.material import functions as fn
from plastica.material.compiled import constant_value
from plastica.material.expression import symbol
from plastica.material.material import Law

__all__ = ["Disc", "enclosed", "is_even"]

Array = NDArray[np.float64]

_HAIR: Final = 1e-9
"""Share of an argument's spread by which it may seem to pass through 0 where an interval ends at a kink."""


@dataclass(frozen=True)
class Disc:
    """What a function does over intervals.

    Attributes
    ----------
    low, high : ndarray, shape (n,)
        Bounds of its real values on each interval; nan or infinite where none is known.
    centre : ndarray, shape (n,)
        Its value at the middle of each.
    radius : ndarray, shape (n,)
        Bound of |f(z) - centre| over the complex disc about the middle; infinite where f may not be analytic in it.
    """

    low: Array
    high: Array
    centre: Array
    radius: Array

    @property
    def least(self) -> Array:
        """Lower bounds of the magnitudes of the real values."""
        return np.maximum(np.maximum(self.low, -self.high), 0.0)

    @property
    def most(self) -> Array:
        """Upper bounds of the magnitudes of the real values."""
        return np.maximum(np.abs(self.low), np.abs(self.high))


def enclosed(law: Law, order: int, a: Array, b: Array, stretch: float) -> Disc:
    """Enclose a law or one of its derivatives over intervals of its (dimensionless) argument.

    Parameters
    ----------
    law : Law
        The law, with its numbers and scales.
    order : int
        0 for the law, 1 for its slope.
    a, b : ndarray, shape (n,)
        The intervals.
    stretch : float
        Radius of the discs, in half widths of the intervals: at least 1.

    Returns
    -------
    Disc
    """
    scale = law.argument_scale
    middle, half = 0.5 * (a + b), 0.5 * (b - a)
    argument = Disc(scale * a, scale * b, scale * middle, scale * stretch * half)
    variable = symbol(str(law.expression.variable))
    known: dict[Any, Disc] = {variable: argument}
    tree = law.expression.derivative(order).tree
    with np.errstate(all="ignore"):
        bare = _of(tree, variable, dict(law.values), known, a.size)
        return _product(_constant(law.value_scale * scale**order, a.size), bare)


def is_even(law: Law) -> bool:
    """Tell whether a law is seen to be even from its formula."""
    variable, tree = symbol(str(law.expression.variable)), law.expression.tree
    return bool(tree.xreplace({variable: -variable}) == tree)


def _of(tree: Any, variable: Any, values: Mapping[str, float], known: dict[Any, Disc], n: int) -> Disc:
    if tree in known:
        return known[tree]
    if not fn.depends(tree, variable):
        found = _constant(constant_value(tree, values), n)
    else:
        parts = [_of(part, variable, values, known, n) for part in tree.args]
        if tree.is_Add or tree.is_Mul:
            found = parts[0]
            for part in parts[1:]:
                found = (_sum if tree.is_Add else _product)(found, part)
        elif tree.is_Pow:
            found = _power(tree, parts, variable, values, known)
        else:
            found = _FUNCTIONS.get(tree.func, _unknown)(parts[0])
    known[tree] = found
    return found


def _constant(value: float, n: int) -> Disc:
    filled = np.full(n, value)
    return Disc(filled, filled, filled, np.zeros(n))


def _made(low: Array, high: Array, centre: Array, radius: Array) -> Disc:
    """Put an enclosure together: what is not a number says nothing."""
    return Disc(
        np.where(np.isnan(low), -np.inf, low),
        np.where(np.isnan(high), np.inf, high),
        centre,
        np.where(np.isfinite(radius) & np.isfinite(centre), radius, np.inf),
    )


def _unknown(u: Disc) -> Disc:
    nothing = np.full(u.centre.size, np.nan)
    return _made(nothing, nothing, u.centre, nothing)


def _sum(u: Disc, v: Disc) -> Disc:
    return _made(u.low + v.low, u.high + v.high, u.centre + v.centre, u.radius + v.radius)


def _product(u: Disc, v: Disc) -> Disc:
    corners = np.array([u.low * v.low, u.low * v.high, u.high * v.low, u.high * v.high])
    zero = ((u.low == 0.0) & (u.high == 0.0)) | ((v.low == 0.0) & (v.high == 0.0))
    low, high = np.where(zero, 0.0, corners.min(axis=0)), np.where(zero, 0.0, corners.max(axis=0))
    radius = np.abs(u.centre) * v.radius + np.abs(v.centre) * u.radius + u.radius * v.radius
    none = ((u.centre == 0.0) & (u.radius == 0.0)) | ((v.centre == 0.0) & (v.radius == 0.0))
    return _made(low, high, np.where(none, 0.0, u.centre * v.centre), np.where(none, 0.0, radius))


def _power(
    tree: Any, parts: list[Disc], variable: Any, values: Mapping[str, float], known: dict[Any, Disc]
) -> Disc:
    base = parts[0]
    if fn.depends(tree.args[1], variable):
        return _exp(_product(parts[1], _log(base)))
    p = constant_value(tree.args[1], values)
    if tree.args[0].func is sp.cosh and p < 0.0:
        return _secant(_of(tree.args[0].args[0], variable, values, known, base.centre.size), p)
    if p == np.floor(p):
        return _whole(base, int(p)) if p >= 0.0 else _inverse(_whole(base, int(-p)))
    ratio = base.radius / np.abs(base.centre)
    n, rest = np.floor(p), p - np.floor(p)
    spread = (1.0 + ratio) ** n * (2.0 - (1.0 - ratio) ** rest) - 1.0 if p > 0.0 else (1.0 - ratio) ** p - 1.0
    radius = np.where((base.centre > 0.0) & (ratio < 1.0), base.centre**p * spread, np.inf)
    sides = np.sort(np.array([np.maximum(base.low, 0.0) ** p, base.high**p]), axis=0)
    return _made(sides[0], sides[1], base.centre**p, radius)


def _whole(base: Disc, n: int) -> Disc:
    sides = np.sort(np.array([base.low**n, base.high**n]), axis=0)
    crosses = (base.low < 0.0) & (base.high > 0.0) & (n % 2 == 0)
    size = np.abs(base.centre)
    radius = (size + base.radius) ** n - size**n
    return _made(np.where(crosses, 0.0, sides[0]), sides[1], base.centre**n, radius)


def _inverse(u: Disc) -> Disc:
    crosses = (u.low <= 0.0) & (u.high >= 0.0)
    size = np.abs(u.centre)
    radius = np.where(size > u.radius, u.radius / (size * (size - u.radius)), np.inf)
    return _made(
        np.where(crosses, np.nan, 1.0 / u.high), np.where(crosses, np.nan, 1.0 / u.low), 1.0 / u.centre, radius
    )


def _exp(u: Disc) -> Disc:
    centre = np.exp(u.centre)
    return _made(
        np.exp(u.low), np.exp(u.high), centre, np.where(centre == 0.0, _shifted(u), centre * np.expm1(u.radius))
    )


def _shifted(u: Disc) -> Array:
    """Bound exp on a disc whose centre is so far left that exp there is 0."""
    return np.asarray(np.exp(u.centre + u.radius))


def _log(u: Disc) -> Disc:
    radius = np.where(u.centre > u.radius, -np.log1p(-u.radius / u.centre), np.inf)
    return _made(np.log(u.low), np.log(u.high), np.log(u.centre), radius)


def _wave(u: Disc, phase: float) -> Disc:
    """Enclose sin(u + phase)."""
    low, high = u.low + phase, u.high + phase
    sides = np.sort(np.sin(np.array([low, high])), axis=0)
    top = np.floor((high - 0.5 * np.pi) / (2.0 * np.pi)) != np.floor((low - 0.5 * np.pi) / (2.0 * np.pi))
    bottom = np.floor((high + 0.5 * np.pi) / (2.0 * np.pi)) != np.floor((low + 0.5 * np.pi) / (2.0 * np.pi))
    open_ = ~(np.isfinite(low) & np.isfinite(high))
    centre, slope = np.sin(u.centre + phase), np.cos(u.centre + phase)
    radius = 2.0 * np.abs(centre) * np.sinh(0.5 * u.radius) ** 2 + np.abs(slope) * np.sinh(u.radius)
    return _made(np.where(bottom | open_, -1.0, sides[0]), np.where(top | open_, 1.0, sides[1]), centre, radius)


def _sin(u: Disc) -> Disc:
    return _wave(u, 0.0)


def _cos(u: Disc) -> Disc:
    return _wave(u, 0.5 * np.pi)


def _tan(u: Disc) -> Disc:
    return _product(_sin(u), _inverse(_cos(u)))


def _sinh(u: Disc) -> Disc:
    centre, slope = np.sinh(u.centre), np.cosh(u.centre)
    radius = 2.0 * np.abs(centre) * np.sinh(0.5 * u.radius) ** 2 + slope * np.sinh(u.radius)
    return _made(np.sinh(u.low), np.sinh(u.high), centre, radius)


def _cosh(u: Disc) -> Disc:
    centre, slope = np.cosh(u.centre), np.sinh(u.centre)
    radius = 2.0 * centre * np.sinh(0.5 * u.radius) ** 2 + np.abs(slope) * np.sinh(u.radius)
    return _made(np.cosh(u.least), np.cosh(u.most), centre, radius)


def _secant(u: Disc, p: float) -> Disc:
    """Enclose cosh^p, p < 0: |cosh(x + iy)|^2 = sinh^2 x + cos^2 y."""
    centre = np.cosh(u.centre) ** p
    near = np.maximum(np.abs(u.centre) - u.radius, 0.0)
    least = np.sinh(near) ** 2 + np.cos(np.minimum(u.radius, 0.5 * np.pi)) ** 2
    return _made(np.cosh(u.most) ** p, np.cosh(u.least) ** p, centre, centre + least ** (0.5 * p))


def _tanh(u: Disc) -> Disc:
    """Enclose tanh: tanh(c + h) - tanh c = tanh h / (cosh^2 c (1 + tanh c tanh h)), |tanh h| <= tan |h|, or coth x."""
    centre, tan = np.tanh(u.centre), np.tan(np.minimum(u.radius, 0.25 * np.pi))
    inside = (u.radius < 0.25 * np.pi) & (np.abs(centre) * tan < 1.0)
    radius = np.where(inside, tan / np.cosh(u.centre) ** 2 / (1.0 - np.abs(centre) * tan), np.inf)
    away = np.abs(u.centre) - u.radius
    radius = np.fmin(radius, np.where(away > 0.0, 1.0 + 1.0 / np.tanh(away), np.inf))
    return _made(np.tanh(u.low), np.tanh(u.high), centre, radius)


def _atan(u: Disc) -> Disc:
    off = np.hypot(1.0, u.centre) - u.radius
    radius = np.where(off > 0.0, u.radius / (off * off), np.inf)
    return _made(np.arctan(u.low), np.arctan(u.high), np.arctan(u.centre), radius)


def _side(u: Disc) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Tell where the argument of a kinked function is on the one side and on the other, a kink at an end apart."""
    hair = _HAIR * (u.high - u.low)
    return u.low >= -hair, u.high <= hair


def _pieced(u: Disc, right: Disc, left: Disc) -> Disc:
    """Put the branches of a kinked function together: analytic where the interval is on one side."""
    above, below = _side(u)
    low = np.where(above, right.low, np.where(below, left.low, np.minimum(right.low, left.low)))
    high = np.where(above, right.high, np.where(below, left.high, np.maximum(right.high, left.high)))
    centre = np.where(above, right.centre, left.centre)
    radius = np.where(above, right.radius, np.where(below, left.radius, np.inf))
    return _made(low, high, centre, radius)


def _negative(u: Disc) -> Disc:
    return Disc(-u.high, -u.low, -u.centre, u.radius)


def _steps(at_right: float, at_left: float) -> Callable[[Disc], Disc]:
    def step(u: Disc) -> Disc:
        return _pieced(u, _constant(at_right, u.low.size), _constant(at_left, u.low.size))

    return step


_FUNCTIONS: Final[dict[Any, Callable[[Disc], Disc]]] = {
    sp.exp: _exp,
    sp.log: _log,
    sp.sin: _sin,
    sp.cos: _cos,
    sp.tan: _tan,
    sp.sinh: _sinh,
    sp.cosh: _cosh,
    sp.tanh: _tanh,
    sp.atan: _atan,
    fn.pos: lambda u: _pieced(u, u, _constant(0.0, u.low.size)),
    fn.absolute: lambda u: _pieced(u, u, _negative(u)),
    fn.above: _steps(1.0, 0.0),
    fn.step: _steps(1.0, 0.0),
    fn.sign: _steps(1.0, -1.0),
}
