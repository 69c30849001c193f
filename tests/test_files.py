"""Claim: a path that is none, and a file that is no result, are told from one another in one sentence."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

import plastica as pl
from plastica.errors import ArgumentError, FileError
from plastica.files import read_bytes, write_whole
from plastica.motion.checkpoint import Checkpoint
from tests.support import pair


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


@pytest.mark.parametrize("schema", [0, -1])
def test_a_schema_that_never_was_is_damage(schema: int, tmp_path: Path, sol: pl.Solution) -> None:
    import h5py

    path = sol.save(tmp_path / "run.nc")
    with h5py.File(path, "r+") as file:
        file.attrs["plastica_schema"] = schema
    with pytest.raises(FileError, match=f"is damaged.*its plastica_schema is {schema}") as caught:
        pl.read(path)
    assert "later" not in str(caught.value)


@pytest.mark.parametrize("every", [-1.0, math.nan, math.inf, "often", None, True, 10**400])
def test_checkpoints_are_a_number_of_seconds_apart(every: object, tmp_path: Path) -> None:
    with pytest.raises(ArgumentError, match="`checkpoint_every` must be a finite number of seconds"):
        Checkpoint(tmp_path / "kept", "run", every=every)  # type: ignore[arg-type]
    assert not (tmp_path / "kept").exists()
    assert Checkpoint(tmp_path / "kept", "run", every=np.int64(2)).every == 2.0  # type: ignore[arg-type]
