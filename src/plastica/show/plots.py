"""Pictures of finished results: pure functions from a result to a matplotlib `Figure`.

No window system and no pyplot take part; save a figure with ``figure.savefig("name.png")``. In a notebook a figure
shows itself.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Final

from plastica.errors import ArgumentError
from plastica.motion.solution import Solution
from plastica.show import loops, panels, swings
from plastica.show.ending import ending
from plastica.show.gallery import drawn
from plastica.show.memory import memory
from plastica.show.style import drawing, new_figure
from plastica.show.view import View, view

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

WIDTH: Final = 6.6
"""Inches: fits a page between its margins, and a telephone with the letters still legible."""

__all__ = [
    "PICTURES",
    "curvature_map",
    "ending",
    "energies",
    "force_displacement",
    "free_end",
    "loads",
    "moment_curvature",
    "natural",
    "overview",
    "plot",
    "reactions",
    "shapes",
    "velocities",
]


def plot(result: object, picture: str | None = None, *, path: Solution | None = None) -> Figure:
    """Draw a result.

    Parameters
    ----------
    result : Solution, Equilibrium, EquilibriumSet, Spectrum, Limit, Rest, branches, capacity, PhaseDiagram or Basin
        What a function of this package returned; also Modes, and histories of `force_displacement` or
        `moment_curvature`.
    picture : str, optional
        Which picture of a motion: "overview" (the default), "shapes", "natural", "curvature_map", "energies", "loads",
        "free_end", "velocities", "reactions", "force_displacement", "moment_curvature" or "ending".
    path : Solution, optional
        A motion whose path is drawn into a phase diagram.

    Returns
    -------
    Figure
        Of a motion an overview: shapes through time, curvature over (s, t), natural curvature with drive and
        threshold, energies. Of an equilibrium, a static shape or a limit the rod with its natural shape, and its
        curvature or the predicted way there. Of all equilibria under one thrust, branches, a phase diagram, a
        capacity chart or a basin the chart; of a spectrum its eigenvalues and modes.

    Raises
    ------
    ArgumentError
        Where there is no picture for this type, or none of this name.

    Notes
    -----
    *You should see* the rod leave its first shape (pale) for its last (dark); the natural curvature move only where
    the ground is shaded, that is where the drive is outside the band of the threshold.
    """
    if isinstance(result, Solution):
        return _picture(picture or "overview")(result)
    if picture is not None:
        raise ArgumentError("must be left out where the result is no motion", where="picture", value=picture)
    figure = drawn(result, path)
    if figure is None:
        raise ArgumentError(
            "must be a result that there is a picture for, such as a Solution",
            where="result",
            value=result,
            next_step="Give what pl.solve, pl.read, pl.equilibria, pl.spectrum, pl.capacity or the like returned.",
        )
    return figure


def _picture(name: object) -> Callable[[Solution], Figure]:
    """The function that draws a picture of a motion."""
    if not isinstance(name, str) or name not in PICTURES:
        raise ArgumentError(f"must be one of {', '.join(PICTURES)}", where="picture", value=name)
    return PICTURES[name]


def overview(solution: Solution) -> Figure:
    """Draw the whole of a motion on one figure of two columns."""
    seen = _seen(solution)
    with drawing():
        figure = new_figure(11.5, 9.2 if seen.solution.model.segments == 1 else 10.4)
        halves: Any = figure.subfigures(2, 1, height_ratios=[1.0, 1.35])
        upper, lower = halves
        for part in (upper, lower):
            part.set_facecolor("white")
        ax, cells = upper.subplots(1, 2, width_ratios=[1.0, 1.1])
        panels.shapes_panel(upper, ax, seen)
        panels.curvature_panel(upper, cells, seen)
        cells.set_title("Curvature along the rod")
        left, right = lower.subfigures(1, 2, wspace=0.04)
        for part in (left, right):
            part.set_facecolor("white")
        memory(left, seen)
        _energies(right.subplots(2, 1, sharex=True, height_ratios=[2.6, 1.0]), seen)
        figure.suptitle(_title(solution), x=0.01, ha="left", fontsize=12, fontweight="bold")
    return figure


def shapes(solution: Solution) -> Figure:
    """Draw the rod through time: pale at the start, dark at the end, with its natural shape dashed.

    Parameters
    ----------
    solution : Solution
        A finished motion.

    Returns
    -------
    Figure
        Equal axes; thirteen shapes at times between which the state goes about equally far.
    """
    seen = _seen(solution)
    with drawing():
        figure = new_figure(WIDTH, _height(seen))
        panels.shapes_panel(figure, figure.subplots(), seen)
    return figure


def curvature_map(solution: Solution) -> Figure:
    """Draw the curvature as an image over time and arc length.

    Parameters
    ----------
    solution : Solution
        A finished motion.

    Returns
    -------
    Figure
        White where the rod is straight, with two colours for the two signs; one scale from 0 where there is one sign.
    """
    seen = _seen(solution)
    with drawing():
        figure = new_figure(WIDTH, 3.5)
        panels.curvature_panel(figure, figure.subplots(), seen)
    return figure


def natural(solution: Solution) -> Figure:
    """Draw the natural curvature over time, and below it the drive within or beyond its threshold.

    Parameters
    ----------
    solution : Solution
        A finished motion.

    Returns
    -------
    Figure
        The ground is shaded while the rod yields; onsets and arrests are marked. With several segments one line for
        each, drives in units of their thresholds, and below which segment yields when.
    """
    seen = _seen(solution)
    with drawing():
        figure = new_figure(WIDTH, 4.8 if seen.solution.model.segments == 1 else 6.6)
        memory(figure, seen)
    return figure


def energies(solution: Solution) -> Figure:
    """Draw where the work of the loads goes, and what the ledger leaves over.

    Parameters
    ----------
    solution : Solution
        A finished motion.

    Returns
    -------
    Figure
        Work, stored and kinetic energy, both dissipations and, under constant loads, the Liapunov function, which
        never rises; below, the residual in units of rtol times the largest energy.
    """
    seen = _seen(solution)
    with drawing():
        figure = new_figure(WIDTH, 5.0)
        _energies(figure.subplots(2, 1, sharex=True, height_ratios=[2.8, 1.0]), seen)
    return figure


def loads(solution: Solution) -> Figure:
    """Draw the load program: one panel for every load that is present.

    Parameters
    ----------
    solution : Solution
        A finished motion.

    Returns
    -------
    Figure
        With jumps drawn upright.
    """
    seen = _seen(solution)
    count = len(panels.present_loads(seen))
    with drawing():
        figure = new_figure(WIDTH, 0.9 + 1.6 * count)
        axes = figure.subplots(count, 1, sharex=True, squeeze=False)
        panels.load_panels(list(axes[:, 0]), seen)
    return figure


def free_end(solution: Solution) -> Figure:
    """Draw the path of the free end in the plane, and below it how far it is along and across over time.

    Parameters
    ----------
    solution : Solution
        A finished motion.

    Returns
    -------
    Figure
        The path on equal axes, from its first place (ring) to its last (disc).
    """
    seen = _seen(solution)
    with drawing():
        figure = new_figure(WIDTH, 5.6)
        upper, lower = figure.subplots(2, 1, height_ratios=[1.5, 1.0])
        swings.path_panel(upper, seen)
        upper.set_title("Path of the free end")
        swings.end_panel(lower, seen)
    return figure


def velocities(solution: Solution) -> Figure:
    """Draw the velocity of the free end over time, and below it the velocity across of the whole rod.

    Parameters
    ----------
    solution : Solution
        A finished motion.

    Returns
    -------
    Figure
        The map is white where the rod stands still.
    """
    seen = _seen(solution)
    with drawing():
        figure = new_figure(WIDTH, 5.4)
        halves: Any = figure.subplots(2, 1, sharex=True, height_ratios=[1.0, 1.25])
        swings.speed_panel(halves[0], seen, label_time=False)
        swings.velocity_map(figure, halves[1], seen)
        halves[1].set_title("Velocity across, along the rod")
    return figure


def reactions(solution: Solution) -> Figure:
    """Draw force and couple of the rod on its clamp over time.

    Parameters
    ----------
    solution : Solution
        A finished motion.

    Returns
    -------
    Figure
        The force along and across the clamp's tangent above, the couple below; with inertia, of the moving rod.
    """
    seen = _seen(solution)
    with drawing():
        figure = new_figure(WIDTH, 4.8)
        halves: Any = figure.subplots(2, 1, sharex=True)
        swings.clamp_panels(halves[0], halves[1], seen)
    return figure


def force_displacement(solution: Solution) -> Figure:
    """Draw every load that acts over the displacement on which it does work.

    Parameters
    ----------
    solution : Solution
        A finished motion.

    Returns
    -------
    Figure
        One panel for each load; loops are what a cycle of loading has lost.
    """
    return loops.force_figure(loops.history_of(_seen(solution), "force_displacement"))


def moment_curvature(solution: Solution) -> Figure:
    """Draw the contact couple at the clamp over the curvature there.

    Parameters
    ----------
    solution : Solution
        A finished motion. For other places draw ``pl.plot(pl.moment_curvature(solution, s))``.

    Returns
    -------
    Figure
        Loops are what a unit of length has lost in a cycle of loading.
    """
    return loops.moment_figure(loops.history_of(_seen(solution), "moment_curvature"))


PICTURES: Final[Mapping[str, Callable[[Solution], Figure]]] = MappingProxyType(
    {
        "overview": overview,
        "shapes": shapes,
        "natural": natural,
        "curvature_map": curvature_map,
        "energies": energies,
        "loads": loads,
        "free_end": free_end,
        "velocities": velocities,
        "reactions": reactions,
        "force_displacement": force_displacement,
        "moment_curvature": moment_curvature,
        "ending": ending,
    }
)
"""The pictures of a motion, by name."""


def _drawn(ax: Axes) -> str:
    return " ".join(str(line.get_label()).lower() for line in ax.lines)


def _energies(axes: Any, seen: View) -> None:
    panels.energy_panel(axes[0], seen, label_time=False)
    since = " (* counted from its start)" if "liapunov" in _drawn(axes[0]) else ""
    axes[0].set_title(f"Energy{since}")
    panels.residual_panel(axes[1], seen)
    axes[1].set_title("What the ledger leaves over, in units of rtol × largest energy")


def _seen(solution: object) -> View:
    if not isinstance(solution, Solution):
        raise ArgumentError("must be a Solution", where="solution", value=solution)
    return view(solution)


def _height(seen: View) -> float:
    """Height of a picture in which the rod, with equal axes, fills its place."""
    from matplotlib.figure import Figure

    height, width = panels.plan_limits(Figure().subplots(), seen)
    return float(min(max(0.76 * WIDTH * height / width + 0.95, 2.4), 5.8))


def _title(solution: Solution) -> str:
    return solution.outcome.headline
