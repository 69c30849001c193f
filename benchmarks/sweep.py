"""What a sweep costs: per member, per chunk, with processes and with a scheduler, in time and bytes.

Everything is CPU time or, where processes work side by side, wall time beside the load of the machine.
"""

from __future__ import annotations

import contextlib
import statistics
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np

import plastica as pl
from benchmarks.timing import machine
from plastica.study.sweep import plan_of
from plastica.study.sweep_cluster import computed_on_cluster
from plastica.study.sweep_create import create, stored_bytes
from plastica.study.sweep_plan import Plan
from plastica.study.sweep_store import open_store
from plastica.study.sweep_tasks import compute

TEXT = """
units = "dimensionless"
[material]
name = "one-shape"
[load]
thrust = 2.0
[initial]
curvature = "cos(pi*s/2)"
[grid]
nodes = 16
[solve]
until = 100.0
"""
OVER = {
    "load.thrust": {"from": 0.5, "to": 10.0},
    "initial.amplitude": {"from": 0.1, "to": 3.0},
    "material.parameters.h": {"from": 0.05, "to": 0.2},
}
LIBRARIES = ("numpy", "numba")
ALONE = {**OVER, "load.couple": {"from": 0.0, "to": 0.1}}


@contextlib.contextmanager
def _folder() -> Iterator[Path]:
    with tempfile.TemporaryDirectory() as folder:
        yield Path(folder)


def _plan(count: int, over: dict[str, object] = OVER, **table: object) -> Plan:
    return plan_of(TEXT, {"over": over, "sampling": "random", "members": count, **table})


def members() -> None:
    """CPU time and bytes of a member, by what is kept of it and by the size of its chunk."""
    print("per member, on one core: CPU time in ms, bytes compressed and not")
    kept = {
        "final": ["final"],
        "final, verdict": ["final", "verdict"],
        "with the state": ["final", "verdict", "state"],
        "with 20 times": ["final", "verdict", "histories"],
        "with the limit": ["final", "verdict", "limit"],
    }
    for words, outputs in kept.items():
        times = np.linspace(1.0, 100.0, 20).tolist() if "histories" in outputs else None
        for library in LIBRARIES:
            plan = _plan(2048, outputs=outputs, times=times, library=library)
            rows = next(plan.members.blocks(2048))
            compute(plan, rows[:16])
            spent, columns = _timed(lambda p=plan, r=rows: compute(p, r))
            size = sum(column.nbytes for column in columns.values()) / 2048
            told = f"{stored_bytes(plan, columns) / 2048:7.0f} {size:6.0f}"
            print(f"  {words:16s} {library:6s} {1e3 * spent / 2048:7.3f} {told}")
    plan = _plan(64, ALONE)
    rows = next(plan.members.blocks(64))
    compute(plan, rows[:2])
    spent, _ = _timed(lambda: compute(plan, rows))
    print(f"  one by one       {1e3 * spent / 64:7.3f}")
    print("per member, by the size of the chunk: CPU time in ms")
    for library in LIBRARIES:
        plan = _plan(8192, library=library)
        rows = next(plan.members.blocks(8192))
        for size in (16, 64, 256, 512, 2048, 8192):
            spent, _ = _timed(lambda p=plan, r=rows[:size]: compute(p, r))
            print(f"  {library:6s} {size:5d} {1e3 * spent / size:7.3f}")


def _timed(run: object) -> tuple[float, dict[str, np.ndarray]]:
    began = time.process_time()
    found = run()  # type: ignore[operator]
    return time.process_time() - began, found


def chunks() -> None:
    """What a chunk costs beside its members: opened, read, written, sealed, looked at again."""
    with _folder() as folder:
        pl.sweep(TEXT, OVER, sampling="random", members=8192, chunk=512, store=folder / "s.sweep", workers=0)
        store = open_store(folder / "s.sweep")
        columns = compute(store.plan, store.values(0, 512))
        found = {
            "open": lambda: open_store(folder / "s.sweep").arrays,
            "read members": lambda: store.values(0, 512),
            "write and seal": lambda: store.write(0, columns),
            "judge by content": lambda: store.is_done(0),
        }
        print("per chunk of 512 members, beside them: wall time in ms (median of 15)")
        for words, run in found.items():
            times = []
            for _ in range(15):
                began = time.perf_counter()
                run()
                times.append(time.perf_counter() - began)
            print(f"  {words:16s} {1e3 * statistics.median(times):6.1f}")


def judging(count: int = 100_000) -> None:
    """How fast chunks are judged by their content, as at the beginning of a sweep that is taken up again."""
    with _folder() as folder:
        store = create(folder / "s.sweep", _plan(count, chunk=count))
        one = compute(store.plan, store.values(0, 512))
        columns = {name: np.resize(column, (count, *column.shape[1:])) for name, column in one.items()}
        began = time.process_time()
        store.write(0, columns)
        written = time.process_time() - began
        began = time.process_time()
        assert store.is_done(0)
        judged = time.process_time() - began
        told = f"{1e6 * written / count:.2f} µs per member to write, {1e6 * judged / count:.2f} to judge"
        print(f"a chunk of {count}: {told}")


def scheduler(count: int = 1000) -> None:
    """What Dask adds to a chunk: tasks that find their chunk done already."""
    try:
        import distributed
    except ImportError:
        print("Dask: not measured here (dask.distributed is not installed)")
        return
    with (
        _folder() as folder,
        distributed.LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as cluster,
        distributed.Client(cluster) as client,
    ):
        began = time.perf_counter()
        client.gather(client.map(abs, range(count), pure=False))
        empty = (time.perf_counter() - began) / count
        found = pl.sweep(TEXT, OVER, sampling="random", members=64, chunk=16, store=folder / "s.sweep", workers=0)
        path = str(found.path.absolute())
        client.gather(client.map(computed_on_cluster, [path] * 8, [i % 4 for i in range(8)], pure=False))
        began = time.perf_counter()
        client.gather(client.map(computed_on_cluster, [path] * 100, [i % 4 for i in range(100)], pure=False))
        done = (time.perf_counter() - began) / 100
        print(f"Dask, per chunk: {1e3 * empty:.2f} ms for an empty task, {1e3 * done:.1f} ms for one that is done")


def processes(count: int = 40_000) -> None:
    """Wall time with one and two workers, median of 3, with everything: start, chunks, store."""
    print(f"{count} members, wall time in s (median of 3)")
    for library in LIBRARIES:
        for workers in (1, 2):
            times = []
            for _ in range(3):
                with _folder() as folder:
                    options = {"store": folder / "s.sweep", "workers": workers, "library": library}
                    began = time.perf_counter()
                    pl.sweep(TEXT, OVER, sampling="random", members=count, **options)
                    times.append(time.perf_counter() - began)
            median = statistics.median(times)
            each = 1e3 * median * workers / count
            print(f"  {library:6s} {workers} workers {median:6.1f} s, {each:.3f} ms of a core per member")


def creation(count: int = 2_000_000) -> None:
    """Time to write what the members take, which is done once, by the process that begins the sweep."""
    with _folder() as folder:
        began = time.perf_counter()
        create(folder / "s.sweep", _plan(count))
        spent = time.perf_counter() - began
        print(f"making the store, {len(OVER)} keys: {1e6 * spent / count:.2f} µs per member")


def main() -> None:
    print(f"sweeps ({machine()})")
    members()
    chunks()
    creation()
    judging()
    scheduler()
    processes()


if __name__ == "__main__":
    main()
