"""One step tried by many struts, in machine code: what `numerics.block` and `physics.batch` say, several times as fast.

Columns go through in tiles that stay in the nearest cache from the first stage to the last. Every tile has the same
number of lanes, so that no lane is computed in another way than its neighbours. The laws come as tapes: nothing is
compiled anew for another material, and what has been compiled is kept for the next process: beside this file, which is
why all of it is in this one file, for only a change of this file has it compiled again.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any, Final, TypeVar

import numba
import numpy as np
from numpy.typing import NDArray

from plastica.material.tape import CODES, Tape
from plastica.numerics import dop853
from plastica.physics.batch import Struts, tapes_of

__all__ = ["TILE", "machine_of", "sine_cosine"]

Array = NDArray[np.float64]
Rows = NDArray[np.int64]
F = TypeVar("F", bound=Callable[..., Any])

TILE: Final = 64
"""Lanes of a tile: a state of 17 rows takes 9 kB, and all that a step needs stays near."""

STAGES: Final = dop853.STAGES

PI_HIGH, PI_LOW = math.pi, 1.2246467991473532e-16
"""Pi in two parts."""

_ADD, _MULTIPLY, _DIVIDE, _POWER = (CODES[name] for name in ("add", "multiply", "divide", "power"))
_EXP, _LOG, _SIN, _COS, _TAN = (CODES[name] for name in ("exp", "log", "sin", "cos", "tan"))
_TANH, _SINH, _COSH, _SQRT, _ATAN = (CODES[name] for name in ("tanh", "sinh", "cosh", "sqrt", "atan"))
_ABSOLUTE, _SIGN, _POS, _ABOVE, _STEP = (CODES[name] for name in ("absolute", "sign", "pos", "above", "step"))


def _compiled(function: F) -> F:
    """Compile a function when it is first called, and keep the code for the next process where it may be written.

    Products and sums may be fused, and nothing else reordered: what a lane computes must not depend on its place.
    """
    options: dict[str, Any] = {"nogil": True, "fastmath": {"contract"}, "error_model": "numpy"}
    try:
        made: F = numba.njit(cache=True, **options)(function)
    except RuntimeError:
        made = numba.njit(**options)(function)
    return made


@_compiled
def sine_cosine(x: float) -> tuple[float, float]:
    """Sine and cosine to an absolute error of eps, in arithmetic that a compiler can do for many numbers at once.

    The argument is brought within pi/2 of 0 by a multiple of pi in two parts. There sin r = r + r z s(z) and
    cos r = 1 - z/2 + z^2 c(z), z = r^2, with s and c interpolated at Chebyshev points to 4e-17 and 7e-17. The sine is
    odd and the cosine even to the last bit.
    """
    turns = np.rint(x * (1.0 / PI_HIGH))
    r = (x - turns * PI_HIGH) - turns * PI_LOW
    z = r * r
    s = 2.73144475909634e-15
    s = s * z - 7.643970296165793e-13
    s = s * z + 1.6058977312444268e-10
    s = s * z - 2.5052107616995878e-08
    s = s * z + 2.755731921916323e-06
    s = s * z - 0.00019841269841254974
    s = s * z + 0.008333333333333316
    s = s * z - 0.16666666666666666
    c = 4.646435945991158e-14
    c = c * z - 1.1466252258828019e-11
    c = c * z + 2.087668155884492e-09
    c = c * z - 2.7557318573365916e-07
    c = c * z + 2.480158729891355e-05
    c = c * z - 0.0013888888888884767
    c = c * z + 0.04166666666666666
    half = 0.5 * turns
    sign = 1.0 - 4.0 * (half - np.floor(half))
    return sign * (r + r * z * s), sign * (1.0 - (0.5 * z - z * z * c))


@_compiled
def _run(operations: Rows, registers: Array) -> None:
    """Do what a tape says, on all lanes."""
    for k in range(operations.shape[0]):
        code, target = operations[k, 0], registers[operations[k, 1]]
        a, b = registers[operations[k, 2]], registers[operations[k, 3]]
        if code == _ADD:
            for lane in range(TILE):
                target[lane] = a[lane] + b[lane]
        elif code == _MULTIPLY:
            for lane in range(TILE):
                target[lane] = a[lane] * b[lane]
        elif code == _DIVIDE:
            for lane in range(TILE):
                target[lane] = a[lane] / b[lane]
        elif code == _POS:
            for lane in range(TILE):
                target[lane] = 0.0 if a[lane] <= 0.0 else a[lane]
        else:
            for lane in range(TILE):
                target[lane] = _value(code, a[lane], b[lane])


@_compiled
def _value(code: int, a: float, b: float) -> float:  # noqa: PLR0911  (one line for each)
    """One of the dearer operations, on one lane."""
    if code == _POWER:
        return math.pow(a, b)
    if code == _EXP:
        return math.exp(a)
    if code == _LOG:
        return math.log(a)
    if code == _SIN:
        return math.sin(a)
    if code == _COS:
        return math.cos(a)
    if code == _TAN:
        return math.tan(a)
    if code == _TANH:
        return math.tanh(a)
    if code == _SINH:
        return math.sinh(a)
    if code == _COSH:
        return math.cosh(a)
    if code == _SQRT:
        return math.sqrt(a)
    if code == _ATAN:
        return math.atan(a)
    if code == _ABSOLUTE:
        return abs(a)
    return _jump(code, a)


@_compiled
def _jump(code: int, x: float) -> float:
    """A function that jumps at 0; nan passes through."""
    if code == _SIGN:
        value = 1.0 if x > 0.0 else (-1.0 if x < 0.0 else 0.0)
    elif code == _ABOVE:
        value = 1.0 if x > 0.0 else 0.0
    else:
        value = 1.0 if x >= 0.0 else 0.0
    return x if math.isnan(x) else value


@_compiled
def _natural_rate(laws: Any, registers: Any, mean: Array, mu_nat: Array, h: Array, out: Array) -> None:
    """Write h (f(D - Theta) - f(-Theta - D)), D = mean - mu_nat - kappa'(mu_nat)."""
    (slope, slope_at), (threshold, threshold_at), (flow, flow_at) = laws
    for_slope, for_threshold, for_flow = registers
    for lane in range(TILE):
        for_slope[0, lane] = mu_nat[lane]
        for_threshold[0, lane] = mu_nat[lane]
    _run(slope, for_slope)
    _run(threshold, for_threshold)
    for lane in range(TILE):
        drive = mean[lane] - mu_nat[lane] - for_slope[slope_at, lane]
        for_flow[0, lane] = drive - for_threshold[threshold_at, lane]
    _run(flow, for_flow)
    for lane in range(TILE):
        out[lane] = for_flow[flow_at, lane]
        drive = mean[lane] - mu_nat[lane] - for_slope[slope_at, lane]
        for_flow[0, lane] = -for_threshold[threshold_at, lane] - drive
    _run(flow, for_flow)
    for lane in range(TILE):
        out[lane] = h[lane] * (out[lane] - for_flow[flow_at, lane])


