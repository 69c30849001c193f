"""Claim: pictures and films show what was computed, in units one can read, in colours everyone can tell apart."""

from __future__ import annotations

import itertools
import stat
import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace
from functools import cache
from pathlib import Path

import matplotlib
import numpy as np
import pytest
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from PIL import Image

import plastica as pl
from plastica.errors import ArgumentError, FileError
from plastica.motion.history import History
from plastica.motion.status import Status
from plastica.show import axes, encode, film, panels, plots, style, view

from .support import EPS

FIGURES: dict[str, Callable[[pl.Solution], Figure]] = {
    "shapes": plots.shapes,
    "curvature_map": plots.curvature_map,
    "natural": plots.natural,
    "energies": plots.energies,
    "loads": plots.loads,
    "plot": plots.plot,
}


def material(h: float = 0.1) -> pl.Material:
    return pl.Material("k*m**2/2", "c*pos(x)**2", "h", {"k": 1.0, "c": 1.0, "h": h})


def strut(thrust: object = 3.0, h: float = 0.1, **loads: object) -> pl.Strut:
    return pl.Strut(material(h), pl.Load(thrust=thrust, **loads), pl.Grid(nodes=10))  # type: ignore[arg-type]


def si_strut(thrust: object) -> pl.Strut:
    laws = pl.Material(
        "k*m**2/2",
        "c*pos(x)**2",
        "h",
        {"k": "0.035 N*m**2", "c": "4 1/(N**2*m**5*s)", "h": "0.003 N*m**2"},
    )
    specimen = pl.Specimen(length="250 mm", bending_stiffness="0.035 N*m**2", retardation_time="120 s")
    return pl.Strut(laws, pl.Load(thrust=thrust), pl.Grid(nodes=10), specimen=specimen)  # type: ignore[arg-type]


@cache
def run(name: str) -> pl.Solution:
    """The runs that are looked at."""
    hold = pl.programs.ramp_hold_release("1.6 N", "10 min", "1 day", "0 s")
    makers: dict[str, Callable[[], pl.Solution]] = {
        "buckles": lambda: pl.solve(strut(), "0.2", until=40.0, rtol=1e-6),
        "held": lambda: pl.solve(si_strut(hold), "0.4", until="2 days", rtol=1e-6),
        "long": lambda: pl.solve(si_strut("1.6 N"), "0.4", until="300 days", rtol=1e-6),
        "elastic": lambda: pl.solve(strut(2.0, 50.0), "0.2", until=10.0, rtol=1e-6),
        "rough": lambda: pl.solve(strut(1.5), pl.piecewise([0.5], [2.0, -1.0]), until=10.0, rtol=1e-6),
        "jump": lambda: pl.solve(strut(([0, 5, 5, 9], [2, 2, 0, 0]), transverse=0.1), "0.5", until=9.0, rtol=1e-6),
        "short": lambda: pl.solve(strut(), "0.2", until=1e-3, rtol=1e-4),
        "still": lambda: pl.solve(strut(0.0), 0.0, until=5.0),
        "stopped": lambda: pl.solve(strut(), "0.2", until=100.0, max_steps=30),
    }
    return makers[name]()


def not_begun() -> pl.Solution:
    """A run that did not take a step."""
    whole = run("buckles")
    return replace(
        whole,
        history=History.at_rest(0.0, whole.history.y[0]),
        legs=(np.array([0.0]), np.array([True, True])),
        status=Status(False, "solver_failed", "The solver gave up at the start."),
    )


def line(ax: Axes, label: str) -> tuple[np.ndarray, np.ndarray]:
    (found,) = (each for each in ax.lines if each.get_label() == label)
    return np.asarray(found.get_xdata(), dtype=float), np.asarray(found.get_ydata(), dtype=float)


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


# -- axes that can be read ------------------------------------------------------------------------------------


