"""Claim: the checks of files, checkpoints and refusals catch the defects that are planted for them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from plastica import errors, files, locks
from plastica.doors import running, telling
from plastica.equilibria import limits
from plastica.errors import ArgumentError
from plastica.motion import checkpoint, retention, store
from plastica.motion.history import History
from plastica.study import run as runs
from tests import test_bounds_of_files, test_refusals, test_resuming, test_retention
from tests.defects import Patch, both, replacing
from tests.test_bounds_of_files import sound
from tests.test_teeth import CAUGHT

__all__ = ["sound"]

Check = Callable[[Path, Patch, Path], None]

CHECKS: dict[str, Check] = {
    "a segment in the place of another": lambda folder, *_: test_resuming.check_damage(
        folder / "c", test_resuming.doubled, slice(4, 6)
    ),
    "another number": lambda folder, *_: test_resuming.check_damage(folder / "c", test_resuming.altered, slice(4, 6)),
    "what does not follow": lambda folder, *_: test_resuming.check_splice(folder / "c"),
    "a second process is told": lambda folder, *_: test_resuming.check_second_is_told(folder / "c"),
    "a link is not followed": lambda folder, *_: test_resuming.check_link(folder),
    "a flow that is no power": lambda folder, *_: test_refusals.check_no_power(folder),
    "a full disk": lambda folder, patch, _: test_refusals.check_full_disk(folder, patch),
    "files are settled": lambda folder, patch, _: test_refusals.check_settled(patch, folder),
    "leftovers of kills": lambda folder, *_: test_refusals.check_leftovers(folder),
    "what is read stays": lambda folder, *_: test_refusals.check_sources_stay(folder),
    "what would unpack to more": lambda folder, patch, whole: test_bounds_of_files.check_bomb(
        test_bounds_of_files.many, whole, folder, patch
    ),
    "words never steer": lambda folder, _, whole: test_bounds_of_files.check_words(whole, folder),
    "nothing of a long run's result changes": lambda _, patch, __: test_retention.check_nothing_changes(patch),
    "large states on the disk": lambda folder, patch, _: test_retention.check_on_disk(folder / "c", patch),
    "states are let go": lambda folder, patch, _: test_retention.check_states_are_let_go(folder, patch),
    "memory does not grow with steps": lambda _, patch, __: test_retention.check_growth(patch),
    "values elsewhere": lambda folder, patch, whole: test_bounds_of_files.check_bomb(
        test_bounds_of_files.device, whole, folder, patch
    ),
}


def unchained(whole: Any) -> Any:
    """Any sound segment of the run is taken, whatever it continues."""

    def segment(self: Any, path: Path) -> Any:
        self._seal = str(checkpoint._read(path)["follows"])
        return whole(self, path)

    return segment


def unsealed(_: Any) -> Any:
    """The seal does not depend on what a segment holds."""
    return lambda arrays: "sealed"


def unlocked(_: Any) -> Any:
    """Every lock is free."""
    return lambda descriptor, *, wait=False: True


def through_links(_: Any) -> Any:
    """A folder is made, or found, through a link as well."""
    return lambda path: path.mkdir(exist_ok=True)


def first_slope(_: Any) -> Any:
    """The logarithmic slope at one place is taken for the power of the law."""

    def power(laws: Any) -> tuple[float, float]:
        x = 1e-8
        value = laws.flow.value_at(x)
        exponent = x * laws.flow.slope_at(x) / value
        return exponent, value / x**exponent

    return power


def through_reading(_: Any) -> Any:
    """What was written is settled through a descriptor that only reads."""

    def settle(path: Path) -> None:
        with path.open("rb") as stream:
            files.os.fsync(stream.fileno())

    return settle


def emptied(whole: Any) -> Any:
    """The checkpoint is emptied before the result is saved."""

    def described(scenario: Any, solution: Any) -> Any:
        for folder in Path(scenario.file).parent.glob("out/.*.checkpoint"):
            locks.Held(folder).clear()
        return whole(scenario, solution)

    return described


def without_turns(whole: Any) -> Any:
    """Only the times are looked at, as if the tip hung straight."""
    return lambda history, times, model: whole(
        History(history.t, np.zeros_like(history.y), history.first), times, model
    )


def twice(whole: Any) -> Any:
    """The states of each leg are written twice."""
    return lambda self, leg: (whole(self, leg), whole(self, leg))[1]


def held_on_to(whole: Any) -> Any:
    """The states that lie on the disk stay in memory as well."""
    return lambda self, leg: replace(whole(self, leg), history=leg.history)


def nothing(_: Any) -> Any:
    """Left out."""
    return lambda *_, **__: None


TEETH: list[tuple[str, str, Callable[[Patch], None]]] = [
    ("a segment in the place of another", "no chain", replacing(checkpoint.Checkpoint, "_segment", unchained)),
    ("another number", "no seal", replacing(checkpoint, "_seal", unsealed)),
    ("what does not follow", "no chain", replacing(checkpoint.Checkpoint, "_segment", unchained)),
    ("a second process is told", "locks that are always free", replacing(locks, "take_lock", unlocked)),
    (
        "a link is not followed",
        "followed",
        both(replacing(locks, "make_folder", through_links), replacing(checkpoint, "make_folder", through_links)),
    ),
    ("a flow that is no power", "one slope", replacing(limits, "_power", first_slope)),
    ("a full disk", "taken for a mistake", replacing(running, "exit_code", lambda _: lambda error: telling.MISTAKE)),
    ("a full disk", "the checkpoint goes first", replacing(runs, "described", emptied)),
    ("files are settled", "through a descriptor that reads", replacing(files, "_settle", through_reading)),
    ("files are settled", "the folder is not", replacing(files, "_settle_folder", nothing)),
    ("leftovers of kills", "they stay", replacing(files, "remove_leftovers", nothing)),
    ("leftovers of kills", "those of living processes go too", replacing(files, "take_lock", unlocked)),
    ("what is read stays", "written over", replacing(files, "refuse_overwriting", nothing)),
    ("what would unpack to more", "not looked at before", replacing(store, "_check_size", nothing)),
    ("words never steer", "as they are", replacing(errors, "_escaped", lambda _: lambda character: character)),
    (
        "nothing of a long run's result changes",
        "quarter turns are let go",
        replacing(retention, "needed_steps", without_turns),
    ),
    ("states are let go", "held", replacing(retention.Retention, "_on_disk", held_on_to)),
    ("large states on the disk", "each leg twice", replacing(retention.Retention, "_on_disk", twice)),
    (
        "memory does not grow with steps",
        "all is kept",
        replacing(retention.Retention, "whole", lambda _: property(lambda self: True)),
    ),
    ("values elsewhere", "not looked at before", replacing(store, "_check_size", nothing)),
]


@pytest.mark.parametrize("claim", CHECKS)
def test_passes_without_a_defect(claim: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, sound: Path) -> None:
    CHECKS[claim](tmp_path, monkeypatch, sound)


@pytest.mark.parametrize(("claim", "defect", "spoil"), TEETH, ids=[f"{claim}-{defect}" for claim, defect, _ in TEETH])
def test_catches(
    claim: str,
    defect: str,
    spoil: Callable[[Patch], None],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    sound: Path,
) -> None:
    spoil(monkeypatch)
    with pytest.raises((*CAUGHT, ZeroDivisionError, ArgumentError)):
        CHECKS[claim](tmp_path, monkeypatch, sound)


def test_every_check_has_a_defect() -> None:
    assert {claim for claim, _, _ in TEETH} == set(CHECKS)
