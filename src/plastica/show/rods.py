"""Pictures of one shape of a rod at rest: an equilibrium, a static shape, and where a state ends."""

from __future__ import annotations

import textwrap
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from plastica.equilibria.elastica import profile
from plastica.equilibria.equilibrium import Equilibrium
from plastica.equilibria.limits import Limit
from plastica.equilibria.rest import Rest
from plastica.motion.dataset import natural_shape
from plastica.physics.model import Model
from plastica.show.arrows import Pull, arrows, reach, strongest
from plastica.show.measure import Measure
from plastica.show.panels import clamp
from plastica.show.style import INK, MUTED, OKABE_ITO, ROLES, drawing, new_figure, room

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = [
    "AtRest",
    "curvature_along",
    "equilibrium_figure",
    "limit_figure",
    "natural_arc",
    "natural_arcs",
    "rest_figure",
    "rods_panel",
]

Array = NDArray[np.float64]

WIDTH: Final = 9.2
PLACES: Final = np.linspace(0.0, 1.0, 201)
DECADES: Final = 4.0
"""How far a predicted tail is drawn, beyond the time in which it begins to bend down."""

KINDS_IN_WORDS: Final = {
    "interior": "It comes to rest; the natural curvature moves no more",
    "limiting": "It creeps to where the drive equals the threshold",
    "undecided": "Where it ends cannot be told yet",
}


@dataclass(frozen=True)
class AtRest:
    """A shape to draw: dimensionless centre line, with words, colour and dashes."""

    x: Array
    y: Array
    words: str
    colour: str
    dashes: Any = "-"
    width: float = 3.0


def natural_arc(mu_nat: float, words: str = "natural shape", dashes: Any = (0, (5, 2))) -> AtRest:
    """Return the natural configuration of a rod of one segment, an arc, as a shape to draw."""
    along = profile(0.0, mu_nat, PLACES)
    return AtRest(np.asarray(along.x), np.asarray(along.y), words, ROLES["natural"][0], dashes, 1.5)


def natural_arcs(model: Model, mu_nat: ArrayLike, words: str = "natural shape") -> AtRest:
    """Return the natural configuration of a model, an arc on each of its segments, as a shape to draw."""
    x, y = natural_shape(model, np.asarray(mu_nat, dtype=float)[None], PLACES)
    return AtRest(x[0], y[0], words, ROLES["natural"][0], (0, (5, 2)), 1.5)


def thrust(gamma: float) -> Pull:
    """Return a thrust as the loads to draw."""
    return Pull((-gamma, 0.0), 0.0, (0.0, 0.0))


def shape_of(equilibrium: Equilibrium, words: str = "rod") -> AtRest:
    """Return an equilibrium as a shape to draw."""
    x, y = equilibrium.centre_line(PLACES)
    return AtRest(x, y, words, ROLES["rod"][0])


def rods_panel(ax: Axes, measure: Measure, shapes: list[AtRest], pull: Pull) -> None:
    """Draw shapes on equal axes with the clamp, and the loads as arrows on the first one."""
    length = measure.axis("length", "Along the clamp's tangent")
    for shape in shapes:
        ax.plot(
            length(shape.x),
            length(shape.y),
            color=shape.colour,
            linestyle=shape.dashes,
            linewidth=shape.width,
            solid_capstyle="round",
            label=shape.words,
            zorder=4,
        )
    first, full = shapes[0], float(length(1.0))
    x, y = length(first.x), length(first.y)
    angle = float(np.arctan2(y[-1] - y[-2], x[-1] - x[-2]))
    drawn = arrows(x, y, angle, pull.over(strongest([pull])), full)
    for kind, arrow in drawn.items():
        width, size = (1.1, 6) if kind == "weight" else (1.5, 8)
        ax.plot(arrow.x, arrow.y, color=INK, linewidth=width, label=f"_{kind}", zorder=6)
        ax.plot(arrow.head_x, arrow.head_y, color=INK, marker=arrow.marker, markersize=size, linestyle="none", zorder=6)
    _limits(ax, length, shapes, reach(drawn))
    ax.set_xlabel(length.label)
    ax.set_ylabel(measure.axis("length", "Across").label)
    ax.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=3, frameon=False, fontsize=8.5, borderaxespad=0.2)


