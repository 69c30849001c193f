"""Claim: the phase diagram holds every limiting equilibrium, fold and tangency of its window, each to rounding."""

from __future__ import annotations

import json
from functools import cache
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import plastica as pl
from plastica.charts.components import Component
from plastica.charts.contours import critical_points, zero_curves
from plastica.charts.gap import gap
from plastica.equilibria.elastica import ends
from plastica.errors import ArgumentError
from plastica.physics.laws import laws_of
from tests.support import DATA, EPS, materials, pair

Array = np.ndarray


@cache
def diagram(name: str, gamma: float = 20.0, alpha: float = 20.0) -> pl.PhaseDiagram:
    return pl.phase_diagram(pair(name), gamma=(0.0, gamma), alpha=(-alpha, alpha), shape=(120, 120))


def met(components: tuple[Any, ...], thrust: float) -> Array:
    """Where polylines cross a thrust, to the accuracy of straight pieces."""
    found = []
    for c in components:
        g, a = (np.append(z, z[:1]) if getattr(c, "kind", "") == "closed" else z for z in (c.gamma, c.alpha))
        k = np.flatnonzero((g[:-1] > thrust) != (g[1:] > thrust))
        share = (thrust - g[k]) / (g[k + 1] - g[k])
        found.append(a[k] + share * (a[k + 1] - a[k]))
    return np.sort(np.concatenate(found)) if found else np.zeros(0)


def check_curves(found: pl.PhaseDiagram, thrusts: tuple[float, ...]) -> None:
    """At thrusts of no grid line the curves have the limiting equilibria that `equilibria` finds, and the folds."""
    window = (float(found.alpha[0]), float(found.alpha[-1]))
    for thrust in thrusts:
        exact = pl.equilibria(found.material, thrust, alpha=window)
        for curves, points in ((found.components, exact.limiting), (found.folds, exact.folds)):
            known = np.sort([point.alpha for point in points])
            traced = met(curves, thrust)
            assert traced.size == known.size, (thrust, traced, known)
            # straight pieces between vertices: the size of a cell squared
            assert np.all(np.abs(traced - known) <= 0.02 * max(1.0, window[1] / 10.0))


@pytest.mark.parametrize("name", ["A", "B"])
@pytest.mark.paper("3.83")
def test_curves_hold_every_limiting_equilibrium(name: str) -> None:
    found = diagram(name)
    assert found.complete
    check_curves(found, (0.2, 0.5, 1.7, 2.6, 4.9, 9.3, 19.7))


def check_vertices(found: pl.PhaseDiagram) -> None:
    """Every vertex is a limiting equilibrium, and every point of a fold line a fold, to rounding."""
    laws = laws_of(found.material, found.specimen)
    assert found.components
    for c in found.components:
        here = gap(c.gamma, c.alpha, c.side, laws)
        size = np.abs(c.mu_nat) * (1.0 + np.abs(laws.preference.second(c.mu_nat))) + np.abs(here.by_alpha)
        assert np.all(np.abs(here.value) <= 200.0 * EPS * (4.0 + size * (1.0 + np.abs(c.alpha)) * (1.0 + c.gamma)))
        assert np.array_equal(c.mu_nat, ends(c.gamma, c.alpha).mu_nat)
    for line in found.folds:
        end = ends(line.gamma, line.alpha)
        near = ends(line.gamma, line.alpha + 1e-6).theta0_slope - ends(line.gamma, line.alpha - 1e-6).theta0_slope
        size = 1.0 + np.abs(near) / 2e-6 * (1.0 + np.abs(line.alpha)) + line.gamma * np.abs(end.theta0)
        assert np.all(np.abs(end.theta0_slope) <= 1e-10 * size)


@pytest.mark.parametrize("name", ["A", "B"])
def test_vertices_are_exact(name: str) -> None:
    check_vertices(diagram(name))


def check_paper_question() -> None:
    """Pairs A and B: four components, no loop, mirror images in pairs; the tangency is gamma**, the cusp is Euler's."""
    rows = {row["pair"]: row for row in json.loads((DATA / "thresholds.json").read_text())["rows"]}
    for name in ("A", "B"):
        found = diagram(name)
        assert [c.kind for c in found.components] == ["open"] * 4
        assert sorted(c.side for c in found.components) == [-1, -1, 1, 1]
        assert len(found.tangencies) == 2
        for place in found.tangencies:
            assert place.words == "two appear"
            assert abs(place.gamma - float(rows[name]["gamma_star_star"])) <= 1e-12
            assert abs(abs(place.alpha) - float(rows[name]["a_star_star"])) <= 1e-10
        begun = [place for c in found.components for place in c.ends if place.gamma == 0.0]
        assert len(begun) == 2
        # without thrust D = -kappa'(alpha)
        laws = laws_of(found.material, None)
        for place in begun:
            assert abs(abs(laws.preference.slope_at(place.alpha)) - laws.threshold.value_at(place.alpha)) <= 100.0 * EPS
        euler = found.cusps[0]
        assert abs(euler.gamma - np.pi**2 / 4.0) <= 1e-12
        assert euler.alpha == 0.0
        assert found.folds[0].gamma.min() == euler.gamma


