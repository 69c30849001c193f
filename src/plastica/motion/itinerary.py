"""Where a run must stop on its way through the loads, and how long a step may be in between."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from plastica.motion.integrate import Stretch
from plastica.physics.model import Model
from plastica.physics.program import Program

__all__ = ["itinerary", "landing_points", "short_changes"]


def itinerary(strut: Model, start: float, end: float) -> tuple[Stretch, ...]:
    """Return the stretches of [start, end] between landing points, each with the longest step that overlooks nothing.

    Parameters
    ----------
    strut : Strut or Rod
        The rod and its loads.
    start, end : float
        Dimensionless times.

    Returns
    -------
    tuple of Stretch
    """
    points = (start, *(t for t in landing_points(strut, end) if start < t < end), end)
    paces = [program.paces(points) for _, program in strut.loads.items() if not program.constant]
    longest = [min(each) for each in zip(*paces, strict=True)] if paces else [np.inf] * (len(points) - 1)
    return tuple(Stretch(a, b, step) for (a, b), step in zip(pairwise(points), longest, strict=True))


def landing_points(strut: Model, end: float) -> tuple[float, ...]:
    """Return the times at which a leg must end: every jump of a load, slope knots that matter, ends of bursts.

    A change of slope matters where what it makes of its load within one retardation time, or before the next knot if
    that is sooner, is more than 1e-3 of that load's largest value: the rows of a finely sampled table pass, the corners
    of a ramp do not. A burst is a stretch in which a load changes much faster than beside it; a step that lands on its
    ends cannot pass over it.
    """
    found: set[float] = set()
    for _, program in strut.loads.items():
        if not program.constant:
            found |= {*_corners(program, end), *program.bursts(end)}
    merged: list[float] = []
    for t in sorted(t for t in found if 0.0 < t <= end):
        # Loads in step with one another name the same time with different rounding.
        if not merged or t - merged[-1] > 64.0 * np.spacing(t):
            merged.append(t)
    return tuple(merged)


def _corners(program: Program, end: float) -> tuple[float, ...]:
    knots = program.knots(end)
    if not knots:
        return ()
    times = np.array([knot.t for knot in knots])
    gap = np.minimum(np.diff(times, prepend=0.0), np.diff(times, append=max(end, float(times[-1]))))
    largest = max(map(abs, program.extreme(end)))
    return tuple(
        knot.t
        for knot, near in zip(knots, gap, strict=True)
        if knot.kind == "jump" or abs(knot.size) * min(1.0, near) > 1e-3 * largest
    )


def short_changes(strut: Model, start: float, end: float) -> tuple[str, ...]:
    """Return a sentence for each load whose changes cannot all be shown to be met on [start, end].

    Parameters
    ----------
    strut : Strut or Rod
        The rod and its loads.
    start, end : float
        Dimensionless times.

    Returns
    -------
    tuple of str
        With times in the user's units; empty where the run overlooks nothing.
    """
    told, scale = [], strut.scales.time
    for name, program in strut.loads.items():
        spans = () if program.constant else [each for each in program.hidden(end) if each[1] > start]
        if spans:
            # Where there are many, they are told as one.
            first, last = (f"{t * scale:.6g}" for t in (max(spans[0][0], start), spans[-1][1]))
            told.append(
                f"{name}: a change too short to be followed may be overlooked between t = {first} and {last} "
                f"{strut.time_unit}, where the text changes too fast to be bounded; give the load as a table there"
            )
    return tuple(told)
