"""The spectrum of an equilibrium: growth and decay of disturbances at frozen natural curvature."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from plastica.equilibria.eigen import eigenvalues
from plastica.equilibria.elastica import profile
from plastica.equilibria.equilibrium import Equilibrium
from plastica.equilibria.linear import (
    EPS,
    Discrete,
    Levels,
    linearisation,
    require_count,
    require_equilibrium,
    schroedinger,
)
from plastica.equilibria.oscillation import DEGENERATE, FOLD_TOLERANCE, fold_distance, unstable_count
from plastica.errors import ArgumentError
from plastica.physics.scales import Scales, unit_of

if TYPE_CHECKING:
    import xarray

__all__ = [
    "DEGENERATE",
    "Kernel",
    "Levels",
    "Spectrum",
    "fold_distance",
    "linearisation",
    "schroedinger",
    "spectrum",
    "unstable_count",
]

Array = NDArray[np.float64]

MOST_EIGENVALUES = 200


@dataclass(frozen=True)
class Kernel:
    """The kernel of the linearisation, (theta_0', theta_0'(1)), tangent to the curve of equilibria.

    Normalised so that int xi^2 + xi_nat^2 = 1, with the sign of d/d alpha. Called with places s it gives the
    curvature's part xi(s).

    Attributes
    ----------
    gamma, alpha : float
        Thrust and clamp curvature.
    natural : float
        The natural curvature's part xi_nat, 0 at a fold.
    norm : float
        The norm of (theta_0', theta_0'(1)) before it was divided by it.
    depth : float or None
        As for `Equilibrium`, where alpha alone cannot tell.
    """

    gamma: float
    alpha: float
    natural: float
    norm: float
    depth: float | None = None

    def __call__(self, s: ArrayLike) -> Array:
        """Return the curvature's part at places s in [0, 1]; shape of s."""
        return np.asarray(profile(self.gamma, self.alpha, places(s), self.depth).theta0_slope / self.norm)


