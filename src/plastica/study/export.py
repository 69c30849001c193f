"""Variables of a result as CSV, whole or not at all."""

from __future__ import annotations

import csv
import io
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from plastica.errors import ArgumentError
from plastica.files import write_whole

if TYPE_CHECKING:
    import xarray

    from plastica.motion.solution import Solution

__all__ = ["csv_text", "table_of", "write_csv"]


def table_of(solution: Solution, name: str) -> xarray.Dataset:
    """Return a table of a solution: its dataset, a history of loading, or its energies and entropies.

    Parameters
    ----------
    solution : Solution
        The motion.
    name : str
        "motion", "force-displacement", "moment-curvature" (at the clamp) or "thermodynamics".

    Returns
    -------
    xarray.Dataset

    Raises
    ------
    ArgumentError
        Where there is no table of that name.
    """
    from plastica.motion.histories import force_displacement, moment_curvature
    from plastica.motion.thermodynamics import thermodynamics

    tables: dict[str, Callable[[Solution], xarray.Dataset]] = {
        "motion": lambda sol: sol.dataset,
        "force-displacement": force_displacement,
        "moment-curvature": moment_curvature,
        "thermodynamics": thermodynamics,
    }
    if name not in tables:
        raise ArgumentError(f"must be one of {', '.join(tables)}", where="table", value=name)
    return tables[name](solution)


def csv_text(dataset: xarray.Dataset, names: Sequence[str]) -> str:
    """Write variables as CSV: a heading "t [s],tip_y [m]", then one row for each time.

    Variables over time and arc length have one row for each time and node, those over time and segments one for each
    time and segment; variables over time alone repeat beside them. Numbers are written so that reading them gives back
    the same doubles.

    Parameters
    ----------
    dataset : xarray.Dataset
        A `Solution.dataset`.
    names : sequence of str
        Its variables.

    Returns
    -------
    str

    Raises
    ------
    ArgumentError
        Where there is no such variable, or one is over arc length and another over segments.
    """
    for name in names:
        if name not in dataset.data_vars:
            raise ArgumentError(
                "must be a variable of the result",
                where="variable",
                value=name,
                next_step=f"It has: {', '.join(map(str, dataset.data_vars))}.",
            )
    along = sorted({str(dim) for name in names for dim in dataset[name].dims} - {"t"})
    if len(along) > 1:
        rule = "must be over the same place: some of these are over arc length, some over segments"
        raise ArgumentError(rule, where="variable", value=", ".join(names), next_step="Write them one by one.")
    dims = ("t", *along)
    stream = io.StringIO()
    writer = csv.writer(stream, lineterminator="\n")
    writer.writerow(f"{name} [{dataset[name].attrs['units']}]" for name in (*dims, *names))
    writer.writerows(_rows(dataset, names, dims))
    return stream.getvalue()


def _rows(dataset: xarray.Dataset, names: Sequence[str], dims: tuple[str, ...]) -> Iterator[tuple[str, ...]]:
    shape = tuple(dataset.sizes[dim] for dim in dims)
    columns = [np.broadcast_to(dataset["t"].values.reshape(-1, *[1] * (len(dims) - 1)), shape)]
    if len(dims) == 2:
        columns.append(np.broadcast_to(dataset[dims[1]].values, shape))
    for name in names:
        values = dataset[name].values
        columns.append(np.broadcast_to(values if values.ndim == len(dims) else values[:, None], shape))
    lists = [column.ravel().tolist() for column in columns]
    return (tuple(map(repr, row)) for row in zip(*lists, strict=True))


def write_csv(dataset: xarray.Dataset, names: Sequence[str], path: str | Path) -> Path:
    """Write variables to a CSV file (see `csv_text`), whole or not at all; return its path."""
    text = csv_text(dataset, names)
    return write_whole(path, lambda aside: aside.write_text(text, encoding="utf-8"))
