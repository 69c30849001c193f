"""A sweep that was computed, or is under way: counts, datasets, members as ordinary runs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import NDArray

from plastica.errors import ArgumentError, safe_text
from plastica.motion.solution import Solution
from plastica.study.run import described, solved
from plastica.study.scenario import Scenario
from plastica.study.sweep_axes import Axis
from plastica.study.sweep_interest import Interesting, interesting
from plastica.study.sweep_outputs import FAILED, REGIMES, STATUSES, coordinates_of, fixed_of, variables_of
from plastica.study.sweep_plan import Plan
from plastica.study.sweep_store import APART, RESULTS, Store, open_store

if TYPE_CHECKING:
    import xarray

__all__ = ["Sweep", "read_sweep"]

Array = NDArray[np.float64]

LARGEST_DATASET: Final = 4 * 2**30
"""Bytes that `Sweep.to_dataset` brings into memory."""

BLOCK: Final = 1_000_000
"""Members that are counted at a time."""


@dataclass(frozen=True, eq=False)
class Sweep:
    """A sweep on disk, complete or under way.

    Attributes
    ----------
    store : Store
        The folder, and the plan.
    """

    store: Store

    @property
    def path(self) -> Path:
        """The folder."""
        return self.store.folder

    @property
    def results(self) -> Path:
        """The Zarr store within it, which xarray and others open as it is."""
        return self.store.folder / RESULTS

    @property
    def plan(self) -> Plan:
        """What was asked for."""
        return self.store.plan

    @property
    def axes(self) -> tuple[Axis, ...]:
        """What is varied."""
        return self.plan.axes

    @property
    def members(self) -> int:
        """How many members there are."""
        return self.plan.count

    @cached_property
    def missing(self) -> frozenset[int]:
        """The chunks that are not done, each judged by its seal, the first time that this is asked for."""
        return frozenset(self.store.missing())

    @cached_property
    def counts(self) -> dict[str, int]:
        """How many members ended how, the most frequent first; "pending" are those not computed yet.

        Whatever a chunk holds counts only if it is what its seal says.
        """
        return self._counted("status", STATUSES)

    @cached_property
    def regimes(self) -> dict[str, int]:
        """How many members came to what, where the verdict was kept."""
        return self._counted("regime", REGIMES) if "verdict" in self.plan.outputs else {}

    def _counted(self, name: str, flags: Sequence[str]) -> dict[str, int]:
        found = np.zeros(len(flags) + 1, dtype=np.int64)
        for first in range(0, self.members, BLOCK):
            codes = self.store.read(["status", name], first, min(first + BLOCK, self.members), self.missing)[name]
            found += np.bincount(np.asarray(codes, dtype=np.int64) + 1, minlength=found.size)[: found.size]
        told = dict(zip(("pending", *flags), found.tolist(), strict=True))
        return {flag: count for flag, count in sorted(told.items(), key=lambda each: -each[1]) if count}

    @cached_property
    def apart(self) -> dict[int, str]:
        """Chunks whose members were to be computed together and were not, with the reason, as the log tells it."""
        told = {entry.get("chunk"): entry.get(APART) for entry in self.store.log()}
        return {chunk: why for chunk, why in told.items() if isinstance(chunk, int) and isinstance(why, str)}

    @property
    def done(self) -> int:
        """How many members are computed."""
        return self.members - self.counts.get("pending", 0)

    @property
    def complete(self) -> bool:
        """Whether all members are computed."""
        return self.done == self.members

    @property
    def failed(self) -> int:
        """How many members did not end as asked."""
        return sum(count for status, count in self.counts.items() if status in FAILED)

    @cached_property
    def dataset(self) -> xarray.Dataset:
        """Everything that is computed so far; see `to_dataset`."""
        return self.to_dataset()

    def to_dataset(self, variables: Sequence[str] | None = None) -> xarray.Dataset:
        """Return variables over `member`, with what is varied as coordinates by their keys, such as "load.thrust".

        Parameters
        ----------
        variables : sequence of str, optional
            Names; by default all.

        Returns
        -------
        xarray.Dataset
            Codes (status, method, regime, ...) come as words; what is not computed yet is nan, or "pending".

        Raises
        ------
        ArgumentError
            Where there is no such variable, or they do not fit into 4 GiB of memory: then open `results` with xarray.
        """
        known = {each.name: each for each in variables_of(self.plan)}
        for name in variables or ():
            if name not in known:
                rule = "must be variables of the sweep"
                raise ArgumentError(rule, where="variables", value=name, next_step=f"It has: {', '.join(known)}.")
        chosen = [known[name] for name in variables or known]
        size = self.members * sum(each.bytes_per_member for each in (*chosen, *coordinates_of(self.plan)))
        if size > LARGEST_DATASET:
            raise ArgumentError(
                f"must come to at most {LARGEST_DATASET} bytes",
                where="variables",
                value=size,
                next_step=f"Ask for fewer, or open {RESULTS} with xarray.open_zarr, which reads what is needed.",
            )
        return self._dataset([each.name for each in chosen])

    def _dataset(self, names: Sequence[str]) -> xarray.Dataset:
        import xarray

        described = {each.name: each for each in (*variables_of(self.plan), *coordinates_of(self.plan))}
        read = self.store.read(names, 0, self.members, self.missing)
        for axis, values in zip(self.axes, self.taken.T, strict=True):
            read[axis.key] = values.astype(described[axis.key].dtype)

        def labelled(name: str) -> tuple[tuple[str, ...], NDArray[Any], dict[str, Any]]:
            variable, values = described[name], read[name]
            if variable.flags:
                values = np.array([*variable.flags, "pending"])[values]
            return variable.dims, values, {"units": variable.unit, "long_name": variable.words}

        coordinates: dict[str, Any] = {axis.key: labelled(axis.key) for axis in self.axes}
        for each in fixed_of(self.plan):
            coordinates[each.name] = (each.dim, each.values, each.attributes)
        attributes = {"title": self.plan.base.title, "sampling": self.plan.members.sampling}
        return xarray.Dataset({name: labelled(name) for name in names}, coordinates, attributes)

    @cached_property
    def taken(self) -> Array:
        """What all members take, of shape (members, axes), as it is sealed with them, or planned."""
        return self.store.values(0, self.members, self.missing)

    def values(self, member: int) -> dict[str, Any]:
        """Return what one member takes, by key.

        Raises
        ------
        ArgumentError
            Where there is no such member.
        """
        return {axis.key: axis.inserted(float(value)) for axis, value in zip(self.axes, self._row(member), strict=True)}

    def _row(self, member: int) -> Array:
        if isinstance(member, bool) or not isinstance(member, (int, np.integer)) or not 0 <= member < self.members:
            raise ArgumentError(f"must be a member, 0 to {self.members - 1}", where="member", value=member)
        return np.asarray(self.store.values(int(member), int(member) + 1)[0])

    def scenario(self, member: int) -> Scenario:
        """Return one member as an ordinary scenario.

        Raises
        ------
        PlasticaError
            Where there is no such member, or it was refused: the message says why.
        """
        return self.plan.scenario(self._row(member), member)

    def solve(self, member: int) -> Solution:
        """Solve one member on its own, as `plastica run` would; for its report, film, ledger.

        Raises
        ------
        PlasticaError
            As `scenario`.
        """
        row = self._row(member)
        scenario = self.plan.scenario(row, member)
        told = f"member {member}: {self.plan.told(row)}"
        return described(scenario, solved(scenario)).with_provenance(member=told, description=told)

    def interesting(self, count: int = 10) -> tuple[Interesting, ...]:
        """Return the members most worth a look: failures, neighbours that end differently, extremes.

        Parameters
        ----------
        count : int
            How many.

        Returns
        -------
        tuple of Interesting
            Member, why, and what it takes.
        """
        return interesting(self.store, count, self.missing)

    def __str__(self) -> str:
        varied = ", ".join(axis.key for axis in self.axes)
        count = plural(self.members, "member")
        lines = [f"sweep     {count} over {varied} ({self.plan.members.sampling}), in {self.path}"]
        lines.append("done      " + ", ".join(f"{count} {status}" for status, count in self.counts.items()))
        if self.apart:
            slow, why = plural(len(self.apart), "chunk"), next(iter(self.apart.values()))
            lines.append(f"slow      {slow} one by one, because {why}")
        if self.regimes:
            told = {regime: count for regime, count in self.regimes.items() if regime != "pending"}
            lines.append("regimes   " + ", ".join(f"{count} {regime}" for regime, count in told.items()))
        return safe_text("\n".join(lines))

    __repr__ = __str__


def plural(count: int, noun: str) -> str:
    """Return a number with its noun."""
    return f"{count} {noun}" if count == 1 else f"{count} {noun}s"


def read_sweep(path: str | Path) -> Sweep:
    """Read a sweep from its store, whether it is complete, under way or interrupted.

    Parameters
    ----------
    path : str or Path
        The folder that `sweep` or `plastica sweep` has written.

    Returns
    -------
    Sweep

    Raises
    ------
    ArgumentError
        Where the path is neither text nor a Path.
    FileError
        Where there is none, it is damaged, or of a later version.
    """
    store = open_store(path)
    _ = store.arrays
    return Sweep(store)
