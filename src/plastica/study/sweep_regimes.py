"""What becomes of a rod, in one word, judged without following it any further: as `Solution.outcome` does."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from plastica.motion.outcome import BENT
from plastica.motion.solution import Solution
from plastica.physics.rod import Rod

__all__ = ["keeps_a_set", "regime_codes", "regime_of"]

Array = NDArray[np.float64]
Truths = NDArray[np.bool_]


def keeps_a_set(moved: ArrayLike, drive: ArrayLike, relaxed: ArrayLike, threshold: ArrayLike) -> Truths:
    """Tell which rods do not return to their first natural shape once they are let go.

    A rod whose natural curvature has not moved yet returns if it does not move on the way back either. Without load its
    drive is (mean mu - mu_nat) e^(-t) - kappa'(mu_nat) while it does not yield (design, section 1.2): it goes from D to
    -kappa'(mu_nat) without turning, so that both ends tell.

    Parameters
    ----------
    moved : array_like of bool
        Whether the natural curvature has moved.
    drive, relaxed, threshold : array_like
        D in the last state, kappa'(mu_nat), and the threshold, in one unit.

    Returns
    -------
    ndarray of bool
    """
    bound = np.asarray(threshold)
    return np.asarray(np.asarray(moved) | (np.abs(drive) > bound) | (np.abs(relaxed) > bound))


def regime_codes(pushed: ArrayLike, angle: ArrayLike, began: ArrayLike, kept: ArrayLike) -> NDArray[np.int8]:
    """Return the places in `REGIMES`: buckled counts 1, a permanent set 2.

    Parameters
    ----------
    pushed : array_like of bool
        Whether the rod is under thrust alone.
    angle, began : array_like
        The largest tangent angle in the last state; and in the first, or the natural curvature times L if that is more.
    kept : array_like of bool
        Whether it keeps a set.

    Returns
    -------
    ndarray of int
    """
    turned = np.asarray(angle)
    buckled = np.asarray(pushed) & (turned > BENT) & (turned > 2.0 * np.asarray(began))
    return np.asarray(buckled + 2 * np.asarray(kept), dtype=np.int8)


def regime_of(solution: Solution) -> int:
    """Return the regime of one motion."""
    model, layout = solution.model, solution.model.layout
    first, last, end = solution.history.y[0], solution.history.y[-1], solution.history.end
    natural, since = layout.natural(last), solution.first_natural
    relaxed, threshold = model.laws.preference.slope(natural), model.threshold(natural)
    # With inertia the rod is taken to be let go so slowly that only its natural shape tells.
    drive = relaxed if isinstance(model, Rod) else model.drive(layout.mu(last), natural)
    moved = np.any(layout.natural(solution.history.y) != since)
    kept = bool(np.any(keeps_a_set(moved, drive, relaxed, threshold)))
    alone = not {"transverse", "couple"} & {name for name, _ in model.loads.sources()}
    pushed = alone and float(model.loads.thrust(end)) > 0.0
    began, turned = (float(model.largest_angle(layout.mu(state))) for state in (first, last))
    began = max(began, float(np.abs(layout.natural(first)).max()))
    return int(regime_codes(pushed, turned, began, kept))
