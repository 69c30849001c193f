"""The command on small motions: the frequencies, damping ratios and modes of a scenario's rod."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from plastica.doors.equilibria import common
from plastica.errors import ArgumentError

if TYPE_CHECKING:
    from rich.console import Console

    from plastica.equilibria.mode_set import Modes
    from plastica.equilibria.rest import Rest
    from plastica.study.scenario import Scenario

__all__ = ["modes"]

DONE, FAILED = 0, 1


@click.command()
@common
@click.option("--at", "moment", help='Time whose loads are held; with its unit ("2 s") where the scenario is in SI.')
@click.option("--count", default=6, show_default=True, type=click.IntRange(1, 100), help="How many modes.")
def modes(scenario: Path, as_json: bool, picture: Path | None, moment: str | None, count: int) -> int:
    """Tell frequencies, damping ratios and modes of SCENARIO's rod about the shape in which it comes to rest.

    The scenario must have a section [inertia]. Loads that vary are held: at their last values where they become
    constant before the end, else as they are at the start, or at the time --at. The shape is the static one that the
    rod takes from the scenario's start, with its natural curvature, which is held too.
    """
    from plastica.doors.held import static_shape
    from plastica.doors.telling import console, print_json, say
    from plastica.equilibria.at_rest import held_load
    from plastica.equilibria.modes import modes as modes_of
    from plastica.study.scenario import read_scenario

    read = read_scenario(scenario)
    _require_inertia(read)
    time, why = _moment(read, moment)
    shape = static_shape(read, held_load(read.model.load, time))
    if not shape.status.ok:
        if as_json:
            print_json({"scenario": read.file, "title": read.title, "modes": [], "sentence": shape.sentence})
        say(shape.sentence)
        return FAILED
    rod = shape.model if read.model.grid.nodes != "auto" else shape.model.with_grid(read.model.grid)
    found = modes_of(rod, shape, count)
    files = [] if picture is None else [_drawn(found, picture)]
    facts = {**_facts(read, found, shape), "held": {"time": time, "why": why}, "files": files}
    if as_json:
        print_json(facts)
    else:
        _print(console(), facts, files)
    return DONE


def _require_inertia(scenario: Scenario) -> None:
    if not scenario.model.has_inertia:
        raise ArgumentError(
            "must be there where frequencies are asked for",
            where=f"{scenario.file}: inertia",
            next_step="Add the section with the rod's mass; plastica spectrum tells the rates of a rod without it.",
        )


def _moment(scenario: Scenario, given: str | None) -> tuple[float, str]:
    """The time, in the units of the scenario, at which the loads are held, and why."""
    load, end = scenario.model.load, scenario.plan.end * scenario.model.scales.time
    if given is not None:
        return _time(given, si=scenario.model.specimen is not None), "as asked for"
    if load.is_constant:
        return 0.0, "they are constant"
    if load.settled is not None and load.settled <= end:
        return float(load.settled), "what is left of them in the end"
    return 0.0, "as they are at the start"


def _time(text: str, *, si: bool) -> float:
    from plastica.physics.amounts import finite

    try:
        value = finite(text if si else float(text), "s", "--at")
    except ValueError as error:
        if isinstance(error, ArgumentError):
            raise
        raise ArgumentError("must be a plain number in a dimensionless scenario", where="--at", value=text) from None
    if value < 0.0:
        raise ArgumentError("must not be before the start", where="--at", value=text)
    return float(value)


def _drawn(found: Modes, file: Path) -> Path:
    from plastica.show.save import save_picture

    return save_picture(found, file)


def _facts(scenario: Scenario, found: Modes, shape: Rest) -> dict[str, Any]:
    """Return what was found as plain values, in the units of the scenario."""
    import numpy as np

    from plastica.physics.scales import unit_of

    model = found.model
    free = model.specimen is None
    units = {kind: unit_of(kind, free) for kind in ("frequency", "rate", "time", "length", "curvature")}
    rows = [
        {
            "mode": k + 1,
            "frequency": float(found.frequencies[k]),
            "error": float(found.errors[k]),
            "cycles": float(found.hertz[k]),
            "damping_ratio": float(found.damping_ratios[k]),
            "eigenvalues": [[float(each.real), float(each.imag)] for each in found.eigenvalues[k]],
        }
        for k in range(found.frequencies.size)
    ]
    return {
        "scenario": scenario.file,
        "title": scenario.title,
        "units": units,
        "loads": model.load.describe(si=not free),
        "shape": {
            "tip": list(shape.tip),
            "natural_curvature": np.multiply(found.mu_nat, model.scales.curvature).tolist(),
            "unstable": found.unstable,
            "stays": found.stays,
        },
        "modes": rows,
        "nodes": model.grid.size,
        "resolved": found.resolved,
        "sentence": found.sentence,
    }


def _print(console: Console, facts: dict[str, Any], files: Sequence[Path]) -> None:
    """Print the modes as a table, after what they are the modes of."""
    from rich.box import SIMPLE
    from rich.table import Table
    from rich.text import Text

    from plastica.doors.numbers import shown
    from plastica.doors.tables import pairs, row

    units = facts["units"]
    head = pairs(facts["title"] or "Modes")
    row(head, "loads held", f"{facts['loads']} ({facts['held']['why']})")
    x, y = (shown(each, units["length"]) for each in facts["shape"]["tip"])
    row(head, "at rest", f"free end {x} along, {y} across the clamp's axis")
    row(head, "natural curvature", f"{shown(facts['shape']['natural_curvature'], units['curvature'])}, held")
    row(head, "", facts["sentence"])
    for file in files:
        row(head, "written", file)
    console.print(head)
    si = units["rate"] != "1"
    unit, time = ("[rad/s]", " [s]") if si else ("[rad/T]", " [T]")
    names = ("mode", "Hz" if si else "1/T", f"frequency {unit}", "error", "damping ratio", f"e-fold{time}", "")
    table = Table(box=SIMPLE, pad_edge=False)
    for name in names:
        table.add_column(Text(name), justify="right" if name else "left")
    for each in facts["modes"]:
        row(table, each["mode"], *_cells(each))
    console.print(table)


def _cells(mode: dict[str, Any]) -> tuple[str, ...]:
    """Frequency in cycles and radians, error, damping ratio, time of an e-fold, and words."""
    omega, zeta, rate = mode["frequency"], mode["damping_ratio"], mode["eigenvalues"][0][0]
    fold = f"{1.0 / abs(rate):.4g}" if rate else ""
    if math.isnan(omega):
        return "", "", "", "", fold, "grows"
    numbers = f"{mode['cycles']:.6g}", f"{omega:.10g}", f"{mode['error']:.1e}"
    if math.isnan(zeta):
        return *numbers, "", fold, "neither swings nor comes back"
    return *numbers, f"{zeta:.4g}", fold, "swings" if zeta < 1.0 else "does not swing"
