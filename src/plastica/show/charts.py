"""Pictures of charts: the capacity of a strut, its phase diagram, and the basins of its limits."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

import numpy as np
from matplotlib.colors import BoundaryNorm, ListedColormap
from matplotlib.patches import Patch
from numpy.typing import NDArray

from plastica.charts.basin import NO_INTERVAL, Basin
from plastica.charts.phase import PhaseDiagram
from plastica.motion.solution import Solution
from plastica.show.admissible import ADMISSIBLE
from plastica.show.axes import Quantity, axis_unit
from plastica.show.measure import Measure
from plastica.show.rods import WIDTH
from plastica.show.style import INK, MUTED, OKABE_ITO, ROLES, drawing, new_figure

if TYPE_CHECKING:
    import xarray
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = ["basin_figure", "capacity_figure", "is_capacity", "phase_figure"]

Array = NDArray[np.float64]

LEAVES: Final = "#f6ddd0"
"""Ground of imperfections that creep away."""

CRITICAL: Final = (
    ("gamma_star", "γ*", "yielding grows beyond", (0, (1, 1.5))),
    ("gamma_star_star", "γ**", "a gap opens beyond", (0, (4, 1.5))),
    ("euler", "Euler", "the straight rod buckles beyond", "-"),
)
"""Attribute of a capacity chart -> sign, words and dashes of its line."""

GROUNDS: Final = {
    "admissible, stable": ADMISSIBLE,
    "admissible, unstable": "#d8dfc0",
    "moves on, stable": "#ffffff",
    "moves on, unstable": "#eceef1",
}


def is_capacity(result: object) -> bool:
    """Tell whether a result is the dataset of a capacity chart."""
    attributes, variables = getattr(result, "attrs", {}), getattr(result, "data_vars", {})
    return "euler" in attributes and {"largest", "leaves"} <= set(variables)


def capacity_figure(found: xarray.Dataset) -> Figure:
    """Draw the capacity chart: the largest imperfection that is borne for ever, over the thrust.

    Parameters
    ----------
    found : Dataset
        What `plastica.capacity` returned.

    Returns
    -------
    Figure
        Below the line (green) the rod ends in the interval of the straight rod; above it (red) it creeps away. Upright,
        the critical thrusts. In SI where there was a specimen.
    """
    gamma, largest = (np.asarray(found[name].values, dtype=float) for name in ("gamma", "largest"))
    si = "thrust" in found.coords
    scale = float(found["thrust"].values[-1] / gamma[-1]) if si and gamma[-1] > 0.0 else 1.0
    bent = _per_length(found) if si else 1.0
    finite = largest[np.isfinite(largest)]
    top = 1.15 * float(finite.max()) if finite.size and finite.max() > 0.0 else 1.0
    across = _axis("N" if si else "", "Thrust", scale, float(gamma[-1]), "× L²/EI")
    axis = _axis("1/m" if si else "", "Imperfection: curvature", bent, top, "× L")
    with drawing():
        figure = new_figure(WIDTH, 4.6)
        ax = figure.subplots()
        _grounds(ax, across, axis, gamma, np.where(np.isfinite(largest), largest, 4.0 * top), found)
        shown = np.isfinite(largest)
        ax.plot(
            across(gamma[shown]), axis(largest[shown]), "o-", color=INK, markersize=4, label="largest borne", zorder=4
        )
        ax.set_xlim(float(across(gamma[0])), float(across(gamma[-1])))
        ax.set_ylim(0.0, float(axis(top)))
        _critical(ax, found, across)
        ax.set_xlabel(across.label)
        ax.set_ylabel(axis.label)
        handles = [
            Patch(facecolor=ADMISSIBLE, label="ends in the interval of the straight rod"),
            Patch(facecolor=LEAVES, label="creeps away to another, sooner or later"),
        ]
        figure.legend(handles=handles, loc="outside lower center", ncols=2, frameon=False, fontsize=8.5)
        shape = str(found.attrs.get("imperfection", "natural"))
        words = "a natural bow" if shape == "natural" else f"bent into {shape}"
        figure.suptitle(f"What the strut bears for ever: {words}", x=0.01, ha="left", fontsize=11, fontweight="bold")
    return figure


def _per_length(found: xarray.Dataset) -> float:
    """1/L, from a pair of the same values with and without dimension."""
    plain, scaled = (np.asarray(found[name].values, dtype=float) for name in ("edge", "edge_curvature"))
    known = np.isfinite(plain) & (plain != 0.0)
    return float((scaled[known] / plain[known])[0]) if known.any() else 1.0


def _axis(unit: str, words: str, scale: float, largest: float, dimensionless: str) -> Quantity:
    if not unit:
        return Quantity(1.0, dimensionless, f"{words} {dimensionless}")
    factor, name = axis_unit(unit, largest * scale)
    return Quantity(factor / scale, name, f"{words} ({name})")


def _grounds(ax: Axes, across: Quantity, axis: Quantity, gamma: Array, borne: Array, found: xarray.Dataset) -> None:
    """Shade what is borne and what is not; nothing between the opening of a gap and the next thrust computed."""
    high = float(borne.max()) + 1.0
    opens = found.attrs.get("gamma_star_star")
    free = np.isinf(np.asarray(found["largest"].values, dtype=float))
    parts = [(gamma[free], borne[free]), (gamma[~free], borne[~free])]
    if opens is not None and free.any() and gamma[free][-1] < float(opens) <= gamma[-1]:
        parts[0] = (np.append(gamma[free], float(opens)), np.append(borne[free], borne[free][-1]))
    for x, y in parts:
        ax.fill_between(across(x), 0.0, axis(y), facecolor=ADMISSIBLE, linewidth=0.0, zorder=0.6, label="_stays")
        ax.fill_between(across(x), axis(y), high, facecolor=LEAVES, linewidth=0.0, zorder=0.5, label="_leaves")


def _critical(ax: Axes, found: xarray.Dataset, across: Quantity) -> None:
    low, high = ax.get_xlim()
    for name, sign, words, dashes in CRITICAL:
        gamma = found.attrs.get(name)
        if gamma is None or not np.isfinite(float(gamma)) or not low <= float(across(gamma)) <= high:
            continue
        x = float(across(gamma))
        ax.axvline(x, color=OKABE_ITO["blue"], linestyle=dashes, linewidth=1.3, zorder=3, label=f"{sign}: {words}")
        ax.annotate(
            f"{sign}: {words}",
            (x, 0.97),
            (-3, 0),
            xycoords=("data", "axes fraction"),
            textcoords="offset points",
            rotation=90,
            ha="right",
            va="top",
            fontsize=8.5,
            color=OKABE_ITO["blue"],
        )


def phase_figure(found: PhaseDiagram, path: Solution | None = None) -> Figure:
    """Draw a phase diagram: equilibria over thrust and clamp curvature, and over thrust and natural curvature.

    Parameters
    ----------
    found : PhaseDiagram
        What `plastica.phase_diagram` returned.
    path : Solution, optional
        A run of the same rod, whose path is drawn in.

    Returns
    -------
    Figure
        Left, the ground tells what is admissible and what is stable; in both planes the curves |D| = Theta (thick
        where motions can end), folds, tangencies (squares) and cusps (diamonds).
    """
    measure = Measure(found.specimen)
    across = measure.axis("force", "Thrust", float(found.gamma[-1]))
    clamp = measure.axis("curvature", "Curvature at the clamp", float(np.abs(found.alpha).max()))
    largest = max((float(np.abs(c.mu_nat).max()) for c in found.components), default=1.0)
    natural = measure.axis("curvature", "Natural curvature", largest)
    with drawing():
        figure = new_figure(11.0, 5.2)
        left, right = figure.subplots(1, 2)
        _regions(left, found, across, clamp)
        for ax, name, axis in ((left, "alpha", clamp), (right, "mu_nat", natural)):
            _curves(ax, found, across, axis, name)
            if path is not None:
                _path(ax, found, path, across, axis, name)
            ax.set_xlim(float(across(found.gamma[0])), float(across(found.gamma[-1])))
            ax.set_xlabel(across.label)
            ax.set_ylabel(axis.label)
        left.set_ylim(float(clamp(found.alpha[0])), float(clamp(found.alpha[-1])))
        room = 1.05 * float(natural(largest))
        right.set_ylim(-room, room)
        left.set_title("By clamp curvature")
        right.set_title("By natural curvature")
        _phase_legend(figure, left)
        count = len(found.components)
        figure.suptitle(
            f"Phase diagram: |drive| = threshold on {count} component{'s' if count != 1 else ''}",
            x=0.01,
            ha="left",
            fontsize=11,
            fontweight="bold",
        )
    return figure


def _regions(ax: Axes, found: PhaseDiagram, across: Quantity, clamp: Quantity) -> None:
    kind = np.where(found.admissible, 0, 2) + (found.unstable != 0)
    colours = ListedColormap(list(GROUNDS.values()))
    ax.pcolormesh(
        across(found.gamma),
        clamp(found.alpha),
        kind.T,
        cmap=colours,
        norm=BoundaryNorm(np.arange(5) - 0.5, 4),
        shading="nearest",
        rasterized=True,
        zorder=0.4,
    )
    ax.grid(visible=False)


def _curves(ax: Axes, found: PhaseDiagram, across: Quantity, axis: Quantity, name: str) -> None:
    for component in found.components:
        closed = component.kind == "closed"
        x, y = (_closed(getattr(component, each), closed) for each in ("gamma", name))
        ends_motions = _closed(component.attracting, closed)
        ax.plot(
            across(x), axis(y), color=INK, linewidth=1.0, linestyle=(0, (4, 2)), zorder=3, label="|D| = Θ, repelling"
        )
        wide = ends_motions | np.append(False, ends_motions[:-1])
        shown = np.where(wide, axis(y), np.nan)
        ax.plot(across(x), shown, color=INK, linewidth=2.2, zorder=3.2, label="|D| = Θ, motions end here")
    for line in found.folds:
        x, y = (_closed(getattr(line, each), line.closed) for each in ("gamma", name))
        ax.plot(
            across(x),
            axis(y),
            color=OKABE_ITO["purple"],
            linewidth=1.6,
            linestyle=(0, (1, 1.2)),
            zorder=2.8,
            label="folds",
        )
    marks = ((found.tangencies, "s", OKABE_ITO["orange"], "tangency"), (found.cusps, "D", OKABE_ITO["purple"], "cusp"))
    for places, marker, colour, words in marks:
        if places:
            x, y = [p.gamma for p in places], [getattr(p, name) for p in places]
            ax.plot(
                across(x), axis(y), marker, color=colour, markeredgecolor=INK, markersize=5.5, label=words, zorder=5
            )


def _closed(values: Any, closed: bool) -> Any:
    return np.append(values, values[:1]) if closed else np.asarray(values)


def _path(ax: Axes, found: PhaseDiagram, path: Solution, across: Quantity, axis: Quantity, name: str) -> None:
    way = found.path(path)
    scale = Measure(found.specimen).scales.curvature
    values = way["alpha"].values if name == "alpha" else way["natural_curvature"].values / scale
    x, y = across(way["gamma"].values), axis(values)
    colour = ROLES["natural"][0]
    ax.plot(x, y, color=colour, linewidth=1.8, zorder=6, label="path of the run")
    ax.plot(
        x[:1], y[:1], "o", markerfacecolor="white", markeredgecolor=colour, markersize=6, zorder=7, label="its start"
    )
    ax.plot(x[-1:], y[-1:], "o", color=colour, markersize=6, zorder=7, label="its end")


def _phase_legend(figure: Figure, ax: Axes) -> None:
    seen: dict[str, Any] = {
        words: Patch(facecolor=colour, edgecolor="#c5cbd1", linewidth=0.6) for words, colour in GROUNDS.items()
    }
    for handle, words in zip(*ax.get_legend_handles_labels(), strict=True):
        seen.setdefault(words, handle)
    figure.legend(seen.values(), seen.keys(), loc="outside lower center", ncols=5, frameon=False, fontsize=8.5)


def basin_figure(found: Basin) -> Figure:
    """Draw which limit each start reaches.

    Parameters
    ----------
    found : Basin
        What `plastica.basin` returned.

    Returns
    -------
    Figure
        Over amplitude and natural curvature of the start, coloured by the interval of the admissible set that the
        limit lies in; of one row of starts, the clamp curvature of the limit.
    """
    measure = Measure(found.strut.specimen)
    amplitude = measure.axis("curvature", f"Amplitude of {found.shape}", float(np.abs(found.amplitude).max()))
    natural = measure.axis("curvature", "Natural curvature", float(np.abs(found.natural_curvature).max()))
    with drawing():
        figure = new_figure(WIDTH, 4.6)
        ax = figure.subplots()
        if min(found.alpha.shape) > 1:
            _basin_map(figure, ax, found, amplitude, natural)
        else:
            _basin_row(ax, measure, found, amplitude, natural)
        figure.suptitle(
            f"Where {found.alpha.size} starts end under {measure.write(found.equilibria.gamma, 'force')}",
            x=0.01,
            ha="left",
            fontsize=11,
            fontweight="bold",
        )
    return figure


def _basin_looks(found: Basin) -> dict[int, tuple[str, str]]:
    """Interval -> words and colour."""
    above, below = ("#f2b28d", "#d9773f", "#a84a12"), ("#a6cbe8", "#5c9ecb", "#1f6699")
    looks = {}
    for number in sorted(int(each) for each in np.unique(found.interval)):
        if number == NO_INTERVAL:
            looks[number] = ("cannot be told", "#c9ced4")
        elif number == 0:
            looks[number] = ("near straight", ADMISSIBLE)
        else:
            side, words = (above, "bent up") if number > 0 else (below, "bent down")
            place = min(abs(number), 3) - 1
            looks[number] = (f"{words}, interval {number:+d}", side[place])
    return looks


def _basin_map(figure: Figure, ax: Axes, found: Basin, amplitude: Quantity, natural: Quantity) -> None:
    looks = _basin_looks(found)
    order = list(looks)
    kind = np.searchsorted(order, found.interval)
    ax.pcolormesh(
        natural(found.natural_curvature),
        amplitude(found.amplitude),
        kind,
        cmap=ListedColormap([colour for _, colour in looks.values()]),
        norm=BoundaryNorm(np.arange(len(order) + 1) - 0.5, len(order)),
        shading="nearest",
        rasterized=True,
    )
    ax.grid(visible=False)
    ax.set_xlabel(natural.label)
    ax.set_ylabel(amplitude.label)
    handles = [Patch(facecolor=colour, edgecolor="#c5cbd1", label=words) for words, colour in looks.values()]
    figure.legend(handles=handles, loc="outside lower center", ncols=4, frameon=False, fontsize=8.5)


def _basin_row(ax: Axes, measure: Measure, found: Basin, amplitude: Quantity, natural: Quantity) -> None:
    along = found.amplitude.size > 1
    starts = amplitude(found.amplitude) if along else natural(found.natural_curvature)
    alpha = found.alpha.ravel()
    size = float(np.abs(alpha[np.isfinite(alpha)]).max()) if np.isfinite(alpha).any() else 1.0
    axis = measure.axis("curvature", "Clamp curvature in the end", size)
    for low, high in found.equilibria.intervals:
        ax.axhspan(float(axis(low)), float(axis(high)), facecolor=ADMISSIBLE, zorder=0.5, label="_admissible")
    for number, (words, colour) in _basin_looks(found).items():
        chosen = found.interval.ravel() == number
        if number != NO_INTERVAL:
            ax.plot(
                np.ravel(starts)[chosen],
                axis(alpha[chosen]),
                "o",
                color=colour,
                markeredgecolor=INK,
                label=words,
                zorder=4,
            )
    ax.axhline(0.0, color=MUTED, linewidth=0.8, zorder=1.2, label="_zero")
    ax.set_xlabel(amplitude.label if along else natural.label)
    ax.set_ylabel(axis.label)
    ax.legend(loc="best", fontsize=8.5)
