"""Claim: a shape or a motion that its grid does not resolve says so, and by about how much the free end is off."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import plastica as pl
from plastica.equilibria import statics
from plastica.motion import solve as runs
from plastica.physics import resolution, status
from tests.support import pair

TURN = 2.0 * np.pi
HEAVY = pl.Load(weight=3e4, weight_angle="90 deg")
HEAVY_TIP = 0.00820410375011, 0.99660730260652
"""Where the heavy cantilever's free end is: the same to 13 digits on 128, 192 and 256 nodes."""

LOADS = {
    "thrust": (pl.Load(thrust=8.0), "1 + cos(3*s)", 8),
    "large thrust": (pl.Load(thrust=30.0), "0.3 + s", 12),
    "weight": (pl.Load(weight=30.0, weight_angle="90 deg"), 0.0, 8),
    "heavy": (pl.Load(weight=1000.0, weight_angle="90 deg"), 0.0, 12),
    "couple": (pl.Load(couple=20.0), 0.0, 12),
    "thrust and couple": (pl.Load(thrust=12.0, couple=10.0), 0.0, 16),
}


def model(load: pl.Load, nodes: Any = 16) -> pl.Strut:
    return pl.Strut(pair("A"), load, pl.Grid(nodes) if nodes != 16 else pl.Grid())


def off(x: tuple[float, ...], y: tuple[float, ...]) -> float:
    return float(np.hypot(x[0] - y[0], x[1] - y[1]))


def end(sol: pl.Solution, t: Any) -> Any:
    theta = sol.model.angle(sol.model.layout.mu(sol.history(t)))
    return np.cos(theta) @ sol.grid.w, np.sin(theta) @ sol.grid.w


def check_circles() -> None:
    """A couple of whole turns closes the rod: a grid that cannot tell says so, and chosen nodes can."""
    for turns in (10, 50, 1000):
        coarse = pl.rest(model(pl.Load(couple=turns * TURN)))
        assert (coarse.status.ok, coarse.status.code) == (False, "not_resolved"), turns
        assert "do not resolve" in coarse.sentence
        assert not coarse.admissible
        assert coarse.error > 0.1 * np.hypot(*coarse.tip)
    for turns in (10, 50):
        shape = pl.rest(model(pl.Load(couple=turns * TURN), "auto"))
        assert shape.status == pl.Status(True, "equilibrium", shape.sentence)
        assert np.hypot(*shape.tip) <= 1e-11
    assert not pl.rest(model(pl.Load(couple=1000 * TURN), "auto")).status.ok


def test_circles() -> None:
    check_circles()


def check_heavy_cantilever() -> None:
    """A heavy rod hangs straight down; it does not stay coiled because nodes are missed."""
    assert off(pl.rest(model(HEAVY, "auto")).tip, HEAVY_TIP) <= 1e-11
    for nodes in (8, 16, 32, 64):
        shape = pl.rest(model(HEAVY, nodes))
        assert shape.error >= off(shape.tip, HEAVY_TIP) / 3.0
        assert shape.status.ok is (shape.error <= 1e-3)


def test_heavy_cantilever() -> None:
    check_heavy_cantilever()


def check_shapes_tell_their_error() -> None:
    """The error of a static shape is the change on a grid much finer; it is spoken of from 1e-8 on."""
    said = set()
    for load, start, nodes in LOADS.values():
        exact = pl.rest(model(load, 96), start)
        assert exact.status.ok
        for shape in (pl.rest(model(load, nodes), start), pl.rest(model(load, 2 * nodes), start)):
            error = off(shape.tip, exact.tip)
            assert error / 1.5 <= shape.error + 1e-13
            assert shape.error <= 1.5 * error + 1e-13
            known = "is known to" in shape.sentence
            assert known is (1e-8 < error <= 1e-3)
            said.add(known)
    assert len(said) == 2
    assert "known" not in pl.rest(model(pl.Load(thrust=3.0)), 1.0).sentence


def test_shapes_tell_their_error() -> None:
    check_shapes_tell_their_error()


def check_motions_tell_their_error(name: str) -> None:
    """The error estimated of a motion is that against a finer grid, within a factor of 4, at the worst time."""
    load, start, nodes = LOADS[name]
    motion, exact = (pl.solve(model(load, n), start, until=5.0, rtol=1e-9) for n in (nodes, 64))
    assert exact.status.code == "done"
    assert exact.notes == ()
    t = motion.history.t[motion.history.accepted]
    error = float(np.hypot(*np.subtract(end(motion, t), end(exact, t))).max())
    accepted = motion.history.y[motion.history.accepted]
    estimate = resolution.largest_end_error(motion.model, t, motion.model.layout.mu(accepted))
    assert error / 4.0 <= estimate <= 4.0 * max(error, 1e-9) or name == "heavy"
    # A rod still whipping around is weighed by its worst state, of which the loads hold less back later on.
    assert error / 4.0 <= estimate <= 20.0 * error
    assert (motion.status.code == "not_resolved") is (estimate > 1e-3)
    assert len(motion.notes) == int(estimate > 1e-9)
    assert ("is known to" in motion.status.sentence) is (1e-9 < estimate <= 1e-3)


