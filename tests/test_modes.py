"""Claim: modes are those of the linearised rod: closed forms, independent solutions, and what the motion does.

Frequencies of straight rods are compared with the roots of the frequency equation of the Rayleigh beam-column in
mpmath; those of curved rods with a shooting solution of the linear ODE in s, both written here from the balance laws.
"""

from __future__ import annotations

from functools import cache

import mpmath
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp
from scipy.optimize import brentq
from scipy.special import jv

import plastica as pl
from plastica.errors import ArgumentError
from plastica.physics.kernel import kernel
from plastica.physics.ledger import liapunov
from tests.support import EPS

Array = np.ndarray

BETA = (1.8751040687, 4.6940911330, 7.8547574382, 10.9955407349)
"""Clamped-free beam, cos(beta L) cosh(beta L) = -1, to ten digits; omega = beta^2."""

GREENHILL = 7.8373474389
"""q L^3/EI at which the straight column gives way under its own weight."""

EULER = np.pi**2 / 4.0

ELASTIC = pl.Material("m**2/2", "pos(x)**2", "100")
"""Its natural curvature does not move in any of these motions."""

LOADS = {
    "none": pl.Load(),
    "thrust": pl.Load(thrust=1.7),
    "every": pl.Load(thrust=1.1, transverse=-0.8, couple=0.6, weight=1.5, weight_angle="40 deg"),
    "circle": pl.Load(couple=2.0 * np.pi),
}


def rod(load: pl.Load | None = None, nodes: int | str = 20, **options: object) -> pl.Rod:
    given = {"translational_inertia": 1.0, "damping": 0.0, **options}
    return pl.Rod(ELASTIC, load or pl.Load(), pl.Grid(nodes=nodes), **given)  # type: ignore[arg-type]


def bent(name: str, **options: object) -> tuple[pl.Rod, pl.Rest]:
    """A rod under one of the loads, at rest with the natural curvature 0.4 (of all segments)."""
    model = rod(LOADS[name], **options)
    return model, pl.rest(model, 0.0, 0.4)


def near(found: Array, due: Array, relative: float) -> None:
    assert np.all(np.abs(np.asarray(found) - due) <= relative * np.abs(due)), (found, due)


# -- straight rods -------------------------------------------------------------------------------------------------


@cache
def beam_column(thrust: float, rotary: float, count: int) -> Array:
    """Frequencies of w'''' + (P + eps0 omega^2) w'' = omega^2 w, w(0) = w'(0) = 0, w''(1) = 0,
    w'''(1) + (P + eps0 omega^2) w'(1) = 0: zeros of the determinant of the conditions on cosh, sinh, cos and sin.
    """

    def determinant(omega: object) -> object:
        q = thrust + rotary * omega**2
        root = mpmath.sqrt(q * q / 4 + omega**2)
        a, b = mpmath.sqrt(root - q / 2), mpmath.sqrt(root + q / 2)
        ch, sh, c, s = mpmath.cosh(a), mpmath.sinh(a), mpmath.cos(b), mpmath.sin(b)
        # w = A (cosh ax - cos bx) + B (sinh(ax)/a - sin(bx)/b)
        free = (a * a * ch + b * b * c, a * sh + b * s)
        shear = (
            a**3 * sh - b**3 * s + q * (a * sh + b * s),
            a * a * ch + b * b * c + q * (ch - c),
        )
        return (free[0] * shear[1] - free[1] * shear[0]) / (ch * omega)

    with mpmath.workdps(25):
        found, omega, step = [], mpmath.mpf("0.05"), mpmath.mpf("0.25")
        before = determinant(omega)
        while len(found) < count:
            after = determinant(omega + step)
            if before * after < 0:
                found.append(float(mpmath.findroot(determinant, (omega, omega + step), solver="anderson")))
            omega, before = omega + step, after
    return np.array(found)


