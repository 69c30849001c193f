"""Claim: section 3 of the paper, statement by statement: the strut, its rate, V, equilibria, linearisation."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.polynomial import Legendre
from scipy.integrate import solve_ivp

import plastica as pl
from plastica.equilibria.linear import linearisation
from plastica.physics.kernel import kernel
from plastica.physics.ledger import liapunov
from tests import spelled
from tests.support import EPS, pair

Array = Any
GAMMA = 3.0
POINTS = [(0.5, 0.3), (3.0, 1.2), (8.0, -3.0), (8.0, 5.9)]
"""Thrusts and clamp curvatures; the last one rotates."""


def strut(gamma: float = GAMMA, nodes: int = 24) -> pl.Strut:
    return pl.Strut(spelled.material(), pl.Load(thrust=gamma), pl.Grid(nodes=nodes))


def pendulum(gamma: float, alpha: float, s: Array) -> tuple[Array, Array]:
    """phi and phi' from phi'' + gamma sin phi = 0, phi(0) = 0, phi'(0) = alpha, step by step."""
    found = solve_ivp(
        lambda _, y: [y[1], -gamma * np.sin(y[0])], (0.0, 1.0), [0.0, alpha], "DOP853", s, rtol=1e-13, atol=1e-14
    )
    return found.y[0], found.y[1]


# -- 3.11 to 3.36: the strut and its right-hand side ----------------------------------------------------------------


def check_strut_ends() -> None:
    sol = pl.solve(strut(nodes=32), "1.2*cos(2*s) + 0.4", 0.3, until=2.0, times=[0.5, 2.0])
    grid = sol.grid
    f = {name: sol.dataset[name].values for name in ("angle", "x", "y", "couple", "shear", "tension")}
    allowed = spelled.slack(grid, *f.values()) / grid.size**2
    for name in ("angle", "x", "y"):
        assert np.abs(spelled.at(grid, f[name], 0.0)).max() <= allowed
    assert np.abs(spelled.at(grid, f["couple"], 1.0)).max() <= allowed
    assert np.abs(f["couple"]).max() > 0.1
    sin, cos = np.sin(f["angle"]), np.cos(f["angle"])
    assert np.abs(f["tension"] * cos - f["shear"] * sin + GAMMA).max() <= 8.0 * EPS * GAMMA
    assert np.abs(f["tension"] * sin + f["shear"] * cos).max() <= 8.0 * EPS * GAMMA
    assert np.abs(f["shear"] - GAMMA * sin).max() <= 8.0 * EPS * GAMMA


def test_clamp_and_dead_thrust() -> None:
    """Paper 3.11, 3.12: r(0) = 0, theta(0) = 0, n = -beta i, M(1) = 0; so H = beta sin theta."""
    check_strut_ends()


def check_right_hand_side() -> None:
    model = strut(nodes=40)
    fast = kernel(model, 0.0, 1.0)
    for mu, m in spelled.shapes():
        exact, natural = spelled.rate(mu, m, GAMMA, model.grid.s)
        nodal = mu(model.grid.s)
        scale = np.abs(exact).max() + abs(natural) + np.abs(nodal).max() + GAMMA
        slow = model.rate(0.0, nodal, m)
        assert np.abs(slow[0] - exact).max() <= 1000.0 * EPS * scale
        assert abs(float(slow[1]) - natural) <= 1000.0 * EPS * scale**2
        quick = fast.rate(0.0, np.concatenate([nodal, [m], np.zeros(3)]))[:41]
        assert np.abs(quick - np.append(exact, natural)).max() <= 1000.0 * EPS * scale**2


def test_right_hand_side() -> None:
    """Paper 3.17–3.21: F, by a quadrature of its own for every place."""
    check_right_hand_side()


def check_expansion() -> None:
    """F(y + h x) - F(y) - h DF x is of order h^2, both components; with any term of DF wrong it would be h."""
    model = strut()
    fast, n, steps = kernel(model, 0.0, 1.0), model.grid.size, np.array([1e-1, 1e-2, 1e-3])
    for mu, m in spelled.shapes():
        y = np.concatenate([mu(model.grid.s), [m], np.zeros(3)])
        x = np.concatenate([np.cos(3.0 * model.grid.s), [0.7], np.zeros(3)])
        linear = (fast.jacobian(0.0, y) @ x)[: n + 1]
        left = [(fast.rate(0.0, y + h * x) - fast.rate(0.0, y))[: n + 1] - h * linear for h in steps]
        for part in (slice(0, n), slice(n, n + 1)):
            size = np.array([np.abs(each[part]).max() for each in left])
            scale = 1.0 + np.abs(linear).max() + np.abs(y).max()
            # The flow law is quadratic beyond its threshold and begins there: its remainder is at most of order h^2.
            assert np.all(size <= 10.0 * scale**2 * steps**2 + 1000.0 * EPS * scale**2)


def test_expansion_of_the_right_hand_side() -> None:
    """Paper 3.22–3.24, 3.25–3.36, corrected: the derivative of F, and that the remainder is of second order."""
    check_expansion()


# -- 3.41 to 3.48: the Liapunov function ------------------------------------------------------------------------------


def check_liapunov() -> None:
    model, step = strut(), 1e-3
    for mu, m in spelled.shapes():
        nodal = mu(model.grid.s)
        exact = spelled.liapunov(mu, m, GAMMA)
        assert abs(float(liapunov(model, 0.0, nodal, m)) - exact) <= 100.0 * EPS * (10.0 + abs(exact))
        mu_t, m_t = spelled.rate(mu, m, GAMMA, model.grid.s)
        lost = -float(model.grid.w @ mu_t**2) - abs(spelled.drive(mu, m) * m_t)
        size = step / max(1.0, np.abs(mu_t).max(), abs(m_t))
        values = [float(liapunov(model, 0.0, nodal + k * size * mu_t, m + k * size * m_t)) for k in (-2, -1, 1, 2)]
        slope = float(np.array([1.0, -8.0, 8.0, -1.0]) @ values) / (12.0 * size)
        # Fourth order over steps of 1e-3 at most, and rounding over the step.
        scale = 10.0 + abs(lost) + np.abs(values).max()
        assert abs(slope - lost) <= (100.0 * step**4 + 10.0 * EPS / size) * scale


def test_the_liapunov_function_and_its_rate() -> None:
    """Paper 3.41–3.48: V, and dV/dt = -int mu_t^2 - |D mu_nat_t|, by differences of V along F."""
    check_liapunov()


# -- 3.52 to 3.62: equilibria, and the linearisation ------------------------------------------------------------------


def check_conditions(gamma: float, alpha: float) -> None:
    """The states of the pendulum are zeros of F; how far the drive is above Theta decides for the second component."""
    model = strut(gamma, 40)
    phi, nu = pendulum(gamma, alpha, model.grid.s)
    end_phi, end = pendulum(gamma, alpha, np.array([1.0]))
    found = pl.equilibrium(spelled.material(), gamma, alpha)
    scale = 1.0 + gamma + abs(alpha)
    mu_t, m_t = model.rate(0.0, found.curvature(model.grid.s), found.mu_nat)
    assert np.abs(mu_t).max() <= 1e-12 * scale
    assert np.abs(found.phi(model.grid.s) - phi).max() <= 1e-11 * scale
    assert np.abs(found.curvature(model.grid.s) - nu).max() <= 1e-11 * scale
    assert abs(found.mu_nat - end[0]) <= 1e-11 * scale
    d = float(end_phi[0] - end[0]) - spelled.kappa_slope(float(end[0]))
    assert found.admissible == (abs(d) <= spelled.threshold(float(end[0])))
    assert (float(m_t) == 0.0) == found.admissible


@pytest.mark.parametrize(("gamma", "alpha"), [*POINTS, (3.0, 0.1), (0.0, 0.4)])
def test_conditions_of_equilibrium(gamma: float, alpha: float) -> None:
    """Paper 3.52–3.54: an equilibrium is F_1 = 0 and |D| <= Theta; from the pendulum, 3.55, integrated step by step."""
    check_conditions(gamma, alpha)


def excess(gamma: float, alpha: float) -> float:
    """|phi(1) - phi'(1) - kappa'(phi'(1))| - Theta(phi'(1))."""
    phi, nu = (float(each[0]) for each in pendulum(gamma, alpha, np.array([1.0])))
    return abs(phi - nu - spelled.kappa_slope(nu)) - spelled.threshold(nu)


def check_intervals(gamma: float) -> None:
    found = pl.equilibria(spelled.material(), gamma, alpha=(-6.0, 6.0))
    assert found.intervals
    ends = [end for interval in found.intervals for end in interval]
    inner = [end for end in ends if abs(end) < 6.0]
    assert len(inner) >= 2
    for end in inner:
        assert abs(excess(gamma, end)) <= 1e-10 * (1.0 + gamma)
    for alpha in np.linspace(-6.0, 6.0, 61):
        if min(abs(alpha - end) for end in ends) > 1e-6:
            inside = any(low <= alpha <= high for low, high in found.intervals)
            assert (excess(gamma, float(alpha)) <= 0.0) == inside, alpha


@pytest.mark.parametrize("gamma", [0.5, 3.0])
def test_the_condition_at_the_end(gamma: float) -> None:
    """Paper 3.56: the intervals of equilibria are where |phi(1) - phi'(1) - kappa'(phi'(1))| <= Theta(phi'(1))."""
    check_intervals(gamma)


def check_around_the_straight_rod(gamma: float) -> None:
    """The straight rod is one, and so are all with |alpha| < delta; delta from the drive's own slope at 0."""
    material = spelled.material()
    model = strut(gamma, 32)
    straight = model.rate(0.0, np.zeros(32), 0.0)
    assert not np.any(straight[0])
    assert float(straight[1]) == 0.0
    least, w = 0.05, np.sqrt(gamma)
    # D = (sin w/w - (1 + kappa''(0)) cos w) alpha to first order, kappa''(0) = 2 b; half of what that allows is left.
    slope = (np.sin(w) / w if w else 1.0) - (1.0 + 0.1) * np.cos(w)
    delta = 0.5 * least / max(abs(slope), 1.0) / (1.0 + w)
    found = pl.equilibria(material, gamma, alpha=(-delta, delta))
    assert found.intervals == ((-delta, delta),) or list(found.intervals) == [(-delta, delta)]
    for alpha in delta * np.array([-0.9, -0.3, 1e-6, 0.5, 0.9]):
        phi, nu = pendulum(gamma, float(alpha), np.array([1.0]))
        d = float(phi[0] - nu[0]) - spelled.kappa_slope(float(nu[0]))
        assert abs(d) < least <= spelled.threshold(float(nu[0]))
        each = pl.equilibrium(material, gamma, float(alpha))
        assert each.admissible
        assert each.alpha != 0.0
        assert each.drive is not None
        assert abs(each.drive - d) <= 1e-11 * (1.0 + gamma)
        mu_t, m_t = model.rate(0.0, each.curvature(model.grid.s), each.mu_nat)
        assert np.abs(mu_t).max() <= 1e-13 * (1.0 + gamma)
        assert float(m_t) == 0.0
        assert np.abs(each.curvature(model.grid.s)).max() >= 0.5 * abs(alpha)


