"""Histories of loading: couple against curvature at a place of the rod, loads against what they displace.

The area under each curve is work (design, section 1.2): over the rod that of couple and curvature adds up to what is
stored and dissipated, that of the loads and their displacements to the work of the ledger.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import TYPE_CHECKING, Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from plastica.errors import ArgumentError
from plastica.motion.solution import Solution
from plastica.physics.kinds import unit_of
from plastica.physics.model import Model

if TYPE_CHECKING:
    import xarray

__all__ = ["CONJUGATE", "KINDS_OF", "force_displacement", "moment_curvature"]

Array = NDArray[np.float64]

BLOCK: Final = 20_000
"""Times that are worked on at once."""

MOST_ROWS: Final = 100_000
"""Rows up to which rows are added between the steps of a run."""

SLIGHT: Final = 1e-3
"""Share of an area that is reckoned with as missed where four pieces happen to agree with one."""

POLYGON: Final = 10.0
"""What straight lines between the rows of a table may miss of an area, in rtol times the largest energy."""

CONJUGATE: Final[Mapping[str, str]] = MappingProxyType(
    {"thrust": "shortening", "transverse": "deflection", "end_couple": "rotation", "total_weight": "sinking"}
)
"""Load -> the displacement on which it does work."""

KINDS_OF: Final[Mapping[str, tuple[str, str]]] = MappingProxyType(
    {
        "curvature": ("curvature", "curvature of the centre line"),
        "natural_curvature": ("curvature", "natural curvature at the same place"),
        "bending": ("curvature", "curvature less natural curvature"),
        "couple": ("couple", "contact couple"),
        "thrust": ("force", "thrust at the free end"),
        "transverse": ("force", "transverse force at the free end"),
        "end_couple": ("couple", "couple at the free end"),
        "total_weight": ("force", "weight of the whole rod"),
        "shortening": ("length", "way of the free end toward the clamp, from the straight rod"),
        "deflection": ("length", "way of the free end across, from the straight rod"),
        "rotation": ("angle", "rotation of the free end, from the straight rod"),
        "sinking": ("length", "mean way of the rod along its weight, from the straight rod"),
        "work": ("energy", "work of the loads since the start"),
    }
)
"""Variable -> kind of quantity and words."""


def moment_curvature(solution: Solution, s: ArrayLike = 0.0, times: ArrayLike | None = None) -> xarray.Dataset:
    """Return couple and curvature at places of the rod over time; plotted against each other they show the loops.

    M = m1 + J*[n.b - eps0 theta_tt] = mu - mu_nat + delta mu_t (design, section 1.2). The area that a closed loop
    encloses is what a unit of length has dissipated in the cycle.

    Parameters
    ----------
    solution : Solution
        A finished motion of a `Strut` or a `Rod`.
    s : array_like
        Arc lengths (m, or units of L), one or several; 0 is the clamp. Where elements meet, the limit from the right.
    times : array_like, optional
        Times, as those of `solve`; by default those that were asked of `solve`, or every step and event with as many
        rows in between as let straight lines enclose areas to 10 rtol times the largest energy (at most 100 000).

    Returns
    -------
    Dataset
        Over (t, s) `curvature`, `natural_curvature`, their difference `bending`, and `couple`. The time at which a load
        jumps occurs twice, before and after: without inertia the couple jumps with it.

    Raises
    ------
    ArgumentError
        Where s is not on the rod, or a time not in the motion.
    """
    course = _course(solution, times)
    model = solution.model
    places = _numbers(s, "s")
    inside = np.clip(places / model.scales.length, 0.0, 1.0)

    def curvature_at(course: _Course) -> Array:
        given = course.t * model.scales.time if course.times is None else course.times
        return np.asarray(solution.at(places, given[:, None])) / model.scales.curvature

    if times is None:
        share = 1.0 / places.size
        course = _refined(solution, course, lambda part: (share * _couple(model, part, inside), curvature_at(part)))
    curvature = curvature_at(course)
    segment = np.clip(np.searchsorted(model.division.breaks, inside, side="right") - 1, 0, model.segments - 1)
    natural = model.layout.natural(course.y).reshape(course.t.size, -1)[:, segment]
    blocks = [slice(i, i + BLOCK) for i in range(0, course.t.size, BLOCK)]
    values = {
        "curvature": curvature,
        "natural_curvature": natural,
        "bending": curvature - natural,
        "couple": np.concatenate([_couple(model, course.part(block), inside) for block in blocks]),
    }
    label = {"units": unit_of("length", model.specimen is None), "long_name": "arc length from the clamp"}
    return _table("moment_curvature", solution, course, values, {"s": ("s", places, label)})


def force_displacement(solution: Solution, times: ArrayLike | None = None) -> xarray.Dataset:
    """Return the loads that act, and the displacements on which they do work, over time.

    With u = r - (s, 0) the displacement from the straight rod, the work of the dead loads is (design, section 1.2)
    int thrust d(-u_x(1)) + transverse d(u_y(1)) + couple d(theta(1)) + weight d(mean of u along it).

    Parameters
    ----------
    solution : Solution
        A finished motion of a `Strut` or a `Rod`.
    times : array_like, optional
        Times, as those of `solve`; by default those that were asked of `solve`, or every step and event with as many
        rows in between as let straight lines enclose areas to 10 rtol times the largest energy (at most 100 000).

    Returns
    -------
    Dataset
        Over t the displacements `shortening` (toward the clamp), `deflection` (across) and `rotation` of the free end,
        `work`, and of the loads those that act: `thrust`, `transverse`, `end_couple`, and `total_weight` with
        `sinking`, the mean way along it. The time at which a load jumps occurs twice, before and after, so that the
        areas under the curves add up to the work.

    Raises
    ------
    ArgumentError
        Where a time is not in the motion.
    """
    course = _course(solution, times)
    model = solution.model

    def worked(part: _Course) -> tuple[Array, Array]:
        values = _displaced(model, part)
        pairs = [(values[load], values[way]) for load, way in CONJUGATE.items() if load in values]
        none = np.zeros((part.t.size, 1))
        return (np.stack([a for a, _ in pairs], 1), np.stack([b for _, b in pairs], 1)) if pairs else (none, none)

    if times is None:
        course = _refined(solution, course, worked)
    return _table("force_displacement", solution, course, _displaced(model, course), {})


def _displaced(model: Model, course: _Course) -> dict[str, Array]:
    """Loads that act, what they displace, and their work."""
    grid = model.grid
    theta = model.angle(model.layout.mu(course.y))
    cos, sin = np.cos(theta), np.sin(theta)
    values = {
        "shortening": 1.0 - cos @ grid.w,
        "deflection": sin @ grid.w,
        "rotation": model.layout.mu(course.y) @ grid.w,
        "work": model.layout.ledger(course.y)[:, 0],
    }
    names = {"couple": "end_couple", "weight": "total_weight"}
    values |= {names.get(name, name): course.loads[name] for name, _ in model.loads.sources()}
    if "total_weight" in values:
        # The mean of x = J cos theta is the integral of (1 - s) cos theta, for J and J* are adjoint.
        arm = grid.w * (1.0 - grid.s)
        toward, across = -model.loads.weight_direction[0], model.loads.weight_direction[1]
        values["sinking"] = toward * ((1.0 - cos) @ arm) + across * (sin @ arm)
    return values


@dataclass(frozen=True)
class _Course:
    """Dimensionless states and loads, with a row before and one after every jump of a load.

    `times` are those that were asked for, in the user's units, row by row; None where none were.
    """

    t: Array
    y: Array
    loads: dict[str, Array]
    times: Array | None

    def part(self, rows: slice) -> _Course:
        """Return some of its rows."""
        chosen = {name: values[rows] for name, values in self.loads.items()}
        return _Course(self.t[rows], self.y[rows], chosen, None if self.times is None else self.times[rows])


def _refined(solution: Solution, course: _Course, curves: Callable[[_Course], tuple[Array, Array]]) -> _Course:
    """Add rows between those of every step, so that straight lines between them enclose the areas under curves.

    With k pieces in place of one a polygon misses 1/k^2 of what it missed; the fewest rows for a sum of misses have k
    in proportion to the third root of each. Rows that were asked for stay as they are.
    """
    if course.times is not None or course.t.size < 2:
        return course
    height, way = curves(_between(solution, course, np.where(np.diff(course.t) > 0.0, 4, 1)))
    pieces = np.where(np.diff(course.t) > 0.0, 4, 1)
    first = np.concatenate([[0], np.cumsum(pieces)])
    areas = np.add.reduceat(0.5 * (height[1:] + height[:-1]) * np.diff(way, axis=0), first[:-1], axis=0)
    ends = 0.5 * (height[first[1:]] + height[first[:-1]]) * np.diff(way[first], axis=0)
    # Four pieces have found 15 of 16 parts of what one misses.
    misses = np.abs(areas - ends).sum(axis=1) * (16.0 / 15.0) + SLIGHT * np.abs(areas).sum(axis=1)
    allowed = POLYGON * solution.rtol * solution.ledger.largest_energy / solution.model.scales.energy
    roots = np.cbrt(misses)
    needed = roots * np.sqrt(roots.sum() / allowed) if allowed > 0.0 else np.ones(roots.size)
    needed *= min(1.0, MOST_ROWS / max(float(needed.sum()), 1.0))
    return _between(solution, course, np.where(pieces > 1, np.maximum(np.ceil(needed), 1.0), 1.0).astype(np.intp))


def _between(solution: Solution, course: _Course, pieces: NDArray[np.intp]) -> _Course:
    """Divide what lies between two rows of a course into pieces."""
    owner = np.append(np.repeat(np.arange(pieces.size), pieces), pieces.size)
    first = np.concatenate([[0], np.cumsum(pieces)])
    part = (np.arange(owner.size) - first[owner]) / np.append(pieces, 1)[owner]
    t = course.t[owner] + part * np.append(np.diff(course.t), 0.0)[owner]
    new = part > 0.0
    y = course.y[owner]
    y[new] = solution.history(t[new])
    loads = {name: values[owner] for name, values in course.loads.items()}
    for name, program in solution.model.loads.items():
        loads[name][new] = program(t[new])
    return _Course(t, y, loads, None)


def _course(solution: object, times: ArrayLike | None) -> _Course:
    if not isinstance(solution, Solution):
        raise ArgumentError("must be a Solution", where="solution", value=solution)
    asked = solution if times is None else replace(solution, times=_checked(solution, times))
    t, loads = asked.t, solution.model.loads
    jumps = np.array([knot.t for knot in loads.knots(solution.history.end) if knot.kind == "jump"])
    jumps = jumps[jumps > solution.history.start]
    # A run lands on a jump to rounding, which must not hide it.
    later = np.minimum(np.searchsorted(t, jumps), t.size - 1)
    earlier = np.maximum(later - 1, 0)
    nearest = np.where(np.abs(t[earlier] - jumps) < np.abs(t[later] - jumps), earlier, later)
    met = np.abs(t[nearest] - jumps) <= 64.0 * np.spacing(jumps)
    row, jumps = nearest[met], jumps[met]
    index = np.insert(np.arange(t.size), row, row)
    before = row + np.arange(row.size)
    values = {}
    for name, program in loads.items():
        at = np.broadcast_to(np.asarray(program(t), dtype=float), t.shape)[index].copy()
        if row.size:
            at[before] = program.before(jumps)
            at[before + 1] = program(jumps)
        values[name] = at
    return _Course(t[index], asked.y[index], values, None if asked.times is None else asked.times[index])


def _numbers(given: ArrayLike, where: str) -> Array:
    try:
        numbers = np.atleast_1d(np.asarray(given, dtype=float))
    except (TypeError, ValueError):
        numbers = np.empty(0)
    if numbers.ndim != 1 or numbers.size == 0:
        raise ArgumentError("must be a number, or several in a row", where=where, value=given)
    return numbers


def _checked(solution: Solution, times: ArrayLike) -> Array:
    """Times in the user's units, within the motion."""
    given = _numbers(times, "times")
    scale, history = solution.model.scales.time, solution.history
    slack = 64.0 * np.finfo(float).eps * max(abs(history.start), abs(history.end)) * scale
    inside = (given >= history.start * scale - slack) & (given <= history.end * scale + slack)
    if not inside.all() or (np.diff(given) <= 0.0).any():
        raise ArgumentError(
            f"must increase within [{history.start * scale:.12g}, {history.end * scale:.12g}]",
            where="times",
            value=times,
        )
    return given


