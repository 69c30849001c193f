"""Where natural curvatures end once a rod is let go and has come to rest."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from plastica.material.material import Laws
from plastica.physics.bounds import largest_natural_curvature

__all__ = ["left_without_load"]

Array = NDArray[np.float64]

SAMPLES = 4001

RELAXED = 40.0
"""Retardation times after which a rod has relaxed onto its natural shape, to rounding."""

RTOL, ATOL = 1e-10, 1e-13


def left_without_load(laws: Laws, damping: float, mean: ArrayLike, mu_nat: ArrayLike) -> Array:
    """Return the natural curvatures with which a rod without inertia comes to rest once it is let go.

    Without load segments do not know of each other, and of the curvature only its mean a counts (design, section 1.2)::

        delta a_t = mu_nat - a,      mu_nat_t = f(D - Theta) - f(-Theta - D),      D = a - mu_nat - kappa'(mu_nat)

    Once a has relaxed, D = -kappa'(mu_nat): what is within its threshold stays; the rest goes downhill in the
    preference energy until |kappa'(m)| = Theta(m).

    Parameters
    ----------
    laws : Laws
        Dimensionless.
    damping : float
        delta; 0 for a rod that is let go so slowly that it does not swing.
    mean, mu_nat : array_like of any one shape
        Dimensionless mean curvature and natural curvature, by segment.

    Returns
    -------
    ndarray of the same shape
        The natural curvature of now where it cannot be told; what never moves keeps its bits.
    """
    natural = np.asarray(mu_nat, dtype=float)
    means = np.asarray(mean, dtype=float)
    left = [_left(laws, damping, float(a), float(m)) for a, m in zip(means.ravel(), natural.ravel(), strict=True)]
    return np.array(left).reshape(natural.shape)


def _left(laws: Laws, damping: float, mean: float, m: float) -> float:
    start = mean if damping > 0.0 else m
    # While m rests, the drive goes from the one value to the other without turning.
    if max(abs(_drive(laws, start, m)), abs(_drive(laws, m, m))) <= laws.threshold.value_at(m):
        return m
    relaxed = _relaxed(laws, damping, mean, m) if damping > 0.0 else m
    return m if relaxed is None else _downhill(laws, relaxed)


def _drive(laws: Laws, mean: float, m: float) -> float:
    return mean - m - laws.preference.slope_at(m)


def _relaxed(laws: Laws, damping: float, mean: float, m: float) -> float | None:
    """The natural curvature once its segment has relaxed onto it; None where the laws do not carry that far."""
    from scipy.integrate import solve_ivp

    flow, threshold = laws.flow.value_at, laws.threshold.value_at

    def rate(_t: float, state: Sequence[float]) -> tuple[float, float]:
        a, natural = state
        drive, barrier = _drive(laws, a, natural), threshold(natural)
        return natural - a, damping * (flow(drive - barrier) - flow(-barrier - drive))

    size = max(1.0, abs(mean), abs(m))
    with np.errstate(all="ignore"):
        found = solve_ivp(rate, (0.0, RELAXED), (mean, m), method="LSODA", rtol=RTOL, atol=ATOL * size)
    last = float(found.y[1, -1])
    return last if found.success and np.isfinite(last) else None


def _downhill(laws: Laws, m: float) -> float:
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
