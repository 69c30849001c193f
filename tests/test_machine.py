"""Claim: machine code computes what NumPy computes, as exactly, and with the same independence of every member."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import plastica as pl
from plastica.errors import ArgumentError
from plastica.material.expression import parse
from plastica.material.tape import tape_of
from plastica.numerics.arrays import Arrays, arrays_on
from plastica.numerics.block import Block, block_of
from plastica.physics import machine
from plastica.physics.batch import Forces, Struts
from tests import test_many
from tests.support import EPS, struts
from tests.test_many import MATERIAL, PROGRAMS, SHAPE, STRUT, drawn, same

Array = np.ndarray
Patch = pytest.MonkeyPatch

KINDS = ("thrust", "transverse", "couple", "weight")
RTOL = 1e-7


def one_step(system: Struts, y: Array, p: Array, h: float, how: str) -> Block:
    """A block that has tried one step of every column."""
    arrays = arrays_on(how, None)
    made = system.machine(RTOL) if arrays.compiled else None
    width = y.shape[1]
    block = block_of(system, arrays, RTOL, width, p.shape[0], made)
    everybody = np.arange(width)
    block.place(everybody, everybody, y, 0.4, np.full(width, 1e-3 * RTOL))
    block.on_legs(everybody, everybody, np.full(width, 9.0), np.full(width, h), np.zeros(width, dtype=bool), p)
    block.fresh, block._any_fresh = np.zeros(width, dtype=bool), False
    block.h = np.full(width, h)
    return block


def check_step(strut: pl.Strut, seed: int, width: int = 80) -> None:
    """A tried step is that of the block's own arithmetic: states, sums of errors, and what tells of yielding."""
    strut = strut.with_load(pl.Load(0.7, transverse=0.3, couple=-0.2, weight=0.4, weight_angle=0.5))
    rng = np.random.default_rng(seed)
    y, h = rng.uniform(-1.2, 1.2, (strut.grid.size + 1, width)), 0.02
    names = tuple(strut.material.parameters)[:2]
    own = np.array([rng.uniform(0.9, 1.1, width) * strut.material.values[name] for name in names])
    loads = rng.uniform(0.0, 2.0, (4, width))
    lines = np.stack([loads, rng.uniform(-0.2, 0.2, loads.shape)], axis=1).reshape(8, width)
    moving = np.vstack([np.full((1, width), 0.2), np.full((1, width), 9.0), lines])
    for forces, rows in (
        (Forces(), loads[:1]),
        (Forces(KINDS), loads),
        (Forces(KINDS, varying=True), moving),
        (Forces(("thrust", "weight"), varying=True), moving[[0, 1, 2, 3, 8, 9]]),
    ):
        for varying in ((), names):
            system, p = Struts(strut, varying, forces), np.vstack([rows, own[: len(varying)]])
            plain, fast = (one_step(system, y, p, h, how) for how in ("numpy", "numba"))
            with np.errstate(all="ignore"):
                plain._slope(0, plain.t, plain.stack[2])
                (new, sums, ends), (fast_new, fast_sums, fast_ends) = (each._tried(each.h) for each in (plain, fast))
            # Of a column that runs away in its step, as one whose flow is stiff may, only that it does is the same.
            tame = np.abs(plain.stack[[0, 1, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12]]).max(axis=(0, 1)) < 3.0
            assert tame.sum() > width // 4
            assert np.abs(fast_new[:, tame] - new[:, tame]).max() <= 1000 * EPS
            # An error is a difference of slopes: rounding moves it by eps in units of the tolerance.
            assert np.abs(np.sqrt(fast_sums[:, tame]) - np.sqrt(sums[:, tame])).max() <= 3e4 * EPS / (1e-3 * RTOL)
            for mine, theirs in zip(fast_ends, ends, strict=True):
                assert np.array_equal(mine[tame] != 0.0, theirs[tame] != 0.0)


@given(strut=struts(), seed=st.integers(0, 1000))
@settings(deadline=None, max_examples=12, derandomize=True)
def test_step(strut: pl.Strut, seed: int) -> None:
    check_step(strut, seed)


def check_sine() -> None:
    """Sine and cosine to eps, and to what rounding of a large argument costs; odd and even to the last bit."""
    rng = np.random.default_rng(5)
    x = np.concatenate([rng.uniform(-8.0, 8.0, 20_000), 10.0 ** rng.uniform(-12.0, 5.0, 2000), [0.0, np.pi, np.pi / 2]])
    found = np.array([machine.sine_cosine(each) for each in x])
    for k, exact in enumerate((np.sin(x), np.cos(x))):
        assert np.all(np.abs(found[:, k] - exact) <= 1.5 * EPS + EPS * np.abs(x) * (np.abs(x) > 8.0))
    small = np.abs(x) < 0.1
    assert np.all(np.abs(found[small, 0] - np.sin(x[small])) <= 2.0 * EPS * np.abs(x[small]))
    mirrored = np.array([machine.sine_cosine(-each) for each in x])
    assert np.array_equal(mirrored, found * [-1.0, 1.0])


def by_tape(tree: object, x: Array, p: Array) -> Array:
    """A law's values, in the lanes of one tile."""
    tape = tape_of(tree, "x", {"q": 0.3}, ("p",))
    registers = machine._filled((tape.constants, tape.first_constant, tape.registers))
    registers[0, : x.size], registers[1, : x.size] = x, p
    machine._run(tape.operations, registers)
    return registers[tape.result, : x.size].copy()


