"""The limiting equilibria |D| = Theta in the (gamma, alpha) plane, and the folds: curves, and what lies on them."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from plastica.charts.contours import Critical, Polyline, critical_points, zero_curves
from plastica.charts.gap import gap
from plastica.equilibria.elastica import ends
from plastica.equilibria.oscillation import unstable_count
from plastica.material.material import Laws

__all__ = ["Component", "FoldLine", "Place", "crossings", "fold_lines", "limiting_components", "tracing_grid"]

Array = NDArray[np.float64]

LAYER = 0.25
"""Share of the tracing grid that is laid into the layers at the separatrix alpha^2 = 4 gamma."""

ON_CURVE = 1e-10
"""|f| at a point of the zero curve of f."""


@dataclass(frozen=True)
class Place:
    """A point of the (gamma, alpha) plane with its natural curvature, and in words what it is."""

    gamma: float
    alpha: float
    mu_nat: float
    words: str


@dataclass(frozen=True, eq=False)
class Component:
    """A connected piece, within the window, of the set of limiting equilibria, |D| = Theta.

    Attributes
    ----------
    kind : str
        "closed" (a loop) or "open" (it leaves the window, or ends at gamma = 0).
    side : int
        1 where D = Theta, -1 where D = -Theta; one component has one side, since Theta > 0.
    gamma, alpha, mu_nat : ndarray, shape (n,)
        Its points in order; the first is not repeated in a loop.
    unstable : ndarray of int, shape (n,)
        Unstable directions at frozen natural curvature; -1 at a fold.
    rate : ndarray, shape (n,)
        r of the approach dx/dt = -r f(x), x = |D| - Theta, along the curve of equilibria. A point is a limit of nearby
        motions where r > 0 and nothing is unstable.
    ends : tuple of Place
        The two ends of an open component.
    tangencies : tuple of Place
        Double roots in alpha, at which two limiting equilibria appear or vanish as the thrust grows.
    folds : tuple of Place
        Where it meets a fold, dmu_nat/dalpha = 0: there the rate changes sign through infinity, and its picture in the
        (gamma, mu_nat) plane touches that of the fold.
    resolved : bool
        Whether each of these points is known to rounding, and none was found twice, as where the curve is too narrow
        for the grid.
    """

    kind: str
    side: int
    gamma: Array
    alpha: Array
    mu_nat: Array
    unstable: NDArray[np.int64]
    rate: Array
    ends: tuple[Place, ...]
    tangencies: tuple[Place, ...]
    folds: tuple[Place, ...]
    resolved: bool

    @property
    def attracting(self) -> NDArray[np.bool_]:
        """Where its points are limits of nearby motions."""
        return np.asarray((self.rate > 0.0) & (self.unstable == 0))

    def __str__(self) -> str:
        sign = "+" if self.side > 0 else "-"
        words = (
            f"D = {sign}Theta, {self.kind}: gamma in [{self.gamma.min():.6g}, {self.gamma.max():.6g}], alpha in "
            f"[{self.alpha.min():.6g}, {self.alpha.max():.6g}]"
        )
        parts = [_listed("ends", self.ends), _listed("tangencies", self.tangencies), _listed("meets folds", self.folds)]
        return "; ".join([words, *(part for part in parts if part)])


@dataclass(frozen=True, eq=False)
class FoldLine:
    """A curve of folds, theta_0'(1) = dmu_nat/dalpha = 0.

    Attributes
    ----------
    gamma, alpha, mu_nat : ndarray, shape (n,)
        Its points in order.
    closed : bool
        Whether it is a loop.
    cusps : tuple of Place
        Where it turns back in the (gamma, mu_nat) plane: d^2 mu_nat/dalpha^2 = 0 too; the first is the straight rod
        under Euler's load.
    """

    gamma: Array
    alpha: Array
    mu_nat: Array
    closed: bool
    cusps: tuple[Place, ...]


def limiting_components(laws: Laws, gamma: Array, alpha: Array) -> tuple[Component, ...]:
    """Trace all components of |D| = Theta, longest first.

    Parameters
    ----------
    laws : Laws
        Dimensionless laws.
    gamma, alpha : ndarray, shape (n, m)
        The grid to trace on: see `tracing_grid`.

    Returns
    -------
    tuple of Component
    """
    end = ends(gamma, alpha)
    drive, threshold = end.arm - laws.preference.slope(end.mu_nat), laws.threshold.value(end.mu_nat)
    out: list[Component] = []
    for side in (1, -1):

        def value(g: Array, a: Array, side: int = side) -> Array:
            end = ends(g, a)
            drive = np.asarray(end.arm - laws.preference.slope(end.mu_nat))
            return np.asarray(side * drive - laws.threshold.value(end.mu_nat))

        def slope(g: Array, a: Array, side: int = side) -> Array:
            return gap(g, a, side, laws).by_alpha

        curves = zero_curves(value, gamma, alpha, side * drive - threshold, _edge)
        double, met = critical_points(value, slope, curves), critical_points(value, _fold, curves)
        for i, curve in enumerate(curves):
            here, met_here = [p for p in double if p.curve == i], [p for p in met if p.curve == i]
            tangencies = tuple(_tangency(p.x, p.y, side, laws) for p in here)
            folds = tuple(_place(p.x, p.y, "meets a fold") for p in met_here)
            whole = _with_points(curve, [*here, *met_here], value)
            out.append(_component(whole, side, laws, (tangencies, folds), _sound(here) and _sound(met_here)))
    return tuple(sorted(out, key=lambda c: (-c.gamma.size, -c.side, -float(c.alpha.mean()))))


def crossings(components: tuple[Component, ...], gamma: float) -> int:
    """Count the limiting equilibria of one thrust on the traced curves.

    Parameters
    ----------
    components : tuple of Component
        The curves.
    gamma : float
        A thrust that is none of their vertices'.

    Returns
    -------
    int
    """
    count = 0
    for c in components:
        above = (np.append(c.gamma, c.gamma[:1]) if c.kind == "closed" else c.gamma) > gamma
        count += int(np.count_nonzero(above[1:] != above[:-1]))
    return count


def fold_lines(gamma: Array, alpha: Array) -> tuple[FoldLine, ...]:
    """Trace all curves of folds, with their cusps.

    Parameters
    ----------
    gamma, alpha : ndarray, shape (n, m)
        The grid to trace on: see `tracing_grid`.

    Returns
    -------
    tuple of FoldLine
    """
    curves = zero_curves(_fold, gamma, alpha, edge=_edge)
    turns = critical_points(_fold, _fold_slope, curves)
    out = []
    for i, curve in enumerate(curves):
        here = [p for p in turns if p.curve == i]
        cusps = tuple(_place(p.x, p.y, "cusp") for p in here)
        whole = _with_points(curve, here, _fold)
        out.append(FoldLine(whole.x, whole.y, ends(whole.x, whole.y).mu_nat, whole.closed, cusps))
    return tuple(sorted(out, key=lambda line: (float(line.gamma.min()), float(line.alpha.min()))))


def tracing_grid(gamma: tuple[float, float], alpha: tuple[float, float], shape: tuple[int, int]) -> tuple[Array, Array]:
    """Lay a grid over a window that is dense at the separatrix, where |alpha| - 2 w ~ 8 w exp(-2 w), w^2 = gamma.

    Everything varies there from the librating to the rotating rods, within a width that an even grid would miss.

    Parameters
    ----------
    gamma, alpha : tuple of (float, float)
        The window.
    shape : tuple of (int, int)
        Number of thrusts, and of clamp curvatures for each.

    Returns
    -------
    gamma, alpha : ndarray, shape `shape`
        Every column of constant gamma begins and ends on the border of the window.
    """
    g = np.linspace(math.sqrt(gamma[0]), math.sqrt(gamma[1]), shape[0]) ** 2
    g[0], g[-1] = gamma
    low, high = alpha
    share = np.linspace(0.0, 1.0, shape[1])
    out = np.empty(shape)
    for i, root in enumerate(np.sqrt(g)):
        layer = max(4.0 * root * math.exp(-2.0 * root), 1e-9)
        heads = [a for a in (-2.0 * root, 2.0 * root) if low < a < high]
        near = np.concatenate([np.linspace(low, high, 65), *(a + layer * np.sinh(_SPREAD) for a in heads)])
        place = np.unique(np.clip(near, low, high))
        # gentle rods have no layer; points that moved with it would shear the cells
        share_here = LAYER * root**4 / (16.0 + root**4)
        count = (place - low) / (high - low) * (1.0 - share_here * len(heads))
        for head in heads:
            bent = np.arcsinh((place - head) / layer)
            count = count + share_here * (bent - bent[0]) / (bent[-1] - bent[0])
        out[i] = np.interp(share, count, place)
        out[i, 0], out[i, -1] = low, high
    return np.broadcast_to(g[:, None], shape).copy(), out


def _edge(g0: Array, a0: Array, g1: Array, a1: Array, t: Array) -> tuple[Array, Array]:
    """Edges that follow the separatrix: straight in (w, alpha / w), but in (w, alpha) where a corner has no thrust."""
    w0, w1 = np.sqrt(g0), np.sqrt(g1)
    w = w0 + t * (w1 - w0)
    bare = (w0 <= 0.0) | (w1 <= 0.0)
    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = w * (a0 / w0 + t * (a1 / w1 - a0 / w0))
    # w^2 may miss the thrust of its own column by an ulp
    return np.where(g0 == g1, g0, w * w), np.where(bare | (g0 == g1), a0 + t * (a1 - a0), ratio)


_SPREAD = np.linspace(-24.0, 24.0, 193)


def _fold(gamma: Array, alpha: Array) -> Array:
    return np.asarray(ends(gamma, alpha).theta0_slope)


def _fold_slope(gamma: Array, alpha: Array) -> Array:
    """d/dalpha of theta_0'(1), by the central difference of fourth order."""
    h = 1e-3
    near, far = (_fold(gamma, alpha + k * h) - _fold(gamma, alpha - k * h) for k in (1, 2))
    return np.asarray((8.0 * near - far) / (12.0 * h))


