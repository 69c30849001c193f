"""Claim: where the machine refuses or judging fails nothing is lost: one message, exit code 1, what is done is kept."""

from __future__ import annotations

import errno
import fcntl
import os
import signal
import stat
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

import plastica as pl
from plastica import files
from plastica.doors.cli import main
from plastica.errors import FileError, StorageError
from plastica.files import Medium, write_whole
from plastica.motion import checkpoint, outcome, store
from tests.commandline import Answer, call, scenario, snapshot, written
from tests.support import pair

PUT_OFF = 'preference = "k*m**2/2"\nflow = "c*pos(x)**2*exp(-1e-6/(1e-9+pos(x)))"\nthreshold = "h"\n'
PUT_OFF += "parameters = { k = 1.0, c = 1.0, h = 0.1 }"
"""A flow law that fades like no power of the excess drive, where doubles can show it."""


@pytest.fixture(scope="module")
def sol() -> pl.Solution:
    return pl.solve(pl.Strut(pair("A", 2.0), pl.Load(thrust=1.0), pl.Grid(4)), 0.1, until=0.5, rtol=1e-4)


# -- judged after it was saved ----------------------------------------------------------------------------------------


def check_no_power(folder: Path) -> None:
    """A law that is no power of the excess drive is run to its end, and its limit told without one."""
    file = written(folder, scenario(material=PUT_OFF, load="thrust = 3.0", solve="until = 20.0"))
    assert call("check", file).code == 0
    answer = call("run", file, "--output", folder / "out")
    assert (answer.code, answer.err) == (0, "")
    assert "like no power of the excess drive" in " ".join(answer.out.split())
    limit = pl.read(folder / "out" / "strut.nc").limit
    assert limit is not None
    assert limit.kind == "limiting"
    assert "could not" not in limit.sentence


def test_a_flow_that_is_no_power(tmp_path: Path) -> None:
    check_no_power(tmp_path)


def failing(error: Exception) -> Callable[..., Any]:
    def fail(*_: object, **__: object) -> Any:
        raise error

    return fail


@pytest.mark.parametrize("error", [ZeroDivisionError("float division by zero"), MemoryError(), ValueError("no root")])
@pytest.mark.parametrize("place", ["outcome", "limit"])
def test_a_judgement_that_fails_is_a_sentence(
    error: Exception, place: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from plastica.motion import longtime

    monkeypatch.setattr(*((outcome, "outcome") if place == "outcome" else (longtime, "limit_of")), failing(error))
    file = written(tmp_path, scenario())
    answer = call("run", file, "--output", tmp_path / "out")
    assert (answer.code, answer.err) == (0, "")
    assert type(error).__name__ in answer.out
    monkeypatch.undo()
    back = pl.read(tmp_path / "out" / "strut.nc")
    assert back.status.ok
    assert back.outcome.headline != "Not judged"


@pytest.mark.parametrize(
    ("error", "words"), [(MemoryError(), "not enough memory"), (ZeroDivisionError("x"), "ZeroDivisionError")]
)
def test_a_page_that_fails_keeps_the_result(
    error: Exception, words: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from plastica.show import report

    monkeypatch.setattr(report, "report_and_film", failing(error))
    file = written(tmp_path, scenario(output='film = "none"'))
    answer = call("run", file, "--output", tmp_path / "out")
    assert answer.code == 1
    assert words in answer.err
    assert "strut.nc" in answer.err
    assert "Traceback" not in answer.err
    assert pl.read(tmp_path / "out" / "strut.nc").status.ok


# -- the machine refuses ----------------------------------------------------------------------------------------------

FULL = OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))


