"""A piecewise linear function of time with jumps: its one-sided values, knots, variation and range."""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Final, Literal

import numpy as np
from numpy.typing import NDArray

from plastica.errors import ArgumentError

__all__ = ["MAX_KNOTS", "Array", "Knot", "Piece", "Polyline", "near", "too_many_knots"]

Array = NDArray[np.float64]

Piece = float | Callable[[float], float]
"""A program on an interval without jumps: a number where it is constant, else a continuous function."""

MAX_KNOTS: Final = 100_000
_EPS: Final = float(np.finfo(float).eps)


@dataclass(frozen=True, order=True)
class Knot:
    """A time at which a load program jumps or changes its slope.

    Parameters
    ----------
    t : float
        The time.
    kind : str
        "jump" if the value jumps, "slope" if it is continuous there.
    size : float
        The jump of the value, or that of the slope. Where a smooth train of waves begins or ends, the
        greatest slope in it, so that a long step does not pass over the train.
    """

    t: float
    kind: Literal["jump", "slope"]
    size: float


def near(t: float) -> float:
    """Return the distance below which two times near `t` count as one: 16 units in the last place."""
    return 16.0 * float(np.spacing(abs(t)))


@dataclass(frozen=True, eq=False)
class Polyline:
    """A piecewise linear function, right-continuous, constant before its first and after its last row.

    Parameters
    ----------
    times : array, shape (n,)
        Strictly increasing.
    left, right : array, shape (n,)
        The limits from the left and from the right at these times.

    Raises
    ------
    ArgumentError
        If a slope is too steep for a double.
    """

    times: Array
    left: Array
    right: Array

    def __post_init__(self) -> None:
        if not np.isfinite(self.slopes).all():
            rule = "must not change so steeply"
            raise ArgumentError(rule, where="values", next_step="Give the same time twice for a jump.")

    @classmethod
    def from_rows(cls, times: Array, values: Array) -> Polyline:
        """Make the function of rows (time, value) in order of time; a time given twice is a jump."""
        first = np.flatnonzero(np.diff(times, prepend=-np.inf) > 0.0)
        last = np.append(first[1:], len(times)) - 1
        return cls(times[first], values[first], values[last])

    @cached_property
    def slopes(self) -> Array:
        """Slopes of the n + 1 pieces: before the first row, between rows, after the last."""
        with np.errstate(all="ignore"):
            inner = (self.left[1:] - self.right[:-1]) / np.diff(self.times)
        return np.concatenate(([0.0], inner, [0.0]))

    def anchor(self, piece: int) -> tuple[float, float, float]:
        """Return (t₀, v, slope) of a piece: its value is v + slope·(t − t₀)."""
        row = max(piece - 1, 0)
        value = self.right[row] if piece else self.left[0]
        return float(self.times[row]), float(value), float(self.slopes[piece])

    def at(self, t: Array) -> Array:
        """Evaluate; right-continuous.

        Parameters
        ----------
        t : array of any shape
            Times.

        Returns
        -------
        array of the same shape
            The values; exact at the rows.
        """
        piece = np.searchsorted(self.times, t, side="right")
        row = np.maximum(piece - 1, 0)
        return self._along(t, piece, row, np.where(piece > 0, self.right[row], self.left[0]))

    def before(self, t: Array) -> Array:
        """Evaluate the limit from the left; exact at the rows.

        Parameters
        ----------
        t : array of any shape
            Times.

        Returns
        -------
        array of the same shape
            The limits.
        """
        piece = np.searchsorted(self.times, t, side="left")
        row = np.maximum(piece - 1, 0)
        values = self._along(t, piece, row, np.where(piece > 0, self.right[row], self.left[0]))
        following = np.minimum(piece, len(self.times) - 1)
        return np.where(self.times[following] == t, self.left[following], values)

    def _along(self, t: Array, piece: NDArray[np.intp], row: NDArray[np.intp], start: Array) -> Array:
        slope = self.slopes[piece]
        # An infinite time lies on a flat piece, where 0·∞ would spoil the value.
        step = np.where(slope != 0.0, t, self.times[row]) - self.times[row]
        value: Array = start + slope * step
        return value

    def on(self, a: float, b: float) -> Piece:
        """Return the function on [a, b], with the right limit at a and the left limit at b.

        Parameters
        ----------
        a, b : float
            Ends of an interval without a jump inside; rows within rounding of an end count as at the end.

        Returns
        -------
        float or callable
            A number where it is constant, else a function of one float.

        Raises
        ------
        ArgumentError
            If there is a jump inside.
        """
        first = int(np.searchsorted(self.times, a + near(a), side="right"))
        last = max(int(np.searchsorted(self.times, b - near(b), side="left")), first)
        inside = slice(first, last)
        if (self.left[inside] != self.right[inside]).any():
            raise ArgumentError("must hold no jump inside", where="interval", value=(a, b))
        pieces = [self.anchor(piece) for piece in range(first, last + 1)]
        if all(slope == 0.0 for _, _, slope in pieces):
            return pieces[0][1]
        if len(pieces) == 1:
            return _line(*pieces[0])
        return _lines([float(t) for t in self.times[inside]], pieces)

    def knots(self, until: float) -> tuple[Knot, ...]:
        """Return the jumps and changes of slope in (0, until], in order.

        Parameters
        ----------
        until : float
            End of the run; may be infinite.

        Returns
        -------
        tuple of Knot
            A change of slope too small to be told from rounding is no knot.

        Raises
        ------
        ArgumentError
            If there are more than 100 000.
        """
        jump = self.right - self.left
        turn = np.diff(self.slopes)
        gap = np.diff(self.times, prepend=-math.inf, append=math.inf)
        width = np.minimum(np.minimum(gap[:-1], gap[1:]), 1.0 + np.abs(self.times))
        visible = np.abs(turn) * width > 4.0 * _EPS * np.maximum(np.abs(self.left), np.abs(self.right))
        chosen = (self.times > 0.0) & (self.times <= until) & ((jump != 0.0) | visible)
        if np.count_nonzero(chosen) > MAX_KNOTS:
            raise too_many_knots()
        return tuple(
            Knot(float(self.times[i]), "jump", float(jump[i]))
            if jump[i] != 0.0
            else Knot(float(self.times[i]), "slope", float(turn[i]))
            for i in np.flatnonzero(chosen)
        )

    @property
    def settled(self) -> float:
        """The time, at least 0, from which on the value is constant."""
        changing = (self.left != self.right) | (self.slopes[:-1] != 0.0)
        return max(float(self.times[changing].max(initial=0.0)), 0.0)

    def variation(self, until: float) -> float:
        """Return the total variation on [0, until], jumps included."""
        path = self._path(until)
        return math.fsum(np.abs(np.diff(path)))

    def extreme(self, until: float) -> tuple[float, float]:
        """Return the least and the greatest value on [0, until], both limits at a jump included."""
        path = self._path(until)
        return float(path.min()), float(path.max())

    def _path(self, until: float) -> Array:
        """Return the values through which the function runs from 0 to `until`."""
        inside = (self.times > 0.0) & (self.times <= until)
        rows = np.column_stack((self.left[inside], self.right[inside])).ravel()
        return np.concatenate((self.at(np.zeros(1)), rows, self.at(np.array([until]))))


def too_many_knots() -> ArgumentError:
    """Return the error for a program whose jumps and changes of slope are too many to land on."""
    return ArgumentError(
        f"must have at most {MAX_KNOTS} jumps and changes of slope during the run",
        where="program",
        next_step="Thin the table, take fewer cycles or a shorter run.",
    )


def _line(t0: float, value: float, slope: float) -> Callable[[float], float]:
    return lambda t: value + slope * (t - t0)


def _lines(times: list[float], pieces: list[tuple[float, float, float]]) -> Callable[[float], float]:
    def value(t: float) -> float:
        t0, start, slope = pieces[bisect_right(times, t)]
        return start + slope * (t - t0)

    return value
