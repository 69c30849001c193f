"""Unstable directions of equilibria, counted by the oscillation of theta_0: no eigenvalue is computed."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from plastica.equilibria.elastica import Ends, ends
from plastica.errors import ArgumentError

__all__ = ["DEGENERATE", "FOLD_TOLERANCE", "fold_distance", "unstable_count"]

Array = NDArray[np.float64]

DEGENERATE = -1
"""The answer of `unstable_count` too near a fold to tell."""

FOLD_TOLERANCE = 1e-10
"""An equilibrium counts as a fold where `fold_distance` is at most this."""

AGM_STEPS = 13
"""Steps of the arithmetic-geometric mean: it doubles its digits at each, and needs 7 where 1 - k^2 is one ulp, 12 deep
in the layer at the separatrix."""


def fold_distance(gamma: ArrayLike, theta0: ArrayLike, theta0_slope: ArrayLike) -> Array:
    """Return |theta_0'(1)| over its scale: 0 at a fold, 1 where theta_0(1) = 0.

    The scale is that of the phase plane of theta_0'' + gamma cos(phi) theta_0 = 0, namely
    (theta_0'(1)^2 + gamma theta_0(1)^2)^(1/2).

    Parameters
    ----------
    gamma : array_like
        Thrust.
    theta0, theta0_slope : array_like
        theta_0 and theta_0' at the free end, of one shape with `gamma`.

    Returns
    -------
    ndarray
    """
    slope = np.abs(np.asarray(theta0_slope, dtype=float))
    height = np.sqrt(np.asarray(gamma, dtype=float)) * np.abs(np.asarray(theta0, dtype=float))
    largest = np.maximum(slope, height)
    return np.asarray((slope / largest) / np.hypot(slope / largest, height / largest))


def unstable_count(
    gamma: ArrayLike, alpha: ArrayLike, at_end: Ends | None = None, depth: float | None = None
) -> NDArray[np.int64]:
    """Count the unstable directions of equilibria at frozen natural curvature.

    With theta_0 = d phi / d alpha, which solves theta_0'' + gamma cos(phi) theta_0 = 0, theta_0(0) = 0,
    theta_0'(0) = 1, the number of eigenvalues of K above 1 is the Morse index of the Liapunov function at frozen
    natural curvature (Sturm's oscillation theorem, with the condition theta'(1) = 0 at the free end)::

        n = #{zeros of theta_0 in (0, 1]} + [theta_0(1) theta_0'(1) < 0]

    The zeros are counted exactly, not sampled. For alpha^2 < 4 gamma, theta_0 is cn(u)/w times a function h of
    u = w s, w^2 = gamma, with h(0) = 0 and h' = 1/cn(u)^2 > 0: so theta_0 has no zero before the first pole of h at
    the quarter period K(k), and exactly one between any two neighbouring poles, where cn changes its sign. The number
    of poles in (0, w] is round(w/2K) = j, so that n_0 = j - 1 or j zeros, which of them told by the sign of
    theta_0(1), that is (-1)^n_0. Where rounding makes j miss by one, next to a pole or to the separatrix, this does no
    harm: the sign decides all the same. For alpha^2 >= 4 gamma, theta_0 has no zero but s = 0.

    Parameters
    ----------
    gamma, alpha : array_like
        Thrust (>= 0) and clamp curvature; they broadcast.
    at_end : Ends, optional
        The closed forms at s = 1 for the same gamma and alpha, where they are known already.

    depth : float, optional
        As for `ends`, where alpha alone cannot tell; `at_end` is then given too.

    Returns
    -------
    ndarray of int
        The number, or `DEGENERATE` (-1) where |theta_0'(1)| is at most 1e-10 of (theta_0'(1)^2 + gamma
        theta_0(1)^2)^(1/2): there an eigenvalue is zero to rounding, and its sign cannot be told.

    Raises
    ------
    ArgumentError
        Where a value is not finite or out of the range of `ends`, or the shapes do not broadcast.

    Notes
    -----
    Good values: gamma to 500 and |alpha| to 50. Near the separatrix theta_0 grows like exp(gamma^(1/2)), and what
    gamma and alpha mean to the last bit then decides the count.

    Checked by test_the_two_counts_agree.
    """
    try:
        thrust, clamp = np.broadcast_arrays(np.asarray(gamma, dtype=float), np.asarray(alpha, dtype=float))
    except (TypeError, ValueError):
        raise ArgumentError("must be numbers whose shapes broadcast", where="gamma, alpha") from None
    closed = ends(thrust, clamp) if at_end is None else at_end
    theta0, slope = np.asarray(closed.theta0, dtype=float), np.asarray(closed.theta0_slope, dtype=float)
    poles = _poles(thrust, np.abs(clamp), depth)
    # Behind its n-th zero theta_0 has the sign (-1)^n; a zero at s = 1 itself counts.
    parity = (np.where(theta0 == 0.0, slope, theta0) < 0.0).astype(np.int64)
    zeros = np.abs(poles - (poles - parity) % 2)
    count = zeros + (np.sign(theta0) * np.sign(slope) < 0.0)
    degenerate = fold_distance(thrust, theta0, slope) <= FOLD_TOLERANCE
    return np.where(degenerate, DEGENERATE, count).astype(np.int64)


def _poles(gamma: Array, alpha: Array, depth: float | None) -> NDArray[np.int64]:
    """How many zeros cn(u) has in (0, w]: round(w/2K), with K = pi / (2 agm(1, k')); 0 beyond the separatrix."""
    w = np.sqrt(gamma)
    librating = alpha < 2.0 * w
    width = np.where(librating, 2.0 * w, 1.0)
    a = np.ones_like(w)
    b = np.where(librating, np.sqrt(np.maximum(width - alpha, 0.0) * (width + alpha)) / width, 1.0)
    if depth is not None:
        librating, b = np.full(w.shape, depth > 0.0), np.full(w.shape, np.cosh(depth) ** -1.0)
    for _ in range(AGM_STEPS):
        a, b = 0.5 * (a + b), np.sqrt(a * b)
    return np.where(librating, np.floor(w * a / np.pi + 0.5), 0.0).astype(np.int64)
