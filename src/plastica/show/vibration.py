"""Pictures of modes: the shapes that a rod swings in about its rest, and how fast each swings and dies out."""

from __future__ import annotations

import textwrap
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from matplotlib.ticker import NullFormatter
from numpy.typing import NDArray

from plastica.equilibria.mode_set import Modes
from plastica.show.measure import Measure
from plastica.show.panels import clamp
from plastica.show.style import INK, MUTED, OKABE_ITO, drawing, new_figure
from plastica.show.words import number

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = ["modes_figure"]

Array = NDArray[np.float64]

WIDTH: Final = 9.2
PLACES: Final = np.linspace(0.0, 1.0, 201)
MOST: Final = 4
LARGEST: Final = 0.22
"""Largest displacement as drawn, in lengths of the rod: modes have no size of their own."""

LINES: Final = ("-", (0, (6, 2)), (0, (2, 1.4)), (0, (6, 1.5, 1, 1.5)))
COLOURS: Final = tuple(OKABE_ITO[name] for name in ("blue", "vermillion", "green", "purple"))


def modes_figure(found: Modes) -> Figure:
    """Draw modes: the rod at rest with each of the first four shapes to both sides, and their numbers.

    Parameters
    ----------
    found : Modes
        What `plastica.modes` returned.

    Returns
    -------
    Figure
        Above, the displaced rod, the largest displacement drawn at 0.22 L; below, the curvatures of the modes, and
        damping ratio over frequency: above 1 a mode does not swing. Without damping the frequencies, without inertia
        the rates of decay.
    """
    with drawing():
        figure = new_figure(WIDTH, 7.4)
        halves: Any = figure.subfigures(2, 1, height_ratios=[1.35, 1.0])
        count = min(MOST, found.shapes.shape[0])
        cells = halves[0].subplots(1 if count < 2 else 2, 1 if count < 2 else 2, squeeze=False).ravel()
        for k, ax in enumerate(cells):
            if k < count:
                shape_panel(ax, found, k)
            else:
                ax.set_axis_off()
        left, right = halves[1].subplots(1, 2)
        curvature_panel(left, found, count)
        _numbers_panel(found)(right, found)
        for half in halves:
            half.set_facecolor("white")
        figure.suptitle(textwrap.fill(found.sentence, 105), x=0.01, ha="left", fontsize=11, fontweight="bold")
    return figure


def words_of(found: Modes, k: int) -> str:
    """Return the frequency and damping of a mode in words."""
    si, first = found.model.specimen is not None, float(found.eigenvalues[k, 0].real)
    omega, zeta = float(found.frequencies[k]), float(found.damping_ratios[k])
    if not np.isfinite(omega):
        return f"{'grows' if first > 0.0 else 'decays'} at {number(abs(first))} {'1/s' if si else '/T'}"
    swing = f"{number(omega / (2.0 * np.pi))} Hz" if si else f"{number(omega)} rad/T"
    return swing if not zeta > 0.0 else f"{swing}, damping ratio {number(zeta, 3)}"


def shape_panel(ax: Axes, found: Modes, k: int) -> None:
    """Draw the rod at rest, and displaced by one mode to either side."""
    model, measure = found.model, Measure(found.model.specimen)
    length = measure.axis("length", "Along the clamp's tangent")
    along = model.grid.integration(PLACES)
    x, y = along @ np.cos(found.theta), along @ np.sin(found.theta)
    u, v = (part[k] for part in found.displacement(PLACES * model.scales.length))
    size = LARGEST / max(float(np.hypot(u, v).max()), 1e-300)
    u, v = size * u, size * v
    ax.fill(
        length(np.concatenate([x + u, (x - u)[::-1]])),
        length(np.concatenate([y + v, (y - v)[::-1]])),
        color=COLOURS[k],
        alpha=0.08,
        linewidth=0.0,
    )
    ax.plot(length(x), length(y), color=MUTED, linewidth=1.4, label="at rest", zorder=3)
    ax.plot(length(x + u), length(y + v), color=COLOURS[k], linewidth=2.2, label="displaced", zorder=4)
    ax.plot(length(x - u), length(y - v), color=COLOURS[k], linewidth=1.0, linestyle=(0, (4, 2)), label="and back")
    _limits(ax, length, np.stack([x - u, x, x + u]), np.stack([y - v, y, y + v]))
    ax.set_xlabel(length.label)
    ax.set_ylabel(measure.axis("length", "Across").label)
    ax.set_title(f"{k + 1}: {words_of(found, k)}")


