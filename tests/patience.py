"""What keeps tests free of the speed of a machine: waits for what happens, and work that is counted, not timed."""

from __future__ import annotations

import subprocess
import sys
import time
from collections.abc import Callable
from typing import Any

PATIENCE = 600.0
"""Seconds after which what never happens is given up: a safety net for a busy machine, never a measure."""


def wait(happened: Callable[[], Any], what: str, process: subprocess.Popen[Any] | None = None) -> None:
    """Wait until something has happened; fail if it never does, or if the process ends before."""
    end = time.monotonic() + PATIENCE
    while not happened():
        assert time.monotonic() < end, f"waited too long for {what}"
        assert process is None or process.poll() is None, f"ended before {what}: {process.returncode}"
        time.sleep(0.02)


def calls(action: Callable[[], Any]) -> int:
    """Return how many functions an action calls in this thread, of Python and of C: its work on any machine."""
    count = 0

    def seen(_frame: Any, event: str, _argument: Any) -> None:
        nonlocal count
        count += event in ("call", "c_call")

    before = sys.getprofile()
    sys.setprofile(seen)
    try:
        action()
    finally:
        sys.setprofile(before)
    return count
