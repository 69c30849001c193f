"""Claim: modes are told in the user's units, with honest errors, in Python, pictures, files and on the command line."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import xarray

import plastica as pl
from plastica.errors import ArgumentError
from plastica.show.save import save_picture

from .commandline import call, scenario, si_scenario, snapshot, written
from .pictured import line
from .test_modes import BETA, ELASTIC, LOADS, beam_column, bent, near, rod

INERTIA = "translational_inertia = 1.0\nrotary_inertia = 1e-3\ndamping = 0.02"
SI_INERTIA = 'mass_per_length = "0.05 kg/m"'


# -- units, errors, places -----------------------------------------------------------------------------------------


def specimen() -> pl.Specimen:
    """A steel strip, 300 mm by 20 mm by 1 mm."""
    section = {"shape": "rectangle", "width": "20 mm", "thickness": "1 mm"}
    return pl.Specimen(
        length="300 mm", youngs_modulus="210 GPa", section=section, density="7850 kg/m**3", retardation_time="0.2 ms"
    )


def steel(load: pl.Load | None = None) -> pl.Rod:
    strip = specimen()
    laws = pl.catalogue.material("one-shape", length=strip.L, stiffness=strip.EI, time=strip.T)
    return pl.Rod(laws, load or pl.Load(), pl.Grid(24), specimen=strip)


def check_si() -> None:
    """Frequencies are those of the handbook, (beta/L)^2 (EI/rho A)^(1/2); the matrices are in SI."""
    model, found = steel(), pl.modes(steel(), count=4)
    strip = specimen()
    mass = 7850.0 * 20e-3 * 1e-3
    beta = np.sqrt(beam_column(0.0, float(model.rotary_inertia or 0.0) / float(model.translational_inertia or 1.0), 4))
    assert np.abs(beta - BETA).max() <= 1e-3
    near(found.frequencies, (beta / strip.L) ** 2 * np.sqrt(strip.EI / mass), 1e-11)
    near(found.hertz * 2.0 * np.pi, found.frequencies, 1e-11)
    # An ideal bend of 1/m over the rod stores EI L/2, and dissipates nu EI L times the square of its rate.
    ones = np.ones(found.mu.size)
    assert abs(ones @ found.stiffness @ ones - strip.EI * strip.L) <= 1e-13 * strip.EI * strip.L
    assert abs(ones @ found.damping @ ones - 0.2e-3 * strip.EI * strip.L) <= 1e-13 * strip.EI * strip.L
    near(np.diag(found.shapes @ found.mass @ found.shapes.T), 1.0, 1e-11)
    near(np.diag(found.shapes @ found.stiffness @ found.shapes.T), found.squares, 1e-11)
    # Turning the curvature by 1/m moves the parts of the rod by s^2/2.
    moved = mass * strip.L**5 / 20.0 + 7850.0 * 20e-3 * 1e-9 / 12.0 * strip.L**3 / 3.0
    near(ones @ found.mass @ ones, moved, 1e-11)


def check_shapes() -> None:
    """Curvature, angle and displacement of a mode belong together, at any place, and move the end to +y."""
    model, place = bent("every", nodes=24)
    found = pl.modes(model, place)
    s = np.linspace(0.0, 1.0, 2001)
    h = s[1]
    curvature, psi, (x, y) = found.curvature(s), found.angle(s), found.displacement(s)
    theta = model.grid.integration(s) @ found.mu
    for integral, integrand in ((psi, curvature), (x, -np.sin(theta) * psi), (y, np.cos(theta) * psi)):
        summed = np.cumsum(0.5 * h * (integrand[:, 1:] + integrand[:, :-1]), axis=1)
        assert np.all(integral[:, 0] == 0.0)
        assert np.abs(integral[:, 1:] - summed).max() <= 100.0 * h**2 * np.abs(integrand).max()
    assert np.all(y[:, -1] > 0.0)
    assert found.curvature(0.5).shape == (6,)
    with pytest.raises(ArgumentError, match="on the rod"):
        found.curvature(1.1)


def check_errors() -> None:
    """On too few nodes the error that is told is that which is made, within a factor of 2; and it is said."""
    exact = beam_column(0.0, 0.0, 6)
    found = pl.modes(rod(nodes=10), count=6)
    off = np.abs(found.frequencies - exact)
    assert np.all(off <= 2.0 * found.errors)
    assert np.all(found.errors[2:] <= 2.0 * off[2:])
    assert not found.resolved
    assert "Not all are resolved" in found.sentence


def check_nodes_are_chosen() -> None:
    """As many nodes as the modes need: 20 of them to 1e-10 of themselves, and no more than that takes."""
    few, many = (pl.modes(rod(nodes="auto"), count=count) for count in (2, 20))
    assert few.resolved
    assert many.resolved
    assert few.model.grid.size < many.model.grid.size <= 128
    near(many.frequencies[:4], np.array(beam_column(0.0, 0.0, 4)), 1e-11)


def test_si() -> None:
    check_si()


def test_shapes() -> None:
    check_shapes()


def test_errors() -> None:
    check_errors()


def test_nodes_are_chosen() -> None:
    check_nodes_are_chosen()


# -- where to linearise --------------------------------------------------------------------------------------------


def check_places() -> None:
    """A closed form, a static shape and a motion that came to rest there have the same modes, stable or not."""
    load = pl.Load(thrust=4.0)
    model = rod(load, 20, damping=1.0)
    exact = max(pl.equilibria_at(4.0, 0.0), key=lambda each: each.alpha)
    here = pl.modes(model, exact)
    assert here.stable
    for place in (
        pl.rest(model, 1.0),
        pl.rest(pl.Strut(ELASTIC, load, pl.Grid(40)), 1.0),
        pl.solve(model, 1.0, until=60.0, rtol=1e-6, method="Radau"),
    ):
        near(pl.modes(model, place).squares, here.squares, 1e-11)
    straight = pl.modes(model)
    assert (straight.unstable, here.unstable) == (1, 0)
    assert np.all(straight.mu == 0.0)
    assert straight.squares[0] < 0.0
    assert np.isnan(straight.frequencies[0])
    assert np.isnan(straight.damping_ratios[0])
    assert straight.eigenvalues[0, 0].real > 0.0
    assert "Unstable in 1 direction" in straight.sentence
    sagging = rod(pl.Load(transverse=0.7))
    near(pl.modes(sagging).squares, pl.modes(sagging, pl.rest(sagging)).squares, 1e-11)


def check_the_natural_curvature_is_held() -> None:
    """Where the drive exceeds the threshold the sentence says that the shape does not stay."""
    soft = pl.Material("m**2/2", "pos(x)**2", "0.1")
    model = pl.Rod(soft, pl.Load(transverse=1.0), translational_inertia=1.0)
    assert not pl.modes(model).stays
    assert "the natural curvature moves" in pl.modes(model).sentence
    assert pl.modes(rod(pl.Load(transverse=1.0))).stays


def test_places() -> None:
    check_places()


def test_the_natural_curvature_is_held() -> None:
    check_the_natural_curvature_is_held()


def test_loads_that_have_settled_are_held() -> None:
    load = pl.Load(thrust=([0.0, 1.0, 2.0], [0.0, 4.0, 1.0]))
    model = rod(load, damping=0.5)
    run = pl.solve(model, 0.1, until=60.0, rtol=1e-8, method="Radau")
    near(pl.modes(model, run).squares, pl.modes(rod(pl.Load(thrust=1.0))).squares, 1e-11)


def test_mistakes() -> None:
    model, place = bent("every")
    other = rod(LOADS["thrust"])
    moving = pl.solve(rod(damping=0.1), 0.5, until=0.5, rtol=1e-4, method="Radau")
    two = rod(LOADS["every"], natural_segments=2)
    for rule, arguments in {
        r"pl\.Rod or a pl\.Strut": ("a rod",),
        r"None, a pl\.Equilibrium": (model, 1.0),
        r"\[1, 100\]": (model, place, 0),
        "number of nodes, 20": (model, place, 21),
        "at rest under its loads": (other, place),
        "still moves": (rod(damping=0.1), moving),
        "natural segments": (two, place),
        "must be the thrust of the rod": (other, pl.equilibrium(ELASTIC, 1.8, 0.0)),
        "a thrust alone": (model, pl.equilibrium(ELASTIC, 1.1, 0.0)),
    }.items():
        with pytest.raises(ArgumentError, match=rule):
            pl.modes(*arguments)  # type: ignore[arg-type]


# -- datasets and pictures -----------------------------------------------------------------------------------------


def test_dataset_and_words(tmp_path: Path) -> None:
    found = pl.modes(steel(pl.Load(transverse="2 N")))
    data = found.to_dataset()
    assert data.frequency.attrs["units"] == "rad/s"
    assert all(each.attrs["long_name"] and each.attrs["units"] for each in data.data_vars.values())
    near(data.mass.values, found.mass, 1e-11)
    data.to_netcdf(tmp_path / "modes.nc", engine="h5netcdf")
    with xarray.open_dataset(tmp_path / "modes.nc", engine="h5netcdf") as read:
        assert np.array_equal(read.frequency.values, found.frequencies)
    assert f"{found.frequencies[2]:.12g}" in str(found)
    assert found.sentence in str(found)


def check_picture() -> None:
    """Each shape is the rod at rest plus the mode, drawn at 0.22 L; damping ratios stand over the frequencies."""
    for found, length, milli in ((pl.modes(*bent("every", damping=0.01)), 1.0, 1.0), (pl.modes(steel()), 0.3, 1e-3)):
        figure = pl.plot(found)
        *shapes, strain, numbers = figure.axes
        assert len(shapes) == 4
        for k, ax in enumerate(shapes):
            x, y = (np.stack(each) for each in zip(line(ax, "at rest"), line(ax, "displaced"), strict=True))
            moved = np.hypot(x[1] - x[0], y[1] - y[0]) * milli / length
            assert abs(moved.max() - 0.22) <= 1e-12
            u, v = (part[k] for part in found.displacement(np.linspace(0.0, length, x.shape[1])))
            near((y[1] - y[0]) / moved.max() * milli / length, v / np.hypot(u, v).max(), 1e-11)
        s, curvature = line(strain, "mode 2")
        due = found.curvature(np.clip(s * milli, 0.0, length))[1]
        near(curvature, due / np.abs(due).max(), 1e-11)
        frequency, ratio = line(numbers, "modes")
        near(frequency, found.frequencies if length == 1.0 else found.hertz, 1e-11)
        near(ratio, found.damping_ratios, 1e-11)


def test_picture(tmp_path: Path) -> None:
    check_picture()
    for name, found in {
        "unstable": pl.modes(rod(pl.Load(thrust=3.0)), count=5),
        "strut": pl.modes(pl.Strut(ELASTIC, pl.Load(thrust=3.0)), count=3),
        "one": pl.modes(rod(damping=1.0), count=1),
    }.items():
        assert save_picture(found, tmp_path / f"{name}.svg").stat().st_size > 5000


# -- the command line ----------------------------------------------------------------------------------------------


def with_inertia(**changed: str | None) -> str:
    return scenario(**{"inertia": INERTIA, **changed})


def facts(*arguments: str | Path) -> dict[str, Any]:
    answer = call("modes", *arguments, "--json")
    assert (answer.code, answer.err) == (0, "")
    return dict(json.loads(answer.out))


def frequencies(found: dict[str, Any]) -> np.ndarray:
    return np.array([each["frequency"] for each in found["modes"]], dtype=float)


def check_command(folder: Path) -> None:
    """The numbers are those of pl.modes about the static shape, from the start, under the loads that are held."""
    file = written(folder, with_inertia(load="thrust = 2.0\ntransverse = 0.3", grid='nodes = "auto"'))
    model = rod(pl.Load(thrust=2.0, transverse=0.3), "auto", rotary_inertia=1e-3, damping=0.02)
    due = pl.modes(model, pl.rest(model, 0.1, 0.1), count=3)
    found = facts(file, "--count", "3")
    near(frequencies(found), due.frequencies, 1e-11)
    near(np.array([each["damping_ratio"] for each in found["modes"]]), due.damping_ratios, 1e-11)
    assert found["held"]["why"] == "they are constant"
    table = call("modes", file, "--count", "3")
    assert table.code == 0
    assert f"{due.frequencies[1]:.10g}" in table.out
    assert "swings" in table.out


def check_loads_held(folder: Path) -> None:
    """What is left of the loads in the end; else those of the start, or of the time that is asked for."""
    ramp = 'program = "table", times = [0.0, 1.0, 1.5], values = [0.5, 2.0, 1.0]'
    file = written(folder, with_inertia(load=f"thrust = {{ {ramp} }}", initial="curvature = 0.0"))
    swing = written(folder, with_inertia(load='thrust = "1 + sin(t)"', initial="curvature = 0.0"), "swing.toml")
    for path, options, thrust in ((file, (), 1.0), (file, ("--at", "1.0"), 2.0), (swing, (), 1.0)):
        due = pl.modes(rod(pl.Load(thrust=thrust), 12, rotary_inertia=1e-3))
        near(frequencies(facts(path, *options)), due.frequencies, 1e-11)


def test_command(tmp_path: Path) -> None:
    check_command(tmp_path)


def test_loads_held(tmp_path: Path) -> None:
    check_loads_held(tmp_path)


def test_command_in_si(tmp_path: Path) -> None:
    file = written(tmp_path, si_scenario(inertia=SI_INERTIA, load='thrust = "0 N"', initial='curvature = "0 1/m"'))
    found = facts(file, "--at", "10 s")
    near(frequencies(found)[:2], (np.array(beam_column(0.0, 0.0, 2)) / 0.25**2) * np.sqrt(0.035 / 0.05), 1e-11)
    assert found["units"]["frequency"] == "rad/s"
    answer = call("modes", file, "--plot", tmp_path / "modes.png")
    assert "modes.png" in answer.out
    assert (tmp_path / "modes.png").stat().st_size > 5000
    assert "does not swing" in answer.out


def test_command_on_an_unstable_rod(tmp_path: Path) -> None:
    file = written(tmp_path, with_inertia(load="thrust = 3.0", initial="curvature = 0.0"))
    answer = call("modes", file)
    assert answer.code == 0
    assert "grows" in answer.out
    assert facts(file)["modes"][0]["frequency"] is None


@pytest.mark.parametrize(
    ("text", "options", "said"),
    [
        (scenario(), (), "inertia` must be there"),
        (with_inertia(load="trust = 1.0"), (), "Did you mean `thrust`?"),
        (with_inertia(), ("--at", "soon"), "--at"),
        (with_inertia(), ("--at", "-1"), "before the start"),
        (with_inertia(), ("--count", "0"), "--count"),
        (with_inertia(), ("--count", "13"), "number of nodes, 12"),
        (with_inertia(), ("--plot", "modes.gif"), "--plot"),
        (si_scenario(inertia=SI_INERTIA), ("--at", "5"), "must carry a unit"),
    ],
)
def test_mistakes_on_the_command_line(text: str, options: tuple[str, ...], said: str, tmp_path: Path) -> None:
    file = written(tmp_path, text)
    before = snapshot(tmp_path)
    answer = call("modes", file, *options, folder=tmp_path)
    assert (answer.code, answer.out) == (2, "")
    assert said in answer.err
    assert "Traceback" not in answer.err
    assert snapshot(tmp_path) == before
