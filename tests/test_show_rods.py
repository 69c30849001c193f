"""Claim: pictures and films of the general rod show what was computed: inertia, segments, all loads."""

from __future__ import annotations

import logging
import re
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure
from PIL import Image

import plastica as pl
from plastica.errors import ArgumentError
from plastica.show import arrows, captions, film, loops, plots, style, swings, view

from .pictured import line, material
from .support import EPS
from .swinging import run
from .test_show import passes_through


@pytest.mark.parametrize("picture", sorted(plots.PICTURES.keys() - {"overview"}))
@pytest.mark.parametrize("name", ["rod", "pieces", "own time", "still"])
def test_every_run_has_every_picture(name: str, picture: str) -> None:
    figure = pl.plot(run(name), picture)
    assert isinstance(figure, Figure)
    figure.savefig("/dev/null", format="png", dpi=20)


def test_every_picture_is_documented() -> None:
    text = (Path(__file__).parent.parent / "docs" / "results.md").read_text(encoding="utf-8")
    table = text.split("## Pictures")[1].split("## Other results")[0]
    assert re.findall(r"^\| `(\w+)` \|", table, flags=re.MULTILINE) == list(plots.PICTURES)


@pytest.mark.parametrize("name", ["rod", "let go"])
def test_every_run_has_an_overview(name: str) -> None:
    figure = pl.plot(run(name))
    figure.savefig("/dev/null", format="png", dpi=20)
    assert len(figure.axes) == (9 if run(name).model.segments > 1 else 8)


def test_a_picture_is_chosen_by_its_name() -> None:
    with pytest.raises(ArgumentError, match="`picture` must be one of overview, shapes"):
        pl.plot(run("still"), "velocity")
    with pytest.raises(ArgumentError, match="`picture` must be left out"):
        pl.plot(pl.equilibrium(material(), 1.0, 0.1), "shapes")


# -- energies, motion, reactions ---------------------------------------------------------------------------------------


def check_kinetic() -> None:
    """The kinetic energy is drawn, and what is left over in the end is the residual of the ledger."""
    solution = run("own time")
    data = solution.dataset
    upper, lower = plots.energies(solution).axes
    passes_through(line(upper, "kinetic energy"), data["t"].values, data["kinetic_energy"].values)
    _, left = line(lower, "residual")
    expected = solution.ledger.residual / (solution.rtol * solution.ledger.largest_energy)
    assert abs(left[-1] - expected) <= 64.0 * EPS / solution.rtol
    assert float(np.abs(left).max()) <= 100.0


def test_kinetic_energy_is_among_the_energies() -> None:
    check_kinetic()
    assert not any(each.get_label() == "kinetic energy" for each in plots.energies(run("strut")).axes[0].lines)


def check_velocities() -> None:
    """The velocity of the free end is the derivative of its place; in mm/s or m/s in SI."""
    for name, unit in (("own time", 1.0), ("let go", None)):
        solution = run(name)
        ax = plots.velocities(solution).axes[0]
        factor = {"(mm/s)": 1e-3, "(m/s)": 1.0}[ax.get_ylabel().split()[-1]] if unit is None else unit
        seen = view.view(solution)
        step = 1e-6 * seen.t[-1]
        inside = np.flatnonzero((seen.t > step) & (seen.t < seen.t[-1] - step))[::7]
        t = seen.t[inside]
        for word, variable in (("along", 0), ("across", 1)):
            _, drawn = line(ax, word)
            places = [seen.centre_lines(t + each * step, np.array([1.0]))[variable][:, 0] for each in (0.5, -0.5)]
            expected = (places[0] - places[1]) / step
            size = float(np.abs(expected).max())
            assert np.abs(drawn[inside] * factor - expected).max() <= 1e-3 * size


def test_velocities_are_those_of_the_free_end() -> None:
    check_velocities()
    seen = view.view(run("rod"))
    _, across = seen.velocities(seen.t, seen.solution.grid.s)
    assert np.abs(across - seen.values("velocity_y")).max() <= 1e-12 * np.abs(across).max()


def check_reactions() -> None:
    """Force and couple on the clamp are those of the dataset; of a strut those of a rod without inertia."""
    data = run("rod").dataset
    forces, couples = plots.reactions(run("rod")).axes
    t = data["t"].values
    passes_through(line(forces, "along"), t, data["clamp_force_x"].values)
    passes_through(line(forces, "across"), t, data["clamp_force_y"].values)
    passes_through(line(couples, "couple"), t, data["clamp_couple"].values)
    strut = run("strut")
    massless = pl.Rod(strut.model.material, strut.model.load, strut.grid)
    rod = pl.solve(massless, 0.2, until=8.0, rtol=1e-7)
    for one, other in zip(swings.reactions(view.view(strut)), swings.reactions(view.view(rod)), strict=True):
        assert np.abs(one[[0, -1]] - other[[0, -1]]).max() <= 1e-5


