"""Laws on arrays of any library, with parameters that are arrays themselves: one number for each member of a batch."""

from __future__ import annotations

import ast
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from plastica.material.compiled import compiled_body, statements_with
from plastica.material.expression import symbol

__all__ = ["function_of", "written"]


def function_of(
    tree: Any,
    variable: str,
    values: Mapping[str, float],
    varying: Sequence[str],
    xp: Any,
    argument_scale: float = 1.0,
    value_scale: float = 1.0,
) -> Callable[..., Any]:
    """Compile (x, p_1, p_2, ...) -> value_scale * tree(argument_scale * x) with some parameters as arguments.

    Parameters
    ----------
    tree : sympy.Expr
        The tree.
    variable : str
        The name of its variable.
    values : mapping of str to float
        The values of the parameters that are numbers.
    varying : sequence of str
        The parameters that are arrays, in the order of the arguments.
    xp : module
        The functions of an array library, by the names of the array API standard.
    argument_scale, value_scale : float
        Factors of the argument and of the value.

    Returns
    -------
    callable
        Takes x and one array for each of `varying`, of the same shape or to be broadcast; returns an array, or a
        float where the law does not depend on them.
    """
    body, arguments = written(tree, variable, values, varying, argument_scale, value_scale)
    return (lambda *_: body) if isinstance(body, float) else compiled_body(body, _functions(xp), arguments)


def written(
    tree: Any,
    variable: str,
    values: Mapping[str, float],
    varying: Sequence[str],
    argument_scale: float = 1.0,
    value_scale: float = 1.0,
) -> tuple[list[ast.stmt] | float, tuple[str, ...]]:
    """Write what `function_of` compiles; the body of a function, or a number, and the names of its arguments."""
    names = tuple(f"p{i}" for i in range(len(varying)))
    arguments = dict(zip(map(symbol, varying), names, strict=True))
    body = statements_with(tree, symbol(variable), values, arguments, argument_scale, value_scale)
    return body, ("x", *names)


def _functions(xp: Any) -> dict[str, Any]:
    """What the trees call, in a library of arrays; nan passes through."""
    same = ("exp", "log", "sin", "cos", "tan", "tanh", "sinh", "cosh", "sqrt", "sign", "atan")
    return {
        **{name: getattr(xp, name) for name in same},
        "absolute": xp.abs,
        "power": xp.pow,
        "pos": lambda x: xp.maximum(x, 0.0),
        "above": lambda x: _stepped(x, x > 0.0, xp),
        "step": lambda x: _stepped(x, x >= 0.0, xp),
    }


def _stepped(x: Any, is_one: Any, xp: Any) -> Any:
    """1 where told, else 0; nan where x is."""
    return xp.where(xp.isnan(x), x, xp.where(is_one, xp.ones_like(x), xp.zeros_like(x)))