@pytest.mark.parametrize("gamma", [0.0, 0.5, 2.0, np.pi**2 / 4.0, 8.0, 40.0])
def test_around_the_straight_rod(gamma: float) -> None:
    """Paper 3.57, 3.58: the straight rod is an equilibrium, and the curve around it consists of such."""
    check_around_the_straight_rod(gamma)


def frozen(gamma: float, alpha: float) -> Any:
    """An equilibrium below its threshold, as the linearisation wants it."""
    found = pl.equilibrium(pl.Material("m**2/2", "pos(x)**2", "50"), gamma, alpha)
    assert found.admissible
    return found


def check_linearisation(gamma: float, alpha: float) -> None:
    found, grid = frozen(gamma, alpha), pl.Grid(nodes=32)
    model = pl.Strut(found.material, pl.Load(thrust=gamma), grid)
    L = linearisation(found, grid)
    nu, step = found.curvature(grid.s), 1e-3
    phi = Legendre.fit(grid.s, found.phi(grid.s), 31, domain=[0.0, 1.0])
    for xi, xi_nat in ((Legendre([0.2, -1.0, 0.5], domain=[0.0, 1.0]), 0.0), (Legendre([1.0, 0.0, 2.0]), 0.8)):
        nodal = xi(grid.s)
        # By differences of F, of fourth order.
        ahead = [model.rate(0.0, nu + k * step * nodal, found.mu_nat + k * step * xi_nat) for k in (-2, -1, 1, 2)]
        weights = np.array([1.0, -8.0, 8.0, -1.0]) / (12.0 * step)
        by_differences = weights @ np.array([np.append(each[0], each[1]) for each in ahead])
        got = L @ np.append(nodal, xi_nat)
        scale = (1.0 + gamma + abs(alpha)) * np.abs(nodal).max()
        assert np.abs(got - by_differences).max() <= (10.0 * step**4 + 10.0 * EPS / step) * scale
        # By the kernel K(s, zeta) = gamma int_max(s, zeta)^1 cos phi, cut at zeta = s where it has its edge.
        antiderivative = Legendre.fit(grid.s, np.cos(phi(grid.s)), 31, domain=[0.0, 1.0]).integ()
        tail = lambda s: gamma * (antiderivative(1.0) - antiderivative(s))  # noqa: B023, E731 - used at once
        for row, s in enumerate(grid.s):
            before, after = s * spelled.S, s + (1.0 - s) * spelled.S
            by_kernel = tail(s) * s * float(spelled.W @ xi(before))
            by_kernel += (1.0 - s) * float(spelled.W @ (tail(after) * xi(after)))
            assert abs(got[row] - (xi_nat - nodal[row] + by_kernel)) <= 1e-12 * scale
        assert got[-1] == 0.0


