"""Narrow features of initial shapes: what the nodes of a grid miss of a text, and element ends that meet it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from plastica.numerics.grid import AUTO_NODES, LARGEST_SIZE, Grid
from plastica.physics.initial import Curvature, Shape, initial_shape
from plastica.physics.pace import Paces
from plastica.physics.scales import Scales

__all__ = ["met", "missed", "missing", "swung", "turned", "unbounded"]

Array = NDArray[np.float64]

PIECE = Grid(16)
STEPS = 4.0
"""Steps of the pace on a piece, of which 16 Gauss nodes leave nothing."""

MOST_PIECES = 4000
FAST = 16.0
"""Neighbours that change at most so much more slowly belong to the same feature."""

ROUNDING = 100.0 * float(np.finfo(float).eps)

FINE = 1e-10
"""What may be missed, in L, before element ends are added."""

MOST_ELEMENTS = LARGEST_SIZE // AUTO_NODES[-1]
FOLLOWED = 64
"""Nodes per element that must do where their number is open, without further ends."""


def turned(angle: Array) -> Array:
    """Return what is to be integrated for the place of the free end."""
    return np.stack([np.cos(angle), np.sin(angle)])


def swung(rate: Array) -> Array:
    """Return what is to be integrated for about the speed of the free end."""
    return rate[None]


def missed(shape: Shape, grid: Grid, place: Callable[[Array], Array] = turned) -> float:
    """Return how far the free end is off for what the nodes miss of a shape.

    The shape is integrated on the grid, and on pieces on which interval arithmetic on its formula shows that the Gauss
    nodes there meet all of it.

    Parameters
    ----------
    shape : Shape
        A dimensionless curvature, or a rate of curvature.
    grid : Grid
        With a number of nodes and ends at the breaks of the shape.
    place : callable
        What is integrated, of the integral of the shape.

    Returns
    -------
    float
        In L (or L/T); 0 below rounding, and where the shape is no text; infinite where its integral is not finite.
    """
    if shape.paces is None:
        return 0.0
    low, width = _pieces(shape, shape.paces(1.0), grid)
    with np.errstate(all="ignore"):
        values = np.broadcast_to(np.asarray(shape.function(low[:, None] + width[:, None] * PIECE.s)), (low.size, 16))
        angle = np.cumsum(values @ PIECE.w * width) - values @ PIECE.w * width
        true = angle[:, None] + width[:, None] * (values @ PIECE.A.T)
        found = grid.A @ np.broadcast_to(np.asarray(shape.function(grid.s)), grid.s.shape)
        off = np.linalg.norm((place(true) @ PIECE.w) @ width - place(found) @ grid.w)
    if not np.isfinite(off):
        return np.inf
    return float(off) if off > ROUNDING * max(1.0, float(np.abs(true).max())) else 0.0


def _pieces(shape: Shape, paces: Paces, grid: Grid) -> tuple[Array, Array]:
    """Lower ends and widths of pieces on which nothing is missed, as far as so many can do."""
    ends = np.unique([*grid.breaks, *shape.breaks, *paces.turns])
    ends = ends[(ends >= 0.0) & (ends <= 1.0)]
    count = _count(ends, paces)
    if count.sum() > MOST_PIECES:
        count = np.maximum(np.floor(count * (MOST_PIECES / count.sum())), 1.0)
    parts = [np.linspace(a, b, int(n) + 1) for a, b, n in zip(ends[:-1], ends[1:], count, strict=True)]
    return np.concatenate([part[:-1] for part in parts]), np.concatenate([np.diff(part) for part in parts])


def _count(ends: Array, paces: Paces) -> Array:
    longest = np.array([paces.longest(a, b) for a, b in pairwise(ends.tolist())])
    return np.asarray(np.maximum(np.ceil(np.diff(ends) / (STEPS * longest)), 1.0))


def met(curvature: Curvature, grid: Grid, scales: Scales, *, si: bool, where: str = "curvature") -> Curvature:
    """Return an initial curvature with element ends where it changes fast, if the grid misses something of it.

    Parameters
    ----------
    curvature, grid, scales, si, where
        As in `initial_shape`; where the number of nodes is open, a text that many nodes follow is left as it is.

    Returns
    -------
    number, text, function, Shape or nodal values
        As it was given, or a Shape in the user's units.
    """
    if not isinstance(curvature, (str, Shape)):
        return curvature
    shape, broken = initial_shape(curvature, grid, scales, si=si, where=where)
    room = MOST_ELEMENTS - broken.elements
    nodes = min(FOLLOWED, LARGEST_SIZE // broken.elements) if broken.nodes == "auto" else broken.per_element
    if shape.paces is None or room <= 0 or missed(shape, broken.with_nodes(nodes)) <= FINE:
        return curvature
    paces = shape.paces(1.0)
    # Elements would not help where not even arithmetic on the formula comes to an end.
    if paces.hidden:
        return curvature
    ends = [end for end in paces.changes(room) if 0.0 < end < 1.0]
    user = shape.scaled(1.0 / scales.length, 1.0 / (scales.length * (scales.time if where != "curvature" else 1.0)), "")
    breaks = tuple(sorted({*user.breaks, *(end * scales.length for end in ends)}))
    return replace(user, breaks=breaks, words=shape.words)


def missing(shape: Shape, off: float, allowed: float, length: float, where: str = "curvature") -> tuple[str, ...]:
    """Return what is to be told of a shape of which the nodes miss something.

    Parameters
    ----------
    shape : Shape
        A dimensionless shape.
    off : float
        What the grid has `missed`.
    allowed : float
        What need not be spoken of.
    length : float
        Length of the rod, in the user's units.
    where : str
        The argument.

    Returns
    -------
    tuple of str
        One sentence or none.
    """
    if shape.paces is None or off <= allowed:
        return ()
    paces = shape.paces(1.0)
    # The middle of the stretch about the fastest piece that is fast throughout.
    at = int(np.argmin(paces.steps))
    slow = np.flatnonzero(paces.steps > FAST * paces.steps[at])
    first = int(slow[slow < at].max(initial=-1)) + 1
    last = int(slow[slow > at].min(initial=paces.steps.size))
    by = f"by {off:.1g} L" if np.isfinite(off) else "by any amount"
    place = f"{0.5 * (paces.edges[first] + paces.edges[last]) * length:.6g}"
    return (
        f"{where}: too narrow in places for these nodes, which put the initial free end off {by}; it changes fastest "
        f'near s = {place}; take nodes = "auto", or put breaks on both sides of that',
    )


def unbounded(shape: Shape, length: float, where: str = "curvature") -> tuple[str, ...]:
    """Return what is to be told of a shape that may have features which cannot be bounded; see `missing`."""
    if shape.paces is None:
        return ()
    paces = shape.paces(1.0)
    ends = np.unique([*shape.breaks, *paces.turns, 0.0, 1.0])
    spans = paces.hidden or (((0.0, 1.0),) if _count(ends, paces).sum() > MOST_PIECES else ())
    if not spans:
        return ()
    first, last = (f"{s * length:.6g}" for s in (spans[0][0], spans[-1][1]))
    return (
        f"{where}: a feature too narrow to be followed may be overlooked between s = {first} and {last}, where the "
        "text changes too fast to be bounded",
    )
