"""Claim: motions agree with the high-precision reference, for smooth and rough data, at every thrust and flow.

The reference is of the equation, made by two independent methods; it is good to about 20 digits.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import plastica as pl
from tests.support import SHAPES, label, reference, reference_error, solution_of, strut_of

CASES = [pytest.param(case, id=label(case)) for case in reference()]


def check_motion(case: dict[str, Any], rtol: float, ceiling: float, **options: Any) -> None:
    sol = solution_of(case, rtol=rtol, **options)
    assert sol.status.code == "done"
    assert reference_error(sol, case) <= ceiling


@pytest.mark.parametrize("case", CASES)
@pytest.mark.paper("1.3", "3.13–3.16")
def test_tight(case: dict[str, Any]) -> None:
    check_motion(case, 1e-11, 1e-9)


@pytest.mark.parametrize("case", CASES)
def test_default(case: dict[str, Any]) -> None:
    check_motion(case, 1e-8, 1e-6)


@pytest.mark.parametrize("case", CASES)
def test_nodes_chosen_automatically(case: dict[str, Any]) -> None:
    check_motion(case, 1e-8, 1e-6, nodes="auto")


@pytest.mark.parametrize("method", ["DOP853", "Radau", "BDF", "Gauss"])
@pytest.mark.parametrize("case", [CASES[0], CASES[11], CASES[18]])
def test_every_method(case: dict[str, Any], method: str) -> None:
    check_motion(case, 1e-8, 1e-6, method=method)


@pytest.mark.parametrize("case", [case for case in reference() if case["phase_switches"]], ids=label)
def test_switches(case: dict[str, Any]) -> None:
    """Times at which yielding starts and stops, to the time tolerance."""
    rtol = 1e-11
    sol = solution_of(case, rtol=rtol)
    found = [event for event in sol.events if event.kind in ("onset", "arrest") and event.t > 0.0]
    assert len(found) == len(case["phase_switches"])
    for event, row in zip(found, case["phase_switches"], strict=True):
        assert event.kind == ("arrest" if row["to"] == 0 else "onset")
        assert event.direction == (row["from"] or row["to"])
        assert abs(event.t - float(row["t"])) <= 1e-8 * float(row["t"])


def check_long(case: dict[str, Any]) -> None:
    sol = solution_of(case, until=1e6)
    last = next(row for row in case["long_time_double"] if float(row["t"]) == 1e6)
    n = sol.grid.size
    natural = float(sol.history.y[-1, n])
    assert abs(natural - float(last["mu0"])) <= 1e-6 * abs(float(last["mu0"]))
    assert abs(float(sol.at(0.0, 1e6)) - float(last["a_mu_at_s0"])) <= 1e-6 * max(1.0, abs(float(last["a_mu_at_s0"])))


@pytest.mark.parametrize("case", [CASES[2], CASES[13], CASES[18]])
def test_a_million_retardation_times(case: dict[str, Any]) -> None:
    check_long(case)


def test_error_follows_the_tolerance() -> None:
    """Order in time: the error is proportional to rtol (fitted power between 0.7 and 1.3), with a ceiling."""
    case = reference()[3]
    rtols = np.array([1e-5, 1e-7, 1e-9, 1e-11])
    errors = np.array([reference_error(solution_of(case, rtol=float(r)), case) for r in rtols])
    slope = np.polyfit(np.log(rtols), np.log(errors), 1)[0]
    assert 0.7 <= slope <= 1.3
    assert np.all(errors <= 100.0 * rtols)


def test_nodes_converge_geometrically() -> None:
    """Order in space: every node more gains a factor between 2 and 6 at gamma = 8; 20 nodes are good to 2e-9."""
    case = reference()[1]
    nodes = np.array([6, 8, 10, 12, 14])
    errors = np.array([reference_error(solution_of(case, nodes=int(n), rtol=1e-12), case) for n in nodes])
    gain = 10.0 ** -np.polyfit(nodes, np.log10(errors), 1)[0]
    assert 2.0 <= gain <= 6.0
    assert reference_error(solution_of(case, nodes=20, rtol=1e-12), case) <= 2e-9


def test_a_jump_inside_an_element_costs_all_but_first_order() -> None:
    """Without an element end at the jump the error falls like 1/n: which is why `solve` adds one."""
    case = next(case for case in reference() if case["initial"] == "step" and case["gamma"] == "3")
    exact = float(case["values"][1]["mu0"])
    nodes = np.array([8, 16, 32, 64])
    errors = []
    for n in nodes:
        strut = strut_of(case, int(n))
        mu = np.where(strut.grid.s < 0.5, 2.0, -1.0)
        sol = pl.solve(strut, mu, 0.0, until=10.0)
        errors.append(abs(float(sol.history.y[-1, n]) - exact) / abs(exact))
    order = -np.polyfit(np.log(nodes), np.log(errors), 1)[0]
    assert 0.7 <= order <= 2.3
    assert errors[0] > 1e-4
    whole = pl.solve(strut_of(case, 16), SHAPES["step"], 0.0, until=10.0)
    assert abs(float(whole.history.y[-1, whole.grid.size]) - exact) <= 1e-7 * abs(exact)
    assert "0.5" in whole.notes[0]
