"""At a fold a rod without any unstable direction waits long, and then snaps to a far shape.

At gamma = 5 the curve of equilibria turns back in natural curvature at alpha = 2.4367: theta_0'(1) = 0 there. With a
threshold of 5 EI the fold is an equilibrium of the whole rod, |D| < Theta, and no eigenvalue is positive. The paper's
proposition would have it stable. But with the natural curvature less by delta than the fold's there is no equilibrium
near it any more. Along the kernel, alpha' = c1 (mu_nat - mu_nat*) + c2 (alpha - alpha*)^2 with

    c1 = int theta_0' / int theta_0'^2,    c2 = -(gamma/2) int sin(phi) theta_0^3 / int theta_0'^2,

so the rod passes in the time pi/(2 sqrt(|c1 c2| delta)), however long that is, and ends on the other side: alpha near
-4.52, 4.4 away. With the natural curvature greater by delta it stays, at a distance like delta^(1/2).

You should see: ten times the waiting for a hundredth of the disturbance, to the digits of the law, and always the same
far end.
"""

import numpy as np

import plastica as pl

GAMMA, FOLD = 5.0, 2.436718083268652759  # both to 34 digits by ball arithmetic
END = -4.517984  # the limit for small delta
GRID = pl.Grid(nodes=24)

material = pl.Material("m**2/2", "pos(x)**2", "5.0")
fold = pl.equilibrium(material, GAMMA, FOLD)
assert abs(fold.mu_nat + 1.0492296135920522) < 1e-13
assert abs(fold.theta0_end[1]) < 1e-13
assert fold.admissible
assert pl.spectrum(fold).unstable == 0

w, s = GRID.w, GRID.s
tangent = fold.theta0_slope(s)
norm = w @ tangent**2
c1 = float(w @ tangent / norm)
c2 = float(-0.5 * GAMMA * (w @ (np.sin(fold.phi(s)) * fold.theta0(s) ** 3)) / norm)
print(f"c1 = {c1:.6f}, c2 = {c2:.6f}")
assert abs(c1 - 1.363198) < 1e-6
assert abs(c2 + 0.426174) < 1e-6

strut = pl.Strut(material, pl.Load(thrust=GAMMA), GRID)


def escape(delta: float) -> tuple[float, float]:
    """Start at the fold's shape with less natural curvature: when the rod is 1 away from it, and where it ends."""
    law = np.pi / (2.0 * np.sqrt(abs(c1 * c2) * delta))
    sol = pl.solve(strut, fold.curvature(s), fold.mu_nat - delta, until=law + 100.0, rtol=1e-9)
    states = sol.history.y[sol.history.accepted]
    away = np.sqrt((states[:, : s.size] - fold.curvature(s)) ** 2 @ w)
    assert np.all(states[:, s.size] == fold.mu_nat - delta), "it never yields, to the last bit"
    end = pl.predict_limit(strut, states[-1, : s.size], float(states[-1, s.size])).equilibrium
    assert end is not None
    return float(np.interp(1.0, away, sol.history.t[sol.history.accepted])), end.alpha


for delta in (1e-4, 1e-6):
    law = np.pi / (2.0 * np.sqrt(abs(c1 * c2) * delta))
    when, alpha = escape(delta)
    print(f"delta {delta:.0e}: passes at t = {when:.1f} (law {law:.1f}), ends at alpha = {alpha:.5f}")
    assert abs(when - law) < 1.0
    assert abs(alpha - END) < 1e-4

delta = 1e-4
end = pl.omega_limit(strut, fold.curvature(s), fold.mu_nat + delta).equilibrium
assert end is not None
print(f"delta -1e-04: stays, at alpha = {end.alpha:.6f}")
assert abs(end.alpha - 2.4545647) < 1e-6
