"""Defects to plant: each function spoils one thing of the package, through a monkeypatch that mends it again."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import plastica as pl
from plastica import units
from plastica.material import admissibility, functions, reader
from plastica.material import material as laws
from plastica.motion import checkpoint, integrate, keeping, store
from plastica.motion.history import History
from plastica.physics import bounds, initial, kernel, ledger, load, polyline, scales
from plastica.physics.strut import Strut

Patch = pytest.MonkeyPatch
Array = np.ndarray
Change = Callable[[Strut, float, Array, Array], None]


def both(*spoils: Callable[[Patch], None]) -> Callable[[Patch], None]:
    """Several defects at once."""

    def spoil(patch: Patch) -> None:
        for each in spoils:
            each(patch)

    return spoil


def replacing(place: Any, name: str, made: Callable[[Any], Any]) -> Callable[[Patch], None]:
    """A defect that puts something made of the sound thing in its place."""

    def spoil(patch: Patch) -> None:
        patch.setattr(place, name, made(getattr(place, name)))

    return spoil


def rate(change: Change) -> Callable[[Patch], None]:
    """A defect of the fast right-hand side: `change` gets (strut, t, y, dy/dt) and spoils the last."""

    def made(sound: Any) -> Any:
        def spoiled(strut: Strut, shear: Any) -> Any:
            whole = sound(strut, shear)

            def wrong(t: float, y: Array) -> Array:
                out = whole(t, y)
                change(strut, t, y, out)
                return np.asarray(out)

            return wrong

        return spoiled

    return replacing(kernel, "_uniform_rate", made)


def jacobian(row: int, column: int) -> Callable[[Patch], None]:
    """A defect of the Jacobian: one entry, counted from the place of the natural curvature, is left out."""

    def made(sound: Any) -> Any:
        def spoiled(strut: Strut, shear: Any, slope: Any) -> Any:
            whole, n = sound(strut, shear, slope), strut.grid.size

            def wrong(t: float, y: Array) -> Array:
                out = whole(t, y)
                out[n + row, n + column] = 0.0
                return np.asarray(out)

            return wrong

        return spoiled

    return replacing(kernel, "_jacobian", made)


def couple(change: Callable[[Strut, float, Array, Array], Array]) -> Callable[[Patch], None]:
    """A defect of the contact couple: `change` gets (strut, t, theta, M) and returns what is taken for M."""

    def made(sound: Any) -> Any:
        def spoiled(strut: Strut, start: float, end: float) -> Any:
            moment, slope = sound(strut, start, end)
            return lambda t, theta: change(strut, t, theta, moment(t, theta)), slope

        return spoiled

    return replacing(kernel, "load_moment", made)


def quadrature(name: str, matrix: Callable[[pl.Grid, Array], Array]) -> Callable[[Patch], None]:
    """A defect of A or B of every grid."""

    def spoil(patch: Patch) -> None:
        sound = vars(pl.Grid)[name].func
        patch.setattr(pl.Grid, name, property(lambda grid: matrix(grid, sound(grid))))

    return spoil


def scaled(kind: str) -> Callable[[Patch], None]:
    """A defect of the dimensionless laws: that of one kind has a power of L too many."""

    def made(sound: Any) -> Any:
        def wrong(length: float, stiffness: float, time: float) -> Any:
            out = sound(length, stiffness, time)
            argument, value = out[kind]
            return {**out, kind: (argument, value * length)}

        return wrong

    def spoil(patch: Patch) -> None:
        laws._laws.cache_clear()
        patch.setattr(laws, "_scales", made(laws._scales))

    return spoil


def _trapezoid(grid: pl.Grid, _sound: Array) -> Array:
    """The integral from each node to 1 by the trapezoidal rule: consistent, but not adjoint to A."""
    ends = np.append(grid.s, 1.0)
    out = np.zeros((grid.size, grid.size))
    for i in range(grid.size):
        for j in range(i, grid.size - 1):
            out[i, [j, j + 1]] += 0.5 * (ends[j + 1] - ends[j])
        out[i, -1] += 1.0 - grid.s[-1]
    return out


def taylor(_strut: Strut, _t: float, theta: Array, sound: Array) -> Array:
    """sin taken for its polynomial of degree 7: right to 1e-6 at small angles."""
    series = theta - theta**3 / 6.0 + theta**5 / 120.0 - theta**7 / 5040.0
    return sound + _strut.loads.thrust(_t) * (_strut.grid.B @ (series - np.sin(theta)))


def no_threshold(strut: Strut, _t: float, y: Array, out: Array) -> None:
    """The natural curvature flows however small its drive is."""
    n, flow = strut.grid.size, strut.laws.flow.value_at
    drive = float(strut.drive(y[:n], y[n]))
    out[n] = flow(drive) - flow(-drive)


def one_sided(strut: Strut, _t: float, y: Array, out: Array) -> None:
    """The second term of the evolution law is forgotten: no flow under a negative drive."""
    n = strut.grid.size
    out[n] = max(float(out[n]), 0.0)


def uneven(strut: Strut, _t: float, _y: Array, out: Array) -> None:
    """Flow to the positive side is faster by some ulps."""
    n = strut.grid.size
    if out[n] > 0.0:
        out[n] *= 1.0 + 1e-15


def against_the_drive(strut: Strut, _t: float, _y: Array, out: Array) -> None:
    n = strut.grid.size
    out[n] *= -1.0


def faster_fading(strut: Strut, _t: float, y: Array, out: Array) -> None:
    """The curvature's own rate -mu has a wrong digit."""
    n = strut.grid.size
    out[:n] -= 1e-5 * y[:n]


