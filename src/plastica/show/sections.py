"""The sections of a report: each is a small function from the subject to the data of its template.

To add one, write a function that returns a `Section` (or None where it has nothing to say), a template
``templates/sections/<key>.html.j2``, and put the function into `SECTIONS` at its place.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Final

import numpy as np

from plastica.motion.outcome import REFERENCES, provenance
from plastica.motion.solution import Solution
from plastica.physics.strut import Strut
from plastica.show.captions import captions
from plastica.show.film import frames
from plastica.show.pictures import gif_uri, still_uri, svg_uri
from plastica.show.view import View, view
from plastica.show.words import Writer, number, pretty

__all__ = ["SECTIONS", "Section", "Subject"]

MOST_EVENTS: Final = 100
FPS: Final = 12.5
FILM_WIDTH: Final = 640
LEDGER_SLACK: Final = 100.0
"""The ledger is asked to balance to this many times rtol times the largest energy."""

EULER: Final = 0.25 * np.pi**2
"""Dimensionless thrust at which a straight elastic strut, clamped below and free above, buckles."""


@dataclass(frozen=True)
class Section:
    """A part of the page: its anchor (also the name of its template), heading, and data."""

    key: str
    heading: str
    data: dict[str, Any]


@dataclass(frozen=True)
class Subject:
    """What a report is about, and how long its film runs (s; 0: no film)."""

    solution: Solution
    film_seconds: float

    @cached_property
    def seen(self) -> View:
        """The solution made ready for pictures."""
        return view(self.solution)

    @property
    def write(self) -> Callable[[float, str], str]:
        """Writes a value of a kind in the user's units."""
        return Writer(self.solution).amount

    @property
    def of_scale(self) -> Callable[[float, str], str]:
        """Writes a dimensionless value of a kind in the user's units."""
        return Writer(self.solution).of_scale


def verdict(subject: Subject) -> Section:
    """The verdict in words, how the computation ended, how far from the end, and the key numbers."""
    solution = subject.solution
    outcome = solution.outcome
    sentence = outcome.sentence.removeprefix(f"{outcome.headline}.").strip()
    data = {
        "headline": outcome.headline,
        "sentence": pretty(sentence),
        "distance": pretty(outcome.distance),
        "ok": solution.status.ok,
        "code": solution.status.code.replace("_", " "),
        "status": pretty(solution.status.sentence),
        "until": subject.write(float(subject.seen.t[-1]), "time"),
        "notes": [pretty(note) for note in solution.notes],
        "cards": _cards(subject),
    }
    return Section("verdict", "Verdict", data)


def _cards(subject: Subject) -> list[dict[str, str]]:
    seen, write, outcome, ledger = subject.seen, subject.write, subject.solution.outcome, subject.solution.ledger
    angles = seen.values("angle")
    largest = np.maximum(np.abs(angles).max(axis=1), np.abs(seen.values("tip_angle")))
    when = int(np.argmax(largest))
    lost = ledger.entropy_production
    share = (
        f"{number(100.0 * ledger.natural_dissipation / lost, 3)} % of it by yielding"
        if lost > 0.0
        else "nothing was lost"
    )
    moved = outcome.set_curvature != 0.0
    return [
        _card("Followed until", write(float(seen.t[-1]), "time"), f"{subject.solution.counts.steps} steps"),
        _card(
            "Free end off the axis",
            write(float(seen.values("tip_y")[-1]), "length"),
            f"at the end; {write(float(seen.values('tip_x')[-1]), 'length')} along the axis",
        ),
        _card(
            "Permanent set of the free end",
            write(outcome.set_deflection, "length") if moved else "none",
            f"natural curvature moved by {write(outcome.set_curvature, 'curvature')}"
            if moved
            else "the natural curvature did not move",
        ),
        _card(
            "Largest angle",
            write(float(largest[when]), "angle"),
            f"of the rod against the clamp, at {write(float(seen.t[when]), 'time')}",
        ),
        _card("Energy lost", write(lost, "energy"), share),
    ]


