"""A solution made ready for pictures: sampled, in readable units, on the time axis that suits it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import NDArray

from plastica.motion.dataset import VARIABLES, natural_centre_line

if TYPE_CHECKING:
    import xarray
    from matplotlib.axes import Axes

    from plastica.motion.solution import Solution

__all__ = ["Quantity", "TimeAxis", "View", "axis_unit", "frame_times", "time_axis", "view"]

Array = NDArray[np.float64]

MOST_POINTS: Final = 3000
"""Times drawn of one run: more than a page has dots."""

FEWEST_POINTS: Final = 300
"""A run of a few long steps is drawn with points in between, so that curves are not polygons."""

EARLY: Final = 0.02
"""Where half of what happens is over within this share of the run, time is drawn on a logarithmic axis."""

DIMENSIONLESS: Final = {
    "length": "/ L",
    "time": "/ retardation time",
    "curvature": "× L",
    "force": "× L²/EI",
    "couple": "× L/EI",
    "distributed": "× L³/EI",
    "drive": "/ EI",
    "energy": "× L/EI",
    "ratio": "",
}
"""How a dimensionless quantity was made from one with a dimension, by kind."""

_PREFIXES: Final = ((1e6, "M"), (1e3, "k"), (1.0, ""), (1e-3, "m"), (1e-6, "µ"), (1e-9, "n"))
_PRETTY: Final = {
    "N*m**2": "N·m²",
    "N*m": "N·m",
    "1/m": "1/m",
    "N/m": "N/m",
    "J": "J",
    "N": "N",
    "W": "W",
    "W/m": "W/m",
    "W/K": "W/K",
    "J/K": "J/K",
}
_TIMES: Final = ((86400.0, "days"), (3600.0, "h"), (60.0, "min"), (1.0, "s"), (1e-3, "ms"), (1e-6, "µs"))
_ROUND_TIMES: Final = (
    *((10.0**k, f"{10 ** (k + 6)} µs") for k in (-6, -5, -4)),
    *((10.0**k, f"{10 ** (k + 3)} ms") for k in (-3, -2, -1)),
    *((1.0, "1 s"), (10.0, "10 s"), (60.0, "1 min"), (600.0, "10 min"), (3600.0, "1 h"), (36000.0, "10 h")),
    *((86400.0, "1 day"), (864000.0, "10 days"), (8640000.0, "100 days")),
    *((31557600.0 * 10**k, f"{10**k} year{'s' * (k > 0)}") for k in range(7)),
)


@dataclass(frozen=True)
class Quantity:
    """A quantity on an axis: divide by `factor` and write `unit` behind it; `label` names the axis."""

    factor: float
    unit: str
    label: str

    def __call__(self, values: Any) -> Any:
        """Return the values in the unit of the axis."""
        return np.asarray(values, dtype=float) / self.factor


def axis_unit(unit: str, largest: float) -> tuple[float, str]:
    """Choose a unit in which the largest value of an axis is easy to read.

    Parameters
    ----------
    unit : str
        SI unit of the data, such as "m", "s", "rad" or "N*m**2".
    largest : float
        Largest magnitude on the axis.

    Returns
    -------
    factor : float
        What to divide the data by.
    name : str
        The unit to write: mm for lengths below 1 m, minutes to days for long times, degrees for angles.
    """
    size = abs(largest) if np.isfinite(largest) else 0.0
    if unit == "rad":
        return float(np.pi / 180.0), "°"
    if unit == "s":
        return next(((f, n) for f, n in _TIMES if size >= 2.0 * f), (1.0, "s") if size == 0.0 else _TIMES[-1])
    if unit == "m":
        return next((f, n) for f, n in ((1.0, "m"), (1e-3, "mm"), (1e-6, "µm")) if _fits(size, f, n, "µm", "mm"))
    name = _PRETTY.get(unit, unit)
    if unit not in _PRETTY or not unit[0].isalpha() or size == 0.0:
        return 1.0, name
    factor, prefix = next(((f, p) for f, p in _PREFIXES if size >= f), _PREFIXES[-1])
    return factor, prefix + name


def _fits(size: float, factor: float, name: str, last: str, for_zero: str) -> bool:
    return name == for_zero if size == 0.0 else size >= factor or name == last


@dataclass(frozen=True)
class TimeAxis:
    """The axis of time that a run is drawn on.

    Attributes
    ----------
    scale : str
        "linear" or "log".
    origin : float
        Time (user's units) at which the axis begins to count: 0, or the start of a continued run on a log axis.
    factor, unit
        Divide by the factor to have the unit.
    lower, upper : float
        Limits, in that unit; on a log axis `lower` is a time before which next to nothing has happened.
    label : str
        For the axis.
    """

    scale: str
    origin: float
    factor: float
    unit: str
    lower: float
    upper: float
    label: str

    def __call__(self, t: Any) -> Array:
        """Return times (user's units) on the axis; what is earlier than a log axis begins is put at its edge."""
        shown = (np.asarray(t, dtype=float) - self.origin) / self.factor
        return np.maximum(shown, self.lower) if self.scale == "log" else shown

    def place(self, t: Any) -> Array:
        """Return where times lie on the axis, from 0 at its left end to 1."""
        low, high, x = self.lower, self.upper, self(t)
        if self.scale == "log":
            return np.asarray(np.log(x / low) / np.log(high / low))
        return (x - low) / (high - low)

    def times(self, place: Any) -> Array:
        """Return the times (user's units) at places in [0, 1] along the axis."""
        p = np.asarray(place, dtype=float)
        low, high = self.lower, self.upper
        x = low * (high / low) ** p if self.scale == "log" else low + (high - low) * p
        return x * self.factor + self.origin

    @property
    def ticks(self) -> tuple[list[float], list[str]]:
        """Round times of a log axis in SI, such as 1 s, 1 min, 1 h, 1 day, and where they lie."""
        every = [
            (n, w) for n, w in _ROUND_TIMES if self.lower <= n / self.factor * (1 + 1e-9) <= self.upper * (1 + 2e-9)
        ]
        kept = every[:: -(-len(every) // 8)] if every else []
        return [n / self.factor for n, _ in kept], [words for _, words in kept]

    def apply(self, ax: Axes, *, label: bool = True) -> None:
        """Give an axes this axis of time."""
        if self.scale == "log":
            ax.set_xscale("log")
            places, words = self.ticks
            if self.unit and len(places) > 2:
                ax.set_xticks(places, words)
                ax.minorticks_off()
        ax.set_xlim(self.lower, self.upper)
        if label:
            ax.set_xlabel(self.label)

    def words(self, t: float) -> str:
        """Write a time (user's units) for people, in a unit that suits it."""
        if self.unit == "":
            return f"{t:.4g} retardation times"
        factor, name = axis_unit("s", t)
        return f"{t / factor:.4g} {name}"

    def clock(self, t: float) -> str:
        """Write a time (user's units) as a clock would: "1 d 5 h", "14 h 14 min"."""
        if self.unit == "" or abs(t) < 60.0:
            return f"t = {t:.4g}" if self.unit == "" else self.words(t)
        parts = ((86400, "d"), (3600, "h"), (60, "min"), (1, "s"))
        first = next(i for i, (size, _) in enumerate(parts) if t >= size)
        small = parts[min(first + 1, 3)][0]
        whole = round(t / small) * small
        first = next(i for i, (size, _) in enumerate(parts) if whole >= size)
        size, name = parts[first]
        next_size, next_name = parts[min(first + 1, 3)]
        return f"{whole // size} {name} {whole % size // next_size} {next_name}"


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

    def centre_lines(self, t: Array, s: Array) -> tuple[Array, Array, Array, Array]:
        """Return the rod and its natural configuration at times t (user's units) and fractions s of the length.

        The centre line r = int (cos theta, sin theta), theta = int mu (design note 1.2), and the arc of the natural
        curvature, both from the clamp.

        Returns
        -------
        x, y, natural_x, natural_y : ndarray, shape (times, places)
            In the user's units of length.
        """
        model = self.solution.model
        history = self.solution.history
        n = model.grid.size
        inside = np.clip(np.asarray(t) / model.scales.time, history.start, history.end)
        y = history(inside)
        theta = model.angle(y[:, :n])
        integrate = model.grid.integration(s).T
        natural = natural_centre_line(y[:, n, None], s)
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
    return View(solution, replace(solution, times=t), path, time_axis(solution, t, path))


def _display_times(solution: Solution) -> Array:
    """The accepted steps, thinned out if there are too many and refined if there are few, with every event."""
    history, scale = solution.history, solution.model.scales.time
    steps = np.unique(history.t[history.accepted])
    if steps.size < 2:
        return steps
    if steps.size > MOST_POINTS:
        place = np.linspace(0, steps.size - 1, MOST_POINTS).round().astype(int)
        moments = np.array([event.t / scale for event in solution.events[:MOST_POINTS]])
        return np.unique(np.concatenate([steps[place], np.clip(moments, history.start, history.end)]))
    between = -(-FEWEST_POINTS // (steps.size - 1))
    if between <= 1:
        return steps
    index = np.arange((steps.size - 1) * between + 1) / between
    fine = np.interp(index, np.arange(steps.size), steps)
    # The steps themselves must come out bitwise.
    fine[::between] = steps
    return np.unique(fine)


def _path(solution: Solution, t: Array) -> Array:
    """Length of the way of the state (curvature in L2, natural curvature), as a share of the whole."""
    n, w = solution.model.grid.size, solution.model.grid.w
    change = np.diff(solution.history(t), axis=0)
    along = np.concatenate([[0.0], np.cumsum(np.sqrt(change[:, :n] ** 2 @ w + change[:, n] ** 2))])
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
    words = "time since the start of this run" if log and start > 0.0 else "time"
    label = f"{words} / retardation time" if unit == "" else f"{words} ({unit})"
    lower = start
    if log:
        early = float(np.interp(1e-3, path, t * scale)) - start
        lower = 10.0 ** np.floor(np.log10(max(early, 1e-12 * span) / factor)) * factor
        label += ", logarithmic"
    label = label[0].upper() + label[1:]
    return TimeAxis(
        "log" if log else "linear",
        origin,
        factor,
        unit,
        lower / factor,
        (start + span - origin) / factor,
        label,
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
