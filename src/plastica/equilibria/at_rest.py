"""The shape at rest about which a rod is linearised, on any grid: in closed form, or by Newton's method."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Protocol, TypeGuard

import numpy as np
from numpy.typing import NDArray

from plastica.equilibria.equilibrium import Equilibrium
from plastica.equilibria.rest import Rest, rest
from plastica.equilibria.statics import balanced
from plastica.errors import ArgumentError
from plastica.numerics.grid import Grid
from plastica.physics.ledger import kinetic_energy
from plastica.physics.load import Load
from plastica.physics.model import Model

__all__ = ["AtRest", "Motion", "at_rest", "held_load"]

Array = NDArray[np.float64]

FIRST_NODES = 48
"""Of the grid on which a known shape is taken up at the least where the number of nodes is open."""

SAME_THRUST = 1e-9
"""Largest difference of the thrusts of an equilibrium and of the rod, relative to one or the thrust."""

BALANCED, NEAR_REST = 1e-9, 1e-3
"""Imbalance of moments, relative to the largest curvature or one, that a `Rest` and a motion's last state may have."""

SAME_SHAPE = 1e-2
"""How far Newton's method may go from there, in the norm of curvature: farther is another shape."""


@dataclass(frozen=True, eq=False)
class AtRest:
    """A shape at rest on a grid, dimensionless.

    Attributes
    ----------
    model : Strut or Rod
        Under constant loads, on this grid.
    mu, theta : ndarray, shape (n,)
        Curvature and tangent angle at the nodes.
    mu_nat : float, or ndarray of shape (m,) with several segments
        Natural curvature.
    exact : Equilibrium or None
        The closed form, where there is one.
    converged : bool
        Whether the moments balance to rounding on this grid.
    """

    model: Model
    mu: Array
    theta: Array
    mu_nat: float | Array
    exact: Equilibrium | None = None
    converged: bool = True

    def on(self, grid: Grid) -> AtRest:
        """Return the same shape on another grid."""
        model = self.model.with_grid(grid)
        if self.exact is not None:
            return _closed(model, self.exact)
        mu = self.model.curvature_between([0.0], self.mu[None, :], model.grid.s)[0]
        return _balanced(model, mu, self.mu_nat)

    @property
    def stays(self) -> bool:
        """Whether every drive is within its threshold, so that the natural curvature rests too."""
        drive, threshold = self.model.drive(self.mu, self.mu_nat), self.model.threshold(self.mu_nat)
        return bool(np.all(np.abs(drive) <= threshold * (1.0 + SAME_THRUST)))


class Motion(Protocol):
    """What is asked of a motion here, whose type belongs to a layer above."""

    @property
    def model(self) -> Model:
        """The model."""

    @property
    def history(self) -> Any:
        """The state as a function of time: its end, and states y."""


def held_load(load: Load, t: float) -> Load:
    """Return the loads at one time, t in their own units, held for ever."""
    now = {name: float(program(t)) for name, program in load.items()}
    return Load(**now, weight_angle=load.weight_angle, allow_tension=True)


def at_rest(model: Model, place: object) -> AtRest:
    """Find the shape at rest that a user named.

    Parameters
    ----------
    model : Strut or Rod
        The rod and its loads.
    place : None, Equilibrium, Rest or Solution
        None is the static shape that a straight rod without natural curvature comes to. Of a motion it is the last
        state, which must be next to rest; where its loads have become constant, those hold that are left.

    Returns
    -------
    AtRest
        On the model's grid; with ``Grid(nodes="auto")`` on one that resolves the shape, or on 48 nodes.

    Raises
    ------
    ArgumentError
        Where the model is none, its loads vary, or it is not at rest there.
    """
    if not isinstance(model, Model):
        raise ArgumentError("must be a pl.Rod or a pl.Strut", where="rod", value=model)
    if _is_motion(place) and not model.load.is_constant:
        model = _after_the_loads(model, place)
    if not model.load.is_constant:
        raise ArgumentError(
            "must be constant where modes are asked for",
            where="load",
            value=model.load,
            next_step="Give rod.with_load(...) with the loads at the time that matters.",
        )
    if place is None:
        return _straight(model)
    if model.grid.nodes == "auto":
        known = place.model.grid.per_element if isinstance(place, Rest) or _is_motion(place) else 0
        model = model.with_grid(model.grid.with_nodes(max(FIRST_NODES, known)))
    if isinstance(place, Equilibrium):
        return _closed(model, _same_loads(model, place))
    if isinstance(place, Rest):
        if not place.converged:
            raise ArgumentError("must be a static shape that was found", where="equilibrium", value=place)
        return _near(model, place.model, place.mu, place.mu_nat, BALANCED)
    if _is_motion(place):
        return _last(model, place)
    raise ArgumentError(
        "must be None, a pl.Equilibrium, a pl.Rest or a pl.Solution",
        where="equilibrium",
        value=place,
        next_step="Make one with pl.rest(rod, curvature, natural_curvature).",
    )


