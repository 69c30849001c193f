"""Claim: whatever process of a sweep is killed or stopped, nothing is lost and nothing is written twice.

Real processes on this machine: the command line with workers of its own, and a Dask scheduler with three workers that
were started by their own commands. Everything waits for what happens, within bounds.
"""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

import plastica as pl
from plastica.errors import FileError
from plastica.study import sweep_engines
from plastica.study.sweep import Progress
from plastica.study.sweep_store import open_store
from tests.commandline import scenario, written
from tests.patience import PATIENCE, wait

CHUNKS, CHUNK = 36, 2
# One by one, since a couple is varied; long enough that a kill or a stop meets a chunk under way, and many are left.
TEXT = scenario(solve="until = 20000.0", grid="nodes = 48") + (
    f"[sweep]\nchunk = {CHUNK}\n[sweep.over]\n"
    '"load.couple" = { from = 0.0, to = 0.2, count = 8 }\n"load.thrust" = { from = 2.0, to = 6.0, count = 9 }\n'
)


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> dict[str, bytes]:
    """What the finished store holds, computed in one process without a stop."""
    folder = tmp_path_factory.mktemp("whole")
    return contents(pl.sweep(written(folder, TEXT), store=folder / "s.sweep", workers=0).path)


def contents(folder: Path) -> dict[str, bytes]:
    results = folder / "results.zarr"
    return {p.relative_to(results).as_posix(): p.read_bytes() for p in sorted(results.rglob("*")) if p.is_file()}


def logged(folder: Path) -> list[int]:
    """Chunks written down so far."""
    if not (folder / "log.jsonl").is_file():
        return []
    return [entry["chunk"] for entry in open_store(folder).log()]