def ledger_entry(place: int, factor: float) -> Change:
    """The integrand of the ledger at `place` is multiplied."""

    def change(strut: Strut, _t: float, _y: Array, out: Array) -> None:
        out[strut.grid.size + place] *= factor

    return change


def unweighted(strut: Strut, _t: float, _y: Array, out: Array) -> None:
    """Viscous dissipation as a mean over the nodes instead of by the quadrature's weights."""
    n = strut.grid.size
    out[n + 2] = float(np.mean(out[:n] ** 2))


def late_switch(sound: Any) -> Any:
    """Onset and arrest are taken at the end of the step in which they fall."""
    return lambda kern, dense, lower, upper, moving, segment: upper


def thawed(sound: Any) -> Any:
    """What was frozen up to a switch is not kept: some of what follows it stays in its last step."""
    return property(lambda self: [])


def single_precision(sound: Any) -> Any:
    """Segments of a checkpoint keep the state in single precision."""

    def leg(archive: Any, i: int) -> Any:
        whole = sound(archive, i)
        history = whole.history
        rounded = history.y.astype(np.float32).astype(float)
        return replace(whole, history=History(history.t, rounded, history.first))

    return leg


def less_energy(sound: Any) -> Any:
    """The energy of the a-priori bound is halved."""
    return lambda strut, energy, end: sound(strut, 0.5 * energy, end)


def slower_growth(sound: Any) -> Any:
    """The constant of continuous dependence is halved."""
    return lambda *arguments: 0.5 * sound(*arguments)


def early_right_limit(sound: Any) -> Any:
    """At a jump the load is had from the side that does not belong to the leg."""

    def on(self: Any, a: float, b: float) -> Any:
        if isinstance(piece := sound(self, a, b), float):
            return float(self.at(np.array([b]))[0])
        return piece

    return on


