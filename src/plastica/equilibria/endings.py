"""Where many states end, told at once: what `limits.predict_limit` says of each, without the words."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from plastica.equilibria.apart import ends_apart, product_apart
from plastica.equilibria.contraction import contracts
from plastica.equilibria.creep import follows_the_curve
from plastica.equilibria.elastica import LARGEST_GAMMA, Ends, profile
from plastica.equilibria.oscillation import unstable_count
from plastica.equilibria.settled import settle_many
from plastica.equilibria.way import ARRIVED, FARTHEST, FOLD, TANGENCY, ManyLaws, Start, first_roots, rates
from plastica.numerics.grid import Grid

__all__ = ["INTERIOR", "KINDS", "LIMITING", "UNDECIDED", "WHY", "Endings", "distance_between", "endings"]

Array = NDArray[np.float64]
Truths = NDArray[np.bool_]
Codes = NDArray[np.int8]

KINDS: Final = ("undecided", "interior", "limiting")
UNDECIDED, INTERIOR, LIMITING = range(3)

WHY: Final = (
    "its thrust or its curvature is beyond what the curve of equilibria is followed to",
    "it is too near a fold, where static shapes meet, or no static shape was found",
    "it is about to start or stop yielding, and where it ends depends on when",
    "a tangency, where it may come to rest or just pass, lies on its way",
    "a fold lies on its way, at which it will snap to another shape",
    "it keeps yielding as far as the curve of equilibria was followed",
    "it has not yet forgotten its start",
    "of several static shapes it is not yet near enough to one to be held by it",
    "",
)
"""Why it cannot be told where a member ends; the last is of those of which it can."""

BEYOND, NO_SHAPE, SWITCHING, PASSING, SNAPPING, YIELDING, REMEMBERING, LOOSE, TOLD = range(len(WHY))

NEAR_FOLD: Final = 1e-6
"""|theta_0'(1)| below which an equilibrium counts as too near a fold to predict anything from it."""

NEWTON_STEPS: Final = 20
EDGE_STEPS: Final = 6
"""Newton's steps to a root of |D| = Theta that is next to the state."""

NEARBY: Final = 1e-3
"""How far, relative to max(1, |alpha|), the clamp curvature of a shape may lie from what the grid says of it."""

ROUNDING: Final = 64.0 * float(np.finfo(float).eps)
"""Relative error of a drive, or of a distance, that rounding alone can make."""

BLURRED: Final = 8.0
"""Times the error of the drive that a state at |D| = Theta may be away from its static shape."""


@dataclass(frozen=True, eq=False)
class Endings:
    """Where states end; arrays of shape (members,), dimensionless, nan where they do not apply.

    Attributes
    ----------
    kind : ndarray of int
        Index into `KINDS`.
    why : ndarray of int
        Index into `WHY`.
    alpha : ndarray
        Clamp curvature of the equilibrium where it ends.
    mu_nat : ndarray
        Natural curvature there.
    unstable : ndarray of int
        Number of its unstable directions at frozen natural curvature, or `DEGENERATE`.
    rate : ndarray
        Limiting: r of the approach dx/dt = -r f(x), x = |D| - Theta.
    now : ndarray
        Clamp curvature of the static shape of the present natural curvature.
    away : ndarray
        Distance of the state from that shape.
    excess : ndarray
        |D| - Theta of that shape; 0 where it is limiting and this is below what is known of it.
    """

    kind: Codes
    why: Codes
    alpha: Array
    mu_nat: Array
    unstable: NDArray[np.int64]
    rate: Array
    now: Array
    away: Array
    excess: Array

    @property
    def stable(self) -> Truths:
        """Whether the end is stable: no unstable direction, and attracting along the curve where it is limiting."""
        return np.asarray((self.unstable == 0) & ((self.kind != LIMITING) | (self.rate > 0.0)))


@dataclass(frozen=True, eq=False)
class _Members:
    """Dimensionless states under constant thrusts."""

    grid: Grid
    gamma: Array
    mu: Array
    mu_nat: Array
    laws: ManyLaws

    def of(self, some: NDArray[np.intp]) -> _Members:
        return _Members(self.grid, self.gamma[some], self.mu[some], self.mu_nat[some], self.laws.of(some))

    def drive(self, mean_less_natural: Array, natural: Array) -> Array:
        return mean_less_natural - self.laws.at("preference_slope", natural)

    def blur(self, rtol: float) -> Array:
        """How well |D| - Theta is known, from the sizes of its terms."""
        mean, slope = (self.grid.w * np.abs(self.mu)).sum(axis=1), self.laws.at("preference_slope", self.mu_nat)
        terms = mean + np.abs(self.mu_nat) + np.abs(slope) + self.laws.at("threshold", self.mu_nat)
        return np.asarray(max(rtol, ROUNDING) * terms)


