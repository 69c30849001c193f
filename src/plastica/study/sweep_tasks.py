"""What is computed of some members of a sweep: together where that can be done, else one by one."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from plastica.errors import PlasticaError, StorageError
from plastica.motion.regimes import rows_of
from plastica.motion.solution import Solution
from plastica.physics.ledger import liapunov
from plastica.study.run import solved
from plastica.study.sweep_batch import compute_together
from plastica.study.sweep_outputs import (
    FAILED,
    FINAL,
    HISTORY,
    LIMITS,
    METHODS,
    REFUSED,
    REGIMES,
    STATUSES,
    empty_chunk,
)
from plastica.study.sweep_plan import Plan
from plastica.study.sweep_store import APART, Store

__all__ = ["Told", "compute", "run_chunk"]

SURE: Final = 100
"""How many times the steps of a member in a batch it surely does not come to alone."""

Array = NDArray[np.float64]
Columns = dict[str, NDArray[Any]]


@dataclass(frozen=True)
class Told:
    """What became of one chunk.

    Attributes
    ----------
    chunk : int
        Which one.
    members : int
        How many members it has.
    failed : int
        Members that did not end as asked.
    seconds : float
        What it took; 0 where it was done already.
    computed : bool
        Whether it was computed now.
    """

    chunk: int
    members: int
    failed: int
    seconds: float
    computed: bool


def run_chunk(store: Store, chunk: int) -> Told:
    """Compute a chunk of a sweep and write it down, unless it is done.

    Parameters
    ----------
    store : Store
        The sweep.
    chunk : int
        Which chunk.

    Returns
    -------
    Told
    """
    first, last = store.plan.span(chunk)
    if store.is_done(chunk):
        return Told(chunk, last - first, _failed(store.read(["status"], first, last)["status"]), 0.0, False)
    began = time.perf_counter()
    apart: list[str] = []
    columns = compute(store.plan, store.plan.members.between(first, last), apart.append)
    if not store.is_done(chunk):
        store.write(chunk, columns)
        entry = {"chunk": chunk, "members": last - first, "seconds": round(time.perf_counter() - began, 4)}
        store.note({**entry, APART: apart[0]} if apart else entry)
    return Told(chunk, last - first, _failed(columns["status"]), time.perf_counter() - began, True)


def _failed(status: NDArray[Any]) -> int:
    return int(np.isin(status, [STATUSES.index(code) for code in FAILED]).sum())


def compute(plan: Plan, values: Array, apart: Callable[[str], object] = lambda _: None) -> Columns:
    """Compute some members.

    Parameters
    ----------
    plan : Plan
        The sweep.
    values : ndarray, shape (members, axes)
        What the members take.
    apart : callable
        Called with the reason where members that should be computed together cannot be, and are computed one by one.

    Returns
    -------
    dict of ndarray
        The variables of the store by name, the member first. Nothing depends on which members are computed together.
    """
    made, alone = empty_chunk(plan, len(values)), np.ones(len(values), dtype=bool)
    if plan.batched:
        try:
            made = compute_together(plan, values)
            alone = _doubtful(plan, made)
        except StorageError:
            raise
        except PlasticaError as error:
            # Each member is then judged on its own.
            apart(str(error))
    for name, nothing in empty_chunk(plan, 1).items():
        made[name][alone] = nothing
    for i in np.flatnonzero(alone):
        for name, value in _member(plan, values[i]).items():
            if name in made:
                made[name][i] = value
    return made


def _doubtful(plan: Plan, made: Columns) -> NDArray[np.bool_]:
    """Which members of a batch may end in another way alone: those that fail, and those that come near to `max_steps`.

    The batch takes other steps than the solver of a single member, and knows nothing of how many are allowed.
    """
    well, refused = (made["status"] == STATUSES.index(code) for code in ("done", "refused"))
    # What the batch has handed on to that solver is told with the steps of both.
    together = made["method"] == METHODS.index("DOP853")
    steps = made["steps"].astype(np.int64) * np.where(together, SURE, 1)
    return np.asarray(~refused & (~well | (steps > plan.base.max_steps)))


def _member(plan: Plan, values: Array) -> dict[str, Any]:
    """Everything that may be kept of one member."""
    try:
        solution = solved(plan.scenario(values))
    except StorageError:
        # What cannot be read now may be read when the sweep is taken up again.
        raise
    except PlasticaError:
        # A scenario that is refused is a result of the sweep; `Sweep.scenario` tells what is wrong with it.
        return dict(REFUSED)
    told: dict[str, Any] = {
        "status": STATUSES.index(solution.status.code),
        "method": METHODS.index(solution.method),
        "steps": solution.counts.steps,
        "nodes": solution.model.grid.per_element,
        "time_reached": solution.history.end * solution.model.scales.time,
    }
    last = _readings(solution, np.array([solution.history.end]))
    told |= {name: last[name][0] for name in FINAL}
    if "verdict" in plan.outputs:
        rows = rows_of(solution)
        regime = int(rows.regime[0]) if solution.status.ok else REGIMES.index("untold")
        told |= {"regime": regime, "yielding": int(rows.yielding[0])}
    if "limit" in plan.outputs:
        told |= _limit(solution)
    if "state" in plan.outputs:
        model = solution.model
        told["curvature"] = model.layout.mu(solution.history.y[-1]) * model.scales.curvature
    if plan.times is not None:
        told |= _history(solution, plan.times)
    return told


def _readings(solution: Solution, t: Array) -> dict[str, Array]:
    """What is told of the states at dimensionless times, in the user's units; shape (times,) or (times, segments)."""
    model = solution.model
    scales, layout, w, y = model.scales, model.layout, model.grid.w, solution.history(t)
    mu, natural, mu_t = layout.mu(y), layout.natural(y), layout.mu_t(y)
    theta, turned = model.angle(mu), mu @ w
    values = {
        "natural_curvature": natural,
        "drive": model.drive(mu, natural),
        "threshold": np.broadcast_to(model.threshold(natural), np.shape(natural)),
        "tip_x": np.cos(theta) @ w,
        "tip_y": np.sin(theta) @ w,
        "tip_angle": turned,
        "largest_angle": model.largest_angle(mu),
        "liapunov": liapunov(model, t, mu, natural, mu_t),
    }
    return {name: np.asarray(values[name] * getattr(scales, kind)) for name, (kind, _) in FINAL.items()}


def _limit(solution: Solution) -> dict[str, Any]:
    limit = solution.limit
    if limit is None or limit.equilibrium is None:
        return {"limit_kind": LIMITS.index("none" if limit is None else limit.kind), "limit_stable": 2}
    return {
        "limit_kind": LIMITS.index(limit.kind),
        "limit_stable": int(bool(limit.stable)),
        "limit_natural_curvature": limit.equilibrium.mu_nat * solution.model.scales.curvature,
    }


def _history(solution: Solution, times: Array) -> dict[str, Any]:
    """The same at all times of the histories that the member came to; nan beyond."""
    history, scale = solution.history, solution.model.scales.time
    reached = times / scale <= history.end * (1.0 + 4.0 * np.finfo(float).eps)
    found = _readings(solution, np.minimum(times[reached] / scale, history.end))
    told = {}
    for name in HISTORY:
        values = np.full((times.size, *found[name].shape[1:]), np.nan)
        values[reached] = found[name]
        told[f"{name}_history"] = values
    return told
