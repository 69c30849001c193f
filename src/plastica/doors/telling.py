"""How the command line speaks: tables on a console, JSON, and words on standard error."""

from __future__ import annotations

import json
from typing import Any

import click

__all__ = ["console", "print_json", "say"]


def console() -> Any:
    """Return the console that tables are printed on."""
    from rich.console import Console

    return Console()


def print_json(value: Any) -> None:
    """Print plain values as one JSON object; numbers that are not finite become null."""
    from plastica.doors.numbers import clean

    click.echo(json.dumps(clean(value), ensure_ascii=False, allow_nan=False, indent=2))


def say(message: str) -> None:
    """Tell something on standard error."""
    click.echo(f"plastica: {message}", err=True)