def _limits(ax: Axes, length: Any, shapes: list[AtRest], beyond: tuple[Array, Array]) -> None:
    """Equal axes around everything, never so flat that a straight rod lies on a hair line."""
    x, y = (length(np.concatenate([getattr(each, name) for each in shapes])) for name in ("x", "y"))
    x, y = np.concatenate([x, beyond[0]]), np.concatenate([y, beyond[1]])
    full = float(length(1.0))
    low, high = min(float(y.min()), 0.0), max(float(y.max()), 0.0)
    short = max(0.4 * full - (high - low), 0.0)
    low, high = low - 0.5 * short - 0.05 * full, high + 0.5 * short + 0.05 * full
    left, right = min(float(x.min()), 0.0) - 0.08 * full, max(float(x.max()), 0.4 * full) + 0.03 * full
    ax.set_aspect("equal", adjustable="box")
    ax.set_xlim(left, right)
    ax.set_ylim(low, high)
    clamp(ax, high - low, right - left)


def curvature_along(ax: Axes, measure: Measure, curvature: Array, mu_nat: ArrayLike, ends: ArrayLike = (0, 1)) -> None:
    """Draw the curvature from the clamp to the free end, and the natural curvature, a step for each segment.

    Parameters
    ----------
    ax : Axes
        Where.
    measure : Measure
        The units.
    curvature : ndarray
        Dimensionless curvature at `PLACES`.
    mu_nat : float, or array_like of shape (m,)
        Dimensionless natural curvature, by segment.
    ends : array_like, shape (m + 1,)
        Ends of the segments.
    """
    natural = np.atleast_1d(np.asarray(mu_nat, dtype=float))
    across = measure.axis("length", "Arc length from the clamp")
    size = max(float(np.abs(curvature).max()), float(np.abs(natural).max()))
    axis = measure.axis("curvature", "Curvature", size)
    colour, dashes = ROLES["natural"]
    places = np.repeat(np.asarray(ends, dtype=float), 2)[1:-1]
    steps = np.repeat(natural, 2)
    ax.plot(across(places), axis(steps), color=colour, linestyle=dashes, label="natural curvature")
    ax.plot(across(PLACES), axis(curvature), color=ROLES["rod"][0], label="curvature", zorder=3)
    ax.plot(across([0.0, 1.0]), axis(curvature[[0, -1]]), "o", color=ROLES["rod"][0], markersize=5, label="_ends")
    ax.axhline(0.0, color=MUTED, linewidth=0.8, zorder=1.2, label="_zero")
    ax.set_xlim(0.0, float(across(1.0)))
    room(ax, axis(curvature), axis(natural), [0.0], at_least=float(axis(1e-9)))
    ax.set_xlabel(across.label)
    ax.set_ylabel(axis.label)
    ax.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=2, frameon=False, fontsize=8.5, borderaxespad=0.2)


def two_panels(title: str) -> tuple[Figure, Axes, Axes]:
    """Return a figure with two axes side by side and a title."""
    figure = new_figure(WIDTH, 3.7)
    left, right = figure.subplots(1, 2, width_ratios=[1.15, 1.0])
    figure.suptitle(textwrap.fill(title, 100), x=0.01, ha="left", fontsize=11, fontweight="bold")
    return figure, left, right


def equilibrium_figure(found: Equilibrium) -> Figure:
    """Draw an equilibrium: the rod with its natural shape, and its curvature from the clamp to the free end.

    Parameters
    ----------
    found : Equilibrium
        Of a material, or at frozen natural curvature.

    Returns
    -------
    Figure
        The free end has the natural curvature: there is no couple there.
    """
    measure = Measure(found.specimen)
    with drawing():
        figure, left, right = two_panels(_equilibrium_title(found, measure))
        rods_panel(left, measure, [shape_of(found), natural_arc(found.mu_nat)], thrust(found.gamma))
        curvature_along(right, measure, np.asarray(found.curvature(PLACES)), found.mu_nat)
    return figure


def _equilibrium_title(found: Equilibrium, measure: Measure) -> str:
    head = f"Equilibrium under {measure.write(found.gamma, 'force')}: {found.regime}"
    if found.drive is None or found.threshold is None:
        return f"{head}, natural curvature {measure.write(found.mu_nat, 'curvature')}"
    relation, verdict = ("≤", "it stays") if found.admissible else (">", "its natural curvature moves")
    drive, threshold = (measure.write(value, "drive") for value in (abs(found.drive), found.threshold))
    return f"{head}; |drive| {drive} {relation} threshold {threshold}: {verdict}"


