"""Claim: the checks of narrow features of shapes catch the defects planted for them."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from plastica.charts import starts
from plastica.equilibria import rest
from plastica.motion import members, parts, plan
from plastica.physics import initial, narrow, pace
from plastica.physics.pace import Paces
from plastica.study import assembly
from tests import test_narrow_shapes
from tests.defects import Patch, replacing
from tests.test_teeth import CAUGHT

CHECKS: dict[str, Callable[[Path], None]] = {
    "a bell is met": lambda _: test_narrow_shapes.check_met("bell", 0.437, 1e-4),
    "what is missed": lambda _: test_narrow_shapes.check_missed("resonance", 0.3, 1e-4, 16),
    "a run": test_narrow_shapes.check_run_told,
    "a rate": test_narrow_shapes.check_rate_told,
    "many": test_narrow_shapes.check_many_told,
    "rest": test_narrow_shapes.check_rest_told,
    "a check": test_narrow_shapes.check_check_told,
    "pieces and units": lambda _: test_narrow_shapes.check_pieces(40.0),
    "charts": test_narrow_shapes.check_imperfection,
}


def nothing(_sound: Any) -> Any:
    return lambda *_, **__: 0.0


def silent(_sound: Any) -> Any:
    return lambda *_, **__: ()


def as_given(_sound: Any) -> Any:
    return lambda curvature, *_, **__: curvature


def unscaled(_sound: Any) -> Any:
    return lambda self, factor: self


def first_only(_sound: Any) -> Any:
    """Of a shape in pieces only the first is looked at."""
    return lambda made: Paces(made[0].edges, made[0].steps, made[0].hidden)


TEETH: list[tuple[str, str, Callable[[Patch], None]]] = [
    ("a bell is met", "nothing missed, no ends", replacing(narrow, "missed", nothing)),
    ("what is missed", "a piece too wide", lambda patch: patch.setattr(narrow, "STEPS", 1e9)),
    ("what is missed", "samples believed", replacing(Paces, "longest", lambda _: lambda self, a, b: np.inf)),
    ("a run", "nothing missed", replacing(plan, "missed", nothing)),
    ("a run", "nothing said", replacing(plan, "missing", silent)),
    ("a rate", "only the curvature", replacing(plan, "_period", nothing)),
    ("many", "nothing missed", replacing(members, "missed", nothing)),
    ("many", "nothing said", replacing(members, "missing", silent)),
    ("many", "any loss allowed", lambda patch: patch.setattr(parts, "LOST", 1.0)),
    ("rest", "nothing missed", replacing(rest, "missed", nothing)),
    ("a check", "nothing unbounded", replacing(plan, "unbounded", silent)),
    ("a check", "no ends added", replacing(assembly, "met_start", lambda _: lambda model, *given: given)),
    ("pieces and units", "paces in metres", replacing(Paces, "scaled", unscaled)),
    ("pieces and units", "the first piece", replacing(pace, "joined", first_only)),
    ("charts", "no ends added", replacing(starts, "met", as_given)),
]


@pytest.fixture(autouse=True)
def nothing_kept() -> Iterator[None]:
    """What was found without a defect must not be taken up with one, nor the reverse."""
    initial._text.cache_clear()
    yield
    initial._text.cache_clear()


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
