"""Claim: the loads of a rod are what was written, in any units, and what cannot be is refused at once."""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from plastica.errors import ArgumentError
from plastica.material import catalogue
from plastica.numerics.grid import Grid
from plastica.physics import programs
from plastica.physics.load import LOAD_KINDS, Load
from plastica.physics.polyline import Knot
from plastica.physics.program import Program
from plastica.physics.scales import Scales
from plastica.physics.strut import Strut
from tests.test_programs import EPS, SPECIMEN, UNTIL, everything, size_of, values_on


def check_dimensionless(scales: Scales) -> None:
    """γ = βL²/EI, τL²/EI, m₁L/EI, wL³/EI, t/T (design, section 1.1)."""
    load = Load(thrust=([0, 60, 60], [1, 2, 3]), transverse=-0.5, couple="0.02 N*m", weight="3 N/m")
    L, EI, T = scales.length, scales.stiffness, scales.time
    made = load.dimensionless(scales, si=True)
    assert not made.thrust.has_units
    expected = {"thrust": 1.5 * L**2 / EI, "transverse": -0.5 * L**2 / EI, "couple": 0.02 * L / EI}
    expected["weight"] = 3.0 * L**3 / EI
    for name, value in expected.items():
        assert abs(getattr(made, name)(30.0 / T) - value) <= 16 * EPS * abs(value), name
    (jump,) = made.knots(1e9)[-1:]
    assert abs(jump.t - 60.0 / T) <= 2 * EPS * jump.t


def test_loads_become_dimensionless() -> None:
    check_dimensionless(SPECIMEN.scales)


def test_what_a_load_may_be_given_as() -> None:
    table = ([0, 1], [2.0, 3.0])
    load = Load(thrust=np.float32(2), transverse=table, couple="1 + sin(t)", weight=programs.constant(2))
    assert load.thrust == programs.constant(2.0)
    assert load.transverse == programs.table(*table) == Load(transverse=np.array(table)).transverse
    assert load.couple == programs.expression("1 + sin(t)")
    assert Load("3 N").thrust == programs.constant("3 N")
    assert Load("3").thrust(0.0) == 3.0
    assert Load(thrust=(["0 s", "1 day"], ["0 N", "3 kN"])).thrust(86400.0) == 3000.0
    assert programs.expression("a*t", {"a": "2 kN/s"})(1.0) == 2000.0
    assert [name for name, _ in load.sources()] == list(LOAD_KINDS)
    assert Load(thrust=1.0).sources() == (("thrust", programs.constant(1.0)),)
    assert Load(thrust=1.0).is_constant
    assert not load.is_constant


def test_arrays_without_axes_are_numbers() -> None:
    load = Load(thrust=np.array(3.0), transverse=np.array(2), couple=np.float64(0.5), weight=np.array("1 N/m"))
    assert load == Load(3.0, 2.0, 0.5, "1 N/m")
    assert type(load.thrust(0.0)) is float
    assert Load(thrust=programs.constant(np.array(3.0))) == Load(3.0)  # type: ignore[arg-type]


@settings(deadline=None, max_examples=50, derandomize=True)
@given(st.tuples(everything, everything))
def test_knots_of_a_load_are_those_of_its_programs(given_programs: tuple[Program, Program]) -> None:
    load = Load(0.0, *given_programs)
    knots = load.knots(UNTIL)
    assert all(first.t < second.t for first, second in pairwise(knots))
    for program in given_programs:
        for own in program.knots(UNTIL):
            (same,) = [knot for knot in knots if abs(knot.t - own.t) <= 16 * np.spacing(own.t)]
            assert same.kind == "jump" or own.kind == "slope"
            assert abs(same.size) >= abs(own.size) or same.kind != own.kind
    # Every program can be had between any two neighbours, although knots within rounding were made one.
    for a, b in pairwise(sorted({0.0, UNTIL, *(knot.t for knot in knots)})):
        for program in given_programs:
            middle = 0.5 * (a + b)
            difference = values_on(program, a, b, [middle])[0] - program(middle)
            assert abs(difference) <= 256 * EPS * size_of(program)


def test_a_jump_wins_over_a_slope_within_rounding() -> None:
    third = 1.0 / 3.0
    beside = float(np.nextafter(third, 1.0))
    load = Load(transverse=([0, third], [0, 1]), couple=([beside, beside], [0, 1]))
    assert load.knots(1.0) == (Knot(beside, "jump", 1.0),)
    assert values_on(load.transverse, 0.0, beside, [beside])[0] == pytest.approx(1.0, abs=4 * EPS)
    assert load.transverse.on(beside, 1.0) == 1.0


