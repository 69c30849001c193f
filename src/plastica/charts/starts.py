"""Families of starts: an amplitude times one shape, whose limits the charts ask for."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from plastica.equilibria.equilibrium_set import EquilibriumSet
from plastica.errors import ArgumentError
from plastica.physics.initial import Shape, initial_shape, nodal_values
from plastica.physics.narrow import met
from plastica.physics.strut import Strut
from plastica.units import looks_like_quantity

__all__ = ["NODES", "interval_of", "no_straight_rod", "read_shape", "scaled", "straight_interval"]

Array = NDArray[np.float64]

NODES = 24
"""Nodes of the runs of a chart where the user does not say."""

ON_EDGE = 1e-9
"""How far, relative to one or its own size, a limit may lie beyond an edge and count as on it."""


def read_shape(text: object, strut: Strut, where: str) -> tuple[Shape, float]:
    """Read a shape.

    Parameters
    ----------
    text : str
        In s: in m with a specimen, else in units of L.
    strut : Strut
        The rod, on a grid with a number of nodes.
    where : str
        The argument, for messages.

    Returns
    -------
    Shape
        As a dimensionless curvature, with element ends where the nodes alone would miss something.
    float
        The largest size of the shape as written, at the nodes.

    Raises
    ------
    ArgumentError
        Where it is no such text, or not finite along the rod.
    """
    if not isinstance(text, str) or looks_like_quantity(text):
        raise ArgumentError("must be text in s, without a unit", where=where, value=text)
    try:
        si = strut.specimen is not None
        written, grid = initial_shape(met(text, strut.grid, strut.scales, si=si), strut.grid, strut.scales, si=si)
        values = nodal_values(written, grid)
    except ArgumentError as error:
        raise ArgumentError(f"must be text in s ({str(error).rstrip('.')})", where=where, value=text) from None
    return written, float(np.abs(values).max()) / strut.scales.length


def scaled(written: Shape, amplitude: float, strut: Strut) -> Shape:
    """Return an amplitude in the user's units times a shape from `read_shape`.

    Parameters
    ----------
    written : Shape
        The shape.
    amplitude : float
        In 1/m with a specimen, else in 1/L.
    strut : Strut
        The rod.

    Returns
    -------
    Shape
        In the user's units, as `solve` takes it.
    """
    length = strut.scales.length
    return written.scaled(1.0 / length, amplitude / length, f"{amplitude:g} * ({written.words})")


def straight_interval(found: EquilibriumSet) -> tuple[float, float]:
    """Return the interval of the admissible set that contains the straight rod.

    Parameters
    ----------
    found : EquilibriumSet
        All equilibria of a thrust.

    Returns
    -------
    tuple of (float, float)

    Raises
    ------
    ArgumentError
        Where there is none, which only an inadmissible material can bring about.
    """
    for low, high in found.intervals:
        if low <= 0.0 <= high:
            return low, high
    raise no_straight_rod()


def no_straight_rod() -> ArgumentError:
    """Return the error of a material under which the straight rod does not stay straight."""
    return ArgumentError(
        "must let the straight rod without natural curvature stay as it is, |kappa'(0)| <= Theta(0), which it does not",
        where="material",
        next_step="See material.admissibility().",
    )


def interval_of(found: EquilibriumSet, alpha: float) -> int | None:
    """Tell in which interval of the admissible set a limit lies, counted from that of the straight rod.

    Parameters
    ----------
    found : EquilibriumSet
        All equilibria of the thrust.
    alpha : float
        Clamp curvature of the limit.

    Returns
    -------
    int or None
        0 for the interval that contains the straight rod, 1, 2, ... above and -1, -2, ... below; ends belong to it.
        None for one that lies in none, such as an isolated point.
    """
    away = [max(lo - alpha, alpha - hi, 0.0) for lo, hi in found.intervals]
    centre = found.intervals.index(straight_interval(found))
    best = int(np.argmin(away))
    return best - centre if away[best] <= ON_EDGE * max(1.0, abs(alpha)) else None
