"""A block of trajectories that take their steps together, each of its own length: the arithmetic of DOP853."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cache
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from plastica.numerics import dop853
from plastica.numerics.arrays import AnyArray, Arrays

__all__ = ["Block", "Machine", "Rate", "block_of"]

Array = NDArray[np.float64]
Truth = NDArray[np.bool_]
Indices = NDArray[np.intp]
Rate = Callable[[AnyArray, AnyArray, AnyArray, AnyArray], AnyArray]
Machine = Callable[[Array, Array, Array], Array]

SAFETY, LEAST, MOST = 0.9, 0.2, 10.0
"""Of the step's size: the share of the predicted one that is tried, and how much it may change at once."""

ORDER: Final = 8

MEMORY: Final = 0.04
"""Exponent of the former error in the choice of the step (Gustafsson's controller; Hairer and Wanner, IV.2). Where
stability bounds the step, as late in every motion, it spares five rejected steps in six, at a quarter of the error."""

CALM: Final = 1e-4
"""The least that a former error counts as."""

STRICTER: Final = 30.0
"""How much more is asked of a step within which a slope starts or stops being 0: there it has a corner, which the
estimates of the error take too lightly. Under a cycling thrust it brings the largest error from 233 to 3 rtol."""

AT_REST: Final = 0.01
"""Share of the tolerance: where the whole way to go, at the present rate, comes to less, the state is that of the end.
Only asked where time does not matter, the switching row is at rest and what changes is dying away."""

ROUNDING: Final = 2.5e-13
"""Share of the state: less is not asked of the way to go, which rounding alone makes seem as long."""

DYING: Final = 100.0
"""Time within which what is near rest dies away. Where it takes a hundred times as long, one tolerance is missed."""

NEAR_REST: Final = 1e4
"""Tolerances: where the way to go comes to less, the steps must be more exact. Steps as long as stability lets them be
keep stirring up errors of the size of the tolerance, and hide rest."""

CALMER: Final = 1e5
"""How much more exact, as far as rounding lets them."""

# Where the state and the slopes lie in the stack, so that what a stage needs lies together. Slopes are times the step.
_STATE: Final = 2
_SLOPE: Final = (3, 1, 0, *range(4, 4 + dop853.STAGES - 3))
_STACK: Final = 1 + dop853.STAGES


@cache
def _stages() -> tuple[tuple[int, int, Array], ...]:
    """For each stage: first and last place in the stack, and what it takes of each in between."""
    return tuple(_row(stage, 1.0) for stage in dop853.A[1:])


def _row(taken: dict[int, float], of_state: float) -> tuple[int, int, Array]:
    row = np.zeros(_STACK)
    row[_STATE] = of_state
    for j, value in taken.items():
        row[_SLOPE[j]] = value
    used = np.flatnonzero(row)
    first, last = min(int(used[0]), _STATE), int(used[-1]) + 1
    return first, last, row[first:last].copy()


@cache
def _result() -> Array:
    """What the new state, the two errors and the first slope take of the stack from the state on."""
    every = ((dop853.B, 1.0), (dop853.E5, 0.0), (dop853.E3, 0.0), ({0: 1.0}, 0.0))
    rows = [_row(taken, share) for taken, share in every]
    return np.stack([np.pad(row, (first - _STATE, _STACK - last)) for first, last, row in rows])


class _Views:
    """Parts of a stack that can be written, in the shapes in which they are needed, and room for results."""

    def __init__(self, stack: Array) -> None:
        _, rows, width = stack.shape
        self.among = [stack[:1], *(stack[first:last].reshape(last - first, -1) for first, last, _ in _stages())]
        self.slopes = [stack[place] for place in _SLOPE]
        self.trial, self.spare, result = np.zeros((rows, width)), np.zeros((rows, width)), np.zeros((4, rows, width))
        self.trial_flat, self.result_flat = self.trial.reshape(1, -1), result.reshape(4, -1)


