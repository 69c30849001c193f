"""Pictures of finished results: pure functions from a result to a matplotlib `Figure`.

No window system and no pyplot take part; save a figure with ``figure.savefig("name.png")``. In a notebook a figure
shows itself.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

from plastica.errors import ArgumentError
from plastica.motion.solution import Solution
from plastica.show import panels
from plastica.show.ending import ending
from plastica.show.gallery import drawn
from plastica.show.style import drawing, new_figure
from plastica.show.view import View, view

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

WIDTH: Final = 6.6
"""Inches: fits a page between its margins, and a telephone with the letters still legible."""

__all__ = ["curvature_map", "ending", "energies", "loads", "natural", "plot", "shapes"]


def plot(result: object, *, path: Solution | None = None) -> Figure:
    """Draw a result.

    Parameters
    ----------
    result : Solution, Equilibrium, EquilibriumSet, Spectrum, Limit, Rest, branches, capacity, PhaseDiagram or Basin
        What a function of this package returned.
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
        Where there is no picture for this type.

    Notes
    -----
    *You should see* the rod leave its first shape (pale) for its last (dark); the natural curvature move only where
    the ground is shaded, that is where the drive is outside the band of the threshold.
    """
    if isinstance(result, Solution):
        return overview(result)
    figure = drawn(result, path)
    if figure is None:
        raise ArgumentError(
            "must be a result that there is a picture for, such as a Solution",
            where="result",
            value=result,
            next_step="Give what pl.solve, pl.read, pl.equilibria, pl.spectrum, pl.capacity or the like returned.",
        )
    return figure


def overview(solution: Solution) -> Figure:
    """Draw the whole of a motion on one figure of two columns."""
    seen = _seen(solution)
    with drawing():
        figure = new_figure(11.5, 9.2)
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
        _natural(left.subplots(2, 1, sharex=True), seen)
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
        The ground is shaded while the rod yields; onsets and arrests are marked.
    """
    seen = _seen(solution)
    with drawing():
        figure = new_figure(WIDTH, 4.8)
        _natural(figure.subplots(2, 1, sharex=True), seen)
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
        Work, stored energy, both dissipations and, under constant loads, the Liapunov function, which never rises;
        below, the residual in units of rtol times the largest energy.
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


def _natural(axes: Any, seen: View) -> None:
    panels.natural_panel(axes[0], seen, label_time=False)
    axes[0].set_title("Natural curvature (shaded: it moves)")
    panels.drive_panel(axes[1], seen)
    axes[1].set_title("Drive and threshold")


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
    words = solution.outcome.headline
    return words if solution.status.ok else f"{words} (stopped early: {solution.status.code})"
