"""Claim 7: every run ends at one equilibrium, told beforehand: which, how fast, and when it cannot be told yet."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import plastica as pl
from plastica.errors import ArgumentError
from tests.support import EPS, label, materials, pair, reference, shapes, solution_of

CASES = [pytest.param(case, id=label(case)) for case in reference()]
PATIENT = 3.0


@cache
def run(index: int) -> pl.Solution:
    return solution_of(reference()[index], rtol=1e-10, until=200.0)


def check_end(limit: pl.Limit, case: dict[str, Any]) -> None:
    exact = case["limit"]
    interior = "interior" in exact["kind"]
    assert limit.kind == ("interior" if interior else "limiting")
    assert limit.stable
    # The interior limit depends on when yielding stopped: it is as good as the run. The other is not a matter of time.
    tolerance = 1e-9 if interior else 1e-12
    assert abs(limit.equilibrium.alpha - float(exact["a_inf"])) <= tolerance
    assert abs(limit.equilibrium.mu_nat - float(exact["mu0_inf"])) <= tolerance
    assert abs(limit.equilibrium.liapunov - float(exact["V_inf"])) <= 1e-9
    if not interior:
        assert abs(limit.rate - float(exact["rate_r"])) <= 1e-9 * limit.rate
        assert limit.exponent == 2.0
        assert abs(limit.coefficient - float(case["c"])) <= 1e-9 * limit.coefficient


@pytest.mark.parametrize("index", range(len(CASES)), ids=[label(case) for case in reference()])
@pytest.mark.paper("Lemma 4.3, 4.14–4.21", "Theorem 4.5, 4.22")
def test_reference_limits(index: int) -> None:
    limit = run(index).limit
    assert limit is not None
    check_end(limit, reference()[index])


def check_never_wrong(index: int) -> None:
    """At any earlier time the prediction is the right one, or undecided."""
    sol, case = run(index), reference()[index]
    n = sol.grid.size
    decided = 0
    for t in (0.0, 0.1, 0.5, 1.0, 2.0, 4.0, 7.0, 12.0, 25.0, 60.0, 100.0):
        y = sol.history([t])[0]
        limit = pl.predict_limit(sol.model, y[:n], float(y[n]))
        if limit.kind == "undecided":
            assert limit.equilibrium is None
            assert "Integrate further" in limit.sentence
        else:
            decided += 1
            check_end(limit, case)
    assert decided >= 1


@pytest.mark.parametrize("index", range(0, len(CASES), 2))
@pytest.mark.paper("Theorem 4.5, 4.22")
def test_never_wrong(index: int) -> None:
    check_never_wrong(index)


@pytest.mark.parametrize("index", [0, 13, 18])
def test_the_tail_of_a_million_retardation_times(index: int) -> None:
    check_tail(index)


def check_tail(index: int) -> None:
    """The law of approach, from t = 200 on, against the reference up to t = 10^6."""
    case, limit = reference()[index], run(index).limit
    assert limit is not None
    for row in case["long_time_double"]:
        t = float(row["t"])
        if 1e5 <= t <= 1e8:
            exact = float(row["x_abs_D_minus_Theta"])
            assert abs(float(limit.tail(t - 200.0)) - exact) <= 2e-2 * exact
            asymptotic = 1.0 / (limit.rate * limit.coefficient * t)
            assert abs(asymptotic - exact) <= 2e-2 * exact


@given(materials(), shapes(), st.floats(0.2, 6.0))
@settings(deadline=None, max_examples=15, derandomize=True)
def test_longer_runs_come_nearer(material: pl.Material, shape: str, gamma: float) -> None:
    """Whatever is predicted, a run ten times as long is nearer to it, and predicts the same."""
    strut = pl.Strut(material, pl.Load(thrust=gamma), pl.Grid(nodes=20))
    sol = pl.solve(strut, shape, 0.0, until=60.0, rtol=1e-9)
    first = sol.limit
    assert first is not None
    if first.kind == "undecided":
        return
    on = pl.solve(sol.model, start=sol, until=600.0, rtol=1e-9)
    second = on.limit
    assert second is not None
    assert second.kind == first.kind
    assert abs(second.equilibrium.alpha - first.equilibrium.alpha) <= 1e-6 * max(1.0, abs(first.equilibrium.alpha))
    assert second.distance <= first.distance + 1e-7


NEVER = pl.Material("m**2/2", "pos(x)**2", "1e6")
FROZEN = [
    (12.3, "7.0", 6.999675043279),
    (9.0, "-10.5 + 1.8*cos(pi*s)", -5.8072628314),
    (20.0, "6*cos(4*s)", 8.9486464556),
]
"""Thrusts and starts that never yield, with natural curvature 0.3, and the clamp curvature where the motion ends: large
steps downhill find another shape from the first two."""


def check_no_shape_is_taken_for_another(thrust: float, start: str, alpha: float) -> None:
    """Beside several static shapes one is named only where the state is held by it; and by t = 3 it is."""
    strut = pl.Strut(NEVER, pl.Load(thrust=thrust), pl.Grid(24))
    sol = pl.solve(strut, start, 0.3, until=60.0, rtol=1e-10)
    end = float(strut.curvature_between([0.0], sol.history.y[-1:, :24], [0.0])[0, 0])
    assert abs(end - alpha) <= 1e-5 * abs(alpha)
    for t in (0.0, 0.05, 0.1, 0.2, 0.3, 0.5, 1.0, 3.0):
        limit = pl.predict_limit(strut, sol.history([t])[0][:24], 0.3)
        assert limit.equilibrium is not None or t < 3.0
        if limit.equilibrium is None:
            assert "not yet near enough" in limit.sentence
        else:
            assert limit.kind == "interior"
            assert limit.stable
            assert abs(limit.equilibrium.alpha - alpha) <= 1e-5 * abs(alpha)


@pytest.mark.parametrize("start", FROZEN)
def test_no_shape_is_taken_for_another(start: tuple[float, str, float]) -> None:
    check_no_shape_is_taken_for_another(*start)


@pytest.mark.paper("Proposition 3.3 (2), 3.74, 3.75")
def test_interior_approach_is_exponential_at_the_gap() -> None:
    sol = pl.solve(pl.Strut(pair("A"), pl.Load(thrust=1.0), pl.Grid(nodes=16)), 0.1, 0.02, until=40.0, rtol=1e-11)
    limit = sol.limit
    assert limit is not None
    assert limit.kind == "interior"
    n, t = sol.grid.size, np.array([8.0, 16.0])
    states = sol.history(t)
    away = [pl.predict_limit(sol.model, y[:n], float(y[n])).distance for y in states]
    measured = np.log(away[0] / away[1]) / 8.0
    assert abs(measured - limit.rate) <= 1e-3 * limit.rate


def test_saddles_are_told() -> None:
    """The straight rod above Euler's load is an equilibrium within the threshold, but not one to rest on."""
    limit = pl.predict_limit(pl.Strut(pair("A"), pl.Load(thrust=3.0), pl.Grid(16)), np.zeros(16), 0.0)
    assert limit.kind == "interior"
    assert limit.stable is False
    assert "unstable" in limit.sentence
    assert limit.distance == 0.0


