"""One member of a sweep as a scenario of its own, with its amplitude within its curvature."""

from __future__ import annotations

import copy
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from plastica.errors import ArgumentError
from plastica.material.expression import parse
from plastica.physics.initial import Curvature, Shape, initial_shape
from plastica.physics.model import Model
from plastica.study.building import number
from plastica.study.fields import given as in_toml
from plastica.study.reading import Document
from plastica.study.sweep_axes import AMPLITUDE, Axis
from plastica.study.toml import toml_text
from plastica.units import looks_like_quantity

__all__ = ["amplified", "member_document", "multiplied"]

Array = NDArray[np.float64]

MOST_TITLE: Final = 160
"""Characters of the title of the scenario that stand in those of its members."""

NO_SCENARIO: Final = "This is no scenario that can be run: its formula would be too long for one, times its amplitude."


def member_document(
    document: Document, axes: Sequence[Axis], values: Array, told: tuple[int, str] | None, *, si: bool
) -> Document:
    """Return the scenario of one member as a document whose text says the same.

    Parameters
    ----------
    document : Document
        What the members have in common.
    axes : sequence of Axis
        What is varied.
    values : ndarray, shape (axes,)
        What the member takes.
    told : tuple of int and str, or None
        Its number and its values in words, for its title and a comment; None leaves them out.
    si : bool
        Whether quantities have units.

    Returns
    -------
    Document
        Where the amplitude cannot be written into the curvature, its data have it as initial.amplitude, which no
        scenario takes.

    Raises
    ------
    ArgumentError
        Where what leads to a key is no table.
    """
    data, factor = copy.deepcopy(document.data), None
    comments: list[str] = []
    for axis, value in zip(axes, values, strict=True):
        if axis.key == AMPLITUDE:
            factor = float(value)
        else:
            _put(data, axis.path, axis.inserted(float(value)))
    if told is not None:
        title = str(data.get("title", ""))[:MOST_TITLE]
        data = {**data, "title": f"{title}: member {told[0]}" if title else f"Member {told[0]}"}
        comments.append(f"member {told[0]}: {told[1]}")
    start = data.get("initial", {})
    if factor is not None and start.get("curvature") is not None:
        made = multiplied(start["curvature"], factor, si=si)
        start |= {"amplitude": factor} if made is None else {"curvature": made}
        comments += [NO_SCENARIO] if made is None else []
    return replace(document, data=data, text=toml_text(data, comments))


def multiplied(curvature: Any, factor: float, *, si: bool) -> Any:
    """Return an initial curvature times a factor, as a scenario takes it.

    Parameters
    ----------
    curvature : object
        What a scenario says of it: a number, a quantity, a formula, pieces, measured points.
    factor : float
        The amplitude.
    si : bool
        Whether quantities have units.

    Returns
    -------
    object
        None where a formula would become longer than a scenario takes.
    """
    try:
        return _multiplied(curvature, factor, si=si)
    except (AttributeError, KeyError, TypeError, ValueError):
        # What is no curvature is refused where the scenario is read, in the words that it has for that.
        return curvature


def _multiplied(curvature: Any, factor: float, *, si: bool) -> Any:
    if isinstance(curvature, Mapping) and "csv" in curvature:
        return {**curvature, "factor": factor * float(curvature.get("factor", 1.0))}
    if isinstance(curvature, Mapping):
        pieces = [_multiplied(each, factor, si=si) for each in curvature["pieces"]]
        return None if None in pieces else {**curvature, "pieces": pieces}
    if not isinstance(curvature, str):
        return factor * float(curvature)
    if si and looks_like_quantity(curvature):
        return f"{factor * number(curvature, '1/m')!r} 1/m"
    text = f"{factor!r}*({curvature})"
    try:
        parse(text, variable="s", allow_step=True, where="curvature")
    except ArgumentError:
        return None
    return text


def amplified(model: Model, curvature: Curvature, factor: float) -> Shape:
    """Return an initial curvature times a factor."""
    scales, si = model.scales, model.specimen is not None
    shape, _ = initial_shape(curvature, model.grid, scales, si=si)
    return shape.scaled(1.0 / scales.length, factor / scales.length, f"{factor:g} times ({shape.words})")


def _put(data: dict[str, Any], path: tuple[str, ...], value: Any) -> None:
    """Set a key within tables, making those that are missing.

    Raises
    ------
    ArgumentError
        Where what leads there is no table.
    """
    here: Any = data
    for part in path[:-1]:
        here = here.setdefault(part, {})
        if not isinstance(here, dict):
            rule = f"must lead to a key of the scenario, but `{part}` is {in_toml(here)} there, not a table"
            raise ArgumentError(rule, where=".".join(path))
    here[path[-1]] = value
