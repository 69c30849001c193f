"""What each cross section stores, is given and dissipates: the isothermal balance of energy, point by point.

The rod is held at one temperature tau and conducts no heat along itself. Per length it has the internal energy
e = tau eta + psi, and the balance of energy is e_t = M mu_t (paper, section 2.2). The local rate of entropy that
follows, tau eta_t = M mu_t - psi_t, is `plastica.physics.ledger.entropy_rate`.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from plastica.physics.ledger import rates
from plastica.physics.model import Model

__all__ = ["bending_energy", "free_energy", "free_energy_rate", "power", "preference_energy"]

Array = NDArray[np.float64]


def bending_energy(model: Model, mu: ArrayLike, mu_nat: ArrayLike) -> Array:
    """Bending energy per length, 1/2 (mu - mu_nat)^2: the paper's W of the strain mu_alpha; shape (..., n).

    Parameters
    ----------
    model : Strut or Rod
        The rod, on a definite grid.
    mu : array_like, shape (..., n)
        Dimensionless curvature at the nodes.
    mu_nat : array_like, shape (...), or (..., m) with several segments
        Dimensionless natural curvature.
    """
    strain = np.asarray(mu, dtype=float) - model.division.spread(mu_nat)
    return np.asarray(0.5 * strain**2)


def preference_energy(model: Model, mu_nat: ArrayLike) -> Array:
    """Preference energy per length by segment, kappa(mu_nat): the paper's J of the volume fraction."""
    return np.asarray(model.laws.preference.value(np.asarray(mu_nat, dtype=float)))


def free_energy(model: Model, mu: ArrayLike, mu_nat: ArrayLike) -> Array:
    """Free energy per length, psi = e - tau eta = 1/2 (mu - mu_nat)^2 + kappa(mu_nat); shape (..., n).

    This is the paper's (2.11). Its integral along the rod is `plastica.physics.ledger.stored_energy`; arguments as of
    `bending_energy`.
    """
    return bending_energy(model, mu, mu_nat) + model.division.spread(preference_energy(model, mu_nat))


def free_energy_rate(
    model: Model, t: ArrayLike, mu: ArrayLike, mu_nat: ArrayLike, mu_t: ArrayLike | None = None
) -> Array:
    """Rate of the free energy per length, (mu - mu_nat)(mu_t - mu_nat_t) + kappa'(mu_nat) mu_nat_t; shape (..., n).

    Parameters
    ----------
    model : Strut or Rod
        The rod, on a definite grid.
    t : array_like, shape (...)
        Dimensionless time.
    mu, mu_nat : array_like
        As of `bending_energy`.
    mu_t : array_like, shape (..., n), optional
        Rate of curvature, where it is part of the state.

    Returns
    -------
    ndarray, shape (..., n)
        By the rates that the equations of motion give in this state; nothing is differenced.
    """
    spread = model.division.spread
    first, natural_t = rates(model, t, mu, mu_nat, mu_t)
    strain = np.asarray(mu, dtype=float) - spread(mu_nat)
    slope = np.asarray(model.laws.preference.slope(np.asarray(mu_nat, dtype=float)))
    return np.asarray(strain * (first - spread(natural_t)) + spread(slope * natural_t))


def power(model: Model, t: ArrayLike, mu: ArrayLike, mu_nat: ArrayLike, mu_t: ArrayLike | None = None) -> Array:
    """Power of the contact couple per length, M mu_t = e_t (paper, balance of energy in section 2.2); shape (..., n).

    Without inertia M is the couple of the loads; with it M = mu - mu_nat + delta mu_t, the constitutive law, which the
    balance of moments makes the same as m1 + J*[n.b - eps0 theta_tt]. Arguments as of `free_energy_rate`.
    """
    first, _ = rates(model, t, mu, mu_nat, mu_t)
    if not model.has_inertia:
        return np.asarray(model.couple(t, mu) * first)
    contact = np.asarray(mu, dtype=float) - model.division.spread(mu_nat) + model.damping * first
    return np.asarray(contact * first)
