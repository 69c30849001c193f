"""Claim: what is done of a sweep is told by seals alone: no damage is read as a result, and no result as damage."""

from __future__ import annotations

import json
import os
import shutil
import zipfile
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numcodecs import Zstd

import plastica as pl
from plastica.errors import ArgumentError, PlasticaError, StorageError
from plastica.study import sweep_plan, sweep_tasks
from plastica.study.sweep import compute_missing
from plastica.study.sweep_chunks import check_chunk
from plastica.study.sweep_outputs import STATUSES
from plastica.study.sweep_store import open_store
from plastica.study.sweep_tasks import compute
from tests.commandline import call, scenario, written
from tests.swept import plan, values

OLD = Path(__file__).parent / "data" / "sweep_v1.zip"
"""A finished sweep of two chunks from before what is varied was sealed; limit_natural_curvature is nan throughout."""


# -- chunks without files --------------------------------------------------------------------------------------------

ACROSS = '[sweep]\nchunk = 1\noutputs = {}\n[sweep.over]\n"load.transverse" = [0.1, 0.3]\n'


def check_nothing_in_a_chunk(folder: Path) -> None:
    """A chunk in which a variable is nan throughout, which Zarr writes no file for, is done, and is told as done."""
    text = scenario(load="thrust = 1.0") + ACROSS.format('["final", "verdict", "limit"]')
    file = written(folder, text)
    for _ in range(2):
        answer = call("sweep", file, "--store", "s.sweep", "--workers", "0", "--json", folder=folder)
        assert (answer.code, json.loads(answer.out)["status"]) == (0, {"done": 2})
    found = pl.read_sweep(folder / "s.sweep")
    assert not (found.results / "limit_natural_curvature" / "c").exists()
    assert [entry["chunk"] for entry in found.store.log()] == [0, 1]
    data = found.to_dataset()
    assert np.isfinite(data.tip_y.values).all()
    assert data.limit_kind.values.tolist() == ["none", "none"]
    assert call("sweep", found.path, "--status", folder=folder).out.count("2 done") >= 1


def test_a_chunk_with_nothing_in_a_variable_is_done(tmp_path: Path) -> None:
    check_nothing_in_a_chunk(tmp_path)


def check_failures_of_a_whole_chunk(folder: Path) -> None:
    """Members that stopped before the first time that is kept, or were refused, are told, and make the exit code 1."""
    text = scenario(solve="until = 2.0\nmax_steps = 3") + ACROSS.format('["final", "histories"]\ntimes = [1.9]')
    stopped = written(folder, text, "stopped.toml")
    table = scenario(load='thrust = { program = "table", times = [0.0, 1.0], values = [1.0, 2.0] }')
    times = [[0.0, 1.0 + 0.01 * i] for i in range(40)]
    times[17] = [1.0, 0.0]
    refused = written(folder, f"{table}[sweep]\nchunk = 1\n[sweep.over]\nload.thrust.times = {times}\n", "refused.toml")
    for file, told in ((stopped, {"step_limit": 2}), (refused, {"done": 39, "refused": 1})):
        for extra in ((), ("--status",)):
            answer = call("sweep", file, "--workers", "0", "--json", *extra, folder=folder)
            assert (answer.code, json.loads(answer.out)["status"]) == (1, told), (file.name, extra)
            assert "did not end as asked" in answer.err


def test_failures_of_a_whole_chunk_are_told(tmp_path: Path) -> None:
    check_failures_of_a_whole_chunk(tmp_path)


# -- damage ----------------------------------------------------------------------------------------------------------

OVER = {"load.thrust": [1.0, 2.5], "initial.natural_curvature": [0.1, 0.4]}
OUTPUTS = ["verdict", "state"]


def small(folder: Path, name: str = "s.sweep", last: float = 2.5) -> pl.Sweep:
    """Four members in two chunks."""
    over = {**OVER, "load.thrust": [1.0, last]}
    return pl.sweep(scenario(grid="nodes = 4"), over, store=folder / name, outputs=OUTPUTS, chunk=2, workers=0)


def files(found: pl.Sweep) -> list[str]:
    """Every file of the store but its log, from which nothing is read."""
    paths = (path for path in found.path.rglob("*") if path.is_file() and path.name != "log.jsonl")
    return sorted(path.relative_to(found.path).as_posix() for path in paths)


Spoiled = Iterator[bytes | None]
"""What may stand in the place of a file; None takes it away."""


def deleted(found: pl.Sweep, other: pl.Sweep, name: str) -> Spoiled:
    yield None


