"""The spectral projection onto the curve of equilibria, and where on it a small disturbance ends."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from plastica.equilibria.elastica import alpha_rate, ends
from plastica.equilibria.equilibrium import Equilibrium
from plastica.equilibria.linear import require_equilibrium
from plastica.equilibria.oscillation import FOLD_TOLERANCE, fold_distance
from plastica.errors import ArgumentError
from plastica.numerics.grid import Grid

__all__ = ["Projection", "asymptotic_phase", "projection"]

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Projection:
    """A disturbance of an equilibrium, split into its part along the curve of equilibria and the rest.

    Attributes
    ----------
    alpha : float
        Clamp curvature of the equilibrium on the curve, to first order: alpha + shift.
    shift : float
        The part along the curve is shift * (theta_0', theta_0'(1)).
    along : ndarray, shape (n,)
        Curvature of the part along the curve, at the nodes.
    rest : ndarray, shape (n,)
        Curvature of the rest, which has no natural curvature.
    rest_norm : float
        (int rest^2)^(1/2).
    second_order : float
        Size of the term of second order that `alpha` leaves out, (1/2) |mu_nat''(alpha) / mu_nat'(alpha)| shift^2.
    """

    alpha: float
    shift: float
    along: Array
    rest: Array
    rest_norm: float
    second_order: float


def projection(equilibrium: Equilibrium, mu: ArrayLike, mu_nat: float, grid: Grid) -> Projection:
    """Split a state near an equilibrium by the spectral projection onto the kernel of the linearisation.

    The linearisation L(xi, xi_nat) = (xi_nat - xi + K xi, 0) has the kernel (theta_0', theta_0'(1)); its left null
    vector is (0, 1), because L never moves the natural curvature. So the projection onto the kernel, along the other
    invariant subspace {xi_nat = 0}, is::

        P (xi, xi_nat) = xi_nat / theta_0'(1) * (theta_0', theta_0'(1))

    Parameters
    ----------
    equilibrium : Equilibrium
        Where; not at a fold.
    mu : array_like, shape (n,)
        Curvature of the state at the nodes.
    mu_nat : float
        Natural curvature of the state.
    grid : Grid
        The nodes.

    Returns
    -------
    Projection

    Raises
    ------
    ArgumentError
        Where an argument is of the wrong kind or not finite, or the equilibrium is at a fold: theta_0'(1) = 0, and 0
        is a double eigenvalue with one eigenvector, whose invariant subspace is not tangent to a curve of equilibria.

    Notes
    -----
    Checked by test_projection.
    """
    curvature, natural = _state(equilibrium, mu, mu_nat, grid)
    gamma, alpha = equilibrium.gamma, equilibrium.alpha
    at = equilibrium.profile(np.append(grid.s, 1.0))
    slope_at_end = float(at.theta0_slope[-1])
    if fold_distance(gamma, at.theta0[-1], slope_at_end) <= FOLD_TOLERANCE:
        raise ArgumentError(
            "must not be at a fold, where theta_0'(1) = 0",
            where="equilibrium",
            value=f"gamma = {gamma:.6g}, alpha = {alpha:.6g}",
            next_step="A disturbance there is not answered in proportion; integrate its motion with pl.solve.",
        )
    shift = (natural - float(at.slope[-1])) / slope_at_end
    along = shift * at.theta0_slope[:-1]
    rest = curvature - at.slope[:-1] - along
    return Projection(
        alpha=alpha + shift,
        shift=shift,
        along=along,
        rest=rest,
        rest_norm=float(np.sqrt(grid.w @ rest**2)),
        second_order=0.5 * abs(_bend(equilibrium) / slope_at_end) * shift**2,
    )


def asymptotic_phase(equilibrium: Equilibrium, mu: ArrayLike, mu_nat: float, grid: Grid) -> float:
    """Return the clamp curvature alpha of the equilibrium at which a small disturbance ends, to first order.

    alpha_oo = alpha + (mu_nat - mu_nat(alpha)) / theta_0'(1): the disturbance of the curvature fades and leaves
    nothing behind, that of the natural curvature stays.

    Parameters
    ----------
    equilibrium : Equilibrium
        A stable one, not at a fold.
    mu : array_like, shape (n,)
        Curvature of the state at the nodes.
    mu_nat : float
        Its natural curvature.
    grid : Grid
        The nodes.

    Returns
    -------
    float

    Raises
    ------
    ArgumentError
        As for `projection`, and where the equilibrium is unstable at frozen natural curvature.

    Notes
    -----
    Limits: this holds while |D| stays at most Theta along the whole motion, so that the natural curvature is frozen;
    inside the threshold that is so for all small disturbances, since the rest never grows: |D| changes by no more
    than its norm. The error is then of second order, and the exact answer is the root of phi'(1; alpha) = mu_nat on
    the same branch. At |D| = Theta the linearisation is the same, because f'(0) = 0, but it does not tell where the
    motion ends: what the drive exceeds the threshold by, however little, is worked off by the natural curvature, which
    moves by an amount of first order in a time of the order of its inverse.

    Checked by test_asymptotic_phase, test_phase_at_the_threshold.
    """
    found = projection(equilibrium, mu, mu_nat, grid)
    unstable = equilibrium.unstable
    if unstable != 0:
        raise ArgumentError(
            "must be stable at frozen natural curvature",
            where="equilibrium",
            value=f"one with {unstable} unstable direction{'s' if unstable > 1 else ''}",
            next_step="Disturbances of this one leave it; integrate the motion with pl.solve.",
        )
    return found.alpha


def _bend(equilibrium: Equilibrium) -> float:
    """Estimate the size of d^2 mu_nat / d alpha^2 by a central difference of theta_0'(1)."""
    gamma, alpha, depth = equilibrium.gamma, equilibrium.alpha, equilibrium.depth
    if depth is None or abs(depth) < 1.0:
        step = 1e-5 * max(1.0, abs(alpha))
        near = ends(np.full(2, gamma), np.array([alpha - step, alpha + step]))
        return float(near.theta0_slope[1] - near.theta0_slope[0]) / (2.0 * step)
    step = 1e-5 * abs(depth)
    near = ends(np.full(2, gamma), np.full(2, alpha), np.array([depth - step, depth + step]))
    return float(near.theta0_slope[1] - near.theta0_slope[0]) / (2.0 * step * alpha_rate(gamma, depth))


def _state(equilibrium: object, mu: ArrayLike, mu_nat: float, grid: object) -> tuple[Array, float]:
    """A checked state."""
    require_equilibrium(equilibrium)
    if not isinstance(grid, Grid):
        raise ArgumentError("must be a pl.Grid", where="grid", value=grid)
    try:
        curvature, natural = np.asarray(mu, dtype=float), float(mu_nat)
    except (TypeError, ValueError):
        raise ArgumentError("must be numbers", where="mu, mu_nat") from None
    if curvature.shape != (grid.size,):
        raise ArgumentError(f"must have the shape ({grid.size},) of the grid", where="mu", value=curvature.shape)
    if not (np.all(np.isfinite(curvature)) and np.isfinite(natural)):
        raise ArgumentError("must be finite", where="mu, mu_nat", value=(mu, mu_nat))
    return curvature, natural