def check_full_disk(folder: Path, patch: pytest.MonkeyPatch) -> None:
    """A disk that is full when the result is saved: code 1, the checkpoint kept, and with room the run ends as ever."""
    file = written(folder, scenario())
    with patch.context() as full:
        full.setattr(Medium, "check", failing(FULL))
        answer = call("run", file, "--output", folder / "out")
    assert answer.code == 1
    assert f"`{folder / 'out' / 'strut.nc'}` cannot be written: {FULL.strerror}. Make room" in answer.err
    assert "--resume" in answer.err
    kept = folder / "out" / ".strut.checkpoint"
    assert sorted(path.name for path in (folder / "out").iterdir()) == [".strut.checkpoint"]
    assert list(kept.glob(checkpoint.PATTERN))
    assert call("run", file, "--output", folder / "out", "--resume").code == 0
    assert [path.name for path in (folder / "out").iterdir()] == ["strut.nc"]
    assert pl.read(folder / "out" / "strut.nc").status.ok


def test_a_full_disk(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    check_full_disk(tmp_path, monkeypatch)


SAVING = """
import resource, signal, sys
import plastica as pl
signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
sol = pl.read(sys.argv[1])
for size in map(int, sys.argv[3:]):
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, resource.RLIM_INFINITY))
    try:
        sol.save(sys.argv[2])
    except pl.errors.StorageError as error:
        assert "cannot be written: File too large" in str(error)
    else:
        raise AssertionError("saved")
"""


def test_wherever_in_the_file_the_disk_is_full(sol: pl.Solution, tmp_path: Path) -> None:
    """The file library must not learn of it: it would crash. Run apart, for that reason."""
    size = sol.save(tmp_path / "sound.nc").stat().st_size
    sizes = [str(int(share * size)) for share in (0.0, 0.01, 0.2, 0.5, 0.9, 0.97)]
    (tmp_path / "out").mkdir()
    command = [sys.executable, "-c", SAVING, str(tmp_path / "sound.nc"), str(tmp_path / "out" / "run.nc"), *sizes]
    done = subprocess.run(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")
    assert list((tmp_path / "out").iterdir()) == []


@pytest.mark.parametrize("number", [errno.ENOSPC, errno.EIO, errno.EROFS, errno.EACCES, errno.EPERM, errno.EFBIG])
def test_what_the_machine_refuses_is_no_mistake(number: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Whatever is to be written: results, tables, checkpoints, scenarios, folders."""
    refused = OSError(number, os.strerror(number))
    with pytest.raises(StorageError, match="cannot be written"):
        write_whole(tmp_path / "x.csv", failing(refused))
    monkeypatch.setattr(Path, "mkdir", failing(refused))
    file = written(tmp_path, scenario())
    before = snapshot(tmp_path)
    for arguments in (("run", file, "--output", tmp_path / "out"), ("sweep", file, "--store", tmp_path / "s" / "t")):
        answer = call(*arguments)
        if arguments[0] == "run":
            assert answer.code == 1
            assert os.strerror(number) in answer.err
        assert "Traceback" not in answer.err
    assert snapshot(tmp_path) == before


@pytest.mark.parametrize("name", ["no/folder.nc", "a\0b.nc", "x" * 300 + ".nc"])
def test_a_wrong_name_is_a_mistake(name: str, tmp_path: Path, sol: pl.Solution) -> None:
    with pytest.raises(FileError, match="cannot be written") as told:
        sol.save(tmp_path / name)
    assert not isinstance(told.value, StorageError)


def test_a_name_that_is_no_text(tmp_path: Path) -> None:
    """A scenario whose file name is not UTF-8 runs like any other; results spell its name with an escape."""
    name = os.fsdecode(b"bad\xff.toml")
    written(tmp_path, scenario(), name)
    answer = call("run", tmp_path / name, "--output", tmp_path / "out", "--no-report", "--no-film")
    assert answer.code == 0, answer
    (result,) = (tmp_path / "out").glob("*.nc")
    assert pl.read(result).provenance["scenario_file"] == "bad\\udcff.toml"


def test_want_of_memory(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    file = written(tmp_path, scenario())
    monkeypatch.setattr(store, "write", failing(MemoryError()))
    answer = call("run", file, "--output", tmp_path / "out")
    assert answer.code == 1
    assert "there is not enough memory" in answer.err
    assert "--resume" in answer.err
    monkeypatch.undo()
    assert call("run", file, "--output", tmp_path / "out", "--resume").code == 0


def test_pages_of_a_sweep_for_which_there_is_no_room(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    file = written(tmp_path, scenario() + '[sweep.over]\n"load.thrust" = [1.0, 2.0]\n')
    monkeypatch.setattr("plastica.show.report.page", lambda *_, **__: "a page")
    monkeypatch.setattr("plastica.show.report.write_whole", failing(StorageError("cannot be written: full")))
    answer = call("sweep", file, "--store", "s", "--workers", "0", "--reports", "1", folder=tmp_path)
    assert answer.code == 1
    assert "cannot be written: full" in answer.err


# -- settled on the disk ----------------------------------------------------------------------------------------------


def check_settled(patch: pytest.MonkeyPatch, folder: Path) -> None:
    """Files are settled through a descriptor that may write, as Windows demands, and so is the folder, after them."""
    settled: list[str] = []

    def fsync(descriptor: int) -> None:
        mode = os.fstat(descriptor).st_mode
        if stat.S_ISDIR(mode):
            assert (folder / "run.txt").read_text() == "whole"
            settled.append("folder")
            return
        assert fcntl.fcntl(descriptor, fcntl.F_GETFL) & os.O_ACCMODE != os.O_RDONLY
        settled.append("file")

    patch.setattr(os, "fsync", fsync)
    write_whole(folder / "run.txt", lambda aside: aside.write_text("whole"))
    assert settled == ["file", "folder"]


def test_files_are_settled_as_windows_wants_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    check_settled(monkeypatch, tmp_path)


# -- left over by kills -----------------------------------------------------------------------------------------------

WRITING = """
import sys
from pathlib import Path
from plastica.files import write_whole
def slow(aside):
    aside.write_text("half")
    print("writing", flush=True)
    sys.stdin.readline()
write_whole(Path(sys.argv[1]), slow)
"""


def check_leftovers(folder: Path) -> None:
    """What a living process writes stays, however old; what a killed one has left goes with the next writing."""
    target = folder / "run.nc"
    others = {
        ".run.notes.nc",
        ".run.abcdefg1.csv",
        ".other.abcdefg1.nc",
        "run.abcdefg1.nc",
        ".run.abcdefg1.nc.writing2",
    }
    for name in others:
        (folder / name).write_text("mine")
    command = [sys.executable, "-c", WRITING, str(target)]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == "writing\n"
        half = [path.name for path in folder.iterdir() if path.name not in others]
        assert len(half) == 2
        for name in (*half, *others):
            os.utime(folder / name, (1.0, 1.0))
        write_whole(target, lambda aside: aside.write_text("whole"))
        assert {path.name for path in folder.iterdir()} == {*half, *others, "run.nc"}
        process.kill()
        process.wait()
    write_whole(target, lambda aside: aside.write_text("whole"))
    assert {path.name for path in folder.iterdir()} == {*others, "run.nc"}


def test_what_kills_leave_is_swept_up(tmp_path: Path) -> None:
    check_leftovers(tmp_path)


def test_without_a_mark_only_what_is_old_goes(tmp_path: Path) -> None:
    for name in (".run.abcdefg1.nc", ".run.abcdefg2.nc"):
        (tmp_path / name).write_text("half")
    os.utime(tmp_path / ".run.abcdefg1.nc", (1.0, 1.0))
    write_whole(tmp_path / "run.nc", lambda aside: aside.write_text("whole"))
    assert {path.name for path in tmp_path.iterdir()} == {".run.abcdefg2.nc", "run.nc"}


def test_what_another_machine_writes_stays_for_a_day(tmp_path: Path) -> None:
    """Its lock may not be told here."""
    half, mark = tmp_path / ".run.abcdefg1.nc", tmp_path / ".run.abcdefg1.nc.writing"
    half.write_text("half")
    mark.write_text("being written on another\n")
    write_whole(tmp_path / "run.nc", lambda aside: aside.write_text("whole"))
    assert half.is_file()
    for path in (half, mark):
        os.utime(path, (1.0, 1.0))
    write_whole(tmp_path / "run.nc", lambda aside: aside.write_text("whole"))
    assert [path.name for path in tmp_path.iterdir()] == ["run.nc"]


def test_where_files_cannot_be_locked_it_is_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from plastica import locks

    for module in (files, locks):
        monkeypatch.setattr(module, "take_lock", lambda descriptor, *, wait=False: None)
    write_whole(tmp_path / "run.nc", lambda aside: aside.write_text("whole"))
    with pytest.warns(UserWarning, match="files cannot be locked here"), locks.held(tmp_path / "c"):
        pass
    assert [path.name for path in tmp_path.iterdir()] == ["run.nc"]


# -- ended from outside -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGHUP, signal.SIGINT])
def test_a_signal_ends_as_ctrl_c_does(number: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    file = written(
        tmp_path, scenario(load='thrust = { program = "table", times = [0, 0.5, 1, 1.5], values = [1, 2, 1, 2] }')
    )
    kept, sound = [], checkpoint.Checkpoint.keep

    def keep(self: checkpoint.Checkpoint, leg: Any) -> None:
        sound(self, leg)
        kept.append(leg)
        if len(kept) == 2:
            os.kill(os.getpid(), number)

    before = signal.getsignal(number)
    monkeypatch.setattr(checkpoint.Checkpoint, "keep", keep)
    answer = call("run", file, "--output", tmp_path / "out")
    assert signal.getsignal(number) == before
    assert answer.code == 130
    assert "interrupted. To go on from there, give the same command with --resume" in answer.err
    monkeypatch.undo()
    assert call("run", file, "--output", tmp_path / "out", "--resume").code == 0
    resumed = pl.read(tmp_path / "out" / "strut.nc")
    assert call("run", file, "--output", tmp_path / "whole").code == 0
    assert resumed == pl.read(tmp_path / "whole" / "strut.nc")


def test_a_signal_that_is_ignored_stays_ignored(monkeypatch: pytest.MonkeyPatch) -> None:
    before = signal.signal(signal.SIGHUP, signal.SIG_IGN)
    try:
        monkeypatch.setattr("plastica.doors.cli.cli.main", lambda **_: os.kill(os.getpid(), signal.SIGHUP))
        assert main([]) == 0
    finally:
        signal.signal(signal.SIGHUP, before)


# -- what is read is not written over ---------------------------------------------------------------------------------


def refused(answer: Answer) -> None:
    assert answer.code == 2
    assert "would be overwritten: it is the file that is read" in answer.err


def check_sources_stay(folder: Path) -> None:
    """No command writes over what it reads, by whatever name that goes."""
    file = written(folder, scenario())
    assert call("run", file, "--output", folder).code == 0
    result = folder / "strut.nc"
    (folder / "strut.html").symlink_to(result)
    (folder / "hard.csv").hardlink_to(result)
    (folder / "strut.svg").symlink_to(file)
    (folder / "result.svg").symlink_to(result)
    on = written(
        folder,
        scenario(initial='result = "strut.nc"', solve="until = 4.0", output='film = "none"\nname = "strut"'),
        "on.toml",
    )
    named = written(folder, scenario(), "strut-tip_y.csv.toml")
    before = snapshot(folder)
    refused(call("export", result, "tip_y", "-o", result))
    refused(call("export", result, "tip_y", "-o", folder / "hard.csv"))
    refused(call("export", "strut.nc", "-o", "../" + folder.name + "/strut.nc", folder=folder))
    refused(call("show", result, "--report", folder / "strut.html"))
    refused(call("equilibria", file, "--plot", folder / "strut.svg"))
    refused(call("phase-diagram", file, "--plot", folder / "result.svg", "--result", result))
    refused(call("sweep", file, "--plot", folder / "strut.svg"))
    refused(call("run", on, "--output", folder))
    assert call("new", named).code == 2
    assert call("sweep", file, "--store", file).code == 2
    assert snapshot(folder) == before


def test_what_is_read_is_never_written_over(tmp_path: Path) -> None:
    check_sources_stay(tmp_path)
