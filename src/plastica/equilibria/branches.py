"""Curves of equilibria in the thrust at one natural curvature, and the curve of their folds."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from plastica.equilibria.elastica import ends
from plastica.equilibria.frozen import LAYER, frozen_alphas, number, pieces_for
from plastica.equilibria.level_curves import Curve, Level, curves
from plastica.equilibria.oscillation import unstable_count
from plastica.equilibria.reach import fold_reach
from plastica.errors import ArgumentError
from plastica.numerics.roots import roots_of_rows

if TYPE_CHECKING:
    import xarray

__all__ = ["Branch", "FoldCurve", "branches", "fold_curve"]

Array = NDArray[np.float64]
Rows = NDArray[np.int64]
Triple = tuple[Array, Array, Array]

MOST_POINTS = 100_000

SMALLEST = 1e-12
"""Natural curvature below which the imperfect pitchforks cannot be told from perfect ones: it counts as 0."""


@dataclass(frozen=True, eq=False)
class Branch:
    """One connected curve of equilibria with the same natural curvature, in order from end to end.

    Attributes
    ----------
    natural_curvature : float
        phi'(1) of all of them.
    gamma, alpha : ndarray, shape (n,)
        Thrust and clamp curvature along the curve.
    unstable : ndarray of int, shape (n,)
        Number of unstable directions at frozen natural curvature; -1 at folds, and where it cannot be told.
    folds : tuple of int
        Numbers of the points at which gamma turns, d mu_nat / d alpha = 0: exact to rounding.
    pitchforks : tuple of int
        Numbers of the points where it meets another branch: alpha = 0, gamma = ((k + 1/2) pi)^2, for the natural
        curvature 0 alone.
    """

    natural_curvature: float
    gamma: Array
    alpha: Array
    unstable: NDArray[np.int64]
    folds: tuple[int, ...]
    pitchforks: tuple[int, ...] = ()

    @property
    def pieces(self) -> tuple[tuple[Array, Array, int], ...]:
        """The parts between folds and pitchforks: gamma, alpha and the number of unstable directions on each."""
        inner = sorted({i for i in (*self.folds, *self.pitchforks) if 0 < i < self.gamma.size - 1})
        cuts = [0, *inner, self.gamma.size - 1]
        out = []
        for i, j in pairwise(cuts):
            told = self.unstable[i : j + 1]
            told = told[told >= 0]
            count = int(np.bincount(told).argmax()) if told.size else -1
            out.append((self.gamma[i : j + 1], self.alpha[i : j + 1], count))
        return tuple(out)

    def to_dataset(self) -> xarray.Dataset:
        """Return the curve as labelled arrays, dimensionless."""
        fold = np.zeros(self.gamma.size, dtype=int)
        fold[list(self.folds)] = 1
        data = {
            "gamma": (self.gamma, "thrust"),
            "alpha": (self.alpha, "curvature at the clamp"),
            "unstable": (self.unstable, "unstable directions"),
            "fold": (fold, "1 at a fold"),
        }
        return _dataset("branch of equilibria", data, natural_curvature=self.natural_curvature)

    def __str__(self) -> str:
        where = ", ".join(f"gamma = {self.gamma[i]:.8g}" for i in self.folds) or "none"
        counts = ", ".join(str(count) for *_, count in self.pieces)
        return (
            f"Branch with natural curvature {self.natural_curvature:.6g}: {self.gamma.size} points from gamma = "
            f"{self.gamma[0]:.6g} to {self.gamma[-1]:.6g}; folds: {where}; unstable directions: {counts}."
        )


@dataclass(frozen=True, eq=False)
class FoldCurve:
    """One connected curve of folds theta_0'(1) = 0, in order from end to end.

    Attributes
    ----------
    gamma, alpha, natural_curvature : ndarray, shape (n,)
        Thrust, clamp curvature and natural curvature along the curve. Curves come with their mirror images.
    cusps : tuple of int
        Numbers of the points at which gamma turns along the curve: cusps in the plane of gamma and natural curvature,
        where three equilibria meet; the first is (pi^2/4, 0, 0).
    """

    gamma: Array
    alpha: Array
    natural_curvature: Array
    cusps: tuple[int, ...]

    def to_dataset(self) -> xarray.Dataset:
        """Return the curve as labelled arrays, dimensionless."""
        cusp = np.zeros(self.gamma.size, dtype=int)
        cusp[list(self.cusps)] = 1
        data = {
            "gamma": (self.gamma, "thrust"),
            "alpha": (self.alpha, "curvature at the clamp"),
            "natural_curvature": (self.natural_curvature, "natural curvature"),
            "cusp": (cusp, "1 at a cusp"),
        }
        return _dataset("curve of folds", data)

    def __str__(self) -> str:
        where = ", ".join(f"({self.gamma[i]:.6g}, {self.natural_curvature[i]:.6g})" for i in self.cusps) or "none"
        return (
            f"Folds from gamma = {self.gamma[0]:.6g} to {self.gamma[-1]:.6g}, {self.gamma.size} points; cusps in "
            f"(gamma, natural curvature): {where}."
        )


def branches(
    natural_curvature: float, gamma: tuple[float, float] = (0.0, 40.0), count: int = 201
) -> tuple[Branch, ...]:
    """Find all branches of equilibria with one natural curvature over a range of thrusts: phi_alpha'(1) = mu_nat.

    All roots in alpha are found on columns of constant gamma, joined in their order, through folds that are solved
    for; then Newton's method fills in. So branches that no path connects with gamma = 0 are found as well.

    Parameters
    ----------
    natural_curvature : float
        mu_nat, dimensionless.
    gamma : tuple of (float, float)
        Range of thrusts, dimensionless.
    count : int
        Number of thrusts, equally spaced over the range, at which every branch there has a point; folds, and six
        points on either side of each, come besides.

    Returns
    -------
    tuple of Branch
        Each an ordered polyline.

    Raises
    ------
    ArgumentError
        Where an argument is not finite, gamma is negative or an empty range, or the count is not a whole number of 2
        to 100 000.

    Notes
    -----
    *Good values*: gamma to 100. *Limits*: two folds of one branch that both lie between two neighbouring columns (some
    0.3 apart in gamma^(1/2)), and a closed branch that does, are overlooked. At natural curvature 0, as which below
    1e-12 counts, the straight rod is a branch of its own, and each pair of buckled ones is one branch with a fold at
    alpha = 0.

    Checked by test_branches_hold_all_equilibria_of_every_column, test_branch_folds.
    """
    given = number(natural_curvature, "natural_curvature")
    natural = given if abs(given) > SMALLEST else 0.0
    low, high = _thrusts(gamma)
    thrusts = _columns(low, high, count)

    def plane(g: Array, a: Array) -> Triple:
        end = ends(g, a)
        return end.mu_nat - natural, end.theta0_slope, _slope_gamma(g, a, end.mu_nat, end.phi, end.theta0_slope)

    def columns(g: Array) -> list[Array]:
        found = frozen_alphas(g, natural)
        roots = [np.array([root.x for root in each.points if root.kind == "crossing"]) for each in found]
        return [x[np.abs(x) > 1e-6] for x in roots] if natural == 0.0 else roots

    level = Level(plane, columns, symmetric=natural == 0.0)
    lines, joined = curves(level, low, high, thrusts)
    made = [_branch(natural, line) for line in lines]
    if natural == 0.0:
        made.insert(0, _straight(thrusts, low, high))
    _require(joined, "natural_curvature", natural_curvature)
    return tuple(made)


def fold_curve(gamma: tuple[float, float] = (0.0, 40.0), count: int = 201) -> tuple[FoldCurve, ...]:
    """Find all folds theta_0'(1) = d phi_alpha'(1) / d alpha = 0 over a range of thrusts, as curves.

    At these 0 is a double eigenvalue of the linearisation, and two equilibria of one natural curvature meet; they
    exist for gamma >= pi^2/4, where they start at the cusp (gamma, alpha, mu_nat) = (pi^2/4, 0, 0) (errata M7).

    Parameters
    ----------
    gamma : tuple of (float, float)
        Range of thrusts, dimensionless.
    count : int
        Number of thrusts, equally spaced over the range, at which every curve there has a point.

    Returns
    -------
    tuple of FoldCurve
        Each an ordered polyline, with its mirror image; none where the range lies below pi^2/4.

    Raises
    ------
    ArgumentError
        As `branches`.

    Notes
    -----
    *Limits*: as `branches`. Cusps off the straight rod are accurate to some 1e-9 in alpha.

    Checked by test_fold_curve.
    """
    low, high = _thrusts(gamma)
    thrusts = _columns(low, high, count)
    least = 0.25 * math.pi**2
    if high < least:
        return ()
    start = max(low, least * (1.0 - 1e-9))
    inner = thrusts[thrusts > start]

    def columns(g: Array) -> list[Array]:
        half = _fold_alphas(g)
        return [np.concatenate([-x[::-1], x]) for x in half]

    lines, joined = curves(Level(_fold_plane, columns, symmetric=True), start, high, inner)
    _require(joined, "gamma", gamma)
    return tuple(FoldCurve(c.gamma, c.alpha, ends(c.gamma, c.alpha).mu_nat + 0.0, c.folds) for c in lines)


def _slope_gamma(g: Array, a: Array, mu_nat: Array, phi: Array, theta0_slope: Array) -> Array:
    """Slope d phi'(1) / d gamma, from phi(s; gamma, alpha) = Phi(gamma^(1/2) s, alpha / gamma^(1/2))."""
    safe = np.maximum(g, 1e-12)
    small = -np.where(a == 0.0, 0.0, (1.0 - np.cos(a)) / np.where(a == 0.0, 1.0, a))
    return np.where(g < 1e-6, small, 0.5 * (mu_nat - g * np.sin(phi) - a * theta0_slope) / safe)


