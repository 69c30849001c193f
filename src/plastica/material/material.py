"""The material of a rod: preference energy, flow law and threshold, as text with named parameters."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property, lru_cache
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Final

from plastica import units
from plastica.errors import ArgumentError
from plastica.material.expression import Expression, check_name, parse

if TYPE_CHECKING:
    from plastica.material.admissibility import Verdict
    from plastica.material.compiled import ArrayFunction, ScalarFunction

__all__ = ["LAWS", "Law", "Laws", "Material", "admissible"]

LAWS: Final = {"preference": "m", "flow": "x", "threshold": "m"}
"""The three laws and their variables: natural curvature m and excess drive x."""

_DIMENSIONS: Final = {"preference": "N", "flow": "1/(m*s)", "threshold": "N*m**2"}
_VARIABLE_DIMENSIONS: Final = {"m": "1/m", "x": "N*m**2"}


@dataclass(frozen=True)
class Law:
    """One law with its numbers: u -> value_scale * g(argument_scale * u), and its exact derivatives.

    Attributes
    ----------
    expression : Expression
        The formula g.
    values : tuple of (str, float)
        Its parameters.
    argument_scale, value_scale : float
        Scales that make it dimensionless.
    value, slope, second : callable
        The law and its first two derivatives, for arrays: floats of the argument's shape.
    value_at, slope_at, second_at : callable
        The same for one float, without NumPy: the fast path.
    """

    expression: Expression
    values: tuple[tuple[str, float], ...]
    argument_scale: float = 1.0
    value_scale: float = 1.0
    value: ArrayFunction = field(init=False, repr=False, compare=False)
    slope: ArrayFunction = field(init=False, repr=False, compare=False)
    second: ArrayFunction = field(init=False, repr=False, compare=False)
    value_at: ScalarFunction = field(init=False, repr=False, compare=False)
    slope_at: ScalarFunction = field(init=False, repr=False, compare=False)
    second_at: ScalarFunction = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        values, derivative, scale = dict(self.values), self.expression, self.value_scale
        for name in ("value", "slope", "second"):
            object.__setattr__(self, name, derivative.vector(values, self.argument_scale, scale))
            object.__setattr__(self, f"{name}_at", derivative.scalar(values, self.argument_scale, scale))
            derivative, scale = derivative.derivative(), scale * self.argument_scale

    def __reduce__(self) -> tuple[Any, ...]:
        return Law, (self.expression, self.values, self.argument_scale, self.value_scale)


@dataclass(frozen=True)
class Laws:
    """The three laws of a specimen, dimensionless (design 1.1).

    Attributes
    ----------
    preference : Law
        Preference energy: L**2/EI * kappa(m/L).
    flow : Law
        Flow law: L*T*f(EI*x).
    threshold : Law
        Threshold: Theta(m/L)/EI.
    """

    preference: Law
    flow: Law
    threshold: Law


@dataclass(frozen=True)
class Material:
    """A material: which natural curvatures it prefers, when its natural curvature moves, and how fast.

    The natural curvature m follows (design 1.2, the paper's evolution law)

        m_t = f(D - Theta(m)) - f(-Theta(m) - D),      D = mean curvature - m - kappa'(m),

    with the preference energy kappa, the flow law f and the threshold Theta.

    Parameters
    ----------
    preference : str
        kappa as a formula in m (natural curvature), such as "k*m**2/2"; in N where units are used.
    flow : str
        f as a formula in x (excess drive), such as "c*pos(x)**2"; in 1/(m s).
    threshold : str
        Theta as a formula in m, such as "h"; in N m**2.
    parameters : mapping of str to (float or str)
        The named numbers of the three formulas: plain numbers, or text with a unit such as "0.035 N*m**2".
    name, source : str, optional
        What it is called, and where it comes from.

    Raises
    ------
    ArgumentError
        If a formula or a parameter is not what it must be, or the units of a law do not come to its dimension.
    """

    preference: str
    flow: str
    threshold: str
    parameters: Mapping[str, float | str] = field(default_factory=dict)
    name: str | None = None
    source: str | None = None

    def __post_init__(self) -> None:
        if not isinstance(self.parameters, Mapping):
            rule = "must be a mapping of names to numbers"
            raise ArgumentError(rule, where="parameters", value=self.parameters)
        names = [check_name(name, variable=variable) for name in self.parameters for variable in ("m", "x")]
        given = {name: _stored(name, self.parameters[name]) for name in names}
        object.__setattr__(self, "parameters", MappingProxyType(given))
        used = {name for law in LAWS for name in self.expressions[law].parameters}
        unused = [name for name in given if name not in used]
        if unused:
            rule = f"must occur in a law, and {', '.join(map(repr, unused))} does not"
            next_step = "Remove it, or mend the law that should use it."
            raise ArgumentError(rule, where="parameters", next_step=next_step)
        _check_dimensions(self)

    def __hash__(self) -> int:
        rest = (self.preference, self.flow, self.threshold, self.name, self.source)
        return hash((rest, frozenset(self.parameters.items())))

    def __reduce__(self) -> tuple[Any, ...]:
        rest = (self.preference, self.flow, self.threshold)
        return Material, (*rest, dict(self.parameters), self.name, self.source)

    @cached_property
    def expressions(self) -> Mapping[str, Expression]:
        """The three laws, read: by name."""
        names = tuple(self.parameters)
        read = {law: parse(getattr(self, law), variable=v, parameters=names, where=law) for law, v in LAWS.items()}
        return MappingProxyType(read)

    @cached_property
    def values(self) -> dict[str, float]:
        """The parameters as numbers, in SI where they carry units."""
        return {name: _number(name, value) for name, value in self.parameters.items()}

    @property
    def has_units(self) -> bool:
        """Whether a parameter carries a unit, so that the laws are in SI."""
        return any(isinstance(value, str) for value in self.parameters.values())

    @cached_property
    def well(self) -> float | None:
        """The positive natural curvature m1 preferred as much as 0, kappa(m1) = 0; None if there is none."""
        from plastica.material.admissibility import positive_zero

        return positive_zero(self.expressions["preference"], self.values, self.variable_scale("preference"))

    def variable_scale(self, law: str) -> float:
        """Return the largest parameter of a law that carries the unit of its variable; 1 if there is none."""
        due = units.dimension_of(_VARIABLE_DIMENSIONS[LAWS[law]])
        texts = [(name, self.parameters[name]) for name in self.expressions[law].parameters]
        read = [units.parse_quantity(text, where=name) for name, text in texts if isinstance(text, str)]
        return max((abs(value) for value, dimension in read if dimension == due and value != 0.0), default=1.0)

    def with_parameters(self, **changes: float | str) -> Material:
        """Return the same material with other values of some parameters.

        Raises
        ------
        ArgumentError
            If a name is not a parameter of this material.
        """
        for name in changes:
            if name not in self.parameters:
                known = ", ".join(self.parameters) or "none"
                rule = f"must be parameters of the material, which {name!r} is not"
                raise ArgumentError(rule, where="parameters", next_step=f"It has: {known}.")
        parameters = {**self.parameters, **changes}
        return Material(self.preference, self.flow, self.threshold, parameters, self.name, self.source)

    def laws(self, length: float = 1.0, stiffness: float = 1.0, time: float = 1.0) -> Laws:
        """Return the dimensionless laws of a specimen (design 1.1).

        Parameters
        ----------
        length, stiffness, time : float
            L in m, EI in N m**2 and the time scale T in s; 1 where everything is dimensionless already.

        Returns
        -------
        Laws
            L**2/EI*kappa(m/L), L*T*f(EI*x) and Theta(m/L)/EI, compiled once for each set of scales.
        """
        return _laws(self, float(length), float(stiffness), float(time))

    def admissibility(self, bound: float | None = None) -> tuple[Verdict, ...]:
        """Judge every hypothesis of the theory; see `plastica.material.admissibility.judge`."""
        from plastica.material.admissibility import judge

        return judge(self, bound)

    def to_dict(self) -> dict[str, Any]:
        """Return what `Material` was made from, as plain values."""
        plain = {"preference": self.preference, "flow": self.flow, "threshold": self.threshold}
        return {**plain, "parameters": dict(self.parameters), "name": self.name, "source": self.source}


def admissible(material: Material, bound: float | None = None) -> bool:
    """Tell whether a material satisfies every hypothesis of the theory."""
    return all(verdict.holds for verdict in material.admissibility(bound))


def _scales(length: float, stiffness: float, time: float) -> dict[str, tuple[float, float]]:
    """Return (argument scale, value scale) of each law: what makes it dimensionless."""
    return {
        "preference": (1.0 / length, length**2 / stiffness),
        "flow": (stiffness, length * time),
        "threshold": (1.0 / length, 1.0 / stiffness),
    }


@lru_cache(maxsize=64)
def _laws(material: Material, length: float, stiffness: float, time: float) -> Laws:
    made = {}
    for name, (argument_scale, value_scale) in _scales(length, stiffness, time).items():
        expression = material.expressions[name]
        values = tuple((p, material.values[p]) for p in expression.parameters)
        made[name] = Law(expression, values, argument_scale, value_scale)
    return Laws(**made)


def _stored(name: str, value: object) -> float | str:
    """Check a parameter, and keep it as a float or as text with a unit."""
    where = f"parameters.{name}"
    if isinstance(value, str):
        if not units.looks_like_quantity(value):
            rule = 'must be a number, or text with a unit such as "0.035 N*m**2"'
            raise ArgumentError(rule, where=where, value=value)
        units.parse_quantity(value, where=where)
        return value
    return units.quantity(value, "1", where=where, bare=True)  # type: ignore[arg-type]


def _number(name: str, value: float | str) -> float:
    return units.parse_quantity(value, where=f"parameters.{name}")[0] if isinstance(value, str) else value


def _check_dimensions(material: Material) -> None:
    """Refuse a law whose units do not come to its dimension; laws with plain numbers are not checked."""
    for law, variable in LAWS.items():
        expression = material.expressions[law]
        texts = {name: material.parameters[name] for name in expression.parameters}
        if not texts or not all(isinstance(text, str) for text in texts.values()):
            continue
        from plastica.material.dimensions import dimension_of_tree

        known = {name: units.parse_quantity(str(text), where=name)[1] for name, text in texts.items()}
        known[variable] = units.dimension_of(_VARIABLE_DIMENSIONS[variable])
        due = units.dimension_of(_DIMENSIONS[law])
        found = dimension_of_tree(expression.tree, known, material.values, where=law, text=expression.text)
        if found is not None and found != due:
            base = units.dimension_text(due)
            rule = f"must come to {_DIMENSIONS[law]}" + (f" (that is {base})" if base != _DIMENSIONS[law] else "")
            what = f"Its unit comes to {units.dimension_text(found)}: mend the units of {', '.join(texts)}."
            raise ArgumentError(rule, where=law, value=expression.text, next_step=what)
