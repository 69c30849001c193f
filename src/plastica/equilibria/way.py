"""The way of many yielding struts along their curves of equilibria, up to where the drive equals the threshold.

On the way the closed forms are analytic in the clamp curvature: each stretch is sampled from their interpolants at a
few Chebyshev nodes, wherever the last coefficients show these to be as good as the closed forms.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cache
from typing import Final

import numpy as np
from numpy.polynomial.chebyshev import chebvander
from numpy.typing import NDArray

from plastica.equilibria.apart import ends_apart, product_apart
from plastica.equilibria.elastica import Ends
from plastica.material.material import Laws
from plastica.numerics.arrays import LANES
from plastica.numerics.brackets import bracketed
from plastica.physics.batch import LawOf, law_of
from plastica.physics.strut import Strut

__all__ = [
    "ARRIVED",
    "ENDLESS",
    "FARTHEST",
    "FOLD",
    "TANGENCY",
    "ManyLaws",
    "Start",
    "first_roots",
    "laws_of_all",
    "laws_of_many",
    "rates",
]

Array = NDArray[np.float64]
Codes = NDArray[np.int8]

FARTHEST: Final = 200.0
"""Clamp curvature up to which the way along the curve of equilibria is followed."""

SAMPLES: Final = 2001
"""Equally spaced places at which a stretch of the way is looked at."""

FIRST: Final = 0.05
"""Length of the first stretch, in units of max(1, |alpha|); each later one is twice as long."""

NODES: Final = 24
PIECES: Final = (1, 8)
"""Into how many pieces, of a whole number of samples, a stretch is cut to be interpolated."""

TAIL: Final = 4
RESOLVED: Final = 2.0**-46
"""Size of the last coefficients, relative to the largest, up to which an interpolant stands for its function."""

AT_A_TIME: Final = 4 * LANES
"""Members whose samples are computed at a time: they stay in the processor's cache."""

ARRIVED, TANGENCY, FOLD, ENDLESS = range(4)
"""What comes first on the way: |D| = Theta, a place where it is nearly reached, a fold, or nothing."""


@dataclass(frozen=True, eq=False)
class ManyLaws:
    """What the ends of many members depend on of their materials; dimensionless.

    Attributes
    ----------
    preference_slope, preference_second, threshold, threshold_slope, flow : callable
        Of the natural curvature, the flow law of the excess, and one array for each parameter that the members have of
        their own.
    own : ndarray, shape (parameters, members)
        These parameters.
    """

    preference_slope: LawOf
    preference_second: LawOf
    threshold: LawOf
    threshold_slope: LawOf
    flow: LawOf
    own: Array = field(default_factory=lambda: np.empty((0, 1)))

    def of(self, some: NDArray[np.intp] | NDArray[np.bool_]) -> ManyLaws:
        """Those of some of the members."""
        return self if not len(self.own) else replace(self, own=self.own[:, some])

    def at(self, name: str, mu_nat: Array) -> Array:
        """Values of a law; mu_nat, or the excess, of shape (members, ...)."""
        own = self.own.reshape(*self.own.shape, *(1,) * (mu_nat.ndim - 1)) if len(self.own) else ()
        with np.errstate(all="ignore"):
            return np.broadcast_to(np.asarray(getattr(self, name)(mu_nat, *own), dtype=float), mu_nat.shape)


def laws_of_all(laws: Laws) -> ManyLaws:
    """Return the laws that all members share."""
    preference, threshold = laws.preference, laws.threshold
    return ManyLaws(preference.slope, preference.second, threshold.value, threshold.slope, laws.flow.value)


def laws_of_many(strut: Strut, varying: Sequence[str], own: Array) -> ManyLaws:
    """Return the laws of members that share the material of a strut but for some parameters.

    Parameters
    ----------
    strut : Strut
        The model.
    varying : sequence of str
        Parameters that are the members' own.
    own : ndarray, shape (parameters, members)
        Their values, in the units of the material.
    """
    if not varying:
        return laws_of_all(strut.laws)

    def law(name: str, order: int) -> LawOf:
        return law_of(strut, varying, np, name, order)

    return ManyLaws(
        law("preference", 1), law("preference", 2), law("threshold", 0), law("threshold", 1), law("flow", 0), own
    )


