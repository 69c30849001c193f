"""How the benchmarks measure: CPU time of interleaved repetitions, medians, and the load of the machine beside them."""

from __future__ import annotations

import os
import statistics
import time
from collections.abc import Callable


def interleaved(candidates: dict[str, Callable[[], object]], repeat: int = 15) -> dict[str, float]:
    """Return the median CPU seconds of each candidate, run in turn so that a noisy moment hits all alike."""
    for run in candidates.values():
        run()
    times: dict[str, list[float]] = {name: [] for name in candidates}
    for _ in range(repeat):
        for name, run in candidates.items():
            began = time.process_time()
            run()
            times[name].append(time.process_time() - began)
    return {name: statistics.median(found) for name, found in times.items()}


def machine() -> str:
    one, five, fifteen = os.getloadavg()
    threads = os.environ.get("OMP_NUM_THREADS", "unset")
    return f"{os.cpu_count()} cores, load {one:.1f} {five:.1f} {fifteen:.1f}, OMP_NUM_THREADS={threads}"


def verdict(name: str, ratio: float, bar: float, *, at_least: bool = False) -> str:
    met = ratio >= bar if at_least else ratio <= bar
    return f"{name}: {ratio:.2f}x ({'at least' if at_least else 'at most'} {bar:g}x) {'met' if met else 'MISSED'}"