def _couple(model: Model, course: _Course, s: Array) -> Array:
    """Contact couple m1 + J*g at fractions s of the length, with g = n.b - eps0 theta_tt at the nodes.

    With inertia g is what makes m1 + J*g the couple of the constitutive law at the nodes, so that both laws hold, and
    the couple is m1 at the free end and that of the whole balance of moments at the clamp.
    """
    mu, mu_t, grid = model.layout.mu(course.y), model.layout.mu_t(course.y), model.grid
    load = {name: values[:, None] for name, values in course.loads.items()}
    if mu_t is None:
        theta, names = model.angle(mu), ("thrust", "transverse")
        along, across = (load[name] + load["weight"] * arm for name, arm in zip(names, model.arms, strict=True))
        moment = along * np.sin(theta) + across * np.cos(theta)
    else:
        contact = mu - model.division.spread(model.layout.natural(course.y)) + model.damping * mu_t
        moment = np.asarray(np.linalg.solve(grid.B, (contact - load["couple"]).T).T, dtype=float)
    return np.asarray(load["couple"] + moment @ (grid.w - grid.integration(s)).T)


def _table(
    name: str, solution: Solution, course: _Course, values: dict[str, Array], coordinates: dict[str, object]
) -> xarray.Dataset:
    """Label the values, in the user's units."""
    import xarray

    model = solution.model
    plain = model.specimen is None

    def labelled(key: str) -> tuple[tuple[str, ...], Array, dict[str, str]]:
        kind, words = KINDS_OF[key]
        scaled = values[key] * float(getattr(model.scales, kind))
        return ("t", "s")[: scaled.ndim], scaled, {"units": unit_of(kind, plain), "long_name": words}

    t = course.t * model.scales.time if course.times is None else course.times
    time = ("t", t, {"units": unit_of("time", plain), "long_name": "time"})
    return xarray.Dataset(
        {key: labelled(key) for key in KINDS_OF if key in values},
        coords={"t": time, **coordinates},
        attrs={"result": name, "title": solution.provenance.get("title", "")},
    )
