"""All clamp curvatures of equilibria with one natural curvature, for many thrusts at once."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from plastica.equilibria.elastica import ends
from plastica.errors import ArgumentError
from plastica.numerics.roots import Roots, roots_of_rows
from plastica.physics.amounts import plain

__all__ = ["LAYER", "LONGEST", "frozen_alphas", "number", "pieces_for"]

Array = NDArray[np.float64]
Rows = NDArray[np.int64]

LONGEST = 1e5
"""Clamp curvature up to which ranges are searched."""

LAYER = 700.0
"""Thrust up to which the layer at the separatrix, of relative width exp(-gamma^(1/2)), is resolved in doubles."""

NEXT = 0.1
"""Distance from the end of a range within which the separatrix needs no cut of its own."""

PIECE = 4.0
"""Length of the pieces to begin with: beyond the separatrix everything oscillates with a period of 2 pi or more."""


def frozen_alphas(gamma: Array, natural: float) -> tuple[Roots, ...]:
    """Find all alpha with phi_alpha'(1) = natural, for many thrusts at once.

    Parameters
    ----------
    gamma : ndarray, shape (rows,)
        Thrusts.
    natural : float
        Natural curvature.

    Returns
    -------
    tuple of Roots
        One for each thrust.

    Raises
    ------
    ArgumentError
        Where the natural curvature or a thrust is too large for all to be told apart.
    """
    if gamma.max() > LAYER:
        raise ArgumentError(
            f"must be at most {LAYER:g} where all equilibria of one natural curvature are asked for",
            where="gamma",
            value=float(gamma.max()),
            next_step="Next to the separatrix they are closer together than doubles can tell.",
        )
    farthest = np.hypot(natural, 2.0 * np.sqrt(gamma)) * (1.0 + 1e-9) + 1e-3
    if farthest.max() > LONGEST:
        raise ArgumentError(f"must be at most {LONGEST:g} in size", where="natural_curvature", value=natural)

    def off(x: Array, row: Rows) -> Array:
        return ends(gamma[row], x).mu_nat - natural

    def size(x: Array, row: Rows) -> Array:
        return np.abs(x) + 0.5 * gamma[row] + abs(natural)

    breaks = [_breaks(g, w) for g, w in zip(2.0 * np.sqrt(gamma), farthest, strict=True)]
    pieces = [pieces_for(2.0 * x) for x in farthest.tolist()]
    return roots_of_rows(off, -farthest, farthest, breaks=breaks, size=size, pieces=pieces)


def _breaks(separatrix: float, farthest: float) -> tuple[float, ...]:
    """Cut at 0, and at the separatrix where it is not next to the end, which is looked at anyway."""
    return (-separatrix, 0.0, separatrix) if farthest - separatrix > NEXT else (0.0,)


def number(value: object, where: str, least: float = -math.inf) -> float:
    """Read a finite number, in the range of the closed forms.

    Raises
    ------
    ArgumentError
        If it is none, or below `least`.
    """
    read = plain(value)
    if not isinstance(read, float) or not math.isfinite(read):
        raise ArgumentError("must be a finite number", where=where, value=value)
    if read < least:
        words = "must not be negative: tension is not treated" if where == "gamma" else f"must be at least {least:g}"
        raise ArgumentError(words, where=where, value=value)
    return read


def pieces_for(length: float) -> int:
    """Return how many pieces to begin with on a range of that length."""
    return 4 + math.ceil(length / PIECE)
