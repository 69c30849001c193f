"""The verdict on a motion in words, and how a solution introduces itself."""

from __future__ import annotations

import platform
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from plastica._version import __version__
from plastica.errors import safe_text
from plastica.motion.dataset import natural_shape
from plastica.motion.regimes import SHAPES, rows_of
from plastica.physics.bounds import Bounds
from plastica.physics.ledger import rates
from plastica.physics.model import Model
from plastica.units import format_quantity

if TYPE_CHECKING:
    from plastica.motion.solution import Solution

__all__ = ["REFERENCES", "Outcome", "introduction", "outcome", "provenance", "unjudged"]

STILL = 1e-15
"""Rate, in 1/(L T), below which rounding hides all motion."""

ARRIVED = 1e-12
"""Distance from the limit, in 1/L, that is no distance in double precision."""

HEADLINES = {"not_resolved": "Not resolved by its grid", "never_settled": "Has not come to rest"}
STOPPED = "Stopped early"
"""Of a run that did not do what was asked, by the code of its status."""

NOT_JUDGED = "not judged"

REFERENCES = (
    "K. R. Rajagopal and C. Rodriguez, "
    "On evolving natural curvature for an inextensible, unshearable, viscoelastic rod",
    "A. C. Hindmarsh, ODEPACK, a systematized collection of ODE solvers, in Scientific Computing, 1983 (LSODA)",
    "E. Hairer, S. P. Norsett and G. Wanner, Solving Ordinary Differential Equations I and II (DOP853, Radau)",
    "E. Hairer, C. Lubich and G. Wanner, Geometric Numerical Integration, 2nd ed., 2006 (Gauss)",
    "L. F. Shampine and M. W. Reichelt, The MATLAB ODE suite, SIAM J. Sci. Comput. 18, 1997 (BDF)",
)


@dataclass(frozen=True)
class Outcome:
    """What became of the rod, as far as it was followed.

    Attributes
    ----------
    shape : str
        "straight" (no tangent angle above 0.01 rad), "buckled" (under thrust, with or without a weight toward the
        clamp, above 0.1 rad and at least twice the angle it began with), or "bent"; "not judged" where judging failed,
        or where the run did not do what was asked (``status.ok`` is False).
    memory : str
        "springs back" (the natural curvature is, to the last bit, what it was at the very first start, and would stay
        so without load), "permanent set", or "not judged".
    released : bool
        Whether no load acts at the end.
    resting : bool
        Whether the drive is within its threshold at the end, so that the natural curvature no longer moves.
    headline : str
        The verdict in a few words; of a run that is not judged, why.
    sentence : str
        The verdict in one sentence with numbers; of a run that stopped early, what it had come to.
    distance : str
        How far the last state is from where it will end, and where that is as far as it can be told.
    set_curvature : float
        Change of the natural curvature, with several segments of its mean along the rod, from the very first start to
        when the rod, let go, has come to rest; in the user's units. Not a number where it is not judged.
    set_deflection : float
        What that moves the free end's place of rest across the clamp's tangent, in the user's units; likewise.
    excess : float
        |drive| - threshold at the end, the largest of all segments, in the user's units; positive while the rod yields.
    curvature_rate, natural_rate : float
        Norm of the rate of curvature and rate of the natural curvature (of the fastest segment) at the end, in units of
        1/(L T).
    """

    shape: str
    memory: str
    released: bool
    resting: bool
    headline: str
    sentence: str
    distance: str
    set_curvature: float
    set_deflection: float
    excess: float
    curvature_rate: float
    natural_rate: float


