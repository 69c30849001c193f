"""The hypotheses of the theory (design 1.2), each judged with a margin and a witness.

A hypothesis is read off the formula where that is possible, for all arguments; otherwise it is examined at many
points of a range, and the sentence says so. Nothing here solves or simplifies without bound.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, Final

import numpy as np
import sympy as sp

from plastica.errors import ArgumentError
from plastica.material import functions as fn
from plastica.material.compiled import ArrayFunction, array_function, constant_value
from plastica.material.expression import Expression, symbol
from plastica.material.halfline import HalfLine, half_line, sign_changes, touching

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from plastica.material.material import Material

__all__ = ["DEFAULT_BOUND", "Verdict", "judge", "positive_zero"]

DEFAULT_BOUND: Final = 100.0
"""The range |m| <= 100, x <= 100 of a numerical judgement, where no a-priori bound is given."""

_ROUNDING: Final = 64 * float(np.finfo(float).eps)
_PER_DECADE: Final = 40
_DECADES: Final = 12
_LARGEST_ARGUMENT: Final = 200.0
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
        The a-priori bound of |m| (claim 2) for what can only be judged numerically; `DEFAULT_BOUND` and the
        behaviour far out if None.

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
        _Judged(name, material.expressions[name], material.values, bound)
        for name in ("preference", "threshold", "flow")
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


def positive_zero(expression: Expression, values: Mapping[str, float]) -> float | None:
    """Return the least positive zero of a preference energy, where it touches 0; None if there is none."""
    law = _Judged("preference", expression, values, None)
    grid = law.grid[law.grid > 0.0]
    least = law.sides[1].least() if law.sides is not None else None
    if least is not None and 0.0 < least[0] < math.inf:
        grid = np.sort(np.append(grid, least[0] * np.array([0.99, 1.01])))
    for zero in sorted(sign_changes(law.part(1), grid)):
        below = float(np.max(np.abs(law.part(0)(grid[grid <= zero])), initial=0.0))
        if below > 0.0 and abs(float(law.part(0)(zero))) <= 1e-12 * below:
            return zero
    return None


@dataclass(frozen=True)
class _Judged:
    """One law under judgement."""

    name: str
    expression: Expression
    values: Mapping[str, float]
    bound: float | None

    @property
    def letter(self) -> str:
        return str(self.expression.variable)

    @property
    def title(self) -> str:
        return {"preference": "preference energy", "flow": "flow law"}.get(self.name, self.name)

    @cached_property
    def sides(self) -> tuple[HalfLine, HalfLine] | None:
        """The law as sums of powers: for negative and for positive arguments."""
        both = [half_line(self.expression.tree, symbol(self.letter), self.values, side) for side in (-1, 1)]
        return None if both[0] is None or both[1] is None else (both[0], both[1])

    def part(self, order: int) -> ArrayFunction:
        return self.compiled(self.expression.derivative(order).tree)

    def compiled(self, tree: Any) -> ArrayFunction:
        return array_function(tree, symbol(self.letter), self.values)

    @cached_property
    def grid(self) -> NDArray[np.float64]:
        """Points of both signs, close together near 0 and even further out, where no part overflows."""
        end = self.bound or DEFAULT_BOUND
        ladder = end * np.logspace(-_DECADES, 0, _DECADES * _PER_DECADE + 1)
        right = np.unique(
            np.concatenate([ladder, np.linspace(0.0, end, 1001)[1:], [1.0] if end >= 1 else []])
        )
        grid = np.concatenate([-right[::-1], [0.0], right])
        usable = np.ones(grid.shape, dtype=bool)
        for node in self.expression.tree.atoms(sp.exp, sp.sinh, sp.cosh):
            usable &= ~(np.abs(self.compiled(node.args[0])(grid)) > _LARGEST_ARGUMENT)
        return grid[usable]

    @property
    def range_words(self) -> str:
        return (
            f"numerically, at {self.grid.size} points of |{self.letter}| <= {np.max(np.abs(self.grid)):.4g}"
        )

    def verdict(self, name: str, failure: str, margin: float, witness: float | None, how: str) -> Verdict:
        """Put a verdict into words: it holds if there is no witness."""
        holds = witness is None
        start = f"The {self.title} {name}"
        sentence = (
            f"{start} ({how})."
            if holds
            else f"The {self.title} must be such that it {name}, but {failure} ({how})."
        )
        return Verdict(f"{self.name} {name}", holds, margin, witness, sentence)


_FROM_FORMULA: Final = "from its formula"


def _even(law: _Judged) -> Verdict:
    tree, variable = law.expression.tree, symbol(law.letter)
    if tree.xreplace({variable: -variable}) == tree:
        return law.verdict("is even", "", 0.0, None, _FROM_FORMULA)
    value, grid = law.part(0), law.grid
    with np.errstate(all="ignore"):
        odd = np.abs(value(grid) - value(-grid))
        excess = odd - 1e3 * _ROUNDING * _size(law, grid)
    if law.sides is not None and _same(*law.sides):
        return law.verdict("is even", "", 0.0, None, _FROM_FORMULA)
    worst = _worst(excess)
    if not excess[worst] > 0.0:
        return law.verdict("is even", "", -float(np.nanmax(odd)), None, law.range_words)
    m = float(abs(grid[worst]))
    failure = f"it is {float(value(m)):.6g} at {law.letter} = {m:.6g} and {float(value(-m)):.6g} at {-m:.6g}"
    how = _FROM_FORMULA if law.sides is not None else law.range_words
    return law.verdict("is even", failure, -float(odd[worst]), m, how)


def _vanishes_at_0(law: _Judged, order: int) -> Verdict:
    name = ("vanishes at 0", "has slope 0 at 0")[order]
    tree = law.expression.derivative(order).tree
    at_zero = [
        constant_value(term.xreplace({symbol(law.letter): sp.S.Zero}), law.values)
        for term in sp.Add.make_args(tree)
    ]
    value = math.fsum(at_zero) if all(map(math.isfinite, at_zero)) else math.nan
    if abs(value) <= _ROUNDING * math.fsum(map(abs, at_zero)):
        return law.verdict(name, "", 0.0, None, _FROM_FORMULA)
    what = "it" if order == 0 else "its slope"
    return law.verdict(name, f"{what} is {value:.6g} there", -abs(value), 0.0, _FROM_FORMULA)


def _not_negative(law: _Judged) -> Verdict:
    where, least, how = _least(law)
    words = f"it is {least:.6g} at {law.letter} = {where:.6g}"
    return law.verdict("is nowhere negative", words, least, None if least >= 0.0 else where, how)


def _bounded_below(law: _Judged) -> Verdict:
    where, least, how = _least(law)
    words = f"it is {least:.6g} at {law.letter} = {where:.6g}"
    name = "is bounded below by a positive number"
    return law.verdict(name, words, least, None if least > 0.0 else where, how)


def _least(law: _Judged) -> tuple[float, float, str]:
    """Return where a law is least, its value there, and how that was found."""
    if law.sides is not None:
        found = [
            (side * u, value)
            for side, half in zip((-1, 1), law.sides, strict=True)
            if (p := half.least())
            for u, value in [p]
        ]
        if len(found) == 2:
            where, least = min(found, key=lambda pair: pair[1])
            return _finite_witness(law, where, least)
    grid = law.grid if law.bound is not None else np.concatenate([-np.array(_FAR[::-1]), law.grid, _FAR])
    values = law.part(0)(grid)
    with np.errstate(invalid="ignore"):
        values = np.where(
            np.abs(values) <= 1e3 * _ROUNDING * _size(law, grid), np.maximum(values, 0.0), values
        )
    values = np.where(np.isfinite(values), values, math.inf)
    best = int(np.argmin(values))
    return float(grid[best]), float(values[best]), law.range_words


def _finite_witness(law: _Judged, where: float, least: float) -> tuple[float, float, str]:
    """Where a sum of powers falls without bound, go out until it is negative."""
    if math.isfinite(where):
        return where, least, _FROM_FORMULA
    m = math.copysign(1.0, where)
    for _ in range(1000):
        if float(law.part(0)(m)) < 0.0:
            break
        m *= 2.0
    return m, float(law.part(0)(m)), _FROM_FORMULA


def _grows(law: _Judged) -> Verdict:
    name = "grows without bound"
    if law.sides is not None:
        tops = [half.terms[-1] if half.terms else (0.0, 0.0) for half in law.sides]
        power, coefficient = min(tops, key=lambda top: math.copysign(top[0], top[1]))
        fails = not (power > 0.0 and coefficient > 0.0)
        words = f"far out it is like {coefficient:.4g}*|{law.letter}|**{power:g}"
        return law.verdict(
            name, words, math.copysign(power, coefficient), 1e6 if fails else None, _FROM_FORMULA
        )
    lowest = []
    for start in (law.grid[-1] / 4.0, law.grid[-1] / 2.0, *(_FAR if law.bound is None else ())):
        window = start * np.linspace(1.0, 2.0, 2001)
        values = law.part(0)(np.concatenate([window, -window]))
        lowest.append(float(np.min(np.where(np.isnan(values), math.inf, values))))
    rises = [
        math.inf if b == math.inf else b - a - 1e-6 * abs(a) for a, b in zip(lowest, lowest[1:], strict=False)
    ]
    margin = min(rises)
    words = f"its least value beyond {law.letter} = {law.grid[-1] / 4.0:.4g} goes {lowest[0]:.6g}, {lowest[1]:.6g}, {lowest[-1]:.6g}"
    how = f"numerically, beyond |{law.letter}| = {law.grid[-1] / 4.0:.4g}"
    return law.verdict(name, words, margin, None if margin > 0.0 else float(law.grid[-1]), how)


def _vanishes_below_0(law: _Judged) -> Verdict:
    name = "is 0 for x <= 0"
    x = symbol(law.letter)
    grid = law.grid[law.grid <= 0.0]
    values = np.abs(law.part(0)(grid))
    worst = _worst(values)
    if law.sides is not None and not law.sides[0].terms and values[-1] == 0.0:
        return law.verdict(name, "", 0.0, None, _FROM_FORMULA)
    below = law.expression.tree.xreplace({fn.pos(x): sp.S.Zero})
    if below == 0:
        return law.verdict(name, "", 0.0, None, _FROM_FORMULA)
    largest = float(values[worst])
    words = f"at x = {grid[worst]:.6g} it is {float(law.part(0)(grid[worst])):.6g}"
    failing = None if largest <= 0.0 else float(grid[worst])
    return law.verdict(name, words, -largest, failing, law.range_words)


def _positive_above_0(law: _Judged) -> Verdict:
    name = "is positive for x > 0"
    half = law.sides[1] if law.sides is not None else None
    if half is not None and half.terms and all(c > 0.0 for _, c in half.terms):
        return law.verdict(
            name, "", float(half.value(1.0)), None, f"{_FROM_FORMULA}; the margin is its value at x = 1"
        )
    grid = law.grid[law.grid > 0.0]
    if law.bound is None:
        grid = np.concatenate([grid, _FAR]) if half is not None else grid
    values = law.part(0)(grid)
    # a value that underflows next to a tiny one is not a zero
    tiny = np.convolve((values > 0.0) & (values < 1e-250), [1, 1, 1], mode="same") > 0
    first = np.maximum.accumulate((tiny & (values == 0.0))[::-1])[::-1] & (values == 0.0)
    judged = np.where(first | np.isposinf(values), 1.0, np.where(np.isnan(values), -math.inf, values))
    if half is not None and half.is_polynomial and half.terms:
        judged = np.where(np.abs(values) <= _ROUNDING * np.array([half.size(x) for x in grid]), 0.0, judged)
    worst = int(np.argmin(judged))
    least = float(judged[worst])
    words = f"at x = {grid[worst]:.6g} it is {least:.6g}"
    return law.verdict(name, words, least, float(grid[worst]) if least <= 0.0 else None, law.range_words)


def _smooth(law: _Judged, order: int) -> Verdict:
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
            return law.verdict(name, words, -math.inf, witness, how)
    for z in _suspects(law):
        for k, part in enumerate(parts):
            jump = _jump(part, z, law.grid[-1])
            if jump > 0.0:
                words = f"its derivative of order {k} jumps by {jump:.6g} at {law.letter} = {z:.6g}"
                return law.verdict(name, words, -jump, z, how)
    return law.verdict(name, "", 0.0, None, how)


def _suspects(law: _Judged) -> list[float]:
    """Return the arguments at which a formula may fail to be smooth: kinks, jumps, poles, roots and logarithms of 0."""
    variable, suspects = symbol(law.letter), {0.0}
    for node in law.expression.tree.atoms(sp.Function, sp.Pow):
        inner = node.args[0]
        if not fn.depends(inner, variable) or _is_smooth(node, law.values, variable):
            continue
        function = law.compiled(sp.cos(inner) if isinstance(node, sp.tan) else inner)
        suspects.update(z + 0.0 for z in sign_changes(function, law.grid) + touching(function, law.grid))
    return sorted(suspects, key=abs)


def _is_smooth(node: Any, values: Mapping[str, float], variable: Any) -> bool:
    if isinstance(node, sp.Pow):
        exponent = node.args[1]
        number = math.nan if fn.depends(exponent, variable) else constant_value(exponent, values)
        return number >= 0.0 and number == math.floor(number)
    return isinstance(node, (sp.exp, sp.sin, sp.cos, sp.tanh, sp.sinh, sp.cosh, sp.atan))


def _jump(function: ArrayFunction, z: float, end: float) -> float:
    """Return by how much a function jumps at a point, 0 if the difference across it shrinks with the distance."""
    scale = abs(z) if z != 0.0 else 1e-3 * end
    near = scale * np.array([2.0**-10, 2.0**-20, 2.0**-30])
    right, left, centre = function(z + near), function(z - near), float(function(z))
    if not (np.isfinite(right).all() and np.isfinite(left).all() and math.isfinite(centre)):
        return math.inf
    across = np.abs(right - left)
    off = np.maximum(np.abs(right - centre), np.abs(left - centre))
    size = float(max(np.max(np.abs(right)), np.max(np.abs(left)), abs(centre)))
    difference = np.maximum(across, off)
    if difference[2] <= 0.3 * difference[0] or difference[2] <= 1e-9 * size:
        return 0.0
    return float(difference[2])


def _same(a: HalfLine, b: HalfLine) -> bool:
    powers = {p for p, _ in a.terms + b.terms}
    return all(
        abs(a.coefficient(p) - b.coefficient(p))
        <= _ROUNDING * abs(a.coefficient(p)) + _ROUNDING * abs(b.coefficient(p))
        for p in powers
    )


def _size(law: _Judged, grid: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the scale of rounding of a law: the sum of its terms' magnitudes."""
    terms = [np.abs(law.compiled(term)(grid)) for term in sp.Add.make_args(law.expression.tree)]
    return np.asarray(np.sum(terms, axis=0), dtype=np.float64)


def _worst(values: NDArray[np.float64]) -> int:
    """Return where values are largest; of equals, the argument that is easiest to read comes out of the grid's order."""
    return int(np.argmax(np.where(np.isnan(values), math.inf, values)))
