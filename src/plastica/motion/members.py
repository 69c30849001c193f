"""What is asked of many runs at once, read: first states, thrusts, parameters and tolerances of every member."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import islice
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from plastica.errors import ArgumentError
from plastica.material.anywhere import function_of
from plastica.material.expression import breakpoints, parse
from plastica.physics import programs
from plastica.physics.amounts import Amount, plain
from plastica.physics.initial import LARGEST_CURVATURE, Curvature, Shape, initial_shape, nodal_values, shape_of
from plastica.physics.narrow import met, missed, missing, unbounded
from plastica.physics.program import Program
from plastica.physics.status import LOST
from plastica.physics.strut import Strut
from plastica.units import quantity

__all__ = ["Curvatures", "Given", "Thrusts", "met_shapes", "read_members"]

Array = NDArray[np.float64]

Curvatures = Curvature | Sequence[Curvature] | Array
"""One initial shape for all members; or a list of shapes, or nodal values of shape (members, nodes), one for each."""

Thrusts = Amount | Program | Sequence[Amount] | Sequence[Program] | Array
"""One thrust for all members, or one for each: numbers, or programs in time."""


@dataclass(frozen=True, eq=False)
class Given:
    """All members, dimensionless but for the parameters, which stay in the units of the material.

    Attributes
    ----------
    strut : Strut
        The model on the grid that all share.
    count : int
        How many members there are.
    mu : ndarray, shape (1 or members, n)
        Initial curvature at the nodes.
    mu_nat : ndarray, shape (members,)
        Initial natural curvature.
    thrusts : tuple of Program
        The different programs of the thrust, in the units of the model.
    which : ndarray of int, shape (members,)
        The program of each.
    factor : ndarray, shape (members,)
        What each member's program is multiplied by.
    parameters : tuple of (str, ndarray of shape (members,))
        Parameters of the material that vary.
    missed : ndarray, shape (1 or members,)
        How far the free end is off for what the nodes miss of the first state, in L; see `physics.narrow`.
    narrow : tuple of str
        What is told of that.
    unbounded : tuple of str
        What is told of features that no grid can be shown to meet.
    """

    strut: Strut
    count: int
    mu: Array
    mu_nat: Array
    thrusts: tuple[Program, ...]
    which: NDArray[np.intp]
    factor: Array
    parameters: tuple[tuple[str, Array], ...]
    missed: Array
    narrow: tuple[str, ...]
    unbounded: tuple[str, ...]

    def part(self, first: int, last: int) -> Given:
        """Members first to last, excluded."""
        return self.chosen(np.arange(first, last))

    def chosen(self, some: NDArray[np.intp]) -> Given:
        """Some of the members, by their numbers."""
        return replace(
            self,
            count=len(some),
            mu=self.mu if self.mu.shape[0] == 1 else self.mu[some],
            missed=self.missed if self.missed.size == 1 else self.missed[some],
            mu_nat=self.mu_nat[some],
            which=self.which[some],
            factor=self.factor[some],
            parameters=tuple((name, values[some]) for name, values in self.parameters),
        )

    def checked(self, end: float) -> Given:
        """The same, once every load has been found fit until a dimensionless time.

        Raises
        ------
        ArgumentError
            Where one is not finite, or pulls where it must not.
        """
        for thrust in self.thrusts:
            load = replace(self.strut.load, thrust=thrust)
            if not load.is_constant:
                load.check(end * self.strut.scales.time)
        return self


def read_members(
    model: Strut,
    curvature: Curvatures,
    natural_curvature: float | str | ArrayLike,
    thrust: Thrusts | None,
    thrust_factor: ArrayLike | None,
    parameters: Mapping[str, Amount | ArrayLike] | None,
    shape_parameters: Mapping[str, ArrayLike] | None,
) -> Given:
    """Read and check what was given; see `motion.many.solve_many`.

    Raises
    ------
    ArgumentError
        Where something cannot be used, or numbers of members disagree.
    """
    counts: dict[str, int] = {}
    material, varying = _parameters(model, parameters or {}, counts)
    strut = Strut(material, model.load, model.grid, model.specimen)
    strut, mu, shapes = _shapes(strut, curvature, shape_parameters or {}, counts)
    off = np.array([missed(shape, strut.grid) for shape in shapes])
    told = _narrow(shapes, off, strut), _unbounded(shapes, strut)
    # Of a family only some members are looked at: what those miss is told, and not put down to others.
    off = off if off.size == mu.shape[0] else np.zeros(1)
    mu_nat = _numbers(natural_curvature, "natural_curvature", "1/m", strut, counts) * strut.scales.length
    _within(mu_nat, "natural_curvature", LARGEST_CURVATURE)
    thrusts, which, factor = _thrusts(strut, thrust, thrust_factor, counts)
    count = _agreed(counts)

    def spread(values: NDArray[Any]) -> NDArray[Any]:
        return np.ascontiguousarray(np.broadcast_to(values, (count,)))

    own = tuple((name, spread(values)) for name, values in varying)
    return Given(strut, count, mu, spread(mu_nat), thrusts, spread(which), spread(factor), own, off, *told)


def met_shapes(given: Any, strut: Strut) -> Any:
    """Return initial curvatures with element ends where the texts are too narrow for nodes to be chosen."""
    if isinstance(given, (list, tuple)):
        return [met_shapes(each, strut) for each in given]
    return met(given, strut.grid, strut.scales, si=strut.specimen is not None)


def _narrow(shapes: Sequence[Shape], off: Array, strut: Strut) -> tuple[str, ...]:
    """What is told of the shape of which the nodes miss most."""
    worst = int(np.argmax(off)) if shapes else 0
    return missing(shapes[worst], float(off[worst]), LOST, strut.scales.length) if shapes else ()


def _unbounded(shapes: Sequence[Shape], strut: Strut) -> tuple[str, ...]:
    """What is told of the first shape of which not all can be bounded."""
    return tuple(islice((note for shape in shapes for note in unbounded(shape, strut.scales.length)), 1))


def _agreed(counts: Mapping[str, int]) -> int:
    """The number of members, on which all that come as arrays must agree."""
    if not counts:
        return 1
    if len(set(counts.values())) > 1:
        said = ", ".join(f"{count} of {name}" for name, count in counts.items())
        raise ArgumentError(f"must be as many of each ({said})", where=", ".join(counts))
    return next(iter(counts.values()))


def _host(values: Any) -> Any:
    """Bring an array of another library to the host; anything else stays."""
    from plastica.numerics.arrays import arrays_of

    arrays = arrays_of(values)
    return values if arrays.writable else arrays.host(values)


def _numbers(given: Any, where: str, unit: str, strut: Strut, counts: dict[str, int]) -> Array:
    """One number or text with a unit, or an array of numbers, in the user's units; shape (1,) or (members,)."""
    if isinstance(given, str):
        if strut.specimen is None:
            raise ArgumentError("must be a number where there is no specimen", where=where, value=given)
        return np.array([quantity(given, unit, where=where, bare=False)])
    number = plain(_host(given))
    if isinstance(number, float):
        values = np.array([number])
    else:
        values = _array(number, where)
        counts[where] = values.size
    _check_finite(values, where)
    return values


