"""Histories of loading as curves: loads over their displacements, couple over curvature, with their loops."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

import numpy as np

from plastica.motion.histories import CONJUGATE, KINDS_OF, force_displacement, moment_curvature
from plastica.show.axes import DIMENSIONLESS, Quantity, axis_unit
from plastica.show.panels import mark_ends
from plastica.show.style import MUTED, OKABE_ITO, drawing, new_figure, room

if TYPE_CHECKING:
    import xarray
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from numpy.typing import NDArray

    from plastica.show.view import View

    Array = NDArray[np.float64]

__all__ = ["HISTORIES", "force_figure", "history_figure", "history_of", "is_history", "moment_figure"]

WIDTH: Final = 6.6
HEADS: Final = 4
"""Arrow heads on a curve."""

LOOKS: Final = (
    (OKABE_ITO["blue"], "-"),
    (OKABE_ITO["vermillion"], (0, (6, 2))),
    (OKABE_ITO["green"], (0, (2, 1.4))),
    (OKABE_ITO["purple"], (0, (6, 1.5, 1, 1.5))),
)

WORDS: Final = {
    "thrust": "Thrust",
    "transverse": "Transverse force",
    "end_couple": "End couple",
    "total_weight": "Weight",
    "shortening": "Free end toward the clamp",
    "deflection": "Free end across",
    "rotation": "Rotation of the free end",
    "sinking": "Mean way along the weight",
    "curvature": "Curvature",
    "couple": "Contact couple",
}

HISTORIES: Final = ("force_displacement", "moment_curvature")


def is_history(result: object) -> bool:
    """Tell whether a result is the dataset of a history of loading."""
    return getattr(result, "attrs", {}).get("result") in HISTORIES


def history_of(seen: View, name: str) -> xarray.Dataset:
    """Return a history of a motion at the times that are drawn."""
    make: Any = {"force_displacement": force_displacement, "moment_curvature": moment_curvature}[name]
    return make(seen.sampled)  # type: ignore[no-any-return]


def history_figure(found: xarray.Dataset) -> Figure:
    """Draw a history of loading, by what it is.

    Parameters
    ----------
    found : Dataset
        What `plastica.force_displacement` or `plastica.moment_curvature` returned.

    Returns
    -------
    Figure
        With a ring at the start and a disc at the end of each curve, and heads in the direction of time.
    """
    return force_figure(found) if found.attrs["result"] == "force_displacement" else moment_figure(found)


def force_figure(found: xarray.Dataset) -> Figure:
    """Draw every load that acts over the displacement on which it does work.

    Parameters
    ----------
    found : Dataset
        What `plastica.force_displacement` returned.

    Returns
    -------
    Figure
        One panel for each load that changes, or where none does for each load. The area under a curve is work, that
        within a closed loop what was lost in it.
    """
    acting = [name for name in CONJUGATE if name in found]
    # A load that stays as it is draws a line without a loop: it is left out where others change.
    acting = [name for name in acting if np.ptp(found[name].values) > 0.0] or acting
    with drawing():
        figure = new_figure(WIDTH, 0.6 + 2.5 * max(len(acting), 1))
        if not acting:
            _nothing(figure.subplots(), "No load acts.")
            return figure
        for ax, name in zip(np.atleast_1d(figure.subplots(len(acting), 1)), acting, strict=True):
            across, up = _quantity(found, CONJUGATE[name]), _quantity(found, name)
            x, y = across(found[CONJUGATE[name]].values), up(found[name].values)
            _curve(ax, x, y, LOOKS[0], name)
            room(ax, y, [0.0])
            _breadth(ax, x, float(across(_least(found, CONJUGATE[name]))))
            ax.set_xlabel(across.label)
            ax.set_ylabel(up.label)
    return figure


def moment_figure(found: xarray.Dataset) -> Figure:
    """Draw the contact couple over the curvature at each place.

    Parameters
    ----------
    found : Dataset
        What `plastica.moment_curvature` returned.

    Returns
    -------
    Figure
        One curve for each of up to four places, the first, the last and two between them where there are more.
    """
    count = found.sizes["s"]
    chosen = np.unique(np.linspace(0, count - 1, min(count, len(LOOKS))).round().astype(int))
    with drawing():
        figure = new_figure(WIDTH, 3.9)
        ax = figure.subplots()
        across, up = _quantity(found, "curvature"), _quantity(found, "couple")
        for look, j in zip(LOOKS, chosen, strict=False):
            x, y = (axis(found[name].values[:, j]) for axis, name in ((across, "curvature"), (up, "couple")))
            _curve(ax, x, y, look, _place(found, int(j)))
        room(ax, up(found["couple"].values[:, chosen]), [0.0])
        _breadth(ax, across(found["curvature"].values[:, chosen]), 0.0)
        ax.set_xlabel(across.label)
        ax.set_ylabel(up.label)
        ax.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=4, frameon=False, fontsize=8.5, borderaxespad=0.2)
    return figure


def _place(found: xarray.Dataset, j: int) -> str:
    s = float(found["s"].values[j])
    if s == 0.0:
        return "at the clamp"
    if found["s"].attrs["units"] == "1":
        return f"at s = {s:.3g} L"
    factor, name = axis_unit("m", s)
    return f"at s = {s / factor:.4g} {name}"


def _quantity(found: xarray.Dataset, name: str) -> Quantity:
    """The axis of a variable, with a unit that suits its largest value."""
    values, unit, kind = found[name].values, str(found[name].attrs["units"]), KINDS_OF[name][0]
    if unit == "1":
        return Quantity(1.0, DIMENSIONLESS[kind], f"{WORDS[name]} {DIMENSIONLESS[kind]}".strip())
    factor, written = axis_unit(unit, float(np.abs(values).max()))
    return Quantity(factor, written, f"{WORDS[name]} ({written})")


def _least(found: xarray.Dataset, name: str) -> float:
    """A displacement that counts as none: a thousandth of the largest."""
    return 1e-3 * float(np.abs(found[name].values).max())


def _curve(ax: Axes, x: Array, y: Array, look: tuple[str, Any], words: str) -> None:
    colour, dashes = look
    ax.axhline(0.0, color=MUTED, linewidth=0.8, zorder=1.2, label="_zero")
    ax.plot(x, y, color=colour, linestyle=dashes, linewidth=1.4, label=words, zorder=3)
    mark_ends(ax, x, y, colour)
    for at in _heads(x, y):
        ax.annotate(
            "",
            (x[at + 1], y[at + 1]),
            (x[at], y[at]),
            arrowprops={"arrowstyle": "-|>", "color": colour, "linewidth": 1.0, "mutation_scale": 11},
            zorder=4,
        )


def _heads(x: Array, y: Array) -> list[int]:
    """Rows after which an arrow head is drawn: equally far from one another along the curve as it is seen."""
    if x.size < 3:
        return []
    wide, high = (float(np.ptp(each)) or 1.0 for each in (x, y))
    steps = np.hypot(np.diff(x) / wide, np.diff(y) / high)
    along = np.concatenate([[0.0], np.cumsum(steps)])
    if along[-1] < 0.5:
        return []
    wanted = (np.arange(HEADS) + 0.5) / HEADS * along[-1]
    rows = np.clip(np.searchsorted(along, wanted) - 1, 0, x.size - 2)
    return [int(row) for row in np.unique(rows) if steps[row] > 1e-4]


def _breadth(ax: Axes, x: Array, least: float) -> None:
    """Horizontal limits with a margin, so that rounding noise is not blown up."""
    low, high = float(x.min()), float(x.max())
    half = max(0.5 * (high - low), least, 1e-12 * max(abs(low), abs(high), 1e-3))
    middle = 0.5 * (low + high)
    ax.set_xlim(middle - 1.08 * half, middle + 1.08 * half)


def _nothing(ax: Axes, words: str) -> None:
    ax.text(0.5, 0.5, words, transform=ax.transAxes, ha="center", color=MUTED)
    ax.set_axis_off()
