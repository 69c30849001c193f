"""What a finished run comes to, as plain values: for the table at its end and for --json."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from plastica.physics.rod import Rod
from plastica.physics.scales import unit_of
from plastica.units import format_quantity

if TYPE_CHECKING:
    from plastica.motion.solution import Solution
    from plastica.physics.model import Model
    from plastica.study.scenario import Scenario

__all__ = ["check_facts", "clean", "result_facts", "shown"]


MOST_SHOWN = 8
"""Segments whose natural curvatures are told one by one."""


def clean(value: Any) -> Any:
    """Return plain values that JSON has words for: numbers that are not finite become null."""
    if isinstance(value, dict):
        return {str(key): clean(each) for key, each in value.items()}
    if isinstance(value, list | tuple):
        return [clean(each) for each in value]
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return str(value) if isinstance(value, Path) else value


def shown(value: float | list[float], unit: str) -> str:
    """Write a number for people, with its unit; of many, one for each segment, all, or the least and the greatest."""
    if isinstance(value, list):
        if min(value) == max(value):
            return f"{shown(value[0], unit)} on each of {len(value)} segments"
        if len(value) > MOST_SHOWN:
            return f"{shown(min(value), unit)} to {shown(max(value), unit)} ({len(value)} segments)"
        return ", ".join(shown(each, unit) for each in value)
    return f"{value:.4g}" if unit in ("", "1") else format_quantity(value, unit)


def result_facts(solution: Solution) -> dict[str, Any]:
    """Return what became of a rod, in the units of its scenario."""
    from plastica.show.checks import allowed
    from plastica.show.words import how_it_ended

    outcome, ledger, strut, scales = solution.outcome, solution.ledger, solution.model, solution.model.scales
    unit = {kind: unit_of(kind, strut.specimen is None) for kind in ("time", "curvature", "length")}
    # The result may be asked for at a few times only; the story is told from its first to its last state.
    first, last, layout = solution.history.y[0], solution.history.y[-1], strut.layout
    theta = strut.angle(layout.mu(last))
    return {
        "title": solution.provenance.get("title", ""),
        "status": {"ok": solution.status.ok, "code": solution.status.code, "sentence": how_it_ended(solution)},
        "verdict": {"headline": outcome.headline, "sentence": outcome.sentence, "distance": outcome.distance},
        "time": {"end": solution.history.end * scales.time, "unit": unit["time"]},
        "natural_curvature": {
            "start": _plain(layout.natural(first) * scales.curvature),
            "end": _plain(layout.natural(last) * scales.curvature),
            "unit": unit["curvature"],
        },
        "tip": {
            "x": float(np.cos(theta) @ strut.grid.w) * scales.length,
            "y": float(np.sin(theta) @ strut.grid.w) * scales.length,
            "unit": unit["length"],
        },
        "ledger": {
            "residual": ledger.residual,
            "balances": abs(ledger.residual) <= allowed(solution),
            "work": ledger.work,
            "stored_energy": ledger.stored_energy,
            "viscous_dissipation": ledger.viscous_dissipation,
            "natural_dissipation": ledger.natural_dissipation,
            "kinetic_energy": ledger.kinetic_energy,
            "largest_energy": ledger.largest_energy,
            "unit": ledger.unit,
        },
        "steps": solution.counts.steps,
        "nodes": solution.model.grid.size,
        "method": solution.method,
        "rtol": solution.rtol,
        **_swing(solution),
        "notes": list(solution.notes),
    }


def _swing(solution: Solution) -> dict[str, Any]:
    """How a rod with inertia moves and pulls at its clamp, at the times of its result."""
    # A run that failed early may have met none of the times asked for.
    if not isinstance(solution.model, Rod) or solution.t.size == 0:
        return {}
    data = solution.dataset
    energy, couple = data["kinetic_energy"], data["clamp_couple"]
    force = np.hypot(data["clamp_force_x"].values, data["clamp_force_y"].values)
    return {
        "kinetic_energy": {
            "end": float(energy.values[-1]),
            "largest": float(energy.values.max()),
            "unit": energy.attrs["units"],
        },
        "clamp": {
            "largest_force": float(force.max()),
            "force_unit": data["clamp_force_x"].attrs["units"],
            "largest_couple": float(np.abs(couple.values).max()),
            "couple_unit": couple.attrs["units"],
        },
    }


def _plain(values: ArrayLike) -> Any:
    """Return a number, or a list of those of several segments."""
    return np.asarray(values).tolist()


def check_facts(scenario: Scenario) -> dict[str, Any]:
    """Return what was understood of a scenario: its dimensionless groups, material and plan."""
    model, plan = scenario.model, scenario.plan
    return {
        "scenario": scenario.file,
        "title": scenario.title,
        "accepted": True,
        "units": "SI" if model.specimen is not None else "dimensionless",
        "groups": _groups(scenario),
        "loads": model.load.describe(si=model.specimen is not None),
        "initial_curvature": scenario.problem.words,
        "material": {
            "name": model.material.name,
            "preference": model.material.preference,
            "flow": model.material.flow,
            "threshold": model.material.threshold,
            "parameters": dict(model.material.parameters),
        },
        "admissibility": [
            {"name": each.name, "holds": each.holds, "margin": each.margin, "sentence": each.sentence}
            for each in scenario.verdicts
        ],
        "plan": {
            "until": scenario.until,
            "retardation_times": None if plan.settle or model.damping != 1.0 else plan.end - plan.t0,
            "time_units": None if plan.settle else plan.end - plan.t0,
            "method": plan.method,
            "rtol": plan.rtol,
            "nodes": model.grid.nodes,
            "elements": scenario.problem.strut.grid.elements,
            "landings": _landings(model, plan.end),
            "times": None if scenario.times is None else len(scenario.times),
        },
        "notes": list(scenario.problem.notes),
    }


_LOAD_SCALES = {"transverse": "EI_per_L2", "couple": "EI_per_L", "weight": "EI_per_L3"}


def _largest(bounds: tuple[float, float]) -> float:
    """Return the one of two bounds that is larger in magnitude."""
    least, most = bounds
    return float(most if most >= -least else least)


def _groups(scenario: Scenario) -> dict[str, Any]:
    """The dimensionless numbers that decide what happens; loads at their largest, drive at the start."""
    model, y = scenario.problem.strut, scenario.problem.y0
    mu, natural = model.layout.mu(y), model.layout.natural(y)
    thrust = _largest(model.loads.thrust.extreme(scenario.plan.end))
    others = {
        f"{name}_over_{_LOAD_SCALES[name]}": abs(_largest(program.extreme(scenario.plan.end)))
        for name, program in model.loads.sources()
        if name in _LOAD_SCALES
    }
    threshold = model.threshold(natural)
    groups = {
        "thrust_over_EI_per_L2": thrust,
        "thrust_over_euler": thrust / (math.pi**2 / 4.0),
        **others,
        "threshold_over_EI": _plain(threshold),
        "drive_over_threshold_at_start": _plain(model.drive(mu, natural) / threshold),
        "natural_curvature_times_L": _plain(natural),
    }
    return groups | _inertia(model)


def _inertia(model: Model) -> dict[str, Any]:
    """The dimensionless numbers of a rod with inertia."""
    if not isinstance(model, Rod):
        return {}
    return {
        "translational_inertia": model.translational_inertia,
        "rotary_inertia": model.rotary_inertia,
        "damping": model.damping,
        "time_unit": model.scales.time,
    }


def _landings(model: Model, end: float) -> int:
    from plastica.motion.itinerary import landing_points

    return len(landing_points(model, end))
