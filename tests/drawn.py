"""What the claims about pictures of equilibria share: the results that are looked at, and looks at a figure."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

import plastica as pl

from .pictured import material, run, si_strut, strut
from .support import EPS

PAIR_A = material()
SI = si_strut("1.6 N")
LENGTH, STIFFNESS = 0.25, 0.035


@cache
def made(name: str) -> Any:
    """The results that are looked at."""
    makers: dict[str, Callable[[], Any]] = {
        "equilibrium": lambda: pl.equilibrium(PAIR_A, 3.0, 3.5),
        "equilibrium in SI": lambda: pl.equilibrium(SI.material, 3.0, 1.2, specimen=SI.specimen),
        "frozen": lambda: pl.equilibria_at(5.0, 0.1)[0],
        "set": lambda: pl.equilibria(PAIR_A, 3.0),
        "set in SI": lambda: pl.equilibria(SI.material, 1.0, specimen=SI.specimen),
        "set at 0": lambda: pl.equilibria(PAIR_A, 0.0),
        "spectrum": lambda: pl.spectrum(pl.equilibrium(PAIR_A, 40.0, 9.0), 6, lowest=3),
        "spectrum in SI": lambda: pl.spectrum(made("equilibrium in SI"), 3),
        "spectrum at Euler's load": lambda: pl.spectrum(pl.equilibrium(PAIR_A, np.pi**2 / 4.0, 0.0)),
        "rest": lambda: pl.rest(strut(), 0.5, 0.2),
        "limit": lambda: run("buckles").limit,
        "limit in SI": lambda: run("long").limit,
        "interior": lambda: run("elastic").limit,
        "undecided": lambda: run("short").limit,
        "arrived": lambda: run("still").limit,
        "branches": lambda: pl.branches(0.1, (0.0, 40.0), 61),
        "folds": lambda: pl.fold_curve((0.0, 12.0)),
        "capacity": lambda: pl.capacity(PAIR_A, np.array([1.3, 2.0, 2.3])),
        "capacity in SI": lambda: pl.capacity(SI.material, np.array([2.2, 2.4]), specimen=SI.specimen),
        "phase": lambda: pl.phase_diagram(PAIR_A, (0.0, 6.0), (-6.0, 6.0), (60, 60)),
        "phase in SI": lambda: pl.phase_diagram(SI.material, (0.0, 4.0), (-4.0, 4.0), (40, 40), specimen=SI.specimen),
        "basin": lambda: pl.basin(strut(2.0), "cos(pi*s/2)", [-0.6, 0.1, 0.6], [-0.02, 0.02]),
        "basin row": lambda: pl.basin(strut(2.0), "cos(pi*s/2)", [0.1, 0.6], 0.0),
    }
    return makers[name]()


EVERY = (
    "equilibrium",
    "equilibrium in SI",
    "frozen",
    "set",
    "set in SI",
    "set at 0",
    "spectrum",
    "spectrum in SI",
    "spectrum at Euler's load",
    "rest",
    "limit",
    "limit in SI",
    "interior",
    "undecided",
    "arrived",
    "branches",
    "folds",
    "capacity",
    "capacity in SI",
    "phase",
    "phase in SI",
    "basin",
    "basin row",
)


def drawn(ax: Axes, label: str) -> tuple[np.ndarray, np.ndarray]:
    """All points of the lines with this label, one after the other."""
    found = [each for each in ax.lines if each.get_label() == label]
    assert found, f"no {label!r} among {[each.get_label() for each in ax.lines]}"
    x, y = (np.concatenate([np.asarray(getattr(each, get)(), float) for each in found]) for get in _GET)
    return x, y


_GET = ("get_xdata", "get_ydata")


UNITS = {"days": 86400.0, "h": 3600.0, "mN·m²": 1e-3, "µN·m²": 1e-6, "nN·m²": 1e-9}


def unit_of(label: str) -> float:
    """What the unit in brackets at the end of a label is in SI; 1 for all others."""
    return UNITS.get(label.rsplit("(", maxsplit=1)[-1].rstrip(")"), 1.0)


def near(found: Any, expected: Any, scale: float = 1.0) -> None:
    """Equal to rounding."""
    found, expected = np.asarray(found, float), np.asarray(expected, float)
    assert found.shape == expected.shape
    both = np.isfinite(found) & np.isfinite(expected)
    assert both.any()
    assert np.abs(found[both] - expected[both]).max() <= 64.0 * EPS * max(scale, float(np.abs(expected[both]).max()))


def title(figure: Figure) -> str:
    """The title of a figure on one line."""
    found = figure.get_suptitle()
    return str(found).replace("\n", " ")


def has(ax: Axes, label: str) -> bool:
    """Whether a line has this label."""
    return any(each.get_label() == label for each in ax.lines)
