"""A solution as labelled arrays: every quantity of the design's table, in the user's units."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from plastica.physics.ledger import entropy_rate, kinetic_energy, potential, stored_energy
from plastica.physics.model import Model
from plastica.physics.rod import Rod
from plastica.physics.scales import Scales, unit_of

if TYPE_CHECKING:
    import xarray

    from plastica.motion.solution import Solution

__all__ = ["VARIABLES", "dataset", "natural_centre_line", "natural_shape"]

Array = NDArray[np.float64]

FIELD, SERIES, PIECES = ("t", "s"), ("t",), ("t", "segment")

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
    "velocity_x": (FIELD, "velocity", "velocity along the clamp's tangent"),
    "velocity_y": (FIELD, "velocity", "velocity across the clamp's tangent"),
    "natural_curvature": (PIECES, "curvature", "natural curvature"),
    "drive": (PIECES, "drive", "driving force on the natural curvature"),
    "threshold": (PIECES, "drive", "threshold that the drive must exceed"),
    "tip_x": (SERIES, "length", "free end, along the clamp's tangent"),
    "tip_y": (SERIES, "length", "free end, across the clamp's tangent"),
    "tip_angle": (SERIES, "angle", "tangent angle at the free end"),
    "liapunov": (SERIES, "energy", "Liapunov function: stored and kinetic energy plus potential of the loads"),
    "stored_energy": (SERIES, "energy", "stored energy"),
    "work": (SERIES, "energy", "work of the loads since the start"),
    "viscous_dissipation": (SERIES, "energy", "viscous dissipation since the start"),
    "natural_dissipation": (SERIES, "energy", "dissipation by the natural curvature since the start"),
    "entropy_production": (SERIES, "entropy", "total entropy production since the start"),
    "kinetic_energy": (SERIES, "energy", "kinetic energy"),
    "clamp_force_x": (SERIES, "force", "force of the rod on the clamp, along the clamp's tangent"),
    "clamp_force_y": (SERIES, "force", "force of the rod on the clamp, across the clamp's tangent"),
    "clamp_couple": (SERIES, "couple", "couple of the rod on the clamp"),
    "volume_fraction": (PIECES, "ratio", "volume fraction of the product phase"),
    "thrust": (SERIES, "force", "thrust at the free end"),
    "transverse": (SERIES, "force", "transverse force at the free end"),
    "end_couple": (SERIES, "couple", "couple at the free end"),
    "weight": (SERIES, "distributed", "weight per length"),
}
"""Name -> (dimensions, kind of quantity, words). Where the rod has one segment, the dimension `segment` is left out."""


def dataset(solution: Solution) -> xarray.Dataset:
    """Return all variables of a solution over its times and nodes (design note, section 4).

    Coordinates are `t` and `s`, with the quadrature weights `s_weight`, and with several segments of natural curvature
    `segment` (1 is at the clamp) with its ends `segment_start` and `segment_end`. Without a temperature, entropies are
    given times the temperature; only a material with three preferred shapes has a volume fraction, and only a `Rod`
    velocities, kinetic energy and forces on the clamp.
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
    coordinates |= _segments(strut, _label("length", "", dimensionless, scales)["units"])
    data = {}
    for name, (dims, kind, words) in VARIABLES.items():
        if name in values:
            data[name] = (
                dims[: values[name].ndim],
                values[name] * _scale(kind, scales),
                _label(kind, words, dimensionless, scales),
            )
    return xarray.Dataset(data, coords=coordinates, attrs=attributes(solution))


def _segments(strut: Model, unit: str) -> dict[str, Any]:
    """Coordinates of the segments where there are several."""
    if strut.segments == 1:
        return {}
    ends = np.asarray(strut.division.breaks) * strut.scales.length
    return {
        "segment": ("segment", np.arange(1, strut.segments + 1), {"units": "1", "long_name": "segment from the clamp"}),
        "segment_start": ("segment", ends[:-1], {"units": unit, "long_name": "arc length at which the segment starts"}),
        "segment_end": ("segment", ends[1:], {"units": unit, "long_name": "arc length at which the segment ends"}),
    }


