"""The legs of many members: where each must land, and its loads as straight lines in between."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from plastica.motion.itinerary import itinerary
from plastica.numerics.stepper import Legs
from plastica.physics.batch import Forces
from plastica.physics.load import Load
from plastica.physics.program import Polygonal, Program
from plastica.physics.programs import constant
from plastica.physics.strut import Strut

__all__ = ["Courses", "courses_of"]

Array = NDArray[np.float64]

MOST_CORNERS = 1000
"""Corners of a load up to which a member lands on every one of them, so that each leg is a straight line."""


@dataclass(frozen=True, eq=False)
class Courses:
    """What the loads ask of the members: legs, one course for each program of the thrust, and the loads on them.

    Attributes
    ----------
    legs : Legs
        For the stepper.
    forces : Forces
        Which loads there are.
    begin : ndarray, shape (legs,)
        Times at which the legs begin.
    value, slope : ndarray, shape (loads, legs)
        Each load where the leg begins, and its slope.
    which : ndarray of int, shape (legs,)
        The course of each leg.
    """

    legs: Legs
    forces: Forces
    begin: Array
    value: Array
    slope: Array
    which: NDArray[np.intp]

    def rows(self, legs: NDArray[np.intp], factor: Array) -> Array:
        """The parameters that `Forces` describes, for members on some legs whose thrust has a factor."""
        gain = np.ones((len(self.forces.kinds), len(legs)))
        gain[0] = factor
        value = self.value[:, legs] * gain
        if not self.forces.varying:
            return value
        lines = np.stack([value, self.slope[:, legs] * gain], axis=1).reshape(2 * len(value), len(legs))
        found = [self.begin[legs][None], self.legs.end[legs][None], lines]
        if self.forces.curved:
            found += [self.which[legs].astype(float)[None], factor[None]]
        return np.concatenate(found)


def courses_of(strut: Strut, thrusts: Sequence[Program], end: float, times: Array | None) -> Courses:
    """Plan the legs of all courses.

    Parameters
    ----------
    strut : Strut
        The model; its loads other than the thrust act on every member.
    thrusts : sequence of Program
        The thrusts, one course for each, in the units of the model.
    end : float
        Dimensionless time at which all end.
    times : ndarray or None
        Dimensionless times at which states are kept.

    Returns
    -------
    Courses
    """
    struts = [strut.with_load(replace(strut.load, thrust=thrust)) for thrust in thrusts]
    kinds = ("thrust", *(name for name, _ in struts[0].loads.sources() if name != "thrust"))
    made = [_course(each, kinds, end, times) for each in struts]
    curved = _curved([each.loads for each in struts], kinds, made)
    join = {name: np.concatenate([getattr(each, name) for each in made], axis=-1) for name in _ALL}
    first = np.concatenate([[0], np.cumsum([each.end.size for each in made])]).astype(np.intp)
    varying = bool(curved) or bool(np.any(join["slope"] != 0.0))
    legs = Legs(first, join["end"], join["longest"], join["fresh"], join["report"])
    which = np.repeat(np.arange(len(made)), np.diff(first))
    return Courses(legs, Forces(kinds, varying, curved), join["begin"], join["value"], join["slope"], which)


_ALL = ("begin", "end", "longest", "fresh", "report", "value", "slope")


@dataclass(frozen=True, eq=False)
class _Course:
    begin: Array
    end: Array
    longest: Array
    fresh: NDArray[np.bool_]
    report: NDArray[np.intp]
    value: Array
    slope: Array
    curved: tuple[bool, ...]


def _course(strut: Strut, kinds: Sequence[str], end: float, times: Array | None) -> _Course:
    stretches = itinerary(strut, 0.0, end)
    programs = [getattr(strut.loads, kind) for kind in kinds]
    landings = np.array([each.start for each in stretches])
    straight = [_is_straight(program, end) for program in programs]
    corners = [knot.t for program, ok in zip(programs, straight, strict=True) if ok for knot in program.knots(end)]
    asked = np.zeros(0) if times is None else times[times > 0.0]
    points = _merged(landings, np.array(corners), asked, end)
    begin, last = points[:-1], points[1:]
    longest = np.array([each.longest_step for each in stretches])
    within = np.searchsorted(landings, begin + 32.0 * np.spacing(begin), side="right") - 1
    report = np.full(last.size, -1, dtype=np.intp)
    if times is not None:
        # Where times lie within rounding of one another they share a leg's end: the last of them is kept there.
        report[np.searchsorted(last, asked - 64.0 * np.spacing(asked))] = np.flatnonzero(times > 0.0)
    lines = [_lines(program, ok, begin, last) for program, ok in zip(programs, straight, strict=True)]
    fresh = np.abs(begin - landings[within]) <= 64.0 * np.spacing(begin)
    value, slope = (np.stack([line[k] for line in lines]) for k in (0, 1))
    return _Course(begin, last, longest[within], fresh, report, value, slope, tuple(not ok for ok in straight))


def _is_straight(program: Program, end: float) -> bool:
    """Whether a member that lands on its corners finds it straight in between, and there are not too many."""
    if program.constant:
        return True
    return isinstance(program, Polygonal) and len(program.knots(end)) <= MOST_CORNERS


def _merged(landings: Array, corners: Array, asked: Array, end: float) -> Array:
    """All points in order, from 0 to the end; of those within rounding of one another the first, asked ones before."""
    points = [0.0, end]
    for more in (asked, landings, corners):
        inside = more[(more > 0.0) & (more < end)]
        near = np.abs(inside[:, None] - np.array(points)).min(axis=1) <= 64.0 * np.spacing(inside)
        points += inside[~near].tolist()
    return np.unique(points)


def _lines(program: Program, straight: bool, begin: Array, last: Array) -> tuple[Array, Array]:
    """Value at the beginning of each leg, and slope; zeros where the program is no straight line."""
    if not straight:
        return np.zeros(begin.size), np.zeros(begin.size)
    value, slope = np.empty(begin.size), np.zeros(begin.size)
    for i, (a, b) in enumerate(zip(begin.tolist(), last.tolist(), strict=True)):
        piece = program.on(a, b)
        if callable(piece):
            value[i] = piece(a)
            slope[i] = (piece(b) - value[i]) / (b - a)
        else:
            value[i] = piece
    return value, slope


def _curved(
    loads: Sequence[Load], kinds: Sequence[str], made: Sequence[_Course]
) -> tuple[tuple[str, tuple[Program, ...]], ...]:
    """The loads that are no straight lines on some course, with what their programs add to straight ones."""
    found: list[tuple[str, tuple[Program, ...]]] = []
    for k, kind in enumerate(kinds):
        if any(course.curved[k] for course in made):
            programs = tuple(
                getattr(load, kind) if course.curved[k] else constant(0.0)
                for load, course in zip(loads, made, strict=True)
            )
            found.append((kind, programs if kind == "thrust" else programs[:1]))
    return tuple(found)
