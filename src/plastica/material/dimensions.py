"""The dimension of a law, carried through its tree: what its units come to."""

from __future__ import annotations

from collections.abc import Mapping
from fractions import Fraction
from functools import reduce
from typing import Any, NoReturn

import sympy as sp

from plastica.errors import ArgumentError
from plastica.material import functions as fn
from plastica.units import DIMENSIONLESS, Dimension, dimension_text, unit_power, unit_product

__all__ = ["dimension_of_tree"]


def dimension_of_tree(
    tree: Any, known: Mapping[str, Dimension], values: Mapping[str, float], *, where: str, text: str
) -> Dimension | None:
    """Return what the units of a formula come to.

    Parameters
    ----------
    tree : sympy.Expr
        The formula.
    known : mapping of str to Dimension
        The dimension of the variable and of every parameter; literal numbers have none.
    values : mapping of str to float
        The values of the parameters, for exponents.
    where, text : str
        The law, and its text, for messages.

    Returns
    -------
    Dimension or None
        The dimension; None for 0, which has any.

    Raises
    ------
    ArgumentError
        If terms of a sum differ, or a function or an exponent has an argument with a unit.
    """

    def refuse(rule: str) -> NoReturn:
        raise ArgumentError(rule, where=where, value=text, next_step="Check the units of its parameters.")

    def pure(part: Any, what: str) -> None:
        found = walk(part)
        if found not in (None, DIMENSIONLESS):
            refuse(f"must have {what} without a unit, unlike {part}, which comes to {dimension_text(found)}")

    def power(part: Any) -> Dimension | None:
        base, exponent = part.args
        pure(exponent, "exponents")
        if walk(base) in (None, DIMENSIONLESS):
            return DIMENSIONLESS
        number = exponent.xreplace({sp.Symbol(name): sp.Float(value) for name, value in values.items()})
        if not number.is_Number:
            refuse(f"must have constant exponents above quantities with a unit, unlike {part}")
        return unit_power(walk(base) or DIMENSIONLESS, Fraction(float(number)).limit_denominator(1000))

    def total(part: Any) -> Dimension | None:
        found = [(term, d) for term in part.args if (d := walk(term)) is not None]
        for term, d in found[1:]:
            if d != found[0][1]:
                first = f"{found[0][0]} ({dimension_text(found[0][1])})"
                refuse(f"must add terms of one dimension, unlike {first} and {term} ({dimension_text(d)})")
        return found[0][1] if found else None

    def walk(part: Any) -> Dimension | None:
        if part.is_Symbol:
            return known[part.name]
        if part.is_Add or part.is_Pow:
            return total(part) if part.is_Add else power(part)
        if part.is_Mul or isinstance(part, (fn.pos, fn.absolute)):
            return reduce(unit_product, [walk(factor) or DIMENSIONLESS for factor in part.args])
        if part.args and not isinstance(part, fn.STEP_LIKE):
            pure(part.args[0], f"arguments of {part.func.__name__}")
        return None if part.is_zero else DIMENSIONLESS

    return walk(tree)
