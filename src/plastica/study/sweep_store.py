"""A sweep on disk: a folder with its scenario, its plan, and a Zarr store with a chunk of every variable for each task.

A chunk counts as done if its seal, which is written last, is the digest of what is there: what its members take, and
what came of them. Which files exist tells nothing, since Zarr writes none for a chunk that is nan throughout. Whatever
was killed in between, whenever, leaves chunks that are done or chunks that are not; nothing else is kept about what was
done.
"""

from __future__ import annotations

import contextlib
import json
import os
import platform
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from math import prod
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from plastica.errors import FileError, PlasticaError
from plastica.files import as_path, check_schema, read_bytes, regular_file
from plastica.study.reading import read_document
from plastica.study.sweep_axes import ROUNDING
from plastica.study.sweep_chunks import check_chunk
from plastica.study.sweep_outputs import Variable, coordinates_of, variables_of
from plastica.study.sweep_plan import Plan
from plastica.study.sweep_reading import make_plan
from plastica.study.sweep_seals import digest_of, digest_of_plan, seal_of

__all__ = ["APART", "PLAN", "RESULTS", "SCENARIO", "SCHEMA", "SEAL", "Store", "chunk_shape", "open_store"]

SCHEMA: Final = 2
"""Version 1 sealed what came of the members alone, and did not digest its plan."""

PLAN: Final = "sweep.json"
SCENARIO: Final = "scenario.toml"
RESULTS: Final = "results.zarr"
METADATA: Final = "zarr.json"
LOG: Final = "log.jsonl"
SEAL: Final = "seal"
APART: Final = "one by one, because"
"""What the log calls the reason why members that should be computed together were not."""

LARGEST_PLAN: Final = 64 * 2**20
LARGEST_LOG: Final = 2**30
LARGEST_METADATA: Final = 64 * 2**20
UNREADABLE: Final = (ValueError, RuntimeError, OSError)
"""What Zarr raises where a chunk is there but is none."""

Columns = Mapping[str, NDArray[Any]]


