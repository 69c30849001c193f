"""The branch of natural curvature 0.1 from gamma = 0 to 40, with stability, beside AUTO-07p (as packed in bifpy)."""

from __future__ import annotations

import shutil
import statistics
import subprocess
import tempfile
import time
from collections.abc import Callable
from importlib import metadata, util
from pathlib import Path
from typing import Any

import numpy as np

import plastica as pl
from benchmarks.timing import machine, verdict
from plastica.equilibria.elastica import ends

NATURAL = 0.1
GAMMA = (0.0, 40.0)
POINTS = 107
REPEAT = 15

SETTINGS = {
    "ndim": 2, "npar": 1, "nbc": 2, "nint": 0, "ntst": 20, "ncol": 4, "iad": 3, "ilp": 0, "isp": 0, "iads": 1,
    "itmx": 9, "itnw": 7, "nwtn": 3, "jac": 0, "ds": 0.1, "dsmin": 1e-3, "dsmax": 0.438, "rl0": -1.0, "rl1": GAMMA[1],
    "a0": -1e300, "a1": 1e300, "epsl": 1e-10, "epsu": 1e-10, "epss": 1e-8, "nmx": 400, "npr": 1,
}  # fmt: skip
"""AUTO's constants: as coarse as an error of 1e-9 allows, every point written, steps that come to 107 points."""


def ours() -> tuple[pl.Branch, ...]:
    return pl.branches(NATURAL, gamma=GAMMA, count=POINTS)


def first(made: tuple[Any, ...]) -> Any:
    return next(branch for branch in made if branch.gamma[0] == GAMMA[0])


def error(gamma: np.ndarray, alpha: np.ndarray) -> float:
    """Largest distance in alpha from the branch, by Newton's method with the closed forms in twice the precision."""
    import mpmath as mp

    worst = 0.0
    with mp.workdps(34):
        for g, a in zip(gamma.tolist(), alpha.tolist(), strict=True):
            end = ends(max(g, 0.0), a)
            worst = max(worst, abs(float((natural(mp, max(g, 0.0), a) - mp.mpf(NATURAL)) / float(end.theta0_slope))))
    return worst


def natural(mp: Any, gamma: float, alpha: float) -> Any:
    """phi'(1) in twice the precision: alpha cn, or alpha dn beyond the separatrix."""
    g, a = mp.mpf(gamma), mp.mpf(alpha)
    if g == 0:
        return a
    if a * a < 4 * g:
        return a * mp.re(mp.ellipfun("cn", mp.sqrt(g), m=a * a / (4 * g)))
    return a * mp.re(mp.ellipfun("dn", a / 2, m=4 * g / (a * a)))


def auto(folder: Path) -> tuple[np.ndarray, np.ndarray, Callable[[], object]]:
    """Compile the boundary value problem for AUTO-07p, run it, and return what it found and how to run it again."""
    from bifpy import auto as engine

    def equation(state: Any, parameter: Any) -> list[Any]:
        return [state[1], -parameter[0] * np.sin(state[0])]

    def start(state: Any, parameter: Any, t: float) -> None:
        state[0], state[1], parameter[0] = NATURAL * t, NATURAL, 0.0

    def ends_of_rod(left: Any, right: Any, _parameter: Any) -> list[Any]:
        return [left[0], right[1] - NATURAL]

    settings = {"ips": engine.IPS_GENERAL_BVP, **SETTINGS}
    made = engine.run(equation, start, settings, icu=[1], bcnd=ends_of_rod, transpile=True, keep_output=True)
    points = [p for p in made.branches[0].points if p.boundary_value_solution is not None]
    gamma = np.array([p.parameters[0] for p in points])
    alpha = np.array([p.boundary_value_solution.state[0][1] for p in points])
    shutil.copytree(made.output_directory, folder, dirs_exist_ok=True)
    shutil.rmtree(made.output_directory)
    return gamma, alpha, lambda: subprocess.run(["./model_exe"], cwd=folder, capture_output=True, check=True)


def cpu_times(candidates: dict[str, Callable[[], object]]) -> dict[str, float]:
    """Median CPU seconds of each, run in turn, with those of the programs that it starts."""
    import resource

    def spent() -> float:
        used = resource.getrusage(resource.RUSAGE_CHILDREN)
        return time.process_time() + used.ru_utime + used.ru_stime

    times: dict[str, list[float]] = {name: [] for name in candidates}
    for _ in range(REPEAT):
        for name, run in candidates.items():
            began = spent()
            run()
            times[name].append(spent() - began)
    return {name: statistics.median(found) for name, found in times.items()}


def main() -> None:
    print(f"branch of natural curvature {NATURAL}, gamma {GAMMA[0]:g} to {GAMMA[1]:g} ({machine()})")
    made = ours()
    branch = first(made)
    at_end = sum(int(np.count_nonzero(b.gamma == GAMMA[1])) for b in made)
    print(f"  plastica: {branch.gamma.size} points on it; all {len(made)} branches, {at_end} equilibria at the end")
    off = error(branch.gamma, branch.alpha)
    print(f"  error of plastica: {off:.1e} (at most 1e-11) {'met' if off <= 1e-11 else 'MISSED'}")
    if util.find_spec("bifpy") is None or shutil.which("gfortran") is None:
        alone = cpu_times({"plastica": ours})["plastica"]
        print(f"  plastica {1e3 * alone:.0f} ms; AUTO-07p not measured here: it needs bifpy and gfortran")
        return
    with tempfile.TemporaryDirectory() as folder:
        gamma, alpha, again = auto(Path(folder))
        inside = gamma <= GAMMA[1]
        times = cpu_times({"plastica": ours, "AUTO-07p": again})
    mine, theirs = times.values()
    print(
        f"  AUTO-07p (bifpy {metadata.version('bifpy')}): {inside.sum()} points of one branch, no stability, ", end=""
    )
    print(f"error {error(gamma[inside], alpha[inside]):.1e}; {1e3 * theirs:.0f} ms of its compiled program alone")
    print(f"  plastica: {1e3 * mine:.0f} ms for all branches with stability")
    print("  " + verdict("CPU time against AUTO-07p", mine / theirs, 1.0))
