"""Claims 1 to 3 and 8 for the rod with inertia and for segments: Newton's laws, ledger, dissipation, mirror images."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import plastica as pl
from plastica.physics.kernel import kernel
from plastica.physics.ledger import liapunov, spending, stored_energy
from tests.rods import ELASTIC, INERTIA, KINDS, LOADS, NEVER, model, order, state_of
from tests.support import EPS, pair

SEGMENTS: tuple[Any, ...] = (1, 3, (0.0, 0.2, 1.0))
INERTIAS: dict[str, dict[str, float] | None] = {
    **KINDS,
    "rod without rotary inertia": INERTIA | {"rotary_inertia": 0.0},
    "rod without translational inertia": INERTIA | {"translational_inertia": 0.0},
    "elastic without rotary inertia": ELASTIC | {"rotary_inertia": 0.0},
    "no inertia": {"translational_inertia": 0.0, "rotary_inertia": 0.0, "damping": 0.7},
}


def readable(made: pl.Strut | pl.Rod, t: float) -> np.ndarray:
    """dy/dt by the equations as they are written to be read."""
    mu, mu_nat, mu_t = state_of(made)
    out = made.rate(t, mu, mu_nat, mu_t) if isinstance(made, pl.Rod) else (*made.rate(t, mu, mu_nat), None)
    y = made.layout.pack(out[0], out[1], out[2])
    y[made.layout.ledger_columns] = np.ravel(spending(made, t, mu, mu_nat, mu_t))
    return y


def condition(made: pl.Strut | pl.Rod) -> float:
    """How far rounding of a moment is magnified on its way to the rate of curvature."""
    return 1.0 if made.swing is None else float(np.linalg.cond(made.swing))


def check_kernel(made: pl.Strut | pl.Rod, t: float = 0.8) -> None:
    """The fast right-hand side equals `rate` and `spending`; each column of its Jacobian is the difference of it."""
    kern, layout = kernel(made, 0.7, 1.0), made.layout
    y = layout.pack(*state_of(made))
    slow, magnified = readable(made, t), EPS * condition(made)
    fast = kern.rate(t, y)
    for columns in (slice(0, layout.nodes), layout.natural_columns, layout.ledger_columns, layout.rate_columns):
        parts = slow[columns]
        if parts.size:
            assert np.abs(fast[columns] - parts).max() <= 16.0 * magnified * max(1.0, float(np.abs(parts).max()))
    jacobian, step = kern.jacobian(t, y), 1e-6
    for j, unit in enumerate(np.eye(layout.size)):
        differences = (kern.rate(t, y + step * unit) - kern.rate(t, y - step * unit)) / (2.0 * step)
        scale = np.abs(jacobian[:, j]).max() + np.abs(fast).max()
        assert np.abs(differences - jacobian[:, j]).max() <= (1e-8 + magnified / step) * scale


@pytest.mark.parametrize("segments", SEGMENTS, ids=str)
@pytest.mark.parametrize("kind", INERTIAS)
@pytest.mark.parametrize("load", ["constant", "ramps", "cyclic"])
def test_kernel(load: str, kind: str, segments: Any) -> None:
    check_kernel(model(LOADS[load], inertia=INERTIAS[kind], segments=segments))


def placed(made: pl.Rod, mu: np.ndarray, mu_t: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Place and velocity at the nodes, r = J a and r_t = J[theta_t b]; complex arguments are welcome."""
    A = made.grid.A
    theta, spin = A @ mu, A @ mu_t
    return A @ np.cos(theta), A @ np.sin(theta), A @ (-np.sin(theta) * spin), A @ (np.cos(theta) * spin)


def momenta(made: pl.Rod, mu: np.ndarray, mu_t: np.ndarray) -> np.ndarray:
    """Linear momentum of the part beyond each node, then of the whole, then angular momentum about the clamp."""
    x, y, x_t, y_t = placed(made, mu, mu_t)
    B, w = made.grid.B, made.grid.w
    eps1, eps0 = made.translational_inertia or 0.0, made.rotary_inertia or 0.0
    angular = eps1 * w @ (x * y_t - y * x_t) + eps0 * w @ (made.grid.A @ mu_t)
    return np.concatenate([eps1 * (B @ x_t), eps1 * (B @ y_t), [eps1 * w @ x_t, eps1 * w @ y_t, angular]])


