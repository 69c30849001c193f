"""What a sweep sets out to do: its scenario, its members, what is kept of them, and in how many chunks."""

from __future__ import annotations

import copy
import hashlib
import json
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import product
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from plastica.errors import ArgumentError, PlasticaError, ScenarioError
from plastica.files import read_bytes
from plastica.physics.initial import Curvature, Shape, initial_shape
from plastica.physics.model import Model
from plastica.physics.strut import Strut
from plastica.study.building import inside, number
from plastica.study.fields import given as in_toml
from plastica.study.problems import Problems
from plastica.study.reading import Document
from plastica.study.scenario import Scenario, scenario_of
from plastica.study.sweep_axes import AMPLITUDE, Axis, flattened, read_axis
from plastica.study.sweep_members import Members, members_of, read_columns
from plastica.study.sweep_schema import Sweep, check_table
from plastica.study.sweep_versions import NOT_THERE, versions

__all__ = ["Plan", "make_plan"]

Array = NDArray[np.float64]

MOST_CHECKED: Final = 24
"""Values of one axis that are tried in the scenario before the sweep begins."""

MOST_CORNERS: Final = 16
MOST_TIMES: Final = 10_000
LARGEST_INPUT: Final = 4 * 2**30

_BATCHED: Final = re.compile(
    r"load\.thrust(\..+)?|material\.parameters\..+|initial\.(curvature|natural_curvature|amplitude)"
)
"""Keys that members of one batch may differ in."""

_LABELLED: Final = re.compile(r"load\.thrust|initial\.curvature$")
"""Those of them that may take texts and tables."""


