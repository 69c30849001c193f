"""Eigenvalues of K at an equilibrium, on two grids that are refined until they agree."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from plastica.equilibria.linear import EPS, FLOOR, MOST_NODES, Discrete, discretise, first_size

__all__ = ["Found", "eigenvalues"]

Array = NDArray[np.float64]

FAINT = 1e-6
"""A mode whose clamp curvature is below this share of its largest takes its sign from the largest instead."""

HALF = 0.5
"""Eigenvalues of K above this are always watched: they decide how many directions are unstable."""


class Found(NamedTuple):
    """All eigenvalues of the finer grid, descending, with errors and vectors; `below` picks the lowest, ascending.

    `resolved` is whether the two grids agree to rounding where it matters.
    """

    rho: Array
    errors: Array
    vectors: Array
    below: NDArray[np.intp]
    discrete: Discrete
    resolved: bool


def eigenvalues(gamma: float, alpha: float, count: int, lowest: int, depth: float | None = None) -> Found:
    """Compute all eigenvalues of K on two grids, the finer of which has twice the nodes of the other.

    They are refined until those that matter agree to rounding, or the grids become too large.

    Parameters
    ----------
    gamma, alpha : float
        Thrust and clamp curvature.
    count, lowest : int
        How many of the largest and of the most negative eigenvalues matter; all above 1/2 do as well.
    depth : float, optional
        As for `elastica.profile`, where alpha alone cannot tell.

    Returns
    -------
    Found
    """
    size = first_size(gamma, alpha, count + lowest)
    coarse: Array = np.linalg.eigvalsh(discretise(gamma, alpha, size, depth).K)[::-1].astype(float)
    while True:
        discrete = discretise(gamma, alpha, 2 * size, depth)
        rho, vectors = np.linalg.eigh(discrete.K)
        rho, vectors = rho[::-1], vectors[:, ::-1]
        floor = FLOOR * EPS * np.abs(rho).max() + discrete.doubt(discrete.M @ vectors)
        difference = np.abs(rho - _matched(coarse, rho.size))
        watched = np.zeros(rho.size, dtype=bool)
        watched[: max(count, int(np.count_nonzero(rho > HALF)))] = True
        below = np.arange(rho.size - 1, rho.size - 1 - lowest, -1)
        watched[below[rho[below] < -floor[below]]] = True
        resolved = bool(np.all(difference[watched] <= floor[watched]))
        if resolved or 2 * size > MOST_NODES:
            errors = difference + floor
            real = below[rho[below] < -errors[below] - EPS]
            return Found(rho, errors, _signed(vectors, discrete), real, discrete, resolved)
        size, coarse = 2 * size, rho


def _matched(coarse: Array, size: int) -> Array:
    """Eigenvalues of the coarser grid in the places of the finer's: both ends kept, zeros between.

    What the coarser grid lacks are eigenvalues next to 0, where the spectrum of K accumulates.
    """
    out = np.zeros(size)
    positive = int(np.count_nonzero(coarse > 0.0))
    out[:positive] = coarse[:positive]
    out[size - (coarse.size - positive) :] = coarse[positive:]
    return out


def _signed(vectors: Array, discrete: Discrete) -> Array:
    """Modes with positive curvature at the clamp, or where that is faint, where they are largest."""
    nodal = vectors / np.sqrt(discrete.grid.w)[:, None]
    clamp = (discrete.grid.interpolation([0.0]) @ nodal)[0]
    at = np.abs(nodal).argmax(axis=0)
    largest = nodal[at, np.arange(nodal.shape[1])]
    decides = np.where(np.abs(clamp) >= FAINT * np.abs(largest), clamp, largest)
    return vectors * np.where(decides < 0.0, -1.0, 1.0)
