"""Claim: a member of a sweep is a scenario of its own: its text says what it takes, and computes the same."""

from __future__ import annotations

import json
import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import plastica as pl
from plastica.errors import ScenarioError
from plastica.study.reading import document_of
from plastica.study.run import solved
from plastica.study.scenario import scenario_of
from plastica.study.toml import toml_text
from tests.commandline import scenario, si_scenario

LONG = "0.1*cos(s)" + "+0.0010000000*s" * 32
"""As long as a formula may be, almost."""

STARTS: dict[str, tuple[bool, str, list[Any]]] = {
    "a number": (False, "curvature = 0.3", [0.5, 1.0, 2.0]),
    "none": (False, "natural_curvature = 0.2", [1.0, 2.0]),
    "a formula": (False, 'curvature = "0.3*cos(3*s) - abs(s - 0.3)"', [-0.5, 2.0]),
    "a quantity": (True, 'curvature = "4 1/km"', [1.0, 250.0]),
    "a formula in SI": (True, 'curvature = "0.4 - s"', [1.0, 0.1]),
    "pieces": (False, 'curvature = { pieces = [0.2, "-s"], breaks = [0.4] }', [1.0, 3.0]),
    "measured points": (False, 'curvature = { csv = "shape.csv", factor = 2.0 }', [1.0, 0.3]),
}


def swept(folder: Path, kind: str) -> pl.Sweep:
    """A sweep over thrust and amplitude from one kind of start."""
    points = "\n".join(f"{i / 20}, {0.1 * np.cos(i / 7)}" for i in range(21))
    (folder / "shape.csv").write_text(points)
    si, initial, amplitudes = STARTS[kind]
    text = (si_scenario if si else scenario)(initial=initial)
    file = folder / "base.toml"
    file.write_text(text)
    thrusts: list[Any] = ["0.9 N", "1.3 N"] if si else [1.5, 2.5]
    over = {"load.thrust": thrusts, "initial.amplitude": amplitudes}
    return pl.sweep(file, over, store=folder / "s.sweep", workers=0)


def check_text(folder: Path, kind: str) -> None:
    """Its text reads as the member: the same motion to the bit, which is that of the sweep to the tolerance."""
    found = swept(folder, kind)
    tips = []
    for member in range(found.members):
        one = found.scenario(member)
        again = scenario_of(document_of(one.text, one.file))
        assert float(again.model.load.thrust(0.0)) == float(one.model.load.thrust(0.0)), member
        motion, alone = solved(again), found.solve(member)
        assert np.array_equal(motion.history.y, alone.history.y), member
        tip = float(found.dataset["tip_y"][member])
        assert abs(float(motion.dataset["tip_y"][-1]) - tip) <= 1e-6 * (abs(tip) + one.model.scales.length), member
        tips.append(tip)
        assert again.title == one.title == f"{found.plan.base.title}: member {member}"
        assert f"# member {member}: load.thrust = " in one.text
    assert len(set(tips)) == (2 if kind == "none" else found.members)


@pytest.mark.parametrize("kind", STARTS)
def test_the_text_computes_what_the_member_does(kind: str, tmp_path: Path) -> None:
    check_text(tmp_path, kind)


def test_a_member_can_be_swept_again(tmp_path: Path) -> None:
    found = swept(tmp_path, "measured points")
    again = pl.sweep(found.scenario(3), {"material.parameters.k": [1.0]}, store=tmp_path / "t.sweep", workers=0)
    assert float(again.plan.base.model.load.thrust(0.0)) == 2.5
    both = float(again.dataset["tip_y"][0]), float(found.dataset["tip_y"][3])
    assert abs(both[0] - both[1]) <= 1e-6


def test_a_formula_that_becomes_too_long_is_no_scenario(tmp_path: Path) -> None:
    """The member is solved even so; its text says that it cannot be used, and is refused."""
    over = {"initial.amplitude": [1.0, 1.0 / 3.0]}
    found = pl.sweep(scenario(initial=f'curvature = "{LONG}"'), over, store=tmp_path / "s.sweep", workers=0)
    assert found.counts == {"done": 2}
    tip = float(found.dataset["tip_y"][1])
    assert abs(float(found.solve(1).dataset["tip_y"][-1]) - tip) <= 1e-6
    text = found.scenario(1).text
    assert "# This is no scenario that can be run" in text
    with pytest.raises(ScenarioError, match="amplitude"):
        pl.sweep(text, {"load.thrust": [1.0]}, store=tmp_path / "t.sweep", workers=0)


def test_pages_say_which_member_they_are_of(tmp_path: Path) -> None:
    found = swept(tmp_path, "a formula")
    told = [found.solve(member) for member in (1, 2)]
    pages = [pl.report(each, tmp_path / f"{i}.html", film_seconds=0).read_text() for i, each in enumerate(told)]
    taken = ("1.5, initial.amplitude = 2", "2.5, initial.amplitude = -0.5")
    for page, member, values in zip(pages, (1, 2), taken, strict=True):
        assert f"<title>A strut: member {member}</title>" in page
        assert f'<p class="lead">member {member}: load.thrust = {values}</p>' in page
        assert f"thrust = {values[:3]}\n" in page


LEAVES = st.one_of(
    st.booleans(), st.integers(-(2**62), 2**62), st.floats(allow_nan=False, allow_infinity=False), st.text(max_size=20)
)
VALUES = st.recursive(
    LEAVES,
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=8), inner, max_size=3),
    max_leaves=8,
)


@settings(deadline=None, max_examples=200, derandomize=True)
@given(st.dictionaries(st.text(max_size=8), VALUES, max_size=4), st.lists(st.text(max_size=20), max_size=2))
def test_what_is_written_reads_back(data: dict[str, Any], comments: list[str]) -> None:
    found = tomllib.loads(toml_text(data, comments))
    assert json.dumps(found, sort_keys=True) == json.dumps(data, sort_keys=True)
