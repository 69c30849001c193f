"""The equations of a rod with inertia as one vector ODE: fast right-hand side and exact Jacobian.

The balance of moments is B applied to a balance of its densities,

    K theta_tt + eps1 (P o S) theta_t^2 = B^-1 (M_load - mu + mu_nat - delta mu_t),      K = eps0 + eps1 P o C,

P = BA, C = cos(theta_i - theta_j), S = sin(theta_i - theta_j), o entry by entry. Solved for theta_tt this is far better
conditioned than the mass operator B K A: its condition grows like n^4 instead of n^8, and W K is symmetric positive
definite. B^-1 and A^-1 undo exactly what B and A do at the nodes, and so take no derivative of the data.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.linalg.lapack import dposv

from plastica.errors import ArgumentError
from plastica.numerics.gauss import Watch
from plastica.physics.model import Model
from plastica.physics.natural import NaturalLaw, natural_law
from plastica.physics.rod import Rod

__all__ = ["Mover", "inertial_jacobian", "inertial_rate", "inertial_unrest", "mover", "watch_on"]

Array = NDArray[np.float64]

SLACK = 1e3
"""Of the ledger's absolute tolerances in judging steps: it begins at 0, and ripples with the fastest modes."""

Moment = Callable[[float, Array], Array]


class _Constants(NamedTuple):
    """What does not change on the way: integrals and their inverses, scaled to be symmetric under W^(1/2)."""

    root: Array
    momentum: Array
    density: Array
    swing: Array
    spin: Array
    unwind: Array
    rotary: float
    damping: float


def _constants(model: Model) -> tuple[Rod, _Constants]:
    if not isinstance(model, Rod):
        raise ArgumentError("must be a pl.Rod", where="model", value=model)
    root = np.sqrt(model.grid.w)
    symmetric = root[:, None] * model.momentum / root
    return model, _Constants(
        root,
        0.5 * (symmetric + symmetric.T) * float(model.translational_inertia or 0.0),
        root[:, None] * np.linalg.inv(model.grid.B),
        model.turning / root,
        np.asarray(np.linalg.inv(model.turning), dtype=float),
        model.layout.unwind,
        float(model.rotary_inertia or 0.0),
        float(model.damping or 0.0),
    )


class _Motion(NamedTuple):
    """One state seen as a motion; entries with weight W^(1/2) where they are symmetric."""

    theta: Array
    spin: Array
    mu_t: Array
    couple: Array
    imbalance: Array
    stiffness: Array
    whirl: Array
    turn: Array


class Mover(NamedTuple):
    """What rate, Jacobian and unrest of a rod share.

    Attributes
    ----------
    rod : Rod
        The rod.
    fixed : _Constants
        What does not change on the way.
    motion : callable
        Function of (t, y) that solves the balance of moments for the angular acceleration.
    law : NaturalLaw
        The law of the natural curvature.
    """

    rod: Rod
    fixed: _Constants
    motion: Callable[[float, Array], _Motion]
    law: NaturalLaw


def mover(model: Model, moment: Moment) -> Mover:
    """Prepare the equations of a rod with inertia under loads of that couple."""
    rod, fixed = _constants(model)
    A, root, layout = rod.grid.A, fixed.root, rod.layout
    n, natural, rates = layout.nodes, layout.natural_columns, layout.rate_columns
    owner, diagonal = rod.division.owner, np.diag_indices(layout.nodes)

    def motion(t: float, y: Array) -> _Motion:
        mu, swing = y[:n], y[rates]
        mu_t = fixed.unwind.dot(swing)
        theta, spin = A.dot(mu), fixed.spin.dot(swing)
        couple = moment(t, theta)
        imbalance = couple - mu + y[natural][owner] - fixed.damping * mu_t
        sin, cos = np.sin(theta), np.cos(theta)
        stiffness = fixed.momentum * (np.multiply.outer(cos, cos) + np.multiply.outer(sin, sin))
        whirl = fixed.momentum * (np.multiply.outer(sin, cos) - np.multiply.outer(cos, sin))
        stiffness[diagonal] += fixed.rotary
        right = fixed.density.dot(imbalance) - whirl.dot(root * spin * spin)
        _, turn, failed = dposv(stiffness, right)
        if failed:
            turn = np.full(n, np.nan)
        return _Motion(theta, spin, mu_t, couple, imbalance, stiffness, whirl, turn)

    return Mover(rod, fixed, motion, natural_law(rod))