def test_near_a_fold_nothing_is_claimed() -> None:
    """gamma = 5: at the fold of the curve of equilibria the natural curvature does not tell the shape."""
    gamma, alpha = 5.0, 2.4367180832686527591
    strut = pl.Strut(pl.Material("m**2/2", "pos(x)**2", "5"), pl.Load(thrust=gamma), pl.Grid(32))
    shape = pl.equilibrium(strut.material, gamma=gamma, alpha=alpha)
    limit = pl.predict_limit(strut, shape.curvature(strut.grid.s), shape.mu_nat)
    assert limit.kind == "undecided"
    assert "fold" in limit.sentence


def test_the_theory_is_not_stretched() -> None:
    varying = pl.Strut(pair("A"), pl.Load(thrust="2 + sin(t)"), pl.Grid(16))
    assert pl.solve(varying, 0.1, until=5.0).limit is None
    across = pl.Strut(pair("A"), pl.Load(thrust=1.0, transverse=0.1), pl.Grid(16))
    assert pl.solve(across, 0.1, until=5.0).limit is None
    with pytest.raises(ArgumentError, match="constant thrust alone"):
        pl.predict_limit(across, np.zeros(16), 0.0)
    released = pl.Load(thrust=pl.programs.ramp_hold_release(3.0, 1.0, 30.0, 1.0))
    sol = pl.solve(pl.Strut(pair("A"), released, pl.Grid(16)), 0.1, until=300.0)
    assert sol.limit is not None
    assert sol.limit.kind == "limiting"


def test_time_one_map_is_the_motion() -> None:
    sol = run(3)
    n = sol.grid.size
    mu, mu_nat = sol.history([0.0])[0][:n], float(sol.history([0.0])[0][n])
    for t in (1.0, 2.0):
        mu, mu_nat = pl.time_one_map(sol.model, mu, mu_nat)
        exact = sol.history([t])[0]
        assert np.abs(mu - exact[:n]).max() <= 1e-8
        assert abs(mu_nat - exact[n]) <= 1e-8


