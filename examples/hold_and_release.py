"""Hold, release, hold again: a solution goes on under another load.

The PMMA strip of pmma_strip.toml (numbers and sources there), step by step as in the rig: under 0.9 N for a day,
without load for a day, and under the same thrust for another day. Each run starts from the last state of the one
before, and the clock goes on.

You should see: a set of 0.9 1/m after the first day, hardly more after the day of rest (for the first minute, while
the strip is still bent, it goes on yielding; then the natural curvature does not move at all, for the pull of its
preference is far below the threshold), and almost twice the set after the second day of thrust.
"""

import plastica as pl

DAY = 86400.0

specimen = pl.Specimen(
    length="250 mm",
    youngs_modulus="3.3 GPa",
    section={"shape": "rectangle", "width": "20 mm", "thickness": "1.5 mm"},
    retardation_time="5 min",
)
material = pl.Material(
    preference="k*m**2/2",
    flow="c*pos(x)**2",
    threshold="h",
    parameters={"k": "0.0056 N*m**2", "c": "0.39 1/(N**2*m**5*s)", "h": "0.01875 N*m**2"},
)
loaded = pl.Strut(material, pl.Load(thrust="0.9 N"), pl.Grid(nodes=24), specimen)
free = loaded.with_load(pl.Load())

held = pl.solve(loaded, curvature=0.1, natural_curvature="0.1 1/m", until=DAY)
rested = pl.solve(free, start=held, until=2 * DAY)
again = pl.solve(loaded, start=rested, until=3 * DAY)

for name, sol in (("held", held), ("rested", rested), ("held again", again)):
    last = sol.dataset.isel(t=-1)
    print(
        f"{name:10} at {float(last.t) / DAY:.0f} d: natural curvature {float(last.natural_curvature):.4f} 1/m, "
        f"free end {1000 * float(last.tip_y):5.1f} mm off the axis"
    )

sets = [float(sol.dataset.natural_curvature[-1]) - 0.1 for sol in (held, rested, again)]
assert abs(sets[0] - 0.90) < 0.01
assert 0.0 <= sets[1] - sets[0] < 0.005, "while the strip straightens it still yields for about a minute"
assert sets[2] > 1.5 * sets[0]
assert float(rested.dataset.t[0]) == DAY
