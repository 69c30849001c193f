"""Claim: the checks of sweeps catch the defects that are planted for them."""

from __future__ import annotations

import re
from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import plastica as pl
from plastica.doors import sweep as doors
from plastica.physics.initial import Shape
from plastica.show import regimes
from plastica.study import (
    sweep_aside,
    sweep_axes,
    sweep_batch,
    sweep_cluster,
    sweep_create,
    sweep_differences,
    sweep_engines,
    sweep_interest,
    sweep_member,
    sweep_members,
    sweep_plan,
    sweep_store,
    sweep_tasks,
)
from plastica.study.sweep_store import Store, open_store
from tests import (
    test_sweep,
    test_sweep_crash,
    test_sweep_doors,
    test_sweep_leftovers,
    test_sweep_making,
    test_sweep_maps,
    test_sweep_members,
    test_sweep_store,
    test_sweep_text,
)
from tests.commandline import written
from tests.defects import Patch, replacing
from tests.swept import REGIME_SWEEP, plan
from tests.test_teeth import CAUGHT

Check = Callable[[Path], None]


def regime_sweep(folder: Path) -> pl.Sweep:
    return pl.sweep(written(folder, REGIME_SWEEP), store=folder / "s.sweep", workers=0)


def damaged(kind: str) -> Check:
    return lambda folder: test_sweep_store.check_damage_is_mended(
        test_sweep_store.made(folder), *test_sweep_store.DAMAGE[kind]
    )


def absent(kind: str) -> Check:
    return lambda folder: test_sweep_store.check_absence_is_told(folder, kind)


def interrupted(folder: Path) -> None:
    test_sweep_store.check_interrupted_anywhere(folder, test_sweep_store.made(folder, "whole.sweep"))


def empty_folder(folder: Path) -> None:
    (folder / "taken").mkdir()
    test_sweep_making.check_empty_folder(folder / "taken", test_sweep_store.made(folder, "whole.sweep"))


def independent(_: Path) -> None:
    over = {"load.thrust": {"from": 0.5, "to": 6.0, "count": 4}}
    test_sweep.check_nothing_depends_on_the_chunk(plan(over))


def latin(_: Path) -> None:
    members = sweep_members.members_of(test_sweep_members.LATIN, "latin-hypercube", 40, 7)
    test_sweep_members.check_latin(members)


CHECKS: dict[str, Check] = {
    "a missing variable is mended": damaged("a variable is missing"),
    "a turned bit is mended": damaged("a bit is turned"),
    "another's chunk is mended": damaged("the chunk is another's"),
    "a missing seal is mended": damaged("a seal is missing"),
    "an overwritten status is told": absent("a status is no chunk"),
    "an absent variable is told": absent("a variable is missing"),
    "a key that differs is told": lambda folder: test_sweep_making.check_differences_are_told(folder, "a key"),
    "versions that differ are told": lambda folder: test_sweep_making.check_differences_are_told(folder, "versions"),
    "a writer survives being tidied": test_sweep_store.check_tidied_while_writing,
    "a small disk is told": test_sweep_making.check_disk_is_told,
    "an empty folder is taken": empty_folder,
    "what is varied is a coordinate": test_sweep_making.check_coordinates,
    "interrupted anywhere": interrupted,
    "a killed creation leaves nothing": test_sweep_leftovers.check_killed,
    "others' folders stay": test_sweep_leftovers.check_others,
    "a hopeless chunk is told": test_sweep_crash.check_hopeless_chunk,
    "what is wanted is checked first": test_sweep_doors.check_refused_before,
    "addresses are judged": lambda _: test_sweep_doors.check_addresses(),
    "the wait for workers is told": test_sweep_crash.check_wait_is_told,
    "members do not touch one another": independent,
    "members are as they are alone": lambda _: test_sweep.check_members_alone("thrust and material"),
    "amplitudes are as they are alone": lambda _: test_sweep.check_members_alone("amplitude of a shape"),
    "a set to come is a set": lambda _: test_sweep.check_members_alone("a set that is yet to come"),
    "a Latin hypercube is one": latin,
    "boundaries are boundaries": lambda folder: test_sweep.check_interesting(regime_sweep(folder)),
    "a member says what it takes": lambda folder: test_sweep_text.check_text(folder, "a formula"),
    "a measured member says what it takes": lambda folder: test_sweep_text.check_text(folder, "measured points"),
    "scales suit the values": test_sweep_maps.check_scales,
    "every pair is drawn or named": test_sweep_maps.check_pairs,
    "the legend shows what is drawn": test_sweep_maps.check_legend,
    "tables at an axis": test_sweep_maps.check_tables,
    "held in the middle": test_sweep_maps.check_middle,
    "neighbours by their values": test_sweep_maps.check_neighbours,
    "the map is of the members": lambda folder: test_sweep_doors.check_map(regime_sweep(folder)),
}


