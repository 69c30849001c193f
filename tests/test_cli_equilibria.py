"""Claim: the commands on equilibria and charts tell what the library finds, in the user's units."""

from __future__ import annotations

import dataclasses
import json
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import plastica as pl
from tests.commandline import call, scenario, si_scenario, snapshot, written

LENGTH, STIFFNESS, TIME = 0.25, 0.035, 120.0
FORCE = STIFFNESS / LENGTH**2
EPS = float(np.finfo(float).eps)
MATERIAL = pl.catalogue.material("one-shape")

COMMANDS = ("equilibria", "spectrum", "phase-diagram", "capacity")
QUICK = {
    "phase-diagram": ("--gamma", "0:3", "--alpha=-3:3", "--shape", "30"),
    "capacity": ("--gamma", "1:2", "--count", "2"),
}


def told(command: str, file: Path, *options: str | Path) -> dict[str, Any]:
    answer = call(command, file, "--json", *options)
    assert (answer.code, answer.err) == (0, "")
    facts: dict[str, Any] = json.loads(answer.out)
    return facts


def near(found: Any, expected: Any) -> None:
    assert np.abs(np.subtract(found, expected)).max() <= 8.0 * EPS * max(1.0, float(np.abs(expected).max()))


# -- what is told is what is found -----------------------------------------------------------------------------------


def check_equilibria(folder: Path) -> None:
    """All intervals, limiting equilibria and folds, in 1/m and N m^2 besides in SI."""
    found = pl.equilibria(MATERIAL, 3.0)
    facts = told("equilibria", written(folder, scenario(load="thrust = 3.0")))
    assert facts["complete"]
    near([each["alpha"] for each in facts["intervals"]], found.intervals)
    near([each["alpha"] for each in facts["limiting"]], [p.alpha for p in found.limiting])
    assert [each["standing"] for each in facts["limiting"]].count("motions end here") == 4
    near([each["natural_curvature"] for each in facts["folds"]], [f.mu_nat for f in found.folds])
    facts = told("equilibria", written(folder, si_scenario(), "si.toml"), "--gamma", "3")
    assert facts["units"] == {"force": "N", "curvature": "1/m", "length": "m", "drive": "N*m**2", "time": "s"}
    near(facts["load"]["thrust"], 3.0 * FORCE)
    in_si = [each["clamp_curvature"] * LENGTH for each in facts["limiting"]]
    assert np.abs(np.subtract(in_si, [p.alpha for p in found.limiting])).max() <= 1e-10
    assert np.abs(np.abs([each["drive"] for each in facts["limiting"]]) / STIFFNESS - 0.1).max() <= 1e-10


def test_equilibria(tmp_path: Path) -> None:
    check_equilibria(tmp_path)


def test_table_of_equilibria(tmp_path: Path) -> None:
    answer = call("equilibria", written(tmp_path, si_scenario()), "--thrust", "1.68 N")
    assert (answer.code, answer.err) == (0, "")
    for said in (
        "A strip",
        "1.68 N, 3 EI/L², 1.216 Euler loads",
        "as given",
        "motions end here",
        "saddle: unstable in 1 direction",
        "snaps here",
    ):
        assert said in answer.out
    assert "clamp [1/m]" in answer.out
    plain = call("equilibria", written(tmp_path, scenario(), "plain.toml"))
    assert "the largest of the scenario" in plain.out
    assert "[1/m]" not in plain.out


def check_thrust_held(folder: Path) -> None:
    """The largest thrust of the program, unless one is given in N, in its own numbers, or in EI/L^2."""
    program = '{ program = "ramp-hold-release", value = "1.4 N", ramp = "10 s", hold = "60 s", release = "0 s" }'
    file = written(folder, si_scenario(load=f"thrust = {program}"))
    near(told("equilibria", file)["load"]["gamma"], 1.4 / FORCE)
    near(told("equilibria", file, "--thrust", "500 mN")["load"]["gamma"], 0.5 / FORCE)
    near(told("equilibria", file, "--gamma", "1.5")["load"]["thrust"], 1.5 * FORCE)
    near(told("equilibria", written(folder, scenario(), "plain.toml"), "--thrust", "1.5")["load"]["gamma"], 1.5)


def test_thrust_held(tmp_path: Path) -> None:
    check_thrust_held(tmp_path)


