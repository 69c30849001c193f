"""Claim: of many trajectories at once each is as accurate as asked, lands where it must, and disturbs no other."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest

from plastica.numerics import dop853
from plastica.numerics.arrays import Arrays, arrays_of, arrays_on
from plastica.numerics.stepper import COARSE, DONE, NOT_FINITE, STIFF, Ends, Legs, Members, Options, advance
from tests.support import EPS

Array = np.ndarray


@dataclass(frozen=True)
class Scalar:
    """y' = f(t, y, p) for each column, with two rows so that errors are norms."""

    f: Callable[..., Any]
    autonomous: bool = False
    rows: int = 2
    switching: int | None = None

    def rate(self, arrays: Arrays, width: int) -> Callable[..., Any]:
        def rate(t: Any, y: Any, p: Any, out: Any) -> Any:
            found = self.f(arrays.xp, t, y, p)
            if out is None:
                return found
            out[...] = found
            return out

        return rate


DECAY = Scalar(lambda xp, t, y, p: -p[0, ...] * y, autonomous=True)
FORCED = Scalar(lambda xp, t, y, p: p[0, ...] * xp.cos(t) + 0.0 * y)


def legs(end: float, times: tuple[float, ...] = (), fresh: bool = False) -> Legs:
    """One course: through the times, each reported, to the end."""
    ends = np.array([*times, end])
    report = np.array([*range(len(times)), -1])
    return Legs(np.array([0, ends.size]), ends, np.full(ends.size, np.inf), np.full(ends.size, fresh), report)


def run(
    system: Scalar,
    p: Array,
    course: Legs,
    *,
    y0: Array | float = 1.0,
    rtol: float = 1e-9,
    width: int = 64,
    arrays: Arrays | None = None,
    watch: Any = None,
    most_steps: int = 2000,
) -> Ends:
    count = p.shape[-1]
    p = np.atleast_2d(p)
    members = Members(
        np.broadcast_to(np.asarray(y0, dtype=float), (2, count)).copy(),
        np.full(count, 1e-3 * rtol),
        np.zeros(count, dtype=np.intp),
        course,
        lambda ids, legs: p[:, ids],
    )
    return advance(system, members, Options(rtol, most_steps, width), arrays or Arrays(), watch=watch)


def check_coefficients() -> None:
    """Row sums are the times of the stages; weights integrate polynomials of degree 7, on which errors vanish."""
    c = np.array(dop853.C)
    for stage, row in zip(c, dop853.A, strict=True):
        assert abs(sum(row.values()) - stage) <= 20 * EPS * max(1.0, sum(abs(a) for a in row.values()))
    size = sum(map(abs, dop853.B.values()))
    for k in range(8):
        assert abs(sum(b * c[j] ** k for j, b in dop853.B.items()) - 1.0 / (k + 1)) <= 10 * EPS * size
        for estimate, order in ((dop853.E5, 5), (dop853.E3, 3)):
            error = sum(e * c[j] ** k for j, e in estimate.items())
            scale = sum(map(abs, estimate.values()))
            assert (abs(error) <= 20 * EPS * scale) == (k < order)


def check_order() -> None:
    """With steps of fixed size the error of y' = y cos(t) falls with the eighth power."""
    system = Scalar(lambda xp, t, y, p: y * xp.cos(t))
    steps = np.array([4, 6, 9])
    errors = []
    for count in steps:
        ends = np.linspace(0.0, 3.0, count + 1)[1:]
        course = Legs(np.array([0, count]), ends, np.full(count, np.inf), np.zeros(count, bool), np.full(count, -1))
        found = run(system, np.ones(1), course, rtol=1e2)
        assert found.steps[0] <= count + 3
        errors.append(abs(found.y[0, 0] - np.exp(np.sin(3.0))))
    order = -np.polyfit(np.log(steps), np.log(errors), 1)[0]
    assert 7.0 <= order <= 10.0
    assert errors[-1] <= 1e-7


