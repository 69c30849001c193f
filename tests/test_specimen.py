"""Claim: what is SI outside is dimensionless inside, and comes back unchanged (design, section 1.1)."""

from __future__ import annotations

import json
import math
import pickle
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from plastica.errors import ArgumentError
from plastica.physics.scales import KINDS, Scales, Section, Specimen, unit_of
from plastica.units import dimension_of

EPS = float(np.finfo(float).eps)
STRIP = {"shape": "rectangle", "width": "20 mm", "thickness": "1.5 mm"}


def strip(**changes: Any) -> Specimen:
    given_values: dict[str, Any] = {
        "length": "250 mm",
        "youngs_modulus": "2.4 GPa",
        "section": STRIP,
        "retardation_time": "2 h",
        "temperature": "293 K",
    }
    return Specimen(**(given_values | changes))


def magnitudes(low: float, high: float) -> st.SearchStrategy[float]:
    return st.floats(low, high).map(lambda exponent: 10.0**exponent)


scales = st.builds(Scales, magnitudes(-15, 15), magnitudes(-40, 40), magnitudes(-40, 40), magnitudes(-9, 9))


def check_round_trip(scale: Scales, kind: str, value: float) -> None:
    back = scale.from_si(kind, scale.to_si(kind, value))
    assert abs(back - value) <= 2 * EPS * abs(value)
    there = scale.to_si(kind, scale.from_si(kind, value))
    assert abs(there - value) <= 2 * EPS * abs(value)


def check_dimensions() -> None:
    """The scale of each kind has the power of L, EI and T that its unit has of m, N m² and s."""
    for kind, (unit, prop) in KINDS.items():
        kg, metre, second, kelvin = (float(each) for each in dimension_of("" if unit in ("1", "rad") else unit)[:4])
        length = metre - 3.0 * kg
        time = second + 2.0 * kg
        scale = Scales(2.0, 3.0, 5.0, 7.0)
        expected = 3.0**kg * 2.0**length * 5.0**time * 7.0**kelvin
        assert abs(getattr(scale, prop) - expected) <= 8 * EPS * expected, kind


def check_groups() -> None:
    """γ = βL²/EI, couple ·L/EI, distributed ·L³/EI, threshold /EI, preference ·L²/EI, flow ·L T."""
    L, EI, T = 0.3, 0.04, 150.0
    scale = Scales(L, EI, T)
    expected = {
        "force": L**2 / EI,
        "couple": L / EI,
        "distributed": L**3 / EI,
        "energy": L / EI,
        "threshold": 1 / EI,
        "drive": 1 / EI,
        "preference": L**2 / EI,
        "flow": L * T,
        "curvature": L,
        "time": 1 / T,
        "length": 1 / L,
    }
    for kind, factor in expected.items():
        assert abs(scale.from_si(kind, 1.7) - 1.7 * factor) <= 8 * EPS * 1.7 * factor, kind


@settings(deadline=None, max_examples=200, derandomize=True)
@given(scales, st.sampled_from(sorted(KINDS)), magnitudes(-60, 60), st.sampled_from([-1.0, 1.0]))
def test_there_and_back_changes_nothing(scale: Scales, kind: str, size: float, sign: float) -> None:
    check_round_trip(scale, kind, sign * size)


def test_arrays_and_zero_convert() -> None:
    scale = Scales(0.25, 0.035, 120.0)
    values = np.array([[0.0, -1.5], [3.0, 1e30]])
    assert np.array_equal(scale.to_si("force", values), values * (0.035 / 0.25 / 0.25))
    check_round_trip(scale, "curvature", 0.0)


def test_each_scale_has_the_dimension_of_its_unit() -> None:
    check_dimensions()


@pytest.mark.paper("3.1–3.4")
def test_the_dimensionless_groups_are_those_of_the_design() -> None:
    check_groups()


