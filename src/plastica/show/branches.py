"""Pictures of branches: equilibria of one natural curvature over the thrust, and the curve of their folds."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from plastica.equilibria.branches import Branch, FoldCurve
from plastica.show.measure import Measure
from plastica.show.rods import WIDTH
from plastica.show.style import MUTED, OKABE_ITO, drawing, new_figure, room
from plastica.show.words import number

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = ["branches_figure", "folds_figure"]

LOOKS: Final = {
    0: ("stable", OKABE_ITO["blue"], "-", 2.2),
    1: ("1 unstable direction", OKABE_ITO["vermillion"], (0, (5, 2)), 1.6),
    2: ("2 unstable directions", OKABE_ITO["green"], (0, (2, 1.4)), 1.6),
    3: ("3 or more", OKABE_ITO["purple"], (0, (1, 1.5)), 1.6),
}
"""Number of unstable directions -> words, colour, dashes, width."""

UNTOLD: Final = ("cannot be told", MUTED, "-", 1.0)


def branches_figure(found: Sequence[Branch]) -> Figure:
    """Draw the branches of equilibria with one natural curvature: clamp curvature over thrust.

    Parameters
    ----------
    found : sequence of Branch
        What `plastica.branches` returned.

    Returns
    -------
    Figure
        Solid blue where stable, broken where not, by the number of unstable directions; folds as diamonds,
        pitchforks as squares. All is dimensionless: the natural curvature is frozen, and no material asked.
    """
    measure = Measure(None)
    with drawing():
        figure = new_figure(WIDTH, 4.6)
        ax = figure.subplots()
        for branch in found:
            _branch(ax, branch)
        for attribute, marker, colour, words in (
            ("folds", "D", OKABE_ITO["purple"], "fold"),
            ("pitchforks", "s", OKABE_ITO["orange"], "pitchfork"),
        ):
            points = [(b.gamma[i], b.alpha[i]) for b in found for i in getattr(b, attribute)]
            if points:
                x, y = np.array(points).T
                ax.plot(x, y, marker, color=colour, markeredgecolor="black", markersize=6, label=words, zorder=6)
        ax.set_xlabel(measure.axis("force", "Thrust").label)
        ax.set_ylabel(measure.axis("curvature", "Curvature at the clamp").label)
        if found:
            ax.set_xlim(min(float(b.gamma.min()) for b in found), max(float(b.gamma.max()) for b in found))
            room(ax, *(b.alpha for b in found))
        _legend(ax)
        count = f"{len(found)} branch{'es' if len(found) != 1 else ''}"
        natural = number(found[0].natural_curvature) if found else "–"
        figure.suptitle(
            f"Equilibria with natural curvature {natural}/L, held: {count}",
            x=0.01,
            ha="left",
            fontsize=11,
            fontweight="bold",
        )
    return figure


def _branch(ax: Axes, branch: Branch) -> None:
    for gamma, alpha, count in branch.pieces:
        words, colour, dashes, width = LOOKS[min(count, 3)] if count >= 0 else UNTOLD
        ax.plot(gamma, alpha, color=colour, linestyle=dashes, linewidth=width, label=words, zorder=3)


def _legend(ax: Axes) -> None:
    """Every kind of line and mark once, in the order of `LOOKS`."""
    seen: dict[str, Any] = {}
    for handle, words in zip(*ax.get_legend_handles_labels(), strict=True):
        seen.setdefault(words, handle)
    order = [look[0] for look in LOOKS.values()]
    names = sorted(seen, key=lambda words: order.index(words) if words in order else len(order))
    place: dict[str, Any] = {"loc": "lower left", "bbox_to_anchor": (0.0, 1.0), "ncols": 5, "borderaxespad": 0.2}
    ax.legend([seen[name] for name in names], names, frameon=False, fontsize=8.5, **place)


def folds_figure(found: Sequence[FoldCurve]) -> Figure:
    """Draw where equilibria fold: natural curvature over thrust, with the cusps.

    Parameters
    ----------
    found : sequence of FoldCurve
        What `plastica.fold_curve` returned.

    Returns
    -------
    Figure
        Between the two lines that leave a cusp a rod with frozen natural curvature has two shapes more.
    """
    measure = Measure(None)
    with drawing():
        figure = new_figure(WIDTH, 4.4)
        ax = figure.subplots()
        for curve in found:
            ax.plot(curve.gamma, curve.natural_curvature, color=OKABE_ITO["purple"], label="folds", zorder=3)
            for i in curve.cusps:
                x, y = float(curve.gamma[i]), float(curve.natural_curvature[i])
                ax.plot([x], [y], "D", color=OKABE_ITO["orange"], markeredgecolor="black", markersize=6, label="cusp")
                ax.annotate(f"cusp at {x:.4g}", (x, y), (-4, 9), textcoords="offset points", fontsize=8.5)
        ax.axhline(0.0, color=MUTED, linewidth=0.8, zorder=1.2, label="_zero")
        room(ax, *(curve.natural_curvature for curve in found))
        ax.set_xlabel(measure.axis("force", "Thrust").label)
        ax.set_ylabel(measure.axis("curvature", "Natural curvature").label)
        figure.suptitle("Folds of the equilibria", x=0.01, ha="left", fontsize=11, fontweight="bold")
    return figure
