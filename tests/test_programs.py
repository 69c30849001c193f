"""Claim: a load program is what was written, with its jumps where they are, to the last digit (design, section 4)."""

from __future__ import annotations

import json
import math
import pickle
from fractions import Fraction
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from plastica.errors import ArgumentError
from plastica.physics import programs
from plastica.physics.polyline import Knot
from plastica.physics.program import Program
from plastica.physics.scales import Specimen

EPS = float(np.finfo(float).eps)
UNTIL = 20.0
SPECIMEN = Specimen(length="250 mm", bending_stiffness=0.035, retardation_time="120 s")

# Multiples of 1/8 in time: exact in floats, so that the references below are exact, too.
times = st.integers(0, 200).map(lambda n: n / 8)
positive_times = st.integers(1, 200).map(lambda n: n / 8)
values = st.one_of(st.just(0.0), st.floats(-1e3, 1e3, allow_subnormal=False))


@st.composite
def rows(draw: st.DrawFn) -> tuple[list[float], list[float]]:
    distinct = sorted(draw(st.lists(times, min_size=1, max_size=8, unique=True)))
    doubled = [t for t in distinct for _ in range(draw(st.integers(1, 2)))]
    return doubled, draw(st.lists(values, min_size=len(doubled), max_size=len(doubled)))


tables = rows().map(lambda pair: programs.table(*pair))
ramps = st.builds(programs.ramp_hold_release, values, times, positive_times, times, start=times, rest=values)
straight_cycles = st.builds(
    programs.cycles,
    values,
    values,
    positive_times,
    st.one_of(st.none(), st.integers(1, 9)),
    st.sampled_from(["triangle", "square", "trapezoid"]),
    start=times,
)
sines = st.builds(
    programs.cycles,
    values,
    values,
    st.floats(0.7, 9.0),
    st.one_of(st.none(), st.integers(1, 9)),
    st.just("sine"),
    start=st.floats(0, 9),
)
texts = st.builds(
    lambda template, a, b: programs.expression(template, {"a": a, "b": b}),
    st.sampled_from(
        [
            "a*step(t - b)",
            "a*t*step(3*t - b) + cos(t)",
            "a + b*exp(-t)",
            "a*pos(t - b) - abs(t - 2*b)",
            "a*(step(t - b) - step(t - b - 1/3))*sin(7*t)",
            "step(b - t)*(a + t)",
        ]
    ),
    st.floats(-9, 9),
    st.floats(0.1, 9),
)
polygonal = st.one_of(values.map(programs.constant), tables, ramps, straight_cycles)
everything = st.one_of(polygonal, sines, texts)


def size_of(program: Program) -> float:
    return max(map(abs, program.extreme(UNTIL))) + 8.0 * UNTIL * abs(np.subtract(*program.extreme(UNTIL)))


def jumps_of(program: Program) -> list[float]:
    return [knot.t for knot in program.knots(UNTIL) if knot.kind == "jump"]


def values_on(program: Program, a: float, b: float, t: list[float]) -> list[float]:
    piece = program.on(a, b)
    return [piece if isinstance(piece, float) else piece(each) for each in t]


def check_pieces(program: Program) -> None:
    """Between jumps `on` is the program, with its right limit at the beginning and its left limit at the end."""
    tolerance = 256 * EPS * size_of(program)
    for a, b in pairwise(sorted({0.0, UNTIL, *jumps_of(program)})):
        inside = [a + (b - a) * share for share in (0.1, 0.37, 0.5, 0.93)]
        found = values_on(program, a, b, [a, *inside, b])
        expected = [program(a), *(program(t) for t in inside), program.before(b)]
        assert np.abs(np.subtract(found, expected)).max() <= tolerance, (program, a, b)