def check_labels(figure: Figure, *, si: bool) -> None:
    """Every axis that has a name has a unit, or says by what it was divided."""
    marks = ("(mm)", "(1/m)", "(N)", "(mN)", "(mJ)", "(µJ)", "(mN·m²)", "(min)", "(h)", "(days)", "(logarithmic)")
    ratios = ("× L", "/ L", "/ EI", "/ retardation time")
    every = [ax for part in [figure, *figure.subfigs] for ax in part.axes]
    named = [text for ax in every for text in (ax.get_xlabel(), ax.get_ylabel()) if text]
    assert len(named) >= len(every)
    for text in named:
        if text not in ("Imbalance", "Time"):
            assert any(mark in text for mark in (marks if si else ratios)), text


@pytest.mark.parametrize("figure", FIGURES)
@pytest.mark.parametrize("name", ["buckles", "held", "long"])
def test_every_axis_has_a_unit(name: str, figure: str) -> None:
    check_labels(FIGURES[figure](run(name)), si=name != "buckles")


@pytest.mark.parametrize(
    ("unit", "largest", "factor", "name"),
    [
        ("m", 0.25, 1e-3, "mm"),
        ("m", 3.0, 1.0, "m"),
        ("m", 2e-5, 1e-6, "µm"),
        ("m", 0.0, 1e-3, "mm"),
        ("s", 90.0, 1.0, "s"),
        ("s", 600.0, 60.0, "min"),
        ("s", 90000.0, 3600.0, "h"),
        ("s", 172800.0, 86400.0, "days"),
        ("s", 0.0, 1.0, "s"),
        ("N", 0.02, 1e-3, "mN"),
        ("N", 2000.0, 1e3, "kN"),
        ("N*m**2", 0.004, 1e-3, "mN·m²"),
        ("J", 4e-6, 1e-6, "µJ"),
        ("J", 0.0, 1.0, "J"),
        ("1/m", 12.0, 1.0, "1/m"),
        ("rad", 1.0, np.pi / 180.0, "°"),
    ],
)
def test_axis_units_suit_the_largest_value(unit: str, largest: float, factor: float, name: str) -> None:
    assert axes.axis_unit(unit, largest) == (factor, name)


@pytest.mark.parametrize(
    ("t", "words"),
    [
        (0.0, "0 s"),
        (59.0, "59 s"),
        (61.0, "1 min 1 s"),
        (3599.9, "1 h"),
        (51240.0, "14 h 14 min"),
        (104400.0, "1 d 5 h"),
    ],
)
def test_clock(t: float, words: str) -> None:
    assert axes.TimeAxis("linear", 0.0, 60.0, "min", 0.0, 1.0, "").clock(t) == words


def test_time_is_logarithmic_only_where_a_linear_axis_would_hide_the_motion() -> None:
    assert view.view(run("long")).time.scale == "log"
    for name in ("buckles", "held", "jump", "short", "still"):
        assert view.view(run(name)).time.scale == "linear", name


def test_a_logarithmic_axis_begins_before_anything_has_happened() -> None:
    seen = view.view(run("long"))
    begin = float(seen.time.times(0.0))
    assert 0.0 < begin < 600.0
    assert float(np.interp(begin, seen.t, seen.path)) <= 1e-3
    assert abs(float(seen.time.times(1.0)) - seen.t[-1]) <= 8 * EPS * seen.t[-1]


def test_a_continued_run_counts_from_its_own_start_on_a_logarithmic_axis() -> None:
    first = run("buckles")
    later = pl.solve(strut(0.0), start=first, until=1e5, rtol=1e-6)
    seen = view.view(later)
    assert seen.time.scale == "log"
    assert seen.time.origin == 40.0
    assert "since start" in seen.time.label


# -- colours --------------------------------------------------------------------------------------------------

# G. M. Machado, M. M. Oliveira and L. A. F. Fernandes, 2009: full protanopia, deuteranopia and tritanopia.
BLINDNESS = {
    "protan": [[0.152286, 1.052583, -0.204868], [0.114503, 0.786281, 0.099216], [-0.003882, -0.048116, 1.051998]],
    "deutan": [[0.367322, 0.860646, -0.227968], [0.280085, 0.672501, 0.047413], [-0.011820, 0.042940, 0.968881]],
    "tritan": [[1.255528, -0.076749, -0.178779], [-0.078411, 0.930809, 0.147602], [0.004733, 0.691367, 0.303900]],
}
NOTICEABLE = 12.0
"""Distance in CIE Lab at which two colours side by side are told apart without effort (2.3 is just noticeable)."""


