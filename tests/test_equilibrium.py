"""Claim: an equilibrium is one of the whole rod (claim 5), judged by its material, and says what it is."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import plastica as pl
from plastica.equilibria.equilibrium import Equilibrium, frozen_equilibrium
from plastica.errors import ArgumentError
from plastica.physics.ledger import liapunov
from tests.support import EPS, materials, pair


def check_equilibrium(found: Equilibrium) -> None:
    """The rod's rates vanish there (claim 5), on 64 nodes, and its drive, V and tip are those of the rod."""
    assert found.material is not None
    grid = pl.Grid(nodes=64)
    strut = pl.Strut(found.material, pl.Load(thrust=found.gamma), grid)
    mu = found.curvature(grid.s)
    mu_t, natural_rate = strut.rate(0.0, mu, found.mu_nat)
    scale = found.gamma + abs(found.alpha) + abs(found.mu_nat)
    assert np.abs(mu_t).max() <= 1e-12 * scale
    bend = 1.0 + abs(float(strut.laws.preference.second(np.array(found.mu_nat))))
    assert found.drive is not None
    assert found.threshold is not None
    assert abs(float(strut.drive(mu, found.mu_nat)) - found.drive) <= 1e-12 * bend * scale
    assert float(strut.threshold(found.mu_nat)) == found.threshold
    if abs(abs(found.drive) - found.threshold) > 1e-11 * bend * scale:
        assert found.admissible == (float(natural_rate) == 0.0)
    energy = float(liapunov(strut, 0.0, mu, found.mu_nat))
    assert abs(energy - found.liapunov) <= 1e-12 * (scale**2 + abs(energy))
    theta = strut.angle(mu)
    assert np.abs(np.array(found.tip) - [np.cos(theta) @ grid.w, np.sin(theta) @ grid.w]).max() <= 1e-12 * (1.0 + scale)
    assert np.abs(found.phi(grid.s) - theta).max() <= 1e-12 * scale


def check_liapunov_slope(name: str, gamma: float, alpha: float) -> None:
    """Along the curve of equilibria dV/dalpha = -D dmu_nat/dalpha (errata C): V, drive and kernel belong together."""
    steps = 1e-3 * np.array([2.0, 1.0, -1.0, -2.0])
    near = [pl.equilibrium(pair(name), gamma, alpha + step) for step in steps]
    slope = float(np.array([-1.0, 8.0, -8.0, 1.0]) @ [each.liapunov for each in near]) / 12e-3
    here = pl.equilibrium(pair(name), gamma, alpha)
    assert here.drive is not None
    size = abs(here.liapunov) + (1.0 + abs(here.drive)) * (1.0 + gamma)
    assert abs(slope + here.drive * here.theta0_end[1]) <= 1e-9 * size


def check_verdict() -> None:
    """Admissible is |drive| <= threshold, the edge included."""
    inside = pl.equilibrium(pl.Material("m**2/2", "pos(x)**2", "0.1"), 3.0, 1.2)
    edge = abs(inside.drive or 0.0)
    for threshold, expected in ((edge, True), (np.nextafter(edge, 0.0), False), (np.nextafter(edge, 9.0), True)):
        material = pl.Material("m**2/2", "pos(x)**2", "h", {"h": float(threshold)})
        assert pl.equilibrium(material, 3.0, 1.2).admissible is expected
        assert pl.equilibrium(material, 3.0, -1.2).admissible is expected


@given(materials(), st.floats(0.0, 20.0), st.floats(-10.0, 10.0))
@settings(deadline=None, max_examples=60, derandomize=True)
@pytest.mark.paper("3.52–3.54")
def test_equilibria_are_equilibria(material: pl.Material, gamma: float, alpha: float) -> None:
    check_equilibrium(pl.equilibrium(material, gamma, alpha))


@pytest.mark.parametrize(
    ("name", "gamma", "alpha"), [("A", 3.0, 1.2), ("B", 8.0, -3.0), ("A", 1.0, 4.0), ("B", 0.0, 1.0)]
)
def test_energy_and_drive_belong_together(name: str, gamma: float, alpha: float) -> None:
    check_liapunov_slope(name, gamma, alpha)


def test_verdict() -> None:
    check_verdict()


def test_an_equilibrium_says_what_it_is() -> None:
    found = pl.equilibrium(pair("A"), gamma=3.0, alpha=1.2)
    assert (found.gamma, found.alpha, found.regime, found.admissible) == (3.0, 1.2, "librating", False)
    assert isinstance(found.phi(0.5), float)
    assert found.phi([[0.0, 0.5]]).shape == (1, 2)
    assert found.curvature(0.0) == 1.2
    assert found.curvature(1.0) == found.mu_nat
    assert (found.theta0(1.0), found.theta0_slope(1.0)) == found.theta0_end
    assert found.centre_line(1.0) == found.tip
    assert found == pl.equilibrium(pair("A"), gamma=3, alpha=np.float64(1.2))  # type: ignore[arg-type]
    assert len({found, pl.equilibrium(pair("A"), 3.0, 1.2)}) == 1
    assert str(found).startswith("Librating equilibrium at gamma = 3: ")
    assert "> threshold 0.1" in str(found)
    with pytest.raises(AttributeError):
        found.alpha = 0.0  # type: ignore[misc]