@_compiled
def _load(row: int, varying: bool, later: Array, p: Array, out: Array) -> None:
    """Write one load at each lane's time; `row` is where its value stands, -1 where it does not act."""
    for lane in range(TILE):
        if row < 0:
            out[lane] = 0.0
        elif varying:
            out[lane] = p[row, lane] + p[row + 1, lane] * later[lane]
        else:
            out[lane] = p[row, lane]


@_compiled
def _curvature_rate(grid: Any, loads: Any, given: Array, y: Array, h: Array, room: Any, out: Array) -> None:
    """Write h (B push + couple - (mu - mu_nat)) for all nodes; the mean curvature is left in the angles' last row."""
    integrals, returns, arm = grid
    thrust_alone, along_share, across_share = loads
    angles, couples = room
    n = returns.shape[0]
    np.dot(integrals, y[:n], angles)
    for i in range(n):
        if thrust_alone:
            for lane in range(TILE):
                angles[i, lane] = given[0, lane] * sine_cosine(angles[i, lane])[0]
        else:
            for lane in range(TILE):
                sin, cos = sine_cosine(angles[i, lane])
                along = given[0, lane] + along_share * arm[i] * given[3, lane]
                across = given[1, lane] + across_share * arm[i] * given[3, lane]
                angles[i, lane] = along * sin + across * cos
    np.dot(returns, angles[:n], couples)
    for i in range(n):
        for lane in range(TILE):
            out[i, lane] = h[lane] * ((couples[i, lane] + given[2, lane]) - y[i, lane] + y[n, lane])


