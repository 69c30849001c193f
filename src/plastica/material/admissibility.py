"""The hypotheses of the theory (design 1.2), each judged with a margin and a witness.

A hypothesis is read off the formula where that is possible, for all arguments; otherwise it is examined at many
points of a range, and the sentence says so. Nothing here solves or simplifies without bound.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING, Final

import numpy as np
import sympy as sp

from plastica.errors import ArgumentError
from plastica.material import functions as fn
from plastica.material.compiled import constant_value
from plastica.material.examined import DEFAULT_BOUND, Examined, jump_at, positive_zero
from plastica.material.expression import symbol
from plastica.material.halfline import HalfLine, deepest

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from plastica.material.material import Material

__all__ = ["DEFAULT_BOUND", "Verdict", "judge", "positive_zero"]

_ROUNDING: Final = 64 * float(np.finfo(float).eps)
_TINY: Final = 1e-250
_VANISHING: Final = 1e-12
_FAR: Final = tuple(10.0**k for k in (3, 6, 12, 24, 48, 96))


@dataclass(frozen=True)
class Verdict:
    """One hypothesis, judged.

    Attributes
    ----------
    name : str
        The hypothesis.
    holds : bool
        Whether it holds.
    margin : float
        How far it is from failing, below 0 if it fails: the least value of an energy, a threshold or a flow that
        must be positive; minus the largest deviation where something must vanish, be even or be continuous; the
        growth where something must grow.
    witness : float or None
        An argument at which it fails.
    sentence : str
        The verdict in words, with the numbers, and whether it comes from the formula or from a range.
    """

    name: str
    holds: bool
    margin: float
    witness: float | None
    sentence: str


def judge(material: Material, bound: float | None = None) -> tuple[Verdict, ...]:
    """Judge every hypothesis on a material.

    Parameters
    ----------
    material : Material
        The material.
    bound : float, optional
        The a-priori bound of |m| (claim 2) for what can only be judged numerically. If None, and for the flow law:
        `DEFAULT_BOUND` times the largest parameter with the variable's unit (1 if there is none), and far out.

    Returns
    -------
    tuple of Verdict
        On the preference energy: even, 0 and flat at 0, not negative, C2, growing; on the threshold: even, C1,
        bounded below by a positive number; on the flow law: 0 for x <= 0, positive beyond, C1.

    Raises
    ------
    ArgumentError
        If the bound is not a positive number.
    """
    if bound is not None and not (math.isfinite(bound) and bound > 0.0):
        raise ArgumentError("must be a positive number", where="bound", value=bound)
    preference, threshold, flow = (
        Examined(name, material.expressions[name], material.values, limit, material.variable_scale(name))
        for name, limit in (("preference", bound), ("threshold", bound), ("flow", None))
    )
    return (
        _even(preference),
        _vanishes_at_0(preference, 0),
        _vanishes_at_0(preference, 1),
        _not_negative(preference),
        _smooth(preference, 2),
        _grows(preference),
        _even(threshold),
        _smooth(threshold, 1),
        _bounded_below(threshold),
        _vanishes_below_0(flow),
        _positive_above_0(flow),
        _smooth(flow, 1),
    )


_FROM_FORMULA: Final = "from its formula"


def _verdict(law: Examined, name: str, failure: str, margin: float, witness: float | None, how: str) -> Verdict:
    """Put a verdict into words: it holds if there is no witness."""
    holds = witness is None
    said = f"The {law.title} {name}" if holds else f"The {law.title} must be such that it {name}, but {failure}"
    return Verdict(f"{law.name} {name}", holds, margin, witness, f"{said} ({how}).")


def _even(law: Examined) -> Verdict:
    name, tree, variable = "is even", law.expression.tree, symbol(law.letter)
    if tree.xreplace({variable: -variable}) == tree or (law.sides is not None and _same(*law.sides)):
        return _verdict(law, name, "", 0.0, None, _FROM_FORMULA)
    value, grid = law.part(0), law.grid[law.grid > 0.0]
    right, left = value(grid), value(-grid)
    with np.errstate(all="ignore"):
        odd = np.where(np.isnan(right) & np.isnan(left) | (right == left), 0.0, np.abs(right - left))
        fails = ~(odd <= 1e3 * _ROUNDING * (law.size(grid) + law.size(-grid)))
    fails &= odd != 0.0
    largest = float(np.max(np.where(np.isnan(odd), math.inf, odd)))
    if not fails.any():
        return _verdict(law, name, "", -largest, None, law.range_words)
    m = _readable(grid[fails])
    words = f"it is {float(value(m)):.6g} at {law.letter} = {m:.6g} and {float(value(-m)):.6g} at {-m:.6g}"
    return _verdict(law, name, words, -largest, m, law.range_words if law.sides is None else _FROM_FORMULA)


def _vanishes_at_0(law: Examined, order: int) -> Verdict:
    name = ("vanishes at 0", "has slope 0 at 0")[order]
    tree = law.expression.derivative(order).tree
    values = {**law.values, law.letter: 0.0}
    at_zero = [constant_value(term, values) for term in sp.Add.make_args(tree)]
    value = math.fsum(at_zero) if all(map(math.isfinite, at_zero)) else math.nan
    if abs(value) <= _ROUNDING * math.fsum(map(abs, at_zero)):
        return _verdict(law, name, "", 0.0, None, _FROM_FORMULA)
    what, margin = "it" if order == 0 else "its slope", -abs(value) if math.isfinite(value) else -math.inf
    failure = f"{what} is {value:.6g} there" if math.isfinite(value) else f"{what} has no value there"
    return _verdict(law, name, failure, margin, 0.0, _FROM_FORMULA)


def _not_negative(law: Examined) -> Verdict:
    where, least, how = _least(law)
    words = f"it is {least:.6g} at {law.letter} = {where:.6g}"
    return _verdict(law, "is nowhere negative", words, least, None if least >= 0.0 else where, how)


def _bounded_below(law: Examined) -> Verdict:
    where, least, how = _least(law)
    if 0.0 < least <= _VANISHING * abs(float(law.part(0)(0.0))):
        least = 0.0
    words = f"it comes to {least:.6g} at {law.letter} = {where:.6g}"
    name = "is bounded below by a positive number"
    return _verdict(law, name, words, least, None if least > 0.0 else where, how)


def _least(law: Examined) -> tuple[float, float, str]:
    """Return where a law is least, its value there, and how that was found."""
    if law.sides is not None:
        left, right = law.sides[0].least(), law.sides[1].least()
        if left is not None and right is not None:
            u, least = min(left, right, key=lambda pair: pair[1])
            return _finite_witness(law, u if right[1] <= left[1] else -u, least)
    grid = law.grid if law.bound is not None else np.concatenate([-np.array(_FAR[::-1]), law.grid, _FAR])
    grid = np.sort(np.concatenate([grid, deepest(law.part(0), law.grid)]))
    values, size = law.part(0)(grid), law.size(grid)
    with np.errstate(invalid="ignore"):
        values = np.where(np.abs(values) <= 16 * _ROUNDING * size, np.maximum(values, 0.0), values)
    values = np.where(np.isfinite(values), values, math.inf)
    least = float(np.min(values))
    return _readable(grid[values <= least + 1e-9 * abs(least)]), least, law.range_words


def _finite_witness(law: Examined, where: float, least: float) -> tuple[float, float, str]:
    """Where a sum of powers falls without bound, go out until it is negative."""
    if math.isfinite(where):
        return where, least, _FROM_FORMULA
    m = math.copysign(1.0, where)
    for _ in range(1000):
        if float(law.part(0)(m)) < 0.0:
            break
        m *= 2.0
    return m, float(law.part(0)(m)), _FROM_FORMULA


def _grows(law: Examined) -> Verdict:
    name = "grows without bound"
    if law.sides is not None:
        tops = [half.terms[-1] if half.terms else (0.0, 0.0) for half in law.sides]
        power, coefficient = min(tops, key=lambda top: math.copysign(top[0], top[1]))
        fails = not (power > 0.0 and coefficient > 0.0)
        words = f"far out it is like {coefficient:.4g}*|{law.letter}|**{power:g}"
        return _verdict(law, name, words, math.copysign(power, coefficient), 1e6 if fails else None, _FROM_FORMULA)
    lowest = []
    for start in (law.grid[-1] / 4.0, law.grid[-1] / 2.0, *(_FAR if law.bound is None else ())):
        window = start * np.linspace(1.0, 2.0, 2001)
        values = law.part(0)(np.concatenate([window, -window]))
        lowest.append(float(np.min(np.where(np.isnan(values), math.inf, values))))
    rises = [math.inf if b == math.inf else b - a - 1e-6 * abs(a) for a, b in pairwise(lowest)]
    margin = min(rises)
    words = f"its least value further and further out goes {lowest[0]:.6g}, {lowest[1]:.6g}, {lowest[-1]:.6g}"
    how = f"numerically, beyond |{law.letter}| = {law.grid[-1] / 4.0:.4g}"
    return _verdict(law, name, words, margin, None if margin > 0.0 else float(law.grid[-1]), how)


def _vanishes_below_0(law: Examined) -> Verdict:
    name, x = "is 0 for x <= 0", symbol(law.letter)
    formula = law.expression.tree.xreplace({fn.pos(x): sp.S.Zero}) == 0
    if formula or (law.sides is not None and not law.sides[0].terms and float(law.part(0)(0.0)) == 0.0):
        return _verdict(law, name, "", 0.0, None, _FROM_FORMULA)
    grid = law.grid[law.grid <= 0.0]
    values = np.abs(law.part(0)(grid))
    fails = ~(values == 0.0)
    if not fails.any():
        return _verdict(law, name, "", 0.0, None, law.range_words)
    witness = _readable(grid[fails])
    words = f"at x = {witness:.6g} it is {float(law.part(0)(witness)):.6g}"
    largest = float(np.max(np.where(np.isnan(values), math.inf, values)))
    return _verdict(law, name, words, -largest, witness, law.range_words)


def _positive_above_0(law: Examined) -> Verdict:
    name = "is positive for x > 0"
    half = law.sides[1] if law.sides is not None else None
    least = half.without_lowest_power().least() if half is not None and half.terms else None
    if half is not None and least is not None:
        value = half.value(1.0)
        if least[1] > 0.0:
            return _verdict(law, name, "", value, None, f"{_FROM_FORMULA}; the margin is its value at x = 1")
        ladder = [1.0, *(2.0**k for n in range(1, 100) for k in (n, -n))]
        witness = next((u for u in ladder if half.value(u) < 0.0), least[0])
        words = f"at x = {witness:.6g} it is {float(law.part(0)(witness)):.6g}"
        return _verdict(law, name, words, min(half.value(witness), 0.0), witness, _FROM_FORMULA)
    return _positive_on_grid(law, name)


def _positive_on_grid(law: Examined, name: str) -> Verdict:
    grid = law.grid[law.grid > 0.0]
    grid = np.sort(np.concatenate([grid, deepest(law.part(0), grid)]))
    values, size = law.part(0)(grid), law.size(grid)
    rounding = np.abs(values) <= 16 * _ROUNDING * size
    values = np.where(rounding & (values != 0.0), 0.0, values)
    # close to 0 a positive law may be lost in rounding, or underflow
    first = int(np.argmax(values > 0.0))
    lost = (rounding[:first] & (size[:first] > 0.0)) | (0.0 < float(values[first]) < _TINY)
    judged = np.where(np.isnan(values), -math.inf, values)
    judged[:first][lost] = values[first]
    judged[_underflows(values)] = _TINY
    least = float(np.min(judged))
    if least > 0.0:
        return _verdict(law, name, "", least, None, law.range_words)
    witness = _readable(grid[judged <= 0.0])
    words = f"at x = {witness:.6g} it is {float(law.part(0)(witness)):.6g}"
    return _verdict(law, name, words, least, witness, law.range_words)


def _underflows(values: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Tell which values are 0 at the far end only because tiny ones precede them."""
    positive = np.flatnonzero(values > 0.0)
    tail = np.zeros(values.shape, dtype=bool)
    if positive.size and values[positive[-1]] < _TINY:
        tail[positive[-1] + 1 :] = values[positive[-1] + 1 :] == 0.0
    return tail


