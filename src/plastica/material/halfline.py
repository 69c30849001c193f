"""Laws as sums of powers on either side of 0, and numerical zeros: the tools that judge hypotheses.

On v > 0 and on v < 0, a law made of powers, `pos(c*v)` and `abs(c*v)` is a sum of powers of u = |v|. From that
sum most hypotheses can be read off for all v. Coefficients carry the magnitude of what was added to make them, so
that those which cancel up to rounding count as 0.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any, Final, TypeAlias

import numpy as np

from plastica.material import functions as fn
from plastica.material.compiled import ArrayFunction, constant_value

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

__all__ = ["HalfLine", "bisect", "deepest", "half_line", "sign_changes", "touching"]

_ROUNDING: Final = 64 * float(np.finfo(float).eps)
_HIGHEST_DEGREE: Final = 64.0
_Terms: TypeAlias = dict[float, tuple[float, float]]


@dataclass(frozen=True)
class HalfLine:
    """A sum of c*u**p over (p, c), u > 0, in ascending p; coefficients that are rounding are left out."""

    terms: tuple[tuple[float, float], ...]

    @property
    def is_polynomial(self) -> bool:
        """Whether all powers are whole and not negative."""
        return all(p >= 0.0 and p == math.floor(p) for p, _ in self.terms)

    def coefficient(self, power: float) -> float:
        """Return the coefficient of a power."""
        return dict(self.terms).get(power, 0.0)

    def value(self, u: float) -> float:
        """Evaluate the sum."""
        with np.errstate(all="ignore"):
            return float(np.sum(self._at(u)))

    def size(self, u: float) -> float:
        """Return the sum of the terms' magnitudes: the scale of rounding in `value`."""
        return float(np.sum(np.abs(self._at(u))))

    def _at(self, u: float) -> NDArray[np.float64]:
        with np.errstate(all="ignore"):
            return np.array([c * np.float64(u) ** p for p, c in self.terms], dtype=np.float64)

    def least(self) -> tuple[float, float] | None:
        """Return (u, value) where the sum is least on u >= 0, a value within rounding of 0 being 0.

        Returns
        -------
        tuple of (float, float) or None
            (inf, -inf) if it is not bounded below; None if it is not a polynomial and signs do not decide.
        """
        if all(c >= 0.0 and p >= 0.0 for p, c in self.terms):
            return 0.0, self.coefficient(0.0)
        if self.terms[-1][1] < 0.0 < self.terms[-1][0]:
            return math.inf, -math.inf
        if not self.is_polynomial:
            return None
        points = [0.0, *self.critical()]
        values = [v if abs(v := self.value(u)) > _ROUNDING * self.size(u) else 0.0 for u in points]
        best = int(np.argmin(values))
        return points[best], values[best]

    def without_lowest_power(self) -> HalfLine:
        """Return the sum divided by its lowest power of u: of the same sign for u > 0."""
        lowest = self.terms[0][0]
        return HalfLine(tuple((p - lowest, c) for p, c in self.terms))

    def critical(self) -> list[float]:
        """Return the positive points where the derivative of a polynomial vanishes, or nearly does."""
        slope = np.zeros(int(self.terms[-1][0]) if self.terms else 0)
        for p, c in self.terms:
            if p > 0.0:
                slope[int(p) - 1] = p * c
        roots = np.roots(slope[::-1])
        # a double root comes out as a pair that is complex by the root of the rounding
        near = (np.abs(roots.imag) <= 1e-4 * np.abs(roots)) & (roots.real > 0.0)
        return sorted(map(float, roots[near].real))


def half_line(tree: Any, variable: Any, values: Mapping[str, float], side: int) -> HalfLine | None:
    """Write a tree as a sum of powers of u = |v| on one side of 0.

    Parameters
    ----------
    tree, variable : sympy.Expr, sympy.Symbol
        The law and its variable v.
    values : mapping of str to float
        Its parameters.
    side : int
        1 for v > 0, -1 for v < 0.

    Returns
    -------
    HalfLine or None
        None if the tree is not of that kind.
    """
    terms = _terms(tree, variable, values, float(side))
    if terms is None or not all(math.isfinite(c) for c, _ in terms.values()):
        return None
    return HalfLine(tuple((p, c) for p, (c, size) in sorted(terms.items()) if abs(c) > _ROUNDING * size))


def _terms(tree: Any, variable: Any, values: Mapping[str, float], side: float) -> _Terms | None:
    if tree.is_Symbol or not fn.depends(tree, variable):
        number = side if tree == variable else constant_value(tree, values)
        return {float(tree == variable): (number, abs(number))}
    if not (tree.is_Add or tree.is_Mul or tree.is_Pow or isinstance(tree, _PIECEWISE)):
        return None
    if tree.is_Pow:
        base = _terms(tree.args[0], variable, values, side)
        return None if fn.depends(tree.args[1], variable) else _power(base, constant_value(tree.args[1], values))
    parts = [_terms(part, variable, values, side) for part in tree.args]
    known = [part for part in parts if part is not None]
    if len(known) < len(parts):
        return None
    combine = _sum if tree.is_Add else _product if tree.is_Mul else partial(_piecewise, tree)
    return combine(known)


