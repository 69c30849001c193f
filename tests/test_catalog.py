"""Claim: all equilibria of a material are found: the admissible set with its limiting points and folds."""

from __future__ import annotations

import json
import math
from functools import cache
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import plastica as pl
from plastica.equilibria.catalog import equilibria
from plastica.equilibria.elastica import drive, ends
from plastica.equilibria.equilibrium_set import EquilibriumSet
from plastica.equilibria.reach import fold_reach, reach
from plastica.errors import ArgumentError
from tests.support import DATA, EPS, materials, pair

SCAN = 20_000
GAMMA_STAR_STAR = 1.6185545137283320390770833933989515
"""Of pair A: where a gap opens at a double root of D = Theta."""


@cache
def limiting_reference() -> dict[str, Any]:
    """All limiting equilibria and folds with |alpha| <= 20, complete in ball arithmetic, to some 38 digits."""
    return json.loads((DATA / "limiting_equilibria.json").read_text())


def cases() -> list[dict[str, Any]]:
    return limiting_reference()["cases"]


def scale(found: EquilibriumSet, alpha: np.ndarray) -> np.ndarray:
    """Magnitude of the terms of D -+ Theta, and of what rounding of alpha and gamma makes of them."""
    end, laws, gamma = ends(found.gamma, alpha), found.laws, found.gamma
    steep = 1.0 + np.abs(laws.preference.second(end.mu_nat)) + np.abs(laws.threshold.slope(end.mu_nat))
    off = np.abs(alpha) * (np.abs(end.theta0) + steep * np.abs(end.theta0_slope)) + steep * gamma
    return np.abs(end.phi) + np.abs(drive(end, laws)) + laws.threshold.value(end.mu_nat) + off


def excess(found: EquilibriumSet, alpha: np.ndarray) -> np.ndarray:
    """|D| - Theta."""
    end, laws = ends(found.gamma, alpha), found.laws
    return np.asarray(np.abs(drive(end, laws)) - laws.threshold.value(end.mu_nat))


def check_reference(case: dict[str, Any]) -> None:
    found = equilibria(pair(case["pair"]), float(case["gamma"]), alpha=(-20.0, 20.0))
    assert found.complete
    assert len(found.limiting) == case["n_roots_total"]
    right = [point for point in found.limiting if point.alpha > 0.0]
    left = [point for point in reversed(found.limiting) if point.alpha < 0.0]
    assert len(right) == len(case["roots"])
    for point, mirrored, exact in zip(right, left, case["roots"], strict=True):
        alpha, side = float(exact["a"]), 1 if "+" in exact["side"] else -1
        assert abs(point.alpha - alpha) <= max(8.0 * EPS * abs(alpha), 1e-13)
        assert abs(point.alpha - alpha) <= point.error
        assert abs(point.mu_nat - float(exact["nu0"])) <= 1e-12
        assert (point.side, point.kind) == (side, "crossing")
        assert abs(point.rate - float(exact["rate_r"])) <= 1e-10 * max(1.0, abs(point.rate))
        assert point.attracting == exact["attracting_along_branch"]
        assert (mirrored.alpha, mirrored.side) == (-point.alpha, -point.side)
        assert (mirrored.attracting, mirrored.mu_nat) == (point.attracting, -point.mu_nat)


def check_folds(case: dict[str, Any]) -> None:
    gamma = float(case["gamma"])
    found = equilibria(pair("A"), gamma, alpha=(-20.0, 20.0)).folds
    right = [fold for fold in found if fold.alpha > 0.0]
    assert [fold.alpha for fold in found if fold.alpha < 0.0] == [-fold.alpha for fold in reversed(right)]
    assert len(right) == len(case["a"])
    for fold, alpha, mu_nat in zip(right, case["a"], case["nu0"], strict=True):
        assert abs(fold.alpha - float(alpha)) <= 1e-13 * gamma
        assert abs(fold.mu_nat - float(mu_nat)) <= 1e-12
    assert any(fold.alpha == 0.0 for fold in found) == ("a=0" in case["note"])


def check_scan(found: EquilibriumSet) -> None:
    """Every limiting point is one, and the intervals are what 20 000 points say."""
    assert found.complete, found.sentence
    at = np.array([point.alpha for point in found.limiting])
    if at.size:
        assert np.all(np.abs(excess(found, at)) <= 64.0 * EPS * scale(found, at))
        assert np.all(np.diff(at) > 0.0)
    x = np.linspace(*found.range, SCAN)
    over, near = excess(found, x), np.zeros(SCAN, dtype=bool)
    for point in found.limiting:
        near |= np.abs(x - point.alpha) <= 2.0 * point.error
    inside = np.zeros(SCAN, dtype=bool)
    for low, high in found.intervals:
        inside |= (low <= x) & (x <= high)
    wrong = (inside != (over <= 0.0)) & ~near & (np.abs(over) > 64.0 * EPS * scale(found, x))
    assert not wrong.any(), x[wrong]
    for i in np.flatnonzero(np.sign(over[:-1]) * np.sign(over[1:]) < 0.0):
        assert np.any((at >= x[i] - 1e-12) & (at <= x[i + 1] + 1e-12)), (x[i], x[i + 1])