def _with_points(curve: Polyline, points: list[Critical], f: Callable[[Array, Array], Array]) -> Polyline:
    """Put critical points between the vertices they were found between, where they lie on the curve."""
    known = [p for p in points if abs(float(f(np.array(p.x), np.array(p.y)))) <= ON_CURVE]
    known.sort(key=lambda p: p.vertex)
    at = [p.vertex + 1 for p in known]
    x, y = np.insert(curve.x, at, [p.x for p in known]), np.insert(curve.y, at, [p.y for p in known])
    return Polyline(x, y, curve.closed)


def _sound(points: list[Critical]) -> bool:
    """Whether all points are known to rounding, and none is there twice."""
    places = np.array([(p.x, p.y) for p in points]).reshape(-1, 2)
    apart = np.abs(places[:, None] - places).sum(axis=-1) + np.eye(len(points))
    return all(p.exact for p in points) and bool((apart > 1e-9).all())


def _place(gamma: float, alpha: float, words: str) -> Place:
    alpha = 0.0 if abs(alpha) <= 1e-12 else alpha
    return Place(gamma, alpha, float(ends(gamma, alpha).mu_nat), words)


def _tangency(gamma: float, alpha: float, side: int, laws: Laws) -> Place:
    """Roots near it lie at dalpha^2 = -2 dgamma G_gamma / G_alphaalpha: with growing gamma two appear, or vanish."""
    h = 1e-5 * max(1.0, abs(alpha))
    after, before = (float(gap(gamma, alpha + d, side, laws).by_alpha) for d in (h, -h))
    grows = float(gap(gamma, alpha, side, laws).by_gamma) * (after - before) < 0.0
    return _place(gamma, alpha, "two appear" if grows else "two vanish")


def _component(
    curve: Polyline, side: int, laws: Laws, points: tuple[tuple[Place, ...], tuple[Place, ...]], sound: bool
) -> Component:
    g, a = curve.x, curve.y
    end = ends(g, a)
    stiff = 1.0 + laws.preference.second(end.mu_nat) + side * laws.threshold.slope(end.mu_nat)
    with np.errstate(divide="ignore"):
        rate = np.asarray(stiff - end.theta0 / end.theta0_slope)
    tips = () if curve.closed else tuple(_place(float(g[i]), float(a[i]), "leaves the window") for i in (0, -1))
    tips = tuple(Place(0.0, p.alpha, p.mu_nat, "begins without thrust") if p.gamma == 0.0 else p for p in tips)
    kind = "closed" if curve.closed else "open"
    return Component(kind, side, g, a, end.mu_nat, unstable_count(g, a, end), rate, tips, *points, sound)


def _listed(what: str, places: tuple[Place, ...]) -> str:
    if not places:
        return ""
    more = f", and {len(places) - 4} more" if len(places) > 4 else ""
    points = ", ".join(f"({p.gamma:.6g}, {p.alpha:.6g}) {p.words}".replace(" meets a fold", "") for p in places[:4])
    return f"{what} {points}{more}"
