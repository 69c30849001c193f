"""Panels of how the rod moves and what holds it: its free end, its velocity, and the reactions at the clamp."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

import numpy as np
from matplotlib.colors import TwoSlopeNorm

from plastica.show.panels import clamp, mark_ends
from plastica.show.style import DIVERGING, INK, MUTED, OKABE_ITO, ROLES, direct_labels, room
from plastica.show.view import View

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from numpy.typing import NDArray

    Array = NDArray[np.float64]

__all__ = ["clamp_panels", "end_panel", "path_panel", "reactions", "speed_panel", "velocity_map"]

ALONG: Final = (OKABE_ITO["vermillion"], (0, (5, 2)))
ACROSS: Final = (OKABE_ITO["blue"], "-")
MAP_SIZE: Final = (120, 420)


def path_panel(ax: Axes, seen: View) -> None:
    """Draw the path of the free end in the plane, on equal axes, from its first place (ring) to its last (disc)."""
    length = seen.length("")
    x, y = length(seen.values("tip_x")), length(seen.values("tip_y"))
    ax.plot(x, y, color=ROLES["rod"][0], linewidth=1.3, label="path of the free end", zorder=3)
    mark_ends(ax, x, y, ROLES["rod"][0])
    full = float(length(seen.solution.model.scales.length))
    size = max(float(np.ptp(x)), float(np.ptp(y)), 0.02 * full)
    ax.set_aspect("equal", adjustable="box")
    for limits, values in ((ax.set_xlim, x), (ax.set_ylim, y)):
        middle = 0.5 * (float(values.min()) + float(values.max()))
        half = 0.5 * max(float(np.ptp(values)), 0.6 * size) + 0.06 * size
        limits(middle - half, middle + half)
    if float(x.min()) - 0.2 * size < 0.0:
        clamp(ax, 0.3 * full, full)
    ax.set_xlabel(seen.length("Along the clamp's tangent").label)
    ax.set_ylabel(seen.length("Across").label)


def end_panel(ax: Axes, seen: View, *, label_time: bool = True) -> None:
    """Draw how far the free end is along and across, over time."""
    length = seen.length("Free end")
    _pair(ax, seen, length, length(seen.values("tip_x")), length(seen.values("tip_y")))
    seen.time.apply(ax, label=label_time)


def speed_panel(ax: Axes, seen: View, *, label_time: bool = True) -> None:
    """Draw the velocity of the free end along and across, over time."""
    along, across = (each[:, 0] for each in seen.velocities(seen.t, np.array([1.0])))
    axis = _velocity(seen, "Velocity of the free end", along, across)
    _pair(ax, seen, axis, axis(along), axis(across))
    seen.time.apply(ax, label=label_time)


def _velocity(seen: View, words: str, *values: Array) -> Any:
    return seen.kind("velocity", "m/s", words, max(float(np.abs(each).max()) for each in values))


def _pair(ax: Axes, seen: View, axis: Any, along: Array, across: Array) -> None:
    t = seen.time(seen.t)
    for (colour, dashes), words, values in ((ALONG, "along", along), (ACROSS, "across", across)):
        ax.plot(t, values, color=colour, linestyle=dashes, linewidth=1.4, label=words)
    room(ax, along, across)
    ax.set_ylabel(axis.label)
    direct_labels(ax, [(float(along[-1]), "along", ALONG[0]), (float(across[-1]), "across", ACROSS[0])])


def velocity_map(figure: Figure, ax: Axes, seen: View) -> None:
    """Draw the velocity across over time and arc length; white where the rod stands still."""
    rows, columns = MAP_SIZE
    middle = np.clip(seen.time.times((np.arange(columns) + 0.5) / columns), seen.t[0], seen.t[-1])
    _, across = seen.velocities(middle, (np.arange(rows) + 0.5) / rows)
    axis = _velocity(seen, "Velocity across", across)
    shown = axis(across).T
    largest = float(np.abs(shown).max()) or 1.0
    length = seen.length("Arc length from the clamp")
    s = length(np.linspace(0.0, seen.solution.model.scales.length, rows + 1))
    edges = seen.time(seen.time.times(np.linspace(0.0, 1.0, columns + 1)))
    norm = TwoSlopeNorm(0.0, -largest, largest)
    mesh = ax.pcolormesh(edges, s, shown, cmap=DIVERGING, norm=norm, shading="flat", rasterized=True)
    ax.grid(visible=False)
    seen.time.apply(ax)
    ax.set_ylim(0.0, float(s[-1]))
    ax.set_ylabel(length.label)
    bar = figure.colorbar(mesh, ax=ax, pad=0.02, aspect=24)
    bar.set_label(axis.label)
    bar.outline.set_visible(False)


def reactions(seen: View) -> tuple[Array, Array, Array]:
    """Return force along, force across and couple of the rod on the clamp over time, in the user's units.

    n(0) and M(0) of the balances of momenta (design note 1.2); without inertia those of the dead loads alone.
    """
    if "clamp_couple" in seen.dataset:
        return seen.values("clamp_force_x"), seen.values("clamp_force_y"), seen.values("clamp_couple")
    model = seen.solution.model
    along, across = model.loads.weight_direction
    weight = seen.values("weight") * model.scales.length
    arm = np.asarray(seen.dataset["s_weight"].values)
    couple = seen.values("end_couple") + seen.values("shear") @ arm
    return weight * along - seen.values("thrust"), seen.values("transverse") + weight * across, couple


def clamp_panels(forces: Axes, couples: Axes, seen: View) -> None:
    """Draw force and couple of the rod on the clamp over time."""
    along, across, couple = reactions(seen)
    axis = seen.kind("force", "N", "Force on the clamp", max(float(np.abs(each).max()) for each in (along, across)))
    _pair(forces, seen, axis, axis(along), axis(across))
    seen.time.apply(forces, label=False)
    axis = seen.kind("couple", "N*m", "Couple on the clamp", float(np.abs(couple).max()))
    couples.axhline(0.0, color=MUTED, linewidth=0.8, zorder=1.2, label="_zero")
    couples.plot(seen.time(seen.t), axis(couple), color=INK, linewidth=1.4, label="couple")
    seen.time.apply(couples)
    room(couples, axis(couple), [0.0])
    couples.set_ylabel(axis.label)