def check_tangency(change: float, limiting: int, tangencies: int, intervals: int) -> None:
    """The number of limiting equilibria of pair A at gamma** (1 + change)."""
    found = equilibria(pair("A"), GAMMA_STAR_STAR * (1.0 + change))
    assert len(found.limiting) == limiting
    assert len(found.tangencies) == tangencies
    assert len(found.intervals) == intervals
    assert ("tangencies" in found.sentence) == (tangencies > 0)
    if tangencies:
        assert abs(found.tangencies[1].alpha - 0.92191638707416166736586919413058030) <= found.tangencies[1].error
        assert found.isolated == ()


@pytest.mark.parametrize("case", cases(), ids=lambda case: f"{case['pair']}-{float(case['gamma']):.4g}")
def test_limiting_equilibria_of_the_reference(case: dict[str, Any]) -> None:
    check_reference(case)


@pytest.mark.parametrize("case", limiting_reference()["folds"], ids=lambda case: f"{float(case['gamma']):.4g}")
def test_folds_of_the_reference(case: dict[str, Any]) -> None:
    check_folds(case)


def test_folds_of_the_degenerate_cases() -> None:
    for case in limiting_reference()["degenerate"]:
        found = equilibria(pair("A"), float(case["gamma"])).folds
        fold = min(found, key=lambda fold: abs(fold.alpha - float(case["a_fold"])))
        assert abs(fold.alpha - float(case["a_fold"])) <= 1e-12
        assert abs(fold.mu_nat - float(case["nu0"])) <= 1e-11
        assert abs(fold.drive - float(case["Dhat_quadratic_k1"])) <= 1e-11


@st.composite
def kinked(draw: st.DrawFn) -> pl.Material:
    """Admissible materials that are not analytic: powers of |m| that are not whole, and kinks off 0."""
    preference = draw(st.sampled_from(["k*abs(m)**2.5", "k*(m**2/2 + pos(abs(m) - 1)**3)", "k*(m**2/2 + abs(m)**3)"]))
    threshold = draw(st.sampled_from(["h", "h*(1 + abs(m)**1.5)", "h*(1 + pos(m**2 - 2)**2/(1 + m**4))"]))
    parameters = {"k": draw(st.floats(0.2, 3.0)), "h": draw(st.floats(0.02, 1.0))}
    return pl.Material(preference, "pos(x)**2", threshold, parameters)


@given(materials(), st.floats(0.0, 60.0))
@settings(deadline=None, max_examples=25, derandomize=True)
def test_every_sign_change_is_accounted_for(material: pl.Material, gamma: float) -> None:
    check_scan(equilibria(material, gamma))


@given(kinked(), st.floats(0.0, 30.0))
@settings(deadline=None, max_examples=12, derandomize=True)
def test_materials_with_kinks(material: pl.Material, gamma: float) -> None:
    check_scan(equilibria(material, gamma))


@pytest.mark.parametrize(
    ("change", "limiting", "tangencies", "intervals"),
    [(-1e-3, 2, 0, 1), (-1e-13, 2, 0, 1), (0.0, 4, 2, 1), (1e-13, 6, 0, 3), (1e-3, 6, 0, 3)],
)
def test_tangencies(change: float, limiting: int, tangencies: int, intervals: int) -> None:
    check_tangency(change, limiting, tangencies, intervals)


def test_isolated_equilibria() -> None:
    """Without thrust D = -kappa'; here kappa' has a minimum as high as the threshold at m = 1."""
    preference = "m**6/6 - m**4/2 + m**2/2 + h*(3*m**2/4 - m**4/8)"
    found = equilibria(pl.Material(preference, "pos(x)**2", "h", {"h": 0.5}), 0.0)
    assert [round(point.alpha, 6) for point in found.isolated] == [-1.0, 1.0]
    assert all(abs(abs(point.alpha) - 1.0) <= point.error <= 1e-6 for point in found.isolated)
    assert [point.kind for point in found.isolated] == ["tangency"] * 2
    assert len(found.intervals) == 1
    assert found.intervals[0][1] < 0.5
    assert found.contains(found.isolated[0].alpha)


def test_without_thrust() -> None:
    found = equilibria(pair("A"), 0.0)
    assert [point.alpha for point in found.limiting] == pytest.approx([-0.1, 0.1], rel=4.0 * EPS)
    assert [point.rate for point in found.limiting] == pytest.approx([1.0, 1.0], rel=4.0 * EPS)
    assert (found.folds, found.bounded) == ((), True)


