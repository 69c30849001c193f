"""Where a state ends: the one equilibrium that the strut's motion converges to, found without waiting for it.

While it yields, a rod that has forgotten its start creeps along the curve of equilibria phi_alpha, its natural
curvature phi_alpha'(1) moving the way of the drive, until |D| = Theta (a limiting equilibrium) or a fold. A rod that
does not yield goes to the static shape of its frozen natural curvature (an interior equilibrium). Both are said only
where the state is certainly held: within a ball about that shape which no motion leaves (`equilibria.contraction`), or
so close to the curve that it cannot pass the end (`equilibria.creep`).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from plastica.equilibria.elastica import profile
from plastica.equilibria.endings import INTERIOR, UNDECIDED, WHY, Endings, distance_between, endings
from plastica.equilibria.equilibrium import Equilibrium, equilibrium
from plastica.equilibria.spectrum import spectrum
from plastica.equilibria.way import laws_of_all
from plastica.errors import ArgumentError
from plastica.material.material import Laws
from plastica.physics.initial import initial_natural_curvature
from plastica.physics.model import Model
from plastica.physics.strut import Strut, uniform_strut

if TYPE_CHECKING:
    import xarray

__all__ = ["Assumption", "Limit", "predict_limit", "untold"]

Array = NDArray[np.float64]

LARGEST_POWER = 35.0
"""1e-8 to this power is still a normal number."""


def _law_in_words(rate: float, exponent: float, coefficient: float) -> str:
    if not np.isfinite(exponent):
        return "how fast cannot be told, for there its flow law is like no power of the excess drive"
    if abs(exponent - 1.0) < 1e-9:
        return f"it approaches exponentially, at the rate {rate * coefficient:.4g}"
    p = exponent
    return f"|D| - Theta falls like ({(p - 1.0) * rate * coefficient:.4g} t)^(-{1.0 / (p - 1.0):.4g})"


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
        algebraic) or "undecided" (too early, or too near a fold, a tangency or a switch to tell; the sentence says
        which).
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
        Limiting: x of the equilibrium at the present natural curvature, from which the tail starts; 0 where it is below
        what the tolerance can tell.
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

        With f(x) = c x^p it is (x_0^(1-p) + (p-1) r c t)^(-1/(p-1)) (errata C); 0 where the excess is, and nan where
        the limit is not limiting.
        """
        t = np.asarray(later, dtype=float)
        if self.kind == "limiting" and self.excess == 0.0:
            return np.zeros(t.shape)
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


def predict_limit(strut: Model, mu: ArrayLike, mu_nat: float, *, rtol: float = 0.0) -> Limit:
    """Predict where the motion from a state ends, under the present constant thrust.

    Parameters
    ----------
    strut : Strut, or Rod without inertia
        The rod, on a grid with a number of nodes; its load must be a constant thrust alone.
    mu : array_like, shape (n,)
        Curvature at the nodes, in the user's units.
    mu_nat : float
        Natural curvature, in the user's units.
    rtol : float
        Relative tolerance of the run that the state comes from. Where |D| and Theta agree to within it, the end is
        limiting, or undecided: on which side of the threshold the rod is then says nothing.

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
    Limits: a state far from the curve of equilibria, as most are at their beginning, is "undecided"; integrate further
    and ask again. Of random rods that yield no more, 96 % are decided after 3 retardation times, and of those that go
    on yielding, 95 % after 30 (``python -m benchmarks limits``). A rod that has a long way to go along the curve, with
    the drive far above the threshold in between, stays "undecided" until it has gone most of it.
    """
    strut = uniform_strut(strut, "strut")
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
    gamma = float(strut.loads.thrust(0.0))
    laws, one = laws_of_all(strut.laws), np.ones(1)
    found = endings(strut.grid, gamma * one, state[None, :], natural * one, laws, rtol)
    if found.kind[0] == UNDECIDED:
        return _undecided(WHY[found.why[0]])
    return _Told(strut, gamma, state, natural, found).limit()