def poisoned(sound: Any) -> Any:
    """Each member takes a little of the one beside it."""

    def compute(made: Any, values: Any) -> Any:
        columns = sound(made, values)
        columns["tip_y"] = columns["tip_y"] + 1e-15 * np.roll(columns["tip_y"], 1)
        return columns

    return compute


def seal(store: Store, chunk: int, columns: Any) -> np.ndarray:
    """The right seal of a chunk whose members take what is planned."""
    rows = store.plan.members.between(*store.plan.span(chunk))
    taken = {axis.key: row for axis, row in zip(store.plan.axes, rows.T, strict=True)}
    return np.frombuffer(sweep_store.seal_of(store.identity, chunk, {**taken, **columns}), dtype=np.uint8)


def seal_first(self: Store, chunk: int, columns: Any) -> None:
    first, last = self.plan.span(chunk)
    self.arrays["seal"][chunk] = seal(self, chunk, columns)
    for name in columns:
        self.arrays[name][first:last] = columns[name]


def refusing(read: Any) -> Any:
    """What cannot be read makes the whole store unreadable."""
    assert not read[1], "is damaged"
    return read


def without_coordinates(sound: Any) -> Any:
    """The group does not say which of its arrays are coordinates."""

    def fill(path: Path, made: Any) -> None:
        sound(path, made)
        file = path / "zarr.json"
        file.write_text(file.read_text().replace('"coordinates"', '"others"'))

    return fill


def write_once(self: Store, chunk: int, columns: Any) -> None:
    with suppress(FileNotFoundError):
        self._write(chunk, columns)


def status_first(self: Store, chunk: int, columns: Any) -> None:
    first, last = self.plan.span(chunk)
    for name in sorted(columns, key=lambda each: each != "status"):
        self.arrays[name][first:last] = columns[name]
    self.arrays["seal"][chunk] = seal(self, chunk, columns)


def no_chunk_given_back(sound: Any) -> Any:
    """The chunk of a worker that has died is given to nobody."""

    def mourn(self: Any, hand: Any) -> None:
        hand.chunk = None
        sound(self, hand)
        self.tries.clear()

    return mourn


def moved_only(sound: Any) -> Any:
    """What has not moved yet counts as sprung back."""
    return lambda **told: sound(**told | {name: 0.0 * told[name] for name in ("let_go", "relaxed")})


def spoil_existence(patch: Patch) -> None:
    patch.setattr(Store, "is_done", lambda self, chunk: bool(np.asarray(self.arrays["seal"][chunk]).any()))


def spoil_digest(patch: Patch) -> None:
    patch.setattr(sweep_store, "seal_of", lambda identity, chunk, columns: b"0123456789abcdef" * 2)


def spoil_forgetting(patch: Patch) -> None:
    sound = Store.missing
    patch.setattr(Store, "missing", lambda self: sound(self)[:-1])


def spoil_zeal(patch: Patch) -> None:
    """Everything is computed again, whether it is there or not."""
    patch.setattr(Store, "is_done", lambda self, chunk: False)


def shuffled_shares(patch: Patch) -> None:
    """Drawn independently: a random sample in place of a Latin hypercube."""
    sound = sweep_members.Members.between

    def between(self: Any, first: int, last: int) -> Any:
        return sound(replace(self, sampling="random") if self.sampling == "latin-hypercube" else self, first, last)

    patch.setattr(sweep_members.Members, "between", between)


def re_without_limits() -> Any:
    """Regular expressions that take a name for any that begins as it does."""
    return SimpleNamespace(escape=re.escape, compile=lambda text: re.compile(text.replace("{8}", "+.*")))


def all_is_there(sound: Any) -> Any:
    """Once something has been computed, nothing is missing."""

    def wrong(store: Store) -> list[int]:
        missing: list[int] = sound(store)
        return missing if len(missing) == test_sweep_store.CHUNKS else []

    return wrong


