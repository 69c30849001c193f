"""BEAM of the IVP test set: error against time on 8 to 24 nodes, beside the scheme of 40 cells that it was posed as.

An inextensible elastica, clamped and free, straight and at rest, is pushed at its end by the dead force (-phi, phi),
phi = 1.5 sin(t)^2 up to t = pi, and swings on without damping; rho A = EI = L = 1. Errors are those of the tip at t = 5
against the limit of the equation, found by refinement. (F. Mazzia and C. Magherini, Test set for initial value problem
solvers, release 2.4, 2008; E. Hairer and G. Wanner, Solving Ordinary Differential Equations II, section IV.10.)
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.integrate import solve_ivp
from scipy.linalg import solve_banded

import plastica as pl
from benchmarks.timing import interleaved, machine, verdict

UNTIL = 5.0
PUSH = "1.5*sin(t)**2*step(pi - t)"
NODES = (8, 12, 16, 24)
RTOL = {8: 1e-6, 12: 1e-7, 16: 1e-7, 24: 1e-7}
REPEAT = 3

PUBLISHED = {0: -0.5792366591285007e-2, 39: -0.1767201761075488, 79: 1.186724615113034}
"""Of the solution of the 40-cell scheme at t = 5: first and last angle, last angular velocity."""


def ours(nodes: int, rtol: float, method: str = "auto") -> np.ndarray:
    material = pl.Material("m**2/2", "pos(x)**2", "1000")
    rod = pl.Rod(
        material, pl.Load(thrust=PUSH, transverse=PUSH), pl.Grid(nodes), translational_inertia=1.0, damping=0.0
    )
    sol = pl.solve(rod, until=UNTIL, rtol=rtol, method=method)
    theta = sol.model.angle(sol.model.layout.mu(sol.history.y[-1]))
    return np.array([np.cos(theta) @ sol.grid.w, np.sin(theta) @ sol.grid.w])


def cells(count: int, rtol: float, method: str = "Radau") -> np.ndarray:
    """The scheme: masses and angles lumped at the middle of each cell; state (angles, angular velocities).

    With G the matrix of n + 1/2 - max(l, k), moments balance as (G o cos) theta_tt + (G o sin) theta_t^2 = v, entry by
    entry with cos and sin of theta_l - theta_k. G has a tridiagonal inverse: one tridiagonal solution does it.
    """
    n = count

    def rate(t: float, y: np.ndarray) -> np.ndarray:
        theta, spin = y[:n], y[n:]
        push = 1.5 * np.sin(t) ** 2 if t <= np.pi else 0.0
        bent = np.empty(n)
        bent[0] = theta[1] - 3.0 * theta[0]
        bent[1:-1] = theta[:-2] - 2.0 * theta[1:-1] + theta[2:]
        bent[-1] = theta[-2] - theta[-1]
        v = n**4 * bent + n**2 * push * (np.cos(theta) + np.sin(theta))
        turn = theta[:-1] - theta[1:]
        diagonal = np.full(n, 2.0)
        diagonal[0], diagonal[-1] = 1.0, 3.0
        cos, sin = -np.cos(turn), -np.sin(turn)
        w = spin**2
        w[:-1] += sin * v[1:]
        w[1:] -= sin * v[:-1]
        u = solve_banded((1, 1), np.array([[0.0, *cos], diagonal, [*cos, 0.0]]), w)
        out = np.empty(2 * n)
        out[:n] = spin
        out[n:] = diagonal * v
        out[n:-1] += cos * v[1:] + sin * u[1:]
        out[n + 1 :] += cos * v[:-1] - sin * u[:-1]
        return out

    y = np.zeros(2 * n)
    for start, end in ((0.0, np.pi), (np.pi, UNTIL)):
        y = solve_ivp(rate, (start, end), y, method=method, rtol=rtol, atol=1e-3 * rtol).y[:, -1]
    return np.asarray(y)


def tip(y: np.ndarray) -> np.ndarray:
    theta = y[: y.size // 2]
    return np.array([np.cos(theta).mean(), np.sin(theta).mean()])


def main() -> None:
    print(f"BEAM to t = {UNTIL:g} ({machine()})")
    y = cells(40, 1e-11, "DOP853")
    off = max(abs(y[place] - value) for place, value in PUBLISHED.items())
    print(f"  the 40-cell scheme against its published solution: {off:.0e} {'met' if off <= 1e-8 else 'MISSED'}")
    limit, coarser = ours(16, 1e-9), ours(24, 1e-8)
    spread = float(np.abs(limit - coarser).max())
    print(f"  the limit by refinement: tip ({limit[0]:.9f}, {limit[1]:.9f}), two refinements differ by {spread:.0e}")

    def error(found: np.ndarray) -> float:
        return float(np.abs(found - limit).max())

    runs: dict[str, Callable[[], np.ndarray]] = {}
    for nodes in NODES:
        for method in ("auto", "Radau"):
            name = f"{nodes:2d} nodes, {'Gauss (auto)' if method == 'auto' else method}, rtol {RTOL[nodes]:g}"
            runs[name] = lambda nodes=nodes, method=method: ours(nodes, RTOL[nodes], method)
    scheme = "40 cells, Radau, rtol 1e-06"
    runs[scheme] = lambda: tip(cells(40, 1e-6))
    errors = {name: error(run()) for name, run in runs.items()}
    times = interleaved(runs, REPEAT)
    for name, taken in times.items():
        print(f"  {name}: error {errors[name]:.1e}, {taken:.2f} s")
    first = next(iter(runs))
    print("  " + verdict(f"error of {first} against 1e-6", errors[first] / 1e-6, 1.0))
    print("  " + verdict("its time against the 40 cells", times[first] / times[scheme], 1.0))