def check_knots(program: Program) -> None:
    """Knots are in order and in (0, until], jumps have their size, and all other times are continuous."""
    knots = program.knots(UNTIL)
    tolerance = 256 * EPS * size_of(program)
    assert all(0.0 < knot.t <= UNTIL for knot in knots)
    assert all(first.t < second.t for first, second in pairwise(knots))
    for knot in knots:
        rise = program(knot.t) - program.before(knot.t)
        assert abs(rise - (knot.size if knot.kind == "jump" else 0.0)) <= tolerance
        assert knot.size != 0.0
    jumps = jumps_of(program)
    for t in np.linspace(0.0, UNTIL, 161):
        if t > 0.0 and float(t) not in jumps:
            assert abs(program(float(t)) - program.before(float(t))) <= tolerance


def walk(program: Program, steps: int) -> list[float]:
    """Return the values that the program takes one after another: a fine walk through all pieces."""
    path = [program(0.0)]
    for a, b in pairwise(sorted({0.0, UNTIL, *(knot.t for knot in program.knots(UNTIL))})):
        path += values_on(program, a, b, list(np.linspace(a, b, steps)))
    return [*path, program(UNTIL)]


def check_variation(program: Program, steps: int = 2, surplus: float = 0.0) -> None:
    """The variation is that of a walk through all pieces: the same where exact, never less."""
    brute = math.fsum(np.abs(np.diff(walk(program, steps))))
    tolerance = 4096 * EPS * size_of(program)
    assert brute - tolerance <= program.variation(UNTIL) <= brute * (1.0 + surplus) + tolerance + surplus


def check_extreme(program: Program, steps: int = 2) -> None:
    path = walk(program, steps)
    least, greatest = program.extreme(UNTIL)
    tolerance = 256 * EPS * size_of(program)
    assert least <= min(path) + tolerance
    assert max(path) <= greatest + tolerance


def check_scaled(program: Program, time: float, value: float) -> None:
    """p̄(t̄) = p(t̄·time)/value, jumps and all."""
    scaled = program.scaled(time, value)
    assert scaled.scaled(1.0, 1.0) == scaled
    until = UNTIL / time
    before = [knot for knot in program.knots(UNTIL) if knot.kind == "jump"]
    after = [knot for knot in scaled.knots(until * (1 + 4 * EPS)) if knot.kind == "jump"]
    tolerance = 1024 * EPS * size_of(program)
    for old, new in zip(before, after, strict=True):
        assert abs(new.t * time - old.t) <= 4 * EPS * old.t
        assert abs(new.size * value - old.size) <= tolerance
    for a, b in pairwise(sorted({0.0, UNTIL, *(knot.t for knot in before)})):
        t = a + 0.4 * (b - a)
        assert abs(scaled(t / time) * value - program(t)) <= tolerance


def check_stored(program: Program) -> None:
    copy = programs.from_dict(json.loads(json.dumps(program.to_dict())))
    assert copy == program
    assert type(copy) is type(program)
    assert copy(1.23) == program(1.23)
    assert pickle.loads(pickle.dumps(program)) == program  # noqa: S301


def check_mirrored(program: Program) -> None:
    t = np.linspace(0.0, UNTIL, 50)
    assert np.array_equal(program.mirrored()(t), -program(t))
    assert program.mirrored().mirrored() == program


def exact_table(t: list[float], v: list[float], at: float) -> Fraction:
    """Evaluate a table in exact arithmetic, straight from its meaning."""
    after = [i for i, time in enumerate(t) if time <= at]
    if not after:
        return Fraction(v[0])
    if after[-1] == len(t) - 1:
        return Fraction(v[-1])
    i = after[-1]
    share = (Fraction(at) - Fraction(t[i])) / (Fraction(t[i + 1]) - Fraction(t[i]))
    return Fraction(v[i]) + share * (Fraction(v[i + 1]) - Fraction(v[i]))


def exact_cycle(shape: str, phase: Fraction) -> Fraction:
    if shape == "square":
        return Fraction(int(phase < Fraction(1, 2)))
    if shape == "triangle":
        return 2 * min(phase, 1 - phase)
    return max(min(4 * phase, Fraction(1), 3 - 4 * phase), Fraction(0))


PROPERTY = settings(deadline=None, max_examples=100, derandomize=True)


