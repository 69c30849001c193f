"""Claim: every example does what its head says, to the accuracy that was asked for.

Each scenario is checked and run as the command line would do it, without pictures; its result is compared with a run
on twice the nodes at rtol 1e-11, its work is accounted for, and V falls wherever the thrust stays. Each script is run,
and holds its own assertions.
"""

from __future__ import annotations

import runpy
from dataclasses import dataclass
from functools import cache
from itertools import pairwise
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pytest

import plastica as pl
from plastica.study.run import Finished, run
from plastica.study.scenario import read_scenario

EXAMPLES = Path(__file__).resolve().parent.parent / "examples"
SCENARIOS = sorted(path.name for path in EXAMPLES.glob("*.toml"))
SCRIPTS = sorted(path.name for path in EXAMPLES.glob("*.py"))
EPS = float(np.finfo(float).eps)


@dataclass(frozen=True)
class Told:
    """What the head of a scenario says: verdict, last natural curvature and last free end (both from a tight run)."""

    headline: str
    natural_curvature: float
    tip_y: float


TOLD = {
    "load_cycles.toml": Told("Takes a permanent set", 2.94942942, 0.0572978066),
    "measured_strip.toml": Told("Stays straight", 0.0, 0.000166853947),
    "nitinol_strip.toml": Told("Takes a permanent set", 12.23767097, 0.0539236452),
    "pmma_strip.toml": Told("Takes a permanent set", 1.00048677, 0.0311025528),
    "pmma_strip_below.toml": Told("Springs back", 0.1, 0.00312483724),
}


@cache
def finished(name: str) -> Finished:
    """Run a scenario once, as `plastica run` does, in a folder that is gone afterwards."""
    with TemporaryDirectory() as folder:
        done = run(EXAMPLES / name, folder)
        assert all(path.is_file() for path in done.files)
        assert {path.name for path in done.files} >= {f"{done.scenario.name}.nc"}
        return done


def solved(name: str) -> pl.Solution:
    return finished(name).solution


@cache
def tight(name: str) -> pl.Solution:
    """The same on twice the nodes, at a thousandth of the tolerance."""
    scenario, sol = finished(name).scenario, solved(name)
    strut = scenario.model.with_grid(sol.grid.with_nodes(2 * sol.grid.nodes))
    return pl.solve(strut, scenario.curvature, scenario.natural_curvature, scenario.until, rtol=1e-11)


def at(sol: pl.Solution, variable: str, t: float) -> float:
    """Value of a variable at a time in s, linear between steps."""
    return float(np.interp(t, sol.dataset.t.values, sol.dataset[variable].values))


def check_work_accounted_for(sol: pl.Solution) -> None:
    """Work of the loads = stored + dissipated, to 100 rtol of the largest energy."""
    assert abs(sol.ledger.residual) <= 100.0 * sol.rtol * sol.ledger.largest_energy


def check_liapunov_falls(sol: pl.Solution) -> None:
    """V never rises, by more than the time tolerance, wherever the thrust stays as it is."""
    thrust, end = sol.model.loads.thrust, sol.history.end
    knots = [knot.t for knot in thrust.knots(end) if knot.t < end]
    t, v = sol.dataset.t.values / sol.model.scales.time, sol.dataset.liapunov.values
    slack = sol.rtol * float(np.abs(v).max())
    constant = 0
    for a, b in pairwise([0.0, *knots, end]):
        if isinstance(thrust.on(a, b), float):
            constant += 1
            inside = v[(t > a * (1.0 + 4.0 * EPS)) & (t < b * (1.0 - 4.0 * EPS))]
            assert inside.size > 5
            assert np.diff(inside).max() <= slack
    assert constant >= 1


def check_same(sol: pl.Solution, reference: pl.Solution) -> None:
    """Natural curvature and free end agree throughout to 100 rtol of their largest values (at least 1/L, and L)."""
    t = np.linspace(sol.history.start, sol.history.end, 401)
    for found, due in zip(_followed(sol, t), _followed(reference, t), strict=True):
        size = max(float(np.abs(due).max()), 1.0)
        assert np.abs(found - due).max() <= 100.0 * sol.rtol * size


