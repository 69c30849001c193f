"""A sweep on disk: a folder with its scenario, its plan, and a Zarr store with a chunk of every variable for each task.

A chunk counts as done if its seal, which is written last, is the digest of what is there. Whatever was killed in
between, whenever, leaves chunks that are done or chunks that are not; nothing else is kept about what was done.
"""

from __future__ import annotations

import contextlib
import hashlib
import json
import os
import platform
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from plastica.errors import FileError, PlasticaError
from plastica.files import as_path, check_schema, read_bytes, regular_file
from plastica.study.reading import read_document
from plastica.study.sweep_outputs import Variable, coordinates_of, variables_of
from plastica.study.sweep_plan import Plan
from plastica.study.sweep_reading import make_plan

__all__ = ["PLAN", "RESULTS", "SCENARIO", "SCHEMA", "SEAL", "Store", "chunk_shape", "open_store"]

SCHEMA: Final = 1
PLAN: Final = "sweep.json"
SCENARIO: Final = "scenario.toml"
RESULTS: Final = "results.zarr"
LOG: Final = "log.jsonl"
SEAL: Final = "seal"
LARGEST_PLAN: Final = 64 * 2**20
LARGEST_LOG: Final = 2**30
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
    """

    folder: Path
    plan: Plan
    identity: str
    versions: Mapping[str, str]

    @cached_property
    def variables(self) -> tuple[Variable, ...]:
        """What is computed."""
        return variables_of(self.plan)

    @cached_property
    def group(self) -> Any:
        """The Zarr group."""
        import zarr

        return zarr.open_group(self.folder / RESULTS, mode="r+", zarr_format=3, use_consolidated=False)

    @cached_property
    def arrays(self) -> Mapping[str, Any]:
        """Every array that the plan asks for, opened and held to what the plan says of it.

        Raises
        ------
        FileError
            Where one is missing or of another shape.
        """
        made: dict[str, Any] = {}
        with self._damage():
            for variable in (*self.variables, *coordinates_of(self.plan)):
                array = self.group[variable.name]
                shape, chunks = (self.plan.count, *variable.shape), (self.plan.chunk, *variable.shape)
                if array.shape != shape or array.dtype != np.dtype(variable.dtype):
                    raise ValueError(f"{variable.name} is not as planned")
                if array.chunks != chunk_shape(chunks, shape):
                    raise ValueError(f"the chunks of {variable.name} are not as planned")
                made[variable.name] = array
            seal = self.group[SEAL]
            if seal.shape != (self.plan.chunks, 32):
                raise ValueError("its seals are not as planned")
            made[SEAL] = seal
        return made

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

    def values(self, first: int, last: int) -> NDArray[np.float64]:
        """Return what members first to last take; shape (members, axes)."""
        columns = []
        for axis in self.plan.axes:
            values, unreadable = self._read(axis.key, first, last)
            if unreadable:
                raise _damaged(self.folder, f"the values of {axis.key} cannot be read in chunk {unreadable[0]}")
            columns.append(np.asarray(values, dtype=float))
        return np.stack(columns, axis=1)

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
            Chunks that are taken for not computed, as are those of which one of the variables cannot be read.

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
        with contextlib.suppress(*UNREADABLE):
            return np.array(array[first:last]), []
        values, unreadable = np.full((last - first, *array.shape[1:]), array.fill_value, array.dtype), []
        for chunk in range(first // self.plan.chunk, -(-last // self.plan.chunk)):
            begin, end = self.plan.span(chunk)
            begin, end = max(begin, first), min(end, last)
            try:
                values[begin - first : end - first] = array[begin:end]
            except UNREADABLE:
                unreadable.append(chunk)
        return values, unreadable

    def absent(self) -> frozenset[int]:
        """Return the chunks of which some file is missing, by their names alone: quicker by far than `missing`."""
        there = set(range(self.plan.chunks))
        for name in (SEAL, *(each.name for each in self.variables)):
            # Each chunk has all of the further dimensions, whose place is 0.
            inner = "/0" * (len(self.arrays[name].shape) - 1)
            folder = self.folder / RESULTS / name / "c"
            found = {int(each) for each in os.listdir(folder) if each.isdecimal()} if folder.is_dir() else set()
            there &= {chunk for chunk in found & there if not inner or (folder / f"{chunk}{inner}").is_file()}
        return frozenset(range(self.plan.chunks)) - there

    def is_done(self, chunk: int) -> bool:
        """Whether all that a chunk should hold is there, by its content."""
        try:
            seal = bytes(np.asarray(self.arrays[SEAL][chunk]).tobytes())
            if not any(seal):
                return False
            first, last = self.plan.span(chunk)
            held = {each.name: np.asarray(self.arrays[each.name][first:last]) for each in self.variables}
        except UNREADABLE:
            # What cannot be decoded is not there.
            return False
        return digest_of(held) == seal

    def missing(self) -> list[int]:
        """Return the chunks that are not done."""
        return [chunk for chunk in range(self.plan.chunks) if not self.is_done(chunk)]

    def sealed(self) -> NDArray[np.bool_]:
        """Return which chunks bear a seal, without looking at what it seals."""
        with self._damage():
            return np.asarray(np.asarray(self.arrays[SEAL][:]).any(axis=1))

    def write(self, chunk: int, columns: Columns) -> None:
        """Write a chunk: its variables first, the status last of them, its seal last of all.

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
        for name in sorted(columns, key=lambda each: each == "status"):
            self.arrays[name][first:last] = columns[name]
        self.arrays[SEAL][chunk] = np.frombuffer(digest_of(columns), dtype=np.uint8)

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


def digest_of(columns: Columns) -> bytes:
    """SHA-256 over names, types, shapes and values of the variables of a chunk."""
    digest = hashlib.sha256()
    for name in sorted(columns):
        values = np.ascontiguousarray(columns[name])
        digest.update(f"{name} {values.dtype.str} {values.shape}\n".encode())
        digest.update(values.tobytes())
    return digest.digest()


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
        described = json.loads(read_bytes(regular_file(source / PLAN, limit=LARGEST_PLAN), limit=LARGEST_PLAN))
        check_schema(int(described["schema"]), SCHEMA, source)
        table = {**described["sweep"], "chunk": int(described["chunk"])}
        plan = make_plan(read_document(source / SCENARIO), table, checked=False)
        return Store(source, plan, str(described["identity"]), dict(described["versions"]))
    except FileError:
        raise
    except PlasticaError as error:
        raise _damaged(source, str(error).replace("\n", " ")[:200]) from None
    except (KeyError, ValueError, TypeError, AttributeError, RecursionError) as error:
        raise _damaged(source, str(error).split("\n")[0][:200]) from None


