"""Load programs: how a load changes in time (public as ``plastica.programs``).

A program is made by one of the functions here; `Load` takes it for any of its loads. Times and values are
numbers, or text with units where a specimen is used ("3 N", "1 day").
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import fields as fields_of
from typing import Any, Final

from numpy.typing import NDArray

from plastica.errors import ArgumentError
from plastica.physics.amounts import Amount
from plastica.physics.polyline import MAX_KNOTS, Knot, Piece
from plastica.physics.program import Program, known_keys
from plastica.physics.reading import read_parameters, read_times, read_values
from plastica.physics.shapes import LARGEST_TABLE, Constant, Cycles, RampHoldRelease, Table
from plastica.physics.text import Text
from plastica.physics.waves import Sine

__all__ = [
    "MAX_KNOTS",
    "Knot",
    "Piece",
    "Program",
    "constant",
    "cycles",
    "expression",
    "from_dict",
    "ramp_hold_release",
    "table",
]

_KINDS: Final[dict[str, type[Program]]] = {
    each.kind: each for each in (Constant, Table, RampHoldRelease, Cycles, Sine, Text)
}


def constant(value: Amount) -> Program:
    """Make a program that does not change.

    Parameters
    ----------
    value : float or str
        The load, such as 3.0 or "3 N".

    Returns
    -------
    Program
        The program.

    Raises
    ------
    ArgumentError
        If it is not a finite number.
    """
    (number,), unit = read_values({"value": value})
    return Constant(number, value_unit=unit)


def table(times: Sequence[Amount] | NDArray[Any], values: Sequence[Amount] | NDArray[Any]) -> Program:
    """Make a program from rows (time, value): linear between rows, constant beyond the ends.

    Parameters
    ----------
    times : sequence of float or str
        In order; a time given twice is a jump. At most a million.
    values : sequence of float or str
        As many loads.

    Returns
    -------
    Program
        The program.

    Raises
    ------
    ArgumentError
        If the rows are unordered, unequal in number, empty, too many, or not finite.
    """
    t, time_unit = read_times(times, "times", LARGEST_TABLE)
    numbers, value_unit = read_values(values, "values", LARGEST_TABLE)
    return Table(t, numbers, value_unit=value_unit, time_unit=time_unit)


def ramp_hold_release(
    value: Amount, ramp: Amount, hold: Amount, release: Amount, *, start: Amount = 0.0, rest: Amount = 0.0
) -> Program:
    """Make a program that goes from `rest` to `value`, stays, and goes back to `rest`.

    Parameters
    ----------
    value : float or str
        The load while it is held.
    ramp, hold, release : float or str
        How long it rises, is held, and falls; a rise or fall within no time is a jump.
    start : float or str
        When it begins to rise.
    rest : float or str
        The load before and after.

    Returns
    -------
    Program
        The program.

    Raises
    ------
    ArgumentError
        If a time is negative, all are 0, or a number is not finite.
    """
    (top, bottom), value_unit = read_values({"value": value, "rest": rest})
    t, time_unit = read_times({"ramp": ramp, "hold": hold, "release": release, "start": start})
    rise, held, fall, begin = t
    return RampHoldRelease(top, rise, held, fall, begin, bottom, value_unit=value_unit, time_unit=time_unit)


def cycles(
    low: Amount,
    high: Amount,
    period: Amount,
    count: int | None = None,
    shape: str = "triangle",
    *,
    start: Amount = 0.0,
) -> Program:
    """Make a program of cycles between two loads.

    Parameters
    ----------
    low, high : float or str
        The loads between which it goes; it begins at low, and stays there after the last cycle.
    period : float or str
        The time that one cycle takes.
    count : int, optional
        How many cycles, at most a million; without it they never end.
    shape : str
        "triangle", "square" (high in the first half), "trapezoid" (rise, hold, fall and rest, a quarter each)
        or "sine".
    start : float or str
        When the first cycle begins.

    Returns
    -------
    Program
        The program.

    Raises
    ------
    ArgumentError
        If the period is not positive, the count absurd, the shape unknown, or a number not finite.
    """
    (bottom, top), value_unit = read_values({"low": low, "high": high})
    (length, begin), time_unit = read_times({"period": period, "start": start})
    if shape == "sine":
        return Sine(bottom, top, length, count, begin, value_unit=value_unit, time_unit=time_unit)
    return Cycles(bottom, top, length, count, shape, begin, value_unit=value_unit, time_unit=time_unit)


def expression(text: str, parameters: Mapping[str, Amount] | None = None) -> Program:
    """Make a program from text in t, such as "3*step(t - 1) + a*sin(w*t)".

    Parameters
    ----------
    text : str
        An expression in t; `step(x)` is 0 for x < 0 and 1 from 0 on, its argument linear in t.
    parameters : mapping of str to float or str, optional
        Values of the names in it.

    Returns
    -------
    Program
        The program.

    Raises
    ------
    ArgumentError
        If the text is no such expression, or a parameter is not finite.
    """
    pairs, time_unit = read_parameters(parameters or {})
    return Text(text, pairs, time_unit=time_unit)


def from_dict(data: object) -> Program:
    """Make a program from what its `to_dict` returned, validated like any other.

    Parameters
    ----------
    data : mapping
        Its kind and its numbers.

    Returns
    -------
    Program
        A program equal to the one that was stored.

    Raises
    ------
    ArgumentError
        If the mapping describes no program.
    """
    if not isinstance(data, Mapping) or str(data.get("kind")) not in _KINDS:
        raise ArgumentError(f"must be a mapping with a kind of {', '.join(_KINDS)}", where="program", value=data)
    kind = _KINDS[str(data["kind"])]
    known_keys(data, ("kind", *(each.name for each in fields_of(kind) if each.init)), "program")
    given: dict[str, Any] = {name: _from_json(value) for name, value in data.items() if name != "kind"}
    try:
        return kind(**given)
    except TypeError:
        raise ArgumentError("must have all the numbers of its kind", where="program", value=data) from None


def _from_json(value: object) -> object:
    return tuple(_from_json(each) for each in value) if isinstance(value, (list, tuple)) else value
