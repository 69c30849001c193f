"""Claim: no change of a load written as text is too short to be met; what cannot be shown to be met is told."""

from __future__ import annotations

import math
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import plastica as pl
from plastica.doors import numbers
from plastica.errors import ArgumentError
from plastica.material.enclosure import Enclosure, enclosure
from plastica.material.expression import parse
from plastica.motion.itinerary import itinerary
from plastica.physics import pace
from plastica.physics.text import Text
from plastica.study.scenario import read_scenario
from tests.support import pair

KNOWN = 0.1160785614
"""Natural curvature of the first material of the catalogue 77 units of time after a pulse of 1e6 and width 1e-5."""

PULSES = {
    "bell": "{h}*exp(-((t - {a})/{w})**2)",
    "hyperbolic": "{h}/cosh((t - {a})/{w})",
    "resonance": "{h}/(1 + ((t - {a})/{w})**2)",
    "steps": "{h}*step(t - {a} + {w})*step({a} + {w} - t)",
    "roof": "{h}*pos(1 - abs(t - {a})/{w})",
    "parabola": "{h}*pos(1 - ((t - {a})/{w})**2)",
    "saturating": "{h}*(tanh((t - {a})/{w} + 1) - tanh((t - {a})/{w} - 1))/2",
    "on a slow wave": "0.2*sin(t) + {h}*exp(-((t - {a})/{w})**2)",
    "times a slow wave": "(2 + sin(t))*exp(-((t - {a})/{w})**2)*{h}",
    "nested": "{h}*exp(-abs(sinh((t - {a})/{w})))",
    "root": "{h}*exp(-sqrt(((t - {a})/{w})**2 + 0.01))",
    "power": "{h}*(1 + ((t - {a})/{w})**4)**-1.5",
    "burst": "{h}*sin((t - {a})/(0.05*{w}))*step(t - {a} + {w})*step({a} + {w} - t)",
    "size of a bell": "{h}*abs(exp(-((t - {a})/{w})**2))",
    "positive part of a bell": "{h}*pos(exp(-((t - {a})/{w})**2))**1.5",
    "two": "{h}*exp(-((t - {a})/{w})**2) - {h}/cosh((t - 0.3*{a})/{w})",
}

HOSTILE = {
    "exp(sin(exp(sin(exp(sin(7*t))))))": 20.0,
    "sin(1/(t - 3.1234567))": 10.0,
    "abs(sin(1/(t - 3.1234567)))": 10.0,
    "sin(1e9*t)*cos(t**3)": 398.0,
    "abs(sin(1e3*t))": 1e4,
    "sqrt((t + 1)**2) + (t**2 - 10*t + 25.0001)**-1": 398.0,
    "tan(t)**2/(1 + tan(t)**2)": 398.0,
    "log(1 + abs(t**2 - 7)*exp(cos(50*t)))": 1e3,
}


def pulse(kind: str, at: float, width: float, height: float = 1e6) -> str:
    return PULSES[kind].format(h=f"{height:.17g}", a=f"{at:.17g}", w=f"{width:.17g}")


def check_enclosed(text: str, low: float, high: float) -> None:
    """What interval arithmetic says holds every value in the interval, to rounding; at a point it is the value."""
    expression = parse(text, variable="t", allow_step=True, where="text")
    for each in (expression, expression.derivative()):
        formula = enclosure(each.tree, "t", {})
        least, most = (float(end[0]) for end in formula(np.array([low]), np.array([high])))
        t = np.linspace(low, high, 501)
        values = each.vector({})(t)
        values = values[np.isfinite(values)]
        slack = 1e-12 * (1.0 + float(np.abs(values).max(initial=0.0)))
        assert least - slack <= values.min(initial=math.inf)
        assert most + slack >= values.max(initial=-math.inf)
        at = formula.at(np.array([low]))
        np.testing.assert_allclose(at, each.vector({})(np.array([low])), rtol=1e-12, atol=1e-300)


FORMULAS = (
    "t**2 - 3*t", "sin(3*t)*cos(t)", "tan(t)", "1/(t - 1)", "exp(-t**2)*abs(t - 0.3)", "sqrt(1 + t**2)",
    "log(2 + sin(t))", "pos(t)**1.5", "tanh(t)/cosh(t)", "step(t - 0.2)*sinh(t)", "(1 + t**2)**(t/3)",
    "atan(1/(0.1 + t**2))", "abs(cos(t))",
)  # fmt: skip


@given(text=st.sampled_from(FORMULAS), low=st.floats(-5.0, 5.0), width=st.floats(1e-9, 10.0))
def test_bounds_hold_the_values(text: str, low: float, width: float) -> None:
    check_enclosed(text, low, low + width)