def _array(given: Any, where: str) -> Array:
    values = _real(given)
    if values is None:
        raise ArgumentError("must be a number, or one for each member", where=where, value=given)
    if values.ndim != 1 or values.size == 0:
        raise ArgumentError("must be a number, or one for each member", where=where, value=values.shape)
    return values


def _real(given: Any) -> Array | None:
    """Real numbers as floats; None for anything else, where NumPy would cut complex numbers and count booleans."""
    if isinstance(given, (list, tuple)) and any(isinstance(each, (bool, np.bool_)) for each in given):
        return None
    try:
        values = np.asarray(given)
        return values.astype(float) if values.dtype.kind in "iufO" else None
    except (TypeError, ValueError):
        return None


def _check_finite(values: Array, where: str) -> None:
    if not np.isfinite(values).all():
        at = int(np.flatnonzero(~np.isfinite(values))[0])
        raise ArgumentError("must be finite", where=where if values.size == 1 else f"{where}[{at}]", value=values[at])


def _within(values: Array, where: str, largest: float) -> None:
    if np.abs(values).max() > largest:
        raise ArgumentError(
            f"must stay below {largest:g} / L",
            where=where,
            value=float(np.abs(values).max()),
            next_step="Check its unit.",
        )


def _parameters(
    model: Strut, given: Mapping[str, Any], counts: dict[str, int]
) -> tuple[Any, list[tuple[str, Array]]]:
    """The material with the parameters that are one number, and arrays of the others."""
    if not isinstance(given, Mapping):
        raise ArgumentError("must be a mapping of names to numbers or arrays", where="parameters", value=given)
    single = {name: value for name, value in given.items() if isinstance(plain(value), (float, str))}
    material = model.material.with_parameters(**single)
    varying: list[tuple[str, Array]] = []
    for name, value in given.items():
        if name in single:
            continue
        material.with_parameters(**{name: material.parameters.get(name, 0.0)})
        where, numbers = f"parameters.{name}", _host(value)
        if isinstance(numbers, (list, tuple)) and any(isinstance(each, str) for each in numbers):
            known = {each: material.with_parameters(**{name: each}).values[name] for each in set(numbers)}
            numbers = [known[each] for each in numbers]
        values = _array(numbers, where)
        _check_finite(values, where)
        counts[where] = values.size
        varying.append((name, values))
    return material, varying


