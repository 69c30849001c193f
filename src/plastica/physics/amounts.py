"""How one number of the user is read: a number in SI units as it is, or text with a unit."""

from __future__ import annotations

import math
from numbers import Real
from typing import Any

import numpy as np

from plastica.errors import ArgumentError
from plastica.units import quantity

__all__ = ["Amount", "finite", "plain", "positive"]

Amount = str | float
"""A number in SI units, or text with a unit such as ``"250 mm"``."""


def plain(value: object) -> Any:
    """Return a number of any type as a float, and anything else as it is; an array without axes is what it holds.

    Parameters
    ----------
    value : object
        What the user gave.

    Returns
    -------
    object
        The float, infinite if the number is too large for one; or the same object.
    """
    if isinstance(value, np.ndarray) and value.ndim == 0:
        value = value.item()
    if isinstance(value, Real) and not isinstance(value, bool):
        try:
            return float(value)
        except OverflowError:
            return math.inf
    return value


def finite(value: object, unit: str, where: str) -> float:
    """Read a number in SI units, or text with a unit.

    Parameters
    ----------
    value : str or float
        What the user gave.
    unit : str
        The SI unit due.
    where : str
        The name of the argument, for messages.

    Returns
    -------
    float
        The SI magnitude.

    Raises
    ------
    ArgumentError
        If it is not a finite number, or has another dimension.
    """
    number = plain(value)
    if isinstance(number, str):
        number = quantity(number, unit, where=where, bare=False)
    if not isinstance(number, float):
        rule = f'must be a number in {unit}, or text with a unit such as "1 {unit}"'
        raise ArgumentError(rule, where=where, value=value)
    if not math.isfinite(number):
        raise ArgumentError("must be finite", where=where, value=value)
    return number


def positive(value: object, unit: str, where: str) -> float:
    """Read a positive number in SI units, or text with a unit; see `finite`.

    Parameters
    ----------
    value : str or float
        What the user gave.
    unit : str
        The SI unit due.
    where : str
        The name of the argument, for messages.

    Returns
    -------
    float
        The SI magnitude.

    Raises
    ------
    ArgumentError
        If it is not a positive finite number, or has another dimension.
    """
    number = finite(value, unit, where)
    if number <= 0.0:
        raise ArgumentError("must be positive", where=where, value=value)
    return number
