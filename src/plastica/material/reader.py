"""The reader of untrusted formulas: characters, tokens, size, and a whitelist of Python's syntax nodes.

Nothing is ever evaluated. Constants are folded in floats, exponents and sizes bounded, so that no text can
keep the program busy: SymPy's own parser would run code, and its exact arithmetic never ends on a tower of
exponents.
"""

from __future__ import annotations

import ast
import math
import operator
import re
from collections.abc import Callable
from typing import Any, Final, NoReturn, TypeGuard

import sympy as sp

from plastica.errors import ArgumentError
from plastica.material.expression import FUNCTIONS, symbol
from plastica.material.functions import CALLABLE, depends, derive

__all__ = ["read_tree"]

LONGEST_TEXT: Final = 500
MOST_NODES: Final = 400
DEEPEST: Final = 60
MOST_CALLS: Final = 6
LARGEST_EXPONENT: Final = 64
LARGEST_DERIVATIVE: Final = 2000
_LARGEST_INTEGER: Final = 2**53

_TOKEN: Final = re.compile(
    r"\s*(?:(?P<number>(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)(?![A-Za-z_0-9.])|(?P<name>[A-Za-z]\w*)"
    r"|(?P<operator>\*\*|[-+*/(),]))",
    re.ASCII,
)
_POINTED: Final = {
    "^": "must write powers as **, not ^",
    "=": "must be one expression, without = or comparisons",
    "<": "must be free of comparisons",
    ">": "must be free of comparisons",
    ":": "must be free of ':'",
    "[": "must be free of brackets other than ( )",
    "{": "must be free of brackets other than ( )",
    "#": "must be free of comments",
    "'": "must be free of quotation marks",
    '"': "must be free of quotation marks",
    ".": "must be free of attributes (a dot stands only inside numbers)",
    "_": "must have names that begin with a letter",
    "%": "must use only + - * / ** and the listed functions",
    "@": "must use only + - * / ** and the listed functions",
    "|": "must use only + - * / ** and the listed functions",
    "&": "must use only + - * / ** and the listed functions",
    "~": "must use only + - * / ** and the listed functions",
}
_NOT_FINITE: Final = (sp.nan, sp.zoo, sp.oo, -sp.oo, sp.I)
_OPERATIONS: Final[dict[type[ast.operator], Callable[[Any, Any], Any]]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
}
_OF_NUMBERS: Final[dict[str, Callable[[float], float]]] = {
    **{name: getattr(math, name) for name in FUNCTIONS if hasattr(math, name)},
    "pos": lambda x: max(x, 0.0),
    "abs": abs,
    "step": lambda x: float(x >= 0.0),
}


def read_tree(
    text: object, variable: str | None, parameters: tuple[str, ...], allow_step: bool, where: str
) -> tuple[Any, frozenset[str]]:
    """Read a formula.

    Parameters
    ----------
    text, variable, parameters, allow_step, where
        As in `plastica.material.expression.parse`.

    Returns
    -------
    tuple of (sympy.Expr, frozenset of str)
        The tree, and the names that occur in it.

    Raises
    ------
    ArgumentError
        If the text is not a formula of the allowed kind and size.
    """
    node = _syntax(text, where)
    if _derivative_sizes(node, variable)[2] > LARGEST_DERIVATIVE:
        rule = "must be simple enough to be differentiated twice"
        raise ArgumentError(rule, where=where, value=text, next_step="Nest and multiply fewer functions.")
    reader = _Reader(str(text), variable, parameters, allow_step, where)
    tree = _symbolic(reader.checked(reader.read(node)))
    return tree, frozenset(reader.used)


def _derivative_sizes(node: ast.AST, variable: str | None) -> tuple[int, int, int]:
    """Estimate the sizes of a formula and of its first two derivatives, before anything is formed."""
    if isinstance(node, ast.Call):
        inner = node.args
    else:
        inner = [child for child in ast.iter_child_nodes(node) if isinstance(child, ast.expr)]
    if not inner:
        return 1, int(isinstance(node, ast.Name) and node.id == variable), 0
    parts = [_derivative_sizes(part, variable) for part in inner]
    if isinstance(node, ast.BinOp) and isinstance(node.op, (ast.Add, ast.Sub)):
        (a0, a1, a2), (b0, b1, b2) = parts
        return a0 + b0, a1 + b1, a2 + b2
    a0, a1, a2 = parts[0]
    for b0, b1, b2 in parts[1:]:
        ab, ba = (a0 + b1 if b1 else 0), (a1 + b0 if a1 else 0)
        twice = 2 * (a1 + b1) if a1 and b1 else 0
        a0, a1, a2 = a0 + b0, ab + ba, (a2 + b0 if a2 else 0) + twice + (a0 + b2 if b2 else 0)
    if isinstance(node, ast.UnaryOp) or (isinstance(node, ast.BinOp) and isinstance(node.op, (ast.Mult, ast.Div))):
        return a0, a1, a2
    return 1 + a0, (1 + a0 + a1 if a1 else 0), (2 * (1 + a0 + a1) + a2 if a1 else 0)