def check_clamped_free() -> None:
    """beta L to 1e-8 as tabled; the first two on 12 nodes and the first four on 20 to 1e-13 of the exact ones."""
    found = pl.modes(rod(), count=4)
    assert np.abs(np.sqrt(found.frequencies) - BETA).max() <= 1e-10
    exact = beam_column(0.0, 0.0, 4)
    near(found.frequencies, exact, 1e-13)
    near(pl.modes(rod(nodes=12), count=2).frequencies, exact[:2], 1e-13)


def check_beam_columns(thrust: float, rotary: float) -> None:
    """Rayleigh beams under thrust and tension agree with the roots of their frequency equation."""
    load = pl.Load(thrust=thrust, allow_tension=True)
    found = pl.modes(rod(load, 24, rotary_inertia=rotary), count=5)
    assert found.resolved
    near(found.frequencies, beam_column(thrust, rotary, 5), 1e-11)


def check_rotary_inertia_alone() -> None:
    """eps1 = 0: omega^2 = (((k + 1/2) pi)^2 - gamma)/eps0."""
    found = pl.modes(rod(pl.Load(thrust=2.0), 32, translational_inertia=0.0, rotary_inertia=0.3))
    exact = (((np.arange(6) + 0.5) * np.pi) ** 2 - 2.0) / 0.3
    near(found.squares, exact, 1e-12)


def check_frequency_falls_to_zero() -> None:
    """omega_1^2 = 0 at pi^2/4, with the slope -int theta^2/int w^2 = -pi^2/(12 - 32/pi) of the buckling shape."""

    def square(gamma: float) -> float:
        return float(pl.modes(rod(pl.Load(thrust=gamma), 16), count=1).squares[0])

    assert abs(brentq(square, 2.0, 3.0, xtol=1e-14) - EULER) <= 1e-13
    slope = -(np.pi**2) / (12.0 - 32.0 / np.pi)
    offs = np.array([1e-2, 5e-3, 2.5e-3])
    off = [abs(square(EULER - h) / -h - slope) for h in offs]
    assert off[-1] <= 1e-3 * abs(slope)
    order = np.polyfit(np.log(offs), np.log(off), 1)[0]
    assert 0.9 <= order <= 1.1
    edge = pl.modes(rod(pl.Load(thrust=EULER)), count=1)
    assert edge.frequencies[0] == 0.0
    assert "edge of stability" in edge.sentence


def check_heavy_column() -> None:
    """Greenhill: (9/4) j^2 with J_(-1/3)(j) = 0."""

    def square(weight: float) -> float:
        return float(pl.modes(rod(pl.Load(weight=weight), 16), count=1).squares[0])

    found = brentq(square, 7.0, 8.5, xtol=1e-13)
    assert abs(found - GREENHILL) <= 1e-9
    assert abs(found - 2.25 * brentq(lambda x: jv(-1.0 / 3.0, x), 1.8, 1.9, xtol=1e-15) ** 2) <= 1e-11
    assert pl.modes(rod(pl.Load(weight=found + 1e-6)), count=1).unstable == 1
    assert pl.modes(rod(pl.Load(weight=found - 1e-6)), count=1).unstable == 0


def check_damping_ratios(delta: float) -> None:
    """Kelvin-Voigt beam: zeta = delta omega/2, lambda = -zeta omega +- omega (zeta^2 - 1)^(1/2)."""
    found = pl.modes(rod(damping=delta), count=5)
    omega = found.frequencies
    zeta = 0.5 * delta * omega
    near(found.damping_ratios, zeta, 1e-13)
    root = np.emath.sqrt((zeta**2 - 1.0).astype(complex))
    exact = omega[:, None] * (-zeta[:, None] + np.stack([root, -root], axis=1))
    # (zeta^2 - 1)^(1/2) cancels where zeta is large: the slow one is omega^2 by the fast one.
    slow = zeta > 1.0
    exact[slow, 0] = omega[slow] ** 2 / exact[slow, 1]
    assert np.all(np.abs(found.eigenvalues - exact) <= 1e-12 * np.abs(exact))
    assert np.all(np.abs(found.damped_frequencies - np.abs(exact[:, 0].imag)) <= 1e-12 * omega)


