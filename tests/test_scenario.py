"""Claim: a scenario means what it says, all its mistakes are found at once, and former versions are read."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import plastica as pl
from plastica.errors import ArgumentError, InadmissibleError, ScenarioError
from plastica.motion.store import read
from plastica.study import scenario as study
from plastica.study.run import run
from plastica.study.scenario import migrated, read_scenario
from tests.commandline import scenario, si_scenario, written
from tests.support import DATA, EPS


def problems(folder: Path, text: str) -> tuple[str, ...]:
    with pytest.raises(ScenarioError) as caught:
        read_scenario(written(folder, text))
    return caught.value.problems


# -- meaning -------------------------------------------------------------------------------------------------------


def test_a_scenario_is_the_call_that_it_describes(tmp_path: Path) -> None:
    finished = run(written(tmp_path, scenario(solve="until = 2.0\nrtol = 1e-9")), tmp_path / "out")
    strut = pl.Strut(pl.catalogue.material("one-shape"), pl.Load(thrust=2.0), pl.Grid(nodes=12))
    direct = pl.solve(strut, curvature=0.1, natural_curvature=0.1, until=2.0, rtol=1e-9)
    assert np.array_equal(finished.solution.history.y, direct.history.y)
    assert finished.solution.status == direct.status


def check_units_change_nothing(folder: Path) -> None:
    """The same rod in SI and without units: one dimensionless motion."""
    plain = run(written(folder, scenario()), folder / "plain").solution
    si = run(written(folder, si_scenario(), "si.toml"), folder / "si").solution
    t = np.linspace(0.0, 2.0, 21)
    difference = np.abs(si.history(t) - plain.history(t)).max()
    # Scales and their quotients round in the last place; the steps may then differ by the tolerance of the run.
    assert difference <= 100.0 * plain.rtol * np.abs(plain.history.y).max()
    assert abs(si.dataset["t"].values[-1] - 240.0) <= 4.0 * EPS * 240.0
    assert si.dataset["curvature"].attrs["units"] == "1/m"


def test_units_change_nothing(tmp_path: Path) -> None:
    check_units_change_nothing(tmp_path)


def test_the_result_holds_the_scenario(tmp_path: Path) -> None:
    text = scenario(output='name = "mine"\nfilm = "none"\nreport = false\ncsv = ["tip_y", "curvature"]')
    finished = run(written(tmp_path, text), tmp_path / "out")
    assert sorted(path.name for path in (tmp_path / "out").iterdir()) == [
        "mine-curvature.csv",
        "mine-tip_y.csv",
        "mine.nc",
    ]
    again = read(tmp_path / "out" / "mine.nc")
    assert again == finished.solution
    assert again.provenance["scenario"] == text
    assert again.provenance["scenario_file"] == "strut.toml"
    assert again.provenance["title"] == "A strut"


def test_one_run_goes_on_where_another_has_ended(tmp_path: Path) -> None:
    run(written(tmp_path, scenario(load="thrust = 3.0", solve="until = 5.0")), tmp_path / "out" / "hold")
    release = scenario(load="thrust = 0.0", initial='result = "out/hold/strut.nc"', solve="until = 8.0")
    second = run(written(tmp_path, release, "release.toml"), tmp_path / "out" / "release").solution
    first = read(tmp_path / "out" / "hold" / "strut.nc")
    n = first.grid.size
    assert np.array_equal(second.history.y[0][: n + 1], first.history.y[-1][: n + 1])
    assert second.history.start == 5.0


def test_pieces_and_breaks(tmp_path: Path) -> None:
    text = scenario(initial='curvature = { pieces = [1.0, "-s"], breaks = [0.5] }', grid="breaks = [0.25]\nnodes = 8")
    read_in = read_scenario(written(tmp_path, text))
    assert read_in.problem.strut.grid.breaks == (0.0, 0.25, 0.5, 1.0)
    s, mu = read_in.problem.strut.grid.s, read_in.problem.y0[:24]
    assert np.array_equal(mu, np.where(s < 0.5, 1.0, -s))


def test_times(tmp_path: Path) -> None:
    def times(text: str) -> Any:
        found = read_scenario(written(tmp_path, scenario(solve=f"until = 2.0\ntimes = {text}")))
        return found.times

    assert times("[0.5, 2.0]").tolist() == [0.5, 2.0]
    assert np.array_equal(times("{ count = 5 }"), np.linspace(0.0, 2.0, 5))
    log = times('{ count = 5, spacing = "log", first = 0.002 }')
    assert (log[0], log[-1]) == (0.0, 2.0)
    assert np.allclose(log[2:] / log[1:-1], 10.0, rtol=100.0 * EPS, atol=0.0)


def test_inadmissible_materials_need_leave(tmp_path: Path) -> None:
    laws = 'preference = "m**2/2"\nflow = "pos(x)"\nthreshold = "0.1"'
    with pytest.raises(InadmissibleError, match=r"line 6: `material\.flow` .*jumps by 1 at x = 0"):
        read_scenario(written(tmp_path, scenario(material=laws)))
    finished = run(written(tmp_path, scenario(material=f"{laws}\nallow_inadmissible = true")), tmp_path / "out")
    assert finished.solution.notes[0].startswith("hypothesis waived by allow_inadmissible: The flow law must")


def test_laws_in_si_have_units(tmp_path: Path) -> None:
    laws = 'preference = "k*m**2/2"\nflow = "c*pos(x)**n"\nthreshold = "h"\n'
    good = 'parameters = { k = "0.035 N*m**2", c = "1 1/(N**2*m**5*s)", n = 2, h = "0.0035 N*m**2" }'
    assert read_scenario(written(tmp_path, si_scenario(material=laws + good))).model.material.values["n"] == 2.0
    bad = good.replace('"0.0035 N*m**2"', "0.0035")
    (sentence,) = problems(tmp_path, si_scenario(material=laws + bad))
    assert sentence.startswith(
        "line 11: `material.threshold` must come to N*m**2, but 'h' with h without a unit comes to 1."
    )


# -- mistakes ------------------------------------------------------------------------------------------------------


def check_all_mistakes_at_once(folder: Path) -> None:
    text = """schema = 1
