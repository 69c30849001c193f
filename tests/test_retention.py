"""Claim: of a long run whose times are given only what its result needs stays in memory, and nothing else changes."""

from __future__ import annotations

import io
import weakref
from contextlib import closing
from pathlib import Path

import numpy as np
import pytest

import plastica as pl
from plastica.errors import ArgumentError, StorageError
from plastica.motion import checkpoint, retention
from plastica.motion.history import History
from plastica.motion.integrate import Leg
from tests.support import pair

TIMES = [0.0, 1.0, 2.5, 7.0, 11.0]


def swinging(cycles: int) -> pl.Strut:
    """A strut that yields back and forth and turns its tip past a quarter turn in every cycle."""
    couple = pl.programs.cycles(-8.0, 8.0, 2.0, cycles)
    return pl.Strut(pair("A", 2.0), pl.Load(thrust=1.0, couple=couple), pl.Grid(nodes=6))


def solved(cycles: int, **more: object) -> pl.Solution:
    return pl.solve(swinging(cycles), 0.3, until=2.0 * cycles, rtol=1e-6, times=TIMES, **more)  # type: ignore[arg-type]


def check_nothing_changes(patch: pytest.MonkeyPatch) -> None:
    """Dataset, events, verdict, bounds and counts are those of the run that is kept whole, to the last bit."""
    whole = solved(8)
    patch.setattr(retention, "WHOLE", 20_000)
    thin = solved(8)
    assert thin.history.steps < 0.75 * whole.history.steps
    assert thin.dataset.drop_attrs().identical(whole.dataset.drop_attrs())
    assert thin.events == whole.events
    assert {event.kind for event in thin.events} >= {"onset", "arrest", "quarter_turn"}
    assert thin.outcome == whole.outcome
    assert thin.limit == whole.limit
    assert (thin.counts, thin.status) == (whole.counts, whole.status)
    n = whole.grid.size
    for sol in (thin, whole):
        assert np.array_equal(sol.history.y[[0, -1]], whole.history.y[[0, -1]])
    for size in (lambda y: np.abs(y[:, :n]).max(), lambda y: np.abs(y[:, n]).max()):
        assert size(thin.history.y) == size(whole.history.y)
    assert thin.notes != whole.notes


def test_nothing_of_the_result_changes(monkeypatch: pytest.MonkeyPatch) -> None:
    check_nothing_changes(monkeypatch)


def steps_kept(until: float) -> tuple[int, int]:
    """Steps kept, and taken, of a rod that swings on and on without an event."""
    rod = pl.Rod(pair("A"), pl.Load(), pl.Grid(nodes=6), translational_inertia=1.0, damping=0.0)
    sol = pl.solve(rod, 0.01, until=until, rtol=1e-5, times=[0.0, 3.0, 6.0])
    return sol.history.steps, sol.counts.steps


