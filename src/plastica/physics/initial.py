"""The shape a rod starts from: number, text in s, pieces, function or nodal values, brought onto a grid."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from plastica.errors import ArgumentError, shown
from plastica.material.expression import Expression, breakpoints, parse
from plastica.numerics.grid import Grid
from plastica.physics.amounts import plain
from plastica.physics.scales import Scales
from plastica.units import looks_like_quantity, quantity

if TYPE_CHECKING:
    from plastica.physics.pace import Paces

__all__ = [
    "Curvature",
    "NaturalCurvature",
    "Shape",
    "initial_natural_curvature",
    "initial_shape",
    "nodal_values",
    "piecewise",
    "shape_of",
]

Array = NDArray[np.float64]

LARGEST_CURVATURE = 1e6
"""In units of 1/L: a rod that turns 160 000 times is a mistake of units."""


@dataclass(frozen=True)
class Shape:
    """A curvature as a function of arc length, with the places where it jumps or has a kink.

    Attributes
    ----------
    function : callable
        Arc length (m, or units of L) to curvature (1/m, or 1/L); takes and returns arrays.
    breaks : tuple of float
        Arc lengths at which an element must end for spectral accuracy.
    words : str
        What it is, for people.
    paces : callable, optional
        How fast it changes on [0, length], a function of that length; None where only samples could tell.
    """

    function: Callable[[Array], ArrayLike]
    breaks: tuple[float, ...] = ()
    words: str = "a function of s"
    paces: Callable[[float], Paces] | None = field(default=None, repr=False, compare=False)

    def times(self, factor: float) -> Shape:
        """Return the shape with its curvature multiplied by a number."""
        return self.scaled(1.0, factor, f"{factor:g} times ({self.words})")

    def scaled(self, along: float, factor: float, words: str) -> Shape:
        """Return the shape that is `factor` times this one at `along` times its arc length."""
        function, paces = self.function, self.paces
        return Shape(
            lambda s: factor * np.asarray(function(s * along), dtype=float),
            tuple(b / along for b in self.breaks),
            words,
            None if paces is None else lambda length: paces(length * along).scaled(1.0 / along),
        )


Curvature = float | str | Shape | Callable[[Array], ArrayLike] | Sequence[float] | Array
"""What may be given as an initial curvature."""


def piecewise(breaks: Sequence[float], pieces: Sequence[float | str]) -> Shape:
    """Return the shape that is pieces[i] between breaks[i-1] and breaks[i].

    Parameters
    ----------
    breaks : sequence of float
        Where one piece ends and the next begins, increasing, strictly inside the rod.
    pieces : sequence of float or str
        One more than breaks: numbers or texts in s.

    Returns
    -------
    Shape

    Raises
    ------
    ArgumentError
        Where the counts do not fit, the breaks do not increase or a piece cannot be read.

    Examples
    --------
    >>> shape = piecewise([0.5], [2.0, "-s"])
    """
    ends = tuple(_number(b, "breaks") for b in breaks)
    if any(b <= a for a, b in pairwise(ends)):
        raise ArgumentError("must increase", where="breaks", value=ends)
    if len(pieces) != len(ends) + 1:
        raise ArgumentError(f"must be one more than the {len(ends)} breaks", where="pieces", value=len(pieces))
    shapes = [_shape(piece, f"pieces[{i}]") for i, piece in enumerate(pieces)]

    def function(s: Array) -> Array:
        index = np.searchsorted(np.asarray(ends), s, side="right")
        out = np.empty(np.shape(s))
        for i, shape in enumerate(shapes):
            out[index == i] = np.broadcast_to(shape.function(s), np.shape(s))[index == i]
        return out

    lower, upper = (-np.inf, *ends), (*ends, np.inf)
    inner = tuple(b for lo, hi, shape in zip(lower, upper, shapes, strict=True) for b in shape.breaks if lo < b < hi)
    words = "; ".join(shape.words for shape in shapes)
    return Shape(function, tuple(sorted({*ends, *inner})), f"in pieces: {words}", _paces_in_pieces(ends, shapes))


def _paces_in_pieces(ends: Sequence[float], shapes: Sequence[Shape]) -> Callable[[float], Paces] | None:
    """How fast a shape in pieces changes; None where that is not known of each of them."""
    each = [shape.paces for shape in shapes if shape.paces is not None]
    if len(each) < len(shapes):
        return None

    def paces(length: float) -> Paces:
        from plastica.physics.pace import joined

        edges = [0.0, *(end for end in ends if 0.0 < end < length), length]
        first = sum(end <= 0.0 for end in ends)
        parts = zip(each[first:], pairwise(edges), strict=False)
        return joined([piece(length).between(a, b) for piece, (a, b) in parts])

    return paces


def _constant(value: float, words: str) -> Shape:
    def paces(length: float) -> Paces:
        from plastica.physics.pace import Paces

        return Paces(np.array([0.0, length]), np.array([np.inf]), ())

    return Shape(lambda s: np.full(np.shape(s), value), (), words, paces)


def _number(value: object, where: str) -> float:
    number = plain(value)
    if not isinstance(number, float):
        raise ArgumentError("must be a number", where=where, value=value)
    if not np.isfinite(number):
        raise ArgumentError("must be finite", where=where, value=value)
    return number


def _shape(value: object, where: str, length: float | None = None, unit: str = "1/m") -> Shape:
    """Read a number, a text or a function as a shape, in the user's units; `length` is that of the rod if known."""
    if isinstance(value, Shape):
        return value
    if isinstance(value, str):
        if looks_like_quantity(value):
            constant = quantity(value, unit, where=where, bare=False)
            return _constant(constant, value)
        return _text(value, where, length)
    if callable(value):
        return Shape(value)
    constant = _number(value, where)
    return _constant(constant, f"{constant:g}")


