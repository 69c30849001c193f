"""Claim: the command line runs, checks, tells and exports, and its exit code says how it went."""

from __future__ import annotations

import csv
import io
import json
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import plastica as pl
from plastica.doors import running
from plastica.motion import solve as solving
from plastica.motion.checkpoint import Checkpoint
from plastica.show import sections
from plastica.show.subject import Subject
from plastica.study import run as study_run
from tests.commandline import call, scenario, si_scenario, snapshot, written

CYCLES = 'thrust = { program = "cycles", low = 0.0, high = 3.0, period = 0.5, count = 20, shape = "square" }'


@pytest.fixture
def finished(tmp_path: Path) -> Path:
    """The result of a scenario that was run."""
    answer = call("run", written(tmp_path, si_scenario()), "--output", tmp_path / "out")
    assert (answer.code, answer.err) == (0, "")
    return tmp_path / "out" / "strut.nc"


# -- run -------------------------------------------------------------------------------------------------------------


def test_run_tells_what_became_of_the_rod(tmp_path: Path) -> None:
    answer = call("run", written(tmp_path, si_scenario()), "--output", tmp_path / "out")
    solution = pl.read(tmp_path / "out" / "strut.nc")
    assert answer.code == 0
    for said in (
        "A strip",
        solution.outcome.headline,
        solution.status.sentence,
        "natural curvature",
        "ledger residual",
        str(tmp_path / "out" / "strut.nc").rpartition("/")[2],
    ):
        assert said in answer.out
    assert [path.name for path in (tmp_path / "out").iterdir()] == ["strut.nc"]


def test_results_go_to_out_unless_told_otherwise(tmp_path: Path) -> None:
    file = written(tmp_path, scenario(), "my rod.toml")
    assert call("run", file, "--quiet", folder=tmp_path).code == 0
    assert (tmp_path / "out" / "my rod" / "my-rod.nc").is_file()


def test_quiet_and_json(tmp_path: Path) -> None:
    file = written(tmp_path, scenario())
    quiet = call("run", file, "--output", tmp_path / "out", "--quiet")
    assert (quiet.code, quiet.out, quiet.err) == (0, "", "")
    answer = call("run", file, "--output", tmp_path / "out", "--json")
    told = json.loads(answer.out)
    solution = pl.read(tmp_path / "out" / "strut.nc")
    assert (answer.code, answer.err) == (0, "")
    assert told["exit_code"] == 0
    assert told["status"]["code"] == "done"
    assert told["verdict"]["headline"] == solution.outcome.headline
    assert told["natural_curvature"]["end"] == solution.history.y[-1][12]
    assert abs(told["tip"]["y"] - float(solution.dataset["tip_y"][-1])) <= 1e-14
    assert told["files"] == [str(tmp_path / "out" / "strut.nc")]


def test_a_failed_computation_keeps_what_it_has(tmp_path: Path) -> None:
    file = written(tmp_path, scenario(solve="until = 2.0\nmax_steps = 20"))
    answer = call("run", file, "--output", tmp_path / "out")
    assert answer.code == 1
    assert "step_limit: Stopped at t = " in answer.err
    assert "Traceback" not in answer.err
    assert not pl.read(tmp_path / "out" / "strut.nc").status.ok
    told = json.loads(call("run", file, "--output", tmp_path / "out", "--json").out)
    assert (told["exit_code"], told["status"]["ok"]) == (1, False)


def test_a_mistake_in_json(tmp_path: Path) -> None:
    file = written(tmp_path, scenario(load="trust = 1.0"))
    for command in ("run", "check"):
        answer = call(command, file, "--json")
        assert answer.code == 2
        assert "Did you mean `thrust`?" in json.loads(answer.out)["error"]
        assert "Did you mean `thrust`?" in answer.err


