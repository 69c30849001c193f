"""Modes of vibration: frequencies, damping ratios and shapes of small motions about a shape at rest."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from plastica.errors import ArgumentError
from plastica.physics.model import Model

if TYPE_CHECKING:
    import xarray

__all__ = ["Modes"]

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

EPS = float(np.finfo(float).eps)


@dataclass(frozen=True, eq=False)
class Modes:
    """Small motions about a shape at rest, as returned by `modes`; in SI with a specimen, else dimensionless.

    With x the changes of curvature at the nodes, M x_tt + D x_t + K x = 0, where 1/2 x^T K x is the second variation of
    the energy, 1/2 x_t^T M x_t the kinetic energy and x_t^T D x_t the power dissipated.

    Attributes
    ----------
    model : Strut or Rod
        The rod on the grid that was used.
    mu, theta : ndarray, shape (n,)
        Dimensionless curvature and tangent angle at rest.
    mu_nat : float, or ndarray of shape (m,) with several segments
        Dimensionless natural curvature, which is held.
    frequencies : ndarray, shape (count,)
        Angular frequencies omega of K x = omega^2 M x, the rod without damping, ascending; in rad/s, or rad per T. 0
        where omega^2 is 0 within its error, nan where it is negative, and inf without inertia.
    squares : ndarray, shape (count,)
        omega^2, in 1/s^2 or 1/T^2; negative where the rod would diverge.
    errors : ndarray, shape (count,)
        Estimated error of each frequency; without inertia of the first eigenvalues.
    eigenvalues : ndarray of complex, shape (count, 2)
        Both solutions lambda of lambda^2 M + lambda D + K that belong to the mode, in 1/s or 1/T: the one with positive
        imaginary part and its conjugate, or the slow and the fast real one.
    damping_ratios : ndarray, shape (count,)
        zeta = -(lambda_1 + lambda_2) / (2 (lambda_1 lambda_2)^(1/2)): above 1 the mode does not swing. nan where
        one of the two grows.
    shapes : ndarray, shape (count, n)
        Curvatures of the modes without damping at the nodes, of modal mass x^T M x = 1; without inertia of
        int x^2 ds/L = 1 (times 1/L). The free end moves to the side of +y.
    mass, damping, stiffness : ndarray, shape (n, n)
        M, D and K for nodal curvatures: symmetric. In SI N m^3 s^2, N m^3 s and N m^3; dimensionless otherwise.
    unstable : int
        Number of negative directions of K: ways in which the shape gives way at held natural curvature.
    resolved : bool
        Whether omega^2 of all of them changes by less than 1e-10 of itself from the coarser grid to the finer.
    stays : bool
        Whether every drive is within its threshold. If not the natural curvature moves, and the shape with it.
    """

    model: Model
    mu: Array
    theta: Array
    mu_nat: float | Array
    frequencies: Array
    squares: Array
    errors: Array
    eigenvalues: Complex
    damping_ratios: Array
    shapes: Array
    mass: Array
    damping: Array
    stiffness: Array
    unstable: int
    resolved: bool
    stays: bool

    @property
    def stable(self) -> bool:
        """Whether no direction is unstable at held natural curvature."""
        return self.unstable == 0

    @property
    def hertz(self) -> Array:
        """Frequencies omega/(2 pi), in Hz or 1/T; shape (count,)."""
        return self.frequencies / (2.0 * np.pi)

    @property
    def damped_frequencies(self) -> Array:
        """Angular frequencies |Im lambda| of the damped rod, 0 where it does not swing; shape (count,)."""
        return np.abs(self.eigenvalues[:, 0].imag)

    @property
    def s(self) -> Array:
        """Arc lengths of the nodes, in m or L; shape (n,)."""
        return self.model.grid.s * self.model.scales.length

    @cached_property
    def sentence(self) -> str:
        """The same in words."""
        return " ".join(_sentences(self))

    def curvature(self, s: ArrayLike) -> Array:
        """Return the curvatures of the modes at arc lengths s (m, or L); shape (count, ...)."""
        return self._at(self.model.grid.interpolation, self.shapes, s)

    def angle(self, s: ArrayLike) -> Array:
        """Return the changes of the tangent angle, psi = int_0^s of the curvature; shape (count, ...)."""
        return self._at(self.model.grid.integration, self.shapes * self.model.scales.length, s)

    def displacement(self, s: ArrayLike) -> tuple[Array, Array]:
        """Return the displacements int_0^s psi b, along and across the clamp's tangent; each of shape (count, ...)."""
        psi = self.shapes @ self.model.grid.A.T * self.model.scales.length**2
        parts = -np.sin(self.theta) * psi, np.cos(self.theta) * psi
        x, y = (self._at(self.model.grid.integration, part, s) for part in parts)
        return x, y

    def _at(self, matrix: Any, nodal: Array, s: ArrayLike) -> Array:
        where = np.asarray(s, dtype=float) / self.model.scales.length
        slack = 4.0 * EPS
        inside = np.where((where > 1.0) & (where <= 1.0 + slack), 1.0, where)
        if not np.all((inside >= 0.0) & (inside <= 1.0)):
            raise ArgumentError(f"must lie on the rod, in [0, {self.model.scales.length:.12g}]", where="s", value=s)
        return np.asarray((nodal @ matrix(inside.ravel()).T).reshape(len(nodal), *where.shape))

    def to_dataset(self) -> xarray.Dataset:
        """Return frequencies, damping, shapes and matrices as labelled arrays."""
        import xarray

        free = self.model.specimen is None
        x, y = self.displacement(self.s)

        def variable(dims: str, unit: str, words: str, value: Any) -> tuple[tuple[str, ...], Any, dict[str, str]]:
            return tuple(dims.split()), value, {"units": "1" if free else unit, "long_name": words}

        rate, mode = "1/s", "mode"
        data = {
            "frequency": variable(mode, "rad/s", "angular frequency without damping", self.frequencies),
            "frequency_error": variable(mode, "rad/s", "estimated error of the frequency", self.errors),
            "frequency_square": variable(mode, "1/s**2", "square of the angular frequency", self.squares),
            "damping_ratio": variable(mode, "1", "damping ratio", self.damping_ratios),
            "eigenvalue_real": variable("mode branch", rate, "eigenvalue, real part", self.eigenvalues.real),
            "eigenvalue_imaginary": variable("mode branch", rate, "eigenvalue, imaginary part", self.eigenvalues.imag),
            "mode_curvature": variable("mode s", "1", "curvature of the mode, normalised", self.shapes),
            "mode_angle": variable("mode s", "1", "tangent angle of the mode, normalised", self.angle(self.s)),
            "mode_x": variable("mode s", "1", "displacement of the mode along, normalised", x),
            "mode_y": variable("mode s", "1", "displacement of the mode across, normalised", y),
            "mass": variable("row column", "N*m**3*s**2", "mass matrix of nodal curvatures", self.mass),
            "damping": variable("row column", "N*m**3*s", "damping matrix of nodal curvatures", self.damping),
            "stiffness": variable("row column", "N*m**3", "stiffness matrix of nodal curvatures", self.stiffness),
            "curvature": variable("s", "1/m", "curvature at rest", self.mu * self.model.scales.curvature),
        }
        weight = self.model.grid.w * self.model.scales.length
        coordinates = {
            "mode": np.arange(1, self.frequencies.size + 1),
            "branch": ["first", "second"],
            "s": variable("s", "m", "arc length from the clamp", self.s),
            "s_weight": variable("s", "m", "quadrature weight of the node", weight),
        }
        facts = {
            "title": "modes about a shape at rest",
            "conventions": "dimensionless: lengths in L, rates in 1/T" if free else "SI",
            "unstable": self.unstable,
            "resolved": int(self.resolved),
            "stays": int(self.stays),
            "sentence": self.sentence,
        }
        return xarray.Dataset(data, coordinates, facts)

    def __str__(self) -> str:
        unit = "rad/T" if self.model.specimen is None else "rad/s"
        rows = [f"  {k + 1:2d}  {_row(self, k)}" for k in range(self.frequencies.size)]
        return "\n".join([f"Modes: angular frequency [{unit}], damping ratio", *rows, self.sentence])

    __repr__ = __str__


