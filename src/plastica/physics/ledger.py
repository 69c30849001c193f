"""Energies of a rod, the rates at which they are spent, and the balance sheet of a motion."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from plastica.physics.model import Model
from plastica.physics.rod import Rod

__all__ = ["Ledger", "entropy_rate", "kinetic_energy", "liapunov", "potential", "rates", "spending", "stored_energy"]

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
        Change of the kinetic energy since the start; zero without inertia.
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
        kinetic = f", kinetic {self.kinetic_energy:+.6g}" if self.kinetic_energy != 0.0 else ""
        return (
            f"work {self.work:.6g} = stored {self.stored_energy:+.6g}, viscous {self.viscous_dissipation:.6g}, "
            f"natural {self.natural_dissipation:.6g}{kinetic} {unit}; residual {self.residual:.1e}"
        )


def stored_energy(model: Model, mu: ArrayLike, mu_nat: ArrayLike) -> Array:
    """Energy held by the rod, 1/2 int (mu - mu_nat)^2 + kappa(mu_nat); mu (..., n), mu_nat (...) or by segment."""
    curvature, natural = np.asarray(mu, dtype=float), np.asarray(mu_nat, dtype=float)
    bending = 0.5 * (curvature - model.division.spread(natural)) ** 2 @ model.grid.w
    return np.asarray(bending + model.division.total(model.laws.preference.value(natural)))


def potential(model: Model, t: ArrayLike, mu: ArrayLike) -> Array:
    """Potential of the dead loads at their present values, -m1 theta(1) - int n.a."""
    curvature = np.asarray(mu, dtype=float)
    tension, _ = model.force(t, model.angle(curvature))
    return np.asarray(-np.asarray(model.loads.couple(t)) * (curvature @ model.grid.w) - tension @ model.grid.w)


def kinetic_energy(model: Model, mu: ArrayLike, mu_t: ArrayLike | None) -> Array:
    """Kinetic energy of a state; 0 of one without a rate of curvature; shape (...)."""
    if mu_t is None or not isinstance(model, Rod):
        return np.zeros(np.shape(mu)[:-1])
    return model.kinetic_energy(mu, mu_t)


def liapunov(model: Model, t: ArrayLike, mu: ArrayLike, mu_nat: ArrayLike, mu_t: ArrayLike | None = None) -> Array:
    """Liapunov function V: stored and kinetic energy plus potential of the loads (design note 1.2; the paper's V).

    Under constant loads dV/dt = -delta int mu_t^2 - sum of l_j |D_j mu_nat_j_t|, exactly so for the semi-discrete rod.
    """
    return stored_energy(model, mu, mu_nat) + potential(model, t, mu) + kinetic_energy(model, mu, mu_t)


def rates(
    model: Model, t: ArrayLike, mu: ArrayLike, mu_nat: ArrayLike, mu_t: ArrayLike | None = None
) -> tuple[Array, Array]:
    """Rates of curvature and natural curvature in a state; mu_t is that given where the state has one."""
    if mu_t is not None and model.has_inertia:
        return np.asarray(mu_t, dtype=float), model.natural_rate(mu, mu_nat)
    moment = model.couple(t, mu) - (np.asarray(mu, dtype=float) - model.division.spread(mu_nat))
    return moment if model.damping == 1.0 else moment / model.damping, model.natural_rate(mu, mu_nat)


def spending(
    model: Model, t: ArrayLike, mu: ArrayLike, mu_nat: ArrayLike, mu_t: ArrayLike | None = None
) -> tuple[Array, Array, Array]:
    """Power of the loads int M mu_t, and what is dissipated: delta int mu_t^2 by viscosity, D mu_nat_t by the flow."""
    first, natural_t = rates(model, t, mu, mu_nat, mu_t)
    weighted = first * model.grid.w
    power = np.sum(weighted * model.couple(t, mu), axis=-1)
    natural = model.division.total(model.drive(mu, mu_nat) * natural_t)
    return power, model.damping * np.sum(weighted * first, axis=-1), natural


def entropy_rate(model: Model, t: ArrayLike, mu: ArrayLike, mu_nat: ArrayLike, mu_t: ArrayLike | None = None) -> Array:
    """Local rate of entropy times temperature, delta mu_t^2 + (mu - mu_nat - kappa'(mu_nat)) mu_nat_t; shape (..., n).

    It may be negative somewhere; its integral over the rod, the sum of both dissipations, never is.
    """
    curvature, natural = np.asarray(mu, dtype=float), np.asarray(mu_nat, dtype=float)
    first, natural_t = rates(model, t, curvature, natural, mu_t)
    spread = model.division.spread
    pull = curvature - spread(natural + model.laws.preference.slope(natural))
    return model.damping * first**2 + pull * spread(natural_t)