def test_bounds_tend_to_the_value() -> None:
    for text in ("exp(-t**2)*sin(5*t)", "1/(1 + t**2)", "sqrt(t)*tanh(t)"):
        formula = enclosure(parse(text, variable="t", allow_step=True, where="text").tree, "t", {})
        for width in (1e-3, 1e-6):
            low, high = formula(np.array([1.3]), np.array([1.3 + width]))
            assert float(high[0] - low[0]) <= 20.0 * width


def check_met(kind: str, at: float, width: float, until: float) -> None:
    """A step ends on either side of the pulse, near it, and none in between is longer than the pulse."""
    program = Text(pulse(kind, at, width))
    ends = np.array([0.0, *program.bursts(until), *(knot.t for knot in program.knots(until)), until])
    ends.sort()
    before, after = ends[ends <= at - 0.5 * width].max(), ends[ends >= at + 0.5 * width].min()
    # The tails of a resonance fall off slowly, and are met with ever longer steps.
    assert at - before <= 1e3 * width
    assert after - at <= 1e3 * width
    inside = [before, *ends[(ends > before) & (ends < after)], after]
    assert max(min(p, b - a) for p, (a, b) in zip(program.paces(inside), pairwise(inside), strict=True)) <= 2.1 * width
    assert not program.hidden(until)


@pytest.mark.parametrize("kind", PULSES)
@pytest.mark.parametrize(("at", "width", "until"), [(321.123, 1e-5, 398.0), (0.037, 1e-4, 5e3), (7654.321, 0.01, 1e4)])
def test_a_short_pulse_is_met(kind: str, at: float, width: float, until: float) -> None:
    check_met(kind, at, width, until)


@settings(max_examples=40)
@given(
    kind=st.sampled_from(sorted(PULSES)),
    share=st.floats(0.05, 0.95),
    width=st.floats(-8.0, -2.0).map(lambda power: 10.0**power),
)
def test_a_pulse_anywhere_is_met(kind: str, share: float, width: float) -> None:
    check_met(kind, 400.0 * share, width, 400.0)


def check_breaks_within() -> None:
    """What is linear between breaks of its own breaks where those lines vanish; only then does it settle."""
    program = Text("2*pos(3 - abs(t - 5)) - pos(2*abs(t - 9) - 4)*step(9 - t)")
    assert [knot.t for knot in program.knots(20.0)] == [2.0, 5.0, 7.0, 8.0]
    assert program.settled == 11.0
    assert Text("pos(pos(t - 1) - 1)").settled is None


def check_pace_of(text: str, least: float) -> None:
    """What bends gently is not followed with steps that are short for no reason, nor next to where it does not bend."""
    program = Text(text)
    ends = [0.0, *program.bursts(20.0), 20.0]
    count = sum((b - a) / min(step, b - a) for step, (a, b) in zip(program.paces(ends), pairwise(ends), strict=True))
    assert count <= 20.0 / least


@pytest.mark.parametrize("text", ["sin(t)**3", "t**2*exp(-t)", "exp(-(t - 3)**2)", "tanh(t - 3)", "sin(t)*sin(3*t)"])
def test_steps_are_as_long_as_the_formula_lets_them(text: str) -> None:
    check_pace_of(text, 0.05)


def test_breaks_within_an_argument_are_known() -> None:
    check_breaks_within()


def test_a_slow_text_needs_no_stops() -> None:
    for text, steps in (("3 + sin(t)", 150), ("2 - exp(-t)", 150), ("0.01*t**2", 10), ("4*tanh(t/50)", 100)):
        program = Text(text)
        ends = [0.0, *program.bursts(100.0), 100.0]
        paces = program.paces(ends)
        assert len(ends) <= 4
        assert sum((b - a) / min(p, b - a) for p, (a, b) in zip(paces, pairwise(ends), strict=True)) <= steps


def test_a_fast_wave_is_stepped_through_from_end_to_end() -> None:
    program = Text("sin(1e4*t)*step(t - 5)*step(5.1 - t)")
    assert program.paces([0.0, 5.0, 5.1, 100.0])[1] <= math.pi / 1e4
    # A step from one jump to the next is never too long.
    assert program.paces([0.0, 5.0, 5.1, 100.0])[::2] >= [5.0, 94.9]


def one_shape(load: pl.Load, until: float, specimen: pl.Specimen | None = None) -> pl.Solution:
    units = {} if specimen is None else {"length": 0.25, "stiffness": 0.035, "time": 120.0}
    strut = pl.Strut(pl.catalogue.material("one-shape", **units), load, pl.Grid(8), specimen)
    return pl.solve(strut, 0.0, 0.0, until=until)