@dataclass(frozen=True, eq=False)
class Spectrum:
    """Eigenvalues of K - 1 at an equilibrium, as returned by `spectrum`.

    Attributes
    ----------
    equilibrium : Equilibrium
        Where the equations were linearised.
    eigenvalues : ndarray, shape (count,)
        The largest eigenvalues of K - 1, in units of 1/T, descending. All lie above -1 if gamma > 0.
    errors : ndarray, shape (count,)
        Estimated error of each: the difference of two grids plus what rounding can do.
    lowest, lowest_errors : ndarray
        The most negative eigenvalues, ascending, all below -1; as many as were asked for, or as there are above
        rounding. There are none where |phi| <= pi/2 all along the rod.
    unstable : int
        How many eigenvalues are positive: by the oscillation count, which computes none of them, but where the
        multiplicity is 2 by the eigenvalues, the one that is zero not among them.
    zero_multiplicity : int
        Algebraic multiplicity of the eigenvalue 0 of the full system: 1, or 2 (one Jordan block) where
        |theta_0'(1)| <= 1e-10 (theta_0'(1)^2 + gamma theta_0(1)^2)^(1/2), at folds and for the straight rod at
        gamma = ((k + 1/2) pi)^2.
    degenerate : bool
        Whether K - 1 itself has an eigenvalue that is 0 within its error, or the multiplicity is 2.
    agree : bool
        Whether eigenvalues and oscillation count give the same number of unstable directions, as far as their errors
        let them.
    resolved : bool
        Whether the two grids agree to rounding. If not, the rod winds up more often than the largest grid can follow
        and `errors` may be too small.
    kernel : Kernel
        The eigenvector of the eigenvalue 0 of the full system, (theta_0', theta_0'(1)).
    discrete : Discrete
        The finer of the two grids.
    vectors : ndarray
        Modes on it, those of `eigenvalues` and then those of `lowest`, in columns.
    """

    equilibrium: Equilibrium
    eigenvalues: Array
    errors: Array
    lowest: Array
    lowest_errors: Array
    unstable: int
    zero_multiplicity: int
    degenerate: bool
    agree: bool
    resolved: bool
    kernel: Kernel
    discrete: Discrete
    vectors: Array

    @property
    def gap(self) -> float:
        """Exponential rate -max(K - 1), in 1/T, at which the slowest disturbance decays at frozen natural curvature.

        Negative where the equilibrium is unstable, whose disturbances grow at that rate; 0 where the largest
        eigenvalue is the one that cannot be told from 0: decay is algebraic there, or none.
        """
        return 0.0 if self.degenerate and self.unstable == 0 else -float(self.eigenvalues[0])

    @property
    def unresolved(self) -> tuple[int, ...]:
        """Indices k for which the errors of eigenvalues k and k + 1 overlap.

        All eigenvalues other than -1 are simple, so these two are different; their distance, exponentially small by
        tunnelling between two stretches of the rod, is beyond double precision. Their modes may be mixed.
        """
        return self._overlaps(self.eigenvalues, self.errors)

    @property
    def unresolved_lowest(self) -> tuple[int, ...]:
        """Indices k for which the errors of entries k and k + 1 of `lowest` overlap, as for `unresolved`."""
        return self._overlaps(self.lowest, self.lowest_errors)

    def _overlaps(self, values: Array, errors: Array) -> tuple[int, ...]:
        close = np.abs(np.diff(values)) <= errors[:-1] + errors[1:]
        return tuple(int(k) for k in np.flatnonzero(close)) if self.equilibrium.gamma > 0.0 else ()

    @property
    def bounds(self) -> tuple[float, float]:
        """Where all eigenvalues must lie, (-1 - 4 gamma/pi^2, -1 + 4 gamma/pi^2); they accumulate at -1 only."""
        radius = 4.0 * self.equilibrium.gamma / np.pi**2
        return -1.0 - radius, -1.0 + radius

    def modes(self, s: ArrayLike) -> Array:
        """Return the curvatures xi_k of the modes of `eigenvalues`, with int xi_k^2 = 1 and xi_k(0) > 0.

        Parameters
        ----------
        s : array_like
            Places in [0, 1], of any shape.

        Returns
        -------
        ndarray, shape (count, ...)
        """
        return self._at(self.vectors[:, : self.eigenvalues.size], self.discrete.grid.interpolation, s)

    def lowest_modes(self, s: ArrayLike) -> Array:
        """Return the curvatures of the modes of `lowest`, as `modes` does."""
        return self._at(self.vectors[:, self.eigenvalues.size :], self.discrete.grid.interpolation, s)

    def mode_angles(self, s: ArrayLike) -> Array:
        """Return the angles psi_k(s) = int_0^s xi_k of the modes of `eigenvalues`, as `modes` does."""
        return self._at(self.vectors[:, : self.eigenvalues.size], self.discrete.grid.integration, s)

    def _at(self, vectors: Array, matrix: object, s: ArrayLike) -> Array:
        where = places(s)
        nodal = vectors / np.sqrt(self.discrete.grid.w)[:, None]
        values = matrix(where.ravel()) @ nodal  # type: ignore[operator]
        return np.asarray(values.T.reshape(nodal.shape[1], *where.shape))

    @cached_property
    def sentence(self) -> str:
        """What the spectrum says, in words."""
        return " ".join(_sentences(self))

    def to_dataset(self) -> xarray.Dataset:
        """Return eigenvalues, errors, modes and kernel as labelled arrays; rates and places in SI with a specimen.

        Modes and kernel keep their norms, over s in [0, 1].
        """
        import xarray

        s, dimensionless = self.discrete.grid.s, self.equilibrium.specimen is None
        scales = Scales.unit() if self.equilibrium.specimen is None else self.equilibrium.specimen.scales

        def variable(dims: str, kind: str, words: str, value: Any) -> tuple[tuple[str, ...], Any, dict[str, str]]:
            label = {"units": unit_of(kind, dimensionless), "long_name": words}
            return tuple(dims.split()), scales.to_si(kind, value), label

        data = {
            "eigenvalue": variable("mode", "rate", "eigenvalue of K - 1", self.eigenvalues),
            "error": variable("mode", "rate", "estimated error of the eigenvalue", self.errors),
            "mode_curvature": variable("mode s", "ratio", "curvature of the mode, normalised", self.modes(s)),
            "mode_angle": variable("mode s", "ratio", "tangent angle of the mode, normalised", self.mode_angles(s)),
            "lowest": variable("lowest_mode", "rate", "most negative eigenvalue of K - 1", self.lowest),
            "lowest_error": variable("lowest_mode", "rate", "estimated error of the eigenvalue", self.lowest_errors),
            "kernel_curvature": variable("s", "ratio", "curvature of the kernel, normalised", self.kernel(s)),
            "kernel_natural": variable("", "ratio", "natural curvature of the kernel", self.kernel.natural),
            "gap": variable("", "rate", "exponential rate of the slowest disturbance", self.gap),
        }
        coordinates = {
            "mode": np.arange(self.eigenvalues.size),
            "lowest_mode": np.arange(self.lowest.size),
            "s": variable("s", "length", "arc length from the clamp", s),
            "s_weight": variable("s", "length", "quadrature weight of the node", self.discrete.grid.w),
        }
        facts = {
            "title": "spectrum of an equilibrium",
            "conventions": "dimensionless: lengths in L, rates in 1/T" if dimensionless else "SI",
            "gamma": self.equilibrium.gamma,
            "alpha": self.equilibrium.alpha,
            "unstable": self.unstable,
            "zero_multiplicity": self.zero_multiplicity,
            "degenerate": int(self.degenerate),
            "sentence": self.sentence,
        }
        return xarray.Dataset(data, coordinates, facts)

    def __str__(self) -> str:
        where = f"gamma = {self.equilibrium.gamma:.6g}, alpha = {self.equilibrium.alpha:.6g}"
        values = zip(self.eigenvalues, self.errors, strict=True)
        rows = [f"  {value:+.15f}  +- {error:.1e}" for value, error in values]
        if self.lowest.size:
            rows.append("  ...")
            pairs = zip(self.lowest[::-1], self.lowest_errors[::-1], strict=True)
            rows += [f"  {value:+.15f}  +- {error:.1e}" for value, error in pairs]
        return "\n".join([f"Spectrum of K - 1 at {where}", *rows, self.sentence])

    __repr__ = __str__