@_compiled
def _slopes(problem: Any, t: Array, y: Array, h: Array, p: Array, room: Any, out: Array) -> None:
    """Write the step times the rate of a tile of columns."""
    grid, loads, rows, varying, laws = problem
    given, later, registers, angles, couples = room
    if varying:
        for lane in range(TILE):
            later[lane] = t[lane] - p[0, lane]
    for k in range(4):
        _load(rows[k], varying, later, p, given[k])
    _curvature_rate(grid, loads, given, y, h, (angles, couples), out)
    n = angles.shape[0] - 1
    _natural_rate(laws, registers, angles[n], y[n], h, out[n])


@_compiled
def _stages(problem: Any, tableau: Any, own: Array, y: Array, p: Array, room: Any, trial: Array, k: Array) -> None:
    """Write the slopes of all stages, times the step."""
    t, h = own[0], own[1]
    taken, times = tableau[0], tableau[1]
    flat_y, flat_trial, flat = y.reshape(-1), trial.reshape(-1), k.reshape(STAGES, -1)
    at = np.empty(TILE)
    for stage in range(STAGES):
        for i in range(flat_y.size):
            flat_trial[i] = flat_y[i]
        for j in range(stage):
            a = taken[stage, j]
            if a != 0.0:
                for i in range(flat_y.size):
                    flat_trial[i] += a * flat[j, i]
        for lane in range(TILE):
            at[lane] = t[lane] + times[stage] * h[lane]
        _slopes(problem, at, trial, h, p, room, k[stage])


@_compiled
def _ended(tableau: Any, y: Array, k: Array, atol: Array, rtol: float, new: Array, errors: Array) -> None:
    """Write the new state, and the sums of squares of errors and first slope in units of the tolerance."""
    weights = tableau[2]
    for i in range(3):
        for lane in range(TILE):
            errors[i, lane] = 0.0
    for i in range(y.shape[0]):
        for lane in range(TILE):
            new[i, lane] = y[i, lane]
        for j in range(STAGES):
            b = weights[0, j]
            if b != 0.0:
                for lane in range(TILE):
                    new[i, lane] += b * k[j, i, lane]
        for lane in range(TILE):
            fifth, third = 0.0, 0.0
            for j in range(STAGES):
                fifth += weights[1, j] * k[j, i, lane]
                third += weights[2, j] * k[j, i, lane]
            scale = 1.0 / (max(abs(y[i, lane]), abs(new[i, lane])) * rtol + atol[lane])
            errors[0, lane] += (fifth * scale) ** 2
            errors[1, lane] += (third * scale) ** 2
            errors[2, lane] += (k[0, i, lane] * scale) ** 2


@_compiled
def _taken(source: Array, first: int, target: Array) -> None:
    """Copy the columns of a tile; beyond the last there are copies of it."""
    last = source.shape[1] - 1
    for i in range(source.shape[0]):
        for lane in range(TILE):
            target[i, lane] = source[i, min(first + lane, last)]


@_compiled
def _given_back(source: Array, first: int, target: Array) -> None:
    """Copy the lanes of a tile back to their columns."""
    count = min(TILE, target.shape[1] - first)
    for i in range(source.shape[0]):
        for lane in range(count):
            target[i, first + lane] = source[i, lane]


