"""The three critical thrusts of a material: where natural curvature grows, where a gap opens, and Euler's load."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from plastica.charts.gap import gap
from plastica.charts.starts import no_straight_rod
from plastica.equilibria.elastica import ends
from plastica.equilibria.reach import FALLBACK, reach
from plastica.errors import ArgumentError
from plastica.material.material import Laws, Material
from plastica.physics.laws import laws_of
from plastica.physics.scales import Specimen, unit_of

if TYPE_CHECKING:
    import xarray

__all__ = ["EULER", "Thresholds", "thresholds"]

Array = NDArray[np.float64]

EULER = 0.25 * math.pi**2
"""Thrust at which the straight rod loses its stability at frozen natural curvature."""

LARGEST_GAMMA = 100.0
"""Thrust up to which a gap is looked for: forty times Euler's load."""

STEP = 0.02
"""Step of the search in gamma^(1/2), and two thirds of that in alpha where it is not small."""

FARTHEST = 1e5
"""Clamp curvature up to which the central component is followed."""

CHUNK = 25
JUMP = 4
"""Places by which the end of the central component must move within one halving after another to count as a jump."""

HALVINGS = 30


@dataclass(frozen=True)
class Thresholds:
    """The three critical thrusts, dimensionless (errata E).

    Attributes
    ----------
    gamma_star : float or None
        Beyond it natural curvature that yields grows near the straight rod, below it relaxes back: tan x =
        (1 + kappa''(0)) x, gamma* = x^2. 0 where kappa''(0) = 0, so that it grows under every thrust; None where
        kappa''(0) does not exist.
    gamma_star_star : float or None
        The least thrust at which a double root of |D| = Theta appears inside the component of the admissible set that
        contains the straight rod: beyond it a rod that is pushed past the gap creeps away for good. Below it a rod may
        do so too, where the admissible set has other components (several wells): see `capacity`. None where there is
        none up to 100.
    alpha_star_star : float or None
        Clamp curvature (> 0) of this double root.
    euler : float
        pi^2 / 4: the straight rod is unstable beyond, at frozen natural curvature.
    sentences : tuple of str
        The three in words, in this order; with thrusts in N for a specimen.
    specimen : Specimen or None
        What the material is made into.
    """

    gamma_star: float | None
    gamma_star_star: float | None
    alpha_star_star: float | None
    euler: float
    sentences: tuple[str, str, str]
    specimen: Specimen | None = None

    def to_dataset(self) -> xarray.Dataset:
        """Return the critical thrusts and the clamp curvature as labelled numbers, nan for None: SI with a specimen."""
        import xarray

        rows = (
            ("gamma_star", "force", "thrust beyond which yielding natural curvature grows", self.gamma_star),
            ("gamma_star_star", "force", "thrust at which the central component splits", self.gamma_star_star),
            ("alpha_star_star", "curvature", "clamp curvature at which it splits", self.alpha_star_star),
            ("euler", "force", "Euler's load of the straight rod", self.euler),
        )
        data = {}
        for name, kind, words, value in rows:
            number = math.nan if value is None else value
            scaled = number if self.specimen is None else self.specimen.scales.to_si(kind, number)
            data[name] = ((), scaled, {"units": unit_of(kind, self.specimen is None), "long_name": words})
        facts = {"title": "critical thrusts of a strut", "sentence": " ".join(self.sentences)}
        return xarray.Dataset(data, attrs=facts)

    def __str__(self) -> str:
        return "\n".join(self.sentences)


