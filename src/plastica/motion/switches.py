"""Where within a step a drive passes its threshold: onset and arrest of yielding, those that both fall in it included.

On a step of the solver the state is a polynomial in time, or two, and the drive less the natural curvature's part is a
linear function of it. A bound on how far it can stray from its value at an end tells of nearly every step that nothing
happens inside; the others are looked at closely, at the extrema of drive minus threshold.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cache
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.polynomial import chebyshev
from numpy.typing import NDArray

from plastica.motion.history import chebyshev_points
from plastica.physics.kernel import Kernel

__all__ = ["Lookout", "first_switch"]

Array = NDArray[np.float64]
Flags = tuple[bool, ...]

DEGREE = 16
"""Of the polynomials by which drive and threshold are followed on a step; those of the solvers are of 12 at most."""

ROUNDING = 64.0 * float(np.finfo(float).eps)
"""Of drive and threshold: what an excess inside a step must be beyond to be more than noise."""

RENEWED = 20
"""Steps after which the slopes of the laws are looked up anew."""

MARGIN = 2.0
"""For the curvature of the laws, where the natural curvature moves and the bound takes them for straight."""


class Lookout:
    """Tells whether yielding may begin or stop inside a step, without looking at more than the step's coefficients.

    Parameters
    ----------
    kern : Kernel
        The equations.
    method : str
        The solver, whose dense outputs are looked at.
    """

    def __init__(self, kern: Kernel, method: str) -> None:
        self.kern, self.parts, self.one = kern, _PARTS[method], len(kern.drives.linear) == 1
        self.steps, self.functions = 0, kern.drives.linear

    def __call__(self, dense: Any, last: Array, before: Sequence[float], after: Sequence[float], moving: Flags) -> bool:
        """Return whether the excess passes 0 on a step, or may: it ends in `last`, and is `before` and `after` there.

        Where a natural curvature moves the laws are taken for straight, with slopes that are renewed now and then; the
        margin is for that.
        """
        if self.steps % RENEWED == 0:
            self.functions = self.kern.drives.straight(last, moving)
        self.steps += 1
        if self.one:
            # One segment is the rule, and plain numbers are faster than vectors of one.
            a, b, stray = before[0], after[0], sum(map(abs, self.parts(self.functions[0], dense).tolist()))
            return bool(MARGIN * stray >= min(a, b) if moving[0] else stray > -max(a, b))
        strays = np.abs(self.parts(self.functions, dense)).sum(axis=1)
        passed = np.where(moving, MARGIN * strays >= np.minimum(before, after), strays > -np.maximum(before, after))
        return bool(passed.any())


# On a step a function linear in the state is its value at an end plus the sum of what these return, each with a factor
# between -1 and 1.


def _of_lsoda(functions: Array, dense: Any) -> Array:
    parts = functions.dot(dense.yh[:, 1:])
    steps = (dense.t - dense.t_old) / dense.h
    return np.asarray(parts if steps <= 1.0 else parts * steps ** dense.p[1:])


def _of_bdf(functions: Array, dense: Any) -> Array:
    j, steps = np.arange(dense.order), (dense.t - dense.t_old) / dense.denom[0]
    return np.asarray(functions.dot(dense.D[1:].T) * np.cumprod(np.maximum(np.abs(j - steps), j) / (1.0 + j)))


def _of_radau(functions: Array, dense: Any) -> Array:
    return np.asarray(functions.dot(dense.Q))


def _of_dop853(functions: Array, dense: Any) -> Array:
    return np.asarray(functions.dot(dense.F.T))


def _of_gauss(functions: Array, dense: Any) -> Array:
    halves = (dense.first.increments, dense.second.increments)
    return np.concatenate([functions.dot(half.T) * _largest() for half in halves], axis=-1)


_PARTS: dict[str, Callable[[Array, Any], Array]] = {
    "LSODA": _of_lsoda,
    "BDF": _of_bdf,
    "Radau": _of_radau,
    "DOP853": _of_dop853,
    "Gauss": _of_gauss,
}


@cache
def _largest() -> Array:
    """Greatest modulus on [0, 1] of each Lagrange polynomial of the Gauss method's start and stages."""
    from plastica.numerics.gauss import tableau

    nodes = np.concatenate([[0.0], tableau().c])
    x = chebyshev_points(1000)
    others = [np.delete(nodes, i) for i in range(nodes.size)]
    values = [np.prod((x[:, None] - other) / (node - other), axis=1) for node, other in zip(nodes, others, strict=True)]
    return np.asarray(1.01 * np.abs(values).max(axis=1))


