"""Where a state ends: the one equilibrium that the strut's motion converges to, found without waiting for it.

While it yields, a rod that has forgotten its start creeps along the curve of equilibria phi_alpha, its natural
curvature phi_alpha'(1) moving the way of the drive, until |D| = Theta (a limiting equilibrium) or a fold. A rod that
does not yield goes to the static shape of its frozen natural curvature (an interior equilibrium).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from plastica.equilibria.elastica import LARGEST_GAMMA, ends, profile
from plastica.equilibria.equilibrium import Equilibrium, equilibrium
from plastica.equilibria.rest import Rest, settle
from plastica.equilibria.spectrum import spectrum, unstable_count
from plastica.errors import ArgumentError
from plastica.material.material import Laws
from plastica.physics.initial import initial_natural_curvature
from plastica.physics.strut import Strut, uniform_strut

if TYPE_CHECKING:
    import xarray

__all__ = ["Assumption", "Limit", "predict_limit"]

Array = NDArray[np.float64]

SAMPLES = 2001
FARTHEST = 200.0
"""Clamp curvature up to which the way along the curve of equilibria is followed."""

NEAR_FOLD = 1e-6
"""|theta_0'(1)| below which an equilibrium counts as too near a fold to predict anything from it."""

CLEAR = 2.0
"""How many times the state's distance from the curve of equilibria a margin must be to count as clear. Of 540 states on
60 random runs, 1 gave no wrong prediction (332 decided), 0.3 gave 20 wrong ones."""


@dataclass(frozen=True)
class Assumption:
    """Something that a prediction rests on: what, whether it was checked, and in words how."""

    name: str
    checked: bool
    sentence: str


@dataclass(frozen=True)
class Limit:
    """Where a state ends.

    Attributes
    ----------
    kind : str
        "interior" (the natural curvature is frozen, the approach exponential), "limiting" (|D| = Theta, the approach
        algebraic) or "undecided" (too near a fold, a tangency or a switch to tell; the sentence says what would).
    equilibrium : Equilibrium or None
        The end; None only if undecided.
    stable : bool or None
        Whether it is stable: no unstable direction, and attracting along the curve where it is limiting.
    distance : float or None
        Distance of the given state from it, (|mu - nu|^2 + (mu_nat - nu_nat)^2)^(1/2), dimensionless.
    assumptions : tuple of Assumption
        What the prediction rests on.
    rate : float or None
        Interior: the spectral gap, the rate of the exponential approach. Limiting: r of the approach
        dx/dt = -r f(x), x = |D| - Theta.
    exponent, coefficient : float or None
        Limiting: f(x) ~ coefficient x^exponent for small x.
    excess : float or None
        Limiting: x of the equilibrium at the present natural curvature, from which the tail starts.
    sentence : str
        The same in words.
    """

    kind: str
    equilibrium: Equilibrium | None
    stable: bool | None
    distance: float | None
    assumptions: tuple[Assumption, ...]
    rate: float | None
    exponent: float | None
    coefficient: float | None
    excess: float | None
    sentence: str

    def tail(self, later: ArrayLike) -> Array:
        """Return x = |D| - Theta a time `later` (dimensionless) from now, by the law of approach.

        With f(x) = c x^p it is (x_0^(1-p) + (p-1) r c t)^(-1/(p-1)) (errata C); nan where the limit is not limiting.
        """
        t = np.asarray(later, dtype=float)
        if self.kind != "limiting" or not (self.rate and self.coefficient and self.exponent and self.excess):
            return np.full(t.shape, np.nan)
        p, slope = self.exponent, self.rate * self.coefficient
        if abs(p - 1.0) < 1e-9:
            return np.asarray(self.excess * np.exp(-slope * t))
        return np.asarray((self.excess ** (1.0 - p) + (p - 1.0) * slope * t) ** (-1.0 / (p - 1.0)))

    def to_dataset(self) -> xarray.Dataset:
        """Return the numbers as a labelled dataset; those of the equilibrium with it."""
        import xarray

        data = xarray.Dataset() if self.equilibrium is None else self.equilibrium.to_dataset()
        numbers = {name: getattr(self, name) for name in ("distance", "rate", "exponent", "coefficient", "excess")}
        known = {name: value for name, value in numbers.items() if value is not None}
        return data.assign_attrs(kind=self.kind, sentence=self.sentence, **known)

    def __str__(self) -> str:
        return self.sentence


