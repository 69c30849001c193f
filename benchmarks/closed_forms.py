"""A hundred thousand equilibria with tip, drive and V beside the elliptic functions alone."""

from __future__ import annotations

import numpy as np
from scipy import special

import plastica as pl
from benchmarks.timing import interleaved, machine, verdict
from plastica.equilibria import elastica

COUNT = 100_000
BAR = 10.0


def points() -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(1)
    return rng.uniform(0.1, 60.0, COUNT), rng.uniform(-15.0, 15.0, COUNT)


def elliptic_arguments(gamma: np.ndarray, alpha: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """u and m of the elliptic functions that these equilibria are made of: librating or rotating."""
    librating = alpha * alpha <= 4.0 * gamma
    u = np.where(librating, np.sqrt(gamma), 0.5 * np.abs(alpha))
    m = np.where(librating, 0.25 * alpha * alpha / gamma, 4.0 * gamma / (alpha * alpha))
    return u, m


def main() -> None:
    print(f"{COUNT} equilibria in closed form ({machine()})")
    gamma, alpha = points()
    u, m = elliptic_arguments(gamma, alpha)
    laws = pl.Material("k*m**2/2", "c*pos(x)**2", "h", {"k": 1.0, "c": 1.0, "h": 0.1}).laws()

    def ours() -> tuple[np.ndarray, ...]:
        end = elastica.ends(gamma, alpha)
        return end.x, end.y, elastica.drive(end, laws), elastica.liapunov(end, gamma, alpha, laws)

    times = interleaved({"plastica": ours, "scipy.special.ellipj": lambda: special.ellipj(u, m)})
    mine, theirs = times.values()
    print("  " + ", ".join(f"{name} {1e3 * value:.1f} ms" for name, value in times.items()))
    print("  " + verdict("with tip, drive and V, against ellipj alone", mine / theirs, BAR))
    single = interleaved({"one": lambda: [elastica.ends(3.0, 1.2) for _ in range(100)]})["one"] / 100
    print(f"  one equilibrium at a time: {1e6 * single:.0f} us, in the array {1e6 * mine / COUNT:.2f} us")
