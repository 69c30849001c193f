"""Claim: a saved solution is read back equal, a damaged file is refused, a killed run ends as if it had not been."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import textwrap
from pathlib import Path

import numpy as np
import pytest

import plastica as pl
from plastica.errors import FileError
from plastica.motion.checkpoint import Checkpoint
from tests.patience import PATIENCE, wait
from tests.support import DATA, pair

STRUT = pl.Strut(pair("B", 5.0), pl.Load(thrust=pl.programs.ramp_hold_release(3.0, 1.0, 20.0, 0.5)), pl.Grid(nodes=12))
SPECIMEN = pl.Specimen(length="250 mm", bending_stiffness="0.035 N*m**2", retardation_time="120 s", temperature="293 K")


def some_solution() -> pl.Solution:
    return pl.solve(STRUT, "0.3*cos(2*s) + step(s - 0.3)", 0.1, until=40.0)


def check_round_trip(sol: pl.Solution, path: Path) -> None:
    assert sol.save(path) == path
    back = pl.read(path)
    assert back == sol
    assert back.dataset.identical(sol.dataset)
    assert back.ledger == sol.ledger
    assert back.events == sol.events
    # What is not judged is nan, which equals nothing.
    assert repr(back.outcome) == repr(sol.outcome)
    t = np.linspace(sol.history.start, sol.history.end, 17) * sol.model.scales.time
    s = np.linspace(0.0, sol.model.scales.length, 9)
    assert np.array_equal(back.at(s, t[:, None]), sol.at(s, t[:, None]))


def test_round_trip(tmp_path: Path) -> None:
    check_round_trip(some_solution(), tmp_path / "run.nc")


def test_round_trip_of_every_kind(tmp_path: Path) -> None:
    parameters = {"k": "0.035 N*m**2", "c": "27 1/(N**2*m**5*s)", "h": "0.0035 N*m**2"}
    material = pl.Material("k*m**2/2", "c*pos(x)**2", "h", parameters, name="a strip", source="a test")
    load = pl.Load(thrust="1.5 N", transverse="0.05*sin(t/100)", couple="0.001 N*m", weight=0.2)
    si = pl.solve(pl.Strut(material, load, pl.Grid(10), SPECIMEN), "0.4 1/m", until="1 h", times=[0.0, 60.0, 3600.0])
    check_round_trip(si.with_provenance(title="<b>title</b>"), tmp_path / "si.nc")
    failed = pl.solve(STRUT, "1 + cos(3*s)", until=100.0, max_steps=50)
    check_round_trip(failed, tmp_path / "failed.nc")
    still = pl.solve(pl.Strut(pair("A"), pl.Load(thrust=3.0)), 0.0, until="equilibrium")
    check_round_trip(still, tmp_path / "still.nc")
    on = pl.solve(STRUT, start=some_solution(), until=60.0)
    check_round_trip(on, tmp_path / "on.nc")
    assert {path.name for path in tmp_path.iterdir()} == {"si.nc", "failed.nc", "still.nc", "on.nc"}


def test_other_programs_read_the_dataset(tmp_path: Path) -> None:
    import xarray

    sol = some_solution()
    sol.save(tmp_path / "run.nc")
    with xarray.open_dataset(tmp_path / "run.nc", engine="h5netcdf") as data:
        assert np.array_equal(data.tip_y.values, sol.dataset.tip_y.values)
        assert data.tip_y.attrs["long_name"]
        assert data.attrs["status"] == "done"
        assert "Rajagopal" in data.attrs["references"]


def test_the_first_schema_is_read(tmp_path: Path) -> None:
    """A file of schema version 1, kept as it was written: later versions must go on reading it."""
    sol = pl.read(DATA / "result_v1.nc")
    assert sol.status.code == "done"
    again = pl.solve(sol.model, "0.3*cos(2*s)", 0.1, until=2.0, rtol=1e-4)
    assert again.history.end == sol.history.end == 2.0
    assert np.abs(again.history.y[-1] - sol.history.y[-1]).max() <= 100.0 * sol.rtol


def check_damage(path: Path, damaged: bytes) -> None:
    path.write_bytes(damaged)
    with pytest.raises(FileError, match="damaged"):
        pl.read(path)


def test_truncation_is_seen(tmp_path: Path) -> None:
    whole = some_solution().save(tmp_path / "run.nc").read_bytes()
    for share in (0.0, 0.01, 0.3, 0.7, 0.999):
        check_damage(tmp_path / "cut.nc", whole[: int(share * len(whole))])
    check_damage(tmp_path / "text.nc", b"once upon a time")


def test_flipped_bits_are_seen_or_harmless(tmp_path: Path) -> None:
    """A flip in unused space changes nothing; every other is refused. Run apart: a library may crash on a bad file."""
    whole = some_solution().save(tmp_path / "run.nc")
    script = textwrap.dedent(
        """
        import random, sys
        from pathlib import Path
        import plastica as pl
        from plastica.errors import FileError
        whole, trials = Path(sys.argv[1]), 150
        data, good = whole.read_bytes(), pl.read(whole)
        aside = whole.with_name("flipped.nc")
        rng = random.Random(7)
        refused = 0
        for _ in range(trials):
            at = rng.randrange(len(data))
            flipped = bytearray(data)
            flipped[at] ^= 1 << rng.randrange(8)
            aside.write_bytes(flipped)
            try:
                back = pl.read(aside)
            except FileError:
                refused += 1
            else:
                assert back == good and back.dataset.identical(good.dataset)
        print(refused)
        """
    )
    done = subprocess.run(
        [sys.executable, "-c", script, str(whole)], capture_output=True, text=True, timeout=PATIENCE, check=False
    )
    assert done.returncode == 0, done.stderr[-500:]
    assert int(done.stdout) >= 60


def test_missing_files_and_folders(tmp_path: Path) -> None:
    with pytest.raises(FileError, match="does not exist"):
        pl.read(tmp_path / "nothing.nc")
    with pytest.raises(FileError, match="cannot be written"):
        some_solution().save(tmp_path / "no" / "folder.nc")


# -- checkpoints -------------------------------------------------------------------------------------------------

LONG = {"curvature": "0.3*cos(2*s)", "natural_curvature": 0.0, "until": 80.0, "rtol": 1e-10}


def long_strut() -> pl.Strut:
    return pl.Strut(pair("A", 5.0), pl.Load(thrust=pl.programs.cycles(0.0, 3.0, 2.0, 40)), pl.Grid(nodes=12))


def check_resumed(whole: pl.Solution, resumed: pl.Solution) -> None:
    """The same to the last bit, whatever was read back and whatever computed."""
    assert resumed == whole
    assert resumed.dataset.identical(whole.dataset)


def test_any_prefix_of_legs_gives_the_same_result(tmp_path: Path) -> None:
    whole = pl.solve(long_strut(), **LONG, checkpoint=tmp_path / "c", checkpoint_every=0.0)
    segments = sorted((tmp_path / "c").glob("legs-*.npz"))
    assert len(segments) > 50
    for kept in (0, 1, 17, len(segments) // 2, len(segments)):
        for path in sorted((tmp_path / "c").glob("legs-*.npz"))[kept:]:
            path.unlink()
        resumed = pl.solve(long_strut(), **LONG, checkpoint=tmp_path / "c", checkpoint_every=0.0, resume=True)
        check_resumed(whole, resumed)


def test_a_damaged_segment_is_computed_anew(tmp_path: Path) -> None:
    whole = pl.solve(long_strut(), **LONG, checkpoint=tmp_path / "c", checkpoint_every=0.0)
    path = tmp_path / "c" / "legs-000009.npz"
    path.write_bytes(path.read_bytes()[:100])
    resumed = pl.solve(long_strut(), **LONG, checkpoint=tmp_path / "c", checkpoint_every=0.0, resume=True)
    check_resumed(whole, resumed)


def test_the_checkpoint_of_another_run_is_refused(tmp_path: Path) -> None:
    pl.solve(long_strut(), **LONG, checkpoint=tmp_path / "c", checkpoint_every=0.0)
    other = {**LONG, "rtol": 1e-9}
    with pytest.raises(FileError, match="another run"):
        pl.solve(long_strut(), **other, checkpoint=tmp_path / "c", resume=True)
    fresh = pl.solve(long_strut(), **other, checkpoint=tmp_path / "c")
    assert fresh.status.ok


def test_automatic_nodes_resume_too(tmp_path: Path) -> None:
    strut = long_strut().with_grid(pl.Grid(nodes="auto"))
    whole = pl.solve(strut, **LONG, checkpoint=tmp_path / "c", checkpoint_every=0.0)
    last = sorted((tmp_path / "c").glob("nodes-*/legs-*.npz"))[-1]
    last.unlink()
    check_resumed(whole, pl.solve(strut, **LONG, checkpoint=tmp_path / "c", checkpoint_every=0.0, resume=True))


def check_every_prefix(strut: pl.Strut, run: dict[str, object], folder: Path) -> None:
    whole = pl.solve(strut, **run, checkpoint=folder, checkpoint_every=0.0)
    chosen = f"nodes-{whole.grid.per_element}"
    count = len(list(folder.glob(f"{chosen}/legs-*.npz")))
    for kept in (0, 1, count // 3, count - 1):
        for path in sorted(folder.glob(f"{chosen}/legs-*.npz"))[kept:]:
            path.unlink()
        check_resumed(whole, pl.solve(strut, **run, checkpoint=folder, checkpoint_every=0.0, resume=True))


def test_automatic_nodes_resume_from_any_prefix_of_a_fading_motion(tmp_path: Path) -> None:
    """What is left late is small; the size met early must still be known."""
    load = pl.Load(thrust=pl.programs.cycles(0.0, 1.0, 1.0, 12))
    strut = pl.Strut(pair("A"), load, pl.Grid(nodes="auto"))
    check_every_prefix(strut, {"curvature": "2*cos(4*s)", "until": 14.0, "rtol": 1e-7}, tmp_path / "c")


def test_too_few_nodes_for_anything_resume_too(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from plastica.motion import solve as module

    monkeypatch.setattr(module, "AUTO_NODES", (6,))
    strut = pl.Strut(pair("A"), pl.Load(thrust=3.0), pl.Grid(nodes="auto"))
    run = {"curvature": 0.3, "until": 20.0, "rtol": 1e-8}
    whole = pl.solve(strut, **run)
    assert whole.status.code == "done"
    assert "the most tried" in whole.notes[-1]
    check_resumed(whole, pl.solve(strut, **run, checkpoint=tmp_path / "c", checkpoint_every=0.0, resume=True))
    check_resumed(whole, pl.solve(strut, **run, checkpoint=tmp_path / "c", checkpoint_every=0.0, resume=True))


def test_another_run_in_the_same_folder_starts_afresh(tmp_path: Path) -> None:
    strut = pl.Strut(pair("A"), pl.Load(thrust=3.0), pl.Grid(nodes="auto"))
    pl.solve(strut, "cos(9*s)", until=1.0, checkpoint=tmp_path / "c", checkpoint_every=0.0)
    easy = pl.solve(strut, 0.1, until=1.0, rtol=1e-5, checkpoint=tmp_path / "c", checkpoint_every=0.0)
    again = pl.solve(strut, 0.1, until=1.0, rtol=1e-5, checkpoint=tmp_path / "c", checkpoint_every=0.0, resume=True)
    check_resumed(easy, again)


def test_an_interrupt_keeps_what_is_finished(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("plastica.motion.solve.TOLD_EVERY", -1.0)

    def interrupt(_: object) -> None:
        raise KeyboardInterrupt

    long = {**LONG, "until": 400.0}
    strut = long_strut().with_load(pl.Load(thrust=pl.programs.cycles(0.0, 3.0, 2.0, 200)))
    with pytest.raises(KeyboardInterrupt):
        pl.solve(strut, **long, checkpoint=tmp_path / "c", checkpoint_every=1e6, progress=interrupt)
    assert list((tmp_path / "c").glob("legs-*.npz"))


@pytest.mark.parametrize("segments", [1, 6])
def test_kill_and_resume(tmp_path: Path, segments: int) -> None:
    """kill -9 in the middle, whatever is being written just then; then run again."""
    script = textwrap.dedent(
        """
        import sys
        import plastica as pl
        from tests.test_store import LONG, long_strut
        print("ready", flush=True)
        pl.solve(long_strut(), **LONG, checkpoint=sys.argv[1], checkpoint_every=0.0)
        """
    )
    root = Path(__file__).parent.parent
    process = subprocess.Popen(
        [sys.executable, "-c", script, str(tmp_path / "c")], stdout=subprocess.PIPE, cwd=root, env=os.environ
    )
    assert process.stdout is not None
    process.stdout.readline()
    wait(lambda: len(list(tmp_path.glob("c/legs-*.npz"))) >= segments, "the first segments")
    process.send_signal(signal.SIGKILL)
    process.wait(PATIENCE)
    process.stdout.close()
    resumed = pl.solve(long_strut(), **LONG, checkpoint=tmp_path / "c", checkpoint_every=0.0, resume=True)
    check_resumed(pl.solve(long_strut(), **LONG), resumed)


def test_a_checkpoint_leaves_nothing_behind(tmp_path: Path) -> None:
    pl.solve(long_strut(), **LONG, checkpoint=tmp_path / "c", checkpoint_every=0.0)
    Checkpoint(tmp_path / "c", "").clear()
    assert list(tmp_path.iterdir()) == []
