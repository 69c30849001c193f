"""Whether yielding struts certainly follow their curves of equilibria up to |D| = Theta, without passing it.

With G = side D - Theta on the curve, y the distance of the state from the static shape of its natural curvature, g a
bound of the contraction towards it (`equilibria.contraction`) and S >= |d mu_E/d mu_nat|,

    y' <= -g y + S f(G + y),        -G' <= r f(G + y).

So y <= e G, once true, stays true for ever wherever f(x)/x < g e/((1 + e) (S + e r)) for 0 < x <= (1 + e) max G: the
drive then exceeds the threshold all the way, and the natural curvature goes monotonically to the root of G. It needs
no more than that f(x)/x falls to 0 with x, as it does for every admissible flow.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from plastica.equilibria.apart import ends_apart, product_apart
from plastica.equilibria.contraction import adjoint_integral, contraction, integral_norm, steepest
from plastica.equilibria.elastica import profile
from plastica.equilibria.way import Start, rates
from plastica.numerics.grid import Grid

__all__ = ["follows_the_curve"]

Array = NDArray[np.float64]
Truths = NDArray[np.bool_]

SHARES: Final = (0.1, 0.3, 0.6, 0.9)
"""The numbers e that are tried."""

TUBES: Final = 17
"""Places about which a long way is looked at."""

PLACES: Final = 9
"""Places on the way at which slope and size of G are looked at."""

SURELY: Final = 1.1
"""Factor by which these may be larger between the places."""

EXCESSES: Final = np.concatenate([10.0 ** np.arange(-12.0, -1.0), np.linspace(0.1, 1.0, 19)])
"""Where f(x)/x is looked at, in units of the largest x."""


def follows_the_curve(start: Start, root: Array, shape: Array, away: Array, grid: Grid) -> Truths:
    """Tell which yielding members certainly creep along the curve to the root that comes first on their way.

    Parameters
    ----------
    start : Start
        Where the members are on their curves.
    root : ndarray, shape (members,)
        Clamp curvature at the first root of G on their way.
    shape : ndarray, shape (members, n)
        Curvature of the static shapes of their present natural curvatures.
    away : ndarray, shape (members,)
        Distances of the states from these, y.
    grid : Grid
        Where the curvature is kept.
    """
    way = _on_the_way(start, root)
    now = start.gap(*_arm_and_natural(start, start.alpha))
    theta = product_apart(shape, grid.A.T)
    fastest = _speed(grid, start.gamma, theta)
    # As if the contraction were as fast as it can be, and the static shape nowhere faster than here.
    hopeful = np.flatnonzero(_stays(start, way, now, away, np.ones(away.size), fastest))
    sure = np.zeros(away.size, dtype=bool)
    if hopeful.size:
        start, way, now, away = start.of(hopeful), way.of(hopeful), now[hopeful], away[hopeful]
        g, speed = _tube(grid, start, way, theta[hopeful], fastest[hopeful], way.length)
        sure[hopeful] = _stays(start, way, now, away, g, speed)
        for i in np.flatnonzero(~sure[hopeful]):
            one = np.array([i])
            g, speed = _along(grid, start.of(one), way.of(one), root[hopeful[one]])
            sure[hopeful[i]] = _stays(start.of(one), way.of(one), now[one], away[one], g, speed)[0]
    return sure


@dataclass(frozen=True, eq=False)
class _Way:
    """Bounds of G and r between members' places on the curve and their roots, and how far mu_nat has to go."""

    largest: Array
    falls: Array
    length: Array

    def of(self, some: NDArray[np.intp]) -> _Way:
        return _Way(self.largest[some], self.falls[some], self.length[some])


def _stays(start: Start, way: _Way, now: Array, away: Array, g: Array, fastest: Array) -> Truths:
    """Whether y <= e G now and ever after, for one of the shares e."""
    sure = np.zeros(away.size, dtype=bool)
    with np.errstate(all="ignore"):
        for share in SHARES:
            bound = g * share / ((1.0 + share) * (fastest + share * way.falls))
            sure |= (g > 0.0) & (away < share * now) & (_secant(start, (1.0 + share) * way.largest) < bound)
    return sure


