"""Whether a grid resolves a motion: the decay of Legendre coefficients."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from plastica.motion.integrate import Ending, Stop
from plastica.numerics.grid import Grid
from plastica.physics.kernel import Kernel
from plastica.physics.model import Model

__all__ = ["coarse", "too_coarse"]

Array = NDArray[np.float64]

EPS = float(np.finfo(float).eps)
STATES_AT_ONCE = 1000


def too_coarse(strut: Model, states: Array, rtol: float, size: float | None = None) -> float | None:
    """Return the relative Legendre tail of a motion where it exceeds the tolerance, else None.

    Looks at the curvature, relative to its largest value, and at sin(theta) and cos(theta), whose products with the
    loads are what is integrated: relative to one, the sine to the largest curvature (which bounds it) if less.

    Parameters
    ----------
    strut : Model
        The model on the grid in question.
    states : ndarray, shape (k, size)
        States met on the way.
    rtol : float
        The relative tail allowed; never below 50 eps, where rounding takes over.
    size : float, optional
        Largest curvature met, by default that of these states.

    Returns
    -------
    float or None
    """
    n = strut.grid.size
    largest = float(np.abs(states[:, :n]).max()) if size is None else size
    if largest == 0.0:
        return None
    parts = range(0, states.shape[0], STATES_AT_ONCE)
    worst = max(_tail(strut.grid, states[i : i + STATES_AT_ONCE, :n], largest) for i in parts)
    return worst if worst > max(rtol, 50.0 * EPS) else None


def _tail(grid: Grid, mu: Array, size: float) -> float:
    theta = mu @ grid.A.T
    tails = (
        grid.tail(mu).max() / size,
        grid.tail(np.sin(theta)).max() / min(1.0, size),
        grid.tail(np.cos(theta)).max(),
    )
    return float(max(tails))


def coarse(strut: Model, rtol: float, size: float) -> Stop:
    """Return the criterion that gives up a run on too few nodes; it looks at every tenth step, which is cheaper.

    Parameters
    ----------
    strut : Model
        The model on the grid in question.
    rtol : float
        The relative tail allowed.
    size : float
        Largest curvature met so far.
    """
    n, steps = strut.grid.size, 0

    def criterion(t: float, y: Array, kern: Kernel) -> Ending | None:
        nonlocal steps, size
        steps, size = steps + 1, max(size, float(np.abs(y[:n]).max()))
        return "too_coarse" if steps % 10 == 0 and too_coarse(strut, y[None, :], rtol, size) is not None else None

    return criterion