def _syntax(text: object, where: str) -> ast.expr:
    """Check the characters, the tokens and the size, and only then let Python's grammar read the text."""
    if not isinstance(text, str):
        raise ArgumentError("must be text, such as 'k*m**2/2'", where=where, value=text)
    if len(text) > LONGEST_TEXT:
        raise ArgumentError(f"must be at most {LONGEST_TEXT} characters long", where=where, value=text)
    if not text.strip() or not text.isascii() or not text.isprintable():
        rule = "must be an expression in one line of ASCII characters"
        raise ArgumentError(rule, where=where, value=text)
    position, stripped = 0, text.strip()
    while position < len(stripped):
        token = _TOKEN.match(stripped, position)
        if token is None:
            _refuse_token(stripped[position:].lstrip(), where, text)
        position = token.end()
    try:
        node = ast.parse(stripped, mode="eval").body
    except (SyntaxError, RecursionError, MemoryError, ValueError):
        rule, look = "must be a complete expression", "Look for a missing operator, operand or parenthesis."
        raise ArgumentError(rule, where=where, value=text, next_step=look) from None
    _check_size(node, where, text)
    return node


def _refuse_token(rest: str, where: str, text: str) -> NoReturn:
    if rest[0].isdigit() or (rest[0] == "." and rest[1:2].isdigit()):
        word = re.split(r"[^\w.]", rest)[0]
        rule = f"must hold plain decimal numbers, and a * between factors, unlike {word}"
    else:
        rule = _POINTED.get(rest[0], f"must be free of {rest[0]!r}")
    raise ArgumentError(rule, where=where, value=text)


def _check_size(root: ast.expr, where: str, text: str) -> None:
    """Refuse what is too large or too deep, functions within functions above all: SymPy's time grows with them."""
    level: list[tuple[ast.AST, int]] = [(root, 0)]
    nodes = calls = 0
    for _ in range(DEEPEST):
        below = [
            (node, n + isinstance(parent, ast.Call)) for parent, n in level for node in ast.iter_child_nodes(parent)
        ]
        level = [(node, n) for node, n in below if isinstance(node, ast.expr)]
        nodes += len(level)
        calls = max((n for _, n in level), default=calls)
        if not level:
            break
    if level or nodes > MOST_NODES or calls > MOST_CALLS:
        rule = f"must have at most {MOST_NODES} parts, nested at most {DEEPEST} deep, functions {MOST_CALLS} deep"
        raise ArgumentError(rule, where=where, value=text, next_step="Write it more simply.")


