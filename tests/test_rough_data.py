"""Claim 4: mu = exp(-t) mu_0 + xi, xi Lipschitz in s with constant gamma: rough data stay rough, decaying."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings

import plastica as pl
from tests.support import materials, pair, shapes

T = (0.1, 1.0, 3.0, 10.0)


def check_lipschitz(sol: pl.Solution, initial: np.ndarray, s: np.ndarray, gamma: float) -> None:
    """Judge the interpolated xi at close places: nodal differences of 16 points would prove little."""
    for t in T:
        xi = sol.at(s, t) - np.exp(-t) * initial
        slope = np.abs(np.diff(xi) / np.diff(s)).max()
        noise = 4.0 * sol.rtol * np.abs(xi).max() / np.diff(s).min()
        assert slope <= gamma * (1.0 + 1e-9) + noise


@pytest.mark.parametrize("gamma", [0.5, 3.0, 8.0])
def test_a_step_stays_a_step(gamma: float) -> None:
    check_step(gamma)


def check_step(gamma: float) -> None:
    strut = pl.Strut(pair("A"), pl.Load(thrust=gamma), pl.Grid(nodes=24))
    sol = pl.solve(strut, "2*(1 - step(s - 0.5)) - step(s - 0.5)", 0.0, until=10.0, rtol=1e-10)
    s = np.linspace(0.0, 1.0, 201)
    check_lipschitz(sol, np.where(s < 0.5, 2.0, -1.0), s, gamma)
    before = np.nextafter(0.5, 0.0)
    for t in T:
        jump = sol.at(before, t) - sol.at(0.5, t)
        assert abs(jump - 3.0 * np.exp(-t)) <= 1e-9


@given(materials(), shapes())
@settings(deadline=None, max_examples=25, derandomize=True)
@pytest.mark.paper("Lemma 4.2, 4.7–4.12")
def test_any_material_and_shape(material: pl.Material, shape: str) -> None:
    strut = pl.Strut(material, pl.Load(thrust=4.0), pl.Grid(nodes=20))
    sol = pl.solve(strut, shape, 0.1, until=10.0)
    s = np.linspace(0.0, 1.0, 41)
    check_lipschitz(sol, sol.at(s, 0.0), s, 4.0)


def test_the_constant_is_sharp() -> None:
    """A rod whose tangent is across the thrust reaches the slope gamma: the bound is not slack by a factor."""
    strut = pl.Strut(pair("A"), pl.Load(thrust=8.0), pl.Grid(nodes=24))
    sol = pl.solve(strut, "1.2*cos(2*s) + 0.4", 0.2, until=10.0)
    s = np.linspace(0.0, 1.0, 401)
    xi = sol.at(s, 10.0) - np.exp(-10.0) * (1.2 * np.cos(2.0 * s) + 0.4)
    assert np.abs(np.diff(xi) / np.diff(s)).max() >= 0.99 * 8.0
