"""Creep buckling: a strut that stands for a long time below its Euler load, and then does not.

A rod with k = EI and h = 0.1 EI (the catalogue's one-shape material), under a dead thrust of 2 EI/L**2: 81 % of its
Euler load. Elastically it would stand. But an imperfection (a natural curvature, here) bends it a little, the bend
drives the natural curvature, and beyond a certain imperfection no equilibrium is left near the straight shape: the
rod creeps, slower and slower as it passes the place where it would nearly have come to rest, and then faster, until
it is wide off its axis. Below that imperfection it stays where it is for ever.

You should see: an imperfection of 0.041/L (a bow of 2 % of the length) does not even begin to yield. One of 0.042/L,
2 % more, stands at a ninth of its length off the axis for 300 retardation times, and ends 0.73 L off it. That a strut
stands today says little about whether it stands next year.
"""

import numpy as np

import plastica as pl

THRUST = 2.0
EULER = np.pi**2 / 4

material = pl.catalogue.material("one-shape", k=1.0, c=1.0, h=0.1)
strut = pl.Strut(material, pl.Load(thrust=THRUST), pl.Grid(nodes=16))


def waiting(imperfection: float) -> tuple[pl.Solution, float]:
    """Return the motion of a rod with this natural curvature, and when its free end passes L/4 (inf: never)."""
    sol = pl.solve(strut, curvature=imperfection, natural_curvature=imperfection, until=5000.0)
    off = np.abs(sol.dataset.tip_y.values)
    passed = np.flatnonzero(off > 0.25)
    return sol, float(sol.dataset.t[passed[0]]) if passed.size else np.inf


print(f"thrust: {THRUST / EULER:.0%} of the Euler load")
stands, never = waiting(0.041)
falls, when = waiting(0.042)
for sol, moment in ((stands, never), (falls, when)):
    last = sol.dataset.isel(t=-1)
    print(
        f"natural curvature {float(sol.dataset.natural_curvature[0]):.3f}/L: {sol.outcome.headline.lower()}; "
        f"free end {float(last.tip_y):.3f} L off the axis, beyond L/4 at t = {moment:.0f}"
    )

assert np.all(stands.dataset.natural_curvature.values == 0.041), "it never yields, to the last bit"
assert never == np.inf
assert 400.0 < when < 600.0
assert float(np.interp(300.0, falls.dataset.t, falls.dataset.tip_y)) < 0.15
assert abs(float(falls.dataset.tip_y[-1]) - 0.73) < 0.01