def spectrum(equilibrium: Equilibrium, count: int = 6, *, lowest: int = 0) -> Spectrum:
    """Compute eigenvalues of the linearisation at an equilibrium, for natural curvature held fixed.

    K xi (s) = gamma int_s^1 cos(phi) int_0^zeta xi, of which the linearisation is (xi, xi_nat) -> (xi_nat - xi +
    K xi, 0) (section 3 of the paper): its spectrum is that of K - 1 and 0. K is symmetric and compact, with
    eigenvalues of both signs where cos phi has both: those of K - 1 are real, simple, within 4 gamma/pi^2 of -1, and
    accumulate at -1 only.

    On Gauss nodes K becomes gamma B diag(cos phi) A, which is symmetric in the quadrature's inner product; its
    eigenvalues converge faster than any power of the number of nodes, those of the Nystroem method on the kernel of K
    like its square only. Two grids, one twice as fine, are compared until they agree to rounding.

    Parameters
    ----------
    equilibrium : Equilibrium
        Where; its natural curvature need not be admissible.
    count : int
        How many of the largest eigenvalues, at most 200.
    lowest : int
        How many of the most negative ones, at most 200.

    Returns
    -------
    Spectrum

    Raises
    ------
    ArgumentError
        Where an argument is of the wrong kind or out of range.

    Notes
    -----
    Limits: errors are absolute, of the order of eps times the largest |eigenvalue| of K, so that eigenvalues close to
    -1 keep few digits of their distance from it. Pairs closer than that (`Spectrum.unresolved`) look alike: at
    gamma = 100, alpha = 15 two of the lowest agree to 3e-15. Near the separatrix at large thrust the last bits of
    gamma and alpha matter; `errors` allows for it.

    Checked by test_spectrum.

    Examples
    --------
    >>> import plastica as pl
    >>> material = pl.catalogue.material("one-shape")
    >>> spectrum = pl.spectrum(pl.equilibrium(material, gamma=3.0, alpha=0.0))
    >>> spectrum.unstable
    1
    """
    require_equilibrium(equilibrium)
    require_count(count, MOST_EIGENVALUES)
    require_count(lowest, MOST_EIGENVALUES, "lowest", 0)
    found = eigenvalues(equilibrium.gamma, equilibrium.alpha, int(count), int(lowest), equilibrium.depth)
    kernel = _kernel(found.discrete, equilibrium)
    end = equilibrium.ends
    fold = bool(fold_distance(equilibrium.gamma, end.theta0, end.theta0_slope) <= FOLD_TOLERANCE)
    rho, errors = found.rho, found.errors
    near_zero = np.abs(rho - 1.0) <= errors
    if fold:
        near_zero |= np.abs(rho - 1.0) == np.abs(rho - 1.0).min()
    positive = int(np.count_nonzero((rho > 1.0) & ~near_zero))
    counted = equilibrium.unstable
    largest, smallest = slice(None, count), found.below
    return Spectrum(
        equilibrium=equilibrium,
        eigenvalues=rho[largest] - 1.0,
        errors=errors[largest] + EPS * np.abs(rho[largest] - 1.0),
        lowest=rho[smallest] - 1.0,
        lowest_errors=errors[smallest] + EPS * np.abs(rho[smallest] - 1.0),
        unstable=positive if fold else counted,
        zero_multiplicity=2 if fold else 1,
        degenerate=bool(near_zero.any()),
        agree=fold or positive <= counted <= positive + int(np.count_nonzero(near_zero)),
        resolved=found.resolved,
        kernel=kernel,
        discrete=found.discrete,
        vectors=np.hstack([found.vectors[:, largest], found.vectors[:, smallest]]),
    )


