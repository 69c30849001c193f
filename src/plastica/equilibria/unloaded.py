"""Where natural curvatures end once a rod is let go and has come to rest."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from plastica.material.material import Laws
from plastica.physics.bounds import largest_natural_curvature

__all__ = ["left_without_load"]

Array = NDArray[np.float64]

SAMPLES = 4001


def left_without_load(laws: Laws, mu_nat: ArrayLike) -> Array:
    """Return the natural curvatures that rods relaxed onto these come to rest with when no load acts.

    Without load mu = mu_nat, hence D = -kappa'(mu_nat): what is within its threshold stays; the rest goes downhill in
    the preference energy until |kappa'(m)| = Theta(m).

    Parameters
    ----------
    laws : Laws
        Dimensionless.
    mu_nat : array_like of any shape
        Dimensionless natural curvatures.

    Returns
    -------
    ndarray of the same shape
    """
    natural = np.asarray(mu_nat, dtype=float)
    flat = [_left(laws, float(m)) for m in natural.ravel()]
    return np.array(flat).reshape(natural.shape)


def _left(laws: Laws, m: float) -> float:
    from scipy.optimize import brentq

    def excess(x: float) -> float:
        return abs(laws.preference.slope_at(x)) - laws.threshold.value_at(x)

    if not excess(m) > 0.0:
        return m
    slope = laws.preference.slope_at(m)
    farthest = largest_natural_curvature(laws, laws.preference.value_at(m))
    if not np.isfinite(farthest):
        return m
    path = np.linspace(m, -np.sign(slope) * farthest, SAMPLES)
    beyond = np.abs(laws.preference.slope(path)) - laws.threshold.value(path) > 0.0
    within = np.nonzero(~beyond)[0]
    if within.size == 0:
        return m
    first = int(within[0])
    return float(brentq(excess, float(path[first - 1]), float(path[first]), xtol=1e-15))
