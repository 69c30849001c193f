"""Claim: a finished sweep is the same to the bit however it came about; what is not done is never taken for done."""

from __future__ import annotations

import contextlib
import json
import shutil
import subprocess
import sys
from collections import Counter
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import plastica as pl
from plastica.errors import FileError
from plastica.study.sweep import compute_missing
from plastica.study.sweep_seals import digest_of
from plastica.study.sweep_store import Store, open_store
from tests.commandline import call, scenario
from tests.patience import PATIENCE

OVER = {"load.thrust": {"from": 0.5, "to": 4.0, "count": 12}}
CHUNK = 3
CHUNKS = 4


def made(folder: Path, name: str = "s.sweep", **options: Any) -> pl.Sweep:
    return pl.sweep(scenario(), OVER, store=folder / name, chunk=CHUNK, **{"workers": 0, **options})


def contents(found: pl.Sweep) -> dict[str, bytes]:
    """Every file of the results."""
    return {
        path.relative_to(found.results).as_posix(): path.read_bytes()
        for path in sorted(found.results.rglob("*"))
        if path.is_file()
    }


def counted(found: pl.Sweep) -> Counter[int]:
    """How often each chunk was computed and written down."""
    return Counter(entry["chunk"] for entry in found.store.log())


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> pl.Sweep:
    return made(tmp_path_factory.mktemp("whole"))


def copied(found: pl.Sweep, folder: Path) -> pl.Sweep:
    return pl.read_sweep(shutil.copytree(found.path, folder / "copy.sweep"))


@pytest.mark.parametrize("workers", [1, 2])
def test_processes_write_what_this_one_writes(workers: int, whole: pl.Sweep, tmp_path: Path) -> None:
    found = made(tmp_path, workers=workers)
    assert contents(found) == contents(whole)
    assert counted(found) == dict.fromkeys(range(CHUNKS), 1)
    assert len({entry["process"] for entry in found.store.log()}) <= workers


def test_machine_code_writes_the_same_in_every_process(whole: pl.Sweep, tmp_path: Path) -> None:
    """What computes is part of a sweep: its results are their own, the same everywhere, and go on with it only."""
    found = made(tmp_path, "here.sweep", library="numba")
    assert contents(made(tmp_path, "apart.sweep", library="numba", workers=2)) == contents(found)
    both = found.dataset, whole.dataset
    assert float(np.abs(both[0].drive - both[1].drive).max()) <= 1e-7
    assert set(found.store.versions) == {"plastica", "numpy", "scipy", "numba"}
    with pytest.raises(FileError, match="holds another sweep"):
        made(tmp_path, "here.sweep")


def check_damage_is_mended(found: pl.Sweep, spoil: Any, chunks: set[int]) -> None:
    """After some chunks were spoiled, exactly these are computed again, and the store is as it was."""
    before = contents(found)
    spoil(found.results)
    assert contents(found) != before
    store = open_store(found.path)
    assert set(store.missing()) == chunks
    compute_missing(store, workers=0)
    assert contents(found) == before
    assert counted(found) == {chunk: 1 + (chunk in chunks) for chunk in range(CHUNKS)}


def _remove(*names: str) -> Any:
    def spoil(results: Path) -> None:
        for name in names:
            (results / name).unlink()

    return spoil


def _replace(name: str, change: Any) -> Any:
    def spoil(results: Path) -> None:
        path = results / name
        path.write_bytes(change(path.read_bytes()))

    return spoil


def _overwrite(*names: str) -> Any:
    def spoil(results: Path) -> None:
        for name in names:
            (results / name).write_bytes(b"overwritten")

    return spoil


