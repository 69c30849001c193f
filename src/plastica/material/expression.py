"""Text -> symbolic expression -> callables with exact derivatives.

The text is untrusted: `plastica.material.reader` admits a short list of things and evaluates nothing. SymPy
is loaded when the first text is read.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from functools import lru_cache
from itertools import pairwise
from typing import TYPE_CHECKING, Any, Final

from plastica.errors import ArgumentError

if TYPE_CHECKING:
    from plastica.material.compiled import ArrayFunction, ScalarFunction

__all__ = ["FUNCTIONS", "Breakpoint", "Expression", "breakpoints", "check_name", "constant_beyond", "parse", "symbol"]

FUNCTIONS: Final = (
    "pos", "abs", "exp", "log", "sin", "cos", "tan", "tanh", "sinh", "cosh", "sqrt", "atan",
)  # fmt: skip
"""The functions of every expression; load and shape text has `step` besides."""

_MOST_LINES: Final = 64
"""Breaks within an argument up to which it is looked at line by line."""

_NAME: Final = re.compile(r"[A-Za-z][A-Za-z0-9_]{0,39}")


@dataclass(frozen=True)
class Breakpoint:
    """Where an expression jumps ("jump") or has a kink ("kink")."""

    position: float
    kind: str


@dataclass(frozen=True)
class Expression:
    """A formula in one variable and named parameters, made by `parse`.

    Attributes
    ----------
    text : str
        What the user wrote.
    variable : str or None
        The variable, or None for a constant.
    parameters : tuple of str
        The parameters that occur.
    allow_step : bool
        Whether `step` may occur.
    order : int
        How many times the text has been differentiated.
    tree : sympy.Expr
        The symbolic form.
    """

    text: str
    variable: str | None
    parameters: tuple[str, ...]
    allow_step: bool
    order: int = 0
    tree: Any = field(default=None, compare=False, repr=False)

    def derivative(self, order: int = 1) -> Expression:
        """Return the exact derivative with respect to the variable."""
        from plastica.material.functions import derive

        tree = self.tree
        for _ in range(order):
            tree = derive(tree, symbol(self.variable or ""))
        return replace(self, order=self.order + order, tree=tree)

    def scalar(
        self, values: Mapping[str, float], argument_scale: float = 1.0, value_scale: float = 1.0
    ) -> ScalarFunction:
        """Compile x -> value_scale * g(argument_scale * x) for one float, quickly, without NumPy."""
        from plastica.material.compiled import scalar_function

        return scalar_function(self.tree, self._variable(), values, argument_scale, value_scale)

    def vector(
        self, values: Mapping[str, float], argument_scale: float = 1.0, value_scale: float = 1.0
    ) -> ArrayFunction:
        """Compile x -> value_scale * g(argument_scale * x) for arrays."""
        from plastica.material.compiled import array_function

        return array_function(self.tree, self._variable(), values, argument_scale, value_scale)

    def __reduce__(self) -> tuple[Any, ...]:
        return _restored, (self.text, self.variable, self.parameters, self.allow_step, self.order)

    def _variable(self) -> Any:
        return None if self.variable is None else symbol(self.variable)


def parse(
    text: str, *, variable: str | None, parameters: Iterable[str] = (), allow_step: bool = False, where: str
) -> Expression:
    """Read an expression.

    Parameters
    ----------
    text : str
        ASCII, one line, at most 500 characters: numbers, `pi`, the variable, the parameters, + - * / **,
        parentheses and the functions in `FUNCTIONS`.
    variable : str or None
        The variable's name; None for a constant.
    parameters : iterable of str
        Names that may occur besides.
    allow_step : bool
        Whether `step(a + b*variable)` may occur: 1 where its argument is at least 0, else 0.
    where : str
        The argument or key that messages name.

    Returns
    -------
    Expression
        The symbolic expression.

    Raises
    ------
    ArgumentError
        If the text is anything else, too large, or not finite.
    """
    from plastica.material.reader import read_tree

    declared = tuple(parameters)
    for name in declared:
        check_name(name, variable=variable, where=where)
    tree, names = read_tree(text, variable, declared, allow_step, where)
    return Expression(text, variable, tuple(name for name in declared if name in names), allow_step, 0, tree)


def check_name(name: object, *, variable: str | None = None, where: str = "parameters") -> str:
    """Return a parameter's name, if it is one that no function, constant, variable or Python keyword has.

    Raises
    ------
    ArgumentError
        If it is not.
    """
    import keyword

    if not isinstance(name, str) or not _NAME.fullmatch(name):
        rule = "must have names of letters, digits and _ that begin with a letter (40 at most)"
        raise ArgumentError(rule, where=where, value=name)
    if name in (*FUNCTIONS, "step", "pi", variable) or keyword.iskeyword(name):
        rule = f"must not have a parameter named {name!r}, which has a meaning already"
        raise ArgumentError(rule, where=where, next_step="Choose another name.")
    return name


def breakpoints(
    expression: Expression, values: Mapping[str, float], interval: tuple[float, float] | None = None
) -> tuple[Breakpoint, ...]:
    """Find where an expression jumps or has a kink: at the zeros of the arguments of step, pos and abs.

    Parameters
    ----------
    expression : Expression
        The expression, in t or s.
    values : mapping of str to float
        Values of its parameters.
    interval : tuple of (float, float), optional
        Where to look for sign changes of arguments that are not linear, such as in abs(cos(3*s)), on 2001 points;
        without it these are left out, unless they are linear between breaks of their own.

    Returns
    -------
    tuple of Breakpoint
        In ascending order, one per position; a jump takes precedence over a kink. Zeros of linear arguments are
        given wherever they lie.
    """
    from plastica.material import functions as fn

    found: dict[float, str] = {}
    if expression.variable is None:
        return ()
    for node in expression.tree.atoms(fn.pos, fn.absolute, *fn.STEP_LIKE):
        for position in _zeros(node.args[0], expression.variable, values, interval):
            jumps = isinstance(node, fn.STEP_LIKE) or found.get(position) == "jump"
            found[position] = "jump" if jumps else "kink"
    return tuple(Breakpoint(position, found[position]) for position in sorted(found))


def constant_beyond(expression: Expression, values: Mapping[str, float], at: float) -> bool:
    """Tell whether an expression no longer depends on its variable beyond `at`.

    Parameters
    ----------
    expression : Expression
        The expression, in t or s.
    values : mapping of str to float
        Values of its parameters.
    at : float
        A position beyond all its linear breaks.

    Returns
    -------
    bool
        True where the formula, with every step, pos and abs of a linear argument replaced by the branch it is on,
        has no variable left in it.
    """
    from plastica.material import functions as fn

    if expression.variable is None:
        return True
    return not fn.depends(_on_branch(expression.tree, expression.variable, values, at), symbol(expression.variable))


def _on_branch(tree: Any, name: str, values: Mapping[str, float], at: float) -> Any:
    """Replace every step, pos and abs of what is linear, or linear near `at`, by the branch that it is on there."""
    from plastica.material import functions as fn
    from plastica.material.compiled import constant_value

    variable = symbol(name)

    def branch(node: Any) -> Any:
        inner = node.args[0]
        if fn.depends(fn.derive(inner, variable), variable):
            return node
        beyond = constant_value(inner, {**values, name: at}) > 0.0
        if isinstance(node, fn.absolute):
            return inner if beyond else -inner
        if isinstance(node, fn.pos):
            return inner if beyond else 0 * inner
        return (1 if beyond else -1) if isinstance(node, fn.sign) else int(beyond)

    broken = (fn.pos, fn.absolute, *fn.STEP_LIKE)
    return tree.replace(lambda node: isinstance(node, broken), branch)


def _zeros(tree: Any, name: str, values: Mapping[str, float], interval: tuple[float, float] | None) -> list[float]:
    """Return the zero of a linear tree, or the sign changes of another on an interval."""
    import numpy as np

    from plastica.material.compiled import array_function
    from plastica.material.functions import depends, derive
    from plastica.material.halfline import sign_changes

    if not depends(derive(tree, symbol(name)), symbol(name)):
        return _zero(tree, name, values)
    pieced = _zeros_of_lines(tree, name, values)
    if pieced is not None:
        return pieced
    if interval is None:
        return []
    return sorted(set(sign_changes(array_function(tree, symbol(name), values), np.linspace(*interval, 2001))))


def _zero(tree: Any, name: str, values: Mapping[str, float]) -> list[float]:
    """Return the zero of a linear tree, if it has one."""
    from plastica.material.compiled import constant_value
    from plastica.material.functions import derive

    a, b = constant_value(derive(tree, symbol(name)), values), constant_value(tree, {**values, name: 0.0})
    return [-b / a + 0.0] if a != 0.0 and math.isfinite(b / a) else []


def _zeros_of_lines(tree: Any, name: str, values: Mapping[str, float]) -> list[float] | None:
    """Return the zeros of what is linear between breaks of its own, such as 1 - abs(t - 3); None for what is not."""
    from plastica.material import functions as fn

    nodes = tree.atoms(fn.pos, fn.absolute, *fn.STEP_LIKE)
    breaks = sorted({zero for node in nodes for zero in _zeros(node.args[0], name, values, None)})
    if not breaks or len(breaks) > _MOST_LINES:
        return None
    found: list[float] = []
    wide = 1.0 + abs(breaks[0]) + abs(breaks[-1])
    for low, high in pairwise((-math.inf, *breaks, math.inf)):
        at = 0.5 * (max(low, breaks[0] - wide) + min(high, breaks[-1] + wide))
        line = _on_branch(tree, name, values, at)
        if fn.depends(fn.derive(line, symbol(name)), symbol(name)):
            return None
        found += [zero for zero in _zero(line, name, values) if low <= zero <= high]
    return found


def _restored(text: str, variable: str | None, parameters: tuple[str, ...], allow_step: bool, order: int) -> Expression:
    made = parse(text, variable=variable, parameters=parameters, allow_step=allow_step, where="expression")
    return made.derivative(order) if order else made


@lru_cache(maxsize=256)
def symbol(name: str) -> Any:
    """Return the symbol of a name, without assumptions, which would rewrite what the user wrote."""
    import sympy as sp

    return sp.Symbol(name)
