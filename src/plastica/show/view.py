"""A solution made ready for pictures: sampled, in readable units, on the time axis that suits it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Final

import numpy as np
from numpy.typing import NDArray

from plastica.motion.dataset import VARIABLES, natural_shape
from plastica.motion.events import moments
from plastica.motion.yielding import moving_on_legs
from plastica.physics.ledger import rates
from plastica.show.axes import DIMENSIONLESS, Quantity, TimeAxis, axis_unit

if TYPE_CHECKING:
    import xarray

    from plastica.motion.solution import Solution

__all__ = ["View", "frame_times", "time_axis", "view", "yielding", "yielding_by_segment"]

Array = NDArray[np.float64]

MOST_POINTS: Final = 3000
"""Times drawn of one run: more than a page has dots."""

FEWEST_POINTS: Final = 300
"""A run of a few long steps is drawn with points in between, so that curves are not polygons."""

SWINGING_POINTS: Final = 1500
"""The same of a rod with inertia, which goes through a good part of a swing in one step."""

EARLY: Final = 0.02
"""Where half of what happens is over within this share of the run, time is drawn on a logarithmic axis."""


@dataclass(frozen=True)
class View:
    """A solution sampled for pictures.

    Attributes
    ----------
    solution : Solution
        The whole of it.
    sampled : Solution
        The same on the times that are drawn.
    path : ndarray
        How far the state has gone at each of these times, from 0 to 1 (all 0 where nothing moved).
    time : TimeAxis
        The axis of time.
    """

    solution: Solution
    sampled: Solution
    path: Array
    time: TimeAxis

    @property
    def dataset(self) -> xarray.Dataset:
        """Every variable at the times drawn, in the user's units."""
        return self.sampled.dataset

    @cached_property
    def t(self) -> Array:
        """The times drawn, in the user's units."""
        return np.asarray(self.dataset["t"].values, dtype=float)

    @property
    def dimensionless(self) -> bool:
        """Whether there is no specimen."""
        return self.solution.model.specimen is None

    def values(self, name: str) -> Array:
        """Return a variable of the dataset as an array."""
        return np.asarray(self.dataset[name].values, dtype=float)

    def quantity(self, name: str, words: str, largest: float | None = None) -> Quantity:
        """Return the axis for a variable, in words, with a unit that suits its largest value."""
        size = float(np.abs(self.values(name)).max()) if largest is None else largest
        return self.kind(VARIABLES[name][1], str(self.dataset[name].attrs["units"]), words, size)

    def kind(self, kind: str, unit: str, words: str, largest: float) -> Quantity:
        """Return the axis for a kind of quantity given in `unit`."""
        if self.dimensionless and kind != "angle":
            return Quantity(1.0, DIMENSIONLESS[kind], f"{words} {DIMENSIONLESS[kind]}".strip())
        factor, name = axis_unit(unit, largest)
        return Quantity(factor, name, f"{words} ({name})")

    def length(self, words: str) -> Quantity:
        """Return an axis for lengths of the size of the rod."""
        return self.kind("length", "m", words, self.solution.model.scales.length)

    def states(self, t: Array) -> Array:
        """Return the dimensionless states at times t (user's units), or the nearest ones kept; shape (times, size)."""
        history = self.solution.history
        times = np.clip(np.asarray(t) / self.solution.model.scales.time, history.start, history.end)
        return history(history.snapped(times))

    def near(self, t: Array) -> Array:
        """Return times (user's units), those whose states are not kept moved to the nearest that are."""
        scale = self.solution.model.scales.time
        return self.solution.history.snapped(np.asarray(t) / scale) * scale

    def velocities(self, t: Array, s: Array) -> tuple[Array, Array]:
        """Return the velocity r_t = int theta_t b along and across (design note 1.2) at times t and fractions s.

        Returns
        -------
        along, across : ndarray, shape (times, places)
            In the user's units of velocity.
        """
        model = self.solution.model
        layout, y = model.layout, self.states(t)
        mu = layout.mu(y)
        first, _ = rates(model, np.asarray(t) / model.scales.time, mu, layout.natural(y), layout.mu_t(y))
        theta, spin = model.angle(mu), model.angle(first)
        integrate = model.grid.integration(s).T * model.scales.velocity
        return (-np.sin(theta) * spin) @ integrate, (np.cos(theta) * spin) @ integrate

    def centre_lines(self, t: Array, s: Array) -> tuple[Array, Array, Array, Array]:
        """Return the rod and its natural configuration at times t (user's units) and fractions s of the length.

        The centre line r = int (cos theta, sin theta), theta = int mu (design note 1.2), and the arcs of the natural
        curvature, both from the clamp.

        Returns
        -------
        x, y, natural_x, natural_y : ndarray, shape (times, places)
            In the user's units of length.
        """
        model = self.solution.model
        y = self.states(t)
        theta = model.angle(model.layout.mu(y))
        integrate = model.grid.integration(s).T
        natural = natural_shape(model, model.layout.natural(y), s)
        length = model.scales.length
        return (
            np.cos(theta) @ integrate * length,
            np.sin(theta) @ integrate * length,
            natural[0] * length,
            natural[1] * length,
        )


def view(solution: Solution) -> View:
    """Return a solution made ready for pictures. Nothing is solved: the history is read between its steps."""
    t = _display_times(solution)
    path = _path(solution, t)
    sampled = replace(solution, times=t * solution.model.scales.time)
    for name in ("events", "limit", "outcome"):
        # What is told of the whole run holds for a sample of it, and is dear to find.
        vars(sampled)[name] = getattr(solution, name)
    # Without the way there and back through the units, which may cost a last bit: steps must be met exactly.
    vars(sampled)["t"] = t
    return View(solution, sampled, path, time_axis(solution, t, path))


