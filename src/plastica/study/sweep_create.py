"""Make the folder of a sweep, whole or not at all."""

from __future__ import annotations

import json
import shutil
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from plastica.errors import FileError, StorageError, unusable
from plastica.files import as_path
from plastica.study.building import inside
from plastica.study.sweep_aside import folder_aside, remove_leftovers
from plastica.study.sweep_chunks import check_chunk
from plastica.study.sweep_differences import differences
from plastica.study.sweep_outputs import Fixed, Variable, coordinates_of, fixed_of, variables_of
from plastica.study.sweep_plan import Plan
from plastica.study.sweep_seals import digest_of_plan
from plastica.study.sweep_store import PLAN, RESULTS, SCENARIO, SCHEMA, SEAL, Store, chunk_shape, open_store

__all__ = ["bytes_of", "create", "mend_fixed", "room", "size", "stored_bytes"]

LEAST_FREE: Final = 1.1
"""How many times the uncompressed size of a sweep must be free on the disk, beside what is to spare."""

SPARE: Final = 100_000_000
"""Bytes that must be free beside that: for folders, names, logs, and all else that uses the disk."""

AT_A_TIME: Final = 500_000
"""Members whose values are written at a time."""


def bytes_of(plan: Plan) -> int:
    """Return the size of a finished sweep before compression."""
    return plan.count * sum(each.bytes_per_member for each in (*variables_of(plan), *coordinates_of(plan)))


def stored_bytes(plan: Plan, columns: Mapping[str, NDArray[Any]]) -> int:
    """Return the size of some members' variables as the store compresses them."""
    import zarr
    from zarr.storage import MemoryStore

    group, found = zarr.create_group(MemoryStore(), zarr_format=3), 0
    few = replace(plan, members=replace(plan.members, sampling="list", count=len(columns["status"])))
    for variable in variables_of(plan):
        array = _make(group, few, variable)
        array[:] = columns[variable.name]
        found += array.nbytes_stored()
    return found


def create(folder: str | Path, plan: Plan) -> Store:
    """Make the folder of a sweep, whole or not at all; take it up where there is one of the same sweep already.

    Parameters
    ----------
    folder : str or Path
        Where it shall be; the folder above is made if need be. A folder that is empty is replaced.
    plan : Plan
        The sweep.

    Returns
    -------
    Store

    Raises
    ------
    FileError
        Where there is something else, the disk is too small, or it cannot be written.
    """
    target = as_path(folder, "store")
    remove_leftovers(target)
    if target.exists() and not _empty(target):
        return _taken_up(target, plan)
    _check_disk(target, plan)
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        with folder_aside(target) as aside:
            # An empty folder that is there is replaced, by one that whoever may use it may use as well.
            aside.chmod(target.stat().st_mode & 0o7777 if target.exists() else 0o755)
            _fill(aside, plan)
            aside.rename(target)
    except OSError as error:
        if target.exists() and not _empty(target):
            return _taken_up(target, plan)
        raise unusable(target, "made", error) from None
    return Store(target, plan, plan.identity, plan.versions)


def _empty(target: Path) -> bool:
    """Whether there is a folder with nothing in it, which a sweep may take the place of."""
    return target.is_dir() and not target.is_symlink() and not any(target.iterdir())


def _taken_up(target: Path, plan: Plan) -> Store:
    if not (target / PLAN).is_file():
        raise FileError(
            "is there already, and is no folder of a sweep",
            where=str(target),
            next_step="Name a folder that does not exist yet, or is empty.",
        )
    found = open_store(target)
    if found.identity != plan.identity:
        raise FileError(
            f"holds another sweep: {differences(found, plan)}", where=str(target), next_step="Name another store."
        )
    return replace(found, plan=plan)


def room(target: Path, plan: Plan) -> tuple[int, int]:
    """Return how many bytes must be free on the disk of a store before it is made, and how many are.

    One that is there already is not made again: it needs none.
    """
    above = next(parent for parent in target.absolute().parents if parent.exists())
    needed = 0 if (target / PLAN).is_file() else int(LEAST_FREE * bytes_of(plan)) + SPARE
    return needed, shutil.disk_usage(above).free


def size(count: float) -> str:
    """Write bytes for people: three digits, in a unit that suits them."""
    for unit, name in ((1e12, "TB"), (1e9, "GB"), (1e6, "MB"), (1e3, "kB")):
        if count >= unit:
            return f"{count / unit:.3g} {name}"
    return f"{count:.0f} bytes"