def check_known_pulse(at: float) -> None:
    """What a pulse leaves does not depend on when it comes."""
    found = one_shape(pl.Load(couple=pulse("bell", at, 1e-5)), at + 77.0)
    assert float(found.dataset.natural_curvature[-1]) == pytest.approx(KNOWN, rel=1e-7)


@pytest.mark.parametrize("at", [1.0, 321.123])
def test_a_short_pulse_leaves_what_it_must(at: float) -> None:
    check_known_pulse(at)


def test_a_tap_of_milliseconds_in_a_day() -> None:
    specimen = pl.Specimen(length=0.25, bending_stiffness=0.035, retardation_time=120.0)
    end = 86_400.0
    text = pulse("bell", end - 77.0 * 120.0, 1.2e-3, 1e6 * 0.035 / 0.25)
    found = one_shape(pl.Load(couple=text), end, specimen)
    assert 0.25 * float(found.dataset.natural_curvature[-1]) == pytest.approx(KNOWN, rel=1e-6)


@pytest.mark.parametrize("name", ["thrust", "transverse", "couple", "weight"])
def test_every_load_of_a_rod_is_looked_at(name: str) -> None:
    load = pl.Load(**{name: pulse("bell", 30.0, 1e-4, 10.0)})
    rod = pl.Rod(pair("A"), load, pl.Grid(8), translational_inertia=1e-2)
    inside = [each for each in itinerary(rod, 0.0, 50.0) if each.start < 30.0 < each.end]
    assert inside[0].end - inside[0].start <= 2e-3
    assert inside[0].longest_step <= 2e-4


def test_a_pulse_after_the_end_changes_nothing() -> None:
    quiet, later = (one_shape(pl.Load(transverse=text), 20.0) for text in ("0.3", pulse("bell", 25.0, 1e-5) + " + 0.3"))
    assert np.array_equal(quiet.history.y[-1], later.history.y[-1])


def check_seen(at: float) -> None:
    """The largest value, the variation and a push that is not allowed are those of the pulse, too."""
    program = Text(pulse("bell", at, 1e-5) + " + 2")
    assert program.extreme(398.0)[1] == pytest.approx(1e6 + 2.0, rel=1e-3)
    assert program.variation(398.0) >= 2e6 * (1.0 - 1e-3)
    with pytest.raises(ArgumentError, match="must not be negative"):
        pl.Load(thrust=f"2 - exp(-((t - {at})/1e-5)**2)*3").check(398.0)


def test_largest_values_are_those_of_short_pulses() -> None:
    check_seen(321.123)


SCENARIO = """
schema = 1
title = "A load that is too fast"
units = "dimensionless"
[material]
name = "one-shape"
[load]
thrust = "{text}"
[initial]
curvature = 0.1
[solve]
until = 2
"""


def check_told(folder: Path) -> None:
    """A run, many runs and a check say where a change may be too short for them."""
    text = "2 + sin(t) + 1e-6*sin(1e5*t)"
    strut = pl.Strut(pair("A"), pl.Load(text), pl.Grid(8))
    notes = pl.solve(strut, 0.1, 0.0, until=2.0, rtol=1e-4).notes
    assert any(note.startswith("thrust: ") and "short" in note and "between t = 0 and 2" in note for note in notes)
    assert not pl.solve(strut.with_load(pl.Load("2 + sin(t)")), 0.1, 0.0, until=1.0).notes
    many = pl.solve_many(strut, 0.1, until=2.0, rtol=1e-4)
    assert "short" in many.attrs.get("notes", "")
    file = folder / "fast.toml"
    file.write_text(SCENARIO.format(text=text))
    assert any("short" in note for note in numbers.check_facts(read_scenario(file))["notes"])
    spans = Text("sin(1/(t - 3.125))").hidden(10.0)
    low, high = spans[0][0], spans[-1][1]
    assert low < 3.125 < high
    assert high - low <= 1e-3


def test_what_may_be_missed_is_told(tmp_path: Path) -> None:
    check_told(tmp_path)


@pytest.mark.parametrize("text", HOSTILE)
def test_the_search_is_bounded(text: str, monkeypatch: pytest.MonkeyPatch) -> None:
    looked, sound = [], Enclosure.__call__

    def counted(self: Enclosure, low: np.ndarray, *others: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        looked.append(low.size)
        return sound(self, low, *others)

    monkeypatch.setattr(Enclosure, "__call__", counted)
    paces = Text(text).paced(HOSTILE[text])
    # Value, slope and bend of each term and of its arguments; the last halving may double what was looked at.
    assert sum(looked) <= 3 * 4 * 2 * pace.MOST_PIECES
    assert paces.steps.min() > 0.0
    assert paces.edges[0] == 0.0
    assert paces.edges[-1] == HOSTILE[text]
    assert len(paces.turns) <= pace.MOST_STRETCHES