def yielding(solution: Solution) -> list[tuple[float, float]]:
    """Return the intervals (user's units) in which a natural curvature moves, from the legs of the integration."""
    return _spans(solution, np.asarray(moving_on_legs(solution)[1].any(axis=1)))


def yielding_by_segment(solution: Solution) -> list[list[tuple[float, float]]]:
    """Return for each segment the intervals (user's units) in which its natural curvature moves."""
    return [_spans(solution, column) for column in moving_on_legs(solution)[1].T]


def _spans(solution: Solution, moving: NDArray[np.bool_]) -> list[tuple[float, float]]:
    starts, scale = solution.legs[0], solution.model.scales.time
    ends = np.append(starts[1:], solution.history.end)
    spans: list[tuple[float, float]] = []
    for begin, end, moves in zip(starts * scale, ends * scale, moving, strict=False):
        if not moves or end <= begin:
            continue
        if spans and begin <= spans[-1][1]:
            spans[-1] = (spans[-1][0], float(end))
        else:
            spans.append((float(begin), float(end)))
    return spans


def _display_times(solution: Solution) -> Array:
    """The accepted steps, thinned out if there are too many and refined if there are few, with every event."""
    history, scale = solution.history, solution.model.scales.time
    steps = np.union1d(history.t[history.accepted], moments(solution))
    if steps.size < 2:
        return steps
    if steps.size > MOST_POINTS:
        place = np.linspace(0, steps.size - 1, MOST_POINTS).round().astype(int)
        told = np.array([event.t / scale for event in solution.events[:MOST_POINTS]])
        chosen = np.concatenate([steps[place], np.clip(told, history.start, history.end)])
        return np.unique(history.snapped(chosen))
    fewest = SWINGING_POINTS if solution.model.has_inertia else FEWEST_POINTS
    between = -(-fewest // (steps.size - 1))
    if between <= 1:
        return steps
    index = np.arange((steps.size - 1) * between + 1) / between
    fine = np.interp(index, np.arange(steps.size), steps)
    # The steps themselves must come out bitwise.
    fine[::between] = steps
    return np.unique(history.snapped(fine))


def _path(solution: Solution, t: Array) -> Array:
    """Length of the way of the state (curvature and natural curvature in L2), as a share of the whole."""
    model = solution.model
    change = np.diff(solution.history(solution.history.snapped(t)), axis=0)
    squares = model.layout.mu(change) ** 2 @ model.grid.w + model.division.total(model.layout.natural(change) ** 2)
    along = np.concatenate([[0.0], np.cumsum(np.sqrt(squares))])
    return along / along[-1] if along[-1] > 0.0 else along


def time_axis(solution: Solution, t: Array, path: Array) -> TimeAxis:
    """Choose the axis of time for a run.

    It is logarithmic where half of all motion is over within the first 2 % of the run, so that a linear axis would
    hide it, and the loads do not change after that either; it then begins where a thousandth of the motion is done.

    Parameters
    ----------
    solution : Solution
        The run.
    t, path : ndarray
        Dimensionless times, and how far the state has gone at each.
    """
    scale = solution.model.scales.time
    start, end = float(t[0]) * scale, float(t[-1]) * scale
    span = end - start if end > start else scale
    half = float(np.interp(0.5, path, t * scale)) - start if path[-1] > 0.0 else span
    log = half < EARLY * span and t.size > 2 and _loads_rest(solution, start / scale + EARLY * span / scale)
    origin = start if log else 0.0
    factor, unit = (1.0, "") if solution.model.specimen is None else axis_unit("s", start + span - origin)
    words = "time since start" if log and start > 0.0 else "time"
    natural = solution.model.time_unit
    label = f"{words} / {natural.removesuffix('s')}" if unit == "" else f"{words} ({unit})"
    lower = start
    if log:
        early = float(np.interp(1e-3, path, t * scale)) - start
        lower = 10.0 ** np.floor(np.log10(max(early, 1e-12 * span) / factor)) * factor
        label = f"{label}, logarithmic" if unit == "" else f"{words} (logarithmic)"
    label = label[0].upper() + label[1:]
    return TimeAxis(
        "log" if log else "linear",
        origin,
        factor,
        unit,
        lower / factor,
        (start + span - origin) / factor,
        label,
        natural,
    )


def _loads_rest(solution: Solution, after: float) -> bool:
    """Whether no load changes later than a dimensionless time."""
    end = solution.history.end
    for _, program in solution.model.loads.sources():
        late = np.linspace(after, end, 200)
        values = np.asarray(program(late), dtype=float)
        if not program.constant and (np.ptp(values) > 0.0 or any(knot.t > after for knot in program.knots(end))):
            return False
    return True


def frame_times(seen: View, count: int) -> Array:
    """Return increasing times (user's units) for pictures of a motion, such that something happens between any two.

    Half of the clock follows the way of the state (curvature and natural curvature), half the axis of time,
    logarithmic for long runs; so a snap is slowed down and a long creep is not skipped.

    Parameters
    ----------
    seen : View
        The run.
    count : int
        How many; the first and last are those of the run.
    """
    t = seen.t
    if t.size < 2 or count < 2:
        return t[-1:] if count < 2 else t[:1]
    clock = 0.5 * seen.path + 0.5 * seen.time.place(t)
    clock = clock + 1e-9 * np.linspace(0.0, 1.0, t.size)
    times = np.interp(np.linspace(clock[0], clock[-1], count), clock, t)
    times[0], times[-1] = t[0], t[-1]
    return np.unique(times)
