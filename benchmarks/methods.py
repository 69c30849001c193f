"""Which of SciPy's methods is the default, and why: time and error of each over the reference motions."""

from __future__ import annotations

import json
import statistics
import time
from pathlib import Path
from typing import Any

import numpy as np

import plastica as pl
from benchmarks.timing import machine

REFERENCE = Path(__file__).parent.parent / "tests" / "data" / "evolution.json"
SHAPES = {"smooth": "1.2*cos(2*s) + 0.4", "step": "2 - 3*step(s - 0.5)", "reverse": "-s/2"}
LAWS = {
    "A": ("m**2/2", "1/10"),
    "B": ("m**2*(m**2 - 2.25)**2/101.25", "(1 + m**2)/20"),
}


def one(case: dict[str, Any], method: str) -> tuple[float, float]:
    """CPU seconds, and the error of the natural curvature at t = 100 relative to it."""
    preference, threshold = LAWS[case["pair"]]
    material = pl.Material(preference, f"{case['c']}*pos(x)**2", threshold)
    strut = pl.Strut(material, pl.Load(thrust=float(case["gamma"])), pl.Grid(nodes=24))
    pl.solve(strut, SHAPES[case["initial"]], float(case["mu0_0"]), until=1e-6, method=method)
    began = time.process_time()
    sol = pl.solve(strut, SHAPES[case["initial"]], float(case["mu0_0"]), until=100.0, method=method)
    spent = time.process_time() - began
    exact = float(case["values"][-1]["mu0"])
    return spent, abs(float(sol.history.y[-1, sol.grid.size]) - exact) / abs(exact)


def main() -> None:
    print(f"methods at rtol 1e-8 over the reference motions to t = 100 ({machine()})")
    cases = json.loads(REFERENCE.read_text())["cases"]
    found = {method: [one(case, method) for case in cases] for method in ("LSODA", "DOP853", "Radau", "BDF")}
    quickest = statistics.median(time for time, _ in found["LSODA"])
    for method, results in found.items():
        times, errors = zip(*results, strict=True)
        ratio = statistics.median(times) / quickest
        print(
            f"{method:7s} median {1e3 * statistics.median(times):6.1f} ms ({ratio:4.1f}x LSODA), "
            f"error: median {np.median(errors):.1e}, largest {max(errors):.1e}"
        )