def check_newton(made: pl.Rod, t: float = 0.8) -> None:
    """d/dt of the momenta of each part, and of the whole about the clamp, are the forces and moments on it.

    The derivative is exact: momenta are analytic, and a step of 1e-30 into the complex plane loses no digit.
    """
    mu, mu_nat, mu_t = state_of(made)
    first, _, second = made.rate(t, mu, mu_nat, mu_t)
    change = momenta(made, mu + 1e-30j * first, first + 1e-30j * second).imag / 1e-30
    contact = made.contact(t, mu, mu_nat, mu_t)
    theta, loads, grid = made.angle(mu), made.loads, made.grid
    n_x = contact.tension * np.cos(theta) - contact.shear * np.sin(theta)
    n_y = contact.tension * np.sin(theta) + contact.shear * np.cos(theta)
    heavy_x, heavy_y = (float(loads.weight(t)) * each for each in loads.weight_direction)
    force_x, force_y = -float(loads.thrust(t)), float(loads.transverse(t))
    x, y, *_ = placed(made, mu, first)
    tip_x, tip_y = np.cos(theta) @ grid.w, np.sin(theta) @ grid.w
    moment = tip_x * force_y - tip_y * force_x + grid.w @ (x * heavy_y - y * heavy_x) + float(loads.couple(t))
    forces = [
        force_x + heavy_x * (1.0 - grid.s) - n_x,
        force_y + heavy_y * (1.0 - grid.s) - n_y,
        [force_x + heavy_x - contact.clamp_x, force_y + heavy_y - contact.clamp_y, moment - contact.clamp_couple],
    ]
    # The curvature's second rate is had from the angle's by undoing J, which magnifies rounding.
    inertial = (made.translational_inertia or 0.0) * float(np.abs(made.angle(second)).max())
    scale = max(1.0, inertial, *(float(np.abs(each).max()) for each in forces))
    slack = 16.0 * EPS * float(np.linalg.cond(grid.A)) * scale
    assert np.abs(change - np.concatenate(forces)).max() <= slack


def check_moments(made: pl.Rod, t: float = 0.8) -> None:
    """The contact couple is m1 + J*[n.b - eps0 theta_tt], and the constitutive law gives the same."""
    mu, mu_nat, mu_t = state_of(made)
    first, _, second = made.rate(t, mu, mu_nat, mu_t)
    contact = made.contact(t, mu, mu_nat, mu_t)
    inertial = (made.rotary_inertia or 0.0) * made.angle(second)
    couple = float(made.loads.couple(t)) + made.grid.B @ (contact.shear - inertial)
    law = mu - made.division.spread(mu_nat) + (made.damping or 0.0) * first
    scale = np.abs(contact.shear).max() + np.abs(contact.couple).max() + np.abs(inertial).max()
    assert np.abs(contact.couple - couple).max() <= 16.0 * EPS * np.linalg.cond(made.grid.A) * scale
    assert np.abs(contact.couple - law).max() <= 16.0 * EPS * scale


@pytest.mark.parametrize("segments", SEGMENTS, ids=str)
@pytest.mark.parametrize("kind", [name for name, inertia in INERTIAS.items() if inertia])
@pytest.mark.parametrize("load", ["constant", "jumps", "cyclic"])
def test_newtons_laws(load: str, kind: str, segments: Any) -> None:
    made = model(LOADS[load], inertia=INERTIAS[kind], segments=segments)
    assert isinstance(made, pl.Rod)
    check_newton(made)
    check_moments(made)


RTOL = 1e-6
FEW_NODES = {1: 5, 2: 3, 5: 2}
"""Nodes per segment: the rod keeps its ledger on any grid, and without damping it is slow on fine ones."""


def run(kind: str, segments: int, load: str) -> pl.Solution:
    """A motion of 2.5 time units, which all loads of `LOADS` make yield; the elastic one swings without end."""
    made = model(LOADS[load], nodes=FEW_NODES[segments], segments=segments, inertia=KINDS[kind])
    method = "DOP853" if kind == "elastic" else "auto"
    sol = pl.solve(made, "0.3*cos(2*s)", 0.1, until=2.5, rtol=RTOL, method=method)
    assert sol.status.ok
    return sol


def check_ledger(sol: pl.Solution) -> None:
    """Work = stored + kinetic + dissipated, at the time tolerance; nothing is given back by dissipation."""
    ledger, layout, model = sol.ledger, sol.model.layout, sol.model
    assert abs(ledger.residual) <= 5.0 * sol.rtol * ledger.largest_energy
    y = sol.history.y[sol.history.accepted]
    assert np.diff(layout.ledger(y)[:, 1:], axis=0).min() >= -sol.rtol * ledger.largest_energy
    assert ledger.natural_dissipation > 0.0
    if model.damping == 0.0:
        assert ledger.viscous_dissipation == 0.0
    if isinstance(model, pl.Rod):
        kinetic = float(np.ptp(sol.dataset.kinetic_energy.to_numpy()))
        assert kinetic > 10.0 * sol.rtol * ledger.largest_energy


