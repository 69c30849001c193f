"""What a finished run comes to, as plain values: for the table at its end and for --json."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from plastica.physics.scales import unit_of
from plastica.units import format_quantity

if TYPE_CHECKING:
    from plastica.motion.solution import Solution
    from plastica.physics.strut import Strut
    from plastica.study.scenario import Scenario

__all__ = ["check_facts", "clean", "result_facts", "shown"]


def clean(value: Any) -> Any:
    """Return plain values that JSON has words for: numbers that are not finite become null."""
    if isinstance(value, dict):
        return {str(key): clean(each) for key, each in value.items()}
    if isinstance(value, list | tuple):
        return [clean(each) for each in value]
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return str(value) if isinstance(value, Path) else value


def shown(value: float, unit: str) -> str:
    """Write a number for people, with its unit."""
    return f"{value:.4g}" if unit in ("", "1") else format_quantity(value, unit)


def result_facts(solution: Solution) -> dict[str, Any]:
    """Return what became of a rod, in the units of its scenario."""
    from plastica.show.words import how_it_ended

    outcome, ledger, strut, scales = solution.outcome, solution.ledger, solution.model, solution.model.scales
    unit = {kind: unit_of(kind, strut.specimen is None) for kind in ("time", "curvature", "length")}
    # The result may be asked for at a few times only; the story is told from its first to its last state.
    first, last, n = solution.history.y[0], solution.history.y[-1], strut.grid.size
    theta = strut.angle(last[:n])
    return {
        "title": solution.provenance.get("title", ""),
        "status": {"ok": solution.status.ok, "code": solution.status.code, "sentence": how_it_ended(solution)},
        "verdict": {"headline": outcome.headline, "sentence": outcome.sentence, "distance": outcome.distance},
        "time": {"end": solution.history.end * scales.time, "unit": unit["time"]},
        "natural_curvature": {
            "start": float(first[n]) * scales.curvature,
            "end": float(last[n]) * scales.curvature,
            "unit": unit["curvature"],
        },
        "tip": {
            "x": float(np.cos(theta) @ strut.grid.w) * scales.length,
            "y": float(np.sin(theta) @ strut.grid.w) * scales.length,
            "unit": unit["length"],
        },
        "ledger": {
            "residual": ledger.residual,
            "work": ledger.work,
            "stored_energy": ledger.stored_energy,
            "viscous_dissipation": ledger.viscous_dissipation,
            "natural_dissipation": ledger.natural_dissipation,
            "largest_energy": ledger.largest_energy,
            "unit": ledger.unit,
        },
        "steps": solution.counts.steps,
        "nodes": solution.model.grid.size,
        "method": solution.method,
        "rtol": solution.rtol,
        "notes": list(solution.notes),
    }


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
            "retardation_times": None if plan.settle else plan.end - plan.t0,
            "method": plan.method,
            "rtol": plan.rtol,
            "nodes": model.grid.nodes,
            "elements": scenario.problem.strut.grid.elements,
            "landings": _landings(model, plan.end),
            "times": None if scenario.times is None else len(scenario.times),
        },
        "notes": list(scenario.problem.notes),
    }


def _groups(scenario: Scenario) -> dict[str, float]:
    """The dimensionless numbers that decide what happens; loads at their largest, drive at the start."""
    strut, y = scenario.problem.strut, scenario.problem.y0
    n = strut.grid.size
    natural = float(y[n])
    thrust = max(strut.loads.thrust.extreme(scenario.plan.end))
    return {
        "thrust_over_EI_per_L2": float(thrust),
        "thrust_over_euler": float(thrust) / (math.pi**2 / 4.0),
        "threshold_over_EI": float(strut.threshold(natural)),
        "drive_over_threshold_at_start": float(strut.drive(y[:n], natural) / strut.threshold(natural)),
        "natural_curvature_times_L": natural,
    }


def _landings(model: Strut, end: float) -> int:
    from plastica.motion.itinerary import landing_points

    return len(landing_points(model, end))
