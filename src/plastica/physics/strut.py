"""The quasi-static strut: an inextensible viscoelastic rod, without inertia, whose natural curvature evolves."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from plastica.errors import ArgumentError
from plastica.physics.model import Model

__all__ = ["Strut", "as_strut", "uniform_strut"]

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Strut(Model):
    """A clamped rod under dead loads, without inertia, with one natural curvature along each of its segments.

    In dimensionless form, with theta(s) = int_0^s mu, the loads at their present values, and one segment::

        couple    M    = m1 + int_s^1 [(gamma + w (1 - s)) sin theta + tau cos theta]
        curvature mu_t = M - (mu - mu_nat)
        natural   mu_nat_t = f(D - Theta(mu_nat)) - f(-Theta(mu_nat) - D)
        drive     D    = int_0^1 mu - mu_nat - kappa'(mu_nat)

    which for a thrust alone are equations (3.9) and (3.10) of Rajagopal and Rodriguez. With several segments each has
    its own natural curvature, and the mean of mu over it in place of the integral (design, section 1.2).

    Parameters
    ----------
    material : Material
        The three laws kappa, f and Theta.
    load : Load
        Thrust, transverse force and couple at the free end, and weight along the rod.
    grid : Grid
        Where the curvature is kept; ``Grid(nodes="auto")`` leaves the number of nodes to `solve`. Elements end where
        segments do.
    specimen : Specimen, optional
        With one, loads, laws, initial data and results are in SI units; without one everything is dimensionless.
    natural_segments : int or sequence of float
        Number of segments of equal length on each of which the natural curvature is uniform, or their ends in units of
        L, such as (0, 0.3, 1). 1 is the rod of the paper.

    Raises
    ------
    ArgumentError
        Where an argument is of the wrong kind, text with units meets a strut without a specimen, or a specimen has no
        retardation time.
    """

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.specimen is not None and self.specimen.damping != 1.0:
            raise ArgumentError(
                "must have a retardation time for a strut, which has no equation of motion without viscosity",
                where="specimen",
                next_step="Give `retardation_time`, or take a pl.Rod.",
            )

    @property
    def damping(self) -> float:
        """Viscous damping: 1, since times are measured in the retardation time."""
        return 1.0

    @property
    def has_inertia(self) -> bool:
        """Whether the rate of curvature is part of the state: never."""
        return False

    @property
    def swing(self) -> None:
        """A strut's state has no rate of curvature."""
        return

    def rate(self, t: ArrayLike, mu: ArrayLike, mu_nat: ArrayLike) -> tuple[Array, Array]:
        """Right-hand side of the model.

        Parameters
        ----------
        t : array_like, shape (...)
            Dimensionless time.
        mu : array_like, shape (..., n)
            Curvature at the nodes.
        mu_nat : array_like, shape (...), or (..., m) with several segments
            Natural curvature.

        Returns
        -------
        mu_t : ndarray, shape (..., n)
        mu_nat_t : ndarray, of the shape of mu_nat
        """
        curvature, natural = np.asarray(mu, dtype=float), np.asarray(mu_nat, dtype=float)
        mu_t = self.couple(t, curvature) - (curvature - self.division.spread(natural))
        return mu_t, self.natural_rate(curvature, natural)


def as_strut(model: object) -> Strut | None:
    """Return the strut with one natural curvature that a model is; None where it is none.

    A `Rod` without inertia is one where its times are in the retardation time, that is where delta = 1.
    """
    if not isinstance(model, Model) or model.segments > 1:
        return None
    if isinstance(model, Strut):
        return model
    if model.has_inertia or model.damping != 1.0:
        return None
    return Strut(model.material, model.load, model.grid, model.specimen)


def uniform_strut(model: object, where: str) -> Strut:
    """Return the strut with one natural curvature that a model is: for no other are limits and charts known.

    Raises
    ------
    ArgumentError
        Where it is none.
    """
    strut = as_strut(model)
    if strut is None:
        raise ArgumentError(
            "must be a strut with one natural segment, for which alone the theory holds: a pl.Strut, or a pl.Rod "
            "without inertia and with a damping of 1",
            where=where,
            value=_in_short(model),
            next_step="Static shapes of any rod come from pl.rest, its motion from pl.solve.",
        )
    return strut


def _in_short(model: object) -> str:
    """What a model is, as far as it keeps it from being a strut with one natural curvature."""
    name = type(model).__name__
    if not isinstance(model, Model):
        return name
    if model.segments > 1:
        return f"a {name} of {model.segments} segments"
    return f"a {name} with inertia" if model.has_inertia else f"a {name} with a damping of {model.damping:g}"
