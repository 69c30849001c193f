"""The curvature of a rod from scattered points of its centre line.

The points, not differences of them, are fitted, so that what scatters from point to point averages out: a curve whose
curvature is a polynomial in arc length, with a penalty on the second derivative of the curvature. The weight is that of
the greatest restricted likelihood: the points' scatter across the rod and the curvature's roughness are both taken for
normal, and the most likely ratio of the two is found (`smoothing.likeliest`).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.polynomial import Legendre
from numpy.polynomial import legendre as lg
from numpy.typing import NDArray

from plastica.study.smoothing import likeliest, thinned

__all__ = ["CentreLine", "centre_line", "coarse"]

Array = NDArray[np.float64]

DEGREE = 48
"""Degree of the curvature, where there are points enough."""

COARSE = 24
"""Points that the first guess is made from; more are averaged in groups, so that their order is that of the rod."""

MOST_POINTS = 8000
"""Points that the curve is fitted to; more are first averaged in neighbouring groups of equal size."""

FINEST = 1e-9
"""Relative to the length, the least scatter: no point is measured better."""

_NODES = 192
_DEGREES = (8, 8, 16, 24, 32, *(48,) * 8)
"""Degrees of the curvature in the rounds: what is short comes last, for the distances depend on it least linearly."""

_FREE = 4
_FARTHEST = 0.1


@dataclass(frozen=True, eq=False)
class CentreLine:
    """A curve through points.

    Attributes
    ----------
    curvature : Legendre
        Curvature times the length of the curve, over [-1, 1] from its first to its last point.
    length : float
        Its length, in the unit of the points.
    scatter : float
        Root mean square distance of the points from it, across the curve.
    error : float
        Standard error of the curvature times the length, root mean square along the curve.
    smoothing : float
        Weight of the roughness, int (curvature'')^2, beside the mean square distance; all relative to the length.
    """

    curvature: Legendre
    length: float
    scatter: float
    error: float
    smoothing: float


@dataclass(frozen=True, eq=False)
class _Curve:
    """A plane curve: length, coefficients of length * curvature, and where and how it begins."""

    length: float
    bend: Array
    start: Array
    angle: float

    def theta(self) -> Array:
        """Coefficients of the tangent angle."""
        return lg.legadd(0.5 * lg.legint(self.bend, lbnd=-1.0), [self.angle])

    def place(self) -> Array:
        """Coefficients of the two coordinates; shape (n, 2)."""
        theta = lg.legval(_U, self.theta())
        way = 0.5 * self.length * _integral(np.column_stack((np.cos(theta), np.sin(theta))))
        way[0] += self.start
        return way


_U, _W = lg.leggauss(_NODES)
_PROJECT = (lg.legvander(_U, _NODES - 32) * _W[:, None]).T * (np.arange(_NODES - 31) + 0.5)[:, None]


def _integral(values: Array) -> Array:
    """Coefficients of the integral from -1 of what has these values at the nodes."""
    return np.asarray(lg.legint(_PROJECT @ values, lbnd=-1.0, axis=0))


def coarse(x: Array, y: Array) -> tuple[Array, Array]:
    """Average neighbouring points until at most `COARSE` are left."""
    return thinned(x, y, COARSE)


def centre_line(x: Array, y: Array) -> CentreLine:
    """Fit a curve to points.

    Parameters
    ----------
    x, y : ndarray, shape (n,)
        At least 6 points, in order along the curve but for their scatter. More than `MOST_POINTS` are averaged in
        neighbouring groups first.

    Returns
    -------
    CentreLine

    Raises
    ------
    ArithmeticError
        Where no curve passes the points in their order.
    """
    points = np.column_stack(thinned(x, y, MOST_POINTS))
    curve, u = _guess(*coarse(x, y), points)
    degree = min(DEGREE, max(1, 2 * len(points) // 3 - 3))
    for most in _DEGREES:
        u, off = _feet(curve, points, u)
        curve, u = _between(curve, u, min(most, degree))
        fit = _fitted(curve, u, off)
        step = fit.bend - curve.bend
        curve = _moved(curve, fit)
        if most >= degree and float(np.sqrt(np.mean(step**2))) <= 1e-3 * fit.error:
            break
    u, off = _feet(curve, points, u)
    curve, u = _between(curve, u, degree)
    scatter = float(np.sqrt(np.mean(off**2)))
    return CentreLine(Legendre(_short(curve.bend, fit.error)), curve.length, scatter, fit.error, fit.smoothing)


def _guess(x: Array, y: Array, points: Array) -> tuple[_Curve, Array]:
    """A first curve from the angles of a few chords, and about where the points lie on it."""
    chords = np.hypot(np.diff(x), np.diff(y))
    way = np.concatenate([[0.0], np.cumsum(chords)])
    middle = (way[1:] + way[:-1]) / way[-1] - 1.0
    angle = lg.legfit(middle, np.unwrap(np.arctan2(np.diff(y), np.diff(x))), min(8, len(chords) // 2))
    start = np.array([float(x[0]), float(y[0])])
    bend = np.asarray(2.0 * lg.legder(angle), dtype=np.float64)
    curve = _Curve(float(way[-1]), bend, start, float(lg.legval(-1.0, angle)))
    # Projected on the chain of chords, the points are in the order in which they were measured.
    share = np.interp(np.linspace(0.0, 1.0, len(points)), np.linspace(0.0, 1.0, len(way)), way / way[-1])
    return curve, 2.0 * share - 1.0


def _on(curve: _Curve, u: Array) -> tuple[Array, Array]:
    """Places and tangent angles on the curve, which goes on straight beyond its ends."""
    inside = np.clip(u, -1.0, 1.0)
    angle = np.asarray(lg.legval(inside, curve.theta()), dtype=np.float64)
    way = 0.5 * curve.length * (u - inside)
    place = curve.place()
    straight = np.column_stack((way * np.cos(angle), way * np.sin(angle)))
    return lg.legvander(inside, len(place) - 1) @ place + straight, angle


def _feet(curve: _Curve, points: Array, u: Array) -> tuple[Array, Array]:
    """Where on the curve each point has its foot, and how far it is off, to the left."""
    for last in (False, False, False, True):
        place, angle = _on(curve, u)
        apart = points - place
        along = apart[:, 0] * np.cos(angle) + apart[:, 1] * np.sin(angle)
        off = apart[:, 1] * np.cos(angle) - apart[:, 0] * np.sin(angle)
        if not last:
            turn = np.maximum(1.0 - lg.legval(np.clip(u, -1.0, 1.0), curve.bend) * off / curve.length, 0.5)
            u = u + np.clip(2.0 * along / (curve.length * turn), -_FARTHEST, _FARTHEST)
    return u, off


def _between(curve: _Curve, u: Array, degree: int) -> tuple[_Curve, Array]:
    """The piece of a curve between the feet of its first and last point, and the feet on it."""
    ends = u[[0, -1]]
    first, share = float(ends[0]), 0.5 * float(ends[1] - ends[0])
    inner = np.clip(first + share * (_U + 1.0), -1.0, 1.0)
    table = lg.legvander(_U, degree)
    bend = (table * _W[:, None]).T @ (share * lg.legval(inner, curve.bend)) * (np.arange(degree + 1) + 0.5)
    start, angle = _on(curve, ends[:1])
    if not (share > 0.0 and np.isfinite(bend).all() and np.isfinite(start).all()):
        raise ArithmeticError("no curve passes the points in their order")
    return _Curve(share * curve.length, bend, start[0], float(angle[0])), (u - first) / share - 1.0


@dataclass(frozen=True, eq=False)
class _Fit:
    """New coefficients of the curvature, how the beginning moves, the weight of the roughness and the error."""

    bend: Array
    shift: Array
    turn: float
    smoothing: float
    error: float


def _fitted(curve: _Curve, u: Array, off: Array) -> _Fit:
    """Fit the distances of the points, which depend on the curve linearly where they are small."""
    count = curve.bend.size
    u = np.clip(u, -1.0, 1.0)
    theta, at = lg.legval(_U, curve.theta()), lg.legval(u, curve.theta())
    # A change of the angle turns all that follows about the place of the change.
    turns = np.column_stack((np.ones(_NODES), 0.5 * lg.legval(_U, lg.legint(np.eye(count), lbnd=-1.0)).T))
    across = np.column_stack((-np.sin(at), np.cos(at)))
    swing = np.zeros((len(u), count + 1))
    for side, here in zip((-np.sin(theta), np.cos(theta)), across.T, strict=True):
        move = 0.5 * _integral(turns * side[:, None])
        swing += here[:, None] * (lg.legvander(u, len(move) - 1) @ move)
    # The beginning moves across the curve only: along it, it would slide on itself.
    begin = np.array([-np.sin(curve.angle), np.cos(curve.angle)])
    design = np.column_stack((across @ begin, swing))
    found, variance, weight = _penalised(design, off / curve.length + swing[:, 1:] @ curve.bend)
    # The mean square of a polynomial is that of its coefficients over 2 k + 1.
    error = float(np.sqrt(variance @ (1.0 / (2.0 * np.arange(count) + 1.0))))
    return _Fit(found[2:], float(found[0]) * curve.length * begin, float(found[1]), weight, error)


def _penalised(design: Array, aim: Array) -> tuple[Array, Array, float]:
    """Least squares with the most likely penalty on the second derivative of the curvature.

    The first two columns are place and direction of the beginning, the others the coefficients of the curvature. In
    coordinates d in which the penalty is |d|^2 singular values are inverse to roots of roughness, so that what is
    smooth keeps its digits. Returned are the coefficients, the variances of those of the curvature, and the weight.
    """
    count = design.shape[1] - 2
    # d^2/dsigma^2 of a polynomial over u = 2 sigma - 1, in units in which its mean square is a sum of squares.
    second = 4.0 * lg.legder(np.eye(count), 2)[:, 2:] if count > 2 else np.zeros((0, 0))
    second = second / np.sqrt(2.0 * np.arange(len(second)) + 1.0)[:, None]
    rough = np.linalg.inv(second)
    free, other = design[:, :_FREE], design[:, _FREE:] @ rough
    basis, triangle = np.linalg.qr(free)
    back = np.linalg.inv(triangle)
    inner = other - basis @ (basis.T @ other)
    left, size, right = np.linalg.svd(inner - basis @ (basis.T @ inner), full_matrices=False)
    seen = size > 1e-15 * size.max(initial=0.0)
    left, size, right = left[:, seen], size[seen], right[seen]
    fixed = basis.T @ aim
    left_over = aim - basis @ fixed
    left_over -= basis @ (basis.T @ left_over)
    parts = left.T @ left_over
    rest = float(np.sum((left_over - left @ parts) ** 2))
    roughness = np.concatenate([np.zeros(free.shape[1]), size**-2.0])
    weight, noise = likeliest(roughness, np.append(fixed, parts), rest, len(aim), FINEST)
    shrunk = 1.0 / (size**2 + weight)
    bent = right.T @ (size * shrunk * parts)
    found = np.append(back @ (fixed - basis.T @ other @ bent), rough @ bent)
    spread = np.vstack((-(back @ basis.T @ other)[2:], rough)) @ right.T
    variance = spread**2 @ shrunk
    variance[: _FREE - 2] += (back**2).sum(axis=1)[2:]
    return found, noise * variance, weight / len(aim)


def _moved(curve: _Curve, fit: _Fit) -> _Curve:
    return _Curve(curve.length, fit.bend, curve.start + fit.shift, curve.angle + fit.turn)


def _short(bend: Array, error: float) -> Array:
    """Leave out the last coefficients, as long as that matters less than a fifth of the error."""
    squares = bend**2 / (2.0 * np.arange(bend.size) + 1.0)
    left = np.sqrt(np.append(np.cumsum(squares[::-1])[::-1], 0.0))
    allowed = max(0.2 * error, 1e-9 * float(left[0]))
    return bend[: max(int(np.argmax(left <= allowed)), 1)]