def first_switch(kern: Kernel, dense: Any, lower: float, upper: float, moving: Flags) -> tuple[float, Flags] | None:
    """Return the time of the first switch on a step and what moves after it; None where nothing switches.

    Parameters
    ----------
    kern : Kernel
        The equations.
    dense : callable
        The state on the step.
    lower, upper : float
        Ends of the step.
    moving : tuple of bool
        What moves at its beginning.

    Returns
    -------
    tuple or None
        The time lies on the frozen side of the switch; it is `lower` where the flags are wrong from there on.
    """
    times = _candidates(kern, dense, lower, upper)
    states = np.ascontiguousarray(dense(times).T)
    drive, barrier = kern.drives.sides(states)
    excess = np.abs(drive) - barrier
    noise = ROUNDING * (np.abs(drive) + barrier)
    # At the ends the sign decides, as it does for those who look at the ends alone.
    noise[[0, -1]] = 0.0
    excess[[0, -1]] = [kern.excess(states[0]), kern.excess(states[-1])]
    yields = excess > noise
    found = {
        j: t for j, moves in enumerate(moving) if (t := _switch(kern, dense, times, yields[:, j], moves, j)) is not None
    }
    if not found:
        return None
    first = min(found.values())
    # Segments that switch together, such as those of a straight rod let go, do so in one leg.
    together = {j for j, t in found.items() if t - first <= 4.0 * np.spacing(first)}
    return first, tuple(moves != (j in together) for j, moves in enumerate(moving))


def _candidates(kern: Kernel, dense: Any, lower: float, upper: float) -> Array:
    """Ends of a step, times spread over it, and those at which drive minus or plus threshold is extremal."""
    middle = getattr(getattr(dense, "first", None), "t", upper)
    ends = [lower, middle, upper] if lower < middle < upper else [lower, upper]
    x = chebyshev_points(DEGREE)
    found = []
    for a, b in pairwise(ends):
        times = a + (b - a) * x
        drive, barrier = kern.drives.sides(np.ascontiguousarray(dense(times).T))
        found.append(times)
        if not (np.isfinite(drive).all() and np.isfinite(barrier).all()):
            # A law overflows on the way: the times spread over the step are all there is to look at.
            continue
        fitted = chebyshev.chebfit(2.0 * x - 1.0, np.hstack([drive - barrier, drive + barrier]), DEGREE)
        found += [a + 0.5 * (b - a) * (1.0 + _turns(column)) for column in fitted.T]
    inside = np.concatenate(found)
    return np.unique(np.concatenate([[lower, upper], inside[(inside > lower) & (inside < upper)]]))


def _turns(series: Array) -> Array:
    """Zeros in (-1, 1) of the derivative of a Chebyshev series."""
    slope = chebyshev.chebder(series)
    slope = chebyshev.chebtrim(slope, 1e-13 * float(np.abs(series).max()))
    roots = chebyshev.chebroots(slope) if slope.size > 1 else np.zeros(0)
    return np.real(roots[(np.abs(np.imag(roots)) < 1e-6) & (np.abs(np.real(roots)) < 1.0)])


def _switch(
    kern: Kernel, dense: Any, times: Array, yields: NDArray[np.bool_], moving: bool, segment: int
) -> float | None:
    """Time of a segment's first switch among times at which it is known whether it yields; None if there is none."""
    start = 0
    if moving and not yields[0]:
        # It has just begun to: what comes first is that it does.
        start = int(np.argmax(yields))
        if not yields[start]:
            return float(times[0])
    elif yields[0] and not moving:
        return float(times[0])
    other = np.flatnonzero(yields[start:] != moving)
    if not other.size:
        return None
    last = start + int(other[0])
    return _located(kern, dense, float(times[last - 1]), float(times[last]), moving, segment)


def _located(kern: Kernel, dense: Any, lower: float, upper: float, moving: bool, segment: int) -> float:
    """Time at which a drive passes its threshold between two times, on the frozen side."""
    from scipy.optimize import brentq

    def excess(t: float) -> float:
        return kern.excess(dense(t))[segment]

    if (excess(lower) > 0.0) != moving:
        return lower
    if (excess(upper) > 0.0) == moving:
        return upper
    t = float(brentq(excess, lower, upper, xtol=1e-15 * (upper - lower), rtol=8.881784197001252e-16))
    # Onset must lie before the natural curvature has moved, arrest after it has stopped, to the last bit.
    direction, ulp = (1.0, np.spacing(t)) if moving else (-1.0, np.spacing(t))
    while excess(t) > 0.0 and lower < t < upper:
        t = min(max(t + direction * ulp, lower), upper)
        ulp *= 2.0
    return t
