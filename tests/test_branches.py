"""Claim: all equilibria of one natural curvature are found, and their branches in the thrust, through their folds."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import plastica as pl
from plastica.equilibria.catalog import equilibria_at
from plastica.equilibria.elastica import ends
from plastica.equilibria.frozen import frozen_alphas
from plastica.errors import ArgumentError
from tests.support import EPS, pair
from tests.test_catalog import SCAN, limiting_reference


def check_counts(gamma: float, natural: float, count: int) -> None:
    shapes = equilibria_at(gamma=gamma, natural_curvature=natural)
    assert len(shapes) == count
    assert [shape.alpha for shape in shapes] == sorted(shape.alpha for shape in shapes)
    for shape in shapes:
        size = abs(natural) + abs(shape.alpha * shape.theta0_end[1]) + gamma + 1e-3
        assert abs(shape.mu_nat - natural) <= 64.0 * EPS * size
        assert shape.drive is None
    farthest = math.hypot(natural, 2.0 * math.sqrt(gamma))
    x = np.linspace(-farthest, farthest, SCAN)
    sign = np.sign(ends(gamma, x).mu_nat - natural)
    assert np.count_nonzero(sign[:-1] * sign[1:] < 0.0) <= count


def check_branches(natural: float, low: float, high: float, count: int) -> None:
    """On every column the branches hold exactly the equilibria there; folds are folds, and change stability by one."""
    made = pl.branches(natural, gamma=(low, high), count=count)
    for gamma, exact in zip(
        np.linspace(low, high, count), frozen_alphas(np.linspace(low, high, count), natural), strict=True
    ):
        alpha = np.sort(np.concatenate([branch.alpha[branch.gamma == gamma] for branch in made]))
        assert alpha.size == exact.x.size, gamma
        assert np.all(np.abs(alpha - exact.x) <= [4.0 * root.error + 4.0 * EPS for root in exact.points])
    for branch in made:
        end = ends(branch.gamma, branch.alpha)
        off = np.abs(end.mu_nat - natural) / (1.0 + np.abs(branch.alpha * end.theta0_slope) + branch.gamma)
        assert off.max() <= 64.0 * EPS
        turns = np.flatnonzero(np.diff(np.sign(np.diff(branch.gamma))) != 0.0) + 1
        assert tuple(turns.tolist()) == branch.folds
        for i in branch.folds:
            assert abs(end.theta0_slope[i]) <= 1e-11 * (1.0 + branch.gamma[i] * abs(end.theta0[i]))
        counts = [unstable for *_, unstable in branch.pieces]
        away = 0 if natural == 0.0 and branch.folds else 1
        assert all(abs(a - b) in (away, 1) for a, b in pairwise(counts))
        meets = {*branch.folds, *branch.pitchforks}
        for i, j in pairwise(sorted({0, *meets, branch.gamma.size - 1})):
            slope = np.sign(end.theta0_slope[i + (i in meets) : j + (j not in meets)])
            assert np.unique(slope).size == 1, "a piece goes from one branch to another"
            told = branch.unstable[i : j + 1]
            assert np.unique(told[told >= 0]).size == 1


def check_fold_curve() -> None:
    """The curve from the cusp at Euler's load goes through the folds of the reference."""
    made = pl.fold_curve(gamma=(0.0, 20.0), count=21)
    (first,) = [curve for curve in made if 0.0 in curve.alpha]
    assert len(first.cusps) == 1
    cusp = first.cusps[0]
    assert first.gamma[cusp] == pytest.approx(0.25 * math.pi**2, rel=4.0 * EPS)
    assert (first.alpha[cusp], first.natural_curvature[cusp]) == (0.0, 0.0)
    assert np.all(first.gamma >= first.gamma[cusp])
    for case in limiting_reference()["folds"]:
        gamma = float(case["gamma"])
        if gamma != round(gamma):
            continue
        alpha = np.sort(np.concatenate([curve.alpha[curve.gamma == gamma] for curve in made] or [[]]))
        exact = np.array([float(a) for a in case["a"]])
        assert alpha.size == 2 * sum(1 for a in pl.equilibria(pair("A"), gamma, (0.0, 50.0)).folds)
        for a in exact:
            assert np.abs(alpha - a).min() <= 1e-12
    for curve in made:
        end = ends(curve.gamma, curve.alpha)
        assert np.all(np.abs(end.theta0_slope) <= 1e-9 * (1.0 + curve.gamma * np.abs(end.theta0)))
        assert np.array_equal(curve.natural_curvature, end.mu_nat + 0.0)


@pytest.mark.parametrize(("gamma", "count"), [(2.0, 1), (5.0, 3), (40.0, 5)])
def test_five_three_and_one(gamma: float, count: int) -> None:
    check_counts(gamma, 0.1, count)


