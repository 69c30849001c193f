"""A solution as labelled arrays: every quantity of the design's table, in the user's units."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from plastica.physics.ledger import entropy_rate, potential, stored_energy
from plastica.physics.scales import Scales, unit_of

if TYPE_CHECKING:
    import xarray

    from plastica.motion.solution import Solution

__all__ = ["VARIABLES", "dataset", "natural_centre_line"]

Array = NDArray[np.float64]

FIELD, SERIES = ("t", "s"), ("t",)

VARIABLES: dict[str, tuple[tuple[str, ...], str, str]] = {
    "curvature": (FIELD, "curvature", "curvature of the centre line"),
    "angle": (FIELD, "angle", "tangent angle of the centre line"),
    "x": (FIELD, "length", "centre line, along the clamp's tangent"),
    "y": (FIELD, "length", "centre line, across the clamp's tangent"),
    "couple": (FIELD, "couple", "contact couple"),
    "shear": (FIELD, "force", "shear force"),
    "tension": (FIELD, "force", "tension (negative: compression)"),
    "natural_x": (FIELD, "length", "natural configuration, along the clamp's tangent"),
    "natural_y": (FIELD, "length", "natural configuration, across the clamp's tangent"),
    "entropy_rate": (FIELD, "entropy_rate", "local entropy production rate"),
    "natural_curvature": (SERIES, "curvature", "natural curvature"),
    "drive": (SERIES, "drive", "driving force on the natural curvature"),
    "threshold": (SERIES, "drive", "threshold that the drive must exceed"),
    "tip_x": (SERIES, "length", "free end, along the clamp's tangent"),
    "tip_y": (SERIES, "length", "free end, across the clamp's tangent"),
    "tip_angle": (SERIES, "angle", "tangent angle at the free end"),
    "liapunov": (SERIES, "energy", "Liapunov function: stored energy plus potential of the loads"),
    "stored_energy": (SERIES, "energy", "stored energy"),
    "work": (SERIES, "energy", "work of the loads since the start"),
    "viscous_dissipation": (SERIES, "energy", "viscous dissipation since the start"),
    "natural_dissipation": (SERIES, "energy", "dissipation by the natural curvature since the start"),
    "entropy_production": (SERIES, "entropy", "total entropy production since the start"),
    "volume_fraction": (SERIES, "ratio", "volume fraction of the product phase"),
    "thrust": (SERIES, "force", "thrust at the free end"),
    "transverse": (SERIES, "force", "transverse force at the free end"),
    "end_couple": (SERIES, "couple", "couple at the free end"),
    "weight": (SERIES, "distributed", "weight per length, toward the clamp"),
}
"""Name -> (dimensions, kind of quantity, words)."""


def dataset(solution: Solution) -> xarray.Dataset:
    """Return all variables of a solution over its times and nodes (design note, section 4).

    Coordinates are `t` and `s`, with the quadrature weights `s_weight`. Without a temperature, entropies are given
    times the temperature; only a material with three preferred shapes has a volume fraction.
    """
    import xarray

    strut, scales = solution.model, solution.model.scales
    dimensionless = strut.specimen is None
    values = _values(solution)
    coordinates = {
        "t": (
            "t",
            solution.t * scales.time if solution.times is None else solution.times,
            _label("time", "time", dimensionless, scales),
        ),
        "s": (
            "s",
            strut.grid.s * scales.length,
            _label("length", "arc length from the clamp", dimensionless, scales),
        ),
        "s_weight": (
            "s",
            strut.grid.w * scales.length,
            _label("length", "quadrature weight of the node", dimensionless, scales),
        ),
    }
    data = {}
    for name, (dims, kind, words) in VARIABLES.items():
        if name in values:
            data[name] = (
                dims,
                values[name] * _scale(kind, scales),
                _label(kind, words, dimensionless, scales),
            )
    return xarray.Dataset(data, coords=coordinates, attrs=attributes(solution))


def _values(solution: Solution) -> dict[str, Array]:
    """Every variable, dimensionless."""
    strut, t, y = solution.model, solution.t, solution.y
    n = strut.grid.size
    mu, mu_nat, ledger = y[:, :n], y[:, n], y[:, n + 1 :]
    w, A = strut.grid.w, strut.grid.A
    theta = strut.angle(mu)
    cos, sin = np.cos(theta), np.sin(theta)
    tension, shear = strut.force(t, theta)
    natural_x, natural_y = natural_centre_line(mu_nat[:, None], strut.grid.s)
    stored = stored_energy(strut, mu, mu_nat)
    values = {
        "curvature": mu,
        "angle": theta,
        "x": cos @ A.T,
        "y": sin @ A.T,
        "couple": strut.couple(t, mu),
        "shear": shear,
        "tension": tension,
        "natural_x": natural_x,
        "natural_y": natural_y,
        "entropy_rate": entropy_rate(strut, t, mu, mu_nat),
        "natural_curvature": mu_nat,
        "drive": strut.drive(mu, mu_nat),
        "threshold": strut.threshold(mu_nat),
        "tip_x": cos @ w,
        "tip_y": sin @ w,
        "tip_angle": mu @ w,
        "liapunov": stored + potential(strut, t, mu),
        "stored_energy": stored,
        "work": ledger[:, 0],
        "viscous_dissipation": ledger[:, 1],
        "natural_dissipation": ledger[:, 2],
        "entropy_production": ledger[:, 1] + ledger[:, 2],
    }
    well = strut.material.well
    if well is not None:
        values["volume_fraction"] = mu_nat / (well * strut.scales.length)
    for name, program in strut.loads.items():
        values["end_couple" if name == "couple" else name] = np.asarray(program(t), dtype=float)
    return values


def natural_centre_line(mu_nat: Array, s: Array) -> tuple[Array, Array]:
    """Arc of curvature mu_nat, (sin(m s)/m, (1 - cos(m s))/m), without loss where m is small (paper, section 2.1)."""
    half = 0.5 * mu_nat * s
    chord = s * np.sinc(half / np.pi)
    return chord * np.cos(half), chord * np.sin(half)


def _scale(kind: str, scales: Scales) -> float:
    if kind == "entropy":
        return scales.energy / (scales.temperature or 1.0)
    return float(getattr(scales, kind))


def _label(kind: str, words: str, dimensionless: bool, scales: Scales) -> dict[str, str]:
    thermal = scales.temperature is not None
    if kind == "entropy":
        unit = "1" if dimensionless else ("J/K" if thermal else "J")
    else:
        unit = unit_of(kind, dimensionless, thermal=thermal)
    if kind.startswith("entropy") and (dimensionless or not thermal):
        words += " times temperature"
    return {"units": unit, "long_name": words}


def attributes(solution: Solution) -> dict[str, str | int | float]:
    """What a reader of the file must know: how it was computed and how it ended."""
    from plastica.motion.outcome import REFERENCES, provenance

    return {
        "title": solution.provenance.get("title", "motion of a rod whose natural curvature evolves"),
        "conventions": "dimensionless: lengths in L, forces in EI/L^2, times in the retardation time"
        if solution.model.specimen is None
        else "SI",
        "status": solution.status.code,
        "status_sentence": solution.status.sentence,
        "verdict": solution.outcome.sentence,
        "references": "; ".join(REFERENCES),
        **provenance(solution),
    }