def outcome(solution: Solution) -> Outcome:
    """Judge the last state of a solution.

    What is kept is found by letting the rod go: it is followed without its loads until it has come to rest, for on the
    way back it may yield again. A run that did not do what was asked is not judged: it is told what it had come to.
    """
    from plastica.motion.longtime import natural_without_load

    rows, numbers = rows_of(solution), _numbers(solution)
    resting = not bool(rows.yielding[0])
    released = all(program(solution.history.end) == 0.0 for _, program in solution.model.loads.items())
    if not solution.status.ok:
        headline = HEADLINES.get(solution.status.code, STOPPED)
        sentence, distance = f"{headline}. {_reached(solution)}", f"Where it will end is not judged. {_rates(numbers)}"
        facts = released, resting, headline, sentence, distance, *_set(solution, None)
        return Outcome(NOT_JUDGED, NOT_JUDGED, *facts, *numbers.values())
    left = natural_without_load(solution)
    shape, memory = SHAPES[rows.shape[0]], "permanent set" if rows.kept[0] else "springs back"
    headline = _headline(solution, shape, memory, released)
    return Outcome(
        shape,
        memory,
        released,
        resting,
        headline,
        _sentence(solution, headline, memory, left),
        _distance(solution, resting, numbers) + _end(solution),
        *_set(solution, left),
        *numbers.values(),
    )


def _numbers(solution: Solution) -> dict[str, float]:
    """Excess and rates of the last state, in the order of `Outcome`."""
    strut, layout, last = solution.model, solution.model.layout, solution.history.y[-1]
    mu, mu_nat = layout.mu(last), layout.natural(last)
    mu_t, natural_rate = rates(strut, solution.history.end, mu, mu_nat, layout.mu_t(last))
    excess = float((np.abs(strut.drive(mu, mu_nat)) - strut.threshold(mu_nat)).max())
    return {
        "excess": excess * strut.scales.drive,
        "curvature_rate": float(np.sqrt(strut.grid.w @ mu_t**2)),
        "natural_rate": float(np.ravel(natural_rate)[np.abs(natural_rate).argmax()]),
    }


def _set(solution: Solution, left: np.ndarray | None) -> tuple[float, float]:
    """What the rod keeps, as natural curvature and as deflection, where it is known what it ends with."""
    if left is None:
        return float("nan"), float("nan")
    strut, began = solution.model, solution.first_natural
    curvature = float(strut.division.total(left - began)) * strut.scales.curvature
    return curvature, (_rise(strut, left) - _rise(strut, began)) * strut.scales.length


def unjudged(error: Exception) -> Outcome:
    """Return the verdict on a motion that cannot be judged, because of an error: what was computed stands."""
    why = f"{type(error).__name__}: {error}".split("\n")[0][:200]
    sentence = f"The verdict could not be reached ({why}); the motion itself is computed and kept."
    distance = "How far it is from rest could not be told either."
    nan = float("nan")
    return Outcome(NOT_JUDGED, NOT_JUDGED, False, False, "Not judged", sentence, distance, nan, nan, nan, nan, nan)


def _rise(model: Model, mu_nat: np.ndarray) -> float:
    """How far off the clamp's axis the free end of the natural configuration is, in L."""
    return float(natural_shape(model, np.asarray(mu_nat), np.array([1.0]))[1].item())


def _headline(solution: Solution, shape: str, memory: str, released: bool) -> str:
    kept = memory == "permanent set"
    if released and not kept:
        mu = solution.model.layout.mu(solution.history.y)
        if float(np.ptp(mu, axis=0).max()) <= ARRIVED:
            return "Stays at rest"
        return "Swings on" if solution.model.damping == 0.0 else "Springs back"
    if released:
        return "Takes a permanent set"
    doing = {"straight": "Stays straight", "buckled": "Buckles", "bent": "Bends"}[shape]
    if kept:
        return f"{doing} and takes a permanent set"
    return doing if shape == "straight" else f"{doing}, but would spring back"


def _show(solution: Solution, value: float, kind: str, unit: str, dimensionless: str) -> str:
    """A quantity for people, from its dimensionless value; what is nothing but rounding is 0."""
    value = 0.0 if abs(value) <= ARRIVED else value * float(getattr(solution.model.scales, kind))
    if solution.model.specimen is None:
        return f"{value:.4g} {dimensionless}".strip()
    return format_quantity(value, unit)


