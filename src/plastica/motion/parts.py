"""Runs a part of many members: the batch first, and then, one by one, those that it gave up."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from plastica.motion.courses import courses_of
from plastica.motion.members import Given
from plastica.numerics.arrays import Arrays
from plastica.numerics.grid import Grid
from plastica.numerics.stepper import COARSE, DONE, Ends, Members, Options, Watch, advance
from plastica.physics import programs
from plastica.physics.batch import Struts, readings
from plastica.physics.resolution import end_errors, tails
from plastica.physics.status import LOST
from plastica.physics.strut import Strut

__all__ = ["CODES", "Part", "Settings", "join", "run_part"]

Array = NDArray[np.float64]

CODES: Final = ("done", "step_limit", "not_finite", "not_resolved", "solver_failed")
"""How a member ended, as `Status.code` says it."""

SMALLEST_ATOL: Final = 1e-290

TAIL: Final = 0.5
"""The tail that is allowed, in units of the root of the tolerance."""

SINGLE_STEPS: Final = 20_000
"""Steps after which a member that is solved singly is given up, so that it does not hold up the rest."""


@dataclass(frozen=True, eq=False)
class Settings:
    """How to integrate: dimensionless end and times, tolerances as the user gave them, options, and what is told."""

    end: float
    times: Array | None
    rtol: float
    atol: float | None
    options: Options
    also: tuple[str, ...] = ()
    watch: bool = False
    """Whether a member whose motion the grid does not resolve is given up."""

    @property
    def _share(self) -> float:
        return self.options.rtol / self.rtol

    def tolerances(self, given: Given) -> Array:
        """Absolute tolerance of each member: as given, or by the size of its first state and of the loads across."""
        if self.atol is not None:
            return np.full(given.count, self._share * self.atol * given.strut.scales.length)
        across = (program for name, program in given.strut.loads.sources() if name in ("transverse", "couple"))
        loads = max((max(map(abs, program.extreme(self.end))) for program in across), default=0.0)
        size = np.maximum(np.maximum(np.abs(given.mu).max(axis=1), np.abs(given.mu_nat)), loads)
        scale = np.where(size > 0.0, np.minimum(size, 1.0), 1.0)
        return np.maximum(self._share * 1e-3 * self.rtol * scale, SMALLEST_ATOL)


@dataclass(frozen=True, eq=False)
class Part:
    """What came of some members.

    Attributes
    ----------
    told : dict of ndarray, shape (members,), (members, times) or (members, n)
        What is told of them, dimensionless.
    t : ndarray, shape (members,)
        The times of the last states.
    code : ndarray of int, shape (members,)
        Index into `CODES`.
    steps : ndarray of int, shape (members,)
        Steps tried.
    singly : ndarray of bool, shape (members,)
        Which were solved singly.
    nodes : ndarray of int, shape (members,)
        Nodes per element.
    grid : Grid
        The grid of those computed last.
    """

    told: Mapping[str, NDArray[Any]]
    t: Array
    code: NDArray[np.int8]
    steps: NDArray[np.intp]
    singly: NDArray[np.bool_]
    nodes: NDArray[np.intp]
    grid: Grid

    @property
    def too_coarse(self) -> NDArray[np.bool_]:
        """Which members the grid does not resolve."""
        return np.asarray(self.code == COARSE)

    def with_members(self, some: NDArray[np.intp], other: Part) -> Part:
        """The same with other results for some members."""

        def put(mine: NDArray[Any], theirs: NDArray[Any]) -> NDArray[Any]:
            made = mine.copy()
            made[some] = theirs
            return made

        told = {name: put(values, other.told[name]) for name, values in self.told.items()}
        return Part(told, **{name: put(getattr(self, name), getattr(other, name)) for name in _SINGLE}, grid=other.grid)


_SINGLE: Final = ("t", "code", "steps", "singly", "nodes")


def join(parts: Sequence[Part]) -> Part:
    """One part of all members of several, in their order."""
    told = {name: np.concatenate([part.told[name] for part in parts]) for name in parts[0].told}
    single = {name: np.concatenate([getattr(part, name) for part in parts]) for name in _SINGLE}
    return Part(told, **single, grid=parts[0].grid)


def run_part(given: Given, settings: Settings, arrays: Arrays | None = None) -> Part:
    """Integrate some members.

    Parameters
    ----------
    given : Given
        The members.
    settings : Settings
        Times and tolerances.
    arrays : Arrays
        The library to compute with; NumPy by default.

    Returns
    -------
    Part
    """
    courses = courses_of(given.strut, given.thrusts, settings.end, settings.times)
    names = tuple(name for name, _ in given.parameters)
    own = np.array([values for _, values in given.parameters]).reshape(len(names), given.count)
    struts = Struts(given.strut, names, courses.forces)
    mu = np.broadcast_to(given.mu, (given.count, given.strut.grid.size))
    members = Members(
        np.ascontiguousarray(np.vstack([mu.T, given.mu_nat])),
        settings.tolerances(given),
        given.which,
        courses.legs,
        lambda ids, legs: np.concatenate([courses.rows(legs, given.factor[ids]), own[:, ids]]),
    )
    watch = _watch(given, settings.rtol) if settings.watch else None
    ends = advance(struts, members, settings.options, arrays or Arrays(), watch=watch)
    if settings.times is not None and settings.times[0] == 0.0:
        ends.reports[0] = members.y
    if watch is None:
        _tell_unresolved(given, settings, ends)
    coarse = ends.code == COARSE
    singly = (ends.code != DONE) & ~coarse
    for i in np.flatnonzero(singly):
        _solve_singly(given, settings, int(i), ends)
    told = _told(struts, given, own, settings, ends)
    if "limit" in settings.also:
        told |= _limits(given, own, ends, coarse, settings.rtol)
    if "curvature" in settings.also:
        told["curvature"] = ends.y[:-1].T.copy()
    nodes = np.full(given.count, given.strut.grid.per_element)
    return Part(told, ends.t, ends.code, ends.steps, singly, nodes, given.strut.grid)


def _told(struts: Struts, given: Given, own: Array, settings: Settings, ends: Ends) -> dict[str, Array]:
    if settings.times is None:
        return readings(struts, ends.y, own, _loads(struts.strut, given, ends.t))
    found = [
        readings(struts, y, own, _loads(struts.strut, given, np.full(given.count, t)))
        for t, y in zip(settings.times, ends.reports, strict=True)
    ]
    return {name: np.stack([each[name] for each in found], axis=1) for name in found[0]}


def _loads(strut: Strut, given: Given, t: Array) -> dict[str, Array]:
    """Dimensionless loads of all members at their times."""
    scales = strut.scales
    thrust = np.empty(given.count)
    for i in np.unique(given.which):
        own = given.which == i
        thrust[own] = given.thrusts[i].scaled(scales.time, scales.force)(t[own])
    others = {name: program(t) for name, program in strut.loads.sources() if name != "thrust"}
    return {"thrust": thrust * given.factor, **others}


def _member(given: Given, i: int) -> Strut:
    """The model of one member."""
    strut, factor = given.strut, float(given.factor[i])
    thrust = given.thrusts[given.which[i]].multiplied(factor) if factor != 0.0 else programs.constant(0.0)
    numbers = {name: _number(given, name, values[i]) for name, values in given.parameters}
    material = strut.material.with_parameters(**numbers)
    return Strut(material, replace(strut.load, thrust=thrust), strut.grid, strut.specimen)


def _solve_singly(given: Given, settings: Settings, i: int, ends: Ends) -> None:
    """Let `solve` have a member that the batch gave up, and put what it finds in its place."""
    from plastica.motion.solve import solve

    model, scales = _member(given, i), given.strut.scales
    mu = given.mu[0 if given.mu.shape[0] == 1 else i]
    options: dict[str, Any] = {"rtol": settings.rtol, "max_steps": SINGLE_STEPS}
    if settings.atol is not None:
        options["atol"] = settings.atol
    sol = solve(
        model, mu * scales.curvature, float(given.mu_nat[i]) * scales.curvature, settings.end * scales.time, **options
    )
    rows = ends.y.shape[0]
    ends.y[:, i], ends.t[i] = sol.history.y[-1, :rows], sol.history.end
    ends.code[i] = CODES.index(sol.status.code if sol.status.code in CODES else "solver_failed")
    ends.steps[i] += sol.counts.steps
    if settings.times is not None:
        reached = settings.times <= sol.history.end * (1.0 + 4.0 * np.finfo(float).eps)
        ends.reports[reached, :, i] = sol.history(np.minimum(settings.times[reached], sol.history.end))[:, :rows]
        ends.reports[~reached, :, i] = np.nan


def _number(given: Given, name: str, value: float) -> float | str:
    """A parameter as the material takes it: with a unit, where the others carry units."""
    known = given.strut.material.parameters[name]
    if not isinstance(known, str):
        return float(value)
    from plastica.units import dimension_text, parse_quantity

    return f"{float(value)!r} {dimension_text(parse_quantity(known, where=name)[1])}"


def _watch(given: Given, rtol: float) -> Watch:
    """Tell which members a grid does not resolve: by the tails that `physics.resolution` looks at.

    What is told of members are integrals over the rod. J and J* being adjoint on the grid, these err by the square of
    what the curvature errs between its nodes: at most by 0.03 of it, over all shapes and thrusts that were tried.
    """
    grid, allowed = given.strut.grid, max(TAIL * math.sqrt(rtol), 50.0 * float(np.finfo(float).eps))
    first = np.broadcast_to(np.abs(given.mu).max(axis=1), (given.count,))
    tail = (grid.tail(given.mu) > allowed * np.abs(given.mu).max(axis=1)) | (given.missed > allowed)
    rough = np.broadcast_to(tail, (given.count,))

    def watch(ids: NDArray[np.intp], y: Array) -> NDArray[np.bool_]:
        mu = np.ascontiguousarray(y[:-1].T)
        size = np.maximum(np.maximum(first[ids], np.abs(mu).max(axis=1)), 1e-300)
        return np.asarray(rough[ids] | (tails(grid, mu, size) > allowed))

    return watch


def _tell_unresolved(given: Given, settings: Settings, ends: Ends) -> None:
    """Put another code where the grid, which is kept, does not resolve the states that are told, or the first ones."""
    n, start = given.strut.grid.size, np.broadcast_to(given.mu, (given.count, given.strut.grid.size))
    ends.code[(ends.code == DONE) & (given.missed > LOST)] = COARSE
    moments = [(np.zeros(given.count), start), (ends.t, ends.y[:n].T)]
    if settings.times is not None:
        looks = zip(settings.times, ends.reports, strict=True)
        moments += [(np.full(given.count, t), report[:n].T) for t, report in looks]
    for t, mu in moments:
        some = np.flatnonzero((ends.code == DONE) & np.isfinite(mu).all(axis=1))
        thrust = _loads(given.strut, given.chosen(some), t[some])["thrust"]
        off = end_errors(given.strut, t[some], mu[some], thrust)
        ends.code[some[off > LOST]] = COARSE


def _limits(
    given: Given, own: Array, ends: Ends, coarse: NDArray[np.bool_], rtol: float
) -> dict[str, NDArray[Any]]:
    """Where each member ends, as far as it can be told from its last state."""
    from plastica.equilibria.endings import KINDS, UNDECIDED, endings
    from plastica.equilibria.way import laws_of_many

    strut, gamma = given.strut, _loads(given.strut, given, ends.t)["thrust"]
    some = np.flatnonzero(np.isfinite(ends.y).all(axis=0) & ~coarse & (gamma >= 0.0) & (_settled(given) <= ends.t))
    laws = laws_of_many(strut, [name for name, _ in given.parameters], own[:, some])
    told = endings(strut.grid, gamma[some], ends.y[:-1, some].T, ends.y[-1, some], laws, rtol)
    kinds = np.full(given.count, "", dtype="<U9")
    natural, stable = np.full(given.count, np.nan), np.full(given.count, -1, dtype=np.int8)
    kinds[some], natural[some] = np.array(KINDS)[told.kind], told.mu_nat
    stable[some] = np.where(told.kind == UNDECIDED, -1, told.stable)
    return {"limit_kind": kinds, "limit_natural_curvature": natural, "limit_stable": stable}


def _settled(given: Given) -> Array:
    """Dimensionless time from which on a constant thrust alone acts on each member; infinite where it never does."""
    if any(name != "thrust" for name, _ in given.strut.load.sources()):
        return np.full(given.count, np.inf)
    times = [thrust.settled for thrust in given.thrusts]
    since = np.array([np.inf if time is None else time / given.strut.scales.time for time in times])
    return np.where(given.factor == 0.0, 0.0, since[given.which])
