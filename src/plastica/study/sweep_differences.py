"""What tells a sweep from the one that a store holds, in words."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from itertools import islice
from pathlib import Path
from typing import Any, Final

from plastica.errors import FileError
from plastica.files import read_bytes
from plastica.study.building import inside
from plastica.study.sweep_plan import LARGEST_INPUT, Plan
from plastica.study.sweep_store import PLAN, Store
from plastica.study.toml import toml_value

__all__ = ["differences"]

MOST_TOLD: Final = 5
"""Differences that are told; the rest are counted."""

LONGEST: Final = 120
"""Characters of a value that are told."""

_ABSENT: Final = object()


def differences(store: Store, plan: Plan) -> str:
    """Say in which keys a plan differs from what a store was made for.

    Parameters
    ----------
    store : Store
        What is there.
    plan : Plan
        What is asked for.

    Returns
    -------
    str
        Such as "`load.thrust` is 2.0 there and 2.5 here"; "" where nothing differs.
    """
    if store.identity == plan.identity:
        return ""
    found = list(islice(_differences(store, plan), 1000)) or [f"the identity in its {PLAN} is another"]
    told = found[:MOST_TOLD] + ([f"{len(found) - MOST_TOLD} more"] if len(found) > MOST_TOLD else [])
    return "; ".join(told)


def _differences(store: Store, plan: Plan) -> Iterator[str]:
    there, here = store.plan, plan
    for key, before, now in _unlike(there.document.data, here.document.data):
        yield _told(key, before, now)
    for key, before, now in _unlike(_table(there), _table(here)):
        yield _told(f"sweep.{key}", before, now)
    if there.chunk != here.chunk:
        yield _told("sweep.chunk", there.chunk, here.chunk)
    for name, before, now in _unlike(dict(store.versions), here.versions):
        yield f"it was begun with {name} {before}, and this is {now}"
    for name in here.inputs:
        if _content(there, name) != _content(here, name):
            yield f"the file {name} has changed"


def _table(plan: Plan) -> dict[str, Any]:
    return {key: value for key, value in plan.table.items() if key != "chunk"}


def _content(plan: Plan, name: str) -> bytes | None:
    folder: Path = plan.document.file.parent
    try:
        return read_bytes(inside(folder, name), limit=LARGEST_INPUT)
    except FileError:
        return None


def _unlike(there: Any, here: Any, path: str = "") -> Iterator[tuple[str, Any, Any]]:
    """Yield the keys of nested tables that differ, with both values."""
    if isinstance(there, Mapping) and isinstance(here, Mapping):
        for key in (*there, *(key for key in here if key not in there)):
            yield from _unlike(there.get(key, _ABSENT), here.get(key, _ABSENT), f"{path}.{key}".lstrip("."))
    elif isinstance(there, Mapping) and here is _ABSENT:
        yield from _unlike(there, {}, path)
    elif isinstance(here, Mapping) and there is _ABSENT:
        yield from _unlike({}, here, path)
    elif repr(there) != repr(here):
        yield path, there, here


def _told(key: str, there: Any, here: Any) -> str:
    words = ["not given" if each is _ABSENT else _cut(toml_value(each)) for each in (there, here)]
    if words[0] == words[1]:
        return f"`{key}` has other values there"
    return f"`{key}` is {words[0]} there and {words[1]} here"


def _cut(words: str) -> str:
    return words if len(words) <= LONGEST else f"{words[:LONGEST]}…"
