"""The rod written in the volume fraction alpha in place of its natural curvature (paper, section 2.2)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from plastica.errors import ArgumentError
from plastica.physics.model import Model

__all__ = ["Mixture"]

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Mixture:
    """A rod as a mixture of two shapes: straight, and in the fraction alpha of the second preferred curvature m1.

    For a material that prefers the natural curvatures 0 and +-m1 equally, section 2.2 of Rajagopal and Rodriguez writes
    mu_nat = alpha m1, the strain mu_alpha = mu - alpha m1 and the internal energy e = tau eta + W + J with::

        W(mu_alpha) = 1/2 mu_alpha^2
        J(alpha)    = kappa(alpha m1)

    The evolution law follows. With the driving force conjugate to alpha, and threshold and flow in its units::

        X       = -d/d alpha int (W + J) = m1 int mu_alpha - J'(alpha) = m1 D
        Y       = m1 Theta(alpha m1)
        alpha_t = g(X - Y) - g(-Y - X),      g(x) = f(x/m1)/m1

    so that X alpha_t = D mu_nat_t. All is dimensionless here, and by segment where there are several.

    Parameters
    ----------
    model : Strut or Rod
        The rod.
    second : float
        m1, dimensionless and positive; `of` takes it from the material.

    Notes
    -----
    alpha in [0, 1] is a volume fraction. Beyond, the equations go on to hold, since they are the same equations, but
    the reading as a mixture is formal: a rod that is bent on past m1, or the other way, has alpha > 1 or alpha < 0.
    """

    model: Model
    second: float

    @classmethod
    def of(cls, model: Model) -> Self:
        """Make the mixture of a rod whose material has a second preferred curvature.

        Parameters
        ----------
        model : Strut or Rod
            The rod.

        Returns
        -------
        Mixture

        Raises
        ------
        ArgumentError
            Where the preference energy vanishes at 0 only.
        """
        well = model.material.well
        if well is None:
            raise ArgumentError(
                "must prefer a second natural curvature for a volume fraction to exist",
                where="material",
                value=model.material.preference,
                next_step='Take one whose preference energy vanishes elsewhere than at 0, such as "three-shapes".',
            )
        return cls(model, well * model.scales.length)

    def fraction(self, mu_nat: ArrayLike) -> Array:
        """Volume fraction alpha = mu_nat/m1."""
        return np.asarray(mu_nat, dtype=float) / self.second

    def natural(self, alpha: ArrayLike) -> Array:
        """Natural curvature of a mixture, (1 - alpha) 0 + alpha m1."""
        return np.asarray(alpha, dtype=float) * self.second

    def strain(self, mu: ArrayLike, alpha: ArrayLike) -> Array:
        """Strain mu_alpha = mu - alpha m1 of a shape relative to the mixture's; shape (..., n)."""
        return np.asarray(mu, dtype=float) - self.model.division.spread(self.natural(alpha))

    def strain_energy(self, strain: ArrayLike) -> Array:
        """Energy of the strain per length, W = 1/2 mu_alpha^2."""
        return np.asarray(0.5 * np.asarray(strain, dtype=float) ** 2)

    def mixing_energy(self, alpha: ArrayLike) -> Array:
        """Energy of the mixture per length, J = kappa(alpha m1): 0 for either shape alone."""
        return np.asarray(self.model.laws.preference.value(self.natural(alpha)))

    def mixing_slope(self, alpha: ArrayLike) -> Array:
        """Derivative J'(alpha) = m1 kappa'(alpha m1)."""
        return np.asarray(self.second * self.model.laws.preference.slope(self.natural(alpha)))

    def energy(self, mu: ArrayLike, alpha: ArrayLike) -> Array:
        """Energy of the whole rod, int W(mu_alpha) + J(alpha)."""
        bending = self.strain_energy(self.strain(mu, alpha)) @ self.model.grid.w
        return np.asarray(bending + self.model.division.total(self.mixing_energy(alpha)))

    def drive(self, mu: ArrayLike, alpha: ArrayLike) -> Array:
        """Driving force on the fraction, X = m1 mean(mu_alpha) - J'(alpha), by segment."""
        strain = self.model.division.mean(self.strain(mu, alpha))
        return np.asarray(self.second * strain - self.mixing_slope(alpha))

    def threshold(self, alpha: ArrayLike) -> Array:
        """Threshold Y = m1 Theta(alpha m1) that the driving force must exceed, by segment."""
        return np.asarray(self.second * self.model.threshold(self.natural(alpha)))

    def flow(self, excess: ArrayLike) -> Array:
        """Rate of the fraction by its excess driving force, g(x) = f(x/m1)/m1."""
        return np.asarray(self.model.laws.flow.value(np.asarray(excess, dtype=float) / self.second) / self.second)

    def rate(self, mu: ArrayLike, alpha: ArrayLike) -> Array:
        """Evolution of the fraction, alpha_t = g(X - Y) - g(-Y - X), by segment."""
        drive, threshold = self.drive(mu, alpha), self.threshold(alpha)
        return self.flow(drive - threshold) - self.flow(-threshold - drive)
