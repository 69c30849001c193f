"""A phase diagram of 400 x 400 equilibria with its curves: each point beside one symmetric eigenvalue problem."""

from __future__ import annotations

import numpy as np

import plastica as pl
from benchmarks.timing import interleaved, machine, verdict

SIDE = 400
ORDER = 16
REPEATED = 2000
MATERIALS = {
    "one shape": pl.Material("m**2/2", "pos(x)**2", "0.1"),
    "three shapes": pl.Material("0.05*m**2*(m**2 - 1.5**2)**2/1.5**4", "pos(x)**2", "0.05*(1 + m**2)"),
}


def diagram(material: pl.Material) -> pl.PhaseDiagram:
    return pl.phase_diagram(material, gamma=(0, 20), alpha=(-12, 12), shape=(SIDE, SIDE))


def eigenvalues(matrix: np.ndarray) -> None:
    for _ in range(REPEATED):
        np.linalg.eigvalsh(matrix)


def main() -> None:
    print(f"a phase diagram of {SIDE} x {SIDE} ({machine()})")
    matrix = np.random.default_rng(1).standard_normal((ORDER, ORDER))
    matrix = matrix + matrix.T
    times = interleaved(
        {
            **{name: lambda material=material: diagram(material) for name, material in MATERIALS.items()},
            "eigvalsh": lambda: eigenvalues(matrix),
        },
        5,
    )
    one = times.pop("eigvalsh") / REPEATED
    for name, taken in times.items():
        found = diagram(MATERIALS[name])
        vertices = sum(c.gamma.size for c in (*found.components, *found.folds))
        print(
            f"{name}: {taken:.2f} s, {1e6 * taken / SIDE**2:.2f} us a point beside {1e6 * one:.2f} us; {vertices} "
            f"points on {len(found.components)} limiting curves and {len(found.folds)} folds, "
            f"{'complete' if found.complete else 'not complete'}"
        )
        print("  " + verdict("time per point beside one eigvalsh of order 16", taken / SIDE**2 / one, 1.0))
