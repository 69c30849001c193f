"""Claim: a path that is none, and a file that is no result, are told from one another in one sentence."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import plastica as pl
from plastica.errors import ArgumentError, FileError
from plastica.files import check_schema, read_bytes, write_whole
from plastica.motion.checkpoint import Checkpoint
from plastica.study.sweep_create import create
from plastica.study.sweep_store import PLAN
from tests.support import pair
from tests.swept import plan

DATA = Path(__file__).parent / "data"


@pytest.fixture(scope="module")
def sol() -> pl.Solution:
    return pl.solve(pl.Strut(pair("A", 2.0), pl.Load(thrust=1.0), pl.Grid(4)), 0.1, until=0.5, rtol=1e-4)


@pytest.mark.parametrize("path", [5, None, 1.5, b"run.nc", ["run.nc"]])
def test_a_path_is_text_or_a_path(path: object, sol: pl.Solution) -> None:
    for use in (
        pl.read,
        sol.save,
        lambda path: read_bytes(path, limit=10),
        lambda path: write_whole(path, lambda aside: None),
    ):
        with pytest.raises(ArgumentError, match="`path` must be a path, as text or a Path, but is"):
            use(path)  # type: ignore[arg-type]
    with pytest.raises(ArgumentError, match="`checkpoint` must be a path, as text or a Path, but is"):
        Checkpoint(path, "run")  # type: ignore[arg-type]


def test_what_is_no_regular_file_is_said_to_be_what_it_is(tmp_path: Path) -> None:
    with pytest.raises(FileError, match="is a folder, not a file"):
        pl.read(tmp_path)
    with pytest.raises(FileError, match="is not a regular file"):
        pl.read("/dev/null")
    with pytest.raises(FileError, match="does not exist"):
        pl.read(str(tmp_path / "nothing.nc"))


def test_names_that_no_system_takes(tmp_path: Path, sol: pl.Solution) -> None:
    with pytest.raises(FileError, match=r"cannot be read|does not exist"):
        pl.read("a\0b")
    with pytest.raises(FileError, match="cannot be written"):
        sol.save(tmp_path / "a\0b.nc")
    with pytest.raises(FileError, match="cannot be made a folder"):
        Checkpoint(tmp_path / "a\0b", "run")


def result_of_version(folder: Path, schema: int) -> None:
    import h5py

    path = pl.read(DATA / "result_v1.nc").save(folder / f"run{schema}.nc")
    with h5py.File(path, "r+") as file:
        file.attrs["plastica_schema"] = schema
    pl.read(path)


def sweep_of_version(folder: Path, schema: int) -> None:
    made = create(folder / f"{schema}.sweep", plan({"load.thrust": [1.0, 2.0]}))
    described = json.loads((made.folder / PLAN).read_text(encoding="utf-8"))
    (made.folder / PLAN).write_text(json.dumps({**described, "schema": schema}), encoding="utf-8")
    pl.read_sweep(made.folder)


def check_versions_are_told_apart(read: Callable[[Path, int], None], folder: Path) -> None:
    """A layout of later days is refused by name, with what to do; one that never was is damage."""
    with pytest.raises(FileError) as later:
        read(folder, 99)
    assert re.search(r"must have schema version 1( to \d)?, but is 99\.", str(later.value))
    assert "It was written by a later plastica: read it with that one." in str(later.value)
    for schema in (0, -1):
        with pytest.raises(FileError, match=f"is damaged.*its schema version is {schema}") as never:
            read(folder, schema)
        assert "later" not in str(never.value)


@pytest.mark.parametrize("read", [result_of_version, sweep_of_version])
def test_versions_are_told_apart(read: Callable[[Path, int], None], tmp_path: Path) -> None:
    check_versions_are_told_apart(read, tmp_path)


def test_of_several_versions_all_are_read(tmp_path: Path) -> None:
    for version in (1, 2, 3):
        check_schema(version, 3, tmp_path)
    with pytest.raises(FileError, match="must have schema version 1 to 3, but is 4"):
        check_schema(4, 3, tmp_path)


@pytest.mark.parametrize("every", [-1.0, math.nan, math.inf, "often", None, True, 10**400])
def test_checkpoints_are_a_number_of_seconds_apart(every: object, tmp_path: Path) -> None:
    with pytest.raises(ArgumentError, match="`checkpoint_every` must be a finite number of seconds"):
        Checkpoint(tmp_path / "kept", "run", every=every)  # type: ignore[arg-type]
    assert not (tmp_path / "kept").exists()
    assert Checkpoint(tmp_path / "kept", "run", every=np.int64(2)).every == 2.0  # type: ignore[arg-type]
