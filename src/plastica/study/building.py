"""From the sections of a scenario to the nouns of the package: specimen, material, load, shape, grid."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from plastica.errors import ArgumentError, shown
from plastica.material import catalogue
from plastica.material.dimensions import dimension_of_tree
from plastica.material.material import Material
from plastica.motion.solution import Solution
from plastica.motion.store import read
from plastica.numerics.grid import Grid
from plastica.physics import programs
from plastica.physics.initial import Curvature, Shape, piecewise
from plastica.physics.load import LOAD_KINDS, Load
from plastica.physics.program import Program
from plastica.physics.scales import KINDS, Specimen
from plastica.study import schema
from plastica.study.fields import check_formula
from plastica.study.measured import measured_shape
from plastica.study.problems import Problems
from plastica.study.tokens import KeyPath
from plastica.units import DIMENSIONLESS, dimension_of, dimension_text, parse_quantity, quantity

__all__ = ["SMOOTHING_WORDS", "Start", "grid", "initial", "inside", "load", "material", "number", "specimen"]

SMOOTHING_WORDS: Final = ("auto", "none")

_LAWS: Final = {
    "preference": ("m", "1/m", "N"),
    "flow": ("x", "N*m**2", "1/(m*s)"),
    "threshold": ("m", "1/m", "N*m**2"),
}
_FUNCTIONS: Final[Mapping[str, Callable[..., Program]]] = {
    "constant": programs.constant,
    "table": programs.table,
    "ramp-hold-release": programs.ramp_hold_release,
    "cycles": programs.cycles,
    "expression": programs.expression,
}


@dataclass(frozen=True, eq=False)
class Start:
    """Where a run begins: curvature and natural curvature as `solve` takes them, or a solution to go on from."""

    curvature: Curvature
    natural_curvature: float
    solution: Solution | None


def number(value: float | str, unit: str) -> float:
    """Return an amount that the schema has accepted as a number, in SI if it has a unit."""
    return quantity(value, unit, where="", bare=True)


def specimen(section: schema.Specimen, problems: Problems) -> Specimen | None:
    """Make the specimen."""
    given = section.model_dump(exclude_none=True)
    with problems.at("specimen"):
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
                problems.add(path, schema.unknown_key(name, tuple(known)))
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


def load(section: schema.Load, problems: Problems, *, si: bool) -> Load | None:
    """Make the loads."""
    made: dict[str, Any] = {}
    for name, kind in LOAD_KINDS.items():
        value, path = getattr(section, name), ("load", name)
        if value is None:
            continue
        unit = KINDS[kind][0]
        if isinstance(value, dict):
            program = _program(value, path, problems, si=si, unit=unit)
            if program is not None:
                made[name] = program
        else:
            amount = check_formula(value, path, problems, si=si, unit=unit, variable="t")
            if amount is not None:
                made[name] = amount
    for name, each in made.items():
        with problems.at("load"):
            Load(**{name: each})
    return None if problems.within("load") else Load(**made)


def _program(value: dict[str, Any], path: KeyPath, problems: Problems, *, si: bool, unit: str) -> Program | None:
    known = ", ".join(schema.PROGRAMS)
    kind = value.get("program")
    if "program" not in value:
        problems.add((*path, "program"), f"is missing: it must be one of {known}.")
        return None
    if not isinstance(kind, str) or kind not in schema.PROGRAMS:
        problems.add((*path, "program"), f"must be one of {known}, but is {shown(kind)}.")
        return None
    checked = schema.validate(schema.PROGRAMS[kind], value, path, problems, si=si, unit=unit)
    if checked is None:
        return None
    given = checked.model_dump(exclude_none=True, exclude={"program"})
    with problems.at(*path):
        return _FUNCTIONS[kind](**given)
    return None


def grid(section: schema.Grid, length: float | None, problems: Problems) -> Grid | None:
    """Make the grid; `breaks` are the ends of elements inside the rod."""
    if length is None and section.breaks:
        return None
    inner = [number(each, "m") / (length or 1.0) for each in section.breaks]
    outside = [i for i, each in enumerate(inner) if not 0.0 < each < 1.0]
    for i in outside:
        problems.add(("grid", "breaks", i), f"must lie inside the rod, but is {shown(section.breaks[i])}.")
    if outside:
        return None
    with problems.at("grid"):
        return Grid(section.nodes, (0.0, *inner, 1.0))  # type: ignore[arg-type]
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


def initial(section: schema.Initial, folder: Path, length: float | None, problems: Problems, *, si: bool) -> Start:
    """Make the initial curvature and natural curvature, or the solution to go on from."""
    natural = 0.0 if section.natural_curvature is None else number(section.natural_curvature, "1/m")
    if section.result is not None:
        return Start(0.0, 0.0, _former(section, folder, problems))
    value, path = section.curvature, ("initial", "curvature")
    if value is None:
        return Start(0.0, natural, None)
    if not isinstance(value, dict):
        amount = check_formula(value, path, problems, si=si, unit="1/m", variable="s")
        return Start(0.0 if amount is None else amount, natural, None)
    build = _measured if "csv" in value else _pieces
    shape = build(value, folder, length, problems, si=si)
    return Start(0.0 if shape is None else shape, natural, None)


def _former(section: schema.Initial, folder: Path, problems: Problems) -> Solution | None:
    for name in ("curvature", "natural_curvature"):
        if getattr(section, name) is not None:
            problems.add(
                ("initial", name),
                "cannot stand beside `result`, whose last state is the start. Remove one of them.",
            )
    with problems.at("initial", "result"):
        return read(inside(folder, str(section.result)))
    return None


def _pieces(
    value: dict[str, Any], _folder: Path, length: float | None, problems: Problems, *, si: bool
) -> Shape | None:
    path = ("initial", "curvature")
    checked = schema.validate(schema.Pieces, value, path, problems, si=si, unit="1/m", variable="s")
    if checked is None:
        return None
    ends = [number(each, "m") for each in checked.breaks]
    for i, each in enumerate(ends):
        if length is not None and not 0.0 < each < length:
            problems.add((*path, "breaks", i), f"must lie inside the rod, but is {shown(checked.breaks[i])}.")
    with problems.at(*path):
        return piecewise(ends, checked.pieces)
    return None


def _measured(
    value: dict[str, Any], folder: Path, length: float | None, problems: Problems, *, si: bool
) -> Shape | None:
    path = ("initial", "curvature")
    checked = schema.validate(schema.Measured, value, path, problems, si=si)
    if checked is None or length is None:
        return None
    with problems.at(*path):
        return measured_shape(
            _csv(folder, checked.csv),
            checked.columns,
            length,
            si=si,
            length_unit=checked.length_unit,
            curvature_unit=checked.curvature_unit,
            smoothing=_smoothing(checked.smoothing),
        )
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
