"""What a load does is the same whenever it comes: the run counts time from the start of each leg."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.integrate import BDF

import plastica as pl
from plastica.motion.instant import Instant
from plastica.motion.integrate import METHODS

EPS = float(np.finfo(float).eps)
MATERIAL = pl.Material("m**2/2", "c*pos(x)**2", "h", {"c": 1.0, "h": 0.1})

TIMES = (0.0, 1e-5, 2e-5, 0.5, 0.5, 1.0)
VALUES = (0.0, 6e4, 0.0, 0.0, 1.5, 1.5)
"""A pulse that is over within 2e-5 and is yielded to, and half a unit later a jump."""


def run(t0: float, method: str) -> tuple[pl.Solution, pl.Solution]:
    """The run with the load from t0 on, and the run whose knots are the doubles t_k - t0."""
    late = t0 + np.array(TIMES)
    sols = []
    for times in (np.append(0.0, late) if t0 else late, late - t0):
        load = pl.Load(couple=pl.programs.table(times, (0.0, *VALUES) if times.size > len(VALUES) else VALUES))
        made = pl.Strut(MATERIAL, load, pl.Grid(nodes=4))
        sols.append(pl.solve(made, until=float(times[-1]), method=method, rtol=1e-6))
    return sols[0], sols[1]


def check_late(t0: float, method: str) -> None:
    """The last states agree to 1e-12, and so do the numbers of switches; both runs end as asked."""
    late, early = run(t0, method)
    assert late.status.ok, late.status
    assert early.status.ok, early.status
    size = np.abs(early.history.y[-1])
    assert np.abs(late.history.y[-1] - early.history.y[-1]).max() <= 1e-12 * size.max()
    assert size[early.model.layout.natural_columns].min() > 1e-3
    kinds = [[event.kind for event in sol.events if event.kind in ("onset", "arrest")] for sol in (late, early)]
    assert kinds[0] == kinds[1]
    assert kinds[0]


@pytest.mark.parametrize("t0", [0.25, 100.0, 1e9])
@pytest.mark.parametrize("method", METHODS)
def test_late_strut(method: str, t0: float) -> None:
    check_late(t0, method)


def test_a_jump_on_a_light_rod() -> None:
    """Inertia 1e-4: the first step after the jump is far below what a clock of 100 leaves room for with a margin."""
    load = pl.Load(transverse=([0.0, 100.0, 100.0, 101.0], [0.0, 0.0, 0.3, 0.3]))
    rod = pl.Rod(MATERIAL, load, pl.Grid(nodes=8), translational_inertia=1e-4)
    assert pl.solve(rod, until=100.2, method="BDF", rtol=1e-6).status.code == "done"


def check_piece(program: pl.programs.Program, a: float, b: float) -> None:
    """On [a, b] the program of the time since a is the program of the time itself."""
    piece = program.since(a, b)
    assert callable(piece)
    places = a + (b - a) * np.linspace(0.1, 0.9, 9)
    found = [piece(float(t - a)) for t in places]
    assert np.abs(np.array(found) - program(places)).max() <= 1e-9


def test_pieces() -> None:
    for program in (
        pl.programs.cycles(0.0, 1.0, 4.0, start=1.0),
        pl.programs.cycles(0.0, 1.0, 4.0, start=1.0, shape="sine"),
        pl.programs.table([0.0, 5.0, 9.0], [0.0, 2.0, -1.0]),
        pl.programs.expression("sin(t)"),
    ):
        check_piece(program, 5.0, 7.0)


def test_instants() -> None:
    start = Instant(1e9)
    for duration in (1e-9, 1e-3, 0.3):
        assert start.later(duration).since(1e9) == duration
    there = start.later(0.3).later(1e-9)
    assert there.until(1e9 + 1.0) == pytest.approx(0.7 - 1e-9, rel=4.0 * EPS)


def check_between(tmp_path: Path) -> None:
    """Steps shorter than the clock can tell are kept apart, saved, and read back equal; the accepted states are hit."""
    late, early = run(1e9, "LSODA")
    history = late.history
    lengths = np.diff(history.t[history.accepted]) + np.diff(history.rest[history.accepted])
    assert np.all(lengths > 0.0)
    assert lengths.min() < np.spacing(1e9)
    at = 1e9 + 0.75
    assert np.abs(history([at]) - early.history([0.75])).max() <= 1e-12
    assert np.array_equal(history([history.end])[0], history.y[-1])
    assert pl.read(late.save(tmp_path / "late.nc")) == late


def test_between(tmp_path: Path) -> None:
    check_between(tmp_path)


def test_resumed(tmp_path: Path) -> None:
    """A run of which some legs are on disk goes on in the middle of a stretch, and ends the same to the last bit."""
    couple = pl.programs.table([0.0, 1e9, 1e9, 1e9 + 1.0], [0.0, 0.0, 1.5, 1.5])
    strut = pl.Strut(MATERIAL, pl.Load(couple=couple), pl.Grid(nodes=4))
    whole = pl.solve(strut, until=1e9 + 5.0)

    folder = tmp_path / "kept"
    pl.solve(strut, until=1e9 + 5.0, checkpoint=folder, checkpoint_every=0.0)
    segments = sorted(folder.glob("legs-*.npz"))
    for path in segments[2:]:
        path.unlink()
    assert pl.solve(strut, until=1e9 + 5.0, checkpoint=folder, resume=True) == whole


def check_replaced(monkeypatch: pytest.MonkeyPatch) -> None:
    """Where the default gives up another method goes on from there, and this is told; one chosen by name is kept."""
    sound = BDF.step

    def tired(self: Any) -> Any:
        if self.t > 0.5:
            self.status = "failed"
            return "it is tired"
        return sound(self)

    rod = pl.Rod(MATERIAL, pl.Load(transverse=0.3), pl.Grid(nodes=4), translational_inertia=1e-2)
    right = pl.solve(rod, until=2.0, rtol=1e-6)
    monkeypatch.setattr(BDF, "step", tired)
    sol = pl.solve(rod, until=2.0, rtol=1e-6)
    assert sol.status.ok
    assert sol.method == "Gauss"
    said = "BDF gave up at t = "
    assert said in sol.status.sentence
    assert "it is tired" in sol.status.sentence
    assert any(said in note and "Gauss went on" in note for note in sol.notes)
    assert np.abs(sol.history.y[-1] - right.history.y[-1]).max() <= 100.0 * sol.rtol
    assert abs(sol.ledger.residual) <= 100.0 * sol.rtol * sol.ledger.largest_energy
    named = pl.solve(rod, until=2.0, rtol=1e-6, method="BDF")
    assert named.status.code == "solver_failed"
    assert named.method == "BDF"


def test_replaced(monkeypatch: pytest.MonkeyPatch) -> None:
    check_replaced(monkeypatch)