@dataclass(frozen=True, eq=False)
class Start:
    """Where members are on their curves of equilibria, and which way they go; arrays of shape (members,).

    Attributes
    ----------
    gamma, alpha : ndarray
        Thrust and clamp curvature.
    slope : ndarray
        theta_0'(1) there.
    side : ndarray
        Sign of the drive.
    laws : ManyLaws
        Their materials.
    """

    gamma: Array
    alpha: Array
    slope: Array
    side: Array
    laws: ManyLaws

    def of(self, some: NDArray[np.intp] | NDArray[np.bool_]) -> Start:
        """The same of some of the members."""
        return Start(self.gamma[some], self.alpha[some], self.slope[some], self.side[some], self.laws.of(some))

    def gap(self, arm: Array, mu_nat: Array) -> Array:
        """G = side D - Theta of shapes with these arms and natural curvatures, of shape (members, ...)."""
        side = self.side.reshape(-1, *(1,) * (arm.ndim - 1))
        drive = arm - self.laws.at("preference_slope", mu_nat)
        return side * drive - self.laws.at("threshold", mu_nat)


def first_roots(start: Start, margin: Array) -> tuple[Array, Codes]:
    """Find the first shape with |D| = Theta on the way of each member, as it creeps the way of its drive.

    Parameters
    ----------
    start : Start
        Where they are; the drive must exceed the threshold there, and theta_0'(1) must not be 0.
    margin : ndarray, shape (members,)
        How near |D| may come to Theta and turn away again without being told apart from reaching it.

    Returns
    -------
    root : ndarray, shape (members,)
        Clamp curvature; nan where nothing can be told.
    code : ndarray of int, shape (members,)
        What comes first: ARRIVED, TANGENCY, FOLD or ENDLESS.
    """
    root, code = np.full(start.alpha.shape, np.nan), np.full(start.alpha.shape, ENDLESS, dtype=np.int8)
    direction = np.sign(start.side * start.slope)
    lower, width = start.alpha.copy(), FIRST * np.maximum(1.0, np.abs(start.alpha))
    brackets = []
    some = np.flatnonzero(np.abs(lower) <= FARTHEST)
    while some.size:
        on = []
        for i in range(0, some.size, AT_A_TIME):
            now = some[i : i + AT_A_TIME]
            way = lower[now, None] + direction[now, None] * (width[now, None] * _shares())
            gap, first, found = _look(start.of(now), way, margin[now])
            code[now] = found
            arrived = np.flatnonzero(found == ARRIVED)
            behind = (arrived, first[arrived])
            before = (arrived, np.maximum(first[arrived] - 1, 0))
            brackets.append((now[arrived], way[before], way[behind], gap[before], gap[behind]))
            going = now[found == ENDLESS]
            lower[going] = way[found == ENDLESS, -1]
            on.append(going)
        some = np.concatenate(on)
        width[some] *= 2.0
        some = some[np.abs(lower[some]) <= FARTHEST]
    if brackets:
        where, *ends = (np.concatenate(column) for column in zip(*brackets, strict=True))
        root[where] = _closed(start.of(where), *ends)
    return root, code


@cache
def _shares() -> Array:
    return np.linspace(0.0, 1.0, SAMPLES)


def _look(start: Start, way: Array, margin: Array) -> tuple[Array, NDArray[np.intp], Codes]:
    """G at the samples of a stretch, (members, SAMPLES), the one at which G <= 0 first, and what comes first."""
    arm, mu_nat, slope = _sampled(start.gamma, way)
    gap = start.gap(arm, mu_nat)
    passed, folded = gap <= 0.0, np.sign(slope) != np.sign(start.slope)[:, None]
    first = np.where(passed.any(axis=1), passed.argmax(axis=1), SAMPLES)
    fold = np.where(folded.any(axis=1), folded.argmax(axis=1), SAMPLES)
    last = np.minimum(first, fold)
    dips = (gap[:, 1:-1] < gap[:, :-2]) & (gap[:, 1:-1] <= gap[:, 2:]) & (gap[:, 1:-1] <= margin[:, None])
    dip = np.where(dips.any(axis=1), dips.argmax(axis=1) + 1, SAMPLES)
    code = np.where(first < SAMPLES, ARRIVED, ENDLESS)
    code = np.where((fold < SAMPLES) & (fold <= last), FOLD, code)
    code = np.where(dip < last - 1, TANGENCY, code)
    return gap, first, code.astype(np.int8)