def check_pairs_do_not_depend_on_the_grid() -> None:
    """Under load, slow and fast eigenvalues are paired alike on any grid, and as exact where there are many nodes."""
    for thrust, delta in ((2.0, 0.05), (2.0, 1.0), (-5.0, 0.1)):
        load = pl.Load(thrust=thrust, allow_tension=True)
        few, more, many = (pl.modes(rod(load, nodes, damping=delta), count=6) for nodes in (24, 60, 120))
        for other in (more, many):
            assert np.all(np.abs(other.eigenvalues - few.eigenvalues) <= 1e-9 * np.abs(few.eigenvalues))


def test_pairs_do_not_depend_on_the_grid() -> None:
    check_pairs_do_not_depend_on_the_grid()


def test_clamped_free() -> None:
    check_clamped_free()


@pytest.mark.parametrize(("thrust", "rotary"), [(0.0, 1e-2), (1.5, 0.0), (2.4, 1e-3), (-20.0, 5e-3)])
def test_beam_columns(thrust: float, rotary: float) -> None:
    check_beam_columns(thrust, rotary)


def test_rotary_inertia_alone() -> None:
    check_rotary_inertia_alone()


def test_frequency_falls_to_zero() -> None:
    check_frequency_falls_to_zero()


def test_heavy_column() -> None:
    check_heavy_column()


@pytest.mark.parametrize("delta", [0.0, 1e-4, 0.02, 1.0])
def test_damping_ratios(delta: float) -> None:
    check_damping_ratios(delta)


# -- curved rods ---------------------------------------------------------------------------------------------------


def shooting(place: pl.Rest, load: pl.Load, rotary: float, omega: float) -> float:
    """Determinant of the conditions at the clamp, from three solutions that start at the free end.

    In s: theta' = mu, psi' = m, m' = -nu.b + psi n.a - eps0 omega^2 psi, nu' = -omega^2 d, d' = psi b, with the
    equilibrium's own balance mu' = -n.b; nu is the change of the contact force, d the displacement.
    """
    thrust, tau, weight, angle = (float(x) for x in (load.thrust(0.0), load.transverse(0.0), load.weight(0.0), 0.0))
    angle = load.weight_angle

    def slope(s: float, y: Array) -> Array:
        theta, mu = y[0], y[1]
        psi, m, nx, ny, dx, dy = y[2:].reshape(6, 3)
        a, b = np.array([np.cos(theta), np.sin(theta)]), np.array([-np.sin(theta), np.cos(theta)])
        n = np.array([-thrust - weight * np.cos(angle) * (1 - s), tau + weight * np.sin(angle) * (1 - s)])
        bend = -(nx * b[0] + ny * b[1]) + psi * (n @ a) - rotary * omega**2 * psi
        rows = (m, bend, -(omega**2) * dx, -(omega**2) * dy, psi * b[0], psi * b[1])
        return np.concatenate([[mu, -(n @ b)], *rows])

    theta = float(place.model.grid.w @ place.mu)
    mu = float(place.model.curvature_between([0.0], place.mu[None, :], [1.0])[0, 0])
    free = np.zeros((6, 3))
    free[0, 0] = free[4, 1] = free[5, 2] = 1.0
    y = solve_ivp(slope, (1.0, 0.0), np.concatenate([[theta, mu], free.ravel()]), rtol=1e-12, atol=1e-13).y[:, -1]
    assert abs(y[0]) <= 1e-9
    return float(np.linalg.det(y[2:].reshape(6, 3)[[0, 4, 5]]))


def check_shooting(name: str) -> None:
    """Frequencies of curved rods under every load are zeros of the shooting determinant, to 1e-8."""
    model, place = bent(name, rotary_inertia=2e-3)
    for omega in pl.modes(model, place, count=3).frequencies:
        low, high = omega * (1.0 - 1e-8), omega * (1.0 + 1e-8)
        assert shooting(place, LOADS[name], 2e-3, low) * shooting(place, LOADS[name], 2e-3, high) < 0.0


