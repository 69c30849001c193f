"""What the claims about pictures, films and pages share: the runs that are looked at, and a look at a line."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.figure import Figure

import plastica as pl
from plastica.motion.history import History
from plastica.physics.status import Status
from plastica.show import plots

FIGURES: dict[str, Callable[[pl.Solution], Figure]] = {
    "shapes": plots.shapes,
    "curvature_map": plots.curvature_map,
    "natural": plots.natural,
    "energies": plots.energies,
    "loads": plots.loads,
    "plot": plots.plot,
}


def material(h: float = 0.1) -> pl.Material:
    return pl.Material("k*m**2/2", "c*pos(x)**2", "h", {"k": 1.0, "c": 1.0, "h": h})


def strut(thrust: object = 3.0, h: float = 0.1, **loads: object) -> pl.Strut:
    return pl.Strut(material(h), pl.Load(thrust=thrust, **loads), pl.Grid(nodes=10))  # type: ignore[arg-type]


def si_strut(thrust: object) -> pl.Strut:
    laws = pl.Material(
        "k*m**2/2",
        "c*pos(x)**2",
        "h",
        {"k": "0.035 N*m**2", "c": "4 1/(N**2*m**5*s)", "h": "0.003 N*m**2"},
    )
    specimen = pl.Specimen(length="250 mm", bending_stiffness="0.035 N*m**2", retardation_time="120 s")
    return pl.Strut(laws, pl.Load(thrust=thrust), pl.Grid(nodes=10), specimen=specimen)  # type: ignore[arg-type]


@cache
def run(name: str) -> pl.Solution:
    """The runs that are looked at."""
    hold = pl.programs.ramp_hold_release("1.6 N", "10 min", "1 day", "0 s")
    makers: dict[str, Callable[[], pl.Solution]] = {
        "buckles": lambda: pl.solve(strut(), "0.2", until=40.0, rtol=1e-6),
        "held": lambda: pl.solve(si_strut(hold), "0.4", until="2 days", rtol=1e-6),
        "long": lambda: pl.solve(si_strut("1.6 N"), "0.4", until="300 days", rtol=1e-6),
        "elastic": lambda: pl.solve(strut(2.0, 50.0), "0.2", until=10.0, rtol=1e-6),
        "rough": lambda: pl.solve(strut(1.5), pl.piecewise([0.5], [2.0, -1.0]), until=10.0, rtol=1e-6),
        "jump": lambda: pl.solve(strut(([0, 5, 5, 9], [2, 2, 0, 0]), transverse=0.1), "0.5", until=9.0, rtol=1e-6),
        "short": lambda: pl.solve(strut(), "0.2", until=1e-3, rtol=1e-4),
        "still": lambda: pl.solve(strut(0.0), 0.0, until=5.0),
        "stopped": lambda: pl.solve(strut(), "0.2", until=100.0, max_steps=30),
    }
    return makers[name]()


def not_begun() -> pl.Solution:
    """A run that did not take a step."""
    whole = run("buckles")
    return replace(
        whole,
        history=History.at_rest(0.0, whole.history.y[0]),
        legs=(np.array([0.0]), np.array([True, True])),
        status=Status(False, "solver_failed", "The solver gave up at the start."),
    )


def line(ax: Axes, label: str) -> tuple[np.ndarray, np.ndarray]:
    (found,) = (each for each in ax.lines if each.get_label() == label)
    return np.asarray(found.get_xdata(), dtype=float), np.asarray(found.get_ydata(), dtype=float)


def check_nothing_is_solved(monkeypatch: pytest.MonkeyPatch, show: Callable[[pl.Solution], object]) -> None:
    """Neither the integrator nor SciPy's solvers are called, once the result has told its verdict."""
    solution = run("buckles")
    assert solution.outcome.headline
    assert solution.limit is not None

    def refuse(*args: object, **options: object) -> None:
        raise AssertionError("a picture must not solve anything")

    monkeypatch.setattr("plastica.motion.solve.integrate", refuse)
    monkeypatch.setattr("plastica.motion.integrate.integrate", refuse)
    for name in ("LSODA", "DOP853", "Radau", "BDF", "solve_ivp"):
        monkeypatch.setattr(f"scipy.integrate.{name}", refuse)
    show(solution)
