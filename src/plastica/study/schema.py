"""What may stand in a scenario file (schema 1): the sections, their keys and what each key takes.

pydantic reports all mistakes of a section at once; `validate` puts them into the words of this package.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from difflib import get_close_matches
from typing import Annotated, Any, Final, Literal, TypeVar

from pydantic import BaseModel, ConfigDict, ValidationError
from pydantic_core import ErrorDetails

from plastica.motion.plan import check_max_steps, check_method, check_rtol
from plastica.study import fields
from plastica.study.problems import Problems
from plastica.study.tokens import KeyPath

__all__ = [
    "PROGRAMS",
    "SECTIONS",
    "Grid",
    "Head",
    "Inertia",
    "Initial",
    "Load",
    "Material",
    "Measured",
    "NaturalCurvature",
    "NaturalCurvatures",
    "NaturalSegments",
    "Output",
    "Pieces",
    "Section",
    "Solve",
    "Spacing",
    "Specimen",
    "Times",
    "add_unknown",
    "nearest",
    "unknown_key",
    "validate",
]


class Section(BaseModel):
    """A table of the file; keys that it does not know are mistakes."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True)


class Head(BaseModel):
    """What stands above the first section."""

    model_config = ConfigDict(extra="ignore", frozen=True, strict=True)
    units: Literal["SI", "dimensionless"]
    title: fields.Text = ""


class CrossSection(Section):
    """The cross section of the rod."""

    shape: Literal["rectangle", "circle", "tube"]
    width: fields.Length | None = None
    thickness: fields.Length | None = None
    diameter: fields.Length | None = None
    outer_diameter: fields.Length | None = None
    inner_diameter: fields.Length | None = None
    wall: fields.Length | None = None


class Specimen(Section):
    """The rod on the bench."""

    length: fields.Length
    retardation_time: fields.Time | None = None
    youngs_modulus: fields.Pascal | None = None
    section: CrossSection | None = None
    bending_stiffness: fields.Stiffness | None = None
    temperature: fields.Kelvin | None = None


class Inertia(Section):
    """What makes the rod one with inertia: its mass in a scenario with units, plain numbers in one without."""

    mass_per_length: fields.MassPerLength | None = None
    density: fields.Density | None = None
    rotary_inertia: fields.RotaryInertia | None = None
    translational_inertia: fields.Number | None = None
    damping: fields.Number | None = None


class Material(Section):
    """A material of the catalogue, or three laws."""

    name: fields.Text | None = None
    preference: fields.Law | None = None
    flow: fields.Law | None = None
    threshold: fields.Law | None = None
    parameters: fields.Parameters = {}
    allow_inadmissible: fields.Flag = False


class Load(Section):
    """The dead loads: each a number, text, or a program (see `PROGRAMS`)."""

    thrust: Any = None
    transverse: Any = None
    couple: Any = None
    weight: Any = None
    weight_angle: fields.Angle | None = None
    force: Any = None
    angle: fields.Angle | None = None
    allow_tension: fields.Flag | None = None


class Initial(Section):
    """The shape that the rod starts from, or a former result."""

    curvature: Any = None
    natural_curvature: Any = None
    curvature_rate: Any = None
    result: fields.FilePath | None = None


class Grid(Section):
    """Where the curvature is kept, and on which segments the natural curvature is uniform."""

    nodes: fields.Nodes = "auto"
    breaks: fields.Lengths = []
    natural_segments: Any = None


class Solve(Section):
    """How far, how accurately, and what to report."""

    until: fields.Until
    rtol: Annotated[fields.Number, fields.checked(check_rtol)] = 1e-8
    atol: fields.Curvature | None = None
    method: Annotated[fields.Word, fields.checked(check_method)] = "auto"
    times: Any = None
    max_steps: Annotated[fields.Whole, fields.checked(check_max_steps)] | None = None


class Output(Section):
    """What is written."""

    name: fields.BaseName | None = None
    report: fields.Flag = True
    film: Literal["none", "gif", "mp4"] = "gif"
    csv: fields.Words = []


class RampHoldRelease(Section):
    """Up, held, and down again."""

    program: str
    value: fields.Value
    ramp: fields.Time
    hold: fields.Time
    release: fields.Time
    start: fields.Time | None = None
    rest: fields.Value | None = None


class Cycles(Section):
    """Cycles between two loads."""

    program: str
    low: fields.Value
    high: fields.Value
    period: fields.Time
    count: fields.Whole | None = None
    shape: Literal["triangle", "square", "trapezoid", "sine"] = "triangle"
    start: fields.Time | None = None


class Table(Section):
    """Rows (time, load), linear in between."""

    program: str
    times: fields.Times
    values: fields.Values


class Constant(Section):
    """A load that does not change."""

    program: str
    value: fields.Value


class Expression(Section):
    """Text in t with named parameters."""

    program: str
    text: fields.Law
    parameters: fields.Parameters = {}


PROGRAMS: Final[Mapping[str, type[Section]]] = {
    "constant": Constant,
    "table": Table,
    "ramp-hold-release": RampHoldRelease,
    "cycles": Cycles,
    "expression": Expression,
}
"""The load programs by their name in the file."""


