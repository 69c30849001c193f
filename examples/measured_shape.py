"""The initial shape from measured points, as read off a photograph.

measured_strip.csv holds 26 points (x, y) on the centre line of a strip of 250 mm, every 10 mm of its length, with a
scatter of 0.05 mm. The points are made up (`points` below makes them), so that we know the curvature that they have
been taken from: 5 cos(pi s/2L) + 0.8 sin(2 pi s/L) in 1/m. measured_strip.toml takes them as its initial curvature.

You should see: a curvature found again to within 0.17 1/m rms, a thirtieth of its largest value, though the scatter
alone turns the chord between two points by 0.007 rad and the bend by 0.05 rad at most; and a free end within 1 mm of
the true one, 125 mm off the axis, for such points do not tell the direction at the clamp any better.
"""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

import plastica as pl
from plastica.study.measured import measured_shape

LENGTH = 0.25
SCATTER = 0.05e-3
FILE = Path(__file__).with_name("measured_strip.csv")


def curvature(s: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the curvature (1/m) that the points have been taken from."""
    return 5.0 * np.cos(np.pi * s / (2 * LENGTH)) + 0.8 * np.sin(2 * np.pi * s / LENGTH)


def centre_line(count: int) -> NDArray[np.float64]:
    """Return points (x, y) in m, evenly spaced along the strip, by integrating twice on a fine grid."""
    s = np.linspace(0.0, LENGTH, 100_001)
    step = s[1]
    angle = np.concatenate([[0.0], np.cumsum(0.5 * step * (curvature(s)[1:] + curvature(s)[:-1]))])
    turns = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    line = np.concatenate([[[0.0, 0.0]], np.cumsum(0.5 * step * (turns[1:] + turns[:-1]), axis=0)])
    return line[:: (s.size - 1) // (count - 1)]


def points() -> NDArray[np.float64]:
    """Return the made-up measurement, in mm."""
    scatter = np.random.default_rng(2).normal(scale=SCATTER, size=(26, 2))
    return np.round(1000 * (centre_line(26) + scatter), 3)


shape = measured_shape(FILE, "x, y", LENGTH, si=True)
print(shape.words)

places = np.linspace(0.0, LENGTH, 501)
departure = float(np.sqrt(np.mean((np.asarray(shape.function(places)) - curvature(places)) ** 2)))
print(f"the curvature found departs from the true one by {departure:.3f} 1/m rms")

specimen = pl.Specimen(length=LENGTH, bending_stiffness=0.0185625, retardation_time="5 min")
material = pl.catalogue.material("never-yields", length=specimen.L, stiffness=specimen.EI, time=specimen.T)
sol = pl.solve(pl.Strut(material, pl.Load(), pl.Grid(nodes=24), specimen), curvature=shape, until="1 hour")
first = sol.dataset.isel(t=0)
tip = np.array([float(first.tip_x), float(first.tip_y)])
print(f"the free end begins {1000 * tip[1]:.2f} mm off the axis; in truth {1000 * centre_line(26)[-1, 1]:.2f} mm")

assert np.allclose(np.loadtxt(FILE, delimiter=",", skiprows=1), points(), rtol=0.0, atol=0.0011), "the file is ours"
assert departure < 0.2
assert np.hypot(*(tip - centre_line(26)[-1])) < 1e-3