def test_reactions_at_the_clamp() -> None:
    check_reactions()


def check_path() -> None:
    """The path of the free end begins at its ring and ends at its disc, on equal axes."""
    data = run("let go").dataset
    upper, lower = plots.free_end(run("let go")).axes
    x, y = line(upper, "path of the free end")
    for row, mark in ((0, "_start"), (-1, "_end")):
        tip = np.array([data["tip_x"].values[row], data["tip_y"].values[row]]) / 1e-3
        assert np.abs(np.array([x[row], y[row]]) - tip).max() <= 1e-9
        (where,) = np.transpose(line(upper, mark))
        assert np.abs(where - tip).max() <= 1e-9
    assert upper.get_aspect() == 1.0
    assert line(lower, "across")[1][-1] == y[-1]


def test_path_of_the_free_end() -> None:
    check_path()


def test_time_is_in_units_of_the_rods_own_scale() -> None:
    own, usual = (plots.natural(run(name)).axes[-1].get_xlabel() for name in ("own time", "rod"))
    assert own == "Time / T"
    assert usual == "Time / retardation time"
    assert view.view(run("own time")).time.words(3.0) == "3 T"


# -- segments ----------------------------------------------------------------------------------------------------------


def check_segments() -> None:
    """One line for each segment, drives in units of the threshold, and bars just where a segment moves."""
    solution = run("pieces")
    data, t = solution.dataset, solution.dataset["t"].values
    upper, middle, lower = plots.natural(solution).axes
    for j in range(3):
        label = f"segment {j + 1}"
        passes_through(line(upper, label), t, data["natural_curvature"].values[:, j])
        passes_through(line(middle, label), t, data["drive"].values[:, j] / data["threshold"].values[:, j])
        (bars,) = (each for each in lower.collections if each.get_label() == f"{label} yields")
        boxes = [path.get_extents() for path in bars.get_paths()]
        low, high = solution.model.division.breaks[j : j + 2]
        assert all(abs(box.y0 - low) + abs(box.y1 - high) <= 8 * EPS for box in boxes)
        between = 0.5 * (t[1:] + t[:-1])
        shaded = np.any([(box.x0 <= between) & (between <= box.x1) for box in boxes], axis=0)
        moves = np.abs(np.diff(data["natural_curvature"].values[:, j])) > 0.0
        assert np.all(shaded[moves])
        # Just after an onset it moves by less than rounding.
        assert np.diff(t)[shaded & ~moves].sum() <= 1e-3 * t[-1]


def test_segments_have_lines_and_bars() -> None:
    check_segments()


def check_arcs() -> None:
    """The natural shape turns by the natural curvature of each segment, and is as long as the rod."""
    solution = run("pieces")
    seen = view.view(solution)
    ends = np.asarray(solution.model.division.breaks)
    *_, x, y = seen.centre_lines(seen.t[-1:], np.linspace(0.0, 1.0, 1001))
    turned = np.unwrap(np.arctan2(np.diff(y[0]), np.diff(x[0])))
    assert abs(np.hypot(np.diff(x[0]), np.diff(y[0])).sum() - 1.0) <= 1e-5
    natural = solution.dataset["natural_curvature"].values[-1]
    for j, (low, high) in enumerate(pairwise(ends)):
        rows = slice(round(1000 * low) + 1, round(1000 * high) - 1)
        assert np.abs(np.diff(turned[rows]) * 1000.0 - natural[j]).max() <= 1e-6


def test_natural_shape_is_a_row_of_arcs() -> None:
    check_arcs()


# -- loads as arrows ---------------------------------------------------------------------------------------------------


def direction(drawn: arrows.Arrow) -> np.ndarray:
    """From the other end of the first line to its head, as a unit vector."""
    head = np.array([drawn.head_x[0], drawn.head_y[0]])
    line_x, line_y = drawn.x[:2], drawn.y[:2]
    root = np.array([line_x[0], line_y[0]])
    return np.asarray((head - root) / np.hypot(*(head - root)))


