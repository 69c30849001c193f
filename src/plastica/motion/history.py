"""The state as a function of time: one polynomial per accepted step, kept by its values at Chebyshev points."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache, cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from plastica.errors import ArgumentError

__all__ = ["History", "chebyshev_points"]

Array = NDArray[np.float64]

BLOCK = 20_000
"""Times that are interpolated at once: what that takes beside the states themselves stays some megabytes."""


@cache
def chebyshev_points(degree: int) -> Array:
    """Chebyshev points of the second kind on [0, 1], increasing; shape (degree + 1,)."""
    return np.asarray(0.5 - 0.5 * np.cos(np.pi * np.arange(degree + 1) / degree))


@cache
def _barycentric_weights(degree: int) -> Array:
    weights = (-1.0) ** np.arange(degree + 1)
    weights[[0, -1]] *= 0.5
    return np.asarray(weights)


@dataclass(frozen=True, eq=False)
class History:
    """Piecewise polynomial in time, as accurate as the integrator's own dense output.

    Attributes
    ----------
    t : ndarray, shape (m,)
        Times of all nodes, step after step; the last node of a step is the accepted state.
    y : ndarray, shape (m, size)
        States at the nodes.
    first : ndarray of int, shape (steps + 1,)
        Where each step's nodes begin, and m at the end. Of very long runs only some steps are kept: see `gaps`.
    """

    t: Array
    y: Array
    first: NDArray[np.int64]

    @property
    def steps(self) -> int:
        """The number of steps."""
        return self.first.size - 1

    @property
    def start(self) -> float:
        """First time."""
        return float(self.t[0])

    @property
    def end(self) -> float:
        """Last time."""
        return float(self.t[-1])

    @property
    def accepted(self) -> NDArray[np.int64]:
        """Indices of the initial state and of the accepted states; shape (steps + 1,)."""
        return np.concatenate([[0], self.first[1:] - 1])

    @classmethod
    def at_rest(cls, t: float, y: Array) -> History:
        """The history of a run that did not take a step."""
        return cls(np.array([t]), y[None, :].copy(), np.array([0], dtype=np.int64))

    @classmethod
    def join(cls, parts: Sequence[History]) -> History:
        """Return histories that follow each other as one; those without a step add nothing."""
        parts = [part for part in parts if part.steps] or list(parts[:1])
        if parts[0].steps == 0:
            return parts[0]
        offsets = np.cumsum([0] + [part.t.size for part in parts[:-1]])
        first = [part.first[:-1] + offset for part, offset in zip(parts, offsets, strict=True)]
        size = int(offsets[-1]) + parts[-1].t.size
        return cls(
            np.concatenate([part.t for part in parts]),
            np.concatenate([part.y for part in parts]),
            np.concatenate([*first, [size]]).astype(np.int64),
        )

    def only(self, kept: NDArray[np.bool_]) -> History:
        """Return some of the steps, at least one; between them the motion is then not known.

        Parameters
        ----------
        kept : ndarray of bool, shape (steps,)
            Which.
        """
        nodes = np.repeat(kept, np.diff(self.first))
        first = np.concatenate([[0], np.cumsum(np.diff(self.first)[kept])]).astype(np.int64)
        return History(self.t[nodes], self.y[nodes], first)

    @cached_property
    def gaps(self) -> tuple[Array, Array]:
        """Begin and end of every stretch of time whose steps were not kept."""
        ends, begins = self.t[self.first[1:-1] - 1], self.t[self.first[1:-1]]
        apart = begins > ends
        return ends[apart], begins[apart]

    def snapped(self, times: ArrayLike) -> Array:
        """Return times with those in a gap moved to the nearer end of it, for pictures."""
        query = np.atleast_1d(np.asarray(times, dtype=float)).copy()
        ends, begins = self.gaps
        if ends.size:
            gap = np.minimum(np.searchsorted(begins, query, side="left"), ends.size - 1)
            inside = (query > ends[gap]) & (query < begins[gap])
            nearer = np.where(query - ends[gap] <= begins[gap] - query, ends[gap], begins[gap])
            query[inside] = nearer[inside]
        return query

    def _kept(self, query: Array) -> Array:
        """Refuse times in a gap; what rounding has carried into one is carried back."""
        near = self.snapped(query)
        inside = np.abs(near - query) > 8.0 * np.spacing(np.abs(query))
        if inside.any():
            raise ArgumentError(
                "must be times of the result, or next to them: of so long a run no others are kept",
                where="t",
                value=float(query[inside][0]),
                next_step="Solve with more `times`, or without.",
            )
        return near

    def __call__(self, times: ArrayLike) -> Array:
        """Return the state at `times`.

        Parameters
        ----------
        times : array_like, shape (k,)
            Dimensionless times in [start, end].

        Returns
        -------
        ndarray, shape (k, size)

        Raises
        ------
        ArgumentError
            Where a time lies outside what was computed, or in a gap.
        """
        query = np.atleast_1d(np.asarray(times, dtype=float))
        if not np.all((query >= self.start) & (query <= self.end)):
            raise ArgumentError(
                f"must lie in [{self.start:g}, {self.end:g}] (dimensionless), where the motion was computed",
                where="t",
                value=query,
            )
        if self.steps == 0:
            return np.repeat(self.y[:1], query.size, axis=0)
        query = self._kept(query)
        step = np.searchsorted(self.t[self.first[1:] - 1], query, side="left")
        out = np.empty((query.size, self.y.shape[1]))
        degree = np.diff(self.first) - 1
        for d in np.unique(degree[step]):
            alike = np.nonzero(degree[step] == d)[0]
            for chosen in (alike[i : i + BLOCK] for i in range(0, alike.size, BLOCK)):
                out[chosen] = self._polynomials(int(d), self.first[step[chosen]], query[chosen])
        return out

    def _polynomials(self, degree: int, first: NDArray[np.int64], query: Array) -> Array:
        """Barycentric interpolation at each query on the step whose nodes begin at `first`."""
        lower, upper = self.t[first], self.t[first + degree]
        difference = ((query - lower) / (upper - lower))[:, None] - chebyshev_points(degree)
        # The ends are hit often (they are the accepted states) and must come out bitwise.
        difference[query == lower, 0] = 0.0
        difference[query == upper, -1] = 0.0
        on_node = difference == 0.0
        difference[on_node] = 1.0
        terms = _barycentric_weights(degree) / difference
        hit = on_node.any(axis=1)
        terms[hit] = on_node[hit]
        terms /= terms.sum(axis=1, keepdims=True)
        out = np.zeros((query.size, self.y.shape[1]))
        for j in range(degree + 1):
            out += terms[:, j, None] * self.y[first + j]
        return out