_PIECEWISE: Final = (fn.pos, fn.absolute, *fn.STEP_LIKE)


def _sum(parts: list[_Terms]) -> _Terms | None:
    result: _Terms = {}
    for part in parts:
        for p, (c, size) in part.items():
            old = result.get(p, (0.0, 0.0))
            result[p] = (old[0] + c, old[1] + size)
    return result


def _product(parts: list[_Terms]) -> _Terms | None:
    result: _Terms = {0.0: (1.0, 1.0)}
    for part in parts:
        products = [{p + q: (c * d, size * other)} for p, (c, size) in result.items() for q, (d, other) in part.items()]
        result = _sum(products) or {}
        if max(result, default=0.0) > _HIGHEST_DEGREE:
            return None
    return result


def _power(base: _Terms | None, exponent: float) -> _Terms | None:
    if base is None:
        return None
    if 0.0 <= exponent <= _HIGHEST_DEGREE and exponent == math.floor(exponent):
        return _product([base] * int(exponent))
    if len(base) == 1:
        ((p, (c, _)),) = base.items()
        if c > 0.0 or (c < 0.0 and exponent == math.floor(exponent)):
            with np.errstate(all="ignore"):
                value = float(np.power(np.float64(c), exponent))
            return {p * exponent: (value, abs(value))}
    return None


def _piecewise(tree: Any, arguments: list[_Terms]) -> _Terms | None:
    """Resolve a piecewise function whose argument keeps one sign on the half line."""
    (argument,) = arguments
    signs = {math.copysign(1.0, c) for c, _ in argument.values() if c != 0.0}
    if len(signs) > 1:
        return None
    positive, zero = signs == {1.0}, not signs
    if isinstance(tree, fn.pos):
        return argument if positive else {}
    if isinstance(tree, fn.absolute):
        return {p: (abs(c), size) for p, (c, size) in argument.items()}
    if isinstance(tree, fn.sign):
        return {} if zero else {0.0: (1.0 if positive else -1.0, 1.0)}
    on = positive or (zero and isinstance(tree, fn.step))
    return {0.0: (1.0, 1.0)} if on else {}


def sign_changes(function: ArrayFunction, grid: NDArray[np.float64]) -> list[float]:
    """Find the zeros of a function at which it changes sign or that lie on the grid, by bisection to the last bit."""
    values = function(grid)
    found = [float(x) for x in grid[values == 0.0]]
    with np.errstate(invalid="ignore"):
        changes = np.flatnonzero(np.sign(values[:-1]) * np.sign(values[1:]) < 0.0)
    found += [bisect(function, float(grid[i]), float(grid[i + 1])) for i in changes[:200]]
    return found


def bisect(function: ArrayFunction, low: float, high: float) -> float:
    """Halve an interval with a sign change until a zero is hit or the ends are neighbours."""
    sign_low = math.copysign(1.0, float(function(low)))
    for _ in range(200):
        middle = 0.5 * (low + high)
        if middle in (low, high):
            break
        value = float(function(middle))
        if value == 0.0:
            return middle
        if math.copysign(1.0, value) == sign_low:
            low = middle
        else:
            high = middle
    return low if abs(float(function(low))) <= abs(float(function(high))) else high


def touching(function: ArrayFunction, grid: NDArray[np.float64]) -> list[float]:
    """Find zeros where a function touches 0 without changing sign: minima of |function| that reach 0."""

    def size(x: ArrayLike) -> NDArray[np.float64]:
        return np.abs(function(x))

    scale = size(grid)
    found = []
    for x in deepest(size, grid):
        i = int(np.searchsorted(grid, x))
        near = scale[max(i - 2, 0) : i + 2]
        if float(np.max(near)) > 0.0 and float(size(x)) <= 1e-12 * float(np.max(near)):
            found.append(x)
    return found


def deepest(function: ArrayFunction, grid: NDArray[np.float64], most: int = 16) -> list[float]:
    """Refine the lowest local minima of a function between the points of a grid, by nested sampling."""
    values = np.where(np.isnan(v := function(grid)), math.inf, v)
    inside = np.flatnonzero((values[1:-1] <= values[:-2]) & (values[1:-1] < values[2:]))
    lowest = inside[np.argsort(values[inside + 1], kind="stable")][:most]
    found = []
    for i in lowest:
        around = np.linspace(grid[i], grid[i + 2], 33)
        for _ in range(12):
            best = int(np.clip(np.argmin(function(around)), 1, 31))
            around = np.linspace(around[best - 1], around[best + 1], 33)
        found.append(float(around[int(np.argmin(function(around)))]))
    return found