@pytest.mark.paper("3.83")
def test_the_paper_question() -> None:
    check_paper_question()


def test_the_paper_question_depends_on_the_material() -> None:
    """A deeper well: without thrust the set has more pieces, one of which joins two of its beginnings."""
    material = pl.Material("m**2*(m**2 - 1.5**2)**2*0.4", "pos(x)**2", "0.2*(1 + m**2)")
    found = pl.phase_diagram(material, gamma=(0, 10), alpha=(-8, 8), shape=(120, 120))
    assert found.complete
    assert len(found.components) == 10
    bridges = [c for c in found.components if len(c.ends) == 2 and all(p.gamma == 0.0 for p in c.ends)]
    assert len(bridges) == 2
    assert {p.words for c in bridges for p in c.tangencies} == {"two vanish"}
    check_curves(found, (0.03, 1.1, 2.2, 3.0, 5.0, 8.3))


def check_tongues() -> None:
    """At gamma = 97 the layer is 1e-7 wide, and 22 limiting equilibria lie within |alpha| < 20."""
    found = pl.phase_diagram(pair("B"), gamma=(80, 100), alpha=(15, 25), shape=(60, 60))
    assert found.complete
    check_curves(found, (81.0, 95.6, 97.0, 99.1))


def test_narrow_tongues_at_the_separatrix() -> None:
    check_tongues()


def check_slopes_of_the_gap() -> None:
    """Closed forms of both derivatives against differences of fourth order."""
    laws = laws_of(pair("B"), None)
    gamma, alpha = np.array([0.3, 2.0, 7.0, 19.0])[:, None], np.array([-9.0, -2.0, 0.1, 1.3, 6.0])
    h = 1e-3
    for side in (1, -1):
        exact = gap(gamma, alpha, side, laws)
        for found, change in ((exact.by_alpha, (0.0, h)), (exact.by_gamma, (h, 0.0))):
            near, far = (
                gap(gamma + k * change[0], alpha + k * change[1], side, laws).value
                - gap(gamma - k * change[0], alpha - k * change[1], side, laws).value
                for k in (1, 2)
            )
            difference = (8.0 * near - far) / (12.0 * h)
            assert np.all(np.abs(found - difference) <= 1e-7 * (1.0 + np.abs(found)))


def test_slopes_of_the_gap() -> None:
    check_slopes_of_the_gap()


def check_grid(found: pl.PhaseDiagram) -> None:
    """The grid agrees with single equilibria, and the regions with the curves."""
    rng = np.random.default_rng(5)
    for i, j in rng.integers(0, (found.gamma.size, found.alpha.size), (12, 2)):
        one = pl.equilibrium(found.material, float(found.gamma[i]), float(found.alpha[j]))
        data = found.dataset
        assert abs(float(data["natural_curvature"][i, j]) - one.mu_nat) <= 1e-12 * max(1.0, abs(one.mu_nat))
        assert abs(float(data["drive"][i, j]) - one.drive) <= 1e-12 * max(1.0, abs(one.drive))
        assert bool(data["admissible"][i, j]) == one.admissible
        assert int(data["unstable"][i, j]) == pl.spectrum(one).unstable


def test_the_grid() -> None:
    check_grid(diagram("B", 12.0, 8.0))


def test_stability_changes_at_tangencies_and_folds_only() -> None:
    for component in diagram("A").components:
        kept = ~np.isin(np.arange(component.gamma.size), special(component))
        attracting = component.attracting[kept]
        changes = int(np.count_nonzero(attracting[1:] != attracting[:-1]))
        assert changes <= len(component.tangencies) + len(component.folds)
        if component.tangencies:
            assert changes >= 1


def special(component: Component) -> list[int]:
    points = [*component.tangencies, *component.folds]
    return [int(np.hypot(component.gamma - p.gamma, component.alpha - p.alpha).argmin()) for p in points]


@settings(deadline=None, max_examples=4, derandomize=True)
@given(materials(), st.floats(0.4, 6.0))
def test_any_material(material: pl.Material, thrust: float) -> None:
    found = pl.phase_diagram(material, gamma=(0.0, 7.0), alpha=(-7.0, 7.0), shape=(40, 40))
    exact = pl.equilibria(material, thrust, alpha=(-7.0, 7.0))
    if found.complete and not exact.tangencies:
        assert met(found.components, thrust).size == len(exact.limiting)
    check_vertices(found) if found.components else None


