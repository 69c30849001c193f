"""Claim: a store is made whole, only where it has room, and taken for no other sweep than the one it holds."""

from __future__ import annotations

import re
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

import plastica as pl
from plastica.errors import FileError
from plastica.study import sweep_engines, sweep_plan
from plastica.study.sweep_store import open_store
from plastica.study.toml import toml_text
from tests.commandline import call, scenario, written
from tests.test_sweep_store import CHUNK, OVER, contents, copied, made


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> pl.Sweep:
    return made(tmp_path_factory.mktemp("whole"))


def test_another_sweep_is_not_mixed_in(whole: pl.Sweep, tmp_path: Path) -> None:
    found = copied(whole, tmp_path)
    before = contents(found)
    for text, over in ((scenario(load="thrust = 2.5"), OVER), (scenario(), {"load.thrust": [1.0]})):
        with pytest.raises(FileError, match="holds another sweep"):
            pl.sweep(text, over, store=found.path, chunk=CHUNK, workers=0)
    with pytest.raises(FileError, match="holds another sweep"):
        pl.sweep(scenario(), OVER, store=found.path, workers=0)
    assert contents(found) == before


SHAPE = 'curvature = { csv = "shape.csv" }'
BASE = scenario(initial=SHAPE)

OTHERS: dict[str, tuple[str, dict[str, Any], dict[str, Any], str]] = {
    "a key": (scenario(initial=SHAPE, load="thrust = 2.5"), OVER, {}, "`load.thrust` is 2.0 there and 2.5 here"),
    "a key more": (
        scenario(initial=SHAPE, grid="nodes = 12\nbreaks = [0.5]"),
        *(OVER, {}, "`grid.breaks` is not given there and [0.5] here"),
    ),
    "a section less": (
        *(scenario(initial=None), OVER, {}),
        '`initial.curvature.csv` is "shape.csv" there and not given here',
    ),
    "values": (
        *(BASE, {"load.thrust": [1.0]}, {}),
        "`sweep.over.load.thrust` is { from = 0.5, to = 4.0, count = 12 } there and [1.0] here",
    ),
    "outputs": (BASE, OVER, {"outputs": ["final"]}, '`sweep.outputs` is not given there and ["final"] here'),
    "chunks": (BASE, OVER, {"chunk": 4}, "`sweep.chunk` is 3 there and 4 here"),
    "an input file": (BASE, OVER, {}, "the file shape.csv has changed"),
    "versions": (BASE, OVER, {}, "it was begun with numpy 1.0, and this is "),
}


def older(patch: pytest.MonkeyPatch) -> None:
    """Let sweeps be computed with an older NumPy, as it says."""
    sound = sweep_plan.versions
    patch.setattr(sweep_plan, "versions", lambda library: {**sound(library), "numpy": "1.0"})


def check_differences_are_told(folder: Path, kind: str) -> None:
    """A store that holds another sweep is refused with what differs, and with nothing that does not."""
    points = "\n".join(f"{i / 20}, {0.1 * i / 20}" for i in range(21))
    (folder / "shape.csv").write_text(points)
    file, target = written(folder, BASE), folder / "s.sweep"
    with pytest.MonkeyPatch.context() as patch:
        if kind == "versions":
            older(patch)
        pl.sweep(file, OVER, store=target, chunk=CHUNK, workers=0)
    text, over, table, said = OTHERS[kind]
    written(folder, text)
    if kind == "an input file":
        (folder / "shape.csv").write_text(points + " ")
    with pytest.raises(FileError) as refused:
        pl.sweep(file, over, store=target, workers=0, **{"chunk": CHUNK, **table})
    words = str(refused.value)
    assert said in words, words
    assert words.count(" here") + words.count("begun with") + words.count("has changed") <= 3, words
    written(folder, text + toml_text({"sweep": {"chunk": CHUNK, "over": OVER}}))
    answer = call("sweep", file, "--store", target, "--status", "--json", folder=folder)
    assert answer.code == 0
    assert ("holds another sweep" in answer.err) == (not table and over is OVER), answer.err


@pytest.mark.parametrize("kind", OTHERS)
def test_what_differs_is_told(kind: str, tmp_path: Path) -> None:
    check_differences_are_told(tmp_path, kind)


def test_an_input_file_that_has_changed_makes_another_sweep(tmp_path: Path) -> None:
    points = "\n".join(f"{i / 20}, {0.1 * i / 20}" for i in range(21))
    (tmp_path / "shape.csv").write_text(points)
    file = written(tmp_path, scenario(initial='curvature = { csv = "shape.csv" }'))
    found = pl.sweep(file, {"initial.amplitude": [1.0, 2.0]}, store=tmp_path / "s.sweep", workers=1)
    assert found.complete
    (tmp_path / "shape.csv").write_text(points + " ")
    with pytest.raises(FileError, match="holds another sweep"):
        pl.sweep(file, {"initial.amplitude": [1.0, 2.0]}, store=tmp_path / "s.sweep", workers=0)
    # The store has what its members read: it needs nothing beside it.
    (tmp_path / "shape.csv").unlink()
    assert pl.read_sweep(tmp_path / "s.sweep").solve(1).status.ok


