"""The long run: the limit of a finished motion, the time-one map, and the limit of a start."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from plastica.equilibria.limits import Limit, predict_limit
from plastica.equilibria.unloaded import left_without_load
from plastica.errors import ArgumentError
from plastica.motion.solve import solve
from plastica.numerics.grid import Grid
from plastica.physics.initial import Curvature
from plastica.physics.load import Load
from plastica.physics.model import Model
from plastica.physics.strut import as_strut, uniform_strut

if TYPE_CHECKING:
    from plastica.motion.solution import Solution

__all__ = ["limit_of", "natural_without_load", "omega_limit", "time_one_map"]

Array = NDArray[np.float64]

FIRST_LOOK, LAST_LOOK = 20.0, 1e7
"""Retardation times after which `omega_limit` first asks for the limit, and at which it gives up asking."""


def limit_of(solution: Solution) -> Limit | None:
    """Predict where a finished motion ends; None where no theory says so.

    That is with inertia, a damping other than 1 or several natural segments, where the loads go on varying or are
    others than a thrust, and where the grid does not resolve the motion. Once the loads have settled the theory of the
    constant thrust applies to what follows.
    """
    strut, end = as_strut(solution.model), solution.history.end
    if solution.status.code == "not_resolved":
        return None
    if strut is None or strut.loads.thrust(end) < 0.0:
        return None
    settled = strut.loads.settled
    if settled is None or settled > end or {name for name, _ in strut.loads.sources()} - {"thrust"}:
        return None
    if not strut.load.is_constant:
        strut = strut.with_load(Load(thrust=float(strut.load.thrust(end * strut.scales.time))))
    n, y = strut.grid.size, solution.history.y[-1]
    scale = strut.scales.curvature
    return predict_limit(strut, y[:n] * scale, float(y[n]) * scale, rtol=solution.rtol)


def natural_without_load(solution: Solution) -> Array:
    """Return the natural curvature that a finished motion leaves once the rod has been let go and has come to rest.

    For on the way back it may yield again: see `equilibria.unloaded`. A rod with inertia is taken to be let go so
    gently that it does not swing.

    Parameters
    ----------
    solution : Solution
        The motion.

    Returns
    -------
    ndarray, shape () or (m,)
        Dimensionless; the present natural curvature where it cannot be told.
    """
    model, state = solution.model, solution.history.y[-1]
    now = np.array(model.layout.natural(state))
    if not solution.status.ok:
        return now
    mean = model.division.mean(model.layout.mu(state))
    return left_without_load(model.laws, float(model.damping), mean, now)


def time_one_map(strut: Model, mu: ArrayLike, mu_nat: float, *, rtol: float = 1e-10) -> tuple[Array, float]:
    """Return the state one retardation time later (the paper's map Phi, section 4).

    Parameters
    ----------
    strut : Strut or Rod
        The rod, of one natural segment and without inertia, on a grid with a number of nodes, under a constant load.
    mu : array_like, shape (n,)
        Curvature at the nodes, in the user's units.
    mu_nat : float
        Natural curvature, in the user's units.
    rtol : float
        Tolerance of the integration.

    Returns
    -------
    mu : ndarray, shape (n,)
    mu_nat : float

    Raises
    ------
    ArgumentError
        Where the load varies, or the state does not fit the grid.
    """
    strut = uniform_strut(strut, "strut")
    if not strut.load.is_constant:
        raise ArgumentError("must be constant for a time-one map", where="load", value=strut.load)
    sol = solve(strut, np.asarray(mu, dtype=float), mu_nat, until=strut.scales.time, rtol=rtol)
    last, scale = sol.history.y[-1], strut.scales.curvature
    return last[: strut.grid.size] * scale, float(last[strut.grid.size]) * scale


def omega_limit(
    strut: Model,
    curvature: Curvature = 0.0,
    natural_curvature: float | str = 0.0,
    *,
    rtol: float = 1e-8,
    longest: float = LAST_LOOK,
) -> Limit:
    """Follow a start until its limit can be told: the one point of its omega-limit set (paper, theorem 4.5).

    Integrates, asks `predict_limit`, and goes on for three times as long as long as the answer is "undecided".

    Parameters
    ----------
    strut : Strut or Rod
        The rod, of one natural segment and without inertia, under a constant thrust.
    curvature, natural_curvature
        The start, as in `solve`.
    rtol : float
        Tolerance of the integration.
    longest : float
        Retardation times after which to give up.

    Returns
    -------
    Limit
        "undecided" if it could not be told within `longest`, or the integration failed.

    Raises
    ------
    ArgumentError
        Where the start cannot be used, or the load is not a constant thrust.
    """
    strut = uniform_strut(strut, "strut")
    if strut.grid.nodes == "auto":
        strut = strut.with_grid(Grid(24, strut.grid.breaks))
    later = FIRST_LOOK
    sol = solve(strut, curvature, natural_curvature, until=later * strut.scales.time, rtol=rtol)
    while (limit := limit_of(sol)) is not None:
        later *= 3.0
        if limit.kind != "undecided" or not sol.status.ok or later > longest:
            return limit
        sol = solve(sol.model, start=sol, until=later * strut.scales.time, rtol=rtol)
    raise ArgumentError("must be a constant thrust alone for a limit to exist", where="load", value=strut.load)
