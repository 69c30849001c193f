"""What the claims on rods with inertia and on segments need: models, loads of every kind, and states of rods."""

from __future__ import annotations

from typing import Any

import numpy as np

import plastica as pl
from tests.support import pair

NEVER = pl.Material("m**2/2", "pos(x)**2", "1000")
"""A material whose natural curvature never moves at the drives met here."""

INERTIA = {"translational_inertia": 1e-2, "rotary_inertia": 1e-4, "damping": 1.0}
ELASTIC = {"translational_inertia": 1.0, "rotary_inertia": 1.0, "damping": 0.0}
"""Rotary inertia as large as this keeps the highest frequencies of the grid, and so the runs, within bounds."""

KINDS: dict[str, dict[str, float] | None] = {"strut": None, "rod": INERTIA, "elastic": ELASTIC}
"""The models: without inertia, with inertia and damping, and without damping."""

LOADS: dict[str, pl.Load] = {
    "constant": pl.Load(thrust=2.0, transverse=0.5, couple=-0.3, weight=1.0, weight_angle=0.7),
    "ramps": pl.Load(
        thrust=pl.programs.ramp_hold_release(3.0, 0.5, 0.5, 0.0), transverse=([0.0, 1.0, 2.0], [0.0, 0.6, 0.2])
    ),
    "jumps": pl.Load(
        thrust=([0.0, 0.6, 0.6, 4.0], [0.0, 2.0, 3.0, 1.0]), couple=([0.0, 1.1, 1.1, 4.0], [0.2, 0.2, -0.4, -0.4])
    ),
    "cyclic": pl.Load(transverse="sin(2*t)", weight="1 + cos(3*t)", weight_angle=-0.4),
}
"""Loads of every kind: thrust, transverse force, couple, weight at an angle; constant, bent, with jumps, cyclic."""


def model(
    load: pl.Load,
    *,
    nodes: int = 8,
    segments: Any = 1,
    material: pl.Material | None = None,
    inertia: dict[str, float] | None = None,
) -> pl.Strut | pl.Rod:
    """A strut, or with `inertia` a rod."""
    parts = (material or pair("A", 5.0), load, pl.Grid(nodes))
    if inertia is None:
        return pl.Strut(*parts, natural_segments=segments)
    return pl.Rod(*parts, natural_segments=segments, **inertia)


def state_of(made: pl.Strut | pl.Rod) -> tuple[np.ndarray, Any, np.ndarray | None]:
    """Some smooth curvature, natural curvatures that yield to both sides, and a rate of curvature: nothing special."""
    s, m = made.grid.s, made.segments
    mu = 0.4 + np.cos(3.0 * s)
    mu_nat: Any = 0.3 if m == 1 else np.cos(np.arange(m) * 2.0)
    return mu, mu_nat, (np.sin(4.0 * s) * (1.0 - s) ** 2 if made.has_inertia else None)


def last(sol: pl.Solution) -> tuple[np.ndarray, Any, np.ndarray | None]:
    """Curvature, natural curvature and rate of curvature at the end of a motion."""
    layout, y = sol.model.layout, sol.history.y[-1]
    return layout.mu(y), layout.natural(y), layout.mu_t(y)


def tip(made: pl.Strut | pl.Rod, mu: np.ndarray) -> np.ndarray:
    """Place of the free end."""
    theta = made.angle(mu)
    return np.array([np.cos(theta) @ made.grid.w, np.sin(theta) @ made.grid.w])


def order(sizes: np.ndarray, errors: np.ndarray) -> float:
    """Slope of log error over log size, fitted over all refinements."""
    return float(np.polyfit(np.log(sizes), np.log(errors), 1)[0])
