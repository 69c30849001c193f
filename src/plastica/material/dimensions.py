"""The dimension of a law, carried through its tree: what its units come to."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction
from functools import reduce
from typing import Any, NoReturn

from plastica.errors import ArgumentError
from plastica.material import functions as fn
from plastica.material.compiled import constant_value
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
    return _Walk(known, values, where, text).of(tree)


@dataclass(frozen=True)
class _Walk:
    """What one walk through a formula needs to know."""

    known: Mapping[str, Dimension]
    values: Mapping[str, float]
    where: str
    text: str

    def refuse(self, rule: str) -> NoReturn:
        raise ArgumentError(rule, where=self.where, value=self.text, next_step="Check the units of its parameters.")

    def of(self, part: Any) -> Dimension | None:
        if part.is_Symbol:
            return self.known[part.name]
        if part.is_Add or part.is_Pow:
            return self.total(part) if part.is_Add else self.power(part)
        if part.is_Mul or isinstance(part, (fn.pos, fn.absolute)):
            return reduce(unit_product, [self.of(factor) or DIMENSIONLESS for factor in part.args])
        if part.args and not isinstance(part, fn.STEP_LIKE):
            self.pure(part.args[0], f"arguments of {part.func.__name__}")
        return None if part.is_zero else DIMENSIONLESS

    def pure(self, part: Any, what: str) -> None:
        found = self.of(part)
        if found not in (None, DIMENSIONLESS):
            self.refuse(f"must have {what} without a unit, unlike {part}, which comes to {dimension_text(found)}")

    def power(self, part: Any) -> Dimension:
        base, exponent = part.args
        self.pure(exponent, "exponents")
        dimension = self.of(base)
        if dimension in (None, DIMENSIONLESS):
            return DIMENSIONLESS
        if any(symbol.name not in self.values for symbol in exponent.free_symbols):
            self.refuse(f"must have constant exponents above quantities with a unit, unlike {part}")
        number = Fraction(constant_value(exponent, self.values)).limit_denominator(1000)
        return unit_power(dimension or DIMENSIONLESS, number)

    def total(self, part: Any) -> Dimension | None:
        found = [(term, dimension) for term in part.args if (dimension := self.of(term)) is not None]
        for term, dimension in found[1:]:
            if dimension != found[0][1]:
                first = f"{found[0][0]} ({dimension_text(found[0][1])})"
                self.refuse(f"must add terms of one dimension, unlike {first} and {term} ({dimension_text(dimension)})")
        return found[0][1] if found else None
