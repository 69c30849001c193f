"""A first run: a strut under more than its Euler load, and whether it would come back.

Everything is dimensionless: lengths in units of the rod's length L, forces in EI/L**2, times in retardation times.
The rod prefers to be straight (stiffness k of that preference), its natural curvature starts to move when the drive
exceeds the threshold h, and moves the faster the larger the excess (speed c). The thrust is 3, the Euler load of a
clamped strut is pi**2/4 = 2.47.

You should see: "Buckles and takes a permanent set". The natural curvature has reached 1.154/L at t = 100 and
creeps on, like 1/t; and the work of the thrust is accounted for as stored energy, viscous dissipation and dissipation
by yielding, up to a residual of the size of the tolerance.
"""

import plastica as pl

material = pl.Material(
    preference="k*m**2/2", flow="c*pos(x)**2", threshold="h", parameters={"k": 1.0, "c": 1.0, "h": 0.1}
)
strut = pl.Strut(material, pl.Load(thrust=3.0), pl.Grid(nodes=16))
sol = pl.solve(strut, curvature="1 + cos(3*s)", natural_curvature=0.0, until=100.0)

print(sol)
natural_curvature = float(sol.dataset.natural_curvature[-1])
print(f"natural curvature at the end: {natural_curvature:.6f} /L")

assert sol.outcome.headline == "Buckles and takes a permanent set"
assert abs(natural_curvature - 1.154052424) < 100 * sol.rtol
assert abs(sol.ledger.residual) <= 100 * sol.rtol * sol.ledger.largest_energy
