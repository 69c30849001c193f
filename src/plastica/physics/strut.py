"""The quasi-static strut: an inextensible viscoelastic rod whose uniform natural curvature evolves."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from plastica.errors import ArgumentError
from plastica.material.material import Laws, Material
from plastica.numerics.grid import Grid
from plastica.physics.laws import laws_of
from plastica.physics.load import Load
from plastica.physics.scales import Scales, Specimen

__all__ = ["Strut"]

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Strut:
    """A clamped rod under dead loads, without inertia, with one natural curvature along its length.

    In dimensionless form, with theta(s) = int_0^s mu and the loads at their present values::

        couple    M    = m1 + int_s^1 [(gamma + w (1 - s)) sin theta + tau cos theta]
        curvature mu_t = M - (mu - mu_nat)
        natural   mu_nat_t = f(D - Theta(mu_nat)) - f(-Theta(mu_nat) - D)
        drive     D    = int_0^1 mu - mu_nat - kappa'(mu_nat)

    which for a thrust alone are equations (3.9) and (3.10) of Rajagopal and Rodriguez.

    Parameters
    ----------
    material : Material
        The three laws kappa, f and Theta.
    load : Load
        Thrust, transverse force and couple at the free end, and weight along the rod.
    grid : Grid
        Where the curvature is kept; ``Grid(nodes="auto")`` leaves the number of nodes to `solve`.
    specimen : Specimen, optional
        With one, loads, laws, initial data and results are in SI units; without one everything is dimensionless.

    Raises
    ------
    ArgumentError
        Where an argument is of the wrong kind, or text with units meets a strut without a specimen.
    """

    material: Material
    load: Load
    grid: Grid = field(default_factory=Grid)
    specimen: Specimen | None = None

    def __post_init__(self) -> None:
        for name, kind in (("material", Material), ("load", Load), ("grid", Grid)):
            if not isinstance(getattr(self, name), kind):
                raise ArgumentError(f"must be a pl.{kind.__name__}", where=name, value=getattr(self, name))
        if self.specimen is not None and not isinstance(self.specimen, Specimen):
            raise ArgumentError("must be a pl.Specimen or None", where="specimen", value=self.specimen)
        _ = self.laws, self.loads

    @cached_property
    def scales(self) -> Scales:
        """What one unit of every dimensionless quantity is in SI; all ones without a specimen."""
        return Scales.unit() if self.specimen is None else self.specimen.scales

    @cached_property
    def laws(self) -> Laws:
        """The dimensionless laws of this specimen's material."""
        return laws_of(self.material, self.specimen)

    @cached_property
    def loads(self) -> Load:
        """The dimensionless load programs in dimensionless time."""
        return self.load.dimensionless(self.scales, si=self.specimen is not None)

    def with_load(self, load: Load) -> Strut:
        """Return the same strut under another load."""
        return Strut(self.material, load, self.grid, self.specimen)

    def with_grid(self, grid: Grid) -> Strut:
        """Return the same strut on another grid."""
        return Strut(self.material, self.load, grid, self.specimen)

    # -- the equations, written to be read; `physics.kernel` holds their fast form for one state ---------------

    def angle(self, mu: ArrayLike) -> Array:
        """Tangent angle theta = J mu at the nodes; mu of shape (..., n)."""
        return np.asarray(mu, dtype=float) @ self.grid.A.T

    def force(self, t: ArrayLike, theta: Array) -> tuple[Array, Array]:
        """Tension N = n.a and shear H = n.b at the nodes, n = (-gamma - w (1 - s), tau); t of shape (...)."""
        along, across = self.dead_force(t)
        return across * np.sin(theta) - along * np.cos(theta), along * np.sin(theta) + across * np.cos(theta)

    def dead_force(self, t: ArrayLike) -> tuple[Array, Array]:
        """The load below each node: compression toward the clamp gamma + w (1 - s), and transverse force tau."""
        thrust, transverse, weight = (
            np.asarray(program(t), dtype=float)[..., None]
            for program in (self.loads.thrust, self.loads.transverse, self.loads.weight)
        )
        return thrust + weight * (1.0 - self.grid.s), transverse

    def couple(self, t: ArrayLike, mu: ArrayLike) -> Array:
        """Contact couple M = m1 + J*[n.b] at the nodes, from the balance of moments."""
        _, shear = self.force(t, self.angle(mu))
        return np.asarray(self.loads.couple(t), dtype=float)[..., None] + shear @ self.grid.B.T

    def curvature_between(self, t: ArrayLike, mu: ArrayLike, s: ArrayLike) -> Array:
        """Curvature at any places, from its nodal values.

        Only mu - M, which is mu_nat - mu_t and flattens as the rod comes to rest, is interpolated; the couple M is
        an integral of the angle, itself an integral, and both are taken on a grid twice as fine. For smooth data at
        gamma = 8 and 16 nodes this gains two digits over interpolating mu.

        Parameters
        ----------
        t : array_like, shape (k,)
            Dimensionless times.
        mu : array_like, shape (k, n)
            Curvature at the nodes.
        s : array_like, shape (p,)
            Places in [0, 1]; at an element end the value is the limit from the right.

        Returns
        -------
        ndarray, shape (k, p)
        """
        curvature = np.asarray(mu, dtype=float)
        fine = self.with_grid(self.grid.refined())
        _, shear = fine.force(t, curvature @ self.grid.integration(fine.grid.s).T)
        couple, at_nodes = (shear @ (fine.grid.w - fine.grid.integration(x)).T for x in (s, self.grid.s))
        return (curvature - at_nodes) @ self.grid.interpolation(s).T + couple

    def drive(self, mu: ArrayLike, mu_nat: ArrayLike) -> Array:
        """Driving force on the natural curvature, D = int mu - mu_nat - kappa'(mu_nat)."""
        natural = np.asarray(mu_nat, dtype=float)
        return np.asarray(np.asarray(mu, dtype=float) @ self.grid.w - natural - self.laws.preference.slope(natural))

    def threshold(self, mu_nat: ArrayLike) -> Array:
        """Threshold Theta(mu_nat) that the drive must exceed for the natural curvature to move."""
        return self.laws.threshold.value(np.asarray(mu_nat, dtype=float))

    def natural_rate(self, mu: ArrayLike, mu_nat: ArrayLike) -> Array:
        """Rate of the natural curvature, f(D - Theta) - f(-Theta - D)."""
        drive, threshold = self.drive(mu, mu_nat), self.threshold(mu_nat)
        return self.laws.flow.value(drive - threshold) - self.laws.flow.value(-threshold - drive)

    def rate(self, t: ArrayLike, mu: ArrayLike, mu_nat: ArrayLike) -> tuple[Array, Array]:
        """Right-hand side of the model.

        Parameters
        ----------
        t : array_like, shape (...)
            Dimensionless time.
        mu : array_like, shape (..., n)
            Curvature at the nodes.
        mu_nat : array_like, shape (...)
            Natural curvature.

        Returns
        -------
        mu_t : ndarray, shape (..., n)
        mu_nat_t : ndarray, shape (...)
        """
        curvature, natural = np.asarray(mu, dtype=float), np.asarray(mu_nat, dtype=float)
        mu_t = self.couple(t, curvature) - (curvature - natural[..., None])
        return mu_t, self.natural_rate(curvature, natural)