@given(st.floats(0.0, 100.0), st.floats(-12.0, 12.0))
@settings(deadline=None, max_examples=15, derandomize=True)
def test_shapes_at_frozen_natural_curvature(gamma: float, natural: float) -> None:
    check_counts(gamma, natural, len(equilibria_at(gamma, natural)))
    kinds = [root.kind for root in frozen_alphas(np.array([gamma]), natural)[0].points]
    assert kinds.count("crossing") % 2 == 1


def test_three_shapes_that_meet_are_one() -> None:
    for change in (-1e-15, 0.0, 1e-15):
        assert [shape.alpha for shape in equilibria_at(0.25 * math.pi**2 * (1.0 + change), 0.0)] == [0.0]


@pytest.mark.parametrize(
    ("natural", "low", "high"), [(0.1, 0.0, 40.0), (0.0, 0.0, 40.0), (-1.0, 0.0, 30.0), (8.0, 5.0, 60.0)]
)
def test_branches_hold_all_equilibria_of_every_column(natural: float, low: float, high: float) -> None:
    check_branches(natural, low, high, 61)


@given(st.floats(0.001, 8.0), st.floats(0.0, 30.0), st.floats(0.5, 30.0))
@settings(deadline=None, max_examples=15, derandomize=True)
def test_random_branches(natural: float, low: float, length: float) -> None:
    check_branches(natural, low, low + length, 24)


def test_tiny_natural_curvatures() -> None:
    """Where an imperfect pitchfork cannot be told from a perfect one, it is one."""
    assert [b.natural_curvature for b in pl.branches(1e-300, gamma=(0.0, 3.0), count=5)] == [0.0, 0.0]
    assert len(pl.branches(0.0, gamma=(0.0, 1.0), count=5)) == 1
    check_branches(1e-9, 0.0, 30.0, 21)


def test_branch_folds() -> None:
    """At the fold of the reference under gamma = 5 its branch turns, and from 0 to 1 unstable directions."""
    case = next(case for case in limiting_reference()["degenerate"] if case["gamma"] == "5")
    folded = [b for b in pl.branches(float(case["nu0"]), gamma=(4.0, 6.0), count=21) if b.folds]
    (branch,) = folded
    (i,) = branch.folds
    assert branch.gamma[i] == pytest.approx(5.0, rel=1e-13)
    assert branch.alpha[i] == pytest.approx(float(case["a_fold"]), rel=1e-9)
    assert sorted(unstable for *_, unstable in branch.pieces) == [0, 1]


def test_the_branch_from_no_thrust() -> None:
    """One branch leads from gamma = 0 to 40 at natural curvature 0.1, without a fold, and meets 1 of 5 solutions."""
    made = pl.branches(0.1, gamma=(0.0, 40.0), count=107)
    (first,) = [branch for branch in made if branch.gamma[0] == 0.0]
    assert (first.gamma.size, first.folds, set(first.unstable.tolist())) == (107, (), {0})
    assert sum(int(np.count_nonzero(branch.gamma == 40.0)) for branch in made) == 5


def test_pitchforks() -> None:
    """At natural curvature 0 the straight rod meets buckled ones under gamma = ((k + 1/2) pi)^2."""
    straight, *buckled = pl.branches(0.0, gamma=(0.0, 40.0), count=41)
    assert [unstable for *_, unstable in straight.pieces] == [0, 1, 2]
    for k, branch in enumerate(buckled):
        (i,) = branch.folds
        assert branch.pitchforks == (i,)
        assert (branch.gamma[i], branch.alpha[i]) == (pytest.approx(((k + 0.5) * math.pi) ** 2, rel=4.0 * EPS), 0.0)
        assert [unstable for *_, unstable in branch.pieces] == [k, k]
        assert branch.alpha == pytest.approx(-branch.alpha[::-1], abs=1e-12)


def test_fold_curve() -> None:
    check_fold_curve()
    assert pl.fold_curve(gamma=(0.0, 2.4)) == ()


BAD = [
    lambda: equilibria_at(-1.0, 0.1),
    lambda: equilibria_at(1.0, math.nan),
    lambda: equilibria_at(2e5, 0.1),
    lambda: pl.branches(math.inf),
    lambda: pl.branches(0.1, gamma=(4.0, 4.0)),
    lambda: pl.branches(0.1, gamma=(-1.0, 4.0)),
    lambda: pl.branches(0.1, gamma=(0.0, 4.0), count=1),
    lambda: pl.branches(0.1, gamma=(0.0, 4.0), count=2.5),
    lambda: pl.fold_curve(gamma=(0.0, math.nan)),
]


@pytest.mark.parametrize("wrong", BAD)
def test_bad_input(wrong: Any) -> None:
    with pytest.raises(ArgumentError, match="must"):
        wrong()


def test_branches_introduce_themselves() -> None:
    branch = pl.branches(0.1, gamma=(2.0, 4.0), count=5)[-1]
    assert "folds: gamma = 2.92" in str(branch)
    assert branch.to_dataset()["fold"].values.sum() == 1
    curve = pl.fold_curve(gamma=(2.0, 4.0), count=5)[0]
    assert "cusps" in str(curve)
    assert curve.to_dataset()["cusp"].values.sum() == 1