def directions(n: int, count: int = 3) -> Array:
    return np.random.default_rng(5).standard_normal((count, n))


def check_energies(name: str) -> None:
    """x^T M x/2 is the kinetic energy, x^T K x the second difference of V, x^T D x twice the dissipation."""
    model, place = bent(name, nodes=12, rotary_inertia=1e-2, damping=0.3, natural_segments=2)
    found, h = pl.modes(model, place), 1e-3
    for x in directions(found.mu.size):
        kinetic = float(model.kinetic_energy(found.mu, x))
        assert abs(0.5 * x @ found.mass @ x - kinetic) <= 1e-13 * kinetic
        up, here, down = (float(liapunov(found.model, 0.0, found.mu + i * h * x, found.mu_nat)) for i in (1, 0, -1))
        bending = float(x**2 @ model.grid.w)
        assert abs(x @ found.stiffness @ x - (up - 2.0 * here + down) / h**2) <= (h**2 + 64.0 * EPS / h**2) * bending
        assert abs(x @ found.damping @ x - 0.3 * bending) <= 1e-14 * bending


def check_finite_differences(name: str) -> None:
    """M u_tt + D u_t + K u = 0 is the derivative of Rod.rate at rest."""
    model, place = bent(name, rotary_inertia=1e-2, damping=0.3)
    found, h = pl.modes(model, place), 1e-6
    # Along smooth changes: the acceleration by a rough one is lost in the rounding of what it is solved from.
    smooth = directions(4, 4) @ found.shapes[:4]
    for x, v in zip(smooth, smooth[::-1], strict=True):
        up, down = (found.model.rate(0.0, found.mu + i * h * x, found.mu_nat, i * h * v)[2] for i in (1.0, -1.0))
        left = found.mass @ (up - down) / (2.0 * h) + found.damping @ v + found.stiffness @ x
        size = np.abs(found.stiffness @ x).max()
        assert np.abs(left).max() <= (10.0 * (h * np.abs(x).max()) ** 2 + 64.0 * EPS / h) * size


def check_eigenvalues(name: str, delta: float) -> None:
    """The eigenvalues are among those of the Jacobian that the motion is integrated with."""
    model, place = bent(name, nodes=14, rotary_inertia=1e-2, damping=delta)
    found = pl.modes(model, place, count=4)
    layout = found.model.layout
    y = layout.pack(found.mu, found.mu_nat)
    columns = np.r_[: layout.nodes, np.arange(layout.size)[layout.rate_columns]]
    jacobian = kernel(found.model, 0.0, 1.0).jacobian(0.0, y)[np.ix_(columns, columns)]
    values = np.linalg.eigvals(jacobian)
    for each in found.eigenvalues.ravel():
        # A defect of size e moves an eigenvalue next to a double one by e^(1/2).
        assert np.abs(values - each).min() <= 1e-6 * abs(each)
    assert np.all(found.eigenvalues[:, 0].imag >= 0.0)


def check_symmetric(name: str) -> None:
    """M, D and K are symmetric to the last bit, modes orthonormal in M and orthogonal in K."""
    model, place = bent(name, nodes=12, rotary_inertia=1e-2, damping=0.3, natural_segments=3)
    found = pl.modes(model, place)
    for matrix in (found.mass, found.damping, found.stiffness):
        assert np.array_equal(matrix, matrix.T)
    gram = found.shapes @ found.mass @ found.shapes.T
    assert np.abs(gram - np.eye(6)).max() <= 1e-11
    stiff = found.shapes @ found.stiffness @ found.shapes.T
    assert np.abs(stiff - np.diag(found.squares)).max() <= 1e-11 * found.squares.max()


@pytest.mark.parametrize("name", ["thrust", "every", "circle"])
def test_shooting(name: str) -> None:
    check_shooting(name)


@pytest.mark.parametrize("name", LOADS)
def test_matrices(name: str) -> None:
    check_energies(name)
    check_finite_differences(name)
    check_symmetric(name)