@settings(deadline=None, max_examples=50, derandomize=True)
@given(st.tuples(everything, everything))
def test_loads_are_stored_and_mirrored(pair: tuple[Program, Program]) -> None:
    load = Load(2.0, *pair)
    assert Load.from_dict(json.loads(json.dumps(load.to_dict()))) == load
    mirrored = load.mirrored()
    assert (mirrored.thrust, mirrored.weight) == (load.thrust, load.weight)
    assert (mirrored.transverse, mirrored.couple) == tuple(each.mirrored() for each in pair)


def test_units_need_a_specimen() -> None:
    for load in (
        Load(thrust="3 N"),
        Load(thrust=programs.ramp_hold_release(3, 0, "1 day", 0)),
        Load(thrust=programs.expression("a*t", {"a": "2 N/s"})),
    ):
        with pytest.raises(ArgumentError, match=r"^`thrust` must be in plain numbers") as caught:
            load.dimensionless(Scales.unit(), si=False)
        assert "specimen" in caught.value.next_step
        assert load.dimensionless(SPECIMEN.scales, si=True).thrust(720.0) >= 0.0
    plain = Load(thrust=3.0)
    assert plain.dimensionless(Scales.unit(), si=False) == plain


def check_force_at_an_angle(degrees: float) -> None:
    """n(1) = F (−cos φ, sin φ): thrust F cos φ, transverse force F sin φ, whatever the program, units kept."""
    phi = math.radians(degrees)
    for force in (3.0, "1 + sin(t)", ([0, 1, 1, 4], [0, 2, -1, 3]), programs.cycles(-1, 2, 0.7, shape="sine")):
        alone = Load(transverse=force).transverse
        for load in (Load.at_angle(force, f"{degrees} deg"), Load.at_angle(force, phi)):
            for t in (0.0, 0.3, 1.0, 2.9):
                f = alone(t)
                assert abs(load.thrust(t) - f * math.cos(phi)) <= 16 * EPS * abs(f)
                assert abs(load.transverse(t) - f * math.sin(phi)) <= 16 * EPS * abs(f)
    held = programs.ramp_hold_release("3 N", 0, "1 day", 0)
    turned = Load.at_angle(held, phi)
    assert all(each.value_unit == "N" for each in (turned.thrust, turned.transverse) if not each.constant)


def check_quarter_turns() -> None:
    """Along an axis nothing is left across it, by a single bit."""
    for quarter, (along, across) in enumerate(((3.0, 0.0), (0.0, 3.0), (-3.0, 0.0), (0.0, -3.0), (3.0, 0.0))):
        for angle in (f"{90 * quarter} deg", 0.5 * math.pi * quarter):
            load = Load.at_angle(3.0, angle)
            assert (load.thrust, load.transverse) == (programs.constant(along), programs.constant(across))
            assert Load(weight=1.0, weight_angle=angle).weight_direction == (-along / 3.0, across / 3.0)


@pytest.mark.parametrize("degrees", [0.0, 30.0, 90.0, 135.0, -60.0, 180.0, 359.0])
def test_a_force_at_an_angle(degrees: float) -> None:
    check_force_at_an_angle(degrees)


def test_quarter_turns_are_exact() -> None:
    check_quarter_turns()


def test_a_force_at_an_angle_stands_beside_the_others() -> None:
    load = Load.at_angle("1 N", "120 deg", couple="0.1 N*m", weight="2 N/m", weight_angle="90 deg")
    assert load.couple == programs.constant("0.1 N*m")
    assert load.weight_direction == (0.0, 1.0)
    assert load.thrust(0.0) == pytest.approx(-0.5, abs=4 * EPS)
    assert load.allow_tension


def check_weight_direction(angle: float) -> None:
    """q = w (−cos ψ, sin ψ): the dead force of the weight beyond s is (1 − s) of it (design, section 1.2)."""
    load = Load(thrust=0.4, transverse=0.2, weight=1.5, weight_angle=angle)
    strut = Strut(catalogue.material("one-shape"), load, Grid(nodes=5))
    along, across = strut.dead_force(0.0)
    arm = 1.5 * (1.0 - strut.grid.s)
    assert np.abs(along - (0.4 + arm * math.cos(angle))).max() <= 8 * EPS
    assert np.abs(across - (0.2 + arm * math.sin(angle))).max() <= 8 * EPS


