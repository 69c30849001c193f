"""A picture of all equilibria under one thrust: their curve, what is admissible, and where motions can end."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import NDArray

from plastica.equilibria.elastica import drive as drive_of
from plastica.equilibria.elastica import ends
from plastica.equilibria.equilibrium_set import EquilibriumSet
from plastica.equilibria.oscillation import unstable_count
from plastica.show.measure import Measure
from plastica.show.rods import WIDTH
from plastica.show.style import INK, MUTED, OKABE_ITO, ROLES, drawing, new_figure, room

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = ["ADMISSIBLE", "set_figure", "unstable_dashes"]

Array = NDArray[np.float64]

ADMISSIBLE: Final = "#d9ecdf"
"""Ground where the natural curvature stays."""

POINTS: Final = 1201
SHOWN: Final = 4.0
"""The drive is drawn up to this many of the largest thresholds: farther out it only grows."""

MARKS: Final = {
    "a limit of motions": ("o", INK, INK),
    "repelling, or a saddle": ("o", "white", INK),
    "tangency": ("s", OKABE_ITO["orange"], INK),
    "fold": ("D", OKABE_ITO["purple"], INK),
}
"""What a point is -> marker, its face and its edge."""


def set_figure(found: EquilibriumSet) -> Figure:
    """Draw all equilibria under one thrust over the clamp curvature that names them.

    Parameters
    ----------
    found : EquilibriumSet
        What `plastica.equilibria` returned.

    Returns
    -------
    Figure
        Natural curvature above, drive with its threshold below; the ground is shaded where the drive is within the
        threshold, the line broken where the shape is unstable; marks for limiting equilibria, tangencies and folds.
    """
    measure = Measure(found.specimen)
    alpha = np.linspace(*_shown(found), POINTS)
    end = ends(found.gamma, alpha)
    stable = unstable_count(found.gamma, alpha, end) == 0
    across = measure.axis("curvature", "Curvature at the clamp", float(np.abs(alpha).max()))
    with drawing():
        figure = new_figure(WIDTH, 5.6)
        upper, lower = figure.subplots(2, 1, sharex=True)
        for ax in (upper, lower):
            _ground(ax, across, found, alpha)
        _natural(upper, measure, across, alpha, np.asarray(end.mu_nat), stable, found)
        _drive(lower, measure, across, alpha, np.asarray(drive_of(end, found.laws)), stable, found)
        lower.set_xlim(float(across(alpha[0])), float(across(alpha[-1])))
        lower.set_xlabel(across.label)
        figure.suptitle(_title(found, measure), x=0.01, ha="left", fontsize=11, fontweight="bold")
        _legend(figure, upper, lower)
    return figure


def _title(found: EquilibriumSet, measure: Measure) -> str:
    pieces, count = len(found.intervals), sum(point.attracting and point.unstable == 0 for point in found.limiting)
    where = measure.write(found.gamma, "force")
    words = f"{pieces} interval{'s' if pieces != 1 else ''}"
    return f"All equilibria under {where}: {words}, {count} limiting equilibria that motions can end at"


def _shown(found: EquilibriumSet) -> tuple[float, float]:
    """The part of the range where something is: limiting equilibria and folds, with a margin."""
    low, high = found.range
    places = [point.alpha for point in found.limiting] + [fold.alpha for fold in found.folds]
    if not places:
        reach = 4.0 * np.sqrt(found.gamma) + 2.0
        return max(low, -reach), min(high, reach)
    margin = 0.12 * max(max(places) - min(places), 1e-3)
    return max(low, min(places) - margin), min(high, max(places) + margin)


def _ground(ax: Axes, across: Any, found: EquilibriumSet, alpha: Array) -> None:
    for low, high in found.intervals:
        left, right = float(across(max(low, alpha[0]))), float(across(min(high, alpha[-1])))
        if right > left:
            # The edge keeps an interval visible that is narrower than a dot.
            ax.axvspan(left, right, facecolor=ADMISSIBLE, edgecolor="#a9d3b8", zorder=0.5, label="_admissible")
    ax.axhline(0.0, color=MUTED, linewidth=0.8, zorder=1.2, label="_zero")


def unstable_dashes(ax: Axes, x: Array, y: Array, stable: NDArray[np.bool_], colour: str, words: str) -> None:
    """Draw a line solid where a mask holds and broken elsewhere; both parts carry their words."""
    for chosen, dashes, width, part in ((stable, "-", 2.0, "stable"), (~stable, (0, (2.5, 1.8)), 1.4, "unstable")):
        # A part keeps the first point of the next, so that no gap is left between them.
        wide = chosen | np.append(False, chosen[:-1])
        if chosen.any():
            shown = np.where(wide, y, np.nan)
            ax.plot(x, shown, color=colour, linestyle=dashes, linewidth=width, label=f"{words}, {part}", zorder=3)


def _natural(
    ax: Axes, measure: Measure, across: Any, alpha: Array, values: Array, stable: Any, found: EquilibriumSet
) -> None:
    axis = measure.axis("curvature", "Natural curvature", float(np.abs(values).max()))
    unstable_dashes(ax, across(alpha), axis(values), stable, ROLES["natural"][0], "natural curvature")
    _marks(ax, across, [(p, axis(p.mu_nat)) for p in found.limiting], [(f, axis(f.mu_nat)) for f in found.folds])
    room(ax, axis(values))
    ax.set_ylabel(axis.label)


def _drive(
    ax: Axes, measure: Measure, across: Any, alpha: Array, values: Array, stable: Any, found: EquilibriumSet
) -> None:
    threshold = np.asarray(found.laws.threshold.value(np.asarray(ends(found.gamma, alpha).mu_nat)))
    reach = min(float(np.abs(values).max()), SHOWN * float(threshold.max()))
    reach = max(reach, 1.3 * float(threshold.max()))
    axis = measure.axis("drive", "Drive", reach)
    colour, dashes = ROLES["threshold"]
    for sign in (1.0, -1.0):
        ax.plot(
            across(alpha), axis(sign * threshold), color=colour, linestyle=dashes, linewidth=1.2, label="± threshold"
        )
    unstable_dashes(ax, across(alpha), axis(values), stable, ROLES["drive"][0], "drive")
    folds = [(f, axis(f.drive)) for f in found.folds if abs(f.drive) <= reach]
    _marks(ax, across, [(p, axis(p.drive)) for p in found.limiting], folds)
    ax.set_ylim(-1.08 * float(axis(reach)), 1.08 * float(axis(reach)))
    ax.set_ylabel(axis.label)


def kind_of(point: Any) -> str:
    """Return which of `MARKS` a limiting equilibrium is."""
    if point.kind == "tangency":
        return "tangency"
    return "a limit of motions" if point.attracting and point.unstable == 0 else "repelling, or a saddle"


def _marks(ax: Axes, across: Any, limiting: list[tuple[Any, Any]], folds: list[tuple[Any, Any]]) -> None:
    named = [(kind_of(point), point, y) for point, y in limiting] + [("fold", fold, y) for fold, y in folds]
    for words, (marker, face, edge) in MARKS.items():
        chosen = [(float(across(point.alpha)), float(y)) for name, point, y in named if name == words]
        if chosen:
            x, y = zip(*chosen, strict=True)
            ax.plot(
                x,
                y,
                marker,
                markerfacecolor=face,
                markeredgecolor=edge,
                markersize=6,
                label=words,
                zorder=6,
                clip_on=False,
            )


def _legend(figure: Figure, upper: Axes, lower: Axes) -> None:
    """One legend for both: ground, lines, marks."""
    from matplotlib.patches import Patch

    seen: dict[str, Any] = {}
    for ax in (upper, lower):
        for handle, words in zip(*ax.get_legend_handles_labels(), strict=True):
            seen.setdefault(words, handle)
    seen = {"admissible: |drive| ≤ threshold": Patch(facecolor=ADMISSIBLE), **seen}
    figure.legend(seen.values(), seen.keys(), loc="outside lower center", ncols=4, frameon=False, fontsize=8.5)
