"""The dead loads of a rod: thrust, transverse force, couple and weight, each a program in time."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, fields
from functools import cached_property
from types import MappingProxyType
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from plastica.errors import ArgumentError, PlasticaError
from plastica.physics import programs
from plastica.physics.amounts import Amount, finite, plain
from plastica.physics.polyline import MAX_KNOTS, Knot, near, too_many_knots
from plastica.physics.program import Program
from plastica.physics.scales import KINDS, Scales
from plastica.physics.text import Text
from plastica.units import looks_like_quantity

__all__ = ["LOAD_KINDS", "Given", "Knot", "Load", "Program"]

Given = float | str | tuple[Sequence[Any], Sequence[Any]] | Sequence[Any] | NDArray[Any] | Program
"""What a load may be given as: a number, text, a pair (times, values), or a program."""

LOAD_KINDS: Final[Mapping[str, str]] = MappingProxyType(
    {"thrust": "force", "transverse": "force", "couple": "couple", "weight": "distributed"}
)
"""The loads: name → kind of quantity in `plastica.physics.scales.KINDS`."""


_PUSHES: Final = ("thrust", "weight")
"""Loads toward the clamp: negative they are tension along the rod, which must be asked for."""

_QUARTER: Final = 0.5 * math.pi

# A thrust such as 0.3 - 0.1 - 0.2*cos(t) is 0 at its least but for rounding.
_ROUNDING: Final = 64.0 * float(np.finfo(float).eps)


@dataclass(frozen=True, init=False)
class Load:
    """The dead loads on the free end and along the rod (design, section 1.2).

    Each is a number; a pair (times, values) of sequences, linear between rows, where a time given twice is a
    jump; text with a unit ("3 N") or in t ("1 + sin(t)"); or a program from `plastica.programs`. With a
    specimen numbers are SI, without one dimensionless.

    Parameters
    ----------
    thrust : Given
        β, along the clamp's tangent and toward the clamp, in N; not negative.
    transverse : Given
        τ, across, in N.
    couple : Given
        m₁ at the free end, in N m.
    weight : Given
        w, a force per length toward the clamp, in N/m; not negative.
    weight_angle : str or float
        The constant angle ψ of the weight, in rad or text such as "30 deg": q = w (−cos ψ, sin ψ). 0 is toward
        the clamp, along its tangent; a quarter turn is across, along +y; a half turn hangs from the clamp.
    allow_tension : bool
        Whether thrust and weight may be negative: they then pull away from the clamp.

    Raises
    ------
    ArgumentError
        If one of them is no load, has another dimension, or thrust or weight is negative at some time where
        tension is not allowed.

    Examples
    --------
    >>> Load(thrust=([0, 10, 10], [2, 2, 0])).thrust.knots(until=100)
    (Knot(t=10.0, kind='jump', size=-2.0),)
    """

    thrust: Program
    transverse: Program
    couple: Program
    weight: Program
    weight_angle: float
    allow_tension: bool

    def __init__(
        self,
        thrust: Given = 0.0,
        transverse: Given = 0.0,
        couple: Given = 0.0,
        weight: Given = 0.0,
        *,
        weight_angle: Amount = 0.0,
        allow_tension: bool = False,
    ) -> None:
        given = {"thrust": thrust, "transverse": transverse, "couple": couple, "weight": weight}
        for name, each in given.items():
            object.__setattr__(self, name, _program(name, each, LOAD_KINDS[name]))
        object.__setattr__(self, "weight_angle", _angle(weight_angle, "weight_angle"))
        if not isinstance(allow_tension, bool):
            raise ArgumentError("must be true or false", where="allow_tension", value=allow_tension)
        object.__setattr__(self, "allow_tension", allow_tension)
        # How long a text is used is known only when it runs: see `check`.
        for name in _PUSHES:
            program = getattr(self, name)
            if program.constant or not isinstance(program, Text):
                self._refuse_tension(name, 0.0 if program.constant else math.inf)

    @classmethod
    def at_angle(cls, force: Given, angle: Amount, **others: Any) -> Load:
        """Make the loads of a dead force at a constant angle at the free end.

        n(1) = F (−cos φ, sin φ), so thrust = F cos φ and transverse = F sin φ (design, section 1.2). The force
        keeps its direction when the rod turns. Tension is allowed, for beyond a quarter turn the force pulls.

        Parameters
        ----------
        force : Given
            F, given like any load, in N.
        angle : str or float
            φ, in rad or text such as "30 deg". 0 is toward the clamp, a quarter turn is along +y; multiples of
            a quarter turn leave no remnant along the other axis.
        **others : Given
            The other arguments of `Load`: couple, weight and weight_angle.

        Returns
        -------
        Load
            The loads.

        Raises
        ------
        ArgumentError
            If the force or the angle is none, or thrust, transverse or allow_tension is given as well.
        """
        taken = sorted(others.keys() & {"thrust", "transverse", "allow_tension"})
        if taken:
            rule = "must not be given beside a force at an angle, which sets it"
            raise ArgumentError(rule, where=taken[0], value=others[taken[0]])
        program = _program("force", force, "force")
        along, across = _direction(_angle(angle, "angle"))
        thrust, transverse = (program.multiplied(each) if each else 0.0 for each in (along, across))
        return cls(thrust, transverse, **others, allow_tension=True)

    @property
    def weight_direction(self) -> tuple[float, float]:
        """The unit vector (−cos ψ, sin ψ) of the weight; exact at multiples of a quarter turn."""
        along, across = _direction(self.weight_angle)
        return 0.0 - along, across

    def _refuse_tension(self, name: str, until: float) -> None:
        if self.allow_tension:
            return
        least, greatest = _named(name, lambda: getattr(self, name).extreme(until))
        if least < -_ROUNDING * max(abs(least), abs(greatest)):
            raise ArgumentError(
                f"must not be negative at any time (a {name} pushes toward the clamp; negative it is tension)",
                where=name,
                value=least,
                next_step="Give the push as a positive number, or set allow_tension to let it pull.",
            )

    def check(self, until: float) -> None:
        """Refuse loads that are not finite, or tension that was not asked for, before `until`; text is sampled.

        Parameters
        ----------
        until : float
            End of the run, in the time of this load.

        Raises
        ------
        ArgumentError
            If there is such a time.
        """
        for name, program in self.items():
            _named(name, lambda program=program: program.extreme(until))
        for name in _PUSHES:
            self._refuse_tension(name, until)

    def items(self) -> Iterator[tuple[str, Program]]:
        """Iterate over the names and programs of all four loads."""
        return ((name, getattr(self, name)) for name in LOAD_KINDS)

    def sources(self) -> tuple[tuple[str, Program], ...]:
        """Return the names and programs of the loads that are not 0 throughout."""
        return self._sources

    @cached_property
    def _sources(self) -> tuple[tuple[str, Program], ...]:
        return tuple((name, each) for name, each in self.items() if not (each.constant and each(0.0) == 0.0))

    @cached_property
    def is_constant(self) -> bool:
        """Whether no load changes at t ≥ 0."""
        return all(program.constant for _, program in self.items())

    @property
    def settled(self) -> float | None:
        """The time, at least 0, from which on all loads are constant; None if they never are."""
        times = [program.settled for _, program in self.items()]
        known = [t for t in times if t is not None]
        return max(known) if len(known) == len(times) else None

    def dimensionless(self, scales: Scales, *, si: bool) -> Load:
        """Return the dimensionless loads in dimensionless time.

        Parameters
        ----------
        scales : Scales
            Those of the specimen, or `Scales.unit()`.
        si : bool
            Whether a specimen is used, so that this load is in SI units.

        Returns
        -------
        Load
            Thrust and transverse force ·L²/EI, couple ·L/EI, weight ·L³/EI, times /T (design, section 1.1).

        Raises
        ------
        ArgumentError
            If a load was written with units, and no specimen is used; or leaves the range of doubles.
        """
        for name, program in self.items():
            if program.has_units and not si:
                raise ArgumentError(
                    "must be in plain numbers where no specimen is used",
                    where=name,
                    value=program.describe(),
                    next_step="Give the model a specimen, or leave out the units.",
                )
        return Load(
            **{
                name: _named(name, lambda p=program, k=LOAD_KINDS[name]: p.scaled(scales.time, getattr(scales, k)))
                for name, program in self.items()
            },
            weight_angle=self.weight_angle,
            allow_tension=self.allow_tension,
        )

    def mirrored(self) -> Load:
        """Return the loads of the mirror image: transverse force, couple and weight angle change their sign."""
        return Load(
            self.thrust,
            self.transverse.mirrored(),
            self.couple.mirrored(),
            self.weight,
            weight_angle=-self.weight_angle,
            allow_tension=self.allow_tension,
        )

    def knots(self, until: float) -> tuple[Knot, ...]:
        """Return the knots of all four programs in (0, until], in order.

        Parameters
        ----------
        until : float
            End of the run.

        Returns
        -------
        tuple of Knot
            Knots within rounding of one another are one; a jump wins over a slope, the larger of a kind.

        Raises
        ------
        ArgumentError
            If there are more than 100 000.
        """
        found = sorted(knot for name, each in self.items() for knot in _named(name, lambda p=each: p.knots(until)))
        merged: list[Knot] = []
        for knot in found:
            if merged and knot.t - merged[-1].t <= 0.5 * near(knot.t):
                merged[-1] = max(merged[-1], knot, key=lambda each: (each.kind == "jump", abs(each.size)))
            else:
                merged.append(knot)
        if len(merged) > MAX_KNOTS:
            raise too_many_knots()
        return tuple(merged)

    def describe(self, *, si: bool) -> str:
        """Say in words what the loads do, for reports and tables.

        Parameters
        ----------
        si : bool
            Whether numbers are SI.

        Returns
        -------
        str
            Such as "thrust 3 N held for 1 day, then released"; "no load".
        """
        words = [
            f"{name} {each.describe(KINDS[LOAD_KINDS[name]][0] if si else '', 's' if si else '')}"
            + (f" at {math.degrees(self.weight_angle):.6g} deg" if name == "weight" and self.weight_angle else "")
            for name, each in self.sources()
        ]
        return "; ".join(words) or "no load"

    def to_dict(self) -> dict[str, Any]:
        """Return what `from_dict` takes, ready for JSON: the four programs, and options that are not the default."""
        options = {"weight_angle": self.weight_angle, "allow_tension": self.allow_tension}
        programs_by_name = {name: program.to_dict() for name, program in self.items()}
        return programs_by_name | {name: value for name, value in options.items() if value}

    @classmethod
    def from_dict(cls, data: object) -> Load:
        """Make loads from what `to_dict` returned, validated like any other.

        Parameters
        ----------
        data : mapping
            Programs and options by name; a load left out is 0.

        Returns
        -------
        Load
            Equal to what was stored.

        Raises
        ------
        ArgumentError
            If the mapping describes no loads.
        """
        if not isinstance(data, Mapping) or not data.keys() <= set(_NAMES):
            raise ArgumentError(f"must be a mapping with the keys {', '.join(_NAMES)}", where="load", value=data)
        read = {
            name: _named(name, lambda each=each: programs.from_dict(each)) if name in LOAD_KINDS else each
            for name, each in data.items()
        }
        return cls(**read)


_NAMES: Final = tuple(each.name for each in fields(Load))


def _named(name: str, make: Any) -> Any:
    """Call, and let an error say of which load it speaks."""
    try:
        return make()
    except PlasticaError as error:
        inner = "" if error.where in ("", "load", "program", "text", "value") else f".{error.where}"
        named = ArgumentError(error.rule, where=f"{name}{inner}", next_step=error.next_step)
        message = str(error)
        head = f"`{error.where}` " if error.where else ""
        named.args = (f"`{name}{inner}` {message.removeprefix(head)}",)
        raise named from None


def _angle(given: object, where: str) -> float:
    angle = finite(given, "rad", where)
    if abs(angle) > 2.0 * math.pi * (1.0 + _ROUNDING):
        turned = isinstance(given, str) and looks_like_quantity(given)
        next_step = "Leave out whole turns." if turned else f'An angle in degrees is text: "{angle:g} deg".'
        raise ArgumentError("must be within a turn, in rad", where=where, value=given, next_step=next_step)
    return angle + 0.0


def _direction(angle: float) -> tuple[float, float]:
    """Return cos and sin, exact where the angle is a multiple of a quarter turn but for rounding."""
    turns = round(angle / _QUARTER)
    if abs(angle - turns * _QUARTER) <= _ROUNDING:
        return ((1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0))[turns % 4]
    return math.cos(angle), math.sin(angle)


def _program(name: str, given: object, kind: str) -> Program:
    made: Program = _named(name, lambda: _read(given))
    due = KINDS[kind][0]
    if made.value_unit not in ("", due):
        raise ArgumentError(f"must be a load in {due}", where=name, value=made.describe())
    return made


def _read(given: object) -> Program:
    given = plain(given)
    if isinstance(given, Program):
        return given
    if isinstance(given, str):
        return programs.constant(given) if looks_like_quantity(given) else programs.expression(given)
    if isinstance(given, float):
        return programs.constant(given)
    if isinstance(given, (tuple, list, np.ndarray)) and len(given) == 2:
        return programs.table(given[0], given[1])
    rule = "must be a number, text with a unit or in t, a pair (times, values), or a program"
    raise ArgumentError(rule, where="", value=given)
