"""Claim: the classical problems of the elastica, static and dynamic, come out to the digits in which they are known."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from scipy import special

import plastica as pl
from tests.rods import INERTIA, NEVER, last, model, tip

EULER = np.pi**2 / 4
KINDS = {"strut": None, "rod": INERTIA}

# Post-buckled cantilever strut: tip angle in degrees, P/Pcr, x/L, y/L (elliptic integrals, see `buckled`).
BUCKLED = [
    (20, 1.0153968655, 0.9697309074, 0.2194130424),
    (40, 1.0636632664, 0.8812035117, 0.4222403401),
    (60, 1.1517196205, 0.7410196061, 0.5932076462),
    (80, 1.2938893239, 0.5593959190, 0.7194971047),
    (100, 1.5183887933, 0.3489893004, 0.7915394965),
    (120, 1.8848008690, 0.1231599724, 0.8031709900),
    (140, 2.5422583696, -0.1069232376, 0.7503883661),
    (160, 4.0300859660, -0.3403188557, 0.6246035130),
    (176, 9.1162182978, -0.5772111094, 0.4214422961),
]

# Cantilever with a transverse dead force at its tip: P L^2/EI, deflection w/L, shortening u/L, tip angle (elliptic
# integrals and shooting agree to 1e-12).
BENT = [
    (0.2, 0.0663644821, 0.0026465483, 0.0996361630),
    (0.5, 0.1621435757, 0.0159189625, 0.2445336471),
    (2.0, 0.4934574804, 0.1606417208, 0.7817498316),
    (3.0, 0.6032534411, 0.2544201846, 0.9860169467),
    (5.0, 0.7137915236, 0.3876283607, 1.2153681176),
    (6.0, 0.7445711489, 0.4345888287, 1.2836972858),
    (8.0, 0.7849823750, 0.5048277321, 1.3744315067),
    (9.0, 0.7990555275, 0.5318205627, 1.4054653336),
    (10.0, 0.8106090249, 0.5549955978, 1.4302855388),
]


def buckled(degrees: float) -> tuple[float, float, float]:
    """P/Pcr = (2 K/pi)^2, x/L = 2 E/K - 1, y/L = 2 p/K with p = sin(angle/2): the inflectional elastica."""
    p = np.sin(np.radians(degrees) / 2.0)
    first, second = special.ellipk(p * p), special.ellipe(p * p)
    return float((2.0 * first / np.pi) ** 2), float(2.0 * second / first - 1.0), float(2.0 * p / first)


def check_buckled(kind: str) -> None:
    """Ten digits at the table's thrusts would be too few near Pcr, where the deflection is sensitive to them."""
    for degrees, *table in BUCKLED:
        exact = buckled(degrees)
        assert np.abs(np.subtract(exact, table)).max() <= 0.6e-10
        shape = pl.rest(model(pl.Load(thrust=exact[0] * EULER), nodes=40, inertia=KINDS[kind]), "0.3*cos(pi*s/2)")
        assert shape.converged
        assert shape.stable
        assert np.abs(np.subtract(shape.tip, exact[1:])).max() <= 1e-9
        assert abs(shape.mu @ shape.model.grid.w - np.radians(degrees)) <= 1e-9


def check_bent(kind: str) -> None:
    """The same rod pushed sideways, at an angle of a quarter turn, and from below."""
    for force, deflection, shortening, angle in BENT:
        for load, side in ((pl.Load(transverse=force), 1.0), (pl.Load.at_angle(force, "-90 deg"), -1.0)):
            shape = pl.rest(model(load, nodes=32, inertia=KINDS[kind]))
            assert abs(side * shape.tip[1] - deflection) <= 1e-9
            assert abs(1.0 - shape.tip[0] - shortening) <= 1e-9
            assert abs(side * (shape.mu @ shape.model.grid.w) - angle) <= 1e-9


def check_arc(kind: str, couple: float, segments: int = 1) -> None:
    """An end couple bends the rod to the arc x = sin(m)/m, y = (1 - cos(m))/m, at rest and at the end of a motion."""
    made = model(pl.Load(couple=couple), nodes=16, segments=segments, material=NEVER, inertia=KINDS[kind])
    exact = np.array([np.sin(couple), 1.0 - np.cos(couple)]) / couple
    shape = pl.rest(made)
    assert np.abs(shape.mu - couple).max() <= 1e-12
    assert np.abs(shape.tip - exact).max() <= 1e-12
    # The strut's solver leaves what its tolerance allows; the implicit one of the rod contracts to rounding.
    sol = pl.solve(made, "0.2*cos(2*s)", until=60.0, rtol=1e-11 if kind == "strut" else 1e-9)
    assert sol.status.ok
    mu, *_ = last(sol)
    assert np.abs(mu - couple).max() <= 1e-12
    assert np.abs(tip(sol.model, mu) - exact).max() <= 1e-12


