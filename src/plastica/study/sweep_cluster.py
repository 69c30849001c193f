"""The chunks of a sweep on a Dask cluster: of this machine, or of a scheduler that is there already."""

from __future__ import annotations

import asyncio
import logging
import os
import re
import signal
import time
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import CancelledError
from contextlib import contextmanager
from importlib import import_module
from typing import Any, Final

from plastica.errors import ArgumentError, FileError, PlasticaError
from plastica.study.sweep_store import Store, open_store
from plastica.study.sweep_tasks import Told, run_chunk

__all__ = ["available_cores", "check_address", "computed_on_cluster", "dask_setup", "on_dask"]

MOST_TRIES: Final = 3
"""Times that a chunk is tried again before the sweep is given up."""

AHEAD: Final = 4
"""Chunks for each worker of a cluster that are handed to the scheduler at a time."""

PATIENCE: Final = 2.0
"""Seconds after which what is waited for is told."""

LOOK_EVERY: Final = 0.02
"""Seconds between two looks whether a chunk is done."""

AT_ONCE: Final = 0.5
"""Seconds in which the processes of an interrupted cluster may end by themselves, and are then killed."""

_ADDRESS: Final = re.compile(
    r"(?:(?:tcp|tls|ws|wss|ucx)://)?(?:[A-Za-z0-9](?:[A-Za-z0-9._-]*)|\[[0-9A-Fa-f:.]+(?:%[A-Za-z0-9]+)?\]):([0-9]{1,5})"
)

Waits = Callable[[str], None]


def available_cores() -> int:
    """Return how many cores this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def check_address(scheduler: object) -> None:
    """Refuse what is no address of a scheduler, by its form.

    Raises
    ------
    ArgumentError
        Where it has no host or no port, or a protocol that Dask does not know.
    """
    found = _ADDRESS.fullmatch(scheduler) if isinstance(scheduler, str) else None
    if found is None or not 1 <= int(found[1]) <= 65535:
        raise ArgumentError(
            'must be the address of a scheduler, such as "tcp://host:8786"', where="scheduler", value=scheduler
        )


def _distributed() -> Any:
    try:
        return import_module("distributed")
    except ImportError:
        raise ArgumentError(
            'can be "dask" only where dask.distributed is installed',
            where="engine",
            value="dask",
            next_step="Install plastica[dask], or take the engine local.",
        ) from None


def on_dask(
    store: Store, chunks: Sequence[int], workers: int | None, scheduler: str | None, waits: Waits
) -> Iterator[Told]:
    """Compute chunks on a cluster, and yield what became of each; see `sweep_engines.computed`."""
    distributed = _distributed()
    where = f"on the scheduler at {scheduler}" if scheduler else "on a cluster of this machine"
    try:
        with _quiet():
            if scheduler is None:
                yield from _on_this_machine(distributed, store, chunks, min(workers or available_cores(), len(chunks)))
            else:
                _reach(distributed, scheduler, waits)
                with distributed.Client(scheduler) as client:
                    yield from _submitted(client, store, chunks, lambda: waits(f"workers at {scheduler}"))
    except PlasticaError:
        raise
    except (OSError, TimeoutError, CancelledError, distributed.KilledWorker) as error:
        reason = str(error).split("\n")[0][:200] or type(error).__name__
        raise FileError(
            f"cannot be computed {where} ({reason})",
            where=str(store.folder),
            next_step="What is done is kept: give the same command again once it can be reached.",
        ) from None


def _on_this_machine(distributed: Any, store: Store, chunks: Sequence[int], count: int) -> Iterator[Told]:
    with (
        distributed.LocalCluster(
            n_workers=count,
            threads_per_worker=1,
            dashboard_address=None,
            silence_logs=logging.CRITICAL,
            preload=[__name__],
        ) as cluster,
        distributed.Client(cluster) as client,
    ):
        finished = False
        try:
            yield from _submitted(client, store, chunks, lambda: None)
            finished = True
        finally:
            # Whatever they are at is not wanted any more; to wait for it would take seconds.
            if not finished:
                cluster.sync(_dismiss, list(cluster.workers.values()))


async def _dismiss(nannies: Sequence[Any]) -> None:
    """End processes without waiting for what they are at; an exception says that one had to be killed."""
    await asyncio.gather(*(nanny.close(timeout=AT_ONCE) for nanny in nannies), return_exceptions=True)


def dask_setup(_worker: object) -> None:
    """Let the processes of a cluster of this machine ignore Ctrl-C; whoever started them sees to their end.

    Called by Dask in each of them, as a module that is preloaded.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)


