"""Claim 9: the a-priori bound is never exceeded, and two motions part at most like exp(C t) with the printed C."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import plastica as pl
from plastica.physics.bounds import bounds_of_energy
from tests.support import label, reference, shapes, solution_of, struts

T = np.linspace(0.0, 3.0, 31)


def norms(sol: pl.Solution, states: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    n = sol.grid.size
    return np.sqrt(states[:, :n] ** 2 @ sol.grid.w), np.abs(states[:, n])


def check_bounds(sol: pl.Solution) -> None:
    bound, n = sol.bounds, sol.grid.size
    slack = 1.0 + 20.0 * sol.rtol
    mu, natural = norms(sol, sol.history.y)
    bending = np.sqrt((sol.history.y[:, :n] - sol.history.y[:, n : n + 1]) ** 2 @ sol.grid.w)
    drive = np.abs(sol.model.drive(sol.history.y[:, :n], sol.history.y[:, n]))
    assert (mu + natural).max() <= bound.norm * slack
    assert natural.max() <= bound.natural_curvature * slack
    assert bending.max() <= bound.bending * slack
    assert drive.max() <= bound.drive * slack


def check_growth(strut: pl.Strut, shape: str, natural: float, change: float) -> None:
    one = pl.solve(strut, shape, natural, until=float(T[-1]), rtol=1e-10)
    other = pl.solve(strut, f"{shape} + {change}*cos(2*s)", natural - change, until=float(T[-1]), rtol=1e-10)
    energy = max(one.bounds.energy, other.bounds.energy)
    growth = bounds_of_energy(one.model, energy, float(T[-1])).growth
    mu, mu_nat = norms(one, one.history(T) - other.history(T))
    distance = np.hypot(mu, mu_nat)
    noise = 1e-7 * np.exp(np.minimum(growth, 3.0) * T)
    assert np.all(distance <= distance[0] * np.exp(np.minimum(growth * T, 700.0)) * (1.0 + 1e-7) + noise)


@pytest.mark.parametrize("case", reference(), ids=label)
@pytest.mark.paper("3.49–3.51")
def test_bounds_of_reference_motions(case: dict[str, object]) -> None:
    check_bounds(solution_of(case))


@given(struts(), shapes(), st.floats(-1.0, 1.0))
@settings(deadline=None, max_examples=40, derandomize=True)
@pytest.mark.paper("Theorem 3.1, 3.37–3.40")
def test_bounds_of_any_motion(strut: pl.Strut, shape: str, natural: float) -> None:
    check_bounds(pl.solve(strut, shape, natural, until=15.0))


@given(struts(varying=True), shapes())
@settings(deadline=None, max_examples=25, derandomize=True)
def test_bounds_under_varying_thrust(strut: pl.Strut, shape: str) -> None:
    check_bounds(pl.solve(strut, shape, 0.0, until=6.0))


@given(struts(), shapes(), st.floats(-0.5, 0.5), st.sampled_from([1e-3, 0.1, 1.0]))
@settings(deadline=None, max_examples=30, derandomize=True)
@pytest.mark.paper("Theorem 3.1, 3.37–3.40")
def test_growth_of_any_pair(strut: pl.Strut, shape: str, natural: float, change: float) -> None:
    check_growth(strut, shape, natural, change)


def test_the_growth_is_not_slack_by_an_order() -> None:
    """At a large thrust the straight rod's fastest mode grows at 4 gamma/pi^2 - 1; the bound is near it."""
    gamma = 30.0
    soft = pl.Material("k*m**2/2", "c*pos(x)**2", "h", {"k": 1.0, "c": 1e-3, "h": 5.0})
    strut = pl.Strut(soft, pl.Load(thrust=gamma), pl.Grid(nodes=16))
    sol = pl.solve(strut, "0.0001*cos(pi*s/2)", 0.0, until=0.5)
    exact = 4.0 * gamma / np.pi**2 - 1.0
    size, _ = norms(sol, sol.history([0.0, 0.5]))
    assert abs(np.log(size[1] / size[0]) / 0.5 - exact) <= 1e-3 * exact
    assert exact <= sol.bounds.growth <= 1.2 * exact


def test_an_end_couple_has_no_bound_and_the_solution_says_so() -> None:
    strut = pl.Strut(pl.Material("k*m**2/2", "c*pos(x)**2", "h", {"k": 1.0, "c": 1.0, "h": 0.1}), pl.Load(couple=0.5))
    sol = pl.solve(strut, 0.0, 0.0, until=1.0)
    assert sol.bounds.norm == np.inf
    assert "no a-priori bound" in str(sol)