def _kernel(discrete: Discrete, equilibrium: Equilibrium) -> Kernel:
    """(theta_0', theta_0'(1)), its norm by the quadrature of the grid."""
    slope = discrete.profile.theta0_slope
    natural = float(equilibrium.ends.theta0_slope)
    size = max(float(np.abs(slope).max()), abs(natural))
    norm = size * float(np.sqrt(discrete.grid.w @ (slope / size) ** 2 + (natural / size) ** 2))
    return Kernel(equilibrium.gamma, equilibrium.alpha, natural / norm, norm, equilibrium.depth)


def _sentences(found: Spectrum) -> list[str]:
    """The facts of a spectrum in words, one sentence each."""
    rate = abs(float(found.eigenvalues[0]))
    out = []
    if found.unstable:
        many = "1 direction" if found.unstable == 1 else f"{found.unstable} directions, the fastest"
        out.append(f"Unstable at frozen natural curvature: {many} growing at {rate:.6g} per retardation time.")
    elif not found.degenerate:
        out.append(f"Stable at frozen natural curvature: disturbances decay at {rate:.6g} per retardation time.")
    if found.zero_multiplicity == 2:
        out.append("Degenerate: 0 is an eigenvalue of multiplicity 2 with one eigenvector (a fold or a bifurcation).")
    elif found.degenerate:
        out.append("Degenerate: an eigenvalue of K - 1 cannot be told from 0 in double precision.")
    for name, pairs in (("Eigenvalues", found.unresolved), ("Lowest eigenvalues", found.unresolved_lowest)):
        out += [f"{name} {k} and {k + 1} agree to their errors: they differ, unseen by doubles." for k in pairs]
    if not found.resolved:
        out.append("Not resolved: the rod winds up more often than the largest grid can follow.")
    if not found.agree:
        out.append("The oscillation count does not confirm the number of positive eigenvalues: look at the errors.")
    out.append("The rest accumulates at -1.")
    return out


def places(s: ArrayLike) -> Array:
    """Return places on the rod as an array, or say what is wrong with them."""
    try:
        where = np.asarray(s, dtype=float)
    except (TypeError, ValueError):
        raise ArgumentError("must be numbers in [0, 1]", where="s", value=s) from None
    if not np.all((where >= 0.0) & (where <= 1.0)):
        raise ArgumentError("must lie on the rod, in [0, 1] (dimensionless)", where="s", value=s)
    return where
