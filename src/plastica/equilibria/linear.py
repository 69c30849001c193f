"""The linearisation at an equilibrium on a Gauss grid, where it keeps its symmetry."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from plastica.equilibria.elastica import Profile, alpha_rate, profile
from plastica.equilibria.equilibrium import Equilibrium
from plastica.errors import ArgumentError
from plastica.numerics.grid import Grid

__all__ = ["Discrete", "Levels", "discretise", "linearisation", "schroedinger"]

Array = NDArray[np.float64]

EPS = float(np.finfo(float).eps)

FLOOR = 16.0
"""Rounding of the eigenvalue solver, in units of eps times the largest |rho|: the largest measured is 4."""

FORM_FLOOR = 16.0
"""Rounding of phi, in units of eps times its condition number in (gamma, alpha)."""

LARGEST_ELEMENT = 256
FEWEST_NODES, MOST_NODES = 32, 512
"""Sizes of the coarser of the two grids: eigenvalues of matrices of 1024 rows take a few tenths of a second."""


@dataclass(frozen=True, eq=False)
class Discrete:
    """K = gamma J* cos(phi) J at one equilibrium on one grid, as the symmetric matrix gamma M^T cos(phi) M.

    With M = W^(1/2) A W^(-1/2), W = diag(w) the quadrature weights: since W B = (W A)^T, the matrix gamma B
    diag(cos phi) A is similar to it, and a vector x of it stands for the curvature W^(-1/2) x.

    Attributes
    ----------
    gamma, alpha : float
        Thrust and clamp curvature.
    grid : Grid
        Nodes and weights.
    depth : float, optional
        As for `elastica.profile`, where alpha alone cannot tell.
    """

    gamma: float
    alpha: float
    grid: Grid
    depth: float | None = None

    @cached_property
    def profile(self) -> Profile:
        """The closed forms at the nodes."""
        return profile(self.gamma, self.alpha, self.grid.s, self.depth)

    @cached_property
    def M(self) -> Array:
        """W^(1/2) A W^(-1/2), of norm below 2/pi."""
        root = np.sqrt(self.grid.w)
        return np.asarray(root[:, None] * self.grid.A / root)

    @cached_property
    def K(self) -> Array:
        """The symmetric matrix of K."""
        return np.asarray((self.M.T * (self.gamma * np.cos(self.profile.phi))) @ self.M)

    def doubt(self, angles: Array) -> Array:
        """Return what the rounding of phi can change eigenvalues by; shape (k,).

        To first order an eigenvalue changes by gamma int delta(cos phi) psi^2, where psi = J xi for the eigenvalues
        of K and `angles` holds W^(1/2) psi in its columns. delta phi is of the order of eps times |phi| +
        |alpha d phi/d alpha| + |2 gamma d phi/d gamma + alpha d phi/d alpha|, the last being s phi'. Near the
        separatrix d phi/d alpha grows like exp(gamma^(1/2)): what gamma and alpha are to the last bit matters then,
        and no method that is given doubles can do better. Given the depth t, t d alpha/d t takes the place of alpha.
        """
        phi, slope, theta0 = self.profile.phi, self.profile.slope, self.profile.theta0
        given = self.alpha if self.depth is None else self.depth * alpha_rate(self.gamma, self.depth)
        with np.errstate(over="ignore", invalid="ignore"):
            spread = EPS * FORM_FLOOR * (np.abs(phi) + np.abs(given * theta0) + np.abs(self.grid.s * slope))
            change = np.fmin(np.abs(np.sin(phi)) * spread + 0.5 * spread**2, 2.0)
        return np.asarray(self.gamma * (change @ angles**2))


def discretise(gamma: float, alpha: float, size: int, depth: float | None = None) -> Discrete:
    """Return K on a grid of `size` nodes or a few more, with at most 256 on each element."""
    elements = -(-size // LARGEST_ELEMENT)
    breaks = tuple(float(b) for b in np.linspace(0.0, 1.0, elements + 1))
    return Discrete(gamma, alpha, Grid(-(-size // elements), breaks), depth)


def first_size(gamma: float, alpha: float, count: int) -> int:
    """Nodes with which to begin: phi turns at rates up to the larger of gamma^(1/2) and |alpha|, modes oscillate."""
    rate = max(float(np.sqrt(gamma)), 0.5 * abs(alpha))
    wanted = FEWEST_NODES + 4.0 * rate + 2.0 * count
    return int(min(8 * np.ceil(wanted / 8.0), MOST_NODES))


def linearisation(equilibrium: Equilibrium, grid: Grid) -> Array:
    """Return the matrix of the linearisation L(xi, xi_nat) = (xi_nat - xi + K xi, 0) on a grid.

    This is DF at an equilibrium with |D| <= Theta, section 3 of the paper: the flow law vanishes there together with
    its slope, so the natural curvature does not move to first order.

    Parameters
    ----------
    equilibrium : Equilibrium
        Where to linearise.
    grid : Grid
        Nodes at which the curvature is kept.

    Returns
    -------
    ndarray, shape (n + 1, n + 1)
        Acts on nodal values of the curvature, followed by the natural curvature.

    Raises
    ------
    ArgumentError
        Where an argument is of the wrong kind.
    """
    require_equilibrium(equilibrium)
    if not isinstance(grid, Grid):
        raise ArgumentError("must be a pl.Grid", where="grid", value=grid)
    n = grid.size
    cos = np.cos(equilibrium.profile(grid.s).phi)
    out = np.zeros((n + 1, n + 1))
    out[:n, :n] = equilibrium.gamma * (grid.B * cos) @ grid.A - np.eye(n)
    out[:n, n] = 1.0
    return out


class Levels(NamedTuple):
    """Eigenvalues in ascending order, with an estimate of the error of each."""

    values: Array
    errors: Array


def schroedinger(equilibrium: Equilibrium, count: int = 1) -> Levels:
    """Lowest eigenvalues of H psi = -psi'' - gamma cos(phi) psi with psi(0) = 0, psi'(1) = 0.

    The second variation of the Liapunov function at frozen natural curvature; an equilibrium is stable there where
    they are all positive. No derivative is taken: with K_- = J* gamma (1 - cos phi) J, the resolvent is
    (H + gamma)^(-1) = J (1 + K_-)^(-1) J*, on the grid X^T X with X = C^(-1) M^T and C C^T = 1 + K_-. The singular
    values of X give the eigenvalues to the relative accuracy of H + gamma, which is at least pi^2/4.

    Parameters
    ----------
    equilibrium : Equilibrium
        Where.
    count : int
        How many, at most 200.

    Returns
    -------
    Levels
        `values` ascending, `errors`; both of shape (count,).

    Raises
    ------
    ArgumentError
        Where an argument is of the wrong kind.

    Notes
    -----
    You should see: the lowest one is exactly alpha^2/4 on the first buckled branch of a rod without natural
    curvature, gamma = K(k)^2 and alpha = 2 k K(k); its psi is sn(gamma^(1/2) s), that is sin(phi/2).

    Checked by test_lowest_level_on_the_first_buckled_branch.
    """
    require_equilibrium(equilibrium)
    require_count(count)
    gamma, alpha, depth = equilibrium.gamma, equilibrium.alpha, equilibrium.depth
    size = first_size(gamma, alpha, count)
    coarse, _ = _levels(discretise(gamma, alpha, size, depth), count)
    while True:
        values, floor = _levels(discretise(gamma, alpha, 2 * size, depth), count)
        difference = np.abs(values - coarse)
        if np.all(difference <= floor) or 2 * size > MOST_NODES:
            return Levels(values, difference + floor)
        size, coarse = 2 * size, values


def _levels(discrete: Discrete, count: int) -> tuple[Array, Array]:
    """The lowest eigenvalues of H on one grid, and what rounding can do to them."""
    gamma, M = discrete.gamma, discrete.M
    hollow = gamma * (1.0 - np.cos(discrete.profile.phi))
    root = np.linalg.cholesky(np.eye(discrete.grid.size) + (M.T * hollow) @ M)
    _, sigma, right = np.linalg.svd(np.linalg.solve(root, M.T))
    values = 1.0 / sigma[:count] ** 2 - gamma
    return values, FLOOR * EPS * (values + gamma) ** 2 * sigma[0] ** 2 + discrete.doubt(right[:count].T)


def require_equilibrium(equilibrium: object) -> None:
    """Raise where something is not an equilibrium."""
    if not isinstance(equilibrium, Equilibrium):
        raise ArgumentError(
            "must be a pl.Equilibrium",
            where="equilibrium",
            value=equilibrium,
            next_step="Make one with pl.equilibrium(material, gamma, alpha).",
        )


def require_count(count: object, most: int = 200, name: str = "count", least: int = 1) -> None:
    """Raise where something is not a number of eigenvalues."""
    whole = isinstance(count, (int, np.integer)) and not isinstance(count, bool)
    if not whole or not least <= count <= most:  # type: ignore[operator]
        raise ArgumentError(f"must be an integer in [{least}, {most}]", where=name, value=count)