@pytest.mark.parametrize(
    ("gamma", "alpha", "regime"),
    [
        (3.0, 0.0, "straight"),
        (0.0, 0.0, "straight"),
        (4.0, -4.0, "separatrix"),
        (4.0, np.nextafter(4.0, 0.0), "librating"),
        (4.0, np.nextafter(4.0, 5.0), "rotating"),
        (2.0, 2.0 * math.sqrt(2.0), "rotating"),
        (0.0, 1e-300, "rotating"),
        (1e-320, 1e-300, "librating"),
    ],
)
def test_regimes_are_those_of_the_numbers_given(gamma: float, alpha: float, regime: str) -> None:
    assert frozen_equilibrium(gamma, alpha).regime == regime


def test_without_a_material_nothing_is_judged() -> None:
    found = frozen_equilibrium(40.0, 3.0)
    assert (found.drive, found.threshold, found.admissible, found.laws) == (None, None, None, None)
    with_law = pl.equilibrium(pair("A"), 40.0, 3.0)
    assert abs(with_law.liapunov - found.liapunov - 0.5 * found.mu_nat**2) <= 8.0 * EPS * 40.0
    assert "threshold" not in str(found)
    assert "drive" not in found.to_dataset()


def test_dataset() -> None:
    found = pl.equilibrium(pair("B"), gamma=3.0, alpha=1.2)
    data = found.to_dataset()
    assert data.sizes == {"s": 101}
    assert all(data[name].attrs["units"] and data[name].attrs["long_name"] for name in data.variables)
    assert np.array_equal(data.angle, found.phi(data.s.values))
    assert float(data.natural_curvature) == found.mu_nat == float(data.curvature[-1])
    assert abs(float(data.natural_x[-1]) - math.sin(found.mu_nat) / found.mu_nat) <= 4.0 * EPS
    assert float(data.couple[-1]) == 0.0
    assert data.attrs["sentence"] == str(found)


def test_dataset_in_si() -> None:
    specimen = pl.Specimen(length=0.25, bending_stiffness=0.035, retardation_time=120.0)
    material = pl.catalogue.material("one-shape", length=0.25, stiffness=0.035, time=120.0)
    found = pl.equilibrium(material, 3.0, 1.2, specimen=specimen)
    plain = pl.equilibrium(pl.catalogue.material("one-shape"), 3.0, 1.2)
    assert found.drive is not None
    assert plain.drive is not None
    assert abs(found.drive - plain.drive) <= 8.0 * EPS
    data = found.to_dataset()
    assert data.thrust.attrs["units"] == "N"
    assert abs(float(data.thrust) - 3.0 * 0.035 / 0.25**2) <= 4.0 * EPS
    assert float(data.s[-1]) == 0.25
    assert abs(float(data.drive) - 0.035 * found.drive) <= 4.0 * EPS * abs(found.drive)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"gamma": -1.0}, "`gamma` must not be negative: tension is not treated, but is -1.0"),
        ({"gamma": math.nan}, r"`gamma` must lie in \[0, 100000\], but is nan"),
        ({"gamma": math.inf}, "`gamma` must lie in"),
        ({"gamma": 1e6}, "`gamma` must lie in"),
        ({"gamma": "3"}, "`gamma` must be a number, but is '3'"),
        ({"gamma": True}, "`gamma` must be a number"),
        ({"gamma": None}, "`gamma` must be a number"),
        ({"alpha": math.nan}, "`alpha` must lie in"),
        ({"alpha": -math.inf}, "`alpha` must lie in"),
        ({"alpha": 1e7}, "`alpha` must lie in"),
        ({"alpha": 1 + 2j}, "`alpha` must be a number"),
        ({"alpha": np.zeros(2)}, "`alpha` must be a number"),
        ({"material": "one-shape"}, "`material` must be a pl.Material"),
        ({"material": None}, "`material` must be a pl.Material"),
        ({"specimen": "strip"}, "`specimen` must be a pl.Specimen or None"),
        ({"material": pl.catalogue.material("one-shape", length=1, stiffness=1, time=1)}, "`parameters` must be plain"),
    ],
)
def test_mistakes(arguments: dict[str, Any], words: str) -> None:
    given_ = {"material": pair("A"), "gamma": 3.0, "alpha": 1.0, **arguments}
    with pytest.raises(ArgumentError, match=words):
        pl.equilibrium(**given_)
