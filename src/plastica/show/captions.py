"""What every picture of the report shows, in words and, for those who cannot see it, in numbers."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from plastica.motion.histories import CONJUGATE, KINDS_OF
from plastica.physics.load import LOAD_KINDS
from plastica.show.loops import history_of
from plastica.show.panels import LOAD_WORDS, present_loads
from plastica.show.swings import reactions
from plastica.show.view import yielding_by_segment
from plastica.show.words import Writer, pretty

if TYPE_CHECKING:
    from plastica.show.view import View

__all__ = ["Caption", "captions", "shown"]


@dataclass(frozen=True)
class Caption:
    """The heading of a picture, what one should see in it, and its alt text."""

    heading: str
    text: str
    alt: str


def captions(seen: View) -> dict[str, Caption]:
    """Return the captions of all pictures of the page by the name of the function that draws them; and of the film."""
    makers: dict[str, Callable[[View], Caption]] = {
        "shapes": _shapes,
        "natural": _natural,
        "energies": _energies,
        "curvature_map": _map,
        "loads": _loads,
        "force_displacement": _forces,
        "moment_curvature": _moments,
        "free_end": _free_end,
        "velocities": _velocities,
        "reactions": _reactions,
    }
    return {"film": _film(seen), **{name: makers[name](seen) for name in shown(seen)}}


def shown(seen: View) -> tuple[str, ...]:
    """Return the names of the pictures that a page shows of a motion, in order.

    Histories of loading where loads change, and where the rod has inertia how it moves and what holds it.
    """
    model = seen.solution.model
    names = ["shapes", "natural", "energies", "curvature_map", "loads"]
    if not model.loads.is_constant:
        names += ["force_displacement", "moment_curvature"]
    if model.has_inertia:
        names += ["free_end", "velocities", "reactions"]
    return tuple(names)


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
    if seen.solution.model.segments > 1:
        return _segments(seen, wells)
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


def _segments(seen: View, wells: str) -> Caption:
    values, write = seen.values("natural_curvature"), Writer(seen.solution).amount
    ends = " and ".join(write(float(values[-1, j]), "curvature") for j in (0, -1))
    moved = [j + 1 for j, spans in enumerate(yielding_by_segment(seen.solution)) if spans]
    which = f"segments {', '.join(map(str, moved))}" if moved else "no segment"
    return Caption(
        "The memory: natural curvature and drive of each segment",
        "Above, the natural curvature of each segment, dark at the clamp and pale at the free end; in the middle their "
        "drives in units of their thresholds: a natural curvature moves only while its drive is beyond 1 or −1. Below, "
        f"when and where that is so.{wells}",
        f"Natural curvature and drive of {values.shape[1]} segments {_span(seen)}. At the end the natural curvature is "
        f"{ends} in the first and the last segment. Of {values.shape[1]}, these yielded: {which}.",
    )


def _map(seen: View) -> Caption:
    alone = [name for name, _ in seen.solution.model.loads.sources()] == ["thrust"]
    last = "natural curvature" if seen.solution.model.segments == 1 else "natural curvature of its segment"
    rule = f" Under thrust alone the free end takes on the {last}." if alone else ""
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
    swings = seen.solution.model.has_inertia
    held = "stored and kinetic energy" if swings else "stored energy"
    extra = (
        f" The Liapunov function ({held} plus potential of the loads) can only fall while the loads are constant."
        if constant
        else ""
    )
    sheet, write = seen.solution.ledger, Writer(seen.solution).amount
    work, stored, viscous, natural = (
        write(value, "energy")
        for value in (sheet.work, sheet.stored_energy, sheet.viscous_dissipation, sheet.natural_dissipation)
    )
    moving = f" The kinetic energy has changed by {write(sheet.kinetic_energy, 'energy')}." if swings else ""
    stays = "stored in the bent rod, held in its motion or lost," if swings else "stored in the bent rod or lost,"
    return Caption(
        "Where the work goes",
        f"Work done by the loads is {stays} to viscosity and to the motion of the natural "
        f"curvature; losses never come back.{extra} Below, what does not add up, against the tolerance of the "
        "computation (the band).",
        f"Energies {_span(seen)}. At the end the loads have done {work} of work; the stored energy has changed by "
        f"{stored}; {viscous} are lost to viscosity and {natural} to yielding.{moving}",
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


def _forces(seen: View) -> Caption:
    work = Writer(seen.solution).amount(seen.solution.ledger.work, "energy")
    found = history_of(seen, "force_displacement")
    write, told = Writer(seen.solution).amount, []
    for load in (name for name in CONJUGATE if name in found):
        low, high = (write(float(found[load].values[row]), KINDS_OF[load][0]) for row in _extremes(found[load].values))
        far = float(found[CONJUGATE[load]].values[-1])
        told.append(
            f"{KINDS_OF[load][1].capitalize()} between {low} and {high}; its displacement ends at "
            f"{write(far, KINDS_OF[CONJUGATE[load]][0])}."
        )
    return Caption(
        "Loads and what they displace",
        "Every load that changes, over the displacement on which it does work, from the ring to the disc. The area "
        "under a curve is the work of that load; what a closed loop encloses was lost in it, to viscosity and to "
        "yielding.",
        f"Load over displacement {_span(seen)}. {' '.join(told)} Together the loads have done {work} of work.",
    )


def _extremes(values: NDArray[np.float64]) -> tuple[int, int]:
    return int(values.argmin()), int(values.argmax())


def _moments(seen: View) -> Caption:
    found, write = history_of(seen, "moment_curvature"), Writer(seen.solution).amount
    told = []
    for name in ("curvature", "couple"):
        low, high = (write(float(found[name].values[row, 0]), name) for row in _extremes(found[name].values[:, 0]))
        told.append(f"the {name} lies between {low} and {high}")
    return Caption(
        "Couple and curvature at the clamp",
        "The contact couple at the clamp over the curvature there, from the ring to the disc. A slender loop is the "
        "viscosity; a shift along the axis of curvature is what the rod remembers.",
        f"Contact couple over curvature at the clamp {_span(seen)}: {' and '.join(told)}.",
    )


def _free_end(seen: View) -> Caption:
    return Caption(
        "The free end",
        "Above, the path of the free end in the plane, on equal axes, from the ring to the disc; below, how far it is "
        "along and across the clamp’s tangent.",
        f"Path of the free end {_span(seen)}. {_way(seen)}",
    )


def _velocities(seen: View) -> Caption:
    along, across = seen.velocities(seen.t, np.array([1.0]))
    write = Writer(seen.solution).amount
    speed = np.hypot(along, across)[:, 0]
    largest, last = (write(float(each), "velocity") for each in (speed.max(), speed[-1]))
    return Caption(
        "How fast it moves",
        "Above, the velocity of the free end; below, the velocity across of the whole rod, from the clamp at the "
        "bottom to the free end at the top: white where it stands still, and two colours for the two directions.",
        f"Velocities {_span(seen)}. The free end is never faster than {largest}, and at the end {last} fast.",
    )


def _reactions(seen: View) -> Caption:
    write = Writer(seen.solution).amount
    names = (("the force along", "force"), ("the force across", "force"), ("the couple", "couple"))
    told = [
        f"{words} lies between {write(float(values.min()), kind)} and {write(float(values.max()), kind)}"
        for (words, kind), values in zip(names, reactions(seen), strict=True)
    ]
    return Caption(
        "What holds it: the clamp",
        "Force and couple of the rod on its clamp. They are those of the loads and of the inertia of the whole rod.",
        f"Reactions at the clamp {_span(seen)}: {', '.join(told)}.",
    )


def _film(seen: View) -> Caption:
    return Caption(
        "The motion as a film",
        "The rod with its natural shape dashed and its loads as arrows; below, the energies with a marker for the "
        "present moment. The film is slow where much happens and quick where little does; the time is written at the "
        "top right.",
        f"Film of the rod {_span(seen)}. {_way(seen)}",
    )
