"""Symbolic trees -> Python functions, on floats (`math`) or on arrays (NumPy).

The function is built as a syntax tree and compiled; no text is involved. Common parts are computed once,
integer powers are products (so that the two kinds agree bitwise on polynomials and never raise), and a float
function whose operations raise falls back on the array one, which answers inf or nan.
"""

from __future__ import annotations

import ast
import math
from collections.abc import Callable, Mapping, Sequence
from functools import cache
from types import FunctionType
from typing import TYPE_CHECKING, Any, Final, TypeAlias, cast

import numpy as np
import sympy as sp

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

__all__ = [
    "ArrayFunction",
    "ScalarFunction",
    "array_function",
    "compiled_body",
    "constant_value",
    "scalar_function",
    "statements_with",
]

ScalarFunction: TypeAlias = Callable[[float], float]
ArrayFunction: TypeAlias = "Callable[[ArrayLike], NDArray[np.float64]]"

_Part: TypeAlias = "ast.expr | float"

_PIECEWISE: Final = ("pos", "above", "step", "absolute", "sign")
_SMOOTH: Final = ("exp", "log", "sin", "cos", "tan", "tanh", "sinh", "cosh", "sqrt", "atan")
_SCALAR: Final[dict[str, Any]] = {**{name: getattr(math, name) for name in _SMOOTH}, "power": math.pow}
_ARRAY: Final[dict[str, Any]] = {
    **{name: getattr(np, name) for name in _SMOOTH if name != "atan"},
    "atan": np.arctan,
    "power": np.power,
    "pos": lambda x: np.maximum(x, 0.0),
    "above": lambda x: np.heaviside(x, 0.0),
    "step": lambda x: np.heaviside(x, 1.0),
    "absolute": np.abs,
    "sign": np.sign,
}
_LONGEST_CHAIN: Final = 40
_RAISED: Final = (OverflowError, ValueError, ZeroDivisionError)


def array_function(
    tree: Any,
    variable: Any,
    values: Mapping[str, float],
    argument_scale: float = 1.0,
    value_scale: float = 1.0,
) -> ArrayFunction:
    """Compile x -> value_scale * tree(argument_scale * x) for arrays.

    Parameters
    ----------
    tree, variable : sympy.Expr, sympy.Symbol or None
        The tree, and its variable.
    values : mapping of str to float
        The value of every other symbol.
    argument_scale, value_scale : float
        Factors of the argument and of the value.

    Returns
    -------
    callable
        Array in, array of floats of the same shape out; inf and nan instead of warnings.
    """
    writer = _Writer(variable, values, scalar=False)
    made = writer.function(tree, argument_scale, value_scale)
    if isinstance(made, float):
        return lambda x: np.full(np.shape(x), made)

    def evaluate(x: ArrayLike) -> NDArray[np.float64]:
        with np.errstate(all="ignore"):
            return cast("NDArray[np.float64]", made(np.asarray(x, dtype=np.float64)))

    return evaluate


def scalar_function(
    tree: Any,
    variable: Any,
    values: Mapping[str, float],
    argument_scale: float = 1.0,
    value_scale: float = 1.0,
) -> ScalarFunction:
    """Compile x -> value_scale * tree(argument_scale * x) for one float, without NumPy.

    Parameters
    ----------
    tree, variable, values, argument_scale, value_scale
        As in `array_function`.

    Returns
    -------
    callable
        Float in, float out; inf or nan where `math` would raise.
    """
    writer = _Writer(variable, values, scalar=True)
    slow = cache(lambda: array_function(tree, variable, values, argument_scale, value_scale))
    made = writer.function(tree, argument_scale, value_scale, otherwise=lambda x: float(slow()(x)))
    if isinstance(made, float):
        return lambda _x: made
    return made


def constant_value(tree: Any, values: Mapping[str, float]) -> float:
    """Evaluate a tree without a variable in floats; nan or inf where it has no finite value."""
    part = _Writer(None, values, scalar=False).part(tree)
    return cast("float", part)


