"""Pictures of a spectrum: the eigenvalues on a line, and the shapes of the modes."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

import numpy as np

from plastica.equilibria.spectrum import Spectrum
from plastica.show.measure import Measure
from plastica.show.rods import PLACES, WIDTH
from plastica.show.style import INK, MUTED, OKABE_ITO, ROLES, direct_labels, drawing, new_figure, room
from plastica.show.words import number

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = ["spectrum_figure"]

MOST_MODES: Final = 4
LINES: Final = ("-", (0, (6, 2)), (0, (2, 1.4)), (0, (6, 1.5, 1, 1.5)))
COLOURS: Final = tuple(OKABE_ITO[name] for name in ("blue", "vermillion", "green", "purple"))
UNSTABLE: Final = OKABE_ITO["vermillion"]
STABLE: Final = OKABE_ITO["blue"]


def spectrum_figure(found: Spectrum) -> Figure:
    """Draw a spectrum: eigenvalues with the bounds of the theory above, modes and the tangent of the curve below.

    Parameters
    ----------
    found : Spectrum
        What `plastica.spectrum` returned.

    Returns
    -------
    Figure
        Discs decay, triangles grow; the eigenvalues accumulate at -1 only. Modes are drawn as tangent angles.
    """
    with drawing():
        figure = new_figure(WIDTH, 5.2)
        parts: Any = figure.subfigures(2, 1, height_ratios=[1.0, 2.2])
        upper, lower = parts
        line_panel(upper.subplots(), found)
        left, right = lower.subplots(1, 2)
        modes_panel(left, found)
        kernel_panel(right, found)
        for part in parts:
            part.set_facecolor("white")
        figure.suptitle(_title(found), x=0.01, ha="left", fontsize=11, fontweight="bold")
    return figure


def _title(found: Spectrum) -> str:
    where = Measure(found.equilibrium.specimen).write(found.equilibrium.gamma, "force")
    if found.unstable:
        many = "direction" if found.unstable == 1 else "directions"
        return (
            f"Under {where}: unstable in {found.unstable} {many}, growing at {number(-found.gap)} per retardation time"
        )
    if found.zero_multiplicity == 2:
        return f"Under {where}: degenerate, 0 is a double eigenvalue with one eigenvector"
    if found.degenerate:
        return f"Under {where}: degenerate, an eigenvalue cannot be told from 0"
    return f"Under {where}: stable, decay at {number(found.gap)} per retardation time"


def line_panel(ax: Axes, found: Spectrum) -> None:
    """Draw the eigenvalues on a line: those that grow as triangles, the bounds shaded, 0 and -1 marked."""
    values = np.concatenate([found.lowest, found.eigenvalues])
    low, high = found.bounds
    ax.axvspan(low, high, color="#eef1f4", zorder=0.5, label="bounds")
    ax.axvline(0.0, color=INK, linewidth=1.1, zorder=1.5, label="_zero")
    ax.axvline(-1.0, color=MUTED, linewidth=1.1, linestyle=(0, (1, 2)), zorder=1.5, label="_accumulation")
    kinds = ((values > 0.0, UNSTABLE, "^", "grows"), (values <= 0.0, STABLE, "o", "decays"))
    for chosen, colour, marker, words in kinds:
        if chosen.any():
            ax.plot(values[chosen], np.zeros(chosen.sum()), marker, color=colour, markersize=7, label=words, zorder=4)
    span, last = max(high - low, 1e-3), np.inf
    for k, value in enumerate(found.eigenvalues[:MOST_MODES]):
        if last - value < 0.015 * span:
            break
        last = float(value)
        ax.annotate(str(k + 1), (value, 0.0), (0, 8), textcoords="offset points", ha="center", fontsize=8.5)
    ax.set_xlim(min(low, -1.0) - 0.04 * span, max(high, 0.0) + 0.04 * span)
    ax.set_ylim(-1.0, 1.3)
    ax.set_yticks([])
    ax.spines["left"].set_visible(False)
    ax.grid(visible=False)
    ax.set_xlabel(
        "Eigenvalue (per retardation time). Shaded: where the theory allows them; dotted: where they accumulate"
    )
    ax.legend(loc="upper left", bbox_to_anchor=(0.0, 1.25), ncols=3, frameon=False, fontsize=8.5)


def modes_panel(ax: Axes, found: Spectrum) -> None:
    """Draw the tangent angles of the first modes, scaled to the same largest value."""
    across = Measure(found.equilibrium.specimen).axis("length", "Arc length from the clamp")
    labels = []
    for k, angle in enumerate(found.mode_angles(PLACES)[:MOST_MODES]):
        scaled = angle / max(float(np.abs(angle).max()), 1e-300)
        ax.plot(across(PLACES), scaled, color=COLOURS[k], linestyle=LINES[k], label=f"mode {k + 1}")
        labels.append((float(scaled[-1]), f"{k + 1}", COLOURS[k]))
    ax.axhline(0.0, color=MUTED, linewidth=0.8, zorder=1.2, label="_zero")
    ax.set_xlim(0.0, float(across(1.0)))
    ax.set_ylim(-1.1, 1.1)
    direct_labels(ax, labels)
    ax.set_xlabel(across.label)
    ax.set_ylabel("Angle / its largest")
    ax.set_title("Modes, as tangent angles")


def kernel_panel(ax: Axes, found: Spectrum) -> None:
    """Draw the kernel: how curvature and natural curvature change along the curve of equilibria."""
    across = Measure(found.equilibrium.specimen).axis("length", "Arc length from the clamp")
    values = found.kernel(PLACES)
    natural, dashes = ROLES["natural"]
    ax.axhline(found.kernel.natural, color=natural, linestyle=dashes, label="natural curvature")
    ax.plot(across(PLACES), values, color=ROLES["rod"][0], label="curvature", zorder=3)
    ax.axhline(0.0, color=MUTED, linewidth=0.8, zorder=1.2, label="_zero")
    room(ax, values, [found.kernel.natural, 0.0])
    ax.set_xlim(0.0, float(across(1.0)))
    ax.set_xlabel(across.label)
    ax.set_ylabel("Part of the unit tangent")
    ax.set_title("Eigenvalue 0: along the curve of equilibria")
    direct_labels(ax, [(found.kernel.natural, "natural", natural), (float(values[-1]), "rod", ROLES["rod"][0])])
