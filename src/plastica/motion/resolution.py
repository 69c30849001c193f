"""Whether a grid resolves a motion: where nodes are being chosen, a run on too few is given up; else it is told."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from plastica.motion.integrate import Ending, Stop
from plastica.physics.kernel import Kernel
from plastica.physics.model import Model
from plastica.physics.resolution import largest_end_error, too_coarse
from plastica.physics.status import error_on_grid, on_grid

if TYPE_CHECKING:
    from plastica.motion.solution import Solution

__all__ = ["coarse", "on_given_nodes"]

Array = NDArray[np.float64]

ROUNDING = 100.0 * float(np.finfo(float).eps)
"""Error of a moment by rounding, relative to the force that makes it."""


def coarse(strut: Model, rtol: float, size: float) -> Stop:
    """Return the criterion that gives up a run on too few nodes; it looks at every tenth step, which is cheaper.

    Parameters
    ----------
    strut : Model
        The model on the grid in question.
    rtol : float
        The relative tail allowed.
    size : float
        Largest curvature met so far.
    """
    n, steps = strut.grid.size, 0

    def criterion(t: float, y: Array, kern: Kernel) -> Ending | None:
        nonlocal steps, size
        steps, size = steps + 1, max(size, float(np.abs(y[:n]).max()))
        return "too_coarse" if steps % 10 == 0 and too_coarse(strut, y[None, :], rtol, size) is not None else None

    return criterion


def on_given_nodes(solution: Solution, missed: float = 0.0) -> Solution:
    """Return a solution that tells what the grid, which was not chosen for it, leaves unresolved.

    The error is the largest of `end_errors` over the accepted steps, or what the nodes have `missed` of the first
    state; what is allowed is rtol, and rounding.
    """
    model, history, layout = solution.model, solution.history, solution.model.layout
    accepted = history.accepted[np.isfinite(history.y[history.accepted]).all(axis=1)]
    t, mu = history.t[accepted], layout.mu(history.y[accepted])
    error = max(largest_end_error(model, t, mu), missed)
    forces = max(float(np.abs(force).max()) for force in model.dead_force(t))
    allowed, nodes = max(solution.rtol, ROUNDING * max(1.0, forces)), model.grid.per_element
    told = error_on_grid(nodes, error, allowed)
    if not told:
        return solution
    return replace(
        solution, status=on_grid(solution.status, nodes, error, allowed), notes=(*solution.notes, told.rstrip("."))
    )
