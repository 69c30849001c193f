"""Many struts at once beside a loop of SciPy and a `vmap` of diffrax, at equal achieved error; how the cost grows.

By NumPy and in machine code ("numba"). The peer in JAX is run by the Python that PEER_PYTHON names (this one by
default); where that has no diffrax, it says "not measured here".
"""

from __future__ import annotations

import json
import os
import resource
import statistics
import subprocess
import sys
import tempfile
import time
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp

import plastica as pl
from benchmarks import peers
from benchmarks.timing import machine, verdict

UNTIL = 100.0
NODES = 16
STRUT = pl.Strut(
    pl.Material("k*m**2/2", "c*pos(x)**2", "h", {"k": peers.K, "c": peers.C, "h": peers.H}),
    pl.Load(),
    pl.Grid(NODES),
)
SAMPLE = 100
"""Members whose error is measured."""
LIBRARIES = ("numpy", "numba")
HERE = Path(__file__).parent


def thrusts(count: int) -> np.ndarray:
    return np.random.default_rng(7).uniform(0.5, 10.0, count)


def ours(gamma: np.ndarray, rtol: float, library: str, until: float = UNTIL, workers: int = 1) -> np.ndarray:
    """Last natural curvature and position of the free end, shape (3, members)."""
    options = {"until": until, "rtol": rtol, "workers": workers, "library": library}
    found = pl.solve_many(STRUT, "1 + cos(3*s)", thrust=gamma, **options)
    assert set(found.status.values) == {"done"}
    return np.array([found[name].values for name in ("natural_curvature", "tip_x", "tip_y")])


def by_hand(gamma: float, rtol: float) -> np.ndarray:
    """One strut by SciPy's DOP853 on a rate written by hand, as in `benchmarks.peers`."""
    s, w, A, B = STRUT.grid.s, STRUT.grid.w, STRUT.grid.A, STRUT.grid.B
    n, gB = s.size, gamma * B

    def rate(t: float, y: np.ndarray) -> np.ndarray:
        mu, m = y[:n], y[n]
        out = np.empty(n + 1)
        out[:n] = m - mu + gB @ np.sin(A @ mu)
        drive = w @ mu - m - peers.K * m
        up, down = drive - peers.H, -peers.H - drive
        out[n] = (peers.C * up * up if up > 0.0 else 0.0) - (peers.C * down * down if down > 0.0 else 0.0)
        return out

    y0 = np.append(peers.initial(s), 0.0)
    last = solve_ivp(rate, (0.0, UNTIL), y0, method="DOP853", rtol=rtol, atol=1e-3 * rtol).y[:, -1]
    theta = A @ last[:n]
    return np.array([last[n], w @ np.cos(theta), w @ np.sin(theta)])


@cache
def reference() -> np.ndarray:
    return np.array([by_hand(gamma, 1e-12) for gamma in thrusts(SAMPLE)]).T


def error(found: np.ndarray) -> float:
    """Largest error of the sample's members."""
    return float(np.abs(found[:, :SAMPLE] - reference()).max())


def equal_error(bar: float, library: str) -> float:
    """The loosest tolerance at which our error on the sample is at most this."""
    tolerances = [digit * 10.0**-power for power in range(5, 11) for digit in (8, 5, 3, 2, 1)]
    return next(rtol for rtol in tolerances if error(ours(thrusts(SAMPLE), rtol, library)) <= bar)


def against_scipy() -> None:
    """One core: interleaved, the median of five ratios."""
    for theirs in (1e-7, 1e-9):
        bar = error(np.array([by_hand(gamma, theirs) for gamma in thrusts(SAMPLE)]).T)
        print(f"SciPy DOP853 by hand at {theirs:g}: error {bar:.1e}")
        for library in LIBRARIES:
            rtol = equal_error(bar, library)
            gamma, ratios, each = thrusts(4096), [], []
            for _ in range(5):
                began = time.process_time()
                for one in gamma[:SAMPLE]:
                    by_hand(one, theirs)
                single = (time.process_time() - began) / SAMPLE
                began = time.process_time()
                ours(gamma, rtol, library)
                each.append((time.process_time() - began) / gamma.size)
                ratios.append(single / each[-1])
            reached, mine = error(ours(thrusts(SAMPLE), rtol, library)), statistics.median(each)
            print(
                f"  {1e3 * single:.1f} ms; plastica, {library}, at {rtol:g}: "
                f"error {reached:.1e}, {1e3 * mine:.3f} ms a member"
            )
            print("  " + verdict("faster at equal error, one core", statistics.median(ratios), 30.0, at_least=True))


