"""The specimen in SI units, and the scales that take it to the dimensionless rod and back.

Inside the package everything is dimensionless: lengths are measured in L, forces in EI/L², times in T, the
retardation time (design, section 1.1). `KINDS` lists every kind of quantity with its unit and its scale, so
that a quantity is converted at one place only.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from types import MappingProxyType
from typing import Any, Final, TypeVar

from plastica.errors import ArgumentError
from plastica.physics.amounts import Amount, finite, plain, positive
from plastica.physics.section import Section

__all__ = ["KINDS", "Amount", "Scales", "Section", "Specimen", "unit_of"]

Value = TypeVar("Value", bound=Any)

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
        "energy": ("J", "energy"),
        "power": ("W", "power"),
        "entropy_production": ("W/K", "entropy_production"),
        "entropy_rate": ("W/(m*K)", "entropy_rate"),
        "ratio": ("1", "ratio"),
    }
)
"""Every kind of quantity: name → (SI unit, the property of `Scales` that holds its scale)."""

_DISSIPATION_UNITS: Final = MappingProxyType({"entropy_production": "W", "entropy_rate": "W/m"})

# Scales are multiplied with one another; within these bounds no product of two leaves the doubles.
_SMALLEST, _LARGEST = 1e-150, 1e150


def _kind(name: str) -> tuple[str, str]:
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
    unit = _kind(kind)[0]
    if dimensionless:
        return "rad" if kind == "angle" else "1"
    return unit if thermal else _DISSIPATION_UNITS.get(kind, unit)


@dataclass(frozen=True)
class Scales:
    """The units of the dimensionless rod: L for lengths, EI/L² for forces, T for times (design, 1.1).

    Parameters
    ----------
    length : float
        L, in m.
    stiffness : float
        EI, in N m².
    time : float
        T, in s.
    temperature : float or None
        Absolute temperature of the rod, in K; None if unknown.

    Raises
    ------
    ArgumentError
        If one of them, or a scale made from them, is not between 1e-150 and 1e150.
    """

    length: float
    stiffness: float
    time: float
    temperature: float | None = None

    def __post_init__(self) -> None:
        for name in ("length", "stiffness", "time", "temperature"):
            value = getattr(self, name)
            if value is not None and not _SMALLEST <= value <= _LARGEST:
                raise ArgumentError("must be between 1e-150 and 1e150", where=name, value=value)
        for kind, (unit, prop) in KINDS.items():
            if not _SMALLEST <= getattr(self, prop) <= _LARGEST:
                scale = f"{getattr(self, prop):g} {unit}"
                raise ArgumentError(
                    f"must keep every scale between 1e-150 and 1e150, but make that of '{kind}' {scale}",
                    where="length, stiffness and time",
                    next_step="Check the units.",
                )

    @classmethod
    def unit(cls) -> Scales:
        """Return the scales that are all one: for quantities that are dimensionless already."""
        return cls(1.0, 1.0, 1.0, 1.0)

    @property
    def rate(self) -> float:
        """Scale of rates, 1/T, in 1/s."""
        return 1.0 / self.time

    @property
    def angle(self) -> float:
        """Scale of angles, 1."""
        return 1.0

    ratio = angle

    @property
    def curvature(self) -> float:
        """Scale of curvatures, 1/L, in 1/m."""
        return 1.0 / self.length

    @property
    def curvature_rate(self) -> float:
        """Scale of the rates of curvatures, 1/(L T), in 1/(m s)."""
        return 1.0 / self.length / self.time

    flow = curvature_rate

    @property
    def force(self) -> float:
        """Scale of forces, EI/L², in N: a thrust of γ of them gives γ = βL²/EI."""
        return self.stiffness / self.length / self.length

    preference = force

    @property
    def couple(self) -> float:
        """Scale of couples, EI/L, in N m."""
        return self.stiffness / self.length

    energy = couple

    @property
    def distributed(self) -> float:
        """Scale of forces per length, EI/L³, in N/m."""
        return self.stiffness / self.length / self.length / self.length

    @property
    def drive(self) -> float:
        """Scale of the driving force on the natural curvature and of the threshold, EI, in N m²."""
        return self.stiffness

    @property
    def power(self) -> float:
        """Scale of powers, EI/(L T), in W."""
        return self.stiffness / self.length / self.time

    @property
    def entropy_production(self) -> float:
        """Scale of entropy production, power over temperature, in W/K; without a temperature the power."""
        return self.power / (1.0 if self.temperature is None else self.temperature)

    @property
    def entropy_rate(self) -> float:
        """Scale of entropy production per length, in W/(m K); in W/m without a temperature."""
        return self.entropy_production / self.length

    def to_si(self, kind: str, value: Value) -> Value:
        """Convert a dimensionless quantity to SI: value times scale.

        Parameters
        ----------
        kind : str
            A name in `KINDS`.
        value : float or array of any shape
            The dimensionless quantity.

        Returns
        -------
        float or array
            The same in SI units. There and back changes nothing by more than 2 eps.

        Raises
        ------
        ArgumentError
            If the kind is unknown.
        """
        result: Value = value * getattr(self, _kind(kind)[1])
        return result

    def from_si(self, kind: str, value: Value) -> Value:
        """Convert a quantity in SI units to a dimensionless one: value over scale.

        Parameters
        ----------
        kind : str
            A name in `KINDS`.
        value : float or array of any shape
            The quantity in SI units.

        Returns
        -------
        float or array
            The same without dimension. There and back changes nothing by more than 2 eps.

        Raises
        ------
        ArgumentError
            If the kind is unknown.
        """
        result: Value = value / getattr(self, _kind(kind)[1])
        return result


@dataclass(frozen=True, kw_only=True)
class Specimen:
    """The rod on the bench: its length, bending stiffness and retardation time, in SI units.

    Each value is text with a unit, or a number in SI units. The bending stiffness EI is given itself, or by
    Young's modulus and the cross section.

    Parameters
    ----------
    length : str or float
        L, in m.
    bending_stiffness : str or float, optional
        EI, in N m².
    youngs_modulus : str or float, optional
        E, in Pa, together with `section`.
    section : mapping or Section, optional
        A `shape` and its sizes: "rectangle" with `width` and `thickness` (bent about the thin axis), "circle"
        with `diameter`, "tube" with `outer_diameter` and `wall` or `inner_diameter`.
    retardation_time : str or float
        ν, in s: how long the rod takes to follow its load; the scale T of time.
    temperature : str or float, optional
        Absolute temperature in K, needed for entropy only.

    Raises
    ------
    ArgumentError
        If a value is not positive, not finite or has another dimension; if the bending stiffness is given
        twice or not at all.

    Examples
    --------
    >>> Specimen(length=0.5, bending_stiffness=0.25, retardation_time=120.0).gamma(3.0)
    3.0
    """

    length: Amount
    bending_stiffness: Amount | None = None
    youngs_modulus: Amount | None = None
    section: Section | Mapping[str, Amount] | None = None
    retardation_time: Amount
    temperature: Amount | None = None
    scales: Scales = field(init=False, repr=False, compare=False)
    """The scales that take this specimen to the dimensionless rod."""

    def __post_init__(self) -> None:
        for name in _FIELDS:
            object.__setattr__(self, name, plain(getattr(self, name)))
        if self.section is not None:
            object.__setattr__(self, "section", Section.read(self.section))
        warmth = None if self.temperature is None else positive(self.temperature, "K", "temperature")
        length = positive(self.length, "m", "length")
        time = positive(self.retardation_time, "s", "retardation_time")
        object.__setattr__(self, "scales", Scales(length, self._stiffness(), time, warmth))

    def _stiffness(self) -> float:
        direct = self.bending_stiffness is not None
        parts = (self.youngs_modulus is not None, self.section is not None)
        if direct == any(parts) or any(parts) != all(parts):
            raise ArgumentError(
                "must be given either as `bending_stiffness`, or as `youngs_modulus` and `section` together",
                where="bending_stiffness",
                next_step="Give exactly one of the two.",
            )
        if direct:
            return positive(self.bending_stiffness, "N*m**2", "bending_stiffness")
        modulus = positive(self.youngs_modulus, "Pa", "youngs_modulus")
        return modulus * Section.read(self.section).second_moment

    @property
    def L(self) -> float:
        """Length L, in m."""
        return self.scales.length

    @property
    def EI(self) -> float:
        """Bending stiffness EI, in N m²."""
        return self.scales.stiffness

    @property
    def T(self) -> float:
        """Retardation time, the scale of time, in s."""
        return self.scales.time

    def gamma(self, thrust: Amount) -> float:
        """Return the dimensionless thrust γ = βL²/EI (paper, section 3; design, section 1.1).

        Parameters
        ----------
        thrust : str or float
            The terminal thrust β: a number in N, or text with a unit.

        Returns
        -------
        float
            γ; a straight elastic strut buckles at π²/4.

        Raises
        ------
        ArgumentError
            If the thrust is not a finite force.
        """
        return self.scales.from_si("force", finite(thrust, "N", "thrust"))

    @property
    def as_given(self) -> dict[str, Any]:
        """What the user gave, as it was written, by the names of the arguments."""
        given = {name: getattr(self, name) for name in _FIELDS if getattr(self, name) is not None}
        return {name: value.to_dict() if name == "section" else value for name, value in given.items()}

    def to_dict(self) -> dict[str, Any]:
        """Return what `from_dict` takes, ready for JSON: the arguments as given, by name."""
        return self.as_given

    @classmethod
    def from_dict(cls, data: object) -> Specimen:
        """Make a specimen from what `to_dict` returned, validated like any other.

        Parameters
        ----------
        data : mapping
            The arguments by name.

        Returns
        -------
        Specimen
            The specimen.

        Raises
        ------
        ArgumentError
            If a key is unknown or missing, or a value is wrong.
        """
        if not isinstance(data, Mapping):
            raise ArgumentError("must be a mapping", where="specimen", value=data)
        if not {"length", "retardation_time"} <= data.keys() <= set(_FIELDS):
            rule = f"must have `length` and `retardation_time`, and no keys but {', '.join(_FIELDS)}"
            raise ArgumentError(rule, where="specimen", value=", ".join(map(str, data)))
        return cls(**data)


_FIELDS: Final = tuple(each.name for each in fields(Specimen) if each.init)
