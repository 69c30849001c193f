"""What equilibria, spectra and charts come to, as plain values: for the tables and for --json.

Numbers named by a symbol (`alpha`, `gamma`) are dimensionless; those named by words are in the units of the scenario,
which `units` tells.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from plastica.physics.scales import unit_of

if TYPE_CHECKING:
    from plastica.charts.phase import PhaseDiagram
    from plastica.doors.held import Held
    from plastica.equilibria.equilibrium_set import EquilibriumSet
    from plastica.equilibria.spectrum import Spectrum

__all__ = ["capacity_facts", "equilibria_facts", "phase_facts", "spectrum_facts"]

EULER = 0.25 * math.pi**2
KINDS = ("force", "curvature", "length", "drive", "time")


def _head(rod: Held) -> dict[str, Any]:
    return {
        "scenario": rod.file,
        "title": rod.title,
        "units": {kind: unit_of(kind, rod.specimen is None) for kind in KINDS},
    }


def _thrust(rod: Held, gamma: float, source: str = "") -> dict[str, Any]:
    facts = {"thrust": rod.scales.to_si("force", gamma), "gamma": gamma, "over_euler": gamma / EULER}
    return {**facts, "source": source} if source else facts


def _place(rod: Held, alpha: float, mu_nat: float, drive: float) -> dict[str, Any]:
    si = rod.scales.to_si
    return {
        "alpha": alpha,
        "clamp_curvature": si("curvature", alpha),
        "natural_curvature": si("curvature", mu_nat),
        "drive": si("drive", drive),
    }


def standing(point: Any) -> str:
    """Say in a few words what a limiting equilibrium is to the motions near it."""
    if point.kind == "tangency":
        return "tangency: motions slow down here, and may pass"
    if point.unstable > 0:
        return f"saddle: unstable in {point.unstable} direction{'s' if point.unstable > 1 else ''}"
    return "motions end here" if point.attracting else "repelling"


def equilibria_facts(rod: Held, found: EquilibriumSet) -> dict[str, Any]:
    """Return all equilibria under one thrust: intervals, limiting equilibria, folds."""
    si = rod.scales.to_si
    intervals = [
        {"alpha": list(pair), "clamp_curvature": [si("curvature", a) for a in pair]} for pair in found.intervals
    ]
    limiting = [
        {
            **_place(rod, p.alpha, p.mu_nat, p.drive),
            "side": p.side,
            "attracting": p.attracting,
            "unstable": p.unstable,
            "kind": p.kind,
            "rate": p.rate,
            "standing": standing(p),
        }
        for p in found.limiting
    ]
    folds = [
        {**_place(rod, f.alpha, f.mu_nat, f.drive), "kind": f.kind, "admissible": f.admissible} for f in found.folds
    ]
    return {
        **_head(rod),
        "load": _thrust(rod, found.gamma, rod.source),
        "intervals": intervals,
        "limiting": limiting,
        "folds": folds,
        "bounded": found.bounded,
        "complete": found.complete,
        "sentence": found.sentence,
    }


def spectrum_facts(rod: Held, found: Spectrum) -> dict[str, Any]:
    """Return eigenvalues, and what they say of an equilibrium."""
    place = found.equilibrium
    rate = 1.0 / rod.scales.time
    return {
        **_head(rod),
        "load": _thrust(rod, place.gamma, rod.source),
        "equilibrium": {**_place(rod, place.alpha, place.mu_nat, place.drive or 0.0), "admissible": place.admissible},
        "eigenvalues": [
            {"value": float(value), "error": float(error), "rate": float(value) * rate}
            for value, error in zip(found.eigenvalues, found.errors, strict=True)
        ],
        "unstable": found.unstable,
        "gap": found.gap,
        "zero_multiplicity": found.zero_multiplicity,
        "degenerate": found.degenerate,
        "bounds": list(found.bounds),
        "sentence": found.sentence,
    }


def phase_facts(rod: Held, found: PhaseDiagram) -> dict[str, Any]:
    """Return what a phase diagram consists of: components of the limiting set, tangencies, cusps."""
    si = rod.scales.to_si

    def places(points: Any) -> list[dict[str, Any]]:
        return [
            {
                "gamma": p.gamma,
                "thrust": si("force", p.gamma),
                "alpha": p.alpha,
                "natural_curvature": si("curvature", p.mu_nat),
            }
            for p in points
        ]

    components = [
        {
            "kind": c.kind,
            "side": c.side,
            "points": int(c.gamma.size),
            "gamma": [float(c.gamma.min()), float(c.gamma.max())],
            "alpha": [float(c.alpha.min()), float(c.alpha.max())],
            "sentence": str(c),
        }
        for c in found.components
    ]
    return {
        **_head(rod),
        "window": {
            "gamma": [float(found.gamma[0]), float(found.gamma[-1])],
            "thrust": [si("force", float(g)) for g in found.gamma[[0, -1]]],
            "alpha": [float(found.alpha[0]), float(found.alpha[-1])],
        },
        "admissible_share": float(np.mean(found.admissible)),
        "components": components,
        "tangencies": places(found.tangencies),
        "cusps": places(found.cusps),
        "sentence": str(found),
    }


def capacity_facts(rod: Held, found: Any) -> dict[str, Any]:
    """Return the largest imperfections, thrust by thrust, from where any leaves, and the three critical thrusts."""
    si = rod.scales.to_si
    rows = [
        {
            **_thrust(rod, float(gamma)),
            "largest": float(largest),
            "largest_imperfection": si("curvature", float(largest)),
        }
        for gamma, largest in zip(found["gamma"].values, found["largest"].values, strict=True)
    ]
    return {
        **_head(rod),
        "critical": {
            name: _critical(rod, found.attrs.get(name)) for name in ("gamma_star", "gamma_star_star", "euler")
        },
        "leaves_from": _critical(rod, found.attrs["leaves_from"]),
        "rows": rows,
        "imperfection": str(found.attrs.get("imperfection", "natural")),
        "sentence": str(found.attrs["sentence"]),
    }


def _critical(rod: Held, gamma: Any) -> dict[str, float] | None:
    if gamma is None or isinstance(gamma, str) or not math.isfinite(float(gamma)):
        return None
    return _thrust(rod, float(gamma))
