"""The static shape of a rod whose natural curvature is frozen, under any dead loads, without stepping in time."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from plastica.errors import ArgumentError
from plastica.numerics.grid import Grid
from plastica.physics.initial import (
    Curvature,
    NaturalCurvature,
    initial_natural_curvature,
    initial_shape,
    nodal_values,
)
from plastica.physics.kernel import load_moment
from plastica.physics.ledger import liapunov
from plastica.physics.model import Model

if TYPE_CHECKING:
    import xarray

__all__ = ["Rest", "rest", "settle", "unstable_directions"]

Array = NDArray[np.float64]

MOST_STEPS = 500
CONVERGED = 1e-13
"""Residual, relative to the largest curvature or one, at which the rod is at rest to rounding."""

EDGE = 1e-12
"""Rate of growth that rounding can give a shape at the edge of stability."""


@dataclass(frozen=True, eq=False)
class Rest:
    """A static shape at frozen natural curvature.

    Attributes
    ----------
    model : Strut or Rod
        The rod on the grid that was used.
    mu : ndarray, shape (n,)
        Dimensionless curvature at the nodes.
    mu_nat : float, or ndarray of shape (m,) with several segments
        Dimensionless natural curvature.
    converged : bool
        Whether the equations are satisfied to rounding.
    residual : float
        Largest |M - (mu - mu_nat)| left, dimensionless.
    unstable : int
        Number of unstable directions at frozen natural curvature; 0 for a stable shape.
    sentence : str
        The same in words.
    """

    model: Model
    mu: Array
    mu_nat: float | Array
    converged: bool
    residual: float
    unstable: int
    sentence: str

    @property
    def stable(self) -> bool:
        """Whether no direction is unstable at frozen natural curvature."""
        return self.unstable == 0

    @property
    def tip(self) -> tuple[float, float]:
        """Place of the free end, in the user's units."""
        theta, w = self.model.angle(self.mu), self.model.grid.w
        length = self.model.scales.length
        return float(np.cos(theta) @ w) * length, float(np.sin(theta) @ w) * length

    @property
    def drive(self) -> float | Array:
        """Driving force on the natural curvature, in the user's units; with several segments of each, shape (m,)."""
        return _number(self.model.drive(self.mu, self.mu_nat) * self.model.scales.drive)

    @property
    def threshold(self) -> float | Array:
        """Threshold of the drive, in the user's units; with several segments of each, shape (m,)."""
        return _number(self.model.threshold(self.mu_nat) * self.model.scales.drive)

    @property
    def admissible(self) -> bool:
        """Whether every drive is within its threshold: the rod, and not only its shape, is then in equilibrium."""
        return self.converged and bool(np.all(np.abs(self.drive) <= self.threshold))

    def at(self, s: ArrayLike) -> Any:
        """Return the curvature at arc lengths s, in the user's units; a scalar gives a scalar."""
        places = np.asarray(s, dtype=float) / self.model.scales.length
        values = self.model.curvature_between([0.0], self.mu[None, :], np.ravel(places))[0]
        found = values.reshape(places.shape) * self.model.scales.curvature
        return float(found) if places.shape == () else found

    def to_dataset(self) -> xarray.Dataset:
        """Return shape and numbers as labelled arrays in the user's units."""
        import xarray

        grid, scales = self.model.grid, self.model.scales
        theta = self.model.angle(self.mu)
        fields = {
            "curvature": (self.mu * scales.curvature, "curvature of the centre line"),
            "angle": (theta, "tangent angle of the centre line"),
            "x": (grid.A @ np.cos(theta) * scales.length, "centre line, along the clamp's tangent"),
            "y": (grid.A @ np.sin(theta) * scales.length, "centre line, across the clamp's tangent"),
        }
        data = {name: ("s", values, {"long_name": words}) for name, (values, words) in fields.items()}
        attributes = {
            "natural_curvature": _number(np.asarray(self.mu_nat) * scales.curvature),
            "tip_x": self.tip[0],
            "tip_y": self.tip[1],
            "drive": self.drive,
            "threshold": self.threshold,
            "unstable": self.unstable,
            "converged": int(self.converged),
            "admissible": int(self.admissible),
        }
        return xarray.Dataset(data, coords={"s": grid.s * scales.length}, attrs=attributes)

    def __str__(self) -> str:
        return self.sentence


def _number(value: Array) -> float | Array:
    return float(value) if value.ndim == 0 else value


