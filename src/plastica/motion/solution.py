"""A finished motion: the model, its history, how it ended, and everything that follows from them."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from plastica.errors import ArgumentError
from plastica.motion.history import History
from plastica.motion.status import Counts, Event, Status
from plastica.physics.bounds import Bounds, bounds
from plastica.physics.ledger import Ledger, stored_energy
from plastica.physics.strut import Strut

if TYPE_CHECKING:
    import xarray

    from plastica.equilibria.limits import Limit
    from plastica.motion.outcome import Outcome

__all__ = ["Solution"]

Array = NDArray[np.float64]

LARGEST_TABLE = 50_000_000
"""Values that `at` will compute in one call."""


@dataclass(frozen=True, eq=False)
class Solution:
    """A motion of a model, as returned by `solve` and `read`.

    Attributes
    ----------
    model : Strut
        The model, on the grid that was used.
    history : History
        The dimensionless state as a function of dimensionless time.
    legs : tuple of (ndarray, ndarray)
        Start times of the legs, and whether the natural curvature moves on each (one more: after the last).
    status : Status
        How the run ended.
    counts : Counts
        Steps and evaluations.
    method, rtol, atol
        How it was computed; atol dimensionless.
    times : ndarray or None
        Dimensionless times asked for.
    initial : str
        The initial curvature in words.
    notes : tuple of str
        What the user should know: breaks added, nodes chosen, hypotheses waived.
    wall : float
        Seconds taken.
    provenance : dict
        Where it comes from: scenario text, file, ...
    """

    model: Strut
    history: History
    legs: tuple[Array, NDArray[np.bool_]]
    status: Status
    counts: Counts
    method: str
    rtol: float
    atol: float
    times: Array | None
    initial: str
    notes: tuple[str, ...] = ()
    wall: float = 0.0
    provenance: dict[str, str] = field(default_factory=dict)

    @property
    def grid(self) -> Any:
        """The grid that was used."""
        return self.model.grid

    @cached_property
    def limit(self) -> Limit | None:
        """Where the motion ends; None where the theory does not apply: loads that vary on, or others than a thrust."""
        from plastica.motion.longtime import limit_of

        return limit_of(self)

    @cached_property
    def t(self) -> Array:
        """Dimensionless times of the dataset: `times`, or the accepted steps."""
        if self.times is not None:
            return self.times
        return self.history.t[self.history.accepted]

    @cached_property
    def y(self) -> Array:
        """Dimensionless states at `t`; shape (k, n + 4)."""
        if self.times is not None:
            return self.history(self.times)
        return self.history.y[self.history.accepted]

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
        """The verdict in words: straight, bent, buckled; springs back or keeps a set; how far from rest."""
        from plastica.motion.outcome import outcome

        return outcome(self)

    @cached_property
    def bounds(self) -> Bounds:
        """The a-priori bounds of the theory for this start, never exceeded by the motion."""
        n = self.model.grid.size
        y = self.history.y[0]
        return bounds(self.model, y[:n], float(y[n]), self.history.start, self.history.end)

    @cached_property
    def ledger(self) -> Ledger:
        """Balance of work, stored energy and dissipation over the whole motion, in J with a specimen, else EI/L."""
        n = self.model.grid.size
        states = self.history.y[self.history.accepted]
        energy = stored_energy(self.model, states[:, :n], states[:, n])
        work, viscous, natural = states[-1, n + 1 :] - states[0, n + 1 :]
        change = energy[-1] - energy[0]
        scale = self.model.scales.energy
        largest = max(float(np.abs(energy).max()), float(np.abs(states[:, n + 1 :]).max()))
        return Ledger(
            residual=float(work - change - viscous - natural) * scale,
            work=float(work) * scale,
            stored_energy=float(change) * scale,
            viscous_dissipation=float(viscous) * scale,
            natural_dissipation=float(natural) * scale,
            kinetic_energy=0.0,
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
            Where s is not on the rod, t not in the time computed, or there are too many values.
        """
        scales = self.model.scales
        try:
            where = np.asarray(s, dtype=float) / scales.length
            when = np.asarray(t, dtype=float) / scales.time
            shape = np.broadcast_shapes(where.shape, when.shape)
        except (TypeError, ValueError):
            raise ArgumentError("must be numbers whose shapes broadcast", where="s, t") from None
        if int(np.prod(shape)) > LARGEST_TABLE:
            raise ArgumentError(f"must give at most {LARGEST_TABLE} values", where="s, t", value=shape)
        places, at_place = np.unique(_snapped(where, 0.0, 1.0), return_inverse=True)
        moments, at_moment = np.unique(_snapped(when, self.history.start, self.history.end), return_inverse=True)
        table = self.model.curvature_between(moments, self.history(moments)[:, : self.model.grid.size], places)
        index = np.broadcast_arrays(at_moment.reshape(when.shape), at_place.reshape(where.shape))
        values = table[tuple(index)] * scales.curvature
        return float(values) if shape == () else values

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
