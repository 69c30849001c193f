"""A solution in a file: written whole or not at all, read back equal, refused where it is damaged."""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Iterator, Mapping
from io import FileIO
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from plastica.errors import ArgumentError, FileError
from plastica.files import Medium, as_path, check_schema, regular_file, write_whole
from plastica.material.material import Material
from plastica.motion.history import History
from plastica.motion.record import Counts
from plastica.motion.solution import Solution
from plastica.numerics.grid import Grid
from plastica.physics.load import Load
from plastica.physics.model import Model
from plastica.physics.rod import Rod
from plastica.physics.scales import Specimen
from plastica.physics.status import Status
from plastica.physics.strut import Strut

if TYPE_CHECKING:
    import h5py
    import xarray

__all__ = ["SCHEMA", "model_from_dict", "model_to_dict", "read", "write"]

SCHEMA = 1
"""Version of the file's layout. A later one must still read this one: see CONTRIBUTING, "Files"."""

LARGEST = 4 * 2**30
"""Bytes of the largest file that is read."""

EXPANSION, SPARE = 16, 2**26
"""A file may declare so many times its own size, and so many bytes more, of values: beyond that it is no result. Those
written here declare less than their size; other programs may have packed them."""

DEEPEST = 3
"""Groups within groups that are looked into; a result has one."""

INERTIA = ("translational_inertia", "rotary_inertia", "damping")
BLOCK = 2**24
"""Bytes of values that are digested at once."""

HISTORY = ("node_t", "node_y", "first_node", "leg_start", "leg_moving")
_NEEDED = frozenset(f"history/{name}" for name in HISTORY)


def write(solution: Solution, path: str | Path) -> Path:
    """Write a solution as netCDF: its dataset, and in group `history` all that `read` needs.

    Parameters
    ----------
    solution : Solution
        What to keep.
    path : str or Path
        The file, by convention with suffix ".nc"; its folder must exist.

    Returns
    -------
    Path
        The file written.

    Raises
    ------
    ArgumentError
        Where the path is neither text nor a Path.
    FileError
        Where it cannot be written.
    """
    import xarray

    target = as_path(path)
    history = solution.history
    starts, moving = solution.legs
    group = xarray.Dataset(
        {
            "node_t": ("node", history.t),
            "node_y": (("node", "component"), history.y),
            "first_node": ("step_end", history.first),
            "leg_start": ("leg", starts),
            "leg_moving": (("leg_end", "segment")[: moving.ndim], moving.astype(np.int8)),
        }
    )
    meta = json.dumps(_meta(solution), sort_keys=True, allow_nan=False)

    return write_whole(target, lambda aside: _fill(aside, solution.dataset, group, meta))


def _fill(aside: Path, dataset: xarray.Dataset, group: xarray.Dataset, meta: str) -> None:
    import h5netcdf
    import h5py
    from xarray.backends import H5NetCDFStore

    with FileIO(aside, "w+") as opened:
        medium = Medium(opened)
        with h5netcdf.File(medium, "w") as file:
            dataset.dump_to_store(H5NetCDFStore(file))
            group.dump_to_store(H5NetCDFStore(file, group="history", mode="a"))
        medium.check()
        with h5py.File(medium, "r+") as file:
            _seal(file, meta)
        medium.check()


def read(path: str | Path) -> Solution:
    """Read a solution from a file written by `Solution.save` or `plastica run`.

    Parameters
    ----------
    path : str or Path
        A netCDF file of this package.

    Returns
    -------
    Solution
        Equal to the one that was written.

    Raises
    ------
    ArgumentError
        Where the path is neither text nor a Path.
    FileError
        Where the file is missing, a folder, damaged, not of this package, of a later version, or would unpack to
        much more than it is.
    """
    import h5py

    source = regular_file(path, limit=LARGEST)
    try:
        with h5py.File(source, "r") as file:
            meta = _opened(file, source)
            arrays = {name: np.asarray(file[f"history/{name}"][()]) for name in HISTORY}
        return _rebuilt(meta, arrays)
    except FileError:
        raise
    except (
        ArgumentError,
        OSError,
        KeyError,
        ValueError,
        TypeError,
        AttributeError,
        RuntimeError,
        MemoryError,
    ) as error:
        raise _damaged(source, str(error).split("\n")[0][:200]) from None


