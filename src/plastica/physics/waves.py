"""Load programs that are trains of sine waves, and what all trains of cycles have in common."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any, ClassVar, Final, final

import numpy as np

from plastica.errors import ArgumentError
from plastica.physics.polyline import Array, Knot, Piece
from plastica.physics.program import Program, finite_fields, time_words, value_words

__all__ = ["LARGEST_COUNT", "Sine", "check_train", "train_words"]

LARGEST_COUNT: Final = 1_000_000
_TRAIN: Final = ("low", "high", "period", "start")


def check_train(program: Any) -> None:
    """Refuse impossible cycles: a period that is not positive or is lost beside the start, an absurd count.

    Parameters
    ----------
    program : Sine or Cycles
        The program, during its construction.

    Raises
    ------
    ArgumentError
        If a field is out of range.
    """
    finite_fields(program, _TRAIN)
    if program.start < 0.0:
        raise ArgumentError("must not be negative", where="start", value=program.start)
    if not program.period >= max(1e-9 * program.start, 1e-300):
        rule = "must be positive, and at least 1e-9 of the start"
        raise ArgumentError(rule, where="period", value=program.period)
    count = program.count
    if count is not None and (type(count) is not int or not 1 <= count <= LARGEST_COUNT):
        raise ArgumentError(f"must be a whole number from 1 to {LARGEST_COUNT}", where="count", value=count)
    if not math.isfinite(program.start + program.period * (count or 1) * 4.0):
        raise ArgumentError("must end at a finite time", where="period", value=program.period)


def train_words(program: Any, shape: str, value_unit: str, time_unit: str) -> str:
    """Say in words what a train of cycles does.

    Parameters
    ----------
    program : Sine or Cycles
        The program.
    shape : str
        The form of one cycle.
    value_unit, time_unit : str
        Units of the numbers, "" for none.

    Returns
    -------
    str
        Such as "10 triangle cycles of 1 h between 0 N and 3 N".
    """
    low, high = (value_words(each, value_unit) for each in (program.low, program.high))
    count = "endless" if program.count is None else str(program.count)
    noun = "cycle" if program.count == 1 else "cycles"
    after = f", from {time_words(program.start, time_unit)} on" if program.start else ""
    return f"{count} {shape} {noun} of {time_words(program.period, time_unit)} between {low} and {high}{after}"


@final
@dataclass(frozen=True, repr=False)
class Sine(Program):
    """A train of waves low + (high − low)(1 − cos 2π(t − start)/period)/2; low before and after it.

    Parameters
    ----------
    low, high : float
        Least and greatest value.
    period : float
        Length of a wave.
    count : int or None
        How many waves; None for ever.
    start : float
        When they begin.

    Raises
    ------
    ArgumentError
        If a number is out of range.
    """

    kind: ClassVar[str] = "sine"
    low: float
    high: float
    period: float
    count: int | None = None
    start: float = 0.0

    def _validate(self) -> None:
        check_train(self)

    def _scaled(self, time: float, value: float) -> Sine:
        return replace(
            self,
            low=self.low / value,
            high=self.high / value,
            period=self.period / time,
            start=self.start / time,
        )

    @property
    def _end(self) -> float:
        return math.inf if self.count is None else self.start + self.count * self.period

    def _values(self, t: Array) -> Array:
        waves = (np.clip(t, self.start, self._end) - self.start) / self.period
        return self.low + (self.high - self.low) * (0.5 - 0.5 * np.cos(2.0 * np.pi * (waves % 1.0)))

    def _values_before(self, t: Array) -> Array:
        return self._values(t)

    @property
    def constant(self) -> bool:
        """Whether low and high are the same."""
        return self.low == self.high

    @property
    def settled(self) -> float | None:
        """The end of the last wave; None if they never end."""
        if self.constant:
            return 0.0
        return None if self.count is None else self._end

    def on(self, a: float, b: float) -> Piece:
        """Return the program on [a, b]; see `Program.on`."""
        low, start, end, period = self.low, self.start, self._end, self.period
        half, cos, turn = 0.5 * (self.high - self.low), math.cos, 2.0 * math.pi
        if self.constant or b <= start or a >= end:
            return low
        if start <= a and b <= end:
            return lambda t: low + half * (1.0 - cos(turn * ((t - start) / period % 1.0)))
        return lambda t: low + half * (1.0 - cos(turn * ((min(max(t, start), end) - start) / period % 1.0)))

    def knots(self, until: float) -> tuple[Knot, ...]:
        """Return the begin and the end of the train; see `Program.knots` and `Knot`."""
        steepest = math.pi * (self.high - self.low) / self.period
        ends = ((self.start, steepest), (self._end, -steepest))
        return tuple(Knot(t, "slope", size) for t, size in ends if 0.0 < t <= until and size)

    def paces(self, points: Sequence[float]) -> list[float]:
        """Return an eighth of the period where there are waves; see `Program.paces`."""
        waving = [a < self._end and b > self.start for a, b in pairwise(points)]
        return [self.period / 8.0 if each else math.inf for each in waving]

    def variation(self, until: float) -> float:
        """Return the total variation on [0, until], exactly."""
        waves = max(min(until, self._end) - self.start, 0.0) / self.period
        halves = math.floor(2.0 * waves)
        rest = 0.5 - 0.5 * math.cos(math.pi * (2.0 * waves - halves))
        return abs(self.high - self.low) * (halves + rest)

    def extreme(self, until: float) -> tuple[float, float]:
        """Return the least and the greatest value on [0, until], exactly."""
        reached = self.high if until >= self.start + 0.5 * self.period else self(until)
        return min(self.low, reached), max(self.low, reached)

    def describe(self, value_unit: str = "", time_unit: str = "") -> str:
        """Say in words what the program does; see `Program.describe`."""
        return train_words(self, "sine", self.value_unit or value_unit, self.time_unit or time_unit)