def _followed(sol: pl.Solution, t: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Natural curvature and free end off the axis, dimensionless, at any times."""
    y, n, w = sol.history(t), sol.grid.size, sol.grid.w
    return y[:, n], np.sin(sol.model.angle(y[:, :n])) @ w


def test_every_scenario_is_told_about() -> None:
    assert list(TOLD) == SCENARIOS


def test_every_example_is_listed() -> None:
    listed = (EXAMPLES / "README.md").read_text(encoding="utf-8")
    for name in (*SCENARIOS, *SCRIPTS):
        assert f"[`{name}`]({name})" in listed


@pytest.mark.parametrize("name", SCENARIOS)
class TestScenario:
    def test_head_tells_what_to_see_and_whence(self, name: str) -> None:
        head = (EXAMPLES / name).read_text(encoding="utf-8").split("\nschema")[0]
        assert all(line.startswith("#") for line in head.splitlines() if line)
        assert "# What happens." in head
        assert "# What you should see." in head
        assert "# Where the numbers come from" in head or "# Numbers and sources: see pmma_strip.toml." in head

    def test_is_right_as_written(self, name: str) -> None:
        scenario = read_scenario(EXAMPLES / name)
        assert scenario.model.specimen is not None
        assert not scenario.failed
        assert scenario.title

    def test_ends_as_told(self, name: str) -> None:
        sol, told = solved(name), TOLD[name]
        assert sol.status.ok
        assert sol.status.code == "done"
        assert sol.outcome.headline == told.headline
        last = sol.dataset.isel(t=-1)
        length = sol.model.scales.length
        assert float(last.natural_curvature) == pytest.approx(told.natural_curvature, rel=0.0, abs=1e-6 / length)
        assert float(last.tip_y) == pytest.approx(told.tip_y, rel=0.0, abs=1e-6 * length)

    def test_is_as_accurate_as_asked_for(self, name: str) -> None:
        check_same(solved(name), tight(name))

    def test_work_is_accounted_for(self, name: str) -> None:
        check_work_accounted_for(solved(name))
        check_work_accounted_for(tight(name))

    def test_liapunov_function_falls(self, name: str) -> None:
        check_liapunov_falls(solved(name))


class TestPmma:
    HELD = 86_410.0

    def test_takes_a_set_of_28_mm(self) -> None:
        sol = solved("pmma_strip.toml")
        assert sol.outcome.set_deflection == pytest.approx(0.02798, abs=5e-6)
        assert sol.outcome.resting
        assert at(sol, "tip_y", self.HELD) == pytest.approx(0.189, abs=5e-4)

    def test_the_set_grows_while_held_and_stays(self) -> None:
        sol = solved("pmma_strip.toml")
        natural = sol.dataset.natural_curvature.values
        assert np.diff(natural).min() >= -sol.rtol * natural.max()
        after = natural[sol.dataset.t.values > self.HELD + 600.0]
        assert after.size > 20
        assert np.all(after == after[0])

    def test_strain_is_what_the_head_says(self) -> None:
        sol = solved("pmma_strip.toml")
        assert 0.5 * 1.5e-3 * np.abs(sol.dataset.curvature.values).max() == pytest.approx(0.0076, abs=1e-4)

    def test_below_the_threshold_no_bit_moves(self) -> None:
        sol = solved("pmma_strip_below.toml")
        assert np.all(sol.history.y[:, sol.grid.size] == sol.history.y[0, sol.grid.size])
        assert np.all(sol.dataset.natural_curvature.values == sol.dataset.natural_curvature.values[0])
        assert at(sol, "tip_y", self.HELD) == pytest.approx(0.140, abs=5e-4)
        used = float(np.abs(sol.dataset.drive.values / sol.dataset.threshold.values).max())
        assert used == pytest.approx(0.934, abs=1e-3)

    def test_below_the_threshold_it_recovers_fully(self) -> None:
        sol = solved("pmma_strip_below.toml")
        tip = sol.dataset.tip_y.values
        assert abs(tip[-1] - tip[0]) <= 100.0 * sol.rtol * sol.model.scales.length


class TestNitinol:
    def test_goes_from_one_preferred_shape_to_the_other_and_stays(self) -> None:
        sol = solved("nitinol_strip.toml")
        fraction = sol.dataset.volume_fraction.values
        assert fraction[0] == 0.0
        assert at(sol, "volume_fraction", 3700.0) == pytest.approx(1.0736, abs=1e-4)
        assert fraction[-1] == pytest.approx(1.0198, abs=1e-4)
        assert at(sol, "volume_fraction", 5400.0) == pytest.approx(fraction[-1], abs=1e-3)
        assert sol.outcome.released
        assert 0.0 < sol.outcome.excess < 0.03 * float(sol.dataset.threshold[-1])

    def test_the_change_takes_eight_minutes(self) -> None:
        sol = solved("nitinol_strip.toml")
        t, fraction = sol.dataset.t.values, sol.dataset.volume_fraction.values
        begun, done = (float(t[np.argmax(fraction > share)]) for share in (0.1, 0.9))
        assert 25 * 60 < begun < 35 * 60
        assert 7 * 60 < done - begun < 9 * 60

    def test_half_way_it_would_go_on_by_itself(self) -> None:
        """Past the barrier the preference alone drives the natural curvature on: the shapes are truly preferred."""
        laws = solved("nitinol_strip.toml").model.laws
        half = 0.8 * 1.2
        assert -laws.preference.slope(half) > laws.threshold.value(half)


class TestCycles:
    def test_every_increment_is_smaller_than_the_one_before(self) -> None:
        sol = solved("load_cycles.toml")
        sets = np.array([at(sol, "natural_curvature", 14_400.0 * cycle) for cycle in range(13)]) - 0.5
        assert np.all(np.diff(sets) > 0.0)
        assert np.all(np.diff(sets, n=2) < 0.0)
        np.testing.assert_allclose(sets[[1, 2, 12]], [1.36, 1.92, 2.45], rtol=0.0, atol=0.005)

    def test_it_ends_within_4_percent_of_its_limit(self) -> None:
        """The limit of cycles without end is that of the largest thrust, held: then the drive is at its threshold."""
        sol = solved("load_cycles.toml")
        held = pl.solve(sol.model.with_load(pl.Load(thrust="2.3 N")), start=sol, until=1e9)
        limit = float(held.dataset.natural_curvature[-1]) - 0.5
        assert limit == pytest.approx(2.54, abs=0.005)
        assert 0.0 < held.outcome.excess < 1e-5 * float(held.dataset.threshold[-1])
        assert 0.96 < (float(sol.dataset.natural_curvature[-1]) - 0.5) / limit < 1.0


class TestMeasured:
    def test_it_comes_back_straight(self) -> None:
        sol = solved("measured_strip.toml")
        assert float(sol.dataset.tip_y[0]) == pytest.approx(0.125, abs=5e-4)
        assert abs(float(sol.dataset.tip_y[-1])) < 0.0002
        assert "26 rows (x, y)" in sol.initial


@pytest.mark.parametrize("name", SCRIPTS)
def test_script_holds_what_it_asserts(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    names = runpy.run_path(str(EXAMPLES / name), run_name="__main__")
    assert "You should see" in names["__doc__"]
    assert capsys.readouterr().out