def _damaged(source: Path, why: str) -> FileError:
    return FileError(
        f"is damaged, or not a result of plastica ({why})",
        where=str(source),
        next_step="Take another copy, or run its scenario again.",
    )


def _meta(solution: Solution) -> dict[str, Any]:
    return {
        "model": model_to_dict(solution.model),
        "status": vars(solution.status),
        "counts": vars(solution.counts),
        "method": solution.method,
        "rtol": solution.rtol,
        "atol": solution.atol,
        "times": None if solution.times is None else solution.times.tolist(),
        "initial": solution.initial,
        "first_natural": solution.first_natural.tolist(),
        "notes": list(solution.notes),
        "wall": solution.wall,
        "provenance": solution.provenance,
    }


def _rebuilt(meta: Mapping[str, Any], arrays: Mapping[str, NDArray[Any]]) -> Solution:
    model = model_from_dict(meta["model"])
    history = History(arrays["node_t"], arrays["node_y"], arrays["first_node"].astype(np.int64))
    nodes, layout, starts = history.t.size, model.layout, arrays["leg_start"].size
    moving = arrays["leg_moving"].astype(bool)
    sound = (
        history.y.shape == (nodes, layout.size)
        and history.first.size >= 1
        and history.first[0] == 0
        and (history.steps == 0 or (history.first[-1] == nodes and np.all(np.diff(history.first) >= 2)))
        and np.all(np.diff(history.t) >= 0.0)
        and moving.shape == ((starts + 1,) if model.segments == 1 else (starts + 1, model.segments))
    )
    if not sound:
        raise ValueError("its history does not fit its model")
    times = meta["times"]
    return Solution(
        model=model,
        history=history,
        legs=(arrays["leg_start"], moving),
        status=Status(**meta["status"]),
        counts=Counts(**meta["counts"]),
        method=str(meta["method"]),
        rtol=float(meta["rtol"]),
        atol=float(meta["atol"]),
        times=None if times is None else np.asarray(times, dtype=float),
        initial=str(meta["initial"]),
        first_natural=np.asarray(meta.get("first_natural", layout.natural(history.y[0])), dtype=float),
        notes=tuple(str(note) for note in meta["notes"]),
        wall=float(meta["wall"]),
        provenance={str(key): str(value) for key, value in meta["provenance"].items()},
    )


def model_to_dict(model: Model) -> dict[str, Any]:
    """Return what a model is made of, as plain values for a file; what has its default is left out."""
    described: dict[str, Any] = {
        "kind": "strut",
        "material": model.material.to_dict(),
        "load": model.load.to_dict(),
        "grid": {"nodes": model.grid.nodes, "breaks": list(model.grid.breaks)},
        "specimen": None if model.specimen is None else model.specimen.to_dict(),
    }
    segments = model.natural_segments
    if segments != 1:
        described["natural_segments"] = segments if isinstance(segments, int) else list(segments)
    if isinstance(model, Rod):
        described |= {"kind": "rod"} | {name: getattr(model, name) for name in INERTIA}
    return described


def model_from_dict(data: Mapping[str, Any]) -> Model:
    """Build a model from `model_to_dict`, checked as any user's is.

    Raises
    ------
    ArgumentError, KeyError, TypeError, ValueError
        Where the data do not describe one.
    """
    parts = (
        Material(**data["material"]),
        Load.from_dict(data["load"]),
        Grid(data["grid"]["nodes"], tuple(data["grid"]["breaks"])),
        None if data["specimen"] is None else Specimen.from_dict(data["specimen"]),
    )
    segments = data.get("natural_segments", 1)
    if data["kind"] == "strut":
        return Strut(*parts, natural_segments=segments)
    if data["kind"] == "rod":
        return Rod(*parts, natural_segments=segments, **{name: data[name] for name in INERTIA})
    raise ValueError(f"its model is of the unknown kind {data['kind']!r}")


