"""Gauss collocation on [0, 1]: nodes, weights, and the two integrals that are exactly adjoint."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cache, cached_property
from itertools import pairwise
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from plastica.errors import ArgumentError

__all__ = ["AUTO_NODES", "Grid"]

Array = NDArray[np.float64]

LARGEST_NODES = 256
LARGEST_ELEMENTS = 1000
LARGEST_SIZE = 2048
"""Nodes in all: the matrices of a larger grid would take minutes and gigabytes."""

EVEN = 32
"""Evenly spaced points, enough to find the largest value of what has a few waves to a thousandth."""

AUTO_NODES = (8, 12, 16, 24, 32, 48, 64, 96, 128)
"""The node counts that ``Grid(nodes="auto")`` tries, in order."""


@dataclass(frozen=True)
class Grid:
    """Gauss-Legendre nodes on one or more elements of the rod, in the dimensionless arc length s in [0, 1].

    Nodal values stand for the polynomial through them on each element. ``A`` integrates it exactly from 0 to every
    node and ``B`` from every node to 1, so that with ``W = diag(w)`` the identity ``W B = (W A)^T`` holds: the
    discrete J and J* are adjoint, and the semi-discrete rod keeps its Liapunov function exactly.

    Parameters
    ----------
    nodes : int or "auto"
        Nodes per element. "auto" leaves the choice to `solve`, which takes the smallest count that resolves the
        whole motion and says which one it took.
    breaks : sequence of float
        Ends of the elements, increasing from 0 to 1. Put one at every jump of the data: rough initial shapes then
        cost no accuracy.

    Raises
    ------
    ArgumentError
        Where `nodes` is not an integer in [2, 256] or "auto", or `breaks` do not increase from 0 to 1.

    Notes
    -----
    Good values: for smooth data and anywhere along the rod, 16 nodes give 11 digits at a thrust of 1, 9 at 3 and 7 at 8
    (in EI/L**2), 24 nodes 11 at all of them; 12 are enough for plots.
    """

    nodes: int | Literal["auto"] = 16
    breaks: tuple[float, ...] = (0.0, 1.0)

    def __post_init__(self) -> None:
        if isinstance(self.nodes, np.ndarray) and self.nodes.ndim == 0:
            object.__setattr__(self, "nodes", self.nodes.item())
        if self.nodes != "auto":
            if isinstance(self.nodes, bool) or not isinstance(self.nodes, (int, np.integer)):
                raise ArgumentError('must be an integer or "auto"', where="nodes", value=self.nodes)
            if not 2 <= self.nodes <= LARGEST_NODES:
                raise ArgumentError(
                    f"must lie in [2, {LARGEST_NODES}]",
                    where="nodes",
                    value=self.nodes,
                    next_step="Take 16, or more elements with `breaks`.",
                )
            object.__setattr__(self, "nodes", int(self.nodes))
        object.__setattr__(self, "breaks", _checked_breaks(self.breaks))
        if self.nodes != "auto" and self.size > LARGEST_SIZE:
            raise ArgumentError(
                f"must give at most {LARGEST_SIZE} nodes in all",
                where="nodes",
                value=self.size,
                next_step="Take fewer nodes per element, or fewer breaks.",
            )

    @property
    def elements(self) -> int:
        """The number of elements."""
        return len(self.breaks) - 1

    @property
    def per_element(self) -> int:
        """The number of nodes on each element; an error where that is still open ("auto")."""
        if self.nodes == "auto":
            raise ArgumentError(
                'must be a number here, not "auto"',
                where="nodes",
                next_step="Only `solve` can choose the number of nodes; take e.g. grid.with_nodes(16).",
            )
        return int(self.nodes)

    @property
    def size(self) -> int:
        """The number of nodes in all."""
        return self.elements * self.per_element

    @cached_property
    def s(self) -> Array:
        """Nodes in (0, 1), increasing; shape (size,)."""
        x, _, _ = _reference_element(self.per_element)
        lower, width = self._lower_and_width
        return np.ravel(lower[:, None] + width[:, None] * (0.5 * (1.0 + x)))

    @cached_property
    def w(self) -> Array:
        """Quadrature weights, positive, of sum 1; shape (size,)."""
        _, weights, _ = _reference_element(self.per_element)
        return np.ravel(self._lower_and_width[1][:, None] * (0.5 * weights))

    @cached_property
    def A(self) -> Array:
        """Integral of the nodal interpolant from 0 to each node; shape (size, size)."""
        n, size = self.per_element, self.size
        _, _, inner = _reference_element(n)
        matrix = np.zeros((size, size))
        for e, width in enumerate(self._lower_and_width[1]):
            rows = slice(e * n, (e + 1) * n)
            matrix[rows, : e * n] = self.w[: e * n]
            matrix[rows, rows] = width * inner
        return matrix

    @cached_property
    def B(self) -> Array:
        """Integral of the nodal interpolant from each node to 1, B = 1 w^T - A; shape (size, size)."""
        return (self.w[:, None] * self.A).T / self.w[:, None]

    @cached_property
    def even_integrals(self) -> Array:
        """Integral of the nodal interpolant from 0 to points spaced evenly up to 1; shape (`EVEN`, size)."""
        return np.vstack([self.integration(np.arange(1, EVEN) / EVEN), self.w])

    @cached_property
    def _lower_and_width(self) -> tuple[Array, Array]:
        breaks = np.asarray(self.breaks)
        return breaks[:-1], np.diff(breaks)

    def with_nodes(self, nodes: int) -> Grid:
        """Return the same elements with another number of nodes on each."""
        return Grid(nodes, self.breaks)

    def refined(self) -> Grid:
        """Return the grid with twice the nodes on each element; where that would be too many, with each element halved.

        The grid itself where it would have too many nodes in all.
        """
        if 2 * self.size > LARGEST_SIZE or 2 * self.elements > LARGEST_ELEMENTS:
            return self
        if 2 * self.per_element <= LARGEST_NODES:
            return Grid(2 * self.per_element, self.breaks)
        lower, width = self._lower_and_width
        halves = np.sort(np.concatenate([lower, lower + 0.5 * width, [1.0]]))
        return Grid(self.per_element, tuple(halves.tolist()))

    def with_breaks(self, positions: Iterable[float]) -> Grid:
        """Return the grid with further element ends; positions at existing ends (to 1e-12) add nothing."""
        breaks = list(self.breaks)
        for position in sorted(positions):
            if all(abs(position - known) > 1e-12 for known in breaks):
                breaks.append(float(position))
        return self if len(breaks) == len(self.breaks) else Grid(self.nodes, tuple(sorted(breaks)))

    def element_of(self, s: ArrayLike) -> NDArray[np.intp]:
        """Return the index of the element that holds each s; a break belongs to the element on its right."""
        found = np.searchsorted(np.asarray(self.breaks), np.asarray(s, dtype=float), side="right") - 1
        return np.clip(found, 0, self.elements - 1)

    def interpolation(self, s: ArrayLike) -> Array:
        """Return the matrix that takes nodal values to the values of their interpolant at s.

        Parameters
        ----------
        s : array_like, shape (k,)
            Positions in [0, 1]. At a break the value is the limit from the right (at 1: from the left).

        Returns
        -------
        ndarray, shape (k, size)
        """
        n = self.per_element
        points = np.atleast_1d(np.asarray(s, dtype=float))
        if not np.all((points >= 0.0) & (points <= 1.0)):
            raise ArgumentError("must lie on the rod, in [0, 1] (dimensionless)", where="s", value=points)
        lower, width = self._lower_and_width
        element = self.element_of(points)
        x = 2.0 * (points - lower[element]) / width[element] - 1.0
        rows = _lagrange(n, x)
        matrix = np.zeros((points.size, self.size))
        columns = element[:, None] * n + np.arange(n)
        matrix[np.arange(points.size)[:, None], columns] = rows
        # The way through the element's coordinate rounds; a node must give its own value to the last bit.
        node = np.minimum(np.searchsorted(self.s, points), self.size - 1)
        hit = self.s[node] == points
        matrix[hit] = 0.0
        matrix[hit, node[hit]] = 1.0
        return matrix

    def integration(self, s: ArrayLike) -> Array:
        """Return the matrix from nodal values to the integral of their interpolant from 0 to s; shape (k, size)."""
        n = self.per_element
        points = np.atleast_1d(np.asarray(s, dtype=float))
        lower, width = self._lower_and_width
        element = self.element_of(points)
        x = 2.0 * (points - lower[element]) / width[element] - 1.0
        inner = _integrals(x, *_reference_element(n)[:2]) * width[element][:, None]
        matrix = np.where(np.arange(self.size) < element[:, None] * n, self.w, 0.0)
        columns = element[:, None] * n + np.arange(n)
        matrix[np.arange(points.size)[:, None], columns] = inner
        return matrix

    def legendre(self, values: ArrayLike) -> Array:
        """Return the Legendre coefficients of the interpolant on each element.

        Parameters
        ----------
        values : array_like, shape (..., size)

        Returns
        -------
        ndarray, shape (..., elements, nodes)
            Coefficients of P_0 ... P_{n-1} in the element's own coordinate.
        """
        n = self.per_element
        array = np.asarray(values, dtype=float)
        return array.reshape(*array.shape[:-1], self.elements, n) @ _legendre_analysis(n).T

    def tail(self, values: ArrayLike) -> Array:
        """Return how much of the interpolant sits in its last two Legendre coefficients; shape (...).

        The largest of them over all elements: an estimate of the interpolation error of functions whose
        coefficients decay geometrically.
        """
        return np.asarray(np.abs(self.legendre(values)[..., -2:]).max(axis=(-2, -1)))


def _checked_breaks(breaks: Sequence[float]) -> tuple[float, ...]:
    hint = "Give the ends of the elements, e.g. (0, 0.5, 1)."
    try:
        ends = tuple(_number(b) for b in breaks)
    except (TypeError, ValueError):
        raise ArgumentError("must be a sequence of numbers", where="breaks", value=breaks, next_step=hint) from None
    increasing = len(ends) >= 2 and all(a < b for a, b in pairwise(ends))
    if not increasing or ends[0] != 0.0 or ends[-1] != 1.0:
        raise ArgumentError("must increase from 0 to 1", where="breaks", value=ends, next_step=hint)
    if len(ends) - 1 > LARGEST_ELEMENTS:
        raise ArgumentError(f"must make at most {LARGEST_ELEMENTS} elements", where="breaks", value=len(ends) - 1)
    return ends


def _number(value: float) -> float:
    # A text is a sequence, too, and float would read its characters.
    if isinstance(value, (str, bytes)):
        raise TypeError(value)
    return float(value)


def _legendre_table(degree: int, x: Array) -> Array:
    """Values of P_0 ... P_degree at x by the three-term recurrence; shape (len(x), degree + 1)."""
    table = np.empty((x.size, degree + 1))
    table[:, 0] = 1.0
    if degree > 0:
        table[:, 1] = x
    for k in range(1, degree):
        table[:, k + 1] = ((2 * k + 1) * x * table[:, k] - k * table[:, k - 1]) / (k + 1)
    return table


@cache
def _reference_element(n: int) -> tuple[Array, Array, Array]:
    """Nodes and weights on [-1, 1], and the integration matrix of the element scaled to width 1."""
    x, w = np.polynomial.legendre.leggauss(n)
    x, w = 0.5 * (x - x[::-1]), 0.5 * (w + w[::-1])
    w *= 2.0 / w.sum()
    weighted = 0.5 * w[:, None] * _integrals(x, x, w)
    # The part beyond the mean is antisymmetric in exact arithmetic; making it so here removes the rounding that
    # would break the adjointness of J and J*.
    mean = 0.125 * np.outer(w, w)
    skew = weighted - mean
    skew = 0.5 * (skew - skew.T)
    return x, w, (skew + mean) / (0.5 * w[:, None])


def _integrals(x: Array, nodes: Array, weights: Array) -> Array:
    """Integrals of the Lagrange polynomials from -1 to x, on the element scaled to width 1; shape (len(x), n)."""
    n = nodes.size
    at_nodes = _legendre_table(n, nodes)
    at_x = _legendre_table(n, x)
    differences = at_x[:, 2:] - at_x[:, : n - 1]
    return 0.25 * weights * ((1.0 + x)[:, None] + differences @ at_nodes[:, 1:n].T)


@cache
def _legendre_analysis(n: int) -> Array:
    """Nodal values to Legendre coefficients, by the quadrature that is exact for them; shape (n, n)."""
    x, w, _ = _reference_element(n)
    return (np.arange(n) + 0.5)[:, None] * _legendre_table(n - 1, x).T * w


def _lagrange(n: int, x: Array) -> Array:
    """Values of the Lagrange polynomials at x by the barycentric formula; shape (len(x), n)."""
    nodes, w, _ = _reference_element(n)
    barycentric = (-1.0) ** np.arange(n) * np.sqrt((1.0 - nodes**2) * w)
    difference = x[:, None] - nodes
    at_node = difference == 0.0
    hit = at_node.any(axis=1)
    difference[at_node] = 1.0
    terms = barycentric / difference
    rows = terms / terms.sum(axis=1, keepdims=True)
    rows[hit] = at_node[hit].astype(float)
    return np.asarray(rows)