@dataclass(frozen=True, eq=False)
class Store:
    """A sweep on disk.

    Attributes
    ----------
    folder : Path
        Where it is.
    plan : Plan
        What it sets out to do.
    identity : str
        The digest of the plan, of input files and versions, as it was when the store was made.
    versions : mapping of str to str
        The versions it is computed with.
    schema : int
        The version of its layout.
    """

    folder: Path
    plan: Plan
    identity: str
    versions: Mapping[str, str]
    schema: int = SCHEMA

    @cached_property
    def variables(self) -> tuple[Variable, ...]:
        """What is computed."""
        return variables_of(self.plan)

    @cached_property
    def coordinates(self) -> tuple[Variable, ...]:
        """What the members take, by the keys that are varied."""
        return coordinates_of(self.plan)

    @cached_property
    def group(self) -> Any:
        """The Zarr group."""
        import zarr

        results = self.folder / RESULTS
        regular_file(results / METADATA, limit=LARGEST_METADATA)
        return zarr.open_group(results, mode="r+", zarr_format=3, use_consolidated=False)

    @cached_property
    def arrays(self) -> Mapping[str, Any]:
        """Every array that the plan asks for, opened and held to what the plan says of it.

        Raises
        ------
        FileError
            Where one is missing or of another shape.
        """
        with self._damage():
            if self.schema > 1 and self.group.attrs["identity"] != self.identity:
                raise ValueError("its results are those of another sweep")
            made = {each.name: self._opened(each) for each in (*self.variables, *self.coordinates)}
            made[SEAL] = self.array(SEAL)
            if made[SEAL].shape != (self.plan.chunks, 32) or made[SEAL].chunks != (1, 32):
                raise ValueError("its seals are not as planned")
        return made

    def array(self, name: str) -> Any:
        """Open an array of the store; what Zarr raises, or `FileError`, where there is none."""
        group = self.group
        regular_file(self.folder / RESULTS / name / METADATA, limit=LARGEST_METADATA)
        return group[name]

    def _opened(self, variable: Variable) -> Any:
        array = self.array(variable.name)
        shape, chunks = (self.plan.count, *variable.shape), (self.plan.chunk, *variable.shape)
        if array.shape != shape or array.dtype != np.dtype(variable.dtype):
            raise ValueError(f"{variable.name} is not as planned")
        if array.chunks != chunk_shape(chunks, shape):
            raise ValueError(f"the chunks of {variable.name} are not as planned")
        if not np.array_equal(array.fill_value, variable.fill, equal_nan=True):
            raise ValueError(f"what stands for nothing in {variable.name} is not as planned")
        return array

    @contextlib.contextmanager
    def _damage(self) -> Iterator[None]:
        try:
            yield
        except (KeyError, ValueError, TypeError, AttributeError, OSError, RuntimeError) as error:
            raise _damaged(self.folder, str(error).split("\n")[0][:200]) from None

    def check_versions(self) -> None:
        """Refuse to compute with other versions than those of the chunks that are there.

        Raises
        ------
        FileError
            Where a version differs.
        """
        present = self.plan.versions
        if present != dict(self.versions):
            told = ", ".join(f"{name} {version}" for name, version in self.versions.items())
            raise FileError(
                f"must be computed with {told}, as it was begun",
                where=str(self.folder),
                value=", ".join(f"{name} {version}" for name, version in present.items()),
                next_step="Use these versions on every machine, or name another store.",
            )

    def values(self, first: int, last: int, absent: Collection[int] | None = None) -> NDArray[np.float64]:
        """Return what members first to last take, as it is sealed; of chunks that are not done, as it is planned.

        Parameters
        ----------
        first, last : int
            The members.
        absent : collection of int, optional
            Chunks that are known not to be done; by default those that hold these members are looked at.

        Returns
        -------
        ndarray, shape (members, axes)
        """
        chunks = range(first // self.plan.chunk, -(-last // self.plan.chunk))
        gone = {chunk for chunk in chunks if not self.is_done(chunk)} if absent is None else set(absent)
        read = [self._read(axis.key, first, last) for axis in self.plan.axes]
        found = np.stack([np.asarray(values, dtype=float) for values, _ in read], axis=1)
        for chunk in gone.union(*(unreadable for _, unreadable in read)).intersection(chunks):
            begin, end = self.plan.span(chunk)
            begin, end = max(begin, first), min(end, last)
            found[begin - first : end - first] = self.plan.members.between(begin, end)
        return found

    def read(
        self, names: Sequence[str], first: int, last: int, absent: Collection[int] = ()
    ) -> dict[str, NDArray[Any]]:
        """Return variables of members first to last; nan or -1 where they are not computed or cannot be read.

        Parameters
        ----------
        names : sequence of str
            The variables.
        first, last : int
            The members.
        absent : collection of int
            Chunks that are taken for not computed, such as `missing` finds, as are those of which one of the variables
            cannot be read.

        Returns
        -------
        dict of ndarray
        """
        read = {name: self._read(name, first, last) for name in names}
        gone = set(absent).union(*(unreadable for _, unreadable in read.values()))
        for chunk in gone:
            begin, end = (min(max(place - first, 0), last - first) for place in self.plan.span(chunk))
            for name, (values, _) in read.items():
                values[begin:end] = self.arrays[name].fill_value
        return {name: values for name, (values, _) in read.items()}

    def _read(self, name: str, first: int, last: int) -> tuple[NDArray[Any], list[int]]:
        """Return an array's members first to last, and the chunks that cannot be decoded: there it has its filling."""
        array = self.arrays[name]
        chunks = range(first // self.plan.chunk, -(-last // self.plan.chunk))
        with contextlib.suppress(*UNREADABLE):
            for chunk in chunks:
                self._check(array, name, chunk)
            return np.array(array[first:last]), []
        values, unreadable = np.full((last - first, *array.shape[1:]), array.fill_value, array.dtype), []
        for chunk in chunks:
            begin, end = self.plan.span(chunk)
            begin, end = max(begin, first), min(end, last)
            try:
                self._check(array, name, chunk)
                values[begin - first : end - first] = array[begin:end]
            except UNREADABLE:
                unreadable.append(chunk)
        return values, unreadable

    def _check(self, array: Any, name: str, chunk: int) -> None:
        """Look at the file of a chunk before it is read."""
        # Each chunk has all of the further dimensions, whose place is 0; Zarr fills up the last one.
        inner, size = ("0",) * (len(array.shape) - 1), prod(array.chunks) * array.dtype.itemsize
        path = (self.folder / RESULTS / name / "c").joinpath(str(chunk), *inner)
        check_chunk(path, size, compressed=name != SEAL)

    def _held(self, chunk: int) -> dict[str, NDArray[Any]]:
        """What the files of a chunk hold: what its members take, and what came of them.

        Raises
        ------
        ValueError, RuntimeError, OSError
            Where something cannot be decoded.
        """
        first, last = self.plan.span(chunk)
        held = {}
        for each in (*self.coordinates, *self.variables):
            self._check(self.arrays[each.name], each.name, chunk)
            held[each.name] = np.asarray(self.arrays[each.name][first:last])
        return held

    def is_done(self, chunk: int) -> bool:
        """Whether all that a chunk should hold is there, by its content."""
        arrays = self.arrays
        try:
            self._check(arrays[SEAL], SEAL, chunk)
            seal = bytes(np.asarray(arrays[SEAL][chunk]).tobytes())
            if not any(seal):
                return False
            held = self._held(chunk)
        except UNREADABLE:
            # What cannot be decoded is not there.
            return False
        return self._sealed_by(seal, chunk, held)

    def _sealed_by(self, seal: bytes, chunk: int, held: Columns) -> bool:
        if self.schema > 1:
            return seal_of(self.identity, chunk, held) == seal
        # What the members take stands beside what was sealed, and is held against the plan.
        taken = {each.name for each in self.coordinates}
        if digest_of({name: values for name, values in held.items() if name not in taken}) != seal:
            return False
        planned = self._planned(chunk)
        return all(bool(np.all(np.abs(held[key] - planned[key]) <= ROUNDING * np.abs(planned[key]))) for key in taken)

    def _planned(self, chunk: int) -> dict[str, NDArray[Any]]:
        """What the members of a chunk take, as it is stored."""
        rows = self.plan.members.between(*self.plan.span(chunk))
        return {each.name: row.astype(each.dtype) for each, row in zip(self.coordinates, rows.T, strict=True)}

    def missing(self) -> list[int]:
        """Return the chunks that are not done."""
        return [chunk for chunk in range(self.plan.chunks) if not self.is_done(chunk)]

    def write(self, chunk: int, columns: Columns) -> None:
        """Write what came of the members of a chunk: the status last of all variables, the seal after that.

        What they take is there already, unless it was damaged: then it is written again, as planned.

        Another process that has seen the sweep complete may have taken what is half written here for left behind (see
        `tidy`). Then the chunk is done, by another; if it is not, it is written once more.
        """
        try:
            self._write(chunk, columns)
        except FileNotFoundError:
            if not self.is_done(chunk):
                self._write(chunk, columns)

    def _write(self, chunk: int, columns: Columns) -> None:
        first, last = self.plan.span(chunk)
        planned = self._planned(chunk)
        for name, values in planned.items():
            found, unreadable = self._read(name, first, last)
            if unreadable or not np.array_equal(found, values):
                self.arrays[name][first:last] = values
        for name in sorted(columns, key=lambda each: each == "status"):
            self.arrays[name][first:last] = columns[name]
        seal = seal_of(self.identity, chunk, {**planned, **columns}) if self.schema > 1 else digest_of(columns)
        self.arrays[SEAL][chunk] = np.frombuffer(seal, dtype=np.uint8)

    def note(self, entry: Mapping[str, Any]) -> None:
        """Append a line to the log of the sweep, which nothing is ever read from but what it cost."""
        line = json.dumps({"host": platform.node(), "process": os.getpid(), **entry}, sort_keys=True) + "\n"
        handle = os.open(self.folder / LOG, os.O_WRONLY | os.O_APPEND | os.O_CREAT, 0o666)
        try:
            os.write(handle, line.encode())
        finally:
            os.close(handle)

    def log(self) -> list[dict[str, Any]]:
        """Return the lines of the log; one that was cut short is left out."""
        path = self.folder / LOG
        if not path.is_file():
            return []
        found = []
        for line in read_bytes(path, limit=LARGEST_LOG).decode("utf-8", "replace").splitlines():
            with contextlib.suppress(ValueError):
                found.append(json.loads(line))
        return [entry for entry in found if isinstance(entry, dict)]

    def tidy(self) -> None:
        """Remove what writers that were killed have left beside the chunks of a sweep that is complete."""
        for left in (self.folder / RESULTS).rglob("*.partial"):
            left.unlink(missing_ok=True)


def chunk_shape(chunks: tuple[int, ...], shape: tuple[int, ...]) -> tuple[int, ...]:
    """Return the shape of chunks that are not larger than their array."""
    return tuple(min(chunk, size) for chunk, size in zip(chunks, shape, strict=True))


def _damaged(folder: Path, why: str) -> FileError:
    return FileError(
        f"is damaged, or not a sweep of plastica ({why})",
        where=str(folder),
        next_step="Name another store, and run the sweep again.",
    )


def open_store(folder: str | Path) -> Store:
    """Open a sweep, complete or not.

    Parameters
    ----------
    folder : str or Path
        What `create` made.

    Returns
    -------
    Store

    Raises
    ------
    FileError
        Where there is none, it is damaged, or of a later version.
    """
    source = as_path(folder, "store")
    if not source.is_dir() or not (source / PLAN).is_file():
        raise FileError(
            "is no folder of a sweep", where=str(source), next_step="Give the store that plastica sweep has written."
        )
    try:
        described = json.loads(read_bytes(source / PLAN, limit=LARGEST_PLAN))
        schema = int(described["schema"])
        check_schema(schema, SCHEMA, source)
        if (schema > 1 or "digest" in described) and described["digest"] != digest_of_plan(described):
            raise ValueError(f"{PLAN} has changed since it was written")
        table = {**described["sweep"], "chunk": int(described["chunk"])}
        plan = make_plan(read_document(source / SCENARIO), table, checked=False)
        store = Store(source, plan, str(described["identity"]), dict(described["versions"]), schema)
        if plan.identity_with(described["sweep"], store.versions) != store.identity:
            raise ValueError("its scenario, or a file that this reads, has changed since the sweep was begun")
        return store
    except FileError:
        raise
    except PlasticaError as error:
        raise _damaged(source, str(error).replace("\n", " ")[:200]) from None
    except (KeyError, ValueError, TypeError, AttributeError, RecursionError) as error:
        raise _damaged(source, str(error).split("\n")[0][:200]) from None