def inertial_rate(parts: Mover) -> Callable[[float, Array], Array]:
    """Return dy/dt of a rod with inertia."""
    rod, fixed, motion, law = parts
    layout, w = rod.layout, rod.grid.w
    n, natural, sheet, rates = layout.nodes, layout.natural_columns, layout.ledger_columns, layout.rate_columns

    def rate(t: float, y: Array) -> Array:
        out = np.empty(layout.size)
        moved = motion(t, y)
        mu_t = moved.mu_t
        mu_nat_t, spent = law.rate(y[:n], y[natural])
        weighted = w * mu_t
        out[:n], out[natural] = mu_t, mu_nat_t
        out[sheet] = weighted.dot(moved.couple), fixed.damping * weighted.dot(mu_t), spent
        out[rates] = fixed.swing.dot(moved.turn)
        return out

    return rate


def inertial_jacobian(parts: Mover, slope: Moment) -> Callable[[float, Array], Array]:
    """Return the derivative of dy/dt by y of a rod with inertia; `slope` is that of the loads' couple."""
    rod, fixed, motion, law = parts
    layout, w = rod.layout, rod.grid.w
    A, root, owner = rod.grid.A, fixed.root, rod.division.owner
    n, natural, rates = layout.nodes, layout.natural_columns, layout.rate_columns
    work, viscous, spent = range(layout.size)[layout.ledger_columns]

    def jacobian(t: float, y: Array) -> Array:
        moved = motion(t, y)
        out = np.zeros((layout.size, layout.size))
        law.into_jacobian(out, y[:n], y[natural], spent)
        out[:n, rates] = fixed.unwind
        bending = slope(t, moved.theta) @ A
        right = np.zeros((n, layout.size))
        right[:, :n] = fixed.density @ (bending - np.eye(n)) - _centrifugal(moved, root, fixed.rotary) @ A
        right[:, rates] = -fixed.damping * fixed.density @ fixed.unwind
        right[:, rates] -= moved.whirl @ ((2.0 * root * moved.spin)[:, None] * fixed.spin)
        np.add.at(right.T, n + owner, fixed.density.T)
        _, turned, failed = dposv(moved.stiffness, right)
        out[rates] = fixed.swing @ turned if not failed else np.nan
        weighted = w * moved.mu_t
        out[work, :n] = weighted @ bending
        out[work, rates] = (w * moved.couple) @ fixed.unwind
        out[viscous, rates] = 2.0 * fixed.damping * weighted @ fixed.unwind
        return out

    return jacobian


def _centrifugal(moved: _Motion, root: Array, rotary: float) -> Array:
    """Derivative of K theta_tt + eps1 (P o S) theta_t^2 by theta at fixed theta_t and theta_tt, in W^(1/2)."""
    inertia = moved.stiffness.copy()
    inertia[np.diag_indices_from(inertia)] -= rotary
    table = moved.whirl * moved.turn - inertia * (root * moved.spin**2)
    return np.asarray(table - np.diag(table.sum(axis=1)))


def inertial_unrest(parts: Mover) -> Callable[[float, Array], float]:
    """Return the norm of what moves: rates of curvature and natural curvature, and the imbalance of moments."""
    rod, _, motion, law = parts
    layout, w = rod.layout, rod.grid.w
    n, natural = layout.nodes, layout.natural_columns

    def unrest(t: float, y: Array) -> float:
        mu_nat_t, _ = law.rate(y[:n], y[natural])
        moved = motion(t, y)
        norms = (float(np.sqrt(w @ each**2)) for each in (moved.mu_t, moved.imbalance))
        return max(*norms, float(np.abs(mu_nat_t).max()))

    return unrest


def watch_on(rod: Rod, atol: Array) -> Watch:
    """Return what steps are judged by: the slower half of the straight rod's modes, natural curvatures, the ledger.

    The faster half are vibrations of the grid, not of the rod: their frequencies are wrong by a factor, and to follow
    them in time would cost a thousand times as much as the rod itself. A method that conserves energy leaves them be.
    With several segments all modes are looked at: the drives of short segments feel the short waves.
    """
    layout, w = rod.layout, rod.grid.w
    n, natural, sheet = layout.nodes, layout.natural_columns, layout.ledger_columns
    mass = w[:, None] * rod.mass(np.zeros(n))
    root = np.sqrt(w)
    scaled = 0.5 * (mass + mass.T) / np.multiply.outer(root, root)
    _, vectors = np.linalg.eigh(scaled)
    kept = n if rod.segments > 1 else max(1, (n + 1) // 2)
    # Largest first: the inverse squares of the lowest frequencies.
    modes = (root[:, None] * vectors[:, ::-1][:, :kept]).T
    matrix = np.zeros((kept + sheet.stop - n, layout.size))
    matrix[:kept, :n] = modes
    matrix[kept:, n : sheet.stop] = np.eye(sheet.stop - n)
    moving = slice(kept, kept + natural.stop - natural.start)
    groups = (slice(0, kept), moving, slice(moving.stop, matrix.shape[0]))
    return Watch(matrix, groups, np.concatenate([atol[:kept], atol[natural], SLACK * atol[sheet]]))
