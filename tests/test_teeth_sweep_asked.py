"""Claim: the checks of what is asked of a sweep catch the defects that are planted for them."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from plastica.errors import PlasticaError
from plastica.material import rows
from plastica.study import (
    sweep,
    sweep_axes,
    sweep_batch,
    sweep_judged,
    sweep_plan,
    sweep_reading,
    sweep_schema,
    sweep_trial,
)
from plastica.study.reading import document_of
from tests import test_material_rows, test_sweep, test_sweep_members
from tests.defects import Patch, replacing
from tests.swept import plan
from tests.test_teeth import CAUGHT

Check = Callable[[Path], None]


def jumping(_: Path) -> None:
    test_sweep.check_nothing_depends_on_the_chunk(plan({"initial.curvature": test_sweep.JUMPS}))


def accepted(check: Check) -> Check:
    """A check that fails where what should be accepted is refused."""

    def checked(folder: Path) -> None:
        try:
            check(folder)
        except PlasticaError as error:
            pytest.fail(f"refused: {error}")

    return checked


def texts_by_equals(sound: Any) -> Any:
    return lambda given: document_of(given, "scenario.toml") if "=" in str(given) else sound(given)


def one_batch(_: Any) -> Any:
    return lambda made, columns, shapes: [np.ones(len(next(iter(columns.values()))), dtype=bool)]


def unseen(*given: Any) -> Any:
    """A hypothesis that always holds."""
    return np.zeros(len(next(each for each in reversed(given) if isinstance(each, tuple))[0]), dtype=np.int8)


MISSPELT = "load.trust = [1.0]"
TWICE = 'load.thrust = [1.0]\n"load.thrust" = [2.0]'

CHECKS: dict[str, Check] = {
    "amplitudes are numbers": lambda _: test_sweep_members.check_amplitudes(["big", "small"]),
    "whole ranges are whole": lambda _: test_sweep_members.check_whole_ranges(),
    "a count is no range": lambda _: test_sweep_members.check_words_of_a_range(),
    "misspelt keys are told": lambda folder: test_sweep_members.check_keys_before_anything(MISSPELT, folder),
    "a key is varied once": lambda folder: test_sweep_members.check_keys_before_anything(TWICE, folder),
    "chunks are bounded": lambda _: test_sweep_members.check_chunk_is_bounded(),
    "another sampling gives way": accepted(test_sweep_members.check_another_sampling),
    "a name may have an equals sign": accepted(test_sweep_members.check_paths_with_equals),
    "lists go together": accepted(test_sweep_members.check_lists_are_tried_as_they_go_together),
    "shapes that jump do not touch one another": jumping,
    "states share their nodes": lambda _: test_sweep.check_states_share_their_nodes(),
    "inadmissible members are refused": lambda _: test_sweep.check_inadmissible_members("by formula"),
    "on their own range": lambda _: test_sweep.check_inadmissible_members("on a range"),
    "wells are found": lambda _: test_material_rows.check_sorted_as_judged("wells that are hardly too deep"),
    "lopsided laws are found": lambda _: test_material_rows.check_sorted_as_judged("lopsided"),
    "laws are seen far out": lambda _: test_material_rows.check_sorted_as_judged("negative far out"),
    "kinks are found": lambda _: test_material_rows.check_sorted_as_judged("powers"),
    "flows that turn are found": lambda _: test_material_rows.check_sorted_as_judged("flow that turns back"),
    "levelling off is left to the judge": lambda _: test_material_rows.check_sorted_as_judged("energy that levels off"),
    "unrest is left to the judge": lambda _: test_material_rows.check_sorted_as_judged("not at rest at 0"),
}

DEFECTS: dict[str, Callable[[Patch], None]] = {
    "the place of a text for a factor": replacing(sweep_axes, "_check_factors", lambda _: lambda given: None),
    "no range is whole": replacing(sweep_axes, "_all_whole", lambda _: lambda values: False),
    "every range is whole": replacing(sweep_axes, "_all_whole", lambda _: lambda values: True),
    "any word makes a range": replacing(sweep_axes, "_ENDS", lambda _: frozenset(sweep_axes._RANGE)),
    "keys read by the sweep alone": replacing(sweep_schema, "read_axes", lambda _: lambda *given, **words: None),
    "the first of two keys": replacing(
        sweep_axes, "flattened", lambda sound: lambda *given: iter(dict(sound(*given)).items())
    ),
    "chunks of any size": lambda patch: patch.setattr(sweep_schema, "MOST_IN_A_CHUNK", 10**15),
    "what belongs to another sampling stays": replacing(sweep_reading, "_left", lambda _: lambda own, sampling: own),
    "an equals sign makes a text": replacing(sweep, "_document", texts_by_equals),
    "lists tried one key at a time": replacing(sweep_trial, "_refused_members", lambda _: sweep_trial._refused_values),
    "one grid for all shapes": replacing(sweep_batch, "_alike", one_batch),
    "states of any grid": replacing(sweep_plan.Plan, "keeps", lambda _: lambda self, grid: True),
    "no material is judged": replacing(
        sweep_batch, "inadmissible", lambda _: lambda made, v, thrust, shapes: np.zeros(len(v), dtype=bool)
    ),
    "any doubt is enough": replacing(
        sweep_judged, "_judged", lambda _: lambda made, v, codes: np.asarray(codes != rows.HOLDS)
    ),
    "no doubt is enough": replacing(
        sweep_judged, "_judged", lambda _: lambda made, v, codes: np.asarray(codes == rows.FAILS)
    ),
    "the ladder alone": replacing(rows, "_wells", lambda _: lambda law, x, v, some: iter(())),
    "one side alone": replacing(rows, "_even", lambda _: unseen),
    "near 0 alone": lambda patch: patch.setattr(rows, "LADDER", rows.LADDER[:100]),
    "kinks not looked for": replacing(rows, "_without_kink", lambda _: unseen),
    "flows not looked at": lambda patch: patch.setattr(rows, "EXCESS", rows.EXCESS[:40]),
    "growth not looked at": replacing(rows, "_growing", lambda _: unseen),
    "rest not looked at": replacing(rows, "_flat_at_0", lambda _: unseen),
}

TEETH = [
    ("amplitudes are numbers", "the place of a text for a factor"),
    ("whole ranges are whole", "no range is whole"),
    ("whole ranges are whole", "every range is whole"),
    ("a count is no range", "any word makes a range"),
    ("misspelt keys are told", "keys read by the sweep alone"),
    ("a key is varied once", "the first of two keys"),
    ("chunks are bounded", "chunks of any size"),
    ("another sampling gives way", "what belongs to another sampling stays"),
    ("a name may have an equals sign", "an equals sign makes a text"),
    ("lists go together", "lists tried one key at a time"),
    ("shapes that jump do not touch one another", "one grid for all shapes"),
    ("states share their nodes", "states of any grid"),
    ("inadmissible members are refused", "no material is judged"),
    ("on their own range", "any doubt is enough"),
    ("on their own range", "no doubt is enough"),
    ("wells are found", "the ladder alone"),
    ("lopsided laws are found", "one side alone"),
    ("laws are seen far out", "near 0 alone"),
    ("kinks are found", "kinks not looked for"),
    ("flows that turn are found", "flows not looked at"),
    ("levelling off is left to the judge", "growth not looked at"),
    ("unrest is left to the judge", "rest not looked at"),
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
