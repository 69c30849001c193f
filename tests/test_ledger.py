"""Claims 1 to 3: the ledger balances, the Liapunov function never increases, the natural curvature obeys its drive."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings

import plastica as pl
from plastica.physics.kernel import kernel
from plastica.physics.ledger import entropy_rate, liapunov, spending, stored_energy
from tests.support import EPS, label, materials, reference, shapes, solution_of, struts

RTOL = 1e-8


def check_ledger(sol: pl.Solution) -> None:
    """Claim 1: what the loads put in is stored or dissipated, to the time tolerance."""
    ledger = sol.ledger
    spent = ledger.stored_energy + ledger.viscous_dissipation + ledger.natural_dissipation + ledger.kinetic_energy
    scale = max(abs(ledger.work), ledger.largest_energy)
    assert abs(ledger.work - spent - ledger.residual) <= 8.0 * EPS * scale
    assert abs(ledger.residual) <= 100.0 * sol.rtol * ledger.largest_energy
    assert ledger.viscous_dissipation >= 0.0
    assert ledger.natural_dissipation >= 0.0


def check_liapunov(sol: pl.Solution) -> None:
    """Claim 2: V does not increase under constant loads, and the energy stays within V(0) plus the load."""
    data = sol.dataset
    scale = max(1.0, float(np.abs(data.liapunov).max()), float(data.thrust.max()))
    assert float(data.liapunov.diff("t").max()) <= 20.0 * sol.rtol * scale
    n = sol.grid.size
    y = sol.history.y[sol.history.accepted]
    energy = stored_energy(sol.model, y[:, :n], y[:, n])
    assert energy.max() <= sol.bounds.energy + 20.0 * sol.rtol * scale


def check_natural(sol: pl.Solution) -> None:
    """Claim 3: D mu_nat_t >= 0; mu_nat constant to the bit while |D| <= Theta; its variation is bounded."""
    strut, n = sol.model, sol.grid.size
    y = sol.history.y
    natural = y[:, n]
    _, rate = strut.rate(sol.history.t, y[:, :n], natural)
    drive = strut.drive(y[:, :n], natural)
    assert np.all(drive * rate >= 0.0)
    assert np.all(entropy_rate(strut, sol.history.t, y[:, :n], natural) @ strut.grid.w >= -4.0 * EPS)
    starts, moving = sol.legs
    for start, end, moves in zip(starts, [*starts[1:], sol.history.end], moving[:-1], strict=True):
        inside = (sol.history.t >= start) & (sol.history.t <= end)
        if not moves and end > start:
            assert np.ptp(natural[inside]) == 0.0
    least = float(strut.threshold(np.linspace(-50.0, 50.0, 10001)).min())
    allowed = (float(liapunov(strut, 0.0, y[0, :n], y[0, n])) + float(strut.loads.thrust(0.0))) / least
    assert np.abs(np.diff(natural)).sum() <= allowed * (1.0 + 10.0 * sol.rtol) + 10.0 * sol.rtol


@pytest.mark.parametrize("case", reference()[::2], ids=label)
def test_reference_motions(case: dict[str, object]) -> None:
    sol = solution_of(case)
    check_ledger(sol)
    check_liapunov(sol)
    check_natural(sol)


@given(struts(), shapes())
@settings(deadline=None, max_examples=40, derandomize=True)
@pytest.mark.paper("1.2", "3.41–3.48", "4.1–4.4")
def test_any_constant_thrust(strut: pl.Strut, shape: str) -> None:
    sol = pl.solve(strut, shape, 0.0, until=20.0, rtol=RTOL)
    assert sol.status.ok
    check_ledger(sol)
    check_liapunov(sol)
    check_natural(sol)


@given(struts(varying=True), shapes())
@settings(deadline=None, max_examples=30, derandomize=True)
def test_any_varying_thrust(strut: pl.Strut, shape: str) -> None:
    sol = pl.solve(strut, shape, 0.0, until=6.0, rtol=RTOL)
    assert sol.status.ok
    check_ledger(sol)


def check_other_loads() -> None:
    load = pl.Load(thrust=1.0, transverse=0.7, couple=0.4, weight=2.0)
    sol = pl.solve(pl.Strut(_material(), load), "0.3*cos(2*s)", 0.1, until=50.0)
    check_ledger(sol)
    assert float(sol.dataset.liapunov.diff("t").max()) <= 20.0 * sol.rtol * 3.0


def test_other_loads() -> None:
    check_other_loads()


def _material() -> pl.Material:
    return pl.Material("k*m**2/2", "c*pos(x)**2", "h", {"k": 1.0, "c": 1.0, "h": 0.1})


@given(materials(), shapes())
@settings(deadline=None, max_examples=30, derandomize=True)
@pytest.mark.paper("2.16, 2.17")
def test_balance_of_rates_is_exact(material: pl.Material, shape: str) -> None:
    """The semi-discrete rod obeys dE/dt + dissipation = power to rounding, not only in the limit of many nodes."""
    check_balance_of_rates(material, shape)


def check_balance_of_rates(material: pl.Material, shape: str) -> None:
    load = pl.Load(thrust=3.0, transverse=0.5, couple=-0.3, weight=1.0)
    strut = pl.Strut(material, load, pl.Grid(7, (0.0, 0.4, 1.0)))
    sol = pl.solve(strut, shape, 0.2, until=1e-3)
    n = sol.grid.size
    mu, mu_nat = sol.history.y[-1, :n], float(sol.history.y[-1, n])
    strut = sol.model
    mu_t, mu_nat_t = strut.rate(0.0, mu, mu_nat)
    power, viscous, natural = spending(strut, 0.0, mu, mu_nat)
    w = strut.grid.w
    change = w @ ((mu - mu_nat) * (mu_t - mu_nat_t)) + strut.laws.preference.slope_at(mu_nat) * mu_nat_t
    # The power by the work of the forces, theta_t = A mu_t, not by the couple: adjointness is what makes them equal.
    _, shear = strut.force(0.0, strut.angle(mu))
    by_forces = w @ (shear * (strut.grid.A @ mu_t)) - 0.3 * (w @ mu_t)
    scale = abs(change) + viscous + abs(natural) + abs(power)
    assert abs(power - by_forces) <= 64.0 * EPS * scale
    assert abs(power - change - viscous - natural) <= 64.0 * EPS * scale


@given(struts(), shapes())
@settings(deadline=None, max_examples=25, derandomize=True)
@pytest.mark.paper("3.17–3.21")
def test_kernel_is_the_readable_rate(strut: pl.Strut, shape: str) -> None:
    check_kernel(strut, shape)


@pytest.mark.paper("3.22–3.24")
def test_kernel_under_loads_that_vary() -> None:
    load = pl.Load(thrust="2 + sin(t)", transverse="0.3*cos(t)", couple="0.1*t", weight=([0.0, 4.0], [0.0, 1.0]))
    check_kernel(pl.Strut(_material(), load, pl.Grid(nodes=12)), "cos(2*s)")
    check_kernel(pl.Strut(_material(), pl.Load(thrust="2 + sin(t)"), pl.Grid(nodes=12)), "cos(2*s)")


def check_kernel(strut: pl.Strut, shape: str) -> None:
    """The fast right-hand side equals `Strut.rate` and `spending`; its Jacobian equals differences of it."""
    sol = pl.solve(strut, shape, 0.3, until=0.5)
    strut, n = sol.model, sol.grid.size
    y = sol.history.y[-1]
    kern = kernel(strut, 0.0, 1.0)
    fast = kern.rate(0.2, y)
    mu_t, mu_nat_t = strut.rate(0.2, y[:n], float(y[n]))
    slow = np.concatenate([mu_t, [mu_nat_t], np.ravel(spending(strut, 0.2, y[:n], float(y[n])))])
    scale = np.abs(slow).max() + np.abs(y).max()
    assert np.abs(fast - slow).max() <= 64.0 * EPS * scale
    jacobian = kern.jacobian(0.2, y)
    direction = np.cos(np.arange(y.size))
    # Central differences of a smooth function: error of order step^2 plus rounding / step.
    step = 1e-5
    differences = (kern.rate(0.2, y + step * direction) - kern.rate(0.2, y - step * direction)) / (2.0 * step)
    size = np.abs(jacobian).max() * np.abs(direction).sum()
    assert np.abs(jacobian @ direction - differences).max() <= 1e-7 * max(size, 1.0)


@pytest.mark.paper("2.21, 2.22")
def test_a_rod_below_its_threshold_keeps_its_natural_curvature_to_the_bit() -> None:
    sol = pl.solve(pl.Strut(_material(), pl.Load(thrust=1.0)), 0.05, 0.01, until=200.0)
    assert sol.outcome.memory == "springs back"
    assert np.all(sol.dataset.natural_curvature == 0.01)
    assert sol.ledger.natural_dissipation == 0.0


def test_entropy_may_fall_somewhere_but_not_in_all() -> None:
    sol = pl.solve(pl.Strut(_material(), pl.Load(thrust=3.0)), "2*cos(4*s)", 0.5, until=5.0)
    data = sol.dataset
    assert float(data.entropy_rate.min()) < 0.0
    assert float((data.entropy_rate * data.s_weight).sum("s").min()) >= 0.0
