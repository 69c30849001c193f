"""Cubic smoothing splines of measured points, with the smoothing chosen by cross-validation and stated."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from scipy.interpolate import BSpline

__all__ = ["MOST_POINTS", "Smoothed", "smooth", "thinned"]

Array = NDArray[np.float64]

MOST_POINTS = 400
"""Points that a spline is fitted to; more are first averaged in neighbouring groups of equal size."""


@dataclass(frozen=True)
class Smoothed:
    """A smoothing spline f of points (s_i, y_i), s in [0, 1].

    It minimises mean (y_i - f(s_i))^2 + smoothing * int_0^1 f''^2 ds.

    Attributes
    ----------
    spline : BSpline
        The curve.
    smoothing : float
        The weight of its roughness.
    change : float
        Root mean square of y_i - f(s_i).
    """

    spline: BSpline
    smoothing: float
    change: float


def thinned(s: Array, y: Array, most: int = MOST_POINTS) -> tuple[Array, Array]:
    """Average neighbouring points in groups of equal size until at most `most` are left; the ends stay."""
    group = -(-s.size // most)
    if group == 1:
        return s, y
    inner = slice(1, s.size - 1)
    count = (s.size - 2) // group
    body = [values[inner][: count * group].reshape(count, group).mean(axis=1) for values in (s, y)]
    return (
        np.concatenate([s[:1], body[0], s[-1:]]),
        np.concatenate([y[:1], body[1], y[-1:]]),
    )


def smooth(s: Array, y: Array, smoothing: float | None) -> Smoothed:
    """Fit a cubic smoothing spline.

    Parameters
    ----------
    s : ndarray, shape (n,)
        Increasing, in [0, 1]; n at least 5.
    y : ndarray, shape (n,)
        Values.
    smoothing : float or None
        Weight of the roughness; 0 interpolates; None takes the weight of the least generalised cross-validation score.

    Returns
    -------
    Smoothed
    """
    from scipy.interpolate import make_interp_spline, make_smoothing_spline

    chosen = _cross_validated(s, y) if smoothing is None else smoothing
    if chosen == 0.0:
        spline = make_interp_spline(s, y, k=3, bc_type="natural")
    else:
        spline = make_smoothing_spline(s, y, lam=chosen * s.size)
    return Smoothed(spline, chosen, float(np.sqrt(np.mean((y - spline(s)) ** 2))))


def _cross_validated(s: Array, y: Array) -> float:
    """Return the weight with the least score n |(1 - S) y|^2 / tr(1 - S)^2 (Craven and Wahba).

    The smoother is S = (1 + n lam K)^-1 with the roughness K = Q R^-1 Q^T of natural cubic splines (Reinsch), whose
    eigenvectors serve every weight.
    """
    values, vectors = np.linalg.eigh(_roughness(s))
    values = np.maximum(values, 0.0)
    values[:2] = 0.0  # straight lines have no roughness
    parts = vectors.T @ y
    # From "interpolates" to "straight line", four weights a decade.
    low, high = 1e-3 / values[-1], 1e3 / values[2]
    weights = np.logspace(np.log10(low), np.log10(high), 4 * int(np.ceil(np.log10(high / low))) + 1)
    left = 1.0 - 1.0 / (1.0 + weights[:, None] * values)
    scores = s.size * ((left * parts) ** 2).sum(axis=1) / left.sum(axis=1) ** 2
    # Exact data have no best weight but the least; their scores are rounding.
    floor = (64.0 * np.finfo(float).eps * float(np.abs(y).max(initial=0.0))) ** 2
    return float(weights[int(np.argmin(np.maximum(scores, floor)))]) / s.size


def _roughness(s: Array) -> Array:
    """Return K with int f''^2 = f^T K f for the natural cubic spline through (s, f)."""
    h, n = np.diff(s), s.size
    Q, R = np.zeros((n, n - 2)), np.zeros((n - 2, n - 2))
    inner = np.arange(n - 2)
    Q[inner, inner], Q[inner + 2, inner] = 1.0 / h[:-1], 1.0 / h[1:]
    Q[inner + 1, inner] = -1.0 / h[:-1] - 1.0 / h[1:]
    R[inner, inner] = (h[:-1] + h[1:]) / 3.0
    R[inner[1:], inner[:-1]] = R[inner[:-1], inner[1:]] = h[1:-1] / 6.0
    K = Q @ np.linalg.solve(R, Q.T)
    return np.asarray(0.5 * (K + K.T))
