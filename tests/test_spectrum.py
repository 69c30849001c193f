"""Claim 6: real spectrum, its values, the eigenvalue 0 and its Jordan block."""

from __future__ import annotations

import json
from functools import cache
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.special import ellipk

import plastica as pl
from plastica.equilibria import spectrum as spectra
from plastica.equilibria.equilibrium import Equilibrium, frozen_equilibrium
from plastica.equilibria.linear import discretise
from plastica.equilibria.oscillation import DEGENERATE, fold_distance
from plastica.equilibria.projection import asymptotic_phase, projection
from plastica.errors import ArgumentError
from plastica.physics.kernel import kernel
from tests.support import DATA, EPS

Array = np.ndarray

POINTS = [(0.5, 1.0), (1.0, -3.0), (3.0, 1.2), (5.0, 4.0), (5.0, 8.0), (20.0, 7.0), (30.0, 8.0), (60.0, -10.0)]
"""Equilibria of every regime, stable and unstable."""


@cache
def reference() -> dict[str, Any]:
    """Eigenvalues of 22 equilibria to 38 digits, and six folds (the file says how they were made)."""
    return json.loads((DATA / "spectrum.json").read_text(encoding="utf-8"))


def cases() -> list[dict[str, Any]]:
    return reference()["cases"]


def at(case: dict[str, Any]) -> Equilibrium:
    return frozen_equilibrium(float(case["gamma"]), float(case["alpha"]))


def folds() -> list[Equilibrium]:
    """The folds of the reference, and straight rods at ((k + 1/2) pi)^2."""
    straight = [frozen_equilibrium(((k + 0.5) * np.pi) ** 2, 0.0) for k in range(3)]
    return [at(each) for each in reference()["folds"]] + straight


def name(case: Any) -> str:
    return f"gamma {float(case['gamma']):g}, alpha {float(case['alpha']):g}"


def frozen(gamma: float, alpha: float, threshold: float = 50.0) -> Equilibrium:
    """An equilibrium well inside the threshold."""
    material = pl.Material("m**2/2", "pos(x)**2", "h", {"h": threshold})
    return pl.equilibrium(material, gamma, alpha)


# -- values --------------------------------------------------------------------------------------------------------


def check_values(case: dict[str, Any]) -> None:
    """Eigenvalues of both ends to 1e-10 and within their own estimate, which is not slack."""
    up, down = (np.array([float(value) for value in case[sign]]) for sign in ("positive", "negative"))
    found = pl.spectrum(at(case), count=up.size, lowest=6)
    assert found.resolved
    assert found.lowest.size == down.size
    for values, errors, exact in (
        (found.eigenvalues, found.errors, up),
        (found.lowest, found.lowest_errors, down),
    ):
        assert np.all(np.abs(values - exact) <= np.minimum(errors, 1e-10))
        assert np.all(errors <= 1e-13 * max(1.0, found.equilibrium.gamma))


def check_multiplicity(case: dict[str, Any]) -> None:
    """0 is simple but where theta_0'(1) = 0, and the number of unstable directions is right."""
    found, fold = pl.spectrum(at(case)), abs(float(case["theta0_slope"])) < 1e-12
    assert found.zero_multiplicity == (2 if fold else 1)
    assert found.agree
    if not fold:
        assert found.unstable == case["unstable"]
        assert found.unstable == int(spectra.unstable_count(found.equilibrium.gamma, found.equilibrium.alpha))


def check_exact_values() -> None:
    """alpha = 0: rho_k = 4 gamma / ((2k + 1)^2 pi^2). gamma = K(1/2)^2, alpha = sqrt(2) K(1/2): rho = 1/3."""
    for gamma in (0.7, 2.0, 17.0, 100.0, 500.0):
        found = pl.spectrum(frozen_equilibrium(gamma, 0.0), count=12)
        rho = 4.0 * gamma / ((2.0 * np.arange(12) + 1.0) ** 2 * np.pi**2)
        assert np.abs(found.eigenvalues + 1.0 - rho).max() <= 32.0 * EPS * max(1.0, gamma)
        assert found.lowest.size == 0
    quarter = float(ellipk(0.5))
    found = pl.spectrum(frozen_equilibrium(quarter**2, np.sqrt(2.0) * quarter))
    assert np.abs(found.eigenvalues + 2.0 / 3.0).min() <= 16.0 * EPS


