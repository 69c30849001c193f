"""Panels of what the rod remembers: natural curvature, drive and threshold, of the whole rod or segment by segment."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

import numpy as np
from matplotlib import colormaps

from plastica.show.style import INK, MUTED, ROLES, SEQUENTIAL, direct_labels, room
from plastica.show.view import View, yielding, yielding_by_segment

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from numpy.typing import NDArray

    Array = NDArray[np.float64]

__all__ = ["drive_panel", "memory", "natural_panel", "segments_panel", "yielding_spans"]

YIELDS: Final = "#f0c15a"
"""Of the bars of segments that yield: the ground of the whole rod's, darker."""

MOST_NAMED: Final = 6
"""Segments that are named beside their lines."""


def memory(part: Any, seen: View) -> None:
    """Draw into a figure natural curvature, drive and threshold; with several segments also which of them yield."""
    several = seen.solution.model.segments > 1
    heights = [1.0, 1.0, 0.7] if several else [1.0, 1.0]
    axes = part.subplots(len(heights), 1, sharex=True, height_ratios=heights)
    natural_panel(axes[0], seen, label_time=False)
    drive_panel(axes[1], seen, label_time=not several)
    if several:
        segments_panel(axes[2], seen)
        axes[0].set_title("Natural curvature of each segment")
        axes[1].set_title("Drive of each segment, in units of its threshold")
        axes[2].set_title("Where the natural curvature moves")
        return
    axes[0].set_title("Natural curvature (shaded: it moves)")
    axes[1].set_title("Drive and threshold")


def segment_colours(count: int) -> Array:
    """Return a colour for each segment, dark at the clamp and light at the free end."""
    return np.asarray(colormaps[SEQUENTIAL](np.linspace(0.0, 0.88, count)))


def _named(values: Array, colours: Array) -> list[tuple[float, str, Any]]:
    """Labels for the ends of the lines, one for each segment that is named."""
    count = values.shape[1]
    chosen = np.unique(np.linspace(0, count - 1, min(count, MOST_NAMED)).round().astype(int))
    place = {0: " (clamp)", count - 1: " (free end)"}
    return [(float(values[-1, j]), f"{j + 1}{place.get(int(j), '')}", colours[j]) for j in chosen]


def _lines(ax: Axes, seen: View, values: Array) -> None:
    """Draw one line for each segment, named at its end; the limits of the axes are set before."""
    colours = segment_colours(values.shape[1])
    t = seen.time(seen.t)
    for j, colour in enumerate(colours):
        ax.plot(t, values[:, j], color=colour, linewidth=1.6, label=f"segment {j + 1}", zorder=3)


def segments_panel(ax: Axes, seen: View) -> None:
    """Draw over time and arc length where the natural curvature moves: a bar for each segment from onset to arrest."""
    model = seen.solution.model
    across = seen.length("Arc length from the clamp")
    ends = across(np.asarray(model.division.breaks) * model.scales.length)
    for j, spans in enumerate(yielding_by_segment(seen.solution)):
        place = [(float(seen.time(a)), float(seen.time(b)) - float(seen.time(a))) for a, b in spans]
        if place:
            high = float(ends[j + 1] - ends[j])
            bars = ax.broken_barh(place, (float(ends[j]), high), facecolors=YIELDS, linewidth=0.0, zorder=2)
            bars.set_label(f"segment {j + 1} yields")
    cut = min(1.2, 8.0 / model.segments)
    ax.hlines(ends[1:-1], 0.0, 1.0, transform=ax.get_yaxis_transform(), colors="white", linewidth=cut, zorder=3)
    ax.grid(visible=False)
    seen.time.apply(ax)
    ax.set_ylim(0.0, float(ends[-1]))
    ax.set_ylabel(across.label.replace("Arc length from the clamp", "From the clamp"))


def natural_panel(ax: Axes, seen: View, *, label_time: bool = True) -> None:
    """Draw the natural curvature over time; where the rod yields, the ground is shaded."""
    values = seen.values("natural_curvature")
    axis = seen.quantity("natural_curvature", "Natural curvature")
    if values.ndim > 1:
        _lines(ax, seen, axis(values))
        seen.time.apply(ax, label=label_time)
        preferred = _preferred(ax, seen, axis(values), axis)
        room(ax, axis(values), preferred)
        direct_labels(ax, _named(axis(values), segment_colours(values.shape[1])))
        ax.set_ylabel(axis.label)
        return
    colour = ROLES["natural"][0]
    yielding_spans(ax, seen)
    ax.plot(seen.time(seen.t), axis(values), color=colour, label="natural curvature")
    seen.time.apply(ax, label=label_time)
    preferred = _preferred(ax, seen, axis(values), axis)
    room(ax, axis(values), preferred)
    direct_labels(ax, [(place, "preferred", MUTED) for place in preferred])
    ax.set_ylabel(axis.label)


