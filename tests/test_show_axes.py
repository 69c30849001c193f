"""Claim: pictures have units that one can read, and colours that everyone can tell apart."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from matplotlib import colormaps
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure

import plastica as pl
from plastica.show import axes, plots, style, view

from .pictured import FIGURES, run, strut
from .support import EPS

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
        ("m/s", 3.0, 1.0, "m/s"),
        ("m/s", 0.02, 1e-3, "mm/s"),
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
        (87600.0, "1 d 0 h 20 min"),
        (25934400.0, "300 d 4 h"),
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
    ("stored", "work", "viscous", "dissipation", "liapunov", "kinetic"),
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
