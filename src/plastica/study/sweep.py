"""A scenario for many values at once: plan it, compute it in chunks that nothing can lose, read it at any time."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from plastica.errors import ArgumentError
from plastica.study.reading import Document, document_of, read_document
from plastica.study.scenario import Scenario
from plastica.study.sweep_create import create, mend_fixed
from plastica.study.sweep_engines import check_engine, computed
from plastica.study.sweep_plan import Plan
from plastica.study.sweep_reading import make_plan
from plastica.study.sweep_result import Sweep
from plastica.study.sweep_store import Store
from plastica.study.sweep_tasks import Told

__all__ = ["Given", "Progress", "compute_missing", "default_store", "plan_of", "sweep"]

Given = str | Path | Scenario
"""A scenario: the path of its file, its text, or one that was read."""


@dataclass(frozen=True)
class Progress:
    """How far a sweep has come.

    Attributes
    ----------
    members, of : int
        Members done, and all.
    failed : int
        Members, of those seen, that did not end as asked.
    rate : float
        Members computed per second in this call; 0 while there is none to tell by.
    left : float
        Seconds left at that rate; nan where it is not known.
    waiting : str
        What is waited for before anything can go on, as "workers at tcp://host:8786"; "" where nothing is.
    """

    members: int
    of: int
    failed: int
    rate: float
    left: float
    waiting: str = ""


def sweep(
    scenario: Given,
    over: Mapping[str, Any] | None = None,
    *,
    store: str | Path | None = None,
    sampling: str | None = None,
    members: int | None = None,
    seed: int | None = None,
    csv: str | None = None,
    outputs: Sequence[str] | None = None,
    times: Sequence[float] | Sequence[str] | None = None,
    chunk: int | None = None,
    library: str | None = None,
    engine: str = "local",
    workers: int | None = None,
    scheduler: str | None = None,
    progress: Callable[[Progress], None] | None = None,
) -> Sweep:
    """Run a scenario for many values of its keys, and keep the results in a store that can be taken up at any time.

    The members are shared out in chunks, one task each. A chunk that is done stays done: interrupt with Ctrl-C, kill
    any process, lose a machine, and give the same call again; only what is missing is computed. The finished store is
    the same, chunk for chunk and bit for bit, whatever the engine, the number of workers and the interruptions, on
    processors of one kind.

    Parameters
    ----------
    scenario : path, text or Scenario
        A scenario that can be run as it is; its table [sweep], if it has one, says what is not given here.
    over : mapping of str to values, optional
        From keys of the scenario ("load.thrust", "material.parameters.k", "initial.curvature") to the values that
        they take, each as the scenario takes it: an array, or a range {"from": a, "to": b, "count": n, "spacing":
        "linear" or "log"}, without count where members are drawn. "initial.amplitude" multiplies the initial curvature.
    store : str or Path, optional
        Folder of the results; by default out/<name>.sweep in the present folder.
    sampling : str, optional
        "grid" (the default: all combinations, the first key varying slowest), "list" (the values side by side),
        "latin-hypercube", "random", or "csv".
    members, seed : int, optional
        Number of members that are drawn, and what they are drawn by (0).
    csv : str, optional
        File of members in the folder of the scenario, a column for each key.
    outputs : sequence of str, optional
        Of "final" (natural curvature, drive, threshold, free end, Liapunov function), "verdict" (regime), "limit",
        "state" (curvature at the end) and "histories" (at `times`); by default the first two.
    times : sequence, optional
        Times of the histories, as the scenario takes them.
    chunk : int, optional
        Members of a task; by default chosen by their number.
    library : str, optional
        "numpy" (the default), or "numba": members that are computed together then take half of the time.
    engine : str
        "local" (processes of this machine) or "dask" (`dask.distributed`).
    workers : int, optional
        Processes; by default one for each core. 0 computes in this process.
    scheduler : str, optional
        Address of a Dask scheduler whose workers share the folder of the store; by default a cluster on this machine.
    progress : callable, optional
        Called with a `Progress` after every chunk, and every few seconds while a cluster is waited for.

    Returns
    -------
    Sweep

    Raises
    ------
    PlasticaError
        Where the scenario or what is varied has mistakes, or the store holds another sweep or cannot be written.
        Numerical trouble of a member is its status.
    """
    check_engine(engine, workers, scheduler)
    given = {"over": over, "sampling": sampling, "members": members, "seed": seed, "csv": csv}
    plan = plan_of(scenario, {**given, "outputs": outputs, "times": times, "chunk": chunk, "library": library})
    made = create(default_store(plan) if store is None else store, plan)
    compute_missing(made, engine, workers, scheduler, progress)
    return Sweep(made)


def compute_missing(
    store: Store,
    engine: str = "local",
    workers: int | None = None,
    scheduler: str | None = None,
    progress: Callable[[Progress], None] | None = None,
) -> None:
    """Compute the chunks of a store that are not done; arguments as of `sweep`."""
    mend_fixed(store)
    meter = _Meter(store, progress)
    missing = meter.looked_through()
    for told in computed(store, missing, engine, workers, scheduler, meter.tell):
        meter.add(told)
    store.tidy()


class _Meter:
    """Counts what is done, and tells."""

    def __init__(self, store: Store, progress: Callable[[Progress], None] | None) -> None:
        self.store, self.progress = store, progress
        self.members = self.failed = self.now = 0
        self.began = time.perf_counter()

    def looked_through(self) -> list[int]:
        """Return the chunks that are missing, having counted the others."""
        missing = self.store.missing()
        gone = set(missing)
        for chunk in range(self.store.plan.chunks):
            if chunk not in gone:
                first, last = self.store.plan.span(chunk)
                self.members += last - first
        self.tell()
        self.began = time.perf_counter()
        return missing

    def add(self, told: Told) -> None:
        self.members += told.members
        self.failed += told.failed
        self.now += told.members if told.computed else 0
        self.tell()

    def tell(self, waiting: str = "") -> None:
        if self.progress is None:
            return
        rate = self.now / max(time.perf_counter() - self.began, 1e-9)
        left = (self.store.plan.count - self.members) / rate if rate > 0.0 else float("nan")
        self.progress(Progress(self.members, self.store.plan.count, self.failed, rate, left, waiting))


def plan_of(scenario: Given, given: Mapping[str, Any]) -> Plan:
    """Plan a sweep without making its store; see `sweep`.

    Raises
    ------
    PlasticaError
        Where the scenario or what is varied has mistakes.
    """
    return make_plan(_document(scenario), given)


def _document(scenario: Given) -> Document:
    if isinstance(scenario, Scenario):
        return document_of(scenario.text, scenario.file)
    if isinstance(scenario, str) and "\n" in scenario:
        return document_of(scenario, "scenario.toml")
    if isinstance(scenario, (str, Path)):
        return read_document(scenario)
    raise ArgumentError("must be the path or the text of a scenario, or a Scenario", where="scenario", value=scenario)


def default_store(plan: Plan) -> Path:
    """Return where a sweep goes unless told otherwise: out/<name of the scenario's file>.sweep."""
    return Path("out") / f"{plan.document.file.stem}.sweep"