def thresholds(material: Material, *, specimen: Specimen | None = None) -> Thresholds:
    """Find the three critical thrusts of a material.

    With D(alpha) = phi(1) - phi'(1) - kappa'(phi'(1)) along the equilibria of a thrust gamma (errata E): gamma* is
    where dD/dalpha(0) = 0, gamma** the least gamma with a solution of G = |D| - Theta = 0, dG/dalpha = 0 inside the
    component of {G <= 0} that contains 0, and pi^2/4 is Euler's load.

    Parameters
    ----------
    material : Material
        The laws, taken to be even; the flow law does not matter.
    specimen : Specimen, optional
        What the material is made into, where its parameters carry units.

    Returns
    -------
    Thresholds

    Raises
    ------
    ArgumentError
        Where the material is none, its parameters carry units and there is no specimen, or the straight rod is no
        equilibrium of it.

    Notes
    -----
    gamma** is located by a search over gamma up to 100 in steps of 0.02 in gamma^(1/2), each thrust sampled along alpha
    at steps of 0.03 or less, and closed in on by halving; then, with alpha(gamma) the local maximum of G (a root of the
    closed form of dG/dalpha), by Newton's method on max G, whose slope is dG/dgamma. Its accuracy is that of G: some
    eps/|dG/dgamma|. What could be missed: a gap that opens and closes again between two thrusts of the search, or one
    whose hump is narrower than the sampling.

    Checked by test_reference_thresholds.

    Examples
    --------
    >>> import plastica as pl
    >>> found = thresholds(pl.Material("m**2/2", "pos(x)**2", "0.1"))
    >>> print(f"{found.gamma_star:.6f} {found.gamma_star_star:.6f} {found.alpha_star_star:.4f}")
    1.358533 1.618555 0.9219
    """
    if not isinstance(material, Material):
        raise ArgumentError("must be a pl.Material", where="material", value=material)
    if specimen is not None and not isinstance(specimen, Specimen):
        raise ArgumentError("must be a pl.Specimen or None", where="specimen", value=specimen)
    laws = laws_of(material, specimen)
    if not abs(laws.preference.slope_at(0.0)) <= laws.threshold.value_at(0.0):
        raise no_straight_rod()
    star, split = _gamma_star(laws), _split(laws)
    double, place = split if split is not None else (None, None)
    sentences = (_star_words(star, specimen), _split_words(split, specimen), _euler_words(specimen))
    return Thresholds(star, double, place, EULER, sentences, specimen)


def _gamma_star(laws: Laws) -> float | None:
    """Solve (sin x - x cos x) / (x cos x) = kappa''(0) on (0, pi/2), where the left side grows from 0 to infinity."""
    from scipy.optimize import brentq

    stiffness = laws.preference.second_at(0.0)
    if math.isnan(stiffness):
        return None
    if stiffness <= 0.0:
        return 0.0
    if math.isinf(stiffness):
        return EULER
    # the equation holds at x = 0 too: x^2/3 <= tan x/x - 1 keeps clear of it
    low = 0.1 * min(math.sqrt(3.0 * stiffness), 1.0)
    x = brentq(lambda x: _lever(x) - stiffness * x * math.cos(x), low, 0.5 * math.pi, xtol=1e-300, rtol=1e-15)
    return float(x) ** 2


def _lever(x: float) -> float:
    """Return sin x - x cos x, as a series where the difference would lose digits."""
    if x > 1.0:
        return math.sin(x) - x * math.cos(x)
    term, total = x, 0.0
    for k in range(1, 14):
        term *= -x * x / (2.0 * k * (2.0 * k + 1.0))
        total -= 2.0 * k * term
    return total


def _split(laws: Laws) -> tuple[float, float] | None:
    """Find the least thrust at which a gap opens inside the central component, and where; None if there is none."""
    steps = np.arange(1, round(math.sqrt(LARGEST_GAMMA) / STEP) + 1) * STEP
    before: _Edge | None = None
    for chunk in np.array_split(steps, math.ceil(steps.size / CHUNK)):
        alpha = _places(float(chunk[-1]) ** 2, laws)
        if before is not None:
            before = _edge(before.gamma, alpha, laws)
        for root in chunk:
            edge = _edge(float(root) ** 2, alpha, laws)
            if before is not None and (edge.place < before.place - JUMP or edge.side * before.side < 0):
                found = _jump(before, edge, alpha, laws)
                if found is not None:
                    return found
            before = edge
    return None


class _Edge(NamedTuple):
    """Where the central component ends: the first place outside, and the sign of D there (0: nowhere)."""

    gamma: float
    place: int
    side: int


def _places(gamma: float, laws: Laws) -> Array:
    """Clamp curvatures from 0 as far as limiting equilibria can lie, dense on every scale."""
    far = reach(gamma, laws).alpha
    root = math.sqrt(gamma)
    end = min(far if math.isfinite(far) else FALLBACK + 4.0 * root, FARTHEST)
    near = min(end, 2.0 * root + 4.0)
    step = min(1.5 * STEP, near / 300.0)
    small = np.geomspace(1e-9, step, 200)
    beyond = np.geomspace(near, end, math.ceil(math.log(end / near) / 0.015) + 2) if end > near else np.zeros(0)
    return np.unique(np.concatenate([small, np.arange(step, near, step), beyond]))


