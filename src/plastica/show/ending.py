"""Where a motion ends, in pictures: the rod now and in the end, and the predicted tail beside the computed one."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np
from numpy.typing import NDArray

from plastica.equilibria.limits import Limit
from plastica.motion.solution import Solution
from plastica.show.arrows import Pull
from plastica.show.measure import Measure
from plastica.show.rods import AtRest, natural_arc, natural_arcs, rods_panel, shape_of, tail_time
from plastica.show.style import INK, MUTED, OKABE_ITO, ROLES, drawing, new_figure
from plastica.show.view import View, view

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = ["Tail", "ending", "tail_of"]

Array = NDArray[np.float64]

WIDTH: Final = 6.6
LATER: Final = 30.0
"""How many times longer than the run the prediction is drawn."""

PREDICTED: Final = (OKABE_ITO["vermillion"], (0, (5, 2)))
FLOOR: Final = 30.0
"""Distances below this many tolerances are the computation's error, not the rod's."""


@dataclass(frozen=True)
class Tail:
    """The computed approach to the end, and the law that predicts it; everything dimensionless.

    Attributes
    ----------
    kind : str
        "limiting" (|D| - Theta over logarithmic time) or "interior" (distance from the end over linear time).
    t, computed : ndarray
        Times since the loads have settled, and what was computed there.
    later, predicted : ndarray
        The same of the law.
    """

    kind: str
    t: Array
    computed: Array
    later: Array
    predicted: Array


def ending(solution: Solution) -> Figure:
    """Draw where a motion ends: the rod now and in the end; and below, computed and predicted approach.

    Parameters
    ----------
    solution : Solution
        A finished motion with a limit.

    Returns
    -------
    Figure
        Where |D| = Theta in the end, |D| - Theta over logarithmic axes: the law is a straight line of slope
        -1/(p - 1). Where the natural curvature is frozen, the distance from the end over time: a straight line whose
        slope is the gap. Nothing is fitted: the law takes its rate from the equilibrium, and starts at one state.
    """
    limit, seen = solution.limit, view(solution)
    tail = tail_of(seen)
    with drawing():
        figure = new_figure(WIDTH, 6.0 if tail is not None else 3.2)
        if tail is None:
            _now_and_then(figure.subplots(), seen, limit)
        else:
            upper, lower = figure.subplots(2, 1, height_ratios=[1.25, 1.0])
            _now_and_then(upper, seen, limit)
            _tails(lower, seen, tail)
    return figure


def _now_and_then(ax: Axes, seen: View, limit: Limit | None) -> None:
    solution = seen.solution
    measure = Measure(solution.model.specimen)
    last = solution.model.layout.natural(solution.history.y[-1])
    length = solution.model.scales.length
    x, y, *_ = seen.centre_lines(seen.t[-1:], np.linspace(0.0, 1.0, 201))
    end = None if limit is None else limit.equilibrium
    now = AtRest(x[0] / length, y[0] / length, "rod now", ROLES["rod"][0], "-", 4.2 if end is not None else 3.0)
    shapes = [now]
    if end is not None:
        then = shape_of(end, "rod in the end")
        shapes.append(AtRest(then.x, then.y, then.words, INK, (0, (2, 1.2)), 1.7))
        shapes.append(natural_arc(end.mu_nat, "natural shape in the end"))
    else:
        shapes.append(natural_arcs(solution.model, last, "natural shape now"))
    rods_panel(ax, measure, shapes, Pull.at(solution.model, solution.history.end))


def tail_of(seen: View) -> Tail | None:
    """Return computed and predicted approach; None where there is no limit, no law, or nothing of it was computed."""
    limit = seen.solution.limit
    if limit is None or limit.equilibrium is None:
        return None
    settled = seen.solution.model.loads.settled or 0.0
    start = max(float(settled), seen.solution.history.start)
    t = np.asarray(seen.sampled.t, dtype=float)
    kept = t > start
    made = None
    if kept.sum() >= 3 and limit.kind == "limiting":
        made = _limiting_tail(seen, limit, t[kept] - start, kept)
    elif kept.sum() >= 3 and limit.kind == "interior":
        made = _interior_tail(seen, limit, t[kept] - start, kept)
    return made


def _limiting_tail(seen: View, limit: Limit, t: Array, kept: NDArray[np.bool_]) -> Tail | None:
    drive, threshold = seen.values("drive")[kept], seen.values("threshold")[kept]
    excess = (np.abs(drive) - threshold) / seen.solution.model.scales.drive
    span = tail_time(limit)
    if span is None or not (excess > 0.0).any():
        return None
    end = float(t[-1])
    over = (limit.exponent or 2.0) - 1.0
    # Backwards the law begins at infinity a time `span` ago; it is drawn from where it is ten times what was computed.
    first = max(end - 0.98 * span, float(t[0])) if over > 0.0 else float(t[0])
    later = np.unique(np.concatenate([np.logspace(np.log10(first), np.log10(LATER * end), 400), [end]]))
    predicted = limit.tail(later - end)
    low = later >= end
    chosen = (predicted <= 3.0 * float(excess.max())) | low
    return Tail("limiting", t, np.where(excess > 0.0, excess, np.nan), later[chosen], predicted[chosen])


def _interior_tail(seen: View, limit: Limit, t: Array, kept: NDArray[np.bool_]) -> Tail | None:
    end, solution = limit.equilibrium, seen.solution
    if end is None or limit.rate is None or limit.rate <= 0.0:
        return None
    grid, layout = solution.model.grid, solution.model.layout
    states = np.asarray(solution.history(solution.history.snapped(seen.sampled.t)))[kept]
    mu = layout.mu(states)
    off = (mu - np.asarray(end.curvature(grid.s))) ** 2 @ grid.w
    distance = np.sqrt(off + (layout.natural(states) - end.mu_nat) ** 2)
    floor = FLOOR * solution.rtol * max(1.0, float(np.abs(mu).max()))
    clear = np.flatnonzero(distance > floor)
    if clear.size < 3:
        return None
    # The law is joined to the last state that is clear of the errors of the computation.
    anchor = int(clear[-1])
    begin = float(t[anchor]) - 6.0 / limit.rate
    later = np.linspace(max(begin, 0.0), float(t[anchor]) + 6.0 / limit.rate, 200)
    predicted = distance[anchor] * np.exp(-limit.rate * (later - t[anchor]))
    shown = (t <= later[-1]) & (distance > 0.0)
    return Tail("interior", t[shown], distance[shown], later, predicted)


def _tails(ax: Axes, seen: View, tail: Tail) -> None:
    measure = Measure(seen.solution.model.specimen)
    since = "Time" if not (seen.solution.model.loads.settled or 0.0) else "Time since the last change of the load"
    time = measure.axis("time", since, float(tail.t[-1]))
    kind, words = (
        ("drive", "|Drive| − threshold") if tail.kind == "limiting" else ("curvature", "Distance from the end")
    )
    axis = measure.axis(kind, words, float(np.nanmax(tail.computed)))
    ax.plot(time(tail.t), axis(tail.computed), color=ROLES["rod"][0], label="computed", linewidth=2.4)
    colour, dashes = PREDICTED
    ax.plot(time(tail.later), axis(tail.predicted), color=colour, linestyle=dashes, label="predicted", zorder=4)
    ax.set_yscale("log")
    if tail.kind == "limiting":
        ax.set_xscale("log")
        ax.set_xlim(float(time(max(tail.t[0], 1e-3 * tail.t[-1]))), float(time(tail.later[-1])))
        ax.axvline(float(time(tail.t[-1])), color=MUTED, linewidth=0.9, linestyle=(0, (1, 2)), zorder=1.2, label="_now")
        ax.annotate(
            "end of the run",
            (float(time(tail.t[-1])), 1.0),
            (4, -2),
            xycoords=("data", "axes fraction"),
            textcoords="offset points",
            color=MUTED,
            fontsize=8.5,
            va="top",
        )
    ax.set_xlabel(time.label)
    ax.set_ylabel(axis.label)
    ax.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=2, frameon=False, fontsize=8.5, borderaxespad=0.2)
