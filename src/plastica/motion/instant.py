"""Times as sums of two doubles, so that what is short stays sharp however late it comes.

A double near 1e9 is 1e-7 from the next one. The integrator counts time from the start of each leg, and only its results
are put on the clock of the run: the nearest double, and beside it the remainder that this leaves.

T. J. Dekker, A floating-point technique for extending the available precision, Numer. Math. 18 (1971), section 4.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

__all__ = ["Instant", "split"]

Array = NDArray[np.float64]


class Instant(NamedTuple):
    """A time t + rest, rest being at most half the distance of t from the next double."""

    t: float
    rest: float = 0.0

    def later(self, duration: float) -> Instant:
        """Return the instant that comes so much later."""
        t, rest = split(self, np.array([duration]))
        return Instant(float(t[0]), float(rest[0]))

    def until(self, end: float) -> float:
        """Return the time from here to `end`, rounded once where both are doubles."""
        return (end - self.t) - self.rest

    def since(self, start: float) -> float:
        """Return the time from `start` to here."""
        return (self.t - start) + self.rest


def split(start: Instant, durations: Array) -> tuple[Array, Array]:
    """Return the nearest doubles to start + durations, and the remainders."""
    whole, lost = _sum(np.full_like(durations, start.t), durations)
    return _sum(whole, lost + start.rest)


def _sum(a: Array, b: Array) -> tuple[Array, Array]:
    """Sum of doubles, and exactly what rounding takes from it (Knuth's two-sum)."""
    whole = a + b
    virtual = whole - a
    return whole, (a - (whole - virtual)) + (b - virtual)
