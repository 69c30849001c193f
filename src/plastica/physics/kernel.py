"""The strut's equations as one vector ODE for SciPy's solvers: fast right-hand side and exact Jacobian.

The state is y = (mu at the n nodes, mu_nat, work, viscous dissipation, natural dissipation). `Strut.rate` and
`ledger.spending` are the readable statement of the same equations; a test holds the two together.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from plastica.physics.strut import Strut

__all__ = ["LEDGER", "Kernel", "kernel"]

Array = NDArray[np.float64]
Rate = Callable[[float, Array], Array]
Program = float | Callable[[float], float]

LEDGER = 3
"""How many integrals of the ledger ride along behind the natural curvature."""


@dataclass(frozen=True)
class Kernel:
    """A strut on a stretch of time on which its loads are smooth.

    Attributes
    ----------
    rate, jacobian : callable
        dy/dt and its derivative by y at (t, y).
    excess : callable
        (D, |D| - Theta) of a state y; the second is positive where the natural curvature moves.
    """

    rate: Rate
    jacobian: Callable[[float, Array], Array]
    excess: Callable[[Array], tuple[float, float]]


def kernel(strut: Strut, start: float, end: float) -> Kernel:
    """Build the ODE of `strut` for the times [start, end], between which no load may jump."""
    shear, shear_slope = _shear(strut, start, end)
    return Kernel(_rate(strut, shear), _jacobian(strut, shear, shear_slope), _excess(strut))


def _shear(strut: Strut, start: float, end: float) -> tuple[Callable[..., Array], Callable[..., Array]]:
    """Functions (t, theta) -> contact couple M and (t, theta) -> dM/dtheta, without the work for absent loads."""
    thrust, transverse, couple, weight = (
        program.on(start, end)
        for program in (strut.loads.thrust, strut.loads.transverse, strut.loads.couple, strut.loads.weight)
    )
    B, arm = strut.grid.B, 1.0 - strut.grid.s
    sin, cos = np.sin, np.cos
    if transverse == 0.0 and couple == 0.0 and weight == 0.0:
        if not callable(thrust):
            scaled = thrust * B
            return lambda t, theta: scaled.dot(sin(theta)), lambda t, theta: scaled * cos(theta)
        return (
            lambda t, theta: thrust(t) * B.dot(sin(theta)),
            lambda t, theta: (thrust(t) * B) * cos(theta),
        )
    gamma, tau, m1, w = (_as_function(program) for program in (thrust, transverse, couple, weight))

    def moment(t: float, theta: Array) -> Array:
        along = gamma(t) + w(t) * arm
        return np.asarray(m1(t) + B.dot(along * sin(theta) + tau(t) * cos(theta)))

    def slope(t: float, theta: Array) -> Array:
        along = gamma(t) + w(t) * arm
        return np.asarray(B * (along * cos(theta) - tau(t) * sin(theta)))

    return moment, slope


def _as_function(program: Program) -> Callable[[float], float]:
    if callable(program):
        return program
    value = program
    return lambda t: value


def _rate(strut: Strut, shear: Callable[..., Array]) -> Rate:
    n, w = strut.grid.size, strut.grid.w
    integrals = np.vstack([strut.grid.A, w])
    preference_slope, flow, threshold = (
        strut.laws.preference.slope_at,
        strut.laws.flow.value_at,
        strut.laws.threshold.value_at,
    )

    # On vectors this short NumPy's calls are what costs: `a.dot(b)` takes half the time of `a @ b`.
    def rate(t: float, y: Array) -> Array:
        out = np.empty(n + 1 + LEDGER)
        mu, mu_nat = y[:n], y.item(n)
        angle = integrals.dot(mu)
        couple = shear(t, angle[:n])
        mu_t = couple - mu
        mu_t += mu_nat
        drive = angle.item(n) - mu_nat - preference_slope(mu_nat)
        barrier = threshold(mu_nat)
        mu_nat_t = flow(drive - barrier) - flow(-barrier - drive)
        weighted = w * mu_t
        out[:n] = mu_t
        out[n] = mu_nat_t
        out[n + 1] = weighted.dot(couple)
        out[n + 2] = weighted.dot(mu_t)
        out[n + 3] = drive * mu_nat_t
        return out

    return rate


def _jacobian(
    strut: Strut, shear: Callable[..., Array], shear_slope: Callable[..., Array]
) -> Callable[[float, Array], Array]:
    n, A, w = strut.grid.size, strut.grid.A, strut.grid.w
    preference, flow, threshold = strut.laws.preference, strut.laws.flow, strut.laws.threshold
    diagonal = np.arange(n)

    def jacobian(t: float, y: Array) -> Array:
        mu, mu_nat = y[:n], float(y[n])
        theta = A @ mu
        couple = shear(t, theta)
        mu_t = couple + (mu_nat - mu)
        drive = float(w @ mu) - mu_nat - preference.slope_at(mu_nat)
        barrier, barrier_slope = threshold.value_at(mu_nat), threshold.slope_at(mu_nat)
        up, down = flow.slope_at(drive - barrier), flow.slope_at(-barrier - drive)
        mu_nat_t = flow.value_at(drive - barrier) - flow.value_at(-barrier - drive)
        drive_slope = -1.0 - preference.second_at(mu_nat)

        out = np.zeros((n + 1 + LEDGER, n + 1 + LEDGER))
        bending = shear_slope(t, theta) @ A
        out[:n, :n] = bending
        out[diagonal, diagonal] -= 1.0
        out[:n, n] = 1.0
        out[n, :n] = (up + down) * w
        out[n, n] = (up + down) * drive_slope - (up - down) * barrier_slope
        weighted = w * mu_t
        out[n + 1, :n] = weighted @ bending
        out[n + 1, : n + 1] += (w * couple) @ out[:n, : n + 1]
        out[n + 2, : n + 1] = 2.0 * weighted @ out[:n, : n + 1]
        out[n + 3, : n + 1] = drive * out[n, : n + 1]
        out[n + 3, :n] += mu_nat_t * w
        out[n + 3, n] += mu_nat_t * drive_slope
        return out

    return jacobian


def _excess(strut: Strut) -> Callable[[Array], tuple[float, float]]:
    n, w = strut.grid.size, strut.grid.w
    preference_slope, threshold = strut.laws.preference.slope_at, strut.laws.threshold.value_at

    def excess(y: Array) -> tuple[float, float]:
        mu_nat = y.item(n)
        drive = float(w.dot(y[:n])) - mu_nat - preference_slope(mu_nat)
        return drive, abs(drive) - threshold(mu_nat)

    return excess
