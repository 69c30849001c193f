"""Claim 8: the mirror image of a motion is the motion of the mirror image, bitwise where the laws are."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import plastica as pl
from tests.support import SHAPES, pair, shapes

LOADS = [
    pl.Load(thrust=3.0),
    pl.Load(thrust=2.0, transverse=0.4, couple=-0.2, weight=1.0),
    pl.Load(thrust=([0.0, 1.0, 1.0, 5.0], [0.0, 4.0, 2.0, 0.0]), transverse="sin(t)"),
]


def check_mirror(strut: pl.Strut, shape: str, natural: float, **options: object) -> None:
    """Both motions, step for step and bit for bit."""
    mirrored = strut.with_load(strut.load.mirrored())
    one = pl.solve(strut, shape, natural, **options)
    other = pl.solve(mirrored, f"-({shape})", -natural, **options)
    n = one.grid.size
    assert np.array_equal(one.history.t, other.history.t)
    assert np.array_equal(one.history.y[:, : n + 1], -other.history.y[:, : n + 1])
    assert np.array_equal(one.history.y[:, n + 1 :], other.history.y[:, n + 1 :])
    assert [(e.t, e.kind, e.direction) for e in one.events] == [(e.t, e.kind, -e.direction) for e in other.events]


@pytest.mark.parametrize("method", ["LSODA", "DOP853", "Radau", "BDF", "Gauss"])
@pytest.mark.parametrize("name", ["A", "B"])
def test_every_method(name: str, method: str) -> None:
    strut = pl.Strut(pair(name), LOADS[0], pl.Grid(nodes=12))
    check_mirror(strut, SHAPES["step"], 0.3, until=5.0, method=method)


@pytest.mark.parametrize("load", LOADS, ids=["thrust", "all", "varying"])
def test_every_load(load: pl.Load) -> None:
    check_mirror(pl.Strut(pair("A", 5.0), load), SHAPES["smooth"], 0.2, until=8.0)


@given(shapes(), st.floats(-1.0, 1.0), st.floats(0.0, 8.0))
@settings(deadline=None, max_examples=20, derandomize=True)
def test_any_start(shape: str, natural: float, gamma: float) -> None:
    check_mirror(pl.Strut(pair("B", 10.0), pl.Load(thrust=gamma), pl.Grid(nodes=8)), shape, natural, until=3.0)


def test_a_straight_rod_stays_straight() -> None:
    sol = pl.solve(pl.Strut(pair("A"), pl.Load(thrust=30.0)), 0.0, 0.0, until=100.0)
    assert np.all(sol.history.y[:, : sol.grid.size + 1] == 0.0)
    assert sol.outcome.headline == "Stays straight"