def check_liapunov(sol: pl.Solution) -> None:
    """V with the kinetic energy never increases under constant loads."""
    rise = float(sol.dataset.liapunov.diff("t").max())
    assert rise <= 5.0 * sol.rtol * sol.ledger.largest_energy


@pytest.mark.parametrize("load", LOADS)
@pytest.mark.parametrize("segments", FEW_NODES)
@pytest.mark.parametrize("kind", KINDS)
def test_ledger(kind: str, segments: int, load: str) -> None:
    sol = run(kind, segments, load)
    check_ledger(sol)
    if load == "constant":
        check_liapunov(sol)


@pytest.mark.parametrize("segments", [1, 2, 5])
def test_ledger_without_damping_by_the_default_method(segments: int) -> None:
    """Loads that begin and end smoothly, as the default method of undamped rods wants them."""
    load = pl.Load(thrust="2*sin(t)**2", transverse="0.8*sin(t)**2")
    sol = pl.solve(model(load, nodes=4, segments=segments, inertia=ELASTIC), until=5.0, rtol=RTOL)
    assert sol.status.ok
    check_ledger(sol)


def drift(rtol: float, method: str = "auto") -> float:
    """Largest change of the total energy of an elastic rod under constant loads, over a long run."""
    made = model(LOADS["constant"], nodes=4, material=NEVER, inertia=ELASTIC)
    sol = pl.solve(made, "0.5*cos(pi*s/2)", 0.2, until=20.0, rtol=rtol, method=method)
    energy = sol.dataset.liapunov.to_numpy()
    assert float(np.ptp(sol.dataset.kinetic_energy.to_numpy())) > 0.05
    return float(np.abs(energy - energy[0]).max())


def check_conservation() -> None:
    """Without damping and yielding the total energy stays, to the time tolerance: ten times less for ten times less."""
    rtols = np.array([1e-4, 1e-5, 1e-6])
    for method in ("auto", "DOP853"):
        drifts = np.array([drift(rtol, method) for rtol in rtols])
        assert np.all(drifts <= 0.1 * rtols)
        assert 0.8 <= order(rtols, drifts) <= 1.5


def test_energy_is_conserved() -> None:
    check_conservation()


def check_rates_balance(made: pl.Strut | pl.Rod) -> None:
    """dV/dt = -delta int mu_t^2 - sum of l_j |D_j mu_nat_j_t| to rounding: the grid keeps it, not only the limit."""
    mu, mu_nat, mu_t = state_of(made)
    y = made.layout.pack(mu, mu_nat, mu_t)
    change = kernel(made, 0.0, 1.0).rate(0.0, y)
    _, viscous, natural = (float(each) for each in spending(made, 0.0, mu, mu_nat, mu_t))

    def energy(step: float) -> float:
        moved = y + step * change
        layout = made.layout
        return float(liapunov(made, 0.0, layout.mu(moved), layout.natural(moved), layout.mu_t(moved)))

    # Fourth differences: their error is far below the tolerance for a step that keeps rounding below it too.
    step = 1e-3 / max(1.0, float(np.abs(change).max()))
    slope = (8.0 * (energy(step) - energy(-step)) - energy(2.0 * step) + energy(-2.0 * step)) / (12.0 * step)
    slack = 64.0 * EPS * abs(energy(0.0)) / step + 1e-9 * (viscous + abs(natural))
    assert abs(slope + viscous + natural) <= slack
    assert natural >= 0.0


@pytest.mark.parametrize("segments", SEGMENTS, ids=str)
@pytest.mark.parametrize("kind", INERTIAS)
def test_rates_balance(kind: str, segments: Any) -> None:
    check_rates_balance(model(LOADS["constant"], inertia=INERTIAS[kind], segments=segments))


