"""Claim: the three critical thrusts are right, and the capacity chart says from where rods stay nearly straight."""

from __future__ import annotations

import json
import math
from functools import cache
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from scipy.special import ellipk

import plastica as pl
from plastica.errors import ArgumentError
from tests.support import DATA, EPS, materials, pair

BENT = "cos(pi*s/2)"


def rows() -> dict[str, Any]:
    return {row["pair"]: row for row in json.loads((DATA / "thresholds.json").read_text())["rows"]}


def check_reference() -> None:
    for name, row in rows().items():
        found = pl.thresholds(pair(name))
        assert abs(found.gamma_star - float(row["gamma_star"])) <= 1e-14
        assert abs(found.gamma_star_star - float(row["gamma_star_star"])) <= 1e-14
        assert abs(found.alpha_star_star - float(row["a_star_star"])) <= 1e-12
        assert found.euler == math.pi**2 / 4.0


def test_reference_thresholds() -> None:
    check_reference()


def central(material: pl.Material, gamma: float) -> tuple[float, float]:
    return next((lo, hi) for lo, hi in pl.equilibria(material, gamma).intervals if lo <= 0.0 <= hi)


def check_split(material: pl.Material, found: pl.Thresholds) -> None:
    """Just below gamma** the component goes on past alpha**, just above it ends before."""
    gamma, alpha = found.gamma_star_star, found.alpha_star_star
    assert gamma is not None
    assert alpha is not None
    below, above = central(material, gamma * (1.0 - 1e-7)), central(material, gamma * (1.0 + 1e-7))
    assert above[1] < alpha < below[1]
    assert above[1] >= 0.95 * alpha
    # and nowhere before: thrusts between are whole as far as alpha**
    for share in (0.3, 0.8, 0.97):
        low, high = central(material, share * gamma), central(material, (share + 0.02) * gamma)
        sides = [
            next((p.side for p in pl.equilibria(material, g).limiting if p.alpha == hi), 0)
            for g, hi in ((share * gamma, low[1]), ((share + 0.02) * gamma, high[1]))
        ]
        assert sides[0] == sides[1] or min(low[1], high[1]) >= 0.5 * alpha


OTHERS = {
    "hardening": pl.Material("0.1*m**2", "pos(x)**2", "0.1*(1 + m**2)"),
    "stiff": pl.Material("1e4*m**2", "pos(x)**2", "0.1"),
    "soft": pl.Material("1e-4*m**2", "pos(x)**2", "0.1"),
    "flat well": pl.Material("pos(abs(m) - 1)**3", "pos(x)**2", "0.2"),
    "kinks": pl.Material("m**2/2 + pos(abs(m) - 0.3)**3", "pos(x)**2", "0.2*(1 + pos(abs(m) - 0.5)**2)"),
    "small threshold": pl.Material("cosh(m) - 1", "pos(x)**2", "1e-4"),
    "large threshold": pl.Material("m**2/2", "pos(x)**2", "20"),
}


@pytest.mark.parametrize("name", OTHERS)
def test_where_the_component_splits(name: str) -> None:
    check_split(OTHERS[name], pl.thresholds(OTHERS[name]))


@settings(deadline=None, max_examples=4, derandomize=True)
@given(materials())
def test_any_material(material: pl.Material) -> None:
    found = pl.thresholds(material)
    x = math.sqrt(found.gamma_star)
    stiffness = pl.Material.laws(material).preference.second_at(0.0)
    assert abs(math.tan(x) - (1.0 + stiffness) * x) <= 1e-12 * (1.0 + math.tan(x) ** 2)
    assert 0.0 < x < math.pi / 2.0
    if found.gamma_star_star is not None:
        check_split(material, found)