def check_arrows() -> None:
    """Arrows point as the forces do; a push ends at the free end and a pull begins there; couples turn as they do."""
    x, y = np.linspace(0.0, 0.8, 41), np.linspace(0.0, 0.6, 41)
    for thrust, transverse in ((1.0, 0.0), (-1.0, 0.0), (0.6, 0.8), (0.0, -1.0), (-0.6, 0.8)):
        pull = arrows.Pull((-thrust, transverse), 0.0, (0.0, 0.0))
        drawn = arrows.arrows(x, y, 0.6, pull, 1.0)["force"]
        assert np.abs(direction(drawn) - [-thrust, transverse]).max() <= 1e-12
        at_end = -1 if thrust > 0.0 else 0
        assert abs(drawn.x[at_end] - 0.8) + abs(drawn.y[at_end] - 0.6) <= 1e-15
        assert drawn.x.max() >= 0.8
        assert abs(np.hypot(np.ptp(drawn.x), np.ptp(drawn.y)) - arrows.ARROW) <= 1e-12
    for couple in (1.0, -0.5):
        drawn = arrows.arrows(x, y, 0.6, arrows.Pull((0.0, 0.0), couple, (0.0, 0.0)), 1.0)["couple"]
        offset = np.array([drawn.x - 0.8, drawn.y - 0.6])
        turning = offset[0, :-1] * np.diff(offset[1]) - offset[1, :-1] * np.diff(offset[0])
        assert np.all(np.sign(turning) == np.sign(couple))
        ahead = np.array([np.cos(np.radians(drawn.angle)), np.sin(np.radians(drawn.angle))])
        last = np.array([drawn.x[-1] - drawn.x[-2], drawn.y[-1] - drawn.y[-2]])
        assert ahead @ last >= 0.99 * np.hypot(*last)
    drawn = arrows.arrows(x, y, 0.6, arrows.Pull((0.0, 0.0), 0.0, (0.6, -0.8)), 1.0)["weight"]
    assert np.abs(direction(drawn) - [0.6, -0.8]).max() <= 1e-12
    assert drawn.head_x.size == len(arrows.HUNG)


def test_arrows_point_as_the_loads_do() -> None:
    check_arrows()
    assert arrows.arrows(np.zeros(2), np.zeros(2), 0.0, arrows.Pull((0.03, 0.0), 0.0, (0.0, 0.0)), 1.0) == {}


def check_labels_apart() -> None:
    """The words beside the panels of the loads, one above the other, do not run into each other."""
    sagging = pl.Load(thrust="0.1 N", transverse="0.8 N", weight="0.35 N/m", weight_angle="-90 deg")
    held = pl.solve(run("let go").model.with_load(sagging), until="1 ms", rtol=1e-4)
    for solution in (run("rod"), run("pieces"), held):
        figure = plots.loads(solution)
        figure.draw_without_rendering()
        boxes = [ax.yaxis.label.get_window_extent() for ax in figure.axes]
        assert len(boxes) == len(solution.model.loads.sources()) > 1
        assert boxes[0].y1 <= figure.bbox.y1
        assert boxes[-1].y0 >= figure.bbox.y0
        for above, below in pairwise(boxes):
            assert above.y0 >= below.y1


def test_words_beside_loads_are_apart() -> None:
    check_labels_apart()


def check_nothing_is_logged() -> None:
    """Matplotlib has nothing to say, on standard error, of any picture of a rod that a page has."""
    heard: list[str] = []
    handler = logging.Handler(logging.WARNING)
    handler.emit = lambda record: heard.append(record.getMessage())  # type: ignore[method-assign]
    logger = logging.getLogger("matplotlib")
    logger.addHandler(handler)
    try:
        for name in ("let go", "pieces"):
            for picture in captions.shown(view.view(run(name))):
                pl.plot(run(name), picture).savefig("/dev/null", format="png", dpi=20)
    finally:
        logger.removeHandler(handler)
    assert heard == []


def test_pictures_are_drawn_in_silence() -> None:
    check_nothing_is_logged()


def check_film_of_loads() -> None:
    """In every frame the arrows are those of the loads at that time, in length and in direction."""
    solution = run("pulled")
    seen = view.view(solution)
    times = np.array([0.0, 3.0, 4.0, 8.0])
    with style.drawing():
        stage = film._stage(seen, times, 400)
        for row, t in enumerate(times):
            stage.show(row)
            thrust = float(solution.model.loads.thrust(float(t)))
            x, y = (np.asarray(each, float) for each in stage.parts["arrow"].get_data())
            assert stage.parts["arrow"].get_visible()
            assert abs((x[-1] - x[0]) + arrows.ARROW * thrust / 3.0) <= 1e-12
            assert np.ptp(y) <= 1e-12
            head = stage.parts["head"].get_marker()[2]
            assert abs(head - (90.0 if thrust > 0.0 else -90.0)) <= 1e-9
            assert not stage.parts["turn"].get_visible()
            assert not stage.parts["weight"].get_visible()


