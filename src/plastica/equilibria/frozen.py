"""All clamp curvatures of equilibria with one natural curvature, for many thrusts at once."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from plastica.equilibria.elastica import LARGEST_GAMMA, ends
from plastica.equilibria.oscillation import FOLD_TOLERANCE
from plastica.errors import ArgumentError
from plastica.numerics.roots import Roots, roots_of_rows
from plastica.physics.amounts import plain

__all__ = ["LAYER", "LONGEST", "Shape", "Shapes", "frozen_alphas", "frozen_shapes", "number", "pieces_for"]

Array = NDArray[np.float64]
Rows = NDArray[np.int64]

LONGEST = 1e5
"""Clamp curvature up to which ranges are searched."""

LAYER = 700.0
"""Thrust up to which the layer at the separatrix, of relative width exp(-gamma^(1/2)), is resolved in doubles."""

DEEP = 50.0
"""Thrust above which the shapes of one natural curvature are looked for over the depth in place of alpha."""

BOTTOM = 25.0
"""Depth beyond gamma^(1/2) at which a librating, a rotating rod and the separatrix agree to exp(-50)."""

NEXT = 0.1
"""Distance from the end of a range within which the separatrix needs no cut of its own."""

PIECE = 4.0
"""Length of the pieces to begin with: beyond the separatrix everything oscillates with a period of 2 pi or more."""


def frozen_alphas(gamma: Array, natural: float) -> tuple[Roots, ...]:
    """Find all alpha with phi_alpha'(1) = natural, for many thrusts at once.

    Parameters
    ----------
    gamma : ndarray, shape (rows,)
        Thrusts.
    natural : float
        Natural curvature.

    Returns
    -------
    tuple of Roots
        One for each thrust.

    Raises
    ------
    ArgumentError
        Where the natural curvature or a thrust is too large for all to be told apart.
    """
    if gamma.max() > LAYER:
        raise ArgumentError(
            f"must be at most {LAYER:g} where all equilibria of one natural curvature are asked for",
            where="gamma",
            value=float(gamma.max()),
            next_step="Next to the separatrix they are closer together than doubles can tell.",
        )
    farthest = np.hypot(natural, 2.0 * np.sqrt(gamma)) * (1.0 + 1e-9) + 1e-3
    if farthest.max() > LONGEST:
        raise ArgumentError(f"must be at most {LONGEST:g} in size", where="natural_curvature", value=natural)

    def off(x: Array, row: Rows) -> Array:
        return ends(gamma[row], x).mu_nat - natural

    def size(x: Array, row: Rows) -> Array:
        return np.abs(x) + 0.5 * gamma[row] + abs(natural)

    breaks = [_breaks(g, w) for g, w in zip(2.0 * np.sqrt(gamma), farthest, strict=True)]
    pieces = [pieces_for(2.0 * x) for x in farthest.tolist()]
    return roots_of_rows(off, -farthest, farthest, breaks=breaks, size=size, pieces=pieces)


class Shape(NamedTuple):
    """One shape of a rod with frozen natural curvature; `depth` and `multiplicity` as in `Equilibrium`."""

    alpha: float
    depth: float | None
    multiplicity: int


class Shapes(NamedTuple):
    """All of them, in ascending alpha, and whether it is certain that they are."""

    found: tuple[Shape, ...]
    complete: bool
    sentence: str


def frozen_shapes(gamma: float, natural: float) -> Shapes:
    """Find all shapes with phi_alpha'(1) = natural, and tell whether it is certain that these are all.

    Above gamma = 50 they are looked for over the depth t: alpha = +-2 gamma^(1/2) tanh(t) on librating rods and
    +-2 gamma^(1/2) / tanh(t) on rotating ones, so that m1 = 1/cosh(t)^2 has all its digits where those of alpha no
    longer tell the shapes apart: they lie exp(-2 gamma^(1/2)) from one another. What is solved there is phi'(1) -
    natural over |natural| + (phi'(1)^2 + 4 gamma m1)^(1/2), about the distance of the free end from the upright rest
    point in the plane of angle and curvature, relative to which phi'(1) is known to gamma^(1/2) eps.

    Parameters
    ----------
    gamma, natural : float
        Thrust in [0, 1e5], and natural curvature.

    Returns
    -------
    Shapes

    Raises
    ------
    ArgumentError
        Where one of them is too large.
    """
    if gamma > LARGEST_GAMMA:
        raise ArgumentError(f"must lie in [0, {LARGEST_GAMMA:g}]", where="gamma", value=gamma)
    if gamma <= DEEP:
        (found,) = frozen_alphas(np.array([gamma]), natural)
        shapes = [Shape(root.x, None, root.multiplicity) for root in found.points]
        return _told(shapes, [found])
    if abs(natural) > LONGEST:
        raise ArgumentError(f"must be at most {LONGEST:g} in size", where="natural_curvature", value=natural)
    shapes, searches = _by_depth(gamma, natural)
    told = _told(sorted(shapes, key=_place), searches)
    bottom = math.sqrt(gamma) + BOTTOM - 1.0
    if any(shape.depth is not None and abs(shape.depth) > bottom for shape in told.found):
        return told._replace(complete=False, sentence="A shape is the separatrix, as far as doubles can tell.")
    return told


def _place(shape: Shape) -> tuple[float, float]:
    """Order shapes by alpha, and by their distance from the separatrix where the alphas are one double."""
    outward = 0.0 if shape.depth is None else shape.depth if shape.depth > 0.0 else 1e3 + shape.depth + 1e3
    return shape.alpha, math.copysign(outward, shape.alpha)


def _told(shapes: list[Shape], searches: list[Roots]) -> Shapes:
    several = [shape for shape in shapes if shape.multiplicity > 1]
    missed = [found.sentence for found in searches if not found.complete]
    words = "These are all shapes of the rod with this natural curvature."
    if several:
        places = ", ".join(f"{shape.alpha:.10g}" for shape in several)
        words = f"Near a fold at alpha = {places} doubles cannot tell whether shapes are several, one or none."
    return Shapes(tuple(shapes), not several and not missed, " ".join([words, *missed]) if not missed else missed[0])


def _by_depth(gamma: float, natural: float) -> tuple[list[Shape], list[Roots]]:
    """Look at librating rods of either sign of alpha, and at rotating ones of the sign of the natural curvature."""
    root = math.sqrt(gamma)
    bottom = root + BOTTOM
    # rotating rods have alpha^2 - 4 gamma <= natural^2: tanh(t) = 2 gamma^(1/2) / alpha
    top = math.asinh(2.0 * root / abs(natural)) * (1.0 - 1e-9) if natural != 0.0 else math.inf
    sign, turn = np.array([1.0, -1.0, math.copysign(1.0, natural)]), np.array([1.0, 1.0, -1.0])
    low, high = np.array([0.0, 0.0, top]), np.array([bottom, bottom, bottom])
    rows = 3 if top < bottom else 2

    def off(t: Array, row: Rows) -> Array:
        mu = ends(gamma, sign[row], turn[row] * t).mu_nat
        # phi'^2 + 4 gamma cos(phi/2)^2 is 2 phi'^2 plus 4 gamma m1 or, on rotating rods, minus as much as half of it
        near = np.where(turn[row] > 0.0, 2.0 * root / np.cosh(t), 0.0)
        return (mu - natural) / (abs(natural) + np.hypot(mu, near))

    def size(t: Array, _row: Rows) -> Array:
        return np.full(t.shape, 1.0 + root)

    found = roots_of_rows(off, low[:rows], high[:rows], size=size, pieces=16)
    shapes = []
    for row, each in enumerate(found):
        for point in each.points:
            part = math.tanh(point.x)
            alpha = sign[row] * 2.0 * root * (part if turn[row] > 0.0 else 1.0 / part)
            if point.x > 0.0:
                shapes.append(Shape(float(alpha), float(turn[row] * point.x), point.multiplicity))
            elif row == 0:
                # the straight rod, where theta_0'(1) = cos(gamma^(1/2)); at a fold three shapes meet
                shapes.append(Shape(0.0, 0.0, 3 if abs(math.cos(root)) <= FOLD_TOLERANCE else 1))
    return shapes, list(found)


def _breaks(separatrix: float, farthest: float) -> tuple[float, ...]:
    """Cut at 0, and at the separatrix where it is not next to the end, which is looked at anyway."""
    return (-separatrix, 0.0, separatrix) if farthest - separatrix > NEXT else (0.0,)


def number(value: object, where: str, least: float = -math.inf) -> float:
    """Read a finite number, in the range of the closed forms.

    Raises
    ------
    ArgumentError
        If it is none, or below `least`.
    """
    read = plain(value)
    if not isinstance(read, float) or not math.isfinite(read):
        raise ArgumentError("must be a finite number", where=where, value=value)
    if read < least:
        words = "must not be negative: tension is not treated" if where == "gamma" else f"must be at least {least:g}"
        raise ArgumentError(words, where=where, value=value)
    return read


def pieces_for(length: float) -> int:
    """Return how many pieces to begin with on a range of that length."""
    return 4 + math.ceil(length / PIECE)
