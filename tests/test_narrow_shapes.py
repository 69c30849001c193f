"""Claim: no feature of a shape written as text is too narrow to be met; what the nodes given miss of it is told."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.special import erf

import plastica as pl
from plastica.doors import numbers
from plastica.physics.initial import initial_shape
from plastica.physics.narrow import missed
from plastica.physics.scales import Scales
from plastica.study.scenario import read_scenario
from tests.support import pair

Array = NDArray[np.float64]

TEXTS = {
    "bell": "1 + {h}*exp(-((s - {a})/{w})**2)",
    "hyperbolic": "1 + {h}/cosh((s - {a})/{w})",
    "resonance": "1 + {h}/(1 + ((s - {a})/{w})**2)",
    "two": "1 + {h}*exp(-((s - {a})/{w})**2) - 0.5*{h}*exp(-((s - 0.5*{a})/{w})**2)",
}

INTEGRALS: dict[str, Callable[[Array], Array]] = {
    "bell": lambda x: 0.5 * math.sqrt(math.pi) * erf(x),
    "hyperbolic": lambda x: 2.0 * np.arctan(np.tanh(0.5 * x)),
    "resonance": np.arctan,
}

TURN = 0.1
"""Height times width of a feature: about the angle by which it turns the rod."""


def feature(kind: str, at: float, width: float) -> str:
    return TEXTS[kind].format(h=f"{TURN / width:.17g}", a=f"{at:.17g}", w=f"{width:.17g}")


def angle(kind: str, at: float, width: float, s: Array) -> Array:
    if kind == "two":
        return angle("bell", at, width, s) - 0.5 * (angle("bell", 0.5 * at, width, s) - s)
    integral = INTEGRALS[kind]
    return s + TURN * (integral((s - at) / width) - integral(np.full_like(s, -at / width)))


def end(kind: str, at: float, width: float) -> tuple[float, float]:
    """The place of the free end, from the closed form of the angle, on intervals that shrink toward the features."""
    places = (at, 0.5 * at) if kind == "two" else (at,)
    away = np.append(0.0, np.geomspace(0.1 * width, 1.0, 200))
    ends = np.unique(np.clip([0.0, 1.0, *(place + side * away for place in places for side in (-1, 1))][2:], 0.0, 1.0))
    x, w = np.polynomial.legendre.leggauss(12)
    low, wide = ends[:-1, None], np.diff(ends)[:, None]
    theta = angle(kind, at, width, low + wide * 0.5 * (1.0 + x))
    return float((np.cos(theta) * wide * 0.5 * w).sum()), float((np.sin(theta) * wide * 0.5 * w).sum())


def first_end(solution: pl.Solution) -> tuple[float, float]:
    model = solution.model
    theta = model.angle(model.layout.mu(solution.history.y[0]))
    return float(np.cos(theta) @ model.grid.w), float(np.sin(theta) @ model.grid.w)


def strut(nodes: int | str) -> pl.Strut:
    return pl.Strut(pair("A"), pl.Load(3.0), pl.Grid(nodes))


def check_met(kind: str, at: float, width: float) -> None:
    """Where the nodes are chosen, the first shape is that of the text."""
    found = pl.solve(strut("auto"), feature(kind, at, width), 0.1, until=0.01, rtol=1e-6)
    assert found.status.code == "done"
    assert math.dist(first_end(found), end(kind, at, width)) <= 1e-6


@pytest.mark.parametrize("kind", TEXTS)
@pytest.mark.parametrize(("at", "width"), [(0.437, 1e-3), (0.731, 1e-5)])
def test_a_narrow_feature_is_met(kind: str, at: float, width: float) -> None:
    check_met(kind, at, width)


def check_missed(kind: str, at: float, width: float, nodes: int) -> None:
    """What the nodes miss is known, and is what the free end is off."""
    grid = pl.Grid(nodes)
    shape, _ = initial_shape(feature(kind, at, width), grid, Scales.unit(), si=False)
    theta = grid.A @ np.asarray(shape.function(grid.s))
    there = float(np.cos(theta) @ grid.w), float(np.sin(theta) @ grid.w)
    off = math.dist(there, end(kind, at, width))
    # What is below the rounding of large angles counts as nothing.
    assert missed(shape, grid) == pytest.approx(off, rel=1e-6, abs=1e-9 * (1.0 + float(np.abs(theta).max())))


@settings(max_examples=40)
@given(
    kind=st.sampled_from(sorted(TEXTS)),
    at=st.floats(0.05, 0.95),
    width=st.floats(-6.0, -1.0).map(lambda power: 10.0**power),
    nodes=st.sampled_from([8, 16, 48]),
)
def test_what_the_nodes_miss_is_known(kind: str, at: float, width: float, nodes: int) -> None:
    check_missed(kind, at, width, nodes)


SCENARIO = """
schema = 1
title = "A start that is too narrow"
units = "dimensionless"
[material]
name = "one-shape"
[load]
thrust = 2
[initial]
curvature = "{text}"
[solve]
until = 0.01
[grid]
nodes = {nodes}
"""

NARROW = feature("bell", 0.437, 1e-3)


def says_so(notes: tuple[str, ...] | list[str], where: str = "curvature") -> bool:
    return any(note.startswith(f"{where}: ") and "narrow" in note for note in notes)


def check_run_told(_: Path) -> None:
    """A run on nodes that miss a feature is not resolved, and says where."""
    found = pl.solve(strut(16), NARROW, 0.1, until=0.01, rtol=1e-4)
    assert found.status.code == "not_resolved"
    assert says_so(found.notes)
    assert "s = 0.43" in " ".join(found.notes)
    smooth = pl.solve(strut(16), "1 + cos(3*s)", 0.1, until=0.01)
    assert smooth.status.code == "done"
    assert not smooth.notes


def check_rate_told(_: Path) -> None:
    rod = pl.Rod(pair("A"), pl.Load(1.0), pl.Grid(16), translational_inertia=1.0)
    found = pl.solve(rod, 0.0, 0.1, until=0.01, curvature_rate=NARROW)
    assert found.status.code == "not_resolved"
    assert says_so(found.notes, "curvature_rate")


def check_many_told(_: Path) -> None:
    """Of many, those are not resolved whose feature is missed; nodes that are chosen miss none."""
    given = [NARROW, "1 + cos(3*s)"]
    on_few = pl.solve_many(strut(16), given, 0.1, until=0.01, rtol=1e-4)
    assert on_few.status.values.tolist() == ["not_resolved", "done"]
    assert says_so([on_few.attrs.get("notes", "")])
    chosen = pl.solve_many(strut("auto"), given, 0.1, until=0.01, rtol=1e-4)
    assert chosen.status.values.tolist() == ["done", "done"]
    assert "notes" not in chosen.attrs
    family = pl.solve_many(
        strut(16), "a*exp(-((s - 0.437)/1e-3)**2)", 0.1, until=0.01, shape_parameters={"a": [1.0, 100.0]}
    )
    assert says_so([family.attrs.get("notes", "")])


def check_rest_told(_: Path) -> None:
    assert "narrow" in pl.rest(strut(16), NARROW, 0.1).sentence
    assert "narrow" not in pl.rest(strut("auto"), NARROW, 0.1).sentence


def check_check_told(folder: Path) -> None:
    """A check of a scenario says what its nodes miss, and what cannot be bounded on any nodes."""
    for text, nodes, told in (
        (NARROW, "16", True),
        (NARROW, '"auto"', False),
        ("sin(1/(s - 0.437))", '"auto"', True),
    ):
        file = folder / "narrow.toml"
        file.write_text(SCENARIO.format(text=text, nodes=nodes))
        notes = numbers.check_facts(read_scenario(file))["notes"]
        assert says_so(notes) == told
        assert any("overlooked" in note for note in notes) == text.startswith("sin")


@pytest.mark.parametrize(
    "check", [check_run_told, check_rate_told, check_many_told, check_rest_told, check_check_told]
)
def test_what_is_missed_is_told(check: Callable[[Path], None], tmp_path: Path) -> None:
    check(tmp_path)


def check_pieces(length: float) -> None:
    """Texts in pieces, of rods in SI units, and multiples of them, are met like any."""
    width = 1e-5 * length
    text = f"{TURN / width:.17g}*exp(-((s - {0.437 * length:.17g})/{width:.17g})**2)"
    shape = pl.piecewise([0.25 * length, 0.9 * length], [1.0 / length, text, "0"]).times(2.0)
    specimen = pl.Specimen(length=length, bending_stiffness=0.035, retardation_time=120.0)
    material = pl.catalogue.material("one-shape", length=length, stiffness=0.035, time=120.0)
    rod = pl.Strut(material, pl.Load(0.0), pl.Grid("auto"), specimen)
    found = pl.solve(rod, shape, 0.0, until=1.0, rtol=1e-6)
    bend, turn = 0.5, 2.0 * TURN * math.sqrt(math.pi)
    x = math.sin(bend) / 2.0 + (0.437 - 0.25) * math.cos(bend) + (1.0 - 0.437) * math.cos(bend + turn)
    # A kink in place of the feature moves the free end by a share of its width.
    assert found.status.code == "done"
    assert first_end(found)[0] == pytest.approx(x, abs=1e-5 * turn**2 + 1e-6)


@pytest.mark.parametrize("length", [0.25, 40.0])
def test_pieces_and_units(length: float) -> None:
    check_pieces(length)


def check_imperfection(_: Path) -> None:
    """A chart's shape, whose nodes it chooses itself, has element ends at the feature."""
    from plastica.charts.starts import read_shape

    grid = pl.Grid(24)
    shape, _size = read_shape(NARROW, pl.Strut(pair("A"), pl.Load(), grid), "imperfection")
    assert missed(shape, grid) >= 1e-3
    assert missed(shape, grid.with_breaks(shape.breaks)) <= 1e-3 * missed(shape, grid)


def test_the_shape_of_a_chart_is_met(tmp_path: Path) -> None:
    check_imperfection(tmp_path)
