"""Claim: the doors are quick, quiet and safe: no traceback, no markup from outside, no needless imports."""

from __future__ import annotations

import io
import os
import subprocess
import sys
from pathlib import Path

import pytest

import plastica as pl
from plastica.doors import progress
from plastica.doors.numbers import clean
from plastica.motion.solve import Progress
from tests.commandline import call, scenario, si_scenario, written


@pytest.mark.parametrize(
    "arguments",
    [(), ("rum",), ("run",), ("run", "x", "--outptu", "y"), ("new", "x", "--units", "cgs"), ("completion", "sh")],
)
def test_mistakes_at_the_command_line(arguments: tuple[str, ...], tmp_path: Path) -> None:
    answer = call(*arguments, folder=tmp_path)
    assert answer.code == 2
    assert "Usage:" in answer.err + answer.out
    assert list(tmp_path.iterdir()) == []


def test_help_and_version_are_quick() -> None:
    code = (
        "import sys; from plastica.doors.cli import main; main(['--help']); main(['--version'])\n"
        "heavy = {'numpy', 'scipy', 'sympy', 'pint', 'pydantic', 'xarray', 'rich', 'matplotlib', 'jinja2'}\n"
        "print(sorted(heavy & set(sys.modules)))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60, check=True)
    assert done.stdout.splitlines()[-1] == "[]"
    assert f"plastica, version {pl.__version__}" in done.stdout


def test_a_run_imports_nothing_for_pictures(tmp_path: Path) -> None:
    """That keeps its start quick (xarray imports pint by itself where it is installed, and dask, and that jinja2)."""
    file = written(tmp_path, si_scenario())
    code = (
        "import sys; from plastica.doors.cli import main\n"
        f"assert main(['run', {str(file)!r}, '--output', {str(tmp_path / 'out')!r}, '--quiet']) == 0\n"
        "print(sorted({'matplotlib', 'PIL', 'rich', 'plastica.show.report'} & set(sys.modules)))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=60, check=True)
    assert (done.stdout, done.stderr) == ("[]\n", "")


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_completion(shell: str) -> None:
    answer = call("completion", shell)
    assert answer.code == 0
    assert "_PLASTICA_COMPLETE" in answer.out


def test_a_reader_who_has_seen_enough() -> None:
    script = f"'{sys.executable}' -m plastica new - | head -n 1"
    done = subprocess.run(["bash", "-c", script], capture_output=True, text=True, timeout=60, check=False)
    assert done.stdout.startswith("# A scenario")
    assert done.stderr == ""


def test_a_terminal_without_the_signs(tmp_path: Path) -> None:
    file = written(tmp_path, scenario())
    command = [sys.executable, "-m", "plastica", "run", str(file), "--output", str(tmp_path / "out")]
    environment = {**os.environ, "PYTHONIOENCODING": "ascii"}
    done = subprocess.run(command, capture_output=True, text=True, timeout=60, check=True, env=environment)
    assert "0.1 ? 0." in done.stdout
    assert done.stderr == ""


def test_text_of_the_user_is_never_markup(tmp_path: Path) -> None:
    file = written(tmp_path, scenario(head='title = "[bold]x[/bold] [/] :smile:"\n'))
    assert "[bold]x[/bold] [/] :smile:" in call("run", file, "--output", tmp_path / "out").out


class Terminal(io.StringIO):
    """A standard error that somebody watches."""

    def isatty(self) -> bool:
        return True


@pytest.mark.parametrize(("yielding", "word"), [(True, "yielding"), (False, "frozen")])
def test_long_runs_show_where_they_are(yielding: bool, word: str, monkeypatch: pytest.MonkeyPatch) -> None:
    screen = Terminal()
    monkeypatch.setattr(sys, "stderr", screen)
    monkeypatch.setenv("COLUMNS", "120")
    with progress.Meter(wanted=True, si=True) as meter:
        meter(Progress(60.0, 7200.0, 10, yielding, 0.5))
        assert screen.getvalue() == ""
        meter(Progress(3600.0, 7200.0, 1234, yielding, 1.5))
    shown = screen.getvalue()
    assert "t = 60 min of 2 h, 1234 steps, " in shown
    assert word in shown


def test_no_meter_without_a_terminal(monkeypatch: pytest.MonkeyPatch) -> None:
    for screen, wanted in ((io.StringIO(), True), (Terminal(), False)):
        monkeypatch.setattr(sys, "stderr", screen)
        with progress.Meter(wanted=wanted, si=True) as meter:
            meter(Progress(3600.0, None, 1234, True, 1.5))
        assert screen.getvalue() == ""


def test_json_has_no_numbers_that_are_none() -> None:
    assert clean({"a": [1.0, float("nan")], "b": (float("inf"), Path("x"))}) == {"a": [1.0, None], "b": [None, "x"]}