@pytest.mark.parametrize(("gamma", "alpha"), POINTS)
def test_linearisation(gamma: float, alpha: float) -> None:
    """Paper 3.59–3.62, corrected: L from differences of F, and from the kernel gamma int_max(s, zeta)^1 cos phi."""
    check_linearisation(gamma, alpha)


def check_energy_bound() -> None:
    for mu, m in spelled.shapes(3):
        model = strut()
        sol = pl.solve(model, mu(model.grid.s), m, until=5.0, times=np.linspace(0.0, 5.0, 21))
        most = spelled.liapunov(mu, m, GAMMA) + GAMMA
        stored = 0.5 * (sol.y[:, :24] - sol.y[:, 24:25]) ** 2 @ model.grid.w
        stored += [spelled.kappa(float(each)) for each in sol.y[:, 24]]
        assert stored.max() <= most * (1.0 + 100.0 * sol.rtol)
        # What the bound rests on: V falls, and is bounded below by what is stored less the thrust.
        last = Legendre.fit(model.grid.s, sol.y[-1, :24], 23, domain=[0.0, 1.0])
        assert spelled.liapunov(last, float(sol.y[-1, 24]), GAMMA) <= spelled.liapunov(mu, m, GAMMA)


def test_the_bound_of_the_energy() -> None:
    """Paper 3.49–3.51: 1/2 ||mu - mu_nat||^2 + kappa(mu_nat) <= V(0) + gamma, along motions that yield."""
    check_energy_bound()


