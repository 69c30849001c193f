"""Claim: energies and entropies come in the units that they name, and their picture shows where entropy falls."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

import plastica as pl
from plastica.motion.thermodynamics import _UNITS, QUANTITIES
from tests.support import EPS
from tests.test_docs import code, rows
from tests.test_thermodynamics import bowed

LENGTH, STIFFNESS, TIME, WARMTH = 0.25, 0.035, 120.0, 293.15


@cache
def bench(temperature: float | None = WARMTH, segments: int = 1) -> pl.Solution:
    """A strip in SI, of a material with three preferred shapes."""
    specimen = pl.Specimen(length=LENGTH, bending_stiffness=STIFFNESS, retardation_time=TIME, temperature=temperature)
    material = pl.catalogue.material("three-shapes", length=LENGTH, stiffness=STIFFNESS, time=TIME)
    strut = pl.Strut(material, pl.Load(thrust=2.0), pl.Grid(12), specimen, natural_segments=segments)
    return pl.solve(strut, 4.0, 0.5, until=3600.0)


@cache
def plain() -> pl.Solution:
    """The same without dimensions."""
    strut = pl.Strut(pl.catalogue.material("three-shapes"), pl.Load(thrust=2.0 * LENGTH**2 / STIFFNESS), pl.Grid(12))
    times = bench().dataset.t.values / TIME
    return pl.solve(strut, 1.0, 0.125, until=3600.0 / TIME, times=np.append(times[:-1], 30.0))


PER_UNIT = {
    "J/m": STIFFNESS / LENGTH**2,
    "J": STIFFNESS / LENGTH,
    "W/m": STIFFNESS / LENGTH**2 / TIME,
    "W": STIFFNESS / LENGTH / TIME,
    "J/(m*K)": STIFFNESS / LENGTH**2 / WARMTH,
    "J/K": STIFFNESS / LENGTH / WARMTH,
    "W/(m*K)": STIFFNESS / LENGTH**2 / TIME / WARMTH,
    "W/K": STIFFNESS / LENGTH / TIME / WARMTH,
    "1": 1.0,
}
"""What one dimensionless unit is, from the dimension alone."""


def check_units() -> None:
    """In SI every quantity is its dimensionless value times the scale that its unit asks for."""
    warm, without = pl.thermodynamics(bench()), pl.thermodynamics(plain())
    assert set(warm.data_vars) == set(without.data_vars) == set(QUANTITIES)
    assert float(bench().dataset.natural_dissipation[-1]) > 0.0
    for name in QUANTITIES:
        unit = warm[name].attrs["units"]
        assert without[name].attrs["units"] == "1"
        due = without[name].values * PER_UNIT[unit]
        slack = 1e3 * plain().rtol * max(float(np.abs(due).max()), PER_UNIT[unit] if name == "imbalance" else 0.0)
        assert np.abs(warm[name].values - due).max() <= slack, name
    assert warm.attrs["temperature"] == WARMTH
    assert {warm[name].attrs["units"] for name in QUANTITIES} == set(PER_UNIT)


def test_units() -> None:
    check_units()


def check_without_temperature() -> None:
    """Entropies are then given times the temperature, and say so."""
    warm, cold = pl.thermodynamics(bench()), pl.thermodynamics(bench(None))
    units = {"entropy": "J/m", "total_entropy": "J", "entropy_rate": "W/m", "total_entropy_rate": "W"}
    for name, unit in units.items():
        assert cold[name].attrs["units"] == unit
        assert cold[name].attrs["long_name"].endswith("times temperature")
        assert not warm[name].attrs["long_name"].endswith("times temperature")
        factor = float(np.abs(cold[name]).max() / np.abs(warm[name]).max())
        assert factor == pytest.approx(WARMTH, rel=8.0 * EPS)
    assert "temperature" not in cold.attrs


def test_without_a_temperature() -> None:
    check_without_temperature()


def test_by_segment() -> None:
    heat = pl.thermodynamics(bench(segments=3))
    assert heat.preference_energy.dims == heat.volume_fraction.dims == ("t", "segment")
    spread = np.repeat(heat.preference_energy.values, 12, axis=1)
    assert np.abs(heat.bending_energy.values + spread - heat.free_energy.values).max() <= 16.0 * EPS * spread.max()
    assert list(heat.segment_end) == [pytest.approx(LENGTH * j / 3.0) for j in (1, 2, 3)]


def test_wrong_arguments() -> None:
    with pytest.raises(pl.errors.ArgumentError, match=r"must be a pl\.Solution"):
        pl.thermodynamics(bench().dataset)  # type: ignore[arg-type]


def check_picture() -> None:
    """The map hatches where entropy falls, and only there; the lines below it add up."""
    figure = pl.plot(pl.thermodynamics(bowed()))
    upper, lower = figure.axes[:2]
    assert upper.get_legend() is not None
    hatched = [each for each in upper.collections if each.get_hatch() or getattr(each, "hatches", None)]
    assert hatched
    internal, free, heat = (line.get_ydata()[-1] for line in lower.get_lines())
    assert internal == pytest.approx(free + heat, abs=1e-6)
    assert heat == pytest.approx(0.9761, abs=5e-5)
    everywhere = pl.plot(pl.thermodynamics(bowed(16)))
    assert everywhere.axes[0].get_legend() is None


def test_picture() -> None:
    check_picture()


def test_picture_in_units() -> None:
    figure = pl.plot(pl.thermodynamics(bench()))
    labels = [ax.get_ylabel() for ax in figure.axes]
    assert any(label.endswith("W/(m·K))") for label in labels)
    assert any(label.startswith("Change since the start (") and label.endswith("J)") for label in labels)


def test_every_quantity_is_documented() -> None:
    table = {code(row[0]): row[1:] for row in rows("rod.md", "Variables of the balance")}
    assert table == {
        name: [", ".join(dims), f"`{_UNITS[kind][0]}`", words] for name, (dims, kind, words) in QUANTITIES.items()
    }