def test_the_path_of_a_run_ends_on_a_limiting_curve() -> None:
    found = diagram("B")
    strut = pl.Strut(pair("B", 50.0), pl.Load(thrust=pl.programs.table([0.0, 5.0], [0.5, 1.0])), pl.Grid(nodes=20))
    found = pl.phase_diagram(strut.material, gamma=(0, 2), alpha=(-4, 4), shape=(40, 40))
    path = found.path(pl.solve(strut, 0.6, 0.4, until=1e4))
    assert float(path["gamma"][0]) == 0.5
    assert float(path["gamma"][-1]) == 1.0
    assert abs(float(path["alpha"][0]) - 0.6) <= 1e-12
    end = float(path["alpha"][-1])
    limits = [point for point in pl.equilibria(strut.material, 1.0).limiting if point.attracting]
    assert min(abs(point.alpha - end) for point in limits) <= 1e-3
    assert min(abs(a - end) for a in met(found.components, 1.0 - 1e-9)) <= 1e-2


def test_in_si() -> None:
    specimen = pl.Specimen(length="0.25 m", bending_stiffness="0.035 N*m**2", retardation_time="120 s")
    material = pl.catalogue.material("one-shape", length=0.25, stiffness=0.035, time=120.0)
    options: dict[str, Any] = {"gamma": (0, 5), "alpha": (-5, 5), "shape": (30, 30)}
    found, bare = pl.phase_diagram(material, specimen=specimen, **options), pl.phase_diagram(pair("A"), **options)
    data, same = found.to_dataset(), bare.to_dataset()
    assert data["thrust"].attrs["units"] == "N"
    assert np.allclose(data["thrust"], same["gamma"] * 0.035 / 0.25**2, rtol=4 * EPS)
    assert np.allclose(data["natural_curvature"], same["natural_curvature"] / 0.25, rtol=1e-12)
    assert data["drive"].attrs["units"] == "N*m**2"
    assert np.allclose(data["tangency_gamma"], same["tangency_gamma"], rtol=1e-12)
    assert "4 components" in str(found)


@pytest.mark.parametrize(
    ("change", "where"),
    [
        ({"gamma": (-1.0, 2.0)}, "gamma"),
        ({"gamma": (2.0, 2.0)}, "gamma"),
        ({"gamma": (0.0, float("nan"))}, "gamma"),
        ({"gamma": (0.0, 1e4)}, "gamma"),
        ({"gamma": 3.0}, "gamma"),
        ({"alpha": (1.0, -1.0)}, "alpha"),
        ({"alpha": ("a", "b")}, "alpha"),
        ({"shape": (1, 100)}, "shape"),
        ({"shape": (5000, 5000)}, "shape"),
        ({"shape": (10.0, 10)}, "shape"),
        ({"material": "one-shape"}, "material"),
        ({"specimen": 3}, "specimen"),
    ],
)
def test_bad_input(change: dict[str, Any], where: str) -> None:
    with pytest.raises(ArgumentError, match=f"`{where}`"):
        pl.phase_diagram(**{"material": pair("A"), **change})


def test_a_path_of_another_rod_is_refused() -> None:
    found = pl.phase_diagram(pair("A"), gamma=(0, 2), alpha=(-2, 2), shape=(10, 10))
    for load, material in ((pl.Load(thrust=1.0, couple=0.1), pair("A")), (pl.Load(thrust=1.0), pair("B"))):
        run = pl.solve(pl.Strut(material, load, pl.Grid(nodes=8)), 0.1, until=1.0)
        with pytest.raises(ArgumentError):
            found.path(run)


def circles(x: Array, y: Array) -> Array:
    """Two circles and a hyperbola through a saddle."""
    return ((x - 2.0) ** 2 + y**2 - 0.3) * ((x - 2.0) ** 2 + (y - 1.5) ** 2 - 0.2) * ((x - 4.0) * (y - 0.8) - 1e-4)


def check_marching() -> None:
    x, y = np.meshgrid(np.linspace(0.0, 5.0, 91), np.linspace(-2.0, 3.0, 88), indexing="ij")
    curves = zero_curves(circles, x, y)
    assert sorted(curve.closed for curve in curves) == [False, False, True, True]
    for curve in curves:
        assert np.all(np.abs(circles(curve.x, curve.y)) <= 1e-12)
        assert np.hypot(np.diff(curve.x), np.diff(curve.y)).max() <= 0.2
    loops = [curve for curve in curves if curve.closed]
    radii = sorted(np.sqrt(0.5 * (np.ptp(c.x) * np.ptp(c.y)) / 2.0) for c in loops)
    assert np.allclose(radii, np.sqrt([0.2, 0.3]), rtol=1e-2)
    # x = x(y) turns back where the y-derivative vanishes: four points on the circles
    points = critical_points(circles, lambda x, y: (circles(x, y + 1e-4) - circles(x, y - 1e-4)) / 2e-4, tuple(loops))
    assert len(points) == 4
    assert all(point.exact for point in points)


def test_marching_squares() -> None:
    check_marching()