def check_tapes() -> None:
    """Every function of the grammar and its derivative, on tapes, with parameters of their own; nan goes through."""
    x = np.array([-2.0, -0.5, 0.0, 0.7, 3.0, np.nan])
    p = np.linspace(1.0, 2.0, 6)
    texts = ["pos(p*x)", "abs(x - p)", "exp(-p*x)", "log(p*x)", "sin(x)*cos(p*x)", "tan(x/4)", "tanh(p*x)", "q"]
    texts += ["sinh(x) + cosh(p*x)", "sqrt(x - p)", "atan(p*x)", "x**3/(p + x)", "(q + x)**1.7", "p*pi", "exp(800*x)"]
    for text in texts:
        expression = parse(text, variable="x", parameters=("p", "q"), where="law")
        for tree in (expression.tree, expression.derivative().tree):
            law = replace(expression, tree=tree)
            exact = [float(law.vector({"p": b, "q": 0.3})(np.array([a]))[0]) for a, b in zip(x, p, strict=True)]
            assert np.allclose(by_tape(tree, x, p), exact, rtol=10 * EPS, atol=10 * EPS, equal_nan=True), text


def check_lanes() -> None:
    """No bit of a column depends on how many there are, or on its place among them."""
    rng = np.random.default_rng(2)
    y, p = rng.uniform(-1.0, 1.0, (STRUT.grid.size + 1, 400)), rng.uniform(0.5, 9.0, (1, 400))
    whole = one_step(Struts(STRUT, (), Forces()), y, p, 0.3, "numba")
    new, sums, _ = whole._tried(whole.h)
    for some in (np.arange(16), np.arange(399, -1, -1), np.arange(37, 37 + 144)):
        part = one_step(Struts(STRUT, (), Forces()), y[:, some], p[:, some], 0.3, "numba")
        found = part._tried(part.h)
        assert np.array_equal(found[0], new[:, some])
        assert np.array_equal(found[1], sums[:, some])


CHECKS: dict[str, Callable[[], None]] = {
    name.removeprefix("check_"): value
    for name, value in sorted(globals().items())
    if name.startswith("check_") and name not in ("check_step", "check_straight")
}


@pytest.mark.parametrize("name", CHECKS)
def test_machine(name: str) -> None:
    CHECKS[name]()


# -- whatever is claimed of many struts holds in machine code --------------------------------------------------------

CLAIMS = (
    *("agreement_with_solve", "programs", "units", "neighbours", "order_and_number", "nodes_chosen"),
    *("frozen", "rest", "unrest", "law_of_parameters_alone", "mirror"),
)
STRAIGHT = (PROGRAMS[0], PROGRAMS[2], PROGRAMS[4], PROGRAMS[5])
"""Thrusts that are straight lines on their legs."""


@pytest.fixture
def in_machine_code(monkeypatch: Patch) -> Iterator[None]:
    """Let `solve_many` take machine code; what is remembered of NumPy's results is put aside."""
    monkeypatch.setattr(pl, "solve_many", partial(pl.solve_many, library="numba"))
    test_many.healthy.cache_clear()
    yield
    test_many.healthy.cache_clear()


@pytest.mark.usefixtures("in_machine_code")
@pytest.mark.parametrize("name", CLAIMS)
def test_claims(name: str) -> None:
    test_many.CHECKS[name]()


def check_straight() -> None:
    """Loads that are straight lines on their legs, and yielding that starts and stops under them."""
    test_many.check_programs(STRAIGHT, pl.programs.ramp_hold_release(0.5, 3.0, 1.0, 1.0))
    test_many.check_corners((("triangle", 1.5), ("triangle", 2.5), ("triangle", 4.0)))


@pytest.mark.usefixtures("in_machine_code")
def test_straight() -> None:
    check_straight()


@pytest.mark.usefixtures("in_machine_code")
def test_processes() -> None:
    test_many.test_processes()


def test_loads_that_are_no_straight_lines_are_left_to_numpy() -> None:
    strut = STRUT.with_load(pl.Load(thrust=2.0, transverse="0.1*sin(t)"))
    assert Struts(strut, (), Forces(KINDS, varying=True, curved=(("transverse", ()),))).machine(RTOL) is None
    plain, fast = (
        pl.solve_many(strut, SHAPE, thrust=PROGRAMS[:3], until=2.0, library=library) for library in ("numpy", "numba")
    )
    assert same(plain, fast)


def test_it_is_asked_for() -> None:
    """Machine code is taken where it is asked for, and there only."""
    assert arrays_on("numba", None).compiled
    assert not any(each.compiled for each in (Arrays(), arrays_on("numpy", None), arrays_on(None, None, [1.0])))
    thrust, own, natural, _ = drawn(8)
    plain, fast = (
        pl.solve_many(STRUT, SHAPE, natural, thrust, own, until=3.0, library=library) for library in ("numpy", "numba")
    )
    assert not same(plain, fast)
    assert float(np.abs(plain.drive - fast.drive).max()) <= 1e-7
    assert set(fast.method.values) == {"DOP853"}


def test_where_nothing_can_be_kept(monkeypatch: Patch) -> None:
    """Where the code cannot be written down for the next process, it is compiled all the same."""
    sound = machine.numba.njit

    def no_place(cache: bool = False, **options: object) -> object:
        if cache:
            raise RuntimeError("cannot cache function: no locator available")
        return sound(**options)

    monkeypatch.setattr(machine.numba, "njit", no_place)
    assert machine._compiled(lambda x: 2.0 * x)(1.5) == 3.0


def test_without_a_compiler(monkeypatch: Patch) -> None:
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
    with pytest.raises(ArgumentError, match=r"must be installed to be used.*plastica\[fast\]"):
        pl.solve_many(pl.Strut(MATERIAL, pl.Load(), pl.Grid(8)), until=1.0, library="numba")