def check_within_bounds(gamma: float, alpha: float) -> None:
    """The spectrum lies within 4 gamma/pi^2 of -1, descends, and is that of the Schroedinger operator in signs."""
    found = pl.spectrum(frozen_equilibrium(gamma, alpha), count=4, lowest=4)
    lower, upper = found.bounds
    slack = 32.0 * EPS * max(1.0, gamma)
    assert found.eigenvalues[0] <= upper + slack
    assert np.all(found.lowest >= lower - slack)
    assert np.all(found.lowest < -1.0)
    assert np.all(np.diff(found.eigenvalues) <= 0.0)
    assert np.all(np.diff(found.lowest) >= 0.0)
    assert found.agree
    if not found.degenerate:
        levels = spectra.schroedinger(found.equilibrium, count=12)
        assert int(np.count_nonzero(levels.values < 0.0)) == found.unstable
        assert (found.gap > 0.0) == (found.unstable == 0)


@pytest.mark.parametrize("case", cases(), ids=name)
@pytest.mark.paper("Proposition 3.2, 3.63–3.72")
def test_spectrum(case: dict[str, Any]) -> None:
    check_values(case)
    check_multiplicity(case)


def test_exact_values() -> None:
    check_exact_values()


@given(st.floats(0.0, 60.0), st.floats(-20.0, 20.0))
@settings(deadline=None, max_examples=40, derandomize=True)
def test_bounds(gamma: float, alpha: float) -> None:
    check_within_bounds(gamma, alpha)


def test_a_pair_that_doubles_cannot_tell_apart() -> None:
    """gamma = 100, alpha = 15: tunnelling; two of the lowest agree to 3e-15, and the result says so."""
    found = pl.spectrum(frozen_equilibrium(100.0, 15.0), lowest=6)
    assert found.unresolved_lowest == (4,)
    assert abs(found.lowest[5] - found.lowest[4]) <= found.lowest_errors[4] + found.lowest_errors[5]
    assert "they differ" in found.sentence
    assert pl.spectrum(frozen_equilibrium(3.0, 1.0)).unresolved == ()


def test_what_no_grid_resolves_is_said() -> None:
    assert "Not resolved" in str(pl.spectrum(frozen_equilibrium(1e4, 1e5)))


def test_a_rod_without_thrust() -> None:
    found = pl.spectrum(frozen_equilibrium(0.0, 2.0), lowest=2)
    assert np.array_equal(found.eigenvalues, np.full(6, -1.0))
    assert (found.gap, found.unstable, found.zero_multiplicity, found.lowest.size) == (1.0, 0, 1, 0)
    assert abs(found.kernel.natural - np.sqrt(0.5)) <= 4.0 * EPS


# -- unstable directions -------------------------------------------------------------------------------------------


def plane() -> tuple[Array, Array]:
    """Random points of [0.1, 100] x [-30, 30], some straight, some close to the separatrix."""
    draw = np.random.default_rng(20)
    gamma = np.exp(draw.uniform(np.log(0.1), np.log(100.0), 900))
    alpha = draw.uniform(-30.0, 30.0, gamma.size)
    alpha[::9] = 0.0
    near = 10.0 ** draw.uniform(-15.0, -2.0, gamma[1::9].size)
    alpha[1::9] = 2.0 * np.sqrt(gamma[1::9]) * (1.0 + draw.choice([-1.0, 1.0], near.size) * near)
    return gamma, alpha


def check_counts(gamma: Array, alpha: Array) -> None:
    """The oscillation count is the number of eigenvalues of K above 1."""
    counted = spectra.unstable_count(gamma, alpha)
    solved = [
        np.count_nonzero(np.linalg.eigvalsh(discretise(g, a, 64).K) > 1.0) for g, a in zip(gamma, alpha, strict=True)
    ]
    assert np.array_equal(counted, solved)


@pytest.mark.paper("3.69")
def test_the_two_counts_agree() -> None:
    gamma, alpha = plane()
    counted = spectra.unstable_count(gamma, alpha)
    assert set(counted) == {0, 1, 2, 3}
    check_counts(gamma, alpha)
    assert np.array_equal(counted, spectra.unstable_count(gamma, -alpha))


