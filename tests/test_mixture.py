"""Claim: the rod written in the volume fraction of its second preferred shape (paper, section 2.2) is the same rod."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import plastica as pl
from plastica.physics.ledger import stored_energy
from plastica.physics.mixture import Mixture
from plastica.physics.model import Model
from plastica.physics.thermodynamics import free_energy
from tests.support import EPS, pair
from tests.test_thermodynamics import NAMES, SEGMENTS, model_of, states

Array = Any


@pytest.mark.parametrize("segments", SEGMENTS)
@pytest.mark.parametrize("name", NAMES)
@pytest.mark.paper("2.12, 2.13")
def test_both_writings_are_the_same_rod(name: str, segments: int) -> None:
    check_mixture(model_of(name, segments))


def check_mixture(model: Model) -> None:
    """Energies, drives, thresholds and rates agree, for alpha in [0, 1] and, as equations, outside."""
    mix = Mixture.of(model)
    mu, natural, _ = states(model, 3, 40)
    alpha = mix.fraction(natural)
    assert (alpha > 1.0).any()
    assert (alpha < 0.0).any()
    assert ((alpha >= 0.0) & (alpha <= 1.0)).any()
    m1 = 1.5
    pairs = {
        "natural curvature": (mix.natural(alpha), natural),
        "energy": (mix.energy(mu, alpha), stored_energy(model, mu, natural)),
        "free energy": (
            mix.strain_energy(mix.strain(mu, alpha)) + model.division.spread(mix.mixing_energy(alpha)),
            free_energy(model, mu, natural),
        ),
        "drive": (mix.drive(mu, alpha), m1 * model.drive(mu, natural)),
        "threshold": (mix.threshold(alpha), m1 * model.threshold(natural)),
        "rate": (mix.rate(mu, alpha), model.natural_rate(mu, natural) / m1),
        "dissipation": (
            mix.drive(mu, alpha) * mix.rate(mu, alpha),
            model.drive(mu, natural) * model.natural_rate(mu, natural),
        ),
    }
    assert np.abs(pairs["rate"][0]).max() > 0.0
    for name, (written, due) in pairs.items():
        assert np.abs(written - due).max() <= 64.0 * EPS * np.abs(due).max(), name


def check_drive_is_conjugate(model: Model) -> None:
    """X = -d(energy)/d(alpha): central differences, one segment at a time."""
    mix = Mixture.of(model)
    mu, natural, _ = states(model, 4)
    alpha, step = np.atleast_2d(mix.fraction(natural).T).T, 1e-5
    drive = np.atleast_2d(mix.drive(mu, mix.fraction(natural)).T).T
    for j, length in enumerate(model.division.lengths):
        ahead, behind = alpha.copy(), alpha.copy()
        ahead[:, j] += step
        behind[:, j] -= step
        both = (ahead, behind) if model.segments > 1 else (ahead[:, 0], behind[:, 0])
        slope = np.subtract(*(mix.energy(mu, each) for each in both)) / (2.0 * step)
        assert np.abs(length * drive[:, j] + slope).max() <= 1e-7 * np.abs(slope).max()


@pytest.mark.parametrize("segments", SEGMENTS)
def test_the_drive_is_conjugate_to_the_fraction(segments: int) -> None:
    check_drive_is_conjugate(model_of("strut", segments))


def check_evolution_of_the_fraction() -> None:
    """The equations in (mu, alpha), advanced by SciPy as they stand, follow the motion that `solve` found."""
    strut = pl.Strut(pair("B"), pl.Load(thrust=3.0), pl.Grid(12))
    t = np.linspace(0.0, 20.0, 21)
    sol = pl.solve(strut, "0.8 + cos(2*s)", 0.3, until=20.0, times=t)
    mix, n = Mixture.of(strut), strut.grid.size

    def rate(_t: float, y: Array) -> Array:
        strain = mix.strain(y[:n], y[n])
        return np.append(strut.couple(_t, y[:n]) - strain, mix.rate(y[:n], y[n]))

    start = np.append(0.8 + np.cos(2.0 * strut.grid.s), mix.fraction(0.3))
    own = solve_ivp(rate, (0.0, 20.0), start, t_eval=t, rtol=1e-10, atol=1e-12)
    found = sol.dataset.volume_fraction.values
    assert found.max() - found.min() > 0.2
    assert np.abs(own.y[n] - found).max() <= 100.0 * sol.rtol
    assert np.array_equal(found, pl.thermodynamics(sol).volume_fraction)


@pytest.mark.paper("2.12, 2.13")
def test_the_law_of_the_fraction_moves_the_same_rod() -> None:
    check_evolution_of_the_fraction()


def test_a_shape_alone_has_no_energy_of_mixing() -> None:
    mix = Mixture.of(model_of("strut", 1))
    assert np.abs(mix.mixing_energy([0.0, 1.0, -1.0])).max() <= 16.0 * EPS
    assert float(mix.mixing_energy(0.5)) > 0.0


def test_a_material_with_one_preferred_shape_has_no_fraction() -> None:
    with pytest.raises(pl.errors.ArgumentError, match="must prefer a second natural curvature"):
        Mixture.of(model_of("strut", 1, pair("A")))
