"""The rod linearised about a shape at rest, its natural curvature held: mass, damping and stiffness, symmetric."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from plastica.numerics.grid import Grid
from plastica.physics.model import Model
from plastica.physics.rod import Rod

__all__ = ["Linearised", "linearised"]

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Linearised:
    """M x_tt + D x_t + K x = 0 for small changes of curvature x W^(-1/2) at the nodes; dimensionless.

    W = diag(w) are the quadrature weights. In these coordinates D is the damping times the identity, M = F^T F and
    K = 1 - M_^T p M_ with M_ = W^(1/2) A W^(-1/2): all three are symmetric because the integrals A and B are adjoint.

    Attributes
    ----------
    grid : Grid
        Nodes and weights.
    theta : ndarray, shape (n,)
        Tangent angle at rest.
    factor : ndarray, shape (p, n)
        F, of n rows for each direction in which the rod has inertia; none without inertia.
    damping : float
        delta.
    K : ndarray, shape (n, n)
        Second variation of the Liapunov function at held natural curvature.
    """

    grid: Grid
    theta: Array
    factor: Array
    damping: float
    K: Array

    @cached_property
    def M(self) -> Array:
        """The mass matrix F^T F; shape (n, n)."""
        product = self.factor.T @ self.factor
        return np.asarray(0.5 * (product + product.T))

    @cached_property
    def root(self) -> Array:
        """W^(1/2), which takes nodal curvatures to x; shape (n,)."""
        return np.sqrt(self.grid.w)

    def nodal(self, matrix: Array) -> Array:
        """Return W^(1/2) matrix W^(1/2): the same quadratic form of nodal curvatures, symmetric to the last bit."""
        return np.outer(self.root, self.root) * matrix


def linearised(model: Model, theta: Array) -> Linearised:
    """Linearise a model about a shape at rest.

    To first order in a change u of the curvature, with psi = J u and the contact force n of the dead loads,

        M u_tt + delta u_t + u - J*[p psi] = 0,      p = -n.a = along cos(theta) - across sin(theta),

    M = B [eps0 + eps1 (cos BA cos + sin BA sin)] A of the design's section 1.2. The terms with theta_t^2 are of second
    order, and the derivative of M is multiplied by an acceleration that is 0 at rest.

    Parameters
    ----------
    model : Strut or Rod
        With constant loads.
    theta : ndarray, shape (n,)
        Tangent angle at the nodes of its grid.

    Returns
    -------
    Linearised
    """
    grid, root = model.grid, np.sqrt(model.grid.w)
    sin, cos = np.sin(theta), np.cos(theta)
    integral = root[:, None] * grid.A / root
    along, across = model.dead_force(0.0)
    pressing = along * cos - across * sin
    softening = (integral.T * pressing) @ integral
    stiffness = np.eye(grid.size) - 0.5 * (softening + softening.T)
    return Linearised(grid, theta, _factor(model, integral, sin, cos), float(model.damping), stiffness)


def _factor(model: Model, integral: Array, sin: Array, cos: Array) -> Array:
    """F, whose square is the kinetic energy: of rotation, and of both components of r_t = J[theta_t b]."""
    translation, rotary = 0.0, 0.0
    if isinstance(model, Rod):
        translation, rotary = float(model.translational_inertia or 0.0), float(model.rotary_inertia or 0.0)
    rows = [np.zeros((0, model.grid.size))]
    if rotary:
        rows.append(np.sqrt(rotary) * integral)
    if translation:
        for component in (cos, sin):
            if component.any():
                rows.append(np.sqrt(translation) * integral @ (component[:, None] * integral))
    return np.vstack(rows)
