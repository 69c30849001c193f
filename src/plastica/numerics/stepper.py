"""Many trajectories at once, each with its own step: DOP853 on a block of columns.

A column of the block is one trajectory. It has its own time, step, error control and tolerance; one that has come to
its end leaves, and the next takes its place. No operation mixes columns, and a block is always a multiple of 16
columns wide, so that BLAS treats them all alike: what becomes of a trajectory does not depend, to the last bit, on
which others are computed beside it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final, Protocol

import numpy as np
from numpy.typing import NDArray

from plastica.numerics.arrays import LANES, Arrays
from plastica.numerics.block import Block, Machine, Rate, block_of

__all__ = [
    "COARSE",
    "DONE",
    "NOT_FINITE",
    "STIFF",
    "WIDTH",
    "Ends",
    "Legs",
    "Members",
    "Options",
    "System",
    "Watch",
    "advance",
]

Array = NDArray[np.float64]
Indices = NDArray[np.intp]

WIDTH: Final = 768
"""Columns of a block: enough to hide what a call costs, few enough to stay in the cache."""

DONE, STIFF, NOT_FINITE, COARSE = 0, 1, 2, 3
"""How a trajectory ended: at its end; too many steps, or far too many to go; no step small enough; by the watch."""

LOOK_EVERY: Final = 32
"""Steps of a member between two looks at how far it still has to go."""

WATCH_EVERY: Final = 10
"""Steps of a member between two calls of the watch."""

Watch = Callable[[Indices, Array], NDArray[np.bool_]]
"""(members, their states) -> which of them to give up; asked now and then, and at the end."""


class System(Protocol):
    """What is integrated: dy/dt = rate(t, y, p) for every column, p being the column's own parameters."""

    @property
    def rows(self) -> int:
        """How many components a state has."""

    @property
    def autonomous(self) -> bool:
        """Whether the rate does not depend on time."""

    @property
    def switching(self) -> int | None:
        """A row whose rate is exactly 0 for a while and then is not, if there is one."""

    def rate(self, arrays: Arrays, width: int) -> Rate:
        """Return the rate for blocks of a width: (t, y, p, out) -> dy/dt, written into `out` where that is not None."""

    def machine(self, rtol: float) -> Machine | None:
        """Return what tries a step of DOP853 in machine code, if there is such a thing.

        (columns, p, y) -> found: from times, steps and absolute tolerances (3, width), parameters and states, to new
        states, sums of squares in units of the tolerance (of the errors of orders 5 and 3, and of the first slope),
        and first and last slope of the switching row, times the step; shape (rows + 5, width).
        """


@dataclass(frozen=True, eq=False)
class Legs:
    """Stretches of time on which a system is smooth, course after course; a member follows the legs of one course.

    Attributes
    ----------
    first : ndarray of int, shape (courses + 1,)
        Where each course begins, and the number of legs in all.
    end, longest : ndarray, shape (legs,)
        Time on which to land, and the longest step on the way there.
    fresh : ndarray of bool, shape (legs,)
        Whether the system jumps where the leg begins, so that the step must be chosen anew.
    report : ndarray of int, shape (legs,)
        Number of the state to be kept at the leg's end; -1 for none.
    """

    first: Indices
    end: Array
    longest: Array
    fresh: NDArray[np.bool_]
    report: Indices


@dataclass(frozen=True, eq=False)
class Members:
    """The trajectories.

    Attributes
    ----------
    y : ndarray, shape (rows, members)
        First states.
    atol : ndarray, shape (members,)
        Absolute tolerance of each.
    course : ndarray of int, shape (members,)
        Which legs each follows.
    legs : Legs
        The legs of all courses.
    parameters : callable
        (members, legs) -> the parameters of these members on these legs, shape (parameters, members).
    """

    y: Array
    atol: Array
    course: Indices
    legs: Legs
    parameters: Callable[[Indices, Indices], Array]


@dataclass(frozen=True)
class Options:
    """Relative tolerance, the steps after which a member is given up, and how many columns there are at most."""

    rtol: float
    most_steps: int = 2000
    width: int = WIDTH


@dataclass(frozen=True, eq=False)
class Ends:
    """How the trajectories ended.

    Attributes
    ----------
    y : ndarray, shape (rows, members)
        Last states.
    t : ndarray, shape (members,)
        Their times.
    code : ndarray of int, shape (members,)
        DONE, STIFF or NOT_FINITE.
    steps : ndarray of int, shape (members,)
        Steps tried.
    reports : ndarray, shape (reports, rows, members)
        States at the times asked for; nan where a member did not come there.
    """

    y: Array
    t: Array
    code: NDArray[np.int8]
    steps: Indices
    reports: Array


def advance(
    system: System,
    members: Members,
    options: Options,
    arrays: Arrays,
    start: float = 0.0,
    watch: Watch | None = None,
) -> Ends:
    """Integrate every member to the end of its last leg.

    Parameters
    ----------
    system : System
        The right-hand side.
    members : Members
        First states, tolerances, legs and parameters.
    options : Options
        Tolerance and limits.
    arrays : Arrays
        The library of arrays to compute with.
    start : float
        The time at which all begin.
    watch : callable, optional
        Looks at every member after its first step, after every tenth, and at its end, and tells whether to give it up.

    Returns
    -------
    Ends
        On the host.
    """
    with np.errstate(all="ignore"):
        return _Run(system, members, options, arrays, start, watch).ends()


