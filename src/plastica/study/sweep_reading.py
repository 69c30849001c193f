"""Read a sweep: its scenario, its table [sweep] and what is given in place of that, with all mistakes told."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from plastica.errors import ScenarioError
from plastica.study.building import inside, number
from plastica.study.fields import given as in_toml
from plastica.study.problems import Problems
from plastica.study.reading import Document
from plastica.study.scenario import Scenario, scenario_of
from plastica.study.sweep_axes import AMPLITUDE, check_keys, flattened, read_axes
from plastica.study.sweep_members import Members, members_of, read_columns
from plastica.study.sweep_plan import Plan
from plastica.study.sweep_schema import Sweep, check_table, is_drawn
from plastica.study.sweep_trial import refused
from plastica.study.sweep_versions import NOT_THERE

__all__ = ["make_plan"]

Array = NDArray[np.float64]

MOST_TIMES: Final = 10_000


def make_plan(document: Document, given: Mapping[str, Any], *, checked: bool = True) -> Plan:
    """Read a sweep: the scenario, its table [sweep], and what is given in place of that.

    Parameters
    ----------
    document : Document
        The scenario file.
    given : mapping
        Entries of the table [sweep] that take the place of the file's; those that are None do not.
    checked : bool
        Whether to try values in the scenario; a sweep that was stored has been through that.

    Returns
    -------
    Plan

    Raises
    ------
    ScenarioError
        With all mistakes in the table.
    PlasticaError
        Where the scenario itself cannot be used.
    """
    asked = {name: value for name, value in given.items() if value is not None}
    table = _plain({**_left(_own(document), asked.get("sampling")), **asked})
    document = replace(document, data={key: value for key, value in document.data.items() if key != "sweep"})
    base, problems = scenario_of(document), Problems(document)
    si = base.model.specimen is not None
    section = problems.settled(check_table(table, problems, si=si))
    problems.refuse()
    members = problems.settled(_members(section, document.file.parent, problems, si=si))
    times = _times(section, base, problems)
    problems.refuse()
    table["over"] = dict(flattened(table.get("over", {})))
    plan = Plan(document, table, base, members, tuple(dict.fromkeys(section.outputs)), times, 1)
    plan = replace(plan, chunk=section.chunk or _chunk(plan))
    _check_whole(plan, problems)
    if checked:
        if NOT_THERE in plan.versions.values():
            problems.add(("sweep", "library"), 'must be installed to be used. pip install "plastica[fast]"')
        for path, sentence in refused(plan):
            problems.add(path, sentence)
    problems.refuse()
    return plan


def _own(document: Document) -> dict[str, Any]:
    own = document.data.get("sweep", {})
    if not isinstance(own, dict):
        raise ScenarioError(str(document.file), (f"`sweep` must be a table, but is {in_toml(own)}.",))
    return own


def _left(own: Mapping[str, Any], sampling: object) -> dict[str, Any]:
    """What the file says, without what belongs to another sampling than the one given in place of the file's."""
    belongs = {"over": sampling != "csv", "csv": sampling == "csv", "members": is_drawn(str(sampling))}
    return {name: value for name, value in own.items() if sampling is None or belongs.get(name, True)}


def _plain(table: Mapping[str, Any]) -> dict[str, Any]:
    """The same in values that JSON has: arrays and tuples become lists."""

    def value(each: Any) -> Any:
        if isinstance(each, np.ndarray | np.generic):
            return each.tolist()
        if isinstance(each, list | tuple | range):
            return [value(one) for one in each]
        return {str(key): value(one) for key, one in each.items()} if isinstance(each, Mapping) else each

    return {str(key): value(each) for key, each in table.items()}


def _members(section: Sweep, folder: Path, problems: Problems, *, si: bool) -> Members | None:
    if section.sampling == "csv":
        with problems.at("sweep", "csv"):
            axes = read_columns(inside(folder, str(section.csv)), si=si)
            check_keys([axis.key for axis in axes], problems)
            return members_of(axes, "csv", None, 0)
        return None
    found = read_axes(section.over, problems, si=si, counted=not is_drawn(section.sampling))
    if problems.within("sweep"):
        return None
    with problems.at("sweep"):
        return members_of(found, section.sampling, section.members, section.seed)
    return None


def _times(section: Sweep, base: Scenario, problems: Problems) -> Array | None:
    if section.times is None or "histories" not in section.outputs:
        return None
    times = np.array([number(each, "s") for each in section.times])
    scale = base.model.scales.time
    end = base.plan.end * scale
    if not 1 <= times.size <= MOST_TIMES or np.any(np.diff(times) <= 0.0) or times[0] < 0.0 or times[-1] > end:
        rule = f"must be 1 to {MOST_TIMES} times that increase within [0, {end:g}], the time of the run."
        problems.add(("sweep", "times"), rule)
    return times


def _chunk(plan: Plan) -> int:
    """Members of a task: enough of them to hide what a task costs, few enough that losing one costs little.

    A hundredth of all, within bounds that come to a few seconds at most; and never more than about ten thousand chunks,
    each of which is a file for every variable. Nothing else counts, so that a sweep has the same chunks anywhere.
    """
    least, most = (2048, 8192) if plan.batched else (1, 64)
    even = min(max(-(-plan.count // 100), least), most)
    return max(even, -(-plan.count // 10_000))


def _check_whole(plan: Plan, problems: Problems) -> None:
    """Refuse what does not go together."""
    keys = [axis.key for axis in plan.axes]
    if AMPLITUDE in keys and plan.base.start is not None:
        rule = "multiplies the initial curvature, but the scenario goes on from a former result."
        problems.add(("sweep", "over", AMPLITUDE), rule)
    if "state" in plan.outputs and plan.base.model.grid.nodes == "auto":
        rule = 'with "state" needs a number of nodes that all members share. Write nodes = 16 in [grid].'
        problems.add(("sweep", "outputs"), rule)
    if plan.library == "numba" and not plan.batched:
        rule = "is of use only where members are computed together: struts with one natural segment that differ in "
        problems.add(("sweep", "library"), rule + "thrust, material and start. Remove it.")
    shared = {"grid": "nodes", "specimen": "length"}
    for axis in plan.axes:
        section = axis.path[0]
        if section in shared and {"state", "histories"} & set(plan.outputs):
            rule = f'cannot be varied where outputs hold "state" or "histories": their members share [{section}].'
            problems.add(("sweep", "over", axis.key), rule)
        if axis.key in ("grid.natural_segments", "solve.times"):
            problems.add(("sweep", "over", axis.key), "cannot be varied: all members share it.")
