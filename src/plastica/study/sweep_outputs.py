"""What is kept of every member of a sweep: names, shapes, units and words."""

from __future__ import annotations

from dataclasses import dataclass
from math import prod
from types import MappingProxyType
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from plastica.physics.scales import unit_of
from plastica.study.sweep_plan import Plan

__all__ = [
    "FAILED",
    "HISTORY",
    "LIMITS",
    "METHODS",
    "REFUSED",
    "REGIMES",
    "STATUSES",
    "Fixed",
    "Variable",
    "coordinates_of",
    "empty_chunk",
    "fixed_of",
    "variables_of",
]

PENDING: Final = -1
"""In place of a code: not computed yet."""

STATUSES: Final = (
    "done",
    "equilibrium",
    "creeping",
    "step_limit",
    "solver_failed",
    "not_finite",
    "never_settled",
    "refused",
    "not_resolved",
)
"""How a member ended: codes as in `Status`, and "refused" where its scenario cannot be used."""

FAILED: Final = frozenset({"step_limit", "solver_failed", "not_finite", "never_settled", "refused", "not_resolved"})

METHODS: Final = ("DOP853", "LSODA", "Radau", "BDF", "Gauss", "none")

REGIMES: Final = ("recovers", "buckles", "permanent set", "buckles with permanent set", "untold")
"""What becomes of a rod: it springs back or keeps a set once let go, and is buckled or not as long as it is pushed."""

LIMITS: Final = ("interior", "limiting", "undecided", "none")

STABLE: Final = ("no", "yes", "unknown")
NO_OR_YES: Final = ("no", "yes")

REFUSED: Final = MappingProxyType(
    {
        "status": STATUSES.index("refused"),
        "method": METHODS.index("none"),
        "steps": 0,
        "nodes": 0,
        "regime": REGIMES.index("untold"),
        "yielding": 0,
        "limit_kind": LIMITS.index("none"),
        "limit_stable": STABLE.index("unknown"),
    }
)
"""What is kept of a member whose scenario cannot be used."""

FINAL: Final = {
    "natural_curvature": ("curvature", "natural curvature at the end"),
    "drive": ("drive", "driving force on the natural curvature at the end"),
    "threshold": ("drive", "threshold that the drive must exceed, at the end"),
    "tip_x": ("length", "free end, along the clamp's tangent"),
    "tip_y": ("length", "free end, across the clamp's tangent"),
    "tip_angle": ("angle", "tangent angle at the free end"),
    "largest_angle": ("angle", "largest tangent angle, without its sign"),
    "liapunov": ("energy", "Liapunov function: energies plus potential of the loads"),
}
"""What is told of the last state: kind and words. The first three are by segment where there are several."""

BY_SEGMENT: Final = ("natural_curvature", "drive", "threshold")

HISTORY: Final = ("natural_curvature", "drive", "tip_x", "tip_y", "tip_angle", "liapunov")


@dataclass(frozen=True)
class Variable:
    """One array of the store.

    Attributes
    ----------
    name : str
        What it is called.
    dims : tuple of str
        Its dimensions; the first is "member".
    shape : tuple of int
        Their sizes beside the first.
    dtype : str
        As NumPy writes it.
    fill : float or int
        What stands for "not computed yet".
    unit, words : str
        Unit and meaning.
    flags : tuple of str
        What codes mean.
    """

    name: str
    dims: tuple[str, ...]
    shape: tuple[int, ...]
    dtype: str
    fill: float | int
    unit: str
    words: str
    flags: tuple[str, ...] = ()

    @property
    def bytes_per_member(self) -> int:
        """Before compression."""
        return int(np.dtype(self.dtype).itemsize * prod(self.shape))

    @property
    def attributes(self) -> dict[str, Any]:
        """Unit, words and codes, as netCDF conventions write them."""
        told: dict[str, Any] = {"units": self.unit, "long_name": self.words}
        if self.flags:
            told |= {"flag_values": list(range(len(self.flags))), "flag_meanings": " ".join(map(_word, self.flags))}
        return told

    def empty(self, count: int) -> NDArray[Any]:
        """Return an array for some members, with nothing in it."""
        return np.full((count, *self.shape), self.fill, dtype=self.dtype)


