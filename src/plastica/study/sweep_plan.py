"""What a sweep sets out to do: its scenario, its members, what is kept of them, and in how many chunks."""

from __future__ import annotations

import hashlib
import json
import re
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from plastica.errors import ArgumentError
from plastica.files import read_bytes
from plastica.numerics.grid import Grid
from plastica.physics.strut import Strut
from plastica.study.building import inside, named_files
from plastica.study.reading import Document
from plastica.study.scenario import Scenario, scenario_of
from plastica.study.sweep_axes import Axis
from plastica.study.sweep_member import amplified, member_document
from plastica.study.sweep_members import Members
from plastica.study.sweep_versions import versions

__all__ = ["Plan", "amplified"]

Array = NDArray[np.float64]

LARGEST_INPUT: Final = 4 * 2**30

SAME_PLACE: Final = 1e-12
"""Units of L within which element ends are the same, as for grids."""

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

    def columns(self, values: Array) -> dict[str, Array]:
        """Return what members take by its key; values of shape (members, axes)."""
        return dict(zip((axis.key for axis in self.axes), values.T, strict=True))

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
            found += named_files(start)
        found += [self.table["csv"]] if self.table.get("csv") else []
        return tuple(dict.fromkeys(found))

    @cached_property
    def identity(self) -> str:
        """A digest of all that determines the result: scenario, values, outputs, input files, versions."""
        return self.identity_with(self.table, self.versions)

    def identity_with(self, table: Mapping[str, Any], versions: Mapping[str, str]) -> str:
        """Return the identity of the same sweep as its store tells it, with the versions that it was begun with.

        Parameters
        ----------
        table : mapping
            The table [sweep] as it was when the store was made.
        versions : mapping of str to str
            The versions.

        Returns
        -------
        str

        Raises
        ------
        FileError
            Where an input file cannot be read.
        """
        described = {"scenario": self.document.data, "sweep": table, "chunk": self.chunk, "versions": versions}
        digest = hashlib.sha256(json.dumps(described, sort_keys=True, default=str).encode())
        folder = self.document.file.parent
        for name in self.inputs:
            digest.update(hashlib.sha256(read_bytes(inside(folder, name), limit=LARGEST_INPUT)).digest())
        return digest.hexdigest()

    def changed(self, values: Array, member: int | None = None) -> Document:
        """Return the scenario of one member as a document: what it says, and the same as text."""
        told = None if member is None else (member, self.told(values))
        return member_document(self.document, self.axes, values, told, si=self.base.model.specimen is not None)

    def scenario(self, values: Array, member: int | None = None) -> Scenario:
        """Return one member as an ordinary scenario, whose text says what its values are.

        Parameters
        ----------
        values : ndarray, shape (axes,)
            Its values.
        member : int, optional
            Its number, for the title.

        Returns
        -------
        Scenario

        Raises
        ------
        PlasticaError
            Where it is none: what the member was refused for.
        """
        document = self.changed(values, member)
        factor = document.data.get("initial", {}).pop("amplitude", None)
        made = scenario_of(document)
        if not self.keeps(made.problem.strut.grid):
            ends = ", ".join(f"{each:.6g} L" for each in self.base.problem.strut.grid.breaks[1:-1]) or "nowhere"
            rule = f'must jump or bend where that of the scenario does ({ends}), as outputs hold "state"'
            raise ArgumentError(rule, where="initial.curvature", next_step='Leave "state" out of them.')
        return made if factor is None else replace(made, curvature=amplified(made.model, made.curvature, factor))

    def keeps(self, grid: Grid) -> bool:
        """Whether a member on this grid can be kept: all states of a sweep are told at the nodes of its scenario."""
        own = self.base.problem.strut.grid.breaks
        alike = len(grid.breaks) == len(own) and bool(np.abs(np.subtract(grid.breaks, own)).max() <= SAME_PLACE)
        return alike or "state" not in self.outputs

    def told(self, values: Array) -> str:
        """Return the values of one member for people."""
        pairs = zip(self.axes, values, strict=True)
        return ", ".join(f"{axis.key} = {axis.shown(float(value))}" for axis, value in pairs)
