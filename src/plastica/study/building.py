"""From the sections of a scenario to the nouns of the package: specimen, material, load, shape, grid."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from plastica.errors import ArgumentError, PlasticaError, shown
from plastica.material import catalogue
from plastica.material.dimensions import dimension_of_tree
from plastica.material.material import Material
from plastica.motion.solution import Solution
from plastica.motion.store import read
from plastica.numerics.grid import Grid
from plastica.physics.initial import Curvature, Shape, piecewise
from plastica.physics.scales import Specimen
from plastica.physics.segments import segment_breaks
from plastica.study import schema
from plastica.study.fields import check_formula
from plastica.study.fields import given as in_toml
from plastica.study.measured import measured_shape
from plastica.study.problems import Problems
from plastica.study.tokens import KeyPath
from plastica.units import (
    DIMENSIONLESS,
    dimension_of,
    dimension_text,
    looks_like_quantity,
    parse_quantity,
    quantity,
)

__all__ = [
    "SMOOTHING_WORDS",
    "Segments",
    "Start",
    "grid",
    "initial",
    "inside",
    "material",
    "number",
    "segments",
    "sorted_under",
    "specimen",
]

Segments = int | tuple[float, ...]
"""The number of segments of uniform natural curvature, or their ends in units of the length."""

SMOOTHING_WORDS: Final = ("auto", "none")

_LAWS: Final = {
    "preference": ("m", "1/m", "N"),
    "flow": ("x", "N*m**2", "1/(m*s)"),
    "threshold": ("m", "1/m", "N*m**2"),
}


@dataclass(frozen=True, eq=False)
class Start:
    """Where a run begins: curvatures and their rate as `solve` takes them, or a solution to go on from."""

    curvature: Curvature = 0.0
    natural_curvature: float | tuple[float, ...] = 0.0
    curvature_rate: Curvature = 0.0
    solution: Solution | None = None


@contextmanager
def sorted_under(problems: Problems, section: str) -> Iterator[None]:
    """Catch what a constructor refuses: under the section that has the key it names, by default `section`."""
    try:
        yield
    except PlasticaError as error:
        first = re.split(r"[.\[]", error.where)[0]
        homes = [name for name, model in schema.SECTIONS.items() if first in model.model_fields]
        problems.add_error((section if section in homes or not homes else homes[0],), error)


def number(value: float | str, unit: str) -> float:
    """Return an amount that the schema has accepted as a number, in SI if it has a unit."""
    return quantity(value, unit, where="", bare=True)


def specimen(section: schema.Specimen, mass: schema.Inertia | None, problems: Problems) -> Specimen | None:
    """Make the specimen, with its mass; None as well where its mistakes are known already."""
    given = section.model_dump(exclude_none=True)
    if mass is not None:
        given |= mass.model_dump(exclude_none=True, include={"mass_per_length", "density", "rotary_inertia"})
    elif section.retardation_time is None:
        return None
    if problems.within("specimen", "inertia"):
        return None
    with sorted_under(problems, "specimen"):
        return Specimen(**given)
    return None


def material(section: schema.Material, rod: Specimen | None, problems: Problems, *, si: bool) -> Material | None:
    """Make the material: from the catalogue where no law is given, else of the three laws."""
    laws = {name: getattr(section, name) for name in _LAWS}
    _check_parameters(section, problems, si=si)
    if all(law is None for law in laws.values()):
        return _from_catalogue(section, rod, problems, si=si)
    for name, law in laws.items():
        if law is None:
            problems.add(("material", name), "is missing: a material has a preference, a flow and a threshold.")
    if problems.within("material"):
        return None
    with problems.at("material"):
        made = Material(**laws, parameters=section.parameters, name=section.name)
        if si:
            _check_units(made, problems)
        return made
    return None


def _check_parameters(section: schema.Material, problems: Problems, *, si: bool) -> None:
    if si:
        return
    for name, value in section.parameters.items():
        if isinstance(value, str):
            rule = f"must be a plain number in a dimensionless scenario, but is {shown(value)}."
            problems.add(("material", "parameters", name), f'{rule} Quantities with units need units = "SI".')


def _from_catalogue(section: schema.Material, rod: Specimen | None, problems: Problems, *, si: bool) -> Material | None:
    if section.name is None:
        rule = "must name a material of the catalogue, or have the laws `preference`, `flow` and `threshold`."
        problems.add(("material",), f"{rule} The catalogue has: {', '.join(catalogue.names())}.")
        return None
    with problems.at("material"):
        known = {parameter.name: parameter for parameter in catalogue.describe(section.name).parameters}
        for name, value in section.parameters.items():
            path = ("material", "parameters", name)
            if name not in known:
                schema.add_unknown(problems, path, tuple(known))
            elif si and known[name].dimension != "1" and not isinstance(value, str):
                problems.add(path, f"needs a unit: it is a quantity in {known[name].dimension}, but is {shown(value)}.")
        if problems.within("material") or (si and rod is None):
            return None
        scales = {"length": rod.L, "stiffness": rod.EI, "time": rod.T} if rod is not None else {}
        return catalogue.material(section.name, **scales, **section.parameters)
    return None


def _check_units(made: Material, problems: Problems) -> None:
    """Hold the laws to their dimensions, where a number without a unit is a pure number."""
    for law, (variable, argument, due) in _LAWS.items():
        expression = made.expressions[law]
        known = {
            name: parse_quantity(text, where=name)[1]
            if isinstance(text := made.parameters[name], str)
            else DIMENSIONLESS
            for name in expression.parameters
        }
        bare = [name for name, dimension in known.items() if dimension == DIMENSIONLESS]
        known[variable] = dimension_of(argument)
        with problems.at("material"):
            found = dimension_of_tree(expression.tree, known, made.values, where=law, text=expression.text)
            if found is not None and found != dimension_of(due):
                what = f"with {' and '.join(bare)} without a unit " if bare else ""
                rule = f"must come to {due}, but {shown(expression.text)} {what}comes to {dimension_text(found)}."
                problems.add(
                    ("material", law),
                    f'{rule} Give its parameters as text with units, such as h = "0.01 N*m**2".',
                )


def grid(section: schema.Grid, length: float | None, problems: Problems) -> Grid | None:
    """Make the grid; `breaks` are the ends of elements inside the rod."""
    if length is None and section.breaks:
        return None
    ends = _ends(section.breaks, length or 1.0, ("grid", "breaks"), problems)
    if ends is None:
        return None
    with problems.at("grid"):
        return Grid(section.nodes, ends)  # type: ignore[arg-type]
    return None


def inside(folder: Path, name: str) -> Path:
    """Return the path of a file named in a scenario, which must lie in the folder of the scenario.

    Raises
    ------
    ArgumentError
        Where the name is absolute, goes up, or leads out of the folder by a link.
    """
    rule = "must name a file in the folder of the scenario, or in a folder within it"
    parts = name.replace("\\", "/").split("/")
    if not name or ".." in parts or name.startswith(("/", "\\", "~")) or ":" in name:
        raise ArgumentError(rule, value=name, next_step="Copy the file there, and give its name.")
    path = folder / name
    try:
        contained = path.resolve().is_relative_to(folder.resolve())
    except (OSError, RuntimeError):
        contained = False
    if not contained:
        raise ArgumentError(f"{rule}, without links that lead out of it", value=name)
    return path


def named_files(initial: Mapping[str, Any]) -> list[str]:
    """Return the names of the files that a table [initial] reads: a measured shape, a former result."""
    shape = initial.get("curvature")
    measured = [shape["csv"]] if isinstance(shape, dict) and "csv" in shape else []
    return [*measured, *([initial["result"]] if "result" in initial else [])]


def segments(section: schema.Grid, length: float | None, problems: Problems, *, si: bool) -> Segments:
    """Return the segments of uniform natural curvature: their number, or their ends in units of L; 1 by mistake."""
    given, path = section.natural_segments, ("grid", "natural_segments")
    if given is None:
        return 1
    if not isinstance(given, list):
        if isinstance(given, int) and not isinstance(given, bool):
            with problems.at("grid"):
                segment_breaks(given)
            return given
        rule = "must be a whole number, or an array of the lengths at which segments meet, but is"
        problems.add(path, f"{rule} {in_toml(given)}.")
        return 1
    checked = schema.validate(schema.NaturalSegments, {path[1]: given}, path[:1], problems, si=si)
    if checked is None or length is None:
        return 1
    ends = _ends(checked.natural_segments, length, path, problems) or 1
    with problems.at("grid"):
        segment_breaks(ends)
    return ends


def _ends(inner: Sequence[float | str], length: float, path: KeyPath, problems: Problems) -> tuple[float, ...] | None:
    """Return places inside the rod, with its ends, in units of the length."""
    places = [number(each, "m") / length for each in inner]
    wrong = {i: "inside the rod" for i, each in enumerate(places) if not 0.0 < each < 1.0}
    for i in range(1, len(places)):
        if places[i] <= places[i - 1]:
            wrong.setdefault(i, f"beyond the place before it, {shown(inner[i - 1])}")
    for i, rule in wrong.items():
        problems.add((*path, i), f"must lie {rule}, but is {shown(inner[i])}.")
    return None if wrong else (0.0, *places, 1.0)


def initial(section: schema.Initial, folder: Path, length: float | None, problems: Problems, *, si: bool) -> Start:
    """Make the initial curvature, natural curvature and rate of curvature, or the solution to go on from."""
    if section.result is not None:
        return Start(solution=_former(section, folder, problems))
    return Start(
        _curvature(section.curvature, folder, length, problems, si=si),
        _natural_curvature(section.natural_curvature, problems, si=si),
        _rate(section.curvature_rate, length, problems, si=si),
    )


def _curvature(value: object, folder: Path, length: float | None, problems: Problems, *, si: bool) -> Curvature:
    path: KeyPath = ("initial", "curvature")
    if value is None:
        return 0.0
    if not isinstance(value, dict):
        amount = check_formula(value, path, problems, si=si, unit="1/m", variable="s")
        return 0.0 if amount is None else amount
    if _is_measured(value):
        shape = _measured(value, folder, length, problems, si=si)
    else:
        shape = _pieces(value, path, length, problems, si=si, unit="1/m")
    return 0.0 if shape is None else shape


def _is_measured(value: Mapping[str, object]) -> bool:
    """Tell whether a table is about measured points, by the words that its keys are, or were meant to be."""
    measured, pieces = schema.Measured.model_fields, schema.Pieces.model_fields
    meant = {schema.nearest(key, (*measured, *pieces)) for key in value}
    return "csv" in value or ("pieces" not in value and "csv" in meant)


def _natural_curvature(value: object, problems: Problems, *, si: bool) -> float | tuple[float, ...]:
    """Return one natural curvature, or one for each segment."""
    if value is None:
        return 0.0
    given, path = {"natural_curvature": value}, ("initial",)
    if isinstance(value, list):
        row = schema.validate(schema.NaturalCurvatures, given, path, problems, si=si)
        return 0.0 if row is None else tuple(number(each, "1/m") for each in row.natural_curvature)
    one = schema.validate(schema.NaturalCurvature, given, path, problems, si=si)
    return 0.0 if one is None else number(one.natural_curvature, "1/m")


def _rate(value: object, length: float | None, problems: Problems, *, si: bool) -> Curvature:
    """Return the initial rate of curvature: as the curvature, but measured points have none."""
    path, unit = ("initial", "curvature_rate"), "1/(m*s)"
    if value is None:
        return 0.0
    made: Curvature | None
    if isinstance(value, dict):
        made = _pieces(value, path, length, problems, si=si, unit=unit)
    else:
        made = check_formula(value, path, problems, si=si, unit=unit, variable="s")
    return 0.0 if made is None else made


def _former(section: schema.Initial, folder: Path, problems: Problems) -> Solution | None:
    for name in ("curvature", "natural_curvature", "curvature_rate"):
        if getattr(section, name) is not None:
            problems.add(
                ("initial", name),
                "cannot stand beside `result`, whose last state is the start. Remove one of them.",
            )
    with problems.at("initial", "result"):
        return read(inside(folder, str(section.result)))
    return None


def _pieces(
    value: dict[str, Any], path: KeyPath, length: float | None, problems: Problems, *, si: bool, unit: str
) -> Shape | None:
    checked = schema.validate(schema.Pieces, value, path, problems, si=si, unit=unit, variable="s")
    if checked is None:
        return None
    ends = [number(each, "m") for each in checked.breaks]
    for i, each in enumerate(ends):
        if length is not None and not 0.0 < each < length:
            problems.add((*path, "breaks", i), f"must lie inside the rod, but is {shown(checked.breaks[i])}.")
    # `piecewise` reads curvatures; of a rate, what has a unit is a number by now, and what has not is text in s.
    pieces = [
        number(each, unit) if unit != "1/m" and looks_like_quantity(str(each)) else each for each in checked.pieces
    ]
    with problems.at(*path):
        return piecewise(ends, pieces)
    return None


def _measured(
    value: dict[str, Any], folder: Path, length: float | None, problems: Problems, *, si: bool
) -> Shape | None:
    path = ("initial", "curvature")
    checked = schema.validate(schema.Measured, value, path, problems, si=si)
    if checked is None or length is None:
        return None
    with problems.at(*path):
        shape = measured_shape(
            _csv(folder, checked.csv),
            checked.columns,
            length,
            si=si,
            length_unit=checked.length_unit,
            curvature_unit=checked.curvature_unit,
            smoothing=_smoothing(checked.smoothing),
        )
        return shape if checked.factor == 1.0 else shape.times(checked.factor)
    return None


def _csv(folder: Path, name: str) -> Path:
    try:
        return inside(folder, name)
    except ArgumentError as error:
        raise ArgumentError(error.rule, where="csv", value=name, next_step=error.next_step) from None


def _smoothing(value: object) -> float | None:
    if value == "auto":
        return None
    if value == "none":
        return 0.0
    if isinstance(value, bool) or not isinstance(value, int | float) or not 0.0 <= value <= 1e6:
        words = " or ".join(f'"{word}"' for word in SMOOTHING_WORDS)
        raise ArgumentError(f"must be {words}, or a weight from 0 to 1e6", where="smoothing", value=value)
    return float(value)