def seen_as(colours: np.ndarray, kind: str) -> np.ndarray:
    """CIE Lab of sRGB colours as somebody of this kind of colour vision sees them; shape (k, 3)."""
    linear = np.where(colours <= 0.04045, colours / 12.92, ((colours + 0.055) / 1.055) ** 2.4)
    if kind != "normal":
        linear = np.clip(linear @ np.array(BLINDNESS[kind]).T, 0.0, 1.0)
    to_xyz = [[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]]
    xyz = linear @ np.array(to_xyz).T / np.array([0.9505, 1.0, 1.089])
    f = np.where(xyz > 216 / 24389, np.cbrt(xyz), (24389 / 27 * xyz + 16) / 116)
    return np.stack([116 * f[:, 1] - 16, 500 * (f[:, 0] - f[:, 1]), 200 * (f[:, 1] - f[:, 2])], axis=1)


def check_palette(roles: tuple[str, ...], kind: str) -> None:
    """Any two lines that meet in one picture differ in colour for this kind of vision, and in their dashes."""
    for one, other in itertools.combinations(roles, 2):
        lab = seen_as(np.array([to_rgb(style.ROLES[one][0]), to_rgb(style.ROLES[other][0])]), kind)
        assert np.linalg.norm(lab[0] - lab[1]) >= NOTICEABLE, (one, other)
        assert style.ROLES[one][1] != style.ROLES[other][1], (one, other)


TOGETHER = (
    ("stored", "work", "viscous", "dissipation", "liapunov"),
    ("rod", "natural"),
    ("drive", "threshold"),
)


@pytest.mark.parametrize("kind", ["normal", *BLINDNESS])
@pytest.mark.parametrize("roles", TOGETHER)
def test_lines_of_one_picture_are_told_apart_by_everyone(roles: tuple[str, ...], kind: str) -> None:
    check_palette(roles, kind)


@pytest.mark.parametrize("kind", ["normal", *BLINDNESS])
def test_the_sequential_map_goes_from_dark_to_light_for_everyone(kind: str) -> None:
    lightness = seen_as(colormaps[style.SEQUENTIAL](np.linspace(0, 1, 33))[:, :3], kind)[:, 0]
    assert np.all(np.diff(lightness) > 0.0)


def test_lines_use_the_palette_only() -> None:
    allowed = {*style.OKABE_ITO.values(), style.INK, style.MUTED}
    for figure in (plots.natural, plots.energies, plots.loads):
        for ax in figure(run("buckles")).axes:
            assert {each.get_color() for each in ax.lines} <= allowed


# -- runs of every kind ---------------------------------------------------------------------------------------


@pytest.mark.parametrize("figure", FIGURES)
@pytest.mark.parametrize("name", ["elastic", "jump", "short", "still", "stopped", "not begun"])
def test_every_run_can_be_drawn(name: str, figure: str) -> None:
    drawn = FIGURES[figure](not_begun() if name == "not begun" else run(name))
    assert isinstance(drawn, Figure)
    drawn.savefig("/dev/null", format="png", dpi=20)


def test_a_run_that_stopped_early_says_so() -> None:
    assert "stopped early" in plots.plot(run("stopped")).get_suptitle()
    assert "stopped early" not in plots.plot(run("buckles")).get_suptitle()


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
    subprocess.run([sys.executable, "-c", code], check=True, timeout=60)


def test_settings_of_the_user_are_left_alone_and_do_not_matter() -> None:
    usual = plots.natural(run("buckles")).axes[0].yaxis.label.get_fontsize()
    with matplotlib.rc_context({"axes.labelsize": 40.0, "axes.grid": False}):
        assert plots.natural(run("buckles")).axes[0].yaxis.label.get_fontsize() == usual
        assert matplotlib.rcParams["axes.labelsize"] == 40.0
        assert matplotlib.rcParams["axes.grid"] is False