@lru_cache(maxsize=256)
def _text(text: str, where: str, length: float | None) -> Shape:
    """Read a text once: sweeps and continued runs start from the same few."""
    return shape_of(parse(text, variable="s", allow_step=True, where=where), {}, length)


def shape_of(expression: Expression, values: Mapping[str, float], length: float | None) -> Shape:
    """Return the shape that an expression in s is, at values of its parameters; `length` is the rod's, if known."""
    found = breakpoints(expression, values, None if length is None else (0.0, length))

    @lru_cache(maxsize=2)
    def paces(until: float) -> Paces:
        from plastica.physics.pace import paces_of

        breaks = [point.position for point in breakpoints(expression, values, (0.0, until))]
        return paces_of(expression.tree, "s", values, breaks, until, 1.0)

    breaks = tuple(point.position for point in found)
    return Shape(expression.vector(dict(values)), breaks, expression.text, paces)


def initial_shape(
    curvature: Curvature, grid: Grid, scales: Scales, *, si: bool, where: str = "curvature"
) -> tuple[Shape, Grid]:
    """Return the initial curvature as a dimensionless shape, and the grid with element ends at its breaks.

    Raises
    ------
    ArgumentError
        Where the text or function cannot be used, or text has units but the model has no specimen.
    """
    unit, time = ("1/m", 1.0) if where == "curvature" else ("1/(m*s)", scales.time)
    if isinstance(curvature, str) and not si and looks_like_quantity(curvature):
        raise ArgumentError(
            "must be a plain number or text in s where there is no specimen",
            where=where,
            value=curvature,
            next_step="Give the model a pl.Specimen to use units.",
        )
    if isinstance(curvature, (list, tuple, np.ndarray)) and np.ndim(curvature) > 0:
        return _nodal(np.asarray(curvature), grid, scales.length * time, where), grid
    shape = _shape(curvature, where, scales.length, unit)
    length, factor = scales.length, scales.length * time
    scaled = shape.scaled(length, 1.0, shape.words)
    breaks = tuple(b for b in scaled.breaks if 0.0 < b < 1.0)

    def function(s: Array) -> Array:
        try:
            values = np.asarray(scaled.function(s), dtype=float)
        except (TypeError, ValueError, ArithmeticError) as error:
            raise ArgumentError(
                f"must take an array of arc lengths and return their curvatures ({error})", where=where
            ) from None
        return np.asarray(np.broadcast_to(values, np.shape(s)) * factor)

    return Shape(function, breaks, shape.words, scaled.paces), grid.with_breaks(breaks)