@pytest.mark.parametrize("name", LOADS)
@pytest.mark.parametrize("delta", [1e-3, 0.05, 1.0])
def test_eigenvalues(name: str, delta: float) -> None:
    check_eigenvalues(name, delta)


# -- what the motion does ------------------------------------------------------------------------------------------


def check_free_oscillation(name: str, delta: float, k: int) -> None:
    """A small disturbance by one mode swings as its eigenvalue says: phase and size after some periods.

    Undamped, or unloaded, the motion is that of one degree of freedom.
    """
    model, place = bent(name, nodes=16, damping=delta)
    found, size = pl.modes(model, place), 1e-5
    first = found.eigenvalues[k, 0]
    until = 5.3 * 2.0 * np.pi / first.imag
    sol = pl.solve(model, found.mu + size * found.shapes[k], 0.4, until, rtol=1e-9, method="Radau")
    t = np.linspace(0.0, until, 41)
    coordinate = (sol.model.layout.mu(sol.history(t)) - found.mu) @ found.mass @ found.shapes[k]
    # x = Re((1 + i Re lambda/Im lambda) e^(lambda t)) starts at 1 without speed.
    exact = ((1.0 + 1j * first.real / first.imag) * np.exp(first * t)).real
    assert np.abs(coordinate / size - exact).max() <= 1e-3


@pytest.mark.parametrize(("name", "delta", "k"), [("none", 0.0, 0), ("none", 0.02, 1), ("every", 0.0, 0)])
def test_free_oscillation(name: str, delta: float, k: int) -> None:
    check_free_oscillation(name, delta, k)


def check_without_inertia() -> None:
    """Both inertias 0, and the strut: the eigenvalues are those of K - 1, by the closed forms."""
    for gamma, alpha in ((2.0, 0.0), (5.0, 4.0), (20.0, 7.0)):
        place = pl.equilibrium(ELASTIC, gamma, alpha)
        due = pl.spectrum(place, count=3)
        for model in (
            pl.Strut(ELASTIC, pl.Load(thrust=gamma), pl.Grid("auto")),
            rod(pl.Load(thrust=gamma), "auto", translational_inertia=0.0, damping=0.5),
        ):
            found = pl.modes(model, place, count=3)
            assert np.abs(found.eigenvalues[:, 0] * model.damping - due.eigenvalues).max() <= 1e-12 * max(1.0, gamma)
            assert found.unstable == due.unstable
            assert np.all(np.isinf(found.frequencies))
            assert "nothing swings" in found.sentence


def test_without_inertia() -> None:
    check_without_inertia()


@given(
    st.floats(0.0, 8.0),
    st.floats(-2.0, 2.0),
    st.floats(-2.0, 2.0),
    st.floats(0.0, 0.1),
    st.sampled_from([0.0, 1e-3, 0.1, 2.0]),
)
@settings(deadline=None, max_examples=25, derandomize=True)
def test_any_rod_at_rest(thrust: float, transverse: float, natural: float, rotary: float, delta: float) -> None:
    """As many negative squares as directions in which the shape gives way; nothing grows but those; mirrored alike."""
    load = pl.Load(thrust=thrust, transverse=transverse)
    model = rod(load, 24, rotary_inertia=rotary, damping=delta)
    place = pl.rest(model, 0.3, natural)
    found = pl.modes(model, place, count=6)
    assert np.count_nonzero(found.squares < 0.0) == found.unstable == place.unstable
    grows = found.eigenvalues.real.max(axis=1) > 1e-9 * np.abs(found.eigenvalues).max(axis=1)
    assert int(np.count_nonzero(grows)) == found.unstable
    other = rod(load.mirrored(), 24, rotary_inertia=rotary, damping=delta)
    mirror = pl.modes(other, pl.rest(other, -0.3, -natural), count=6)
    assert np.abs(mirror.squares - found.squares).max() <= 1e-9 * np.abs(found.squares).max()


def test_loads_that_vary_are_refused() -> None:
    with pytest.raises(ArgumentError, match="must be constant"):
        pl.modes(rod(pl.Load(thrust="1 + sin(t)")))