def statements_with(
    tree: Any,
    variable: Any,
    values: Mapping[str, float],
    arguments: Mapping[Any, str],
    argument_scale: float = 1.0,
    value_scale: float = 1.0,
) -> list[ast.stmt] | float:
    """Write (x, *arguments) -> value_scale * tree(argument_scale * x) as the body of a function.

    Parameters
    ----------
    tree, variable, values
        As in `array_function`.
    arguments : mapping of sympy.Symbol to str
        Symbols that are arguments besides the variable, in order, and their names there.
    argument_scale, value_scale : float
        Factors of the argument and of the value.

    Returns
    -------
    list of ast.stmt or float
        Assignments of sums, products, quotients and calls, and a return; a float where the tree depends on no argument.
        What is called has the names of `plastica.material.functions`, and "power".
    """
    writer = _Writer(variable, values, scalar=False, arguments=arguments)
    return writer.statements(tree, argument_scale, value_scale)


class _Writer:
    """Writes a symbolic tree as statements `t1 = ...; t2 = ...; return ...`, folding what is constant."""

    def __init__(
        self, variable: Any, values: Mapping[str, float], *, scalar: bool, arguments: Mapping[Any, str] | None = None
    ) -> None:
        self.variable, self.values, self.scalar = variable, values, scalar
        self.body: list[ast.stmt] = []
        self.known: dict[Any, _Part] = {each: ast.Name(name, ast.Load()) for each, name in (arguments or {}).items()}
        self.may_raise = False

    def statements(self, tree: Any, argument_scale: float, value_scale: float) -> list[ast.stmt] | float:
        """Write value_scale * tree(argument_scale * x) as the body of a function; a float where it is one."""
        if self.variable is not None:
            self.known[self.variable] = self.kept(self.times(argument_scale, ast.Name("x", ast.Load())))
        result = self.times(value_scale, self.part(tree))
        return result if isinstance(result, float) else [*self.body, ast.Return(result)]

    def function(
        self, tree: Any, argument_scale: float, value_scale: float, otherwise: ScalarFunction | None = None
    ) -> Callable[..., Any] | float:
        """Compile value_scale * tree(argument_scale * x); a float where it is constant."""
        body = self.statements(tree, argument_scale, value_scale)
        if isinstance(body, float):
            return body
        if self.may_raise and otherwise is not None:
            body = [_guarded(body)]
        return compiled_body(body, {**(_SCALAR if self.scalar else _ARRAY), "otherwise": otherwise, "raised": _RAISED})

    def part(self, tree: Any) -> _Part:
        """Write one node, once."""
        if tree not in self.known:
            self.known[tree] = self.fresh(tree)
        return self.known[tree]

    def fresh(self, tree: Any) -> _Part:
        if tree.is_Symbol:
            return float(self.values[tree.name])
        if tree.is_number and not tree.args:
            return float(tree)
        if tree.is_Add:
            return self.kept(self.total([self.part(a) for a in tree.args]))
        if tree.is_Mul:
            return self.kept(self.product(tree))
        if tree.is_Pow:
            base, exponent = tree.args
            return self.kept(self.power(self.part(base), self.part(exponent)))
        return self.kept(self.call(tree.func.__name__, self.part(tree.args[0])))

    def kept(self, part: _Part) -> _Part:
        """Give a part a local name, for it may be used again."""
        return part if isinstance(part, (float, ast.Name)) else self.local(part)

    def local(self, expression: ast.expr) -> ast.Name:
        name = f"t{len(self.body)}"
        self.body.append(ast.Assign([ast.Name(name, ast.Store())], expression))
        return ast.Name(name, ast.Load())

    def total(self, parts: list[_Part]) -> _Part:
        constant = sum(p for p in parts if isinstance(p, float))
        rest = [p for p in parts if not isinstance(p, float)]
        if not rest:
            return float(constant)
        result = rest[0]
        for i, term in enumerate(rest[1:], 1):
            # long sums in pieces: the compiler recurses into its operands
            result = ast.BinOp(self.local(result) if i % _LONGEST_CHAIN == 0 else result, ast.Add(), term)
        return ast.BinOp(result, ast.Add(), ast.Constant(constant)) if constant != 0.0 else result

    def product(self, tree: Any) -> _Part:
        """Write a product as numerator / denominator, its constants gathered in front."""
        constant, above, below = 1.0, cast("_Part", 1.0), cast("_Part", 1.0)
        for i, factor in enumerate(tree.args, 1):
            base, exponent = factor.args if factor.is_Pow else (factor, sp.S.One)
            divides = exponent.is_number and float(exponent) < 0
            part = self.power(self.part(base), -float(exponent)) if divides else self.part(factor)
            if isinstance(part, float):
                constant = cast("float", self.ratio(constant, part) if divides else self.times(constant, part))
            elif divides:
                below = self.times(below, part)
            else:
                above = self.times(self.kept(above) if i % _LONGEST_CHAIN == 0 else above, part)
        return self.times(constant, self.ratio(above, below))

    def times(self, a: _Part, b: _Part) -> _Part:
        if isinstance(a, float) and isinstance(b, float):
            return a * b
        if isinstance(b, float):
            a, b = b, a
        if isinstance(a, float):
            return b if a == 1.0 else ast.BinOp(ast.Constant(a), ast.Mult(), _node(b))
        return ast.BinOp(a, ast.Mult(), _node(b))

    def ratio(self, a: _Part, b: _Part) -> _Part:
        if isinstance(b, float):
            if isinstance(a, float):
                return _folded(np.divide, a, b)
            return a if b == 1.0 else self.times(a, _folded(np.divide, 1.0, b))
        self.may_raise = True
        return ast.BinOp(_node(a), ast.Div(), b)

    def power(self, base: _Part, exponent: _Part) -> _Part:
        if isinstance(base, float) and isinstance(exponent, float):
            return _folded(np.power, base, exponent)
        if isinstance(exponent, float):
            whole, half = divmod(2.0 * abs(exponent), 2.0)
            if half in (0.0, 1.0) and whole <= 64:
                chain = self.repeated(base, int(whole))
                result = self.times(chain, self.kept(self.call("sqrt", base))) if half else chain
                return self.ratio(1.0, result) if exponent < 0 else result
        self.may_raise = True
        return _call("power", _node(base), _node(exponent))

    def repeated(self, base: _Part, n: int) -> _Part:
        """Write base**n by repeated squaring."""
        result: _Part = 1.0
        while n:
            if n & 1:
                result = self.kept(self.times(result, base))
            n >>= 1
            if n:
                base = self.kept(self.times(base, base))
        return result

    def call(self, name: str, argument: _Part) -> _Part:
        if isinstance(argument, float):
            return _folded(_ARRAY[name], argument)
        if self.scalar and name in _PIECEWISE:
            return _piecewise(name, self.kept(argument))
        self.may_raise = True
        return _call(name, argument)


