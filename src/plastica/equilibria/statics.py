"""The balance of moments at frozen natural curvature: its static shapes, and which directions grow from them."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from plastica.physics.kernel import load_moment
from plastica.physics.ledger import liapunov
from plastica.physics.model import Model

__all__ = ["CONVERGED", "MOST_STEPS", "balanced", "downhill", "statics", "symmetric_spectrum", "unstable_directions"]

Array = NDArray[np.float64]

MOST_STEPS = 500
CONVERGED = 1e-13
"""Residual, relative to the largest curvature or one, at which the rod is at rest to rounding."""

NEWTON_STEPS = 12

EDGE = 1e-12
"""Rate of growth that rounding can give a shape at the edge of stability."""


def statics(model: Model, mu_nat: float | Array) -> tuple[Callable[[Array], Array], Callable[[Array], Array]]:
    """Functions of mu: the imbalance of moments M - (mu - mu_nat), and its derivative."""
    moment, slope = load_moment(model, 0.0, 1.0)
    A, natural = model.grid.A, model.division.spread(mu_nat)
    identity = np.eye(model.grid.size)
    return lambda mu: moment(0.0, A @ mu) - mu + natural, lambda mu: slope(0.0, A @ mu) @ A - identity


def symmetric_spectrum(jacobian: Array, model: Model) -> Array:
    """Growth rates at frozen natural curvature, ascending: the Jacobian is symmetric in the weighted inner product."""
    root = np.sqrt(model.grid.w)
    scaled = root[:, None] * jacobian / root
    return np.asarray(np.linalg.eigvalsh(0.5 * (scaled + scaled.T)))


def downhill(model: Model, mu: Array, mu_nat: float | Array, most: int = MOST_STEPS) -> tuple[Array, float]:
    """Return the static shape downhill from a state, and what is left of the balance of moments."""
    imbalance, stiffness = statics(model, mu_nat)
    identity = np.eye(model.grid.size)
    step = 1.0
    residual, energy = imbalance(mu), float(liapunov(model, 0.0, mu, mu_nat))
    for _ in range(most):
        scale = max(1.0, float(np.abs(mu).max()))
        if np.abs(residual).max() <= CONVERGED * scale or step < 1e-12:
            break
        jacobian = stiffness(mu)
        fastest = float(symmetric_spectrum(jacobian, model)[-1])
        if fastest > 0.0:
            # Beyond 1/rate an implicit step throws what grows to the other side: to another shape than the nearest.
            step = min(step, 0.5 / fastest)
        tried = mu + np.linalg.solve(identity / step - jacobian, residual)
        new_residual = imbalance(tried)
        new_energy = float(liapunov(model, 0.0, tried, mu_nat))
        lower = new_energy <= energy + 1e-14 * max(1.0, abs(energy))
        if lower and np.isfinite(new_residual).all():
            stalled = step > 1e12 and np.abs(new_residual).max() >= np.abs(residual).max()
            mu, residual, energy, step = tried, new_residual, new_energy, min(4.0 * step, 1e15)
            if stalled:
                break
        else:
            step *= 0.125
    return mu, float(np.abs(residual).max())


def balanced(model: Model, mu: Array, mu_nat: float | Array) -> tuple[Array, bool]:
    """Find the next static shape, be it stable or not, by Newton's method for mu = mu_nat + M(mu).

    Returns
    -------
    mu : ndarray, shape (n,)
        The shape at the nodes.
    converged : bool
        Whether the moments balance to rounding.
    """
    imbalance, stiffness = statics(model, mu_nat)
    for _ in range(NEWTON_STEPS):
        residual, size = imbalance(mu), max(1.0, float(np.abs(mu).max()))
        left = float(np.abs(residual).max())
        if not left > CONVERGED * size:
            break
        try:
            mu = mu - np.linalg.solve(stiffness(mu), residual)
        except np.linalg.LinAlgError:
            break
    return mu, left <= 100.0 * CONVERGED * size


def unstable_directions(model: Model, mu: Array, mu_nat: float | Array) -> int:
    """Count the unstable directions of a static shape under constant loads, at frozen natural curvature.

    Inertia and damping change how fast a disturbance grows, not whether it does: the loads have a potential.

    Parameters
    ----------
    model : Strut or Rod
        The rod, its loads constant.
    mu : ndarray, shape (n,)
        Dimensionless curvature at the nodes.
    mu_nat : float, or ndarray of shape (m,) with several segments
        Dimensionless natural curvature.
    """
    _, stiffness = statics(model, mu_nat)
    return int(np.count_nonzero(symmetric_spectrum(stiffness(mu), model) > EDGE))
