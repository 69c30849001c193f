"""Claim: pictures show what was computed, whatever the run, and solve nothing."""

from __future__ import annotations

import subprocess
import sys
from dataclasses import replace

import matplotlib
import numpy as np
import pytest
from matplotlib.figure import Figure

import plastica as pl
from plastica.errors import ArgumentError
from plastica.show import panels, plots, style, view
from tests.patience import PATIENCE

from .pictured import FIGURES, check_nothing_is_solved, line, not_begun, run
from .support import EPS

# -- what is drawn is what was computed -----------------------------------------------------------------------


def passes_through(drawn: tuple[np.ndarray, np.ndarray], t: np.ndarray, values: np.ndarray) -> None:
    """The line has every one of these points, to rounding."""
    x, y = drawn
    where = np.abs(x[:, None] - t[None, :]).argmin(axis=0)
    assert np.abs(x[where] - t).max() <= 8 * EPS * max(np.abs(t).max(), 1.0)
    assert np.abs(y[where] - values).max() <= 64 * EPS * max(np.abs(values).max(), EPS)


def check_natural_curvature(solution: pl.Solution) -> None:
    """Natural curvature, drive and threshold of the dataset, in the unit that the axis names."""
    data = solution.dataset
    t = data["t"].values
    upper, lower = plots.natural(solution).axes
    si = solution.model.specimen is not None
    days, milli = (86400.0, 1e-3) if si else (1.0, 1.0)
    passes_through(line(upper, "natural curvature"), t / days, data["natural_curvature"].values)
    passes_through(line(lower, "drive"), t / days, data["drive"].values / milli)
    limits = [each for each in lower.lines if each.get_label() == "threshold"]
    assert len(limits) == 2
    for sign, each in zip((1.0, -1.0), limits, strict=True):
        x, y = np.asarray(each.get_xdata(), float), np.asarray(each.get_ydata(), float)
        passes_through((x, y), t / days, sign * data["threshold"].values / milli)
    assert ("(1/m)" in upper.get_ylabel()) == si
    assert ("(mN·m²)" in lower.get_ylabel()) == si


@pytest.mark.parametrize("name", ["buckles", "held"])
def test_natural_curvature_drive_and_threshold_are_those_of_the_dataset(name: str) -> None:
    check_natural_curvature(run(name))


def check_energies(solution: pl.Solution) -> None:
    """The energies of the dataset; the Liapunov function since its start; the residual of the ledger at the end."""
    data = solution.dataset
    t = data["t"].values
    upper, lower = plots.energies(solution).axes
    drawn = {
        "work of the loads": data["work"],
        "stored energy": data["stored_energy"],
        "lost to viscosity": data["viscous_dissipation"],
        "lost to yielding": data["natural_dissipation"],
        "Liapunov function*": data["liapunov"] - data["liapunov"][0],
    }
    for label, values in drawn.items():
        passes_through(line(upper, label), t, values.values)
    _, residual = line(lower, "residual")
    ledger = solution.ledger
    expected = ledger.residual / (solution.rtol * ledger.largest_energy)
    assert abs(residual[-1] - expected) <= 64 * EPS / solution.rtol


def test_energies_and_residual_are_those_of_the_ledger() -> None:
    check_energies(run("buckles"))


def check_map(solution: pl.Solution) -> None:
    """Every cell of the map has the curvature at its middle."""
    ax = plots.curvature_map(solution).axes[0]
    (mesh,) = ax.collections
    values = np.asarray(mesh.get_array())
    rows, columns = panels.MAP_SIZE
    length, end = solution.model.scales.length, float(solution.dataset["t"][-1])
    s = (np.arange(rows) + 0.5) / rows * length
    t = (np.arange(columns) + 0.5) / columns * end
    expected = np.asarray(solution.at(s[:, None], t[None, :]))
    assert np.abs(values - expected).max() <= 1e-9 * np.abs(expected).max()


@pytest.mark.parametrize("name", ["rough", "held"])
def test_map_shows_the_curvature(name: str) -> None:
    check_map(run(name))