def _node(part: _Part) -> ast.expr:
    return ast.Constant(part) if isinstance(part, float) else part


def _call(name: str, *arguments: ast.expr) -> ast.expr:
    return ast.Call(ast.Name(name, ast.Load()), list(arguments), [])


def _folded(operation: Callable[..., Any], *numbers: float) -> float:
    with np.errstate(all="ignore"):
        return float(operation(*map(np.float64, numbers)))


def _piecewise(name: str, t: _Part) -> ast.expr:
    """Write a piecewise function as conditional expressions through which nan passes."""
    number = _node(t)

    def choose(test: ast.cmpop, yes: ast.expr, no: ast.expr) -> ast.expr:
        return ast.IfExp(ast.Compare(number, [test], [ast.Constant(0.0)]), yes, no)

    zero, one, minus = ast.Constant(0.0), ast.Constant(1.0), ast.Constant(-1.0)
    if name == "pos":
        return choose(ast.LtE(), zero, number)
    if name == "above":
        return choose(ast.Gt(), one, choose(ast.LtE(), zero, number))
    if name == "step":
        return choose(ast.GtE(), one, choose(ast.Lt(), zero, number))
    if name == "absolute":
        return choose(ast.Gt(), number, ast.BinOp(zero, ast.Sub(), number))
    return choose(ast.Gt(), one, choose(ast.Lt(), minus, number))


def _guarded(body: list[ast.stmt]) -> ast.stmt:
    fallback = ast.Return(_call("otherwise", ast.Name("x", ast.Load())))
    return ast.Try(body, [ast.ExceptHandler(ast.Name("raised", ast.Load()), None, [fallback])], [], [])


def compiled_body(
    body: list[ast.stmt], names: Mapping[str, Any], arguments: Sequence[str] = ("x",)
) -> Callable[..., Any]:
    """Compile the body of a function of some arguments, which calls functions by their names."""
    taken = ast.arguments([], [ast.arg(name) for name in arguments], None, [], [], None, [])
    definition = ast.FunctionDef(name="law", args=taken, body=body, decorator_list=[])
    module = ast.fix_missing_locations(ast.Module([definition], []))
    code = next(c for c in compile(module, "<law>", "exec").co_consts if hasattr(c, "co_code"))
    return FunctionType(code, {**names, "__builtins__": {}})
