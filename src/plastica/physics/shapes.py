"""Load programs made of straight pieces: constant, table, ramp–hold–release, cycles."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property
from typing import ClassVar, Final, final

import numpy as np

from plastica.errors import ArgumentError
from plastica.physics.polyline import MAX_KNOTS, Array, Knot, Polyline, too_many_knots
from plastica.physics.program import Polygonal, finite_fields, time_words, value_words
from plastica.physics.waves import check_train, train_words

__all__ = ["LARGEST_TABLE", "Constant", "Cycles", "RampHoldRelease", "Table"]

LARGEST_TABLE: Final = 1_000_000


@final
@dataclass(frozen=True, repr=False)
class Constant(Polygonal):
    """A load that does not change."""

    kind: ClassVar[str] = "constant"
    value: float

    def _validate(self) -> None:
        finite_fields(self, ("value",))

    @cached_property
    def _polyline(self) -> Polyline:
        return Polyline(np.zeros(1), np.full(1, self.value), np.full(1, self.value))

    def _scaled(self, time: float, value: float) -> Constant:
        return replace(self, value=self.value / value)

    def rows(self, a: float, b: float) -> Polyline:
        """Return one row; see `Polygonal.rows`."""
        return self._polyline

    # Most loads are constant and are asked often: what needs no rows is answered without them.

    @cached_property
    def constant(self) -> bool:
        """True."""
        return True

    def extreme(self, until: float) -> tuple[float, float]:
        """Return the value twice; see `Program.extreme`."""
        return self.value, self.value

    def knots(self, until: float) -> tuple[Knot, ...]:
        """Return none; see `Program.knots`."""
        return ()

    def on(self, a: float, b: float) -> float:
        """Return the value; see `Program.on`."""
        return self.value

    def describe(self, value_unit: str = "", time_unit: str = "") -> str:
        """Say in words what the program does; see `Program.describe`."""
        return value_words(self.value, self.value_unit or value_unit)


@final
@dataclass(frozen=True, repr=False)
class Table(Polygonal):
    """Rows (time, value), linear between them; a time given twice is a jump; constant beyond the ends."""

    kind: ClassVar[str] = "table"
    times: tuple[float, ...]
    values: tuple[float, ...]

    def _validate(self) -> None:
        t, values = _numbers(self.times, "times"), _numbers(self.values, "values")
        if not 1 <= len(t) <= LARGEST_TABLE:
            raise ArgumentError(f"must have 1 to {LARGEST_TABLE} rows", where="times", value=len(t))
        if len(t) != len(values):
            rule = f"must have as many entries as `times`, {len(t)}"
            raise ArgumentError(rule, where="values", value=len(values))
        _check_order(t)
        object.__setattr__(self, "times", tuple(t.tolist()))
        object.__setattr__(self, "values", tuple(values.tolist()))
        _ = self._polyline.slopes

    @cached_property
    def _polyline(self) -> Polyline:
        return Polyline.from_rows(np.array(self.times), np.array(self.values))

    def _scaled(self, time: float, value: float) -> Table:
        with np.errstate(over="ignore"):
            times, values = np.array(self.times) / time, np.array(self.values) / value
        return replace(self, times=tuple(times.tolist()), values=tuple(values.tolist()))

    def rows(self, a: float, b: float) -> Polyline:
        """Return the rows; see `Polygonal.rows`."""
        return self._polyline

    def describe(self, value_unit: str = "", time_unit: str = "") -> str:
        """Say in words what the program does; see `Program.describe`."""
        value, time = self.value_unit or value_unit, self.time_unit or time_unit
        low, high = (value_words(each, value) for each in (min(self.values), max(self.values)))
        first, last = (time_words(each, time) for each in (self.times[0], self.times[-1]))
        rows = f"{len(self.times)} row{'s' if len(self.times) > 1 else ''}"
        return f"table of {rows} from {first} to {last}, between {low} and {high}"


@final
@dataclass(frozen=True, repr=False)
class RampHoldRelease(Polygonal):
    """From `rest` to `value` within `ramp`, held for `hold`, back to `rest` within `release`."""

    kind: ClassVar[str] = "ramp_hold_release"
    value: float
    ramp: float
    hold: float
    release: float
    start: float = 0.0
    rest: float = 0.0

    def _validate(self) -> None:
        durations = ("ramp", "hold", "release", "start")
        finite_fields(self, ("value", "rest", *durations))
        for name in durations:
            if getattr(self, name) < 0.0:
                raise ArgumentError("must not be negative", where=name, value=getattr(self, name))
        if self.ramp + self.hold + self.release <= 0.0:
            rule = "must be positive where ramp and release are 0"
            raise ArgumentError(rule, where="hold", value=self.hold)
        if not math.isfinite(self.start + self.ramp + self.hold + self.release):
            raise ArgumentError("must end at a finite time", where="hold", value=self.hold)
        _ = self._polyline.slopes

    @cached_property
    def _polyline(self) -> Polyline:
        times = np.cumsum([self.start, self.ramp, self.hold, self.release])
        return Polyline.from_rows(times, np.array([self.rest, self.value, self.value, self.rest]))

    def _scaled(self, time: float, value: float) -> RampHoldRelease:
        return replace(
            self,
            value=self.value / value,
            rest=self.rest / value,
            ramp=self.ramp / time,
            hold=self.hold / time,
            release=self.release / time,
            start=self.start / time,
        )

    def rows(self, a: float, b: float) -> Polyline:
        """Return the four corners; see `Polygonal.rows`."""
        return self._polyline

    def describe(self, value_unit: str = "", time_unit: str = "") -> str:
        """Say in words what the program does; see `Program.describe`."""
        value, time = self.value_unit or value_unit, self.time_unit or time_unit
        words = value_words(self.value, value)
        words += f" reached within {time_words(self.ramp, time)}," if self.ramp else ""
        words += f" held for {time_words(self.hold, time)}"
        words += f", then back to {value_words(self.rest, value)}" if self.rest else ", then released"
        words += f" within {time_words(self.release, time)}" if self.release else ""
        return words + (f", from {time_words(self.start, time)} on" if self.start else "")


# One cycle as corners, evenly spaced: the values, from 0 (low) to 1 (high), before and after each.
_SHAPES: Final[dict[str, tuple[tuple[int, int], ...]]] = {
    "triangle": ((0, 0), (1, 1)),
    "square": ((0, 1), (1, 0)),
    "trapezoid": ((0, 0), (1, 1), (1, 1), (0, 0)),
}


@final
@dataclass(frozen=True, repr=False)
class Cycles(Polygonal):
    """Cycles of straight pieces between `low` and `high`; at `low` before them and after `count` of them."""

    kind: ClassVar[str] = "cycles"
    low: float
    high: float
    period: float
    count: int | None = None
    shape: str = "triangle"
    start: float = 0.0

    def _validate(self) -> None:
        if not isinstance(self.shape, str) or self.shape not in _SHAPES:
            raise ArgumentError(f"must be one of {', '.join(_SHAPES)}, sine", where="shape", value=self.shape)
        check_train(self)
        if not math.isfinite((self.high - self.low) / self.period):
            raise ArgumentError("must not change so steeply", where="high", value=self.high)

    def _scaled(self, time: float, value: float) -> Cycles:
        return replace(
            self,
            low=self.low / value,
            high=self.high / value,
            period=self.period / time,
            start=self.start / time,
        )

    def rows(self, a: float, b: float) -> Polyline:
        """Return the corners from before a to after b; see `Polygonal.rows`."""
        corners = np.array(_SHAPES[self.shape])
        step, last = self.period / len(corners), len(corners) * (self.count or math.inf)
        # One corner more than needed on either side absorbs the rounding of these divisions.
        k_min = min(max(math.floor((a - self.start) / step) - 1, 0), last) if a > self.start else 0
        k_max = min(max((b - self.start) / step, 0.0) + 2.0, last)
        if k_max - k_min > MAX_KNOTS + 8:
            raise too_many_knots()
        k = np.arange(int(k_min), int(k_max) + 1)
        levels = corners[k % len(corners)] * (self.high - self.low) + self.low
        left, right = levels[:, 0], levels[:, 1]
        right[k == last] = self.low
        times: Array = self.start + k.astype(np.float64) * step
        return Polyline(times, left, right)

    @property
    def settled(self) -> float | None:
        """The end of the last cycle; None if they never end."""
        if self.constant:
            return 0.0
        return None if self.count is None else super().settled

    def extreme(self, until: float) -> tuple[float, float]:
        """Return the least and the greatest value on [0, until], exactly."""
        if until >= self.start + self.period:
            return min(self.low, self.high), max(self.low, self.high)
        return super().extreme(until)

    def describe(self, value_unit: str = "", time_unit: str = "") -> str:
        """Say in words what the program does; see `Program.describe`."""
        return train_words(self, self.shape, self.value_unit or value_unit, self.time_unit or time_unit)


def _numbers(values: object, where: str) -> Array:
    plain = isinstance(values, tuple) and all(type(each) in (float, int) for each in values)
    if not plain:
        raise ArgumentError("must be a sequence of numbers", where=where, value=values)
    array = np.array(values, dtype=float) + 0.0
    if not np.isfinite(array).all():
        raise ArgumentError("must be finite", where=where, value=float(array[~np.isfinite(array)][0]))
    return array


def _check_order(t: Array) -> None:
    steps = np.diff(t)
    close = 32.0 * np.spacing(np.abs(t[1:]))
    wrong = (steps < 0.0) | ((steps > 0.0) & (steps < close))
    wrong[1:] |= (steps[1:] == 0.0) & (steps[:-1] == 0.0)
    if wrong.any():
        row = int(np.argmax(wrong)) + 1
        rule = "must increase, with a time at most twice in a row (a jump)"
        at = f"{t[row]:.17g} after {t[row - 1]:.17g} at row {row + 1}"
        raise ArgumentError(f"{rule}, but has {at}", where="times")
