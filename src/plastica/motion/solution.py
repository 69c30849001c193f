"""A finished motion: the model, its history, how it ended, and everything that follows from them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from functools import cached_property
from math import prod
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from plastica.errors import ArgumentError
from plastica.motion.history import History
from plastica.motion.record import Counts, Event
from plastica.physics.bounds import Bounds, bounds
from plastica.physics.ledger import Ledger, kinetic_energy, stored_energy
from plastica.physics.model import Model
from plastica.physics.status import Status

if TYPE_CHECKING:
    import xarray

    from plastica.equilibria.limits import Limit
    from plastica.motion.outcome import Outcome

__all__ = ["Solution"]

Array = NDArray[np.float64]
Indices = NDArray[np.intp]

LARGEST_TABLE = 20_000_000
"""Values that `at` will compute in one call."""

LARGEST_WORK = 1_000_000_000
"""Different times by nodes that `at` will go through in one call: about a minute."""

BLOCK = 650_000
"""Values at nodes and places that `at` keeps at once, about 20 000 times on 16 nodes: some fifty megabytes."""


UNJUDGED = (ArithmeticError, ValueError, RuntimeError, MemoryError)
"""What may go wrong where a motion that is computed is judged: laws far from all that was looked at, want of memory."""


@dataclass(frozen=True, eq=False)
class Solution:
    """A motion of a model, as returned by `solve` and `read`.

    Attributes
    ----------
    model : Strut or Rod
        The model, on the grid that was used.
    history : History
        The dimensionless state as a function of dimensionless time.
    legs : tuple of (ndarray, ndarray)
        Start times of the legs, and whether the natural curvature moves on each (one more: after the last), with
        several segments a column for each of them.
    status : Status
        How the run ended.
    counts : Counts
        Steps and evaluations.
    method, rtol, atol
        How it was computed; atol dimensionless.
    times : ndarray or None
        Times asked for, in the user's units.
    initial : str
        The initial curvature in words.
    first_natural : ndarray, shape () or (m,)
        Dimensionless natural curvature at the very first start, before any run that this one goes on from.
    notes : tuple of str
        What the user should know: breaks added, nodes chosen, hypotheses waived.
    wall : float
        Seconds taken.
    provenance : dict
        Where it comes from: scenario text, file, ...
    """

    model: Model
    history: History
    legs: tuple[Array, NDArray[np.bool_]]
    status: Status
    counts: Counts
    method: str
    rtol: float
    atol: float
    times: Array | None
    initial: str
    first_natural: Array
    notes: tuple[str, ...] = ()
    wall: float = 0.0
    provenance: dict[str, str] = field(default_factory=dict)

    @property
    def grid(self) -> Any:
        """The grid that was used."""
        return self.model.grid

    @cached_property
    def limit(self) -> Limit | None:
        """Where the motion ends; None where the theory does not apply, "undecided" where computing it fails.

        That is: with inertia, a damping other than 1, several segments, loads that vary on, or others than a thrust.
        """
        from plastica.equilibria.limits import untold
        from plastica.motion.longtime import limit_of

        try:
            return limit_of(self)
        except UNJUDGED as error:
            return untold(error)

    @cached_property
    def t(self) -> Array:
        """Dimensionless times of the dataset: `times`, or the accepted steps with knots and events."""
        if self.times is not None:
            # Rounding on the way through the units must not put the last time beyond the end.
            return np.clip(self.times / self.model.scales.time, self.history.start, self.history.end)
        from plastica.motion.events import moments

        return np.union1d(self.history.t[self.history.accepted], moments(self))

    @cached_property
    def y(self) -> Array:
        """Dimensionless states at `t`; shape (k, size), see `physics.layout`."""
        accepted = self.history.accepted
        if self.times is None and self.t.size == accepted.size:
            return self.history.y[accepted]
        return self.history(self.t)

    @cached_property
    def dataset(self) -> xarray.Dataset:
        """Everything as labelled arrays with units, over coordinates t and s (`xarray.Dataset`)."""
        from plastica.motion.dataset import dataset

        return dataset(self)

    def to_dataset(self) -> xarray.Dataset:
        """Return `dataset`."""
        return self.dataset

    @cached_property
    def events(self) -> tuple[Event, ...]:
        """Onsets and arrests of yielding, knots of the loads, quarter turns of the tip, in order of time."""
        from plastica.motion.events import events

        return events(self)

    @cached_property
    def outcome(self) -> Outcome:
        """The verdict in words: straight, bent, buckled; springs back or keeps a set; how far from rest.

        Where judging fails, the words say so: what was computed is neither lost nor in doubt.
        """
        from plastica.motion.outcome import outcome, unjudged

        try:
            return outcome(self)
        except UNJUDGED as error:
            return unjudged(error)

    @cached_property
    def bounds(self) -> Bounds:
        """The a-priori bounds of the theory for this start, never exceeded by the motion."""
        layout, y = self.model.layout, self.history.y[0]
        start, end = self.history.start, self.history.end
        return bounds(self.model, layout.mu(y), layout.natural(y), start, end, layout.mu_t(y))

    @cached_property
    def ledger(self) -> Ledger:
        """Balance of work, stored energy and dissipation over the whole motion, in J with a specimen, else EI/L."""
        layout = self.model.layout
        states = self.history.y[self.history.accepted]
        mu, sheet = layout.mu(states), layout.ledger(states)
        energy = stored_energy(self.model, mu, layout.natural(states))
        kinetic = kinetic_energy(self.model, mu, layout.mu_t(states))
        work, viscous, natural = sheet[-1] - sheet[0]
        change, gained = energy[-1] - energy[0], kinetic[-1] - kinetic[0]
        scale = self.model.scales.energy
        largest = max(float(np.abs(each).max()) for each in (energy, kinetic, sheet))
        return Ledger(
            residual=float(work - change - viscous - natural - gained) * scale,
            work=float(work) * scale,
            stored_energy=float(change) * scale,
            viscous_dissipation=float(viscous) * scale,
            natural_dissipation=float(natural) * scale,
            kinetic_energy=float(gained) * scale,
            largest_energy=largest * scale,
            unit="J" if self.model.specimen is not None else "1",
        )

    def at(self, s: ArrayLike, t: ArrayLike) -> Array | float:
        """Curvature at arc lengths s and times t, as accurate as the computation itself.

        Parameters
        ----------
        s, t : array_like
            Arc length (m, or units of L) and time (s, or retardation times); they broadcast, scalars give a scalar. At
            an element end the value is the limit from the right.

        Returns
        -------
        float or ndarray
            Curvature in 1/m, or 1/L without a specimen.

        Raises
        ------
        ArgumentError
            Where s is not on the rod, t not in the time computed, or there are too many values (20 million) or too many
            times on too many nodes. What memory it takes beyond the values does not grow with their number.
        """
        scales = self.model.scales
        try:
            where = np.asarray(s, dtype=float) / scales.length
            when = np.asarray(t, dtype=float) / scales.time
            shape = np.broadcast_shapes(where.shape, when.shape)
        except (TypeError, ValueError):
            raise ArgumentError("must be numbers whose shapes broadcast", where="s, t") from None
        if prod(shape) > LARGEST_TABLE:
            raise _too_many(f"must give at most {LARGEST_TABLE} values", shape)
        start, end = self.history.start, self.history.end
        si = self.model.specimen is not None
        where, when = _snapped(where, 0.0, 1.0), _snapped(when, start, end)
        _within(where, 0.0, 1.0, "s", scales.length, " m, on the rod" if si else ", in units of its length")
        _within(when, start, end, "t", scales.time, f"{' s' if si else ''}, where the motion was computed")
        places, at_place = np.unique(where, return_inverse=True)
        moments, at_moment = np.unique(when, return_inverse=True)
        if moments.size * self.model.grid.size > LARGEST_WORK:
            raise _too_many(f"must be at most {LARGEST_WORK} times by nodes", moments.size * self.model.grid.size)
        index = np.broadcast_arrays(at_moment.reshape(when.shape), at_place.reshape(where.shape))
        values = self._between(moments, places, *(each.ravel() for each in index)).reshape(shape) * scales.curvature
        return float(values) if shape == () else values

    def _between(self, moments: Array, places: Array, at_moment: Indices, at_place: Indices) -> Array:
        """Curvature at pairs of moments and places, in blocks, so that memory does not grow with their number."""
        n = self.model.grid.size
        columns = max(1, BLOCK // (2 * n))
        rows = max(1, BLOCK // (2 * n + min(places.size, columns)))
        values = np.empty(at_moment.size)
        for first, chosen in _pieces(at_moment, rows):
            now = moments[first : first + rows]
            states = self.history(now)[:, :n]
            needed, at = np.unique(at_place[chosen], return_inverse=True)
            for start, part in _pieces(at, columns):
                table = self.model.curvature_between(now, states, places[needed[start : start + columns]])
                values[chosen[part]] = table[at_moment[chosen[part]] - first, at[part] - start]
        return values

    def with_provenance(self, **entries: str) -> Solution:
        """Return the same solution with further entries in its provenance."""
        return replace(self, provenance={**self.provenance, **entries})

    def save(self, path: str | Path) -> Path:
        """Write the solution to a netCDF file, whole or not at all; `pl.read` gives back an equal one."""
        from plastica.motion.store import write

        return write(self, path)

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Solution):
            return NotImplemented
        same_times = (self.times is None and other.times is None) or (
            self.times is not None and other.times is not None and np.array_equal(self.times, other.times)
        )
        return (
            same_times
            and self.model == other.model
            and (self.status, self.counts, self.method, self.rtol, self.atol, self.initial, self.notes)
            == (other.status, other.counts, other.method, other.rtol, other.atol, other.initial, other.notes)
            and np.array_equal(self.history.t, other.history.t)
            and np.array_equal(self.history.y, other.history.y)
            and np.array_equal(self.history.first, other.history.first)
        )

    __hash__ = None  # type: ignore[assignment]

    def __str__(self) -> str:
        from plastica.motion.outcome import introduction

        return introduction(self)

    __repr__ = __str__


def _snapped(values: Array, lower: float, upper: float) -> Array:
    """Values within rounding of an end are put on it: an SI length divided by itself may miss 1 by an ulp."""
    slack = 4.0 * np.finfo(float).eps * max(abs(lower), abs(upper))
    values = np.where((values > upper) & (values <= upper + slack), upper, values)
    return np.where((values < lower) & (values >= lower - slack), lower, values)


def _within(values: Array, lower: float, upper: float, name: str, scale: float, unit: str) -> None:
    """Refuse values outside [lower, upper] or not a number, in the user's units."""
    outside = ~((values >= lower) & (values <= upper))
    if outside.any():
        raise ArgumentError(
            f"must lie in [{lower * scale:.12g}, {upper * scale:.12g}]{unit}",
            where=name,
            value=float(values[outside].flat[0] * scale),
        )


def _too_many(rule: str, value: object) -> ArgumentError:
    return ArgumentError(rule, where="s, t", value=value, next_step="Ask for a part of them at a time.")


def _pieces(index: Indices, size: int) -> Iterator[tuple[int, Indices]]:
    """For each `size` numbers in turn that occur in `index`: the first of them, and where they occur."""
    if index.size == 0:
        return
    order = np.argsort(index, kind="stable")
    firsts = np.arange(0, int(index[order[-1]]) + 1 + size, size)
    cuts = np.searchsorted(index[order], firsts)
    for first, begin, end in zip(firsts[:-1], cuts[:-1], cuts[1:], strict=True):
        if end > begin:
            yield int(first), order[begin:end]
