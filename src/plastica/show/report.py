"""A result as one self-contained page that explains itself: no network, no scripts, everything inside."""

from __future__ import annotations

from importlib.resources import files
from pathlib import Path
from typing import TYPE_CHECKING, Final

from plastica.errors import ArgumentError
from plastica.files import write_whole
from plastica.motion.solution import Solution
from plastica.show.sections import SECTIONS
from plastica.show.subject import Subject

if TYPE_CHECKING:
    from jinja2 import Environment

__all__ = ["page", "report"]

SUFFIXES: Final = (".html", ".htm")


def report(solution: Solution, path: str | Path, *, film_seconds: float = 8.0) -> Path:
    """Write the report on a result: one HTML file with everything in it.

    Parameters
    ----------
    solution : Solution
        A finished motion, whole or stopped early.
    path : str or Path
        Ends in .html.
    film_seconds : float
        How long its film runs, in [0, 60]; 0 leaves the film out.

    Returns
    -------
    Path
        The file, which appears whole or not at all.

    Raises
    ------
    ArgumentError
        Where the solution is none, the suffix another, or the length of the film out of range.
    FileError
        Where the file cannot be written.
    """
    target = Path(path)
    if target.suffix.lower() not in SUFFIXES:
        raise ArgumentError("must end in .html", where="path", value=str(target))
    text = page(solution, film_seconds=film_seconds)
    return write_whole(target, lambda aside: aside.write_text(text, encoding="utf-8"))


def page(solution: Solution, *, film_seconds: float = 8.0) -> str:
    """Return the report on a result as HTML text; arguments and errors as for `report`."""
    if not isinstance(solution, Solution):
        raise ArgumentError("must be a Solution", where="solution", value=solution)
    if not (isinstance(film_seconds, (int, float)) and 0.0 <= film_seconds <= 60.0):
        raise ArgumentError("must be a number from 0 to 60", where="film_seconds", value=film_seconds)
    subject = Subject(solution, float(film_seconds))
    made = [section for make in SECTIONS if (section := make(subject)) is not None]
    return (
        _environment()
        .get_template("report.html.j2")
        .render(
            title=solution.provenance.get("title") or "A rod that remembers",
            description=solution.provenance.get("description", ""),
            sections=made,
            css=files("plastica.show").joinpath("templates/report.css").read_text(encoding="utf-8"),
        )
    )


def _environment() -> Environment:
    """Templates in which every inserted text is escaped and a missing name is an error."""
    from jinja2 import Environment, PackageLoader, StrictUndefined

    return Environment(
        loader=PackageLoader("plastica.show", "templates"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