def _sampled(gamma: Array, way: Array) -> tuple[Array, Array, Array]:
    """Arm, natural curvature and theta_0'(1) at all samples of the stretches; each of the shape of `way`."""
    out = np.empty((3, *way.shape))
    left = np.arange(gamma.size)
    for pieces in PIECES:
        values, good = _interpolated(gamma[left], way[left], pieces)
        out[:, left[good]] = values[:, good]
        left = left[~good]
        if not left.size:
            break
    else:
        end = ends_apart(gamma[left, None], way[left])
        out[:, left] = end.arm, end.mu_nat, end.theta0_slope
    return out[0], out[1], out[2]


def _interpolated(gamma: Array, way: Array, pieces: int) -> tuple[Array, NDArray[np.bool_]]:
    """The same by interpolation on pieces of the stretches, and of which members all pieces are resolved."""
    count, per_piece = gamma.size, (SAMPLES - 1) // pieces
    places, to_coefficients, to_samples = _matrices(per_piece)
    ends_of = way[:, ::per_piece]
    lower, upper = ends_of[:, :-1, None], ends_of[:, 1:, None]
    end = ends_apart(gamma[:, None, None], lower + places * (upper - lower))
    nodal = np.stack([end.arm, end.mu_nat, end.theta0_slope]).reshape(-1, NODES)
    coefficients = product_apart(nodal, to_coefficients)
    largest = np.abs(coefficients).max(axis=1)
    good = np.abs(coefficients[:, -TAIL:]).max(axis=1) <= RESOLVED * largest
    samples = product_apart(nodal, to_samples).reshape(3, count, pieces, per_piece + 1)
    values = np.concatenate([samples[..., :-1].reshape(3, count, -1), samples[:, :, -1, -1:]], axis=2)
    return values, np.asarray(good.reshape(3, count, pieces).all(axis=(0, 2)))


@cache
def _matrices(per_piece: int) -> tuple[Array, Array, Array]:
    """Chebyshev nodes in [0, 1], and the matrices from values there to coefficients and to equally spaced samples."""
    angles = (2.0 * np.arange(NODES) + 1.0) * np.pi / (2.0 * NODES)
    weights = np.where(np.arange(NODES) == 0, 1.0, 2.0) / NODES
    to_coefficients = np.cos(np.outer(angles, np.arange(NODES))) * weights
    to_samples = to_coefficients @ chebvander(np.linspace(-1.0, 1.0, per_piece + 1), NODES - 1).T
    return 0.5 + 0.5 * np.cos(angles), to_coefficients, to_samples


def _closed(start: Start, left: Array, right: Array, before: Array, behind: Array) -> Array:
    """Clamp curvature at which G vanishes between two neighbouring samples, and with what signs it does."""

    def gap(alpha: Array, rows: NDArray[np.int64]) -> Array:
        of = start.of(rows)
        end = ends_apart(of.gamma, alpha)
        return of.gap(np.asarray(end.arm), np.asarray(end.mu_nat))

    return bracketed(gap, np.arange(left.size), left, right, before, behind)


def rates(start: Start, end: Ends) -> Array:
    """R = -(dG/dalpha)/(dmu_nat/dalpha) at limiting shapes, G = D - side Theta, from the closed forms (errata C)."""
    laws, natural, slope = start.laws, np.asarray(end.mu_nat), np.asarray(end.theta0_slope)
    drive_slope = np.asarray(end.theta0) - slope * (1.0 + laws.at("preference_second", natural))
    return -(drive_slope - start.side * laws.at("threshold_slope", natural) * slope) / slope
