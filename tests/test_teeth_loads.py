"""Claim: the checks of loads at an angle, of mass and of scenarios with inertia catch the defects planted for them."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from plastica.doors import numbers
from plastica.physics import load, section
from plastica.physics.inertia import Inertia
from plastica.physics.load import Load
from plastica.physics.model import Model
from plastica.study import building, export, loads, rods, schema
from plastica.study import run as runs
from tests import test_load, test_scenario_rods, test_specimen
from tests.defects import Patch, replacing
from tests.test_teeth import CAUGHT

Check = Callable[[Path], None]


def each_meaningless(folder: Path) -> None:
    for key in test_scenario_rods.MEANINGLESS:
        test_scenario_rods.check_meaningless(folder, key)


def mass_beside_a_retardation_time(_folder: Path) -> None:
    strip = test_specimen.strip(mass_per_length="36 g/m", rotary_inertia="6.6e-9 kg*m")
    test_specimen.check_inertia(strip, 0.036, 6.6e-9)


CHECKS: dict[str, Check] = {
    "a force at an angle": lambda _: test_load.check_force_at_an_angle(30.0),
    "quarter turns": lambda _: test_load.check_quarter_turns(),
    "direction of the weight": lambda _: test_load.check_weight_direction(0.3),
    "angle and tension are kept": lambda _: test_load.check_options_are_kept(),
    "a rod without damping": lambda _: test_specimen.check_undamped(),
    "mass beside a retardation time": mass_beside_a_retardation_time,
    "a specimen is stored": lambda _: test_specimen.check_stored(test_specimen.strip(mass_per_length="36 g/m")),
    "a scenario is a call": test_scenario_rods.check_it_is_the_call,
    "units change nothing": test_scenario_rods.check_units_change_nothing,
    "all mistakes at once": test_scenario_rods.check_all_mistakes_at_once,
    "what has no meaning": each_meaningless,
    "export by segment": test_scenario_rods.check_export_by_segment,
    "largest loads": test_scenario_rods.check_largest_loads,
}


def rounded_direction(_sound: Any) -> Any:
    return lambda angle: (math.cos(angle), math.sin(angle))


def other_way_round(sound: Any) -> Any:
    """Angles counted toward -y."""

    def direction(angle: float) -> tuple[float, float]:
        along, across = sound(angle)
        return along, -across

    return direction


def unturned(sound: Any) -> Any:
    """The mirror image of a weight acts at the same angle."""

    def mirrored(self: Load) -> Load:
        made = sound(self)
        return Load(**dict(made.items()), weight_angle=self.weight_angle, allow_tension=self.allow_tension)

    return mirrored


def forgetful(sound: Any) -> Any:
    """What is stored does not know of the angle."""
    return lambda self: {name: each for name, each in sound(self).items() if name != "weight_angle"}


def of_the_arms(change: Callable[[Any, Any], tuple[Any, Any]]) -> Callable[[Patch], None]:
    def spoil(patch: Patch) -> None:
        sound = Model.__dict__["arms"]
        patch.setattr(Model, "arms", property(lambda self: change(*sound.func(self))))

    return spoil


def twice_the_area(sound: Any) -> Any:
    def moments(*arguments: Any) -> Any:
        area, second = sound(*arguments)
        return 2.0 * area, second

    return moments


def without_rotary(sound: Any) -> Any:
    """ρJ is left out of what a density gives."""
    return lambda *arguments: replace(sound(*arguments), rotary=0.0)


def exchanged(sound: Any) -> Any:
    """Translational and rotary inertia change places."""
    return lambda self, *arguments: sound(self, *arguments)[::-1]


def given_up(_sound: Any) -> Any:
    """A section with a mistake is not looked at any further."""
    return lambda *arguments: None


def at_rest(sound: Any) -> Any:
    """The initial rate of curvature is forgotten."""
    return lambda *arguments, **options: sound(*arguments, **{**options, "curvature_rate": 0.0})


def straight(sound: Any) -> Any:
    """The weight's angle is not taken from the file."""
    return lambda section, *a, **k: sound(section.model_copy(update={"weight_angle": None}), *a, **k)


def upper(_sound: Any) -> Any:
    """The greatest value of a load taken for the largest, of whatever sign."""
    return lambda bounds: float(bounds[1])


def unordered(sound: Any) -> Any:
    """Places along the rod are taken in any order."""
    return lambda inner, *arguments: sound(sorted(inner, key=str), *arguments)


TEETH: list[tuple[str, str, Callable[[Patch], None]]] = [
    ("a force at an angle", "toward -y", replacing(load, "_direction", other_way_round)),
    ("quarter turns", "a cosine that is not 0", replacing(load, "_direction", rounded_direction)),
    ("direction of the weight", "along and across exchanged", of_the_arms(lambda a, b: (b, a))),
    ("direction of the weight", "toward -y", of_the_arms(lambda a, b: (a, -b))),
    ("angle and tension are kept", "an angle that stays in the mirror", replacing(Load, "mirrored", unturned)),
    ("angle and tension are kept", "an angle that is not stored", replacing(Load, "to_dict", forgetful)),
    ("a rod without damping", "twice the area", replacing(section, "_moments", twice_the_area)),
    ("a rod without damping", "no rotary inertia", replacing(Inertia, "read", without_rotary)),
    ("mass beside a retardation time", "inertias exchanged", replacing(Inertia, "ratios", exchanged)),
    (
        "a specimen is stored",
        "a mass that is not stored",
        lambda patch: patch.setattr(
            test_specimen.Specimen,
            "to_dict",
            lambda self: {name: each for name, each in self.as_given.items() if name != "mass_per_length"},
        ),
    ),
    ("a scenario is a call", "a start at rest", replacing(runs, "solve", at_rest)),
    ("a scenario is a call", "a weight without its angle", replacing(loads, "load", straight)),
    (
        "units change nothing",
        "text with units a little off",
        replacing(building, "number", lambda sound: lambda v, unit: sound(v, unit) * (1.0 + 1e-3 * isinstance(v, str))),
    ),
    ("all mistakes at once", "a section given up", replacing(schema, "_without", given_up)),
    (
        "what has no meaning",
        "nothing is said of inertia",
        replacing(rods, "check_inertia", lambda _: lambda *a, **k: None),
    ),
    ("largest loads", "a pull that is not seen", replacing(numbers, "_largest", upper)),
    ("what has no meaning", "places in any order", replacing(building, "_ends", unordered)),
    (
        "export by segment",
        "segments in another order",
        replacing(export, "_rows", lambda sound: lambda *a: reversed(list(sound(*a)))),
    ),
]


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
