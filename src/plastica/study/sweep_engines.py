"""Who computes the chunks of a sweep: processes of this machine, or (`sweep_cluster`) the workers of a Dask cluster."""

from __future__ import annotations

import json
import os
import selectors
import subprocess
import sys
import tempfile
from collections import deque
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from typing import IO, Any, Final

from plastica.errors import ArgumentError, FileError
from plastica.study.sweep_cluster import available_cores, check_address, on_dask
from plastica.study.sweep_store import Store
from plastica.study.sweep_tasks import Told, run_chunk

__all__ = ["ENGINES", "available_cores", "check_engine", "computed"]

ENGINES: Final = ("local", "dask")

MOST_WORKERS: Final = 1024
MOST_TRIES: Final = 3
"""Deaths of a worker over one and the same chunk after which the sweep is given up."""

_ONE_THREAD: Final = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "VECLIB_MAXIMUM_THREADS")


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
    check_address(scheduler)
    if workers is not None:
        raise ArgumentError("must be left out with a scheduler, which has workers of its own", where="workers")


def computed(
    store: Store,
    chunks: Sequence[int],
    engine: str,
    workers: int | None,
    scheduler: str | None,
    waits: Callable[[str], None] = lambda _: None,
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
    waits : callable
        Called with what is waited for, where that is long in coming.

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
        yield from on_dask(store, chunks, workers, scheduler, waits)
    elif workers == 0:
        yield from (run_chunk(store, chunk) for chunk in chunks)
    else:
        count = min(workers or available_cores(), len(chunks))
        yield from _Crew(store, deque(chunks), count).run()


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