def check_mirror(kind: str, segments: int, load: str) -> None:
    """The mirror image of a motion is the motion of the mirror image, to the bit."""
    nodes = 4 if segments == 1 else 2
    made = model(LOADS[load], nodes=nodes, segments=segments, inertia=KINDS[kind], material=pair("B", 5.0))
    image = made.with_load(made.load.mirrored())
    start = [0.3, -0.2, 0.1][:segments] if segments > 1 else 0.3
    options: dict[str, Any] = {"until": 1.2, "rtol": 1e-4}
    if kind != "strut":
        options["method"] = "DOP853" if kind == "elastic" else "auto"
    one = pl.solve(made, "0.4*cos(2*s)", start, **options)
    other = pl.solve(image, "-0.4*cos(2*s)", -np.asarray(start) if segments > 1 else -0.3, **options)
    layout = one.model.layout
    assert one.status.ok
    assert np.array_equal(one.history.t, other.history.t)
    even = layout.ledger_columns
    sign = -np.ones(layout.size)
    sign[even] = 1.0
    assert np.array_equal(one.history.y, sign * other.history.y)
    assert np.ptp(layout.natural(one.history.y), axis=0).max() > 0.0
    assert [(e.t, e.kind, e.direction) for e in one.events] == [(e.t, e.kind, -e.direction) for e in other.events]


@pytest.mark.parametrize("load", ["constant", "jumps", "cyclic"])
@pytest.mark.parametrize("segments", [1, 3])
@pytest.mark.parametrize("kind", KINDS)
def test_mirror(kind: str, segments: int, load: str) -> None:
    check_mirror(kind, segments, load)


def check_bounds(kind: str, segments: int) -> None:
    """Energy, bending and drive stay within what is promised before the run; without a couple, that is finite."""
    load = pl.Load(thrust=2.0, transverse="0.8*sin(t)", weight=1.0, weight_angle=0.7)
    made = model(load, nodes=4 if segments == 1 else 2, segments=segments, inertia=KINDS[kind])
    method = "DOP853" if kind == "elastic" else "auto"
    sol = pl.solve(made, "5*cos(2*s)", 0.4, until=3.0, rtol=1e-5, method=method)
    promised, layout, y = sol.bounds, sol.model.layout, sol.history.y
    mu, mu_nat = layout.mu(y), layout.natural(y)
    bending = np.sqrt((mu - sol.model.division.spread(mu_nat)) ** 2 @ sol.grid.w)
    slack = 1.0 + 100.0 * sol.rtol
    assert stored_energy(sol.model, mu, mu_nat).max() <= promised.energy * slack
    assert bending.max() <= promised.bending * slack
    assert np.abs(mu_nat).max() <= promised.natural_curvature * slack
    assert np.abs(sol.model.drive(mu, mu_nat)).max() <= promised.drive * slack
    # Not so far off that anything would pass.
    assert stored_energy(sol.model, mu, mu_nat).max() >= promised.energy / 3.0


@pytest.mark.parametrize("segments", [1, 3])
@pytest.mark.parametrize("kind", KINDS)
def test_bounds(kind: str, segments: int) -> None:
    check_bounds(kind, segments)


def test_velocity_is_the_rate_of_place() -> None:
    """The dataset's velocities against differences of its places; the kinetic energy is made of them."""
    made = model(LOADS["cyclic"], nodes=6, inertia=INERTIA)
    step = 1e-4
    sol = pl.solve(made, 0.0, until=1.0, rtol=1e-10, times=0.8 + step * np.arange(-2, 3))
    data, mu_t = sol.dataset, sol.model.layout.mu_t(sol.y)
    for place, velocity in (("x", "velocity_x"), ("y", "velocity_y")):
        r = data[place].to_numpy()
        differences = (r[0] - 8.0 * r[1] + 8.0 * r[3] - r[4]) / (12.0 * step)
        assert np.abs(data[velocity].to_numpy()[2] - differences).max() <= 1e-7
    density = INERTIA["translational_inertia"] * (data.velocity_x**2 + data.velocity_y**2)
    density = density + INERTIA["rotary_inertia"] * (mu_t @ sol.grid.A.T) ** 2
    total = 0.5 * (density * data.s_weight).sum("s")
    assert np.abs(total - data.kinetic_energy).max() <= 16.0 * EPS * float(total.max())


def test_at_rest_the_clamp_holds_the_dead_load() -> None:
    made = model(LOADS["constant"], inertia=INERTIA, material=NEVER)
    data = pl.solve(made, 0.0, until=60.0, rtol=1e-8).dataset.isel(t=-1)
    load = made.load
    along, across = (float(load.weight(0.0)) * each for each in load.weight_direction)
    assert abs(float(data.clamp_force_x) - (along - 2.0)) <= 1e-9
    assert abs(float(data.clamp_force_y) - (across + 0.5)) <= 1e-9
    x, y, w = data.x.to_numpy(), data.y.to_numpy(), made.grid.w
    moment = 0.5 * data.tip_x + 2.0 * data.tip_y + w @ (x * across - y * along) - 0.3
    assert abs(float(data.clamp_couple) - float(moment)) <= 1e-9
