"""Loads as arrows: where they are drawn on the rod, in which direction, and how long."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from plastica.physics.model import Model

__all__ = ["ARROW", "FAINT", "Arrow", "Pull", "arrows", "reach", "strongest"]

Array = NDArray[np.float64]

ARROW: Final = 0.16
"""Length of the arrow of the largest force at the free end, as a share of the rod."""

RADIUS: Final = 0.075
"""Radius of the arc of an end couple, as a share of the rod."""

TURN: Final = 1.5 * np.pi
"""Angle of the arc of the largest couple."""

HANGING: Final = 0.07
"""Length of the arrows of the largest weight."""

HUNG: Final = (0.2, 0.4, 0.6, 0.8)
"""Where along the rod the weight is drawn."""

FAINT: Final = 0.04
"""Share of the largest load below which no arrow is drawn."""


@dataclass(frozen=True)
class Pull:
    """The dead loads at one time, dimensionless or as shares of their largest.

    Attributes
    ----------
    force : (float, float)
        Force at the free end, (-thrust, transverse).
    couple : float
        Couple at the free end.
    weight : (float, float)
        Force per length.
    """

    force: tuple[float, float]
    couple: float
    weight: tuple[float, float]

    @classmethod
    def at(cls, model: Model, t: float) -> Pull:
        """Return the loads of a model at a dimensionless time."""
        loads = model.loads
        size, (along, across) = float(loads.weight(t)), loads.weight_direction
        force = -float(loads.thrust(t)), float(loads.transverse(t))
        return cls(force, float(loads.couple(t)), (size * along, size * across))

    def over(self, largest: Mapping[str, float]) -> Pull:
        """Return the loads as shares of the largest of each kind."""
        force, couple, weight = (largest[name] or 1.0 for name in ("force", "couple", "weight"))
        return Pull(
            (self.force[0] / force, self.force[1] / force),
            self.couple / couple,
            (self.weight[0] / weight, self.weight[1] / weight),
        )


def strongest(pulls: list[Pull]) -> dict[str, float]:
    """Return the largest magnitude of each kind of load."""
    return {
        "force": max(float(np.hypot(*each.force)) for each in pulls),
        "couple": max(abs(each.couple) for each in pulls),
        "weight": max(float(np.hypot(*each.weight)) for each in pulls),
    }


@dataclass(frozen=True)
class Arrow:
    """Lines with heads of one kind of load; x and y have a gap (not a number) between two lines.

    Attributes
    ----------
    x, y : ndarray
        The lines, in the units of the rod that they were drawn on.
    head_x, head_y : ndarray
        Where the heads lie.
    angle : float
        Direction of all heads, in degrees from the clamp's tangent.
    """

    x: Array
    y: Array
    head_x: Array
    head_y: Array
    angle: float

    @property
    def marker(self) -> Any:
        """A triangle that points where the arrow does."""
        # Matplotlib's triangle points up.
        return (3, 0, self.angle - 90.0)


def arrows(x: Array, y: Array, angle: float, pull: Pull, length: float) -> dict[str, Arrow]:
    """Return the arrows of the loads on a rod, by kind; those of loads below `FAINT` are left out.

    Parameters
    ----------
    x, y : ndarray, shape (places,)
        Centre line from the clamp to the free end, evenly spaced in arc length.
    angle : float
        Tangent angle at the free end, in rad.
    pull : Pull
        The loads, as shares of the largest.
    length : float
        Length of the rod in the units of x and y.
    """
    found: dict[str, Arrow] = {}
    size = float(np.hypot(*pull.force))
    if size > FAINT:
        found["force"] = _force(float(x[-1]), float(y[-1]), pull.force, length)
    if abs(pull.couple) > FAINT:
        found["couple"] = _couple(float(x[-1]), float(y[-1]), angle, pull.couple, length)
    if float(np.hypot(*pull.weight)) > FAINT:
        found["weight"] = _weight(x, y, pull.weight, length)
    return found


def _degrees(along: float, across: float) -> float:
    return float(np.degrees(np.arctan2(across, along)))


def _force(x: float, y: float, force: tuple[float, float], length: float) -> Arrow:
    """A push ends at the free end, a pull begins there: either way the arrow lies beyond the rod."""
    along, across = (ARROW * length * each for each in force)
    pushes = force[0] < 0.0
    xs, ys = (
        (np.array([x - along, x]), np.array([y - across, y]))
        if pushes
        else (
            np.array([x, x + along]),
            np.array([y, y + across]),
        )
    )
    return Arrow(xs, ys, xs[-1:], ys[-1:], _degrees(*force))


def _couple(x: float, y: float, angle: float, couple: float, length: float) -> Arrow:
    """An arc about the free end, opposite to the rod at first; the head points along it."""
    # A head that is as long as the arc would hide which way it turns.
    sweep = np.sign(couple) * max(abs(couple), 0.35) * TURN
    turned = angle - np.sign(couple) * 0.75 * np.pi + np.linspace(0.0, sweep, 49)
    xs, ys = x + RADIUS * length * np.cos(turned), y + RADIUS * length * np.sin(turned)
    return Arrow(xs, ys, xs[-1:], ys[-1:], float(np.degrees(turned[-1] + np.sign(couple) * 0.5 * np.pi)))


def _weight(x: Array, y: Array, weight: tuple[float, float], length: float) -> Arrow:
    """Arrows that hang from places along the rod."""
    place = np.linspace(0.0, 1.0, x.size)
    root_x, root_y = np.interp(HUNG, place, x), np.interp(HUNG, place, y)
    tip_x, tip_y = root_x + HANGING * length * weight[0], root_y + HANGING * length * weight[1]
    gap = np.full(root_x.size, np.nan)
    xs, ys = (np.stack(each, axis=1).ravel() for each in ((root_x, tip_x, gap), (root_y, tip_y, gap)))
    return Arrow(xs, ys, tip_x, tip_y, _degrees(*weight))


def reach(drawn: Mapping[str, Arrow]) -> tuple[Array, Array]:
    """Return every point of the arrows, for the limits of the axes."""
    x = [np.concatenate([each.x, each.head_x]) for each in drawn.values()]
    y = [np.concatenate([each.y, each.head_y]) for each in drawn.values()]
    flat = [np.concatenate(each) if each else np.empty(0) for each in (x, y)]
    return flat[0][np.isfinite(flat[0])], flat[1][np.isfinite(flat[1])]