def test_units_for_labels() -> None:
    assert unit_of("force") == "N"
    assert unit_of("force", dimensionless=True) == "1"
    assert unit_of("angle", dimensionless=True) == "rad"
    assert unit_of("threshold") == "N*m**2"
    assert unit_of("entropy_production") == "W/K"
    assert unit_of("entropy_production", thermal=False) == "W"
    with pytest.raises(ArgumentError, match="force"):
        unit_of("forse")
    with pytest.raises(ArgumentError, match="`kind`"):
        Scales.unit().to_si("x", 1.0)


def test_without_a_temperature_entropy_production_is_a_power() -> None:
    assert Scales(2.0, 3.0, 5.0).entropy_production == Scales(2.0, 3.0, 5.0).power
    assert Scales(2.0, 3.0, 5.0, 10.0).entropy_production == Scales(2.0, 3.0, 5.0).power / 10.0
    assert strip(temperature=None).scales.temperature is None


def test_unit_scales_are_all_one() -> None:
    one = Scales.unit()
    assert {getattr(one, prop) for _, prop in KINDS.values()} == {1.0}


@pytest.mark.parametrize(
    ("values", "second_moment"),
    [
        (STRIP, 20e-3 * 1.5e-3**3 / 12),
        ({"shape": "rectangle", "width": 1.0, "thickness": 1.0}, 1 / 12),
        ({"shape": "circle", "diameter": "4 mm"}, math.pi * (4e-3) ** 4 / 64),
        ({"shape": "tube", "outer_diameter": 2.0, "inner_diameter": 1.0}, math.pi * 15 / 64),
        ({"shape": "tube", "outer_diameter": 2.0, "wall": 0.5}, math.pi * 15 / 64),
        # A thin wall: π R³ w (1 + (w/2R)²), R the mean radius.
        (
            {"shape": "tube", "outer_diameter": 2.0 + 1e-9, "wall": 1e-9},
            math.pi * 1e-9,
        ),
    ],
)
def test_second_moments_of_area(values: dict[str, Any], second_moment: float) -> None:
    found = Section.read(values).second_moment
    # The wall of 1e-9 is itself known to eps/1e-9 in the outer diameter.
    tolerance = 4e-7 if values.get("wall") == 1e-9 else 16 * EPS
    assert abs(found - second_moment) <= tolerance * second_moment


def test_a_strip_of_plastic() -> None:
    specimen = strip()
    stiffness = 2.4e9 * 20e-3 * 1.5e-3**3 / 12
    assert (specimen.L, specimen.T) == (0.25, 7200.0)
    assert abs(specimen.EI - stiffness) <= 8 * EPS * stiffness
    assert abs(specimen.gamma("0.3 N") - 0.3 * 0.25**2 / stiffness) <= 8 * EPS
    assert specimen.gamma(300e-3) == specimen.gamma("300 mN")


def test_text_and_numbers_say_the_same() -> None:
    a = Specimen(length="250 mm", bending_stiffness="350 N*cm**2", retardation_time="2 min")
    b = Specimen(length=0.25, bending_stiffness=0.035, retardation_time=120)
    assert a.scales == b.scales


def check_stored(specimen: Specimen) -> None:
    copy = Specimen.from_dict(json.loads(json.dumps(specimen.to_dict())))
    assert copy == specimen
    assert copy.scales == specimen.scales
    assert copy.as_given == specimen.as_given


def test_stored_and_read_back_it_is_equal() -> None:
    check_stored(strip())
    check_stored(strip(temperature=None))
    check_stored(Specimen(**STEEL))
    check_stored(strip(mass_per_length="36 g/m", rotary_inertia=1e-9))
    check_stored(Specimen(length=np.float32(0.25), bending_stiffness=np.int64(2), retardation_time=10))
    check_stored(Specimen(length=np.array(0.25), bending_stiffness=np.array(0.035), retardation_time=np.array(10)))
    assert strip().as_given["length"] == "250 mm"
    assert strip().as_given["section"] == STRIP
    assert hash(strip()) == hash(strip())
    assert pickle.loads(pickle.dumps(strip())) == strip()  # noqa: S301


