"""Plain values written as TOML, such that reading it gives them back to the last bit."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping, Sequence
from typing import Any, Final

__all__ = ["toml_text", "toml_value"]

_BARE_KEY: Final = re.compile(r"[A-Za-z0-9_-]+")


def toml_value(value: object) -> str:
    """Write a value as TOML does on one line: text in quotes, tables in braces; numbers to the last bit."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False).replace("\x7f", "\\u007f")
    if isinstance(value, Mapping):
        inside = ", ".join(f"{_key(key)} = {toml_value(each)}" for key, each in value.items())
        return f"{{ {inside} }}" if inside else "{}"
    if isinstance(value, (list, tuple)):
        return f"[{', '.join(map(toml_value, value))}]"
    return repr(value)


def _printable(comment: str) -> str:
    return "".join(each if each.isprintable() else " " for each in comment)


def _key(key: object) -> str:
    return str(key) if _BARE_KEY.fullmatch(str(key)) else toml_value(str(key))


def toml_text(data: Mapping[str, Any], comments: Sequence[str] = ()) -> str:
    """Write a scenario as TOML, with lines of comment above it.

    Parameters
    ----------
    data : mapping
        What it says, as nested plain values.
    comments : sequence of str
        For people.

    Returns
    -------
    str
        Reading it gives `data` back.
    """
    lines = [f"# {_printable(each)}" for each in comments]
    lines += [f"{_key(key)} = {toml_value(each)}" for key, each in data.items() if not isinstance(each, Mapping)]
    for key, table in data.items():
        if isinstance(table, Mapping):
            lines += ["", f"[{_key(key)}]", *(f"{_key(name)} = {toml_value(each)}" for name, each in table.items())]
    return "\n".join(lines) + "\n"
