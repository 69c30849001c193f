"""A plucked strip: a steel strip is drawn aside at its free end, and let go.

The strip is 250 mm long, 20 mm wide and 1 mm thick, clamped at one end, with the Young's modulus (210 GPa) and density
(7850 kg/m**3) of any table of steels. Its damping is of the Kelvin-Voigt kind, M = EI (mu - mu_nat + nu mu_t): mode k
decays with the damping ratio zeta = nu omega_k/2. Here nu is chosen so that the first mode has 2 %, much for steel
alone, but not for a strip in a vice. The natural curvature never moves in this example: steel that is bent within its
elastic range remembers nothing.

The clamped-free beam has omega_1 = 1.8751040687**2 (EI/(rho A L**4))**(1/2), here 13.4 Hz. Drawn aside by 0.7 mm the
strip is that beam: each swing takes 2 pi/(omega_1 (1 - zeta**2)**(1/2)) and is exp(-2 pi zeta/(1 - zeta**2)**(1/2)) as
wide as the one before. The rotary inertia, which comes with the density, makes it slower by 3 millionths. Drawn aside
by 161 mm, two thirds of its length, it is not: the first swing is shorter by 0.7 % and keeps more of its width. And the
clamp, which bore no force along its tangent while the strip was held across it, bears one when the mass is set going.

You should see: for the small pluck the period to 3 millionths and the decay to 5 digits, once the higher modes of the
pluck have died out in the first swing; for the wide one a first period of 0.993 of that, and up to 15.6 N along the
clamp, just after the release. Nothing is lost but to viscosity: the ledger balances.
"""

from itertools import pairwise

import numpy as np

import plastica as pl

ZETA = 0.02

section = {"shape": "rectangle", "width": "20 mm", "thickness": "1 mm"}
steel = {"length": "250 mm", "youngs_modulus": "210 GPa", "section": section, "density": "7850 kg/m**3"}
# Without viscosity the scale of time is (rho A L**4/EI)**(1/2): what omega_1 is measured in.
omega = 1.8751040687**2 / pl.Specimen(**steel).T
specimen = pl.Specimen(**steel, retardation_time=2 * ZETA / omega)
material = pl.catalogue.material("never-yields", length=specimen.L, stiffness=specimen.EI, time=specimen.T)
free = pl.Rod(material, pl.Load(), pl.Grid(nodes=8), specimen)

period = 2 * np.pi / omega / np.sqrt(1 - ZETA**2)
decay = np.exp(-2 * np.pi * ZETA / np.sqrt(1 - ZETA**2))


def swings(force: str) -> tuple[pl.Solution, np.ndarray, np.ndarray]:
    """Return the motion after a force is let go, and the lengths (s) and widths (m) of its swings."""
    held = pl.rest(free.with_load(pl.Load(transverse=force)))
    # A grid of times as fine as this tells where the free end passes the axis, and how far it goes between.
    t = np.linspace(0.0, 5.25 * period, 20_001)
    sol = pl.solve(free, curvature=held.to_dataset().curvature.values, until=t[-1], times=t, rtol=1e-7)
    tip = sol.dataset.tip_y.values
    up = np.flatnonzero((tip[:-1] < 0.0) & (tip[1:] >= 0.0))
    crossing = t[up] - tip[up] * (t[1] - t[0]) / (tip[up + 1] - tip[up])
    width = np.array([tip[i:j].max() for i, j in pairwise(up)])
    return sol, np.diff(crossing), width


print(f"linear beam: {1 / period:.3f} Hz, each swing {decay:.5f} of the one before")
small, lengths, widths = swings("0.05 N")
wide, first, further = swings("20 N")
for sol, long, broad in ((small, lengths, widths), (wide, first, further)):
    aside = 1000 * float(sol.dataset.tip_y[0])
    print(
        f"drawn aside by {aside:6.2f} mm: periods {np.array2string(long / period, precision=6)} "
        f"of that, swings {np.array2string(broad[1:] / broad[:-1], precision=5)} of the one before; "
        f"along the clamp up to {float(np.abs(sol.dataset.clamp_force_x).max()):.2g} N"
    )
print(wide.ledger)

assert np.abs(lengths[1:] / period - 1.0).max() < 5e-6
assert np.abs(widths[2:] / widths[1:-1] - decay).max() < 1e-5
assert abs(first[0] / period - 0.993) < 5e-4
assert 0.89 < further[1] / further[0] < 0.91
assert abs(float(np.abs(wide.dataset.clamp_force_x).max()) - 15.6) < 0.1
assert abs(wide.ledger.residual) <= 100 * wide.rtol * wide.ledger.largest_energy