@contextmanager
def _quiet() -> Iterator[None]:
    """Keep from the user what Dask logs of connections that close: what matters is an exception."""
    logger = logging.getLogger("distributed")
    before = [(handler, handler.level) for handler in logger.handlers]
    for handler, _ in before:
        handler.setLevel(logging.CRITICAL)
    try:
        yield
    finally:
        for handler, level in before:
            handler.setLevel(level)


def _reach(distributed: Any, scheduler: str, waits: Waits) -> None:
    """Wait until a scheduler answers, telling so where it does not do so at once.

    Raises
    ------
    OSError
        Where it does not answer in the time that Dask has for that.
    """
    dask = import_module("dask")
    longest = dask.utils.parse_timedelta(dask.config.get("distributed.comm.timeouts.connect"), default="s")
    runner = distributed.utils.LoopRunner()
    runner.start()
    try:
        try:
            comm = runner.run_sync(distributed.comm.connect, scheduler, timeout=min(PATIENCE, longest))
        except OSError:
            waits(f"the scheduler at {scheduler}")
            comm = runner.run_sync(distributed.comm.connect, scheduler, timeout=longest)
        comm.abort()
    except (ValueError, TypeError) as error:
        # Of an address whose protocol is not set up here.
        raise OSError(str(error)) from None
    finally:
        runner.stop()


def _submitted(client: Any, store: Store, chunks: Sequence[int], lonely: Callable[[], None]) -> Iterator[Told]:
    """Keep a few chunks for each worker with the scheduler, whose cost grows with what it has to remember."""
    folder, left = str(store.folder.absolute()), deque(chunks)

    def submitted(count: int) -> list[Any]:
        some = [left.popleft() for _ in range(min(count, len(left)))]
        # The key is the chunk's own: one that is under way already is not begun a second time.
        keys = [f"plastica-{store.identity[:16]}-{chunk}" for chunk in some]
        return [
            client.submit(computed_on_cluster, folder, chunk, key=key, pure=True, retries=MOST_TRIES)
            for chunk, key in zip(some, keys, strict=True)
        ]

    def room() -> int:
        return AHEAD * max(1, sum(map(int, client.nthreads().values())))

    waiting = _distributed().as_completed(submitted(room()))
    while not waiting.is_empty():
        _await(waiting, client, lonely)
        future = next(waiting)
        yield Told(**future.result())
        future.release()
        for another in submitted(1 + max(0, room() - waiting.count() - 1)):
            waiting.add(another)


def _await(waiting: Any, client: Any, lonely: Callable[[], None]) -> None:
    """Wait until a chunk is done, telling where there is nobody to compute it."""
    looked = time.monotonic()
    while not waiting.has_ready():
        time.sleep(LOOK_EVERY)
        if time.monotonic() - looked > PATIENCE:
            looked = time.monotonic()
            if not client.nthreads():
                lonely()


def computed_on_cluster(folder: str, chunk: int) -> dict[str, Any]:
    """Compute one chunk, in whatever process of a cluster this is called.

    Parameters
    ----------
    folder : str
        The sweep, by a path that all machines of the cluster share.
    chunk : int
        Which chunk.

    Returns
    -------
    dict
        The fields of `Told`.
    """
    store = open_store(folder)
    store.check_versions()
    return vars(run_chunk(store, chunk))