def endings(grid: Grid, gamma: Array, mu: Array, mu_nat: Array, laws: ManyLaws, rtol: float = 0.0) -> Endings:
    """Tell where the motion of struts under constant thrusts ends, as far as it can be told from one state of each.

    Parameters
    ----------
    grid : Grid
        Where the curvature is kept.
    gamma : ndarray, shape (members,)
        Dimensionless thrusts, not negative.
    mu : ndarray, shape (members, n)
        Dimensionless curvature at the nodes, finite.
    mu_nat : ndarray, shape (members,)
        Dimensionless natural curvature, finite.
    laws : ManyLaws
        The materials.
    rtol : float
        Relative tolerance of the run that made the states: |D| - Theta is not known better than this.

    Returns
    -------
    Endings
        Of no member does it depend, to the last bit, on which others there are.
    """
    count = gamma.size
    unknown = np.full((6, count), np.nan)
    found = Endings(
        np.zeros(count, dtype=np.int8), np.zeros(count, dtype=np.int8), unknown[0], unknown[1],
        np.full(count, -1, dtype=np.int64), *unknown[2:],
    )  # fmt: skip
    largest = np.maximum(np.abs(mu).max(axis=1, initial=0.0), np.abs(mu_nat))
    within = (gamma <= LARGEST_GAMMA) & (largest <= FARTHEST) & (largest**2 + 4.0 * gamma <= FARTHEST**2)
    found.why[~within] = BEYOND
    every = _Members(grid, gamma, mu, mu_nat, laws)
    some = np.flatnonzero(within)
    members = every.of(some)
    shape, alpha = _on_curve(members)
    found.now[some] = alpha
    found.why[some[np.isnan(alpha)]] = NO_SHAPE
    on = ~np.isnan(alpha)
    if on.any():
        some, shape, members = some[on], shape[on], members.of(np.flatnonzero(on))
        _sorted_out(found, some, members, shape, rtol)
    return found


def _on_curve(members: _Members) -> tuple[Array, Array]:
    """Static shapes of the natural curvatures, and their clamp curvatures: nan where there is none to be told.

    Newton on phi_alpha'(1) = mu_nat from what the grid says.
    """
    settled = settle_many(members.grid, members.gamma, members.mu, members.mu_nat)
    first = _at_clamp(members, settled.mu)
    alpha = np.where(settled.converged, first, np.nan)
    live = np.flatnonzero(settled.converged)
    for _ in range(NEWTON_STEPS):
        if not live.size:
            break
        end = ends_apart(members.gamma[live], alpha[live])
        slope = np.asarray(end.theta0_slope)
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            change = (np.asarray(end.mu_nat) - members.mu_nat[live]) / slope
        lost = (np.abs(slope) < NEAR_FOLD) | ~(np.abs(alpha[live] - change) <= 2.0 * FARTHEST)
        alpha[live] = np.where(lost, np.nan, alpha[live] - change)
        live = live[~lost & ~(np.abs(change) <= 1e-14 * np.maximum(1.0, np.abs(alpha[live])))]
    far = ~(np.abs(alpha - first) <= NEARBY * np.maximum(1.0, np.abs(first)))
    return settled.mu, np.where(far, np.nan, alpha)


def _at_clamp(members: _Members, mu: Array) -> Array:
    """Curvature at s = 0, as `Model.curvature_between` has it."""
    grid, fine = members.grid, members.grid.refined()
    shear = members.gamma[:, None] * np.sin(product_apart(mu, grid.integration(fine.s).T))
    at_clamp = grid.interpolation([0.0])[0]
    couple = fine.w - at_clamp @ (fine.w - fine.integration(grid.s))
    return np.asarray((mu * at_clamp).sum(axis=1) + (shear * couple).sum(axis=1))