def test_unbounded_sets_are_said_to_be_so() -> None:
    material = pl.Material("k*m**2/2", "pos(x)**2", "h*(1 + m**2)", {"k": 1.0, "h": 0.1})
    found = equilibria(material, 3.0)
    assert (found.bounded, found.complete) == (False, True)
    assert found.intervals[-1][1] == math.inf == -found.intervals[0][0]
    assert "unbounded" in found.sentence
    inside = equilibria(material, 3.0, alpha=(-5.0, 50.0))
    assert inside.intervals[-1][1] == 50.0
    assert [p.alpha for p in inside.limiting] == pytest.approx([p.alpha for p in found.limiting[1:]], abs=1e-12)


def test_laws_that_do_not_tell_how_far() -> None:
    material = pl.Material("cosh(m) - 1", "pos(x)**2", "cosh(m)")
    found = equilibria(material, 1.0)
    assert (found.bounded, found.complete) == (None, False)
    assert "Give `alpha` a range" in found.sentence
    assert equilibria(material, 1.0, alpha=(-8.0, 8.0)).complete


def test_laws_that_are_not_even() -> None:
    found = equilibria(pl.Material("m**2/2 + m**3/20 + m**4/40", "pos(x)**2", "h*(1 + m/20)", {"h": 0.2}), 4.0)
    assert found.range[0] == -found.range[1]
    check_scan(found)
    right = [point.alpha for point in found.limiting if point.alpha > 0.0]
    left = [-point.alpha for point in found.limiting if point.alpha < 0.0][::-1]
    assert right != pytest.approx(left, rel=1e-6)


@given(st.floats(0.0, 300.0), st.floats(-60.0, 60.0))
@settings(deadline=None, max_examples=100, derandomize=True)
def test_the_bounds_of_the_range(gamma: float, alpha: float) -> None:
    """What `reach` uses: the first integral, the lever of the thrust, and where there can be folds."""
    end = ends(gamma, alpha)
    m = abs(float(end.mu_nat))
    assert alpha**2 <= (m**2 + 4.0 * gamma) * (1.0 + 1e-9)
    wide = m >= 2.0 * math.sqrt(gamma)
    lever = m - math.sqrt(max(m * m - 4.0 * gamma, 0.0)) if wide else math.inf
    assert abs(float(end.arm)) <= min(0.5 * gamma, lever) * (1.0 + 1e-9) + 1e-12
    if abs(alpha) > fold_reach(gamma):
        assert float(end.theta0_slope) > 0.0
    known = reach(gamma, pair("B").laws())
    if abs(alpha) > known.alpha:
        assert float(np.abs(drive(end, pair("B").laws()))) > float(pair("B").laws().threshold.value(end.mu_nat))


BAD = [
    lambda: equilibria(pair("A"), -1.0),
    lambda: equilibria(pair("A"), math.nan),
    lambda: equilibria(pair("A"), "3"),
    lambda: equilibria("A", 3.0),
    lambda: equilibria(pair("A"), 3.0, alpha=(1.0, 1.0)),
    lambda: equilibria(pair("A"), 3.0, alpha=(2.0, -2.0)),
    lambda: equilibria(pair("A"), 3.0, alpha=(0.0, math.inf)),
    lambda: equilibria(pair("A"), 3.0, alpha=5.0),
    lambda: equilibria(pl.catalogue.material("viscoplastic strip", length="1 m"), 3.0),
]


@pytest.mark.parametrize("wrong", BAD)
def test_bad_input(wrong: Any) -> None:
    with pytest.raises(ArgumentError, match="must"):
        wrong()


def test_results_introduce_themselves() -> None:
    found = equilibria(pair("A"), 3.0)
    assert "alpha in [-3.55531, -3.44325], [-0.112342, 0.112342], [3.44325, 3.55531]" in str(found)
    assert "1 unstable" in str(found)
    data = found.to_dataset()
    assert data["limiting_alpha"].values.tolist() == [point.alpha for point in found.limiting]
    assert (data.sizes["interval"], data.sizes["fold"], data.attrs["complete"]) == (3, 2, 1)
    assert np.abs(data["drive"]).values.max() > 0.1


def test_a_specimen_is_told_in_si() -> None:
    specimen = pl.Specimen(length="0.5 m", bending_stiffness="2 N*m**2", retardation_time="10 s")
    parameters = {"k": "2 N*m**2", "c": "1 1/(N**2*m**5*s)", "h": "0.2 N*m**2"}
    material = pl.Material("k*m**2/2", "c*pos(x)**2", "h", parameters)
    found, bare = equilibria(material, 3.0, specimen=specimen), equilibria(pair("A"), 3.0)
    assert [p.alpha for p in found.limiting] == pytest.approx([p.alpha for p in bare.limiting], rel=1e-13)
    data = found.to_dataset()
    assert data["limiting_alpha"].attrs["units"] == "1/m"
    assert data["limiting_alpha"].values == pytest.approx([2.0 * p.alpha for p in bare.limiting], rel=1e-13)
    with pytest.raises(ArgumentError, match="plain numbers"):
        equilibria(material, 3.0)