@pytest.mark.parametrize("angle", [0.0, 0.3, math.pi / 2, 2.5, -1.0])
def test_a_weight_acts_at_its_angle(angle: float) -> None:
    check_weight_direction(angle)


def check_options_are_kept() -> None:
    """Angle and leave for tension survive what is done to loads; the mirror image turns the angle round."""
    load = Load(-1.0, 0.5, weight=-2.0, weight_angle="30 deg", allow_tension=True)
    plain = load.dimensionless(SPECIMEN.scales, si=True)
    assert (plain.weight_angle, plain.allow_tension) == (load.weight_angle, True)
    assert plain.thrust(0.0) < 0.0
    stored = json.loads(json.dumps(load.to_dict()))
    assert Load.from_dict(stored) == load
    assert Load.from_dict(stored) != Load(-1.0, 0.5, weight=-2.0, allow_tension=True)
    mirrored = load.mirrored()
    assert (mirrored.weight_angle, mirrored.allow_tension) == (-load.weight_angle, True)
    assert mirrored.mirrored() == load
    assert load.describe(si=True) == "thrust -1 N; transverse 500 mN; weight -2 N/m at 30 deg"


def test_options_are_kept() -> None:
    check_options_are_kept()


def test_what_was_stored_before_reads_and_writes_alike() -> None:
    old = {name: {"kind": "constant", "value": 1.0} for name in LOAD_KINDS}
    assert Load.from_dict(old).to_dict() == old
    assert Load.from_dict(old) == Load(1.0, 1.0, 1.0, 1.0)


def test_tension_is_for_those_who_ask() -> None:
    for pull in (-1.0, "1 - t", ([0, 1], [1, -1])):
        for name in ("thrust", "weight"):
            Load(**{name: pull}, allow_tension=True).check(10.0)  # type: ignore[arg-type]
            with pytest.raises(ArgumentError, match="allow_tension") as caught:
                Load(**{name: pull}).check(10.0)  # type: ignore[arg-type]
            assert caught.value.where == name


def test_tension_by_rounding_is_none() -> None:
    load = Load(thrust="0.3 - 0.1 - 0.2*cos(t)")
    load.check(100.0)
    with pytest.raises(ArgumentError, match="tension"):
        Load(thrust="0.2 - 0.21*cos(t - 1)").check(100.0)


def test_a_weight_pushes_toward_the_clamp() -> None:
    with pytest.raises(ArgumentError, match=r"`weight` .*a weight pushes toward the clamp.*but is -1\.0"):
        Load(weight=-1)
    Load(weight="0.3 - 0.1 - 0.2*cos(t)").check(100.0)
    Load(weight="1 - t").check(0.5)


def test_loads_settle_with_the_last_of_them() -> None:
    assert Load(thrust=3.0).settled == 0.0
    assert Load(thrust=([0, 2, 2], [1, 1, 0]), couple=programs.cycles(0, 1, 2.0, 3)).settled == 6.0
    assert Load(thrust=([0, 2], [1, 0]), couple=programs.cycles(0, 1, 2.0)).settled is None


def test_loads_in_words() -> None:
    held = programs.ramp_hold_release("3 N", 0, "1 day", 0)
    assert Load().describe(si=True) == "no load"
    assert Load(thrust=held, couple=0.25).describe(si=True) == (
        "thrust 3 N held for 1 day, then released; couple 250 mN*m"
    )


