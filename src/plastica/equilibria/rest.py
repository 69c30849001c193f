"""The static shape of a rod whose natural curvature is frozen, under any dead loads, without stepping in time."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from plastica.equilibria.following import follow
from plastica.equilibria.statics import CONVERGED, balanced, unstable_directions
from plastica.errors import ArgumentError
from plastica.numerics.grid import AUTO_NODES, LARGEST_SIZE, Grid
from plastica.physics.initial import (
    Curvature,
    NaturalCurvature,
    initial_natural_curvature,
    initial_shape,
    nodal_values,
)
from plastica.physics.model import Model
from plastica.physics.narrow import met, missed
from plastica.physics.resolution import too_coarse, turns_unseen
from plastica.physics.status import Status, on_grid, status

if TYPE_CHECKING:
    import xarray

__all__ = ["Rest", "rest", "settle"]

Array = NDArray[np.float64]

STATIC_NODES = (*AUTO_NODES, 192, 256)
"""The node counts that are tried where the number is open: two more than for a motion, of which a shape has one."""

FINE = 1e-10
"""Relative Legendre tail, and error of the free end in L, at which these nodes suffice."""

ALLOWED = 1e-8
"""Error of the free end, in L, that is not spoken of."""

NOT_MET = " The start is narrower than the nodes tell: its free end is off by {:.1g} L."
NOT_SHOWN = " It is not shown that the start comes to this one of the static shapes."


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
    error : float
        How far the grid puts the free end off, from the same shape on a grid twice as fine; in the user's units.
        Infinite where that grid has no such shape.
    status : Status
        "equilibrium"; or, with `ok` False, "not_found", or "not_resolved" where the error exceeds 1e-3 of the length.
    """

    model: Model
    mu: Array
    mu_nat: float | Array
    converged: bool
    residual: float
    unstable: int
    error: float
    status: Status

    @property
    def sentence(self) -> str:
        """The status in words."""
        return self.status.sentence

    @property
    def stable(self) -> bool:
        """Whether no direction is unstable at frozen natural curvature."""
        return self.unstable == 0

    @property
    def tip(self) -> tuple[float, float]:
        """Place of the free end, in the user's units."""
        x, y = _end(self.model, self.mu)
        return x * self.model.scales.length, y * self.model.scales.length

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
        return self.status.ok and bool(np.all(np.abs(self.drive) <= self.threshold))

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
            "error": self.error,
            "status": str(self.status),
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
        The rod and its loads, which must be constant; inertia and damping play no part. ``Grid(nodes="auto")`` takes
        the smallest number of nodes that resolves the shape to 1e-10.
    curvature : number, text in s, function, Shape or nodal values
        Where to start from, as in `solve`: of several static shapes, the one that the motion from here comes to.
    natural_curvature : number, or text with a unit, or a sequence of these
        The natural curvature that is held; with several segments one for all of them, or one for each.

    Returns
    -------
    Rest
        With `status.ok` False, and a sentence, where no static shape was found or the grid does not resolve it.

    Raises
    ------
    ArgumentError
        Where the data cannot be used, or the loads vary.

    Notes
    -----
    The steps are those of the implicit Euler method with a step that grows as fast as the energy and the growth rates
    allow: at first they follow the flow downhill, at the end they are Newton's. Where the start does not certainly come
    to the shape that they find, the motion itself is followed until it does; where that cannot be shown, as next to the
    border between what comes to two shapes, the status says so.

    Every shape is found again, by Newton's method, on a grid twice as fine; see docs/accuracy.md.
    """
    if not isinstance(model, Model):
        raise ArgumentError("must be a pl.Strut or a pl.Rod", where="model", value=model)
    if not model.load.is_constant:
        raise ArgumentError("must be constant for a static shape", where="load", value=model.load)
    si, auto = model.specimen is not None, model.grid.nodes == "auto"
    given = met(curvature, model.grid, model.scales, si=si) if auto else curvature
    mu_nat = initial_natural_curvature(natural_curvature, model.scales, si=si, segments=model.segments)

    def start(grid: Grid) -> tuple[Model, Array, float]:
        shape, broken = initial_shape(given, grid, model.scales, si=si)
        return model.with_grid(broken), nodal_values(shape, broken), missed(shape, broken)

    if auto:
        return _on_chosen_nodes(model, start, mu_nat)
    strut, mu, off = start(model.grid)
    return settle(strut, mu, mu_nat, off)


def settle(model: Model, mu: Array, mu_nat: float | Array, missed: float = 0.0) -> Rest:
    """Find the static shape downhill from a dimensionless state, of which the nodes have `missed` some; see `rest`."""
    shape, residual, shown = follow(model, mu, mu_nat)
    words = NOT_MET.format(missed) if missed > ALLOWED else ""
    return _finished(model, mu_nat, shape, residual, words if shown else words + NOT_SHOWN)


def _on_chosen_nodes(
    model: Model, start: Callable[[Grid], tuple[Model, Array, float]], mu_nat: float | Array
) -> Rest:
    """Find the static shape on the smallest number of nodes that resolves it."""
    grids = [model.grid.with_nodes(nodes) for nodes in STATIC_NODES]
    starts = [start(grid) for grid in grids if grid.size <= LARGEST_SIZE] or [start(grids[0])]
    tried: list[Rest] = []
    for strut, mu, off in starts:
        tried.append(settle(strut, mu, mu_nat, off))
        if off <= ALLOWED and _is_fine(tried[-1]):
            return tried[-1]
    return min(tried, key=lambda found: (not found.status.ok, found.error, -found.model.grid.size))


def _is_fine(found: Rest) -> bool:
    small = found.status.ok and found.error <= FINE * found.model.scales.length
    return small and too_coarse(found.model, found.mu[None, :], FINE) is None


def _end_error(model: Model, mu: Array, mu_nat: float | Array) -> float:
    """How far the free end is from where another grid puts it: one twice as fine, or else half as fine; in L."""
    finer = model.grid.refined()
    other = model.with_grid(
        finer if finer.size > model.grid.size else model.grid.with_nodes(max(2, model.grid.per_element // 2))
    )
    theirs, converged = balanced(other, model.curvature_between([0.0], mu[None, :], other.grid.s)[0], mu_nat)
    if not converged or turns_unseen(other.grid, theirs):
        return np.inf
    (x, y), (x2, y2) = _end(model, mu), _end(other, theirs)
    return float(np.hypot(x - x2, y - y2))


def _end(model: Model, mu: Array) -> tuple[float, float]:
    theta, w = model.angle(mu), model.grid.w
    return float(np.cos(theta) @ w), float(np.sin(theta) @ w)


def _finished(model: Model, mu_nat: float | Array, mu: Array, residual: float, words: str = "") -> Rest:
    unstable = unstable_directions(model, mu, mu_nat)
    converged = residual <= 100.0 * CONVERGED * max(1.0, float(np.abs(mu).max()))
    error = _end_error(model, mu, mu_nat) if converged else np.inf
    stays = "and stable as long as the natural curvature is held."
    if unstable:
        stays = f"but unstable in {unstable} direction{'s' if unstable > 1 else ''}."
    found = Status(True, "equilibrium", f"At rest, {stays}{words}") if converged else status("not_found", left=residual)
    told = on_grid(found, model.grid.per_element, error, ALLOWED) if converged else found
    return Rest(model, mu, mu_nat, converged, residual, unstable, error * model.scales.length, told)
