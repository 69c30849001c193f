"""Claim: the checks on machine code catch the defects planted for them."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import plastica as pl
from plastica.material import tape
from plastica.numerics import block
from plastica.physics import machine
from tests import test_machine, test_many

Patch = pytest.MonkeyPatch
Defect = Callable[[Patch], None]


def _found(change: Callable[..., Any]) -> Defect:
    """What a tried step gives is changed: (found, rows) -> found."""

    def spoil(patch: Patch) -> None:
        sound = machine.machine_of

        def spoiled(struts: Any, rtol: float) -> Any:
            tried = sound(struts, rtol)
            return lambda columns, p, y: change(tried(columns, p, y), y.shape[0])

        patch.setattr(machine, "machine_of", spoiled)

    return spoil


def _leaking(found: Any, rows: int) -> Any:
    return found + 1e-30 * np.roll(found, 1, axis=1)


def _by_place(found: Any, rows: int) -> Any:
    found[0] *= 1.0 + 4e-16 * (np.arange(found.shape[1]) % machine.TILE == machine.TILE - 1)
    return found


def _belittled(found: Any, rows: int) -> Any:
    found[rows : rows + 2] *= 1e-8
    return found


def _never_yielding(found: Any, rows: int) -> Any:
    found[rows + 3 :] = 0.0
    return found


def _tapes(law: int, **changed: Any) -> Defect:
    """One law's tape is changed."""

    def spoil(patch: Patch) -> None:
        sound = machine.tapes_of

        def spoiled(struts: Any) -> Any:
            tapes = list(sound(struts))
            tapes[law] = replace(tapes[law], **{name: make(tapes[law]) for name, make in changed.items()})
            return tuple(tapes)

        patch.setattr(machine, "tapes_of", spoiled)

    return spoil


def _other_code(name: str, other: str) -> Defect:
    return lambda patch: patch.setitem(tape.CODES, name, tape.CODES[other])


def _in_machine_code(check: Callable[[], None]) -> Callable[[], None]:
    def checked() -> None:
        test_many.healthy.cache_clear()
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(pl, "solve_many", partial(pl.solve_many, library="numba"))
            try:
                check()
            finally:
                test_many.healthy.cache_clear()

    return checked


def _step() -> None:
    test_machine.check_step(test_many.STRUT, 3)


DEFECTS: dict[str, tuple[Defect, Callable[[], None]]] = {
    "a lane that leaks into the next": (_found(_leaking), _in_machine_code(test_many.check_neighbours)),
    "a lane unlike the others": (_found(_by_place), test_machine.check_lanes),
    "errors made small": (_found(_belittled), _in_machine_code(test_many.check_agreement_with_solve)),
    "yielding that is not told": (_found(_never_yielding), _in_machine_code(test_machine.check_straight)),
    "a threshold a little higher": (
        _tapes(1, constants=lambda each: each.constants * (1.0 + 1e-6)),
        _in_machine_code(test_many.check_agreement_with_solve),
    ),
    "a flow that forgets its last line": (_tapes(2, operations=lambda each: each.operations[:-1]), _step),
    "one function for another": (_other_code("tanh", "atan"), test_machine.check_tapes),
    "a step for a positive part": (_other_code("pos", "above"), test_machine.check_tapes),
    "steps that keep stirring": (
        lambda patch: patch.setattr(block, "CALMER", 1.0),
        _in_machine_code(test_many.check_rest),
    ),
    "a weight that pulls a little more": (
        lambda patch: patch.setattr(machine, "math", SimpleNamespace(cos=lambda _: 0.9, sin=math.sin)),
        _step,
    ),
    "a stage that takes a little less": (
        lambda patch: patch.setattr(
            machine, "_tableau", lambda sound=machine._tableau: (sound()[0] * (1.0 - 1e-9), *sound()[1:])
        ),
        _step,
    ),
    "times of the stages that are late": (
        lambda patch: patch.setattr(
            machine, "_tableau", lambda sound=machine._tableau: (sound()[0], sound()[1] + 1e-6, sound()[2])
        ),
        _step,
    ),
}


@pytest.mark.parametrize("name", DEFECTS)
def test_caught(name: str, monkeypatch: Patch) -> None:
    spoil, check = DEFECTS[name]
    spoil(monkeypatch)
    with pytest.raises((AssertionError, RuntimeError)):
        check()


def test_sine_that_is_late_is_caught(monkeypatch: Patch) -> None:
    sound = machine.sine_cosine
    monkeypatch.setattr(machine, "sine_cosine", lambda x: tuple(each * (1.0 + 4e-16) for each in sound(x)))
    with pytest.raises(AssertionError):
        test_machine.check_sine()
