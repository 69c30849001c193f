"""Claim: a scenario with inertia, segments, angles or tension means what it says; its mistakes are told at once."""

from __future__ import annotations

import csv
import json
import math
from pathlib import Path

import numpy as np
import pytest

import plastica as pl
from plastica.errors import ScenarioError
from plastica.study.run import run
from plastica.study.scenario import read_scenario
from tests.commandline import call, scenario, si_scenario, written
from tests.support import EPS

INERTIA = "translational_inertia = 0.3\nrotary_inertia = 0.001\ndamping = 0.05"
START = 'curvature = "0.2*(1 - s)"\nnatural_curvature = [0.2, -0.1]\ncurvature_rate = "s"'
RATE = 'curvature_rate = { pieces = ["2 1/(m*s)", "s"], breaks = ["50 mm"] }'
STEEL = 'length = "300 mm"\nyoungs_modulus = "210 GPa"\nsection = { shape = "circle", diameter = "3 mm" }'


def rod_scenario(**changed: str | None) -> str:
    parts: dict[str, str | None] = {
        "inertia": INERTIA,
        "load": 'force = "cos(3*t)"\nangle = "120 deg"\nweight = 0.5\nweight_angle = "90 deg"',
        "initial": START,
        "grid": "nodes = 6\nnatural_segments = [0.3]",
        "solve": "until = 0.5\nrtol = 1e-6",
    }
    return scenario(**(parts | changed))


def check_it_is_the_call(folder: Path) -> None:
    """The motion is, to the last bit, that of the rod made in Python."""
    found = run(written(folder, rod_scenario()), folder / "out").solution
    load = pl.Load.at_angle("cos(3*t)", "120 deg", weight=0.5, weight_angle=math.pi / 2)
    rod = pl.Rod(
        pl.catalogue.material("one-shape"),
        load,
        pl.Grid(nodes=6),
        natural_segments=(0.0, 0.3, 1.0),
        translational_inertia=0.3,
        rotary_inertia=0.001,
        damping=0.05,
    )
    due = pl.solve(rod, "0.2*(1 - s)", [0.2, -0.1], until=0.5, rtol=1e-6, curvature_rate="s")
    assert np.array_equal(found.history.y, due.history.y)
    assert found.model == rod


def test_a_scenario_is_the_call_that_it_describes(tmp_path: Path) -> None:
    check_it_is_the_call(tmp_path)


def check_units_change_nothing(folder: Path) -> None:
    """The same rod in SI, with mass per length and rotary inertia, and in numbers: one dimensionless motion."""
    length, stiffness, time = 0.25, 0.035, 120.0
    mass, rotary = 0.3 * stiffness * time**2 / length**4, 0.001 * stiffness * time**2 / length**2
    force, weight = stiffness / length**2, 0.5 * stiffness / length**3
    text = si_scenario(
        inertia=f'mass_per_length = "{mass!r} kg/m"\nrotary_inertia = "{rotary!r} kg*m"',
        load=f'force = "{force!r} N"\nangle = "120 deg"\nweight = "{weight!r} N/m"\nweight_angle = "90 deg"',
        initial=f'curvature = "0.8*(1 - s/0.25)"\nnatural_curvature = ["0.8 1/m", "-0.4 1/m"]\n'
        f'curvature_rate = {{ pieces = ["{1 / length / time!r} 1/(m*s)", "s/{length**2 * time!r}"], '
        'breaks = ["50 mm"] }',
        grid='nodes = 6\nnatural_segments = ["75 mm"]',
        solve='until = "1 min"\nrtol = 1e-6',
    )
    plain = rod_scenario(
        inertia="translational_inertia = 0.3\nrotary_inertia = 0.001",
        load='force = 1.0\nangle = "120 deg"\nweight = 0.5\nweight_angle = "90 deg"',
        initial=START.replace('"s"', '{ pieces = [1.0, "s"], breaks = [0.2] }'),
    )
    si = run(written(folder, text, "si.toml"), folder / "si").solution
    due = run(written(folder, plain), folder / "plain").solution
    t = np.linspace(0.0, 0.5, 11)
    assert si.model.grid.breaks == pytest.approx(due.model.grid.breaks, abs=4 * EPS)
    difference = np.abs(si.history(t) - due.history(t)).max()
    assert difference <= 100.0 * due.rtol * np.abs(due.history.y).max()