def check_runs_again(folder: Path) -> None:
    """A second run replaces the first one's files by equal ones, and leaves everything else alone."""
    file = written(folder, scenario(output='film = "none"\nreport = false\ncsv = ["tip_y"]'))
    assert call("run", file, "--output", folder / "out").code == 0
    (folder / "out" / "notes.txt").write_text("mine")
    first = pl.read(folder / "out" / "strut.nc")
    table = (folder / "out" / "strut-tip_y.csv").read_bytes()
    assert call("run", file, "--output", folder / "out").code == 0
    assert pl.read(folder / "out" / "strut.nc") == first
    assert (folder / "out" / "strut-tip_y.csv").read_bytes() == table
    names = sorted(path.name for path in (folder / "out").iterdir())
    assert names == ["notes.txt", "strut-tip_y.csv", "strut.nc"]


def test_runs_again(tmp_path: Path) -> None:
    check_runs_again(tmp_path)


def test_report_and_film_are_written_where_wanted(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def stub(_solution: Any, path: Path) -> Path:
        path.write_text("stub")
        return path

    monkeypatch.setattr("plastica.show.report.report", stub)
    monkeypatch.setattr("plastica.show.film.film", stub)
    file = written(tmp_path, scenario(output='name = "x"'))
    for flags, names in (
        ((), ["x.gif", "x.html", "x.nc"]),
        (("--no-film",), ["x.html", "x.nc"]),
        (("--no-report", "--no-film"), ["x.nc"]),
    ):
        output = tmp_path / f"out{len(flags)}"
        told = json.loads(call("run", file, "--output", output, "--json", *flags).out)
        assert sorted(path.name for path in output.iterdir()) == names
        assert sorted(Path(each).name for each in told["files"]) == names


# -- a folder --------------------------------------------------------------------------------------------------------


def test_a_folder_ends_with_a_table_and_the_worst_code(tmp_path: Path) -> None:
    written(tmp_path, scenario(), "a.toml")
    written(tmp_path, scenario(solve="until = 2.0\nmax_steps = 20"), "b.toml")
    answer = call("run", tmp_path, "--output", tmp_path / "out")
    assert answer.code == 1
    assert "computation failed" in answer.out
    (failed,) = [line for line in answer.out.splitlines() if "b.toml" in line]
    assert "step_limit: Stopped at t = " in failed
    assert pl.read(tmp_path / "out" / "b" / "b.nc").outcome.headline not in failed
    written(tmp_path, scenario(load="thrust = -1.0"), "c.toml")
    answer = call("run", tmp_path, "--output", tmp_path / "out", "--json")
    told = json.loads(answer.out)["runs"]
    assert answer.code == 2
    assert [(Path(each["scenario"]).name, each["exit_code"]) for each in told] == [
        ("a.toml", 0),
        ("b.toml", 1),
        ("c.toml", 2),
    ]
    assert "`load.thrust` must not be negative" in answer.err
    assert sorted(path.name for path in (tmp_path / "out").iterdir()) == ["a", "b"]


def test_a_folder_without_scenarios(tmp_path: Path) -> None:
    answer = call("run", tmp_path)
    assert answer.code == 2
    assert "has no scenario" in answer.err


# -- interrupted -----------------------------------------------------------------------------------------------------


def check_resumed_run_is_the_same(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Interrupted, then resumed: the same result to the last bit, computed without the legs that were done."""
    file = written(folder, scenario(load=CYCLES, solve="until = 12.0"))
    assert call("run", file, "--output", folder / "whole").code == 0
    monkeypatch.setattr(study_run, "solve", partial(solving.solve, checkpoint_every=0.0))
    keep, kept = Checkpoint.keep, []

    def interrupted(self: Checkpoint, leg: Any) -> None:
        kept.append(leg)
        if len(kept) == 15:
            raise KeyboardInterrupt
        keep(self, leg)

    with monkeypatch.context() as patch:
        patch.setattr(Checkpoint, "keep", interrupted)
        answer = call("run", file, "--output", folder / "out")
    assert answer.code == 130
    assert answer.err == "plastica: interrupted. To go on from there, give the same command with --resume\n"
    assert [path.name for path in (folder / "out").iterdir()] == [".strut.checkpoint"]
    computed = []

    def counted(self: Checkpoint, leg: Any) -> None:
        computed.append(leg)
        keep(self, leg)

    monkeypatch.setattr(Checkpoint, "keep", counted)
    assert call("run", file, "--output", folder / "out", "--resume").code == 0
    whole, resumed = pl.read(folder / "whole" / "strut.nc"), pl.read(folder / "out" / "strut.nc")
    assert resumed == whole
    assert 0 < len(computed) == len(whole.legs[0]) - 14
    assert [path.name for path in (folder / "out").iterdir()] == ["strut.nc"]


def test_a_resumed_run_is_the_same(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    check_resumed_run_is_the_same(tmp_path, monkeypatch)


def test_a_changed_scenario_is_not_resumed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(study_run, "solve", partial(solving.solve, checkpoint_every=0.0))
    with monkeypatch.context() as patch:
        patch.setattr("plastica.study.run.described", _interrupt)
        assert call("run", written(tmp_path, scenario()), "--output", tmp_path / "out").code == 130
    file = written(tmp_path, scenario(load="thrust = 1.0"))
    answer = call("run", file, "--output", tmp_path / "out", "--resume")
    assert answer.code == 2
    assert "checkpoint of another run" in answer.err
    assert call("run", file, "--output", tmp_path / "out").code == 0


def _interrupt(*_arguments: object, **_named: object) -> None:
    raise KeyboardInterrupt


def test_interrupted_elsewhere(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr("plastica.study.scenario.read_scenario", _interrupt)
    answer = call("check", written(tmp_path, scenario()))
    assert (answer.code, answer.err.strip()) == (130, "plastica: interrupted")


def test_to_go_on_is_offered_only_where_something_is_kept(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Interrupted before the first leg is kept, in one run or in the first of a folder, there is nothing there."""
    monkeypatch.setattr(study_run, "solve", _interrupt)
    file = written(tmp_path, scenario())
    for command in (("run", file), ("run", tmp_path), ("run", file, "--output", tmp_path / "elsewhere")):
        answer = call(*command, folder=tmp_path)
        assert (answer.code, answer.err) == (130, "plastica: interrupted\n")
    kept = tmp_path / "out" / "strut" / ".strut.checkpoint"
    kept.mkdir()
    assert "--resume" not in call("run", file, folder=tmp_path).err
    (kept / "legs-000000.npz").touch()
    assert "--resume" in call("run", file, folder=tmp_path).err
    assert "--resume" in call("run", tmp_path, folder=tmp_path).err
    assert "--resume" not in call("run", file, "--output", tmp_path / "elsewhere", folder=tmp_path).err


def check_said_once(folder: Path) -> None:
    """Where a run until rest ends is told, and told once."""
    bent = {"load": "thrust = 3.0", "initial": 'curvature = "1 + cos(3*s)"', "solve": 'until = "equilibrium"'}
    file = written(folder, scenario(**bent))
    answer = call("run", file, "--output", folder / "out")
    solution = pl.read(folder / "out" / "strut.nc")
    assert solution.status.code == "creeping"
    assert solution.limit is not None
    said = " ".join(answer.out.split())
    assert said.count("It ends where the drive equals the threshold") == 1
    assert "stepping further in time has become pointless." in said
    section = sections.verdict(Subject(solution, 0.0)).data
    assert f"{section['status']} {section['distance']}".count("It ends where the drive equals the threshold") == 1


def test_where_it_ends_is_said_once(tmp_path: Path) -> None:
    check_said_once(tmp_path)


# -- check, new ------------------------------------------------------------------------------------------------------


def test_check_says_what_was_understood(tmp_path: Path) -> None:
    file = written(tmp_path, si_scenario(grid=""))
    before = snapshot(tmp_path)
    answer = call("check", file, folder=tmp_path)
    assert (answer.code, answer.err) == (0, "")
    for said in ("largest thrust, in EI/L²", "2\n", "thrust 1.12 N", "one-shape", "The threshold is even", "strut.nc"):
        assert said in "\n".join(line.rstrip() for line in answer.out.splitlines()) + "\n"
    told = json.loads(call("check", file, "--json").out)
    assert abs(told["groups"]["thrust_over_EI_per_L2"] - 2.0) <= 1e-15
    assert abs(told["groups"]["thrust_over_euler"] - 8.0 / np.pi**2) <= 1e-15
    assert abs(told["plan"]["retardation_times"] - 2.0) <= 1e-15
    assert (told["units"], told["plan"]["nodes"], told["plan"]["landings"]) == ("SI", "auto", 0)
    assert len(told["admissibility"]) == 12
    assert snapshot(tmp_path) == before


def test_check_of_a_folder(tmp_path: Path) -> None:
    good = written(tmp_path, scenario(), "a.toml")
    assert call("check", tmp_path).out == f"{good} can be run\n"
    written(tmp_path, scenario(load="thrust = -1.0"), "b.toml")
    answer = call("check", tmp_path)
    assert (answer.code, answer.out) == (2, f"{good} can be run\n")
    assert "b.toml: 1 mistake" in answer.err
    told = json.loads(call("check", tmp_path, "--json").out)["scenarios"]
    assert [each["accepted"] for each in told] == [True, False]


def test_new_writes_a_scenario_once(tmp_path: Path) -> None:
    assert call("new", folder=tmp_path).code == 0
    text = (tmp_path / "scenario.toml").read_text()
    (tmp_path / "scenario.toml").write_text("mine")
    answer = call("new", folder=tmp_path)
    assert answer.code == 2
    assert "exists already" in answer.err
    assert (tmp_path / "scenario.toml").read_text() == "mine"
    assert call("new", "-").out == text
    assert call("new", tmp_path / "x.toml", "--units", "dimensionless").code == 0
    assert 'units = "dimensionless"' in (tmp_path / "x.toml").read_text()
    assert call("new", tmp_path / "no" / "x.toml").code == 2


# -- export, show ----------------------------------------------------------------------------------------------------


def check_export_is_exact(result: Path) -> None:
    dataset = pl.read(result).dataset
    rows = list(csv.reader(io.StringIO(call("export", result, "tip_y", "drive").out)))
    assert rows[0] == ["t [s]", "tip_y [m]", "drive [N*m**2]"]
    numbers = np.array(rows[1:], dtype=float)
    for column, name in enumerate(("t", "tip_y", "drive")):
        assert np.array_equal(numbers[:, column], dataset[name].values)
    rows = list(csv.reader(io.StringIO(call("export", result, "curvature", "thrust").out)))
    assert rows[0] == ["t [s]", "s [m]", "curvature [1/m]", "thrust [N]"]
    numbers = np.array(rows[1:], dtype=float).reshape(dataset.sizes["t"], dataset.sizes["s"], 4)
    assert np.array_equal(numbers[:, :, 2], dataset["curvature"].values)
    assert np.array_equal(numbers[:, 0, 3], dataset["thrust"].values)
    assert np.array_equal(numbers[0, :, 1], dataset["s"].values)


def test_export_is_exact(finished: Path) -> None:
    check_export_is_exact(finished)


def test_export_to_a_file_and_the_list_of_variables(finished: Path, tmp_path: Path) -> None:
    answer = call("export", finished, "tip_y", "--output", tmp_path / "tip.csv")
    assert answer.code == 0
    assert (tmp_path / "tip.csv").read_text() == call("export", finished, "tip_y").out
    assert "natural_curvature (t) [1/m]: natural curvature" in call("export", finished).out
    answer = call("export", finished, "tip_z")
    assert (answer.code, answer.out) == (2, "")
    assert "must be a variable of the result, but is 'tip_z'" in answer.err


def test_show(finished: Path) -> None:
    assert pl.read(finished).outcome.headline in call("show", finished).out
    told = json.loads(call("show", finished, "--json").out)
    assert told["title"] == "A strip"
    damaged = finished.with_name("damaged.nc")
    damaged.write_bytes(finished.read_bytes()[:-100])
    answer = call("show", damaged)
    assert answer.code == 2
    assert "damaged.nc" in answer.err


def test_the_words_of_a_refused_scenario_are_its_first_line(tmp_path: Path) -> None:
    written(tmp_path, "nonsense", "x.toml")
    (refused,) = running.batch(tmp_path, running.Options(tmp_path / "out"))
    assert refused.words == f"{tmp_path / 'x.toml'}: 1 mistake"