def _is_motion(place: object) -> TypeGuard[Motion]:
    """Whether this is a solution, a type that this layer does not know."""
    return hasattr(place, "history") and isinstance(getattr(place, "model", None), Model)


def _after_the_loads(model: Model, motion: Motion) -> Model:
    """The model under the loads that are left at the end of a motion, where they have become constant before."""
    settled, end = model.load.settled, float(motion.history.end) * model.scales.time
    return model if settled is None or settled > end else model.with_load(held_load(model.load, end))


def _straight(model: Model) -> AtRest:
    shape = rest(model)
    if not shape.converged:
        raise ArgumentError(
            "must be given where the straight rod comes to no static shape",
            where="equilibrium",
            next_step="Look for one with pl.rest(rod, curvature, natural_curvature).",
        )
    return AtRest(shape.model, shape.mu, shape.model.angle(shape.mu), shape.mu_nat)


def _same_loads(model: Model, place: Equilibrium) -> Equilibrium:
    others = sorted({name for name, _ in model.loads.sources()} - {"thrust"})
    if others:
        raise ArgumentError(
            "must be a thrust alone at an equilibrium in closed form",
            where="load",
            value=", ".join(others),
            next_step="For other loads give pl.rest(rod, ...).",
        )
    thrust = float(model.loads.thrust(0.0))
    if abs(place.gamma - thrust) > SAME_THRUST * max(1.0, abs(thrust)):
        raise ArgumentError(
            f"must be the thrust of the rod, {thrust:.12g}", where="equilibrium.gamma", value=place.gamma
        )
    return place


def _closed(model: Model, place: Equilibrium) -> AtRest:
    along = place.profile(model.grid.s)
    natural: float | Array = place.mu_nat if model.segments == 1 else np.full(model.segments, place.mu_nat)
    return AtRest(model, np.asarray(along.slope), np.asarray(along.phi), natural, place)


def _near(model: Model, source: Model, mu: Array, mu_nat: float | Array, reach: float) -> AtRest:
    """The shape at rest next to a state on the grid of another model, within `reach` of it."""
    if source.division.breaks != model.division.breaks:
        raise ArgumentError(
            "must have the natural segments of the rod",
            where="equilibrium",
            value=source.segments,
            next_step="Make it with this rod.",
        )
    there = model.with_grid(source.grid)
    w, size = source.grid.w, max(1.0, float(np.abs(mu).max()))
    off = float(np.sqrt(w @ (there.couple(0.0, mu) - mu + there.division.spread(mu_nat)) ** 2))
    start = source.curvature_between([0.0], mu[None, :], model.grid.s)[0]
    found = _balanced(model, start, mu_nat)
    moved = float(np.sqrt(model.grid.w @ (found.mu - start) ** 2))
    if off > reach * size or not found.converged or moved > SAME_SHAPE * size:
        raise ArgumentError(
            "must be a shape in which this rod is at rest under its loads",
            where="equilibrium",
            next_step="Make it with pl.rest(rod, curvature, natural_curvature).",
        )
    return found


def _last(model: Model, motion: Motion) -> AtRest:
    source: Model = motion.model
    y, layout = np.asarray(motion.history.y[-1], dtype=float), source.layout
    mu, mu_t = layout.mu(y), layout.mu_t(y)
    swinging = float(kinetic_energy(source, mu, mu_t))
    if swinging > NEAR_REST**2 * max(1.0, float(source.grid.w @ mu**2)):
        raise ArgumentError(
            "must have come to rest, but still moves",
            where="equilibrium",
            next_step="Give pl.rest(rod, curvature, natural_curvature), the shape about which it swings.",
        )
    natural = layout.natural(y)
    held = source.with_load(held_load(source.load, float(motion.history.end) * source.scales.time))
    return _near(model, held, mu, float(natural) if natural.ndim == 0 else natural, NEAR_REST)


def _balanced(model: Model, mu: Array, mu_nat: float | Array) -> AtRest:
    """The next static shape, be it stable or not."""
    found, converged = balanced(model, mu, mu_nat)
    return AtRest(model, found, model.grid.A @ found, mu_nat, None, converged)