def _shapes(
    strut: Strut, given: Any, shape_parameters: Mapping[str, Any], counts: dict[str, int]
) -> tuple[Strut, Array, list[Shape]]:
    """The model on the grid that every shape needs, the curvature at its nodes, and shapes to be looked at closely."""
    si = strut.specimen is not None
    given = _host(given)
    if isinstance(given, str) and shape_parameters:
        return _family(strut, given, shape_parameters, counts)
    if shape_parameters:
        rule = "must be given only where `curvature` is a text that names them"
        raise ArgumentError(rule, where="shape_parameters", value=dict(shape_parameters))
    if isinstance(given, np.ndarray) and given.ndim == 2:
        return strut, _nodal(strut, given, counts), []
    many = isinstance(given, (list, tuple)) and any(isinstance(each, (str, Shape)) or callable(each) for each in given)
    shapes: list[Shape] = []
    for each in given if many else [given]:
        shape, grid = initial_shape(each, strut.grid, strut.scales, si=si)
        strut = strut if grid is strut.grid else strut.with_grid(grid)
        shapes.append(shape)
    if many:
        counts["curvature"] = len(shapes)
    return strut, np.stack([nodal_values(shape, strut.grid) for shape in shapes]), shapes


def _nodal(strut: Strut, given: NDArray[Any], counts: dict[str, int]) -> Array:
    real = _real(given)
    if real is None:
        raise ArgumentError("must be numbers", where="curvature", value=given)
    values = real * strut.scales.length
    n = strut.grid.size
    if values.shape[1] not in (1, n) or values.shape[0] == 0:
        rule = f"must have one value, or one for each of {n} nodes, for each member"
        raise ArgumentError(rule, where="curvature", value=values.shape)
    _check_finite(values.ravel(), "curvature")
    _within(values, "curvature", LARGEST_CURVATURE)
    counts["curvature"] = values.shape[0]
    return np.ascontiguousarray(np.broadcast_to(values, (values.shape[0], n)))