@pytest.mark.parametrize("name", LOADS)
def test_motions_tell_their_error(name: str) -> None:
    check_motions_tell_their_error(name)


def check_turns_between_nodes() -> None:
    """A motion that turns often between nodes is not resolved, whatever its samples look like, and tells no limit."""
    wound = pl.solve(model(pl.Load(couple=1e4), 64), until=1.0)
    assert (wound.status.ok, wound.status.code) == (False, "not_resolved")
    assert "do not resolve the shape: the free end may be off by any amount" in str(wound)
    coiled = pl.solve(model(pl.Load(thrust=1.0), 8), "300", until=0.1)
    assert coiled.status.code == "not_resolved"
    assert coiled.limit is None
    chosen = pl.solve(model(pl.Load(couple=20.0), "auto"), until=2.0, rtol=1e-6)
    assert chosen.status.code == "done"
    assert chosen.grid.per_element >= 24


def test_turns_between_nodes() -> None:
    check_turns_between_nodes()


def check_many() -> None:
    """Many members are told what each is told alone."""
    starts = ["0.3*s", "3 + 60*s", "1 + cos(3*s)", "200"]
    thrusts = np.array([3.0, 1.0, 300.0, 2.0])
    found = pl.solve_many(model(pl.Load(), 8), starts, thrust=thrusts, until=2.0)
    codes = [
        pl.solve(model(pl.Load(thrust=thrust), 8), start, until=2.0).status.code
        for start, thrust in zip(starts, thrusts, strict=True)
    ]
    assert found["status"].values.tolist() == codes
    assert set(codes) == {"done", "not_resolved"}


def test_many() -> None:
    check_many()


def test_modes_of_a_shape_that_is_not_resolved() -> None:
    wound = model(pl.Load(couple=10.0 * TURN, thrust=1.0))
    assert not pl.modes(wound, pl.rest(wound), count=2).resolved


def test_refined_grids() -> None:
    """A grid twice as fine has twice the nodes, or halves of the elements, which then hold the same polynomials."""
    for grid in (pl.Grid(8), pl.Grid(200, (0.0, 0.3, 1.0)), pl.Grid(3, tuple(np.linspace(0.0, 1.0, 301)))):
        fine = grid.refined()
        assert fine.size == 2 * grid.size
        assert set(grid.breaks) <= set(fine.breaks)
        values = np.cos(3.0 * grid.s)
        carried = grid.interpolation(fine.s) @ values
        assert abs(fine.w @ carried - grid.w @ values) <= 1e-13
    assert pl.Grid(256, tuple(np.linspace(0.0, 1.0, 9))).refined().size == 2048


Patch = pytest.MonkeyPatch

def only_downhill(*state: Any) -> Any:
    return *statics.downhill(*state), True


DEFECTS: dict[str, tuple[Callable[[], None], Any, str, Any]] = {
    "turns are not looked at": (check_turns_between_nodes, resolution, "HALF_TURN", np.inf),
    "any shape is resolved": (check_circles, status, "LOST", np.inf),
    "the motion is not followed": (check_heavy_cantilever, "rest", "follow", only_downhill),
    "fixed grids are not judged": (check_turns_between_nodes, runs, "on_given_nodes", lambda solution, *_: solution),
    "the moment has no error": (
        lambda: check_motions_tell_their_error("weight"),
        resolution._Finer,
        "_moved",
        lambda finer, theta, bending: np.zeros(theta.shape[0]),
    ),
    "all is known": (check_shapes_tell_their_error, "rest", "ALLOWED", 1.0),
    "many are not judged": (check_many, "parts", "_tell_unresolved", lambda given, settings, ends: None),
}


@pytest.mark.parametrize("defect", DEFECTS)
def test_defects_are_caught(defect: str, monkeypatch: Patch) -> None:
    from plastica.equilibria import rest
    from plastica.motion import parts

    check, place, name, value = DEFECTS[defect]
    monkeypatch.setattr({"rest": rest, "parts": parts}[place] if isinstance(place, str) else place, name, value)
    with pytest.raises(AssertionError):
        check()
