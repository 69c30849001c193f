"""How the command line speaks: tables on a console, JSON, and words on standard error."""

from __future__ import annotations

import contextlib
import json
import signal
import threading
from collections.abc import Iterator
from typing import Any

import click

from plastica.errors import PlasticaError, StorageError, safe_text

__all__ = [
    "DONE",
    "FAILED",
    "INTERRUPTED",
    "MISTAKE",
    "NO_MEMORY",
    "console",
    "exit_code",
    "print_json",
    "say",
    "tell",
    "terminable",
]

DONE, FAILED, MISTAKE, INTERRUPTED = 0, 1, 2, 130

NO_MEMORY = "there is not enough memory. Take fewer nodes, or name the times of the result under `times`"


def exit_code(error: PlasticaError) -> int:
    """Return 1 where the machine refuses what was asked, and 2 where the user has made a mistake."""
    return FAILED if isinstance(error, StorageError) else MISTAKE


@contextlib.contextmanager
def terminable() -> Iterator[None]:
    """Let a request to end, or the end of the terminal, interrupt as Ctrl-C does, unless it is handled or ignored."""
    changed = []
    if threading.current_thread() is threading.main_thread():
        for number in (getattr(signal, name, None) for name in ("SIGTERM", "SIGHUP")):
            if number is not None and signal.getsignal(number) == signal.SIG_DFL:
                signal.signal(number, signal.default_int_handler)
                changed.append(number)
    try:
        yield
    finally:
        for number in changed:
            signal.signal(number, signal.SIG_DFL)


def console() -> Any:
    """Return the console that tables are printed on."""
    from rich.console import Console

    return Console()


def print_json(value: Any) -> None:
    """Print plain values as one JSON object; numbers that are not finite become null."""
    from plastica.doors.numbers import clean

    text = json.dumps(clean(value), ensure_ascii=False, allow_nan=False, indent=2)
    if safe_text(text) != text:
        # Such characters can only stand within strings, where JSON has escapes for them.
        text = "".join(each if safe_text(each) == each else _as_json(each) for each in text)
    click.echo(text)


def _as_json(character: str) -> str:
    pair = character.encode("utf-16-be", "surrogatepass").hex()
    return "".join(f"\\u{pair[i : i + 4]}" for i in range(0, len(pair), 4))


def tell(message: object) -> None:
    """Tell something on standard output."""
    click.echo(safe_text(message))


def say(message: str) -> None:
    """Tell something on standard error."""
    click.echo(safe_text(f"plastica: {message}"), err=True)