def _values(solution: Solution) -> dict[str, Array]:
    """Every variable, dimensionless."""
    strut, layout, t, y = solution.model, solution.model.layout, solution.t, solution.y
    mu, mu_nat, mu_t, ledger = layout.mu(y), layout.natural(y), layout.mu_t(y), layout.ledger(y)
    w, A = strut.grid.w, strut.grid.A
    theta = strut.angle(mu)
    cos, sin = np.cos(theta), np.sin(theta)
    tension, shear = strut.force(t, theta)
    natural_x, natural_y = natural_shape(strut, mu_nat, strut.grid.s)
    stored = stored_energy(strut, mu, mu_nat)
    kinetic = kinetic_energy(strut, mu, mu_t)
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
        "entropy_rate": entropy_rate(strut, t, mu, mu_nat, mu_t),
        "natural_curvature": mu_nat,
        "drive": strut.drive(mu, mu_nat),
        "threshold": strut.threshold(mu_nat),
        "tip_x": cos @ w,
        "tip_y": sin @ w,
        "tip_angle": mu @ w,
        "liapunov": stored + potential(strut, t, mu) + kinetic,
        "stored_energy": stored,
        "work": ledger[:, 0],
        "viscous_dissipation": ledger[:, 1],
        "natural_dissipation": ledger[:, 2],
        "entropy_production": ledger[:, 1] + ledger[:, 2],
    }
    if isinstance(strut, Rod):
        values |= _inertial(strut, t, mu, mu_nat, mu_t) | {"kinetic_energy": kinetic}
    well = strut.material.well
    if well is not None:
        values["volume_fraction"] = mu_nat / (well * strut.scales.length)
    for name, program in strut.loads.items():
        values["end_couple" if name == "couple" else name] = np.asarray(program(t), dtype=float)
    return values


def _inertial(rod: Rod, t: Array, mu: Array, mu_nat: Array, mu_t: Array | None) -> dict[str, Array]:
    """What a rod with inertia has beside, and what is not the same as without."""
    contact = rod.contact(t, mu, mu_nat, mu_t)
    first = rod.rate(t, mu, mu_nat)[0] if mu_t is None else mu_t
    velocity_x, velocity_y = rod.velocity(mu, first)
    return {
        "tension": contact.tension,
        "shear": contact.shear,
        "couple": contact.couple,
        "velocity_x": velocity_x,
        "velocity_y": velocity_y,
        "clamp_force_x": contact.clamp_x,
        "clamp_force_y": contact.clamp_y,
        "clamp_couple": contact.clamp_couple,
    }


def natural_shape(model: Model, mu_nat: Array, s: Array) -> tuple[Array, Array]:
    """Centre line of the natural configuration, arcs joined smoothly; mu_nat (k,) or (k, m), s (p,); shapes (k, p)."""
    if model.segments == 1:
        return natural_centre_line(np.asarray(mu_nat)[..., None], s)
    x, y = np.zeros((*mu_nat.shape[:-1], s.size)), np.zeros((*mu_nat.shape[:-1], s.size))
    angle = np.zeros((*mu_nat.shape[:-1], 1))
    for j, (start, length) in enumerate(zip(model.division.breaks, model.division.lengths, strict=False)):
        reach = np.clip(s - start, 0.0, length)
        along, across = natural_centre_line(mu_nat[..., j, None], reach)
        cos, sin = np.cos(angle), np.sin(angle)
        x, y = x + cos * along - sin * across, y + sin * along + cos * across
        angle = angle + mu_nat[..., j, None] * length
    return x, y


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
        "conventions": _conventions(solution.model),
        "status": solution.status.code,
        "status_sentence": solution.status.sentence,
        "verdict": solution.outcome.sentence,
        "references": "; ".join(REFERENCES),
        **provenance(solution),
    }


def _conventions(model: Model) -> str:
    if model.specimen is not None:
        return "SI"
    unit = "the retardation time" if model.damping == 1.0 else "the time scale T of the inertias and the damping"
    return f"dimensionless: lengths in L, forces in EI/L^2, times in {unit}"
