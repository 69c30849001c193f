"""Cubic smoothing splines of measured points, with the most likely smoothing, which is stated."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from scipy.interpolate import BSpline

__all__ = ["MOST_POINTS", "Smoothed", "likeliest", "smooth", "thinned"]

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
    error : float
        Standard error of f from the scatter of the points, root mean square over them; 0 where it interpolates.
    """

    spline: BSpline
    smoothing: float
    change: float
    error: float


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
        Weight of the roughness; 0 interpolates; None takes the weight of the greatest restricted likelihood.

    Returns
    -------
    Smoothed
    """
    from scipy.interpolate import make_interp_spline, make_smoothing_spline

    values, vectors = np.linalg.eigh(_roughness(s))
    values = np.maximum(values, 0.0)
    values[:2] = 0.0  # straight lines have no roughness
    parts = vectors.T @ y
    if smoothing is None:
        least = 64.0 * np.finfo(float).eps * float(np.abs(y).max(initial=0.0))
        weight, _ = likeliest(values, parts, 0.0, s.size, least)
    else:
        weight = smoothing * s.size
    if weight == 0.0:
        return Smoothed(make_interp_spline(s, y, k=3, bc_type="natural"), 0.0, 0.0, 0.0)
    # The smoother is S = (1 + weight K)^-1 with the roughness K = Q R^-1 Q^T of natural cubic splines (Reinsch).
    kept = 1.0 / (1.0 + weight * values)
    noise = float(np.sum(((1.0 - kept) * parts) ** 2)) / max(float(np.sum(1.0 - kept)), 1e-300)
    spline = make_smoothing_spline(s, y, lam=weight)
    change = float(np.sqrt(np.mean((y - spline(s)) ** 2)))
    return Smoothed(spline, weight / s.size, change, float(np.sqrt(noise * np.mean(kept))))


def likeliest(roughness: Array, parts: Array, rest: float, count: int, least: float) -> tuple[float, float]:
    """Return the weight of a penalty that has the greatest restricted likelihood, and the variance of the noise.

    Data are noise of one variance, plus modes whose variances are inverse to their roughness; modes without roughness
    are free. The weight is the ratio of the two variances. Of the two common choices this one is less easily misled
    than generalised cross-validation by few points (Wood, J. R. Statist. Soc. B 73, 2011, page 3).

    Parameters
    ----------
    roughness : ndarray, shape (k,)
        Eigenvalues of the penalty, in ascending order, 0 for free modes.
    parts : ndarray, shape (k,)
        Components of the data along the modes, which are orthonormal.
    rest : float
        Square of what the data hold besides.
    count : int
        Number of data, at least k.
    least : float
        The least noise to be reckoned with: what is below it is rounding.

    Returns
    -------
    tuple of float
        Weight w of the penalty in |data - fit|^2 + w penalty, and variance.
    """
    rough = roughness > 0.0
    values, seen = roughness[rough], parts[rough] ** 2
    free = count - int(np.count_nonzero(~rough))
    if values.size == 0 or free < 1:
        return 1.0, rest / max(free, 1)
    # From "interpolates" to "no roughness", ten weights a decade.
    low, high = 1e-4 / float(values[-1]), 1e4 / float(values[0])
    weights = np.logspace(np.log10(low), np.log10(high), 10 * int(np.ceil(np.log10(high / low))) + 1)
    share = weights[:, None] * values
    floor = least**2 + np.finfo(float).tiny
    variance = np.maximum(((seen * share / (1.0 + share)).sum(axis=1) + rest) / free, floor)
    scores = free * np.log(variance) + np.log1p(1.0 / share).sum(axis=1)
    best = int(np.argmin(scores))
    return float(weights[best]), float(variance[best])


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