def _check_disk(target: Path, plan: Plan) -> None:
    needed, free = room(target, plan)
    if needed > free:
        raise StorageError(
            f"needs {size(needed)} free on the disk (up to {size(bytes_of(plan))} of results, a tenth more, and "
            f"{size(SPARE)} to spare), and {size(free)} are",
            where=str(target),
            next_step="Keep fewer outputs or members, or name a store on another disk.",
        )


def _fill(folder: Path, plan: Plan) -> None:
    """Write all but what is to be computed."""
    (folder / SCENARIO).write_text(plan.document.text, encoding="utf-8")
    for name in plan.inputs:
        copy = folder / name
        copy.parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(inside(plan.document.file.parent, name), copy)
    described = {
        "schema": SCHEMA,
        "identity": plan.identity,
        "scenario": plan.document.file.name,
        "sweep": plan.table,
        "chunk": plan.chunk,
        "versions": plan.versions,
    }
    _fill_results(folder / RESULTS, plan)
    # Last: until then the file says that the folder is being made.
    described["digest"] = digest_of_plan(described)
    (folder / PLAN).write_text(json.dumps(described, indent=1, allow_nan=False) + "\n", encoding="utf-8")


def _fill_results(path: Path, plan: Plan) -> None:
    import zarr

    varied = [axis.key for axis in plan.axes] + (["s_weight"] if "state" in plan.outputs else [])
    about = {
        "title": plan.base.title or "a sweep",
        "plastica_sweep": SCHEMA,
        "sampling": plan.members.sampling,
        "identity": plan.identity,
        # As xarray reads it: what is varied comes as coordinates.
        "coordinates": " ".join(varied),
    }
    group = zarr.create_group(path, zarr_format=3, attributes=about)
    for variable in variables_of(plan):
        _make(group, plan, variable)
    for fixed in fixed_of(plan):
        _make_fixed(group, fixed)
    coordinates = [_make(group, plan, each) for each in coordinates_of(plan)]
    for axis, array in zip(plan.axes, coordinates, strict=True):
        if axis.kind == "label":
            array.update_attributes({"labels": list(axis.words)})
    first = 0
    # Chunks of the coordinates are written whole, some at a time.
    size = plan.chunk * max(1, AT_A_TIME // plan.chunk)
    for block in plan.members.blocks(size):
        for values, array in zip(block.T, coordinates, strict=True):
            array[first : first + len(values)] = values.astype(array.dtype)
        first += len(block)
    seal = group.create_array(
        SEAL,
        shape=(plan.chunks, 32),
        chunks=(1, 32),
        dtype="u1",
        fill_value=0,
        compressors=None,
        dimension_names=("chunk", "byte"),
    )
    seal.update_attributes({"long_name": "digest of every chunk that is done, with what its members take"})


def _make(group: Any, plan: Plan, variable: Variable) -> Any:
    from zarr.codecs import Crc32cCodec, ZstdCodec

    shape = (plan.count, *variable.shape)
    return group.create_array(
        variable.name,
        shape=shape,
        chunks=chunk_shape((plan.chunk, *variable.shape), shape),
        dtype=variable.dtype,
        fill_value=variable.fill,
        compressors=[ZstdCodec(level=3), Crc32cCodec()],
        dimension_names=variable.dims,
        attributes=variable.attributes,
        config={"write_empty_chunks": True},
    )


def _make_fixed(group: Any, fixed: Fixed) -> None:
    """Write a coordinate that all members share."""
    array = group.create_array(
        fixed.name,
        shape=fixed.values.shape,
        dtype="<f8",
        fill_value=np.nan,
        dimension_names=(fixed.dim,),
        attributes=fixed.attributes,
        overwrite=True,
    )
    array[:] = fixed.values


def mend_fixed(store: Store) -> None:
    """Write the coordinates that all members share anew where they are not as planned; nothing here reads them."""
    for fixed in fixed_of(store.plan):
        if not _holds(store, fixed):
            _make_fixed(store.group, fixed)


def _holds(store: Store, fixed: Fixed) -> bool:
    """Whether a coordinate that all members share is as planned."""
    values = fixed.values
    try:
        array = store.array(fixed.name)
        if (array.shape, array.chunks, array.dtype) != (values.shape, values.shape, values.dtype):
            return False
        check_chunk(store.folder / RESULTS / fixed.name / "c" / "0", values.nbytes, compressed=True)
        return np.array_equal(np.asarray(array[:]), values)
    except (KeyError, TypeError, AttributeError, ValueError, RuntimeError, OSError):
        return False
