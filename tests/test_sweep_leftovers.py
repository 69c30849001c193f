"""Claim: what a killed process leaves of a sweep that it was making is gone with the next call, and nothing else is."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from plastica.study import sweep_aside
from plastica.study.sweep_create import create
from plastica.study.sweep_plan import Plan
from plastica.study.sweep_store import PLAN
from tests.commandline import call, scenario, written
from tests.patience import PATIENCE, wait
from tests.swept import plan

SWEPT = {"load.thrust": [1.0, 2.0]}
MAKING = """
import sys, time
from pathlib import Path
from plastica.study import sweep_create
from tests.swept import plan
from tests.patience import PATIENCE
sound = sweep_create._fill_results
def slow(path, plan):
    sound(path, plan)
    (path / "half").touch()
    while not Path("go").exists():
        time.sleep(0.01)
sweep_create._fill_results = slow
sweep_create.create("s.sweep", plan({"load.thrust": [1.0, 2.0]}))
"""
"""Makes a sweep, but waits before it is whole."""


@contextmanager
def making(folder: Path) -> Iterator[tuple[subprocess.Popen[bytes], Path]]:
    """A process that is about to make a sweep, and its hidden folder."""
    path = os.pathsep.join([str(Path(__file__).parents[1]), os.environ.get("PYTHONPATH", "")])
    process = subprocess.Popen([sys.executable, "-c", MAKING], cwd=folder, env={**os.environ, "PYTHONPATH": path})
    try:
        wait(lambda: list(folder.glob(".s.sweep.*/results.zarr/half")), "the other process", process)
        yield process, next(folder.glob(".s.sweep.*/results.zarr/half")).parents[1]
    finally:
        process.kill()
        process.wait()


def aged(folder: Path, seconds: float = 2.0 * sweep_aside.LONG) -> None:
    """Let a folder look as if nothing had been written there for long."""
    then = time.time() - seconds
    for path in (*folder.rglob("*"), folder):
        os.utime(path, (then, then), follow_symlinks=False)


def check_killed(folder: Path) -> None:
    """While the other process lives, stopped or not, its folder stays, however old; once it is killed, that goes."""
    made: Plan = plan(SWEPT)
    with making(folder) as (process, aside):
        os.kill(process.pid, signal.SIGSTOP)
        aged(aside)
        create(folder / "s.sweep", made)
        assert (aside / "results.zarr" / "half").is_file()
        process.kill()
        process.wait()
        assert (aside / "results.zarr" / "half").is_file()
        create(folder / "s.sweep", made)
        assert [path.name for path in folder.iterdir()] == ["s.sweep"]


def test_a_process_that_is_killed(tmp_path: Path) -> None:
    check_killed(tmp_path)


def test_the_command_line_clears_up(tmp_path: Path) -> None:
    text = scenario() + '[sweep.over]\n"load.thrust" = [1.0, 2.0]\n'
    with making(tmp_path) as (process, aside):
        process.kill()
        process.wait()
        assert aside.is_dir()
        answer = call("sweep", written(tmp_path, text), "--store", "s.sweep", "--workers", "0", folder=tmp_path)
    assert answer.code == 0, answer.err
    assert sorted(path.name for path in tmp_path.iterdir()) == ["s.sweep", "strut.toml"]


def test_a_process_that_is_late_takes_up_what_is_there(tmp_path: Path) -> None:
    with making(tmp_path) as (process, aside):
        create(tmp_path / "s.sweep", plan(SWEPT))
        (tmp_path / "go").touch()
        assert process.wait(PATIENCE) == 0
    assert not aside.exists()
    assert sorted(path.name for path in tmp_path.iterdir()) == ["go", "s.sweep"]


def check_others(folder: Path) -> None:
    """Only what bears the mark of a creation goes; what another machine may still be filling only after a day."""
    here = sweep_aside._being_made()
    kept = {
        ".s.sweep.mine": here,
        ".s.sweep.abcdefg1.old": here,
        ".t.sweep.abcdefg1": here,
        ".sxsweep.abcdefg1": here,
        ".s.sweep.ABCDEFG1": here,
        ".s.sweep.no_plan1": None,
        ".s.sweep.another1": "being made on another machine\n",
        ".s.sweep.not_yet1": "",
    }
    gone = {".s.sweep.abcdefg1": here, ".s.sweep.another2": "being made on another machine\n", ".s.sweep.not_yet2": ""}
    for name, mark in {**kept, **gone}.items():
        (folder / name / "results.zarr").mkdir(parents=True)
        (folder / name / "results.zarr" / "zarr.json").write_text("{}", encoding="utf-8")
        if mark is not None:
            (folder / name / PLAN).write_text(mark, encoding="utf-8")
    (folder / ".s.sweep.linked_1").symlink_to(folder / ".t.sweep.abcdefg1")
    (folder / ".s.sweep.no_plan2").mkdir()
    (folder / ".s.sweep.no_plan3").mkdir()
    (folder / ".s.sweep.a_file_1").write_text("mine", encoding="utf-8")
    for name in (".s.sweep.another2", ".s.sweep.not_yet2", ".s.sweep.no_plan1", ".s.sweep.no_plan3"):
        aged(folder / name)
    create(folder / "s.sweep", plan(SWEPT))
    left = {path.name for path in folder.iterdir()}
    assert left == {*kept, "s.sweep", ".s.sweep.linked_1", ".s.sweep.no_plan2", ".s.sweep.a_file_1"}
    assert all((folder / name / "results.zarr" / "zarr.json").is_file() for name in kept)


def test_others_stay(tmp_path: Path) -> None:
    check_others(tmp_path)


def test_a_removal_that_is_cut_short_is_taken_up(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    aside = tmp_path / ".s.sweep.abcdefg1"
    (aside / "results.zarr").mkdir(parents=True)
    (aside / PLAN).write_text(sweep_aside._being_made(), encoding="utf-8")
    with monkeypatch.context() as patch:
        patch.setattr(Path, "unlink", _cut)
        with pytest.raises(KeyboardInterrupt):
            sweep_aside.remove_leftovers(tmp_path / "s.sweep")
    assert aside.is_dir()
    sweep_aside.remove_leftovers(tmp_path / "s.sweep")
    assert list(tmp_path.iterdir()) == []


def _cut(*_: object, **__: object) -> None:
    raise KeyboardInterrupt


def test_where_files_cannot_be_locked_only_age_tells(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sweep_aside, "take_lock", lambda mark, *, wait: None)
    for name in ("recent_1", "rested_1"):
        (tmp_path / f".s.sweep.{name}").mkdir()
        (tmp_path / f".s.sweep.{name}" / PLAN).write_text(sweep_aside._being_made(), encoding="utf-8")
    aged(tmp_path / ".s.sweep.rested_1")
    sweep_aside.remove_leftovers(tmp_path / "s.sweep")
    assert [path.name for path in tmp_path.iterdir()] == [".s.sweep.recent_1"]
