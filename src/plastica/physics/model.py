"""What the strut and the rod with inertia share: geometry, loads, statics, and the law of the natural curvature."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from plastica.errors import ArgumentError
from plastica.material.material import Laws, Material
from plastica.numerics.grid import Grid
from plastica.physics.laws import laws_of
from plastica.physics.layout import Layout
from plastica.physics.load import Load
from plastica.physics.scales import Scales, Specimen
from plastica.physics.segments import Division, segment_breaks

__all__ = ["Model"]

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Model(ABC):
    """A clamped inextensible rod under dead loads; see `Strut` and `Rod` for its two kinds.

    Where the natural curvature is uniform on each of m > 1 segments, everything "by segment" (natural curvature, drive,
    threshold, their rates) has a last axis of length m; where m = 1, it has none.
    """

    material: Material
    load: Load
    grid: Grid = field(default_factory=Grid)
    specimen: Specimen | None = None
    natural_segments: int | Sequence[float] = field(default=1, kw_only=True)

    def __post_init__(self) -> None:
        for name, kind in (("material", Material), ("load", Load), ("grid", Grid)):
            if not isinstance(getattr(self, name), kind):
                raise ArgumentError(f"must be a pl.{kind.__name__}", where=name, value=getattr(self, name))
        if self.specimen is not None and not isinstance(self.specimen, Specimen):
            raise ArgumentError("must be a pl.Specimen or None", where="specimen", value=self.specimen)
        ends = segment_breaks(self.natural_segments)
        given = self.natural_segments
        object.__setattr__(self, "natural_segments", int(given) if isinstance(given, (int, np.integer)) else ends)
        # The curvature jumps where the natural curvature does.
        object.__setattr__(self, "grid", self.grid.with_breaks(ends[1:-1]))
        _ = self.laws, self.loads

    @property
    @abstractmethod
    def damping(self) -> float:
        """Viscous damping delta, retardation time over time scale."""

    @property
    @abstractmethod
    def has_inertia(self) -> bool:
        """Whether the rate of curvature is part of the state."""

    @property
    @abstractmethod
    def swing(self) -> Array | None:
        """The matrix S of `Layout`, where the rate of curvature is part of the state."""

    @property
    def segments(self) -> int:
        """The number m of segments of uniform natural curvature."""
        return self.division.count

    @cached_property
    def division(self) -> Division:
        """The segments of uniform natural curvature, on the grid."""
        return Division(segment_breaks(self.natural_segments), self.grid)

    @cached_property
    def layout(self) -> Layout:
        """Where the parts of a state stand."""
        return Layout(self.grid.size, self.segments, self.swing)

    @cached_property
    def scales(self) -> Scales:
        """What one unit of every dimensionless quantity is in SI; all ones without a specimen."""
        return Scales.unit() if self.specimen is None else self.specimen.scales

    @property
    def time_unit(self) -> str:
        """The unit of times, for sentences."""
        if self.specimen is not None:
            return "s"
        return "retardation times" if self.damping == 1.0 else "T"

    @cached_property
    def laws(self) -> Laws:
        """The dimensionless laws of this specimen's material."""
        return laws_of(self.material, self.specimen)

    @cached_property
    def loads(self) -> Load:
        """The dimensionless load programs in dimensionless time."""
        return self.load.dimensionless(self.scales, si=self.specimen is not None)

    def with_load(self, load: Load) -> Self:
        """Return the same model under another load."""
        return replace(self, load=load)

    def with_grid(self, grid: Grid) -> Self:
        """Return the same model on another grid."""
        return replace(self, grid=grid)

    # -- the equations, written to be read; `physics.kernel` holds their fast form for one state ---------------

    def angle(self, mu: ArrayLike) -> Array:
        """Tangent angle theta = J mu at the nodes; mu of shape (..., n)."""
        return np.asarray(mu, dtype=float) @ self.grid.A.T

    def largest_angle(self, mu: ArrayLike) -> Array:
        """Largest tangent angle, without its sign, at evenly spaced points, the free end among them; shape (...)."""
        return np.asarray(np.abs(np.asarray(mu, dtype=float) @ self.grid.even_integrals.T).max(axis=-1))

    def dead_force(self, t: ArrayLike) -> tuple[Array, Array]:
        """The dead load beyond each node, (along, across) of (-along, across).

        along = gamma + w cos(a) (1 - s) and across = tau + w sin(a) (1 - s), a the angle of the weight.
        """
        thrust, transverse, weight = (
            np.asarray(program(t), dtype=float)[..., None]
            for program in (self.loads.thrust, self.loads.transverse, self.loads.weight)
        )
        along, across = self.arms
        return thrust + weight * along, transverse + weight * across

    @cached_property
    def arms(self) -> tuple[Array, Array]:
        """What a weight of one per length adds to the forces along and across at the nodes, each of shape (n,)."""
        arm, (toward, across) = 1.0 - self.grid.s, self.loads.weight_direction
        return -toward * arm, across * arm

    def force(self, t: ArrayLike, theta: Array) -> tuple[Array, Array]:
        """Tension N = n.a and shear H = n.b of the dead load n = (-along, across) at the nodes; t of shape (...)."""
        along, across = self.dead_force(t)
        return across * np.sin(theta) - along * np.cos(theta), along * np.sin(theta) + across * np.cos(theta)

    def couple(self, t: ArrayLike, mu: ArrayLike) -> Array:
        """Couple of the dead loads M = m1 + J*[n.b] at the nodes: without inertia, the contact couple."""
        _, shear = self.force(t, self.angle(mu))
        return np.asarray(self.loads.couple(t), dtype=float)[..., None] + shear @ self.grid.B.T

    def curvature_between(self, t: ArrayLike, mu: ArrayLike, s: ArrayLike) -> Array:
        """Curvature at any places, from its nodal values.

        Only mu - M, which without inertia is mu_nat - mu_t and flattens as the rod comes to rest, is interpolated; the
        couple M is an integral of the angle, itself an integral, and both are taken on a grid twice as fine. For smooth
        data at gamma = 8 and 16 nodes this gains two digits over interpolating mu.

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
        """Driving force on the natural curvature by segment, D = mean of mu - mu_nat - kappa'(mu_nat)."""
        natural = np.asarray(mu_nat, dtype=float)
        return np.asarray(self.division.mean(mu) - natural - self.laws.preference.slope(natural))

    def threshold(self, mu_nat: ArrayLike) -> Array:
        """Threshold Theta(mu_nat) that the drive must exceed for the natural curvature to move, by segment."""
        return self.laws.threshold.value(np.asarray(mu_nat, dtype=float))

    def natural_rate(self, mu: ArrayLike, mu_nat: ArrayLike) -> Array:
        """Rate of the natural curvature by segment, f(D - Theta) - f(-Theta - D)."""
        drive, threshold = self.drive(mu, mu_nat), self.threshold(mu_nat)
        return self.laws.flow.value(drive - threshold) - self.laws.flow.value(-threshold - drive)
