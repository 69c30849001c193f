"""A TOML file from outside, read within limits, with the line of every key."""

from __future__ import annotations

import math
import tomllib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from plastica.errors import ScenarioError, shown
from plastica.files import read_bytes
from plastica.study.tokens import KeyPath, TooMuchError, index_lines, key_text, line_of, tokens

__all__ = ["LARGEST_FILE", "MOST_ENTRIES", "Document", "document_of", "read_document"]

LARGEST_FILE: Final = 1_000_000
"""Bytes of a scenario file."""

MOST_ENTRIES: Final = 10_000
"""Entries of one array or table; longer ones belong into a CSV file."""

LONGEST_TEXT: Final = 2_000
"""Characters of one text; formulas and quantities have narrower limits of their own."""

_LARGEST_INTEGER: Final = 2**63


@dataclass(frozen=True)
class Document:
    """A TOML file that was read.

    Attributes
    ----------
    file : Path
        Where it came from.
    text : str
        What it says, verbatim.
    data : dict
        The same as nested values.
    lines : mapping of key path to int
        The line, counted from 1, on which every key and array entry stands.
    """

    file: Path
    text: str
    data: dict[str, Any]
    lines: Mapping[KeyPath, int]

    def line(self, path: KeyPath) -> int | None:
        """Return the line of a key, or of the table nearest to it; None for what is nowhere in the file."""
        return line_of(self.lines, path)


def read_document(file: str | Path) -> Document:
    """Read a TOML file of at most 1 MB in UTF-8.

    Parameters
    ----------
    file : str or Path
        The file.

    Returns
    -------
    Document
        Its values, all of them plain: text, finite numbers, booleans, arrays and tables, none absurdly large.

    Raises
    ------
    FileError
        Where it cannot be read or is too large.
    ScenarioError
        Where it is not TOML, not UTF-8, or nested too deep; with the line.
    """
    source = Path(file)
    return document_of(_decoded(read_bytes(source, limit=LARGEST_FILE), source), source)


def document_of(text: str, file: str | Path) -> Document:
    """Read TOML text as if it stood in a file; see `read_document`."""
    source = Path(file)
    if len(text) > LARGEST_FILE:
        raise _refuse(source, f"the text must have at most {LARGEST_FILE} characters, but has {len(text)}.")
    data, lines = _parsed(text, source)
    problems = tuple(_unusable(data, (), lines))
    if problems:
        raise ScenarioError(str(source), problems)
    return Document(source, text, data, lines)


def _refuse(source: Path, sentence: str) -> ScenarioError:
    return ScenarioError(str(source), (sentence,))


def _decoded(raw: bytes, source: Path) -> str:
    if raw.startswith((b"\xff\xfe", b"\xfe\xff")):
        raise _refuse(source, "the file must be UTF-8 text, but is UTF-16. Save it as UTF-8.")
    if b"\0" in raw:
        raise _refuse(source, "the file must be text, but holds NUL bytes. Give a scenario written in TOML.")
    try:
        return raw.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = raw.count(b"\n", 0, error.start) + 1
        sentence = f"line {line}: the file must be UTF-8 text, but has the byte 0x{raw[error.start]:02x} there."
        raise _refuse(source, f"{sentence} Save it as UTF-8.") from None


def _parsed(text: str, source: Path) -> tuple[dict[str, Any], Mapping[KeyPath, int]]:
    if not text.strip():
        raise _refuse(source, "the file is empty. `plastica new` writes a scenario to start from.")
    # TOML asks for \n or \r\n; the reader of the standard library counts lines by \n alone.
    plain = text.replace("\r\n", "\n")
    try:
        # The limits are checked first: tomllib recurses, and takes quadratic time for long dotted keys.
        found = list(tokens(plain))
        data = tomllib.loads(plain)
        return data, index_lines(found)
    except TooMuchError as error:
        raise _refuse(source, f"line {error.line}: {error.rule}.") from None
    except tomllib.TOMLDecodeError as error:
        raise _refuse(source, _toml_sentence(str(error))) from None
    except (ValueError, RecursionError) as error:
        raise _refuse(source, f"the file is not TOML that can be read ({error}).") from None


def _toml_sentence(message: str) -> str:
    """Put "Cannot overwrite a value (at line 3, column 8)" into the order of the other messages."""
    what, _, where = message.partition(" (at ")
    if not where:
        return f"the file is not valid TOML: {message}."
    if "overwrite" in what or "twice" in what:
        what += " (a key or table stands there a second time)"
    return f"{where.rstrip(')')}: not valid TOML: {what}."


def _unusable(value: object, path: KeyPath, lines: Mapping[KeyPath, int]) -> Iterator[str]:
    """Yield a sentence for every value that no scenario can have."""

    def sentence(rule: str) -> str:
        line = line_of(lines, path)
        return f"{f'line {line}: ' if line else ''}`{key_text(path)}` {rule}."

    if isinstance(value, dict | list):
        if len(value) > MOST_ENTRIES:
            yield sentence(f"must have at most {MOST_ENTRIES} entries, but has {len(value)}")
            return
        for key, inner in value.items() if isinstance(value, dict) else enumerate(value):
            yield from _unusable(inner, (*path, key), lines)
    elif isinstance(value, str):
        if len(value) > LONGEST_TEXT:
            yield sentence(f"must have at most {LONGEST_TEXT} characters, but has {len(value)}")
    elif isinstance(value, float):
        if not math.isfinite(value):
            yield sentence(f"must be finite, but is {value}")
    elif isinstance(value, int):
        if abs(value) >= _LARGEST_INTEGER:
            yield sentence("must be a number of at most 18 digits")
    else:
        yield sentence(f"must be text, a number or true/false, but is the date or time {shown(str(value))}")