def check_spectrum(folder: Path) -> None:
    """Eigenvalues of the equilibrium named, or of the static shape that the start comes to, per second in SI."""
    file = written(folder, si_scenario())
    found = pl.spectrum(pl.equilibrium(MATERIAL, 2.0, 0.75), 4)
    facts = told("spectrum", file, "--alpha", "3 1/m", "--count", "4")
    near([each["value"] for each in facts["eigenvalues"]], found.eigenvalues)
    near([each["rate"] * TIME for each in facts["eigenvalues"]], found.eigenvalues)
    assert facts["unstable"] == found.unstable
    assert facts["zero_multiplicity"] == 1
    rest = pl.rest(pl.Strut(MATERIAL, pl.Load(thrust=2.0), pl.Grid(nodes=24)), 0.1, 0.1)
    facts = told("spectrum", file)
    assert abs(facts["equilibrium"]["natural_curvature"] * LENGTH - 0.1) <= 1e-12
    assert abs(facts["equilibrium"]["alpha"] - rest.at(0.0)) <= 1e-9
    near(facts["equilibrium"]["clamp_curvature"] * LENGTH, facts["equilibrium"]["alpha"])
    assert not facts["unstable"]
    assert "dies out" in call("spectrum", file).out


def test_spectrum(tmp_path: Path) -> None:
    check_spectrum(tmp_path)


def test_spectrum_of_a_buckled_start_is_that_of_its_own_side(tmp_path: Path) -> None:
    up = written(tmp_path, scenario(load="thrust = 4.0", initial="curvature = 0.5"), "up.toml")
    down = written(tmp_path, scenario(load="thrust = 4.0", initial="curvature = -0.5"), "down.toml")
    one, other = (told("spectrum", file)["equilibrium"]["alpha"] for file in (up, down))
    assert one > 1.0
    assert abs(one + other) <= 1e-12


def check_phase(folder: Path) -> None:
    """The components, tangencies and cusps of the diagram; a picture with the path of a run."""
    file = written(folder, scenario(load="thrust = 3.0"))
    options = ("--gamma", "0:5", "--alpha=-6:6", "--shape", "60")
    found = pl.phase_diagram(MATERIAL, (0.0, 5.0), (-6.0, 6.0), (60, 60))
    facts = told("phase-diagram", file, *options)
    assert len(facts["components"]) == len(found.components)
    near([each["gamma"] for each in facts["tangencies"]], [p.gamma for p in found.tangencies])
    near([each["natural_curvature"] for each in facts["cusps"]], [p.mu_nat for p in found.cusps])
    near(facts["admissible_share"], np.mean(found.admissible))
    assert call("run", file, "--output", folder / "out", "--quiet").code == 0
    bare, with_path = folder / "bare.svg", folder / "path.svg"
    told("phase-diagram", file, *options, "--plot", bare)
    told("phase-diagram", file, *options, "--plot", with_path, "--result", folder / "out" / "strut.nc")
    assert len(with_path.read_bytes()) > len(bare.read_bytes())
    assert "cusp" in call("phase-diagram", file, *options).out


def test_phase_diagram(tmp_path: Path) -> None:
    check_phase(tmp_path)


def check_capacity(folder: Path) -> None:
    """The chart of the library, with the three critical thrusts in N."""
    file = written(folder, si_scenario())
    options = ("--thrust", f"{1.5 * FORCE} N:{2.2 * FORCE} N", "--count", "2")
    facts = told("capacity", file, *options)
    found = pl.capacity(MATERIAL, [1.5, 2.2])
    assert facts["rows"][0]["largest"] is None, "any imperfection is borne below the gap"
    borne = float(found["largest"].values[1])
    assert abs(facts["rows"][1]["largest"] / borne - 1.0) <= 1e-5
    near(facts["rows"][1]["largest_imperfection"] * LENGTH, facts["rows"][1]["largest"])
    for name in ("gamma_star", "gamma_star_star", "euler"):
        assert abs(facts["critical"][name]["gamma"] / found.attrs[name] - 1.0) <= 1e-12
        near(facts["critical"][name]["thrust"], facts["critical"][name]["gamma"] * FORCE)
    answer = call("capacity", file, *options)
    assert "any tried" in answer.out
    assert "the shapes near the straight one split beyond" in answer.out
    assert "a bow was seen to creep away from" in answer.out
    near(facts["leaves_from"]["gamma"], 2.2)


def test_capacity(tmp_path: Path) -> None:
    check_capacity(tmp_path)


def test_capacity_of_a_shape_over_its_own_range(tmp_path: Path) -> None:
    facts = told("capacity", written(tmp_path, scenario()), "--imperfection", "cos(pi*s/2)", "--count", "3")
    assert facts["imperfection"] == "cos(pi*s/2)"
    thrusts = [row["gamma"] for row in facts["rows"]]
    opens = facts["critical"]["gamma_star_star"]["gamma"]
    assert thrusts[0] < opens < thrusts[1] < 1.01 * opens
    assert thrusts[2] > facts["critical"]["euler"]["gamma"]


