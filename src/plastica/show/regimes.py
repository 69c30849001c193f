"""Pictures of a sweep: what becomes of its members, over every pair of the keys that it varies."""

from __future__ import annotations

from itertools import combinations
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from matplotlib.colors import BoundaryNorm, ListedColormap
from matplotlib.patches import Patch
from numpy.typing import NDArray

from plastica.errors import ArgumentError
from plastica.show.style import OKABE_ITO, drawing, new_figure
from plastica.study.sweep_axes import Axis
from plastica.study.sweep_outputs import REGIMES
from plastica.study.sweep_result import Sweep

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = ["regimes_figure"]

Array = NDArray[np.float64]

LOOKS: Final = {
    "recovers": "#cfe8d5",
    "buckles": OKABE_ITO["sky blue"],
    "permanent set": OKABE_ITO["orange"],
    "buckles with permanent set": OKABE_ITO["vermillion"],
    "untold": "#8a939c",
    "pending": "#ffffff",
}
"""Regime -> colour; "untold" are members that did not end as asked, "pending" those not computed yet."""

MARKS: Final = ("o", "s", "^", "D", "x", ".")
MOST_PAIRS: Final = 6
MOST_POINTS: Final = 20_000
MOST_MEMBERS: Final = 20_000_000
PANEL: Final = 4.4
"""Inches."""