def test_where_there_is_none() -> None:
    # a deep well close by: the component of the straight rod is bounded by its barrier, and joins others only
    deep = pl.Material("1000*m**2*(m**2 - 0.04)**2", "pos(x)**2", "0.02")
    for material in (deep, pl.catalogue.material("never-yields")):
        found = pl.thresholds(material)
        assert found.gamma_star_star is None
        assert found.alpha_star_star is None
        assert "does not exist" in found.sentences[1]
    flat = pl.thresholds(pl.Material("m**4", "pos(x)**2", "0.1"))
    assert flat.gamma_star == 0.0
    assert flat.gamma_star_star is not None
    # kappa'' = c |m|^(-1/2) has no value at 0: whatever moves is pulled back up to Euler's load
    assert pl.thresholds(pl.Material("abs(m)**1.5", "pos(x)**2", "0.1")).gamma_star in (None, math.pi**2 / 4.0)


def test_weak_preferences_lose_no_digits() -> None:
    """For small kappa''(0) = c, gamma* = 3 c (1 - 6 c/5 + ...)."""
    for c in (1e-4, 1e-8, 1e-12):
        star = pl.thresholds(pl.Material("k*m**2/2", "pos(x)**2", "0.1", {"k": c})).gamma_star
        assert abs(star / (3.0 * c) - (1.0 - 1.2 * c)) <= 4.0 * c * c + 16.0 * EPS


@cache
def chart(name: str, imperfection: str) -> Any:
    gammas = {"A": [0.0, 1.5, 1.7, 2.2], "B": [0.1, 0.3, 1.0]}[name]
    return pl.capacity(pair(name), gammas, imperfection)


def stays(name: str, imperfection: str, gamma: float, delta: float) -> bool:
    """One run, judged without the chart: by its state after a billion retardation times."""
    strut = pl.Strut(pair(name), pl.Load(thrust=gamma), pl.Grid(nodes=20))
    start = (delta, delta) if imperfection == "natural" else (f"{float(delta)!r}*({imperfection})", 0.0)
    solution = pl.solve(strut, *start, until=1e9, rtol=1e-10)
    return abs(float(solution.at(0.0, 1e9))) <= central(pair(name), gamma)[1] + 1e-3


def check_edge(name: str, imperfection: str) -> None:
    """Runs from just within the largest imperfection stay, and from just beyond leave."""
    found = chart(name, imperfection)
    bounded = [(g, d) for g, d in zip(found["gamma"].values, found["largest"].values, strict=True) if math.isfinite(d)]
    assert len(bounded) == 2
    for gamma, delta in bounded:
        assert delta > 0.0
        assert stays(name, imperfection, float(gamma), delta * (1.0 - 1e-5))
        assert not stays(name, imperfection, float(gamma), delta * (1.0 + 1e-5))
        for share in (0.1, 0.5, 0.9):
            assert stays(name, imperfection, float(gamma), share * delta)


@pytest.mark.parametrize("name", ["A", "B"])
@pytest.mark.parametrize("imperfection", ["natural", BENT])
def test_the_edge_is_where_runs_part(name: str, imperfection: str) -> None:
    check_edge(name, imperfection)


@pytest.mark.parametrize("name", ["A", "B"])
def test_what_the_chart_says(name: str) -> None:
    for imperfection in ("natural", BENT):
        found = chart(name, imperfection)
        largest, leaves = found["largest"].values, found["leaves"].values
        below = found["gamma"].values < found.attrs["gamma_star_star"]
        assert np.isinf(largest[below]).all()
        assert np.isfinite(largest[~below]).all()
        assert np.all(np.diff(largest[~below]) < 0.0)
        assert np.all(leaves[~below] - largest[~below] <= 1.1e-6 * largest[~below])
        for gamma, edge in zip(found["gamma"].values, found["edge"].values, strict=True):
            assert edge == central(pair(name), float(gamma))[1]
        assert found.attrs["euler"] == math.pi**2 / 4.0
        assert found.attrs["imperfection"] == imperfection
        assert "gamma**" in found.attrs["sentence"]


