"""Progress bars on standard error, for what takes longer than a second."""

from __future__ import annotations

import sys
import time
from types import TracebackType
from typing import TYPE_CHECKING

from plastica.doors.numbers import shown

if TYPE_CHECKING:
    from rich.progress import Progress as Bar

    from plastica.motion.solve import Progress

__all__ = ["Counter", "Meter"]

PATIENCE = 1.0


class Meter:
    """Shows a `Progress` now and then, if there is a terminal to show it on; used in a `with` statement."""

    def __init__(self, *, wanted: bool, si: bool) -> None:
        self.wanted, self.unit = wanted and sys.stderr.isatty(), "s" if si else ""
        self._bar: Bar | None = None
        self._task = 0

    def __enter__(self) -> Meter:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._bar is not None:
            self._bar.stop()

    def __call__(self, now: Progress) -> None:
        """Show where the run has got to, once it has taken a second."""
        if not self.wanted or now.wall < PATIENCE:
            return
        if self._bar is None:
            self._bar = _bar(now.until)
        until = "" if now.until is None else f" of {shown(now.until, self.unit)}"
        words = f"t = {shown(now.t, self.unit)}{until}, {now.steps} steps, {'yielding' if now.yielding else 'frozen'}"
        self._bar.update(self._bar.task_ids[0], completed=now.t, description=words)


class Counter:
    """Shows how many of a known number are done, if there is a terminal to show it on; used in a `with` statement."""

    def __init__(self, *, wanted: bool, words: str) -> None:
        self.wanted, self.words, self.began = wanted and sys.stderr.isatty(), words, time.perf_counter()
        self._bar: Bar | None = None

    def __enter__(self) -> Counter:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._bar is not None:
            self._bar.stop()

    def __call__(self, done: int, every: int) -> None:
        """Show how many are done, once it has taken a second."""
        if not self.wanted or time.perf_counter() - self.began < PATIENCE:
            return
        if self._bar is None:
            self._bar = _bar(every)
        self._bar.update(self._bar.task_ids[0], completed=done, description=f"{done} of {every} {self.words}")


def _bar(total: float | None) -> Bar:
    """A running bar on standard error that is gone in the end."""
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

    columns = (TextColumn("{task.description}", markup=False), BarColumn(), TimeElapsedColumn())
    bar = Progress(*columns, console=Console(stderr=True), transient=True)
    bar.add_task("", total=total)
    bar.start()
    return bar