def _family(
    strut: Strut, text: str, given: Mapping[str, Any], counts: dict[str, int]
) -> tuple[Strut, Array, list[Shape]]:
    """A text in s with parameters, which are numbers or one for each member."""
    where, length = "curvature", strut.scales.length
    expression = parse(text, variable="s", parameters=tuple(given), allow_step=True, where=where)
    unused = [name for name in given if name not in expression.parameters]
    if unused:
        raise ArgumentError(f"must occur in {text!r}", where=f"shape_parameters.{unused[0]}")
    values: dict[str, Array] = {}
    for name in given:
        values[name] = _numbers(given[name], f"shape_parameters.{name}", "1", strut, counts)
    first = {name: float(each[0]) for name, each in values.items()}
    looked = [first]
    ends = _ends(expression, first, length)
    for name, each in values.items():
        for other in (each.min(), each.max()):
            looked.append(first | {name: float(other)})
            if _ends(expression, looked[-1], length) != ends:
                rule = "must not move the places where the shape jumps or bends: all members share one grid"
                raise ArgumentError(
                    rule,
                    where=f"shape_parameters.{name}",
                    next_step="Give a list of shapes made by pl.piecewise instead.",
                )
    strut = strut.with_grid(strut.grid.with_breaks(b / length for b in ends if 0.0 < b < length))
    law = function_of(expression.tree, "s", {}, tuple(values), np)
    with np.errstate(all="ignore"):
        made = law(strut.grid.s * length, *(each[:, None] for each in values.values()))
    mu = np.atleast_2d(np.asarray(made, dtype=float)) * length
    mu = np.broadcast_to(mu, (mu.shape[0], strut.grid.size))
    _check_finite(mu.ravel(), where)
    _within(mu, where, LARGEST_CURVATURE)
    shapes = [shape_of(expression, each, length) for each in looked]
    return strut, np.ascontiguousarray(mu), [shape.scaled(length, length, text) for shape in shapes]


def _ends(expression: Any, values: Mapping[str, float], length: float) -> tuple[float, ...]:
    return tuple(point.position for point in breakpoints(expression, values, (0.0, length)))


def _thrusts(
    strut: Strut, given: Any, factor: Any, counts: dict[str, int]
) -> tuple[tuple[Program, ...], NDArray[np.intp], Array]:
    """The different programs, which of them each member follows, and its factor."""
    gain = np.ones(1) if factor is None else _numbers(factor, "thrust_factor", "1", strut, counts)
    given = plain(_host(given))
    which = np.zeros(1, dtype=np.intp)
    thrusts: tuple[Program, ...]
    if given is None or _is_one(given):
        thrusts = (strut.load.thrust if given is None else replace(strut.load, thrust=given).thrust,)
    elif _has_programs(given):
        read = {each: replace(strut.load, thrust=each).thrust for each in _different(given)}
        number = {program: i for i, program in enumerate(dict.fromkeys(read.values()))}
        thrusts, which = tuple(number), np.array([number[read[each]] for each in given], dtype=np.intp)
        counts["thrust"] = len(given)
    else:
        values = _numbers(given, "thrust", "N", strut, counts)
        replace(strut.load, thrust=programs.constant(float(values.min())))
        thrusts, gain = (programs.constant(1.0),), _product(values, gain)
    least, greatest = float(gain.min()), float(gain.max())
    if least < 0.0 and not strut.load.allow_tension:
        raise ArgumentError("must not be negative", where="thrust_factor", value=least)
    for program in thrusts:
        if greatest > 0.0:
            strut.with_load(replace(strut.load, thrust=program.multiplied(greatest)))
    return thrusts, which, gain


def _has_programs(given: Any) -> bool:
    return isinstance(given, Iterable) and any(isinstance(each, (str, Program)) for each in given)


def _different(given: Sequence[Any]) -> Sequence[Any]:
    try:
        return list(dict.fromkeys(given))
    except TypeError:
        rule = "must be a number, a text or a program for each member"
        raise ArgumentError(rule, where="thrust", value=given) from None


def _is_one(given: Any) -> bool:
    return isinstance(given, (str, Program)) or isinstance(plain(given), float)


def _product(a: Array, b: Array) -> Array:
    if a.size != b.size and 1 not in (a.size, b.size):
        rule = f"must be as many of each ({a.size} of thrust, {b.size} of thrust_factor)"
        raise ArgumentError(rule, where="thrust, thrust_factor")
    return a * b


