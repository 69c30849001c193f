"""Static shapes of many struts at frozen natural curvature, each under a thrust of its own, at once.

`statics.downhill` is the readable statement of the same steps for one rod under any dead loads; a test holds the two
together.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import Final

import numpy as np
from numpy.typing import NDArray

from plastica.equilibria.apart import product_apart
from plastica.equilibria.contraction import adjoint_integral, integral_norm
from plastica.equilibria.statics import CONVERGED, MOST_STEPS
from plastica.numerics.arrays import LANES
from plastica.numerics.grid import Grid

__all__ = ["Settled", "settle_many"]

Array = NDArray[np.float64]

BLOCK: Final = 1 << 18
"""Numbers in the matrices of the members that are settled at a time: they stay in the processor's cache."""

SURELY: Final = 1e-9
"""How far below 0 a bound of a rate of growth must lie for rounding not to matter."""


@dataclass(frozen=True, eq=False)
class Settled:
    """Static shapes.

    Attributes
    ----------
    mu : ndarray, shape (members, n)
        Dimensionless curvature at the nodes.
    converged : ndarray of bool, shape (members,)
        Whether the balance of moments is satisfied to rounding.
    """

    mu: Array
    converged: NDArray[np.bool_]


def settle_many(grid: Grid, gamma: Array, mu: Array, mu_nat: Array) -> Settled:
    """Find the static shape downhill from each of many states, by the steps of `statics.downhill`.

    Parameters
    ----------
    grid : Grid
        Where the curvature is kept.
    gamma : ndarray, shape (members,)
        Dimensionless thrusts.
    mu : ndarray, shape (members, n)
        Dimensionless curvature at the nodes.
    mu_nat : ndarray, shape (members,)
        Dimensionless natural curvature, which is held.

    Returns
    -------
    Settled

    Notes
    -----
    Whether a shape has a direction that grows decides the size of a step. The largest eigenvalue of the stiffness
    gamma M^T cos(theta) M - 1, symmetric in the weighted inner product, is at most gamma |M|^2 max(cos theta) - 1, and
    moves by at most gamma |M|^2 max |change of cos theta|: it is computed only where these bounds leave it open.
    """
    statics = _Statics(grid)
    size = max(1, min(16 * LANES, BLOCK // grid.size**2))
    parts = [
        _settle(statics, gamma[i : i + size], mu[i : i + size], mu_nat[i : i + size])
        for i in range(0, gamma.size, size)
    ]
    if not parts:
        return Settled(np.empty((0, grid.size)), np.zeros(0, dtype=bool))
    shapes, converged = zip(*parts, strict=True)
    return Settled(np.concatenate(shapes), np.concatenate(converged))


@dataclass(frozen=True, eq=False)
class _Statics:
    """The balance of moments of struts on a grid."""

    grid: Grid

    @cached_property
    def root(self) -> Array:
        return np.sqrt(self.grid.w)

    @cached_property
    def M(self) -> Array:
        return adjoint_integral(self.grid)

    @cached_property
    def norm(self) -> float:
        """|M|^2, close to 4/pi^2."""
        return integral_norm(self.grid) ** 2

    def angle(self, mu: Array) -> Array:
        return product_apart(mu, self.grid.A.T)

    def imbalance(self, gamma: Array, mu: Array, theta: Array, mu_nat: Array) -> Array:
        return product_apart(gamma[:, None] * np.sin(theta), self.grid.B.T) - mu + mu_nat[:, None]

    def energy(self, gamma: Array, mu: Array, theta: Array, mu_nat: Array) -> Array:
        """Liapunov function but for the preference energy, which is held."""
        stored = 0.5 * (mu - mu_nat[:, None]) ** 2 + gamma[:, None] * np.cos(theta)
        return np.asarray((self.grid.w * stored).sum(axis=1))

    def stiffness(self, gamma: Array, theta: Array) -> Array:
        """Derivative of the imbalance in the coordinates sqrt(w) mu; shape (members, n, n)."""
        scaled = (gamma[:, None] * np.cos(theta))[:, :, None] * self.M
        made: Array = np.matmul(self.M.T, scaled)
        diagonal = np.arange(self.grid.size)
        made[:, diagonal, diagonal] -= 1.0
        return made


@dataclass(eq=False)
class _Run:
    """Members under way; arrays over all of them, of which only some still move."""

    statics: _Statics
    gamma: Array
    mu: Array
    mu_nat: Array
    theta: Array = field(init=False)
    residual: Array = field(init=False)
    energy: Array = field(init=False)
    step: Array = field(init=False)
    fastest: Array = field(init=False)
    cosine: Array = field(init=False)

    def __post_init__(self) -> None:
        every = np.arange(self.gamma.size)
        self.theta = self.statics.angle(self.mu)
        self.residual, self.energy = self._judged(every, self.mu, self.theta)
        self.step = np.ones(self.gamma.size)
        # Known of no shape yet: an eigenvalue that says nothing of any other.
        self.fastest, self.cosine = np.full(self.gamma.size, np.inf), np.zeros(self.theta.shape)

    def _judged(self, some: NDArray[np.intp], mu: Array, theta: Array) -> tuple[Array, Array]:
        gamma, mu_nat = self.gamma[some], self.mu_nat[some]
        return self.statics.imbalance(gamma, mu, theta, mu_nat), self.statics.energy(gamma, mu, theta, mu_nat)

    def left(self, some: NDArray[np.intp]) -> NDArray[np.intp]:
        """Those of some members that are not yet at rest, nor stuck."""
        largest = np.abs(self.residual[some]).max(axis=1)
        scale = np.maximum(1.0, np.abs(self.mu[some]).max(axis=1))
        return np.asarray(some[(largest > CONVERGED * scale) & (self.step[some] >= 1e-12)])

    def advance(self, some: NDArray[np.intp]) -> NDArray[np.intp]:
        """Try a step of each; return those that may go on."""
        stiffness = self.statics.stiffness(self.gamma[some], self.theta[some])
        self._shorten(some, stiffness)
        step, root, diagonal = self.step[some], self.statics.root, np.arange(self.mu.shape[1])
        matrix = np.negative(stiffness, out=stiffness)
        matrix[:, diagonal, diagonal] += (1.0 / step)[:, None]
        change = np.linalg.solve(matrix, (root * self.residual[some])[:, :, None])[:, :, 0] / root
        mu = self.mu[some] + change
        theta = self.statics.angle(mu)
        residual, energy = self._judged(some, mu, theta)
        before = self.energy[some]
        good = (energy <= before + 1e-14 * np.maximum(1.0, np.abs(before))) & np.isfinite(residual).all(axis=1)
        larger = np.abs(residual).max(axis=1) >= np.abs(self.residual[some]).max(axis=1)
        stalled = good & (step > 1e12) & larger
        taken = some[good]
        self.mu[taken], self.theta[taken] = mu[good], theta[good]
        self.residual[taken], self.energy[taken] = residual[good], energy[good]
        self.step[some] = np.where(good, np.minimum(4.0 * step, 1e15), 0.125 * step)
        return np.asarray(some[~stalled])

    def _shorten(self, some: NDArray[np.intp], stiffness: Array) -> None:
        """Keep each step below half of what would throw a growing direction to the other side."""
        cosine = np.cos(self.theta[some])
        reach = self.gamma[some] * self.statics.norm
        moved = self.fastest[some] + reach * np.abs(cosine - self.cosine[some]).max(axis=1)
        bound = np.minimum(reach * np.maximum(cosine.max(axis=1), 0.0) - 1.0, moved)
        open_ = bound > -SURELY
        if open_.any():
            which = some[open_]
            self.fastest[which] = np.linalg.eigvalsh(stiffness[open_])[:, -1]
            self.cosine[which] = cosine[open_]
            growing = which[self.fastest[which] > 0.0]
            self.step[growing] = np.minimum(self.step[growing], 0.5 / self.fastest[growing])


def _settle(statics: _Statics, gamma: Array, mu: Array, mu_nat: Array) -> tuple[Array, NDArray[np.bool_]]:
    run = _Run(statics, gamma, mu.copy(), mu_nat)
    some = np.arange(gamma.size)
    for _ in range(MOST_STEPS):
        some = run.left(some)
        if not some.size:
            break
        some = run.advance(some)
    largest = np.maximum(1.0, np.abs(run.mu).max(axis=1))
    return run.mu, np.abs(run.residual).max(axis=1) <= 100.0 * CONVERGED * largest