def check_nothing_is_solved(monkeypatch: pytest.MonkeyPatch, show: Callable[[pl.Solution], object]) -> None:
    """Neither the integrator nor SciPy's solvers are called."""
    solution = run("buckles")

    def refuse(*args: object, **options: object) -> None:
        raise AssertionError("a picture must not solve anything")

    monkeypatch.setattr("plastica.motion.solve.integrate", refuse)
    monkeypatch.setattr("plastica.motion.integrate.integrate", refuse)
    for name in ("LSODA", "DOP853", "Radau", "BDF", "solve_ivp"):
        monkeypatch.setattr(f"scipy.integrate.{name}", refuse)
    show(solution)


@pytest.mark.parametrize("figure", FIGURES)
def test_a_picture_solves_nothing(figure: str, monkeypatch: pytest.MonkeyPatch) -> None:
    check_nothing_is_solved(monkeypatch, FIGURES[figure])


# -- films ----------------------------------------------------------------------------------------------------


def check_frame_times(solution: pl.Solution, count: int) -> None:
    """Increasing, from the first time to the last, and in every frame something happens."""
    seen = view.view(solution)
    times = view.frame_times(seen, count)
    assert times.size == count
    assert np.all(np.diff(times) > 0.0)
    assert (times[0], times[-1]) == (seen.t[0], seen.t[-1])
    way = np.interp(times, seen.t, seen.path)
    place = seen.time.place(times)
    step = np.diff(0.5 * way + 0.5 * place)
    assert step.min() >= 0.5 / count
    assert step.max() <= 2.0 / count


@pytest.mark.parametrize("name", ["buckles", "held", "long", "jump", "stopped"])
def test_something_happens_in_every_frame(name: str) -> None:
    check_frame_times(run(name), 50)


def test_gif_has_its_frames_loops_and_is_small(tmp_path: Path) -> None:
    path = film.film(run("held"), tmp_path / "rod.gif", seconds=2.0, fps=10.0, width=400)
    assert path == tmp_path / "rod.gif"
    assert [each.name for each in tmp_path.iterdir()] == ["rod.gif"]
    assert path.stat().st_size < 500_000
    with Image.open(path) as picture:
        assert picture.format == "GIF"
        assert picture.n_frames == 20
        assert picture.size[0] == 400
        assert picture.info["loop"] == 0
        durations = []
        for k in range(20):
            picture.seek(k)
            durations.append(picture.info["duration"])
    assert durations == [100] * 19 + [encode.HOLD]


def test_default_film_stays_below_two_megabytes(tmp_path: Path) -> None:
    assert film.film(run("held"), tmp_path / "rod.gif").stat().st_size < 2_000_000


def check_frames_show_the_rod(solution: pl.Solution) -> None:
    """In every frame the drawn rod ends where the free end is at that time, and the dots lie on their curves."""
    seen = view.view(solution)
    times = view.frame_times(seen, 7)
    data = replace(solution, times=times / solution.model.scales.time).dataset
    with style.drawing():
        stage = film._stage(seen, times, 400)
        for row in range(times.size):
            stage.show(row)
            x, y = (np.asarray(each, float)[-1] for each in stage.parts["rod"].get_data())
            assert abs(x - data["tip_x"].values[row] / 1e-3) <= 1e-6
            assert abs(y - data["tip_y"].values[row] / 1e-3) <= 1e-6
            stored = np.asarray(stage.parts["dot stored energy"].get_ydata(), float)[0]
            largest = float(np.abs(data["stored_energy"].values).max())
            assert abs(stored * 1e-3 - data["stored_energy"].values[row]) <= 0.02 * largest
            assert stage.parts["clock"].get_text() == seen.time.clock(float(times[row]))


def test_frames_show_the_rod_at_their_time() -> None:
    check_frames_show_the_rod(run("held"))


def test_no_arrow_is_drawn_once_the_load_is_gone() -> None:
    seen = view.view(run("held"))
    with style.drawing():
        stage = film._stage(seen, np.array([43200.0, 172800.0]), 400)
        stage.show(0)
        assert stage.parts["arrow"].get_visible()
        stage.show(1)
        assert not stage.parts["arrow"].get_visible()


