"""Pictures of a sweep: what becomes of its members, over every pair of the keys that it varies."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations, takewhile
from textwrap import fill
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from matplotlib.colors import BoundaryNorm, ListedColormap
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from numpy.typing import NDArray

from plastica.errors import ArgumentError
from plastica.show.style import OKABE_ITO, drawing, new_figure
from plastica.study.sweep_axes import Axis
from plastica.study.sweep_outputs import REGIMES
from plastica.study.sweep_plan import Plan
from plastica.study.sweep_result import Sweep, plural

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = ["check_drawable", "regimes_figure"]

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
MOST_KEYS: Final = 6
"""Keys of which every pair is drawn: 15 panels."""

MOST_TICK: Final = 30
"""Characters of a text or table at an axis."""

DECADES: Final = 100.0
"""Values that are listed are drawn over their logarithm if they spread by this factor, and evenly so."""

MOST_POINTS: Final = 20_000
MOST_MEMBERS: Final = 20_000_000
LEVEL: Final = 8
"""Characters of a tick label beyond which labels below the panel are slanted."""

CONTEXT: Final = 16
"""Characters that are kept of what long texts have in common, beside what differs."""

WIDEST_TITLE: Final = 62
"""Characters of a line above a panel."""

EDGE: Final = "#5d6670"
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
        A panel for every pair of keys, of the first six keys where there are more, which is said below. Of a grid with
        further keys, those are held at the value in the middle of theirs, which the title tells; members that are drawn
        are points, whatever else they take. Of a single key, the natural curvature at the end over that key, where it
        was kept.

    Raises
    ------
    ArgumentError
        Where the verdict was not kept, or there are too many members for a picture.
    """
    check_drawable(sweep.plan)
    codes = sweep.store.read(["regime"], 0, sweep.members, sweep.missing)["regime"].astype(int)
    codes = np.where(codes < 0, len(REGIMES), codes)
    pairs = list(combinations(range(min(len(sweep.axes), MOST_KEYS)), 2))
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
        mapped = bool(pairs) and sweep.plan.members.sampling == "grid"
        _legend(figure, codes, [axis.key for axis in sweep.axes[MOST_KEYS:]], mapped=mapped)
        title = sweep.plan.base.title or "What becomes of the rod"
        count = plural(sweep.members, "member") + ("" if sweep.complete else f", {sweep.done} of them done")
        figure.suptitle(f"{title}: {count}", x=0.01, ha="left", fontsize=11, fontweight="bold")
    return figure


def check_drawable(plan: Plan) -> None:
    """Refuse sweeps that cannot be drawn, which can be told before they are computed.

    Raises
    ------
    ArgumentError
        As of `regimes_figure`.
    """
    if "verdict" not in plan.outputs:
        raise ArgumentError(
            'must have kept the verdict of its members (outputs = ["verdict"])',
            where="result",
            next_step="Draw what was kept from its dataset.",
        )
    if plan.count > MOST_MEMBERS:
        raise ArgumentError(
            f"must have at most {MOST_MEMBERS} members to be drawn",
            where="result",
            value=plan.count,
            next_step="Read a part of its results with xarray.open_zarr, and draw that.",
        )


def _legend(figure: Figure, codes: NDArray[np.int_], left_out: list[str], *, mapped: bool) -> None:
    names = [*REGIMES, "pending"]
    words = {"untold": "did not end as asked", "pending": "not computed yet"}
    handles: list[Any] = []
    for code in np.unique(codes):
        look: dict[str, Any] = {"color": LOOKS[names[code]], "label": words.get(names[code], names[code])}
        if mapped:
            handles.append(Patch(**look, ec=EDGE))
        else:
            handles.append(Line2D([], [], ls="", marker=MARKS[code], markersize=6.0, mec=_edge(code), **look))
    title = f"Not drawn: pairs with {', '.join(left_out)}" if left_out else None
    figure.legend(
        handles=handles,
        loc="outside lower center",
        ncols=min(3, len(handles)),
        frameon=False,
        fontsize=8.5,
        title=title,
        title_fontsize=8.5,
    )


def _edge(code: int) -> str:
    """Colour of a marker's edge; a cross has nothing else."""
    return LOOKS[[*REGIMES, "pending"][code]] if MARKS[code] == "x" else EDGE


