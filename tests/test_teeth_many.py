"""Claim: the checks on many struts at once catch the defects planted for them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from plastica.material import anywhere
from plastica.motion import courses, members, parts
from plastica.motion.integrate import Stretch
from plastica.numerics import block, dop853, stepper
from plastica.numerics.arrays import Arrays
from plastica.numerics.block import Block
from plastica.physics import batch
from plastica.physics.batch import Struts
from tests import test_many, test_many_asked, test_stepper

Patch = pytest.MonkeyPatch
Defect = Callable[[Patch], None]


def _changed(place: Any, name: str, made: Callable[[Any], Any]) -> Defect:
    return lambda patch: patch.setattr(place, name, made(getattr(place, name)))


def _digit(name: str, change: Callable[[Any], Any]) -> Defect:
    """A coefficient with a wrong digit, in tables that are made anew."""

    def spoil(patch: Patch) -> None:
        patch.setattr(dop853, name, change(getattr(dop853, name)))
        for table in ("_stages", "_result"):
            patch.setattr(block, table, getattr(block, table).__wrapped__)

    return spoil


def _one_step_for_all(sound: Any) -> Any:
    def spoiled(self: Block, *arguments: Any) -> None:
        sound(self, *arguments)
        self.h = np.full_like(self.h, np.nanmin(self.h))

    return spoiled


def _one_error_for_all(sound: Any) -> Any:
    def spoiled(self: Block, h: Any) -> Any:
        new, error, still = sound(self, h)
        return new, np.full_like(error, error.max()), still

    return spoiled


def _hasty(sound: Any) -> Any:
    """Whatever a leg begins with counts as slower than before."""

    def spoiled(self: Block, *arguments: Any) -> None:
        sound(self, *arguments)
        self.speed = np.full_like(self.speed, np.inf)

    return spoiled


def _belittled(sound: Any) -> Any:
    def spoiled(self: Block, h: Any) -> Any:
        new, error, still = sound(self, h)
        return new, 1e-4 * error, still

    return spoiled


def _leaking(sound: Any) -> Any:
    """Part of each column is carried over into the next, a last bit of it."""

    def spoiled(self: Block, h: Any) -> Any:
        new, error, still = sound(self, h)
        return new + 1e-30 * np.roll(new, 1, axis=1), error, still

    return spoiled


def _restless(sound: Any) -> Any:
    def spoiled(self: Struts, arrays: Arrays, width: int) -> Any:
        rate = sound(self, arrays, width)
        return lambda mean, mu_nat, p: rate(mean, mu_nat, p) + 1e-12

    return spoiled


def _one_sided(sound: Any) -> Any:
    """The drive yields in one direction only."""

    def spoiled(self: Struts, arrays: Arrays, width: int) -> Any:
        rate = sound(self, arrays, width)
        return lambda mean, mu_nat, p: np.maximum(rate(mean, mu_nat, p), 0.0)

    return spoiled


def _functions(**others: Any) -> Defect:
    return _changed(anywhere, "_functions", lambda sound: lambda xp: {**sound(xp), **others})


def _hiding(x: Any, is_one: Any, xp: Any) -> Any:
    return xp.where(is_one, xp.ones_like(x), xp.zeros_like(x))


def _forgetful_put(patch: Patch) -> None:
    patch.setattr(Arrays, "put", lambda self, target, index, values: target)


def _no_landing(patch: Patch) -> None:
    patch.setattr(courses, "itinerary", lambda strut, start, end: (Stretch(start, end),))
    patch.setattr(courses, "_is_straight", lambda program, end: program.constant)


def _factor_forgotten(sound: Any) -> Any:
    return lambda given, i: sound(replace(given, factor=np.ones(given.count)), i)


def _reading(name: str, change: Callable[[Any], Any]) -> Defect:
    def made(sound: Any) -> Any:
        def spoiled(*arguments: Any) -> Any:
            found = sound(*arguments)
            return {**found, name: change(found[name])}

        return spoiled

    return _changed(batch, "_readings", made)


DEFECTS: dict[str, tuple[Defect, Callable[[], None]]] = {
    "booleans taken for numbers": (
        _changed(members, "_real", lambda _: lambda given: np.asarray(given, dtype=float)),
        lambda: test_many_asked.check_refused("booleans"),
    ),
    "a digit of a weight": (
        _digit("B", lambda sound: {**sound, 7: sound[7] + 1e-9}),
        test_stepper.check_coefficients,
    ),
    "a stage that takes a little less": (
        _digit("A", lambda sound: (*sound[:6], {**sound[6], 3: sound[6][3] * 0.999}, *sound[7:])),
        test_stepper.check_order,
    ),
    "errors a ten-thousandth": (
        _changed(Block, "_new_state_and_error", _belittled),
        test_stepper.check_accuracy,
    ),
    "one step for all": (_changed(Block, "_next_steps", _one_step_for_all), test_stepper.check_accuracy),
    "one error for all": (_changed(Block, "_new_state_and_error", _one_error_for_all), test_many.check_neighbours),
    "a member that poisons the next": (_changed(Block, "_new_state_and_error", _leaking), test_many.check_neighbours),
    "columns that BLAS treats apart": (
        lambda patch: patch.setattr(stepper, "LANES", 1),
        test_many.check_order_and_number,
    ),
    "chunks in the wrong order": (
        lambda patch: patch.setattr("plastica.motion.many.join", lambda found: parts.join(found[::-1])),
        test_many.check_order_and_number,
    ),
    "a watch that sleeps": (lambda patch: patch.setattr(stepper, "WATCH_EVERY", 10**9), test_stepper.check_watch),
    "nothing is too stiff": (
        lambda patch: patch.setattr(stepper, "LOOK_EVERY", 10**9),
        lambda: _within_steps(test_stepper.check_each_has_its_end),
    ),
    "an update that is lost": (_forgetful_put, test_stepper.check_updates),
    "jumps stepped over": (_no_landing, test_many.check_legs),
    "a factor that is lost in single runs": (
        _changed(parts, "_member", _factor_forgotten),
        test_many.check_neighbours,
    ),
    "corners taken lightly": (lambda patch: patch.setattr(block, "STRICTER", 1.0), test_many.check_corners),
    "at rest too early": (lambda patch: patch.setattr(block, "AT_REST", 1e4), test_many.check_rest),
    "growth taken for rest": (_changed(Block, "on_legs", _hasty), test_many.check_unrest),
    "never at rest": (lambda patch: patch.setattr(block, "AT_REST", 0.0), test_many.check_rest),
    "a natural curvature that is never at rest": (
        _changed(Struts, "_natural_rate", _restless),
        test_many.check_frozen,
    ),
    "yielding to one side": (_changed(Struts, "_natural_rate", _one_sided), test_many.check_mirror),
    "a positive part that is negative": (_functions(pos=lambda x: x), test_many.check_laws_anywhere),
    "a step that hides nan": (
        lambda patch: patch.setattr(anywhere, "_stepped", _hiding),
        test_many.check_laws_anywhere,
    ),
    "a tip that is mirrored": (_reading("tip_y", lambda found: -found), test_many.check_agreement_with_solve),
    "a drive of the whole preference": (
        _reading("drive", lambda found: found * (1.0 + 1e-6)),
        test_many.check_agreement_with_solve,
    ),
    "a start that is not in units of the length": (
        _changed(
            members,
            "_numbers",
            lambda sound: lambda given, where, *rest: sound(given, where, *rest)
            * (1.001 if where == "natural_curvature" else 1.0),
        ),
        test_many.check_units,
    ),
    "a grid that is never too coarse": (
        _changed(parts, "_watch", lambda sound: lambda given, rtol: sound(given, 1.0)),
        test_many.check_nodes_chosen,
    ),
    "chunks that are kept": (
        lambda patch: patch.setattr("plastica.motion.many._Runs._parts", _hoarding),
        test_many.check_memory,
    ),
}


def _hoarding(self: Any, pieces: Any, settings: Any) -> Any:
    kept = [(parts.run_part(piece, settings), np.zeros((piece.count, 200))) for piece in pieces]
    return iter([part for part, _ in kept])


def _within_steps(check: Callable[[], None]) -> None:
    """Run a check whose members would never end, and count that as caught."""
    from plastica.numerics.stepper import _Run

    sound, count = _Run._renewed, 0

    def counted(self: Any) -> None:
        nonlocal count
        count += 1
        assert count < 4000, "members that never end"
        sound(self)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(_Run, "_renewed", counted)
        check()


@pytest.mark.parametrize("name", DEFECTS)
def test_caught(name: str, monkeypatch: Patch) -> None:
    spoil, check = DEFECTS[name]
    # The sound results that a check compares with are those of the sound program.
    test_many.healthy()
    spoil(monkeypatch)
    with pytest.raises((AssertionError, RuntimeError)):
        check()


@pytest.mark.parametrize("term", ["thrust", "weight", "natural"])
def test_a_rate_with_a_wrong_term_is_caught(term: str, monkeypatch: Patch) -> None:
    sound = Struts.rate

    def spoiled(self: Struts, arrays: Arrays, width: int) -> Any:
        rate, n = sound(self, arrays, width), self.strut.grid.size

        def wrong(t: Any, y: Any, p: Any, out: Any) -> Any:
            found = rate(t, y, p, out)
            if term == "natural":
                found[n] *= 1.0 + 1e-9
            elif term == "thrust" or self.forces.kinds != ("thrust",):
                found[:n] += 1e-10 * np.sin(y[:n])
            return found

        return wrong

    import plastica as pl

    strut = pl.Strut(test_many.MATERIAL, pl.Load(thrust=2.0), pl.Grid(12))
    test_many.check_rate(strut, 0.5, 7)
    monkeypatch.setattr(Struts, "rate", spoiled)
    with pytest.raises(AssertionError):
        test_many.check_rate(strut, 0.5, 7)
