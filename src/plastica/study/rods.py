"""Strut or rod with inertia: what the section [inertia] may say, and the model that follows."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from plastica.material.material import Material
from plastica.numerics.grid import Grid
from plastica.physics.load import Load
from plastica.physics.model import Model
from plastica.physics.rod import Rod
from plastica.physics.scales import Specimen
from plastica.physics.strut import Strut
from plastica.study import schema
from plastica.study.building import Segments, number, sorted_under
from plastica.study.problems import Problems
from plastica.study.tokens import KeyPath

__all__ = ["check_inertia", "model"]

_OF_MASS = ("mass_per_length", "density")


def check_inertia(data: Mapping[str, Any], section: schema.Inertia | None, problems: Problems, *, si: bool) -> None:
    """Refuse what cannot stand in [inertia], and a rod without mass and retardation time.

    Parameters
    ----------
    data : mapping
        The whole file.
    section : Inertia or None
        What [inertia] says; None where it has mistakes of its own.
    problems : Problems
        Takes the mistakes.
    si : bool
        Whether quantities have units.
    """
    rod, start = data.get("specimen"), data.get("initial")
    slow = isinstance(rod, dict) and "retardation_time" in rod
    if "inertia" not in data:
        if si and isinstance(rod, dict) and not slow:
            rule = "is missing. Add it, or the section [inertia] with the mass of a rod without damping."
            path = ("specimen", "retardation_time")
            problems.add(path, rule, lacks=(path, ("inertia",)))
        if isinstance(start, dict) and "curvature_rate" in start:
            rule = "needs a rod with inertia: without it the loads and the shape set the rate."
            rule += " Remove it, or add the section [inertia]."
            problems.add(("initial", "curvature_rate"), rule, lacks=(("inertia",),))
    elif section is not None and si:
        _check_mass(section, data["inertia"], problems, slow=slow)
    elif section is not None:
        _check_numbers(section, data["inertia"], problems)


def _check_mass(section: schema.Inertia, given: Mapping[str, Any], problems: Problems, *, slow: bool) -> None:
    if "translational_inertia" in given:
        rule = "belongs to a dimensionless scenario. Give `mass_per_length`, or `density`, instead."
        problems.add(("inertia", "translational_inertia"), rule)
    elif not given.keys() & {*_OF_MASS, "rotary_inertia"}:
        rule = "must say what mass the rod has. Add `mass_per_length`; or `density`, with the section of the specimen."
        problems.add(("inertia",), rule, lacks=_keys(*_OF_MASS, "rotary_inertia"))
    if section.damping is None:
        return
    if slow:
        rule = "cannot stand beside the `retardation_time` of the specimen, which sets it. Remove one of them."
        problems.add(("inertia", "damping"), rule)
    elif section.damping != 0.0:
        rule = f"can only be 0 in a scenario with units, but is {section.damping:g}."
        problems.add(("inertia", "damping"), f"{rule} For damping give the specimen a `retardation_time`.")


def _check_numbers(section: schema.Inertia, given: Mapping[str, Any], problems: Problems) -> None:
    foreign = [name for name in _OF_MASS if name in given]
    for name in foreign:
        rule = "has no place in a dimensionless scenario. Give `translational_inertia`, rho*A*L**4/(EI*T**2), instead."
        problems.add(("inertia", name), rule)
    numbers = given.keys() & {"translational_inertia", "rotary_inertia"}
    if not foreign and not numbers:
        rule = "must have `translational_inertia`, rho*A*L**4/(EI*T**2), or `rotary_inertia`, rho*J*L**2/(EI*T**2)."
        lacks = _keys("translational_inertia", "rotary_inertia")
        problems.add(("inertia",), f"{rule} Add one, or remove the section.", lacks=lacks)
    elif section.damping == 0.0 and numbers and all(given[name] == 0 for name in numbers):
        rule = "must have an inertia or damping: without both there is no equation of motion."
        problems.add(("inertia",), f"{rule} Give `damping` or an inertia that is not 0.")


def _keys(*names: str) -> tuple[KeyPath, ...]:
    return tuple(("inertia", name) for name in names)


def model(
    material: Material,
    load: Load,
    grid: Grid,
    specimen: Specimen | None,
    segments: Segments,
    inertia: schema.Inertia | None,
    problems: Problems,
) -> Model | None:
    """Make the model: a rod where there is a section [inertia], else a strut."""
    if inertia is None:
        with sorted_under(problems, "load"):
            return Strut(material, load, grid, specimen, natural_segments=segments)
        return None
    given: dict[str, float] = {}
    if specimen is None:
        stated = inertia.model_dump(exclude_none=True, exclude=set(_OF_MASS))
        given = {name: number(value, "1") for name, value in stated.items()}
    with sorted_under(problems, "inertia"):
        return Rod(material, load, grid, specimen, natural_segments=segments, **given)
    return None