def _where(solution: Solution) -> str:
    """Where the free end is after which time."""
    strut = solution.model
    now = _show(solution, solution.history.end, "time", "s", strut.time_unit)
    mu = strut.layout.mu(solution.history.y[-1])
    tip = _show(solution, float(np.sin(strut.angle(mu)) @ strut.grid.w), "length", "m", "L")
    return f"After {now} the free end is {tip} off the clamp's axis"


def _reached(solution: Solution) -> str:
    """What a run had come to that is not judged."""
    if solution.status.code == "not_resolved":
        return f"{_where(solution)} as computed, which its nodes are too few for: nothing further is judged."
    began = np.atleast_1d(solution.first_natural)
    now = np.atleast_1d(solution.model.layout.natural(solution.history.y[-1]))
    if np.array_equal(began, now):
        moved = "the natural curvature has not moved so far"
    else:
        which, first, last = _farthest(solution, began, now)
        moved = f"the natural curvature{which} has moved from {_curvature(solution, first)} to "
        moved += f"{_curvature(solution, last)} so far"
    return f"{_where(solution)}; {moved}. Nothing further is judged."


def _farthest(solution: Solution, began: np.ndarray, end: np.ndarray) -> tuple[str, float, float]:
    """The segment whose natural curvature moves most, in words where there are several, and from where to where."""
    farthest = int(np.abs(end - began).argmax())
    which = f" of segment {farthest + 1}, which moves most," if solution.model.segments > 1 else ""
    return which, float(began[farthest]), float(end[farthest])


def _curvature(solution: Solution, value: float) -> str:
    return _show(solution, value, "curvature", "1/m", "/L")


def _sentence(solution: Solution, headline: str, memory: str, left: np.ndarray) -> str:
    strut, began, where = solution.model, solution.first_natural, _where(solution)
    if memory == "springs back":
        ends = "returns to" if strut.damping > 0.0 else "swings about"
        ends = "keeps" if headline == "Stays at rest" else ends
        return (
            f"{headline}. {where}; the natural curvature has not moved at all, so without load the rod {ends} its "
            "first natural shape."
        )
    ends_with, now = np.atleast_1d(left), np.atleast_1d(strut.layout.natural(solution.history.y[-1]))
    which, first, end = _farthest(solution, np.atleast_1d(began), ends_with)
    natural = float(now[int(np.abs(ends_with - np.atleast_1d(began)).argmax())])
    moved = (
        f"the natural curvature{which} has moved from {_curvature(solution, first)} to {_curvature(solution, natural)}"
    )
    if abs(end - natural) > 1e-4 * max(1.0, abs(end)):
        going = "creeps on" if all(load(solution.history.end) == 0.0 for _, load in strut.loads.items()) else "would go"
        moved += f" and {going} to {_curvature(solution, end)} without load"
    off = _show(solution, _rise(strut, left) - _rise(strut, began), "length", "m", "L")
    ends = f"comes to rest {off} away from where it did at first"
    if strut.damping == 0.0:
        ends = f"swings about a place {off} away from the first"
    return f"{headline}. {where}; {moved}. Without load the free end {ends}."


def _rates(numbers: dict[str, float]) -> str:
    speed, natural = numbers["curvature_rate"], abs(numbers["natural_rate"])
    if max(speed, natural) <= STILL:
        return "Nothing moves any more that double precision could show."
    return f"The curvature still changes at {speed:.1e} and the natural curvature at {natural:.1e}, in 1/(L T)."