def check_settled(kind: str, degrees: float) -> None:
    """A strut let go beside its straight shape comes to rest in the buckled one."""
    thrust, *place = buckled(degrees)
    made = model(pl.Load(thrust=thrust * EULER), nodes=24, material=NEVER, inertia=KINDS[kind])
    sol = pl.solve(made, "0.5*cos(pi*s/2)", until=100.0, rtol=1e-7)
    assert sol.status.ok
    assert np.abs(tip(sol.model, last(sol)[0]) - place).max() <= 1e-9


def check_greenhill(load: pl.Load, weight: float, kind: str = "strut", segments: int = 1) -> None:
    """The straight rod loses stability at this multiple of a unit weight: between it and 1e-9 of it more."""
    for factor, unstable in ((1.0 - 1e-9, 0), (1.0 + 1e-9, 1)):
        heavy = pl.Load(load.thrust, weight=factor * weight, allow_tension=True)
        made = model(heavy, nodes=24, segments=segments, inertia=KINDS[kind])
        assert pl.rest(made).unstable == unstable


@pytest.mark.parametrize("kind", KINDS)
def test_buckled(kind: str) -> None:
    check_buckled(kind)


@pytest.mark.parametrize("kind", KINDS)
def test_bent(kind: str) -> None:
    check_bent(kind)


@pytest.mark.parametrize("couple", [0.5, -1.5, 2.0 * np.pi])
@pytest.mark.parametrize("kind", KINDS)
def test_arc(kind: str, couple: float) -> None:
    check_arc(kind, couple)


def test_full_circle_in_segments() -> None:
    check_arc("rod", 2.0 * np.pi, 3)


@pytest.mark.parametrize("degrees", [60, 100, 140])
@pytest.mark.parametrize("kind", KINDS)
def test_settled(kind: str, degrees: float) -> None:
    check_settled(kind, degrees)


def greenhill() -> float:
    """Heavy column: theta'' + q (1 - s) theta = 0 has q = (3 j/2)^2 with j the first zero of J_{-1/3}: 7.8373474389."""
    from scipy.optimize import brentq

    zero = brentq(lambda x: special.jv(-1.0 / 3.0, x), 1.5, 2.2, xtol=1e-15)
    return float((1.5 * zero) ** 2)


@pytest.mark.parametrize(("kind", "segments"), [("strut", 1), ("rod", 1), ("strut", 4)])
def test_heavy_column(kind: str, segments: int) -> None:
    assert abs(greenhill() - 7.8373474389) <= 0.6e-10
    check_greenhill(pl.Load(), greenhill(), kind, segments)


def test_thrust_and_weight_together() -> None:
    """theta'' + (gamma + q (1 - s)) theta = 0 in Airy functions: Ai, Bi at x(s) = -(gamma + q (1 - s))/q^(2/3)."""
    from scipy.optimize import brentq

    def straight_rod_is_marginal(q: float, gamma: float) -> float:
        clamp, free = -(gamma + q) / q ** (2.0 / 3.0), -gamma / q ** (2.0 / 3.0)
        at_clamp, at_free = special.airy(clamp), special.airy(free)
        return float(at_clamp[0] * at_free[3] - at_clamp[2] * at_free[1])

    for gamma in (1.0, -2.0):
        q = brentq(straight_rod_is_marginal, 2.0, 16.0, args=(gamma,), xtol=1e-14)
        check_greenhill(pl.Load(thrust=gamma, allow_tension=True), float(q))


def test_a_hanging_rod_is_stable_under_any_weight() -> None:
    for weight in (7.9, 50.0, 300.0):
        assert pl.rest(model(pl.Load(weight=weight, weight_angle=np.pi), nodes=40)).unstable == 0


PUSH = "1.5*sin(t)**2*step(pi - t)"
EXTRAPOLATED = np.array([0.9906418, -0.1267515])
"""Tip at t = 5 to which the mesh sequence of the 40-cell scheme of BEAM extrapolates."""


@cache
def beam(nodes: int, rtol: float) -> tuple[float, float, float]:
    """BEAM of the IVP test set: x and y of the tip at t = 5, and the residual of the ledger over the energy."""
    elastic = {"translational_inertia": 1.0, "rotary_inertia": 0.0, "damping": 0.0}
    made = model(pl.Load(thrust=PUSH, transverse=PUSH), nodes=nodes, material=NEVER, inertia=elastic)
    sol = pl.solve(made, until=5.0, rtol=rtol)
    assert sol.status.ok
    x, y = tip(sol.model, last(sol)[0])
    return float(x), float(y), abs(sol.ledger.residual) / sol.ledger.largest_energy


def check_beam() -> None:
    """Each refinement, in space or in time, lands on the limit of the equation; the last two agree far below 1e-6."""
    steps = [beam(6, 1e-6), beam(8, 1e-6), beam(12, 1e-7), beam(16, 1e-7)]
    tips = np.array([found[:2] for found in steps])
    errors = np.abs(tips[:-1] - tips[-1]).max(axis=1)
    assert errors[0] <= 1e-5
    assert errors[1] <= 1e-6
    assert errors[2] <= 2e-8
    # The sequence extrapolates to seven digits, the last of them by one unit off.
    assert np.abs(tips[-1] - EXTRAPOLATED).max() <= 1e-7
    assert steps[-1][2] <= 1e-6


def test_beam() -> None:
    check_beam()
