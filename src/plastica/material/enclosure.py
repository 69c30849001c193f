"""Formulas on intervals: bounds of all that an expression can be between two arguments.

Interval arithmetic on the tape of a formula: every operation takes bounds to bounds. What comes out holds the range to
rounding; it is wider than the range where the variable occurs several times, and tends to it as the interval shrinks.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Final, TypeAlias

import numpy as np
from numpy.typing import NDArray

from plastica.material.tape import CODES, Tape, tape_of

__all__ = ["Bounds", "Enclosure", "enclosure"]

Array: TypeAlias = NDArray[np.float64]
Bounds: TypeAlias = tuple[Array, Array]
"""Lower and upper bounds, arrays of one shape."""

_NAMES: Final = {code: name for name, code in CODES.items()}
_TURN: Final = 2.0 * np.pi


@dataclass(frozen=True, eq=False)
class Enclosure:
    """A formula of one variable, to be evaluated on intervals and at points.

    Attributes
    ----------
    tape : Tape
        The formula.
    """

    tape: Tape

    def __call__(self, low: Array, high: Array, home: Array | None = None) -> Bounds:
        """Return bounds of the formula on intervals.

        Parameters
        ----------
        low, high : ndarray
            The ends of the intervals.
        home : ndarray, optional
            For each interval a point of the piece, free of breaks, that it belongs to: every pos, abs and step is then
            on the branch that it has there. nan where that is not known; nor is it where the argument is 0 there.

        Returns
        -------
        tuple of ndarray
            Lower and upper bounds; infinite where nothing is known.
        """
        branch = None if home is None else self._registers(home)
        known: list[Bounds] = [(low, high), *((each, each) for each in self._constants(low))]
        with np.errstate(all="ignore"):
            for code, _, first, second in self.tape.operations:
                name = _NAMES[int(code)]
                a, b = known[first], known[second]
                at = None if branch is None else branch[first]
                known.append(_whole_where_unknown(_bounds(name, a, b, same=first == second, home=at)))
        return known[self.tape.result]

    def at(self, points: Array) -> Array:
        """Return the values at points."""
        return self._registers(points)[self.tape.result]

    def _constants(self, like: Array) -> list[Array]:
        return [np.full(like.shape, value) for value in self.tape.constants]

    def _registers(self, points: Array) -> list[Array]:
        known = [points, *self._constants(points)]
        with np.errstate(all="ignore"):
            for code, _, first, second in self.tape.operations:
                name, x = _NAMES[int(code)], known[first]
                known.append(_BINARY[name](x, known[second]) if name in _BINARY else _UNARY[name](x))
        return known


def enclosure(
    tree: Any,
    variable: str,
    values: Mapping[str, float],
    argument_scale: float = 1.0,
    value_scale: float = 1.0,
) -> Enclosure:
    """Make x -> value_scale * tree(argument_scale * x) a formula on intervals.

    Parameters
    ----------
    tree, variable, values, argument_scale, value_scale
        As in `plastica.material.tape.tape_of`.

    Returns
    -------
    Enclosure
    """
    return Enclosure(tape_of(tree, variable, values, (), argument_scale, value_scale))


def _bounds(name: str, a: Bounds, b: Bounds, *, same: bool, home: Array | None) -> Bounds:
    if name in _RISING:
        rising = _RISING[name]
        return rising(a[0]), rising(a[1])
    if name in _BROKEN:
        return _broken(name, a, home)
    if name == "multiply" and same:
        return _even(np.square, a)
    return _OTHERS[name](a, b)


def _whole_where_unknown(found: Bounds) -> Bounds:
    low, high = found
    unknown = np.isnan(low) | np.isnan(high)
    return (np.where(unknown, -np.inf, low), np.where(unknown, np.inf, high)) if unknown.any() else found


def _even(function: Callable[[Array], Array], a: Bounds) -> Bounds:
    """Bounds of an even function that rises on the right."""
    ends = function(a[0]), function(a[1])
    least = np.where((a[0] <= 0.0) & (a[1] >= 0.0), function(np.zeros_like(a[0])), np.minimum(*ends))
    return least, np.maximum(*ends)


def _corners(function: Callable[[Array, Array], Array], a: Bounds, b: Bounds) -> Bounds:
    found = np.stack([function(x, y) for x in a for y in b])
    return found.min(axis=0), found.max(axis=0)


def _product(x: Array, y: Array) -> Array:
    # 0 times whatever is finite is 0, and infinity is only a bound of that.
    return np.where((x == 0.0) | (y == 0.0), 0.0, x * y)


def _multiplied(a: Bounds, b: Bounds) -> Bounds:
    return _corners(_product, a, b)


def _divided(a: Bounds, b: Bounds) -> Bounds:
    low, high = b
    through = (low < 0.0) & (high > 0.0)
    # At an end that is 0 the quotient is unbounded on the side of the divisor's sign.
    below = np.where(through, -np.inf, np.where(high == 0.0, -np.inf, 1.0 / high))
    above = np.where(through, np.inf, np.where(low == 0.0, np.inf, 1.0 / low))
    return _multiplied(a, (below, above))


def _powered(base: Bounds, exponent: Bounds) -> Bounds:
    low, high = _corners(np.power, (np.maximum(base[0], 0.0), base[1]), exponent)
    negative = base[0] < 0.0
    return np.where(negative, -np.inf, low), np.where(negative, np.inf, high)


def _sine(a: Bounds, b: Bounds) -> Bounds:
    return _waves(np.sin, 0.25 * _TURN, a)


def _cosine(a: Bounds, b: Bounds) -> Bounds:
    return _waves(np.cos, 0.0, a)


def _waves(function: Callable[[Array], Array], top: float, a: Bounds) -> Bounds:
    """Bounds of a wave that is 1 at `top`, and -1 half a turn later."""
    ends = function(a[0]), function(a[1])
    low = np.where(_holds(a, top + 0.5 * _TURN), -1.0, np.minimum(*ends))
    high = np.where(_holds(a, top), 1.0, np.maximum(*ends))
    endless = ~(np.isfinite(a[0]) & np.isfinite(a[1]))
    return np.where(endless, -1.0, low), np.where(endless, 1.0, high)


def _holds(a: Bounds, place: float, turn: float = _TURN) -> NDArray[np.bool_]:
    """Whether an interval holds a place, or one that is whole turns from it."""
    return np.asarray(np.ceil((a[0] - place) / turn) * turn + place <= a[1])


def _tangent(a: Bounds, b: Bounds) -> Bounds:
    pole = _holds(a, 0.25 * _TURN, 0.5 * _TURN) | ~(np.isfinite(a[0]) & np.isfinite(a[1]))
    return np.where(pole, -np.inf, np.tan(a[0])), np.where(pole, np.inf, np.tan(a[1]))


def _root(x: Array) -> Array:
    return np.sqrt(np.where(x < 0.0, 0.0, x))


def _logarithm(x: Array) -> Array:
    return np.log(np.where(x < 0.0, 0.0, x))


_RISING: Final[dict[str, Callable[[Array], Array]]] = {
    "exp": np.exp,
    "log": _logarithm,
    "tanh": np.tanh,
    "sinh": np.sinh,
    "sqrt": _root,
    "atan": np.arctan,
}

_OTHERS: Final[dict[str, Callable[[Bounds, Bounds], Bounds]]] = {
    "add": lambda a, b: (a[0] + b[0], a[1] + b[1]),
    "multiply": _multiplied,
    "divide": _divided,
    "power": _powered,
    "sin": _sine,
    "cos": _cosine,
    "tan": _tangent,
    "cosh": lambda a, _: _even(np.cosh, a),
}

_BROKEN: Final[dict[str, Callable[[Array], Array]]] = {
    "absolute": np.abs,
    "sign": np.sign,
    "pos": lambda x: np.maximum(x, 0.0),
    "above": lambda x: np.heaviside(x, 0.0),
    "step": lambda x: np.heaviside(x, 1.0),
}


def _broken(name: str, a: Bounds, home: Array | None) -> Bounds:
    """Bounds of a function with a break at 0: on its branch where that is known."""
    function = _BROKEN[name]
    found = _even(np.abs, a) if name == "absolute" else (function(a[0]), function(a[1]))
    if home is None:
        return found
    if name == "absolute":
        branch = np.where(home < 0.0, -a[1], a[0]), np.where(home < 0.0, -a[0], a[1])
    elif name == "pos":
        branch = np.where(home > 0.0, a[0], 0.0), np.where(home > 0.0, a[1], 0.0)
    else:
        branch = function(home), function(home)
    # An argument that is 0 there has no sign: what is so small that rounding makes it 0 may still rise elsewhere.
    unknown = np.isnan(home) | (home == 0.0)
    return np.where(unknown, found[0], branch[0]), np.where(unknown, found[1], branch[1])


_UNARY: Final[dict[str, Callable[[Array], Array]]] = {
    **_RISING,
    **_BROKEN,
    "log": np.log,
    "sqrt": np.sqrt,
    "sin": np.sin,
    "cos": np.cos,
    "tan": np.tan,
    "cosh": np.cosh,
}

_BINARY: Final[dict[str, Callable[[Array, Array], Array]]] = {
    "add": np.add,
    "multiply": np.multiply,
    "divide": np.divide,
    "power": np.power,
}