def test_units_change_nothing(tmp_path: Path) -> None:
    check_units_change_nothing(tmp_path)


def test_a_density_and_a_section_are_a_mass(tmp_path: Path) -> None:
    text = si_scenario(specimen=STEEL, inertia='density = "7850 kg/m**3"\ndamping = 0', solve='until = "1 ms"')
    specimen = read_scenario(written(tmp_path, text)).model.specimen
    assert specimen is not None
    area = math.pi * 0.0015**2
    assert abs(specimen.inertia.mass - 7850.0 * area) <= 8 * EPS * specimen.inertia.mass
    model = read_scenario(written(tmp_path, text)).model
    assert isinstance(model, pl.Rod)
    assert (model.damping, model.translational_inertia) == (0.0, 1.0)
    assert model.rotary_inertia == pytest.approx((0.0015 / 2.0 / 0.3) ** 2, rel=16 * EPS)


def test_without_the_section_it_is_a_strut(tmp_path: Path) -> None:
    model = read_scenario(written(tmp_path, scenario(grid="nodes = 6\nnatural_segments = 3"))).model
    assert isinstance(model, pl.Strut)
    assert model.segments == 3


def test_a_force_may_be_a_program(tmp_path: Path) -> None:
    program = '{ program = "cycles", low = -1.0, high = 2.0, period = 0.3, count = 2, shape = "sine" }'
    load = read_scenario(written(tmp_path, scenario(load=f'force = {program}\nangle = "-90 deg"'))).model.load
    assert load.transverse == pl.programs.cycles(1.0, -2.0, 0.3, 2, shape="sine")
    assert load.thrust == pl.programs.constant(0.0)


def test_tension_by_name(tmp_path: Path) -> None:
    load = read_scenario(written(tmp_path, scenario(load='thrust = "-t"\nallow_tension = true'))).model.load
    assert load.thrust(2.0) == -2.0
    with pytest.raises(ScenarioError, match=r"load\.thrust.*allow_tension"):
        read_scenario(written(tmp_path, scenario(load='thrust = "-t"')))


# -- mistakes ------------------------------------------------------------------------------------------------------


def check_all_mistakes_at_once(folder: Path) -> None:
    text = """units = "SI"
[specimen]
length = "300 mm"
bending_stiffness = "0.35 N*m**2"
[inertia]
density = 7850
translational_inertia = 1.0
damping = 1
[material]
name = "one-shape"
[load]
thrust = "3 N"
force = "1 N"
weight = "-1 N/m"
weight_angle = "400 deg"
[initial]
curvature_rate = "2 1/m"
natural_curvature = ["1 1/m",
  2]
[grid]
natural_segments = "all"
[solve]
until = "1 s"
"""
    keys = [
        (6, "inertia.density"),
        (7, "inertia.translational_inertia"),
        (8, "inertia.damping"),
        (11, "load.angle"),
        (12, "load.thrust"),
        (14, "load.weight"),
        (15, "load.weight_angle"),
        (17, "initial.curvature_rate"),
        (19, "initial.natural_curvature[1]"),
        (21, "grid.natural_segments"),
    ]
    with pytest.raises(ScenarioError) as caught:
        read_scenario(written(folder, text))
    found = [sentence[: sentence.index("` ") + 1] for sentence in caught.value.problems]
    assert found == [f"line {line}: `{key}`" for line, key in keys]


def test_all_mistakes_at_once(tmp_path: Path) -> None:
    check_all_mistakes_at_once(tmp_path)