def predict_limit(strut: Strut, mu: ArrayLike, mu_nat: float) -> Limit:
    """Predict where the motion from a state ends, under the present constant thrust.

    Parameters
    ----------
    strut : Strut
        The rod, on a grid with a number of nodes; its load must be a constant thrust alone.
    mu : array_like, shape (n,)
        Curvature at the nodes, in the user's units.
    mu_nat : float
        Natural curvature, in the user's units.

    Returns
    -------
    Limit
        Found by Newton on the right system: phi_alpha'(1) = mu_nat (interior) or |D| = Theta (limiting) on the branch
        that the state is on. Never Newton on F = 0, which has a continuum of solutions.

    Raises
    ------
    ArgumentError
        Where the loads are not a constant thrust, or the state does not fit the grid.

    Notes
    -----
    Limits: a state far from the curve of equilibria, as every run is at its beginning, is "undecided"; integrate
    further and ask again.
    """
    uniform_strut(strut, "strut")
    pushed = not {name for name, _ in strut.loads.sources()} - {"thrust"} and strut.load.is_constant
    if not pushed or strut.loads.thrust(0.0) < 0.0:
        raise ArgumentError(
            "must be a constant thrust alone, not a tension, for a limit to be predicted",
            where="load",
            value=strut.load,
        )
    state = np.asarray(mu, dtype=float) * strut.scales.length
    if state.shape != (strut.grid.size,) or not np.isfinite(state).all():
        raise ArgumentError(f"must be {strut.grid.size} finite nodal values", where="mu", value=state.shape)
    natural = float(initial_natural_curvature(mu_nat, strut.scales, si=strut.specimen is not None))
    return _State(strut, state, natural).limit()


