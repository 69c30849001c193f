"""One equilibrium of the strut: its shape, its natural curvature, and whether the material lets it stay."""

from __future__ import annotations

from dataclasses import dataclass, field
from fractions import Fraction
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from plastica.equilibria.elastica import Ends, Profile, drive, ends, liapunov, profile
from plastica.equilibria.oscillation import unstable_count
from plastica.errors import ArgumentError
from plastica.material.material import Laws, Material
from plastica.physics.amounts import plain
from plastica.physics.laws import laws_of
from plastica.physics.scales import Scales, Specimen, unit_of

if TYPE_CHECKING:
    import xarray

__all__ = ["Equilibrium", "equilibrium", "frozen_equilibrium"]

Array = NDArray[np.float64]

PLACES = 101
"""Equally spaced places of the dataset; the closed form is exact at each."""


@dataclass(frozen=True)
class Equilibrium:
    """A solution of phi'' + gamma sin phi = 0, phi(0) = 0, with natural curvature phi'(1): the end bears no couple.

    All of its numbers are dimensionless (curvatures times L, thrust and drive in EI/L^2 and EI, energy in EI/L); with
    a specimen, `to_dataset` is in SI.

    Attributes
    ----------
    gamma : float
        Thrust.
    alpha : float
        Curvature at the clamp phi'(0), which names the equilibrium.
    material : Material or None
        Its laws; None for an equilibrium at frozen natural curvature, which asks for none.
    specimen : Specimen or None
        What the material is made into.
    depth : float or None
        Where alpha alone cannot tell how near the separatrix is (`equilibria_at` above gamma = 50): |alpha| is
        2 gamma^(1/2) tanh(depth), or 2 gamma^(1/2) / tanh(-depth) where it is negative (rotating); of alpha the sign
        counts then. None elsewhere.
    multiplicity : int
        2 where this stands for two equilibria at a fold that doubles cannot part, or for none; 3 where three meet.
    regime : str
        "straight" (alpha = 0), "librating" (alpha^2 < 4 gamma: the curvature changes sign on a long enough rod),
        "separatrix", or "rotating" (alpha^2 > 4 gamma: it never does).
    mu_nat : float
        Natural curvature phi'(1).
    drive : float or None
        Driving force on the natural curvature, phi(1) - phi'(1) - kappa'(phi'(1)); None without a material.
    threshold : float or None
        Theta(phi'(1)); None without a material.
    admissible : bool or None
        Whether |drive| <= threshold, so that the natural curvature stays; None without a material.
    tip : tuple of float
        Place (x, y) of the free end.
    liapunov : float
        1/2 int (phi' - mu_nat)^2 + kappa(mu_nat) + gamma int cos phi; without kappa where there is no material.

    See Also
    --------
    equilibrium : makes one for a material.
    frozen_equilibrium : makes one for a natural curvature that does not move.
    """

    gamma: float
    alpha: float
    material: Material | None = None
    specimen: Specimen | None = None
    depth: float | None = None
    multiplicity: int = 1
    regime: str = field(init=False)
    mu_nat: float = field(init=False)
    drive: float | None = field(init=False)
    threshold: float | None = field(init=False)
    admissible: bool | None = field(init=False)
    tip: tuple[float, float] = field(init=False)
    liapunov: float = field(init=False)

    def __post_init__(self) -> None:
        gamma, alpha = _number(self.gamma, "gamma"), _number(self.alpha, "alpha")
        end, laws = ends(gamma, alpha, self.depth), self.laws
        mu_nat = float(end.mu_nat)
        excess = None if laws is None else float(drive(end, laws))
        threshold = None if laws is None else float(laws.threshold.value_at(mu_nat))
        values = {
            "gamma": gamma,
            "alpha": alpha,
            "regime": _regime(gamma, alpha, self.depth),
            "mu_nat": mu_nat,
            "drive": excess,
            "threshold": threshold,
            "admissible": None if excess is None or threshold is None else _stays(excess, threshold),
            "tip": (float(end.x), float(end.y)),
            "liapunov": float(liapunov(end, gamma, alpha, laws)),
        }
        for name, value in values.items():
            object.__setattr__(self, name, value)

    @cached_property
    def laws(self) -> Laws | None:
        """The dimensionless laws; None without a material."""
        if self.material is None:
            return None
        if not isinstance(self.material, Material):
            raise ArgumentError("must be a pl.Material", where="material", value=self.material)
        if self.specimen is not None and not isinstance(self.specimen, Specimen):
            raise ArgumentError("must be a pl.Specimen or None", where="specimen", value=self.specimen)
        return laws_of(self.material, self.specimen)

    @cached_property
    def ends(self) -> Ends:
        """Everything at the free end."""
        return ends(self.gamma, self.alpha, self.depth)

    @property
    def unstable(self) -> int:
        """Number of unstable directions at frozen natural curvature; -1 too near a fold to tell."""
        return int(unstable_count(self.gamma, self.alpha, self.ends, self.depth))

    @property
    def theta0_end(self) -> tuple[float, float]:
        """Derivatives of phi(1) and of the natural curvature in alpha; the second vanishes at a fold."""
        return float(self.ends.theta0), float(self.ends.theta0_slope)

    def profile(self, s: ArrayLike) -> Profile:
        """Return tangent angle, curvature, kernel and centre line at dimensionless arc lengths s in [0, 1]."""
        return profile(self.gamma, self.alpha, s, self.depth)

    def phi(self, s: ArrayLike) -> Any:
        """Return the tangent angle at arc lengths s in [0, 1]; a number for a number."""
        return _as_given(self.profile(s).phi)

    def curvature(self, s: ArrayLike) -> Any:
        """Return the curvature phi' at arc lengths s in [0, 1]; a number for a number."""
        return _as_given(self.profile(s).slope)

    def theta0(self, s: ArrayLike) -> Any:
        """Return the derivative of phi in alpha at arc lengths s in [0, 1]; a number for a number."""
        return _as_given(self.profile(s).theta0)

    def theta0_slope(self, s: ArrayLike) -> Any:
        """Return the derivative of phi' in alpha at arc lengths s in [0, 1]; a number for a number."""
        return _as_given(self.profile(s).theta0_slope)

    def centre_line(self, s: ArrayLike) -> tuple[Any, Any]:
        """Return the places (x, y) at arc lengths s in [0, 1]; numbers for a number."""
        along = self.profile(s)
        return _as_given(along.x), _as_given(along.y)

    def to_dataset(self) -> xarray.Dataset:
        """Return shape and numbers as labelled arrays: in SI with a specimen, else dimensionless."""
        import xarray

        scales = Scales.unit() if self.specimen is None else self.specimen.scales
        data: dict[str, Any] = {}
        for name, (dims, kind, words, value) in self._quantities().items():
            label = {"units": unit_of(kind, self.specimen is None), "long_name": words}
            data[name] = (dims, scales.to_si(kind, value), label)
        facts = {
            "title": "equilibrium of a strut",
            "conventions": "SI"
            if self.specimen is not None
            else "dimensionless: lengths in L, forces in EI/L^2, energies in EI/L",
            "gamma": self.gamma,
            "alpha": self.alpha,
            "regime": self.regime,
            "sentence": str(self),
        }
        return xarray.Dataset(data, attrs=facts).set_coords("s")

    def _quantities(self) -> dict[str, tuple[tuple[str, ...], str, str, Any]]:
        """Name -> (dimensions, kind of quantity, words, dimensionless value)."""
        s = np.linspace(0.0, 1.0, PLACES)
        along, natural = self.profile(s), profile(0.0, self.mu_nat, s)
        field_, number = ("s",), ()
        out: dict[str, tuple[tuple[str, ...], str, str, Any]] = {
            "s": (field_, "length", "arc length from the clamp", s),
            "curvature": (field_, "curvature", "curvature of the centre line", along.slope),
            "angle": (field_, "angle", "tangent angle of the centre line", along.phi),
            "x": (field_, "length", "centre line, along the clamp's tangent", along.x),
            "y": (field_, "length", "centre line, across the clamp's tangent", along.y),
            "couple": (field_, "couple", "contact couple", along.slope - self.mu_nat),
            "natural_x": (field_, "length", "natural configuration, along the clamp's tangent", natural.x),
            "natural_y": (field_, "length", "natural configuration, across the clamp's tangent", natural.y),
            "thrust": (number, "force", "thrust at the free end", self.gamma),
            "clamp_curvature": (number, "curvature", "curvature at the clamp", self.alpha),
            "natural_curvature": (number, "curvature", "natural curvature", self.mu_nat),
            "tip_x": (number, "length", "free end, along the clamp's tangent", self.tip[0]),
            "tip_y": (number, "length", "free end, across the clamp's tangent", self.tip[1]),
            "tip_angle": (number, "angle", "tangent angle at the free end", float(along.phi[-1])),
            "liapunov": (
                number,
                "energy",
                "Liapunov function: stored energy plus potential of the loads",
                self.liapunov,
            ),
        }
        if self.drive is not None:
            out["drive"] = (number, "drive", "driving force on the natural curvature", self.drive)
            out["threshold"] = (number, "drive", "threshold that the drive must exceed", self.threshold)
        return out

    def __str__(self) -> str:
        shape = (
            f"{self.regime} equilibrium at gamma = {self.gamma:.6g}: clamp curvature {self.alpha:.6g}, natural "
            f"curvature {self.mu_nat:.6g}, free end at ({self.tip[0]:.4g}, {self.tip[1]:.4g}) L"
        )
        if self.drive is None or self.threshold is None:
            return shape[0].upper() + shape[1:] + "."
        relation, verdict = ("<=", "it stays") if self.admissible else (">", "its natural curvature moves")
        judged = f"|drive| = {abs(self.drive):.4g} {relation} threshold {self.threshold:.4g}, so {verdict}."
        return f"{shape[0].upper()}{shape[1:]}; {judged}"