def _card(name: str, value: str, more: str) -> dict[str, str]:
    return {"name": name, "value": value, "more": more}


def meaning(subject: Subject) -> Section:
    """The theory in two sentences, for somebody who has never heard of it, and the words of the page."""
    return Section("meaning", "What this means", {"dimensionless": subject.seen.dimensionless})


def parameters(subject: Subject) -> Section:
    """What was put in: specimen, dimensionless groups, laws, load, initial shape, grid, solver."""
    solution = subject.solution
    model, material = solution.model, solution.model.material
    data = {
        "specimen": _specimen(model),
        "material": material.name,
        "source": material.source,
        "laws": _laws(model),
        "values": [
            (name, pretty(value) if isinstance(value, str) else number(value, 6))
            for name, value in material.parameters.items()
        ],
        "load": pretty(model.load.describe(si=not subject.seen.dimensionless)),
        "start": _start(subject),
        "groups": _groups(subject),
        "numerics": _numerics(solution),
        "dimensionless": subject.seen.dimensionless,
    }
    return Section("parameters", "What was put in", data)


_SPECIMEN_WORDS: Final = {
    "length": ("L", "Length"),
    "bending_stiffness": ("EI", "Bending stiffness"),
    "youngs_modulus": ("E", "Young's modulus"),
    "section": ("", "Cross section"),
    "retardation_time": ("T", "Retardation time"),
    "temperature": ("", "Temperature"),
}
_SPECIMEN_UNITS: Final = {
    "length": "m",
    "bending_stiffness": "N*m**2",
    "youngs_modulus": "Pa",
    "retardation_time": "s",
    "temperature": "K",
}


def _specimen(model: Strut) -> list[tuple[str, str, str]]:
    if model.specimen is None:
        return []
    rows = []
    for name, value in model.specimen.as_given.items():
        symbol, words = _SPECIMEN_WORDS[name]
        rows.append((symbol, words, _as_given(value, _SPECIMEN_UNITS.get(name, ""))))
    if "bending_stiffness" not in model.specimen.as_given:
        rows.append(("EI", "Bending stiffness, from the two", pretty(f"{model.specimen.EI:.5g} N*m**2")))
    return rows


def _as_given(value: Any, unit: str) -> str:
    if isinstance(value, dict):
        return ", ".join(f"{key.replace('_', ' ')} {_as_given(each, 'm')}" for key, each in value.items())
    return pretty(value if isinstance(value, str) else f"{value:g} {unit}".strip())


def _laws(model: Strut) -> list[dict[str, str]]:
    material = model.material
    return [
        {
            "symbol": "κ(m)",
            "name": "Preference energy",
            "formula": material.preference,
            "words": "Which natural curvatures m the material prefers: it is drawn to where this energy is least.",
        },
        {
            "symbol": "Θ(m)",
            "name": "Threshold",
            "formula": material.threshold,
            "words": "How large the drive must be before the natural curvature moves at all.",
        },
        {
            "symbol": "f(x)",
            "name": "Flow law",
            "formula": material.flow,
            "words": "How fast the natural curvature moves when the drive exceeds the threshold by x; pos(x) is x "
            "where x is positive, else 0.",
        },
    ]


def _start(subject: Subject) -> list[tuple[str, str]]:
    solution = subject.solution
    began = float(solution.history.y[0][solution.model.grid.size])
    unit = "1/L, s in L" if subject.seen.dimensionless else "1/m, s in m"
    return [
        ("Initial curvature", f"{solution.initial}  (in {unit})"),
        ("Initial natural curvature", subject.of_scale(began, "curvature")),
    ]