@dataclass(frozen=True, eq=False)
class Plan:
    """A sweep that can be run.

    Attributes
    ----------
    document : Document
        The scenario without its table [sweep]: what the members have in common.
    table : mapping
        What the table [sweep] says, with what was given in its place, as plain values.
    base : Scenario
        The scenario as it stands.
    members : Members
        Which values each member takes.
    outputs : tuple of str
        What is kept.
    times : ndarray or None
        Times of the histories, in the user's units.
    chunk : int
        Members of one task.
    """

    document: Document
    table: Mapping[str, Any]
    base: Scenario
    members: Members
    outputs: tuple[str, ...]
    times: Array | None
    chunk: int

    @property
    def axes(self) -> tuple[Axis, ...]:
        """What is varied."""
        return self.members.axes

    @property
    def library(self) -> str:
        """What members that are computed together are computed with: "numpy" or "numba"."""
        return str(self.table.get("library", "numpy"))

    @property
    def versions(self) -> dict[str, str]:
        """The versions here on which the bits of the result depend."""
        return versions(self.library)

    @property
    def count(self) -> int:
        """How many members there are."""
        return self.members.count

    @property
    def chunks(self) -> int:
        """How many chunks there are."""
        return -(-self.count // self.chunk)

    def span(self, chunk: int) -> tuple[int, int]:
        """Return the first member of a chunk, and the one after its last."""
        return chunk * self.chunk, min((chunk + 1) * self.chunk, self.count)

    @property
    def batched(self) -> bool:
        """Whether the members of a chunk are integrated together, by `solve_many`; else one by one, by `solve`."""
        base = self.base
        return (
            all(_BATCHED.fullmatch(axis.key) for axis in self.axes)
            and all(axis.kind != "label" or _LABELLED.match(axis.key) for axis in self.axes)
            and isinstance(base.model, Strut)
            and base.model.segments == 1
            and base.start is None
            and base.until != "equilibrium"
            and base.method == "auto"
            and not ("state" in self.outputs and base.model.grid.nodes == "auto")
        )

    @cached_property
    def inputs(self) -> tuple[str, ...]:
        """Files that the members read, by their names in the folder of the scenario."""
        labels = [{"curvature": label} for axis in self.axes for label in axis.labels]
        results = [{"result": label} for axis in self.axes if axis.key == "initial.result" for label in axis.labels]
        found: list[str] = []
        for start in (self.document.data.get("initial", {}), *labels, *results):
            shape = start.get("curvature")
            found += [shape["csv"]] if isinstance(shape, dict) and "csv" in shape else []
            found += [start["result"]] if "result" in start else []
        found += [self.table["csv"]] if self.table.get("csv") else []
        return tuple(dict.fromkeys(found))

    @cached_property
    def identity(self) -> str:
        """A digest of all that determines the result: scenario, values, outputs, input files, versions."""
        described = {
            "scenario": self.document.data,
            "sweep": self.table,
            "chunk": self.chunk,
            "versions": self.versions,
        }
        digest = hashlib.sha256(json.dumps(described, sort_keys=True, default=str).encode())
        folder = self.document.file.parent
        for name in self.inputs:
            digest.update(hashlib.sha256(read_bytes(inside(folder, name), limit=LARGEST_INPUT)).digest())
        return digest.hexdigest()

    def changed(self, values: Array) -> Document:
        """Return the scenario of one member as a document."""
        data = copy.deepcopy(self.document.data)
        for axis, value in zip(self.axes, values, strict=True):
            if axis.key != AMPLITUDE:
                _put(data, axis.path, axis.inserted(float(value)))
        return replace(self.document, data=data)

    def scenario(self, values: Array) -> Scenario:
        """Return one member as an ordinary scenario.

        Parameters
        ----------
        values : ndarray, shape (axes,)
            Its values.

        Returns
        -------
        Scenario

        Raises
        ------
        PlasticaError
            Where it is none: what the member was refused for.
        """
        made = scenario_of(self.changed(values))
        for axis, value in zip(self.axes, values, strict=True):
            if axis.key == AMPLITUDE:
                made = replace(made, curvature=amplified(made.model, made.curvature, float(value)))
        return made

    def told(self, values: Array) -> str:
        """Return the values of one member for people."""
        pairs = zip(self.axes, values, strict=True)
        return ", ".join(f"{axis.key} = {axis.shown(float(value))}" for axis, value in pairs)


def amplified(model: Model, curvature: Curvature, factor: float) -> Shape:
    """Return an initial curvature times a factor."""
    scales, si = model.scales, model.specimen is not None
    shape, _ = initial_shape(curvature, model.grid, scales, si=si)
    length = scales.length

    def function(s: Array) -> Array:
        return factor * np.asarray(shape.function(s / length)) / length

    return Shape(function, tuple(b * length for b in shape.breaks), f"{factor:g} times ({shape.words})")


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
    table = _plain({**_own(document), **{name: value for name, value in given.items() if value is not None}})
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
        for path, sentence in _refused(plan):
            problems.add(path, sentence)
    problems.refuse()
    return plan


def _own(document: Document) -> dict[str, Any]:
    own = document.data.get("sweep", {})
    if not isinstance(own, dict):
        raise ScenarioError(str(document.file), (f"`sweep` must be a table, but is {in_toml(own)}.",))
    return own


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
    counted = section.sampling in ("grid", "list")
    if section.sampling == "csv":
        with problems.at("sweep", "csv"):
            axes: list[Axis | None] = [*read_columns(inside(folder, str(section.csv)), si=si)]
            for axis in axes:
                if axis is not None:
                    read_axis(axis.key, [0.0], problems, si=False, counted=True)
            return members_of([axis for axis in axes if axis is not None], "csv", None, 0)
        return None
    axes = [
        read_axis(key, value, problems, si=si, counted=counted) for key, value in flattened(section.over)
    ]
    if problems.within("sweep"):
        return None
    with problems.at("sweep"):
        found = [axis for axis in axes if axis is not None]
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
    least, most = (512, 8192) if plan.batched else (1, 64)
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


def _refused(plan: Plan) -> Iterator[tuple[tuple[str | int, ...], str]]:
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