def _panel(ax: Axes, sweep: Sweep, codes: NDArray[np.int_], first: int, second: int) -> None:
    """One pair of keys: the first across, the second upward."""
    axes = sweep.axes
    if sweep.plan.members.sampling == "grid":
        _map(ax, sweep, codes, first, second)
    else:
        some = np.linspace(0, sweep.members - 1, min(sweep.members, MOST_POINTS)).astype(int)
        values = sweep.taken[some]
        _points(ax, values[:, first], values[:, second], codes[some])
    _label(ax.xaxis, ax, axes[first], "x")
    _label(ax.yaxis, ax, axes[second], "y")


def _map(ax: Axes, sweep: Sweep, codes: NDArray[np.int_], first: int, second: int) -> None:
    table, held = codes.reshape(sweep.plan.members.shape), []
    index: list[Any] = [slice(None)] * table.ndim
    for k, axis in enumerate(sweep.axes):
        if k not in (first, second):
            index[k] = middle = _middle(axis)
            words = shortened(axis.words)[int(axis.values[middle])] if axis.labels else axis.shown(axis.values[middle])
            held.append(f"{axis.key} = {words}")
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
        ax.set_title(fill("where " + ", ".join(held), WIDEST_TITLE), fontsize=7.5, fontweight="normal", loc="left")


def _middle(axis: Axis) -> int:
    """The place of the median, in whatever order the values are."""
    return int(np.argsort(axis.values, kind="stable")[axis.values.size // 2])


def _points(ax: Axes, x: Array, y: Array, codes: NDArray[np.int_]) -> None:
    for code, name in enumerate([*REGIMES, "pending"]):
        own = codes == code
        if own.any():
            edge: dict[str, Any] = {} if MARKS[code] == "x" else {"edgecolors": EDGE, "linewidths": 0.3}
            ax.scatter(x[own], y[own], s=14, color=LOOKS[name], marker=MARKS[code], **edge)


def _row(ax: Axes, sweep: Sweep, codes: NDArray[np.int_]) -> None:
    """One key alone."""
    axis = sweep.axes[0]
    x = sweep.taken[:, 0]
    if "final" in sweep.plan.outputs and sweep.plan.base.model.segments == 1:
        y = sweep.store.read(["natural_curvature"], 0, sweep.members, sweep.missing)["natural_curvature"]
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
    """Whether values are drawn over their logarithm: by their range, or as they are spread where they are listed."""
    values = np.unique(axis.values)
    if not axis.listed:
        return axis.spacing == "log"
    if axis.kind == "label" or values.size < 3 or values[0] <= 0.0:
        return False
    logs = np.log(values)
    even = bool(np.ptp(np.diff(logs)) < 0.1 * np.ptp(logs) / (values.size - 1))
    return even or (values[-1] >= DECADES * values[0] and _lopsided(logs) < _lopsided(values))


def _lopsided(values: Array) -> float:
    """How far the median is from the middle, in units of the range."""
    return float(abs((np.median(values) - values[0]) / (values[-1] - values[0]) - 0.5))


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
        which.set_ticks(range(len(axis.labels)), shortened(axis.words))
        if side == "x" and max(map(len, shortened(axis.words))) > LEVEL:
            ax.tick_params(axis="x", labelrotation=20.0)
            for tick in ax.get_xticklabels():
                tick.set_horizontalalignment("right")
    elif _log(axis):
        (ax.set_xscale if side == "x" else ax.set_yscale)("log")


def shortened(words: Sequence[str]) -> list[str]:
    """Return texts for an axis: what all have in common left out where they are long, and no two of them the same."""
    if max(map(len, words)) <= MOST_TICK:
        return list(words)
    start = _common(words) if len(words) > 1 else 0
    end = _common([word[start:][::-1] for word in words]) if len(words) > 1 else 0
    # A few characters on either side tell what it is that differs.
    start, end = words[0].find(" ", max(0, start - CONTEXT), start) + 1, max(0, end - CONTEXT)
    made = [_cut(word, start, len(word) - end) for word in words]
    return made if len(set(made)) == len(made) else [f"{i + 1}: {each}" for i, each in enumerate(made)]


def _common(words: Sequence[str]) -> int:
    """How many characters they have in common at the beginning."""
    return sum(1 for _ in takewhile(lambda column: len(set(column)) == 1, zip(*words, strict=False)))


def _cut(word: str, start: int, stop: int) -> str:
    """A part of a text, with dots where something is left out."""
    part = word[start:stop]
    dots = "\N{HORIZONTAL ELLIPSIS}"
    if len(part) > MOST_TICK:
        part, stop = part[:MOST_TICK], start + MOST_TICK
    return (dots if start else "") + part + (dots if stop < len(word) else "")