def _word(flag: str) -> str:
    return flag.replace(" ", "_")


def _code(name: str, words: str, flags: tuple[str, ...]) -> Variable:
    return Variable(name, ("member",), (), "<i1", PENDING, "1", words, flags)


def _whole(name: str, words: str) -> Variable:
    return Variable(name, ("member",), (), "<i4", PENDING, "1", words)


def variables_of(plan: Plan) -> tuple[Variable, ...]:
    """Return the arrays that a sweep computes, by name."""
    plain = plan.base.model.specimen is None
    segments = plan.base.model.segments

    def number(name: str, kind: str, words: str, dims: tuple[str, ...] = (), shape: tuple[int, ...] = ()) -> Variable:
        return Variable(name, ("member", *dims), shape, "<f8", np.nan, unit_of(kind, plain, thermal=False), words)

    made = [
        _code("status", "how the member ended", STATUSES),
        _code("method", "integrator", METHODS),
        _whole("steps", "steps"),
        _whole("nodes", "nodes per element"),
        number("time_reached", "time", "time of the last state"),
    ]

    def told(name: str, suffix: str = "", dims: tuple[str, ...] = (), shape: tuple[int, ...] = ()) -> Variable:
        kind, words = FINAL[name]
        if name in BY_SEGMENT and segments > 1:
            dims, shape = (*dims, "segment"), (*shape, segments)
        return number(name + suffix, kind, words.removesuffix(" at the end").removesuffix(", at the end"), dims, shape)

    if "final" in plan.outputs:
        made += [told(name) for name in FINAL]
    if "verdict" in plan.outputs:
        made.append(_code("regime", "what becomes of the rod", REGIMES))
        made.append(_code("yielding", "whether the drive is beyond its threshold at the end", NO_OR_YES))
    if "limit" in plan.outputs:
        made.append(_code("limit_kind", "where the member ends: kind of its limit", LIMITS))
        made.append(_code("limit_stable", "whether that limit is stable", STABLE))
        made.append(number("limit_natural_curvature", "curvature", "natural curvature of that limit"))
    if "state" in plan.outputs:
        size = plan.base.problem.strut.grid.size
        made.append(number("curvature", "curvature", "curvature of the centre line at the end", ("s",), (size,)))
    if plan.times is not None:
        made += [told(name, "_history", ("t",), (plan.times.size,)) for name in HISTORY]
    return tuple(sorted(made, key=lambda each: each.name))


def coordinates_of(plan: Plan) -> tuple[Variable, ...]:
    """Return the arrays of what is varied; a label is told by its place in the attribute `labels`."""
    kinds = {"number": ("<f8", np.nan), "whole": ("<i8", PENDING), "label": ("<i4", PENDING)}
    return tuple(
        Variable(
            axis.key,
            ("member",),
            (),
            kinds[axis.kind][0],
            kinds[axis.kind][1],
            axis.unit or "1",
            f"{axis.key} of the scenario",
            axis.words,
        )
        for axis in plan.axes
    )


@dataclass(frozen=True, eq=False)
class Fixed:
    """Numbers that all members share, as a coordinate: name, dimension, values, unit and words."""

    name: str
    dim: str
    values: NDArray[np.float64]
    unit: str
    words: str

    @property
    def attributes(self) -> dict[str, str]:
        """Unit and words, as netCDF conventions write them."""
        return {"units": self.unit, "long_name": self.words}


def fixed_of(plan: Plan) -> tuple[Fixed, ...]:
    """Return the coordinates that all members share: times of the histories, nodes of the state and their weights."""
    model, made = plan.base.problem.strut, []
    si = model.specimen is not None
    if plan.times is not None:
        made.append(Fixed("t", "t", plan.times, "s" if si else "1", "time"))
    if "state" in plan.outputs:
        unit, length = "m" if si else "1", model.scales.length
        made.append(Fixed("s", "s", model.grid.s * length, unit, "arc length from the clamp"))
        made.append(Fixed("s_weight", "s", model.grid.w * length, unit, "quadrature weight of the node"))
    return tuple(made)


def empty_chunk(plan: Plan, count: int) -> dict[str, NDArray[Any]]:
    """Return arrays for some members, with nothing in them."""
    return {variable.name: variable.empty(count) for variable in variables_of(plan)}