def check_accuracy() -> None:
    """Members that decay at quite different rates are all exact to the tolerance, each at a pace of its own."""
    rates = np.geomspace(1e-3, 30.0, 100)
    for rtol in (1e-5, 1e-8, 1e-11):
        ends = run(DECAY, rates, legs(3.0), rtol=rtol)
        assert np.all(ends.code == DONE)
        assert np.all(ends.t == 3.0)
        exact = np.exp(-3.0 * rates)
        assert np.all(np.abs(ends.y - exact) <= 20.0 * rtol * np.maximum(exact, 1e-3))
    assert ends.steps[-1] > 3 * ends.steps[0]


def check_landing() -> None:
    """States at the times asked for are those of the solution, however close they lie."""
    times = (0.5, 0.5000001, 1.25, 7.0)
    p = np.linspace(0.1, 3.0, 40)
    ends = run(FORCED, p, legs(8.0, times), y0=0.0)
    for k, t in enumerate(times):
        assert np.abs(ends.reports[k] - p * np.sin(t)).max() <= 1e-7
    assert np.abs(ends.y - p * np.sin(8.0)).max() <= 1e-7


def check_jumps() -> None:
    """A rate that jumps between two legs costs no accuracy: a step that straddled the jump would."""
    ends = np.array([1.0, 3.0])
    course = Legs(np.array([0, 2]), ends, np.full(2, np.inf), np.array([True, True]), np.array([-1, -1]))
    rates = np.array([[1.0, -5.0]])
    count = 20
    factor = np.linspace(0.5, 2.0, count)
    members = Members(
        np.zeros((2, count)),
        np.full(count, 1e-12),
        np.zeros(count, dtype=np.intp),
        course,
        lambda ids, legs: rates[:, legs] * factor[ids],
    )
    steady = Scalar(lambda xp, t, y, p: p[0, ...] + 0.0 * y, autonomous=True)
    found = advance(steady, members, Options(1e-9), Arrays())
    exact = factor * (1.0 - 5.0 * 2.0)
    assert np.abs(found.y - exact).max() <= 100 * EPS * np.abs(exact).max()
    assert found.steps.max() <= 30


def check_each_has_its_end() -> None:
    """What blows up, what is stiff and what has no numbers end by themselves; the others do not notice."""
    system = Scalar(lambda xp, t, y, p: p[0, ...] * y + p[1, ...] * y**2 + p[2, ...] * xp.sqrt(y), autonomous=True)
    sound = np.tile(np.array([[-1.0], [0.0], [0.0]]), 90) * np.linspace(0.5, 1.5, 90)
    spoiled = sound.copy()
    spoiled[:, 7] = 0.0, 1.0, 0.0
    spoiled[:, 40] = -1e7, 0.0, 0.0
    spoiled[:, 71] = 0.0, 0.0, np.nan
    before, after = run(system, sound, legs(5.0)), run(system, spoiled, legs(5.0))
    assert after.code[[7, 40, 71]].tolist() == [STIFF, STIFF, NOT_FINITE]
    assert 0.99 <= after.t[7] <= 1.01
    others = np.setdiff1d(np.arange(90), [7, 40, 71])
    assert np.all(before.code == DONE)
    assert np.all(after.code[others] == DONE)
    assert np.array_equal(before.y[:, others], after.y[:, others])
    assert np.array_equal(before.steps[others], after.steps[others])


def check_independence() -> None:
    """No bit depends on the width of the block, on the order of the members, or on how many there are."""
    rng = np.random.default_rng(5)
    p = rng.uniform(0.1, 8.0, 150)
    system = Scalar(lambda xp, t, y, p: xp.sin(p[0, ...] * y + t))
    base = run(system, p, legs(4.0, (1.0, 2.0)))
    for width in (16, 32, 160):
        again = run(system, p, legs(4.0, (1.0, 2.0)), width=width)
        assert np.array_equal(again.y, base.y)
        assert np.array_equal(again.reports, base.reports)
        assert np.array_equal(again.steps, base.steps)
    order = rng.permutation(150)
    assert np.array_equal(run(system, p[order], legs(4.0)).y, run(system, p, legs(4.0)).y[:, order])
    assert np.array_equal(run(system, p[3:4], legs(4.0, (1.0, 2.0))).y, base.y[:, 3:4])


