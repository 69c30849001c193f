"""Sections of a report on what was put in: specimen, laws, loads, start, and whether the theory covers them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final

import numpy as np

from plastica.material import catalogue
from plastica.motion.solution import Solution
from plastica.physics.strut import Strut
from plastica.show.subject import Section, Subject
from plastica.show.words import number, pretty
from plastica.units import looks_like_quantity

__all__ = ["admissibility", "parameters"]

EULER: Final = 0.25 * np.pi**2
"""Dimensionless thrust at which a straight elastic strut, clamped below and free above, buckles."""


def parameters(subject: Subject) -> Section:
    """What was put in: specimen, dimensionless groups, laws, load, initial shape, grid, solver."""
    solution = subject.solution
    model, material = solution.model, solution.model.material
    data = {
        "specimen": _specimen(model),
        "material": material.name,
        "source": material.source,
        "about": _about(material.name),
        "laws": _laws(model),
        "values": [
            (name, pretty(value) if isinstance(value, str) else number(value, 6))
            for name, value in material.parameters.items()
        ],
        "load": _load(subject),
        "start": _start(subject),
        "groups": _groups(subject),
        "numerics": _numerics(solution),
        "dimensionless": subject.seen.dimensionless,
    }
    return Section("parameters", "What was put in", data)


def _about(name: str | None) -> str:
    """What the catalogue says about a named material: its title and first sentence."""
    if name not in catalogue.names():
        return ""
    entry = catalogue.describe(name)
    return pretty(f"{entry.title}. {entry.words.split('. ')[0].rstrip('.')}.")


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
    if isinstance(value, Mapping):
        sizes = (f"{key.replace('_', ' ')} {_as_given(each, 'm')}" for key, each in value.items() if key != "shape")
        return ", ".join([str(value["shape"]), *sizes])
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


def _load(subject: Subject) -> str:
    words = pretty(subject.solution.model.load.describe(si=not subject.seen.dimensionless))
    if not subject.seen.dimensionless or not subject.solution.model.loads.sources():
        return words
    return f"{words} (forces in EI/L², couples in EI/L, times in T)"


def _start(subject: Subject) -> list[tuple[str, str]]:
    solution = subject.solution
    began = float(solution.history.y[0][solution.model.grid.size])
    return [
        ("Initial curvature", _initial(solution.initial, subject)),
        ("Initial natural curvature", subject.of_scale(began, "curvature")),
    ]


def _initial(words: str, subject: Subject) -> str:
    try:
        return subject.write(float(words), "curvature")
    except ValueError:
        pass
    if looks_like_quantity(words):
        return pretty(words)
    return f"{words} ({'in units of 1/L, s in units of L' if subject.seen.dimensionless else 'in 1/m, s in m'})"


def _groups(subject: Subject) -> list[tuple[str, str, str]]:
    model, history = subject.solution.model, subject.solution.history
    laws = model.laws
    largest = float(np.abs(np.asarray(model.loads.thrust(subject.seen.sampled.t), dtype=float)).max())
    began = np.array([float(history.y[0][model.grid.size])])
    return [
        (
            "γ",
            "Largest thrust, in EI/L²",
            f"{number(largest)}, or {number(largest / EULER, 3)} times the Euler load of a straight elastic strut"
            if largest > 0.0
            else "no thrust",
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
