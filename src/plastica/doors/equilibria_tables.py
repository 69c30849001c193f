"""Tables for the terminal: equilibria, spectra, phase diagrams, capacity. All text goes in as plain text."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from plastica.doors.numbers import shown
from plastica.doors.tables import pairs, row

if TYPE_CHECKING:
    from rich.console import Console
    from rich.table import Table

__all__ = ["print_capacity", "print_equilibria", "print_phase", "print_spectrum"]

CRITICAL = {
    "gamma_star": "natural curvature that yields grows beyond",
    "gamma_star_star": "the shapes near the straight one split beyond",
    "euler": "the straight rod is unstable beyond (Euler)",
}


def _grid(headings: Sequence[str]) -> Table:
    from rich.box import SIMPLE
    from rich.table import Table
    from rich.text import Text

    table = Table(box=SIMPLE, pad_edge=False)
    for heading in headings:
        # Words to the left, numbers to the right.
        words = heading in ("", "drive", "what it is", "which")
        table.add_column(Text(heading), justify="left" if words else "right")
    return table


def _load(facts: dict[str, Any], unit: str) -> str:
    held = facts["load"]
    value = f"{shown(held['thrust'], unit)}, " if unit != "1" else ""
    why = f" ({held['source']})" if held.get("source") else ""
    return f"{value}{held['gamma']:.4g} EI/L², {held['over_euler']:.4g} Euler loads{why}"


def _named(words: str, unit: str, dimensionless: str) -> str:
    return f"{words} [{dimensionless if unit == '1' else unit}]"


def _files(table: Table, files: Sequence[Path]) -> None:
    for file in files:
        row(table, "written", file)


def print_equilibria(console: Console, facts: dict[str, Any], files: Sequence[Path]) -> None:
    """Print the intervals of admissible equilibria, their ends, and the folds."""
    units = facts["units"]
    head = pairs(facts["title"] or "Equilibria")
    row(head, "thrust held", _load(facts, units["force"]))
    row(head, "", facts["sentence"])
    _files(head, files)
    console.print(head)
    bare, unit = units["curvature"] == "1", units["curvature"]
    clamp = [] if bare else [_named("clamp", unit, "1/L")]
    table = _grid(("drive", "alpha L", *clamp, _named("natural", unit, "1/L"), "what it is"))
    for each in facts["limiting"]:
        kind = f"{'+' if each['side'] > 0 else '−'}threshold"
        row(table, kind, *_curvatures(each, bare), each["standing"])
    for each in facts["folds"]:
        words = "snaps here" if each["admissible"] else "snaps here, not admissible"
        row(table, "fold", *_curvatures(each, bare), words)
    console.print(table)


def _curvatures(place: dict[str, Any], bare: bool) -> list[str]:
    """Clamp curvature times L and, in SI, as it is; natural curvature."""
    numbers = [place["natural_curvature"]] if bare else [place["clamp_curvature"], place["natural_curvature"]]
    return [f"{place['alpha']:.6g}", *(f"{value:.4g}" for value in numbers)]


def print_spectrum(console: Console, facts: dict[str, Any], files: Sequence[Path]) -> None:
    """Print eigenvalues with their errors, and what they say."""
    units, place = facts["units"], facts["equilibrium"]
    head = pairs(facts["title"] or "Spectrum")
    row(head, "thrust held", _load(facts, units["force"]))
    curvature = units["curvature"]
    row(head, "clamp curvature", f"{shown(place['clamp_curvature'], curvature)} (alpha = {place['alpha']:.6g})")
    row(head, "natural curvature", shown(place["natural_curvature"], curvature))
    row(head, "admissible", "yes: its natural curvature stays" if place["admissible"] else "no: it moves")
    row(head, "", facts["sentence"])
    _files(head, files)
    console.print(head)
    unit = units["time"]
    table = _grid(("", "eigenvalue [1/T]", "error", "e-fold" if unit == "1" else "e-fold [s]", "what it is"))
    for k, each in enumerate(facts["eigenvalues"]):
        rate = each["rate"]
        fold = f"{1.0 / abs(rate):.4g}" if rate else ""
        words = (
            "grows" if each["value"] > each["error"] else "dies out" if each["value"] < -each["error"] else "neither"
        )
        row(table, k + 1, f"{each['value']:+.12g}", f"{each['error']:.1e}", fold, words)
    console.print(table)


def print_phase(console: Console, facts: dict[str, Any], files: Sequence[Path]) -> None:
    """Print what a phase diagram consists of."""
    unit = facts["units"]["force"]
    head = pairs(facts["title"] or "Phase diagram")
    window = facts["window"]
    low, high = window["gamma"]
    thrust = "" if unit == "1" else f" ({shown(window['thrust'][0], unit)} to {shown(window['thrust'][1], unit)})"
    row(head, "thrust", f"{low:.4g} to {high:.4g} EI/L²{thrust}")
    row(head, "clamp curvature", f"{window['alpha'][0]:.4g} to {window['alpha'][1]:.4g}, times L")
    row(head, "admissible", f"{100.0 * facts['admissible_share']:.1f} % of the equilibria in the window")
    row(head, "", f"{len(facts['components'])} components of the set |drive| = threshold")
    _files(head, files)
    console.print(head)
    table = _grid(("which", "thrust [EI/L²]", "alpha (times L)", "what it is"))
    for component in facts["components"]:
        (low, high), (left, right) = component["gamma"], component["alpha"]
        sign = "+" if component["side"] > 0 else "−"
        words = f"drive = {sign}threshold, {component['kind']}"
        row(table, "component", f"{low:.5g} … {high:.5g}", f"{left:.5g} … {right:.5g}", words)
    for kind, words in (("tangencies", "the admissible set splits or merges"), ("cusps", "two folds meet")):
        for place in facts[kind]:
            name = {"tangencies": "tangency", "cusps": "cusp"}[kind]
            row(table, name, f"{place['gamma']:.8g}", f"{place['alpha']:.6g}", words)
    console.print(table)


def print_capacity(console: Console, facts: dict[str, Any], files: Sequence[Path]) -> None:
    """Print the largest imperfections that are borne for ever, and the critical thrusts."""
    units = facts["units"]
    head = pairs(facts["title"] or "Capacity")
    for name, words in CRITICAL.items():
        critical = facts["critical"][name]
        load = "no such thrust" if critical is None else _load({"load": critical}, units["force"])
        row(head, words, load)
    leaves = facts["leaves_from"]
    least = "none of those computed" if leaves is None else _load({"load": leaves}, units["force"])
    row(head, "a bow was seen to creep away from", least)
    kind = facts["imperfection"]
    row(head, "imperfection", "a natural bow, without load" if kind == "natural" else f"bent into {kind}")
    row(head, "", facts["sentence"])
    _files(head, files)
    console.print(head)
    names = [_named("thrust", units["force"], "EI/L²"), "Euler loads"]
    table = _grid((*names, _named("bears up to", units["curvature"], "1/L"), "times L"))
    for each in facts["rows"]:
        bears = "any tried" if each["largest"] == float("inf") else f"{each['largest_imperfection']:.4g}"
        times = "" if each["largest"] == float("inf") else f"{each['largest']:.4g}"
        row(table, f"{each['thrust']:.4g}", f"{each['over_euler']:.4g}", bears, times)
    console.print(table)