def truncated(found: pl.Sweep, other: pl.Sweep, name: str) -> Spoiled:
    raw = (found.path / name).read_bytes()
    yield from (raw[: len(raw) // 2], raw + b"\0")


def flipped(found: pl.Sweep, other: pl.Sweep, name: str) -> Spoiled:
    raw = (found.path / name).read_bytes()
    for place in sorted({4, len(raw) // 2, len(raw) - 2}):
        yield raw[:place] + bytes([raw[place] ^ 1 << place % 7]) + raw[place + 1 :]


def another_chunks(found: pl.Sweep, other: pl.Sweep, name: str) -> Spoiled:
    """The same variable's of the other chunk."""
    parts = Path(name).parts
    if "c" in parts:
        place = parts.index("c") + 1
        twin = Path(*parts[:place], str(1 - int(parts[place])), *parts[place + 1 :])
        if (found.path / twin).is_file():
            yield (found.path / twin).read_bytes()


def another_variables(found: pl.Sweep, other: pl.Sweep, name: str) -> Spoiled:
    """The file of the same name of the next variable."""
    parts = Path(name).parts
    names = sorted(path.name for path in found.results.iterdir() if path.joinpath(*parts[2:]).is_file())
    if len(parts) > 2:
        yield found.results.joinpath(names[names.index(parts[1]) - 1], *parts[2:]).read_bytes()


def another_stores(found: pl.Sweep, other: pl.Sweep, name: str) -> Spoiled:
    yield (other.path / name).read_bytes()


ATTACKS: dict[str, Callable[[pl.Sweep, pl.Sweep, str], Spoiled]] = {
    each.__name__: each for each in (deleted, truncated, flipped, another_chunks, another_variables, another_stores)
}


def check_attack(folder: Path, kind: str) -> None:
    """Whatever becomes of one file, what is read is refused, or pending, or what it was."""
    found, other = small(folder), small(folder, "other.sweep", 3.0)
    whole, seen = found.to_dataset().load(), 0
    for name in files(found):
        before = (found.path / name).read_bytes()
        for spoiled in ATTACKS[kind](found, other, name):
            if spoiled == before:
                continue
            seen += 1
            (found.path / name).unlink()
            if spoiled is not None:
                (found.path / name).write_bytes(spoiled)
            try:
                part = pl.read_sweep(found.path)
            except PlasticaError:
                continue
            check_as_read(part, whole, name)
        (found.path / name).write_bytes(before)
    assert seen > 5
    assert pl.read_sweep(found.path).to_dataset().identical(whole)


def check_as_read(part: pl.Sweep, whole: Any, name: str) -> None:
    data = part.to_dataset()
    kept = np.isin(np.arange(4) // 2, list(part.missing), invert=True)
    there, was = data.isel(member=kept), whole.isel(member=kept)
    assert there.equals(was), name
    assert (data.status.values == "pending").tolist() == (~kept).tolist(), name
    for key in OVER:
        assert np.array_equal(data[key].values, whole[key].values), name
    parts = Path(name).parts
    if "c" in parts and parts[1] not in ("s", "s_weight"):
        assert part.missing == {int(parts[parts.index("c") + 1])}, name


@pytest.mark.parametrize("kind", ATTACKS)
def test_no_damage_is_read(kind: str, tmp_path: Path) -> None:
    check_attack(tmp_path, kind)


def check_whole_chunks_elsewhere(folder: Path) -> None:
    """All files of a chunk, values and seal included, mean nothing in another chunk's place or in another sweep."""
    found, other = small(folder), small(folder, "other.sweep", 3.0)
    places = [name for name in files(found) if "/c/1" in name]
    before = {name: (found.path / name).read_bytes() for name in places}
    for source in (lambda name: other.path / name, lambda name: found.path / name.replace("/c/1", "/c/0")):
        for name in places:
            (found.path / name).write_bytes(source(name).read_bytes())
        part = pl.read_sweep(found.path)
        assert part.missing == {1}
        assert np.array_equal(part.taken, found.taken)
        for name, raw in before.items():
            (found.path / name).write_bytes(raw)


def test_a_chunk_means_nothing_elsewhere(tmp_path: Path) -> None:
    check_whole_chunks_elsewhere(tmp_path)


def test_what_is_damaged_is_mended(tmp_path: Path) -> None:
    """A resumed sweep is the same in every file, whichever of its chunks, values or seals was lost or overwritten."""
    found = small(tmp_path)
    before = {name: (found.path / name).read_bytes() for name in files(found)}
    for name in [name for name in files(found) if "/c/" in name][::3]:
        for spoil in (Path.unlink, lambda path: path.write_bytes(b"overwritten")):
            spoil(found.path / name)
            compute_missing(open_store(found.path), workers=0)
            assert {each: (found.path / each).read_bytes() for each in files(found)} == before, name


# -- files that are none ---------------------------------------------------------------------------------------------


def check_files_are_looked_at(folder: Path) -> None:
    """Devices, pipes, folders, what is too long and what would unpack to another size are refused without a read."""
    good = Zstd(level=3).encode(np.arange(100.0)) + b"cr32"
    large = Zstd(level=3).encode(np.zeros(10**6))
    (folder / "good").write_bytes(good)
    (folder / "large").write_bytes(large)
    (folder / "long").write_bytes(good + bytes(10_000))
    (folder / "folder").mkdir()
    (folder / "device").symlink_to("/dev/zero")
    (folder / "nothing").symlink_to("nowhere")
    os.mkfifo(folder / "pipe")
    check_chunk(folder / "good", 800, compressed=True)
    check_chunk(folder / "absent", 800, compressed=True)
    for compressed in (True, False):
        for name in ("device", "folder", "pipe", "nothing", "long", *(["large"] if compressed else [])):
            refused = False
            try:
                check_chunk(folder / name, 800, compressed=compressed)
            except ValueError:
                refused = True
            assert refused, (name, compressed)


def test_files_are_looked_at_before_they_are_read(tmp_path: Path) -> None:
    check_files_are_looked_at(tmp_path)


@pytest.mark.parametrize("size", [1, 100, 255, 256, 1000, 70_000, 10**6])
def test_what_a_chunk_unpacks_to_is_known(size: int, tmp_path: Path) -> None:
    raw = np.random.default_rng(size).integers(0, 255, size, dtype="u1")
    (tmp_path / "chunk").write_bytes(Zstd(level=3).encode(raw) + b"cr32")
    check_chunk(tmp_path / "chunk", size, compressed=True)
    for other in (size - 1, size + 1):
        with pytest.raises(ValueError, match="another size"):
            check_chunk(tmp_path / "chunk", other, compressed=True)


def test_a_store_with_devices_in_it(tmp_path: Path) -> None:
    found = small(tmp_path)
    for name in ("status/c/0", "seal/c/1/0", "s/c/0"):
        (found.results / name).unlink()
        (found.results / name).symlink_to("/dev/zero")
    part = pl.read_sweep(found.path)
    assert part.missing == {0, 1}
    compute_missing(open_store(found.path), workers=0)
    assert not any(path.is_symlink() for path in found.results.rglob("*"))
    assert pl.read_sweep(found.path).complete
    for name in ("zarr.json", "status/zarr.json"):
        aside = (found.results / name).read_bytes()
        (found.results / name).unlink()
        (found.results / name).symlink_to("/dev/zero")
        with pytest.raises(PlasticaError):
            pl.read_sweep(found.path)
        (found.results / name).unlink()
        (found.results / name).write_bytes(aside)


def test_words_of_a_store_do_not_steer_a_terminal(tmp_path: Path) -> None:
    text = scenario().replace('"A strut"', '"A strut"') + '[sweep.over]\n"initial.curvature" = ["s", "1 - s"]\n'
    found = pl.sweep(written(tmp_path, text), store=tmp_path / "s.sweep", workers=0)
    found.store.note({"chunk": 0, "one by one, because": "\x1b[2J\u202e"})
    answer = call("sweep", found.path, "--status", folder=tmp_path)
    assert "\x1b" not in answer.out + str(pl.read_sweep(found.path))
    assert "\u202e" not in answer.out + str(pl.read_sweep(found.path))


# -- stores of version 1 ---------------------------------------------------------------------------------------------


def old(folder: Path) -> Path:
    with zipfile.ZipFile(OLD) as stored:
        stored.extractall(folder)
    return folder / "sweep_v1.sweep"


def check_old_store(folder: Path) -> None:
    """A store of the former version is read by its seals, its values held against its plan."""
    store = old(folder)
    found = pl.read_sweep(store)
    assert (found.store.schema, found.counts) == (1, {"done": 2})
    assert found.dataset["load.transverse"].values.tolist() == [0.1, 0.3]
    assert np.isfinite(found.dataset.tip_y.values).all()
    results = store / "results.zarr"
    for name in ("load.transverse/c/1", "tip_y/c/1"):
        before = (results / name).read_bytes()
        for spoil in (Path.unlink, lambda path: shutil.copy(path.with_name("0"), path) and None):
            spoil(results / name)
            part = pl.read_sweep(store)
            assert part.counts == {"done": 1, "pending": 1}, name
            assert part.dataset["load.transverse"].values.tolist() == [0.1, 0.3]
            (results / name).write_bytes(before)


def test_a_store_of_the_former_version_is_read(tmp_path: Path) -> None:
    check_old_store(tmp_path)


def test_a_store_of_the_former_version_goes_on(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    store = open_store(old(tmp_path))
    (store.folder / "results.zarr" / "drive" / "c" / "0").unlink()
    (store.folder / "results.zarr" / "load.transverse" / "c" / "0").unlink()
    monkeypatch.setattr(sweep_plan, "versions", lambda library: dict(store.versions))
    assert call("sweep", store.folder, "--workers", "0", "--quiet", folder=tmp_path).code == 0
    assert [entry["chunk"] for entry in store.log()] == [0]
    assert pl.read_sweep(store.folder).complete
    assert json.loads((store.folder / "sweep.json").read_text())["schema"] == 1


# -- batches and single members --------------------------------------------------------------------------------------


def check_batch_ends_as_single(_: Path) -> None:
    """However few steps are allowed, a member of a batch ends with the status that it has alone."""
    over = {"load.thrust": {"from": 0.5, "to": 9.0}, "material.parameters.h": {"from": 0.02, "to": 0.3}}
    seen = set()
    for steps in (5, 140, 240, 300):
        text = scenario(solve=f"until = 20.0\nmax_steps = {steps}")
        made = plan(over, text, sampling="random", members=6, outputs=["final"])
        assert made.batched
        rows = values(made)
        together = compute(made, rows)["status"]
        alone = [sweep_tasks._member(made, row)["status"] for row in rows]
        assert together.tolist() == alone, steps
        seen |= {STATUSES[code] for code in alone}
    assert seen == {"done", "step_limit"}


def test_a_batch_ends_as_its_members_do_alone(tmp_path: Path) -> None:
    check_batch_ends_as_single(tmp_path)


def check_slow_way_is_told(folder: Path) -> None:
    """A chunk that should be computed together and is not says so in its log, its sweep and its status."""
    file = written(folder, scenario() + '[sweep.over]\n"load.thrust" = [1.0, 2.0]\n')
    with pytest.MonkeyPatch.context() as patch:

        def unable(*_: object) -> None:
            raise ArgumentError("must be another", where="thrust")

        patch.setattr(sweep_tasks, "compute_together", unable)
        found = pl.sweep(file, store=folder / "s.sweep", workers=0)
    assert found.counts == {"done": 2}
    assert pl.read_sweep(found.path).apart == {0: "`thrust` must be another."}
    answer = call("sweep", found.path, "--status", folder=folder)
    assert "1 of 1 chunks, which takes longer: `thrust` must be another." in " ".join(answer.out.split())
    assert "one by one, because `thrust`" in str(found)


def test_a_slow_way_is_told(tmp_path: Path) -> None:
    check_slow_way_is_told(tmp_path)


def check_trouble_of_the_machine_is_no_result(_: Path) -> None:
    """A file that the system refuses for now does not make a member refused for good."""

    def failing(*_: object) -> None:
        raise StorageError("cannot be read: input/output error", where="former.nc")

    for over, place in (({"load.couple": [0.1]}, "solved"), ({"load.thrust": [1.0]}, "compute_together")):
        made = plan(over)
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(sweep_tasks, place, failing)
            with pytest.raises(StorageError):
                compute(made, values(made))


def test_trouble_of_the_machine_is_no_result(tmp_path: Path) -> None:
    check_trouble_of_the_machine_is_no_result(tmp_path)


CHECKS: dict[str, Callable[[Path], None]] = {
    "nothing in a chunk": check_nothing_in_a_chunk,
    "failures of a whole chunk": check_failures_of_a_whole_chunk,
    **{f"files {kind}": partial(check_attack, kind=kind) for kind in ATTACKS},
    "whole chunks elsewhere": check_whole_chunks_elsewhere,
    "files are looked at": check_files_are_looked_at,
    "a former store": check_old_store,
    "a batch ends as single members": check_batch_ends_as_single,
    "a slow way is told": check_slow_way_is_told,
    "trouble is no result": check_trouble_of_the_machine_is_no_result,
}