def test_straight_rods_in_closed_form() -> None:
    """At alpha = 0 there are as many as half-integer multiples of pi below gamma^(1/2)."""
    gamma = np.linspace(0.0, 5000.0, 20011)
    assert np.array_equal(spectra.unstable_count(gamma, 0.0), np.floor(np.sqrt(gamma) / np.pi + 0.5))


def check_degenerate_at_folds() -> None:
    """At a fold the answer is "degenerate"; to its sides the numbers differ by one."""
    for fold in folds():
        assert int(spectra.unstable_count(fold.gamma, fold.alpha)) == DEGENERATE
        found = pl.spectrum(fold)
        assert found.zero_multiplicity == 2
        assert found.degenerate
        beside = 1e-6 if fold.alpha else 0.0
        push = 0.0 if fold.alpha else 1e-6
        counts = [spectra.unstable_count(fold.gamma + push * k, fold.alpha + beside * k) for k in (-1, 1)]
        assert abs(int(counts[1]) - int(counts[0])) == 1
        assert found.unstable == min(int(count) for count in counts)
        assert found.gap == (0.0 if found.unstable == 0 else -found.eigenvalues[0])


def test_degenerate_at_folds() -> None:
    check_degenerate_at_folds()


def test_distance_of_a_fold() -> None:
    """Between 0 at a fold and 1 where theta_0(1) = 0."""
    assert float(fold_distance(4.0, 3.0, 0.0)) == 0.0
    assert float(fold_distance(4.0, 0.0, 3.0)) == 1.0
    assert abs(float(fold_distance(4.0, 1e200, 2e200)) - np.sqrt(0.5)) <= 4.0 * EPS


# -- the eigenvalue 0 ----------------------------------------------------------------------------------------------


def check_real_spectrum(gamma: float, alpha: float) -> None:
    """The Jacobian that `solve` uses has the eigenvalues of K - 1, and 0, all real."""
    equilibrium = frozen(gamma, alpha)
    assert equilibrium.material is not None
    grid = pl.Grid(64)
    strut = pl.Strut(equilibrium.material, pl.Load(thrust=gamma), grid)
    state = np.concatenate([equilibrium.curvature(grid.s), [equilibrium.mu_nat], np.zeros(3)])
    jacobian = kernel(strut, 0.0, 1.0).jacobian(0.0, state)[: grid.size + 1, : grid.size + 1]
    found = np.linalg.eigvals(jacobian)
    # The eigenvalues of a matrix that is similar to a symmetric one by W^(1/2), whose condition is below 10.
    slack = 1000.0 * EPS * max(1.0, gamma)
    assert np.abs(found.imag).max() <= np.sqrt(EPS)
    assert np.abs(found).min() <= slack
    spectrum = pl.spectrum(equilibrium, count=3)
    for value in spectrum.eigenvalues:
        assert np.abs(found - value).min() <= slack


def check_kernel(gamma: float, alpha: float) -> None:
    """(theta_0', theta_0'(1)) is in the kernel, of norm one, and tangent to the curve of equilibria."""
    found = pl.spectrum(frozen_equilibrium(gamma, alpha))
    grid = pl.Grid(128)
    vector = np.append(found.kernel(grid.s), found.kernel.natural)
    residual = spectra.linearisation(found.equilibrium, grid) @ vector
    assert np.abs(residual).max() <= 200.0 * EPS * max(1.0, gamma) * np.abs(vector).max()
    assert abs(grid.w @ vector[:-1] ** 2 + vector[-1] ** 2 - 1.0) <= 1e-13
    places, steps, errors = np.linspace(0.0, 1.0, 9), (4e-3, 2e-3, 1e-3), []
    for step in steps:
        ahead, behind = (frozen_equilibrium(gamma, alpha + h).curvature(places) for h in (step, -step))
        chord = (ahead - behind) / (2.0 * step * found.kernel.norm)
        errors.append(np.abs(chord - found.kernel(places)).max())
        assert abs(chord[-1] - found.kernel.natural) <= errors[-1]
    order = np.polyfit(np.log(steps), np.log(errors), 1)[0]
    assert 1.9 <= order <= 2.1
    assert errors[-1] <= 1e-3


