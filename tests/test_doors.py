"""Claim: the doors are quick, quiet and safe: no traceback, no markup from outside, no needless imports."""

from __future__ import annotations

import io
import os
import subprocess
import sys
import threading
from contextlib import suppress
from pathlib import Path

import pytest

import plastica as pl
from plastica.doors import progress
from plastica.doors import sweep as sweeps
from plastica.doors.numbers import clean
from plastica.motion.solve import Progress
from plastica.study.sweep import Progress as Far
from tests.commandline import call, scenario, si_scenario, written
from tests.patience import PATIENCE, wait


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
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=PATIENCE, check=True)
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
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=PATIENCE, check=True)
    assert (done.stdout, done.stderr) == ("[]\n", "")


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_completion(shell: str) -> None:
    answer = call("completion", shell)
    assert answer.code == 0
    assert "_PLASTICA_COMPLETE" in answer.out


def test_a_reader_who_has_seen_enough() -> None:
    script = f"'{sys.executable}' -m plastica new - | head -n 1"
    done = subprocess.run(["bash", "-c", script], capture_output=True, text=True, timeout=PATIENCE, check=False)
    assert done.stdout.startswith("# A scenario")
    assert done.stderr == ""


def test_a_terminal_without_the_signs(tmp_path: Path) -> None:
    file = written(tmp_path, scenario())
    command = [sys.executable, "-m", "plastica", "run", str(file), "--output", str(tmp_path / "out")]
    environment = {**os.environ, "PYTHONIOENCODING": "ascii"}
    done = subprocess.run(command, capture_output=True, text=True, timeout=PATIENCE, check=True, env=environment)
    assert "0.1 ? 0." in done.stdout
    assert done.stderr == ""


def test_text_of_the_user_is_never_markup(tmp_path: Path) -> None:
    file = written(tmp_path, scenario(head='title = "[bold]x[/bold] [/] :smile:"\n'))
    assert "[bold]x[/bold] [/] :smile:" in call("run", file, "--output", tmp_path / "out").out


class Terminal(io.StringIO):
    """A standard error that somebody watches."""

    def isatty(self) -> bool:
        return True


def watched(patch: pytest.MonkeyPatch) -> Terminal:
    """The terminal that standard error is from now on."""
    screen = Terminal()
    patch.setattr(sys, "stderr", screen)
    patch.setenv("COLUMNS", "120")
    patch.setenv("TERM", "xterm")
    return screen


@pytest.mark.parametrize(("yielding", "word"), [(True, "yielding"), (False, "frozen")])
def test_long_runs_show_where_they_are(yielding: bool, word: str, monkeypatch: pytest.MonkeyPatch) -> None:
    screen = watched(monkeypatch)
    with progress.meter(wanted=True, si=True) as tell:
        tell(Progress(60.0, 7200.0, 10, yielding, 0.5))
        assert screen.getvalue() == ""
        monkeypatch.setattr(progress, "PATIENCE", 0.0)
        tell(Progress(3600.0, 7200.0, 1234, yielding, 1.5))
    shown = screen.getvalue()
    assert "t = 60 min of 2 h, 1234 steps, " in shown
    assert word in shown


def test_long_charts_and_sweeps_count(monkeypatch: pytest.MonkeyPatch) -> None:
    screen = watched(monkeypatch)
    monkeypatch.setattr(progress, "PATIENCE", 0.0)
    with progress.counter(wanted=True, words="thrusts") as tell:
        tell(3, 40)
    assert "3 of 40 thrusts" in screen.getvalue()
    with sweeps._meter(wanted=True) as count:
        count(Far(members=8, of=100, failed=0, rate=4.0, left=23.0))
    assert "8 of 100 members, 4 a second, 23 s left" in screen.getvalue()


def drawing() -> set[threading.Thread]:
    """The threads that draw bars; others of this process come and go as they like."""
    return {thread for thread in threading.enumerate() if type(thread).__module__.startswith("rich.")}


def check_bar_is_gone(patch: pytest.MonkeyPatch) -> None:
    """Where something goes wrong under way the bar ends too: nothing goes on drawing it, and the cursor is back."""
    screen, before = watched(patch), drawing()
    patch.setattr(progress, "PATIENCE", 0.0)
    with suppress(KeyboardInterrupt), progress.counter(wanted=True, words="thrusts") as tell:
        tell(3, 40)
        assert drawing() - before
        raise KeyboardInterrupt
    assert screen.getvalue().rfind("\x1b[?25h") > screen.getvalue().rfind("\x1b[?25l") >= 0
    wait(lambda: drawing() <= before, "the end of what draws the bar")


def test_the_bar_goes_with_an_error(monkeypatch: pytest.MonkeyPatch) -> None:
    check_bar_is_gone(monkeypatch)


def test_no_meter_without_a_terminal(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(progress, "PATIENCE", 0.0)
    for screen, wanted in ((io.StringIO(), True), (Terminal(), False)):
        monkeypatch.setattr(sys, "stderr", screen)
        with progress.meter(wanted=wanted, si=True) as tell:
            tell(Progress(3600.0, None, 1234, True, 1.5))
        assert screen.getvalue() == ""


def test_json_has_no_numbers_that_are_none() -> None:
    assert clean({"a": [1.0, float("nan")], "b": (float("inf"), Path("x"))}) == {"a": [1.0, None], "b": [None, "x"]}