def equilibrium(material: Material, gamma: float, alpha: float, *, specimen: Specimen | None = None) -> Equilibrium:
    """Return the equilibrium with clamp curvature alpha of a strut under thrust gamma.

    phi'' + gamma sin phi = 0, phi(0) = 0, phi'(0) = alpha, and the natural curvature is phi'(1) (design, claim 5).
    It is one of the whole model, and stays, where |drive| <= threshold: `admissible`.

    Parameters
    ----------
    material : Material
        The laws; only preference energy and threshold enter.
    gamma : float
        Thrust, in [0, 1e5], dimensionless: beta L^2 / EI.
    alpha : float
        Curvature at the clamp, |alpha| <= 1e6, dimensionless: times L.
    specimen : Specimen, optional
        What the material is made into, where its parameters carry units.

    Returns
    -------
    Equilibrium

    Raises
    ------
    ArgumentError
        Where an argument is of the wrong kind, not finite or outside its range, or parameters carry units and there
        is no specimen.

    Examples
    --------
    >>> import plastica as pl
    >>> material = pl.Material("m**2/2", "pos(x)**2", "0.1")
    >>> found = equilibrium(material, gamma=3.0, alpha=1.2)
    >>> print(f"{found.mu_nat:.6f} {found.admissible}")
    -0.124374 False
    """
    if not isinstance(material, Material):
        raise ArgumentError("must be a pl.Material", where="material", value=material)
    return Equilibrium(gamma, alpha, material, specimen)