def _limits(ax: Axes, length: Any, x: Array, y: Array) -> None:
    full = float(length(1.0))
    low, high = float(length(y.min())) - 0.06 * full, float(length(y.max())) + 0.06 * full
    left, right = min(float(length(x.min())), 0.0) - 0.08 * full, float(length(x.max())) + 0.06 * full
    ax.set_aspect("equal", adjustable="box")
    ax.set_xlim(left, right)
    ax.set_ylim(min(low, -0.1 * full), max(high, 0.1 * full))
    clamp(ax, high - low, right - left)


def curvature_panel(ax: Axes, found: Modes, count: int) -> None:
    """Draw the curvatures of the first modes, scaled to the same largest value: where each strains the rod."""
    across = Measure(found.model.specimen).axis("length", "Arc length from the clamp")
    for k, curvature in enumerate(found.curvature(PLACES * found.model.scales.length)[:count]):
        scaled = curvature / max(float(np.abs(curvature).max()), 1e-300)
        ax.plot(across(PLACES), scaled, color=COLOURS[k], linestyle=LINES[k], label=f"mode {k + 1}")
    ax.axhline(0.0, color=MUTED, linewidth=0.8, zorder=1.2, label="_zero")
    ax.set_xlim(0.0, float(across(1.0)))
    ax.set_ylim(-1.1, 1.32)
    ax.legend(loc="upper center", ncols=count, frameon=False, fontsize=8.5, handlelength=2.2, columnspacing=1.0)
    ax.set_xlabel(across.label)
    ax.set_ylabel("Curvature / its largest")
    ax.set_title("Where they strain the rod")


def _numbers_panel(found: Modes) -> Callable[[Axes, Modes], None]:
    """What says most beside the shapes: damping, or without it frequencies, or without inertia rates."""
    if not np.isfinite(found.frequencies).any():
        return rates_panel
    return damping_panel if np.any(found.damping_ratios > 0.0) else frequency_panel


def frequency_panel(ax: Axes, found: Modes) -> None:
    """Draw the frequencies of a rod without damping by the number of the mode."""
    si = found.model.specimen is not None
    order = np.arange(1, found.frequencies.size + 1)
    values = found.frequencies / (2.0 * np.pi if si else 1.0)
    ax.plot(order, values, "o", color=OKABE_ITO["blue"], markersize=6, label="modes", zorder=4)
    ax.set_xticks(order)
    ax.set_ylim(bottom=0.0)
    ax.set_xlabel("Mode")
    ax.set_ylabel("Frequency (Hz)" if si else "Angular frequency (rad / T)")
    ax.set_title("Without damping")


def damping_panel(ax: Axes, found: Modes) -> None:
    """Draw the damping ratio over the frequency of every mode that has one."""
    si = found.model.specimen is not None
    swings = found.damping_ratios > 0.0
    frequency = found.frequencies[swings] / (2.0 * np.pi if si else 1.0)
    ratios = found.damping_ratios[swings]
    ax.plot(frequency, ratios, "o", color=OKABE_ITO["blue"], markersize=6, label="modes", zorder=4)
    for k, x, y in zip(np.flatnonzero(swings), frequency, ratios, strict=True):
        ax.annotate(str(k + 1), (x, y), (0, 7), textcoords="offset points", ha="center", fontsize=8.5)
    ax.set_xscale("log")
    ax.xaxis.set_minor_formatter(NullFormatter())
    ax.set_yscale("log")
    ax.set_ylim(0.5 * min(float(ratios.min()), 1.0), 3.0 * max(float(ratios.max()), 1.0))
    ax.axhline(1.0, color=INK, linewidth=1.0, linestyle=(0, (4, 2)), zorder=1.5, label="_critical")
    ax.set_xlabel("Frequency (Hz)" if si else "Angular frequency (rad / T)")
    ax.set_ylabel("Damping ratio")
    ax.set_title("Above 1 a mode does not swing")


def rates_panel(ax: Axes, found: Modes) -> None:
    """Draw the rates of a rod without inertia by the number of the mode."""
    si = found.model.specimen is not None
    rates = found.eigenvalues[:, 0].real
    order = np.arange(1, rates.size + 1)
    ax.plot(order, rates, "o", color=OKABE_ITO["blue"], markersize=6, label="modes", zorder=4)
    ax.axhline(0.0, color=INK, linewidth=1.0, zorder=1.5, label="_zero")
    ax.set_xticks(order)
    ax.set_xlabel("Mode")
    ax.set_ylabel("Rate (1/s)" if si else "Rate (1 / T)")
    ax.set_title("Above 0 it grows")
