"""Progress bars on standard error, for what takes longer than a second."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Final

from plastica.doors.numbers import shown

if TYPE_CHECKING:
    from rich.progress import Progress as Bar

    from plastica.motion.solve import Progress

__all__ = ["bar", "counter", "meter"]

PATIENCE: Final = 1.0


@contextmanager
def bar(*, wanted: bool) -> Iterator[Callable[[float, float | None, str], None]]:
    """Give a function that shows how much is done, of how much (None: nobody knows), and words.

    It shows nothing within the first second, or where there is no terminal to show it on. In the end the bar is gone.
    """
    began, watched = time.perf_counter(), wanted and sys.stderr.isatty()
    running: Bar | None = None

    def show(done: float, every: float | None, words: str) -> None:
        nonlocal running
        if not watched or time.perf_counter() - began < PATIENCE:
            return
        if running is None:
            running = _started(every)
        running.update(running.task_ids[0], completed=done, description=words)

    try:
        yield show
    finally:
        if running is not None:
            running.stop()


@contextmanager
def meter(*, wanted: bool, si: bool) -> Iterator[Callable[[Progress], None]]:
    """Give a function that shows where a run has got to."""
    unit = "s" if si else ""
    with bar(wanted=wanted) as show:

        def tell(now: Progress) -> None:
            until = "" if now.until is None else f" of {shown(now.until, unit)}"
            state = "yielding" if now.yielding else "frozen"
            show(now.t, now.until, f"t = {shown(now.t, unit)}{until}, {now.steps} steps, {state}")

        yield tell


@contextmanager
def counter(*, wanted: bool, words: str) -> Iterator[Callable[[int, int], None]]:
    """Give a function that shows how many of a known number are done."""
    with bar(wanted=wanted) as show:
        yield lambda done, every: show(done, every, f"{done} of {every} {words}")


def _started(total: float | None) -> Bar:
    """A running bar on standard error that is gone in the end."""
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

    columns = (TextColumn("{task.description}", markup=False), BarColumn(), TimeElapsedColumn())
    made = Progress(*columns, console=Console(stderr=True), transient=True)
    made.add_task("", total=total)
    made.start()
    return made
