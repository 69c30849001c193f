"""Within what distance of a static shape the motion at frozen natural curvature certainly goes there.

At frozen natural curvature the motion under constant dead loads is the gradient flow of the Liapunov function. With
n_load = |n| (-cos psi, sin psi), e = mu - mu_E and u = int_0^s e,

    1/2 d/dt |e|^2 = -|e|^2 + int |n| [sin(theta_E + psi + u) - sin(theta_E + psi)] u,        |u(s)| <= sqrt(s) |e|.

Where the right side is negative for every e with |e| <= r, the ball of radius r about the shape holds no other static
shape, no motion leaves it, and the distance from the shape falls for ever. J and J* being adjoint on the grid, all of
this holds for the rod on the grid, not only in the limit.
"""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import NDArray

from plastica.numerics.grid import Grid

__all__ = ["adjoint_integral", "chord_slope", "contraction", "contracts", "integral_norm", "steepest"]

Array = NDArray[np.float64]

PIECES: Final = 8
"""Pieces of the range of angles in each of which the slope of a chord of the sine is bounded."""

SURELY: Final = 1e-9
"""How far above 0 a rate must lie for rounding not to matter."""


def chord_slope(angle: Array, reach: Array) -> Array:
    """Bound the slopes of the sine's chords from one end: (sin(angle + u) - sin(angle))/u for |u| <= reach.

    Parameters
    ----------
    angle : ndarray
        Angle at the fixed end.
    reach : ndarray
        Largest |u|; broadcasts with it.

    Returns
    -------
    ndarray
        An upper bound, exact for reach 0.
    """
    # The slope is cos(angle + v) sin(v)/v with v = u/2; of v and -v the one towards a multiple of 2 pi has more.
    t = np.abs(np.remainder(np.asarray(angle) + np.pi, 2.0 * np.pi) - np.pi)
    half = 0.5 * np.asarray(reach)
    bound = np.cos(t)
    for k in range(PIECES):
        lower, upper = half * (k / PIECES), half * ((k + 1) / PIECES)
        cosine = np.cos(np.maximum(np.maximum(t - upper, lower - t), 0.0))
        bound = np.maximum(bound, cosine * np.sinc(np.where(cosine > 0.0, lower, upper) / np.pi))
    return np.where(half >= np.pi, 1.0, bound)


def steepest(angle: Array, reach: Array) -> Array:
    """Return the largest slope of the sine within `reach` of an angle, which bounds all of its chords there."""
    t = np.abs(np.remainder(np.asarray(angle) + np.pi, 2.0 * np.pi) - np.pi)
    return np.asarray(np.cos(np.maximum(t - reach, 0.0)))


def contraction(grid: Grid, force: Array, slope: Array) -> Array:
    """Bound the rate g at which |e| falls, d|e|/dt <= -g |e|, where the sine's chords are no steeper than `slope`.

    Parameters
    ----------
    grid : Grid
        Where the curvature is kept.
    force : ndarray, shape (members, n) or (members, 1)
        |n_load| at the nodes, dimensionless.
    slope : ndarray, shape (members, n)
        Bounds of the slopes at the nodes.

    Returns
    -------
    ndarray, shape (members,)
        g, at most 1. Of no member does it depend, to the last bit, on which others there are.
    """
    M = adjoint_integral(grid)
    growing: Array = np.matmul(M.T, (force * slope)[:, :, None] * M)
    return np.asarray(np.minimum(1.0, 1.0 - np.linalg.eigvalsh(growing)[:, -1]))


def contracts(grid: Grid, force: Array, angle: Array, distance: Array) -> NDArray[np.bool_]:
    """Tell whether every state as near to a static shape as `distance` certainly goes there.

    Parameters
    ----------
    grid : Grid
        Where the curvature is kept.
    force : ndarray, shape (members, n) or (members, 1)
        |n_load| at the nodes, dimensionless.
    angle : ndarray, shape (members, n)
        theta_E + psi at the nodes.
    distance : ndarray, shape (members,)
        |e|, the distance in the norm of curvature.

    Returns
    -------
    ndarray of bool, shape (members,)
    """
    slope = chord_slope(angle, np.sqrt(grid.s) * distance[:, None])
    # The largest slope alone is enough where the force is below Euler's load.
    fastest = np.maximum((force * slope).max(axis=1), 0.0) * integral_norm(grid) ** 2
    g = 1.0 - fastest
    open_ = np.flatnonzero(g < SURELY)
    if open_.size:
        g[open_] = contraction(grid, np.broadcast_to(force, slope.shape)[open_], slope[open_])
    return np.asarray(g >= SURELY)


def adjoint_integral(grid: Grid) -> Array:
    """A in the coordinates sqrt(w) mu, in which the adjoint is the transpose."""
    root = np.sqrt(grid.w)
    return np.asarray(root[:, None] * grid.A / root)


def integral_norm(grid: Grid) -> float:
    """Norm of the integral J on the grid, close to 2/pi."""
    return float(np.linalg.norm(adjoint_integral(grid), 2))
