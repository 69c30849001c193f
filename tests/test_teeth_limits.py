"""Claim: the checks on limits and static shapes catch the defects planted for them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import pytest

from plastica.equilibria import endings, limits
from plastica.motion import events, yielding
from tests import test_limits, test_rest

Patch = pytest.MonkeyPatch


def _changed(place: Any, name: str, made: Callable[[Any], Any]) -> Callable[[Patch], None]:
    return lambda patch: patch.setattr(place, name, made(getattr(place, name)))


def _mirrored(sound: Any) -> Any:
    def spoiled(start: Any, margin: Any) -> Any:
        root, code = sound(start, margin)
        return -root, code

    return spoiled


def _jacobian_of_a_longer_rod(patch: Patch) -> None:
    from plastica.equilibria import statics

    sound = statics.load_moment
    patch.setattr(statics, "load_moment", lambda strut, start, end: sound(strut.with_load(_heavier(strut)), start, end))


def _heavier(strut: Any) -> Any:
    import plastica as pl

    return pl.Load(thrust=strut.load.thrust(0.0) * (1.0 + 1e-6), transverse=strut.load.transverse)


DEFECTS: dict[str, Callable[[Patch], None]] = {
    "the rate without the threshold's slope": _changed(
        endings, "rates", lambda sound: lambda start, end: sound(replace(start, side=-start.side), end)
    ),
    "a cube for the square": _changed(limits, "_power", lambda sound: lambda laws: (3.0, sound(laws)[1])),
    "the other root": _changed(endings, "first_roots", _mirrored),
    "the shape of half the thrust": _changed(
        limits, "endings", lambda sound: lambda grid, gamma, *state: sound(grid, 0.999 * gamma, *state)
    ),
    "every halt of the integration an arrest": _changed(
        events, "moving_on_legs", lambda sound: lambda solution: (solution.legs[0], solution.legs[1].reshape(-1, 1))
    ),
    "no arrest is one": _changed(yielding, "_below", lambda sound: lambda *stretch: False),
    "a drive that is known exactly": _changed(
        endings._Members, "blur", lambda sound: lambda self, rtol: 0.0 * self.mu_nat
    ),
    "a thrust a millionth larger": _jacobian_of_a_longer_rod,
}


def _end_of_case_5() -> None:
    limit = test_limits.run(5).limit
    assert limit is not None
    test_limits.check_end(limit, test_limits.reference()[5])


TEETH: list[tuple[Callable[[], None], str]] = [
    (lambda: test_limits.check_tail(5), "a cube for the square"),
    (_end_of_case_5, "the rate without the threshold's slope"),
    (lambda: test_limits.check_never_wrong(3), "the other root"),
    (lambda: test_limits.check_never_wrong(3), "the shape of half the thrust"),
    (lambda: test_limits.check_an_excess_below_the_tolerance(1e6), "every halt of the integration an arrest"),
    (lambda: test_limits.check_an_excess_below_the_tolerance(1e5), "no arrest is one"),
    (lambda: test_limits.check_an_excess_below_the_tolerance(1e7), "a drive that is known exactly"),
    (test_rest.check_buckled, "a thrust a millionth larger"),
]


@pytest.mark.parametrize(("check", "defect"), TEETH, ids=[defect for _, defect in TEETH])
def test_catches(check: Callable[[], None], defect: str, monkeypatch: pytest.MonkeyPatch) -> None:
    check()
    test_limits.run.cache_clear()
    test_limits.faint.cache_clear()
    DEFECTS[defect](monkeypatch)
    with pytest.raises(AssertionError):
        check()
    test_limits.run.cache_clear()
    test_limits.faint.cache_clear()


def test_every_defect_has_a_check() -> None:
    assert {defect for _, defect in TEETH} == set(DEFECTS)