@pytest.mark.parametrize("name", ["still", "short", "stopped", "not begun"])
def test_every_run_can_be_filmed(name: str, tmp_path: Path) -> None:
    solution = not_begun() if name == "not begun" else run(name)
    path = film.film(solution, tmp_path / "rod.gif", seconds=0.5, fps=8.0, width=240)
    with Image.open(path) as picture:
        assert picture.n_frames == (1 if name == "not begun" else 4)


def test_a_film_solves_nothing(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    check_nothing_is_solved(
        monkeypatch, lambda solution: film.film(solution, tmp_path / "rod.gif", seconds=0.3, fps=10.0, width=240)
    )


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"path": "rod.avi"}, "`path` must end in .gif or .mp4"),
        ({"path": "rod"}, "`path` must end in .gif or .mp4"),
        ({"seconds": 0.0}, "`seconds` must be"),
        ({"seconds": float("nan")}, "`seconds` must be"),
        ({"seconds": "8"}, "`seconds` must be"),
        ({"fps": 0.5}, "`fps` must be"),
        ({"width": 10_000}, "`width` must be"),
        ({"seconds": 120.0, "fps": 50.0}, "at most 3000 frames"),
        ({"solution": None}, "`solution` must be a Solution"),
    ],
)
def test_impossible_films_are_refused(changes: dict[str, object], words: str, tmp_path: Path) -> None:
    options: dict[str, object] = {"solution": run("short"), "path": "rod.gif", **changes}
    options["path"] = tmp_path / str(options["path"])
    with pytest.raises(ArgumentError, match=words):
        film.film(**options)  # type: ignore[arg-type]
    assert list(tmp_path.iterdir()) == []


def test_without_ffmpeg_an_mp4_is_refused_with_a_way_out(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr("shutil.which", lambda name: None)
    with pytest.raises(ArgumentError, match=r"Install ffmpeg, or write a \.gif"):
        film.film(run("short"), tmp_path / "rod.mp4")
    assert list(tmp_path.iterdir()) == []


def stand_in(folder: Path, monkeypatch: pytest.MonkeyPatch, *, fails: bool) -> Path:
    """A program in the place of ffmpeg: it keeps its arguments and the size of what came through the pipe."""
    program = folder / "ffmpeg"
    ending = (
        "sys.stderr.write('no such codec\\n'); sys.exit(1)" if fails else "open(sys.argv[-1], 'wb').write(data[:9])"
    )
    program.write_text(
        f"#!{sys.executable}\nimport sys\ndata = sys.stdin.buffer.read()\n"
        f"open({str(folder / 'seen')!r}, 'w').write(' '.join(sys.argv[1:]) + f' | {{len(data)}}')\n{ending}\n"
    )
    program.chmod(program.stat().st_mode | stat.S_IXUSR)
    monkeypatch.setattr("shutil.which", lambda name: str(program))
    return folder / "seen"


def test_mp4_frames_reach_ffmpeg_whole(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    tools, out = tmp_path / "tools", tmp_path / "out"
    tools.mkdir()
    out.mkdir()
    seen = stand_in(tools, monkeypatch, fails=False)
    film.film(run("short"), out / "rod $(touch x).mp4", seconds=0.5, fps=8.0, width=301)
    command, size = seen.read_text().split(" | ")
    width, height = (int(each) for each in command.split("-s ")[1].split()[0].split("x"))
    assert (width % 2, height % 2) == (0, 0)
    assert int(size) == 4 * 3 * width * height
    assert "-r 8 " in command
    assert [each.name for each in out.iterdir()] == ["rod $(touch x).mp4"]


def test_a_failure_of_ffmpeg_leaves_nothing_behind(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    tools, out = tmp_path / "tools", tmp_path / "out"
    tools.mkdir()
    out.mkdir()
    stand_in(tools, monkeypatch, fails=True)
    with pytest.raises(FileError, match="no such codec"):
        film.film(run("short"), out / "rod.mp4", seconds=0.5, fps=8.0, width=240)
    assert list(out.iterdir()) == []