def _fold_plane(g: Array, a: Array) -> Triple:
    """theta_0'(1) and its derivatives; that in alpha by differences of the fourth order on the scale of the layer."""
    w = np.sqrt(g)
    h = 1e-3 * (np.abs(np.abs(a) - 2.0 * w) + 4.0 * w * np.exp(-w))
    shifts = np.array([[0.0], [1.0], [-1.0], [2.0], [-2.0]]) * h
    end = ends(np.broadcast_to(g, shifts.shape), a + shifts)
    f = end.theta0_slope
    slope = (8.0 * (f[1] - f[2]) - (f[3] - f[4])) / (12.0 * h)
    rate = -0.5 * (g * np.cos(end.phi[0]) * end.theta0[0] + a * slope) / np.maximum(g, 1e-12)
    return f[0], slope, rate


def _fold_alphas(g: Array) -> list[Array]:
    """All alpha > 0 with theta_0'(1) = 0, for each thrust."""
    high = np.maximum([fold_reach(float(x)) for x in g], 1.0)

    def f(x: Array, row: Rows) -> Array:
        return ends(g[row], x).theta0_slope

    def size(x: Array, row: Rows) -> Array:
        return 1.0 + 0.5 * g[row] * np.abs(ends(g[row], x).theta0)

    cuts = [(2.0 * math.sqrt(x),) for x in g.tolist()]
    found = roots_of_rows(f, np.zeros(g.size), high, breaks=cuts, size=size, pieces=pieces_for(float(high.max())))
    return [np.array([root.x for root in each.points if root.kind == "crossing" and root.x > 1e-6]) for each in found]


