"""A result as one self-contained page that explains itself: no network, no scripts, everything inside."""

from __future__ import annotations

from importlib.resources import files
from pathlib import Path
from typing import TYPE_CHECKING, Final

from plastica.errors import ArgumentError
from plastica.files import write_whole
from plastica.motion.solution import Solution
from plastica.show.film import SECONDS, Reel, check_suffix, reel
from plastica.show.sections import SECTIONS
from plastica.show.subject import Subject

if TYPE_CHECKING:
    from jinja2 import Environment

__all__ = ["page", "report", "report_and_film"]

SUFFIXES: Final = (".html", ".htm")


def report(solution: Solution, path: str | Path, *, film_seconds: float = SECONDS) -> Path:
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
    _check_suffix(target)
    text = page(solution, film_seconds=film_seconds)
    return write_whole(target, lambda aside: aside.write_text(text, encoding="utf-8"))


def report_and_film(solution: Solution, report_file: Path | None, film_file: Path | None) -> list[Path]:
    """Write the report on a result, its film, or both, as `report` and `film` do; what both show is drawn once.

    Parameters
    ----------
    solution : Solution
        A finished motion.
    report_file, film_file : Path or None
        Where to; None where it is not wanted.

    Returns
    -------
    list of Path
        The files.

    Raises
    ------
    ArgumentError
        Where a suffix is another, or ffmpeg is missing.
    FileError
        Where a file cannot be written.
    """
    if report_file is not None:
        _check_suffix(report_file)
    if film_file is None:
        return [] if report_file is None else [report(solution, report_file)]
    check_suffix(film_file)
    drawn = reel(solution)
    written = []
    if report_file is not None:
        text = page(solution, drawn=drawn)
        written.append(write_whole(report_file, lambda aside: aside.write_text(text, encoding="utf-8")))
    return [*written, drawn.write(film_file)]


def _check_suffix(target: Path) -> None:
    if target.suffix.lower() not in SUFFIXES:
        raise ArgumentError("must end in .html", where="path", value=str(target))


def page(solution: Solution, *, film_seconds: float = SECONDS, drawn: Reel | None = None) -> str:
    """Return the report on a result as HTML text, with its film as `drawn`; the rest as for `report`."""
    if not isinstance(solution, Solution):
        raise ArgumentError("must be a Solution", where="solution", value=solution)
    if not (isinstance(film_seconds, (int, float)) and 0.0 <= film_seconds <= 60.0):
        raise ArgumentError("must be a number from 0 to 60", where="film_seconds", value=film_seconds)
    subject = Subject(solution, float(film_seconds), drawn)
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
