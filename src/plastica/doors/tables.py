"""Tables for the terminal. All text goes in as plain text, never as markup."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from plastica.doors.numbers import shown
from plastica.errors import one_line, safe_text
from plastica.show.words import parameter

if TYPE_CHECKING:
    from rich.console import Console
    from rich.table import Table

__all__ = ["pairs", "print_batch", "print_check", "print_result", "row"]

_GROUPS = {
    "thrust_over_EI_per_L2": "largest thrust, in EI/L²",
    "thrust_over_euler": "largest thrust, in Euler loads π²/4",
    "transverse_over_EI_per_L2": "largest transverse force, in EI/L²",
    "couple_over_EI_per_L": "largest couple, in EI/L",
    "weight_over_EI_per_L3": "largest weight per length, in EI/L³",
    "threshold_over_EI": "threshold, in EI",
    "drive_over_threshold_at_start": "drive at the start, in thresholds",
    "natural_curvature_times_L": "natural curvature at the start, times L",
    "translational_inertia": "translational inertia ρAL⁴/(EIT²)",
    "rotary_inertia": "rotary inertia ρJL²/(EIT²)",
    "damping": "damping, retardation time over T",
    "time_unit": "T, the unit of time inside",
}


_THRUST = ("thrust_over_EI_per_L2", "thrust_over_euler")
_OTHER_LOADS = {"transverse_over_EI_per_L2", "couple_over_EI_per_L", "weight_over_EI_per_L3"}


UNBALANCED = "The books do not balance: compute again with a smaller rtol before relying on this result."
"""What is said of a ledger that leaves more over than is accepted (`show.checks.allowed`)."""


def pairs(title: str) -> Table:
    """Return a table of names and values under a title."""
    from rich.box import SIMPLE
    from rich.table import Table
    from rich.text import Text

    table = Table(title=Text(one_line(title)), box=SIMPLE, show_header=False, title_justify="left", pad_edge=False)
    table.add_column(style="bold", no_wrap=True)
    table.add_column()
    return table


def row(table: Table, *cells: object) -> None:
    """Add a row, as plain text that cannot steer the terminal."""
    from rich.text import Text

    table.add_row(*(Text(safe_text(cell)) for cell in cells))


def print_result(console: Console, facts: dict[str, Any], files: Sequence[Path], seconds: float | None) -> None:
    """Print what became of a rod, and where the results are."""
    table = pairs(facts["title"] or "Result")
    natural, tip, ledger = facts["natural_curvature"], facts["tip"], facts["ledger"]
    row(table, "verdict", facts["verdict"]["headline"])
    row(table, "", facts["verdict"]["sentence"])
    row(table, "status", f"{facts['status']['code']}: {facts['status']['sentence']}")
    row(table, "distance", facts["verdict"]["distance"])
    unit = "1" if natural["unit"] == "1" else natural["unit"]
    row(table, "natural curvature", f"{shown(natural['start'], unit)} → {shown(natural['end'], unit)}")
    row(
        table,
        "free end",
        f"{shown(tip['x'], tip['unit'])} along, {shown(tip['y'], tip['unit'])} across the clamp's axis",
    )
    _print_swing(table, facts)
    residual, largest = (
        shown(ledger["residual"], ledger["unit"]),
        shown(ledger["largest_energy"], ledger["unit"]),
    )
    row(table, "ledger residual", f"{residual}, where the largest energy is {largest}")
    if not ledger["balances"]:
        row(table, "", UNBALANCED)
    for note in facts["notes"]:
        row(table, "note", note)
    for file in files:
        row(table, "written", file)
    cost = f"{facts['steps']} steps of {facts['method']} on {facts['nodes']} nodes"
    row(table, "cost", cost if seconds is None else f"{cost}, {seconds:.2f} s")
    console.print(table)


def _print_swing(table: Table, facts: dict[str, Any]) -> None:
    """Add what a rod with inertia has beside."""
    if "clamp" not in facts:
        return
    energy, clamp = facts["kinetic_energy"], facts["clamp"]
    end, most = (shown(energy[each], energy["unit"]) for each in ("end", "largest"))
    row(table, "kinetic energy", f"{end} at the end, {most} at most")
    force = shown(clamp["largest_force"], clamp["force_unit"])
    couple = shown(clamp["largest_couple"], clamp["couple_unit"])
    row(table, "on the clamp", f"a force of at most {force}, a couple of at most {couple}")


def print_check(console: Console, facts: dict[str, Any], files: Sequence[Path]) -> None:
    """Print what was understood of a scenario."""
    table = pairs(facts["title"] or str(facts["scenario"]))
    row(table, "scenario", f"{facts['scenario']} can be run")
    for name, value in _group_words(facts["groups"], si=facts["units"] == "SI"):
        row(table, name, value)
    row(table, "loads", facts["loads"])
    row(table, "initial curvature", facts["initial_curvature"])
    material = facts["material"]
    row(table, "material", material["name"] or "three laws of its own")
    for law in ("preference", "flow", "threshold"):
        row(table, f"  {law}", material[law])
    for name, value in material["parameters"].items():
        row(table, f"  {name}", parameter(value))
    for verdict in facts["admissibility"]:
        row(table, "holds" if verdict["holds"] else "FAILS", verdict["sentence"])
    for words in _plan_words(facts["plan"]):
        row(table, *words)
    for note in facts["notes"]:
        row(table, "note", note)
    for file in files:
        row(table, "would write", file)
    console.print(table)


def _group_words(groups: dict[str, Any], *, si: bool) -> list[tuple[str, str]]:
    """The dimensionless groups in words; of the thrust what there is of it, push or pull."""
    rows = [
        (_GROUPS[key], shown(value, "s" if key == "time_unit" and si else ""))
        for key, value in groups.items()
        if key not in _THRUST
    ]
    thrust = [(_GROUPS[key], shown(groups[key], "")) for key in _THRUST]
    if groups[_THRUST[0]] < 0.0:
        thrust = [("largest tension, in EI/L²", shown(-groups[_THRUST[0]], ""))]
    elif groups[_THRUST[0]] == 0.0 and groups.keys() & _OTHER_LOADS:
        thrust = []
    return [*thrust, *rows]


def _plan_words(plan: dict[str, Any]) -> list[tuple[str, str]]:
    words = "units of time" if plan["retardation_times"] is None else "retardation times"
    span = "" if plan["time_units"] is None else f" ({plan['time_units']:.4g} {words})"
    nodes = "as many nodes as the motion needs" if plan["nodes"] == "auto" else f"{plan['nodes']} nodes"
    elements = "1 element" if plan["elements"] == 1 else f"each of {plan['elements']} elements"
    landings = {0: "no jump or corner of the load", 1: "1 jump or corner of the load"}.get(
        plan["landings"], f"{plan['landings']} jumps or corners of the load"
    )
    return [
        ("until", f"{plan['until']}{span}"),
        ("method", f"{plan['method']}, rtol {plan['rtol']:g}; lands on {landings}"),
        ("grid", f"{nodes} on {elements}"),
    ]


def print_batch(console: Console, rows: Sequence[tuple[Path, int, str, float]]) -> None:
    """Print how each scenario of a folder ended: file, exit code, words, seconds."""
    from rich.box import SIMPLE
    from rich.table import Table

    table = Table(box=SIMPLE, pad_edge=False)
    for heading in ("scenario", "ended", "verdict", "s"):
        table.add_column(heading)
    ended = {0: "done", 1: "computation failed", 2: "mistake"}
    for file, code, words, seconds in rows:
        row(table, file.name, ended[code], words, f"{seconds:.2f}")
    console.print(table)
