"""What several claims need: the reference motions, random materials and shapes, and measures of error."""

from __future__ import annotations

import json
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from hypothesis import strategies as st

import plastica as pl

EPS = float(np.finfo(float).eps)
DATA = Path(__file__).parent / "data"

SHAPES = {
    "smooth": "1.2*cos(2*s) + 0.4",
    "step": "2*(1 - step(s - 0.5)) - step(s - 0.5)",
    "reverse": "-s/2",
}


def pair(name: str, c: float = 1.0) -> pl.Material:
    """Return the materials of the reference files: A has one preferred shape, B three."""
    if name == "A":
        return pl.Material("k*m**2/2", "c*pos(x)**2", "h", {"k": 1.0, "c": c, "h": 0.1})
    return pl.Material(
        "b*m**2*(m**2 - m1**2)**2/m1**4", "c*pos(x)**2", "h*(1 + m**2)", {"b": 0.05, "m1": 1.5, "c": c, "h": 0.05}
    )


@cache
def reference() -> list[dict[str, Any]]:
    """The 21 reference motions, to about 20 digits (the file says how they were made)."""
    return json.loads((DATA / "evolution.json").read_text())["cases"]


def label(case: dict[str, Any]) -> str:
    return f"{case['initial']}-{case['pair']}-c{case['c']}-gamma{case['gamma']}"


def strut_of(case: dict[str, Any], nodes: int | str = 24) -> pl.Strut:
    return pl.Strut(pair(case["pair"], float(case["c"])), pl.Load(thrust=float(case["gamma"])), pl.Grid(nodes=nodes))


def solution_of(case: dict[str, Any], **options: Any) -> pl.Solution:
    nodes = options.pop("nodes", 24)
    until = options.pop("until", 100.0)
    natural = float(case["mu0_0"])
    return pl.solve(strut_of(case, nodes), SHAPES[case["initial"]], natural, until=until, **options)


def reference_error(sol: pl.Solution, case: dict[str, Any]) -> float:
    """Largest error against the reference, relative to the largest curvature and to the natural curvature."""
    worst = 0.0
    for row in case["values"]:
        t = float(row["T"])
        if t > sol.history.end:
            continue
        places = {"0.5-": float(np.nextafter(0.5, 0.0)), "0.5+": 0.5}
        s = [places.get(name) or float(name) for name in row["mu"]]
        exact = np.array([float(value) for value in row["mu"].values()])
        worst = max(worst, float(np.abs(sol.at(s, t) - exact).max() / np.abs(exact).max()))
        state = sol.history([t])[0]
        n = sol.grid.size
        natural = float(row["mu0"])
        worst = max(worst, abs(float(state[n]) - natural) / abs(natural))
        drive = float(sol.model.drive(state[:n], state[n]))
        worst = max(worst, abs(drive - float(row["Dhat"])) / max(abs(float(row["Dhat"])), abs(natural)))
    return worst


@st.composite
def materials(draw: st.DrawFn) -> pl.Material:
    """Random admissible materials: one or three preferred shapes, constant or hardening threshold, three flows."""
    k = draw(st.floats(0.1, 3.0))
    preference = draw(st.sampled_from(["k*m**2/2", "k*(m**2/2 + m**4/4)", "k*m**2*(m**2 - 1)**2", "k*(cosh(m) - 1)"]))
    threshold = draw(st.sampled_from(["h", "h*(1 + m**2)", "h*(2 - 1/(1 + m**2))"]))
    flow = draw(st.sampled_from(["c*pos(x)**2", "c*pos(x)**3", "c*pos(x)**2/(1 + pos(x))"]))
    c, h = draw(st.floats(0.05, 20.0)), draw(st.floats(0.02, 1.0))
    return pl.Material(preference, flow, threshold, {"k": k, "c": c, "h": h})


@st.composite
def shapes(draw: st.DrawFn) -> str:
    """Random initial shapes, smooth or with a jump at 0.4."""
    a, b = draw(st.floats(-2.0, 2.0)), draw(st.floats(-2.0, 2.0))
    jump = draw(st.sampled_from([0.0, 0.0, 1.0, -1.5]))
    return f"{a:.3f} + {b:.3f}*cos(3*s) + {jump}*step(s - 0.4)"


@st.composite
def struts(draw: st.DrawFn, *, varying: bool = False) -> pl.Strut:
    """Random struts under constant or varying thrust."""
    gamma = draw(st.floats(0.0, 8.0))
    thrust: Any = gamma
    if varying:
        thrust = draw(
            st.sampled_from(
                [
                    pl.programs.ramp_hold_release(gamma, 1.0, 2.0, 0.0),
                    pl.programs.cycles(0.0, gamma, 1.5, 3, shape="triangle"),
                    pl.programs.table([0.0, 1.0, 1.0, 4.0], [gamma, gamma, 0.5 * gamma, 2.0]),
                    f"{gamma:.3f}*(1 + sin(t)/2)",
                ]
            )
        )
    return pl.Strut(draw(materials()), pl.Load(thrust=thrust), pl.Grid(nodes=16, breaks=(0.0, 0.4, 1.0)))