@dataclass(frozen=True, eq=False)
class _Told:
    """Where a dimensionless state under a constant thrust ends, to be put in words."""

    strut: Strut
    gamma: float
    mu: Array
    mu_nat: float
    found: Endings

    @property
    def alpha(self) -> float:
        return float(self.found.alpha[0])

    @property
    def stable(self) -> bool:
        return bool(self.found.stable[0])

    def limit(self) -> Limit:
        return self._interior() if self.found.kind[0] == INTERIOR else self._limiting()

    def _interior(self) -> Limit:
        end = self._equilibrium()
        gap = float(spectrum(end).gap) if self.stable else None
        assumptions = (
            Assumption("yields no more", True, "the drive stays within the threshold on all of the rest of the way"),
            _STABLE
            if self.stable
            else Assumption("undisturbed", False, "no disturbance throws it off an unstable shape"),
        )
        how = (
            f": it approaches exponentially, at the rate {gap:.4g} per retardation time"
            if gap is not None
            else ", but only if nothing disturbs it: that shape is unstable"
        )
        sentence = f"It ends at the static shape of its natural curvature, which is frozen{how}."
        return Limit(
            "interior", end, self.stable, self._distance(), assumptions, gap, None, None, None, sentence
        )

    def _limiting(self) -> Limit:
        rate, away, now = (float(each[0]) for each in (self.found.rate, self.found.away, self.found.now))
        moved = distance_between(self.gamma, now, self.alpha, self.strut.grid)
        exponent, coefficient = _power(self.strut.laws)
        assumptions = (
            Assumption(
                "has forgotten its start", True, f"it is {away:.1e} from the curve of equilibria, and {moved:.1e} to go"
            ),
            Assumption("no fold on the way", True, "the static shapes up to the end are stable"),
            Assumption(
                "follows the curve", True, "its distance from the curve stays below a share of the excess"
            ),
            _STABLE,
        )
        law = _law_in_words(rate, exponent, coefficient)
        sentence = f"It ends where the drive equals the threshold, at the clamp curvature {self.alpha:.8g}/L; {law}."
        return Limit(
            "limiting",
            self._equilibrium(),
            self.stable,
            self._distance(),
            assumptions,
            rate,
            exponent,
            coefficient,
            float(self.found.excess[0]),
            sentence,
        )

    def _equilibrium(self) -> Equilibrium:
        return equilibrium(self.strut.material, self.gamma, self.alpha, specimen=self.strut.specimen)

    def _distance(self) -> float:
        shape = profile(self.gamma, self.alpha, self.strut.grid.s)
        off = float(self.strut.grid.w @ (np.asarray(shape.slope) - self.mu) ** 2)
        return float(np.sqrt(off + (float(self.found.mu_nat[0]) - self.mu_nat) ** 2))


_STABLE = Assumption("stable", True, "the end has no unstable direction")


def _undecided(why: str) -> Limit:
    sentence = f"Where it ends cannot be told yet: {why}. Integrate further and ask again."
    return Limit("undecided", None, None, None, (), None, None, None, None, sentence)


def untold(error: Exception) -> Limit:
    """Return the limit of a motion for which an error keeps it from being computed."""
    why = f"{type(error).__name__}: {error}".split("\n")[0][:200]
    return _undecided(f"computing it fails ({why})")


def _power(laws: Laws) -> tuple[float, float]:
    """Exponent and coefficient of the flow law for small excess drive, from its logarithmic slope at 1e-8.

    Not a number where the law is no power there: the slope at 2e-8 is another, or the coefficient no double can hold.
    """
    slopes, x = [], 1e-8
    for place in (2.0 * x, x):
        value = laws.flow.value_at(place)
        if not value > 0.0:
            return float("nan"), float("nan")
        slopes.append(place * laws.flow.slope_at(place) / value)
    before, exponent = slopes
    nearest = round(2.0 * exponent) / 2.0
    exponent = nearest if abs(exponent - nearest) < 1e-5 else exponent
    power = x**exponent if abs(exponent) < LARGEST_POWER else 0.0
    if abs(before - exponent) > 0.01 * abs(exponent) or power == 0.0:
        return float("nan"), float("nan")
    return exponent, value / power