# -- pictures, mistakes ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("command", COMMANDS)
def test_plot_writes_a_picture_and_says_so(command: str, tmp_path: Path) -> None:
    file = written(tmp_path, scenario())
    answer = call(command, file, *QUICK.get(command, ()), "--plot", "x.png", folder=tmp_path)
    assert (answer.code, answer.err) == (0, "")
    assert "x.png" in answer.out
    assert (tmp_path / "x.png").read_bytes().startswith(b"\x89PNG")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["strut.toml", "x.png"]


MISTAKES = [
    ("equilibria", ("--gamma", "-1"), "`--gamma` must be a thrust, at least 0"),
    ("equilibria", ("--gamma", "nan"), "`--gamma` must be a thrust"),
    ("equilibria", ("--gamma", "2", "--thrust", "2"), "must not be given together with --thrust"),
    ("equilibria", ("--thrust", "2 N"), "must be a plain number in a dimensionless scenario"),
    ("equilibria", ("--gamma", "1e9"), "gamma"),
    ("equilibria", ("--plot", "x.jpg"), "must end in one of .png, .svg, .pdf"),
    ("equilibria", ("--plot", "no/x.png"), "must be a file in a folder that exists"),
    ("spectrum", ("--alpha", "big"), "`--alpha` must be a plain number"),
    ("spectrum", ("--alpha", "nan"), "`--alpha` must be finite"),
    ("spectrum", ("--count", "0"), "--count"),
    ("phase-diagram", ("--gamma", "3:2"), "must be a range LO:HI with LO below HI"),
    ("phase-diagram", ("--gamma", "-1:2"), "must be a range LO:HI"),
    ("phase-diagram", ("--alpha", "1"), "must be a range LO:HI"),
    ("phase-diagram", ("--shape", "3"), "--shape"),
    ("phase-diagram", ("--result", "none.nc"), "none.nc"),
    ("capacity", ("--gamma", "1:2", "--thrust", "1:2"), "must not be given together"),
    ("capacity", ("--imperfection", "__import__('os')"), "imperfection"),
    ("capacity", ("--imperfection", "cos(q)"), "q"),
]


@pytest.mark.parametrize(("command", "options", "said"), MISTAKES, ids=lambda each: str(each)[:40])
def test_mistakes(command: str, options: tuple[str, ...], said: str, tmp_path: Path) -> None:
    file = written(tmp_path, scenario())
    before = snapshot(tmp_path)
    answer = call(command, file, *options, folder=tmp_path)
    assert (answer.code, answer.out) == (2, "")
    assert said in answer.err
    assert "Traceback" not in answer.err
    assert snapshot(tmp_path) == before


@pytest.mark.parametrize("command", COMMANDS)
@pytest.mark.parametrize(
    ("changed", "said"),
    [
        ({"load": "thrust = 1.0\ntransverse = 0.1"}, "must be a thrust alone"),
        ({"load": "trust = 1.0"}, "Did you mean `thrust`?"),
        ({"material": 'name = "no-such"'}, "no-such"),
    ],
    ids=["another load", "unknown key", "unknown material"],
)
def test_mistakes_in_the_scenario(command: str, changed: dict[str, str | None], said: str, tmp_path: Path) -> None:
    answer = call(command, written(tmp_path, scenario(**changed)), "--json")
    assert (answer.code, answer.out) == (2, "")
    assert said in answer.err
    assert "strut.toml" in answer.err


def test_numbers_with_a_unit_are_asked_for_in_si(tmp_path: Path) -> None:
    file = written(tmp_path, si_scenario())
    for command, options in (("equilibria", ("--thrust", "1")), ("capacity", ("--thrust", "1:2"))):
        answer = call(command, file, *options)
        assert answer.code == 2
        assert "must carry a unit such as N" in answer.err
    assert call("equilibria", file, "--thrust", "1 m").code == 2


def test_what_cannot_be_searched_completely_is_a_failure(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    catalog = sys.modules["plastica.equilibria.catalog"]
    sound = catalog.equilibria

    def partial(*arguments: Any, **options: Any) -> Any:
        return dataclasses.replace(sound(*arguments, **options), complete=False, sentence="Not all of it was searched.")

    monkeypatch.setattr(catalog, "equilibria", partial)
    answer = call("equilibria", written(tmp_path, scenario()))
    assert answer.code == 1
    assert answer.err == "plastica: Not all of it was searched.\n"
    assert "Not all of it was searched." in answer.out