BAD: list[tuple[str, Callable[[], Any]]] = [
    ("weight_angle", lambda: Load(weight_angle=30)),
    ("weight_angle", lambda: Load(weight_angle="400 deg")),
    ("weight_angle", lambda: Load(weight_angle="30 deg/m")),
    ("weight_angle", lambda: Load(weight_angle=math.nan)),
    ("weight_angle", lambda: Load(weight_angle=None)),  # type: ignore[arg-type]
    ("weight_angle", lambda: Load(weight_angle=True)),
    ("weight_angle", lambda: Load.from_dict({"weight_angle": "x"})),
    ("allow_tension", lambda: Load(allow_tension=1)),  # type: ignore[arg-type]
    ("allow_tension", lambda: Load.from_dict({"allow_tension": "yes"})),
    ("angle", lambda: Load.at_angle(1.0, 45)),
    ("angle", lambda: Load.at_angle(1.0, "45 N")),
    ("force", lambda: Load.at_angle("3 m", 0.0)),
    ("force", lambda: Load.at_angle("3 N*m", 0.0)),
    ("force", lambda: Load.at_angle(math.inf, 0.0)),
    ("thrust", lambda: Load.at_angle(1.0, 0.0, thrust=1.0)),
    ("transverse", lambda: Load.at_angle(1.0, 0.0, transverse=1.0)),
    ("allow_tension", lambda: Load.at_angle(1.0, 0.0, allow_tension=False)),
    ("thrust", lambda: Load(thrust=-1.0)),
    ("thrust", lambda: Load(thrust=([0, 1], [1, -1e-3]))),
    ("thrust", lambda: Load(thrust=programs.cycles(0, -1, 1))),
    ("thrust", lambda: Load(thrust="-1 - t").check(1.0)),
    ("thrust", lambda: Load(thrust="1 - pi")),
    ("thrust", lambda: Load(thrust="sin(t)").check(10.0)),
    ("weight", lambda: Load(weight=-1e-3)),
    ("weight", lambda: Load(weight=([0, 1], [1, -1e-3]))),
    ("weight", lambda: Load(weight="1 - t").check(2.0)),
    ("couple", lambda: Load(couple=np.array(True))),
    ("couple", lambda: Load(couple=np.array("one"))),
    ("couple", lambda: Load(couple=np.array(math.nan))),
    ("thrust", lambda: Load(thrust="3 N*m")),
    ("thrust", lambda: Load(thrust="3 kg")),
    ("thrust", lambda: Load(thrust="nan")),
    ("thrust", lambda: Load(thrust="3 parsecs*lightyears")),
    ("thrust", lambda: Load(thrust="__import__('os')")),
    ("thrust", lambda: Load(thrust="9**9**9")),
    ("thrust", lambda: Load(thrust="step(sin(t))")),
    ("thrust", lambda: Load(thrust="")),
    ("thrust", lambda: Load(thrust="s")),
    ("couple", lambda: Load(couple=math.nan)),
    ("couple", lambda: Load(couple=math.inf)),
    ("couple", lambda: Load(couple=10**400)),
    ("couple", lambda: Load(couple=True)),
    ("couple", lambda: Load(couple=None)),
    ("couple", lambda: Load(couple={})),
    ("couple", lambda: Load(couple=1j)),
    ("couple", lambda: Load(couple=[1.0, 2.0, 3.0])),
    ("couple", lambda: Load(couple="3 N")),
    ("couple.times", lambda: Load(couple=(1.0, 2.0))),
    ("couple.times", lambda: Load(couple=([1, 0], [0, 1]))),
    ("couple.times", lambda: Load(couple=([0, 1, 1, 1], [0, 1, 2, 3]))),
    ("couple.times", lambda: Load(couple=([1.0, 1.0 + EPS], [0, 1]))),
    ("couple.times", lambda: Load(couple=([], []))),
    ("couple.times", lambda: Load(couple=(np.zeros((2, 2)), [0, 1]))),
    ("couple.times[1]", lambda: Load(couple=([0, math.nan], [0, 1]))),
    ("couple.times", lambda: Load(couple=([0.0, math.inf], [0, 1]))),
    ("couple.times[1]", lambda: Load(couple=([0, "1 N"], [0, 1]))),
    ("couple.times[0]", lambda: Load(couple=(["0", 1], [0, 1]))),
    ("couple.values", lambda: Load(couple=([0, 1], [0]))),
    ("couple.values", lambda: Load(couple=([0, 1], [0.0, math.nan]))),
    ("couple.values", lambda: Load(couple=([0, 1e-320], [0, 1e300]))),
    ("couple.values[1]", lambda: Load(couple=([0, 1], [0, [1]]))),
    ("couple.values[1]", lambda: Load(couple=([0, 1], ["1 N", "1 N*m"]))),
    ("couple.values", lambda: Load(couple=([0, 1], "01"))),
    ("weight", lambda: Load(weight="1/t").check(1.0)),
    ("weight", lambda: Load(weight="exp(t)").check(1e4)),
    ("weight", lambda: Load(weight=programs.cycles(0, 1, 1e-3)).knots(1e5)),
    ("times", lambda: programs.table(np.zeros(1_000_001), np.zeros(1_000_001))),
    ("period", lambda: programs.cycles(0, 1, 0.0)),
    ("period", lambda: programs.cycles(0, 1, -1.0)),
    ("period", lambda: programs.cycles(0, 1, 1.0, start=1e15)),
    ("period", lambda: programs.cycles(0, 1, 1e308)),
    ("period", lambda: programs.cycles(0, 1, "1 mm")),
    ("period", lambda: programs.cycles(0, 1, 0.0, shape="sine")),
    ("high", lambda: programs.cycles(0, 1e300, 1e-20)),
    ("start", lambda: programs.cycles(0, 1, 1.0, start=-1.0)),
    ("count", lambda: programs.cycles(0, 1, 1.0, 0)),
    ("count", lambda: programs.cycles(0, 1, 1.0, 10**9)),
    ("count", lambda: programs.cycles(0, 1, 1.0, 10**400)),
    ("count", lambda: programs.cycles(0, 1, 1.0, 1.5)),  # type: ignore[arg-type]
    ("count", lambda: programs.cycles(0, 1, 1.0, True)),
    ("shape", lambda: programs.cycles(0, 1, 1.0, shape="sawtooth")),
    ("shape", lambda: programs.cycles(0, 1, 1.0, shape=[])),  # type: ignore[arg-type]
    ("ramp", lambda: programs.ramp_hold_release(1, -1, 1, 1)),
    ("hold", lambda: programs.ramp_hold_release(1, 0, 0, 0)),
    ("hold", lambda: programs.ramp_hold_release(1, 0, math.inf, 0)),
    ("hold", lambda: programs.ramp_hold_release(1, 0, "1", 0)),
    ("hold", lambda: programs.ramp_hold_release(1, 1e308, 1e308, 1e308)),
    ("rest", lambda: programs.ramp_hold_release(1, 0, 1, 0, rest=math.nan)),
    ("value", lambda: programs.constant("3")),
    ("value", lambda: programs.constant("3 m")),
    ("text", lambda: programs.expression("a*t", {"a": 1, "exp": 2})),
    ("parameters", lambda: programs.expression("a*t", [1])),  # type: ignore[arg-type]
    ("parameters.a", lambda: programs.expression("a*t", {"a": math.inf})),
    ("parameters.a", lambda: programs.expression("a*t", {"a": "1 zorkmid"})),
    ("text", lambda: programs.expression(3)),  # type: ignore[arg-type]
    ("program", lambda: programs.from_dict(3)),
    ("program", lambda: programs.from_dict({"kind": "os.system"})),
    ("program", lambda: programs.from_dict({"kind": ["table"]})),
    ("program", lambda: programs.from_dict({"kind": "constant"})),
    ("program", lambda: programs.from_dict({"kind": "constant", "value": 1.0, "other": 2})),
    ("value", lambda: programs.from_dict({"kind": "constant", "value": "3"})),
    ("value", lambda: programs.from_dict({"kind": "constant", "value": math.nan})),
    ("units", lambda: programs.from_dict({"kind": "constant", "value": 3.0, "value_unit": "kg"})),
    ("units", lambda: programs.from_dict({"kind": "constant", "value": 3.0, "time_unit": ["s"]})),
    ("times", lambda: programs.from_dict({"kind": "table", "times": [0.0, "1"], "values": [0.0, 1.0]})),
    ("times", lambda: programs.from_dict({"kind": "table", "times": 3, "values": [0.0, 1.0]})),
    ("parameters", lambda: programs.from_dict({"kind": "text", "text": "t", "parameters": [["a"]]})),
    ("program", lambda: programs.from_dict({"kind": "text", "text": "t", "parameters": 3})),
    ("time_scale", lambda: programs.from_dict({"kind": "text", "text": "t", "time_scale": -1.0})),
    ("load", lambda: Load.from_dict([])),
    ("load", lambda: Load.from_dict({"push": {"kind": "constant", "value": 1.0}})),
    ("thrust.value", lambda: Load.from_dict({"thrust": {"kind": "constant", "value": True}})),
    ("thrust", lambda: Load.from_dict({"thrust": 3.0})),
]


@pytest.mark.parametrize(("where", "make"), BAD)
def test_a_wrong_load_is_refused_with_its_argument_named(where: str, make: Callable[[], Any]) -> None:
    with pytest.raises(ArgumentError) as caught:
        make()
    assert caught.value.where.removesuffix(".value") == where.removesuffix(".value")
    assert str(caught.value).startswith(f"`{caught.value.where}` must ")
    assert len(str(caught.value)) < 600