def _groups(subject: Subject) -> list[tuple[str, str, str]]:
    model, history = subject.solution.model, subject.solution.history
    laws = model.laws
    largest = float(np.abs(np.asarray(model.loads.thrust(subject.seen.sampled.t), dtype=float)).max())
    began = np.array([float(history.y[0][model.grid.size])])
    return [
        (
            "γ",
            "Largest thrust, in EI/L²",
            f"{number(largest)}, that is {number(largest / EULER, 3)} times the Euler load of the straight elastic strut",
        ),
        ("Θ/EI", "Threshold at the first natural curvature", number(float(laws.threshold.value(began)[0]))),
        ("κ″/EI", "Stiffness of the preference energy there", number(float(laws.preference.second(began)[0]))),
        ("t/T", "Length of the run in retardation times", number(history.end - history.start)),
    ]


def _numerics(solution: Solution) -> list[tuple[str, str]]:
    grid = solution.model.grid
    elements = "one element" if grid.elements == 1 else f"each of {grid.elements} elements"
    return [
        ("Grid", f"{grid.per_element} Gauss–Legendre nodes on {elements}"),
        (
            "Solver",
            f"{solution.method}, relative tolerance {number(solution.rtol)}, absolute {number(solution.atol, 3)}",
        ),
        ("Effort", f"{solution.counts.steps} steps, {solution.counts.rates} evaluations of the rate"),
    ]


def admissibility(subject: Subject) -> Section:
    """Every hypothesis of the theory on the material, judged."""
    verdicts = subject.solution.model.material.admissibility()
    rows = [
        {
            "name": each.name[0].upper() + each.name[1:],
            "holds": each.holds,
            "margin": number(each.margin, 3),
            "sentence": pretty(each.sentence),
        }
        for each in verdicts
    ]
    failed = [row["name"] for row in rows if not row["holds"]]
    return Section("admissibility", "May the theory be applied?", {"rows": rows, "failed": failed, "count": len(rows)})


def pictures(subject: Subject) -> Section:
    """The pictures with their captions, the film first."""
    words = captions(subject.seen)
    drawn = [
        {"key": name, "src": svg_uri(name, subject.solution), "caption": words[name]}
        for name in ("shapes", "natural", "energies", "curvature_map", "loads")
    ]
    moving = None
    if subject.film_seconds > 0.0 and subject.seen.t.size > 1:
        made = list(frames(subject.solution, max(round(subject.film_seconds * FPS), 2), FILM_WIDTH))
        moving = {
            "src": gif_uri(made, FPS),
            "still": still_uri(made[-1]),
            "caption": words["film"],
            "width": made[0].width,
            "height": made[0].height,
        }
    return Section("pictures", "What happened", {"film": moving, "figures": drawn})


def events(subject: Subject) -> Section:
    """What happened on the way, in order of time."""
    found = subject.solution.events
    rows = [(subject.write(event.t, "time"), event.sentence[0].upper() + event.sentence[1:]) for event in found]
    return Section(
        "events",
        "Events",
        {"rows": [(when, pretty(what)) for when, what in rows[:MOST_EVENTS]], "more": max(len(rows) - MOST_EVENTS, 0)},
    )


def ledger(subject: Subject) -> Section:
    """The balance sheet of the energy, and whether it balances."""
    sheet, write = subject.solution.ledger, subject.write
    rows = [
        ("Work of the loads", "put in by the loads", sheet.work),
        ("Change of the stored energy", "held by the bent rod and its material", sheet.stored_energy),
        ("Viscous dissipation", "lost to the rate of bending", sheet.viscous_dissipation),
        ("Dissipation of the natural curvature", "lost to yielding: the price of the set", sheet.natural_dissipation),
    ]
    if sheet.kinetic_energy != 0.0:
        rows.append(("Kinetic energy", "of the moving rod", sheet.kinetic_energy))
    allowed = LEDGER_SLACK * subject.solution.rtol * sheet.largest_energy
    return Section(
        "ledger",
        "The ledger",
        {
            "rows": [(name, words, write(value, "energy")) for name, words, value in rows],
            "residual": write(sheet.residual, "energy"),
            "balances": abs(sheet.residual) <= allowed,
            "judgement": _judgement(subject, abs(sheet.residual), allowed),
        },
    )