def test_omega_limit_waits_as_long_as_it_must() -> None:
    """Case 13 creeps through a bottleneck (errata F)."""
    case = reference()[13]
    strut = pl.Strut(pair("B"), pl.Load(thrust=1.0), pl.Grid(nodes=24))
    limit = pl.omega_limit(strut, "2 - 3*step(s - 0.5)", 0.0, rtol=1e-9)
    check_end(limit, case)


def test_the_verdict_names_the_limit() -> None:
    sol = run(3)
    assert sol.limit is not None
    assert sol.limit.sentence in sol.outcome.distance
    assert f"{sol.limit.equilibrium.alpha:.8g}" in str(sol)


def test_a_run_until_rest_tells_where_it_ends() -> None:
    strut = pl.Strut(pair("A"), pl.Load(thrust=3.0), pl.Grid(16))
    creeping = pl.solve(strut, "1 + cos(3*s)", until="equilibrium")
    assert creeping.limit is not None
    assert creeping.limit.sentence in creeping.status.sentence
    assert creeping.limit.distance <= 1e-3
    still = pl.solve(strut, 0.0, until="equilibrium")
    assert "unstable" in still.status.sentence


def test_in_si_the_same() -> None:
    specimen = pl.Specimen(length="250 mm", bending_stiffness="0.035 N*m**2", retardation_time="120 s")
    material = pl.catalogue.material("one-shape", length=specimen.L, stiffness=specimen.EI, time=specimen.T)
    si = pl.Strut(material, pl.Load(thrust=3.0 * specimen.scales.force), pl.Grid(16), specimen)
    plain = pl.Strut(pl.catalogue.material("one-shape"), pl.Load(thrust=3.0), pl.Grid(16))
    one = pl.solve(si, "0.2/0.25", until=100 * specimen.T).limit
    other = pl.solve(plain, 0.2, until=100.0).limit
    assert one is not None
    assert other is not None
    assert abs(one.equilibrium.alpha - other.equilibrium.alpha) <= 1e-10
    assert abs(one.distance - other.distance) <= 1e-6


def check_a_start_not_yet_forgotten(gamma: float, natural: float, amplitude: float, name: str, c: float) -> None:
    """A start whose natural curvature says one side and whose shape carries it to the other."""
    strut = pl.Strut(pair(name, c), pl.Load(thrust=gamma), pl.Grid(nodes=20))
    sol = pl.solve(strut, f"{amplitude}*cos(2*s)", natural, until=300.0, rtol=1e-9)
    n, end = sol.grid.size, sol.limit
    assert end is not None
    assert end.kind == "limiting"
    for t in (0.0, 0.2, 0.5, 1.0, 2.0, 8.0, 30.0):
        y = sol.history([t])[0]
        limit = pl.predict_limit(sol.model, y[:n], float(y[n]))
        if limit.kind != "undecided":
            assert abs(limit.equilibrium.alpha - end.equilibrium.alpha) <= 1e-5


STARTS = [(2.665, 0.162, -1.377, "A", 0.112), (2.0, 0.05, -1.2, "B", 1.0)]


@pytest.mark.parametrize("start", STARTS)
def test_a_start_not_yet_forgotten(start: tuple[float, float, float, str, float]) -> None:
    check_a_start_not_yet_forgotten(*start)


@cache
def faint(until: float) -> pl.Solution:
    """A motion whose excess falls like t^-2: below what rtol can tell at 10^3, and to rounding at 10^7."""
    material = pl.Material("m**2/2", "20*pos(x)**1.5", "0.1")
    return pl.solve(pl.Strut(material, pl.Load(thrust=2.0), pl.Grid(16)), 0.3, 0.3, until=until)


def check_an_excess_below_the_tolerance(until: float) -> None:
    """Kind, end, rate and events of the limit stay what they were when the excess was still to be seen."""
    sol, early = faint(until), faint(1e3)
    assert early.limit is not None
    assert sol.limit is not None
    assert sol.limit.kind == early.limit.kind == "limiting"
    assert abs(sol.limit.equilibrium.alpha - early.limit.equilibrium.alpha) <= sol.rtol
    assert abs(sol.limit.rate - early.limit.rate) <= 1e-6 * early.limit.rate
    assert [event.kind for event in sol.events] == ["onset", "arrest", "onset", "quarter_turn"]
    assert 0.0 <= sol.limit.excess <= early.limit.excess
    # To rounding: at once the power of a power is the excess again.
    assert np.all(sol.limit.tail([0.0, 1e9]) <= sol.limit.excess * (1.0 + 8.0 * EPS))


@pytest.mark.parametrize("until", [1e5, 1e6, 1e7])
def test_an_excess_below_the_tolerance(until: float) -> None:
    check_an_excess_below_the_tolerance(until)