MEANINGLESS = {
    "inertia.damping": ({"inertia": 'mass_per_length = "1 kg/m"\ndamping = 0'}, "beside the `retardation_time`"),
    "specimen.retardation_time": ({"specimen": STEEL}, "mass of a rod without damping"),
    "initial.curvature_rate": ({"initial": RATE}, "needs a rod with inertia"),
    "solve.until": (
        {"specimen": STEEL, "inertia": 'mass_per_length = "1 kg/m"', "solve": 'until = "equilibrium"'},
        "swings for ever",
    ),
    "inertia": ({"inertia": ""}, "must say what mass the rod has"),
    "load.weight_angle": (
        {"load": 'weight = "1 N/m"\nweight_angle = "90 mm"'},
        "must be an angle, such as \"30 deg\", or a number in rad, but is '90 mm'",
    ),
    "grid.natural_segments[1]": (
        {"grid": 'nodes = 6\nnatural_segments = ["200 mm", "100 mm"]'},
        "must lie beyond the place before it, '200 mm', but is '100 mm'",
    ),
    "initial.natural_curvature": (
        {"initial": 'natural_curvature = ["0 1/m", "0.1 1/m"]'},
        "must be one number for a rod of one segment",
    ),
}


def check_meaningless(folder: Path, key: str) -> None:
    """What has no meaning for a rod of its kind is refused at the key that is at fault, in one sentence."""
    parts, words = MEANINGLESS[key]
    with pytest.raises(ScenarioError) as caught:
        read_scenario(written(folder, si_scenario(**parts)))
    (sentence,) = caught.value.problems
    assert f"`{key}` " in sentence
    assert words in sentence


@pytest.mark.parametrize("key", MEANINGLESS)
def test_what_has_no_meaning_is_refused(key: str, tmp_path: Path) -> None:
    check_meaningless(tmp_path, key)


def test_neither_inertia_nor_damping_is_no_motion(tmp_path: Path) -> None:
    for zeros in ("translational_inertia = 0\ndamping = 0", "rotary_inertia = 0.0\ndamping = 0.0"):
        with pytest.raises(ScenarioError, match="no equation of motion"):
            read_scenario(written(tmp_path, scenario(inertia=zeros)))
    assert read_scenario(written(tmp_path, scenario(inertia="rotary_inertia = 0.0"))).model.damping == 1.0


def test_a_mistake_in_a_force_is_told_of_the_force(tmp_path: Path) -> None:
    for force in ('"1/(0.3 - t)"', "1e9"):
        with pytest.raises(ScenarioError) as caught:
            read_scenario(written(tmp_path, scenario(load=f"force = {force}\nangle = 1.0")))
        assert all("`load.force` " in sentence for sentence in caught.value.problems)


# -- the commands --------------------------------------------------------------------------------------------------


def test_check_tells_the_numbers_of_the_rod(tmp_path: Path) -> None:
    answer = call("check", written(tmp_path, rod_scenario()), "--json")
    groups = json.loads(answer.out)["groups"]
    assert [groups[name] for name in ("translational_inertia", "rotary_inertia", "damping")] == [0.3, 0.001, 0.05]
    assert groups["natural_curvature_times_L"] == [0.2, -0.1]
    plan = json.loads(answer.out)["plan"]
    assert (plan["retardation_times"], plan["time_units"]) == (None, 0.5)
    words = call("check", written(tmp_path, rod_scenario())).out
    assert "rotary inertia ρJL²/(EIT²)" in words
    assert "0.2, -0.1" in words


LARGEST = {
    'force = "cos(3*t)"\nangle = "120 deg"\nweight = 0.5\nweight_angle = "90 deg"': (
        {"thrust": -0.5, "transverse": math.sin(math.pi / 1.5), "weight": 0.5},
        {"largest tension, in EI/L²": "0.5", "largest transverse force, in EI/L²": "0.866"},
    ),
    'couple = { program = "cycles", low = -2.0, high = 1.0, period = 0.1, count = 1 }': (
        {"thrust": 0.0, "couple": 2.0},
        {"largest couple, in EI/L": "2"},
    ),
    "thrust = 2.0\nweight = 1.5": (
        {"thrust": 2.0, "weight": 1.5},
        {"largest thrust, in EI/L²": "2", "Euler loads π²/4": "0.8106", "largest weight per length, in EI/L³": "1.5"},
    ),
}