def _judgement(subject: Subject, left: float, allowed: float) -> str:
    write = subject.write
    if allowed == 0.0:
        return "Nothing was put in, stored or lost, so there is nothing to balance."
    limit = (
        f"{write(allowed, 'energy')}, which is 100 times the tolerance of the computation times the largest energy met"
    )
    if left > allowed:
        return (
            f"The books do not balance: {write(left, 'energy')} are left over, more than {limit}. "
            "Compute again with a smaller tolerance before relying on this result."
        )
    if left == 0.0:
        return f"The books balance to the last digit; up to {limit} would be accepted."
    return f"The books balance: {write(left, 'energy')} are left over, {number(left / allowed, 2)} of what is accepted ({limit})."


def promises(subject: Subject) -> Section:
    """The a-priori bounds, with what was met on the way."""
    solution = subject.solution
    n, w = solution.model.grid.size, solution.model.grid.w
    y, bound = solution.history.y, solution.bounds
    mu, mu_nat = y[:, :n], y[:, n]
    bending = np.sqrt((mu - mu_nat[:, None]) ** 2 @ w)
    stored = 0.5 * bending**2 + solution.model.laws.preference.value(mu_nat)
    met = (
        ("Stored energy, in EI/L", bound.energy, stored),
        ("Distance of the rod from its natural shape, ‖μ − μ°‖", bound.bending, bending),
        ("Natural curvature |μ°|, in 1/L", bound.natural_curvature, np.abs(mu_nat)),
        ("Size of the state, ‖μ‖ + |μ°|", bound.norm, np.sqrt(mu**2 @ w) + np.abs(mu_nat)),
        ("Drive |D|, in EI", bound.drive, np.abs(solution.model.drive(mu, mu_nat))),
    )
    rows = [
        (name, number(float(most)), number(float(values.max())), _used(float(values.max()), float(most)))
        for name, most, values in met
    ]
    kept = all(float(values.max()) <= most * (1.0 + 1e-9) + 1e-12 for _, most, values in met)
    given = bool(np.isfinite(bound.energy))
    return Section(
        "promises",
        "What the theory promised beforehand",
        {"rows": rows, "kept": kept, "given": given, "growth": number(bound.growth, 3)},
    )


def _used(value: float, most: float) -> str:
    return f"{number(100.0 * value / most, 2)} %" if np.isfinite(most) and most > 0.0 else "–"


_PROVENANCE_WORDS: Final = {
    "plastica_version": "Version of plastica",
    "method": "Solver",
    "rtol": "Relative tolerance",
    "atol": "Absolute tolerance",
    "steps": "Steps",
    "rate_evaluations": "Evaluations of the rate",
    "jacobian_evaluations": "Evaluations of the Jacobian",
    "restarts": "Restarts at switches and knots",
    "nodes": "Nodes",
    "initial_curvature": "Initial curvature",
    "platform": "Platform",
    "file": "Scenario file",
}
_SHOWN_ELSEWHERE: Final = ("scenario", "notes", "title", "description")


def origin(subject: Subject) -> Section:
    """Where the result comes from, the scenario word for word, and the literature."""
    entries = provenance(subject.solution)
    rows = [
        (
            _PROVENANCE_WORDS.get(key, key.replace("_", " ").capitalize()),
            number(value) if isinstance(value, float) else str(value),
        )
        for key, value in entries.items()
        if key not in _SHOWN_ELSEWHERE and value != ""
    ]
    method = subject.solution.method
    return Section(
        "origin",
        "Where this comes from",
        {
            "rows": rows,
            "scenario": entries.get("scenario", ""),
            "references": [text for i, text in enumerate(REFERENCES) if i == 0 or method in text],
        },
    )


SECTIONS: Final[tuple[Callable[[Subject], Section | None], ...]] = (
    verdict,
    meaning,
    parameters,
    admissibility,
    pictures,
    events,
    ledger,
    promises,
    origin,
)
"""The sections in the order a reader needs them."""