def _smooth(law: Examined, order: int) -> Verdict:
    name = "is twice continuously differentiable" if order == 2 else "is continuously differentiable"
    how = _FROM_FORMULA if law.sides is not None else law.range_words
    parts = [law.part(k) for k in range(order + 1)]
    for k, part in enumerate(parts):
        values = part(law.grid)
        if np.isnan(values).any():
            witness = float(law.grid[np.flatnonzero(np.isnan(values))[0]])
            if 0.0 in law.grid[np.isnan(values)]:
                witness = 0.0
            words = f"its derivative of order {k} has no value at {law.letter} = {witness:.6g}"
            return _verdict(law, name, words, -math.inf, witness, how)
    for z in law.suspects():
        for k, part in enumerate(parts):
            jump = jump_at(part, z, law.grid[-1])
            if jump > 0.0:
                words = f"its derivative of order {k} jumps by {jump:.6g} at {law.letter} = {z:.6g}"
                return _verdict(law, name, words, -jump, z, how)
    return _verdict(law, name, "", 0.0, None, how)


def _same(a: HalfLine, b: HalfLine) -> bool:
    pairs = [(a.coefficient(p), b.coefficient(p)) for p in {p for p, _ in a.terms + b.terms}]
    return all(abs(x - y) <= _ROUNDING * (abs(x) + abs(y)) for x, y in pairs)


def _readable(witnesses: NDArray[np.float64]) -> float:
    """Return the witness nearest to 1, the easiest to check by hand."""
    with np.errstate(divide="ignore"):
        return float(witnesses[int(np.argmin(np.abs(np.log(np.abs(witnesses)))))])
