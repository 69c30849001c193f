"""Every kind of quantity, with its SI unit and the scale that makes it dimensionless (design, section 1.1)."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import Final

from plastica.errors import ArgumentError

__all__ = ["KINDS", "kind_of", "unit_of"]

KINDS: Final[Mapping[str, tuple[str, str]]] = MappingProxyType(
    {
        "length": ("m", "length"),
        "time": ("s", "time"),
        "rate": ("1/s", "rate"),
        "angle": ("rad", "angle"),
        "curvature": ("1/m", "curvature"),
        "curvature_rate": ("1/(m*s)", "curvature_rate"),
        "force": ("N", "force"),
        "couple": ("N*m", "couple"),
        "distributed": ("N/m", "distributed"),
        "drive": ("N*m**2", "drive"),
        "threshold": ("N*m**2", "drive"),
        "stiffness": ("N*m**2", "drive"),
        "preference": ("N", "preference"),
        "flow": ("1/(m*s)", "flow"),
        "velocity": ("m/s", "velocity"),
        "acceleration": ("m/s**2", "acceleration"),
        "frequency": ("rad/s", "rate"),
        "energy": ("J", "energy"),
        "power": ("W", "power"),
        "entropy_production": ("W/K", "entropy_production"),
        "entropy_rate": ("W/(m*K)", "entropy_rate"),
        "ratio": ("1", "ratio"),
    }
)
"""Every kind of quantity: name → (SI unit, the property of `Scales` that holds its scale)."""

_DISSIPATION_UNITS: Final = MappingProxyType({"entropy_production": "W", "entropy_rate": "W/m"})


def kind_of(name: str) -> tuple[str, str]:
    """Look a kind up: its SI unit, and the property of `Scales` that holds its scale.

    Parameters
    ----------
    name : str
        A name in `KINDS`.

    Returns
    -------
    tuple of str
        Unit and property.

    Raises
    ------
    ArgumentError
        If the kind is unknown.
    """
    if name not in KINDS:
        raise ArgumentError("must be one of " + ", ".join(KINDS), where="kind", value=name)
    return KINDS[name]


def unit_of(kind: str, dimensionless: bool = False, *, thermal: bool = True) -> str:
    """Tell the unit of a kind of quantity, for labels and files.

    Parameters
    ----------
    kind : str
        A name in `KINDS`.
    dimensionless : bool
        True where no specimen is given: the unit is then ``"1"``, that of an angle ``"rad"``.
    thermal : bool
        Whether a temperature is given. Without one, entropy production stands for temperature times entropy
        production, a power.

    Returns
    -------
    str
        For example ``"N"``, ``"N*m**2"`` or ``"1"``.

    Raises
    ------
    ArgumentError
        If the kind is unknown.
    """
    unit = kind_of(kind)[0]
    if dimensionless:
        return "rad" if kind == "angle" else "1"
    return unit if thermal else _DISSIPATION_UNITS.get(kind, unit)