def check_growth(patch: pytest.MonkeyPatch) -> None:
    """Four times the steps take no more memory, but for what each leg, of a fixed number of steps, keeps."""
    patch.setattr(retention, "WHOLE", 5_000)
    patch.setattr("plastica.motion.solve.LEG_STEPS", 100)
    kept, taken = steps_kept(8.0)
    more, most = steps_kept(32.0)
    assert most > 3.5 * taken
    assert more - kept <= 6 * (1 + most // 100)
    assert more < 0.1 * most


def test_memory_does_not_grow_with_steps(monkeypatch: pytest.MonkeyPatch) -> None:
    check_growth(monkeypatch)


def test_what_is_not_kept_is_refused_and_not_invented(monkeypatch: pytest.MonkeyPatch) -> None:
    whole = solved(8)
    monkeypatch.setattr(retention, "WHOLE", 0)
    thin = solved(8)
    ends, begins = thin.history.gaps
    assert ends.size > 3
    assert np.all(begins > ends)
    middle = float(0.5 * (ends[0] + begins[0]))
    with pytest.raises(ArgumentError, match="of so long a run no others are kept"):
        thin.at(0.5, middle)
    for t in (*TIMES, *ends):
        assert np.array_equal(thin.at([0.0, 0.3, 1.0], float(t)), whole.at([0.0, 0.3, 1.0], float(t)))
    assert set(thin.history.snapped([middle])) <= {ends[0], begins[0]}
    assert np.array_equal(thin.history.snapped(TIMES), TIMES)


def test_it_is_saved_read_and_drawn(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(retention, "WHOLE", 0)
    thin = solved(6)
    back = pl.read(thin.save(tmp_path / "run.nc"))
    assert back == thin
    assert back.dataset.identical(thin.dataset)
    assert pl.report(back, tmp_path / "run.html", film_seconds=0).is_file()


@pytest.mark.parametrize("keep", [0, 7, 10**6])
def test_taken_up_it_is_the_same(keep: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(retention, "WHOLE", 20_000)
    options = {"checkpoint": tmp_path / "c", "checkpoint_every": 0.0}
    thin = solved(6, **options)
    segments = sorted((tmp_path / "c").glob(checkpoint.PATTERN))
    for path in segments[keep:]:
        path.unlink()
    again = solved(6, **options, resume=True)
    assert again == thin
    assert again.counts == thin.counts
    assert again.dataset.identical(thin.dataset)


def test_without_times_all_is_kept(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(retention, "WHOLE", 0)
    sol = pl.solve(swinging(3), 0.3, until=6.0, rtol=1e-6)
    assert sol.history.steps == sol.counts.steps
    assert sol.history.gaps[0].size == 0


def check_on_disk(folder: Path, patch: pytest.MonkeyPatch) -> None:
    """Without times the states of a large run go into a file, and all is the same; also where it is taken up."""
    options = {"until": 12.0, "rtol": 1e-6, "checkpoint": folder, "checkpoint_every": 0.0}
    whole = pl.solve(swinging(6), 0.3, **options)  # type: ignore[arg-type]
    patch.setattr(retention, "WHOLE", 20_000)
    for gone in (0, 5, None):
        for path in sorted(folder.glob(checkpoint.PATTERN))[gone:]:
            path.unlink()
        spilled = pl.solve(swinging(6), 0.3, **options, resume=gone != 0)  # type: ignore[arg-type]
        assert isinstance(spilled.history.y, np.memmap)
        assert spilled == whole
        assert spilled.dataset.identical(whole.dataset)
        assert spilled.events == whole.events
        assert spilled.outcome == whole.outcome
        assert all(path.name.startswith("legs-") for path in folder.iterdir())
    assert pl.read(spilled.save(folder / "run.nc")) == whole


def test_without_times_large_states_go_to_the_disk(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    check_on_disk(tmp_path / "c", monkeypatch)
    checkpoint.Checkpoint(tmp_path / "c", "").clear(keep_folder=True)
    assert [path.name for path in (tmp_path / "c").iterdir()] == ["run.nc"]


def test_a_full_disk_is_told_when_states_go_there(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(retention, "WHOLE", 20_000)
    monkeypatch.setattr("tempfile.TemporaryFile", lambda **_: io.FileIO("/dev/full", "w"))
    with pytest.raises(StorageError, match="No space left"):
        pl.solve(swinging(6), 0.3, until=12.0, rtol=1e-6, checkpoint=tmp_path / "c")
    assert list((tmp_path / "c").glob(checkpoint.PATTERN))


def check_states_are_let_go(folder: Path, patch: pytest.MonkeyPatch) -> None:
    """Of legs that are kept on the disk, or in part, the states do not stay in memory."""
    patch.setattr(retention, "WHOLE", 0)
    strut = pl.Strut(pair("A"), pl.Load(thrust=1.0), pl.Grid(nodes=6))
    for times in (None, np.array([0.5, 1.5])):
        with closing(retention.Retention(strut, times, folder)) as kept:
            states = []
            for start in range(5):
                t = np.linspace(start, start + 1.0, 20)
                y = np.sin(t[:, None] + np.arange(strut.layout.size))
                kept.add(Leg(History(t, y, np.array([0, 10, 20])), "full", (True,), (True,), "", 0, 0))
                states.append(weakref.ref(y))
                del y
            assert [state() is None for state in states] == 5 * [True]
            assert kept.history().end == 5.0
            assert kept.steps == 10


def test_states_are_let_go(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    check_states_are_let_go(tmp_path, monkeypatch)


def test_what_waits_for_the_checkpoint_is_bounded(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(checkpoint, "MOST_WAITING", 20_000)
    solved(6, checkpoint=tmp_path / "c", checkpoint_every=1e9)
    assert len(list((tmp_path / "c").glob(checkpoint.PATTERN))) > 3