def check_several_wells() -> None:
    """With several preferred shapes a bow leaves far below gamma**, and the chart says from where."""
    material = pl.Material("m**2*(m**2-1.5**2)**2*0.4", "pos(x)**2", "0.2*(1+m**2)")
    found = pl.capacity(material, [0.687])
    assert found.attrs["gamma_star_star"] == pytest.approx(2.2905, abs=1e-4)
    assert 0.7 < float(found["leaves"].values[0]) < 0.78
    assert found.attrs["leaves_from"] == 0.687
    assert "below gamma**" in found.attrs["sentence"]


def test_bows_that_leave_below_the_gap() -> None:
    check_several_wells()


def check_end() -> None:
    """Above Euler's load the rod buckles within its component while its tip angle phi(1), gamma = K(sin phi(1)/2)^2, is
    at most Theta."""
    end = float(ellipk(math.sin(0.05) ** 2)) ** 2
    found = pl.capacity(pair("A"), [math.pi**2 / 4.0, end * (1.0 - 2e-4), end * (1.0 + 2e-4), 3.0])
    largest = found["largest"].values
    assert np.all(largest[:2] > 1e-5)
    assert largest[1] < largest[0]
    assert np.all(largest[2:] == 0.0)


def test_capacity_ends_where_the_buckled_shape_yields() -> None:
    check_end()


def test_no_run_is_needed_where_the_admissible_set_is_one_interval() -> None:
    found = pl.capacity(pair("A"), 1.0)
    assert int(found["runs"][0]) == 0
    assert np.isnan(found["tried"][0])
    assert np.isinf(pl.capacity(pl.catalogue.material("never-yields"), 5.0)["largest"][0])


def test_shapes_are_taken_as_written() -> None:
    once, twice = (float(pl.capacity(pair("A"), 2.0, shape)["largest"][0]) for shape in (BENT, f"2*{BENT}"))
    assert abs(once / twice - 2.0) <= 1e-5


def check_si() -> None:
    specimen = pl.Specimen(length="0.25 m", bending_stiffness="0.035 N*m**2", retardation_time="120 s")
    material = pl.catalogue.material("one-shape", length=0.25, stiffness=0.035, time=120.0)
    for shape, bare in (("natural", "natural"), ("cos(2*pi*s)", BENT)):
        found, same = pl.capacity(material, [2.0], shape, specimen=specimen), pl.capacity(pair("A"), [2.0], bare)
        assert abs(float(found["largest"][0] / same["largest"][0]) - 1.0) <= 1e-5
        assert float(found["largest_curvature"][0]) == float(found["largest"][0]) * 4.0
        assert found["largest_curvature"].attrs["units"] == "1/m"
        assert abs(float(found["thrust"][0]) - 2.0 * 0.035 / 0.25**2) <= 4.0 * EPS
        assert found["thrust"].attrs["units"] == "N"
    in_si = pl.thresholds(material, specimen=specimen)
    assert abs(float(in_si.to_dataset()["gamma_star_star"]) - 1.6185545137283320 * 0.56) <= 1e-14
    assert "N)" in str(in_si)


def test_in_si() -> None:
    check_si()


def check_basin() -> None:
    """Starts on either side of the largest imperfection end in different intervals, mirror images in mirrored ones."""
    largest = float(chart("A", BENT)["largest"][2])
    strut = pl.Strut(pair("A"), pl.Load(thrust=1.7), pl.Grid(nodes=24))
    amplitude = largest * np.array([-1.001, -0.999, 0.0, 0.999, 1.001])
    done: list[tuple[int, int]] = []
    found = pl.basin(strut, BENT, amplitude, [0.0, 0.5], progress=lambda n, of: done.append((n, of)))
    assert found.interval[:, 0].tolist() == [-1, 0, 0, 0, 1]
    assert found.interval[2:, 1].tolist() == [1, 1, 1]
    assert done == [(i, 10) for i in range(1, 11)]
    mirrored = pl.basin(strut, BENT, -amplitude, [0.0, -0.5])
    assert np.array_equal(mirrored.alpha, -found.alpha)
    exact = pl.equilibria(pair("A"), 1.7)
    for alpha, number in zip(found.alpha.ravel(), found.interval.ravel(), strict=True):
        low, high = exact.intervals[number + 1]
        assert low - 1e-9 <= alpha <= high + 1e-9
    data = found.to_dataset()
    assert data["alpha"].dims == ("amplitude", "natural_curvature")
    assert set(np.unique(data["kind"])) <= {"interior", "limiting"}
    assert bool(data["stable"].all())
    assert "near the straight rod" in str(found)