def _branch(natural: float, line: Curve) -> Branch:
    unstable = unstable_count(line.gamma, line.alpha)
    unstable[list(line.folds)] = -1
    meets = tuple(i for i in line.folds if line.alpha[i] == 0.0) if natural == 0.0 else ()
    return Branch(natural, line.gamma, line.alpha, unstable, line.folds, meets)


def _straight(thrusts: Array, low: float, high: float) -> Branch:
    critical = [((k + 0.5) * math.pi) ** 2 for k in range(math.ceil(math.sqrt(high) / math.pi) + 1)]
    inside = [x for x in critical if low <= x <= high]
    gamma = np.unique(np.concatenate([thrusts, inside]))
    met = tuple(int(np.searchsorted(gamma, x)) for x in inside)
    unstable = unstable_count(gamma, np.zeros_like(gamma))
    unstable[list(met)] = -1
    return Branch(0.0, gamma, np.zeros_like(gamma), unstable, (), met)


def _thrusts(gamma: Any) -> tuple[float, float]:
    try:
        low, high = gamma
    except (TypeError, ValueError):
        raise ArgumentError("must be a pair (low, high)", where="gamma", value=gamma) from None
    low, high = number(low, "gamma", least=0.0), number(high, "gamma", least=0.0)
    if not low < high <= LAYER:
        rule = f"must be a range low < high <= {LAYER:g}"
        raise ArgumentError(rule, where="gamma", value=gamma, next_step="Beyond it branches cannot be told apart.")
    return low, high


def _columns(low: float, high: float, count: int) -> Array:
    if isinstance(count, bool) or not isinstance(count, (int, np.integer)) or not 2 <= count <= MOST_POINTS:
        rule = f"must be a whole number from 2 to {MOST_POINTS}"
        raise ArgumentError(rule, where="count", value=count)
    return np.linspace(low, high, int(count))


def _require(joined: bool, where: str, value: object) -> None:
    if not joined:
        raise ArgumentError(
            "must be such that its curves can be told apart",
            where=where,
            value=value,
            next_step="Next to the separatrix they cannot at large thrusts: take a smaller range of gamma.",
        )


def _dataset(title: str, data: dict[str, tuple[Any, str]], **facts: float) -> xarray.Dataset:
    import xarray

    variables = {name: (("point",), value, {"units": "1", "long_name": words}) for name, (value, words) in data.items()}
    return xarray.Dataset(variables, attrs={"title": title, "conventions": "dimensionless", **facts})