def check_dimensions() -> None:
    """A rod in SI and its dimensionless twin move alike: lengths by L, times by nu, energies by EI/L."""
    L, EI, nu = 0.25, 0.035, 120.0
    specimen = pl.Specimen(length=f"{L} m", bending_stiffness=f"{EI} N*m**2", retardation_time=f"{nu} s")
    # kappa = EI/L^2 kbar(L m), Theta = EI Thetabar, f(x) = fbar(x/EI)/(L nu)
    values = {"k": f"{EI} N*m**2", "c": f"{2.0 / (L * nu * EI**2)} 1/(N**2*m**5*s)", "h": f"{0.1 * EI} N*m**2"}
    made = pl.Material("k*m**2/2", "c*pos(x)**2", "h", values)  # type: ignore[arg-type]
    big = pl.Strut(made, pl.Load(thrust=f"{3.0 * EI / L**2} N"), pl.Grid(nodes=16), specimen=specimen)
    small = pl.Strut(pair("A", 2.0), pl.Load(thrust=3.0), pl.Grid(nodes=16))
    one = pl.solve(big, f"(1 + cos(3*s/{L}))/{L}", 0.4 / L, until=5.0 * nu, times=nu * np.arange(6.0), rtol=1e-10)
    two = pl.solve(small, "1 + cos(3*s)", 0.4, until=5.0, times=np.arange(6.0), rtol=1e-10)
    scales = {"curvature": L, "natural_curvature": L, "drive": 1 / EI, "x": 1 / L, "couple": L / EI, "liapunov": L / EI}
    for name, scale in scales.items():
        given, wanted = one.dataset[name].values * scale, two.dataset[name].values
        assert np.abs(given - wanted).max() <= 1e3 * 1e-10 * np.abs(wanted).max(), name
    assert abs(float(two.dataset.natural_curvature[-1]) - 0.4) > 0.05


def test_dimensionless_variables() -> None:
    """Paper 3.1–3.4, 3.5–3.10: one motion in two sets of units; every scale from its definition."""
    check_dimensions()
