"""The function whose zeros are the limiting equilibria, G = side D - Theta of gamma and alpha, and its slopes."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from plastica.equilibria.elastica import ends
from plastica.material.material import Laws

__all__ = ["Gap", "gap"]

Array = NDArray[np.float64]


class Gap(NamedTuple):
    """G = side D - Theta(mu_nat), and its derivatives in alpha and gamma, of one shape."""

    value: Array
    by_alpha: Array
    by_gamma: Array


def gap(gamma: ArrayLike, alpha: ArrayLike, side: float, laws: Laws) -> Gap:
    """Return G and both of its first derivatives, from closed forms.

    phi depends on (w s, alpha / w) alone, w^2 = gamma, so that its derivatives in gamma follow from those in s and
    alpha (errata D gives the latter)::

        2 gamma dphi/dgamma = s phi' - alpha theta_0      2 gamma dphi'/dgamma = phi' - gamma s sin phi - alpha theta_0'

    Parameters
    ----------
    gamma, alpha : array_like
        Thrust and clamp curvature, dimensionless; they broadcast.
    side : float
        1 for D = Theta, -1 for D = -Theta.
    laws : Laws
        Dimensionless laws.

    Returns
    -------
    Gap
        `by_gamma` loses digits like eps / gamma where gamma is small, and is nan where it is 0.
    """
    g, a = np.asarray(gamma, dtype=float), np.asarray(alpha, dtype=float)
    end = ends(g, a)
    m = end.mu_nat
    with np.errstate(divide="ignore", invalid="ignore"):
        phi_rate = (m - a * end.theta0) / (2.0 * g)
        m_rate = (m - g * np.sin(end.phi) - a * end.theta0_slope) / (2.0 * g)
    stiff = side * (1.0 + laws.preference.second(m)) + laws.threshold.slope(m)
    return Gap(
        np.asarray(side * (end.arm - laws.preference.slope(m)) - laws.threshold.value(m)),
        np.asarray(side * end.theta0 - stiff * end.theta0_slope),
        np.asarray(side * phi_rate - stiff * m_rate),
    )