class _Run:
    """The members that wait, the block of those under way, and the book of those that are done."""

    def __init__(
        self,
        system: System,
        members: Members,
        options: Options,
        arrays: Arrays,
        start: float,
        watch: Watch | None,
    ) -> None:
        self.system, self.members, self.options, self.arrays, self.start = system, members, options, arrays, start
        self.watch = watch
        count, legs = members.y.shape[1], members.legs
        reports = int(legs.report.max(initial=-1)) + 1
        self.y, self.t = members.y.copy(), np.full(count, start)
        self.code = np.zeros(count, dtype=np.int8)
        self.steps = np.zeros(count, dtype=np.intp)
        self.reports = np.full((reports, members.y.shape[0], count), np.nan)
        self.final = legs.end[legs.first[members.course + 1] - 1]
        self.waiting = 0
        self.block = self._filled(min(options.width, _lanes(count)))

    def ends(self) -> Ends:
        while self.block.alive.any():
            self._booked(*self.block.step())
            self._looked_at()
            self._renewed()
        return Ends(self.y, self.t, self.code, self.steps, self.reports)

    def _filled(self, width: int) -> Block:
        """A new block, with as many of those that wait as it has columns."""
        nobody = np.zeros(0, dtype=np.intp)
        parameters = self.members.parameters(nobody, nobody).shape[0]
        machine = self.system.machine(self.options.rtol) if self.arrays.compiled else None
        block = block_of(self.system, self.arrays, self.options.rtol, width, parameters, machine)
        self._fill(block, np.arange(width))
        return block

    def _fill(self, block: Block, free: Indices) -> None:
        """Give free columns to members that wait."""
        count = min(len(free), self.members.y.shape[1] - self.waiting)
        ids, columns = np.arange(self.waiting, self.waiting + count), free[:count]
        self.waiting += count
        legs = self.members.legs.first[self.members.course[ids]]
        block.place(columns, ids, self.members.y[:, ids], self.start, self.members.atol[ids])
        self._on_legs(block, columns, ids, legs, np.ones(count, dtype=bool))

    def _on_legs(self, block: Block, columns: Indices, ids: Indices, legs: Indices, fresh: NDArray[np.bool_]) -> None:
        of = self.members.legs
        block.on_legs(columns, legs, of.end[legs], of.longest[legs], fresh, self.members.parameters(ids, legs))

    def _booked(self, landed: NDArray[np.bool_], stuck: NDArray[np.bool_]) -> None:
        """Write down what has come to the end of a leg, and send on those that have another."""
        block, legs = self.block, self.members.legs
        if landed.any():
            columns = np.flatnonzero(landed)
            ids, at = block.ids[columns], block.leg[columns]
            states = block.states(columns)
            kept = legs.report[at] >= 0
            self.reports[legs.report[at][kept], :, ids[kept]] = states[:, kept].T
            last = at + 1 == legs.first[self.members.course[ids] + 1]
            self._leave(columns[last], DONE)
            self._give_up(columns[last])
            on, following = ~last, at[~last] + 1
            if on.any():
                self._on_legs(block, columns[on], ids[on], following, legs.fresh[following])
        if stuck.any():
            self._leave(np.flatnonzero(stuck), NOT_FINITE)

    def _leave(self, columns: Indices, code: int) -> None:
        block, ids = self.block, self.block.ids[columns]
        self.y[:, ids], self.t[ids] = block.states(columns), block.times(columns)
        self.code[ids], self.steps[ids] = code, block.steps[columns]
        block.release(columns)

    def _looked_at(self) -> None:
        """Give up what would never end, and what the watch tells; asked after so many steps of each member."""
        block = self.block
        due = np.flatnonzero(block.alive & (block.steps % LOOK_EVERY == 0))
        if due.size:
            to_go = (self.final[block.ids[due]] - block.times(due)) / np.maximum(block.sizes(due), 1e-300)
            taken, most = block.steps[due], self.options.most_steps
            self._leave(due[(taken >= most) | ((taken >= most // 8) & (to_go > 2.0 * most))], STIFF)
        if self.watch is not None:
            due = np.flatnonzero(block.alive & ((block.steps % WATCH_EVERY == 0) | (block.steps == 1)))
            self._leave(self._give_up(due), COARSE)

    def _give_up(self, columns: Indices) -> Indices:
        """Which of some columns the watch tells to give up; noted where they are."""
        if self.watch is None or columns.size == 0:
            return columns[:0]
        told = columns[self.watch(self.block.ids[columns], self.block.states(columns))]
        self.code[self.block.ids[told]] = COARSE
        return told

    def _renewed(self) -> None:
        """Fill what is free, an eighth of the block at a time; once none waits, narrow it as it empties."""
        block = self.block
        free = np.flatnonzero(~block.alive)
        if self.waiting < self.members.y.shape[1]:
            if 8 * len(free) >= block.width:
                self._fill(block, free)
            return
        left = block.width - len(free)
        # Other libraries may compile what they do for each width.
        most = 3 * block.width if self.arrays.writable else block.width
        if left and 4 * _lanes(left) <= most:
            self.block = block.narrowed(np.flatnonzero(block.alive), _lanes(left))


def _lanes(count: int) -> int:
    """Return a width that holds so many columns."""
    return max(LANES, -(-count // LANES) * LANES)