@pytest.mark.parametrize(
    ("values", "area"),
    [
        (STRIP, 20e-3 * 1.5e-3),
        ({"shape": "circle", "diameter": "4 mm"}, math.pi * (2e-3) ** 2),
        ({"shape": "tube", "outer_diameter": 2.0, "inner_diameter": 1.0}, 0.75 * math.pi),
        ({"shape": "tube", "outer_diameter": 2.0, "wall": 0.5}, 0.75 * math.pi),
    ],
)
def test_areas(values: dict[str, Any], area: float) -> None:
    assert abs(Section.read(values).area - area) <= 8 * EPS * area


def check_inertia(specimen: Specimen, mass: float, rotary: float) -> None:
    """ε₁ = ρA L⁴/(EI T²) and ε₀ = ρJ L²/(EI T²) (design, section 1.1)."""
    L, EI, T = specimen.L, specimen.EI, specimen.T
    for found, expected in (
        (specimen.translational_inertia, mass * L**4 / (EI * T**2)),
        (specimen.rotary_inertia_ratio, rotary * L**2 / (EI * T**2)),
    ):
        assert abs(found - expected) <= 16 * EPS * expected


STEEL: dict[str, Any] = {
    "length": "300 mm",
    "youngs_modulus": "200 GPa",
    "section": {"shape": "rectangle", "width": "20 mm", "thickness": "1 mm"},
    "density": "7.85 g/cm**3",
}


def check_undamped() -> None:
    """Without a retardation time T = √(ρA L⁴/EI), so that ε₁ = 1 exactly and δ = 0; ε₀ = I/(A L²)."""
    rod = Specimen(**STEEL)
    mass, stiffness = 7850.0 * 20e-3 * 1e-3, 200e9 * 20e-3 * 1e-9 / 12.0
    T = math.sqrt(mass * 0.3**4 / stiffness)
    assert abs(rod.T - T) <= 8 * EPS * T
    assert (rod.damping, rod.translational_inertia) == (0.0, 1.0)
    ratio = 1e-3**2 / 12.0 / 0.3**2
    assert abs(rod.rotary_inertia_ratio - ratio) <= 16 * EPS * ratio
    check_inertia(rod, mass, 7850.0 * 20e-3 * 1e-9 / 12.0)


def test_a_rod_without_damping() -> None:
    check_undamped()


def test_inertia_beside_a_retardation_time() -> None:
    rod = Specimen(**STEEL, retardation_time=0.5)
    assert (rod.T, rod.damping) == (0.5, 1.0)
    check_inertia(rod, 0.157, 7850.0 * 20e-3 * 1e-9 / 12.0)
    given_both = strip(mass_per_length="36 g/m", rotary_inertia="6.6e-9 kg*m")
    check_inertia(given_both, 0.036, 6.6e-9)
    assert (strip().translational_inertia, strip().rotary_inertia_ratio, strip().damping) == (0.0, 0.0, 1.0)


def test_rotary_inertia_alone_gives_a_time_too() -> None:
    rod = Specimen(length=2.0, bending_stiffness=3.0, rotary_inertia=0.75)
    assert rod.T == 1.0
    assert (rod.translational_inertia, rod.rotary_inertia_ratio) == (0.0, 1.0)


def test_a_measured_stiffness_beside_a_density() -> None:
    rod = Specimen(length=0.3, bending_stiffness=0.3, section=STEEL["section"], density=7850)
    assert rod.EI == 0.3
    assert rod.inertia.mass == pytest.approx(0.157, rel=8 * EPS)


