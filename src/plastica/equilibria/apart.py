"""Closed forms and products of matrices for many at once, of each to the last bit what it would be alone."""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import NDArray

from plastica.equilibria.elastica import BLOCK, GENTLE_ALPHA, GENTLE_GAMMA, Ends, ends
from plastica.numerics.arrays import LANES

__all__ = ["ends_apart", "product_apart"]

Array = NDArray[np.float64]

DEEPEST: Final = (4.0 * (1.0 + 2.0**-51), 4.0 * (1.0 + 2.0**-52))
"""Thrust and clamp curvature so near the separatrix, 1 - m = 2^-104, that none asks for more of Landen's steps."""

GENTLE: Final = (0.5 * GENTLE_GAMMA, 0.25 * GENTLE_ALPHA)
"""Thrust and clamp curvature of a rod whose arm is a quadrature."""


def ends_apart(gamma: Array, alpha: Array) -> Ends:
    """Return what `ends` does, without a trace of the other points in the last bits of any.

    Two things join points that `ends` is given at once: all take as many of Landen's steps as the one nearest the
    separatrix, and the quadratures of gentle rods are one matrix product. Beside them are therefore computed one rod
    that asks for the most steps, and as many gentle ones as fill the last lanes of the product.

    Parameters
    ----------
    gamma, alpha : ndarray
        Thrust and clamp curvature, as for `ends`; they broadcast.

    Returns
    -------
    Ends
        Arrays of the broadcast shape.
    """
    g, a = np.broadcast_arrays(gamma, alpha)
    most = BLOCK - LANES
    parts = [_block(g.ravel()[i : i + most], a.ravel()[i : i + most]) for i in range(0, max(g.size, 1), most)]
    return Ends(*(np.concatenate(column).reshape(g.shape) for column in zip(*parts, strict=True)))


def _block(gamma: Array, alpha: Array) -> tuple[Array, ...]:
    gentle = int(np.count_nonzero((gamma < GENTLE_GAMMA) & (np.abs(alpha) < GENTLE_ALPHA)))
    beside = np.array([DEEPEST, *[GENTLE] * (-gentle % LANES)])
    found = ends(np.concatenate([gamma, beside[:, 0]]), np.concatenate([alpha, beside[:, 1]]))
    return tuple(each[: gamma.size] for each in found)


def product_apart(rows: Array, matrix: Array) -> Array:
    """Return rows @ matrix, the rows filled up to whole lanes, so that BLAS treats all of them alike."""
    padded = np.pad(rows, ((0, -rows.shape[0] % LANES), (0, 0)), mode="edge")
    return np.asarray((padded @ matrix)[: rows.shape[0]])
