"""Try values of a sweep in its scenario before anything runs."""

from __future__ import annotations

import re
from collections.abc import Iterator
from itertools import product
from typing import Final

import numpy as np

from plastica.errors import PlasticaError, ScenarioError
from plastica.study.sweep_axes import Axis
from plastica.study.sweep_plan import Plan

__all__ = ["MOST_CHECKED", "refused"]

MOST_CHECKED: Final = 24
"""Values of one axis that are tried in the scenario before the sweep begins."""

MOST_CORNERS: Final = 16


def refused(plan: Plan) -> Iterator[tuple[tuple[str | int, ...], str]]:
    """Try values of each axis, the others as the first member has them; then the corners of all numbers."""
    first = next(plan.members.blocks(1))[0]
    for k, axis in enumerate(plan.axes):
        for i in _tried(axis):
            values = first.copy()
            values[k] = axis.values[i]
            try:
                plan.scenario(values)
            except PlasticaError as error:
                place = ("sweep", "over", axis.key) + ((i,) if axis.listed else ())
                yield place, _sentence(error, axis)
                return
    ends = [sorted({float(axis.values.min()), float(axis.values.max())}) for axis in plan.axes]
    for corner in list(product(*ends))[:MOST_CORNERS] if plan.members.sampling != "list" else []:
        try:
            plan.scenario(np.array(corner))
        except PlasticaError as error:
            rule = f"together cannot be used where {plan.told(np.array(corner))}: {_reason(error)}"
            yield ("sweep", "over"), rule
            return


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


def _sentence(error: PlasticaError, axis: Axis) -> str:
    """What is wrong with a value: in the words that the scenario has for it."""
    reason = _reason(error)
    own = f"`{axis.key}` "
    return reason.removeprefix(own) if reason.startswith(own) else f"cannot be used: {reason}"
