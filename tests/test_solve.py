"""Claim: `solve` does what its words say: initial data, times, rest, continuation, events, units, honest failure."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import plastica as pl
from plastica.errors import ArgumentError, PlasticaError
from tests.support import EPS, pair

STRUT = pl.Strut(pair("A"), pl.Load(thrust=3.0), pl.Grid(nodes=16))
SPECIMEN = pl.Specimen(length="250 mm", bending_stiffness="0.035 N*m**2", retardation_time="120 s")


def si_twin() -> pl.Strut:
    """STRUT for a specimen in SI: the same dimensionless problem."""
    L, EI, T = 0.25, 0.035, 120.0
    parameters = {
        "k": f"{EI!r} N*m**2",
        "c": f"{1.0 / (L * T * EI**2)!r} 1/(N**2*m**5*s)",
        "h": f"{0.1 * EI!r} N*m**2",
    }
    material = pl.Material("k*m**2/2", "c*pos(x)**2", "h", parameters)
    return pl.Strut(material, pl.Load(thrust=3.0 * EI / L**2), pl.Grid(nodes=16), SPECIMEN)


def test_si_and_dimensionless_runs_are_the_same_motion() -> None:
    plain = pl.solve(STRUT, "0.4 + s", 0.1, until=50.0, times=[0.0, 1.0, 50.0])
    si = pl.solve(si_twin(), "(0.4 + s/0.25)/0.25", 0.4, until="6000 s", times=[0.0, 120.0, 6000.0])
    scales = SPECIMEN.scales
    for name, scale in {
        "curvature": scales.curvature,
        "couple": scales.couple,
        "shear": scales.force,
        "tip_y": scales.length,
        "drive": scales.drive,
        "work": scales.energy,
        "liapunov": scales.energy,
    }.items():
        expected = plain.dataset[name].values * scale
        size = np.abs(expected).max()
        assert np.abs(si.dataset[name].values - expected).max() <= 1e-6 * size
    assert si.dataset.couple.attrs["units"] == "N*m"
    assert plain.dataset.couple.attrs["units"] == "1"
    assert si.ledger.unit == "J"


def test_ways_to_say_the_same_curvature() -> None:
    s = STRUT.grid.s
    ways = ["1 + s**2", lambda x: 1.0 + x**2, 1.0 + s**2, list(1.0 + s**2), pl.Shape(lambda x: 1.0 + x**2)]
    first, *others = [pl.solve(STRUT, way, until=2.0) for way in ways]
    for other in others:
        assert np.abs(other.history.y[-1] - first.history.y[-1]).max() <= 1e-12
    pieces = pl.piecewise([0.25, 0.5], ["1 + s**2"] * 3)
    split = pl.solve(STRUT, pieces, until=2.0)
    assert split.grid.breaks == (0.0, 0.25, 0.5, 1.0)
    assert abs(split.at(0.6, 2.0) - first.at(0.6, 2.0)) <= 1e-7


def test_times_are_the_times_asked_for() -> None:
    times = [0.0, 0.3, 7.0, 20.0]
    sol = pl.solve(STRUT, 0.2, until=20.0, times=times)
    assert sol.dataset.t.values.tolist() == times
    free = pl.solve(STRUT, 0.2, until=20.0)
    assert abs(float(sol.dataset.tip_y[-1]) - float(free.dataset.tip_y[-1])) <= 1e-12
    assert np.all(np.diff(free.dataset.t) > 0.0)
    assert float(free.dataset.t[-1]) == 20.0


def test_at_broadcasts_and_meets_the_nodes() -> None:
    sol = pl.solve(STRUT, 0.2, until=20.0)
    table = sol.at(sol.grid.s, sol.t[:, None])
    assert table.shape == (sol.t.size, 16)
    assert np.abs(table - sol.dataset.curvature.values).max() <= 64.0 * EPS * np.abs(table).max()
    assert isinstance(sol.at(0.5, 1.0), float)
    with pytest.raises(ArgumentError, match="must lie"):
        sol.at(1.1, 1.0)
    with pytest.raises(ArgumentError, match="must lie"):
        sol.at(0.5, 21.0)


def test_rest_is_told_from_creep() -> None:
    frozen = pl.solve(pl.Strut(pair("A"), pl.Load(thrust=1.0)), 0.05, until="equilibrium")
    assert frozen.status.code == "equilibrium"
    assert frozen.outcome.resting
    creeping = pl.solve(STRUT, "1 + cos(3*s)", until="equilibrium")
    assert creeping.status.code == "creeping"
    assert creeping.status.ok
    assert "pointless" in creeping.status.sentence
    assert creeping.outcome.excess > 0.0
    still = pl.solve(STRUT, 0.0, until="equilibrium")
    assert still.status.code == "equilibrium"
    assert still.dataset.sizes["t"] == 1


def test_rest_waits_for_the_loads() -> None:
    load = pl.Load(thrust=pl.programs.ramp_hold_release(3.0, 1.0, 400.0, 0.0))
    sol = pl.solve(pl.Strut(pair("A"), load), 0.2, until="equilibrium")
    assert sol.history.end > 401.0
    assert sol.outcome.released
    with pytest.raises(ArgumentError, match="`until` can be"):
        pl.solve(pl.Strut(pair("A"), pl.Load(thrust="2 + sin(t)")), 0.2, until="equilibrium")


def test_a_run_goes_on_under_another_load() -> None:
    """Hold, then release: in two runs or in one with a jump, the same."""
    held = pl.solve(STRUT, 0.2, until=30.0)
    released = pl.solve(STRUT.with_load(pl.Load()), start=held, until=80.0)
    jump = pl.programs.table([0.0, 30.0, 30.0], [3.0, 3.0, 0.0])
    whole = pl.solve(STRUT.with_load(pl.Load(thrust=jump)), 0.2, until=80.0)
    assert released.history.start == 30.0
    assert np.array_equal(released.history.y[0, :17], held.history.y[-1, :17])
    # The scales of the default atol differ: bits may, too.
    assert np.abs(released.history.y[-1, :17] - whole.history.y[-1, :17]).max() <= 100.0 * whole.rtol
    assert released.outcome.headline == "Takes a permanent set"
    assert [event.t for event in whole.events if event.kind == "jump"] == [30.0]


def test_the_integrator_lands_on_every_jump() -> None:
    load = pl.Load(thrust=pl.programs.cycles(0.0, 4.0, 2.0, 10, shape="square"))
    sol = pl.solve(pl.Strut(pair("A"), load), 0.3, until=25.0)
    jumps = [knot.t for knot in load.knots(25.0)]
    assert len(jumps) == 19
    assert set(jumps) <= set(sol.dataset.t.values)
    before, after = sol.history.t[sol.history.accepted], sol.dataset.thrust.values
    assert np.all(np.isin(after, [0.0, 4.0]))
    assert before.size == after.size


def test_a_short_pulse_late_is_not_stepped_over() -> None:
    quiet = pair("A")
    pulse = pl.programs.table([0.0, 5000.0, 5000.1, 5000.2], [0.0, 0.0, 60.0, 0.0])
    sol = pl.solve(pl.Strut(quiet, pl.Load(thrust=pulse)), 1e-3, 0.0, until=1e4)
    assert float(np.abs(sol.dataset.work).max()) > 0.0
    assert 5000.1 in sol.dataset.t.values


def test_a_finely_sampled_table_is_passed_without_a_stop_at_every_row() -> None:
    t = np.linspace(0.0, 20.0, 2001)
    table = pl.solve(pl.Strut(pair("A"), pl.Load(thrust=(t, 2.0 + np.sin(t)))), 0.3, until=20.0)
    text = pl.solve(pl.Strut(pair("A"), pl.Load(thrust="2 + sin(t)")), 0.3, until=20.0)
    assert table.counts.restarts < 50
    # Linear interpolation of the sine is off by h^2/8 = 1.3e-5 at the most.
    assert abs(float(table.dataset.tip_y[-1]) - float(text.dataset.tip_y[-1])) <= 1e-4


def test_the_tip_passes_a_quarter_turn() -> None:
    sol = pl.solve(STRUT, "1 + cos(3*s)", until=10.0)
    event = next(event for event in sol.events if event.kind == "quarter_turn")
    n = sol.grid.size
    assert abs(float(sol.history([event.t])[0, :n] @ sol.grid.w) - 0.5 * np.pi) <= 1e-10
    assert event.direction == 1


def test_nodes_are_chosen_and_explained() -> None:
    auto = pl.Strut(pair("A"), pl.Load(thrust=8.0), pl.Grid(nodes="auto"))
    easy = pl.solve(auto, 0.1, until=1.0, rtol=1e-4)
    hard = pl.solve(auto, "cos(20*s)", until=1.0, rtol=1e-8)
    assert easy.grid.size < hard.grid.size
    assert f"{hard.grid.size} nodes per element chosen" in hard.notes[-1]
    fine = pl.solve(auto.with_grid(pl.Grid(nodes=64)), "cos(20*s)", until=1.0)
    s = np.linspace(0.0, 1.0, 33)
    assert np.abs(hard.at(s, 1.0) - fine.at(s, 1.0)).max() <= 1e-6
    with pytest.raises(ArgumentError, match="`nodes` must be a number here"):
        _ = auto.grid.s


def test_a_small_start_comes_out_right() -> None:
    """From 1e-6 at gamma = 3 yielding starts at t = 54.33 (errata F)."""
    sol = pl.solve(STRUT, "1e-6*cos(pi*s/2)", until=100.0)
    onset = next(event.t for event in sol.events if event.kind == "onset")
    scaled = pl.solve(STRUT, "1e-6*cos(pi*s/2)", until=100.0, rtol=1e-11)
    tight = next(event.t for event in scaled.events if event.kind == "onset")
    assert abs(onset - tight) <= 1e-5
    assert 50.0 <= tight <= 60.0


def test_failure_keeps_what_was_computed() -> None:
    sol = pl.solve(STRUT, "1 + cos(3*s)", until=100.0, max_steps=50)
    assert not sol.status.ok
    assert sol.status.code == "step_limit"
    assert 0.0 < sol.history.end < 100.0
    assert sol.dataset.sizes["t"] == 51
    switching = pl.solve(pl.Strut(pair("A"), pl.Load(thrust=1.0)), "1.2*cos(2*s) + 0.4", 0.2, until=10.0, max_steps=150)
    assert switching.counts.restarts >= 1
    assert switching.counts.steps == 150
    runaway = pl.Material("-m**4", "c*pos(x)**2", "h", {"c": 100.0, "h": 0.01})
    lost = pl.solve(pl.Strut(runaway, pl.Load(thrust=1.0)), 2.0, 0.5, until=100.0)
    assert lost.status.code in ("solver_failed", "not_finite")
    assert np.isfinite(lost.history.y).all()
    assert lost.history.end < 100.0


def check_verdict_on_what_is_kept(thrust: float, bow: float) -> None:
    """What the verdict on a loaded rod says it would keep is what it keeps when it is let go."""
    held = pl.solve(STRUT.with_load(pl.Load(thrust=thrust)), bow, until=200.0)
    gone = pl.solve(held.model.with_load(pl.Load()), start=held, until=1e6)
    tip = float(gone.dataset.tip_y[-1])
    assert abs(held.outcome.set_deflection - tip) <= 1e-5
    assert abs(gone.outcome.set_deflection - tip) <= 1e-5
    assert gone.outcome.headline == "Takes a permanent set"


@pytest.mark.parametrize(("thrust", "bow"), [(2.6, 0.1), (3.0, 0.5), (5.0, 0.5)])
def test_the_verdict_under_load_tells_what_is_kept(thrust: float, bow: float) -> None:
    check_verdict_on_what_is_kept(thrust, bow)


def test_a_rod_that_goes_on_remembers_its_very_first_shape(tmp_path: Path) -> None:
    soft = pl.Material("0.02*m**2", "pos(x)**2", "0.3")
    held = pl.solve(pl.Strut(soft, pl.Load(thrust=2.8), pl.Grid(20)), 0.2, until=60.0)
    free = pl.solve(held.model.with_load(pl.Load()), start=held, until=120.0)
    assert held.outcome.memory == free.outcome.memory == "permanent set"
    assert free.outcome.headline == "Takes a permanent set"
    assert pl.read(free.save(tmp_path / "free.nc")).outcome == free.outcome
    with pytest.raises(ArgumentError, match="`curvature` must not be given together"):
        pl.solve(held.model, 0.3, start=held, until=120.0)


def test_a_rod_left_alone_stays_at_rest() -> None:
    still = pl.solve(STRUT.with_load(pl.Load()), 0.0, until=10.0)
    assert still.outcome.headline == "Stays at rest"
    tiny = pl.solve(STRUT.with_load(pl.Load()), 1e-100, until=200.0)
    assert "free end is 0 L off" in tiny.outcome.sentence


@pytest.mark.parametrize("amplitude", [1e-100, 1e-150, 1e-300])
def test_starts_of_any_size(amplitude: float) -> None:
    assert pl.solve(STRUT, amplitude, until=10.0).status.ok


def check_pulse(load: pl.Load, table: pl.Load, shape: float) -> None:
    """A pulse written as text, or of little weight beside the thrust, is met as by a method that cannot miss it."""
    t = np.linspace(40.0, 60.0, 401)
    found, known = (
        pl.solve(STRUT.with_load(each), shape, until=100.0, method=method)
        for each, method in ((load, "LSODA"), (table, "DOP853"))
    )
    exact = known.at(0.1, t)
    assert np.abs(found.at(0.1, t) - exact).max() <= 2e-3 * np.abs(exact).max()


@pytest.mark.parametrize("width", [1.0, 0.2])
def test_a_pulse_written_as_text_is_met(width: float) -> None:
    t = np.linspace(0.0, 100.0, 20001)
    table = pl.Load(transverse=(t, 0.5 * np.exp(-(((t - 47.0) / width) ** 2))))
    check_pulse(pl.Load(transverse=f"0.5*exp(-((t - 47)/{width})**2)"), table, 0.3)


@pytest.mark.parametrize("extra", [False, True])
def test_a_pulse_that_is_small_beside_the_thrust_is_met(extra: bool) -> None:
    times, values = [0.0, 50.0, 50.05, 50.1], [0.0, 0.0, 0.0014, 0.0]
    if extra:
        times, values = [0.0, 10.0, 50.0, 50.05, 50.1], [0.0, 0.0, 0.0, 0.0014, 0.0]
    load = pl.Load(thrust=3.0, transverse=(times, values))
    sol = pl.solve(STRUT.with_load(load), 0.0, until=200.0)
    assert sol.outcome.headline == "Bends and takes a permanent set"


def test_only_what_settles_counts_as_settled() -> None:
    for text, settled in (("3*pos(1 - t)", 1.0), ("2 + step(t - 5)", 5.0), ("exp(-((t - 47)/0.02)**2)", None)):
        assert pl.programs.expression(text).settled == settled
    with pytest.raises(ArgumentError, match="become constant"):
        pl.solve(STRUT.with_load(pl.Load(transverse="exp(-((t - 47)/0.02)**2)")), 0.1, until="equilibrium")


def test_times_are_kept_to_the_bit_in_si() -> None:
    specimen = pl.Specimen(length=0.25, bending_stiffness=0.035, retardation_time=137.3)
    strut = pl.Strut(
        pl.catalogue.material("one-shape", length=0.25, stiffness=0.035, time=137.3), pl.Load(), pl.Grid(8), specimen
    )
    times = np.linspace(0.0, 1000.0, 97)
    assert np.array_equal(pl.solve(strut, 1.0, until=1000.0, times=times).dataset.t.values, times)


def test_times_beyond_rest_are_reached() -> None:
    sol = pl.solve(pl.Strut(pair("A"), pl.Load(thrust=1.0)), 0.05, until="equilibrium", times=[1.0, 1e3, 1e5])
    assert sol.dataset.t.values.tolist() == [1.0, 1e3, 1e5]


def test_the_dataset_shows_events_and_knots() -> None:
    sol = pl.solve(STRUT.with_load(pl.Load(thrust=([0.0, 2.0, 50.0], [2.0, 3.0, 3.0]))), "1 + cos(3*s)", until=20.0)
    times = sol.dataset.t.values
    for event in sol.events:
        assert np.abs(times - event.t).min() == 0.0
    assert {"transverse", "end_couple", "weight"} <= set(sol.dataset)


def test_numbers_of_any_kind_are_numbers() -> None:
    one = pl.solve(
        STRUT, np.array(0.2), np.float64(0.1), until=np.array(5.0), rtol=np.float32(1e-6), max_steps=np.int64(900)
    )
    other = pl.solve(STRUT, 0.2, 0.1, until=5, rtol=float(np.float32(1e-6)))
    assert np.array_equal(one.history.y, other.history.y)


def test_a_solution_introduces_itself() -> None:
    sol = pl.solve(STRUT, "1 + cos(3*s)", until=100.0)
    text = str(sol)
    for word in ("done", "Buckles and takes a permanent set", "residual", "LSODA", "Rajagopal", "above its threshold"):
        assert word in text
    assert repr(sol) == text


@pytest.mark.parametrize(
    ("arguments", "word"),
    [
        ({"curvature": "1 +"}, "curvature"),
        ({"curvature": "t"}, "curvature"),
        ({"curvature": "1/s - 1/s + log(0*s)"}, "curvature"),
        ({"curvature": float("nan")}, "curvature"),
        ({"curvature": [1.0, 2.0]}, "curvature"),
        ({"curvature": "0.4 1/m"}, "curvature"),
        ({"curvature": 1e9}, "curvature"),
        ({"curvature": lambda s: "x"}, "curvature"),
        ({"curvature": None}, "curvature"),
        ({"natural_curvature": "much"}, "natural_curvature"),
        ({"natural_curvature": float("inf")}, "natural_curvature"),
        ({"until": -1.0}, "until"),
        ({"until": "for ever"}, "until"),
        ({"until": float("nan")}, "until"),
        ({"rtol": 0.0}, "rtol"),
        ({"rtol": 1.0}, "rtol"),
        ({"atol": -1.0}, "atol"),
        ({"method": "RK45"}, "method"),
        ({"times": [0.0, 200.0]}, "times"),
        ({"times": [1.0, 0.5]}, "times"),
        ({"times": []}, "times"),
        ({"max_steps": 0}, "max_steps"),
        ({"until": True}, "until"),
        ({"until": np.array([5.0, 6.0])}, "until"),
        ({"method": np.array(["BDF", "x"])}, "method"),
        ({"atol": True}, "atol"),
        ({"start": 5}, "start"),
        ({"checkpoint": 5}, "checkpoint"),
        ({"checkpoint": "/nonexistent/folder/ck"}, "folder"),
        ({"checkpoint": "c", "checkpoint_every": "x"}, "checkpoint_every"),
    ],
)
def test_mistakes_are_one_clear_message(arguments: dict[str, object], word: str) -> None:
    with pytest.raises(PlasticaError, match=word) as caught:
        pl.solve(STRUT, **{"curvature": 0.1, **arguments})  # type: ignore[arg-type]
    assert "\n" not in str(caught.value)


def test_a_thrust_that_turns_into_tension_is_refused_before_the_run() -> None:
    strut = STRUT.with_load(pl.Load(thrust="2 - t"))
    assert pl.solve(strut, 0.1, until=1.5).status.ok
    with pytest.raises(ArgumentError, match="`thrust` must not be negative"):
        pl.solve(strut, 0.1, until=3.0)


def test_text_with_units_needs_a_specimen() -> None:
    with pytest.raises(ArgumentError, match="specimen"):
        pl.Strut(pair("A"), pl.Load(thrust="3 N"))
    with pytest.raises(ArgumentError, match="specimen"):
        pl.Strut(si_twin().material, pl.Load(thrust=3.0))
