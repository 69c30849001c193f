"""What a sweep varies: a key of the scenario, and the values that it takes."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from plastica.errors import ArgumentError
from plastica.physics.scales import KINDS
from plastica.study import fields, schema
from plastica.study.problems import Problems
from plastica.study.toml import toml_value
from plastica.units import DIMENSIONLESS, dimension_of, dimension_text, looks_like_quantity, parse_quantity

__all__ = ["AMPLITUDE", "MOST_AXES", "MOST_VALUES", "Axis", "check_keys", "column", "flattened", "read_axes"]

Array = NDArray[np.float64]

AMPLITUDE: Final = "initial.amplitude"
"""The one key that no scenario has: it multiplies the scenario's initial curvature."""

MOST_AXES: Final = 12
MOST_VALUES: Final = 1_000_000
"""Values of one axis; a file of a scenario holds fewer."""

ROUNDING: Final = 8.0 * float(np.finfo(float).eps)
"""By how much of itself a value of a range may miss what it should be."""

_RANGE: Final = ("from", "to", "count", "spacing")
_ENDS: Final = frozenset({"from", "to"})
"""What tells a range from a table of keys: no key of a scenario is called so, while load programs have a `count`."""

_FIXED: Final = ("specimen", "output")


@dataclass(frozen=True)
class Axis:
    """A key and its values.

    Attributes
    ----------
    key : str
        Dotted, as in "load.thrust".
    kind : str
        "number" (in SI where it has a unit), "whole", or "label": anything else, told by its place in `labels`.
    unit : str
        The SI unit of a number; "" for a pure number.
    values : ndarray
        All values of a list, in its order; of a range without a count its two ends.
    labels : tuple
        What the places of a label mean, as the scenario takes it.
    spacing : str
        "listed", or of a range to draw from "linear" or "log".
    """

    key: str
    kind: str
    unit: str
    values: Array
    labels: tuple[Any, ...] = ()
    spacing: str = "listed"

    @property
    def path(self) -> tuple[str, ...]:
        """The key in parts."""
        return tuple(self.key.split("."))

    @property
    def listed(self) -> bool:
        """Whether its values are told one by one."""
        return self.spacing == "listed"

    @property
    def words(self) -> tuple[str, ...]:
        """The labels for people: text as it is, tables as TOML writes them."""
        return tuple(label if isinstance(label, str) else toml_value(label) for label in self.labels)

    def inserted(self, value: float) -> Any:
        """Return a value as the scenario takes it."""
        if self.kind == "label":
            return self.labels[int(value)]
        if self.kind == "whole":
            return int(value)
        return f"{float(value)!r} {self.unit}" if self.unit else float(value)

    def shown(self, value: float) -> str:
        """Return a value for people."""
        if self.kind == "label":
            return self.words[int(value)]
        return f"{value:.6g} {self.unit}".strip()

    def drawn(self, share: Array) -> Array:
        """Return the values at shares in [0, 1) of a range, or of a list."""
        if self.listed:
            return np.asarray(self.values[np.minimum(share * self.values.size, self.values.size - 1).astype(int)])
        low, high = self.values
        if self.spacing == "log":
            return np.asarray(low * (high / low) ** share)
        return np.asarray(low + (high - low) * share)


def flattened(over: Mapping[str, Any], path: tuple[str, ...] = ()) -> Iterator[tuple[str, Any]]:
    """Yield dotted keys and their values from a table that may be nested (as TOML makes it of dotted keys)."""
    for key, value in over.items():
        here = (*path, str(key))
        if isinstance(value, Mapping) and not _ENDS & set(value):
            yield from flattened(value, here)
        else:
            yield ".".join(here), value


def read_axes(over: Mapping[str, Any], problems: Problems, *, si: bool, counted: bool) -> list[Axis]:
    """Read what is varied.

    Parameters
    ----------
    over : mapping
        From dotted keys, or tables of keys, each to an array of values, or to a range { from, to, count, spacing }.
    problems : Problems
        Takes the mistakes.
    si : bool
        Whether quantities have units.
    counted : bool
        Whether a range has a count of values; else members are drawn from it.

    Returns
    -------
    list of Axis
        Without those that have mistakes.
    """
    given = list(flattened(over))
    check_keys([key for key, _ in given], problems)
    axes = [_axis(key, value, problems, si=si, counted=counted) for key, value in given if not _unknown(key)]
    return [axis for axis in axes if axis is not None]


def check_keys(keys: Sequence[str], problems: Problems) -> None:
    """Refuse keys that lead to nothing in a scenario, and those that would be varied twice."""
    for key in keys:
        whole = next((other for other in keys if key.startswith(f"{other}.")), None)
        wrong = _unknown(key)
        if wrong:
            problems.add(("sweep", "over", key), wrong)
        elif keys.count(key) > 1:
            problems.add(("sweep", "over", key), "is varied twice: it stands there in quotes and without. Remove one.")
        elif whole is not None:
            problems.add(("sweep", "over", key), f"is a part of `{whole}`, which is varied as well. Remove one.")


def _axis(key: str, value: Any, problems: Problems, *, si: bool, counted: bool) -> Axis | None:
    """Read what one key is varied over; None, and problems, where there are mistakes."""
    with problems.at("sweep", "over", key):
        if isinstance(value, Mapping):
            return _range(key, value, si=si, counted=counted)
        if isinstance(value, np.ndarray):
            value = value.tolist()
        if isinstance(value, (list, tuple)):
            return column(key, list(value), si=si)
        raise ArgumentError("must be an array of values, or a range { from, to }", value=value)
    return None


