"""Claim: closed forms of the elastica are right to 50 eps times their condition, in every regime."""

from __future__ import annotations

import json
import math
from functools import cache
from itertools import pairwise
from typing import Any

import mpmath as mp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import plastica as pl
from plastica.equilibria import elastica
from plastica.errors import ArgumentError
from tests.exact_elastica import NAMES, exact, exact_at, sensitivity
from tests.support import DATA, EPS, pair

EVEN = {"theta0", "theta0_slope", "x"}
DISTANCES = (0.0, 1e-3, -1e-3, 1e-6, -1e-6, 1e-10, -1e-10, 1e-14, -1e-14)

SEPARATRIX = [(g, 2.0 * math.sqrt(g) * (1.0 + d)) for g in (1e-5, 0.25, 7.0, 60.0, 484.0) for d in DISTANCES]
"""Relative distances from alpha = 2 sqrt(gamma); where gamma is a square, 0 is on it."""

POINTS = [
    *((g, a) for g in (500.0, 60.0, 9.87, 2.4674) for a in (1e-9, 0.3, 3.0, 12.0, 31.4, 50.0)),
    *((g, a) for g in (0.99, 0.1, 1e-3, 1e-12, 0.0) for a in (1e-6, 0.1, 1.0, 3.9, 4.1, 17.0, 50.0)),
    (1.0, 4.0),
    (3.4, 6.7459),
    (4.0, 8.0),
    (3.37438, 6.74589),
    (250.0, 31.7),
    (0.011543212797974595, 0.21487868947826694),
    (3.0, 1e-200),
    (0.0, 5e-324),
]
"""Large and small, and on both sides of every change of formula."""


@cache
def cases() -> list[dict[str, Any]]:
    """The 82 reference equilibria (the file says how they were made)."""
    return json.loads((DATA / "equilibria.json").read_text())["cases"]


def case_name(case: dict[str, Any]) -> str:
    return f"{case['regime']}-gamma{float(case['gamma']):g}-alpha{float(case['alpha']):.17g}"


def computed(gamma: float, alpha: float, s: float = 1.0) -> dict[str, float]:
    """Every quantity by the package."""
    values = dict(zip(NAMES, elastica.profile(gamma, alpha, s), strict=False))
    if s == 1.0:
        values["arm"] = elastica.ends(gamma, alpha).arm
    return {name: float(value) for name, value in values.items()}


def check_accuracy(gamma: float, alpha: float, s: float = 1.0, bound: float = 50.0) -> None:
    """Errors are at most `bound` eps times the condition in (gamma, alpha), or times one where that is less."""
    truth = exact(gamma, alpha, s)
    for name, value in computed(gamma, alpha, s).items():
        error, size = float(abs(value - truth[name])), float(abs(truth[name]))
        if error > bound * EPS * size:
            size = max(size, sensitivity(gamma, alpha, s)[name])
        assert error <= bound * EPS * size + 5e-324, f"{name} at gamma {gamma}, alpha {alpha}, s {s}: {error:.2e}"


def check_near_separatrix(gamma: float, alpha: float, s: float = 1.0) -> None:
    """No digits but those of sqrt(gamma) s are lost there, however large the condition: m1 has all of its own."""
    truth = exact(gamma, alpha, s)
    value = {name: float(number) for name, number in truth.items()}
    slopes = {
        "phi": value["slope"],
        "slope": gamma * math.sin(value["phi"]),
        "theta0": value["theta0_slope"],
        "theta0_slope": gamma * math.cos(value["phi"]) * value["theta0"],
        "x": 1.0,
        "y": math.sin(value["phi"]),
    }
    got = computed(gamma, alpha, s)
    for name, slope in slopes.items():
        error = float(abs(got[name] - truth[name]))
        assert error <= 20.0 * EPS * (abs(value[name]) + s * abs(slope)), f"{name} at {gamma}, {alpha}: {error:.2e}"


def check_reference(case: dict[str, Any]) -> None:
    """The profile, the arm, and drive and V of both materials, to 1e-12 beyond what rounding of the inputs costs."""
    gamma, alpha = float(case["gamma"]), float(case["alpha"])
    end = sensitivity(gamma, alpha)
    for s, *numbers in case["profile"]:
        got = computed(gamma, alpha, float(s))
        for name, text in zip(NAMES, numbers, strict=False):
            error, bound = abs(got[name] - float(text)), 1e-12 * abs(float(text))
            if error > bound:
                bound += EPS * sensitivity(gamma, alpha, float(s))[name]
            assert error <= bound, (name, s)
    arm = float(case["arm"])
    assert abs(computed(gamma, alpha)["arm"] - arm) <= 1e-12 * abs(arm) + EPS * end["arm"]
    for name in "AB":
        found = pl.equilibrium(pair(name), gamma, alpha)
        bend = abs(float(found.laws.preference.second(np.array(found.mu_nat))))  # type: ignore[union-attr]
        drive, energy = float(case[f"drive_{name}"]), float(case[f"V_{name}"])
        assert found.drive is not None
        cost = end["arm"] + bend * end["slope"]
        force = abs(arm) + abs(drive - arm)
        assert abs(found.drive - drive) <= 1e-12 * max(abs(drive), 1e-3 * force) + EPS * cost
        cost = gamma * (end["phi"] + end["x"] + 1.0) + abs(found.mu_nat) * end["arm"] + (force + 1.0) * end["slope"]
        assert abs(found.liapunov - energy) <= 1e-12 * abs(energy) + EPS * cost