@PROPERTY
@given(everything)
def test_pieces_are_the_program_with_one_sided_limits(program: Program) -> None:
    check_pieces(program)


@PROPERTY
@given(everything)
def test_knots_are_all_the_jumps_there_are(program: Program) -> None:
    check_knots(program)


@PROPERTY
@given(texts)
def test_texts_are_cut_at_their_jumps(program: Program) -> None:
    check_pieces(program)
    check_knots(program)
    check_stored(program)


@PROPERTY
@given(polygonal)
def test_variation_and_extremes_are_exact_for_straight_pieces(program: Program) -> None:
    check_variation(program)
    check_extreme(program)


@settings(deadline=None, max_examples=30, derandomize=True)
@given(st.one_of(sines, texts))
def test_variation_of_curves_is_never_too_small_nor_much_too_large(program: Program) -> None:
    check_variation(program, steps=4001, surplus=0.03)
    check_extreme(program, steps=4001)


@PROPERTY
@given(everything, st.sampled_from([0.1, 1.0, 3.0, 120.0, 86400.0]), st.sampled_from([-0.7, 1.0, 0.035 / 0.25**2]))
def test_scaled_programs_are_the_same_in_other_units(program: Program, time: float, value: float) -> None:
    check_scaled(program, time, value)


@PROPERTY
@given(everything)
def test_stored_and_mirrored_programs_are_equal_bit_by_bit(program: Program) -> None:
    check_stored(program)
    check_mirrored(program)


@PROPERTY
@given(rows(), st.lists(times, min_size=1, max_size=9))
def test_tables_agree_with_exact_arithmetic(pair: tuple[list[float], list[float]], at: list[float]) -> None:
    program = programs.table(*pair)
    exact = [float(exact_table(*pair, each)) for each in at]
    scale = max(map(abs, pair[1]))
    assert np.abs(program(np.array(at)) - exact).max() <= 8 * EPS * scale
    assert [program(each) for each in at] == list(program(np.array(at)))
    # At its own rows a table gives back what was written, bit by bit.
    t, v = np.array(pair[0]), np.array(pair[1])
    assert np.array_equal(program(t), v[np.searchsorted(t, t, side="right") - 1])
    assert np.array_equal(program.before(t), v[np.searchsorted(t, t, side="left")])


@PROPERTY
@given(
    st.sampled_from(["triangle", "square", "trapezoid"]),
    st.integers(1, 40),
    st.one_of(st.none(), st.integers(1, 5)),
    st.integers(0, 40),
    st.lists(times, min_size=1, max_size=9),
)
def test_cycles_agree_with_exact_arithmetic(
    shape: str, period: int, count: int | None, start: int, at: list[float]
) -> None:
    program = programs.cycles(-1.0, 3.0, period / 8, count, shape, start=start / 8)
    for t in at:
        waves = (Fraction(t) - Fraction(start, 8)) / Fraction(period, 8)
        inside = waves >= 0 and (count is None or waves < count)
        expected = -1 + 4 * exact_cycle(shape, waves % 1) if inside else Fraction(-1)
        assert abs(program(t) - float(expected)) <= 64 * EPS


def test_one_sided_limits_at_a_jump_are_exact() -> None:
    held = programs.ramp_hold_release(3.0, 0.0, 10.0, 0.0)
    assert held(0.0) == 3.0
    assert held.knots(1e9) == (Knot(10.0, "jump", -3.0),)
    assert (held.before(10.0), held(10.0)) == (3.0, 0.0)
    assert (held.on(0.0, 10.0), held.on(10.0, 1e9)) == (3.0, 0.0)
    third = programs.expression("3*step(3*t - 1)")
    jump = third.knots(1.0)[0].t
    assert (third.before(jump), third(jump), third.on(0.0, jump), third.on(jump, 1.0)) == (0.0, 3.0, 0.0, 3.0)