class Pieces(Section):
    """A curvature given in pieces between breaks."""

    pieces: fields.Formulas
    breaks: fields.Lengths


class Measured(Section):
    """A curvature from a CSV file of measured points."""

    csv: fields.FilePath
    columns: Literal["s, curvature", "x, y"] = "s, curvature"
    length_unit: fields.Word | None = None
    curvature_unit: fields.Word | None = None
    smoothing: fields.Anything = "auto"
    factor: fields.Number = 1.0


class NaturalCurvature(Section):
    """One natural curvature."""

    natural_curvature: fields.Curvature


class NaturalCurvatures(Section):
    """A natural curvature for each segment."""

    natural_curvature: fields.Curvatures


class NaturalSegments(Section):
    """The places where segments of uniform natural curvature meet."""

    natural_segments: fields.Lengths


class Times(Section):
    """Times of the result, one by one."""

    times: fields.Times


class Spacing(Section):
    """Times of the result, spread over the run."""

    count: fields.Whole
    spacing: Literal["linear", "log"] = "linear"
    first: fields.Time | None = None


SECTIONS: Final[Mapping[str, type[Section]]] = {
    "specimen": Specimen,
    "inertia": Inertia,
    "material": Material,
    "load": Load,
    "initial": Initial,
    "grid": Grid,
    "solve": Solve,
    "output": Output,
}
"""The sections of the file by name."""

Model = TypeVar("Model", bound=BaseModel)


def validate(model: type[Model], value: object, path: KeyPath, problems: Problems, **context: object) -> Model | None:
    """Check one table of the file.

    Parameters
    ----------
    model : type
        What it must be.
    value : object
        What stands there.
    path : tuple
        Where it stands.
    problems : Problems
        Takes the mistakes.
    **context
        `si`, and where needed `unit` and `variable`.

    Returns
    -------
    BaseModel or None
        The table; without its mistaken keys where that makes sense, else None.
    """
    if not isinstance(value, dict):
        problems.add(path, f"must be a table, but is {fields.given(value)}.")
        return None
    try:
        return model.model_validate(value, context=context)
    except ValidationError as error:
        details = error.errors(include_url=False)
        for detail in details:
            place = (*path, *(part for part in detail["loc"] if part != "[key]"))
            if detail["type"] == "extra_forbidden":
                add_unknown(problems, place, _keys(model, detail["loc"]))
            else:
                problems.add(place, _sentence(detail), lacks=(place,) if detail["type"] == "missing" else ())
    return _without(model, value, {detail["loc"][:1] for detail in details}, context)


def _without(
    model: type[Model], value: dict[str, Any], bad: set[tuple[int | str, ...]], context: Mapping[str, object]
) -> Model | None:
    """Take a table without its mistaken keys, where that leaves the meaning of the others, to go on checking those."""
    if model not in (Inertia, Load, Initial, Grid, Solve, Output):
        return None
    try:
        return model.model_validate({key: each for key, each in value.items() if (key,) not in bad}, context=context)
    except ValidationError:
        return None


_MISSING: Final = {
    "units": 'is missing. Add units = "SI", or units = "dimensionless".',
    "until": 'is missing. Say how long to run, or until = "equilibrium".',
}


def _sentence(detail: ErrorDetails) -> str:
    kind, given = detail["type"], fields.given(detail.get("input"))
    if kind == "plastica":
        return str(detail["msg"])
    if kind == "missing":
        return _MISSING.get(str(detail["loc"][-1]), "is missing. Add it.")
    if kind == "literal_error":
        return f"must be one of {detail['ctx']['expected']}, but is {given}."
    if kind in ("model_type", "dict_type", "model_attributes_type"):
        return f"must be a table, but is {given}."
    return f"cannot be {given}: {detail['msg']}."


def _keys(model: type[BaseModel], loc: tuple[int | str, ...]) -> tuple[str, ...]:
    """Return the keys of the table in which the key at `loc` was not expected."""
    if len(loc) > 1 and loc[0] == "section":
        model = CrossSection
    return tuple(model.model_fields)


def nearest(key: str, known: Iterable[str]) -> str | None:
    """Return the known key that an unknown one is a likely misspelling of; None where there is none."""
    close = get_close_matches(key, tuple(known), n=1, cutoff=0.6)
    return close[0] if close else None


def unknown_key(key: str, known: tuple[str, ...]) -> str:
    """Say that a key is unknown, with the nearest known one."""
    close = nearest(key, known)
    hint = f"Did you mean `{close}`? " if close else ""
    return f"is not a known key. {hint}Known here: {', '.join(known)}."


def add_unknown(problems: Problems, path: KeyPath, known: tuple[str, ...]) -> None:
    """Note a key that is unknown in its table; that the nearest known one is missing there is then not told as well."""
    key = str(path[-1])
    close = nearest(key, known)
    problems.add(path, unknown_key(key, known), meant=None if close is None else (*path[:-1], close))