def check_odd(gamma: np.ndarray, alpha: np.ndarray, s: np.ndarray) -> None:
    """The mirror image of an equilibrium is one, to the last bit."""
    for left, right in (
        (elastica.profile(gamma, alpha, s), elastica.profile(gamma, -alpha, s)),
        (elastica.ends(gamma, alpha), elastica.ends(gamma, -alpha)),
    ):
        for name, one, other in zip(left._fields, left, right, strict=True):
            assert np.array_equal(one, other if name in EVEN else -other), name


def test_the_exact_formulas_agree_with_the_reference() -> None:
    """Two independent computations, to the digits of the file."""
    for case in cases():
        for s, *numbers in case["profile"][1::2]:
            truth = exact_at(case["gamma"], case["alpha"], s)
            with mp.workdps(40):
                for name, text in zip(NAMES, numbers, strict=False):
                    number = mp.mpf(text)
                    assert abs(truth[name] - number) <= mp.mpf("1e-29") * max(abs(number), mp.mpf("1e-12")), name


@pytest.mark.parametrize("case", cases(), ids=case_name)
@pytest.mark.paper("3.55")
def test_reference(case: dict[str, Any]) -> None:
    check_reference(case)
    check_accuracy(float(case["gamma"]), float(case["alpha"]))


@pytest.mark.parametrize(("gamma", "alpha"), POINTS)
def test_accuracy(gamma: float, alpha: float) -> None:
    check_accuracy(gamma, alpha)


@pytest.mark.parametrize(("gamma", "alpha"), SEPARATRIX)
def test_accuracy_across_the_separatrix(gamma: float, alpha: float) -> None:
    check_accuracy(gamma, alpha)
    check_near_separatrix(gamma, alpha)
    check_near_separatrix(gamma, alpha, 0.375)


@given(
    st.floats(-12.0, math.log10(500.0)),
    st.one_of(st.floats(0.0, 50.0), st.floats(-6.0, 1.0).map(lambda e: 10.0**e)),
    st.sampled_from([1.0, 1.0, 0.25]),
)
@settings(deadline=None, max_examples=60, derandomize=True)
def test_accuracy_anywhere(power: float, alpha: float, s: float) -> None:
    check_accuracy(10.0**power, alpha, s)


def test_odd_to_the_bit() -> None:
    rng = np.random.default_rng(5)
    gamma = np.concatenate([rng.uniform(0.0, 500.0, 300), np.zeros(20), 10.0 ** rng.uniform(-12.0, 0.0, 80)])
    check_odd(gamma, rng.uniform(-50.0, 50.0, 400), rng.uniform(0.0, 1.0, 400))
    check_odd(np.array([p[0] for p in SEPARATRIX]), np.array([p[1] for p in SEPARATRIX]), np.array(1.0))


@pytest.mark.parametrize("gamma", [0.0, 1e-12, 2.4674011002723395, 500.0])
def test_the_straight_rod(gamma: float) -> None:
    """Odd quantities are zero to the bit, and theta_0 = sin(w s) / w."""
    s = np.linspace(0.0, 1.0, 11)
    w = math.sqrt(gamma)
    found = elastica.profile(gamma, 0.0, s)
    assert not np.any([found.phi, found.slope, found.y])
    assert np.array_equal(found.x, s)
    assert np.abs(found.theta0 - s * np.sinc(w * s / np.pi)).max() <= 4.0 * EPS
    assert np.abs(found.theta0_slope - np.cos(w * s)).max() <= 4.0 * EPS * (1.0 + w)
    assert elastica.ends(gamma, 0.0).arm == 0.0


def test_without_thrust_rods_are_arcs() -> None:
    alpha, s = np.linspace(-50.0, 50.0, 101)[:, None], np.linspace(0.0, 1.0, 7)
    found = elastica.profile(0.0, alpha, s)
    assert np.abs(found.phi - alpha * s).max() <= 50.0 * EPS
    assert np.array_equal(found.slope, np.broadcast_to(alpha, (101, 7)))
    assert np.abs(found.theta0 - s).max() <= 2.0 * EPS
    assert np.abs(found.x - s * np.sinc(alpha * s / np.pi)).max() <= 8.0 * EPS
    assert not np.any(elastica.ends(0.0, alpha).arm)


