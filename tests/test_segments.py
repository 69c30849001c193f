"""Claim: natural curvature in segments obeys the law of the paper on each of them, and tends to the pointwise law."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import plastica as pl
from plastica.errors import ArgumentError
from plastica.physics import kernel as kernels
from tests.rods import INERTIA, KINDS, LOADS, NEVER, last, model, order, state_of, tip
from tests.support import EPS, pair


@pytest.mark.parametrize("whole", [1, np.int64(1), (0, 1), [0.0, 1.0], np.array([0.0, 1.0])], ids=repr)
def test_one_segment_is_the_rod_of_the_paper(whole: Any) -> None:
    """However it is said, one segment gives the same motion to the bit, and numbers without an axis."""
    load, grid = LOADS["jumps"], pl.Grid(8)
    plain = pl.solve(pl.Strut(pair("A"), load, grid), "cos(2*s)", 0.1, until=2.0)
    one = pl.solve(pl.Strut(pair("A"), load, grid, natural_segments=whole), "cos(2*s)", 0.1, until=2.0)
    assert np.array_equal(plain.history.y, one.history.y)
    assert one.dataset.natural_curvature.dims == ("t",)
    assert one.model.segments == 1


def check_general_rate() -> None:
    """The kernel of several segments, given one, is the kernel of one."""
    for load in LOADS.values():
        made = model(load)
        moment, _ = kernels.load_moment(made, 0.7, 1.0)
        y = made.layout.pack(*state_of(made))
        one, general = (each(made, moment)(0.8, y) for each in (kernels._uniform_rate, kernels._rate))
        assert np.abs(one - general).max() <= 16.0 * EPS * np.abs(one).max()


def test_general_rate() -> None:
    check_general_rate()


def check_uniform(segments: Any) -> None:
    """Under an end couple a straight strut stays uniform, and its segments do what the whole would."""
    load = pl.Load(couple="1.5*sin(t)")
    whole = pl.solve(model(load), 0.0, 0.0, until=6.0, rtol=1e-9, times=[1.0, 3.0, 6.0])
    parts = pl.solve(model(load, segments=segments), 0.0, 0.0, until=6.0, rtol=1e-9, times=[1.0, 3.0, 6.0])
    natural = whole.dataset.natural_curvature.to_numpy()
    assert np.abs(natural[1:]).min() > 0.05
    assert np.abs(parts.dataset.natural_curvature.to_numpy() - natural[:, None]).max() <= 20.0 * whole.rtol
    assert abs(parts.ledger.natural_dissipation - whole.ledger.natural_dissipation) <= 20.0 * whole.rtol


@pytest.mark.parametrize("segments", [2, 5, (0.0, 0.1, 0.45, 1.0)], ids=str)
def test_uniform(segments: Any) -> None:
    check_uniform(segments)


COUNTS = (4, 8, 16, 32)
GAMMA, SHAPE, LATE = 2.0, "1.5 + 0.5*cos(2*s)", 3.0


@cache
def bent(segments: int) -> tuple[np.ndarray, np.ndarray]:
    """Tip, and natural curvature at 4 points of each of 64 cells, of a strut all of which yields under a thrust."""
    nodes = 6 if segments < 16 else 3
    made = model(pl.Load(thrust=GAMMA), nodes=nodes, segments=segments, material=pair("A"))
    mu, mu_nat, _ = last(pl.solve(made, SHAPE, 0.0, until=LATE, rtol=1e-10))
    places = (np.arange(256) + 0.5) / 256
    return tip(made, mu), np.asarray(mu_nat)[(places * segments).astype(int)]


@cache
def pointwise() -> tuple[np.ndarray, np.ndarray]:
    """The same by the pointwise law mu_nat_t = f(D - Theta) - f(-Theta - D), D = mu - mu_nat - mu_nat, written anew."""
    grid = pl.Grid(24, tuple(np.linspace(0.0, 1.0, 9)))

    def rate(t: float, y: np.ndarray) -> np.ndarray:
        mu, natural = y.reshape(2, -1)
        drive = mu - 2.0 * natural
        flow = np.maximum(drive - 0.1, 0.0) ** 2 - np.maximum(-0.1 - drive, 0.0) ** 2
        return np.concatenate([natural - mu + GAMMA * (grid.B @ np.sin(grid.A @ mu)), flow])

    start = np.concatenate([1.5 + 0.5 * np.cos(2.0 * grid.s), np.zeros(grid.size)])
    end = solve_ivp(rate, (0.0, LATE), start, method="DOP853", rtol=1e-10, atol=1e-12).y[:, -1]
    mu, natural = end.reshape(2, -1)
    theta = grid.A @ mu
    places = (np.arange(256) + 0.5) / 256
    return np.array([np.cos(theta) @ grid.w, np.sin(theta) @ grid.w]), grid.interpolation(places) @ natural


def check_convergence() -> None:
    """To the pointwise law: order 2 for the tip, order 1 in the mean square for the natural curvature itself.

    A piecewise constant is off by O(1/m) wherever the law it stands for is not constant. Its error has no mean on a
    segment, so that what integrates it, such as angle and place, sees only the square.
    """
    place, natural = pointwise()
    sizes = 1.0 / np.array(COUNTS)
    found = [bent(m) for m in COUNTS]
    tips = np.array([np.abs(each[0] - place).max() for each in found])
    squares = np.array([np.sqrt(np.mean((each[1] - natural) ** 2)) for each in found])
    assert 1.9 <= order(sizes, tips) <= 2.1
    assert 0.95 <= order(sizes, squares) <= 1.05
    assert tips[-1] <= 1e-4
    assert squares[-1] <= 1e-2


def test_convergence() -> None:
    check_convergence()


def partly() -> pl.Solution:
    """Under an end force the couple, and with it the drive, is largest at the clamp: the tip's segment never yields."""
    load = pl.Load(transverse=([0.0, 1.0, 3.0, 4.0], [0.0, 0.5, 0.5, 0.0]))
    return pl.solve(model(load, segments=4), 0.0, [0.0, 0.01, 0.02, 0.03], until=6.0)