def check_jordan_block() -> None:
    """dim ker L, L^2, L^3 are 1, 2, 2 at folds and 1, 1, 1 elsewhere."""
    grid = pl.Grid(64)
    elsewhere = [frozen_equilibrium(gamma, alpha) for gamma, alpha in POINTS]
    for equilibrium, dims in [(fold, [1, 2, 2]) for fold in folds()] + [(each, [1, 1, 1]) for each in elsewhere]:
        power, found = spectra.linearisation(equilibrium, grid), []
        for k in range(1, 4):
            sigma = np.linalg.svd(np.linalg.matrix_power(power, k), compute_uv=False)
            found.append(int(np.count_nonzero(sigma <= 1e-9 * sigma[0])))
        assert found == dims
        assert pl.spectrum(equilibrium).zero_multiplicity == found[-1]


@pytest.mark.parametrize(("gamma", "alpha"), POINTS)
def test_real_spectrum(gamma: float, alpha: float) -> None:
    check_real_spectrum(gamma, alpha)


@pytest.mark.parametrize(("gamma", "alpha"), POINTS)
@pytest.mark.paper("Proposition 3.2, 3.63–3.72", "Proposition 3.3 (1), 3.73, 3.76–3.80")
def test_kernel(gamma: float, alpha: float) -> None:
    check_kernel(gamma, alpha)


@pytest.mark.paper("Proposition 3.2, 3.63–3.72")
def test_jordan_block() -> None:
    check_jordan_block()


@pytest.mark.parametrize("fold", reference()["folds"], ids=name)
@pytest.mark.paper("Theorem 4.4")
def test_folds_of_the_reference(fold: dict[str, Any]) -> None:
    found = pl.spectrum(at(fold))
    assert abs(found.kernel.natural) <= 1e-12
    assert np.abs(found.eigenvalues).min() <= 1e-12
    negative = found.eigenvalues[found.eigenvalues < -1e-9]
    assert abs(negative[0] - float(fold["second"])) <= 1e-12


# -- modes ---------------------------------------------------------------------------------------------------------


def check_modes(gamma: float, alpha: float) -> None:
    """Modes are orthonormal, solve K xi = rho xi at any place, and begin with positive curvature."""
    found = pl.spectrum(frozen_equilibrium(gamma, alpha), count=4, lowest=2)
    grid = pl.Grid(150)
    modes = np.vstack([found.modes(grid.s), found.lowest_modes(grid.s)])
    values = np.append(found.eigenvalues, found.lowest)
    assert np.abs((modes * grid.w) @ modes.T - np.eye(values.size)).max() <= 1e-12
    matrix = spectra.linearisation(found.equilibrium, grid)[:-1, :-1]
    residual = matrix @ modes.T - modes.T * values
    assert np.abs(residual).max() <= 1e-11 * max(1.0, gamma) * np.abs(modes).max()
    assert np.all(found.modes(0.0) > 0.0)
    angles = found.mode_angles(grid.s)
    assert np.abs(angles - found.modes(grid.s) @ grid.A.T).max() <= 1e-12
    assert found.modes([[0.0, 0.5, 1.0]]).shape == (4, 1, 3)


@pytest.mark.parametrize(("gamma", "alpha"), POINTS)
def test_modes(gamma: float, alpha: float) -> None:
    check_modes(gamma, alpha)


def check_lowest_level() -> None:
    """-psi'' - gamma cos(phi) psi has alpha^2/4 as its lowest eigenvalue where gamma = K(k)^2, alpha = 2 k K(k)."""
    for k in (0.01, 0.2, 0.5, 0.7, 0.9, 0.97, 0.99):
        quarter = float(ellipk(k**2))
        levels = spectra.schroedinger(frozen_equilibrium(quarter**2, 2.0 * k * quarter), count=2)
        assert abs(levels.values[0] - (k * quarter) ** 2) <= min(1e-12, float(levels.errors[0]))
        assert levels.errors[0] <= 1e-12
        assert levels.values[1] > 0.0


def test_lowest_level_on_the_first_buckled_branch() -> None:
    check_lowest_level()


def test_levels_of_straight_rods() -> None:
    for gamma in (0.0, 1.0, 30.0):
        levels = spectra.schroedinger(frozen_equilibrium(gamma, 0.0), count=6)
        exact = ((np.arange(6) + 0.5) * np.pi) ** 2 - gamma
        assert np.all(np.abs(levels.values - exact) <= levels.errors)
        assert levels.errors[0] <= 1e-12


# -- results and mistakes ------------------------------------------------------------------------------------------