@pytest.mark.parametrize("gamma", [5e-324, 1e-300, 1e-150])
def test_thrust_next_to_none(gamma: float) -> None:
    """Arcs to the last digit, and what is proportional to the thrust keeps its own digits."""
    for alpha in (1.0, 20.0):
        found, arc = elastica.ends(gamma, alpha), elastica.ends(0.0, alpha)
        assert all(np.array_equal(one, other) for one, other in zip(found[:6], arc[:6], strict=True))
        arm = gamma * (math.sin(alpha) / alpha - math.cos(alpha)) / alpha
        assert abs(float(found.arm) - arm) <= 50.0 * EPS * gamma + 5e-324
    found = elastica.ends(gamma, 1e-170)
    assert abs(float(found.phi) - 1e-170) <= 4.0 * EPS * 1e-170
    assert (float(found.mu_nat), float(found.x), float(found.theta0)) == (1e-170, 1.0, 1.0)


def test_classical_post_buckling() -> None:
    """The elastic cantilever strut whose tip has turned by 20 and by 176 degrees: ten digits of the elastica."""
    for degrees, load, x, y in (
        (20.0, 1.0153968655, 0.9697309074, 0.2194130424),
        (176.0, 9.1162182978, -0.5772111094, 0.4214422961),
    ):
        gamma = load * math.pi**2 / 4.0
        clamp = 2.0 * math.sqrt(gamma) * math.sin(math.radians(degrees) / 2.0)
        found = elastica.ends(gamma, clamp)
        assert abs(float(found.phi) - math.radians(degrees)) <= 1e-7
        assert abs(float(found.mu_nat)) <= 1e-7
        assert abs(float(found.x) - x) <= 2e-9
        assert abs(float(found.y) - y) <= 2e-9


def test_arrays_broadcast_and_agree_with_single_points() -> None:
    """More points than one block, of all regimes: the block that a point is in costs no more than rounding."""
    rng = np.random.default_rng(3)
    gamma, alpha, s = rng.uniform(0.0, 60.0, (70, 1, 1)), rng.uniform(-15.0, 15.0, 40), np.array([[0.5], [1.0]])
    found = elastica.profile(gamma, alpha, s)
    assert all(each.shape == (70, 2, 40) for each in found)
    at_end = elastica.ends(gamma[:, :, 0], alpha)
    assert all(each.shape == (70, 40) for each in at_end)
    for i, j in ((0, 0), (31, 7), (69, 39)):
        g, a = float(gamma[i, 0, 0]), float(alpha[j])
        single, cost = computed(g, a), sensitivity(g, a)
        for name, values in zip(NAMES, found, strict=False):
            assert abs(values[i, 1, j] - single[name]) <= 50.0 * EPS * max(abs(single[name]), cost[name])
        assert abs(at_end.arm[i, j] - single["arm"]) <= 50.0 * EPS * max(abs(single["arm"]), cost["arm"])
    assert elastica.ends(np.zeros(0), 1.0).phi.shape == (0,)
    assert elastica.ends(3.0, 1.0).phi.shape == ()


def test_mistakes_in_arrays() -> None:
    with pytest.raises(ArgumentError, match="`gamma` must not be negative"):
        elastica.ends([1.0, -1e-300], 0.0)
    with pytest.raises(ArgumentError, match="`alpha` must be a number, or an array of numbers"):
        elastica.ends(1.0, ["a", "b"])  # type: ignore[list-item]
    for s in (-1e-9, 1.0 + 1e-9, math.nan):
        with pytest.raises(ArgumentError, match="`s` must lie on the rod"):
            elastica.profile(1.0, 1.0, [0.5, s])
    with pytest.raises(ArgumentError, match="`gamma`, `alpha` and `s` must broadcast"):
        elastica.profile(np.ones(2), np.ones(3), 1.0)


def test_nothing_jumps_where_formulas_change() -> None:
    """Along lines through every change of formula, neighbours differ as their distance says."""
    for gamma in (0.5, 1.0, 9.0):
        alpha = np.sort(
            np.concatenate([c * (1.0 + 1e-12 * np.arange(-3, 4)) for c in (4.0, 2.0 * gamma**0.5, 4.0 * gamma**0.5)])
        )
        found = elastica.ends(gamma, alpha)
        for name, values in zip(found._fields, found, strict=True):
            for (i, j), (a, b) in zip(pairwise(values), pairwise(alpha), strict=True):
                if b - a < 1e-10:
                    assert abs(j - i) <= 1e3 * (b - a) + 200.0 * EPS * (1.0 + abs(i)), (name, a)
