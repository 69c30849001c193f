"""Claim: the checks of modes, of their picture and of their command catch the defects that are planted for them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import plastica as pl
from plastica.doors import held
from plastica.doors import modes as command
from plastica.equilibria import at_rest, rest, vibration
from plastica.equilibria import modes as computed
from plastica.equilibria.mode_set import Modes
from plastica.physics.linearised import Linearised
from plastica.physics.rod import Rod
from plastica.physics.scales import Scales
from plastica.show import vibration as drawn

from . import test_modes as claims
from . import test_modes_told as told

Patch = pytest.MonkeyPatch
Defect = Callable[[Patch], None]


def _changed(place: Any, name: str, made: Callable[[Any], Any]) -> Defect:
    """A defect that puts something made of the sound thing in its place."""
    return lambda patch: patch.setattr(place, name, made(getattr(place, name)))


def _linear(change: Callable[[Linearised], Linearised]) -> Defect:
    """A defect of every linearisation."""
    return _changed(computed, "linearised", lambda sound: lambda model, theta: change(sound(model, theta)))


def _of_model(change: Callable[[Any], Any]) -> Defect:
    """A linearisation of another rod."""
    return _changed(computed, "linearised", lambda sound: lambda model, theta: sound(change(model), theta))


def _stiffer(by: float) -> Callable[[Linearised], Linearised]:
    return lambda found: replace(found, K=(1.0 - by) * np.eye(found.grid.size) + by * found.K)


def _along_only(model: Any) -> Any:
    load = model.load
    return model.with_load(pl.Load(thrust=load.thrust, weight=load.weight))


def _without_rotary(model: Any) -> Any:
    return replace(model, rotary_inertia=0.0) if isinstance(model, Rod) else model


def _across_only(found: Linearised) -> Linearised:
    """Of both components of the velocity the last is left out."""
    n = found.grid.size
    return replace(found, factor=found.factor[:-n]) if found.factor.shape[0] > n else found


def _property(kind: type, name: str, value: Callable[[Any], Any]) -> Defect:
    return lambda patch: patch.setattr(kind, name, property(value))


def _elsewhere(_sound: Any) -> Any:
    return lambda model, *rest: at_rest._straight(model)


def _natural_lost(sound: Any) -> Any:
    def static(scenario: Any, load: Any) -> Any:
        found = sound(scenario, load)
        return rest.settle(found.model, found.mu, 0.0)

    return static


DEFECTS: dict[str, Defect] = {
    "a digit of the mass": _linear(lambda found: replace(found, factor=found.factor * (1.0 + 1e-9))),
    "a digit of the stiffness": _linear(_stiffer(1.0 + 1e-4)),
    "thrust that stiffens": _linear(_stiffer(-1.0)),
    "no rotary inertia": _of_model(_without_rotary),
    "no loads across": _of_model(_along_only),
    "one component of the velocity": _linear(_across_only),
    "half the damping": _linear(lambda found: replace(found, damping=0.5 * found.damping)),
    "pairs mixed up": _changed(vibration, "_taken", lambda sound: lambda *a: sound(*a)[::-1]),
    "the first modes for all": _changed(vibration, "_on_all", lambda _: lambda found, overlap, value, z: value),
    "conjugate first": _changed(computed, "damped_pairs", lambda sound: lambda *a: sound(*a)[:, ::-1]),
    "nodal values without weights": _property(Linearised, "root", lambda found: np.ones(found.grid.size)),
    "weights on one side": _changed(
        Linearised, "nodal", lambda _: lambda found, matrix: (found.root**2)[:, None] * matrix
    ),
    "modes of any sign": _changed(computed, "_signed", lambda sound: lambda *a: -sound(*a)),
    "errors too small": _changed(computed, "_change", lambda sound: lambda *a: 1e-3 * sound(*a)),
    "errors too large": _changed(computed, "_change", lambda sound: lambda *a: 1e3 * sound(*a)),
    "never enough nodes": _changed(computed, "CONVERGED", lambda _: 0.0),
    "cycles for radians": _property(Modes, "hertz", lambda found: found.frequencies),
    "energy in units of force": _property(Scales, "energy", lambda scales: scales.force),
    "the straight rod instead": _changed(at_rest, "_near", _elsewhere),
    "no threshold": _property(at_rest.AtRest, "stays", lambda found: True),
    "drawn at another size": _changed(drawn, "LARGEST", lambda sound: 0.9 * sound),
    "natural curvature lost": _changed(held, "static_shape", _natural_lost),
    "loads of the start": _changed(command, "_moment", lambda _: lambda scenario, given: (0.0, "")),
}


def _bare(check: Callable[..., None], *arguments: Any) -> Callable[[Path], None]:
    return lambda _folder: check(*arguments)


TEETH: list[tuple[str, Callable[[Path], None], tuple[str, ...]]] = [
    ("clamped-free", _bare(claims.check_clamped_free), ("a digit of the mass",)),
    ("beam-columns", _bare(claims.check_beam_columns, 1.5, 1e-2), ("no rotary inertia", "thrust that stiffens")),
    ("rotary inertia alone", _bare(claims.check_rotary_inertia_alone), ("a digit of the mass",)),
    ("frequency falls to 0", _bare(claims.check_frequency_falls_to_zero), ("a digit of the stiffness",)),
    ("heavy column", _bare(claims.check_heavy_column), ("a digit of the stiffness",)),
    ("damping ratios", _bare(claims.check_damping_ratios, 1.0), ("half the damping", "pairs mixed up")),
    ("damping ratios, swinging", _bare(claims.check_damping_ratios, 0.02), ("conjugate first",)),
    ("pairs", _bare(claims.check_pairs_do_not_depend_on_the_grid), ("the first modes for all",)),
    ("shooting", _bare(claims.check_shooting, "every"), ("no loads across", "one component of the velocity")),
    (
        "energies",
        _bare(claims.check_energies, "every"),
        ("nodal values without weights", "one component of the velocity", "half the damping"),
    ),
    ("finite differences", _bare(claims.check_finite_differences, "every"), ("one component of the velocity",)),
    ("eigenvalues", _bare(claims.check_eigenvalues, "every", 0.05), ("half the damping", "no loads across")),
    ("symmetric", _bare(claims.check_symmetric, "every"), ("weights on one side",)),
    ("free oscillation", _bare(claims.check_free_oscillation, "none", 0.02, 1), ("half the damping",)),
    ("without inertia", _bare(claims.check_without_inertia), ("a digit of the stiffness",)),
    ("SI", _bare(told.check_si), ("cycles for radians", "energy in units of force")),
    ("shapes", _bare(told.check_shapes), ("modes of any sign",)),
    ("errors", _bare(told.check_errors), ("errors too small", "errors too large")),
    ("nodes are chosen", _bare(told.check_nodes_are_chosen), ("never enough nodes",)),
    ("places", _bare(told.check_places), ("the straight rod instead",)),
    ("the natural curvature is held", _bare(told.check_the_natural_curvature_is_held), ("no threshold",)),
    ("picture", _bare(told.check_picture), ("drawn at another size",)),
    ("command", told.check_command, ("natural curvature lost",)),
    ("loads held", told.check_loads_held, ("loads of the start",)),
]

ROWS = [(claim, check, defect) for claim, check, defects in TEETH for defect in defects]


@pytest.mark.parametrize(("claim", "check", "defect"), ROWS, ids=[f"{claim}: {defect}" for claim, _, defect in ROWS])
def test_catches(
    claim: str, check: Callable[[Path], None], defect: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for folder in ("sound", "spoiled"):
        (tmp_path / folder).mkdir()
    check(tmp_path / "sound")
    DEFECTS[defect](monkeypatch)
    with pytest.raises(AssertionError):
        check(tmp_path / "spoiled")


def test_every_defect_has_a_check() -> None:
    assert {defect for _, _, defect in ROWS} == set(DEFECTS)
