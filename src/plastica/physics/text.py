"""Load programs written as text in t."""

from __future__ import annotations

import math
from bisect import bisect_left
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from itertools import pairwise
from typing import TYPE_CHECKING, ClassVar, final

import numpy as np

from plastica.errors import ArgumentError
from plastica.physics.polyline import Array, Knot, Piece, near
from plastica.physics.program import Program, finite_fields

if TYPE_CHECKING:
    from plastica.material.expression import Expression
    from plastica.physics.pace import Paces

__all__ = ["Text"]

@lru_cache(maxsize=256)
def _read(text: str, names: tuple[str, ...]) -> Expression:
    from plastica.material.expression import parse

    return parse(text, variable="t", parameters=names, allow_step=True, where="text")


@lru_cache(maxsize=64)
def _paced(text: Text, until: float) -> Paces:
    """Return the paces of a text up to `until`, computed once."""
    return text.paced(until)


@final
@dataclass(frozen=True, repr=False)
class Text(Program):
    """A program written as text in t, such as "3*step(t - 1) + sin(t)".

    Parameters
    ----------
    text : str
        The expression.
    parameters : tuple of (name, value)
        Values of its named parameters.
    time_scale, value_scale : float
        The program is text(t · time_scale) / value_scale.

    Raises
    ------
    ArgumentError
        If the text is no expression in t, or a parameter is not finite.
    """

    kind: ClassVar[str] = "text"
    text: str
    parameters: tuple[tuple[str, float], ...] = ()
    time_scale: float = 1.0
    value_scale: float = 1.0

    def _validate(self) -> None:
        finite_fields(self, ("time_scale", "value_scale"))
        if not self.time_scale > 0.0 or self.value_scale == 0.0:
            raise ArgumentError("must be positive", where="time_scale", value=self.time_scale)
        if not isinstance(self.text, str):
            raise ArgumentError("must be text", where="text", value=self.text)
        for pair in self.parameters:
            if len(pair) != 2 or not isinstance(pair[0], str) or not isinstance(pair[1], float):
                raise ArgumentError("must be names with numbers", where="parameters", value=pair)
            if not math.isfinite(pair[1]):
                raise ArgumentError("must be finite", where=f"parameters.{pair[0]}", value=pair[1])
        _ = self._jumps

    @cached_property
    def _expression(self) -> Expression:
        return _read(self.text, tuple(name for name, _ in self.parameters))

    @cached_property
    def _breaks(self) -> tuple[tuple[float, str], ...]:
        from plastica.material.expression import breakpoints

        merged: dict[float, str] = {}
        for point in breakpoints(self._expression, dict(self.parameters)):
            t = point.position / self.time_scale
            last = max(merged, default=-math.inf)
            # "step(t - 0.3) + step(t - 0.1 - 0.2)" breaks once, not twice.
            same = t - last <= 0.5 * near(t)
            merged[last if same else t] = "jump" if same and "jump" in (merged[last], point.kind) else point.kind
        return tuple(merged.items())

    @cached_property
    def _jumps(self) -> tuple[float, ...]:
        """Where the value jumps; where factors of a step are 0 it does not."""
        steps = [t for t, kind in self._breaks if kind == "jump"]
        return tuple(t for t, size in zip(steps, map(self._size, steps), strict=True) if size)

    def _size(self, t: float) -> float:
        """Return the jump of the value at a break; 0 where it is lost in rounding."""
        after, before = self._scalar(t + near(t)), self._scalar(t - near(t))
        rise, fall = (float(each) for each in self._slopes(np.array([t + near(t), t - near(t)])))
        rounding = 1e-14 * abs(after) + 4.0 * near(t) * (abs(rise) + abs(fall))
        return 0.0 if abs(after - before) <= rounding else after - before

    @cached_property
    def _scalar(self) -> Callable[[float], float]:
        return self._expression.scalar(dict(self.parameters), self.time_scale, 1.0 / self.value_scale)

    @cached_property
    def _vector(self) -> Callable[[Array], Array]:
        return self._expression.vector(dict(self.parameters), self.time_scale, 1.0 / self.value_scale)

    @cached_property
    def _slopes(self) -> Callable[[Array], Array]:
        factor = self.time_scale / self.value_scale
        return self._expression.derivative().vector(dict(self.parameters), self.time_scale, factor)

    def _scaled(self, time: float, value: float) -> Text:
        return replace(self, time_scale=self.time_scale * time, value_scale=self.value_scale * value)

    def _beside(self, t: Array, side: float) -> Array:
        """Evaluate, on a jump the limit from the given side, whichever way the jump's own time is rounded."""
        evaluate = self._vector
        values = evaluate(t)
        on_jump = np.isin(t, self._jumps)
        if not on_jump.any():
            return values
        shift = side * 16.0 * np.spacing(np.abs(t))
        here, there = evaluate(t + shift), evaluate(t - shift)
        with np.errstate(invalid="ignore"):
            wrong = on_jump & ~(np.abs(values - here) <= 1e-6 * np.abs(there - here))
        return np.where(wrong, here, values)

    def _values(self, t: Array) -> Array:
        return self._beside(t, 1.0)

    def _values_before(self, t: Array) -> Array:
        return self._beside(t, -1.0)

    @cached_property
    def _flat(self) -> bool:
        """Whether it is constant between its jumps."""
        return bool(self._expression.derivative().tree == 0)

    @property
    def constant(self) -> bool:
        """Whether the text says the same at all t ≥ 0."""
        return self._flat and not any(t > 0.0 for t in self._jumps)

    @property
    def settled(self) -> float | None:
        """The last break, if what the text says beyond it no longer has t in it; else None.

        Decided on the formula, for samples of a slope that is 0 for most of the time prove nothing.
        """
        from plastica.material.expression import constant_beyond

        last = max([0.0, *(t for t, _ in self._breaks)])
        if self._flat:
            return max([0.0, *self._jumps])
        beyond = (last + near(last) + 1.0 + last) * self.time_scale
        return last if constant_beyond(self._expression, dict(self.parameters), beyond) else None

    def paced(self, until: float) -> Paces:
        """Return how fast the text changes on [0, until]."""
        from plastica.physics.pace import paces_of

        breaks = [t for t, _ in self._breaks]
        return paces_of(self._expression.tree, "t", dict(self.parameters), breaks, until, self.time_scale)

    def bursts(self, until: float) -> tuple[float, ...]:
        """Return where its pace changes, as shown by interval arithmetic on the formula; see `Program.bursts`."""
        return tuple(t for t in _paced(self, until).turns if 0.0 < t < until)

    def paces(self, points: Sequence[float]) -> list[float]:
        """Return the least of the longest steps on the pieces in between; see `Program.paces`."""
        paced = _paced(self, points[-1])
        return [paced.longest(a, b) for a, b in pairwise(points)]

    def hidden(self, until: float) -> tuple[tuple[float, float], ...]:
        """Return where the formula cannot be shown to hold no short change; see `Program.hidden`."""
        return _paced(self, until).hidden

    def on(self, a: float, b: float) -> Piece:
        """Return the program on [a, b]; see `Program.on`."""
        low, high = a, b
        for jump in self._jumps[bisect_left(self._jumps, a - near(a)) :]:
            if jump > b + near(b):
                break
            if abs(jump - a) <= near(a):
                low = max(low, jump + near(jump))
            elif abs(jump - b) <= near(b):
                high = min(high, jump - near(jump))
            else:
                raise ArgumentError("must hold no jump inside", where="interval", value=(a, b))
        value = self._scalar
        if self._flat:
            return value(0.5 * (low + high))
        if (low, high) == (a, b):
            return value
        return lambda t: value(low if t < low else min(t, high))

    def knots(self, until: float) -> tuple[Knot, ...]:
        """Return the jumps and kinks in (0, until]; see `Program.knots`."""
        inside = sorted({t for t, _ in self._breaks if 0.0 < t <= until})
        return tuple(knot for knot in map(self._knot, inside) if knot.size)

    def _knot(self, t: float) -> Knot:
        if t in self._jumps:
            return Knot(t, "jump", self(t) - self.before(t))
        before, after = (float(each) for each in self._slopes(np.array([t - near(t), t + near(t)])))
        return Knot(t, "slope", after - before)

    def _samples(self, until: float) -> list[Array]:
        """Return times to look at between breaks: dense everywhere, denser after each break and where it is fast."""
        breaks = [t for t, _ in self._breaks if 0.0 < t < until]
        ends = sorted({0.0, *breaks, until})
        even = np.linspace(0.0, 1.0, max(4096 // len(ends), 64) + 1)
        share = np.union1d(even, np.logspace(-12.0, 0.0, 512))
        looks = _paced(self, until).looks
        samples = []
        for a, b in pairwise(ends):
            t = np.union1d(a + (b - a) * share, looks[(looks > a) & (looks < b)])
            samples.append(np.clip(t, a + (near(a) if a else 0.0), b - near(b)))
        return samples

    def variation(self, until: float) -> float:
        """Return an estimate from above of the total variation on [0, until], from sampled slopes."""
        slope, pieces = self._slopes, self._samples(until)
        total = 0.0
        for t in pieces:
            values = self._finite(t)
            middle = 0.5 * (t[1:] + t[:-1])
            steep = np.abs(np.stack((slope(t)[1:], slope(middle), slope(t)[:-1]))).max(axis=0)
            steep = np.where(np.isfinite(steep), steep, 0.0)
            total += math.fsum(np.maximum(np.abs(np.diff(values)), steep * np.diff(t)))
        # Samples keep off the breaks by a few roundings; the factor covers what lies between.
        jumps = math.fsum(abs(knot.size) for knot in self.knots(until) if knot.kind == "jump")
        return jumps + total * (1.0 + 1e-9)

    def extreme(self, until: float) -> tuple[float, float]:
        """Return the least and the greatest value on [0, until], as far as samples show."""
        ends = self._finite(np.array([0.0, until]))
        found = [float(each) for each in ends]
        for t in self._samples(until):
            values = self._finite(t)
            found += [self._peak(t, values, 1.0), self._peak(t, values, -1.0)]
        return min(found), max(found)

    def _peak(self, t: Array, values: Array, sign: float) -> float:
        """Return the greatest (sign 1) or least (-1) value near the samples, looking twice more closely."""
        for _ in range(2):
            best = int(np.argmax(sign * values))
            t = np.linspace(t[max(best - 1, 0)], t[min(best + 1, len(t) - 1)], 129)
            values = np.append(self._finite(t), values[best])
            t = np.append(t, t[-1])
        return float(sign * (sign * values).max())

    def _finite(self, t: Array) -> Array:
        values = self._values(t)
        if not np.isfinite(values).all():
            at = float(t[~np.isfinite(values)][0]) * self.time_scale
            rule = f"must be finite during the run, but is not at t = {at:.6g}"
            raise ArgumentError(rule, where="text")
        return values

    def describe(self, value_unit: str = "", time_unit: str = "") -> str:
        """Say in words what the program does; see `Program.describe`."""
        values = "".join(f", {name} = {value:.6g}" for name, value in self.parameters)
        return f"{self.text} with t in {time_unit or 'units of the retardation time'}{values}"