def test_square_cycles_jump_at_every_half_period_and_rest_after_the_last() -> None:
    square = programs.cycles(0.0, 3.0, 0.2, 3, "square")
    knots = square.knots(100.0)
    assert [knot.size for knot in knots] == [-3.0, 3.0, -3.0, 3.0, -3.0]
    assert np.abs(np.array([knot.t for knot in knots]) - np.arange(1, 6) * 0.1).max() <= 4 * EPS
    assert square.variation(100.0) == 15.0
    assert square.extreme(math.inf) == (0.0, 3.0)
    assert square(np.array([0.7, 1e9])).tolist() == [0.0, 0.0]


def test_a_jump_inside_an_interval_is_refused() -> None:
    for program in (programs.table([0, 1, 1], [0, 1, 3]), programs.expression("step(t - 1)")):
        with pytest.raises(ArgumentError, match="no jump inside"):
            program.on(0.5, 1.5)


def test_a_step_that_is_multiplied_away_is_no_jump() -> None:
    smooth = programs.expression("(t - 1)*step(t - 1)")
    assert smooth.knots(5.0) == (Knot(1.0, "slope", 1.0),)
    assert values_on(smooth, 0.0, 5.0, [0.5, 3.0]) == [0.0, 2.0]
    once = programs.expression("step(t - 0.3) + step(t - 0.1 - 0.2)")
    assert [(knot.kind, knot.size) for knot in once.knots(5.0)] == [("jump", 2.0)]


def test_rows_in_line_make_no_knots() -> None:
    t = np.arange(2000) * 0.1
    assert programs.table(t, 3.0 * t).knots(190.0) == ()


def test_a_million_rows_are_read_and_evaluated_quickly_but_not_landed_on() -> None:
    t = np.arange(1_000_000) * 0.5
    rough = programs.table(t, np.where(np.arange(len(t)) % 2, 1.0, 0.0))
    assert rough(0.25) == 0.5
    assert rough.variation(10.0) == 20.0
    with pytest.raises(ArgumentError, match="at most 100000 jumps"):
        rough.knots(1e6)
    assert len(rough.knots(100.0)) == 200


def test_programs_constant_or_not() -> None:
    assert programs.constant(3).constant
    assert programs.table([-5, -1, 2], [1, 3, 3]).constant
    assert programs.expression("2 + pi").constant
    assert not programs.expression("2*step(t - 1)").constant
    assert not programs.table([0, 1], [0, 1]).constant
    assert programs.cycles(2, 2, 1).constant
    assert not programs.cycles(2, 3, 1, shape="sine").constant


def check_settled(program: Program) -> None:
    """From the settled time on the value stays, and no earlier."""
    end = program.settled
    t = np.linspace(0.0, UNTIL, 400)
    if end is None:
        assert not program.constant
        return
    assert end >= 0.0
    later = program(end + t)
    assert np.abs(later - later[0]).max() <= 256 * EPS * size_of(program)
    if end > 0.0:
        steady = program(end + 1.0)
        before = [program.before(end), program(end - 1e-3 * min(end, 1.0))]
        assert any(value != steady for value in before)


@PROPERTY
@given(st.one_of(polygonal, sines))
def test_a_program_is_constant_from_its_settled_time_on(program: Program) -> None:
    check_settled(program)


@pytest.mark.parametrize(
    ("text", "settled"),
    [
        ("3", 0.0),
        ("step(t)", 0.0),
        ("2*step(t - 4) - step(t - 1)", 4.0),
        ("3*(pos(t) - pos(t - 2))", 2.0),
        ("exp(-t)", None),
        ("t", None),
        ("sin(t)*step(5 - t)", 5.0),
    ],
)
def test_when_a_text_settles(text: str, settled: float | None) -> None:
    assert programs.expression(text).settled == settled


def test_in_words() -> None:
    held = programs.ramp_hold_release("3 N", 0, "1 day", 0)
    assert held.describe() == "3 N held for 1 day, then released"
    assert programs.ramp_hold_release(3, 5, 60, 0, rest=1).describe("N", "s") == (
        "3 N reached within 5 s, held for 1 min, then back to 1 N"
    )
    assert programs.cycles(0, 3, 3600, 10).describe("N", "s") == "10 triangle cycles of 1 h between 0 N and 3 N"