@_compiled
def _tried(shared: Any, rtol: float, columns: Array, p: Array, y: Array, found: Array) -> None:
    """Try a step of all columns, tile after tile; see `System.machine`."""
    problem, tableau, tapes = shared
    rows, n = y.shape[0], y.shape[0] - 1
    own, state, new = np.empty((3, TILE)), np.empty((rows, TILE)), np.empty((rows, TILE))
    trial, k, own_p = np.empty((rows, TILE)), np.empty((STAGES, rows, TILE)), np.empty((p.shape[0], TILE))
    errors = np.empty((3, TILE))
    registers = (_filled(tapes[0]), _filled(tapes[1]), _filled(tapes[2]))
    angles, couples = np.empty((rows, TILE)), np.empty((n, TILE))
    room = (np.empty((4, TILE)), np.empty(TILE), registers, angles, couples)
    first_own = tapes[3]
    for first in range(0, y.shape[1], TILE):
        _taken(columns, first, own)
        _taken(y, first, state)
        _taken(p, first, own_p)
        for each in registers:
            for i in range(first_own, p.shape[0]):
                for lane in range(TILE):
                    each[1 + i - first_own, lane] = own_p[i, lane]
        _stages(problem, tableau, own, state, own_p, room, trial, k)
        _ended(tableau, state, k, own[2], rtol, new, errors)
        _given_back(new, first, found[:rows])
        _given_back(errors, first, found[rows : rows + 3])
        _given_back(k[0, n:], first, found[rows + 3 : rows + 4])
        _given_back(k[STAGES - 1, n:], first, found[rows + 4 :])


@_compiled
def _filled(tape: Any) -> Array:
    """Registers with the constants of a tape."""
    constants, first, count = tape
    registers = np.zeros((count, TILE))
    for i in range(constants.size):
        for lane in range(TILE):
            registers[first + i, lane] = constants[i]
    return registers


def machine_of(struts: Struts, rtol: float) -> Callable[[Array, Array, Array], Array]:
    """Return what tries a step of a block of struts.

    Parameters
    ----------
    struts : Struts
        The model that they share, without loads that are no straight lines on the legs.
    rtol : float
        Relative tolerance.

    Returns
    -------
    callable
        (columns, p, y) -> found; see `numerics.stepper.System.machine`.
    """
    strut, forces = struts.strut, struts.forces
    grid, angle = strut.grid, strut.loads.weight_angle
    begin, each = (2, 2) if forces.varying else (0, 1)
    kinds = ("thrust", "transverse", "couple", "weight")
    rows = [begin + each * forces.kinds.index(kind) if kind in forces.kinds else -1 for kind in kinds]
    tapes = tapes_of(struts)
    problem = (
        (np.vstack([grid.A, grid.w]), np.ascontiguousarray(grid.B), 1.0 - grid.s),
        (forces.kinds == ("thrust",), math.cos(angle), math.sin(angle)),
        np.array(rows, dtype=np.int64),
        forces.varying,
        tuple((tape.operations, tape.result) for tape in tapes),
    )
    memory = (*(_constants(tape) for tape in tapes), forces.rows)
    shared = (problem, _tableau(), memory)

    def tried(columns: Array, p: Array, y: Array) -> Array:
        found = np.empty((y.shape[0] + 5, y.shape[1]))
        _tried(shared, rtol, columns, p, y, found)
        return found

    return tried


def _constants(tape: Tape) -> tuple[Array, int, int]:
    """Constants, the first register that holds one, and how many registers there are."""
    return tape.constants, tape.first_constant, tape.registers


def _tableau() -> tuple[Array, Array, Array]:
    """What stages take of one another, their times, and the weights of the new state and of both errors."""

    def row(taken: dict[int, float]) -> list[float]:
        return [taken.get(j, 0.0) for j in range(STAGES)]

    weights = (dop853.B, dop853.E5, dop853.E3)
    return np.array([row(r) for r in dop853.A]), np.array(dop853.C), np.array([row(r) for r in weights])
