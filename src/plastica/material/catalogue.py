"""Named materials, with what they are for, good values and their source."""

from __future__ import annotations

import math
import tomllib
from dataclasses import dataclass
from difflib import get_close_matches
from functools import lru_cache
from importlib.resources import files
from typing import TYPE_CHECKING, Any, NoReturn

from plastica import units
from plastica.errors import ArgumentError

if TYPE_CHECKING:
    from plastica.material.material import Material

__all__ = ["Entry", "Parameter", "describe", "material", "names"]


@dataclass(frozen=True)
class Parameter:
    """A parameter of a named material.

    Attributes
    ----------
    name, meaning : str
        What it is called, and what it does.
    default : float
        A good value, dimensionless.
    dimension : str
        Its SI unit, such as "N*m**2".
    good : tuple of (float, float)
        The range of good values, dimensionless.
    """

    name: str
    meaning: str
    default: float
    dimension: str
    good: tuple[float, float]


@dataclass(frozen=True)
class Entry:
    """A named material in words and formulas; `str` of it is a page to read.

    Attributes
    ----------
    name, title, words, see, source : str
        What it is called, what it is for, what you should see, and where it comes from.
    preference, flow, threshold : str
        The three laws, as `Material` reads them.
    parameters : tuple of Parameter
        Their parameters.
    """

    name: str
    title: str
    words: str
    see: str
    preference: str
    flow: str
    threshold: str
    parameters: tuple[Parameter, ...]
    source: str

    def __str__(self) -> str:
        laws = [f"  {law:<10} = {getattr(self, law)}" for law in ("preference", "flow", "threshold")]
        rows = [
            f"  {p.name} = {p.default:g} [{p.dimension}], good from {p.good[0]:g} to {p.good[1]:g}: {p.meaning}"
            for p in self.parameters
        ]
        body = [f"{self.name}: {self.title}", self.words, f"You should see: {self.see}", *laws, *rows]
        return "\n".join([*body, f"Source: {self.source}"])


def names() -> tuple[str, ...]:
    """Return the names of all materials of the catalogue."""
    return tuple(_entries())


def describe(name: str) -> Entry:
    """Return what the catalogue says about a material.

    Parameters
    ----------
    name : str
        One of `names()`.

    Returns
    -------
    Entry
        Words, laws, parameters and source.

    Raises
    ------
    ArgumentError
        If there is no such material.
    """
    known = _entries()
    if name not in known:
        _refuse_name(name, tuple(known), "material")
    return known[name]


def material(
    name: str,
    *,
    length: str | float | None = None,
    stiffness: str | float | None = None,
    time: str | float | None = None,
    **parameters: float | str,
) -> Material:
    """Make a material of the catalogue.

    Parameters
    ----------
    name : str
        One of `names()`.
    length, stiffness, time : float or str, optional
        Length L (m), bending stiffness EI (N m**2) and time T (s) of the specimen: all three, or none. With them
        the material is in SI: a dimensionless value v becomes v*EI**a*L**b*T**c by its parameter's dimension.
    **parameters : float or str
        Other values: dimensionless numbers, or (with a specimen) text with a unit.

    Returns
    -------
    Material
        Dimensionless, or with parameters as text in SI.

    Raises
    ------
    ArgumentError
        If a name is unknown, the scales are incomplete, or a value has another dimension.
    """
    from plastica.material.material import Material

    entry = describe(name)
    scales = _scales(length, stiffness, time)
    known = {p.name: p for p in entry.parameters}
    for given in parameters:
        if given not in known:
            _refuse_name(given, tuple(known), f"parameter of {name}")
    values = {p.name: _value(p, parameters.get(p.name, p.default), scales) for p in entry.parameters}
    return Material(entry.preference, entry.flow, entry.threshold, values, entry.name, entry.source)


@lru_cache(maxsize=1)
def _entries() -> dict[str, Entry]:
    text = files(__package__).joinpath("catalogue.toml").read_text(encoding="utf-8")
    return {name: _entry(name, table) for name, table in tomllib.loads(text).items()}


def _entry(name: str, table: dict[str, Any]) -> Entry:
    rows = table.pop("parameters").items()
    parameters = tuple(
        Parameter(
            key, row["meaning"], float(row["default"]), row["dimension"], (float(row["good"][0]), float(row["good"][1]))
        )
        for key, row in rows
    )
    return Entry(name=name, parameters=parameters, **table)


def _scales(*given: str | float | None) -> tuple[float, float, float] | None:
    if all(scale is None for scale in given):
        return None
    checked = []
    for scale, where, unit in zip(given, ("length", "stiffness", "time"), ("m", "N*m**2", "s"), strict=True):
        value = math.nan if scale is None else units.quantity(scale, unit, where=where, bare=True)
        if not value > 0.0:
            rule = "must be positive, and given together with the other two of length, stiffness and time"
            raise ArgumentError(rule, where=where, value=scale)
        checked.append(value)
    return checked[0], checked[1], checked[2]


def _value(parameter: Parameter, given: float | str, scales: tuple[float, float, float] | None) -> float | str:
    where = f"parameters.{parameter.name}"
    if scales is None:
        if isinstance(given, str):
            next_step = "Give length, stiffness and time, or a dimensionless number."
            raise ArgumentError("must be a number", where=where, value=given, next_step=next_step)
        return given
    if isinstance(given, str):
        units.quantity(given, parameter.dimension, where=where, bare=False)
        return given
    number = units.quantity(given, "1", where=where, bare=True)
    length, stiffness, time = scales
    kg, m, s = (float(n) for n in units.dimension_of(parameter.dimension)[:3])
    # EI carries all of the mass, L the rest of the length, T the rest of the time
    value = number * stiffness**kg * length ** (m - 3 * kg) * time ** (s + 2 * kg)
    return f"{value!r} {parameter.dimension}"


def _refuse_name(name: str, known: tuple[str, ...], kind: str) -> NoReturn:
    close = get_close_matches(str(name), known, n=1)
    hint = f'Did you mean "{close[0]}"? ' if close else ""
    where = "name" if kind == "material" else "parameters"
    raise ArgumentError(
        f"must be a known {kind}", where=where, value=name, next_step=f"{hint}Known: {', '.join(known)}."
    )