def _nodal(values: NDArray[np.generic], grid: Grid, factor: float, where: str) -> Shape:
    """Values at the nodes of `grid`, as the polynomials through them."""
    hint = "Nodal values belong to one grid; give text or a function to leave the grid open."
    if grid.nodes == "auto" or values.shape != (grid.size,):
        size = "a fixed number of" if grid.nodes == "auto" else str(grid.size)
        raise ArgumentError(
            f"must have one value for each of {size} nodes",
            where=where,
            value=values.shape,
            next_step=hint,
        )
    nodal = values.astype(float) * factor

    def function(s: Array) -> Array:
        if np.array_equal(s, grid.s):
            return nodal
        return np.asarray(grid.interpolation(np.ravel(s)) @ nodal).reshape(np.shape(s))

    return Shape(function, grid.breaks[1:-1], "values at the nodes")


def nodal_values(shape: Shape, grid: Grid, where: str = "curvature") -> Array:
    """Return a dimensionless shape at the nodes, checked.

    Raises
    ------
    ArgumentError
        Where a value is not finite or absurdly large.
    """
    values = np.array(shape.function(grid.s), dtype=float)
    if not np.isfinite(values).all():
        at = float(grid.s[~np.isfinite(values)][0])
        raise ArgumentError(
            f"must be finite along the rod, but is not at s = {at:.6g} L ({shown(shape.words)})",
            where=where,
        )
    if np.abs(values).max() > LARGEST_CURVATURE:
        raise ArgumentError(
            f"must stay below {LARGEST_CURVATURE:g} / L",
            where=where,
            value=float(np.abs(values).max()),
            next_step="Check its unit.",
        )
    return values


NaturalCurvature = float | str | Sequence[float | str] | Array
"""What may be given as an initial natural curvature: a number or text with a unit, or one for each segment."""


def initial_natural_curvature(
    value: NaturalCurvature, scales: Scales, *, si: bool, segments: int = 1
) -> float | Array:
    """Return the initial natural curvature, dimensionless: a number, or one for each of several segments.

    Raises
    ------
    ArgumentError
        Where it is no finite number, has a unit while the model has no specimen, or there are not as many numbers as
        segments.
    """
    where = "natural_curvature"
    given = plain(value)
    if isinstance(given, (list, tuple, np.ndarray)):
        if np.ndim(given) != 1 or len(given) != segments:
            due = f", or one for each of {segments} segments" if segments > 1 else " for a rod of one segment"
            raise ArgumentError(
                f"must be one number{due}",
                where=where,
                value=value,
                next_step="Give as many numbers as there are `natural_segments`.",
            )
        each = [_natural(one, f"{where}[{i}]", scales, si=si) for i, one in enumerate(given)]
        return each[0] if segments == 1 else np.array(each)
    one = _natural(given, where, scales, si=si)
    return one if segments == 1 else np.full(segments, one)


def _natural(value: object, where: str, scales: Scales, *, si: bool) -> float:
    if isinstance(value, str):
        if not si:
            raise ArgumentError("must be a number where there is no specimen", where=where, value=value)
        number = quantity(value, "1/m", where=where, bare=False)
    else:
        number = _number(value, where)
    if abs(number * scales.length) > LARGEST_CURVATURE:
        raise ArgumentError(f"must stay below {LARGEST_CURVATURE:g} / L", where=where, value=value)
    return number * scales.length