def _row(found: Modes, k: int) -> str:
    omega, error, first = float(found.frequencies[k]), float(found.errors[k]), float(found.eigenvalues[k, 0].real)
    if not np.isfinite(omega):
        off = f" +- {error:.1e}" if np.isinf(omega) else ""
        return f"{'grows' if first > 0.0 else 'decays'} at {abs(first):.12g}{off}"
    zeta = float(found.damping_ratios[k])
    return f"{omega:.12g} +- {error:.1e}" + ("" if np.isnan(zeta) else f"  {zeta:.6g}")


def _sentences(found: Modes) -> list[str]:
    """The facts in words, one sentence each."""
    unit = "per second" if found.model.specimen is not None else f"per {_time(found.model)}"
    fastest, out = float(found.eigenvalues.real.max()), []
    if found.unstable:
        many = "1 direction" if found.unstable == 1 else f"{found.unstable} directions"
        which = "the fastest" if found.unstable <= found.frequencies.size else "one of them"
        grows = f", {which} growing at {fastest:.6g} {unit}" if fastest > 0.0 else ""
        out.append(f"Unstable in {many} as long as the natural curvature is held{grows}.")
    else:
        out.append("Stable as long as the natural curvature is held.")
    first = float(found.frequencies[0])
    if first == 0.0:
        out.append("At the edge of stability: the first frequency is 0 within its error.")
    elif np.isinf(first):
        out.append(f"Without inertia nothing swings; the slowest disturbance changes at {fastest:.6g} {unit}.")
    elif np.isfinite(first):
        words = _damping_words(float(found.damping_ratios[0]))
        out.append(f"The first mode has {first:.6g} rad {unit}{words}.")
    if not found.stays:
        out.append("But the drive exceeds the threshold: the natural curvature moves, and the shape with it.")
    if not found.resolved:
        out.append("Not all are resolved to 1e-10 of themselves: see the errors, and take more nodes.")
    return out


def _damping_words(zeta: float) -> str:
    if np.isnan(zeta) or zeta == 0.0:
        return " without damping" if zeta == 0.0 else ""
    return f" and damping ratio {zeta:.4g}" if zeta < 1.0 else f", but is damped {zeta:.4g} times critically"


def _time(model: Model) -> str:
    return "retardation time" if model.damping == 1.0 else "T"