def rest_figure(found: Rest) -> Figure:
    """Draw a static shape at frozen natural curvature, as `equilibrium_figure` draws an equilibrium.

    Parameters
    ----------
    found : Rest
        What `plastica.rest` returned.

    Returns
    -------
    Figure
        The title says whether it is stable.
    """
    measure, model = Measure(found.model.specimen), found.model
    held = "" if not found.converged else _STAYS if found.admissible else _MOVES
    theta = model.angle(found.mu)
    along = model.grid.integration(PLACES)
    rod = AtRest(along @ np.cos(theta), along @ np.sin(theta), "rod", ROLES["rod"][0])
    curvature = np.asarray(found.at(PLACES * model.scales.length)) / model.scales.curvature
    with drawing():
        figure, left, right = two_panels(f"{found.sentence}{held}")
        rods_panel(left, measure, [rod, natural_arcs(model, found.mu_nat)], Pull.at(model, 0.0))
        curvature_along(right, measure, curvature, found.mu_nat, model.division.breaks)
    return figure


_STAYS: Final = " No longer held it stays: the drive is within its threshold."
_MOVES: Final = " No longer held it moves: a drive exceeds its threshold."


def limit_figure(limit: Limit) -> Figure:
    """Draw where a state ends, and how it gets there by the law of approach.

    Parameters
    ----------
    limit : Limit
        What `plastica.predict_limit` or `plastica.omega_limit` returned, or `Solution.limit`.

    Returns
    -------
    Figure
        The equilibrium, and the predicted tail from the state on; for "undecided" the words alone.
    """
    head = KINDS_IN_WORDS[limit.kind]
    with drawing():
        if limit.equilibrium is None:
            figure = new_figure(WIDTH, 1.3)
            figure.text(0.01, 0.75, head, fontsize=11, fontweight="bold", va="center")
            why = limit.sentence.partition(": ")[2] or limit.sentence
            figure.text(0.01, 0.32, textwrap.fill(why[0].upper() + why[1:], 110), fontsize=9.5, va="center")
            return figure
        found = limit.equilibrium
        measure = Measure(found.specimen)
        standing = "stable" if limit.stable else "not stable: a disturbance may throw it off"
        figure, left, right = two_panels(f"{head} ({standing})")
        rods_panel(left, measure, [shape_of(found, "rod in the end"), natural_arc(found.mu_nat)], thrust(found.gamma))
        tail_panel(right, measure, limit)
    return figure


def tail_panel(ax: Axes, measure: Measure, limit: Limit) -> None:
    """Draw the predicted approach, from the state that it was predicted from."""
    span = tail_time(limit)
    if span is None:
        words = "no law of approach: nothing is left to go" if limit.distance == 0.0 else "no law of approach here"
        ax.text(0.5, 0.5, words, transform=ax.transAxes, ha="center", color=MUTED)
        ax.set_axis_off()
        return
    colour = OKABE_ITO["vermillion"]
    if limit.kind == "limiting":
        t = span * np.logspace(-2.0, DECADES, 241)
        size = limit.excess or 0.0
        axis, values = measure.axis("drive", "|Drive| − threshold", size), limit.tail(t)
        ax.set_xscale("log")
    else:
        t = span * np.linspace(0.0, 14.0, 241)
        axis = measure.axis("curvature", "Distance from the end", limit.distance or 0.0)
        values = (limit.distance or 0.0) * np.exp(-t / span)
    time = measure.axis("time", "Time from now", float(t[-1]))
    ax.plot(time(t), axis(values), color=colour, linestyle=(0, (5, 2)), label="predicted")
    ax.set_yscale("log")
    ax.set_xlabel(time.label)
    ax.set_ylabel(axis.label)
    ax.set_title("The predicted way there")


def tail_time(limit: Limit) -> float | None:
    """Return the time (dimensionless) in which what is left falls by a fixed part now; None where there is no law.

    Limiting: x / |dx/dt| = x^(1-p) / (r c), by (p - 1) where p > 1, which is also how long ago the law would have
    begun at infinity. Interior: one over the gap.
    """
    if limit.kind == "limiting" and limit.rate and limit.coefficient and limit.exponent and limit.excess:
        slope, over = limit.rate * limit.coefficient, limit.exponent - 1.0
        span = 1.0 / slope if abs(over) < 1e-9 else limit.excess ** (-over) / (over * slope)
        return span if np.isfinite(span) and span > 0.0 else None
    if limit.kind == "interior" and limit.rate and limit.rate > 0.0 and limit.distance:
        return 1.0 / limit.rate
    return None