def check_frozen(sol: pl.Solution) -> None:
    """A segment keeps the bits of its natural curvature while its drive is within its threshold, whatever others do."""
    layout, history = sol.model.layout, sol.history
    natural = layout.natural(history.y)
    starts, moving = sol.legs
    assert moving.shape == (starts.size + 1, sol.model.segments)
    for start, end, moves in zip(starts, [*starts[1:], history.end], moving[:-1], strict=True):
        inside = (history.t >= start) & (history.t <= end)
        assert np.all(np.ptp(natural[inside], axis=0)[~moves] == 0.0)
    drive, threshold = sol.model.drive(layout.mu(history.y), natural), sol.model.threshold(natural)
    _, rate = sol.model.rate(history.t, layout.mu(history.y), natural)
    assert np.all(drive * rate >= 0.0)
    assert np.all((np.abs(drive) > threshold) == (rate != 0.0))


def test_frozen() -> None:
    sol = partly()
    check_frozen(sol)
    assert np.all(sol.dataset.natural_curvature.isel(segment=3) == 0.03)
    assert float(sol.dataset.natural_curvature.isel(segment=0)[-1]) > 0.05


def check_events(sol: pl.Solution) -> None:
    """Each onset and arrest names its segment; there the drive is at its threshold."""
    words = [event.sentence for event in sol.events if event.kind in ("onset", "arrest")]
    assert words[0].startswith("segment 1 starts to yield")
    assert any(word.startswith("segment 1 stops yielding") for word in words)
    assert not any("segment 4" in word for word in words)
    for event in sol.events:
        if event.kind in ("onset", "arrest"):
            j = int(event.sentence.split()[1]) - 1
            state = sol.history([event.t])[0]
            mu_nat = sol.model.layout.natural(state)
            drive = sol.model.drive(sol.model.layout.mu(state), mu_nat)[j]
            threshold = sol.model.threshold(mu_nat)[j]
            assert np.sign(drive) == event.direction
            assert abs(abs(drive) - threshold) <= sol.rtol


def test_events() -> None:
    check_events(partly())


