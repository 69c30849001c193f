"""Hysteresis: a strut that is bent to and fro by a couple, and what every cycle costs.

An end couple bends the rod into arcs: couple and curvature are the same all along it, and the moment-curvature diagram
of one place is that of the rod. The couple goes to and fro between -1.5 and 1.5 EI/L, beyond the threshold h = 0.5 EI;
the preference k = 0.5 EI pulls the natural curvature back as it grows.

In infinitely slow cycles the rod yields at |M - k mu_nat| = h. The diagram is then a parallelogram: elastic sides of
slope EI and yielding ones of slope EI k/(EI + k). Its area is 4 h (M_max - h)/k = 4 EI/L: what a cycle costs.
At finite speed it costs more: the drive must exceed the threshold for the natural curvature to move at all, by
(rate/c)**(1/2) for this flow law, and viscosity takes a share too.

You should see: the area of the loop is the work of the couple is what is dissipated, and tends to 4 as the
cycles get slower: 5.364, 4.602, 4.178 for 100, 1000 and 10 000 retardation times a cycle. What is too much falls
like the square root of the speed, so that the last two tell the limit. The share of viscosity falls with the speed.
"""

import numpy as np

import plastica as pl

LARGEST, K, H = 1.5, 0.5, 0.5
SLOW = 4 * H * (LARGEST - H) / K

material = pl.catalogue.material("one-shape", k=K, c=1.0, h=H)


def cycle(period: float) -> tuple[float, float, float]:
    """Return area, dissipation and its viscous part of the fourth cycle, when one is like another."""
    load = pl.Load(couple=pl.programs.cycles(-LARGEST, LARGEST, period, count=4, shape="triangle"))
    sol = pl.solve(pl.Strut(material, load, pl.Grid(nodes=4)), until=4 * period)
    last = sol.dataset.sel(t=slice(3 * period * (1 - 1e-12), None))
    area = float(np.trapezoid(last.couple.values[:, 0], last.curvature.values[:, 0]))
    names = ("viscous_dissipation", "natural_dissipation")
    viscous, natural = (float(last[name][-1] - last[name][0]) for name in names)
    assert np.ptp(last.curvature.values, axis=1).max() < 1e-12, "the rod is an arc"
    assert abs(float(last.work[-1] - last.work[0]) - viscous - natural) < 1e-6, "nothing is stored over a cycle"
    return area, viscous + natural, viscous


excess = []
for period in (100.0, 1000.0, 10_000.0):
    area, dissipated, viscous = cycle(period)
    excess.append(dissipated - SLOW)
    print(
        f"a cycle in {period:6.0f} retardation times: area of the loop {area:.4f}, dissipated {dissipated:.4f} EI/L, "
        f"of which {viscous:.4f} by viscosity; infinitely slow {SLOW:.4f}"
    )
    assert abs(area - dissipated) < 1e-3

limit = (np.sqrt(10.0) * excess[2] - excess[1]) / (np.sqrt(10.0) - 1.0) + SLOW
print(f"the last two, continued to speed 0: {limit:.3f}")
assert abs(limit - SLOW) < 0.03
assert np.allclose(excess, [1.364, 0.602, 0.178], atol=5e-4)
