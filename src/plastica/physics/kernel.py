"""A model's equations as one vector ODE for SciPy's solvers: fast right-hand side and exact Jacobian.

`Strut.rate`, `Rod.rate` and `ledger.spending` are the readable statement of the same equations; a test holds the two
together. Rods with inertia have their kernel in `physics.inertial`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from plastica.physics.model import Model
from plastica.physics.natural import Excess, Yields, natural_law, yielding

if TYPE_CHECKING:
    from plastica.numerics.gauss import Watch

__all__ = ["Kernel", "Moment", "kernel", "load_moment"]

Array = NDArray[np.float64]
Rate = Callable[[float, Array], Array]
Program = float | Callable[[float], float]
Moment = Callable[[float, Array], Array]


@dataclass(frozen=True)
class Kernel:
    """A model on a stretch of time on which its loads are smooth.

    Attributes
    ----------
    rate, jacobian : callable
        dy/dt and its derivative by y at (t, y), y as in `physics.layout`.
    excess : callable
        |D| - Theta of a state y by segment; positive where the natural curvature moves.
    yields : callable
        Whether the natural curvature moves in a state y, by segment.
    unrest : callable
        Norm of what moves at (t, y): rates of curvature and natural curvature, and with inertia the imbalance of
        moments too, since a rod that swings stands still at its turning points.
    watch : callable
        What the error of a step of `numerics.gauss` is measured in, for absolute tolerances of the state's components.
    """

    rate: Rate
    jacobian: Callable[[float, Array], Array]
    excess: Excess
    yields: Yields
    unrest: Callable[[float, Array], float]
    watch: Callable[[Array], Watch]


def kernel(model: Model, start: float, end: float) -> Kernel:
    """Build the ODE of `model` for the times [start, end], between which no load may jump."""
    moment, slope = load_moment(model, start, end)
    excess, yields = yielding(model)
    if model.has_inertia:
        from plastica.physics import inertial

        parts = inertial.mover(model, moment)
        rate, jacobian = inertial.inertial_rate(parts), inertial.inertial_jacobian(parts, slope)
        watch = partial(inertial.watch_on, parts.rod)
        return Kernel(rate, jacobian, excess, yields, inertial.inertial_unrest(parts), watch)
    rate = _uniform_rate(model, moment) if model.segments == 1 else _rate(model, moment)
    return Kernel(rate, _jacobian(model, moment, slope), excess, yields, _unrest(model, rate), _everything)


def load_moment(model: Model, start: float, end: float) -> tuple[Moment, Moment]:
    """Functions of (t, theta): couple of the loads, and its slope by theta, without work for absent loads."""
    thrust, transverse, couple, weight = (
        program.on(start, end)
        for program in (model.loads.thrust, model.loads.transverse, model.loads.couple, model.loads.weight)
    )
    B = model.grid.B
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
    arm_along, arm_across = model.arms

    def moment(t: float, theta: Array) -> Array:
        heft = w(t)
        along, across = gamma(t) + heft * arm_along, tau(t) + heft * arm_across
        return np.asarray(m1(t) + B.dot(along * sin(theta) + across * cos(theta)))

    def slope(t: float, theta: Array) -> Array:
        heft = w(t)
        along, across = gamma(t) + heft * arm_along, tau(t) + heft * arm_across
        return np.asarray(B * (along * cos(theta) - across * sin(theta)))

    return moment, slope


def _as_function(program: Program) -> Callable[[float], float]:
    if callable(program):
        return program
    value = program
    return lambda t: value


def _uniform_rate(model: Model, moment: Moment) -> Rate:
    """The rate where the natural curvature is one number; it costs half of what `_rate` does."""
    n, w, size = model.grid.size, model.grid.w, model.layout.size
    integrals = np.vstack([model.grid.A, w])
    damping = float(model.damping)
    preference_slope, flow, threshold = (
        model.laws.preference.slope_at,
        model.laws.flow.value_at,
        model.laws.threshold.value_at,
    )

    # On vectors this short NumPy's calls are what costs: `a.dot(b)` takes half the time of `a @ b`.
    def rate(t: float, y: Array) -> Array:
        out = np.empty(size)
        mu, mu_nat = y[:n], y.item(n)
        angle = integrals.dot(mu)
        couple = moment(t, angle[:n])
        mu_t = couple - mu
        mu_t += mu_nat
        if damping != 1.0:
            mu_t /= damping
        drive = angle.item(n) - mu_nat - preference_slope(mu_nat)
        barrier = threshold(mu_nat)
        mu_nat_t = flow(drive - barrier) - flow(-barrier - drive)
        weighted = w * mu_t
        out[:n] = mu_t
        out[n] = mu_nat_t
        out[n + 1] = weighted.dot(couple)
        out[n + 2] = damping * weighted.dot(mu_t)
        out[n + 3] = drive * mu_nat_t
        return out

    return rate


def _rate(model: Model, moment: Moment) -> Rate:
    A, w, layout, division = model.grid.A, model.grid.w, model.layout, model.division
    natural, sheet = layout.natural_columns, layout.ledger_columns
    n, owner, damping = layout.nodes, division.owner, float(model.damping)
    law = natural_law(model)

    def rate(t: float, y: Array) -> Array:
        out = np.empty(layout.size)
        mu, mu_nat = y[:n], y[natural]
        couple = moment(t, A.dot(mu))
        mu_t = (couple - mu + mu_nat[owner]) / damping
        mu_nat_t, spent = law.rate(mu, mu_nat)
        weighted = w * mu_t
        out[:n], out[natural] = mu_t, mu_nat_t
        out[sheet] = weighted.dot(couple), damping * weighted.dot(mu_t), spent
        return out

    return rate


def _everything(atol: Array) -> Watch:
    """Watch every component; SciPy's integrators are loaded only where one is asked for."""
    from plastica.numerics.gauss import Watch

    return Watch.everything(atol)


def _jacobian(model: Model, moment: Moment, slope: Moment) -> Callable[[float, Array], Array]:
    A, w, layout, division = model.grid.A, model.grid.w, model.layout, model.division
    n, natural, damping = layout.nodes, layout.natural_columns, float(model.damping)
    work, viscous, spent = range(layout.size)[layout.ledger_columns]
    diagonal, columns = np.arange(n), n + division.owner
    law = natural_law(model)

    def jacobian(t: float, y: Array) -> Array:
        mu, mu_nat = y[:n], y[natural]
        theta = A @ mu
        couple = moment(t, theta)
        mu_t = (couple + (mu_nat[division.owner] - mu)) / damping
        out = np.zeros((layout.size, layout.size))
        bending = slope(t, theta) @ A
        out[:n, :n] = bending
        out[diagonal, diagonal] -= 1.0
        out[diagonal, columns] = 1.0
        if damping != 1.0:
            out[:n] /= damping
        law.into_jacobian(out, mu, mu_nat, spent)
        weighted = w * mu_t
        state = slice(0, natural.stop)
        out[work, :n] = weighted @ bending
        out[work, state] += (w * couple) @ out[:n, state]
        out[viscous, state] = 2.0 * damping * weighted @ out[:n, state]
        return out

    return jacobian


def _unrest(model: Model, rate: Rate) -> Callable[[float, Array], float]:
    n, w, natural = model.grid.size, model.grid.w, model.layout.natural_columns

    def unrest(t: float, y: Array) -> float:
        moving = rate(t, y)
        return max(float(np.sqrt(w @ moving[:n] ** 2)), float(np.abs(moving[natural]).max()))

    return unrest
