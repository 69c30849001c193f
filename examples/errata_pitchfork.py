"""At Euler's load a small disturbance is not answered in proportion, and does not fade exponentially.

The paper's proposition on the curve of equilibria promises both wherever no eigenvalue is positive, and names the
straight rod up to gamma = pi^2/4. It holds below pi^2/4 only. At pi^2/4 the eigenvalue 0 is double, and the amplitude A
of cos(pi s/2), the shape in which the rod would buckle, obeys to leading order

    A' = (4/pi) mu_nat - A^3 / (2 pi^2).

From a natural curvature delta alone the rod ends at A = (8 pi delta)^(1/3): its distance from the straight rod is
(8 pi)^(1/3)/sqrt(2) delta^(1/3) = 2.0713 delta^(1/3), 20 000 times a delta of 1e-6. From a bow A_0 without natural
curvature it straightens like A = (1/A_0^2 + t/pi^2)^(-1/2), that is like pi/sqrt(t).

You should see: the ratio of distance to delta^(1/3) settle at 2.0713, the ratio to delta grow without end; an
exponent of -1/2 in the decay.
"""

import numpy as np

import plastica as pl

EULER = np.pi**2 / 4.0
LAW = (8.0 * np.pi) ** (1.0 / 3.0) / np.sqrt(2.0)

material = pl.Material("m**2/2", "pos(x)**2", "0.1")
strut = pl.Strut(material, pl.Load(thrust=EULER), pl.Grid(nodes=16))

for delta in (1e-4, 1e-5, 1e-6):
    # the slowest rate at the end is 3 A^2 / (2 pi^2)
    amplitude = (8.0 * np.pi * delta) ** (1.0 / 3.0)
    sol = pl.solve(strut, 0.0, delta, until=20.0 * 2.0 * np.pi**2 / (3.0 * amplitude**2), rtol=1e-8)
    last = sol.history.y[-1]
    assert last[16] == delta, "the drive stays within the threshold, so the natural curvature keeps every bit"
    distance = float(np.sqrt(strut.grid.w @ last[:16] ** 2 + delta**2))
    ratio = distance / delta ** (1.0 / 3.0)
    print(f"delta {delta:.0e}: ends {distance:.6f} away, {ratio:.5f} delta^(1/3), {distance / delta:.0f} delta")
    assert abs(ratio - LAW) < 3.0 * delta ** (2.0 / 3.0) + 1e-4

sol = pl.solve(strut, "0.1*cos(pi*s/2)", 0.0, until=1e5, times=[1e2, 1e3, 1e4, 1e5], rtol=1e-10)
shape = np.cos(0.5 * np.pi * strut.grid.s)
found = 2.0 * (sol.y[:, :16] @ (strut.grid.w * shape))
said = (100.0 + sol.t / np.pi**2) ** -0.5
for t, a, law in zip(sol.t, found, said, strict=True):
    print(f"t = {t:.0e}: bow {a:.6f}, law {law:.6f}")
exponent = np.log(found[-1] / found[-2]) / np.log(10.0)
print(f"exponent of the decay from 1e4 to 1e5: {exponent:.3f}")
assert np.all(np.abs(found / said - 1.0) < 1e-4)
assert -0.5 < exponent < -0.47