DEFECTS: dict[str, Callable[[Patch], None]] = {
    "J* by the trapezoidal rule": quadrature("B", _trapezoid),
    "J* without the weights": quadrature("B", lambda grid, sound: grid.A.T),
    "a digit of J": quadrature("A", lambda grid, sound: sound * (1.0 + 1e-12)),
    "sin by its series": couple(taylor),
    "thrust of the other sign": couple(lambda strut, t, theta, sound: -sound),
    "a digit of the thrust": couple(lambda strut, t, theta, sound: sound * (1.0 + 1e-4)),
    "the couple taken at s = 0": couple(lambda strut, t, theta, sound: np.full_like(sound, sound[0])),
    "a digit of the elastic rate": rate(faster_fading),
    "no threshold": rate(no_threshold),
    "flow to one side only": rate(one_sided),
    "flow against the drive": rate(against_the_drive),
    "a flow uneven by ulps": rate(uneven),
    "natural dissipation dropped": rate(ledger_entry(3, 0.0)),
    "a digit of the work": rate(ledger_entry(1, 1.0 + 1e-5)),
    "dissipation without weights": rate(unweighted),
    "no slope of the drive in the Jacobian": jacobian(0, 0),
    "no coupling in the Jacobian": jacobian(-1, 0),
    "no natural dissipation in the Jacobian": jacobian(3, 0),
    "switches at the end of the step": replacing(integrate, "_switch", late_switch),
    "frozen but for its last step": replacing(integrate._Recorder, "frozen", thawed),
    "potential of the other sign": replacing(ledger, "potential", lambda sound: lambda *a: -sound(*a)),
    "half the energy in the bound": replacing(bounds, "bounds_of_energy", less_energy),
    "half the growth": replacing(bounds, "_growth", slower_growth),
    "no element end at a jump": replacing(initial, "breakpoints", lambda sound: lambda *a: ()),
    "preference scaled by L too often": scaled("preference"),
    "flow scaled by L too often": scaled("flow"),
    "threshold scaled by L too often": scaled("threshold"),
    "digest of nothing": replacing(store, "_digest", lambda sound: lambda file: "0"),
    "checkpoint in single precision": replacing(checkpoint, "_leg", single_precision),
    "checkpoint of any run": replacing(keeping, "fingerprint", lambda sound: lambda *a: "the same"),
    "the other side of a jump": replacing(polyline.Polyline, "on", early_right_limit),
    "half the variation": replacing(polyline.Polyline, "variation", lambda f: lambda self, t: 0.5 * f(self, t)),
    "distributed load by L**2": replacing(scales.Scales, "distributed", lambda sound: scales.Scales.force),
    "mirror forgets the couple": replacing(
        load.Load, "mirrored", lambda f: lambda self: replace(f(self), couple=self.couple)
    ),
    "every hypothesis on evenness holds": replacing(
        admissibility, "_even", lambda f: lambda law: replace(f(law), holds=True, witness=None)
    ),
    "growth is not judged": replacing(
        admissibility, "_grows", lambda f: lambda law: replace(f(law), holds=True, witness=None)
    ),
    "steps allowed in laws": replacing(
        reader,
        "read_tree",
        lambda sound: lambda text, variable, names, _, where: sound(text, variable, names, 1, where),
    ),
}
"""Name -> what plants it."""


def derivative_of_tanh(patch: Patch) -> None:
    """tanh' = 1/cosh, the square forgotten."""
    import sympy as sp

    patch.setitem(functions._OUTER, sp.tanh, lambda u: 1 / sp.cosh(u))


def derivative_of_pos(patch: Patch) -> None:
    """pos' is 1 at 0, too."""
    patch.setitem(functions._OUTER, functions.pos, functions.step)


def centi(patch: Patch) -> None:
    """milli is taken for centi."""
    patch.setitem(units._PREFIXES, "m", -2)


DEFECTS |= {
    "a wrong derivative": derivative_of_tanh,
    "a wrong derivative at a kink": derivative_of_pos,
    "milli taken for centi": centi,
    "units of any dimension": replacing(
        units, "parse_quantity", lambda sound: lambda text, *, where: (sound(text, where=where)[0], None)
    ),
}
