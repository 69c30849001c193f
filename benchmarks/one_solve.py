"""One run to t = 100 beside SciPy by hand, and beside finite differences at their own error."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache

import numpy as np

import plastica as pl
from benchmarks import peers
from benchmarks.timing import interleaved, machine, verdict

STRUT = pl.Strut(
    pl.Material("k*m**2/2", "c*pos(x)**2", "h", {"k": peers.K, "c": peers.C, "h": peers.H}),
    pl.Load(thrust=peers.GAMMA),
    pl.Grid(nodes=16),
)


@cache
def strut(nodes: int) -> pl.Strut:
    return STRUT.with_grid(pl.Grid(nodes))


def ours(rtol: float = 1e-8, nodes: int = 16, method: str = "auto", atol: float | None = None) -> pl.Solution:
    return pl.solve(strut(nodes), "1 + cos(3*s)", 0.0, until=100.0, rtol=rtol, method=method, atol=atol)


def ends(sol: pl.Solution) -> np.ndarray:
    n = sol.grid.size
    mu, m = sol.history.y[-1, :n], float(sol.history.y[-1, n])
    return np.array([m, float(np.sin(sol.model.angle(mu)) @ sol.grid.w), float(sol.at(0.5, 100.0))])


def against_scipy() -> list[str]:
    lines = []
    for method in ("LSODA", "DOP853"):
        rtol, atol = 1e-8, 1e-11
        times = interleaved(
            {
                "plastica": lambda method=method, atol=atol: ours(method=method, atol=atol),
                "by hand, complete": lambda method=method, rtol=rtol, atol=atol: peers.complete(method, rtol, atol),
                "by hand, bare": lambda method=method, rtol=rtol, atol=atol: peers.bare(method, rtol, atol),
            }
        )
        mine, complete, bare = times.values()
        counts = ours(method=method, atol=atol).counts
        theirs = peers.complete(method, rtol, atol)
        lines += [
            f"{method}: " + ", ".join(f"{name} {1e3 * value:.1f} ms" for name, value in times.items()),
            f"  evaluations: plastica {counts.rates} in {counts.steps} steps, "
            f"by hand {theirs.nfev} in {theirs.t.size - 1}",
            "  " + verdict("against the complete one", mine / complete, 2.0),
            "  " + verdict("against the bare one", mine / bare, 4.0),
        ]
    return lines


def against_finite_differences(scheme: Callable[..., object], bar: float | None) -> list[str]:
    exact = ends(ours(rtol=1e-12, nodes=32))
    size = np.abs(exact)

    def error(values: object) -> float:
        return float((np.abs(np.asarray(values) - exact) / size).max())

    theirs = error(scheme(200))
    rtols = [a * 10.0**b for b in range(-7, -2) for a in (1.0, 2.0, 5.0)]
    good = [(n, r) for n in (8, 10, 12, 16) for r in rtols if error(ends(ours(r, n))) <= theirs]
    times = {choice: interleaved({"ours": lambda c=choice: ours(c[1], c[0])}, 5)["ours"] for choice in good}
    nodes, rtol = min(times, key=lambda choice: times[choice])
    both = interleaved({"ours": lambda: ours(rtol, nodes), "theirs": lambda: scheme(200)}, 15)
    cells = np.array([50, 100, 200, 400])
    errors = [error(scheme(int(n), "LSODA", 1e-10)) for n in cells]
    order = -np.polyfit(np.log(cells), np.log(errors), 1)[0]
    needed = int(np.ceil(cells[-1] * (errors[-1] / 1e-6) ** (1.0 / order)))
    needed += needed % 2
    ratio = both["theirs"] / both["ours"]
    said = (
        f"{ratio:.1f}x faster"
        if bar is None
        else verdict("faster at that scheme's own error", ratio, bar, at_least=True)
    )
    mine, reached = error(ends(ours(rtol, nodes))), error(scheme(needed, "LSODA", 1e-10))
    return [
        f"{scheme.__name__}, 200 cells, BDF: {1e3 * both['theirs']:.0f} ms, error {theirs:.1e}",
        f"  plastica, {nodes} nodes, rtol {rtol:g}: {1e3 * both['ours']:.2f} ms, error {mine:.1e}",
        f"  {said}",
        f"  their order {order:.2f}; cells for 1e-6: {needed} (error there: {reached:.1e})",
    ]


def main() -> None:
    print(f"one solve to t = 100 ({machine()})")
    schemes = [*against_finite_differences(peers.trapezoids, 20.0), *against_finite_differences(peers.midpoints, None)]
    for line in [*against_scipy(), *schemes]:
        print(line)
