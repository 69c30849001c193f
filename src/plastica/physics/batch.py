"""The strut's equations for many members at once: a column for each, its loads and parameters its own.

The state of a member is a column y = (mu at the n nodes, mu_nat). `Strut.rate` is the readable statement of the same
equations; a test holds the two together.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from plastica.material.anywhere import function_of
from plastica.material.tape import Tape, tape_of
from plastica.numerics.arrays import LANES, AnyArray, Arrays
from plastica.physics.program import Program
from plastica.physics.strut import Strut

__all__ = ["BatchLaws", "Forces", "LawOf", "Struts", "batch_laws", "law_of", "readings", "tapes_of"]

Array = NDArray[np.float64]
LawOf = Callable[..., AnyArray]

NEAR_AN_END: Final = 256.0 * float(np.finfo(float).eps)
"""Share of a time by which a program is asked inside its leg, so that it is not asked beyond a jump at an end."""


@dataclass(frozen=True, eq=False)
class BatchLaws:
    """The dimensionless laws as functions of (argument, one array for each parameter that varies)."""

    preference: LawOf
    preference_slope: LawOf
    flow: LawOf
    threshold: LawOf


def batch_laws(strut: Strut, varying: Sequence[str], xp: Any) -> BatchLaws:
    """Compile the laws of a strut's material for a library of arrays.

    Parameters
    ----------
    strut : Strut
        The model.
    varying : sequence of str
        Parameters of the material that come as arrays, in the units of the material.
    xp : module
        The functions of the library.

    Returns
    -------
    BatchLaws
    """
    wanted = (("preference", 0), ("preference", 1), ("flow", 0), ("threshold", 0))
    return BatchLaws(*(law_of(strut, varying, xp, name, order) for name, order in wanted))


def law_of(strut: Strut, varying: Sequence[str], xp: Any, name: str, order: int) -> LawOf:
    """Compile one dimensionless law, or its derivative of some order; see `batch_laws`."""
    tree, variable, numbers, argument_scale, value_scale = _written(strut, varying, name, order)
    return function_of(tree, variable, numbers, varying, xp, argument_scale, value_scale)


def tapes_of(struts: Struts) -> tuple[Tape, Tape, Tape]:
    """Write the slope of the preference, the threshold and the flow on tapes; see `batch_laws`."""

    def law(name: str, order: int) -> Tape:
        tree, variable, numbers, argument_scale, value_scale = _written(struts.strut, struts.varying, name, order)
        return tape_of(tree, variable, numbers, struts.varying, argument_scale, value_scale)

    return law("preference", 1), law("threshold", 0), law("flow", 0)


def _written(
    strut: Strut, varying: Sequence[str], name: str, order: int
) -> tuple[Any, str, dict[str, float], float, float]:
    """A law's tree or that of its derivative, its variable, the numbers in it, and the scales of argument and value."""
    numbers = {each: value for each, value in strut.material.values.items() if each not in varying}
    scales = getattr(strut.laws, name)
    expression = scales.expression.derivative(order) if order else scales.expression
    value_scale = scales.value_scale * scales.argument_scale**order
    return expression.tree, expression.variable, numbers, scales.argument_scale, value_scale


@dataclass(frozen=True)
class Forces:
    """Which loads act on the members, and in which rows of the parameters they are told.

    The rows are: where loads vary, the times at which the leg begins and ends; for each load its value where the leg
    begins and, where loads vary, its slope; for a thrust that is no straight line on its legs, the number of its
    program and its factor.

    Attributes
    ----------
    kinds : tuple of str
        Loads that act on some member; the thrust comes first.
    varying : bool
        Whether any of them changes on a leg.
    curved : tuple of (str, tuple of Program)
        Loads that are no straight lines on the legs of some course, with what their dimensionless programs add: one
        program for each course of the thrust, and one of any other load.
    """

    kinds: tuple[str, ...] = ("thrust",)
    varying: bool = False
    curved: tuple[tuple[str, tuple[Program, ...]], ...] = ()

    @property
    def rows(self) -> int:
        """How many rows of parameters they take."""
        return len(self.kinds) * (2 if self.varying else 1) + 2 * self.varying + 2 * bool(self.curved)

    def values(self, arrays: Arrays, t: AnyArray, p: AnyArray) -> dict[str, AnyArray]:
        """The loads of all members at their times."""
        if not self.varying:
            return {kind: p[i, ...] for i, kind in enumerate(self.kinds)}
        later = t - p[0, ...]
        found = {kind: p[2 + 2 * i, ...] + p[3 + 2 * i, ...] * later for i, kind in enumerate(self.kinds)}
        for kind, programs in self.curved:
            found[kind] = found[kind] + self._curved(arrays, kind, programs, t, p)
        return found

    def _curved(
        self, arrays: Arrays, kind: str, programs: Sequence[Program], t: AnyArray, p: AnyArray
    ) -> AnyArray:
        """What programs that are no straight lines add; asked on the host."""
        begin, end = arrays.host(p[0, ...]), arrays.host(p[1, ...])
        inside = np.clip(arrays.host(t), begin * (1.0 + NEAR_AN_END), end * (1.0 - NEAR_AN_END))
        if kind != "thrust":
            return arrays.of(programs[0](inside))
        which = arrays.host(p[self.rows - 2, ...])
        values = np.zeros(inside.shape)
        for number in np.unique(which):
            own = which == number
            values[own] = programs[int(number)](inside[own])
        return arrays.of(values) * p[self.rows - 1, ...]


