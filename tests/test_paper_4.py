"""Claim: section 4 of the paper, statement by statement: V at rest, the semiflow, the time-one map, its derivative."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
import pytest
from scipy.linalg import expm

import plastica as pl
from plastica.equilibria.linear import linearisation
from plastica.physics.ledger import liapunov
from tests import spelled
from tests.support import EPS

Array = Any
FROZEN = pl.Material("m**2/2", "pos(x)**2", "50")
"""So high a threshold that every equilibrium below lies inside it."""

POINTS = [(0.5, 0.3), (3.0, 1.2), (8.0, -3.0)]
RTOL = 1e-12
GRID = pl.Grid(nodes=18)


def strut(gamma: float = 3.0, nodes: int = 20, material: pl.Material | None = None) -> pl.Strut:
    return pl.Strut(material or spelled.material(), pl.Load(thrust=gamma), pl.Grid(nodes=nodes))


# -- Lemma 4.1: where V stays the rod is in equilibrium -------------------------------------------------------------


def fall(model: pl.Strut, mu: Array, m: float, until: float = 1e-2) -> float:
    """How much V falls in a short time."""
    n = model.grid.size
    sol = pl.solve(model, mu, m, until=until, rtol=RTOL)
    start, end = sol.history.y[0], sol.history.y[-1]
    return float(liapunov(model, 0.0, start[:n], start[n]) - liapunov(model, 0.0, end[:n], end[n]))


def check_where_v_stays() -> None:
    # At equilibria, inside the threshold: neither V nor the state moves.
    model = strut()
    for alpha in (0.0, 0.02, -0.03):
        found = pl.equilibrium(model.material, 3.0, alpha)
        assert found.admissible
        state = found.curvature(model.grid.s)
        sol = pl.solve(model, state, found.mu_nat, until=1.0, rtol=1e-8)
        assert np.abs(sol.history.y[:, :20] - state).max() <= 1000.0 * EPS
        assert np.all(sol.history.y[:, 20] == found.mu_nat)
        assert abs(fall(model, state, found.mu_nat)) <= 64.0 * EPS * abs(found.liapunov)
    # Elsewhere V falls at once, by what the lemma says: both where only mu moves and where only mu_nat does.
    others = [(mu(model.grid.s), m) for mu, m in spelled.shapes()]
    still = pl.equilibrium(model.material, 3.0, 1.2)
    assert not still.admissible
    others.append((still.curvature(model.grid.s), still.mu_nat))
    for mu, m in others:
        mu_t, m_t = model.rate(0.0, mu, m)
        lost = float(model.grid.w @ mu_t**2) + abs(float(model.drive(mu, m)) * float(m_t))
        assert lost > 1e-6
        # To first order in the time; the rest is of its square and of the rates of the rates.
        assert fall(model, mu, m, 1e-4) == pytest.approx(1e-4 * lost, rel=0.05)
    assert np.abs(model.rate(0.0, *others[-1])[0]).max() <= 1e-12


def test_where_v_stays() -> None:
    """Paper Lemma 4.1, 4.5, 4.6: V is constant where the state is an equilibrium, and falls in every other state."""
    check_where_v_stays()


# -- 4.13, and the time-one map ---------------------------------------------------------------------------------------


def flow(model: pl.Strut, mu: Array, m: float, until: float) -> Array:
    return pl.solve(model, mu, m, until=until, rtol=1e-11).history.y[-1, : model.grid.size + 1]


def check_semiflow() -> None:
    model = strut()
    for mu, m in spelled.shapes(3):
        nodal = mu(model.grid.s)
        whole = flow(model, nodal, m, 1.7)
        half = flow(model, nodal, m, 0.6)
        joined = flow(model, half[:-1], float(half[-1]), 1.1)
        assert np.abs(whole - joined).max() <= 1000.0 * 1e-11 * np.abs(whole).max()
        assert np.array_equal(pl.solve(model, nodal, m, until=1.0).history.y[0, :21], np.append(nodal, m))


def test_semiflow() -> None:
    """Paper 4.13: S(0) is the identity and S(t + u) = S(u) S(t)."""
    check_semiflow()


def check_time_one_map() -> None:
    model = strut()
    for mu, m in spelled.shapes(3):
        nodal = mu(model.grid.s)
        found, natural = pl.time_one_map(model, nodal, m)
        exact = flow(model, nodal, m, 1.0)
        assert np.abs(np.append(found, natural) - exact).max() <= 1000.0 * 1e-10 * np.abs(exact).max()
    fixed = pl.equilibrium(model.material, 3.0, 0.02)
    state = fixed.curvature(model.grid.s)
    found, natural = pl.time_one_map(model, state, fixed.mu_nat)
    assert np.abs(found - state).max() <= 1000.0 * EPS
    assert natural == fixed.mu_nat
    moved = pl.equilibrium(model.material, 3.0, 1.2)
    assert pl.time_one_map(model, moved.curvature(model.grid.s), moved.mu_nat)[1] != moved.mu_nat


def test_time_one_map() -> None:
    """Paper 4.23–4.29: Phi = S(1), and its fixed points are the equilibria."""
    check_time_one_map()


# -- 4.30 to 4.33: its derivative -------------------------------------------------------------------------------------


@cache
def derivative(gamma: float, alpha: float) -> Array:
    """D Phi at an equilibrium inside the threshold, by differences of fourth order in every direction."""
    found, step = pl.equilibrium(FROZEN, gamma, alpha), 2e-3
    model = pl.Strut(FROZEN, pl.Load(thrust=gamma), GRID)
    at = np.append(found.curvature(GRID.s), found.mu_nat)

    def phi(state: Array) -> Array:
        mu, m = pl.time_one_map(model, state[:-1], float(state[-1]), rtol=RTOL)
        return np.append(mu, m)

    columns = [
        (8.0 * (phi(at + step * unit) - phi(at - step * unit)) - phi(at + 2 * step * unit) + phi(at - 2 * step * unit))
        / (12.0 * step)
        for unit in np.eye(GRID.size + 1)
    ]
    return np.array(columns).T


def exact(gamma: float, alpha: float) -> Array:
    """e^L by the linearisation on the same grid."""
    return expm(linearisation(pl.equilibrium(FROZEN, gamma, alpha), GRID))


def check_derivative(gamma: float, alpha: float) -> None:
    found = derivative(gamma, alpha)
    wanted = exact(gamma, alpha)
    # The differences are good to rtol over the step, and to step^4 times the fifth derivative of the map.
    assert np.abs(found - wanted).max() <= 1e-9 * np.abs(wanted).max()
    assert found[-1, -1] == pytest.approx(1.0, abs=1e-12)
    assert not np.any(found[-1, :-1])
    values = np.sort(np.linalg.eigvals(found).real)
    expected = np.sort(np.append(np.exp(pl.spectrum(pl.equilibrium(FROZEN, gamma, alpha), 3).eigenvalues), 1.0))
    for value in expected:
        assert np.abs(values - value).min() <= 1e-9 * max(1.0, value)
    assert values[0] > 0.0


@pytest.mark.parametrize(("gamma", "alpha"), POINTS)
def test_derivative_of_the_time_one_map(gamma: float, alpha: float) -> None:
    """Paper 4.30–4.33: D Phi = e^L at an equilibrium, and its spectrum is e^(spectrum of L), with 1 in it."""
    check_derivative(gamma, alpha)
