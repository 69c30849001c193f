"""Claim: the checks on where many members end catch the defects planted for them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from plastica.equilibria import apart, contraction, endings, following, settled, way
from plastica.motion import parts
from tests import test_endings, test_limits, test_rest

Patch = pytest.MonkeyPatch
Defect = Callable[[Patch], None]


def _changed(place: Any, name: str, made: Callable[[Any], Any]) -> Defect:
    return lambda patch: patch.setattr(place, name, made(getattr(place, name)))


def _neighbours_parameters(sound: Any) -> Any:
    return lambda self, some: replace(sound(self, some), own=np.roll(self.own, 1, axis=1)[:, some])


def _off(sound: Any) -> Any:
    def spoiled(*arguments: Any) -> Any:
        found = sound(*arguments)
        return settled.Settled(found.mu * (1.0 + 1e-9), found.converged)

    return spoiled


def _monotone(sound: Any) -> Any:
    """theta_0'(1) keeps the sign it has at the start."""

    def spoiled(gamma: Any, places: Any) -> Any:
        arm, mu_nat, slope = sound(gamma, places)
        return arm, mu_nat, np.broadcast_to(slope[:, :1], slope.shape)

    return spoiled


def _larger(sound: Any) -> Any:
    return lambda *arguments: {name: 1.001 * values for name, values in sound(*arguments).items()}


def _blunt(sound: Any) -> Any:
    """Marginal passes are not told apart from none."""
    return lambda start, places, margin: sound(start, places, np.zeros_like(margin))


DEFECTS: dict[str, tuple[Defect, Callable[[], object]]] = {
    "parameters of the neighbour": (
        _changed(way.ManyLaws, "of", _neighbours_parameters),
        lambda: test_endings.check_as_one(100.0),
    ),
    "a thrust a thousandth larger": (
        _changed(parts, "_loads", _larger),
        lambda: test_endings.check_as_one(100.0),
    ),
    "loads that count as settled": (
        _changed(parts, "_settled", lambda sound: lambda given: 0.0 * given.factor),
        lambda: test_endings.check_as_one(100.0),
    ),
    "steps of Landen's that neighbours decide": (
        _changed(apart, "DEEPEST", lambda sound: (4.0, 1.0)),
        test_endings.check_apart,
    ),
    "growing directions overlooked": (
        _changed(settled._Statics, "norm", lambda sound: property(lambda self: 0.0)),
        test_endings.check_settled,
    ),
    "shapes a little off": (
        _changed(test_endings, "settle_many", _off),
        test_endings.check_settled,
    ),
    "interpolants that are not resolved": (
        _changed(way, "RESOLVED", lambda sound: 1.0),
        test_endings.check_samples,
    ),
    "folds overlooked": (_changed(way, "_sampled", _monotone), test_endings.check_first_roots),
    "tangencies overlooked": (_changed(way, "_look", _blunt), test_endings.check_first_roots),
    "every shape holds": (
        _changed(endings, "contracts", lambda sound: lambda grid, force, angle, away: np.ones(away.size, dtype=bool)),
        lambda: test_limits.check_no_shape_is_taken_for_another(*test_limits.FROZEN[0]),
    ),
    "a ball of half the size it has": (
        _changed(contraction, "chord_slope", lambda sound: lambda angle, reach: sound(angle, 0.1 * reach)),
        lambda: test_limits.check_no_shape_is_taken_for_another(*test_limits.FROZEN[1]),
    ),
    "chords at one end": (
        _changed(test_endings, "chord_slope", lambda sound: lambda angle, reach: sound(angle, 0.5 * reach)),
        test_endings.check_contraction,
    ),
    "a ball that is too large": (
        _changed(contraction, "integral_norm", lambda sound: lambda grid: 0.6 * sound(grid)),
        test_endings.check_contraction,
    ),
    "every rod follows its curve": (
        _changed(
            endings, "follows_the_curve", lambda sound: lambda start, *state: np.ones(start.gamma.size, dtype=bool)
        ),
        test_endings.check_none_is_told_to_stop,
    ),
    "large steps alone": (
        _changed(following, "holds", lambda sound: lambda model, mu, shape: True),
        lambda: test_rest.check_the_motions_shape(*test_rest.ASTRAY[3]),
    ),
}


@pytest.mark.parametrize("name", DEFECTS)
def test_caught(name: str, monkeypatch: Patch) -> None:
    spoil, check = DEFECTS[name]
    spoil(monkeypatch)
    with pytest.raises(AssertionError):
        check()