def test_segments_in_the_dataset() -> None:
    sol = pl.solve(model(LOADS["ramps"], segments=(0, 0.3, 1)), 0.1, [0.1, -0.2], until=0.5)
    data = sol.dataset
    assert sol.model.natural_segments == (0.0, 0.3, 1.0)
    assert 0.3 in sol.grid.breaks
    assert data.segment_start.to_numpy().tolist() == [0.0, 0.3]
    assert data.segment_end.to_numpy().tolist() == [0.3, 1.0]
    for name in ("natural_curvature", "drive", "threshold"):
        assert data[name].dims == ("t", "segment")
    assert data.natural_curvature.to_numpy()[0].tolist() == [0.1, -0.2]
    # The natural configuration is two arcs joined smoothly: at the end the angle is 0.3*0.1 - 0.7*0.2.
    x, y, s = data.natural_x.to_numpy()[0], data.natural_y.to_numpy()[0], data.s.to_numpy()
    angle = np.where(s < 0.3, 0.1 * s, 0.03 - 0.2 * (s - 0.3))
    assert np.abs(x - sol.grid.A @ np.cos(angle)).max() <= 1e-12
    assert np.abs(y - sol.grid.A @ np.sin(angle)).max() <= 1e-12


def test_each_segment_starts_where_it_is_told() -> None:
    specimen = pl.Specimen(length="250 mm", bending_stiffness="0.035 N*m**2", retardation_time="120 s")
    material = pl.catalogue.material("one-shape", length=specimen.L, stiffness=specimen.EI, time=specimen.T)
    made = pl.Strut(material, pl.Load(), pl.Grid(8), specimen, natural_segments=2)
    sol = pl.solve(made, 0.0, ["0.4 1/m", "-2 1/km"], until="1 s")
    assert np.allclose(sol.dataset.natural_curvature.to_numpy()[0], [0.4, -0.002], rtol=4.0 * EPS, atol=0.0)
    assert sol.first_natural.shape == (2,)


def check_admissible() -> None:
    """A static shape is an equilibrium where no segment's drive exceeds its threshold; then nothing moves."""
    load = pl.Load(transverse=0.25)
    for natural, admissible in (([0.12, 0.05, 0.0], True), ([0.0, 0.0, 0.0], False), ([0.12, 0.05, 0.3], False)):
        made = model(load, segments=3)
        shape = pl.rest(made, 0.0, natural)
        assert shape.converged
        assert np.shape(shape.drive) == (3,)
        assert shape.admissible is admissible
        assert shape.admissible is bool(np.all(np.abs(shape.drive) <= shape.threshold))
        sol = pl.solve(made, shape.mu, natural, until=1.0)
        moved = np.abs(np.asarray(last(sol)[1]) - natural).max()
        assert bool(moved == 0.0) is admissible


def test_admissible() -> None:
    check_admissible()


@pytest.mark.parametrize("kind", ["strut", "rod"])
def test_the_end_of_a_motion_is_the_rest_of_its_natural_curvatures(kind: str) -> None:
    made = model(pl.Load(thrust=1.0, transverse=0.3), segments=3, inertia=KINDS[kind], material=pair("A"))
    sol = pl.solve(made, "0.3 + s", [0.3, 0.1, -0.4], until=400.0)
    mu, mu_nat, _ = last(sol)
    shape = pl.rest(made, mu, mu_nat)
    assert shape.stable
    # The natural curvatures still creep at about 1/t**2, and drag the shape behind them.
    assert np.abs(shape.mu - mu).max() <= 1e-4
    assert np.abs(shape.drive).max() <= 0.1 + 0.01


@pytest.mark.parametrize(
    ("segments", "words"),
    [
        (0, "natural_segments"),
        (-3, "natural_segments"),
        (2.5, "natural_segments"),
        (True, "natural_segments"),
        ("3", "natural_segments"),
        ((0.0, 0.5), "natural_segments"),
        ((0.0, 0.7, 0.3, 1.0), "natural_segments"),
        ((0.0, float("nan"), 1.0), "natural_segments"),
        ((), "natural_segments"),
        (None, "natural_segments"),
        (10**9, "natural_segments"),
    ],
    ids=str,
)
def test_segments_that_are_none(segments: Any, words: str) -> None:
    for inertia in (None, INERTIA):
        with pytest.raises(ArgumentError, match=words):
            model(pl.Load(), segments=segments, inertia=inertia)


@pytest.mark.parametrize(
    "natural", [[0.1, 0.2], [0.1] * 4, [0.1, float("nan"), 0.2], ["a", "b", "c"], [[0.1], [0.2], [0.3]]], ids=str
)
def test_natural_curvatures_that_do_not_fit(natural: Any) -> None:
    for verb in (lambda made: pl.solve(made, 0.0, natural, until=1.0), lambda made: pl.rest(made, 0.0, natural)):
        with pytest.raises(ArgumentError, match="natural_curvature"):
            verb(model(pl.Load(), segments=3, material=NEVER))