def heeding() -> None:
    """Heed Ctrl-C, which what a shell starts in the background ignores, the tests and their children included."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)


@contextmanager
def started(*command: str, folder: Path, name: str) -> Iterator[subprocess.Popen[bytes]]:
    """A process of its own group with its words in a file; gone afterwards, with all that it has started."""
    environment = {**os.environ, "OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"}
    with (folder / f"{name}.txt").open("wb") as said:
        process = subprocess.Popen(
            command,
            cwd=folder,
            stdout=said,
            stderr=said,
            env=environment,
            start_new_session=True,
            preexec_fn=heeding,  # noqa: PLW1509  (these tests have one thread)
        )
        try:
            yield process
        finally:
            for number in (signal.SIGCONT, signal.SIGKILL):
                try:
                    os.killpg(process.pid, number)
                except ProcessLookupError:
                    break
            process.wait()


def plastica(*arguments: str) -> tuple[str, ...]:
    return (sys.executable, "-m", "plastica", *arguments)


def workers_of(process: subprocess.Popen[bytes]) -> list[int]:
    """The worker processes that a command has started."""
    found = []
    for entry in Path("/proc").iterdir():
        if entry.name.isdigit():
            try:
                parent = (entry / "stat").read_text().rsplit(")", 1)[1].split()[1]
                if int(parent) == process.pid and b"sweep_worker" in (entry / "cmdline").read_bytes():
                    found.append(int(entry.name))
            except (FileNotFoundError, ProcessLookupError):
                continue
    return found


def gone(number: int) -> bool:
    """Whether a process has ended, if it is not waited for either."""
    try:
        return (Path("/proc") / str(number) / "stat").read_text().rsplit(")", 1)[1].split()[0] == "Z"
    except (FileNotFoundError, ProcessLookupError):
        return True


def check_finished(folder: Path, whole: dict[str, bytes]) -> None:
    """Everything is there, as without a stop, and each chunk was written once."""
    store = open_store(folder)
    assert store.missing() == []
    assert Counter(logged(folder)) == dict.fromkeys(range(CHUNKS), 1)
    assert contents(folder) == whole


def test_local_workers_and_commands_may_be_killed(whole: dict[str, bytes], tmp_path: Path) -> None:
    written(tmp_path, TEXT)
    store, command = tmp_path / "s.sweep", plastica("sweep", "strut.toml", "--store", "s.sweep", "--workers", "2")
    # A worker is killed: another takes its place.
    with started(*command, folder=tmp_path, name="first") as first:
        wait(lambda: len(logged(store)) >= 2, "the first chunks", first)
        victim, *_ = workers_of(first)
        os.kill(victim, signal.SIGKILL)
        there = len(logged(store))
        wait(lambda: len(logged(store)) >= there + 2, "chunks after a worker was killed", first)
        # The command itself is killed: its workers end with it.
        left = workers_of(first)
        assert victim not in left
        first.kill()
        first.wait()
        wait(lambda: all(gone(number) for number in left), "the end of the workers")
    done = logged(store)
    assert len(done) < CHUNKS
    assert max(Counter(done).values()) == 1
    # Ctrl-C: exit code 130, with what to do next.
    with started(*command, folder=tmp_path, name="second") as second:
        wait(lambda: len(logged(store)) >= len(done) + 1, "chunks of the second command", second)
        left = workers_of(second)
        os.killpg(second.pid, signal.SIGINT)
        assert second.wait(PATIENCE) == 130
        wait(lambda: all(gone(number) for number in left), "the end of the workers")
    said = (tmp_path / "second.txt").read_text()
    assert "interrupted; what is done is kept" in said
    assert "Traceback" not in said
    with started(*command, folder=tmp_path, name="third") as third:
        assert third.wait(PATIENCE) == 0
    assert f"{CHUNK * CHUNKS} done" in (tmp_path / "third.txt").read_text()
    check_finished(store, whole)


def check_hopeless_chunk(folder: Path) -> None:
    """A chunk that ends its worker every time ends the sweep with a sentence; what is done is kept."""
    file = written(folder, TEXT)
    code = (
        "import os, sys\nfrom plastica.study import sweep_tasks, sweep_worker\n"
        "sound = sweep_tasks.compute\n"
        "def compute(plan, rows, apart):\n    if rows[0, 0] > 0.1: os._exit(9)\n    return sound(plan, rows, apart)\n"
        "sweep_tasks.compute = compute\nsweep_worker._as_process()\n"
    )
    with pytest.MonkeyPatch.context() as patch:
        sound = subprocess.Popen

        def popen(command: list[str], **options: Any) -> Any:
            return sound([sys.executable, "-c", code, command[-1]], **options)

        patch.setattr(sweep_engines.subprocess, "Popen", popen)
        with pytest.raises(FileError, match=r"a worker process has ended 3 times at chunk 18 \(exit code 9\)"):
            pl.sweep(file, store=folder / "s.sweep", workers=1)
    assert sorted(logged(folder / "s.sweep")) == list(range(18))


def test_a_chunk_that_kills_its_workers(tmp_path: Path) -> None:
    check_hopeless_chunk(tmp_path)


def dask(tool: str, *arguments: str) -> tuple[str, ...]:
    return (sys.executable, "-m", "distributed.cli." + tool, *arguments)


def test_a_cluster_whose_parts_are_killed_stopped_and_restarted(whole: dict[str, bytes], tmp_path: Path) -> None:
    written(tmp_path, TEXT)
    store, address = tmp_path / "s.sweep", tmp_path / "scheduler.json"
    serve = dask(
        "dask_scheduler", "--host", "127.0.0.1", "--port", "0", "--no-dashboard", "--scheduler-file", str(address)
    )
    work = dask(
        "dask_worker", "--scheduler-file", str(address), "--nworkers", "1", "--nthreads", "1", "--no-nanny",
        "--no-dashboard", "--local-directory", str(tmp_path),
    )  # fmt: skip
    with (
        started(*serve, folder=tmp_path, name="scheduler") as scheduler,
        started(*work, folder=tmp_path, name="one") as one,
        started(*work, folder=tmp_path, name="two") as two,
        started(*work, folder=tmp_path, name="three") as three,
    ):
        wait(address.is_file, "the scheduler", scheduler)
        for number in ("one", "two", "three"):
            said = tmp_path / f"{number}.txt"
            wait(lambda said=said: b"Registered to" in said.read_bytes(), f"worker {number}", scheduler)
        where = address_in(address)
        command = plastica("sweep", "strut.toml", "--store", "s.sweep", "--engine", "dask", "--scheduler", where)
        with started(*command, folder=tmp_path, name="client") as client:
            wait(lambda: len(logged(store)) >= 4, "the first chunks", client)
            one.kill()
            os.kill(two.pid, signal.SIGSTOP)
            there = len(logged(store))
            wait(lambda: len(logged(store)) >= there + 2, "chunks of the worker that is left", client)
            os.kill(two.pid, signal.SIGCONT)
            there = len(logged(store))
            wait(lambda: len(logged(store)) >= there + 2, "chunks of both workers", client)
            client.kill()
        # Chunks that are under way are finished even so.
        settled(where)
        assert len(logged(store)) < CHUNKS
        with started(*command, folder=tmp_path, name="again") as again:
            assert again.wait(PATIENCE) == 0, (tmp_path / "again.txt").read_text()
        assert three.poll() is None
    processes = {entry["process"] for entry in open_store(store).log()}
    assert processes <= {one.pid, two.pid, three.pid}
    assert two.pid in processes
    check_finished(store, whole)


def settled(where: str) -> None:
    """Wait until a scheduler has forgotten the tasks of commands that are gone, and its workers are idle."""
    import distributed

    with distributed.Client(where, set_as_default=False) as look:
        wait(lambda: not look.run_on_scheduler(lambda dask_scheduler: len(dask_scheduler.tasks)), "the scheduler")
        idle = lambda: not any(look.run(lambda dask_worker: len(dask_worker.active_threads)).values())  # noqa: E731
        wait(idle, "the workers")


def address_in(file: Path) -> str:
    """The address of a scheduler, from the file that it writes."""
    return str(json.loads(file.read_text())["address"])


def test_a_scheduler_that_is_not_there(tmp_path: Path) -> None:
    written(tmp_path, TEXT)
    command = plastica(
        "sweep", "strut.toml", "--store", "s.sweep", "--engine", "dask", "--scheduler", "tcp://127.0.0.1:9"
    )
    environment = {**os.environ, "DASK_DISTRIBUTED__COMM__TIMEOUTS__CONNECT": "1s"}
    done = subprocess.run(
        command, cwd=tmp_path, env=environment, capture_output=True, text=True, timeout=PATIENCE, check=False
    )
    assert done.returncode == 1
    waited, gave_up = done.stderr.splitlines()
    assert waited.endswith("members, waiting for the scheduler at tcp://127.0.0.1:9")
    assert "cannot be computed on the scheduler at tcp://127.0.0.1:9" in gave_up


def test_ctrl_c_ends_a_cluster_quietly(tmp_path: Path) -> None:
    """Ctrl-C ends a cluster of this machine with one line, without waiting for the chunks that are under way."""
    written(tmp_path, TEXT)
    command = plastica("sweep", "strut.toml", "--store", "s.sweep", "--engine", "dask", "--workers", "2")
    with started(*command, folder=tmp_path, name="client") as client:
        wait(lambda: logged(tmp_path / "s.sweep"), "the first chunk", client)
        os.killpg(client.pid, signal.SIGINT)
        assert client.wait(PATIENCE) == 130
    # On a slow machine the pace is told under way.
    said = [line for line in (tmp_path / "client.txt").read_text().splitlines() if " a second" not in line]
    assert len(said) == 1, said
    assert "interrupted; what is done is kept" in said[0]
    assert len(logged(tmp_path / "s.sweep")) < CHUNKS


def check_wait_is_told(folder: Path) -> None:
    """While a scheduler has no workers, the progress says so; with the first that comes it goes on."""
    import distributed

    told: list[str] = []
    with distributed.LocalCluster(n_workers=0, processes=False, protocol="tcp", dashboard_address=None) as cluster:

        def heard(now: Progress) -> None:
            if now.waiting and not any(told):
                cluster.scale(1)
            told.append(now.waiting)

        text = scenario() + '[sweep.over]\n"load.thrust" = [1.0, 2.0]\n'
        where = cluster.scheduler_address
        found = pl.sweep(
            written(folder, text),
            store=folder / "s.sweep",
            engine="dask",
            scheduler=where,
            progress=heard,
        )
    assert found.complete
    assert f"workers at {where}" in told, told
    assert (told[0], told[-1]) == ("", "")


def test_what_is_waited_for_is_told(tmp_path: Path) -> None:
    check_wait_is_told(tmp_path)


def test_a_scheduler_without_workers(tmp_path: Path) -> None:
    """A scheduler without workers is told of, once; Ctrl-C ends the wait, and workers that come end it as well."""
    written(tmp_path, scenario() + '[sweep.over]\n"load.thrust" = [1.0, 2.0]\n')
    store, address = tmp_path / "s.sweep", tmp_path / "scheduler.json"
    serve = ("--host", "127.0.0.1", "--port", "0", "--no-dashboard", "--scheduler-file", str(address))
    with started(*dask("dask_scheduler", *serve), folder=tmp_path, name="scheduler") as scheduler:
        wait(address.is_file, "the scheduler", scheduler)
        where = address_in(address)
        command = plastica("sweep", "strut.toml", "--store", "s.sweep", "--engine", "dask", "--scheduler", where)
        said, told = tmp_path / "client.txt", f"0 of 2 members, waiting for workers at {where}"
        with started(*command, folder=tmp_path, name="client") as client:
            wait(lambda: told in said.read_text(), "word of the wait", client)
            os.killpg(client.pid, signal.SIGINT)
            assert client.wait(PATIENCE) == 130
        assert len(said.read_text().splitlines()) == 2, said.read_text()
        with started(*command, folder=tmp_path, name="again") as again:
            said = tmp_path / "again.txt"
            wait(lambda: told in said.read_text(), "word of the wait", again)
            work = ("--scheduler-file", str(address), "--nthreads", "1", "--no-nanny", "--no-dashboard")
            with started(*dask("dask_worker", *work), folder=tmp_path, name="worker"):
                assert again.wait(PATIENCE) == 0, said.read_text()
    assert said.read_text().count("waiting for") == 1
    assert sorted(logged(store)) == [0]
