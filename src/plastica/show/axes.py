"""Axes in readable units: what to divide by, what to write, and where round times lie."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from matplotlib.axes import Axes

__all__ = ["DIMENSIONLESS", "Quantity", "TimeAxis", "axis_unit"]

Array = NDArray[np.float64]

DIMENSIONLESS: Final = {
    "length": "/ L",
    "time": "/ retardation time",
    "curvature": "× L",
    "force": "× L²/EI",
    "couple": "× L/EI",
    "distributed": "× L³/EI",
    "drive": "/ EI",
    "energy": "× L/EI",
    "velocity": "× T/L",
    "ratio": "",
}
"""How a dimensionless quantity was made from one with a dimension, by kind."""

_PREFIXES: Final = ((1e6, "M"), (1e3, "k"), (1.0, ""), (1e-3, "m"), (1e-6, "µ"), (1e-9, "n"))
_PRETTY: Final = {
    "N*m**2": "N·m²",
    "N*m": "N·m",
    "1/m": "1/m",
    "N/m": "N/m",
    "J": "J",
    "N": "N",
    "W": "W",
    "W/m": "W/m",
    "W/K": "W/K",
    "J/K": "J/K",
}
_TIMES: Final = ((86400.0, "days"), (3600.0, "h"), (60.0, "min"), (1.0, "s"), (1e-3, "ms"), (1e-6, "µs"))
_ROUND_TIMES: Final = (
    *((10.0**k, f"{10 ** (k + 6)} µs") for k in (-6, -5, -4)),
    *((10.0**k, f"{10 ** (k + 3)} ms") for k in (-3, -2, -1)),
    *((1.0, "1 s"), (10.0, "10 s"), (60.0, "1 min"), (600.0, "10 min"), (3600.0, "1 h"), (36000.0, "10 h")),
    *((86400.0, "1 day"), (864000.0, "10 days"), (8640000.0, "100 days")),
    *((31557600.0 * 10**k, f"{10**k} year{'s' * (k > 0)}") for k in range(7)),
)


_SUPERSCRIPTS: Final = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")


@dataclass(frozen=True)
class Quantity:
    """A quantity on an axis: divide by `factor` and write `unit` behind it; `label` names the axis."""

    factor: float
    unit: str
    label: str

    def __call__(self, values: Any) -> Any:
        """Return the values in the unit of the axis."""
        return np.asarray(values, dtype=float) / self.factor


def axis_unit(unit: str, largest: float) -> tuple[float, str]:
    """Choose a unit in which the largest value of an axis is easy to read.

    Parameters
    ----------
    unit : str
        SI unit of the data, such as "m", "s", "rad" or "N*m**2".
    largest : float
        Largest magnitude on the axis.

    Returns
    -------
    factor : float
        What to divide the data by.
    name : str
        The unit to write: mm for lengths below 1 m, minutes to days for long times, degrees for angles.
    """
    size = abs(largest) if np.isfinite(largest) else 0.0
    if unit == "rad":
        return float(np.pi / 180.0), "°"
    if unit == "s":
        return next(((f, n) for f, n in _TIMES if size >= 2.0 * f), (1.0, "s") if size == 0.0 else _TIMES[-1])
    if unit in ("m", "m/s"):
        per = unit[1:]
        found = next((f, n) for f, n in ((1.0, "m"), (1e-3, "mm"), (1e-6, "µm")) if _fits(size, f, n, "µm", "mm"))
        return found[0], found[1] + per
    name = _PRETTY.get(unit, unit)
    if unit not in _PRETTY or not unit[0].isalpha() or size == 0.0:
        return 1.0, name
    factor, prefix = next(((f, p) for f, p in _PREFIXES if size >= f), _PREFIXES[-1])
    return factor, prefix + name


def _fits(size: float, factor: float, name: str, last: str, for_zero: str) -> bool:
    return name == for_zero if size == 0.0 else size >= factor or name == last


@dataclass(frozen=True)
class TimeAxis:
    """The axis of time that a run is drawn on.

    Attributes
    ----------
    scale : str
        "linear" or "log".
    origin : float
        Time (user's units) at which the axis begins to count: 0, or the start of a continued run on a log axis.
    factor, unit
        Divide by the factor to have the unit.
    lower, upper : float
        Limits, in that unit; on a log axis `lower` is a time before which next to nothing has happened.
    label : str
        For the axis.
    natural : str
        What times are multiples of where they are dimensionless, in words.
    """

    scale: str
    origin: float
    factor: float
    unit: str
    lower: float
    upper: float
    label: str
    natural: str = "retardation times"

    def __call__(self, t: Any) -> Array:
        """Return times (user's units) on the axis; what is earlier than a log axis begins is put at its edge."""
        shown = (np.asarray(t, dtype=float) - self.origin) / self.factor
        return np.maximum(shown, self.lower) if self.scale == "log" else shown

    def place(self, t: Any) -> Array:
        """Return where times lie on the axis, from 0 at its left end to 1."""
        low, high, x = self.lower, self.upper, self(t)
        if self.scale == "log":
            return np.asarray(np.log(x / low) / np.log(high / low))
        return (x - low) / (high - low)

    def times(self, place: Any) -> Array:
        """Return the times (user's units) at places in [0, 1] along the axis."""
        p = np.asarray(place, dtype=float)
        low, high = self.lower, self.upper
        x = low * (high / low) ** p if self.scale == "log" else low + (high - low) * p
        return x * self.factor + self.origin

    @property
    def ticks(self) -> tuple[list[float], list[str]]:
        """Where round times lie on a log axis: powers of ten, or in SI times such as 1 s, 1 min, 1 h, 1 day."""
        powers = ((10.0**k, f"10{str(k).translate(_SUPERSCRIPTS)}") for k in range(-30, 31))
        low, high = self.lower * (1.0 - 1e-9), self.upper * (1.0 + 1e-9)
        every = [(t / self.factor, words) for t, words in (_ROUND_TIMES if self.unit else powers)]
        inside = [(place, words) for place, words in every if low <= place <= high]
        kept = inside[:: -(-len(inside) // 8)] if inside else []
        return [place for place, _ in kept], [words for _, words in kept]

    def apply(self, ax: Axes, *, label: bool = True) -> None:
        """Give an axes this axis of time."""
        if self.scale == "log":
            ax.set_xscale("log")
            places, words = self.ticks
            if len(places) > 1:
                ax.set_xticks(places, words)
                ax.minorticks_off()
        ax.set_xlim(self.lower, self.upper)
        if label:
            ax.set_xlabel(self.label)

    def brief(self, t: float) -> str:
        """Write a time as a mark on this axis: three digits, with a unit of its own on a log axis in SI."""
        shown = (t - self.origin) / self.factor
        if self.scale == "log" and self.unit:
            factor, name = axis_unit("s", t - self.origin)
            return f"{(t - self.origin) / factor:.3g} {name}"
        return f"{shown:.0f}" if abs(shown) >= 100.0 else f"{shown:.3g}"

    def words(self, t: float) -> str:
        """Write a time (user's units) for people, in a unit that suits it."""
        if self.unit == "":
            return f"{t:.4g} {self.natural}"
        factor, name = axis_unit("s", t)
        return f"{t / factor:.4g} {name}"

    def clock(self, t: float) -> str:
        """Write a time (user's units) as a clock would: "14 h 14 min", "1 d 0 h 20 min", "300 d 4 h"."""
        if self.unit == "" or abs(t) < 60.0:
            return f"t = {t:.4g}" if self.unit == "" else self.words(t)
        smallest = next(size for limit, size in ((3600.0, 1), (864000.0, 60), (np.inf, 3600)) if t < limit)
        words: list[str] = []
        rest = round(t / smallest) * smallest
        for size, name in ((86400, "d"), (3600, "h"), (60, "min"), (1, "s")):
            if size >= smallest and (words or rest >= size):
                words.append(f"{rest // size} {name}")
                rest %= size
        while words[-1].startswith("0 "):
            words.pop()
        return " ".join(words)
