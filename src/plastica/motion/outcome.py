"""The verdict on a motion in words, and how a solution introduces itself."""

from __future__ import annotations

import platform
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from plastica._version import __version__
from plastica.motion.dataset import natural_centre_line
from plastica.physics.bounds import Bounds
from plastica.units import format_quantity

if TYPE_CHECKING:
    from plastica.motion.solution import Solution

__all__ = ["REFERENCES", "Outcome", "introduction", "outcome", "provenance"]

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
    "L. F. Shampine and M. W. Reichelt, The MATLAB ODE suite, SIAM J. Sci. Comput. 18, 1997 (BDF)",
)


@dataclass(frozen=True)
class Outcome:
    """What became of the rod, as far as it was followed.

    Attributes
    ----------
    shape : str
        "straight" (no tangent angle above 0.01 rad), "buckled" (under thrust alone, above 0.1 rad and at least twice
        the angle it began with), or "bent".
    memory : str
        "springs back" (the natural curvature is, to the last bit, what it was at the very first start, and would stay
        so without load) or "permanent set".
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
        Change of the natural curvature from the very first start to when the rod, let go, has come to rest; in the
        user's units.
    set_deflection : float
        What that moves the free end's place of rest across the clamp's tangent, in the user's units.
    excess : float
        |drive| - threshold at the end, in the user's units; positive while the rod yields.
    curvature_rate, natural_rate : float
        Norm of the rate of curvature and rate of the natural curvature at the end, in units of 1/(L T).
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

    What is kept is found by letting the rod go: where loads act at the end, the motion is followed without them until
    its limit can be told, for on the way back a rod may yield again.
    """
    strut, scales = solution.model, solution.model.scales
    n, w = strut.grid.size, strut.grid.w
    last, end = solution.history.y[-1], solution.history.end
    mu, mu_nat = last[:n], float(last[n])
    began, left = solution.first_natural, _left_without_load(solution)
    mu_t, natural_rate = strut.rate(end, mu, mu_nat)
    excess = float(np.abs(strut.drive(mu, mu_nat)) - strut.threshold(mu_nat))
    kept = bool(np.any(solution.history.y[:, n] != began)) or left != began
    memory = "permanent set" if kept else "springs back"
    released = all(program(end) == 0.0 for _, program in strut.loads.items())
    numbers = {
        "set_curvature": (left - began) * scales.curvature,
        "set_deflection": (_rise(left) - _rise(began)) * scales.length,
        "excess": excess * scales.drive,
        "curvature_rate": float(np.sqrt(w @ mu_t**2)),
        "natural_rate": float(natural_rate),
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


def _left_without_load(solution: Solution) -> float:
    """Natural curvature once the rod has been let go; the present one where that cannot be told."""
    from plastica.motion.longtime import limit_without_load

    limit = limit_without_load(solution) if solution.status.ok else None
    now = float(solution.history.y[-1, solution.model.grid.size])
    if limit is None or limit.equilibrium is None:
        return now
    # An interior limit is a natural curvature that never moves again: its bits are those of the last state.
    return limit.equilibrium.mu_nat if limit.kind == "limiting" or abs(limit.equilibrium.mu_nat - now) > 1e-9 else now


def _rise(mu_nat: float) -> float:
    """How far off the clamp's axis the free end of the natural arc is, in L."""
    return float(natural_centre_line(np.array(mu_nat), np.array(1.0))[1])


def _shape(solution: Solution) -> str:
    strut = solution.model
    n = strut.grid.size
    first, last = solution.history.y[0], solution.history.y[-1]
    angle = _largest_angle(solution, last)
    if angle <= STRAIGHT:
        return "straight"
    loads, end = strut.loads, solution.history.end
    thrust_alone = not {"transverse", "couple"} & dict(loads.sources()).keys() and loads.thrust(end) > 0.0
    began = max(_largest_angle(solution, first), abs(float(first[n])))
    return "buckled" if thrust_alone and angle > BENT and angle > 2.0 * began else "bent"


def _largest_angle(solution: Solution, state: np.ndarray) -> float:
    strut = solution.model
    mu = state[: strut.grid.size]
    return max(float(np.abs(strut.angle(mu)).max()), abs(float(strut.grid.w @ mu)))


def _headline(solution: Solution, shape: str, memory: str, released: bool) -> str:
    kept = memory == "permanent set"
    if released and not kept:
        mu = solution.history.y[:, : solution.model.grid.size]
        return "Springs back" if float(np.ptp(mu, axis=0).max()) > ARRIVED else "Stays at rest"
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


def _sentence(solution: Solution, headline: str, memory: str, left: float) -> str:
    strut, began = solution.model, solution.first_natural
    n, last = strut.grid.size, solution.history.y[-1]

    def curvature(value: float) -> str:
        return _show(solution, value, "curvature", "1/m", "/L")

    def length(value: float) -> str:
        return _show(solution, value, "length", "m", "L")

    now = _show(solution, solution.history.end, "time", "s", "retardation times")
    tip = length(float(np.sin(strut.angle(last[:n])) @ strut.grid.w))
    where = f"After {now} the free end is {tip} off the clamp's axis"
    if memory == "springs back":
        return (
            f"{headline}. {where}; the natural curvature has not moved at all, so without load the rod returns to its "
            "first natural shape."
        )
    natural = float(last[n])
    moved = f"the natural curvature has moved from {curvature(began)} to {curvature(natural)}"
    if abs(left - natural) > 1e-4 * max(1.0, abs(left)):
        going = "creeps on" if all(load(solution.history.end) == 0.0 for _, load in strut.loads.items()) else "would go"
        moved += f" and {going} to {curvature(left)} without load"
    off = length(_rise(left) - _rise(began))
    return (
        f"{headline}. {where}; {moved}. Without load the free end comes to rest {off} away from where it did at first."
    )


def _distance(solution: Solution, excess: float, numbers: dict[str, float]) -> str:
    strut = solution.model
    n = strut.grid.size
    threshold = float(strut.threshold(float(solution.history.y[-1][n])))
    speed, natural = numbers["curvature_rate"], abs(numbers["natural_rate"])
    rates = "Nothing moves any more that double precision could show."
    if max(speed, natural) > STILL:
        rates = f"The curvature still changes at {speed:.1e} and the natural curvature at {natural:.1e}, in 1/(L T)."
    amount = _show(solution, abs(excess), "drive", "N*m**2", "EI")
    share = f"{abs(excess) / threshold:.2g} of it" if threshold > 0.0 else "of no size"
    if excess <= 0.0:
        return (
            f"The drive is within its threshold, by {amount} ({share}): while that lasts the natural curvature "
            f"stays as it is and the rest of the way is visco-elastic. {rates}"
        )
    return (
        f"The drive is still above its threshold, by {amount} ({share}): the natural curvature goes on moving. {rates}"
    )


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
    counts, grid = solution.counts, solution.model.grid
    bound = solution.bounds
    n = grid.size
    met = float(np.sqrt(solution.history.y[:, :n] ** 2 @ grid.w).max() + np.abs(solution.history.y[:, n]).max())
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
    return "\n".join(lines)