def test_basins_part_at_the_edge() -> None:
    check_basin()


def test_a_basin_in_si() -> None:
    specimen = pl.Specimen(length="0.25 m", bending_stiffness="0.035 N*m**2", retardation_time="120 s")
    material = pl.catalogue.material("one-shape", length=0.25, stiffness=0.035, time=120.0)
    strut = pl.Strut(material, pl.Load(thrust=1.7 * 0.56), pl.Grid(nodes=24), specimen)
    found = pl.basin(strut, "cos(2*pi*s)", [2.0], [0.4])
    bare = pl.basin(pl.Strut(pair("A"), pl.Load(thrust=1.7), pl.Grid(nodes=24)), BENT, [0.5], [0.1])
    assert np.allclose(found.alpha, bare.alpha, rtol=1e-6)
    assert np.allclose(found.to_dataset()["alpha"], 4.0 * bare.to_dataset()["alpha"], rtol=1e-6)
    assert found.to_dataset()["amplitude"].attrs["units"] == "1/m"


def test_a_material_that_does_not_stay_straight_is_refused() -> None:
    curled = pl.Material("(m - 1)**2", "pos(x)**2", "0.1")
    strut = pl.Strut(curled, pl.Load(thrust=1.0), pl.Grid(nodes=8))
    for ask in (lambda: pl.thresholds(curled), lambda: pl.capacity(curled, 1.0), lambda: pl.basin(strut)):
        with pytest.raises(ArgumentError, match="stay as it is"):
            ask()


@pytest.mark.parametrize(
    ("change", "where"),
    [
        ({"gamma": -1.0}, "gamma"),
        ({"gamma": [1.0, float("nan")]}, "gamma"),
        ({"gamma": []}, "gamma"),
        ({"gamma": [[1.0]]}, "gamma"),
        ({"gamma": "much"}, "gamma"),
        ({"imperfection": "cos(x)"}, "imperfection"),
        ({"imperfection": "0.1 1/m"}, "imperfection"),
        ({"imperfection": "0*s"}, "imperfection"),
        ({"imperfection": "1/s**400"}, "imperfection"),
        ({"imperfection": 0.1}, "imperfection"),
        ({"material": None}, "material"),
        ({"specimen": "short"}, "specimen"),
    ],
)
def test_bad_input(change: dict[str, Any], where: str) -> None:
    with pytest.raises(ArgumentError, match=f"`{where}`"):
        pl.capacity(**{"material": pair("A"), "gamma": 1.0, **change})


@pytest.mark.parametrize(
    ("change", "where"),
    [
        ({"strut": None}, "strut"),
        ({"strut": pl.Strut(pair("A"), pl.Load(thrust=1.0, couple=0.1))}, "load"),
        ({"shape": "t"}, "shape"),
        ({"amplitude": float("inf")}, "amplitude"),
        ({"natural_curvature": []}, "natural_curvature"),
        ({"amplitude": np.zeros(1000), "natural_curvature": np.zeros(1000)}, "amplitude"),
    ],
)
def test_bad_input_of_a_basin(change: dict[str, Any], where: str) -> None:
    strut = pl.Strut(pair("A"), pl.Load(thrust=1.0), pl.Grid(nodes=8))
    with pytest.raises(ArgumentError, match=f"`{where}`"):
        pl.basin(**{"strut": strut, **change})
