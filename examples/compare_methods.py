"""Which method: the same motion by all four, how far they agree, and what each costs.

The strut of first_run.py, to t = 100. The rod is not stiff as long as it does not yield fast, so that all four
methods work; LSODA ("auto") switches between a non-stiff and a stiff one, and is the one to take unless you know
better. DOP853 takes few steps but many evaluations; Radau and BDF pay off where the flow is very fast, as in the
catalogue's rate-independent material.

You should see: the four last natural curvatures agree to within 100 tolerances, at costs that differ manifold.
"""

import plastica as pl

strut = pl.Strut(pl.catalogue.material("one-shape"), pl.Load(thrust=3.0), pl.Grid(nodes=16))
RTOL = 1e-8

found = {}
for method in ("LSODA", "DOP853", "Radau", "BDF"):
    sol = pl.solve(strut, curvature="1 + cos(3*s)", until=100.0, rtol=RTOL, method=method)
    found[method] = float(sol.dataset.natural_curvature[-1])
    print(f"{method:7} {found[method]:.12f} /L, {sol.counts.steps:5d} steps, {sol.counts.rates:6d} evaluations")

spread = max(found.values()) - min(found.values())
print(f"spread {spread:.1e}, at rtol {RTOL:.0e}")
assert spread < 100 * RTOL * max(found.values())
