"""The rod with inertia: the paper's section 2 in integral form, of which the strut is the quasi-static limit."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from plastica.errors import ArgumentError
from plastica.physics.amounts import plain
from plastica.physics.model import Model

__all__ = ["Contact", "Rod"]

Array = NDArray[np.float64]

LARGEST_INERTIA = 1e12
"""Of the dimensionless inertias and the damping: beyond it a time scale was mistaken."""


class Contact(NamedTuple):
    """Contact force and couple along the rod, and at the clamp: what the part beyond s exerts on the part before.

    Attributes
    ----------
    tension, shear, couple : ndarray, shape (..., n)
        n.a, n.b and M at the nodes.
    clamp_x, clamp_y, clamp_couple : ndarray, shape (...)
        Force and couple that the rod exerts on the clamp, n(0) and M(0).
    """

    tension: Array
    shear: Array
    couple: Array
    clamp_x: Array
    clamp_y: Array
    clamp_couple: Array


@dataclass(frozen=True)
class Rod(Model):
    """A clamped rod with inertia under dead loads; both inertias 0 make it the strut.

    With theta = J mu, r_t = J[theta_t b] and the loads at their present values, n_load (design, section 1.2)::

        mu - mu_nat + delta mu_t = m1 + J*[n.b - eps0 theta_tt]
        n = n_load - eps1 J* r_tt,      r_tt = J[theta_tt b - theta_t^2 a]

    and the natural curvature evolves as that of `Strut`. These are the balances of linear and angular momentum and the
    constitutive law of section 2 of Rajagopal and Rodriguez, integrated: no derivative in s is taken.

    Parameters
    ----------
    material : Material
        The three laws kappa, f and Theta.
    load : Load
        Thrust, transverse force and couple at the free end, and weight along the rod.
    grid : Grid
        Where the curvature is kept, as for `Strut`.
    specimen : Specimen, optional
        With one, loads, laws, initial data and results are in SI units, and it says inertias and damping.
    natural_segments : int or sequence of float
        Segments of uniform natural curvature, as for `Strut`.
    translational_inertia : float, optional
        eps1 = rho A L^4/(EI T^2), dimensionless. By default that of the specimen; 0 without one.
    rotary_inertia : float, optional
        eps0 = rho J L^2/(EI T^2), dimensionless. By default that of the specimen; 0 without one.
    damping : float, optional
        delta, retardation time over time scale T: 1 where times are measured in the retardation time, 0 for a purely
        elastic rod (T is then (rho A L^4/EI)^(1/2), which makes eps1 = 1). By default that of the specimen, else 1.

    Raises
    ------
    ArgumentError
        Where an argument is of the wrong kind or negative, differs from what the specimen says, or the rod has neither
        inertia nor damping, which leaves it without an equation of motion.
    """

    translational_inertia: float | None = field(default=None, kw_only=True)
    rotary_inertia: float | None = field(default=None, kw_only=True)
    damping: float | None = field(default=None, kw_only=True)  # type: ignore[assignment]

    def __post_init__(self) -> None:
        super().__post_init__()
        spec = self.specimen
        for name, without, own in (
            ("translational_inertia", 0.0, 0.0 if spec is None else spec.translational_inertia),
            ("rotary_inertia", 0.0, 0.0 if spec is None else spec.rotary_inertia_ratio),
            ("damping", 1.0, 0.0 if spec is None else spec.damping),
        ):
            object.__setattr__(self, name, _chosen(name, getattr(self, name), own, without if spec is None else own))
        if not self.has_inertia and self.damping == 0.0:
            raise ArgumentError(
                "must not all be 0: without inertia and damping there is no equation of motion",
                where="translational_inertia, rotary_inertia and damping",
                next_step="Give an inertia or a damping; for static shapes use pl.rest.",
            )

    @property
    def has_inertia(self) -> bool:
        """Whether the rate of curvature is part of the state: where an inertia is not 0."""
        return self.translational_inertia != 0.0 or self.rotary_inertia != 0.0

    @cached_property
    def swing(self) -> Array | None:
        """S = (eps1^(1/2) A + eps0^(1/2)) A: the velocity of a straight rod, in the norm of its kinetic energy."""
        return self.turning @ self.grid.A if self.has_inertia else None

    @cached_property
    def turning(self) -> Array:
        """What takes the angular velocity theta_t to the swing, eps1^(1/2) A + eps0^(1/2); shape (n, n)."""
        return np.asarray(np.sqrt(self._translation) * self.grid.A + np.sqrt(self._rotary) * np.eye(self.grid.size))

    @cached_property
    def momentum(self) -> Array:
        """P = B A at the nodes, which takes an acceleration to what it adds to the contact force; shape (n, n)."""
        return self.grid.B @ self.grid.A

    def mass(self, mu: ArrayLike) -> Array:
        """Mass operator B[eps0 + eps1(cos BA cos + sin BA sin)]A of a shape, symmetric under W; shape (n, n)."""
        return np.asarray(self.grid.B @ self._turning_mass(self.angle(mu)) @ self.grid.A)

    @property
    def _translation(self) -> float:
        return float(self.translational_inertia or 0.0)

    @property
    def _rotary(self) -> float:
        return float(self.rotary_inertia or 0.0)

    @property
    def _damping(self) -> float:
        return float(self.damping or 0.0)

    def velocity(self, mu: ArrayLike, mu_t: ArrayLike) -> tuple[Array, Array]:
        """Velocity r_t = J[theta_t b] at the nodes, along and across the clamp's tangent; shapes (..., n)."""
        theta, spin = self.angle(mu), self.angle(mu_t)
        return (-np.sin(theta) * spin) @ self.grid.A.T, (np.cos(theta) * spin) @ self.grid.A.T

    def kinetic_energy(self, mu: ArrayLike, mu_t: ArrayLike) -> Array:
        """Kinetic energy 1/2 eps1 int |r_t|^2 + 1/2 eps0 int theta_t^2; shape (...)."""
        x, y = self.velocity(mu, mu_t)
        spin = self.angle(mu_t)
        density = self._translation * (x * x + y * y) + self._rotary * spin * spin
        return np.asarray(0.5 * density @ self.grid.w)

    def rate(
        self, t: ArrayLike, mu: ArrayLike, mu_nat: ArrayLike, mu_t: ArrayLike | None = None
    ) -> tuple[Array, Array, Array]:
        """Right-hand side of the model.

        Parameters
        ----------
        t : array_like, shape (...)
            Dimensionless time.
        mu : array_like, shape (..., n)
            Curvature at the nodes.
        mu_nat : array_like, shape (...), or (..., m) with several segments
            Natural curvature.
        mu_t : array_like, shape (..., n)
            Rate of curvature; not looked at where the rod has no inertia, and then it follows.

        Returns
        -------
        mu_t : ndarray, shape (..., n)
        mu_nat_t : ndarray, of the shape of mu_nat
        mu_tt : ndarray, shape (..., n)
            0 where the rod has no inertia: it is then no part of the equations.
        """
        first, turn = self._motion(t, mu, mu_nat, mu_t)
        mu_tt = np.linalg.solve(self.grid.A, turn[..., None])[..., 0]
        return first, self.natural_rate(mu, mu_nat), np.asarray(mu_tt, dtype=float)

    def _motion(
        self, t: ArrayLike, mu: ArrayLike, mu_nat: ArrayLike, mu_t: ArrayLike | None
    ) -> tuple[Array, Array]:
        """Rate of curvature and angular acceleration theta_tt of a state; the latter is 0 without inertia."""
        curvature = np.asarray(mu, dtype=float)
        moment = self.couple(t, curvature) - (curvature - self.division.spread(mu_nat))
        if not self.has_inertia:
            return moment / self._damping, np.zeros_like(curvature)
        first = np.zeros_like(curvature) if mu_t is None else np.asarray(mu_t, dtype=float)
        return first, self._angular_acceleration(curvature, first, moment - self._damping * first)

    def _angular_acceleration(self, mu: Array, mu_t: Array, moment: Array) -> Array:
        """Angular acceleration theta_tt that an unbalanced moment causes at the nodes; all of shape (..., n).

        Solves B (eps0 + eps1(cos BA cos + sin BA sin)) theta_tt = moment less that of the centrifugal forces, state by
        state, as `physics.inertial` does: by way of the mass operator it would lose many digits.
        """
        theta, spin = self.angle(mu), self.angle(mu_t)
        sin, cos = np.sin(theta), np.cos(theta)
        along, across = (cos * spin**2) @ self.momentum.T, (sin * spin**2) @ self.momentum.T
        density = np.linalg.solve(self.grid.B, moment[..., None])[..., 0]
        right = density - self._translation * (sin * along - cos * across)
        states = zip(theta.reshape(-1, self.grid.size), right.reshape(-1, self.grid.size), strict=True)
        return np.array([np.linalg.solve(self._turning_mass(each), push) for each, push in states]).reshape(theta.shape)

    def _turning_mass(self, theta: Array) -> Array:
        """The operator eps0 + eps1(cos BA cos + sin BA sin) of one shape; shape (n, n)."""
        inner = self._translation * (self.momentum * np.cos(theta[:, None] - theta))
        inner[np.diag_indices_from(inner)] += self._rotary
        return inner

    def contact(self, t: ArrayLike, mu: ArrayLike, mu_nat: ArrayLike, mu_t: ArrayLike | None = None) -> Contact:
        """Contact force n = n_load - eps1 J* r_tt and couple M = mu - mu_nat + delta mu_t, along the rod, at the clamp.

        Arguments as of `rate`. At the clamp M(0) = m1 + int [n.b - eps0 theta_tt], from the balance of moments.
        """
        curvature = np.asarray(mu, dtype=float)
        first, turn = self._motion(t, curvature, mu_nat, mu_t)
        theta, spin = self.angle(curvature), self.angle(first)
        sin, cos = np.sin(theta), np.cos(theta)
        x_tt = (-turn * sin - spin**2 * cos) @ self.grid.A.T
        y_tt = (turn * cos - spin**2 * sin) @ self.grid.A.T
        along, across = self.dead_force(t)
        n_x = -along - self._translation * (x_tt @ self.grid.B.T)
        n_y = across - self._translation * (y_tt @ self.grid.B.T)
        shear = n_y * cos - n_x * sin
        clamp = [
            total - self._translation * (each @ self.grid.w)
            for total, each in zip(self._whole_load(t), (x_tt, y_tt), strict=True)
        ]
        moment = np.asarray(self.loads.couple(t), dtype=float) + (shear - self._rotary * turn) @ self.grid.w
        contact_couple = curvature - self.division.spread(mu_nat) + self._damping * first
        return Contact(n_x * cos + n_y * sin, shear, contact_couple, clamp[0], clamp[1], np.asarray(moment))

    def _whole_load(self, t: ArrayLike) -> tuple[Array, Array]:
        """The dead force on the whole rod, n_load(0)."""
        thrust, transverse, weight = (
            np.asarray(program(t), dtype=float)
            for program in (self.loads.thrust, self.loads.transverse, self.loads.weight)
        )
        toward, across = self.loads.weight_direction
        return weight * toward - thrust, transverse + weight * across


def _chosen(name: str, given: object, own: float, default: float) -> float:
    """The number given, else the default; an error where it is none, or differs from the specimen's own."""
    if given is None:
        return default
    number = plain(given)
    if not isinstance(number, float) or not 0.0 <= number <= LARGEST_INERTIA:
        raise ArgumentError(
            f"must be a number in [0, {LARGEST_INERTIA:g}], dimensionless",
            where=name,
            value=given,
            next_step="Units belong in the specimen: mass_per_length, rotary_inertia, density, retardation_time.",
        )
    if own != 0.0 and abs(number - own) > 1e-12 * own:
        raise ArgumentError(
            f"must be left out, or {own:.12g}, which the specimen makes it", where=name, value=given
        )
    return number