def _edge(gamma: float, alpha: Array, laws: Laws) -> _Edge:
    """Go along alpha from 0 on to the first place that is not admissible."""
    end = ends(gamma, alpha)
    drive = end.arm - laws.preference.slope(end.mu_nat)
    outside = np.abs(drive) > laws.threshold.value(end.mu_nat)
    if not outside.any():
        return _Edge(gamma, alpha.size, 0)
    place = int(np.argmax(outside))
    return _Edge(gamma, place, 1 if drive[place] > 0.0 else -1)


def _jump(low: _Edge, high: _Edge, alpha: Array, laws: Laws) -> tuple[float, float] | None:
    """Halve toward an inward jump of the edge; None where it only moves quickly, or jumps outward.

    The edge cannot go from D = -Theta to D = Theta but by a jump: where its side changes, that is followed.
    """
    for _ in range(HALVINGS):
        middle = _edge(0.5 * (low.gamma + high.gamma), alpha, laws)
        if low.side * high.side < 0 and middle.side != 0:
            first = middle.side != low.side
        else:
            first = low.place - middle.place > middle.place - high.place
        low, high = (low, middle) if first else (middle, high)
        if low.place - high.place <= JUMP and low.side == high.side:
            return None
    inward = low.place > high.place if low.side * high.side < 0 else low.place > high.place + JUMP
    return _double_root(high.gamma, high.place, alpha, laws) if inward else None


def _double_root(gamma: float, hump: int, alpha: Array, laws: Laws) -> tuple[float, float] | None:
    """Newton on max G over the hump that has just reached 0 at a place; its slope in gamma is that of G."""
    from scipy.optimize import brentq

    end = ends(gamma, alpha[hump])
    side = 1.0 if float(end.arm) > laws.preference.slope_at(float(end.mu_nat)) else -1.0

    def slope(a: float) -> float:
        return float(gap(gamma, a, side, laws).by_alpha)

    for reached in (1, 2, 4, 8, 16):
        left, right = float(alpha[max(hump - reached, 0)]), float(alpha[min(hump + reached, alpha.size - 1)])
        if slope(left) > 0.0 > slope(right):
            break
    else:
        return None
    place = 0.5 * (left + right)
    for _ in range(30):
        place = float(brentq(slope, left, right, xtol=1e-300, rtol=1e-15))
        here = gap(gamma, place, side, laws)
        change = float(here.value / here.by_gamma)
        gamma -= change
        if not (math.isfinite(change) and slope(left) > 0.0 > slope(right)):
            return None
        if abs(change) <= 2.0 * np.finfo(float).eps * gamma:
            break
    return gamma, float(brentq(slope, left, right, xtol=1e-300, rtol=1e-15))


def _thrust_words(gamma: float, specimen: Specimen | None) -> str:
    if specimen is None:
        return f"{gamma:.8g}"
    return f"{gamma:.8g} ({specimen.scales.to_si('force', gamma):.6g} N)"


def _star_words(star: float | None, specimen: Specimen | None) -> str:
    if star is None:
        return "gamma* does not exist: the preference energy has no second derivative at 0."
    if star == 0.0:
        return "gamma* = 0: nothing pulls a small natural curvature back, so what yields grows under every thrust."
    words = _thrust_words(star, specimen)
    return (
        f"gamma* = {words}: near the straight rod, natural curvature that yields relaxes back below it, grows above it."
    )


def _split_words(split: tuple[float, float] | None, specimen: Specimen | None) -> str:
    if split is None:
        return (
            "gamma** does not exist: no double root of |D| = Theta appears inside the component of the straight rod up "
            f"to gamma = {LARGEST_GAMMA:g}, where the search ends."
        )
    words = _thrust_words(split[0], specimen)
    return (
        f"gamma** = {words}: above it a gap, which opens at the clamp curvature {split[1]:.6g}/L, parts the shapes "
        "near the straight one from those to which a rod that is pushed past it creeps (other gaps may lie further "
        "out, also below it)."
    )


def _euler_words(specimen: Specimen | None) -> str:
    words = _thrust_words(EULER, specimen)
    return f"pi^2/4 = {words}: Euler's load, above which the straight rod is unstable even if it does not yield."