def test_other_versions_do_not_go_on_with_a_sweep(tmp_path: Path) -> None:
    with pytest.MonkeyPatch.context() as patch:
        older(patch)
        found = made(tmp_path)
    (found.results / "seal" / "c" / "0" / "0").unlink()
    answer = call("sweep", found.path, folder=tmp_path)
    assert answer.code == 2
    assert "must be computed with plastica" in answer.err
    answers = sweep_engines.computed(open_store(found.path), [0], "local", 1, None)
    with pytest.raises(FileError, match="must be computed with"):
        list(answers)


@pytest.mark.parametrize("what", ["a file", "another folder", "a link to an empty folder"])
def test_what_is_no_sweep_is_left_alone(what: str, tmp_path: Path) -> None:
    target = tmp_path / "s.sweep"
    if what == "a file":
        target.write_text("mine")
    elif what == "another folder":
        target.mkdir()
        (target / "notes.txt").write_text("mine")
    else:
        (tmp_path / "empty").mkdir()
        target.symlink_to(tmp_path / "empty")
    before = sorted(tmp_path.rglob("*"))
    with pytest.raises(FileError, match=r"is there already, and is no folder of a sweep\. Name a folder that does not"):
        made(tmp_path)
    assert sorted(tmp_path.rglob("*")) == before


def check_empty_folder(folder: Path, whole: pl.Sweep) -> None:
    """A folder that is there and empty is taken, with its rights."""
    target = folder / "s.sweep"
    target.mkdir()
    target.chmod(0o2775)
    try:
        found = made(folder)
    except FileError as error:
        raise AssertionError("refused") from error
    assert contents(found) == contents(whole)
    assert target.stat().st_mode & 0o7777 == 0o2775
    assert [path.name for path in folder.iterdir()] == ["s.sweep"]


def test_an_empty_folder_is_taken(whole: pl.Sweep, tmp_path: Path) -> None:
    check_empty_folder(tmp_path, whole)


def check_coordinates(folder: Path) -> None:
    """Whoever opens the store itself with xarray finds what is varied, and only that, among the coordinates."""
    import xarray

    over = {"load.thrust": [1.0, 2.0], "material.parameters.k": [1.0, 2.0]}
    options: dict[str, Any] = {"outputs": ["state", "histories"], "times": [1.0, 2.0], "workers": 0}
    found = pl.sweep(scenario(), over, store=folder / "xarray.sweep", **options)
    with xarray.open_zarr(found.results, consolidated=False) as data:
        assert set(data.coords) == {*over, "t", "s", "s_weight"} == set(found.dataset.coords)
        assert data["load.thrust"].dims == ("member",)
        assert data["curvature"].coords["load.thrust"].values.tolist() == [1.0, 1.0, 2.0, 2.0]


def test_what_is_varied_is_a_coordinate(tmp_path: Path) -> None:
    check_coordinates(tmp_path)


def check_disk_is_told(folder: Path) -> None:
    """A disk that is too small is told with what is needed, of which the margin is a part; nothing is made."""
    from plastica.study import sweep_create

    text = scenario() + toml_text({"sweep": {"over": OVER}})
    file = written(folder, text)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sweep_create.shutil, "disk_usage", lambda _: SimpleNamespace(free=205_000))
        for store in ((), ("--store", "elsewhere")):
            answer = call("sweep", file, *store, folder=folder)
            assert answer.code == 1
            said = re.search(r"needs (.*) free on the disk .*100 MB to spare\), and (.*) are\.", answer.err)
            assert said is not None, answer.err
            assert said.groups() == ("100 MB", "205 kB")
        estimate = call("sweep", file, "--estimate", folder=folder)
        assert "The disk has too little room: 100 MB must be free, 205 kB are" in estimate.out
        patch.setattr(sweep_create.shutil, "disk_usage", lambda _: SimpleNamespace(free=101_000_000))
        assert "too little room" not in call("sweep", file, "--estimate", folder=folder).out
        assert [path.name for path in folder.iterdir()] == ["strut.toml"]
        patch.setattr(sweep_create, "bytes_of", lambda _: 10**18)
        with pytest.raises(FileError, match=r"needs 1\.1e\+06 TB free on the disk \(up to 1e\+06 TB of results"):
            made(folder)


def test_a_store_that_would_not_fit_is_refused(tmp_path: Path) -> None:
    check_disk_is_told(tmp_path)
