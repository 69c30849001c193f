"""Claim: where many members end is what `predict_limit` says of each alone, whoever is told of beside it."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from benchmarks.limits import TIMES, Drawn, Followed, wrong
from scipy.optimize import brentq

import plastica as pl
from plastica.equilibria import way
from plastica.equilibria.apart import ends_apart
from plastica.equilibria.contraction import chord_slope, contracts
from plastica.equilibria.elastica import ends, profile
from plastica.equilibria.endings import INTERIOR, KINDS, UNDECIDED, Endings, endings
from plastica.equilibria.rest import settle
from plastica.equilibria.settled import settle_many
from plastica.equilibria.statics import statics, symmetric_spectrum
from plastica.material.material import Laws
from tests.support import EPS

Array = np.ndarray

MATERIAL = pl.Material(
    "k*m**2/2 + a*m**4", "c*pos(x)**2", "h*(1 + m**2)*sqrt(1 + q)", {"k": 1.0, "a": 0.1, "c": 1.0, "h": 0.1, "q": 0.0}
)
STRUT = pl.Strut(MATERIAL, pl.Load(thrust=2.0), pl.Grid(nodes=16))
COUNT = 60
UNSETTLED, LATE, WITHOUT_NUMBERS = [7, 8], [20], [33, 34]
"""Members whose thrust goes on varying, or settles after the end of the run; and whose threshold is no number."""


def programs() -> list[pl.programs.Program]:
    """Thrusts of the members: constant but for a few."""
    drawn = np.random.default_rng(5).uniform(0.0, 12.0, COUNT)
    made = [pl.programs.constant(float(value)) for value in drawn]
    made[0], made[1] = pl.programs.constant(0.0), pl.programs.ramp_hold_release(3.0, 1.0, 2.0, 1.0)
    for i in UNSETTLED:
        made[i] = pl.Load(thrust="2 + sin(t)").thrust
    for i in LATE:
        made[i] = pl.programs.ramp_hold_release(3.0, 1.0, 1e4, 1.0)
    return made


def parameters() -> dict[str, Array]:
    rng = np.random.default_rng(6)
    own = {"k": rng.uniform(0.3, 2.0, COUNT), "h": 10.0 ** rng.uniform(-2.0, 0.5, COUNT), "q": np.zeros(COUNT)}
    own["q"][WITHOUT_NUMBERS] = -2.0
    return own


def alone(i: int, curvature: Array, natural: float) -> pl.Limit:
    material = MATERIAL.with_parameters(**{name: float(values[i]) for name, values in parameters().items()})
    thrust = pl.Load(thrust=float(programs()[i](1e6)))
    return pl.predict_limit(pl.Strut(material, thrust, STRUT.grid), curvature, natural)


def check_as_one(until: float) -> set[str]:
    """Kind and stability are the same; the natural curvature to what rounding of the drive can move it by."""
    found = pl.solve_many(
        STRUT, "1 + cos(3*s)", 0.1, programs(), parameters(), until=until, also=["curvature", "limit"], rtol=1e-6
    )
    untold = {*UNSETTLED, *LATE} | ({1} if until < 4.0 else set())
    for i in range(COUNT):
        kind, natural = str(found.limit_kind[i].values), float(found.limit_natural_curvature[i])
        if i in untold:
            assert kind == "", i
            assert np.isnan(natural)
            assert int(found.limit_stable[i]) == -1
            continue
        limit = alone(i, found.curvature[i].values, float(found.natural_curvature[i]))
        assert kind == limit.kind, i
        assert int(found.limit_stable[i]) == (-1 if limit.stable is None else limit.stable)
        if limit.equilibrium is None:
            assert np.isnan(natural)
        else:
            at = limit.equilibrium
            terms = 1.0 + abs(at.mu_nat) + abs(at.drive) + abs(at.ends.arm)
            rate = 1.0 if limit.kind == "interior" else min(1.0, abs(limit.rate))
            assert abs(natural - at.mu_nat) <= 64.0 * EPS * terms / rate, i
    assert set(found.status.values[WITHOUT_NUMBERS]) == {"not_finite"}
    return set(found.limit_kind.values)


@pytest.mark.parametrize(("until", "kinds"), [(0.3, {"", "undecided"}), (100.0, {"", *KINDS})])
def test_as_one(until: float, kinds: set[str]) -> None:
    assert check_as_one(until) >= kinds


def test_other_loads_and_none_to_be_told() -> None:
    """Under other loads nothing is told; under tension neither, for which there is no theory."""
    across = STRUT.with_load(pl.Load(thrust=1.0, transverse=0.1))
    tension = STRUT.with_load(pl.Load(thrust=1.0, allow_tension=True))
    for strut, thrust in ((across, [1.0, 2.0]), (tension, [-1.0, -0.5])):
        found = pl.solve_many(strut, 0.3, thrust=thrust, until=1.0, also=["limit"])
        assert found.limit_kind.values.tolist() == ["", ""]
        assert found.limit_stable.values.tolist() == [-1, -1]


# -- to the last bit -----------------------------------------------------------------------------------------------


@cache
def states() -> tuple[Array, Array, Array, Array]:
    """Thrusts, curvatures, natural curvatures and stiffnesses k of 90 states near equilibria, some at separatrices."""
    rng, s = np.random.default_rng(8), STRUT.grid.s
    gamma = np.where(rng.random(90) < 0.5, rng.uniform(0.0, 3.0, 90), rng.uniform(0.0, 40.0, 90))
    alpha = rng.uniform(-1.0, 1.0, 90) * (2.2 * np.sqrt(gamma) + 1.0)
    alpha[::9] = 2.0 * np.sqrt(gamma[::9]) * (1.0 + 10.0 ** rng.uniform(-13.0, -2.0, 10))
    off, wave = 10.0 ** rng.uniform(-14.0, -3.0, 90), rng.uniform(0.0, 6.0, 90)
    mu = np.asarray(profile(gamma[:, None], alpha[:, None], s).slope) + off[:, None] * np.cos(wave[:, None] * s)
    return gamma, mu, np.asarray(ends(gamma, alpha).mu_nat), rng.uniform(0.1, 2.0, 90)


def told(some: list[int]) -> Endings:
    gamma, mu, mu_nat, k = (each[some] for each in states())
    slow = pl.Strut(MATERIAL.with_parameters(c=0.02), STRUT.load, STRUT.grid)
    return endings(STRUT.grid, gamma, mu, mu_nat, way.laws_of_many(slow, ["k"], k[None]))


def check_apart() -> None:
    """No bit of what is told of a state depends on which others there are, in what order."""
    every = told(list(range(90)))
    assert set(every.kind.tolist()) == {0, 1, 2}
    rng = np.random.default_rng(9)
    for count in (0, 1, 2, 3, 7, 16, 17, 40, 89):
        some = rng.permutation(90)[:count].tolist()
        found = told(some)
        for name in Endings.__dataclass_fields__:
            assert np.array_equal(getattr(found, name), getattr(every, name)[some], equal_nan=True), (name, count)


def test_apart() -> None:
    check_apart()


def check_chunks() -> None:
    """Nor does it depend on the chunks in which the members are integrated."""
    base, pieces = (
        pl.solve_many(STRUT, "1 + cos(3*s)", 0.1, programs(), parameters(), until=20.0, also=["limit"], chunk=chunk)
        for chunk in (8192, 7)
    )
    for name in ("limit_kind", "limit_stable", "limit_natural_curvature"):
        assert np.array_equal(base[name].values, pieces[name].values, equal_nan=base[name].dtype.kind == "f")


def test_chunks() -> None:
    check_chunks()


# -- its parts -----------------------------------------------------------------------------------------------------


def check_settled() -> None:
    """The shapes are those of `rest.settle`, from states at rest and far from it, to what the residual leaves open."""
    rng, grid = np.random.default_rng(10), STRUT.grid
    gamma = np.concatenate([rng.uniform(0.0, 4.0, 20), rng.uniform(4.0, 40.0, 20)])
    mu = rng.uniform(-2.0, 2.0, (40, 1)) + rng.uniform(-2.0, 2.0, (40, 1)) * np.cos(3.0 * grid.s)
    mu[::5] = 1e-3 * mu[::5]
    mu_nat = rng.uniform(-0.5, 0.5, 40)
    found = settle_many(grid, gamma, mu, mu_nat)
    for i in range(40):
        model = STRUT.with_load(pl.Load(thrust=float(gamma[i])))
        one = settle(model, mu[i], float(mu_nat[i]))
        assert bool(found.converged[i]) == one.converged
        slowest = float(np.abs(symmetric_spectrum(statics(model, 0.0)[1](one.mu), model)).min())
        off = np.abs(found.mu[i] - one.mu).max()
        assert off <= 1e-12 * max(1.0, float(np.abs(one.mu).max())) * grid.size / slowest, i


def test_settled() -> None:
    check_settled()


def check_samples() -> None:
    """A stretch of the way is sampled as the closed forms have it, next to the separatrix as well."""
    gamma = np.array([0.0, 0.3, 2.0, 9.0, 25.0, 60.0, 60.0, 150.0])
    alpha = np.array([0.5, -1.0, 2.8, 5.9, 9.99, 15.49, 3.0, 24.4])
    width = np.array([0.05, 0.4, 0.2, 0.3, 0.5, 0.8, 3.0, 1.2])
    way_ = alpha[:, None] + width[:, None] * np.linspace(0.0, 1.0, way.SAMPLES)
    exact = ends(gamma[:, None], way_)
    wanted_of = (exact.arm, exact.mu_nat, exact.theta0_slope)
    for found, wanted in zip(way._sampled(gamma, way_), wanted_of, strict=True):
        largest = np.abs(wanted).max(axis=1, keepdims=True)
        sensitive = np.abs(np.gradient(wanted, axis=1)).max(axis=1, keepdims=True) / (width[:, None] / way.SAMPLES)
        assert (np.abs(found - wanted) <= 256.0 * EPS * (largest + np.abs(way_) * sensitive)).all()


def test_samples() -> None:
    check_samples()


WAYS = {
    "one shape": pl.Material("m**2/2", "pos(x)**2", "0.1"),
    "two shapes": pl.Material("m**2*(m - 1)**2", "pos(x)**2", "0.02"),
    "waves": pl.Material("(1 - cos(3*m))/15", "pos(x)**2", "0.05*(1 + sin(4*m)/2)"),
    "drawn on": pl.Material("-m", "pos(x)**2", "0.001"),
    "a corner": pl.Material("m**2/4", "pos(x)**2", "0.1*(1 + pos(m - 0.5))"),
}


def sampled_root(gamma: float, laws: Laws, alpha: float, side: float, margin: float) -> tuple[int, float]:
    """What `first_roots` finds, written to be read: every sample a closed form."""

    def gap(a: Array | float) -> tuple[Array, Array]:
        end = ends(gamma, a)
        drive = np.asarray(end.arm) - laws.preference.slope(np.asarray(end.mu_nat))
        return side * drive - laws.threshold.value(np.asarray(end.mu_nat)), np.asarray(end.theta0_slope)

    first = float(gap(alpha)[1])
    lower, width = alpha, 0.05 * max(1.0, abs(alpha))
    while abs(lower) <= way.FARTHEST:
        places = lower + np.sign(side * first) * np.linspace(0.0, width, 2001)
        values, slope = gap(places)
        for i in range(2001):
            if slope[i] * first <= 0.0:
                return way.FOLD, np.nan
            if values[i] <= 0.0:
                return way.ARRIVED, brentq(lambda a: float(gap(a)[0]), places[i - 1], places[i], xtol=1e-15)
            turns = 0 < i < 1999 and values[i] < values[i - 1] and values[i] <= values[i + 1]
            if turns and values[i + 1] > 0.0 and slope[i + 1] * first > 0.0 and values[i] <= margin:
                return way.TANGENCY, np.nan
        lower, width = float(places[-1]), 2.0 * width
    return way.ENDLESS, np.nan


def check_first_roots() -> None:
    """The first place with |D| = Theta, or what comes before it, as every sample of the closed forms has it."""
    rng, met = np.random.default_rng(11), set()
    for name, material in WAYS.items():
        laws = material.laws()
        gamma = rng.uniform(0.2, 12.0, 12)
        alpha = rng.uniform(-1.0, 1.0, 12) * (2.0 * np.sqrt(gamma) + 0.5)
        end = ends(gamma, alpha)
        drive = np.asarray(end.arm) - laws.preference.slope(np.asarray(end.mu_nat))
        margin = np.where(rng.random(12) < 0.5, 0.0, 0.5)
        side = np.where(drive > 0.0, 1.0, -1.0)
        start = way.Start(gamma, alpha, np.asarray(end.theta0_slope), side, way.laws_of_all(laws))
        some = np.flatnonzero(np.abs(drive) > laws.threshold.value(np.asarray(end.mu_nat)))
        root, code = way.first_roots(start.of(some), margin[some])
        rate = np.abs(way.rates(start.of(some), ends_apart(gamma[some], np.where(np.isnan(root), 0.0, root))))
        for j, i in enumerate(some):
            wanted, at = sampled_root(gamma[i], laws, alpha[i], side[i], margin[i])
            assert code[j] == wanted, (name, i)
            met.add(wanted)
            if wanted == way.ARRIVED:
                slope = abs(float(ends(gamma[i], at).theta0_slope))
                assert abs(root[j] - at) <= 256.0 * EPS * (1.0 + gamma[i]) / (slope * min(1.0, rate[j])), (name, i)
    assert met == {way.ARRIVED, way.TANGENCY, way.FOLD, way.ENDLESS}


def test_first_roots() -> None:
    check_first_roots()


def check_contraction() -> None:
    """No chord of the sine is steeper than its bound, and no state within the distance moves away from the shape."""
    rng, grid = np.random.default_rng(12), STRUT.grid
    angle, reach = rng.uniform(-9.0, 9.0, 400), 10.0 ** rng.uniform(-3.0, 1.0, 400)
    u = reach[:, None] * np.linspace(-1.0, 1.0, 2000)
    chords = (np.sin(angle[:, None] + u) - np.sin(angle[:, None])) / u
    bound = chord_slope(angle, reach)
    assert (chords <= bound[:, None] + 4.0 * EPS / np.abs(u)).all()
    assert (bound <= np.minimum(1.0, np.cos(angle) + 0.5 * reach + 4.0 * EPS)).all()
    held = 0
    for gamma, alpha, size in zip(*rng.uniform([0.5, -11.0, 0.0], [30.0, 11.0, 1.5], (400, 3)).T, strict=True):
        shape = np.asarray(profile(gamma, alpha, grid.s).slope)
        force, theta = np.full((1, 1), gamma), grid.A @ shape
        if not contracts(grid, force, theta[None, :], np.array([size]))[0]:
            continue
        held += 1
        for _ in range(4):
            off = rng.normal(size=4) @ np.cos(np.outer(np.arange(4), np.pi * grid.s))
            off = size * off / np.sqrt(grid.w @ off**2)
            rate = gamma * grid.B @ (np.sin(theta + grid.A @ off) - np.sin(theta)) - off
            assert grid.w @ (rate * off) < 0.0
    assert 40 <= held <= 300


def test_contraction() -> None:
    check_contraction()


@cache
def random_states() -> tuple[Drawn, Followed]:
    drawn = Drawn.of(100, 7)
    return drawn, Followed.of(drawn)


def check_random_states() -> None:
    """Of random states none is told wrongly, and most of those that yield no more after t = 1 are told by t = 3."""
    drawn, followed = random_states()
    still = followed.good & (followed.mu_nat[-1] == followed.mu_nat[TIMES.index(1.0)])
    assert still.sum() >= 30
    kinds = []
    for i, t in enumerate(TIMES):
        told = drawn.told(followed.mu[i], followed.mu_nat[i])
        assert not (wrong(told, drawn, followed, followed.mu_nat[i]) & followed.good).any(), t
        kinds.append(told.kind)
    assert (kinds[TIMES.index(3.0)][still] != UNDECIDED).mean() >= 0.9
    assert (kinds[TIMES.index(100.0)][followed.good & ~still] != UNDECIDED).mean() >= 0.9


def test_random_states() -> None:
    check_random_states()


PASSING = {6: -0.86670, 65: -0.59543, 72: -1.15253, 138: 1.03413, 425: -0.39696, 440: -1.14499}
"""Random struts that are yielding, so far from their curves that they pass the first end on these: where they end."""


def check_none_is_told_to_stop() -> None:
    drawn = Drawn.of(600, 1)
    found = drawn.told(drawn.mu, drawn.mu_nat)
    for i, end in PASSING.items():
        assert found.kind[i] == UNDECIDED or abs(found.mu_nat[i] - end) <= 1e-4, i


def test_none_is_told_to_stop() -> None:
    check_none_is_told_to_stop()


def test_none_that_arrives() -> None:
    """Members with parameters of their own, none of which comes to |D| = Theta."""
    laws = way.laws_of_many(STRUT, ["h"], np.array([[50.0, 60.0]]))
    found = endings(STRUT.grid, np.array([1.0, 2.0]), np.full((2, 16), 0.1), np.zeros(2), laws)
    assert found.kind.tolist() == [INTERIOR, INTERIOR]
    laws = way.laws_of_many(STRUT, ["h"], np.array([[0.01, 0.02]]))
    found = endings(STRUT.grid, np.array([0.0, 0.5]), np.full((2, 16), 3.0), np.full(2, 2.9), laws)
    assert found.kind.tolist() == [UNDECIDED, UNDECIDED]