@dataclass(frozen=True, eq=False)
class Struts:
    """Struts of one grid as a system for `numerics.stepper`.

    Attributes
    ----------
    strut : Strut
        The model that they share.
    varying : tuple of str
        Parameters of the material that are the members' own; their rows follow those of the loads.
    forces : Forces
        What acts on them.
    """

    strut: Strut
    varying: tuple[str, ...]
    forces: Forces

    @property
    def rows(self) -> int:
        """Rows of a state: the nodes, and the natural curvature."""
        return self.strut.grid.size + 1

    @property
    def autonomous(self) -> bool:
        """Whether no load changes on a leg."""
        return not self.forces.varying

    @property
    def switching(self) -> int:
        """The natural curvature, which moves or does not."""
        return self.strut.grid.size

    @cached_property
    def _parameter_rows(self) -> range:
        return range(self.forces.rows, self.forces.rows + len(self.varying))

    def rate(self, arrays: Arrays, width: int) -> Callable[[AnyArray, AnyArray, AnyArray, AnyArray], AnyArray]:
        """Return the right-hand side for blocks of a width, (t, y, p, out) -> dy/dt of shape (n + 1, width).

        Both integrals are one product each, the mean curvature riding along as a last row of the first::

            (theta, mean mu) = [A; w] mu,    mu_t = B (gamma sin theta) - (mu - mu_nat)
        """
        thrust_alone = self.forces.kinds == ("thrust",)
        moment = _thrust_moment(self, arrays, width) if thrust_alone else _moment(self, arrays, width)
        natural_rate = self._natural_rate(arrays, width)
        n, subtract, add = self.strut.grid.size, arrays.into("subtract"), arrays.into("add")

        def rate(t: AnyArray, y: AnyArray, p: AnyArray, out: AnyArray) -> AnyArray:
            mu, mu_nat = y[:n, ...], y[n, ...]
            target = None if out is None else out[:n, ...]
            couple, mean = moment(t, mu, p, target)
            mu_t = add(subtract(couple, mu, target), mu_nat, target)
            return arrays.stacked(mu_t, natural_rate(mean, mu_nat, p), out)

        return rate

    def machine(self, rtol: float) -> Callable[[Array, Array, Array], Array] | None:
        """Return what tries a step in machine code; None where a load is no straight line on its legs."""
        if self.forces.curved:
            return None
        from plastica.physics.machine import machine_of

        return machine_of(self, rtol)

    def _natural_rate(self, arrays: Arrays, width: int) -> Callable[[AnyArray, AnyArray, AnyArray], AnyArray]:
        """(mean curvature, mu_nat, p) -> f(D - Theta) - f(-Theta - D)."""
        laws, rows = batch_laws(self.strut, self.varying, arrays.xp), self._parameter_rows
        slope, threshold, flow = laws.preference_slope, laws.threshold, laws.flow
        both, xp = arrays.empty(2, width), arrays.xp

        def natural_rate(mean: AnyArray, mu_nat: AnyArray, p: AnyArray) -> AnyArray:
            own = [p[i, ...] for i in rows]
            drive = mean - mu_nat - slope(mu_nat, *own)
            bound = threshold(mu_nat, *own)
            flows = flow(arrays.pair(drive - bound, -bound - drive, both), *own)
            if not hasattr(flows, "shape"):
                return 0.0 * drive
            # A law may depend on its parameters alone.
            flows = xp.broadcast_to(flows, (2, width))
            return flows[0, ...] - flows[1, ...]

        return natural_rate


Moment = Callable[[AnyArray, AnyArray, AnyArray, AnyArray], tuple[AnyArray, AnyArray]]


def _angles(strut: Strut, arrays: Arrays, width: int, share: float) -> Callable[[AnyArray], AnyArray]:
    """From mu to (share * theta at the nodes, mean curvature)."""
    grid, matmul = strut.grid, arrays.into("matmul")
    matrix = arrays.of(np.vstack([share * grid.A, grid.w]))
    target = arrays.empty(grid.size + 1, width)
    return lambda mu: matmul(matrix, mu, target)