class _Reader:
    """Turns checked syntax into a tree; numbers stay Python numbers until they meet a symbol."""

    def __init__(
        self, text: str, variable: str | None, parameters: tuple[str, ...], allow_step: bool, where: str
    ) -> None:
        self.text, self.variable, self.parameters = text, variable, parameters
        self.allow_step, self.where = allow_step, where
        self.used: set[str] = set()

    def refuse(self, rule: str, next_step: str = "") -> NoReturn:
        raise ArgumentError(rule, where=self.where, value=self.text, next_step=next_step)

    def read(self, node: ast.expr) -> Any:
        if isinstance(node, ast.Constant):
            return self.number(node.value)
        if isinstance(node, ast.Name):
            return self.name(node.id)
        if isinstance(node, ast.UnaryOp) and isinstance(node.op, (ast.USub, ast.UAdd)):
            operand = self.read(node.operand)
            return -operand if isinstance(node.op, ast.USub) else operand
        if isinstance(node, ast.BinOp):
            return self.operation(node)
        if isinstance(node, ast.Call):
            return self.call(node)
        return self.refuse("must use only numbers, names, + - * / **, parentheses and the listed functions")

    def number(self, value: object) -> Any:
        if isinstance(value, bool) or not isinstance(value, (int, float)):
            self.refuse(f"must be free of {value!r}")
        return self.folded(value)

    def name(self, name: str) -> Any:
        if name == "pi":
            return math.pi
        if name == self.variable or name in self.parameters:
            self.used.add(name)
            return symbol(name)
        if name in FUNCTIONS or name == "step":
            self.refuse(f"must give the function {name} its argument in parentheses")
        known = ", ".join([*([self.variable] if self.variable else []), *self.parameters, "pi"])
        return self.refuse(f"must use known names, which {name!r} is not", f"Known here: {known}.")

    def operation(self, node: ast.BinOp) -> Any:
        left, right = self.read(node.left), self.read(node.right)
        if isinstance(node.op, ast.Pow):
            return self.power(left, right)
        if isinstance(node.op, ast.Div) and _is_number(right) and right == 0:
            self.refuse("must not divide by 0")
        combine = _OPERATIONS.get(type(node.op))
        if combine is None:
            self.refuse("must use only + - * / ** between its parts")
        return self.folded(combine(left, right))

    def power(self, base: Any, exponent: Any) -> Any:
        """Read a power, with a bounded exponent and no complex value of a constant."""
        if _is_number(exponent) and abs(exponent) > LARGEST_EXPONENT and not _is_number(base):
            self.refuse(f"must have exponents of at most {LARGEST_EXPONENT}")
        if _is_number(base) and _is_number(exponent):
            if isinstance(base, int) and isinstance(exponent, int) and 0 <= exponent <= LARGEST_EXPONENT:
                return self.folded(base**exponent)
            return self.folded(self.attempt(math.pow, base, exponent))
        if _is_number(base) and base <= 0:
            self.refuse("must not raise 0 or a negative number to a varying power")
        return self.checked(sp.Pow(_symbolic(base), _exact_exponent(exponent)))

    def call(self, node: ast.Call) -> Any:
        name = node.func.id if isinstance(node.func, ast.Name) else ""
        if name == "step" and not self.allow_step:
            self.refuse("must be free of step(), which belongs in load and shape text")
        if name not in CALLABLE:
            listed = ", ".join(FUNCTIONS + (("step",) if self.allow_step else ()))
            what = f", which {name!r} is not" if name else ""
            self.refuse(f"must call only listed functions{what}", f"Listed: {listed}.")
        if len(node.args) != 1 or node.keywords or isinstance(node.args[0], ast.Starred):
            self.refuse(f"must give {name} exactly one argument")
        argument = self.read(node.args[0])
        if _is_number(argument):
            return self.folded(self.attempt(_OF_NUMBERS[name], argument))
        variable = symbol(self.variable or "")
        if name == "step" and depends(derive(argument, variable), variable):
            self.refuse(f"must have arguments of step that are linear in {self.variable}")
        return self.folded(CALLABLE[name](argument))

    def attempt(self, operation: Callable[..., Any], *numbers: float) -> Any:
        try:
            return operation(*map(float, numbers))
        except (OverflowError, ValueError, ZeroDivisionError):
            return math.nan

    def folded(self, value: Any) -> Any:
        """Keep small integers as they are, make every other constant a finite float, leave trees alone."""
        if isinstance(value, sp.Integer):
            value = int(value)
        if isinstance(value, sp.Basic) and not value.is_Number and value not in _NOT_FINITE:
            return value
        if isinstance(value, int) and abs(value) <= _LARGEST_INTEGER:
            return value
        number = self.attempt(float, value) if not isinstance(value, sp.Basic) else _as_float(value)
        if not math.isfinite(number):
            self.refuse("must have finite constant parts", "Look for logarithms, roots and poles.")
        return number

    def checked(self, tree: Any) -> Any:
        """Return a tree, if its numbers are finite and its exponents bounded."""
        value = self.folded(tree)
        if _is_number(value):
            return value
        if tree.has(*_NOT_FINITE) or not all(math.isfinite(_as_float(n)) for n in tree.atoms(sp.Number)):
            self.refuse("must have finite real constants throughout")
        for power in tree.atoms(sp.Pow):
            if power.exp.is_Number and abs(power.exp) > LARGEST_EXPONENT:
                self.refuse(f"must have exponents of at most {LARGEST_EXPONENT}")
        return value


def _is_number(value: object) -> TypeGuard[int | float]:
    return isinstance(value, (int, float))


def _as_float(number: Any) -> float:
    try:
        return float(number)
    except (OverflowError, TypeError, ValueError):
        return math.nan


def _symbolic(value: Any) -> Any:
    if isinstance(value, int):
        return sp.Integer(value)
    return sp.Float(value) if isinstance(value, float) else value


def _exact_exponent(exponent: Any) -> Any:
    """Make whole and half exponents exact, so that they are compiled to products and roots."""
    if _is_number(exponent) and 2 * exponent == int(2 * exponent):
        return sp.Rational(int(2 * exponent), 2)
    return _symbolic(exponent)
