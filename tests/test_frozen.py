"""Claim 3 for segments, inertia and every method: natural curvatures keep their bits while no drive is beyond reach."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import plastica as pl
from plastica.motion import integrate
from plastica.motion.integrate import METHODS

MATERIAL = pl.Material("k*m**2/2", "c*pos(x)**2", "h", {"k": 1.0, "c": 1.0, "h": 0.3})


def check_frozen(sol: pl.Solution) -> None:
    """No natural curvature moves by a bit on a leg on which its segment does not yield; and some leg is such a one."""
    history, layout = sol.history, sol.model.layout
    natural = history.y[:, layout.natural_columns]
    starts, moving = sol.legs
    ends = [*starts[1:], history.end]
    found = 0
    for start, end, flags in zip(starts, ends, moving.reshape(starts.size + 1, -1)[:-1], strict=True):
        inside = (history.t >= start) & (history.t <= end)
        for segment in np.nonzero(~flags)[0]:
            found += 1
            assert np.ptp(natural[inside, segment]) == 0.0, (start, segment)
    assert found


def strut_in_segments(method: str) -> pl.Solution:
    strut = pl.Strut(MATERIAL, pl.Load(thrust=3.0), pl.Grid(nodes=6), natural_segments=4)
    return pl.solve(strut, "0.5 + s", [0.0, 0.0, 0.0, 0.1], until=30.0, method=method, rtol=1e-7)


def swinging_rod() -> pl.Solution:
    """Swings within its threshold on a grid fine enough for Newton's matrices to be pivoted."""
    rod = pl.Rod(MATERIAL, pl.Load(transverse="0.5*sin(3*t)"), pl.Grid(nodes=24), translational_inertia=10.0)
    return pl.solve(rod, until=10.0, rtol=1e-6)


@pytest.mark.parametrize("method", METHODS)
def test_segments_that_do_not_yield(method: str) -> None:
    check_frozen(strut_in_segments(method))


def test_a_rod_that_swings() -> None:
    check_frozen(swinging_rod())


def unprotected(record: Any) -> list[int]:
    return []


def test_what_is_not_protected_is_caught(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(integrate._Recorder, "frozen", property(unprotected))
    with pytest.raises(AssertionError):
        check_frozen(swinging_rod())
