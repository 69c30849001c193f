"""Whether a grid resolves a shape: the decay of Legendre coefficients, and what a finer grid says of the free end."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from plastica.numerics.grid import Grid
from plastica.physics.model import Model
from plastica.physics.status import LOST

__all__ = ["coarsest", "end_errors", "largest_end_error", "tails", "too_coarse", "turns_unseen"]

Array = NDArray[np.float64]

EPS = float(np.finfo(float).eps)
STATES_AT_ONCE = 1000

HALF_TURN = np.pi
"""Angle between neighbouring points from which on sampled sines and cosines no longer tell how often they turned."""

MOST_WEIGHED = 30
"""States of a motion whose loads are asked how far they hold an error back."""


def tails(grid: Grid, mu: Array, size: float | Array) -> Array:
    """Return the relative Legendre tails of shapes: how much sits in the last coefficients on the grid.

    Looks at the curvature, relative to `size`, and at sin(theta) and cos(theta), whose products with the loads are what
    is integrated: relative to one, the sine to `size` (which bounds it) if less. Where the rod turns by half a turn or
    more between neighbouring nodes, the samples tell nothing, and the tail is at least 1.

    Parameters
    ----------
    grid : Grid
        Where the curvature is kept.
    mu : ndarray, shape (k, n)
        Dimensionless curvature at the nodes.
    size : float or ndarray of shape (k,)
        Largest curvature met, above 0.

    Returns
    -------
    ndarray, shape (k,)
    """
    theta = mu @ grid.A.T
    bent, turned = grid.tail(mu) / size, grid.tail(np.sin(theta)) / np.minimum(1.0, size)
    found = np.maximum(np.maximum(bent, turned), grid.tail(np.cos(theta)))
    return np.where(_steepest(theta, mu @ grid.w) < HALF_TURN, found, np.maximum(found, 1.0))


def _steepest(theta: Array, end: Array) -> Array:
    """Return the largest angle between neighbours, from the clamp over the nodes to the free end; shape (k,)."""
    ends = np.zeros((theta.shape[0], 1)), end[:, None]
    return np.asarray(np.abs(np.diff(np.hstack([ends[0], theta, ends[1]]), axis=1)).max(axis=1))


def turns_unseen(grid: Grid, mu: Array) -> bool:
    """Whether a shape turns by half a turn or more between neighbouring nodes, so that these do not tell its place."""
    theta = (grid.A @ mu)[None, :]
    return bool(_steepest(theta, np.array([grid.w @ mu]))[0] >= HALF_TURN)


def too_coarse(strut: Model, states: Array, rtol: float, size: float | None = None) -> float | None:
    """Return the largest of the `tails` of a motion where it exceeds the tolerance, else None.

    Parameters
    ----------
    strut : Model
        The model on the grid in question.
    states : ndarray, shape (k, size)
        States met on the way.
    rtol : float
        The relative tail allowed; never below 50 eps, where rounding takes over.
    size : float, optional
        Largest curvature met, by default that of these states.

    Returns
    -------
    float or None
    """
    n = strut.grid.size
    largest = float(np.abs(states[:, :n]).max()) if size is None else size
    if largest == 0.0:
        return None
    parts = range(0, states.shape[0], STATES_AT_ONCE)
    worst = max(float(tails(strut.grid, states[i : i + STATES_AT_ONCE, :n], largest).max()) for i in parts)
    return worst if worst > max(rtol, 50.0 * EPS) else None


def end_errors(model: Model, t: Array, mu: Array, thrust: Array | None = None) -> Array:
    """Estimate how far the grid puts the free end off, from what a grid twice as fine makes of the same shapes.

    Two errors add up: that of the quadrature of the free end's place, and the place's change by the error of the
    quadrature of the moment. A part of the latter that the loads hold back (an eigenvalue l < 0 of the derivative of
    the moment) counts by 1/(1 - l) only. This is within a factor of 3 of the error of a motion computed on the grid
    (test_resolution), where no bottleneck amplifies it.

    Parameters
    ----------
    model : Strut or Rod
        The rod on the grid in question.
    t : ndarray, shape (k,)
        Dimensionless times.
    mu : ndarray, shape (k, n)
        Dimensionless curvature at the nodes.
    thrust : ndarray of shape (k,), optional
        Dimensionless thrusts in place of the model's own.

    Returns
    -------
    ndarray, shape (k,)
        In L; infinite where the rod turns by half a turn or more between neighbours of the finer grid, which then tells
        nothing; the relative tail where there is no finer grid.
    """
    finer = _Finer(model)
    plain, place, moment = finer.errors(t, mu, thrust)
    held = [
        place[i] + finer.weighed(t[i : i + 1], mu[i], moment[i], None if thrust is None else thrust[i : i + 1])
        if LOST < plain[i] < np.inf
        else plain[i]
        for i in range(plain.size)
    ]
    return np.array(held)


def largest_end_error(model: Model, t: Array, mu: Array) -> float:
    """Return the largest of the `end_errors` of the states of a motion."""
    finer, parts = _Finer(model), range(0, t.size, STATES_AT_ONCE)
    found = [finer.errors(t[i : i + STATES_AT_ONCE], mu[i : i + STATES_AT_ONCE], None) for i in parts]
    plain, place, moment = (np.concatenate(each) for each in zip(*found, strict=True))
    largest = float(plain.max())
    if not LOST < largest < np.inf:
        return largest
    worst = 0.0
    for i in np.argsort(plain)[::-1][:MOST_WEIGHED]:
        if plain[i] <= worst:
            break
        worst = max(worst, float(place[i] + finer.weighed(t[i : i + 1], mu[i], moment[i], None)))
    return worst


def coarsest(model: Model, t: Array, mu: Array) -> int:
    """Return which of some states the grid resolves least, by an estimate that holds no loads against the errors."""
    finer, parts = _Finer(model), range(0, t.size, STATES_AT_ONCE)
    found = [finer.errors(t[i : i + STATES_AT_ONCE], mu[i : i + STATES_AT_ONCE], None)[0] for i in parts]
    return int(np.argmax(np.concatenate(found)))


class _Finer:
    """What a grid twice as fine makes of shapes on a grid."""

    def __init__(self, model: Model) -> None:
        grid = model.grid
        self.model, self.fine = model, model.with_grid(grid.refined())
        self.there_is = self.fine.grid.size > grid.size
        fine = self.fine.grid
        self.angle = grid.integration(fine.s).T
        self.moment = (fine.w - fine.integration(grid.s)).T

    def errors(self, t: Array, mu: Array, thrust: Array | None) -> tuple[Array, Array, Array]:
        """Return the error estimates, the part of the place's quadrature, and the errors of the moment at the nodes."""
        model, grid, fine = self.model, self.model.grid, self.fine.grid
        if not self.there_is:
            size = np.maximum(np.abs(mu).max(axis=1), 1e-300)
            return tails(grid, mu, size), np.zeros(mu.shape[0]), np.zeros(mu.shape)
        theta, between = model.angle(mu), mu @ self.angle
        place = np.hypot(
            np.cos(between) @ fine.w - np.cos(theta) @ grid.w, np.sin(between) @ fine.w - np.sin(theta) @ grid.w
        )
        shears = _shear(self.fine, t, between, thrust), _shear(model, t, theta, thrust)
        moment = shears[0] @ self.moment - shears[1] @ grid.B.T
        plain = place + self._moved(theta, moment)
        told = _steepest(between, mu @ grid.w) < HALF_TURN
        return np.where(told, plain, np.inf), place, moment

    def _moved(self, theta: Array, bending: Array) -> Array:
        """How far an additional curvature moves the free end."""
        turned = self.model.angle(bending)
        w = self.model.grid.w
        return np.hypot((np.sin(theta) * turned) @ w, (np.cos(theta) * turned) @ w)

    def weighed(self, t: Array, mu: Array, moment: Array, thrust: Array | None) -> float:
        """How far the error of the moment moves the free end of one shape, where the loads hold part of it back."""
        root, theta = np.sqrt(self.model.grid.w), self.model.angle(mu)
        along, across = _force(self.model, t, thrust)
        inner = root[:, None] * self.model.grid.A / root
        pull = (along * np.cos(theta) - across * np.sin(theta)).reshape(-1, 1)
        rates, vectors = np.linalg.eigh(inner.T @ (pull * inner))
        held = vectors @ ((root * moment) @ vectors / np.maximum(1.0 - rates, 1.0)) / root
        return float(self._moved(theta, held))


def _force(model: Model, t: Array, thrust: Array | None) -> tuple[Array, Array]:
    """Dead loads beyond the nodes, along and across, with the thrusts given in place of the model's own."""
    along, across = model.dead_force(t)
    own = np.asarray(model.loads.thrust(t), dtype=float)[..., None]
    return (along if thrust is None else along - own + thrust[:, None]), across


def _shear(model: Model, t: Array, theta: Array, thrust: Array | None) -> Array:
    along, across = _force(model, t, thrust)
    return along * np.sin(theta) + across * np.cos(theta)
