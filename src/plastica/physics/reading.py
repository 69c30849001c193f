"""How the times and values of a load program are read: numbers, or text with units."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from plastica.errors import ArgumentError
from plastica.physics.amounts import Amount, finite, plain
from plastica.physics.program import LOAD_UNITS
from plastica.units import dimension_of, parse_quantity

__all__ = ["read_parameters", "read_times", "read_values"]

Entries = Mapping[str, Any] | Sequence[Any] | NDArray[Any]

_LARGEST: Final = 16


def read_times(given: Entries, where: str = "", largest: int = _LARGEST) -> tuple[tuple[float, ...], str]:
    """Read times.

    Parameters
    ----------
    given : mapping or sequence
        Named times, or a sequence of them.
    where : str
        The name of the sequence, for messages.
    largest : int
        How many there may be.

    Returns
    -------
    tuple of float, str
        The times, in s if one had a unit; and "s" if one had, else "".

    Raises
    ------
    ArgumentError
        If one of them is not a finite time.
    """
    entries = _entries(given, where, largest)
    if isinstance(entries, tuple):
        return entries, ""
    numbers = tuple(finite(value, "s", name) for name, value in entries)
    return numbers, "s" if any(isinstance(value, str) for _, value in entries) else ""


def read_values(given: Entries, where: str = "", largest: int = _LARGEST) -> tuple[tuple[float, ...], str]:
    """Read loads.

    Parameters
    ----------
    given : mapping or sequence
        Named loads, or a sequence of them.
    where : str
        The name of the sequence, for messages.
    largest : int
        How many there may be.

    Returns
    -------
    tuple of float, str
        The loads, in SI if one had a unit; and this unit: "N", "N*m", "N/m" or "".

    Raises
    ------
    ArgumentError
        If one of them is not a finite load, or two have different dimensions.
    """
    entries = _entries(given, where, largest)
    if isinstance(entries, tuple):
        return entries, ""
    unit = ""
    for name, value in entries:
        if isinstance(value, str):
            unit = unit or _unit(value, name)
    return tuple(finite(value, unit or "N", name) for name, value in entries), unit


def read_parameters(given: object) -> tuple[tuple[tuple[str, float], ...], str]:
    """Read the parameters of a text program.

    Parameters
    ----------
    given : mapping
        Names with numbers, or text with units of any dimension.

    Returns
    -------
    tuple of (name, value), str
        The pairs, in SI if one had a unit; and "s" if one had, else "".

    Raises
    ------
    ArgumentError
        If it is no such mapping, or a value is not finite.
    """
    if not isinstance(given, Mapping):
        raise ArgumentError("must be a mapping of names to numbers", where="parameters", value=given)
    pairs = []
    for name, value in given.items():
        where = f"parameters.{name}"
        number = parse_quantity(value, where=where)[0] if isinstance(value, str) else value
        pairs.append((str(name), finite(number, "", where)))
    return tuple(pairs), "s" if any(isinstance(value, str) for value in given.values()) else ""


def _entries(given: Entries, where: str, largest: int) -> tuple[float, ...] | list[tuple[str, Any]]:
    """Return the numbers themselves where all is numeric, else the entries with their names."""
    if isinstance(given, Mapping):
        return list(given.items())
    if isinstance(given, (str, bytes)) or not isinstance(given, (Sequence, np.ndarray)):
        raise ArgumentError("must be a sequence of numbers, or of text with units", where=where, value=given)
    if isinstance(given, np.ndarray):
        if given.ndim != 1:
            raise ArgumentError("must have one dimension", where=where, value=given.ndim)
        given = given.tolist()
    if len(given) > largest:
        raise ArgumentError(f"must have at most {largest} entries", where=where, value=len(given))
    if all(type(value) is float for value in given):
        return tuple(given)
    return [(f"{where}[{i}]", plain(value)) for i, value in enumerate(given)]


def _unit(text: Amount, where: str) -> str:
    """Tell which unit of a load a text has."""
    dimension = parse_quantity(str(text), where=where)[1]
    for unit in LOAD_UNITS:
        if dimension_of(unit) == dimension:
            return unit
    raise ArgumentError(
        "must be a force, a couple or a force per length",
        where=where,
        value=text,
        next_step='Write the unit, such as "3 N".',
    )