def _flip(raw: bytes) -> bytes:
    return raw[: len(raw) // 2] + bytes([raw[len(raw) // 2] ^ 4]) + raw[len(raw) // 2 + 1 :]


DAMAGE: dict[str, tuple[Any, set[int]]] = {
    "a variable is missing": (_remove("tip_y/c/1"), {1}),
    "a seal is missing": (_remove("seal/c/2/0"), {2}),
    "several are missing": (_remove("tip_y/c/0", "drive/c/3", "seal/c/3/0"), {0, 3}),
    "a variable is empty": (_replace("tip_x/c/2", lambda _: b""), {2}),
    "a variable is cut short": (_replace("tip_x/c/2", lambda raw: raw[:-5]), {2}),
    "a bit is turned": (_replace("liapunov/c/0", _flip), {0}),
    "a bit of a seal is turned": (_replace("seal/c/0/0", _flip), {0}),
    "the chunk is another's": (lambda results: shutil.copy(results / "tip_y/c/0", results / "tip_y/c/1") and None, {1}),
}


@pytest.mark.parametrize("kind", DAMAGE)
def test_damage_is_seen_and_mended(kind: str, whole: pl.Sweep, tmp_path: Path) -> None:
    check_damage_is_mended(copied(whole, tmp_path), *DAMAGE[kind])


ABSENT: dict[str, tuple[Any, set[int]]] = {
    "a status is no chunk": (_overwrite("status/c/3"), {3}),
    "several are no chunks": (_overwrite("status/c/0", "status/c/2"), {0, 2}),
    "a variable is missing": (_remove("tip_y/c/0"), {0}),
    "histories are missing": (_remove("drive_history/c/1/0"), {1}),
    "a seal is missing": (_remove("seal/c/2/0"), {2}),
}
"""What every reader tells, by the seals."""


def check_absence_is_told(folder: Path, kind: str) -> None:
    """Chunks that are damaged so are pending in everything that is told, without a word on standard error."""
    found = made(folder, outputs=["final", "verdict", "histories"], times=[0.0, 1.0])
    before = contents(found)
    spoil, chunks = ABSENT[kind]
    spoil(found.results)
    part = pl.read_sweep(found.path)
    assert part.counts == {"done": CHUNK * (CHUNKS - len(chunks)), "pending": CHUNK * len(chunks)}
    assert part.regimes["pending"] == part.counts["pending"]
    away = np.isin(np.arange(CHUNK * CHUNKS) // CHUNK, list(chunks))
    data = part.dataset
    assert (np.isnan(data.tip_y.values) == away).all()
    assert (np.isnan(data.drive_history.values).all(axis=1) == away).all()
    assert ((data.status.values == "pending") == away).all()
    assert all(away[each.member] == np.False_ for each in part.interesting(3))
    answer = call("sweep", found.path, "--status", folder=folder)
    assert (answer.code, answer.err) == (0, "")
    assert f"pending {CHUNK * len(chunks)} not begun, missing or damaged" in " ".join(answer.out.split())
    again = call("sweep", found.path, "--workers", "0", "--json", folder=folder)
    assert json.loads(again.out)["status"] == {"done": CHUNK * CHUNKS}
    assert contents(found) == before
    assert counted(found) == {chunk: 1 + (chunk in chunks) for chunk in range(CHUNKS)}


@pytest.mark.parametrize("kind", ABSENT)
def test_what_is_absent_is_pending(kind: str, tmp_path: Path) -> None:
    check_absence_is_told(tmp_path, kind)


def test_nothing_is_said_of_a_chunk_that_is_none(whole: pl.Sweep, tmp_path: Path) -> None:
    """Zarr reads ahead: what it has begun is brought to its end before the process ends."""
    found = copied(whole, tmp_path)
    _overwrite("status/c/0", "status/c/2")(found.results)
    command = [sys.executable, "-m", "plastica", "sweep", str(found.path), "--status", "--json"]
    answer = subprocess.run(command, capture_output=True, text=True, timeout=PATIENCE, check=True)
    assert answer.stderr == ""
    assert json.loads(answer.stdout)["status"] == {"done": 6, "pending": 6}


def check_interrupted_anywhere(folder: Path, whole: pl.Sweep) -> None:
    """Whatever write is the last before the end, the same call finishes the sweep, computing only what is missing."""
    writes = 1 + len(whole.store.variables)
    for last in range(0, CHUNKS * writes, 5):
        name = f"{last}.sweep"
        with pytest.MonkeyPatch.context() as patch:
            _die_at(patch, last)
            with contextlib.suppress(KeyboardInterrupt):
                made(folder, name)
        part = pl.read_sweep(folder / name)
        done = last // writes
        # A seal is the last write of its chunk: until it is there, the chunk does not count as done.
        assert part.store.missing() == list(range(done, CHUNKS)), last
        assert part.done == CHUNK * done, last
        data = part.dataset
        assert np.isfinite(data.tip_y.values[data.status.values == "done"]).all()
        # Whoever reads the arrays alone: the status is the last of them, and where it is told, all else can be read.
        raw = part.store.read(["status", "tip_y"], 0, part.members)
        assert (raw["status"] >= 0).sum() == CHUNK * ((last + 1) // writes), last
        assert np.isfinite(raw["tip_y"][raw["status"] >= 0]).all()
        found = made(folder, name)
        assert contents(found) == contents(whole)
        assert counted(found) == dict.fromkeys(range(CHUNKS), 1)


def _die_at(patch: pytest.MonkeyPatch, last: int) -> None:
    """Interrupt at the write after so many."""
    import zarr

    sound, count = zarr.Array.__setitem__, [0]
    began = [False]
    run = Store.write

    def write(self: Store, chunk: int, columns: Any) -> None:
        began[0] = True
        run(self, chunk, columns)

    def spoiled(self: Any, place: Any, value: Any) -> None:
        if began[0]:
            if count[0] == last:
                raise KeyboardInterrupt
            count[0] += 1
        sound(self, place, value)

    patch.setattr(Store, "write", write)
    patch.setattr(zarr.Array, "__setitem__", spoiled)


def test_interrupted_at_any_write(whole: pl.Sweep, tmp_path: Path) -> None:
    check_interrupted_anywhere(tmp_path, whole)


def test_what_killed_writers_leave_is_removed(whole: pl.Sweep, tmp_path: Path) -> None:
    found = copied(whole, tmp_path)
    (found.results / "tip_y" / "c" / "1.0123456789abcdef.partial").write_bytes(b"half")
    compute_missing(open_store(found.path), workers=0)
    assert contents(found) == contents(whole)


def check_tidied_while_writing(folder: Path) -> None:
    """A process that ends, and tidies, while another writes a chunk takes nothing from that one."""
    found = made(folder)
    before, store = contents(found), open_store(found.path)
    columns = store.read([each.name for each in store.variables], 0, CHUNK)
    for done in (True, False):
        if not done:
            # Then it has to be written once more.
            (found.results / "seal" / "c" / "0" / "0").unlink()
        with pytest.MonkeyPatch.context() as patch:
            tidied = _tidy_before_rename(patch, found.path)
            try:
                store.write(0, columns)
            except FileNotFoundError as error:
                raise AssertionError("what was being written was taken away") from error
        assert tidied
        assert contents(found) == before


def _tidy_before_rename(patch: pytest.MonkeyPatch, store: Path) -> list[str]:
    """Tidy as another process would, once, when a file is about to be renamed; return which."""
    sound, tidied = Path.replace, []

    def replace(self: Path, target: Path) -> Path:
        if self.suffix == ".partial" and not tidied:
            tidied.append(self.name)
            open_store(store).tidy()
        return sound(self, target)

    patch.setattr(Path, "replace", replace)
    return tidied


def test_tidied_while_writing(tmp_path: Path) -> None:
    check_tidied_while_writing(tmp_path)


def test_partial_results_are_readable(whole: pl.Sweep, tmp_path: Path) -> None:
    found = copied(whole, tmp_path)
    for name in ("seal/c/1/0", "tip_y/c/1", "status/c/1", "regime/c/1", "natural_curvature/c/1"):
        (found.results / name).unlink()
    part = pl.read_sweep(found.path)
    assert (part.done, part.complete) == (9, False)
    assert part.counts == {"done": 9, "pending": 3}
    data = part.to_dataset(["tip_y", "status", "regime"])
    assert np.isnan(data.tip_y.values[3:6]).all()
    assert np.isfinite(np.delete(data.tip_y.values, slice(3, 6))).all()
    assert set(data.status.values[3:6]) == {"pending"}
    assert data["load.thrust"].values.tolist() == whole.dataset["load.thrust"].values.tolist()
    assert len(part.interesting(2)) == 2
    pl.plot(part)


HOSTILE: dict[str, Any] = {
    "no JSON": lambda path: (path / "sweep.json").write_text("{"),
    "another JSON": lambda path: (path / "sweep.json").write_text("[1]"),
    "a later version": lambda path: changed(path, schema=9),
    "no scenario": lambda path: (path / "scenario.toml").unlink(),
    "another scenario": lambda path: (path / "scenario.toml").write_text("units = 3"),
    "other members": lambda path: changed(path, sweep={"over": {"load.thrust": [1.0, 2.0]}}),
    "other outputs": lambda path: changed(path, sweep={"over": OVER, "outputs": ["limit"]}),
    "another chunk": lambda path: changed(path, chunk=4),
    "no results": lambda path: shutil.rmtree(path / "results.zarr"),
    "a variable is gone": lambda path: shutil.rmtree(path / "results.zarr" / "tip_y"),
    "a huge array": lambda path: _metadata(path, shape=[10**15]),
    "another type": lambda path: _metadata(path, data_type="float32"),
    "huge chunks": lambda path: _metadata(
        path, chunk_grid={"name": "regular", "configuration": {"chunk_shape": [10**12]}}
    ),
    "an unknown codec": lambda path: _metadata(path, codecs=[{"name": "python", "configuration": {}}]),
    "metadata is no JSON": lambda path: (path / "results.zarr" / "tip_y" / "zarr.json").write_text("{"),
}


def changed(path: Path, **entries: Any) -> None:
    told = json.loads((path / "sweep.json").read_text())
    (path / "sweep.json").write_text(json.dumps({**told, **entries}))


def _metadata(path: Path, **entries: Any) -> None:
    file = path / "results.zarr" / "tip_y" / "zarr.json"
    file.write_text(json.dumps({**json.loads(file.read_text()), **entries}))


@pytest.mark.parametrize("kind", HOSTILE)
def test_stores_that_cannot_be_used_are_refused(kind: str, whole: pl.Sweep, tmp_path: Path) -> None:
    found = copied(whole, tmp_path)
    HOSTILE[kind](found.path)
    with pytest.raises(FileError) as refused:
        pl.read_sweep(found.path)
    said = {"a later version": "later plastica", "no scenario": "scenario.toml` does not exist"}
    assert said.get(kind, "is damaged") in str(refused.value)
    answer = call("sweep", found.path, "--status", folder=tmp_path)
    assert answer.code == 2
    assert "Traceback" not in answer.err


def test_values_that_were_damaged_are_those_of_the_plan(whole: pl.Sweep, tmp_path: Path) -> None:
    """What the members take is checked as it is read: a wrong value would be a wrong member."""
    found = copied(whole, tmp_path)
    path = found.results / "load.thrust" / "c" / "1"
    path.write_bytes(_flip(path.read_bytes()))
    part = pl.read_sweep(found.path)
    assert part.missing == {1}
    assert part.values(4) == whole.values(4)
    assert np.array_equal(part.store.values(3, 6), whole.taken[3:6])


def test_the_digest_tells_names_types_shapes_and_values() -> None:
    column = np.arange(6.0)
    base = {"a": column, "b": column}
    others = [
        {"a": column, "c": column},
        {"a": column.astype("<f4"), "b": column},
        {"a": column.reshape(2, 3), "b": column},
        {"a": np.nextafter(column, 9.0), "b": column},
    ]
    assert digest_of(dict(reversed(base.items()))) == digest_of(base)
    assert len({digest_of(each) for each in (base, *others)}) == 5
