"""A picture of a result in a file."""

from __future__ import annotations

from pathlib import Path
from typing import Final

from plastica.errors import ArgumentError
from plastica.files import write_whole
from plastica.motion.solution import Solution
from plastica.show.plots import plot
from plastica.show.style import drawing

__all__ = ["save_picture"]

SUFFIXES: Final = (".png", ".svg", ".pdf")
DPI: Final = 160


def save_picture(result: object, path: str | Path, *, motion: Solution | None = None) -> Path:
    """Draw a result into a file, whole or not at all.

    Parameters
    ----------
    result : object
        What `plot` takes.
    path : str or Path
        Ends in .png, .svg or .pdf.
    motion : Solution, optional
        A motion whose path is drawn into a phase diagram.

    Returns
    -------
    Path
        The file.

    Raises
    ------
    ArgumentError
        Where the suffix is another, or there is no picture of the result.
    FileError
        Where the file cannot be written.
    """
    target = Path(path)
    if target.suffix.lower() not in SUFFIXES:
        raise ArgumentError(f"must end in one of {', '.join(SUFFIXES)}", where="--plot", value=str(target))
    figure = plot(result, path=motion)
    kind = target.suffix.lower()[1:]

    def write(aside: Path) -> None:
        with drawing():
            figure.savefig(aside, format=kind, dpi=DPI, metadata={} if kind == "png" else {_DATE[kind]: None})

    return write_whole(target, write)


_DATE: Final = {"svg": "Date", "pdf": "CreationDate"}
