"""What a sweep will take, told by a pilot of a few of its members before any of it is computed."""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from plastica.study.sweep import Given, default_store, plan_of
from plastica.study.sweep_create import bytes_of, room, size, stored_bytes
from plastica.study.sweep_engines import available_cores, check_engine
from plastica.study.sweep_plan import Plan
from plastica.study.sweep_result import plural
from plastica.study.sweep_tasks import compute

__all__ = ["Estimate", "duration", "estimate", "estimate_sweep"]

START_UP: Final = 2.0
"""Seconds that worker processes take to start: interpreter, libraries, the scenario read."""

PER_CHUNK: Final = 0.05
"""Seconds that a chunk takes beside its members: read, written, sealed."""

PILOT_TOGETHER, PILOT_SINGLY = 512, 8
"""Members of the pilot, where they are computed together and one by one."""


@dataclass(frozen=True)
class Estimate:
    """What a sweep will take on this machine, if its members are like those of the pilot.

    Attributes
    ----------
    members, chunks, workers : int
        How many there are.
    pilot : int
        Members that were timed.
    seconds_per_member : float
        On one core.
    seconds : float
        Of all, with all workers.
    bytes : int
        On the disk, compressed as those of the pilot were.
    largest_bytes : int
        Without compression.
    needed_bytes, free_bytes : int
        What must be free on the disk before the sweep is begun, and what is.
    """

    members: int
    chunks: int
    workers: int
    pilot: int
    seconds_per_member: float
    seconds: float
    bytes: int
    largest_bytes: int
    needed_bytes: int
    free_bytes: int

    def __str__(self) -> str:
        told = (
            f"{plural(self.members, 'member')} in {plural(self.chunks, 'chunk')}: about {duration(self.seconds)} with "
            f"{plural(self.workers, 'worker')} of this machine and {size(self.bytes)} on the disk, by "
            f"{plural(self.pilot, 'member')} that took {1e3 * self.seconds_per_member:.3g} ms each"
        )
        if self.needed_bytes > self.free_bytes:
            needed, free = size(self.needed_bytes), size(self.free_bytes)
            told += f". The disk has too little room: {needed} must be free, {free} are"
        return told


def duration(seconds: float) -> str:
    """Write a time for people: two digits, in a unit that suits it."""
    for whole, unit in ((86400.0, "days"), (3600.0, "h"), (60.0, "min")):
        if seconds >= 2.0 * whole:
            return f"{seconds / whole:.2g} {unit}" if seconds < 100 * whole else f"{seconds / whole:.0f} {unit}"
    return f"{seconds:.2g} s" if seconds < 100.0 else f"{seconds:.0f} s"


def estimate_sweep(
    scenario: Given, over: Mapping[str, Any] | None = None, *, workers: int | None = None, **table: Any
) -> Estimate:
    """Tell what a sweep will take, by computing a few of its members.

    Parameters
    ----------
    scenario, over, workers
        As of `sweep`.
    **table
        What else `sweep` takes of the table [sweep]: sampling, members, seed, csv, outputs, times, chunk.

    Returns
    -------
    Estimate
        Members that take much longer than those of the pilot are not foreseen.

    Raises
    ------
    PlasticaError
        Where the scenario or what is varied has mistakes.
    """
    check_engine("local", workers, None)
    return estimate(plan_of(scenario, {"over": over, **table}), workers)


def estimate(plan: Plan, workers: int | None = None, store: Path | None = None) -> Estimate:
    """Tell what a planned sweep will take in a store, by default the usual one; see `estimate_sweep`."""
    count = max(1, min(available_cores() if workers is None else workers or 1, plan.chunks))
    values = _some(plan, PILOT_TOGETHER if plan.batched else PILOT_SINGLY)
    # The first call reads laws and libraries, which a long sweep does once.
    compute(plan, values[:1])
    began = time.perf_counter()
    columns = compute(plan, values)
    each = (time.perf_counter() - began) / len(values)
    share = stored_bytes(plan, columns) / max(1, sum(column.nbytes for column in columns.values()))
    largest = bytes_of(plan)
    needed, free = room(store or default_store(plan), plan)
    return Estimate(
        members=plan.count,
        chunks=plan.chunks,
        workers=count,
        pilot=len(values),
        seconds_per_member=each,
        seconds=START_UP + (plan.count * each + plan.chunks * PER_CHUNK) / count,
        bytes=int(share * largest),
        largest_bytes=largest,
        needed_bytes=needed,
        free_bytes=free,
    )


def _some(plan: Plan, most: int) -> NDArray[np.float64]:
    """Values of some members, spread over the sweep where its members are told by their place."""
    count = min(most, plan.count)
    return plan.members.picked(np.linspace(0, plan.count - 1, count).astype(np.int64))
