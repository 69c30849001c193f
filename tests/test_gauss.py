"""Claim: Gauss collocation in time keeps its tolerance between steps too, its order, and the energy of what is fast.

And its Newton matrix, split by the eigenvectors of the coefficients, is that of all stages together.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from scipy.integrate import DenseOutput
from scipy.interpolate import BarycentricInterpolator
from scipy.special import ellipj, ellipk

import plastica as pl
from plastica.numerics import gauss
from plastica.numerics.gauss import Gauss, Tableau, Watch, collocation, tableau

Array = np.ndarray
AMPLITUDE = 2.0


def pendulum(_t: float, y: Array) -> Array:
    return np.array([y[1], -np.sin(y[0])])


def pendulum_jacobian(_t: float, y: Array) -> Array:
    return np.array([[0.0, 1.0], [-np.cos(y[0]), 0.0]])


def exact(t: Array) -> Array:
    """Angle of a pendulum let go at AMPLITUDE, sin(theta/2) = k cd(t, k)."""
    k = np.sin(0.5 * AMPLITUDE)
    sn, _, _, _ = ellipj(t + ellipk(k**2), k**2)
    return np.asarray(2.0 * np.arcsin(k * sn))


def swung(rtol: float, until: float = 20.0) -> tuple[float, float, int]:
    """Largest error of the angle over the whole time, drift of the energy at the end, and steps."""
    solver = Gauss(
        pendulum,
        0.0,
        np.array([AMPLITUDE, 0.0]),
        until,
        jac=pendulum_jacobian,
        rtol=rtol,
        watch=Watch.everything(np.full(2, rtol)),
    )
    worst, steps = 0.0, 0
    while solver.status == "running":
        solver.step()
        steps += 1
        t = np.linspace(solver.t_old, solver.t, 23)
        worst = max(worst, float(np.abs(solver.dense_output()(t)[0] - exact(t)).max()))
    assert solver.status == "finished"
    angle, speed = solver.y
    return worst, abs(0.5 * speed**2 - np.cos(angle) + np.cos(AMPLITUDE)), steps


def check_tolerance() -> None:
    """Between steps too the error is a tolerance, over three periods; and the tolerance is not wasted."""
    for rtol in (1e-5, 1e-7, 1e-9):
        error, drift, steps = swung(rtol)
        assert error <= 2.0 * rtol, (rtol, error)
        assert drift <= 0.5 * rtol, (rtol, drift)
        assert steps <= 12.0 * rtol ** (-1.0 / 6.0), (rtol, steps)


def check_order() -> None:
    """A tenth of the tolerance takes 10^(1/6) as many steps: the polynomial of five stages has an error h^6."""
    counts = [swung(rtol)[2] for rtol in (1e-7, 1e-11)]
    order = 4.0 / np.log10(max(counts[1] / counts[0], 1.001))
    assert 5.0 <= order <= 7.0, counts


SHAKE = 1e-2
"""Amplitude of the fast vibration."""


def shaken() -> Gauss:
    """A slow oscillator, and beside it one a thousand times faster than the steps, which is not watched."""
    fast = 1e4
    matrix = np.array([[0.0, 1.0, 0.0, 0.0], [-1.0, 0.0, 0.0, 0.0], [0.0, 0.0, 0.0, fast], [0.0, 0.0, -fast, 0.0]])
    watch = Watch(np.eye(4)[:2], (slice(0, 2),), np.full(2, 1e-9))
    y0 = np.array([1.0, 0.0, SHAKE, 0.0])
    return Gauss(lambda t, y: matrix @ y, 0.0, y0, 20.0, jac=lambda t, y: matrix, rtol=1e-8, watch=watch)


def check_energy() -> None:
    """A vibration a thousand times faster than the steps, and not watched, keeps its amplitude to rounding."""
    solver, steps = shaken(), 0
    while solver.status == "running":
        solver.step()
        steps += 1
    assert abs(solver.y[0] - np.cos(20.0)) <= 1e-7
    assert steps < 200
    assert abs(np.hypot(*solver.y[2:]) / SHAKE - 1.0) <= 1e-8


def check_between() -> None:
    """Between its ends a step makes no more of a vibration that it does not follow than there is at them."""
    solver = shaken()
    while solver.status == "running":
        solver.step()
        t = np.linspace(solver.t_old, solver.t, 101)
        between = solver.dense_output()(t)
        assert np.abs(between[2:]).max() <= 1.01 * SHAKE
        assert np.abs(between[0] - np.cos(t)).max() <= 1e-7


def stiff() -> Array:
    """A Jacobian with rates from 1 to 1e4, of both kinds, and a component that nothing moves and that moves nothing."""
    rng = np.random.default_rng(5)
    rates = np.zeros((7, 7))
    rates[0, 0], rates[1, 1] = -1e4, -1.0
    rates[2:4, 2:4], rates[4:6, 4:6] = 30.0 * np.array([[0.0, 1.0], [-1.0, 0.0]]), 1e4 * np.array([[0, 1.0], [-1.0, 0]])
    turn, _ = np.linalg.qr(rng.normal(size=(6, 6)))
    rates[:6, :6] = turn @ rates[:6, :6] @ turn.T
    return rates


def check_split() -> None:
    """Solutions are those of the whole matrix 1 - h A x J; what is not moved stays as it is to the last bit."""
    table, jacobian, h = gauss.tableau(), stiff(), 0.3
    residual = np.random.default_rng(6).normal(size=(table.c.size, len(jacobian)))
    residual[:, -1] = 0.0
    factors = [gauss._factors(h * value, jacobian) for value in table.values]
    assert [each.lu.dtype.kind for each in factors] == ["f", "c", "c"]
    found = gauss._solved(factors, residual)
    whole = np.eye(residual.size) - h * np.kron(table.A, jacobian)
    wanted = np.linalg.solve(whole, residual.ravel()).reshape(residual.shape)
    eps = np.finfo(float).eps
    assert np.abs(found - wanted).max() <= eps * np.linalg.cond(whole) * np.abs(wanted).max()
    # Backwards stable but for the eigenvectors' condition, 165.
    left = whole @ found.ravel() - residual.ravel()
    assert np.abs(left).max() <= 1e3 * eps * np.abs(whole).max() * np.abs(found).max()
    assert np.array_equal(found[:, -1], residual[:, -1])


def check_newton() -> None:
    """On linear equations the first iteration is right and the second says so: 2 x 5 stages, three times a step."""
    solver, tries = shaken(), 0
    before = solver.nfev
    while solver.status == "running":
        solver.step()
        tries += 1
    # A step that is tried again costs as much; few are.
    assert solver.nfev - before <= 1.3 * 2 * 5 * 3 * tries
    assert solver.njev == 1


def check_switches() -> None:
    """A rod that yields, stops and yields again is not set vibrating by that: its curvature is that of DOP853."""
    material = pl.Material("m**2/2", "5*pos(x)**2", "0.1")
    load = pl.Load(transverse="0.3*sin(t)**4")
    rod = pl.Rod(material, load, pl.Grid(6), translational_inertia=1.0, damping=0.0)
    exact = pl.solve(rod, until=4.0, rtol=1e-6, method="DOP853")
    assert sum(event.kind in ("onset", "arrest") for event in exact.events) >= 4
    times = np.linspace(0.0, 4.0, 81)
    mu = rod.layout.mu(exact.history(times))
    for rtol in (1e-4, 1e-5, 1e-6):
        sol = pl.solve(rod, until=4.0, rtol=rtol, method="Gauss")
        off = float(np.abs(rod.layout.mu(sol.history(times)) - mu).max())
        assert off <= 2.0 * rtol, (rtol, off)
        assert abs(sol.ledger.residual) <= rtol * sol.ledger.largest_energy, rtol
        assert sol.counts.steps <= 120


def test_the_error_keeps_the_tolerance() -> None:
    check_tolerance()


def test_the_order_is_six() -> None:
    check_order()


def test_what_is_fast_keeps_its_energy() -> None:
    check_energy()


def test_what_is_fast_stays_small_between() -> None:
    check_between()


def test_a_rod_is_not_shaken_by_its_switches() -> None:
    check_switches()


def test_the_stages_are_solved_one_by_one() -> None:
    check_split()


def test_newton_is_right_at_once_where_it_can_be() -> None:
    check_newton()


@pytest.mark.parametrize("stages", [1, 2, 3, 4, 6])
def test_any_collocation_is_split(stages: int) -> None:
    """Coefficients are those of the eigenvectors together, for even numbers of stages too, which have no real one."""
    x, w = np.polynomial.legendre.leggauss(stages)
    table = collocation(0.5 * (1.0 + x), 0.5 * w)
    assert table.values.size == (stages + 1) // 2
    assert np.count_nonzero(table.values.imag == 0.0) == stages % 2
    together = ((table.back * table.values) @ table.into).real
    condition = np.linalg.cond(np.linalg.eig(table.A)[1])
    assert np.abs(together - table.A).max() <= 10.0 * np.finfo(float).eps * condition


def test_a_jacobian_that_is_no_number_ends_in_a_message() -> None:
    solver = Gauss(
        lambda t, y: -y,
        0.0,
        np.ones(2),
        1.0,
        jac=lambda t, y: np.full((2, 2), np.nan),
        rtol=1e-6,
        watch=Watch.everything(np.full(2, 1e-9)),
    )
    message = None
    while solver.status == "running":
        message = solver.step()
    assert solver.status == "failed"
    assert message


def test_a_rate_that_is_no_number_ends_in_a_message() -> None:
    solver = Gauss(
        lambda t, y: y / (0.0 if t > 0.5 else 1.0) if t <= 0.5 else np.full(1, np.nan),
        0.0,
        np.ones(1),
        1.0,
        jac=lambda t, y: np.eye(1),
        rtol=1e-6,
        watch=Watch.everything(np.full(1, 1e-9)),
    )
    message = None
    while solver.status == "running":
        message = solver.step()
    assert solver.status == "failed"
    assert message
    assert solver.t <= 0.5


def other_nodes() -> Tableau:
    """Collocation at nodes that are off by a hundredth: the method is no longer symmetric, and damps."""
    c = tableau().c + 0.01
    powers = np.arange(c.size)
    return collocation(c, np.linalg.solve((c[:, None] ** powers).T, 1.0 / (powers + 1)))


class OnePolynomial(DenseOutput):  # type: ignore[misc]  # SciPy has no types
    """One polynomial through all the states of two half steps."""

    degree = 10

    def __init__(self, first: Any, second: Any, end: Array) -> None:
        super().__init__(first.t_old, second.t)
        self.end = end
        halves = [part.start + part.increments for part in (first, second)]
        nodes = np.concatenate([0.5 * first.nodes, 0.5 + 0.5 * first.nodes, [1.0]])
        self.through = BarycentricInterpolator(nodes, np.vstack([*halves, end]))

    def _call_impl(self, t: Array) -> Array:
        return np.asarray(self.through((t - self.t_old) / (self.t - self.t_old))).T


def pairs_once() -> Tableau:
    """Each pair of eigenvectors counted once instead of twice."""
    table = tableau()
    return table._replace(back=np.where(table.values.imag == 0.0, 1.0, 0.5) * table.back)


def other_halves() -> Tableau:
    """Of each pair the eigenvalue of the one, the eigenvector of the other."""
    table = tableau()
    return table._replace(values=table.values.conj())


def slightly_off() -> Tableau:
    """Eigenvalues off by a thousandth: Newton's method still converges, but no longer at once."""
    table = tableau()
    return table._replace(values=1.001 * table.values)


DEFECTS: dict[str, tuple[Callable[[], None], str, object]] = {
    "nodes that damp": (check_energy, "tableau", other_nodes),
    "errors divided too much": (check_tolerance, "ORDER", 18),
    "errors not looked at between the stages": (check_tolerance, "SAMPLES", np.array([1.0])),
    "one polynomial for both halves": (check_between, "_Halves", OnePolynomial),
    "pairs counted once": (check_split, "tableau", pairs_once),
    "eigenvalues of the other halves": (check_split, "tableau", other_halves),
    "eigenvalues slightly off": (check_newton, "tableau", slightly_off),
    "one polynomial at switches": (check_switches, "_Halves", OnePolynomial),
    "a sixth of the order": (check_order, "WORTH", 1e9),
}


@pytest.mark.parametrize("defect", DEFECTS)
def test_defects_are_caught(defect: str, monkeypatch: pytest.MonkeyPatch) -> None:
    check, name, value = DEFECTS[defect]
    monkeypatch.setattr(gauss, name, value)
    with pytest.raises(AssertionError):
        check()
