"""The command on many rods: sweep."""

from __future__ import annotations

import os
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import click

from plastica.doors.equilibria import SUFFIXES
from plastica.doors.telling import DONE, FAILED, INTERRUPTED, console, print_json, say, tell
from plastica.errors import ArgumentError, FileError

if TYPE_CHECKING:
    from plastica.study.sweep import Progress
    from plastica.study.sweep_estimate import Estimate
    from plastica.study.sweep_plan import Plan
    from plastica.study.sweep_result import Sweep
    from plastica.study.sweep_store import Store

__all__ = ["sweep"]

_FILE = click.Path(path_type=Path)

SAID_EVERY: Final = 30.0
"""Seconds between two lines on the progress where there is no terminal."""

MOST_REPORTS: Final = 100
REPORTS: Final = "reports"
"""The folder of the pages within that of the sweep."""

WORTH_A_LOOK: Final = 5


@click.command()
@click.argument("scenario", type=_FILE)
@click.option("--store", "-s", type=_FILE, help="Folder of the results.  [default: out/<scenario's name>.sweep]")
@click.option("--engine", default="local", show_default=True, help="local, or dask.")
@click.option("--workers", type=int, help="Processes.  [default: one for each core]")
@click.option("--scheduler", help="Address of a Dask scheduler, tcp://host:8786.")
@click.option("--estimate", is_flag=True, help="Say what it will take, by a few members, and compute no more.")
@click.option("--status", is_flag=True, help="Say what is there, and compute nothing.")
@click.option("--plot", "picture", type=_FILE, help="Draw the regimes into this file (.png, .svg or .pdf).")
@click.option("--reports", default=0, type=click.IntRange(0, MOST_REPORTS), help="Pages on so many notable members.")
@click.option("--quiet", "-q", is_flag=True, help="Print nothing but mistakes and failures.")
@click.option("--json", "as_json", is_flag=True, help="Print one JSON object and nothing else.")
def sweep(
    scenario: Path,
    store: Path | None,
    engine: str,
    workers: int | None,
    scheduler: str | None,
    estimate: bool,
    status: bool,
    picture: Path | None,
    reports: int,
    quiet: bool,
    as_json: bool,
) -> int:
    """Run SCENARIO for all members of its table [sweep], or go on with the sweep in a folder.

    What is interrupted, by Ctrl-C or in any other way, goes on where it was when the same command is given again.
    """
    from plastica.files import refuse_overwriting
    from plastica.study.sweep_engines import check_engine

    if picture is not None:
        refuse_overwriting(picture, scenario)
    check_engine(engine, workers, scheduler)
    if estimate:
        if scheduler is not None:
            say(f"the time is that of this machine, which does not know the workers of {scheduler}")
        return _estimated(_plan(scenario), workers, scenario if scenario.is_dir() else store, as_json)
    began = time.perf_counter()
    opened = _opened(scenario, store, status, lambda plan, target: _check_wanted(plan, target, picture, reports))
    if not status:
        code = _computed(opened, (engine, workers, scheduler), quiet=quiet or as_json)
        if code != DONE:
            return code
    seconds = time.perf_counter() - began
    return _told(opened, picture, reports, seconds, as_json=as_json, quiet=quiet)


def _plan(scenario: Path) -> Plan:
    from plastica.study.sweep import plan_of
    from plastica.study.sweep_store import open_store

    return open_store(scenario).plan if scenario.is_dir() else plan_of(scenario, {})


def _check_wanted(plan: Plan, target: Path, picture: Path | None, reports: int) -> None:
    """Refuse a picture or pages that could not be written in the end, before anything is computed."""
    if picture is not None:
        from plastica.show.regimes import check_drawable

        if picture.suffix.lower() not in SUFFIXES:
            raise ArgumentError(f"must end in one of {', '.join(SUFFIXES)}", where="--plot", value=str(picture))
        if not _may_write(picture.parent) or picture.is_dir():
            rule = "must be a file in a folder that exists and may be written to"
            raise ArgumentError(rule, where="--plot", value=str(picture))
        check_drawable(plan)
    if reports and target.is_dir():
        folder = target / REPORTS
        if not _may_write(folder if folder.exists() else target):
            rule = f"needs the folder {folder} to write to, which cannot be made or written to"
            raise ArgumentError(rule, where="--reports")


def _may_write(folder: Path) -> bool:
    return folder.is_dir() and os.access(folder, os.W_OK | os.X_OK)


def _opened(scenario: Path, store: Path | None, status: bool, check: Callable[[Plan, Path], None]) -> Store:
    """The store of a sweep, what is wanted of it checked: found where a folder is named, else made or taken up."""
    from plastica.study.sweep import default_store
    from plastica.study.sweep_create import create
    from plastica.study.sweep_differences import differences
    from plastica.study.sweep_store import open_store

    if scenario.is_dir():
        if store is not None:
            raise ArgumentError("must be left out where the folder of a sweep is given", where="--store")
        found = open_store(scenario)
        check(found.plan, scenario)
        if not status:
            found.check_versions()
        return found
    plan = _plan(scenario)
    target = store or default_store(plan)
    if not status:
        check(plan, target)
        return create(target, plan)
    found = open_store(target)
    check(found.plan, target)
    other = differences(found, plan)
    if other:
        say(f"`{target}` holds another sweep than {scenario} says, and it is that which is told: {other}")
    return found


