"""Quantities as text: "250 mm", "0.035 N*m**2", "2 days" -> SI magnitudes, checked against a dimension.

The text is untrusted: it is read by the small grammar below, and only single names are ever handed to pint.
Names of the SI with their prefixes are known here, since loading pint takes longer than a run; a test holds
this table equal to pint's. All factors are exact fractions, so that a conversion rounds once.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from decimal import Decimal, localcontext
from fractions import Fraction
from functools import lru_cache
from typing import TYPE_CHECKING, Any, Final, NoReturn, TypeAlias

from plastica.errors import ArgumentError

if TYPE_CHECKING:
    from pint import UnitRegistry

__all__ = [
    "BASE_UNITS", "DIMENSIONLESS", "Dimension", "dimension_of", "dimension_text", "format_quantity",
    "looks_like_quantity", "parse_quantity", "quantity", "unit_power", "unit_product",
]  # fmt: skip

Dimension: TypeAlias = tuple[Fraction, ...]
"""Exponents of `BASE_UNITS`, in that order."""

BASE_UNITS: Final = ("kg", "m", "s", "K", "A", "mol", "cd")
DIMENSIONLESS: Final[Dimension] = (Fraction(0),) * len(BASE_UNITS)

_LONGEST_TEXT: Final = 200
_DEEPEST_NESTING: Final = 20
_LARGEST_EXPONENT: Final = 9
_LARGEST_DECIMAL_EXPONENT: Final = 400
_IN_RANGE: Final = "number within the range of doubles"

_NUMBER: Final = r"(?:\d+(?:\.\d*)?|\.\d+)(?:[eE][+-]?\d+)?"
_QUANTITY: Final = re.compile(rf"\s*[+-]?(?>{_NUMBER})(?:\s*[A-Za-zµμ°Ω]|\s+\d)")
_LEADING: Final = re.compile(rf"\s*([+-]?{_NUMBER})", re.A)
_NOT_A_NUMBER: Final = re.compile(r"\s*[+-]?(?:nan|inf|infinity)\b", re.IGNORECASE)
_TOKEN: Final = re.compile(rf"\s*(?:(?P<number>{_NUMBER})|(?P<name>[a-zA-Z_]+)|(?P<sign>\*\*|[*/()^-]))")
_SPELLINGS: Final = str.maketrans({"µ": "u", "μ": "u", "·": "*", "²": "**2", "³": "**3", "Ω": "ohm"})

_PREFIXES: Final = {"": 0, "n": -9, "u": -6, "m": -3, "c": -2, "d": -1, "k": 3, "M": 6, "G": 9}
_PREFIXED: Final[dict[str, tuple[Fraction, tuple[int, int, int]]]] = {
    "m": (Fraction(1), (0, 1, 0)),
    "s": (Fraction(1), (0, 0, 1)),
    "g": (Fraction(1, 1000), (1, 0, 0)),
    "N": (Fraction(1), (1, 1, -2)),
    "Pa": (Fraction(1), (1, -1, -2)),
    "J": (Fraction(1), (1, 2, -2)),
    "W": (Fraction(1), (1, 2, -3)),
    "Hz": (Fraction(1), (0, 0, -1)),
}
_SECONDS: Final = {"min": 60, "minute": 60, "h": 3600, "hour": 3600, "d": 86400, "day": 86400, "week": 604800}


@dataclass(frozen=True)
class _Unit:
    """A product of units: its exact size in SI and its dimension."""

    factor: Fraction
    dimension: Dimension

    def times(self, other: _Unit, exponent: int) -> _Unit:
        dimension = unit_product(self.dimension, unit_power(other.dimension, exponent))
        return _Unit(self.factor * Fraction(other.factor**exponent), dimension)


_ONE: Final = _Unit(Fraction(1), DIMENSIONLESS)


def quantity(value: str | float, unit: str, *, where: str, bare: bool) -> float:
    """Read a quantity of a known dimension.

    Parameters
    ----------
    value : str or float
        Text such as "250 mm", or a number.
    unit : str
        An SI unit of the dimension that is due, such as "N*m**2"; "1" for a pure number.
    where : str
        The argument or key that the message names.
    bare : bool
        Whether a number without a unit is taken as SI. If not, it is refused where a unit is due.

    Returns
    -------
    float
        The magnitude in SI units.

    Raises
    ------
    ArgumentError
        If the text is not a number with a unit, has another dimension, or is not finite.
    """
    due = dimension_of(unit)
    if not isinstance(value, str):
        magnitude, dimension = _plain_number(value, where), None
    else:
        magnitude, read = parse_quantity(value, where=where)
        dimension = None if _is_bare(value) else read
    if dimension is None and not bare and due != DIMENSIONLESS:
        raise ArgumentError(
            f"must carry a unit such as {unit}",
            where=where,
            value=value,
            next_step=f'Write it as text: "5 {unit}".',
        )
    if dimension is not None and dimension != due:
        raise ArgumentError(
            f"must be a quantity in {unit if unit == 'rad' or due != DIMENSIONLESS else 'no unit (a pure number)'}",
            where=where,
            value=value,
            next_step=f"Its unit comes to {dimension_text(dimension)}.",
        )
    return magnitude


def parse_quantity(text: str, *, where: str) -> tuple[float, Dimension]:
    """Read a number with a unit product, such as "1e-3 1/(m*s)".

    Parameters
    ----------
    text : str
        At most 200 characters: a number, then unit names joined by `*`, `/`, `**` and parentheses.
    where : str
        The argument or key that the message names.

    Returns
    -------
    tuple of (float, Dimension)
        The magnitude in SI units, and the exponents of `BASE_UNITS`. A bare number is dimensionless.

    Raises
    ------
    ArgumentError
        If the text is something else, an unknown unit, an absolute temperature in degrees, or not finite.
    """
    if len(text) > _LONGEST_TEXT:
        raise ArgumentError(f"must be at most {_LONGEST_TEXT} characters long", where=where, value=text)
    if _NOT_A_NUMBER.match(text):
        raise ArgumentError("must be a finite number with a unit", where=where, value=text)
    number = _LEADING.match(text)
    if number is None:
        next_step = 'Write a quantity as "0.25 m".'
        raise ArgumentError("must begin with a number", where=where, value=text, next_step=next_step)
    unit = _read_unit(text[number.end() :], where, text)
    exponent = re.search(r"[eE]([+-]?\d+)$", number[1])
    if exponent and (len(exponent[1]) > 5 or abs(int(exponent[1])) > _LARGEST_DECIMAL_EXPONENT):
        raise ArgumentError(f"must be a {_IN_RANGE}", where=where, value=text)
    try:
        magnitude = float(Fraction(number[1]) * unit.factor)
    except OverflowError:
        raise ArgumentError(f"must be a {_IN_RANGE}", where=where, value=text) from None
    return magnitude, unit.dimension


def looks_like_quantity(text: str) -> bool:
    """Tell whether text begins like a quantity with a unit ("3 N"), unlike "3*s", "5" or "1 + cos(3*s)"."""
    return _QUANTITY.match(text) is not None


def dimension_of(unit: str) -> Dimension:
    """Return the dimension of a unit product such as "N*m**2"; "" and "1" are dimensionless.

    Raises
    ------
    ArgumentError
        If the text is not a product of known units.
    """
    return _read_unit("" if unit.strip() == "1" else unit, "unit", unit).dimension


def unit_product(a: Dimension, b: Dimension) -> Dimension:
    """Return the dimension of a product."""
    return tuple(x + y for x, y in zip(a, b, strict=True))


def unit_power(a: Dimension, exponent: Fraction | int) -> Dimension:
    """Return the dimension of a power."""
    return tuple(x * exponent for x in a)


def dimension_text(dimension: Dimension) -> str:
    """Write a dimension for people, such as "kg*m**2/s**2"; "1" if there is none."""
    above = [_factor_text(name, n) for name, n in zip(BASE_UNITS, dimension, strict=True) if n > 0]
    below = [_factor_text(name, -n) for name, n in zip(BASE_UNITS, dimension, strict=True) if n < 0]
    bottom = "*".join(below)
    if len(below) > 1:
        bottom = f"({bottom})"
    return ("*".join(above) or "1") + (f"/{bottom}" if below else "")


def format_quantity(value: float, unit: str) -> str:
    """Write a quantity for people: four digits, and a prefix where the first unit takes one.

    Parameters
    ----------
    value : float
        The magnitude in SI units.
    unit : str
        The SI unit, such as "N*m**2"; times ("s") become minutes, hours or days.

    Returns
    -------
    str
        Text such as "35 mN*m**2", which `parse_quantity` reads back to four digits.
    """
    if unit == "s" and 600.0 <= abs(value) < math.inf:
        size, name = next((n, u) for n, u in ((86400, "d"), (3600, "h"), (60, "min")) if abs(value) >= 2 * n)
        return f"{value / size:.4g} {name}"
    first = re.match(r"(m|s|N|Pa|J|W|Hz)(?![A-Za-z^]|\*\*)", unit)
    if first is None or value == 0.0 or not math.isfinite(value):
        return f"{value:.4g} {'' if unit == '1' else unit}".rstrip()
    # rounding first keeps 999.96 mm from becoming "1000 mm"
    rounded = float(f"{value:.4g}")
    power = min(9, max(-9, 3 * math.floor(math.log10(abs(rounded)) / 3)))
    prefix = next(name for name, n in _PREFIXES.items() if n == power)
    return f"{value / 10.0**power:.4g} {prefix}{unit}"


def _plain_number(value: object, where: str) -> float:
    if isinstance(value, bool) or not hasattr(value, "__float__"):
        raise ArgumentError("must be a number, or text with a unit", where=where, value=value)
    try:
        number = float(value)
    except (TypeError, ValueError, OverflowError):
        raise ArgumentError(f"must be one {_IN_RANGE}", where=where, value=value) from None
    if not math.isfinite(number):
        raise ArgumentError("must be finite", where=where, value=value)
    return number


def _is_bare(text: str) -> bool:
    return re.fullmatch(rf"\s*[+-]?{_NUMBER}\s*", text) is not None


def _factor_text(name: str, exponent: Fraction) -> str:
    if exponent == 1:
        return name
    return f"{name}**{exponent}" if exponent.denominator == 1 else f"{name}**{float(exponent):g}"


def _read_unit(text: str, where: str, whole: str) -> _Unit:
    reader = _UnitReader(text, where, whole)
    if reader.at_end():
        return _ONE
    unit = reader.product(leading=True)
    if not reader.at_end():
        reader.refuse("must end after its unit")
    return unit


class _UnitReader:
    """Recursive descent over `product := power (("*" | "/" | " ") power)*`."""

    def __init__(self, text: str, where: str, whole: str) -> None:
        self.where, self.whole, self.depth = where, whole, 0
        self.tokens: list[tuple[str, str]] = []
        self.next = 0
        text, position = text.translate(_SPELLINGS).rstrip(), 0
        while position < len(text):
            match = _TOKEN.match(text, position)
            if match is None:
                self.refuse(f"must be a product of units, where {text[position:].strip()[0]!r} does not fit")
            self.tokens.append((str(match.lastgroup), match[str(match.lastgroup)].replace("^", "**")))
            position = match.end()

    def refuse(self, rule: str) -> NoReturn:
        next_step = 'Units are written as "N*m**2", "1/(m*s)"; temperatures are in K.'
        raise ArgumentError(rule, where=self.where, value=self.whole, next_step=next_step)

    def at_end(self) -> bool:
        return self.next >= len(self.tokens)

    def peek(self) -> str:
        return "" if self.at_end() else self.tokens[self.next][1]

    def take(self, text: str) -> bool:
        found = self.peek() == text
        self.next += found
        return found

    def product(self, *, leading: bool = False) -> _Unit:
        unit = _ONE if leading and self.peek() in ("*", "/") else self.power()
        divided = False
        while not self.at_end() and self.peek() != ")":
            exponent = -1 if self.take("/") else 1
            if exponent == 1 and not self.take("*") and divided:
                self.refuse("must say with parentheses what is divided by")
            divided = divided or exponent == -1
            unit = unit.times(self.power(), exponent)
        return unit

    def power(self) -> _Unit:
        unit = self.atom()
        if not self.take("**"):
            return unit
        exponent = self.exponent()
        if self.peek() == "**":
            self.refuse("must not raise an exponent to a power")
        return _Unit(_power(unit.factor, exponent), unit_power(unit.dimension, exponent))

    def atom(self) -> _Unit:
        if self.at_end():
            self.refuse("must have a unit after each operator")
        kind, text = self.tokens[self.next]
        self.next += 1
        if kind == "name":
            return _named_unit(text) or self.refuse(f"must use known units, which {text!r} is not")
        if kind == "number" and text == "1":
            return _ONE
        if text == "(":
            return self.parenthesised()
        return self.refuse(f"must be a product of units, where {text!r} does not fit")

    def parenthesised(self) -> _Unit:
        self.depth += 1
        if self.depth > _DEEPEST_NESTING:
            self.refuse(f"must nest parentheses at most {_DEEPEST_NESTING} deep")
        unit = self.product()
        if not self.take(")"):
            self.refuse("must close its parentheses")
        self.depth -= 1
        return unit

    def exponent(self) -> Fraction:
        closing = self.take("(")
        sign = -1 if self.take("-") else 1
        if self.at_end() or self.tokens[self.next][0] != "number" or len(self.peek()) > 3:
            self.refuse("must have a small number as exponent")
        value = sign * Fraction(self.tokens[self.next][1])
        self.next += 1
        if closing and not self.take(")"):
            self.refuse("must close its parentheses")
        if abs(value) > _LARGEST_EXPONENT or value.denominator > 2:
            self.refuse(f"must have whole or half exponents of at most {_LARGEST_EXPONENT}")
        return value


def _power(factor: Fraction, exponent: Fraction) -> Fraction:
    if exponent.denominator == 1:
        return factor ** int(exponent)
    with localcontext() as context:
        context.prec = 50
        root = (Decimal(factor.numerator) / Decimal(factor.denominator)).sqrt()
    return Fraction(root) ** exponent.numerator


@lru_cache(maxsize=512)
def _named_unit(name: str) -> _Unit | None:
    """Return a unit by its name, from the table of the SI if it is there, else from pint."""
    seconds = _SECONDS.get(name.removesuffix("s") if len(name) > 3 else name)
    if seconds is not None:
        return _Unit(Fraction(seconds), _mechanical((0, 0, 1)))
    if name in ("K", "kelvin"):
        return _Unit(Fraction(1), tuple(Fraction(base == "K") for base in BASE_UNITS))
    if name in ("rad", "radian", "dimensionless"):
        return _ONE
    if name in ("deg", "degree", "degrees"):
        return _Unit(Fraction(math.pi) / 180, DIMENSIONLESS)
    for prefix, power in _PREFIXES.items():
        unit = name.removeprefix(prefix)
        if unit in _PREFIXED and prefix + unit == name:
            factor, exponents = _PREFIXED[unit]
            return _Unit(factor * Fraction(10) ** power, _mechanical(exponents))
    return _pint_unit(name)


def _mechanical(exponents: tuple[int, int, int]) -> Dimension:
    return (*map(Fraction, exponents), *DIMENSIONLESS[3:])


def _pint_unit(name: str) -> _Unit | None:
    """Return a unit that pint knows; None if it does not, or if its scale has an offset or is logarithmic."""
    from pint.errors import PintError

    registry = _registry()
    names = ("kilogram", "meter", "second", "kelvin", "ampere", "mole", "candela")
    try:
        factor, base = registry.get_base_units(name)
        zero = registry.Quantity(Fraction(0), name).to_base_units().magnitude
    except (PintError, ValueError, TypeError, KeyError, AttributeError, OverflowError, ZeroDivisionError):
        return None
    exponents = {str(unit): Fraction(str(n)) for unit, n in dict(base._units).items() if unit != "radian"}
    if zero != 0 or not set(exponents) <= set(names):
        return None
    return _Unit(Fraction(str(factor)), tuple(exponents.get(unit, Fraction(0)) for unit in names))


@lru_cache(maxsize=1)
def _registry() -> UnitRegistry[Any]:
    from pint import UnitRegistry

    return UnitRegistry(non_int_type=Fraction)
