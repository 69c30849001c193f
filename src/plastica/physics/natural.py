"""The law of the natural curvature on plain vectors, for the kernels: its rate, its slopes, and whether it yields."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from plastica.material.material import Laws
from plastica.physics.model import Model

__all__ = ["Excess", "NaturalLaw", "Yields", "natural_law", "yielding"]

Array = NDArray[np.float64]
Excess = Callable[[Array], Sequence[float]]
Yields = Callable[[Array], tuple[bool, ...]]


@dataclass(frozen=True, eq=False)
class NaturalLaw:
    """The law of the natural curvature by segment.

    Attributes
    ----------
    laws : Laws
        Dimensionless.
    means : ndarray, shape (m, n)
        Means over the segments.
    lengths : ndarray, shape (m,)
        Lengths of the segments.
    """

    laws: Laws
    means: Array
    lengths: Array

    def drive(self, mu: Array, mu_nat: Array) -> Array:
        """Driving force by segment; mu (n,), mu_nat (m,)."""
        return np.asarray(self.means.dot(mu) - mu_nat - self.laws.preference.slope(mu_nat))

    def rate(self, mu: Array, mu_nat: Array) -> tuple[Array, float]:
        """Rates of the natural curvatures, and what they dissipate together, sum of l_j D_j mu_nat_t_j."""
        drive = self.drive(mu, mu_nat)
        barrier = self.laws.threshold.value(mu_nat)
        rates = self.laws.flow.value(drive - barrier) - self.laws.flow.value(-barrier - drive)
        return rates, float((self.lengths * drive).dot(rates))

    def into_jacobian(self, out: Array, mu: Array, mu_nat: Array, spent: int) -> None:
        """Write the derivatives of rates and dissipation by (mu, mu_nat) into a Jacobian, the latter in row `spent`."""
        m, n = self.means.shape
        drive, barrier = self.drive(mu, mu_nat), self.laws.threshold.value(mu_nat)
        up, down = self.laws.flow.slope(drive - barrier), self.laws.flow.slope(-barrier - drive)
        rates = self.laws.flow.value(drive - barrier) - self.laws.flow.value(-barrier - drive)
        drive_slope = -1.0 - self.laws.preference.second(mu_nat)
        rows = n + np.arange(m)
        out[n : n + m, :n] = (up + down)[:, None] * self.means
        out[rows, rows] = (up + down) * drive_slope - (up - down) * self.laws.threshold.slope(mu_nat)
        out[spent, : n + m] = (self.lengths * drive) @ out[n : n + m, : n + m]
        out[spent, :n] += (self.lengths * rates) @ self.means
        out[spent, n : n + m] += self.lengths * rates * drive_slope


def natural_law(model: Model) -> NaturalLaw:
    """Return the law of a model's natural curvature."""
    return NaturalLaw(model.laws, model.division.means, model.division.lengths)


def yielding(model: Model) -> tuple[Excess, Yields]:
    """Functions of a state: |D| - Theta by segment, and whether that is positive."""
    if model.segments > 1:
        return _several(model)
    n, w = model.grid.size, model.grid.w
    preference_slope, threshold = model.laws.preference.slope_at, model.laws.threshold.value_at

    def excess(y: Array) -> tuple[float]:
        mu_nat = y.item(n)
        drive = float(w.dot(y[:n])) - mu_nat - preference_slope(mu_nat)
        return (abs(drive) - threshold(mu_nat),)

    return excess, lambda y: (excess(y)[0] > 0.0,)


def _several(model: Model) -> tuple[Excess, Yields]:
    law, layout = natural_law(model), model.layout

    def excess(y: Array) -> list[float]:
        mu_nat = y[layout.natural_columns]
        beyond = np.abs(law.drive(y[: layout.nodes], mu_nat)) - model.laws.threshold.value(mu_nat)
        return [float(each) for each in beyond]

    return excess, lambda y: tuple(each > 0.0 for each in excess(y))
