"""Claim: the rod tends to the strut like its inertia, and a rod without inertia is the strut."""

from __future__ import annotations

import numpy as np
import pytest

import plastica as pl
from plastica.errors import ArgumentError
from tests.rods import LOADS, NEVER, last, model, order

EPS_VALUES = np.array([1e-2, 1e-3, 1e-4])
START = "0.2*cos(2*s)"
SHARES = {"both": (1.0, 1.0), "translational": (1.0, 0.0), "rotary": (0.0, 1.0)}
LOAD = pl.Load(thrust=([0.0, 2.0], [0.0, 3.0]), transverse=0.3)
AFTER = 2.0
"""Long after the initial layer, whose length is of the order of the inertia; the rod yields and moves on by then."""


def distances(shares: tuple[float, float], segments: int, curvature_rate: float = 0.0) -> np.ndarray:
    """Distance of natural curvature and of curvature from those of the strut, for each eps; shape (3, 2)."""
    strut = pl.solve(model(LOAD, segments=segments), START, until=AFTER, rtol=1e-12)
    mu, mu_nat, _ = last(strut)
    assert np.ptp(strut.model.layout.natural(strut.history.y), axis=0).max() > 0.01
    found = []
    for eps in EPS_VALUES:
        inertia = {"translational_inertia": eps * shares[0], "rotary_inertia": eps * shares[1], "damping": 1.0}
        made = model(LOAD, segments=segments, inertia=inertia)
        sol = pl.solve(made, START, until=AFTER, rtol=1e-9, curvature_rate=curvature_rate)
        assert sol.status.ok
        moved, natural, _ = last(sol)
        found.append((np.abs(natural - mu_nat).max(), np.abs(moved - mu).max()))
    return np.array(found)


def check_limit(shares: tuple[float, float] = (1.0, 1.0), segments: int = 1, curvature_rate: float = 0.0) -> None:
    """Proportional to eps: the order is 1 within a tenth, and the factor is what it was measured to be."""
    errors = distances(shares, segments, curvature_rate)
    for column, ceiling in zip(errors.T, (0.2, 0.4), strict=True):
        assert 0.9 <= order(EPS_VALUES, column) <= 1.1
        assert np.all(column <= ceiling * EPS_VALUES)


@pytest.mark.parametrize("segments", [1, 2])
@pytest.mark.parametrize("which", SHARES)
def test_limit(which: str, segments: int) -> None:
    check_limit(SHARES[which], segments)


def test_limit_from_a_start_in_motion() -> None:
    """What a kick of momentum eps leaves behind is of the order of eps, too."""
    check_limit(curvature_rate=1.0)


def check_no_inertia(segments: int) -> None:
    """With both inertias 0 the rod is the strut, step for step and bit for bit."""
    none = {"translational_inertia": 0.0, "rotary_inertia": 0.0, "damping": 1.0}
    for load in LOADS.values():
        strut, rod = (
            pl.solve(model(load, segments=segments, inertia=inertia), START, 0.1, until=1.5)
            for inertia in (None, none)
        )
        assert rod.history.y.shape == strut.history.y.shape
        assert np.array_equal(rod.history.t, strut.history.t)
        assert np.array_equal(rod.history.y, strut.history.y)


@pytest.mark.parametrize("segments", [1, 3])
def test_no_inertia(segments: int) -> None:
    check_no_inertia(segments)


def check_damping() -> None:
    """Without inertia and yielding, twice the damping is twice the time."""
    quiet = pl.Material("m**2/2", "pos(x)**2", "1000")
    ends = []
    for damping in (1.0, 2.0):
        inertia = {"translational_inertia": 0.0, "rotary_inertia": 0.0, "damping": damping}
        made = model(pl.Load(thrust=2.0, transverse=0.3), material=quiet, inertia=inertia)
        ends.append(last(pl.solve(made, START, until=1.5 * damping, rtol=1e-11))[0])
    assert np.abs(ends[1] - ends[0]).max() <= 1e-9


def test_damping() -> None:
    check_damping()


NO_INERTIA = {"translational_inertia": 0.0, "rotary_inertia": 0.0, "damping": 1.0}


def numbers_of(limit: pl.Limit) -> tuple[object, ...]:
    end = limit.equilibrium
    return (
        limit.kind,
        limit.stable,
        limit.sentence,
        (limit.distance, limit.rate, limit.exponent, limit.coefficient, limit.excess),
        None if end is None else (end.alpha, end.gamma, end.mu_nat),
    )


def check_limit_told(material: pl.Material | None, kind: str) -> None:
    """Without inertia the limit is told as of the strut: after a run, of a state, and of a start."""
    told = []
    for inertia in (None, NO_INERTIA):
        made = model(pl.Load(thrust=3.0), material=material, nodes=16, inertia=inertia)
        sol = pl.solve(made, START, 0.1, until=100.0)
        assert sol.limit is not None
        mu, mu_nat, _ = last(sol)
        told.append([sol.limit, pl.predict_limit(made, mu, float(mu_nat)), pl.omega_limit(made, START, 0.1)])
    assert told[0][0].kind == kind
    for strut, rod in zip(*told, strict=True):
        assert numbers_of(rod) == numbers_of(strut)


@pytest.mark.parametrize(("material", "kind"), [(None, "limiting"), (NEVER, "interior")])
def test_the_limit_is_told_without_inertia(material: pl.Material | None, kind: str) -> None:
    check_limit_told(material, kind)


def test_one_step_and_all_starts_are_those_of_the_strut() -> None:
    """The time-one map and basins, too."""
    strut, rod = (model(pl.Load(thrust=3.0), nodes=8, inertia=inertia) for inertia in (None, NO_INERTIA))
    state = 0.2 * np.cos(2.0 * strut.grid.s)
    one, other = (pl.time_one_map(made, state, 0.1) for made in (strut, rod))
    assert np.array_equal(one[0], other[0])
    assert one[1] == other[1]
    assert np.array_equal(pl.basin(strut, amplitude=0.4).alpha, pl.basin(rod, amplitude=0.4).alpha)


def check_no_limit_told() -> None:
    """With inertia, in another unit of time, or with several segments no limit is told, and asking for it says why."""
    for changed, segments, why in (
        ({"translational_inertia": 1e-3}, 1, "a Rod with inertia"),
        ({"rotary_inertia": 1e-3}, 1, "a Rod with inertia"),
        ({"damping": 2.0}, 1, "a Rod with a damping of 2"),
        ({}, 2, "a Rod of 2 segments"),
    ):
        made = model(pl.Load(thrust=3.0), segments=segments, inertia={**NO_INERTIA, **changed})
        assert pl.solve(made, START, until=1.0).limit is None, why
        with pytest.raises(ArgumentError, match=why):
            pl.predict_limit(made, np.zeros(made.grid.size), 0.0)
        with pytest.raises(ArgumentError, match=why):
            pl.omega_limit(made)


def test_no_limit_is_told_of_what_is_no_strut() -> None:
    check_no_limit_told()


def check_no_limit_of_other_loads() -> None:
    for load in (pl.Load(thrust="2 + sin(t)"), pl.Load(thrust=1.0, transverse=0.1)):
        assert pl.solve(model(load, inertia=NO_INERTIA), START, until=1.0).limit is None


def test_no_limit_is_told_under_other_loads() -> None:
    check_no_limit_of_other_loads()