def _computed(store: Store, engine: tuple[str, int | None, str | None], *, quiet: bool) -> int:
    """Compute what is missing; return the exit code."""
    from plastica.study.sweep import compute_missing

    name, workers, scheduler = engine
    try:
        with _meter(wanted=not quiet) as tell:
            compute_missing(store, name, workers, scheduler, tell)
    except KeyboardInterrupt:
        say("interrupted; what is done is kept. To go on from there, give the same command again")
        return INTERRUPTED
    except FileError as error:
        say(str(error))
        return FAILED
    return DONE


@contextmanager
def _meter(*, wanted: bool) -> Iterator[Callable[[Progress], None]]:
    """Give a function that shows how far a sweep is: by a bar on a terminal, else by a line now and then."""
    from plastica.doors.progress import bar
    from plastica.study.sweep_estimate import duration

    terminal, said, waited = sys.stderr.isatty(), time.perf_counter(), ""
    with bar(wanted=wanted) as show:

        def tell(now: Progress) -> None:
            nonlocal said, waited
            left = f", {duration(now.left)} left" if now.left == now.left else ""
            pace = f"waiting for {now.waiting}" if now.waiting else f"{now.rate:.3g} a second{left}"
            words, before, waited = f"{now.members} of {now.of} members, {pace}", waited, now.waiting
            if terminal:
                show(now.members, now.of, words)
            elif wanted and (time.perf_counter() - said > SAID_EVERY or waited not in ("", before)):
                said = time.perf_counter()
                say(words)

        yield tell


def _estimated(plan: Plan, workers: int | None, store: Path | None, as_json: bool) -> int:
    from plastica.study.sweep_estimate import estimate

    found: Estimate = estimate(plan, workers, store)
    if as_json:
        print_json(vars(found))
    else:
        tell(found)
    return DONE


def _told(store: Store, picture: Path | None, reports: int, seconds: float, *, as_json: bool, quiet: bool) -> int:
    """Say what came of a sweep, and write what was asked for."""
    from plastica.study.sweep_result import Sweep

    found = Sweep(store)
    files = _pictures(found, picture) + _reports(found, reports)
    if as_json:
        print_json({**_facts(found), "judged_by": "contents", "files": files, "seconds": seconds})
    elif not quiet:
        _print(found, files, seconds)
    if found.failed:
        say(f"{found.failed} of {found.done} members did not end as asked; see the table of how they ended")
    return FAILED if found.failed else DONE


def _pictures(found: Sweep, picture: Path | None) -> list[Path]:
    if picture is None:
        return []
    from plastica.show.save import save_picture

    return [save_picture(found, picture)]


def _reports(found: Sweep, count: int) -> list[Path]:
    """Pages of the members most worth a look, in the folder of the sweep; those that were refused have none."""
    if not count:
        return []
    from plastica.errors import PlasticaError, StorageError
    from plastica.show.report import report

    folder, written = found.path / REPORTS, []
    folder.mkdir(exist_ok=True)
    for each in found.interesting(count):
        try:
            written.append(report(found.solve(each.member), folder / f"member-{each.member}.html"))
        except StorageError:
            raise
        except PlasticaError as error:
            say(f"member {each.member}: {error}")
    return written


def _facts(found: Sweep) -> dict[str, Any]:
    return {
        "sweep": found.path,
        "results": found.results,
        "members": found.members,
        "done": found.done,
        "failed": found.failed,
        "over": [axis.key for axis in found.axes],
        "sampling": found.plan.members.sampling,
        "chunks": found.plan.chunks,
        "status": found.counts,
        "one_by_one": [{"chunk": chunk, "because": reason} for chunk, reason in found.apart.items()],
        "regimes": found.regimes,
        "interesting": [vars(each) for each in found.interesting(WORTH_A_LOOK)] if found.done else [],
    }


def _print(found: Sweep, files: list[Path], seconds: float) -> None:
    from plastica.doors.tables import pairs, row

    table = pairs(found.plan.base.title or "Sweep")
    varied = ", ".join(axis.key for axis in found.axes)
    row(table, "members", f"{found.members} over {varied} ({found.plan.members.sampling}), {found.done} done")
    for ending, count in found.counts.items():
        if ending != "pending":
            row(table, "ended", f"{count} {ending}")
    if not found.complete:
        row(table, "pending", f"{found.members - found.done} not begun, missing or damaged: the next run computes them")
    if found.apart:
        reason = next(iter(found.apart.values()))
        row(table, "one by one", f"{len(found.apart)} of {found.plan.chunks} chunks, which takes longer: {reason}")
    for regime, count in found.regimes.items():
        if regime != "pending":
            row(table, "came to", f"{count} {regime}")
    for each in found.interesting(WORTH_A_LOOK) if found.done else ():
        row(table, f"member {each.member}", f"{each.why}: {each.takes}")
    row(table, "results", found.results)
    for file in files:
        row(table, "written", file)
    row(table, "cost", f"{seconds:.2f} s")
    console().print(table)
