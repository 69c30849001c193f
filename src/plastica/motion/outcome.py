"""The verdict on a motion in words, and how a solution introduces itself."""

from __future__ import annotations

import platform
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from plastica._version import __version__
from plastica.errors import safe_text
from plastica.motion.dataset import natural_shape
from plastica.physics.bounds import Bounds
from plastica.physics.ledger import rates
from plastica.physics.model import Model
from plastica.units import format_quantity

if TYPE_CHECKING:
    from plastica.motion.solution import Solution

__all__ = ["REFERENCES", "Outcome", "introduction", "outcome", "provenance", "unjudged"]

STRAIGHT = 0.01
"""Largest tangent angle (rad) of a rod that counts as straight: about half a degree."""

BENT = 0.1
"""Tangent angle (rad) beyond which a rod under thrust that has also grown twofold counts as buckled."""

STILL = 1e-15
"""Rate, in 1/(L T), below which rounding hides all motion."""

ARRIVED = 1e-12
"""Distance from the limit, in 1/L, that is no distance in double precision."""

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
        clamp, above 0.1 rad and at least twice the angle it began with), or "bent"; "not judged" where judging failed.
    memory : str
        "springs back" (the natural curvature is, to the last bit, what it was at the very first start, and would stay
        so without load), "permanent set", or "not judged".
    released : bool
        Whether no load acts at the end.
    resting : bool
        Whether the drive is within its threshold at the end, so that the natural curvature no longer moves.
    headline : str
        The verdict in a few words.
    sentence : str
        The verdict in one sentence with numbers.
    distance : str
        How far the last state is from where it will end, and where that is as far as it can be told.
    set_curvature : float
        Change of the natural curvature, with several segments of its mean along the rod, from the very first start to
        when the rod, let go, has come to rest; in the user's units.
    set_deflection : float
        What that moves the free end's place of rest across the clamp's tangent, in the user's units.
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
    way back it may yield again.
    """
    from plastica.motion.longtime import natural_without_load

    strut, scales, layout = solution.model, solution.model.scales, solution.model.layout
    last, end = solution.history.y[-1], solution.history.end
    mu, mu_nat = layout.mu(last), layout.natural(last)
    began, left = solution.first_natural, natural_without_load(solution)
    mu_t, natural_rate = rates(strut, end, mu, mu_nat, layout.mu_t(last))
    excess = float((np.abs(strut.drive(mu, mu_nat)) - strut.threshold(mu_nat)).max())
    kept = bool(np.any(layout.natural(solution.history.y) != began) or np.any(left != began))
    memory = "permanent set" if kept else "springs back"
    released = all(program(end) == 0.0 for _, program in strut.loads.items())
    numbers = {
        "set_curvature": float(strut.division.total(left - began)) * scales.curvature,
        "set_deflection": (_rise(strut, left) - _rise(strut, began)) * scales.length,
        "excess": excess * scales.drive,
        "curvature_rate": float(np.sqrt(strut.grid.w @ mu_t**2)),
        "natural_rate": float(np.ravel(natural_rate)[np.abs(natural_rate).argmax()]),
    }
    shape = _shape(solution)
    headline = _headline(solution, shape, memory, released)
    return Outcome(
        shape,
        memory,
        released,
        excess <= 0.0,
        headline,
        _sentence(solution, headline, memory, left),
        _distance(solution, excess, numbers) + _end(solution),
        **numbers,
    )


def unjudged(error: Exception) -> Outcome:
    """Return the verdict on a motion that cannot be judged, because of an error: what was computed stands."""
    why = f"{type(error).__name__}: {error}".split("\n")[0][:200]
    sentence = f"The verdict could not be reached ({why}); the motion itself is computed and kept."
    distance = "How far it is from rest could not be told either."
    nan = float("nan")
    return Outcome("not judged", "not judged", False, False, "Not judged", sentence, distance, nan, nan, nan, nan, nan)


def _rise(model: Model, mu_nat: np.ndarray) -> float:
    """How far off the clamp's axis the free end of the natural configuration is, in L."""
    return float(natural_shape(model, np.asarray(mu_nat), np.array([1.0]))[1].item())