def regimes_figure(sweep: Sweep) -> Figure:
    """Draw the regimes of a sweep.

    Parameters
    ----------
    sweep : Sweep
        Complete, or under way.

    Returns
    -------
    Figure
        A panel for every pair of keys, six at most. Of a grid with further keys, those are held at the value in the
        middle of theirs, which the title tells; members that are drawn are points, whatever else they take. Of a single
        key, the natural curvature at the end over that key, where it was kept.

    Raises
    ------
    ArgumentError
        Where the verdict was not kept, or there are too many members for a picture.
    """
    if "verdict" not in sweep.plan.outputs:
        raise ArgumentError(
            'must have kept the verdict of its members (outputs = ["verdict"])',
            where="result",
            next_step="Draw what was kept from its dataset.",
        )
    if sweep.members > MOST_MEMBERS:
        raise ArgumentError(
            f"must have at most {MOST_MEMBERS} members to be drawn",
            where="result",
            value=sweep.members,
            next_step="Read a part of its results with xarray.open_zarr, and draw that.",
        )
    codes = sweep.store.read(["regime"], 0, sweep.members, sweep.store.absent())["regime"].astype(int)
    codes = np.where(codes < 0, len(REGIMES), codes)
    pairs = list(combinations(range(len(sweep.axes)), 2))[:MOST_PAIRS]
    with drawing():
        columns = min(len(pairs), 3) or 1
        rows = max(1, -(-len(pairs) // columns))
        figure = new_figure(PANEL * columns + (2.2 if columns == 1 else 0.0), 3.7 * rows + 0.6)
        panels: Any = figure.subplots(rows, columns, squeeze=False)
        for ax in panels.ravel()[max(1, len(pairs)) :]:
            ax.set_visible(False)
        for ax, pair in zip(panels.ravel(), pairs, strict=False):
            _panel(ax, sweep, codes, *pair)
        if not pairs:
            _row(panels[0, 0], sweep, codes)
        _legend(figure, codes)
        title = sweep.plan.base.title or "What becomes of the rod"
        count = f"{sweep.members} members" + ("" if sweep.complete else f", {sweep.done} of them done")
        figure.suptitle(f"{title}: {count}", x=0.01, ha="left", fontsize=11, fontweight="bold")
    return figure


def _legend(figure: Figure, codes: NDArray[np.int_]) -> None:
    names = [*REGIMES, "pending"]
    present = [names[code] for code in np.unique(codes)]
    words = {"untold": "did not end as asked", "pending": "not computed yet"}
    handles = [Patch(facecolor=LOOKS[name], edgecolor="#5d6670", label=words.get(name, name)) for name in present]
    figure.legend(handles=handles, loc="outside lower center", ncols=min(3, len(handles)), frameon=False, fontsize=8.5)


def _panel(ax: Axes, sweep: Sweep, codes: NDArray[np.int_], first: int, second: int) -> None:
    """One pair of keys: the first across, the second upward."""
    axes = sweep.axes
    if sweep.plan.members.sampling == "grid":
        _map(ax, sweep, codes, first, second)
    else:
        some = np.linspace(0, sweep.members - 1, min(sweep.members, MOST_POINTS)).astype(int)
        values = sweep.store.values(0, sweep.members)[some]
        _points(ax, values[:, first], values[:, second], codes[some])
    _label(ax.xaxis, ax, axes[first], "x")
    _label(ax.yaxis, ax, axes[second], "y")


def _map(ax: Axes, sweep: Sweep, codes: NDArray[np.int_], first: int, second: int) -> None:
    table, held = codes.reshape(sweep.plan.members.shape), []
    index: list[Any] = [slice(None)] * table.ndim
    for k, axis in enumerate(sweep.axes):
        if k not in (first, second):
            middle = axis.values.size // 2
            index[k] = middle
            held.append(f"{axis.key} = {axis.shown(float(axis.values[middle]))}")
    plane = table[tuple(index)]
    x, y = _places(sweep.axes[first]), _places(sweep.axes[second])
    across, upward = np.argsort(x), np.argsort(y)
    names = [*REGIMES, "pending"]
    ax.pcolormesh(
        _edges(x[across], _log(sweep.axes[first])),
        _edges(y[upward], _log(sweep.axes[second])),
        plane[np.ix_(across, upward)].T,
        cmap=ListedColormap([LOOKS[name] for name in names]),
        norm=BoundaryNorm(np.arange(len(names) + 1) - 0.5, len(names)),
        rasterized=True,
    )
    ax.grid(False)
    if held:
        ax.set_title("where " + ", ".join(held), fontsize=8.5)


def _points(ax: Axes, x: Array, y: Array, codes: NDArray[np.int_]) -> None:
    for code, name in enumerate([*REGIMES, "pending"]):
        own = codes == code
        if own.any():
            edge: dict[str, Any] = {} if MARKS[code] == "x" else {"edgecolors": "#5d6670", "linewidths": 0.3}
            ax.scatter(x[own], y[own], s=14, color=LOOKS[name], marker=MARKS[code], **edge)


def _row(ax: Axes, sweep: Sweep, codes: NDArray[np.int_]) -> None:
    """One key alone."""
    axis = sweep.axes[0]
    x = sweep.store.values(0, sweep.members)[:, 0]
    if "final" in sweep.plan.outputs and sweep.plan.base.model.segments == 1:
        y = sweep.store.read(["natural_curvature"], 0, sweep.members, sweep.store.absent())["natural_curvature"]
        unit = "" if sweep.plan.base.model.specimen is None else " (1/m)"
        ax.set_ylabel(f"Natural curvature at the end{unit or ' × L'}")
    else:
        y = np.zeros(sweep.members)
        ax.set_yticks([])
    some = np.linspace(0, sweep.members - 1, min(sweep.members, MOST_POINTS)).astype(int)
    _points(ax, x[some], np.where(np.isfinite(y), y, 0.0)[some], codes[some])
    _label(ax.xaxis, ax, axis, "x")


def _places(axis: Axis) -> Array:
    return np.asarray(axis.values, dtype=float)


def _log(axis: Axis) -> bool:
    """Whether values are in about equal ratios rather than at equal distances."""
    values = np.sort(axis.values)
    if axis.kind == "label" or values.size < 3 or values[0] <= 0.0:
        return False
    return bool(np.ptp(np.diff(np.log(values))) < 0.1 * np.ptp(np.log(values)) / (values.size - 1))


def _edges(values: Array, log: bool) -> Array:
    """Edges between values, half-way to the next."""
    places = np.log(values) if log else values
    if places.size == 1:
        edges = np.array([places[0] - 0.5, places[0] + 0.5])
    else:
        half = 0.5 * np.diff(places)
        inner = places[:-1] + half
        edges = np.concatenate([[places[0] - half[0]], inner, [places[-1] + half[-1]]])
    return np.exp(edges) if log else edges


def _label(which: Any, ax: Axes, axis: Axis, side: str) -> None:
    which.set_label_text(f"{axis.key} ({axis.unit})" if axis.unit else axis.key)
    if axis.kind == "label":
        which.set_ticks(range(len(axis.labels)), [str(label)[:24] for label in axis.labels])
    elif _log(axis):
        (ax.set_xscale if side == "x" else ax.set_yscale)("log")