def check_largest_loads(folder: Path) -> None:
    """Every load that acts is told at its largest, a pull as a pull; of an absent thrust nothing is said."""
    for load, (groups, words) in LARGEST.items():
        file = written(folder, rod_scenario(load=load))
        told = json.loads(call("check", file, "--json").out)["groups"]
        scales = {"thrust": "EI_per_L2", "transverse": "EI_per_L2", "couple": "EI_per_L", "weight": "EI_per_L3"}
        for name, scale in scales.items():
            found = told.get(f"{name}_over_{scale}")
            assert (found is None) == (name not in groups)
            assert found is None or abs(found - groups[name]) <= 4 * EPS * abs(groups[name])
        rows = [line.strip() for line in call("check", file).out.splitlines()]
        for name, value in words.items():
            assert any(name in line and line.endswith(f" {value}") for line in rows), (name, rows)
        assert any("largest thrust" in line for line in rows) == (groups["thrust"] > 0.0)


def test_check_tells_the_largest_loads(tmp_path: Path) -> None:
    check_largest_loads(tmp_path)


def test_parameters_are_told_with_six_digits(tmp_path: Path) -> None:
    given = 'name = "one-shape"\nparameters = { k = "0.12300000000000003 N*m**2", h = "1.23456789 N*m**2" }'
    words = call("check", written(tmp_path, si_scenario(material=given))).out
    assert " 0.123 N*m**2" in words
    assert " 1.23457 N*m**2" in words


def test_run_and_show_tell_how_it_swings(tmp_path: Path) -> None:
    file = written(tmp_path, rod_scenario(output='film = "none"\nreport = false\ncsv = ["natural_curvature"]'))
    answer = call("run", file, "--output", tmp_path / "out", "--json")
    assert answer.code == 0
    facts = json.loads(answer.out)
    solution = pl.read(tmp_path / "out" / "strut.nc")
    data = solution.dataset
    assert facts["kinetic_energy"]["largest"] == float(data.kinetic_energy.max())
    assert facts["clamp"]["largest_couple"] == float(np.abs(data.clamp_couple).max())
    assert facts["natural_curvature"]["end"] == data.natural_curvature.values[-1].tolist()
    assert facts["ledger"]["kinetic_energy"] == solution.ledger.kinetic_energy
    shown = call("show", tmp_path / "out" / "strut.nc").out
    assert "on the clamp" in shown
    assert "kinetic energy" in shown


def check_export_by_segment(folder: Path) -> None:
    """One row for each time and segment, as the dataset has them."""
    run(written(folder, rod_scenario()), folder / "out")
    result = folder / "out" / "strut.nc"
    data = pl.read(result).dataset
    rows = list(csv.reader(call("export", result, "natural_curvature", "tip_y").out.splitlines()))
    assert rows[0] == ["t [1]", "segment [1]", "natural_curvature [1]", "tip_y [1]"]
    table = np.array(rows[1:], dtype=float).reshape(data.sizes["t"], 2, 4)
    assert np.array_equal(table[:, :, 1], np.broadcast_to([1.0, 2.0], table.shape[:2]))
    assert np.array_equal(table[:, :, 2], data.natural_curvature.values)
    assert np.array_equal(table[:, 1, 3], data.tip_y.values)


def test_export_by_segment(tmp_path: Path) -> None:
    check_export_by_segment(tmp_path)
    answer = call("export", tmp_path / "out" / "strut.nc", "natural_curvature", "curvature")
    assert answer.code == 2
    assert "one by one" in answer.err


def test_variables_of_a_rod_are_for_rods(tmp_path: Path) -> None:
    output = 'csv = ["kinetic_energy", "clamp_force_x"]'
    assert read_scenario(written(tmp_path, rod_scenario(output=output))).output.csv
    with pytest.raises(ScenarioError, match=r"output\.csv\[0\]"):
        read_scenario(written(tmp_path, scenario(output=output)))


def test_equilibria_are_those_of_one_natural_curvature(tmp_path: Path) -> None:
    answer = call("equilibria", written(tmp_path, scenario(grid="nodes = 6\nnatural_segments = 2")))
    assert answer.code == 2
    assert "grid.natural_segments` must be 1" in answer.err


def test_rates_are_those_of_a_rod_without_inertia(tmp_path: Path) -> None:
    file = written(tmp_path, scenario(inertia="translational_inertia = 0.1"))
    assert call("equilibria", file).code == 0
    answer = call("spectrum", file, "--alpha", "1.0")
    assert answer.code == 2
    assert "inertia` must be left out" in answer.err
