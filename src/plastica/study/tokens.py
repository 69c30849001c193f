"""The words of a TOML text and the lines they stand on; values are read by `tomllib`, which tells no lines."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Final, NamedTuple

__all__ = ["KeyPath", "Token", "TooMuchError", "index_lines", "key_text", "line_of", "tokens"]

KeyPath = tuple[str | int, ...]
"""The keys that lead to a value, and the places in arrays, counted from 0."""

DEEPEST: Final = 12
MOST_PARTS: Final = 8
MOST_TOKENS: Final = 100_000

# No possessive group: Python before 3.11.5 matches those that hold alternatives wrongly (gh-106052). A text that is not
# closed is one token up to where it would have to be (`tomllib` refuses it later): no start is tried in vain, and
# the time stays linear.
_TOKEN: Final = re.compile(
    r"""
      (?P<comment>\#[^\n]*+)
    | (?P<text>\"{3}(?:[^"\\]|\\.|"(?!""))*(?:"{3,5})? | '{3}(?:[^']|'(?!''))*(?:'{3,5})?
             | "(?:[^"\\\n]|\\.)*"? | '[^'\n]*+'?)
    | (?P<newline>\n)
    | (?P<word>[A-Za-z0-9_+:-]++)
    | (?P<sign>[\[\]{}=,.])
    | (?P<space>[ \t]++)
    | (?P<other>.)
    """,
    re.VERBOSE | re.DOTALL,
)


class Token(NamedTuple):
    """A piece of the text: its kind, what it says, and its line, counted from 1."""

    kind: str
    text: str
    line: int


class TooMuchError(ValueError):
    """A text whose nesting, dotted keys or number of words are beyond what a scenario needs."""

    def __init__(self, line: int, rule: str) -> None:
        self.line, self.rule = line, rule
        super().__init__(rule)


def tokens(text: str) -> Iterator[Token]:
    """Cut a text into words, without comments and spaces, and refuse what is nested too deep or too long.

    Raises
    ------
    TooMuchError
        Where brackets are more than 12 deep, a key has more than 8 parts, or there is more text than anyone reads.
    """
    line, depth, parts, count = 1, 0, 0, 0
    for match in _TOKEN.finditer(text):
        kind, word = str(match.lastgroup), match[0]
        if kind not in ("comment", "space"):
            if kind == "sign":
                depth += (word in "[{") - (word in "]}")
                parts = parts + 1 if word == "." else 0
            elif kind == "newline":
                parts = 0
            if depth > DEEPEST:
                raise TooMuchError(line, f"brackets must nest at most {DEEPEST} deep")
            if parts > MOST_PARTS:
                raise TooMuchError(line, f"a key must have at most {MOST_PARTS} parts")
            count += 1
            if count > MOST_TOKENS:
                raise TooMuchError(line, f"a file must have at most {MOST_TOKENS} words and signs")
            yield Token(kind, word, line)
        line += word.count("\n")


def index_lines(found: Sequence[Token]) -> Mapping[KeyPath, int]:
    """Return the line of every key and array entry of a text that `tomllib` has accepted."""
    indexer = _Indexer(found)
    indexer.document()
    return indexer.lines


def line_of(lines: Mapping[KeyPath, int], path: KeyPath) -> int | None:
    """Return the line of a key, else that of the nearest table around it, else None."""
    for length in range(len(path), 0, -1):
        if path[:length] in lines:
            return lines[path[:length]]
    return None


def key_text(path: KeyPath) -> str:
    """Write a key path as users do: load.thrust.values[3]."""
    text = ""
    for part in path:
        plain = re.fullmatch(r"[A-Za-z0-9_-]+", str(part)) is not None
        name = str(part) if plain else repr(str(part)[:40])
        text += f"[{part}]" if isinstance(part, int) else f"{'.' if text else ''}{name}"
    return text or "the file"


@dataclass
class _Indexer:
    """Walks over the words of a valid text; every method leaves `at` behind what it has read."""

    found: Sequence[Token]

    def __post_init__(self) -> None:
        self.at = 0
        self.lines: dict[KeyPath, int] = {}
        self.arrays: dict[KeyPath, int] = {}

    def peek(self) -> Token:
        return self.found[self.at] if self.at < len(self.found) else Token("end", "", 0)

    def take(self, word: str) -> bool:
        hit = self.peek().text == word and self.peek().kind == "sign"
        self.at += hit
        return hit

    def skip_newlines(self) -> None:
        while self.peek().kind == "newline":
            self.at += 1

    def document(self) -> None:
        table: KeyPath = ()
        while self.at < len(self.found):
            self.skip_newlines()
            token = self.peek()
            if token.kind == "end":
                return
            if self.take("["):
                table = self.header(token.line)
            else:
                self.assignment(table)

    def header(self, line: int) -> KeyPath:
        several = self.take("[")
        parts = self.key()
        path: KeyPath = ()
        for i, part in enumerate(parts):
            path = (*path, part)
            self.lines.setdefault(path, line)
            if several and i == len(parts) - 1:
                self.arrays[path] = self.arrays.get(path, -1) + 1
            if path in self.arrays:
                path = (*path, self.arrays[path])
                self.lines.setdefault(path, line)
        while self.take("]"):
            pass
        return path

    def key(self) -> list[str]:
        parts = [_key_part(self.found[self.at])]
        self.at += 1
        while self.take("."):
            parts.append(_key_part(self.found[self.at]))
            self.at += 1
        return parts

    def assignment(self, table: KeyPath) -> None:
        line, path = self.peek().line, table
        for part in self.key():
            path = (*path, part)
            self.lines.setdefault(path, line)
        self.take("=")
        self.value(path)

    def value(self, path: KeyPath) -> None:
        self.lines.setdefault(path, self.peek().line)
        if self.take("["):
            self.array(path)
        elif self.take("{"):
            self.skip_newlines()
            while not self.take("}"):
                self.assignment(path)
                self.take(",")
                self.skip_newlines()
        else:
            while self.peek().kind not in ("newline", "end") and self.peek().text not in (",", "]", "}"):
                self.at += 1

    def array(self, path: KeyPath) -> None:
        place = 0
        self.skip_newlines()
        while not self.take("]"):
            self.value((*path, place))
            self.skip_newlines()
            self.take(",")
            self.skip_newlines()
            place += 1


def _key_part(token: Token) -> str:
    if token.kind != "text":
        return token.text
    return str(tomllib.loads(f"k = {token.text}")["k"])
