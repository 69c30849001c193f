"""What one key of a scenario takes: quantities, formulas, names; each refused in words of its own."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from typing import Annotated, Any, Final

from pydantic import AfterValidator, BeforeValidator, PlainValidator, ValidationInfo
from pydantic_core import PydanticCustomError

from plastica.errors import ArgumentError, shown
from plastica.study.problems import Problems
from plastica.study.tokens import KeyPath
from plastica.units import looks_like_quantity, quantity

__all__ = [
    "Amount",
    "Angle",
    "Anything",
    "BaseName",
    "Curvature",
    "Curvatures",
    "Density",
    "FilePath",
    "Flag",
    "Formula",
    "Formulas",
    "Kelvin",
    "Law",
    "Length",
    "Lengths",
    "MassPerLength",
    "Nodes",
    "Number",
    "Parameters",
    "Pascal",
    "RotaryInertia",
    "Stiffness",
    "Text",
    "Time",
    "Times",
    "Until",
    "Value",
    "Values",
    "Whole",
    "Word",
    "Words",
    "check_formula",
    "checked",
    "given",
]

Amount = float | str

_EXAMPLES: Final = {
    "m": "250 mm",
    "Pa": "2.4 GPa",
    "s": "2 min",
    "K": "293 K",
    "N*m**2": "0.035 N*m**2",
    "1/m": "0.4 1/m",
    "N": "3 N",
    "N*m": "0.1 N*m",
    "N/m": "0.5 N/m",
    "kg/m": "0.157 kg/m",
    "kg*m": "1.3e-8 kg*m",
    "kg/m**3": "7850 kg/m**3",
    "1/(m*s)": "2 1/(m*s)",
}
_NAME: Final = re.compile(r"[A-Za-z0-9_][A-Za-z0-9._-]{0,79}")
_BARE: Final = re.compile(r"\s*[+-]?(?:\d+(?:\.\d*)?|\.\d+)(?:[eE][+-]?\d+)?\s*")


def given(value: object) -> str:
    """Show a value in a message, as TOML writes it."""
    return str(value).lower() if isinstance(value, bool) else shown(value)


def _wrong(why: str) -> PydanticCustomError:
    return PydanticCustomError("plastica", "{why}", {"why": why})


def checked(check: Callable[[Any], None]) -> AfterValidator:
    """Let a check of the package itself judge a value, in its own words."""

    def judge(value: Any) -> Any:
        try:
            check(value)
        except ArgumentError as error:
            raise _wrong(str(error).removeprefix(f"`{error.where}` ")) from None
        return value

    return AfterValidator(judge)


def _need_unit(value: object, unit: str) -> PydanticCustomError:
    example = f', such as "{_EXAMPLES[unit]}"' if unit in _EXAMPLES else ""
    return _wrong(f"needs a unit: it must be text with a quantity in {unit}{example}, but is {given(value)}.")


def _amount(unit: str | None = None, *, words: tuple[str, ...] = ()) -> Any:
    """Take a quantity in `unit` (by default that of the context), or one of a few words."""

    def read(value: Any, info: ValidationInfo) -> Amount:
        context: Mapping[str, Any] = info.context or {}
        due = unit or str(context["unit"])
        if isinstance(value, str) and value in words:
            return value
        if not context["si"]:
            return _pure_number(value, tuple(f'"{word}"' for word in words))
        if not isinstance(value, str) or _BARE.fullmatch(value):
            raise _need_unit(value, due)
        try:
            quantity(value, due, where="", bare=False)
        except ArgumentError as error:
            raise _wrong(str(error)) from None
        return value

    return PlainValidator(read)


def _pure_number(value: Any, words: tuple[str, ...] = ()) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float):
        choice = "".join(f", or {word}" for word in words)
        rule = f"must be a plain number{choice} in a dimensionless scenario, but is {given(value)}."
        raise _wrong(f'{rule} Quantities with units need units = "SI".')
    return float(value)


def _formula(value: Any, info: ValidationInfo) -> Amount:
    """Take a quantity, or text in the one variable of the context."""
    context: Mapping[str, Any] = info.context or {}
    return _read_formula(value, bool(context["si"]), str(context["unit"]), str(context["variable"]))


def _read_formula(value: Any, si: bool, unit: str, variable: str) -> Amount:
    if not isinstance(value, str):
        if si:
            raise _need_unit(value, unit)
        return _pure_number(value, (f"text in {variable}",))
    if si and _BARE.fullmatch(value):
        raise _need_unit(value, unit)
    if not looks_like_quantity(value):
        return value
    if not si:
        rule = f"must be a number or text in {variable} in a dimensionless scenario, but is {given(value)}."
        raise _wrong(f'{rule} Quantities with units need units = "SI".')
    try:
        quantity(value, unit, where="", bare=False)
    except ArgumentError as error:
        raise _wrong(str(error)) from None
    return value


def check_formula(
    value: object, path: KeyPath, problems: Problems, *, si: bool, unit: str, variable: str
) -> Amount | None:
    """Check a load or a shape that is one number, quantity or formula; None, and a problem, if it is neither."""
    try:
        return _read_formula(value, si, unit, variable)
    except PydanticCustomError as error:
        problems.add(path, error.message())
        return None


def _text(longest: int) -> Any:
    def read(value: Any) -> str:
        if not isinstance(value, str):
            raise _wrong(f"must be text, but is {given(value)}.")
        if len(value) > longest or not value.isprintable():
            raise _wrong(f"must be one printable line of at most {longest} characters, but is {given(value)}.")
        return value

    return PlainValidator(read)


def _number(value: Any) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise _wrong(f"must be a plain number, but is {given(value)}.")
    return float(value)


def _integer(value: Any) -> int:
    if isinstance(value, bool) or not isinstance(value, int):
        raise _wrong(f"must be a whole number, but is {given(value)}.")
    return value


def _nodes(value: Any) -> int | str:
    if value == "auto":
        return "auto"
    if isinstance(value, bool) or not isinstance(value, int):
        raise _wrong(f'must be a whole number or "auto", but is {given(value)}.')
    return value


def _angle(value: Any) -> Amount:
    """Take an angle with its unit, which is no scale of the rod: in any scenario; a number where there are no units."""
    rule = f'must be an angle, such as "30 deg", or a number in rad, but is {given(value)}.'
    if isinstance(value, str) and not _BARE.fullmatch(value):
        try:
            quantity(value, "rad", where="", bare=False)
        except ArgumentError:
            raise _wrong(rule) from None
        return value
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise _wrong(rule)
    return float(value)


def _parameter(value: Any) -> Amount:
    if isinstance(value, bool) or not isinstance(value, int | float | str):
        raise _wrong(f"must be a number, or text with a unit, but is {given(value)}.")
    return value if isinstance(value, str) else float(value)


def _base_name(value: Any) -> str:
    if not isinstance(value, str) or not _NAME.fullmatch(value):
        rule = "must be a plain file name without a folder: at most 80 letters, digits, and . _ - within"
        raise _wrong(f"{rule}, but is {given(value)}.")
    return value


def _flag(value: Any) -> bool:
    if not isinstance(value, bool):
        raise _wrong(f"must be true or false, but is {given(value)}.")
    return value


def _array(value: Any) -> list[Any]:
    if not isinstance(value, list):
        raise _wrong(f"must be an array in brackets, but is {given(value)}.")
    return value


Text = Annotated[str, _text(200)]
Word = Annotated[str, _text(40)]
FilePath = Annotated[str, _text(300)]
Formula = Annotated[Amount, PlainValidator(_formula)]
Law = Annotated[str, _text(500)]
Length = Annotated[Amount, _amount("m")]
Time = Annotated[Amount, _amount("s")]
Curvature = Annotated[Amount, _amount("1/m")]
Value = Annotated[Amount, _amount()]
Number = Annotated[float, PlainValidator(_number)]
Whole = Annotated[int, PlainValidator(_integer)]
Flag = Annotated[bool, PlainValidator(_flag)]
Parameters = dict[str, Annotated[Amount, PlainValidator(_parameter)]]


Pascal = Annotated[Amount, _amount("Pa")]
Stiffness = Annotated[Amount, _amount("N*m**2")]
Kelvin = Annotated[Amount, _amount("K")]
MassPerLength = Annotated[Amount, _amount("kg/m")]
RotaryInertia = Annotated[Amount, _amount("kg*m")]
Density = Annotated[Amount, _amount("kg/m**3")]
Angle = Annotated[Amount, PlainValidator(_angle)]
Until = Annotated[Amount, _amount("s", words=("equilibrium",))]
Nodes = Annotated[int | str, PlainValidator(_nodes)]
BaseName = Annotated[str, PlainValidator(_base_name)]
Anything = Annotated[Any, PlainValidator(lambda value: value)]
Lengths = Annotated[list[Length], BeforeValidator(_array)]
Curvatures = Annotated[list[Curvature], BeforeValidator(_array)]
Times = Annotated[list[Time], BeforeValidator(_array)]
Values = Annotated[list[Value], BeforeValidator(_array)]
Formulas = Annotated[list[Formula], BeforeValidator(_array)]
Words = Annotated[list[Word], BeforeValidator(_array)]
