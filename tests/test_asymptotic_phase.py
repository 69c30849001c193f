"""Claim 6, in motion: disturbances decay at the gap, and end where the spectral projection says."""

from __future__ import annotations

import numpy as np
import pytest

import plastica as pl
from plastica.equilibria import spectrum as spectra
from plastica.equilibria.elastica import profile
from plastica.equilibria.equilibrium import Equilibrium, frozen_equilibrium
from plastica.equilibria.projection import asymptotic_phase, projection
from tests.support import EPS
from tests.test_spectrum import POINTS, frozen

Array = np.ndarray


def run(equilibrium: Equilibrium, change: Array, natural: float, until: float, grid: pl.Grid) -> pl.Solution:
    """A run from a disturbed equilibrium."""
    assert equilibrium.material is not None
    strut = pl.Strut(equilibrium.material, pl.Load(thrust=equilibrium.gamma), grid)
    start = equilibrium.curvature(grid.s) + change
    return pl.solve(strut, start, equilibrium.mu_nat + natural, until=until, rtol=1e-12, method="DOP853")


def check_decay(gamma: float, alpha: float, window: tuple[float, float]) -> None:
    """A disturbance decays at the gap: the rate fitted over a window of the run agrees to 1e-3."""
    equilibrium, grid = frozen(gamma, alpha), pl.Grid(24)
    found = pl.spectrum(equilibrium)
    sol = run(equilibrium, 1e-3 * found.modes(grid.s)[0], 0.0, window[1], grid)
    times = np.linspace(*window, 12)
    left = sol.history(times)[:, : grid.size] - equilibrium.curvature(grid.s)
    rate = -np.polyfit(times, 0.5 * np.log(left**2 @ grid.w), 1)[0]
    assert abs(rate - found.gap) <= 1e-3 * found.gap


@pytest.mark.parametrize(
    ("gamma", "alpha", "window"),
    [(2.0, 0.0, (2.0, 20.0)), (1.5, 1.0, (2.0, 15.0)), (5.0, 4.0, (2.0, 9.0)), (5.0, 8.0, (8.0, 30.0))],
)
def test_decay_rate(gamma: float, alpha: float, window: tuple[float, float]) -> None:
    check_decay(gamma, alpha, window)


DISTURBANCES = (0.16, 0.08, 0.04, 0.02)


def phase_errors(equilibrium: Equilibrium, until: float, sizes: tuple[float, ...] = DISTURBANCES) -> Array:
    """How far asymptotic_phase misses the clamp curvature at which the run ends, for each size of the disturbance."""
    grid, errors = pl.Grid(24), []
    for size in sizes:
        change = size * (0.3 + np.cos(3.0 * grid.s))
        sol = run(equilibrium, change, size, until, grid)
        start = sol.history([0.0])[0]
        told = asymptotic_phase(equilibrium, start[: grid.size], float(start[grid.size]), grid)
        errors.append(abs(told - float(sol.at(0.0, until))))
    return np.array(errors)


def check_phase(gamma: float, alpha: float, until: float) -> None:
    """Inside the threshold the phase is right to first order: its error is of second order."""
    equilibrium = frozen(gamma, alpha)
    errors = phase_errors(equilibrium, until)
    order = np.polyfit(np.log(DISTURBANCES), np.log(errors), 1)[0]
    assert 1.8 <= order <= 2.2
    assert errors[-1] <= 0.1 * DISTURBANCES[-1]
    grid = pl.Grid(24)
    state = equilibrium.curvature(grid.s)
    found = projection(equilibrium, state, equilibrium.mu_nat + DISTURBANCES[-1], grid)
    assert 0.7 <= errors[-1] / found.second_order <= 1.4


@pytest.mark.parametrize(("gamma", "alpha", "until"), [(1.0, 0.8, 60.0), (1.6, 1.3, 90.0), (5.0, 4.0, 40.0)])
@pytest.mark.paper("Proposition 3.3 (2), 3.74, 3.75")
def test_asymptotic_phase(gamma: float, alpha: float, until: float) -> None:
    check_phase(gamma, alpha, until)


def test_phase_at_the_threshold() -> None:
    """On |D| = Theta a push outward moves the natural curvature to first order, which no linearisation shows."""
    plain = frozen(1.0, -0.8)
    assert plain.drive is not None
    limiting = pl.Material("m**2/2", "100*pos(x)**2", "h", {"h": abs(plain.drive)})
    equilibrium = pl.equilibrium(limiting, 1.0, -0.8)
    sizes = np.array([0.08, 0.04, 0.02])
    inward, outward = (phase_errors(equilibrium, 3000.0, tuple(sign * sizes)) for sign in (1.0, -1.0))
    orders = [np.polyfit(np.log(sizes), np.log(errors), 1)[0] for errors in (inward, outward)]
    assert 1.8 <= orders[0] <= 2.2
    assert 0.9 <= orders[1] <= 1.1
    assert inward[-1] <= 0.01 * sizes[-1]
    assert outward[-1] >= sizes[-1]


def check_projection(gamma: float, alpha: float) -> None:
    """P is the projection that commutes with L: onto the kernel, along {xi_nat = 0}; twice is once."""
    equilibrium, grid = frozen_equilibrium(gamma, alpha), pl.Grid(64)
    L = spectra.linearisation(equilibrium, grid)
    state = equilibrium.curvature(grid.s)

    def apply(vector: Array) -> Array:
        found = projection(equilibrium, state + vector[:-1], equilibrium.mu_nat + vector[-1], grid)
        assert np.abs(found.along + found.rest - vector[:-1]).max() <= 64.0 * EPS * max(1.0, abs(alpha))
        slope = float(profile(gamma, alpha, 1.0).theta0_slope)
        return np.append(found.along, found.shift * slope)

    vector = np.append(np.cos(2.0 * grid.s) - grid.s, 0.3)
    once = apply(vector)
    slack = 1e-12 * max(1.0, gamma) * np.abs(once).max()
    assert np.abs(apply(once) - once).max() <= slack
    assert np.abs(L @ once).max() <= 100.0 * slack
    assert np.abs(apply(L @ vector)).max() <= 100.0 * slack
    kernel_ = pl.spectrum(equilibrium).kernel
    kept = apply(np.append(kernel_(grid.s), kernel_.natural))
    assert np.abs(kept[:-1] - kernel_(grid.s)).max() <= slack
    assert abs(kept[-1] - kernel_.natural) <= slack


@pytest.mark.parametrize(("gamma", "alpha"), POINTS)
@pytest.mark.paper("3.81, 3.82")
def test_projection(gamma: float, alpha: float) -> None:
    check_projection(gamma, alpha)