def _sorted_out(found: Endings, some: NDArray[np.intp], members: _Members, shape: Array, rtol: float) -> None:
    """Tell those that yield no more from those that go on, and follow these."""
    w, mu, mu_nat, alpha = members.grid.w, members.mu, members.mu_nat, found.now[some]
    away = np.sqrt((w * (mu - shape) ** 2).sum(axis=1))
    end, threshold = ends_apart(members.gamma, alpha), members.laws.at("threshold", mu_nat)
    drive = members.drive(np.asarray(end.arm), np.asarray(end.mu_nat))
    excess = np.abs(drive) - threshold
    found.away[some], found.excess[some] = away, excess
    yielding = np.abs(members.drive((w * mu).sum(axis=1) - mu_nat, mu_nat)) > threshold
    blur, coarse = members.blur(rtol), np.abs(members.drive((w * shape).sum(axis=1) - mu_nat, mu_nat) - drive)
    theta = product_apart(shape, members.grid.A.T)
    attracts = contracts(members.grid, members.gamma[:, None], theta, away)
    held = attracts | (away <= ROUNDING * np.maximum(1.0, np.abs(mu).max(axis=1)))
    interior = held & (excess + away + coarse <= -blur) & ~yielding
    edge = attracts & ~interior & (np.abs(excess) <= blur) & (away <= BLURRED * blur)
    going = held & ~interior & (excess > np.where(yielding, away, np.inf))
    found.why[some] = np.where(held, SWITCHING, LOOSE)
    _put(found, some[interior], INTERIOR, alpha[interior], _some(end, interior), members.gamma[interior])
    for those, go in ((going, _follow), (edge, _arrived)):
        which = np.flatnonzero(those & (found.kind[some] == UNDECIDED))
        if which.size:
            side, now = np.where(drive[which] > 0.0, 1.0, -1.0), _some(end, which)
            start = Start(members.gamma[which], alpha[which], now.theta0_slope, side, members.laws.of(which))
            go(found, some[which], start, shape[which], members.grid, (blur + coarse)[which])


def _follow(found: Endings, some: NDArray[np.intp], start: Start, shape: Array, grid: Grid, blur: Array) -> None:
    """Follow the curve of equilibria the way the drive moves the natural curvature, up to |D| = Theta."""
    away = found.away[some]
    root, code = first_roots(start, away + blur)
    found.why[some] = np.select([code == TANGENCY, code == FOLD], [PASSING, SNAPPING], YIELDING)
    arrived = np.flatnonzero(code == ARRIVED)
    if not arrived.size:
        return
    some, start, root = some[arrived], start.of(arrived), root[arrived]
    sure = follows_the_curve(start, root, shape[arrived], away[arrived], grid)
    found.why[some[~sure]] = REMEMBERING
    some, start, root = some[sure], start.of(sure), root[sure]
    end = ends_apart(start.gamma, root)
    _put(found, some, LIMITING, root, end, start.gamma)
    found.rate[some] = rates(start, end)


def _arrived(found: Endings, some: NDArray[np.intp], start: Start, shape: Array, grid: Grid, blur: Array) -> None:
    """Tell where |D| = Theta next to states of which it is not known on which side of it they are."""
    root = start.alpha.copy()
    for _ in range(EDGE_STEPS):
        end = ends_apart(start.gamma, root)
        gap = start.gap(np.asarray(end.arm), np.asarray(end.mu_nat))
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            root = root + start.side * gap / (rates(start, end) * np.asarray(end.theta0_slope))
        root = np.where(np.abs(root) <= FARTHEST, root, start.alpha)
    end = ends_apart(start.gamma, root)
    rate = rates(start, end)
    gap = np.abs(start.gap(np.asarray(end.arm), np.asarray(end.mu_nat)))
    near = np.abs(root - start.alpha) <= NEARBY * np.maximum(1.0, np.abs(start.alpha))
    sure = np.flatnonzero((rate > 0.0) & near & (gap <= blur))
    some = some[sure]
    _put(found, some, LIMITING, root[sure], _some(end, sure), start.gamma[sure])
    found.rate[some], found.excess[some] = rate[sure], 0.0


def distance_between(gamma: float, one: float, other: float, grid: Grid) -> float:
    """Return the distance (int (phi' - phi')^2)^(1/2) of two equilibria, by the grid's quadrature."""
    a, b = (np.asarray(profile(gamma, alpha, grid.s).slope) for alpha in (one, other))
    return float(np.sqrt(grid.w @ (a - b) ** 2))


def _some(end: Ends, some: NDArray[np.intp] | Truths) -> Ends:
    return Ends(*(np.asarray(each)[some] for each in end))


def _put(found: Endings, some: NDArray[np.intp], kind: int, alpha: Array, end: Ends, gamma: Array) -> None:
    """Say of some members that they end at these equilibria."""
    found.kind[some], found.why[some], found.alpha[some] = kind, TOLD, alpha
    found.mu_nat[some], found.unstable[some] = end.mu_nat, unstable_count(gamma, alpha, end)
