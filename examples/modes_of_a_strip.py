"""How stiff is it still? The pitch of a strip under thrust tells how far it is from buckling, before it buckles.

The strip of steel is 300 mm long, 20 mm wide and 1 mm thick, clamped below, with a dead thrust at its free end. Young's
modulus (210 GPa) and density (7850 kg/m**3) are those of any table of steels; the retardation time (0.2 ms) is chosen.
A thrust takes away stiffness, not mass: the square of the first frequency falls nearly along a straight line, and is 0
at Euler's load. Frequencies measured below 70 % of that load, laid on a line, foretell it: the test that structural
engineers know as vibration correlation. Damping, which the thrust leaves as it is, matters the more the slower the
strip swings: the damping ratio grows as the frequency falls.

A strip that is not quite straight, here with a natural bow of 3 mm in the middle of its chord, does not reach 0: the
thrust bends it, the bend stiffens it, and its frequency goes through a minimum.

You should see: 9.28 Hz without thrust (the handbook's 1.8751**2/(2 pi L**2) (EI/(rho A))**(1/2)), 5.23 Hz at 70 % of
Euler's load, 0 at it. A straight line through five points foretells the load 3 % too high, a parabola 0.3 %. The
damping ratio rises from 0.58 % to 1.08 %. The bowed strip is slowest at 0.9 Euler loads, with 4.1 Hz.
"""

import numpy as np

import plastica as pl

EULER = np.pi**2 / 4

section = {"shape": "rectangle", "width": "20 mm", "thickness": "1 mm"}
strip = pl.Specimen(
    length="300 mm", youngs_modulus="210 GPa", section=section, density="7850 kg/m**3", retardation_time="0.2 ms"
)
material = pl.catalogue.material("never-yields", length=strip.L, stiffness=strip.EI, time=strip.T)


def first(share: float, bow: float = 0.0) -> pl.Modes:
    """Return the first mode at a share of Euler's load, of a strip with a natural curvature (1/m)."""
    load = pl.Load(thrust=share * EULER * strip.scales.force)
    rod = pl.Rod(material, load, pl.Grid(16), strip)
    return pl.modes(rod, pl.rest(rod, bow, bow), count=1)


shares = np.array([0.0, 0.2, 0.4, 0.6, 0.7])
straight = [first(share) for share in shares]
hertz = np.array([float(each.hertz[0]) for each in straight])
ratios = np.array([float(each.damping_ratios[0]) for each in straight])
print("share of Euler's load ", *(f"{share:7.1f}" for share in shares))
print("first frequency (Hz)  ", *(f"{value:7.3f}" for value in hertz))
print("damping ratio (%)     ", *(f"{100 * value:7.3f}" for value in ratios))

line = np.polyfit(shares, hertz**2, 1)
parabola = np.polyfit(shares, hertz**2, 2)
by_line, by_parabola = -line[1] / line[0], min(abs(np.roots(parabola)))
print(f"Euler's load foretold: {by_line:.4f} by a line, {by_parabola:.5f} by a parabola")

bow = 8 * 3e-3 / strip.L**2
bowed_shares = np.linspace(0.0, 1.6, 33)
bowed = np.array([float(first(share, bow).hertz[0]) for share in bowed_shares])
slowest = int(bowed.argmin())
print(f"bowed by 3 mm: slowest at {bowed_shares[slowest]:.2f} Euler loads, {bowed[slowest]:.2f} Hz")

handbook = 1.8751040687**2 / (2 * np.pi * strip.L**2) * np.sqrt(strip.EI / (7850.0 * 20e-3 * 1e-3))
assert abs(hertz[0] - handbook) < 1e-5 * handbook
assert abs(hertz[-1] - 5.228) < 1e-3
assert abs(by_line - 1.029) < 1e-3
assert abs(by_parabola - 1.0027) < 1e-4
assert first(1.0).hertz[0] < 1e-4
assert abs(100 * ratios[-1] - 1.075) < 1e-3
assert abs(bowed_shares[slowest] - 0.9) < 0.03
assert abs(bowed[slowest] - 4.14) < 0.01
