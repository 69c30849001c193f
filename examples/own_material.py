"""A material of one's own: three laws as text, and what the theory asks of them.

The preference and the threshold are written in m (natural curvature), the flow in x (excess drive). The hypotheses
are judged before anything is solved, each with a margin, and with a witness where it fails: here a first attempt at
a rod that yields more easily to one side is refused in two places, and mended.

You should see: the uneven threshold and the flow with a corner at 0 named, with a place where each fails; and a run
of the mended material, whose threshold grows with the natural curvature by a saturating law.
"""

import plastica as pl

attempt = pl.Material(
    preference="k*m**2/2",
    flow="c*pos(x)",
    threshold="h*(1 + tanh(m)/2)",
    parameters={"k": 0.5, "c": 1.0, "h": 0.2},
)
failed = [verdict for verdict in attempt.admissibility() if not verdict.holds]
for verdict in failed:
    print(f"refused: {verdict.sentence}")
assert len(failed) == 2
assert all(verdict.witness is not None for verdict in failed)

mended = pl.Material(
    preference="k*m**2/2",
    flow="c*pos(x)**2",
    threshold="h*(1 + tanh(m)**2/2)",
    parameters={"k": 0.5, "c": 1.0, "h": 0.2},
)
assert all(verdict.holds for verdict in mended.admissibility())

sol = pl.solve(pl.Strut(mended, pl.Load(thrust=2.8)), curvature=0.1, until=1000.0)
print(sol.outcome.sentence)
print(sol.outcome.distance)
assert sol.outcome.headline == "Buckles and takes a permanent set"
assert 0.0 < sol.outcome.excess < 0.01, "after a long time the drive is just above its threshold, and still creeping"