def _preferred(ax: Axes, seen: View, shown: Array, axis: Any) -> list[float]:
    """Mark the natural curvatures that a material with three of them prefers, as far as the run comes near them."""
    well = seen.solution.model.material.well
    if well is None:
        return []
    reach = 0.5 * float(axis(well))
    places = [float(axis(each)) for each in (-well, 0.0, well)]
    near = [each for each in places if shown.min() - reach <= each <= shown.max() + reach]
    for each in near:
        ax.axhline(each, color=MUTED, linewidth=1.0, linestyle=(0, (1, 2)), zorder=1.2, label="_preferred")
    return near


def drive_panel(ax: Axes, seen: View, *, label_time: bool = True) -> None:
    """Draw the drive between plus and minus the threshold; where it is outside, the natural curvature moves.

    Of several segments, whose thresholds differ, the drives are drawn in units of the threshold.
    """
    drive, threshold = seen.values("drive"), seen.values("threshold")
    if drive.ndim > 1:
        _shares(ax, seen, drive / threshold, label_time)
        return
    largest = _readable(np.abs(drive).max(), np.abs(threshold).min())
    axis = seen.quantity("drive", "Drive", largest)
    colour, dashes = ROLES["threshold"]
    t = seen.time(seen.t)
    yielding_spans(ax, seen)
    ax.plot(t, axis(drive), color=ROLES["drive"][0], label="drive")
    for sign in (1.0, -1.0):
        ax.plot(t, sign * axis(threshold), color=colour, linestyle=dashes, linewidth=1.2, label="threshold")
    seen.time.apply(ax, label=label_time)
    room(ax, axis(drive), *_if_near(drive, threshold, axis))
    ax.set_ylabel(axis.label)
    _label_drive(ax, axis(drive), axis(threshold))


def _shares(ax: Axes, seen: View, shares: Array, label_time: bool) -> None:
    """Draw drives in units of their thresholds, with the band in which nothing moves."""
    colour, dashes = ROLES["threshold"]
    for sign in (1.0, -1.0):
        ax.axhline(sign, color=colour, linestyle=dashes, linewidth=1.2, label="threshold", zorder=2)
    _lines(ax, seen, shares)
    seen.time.apply(ax, label=label_time)
    room(ax, shares, [-1.05, 1.05])
    ax.set_ylabel("Drive / threshold")
    direct_labels(ax, _named(shares, segment_colours(shares.shape[1])))


def _readable(drive: float, threshold: float) -> float:
    """The largest value that is drawn: a threshold far above the drive is named, not drawn."""
    return float(max(drive, threshold) if threshold <= 30.0 * drive or drive == 0.0 else drive)


def _if_near(drive: Array, threshold: Array, axis: Any) -> tuple[Array, ...]:
    far = float(np.abs(threshold).min()) > 30.0 * float(np.abs(drive).max()) > 0.0
    return () if far else (axis(threshold), -axis(threshold))


def _label_drive(ax: Axes, drive: Array, threshold: Array) -> None:
    low, high = ax.get_ylim()
    entries = [(float(drive[-1]), "drive", ROLES["drive"][0])]
    if low <= float(threshold[-1]) <= high:
        entries += [(float(threshold[-1]), "threshold", INK), (-float(threshold[-1]), "−threshold", INK)]
    else:
        ax.text(
            0.99,
            0.95,
            f"The threshold, ±{float(threshold[-1]):.3g}, lies far outside this picture.",
            transform=ax.transAxes,
            fontsize=8.5,
            color=MUTED,
            va="top",
            ha="right",
        )
    direct_labels(ax, entries)


def yielding_spans(ax: Axes, seen: View) -> None:
    """Shade the times at which the natural curvature moves, and mark their beginnings and ends."""
    spans = yielding(seen.solution)
    if not spans:
        return
    place = [(float(seen.time(a)), float(seen.time(b)) - float(seen.time(a))) for a, b in spans]
    band = ax.broken_barh(
        place,
        (0.0, 1.0),
        transform=ax.get_xaxis_transform(),
        facecolors=ROLES["yielding"][0],
        alpha=0.8,
        linewidth=0.0,
        zorder=0.5,
    )
    band.set_label("yields")
    if len(spans) > 12:
        return
    for event in seen.solution.events:
        if event.kind in ("onset", "arrest"):
            ax.axvline(float(seen.time(event.t)), color=MUTED, linewidth=0.8, linestyle=(0, (2, 2)), zorder=1)
