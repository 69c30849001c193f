"""The command line called within the tests' process, and scenarios to give it."""

from __future__ import annotations

import io
import os
from contextlib import redirect_stderr, redirect_stdout
from dataclasses import dataclass
from pathlib import Path
from unittest.mock import patch

from plastica.doors.cli import main

PARTS = {
    "head": 'title = "A strut"\n',
    "material": 'name = "one-shape"',
    "load": "thrust = 2.0",
    "initial": "curvature = 0.1\nnatural_curvature = 0.1",
    "grid": "nodes = 12",
    "solve": "until = 2.0",
    "output": 'film = "none"\nreport = false',
}

SI_PARTS = {
    "head": 'title = "A strip"\n',
    "specimen": 'length = "250 mm"\nbending_stiffness = "0.035 N*m**2"\nretardation_time = "120 s"',
    "material": 'name = "one-shape"',
    "load": 'thrust = "1.12 N"',
    "initial": 'curvature = "0.4 1/m"\nnatural_curvature = "0.4 1/m"',
    "grid": "nodes = 12",
    "solve": 'until = "4 min"',
    "output": 'film = "none"\nreport = false',
}


@dataclass(frozen=True)
class Answer:
    """What a command came to."""

    code: int
    out: str
    err: str


def call(*arguments: str | Path, folder: Path | None = None) -> Answer:
    """Run `plastica` with these arguments in a folder, in this process."""
    out, err, here = io.StringIO(), io.StringIO(), Path.cwd()
    try:
        os.chdir(folder or here)
        # A fixed width keeps the terminal of whoever runs the tests out of them.
        with patch.dict(os.environ, {"COLUMNS": "200"}), redirect_stdout(out), redirect_stderr(err):
            code = main([str(each) for each in arguments])
    finally:
        os.chdir(here)
    return Answer(code, out.getvalue(), err.getvalue())


def scenario(**changed: str | None) -> str:
    """A dimensionless scenario that runs in a moment, with sections changed, or left out (None)."""
    return _written("dimensionless", {**PARTS, **changed})


def si_scenario(**changed: str | None) -> str:
    """The same in SI units: gamma = 2, and the same curvature in units of 1/L."""
    return _written("SI", {**SI_PARTS, **changed})


def _written(units: str, parts: dict[str, str | None]) -> str:
    head = f'schema = 1\nunits = "{units}"\n{parts["head"] or ""}'
    sections = (f"[{name}]\n{text}\n" for name, text in parts.items() if name != "head" and text is not None)
    return head + "".join(sections)


def written(folder: Path, text: str, name: str = "strut.toml") -> Path:
    """Write a scenario into a folder."""
    path = folder / name
    path.write_text(text, encoding="utf-8")
    return path


def snapshot(*folders: Path) -> dict[str, tuple[int, int]]:
    """Every file below some folders, with its size and time of change."""
    found = {}
    for folder in folders:
        for path in folder.rglob("*"):
            status = path.lstat()
            found[str(path)] = (status.st_size, status.st_mtime_ns if not path.is_dir() else 0)
    return found
