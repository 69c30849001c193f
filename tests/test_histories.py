"""Claim: the area under a history of loading is work, whatever the rod and its loads; and it can be read anywhere."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

import plastica as pl
from plastica.errors import ArgumentError
from plastica.motion.histories import CONJUGATE

from .pictured import material
from .support import EPS
from .swinging import finer, loads, run

FACTORS = (2, 8)


def loaded(solution: pl.Solution, times: np.ndarray) -> tuple[float, float]:
    """Area under all loads over their displacements, and the work of the ledger."""
    found = pl.force_displacement(solution, times)
    pairs = [(load, way) for load, way in CONJUGATE.items() if load in found]
    return sum(float(np.trapezoid(found[a], found[b])) for a, b in pairs), solution.ledger.work


def bent(solution: pl.Solution, times: np.ndarray) -> tuple[float, float]:
    """Area under couple over curvature, summed along the rod, and the work that did not go into motion."""
    grid, length = solution.grid, solution.model.scales.length
    found = pl.moment_curvature(solution, grid.s * length, times)
    areas = np.trapezoid(found["couple"].values, found["curvature"].values, axis=0)
    ledger = solution.ledger
    return float(areas @ grid.w) * length, ledger.work - ledger.kinetic_energy


def check_area(name: str, measure: Callable[[pl.Solution, np.ndarray], tuple[float, float]]) -> None:
    """The area comes to the work at second order in the distance of the times, and ends near the tolerance."""
    solution = run(name)
    errors = []
    for factor in FACTORS:
        area, work = measure(solution, finer(solution, factor))
        errors.append(abs(area - work) / solution.ledger.largest_energy)
    assert errors[0] <= 1e-3
    order = np.log(errors[0] / errors[1]) / np.log(FACTORS[1] / FACTORS[0])
    assert order >= 1.7 or errors[1] <= 100.0 * solution.rtol
    assert errors[1] <= 3e-5


@pytest.mark.parametrize("name", ["strut", "rod", "let go", "pieces"])
def test_loads_over_displacements_enclose_their_work(name: str) -> None:
    check_area(name, loaded)


@pytest.mark.parametrize("name", ["strut", "rod", "let go", "pieces"])
def test_couple_over_curvature_encloses_the_same_along_the_rod(name: str) -> None:
    check_area(name, bent)


def check_rows(name: str) -> None:
    """Where no times are asked for, straight lines between the rows enclose the work to the tolerance."""
    solution = run(name)
    grid, length, ledger = solution.grid, solution.model.scales.length, solution.ledger
    found = pl.force_displacement(solution)
    area = sum(float(np.trapezoid(found[load], found[way])) for load, way in CONJUGATE.items() if load in found)
    few = 20.0 * solution.rtol * ledger.largest_energy
    assert abs(area - ledger.work) <= few
    moments = pl.moment_curvature(solution, grid.s * length)
    areas = np.trapezoid(moments["couple"].values, moments["curvature"].values, axis=0)
    assert abs(float(areas @ grid.w) * length - (ledger.work - ledger.kinetic_energy)) <= few
    for table in (found, moments):
        assert np.isin(solution.dataset["t"].values, table["t"].values).all()
        assert table["t"].size <= 100_000


@pytest.mark.parametrize("name", ["strut", "rod", "let go", "pieces"])
def test_the_rows_by_themselves_enclose_the_work(name: str) -> None:
    check_rows(name)


def test_times_of_the_run_are_the_rows() -> None:
    solution = pl.solve(pl.Strut(material(), loads(), pl.Grid(nodes=6)), 0.2, until=3.0, times=[0.0, 1.0, 3.0])
    assert pl.force_displacement(solution)["t"].values.tolist() == [0.0, 1.0, 3.0]


def check_ends(name: str) -> None:
    """The contact couple is m1 at the free end and that of the balance of moments at the clamp, at all times."""
    solution = run(name)
    data = solution.dataset
    found = pl.moment_curvature(solution, [0.0, solution.model.scales.length], data["t"].values)
    ends = found["couple"].values[np.append(np.diff(found["t"].values) > 0.0, True)]
    size = float(np.abs(data["couple"].values).max())
    assert np.abs(ends[:, 1] - data["end_couple"].values).max() <= 1e-12 * size
    clamp = data.get("clamp_couple")
    balance = data["end_couple"].values + data["shear"].values @ data["s_weight"].values / solution.model.scales.length
    # Accelerations lose some digits of what the shortest waves of the grid carry.
    expected, error = (balance, 1e-12) if clamp is None else (clamp.values, 1e-8)
    assert np.abs(ends[:, 0] - expected).max() <= error * size


@pytest.mark.parametrize("name", ["strut", "pieces", "let go", "rod"])
def test_couple_at_both_ends(name: str) -> None:
    check_ends(name)


def check_nodes(name: str) -> None:
    """At the nodes curvature, natural curvature and couple are those of the dataset."""
    solution = run(name)
    data = solution.dataset
    found = pl.moment_curvature(solution, data["s"].values)
    after = np.append(np.diff(found["t"].values) > 0.0, True) & np.isin(found["t"].values, data["t"].values)
    assert np.array_equal(found["t"].values[after], data["t"].values)
    for variable in ("curvature", "couple"):
        size = float(np.abs(data[variable].values).max())
        assert np.abs(found[variable].values[after] - data[variable].values).max() <= 1e-12 * size
    owner = solution.model.division.owner
    natural = data["natural_curvature"].values.reshape(data["t"].size, -1)[:, owner]
    assert np.array_equal(found["natural_curvature"].values[after], natural)
    assert np.array_equal(
        found["bending"].values, found["curvature"].values - found["natural_curvature"].values
    )


@pytest.mark.parametrize("name", ["strut", "rod", "pieces"])
def test_at_the_nodes_it_is_the_dataset(name: str) -> None:
    check_nodes(name)


def check_jump() -> None:
    """At a jump there are two rows: displacements and curvature stay, load and (without inertia) couple jump."""
    for name in ("strut", "rod"):
        solution = run(name)
        forces, moments = pl.force_displacement(solution), pl.moment_curvature(solution, 0.0)
        for found in (forces, moments):
            (rows,) = np.nonzero(np.diff(found["t"].values) == 0.0)
            assert found["t"].values[rows].tolist() == [4.0]
        row = int(np.flatnonzero(np.diff(forces["t"].values) == 0.0)[0])
        assert forces["transverse"].values[row : row + 2].tolist() == [0.5, 0.0]
        for variable in ("shortening", "deflection", "rotation", "sinking", "thrust"):
            assert np.ptp(forces[variable].values[row : row + 2]) == 0.0
        row = int(np.flatnonzero(np.diff(moments["t"].values) == 0.0)[0])
        jump = np.diff(moments["couple"].values[row : row + 2, 0])[0]
        cos = np.cos(solution.model.angle(solution.model.layout.mu(solution.history([4.0]))))[0]
        # Without inertia the couple at the clamp loses tau int cos theta at once.
        expected = 0.0 if solution.model.has_inertia else -0.5 * float(cos @ solution.grid.w)
        assert abs(jump - expected) <= 1e-9


def test_jumps_have_two_rows() -> None:
    check_jump()


def check_units() -> None:
    """In SI the tables are the dimensionless ones by their scales, and the tip is that of the dataset."""
    solution = run("let go")
    scales, data = solution.model.scales, solution.dataset
    found = pl.force_displacement(solution, data["t"].values)
    after = np.append(np.diff(found["t"].values) > 0.0, True)
    near = 64.0 * EPS * scales.length
    assert np.abs(found["shortening"].values[after] - (scales.length - data["tip_x"].values)).max() <= near
    assert np.abs(found["deflection"].values[after] - data["tip_y"].values).max() <= near
    assert np.abs(found["rotation"].values[after] - data["tip_angle"].values).max() <= 64.0 * EPS
    assert np.abs(found["transverse"].values[after] - data["transverse"].values).max() <= 64.0 * EPS
    assert {name: found[name].attrs["units"] for name in found} == {
        "transverse": "N",
        "shortening": "m",
        "deflection": "m",
        "rotation": "rad",
        "work": "J",
    }
    assert pl.moment_curvature(solution, 0.1)["couple"].attrs["units"] == "N*m"


def test_units() -> None:
    check_units()


def test_the_weight_works_on_the_mean_way_along_it() -> None:
    """For a rod that is bent to an arc by hand: the mean of (s - x) cos + y sin over the rod."""
    model = pl.Strut(material(50.0), pl.Load(weight=1e-9, weight_angle=0.7), pl.Grid(nodes=12))
    solution = pl.solve(model, 0.9, 0.9, until=1e-6)
    s = np.linspace(0.0, 1.0, 20001)
    x, y = np.sin(0.9 * s) / 0.9, (1.0 - np.cos(0.9 * s)) / 0.9
    expected = np.trapezoid((s - x) * np.cos(0.7) + y * np.sin(0.7), s)
    found = pl.force_displacement(solution)
    assert abs(float(found["sinking"][0]) - expected) <= 1e-8
    assert float(found["total_weight"][0]) == 1e-9


def test_only_the_loads_that_act_have_a_column() -> None:
    assert set(pl.force_displacement(run("pulled"))) == {"thrust", "shortening", "deflection", "rotation", "work"}
    assert set(pl.force_displacement(run("still"))) == {"shortening", "deflection", "rotation", "work"}


def test_times_that_are_asked_for_are_the_rows() -> None:
    asked = [1.0, 2.5, 7.0]
    assert pl.force_displacement(run("strut"), asked)["t"].values.tolist() == asked
    assert pl.moment_curvature(run("strut"), 0.0, asked)["t"].values.tolist() == asked
    assert pl.moment_curvature(run("strut"), 0.0, 4.0)["t"].values.tolist() == [4.0, 4.0]


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda: pl.moment_curvature(run("strut"), 1.1), "`s` must lie in"),
        (lambda: pl.moment_curvature(run("strut"), "clamp"), "`s` must be a number"),
        (lambda: pl.moment_curvature(run("strut"), [[0.0]]), "`s` must be a number, or several in a row"),
        (lambda: pl.moment_curvature(run("strut"), 0.0, [2.0, 1.0]), "`times` must increase"),
        (lambda: pl.force_displacement(run("strut"), [1.0, 9.0]), "`times` must increase within"),
        (lambda: pl.force_displacement(run("strut"), ["a"]), "`times` must be a number"),
        (lambda: pl.force_displacement(3.0), "`solution` must be a Solution"),
    ],
)
def test_what_cannot_be_told_is_refused(call: Callable[[], object], words: str) -> None:
    with pytest.raises(ArgumentError, match=words):
        call()


def check_elastic_loop_is_empty() -> None:
    """A rod that does not yield, loaded slowly and unloaded, encloses little; one that yields encloses what is lost."""
    losses = []
    for threshold in (50.0, 0.02):
        couple = pl.programs.cycles(-1.0, 1.0, 400.0, start=0.0)
        model = pl.Strut(material(threshold), pl.Load(couple=couple), pl.Grid(nodes=6))
        solution = pl.solve(model, until=1200.0, rtol=1e-7)
        times = np.linspace(800.0, 1200.0, 8001)
        found = pl.moment_curvature(solution, 0.5, times)
        area = float(np.trapezoid(found["couple"].values[:, 0], found["curvature"].values[:, 0]))
        spent = solution.dataset["entropy_production"]
        lost = float(spent[-1]) - float(np.interp(800.0, solution.dataset["t"], spent))
        # The rod is bent alike along its whole length, and the last cycle is closed but for what is still creeping.
        assert abs(area - lost) <= 1e-3 * lost
        losses.append(area)
    # Without yielding viscosity alone: delta mu_t^2 over a cycle, less what the corners of the triangle round off.
    viscous = (2.0 / 200.0) ** 2 * 400.0
    assert 0.98 * viscous <= losses[0] <= viscous
    assert losses[1] >= 10.0 * viscous


def test_a_loop_encloses_what_was_lost() -> None:
    check_elastic_loop_is_empty()


def test_every_load_at_once_is_among_the_runs() -> None:
    assert {name for name, _ in loads().sources()} == {"thrust", "transverse", "couple", "weight"}
