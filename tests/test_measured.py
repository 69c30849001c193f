"""Claim: a measured shape becomes the curvature that was measured, to its noise, and says what was done to it."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import plastica as pl
from plastica.errors import ArgumentError, FileError
from plastica.study.centreline import centre_line as fit
from plastica.study.measured import measured_shape
from plastica.study.run import run
from plastica.study.smoothing import MOST_POINTS, smooth, thinned
from tests.commandline import scenario, si_scenario, written
from tests.support import EPS

Array = NDArray[np.float64]


def exact(s: Array) -> Array:
    return 1.0 + np.cos(3.0 * s)


def centre_line(s: Array) -> tuple[Array, Array]:
    """Points of the rod of that curvature, by Gauss-Legendre quadrature of the tangent."""
    nodes, weights = np.polynomial.legendre.leggauss(40)
    inner = 0.5 * s[:, None] * (1.0 + nodes)
    theta = inner + np.sin(3.0 * inner) / 3.0
    return 0.5 * s * (np.cos(theta) @ weights), 0.5 * s * (np.sin(theta) @ weights)


def table(folder: Path, first: Array, second: Array, heading: str = "", mark: str = ",") -> Path:
    lines = [mark.join(map(repr, pair)) for pair in zip(first.tolist(), second.tolist(), strict=True)]
    return written(folder, "\n".join([heading] * bool(heading) + lines) + "\n", "shape.csv")


def error(shape: pl.Shape, length: float = 1.0) -> float:
    s = np.linspace(0.0, 1.0, 401)
    return float(np.abs(np.asarray(shape.function(s * length)) * length - exact(s)).max())


def check_order(folder: Path, columns: Any, least: float, most: float, ceiling: float) -> None:
    """Without noise the error falls with the number of points, at the order of the reconstruction."""
    counts, errors = (20, 40, 80), []
    for n in counts:
        s = np.linspace(0.0, 1.0, n)
        first, second = (s, exact(s)) if columns == "s, curvature" else centre_line(s)
        file = table(folder, first, second)
        errors.append(error(measured_shape(file, columns, 1.0, si=False, smoothing=0.0)))
    order = -np.polyfit(np.log(counts), np.log(errors), 1)[0]
    assert least <= order <= most, errors
    assert errors[-1] <= ceiling


def test_order_along_the_rod(tmp_path: Path) -> None:
    # A natural spline has no curvature at its ends, which the exact shape has: second order there.
    check_order(tmp_path, "s, curvature", 1.7, 2.6, 1e-4)


def test_order_from_points(tmp_path: Path) -> None:
    # Angles at the middles of the chords are of second order; at the ends the spline has half a chord to bridge.
    check_order(tmp_path, "x, y", 1.0, 2.6, 5e-3)


def check_noise_is_smoothed(folder: Path, noise: float) -> None:
    """Cross-validation finds the noise: the change is about as large, the error several times smaller."""
    n = 200
    s = np.linspace(0.0, 1.0, n)
    values = exact(s) + noise * np.random.default_rng(7).standard_normal(n)
    fit = smooth(s, values, None)
    assert 0.8 * noise <= fit.change <= 1.2 * noise
    off = float(np.sqrt(np.mean((fit.spline(s) - exact(s)) ** 2)))
    assert off <= 0.35 * noise
    shape = measured_shape(table(folder, s, values), "s, curvature", 1.0, si=False)
    s = np.linspace(0.0, 1.0, 401)
    assert float(np.sqrt(np.mean((np.asarray(shape.function(s)) - exact(s)) ** 2))) <= 0.5 * noise


@pytest.mark.parametrize("noise", [0.01, 0.05, 0.2])
def test_noise_is_smoothed(noise: float, tmp_path: Path) -> None:
    check_noise_is_smoothed(tmp_path, noise)


def scattered(folder: Path, columns: Any, count: int, noise: float, seed: int) -> float:
    """Root mean square error of the curvature from a file of so many points that scatter by `noise`."""
    rng = np.random.default_rng([seed, count])
    s = np.linspace(0.0, 1.0, count)
    first, second = (s, exact(s)) if columns == "s, curvature" else centre_line(s)
    if columns == "x, y":
        first = first + noise * rng.standard_normal(count)
    second = second + noise * rng.standard_normal(count)
    shape = measured_shape(table(folder, first, second), columns, 1.0, si=False)
    s = np.linspace(0.0, 1.0, 401)
    return float(np.sqrt(np.mean((np.asarray(shape.function(s)) - exact(s)) ** 2)))


def check_more_points_never_hurt(folder: Path, columns: Any, noise: float, most: float, *counts: int) -> None:
    """In the mean over seeds the error falls with the number of points, and is small where there are many."""
    errors = [float(np.mean([scattered(folder, columns, n, noise, seed) for seed in range(4)])) for n in counts]
    assert all(b < a for a, b in pairwise(errors)), errors
    assert errors[-1] <= most, errors


@pytest.mark.parametrize(
    ("columns", "noise", "most", "counts"),
    [
        ("s, curvature", 0.05, 6e-3, (30, 100, 300, 1000, 3000)),
        ("x, y", 8e-5, 9e-3, (30, 100, 300, 1000, 3000)),
        ("x, y", 1e-3, 5e-2, (30, 300, 3000)),
    ],
)
def test_more_points_never_hurt(
    columns: Any, noise: float, most: float, counts: tuple[int, ...], tmp_path: Path
) -> None:
    check_more_points_never_hurt(tmp_path, columns, noise, most, *counts)


def check_error_is_stated(folder: Path) -> None:
    """What the words call the scatter and the standard error is about what they are."""
    n, noise = 400, 1e-4
    s, rng = np.linspace(0.0, 1.0, n), np.random.default_rng(5)
    x, y = (values + noise * rng.standard_normal(n) for values in centre_line(s))
    line = fit(x, y)
    assert 0.9 * noise <= line.scatter <= 1.1 * noise
    assert line.length == pytest.approx(1.0, abs=4.0 * noise)
    s = np.linspace(0.0, 1.0, 401)
    off = float(np.sqrt(np.mean((line.curvature(2.0 * s - 1.0) - exact(s)) ** 2)))
    assert 0.3 * line.error <= off <= 3.0 * line.error
    words = measured_shape(table(folder, x, y), "x, y", 1.0, si=False).words
    for said in ("400 rows (x, y)", "roughness weight", "standard error of the curvature", "rms", "scaled by"):
        assert said in words


def test_scatter_and_error_are_stated(tmp_path: Path) -> None:
    check_error_is_stated(tmp_path)


def test_points_without_scatter_give_the_curve_itself() -> None:
    for count, most in ((20, 1e-2), (60, 3e-3), (300, 3e-3), (10_000, 3e-3)):
        x, y = centre_line(np.linspace(0.0, 1.0, count))
        s = np.linspace(0.0, 1.0, 401)
        assert np.abs(fit(x, y).curvature(2.0 * s - 1.0) - exact(s)).max() <= most


def test_a_coil_and_a_straight_rod() -> None:
    """Shapes that turn several times, and not at all; uneven points, in any unit."""
    rng = np.random.default_rng(2)
    s = np.sort(rng.uniform(0.0, 1.0, 400))
    s[0], s[-1] = 0.0, 1.0
    turn = 15.0
    places = np.array([np.sin(turn * s), 1.0 - np.cos(turn * s)]) + 1e-4 * rng.standard_normal((2, 400))
    coil = fit(*(250.0 * places))
    assert coil.length == pytest.approx(250.0 * turn, rel=1e-3)
    assert np.abs(coil.curvature(np.linspace(-1.0, 1.0, 101)) - turn).max() <= 0.1
    straight = fit(s, 0.3 * s + 1e-4 * rng.standard_normal(400))
    assert np.abs(straight.curvature(np.linspace(-1.0, 1.0, 101))).max() <= 2e-2


def test_the_weight_means_what_it_says() -> None:
    """The spline minimises mean square departure + weight * roughness: no small change of it does better."""
    rng = np.random.default_rng(3)
    s = np.sort(rng.uniform(0.0, 1.0, 40))
    s[0], s[-1] = 0.0, 1.0
    y = exact(s) + 0.1 * rng.standard_normal(40)
    nodes, weights = np.polynomial.legendre.leggauss(2000)
    places = 0.5 * (1.0 + nodes)

    def cost(weight: float, values: Array) -> float:
        from scipy.interpolate import make_interp_spline

        spline = make_interp_spline(s, values, k=3, bc_type="natural")
        return float(np.mean((y - values) ** 2) + weight * 0.5 * weights @ spline(places, 2) ** 2)

    for weight in (1e-6, 1e-4):
        best = smooth(s, y, weight).spline(s)
        least = cost(weight, best)
        for _ in range(20):
            assert cost(weight, best + 1e-3 * rng.standard_normal(40)) > least


def test_thinning_keeps_means_and_ends() -> None:
    s = np.linspace(0.0, 1.0, 5000)
    places, values = thinned(s, 2.0 * s + 1.0)
    assert places.size <= MOST_POINTS
    assert (places[0], places[-1]) == (0.0, 1.0)
    assert np.allclose(values, 2.0 * places + 1.0, rtol=100.0 * EPS, atol=0.0)
    assert thinned(places, values)[0] is places


@pytest.mark.parametrize(
    ("heading", "mark", "units"),
    [
        ("s [mm],curvature [1/m]", ",", {}),
        ("s (mm);curvature (1/m)", ";", {}),
        ("arc length [mm]\tcurvature [1/m]", "\t", {}),
        ("s,curvature", ",", {"length_unit": "mm", "curvature_unit": "1/m"}),
        ("", " , ", {"length_unit": "mm", "curvature_unit": "1/m"}),
    ],
)
def test_units_and_separators(heading: str, mark: str, units: dict[str, str], tmp_path: Path) -> None:
    s = np.linspace(0.0, 1.0, 60)
    file = table(tmp_path, 250.0 * s, exact(s) / 0.25, heading, mark)
    shape = measured_shape(file, "s, curvature", 0.25, si=True, smoothing=0.0, **units)
    assert error(shape, 0.25) <= 1e-3


def test_points_in_millimetres_anywhere_in_the_plane(tmp_path: Path) -> None:
    """Neither where the rod lies nor how it is turned matters."""
    x, y = centre_line(np.linspace(0.0, 1.0, 60))
    plain = measured_shape(table(tmp_path, x, y), "x, y", 1.0, si=False, smoothing=1e-9)
    c, sn = np.cos(2.5), np.sin(2.5)
    file = table(tmp_path, 250.0 * (c * x - sn * y) + 70.0, 250.0 * (sn * x + c * y) - 30.0, "x [mm],y [mm]")
    moved = measured_shape(file, "x, y", 0.25, si=True, smoothing=1e-9)
    s = np.linspace(0.0, 1.0, 101)
    difference = np.abs(np.asarray(moved.function(0.25 * s)) * 0.25 - np.asarray(plain.function(s)))
    assert difference.max() <= 1e-8


def test_all_that_was_done_is_stated(tmp_path: Path) -> None:
    s = np.linspace(0.0, 1.0, 60)
    noisy = exact(s) + 0.05 * np.random.default_rng(0).standard_normal(60)
    words = measured_shape(table(tmp_path, 0.99 * s, noisy), "s, curvature", 1.0, si=False).words
    for said in ("shape.csv", "60 rows", "cubic smoothing spline", "roughness weight", "rms", "degree", "1.0101"):
        assert said in words


@pytest.mark.parametrize(
    ("content", "said"),
    [
        ("", "empty"),
        ("\n\n", "empty"),
        ("s,curvature\n", "at least 5 rows"),
        ("0,1\n0.5,1\n1,1\n", "at least 5 rows, "),
        ("0,1\n0.2,\n0.5,1\n0.7,1\n1,1\n", "line 2"),
        ("0,1\n0.2,x\n0.5,1\n0.7,1\n1,1\n", "line 2"),
        ("0,1\n0.2,nan\n0.5,1\n0.7,1\n1,1\n", "finite"),
        ("0,1\n0.2,1e999\n0.5,1\n0.7,1\n1,1\n", "finite"),
        ("0,1,2\n" * 6, "two numbers"),
        ("0,1\n0.5,1\n0.2,1\n0.7,1\n1,1\n", "line 3"),
        ("0,1\n0.5,1\n0.5,1\n0.7,1\n1,1\n", "line 3"),
        ("0,1\n0.1,1\n0.2,1\n0.3,1\n0.4,1\n", "end to end"),
        ("a\0b", "NUL"),
    ],
)
def test_gaps_are_refused(content: str, said: str, tmp_path: Path) -> None:
    file = written(tmp_path, content, "shape.csv")
    with pytest.raises(FileError) as caught:
        measured_shape(file, "s, curvature", 1.0, si=False)
    assert "shape.csv" in str(caught.value)
    assert said.strip(", ") in str(caught.value)


@pytest.mark.parametrize(
    ("points", "said"),
    [
        ([(0, 0), (0.2, 0), (0.2, 0), (0.5, 0), (0.7, 0), (1, 0)], "repeats"),
        ([(0, 0), (0.2, 0), (0.4, 0), (0.3, 0), (0.7, 0), (1, 0)], "turns back at line"),
        ([(0, 0), (0.2, 0), (0.4, 0), (0.7, 0), (1, 0)], "at least 6 points"),
    ],
)
def test_points_out_of_order_are_refused(points: list[tuple[float, float]], said: str, tmp_path: Path) -> None:
    file = written(tmp_path, "\n".join(f"{x},{y}" for x, y in points), "shape.csv")
    with pytest.raises(FileError, match=said):
        measured_shape(file, "x, y", 1.0, si=False)


def test_units_are_due_in_si_alone(tmp_path: Path) -> None:
    s = np.linspace(0.0, 1.0, 10)
    file = table(tmp_path, s, s, "s,curvature")
    with pytest.raises(ArgumentError, match="length_unit"):
        measured_shape(file, "s, curvature", 1.0, si=True)
    with pytest.raises(ArgumentError, match="curvature_unit"):
        measured_shape(file, "s, curvature", 1.0, si=True, length_unit="m", curvature_unit="m")
    with pytest.raises(ArgumentError, match="absent in a dimensionless"):
        measured_shape(file, "s, curvature", 1.0, si=False, length_unit="mm")


def test_a_scenario_with_measured_points(tmp_path: Path) -> None:
    """The motion from points on the centre line is that from the formula, to the error of the points."""
    x, y = centre_line(np.linspace(0.0, 1.0, 120))
    table(tmp_path, 250.0 * x, 250.0 * y, "x [mm];y [mm]".replace(";", ","))
    initial = 'curvature = { csv = "shape.csv", columns = "x, y", smoothing = "none" }'
    points = run(written(tmp_path, si_scenario(initial=initial)), tmp_path / "points").solution
    formula = run(written(tmp_path, scenario(initial='curvature = "1 + cos(3*s)"')), tmp_path / "formula").solution
    t = np.linspace(0.0, 2.0, 9)
    difference = np.abs(points.history(t) - formula.history(t))[:, :13].max()
    assert 0.0 < difference <= 5e-3
    assert "measured, shape.csv: 120 rows (x, y)" in points.initial
