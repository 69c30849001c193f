"""All equilibria: the admissible set with its ends and folds, and all shapes at one frozen natural curvature.

Why nothing is missing. phi_alpha(1) and phi_alpha'(1) are analytic in alpha, and so is D -+ Theta but where a law has a
kink at the natural curvature phi_alpha'(1); these alpha are found first. The scales on which the laws vary are read off
their formulas (`plastica.equilibria.grain`), so that the first pieces are short where a law has a narrow well.
Piecewise Chebyshev interpolants, verified between their nodes and down to rounding, are examined for all their roots
(`plastica.numerics.roots`), with a cut at the separatrix 4 gamma = alpha^2, next to which everything varies within
exp(-gamma^(1/2)); and the a-priori bounds of `plastica.equilibria.reach` show that there is nothing beyond the range.

What could be missed: two limiting equilibria that are nearer to one another than `Limiting.error` are one tangency;
above gamma = 700 the layer at the separatrix is narrower than doubles can tell apart, and where a formula overflows or
cannot be bounded, something may hide: then the result says that it is not complete.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from plastica.equilibria.elastica import LARGEST_ALPHA, Ends, drive, ends
from plastica.equilibria.equilibrium import Equilibrium, frozen_equilibrium
from plastica.equilibria.equilibrium_set import EquilibriumSet, Fold, Limiting, interval_words
from plastica.equilibria.frozen import LAYER, LONGEST, frozen_shapes, number, pieces_for
from plastica.equilibria.grain import Grain, first_cuts, grain
from plastica.equilibria.oscillation import unstable_count
from plastica.equilibria.reach import FALLBACK, Reach, fold_reach, reach
from plastica.errors import ArgumentError
from plastica.material.discs import is_even
from plastica.material.material import Laws, Material
from plastica.material.rough import rough_places
from plastica.numerics.roots import Roots, roots_of_rows
from plastica.physics.laws import laws_of
from plastica.physics.scales import Specimen

__all__ = ["EquilibriaAt", "equilibria", "equilibria_at", "number"]

Array = NDArray[np.float64]
Rows = NDArray[np.int64]


def equilibria(
    material: Material,
    gamma: float,
    alpha: tuple[float, float] | None = None,
    *,
    specimen: Specimen | None = None,
) -> EquilibriumSet:
    """Find all equilibria of a strut: the intervals of clamp curvature alpha with |D| <= Theta, their ends, and folds.

    With phi'' + gamma sin phi = 0, phi(0) = 0, phi'(0) = alpha (design, claim 5)::

        mu_nat = phi'(1)      D = phi(1) - phi'(1) - kappa'(mu_nat)      |D| <= Theta(mu_nat)

    Parameters
    ----------
    material : Material
        The laws; only preference energy and threshold enter.
    gamma : float
        Thrust >= 0, dimensionless: beta L^2 / EI.
    alpha : tuple of (float, float), optional
        Range of clamp curvatures (times L) to look at; if None, the one outside which there is no limiting
        equilibrium (`plastica.equilibria.reach`).
    specimen : Specimen, optional
        What the material is made into, where its parameters carry units.

    Returns
    -------
    EquilibriumSet
        With `complete` and a sentence that says why.

    Raises
    ------
    ArgumentError
        Where an argument is of the wrong kind, not finite, negative (gamma), or an empty range.

    Notes
    -----
    *You should see* one interval around 0; above gamma** three (errata E). *Good values*: gamma to 500. A double root
    is told from none or two where the extremum of |D| - Theta is above some 10 eps of the terms it is made from: in
    gamma, about 1e-14 of gamma**.

    Checked by test_limiting_equilibria_of_the_reference, test_every_sign_change_is_accounted_for.

    Examples
    --------
    >>> import plastica as pl
    >>> found = equilibria(pl.Material("m**2/2", "pos(x)**2", "0.1"), gamma=3.0)
    >>> [f"{lo:.4f} {hi:.4f}" for lo, hi in found.intervals]
    ['-3.5553 -3.4433', '-0.1123 0.1123', '3.4433 3.5553']
    """
    if not isinstance(material, Material):
        raise ArgumentError("must be a pl.Material", where="material", value=material)
    thrust = number(gamma, "gamma", least=0.0)
    laws = laws_of(material, specimen)
    known = reach(thrust, laws)
    low, high = _range(alpha, known, thrust)
    farthest = max(abs(low), abs(high))
    searched = min(farthest, known.alpha, LONGEST)
    levels = _rough_levels(laws, searched)
    folds, rough = _smooth_part(thrust, levels, farthest, searched)
    fineness = grain(thrust, laws, searched, levels)
    sides = _limiting_roots(thrust, laws, searched, rough, fineness)
    limiting = _sorted([p for p in _limiting(thrust, laws, sides) if low <= p.alpha <= high])
    intervals, isolated = _intervals(thrust, laws, low, high, limiting, sides)
    complete = all(found.complete for found, *_ in sides) and folds.complete and fineness.complete
    complete &= searched >= min(farthest, known.alpha) and (alpha is not None or known.outside != "unknown")
    bounded = {"inadmissible": True, "admissible": False, "unknown": None}[known.outside]
    if alpha is None and bounded is False:
        intervals = tuple((-math.inf if a == low else a, math.inf if b == high else b) for a, b in intervals)
    complete &= thrust <= LAYER or searched < 2.0 * math.sqrt(thrust)
    troubles = [found.sentence for found in (folds, *(side[0] for side in sides)) if not found.complete]
    if not fineness.complete:
        troubles.append(fineness.sentence)
    if thrust > LAYER:
        troubles.append("Next to the separatrix the curve of equilibria varies faster than doubles can follow.")
    sentence = _sentence(thrust, intervals, limiting, (low, high), known, alpha is None, complete, troubles)
    kept = tuple(fold for fold in _folds(thrust, laws, folds) if low <= fold.alpha <= high)
    return EquilibriumSet(
        thrust, intervals, limiting, isolated, kept, (low, high), bounded, complete, sentence, material, specimen
    )


class EquilibriaAt(tuple[Equilibrium, ...]):
    """All equilibria of one natural curvature: a tuple in ascending alpha that says whether it is complete.

    Attributes
    ----------
    complete : bool
        Whether it is certain that these are all, and each of them one.
    sentence : str
        The same in words: near a fold, which of them (`Equilibrium.multiplicity` above 1) may be several or none.
    """

    complete: bool
    sentence: str

    def __new__(cls, found: Iterable[Equilibrium], complete: bool, sentence: str) -> EquilibriaAt:
        """Make one of the equilibria in ascending alpha."""
        made = super().__new__(cls, found)
        made.complete, made.sentence = complete, sentence
        return made

    def __getnewargs__(self) -> tuple[tuple[Equilibrium, ...], bool, str]:
        """Return what a copy is made from."""
        return tuple(self), self.complete, self.sentence


def equilibria_at(gamma: float, natural_curvature: float) -> EquilibriaAt:
    """Find all equilibria of an elastic rod, whose natural curvature does not move: phi_alpha'(1) = natural curvature.

    All roots in |alpha| <= (mu_nat^2 + 4 gamma)^(1/2), which the first integral phi'^2 / 2 - gamma cos phi demands.

    Parameters
    ----------
    gamma : float
        Thrust in [0, 1e5], dimensionless.
    natural_curvature : float
        Natural curvature, dimensionless: times L.

    Returns
    -------
    EquilibriaAt
        A tuple of `Equilibrium` in ascending alpha, without a material. Two that are nearer than doubles can tell
        apart, at a fold, are one of `multiplicity` 2, which may also be none: `complete` is then False, and `sentence`
        says where. Above gamma = 50 each has a `depth`, since their alphas may be one double.

    Raises
    ------
    ArgumentError
        Where an argument is not a finite number, or outside its range.

    Examples
    --------
    >>> [len(equilibria_at(gamma, natural_curvature=0.1)) for gamma in (2.0, 5.0, 40.0)]
    [1, 3, 5]
    """
    thrust = number(gamma, "gamma", least=0.0)
    natural = number(natural_curvature, "natural_curvature")
    told = frozen_shapes(thrust, natural)
    made = (frozen_equilibrium(thrust, *shape) for shape in told.found)
    return EquilibriaAt(made, told.complete, told.sentence)


def _range(alpha: Any, known: Reach, gamma: float) -> tuple[float, float]:
    if alpha is None:
        end = known.alpha if math.isfinite(known.alpha) else FALLBACK + 4.0 * math.sqrt(gamma)
        end = min(end, LONGEST)
        return -end, end
    try:
        low, high = alpha
    except (TypeError, ValueError):
        raise ArgumentError("must be a pair (low, high)", where="alpha", value=alpha) from None
    low, high = number(low, "alpha"), number(high, "alpha")
    if not (low < high and max(abs(low), abs(high)) <= LARGEST_ALPHA):
        rule = f"must be a range low < high within {LARGEST_ALPHA:g}"
        raise ArgumentError(rule, where="alpha", value=alpha, next_step="Leave it out to look at all that matters.")
    return low, high


def _rough_levels(laws: Laws, searched: float) -> Array:
    """Find the natural curvatures of either sign at which a law may not be analytic."""
    rough: set[float] = set()
    for law in (laws.preference, laws.threshold):
        rough |= {abs(z) for z in rough_places(law, searched) if abs(z) <= searched}
    return np.array(sorted(rough | {-z for z in rough}), dtype=float)


def _smooth_part(gamma: float, levels: Array, farthest: float, searched: float) -> tuple[Roots, tuple[float, ...]]:
    """Find the folds at alpha >= 0, and the alpha >= 0 at which a law is met where it is rough."""
    ends_of_folds = max(min(farthest, fold_reach(gamma), LONGEST), 1e-3)
    high = np.concatenate([[ends_of_folds], np.full(levels.size, searched)])

    def f(x: Array, row: Rows) -> Array:
        end = ends(gamma, x)
        level = np.concatenate([[0.0], levels])[row]
        return np.where(row == 0, end.theta0_slope, end.mu_nat - level)

    def size(x: Array, row: Rows) -> Array:
        end = ends(gamma, x)
        tilt = 0.5 * gamma * np.where(row == 0, np.abs(end.theta0), np.abs(np.sin(end.phi)))
        return tilt + np.where(row == 0, 1.0, np.abs(end.mu_nat) + searched)

    cuts = [(2.0 * math.sqrt(gamma),)] * high.size
    folds, *met = roots_of_rows(f, np.zeros(high.size), high, breaks=cuts, size=size, pieces=pieces_for(high.max()))
    return folds, tuple(sorted({root.x for found in met for root in found.points if root.x > 0.0}))


class _Side(NamedTuple):
    """The roots of D = side Theta at alpha = orientation * x, x >= 0."""

    roots: Roots
    orientation: float
    side: int


def _limiting_roots(
    gamma: float, laws: Laws, searched: float, rough: tuple[float, ...], fineness: Grain
) -> list[_Side]:
    """Find the roots of D = Theta and D = -Theta at alpha >= 0, and at alpha < 0 too where the laws are not even."""
    even = is_even(laws.preference) and is_even(laws.threshold)
    cases = [(1.0, 1), (1.0, -1)] + ([] if even else [(-1.0, 1), (-1.0, -1)])
    orientation, side = np.array([c[0] for c in cases]), np.array([float(c[1]) for c in cases])

    def f(x: Array, row: Rows) -> Array:
        end, sign = ends(gamma, x), orientation[row]
        natural = sign * end.mu_nat
        force = sign * end.arm - laws.preference.slope(natural)
        return np.asarray(force - side[row] * laws.threshold.value(natural))

    def size(x: Array, row: Rows) -> Array:
        end = ends(gamma, x)
        m = orientation[row] * end.mu_nat
        steep = np.abs(laws.preference.second(m)) + np.abs(laws.threshold.slope(m))
        whole = np.abs(laws.preference.slope(m)) + np.abs(laws.threshold.value(m))
        tilt = 0.5 * gamma * np.abs(np.sin(end.phi)) + x * np.abs(end.theta0_slope)
        return np.asarray(np.abs(end.phi) + x * np.abs(end.theta0) + (np.abs(m) + tilt) * (1.0 + steep) + whole)

    cuts = first_cuts(gamma, searched, (2.0 * math.sqrt(gamma), *rough), pieces_for(searched), fineness)
    high = np.full(len(cases), searched)
    found = roots_of_rows(f, np.zeros(len(cases)), high, breaks=[cuts.tolist()] * len(cases), size=size, pieces=1)
    out = [_Side(each, sign, s) for each, (sign, s) in zip(found, cases, strict=True)]
    return out + ([_Side(each.roots, -1.0, -each.side) for each in out] if even else [])


def _limiting(gamma: float, laws: Laws, sides: list[_Side]) -> list[Limiting]:
    out = []
    for found, orientation, side in sides:
        alpha = orientation * found.x
        end = ends(gamma, alpha)
        push, unstable = drive(end, laws), unstable_count(gamma, alpha, end)
        slope = end.theta0_slope
        stiff = 1.0 + laws.preference.second(end.mu_nat) + side * laws.threshold.slope(end.mu_nat)
        with np.errstate(divide="ignore"):
            rate = stiff - np.where(slope != 0.0, end.theta0 / slope, math.copysign(math.inf, 1.0))
        for i, root in enumerate(found.points):
            out.append(
                Limiting(
                    alpha=float(alpha[i]),
                    mu_nat=float(end.mu_nat[i]),
                    side=side,
                    attracting=bool(rate[i] > 0.0) and root.kind == "crossing",
                    rate=float(rate[i]),
                    drive=float(push[i]),
                    kind=root.kind,
                    unstable=int(unstable[i]),
                    error=root.error,
                )
            )
    return out


def _sorted(points: list[Limiting]) -> tuple[Limiting, ...]:
    return tuple(sorted(points, key=lambda point: point.alpha))


def _folds(gamma: float, laws: Laws, found: Roots) -> list[Fold]:
    x = found.x
    alpha = np.concatenate([-x[x > 0.0][::-1], x])
    points = [*[p for p in reversed(found.points) if p.x > 0.0], *found.points]
    end: Ends = ends(gamma, alpha)
    push, threshold = drive(end, laws), laws.threshold.value(end.mu_nat)
    return [
        Fold(float(a), float(m), float(d), bool(abs(d) <= h), "tangency" if a == 0.0 else root.kind, root.error)
        for a, m, d, h, root in zip(alpha, end.mu_nat, push, threshold, points, strict=True)
    ]


def _intervals(
    gamma: float, laws: Laws, low: float, high: float, limiting: tuple[Limiting, ...], sides: list[_Side]
) -> tuple[tuple[tuple[float, float], ...], tuple[Limiting, ...]]:
    """Cut the range at the limiting equilibria, and keep what is admissible; touching parts are one."""
    equal = [(o * a, o * b) if o > 0.0 else (-b, -a) for found, o, _ in sides for a, b in found.vanishing]
    cuts = np.unique([low, high, *(p.alpha for p in limiting), *(x for part in equal for x in part if low < x < high)])
    middle = 0.5 * (cuts[:-1] + cuts[1:])
    end = ends(gamma, middle)
    inside = np.abs(drive(end, laws)) <= laws.threshold.value(end.mu_nat)
    inside |= np.array([any(a <= x <= b for a, b in equal) for x in middle])
    parts: list[tuple[float, float]] = []
    for a, b, keep in zip(cuts[:-1].tolist(), cuts[1:].tolist(), inside, strict=True):
        if keep and parts and parts[-1][1] == a:
            parts[-1] = (parts[-1][0], b)
        elif keep:
            parts.append((a, b))
    alone = tuple(p for p in limiting if not any(a <= p.alpha <= b for a, b in parts))
    return tuple(parts), alone


def _sentence(
    gamma: float,
    intervals: tuple[tuple[float, float], ...],
    limiting: tuple[Limiting, ...],
    whole: tuple[float, float],
    known: Reach,
    everything: bool,
    complete: bool,
    troubles: list[str],
) -> str:
    parts = ", ".join(interval_words(each) for each in intervals) or "nowhere"
    words = f"Under gamma = {gamma:.6g} equilibria are admissible for alpha in {parts}; {len(limiting)} are limiting"
    double = sum(point.kind == "tangency" for point in limiting)
    words += f" ({double} of them tangencies: double roots, where their number changes with gamma)" if double else ""
    words += ". "
    beyond = {
        "inadmissible": f"beyond |alpha| = {known.alpha:.6g} there is none",
        "admissible": f"the set is unbounded: beyond |alpha| = {known.alpha:.6g} all are admissible",
        "unknown": "the laws do not tell how far the set reaches",
    }[known.outside]
    if not everything:
        beyond += " (not restricted to the range)" if known.outside != "unknown" else ""
    words += f"Searched {interval_words(whole)}; {beyond}."
    if complete:
        return words
    if known.outside == "unknown" and everything:
        words += " Give `alpha` a range to say how far to look."
    return f"{words} Not complete. {' '.join(dict.fromkeys(troubles))}".strip()
