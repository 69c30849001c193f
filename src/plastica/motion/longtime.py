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
from plastica.physics.strut import Strut, uniform_strut

if TYPE_CHECKING:
    from plastica.motion.solution import Solution

__all__ = ["limit_of", "natural_without_load", "omega_limit", "time_one_map"]

Array = NDArray[np.float64]

FIRST_LOOK, LAST_LOOK = 20.0, 1e7
"""Retardation times after which `omega_limit` first asks for the limit, and at which it gives up asking."""


def limit_of(solution: Solution) -> Limit | None:
    """Predict where a finished motion ends; None where no theory says so.

    That is with inertia, with several natural segments, and where the loads go on varying or are others than a thrust.
    Once the loads have settled the theory of the constant thrust applies to what follows.
    """
    strut, end = solution.model, solution.history.end
    if not isinstance(strut, Strut) or strut.segments > 1 or strut.loads.thrust(end) < 0.0:
        return None
    settled = strut.loads.settled
    if settled is None or settled > end or {name for name, _ in strut.loads.sources()} - {"thrust"}:
        return None
    if not strut.load.is_constant:
        strut = strut.with_load(Load(thrust=float(strut.load.thrust(end * strut.scales.time))))
    n, y = strut.grid.size, solution.history.y[-1]
    return predict_limit(strut, y[:n] * strut.scales.curvature, float(y[n]) * strut.scales.curvature)


def natural_without_load(solution: Solution, *, longest: float = LAST_LOOK) -> Array:
    """Return the natural curvature that a finished motion leaves once the rod has been let go and has come to rest.

    A strut's motion is followed without its loads, for on the way back it may yield again: with one segment until the
    limit can be told, with several, which then no longer know of each other, until each has relaxed onto its natural
    shape. A rod with inertia is taken to be let go so slowly that it does not swing.

    Parameters
    ----------
    solution : Solution
        The motion.
    longest : float
        Retardation times after which to give up.

    Returns
    -------
    ndarray, shape () or (m,)
        Dimensionless; the present natural curvature where it cannot be told.
    """
    strut, end = solution.model, solution.history.end
    now = np.array(strut.layout.natural(solution.history.y[-1]))
    if not solution.status.ok:
        return now
    if not isinstance(strut, Strut):
        return left_without_load(strut.laws, now)
    known = solution.limit if all(program(end) == 0.0 for _, program in strut.loads.items()) else None
    if known is None or known.kind == "undecided":
        until = (end + FIRST_LOOK) * strut.scales.time
        sol = solve(strut.with_load(Load()), start=solution, until=until, rtol=max(1e-8, solution.rtol))
        if strut.segments > 1:
            return left_without_load(strut.laws, strut.layout.natural(sol.history.y[-1])) if sol.status.ok else now
        known, sol = _waited(sol, end, longest)
        known = known if sol.status.ok else None
    if known is None or known.equilibrium is None:
        return now
    # An interior limit is a natural curvature that never moves again: its bits are those of the last state.
    moves = known.kind == "limiting" or abs(known.equilibrium.mu_nat - float(now)) > 1e-9
    return np.array(known.equilibrium.mu_nat) if moves else now


def _waited(sol: Solution, since: float, longest: float) -> tuple[Limit | None, Solution]:
    """Go on three times as long, counted from `since`, while the limit is undecided and the integration goes well."""
    later = FIRST_LOOK
    while True:
        limit = limit_of(sol)
        later *= 3.0
        if limit is None or limit.kind != "undecided" or not sol.status.ok or later > longest:
            return limit, sol
        sol = solve(sol.model, start=sol, until=(since + later) * sol.model.scales.time, rtol=sol.rtol)


def time_one_map(strut: Strut, mu: ArrayLike, mu_nat: float, *, rtol: float = 1e-10) -> tuple[Array, float]:
    """Return the state one retardation time later (the paper's map Phi, section 4).

    Parameters
    ----------
    strut : Strut
        The rod, on a grid with a number of nodes, under a constant load.
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
    uniform_strut(strut, "strut")
    if not strut.load.is_constant:
        raise ArgumentError("must be constant for a time-one map", where="load", value=strut.load)
    sol = solve(strut, np.asarray(mu, dtype=float), mu_nat, until=strut.scales.time, rtol=rtol)
    last, scale = sol.history.y[-1], strut.scales.curvature
    return last[: strut.grid.size] * scale, float(last[strut.grid.size]) * scale


def omega_limit(
    strut: Strut,
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
    strut : Strut
        The rod under a constant thrust.
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
    uniform_strut(strut, "strut")
    if strut.grid.nodes == "auto":
        strut = strut.with_grid(Grid(24, strut.grid.breaks))
    sol = solve(strut, curvature, natural_curvature, until=FIRST_LOOK * strut.scales.time, rtol=rtol)
    limit, _ = _waited(sol, 0.0, longest)
    if limit is None:
        raise ArgumentError("must be a constant thrust alone for a limit to exist", where="load", value=strut.load)
    return limit
