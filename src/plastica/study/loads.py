"""From the section [load] of a scenario to the loads: by name, or a force at an angle."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, Final

from plastica.errors import shown
from plastica.physics import programs
from plastica.physics.load import LOAD_KINDS, Load
from plastica.physics.program import Program
from plastica.physics.scales import KINDS
from plastica.study import schema
from plastica.study.fields import check_formula
from plastica.study.problems import Problems
from plastica.study.tokens import KeyPath

__all__ = ["load"]

_FUNCTIONS: Final[Mapping[str, Callable[..., Program]]] = {
    "constant": programs.constant,
    "table": programs.table,
    "ramp-hold-release": programs.ramp_hold_release,
    "cycles": programs.cycles,
    "expression": programs.expression,
}


def load(section: schema.Load, problems: Problems, *, si: bool) -> Load | None:
    """Make the loads.

    Parameters
    ----------
    section : Load
        What the file says.
    problems : Problems
        Takes the mistakes.
    si : bool
        Whether quantities have units.

    Returns
    -------
    Load or None
        None where there are mistakes.
    """
    _check_belonging(section, problems)
    made = {name: _one(name, section, problems, si=si) for name in (*LOAD_KINDS, "force")}
    given: dict[str, Any] = {name: each for name, each in made.items() if each is not None}
    force, pull = given.pop("force", None), bool(section.allow_tension)
    # One by one first, so that the mistakes of each are found.
    for name, each in given.items():
        with problems.at("load"):
            Load(**{name: each}, allow_tension=pull)
    if section.weight_angle is not None:
        with problems.at("load"):
            Load(weight_angle=section.weight_angle)
        given["weight_angle"] = section.weight_angle
    for one, angle in ((0.0 if force is None else force, 0.0), (0.0, section.angle)):
        if angle is not None:
            with problems.at("load"):
                Load.at_angle(one, angle)
    if problems.within("load"):
        return None
    if force is None or section.angle is None:
        return Load(**given, allow_tension=pull)
    return Load.at_angle(force, section.angle, **given)


def _check_belonging(section: schema.Load, problems: Problems) -> None:
    """Refuse what cannot stand together, or not alone."""
    if section.force is not None:
        for name in ("thrust", "transverse", "allow_tension"):
            if getattr(section, name) is not None:
                problems.add(("load", name), "cannot stand beside `force`, which sets it. Remove one of them.")
        if section.angle is None:
            rule = 'is missing: it is the direction of `force`. Add it, such as "30 deg".'
            problems.add(("load", "angle"), rule, lacks=(("load", "angle"),))
    elif section.angle is not None:
        rule = "is the direction of `force`, which is missing. Add it, or remove the angle."
        problems.add(("load", "angle"), rule, lacks=(("load", "force"),))
    if section.weight_angle is not None and section.weight is None:
        rule = "is the direction of `weight`, which is missing. Add it, or remove the angle."
        problems.add(("load", "weight_angle"), rule, lacks=(("load", "weight"),))


def _one(name: str, section: schema.Load, problems: Problems, *, si: bool) -> Program | float | str | None:
    value, path, unit = getattr(section, name), ("load", name), KINDS[LOAD_KINDS.get(name, "force")][0]
    if value is None:
        return None
    if isinstance(value, dict):
        return _program(value, path, problems, si=si, unit=unit)
    return check_formula(value, path, problems, si=si, unit=unit, variable="t")


def _program(value: dict[str, Any], path: KeyPath, problems: Problems, *, si: bool, unit: str) -> Program | None:
    known = ", ".join(schema.PROGRAMS)
    kind = value.get("program")
    if "program" not in value:
        _refuse_no_program(value, path, problems)
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


def _refuse_no_program(value: Mapping[str, Any], path: KeyPath, problems: Problems) -> None:
    """Say that a table names no program; which other keys it knows depends on that, so only a misspelt one is told."""
    place = (*path, "program")
    known = tuple(dict.fromkeys(key for program in schema.PROGRAMS.values() for key in program.model_fields))
    for key in value:
        if schema.nearest(key, known) == "program":
            schema.add_unknown(problems, (*path, key), known)
    problems.add(place, f"is missing: it must be one of {', '.join(schema.PROGRAMS)}.", lacks=(place,))