def test_map_is_white_at_zero_where_there_are_two_signs() -> None:
    (mesh,) = plots.curvature_map(run("rough")).axes[0].collections
    assert mesh.cmap.name == style.DIVERGING
    assert mesh.norm(0.0) == 0.5
    (single,) = plots.curvature_map(run("buckles")).axes[0].collections
    assert single.cmap.name == style.SEQUENTIAL
    assert single.norm.vmin == 0.0


def check_shapes(solution: pl.Solution) -> None:
    """The first and last shape end where the free end is, start at the clamp, and are as long as the rod."""
    ax = plots.shapes(solution).axes[0]
    rods = [each for each in ax.lines if str(each.get_label()).startswith("rod at")]
    assert len(rods) == panels.CURVES
    data, unit = solution.dataset, 1e-3 if solution.model.specimen is not None else 1.0
    for rod, row in ((rods[0], 0), (rods[-1], -1)):
        x, y = np.asarray(rod.get_xdata(), float) * unit, np.asarray(rod.get_ydata(), float) * unit
        tip = np.array([data["tip_x"].values[row], data["tip_y"].values[row]])
        length = solution.model.scales.length
        assert np.abs(np.array([x[-1], y[-1]]) - tip).max() <= 1e-9 * length
        assert max(abs(x[0]), abs(y[0])) <= 64 * EPS * length
        chords = np.hypot(np.diff(x), np.diff(y)).sum()
        assert 0.999 * length <= chords <= length * (1.0 + 1e-6)


@pytest.mark.parametrize("name", ["buckles", "held", "rough"])
def test_shapes_are_those_of_the_rod(name: str) -> None:
    check_shapes(run(name))


def test_shapes_have_equal_axes_and_a_natural_shape_at_both_ends() -> None:
    ax = plots.shapes(run("buckles")).axes[0]
    assert ax.get_aspect() == 1.0
    x, y = line(ax, "natural shape at the end")
    natural = float(run("buckles").dataset["natural_curvature"][-1])
    assert abs(x[-1] - np.sin(natural) / natural) <= 1e-12
    assert abs(y[-1] - (1.0 - np.cos(natural)) / natural) <= 1e-12
    assert np.abs(line(ax, "natural shape at the start")[1]).max() == 0.0


def check_loads(solution: pl.Solution) -> None:
    """A jump of a load is drawn upright, with the values of both sides."""
    figure = plots.loads(solution)
    t, thrust = line(figure.axes[0], "thrust")
    assert thrust[t == 5.0][0] == 2.0
    assert np.all(thrust[t == 5.0][1:] == 0.0)
    assert np.sum(t == 5.0) >= 2
    assert np.all(thrust[t < 5.0] == 2.0)
    assert np.all(thrust[t > 5.0] == 0.0)
    assert np.all(line(figure.axes[1], "transverse")[1] == 0.1)


def test_jumps_of_loads_are_upright_and_absent_loads_are_not_drawn() -> None:
    check_loads(run("jump"))
    assert len(plots.loads(run("jump")).axes) == 2
    assert len(plots.loads(run("buckles")).axes) == 1


def check_yielding(solution: pl.Solution) -> None:
    """The shaded ground covers just the times at which the natural curvature moves."""
    data = solution.dataset
    t, moves = data["t"].values, np.abs(np.diff(data["natural_curvature"].values)) > 0.0
    spans = view.yielding(solution)
    middle = 0.5 * (t[1:] + t[:-1])
    shaded = np.any([(begin <= middle) & (middle <= end) for begin, end in spans], axis=0)
    assert np.array_equal(shaded, moves)


@pytest.mark.parametrize("name", ["held", "rough", "jump"])
def test_the_ground_is_shaded_where_the_natural_curvature_moves(name: str) -> None:
    check_yielding(run(name))


def test_a_rod_that_never_yields_has_no_shaded_ground() -> None:
    assert view.yielding(run("elastic")) == []
    upper, _ = plots.natural(run("elastic")).axes
    assert not upper.collections


# -- runs of every kind ---------------------------------------------------------------------------------------


