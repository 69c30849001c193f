"""One law under examination: what can be read off its formula, where to look at it, and where it may be rough."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, Final

import numpy as np
import sympy as sp

from plastica.material import functions as fn
from plastica.material.compiled import ArrayFunction, array_function, constant_value
from plastica.material.expression import Expression, symbol
from plastica.material.halfline import HalfLine, half_line, sign_changes, touching

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = ["DEFAULT_BOUND", "Examined", "is_smooth", "jump_at", "magnitude", "positive_zero"]

DEFAULT_BOUND: Final = 100.0
"""The range of a numerical judgement, in units of the law's own scale, where no a-priori bound is given."""

_PER_DECADE: Final = 40
_DECADES: Final = 12
_LARGEST_ARGUMENT: Final = 200.0


@dataclass(frozen=True)
class Examined:
    """One law under judgement."""

    name: str
    expression: Expression
    values: Mapping[str, float]
    bound: float | None
    scale: float = 1.0

    @property
    def letter(self) -> str:
        """The variable's name."""
        return str(self.expression.variable)

    @property
    def title(self) -> str:
        """The law's name in sentences."""
        return {"preference": "preference energy", "flow": "flow law"}.get(self.name, self.name)

    @cached_property
    def sides(self) -> tuple[HalfLine, HalfLine] | None:
        """The law as sums of powers: for negative and for positive arguments."""
        both = [half_line(self.expression.tree, symbol(self.letter), self.values, side) for side in (-1, 1)]
        return None if both[0] is None or both[1] is None else (both[0], both[1])

    def part(self, order: int) -> ArrayFunction:
        """Return the law (order 0) or a derivative, for arrays."""
        return self.compiled(self.expression.derivative(order).tree)

    def compiled(self, tree: Any) -> ArrayFunction:
        """Return a tree in the same variable and parameters, for arrays."""
        return array_function(tree, symbol(self.letter), self.values)

    @cached_property
    def grid(self) -> NDArray[np.float64]:
        """Points of both signs, close together near 0 and even further out, where no part overflows."""
        end = self.bound or DEFAULT_BOUND * self.scale
        ladder = end * np.logspace(-_DECADES, 0, _DECADES * _PER_DECADE + 1)
        right = np.unique(np.concatenate([ladder, np.linspace(0.0, end, 1001)[1:], [1.0] if end >= 1 else []]))
        grid = np.concatenate([-right[::-1], [0.0], right])
        usable = np.ones(grid.shape, dtype=bool)
        for node in self.expression.tree.atoms(sp.exp, sp.sinh, sp.cosh):
            argument = self.compiled(node.args[0])(grid)
            usable &= ~((argument if isinstance(node, sp.exp) else np.abs(argument)) > _LARGEST_ARGUMENT)
        enough = min(np.count_nonzero(usable[grid < 0.0]), np.count_nonzero(usable[grid > 0.0])) > _PER_DECADE
        return grid[usable | (grid == 0.0)] if enough else grid

    @property
    def range_words(self) -> str:
        """How a numerical judgement was made."""
        return f"numerically, at {self.grid.size} points of |{self.letter}| <= {np.max(np.abs(self.grid)):.4g}"

    def size(self, grid: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return the scale of rounding: the sum of the terms' magnitudes."""
        return self.compiled(magnitude(self.expression.tree))(grid)

    def suspects(self) -> list[float]:
        """Return where the formula may fail to be smooth: kinks, jumps, poles, roots and logarithms of 0."""
        variable, found = symbol(self.letter), {0.0}
        for node in self.expression.tree.atoms(sp.Function, sp.Pow):
            inner = node.args[0]
            if not fn.depends(inner, variable) or is_smooth(node, self.values, variable):
                continue
            function = self.compiled(sp.cos(inner) if isinstance(node, sp.tan) else inner)
            found.update(z + 0.0 for z in sign_changes(function, self.grid) + touching(function, self.grid))
        return sorted(found, key=abs)


def positive_zero(expression: Expression, values: Mapping[str, float], scale: float = 1.0) -> float | None:
    """Return the least positive zero of a preference energy, where it touches 0; None if there is none."""
    law = Examined("preference", expression, values, None, scale)
    grid = law.grid[law.grid > 0.0]
    right = law.sides[1] if law.sides is not None else None
    if right is not None and right.is_polynomial:
        grid = np.sort(np.concatenate([grid, *(u * np.array([0.99, 1.01]) for u in right.critical())]))
    for zero in sorted(sign_changes(law.part(1), grid)):
        below = float(np.max(np.abs(law.part(0)(grid[grid <= zero])), initial=0.0))
        if below > 0.0 and abs(float(law.part(0)(zero))) <= 1e-12 * below:
            return zero
    return None


def magnitude(tree: Any) -> Any:
    """Replace every sum by the sum of its terms' magnitudes."""
    if tree.is_Add or tree.is_Mul:
        return tree.func(*map(magnitude, tree.args))
    if tree.is_Pow and tree.args[1].is_Integer and tree.args[1] > 0:
        return magnitude(tree.args[0]) ** tree.args[1]
    return abs(tree) if tree.is_Number else fn.absolute(tree)


def is_smooth(node: Any, values: Mapping[str, float], variable: Any) -> bool:
    """Tell whether a function or power is smooth in its argument, whatever that is."""
    if isinstance(node, sp.Pow):
        exponent = node.args[1]
        number = math.nan if fn.depends(exponent, variable) else constant_value(exponent, values)
        return number >= 0.0 and number == math.floor(number)
    return isinstance(node, (sp.exp, sp.sin, sp.cos, sp.tanh, sp.sinh, sp.cosh, sp.atan))


def jump_at(function: ArrayFunction, z: float, end: float) -> float:
    """Return by how much a function jumps at a point, 0 if differences shrink near it."""
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
