"""The panels that pictures are made of: each draws one thing into axes that it is given."""

from __future__ import annotations

from textwrap import fill
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from matplotlib import colormaps
from matplotlib.colors import BoundaryNorm, LinearSegmentedColormap, ListedColormap, Normalize, TwoSlopeNorm
from matplotlib.patches import Rectangle

from plastica.physics.load import LOAD_KINDS
from plastica.physics.scales import KINDS
from plastica.show.style import DIVERGING, INK, MUTED, ROLES, SEQUENTIAL, direct_labels, room
from plastica.show.view import View, frame_times
from plastica.show.words import pretty

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from numpy.typing import NDArray

    Array = NDArray[np.float64]

__all__ = [
    "clamp",
    "curvature_panel",
    "energy_panel",
    "load_panels",
    "mark_ends",
    "plan_limits",
    "present_loads",
    "residual_panel",
    "shapes_panel",
]

CURVES: Final = 13
"""Shapes of the rod drawn in one picture."""

PLACES: Final = np.linspace(0.0, 1.0, 161)
"""Places along the rod (units of L) at which its shape is drawn."""

MAP_SIZE: Final = (160, 420)
"""Places and times of the curvature map."""

LABEL: Final = 22
"""Letters beside a panel for one load; longer words go on in a second line."""

LOAD_WORDS: Final = {
    "thrust": "Thrust",
    "transverse": "Transverse force",
    "couple": "End couple",
    "weight": "Weight per length",
}


def shapes_panel(figure: Figure, ax: Axes, seen: View) -> None:
    """Draw the rod at times chosen so that it moves between any two, coloured by time, with its clamp."""
    length = seen.length("")
    times = frame_times(seen, CURVES)
    x, y, *_ = seen.centre_lines(times, PLACES)
    colours = _time_colours()(np.linspace(0.0, 1.0, times.size)) if times.size > 1 else _time_colours()([1.0])
    for row in range(times.size):
        ax.plot(
            length(x[row]),
            length(y[row]),
            color=colours[row],
            linewidth=2.8 if row == times.size - 1 else 1.5,
            zorder=3 + row,
            label=f"rod at {seen.time.words(float(times[row]))}",
        )
    _natural_ends(ax, seen)
    clamp(ax, *plan_limits(ax, seen))
    ax.set_xlabel(seen.length("Along the clamp's tangent").label)
    ax.set_ylabel(seen.length("Across").label)
    _time_bar(figure, ax, seen, times, colours)


def _natural_ends(ax: Axes, seen: View) -> None:
    """Draw the natural configuration at the start (dotted) and at the end (dashed), once if they are the same."""
    length = seen.length("")
    ends = seen.t[[0, -1]]
    *_, x, y = seen.centre_lines(ends, PLACES)
    colour = ROLES["natural"][0]
    moved = float(np.abs(y[0] - y[1]).max() + np.abs(x[0] - x[1]).max()) > 1e-3 * seen.solution.model.scales.length
    drawn = ((0, (0, (1, 1.5)), "natural shape at the start"), (1, (0, (5, 2)), "natural shape at the end"))
    for row, dashes, words in drawn if moved else ((1, (0, (5, 2)), "natural shape"),):
        ax.plot(length(x[row]), length(y[row]), color=colour, linestyle=dashes, linewidth=1.5, zorder=18, label=words)
    handles, labels = ax.get_legend_handles_labels()
    kept = [i for i, text in enumerate(labels) if text.startswith("natural")]
    ax.legend(
        [handles[i] for i in kept],
        [labels[i] for i in kept],
        loc="lower left",
        bbox_to_anchor=(0.0, 1.0),
        ncols=2,
        frameon=False,
        fontsize=8.5,
        borderaxespad=0.2,
        handlelength=2.6,
    )


def plan_limits(
    ax: Axes, seen: View, share: float = 0.30, beyond: tuple[Array, Array] | None = None
) -> tuple[float, float]:
    """Set equal axes around every place that the rod and its natural shape reach; return their height and width.

    Parameters
    ----------
    ax : Axes
        Where.
    seen : View
        The run.
    share : float
        Least height as a share of the length, so that a straight rod is not drawn on a hair line.
    beyond : (ndarray, ndarray), optional
        Further places to make room for, in the units of the axes: those of arrows.
    """
    length = seen.length("")
    lines = seen.centre_lines(frame_times(seen, 40), PLACES[::4])
    x = length(np.concatenate([np.ravel(lines[0]), np.ravel(lines[2])]))
    y = length(np.concatenate([np.ravel(lines[1]), np.ravel(lines[3])]))
    full = float(length(seen.solution.model.scales.length))
    lower, upper = min(float(y.min()), 0.0), max(float(y.max()), 0.0)
    short = max(share * full - (upper - lower), 0.0)
    lower, upper = lower - 0.5 * short - 0.04 * full, upper + 0.5 * short + 0.04 * full
    left, right = min(float(x.min()), 0.0) - 0.07 * full, max(float(x.max()), 0.5 * full) + 0.05 * full
    if beyond is not None and beyond[0].size:
        margin = 0.03 * full
        left, right = min(left, float(beyond[0].min()) - margin), max(right, float(beyond[0].max()) + margin)
        lower, upper = min(lower, float(beyond[1].min()) - margin), max(upper, float(beyond[1].max()) + margin)
    ax.set_aspect("equal", adjustable="box")
    ax.set_xlim(left, right)
    ax.set_ylim(lower, upper)
    return upper - lower, right - left


