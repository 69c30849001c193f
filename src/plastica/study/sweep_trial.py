"""Try values of a sweep in its scenario before anything runs."""

from __future__ import annotations

import re
from collections.abc import Iterator
from itertools import islice, product
from typing import Final

import numpy as np
from numpy.typing import NDArray

from plastica.errors import PlasticaError, ScenarioError
from plastica.study.sweep_axes import Axis
from plastica.study.sweep_plan import Plan

__all__ = ["MOST_CHECKED", "refused"]

Array = NDArray[np.float64]
Place = tuple[str | int, ...]

MOST_CHECKED: Final = 24
"""Values of one axis that are tried in the scenario before the sweep begins."""

MOST_CORNERS: Final = 16


def refused(plan: Plan) -> Iterator[tuple[Place, str]]:
    """Yield the first value that cannot be used, with its place: of those that are tried, as they go together."""
    whole = plan.members.sampling in ("list", "csv")
    yield from islice(_refused_members(plan) if whole else _refused_values(plan), 1)


def _refused_members(plan: Plan) -> Iterator[tuple[Place, str]]:
    """Try members as they stand side by side: where the values of each axis are least, greatest, and some between."""
    places = sorted({i for axis in plan.axes for i in _tried(axis)})
    for i, values in zip(places, plan.members.picked(np.array(places)), strict=True):
        error = _error(plan, values)
        if error is None:
            continue
        named = [axis for axis in plan.axes if len(plan.axes) == 1 or _is_about(error, axis)]
        if plan.members.sampling == "csv":
            yield ("sweep", "csv"), f"has a member that cannot be used, with {plan.told(values)}: {_reason(error)}"
        elif named:
            yield ("sweep", "over", named[0].key, i), _sentence(error, named[0])
        else:
            yield ("sweep", "over"), f"cannot be used together where {plan.told(values)}: {_reason(error)}"


def _refused_values(plan: Plan) -> Iterator[tuple[Place, str]]:
    """Try values of each axis, the others as the first member has them; then the corners of all numbers."""
    first = next(plan.members.blocks(1))[0]
    for k, axis in enumerate(plan.axes):
        for i in _tried(axis):
            values = first.copy()
            values[k] = axis.values[i]
            error = _error(plan, values)
            if error is not None:
                yield ("sweep", "over", axis.key) + ((i,) if axis.listed else ()), _sentence(error, axis)
    ends = [sorted({float(axis.values.min()), float(axis.values.max())}) for axis in plan.axes]
    for corner in islice(product(*ends), MOST_CORNERS):
        error = _error(plan, np.array(corner))
        if error is not None:
            rule = f"together cannot be used where {plan.told(np.array(corner))}: {_reason(error)}"
            yield ("sweep", "over"), rule


def _error(plan: Plan, values: Array) -> PlasticaError | None:
    """What is wrong with a member; None where nothing is."""
    try:
        plan.scenario(values)
    except PlasticaError as error:
        return error
    return None


def _tried(axis: Axis) -> list[int]:
    """Places of some values: all where there are few, else the least, the greatest and some between."""
    if axis.values.size <= MOST_CHECKED:
        return list(range(axis.values.size))
    spread = np.linspace(0, axis.values.size - 1, MOST_CHECKED - 2).astype(int).tolist()
    return sorted({*spread, int(axis.values.argmin()), int(axis.values.argmax())})


def _reason(error: PlasticaError) -> str:
    if isinstance(error, ScenarioError):
        return re.sub(r"\bline \d+: ", "", error.problems[0])
    return re.sub(r"\n\s*(line \d+: )?", " ", str(error).split(": ", 1)[-1])


def _is_about(error: PlasticaError, axis: Axis) -> bool:
    return re.match(rf"`{re.escape(axis.key)}[`.\[]", _reason(error)) is not None


def _sentence(error: PlasticaError, axis: Axis) -> str:
    """What is wrong with a value: in the words that the scenario has for it."""
    reason = _reason(error)
    own = f"`{axis.key}` "
    return reason.removeprefix(own) if reason.startswith(own) else f"cannot be used: {reason}"