def test_a_film_shows_all_loads() -> None:
    check_film_of_loads()
    seen = view.view(run("strut"))
    with style.drawing():
        stage = film._stage(seen, np.array([0.0, 2.0, 8.0]), 400)
        stage.show(1)
        assert all(stage.parts[name].get_visible() for name in ("arrow", "turn", "turn head", "weight", "weight heads"))


@pytest.mark.parametrize("name", ["rod", "pieces", "still"])
def test_every_rod_can_be_filmed(name: str, tmp_path: Path) -> None:
    path = film.film(run(name), tmp_path / "rod.gif", seconds=0.5, fps=8.0, width=240)
    with Image.open(path) as picture:
        assert picture.n_frames == 4


# -- histories ---------------------------------------------------------------------------------------------------------


def check_loops() -> None:
    """Curves are those of the tables, in mm, mN and degrees in SI; a load that stays is left out."""
    solution = run("let go")
    found = pl.force_displacement(solution)
    (ax,) = pl.plot(found).axes
    x, y = line(ax, "transverse")
    assert np.array_equal(x, found["deflection"].values / 1e-3)
    assert np.array_equal(y, found["transverse"].values / 1e-3)
    assert ax.get_xlabel() == "Free end across (mm)"
    assert ax.get_ylabel() == "Transverse force (mN)"
    strut = run("strut")
    assert len(pl.plot(pl.force_displacement(strut)).axes) == 2
    curves = pl.moment_curvature(strut, [0.0, 0.5])
    (ax,) = pl.plot(curves).axes
    for j, words in enumerate(("at the clamp", "at s = 0.5 L")):
        x, y = line(ax, words)
        assert np.array_equal(x, curves["curvature"].values[:, j])
        assert np.array_equal(y, curves["couple"].values[:, j])


def test_histories_are_drawn_as_they_are() -> None:
    check_loops()
    many = pl.plot(pl.moment_curvature(run("strut"), np.linspace(0.0, 1.0, 9))).axes[0]
    assert len(many.get_legend().get_texts()) == len(loops.LOOKS)


def test_a_run_without_loads_has_an_empty_history() -> None:
    (ax,) = pl.plot(run("still"), "force_displacement").axes
    assert ax.texts[0].get_text() == "No load acts."


# -- static shapes -----------------------------------------------------------------------------------------------------


def check_rest() -> None:
    """A static shape under all loads: rod, arcs, steps of the natural curvature, and the loads as arrows."""
    load = pl.Load.at_angle(1.0, "60 deg", couple=0.4, weight=1.5, weight_angle="90 deg")
    model = pl.Strut(material(), load, pl.Grid(nodes=8), natural_segments=(0.0, 0.25, 1.0))
    found = pl.rest(model, 0.1, (0.5, -0.2))
    left, right = pl.plot(found).axes
    x, y = line(left, "rod")
    assert np.hypot(x[-1] - found.tip[0], y[-1] - found.tip[1]) <= 1e-12
    s, steps = line(right, "natural curvature")
    assert s.tolist() == [0.0, 0.25, 0.25, 1.0]
    assert steps.tolist() == [0.5, 0.5, -0.2, -0.2]
    _, bent = line(left, "natural shape")
    assert bent[-1] > 0.0
    for label in ("_force", "_couple", "_weight"):
        assert line(left, label)[0].size >= 2
    head = np.array([line(left, "_force")[0], line(left, "_force")[1]])
    along = head[:, -1] - head[:, 0]
    assert np.abs(along / np.hypot(*along) - [-np.cos(np.pi / 3.0), np.sin(np.pi / 3.0)]).max() <= 1e-12
    assert ("stays" in str(pl.plot(found).get_suptitle())) == found.admissible


def test_static_shapes_show_segments_and_loads() -> None:
    check_rest()


@pytest.mark.parametrize("name", ["own time", "let go"])
@pytest.mark.parametrize("picture", ["free_end", "velocities", "reactions", "force_displacement", "moment_curvature"])
def test_every_axis_of_the_new_pictures_has_a_unit(name: str, picture: str) -> None:
    marks = ("× L", "/ L", "× T/L", "/ T", "/ EI") if name == "own time" else ("m)", "N)", "s)", "N·m)", "°)")
    named = [text for ax in pl.plot(run(name), picture).axes for text in (ax.get_xlabel(), ax.get_ylabel()) if text]
    assert len(named) >= 2
    assert all(any(mark in text for mark in marks) for text in named), named
