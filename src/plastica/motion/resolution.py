"""Whether a grid resolves a motion: the decay of Legendre coefficients."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from plastica.physics.strut import Strut

__all__ = ["too_coarse"]

Array = NDArray[np.float64]

MOST_STATES = 400


def too_coarse(strut: Strut, states: Array, rtol: float) -> float | None:
    """Return the relative Legendre tail of a motion where it exceeds the tolerance, else None.

    Looks at the curvature, and at sin(theta) and cos(theta), whose products with the loads are what is integrated.
    The tail of each counts relative to the largest curvature, or to one.

    Parameters
    ----------
    strut : Strut
        The model on the grid in question.
    states : ndarray, shape (k, n + 4)
        States met on the way; at most a few hundred of them, evenly chosen, are looked at.
    rtol : float
        The relative tail allowed; never below 50 eps, where rounding takes over.

    Returns
    -------
    float or None
    """
    grid = strut.grid
    chosen = states[:: max(1, states.shape[0] // MOST_STATES), : grid.size]
    size = float(np.abs(chosen).max())
    if size == 0.0:
        return None
    theta = chosen @ grid.A.T
    # sin and cos are judged against the load's effect on the curvature, which is at most the size of the curvature.
    turn = max(1.0, float(np.abs(theta).max()))
    tails = (
        grid.tail(chosen).max() / size,
        grid.tail(np.sin(theta)).max() / min(1.0, max(float(np.abs(np.sin(theta)).max()), 1e-300)),
        grid.tail(np.cos(theta)).max(),
    )
    worst = float(max(tails))
    allowed = max(rtol, 50.0 * np.finfo(float).eps * turn)
    return worst if worst > allowed else None