def _thrust_moment(struts: Struts, arrays: Arrays, width: int) -> Moment:
    """(t, mu, p, out) -> (couple, mean curvature) under a thrust alone."""
    strut, forces = struts.strut, struts.forces
    n, half = strut.grid.size, arrays.tangent_is_vectorised
    angles = _angles(strut, arrays, width, 0.5 if half else 1.0)
    matrix = arrays.of((2.0 if half else 1.0) * strut.grid.B)
    matmul, multiply, sin = arrays.into("matmul"), arrays.into("multiply"), arrays.into("sin")
    tan, add, divide = arrays.into("tan"), arrays.into("add"), arrays.into("divide")
    shear, square = arrays.empty(n, width), arrays.empty(n, width)
    steady = not forces.varying

    def moment(t: AnyArray, mu: AnyArray, p: AnyArray, out: AnyArray) -> tuple[AnyArray, AnyArray]:
        found = angles(mu)
        theta = found[:n, ...]
        gamma = p[0, ...] if steady else forces.values(arrays, t, p)["thrust"]
        if half:
            # sin(theta)/2 = x/(1 + x^2), x = tan(theta/2)
            x = tan(theta, shear)
            bottom = add(multiply(x, x, square), 1.0, square)
            push = divide(multiply(x, gamma, shear), bottom, shear)
        else:
            push = multiply(sin(theta, shear), gamma, shear)
        return matmul(matrix, push, out), found[n, ...]

    return moment


def _moment(struts: Struts, arrays: Arrays, width: int) -> Moment:
    """(t, mu, p, out) -> (couple, mean curvature) under all four loads."""
    strut, forces, xp = struts.strut, struts.forces, arrays.xp
    n, matmul, add = strut.grid.size, arrays.into("matmul"), arrays.into("add")
    angles, matrix = _angles(strut, arrays, width, 1.0), arrays.of(strut.grid.B)
    arm = arrays.of((1.0 - strut.grid.s)[:, None])

    def moment(t: AnyArray, mu: AnyArray, p: AnyArray, out: AnyArray) -> tuple[AnyArray, AnyArray]:
        found = angles(mu)
        theta = found[:n, ...]
        along, across, end_couple = _dead_force(strut, forces.values(arrays, t, p), arm)
        push = along * xp.sin(theta) + across * xp.cos(theta)
        return add(matmul(matrix, push, out), end_couple, out), found[n, ...]

    return moment


def _dead_force(strut: Strut, loads: Mapping[str, AnyArray], arm: AnyArray) -> tuple[AnyArray, AnyArray, AnyArray]:
    """The load beyond each node, (along, across) of (-along, across), and the end couple, of all members."""
    angle = strut.loads.weight_angle
    none = 0.0 * loads["thrust"]
    weight = loads.get("weight", none) * arm
    along = loads["thrust"] + math.cos(angle) * weight
    across = loads.get("transverse", none) + math.sin(angle) * weight
    return along, across, loads.get("couple", none)


def readings(struts: Struts, y: Array, own: Array, loads: Mapping[str, Array]) -> dict[str, Array]:
    """What is told of each member's state, dimensionless.

    Parameters
    ----------
    struts : Struts
        The model that they share.
    y : ndarray, shape (n + 1, members)
        States.
    own : ndarray, shape (parameters, members)
        The parameters of the material that vary, in the order of `struts.varying`.
    loads : mapping of str to ndarray, shape (members,)
        The present loads by kind; what is left out is 0.

    Returns
    -------
    dict of ndarray, shape (members,)
        natural_curvature, drive, threshold, tip_x, tip_y, tip_angle, largest_angle and liapunov: the stored energy
        1/2 int (mu - mu_nat)^2 + kappa(mu_nat) and the potential of the dead loads (design, section 1.2).
    """
    # In columns by the dozen, row by row, no sum depends on which members are beside one another.
    count = y.shape[1]
    y, own = _padded(y), _padded(own)
    loads = {kind: _padded(np.broadcast_to(values, (count,))) for kind, values in loads.items()}
    with np.errstate(all="ignore"):
        return {name: values[:count].copy() for name, values in _readings(struts, y, own, loads).items()}


def _readings(struts: Struts, y: Array, own: Array, loads: Mapping[str, Array]) -> dict[str, Array]:
    strut, laws = struts.strut, batch_laws(struts.strut, struts.varying, np)
    grid, mu, mu_nat = strut.grid, y[:-1], y[-1]
    integrals = np.vstack([grid.A, grid.w]) @ mu
    theta, mean = integrals[:-1], integrals[-1]
    cos, sin = np.cos(theta), np.sin(theta)

    def whole(values: Array) -> Array:
        return np.asarray((grid.w[:, None] * values).sum(axis=0))

    along, across, end_couple = _dead_force(strut, loads, (1.0 - grid.s)[:, None])
    stored = 0.5 * whole((mu - mu_nat) ** 2) + laws.preference(mu_nat, *own)
    return {
        "natural_curvature": mu_nat,
        "drive": mean - mu_nat - laws.preference_slope(mu_nat, *own),
        "threshold": np.broadcast_to(laws.threshold(mu_nat, *own), mu_nat.shape),
        "tip_x": whole(cos),
        "tip_y": whole(sin),
        "tip_angle": mean,
        "largest_angle": np.abs(grid.even_integrals @ mu).max(axis=0),
        "liapunov": stored + whole(along * cos - across * sin) - end_couple * mean,
    }


def _padded(values: Array) -> Array:
    """The same with its last column repeated up to a multiple of `LANES`."""
    return np.pad(values, [(0, 0)] * (values.ndim - 1) + [(0, -values.shape[-1] % LANES)], mode="edge")
