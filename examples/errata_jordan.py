"""The eigenvalue 0 is not always simple: Jordan blocks at folds, and at the straight rod at Euler's load.

The linearisation L at an equilibrium always has the eigenvalue 0, with the one eigenvector (theta_0', theta_0'(1)):
the equilibria form a curve, and that is its tangent. The paper calls it simple. It is, except where theta_0'(1) = 0.
There the tangent has no part in the natural curvature, and another vector is sent to it by L: a Jordan block of size
two. The linear equations then let a disturbance grow in proportion to time, and what follows from a simple
eigenvalue (a disturbance is answered in proportion, and fades exponentially) is not so: see errata_pitchfork.py and
errata_fold.py.

You should see: the kernels of L, L^2, L^3 have 1, 1, 1 dimensions beside the fold, and 1, 2, 2 at it and at the
straight rod under pi^2/4; at the fold the natural curvature disturbed by 1e-3 bends the linear rod further by the
same amount in every retardation time.
"""

import numpy as np
from scipy.optimize import brentq

import plastica as pl
from plastica.equilibria.spectrum import linearisation

FOLD = 2.436718083268652759  # at gamma = 5, to 34 digits by ball arithmetic
EULER = np.pi**2 / 4.0

material = pl.Material("m**2/2", "pos(x)**2", "0.1")
grid = pl.Grid(nodes=32)


def dimensions(gamma: float, alpha: float) -> list[int]:
    """Dimensions of the kernels of L, L^2 and L^3: singular values that are rounding beside the largest."""
    matrix = linearisation(pl.equilibrium(material, gamma, alpha), grid)
    powers = [np.linalg.svd(np.linalg.matrix_power(matrix, k), compute_uv=False) for k in (1, 2, 3)]
    return [int(np.sum(values < 1e-10 * values[0])) for values in powers]


alpha = brentq(lambda a: pl.equilibrium(material, 5.0, a).theta0_end[1], 2.0, 3.0, xtol=1e-15)
print(f"fold at gamma = 5: alpha = {alpha:.15f}")
assert abs(alpha - FOLD) < 1e-13

for words, gamma, where in (
    ("beside the fold", 5.0, alpha + 0.1),
    ("at the fold", 5.0, alpha),
    ("straight, below Euler's load", 0.9 * EULER, 0.0),
    ("straight, at Euler's load", EULER, 0.0),
):
    found = pl.spectrum(pl.equilibrium(material, gamma, where))
    dims = dimensions(gamma, where)
    print(f"{words:30s} kernels of L, L^2, L^3: {dims}; multiplicity {found.zero_multiplicity}")
    expected = 2 if words.startswith("at") or words.endswith("at Euler's load") else 1
    assert dims == [1, expected, expected]
    assert found.zero_multiplicity == expected
    assert found.unstable == 0

# In the linear equations the part c = <theta_0', 1> / |theta_0'|^2 of a disturbed natural curvature is added per unit
# of time along the kernel, for ever.
n, delta = grid.size, 1e-3
matrix = linearisation(pl.equilibrium(material, 5.0, alpha), grid)
tangent = pl.equilibrium(material, 5.0, alpha).theta0_slope(grid.s)
rate = delta * (grid.w @ tangent) / (grid.w @ tangent**2)
state, step = np.zeros(n + 1), 0.25
state[n] = delta
along = []
for _ in range(400):
    state = np.linalg.solve(np.eye(n + 1) - 0.5 * step * matrix, (np.eye(n + 1) + 0.5 * step * matrix) @ state)
    along.append((grid.w @ (tangent * state[:n])) / (grid.w @ tangent**2))
print(f"clamp curvature of the linear rod after 50 and 100 retardation times: {along[199]:.6f}, {along[399]:.6f}")
assert abs(along[199] - 50.0 * rate) < 1e-9
assert abs(along[399] - 100.0 * rate) < 1e-9
