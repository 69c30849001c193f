"""Claim: every example does what its head says, to the accuracy that was asked for.

Each scenario is checked and run as the command line would do it, without pictures; its result is compared with a run
on twice the nodes at a smaller rtol, its work is accounted for, and V falls wherever the loads stay. Each script is
run, and holds its own assertions.
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
    """What the head of a scenario says: verdict, last natural curvature and last free end (both from a tight run).

    Of several segments it is the natural curvature next to the clamp.
    """

    headline: str
    natural_curvature: float
    tip_y: float


TOLD = {
    "load_cycles.toml": Told("Takes a permanent set", 2.94942942, 0.0572978066),
    "measured_strip.toml": Told("Stays straight", 0.0, 0.00016610176),
    "nitinol_strip.toml": Told("Takes a permanent set", 12.23767097, 0.0539236452),
    "pmma_strip.toml": Told("Takes a permanent set", 1.00048677, 0.0311025528),
    "pmma_strip_below.toml": Told("Springs back", 0.1, 0.00312483724),
    "pmma_strip_sagging.toml": Told("Takes a permanent set", 0.78195253, 0.0848469281),
    "steel_strip_struck.toml": Told("Takes a permanent set", 4.61782714, 0.1225195397),
    "sweep_pmma_strip.toml": Told("Takes a permanent set", 0.22592013, 0.007058127588),
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
    """The same on twice the nodes, at a thousandth of the tolerance; with inertia, where it takes minutes, a tenth."""
    scenario, sol = finished(name).scenario, solved(name)
    rod = scenario.model.with_grid(sol.grid.with_nodes(2 * sol.grid.nodes))
    rtol = (0.1 if rod.has_inertia else 1e-3) * sol.rtol
    return pl.solve(rod, scenario.curvature, scenario.natural_curvature, scenario.until, rtol=rtol)


def at(sol: pl.Solution, variable: str, t: float) -> float:
    """Value of a variable at a time in s, linear between steps."""
    return float(np.interp(t, sol.dataset.t.values, sol.dataset[variable].values))


def check_work_accounted_for(sol: pl.Solution) -> None:
    """Work of the loads = stored + dissipated, to 100 rtol of the largest energy."""
    assert abs(sol.ledger.residual) <= 100.0 * sol.rtol * sol.ledger.largest_energy


def check_liapunov_falls(sol: pl.Solution) -> None:
    """V never rises, by more than the time tolerance, wherever the loads stay as they are."""
    loads, end = sol.model.loads, sol.history.end
    knots = [knot.t for knot in loads.knots(end) if knot.t < end]
    t, v = sol.dataset.t.values / sol.model.scales.time, sol.dataset.liapunov.values
    slack = sol.rtol * float(np.abs(v).max())
    constant = 0
    for a, b in pairwise([0.0, *knots, end]):
        if all(isinstance(program.on(a, b), float) for _, program in loads.items()):
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
    y, layout = sol.history(t), sol.model.layout
    return layout.natural(y), np.sin(sol.model.angle(layout.mu(y))) @ sol.grid.w


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
        clamped = float(np.atleast_1d(last.natural_curvature)[0])
        assert clamped == pytest.approx(told.natural_curvature, rel=0.0, abs=1e-6 / length)
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


class TestSagging:
    def test_it_sags_for_a_month(self) -> None:
        sol = solved("pmma_strip_sagging.toml")
        hour, month = 3600.0, 30 * 86_400.0
        assert float(sol.dataset.tip_y[0]) == pytest.approx(0.109, abs=5e-4)
        assert at(sol, "tip_y", hour) == pytest.approx(-0.181, abs=5e-4)
        assert at(sol, "tip_y", hour) - at(sol, "tip_y", month) == pytest.approx(0.025, abs=5e-4)
        assert sol.outcome.set_deflection == pytest.approx(-0.0244, abs=1e-4)

    def test_the_bend_is_undone_from_the_clamp_outward(self) -> None:
        sol = solved("pmma_strip_sagging.toml")
        last = sol.dataset.natural_curvature.values[-1]
        np.testing.assert_allclose(last[:2], [0.78, 1.51], rtol=0.0, atol=0.005)
        assert 1.99 < last[2] < 2.0
        assert last[3:].tolist() == [2.0, 0.0, 0.0]
        onsets = [event for event in sol.events if event.kind == "onset"]
        assert [event.sentence[:9] for event in onsets] == ["segment 1", "segment 2", "segment 3"]
        assert 6.0 < onsets[2].t / 86_400.0 < 7.0

    def test_strain_is_what_the_head_says(self) -> None:
        sol = solved("pmma_strip_sagging.toml")
        assert 0.5 * 1.5e-3 * np.abs(sol.dataset.curvature.values).max() == pytest.approx(0.0018, abs=5e-5)

    def test_shorter_segments_change_a_millimetre(self) -> None:
        scenario, sol = finished("pmma_strip_sagging.toml").scenario, solved("pmma_strip_sagging.toml")
        ends = (*(0.0125 / 0.6 * k for k in range(9)), 1.0)
        finer = pl.Strut(sol.model.material, sol.model.load, pl.Grid(), sol.model.specimen, natural_segments=ends)
        other = pl.solve(finer, scenario.curvature, (*[2.0] * 8, 0.0), scenario.until)
        assert float(sol.dataset.tip_y[-1] - other.dataset.tip_y[-1]) == pytest.approx(0.001, abs=5e-4)


class TestStruck:
    def test_takes_a_set_of_49_mm_at_the_clamp(self) -> None:
        sol = solved("steel_strip_struck.toml")
        assert sol.outcome.set_deflection == pytest.approx(0.0487, abs=5e-4)
        last = sol.dataset.natural_curvature.values[-1]
        assert last[0] == pytest.approx(4.62, abs=0.005)
        assert last[3] == pytest.approx(0.02, abs=0.005)
        assert np.abs(np.delete(last, [0, 2, 3])).max() < 1e-3

    def test_how_it_is_thrown(self) -> None:
        sol = solved("steel_strip_struck.toml")
        tip = sol.dataset.tip_y.values
        assert (tip.max(), tip.min()) == pytest.approx((0.125, -0.034), abs=5e-4)
        at_the_clamp = [event for event in sol.events if event.sentence.startswith("segment 1 ")]
        assert any(event.kind == "onset" and 0.012 < event.t < 0.0135 for event in at_the_clamp)
        assert at_the_clamp[-1].t < 0.2

    def test_where_the_work_goes(self) -> None:
        ledger = solved("steel_strip_struck.toml").ledger
        found = (ledger.work, ledger.natural_dissipation, ledger.viscous_dissipation)
        assert found == pytest.approx((0.68, 0.29, 0.27), abs=0.005)
        assert ledger.stored_energy + ledger.kinetic_energy == pytest.approx(0.12, abs=0.005)
        assert ledger.kinetic_energy < 0.01 * ledger.stored_energy

    def test_one_segment_does_not_yield(self) -> None:
        model = solved("steel_strip_struck.toml").model
        one = pl.Rod(model.material, model.load, pl.Grid(nodes=12), model.specimen)
        sol = pl.solve(one, until="250 ms", rtol=1e-6)
        assert not [event for event in sol.events if event.kind == "onset"]
        assert np.abs(sol.dataset.natural_curvature.values).max() <= EPS

    def test_more_segments_change_the_set_by_little(self) -> None:
        model = solved("steel_strip_struck.toml").model
        for count, due in ((16, 0.048), (32, 0.045)):
            finer = pl.Rod(model.material, model.load, pl.Grid(nodes=3), model.specimen, natural_segments=count)
            assert pl.solve(finer, until="250 ms", rtol=1e-6).outcome.set_deflection == pytest.approx(due, abs=5e-4)

    def test_the_slowest_oscillation_takes_108_ms_and_loses_what_the_head_says(self) -> None:
        specimen = solved("steel_strip_struck.toml").model.specimen
        assert specimen is not None
        omega = 3.516 / (specimen.T * np.sqrt(specimen.translational_inertia))
        assert 2.0 * np.pi / omega == pytest.approx(0.108, abs=5e-4)
        assert 0.5 * omega * specimen.T == pytest.approx(0.0025, abs=5e-5)


class TestMeasured:
    def test_it_comes_back_straight(self) -> None:
        sol = solved("measured_strip.toml")
        assert float(sol.dataset.tip_y[0]) == pytest.approx(0.1246, abs=5e-4)
        assert abs(float(sol.dataset.tip_y[-1])) < 0.0002
        assert "26 rows (x, y)" in sol.initial


@pytest.mark.parametrize("name", SCRIPTS)
def test_script_holds_what_it_asserts(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    names = runpy.run_path(str(EXAMPLES / name), run_name="__main__")
    assert "You should see" in names["__doc__"]
    assert capsys.readouterr().out