def _tube(grid: Grid, start: Start, way: _Way, theta: Array, speed: Array, length: Array) -> tuple[Array, Array]:
    """Bounds of g and of |d mu_E/d mu_nat| where mu_nat goes by `length` from a shape, nan where there are none."""
    bend = start.gamma * integral_norm(grid) ** 2
    with np.errstate(all="ignore"):
        reach = 2.0 * speed * length + way.largest
        reach = np.where(np.isfinite(reach), reach, np.inf)
        g = contraction(grid, start.gamma[:, None], steepest(theta, np.sqrt(grid.s) * reach[:, None]))
        # d mu_E/d mu_nat = H^-1 1 changes by H^-1 (dH) H^-1 1, and |dH| is at most `bend` times its own norm.
        grown = speed / (1.0 - bend * speed * length / g)
        fastest = np.where(grown > 0.0, np.minimum(grown, 1.0 / g), 1.0 / g)
        good = (g > 0.0) & (fastest <= 2.0 * speed)
    return np.where(good, g, np.nan), np.where(good, fastest, np.nan)


def _along(grid: Grid, start: Start, way: _Way, root: Array) -> tuple[Array, Array]:
    """The same for one member whose way is long: in tubes about the shapes at places of it."""
    places = start.alpha + (root - start.alpha) * np.linspace(0.0, 1.0, TUBES)
    gamma = np.full(TUBES, start.gamma[0])
    along = profile(gamma[:, None], places[:, None], grid.s)
    gaps = np.abs(np.diff(np.asarray(ends_apart(gamma, places).mu_nat)))
    length = np.maximum(np.append(gaps, 0.0), np.append(0.0, gaps))
    every = np.zeros(TUBES, dtype=np.intp)
    theta = np.asarray(along.phi)
    speed = _speed(grid, gamma, theta)
    g, fastest = _tube(grid, start.of(every), way.of(every), theta, speed, length)
    return np.array([g.min()]), np.array([fastest.max()])


def _arm_and_natural(start: Start, alpha: Array) -> tuple[Array, Array]:
    end = ends_apart(start.gamma, alpha)
    return np.asarray(end.arm), np.asarray(end.mu_nat)


def _on_the_way(start: Start, root: Array) -> _Way:
    largest, falls, natural = np.zeros(root.size), np.zeros(root.size), []
    for share in np.linspace(0.0, 1.0, PLACES):
        end = ends_apart(start.gamma, start.alpha + share * (root - start.alpha))
        mu_nat = np.asarray(end.mu_nat)
        largest = np.maximum(largest, start.gap(np.asarray(end.arm), mu_nat))
        falls = np.maximum(falls, rates(start, end))
        natural.append(mu_nat)
    return _Way(SURELY * largest, SURELY * falls, np.abs(natural[-1] - natural[0]))


def _speed(grid: Grid, gamma: Array, theta: Array) -> Array:
    """|d mu_E/d mu_nat| = |(1 - gamma J* cos(theta) J)^-1 1|; infinite on a fold."""
    M, root = adjoint_integral(grid), np.sqrt(grid.w)
    matrix = -np.matmul(M.T, (gamma[:, None] * np.cos(theta))[:, :, None] * M)
    diagonal = np.arange(grid.size)
    matrix[:, diagonal, diagonal] += 1.0
    values, vectors = np.linalg.eigh(matrix)
    along = (vectors * root[:, None]).sum(axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(np.sqrt(((along / values) ** 2).sum(axis=1)))


def _secant(start: Start, largest: Array) -> Array:
    """Bound f(x)/x for 0 < x <= largest, with the largest value of f up to x in the place of f(x)."""
    x = largest[:, None] * EXCESSES
    with np.errstate(all="ignore"):
        slopes = np.maximum.accumulate(start.laws.at("flow", x), axis=1) / x
    return np.asarray(np.where(np.isfinite(slopes), slopes, np.inf).max(axis=1))