def clamp(ax: Axes, height: float, width: float) -> None:
    """Draw the wall at s = 0."""
    size = 0.5 * min(height, 0.5 * width)
    ax.add_patch(
        Rectangle(
            (-0.03 * width, -0.5 * size),
            0.03 * width,
            size,
            facecolor="#eceff1",
            edgecolor="#9aa3ab",
            hatch="/////",
            linewidth=0.0,
            zorder=1.5,
        )
    )
    ax.plot([0.0, 0.0], [-0.5 * size, 0.5 * size], color=INK, linewidth=1.6, zorder=20, label="_clamp")


def mark_ends(ax: Axes, x: Array, y: Array, colour: str) -> None:
    """Mark where a curve begins, with a ring, and where it ends, with a disc."""
    look: dict[str, Any] = {"marker": "o", "markersize": 6, "linestyle": "none", "markeredgecolor": colour, "zorder": 5}
    ax.plot(x[:1], y[:1], markerfacecolor="white", label="_start", **look)
    ax.plot(x[-1:], y[-1:], markerfacecolor=colour, label="_end", **look)


def _time_colours() -> LinearSegmentedColormap:
    """The sequential map without its palest end, which would vanish on white."""
    return LinearSegmentedColormap.from_list("time", colormaps[SEQUENTIAL](np.linspace(0.9, 0.0, 128)))


def _time_bar(figure: Figure, ax: Axes, seen: View, times: Array, colours: Array) -> None:
    """A bar with one field for every shape drawn, some of them with their time."""
    from matplotlib.cm import ScalarMappable

    count = times.size
    norm = BoundaryNorm(np.arange(count + 1) - 0.5, count)
    bar = figure.colorbar(ScalarMappable(norm, ListedColormap(list(colours))), ax=ax, pad=0.02, aspect=24, shrink=0.95)
    chosen = np.unique(np.linspace(0, count - 1, min(count, 7)).round().astype(int))
    bar.set_ticks(list(chosen), labels=[seen.time.brief(float(times[k])) for k in chosen])
    bar.ax.minorticks_off()
    bar.set_label(seen.time.label.removesuffix(", logarithmic").removesuffix(" (logarithmic)"))
    bar.outline.set_visible(False)


def curvature_panel(figure: Figure, ax: Axes, seen: View) -> None:
    """Draw the curvature over time and arc length."""
    rows, columns = MAP_SIZE
    edges = seen.time.times(np.linspace(0.0, 1.0, columns + 1))
    middle = seen.time.times((np.arange(columns) + 0.5) / columns)
    middle = seen.near(np.clip(middle, seen.t[0], seen.t[-1]))
    length = seen.solution.model.scales.length
    s_edges = np.linspace(0.0, length, rows + 1)
    values = np.asarray(seen.solution.at(0.5 * (s_edges[:-1] + s_edges[1:])[:, None], middle[None, :]))
    axis = seen.quantity("curvature", "Curvature", float(np.abs(values).max()))
    across = seen.length("Arc length from the clamp")
    shown = axis(values)
    colours, norm = _curvature_colours(shown)
    mesh = ax.pcolormesh(
        seen.time(edges), across(s_edges), shown, cmap=colours, norm=norm, shading="flat", rasterized=True
    )
    ax.grid(visible=False)
    seen.time.apply(ax)
    ax.set_ylim(0.0, float(across(length)))
    ax.set_ylabel(across.label)
    bar = figure.colorbar(mesh, ax=ax, pad=0.02, aspect=24)
    bar.set_label(axis.label)
    bar.outline.set_visible(False)


def _curvature_colours(shown: Array) -> tuple[str, Normalize]:
    """White at 0 and two colours where the curvature has both signs; one scale from 0 where it has one."""
    low, high = float(shown.min()), float(shown.max())
    largest = max(abs(low), abs(high))
    if largest == 0.0:
        return DIVERGING, TwoSlopeNorm(0.0, -1.0, 1.0)
    if low < -0.02 * largest and high > 0.02 * largest:
        return DIVERGING, TwoSlopeNorm(0.0, -largest, largest)
    return (SEQUENTIAL, Normalize(0.0, high)) if high >= -low else (f"{SEQUENTIAL}_r", Normalize(low, 0.0))


