"""How far out the equilibria can lie at which the drive equals the threshold."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from plastica.material.discs import Disc, enclosed
from plastica.material.material import Laws

__all__ = ["Reach", "fold_reach", "free", "reach"]

Array = NDArray[np.float64]

SMALLEST, FARTHEST = 1e-8, 1e8
"""Natural curvatures (1/L) between which the laws are compared."""

PER_DECADE = 200

FINEST = 1e-4
"""Relative width of the intervals in which the range is shown to be one: an interval so narrow is searched instead."""

MOST = 20_000
"""Intervals looked at for that."""

FALLBACK = 20.0
"""Clamp curvature looked at where the laws do not tell how far to look, beside 4 gamma^(1/2)."""


@dataclass(frozen=True)
class Reach:
    """A bound on all limiting equilibria, |D| = Theta.

    Attributes
    ----------
    natural_curvature : float
        On |mu_nat|; infinite where the laws give none.
    alpha : float
        On |alpha|; infinite likewise.
    outside : str
        What equilibria beyond are: "inadmissible", "admissible" (the admissible set is unbounded), or "unknown".
    """

    natural_curvature: float
    alpha: float
    outside: str


def reach(gamma: float, laws: Laws) -> Reach:
    """Bound the natural curvature and the clamp curvature of limiting equilibria.

    D + kappa'(mu_nat) = phi(1) - phi'(1) = gamma int_0^1 s sin phi, of size at most gamma/2; and at most
    m - (m^2 - 4 gamma)^(1/2) where m = |mu_nat| >= 2 gamma^(1/2), since then phi' lies between (alpha^2 - 4
    gamma)^(1/2) and alpha, which is at least m. So |D| = Theta needs ||kappa'(m)| - Theta(m)| to be within that, and
    beyond the last such m the sign of |kappa'| - Theta decides. From the first integral, alpha^2 <= mu_nat^2 + 4 gamma.

    Parameters
    ----------
    gamma : float
        Thrust.
    laws : Laws
        Dimensionless laws.

    Returns
    -------
    Reach
        The laws are compared at 200 points a decade between 1e-8 and 1e8, at both signs, up to where a formula
        overflows; that nothing is limiting beyond the last of them is then shown from the formulas, by interval
        arithmetic, or the range is lengthened to where it can be.
    """
    m = np.logspace(math.log10(SMALLEST), math.log10(FARTHEST), PER_DECADE * 16 + 1)
    arm = lever(gamma, m)
    last, outside, shown = 0, set(), 0.0
    for side in (1.0, -1.0):
        gap = _gap(laws, side * m)
        near = _near(gap, arm)
        known = np.flatnonzero(~np.isnan(gap))
        last = max(last, int(near[-1]) + 1 if near.size else 0)
        told = known.size and not (near.size and near[-1] >= known[-1])
        outside.add("unknown" if not told else "inadmissible" if gap[known[-1]] > 0.0 else "admissible")
        shown = max(shown, _not_free(gamma, laws, side, float(m[last]), float(m[known[-1]])) if told else math.inf)
    if len(outside) > 1 or "unknown" in outside or math.isinf(shown):
        return Reach(math.inf, math.inf, "unknown")
    farthest = max(float(m[last]), shown)
    return Reach(farthest, math.sqrt(farthest**2 + 4.0 * gamma), outside.pop())


def lever(gamma: float, m: Array) -> Array:
    """Bound |phi(1) - phi'(1)| where |mu_nat| = m: see `reach`."""
    root = np.sqrt(np.maximum(m * m - 4.0 * gamma, 0.0))
    wide = (m >= 2.0 * math.sqrt(gamma)) & (m > 0.0)
    long = np.where(wide, 4.0 * gamma / np.where(wide, m + root, 1.0), math.inf)
    return np.asarray(np.minimum(long, 0.5 * gamma) * (1.0 + 1e-12))


