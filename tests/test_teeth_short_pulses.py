"""Claim: the checks of short changes of loads catch the defects planted for them."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from plastica.material import enclosure, expression
from plastica.motion import many, plan
from plastica.physics import pace, text
from plastica.physics.pace import Paces
from plastica.physics.text import Text
from tests import test_short_pulses
from tests.defects import Patch, replacing
from tests.test_teeth import CAUGHT

CHECKS: dict[str, Callable[[Path], None]] = {
    "bounds": lambda _: test_short_pulses.check_enclosed("exp(-(t - 1)**2) + cos(t)", -2.0, 3.5),
    "a bell is met": lambda _: test_short_pulses.check_met("bell", 217.3, 1e-5, 400.0),
    "a wave beside it is no cover": lambda _: test_short_pulses.check_met("on a slow wave", 217.3, 1e-3, 400.0),
    "the size of a bell is met": lambda _: test_short_pulses.check_met("size of a bell", 217.3, 1e-5, 400.0),
    "long steps": lambda _: test_short_pulses.check_pace_of("sin(t)**3", 0.05),
    "a parabola is met": lambda _: test_short_pulses.check_met("parabola", 217.3, 1e-5, 400.0),
    "breaks within": lambda _: test_short_pulses.check_breaks_within(),
    "what a pulse leaves": lambda _: test_short_pulses.check_known_pulse(32.5),
    "largest values": lambda _: test_short_pulses.check_seen(217.3),
    "what is told": test_short_pulses.check_told,
}


def ends_only(_sound: Any) -> Any:
    """An even function is bounded by its ends."""

    def bounds(function: Any, a: Any) -> Any:
        ends = function(a[0]), function(a[1])
        return np.minimum(*ends), np.maximum(*ends)

    return bounds


def sampled(sound: Any) -> Any:
    """What is not seen on the samples of a piece is not there."""

    def pace_(*arguments: Any) -> Any:
        steps, shown = sound(*arguments)
        return steps, np.ones_like(shown)

    return pace_


def signed(sound: Any) -> Any:
    """An argument that is 0 at home is 0 on the whole piece."""

    def bounds(name: str, a: Any, home: Any) -> Any:
        found = sound(name, a, home)
        nought = np.zeros_like(a[0]) if home is None else home
        return tuple(np.where((nought == 0.0) & (home is not None), 0.0, each) for each in found)

    return bounds


def no_longer_than_pieces(sound: Any) -> Any:
    """No step is longer than a tenth of the piece that it is in."""

    def pace_(formulas: Any, points: Any, slope: Any, bend: Any, width: Any, extent: float) -> Any:
        steps, shown = sound(formulas, points, slope, bend, width, extent)
        return np.minimum(steps, 0.1 * width), shown

    return pace_


def stepped_over(patch: Patch) -> None:
    """Neither stops nor a longest step."""
    patch.setattr(Text, "bursts", lambda self, until: ())
    patch.setattr(Text, "paces", lambda self, points: [math.inf] * (len(points) - 1))


TEETH: list[tuple[str, str, Callable[[Patch], None]]] = [
    ("bounds", "squares bounded by their ends", replacing(enclosure, "_even", ends_only)),
    (
        "bounds",
        "no crest of a wave",
        replacing(enclosure, "_holds", lambda _: lambda a, *_: np.zeros(a[0].shape, bool)),
    ),
    ("a bell is met", "no stops", replacing(Text, "bursts", lambda _: lambda self, until: ())),
    ("a bell is met", "samples believed", replacing(pace, "_pace", sampled)),
    ("a bell is met", "any step", replacing(Paces, "longest", lambda _: lambda self, a, b: math.inf)),
    ("a wave beside it is no cover", "samples believed", replacing(pace, "_pace", sampled)),
    ("the size of a bell is met", "the sign of 0 taken for known", replacing(enclosure, "_broken", signed)),
    ("long steps", "a piece is a step", replacing(pace, "_pace", no_longer_than_pieces)),
    ("a parabola is met", "no breaks within", replacing(pace, "_zeros", lambda _: lambda *a: [])),
    ("breaks within", "only of lines", replacing(expression, "_zeros_of_lines", lambda _: lambda *a: None)),
    ("what a pulse leaves", "stepped over", stepped_over),
    ("largest values", "nowhere to look", lambda patch: patch.setattr(Paces, "looks", np.zeros(0))),
    ("what is told", "nothing hidden", replacing(Text, "hidden", lambda _: lambda self, until: ())),
    ("what is told", "a run that does not say it", replacing(plan, "short_changes", lambda _: lambda *a: ())),
    ("what is told", "many that do not say it", replacing(many, "short_changes", lambda _: lambda *a: ())),
]


@pytest.fixture(autouse=True)
def nothing_kept() -> Iterator[None]:
    """What was found without a defect must not be taken up with one, nor the reverse."""
    text._paced.cache_clear()
    yield
    text._paced.cache_clear()


@pytest.mark.parametrize("claim", CHECKS)
def test_passes_without_a_defect(claim: str, tmp_path: Path) -> None:
    CHECKS[claim](tmp_path)


@pytest.mark.parametrize(("claim", "defect", "spoil"), TEETH, ids=[f"{claim}-{defect}" for claim, defect, _ in TEETH])
def test_catches(
    claim: str, defect: str, spoil: Callable[[Patch], None], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    spoil(monkeypatch)
    with pytest.raises(CAUGHT):
        CHECKS[claim](tmp_path)


def test_every_check_has_a_defect() -> None:
    assert {claim for claim, _, _ in TEETH} == set(CHECKS)
