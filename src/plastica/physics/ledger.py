"""Energies of the strut, the rates at which they are spent, and the balance sheet of a motion."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from plastica.physics.strut import Strut

__all__ = ["Ledger", "entropy_rate", "liapunov", "potential", "spending", "stored_energy"]

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Ledger:
    """Where the work of the loads has gone, over a whole motion.

    ``work = change of stored_energy + viscous_dissipation + natural_dissipation + kinetic_energy + residual``.
    The three integrals are advanced together with the motion, to the same tolerance; nothing is differenced.

    Attributes
    ----------
    residual : float
        What does not balance; at the size of the time tolerance.
    work : float
        Work of the loads since the start.
    stored_energy : float
        Change of the stored energy since the start.
    viscous_dissipation, natural_dissipation : float
        Spent by the rate of curvature and by the motion of the natural curvature; neither can be negative.
    kinetic_energy : float
        Zero for the quasi-static strut.
    largest_energy : float
        Largest stored energy or entry met on the way: the scale against which to read the residual.
    unit : str
        "J", or "1" (EI/L) without a specimen.
    """

    residual: float
    work: float
    stored_energy: float
    viscous_dissipation: float
    natural_dissipation: float
    kinetic_energy: float
    largest_energy: float
    unit: str

    @property
    def entropy_production(self) -> float:
        """Total entropy production times the temperature: the sum of both dissipations."""
        return self.viscous_dissipation + self.natural_dissipation

    def __str__(self) -> str:
        unit = "EI/L" if self.unit == "1" else self.unit
        return (
            f"work {self.work:.6g} = stored {self.stored_energy:+.6g}, viscous {self.viscous_dissipation:.6g}, "
            f"natural {self.natural_dissipation:.6g} {unit}; residual {self.residual:.1e}"
        )


def stored_energy(strut: Strut, mu: ArrayLike, mu_nat: ArrayLike) -> Array:
    """Energy held by the rod, 1/2 int (mu - mu_nat)^2 + kappa(mu_nat); mu (..., n), mu_nat (...)."""
    curvature, natural = np.asarray(mu, dtype=float), np.asarray(mu_nat, dtype=float)
    bending = 0.5 * (curvature - natural[..., None]) ** 2 @ strut.grid.w
    return np.asarray(bending + strut.laws.preference.value(natural))


def potential(strut: Strut, t: ArrayLike, mu: ArrayLike) -> Array:
    """Potential of the dead loads at their present values, -m1 theta(1) - int n.a."""
    curvature = np.asarray(mu, dtype=float)
    tension, _ = strut.force(t, strut.angle(curvature))
    return np.asarray(-np.asarray(strut.loads.couple(t)) * (curvature @ strut.grid.w) - tension @ strut.grid.w)


def liapunov(strut: Strut, t: ArrayLike, mu: ArrayLike, mu_nat: ArrayLike) -> Array:
    """Liapunov function V: stored energy plus potential of the loads (design note 1.2; for the paper's strut its V).

    Under constant loads dV/dt = -int mu_t^2 - |D mu_nat_t|, exactly so for the semi-discrete rod.
    """
    return stored_energy(strut, mu, mu_nat) + potential(strut, t, mu)


def spending(strut: Strut, t: ArrayLike, mu: ArrayLike, mu_nat: ArrayLike) -> tuple[Array, Array, Array]:
    """Power of the loads int M mu_t, and what is dissipated: int mu_t^2 by viscosity, D mu_nat_t by the flow."""
    mu_t, mu_nat_t = strut.rate(t, mu, mu_nat)
    weighted = mu_t * strut.grid.w
    power = np.sum(weighted * strut.couple(t, mu), axis=-1)
    return power, np.sum(weighted * mu_t, axis=-1), strut.drive(mu, mu_nat) * mu_nat_t


def entropy_rate(strut: Strut, t: ArrayLike, mu: ArrayLike, mu_nat: ArrayLike) -> Array:
    """Local rate of entropy times temperature, mu_t^2 + (mu - mu_nat - kappa'(mu_nat)) mu_nat_t; shape (..., n).

    It may be negative somewhere; its integral over the rod, the sum of both dissipations, never is.
    """
    curvature, natural = np.asarray(mu, dtype=float), np.asarray(mu_nat, dtype=float)
    mu_t, mu_nat_t = strut.rate(t, curvature, natural)
    pull = curvature - (natural + strut.laws.preference.slope(natural))[..., None]
    return mu_t**2 + pull * mu_nat_t[..., None]
