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
        "springs back" (the natural curvature is, to the last bit, what it was) or "permanent set".
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
        Change of the natural curvature, in the user's units.
    set_deflection : float
        How far off the free end's natural place has moved across the clamp's tangent, in the user's units.
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
    """Judge the last state of a solution."""
    strut, scales = solution.model, solution.model.scales
    n, w = strut.grid.size, strut.grid.w
    first, last, end = solution.history.y[0], solution.history.y[-1], solution.history.end
    mu, mu_nat = last[:n], float(last[n])
    began = float(first[n])
    mu_t, natural_rate = strut.rate(end, mu, mu_nat)
    excess = float(np.abs(strut.drive(mu, mu_nat)) - strut.threshold(mu_nat))
    shape = _shape(solution)
    memory = "springs back" if np.all(solution.history.y[:, n] == began) else "permanent set"
    released = all(program(end) == 0.0 for _, program in strut.loads.items())
    set_deflection = float(natural_centre_line(np.array(mu_nat), np.array(1.0))[1])
    set_deflection -= float(natural_centre_line(np.array(began), np.array(1.0))[1])
    numbers = {
        "set_curvature": (mu_nat - began) * scales.curvature,
        "set_deflection": set_deflection * scales.length,
        "excess": excess * scales.drive,
        "curvature_rate": float(np.sqrt(w @ mu_t**2)),
        "natural_rate": float(natural_rate),
    }
    headline = _headline(shape, memory, released)
    return Outcome(
        shape,
        memory,
        released,
        excess <= 0.0,
        headline,
        _sentence(solution, headline, memory, numbers),
        _distance(solution, excess, numbers) + _end(solution),
        **numbers,
    )


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


def _headline(shape: str, memory: str, released: bool) -> str:
    kept = memory == "permanent set"
    if released:
        return "Takes a permanent set" if kept else "Springs back"
    doing = {"straight": "Stays straight", "buckled": "Buckles", "bent": "Bends"}[shape]
    if kept:
        return f"{doing} and takes a permanent set"
    return doing if shape == "straight" else f"{doing}, but would spring back"


def _show(solution: Solution, value: float, unit: str, dimensionless: str) -> str:
    if solution.model.specimen is None:
        return f"{value:.4g} {dimensionless}".strip()
    return format_quantity(value, unit)


def _sentence(solution: Solution, headline: str, memory: str, numbers: dict[str, float]) -> str:
    strut, scales = solution.model, solution.model.scales
    now = _show(solution, solution.history.end * scales.time, "s", "retardation times")
    n = strut.grid.size
    last = solution.history.y[-1]
    tip = _show(
        solution,
        float(np.sin(strut.angle(last[:n])) @ strut.grid.w) * scales.length,
        "m",
        "L",
    )
    where = f"After {now} the free end is {tip} off the clamp's axis"
    if memory == "springs back":
        back = "the natural curvature has not moved at all, so without load the rod returns to its first natural shape"
        return f"{headline}. {where}; {back}."
    value = _show(solution, float(last[n]) * scales.curvature, "1/m", "/L")
    change = _show(solution, numbers["set_curvature"], "1/m", "/L")
    off = _show(solution, numbers["set_deflection"], "m", "L")
    return (
        f"{headline}. {where}; the natural curvature has moved by {change} to {value}, so without load the free end "
        f"would come to rest {off} away from where it would have before."
    )


def _distance(solution: Solution, excess: float, numbers: dict[str, float]) -> str:
    strut, scales = solution.model, solution.model.scales
    n = strut.grid.size
    threshold = float(strut.threshold(float(solution.history.y[-1][n])))
    speed, natural = numbers["curvature_rate"], abs(numbers["natural_rate"])
    rates = "Nothing moves any more that double precision could show."
    if max(speed, natural) > STILL:
        rates = f"The curvature still changes at {speed:.1e} and the natural curvature at {natural:.1e}, in 1/(L T)."
    amount = _show(solution, abs(excess) * scales.drive, "N*m**2", "EI")
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


def introduction(solution: Solution) -> str:
    """Return a summary of a solution on a few lines."""
    counts, grid = solution.counts, solution.model.grid
    bound = solution.bounds
    n = grid.size
    met = float(np.sqrt(solution.history.y[:, :n] ** 2 @ grid.w).max() + np.abs(solution.history.y[:, n]).max())
    elements = "1 element" if grid.elements == 1 else f"{grid.elements} elements"
    lines = [
        f"status    {solution.status}",
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
