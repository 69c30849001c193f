"""What every load program is: a function of time with known jumps, to be scaled, stored and described."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, fields, replace
from functools import cached_property
from typing import Any, ClassVar, Final, Self, overload

import numpy as np
from numpy.typing import ArrayLike

from plastica.errors import ArgumentError
from plastica.physics.amounts import plain
from plastica.physics.polyline import Array, Knot, Piece, Polyline
from plastica.units import format_quantity

__all__ = ["BURST", "LOAD_UNITS", "Polygonal", "Program", "finite_fields", "known_keys", "time_words", "value_words"]

LOAD_UNITS: Final = ("N", "N*m", "N/m")
"""Units that the values of a program may have: force, couple, force per length."""

BURST: Final = 20.0
"""How many times farther the next knot must be for a knot to be the end of a burst."""

_LONGER: Final = ((86400.0, "day"), (3600.0, "h"), (60.0, "min"))


@dataclass(frozen=True, kw_only=True)
class Program(ABC):
    """A function of time t ≥ 0: right-continuous, with finitely many jumps in any finite time.

    A program holds plain numbers. Which they are (SI or dimensionless) is said by the model that uses it; a
    program that was written with units remembers them, is in SI, and needs a specimen.

    Parameters
    ----------
    value_unit : str
        "N", "N*m" or "N/m" if the values were given with a unit, else "".
    time_unit : str
        "s" if times were given with a unit, else "".
    """

    kind: ClassVar[str]
    value_unit: str = ""
    time_unit: str = ""

    def __post_init__(self) -> None:
        if self.value_unit not in ("", *LOAD_UNITS) or self.time_unit not in ("", "s"):
            rule = f"must be of {', '.join(LOAD_UNITS)} over s"
            raise ArgumentError(rule, where="units", value=(self.value_unit, self.time_unit))
        self._validate()

    def __repr__(self) -> str:
        return f"<{self.kind}: {self.describe()}>"

    def __getstate__(self) -> dict[str, Any]:
        # What is compiled or computed on demand stays here when the program goes to another process.
        return {each.name: getattr(self, each.name) for each in fields(self)}

    @abstractmethod
    def _validate(self) -> None:
        """Refuse impossible data."""

    @property
    def has_units(self) -> bool:
        """Whether it was written with units, and so needs a specimen."""
        return bool(self.value_unit or self.time_unit)

    @abstractmethod
    def _scaled(self, time: float, value: float) -> Self:
        """Divide times and values."""

    def scaled(self, time_scale: float, value_scale: float) -> Self:
        """Return the program in other units: p̄(t̄) = p(t̄ · time_scale) / value_scale (design, section 1.1).

        Parameters
        ----------
        time_scale, value_scale : float
            The units of time (positive) and of the value (not 0) in the units of this program.

        Returns
        -------
        Program
            A program of the same kind, in plain numbers.

        Raises
        ------
        ArgumentError
            If a number leaves the range of doubles.
        """
        return replace(self._scaled(time_scale, value_scale), value_unit="", time_unit="")

    def multiplied(self, factor: float) -> Self:
        """Return the program with its values multiplied by a factor that is not 0; units stay."""
        return self._scaled(1.0, 1.0 / factor)

    def mirrored(self) -> Self:
        """Return the program with the opposite sign."""
        return self.multiplied(-1.0)

    @abstractmethod
    def _values(self, t: Array) -> Array:
        """Evaluate at an array of times; right-continuous."""

    @abstractmethod
    def _values_before(self, t: Array) -> Array:
        """Evaluate the limits from the left."""

    @overload
    def __call__(self, t: float) -> float: ...
    @overload
    def __call__(self, t: ArrayLike) -> Any: ...
    def __call__(self, t: ArrayLike) -> Any:
        """Evaluate at one time or an array of times; right-continuous."""
        return _shaped(self._values, t)

    @overload
    def before(self, t: float) -> float: ...
    @overload
    def before(self, t: ArrayLike) -> Any: ...
    def before(self, t: ArrayLike) -> Any:
        """Evaluate the limit from the left at one time or an array of times."""
        return _shaped(self._values_before, t)

    @property
    @abstractmethod
    def constant(self) -> bool:
        """Whether the value is the same at all t ≥ 0."""

    @property
    @abstractmethod
    def settled(self) -> float | None:
        """The time, at least 0, from which on the value is constant; None if it never is."""

    @abstractmethod
    def on(self, a: float, b: float) -> Piece:
        """Return the program on [a, b], with the right limit at a and the left limit at b.

        Parameters
        ----------
        a, b : float
            Ends of an interval that has no jump inside. Jumps within rounding of an end count as at the end.

        Returns
        -------
        float or callable
            A number where it is constant, else a continuous function of one float, made to be called often.

        Raises
        ------
        ArgumentError
            If there is a jump inside.
        """

    @abstractmethod
    def knots(self, until: float) -> tuple[Knot, ...]:
        """Return the jumps and changes of slope in (0, until], in order and distinct.

        Parameters
        ----------
        until : float
            End of the run.

        Returns
        -------
        tuple of Knot
            At most 100 000.

        Raises
        ------
        ArgumentError
            If there are more.
        """

    def bursts(self, until: float) -> tuple[float, ...]:
        """Return times in (0, until) at which a stretch begins or ends in which the load changes much faster.

        An integrator that lands on them cannot step over a pulse on an otherwise quiet load.
        """
        return ()

    def paces(self, points: Sequence[float]) -> list[float]:
        """Return the longest step between each two of `points` that overlooks no change; infinite if any will do."""
        return [math.inf] * (len(points) - 1)

    def hidden(self, until: float) -> tuple[tuple[float, float], ...]:
        """Return intervals in [0, until] where a change may be too short for `paces`; none where all are known."""
        return ()

    @abstractmethod
    def variation(self, until: float) -> float:
        """Return the total variation on [0, until], jumps included; an upper estimate for text.

        Parameters
        ----------
        until : float
            End of the run.

        Returns
        -------
        float
            The variation, not negative.
        """

    @abstractmethod
    def extreme(self, until: float) -> tuple[float, float]:
        """Return the least and the greatest value on [0, until]; sampled for text.

        Parameters
        ----------
        until : float
            End of the run; infinite for all times, except for text.

        Returns
        -------
        tuple of float
            Least and greatest.

        Raises
        ------
        ArgumentError
            If the program is not finite throughout.
        """

    @abstractmethod
    def describe(self, value_unit: str = "", time_unit: str = "") -> str:
        """Say in words what the program does.

        Parameters
        ----------
        value_unit, time_unit : str
            The units of its numbers, if it has none of its own; "" for plain numbers.

        Returns
        -------
        str
            Such as "3 N held for 1 day, then released".
        """

    def to_dict(self) -> dict[str, Any]:
        """Return what `plastica.physics.programs.from_dict` takes, ready for JSON."""
        given = {each.name: getattr(self, each.name) for each in fields(self) if each.init}
        given = {name: _as_json(value) for name, value in given.items() if value != ""}
        return {"kind": self.kind, **given}


class Polygonal(Program):
    """A program that is piecewise linear: all is read from its rows."""

    @abstractmethod
    def rows(self, a: float, b: float) -> Polyline:
        """Return a piecewise linear function that equals the program on [a, b], both limits included."""

    def _values(self, t: Array) -> Array:
        return self._over(t).at(t)

    def _values_before(self, t: Array) -> Array:
        return self._over(t).before(t)

    def _over(self, t: Array) -> Polyline:
        return self.rows(float(t.min()), float(t.max())) if t.size else self.rows(0.0, 0.0)

    @cached_property
    def constant(self) -> bool:
        """Whether the value is the same at all t ≥ 0."""
        least, greatest = self.extreme(math.inf)
        return least == greatest

    @property
    def settled(self) -> float | None:
        """The time, at least 0, from which on the value is constant."""
        return self.rows(0.0, math.inf).settled

    def on(self, a: float, b: float) -> Piece:
        """Return the program on [a, b]; see `Program.on`."""
        return self.rows(a, b).on(a, b)

    def knots(self, until: float) -> tuple[Knot, ...]:
        """Return the jumps and changes of slope in (0, until]; see `Program.knots`."""
        return self.rows(0.0, until).knots(until)

    def bursts(self, until: float) -> tuple[float, ...]:
        """Return the knots whose neighbours are more than 20 times nearer on one side; see `Program.bursts`."""
        times = np.array([0.0, *(knot.t for knot in self.knots(until)), until])
        gaps = np.diff(times)
        if gaps.size < 3:
            return ()
        least, most = np.minimum(gaps[:-1], gaps[1:]), np.maximum(gaps[:-1], gaps[1:])
        return tuple(times[1:-1][most > BURST * least].tolist())

    def paces(self, points: Sequence[float]) -> list[float]:
        """Return four times the largest gap between knots, where there are knots inside; see `Program.paces`."""
        times = np.array([knot.t for knot in self.knots(points[-1])])
        first = np.searchsorted(times, points[:-1], side="right")
        last = np.searchsorted(times, points[1:], side="left")
        return [
            4.0 * float(np.diff([a, *times[i:j], b]).max()) if j > i else math.inf
            for a, b, i, j in zip(points[:-1], points[1:], first, last, strict=True)
        ]

    def variation(self, until: float) -> float:
        """Return the total variation on [0, until], exactly."""
        return self.rows(0.0, until).variation(until)

    def extreme(self, until: float) -> tuple[float, float]:
        """Return the least and the greatest value on [0, until], exactly."""
        return self.rows(0.0, until).extreme(until)


def _shaped(evaluate: Any, t: ArrayLike) -> Any:
    times = np.asarray(t, dtype=float)
    values = evaluate(np.atleast_1d(times))
    return float(values[0]) if times.ndim == 0 else values


def _as_json(value: object) -> object:
    return [_as_json(each) for each in value] if isinstance(value, tuple) else value


def finite_fields(program: Program, names: Iterable[str]) -> None:
    """Turn the named fields of a program into floats, and refuse what is no finite number.

    Parameters
    ----------
    program : Program
        The program, during its construction.
    names : iterable of str
        Fields that hold one number each.

    Raises
    ------
    ArgumentError
        If a field is not a finite number.
    """
    for name in names:
        value = plain(getattr(program, name))
        if not isinstance(value, float) or not math.isfinite(value):
            raise ArgumentError("must be a finite number", where=name, value=value)
        object.__setattr__(program, name, value + 0.0)


def value_words(value: float, unit: str) -> str:
    """Write a load for people: "3 N", or "3" without a unit."""
    return format_quantity(value, unit) if unit else f"{value:.4g}"


def time_words(time: float, unit: str) -> str:
    """Write a duration for people: "1 day", "90 s"; "100" without a unit."""
    if not unit:
        return f"{time:.4g}"
    for size, name in _LONGER:
        if time >= size and math.isclose(time / size, float(f"{time / size:.3g}"), rel_tol=1e-12):
            count = f"{time / size:.3g}"
            return f"{count} {name}{'s' if name == 'day' and count != '1' else ''}"
    return format_quantity(time, unit)


def known_keys(data: Mapping[str, Any], allowed: Iterable[str], where: str) -> None:
    """Refuse a mapping that has keys that are not known.

    Parameters
    ----------
    data : mapping
        What a file held.
    allowed : iterable of str
        The keys that may be there.
    where : str
        What the mapping describes, for messages.

    Raises
    ------
    ArgumentError
        If there is another key.
    """
    names = sorted(allowed)
    unknown = [str(key) for key in data if key not in names]
    if unknown:
        raise ArgumentError(f"must have no keys but {', '.join(names)}", where=where, value=", ".join(unknown))
