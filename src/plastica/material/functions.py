"""The functions a law may use, as SymPy classes, and exact differentiation of trees made of them.

SymPy's own `Abs`, `Max` and `Heaviside` rewrite themselves into piecewise forms with assumptions; these stay
what they are. The rule for powers keeps d(b**p) = p*b**(p-1)*b', which is defined where b vanishes, while
SymPy's p*b**p/b*b' is 0/0 there.
"""

from __future__ import annotations

from typing import Any, Final

import sympy as sp

__all__ = ["CALLABLE", "STEP_LIKE", "above", "absolute", "depends", "derive", "pos", "sign", "step"]


class pos(sp.Function):  # type: ignore[misc]  # noqa: N801  (the name users write)
    """Positive part, pos(x) = max(x, 0)."""

    nargs = 1


class above(sp.Function):  # type: ignore[misc]  # noqa: N801
    """Derivative of `pos`: 1 where x > 0, else 0."""

    nargs = 1


class step(sp.Function):  # type: ignore[misc]  # noqa: N801
    """Unit step: 1 where x >= 0, else 0."""

    nargs = 1


class absolute(sp.Function):  # type: ignore[misc]  # noqa: N801
    """Absolute value of a real argument, written `abs`."""

    nargs = 1

    def __new__(cls, argument: Any, **options: Any) -> Any:
        """Make |-x| and |x| one tree, so that evenness can be seen."""
        turned = -argument if argument.could_extract_minus_sign() else argument
        return super().__new__(cls, turned, **options)


class sign(sp.Function):  # type: ignore[misc]  # noqa: N801
    """Derivative of `abs`: -1, 0 or 1."""

    nargs = 1

    def __new__(cls, argument: Any, **options: Any) -> Any:
        """Make sign(-x) and -sign(x) one tree, so that oddness can be seen."""
        if argument.could_extract_minus_sign():
            return -super().__new__(cls, -argument, **options)
        return super().__new__(cls, argument, **options)


CALLABLE: Final[dict[str, Any]] = {
    "pos": pos,
    "abs": absolute,
    "exp": sp.exp,
    "log": sp.log,
    "sin": sp.sin,
    "cos": sp.cos,
    "tan": sp.tan,
    "tanh": sp.tanh,
    "sinh": sp.sinh,
    "cosh": sp.cosh,
    "sqrt": sp.sqrt,
    "atan": sp.atan,
    "step": step,
}
"""What a user may call, by the name that is written."""

STEP_LIKE: Final = (step, above, sign)

_OUTER: Final[dict[Any, Any]] = {
    pos: above,
    absolute: sign,
    sp.exp: sp.exp,
    sp.log: lambda u: 1 / u,
    sp.sin: sp.cos,
    sp.cos: lambda u: -sp.sin(u),
    sp.tan: lambda u: 1 + sp.tan(u) ** 2,
    sp.tanh: lambda u: sp.cosh(u) ** -2,
    sp.sinh: sp.cosh,
    sp.cosh: sp.sinh,
    sp.atan: lambda u: 1 / (1 + u**2),
}


def depends(tree: Any, variable: Any) -> bool:
    """Tell whether a tree contains the variable."""
    return variable in tree.free_symbols


def derive(tree: Any, variable: Any) -> Any:
    """Differentiate a tree exactly.

    Parameters
    ----------
    tree : sympy.Expr
        A tree of sums, products, powers and the functions above.
    variable : sympy.Symbol
        The variable.

    Returns
    -------
    sympy.Expr
        The derivative; that of a step is 0, as it is everywhere but at the jump.
    """
    if tree.is_Symbol or not depends(tree, variable):
        return sp.Integer(tree == variable)
    if tree.is_Add:
        return sp.Add(*(derive(term, variable) for term in tree.args))
    if tree.is_Mul:
        return _derive_product(tree, variable)
    if tree.is_Pow:
        return _derive_power(tree, variable)
    inner = tree.args[0]
    if tree.func is sp.log and inner.func is sp.cosh:
        return sp.tanh(inner.args[0]) * derive(inner.args[0], variable)
    return _OUTER.get(tree.func, _of_step)(inner) * derive(inner, variable)


def _of_step(_inner: Any) -> Any:
    return sp.S.Zero


def _derive_product(tree: Any, variable: Any) -> Any:
    terms = []
    for i, factor in enumerate(tree.args):
        if depends(factor, variable):
            terms.append(sp.Mul(*tree.args[:i], derive(factor, variable), *tree.args[i + 1 :]))
    return sp.Add(*terms)


def _derive_power(tree: Any, variable: Any) -> Any:
    base, exponent = tree.args
    if base.func is sp.cosh and exponent.is_negative:
        # sinh/cosh is inf/inf far out, where the power itself has long vanished
        return exponent * tree * sp.tanh(base.args[0]) * derive(base.args[0], variable)
    if not depends(exponent, variable):
        return exponent * sp.Pow(base, exponent - 1) * derive(base, variable)
    rate = derive(exponent, variable) * sp.log(base) + exponent * derive(base, variable) / base
    return tree * rate