@dataclass(frozen=True, eq=False)
class _State:
    """A dimensionless state under a constant thrust."""

    strut: Strut
    mu: Array
    mu_nat: float

    @property
    def gamma(self) -> float:
        return float(self.strut.loads.thrust(0.0))

    @property
    def laws(self) -> Laws:
        return self.strut.laws

    def limit(self) -> Limit:
        """Predict: the static shape of the present natural curvature first, then which way it moves from there."""
        largest = float(np.abs(self.mu).max(initial=abs(self.mu_nat)))
        if self.gamma > LARGEST_GAMMA or largest**2 + 4.0 * self.gamma > FARTHEST**2:
            return _undecided("its thrust or its curvature is beyond what the curve of equilibria is followed to")
        shape = settle(self.strut, self.mu, self.mu_nat)
        alpha = self._on_curve(shape)
        if alpha is None:
            return _undecided("it is too near a fold, where static shapes meet, or no static shape was found")
        away = float(np.sqrt(self.strut.grid.w @ (self.mu - shape.mu) ** 2))
        drive, threshold = self._drive(alpha), float(self.laws.threshold.value_at(self.mu_nat))
        excess = abs(drive) - threshold
        yielding = abs(float(self.strut.drive(self.mu, self.mu_nat))) > threshold
        if excess + away <= 0.0 and not yielding:
            return self._interior(alpha, away)
        if excess <= CLEAR * away * (1.0 if yielding else 0.0) or excess <= 0.0:
            return _undecided("it is about to start or stop yielding, and where it ends depends on when")
        return self._limiting(alpha, 1.0 if drive > 0.0 else -1.0, away, excess)

    def _on_curve(self, shape: Rest) -> float | None:
        """Clamp curvature of the static shape: Newton on phi_alpha'(1) = mu_nat from what the grid says."""
        if not shape.converged:
            return None
        alpha = float(self.strut.curvature_between([0.0], shape.mu[None, :], [0.0])[0, 0])
        start = alpha
        for _ in range(20):
            end = ends(self.gamma, alpha)
            slope = float(end.theta0_slope)
            if abs(slope) < NEAR_FOLD:
                return None
            change = (float(end.mu_nat) - self.mu_nat) / slope
            alpha -= change
            if abs(change) <= 1e-14 * max(1.0, abs(alpha)):
                break
        return alpha if abs(alpha - start) <= 1e-3 * max(1.0, abs(start)) else None

    def _drive(self, alpha: ArrayLike) -> float:
        end = ends(self.gamma, alpha)
        return float(end.arm - self.laws.preference.slope(np.asarray(end.mu_nat)))

    def _interior(self, alpha: float, away: float) -> Limit:
        found = self._equilibrium(alpha)
        unstable = int(unstable_count(self.gamma, alpha))
        gap = float(spectrum(found).gap) if unstable == 0 else None
        assumptions = (
            Assumption("yields no more", True, "the drive stays within the threshold on all of the rest of the way"),
            Assumption("undisturbed", False, "no disturbance throws it off an unstable shape") if unstable else _STABLE,
        )
        how = (
            f": it approaches exponentially, at the rate {gap:.4g} per retardation time"
            if gap is not None
            else ", but only if nothing disturbs it: that shape is unstable"
        )
        sentence = f"It ends at the static shape of its natural curvature, which is frozen{how}."
        return Limit(
            "interior", found, unstable == 0, self._distance(alpha), assumptions, gap, None, None, None, sentence
        )

    def _limiting(self, alpha: float, side: float, away: float, excess: float) -> Limit:
        """Follow the curve of equilibria the way the drive moves the natural curvature, up to |D| = Theta."""
        root = _first_root(self.gamma, self.laws, alpha, side, CLEAR * away)
        if isinstance(root, str):
            return _undecided(root)
        moved = self._apart(alpha, root)
        if away > moved / CLEAR:
            return _undecided("it has not yet forgotten its start")
        rate = _rate(self.gamma, self.laws, root, side)
        exponent, coefficient = _power(self.laws)
        unstable = int(unstable_count(self.gamma, root))
        stable = unstable == 0 and rate > 0.0
        assumptions = (
            Assumption(
                "has forgotten its start", True, f"it is {away:.1e} from the curve of equilibria, and {moved:.1e} to go"
            ),
            Assumption("no fold on the way", True, "the natural curvature is monotone along the curve up to the end"),
            Assumption(
                "follows the curve", False, "the lag behind the moving static shape stays as small as it is now"
            ),
            _STABLE if stable else Assumption("undisturbed", False, "no disturbance throws it off a saddle"),
        )
        law = _law_in_words(rate, exponent, coefficient)
        sentence = f"It ends where the drive equals the threshold, at the clamp curvature {root:.8g}/L; {law}."
        found = self._equilibrium(root)
        return Limit(
            "limiting", found, stable, self._distance(root), assumptions, rate, exponent, coefficient, excess, sentence
        )

    def _equilibrium(self, alpha: float) -> Equilibrium:
        return equilibrium(self.strut.material, self.gamma, alpha, specimen=self.strut.specimen)

    def _distance(self, alpha: float) -> float:
        shape = profile(self.gamma, alpha, self.strut.grid.s)
        off = float(self.strut.grid.w @ (np.asarray(shape.slope) - self.mu) ** 2)
        return float(np.sqrt(off + (float(ends(self.gamma, alpha).mu_nat) - self.mu_nat) ** 2))

    def _apart(self, one: float, other: float) -> float:
        a, b = (np.asarray(profile(self.gamma, alpha, self.strut.grid.s).slope) for alpha in (one, other))
        return float(np.sqrt(self.strut.grid.w @ (a - b) ** 2))


