"""Claim: the checks of the seals of sweeps catch the defects that are planted for them."""

from __future__ import annotations

import stat
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from plastica.study import sweep_chunks, sweep_store, sweep_tasks
from plastica.study.sweep_seals import digest_of
from plastica.study.sweep_store import Store
from tests.defects import Patch, replacing
from tests.test_sweep_seals import CHECKS
from tests.test_teeth import CAUGHT


def by_files(self: Store) -> list[int]:
    """A chunk of which a variable has no file is taken for missing."""
    results = self.folder / "results.zarr"
    flat = [each.name for each in self.variables if not each.shape]
    return [
        chunk
        for chunk in range(self.plan.chunks)
        if not all((results / name / "c" / str(chunk)).is_file() for name in flat)
    ]


def of_results_alone(sound: Any) -> Any:
    """What the members take is not sealed."""
    return lambda identity, chunk, columns: sound(
        identity, chunk, {name: column for name, column in columns.items() if "." not in name}
    )


def no_failures(sound: Any) -> Any:
    """Failures are taken for chunks that are not done."""

    def read(self: Store, *given: Any) -> Any:
        found = sound(self, *given)
        if "status" in found:
            found["status"][found["status"] > 2] = -1
        return found

    return read


DEFECTS: dict[str, Callable[[Patch], None]] = {
    "done is told by files": lambda patch: patch.setattr(Store, "missing", by_files),
    "failures are pending": replacing(Store, "read", no_failures),
    "values that are not sealed": replacing(sweep_store, "seal_of", of_results_alone),
    "a seal of any chunk": replacing(sweep_store, "seal_of", lambda sound: lambda i, chunk, held: sound(i, 0, held)),
    "a seal of any sweep": replacing(
        sweep_store, "seal_of", lambda sound: lambda i, chunk, held: sound("", chunk, held)
    ),
    "values of a former store taken as they are": lambda patch: patch.setattr(
        Store,
        "_sealed_by",
        lambda self, seal, chunk, held: (
            digest_of({each.name: held[each.name] for each in self.variables}) == seal
            if self.schema == 1
            else sweep_store.seal_of(self.identity, chunk, held) == seal
        ),
    ),
    "any file is plain": replacing(
        sweep_chunks, "stat", lambda _: SimpleNamespace(S_ISREG=lambda mode: not stat.S_ISFIFO(mode))
    ),
    "any size will do": replacing(sweep_chunks, "_unpacked", lambda _: lambda header: 800),
    "a batch that knows no most steps": replacing(
        sweep_tasks, "_doubtful", lambda _: lambda made, found: np.zeros(len(found["status"]), dtype=bool)
    ),
    "a silent way out": replacing(
        sweep_tasks, "compute", lambda sound: lambda made, rows, apart=None: sound(made, rows)
    ),
    "trouble taken for a result": lambda patch: patch.setattr(sweep_tasks, "StorageError", KeyError),
}

TEETH = [
    ("nothing in a chunk", "done is told by files"),
    ("failures of a whole chunk", "failures are pending"),
    ("files flipped", "done is told by files"),
    ("files truncated", "done is told by files"),
    ("files deleted", "values that are not sealed"),
    ("files another_chunks", "values that are not sealed"),
    ("files another_variables", "values that are not sealed"),
    ("files another_stores", "values that are not sealed"),
    ("whole chunks elsewhere", "a seal of any chunk"),
    ("whole chunks elsewhere", "a seal of any sweep"),
    ("a former store", "values of a former store taken as they are"),
    ("files are looked at", "any file is plain"),
    ("files are looked at", "any size will do"),
    ("a batch ends as single members", "a batch that knows no most steps"),
    ("a slow way is told", "a silent way out"),
    ("trouble is no result", "trouble taken for a result"),
]
"""Which check catches which defect."""


@pytest.mark.parametrize(("claim", "defect"), TEETH)
def test_catches(claim: str, defect: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    DEFECTS[defect](monkeypatch)
    with pytest.raises(CAUGHT):
        CHECKS[claim](tmp_path)


def test_every_defect_is_caught_by_some_check() -> None:
    assert {defect for _, defect in TEETH} == set(DEFECTS)
    assert {claim for claim, _ in TEETH} == set(CHECKS)
