"""Sections of a report on what was put in: specimen, laws, loads, start, and whether the theory covers them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final

import numpy as np

from plastica.material import catalogue
from plastica.motion.solution import Solution
from plastica.physics.load import LOAD_KINDS
from plastica.physics.model import Model
from plastica.physics.rod import Rod
from plastica.show.panels import LOAD_WORDS
from plastica.show.subject import Section, Subject
from plastica.show.words import number, parameter, pretty
from plastica.units import looks_like_quantity

__all__ = ["admissibility", "parameters"]

EULER: Final = 0.25 * np.pi**2
"""Dimensionless thrust at which a straight elastic strut, clamped below and free above, buckles."""


def parameters(subject: Subject) -> Section:
    """What was put in: model, specimen, dimensionless groups, laws, load, initial shape, grid, solver."""
    solution = subject.solution
    model, material = solution.model, solution.model.material
    data = {
        "model": _model(model),
        "specimen": _specimen(model),
        "material": material.name,
        "source": material.source,
        "about": _about(material.name),
        "laws": _laws(model),
        "values": [(name, pretty(parameter(value))) for name, value in material.parameters.items()],
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
    "mass_per_length": ("ρA", "Mass per length"),
    "rotary_inertia": ("ρJ", "Rotary inertia per length"),
    "density": ("ρ", "Density"),
}
_SPECIMEN_UNITS: Final = {
    "length": "m",
    "bending_stiffness": "N*m**2",
    "youngs_modulus": "Pa",
    "retardation_time": "s",
    "temperature": "K",
    "mass_per_length": "kg/m",
    "rotary_inertia": "kg*m",
    "density": "kg/m**3",
}


def _model(model: Model) -> str:
    """The model in a sentence: with inertia or without, and in how many segments it remembers."""
    if isinstance(model, Rod) and model.has_inertia:
        words = "A rod with inertia: it swings, and waves run along it"
        words += "." if model.damping else "; without viscosity only yielding calms it."
    else:
        words = "A rod without inertia: it is so light and slow that it is in balance with its loads at all times."
    if model.segments == 1:
        return f"{words} Its natural curvature is the same along its whole length."
    return f"{words} Its natural curvature is uniform on each of {model.segments} segments, each with its own."


def _specimen(model: Model) -> list[tuple[str, str, str]]:
    if model.specimen is None:
        return []
    rows = []
    for name, value in model.specimen.as_given.items():
        symbol, words = _SPECIMEN_WORDS[name]
        rows.append((symbol, words, _as_given(value, _SPECIMEN_UNITS.get(name, ""))))
    if "bending_stiffness" not in model.specimen.as_given:
        rows.append(("EI", "Bending stiffness, from the two", pretty(f"{model.specimen.EI:.5g} N*m**2")))
    if "retardation_time" not in model.specimen.as_given:
        rows.append(("T", "Scale of time, from mass and stiffness", pretty(f"{model.specimen.T:.5g} s")))
    return rows


def _as_given(value: Any, unit: str) -> str:
    if isinstance(value, Mapping):
        sizes = (f"{key.replace('_', ' ')} {_as_given(each, 'm')}" for key, each in value.items() if key != "shape")
        return ", ".join([str(value["shape"]), *sizes])
    return pretty(value if isinstance(value, str) else f"{value:g} {unit}".strip())


def _laws(model: Model) -> list[dict[str, str]]:
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
    weight = ", weights per length in EI/L³" if "weight" in dict(subject.solution.model.loads.sources()) else ""
    return f"{words} (forces in EI/L², couples in EI/L{weight}, times in T)"


def _start(subject: Subject) -> list[tuple[str, str]]:
    solution = subject.solution
    model, first = solution.model, solution.history.y[0]
    natural = np.atleast_1d(model.layout.natural(first))
    shown = [subject.of_scale(float(each), "curvature") for each in natural]
    if len(set(shown)) == 1:
        shown = shown[:1]
    rows = [
        ("Initial curvature", _initial(solution.initial, subject)),
        ("Initial natural curvature", _listed(shown)),
    ]
    if model.segments > 1:
        ends = [subject.of_scale(float(each), "length") for each in model.division.breaks[1:-1]]
        rows.append(("Segments", f"{model.segments}, cut at {_listed(ends)} from the clamp"))
    mu_t = model.layout.mu_t(first)
    if mu_t is not None:
        moving = float(np.abs(mu_t).max()) > 0.0
        rows.append(("Initial velocity", _initial_velocity(subject) if moving else "at rest"))
    return rows


def _initial_velocity(subject: Subject) -> str:
    along, across = (float(each[0, 0]) for each in subject.seen.velocities(subject.seen.t[:1], np.array([1.0])))
    size = subject.write(float(np.hypot(along, across)), "velocity")
    return f"in motion; the free end at {size}"


MOST_LISTED: Final = 8


def _listed(words: list[str]) -> str:
    """Words in a row; of a long list the first ones, and the last."""
    if len(words) > MOST_LISTED:
        words = [*words[: MOST_LISTED - 2], "…", words[-1]]
    return ", ".join(words)


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
    laws, began = model.laws, np.atleast_1d(model.layout.natural(history.y[0]))
    threshold, stiffness = laws.threshold.value(began), laws.preference.second(began)
    rows = [
        *_load_groups(subject),
        ("Θ/EI", "Threshold at the first natural curvature", _between(threshold)),
        ("κ″/EI", "Stiffness of the preference energy there", _between(stiffness)),
    ]
    if isinstance(model, Rod):
        rows += [
            ("ε₁", "Translational inertia, ρA L⁴/(EI T²)", number(float(model.translational_inertia or 0.0))),
            ("ε₀", "Rotary inertia, ρJ L²/(EI T²)", number(float(model.rotary_inertia or 0.0))),
            ("δ", "Damping, retardation time over T", number(float(model.damping or 0.0))),
        ]
    unit = "retardation times" if model.damping == 1.0 else "units of T"
    return [*rows, ("t/T", f"Length of the run in {unit}", number(history.end - history.start))]


_LOAD_SYMBOLS: Final = {"transverse": ("τ", "EI/L²"), "couple": ("m₁", "EI/L"), "weight": ("w", "EI/L³")}


def _load_groups(subject: Subject) -> list[tuple[str, str, str]]:
    """The largest push, the largest pull, and the largest magnitude of every other load."""
    loads, t = subject.solution.model.loads, subject.seen.sampled.t

    def values(name: str) -> Any:
        return np.asarray(getattr(loads, name)(t), dtype=float)

    push, pull = float(values("thrust").max()), -float(values("thrust").min())
    euler = f"{number(push)}, or {number(push / EULER, 3)} times the Euler load of a straight elastic strut"
    rows = [("γ", "Largest thrust, in EI/L²", euler if push > 0.0 else "no thrust")]
    if pull > 0.0:
        rows.append(("−γ", "Largest tension, in EI/L²", number(pull)))
    for name in LOAD_KINDS:
        if name in _LOAD_SYMBOLS and name in dict(loads.sources()):
            symbol, unit = _LOAD_SYMBOLS[name]
            largest = float(np.abs(values(name)).max())
            rows.append((symbol, f"Largest {LOAD_WORDS[name].lower()}, in {unit}", number(largest)))
    return rows


def _between(values: Any) -> str:
    """One number, or the least and the greatest of several."""
    low, high = number(float(np.min(values))), number(float(np.max(values)))
    return low if low == high else f"{low} to {high}"


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