def _shape(solution: Solution) -> str:
    strut = solution.model
    first, last = solution.history.y[0], solution.history.y[-1]
    angle = float(strut.largest_angle(strut.layout.mu(last)))
    if angle <= STRAIGHT:
        return "straight"
    loads, end = strut.loads, solution.history.end
    across = {"transverse", "couple", *(("weight",) if loads.weight_direction[1] else ())}
    thrust_alone = not across & dict(loads.sources()).keys() and loads.thrust(end) > 0.0
    began = max(float(strut.largest_angle(strut.layout.mu(first))), float(np.abs(strut.layout.natural(first)).max()))
    return "buckled" if thrust_alone and angle > BENT and angle > 2.0 * began else "bent"


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


def _sentence(solution: Solution, headline: str, memory: str, left: np.ndarray) -> str:
    strut, began = solution.model, solution.first_natural
    last = solution.history.y[-1]

    off = _rise(strut, left) - _rise(strut, began)

    def curvature(value: float) -> str:
        return _show(solution, value, "curvature", "1/m", "/L")

    def length(value: float) -> str:
        return _show(solution, value, "length", "m", "L")

    now = _show(solution, solution.history.end, "time", "s", strut.time_unit)
    tip = length(float(np.sin(strut.angle(strut.layout.mu(last))) @ strut.grid.w))
    where = f"After {now} the free end is {tip} off the clamp's axis"
    if memory == "springs back":
        ends = "returns to" if strut.damping > 0.0 else "swings about"
        ends = "keeps" if headline == "Stays at rest" else ends
        return (
            f"{headline}. {where}; the natural curvature has not moved at all, so without load the rod {ends} its "
            "first natural shape."
        )
    values = np.atleast_1d(began), np.atleast_1d(strut.layout.natural(last)), np.atleast_1d(left)
    farthest = int(np.abs(values[2] - values[0]).argmax())
    first, natural, end = (float(each[farthest]) for each in values)
    which = f" of segment {farthest + 1}, which moves most," if strut.segments > 1 else ""
    moved = f"the natural curvature{which} has moved from {curvature(first)} to {curvature(natural)}"
    if abs(end - natural) > 1e-4 * max(1.0, abs(end)):
        going = "creeps on" if all(load(solution.history.end) == 0.0 for _, load in strut.loads.items()) else "would go"
        moved += f" and {going} to {curvature(end)} without load"
    if strut.damping == 0.0:
        return (
            f"{headline}. {where}; {moved}. Without load the free end swings about a place {length(off)} away from the "
            "first."
        )
    return (
        f"{headline}. {where}; {moved}. Without load the free end comes to rest {length(off)} away from where it did "
        "at first."
    )


def _distance(solution: Solution, excess: float, numbers: dict[str, float]) -> str:
    strut, last = solution.model, solution.history.y[-1]
    mu_nat = strut.layout.natural(last)
    thresholds = np.atleast_1d(strut.threshold(mu_nat))
    nearest = int(np.argmax(np.abs(strut.drive(strut.layout.mu(last), mu_nat)) - thresholds))
    threshold = float(thresholds[nearest])
    speed, natural = numbers["curvature_rate"], abs(numbers["natural_rate"])
    rates = "Nothing moves any more that double precision could show."
    if max(speed, natural) > STILL:
        rates = f"The curvature still changes at {speed:.1e} and the natural curvature at {natural:.1e}, in 1/(L T)."
    amount = _show(solution, abs(excess), "drive", "N*m**2", "EI")
    ratio = abs(excess) / threshold if threshold > 0.0 else float("inf")
    share = f"{ratio:.2g} {'of' if ratio < 1.0 else 'times'} it" if np.isfinite(ratio) else "of no size"
    several = strut.segments > 1
    if excess <= 0.0:
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
