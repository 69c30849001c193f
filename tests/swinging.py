"""What the claims about pictures and histories of the general rod share: runs with inertia, segments and all loads."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache

import numpy as np

import plastica as pl

from .pictured import material

JUMPING = ([0.0, 4.0, 4.0, 9.0], [0.5, 0.5, 0.0, 0.0])
"""A transverse force that is taken away at t = 4."""


def loads(**more: object) -> pl.Load:
    """Every load at once: a cycling thrust, a force that jumps, a couple, a weight at an angle."""
    given = {
        "thrust": pl.programs.cycles(0.0, 2.0, 5.0, 2),
        "transverse": JUMPING,
        "couple": 0.3,
        "weight": 1.0,
        "weight_angle": 0.7,
        **more,
    }
    return pl.Load(**given)  # type: ignore[arg-type]


def si_rod() -> pl.Rod:
    """A strip of plastic that is bent aside and let go."""
    laws = pl.Material(
        "k*m**2/2",
        "c*pos(x)**2",
        "h",
        {"k": "0.035 N*m**2", "c": "4000 1/(N**2*m**5*s)", "h": "0.003 N*m**2"},
    )
    specimen = pl.Specimen(
        length="250 mm",
        bending_stiffness="0.035 N*m**2",
        retardation_time="20 ms",
        mass_per_length="0.03 kg/m",
        rotary_inertia="1e-9 kg*m",
    )
    force = pl.programs.ramp_hold_release("0.8 N", "0.1 s", "0.1 s", "0 s")
    return pl.Rod(laws, pl.Load(transverse=force), pl.Grid(nodes=8), specimen=specimen)


@cache
def run(name: str) -> pl.Solution:
    """The runs that are looked at; each has something that the strut under thrust has not."""
    m, grid = material(), pl.Grid(nodes=8)
    inertia = {"translational_inertia": 0.05, "rotary_inertia": 1e-4}
    makers: dict[str, Callable[[], pl.Solution]] = {
        "strut": lambda: pl.solve(pl.Strut(m, loads(), grid), 0.2, until=8.0, rtol=1e-7),
        "rod": lambda: pl.solve(
            pl.Rod(m, loads(), pl.Grid(nodes=6), natural_segments=2, **inertia), 0.2, until=8.0, rtol=1e-7
        ),
        "let go": lambda: pl.solve(si_rod(), until="0.5 s", rtol=1e-6),
        "pieces": lambda: pl.solve(
            pl.Strut(
                m,
                pl.Load(couple=pl.programs.cycles(-1.5, 1.5, 8.0), weight=2.0, weight_angle="-60 deg"),
                pl.Grid(nodes=6),
                natural_segments=(0.0, 0.4, 0.7, 1.0),
            ),
            0.1,
            until=16.0,
            rtol=1e-6,
        ),
        "pulled": lambda: pl.solve(
            pl.Strut(m, pl.Load(thrust=pl.programs.cycles(-2.0, 3.0, 8.0), allow_tension=True), grid),
            0.4,
            until=16.0,
            rtol=1e-6,
        ),
        "own time": lambda: pl.solve(
            pl.Rod(m, pl.Load.at_angle(1.5, "30 deg"), grid, translational_inertia=1.0, damping=0.2),
            0.1,
            until=6.0,
            rtol=1e-6,
            curvature_rate="4*cos(pi*s/2)",
        ),
        "still": lambda: pl.solve(pl.Rod(m, pl.Load(), grid, translational_inertia=1.0), until=2.0),
    }
    return makers[name]()


def finer(solution: pl.Solution, factor: int) -> np.ndarray:
    """Times of the dataset, and `factor` - 1 between any two."""
    t = solution.dataset["t"].values
    between = np.arange(1, factor) / factor
    return np.unique(np.concatenate([t, (t[:-1, None] + np.diff(t)[:, None] * between).ravel()]))
