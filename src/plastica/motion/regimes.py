"""What becomes of rods, judged by numbers of their last states: a run is one row, a batch has many."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from plastica.physics.load import Load

if TYPE_CHECKING:
    from plastica.motion.solution import Solution

__all__ = ["SHAPES", "Rows", "rows_of", "thrust_alone"]

Array = NDArray[np.float64]
Truths = NDArray[np.bool_]

STRAIGHT: Final = 0.01
"""Largest tangent angle (rad) of a rod that counts as straight: about half a degree."""

BENT: Final = 0.1
"""Tangent angle (rad) beyond which a rod under thrust that has also grown twofold counts as buckled."""

SHAPES: Final = ("straight", "bent", "buckled")


@dataclass(frozen=True, eq=False)
class Rows:
    """Last states of rods, as far as they decide what becomes of them; D and thresholds in one unit.

    Attributes
    ----------
    pushed : ndarray of bool, shape (rows,)
        Whether a thrust alone acts, which may have a weight along the rod beside it: see `thrust_alone`.
    angle, began : ndarray, shape (rows,)
        The largest tangent angle of the last state; and of the first, or the natural curvature times L if that is more.
    moved : ndarray of bool, shape (rows,) or (rows, segments)
        Whether the natural curvature is another than at the very first start, to the last bit.
    drive, let_go, relaxed, threshold : ndarray, shape (rows,) or (rows, segments)
        D of the last state; D just after the rod is let go, and once it has relaxed onto its natural shape; and the
        threshold.
    """

    pushed: Truths
    angle: Array
    began: Array
    moved: Truths
    drive: Array
    let_go: Array
    relaxed: Array
    threshold: Array

    @cached_property
    def shape(self) -> NDArray[np.int8]:
        """Places in `SHAPES`."""
        buckled = self.pushed & (self.angle > BENT) & (self.angle > 2.0 * self.began)
        return np.asarray(np.where(self.angle <= STRAIGHT, 0, np.where(buckled, 2, 1)), dtype=np.int8)

    @cached_property
    def kept(self) -> Truths:
        """Which rods do not return to their first natural shape once they are let go.

        A rod whose natural curvature has not moved yet returns if it does not move on the way back either. Without load
        its drive is (mean mu - mu_nat) e^(-t/delta) - kappa'(mu_nat) while it does not yield (design, section 1.2): it
        goes from one value to the other without turning, so that both ends tell.
        """
        beyond = (np.abs(self.let_go) > self.threshold) | (np.abs(self.relaxed) > self.threshold)
        return _any(self.moved | beyond)

    @cached_property
    def yielding(self) -> Truths:
        """Which rods have a drive beyond its threshold."""
        return _any(np.abs(self.drive) > self.threshold)

    @cached_property
    def regime(self) -> NDArray[np.int8]:
        """A code for shape and set: buckled counts 1, a permanent set 2."""
        return np.asarray((self.shape == SHAPES.index("buckled")) + 2 * self.kept, dtype=np.int8)


def _any(truths: Truths) -> Truths:
    return np.asarray(truths if truths.ndim == 1 else truths.any(axis=1))


def thrust_alone(loads: Load, thrust: ArrayLike) -> Truths:
    """Tell which rods are under a thrust that pushes, without a load that bends them by itself.

    Parameters
    ----------
    loads : Load
        The loads; the direction of the weight matters, and which others there are.
    thrust : array_like, shape (rows,)
        The present thrust of each rod.

    Returns
    -------
    ndarray of bool, shape (rows,)
    """
    bending = {"transverse", "couple", *(("weight",) if loads.weight_direction[1] else ())}
    alone = bending.isdisjoint(name for name, _ in loads.sources())
    return np.asarray(alone & (np.asarray(thrust, dtype=float) > 0.0))


def rows_of(solution: Solution) -> Rows:
    """Return the one row of a motion.

    A rod with inertia and damping is taken to be let go so gently that it does not swing, one without damping so slowly
    that only its natural shape tells.
    """
    model, layout = solution.model, solution.model.layout
    first, last, end = solution.history.y[0], solution.history.y[-1], solution.history.end
    mu, natural = layout.mu(last), np.asarray(layout.natural(last))
    began, angle = (float(model.largest_angle(layout.mu(state))) for state in (first, last))
    drive, relaxed = model.drive(mu, natural), -model.laws.preference.slope(natural)
    return Rows(
        pushed=thrust_alone(model.loads, [float(model.loads.thrust(end))]),
        angle=np.array([angle]),
        began=np.array([max(began, float(np.abs(layout.natural(first)).max()))]),
        moved=_row(natural != solution.first_natural).astype(bool),
        drive=_row(drive),
        let_go=_row(drive if model.damping > 0.0 else relaxed),
        relaxed=_row(relaxed),
        threshold=_row(np.broadcast_to(model.threshold(natural), natural.shape)),
    )


def _row(values: ArrayLike) -> Array:
    """One number, or one for each segment, as a row."""
    made = np.asarray(values, dtype=float)
    return made.reshape(1) if made.ndim == 0 else made[None, :]
