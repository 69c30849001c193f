"""The static shape that the motion at frozen natural curvature goes to, and whether that is shown.

The steps of `statics.downhill` find *a* static shape fast. Where the state is not certainly held by it
(`equilibria.contraction`), the motion itself is followed, with its error controlled, until one holds it.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

import numpy as np
from numpy.typing import NDArray

from plastica.equilibria.contraction import contracts
from plastica.equilibria.statics import CONVERGED, downhill, statics
from plastica.physics.model import Model

__all__ = ["follow", "holds"]

Array = NDArray[np.float64]

SPANS: Final = (0.5, *(2.0**k for k in range(-1, 11)))
"""Times, in retardation times, for which the motion is followed between two looks: to 2048 in all."""

RTOL: Final = 1e-10

MOST_RATES: Final = 20_000
"""Evaluations of the rate after which the motion is followed no farther."""


def holds(model: Model, mu: Array, shape: Array) -> bool:
    """Tell whether a state certainly goes to a static shape under the dead loads at time 0, its natural curvature held.

    Parameters
    ----------
    model : Strut or Rod
        The rod, its loads constant; inertia plays no part.
    mu, shape : ndarray, shape (n,)
        Dimensionless curvature of the state and of the static shape at the nodes.
    """
    w = model.grid.w
    distance = float(np.sqrt(w @ (mu - shape) ** 2))
    if distance <= CONVERGED * max(1.0, float(np.abs(shape).max())):
        return True
    along, across = model.dead_force(0.0)
    force, angle = np.hypot(along, across), model.angle(shape) + np.arctan2(across, along)
    return bool(contracts(model.grid, force[None, :], angle[None, :], np.array([distance]))[0])


def follow(model: Model, mu: Array, mu_nat: float | Array) -> tuple[Array, float, bool]:
    """Find the static shape that a state goes to at frozen natural curvature.

    Parameters
    ----------
    model : Strut or Rod
        The rod, its loads constant; inertia plays no part.
    mu : ndarray, shape (n,)
        Dimensionless curvature at the nodes.
    mu_nat : float, or ndarray of shape (m,) with several segments
        Dimensionless natural curvature.

    Returns
    -------
    mu : ndarray, shape (n,)
        The static shape.
    residual : float
        What is left of the balance of moments.
    shown : bool
        Whether the state certainly goes there; else the shape is one downhill from where the motion was left.
    """
    shape, residual = downhill(model, mu, mu_nat)
    if _found(shape, residual) and holds(model, mu, shape):
        return shape, residual, True
    left, rates = MOST_RATES, _Rates(*statics(model, mu_nat))
    for span in SPANS:
        later = rates.after(mu, span, left)
        if later is None:
            break
        mu, left = later, MOST_RATES - rates.count
        shape, residual = downhill(model, mu, mu_nat)
        if _found(shape, residual) and holds(model, mu, shape):
            return shape, residual, True
    return shape, residual, False


def _found(shape: Array, residual: float) -> bool:
    return residual <= 100.0 * CONVERGED * max(1.0, float(np.abs(shape).max()))


class _Rates:
    """The motion at frozen natural curvature, d mu/dt = M - (mu - mu_nat), and how often its rate was evaluated."""

    def __init__(self, imbalance: Callable[[Array], Array], stiffness: Callable[[Array], Array]) -> None:
        self.imbalance, self.stiffness, self.count = imbalance, stiffness, 0

    def after(self, mu: Array, span: float, most: int) -> Array | None:
        """State a time later; None where that takes more than `most` evaluations, or cannot be told."""
        from scipy.integrate import LSODA

        atol = RTOL * max(1e-3, float(np.abs(mu).max()))
        solver = LSODA(
            lambda t, y: self.imbalance(y), 0.0, mu, span, rtol=RTOL, atol=atol, jac=lambda t, y: self.stiffness(y)
        )
        while solver.status == "running" and solver.nfev <= most:
            solver.step()
        self.count += solver.nfev
        return np.array(solver.y) if solver.status == "finished" and np.isfinite(solver.y).all() else None