def peer_ends() -> list[dict[str, Any]]:
    """What the peer in JAX says of itself at each of its tolerances; nothing where there is none."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "grid.npz"
        grid = STRUT.grid
        np.savez(file, A=grid.A, B=grid.B, w=grid.w, y0=np.append(peers.initial(grid.s), 0.0), gamma=thrusts(4096))
        peer = os.environ.get("PEER_PYTHON", sys.executable)
        done = subprocess.run(
            [peer, str(HERE / "diffrax_peer.py"), str(file), "cpu"], capture_output=True, text=True, check=False
        )
    if done.returncode != 0:
        print(f"diffrax: not measured here ({done.stderr.strip().splitlines()[-1]})")
        return []
    return [json.loads(line) for line in done.stdout.splitlines()]


def against_diffrax() -> None:
    """Both cores, wall time: the peer at its best, once compiled; we with our start, the median of three."""
    for told in peer_ends():
        bar = error(np.array(told["ends"]))
        print(
            f"diffrax Tsit5 at {told['rtol']:g}, vmap over {told['batch']}: error {bar:.1e}, "
            f"{1e3 * told['each']:.3f} ms"
        )
        for library in LIBRARIES:
            rtol = equal_error(bar, library)
            count, walls = 1 << 18, []
            for _ in range(3):
                began = time.perf_counter()
                ours(thrusts(count), rtol, library, workers=2)
                walls.append(time.perf_counter() - began)
            mine = statistics.median(walls) / count
            print(
                f"  plastica, {library}, at {rtol:g}: error {error(ours(thrusts(SAMPLE), rtol, library)):.1e}, "
                f"{1e3 * mine:.3f} ms a member of {count}, two processes with their start"
            )
            print("  " + verdict("faster at equal error, both cores", told["each"] / mine, 10.0, at_least=True))


def growth(library: str) -> None:
    """Cost per member over the number of members, each the least of some; and what the largest number takes."""
    cost = {}
    for count, repeat in ((10**3, 9), (10**4, 5), (10**5, 3), (10**6, 1)):
        gamma, times = thrusts(count), []
        for _ in range(repeat):
            began = time.process_time()
            ours(gamma, 1e-8, library)
            times.append((time.process_time() - began) / count)
        cost[count] = min(times)
        print(f"{count:8d} members to t = {UNTIL:g} at 1e-8, {library}: {1e3 * cost[count]:.4f} ms each", flush=True)
    spread = max(cost.values()) / min(cost.values())
    print("  " + verdict("dearest beside cheapest", spread, 1.25))
    size = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20
    print("  " + verdict("peak memory of a million members, GiB", size, 2.0))


def second_worker(library: str) -> None:
    """Wall time of one process over that of two, the start of the processes included; the median of five."""
    gamma, ratios = thrusts(1 << (17 if library == "numpy" else 18)), []
    for _ in range(5):
        walls = []
        for workers in (1, 2):
            began = time.perf_counter()
            ours(gamma, 1e-8, library, workers=workers)
            walls.append(time.perf_counter() - began)
        ratios.append(walls[0] / walls[1])
        print(f"  {gamma.size} members, {library}: {walls[0]:.1f} s, two workers {walls[1]:.1f} s", flush=True)
    print("  " + verdict("a second worker process", statistics.median(ratios), 1.6, at_least=True))


def apart(function: str, *, core: bool) -> None:
    """Run one measurement in a process of its own, on one core where asked."""
    pin = ["taskset", "-c", "0"] if core else []
    environment = {**os.environ, "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
    command = [*pin, sys.executable, "-c", f"from benchmarks import many; many.{function}"]
    subprocess.run(command, cwd=HERE.parent, env=environment, check=True)


def main() -> None:
    print(f"many struts at once ({machine()})", flush=True)
    apart("against_scipy()", core=True)
    apart("against_diffrax()", core=False)
    for library in LIBRARIES:
        apart(f"growth('{library}')", core=True)
        apart(f"second_worker('{library}')", core=False)


if __name__ == "__main__":
    main()
