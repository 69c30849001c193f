"""What every picture of the report shows, in words and, for those who cannot see it, in numbers."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from plastica.physics.load import LOAD_KINDS
from plastica.show.panels import LOAD_WORDS, present_loads
from plastica.show.words import Writer, pretty

if TYPE_CHECKING:
    from plastica.show.view import View

__all__ = ["Caption", "captions"]


@dataclass(frozen=True)
class Caption:
    """The heading of a picture, what one should see in it, and its alt text."""

    heading: str
    text: str
    alt: str


def captions(seen: View) -> dict[str, Caption]:
    """Return the captions of all pictures by the name of the function that draws them; and of the film."""
    return {
        "film": _film(seen),
        "shapes": _shapes(seen),
        "natural": _natural(seen),
        "curvature_map": _map(seen),
        "energies": _energies(seen),
        "loads": _loads(seen),
    }


def _span(seen: View) -> str:
    start, end = float(seen.t[0]), float(seen.t[-1])
    write = Writer(seen.solution).amount
    log = ", on a logarithmic axis of time" if seen.time.scale == "log" else ""
    return f"from {write(start, 'time')} to {write(end, 'time')}{log}"


def _range(seen: View, name: str, kind: str) -> str:
    """First, least, greatest and last value of a series."""
    values, write = seen.values(name), Writer(seen.solution).amount
    first, last = write(float(values[0]), kind), write(float(values[-1]), kind)
    low, high = write(float(values.min()), kind), write(float(values.max()), kind)
    return f"begins at {first}, lies between {low} and {high}, and ends at {last}"


def _tip(seen: View, row: int) -> str:
    write = Writer(seen.solution).amount
    x, y = float(seen.values("tip_x")[row]), float(seen.values("tip_y")[row])
    return f"{write(x, 'length')} along and {write(y, 'length')} across"


def _shapes(seen: View) -> Caption:
    return Caption(
        "The rod through time",
        "The rod, clamped at the left, at times between which it moves by about equal amounts; early shapes are pale, "
        "late ones dark, the last one is thick. The broken lines are the natural shape: what the rod would be without "
        "load.",
        f"Shapes of the rod {_span(seen)}. {_way(seen)}",
    )


def _way(seen: View) -> str:
    return f"The free end begins at {_tip(seen, 0)} from the clamp and ends at {_tip(seen, -1)}."


def _natural(seen: View) -> Caption:
    wells = " Dotted: the natural curvatures that the material prefers." if seen.solution.model.material.well else ""
    threshold = Writer(seen.solution).amount(float(seen.values("threshold")[-1]), "drive")
    return Caption(
        "The memory: natural curvature, drive and threshold",
        "Above, the natural curvature; below, the drive between plus and minus the threshold. The natural curvature "
        "moves only while the drive is outside that band (shaded), and always in the direction in which it pulls."
        f"{wells}",
        f"Natural curvature and drive {_span(seen)}. The natural curvature "
        f"{_range(seen, 'natural_curvature', 'curvature')}. The drive {_range(seen, 'drive', 'drive')}; the threshold "
        f"is {threshold} at the end.",
    )


def _map(seen: View) -> Caption:
    alone = [name for name, _ in seen.solution.model.loads.sources()] == ["thrust"]
    rule = " Under thrust alone the free end takes on the natural curvature." if alone else ""
    return Caption(
        "Curvature along the rod",
        "Every column is the rod at one time, from the clamp at the bottom to the free end at the top; the colour "
        f"tells how much it is curved there.{rule}",
        f"Map of the curvature over time and arc length, {_span(seen)}. Over the whole rod the curvature "
        f"{_field_range(seen)}.",
    )


def _field_range(seen: View) -> str:
    values, write = seen.values("curvature"), Writer(seen.solution).amount
    return f"lies between {write(float(values.min()), 'curvature')} and {write(float(values.max()), 'curvature')}"


def _energies(seen: View) -> Caption:
    constant = seen.solution.model.loads.is_constant and seen.solution.model.loads.sources()
    extra = (
        " The Liapunov function (stored energy plus potential of the loads) can only fall while the loads are constant."
        if constant
        else ""
    )
    sheet, write = seen.solution.ledger, Writer(seen.solution).amount
    work, stored, viscous, natural = (
        write(value, "energy")
        for value in (sheet.work, sheet.stored_energy, sheet.viscous_dissipation, sheet.natural_dissipation)
    )
    return Caption(
        "Where the work goes",
        "Work done by the loads is stored in the bent rod or lost, to viscosity and to the motion of the natural "
        f"curvature; losses never come back.{extra} Below, what does not add up, against the tolerance of the "
        "computation (the band).",
        f"Energies {_span(seen)}. At the end the loads have done {work} of work; the stored energy has changed by "
        f"{stored}; {viscous} are lost to viscosity and {natural} to yielding.",
    )


def _loads(seen: View) -> Caption:
    words = pretty(seen.solution.model.load.describe(si=not seen.dimensionless))
    unit = " (in units of the rod, see above)" if seen.dimensionless and seen.solution.model.loads.sources() else ""
    peaks = []
    for name in present_loads(seen):
        program = getattr(seen.solution.model.loads, name)
        largest = float(np.abs(np.asarray(program(seen.sampled.t), dtype=float)).max())
        peaks.append(f"{LOAD_WORDS[name].lower()} {Writer(seen.solution).of_scale(largest, LOAD_KINDS[name])}")
    return Caption(
        "The load",
        f"What was done to the rod: {words}{unit}.",
        f"Load program {_span(seen)}: {words}. Largest magnitude: {', '.join(peaks)}.",
    )


def _film(seen: View) -> Caption:
    return Caption(
        "The motion as a film",
        "The rod with its natural shape dashed and the thrust as an arrow; below, the energies with a marker for the "
        "present moment. The film is slow where much happens and quick where little does; the time is written at the "
        "top right.",
        f"Film of the rod {_span(seen)}. {_way(seen)}",
    )