def test_dataset_and_words() -> None:
    found = pl.spectrum(frozen(3.0, 0.0), count=3, lowest=2)
    data = found.to_dataset()
    assert dict(data.sizes) == {"mode": 3, "lowest_mode": 0, "s": found.discrete.grid.size}
    assert data.attrs["unstable"] == 1
    assert abs(float((data.mode_curvature[0] ** 2 * data.s_weight).sum()) - 1.0) <= 1e-13
    assert str(found).startswith("Spectrum of K - 1 at gamma = 3, alpha = 0\n  +0.2158542")
    assert "Unstable at frozen natural curvature: 1 direction growing at 0.215854" in str(found)
    assert "multiplicity 2" in str(pl.spectrum(folds()[0]))
    assert "decay at 0.392073" in str(pl.spectrum(frozen(1.5, 0.0)))


def test_rates_are_in_si_with_a_specimen() -> None:
    specimen = pl.Specimen(length="0.25 m", bending_stiffness="0.035 N*m**2", retardation_time="120 s")
    material = pl.catalogue.material("one-shape", length="0.25 m", stiffness="0.035 N*m**2", time="120 s")
    found = pl.spectrum(pl.equilibrium(material, 1.5, 0.3, specimen=specimen))
    data = found.to_dataset()
    assert abs(float(data.gap) * 120.0 - found.gap) <= 4.0 * EPS
    assert (data.gap.attrs["units"], data.s.attrs["units"]) == ("1/s", "m")
    assert abs(float(data.s_weight.sum()) - 0.25) <= 4.0 * EPS


@pytest.mark.parametrize(
    ("call", "word"),
    [
        (lambda: pl.spectrum(3.0), "equilibrium"),
        (lambda: pl.spectrum(frozen_equilibrium(1.0, 0.0), 0), "count"),
        (lambda: pl.spectrum(frozen_equilibrium(1.0, 0.0), 2.5), "count"),
        (lambda: pl.spectrum(frozen_equilibrium(1.0, 0.0), True), "count"),
        (lambda: pl.spectrum(frozen_equilibrium(1.0, 0.0), 10**9), "count"),
        (lambda: pl.spectrum(frozen_equilibrium(1.0, 0.0), lowest=-1), "lowest"),
        (lambda: pl.spectrum(frozen_equilibrium(1.0, 0.0)).modes(1.5), "s"),
        (lambda: pl.spectrum(frozen_equilibrium(1.0, 0.0)).modes(float("nan")), "s"),
        (lambda: pl.spectrum(frozen_equilibrium(1.0, 0.0)).kernel("half"), "s"),
        (lambda: spectra.schroedinger(frozen_equilibrium(1.0, 0.0), 0), "count"),
        (lambda: spectra.schroedinger(None), "equilibrium"),
        (lambda: spectra.linearisation(frozen_equilibrium(1.0, 0.0), 16), "grid"),
        (lambda: spectra.unstable_count(-1.0, 0.0), "gamma"),
        (lambda: spectra.unstable_count(float("nan"), 0.0), "gamma"),
        (lambda: spectra.unstable_count(1.0, float("inf")), "alpha"),
        (lambda: spectra.unstable_count(np.ones(2), np.ones(3)), "gamma, alpha"),
        (lambda: spectra.unstable_count("many", 0.0), "gamma, alpha"),
        (lambda: projection(frozen_equilibrium(1.0, 0.0), np.zeros(3), 0.0, pl.Grid(8)), "mu"),
        (lambda: projection(frozen_equilibrium(1.0, 0.0), np.full(8, np.nan), 0.0, pl.Grid(8)), "mu, mu_nat"),
        (lambda: projection(frozen_equilibrium(1.0, 0.0), "straight", 0.0, pl.Grid(8)), "mu, mu_nat"),
        (lambda: projection(frozen_equilibrium(1.0, 0.0), np.zeros(8), 0.0, 8), "grid"),
        (lambda: projection(1.0, np.zeros(8), 0.0, pl.Grid(8)), "equilibrium"),
        (lambda: projection(folds()[0], np.zeros(8), 0.0, pl.Grid(8)), "equilibrium"),
        (lambda: asymptotic_phase(frozen_equilibrium(3.0, 0.0), np.zeros(8), 0.0, pl.Grid(8)), "equilibrium"),
    ],
)
def test_mistakes(call: Any, word: str) -> None:
    with pytest.raises(ArgumentError, match=f"^`{word}` must"):
        call()
