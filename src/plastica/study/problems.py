"""Mistakes of a scenario file, collected so that all are reported at once."""

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import contextmanager
from typing import NamedTuple, TypeVar

from plastica.errors import FileError, PlasticaError, ScenarioError
from plastica.study.reading import Document
from plastica.study.tokens import KeyPath, key_text

__all__ = ["Problems"]

T = TypeVar("T")


class _Problem(NamedTuple):
    line: int
    path: KeyPath
    sentence: str
    lacks: tuple[KeyPath, ...]
    meant: KeyPath | None

    def __str__(self) -> str:
        place = f"line {self.line}: " if self.line else ""
        return f"{place}`{key_text(self.path)}` {self.sentence}"


class Problems:
    """The mistakes found so far in one document."""

    def __init__(self, document: Document) -> None:
        self.document = document
        self._found: list[_Problem] = []

    def add(
        self, path: KeyPath, sentence: str, *, lacks: tuple[KeyPath, ...] = (), meant: KeyPath | None = None
    ) -> None:
        """Note a mistake.

        Parameters
        ----------
        path : tuple
            The key.
        sentence : str
            "must be ..., but is ....", the end of a sentence that begins with the key.
        lacks : tuple of key paths
            Keys any one of which would have mended it: it is not told where one of them was only misspelt.
        meant : key path, optional
            Which key a misspelt one was probably meant to be.
        """
        problem = _Problem(self.document.line(path) or 0, path, sentence, lacks, meant)
        if problem not in self._found:
            self._found.append(problem)

    def add_error(self, path: KeyPath, error: PlasticaError) -> None:
        """Note what a constructor has refused, under the key that it belongs to."""
        message, where = str(error), _steps(error.where)
        if isinstance(error, FileError) or where is None:
            self.add(path, f"cannot be used: {message}")
            return
        full = (*path, *where[1:]) if where[:1] == path[-1:] else (*path, *where)
        self.add(full, message.removeprefix(f"`{error.where}` "))

    @contextmanager
    def at(self, *path: str | int) -> Iterator[None]:
        """Catch what a constructor refuses within, as a mistake at `path`."""
        try:
            yield
        except PlasticaError as error:
            self.add_error(path, error)

    def within(self, *sections: str) -> bool:
        """Tell whether one of these sections has a mistake."""
        return any(problem.path[:1] == (name,) for problem in self._found for name in sections)

    def settled(self, value: T | None) -> T:
        """Return a value that is None only where a mistake was found.

        Raises
        ------
        ScenarioError
            With all that was found, if there is no value.
        """
        if value is None:
            self.refuse()
            raise ScenarioError(str(self.document.file), ("the scenario cannot be used.",))
        return value

    def refuse(self) -> None:
        """Raise all that was found, if anything was, in the order of lines; a key that is only misspelt lacks nowhere.

        Raises
        ------
        ScenarioError
            With one sentence for each mistake.
        """
        if self._found:
            meant = {problem.meant for problem in self._found}
            told = [problem for problem in self._found if meant.isdisjoint(problem.lacks)]
            ordered = sorted(told, key=lambda problem: problem.line)
            raise ScenarioError(str(self.document.file), tuple(map(str, ordered)))


def _steps(where: str) -> KeyPath | None:
    """Read "values[3]" or "section.width" as key path; None for a phrase such as "length and time"."""
    if where and not re.fullmatch(r"[A-Za-z_][\w-]*(?:\.[\w-]+|\[\d+\])*", where):
        return None
    return tuple(int(part) if part.isdigit() else part for part in re.findall(r"[\w-]+", where))
