"""Claim: many struts at once are the struts that `solve` computes one by one, whoever is computed beside them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest
import xarray
from hypothesis import given, settings
from hypothesis import strategies as st

import plastica as pl
from plastica.material.anywhere import function_of
from plastica.material.expression import parse
from plastica.motion.courses import courses_of
from plastica.numerics.arrays import Arrays, arrays_on
from plastica.physics.batch import Forces, Struts
from tests.support import EPS, struts

Array = np.ndarray

LAWS = {"preference": "k*m**2/2", "flow": "c*pos(x)**2", "threshold": "h*(1 + q*m**2)"}
MATERIAL = pl.Material(**LAWS, parameters={"k": 1.0, "c": 1.0, "h": 0.1, "q": 0.2})
STRUT = pl.Strut(MATERIAL, pl.Load(thrust=2.0), pl.Grid(nodes=12))
SHAPE = "0.6 + cos(3*s)"
READ = ("natural_curvature", "drive", "threshold", "tip_x", "tip_y", "tip_angle", "liapunov")


def singly(strut: pl.Strut, shape: Any, natural: float, **options: Any) -> xarray.Dataset:
    return pl.solve(strut, shape, natural, **options).dataset


def error_beside_solve(found: xarray.Dataset, i: int, alone: xarray.Dataset) -> float:
    """Largest difference of member i to a solution of its own, relative to the largest value of each variable."""
    mine = found.isel(member=i)
    worst = 0.0
    for name in READ:
        theirs = alone[name].values if "t" in mine[name].dims else alone[name].values[-1]
        worst = max(worst, float(np.abs(mine[name].values - theirs).max() / max(np.abs(theirs).max(), 0.1)))
    return worst


def same(a: xarray.Dataset, b: xarray.Dataset) -> bool:
    """Whether two datasets hold the same bits."""
    assert set(a.data_vars) == set(b.data_vars)
    return all(
        np.array_equal(a[name].values, b[name].values, equal_nan=a[name].dtype.kind == "f") for name in a.data_vars
    )


def drawn(count: int, seed: int = 3) -> tuple[Array, dict[str, Array], Array, Array]:
    """Thrusts, parameters, natural curvatures and shapes of random members."""
    rng = np.random.default_rng(seed)
    own = {"k": rng.uniform(0.2, 2.0, count), "c": rng.uniform(0.2, 5.0, count), "h": rng.uniform(0.02, 0.4, count)}
    return rng.uniform(0.0, 8.0, count), own, rng.uniform(-0.5, 0.5, count), rng.uniform(-1.5, 1.5, count)


def check_agreement_with_solve() -> None:
    """Thrusts, parameters, natural curvatures and shapes of their own: to ten times the tolerance, at every time."""
    thrust, own, natural, a = drawn(40)
    times = [0.0, 0.3, 2.0, 20.0]
    for rtol, some in ((1e-6, range(0, 40, 4)), (1e-9, range(0, 40, 8))):
        found = pl.solve_many(
            STRUT, "0.6 + a*cos(3*s)", natural, thrust, own, rtol=rtol, times=times, shape_parameters={"a": a}
        )
        assert set(found.status.values) == {"done"}
        assert set(found.method.values) == {"DOP853"}
        for i in some:
            material = MATERIAL.with_parameters(**{name: float(values[i]) for name, values in own.items()})
            strut = pl.Strut(material, pl.Load(thrust=float(thrust[i])), STRUT.grid)
            alone = singly(strut, f"0.6 + ({float(a[i])!r})*cos(3*s)", natural[i], until=20.0, times=times, rtol=1e-11)
            assert error_beside_solve(found, i, alone) <= 10.0 * rtol


PROGRAMS: tuple[Any, ...] = (
    pl.programs.ramp_hold_release(3.0, 1.0, 2.0, 0.0),
    "2*(1 + sin(t)/2)*step(t - 0.7)",
    pl.programs.cycles(0.0, 4.0, 1.5, 3, shape="square"),
    pl.programs.cycles(0.0, 4.0, 2.5, shape="sine"),
    1.5,
    pl.programs.table([0.0, 1.0, 1.0, 4.0], [3.0, 3.0, 1.5, 2.0]),
)


def check_programs(programs: tuple[Any, ...] = PROGRAMS, weight: Any = "0.5*(1 + cos(t))") -> None:
    """Each member has its thrust in time and lands on its own jumps; the other loads act on all of them."""
    load = pl.Load(
        transverse=pl.programs.ramp_hold_release(0.3, 2.0, 2.0, 1.0),
        couple=0.1,
        weight=weight,
        weight_angle=0.3,
    )
    strut = STRUT.with_load(load)
    factor = np.array([1.0, 1.2, 0.9, 1.0, 1.5, 0.0])[: len(programs)]
    times = [0.7, 3.3, 8.0]
    found = pl.solve_many(strut, SHAPE, 0.1, programs, thrust_factor=factor, times=times)
    for i, (program, gain) in enumerate(zip(programs, factor, strict=True)):
        thrust = pl.Load(thrust=program).thrust.multiplied(gain) if gain else pl.programs.constant(0.0)
        alone = singly(strut.with_load(replace(load, thrust=thrust)), SHAPE, 0.1, until=8.0, times=times, rtol=1e-11)
        assert error_beside_solve(found, i, alone) <= 1e-7, i


def check_legs() -> None:
    """A member lands on every jump and corner of its loads and on the times asked for, each leg a straight line."""
    thrusts = (pl.programs.cycles(0.0, 4.0, 1.0, 3, shape="square"), pl.programs.ramp_hold_release(2.0, 1.0, 1.0, 0.5))
    strut = STRUT.with_load(pl.Load(transverse=pl.programs.table([0.0, 0.7, 0.7], [0.1, 0.1, 0.2])))
    times = np.array([0.6, 1.0, 3.5])
    found = courses_of(strut, thrusts, 3.5, times)
    legs = found.legs
    first, second = (legs.end[legs.first[i] : legs.first[i + 1]] for i in range(2))
    assert first.tolist() == pytest.approx([0.5, 0.6, 0.7, 1.0, 1.5, 2.0, 2.5, 3.5], rel=4 * EPS)
    assert second.tolist() == pytest.approx([0.6, 0.7, 1.0, 2.0, 2.5, 3.5], rel=4 * EPS)
    assert legs.report.tolist() == [-1, 0, -1, 1, -1, -1, -1, 2, 0, -1, 1, -1, -1, 2]
    assert legs.fresh[:8].tolist() == [True, True, False, True, True, True, True, True]
    middle = 0.5 * (found.begin + legs.end)
    for k, program in ((0, None), (1, strut.load.transverse)):
        value = found.value[k] + found.slope[k] * (middle - found.begin)
        exact = [float((program or thrusts[i])(t)) for i, t in zip(found.which, middle, strict=True)]
        assert np.abs(value - exact).max() <= 10 * EPS * 4.0


KINDS = (("sine", 1.5), ("triangle", 2.5), ("sine", 4.0), ("triangle", 4.0))


def check_corners(kinds: tuple[tuple[str, float], ...] = KINDS) -> None:
    """Yielding that starts and stops again and again costs no accuracy, though the rate has a corner each time."""
    thrust = [pl.programs.cycles(0.0, 4.0, period, shape=shape) for shape, period in kinds]
    found = pl.solve_many(STRUT, SHAPE, 0.1, thrust, until=12.0)
    for i, each in enumerate(thrust):
        alone = singly(STRUT.with_load(pl.Load(thrust=each)), SHAPE, 0.1, until=12.0, rtol=1e-11)
        assert error_beside_solve(found, i, alone) <= 1e-7


def check_sampled_loads() -> None:
    """A finely sampled table is followed without landing on each of its rows."""
    t = np.linspace(0.0, 4.0, 3001)
    table = pl.programs.table(t, 2.0 + np.sin(t))
    found = pl.solve_many(STRUT, SHAPE, thrust=table, until=4.0)
    alone = singly(STRUT.with_load(pl.Load(thrust=table)), SHAPE, 0.0, until=4.0, rtol=1e-11)
    assert error_beside_solve(found, 0, alone) <= 1e-7
    assert int(found.steps[0]) < 1000


def check_units() -> None:
    """With a specimen all is in SI, parameters as numbers or text; variables have the units of a solution."""
    specimen = pl.Specimen(length="0.25 m", bending_stiffness="0.035 N*m**2", retardation_time="120 s")
    k, laws = [0.03, 0.05, 0.02], {"preference": "k*m**2/2", "flow": "c*pos(x)**2", "threshold": "h"}
    material = pl.Material(**laws, parameters={"k": "0.03 N*m**2", "c": "5 1/(N**2*m**5*s)", "h": "0.004 N*m**2"})
    strut = pl.Strut(material, pl.Load(thrust="1 N"), pl.Grid(12), specimen)
    asked = {"thrust": [0.5, 1.0, 2.0], "until": "1 h", "times": [60.0, 600.0, 3600.0]}
    found = pl.solve_many(strut, "4 + 3*cos(9*s)", "0.1 1/m", parameters={"k": np.array(k)}, **asked)
    texts = {"k": [f"{1e3 * value} mN*m**2" for value in k]}
    text = pl.solve_many(strut, "4 + 3*cos(9*s)", "100 1/km", parameters=texts, **asked)
    assert np.abs(text.drive - found.drive).max() <= 1e-12 * np.abs(found.drive).max()
    for i in range(3):
        model = pl.Strut(
            material.with_parameters(k=f"{k[i]} N*m**2"), pl.Load(thrust=asked["thrust"][i]), pl.Grid(12), specimen
        )
        alone = singly(model, "4 + 3*cos(9*s)", "0.1 1/m", until="1 h", times=asked["times"], rtol=1e-11)
        for name in READ:
            mine, theirs = found[name].values[i], alone[name].values
            assert np.abs(mine - theirs).max() <= 1e-7 * max(np.abs(theirs).max(), 1e-3 * np.abs(found[name]).max())
            if name != "liapunov":
                assert found[name].attrs == alone[name].attrs


# -- whoever is computed beside ------------------------------------------------------------------------------------

POISON = {"k": 1.0, "c": 1.0, "h": 0.1, "q": 4.0}
POISONED = pl.Strut(
    pl.Material("k*m**2/2", "c*pos(x)**2", "h*sqrt(q + m**2)/2", POISON), pl.Load(thrust=2.0), pl.Grid(nodes=12)
)


@cache
def healthy(count: int = 90) -> tuple[Array, dict[str, Array], xarray.Dataset]:
    thrust, own, _, _ = drawn(count, 11)
    own |= {"q": np.full(count, 4.0)}
    return thrust, own, pl.solve_many(POISONED, SHAPE, 0.1, thrust, own, until=5.0)


def check_neighbours() -> None:
    """Members without numbers, stiff ones and inadmissible ones leave every bit of the others as it was."""
    thrust, own, before = healthy()
    spoiled = {name: values.copy() for name, values in own.items()}
    nan, stiff, inadmissible = [3, 40, 41], [17, 64], [5, 80]
    spoiled["q"][nan] = -9.0
    spoiled["c"][stiff] = 1e13
    spoiled["h"][inadmissible] = -0.3
    after = pl.solve_many(POISONED, SHAPE, 0.1, thrust, spoiled, until=5.0)
    others = np.setdiff1d(np.arange(thrust.size), [*nan, *stiff, *inadmissible])
    assert same(before.isel(member=others), after.isel(member=others))
    assert set(after.status.values[nan]) == {"not_finite"}
    assert set(after.method.values[[*nan, 64]]) == {"LSODA"}
    assert set(after.status.values[stiff + inadmissible]) == {"done"}
    for i in (64, 5):
        material = POISONED.material.with_parameters(**{name: float(each[i]) for name, each in spoiled.items()})
        strut = pl.Strut(material, pl.Load(thrust=float(thrust[i])), POISONED.grid)
        assert error_beside_solve(after, i, singly(strut, SHAPE, 0.1, until=5.0, rtol=1e-10)) <= 1e-7


def check_order_and_number() -> None:
    """No bit depends on the order of the members, on how many are asked for at once, or on the chunks."""
    thrust, own, base = healthy()
    for some, chunk in (([41], 8192), (list(range(60, 67)), 3), (list(range(89, -1, -1)), 8192), (list(range(90)), 13)):
        found = pl.solve_many(
            POISONED, SHAPE, 0.1, thrust[some], {k: v[some] for k, v in own.items()}, until=5.0, chunk=chunk
        )
        assert same(found.drop_vars("member"), base.isel(member=some).drop_vars("member"))


def test_processes() -> None:
    """Two worker processes give the same bits as none."""
    thrust, own, base = healthy()
    assert same(pl.solve_many(POISONED, SHAPE, 0.1, thrust, own, until=5.0, workers=2), base)


# -- the equations -------------------------------------------------------------------------------------------------


def loads_of(strut: pl.Strut, t: float) -> dict[str, float]:
    return {name: program(t) for name, program in strut.loads.items()}


def check_rate(strut: pl.Strut, t: float, seed: int) -> None:
    """The rate of a block is that of the model, under every load, with parameters that are numbers or arrays."""
    strut = strut.with_load(pl.Load(0.7 + seed % 3, transverse=0.3, couple=-0.2, weight=0.4, weight_angle=0.5))
    rng = np.random.default_rng(seed)
    n, width = strut.grid.size, 16
    y = rng.uniform(-1.5, 1.5, (n + 1, width))
    forces = Forces(("thrust", "transverse", "couple", "weight"))
    loads = np.array([[loads_of(strut, t)[kind]] * width for kind in forces.kinds])
    names = tuple(strut.material.parameters)[:2]
    own = np.array([[strut.material.values[name]] * width for name in names])
    exact = [strut.rate(t, y[:n, i], y[n, i]) for i in range(width)]
    expected = np.vstack([np.array([each[0] for each in exact]).T, np.array([np.ravel(each[1])[0] for each in exact])])
    for varying in ((), names):
        system = Struts(strut, varying, forces)
        p = np.vstack([loads, own[: len(varying)]])
        found = system.rate(Arrays(), width)(np.full(width, t), y, p, np.empty((n + 1, width)))
        assert np.abs(found - expected).max() <= 100 * EPS * max(1.0, np.abs(expected).max())
    alone = strut.with_load(pl.Load(thrust=loads[0, 0]))
    system = Struts(alone, (), Forces())
    found = system.rate(Arrays(), width)(np.full(width, t), y, loads[:1], np.empty((n + 1, width)))
    expected = np.array([alone.rate(t, y[:n, i], y[n, i])[0] for i in range(width)]).T
    assert np.abs(found[:n] - expected).max() <= 100 * EPS * max(1.0, np.abs(expected).max())


@given(strut=struts(), t=st.floats(0.0, 5.0), seed=st.integers(0, 1000))
@settings(deadline=None, max_examples=15, derandomize=True)
def test_rate(strut: pl.Strut, t: float, seed: int) -> None:
    check_rate(strut, t, seed)


def check_laws_anywhere() -> None:
    """Every function of the grammar, on NumPy and on strict arrays, with parameters as arrays; nan goes through."""
    import array_api_strict

    x = np.array([-2.0, -0.5, 0.0, 0.7, 3.0, np.nan])
    p = np.linspace(1.0, 2.0, 6)
    texts = ["pos(p*x)", "abs(x - p)", "exp(-p*x)", "log(1 + p*x**2)", "sin(x)*cos(p*x)", "tan(x/4)", "tanh(p*x)"]
    texts += ["sinh(x) + cosh(p*x)", "sqrt(x**2 + p)", "atan(p*x)", "x**3/(p + x**2)", "(p + x**2)**1.7", "p*pi"]
    for text in texts:
        expression = parse(text, variable="x", parameters=("p",), where="law")
        for tree in (expression.tree, expression.derivative().tree):
            law = replace(expression, tree=tree)
            each = [float(law.vector({"p": float(b)})(np.array([a]))[0]) for a, b in zip(x, p, strict=True)]
            found = np.broadcast_to(function_of(tree, "x", {}, ("p",), np)(x, p), x.shape)
            given_as = [array_api_strict.asarray(values) for values in (x, p)]
            strict = function_of(tree, "x", {}, ("p",), array_api_strict)(*given_as)
            assert np.allclose(found, each, rtol=10 * EPS, atol=10 * EPS, equal_nan=True), text
            strict = np.broadcast_to(np.from_dlpack(strict) if hasattr(strict, "shape") else strict, x.shape)
            assert np.allclose(strict, each, rtol=10 * EPS, atol=10 * EPS, equal_nan=True), text


def check_strict_library() -> None:
    """On arrays that know nothing but the array API standard: the same states, as far as rounding lets them be."""
    thrust, own, natural, _ = drawn(8)
    asked = {"until": 3.0, "times": [1.0, 3.0], "thrust_factor": 1.5}
    ours = pl.solve_many(STRUT, SHAPE, natural, thrust, own, **asked)
    theirs = pl.solve_many(STRUT, SHAPE, natural, thrust, own, **asked, library="array_api_strict")
    assert np.abs(ours.steps - theirs.steps).max() <= 5
    for name in READ:
        # Rounding may turn an accepted step into a rejected one, and then the errors are others.
        assert np.abs(ours[name] - theirs[name]).max() <= 1e-8
    xp = arrays_on("array_api_strict", None).xp
    given_as = pl.solve_many(STRUT, SHAPE, xp.asarray(natural), xp.asarray(thrust), own, **asked)
    assert same(given_as, theirs)
    loads = pl.Load(thrust=PROGRAMS[0], transverse="0.1*sin(t)", couple=0.1)
    ours, theirs = (
        pl.solve_many(STRUT.with_load(loads), SHAPE, thrust=PROGRAMS[:3], until=2.0, library=library)
        for library in ("numpy", "array_api_strict")
    )
    assert np.abs(ours.drive - theirs.drive).max() <= 1e-8


# -- what is told ----------------------------------------------------------------------------------------------------


def check_nodes_chosen() -> None:
    """With open nodes each member gets enough, and only members that need them get many."""
    thrust = np.array([0.5, 2.0, 9.0])
    found = pl.solve_many(STRUT.with_grid(pl.Grid("auto")), "0.4 + 0.1*cos(2*s)", thrust=thrust, until=10.0, rtol=1e-6)
    nodes = found.nodes.values
    assert nodes[0] < nodes[2]
    for i, each in enumerate(thrust):
        alone = singly(
            pl.Strut(MATERIAL, pl.Load(thrust=each), pl.Grid(48)), "0.4 + 0.1*cos(2*s)", 0.0, until=10.0, rtol=1e-11
        )
        assert error_beside_solve(found, i, alone) <= 1e-5


def check_frozen() -> None:
    """A member that never yields keeps its natural curvature to the last bit."""
    found = pl.solve_many(STRUT, 0.01, [0.3, -0.3, 0.0], thrust=1.0, parameters={"h": 5.0}, until=30.0)
    assert found.natural_curvature.values.tolist() == [0.3, -0.3, 0.0]


def check_rest() -> None:
    """A member that has come to rest is not stepped on with, and is where a long run would leave it."""
    thrust = np.array([0.0, 1.0, 2.0, 3.0, 6.0])
    found = pl.solve_many(STRUT, SHAPE, 0.3, thrust, {"h": 50.0}, until=3000.0, times=[5.0, 200.0, 3000.0])
    assert set(found.method.values) == {"DOP853"}
    assert found.steps.max() <= 150
    for i, each in enumerate(thrust):
        strut = pl.Strut(MATERIAL.with_parameters(h=50.0), pl.Load(thrust=each), STRUT.grid)
        alone = singly(strut, SHAPE, 0.3, until=3000.0, times=[5.0, 200.0, 3000.0], rtol=1e-11)
        assert error_beside_solve(found, i, alone) <= 1e-8
    many = np.random.default_rng(4).uniform(0.0, 10.0, 60)
    for rtol in (1e-6, 1e-8, 1e-10, 1e-12):
        every = pl.solve_many(STRUT, SHAPE, 0.3, many, {"h": 50.0}, until=3000.0, rtol=rtol)
        assert every.steps.max() <= 150


def check_unrest(rtol: float = 1e-6) -> None:
    """What is small because it has died away is not taken for rest where it grows, under a later load."""
    late = pl.programs.table([0.0, 40.0, 40.0, 1040.0], [0.0, 0.0, 5.0, 5.0])
    strut = pl.Strut(MATERIAL, pl.Load(), pl.Grid(16))
    found = pl.solve_many(strut, "0.05*cos(s)", thrust=[late], until=240.0, rtol=rtol)
    assert abs(float(found.tip_angle[0])) > 2.9


def check_law_of_parameters_alone() -> None:
    """A flow that does not depend on the drive moves no member by what its neighbour's is."""
    strut = pl.Strut(pl.Material("k*m**2/2", "c", "h", {"k": 1.0, "c": 1.0, "h": 0.1}), pl.Load(), pl.Grid(12))
    found = pl.solve_many(strut, 1.0, 0.2, 2.0, {"c": [1.0, 3.0]}, until=2.0)
    assert found.natural_curvature.values.tolist() == [0.2, 0.2]


def check_mirror() -> None:
    """Members that are mirror images of each other stay so, bit for bit."""
    thrust, own, natural, _ = drawn(20)
    found = pl.solve_many(STRUT, SHAPE, natural, thrust, own, until=5.0)
    other = pl.solve_many(STRUT, f"-({SHAPE})", -natural, thrust, own, until=5.0)
    for name in ("natural_curvature", "drive", "tip_y", "tip_angle"):
        assert np.array_equal(found[name], -other[name])


CHECKS: dict[str, Callable[[], None]] = {
    name.removeprefix("check_"): value
    for name, value in sorted(globals().items())
    if name.startswith("check_") and name != "check_rate"
}


@pytest.mark.parametrize("name", CHECKS)
def test_many(name: str) -> None:
    CHECKS[name]()


def check_memory() -> None:
    """What a further chunk of members needs is their results, not their motions."""
    import tracemalloc

    def peak(count: int) -> int:
        tracemalloc.start()
        pl.solve_many(STRUT, SHAPE, thrust=np.linspace(0.0, 3.0, count), until=0.2, chunk=256)
        size = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
        return size

    peak(256)
    few, many = peak(512), peak(4608)
    assert (many - few) / 4096 <= 500.0


def test_memory() -> None:
    check_memory()