def check_watch() -> None:
    """What the watch tells is given up after its first step, a whole number of tens of them, or at its end."""
    p = np.linspace(0.1, 8.0, 50)
    asked: list[int] = []

    def watch(ids: Array, y: Array) -> Array:
        asked.extend(ids.tolist())
        return (ids % 7 == 3) & (y[0] < 0.5)

    ends = run(DECAY, p, legs(6.0), watch=watch, rtol=1e-12)
    given_up = ends.code == COARSE
    low = np.exp(-6.0 * p) < 0.5
    assert np.array_equal(given_up, (np.arange(50) % 7 == 3) & low)
    early = given_up & (ends.t < 6.0)
    assert early.any()
    assert np.all((ends.steps[early] % 10 == 0) | (ends.steps[early] == 1))
    assert set(asked) == set(range(50))


class Immutable:
    """An array that cannot be written, as those of JAX: `at[...]` with `set` makes a new one."""

    def __init__(self, values: Array) -> None:
        self.values = values

    class _At:
        def __init__(self, whole: Array, index: Any = None) -> None:
            self.whole, self.index = whole, index

        def __getitem__(self, index: Any) -> Immutable._At:
            return Immutable._At(self.whole, index)

        def set(self, values: Array) -> Immutable:
            made = self.whole.copy()
            made[self.index] = values
            return Immutable(made)

    @property
    def at(self) -> Immutable._At:
        return Immutable._At(self.values)


def check_updates() -> None:
    """The one helper writes in place where it can, and leaves an array that cannot be written as it was."""
    arrays, target = Arrays(), np.zeros((3, 4))
    assert arrays.put(target, 1, np.ones(4)) is target
    assert target[1].tolist() == [1.0] * 4
    other = Arrays(xp=object(), name="jax")
    kept = Immutable(np.zeros((3, 4)))
    made = other.put(kept, 1, np.ones(4))
    assert not kept.values.any()
    assert made.values.sum() == 4.0
    strict = arrays_on("array_api_strict", None)
    for each, whole in ((arrays, np.zeros((3, 4))), (strict, strict.of(np.zeros((3, 4))))):
        made = each.host(each.put_columns(whole, np.array([0, 2]), np.array([1.0, 2.0])))
        assert made.tolist() == [[1.0, 0.0, 2.0, 0.0]] * 3


def check_strict_arrays() -> None:
    """The same run on arrays that know nothing but the standard."""
    strict = arrays_on("array_api_strict", None)
    p = np.linspace(0.1, 3.0, 20)
    system = Scalar(lambda xp, t, y, p: xp.sin(p[0, ...] * y + t))
    ours, theirs = (run(system, p, legs(4.0, (1.0,)), arrays=each) for each in (Arrays(), strict))
    assert np.array_equal(ours.steps, theirs.steps)
    assert np.abs(ours.y - theirs.y).max() <= 1000 * EPS
    assert np.abs(ours.reports - theirs.reports).max() <= 1000 * EPS


CHECKS = {
    name.removeprefix("check_"): value for name, value in sorted(globals().items()) if name.startswith("check_")
}


@pytest.mark.parametrize("name", CHECKS)
def test_stepper(name: str) -> None:
    CHECKS[name]()


def test_libraries_by_name_and_by_array() -> None:
    import array_api_strict

    assert arrays_of(np.ones(3), 1.0, None).name == "numpy"
    assert arrays_of(array_api_strict.asarray([1.0])).name == "array_api_strict"
    assert arrays_on(None, None, array_api_strict.asarray([1.0])).name == "array_api_strict"
    with pytest.raises(ValueError, match="`library` must be one of numpy, numba, cupy, torch, jax"):
        arrays_on("tables", None)


def test_a_library_that_is_not_there_is_refused() -> None:
    with pytest.raises(ValueError, match="`library` must be installed to be used"):
        arrays_on("cupy", None)