BAD: list[tuple[str, Callable[[], object]]] = [
    ("retardation_time", lambda: strip(retardation_time=None)),
    ("mass_per_length", lambda: strip(mass_per_length="1 kg")),
    ("mass_per_length", lambda: strip(mass_per_length=0.0)),
    ("mass_per_length", lambda: strip(mass_per_length=-1)),
    ("mass_per_length", lambda: strip(mass_per_length=1e-300)),
    ("rotary_inertia", lambda: strip(rotary_inertia="1 kg/m")),
    ("rotary_inertia", lambda: strip(rotary_inertia=math.nan)),
    ("rotary_inertia", lambda: strip(rotary_inertia=1e300)),
    ("density", lambda: strip(density="1 kg/m")),
    ("density", lambda: strip(density=-1.0)),
    ("density", lambda: strip(density=1.0, mass_per_length=1.0)),
    ("density", lambda: strip(density=1.0, rotary_inertia=1.0)),
    ("density", lambda: Specimen(length=1.0, bending_stiffness=1.0, density=1.0)),
    ("bending_stiffness", lambda: strip(density=1.0, bending_stiffness=1.0)),
    ("length", lambda: strip(length="250")),
    ("length", lambda: strip(length="250 N")),
    ("length", lambda: strip(length="-1 m")),
    ("length", lambda: strip(length=0)),
    ("length", lambda: strip(length=math.nan)),
    ("length", lambda: strip(length=math.inf)),
    ("length", lambda: strip(length=True)),
    ("length", lambda: strip(length=None)),
    ("length", lambda: strip(length=[1.0])),
    ("length", lambda: strip(length=np.array([1.0]))),
    ("length", lambda: strip(length=10**400)),
    ("length", lambda: strip(length="9**9**9 m")),
    ("length", lambda: strip(length="nan m")),
    ("length", lambda: strip(length=1e-200)),
    ("retardation_time", lambda: strip(retardation_time="2 mm")),
    ("retardation_time", lambda: strip(retardation_time=-3.0)),
    ("temperature", lambda: strip(temperature="0 K")),
    ("temperature", lambda: strip(temperature=-1)),
    ("temperature", lambda: strip(temperature="20 degC")),
    ("bending_stiffness", lambda: strip(bending_stiffness="1 N*m**2")),
    ("bending_stiffness", lambda: strip(section=None)),
    ("bending_stiffness", lambda: strip(youngs_modulus=None)),
    ("bending_stiffness", lambda: strip(youngs_modulus=None, section=None)),
    ("bending_stiffness", lambda: strip(youngs_modulus=None, section=None, bending_stiffness="1 N*m")),
    ("youngs_modulus", lambda: strip(youngs_modulus="2.4 GN")),
    ("section", lambda: strip(section="round")),
    ("section.shape", lambda: strip(section={})),
    ("section.shape", lambda: strip(section={"shape": "star"})),
    ("section.shape", lambda: strip(section={"shape": ["circle"]})),
    ("section", lambda: strip(section={"shape": "circle"})),
    ("section", lambda: strip(section={"shape": "circle", "diameter": 1.0, "width": 1.0})),
    ("section", lambda: strip(section={1: 2})),
    ("section.diameter", lambda: strip(section={"shape": "circle", "diameter": "4"})),
    ("section.thickness", lambda: strip(section={"shape": "rectangle", "width": 1e-3, "thickness": 2e-3})),
    ("section.wall", lambda: strip(section={"shape": "tube", "outer_diameter": 1e-3, "wall": 0.5e-3})),
    ("section.inner_diameter", lambda: strip(section={"shape": "tube", "outer_diameter": 1, "inner_diameter": 1})),
    ("thrust", lambda: strip().gamma("3 m")),
    ("thrust", lambda: strip().gamma(math.nan)),
    ("thrust", lambda: strip().gamma("3")),
    ("specimen", lambda: Specimen.from_dict(3)),
    ("specimen", lambda: Specimen.from_dict({"bending_stiffness": 1.0, "retardation_time": 1.0})),
    ("specimen", lambda: Specimen.from_dict(strip().to_dict() | {"mass": 1.0})),
    ("specimen", lambda: Specimen.from_dict(strip().to_dict() | {3: 1.0})),
    ("length, stiffness and time", lambda: Scales(1e-100, 1e100, 1.0)),
    ("stiffness", lambda: Scales(1.0, math.nan, 1.0)),
]


@pytest.mark.parametrize(("where", "make"), BAD)
def test_a_wrong_specimen_is_refused_with_its_argument_named(where: str, make: Callable[[], object]) -> None:
    with pytest.raises(ArgumentError) as caught:
        make()
    assert caught.value.where == where
    assert str(caught.value).startswith(f"`{where}` must ")