def _gap(laws: Laws, m: Array) -> Array:
    """Return |kappa'| - Theta; nan where a law overflows, since its formula may do so where its value does not."""
    slope, threshold = laws.preference.slope(m), laws.threshold.value(m)
    finite = np.isfinite(slope) & np.isfinite(threshold)
    return np.where(finite, np.abs(np.where(finite, slope, 0.0)) - np.where(finite, threshold, 0.0), math.nan)


def _not_free(gamma: float, laws: Laws, side: float, low: float, high: float) -> float:
    """Return the largest |mu_nat| in a range that is not shown to be free of limiting equilibria; infinite if many."""
    if not low < high:
        return 0.0
    ends = np.geomspace(low, high, math.ceil(8.0 * math.log(high / low)) + 2)
    a, b = ends[:-1], ends[1:]
    farthest, looked = 0.0, 0
    while a.size:
        looked += a.size
        left, right = (a, b) if side > 0.0 else (-b, -a)
        whole = (enclosed(laws.preference, 1, left, right, 1.0), enclosed(laws.threshold, 0, left, right, 1.0))
        open_ = ~free(gamma, *whole, left, right)
        narrow = open_ & (b - a <= FINEST * b)
        farthest = max(farthest, float(b[narrow].max(initial=0.0)))
        again = open_ & ~narrow & (b > farthest)
        if looked > MOST and again.any():
            return math.inf
        middle = np.sqrt(a[again] * b[again])
        a, b = np.concatenate([a[again], middle]), np.concatenate([middle, b[again]])
    return farthest


def free(gamma: float, slope: Disc, threshold: Disc, a: Array, b: Array) -> NDArray[np.bool_]:
    """Tell in which intervals of the natural curvature ||kappa'| - Theta| is beyond the lever: nothing is limiting.

    Parameters
    ----------
    gamma : float
        Thrust.
    slope, threshold : Disc
        kappa' and Theta over the intervals.
    a, b : ndarray
        The intervals.

    Returns
    -------
    ndarray of bool
    """
    nearest = np.where((a < 0.0) & (b > 0.0), 0.0, np.minimum(np.abs(a), np.abs(b)))
    arm = lever(gamma, nearest) * (1.0 + 1e-9) + 1e-300
    with np.errstate(invalid="ignore"):
        outside, inside = slope.least - threshold.high > arm, threshold.low - slope.most > arm
    return np.asarray(outside | inside)


def _near(gap: Array, lever: Array) -> NDArray[np.int64]:
    """Return the points next to which |gap| may be as small as the lever: also where it turns, or changes its sign."""
    with np.errstate(invalid="ignore"):
        size = np.abs(gap)
        before, after = np.append(size[:1], size[:-1]), np.append(size[1:], size[-1:])
        turns = (size <= before) & (size <= after)
        dip = np.where(turns, np.maximum(before, after) - size, 0.0)
        changes = np.append(np.sign(gap[:-1]) * np.sign(gap[1:]) < 0.0, False)
        return np.flatnonzero((size <= lever + np.nan_to_num(dip, posinf=0.0)) | changes)


def fold_reach(gamma: float) -> float:
    """Return a bound on |alpha| of all folds, theta_0'(1) = 0.

    Differentiate the first integral phi'(1)^2 / 2 = alpha^2 / 2 - gamma + gamma cos phi(1) in alpha: a fold has
    alpha = gamma sin phi(1) theta_0(1). On rotating rods theta_0(1) <= 1 / (1 - 4 gamma / alpha^2), so that
    alpha^2 - gamma alpha - 4 gamma <= 0.

    Parameters
    ----------
    gamma : float
        Thrust.

    Returns
    -------
    float
        (gamma + (gamma^2 + 16 gamma)^(1/2)) / 2, and 2 gamma^(1/2) at least; 0 below pi^2/4, where there are none.
    """
    if gamma < 0.25 * math.pi**2 * (1.0 - 1e-9):
        return 0.0
    return max(0.5 * (gamma + math.sqrt(gamma * gamma + 16.0 * gamma)), 2.0 * math.sqrt(gamma)) * (1.0 + 1e-12)