def _distance(solution: Solution, resting: bool, numbers: dict[str, float]) -> str:
    strut, last = solution.model, solution.history.y[-1]
    mu_nat, excess = strut.layout.natural(last), numbers["excess"] / strut.scales.drive
    thresholds = np.atleast_1d(strut.threshold(mu_nat))
    nearest = int(np.argmax(np.abs(strut.drive(strut.layout.mu(last), mu_nat)) - thresholds))
    threshold = float(thresholds[nearest])
    rates = _rates(numbers)
    amount = _show(solution, abs(excess), "drive", "N*m**2", "EI")
    ratio = abs(excess) / threshold if threshold > 0.0 else float("inf")
    share = f"{ratio:.2g} {'of' if ratio < 1.0 else 'times'} it" if np.isfinite(ratio) else "of no size"
    several = strut.segments > 1
    if resting:
        rest = "the rest of the way is visco-elastic" if strut.damping > 0.0 else "the motion is elastic"
        within = f"The drive is within its threshold, by {amount} ({share})"
        if several:
            least = f"that of segment {nearest + 1} by the least, {amount} ({share})"
            within = f"All drives are within their thresholds, {least}"
        return f"{within}: while that lasts the natural curvature stays as it is and {rest}. {rates}"
    which = f" of segment {nearest + 1} is farthest" if several else " is still"
    return f"The drive{which} above its threshold, by {amount} ({share}): the natural curvature goes on moving. {rates}"


def _end(solution: Solution) -> str:
    """Where it will end, and how far it is from there."""
    limit = solution.limit
    if limit is None:
        return ""
    if limit.distance is None:
        return f" {limit.sentence}"
    if limit.distance <= ARRIVED:
        return f" {limit.sentence} The last state is there already, to rounding."
    return f" {limit.sentence} The last state is {limit.distance:.1e} away from there, in 1/L."


def provenance(solution: Solution) -> dict[str, str | int | float]:
    """How a solution came about, as flat entries: version, solver, tolerances, counts, platform, where from."""
    import scipy

    return {
        "plastica_version": __version__,
        "method": solution.method,
        "rtol": solution.rtol,
        "atol": solution.atol,
        "steps": solution.counts.steps,
        "rate_evaluations": solution.counts.rates,
        "jacobian_evaluations": solution.counts.jacobians,
        "restarts": solution.counts.restarts,
        "nodes": solution.model.grid.size,
        "initial_curvature": solution.initial,
        "notes": "; ".join(solution.notes),
        "platform": f"Python {platform.python_version()}, NumPy {np.__version__}, SciPy {scipy.__version__}, "
        f"{platform.system()} {platform.machine()}",
        **solution.provenance,
    }


def _bounds_in_words(bound: Bounds, met: float) -> str:
    if np.isfinite(bound.norm) and not np.isfinite(bound.growth):
        return f"|mu| + |mu_nat| <= {bound.norm:.4g} a priori, {met:.4g} met"
    if not np.isfinite(bound.norm):
        return f"no a-priori bound (an end couple, or a preference energy that stays low); met: {met:.4g}"
    return (
        f"|mu| + |mu_nat| <= {bound.norm:.4g} a priori, {met:.4g} met; "
        f"two motions part at most like exp({bound.growth:.3g} t)"
    )


def _without_the_limit(solution: Solution) -> str:
    """The status without the sentence that stands under distance."""
    limit = solution.limit
    return str(solution.status) if limit is None else str(solution.status).replace(f" {limit.sentence}", "")


def introduction(solution: Solution) -> str:
    """Return a summary of a solution on a few lines."""
    counts, grid, layout = solution.counts, solution.model.grid, solution.model.layout
    bound, states = solution.bounds, solution.history.y
    met = float(np.sqrt(layout.mu(states) ** 2 @ grid.w).max() + np.abs(layout.natural(states)).max())
    elements = "1 element" if grid.elements == 1 else f"{grid.elements} elements"
    lines = [
        f"status    {_without_the_limit(solution)}",
        f"verdict   {solution.outcome.sentence}",
        f"distance  {solution.outcome.distance}",
        f"ledger    {solution.ledger}",
        f"bounds    {_bounds_in_words(bound, met)}",
        f"method    {solution.method}, rtol {solution.rtol:g}, {grid.per_element} nodes on {elements}; "
        f"{counts.steps} steps, {counts.rates} rates, {counts.jacobians} Jacobians, {counts.restarts} restarts, "
        f"{solution.wall:.3f} s",
        *(f"note      {note}" for note in solution.notes),
        f"see       {REFERENCES[0]}",
    ]
    return safe_text("\n".join(lines))
