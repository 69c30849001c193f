"""The paper's formulas spelled out once more, for the tests, by a quadrature that is none of the package's."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.polynomial import Legendre

import plastica as pl
from plastica.physics.model import Model
from tests.support import EPS, pair

Array = Any

MANY = np.polynomial.legendre.leggauss(80)
S, W = 0.5 * (MANY[0] + 1.0), 0.5 * MANY[1]
"""Places and weights of a quadrature of [0, 1] that is none of the package's grids."""


def slope(grid: pl.Grid, values: Array) -> Array:
    """Derivative along the rod at the nodes of one element, from the polynomial through nodal values."""
    fitted = [Legendre.fit(grid.s, row, grid.size - 1, domain=[0.0, 1.0]) for row in np.atleast_2d(values)]
    return np.array([each.deriv()(grid.s) for each in fitted])


def at(grid: pl.Grid, values: Array, s: float) -> Array:
    """Values at one place, from the same polynomials."""
    rows = np.atleast_2d(values)
    return np.array([float(Legendre.fit(grid.s, row, grid.size - 1, domain=[0.0, 1.0])(s)) for row in rows])


def slack(grid: pl.Grid, *values: Array) -> float:
    """Rounding of a derivative of a polynomial through n nodes: of the order of eps n^4 times the values."""
    return 16.0 * EPS * float(grid.size) ** 4 * max(1.0, *(float(np.abs(each).max()) for each in values))


def kappa(m: float) -> float:
    """Preference energy of pair B; one wrong letter in the package's own reading of it would show."""
    return 0.05 * m**2 * (m**2 - 2.25) ** 2 / 1.5**4


def kappa_slope(m: float) -> float:
    return 0.05 * (2.0 * m * (m**2 - 2.25) ** 2 + 4.0 * m**3 * (m**2 - 2.25)) / 1.5**4


def threshold(m: float) -> float:
    return 0.05 * (1.0 + m**2)


def flow(x: float) -> float:
    """Flow law of pair B with c = 2."""
    return 2.0 * x**2 if x > 0.0 else 0.0


def material() -> pl.Material:
    """Pair B with c = 2, whose laws are those above."""
    return pair("B", 2.0)


def theta(mu: Legendre, s: Array) -> Array:
    return mu.integ(lbnd=0.0)(s)


def drive(mu: Legendre, m: float) -> float:
    """D = int mu - m - kappa'(m), equation (2.17) without dimensions."""
    return float(W @ mu(S)) - m - kappa_slope(m)


def natural_rate(d: float, m: float) -> float:
    """The three cases of equation (2.22)."""
    if d > threshold(m):
        return flow(d - threshold(m))
    return -flow(-threshold(m) - d) if d < -threshold(m) else 0.0


def rate(mu: Legendre, m: float, gamma: float, s: Array) -> tuple[Array, float]:
    """F(mu, m) at places s, equation (3.20): the inner integral exactly, the outer by quadrature from each place on."""
    moments = [gamma * (1.0 - place) * float(W @ np.sin(theta(mu, place + (1.0 - place) * S))) for place in s]
    return m - mu(s) + np.array(moments), natural_rate(drive(mu, m), m)


def energy(mu: Legendre, m: float) -> float:
    """Equation (1.1), integrated along the rod."""
    return 0.5 * float(W @ (mu(S) - m) ** 2) + kappa(m)


def liapunov(mu: Legendre, m: float, gamma: float) -> float:
    """V of equation (3.41)."""
    return energy(mu, m) + gamma * float(W @ np.cos(theta(mu, S)))


def shapes(count: int = 6, degree: int = 5) -> list[tuple[Legendre, float]]:
    """Random states: curvature a polynomial, natural curvature a number; drives of both signs and of none."""
    random = np.random.default_rng(7)
    states = [
        (Legendre(random.uniform(-1.5, 1.5, degree + 1), domain=[0.0, 1.0]), float(random.uniform(-1.5, 1.5)))
        for _ in range(count)
    ]
    others = [([0.3, 1.0], 0.29), ([3.0], 0.2), ([-3.0], 0.2)]
    return states + [(Legendre(coefficients, domain=[0.0, 1.0]), m) for coefficients, m in others]


def arc(m: float, s: Array) -> tuple[Array, Array]:
    """The natural configuration, equation (2.3), with mu_nat in both components."""
    if m == 0.0:
        return s, 0.0 * s
    return np.sin(m * s) / m, 2.0 * np.sin(0.5 * m * s) ** 2 / m


def swinging(model: str) -> Model:
    """A strut, or a rod with both inertias, on a grid that resolves it, under a force, a couple and a thrust."""
    load, grid = pl.Load(thrust=2.0, transverse=0.6, couple=-0.4), pl.Grid(nodes=32)
    if model == "strut":
        return pl.Strut(material(), load, grid)
    return pl.Rod(material(), load, grid, translational_inertia=0.3, rotary_inertia=0.02, damping=0.2)
