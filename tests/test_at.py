"""Claim: the curvature anywhere and at any time is in the units of the user, and takes bounded memory."""

from __future__ import annotations

import tracemalloc

import numpy as np
import pytest

import plastica as pl
from plastica.errors import ArgumentError
from plastica.motion import history, solution
from tests.support import pair

EPS = float(np.finfo(float).eps)


@pytest.fixture(scope="module")
def sol() -> pl.Solution:
    return pl.solve(pl.Strut(pair("A", 2.0), pl.Load(thrust=3.0), pl.Grid(8)), "1 + cos(3*s)", until=5.0, rtol=1e-6)


@pytest.fixture(scope="module")
def bench() -> pl.Solution:
    """The same kind of rod in SI: 0.5 m, 1 N m**2, 20 s."""
    units = {"k": "1 N*m**2", "c": "1 1/(N**2*m**5*s)", "h": "0.1 N*m**2"}
    material = pl.Material("k*m**2/2", "c*pos(x)**2", "h", units)
    specimen = pl.Specimen(length=0.5, bending_stiffness=1.0, retardation_time=20.0)
    return pl.solve(pl.Strut(material, pl.Load(thrust=1.0), pl.Grid(6), specimen), 0.1, until=100.0, rtol=1e-4)


def test_the_range_is_told_in_the_units_of_the_user(sol: pl.Solution, bench: pl.Solution) -> None:
    with pytest.raises(ArgumentError, match=r"`s` must lie in \[0, 0\.5\] m, on the rod, but is 0\.75"):
        bench.at([0.1, 0.75], 1.0)
    with pytest.raises(
        ArgumentError, match=r"`t` must lie in \[0, 100\] s, where the motion was computed, but is 100\.5"
    ):
        bench.at(0.1, 100.5)
    with pytest.raises(ArgumentError, match=r"`s` must lie in \[0, 1\], in units of its length, but is -0\.5"):
        sol.at(-0.5, 1.0)
    with pytest.raises(ArgumentError, match=r"`t` must lie in \[0, 5\], where the motion was computed, but is nan"):
        sol.at(0.5, np.nan)
    assert np.isfinite(bench.at(0.5, 100.0))


def test_blocks_change_nothing(sol: pl.Solution, monkeypatch: pytest.MonkeyPatch) -> None:
    rng = np.random.default_rng(7)
    s, t = rng.random((4, 1, 6)), 5.0 * rng.random((4, 5, 1))
    paired_s, paired_t = rng.random(50), 5.0 * rng.random(50)
    whole, paired = sol.at(s, t), sol.at(paired_s, paired_t)
    one_by_one = [sol.at(float(a), float(b)) for a, b in zip(paired_s, paired_t, strict=True)]
    monkeypatch.setattr(solution, "BLOCK", 48)
    monkeypatch.setattr(history, "BLOCK", 3)
    slack = 64.0 * EPS * float(np.abs(whole).max())
    assert np.abs(np.asarray(sol.at(s, t)) - whole).max() <= slack
    assert np.abs(np.asarray(sol.at(paired_s, paired_t)) - paired).max() <= slack
    assert np.abs(np.asarray(paired) - one_by_one).max() <= slack
    assert np.shape(sol.at([], 1.0)) == (0,)
    assert np.shape(sol.at(np.zeros((3, 0)), 1.0)) == (3, 0)


def check_memory(sol: pl.Solution) -> None:
    """Beyond the values and their places in the table (5 numbers each) no more than a block."""
    times = np.linspace(0.0, 5.0, 400_000)
    tracemalloc.start()
    try:
        sol.at(0.5, times)
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert peak <= 60e6 + 5 * times.nbytes, f"{peak / 1e6:.0f} MB"


def test_memory_is_bounded(sol: pl.Solution) -> None:
    check_memory(sol)


def test_pairs_make_no_table(sol: pl.Solution) -> None:
    """Three thousand places at as many times of their own are three thousand values, not nine million."""
    s, t = np.linspace(0.0, 1.0, 3000), np.linspace(0.0, 5.0, 3000)
    tracemalloc.start()
    try:
        values = np.asarray(sol.at(s, t))
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert peak <= 60e6, f"{peak / 1e6:.0f} MB"
    assert abs(values[1500] - sol.at(s[1500], t[1500])) <= 64.0 * EPS * np.abs(values).max()


def test_what_is_too_much_is_refused_before_it_is_begun(sol: pl.Solution, monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(ArgumentError, match="must give at most 20000000 values"):
        sol.at(np.zeros((30_000, 1)), np.zeros(1000))
    monkeypatch.setattr(solution, "LARGEST_WORK", 799)
    with pytest.raises(ArgumentError, match="must be at most 799 times by nodes, but is 800"):
        sol.at(0.5, np.linspace(0.0, 1.0, 100))