DEFECTS: dict[str, Callable[[Patch], None]] = {
    "existence taken for content": spoil_existence,
    "a digest of nothing": spoil_digest,
    "a store that forgets a chunk": spoil_forgetting,
    "a store that computes everything again": spoil_zeal,
    "a chunk that is none stops all": replacing(
        Store, "_read", lambda sound: lambda self, *where: refusing(sound(self, *where))
    ),
    "all is there": replacing(Store, "missing", all_is_there),
    "keys that nobody compares": replacing(sweep_differences, "_unlike", lambda _: lambda *both: iter(())),
    "any sweep will do": replacing(sweep_create, "_taken_up", lambda _: lambda target, made: open_store(target)),
    "a writer that gives up": lambda patch: patch.setattr(Store, "write", Store._write),
    "a writer that takes all for done": lambda patch: patch.setattr(Store, "write", write_once),
    "room for results alone": replacing(sweep_create, "SPARE", lambda _: 0),
    "an empty folder taken for something": replacing(sweep_create, "_empty", lambda _: lambda target: False),
    "nothing but variables": replacing(sweep_create, "_fill_results", without_coordinates),
    "the seal written first": lambda patch: patch.setattr(Store, "write", seal_first),
    "the status written first": lambda patch: patch.setattr(Store, "write", status_first),
    "leftovers that stay": replacing(sweep_create, "remove_leftovers", lambda _: lambda target: None),
    "a lock that nobody heeds": replacing(sweep_aside, "take_lock", lambda _: lambda mark, *, wait: True),
    "any age is enough": lambda patch: patch.setattr(sweep_aside, "LONG", -1.0),
    "any name is ours": replacing(sweep_aside, "re", lambda _: re_without_limits()),
    "a dead worker's chunk given to nobody": replacing(sweep_engines._Crew, "_mourn", no_chunk_given_back),
    "what is wanted judged in the end": replacing(doors, "_check_wanted", lambda _: lambda *wanted: None),
    "any folder will do": replacing(doors, "_may_write", lambda _: lambda folder: True),
    "any address will do": replacing(sweep_engines, "check_address", lambda _: lambda scheduler: None),
    "a protocol of nobody's": replacing(
        sweep_cluster, "_ADDRESS", lambda sound: re.compile(sound.pattern.replace("tcp|", "tcp|foo|"))
    ),
    "a wait for nobody knows whom": replacing(
        sweep_engines,
        "on_dask",
        lambda sound: lambda store, chunks, workers, scheduler, waits: sound(
            store, chunks, workers, scheduler, lambda whom: waits("somebody")
        ),
    ),
    "a member that poisons its neighbours": replacing(sweep_tasks, "compute_together", poisoned),
    "members in another order": replacing(
        sweep_tasks, "compute_together", lambda sound: lambda made, v: sound(made, v[::-1])
    ),
    "the amplitude left out": replacing(
        sweep_batch,
        "_start",
        lambda sound: (
            lambda made, c, shapes: sound(made, {k: v for k, v in c.items() if k != "initial.amplitude"}, shapes)
        ),
    ),
    "only what has moved keeps a set": replacing(sweep_batch, "Rows", moved_only),
    "a random sample for a Latin hypercube": shuffled_shares,
    "any members for neighbours": replacing(
        sweep_interest,
        "_neighbours",
        lambda sound: lambda store, *rest: ((b, np.roll(a, 7)) for a, b in sound(store, *rest)),
    ),
    "the text of the base": replacing(
        sweep_plan,
        "member_document",
        lambda sound: lambda document, *a, **b: replace(sound(document, *a, **b), text=document.text),
    ),
    "the amplitude left out of the text": replacing(
        sweep_member, "toml_text", lambda sound: lambda data, told: sound({**data, "initial": {}}, told)
    ),
    "factors of measured points left out": replacing(Shape, "times", lambda _: lambda self, factor: self),
    "ranges that are always linear": replacing(
        regimes, "_log", lambda sound: lambda axis: axis.listed and sound(axis)
    ),
    "lists that are always linear": replacing(
        regimes, "_log", lambda sound: lambda axis: not axis.listed and sound(axis)
    ),
    "four keys at most": replacing(regimes, "MOST_KEYS", lambda _: 4),
    "patches for points": replacing(
        regimes, "_legend", lambda sound: lambda figure, codes, rest, *, mapped: sound(figure, codes, rest, mapped=True)
    ),
    "labels cut short": replacing(regimes, "shortened", lambda _: lambda words: [word[:24] for word in words]),
    "tables as Python writes them": replacing(sweep_axes, "toml_value", lambda _: str),
    "the middle of the list": replacing(regimes, "_middle", lambda _: lambda axis: axis.values.size // 2),
    "neighbours in the order of the list": replacing(
        sweep_interest,
        "_neighbours",
        lambda _: lambda store, count, missing: iter([(np.arange(count - 1), np.arange(1, count))]),
    ),
    "the map turned about": replacing(
        regimes, "_map", lambda sound: lambda ax, sweep, codes, i, j: sound(ax, sweep, codes[::-1], i, j)
    ),
}

TEETH = [
    ("a missing variable is mended", "existence taken for content"),
    ("a missing variable is mended", "a store that forgets a chunk"),
    ("a missing variable is mended", "a store that computes everything again"),
    ("a turned bit is mended", "existence taken for content"),
    ("another's chunk is mended", "a digest of nothing"),
    ("another's chunk is mended", "existence taken for content"),
    ("a missing seal is mended", "a store that forgets a chunk"),
    ("an overwritten status is told", "a chunk that is none stops all"),
    ("an absent variable is told", "all is there"),
    ("a key that differs is told", "keys that nobody compares"),
    ("a key that differs is told", "any sweep will do"),
    ("versions that differ are told", "keys that nobody compares"),
    ("a writer survives being tidied", "a writer that gives up"),
    ("a writer survives being tidied", "a writer that takes all for done"),
    ("a small disk is told", "room for results alone"),
    ("an empty folder is taken", "an empty folder taken for something"),
    ("what is varied is a coordinate", "nothing but variables"),
    ("interrupted anywhere", "a store that forgets a chunk"),
    ("interrupted anywhere", "the seal written first"),
    ("interrupted anywhere", "the status written first"),
    ("interrupted anywhere", "a store that computes everything again"),
    ("a killed creation leaves nothing", "leftovers that stay"),
    ("a killed creation leaves nothing", "a lock that nobody heeds"),
    ("others' folders stay", "leftovers that stay"),
    ("others' folders stay", "any age is enough"),
    ("others' folders stay", "any name is ours"),
    ("a hopeless chunk is told", "a dead worker's chunk given to nobody"),
    ("what is wanted is checked first", "what is wanted judged in the end"),
    ("what is wanted is checked first", "any folder will do"),
    ("addresses are judged", "any address will do"),
    ("addresses are judged", "a protocol of nobody's"),
    ("the wait for workers is told", "a wait for nobody knows whom"),
    ("members do not touch one another", "a member that poisons its neighbours"),
    ("members are as they are alone", "members in another order"),
    ("amplitudes are as they are alone", "the amplitude left out"),
    ("a set to come is a set", "only what has moved keeps a set"),
    ("a Latin hypercube is one", "a random sample for a Latin hypercube"),
    ("boundaries are boundaries", "any members for neighbours"),
    ("a member says what it takes", "the text of the base"),
    ("a member says what it takes", "the amplitude left out of the text"),
    ("a measured member says what it takes", "the text of the base"),
    ("a measured member says what it takes", "factors of measured points left out"),
    ("scales suit the values", "ranges that are always linear"),
    ("scales suit the values", "lists that are always linear"),
    ("every pair is drawn or named", "four keys at most"),
    ("the legend shows what is drawn", "patches for points"),
    ("tables at an axis", "labels cut short"),
    ("tables at an axis", "tables as Python writes them"),
    ("held in the middle", "the middle of the list"),
    ("neighbours by their values", "neighbours in the order of the list"),
    ("the map is of the members", "the map turned about"),
]
"""Which check catches which defect."""


@pytest.mark.parametrize("claim", CHECKS)
def test_passes_without_a_defect(claim: str, tmp_path: Path) -> None:
    CHECKS[claim](tmp_path)


@pytest.mark.parametrize(("claim", "defect"), TEETH)
def test_catches(claim: str, defect: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    DEFECTS[defect](monkeypatch)
    with pytest.raises(CAUGHT):
        CHECKS[claim](tmp_path)


def test_every_defect_is_caught_by_some_check() -> None:
    assert {defect for _, defect in TEETH} == set(DEFECTS)
    assert {claim for claim, _ in TEETH} == set(CHECKS)