@pytest.mark.parametrize("figure", FIGURES)
@pytest.mark.parametrize("name", ["elastic", "jump", "short", "still", "stopped", "not begun"])
def test_every_run_can_be_drawn(name: str, figure: str) -> None:
    drawn = FIGURES[figure](not_begun() if name == "not begun" else run(name))
    assert isinstance(drawn, Figure)
    drawn.savefig("/dev/null", format="png", dpi=20)


def test_a_run_that_stopped_early_says_so() -> None:
    assert "Stopped early" in plots.plot(run("stopped")).get_suptitle()
    assert "Stopped early" not in plots.plot(run("buckles")).get_suptitle()


def test_many_steps_are_thinned_out_and_no_event_is_lost(monkeypatch: pytest.MonkeyPatch) -> None:
    solution = run("held")
    events = [event.t for event in solution.events]
    monkeypatch.setattr(view, "MOST_POINTS", 60)
    t = view.view(solution).t
    assert 60 <= t.size <= 60 + len(events)
    assert all(np.abs(t - each).min() <= 8 * EPS * each for each in events)
    assert (t[0], t[-1]) == (solution.dataset["t"][0], solution.dataset["t"][-1])


def test_few_steps_are_drawn_as_curves_through_the_steps() -> None:
    solution = run("short")
    t = view.view(solution).t
    assert t.size >= view.FEWEST_POINTS
    assert set(solution.dataset["t"].values) <= set(t)


def test_pictures_do_not_depend_on_the_times_that_were_asked_for() -> None:
    whole = run("buckles")
    asked = replace(whole, times=np.array([0.0, 40.0]))
    for label in ("work of the loads", "stored energy"):
        one, other = (line(plots.energies(each).axes[0], label) for each in (whole, asked))
        assert np.array_equal(one, other)


def test_preferred_natural_curvatures_are_marked() -> None:
    three = pl.Strut(pl.catalogue.material("three-shapes"), pl.Load(transverse=2.0), pl.Grid(nodes=8))
    solution = pl.solve(three, until=5.0, rtol=1e-6)
    upper = plots.natural(solution).axes[0]
    marks = {float(np.asarray(each.get_ydata())[0]) for each in upper.lines if each.get_label() == "_preferred"}
    assert 0.0 in marks
    assert marks <= {0.0, three.material.well, -three.material.well}
    low, high = upper.get_ylim()
    assert all(low < each < high for each in marks)


@pytest.mark.parametrize("wrong", [None, 3.0, "run.nc"])
def test_what_is_no_result_is_refused(wrong: object) -> None:
    with pytest.raises(ArgumentError, match="Solution"):
        plots.plot(wrong)  # type: ignore[arg-type]
    with pytest.raises(ArgumentError, match="`solution` must be a Solution"):
        plots.shapes(wrong)  # type: ignore[arg-type]


# -- manners --------------------------------------------------------------------------------------------------


def test_no_window_system_takes_part() -> None:
    code = (
        "import sys, plastica as pl\n"
        "m = pl.Material('m**2/2', 'pos(x)**2', '0.1')\n"
        "s = pl.solve(pl.Strut(m, pl.Load(thrust=3.0), pl.Grid(nodes=6)), 0.2, until=1.0)\n"
        "pl.plot(s).savefig('/dev/null', format='png', dpi=20)\n"
        "assert 'matplotlib.pyplot' not in sys.modules\n"
        "assert 'tkinter' not in sys.modules\n"
    )
    subprocess.run([sys.executable, "-c", code], check=True, timeout=PATIENCE)


def test_settings_of_the_user_are_left_alone_and_do_not_matter() -> None:
    usual = plots.natural(run("buckles")).axes[0].yaxis.label.get_fontsize()
    with matplotlib.rc_context({"axes.labelsize": 40.0, "axes.grid": False}):
        assert plots.natural(run("buckles")).axes[0].yaxis.label.get_fontsize() == usual
        assert matplotlib.rcParams["axes.labelsize"] == 40.0
        assert matplotlib.rcParams["axes.grid"] is False


@pytest.mark.parametrize("figure", FIGURES)
def test_a_picture_solves_nothing(figure: str, monkeypatch: pytest.MonkeyPatch) -> None:
    check_nothing_is_solved(monkeypatch, FIGURES[figure])
