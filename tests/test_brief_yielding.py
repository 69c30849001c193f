"""Yielding that begins and ends within one step of the solver is met, and so is a pause of it."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import minimize_scalar

import plastica as pl
from plastica.motion.integrate import METHODS

H = 0.1
EXCESSES = (1e-2, 1e-4, 1e-6)


def _drive(t: float) -> float:
    """Drive of a frozen strut, straight at first, under an end couple sin t: it solves D' = sin t - D."""
    return float(0.5 * (np.exp(-t) + np.sin(t) - np.cos(t)))


@cache
def _peak() -> tuple[float, float]:
    found = minimize_scalar(lambda t: -_drive(t), bounds=(1.5, 3.5), method="bounded", options={"xatol": 1e-12})
    return float(found.x), _drive(found.x)


def _flow(excess: float) -> float:
    """A coefficient of the flow that makes an increment of about 1e-6."""
    return float(10.0 ** np.round(np.log10(1e-6 / ((excess * H) ** 2 * np.sqrt(excess)))))


@cache
def increment(excess: float) -> float:
    """Natural curvature after the drive has peaked at (1 + excess) H, from the two equations of a uniform strut."""
    at, peak = _peak()
    factor, flow = (1.0 + excess) * H / peak, _flow(excess)

    def rate(t: float, y: np.ndarray) -> list[float]:
        drive = y[0] - 2.0 * y[1]
        return [factor * np.sin(t) - y[0] + y[1], flow * max(drive - H, 0.0) ** 2]

    width = 6.0 * np.sqrt(excess)
    start = at - width - 0.1
    found = solve_ivp(
        rate, (start, 3.5), [factor * _drive(start), 0.0], "DOP853", rtol=1e-13, atol=1e-18, max_step=width / 30.0
    )
    return float(found.y[1, -1])


def check_met(method: str, excess: float, segments: int = 1, nodes: int = 4) -> None:
    """Onset and arrest are events, and the increment is right as far as the drive can be known: to rtol of H."""
    material = pl.Material("m**2/2", "c*pos(x)**2", "h", {"c": _flow(excess), "h": H})
    load = pl.Load(couple=f"{(1.0 + excess) * H / _peak()[1]!r}*sin(t)")
    strut = pl.Strut(material, load, pl.Grid(nodes=nodes), natural_segments=segments)
    sol = pl.solve(strut, until=3.5, method=method)
    kinds = [event.kind for event in sol.events if event.kind in ("onset", "arrest")]
    assert kinds == ["onset"] * segments + ["arrest"] * segments
    found = sol.history.y[-1, sol.model.layout.natural_columns]
    assert np.abs(found / increment(excess) - 1.0).max() <= 10.0 * sol.rtol * (1.0 / excess + 1e3)
    # Before the onset and after the arrest it keeps its bits.
    onset, arrest = (next(event.t for event in sol.events if event.kind == kind) for kind in ("onset", "arrest"))
    natural = sol.history.y[:, sol.model.layout.natural_columns]
    assert np.all(natural[sol.history.t <= onset] == 0.0)
    assert segments > 1 or np.all(natural[sol.history.t >= arrest] == found)


@pytest.mark.parametrize("excess", EXCESSES)
@pytest.mark.parametrize("method", METHODS)
def test_met(method: str, excess: float) -> None:
    check_met(method, excess)


@pytest.mark.parametrize(("segments", "nodes"), [(3, 4), (1, 16)])
def test_met_on_grids_and_segments(segments: int, nodes: int) -> None:
    check_met("LSODA", 1e-5, segments, nodes)


def check_pause(method: str, depth: float) -> None:
    """While it yields the drive dips below the threshold for a moment: an arrest and an onset, and nothing moves."""
    dip = f"{1.0 + depth!r}*exp(-(2*(t-3))**2)"
    # The couple under which the drive is h (2 - dip) where the natural curvature hardly moves: D' + D.
    load = pl.Load(couple=f"{H}*(2 - {dip} + 8*(t-3)*{dip})")
    material = pl.Material("m**2/2", "c*pos(x)**2", "h", {"c": 1e-7, "h": H})
    sol = pl.solve(pl.Strut(material, load, pl.Grid(nodes=4)), 2.0 * H, until=6.0, method=method)
    events = [event for event in sol.events if event.kind in ("onset", "arrest")]
    assert [event.kind for event in events] == ["onset", "arrest", "onset"]
    # The dip is (1 + depth) (1 - (2 (t - 3))^2) near its bottom.
    assert abs(events[2].t - events[1].t - np.sqrt(depth)) <= 0.05 * np.sqrt(depth)


@pytest.mark.parametrize("method", METHODS)
def test_pause(method: str) -> None:
    check_pause(method, 1e-4)