_STABLE = Assumption("stable", True, "the end has no unstable direction")


def _undecided(why: str) -> Limit:
    sentence = f"Where it ends cannot be told yet: {why}. Integrate further and ask again."
    return Limit("undecided", None, None, None, (), None, None, None, None, sentence)


def _gap(gamma: float, laws: Laws, alpha: ArrayLike, side: float) -> tuple[Array, Array]:
    """G = side D - Theta along the curve of equilibria, and theta_0'(1); both of the shape of alpha."""
    end = ends(gamma, alpha)
    natural = np.asarray(end.mu_nat)
    drive = np.asarray(end.arm) - laws.preference.slope(natural)
    return side * drive - laws.threshold.value(natural), np.asarray(end.theta0_slope)


def _first_root(gamma: float, laws: Laws, alpha: float, side: float, margin: float) -> float | str:
    """First alpha with |D| = Theta on the way, or why there is none to be told."""
    from scipy.optimize import brentq

    start = float(_gap(gamma, laws, alpha, side)[1])
    direction = np.sign(side * start)
    lower, width = alpha, 0.05 * max(1.0, abs(alpha))
    while abs(lower) <= FARTHEST:
        way = lower + direction * np.linspace(0.0, width, SAMPLES)
        gap, slope = _gap(gamma, laws, way, side)
        ends_at = np.nonzero(gap <= 0.0)[0]
        folds = np.nonzero(np.sign(slope) != np.sign(start))[0]
        last = min(int(ends_at[0]) if ends_at.size else SAMPLES, int(folds[0]) if folds.size else SAMPLES)
        dips = np.nonzero((gap[1:-1] < gap[:-2]) & (gap[1:-1] <= gap[2:]) & (gap[1:-1] <= margin))[0] + 1
        if np.any(dips < last - 1):
            return "a tangency, where it may come to rest or just pass, lies on its way"
        if folds.size and folds[0] <= last:
            return "a fold lies on its way, at which it will snap to another shape"
        if ends_at.size:
            if last == 0:
                return alpha
            return float(brentq(lambda a: float(_gap(gamma, laws, a, side)[0]), way[last - 1], way[last], xtol=1e-15))
        lower, width = float(way[-1]), 2.0 * width
    return "it keeps yielding as far as the curve of equilibria was followed"


def _rate(gamma: float, laws: Laws, alpha: float, side: float) -> float:
    """R = -(dG/dalpha)/(dmu_nat/dalpha), G = D - side Theta, from the closed forms (errata C)."""
    end = ends(gamma, alpha)
    natural, dphi, dnat = float(end.mu_nat), float(end.theta0), float(end.theta0_slope)
    drive_slope = dphi - dnat * (1.0 + laws.preference.second_at(natural))
    return -(drive_slope - side * laws.threshold.slope_at(natural) * dnat) / dnat


def _power(laws: Laws) -> tuple[float, float]:
    """Exponent and coefficient of the flow law for small excess drive, from its logarithmic slope at 1e-8."""
    x = 1e-8
    value = laws.flow.value_at(x)
    if not value > 0.0:
        return float("nan"), float("nan")
    exponent = x * laws.flow.slope_at(x) / value
    nearest = round(2.0 * exponent) / 2.0
    exponent = nearest if abs(exponent - nearest) < 1e-5 else exponent
    return exponent, value / x**exponent


def _law_in_words(rate: float, exponent: float, coefficient: float) -> str:
    if not np.isfinite(exponent):
        return "it approaches more slowly than any power of time"
    if abs(exponent - 1.0) < 1e-9:
        return f"it approaches exponentially, at the rate {rate * coefficient:.4g}"
    p = exponent
    return f"|D| - Theta falls like ({(p - 1.0) * rate * coefficient:.4g} t)^(-{1.0 / (p - 1.0):.4g})"
