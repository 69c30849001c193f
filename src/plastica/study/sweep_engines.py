"""Who computes the chunks of a sweep: processes of this machine, or the workers of a Dask cluster."""

from __future__ import annotations

import json
import os
import selectors
import subprocess
import sys
import tempfile
from collections import deque
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import CancelledError
from contextlib import suppress
from dataclasses import dataclass, field
from importlib import import_module
from typing import IO, Any, Final

from plastica.errors import ArgumentError, FileError, PlasticaError
from plastica.study.sweep_store import Store, open_store
from plastica.study.sweep_tasks import Told, run_chunk

__all__ = ["ENGINES", "available_cores", "check_engine", "computed"]

ENGINES: Final = ("local", "dask")

MOST_WORKERS: Final = 1024
MOST_TRIES: Final = 3
"""Deaths of a worker over one and the same chunk after which the sweep is given up."""

AHEAD: Final = 4
"""Chunks for each worker of a cluster that are handed to the scheduler at a time."""

_ONE_THREAD: Final = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "VECLIB_MAXIMUM_THREADS")


def available_cores() -> int:
    """Return how many cores this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def check_engine(engine: object, workers: object, scheduler: object) -> None:
    """Refuse engines that are not offered, and arguments that do not belong to them.

    Raises
    ------
    ArgumentError
        For each of these.
    """
    if engine not in ENGINES:
        raise ArgumentError(f"must be one of {', '.join(ENGINES)}", where="engine", value=engine)
    if workers is not None and (
        isinstance(workers, bool) or not isinstance(workers, int) or not 0 <= workers <= MOST_WORKERS
    ):
        raise ArgumentError(f"must be a whole number from 0 to {MOST_WORKERS}", where="workers", value=workers)
    if scheduler is None:
        return
    if engine != "dask":
        raise ArgumentError('belongs to engine="dask" only', where="scheduler", value=scheduler)
    if not isinstance(scheduler, str):
        raise ArgumentError('must be the address of a scheduler, "tcp://host:8786"', where="scheduler", value=scheduler)
    if workers is not None:
        raise ArgumentError("must be left out with a scheduler, which has workers of its own", where="workers")


def computed(
    store: Store, chunks: Sequence[int], engine: str, workers: int | None, scheduler: str | None
) -> Iterator[Told]:
    """Compute chunks, and yield what became of each as it is done.

    Parameters
    ----------
    store : Store
        The sweep.
    chunks : sequence of int
        What is to be computed.
    engine : str
        "local" or "dask".
    workers : int or None
        Processes; by default one for each core; 0 for this process itself.
    scheduler : str or None
        Address of a Dask scheduler.

    Yields
    ------
    Told

    Raises
    ------
    PlasticaError
        Where the store cannot be written, or a chunk has ended its worker again and again.
    """
    if not chunks:
        return
    if engine == "dask":
        yield from _on_dask(store, chunks, workers, scheduler)
    elif workers == 0:
        yield from (run_chunk(store, chunk) for chunk in chunks)
    else:
        count = min(workers or available_cores(), len(chunks))
        yield from _Crew(store, deque(chunks), count).run()


# -- processes of this machine ---------------------------------------------------------------------------------------


@dataclass(eq=False)
class _Hand:
    """One worker process, and the chunk it is at."""

    process: subprocess.Popen[bytes]
    said: IO[bytes]
    chunk: int | None = None

    def give(self, chunk: int) -> None:
        self.chunk = chunk
        if self.process.stdin is not None:
            # One that has died meanwhile is noticed by the end of its answers.
            with suppress(BrokenPipeError):
                self.process.stdin.write(f"{chunk}\n".encode())
                self.process.stdin.flush()

    def said_last(self) -> bytes:
        """The answer that has just come; nothing where the process has ended."""
        line = self.process.stdout.readline() if self.process.stdout is not None else b""
        return line if line.endswith(b"\n") else b""

    def dismiss(self) -> None:
        self.process.kill()
        self.process.wait()
        for stream in (self.process.stdin, self.process.stdout, self.said):
            if stream is not None:
                with suppress(BrokenPipeError):
                    stream.close()

    def last_words(self) -> str:
        self.said.seek(0)
        lines = self.said.read().decode("utf-8", "replace").strip().splitlines()
        return lines[-1][:200] if lines else f"exit code {self.process.poll()}"


@dataclass(eq=False)
class _Crew:
    """Worker processes that share out chunks; one that dies is replaced, and its chunk given out again."""

    store: Store
    waiting: deque[int]
    count: int
    tries: dict[int, int] = field(default_factory=dict)

    def run(self) -> Iterator[Told]:
        hands: list[_Hand] = []
        with selectors.DefaultSelector() as selector:
            try:
                hands += [self._hired(selector) for _ in range(self.count)]
                while hands:
                    for key, _events in selector.select():
                        hand: _Hand = key.data
                        line = hand.said_last()
                        if line:
                            told = self._heard(hand, line)
                            if told is not None:
                                yield told
                        else:
                            self._mourn(hand)
                        if line and self.waiting:
                            hand.give(self.waiting.popleft())
                            continue
                        selector.unregister(key.fileobj)
                        hands.remove(hand)
                        hand.dismiss()
                        hands += [self._hired(selector)] if self.waiting else []
            finally:
                for hand in hands:
                    hand.dismiss()

    def _hired(self, selector: selectors.BaseSelector) -> _Hand:
        said = tempfile.TemporaryFile()  # noqa: SIM115 - closed when the worker is dismissed
        process = subprocess.Popen(  # noqa: S603 - a list, no shell
            [sys.executable, "-m", "plastica.study.sweep_worker", str(self.store.folder.absolute())],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=said,
            env=_environment(),
        )
        hand = _Hand(process, said)
        if process.stdout is not None:
            selector.register(process.stdout, selectors.EVENT_READ, hand)
        return hand

    def _heard(self, hand: _Hand, line: bytes) -> Told | None:
        """Read an answer; None where a worker says that it is ready."""
        answer: Mapping[str, Any] = json.loads(line)
        if "error" in answer:
            raise FileError(f"cannot be computed: {answer['error']}", where=str(self.store.folder))
        if "ready" in answer:
            return None
        hand.chunk = None
        return Told(**answer)

    def _mourn(self, hand: _Hand) -> None:
        """Take back the chunk of a worker that has died, unless it was one of several that died over it."""
        hand.process.wait()
        chunk = -1 if hand.chunk is None else hand.chunk
        self.tries[chunk] = self.tries.get(chunk, 0) + 1
        if self.tries[chunk] >= MOST_TRIES:
            what = "cannot start" if chunk < 0 else f"has ended {MOST_TRIES} times at chunk {chunk}"
            raise FileError(
                f"cannot be computed: a worker process {what} ({hand.last_words()})", where=str(self.store.folder)
            )
        if chunk >= 0:
            self.waiting.appendleft(chunk)


def _environment() -> dict[str, str]:
    """The present one, with one thread for each process: their matrices are small."""
    path = os.pathsep.join(each for each in sys.path if each)
    return {**os.environ, **dict.fromkeys(_ONE_THREAD, "1"), "PYTHONPATH": path}


# -- a Dask cluster --------------------------------------------------------------------------------------------------


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


def _on_dask(store: Store, chunks: Sequence[int], workers: int | None, scheduler: str | None) -> Iterator[Told]:
    distributed = _distributed()
    where = f"on the scheduler at {scheduler}" if scheduler else "on a cluster of this machine"
    try:
        if scheduler is not None:
            with distributed.Client(scheduler) as client:
                yield from _submitted(client, store, chunks)
            return
        count = min(workers or available_cores(), len(chunks))
        with (
            distributed.LocalCluster(n_workers=count, threads_per_worker=1, dashboard_address=None) as cluster,
            distributed.Client(cluster) as client,
        ):
            yield from _submitted(client, store, chunks)
    except PlasticaError:
        raise
    except (OSError, TimeoutError, CancelledError, distributed.KilledWorker) as error:
        reason = str(error).split("\n")[0][:200] or type(error).__name__
        raise FileError(
            f"cannot be computed {where} ({reason})",
            where=str(store.folder),
            next_step="What is done is kept: give the same command again once it can be reached.",
        ) from None


def _submitted(client: Any, store: Store, chunks: Sequence[int]) -> Iterator[Told]:
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
    for future in waiting:
        yield Told(**future.result())
        future.release()
        for another in submitted(1 + max(0, room() - waiting.count() - 1)):
            waiting.add(another)


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
