"""Numbers and units as people read them, for the report."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from plastica.physics.scales import KINDS
from plastica.units import format_quantity

if TYPE_CHECKING:
    from plastica.motion.solution import Solution

__all__ = ["SYMBOLS", "Writer", "amount", "how_it_ended", "number", "parameter", "pretty"]

SYMBOLS: Final = {
    "length": "L",
    "time": "T",
    "curvature": "/L",
    "force": "EI/L²",
    "couple": "EI/L",
    "distributed": "EI/L³",
    "drive": "EI",
    "energy": "EI/L",
    "velocity": "L/T",
    "ratio": "",
}
"""What dimensionless quantities are multiples of, by kind."""

_SUPERSCRIPTS: Final = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
_POWER: Final = re.compile(r"(?<=[A-Za-z])(?:\*\*|\^)(-?\d+)")
_PRODUCT: Final = re.compile(r"(?<=[A-Za-z⁰¹²³⁴⁵⁶⁷⁸⁹])\*(?=[A-Za-z(])")
_MICRO: Final = re.compile(r"(?<=[\d ])u(?=(?:m|s|N|J|Pa|W)\b)")
_INVERSE: Final = re.compile(r"(?<=\d) 1/m\b")
_PER_LENGTH: Final = re.compile(r"(?<=\d) /L\b")
_EXPONENT: Final = re.compile(r"(?<=\d)e([+-]\d+)")
_LEADING: Final = re.compile(r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?")
_MINUS: Final = re.compile(r"(?<![\w.)])-(?=\d)")


def pretty(text: str) -> str:
    """Write the units of a text as people do: ``"mN*m**2"`` becomes "mN·m²", and a minus sign a minus sign."""
    text = _EXPONENT.sub(lambda power: _power_of_ten(int(power[1])), text)
    text = _PER_LENGTH.sub("/L", _INVERSE.sub(" m⁻¹", text))
    text = _POWER.sub(lambda power: power[1].translate(_SUPERSCRIPTS), text)
    return _MINUS.sub("−", _MICRO.sub("µ", _PRODUCT.sub("·", text)))


def parameter(value: float | str) -> str:
    """Write a parameter of a law: six digits, and its unit as it is."""
    if not isinstance(value, str):
        return f"{value:.6g}"
    given = _LEADING.match(value)
    return value if given is None else f"{float(given[0]):.6g}{value[given.end() :]}"


def _power_of_ten(power: int) -> str:
    return f" × 10{str(power).translate(_SUPERSCRIPTS)}" if power else ""


def how_it_ended(solution: Solution) -> str:
    """Return the sentence of the status without what `outcome.distance`, which stands beside it, says again."""
    limit = solution.limit
    sentence = solution.status.sentence
    return sentence if limit is None else sentence.replace(limit.sentence, "").strip()


def number(value: float, digits: int = 4) -> str:
    """Write a plain number: few digits, powers of ten with superscripts."""
    if not np.isfinite(value):
        return "∞" if value > 0 else ("−∞" if value < 0 else "not a number")
    text = f"{value:.{digits}g}"
    if "e" in text:
        mantissa, power = text.split("e")
        text = mantissa + _power_of_ten(int(power))
    return _MINUS.sub("−", text)


def amount(value: float, kind: str, *, si: bool) -> str:
    """Write a value in the user's units.

    Parameters
    ----------
    value : float
        In SI, or dimensionless.
    kind : str
        A name in `plastica.physics.scales.KINDS`.
    si : bool
        Whether it is in SI.

    Returns
    -------
    str
        Such as "11.9 mm", "0.38 EI/L" or "97.3°".
    """
    if kind == "angle":
        return f"{number(float(np.degrees(value)))}°"
    if not si:
        if value == 0.0:
            return "0"
        return f"{number(value)} {SYMBOLS[kind]}".rstrip().replace(" /", "/")
    if kind == "time" and value == 86400.0:
        return "1 day"
    text = format_quantity(value, KINDS[kind][0])
    head, _, unit = text.partition(" ")
    unit = {"d": "days", "uN*m**2": "µN*m**2"}.get(unit, unit)
    return pretty(f"{number(float(head))} {unit}")


@dataclass(frozen=True)
class Writer:
    """Writes the quantities of one solution in the user's units.

    Attributes
    ----------
    solution : Solution
        Whose.
    """

    solution: Solution

    @property
    def dimensionless(self) -> bool:
        """Whether there is no specimen."""
        return self.solution.model.specimen is None

    def amount(self, value: float, kind: str) -> str:
        """Write a value (in SI with a specimen, else dimensionless) in the user's units: see `amount`."""
        return amount(value, kind, si=not self.dimensionless)

    def of_scale(self, value: float, kind: str) -> str:
        """Write a dimensionless value in the user's units."""
        return self.amount(value * float(getattr(self.solution.model.scales, KINDS[kind][1])), kind)