def rest(model: Model, curvature: Curvature = 0.0, natural_curvature: NaturalCurvature = 0.0) -> Rest:
    """Find the static shape that a rod with this natural curvature comes to from this shape.

    Solves mu = mu_nat + M(mu), M from the balance of moments, under the dead loads at time 0 and with the natural
    curvature held; any dead load is allowed, the end couple among them.

    Parameters
    ----------
    model : Strut or Rod
        The rod and its loads, which must be constant; inertia and damping play no part. ``Grid(nodes="auto")`` becomes
        48 nodes.
    curvature : number, text in s, function, Shape or nodal values
        Where to start from, as in `solve`: of several static shapes, the one downhill from here.
    natural_curvature : number, or text with a unit, or a sequence of these
        The natural curvature that is held; with several segments one for all of them, or one for each.

    Returns
    -------
    Rest
        With `converged` false, and a sentence, where no static shape was found.

    Raises
    ------
    ArgumentError
        Where the data cannot be used, or the loads vary.

    Notes
    -----
    The steps are those of the implicit Euler method with a step that grows as fast as the energy and the growth rates
    allow: at first they follow the flow downhill, at the end they are Newton's.
    """
    if not isinstance(model, Model):
        raise ArgumentError("must be a pl.Strut or a pl.Rod", where="model", value=model)
    if not model.load.is_constant:
        raise ArgumentError("must be constant for a static shape", where="load", value=model.load)
    if model.grid.nodes == "auto":
        model = model.with_grid(Grid(48, model.grid.breaks))
    si = model.specimen is not None
    shape, grid = initial_shape(curvature, model.grid, model.scales, si=si)
    strut = model if grid is model.grid else model.with_grid(grid)
    mu_nat = initial_natural_curvature(natural_curvature, model.scales, si=si, segments=model.segments)
    return settle(strut, nodal_values(shape, grid), mu_nat)


def settle(model: Model, mu: Array, mu_nat: float | Array) -> Rest:
    """Find the static shape downhill from a dimensionless state; see `rest`."""
    imbalance, stiffness = _statics(model, mu_nat)
    identity = np.eye(model.grid.size)
    step = 1.0
    residual, energy = imbalance(mu), float(liapunov(model, 0.0, mu, mu_nat))
    for _ in range(MOST_STEPS):
        scale = max(1.0, float(np.abs(mu).max()))
        if np.abs(residual).max() <= CONVERGED * scale or step < 1e-12:
            break
        jacobian = stiffness(mu)
        fastest = float(_symmetric_spectrum(jacobian, model)[-1])
        if fastest > 0.0:
            # Beyond 1/rate an implicit step throws what grows to the other side: to another shape than the nearest.
            step = min(step, 0.5 / fastest)
        tried = mu + np.linalg.solve(identity / step - jacobian, residual)
        new_residual = imbalance(tried)
        new_energy = float(liapunov(model, 0.0, tried, mu_nat))
        downhill = new_energy <= energy + 1e-14 * max(1.0, abs(energy))
        if downhill and np.isfinite(new_residual).all():
            stalled = step > 1e12 and np.abs(new_residual).max() >= np.abs(residual).max()
            mu, residual, energy, step = tried, new_residual, new_energy, min(4.0 * step, 1e15)
            if stalled:
                break
        else:
            step *= 0.125
    return _finished(model, mu, mu_nat, float(np.abs(residual).max()))


def _statics(model: Model, mu_nat: float | Array) -> tuple[Callable[[Array], Array], Callable[[Array], Array]]:
    """Functions of mu: the imbalance of moments M - (mu - mu_nat), and its derivative."""
    moment, slope = load_moment(model, 0.0, 1.0)
    A, natural = model.grid.A, model.division.spread(mu_nat)
    identity = np.eye(model.grid.size)
    return lambda mu: moment(0.0, A @ mu) - mu + natural, lambda mu: slope(0.0, A @ mu) @ A - identity


def _symmetric_spectrum(jacobian: Array, model: Model) -> Array:
    """Growth rates at frozen natural curvature, ascending: the Jacobian is symmetric in the weighted inner product."""
    root = np.sqrt(model.grid.w)
    scaled = root[:, None] * jacobian / root
    return np.asarray(np.linalg.eigvalsh(0.5 * (scaled + scaled.T)))


def unstable_directions(model: Model, mu: Array, mu_nat: float | Array) -> int:
    """Count the unstable directions of a static shape under constant loads, at frozen natural curvature.

    Inertia and damping change how fast a disturbance grows, not whether it does: the loads have a potential.

    Parameters
    ----------
    model : Strut or Rod
        The rod, its loads constant.
    mu : ndarray, shape (n,)
        Dimensionless curvature at the nodes.
    mu_nat : float, or ndarray of shape (m,) with several segments
        Dimensionless natural curvature.
    """
    _, stiffness = _statics(model, mu_nat)
    return int(np.count_nonzero(_symmetric_spectrum(stiffness(mu), model) > EDGE))


def _finished(model: Model, mu: Array, mu_nat: float | Array, residual: float) -> Rest:
    unstable = unstable_directions(model, mu, mu_nat)
    converged = residual <= 100.0 * CONVERGED * max(1.0, float(np.abs(mu).max()))
    if not converged:
        sentence = f"No static shape found: {residual:.1e} of the balance of moments is left."
    elif unstable:
        sentence = f"At rest, but unstable in {unstable} direction{'s' if unstable > 1 else ''}."
    else:
        sentence = "At rest, and stable as long as the natural curvature is held."
    return Rest(model, mu, mu_nat, converged, residual, unstable, sentence)