@dataclass(eq=False)
class Block:
    """Columns under way; changed in place by its methods.

    Attributes
    ----------
    arrays : Arrays
        The library computed with.
    rate : callable
        The right-hand side for this width.
    autonomous : bool
        Whether the rate does not depend on time.
    switching : int or None
        Row whose slope is 0 for a while.
    rtol : float
        Relative tolerance.
    machine : callable or None
        Tries a step in machine code; see `System.machine`.
    make : callable
        Makes an empty block of another width.
    stack : array, shape (13, rows, width)
        The states and, while a step is made, its slopes times the step.
    p : array, shape (parameters, width)
        Parameters of the columns.
    t, h, end, longest, atol, ceiling, former, speed : array, shape (width,)
        Time, next step, where to land, longest step, tolerance, how much the step may grow, last error and speed.
    fresh : array of bool, shape (width,)
        Which columns have yet to choose their first step.
    alive : ndarray of bool, shape (width,)
        Which columns hold a member that is under way; on the host, like what follows.
    ids, leg, steps : ndarray of int, shape (width,)
        Member, leg, and steps tried.
    """

    arrays: Arrays
    rate: Rate
    autonomous: bool
    switching: int | None
    rtol: float
    machine: Machine | None
    make: Callable[[int], Block] = field(repr=False)
    stack: AnyArray
    p: AnyArray
    t: AnyArray
    h: AnyArray
    end: AnyArray
    longest: AnyArray
    atol: AnyArray
    ceiling: AnyArray
    former: AnyArray
    speed: AnyArray
    fresh: AnyArray
    alive: Truth
    ids: Indices
    leg: Indices
    steps: Indices

    def __post_init__(self) -> None:
        arrays, (_, rows, width) = self.arrays, self.stack.shape
        self.width, self.rows = int(width), int(rows)
        self._any_fresh = True
        self._changed = True
        self._alive = self.fresh
        self._most, self._calm, self._least_error = (arrays.of(np.full(width, x)) for x in (MOST, CALM, 1e-12))
        self._stages = [(first, last, arrays.of(row[None, :])) for first, last, row in _stages()]
        self._last = arrays.of(_result())
        self._calmer = min(CALMER, max(1.0, self.rtol * DYING / ROUNDING))
        self._at_rest = max(AT_REST, ROUNDING / self.rtol)
        self._into = {name: arrays.into(name) for name in ("multiply", "matmul", "divide", "maximum", "add", "abs")}
        self._views = _Views(self.stack) if arrays.writable else None

    def place(self, columns: Indices, ids: Indices, y: Array, t: float, atol: Array) -> None:
        """Let members into columns: their numbers, first states, time and tolerances."""
        put = self.arrays.put_columns
        self.ids[columns], self.steps[columns], self.alive[columns] = ids, 0, True
        state = put(self.stack[_STATE, :, :], columns, y)
        self.stack = self.arrays.put(self.stack, _STATE, state)
        self.t = put(self.t, columns, np.full(len(columns), t))
        self.atol = put(self.atol, columns, atol)
        self._changed = True

    def on_legs(
        self, columns: Indices, legs: Indices, end: Array, longest: Array, fresh: Truth, parameters: Array
    ) -> None:
        """Send columns on their next legs: where to land, the longest step, and parameters."""
        put = self.arrays.put_columns
        self.leg[columns] = legs
        self.end, self.longest = put(self.end, columns, end), put(self.longest, columns, longest)
        self.fresh, self._any_fresh = put(self.fresh, columns, fresh), self._any_fresh or bool(fresh.any())
        self.ceiling = put(self.ceiling, columns, np.full(len(columns), MOST))
        self.former = put(self.former, columns, np.where(fresh, CALM, self.arrays.host(self.former)[columns]))
        self.speed = put(self.speed, columns, np.zeros(len(columns)))
        self.p = put(self.p, columns, parameters)

    def release(self, columns: Indices) -> None:
        """Let the members of columns go; what is left there is computed on, and nobody looks at it."""
        self.alive[columns] = False
        self._changed = True

    def narrowed(self, columns: Indices, width: int) -> Block:
        """Return a block of another width with the members of these columns."""
        block, count = self.make(width), len(columns)
        to = np.arange(count)
        for name in ("p", "t", "h", "end", "longest", "atol", "ceiling", "former", "speed", "fresh"):
            taken = self.arrays.host(getattr(self, name))[..., columns]
            setattr(block, name, self.arrays.put_columns(getattr(block, name), to, taken))
        state = self.arrays.put_columns(block.stack[_STATE, :, :], to, self.states(columns))
        block.stack = self.arrays.put(block.stack, _STATE, state)
        block.alive[:count] = True
        for name in ("ids", "leg", "steps"):
            getattr(block, name)[:count] = getattr(self, name)[columns]
        block._any_fresh = self._any_fresh
        return block

    def states(self, columns: Any) -> Array:
        """The states of columns, on the host; shape (rows, columns)."""
        return self.arrays.host(self.stack[_STATE, :, :])[:, columns]

    def times(self, columns: Any) -> Array:
        """The times of columns, on the host."""
        return np.asarray(self.arrays.host(self.t)[columns])

    def sizes(self, columns: Any) -> Array:
        """The sizes of the next steps, on the host."""
        return np.asarray(self.arrays.host(self.h)[columns])

    def step(self) -> tuple[Truth, Truth]:
        """Try one step of every column.

        Returns
        -------
        landed, stuck : ndarray of bool, shape (width,)
            Which columns have come to the end of their legs, and which can make no step however small.
        """
        xp, arrays = self.arrays.xp, self.arrays
        if self._changed:
            self._alive, self._changed = arrays.mask(self.alive), False
        if self.machine is None or self._any_fresh:
            self._slope(0, self.t, self.stack[_STATE, ...])
        if self._any_fresh:
            self._choose_first_steps()
        left = self.end - self.t
        wanted = xp.minimum(self.h, self.longest)
        # A step that would leave next to nothing goes all the way.
        landing = 1.01 * wanted >= left
        h = xp.where(landing, left, wanted)
        new, error, change = self._new_state_and_error(h)
        # What grows from step to step is not on its way to rest, however small it is.
        speed = change / h
        to_go = xp.where(speed > self.speed, speed + np.inf, speed) * xp.clip(left, 0.0, DYING)
        error = xp.where(to_go <= NEAR_REST, self._calmer * error, error)
        landing = landing | (to_go <= self._at_rest)
        accepted = (error <= 1.0) & self._alive
        self.stack = arrays.put(self.stack, _STATE, arrays.chosen(accepted, new, self.stack[_STATE, ...]))
        self.t = xp.where(accepted, xp.where(landing, self.end, self.t + h), self.t)
        self.speed = xp.where(accepted, speed, self.speed)
        self._next_steps(h, error, accepted, landing)
        self.steps += self.alive
        stuck = self._alive & ~accepted & (h <= 1e-13 * xp.abs(self.t) + 1e-18 * xp.abs(self.end))
        return arrays.host(accepted & landing), arrays.host(stuck)

    def _slope(self, stage: int, t: AnyArray, y: AnyArray) -> None:
        """Put the rate at a stage into its place in the stack."""
        if self._views is not None:
            self.rate(t, y, self.p, self._views.slopes[stage])
        else:
            self.stack = self.arrays.put(self.stack, _SLOPE[stage], self.rate(t, y, self.p, None))

    def _scale(self, stage: int, h: AnyArray) -> None:
        """Multiply a slope by the step."""
        if self._views is not None:
            np.multiply(self._views.slopes[stage], h, self._views.slopes[stage])
        else:
            self.stack = self.arrays.put(self.stack, _SLOPE[stage], self.stack[_SLOPE[stage], ...] * h)

    def _evaluate_stages(self, h: AnyArray) -> None:
        xp, matmul, views = self.arrays.xp, self._into["matmul"], self._views
        t = self.t
        for stage, (first, last, row) in enumerate(self._stages, 1):
            if views is None:
                y = xp.reshape(row @ self._flat(first, last), (self.rows, self.width))
            else:
                matmul(row, views.among[stage], views.trial_flat)
                y = views.trial
            if not self.autonomous:
                t = self.t + dop853.C[stage] * h
            self._slope(stage, t, y)
            self._scale(stage, h)

    def _flat(self, first: int, last: int) -> AnyArray:
        """Part of the stack with a row for each state or slope."""
        return self.arrays.xp.reshape(self.stack[first:last, ...], (last - first, -1))

    def _new_state_and_error(self, h: AnyArray) -> tuple[AnyArray, AnyArray, AnyArray]:
        """The new state, its error in units of the tolerance as DOP853 estimates it, and how far this step still goes.

        The last is infinite where a change need not die away: where the switching row moves, or time matters.
        """
        xp = self.arrays.xp
        new, errors, moving = self._tried(h)
        fifth, third, change = (errors[k, ...] for k in range(3))
        error = fifth / (xp.sqrt((fifth + 0.01 * third) * float(self.rows)) + 1e-300)
        never = self._least_error + np.inf
        if self.switching is None:
            return new, error, never
        first, last = moving[0] != 0.0, moving[1] != 0.0
        still = xp.where(first | last, never, xp.sqrt(change / self.rows)) if self.autonomous else never
        return new, xp.where(first != last, STRICTER * error, error), still

    def _tried(self, h: AnyArray) -> tuple[AnyArray, AnyArray, AnyArray]:
        """The new state, sums of squares in units of the tolerance, and first and last slope of a switching row."""
        if self.machine is not None:
            found = self.machine(np.stack([self.t, h, self.atol]), self.p, self.stack[_STATE, ...])
            return found[: self.rows], found[self.rows : self.rows + 3], found[self.rows + 3 :]
        self._scale(0, h)
        self._evaluate_stages(h)
        new, errors = self._results()
        ends = (0, dop853.STAGES - 1)
        moving = () if self.switching is None else [self.stack[_SLOPE[stage], self.switching, ...] for stage in ends]
        return new, errors, moving

    def _results(self) -> tuple[AnyArray, AnyArray]:
        """The new state, sums of squares of errors and first slope in units of the tolerance, (3, width)."""
        xp, do, views = self.arrays.xp, self._into, self._views
        result = do["matmul"](self._last, self._flat(_STATE, _STACK), None if views is None else views.result_flat)
        result = xp.reshape(result, (4, self.rows, self.width))
        new, errors = result[0, ...], result[1:, ...]
        spare, size = (None, None) if views is None else (views.spare, views.trial)
        size = do["maximum"](do["abs"](self.stack[_STATE, ...], spare), do["abs"](new, size), size)
        scale = do["add"](do["multiply"](size, self.rtol, size), self.atol, size)
        target = None if views is None else errors
        errors = do["divide"](errors, scale, target)
        return new, xp.sum(do["multiply"](errors, errors, target), axis=1)

    def _next_steps(self, h: AnyArray, error: AnyArray, accepted: AnyArray, landing: AnyArray) -> None:
        xp = self.arrays.xp
        now = xp.maximum(error, self._least_error)
        predicted = SAFETY * now ** (0.75 * MEMORY - 1.0 / ORDER) * self.former**MEMORY
        factor = xp.where(xp.isnan(predicted), LEAST, xp.clip(predicted, LEAST, self.ceiling))
        following = h * factor
        # A step cut short to land says little about the next one.
        self.h = xp.where(accepted & landing, xp.maximum(following, self.h), following)
        self.ceiling = xp.where(accepted, self._most, 1.0)
        self.former = xp.where(accepted, xp.maximum(now, self._calm), self.former)

    def _choose_first_steps(self) -> None:
        """Choose first steps by the size of the state and of its slope (Hairer, Norsett and Wanner, II.4)."""
        xp, y, slope = self.arrays.xp, self.stack[_STATE, ...], self.stack[_SLOPE[0], ...]
        scale = xp.abs(y) * self.rtol + self.atol
        size, speed = (xp.sqrt(xp.sum((each / scale) ** 2, axis=0) / self.rows) for each in (y, slope))
        least = 1e-6 * (self.end - self.t)
        by_size = xp.where((size < 1e-5) | (speed < 1e-5), least, 0.01 * size / speed)
        by_order = (0.01 / xp.maximum(speed, self._least_error)) ** (1.0 / ORDER)
        first = xp.minimum(100.0 * by_size, by_order)
        self.h = xp.where(self.fresh, xp.where(xp.isfinite(first), first, least), self.h)
        self.fresh, self._any_fresh = xp.zeros_like(self.fresh), False


def block_of(
    system: Any, arrays: Arrays, rtol: float, width: int, parameters: int, machine: Machine | None = None
) -> Block:
    """Return an empty block.

    Parameters
    ----------
    system : System
        What is integrated.
    arrays : Arrays
        The library to compute with.
    rtol : float
        Relative tolerance.
    width : int
        How many columns.
    parameters : int
        How many parameters a column has.
    machine : callable, optional
        What tries a step in machine code.

    Returns
    -------
    Block
    """

    def filled(value: float, *shape: int) -> AnyArray:
        return arrays.of(np.full((*shape, width), value))

    return Block(
        arrays,
        system.rate(arrays, width),
        system.autonomous,
        system.switching,
        rtol,
        machine,
        lambda other: block_of(system, arrays, rtol, other, parameters, machine),
        stack=filled(0.0, _STACK, system.rows),
        p=filled(0.0, parameters),
        **{name: filled(1.0) for name in ("t", "h", "end", "longest", "atol", "ceiling", "former", "speed")},
        fresh=arrays.mask(np.zeros(width)),
        alive=np.zeros(width, dtype=bool),
        **{name: np.zeros(width, dtype=np.intp) for name in ("ids", "leg", "steps")},
    )