titel = "misspelt"
units = "SI"
thrust = "3 N"
[specimen]
length = 250
section = { shape = "rectangl", thicknes = "1 mm" }
[material]
name = "one-shap"
[load]
thrust = { program = "ramp-hold-release", value = "0.5 s", ramp = "10 s", hold = 3 }
couple = "3 N"
[initial]
curvature = "0.4 1/m +"
[grid]
nodes = 1_000_000
breaks = ["1 m",
  "2 kg"]
[output]
name = "../x"
"""
    keys = [
        ("", "solve"),
        ("line 2: ", "titel"),
        ("line 4: ", "thrust"),
        ("line 5: ", "specimen.retardation_time"),
        ("line 6: ", "specimen.length"),
        ("line 7: ", "specimen.section.shape"),
        ("line 7: ", "specimen.section.thicknes"),
        ("line 9: ", "material.name"),
        ("line 11: ", "load.thrust.value"),
        ("line 11: ", "load.thrust.hold"),
        ("line 11: ", "load.thrust.release"),
        ("line 12: ", "load.couple"),
        ("line 14: ", "initial.curvature"),
        ("line 16: ", "grid.nodes"),
        ("line 18: ", "grid.breaks[1]"),
        ("line 20: ", "output.name"),
    ]
    with pytest.raises(ScenarioError) as caught:
        read_scenario(written(folder, text))
    found = caught.value.problems
    assert [sentence[: sentence.index("` ") + 1] for sentence in found] == [f"{line}`{key}`" for line, key in keys]
    assert "16 mistakes" in str(caught.value)
    assert "Did you mean `title`?" in found[1]
    assert "belongs into [load]" in found[2]
    assert 'such as "250 mm", but is 250.' in found[4]
    assert 'Did you mean "one-shape"?' in found[7]


def test_all_mistakes_at_once(tmp_path: Path) -> None:
    check_all_mistakes_at_once(tmp_path)


def test_mistakes_that_only_the_whole_rod_shows(tmp_path: Path) -> None:
    def keys(**parts: str) -> list[str]:
        return [sentence.split("`")[1] for sentence in problems(tmp_path, scenario(**parts))]

    csv = 'csv = ["volume_fraction"]'
    assert keys(load='thrust = "2*cos(t)"', output=csv) == ["load.thrust", "output.csv[0]"]
    assert keys(initial='curvature = "sqrt(s - 0.5)"', output=csv) == ["initial.curvature", "output.csv[0]"]


def test_auto_nodes_are_refused_where_they_could_not_grow(tmp_path: Path) -> None:
    breaks = ", ".join(f"{i / 20:.2f}" for i in range(1, 20))
    (sentence,) = problems(tmp_path, scenario(grid=f"breaks = [{breaks}]"))
    assert "`grid.nodes` must be a number where there are more than 16 elements" in sentence


def test_mp4_needs_ffmpeg(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    file = written(tmp_path, scenario(output='film = "mp4"'))
    monkeypatch.setattr("shutil.which", lambda _name: None)
    with pytest.raises(ScenarioError, match=r"`output\.film` .*ffmpeg"):
        read_scenario(file)
    monkeypatch.setattr("shutil.which", lambda name: f"/usr/bin/{name}")
    assert read_scenario(file).output.film == "mp4"


# -- versions ------------------------------------------------------------------------------------------------------


def test_version_1_is_read_for_ever() -> None:
    found = read_scenario(DATA / "scenario_v1.toml")
    strut, grid = found.model, found.problem.strut.grid
    assert found.title == "Everything that version 1 knows"
    assert found.name == "strip"
    assert strut.specimen is not None
    assert abs(strut.specimen.EI - 0.0135) <= 8.0 * EPS * 0.0135
    assert strut.material.values == {"k": 0.0135, "c": 183.0, "h": 0.00135}
    assert (strut.load.thrust(3000.0), strut.load.thrust(1.0)) == (0.5, 0.1)
    assert strut.load.transverse(30.0) == 0.005
    assert strut.load.couple(200.0) == 0.001
    assert abs(strut.load.weight(60.0) - 0.1 * (1.0 - np.exp(-1.0))) <= 4.0 * EPS
    assert (grid.per_element, grid.breaks) == (16, (0.0, 0.2, 0.5, 1.0))
    assert np.allclose(found.problem.y0[:32], 0.1, rtol=4.0 * EPS, atol=0.0)
    assert found.problem.y0[48] == 0.05
    assert (found.until, found.rtol, found.atol, found.method, found.max_steps) == (
        "2 hours",
        1e-7,
        1e-9,
        "DOP853",
        5000,
    )
    assert found.times is not None
    assert (found.times[0], found.times[1], found.times[-1], len(found.times)) == (0.0, 1.0, 7200.0, 25)
    assert (found.output.film, found.output.report) == ("none", False)
    assert found.output.csv == ["natural_curvature", "tip_y"]
    assert found.allow_inadmissible


def test_versions_are_migrated_one_by_one() -> None:
    steps = {
        1: lambda data: {"b": data["a"] + 1},
        2: lambda data: {"c": data["b"] * 10},
    }
    assert migrated({"schema": 1, "a": 1}, steps, 3) == {"c": 20}
    assert migrated({"a": 1}, steps, 3) == {"c": 20}
    assert migrated({"schema": 2, "b": 1}, steps, 3) == {"c": 10}
    assert migrated({"schema": 3, "c": 1}, steps, 3) == {"c": 1}
    for version in (4, 0, True, "1", 1.0):
        with pytest.raises(ArgumentError, match="schema"):
            migrated({"schema": version}, steps, 3)


def test_every_former_version_has_its_migration() -> None:
    assert set(study.MIGRATIONS) == set(range(1, study.SCHEMA))