def energy_panel(ax: Axes, seen: View, *, label_time: bool = True, without: tuple[str, ...] = ()) -> None:
    """Draw where the work of the loads goes; where they are constant also the Liapunov function since the start."""
    names = [
        ("work", "work", "work of the loads"),
        ("stored_energy", "stored", "stored energy"),
        ("viscous_dissipation", "viscous", "lost to viscosity"),
        ("natural_dissipation", "dissipation", "lost to yielding"),
    ]
    if seen.solution.model.has_inertia:
        names.append(("kinetic_energy", "kinetic", "kinetic energy"))
    # Without any load it is the stored energy itself.
    loads = seen.solution.model.loads
    if loads.is_constant and loads.sources() and "liapunov" not in without:
        names.append(("liapunov", "liapunov", "Liapunov function*"))
    values = {name: seen.values(name) for name, _, _ in names}
    if "liapunov" in values:
        # The zero of a potential means nothing, and its distance would dwarf what happens.
        values["liapunov"] = values["liapunov"] - values["liapunov"][0]
    axis = seen.quantity("work", "Energy", max(float(np.abs(each).max()) for each in values.values()))
    t = seen.time(seen.t)
    for name, role, words in names:
        colour, dashes = ROLES[role]
        ax.plot(t, axis(values[name]), color=colour, linestyle=dashes, label=words)
    seen.time.apply(ax, label=label_time)
    room(ax, *(axis(each) for each in values.values()))
    ax.set_ylabel(axis.label)
    direct_labels(ax, [(float(axis(values[name][-1])), words, ROLES[role][0]) for name, role, words in names])


def residual_panel(ax: Axes, seen: View) -> None:
    """Draw what the ledger leaves over, against the time tolerance times the largest energy."""
    held = seen.values("stored_energy")
    if seen.solution.model.has_inertia:
        held = held + seen.values("kinetic_energy")
    left = seen.values("work") - (held - held[0])
    left = left - seen.values("viscous_dissipation") - seen.values("natural_dissipation")
    scale = seen.solution.rtol * seen.solution.ledger.largest_energy
    shown = left / scale if scale > 0.0 else left
    ax.axhspan(-1.0, 1.0, color="#e3ecf3", zorder=0.4, linewidth=0.0)
    ax.plot(seen.time(seen.t), shown, color=INK, linewidth=1.2, label="residual")
    seen.time.apply(ax)
    room(ax, shown, [-1.2, 1.2])
    ax.set_ylabel("Imbalance")
    direct_labels(ax, [(1.0, "+ tolerance", MUTED), (-1.0, "− tolerance", MUTED)])


def load_panels(axes: list[Axes], seen: View) -> None:
    """Draw the programs of the loads that are present, one below the other, with their jumps upright."""
    for i, (ax, name) in enumerate(zip(axes, present_loads(seen), strict=True)):
        t, values = _program(seen, name)
        kind = LOAD_KINDS[name]
        axis = seen.kind(kind, KINDS[kind][0], _load_words(seen, name), float(np.abs(values).max()))
        colour, _ = ROLES["load"]
        ax.plot(seen.time(t), axis(values), color=colour, label=name)
        ax.fill_between(seen.time(t), 0.0, axis(values), color=colour, alpha=0.12, linewidth=0.0)
        seen.time.apply(ax, label=i == len(axes) - 1)
        room(ax, axis(values), [0.0])
        ax.set_ylabel(fill(axis.label, LABEL))


def _load_words(seen: View, name: str) -> str:
    """What a load is, with the direction of a weight that is not toward the clamp."""
    angle = seen.solution.model.loads.weight_angle
    at = pretty(f" at {np.degrees(angle):.4g}°") if name == "weight" and angle else ""
    return f"{LOAD_WORDS[name]}{at}"


def present_loads(seen: View) -> list[str]:
    """Names of the loads that are not 0 throughout; the thrust if there is none."""
    return [name for name, _ in seen.solution.model.loads.sources()] or ["thrust"]


def _program(seen: View, name: str) -> tuple[Array, Array]:
    """A load at the times drawn and on both sides of its jumps, in the user's units."""
    model, history = seen.solution.model, seen.solution.history
    program = getattr(model.loads, name)
    force = float(getattr(model.scales, LOAD_KINDS[name]))
    t = seen.sampled.t
    jumps = np.array([k.t for k in program.knots(history.end) if k.kind == "jump" and k.t > history.start])
    jumps = jumps[:2000]
    times = np.concatenate([jumps, t])
    values = np.concatenate(
        [np.asarray([program.before(float(j)) for j in jumps]), np.asarray(program(t), dtype=float)]
    )
    if jumps.size:
        times, values = np.append(times, jumps), np.append(values, np.asarray(program(jumps), dtype=float))
    order = np.argsort(times, kind="stable")
    return times[order] * model.scales.time, values[order] * force