# -- the seal: a digest over every value in the file, so that no flipped bit goes unseen -------------------------


def _seal(file: h5py.File, meta: str) -> None:
    file.attrs["plastica_schema"] = SCHEMA
    file.attrs["plastica_meta"] = meta
    file.attrs["plastica_digest"] = _digest(file)


def _opened(file: h5py.File, source: Path) -> dict[str, Any]:
    """Check version, size and seal, and return the description of the run."""
    if "plastica_schema" not in file.attrs:
        raise _damaged(source, "it has no plastica_schema")
    check_schema(int(file.attrs["plastica_schema"]), SCHEMA, source)
    _check_size(file, source.stat().st_size)
    if str(file.attrs["plastica_digest"]) != _digest(file):
        raise _damaged(source, "its contents do not match its digest")
    meta = json.loads(str(file.attrs["plastica_meta"]))
    if not isinstance(meta, dict):
        raise _damaged(source, "its description is not a table")
    return meta


def _check_size(file: h5py.File, size: int) -> None:
    """Refuse a file that would unpack to much more than it is, or leads elsewhere, before any of its values is read."""
    declared = 0
    for name, data in _items(file):
        if data.is_virtual or data.external:
            raise ValueError(f"the values of {name} lie in other files")
        if name in _NEEDED and data.dtype.kind not in "fiu":
            raise ValueError(f"{name} holds no numbers")
        declared += math.prod(data.shape or ()) * data.dtype.itemsize
    if declared > min(LARGEST, EXPANSION * size + SPARE):
        raise ValueError(f"it is {size} bytes long, and declares {declared} bytes of values")


def _digest(file: h5py.File) -> str:
    """SHA-256 over names, shapes, values and attributes of everything but the digest itself."""
    digest = hashlib.sha256()
    for name, data in _items(file):
        if data.dtype.kind in "fiu":
            digest.update(f"{name} {data.dtype.str} {data.shape}".encode())
            # Row after row, so that it takes no more memory than the largest block.
            for rows in _blocks(data):
                digest.update(np.ascontiguousarray(data[rows]).tobytes())
            digest.update(_text(data.attrs, ("units", "long_name")))
    digest.update(_text(file.attrs, sorted(set(file.attrs) - {"plastica_digest"})))
    return digest.hexdigest()


def _blocks(data: h5py.Dataset) -> Iterator[Any]:
    """Give what selects block after block of a dataset, in order."""
    if not data.shape or 0 in data.shape:
        yield ()
        return
    rows = max(1, BLOCK // (math.prod(data.shape[1:]) * data.dtype.itemsize))
    yield from (slice(start, start + rows) for start in range(0, data.shape[0], rows))


def _items(group: h5py.Group, prefix: str = "", depth: int = 0) -> Iterator[tuple[str, h5py.Dataset]]:
    """Give every dataset with its name, in order; links that lead out of the file are refused."""
    import h5py

    if depth > DEEPEST:
        raise ValueError("it has groups within groups without end")
    for name in sorted(group):
        if not isinstance(group.get(name, getlink=True), h5py.HardLink):
            raise ValueError(f"{prefix}{name} is a link")
        item = group[name]
        if isinstance(item, h5py.Group):
            yield from _items(item, f"{prefix}{name}/", depth + 1)
        elif isinstance(item, h5py.Dataset):
            yield f"{prefix}{name}", item


def _text(attributes: Any, names: Any) -> bytes:
    return json.dumps({name: str(attributes[name]) for name in names if name in attributes}).encode()