def frozen_equilibrium(
    gamma: float, alpha: float, depth: float | None = None, multiplicity: int = 1
) -> Equilibrium:
    """Return an equilibrium at frozen natural curvature: the elastic rod's, which no material judges.

    Parameters
    ----------
    gamma, alpha : float
        Thrust and clamp curvature, as for `equilibrium`.
    depth : float, optional
        See `Equilibrium`.
    multiplicity : int
        Likewise.

    Returns
    -------
    Equilibrium
        With `drive`, `threshold` and `admissible` None, and no preference energy in `liapunov`.

    Raises
    ------
    ArgumentError
        As for `equilibrium`.
    """
    return Equilibrium(gamma, alpha, depth=depth, multiplicity=multiplicity)


def _number(value: object, where: str) -> float:
    number = plain(value)
    if not isinstance(number, float):
        raise ArgumentError("must be a number", where=where, value=value)
    return number


def _stays(drive: float, threshold: float) -> bool:
    return abs(drive) <= threshold


def _regime(gamma: float, alpha: float, depth: float | None) -> str:
    if depth is not None and depth != 0.0:
        return "librating" if depth > 0.0 else "rotating"
    # Products of doubles as whole fractions: the regime is that of the numbers given, without rounding.
    if alpha == 0.0:
        return "straight"
    square, four = Fraction(alpha) ** 2, 4 * Fraction(gamma)
    return "separatrix" if square == four else ("librating" if square < four else "rotating")


def _as_given(values: Array) -> Any:
    return float(values) if values.ndim == 0 else values
