"""The specimen in SI units, and the scales that take it to the dimensionless rod and back.

Inside the package everything is dimensionless: lengths are measured in L, forces in EI/L², times in T, the
retardation time or, for a rod without damping, √(ρA L⁴/EI) (design, section 1.1). `KINDS` lists every kind of
quantity with its unit and its scale, so that a quantity is converted at one place only.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from typing import Any, Final, TypeVar

from plastica.errors import ArgumentError
from plastica.physics.amounts import Amount, finite, plain, positive
from plastica.physics.inertia import Inertia
from plastica.physics.kinds import KINDS, kind_of, unit_of
from plastica.physics.section import Section

__all__ = ["KINDS", "Amount", "Scales", "Section", "Specimen", "unit_of"]

Value = TypeVar("Value", bound=Any)

# Scales are multiplied with one another; within these bounds no product of two leaves the doubles.
_SMALLEST, _LARGEST = 1e-150, 1e150


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
    def velocity(self) -> float:
        """Scale of velocities, L/T, in m/s."""
        return self.length / self.time

    @property
    def acceleration(self) -> float:
        """Scale of accelerations, L/T², in m/s²."""
        return self.length / self.time / self.time

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
        result: Value = value * getattr(self, kind_of(kind)[1])
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
        result: Value = value / getattr(self, kind_of(kind)[1])
        return result


@dataclass(frozen=True, kw_only=True)
class Specimen:
    """The rod on the bench: its length, bending stiffness, retardation time and mass, in SI units.

    Each value is text with a unit, or a number in SI units. The bending stiffness EI is given itself, or by
    Young's modulus and the cross section; the mass by mass per length and rotary inertia, or by density and
    cross section. The scale T of time is the retardation time; without one √(ρA L⁴/EI), or √(ρJ L²/EI) where
    the rod has rotary inertia only.

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
    retardation_time : str or float, optional
        ν, in s: how long the rod takes to follow its load. Left out, the rod has no damping.
    temperature : str or float, optional
        Absolute temperature in K, needed for entropy only.
    mass_per_length : str or float, optional
        ρA, in kg/m.
    rotary_inertia : str or float, optional
        ρJ, the rotary inertia per length, in kg m.
    density : str or float, optional
        ρ, in kg/m³, together with `section`: then ρA and ρJ are those of the section, J = I.

    Raises
    ------
    ArgumentError
        If a value is not positive, not finite or has another dimension; if the bending stiffness is given
        twice or not at all, the mass is given twice, or neither retardation time nor mass is given.

    Examples
    --------
    >>> Specimen(length=0.5, bending_stiffness=0.25, retardation_time=120.0).gamma(3.0)
    3.0
    """

    length: Amount
    bending_stiffness: Amount | None = None
    youngs_modulus: Amount | None = None
    section: Section | Mapping[str, Amount] | None = None
    retardation_time: Amount | None = None
    temperature: Amount | None = None
    mass_per_length: Amount | None = None
    rotary_inertia: Amount | None = None
    density: Amount | None = None
    scales: Scales = field(init=False, repr=False, compare=False)
    """The scales that take this specimen to the dimensionless rod."""
    inertia: Inertia = field(init=False, repr=False, compare=False)
    """Mass and rotary inertia per length in SI units, 0 where they are not given."""

    def __post_init__(self) -> None:
        for name in _FIELDS:
            object.__setattr__(self, name, plain(getattr(self, name)))
        if self.section is not None:
            object.__setattr__(self, "section", Section.read(self.section))
        warmth = None if self.temperature is None else positive(self.temperature, "K", "temperature")
        length = positive(self.length, "m", "length")
        stiffness = self._stiffness()
        inertia = Inertia.read(self.mass_per_length, self.rotary_inertia, self.density, self.section)
        if self.retardation_time is not None:
            time = positive(self.retardation_time, "s", "retardation_time")
        else:
            time = inertia.time(length, stiffness)
        object.__setattr__(self, "scales", Scales(length, stiffness, time, warmth))
        object.__setattr__(self, "inertia", inertia)
        inertia.ratios(length, stiffness, time)

    def _stiffness(self) -> float:
        direct = self.bending_stiffness is not None
        # Beside a stiffness that was measured, a section may stand for the sake of the density.
        needless = direct and self.density is not None
        parts = (self.youngs_modulus is not None, self.section is not None and not needless)
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
        """The scale of time, in s: the retardation time if one is given."""
        return self.scales.time

    @property
    def damping(self) -> float:
        """Dimensionless damping δ = ν/T: 1 with a retardation time, 0 without (design, section 1.1)."""
        return 0.0 if self.retardation_time is None else 1.0

    @property
    def translational_inertia(self) -> float:
        """Dimensionless translational inertia ε₁ = ρA L⁴/(EI T²); 0 where no mass is given."""
        return self.inertia.ratios(self.L, self.EI, self.T)[0]

    @property
    def rotary_inertia_ratio(self) -> float:
        """Dimensionless rotary inertia ε₀ = ρJ L²/(EI T²); 0 where none is given."""
        return self.inertia.ratios(self.L, self.EI, self.T)[1]

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
        if not {"length"} <= data.keys() <= set(_FIELDS):
            rule = f"must have `length`, and no keys but {', '.join(_FIELDS)}"
            raise ArgumentError(rule, where="specimen", value=", ".join(map(str, data)))
        return cls(**data)


_FIELDS: Final = tuple(each.name for each in fields(Specimen) if each.init)