def _unknown(key: str) -> str:
    """Say what is wrong with a key; "" if it leads to something that a scenario has."""
    section, _, rest = key.partition(".")
    known = tuple(name for name in schema.SECTIONS if name != "output")
    if section not in known:
        return schema.unknown_key(section, known) if section != "output" else "cannot be varied."
    if key == AMPLITUDE:
        return ""
    names = tuple(schema.SECTIONS[section].model_fields)
    first = rest.partition(".")[0]
    if first not in names:
        return schema.unknown_key(first, names) if rest else f"must name a key within [{section}]."
    return ""


def column(key: str, given: list[Any], *, si: bool) -> Axis:
    """Read values one by one.

    Raises
    ------
    ArgumentError
        Where there are none, too many, or they are of different kinds.
    """
    if not 1 <= len(given) <= MOST_VALUES:
        raise ArgumentError(f"must have 1 to {MOST_VALUES} values", value=len(given))
    if key == AMPLITUDE:
        _check_factors(given)
    if all(isinstance(each, int) and not isinstance(each, bool) for each in given):
        return Axis(key, "whole", "", np.array(given, dtype=float))
    if all(isinstance(each, int | float) and not isinstance(each, bool) for each in given):
        values = np.array(given, dtype=float)
        _check_finite(values)
        return Axis(key, "number", "", values)
    if si and all(isinstance(each, str) and looks_like_quantity(each) for each in given):
        read = [parse_quantity(each, where=f"[{i}]") for i, each in enumerate(given)]
        if len({dimension for _, dimension in read}) > 1:
            raise ArgumentError("must be quantities of one dimension", value=given)
        values = np.array([number for number, _ in read])
        _check_finite(values)
        return Axis(key, "number", _unit(read[0][1]), values)
    labels = tuple(dict.fromkeys(map(_hashable, given)))
    place = {label: float(i) for i, label in enumerate(labels)}
    raw = {_hashable(each): each for each in given}
    values = np.array([place[_hashable(each)] for each in given])
    return Axis(key, "label", "", values, tuple(raw[label] for label in labels))


def _check_factors(given: list[Any]) -> None:
    """Refuse what cannot multiply: texts are told by their places, which would be taken for factors."""
    for each in given:
        if isinstance(each, bool) or not isinstance(each, int | float):
            raise ArgumentError("must be plain numbers, which multiply the initial curvature", value=each)


def _hashable(value: Any) -> Any:
    return repr(value) if isinstance(value, (dict, list)) else value


def _unit(dimension: Any) -> str:
    """The SI unit of a dimension: that of a quantity of this model where there is one."""
    if dimension == DIMENSIONLESS:
        return ""
    known = (unit for unit, _ in KINDS.values() if unit not in ("1", "rad"))
    return next((unit for unit in known if dimension_of(unit) == dimension), dimension_text(dimension))


def _check_finite(values: Array) -> None:
    if not np.isfinite(values).all():
        raise ArgumentError("must be finite", value=float(values[~np.isfinite(values)][0]))


def _range(key: str, given: Mapping[str, Any], *, si: bool, counted: bool) -> Axis:
    for name in given:
        if name not in _RANGE:
            raise ArgumentError(schema.unknown_key(str(name), _RANGE).rstrip("."), where=str(name))
    for name in ("from", "to", "count")[: 3 if counted else 2]:
        if name not in given:
            raise ArgumentError("is missing", where=name)
    if not counted and "count" in given:
        raise ArgumentError("belongs to a grid or list; members drawn have their number in `members`", where="count")
    (low, unit), (high, other) = (_number(given[name], name, si=si and key != AMPLITUDE) for name in ("from", "to"))
    if unit != other or not (math.isfinite(low) and math.isfinite(high)) or low == high:
        raise ArgumentError("must be another quantity of the same dimension as `from`", where="to", value=given["to"])
    spacing = given.get("spacing", "linear")
    if spacing not in ("linear", "log"):
        raise ArgumentError('must be "linear" or "log"', where="spacing", value=spacing)
    if spacing == "log" and not (low * high > 0.0):
        rule = "must be of one sign with `to`, and not 0, where the spacing is log"
        raise ArgumentError(rule, where="from", value=low)
    if not counted:
        return Axis(key, "number", unit, np.array([low, high]), (), spacing)
    count = given["count"]
    if isinstance(count, bool) or not isinstance(count, int) or not 2 <= count <= MOST_VALUES:
        raise ArgumentError(f"must be a whole number from 2 to {MOST_VALUES}", where="count", value=count)
    values = np.linspace(low, high, count) if spacing == "linear" else np.geomspace(low, high, count)
    if all(isinstance(given[name], int | np.integer) for name in _ENDS) and _all_whole(values):
        return Axis(key, "whole", "", np.rint(values))
    return Axis(key, "number", unit, values)


def _all_whole(values: Array) -> bool:
    """Whether values between whole ends are whole to rounding, as keys such as `grid.nodes` ask for."""
    return bool(np.all(np.abs(values - np.rint(values)) <= ROUNDING * np.abs(values)))


def _number(value: Any, where: str, *, si: bool) -> tuple[float, str]:
    if isinstance(value, str) and si and looks_like_quantity(value):
        number, dimension = parse_quantity(value, where=where)
        return number, _unit(dimension)
    if isinstance(value, bool) or not isinstance(value, int | float | np.number):
        rule = "must be a number" + (", or text with a unit" if si else "")
        raise ArgumentError(rule, where=where, value=fields.given(value))
    return float(value), ""
