"""Claim: what `check` accepts, `run` accepts; what it refuses, `run` refuses; and the templates are accepted."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from plastica.errors import ScenarioError
from plastica.study.scenario import Scenario, read_scenario
from plastica.study.template import template
from tests.commandline import call, scenario, written

FORMS: dict[str, tuple[str, ...]] = {
    "material": ('name = "one-shape"', 'name = "three-shapes"', 'name = "hardening"\nparameters = { h = 0.05 }'),
    "load": (
        "thrust = 2.4",
        'thrust = "1 + step(t - 0.3)"\ntransverse = 0.1',
        'thrust = { program = "cycles", low = 0.0, high = 3.0, period = 0.2, count = 3, shape = "square" }',
        'thrust = { program = "table", times = [0.0, 0.3, 0.3], values = [0, 3, 0] }\ncouple = -0.2',
        'weight = { program = "ramp-hold-release", value = 2.0, ramp = 0.1, hold = 0.2, release = 0.0 }',
        'thrust = { program = "expression", text = "a*sin(b*t)**2", parameters = { a = 2.0, b = 9.0 } }',
        "thrust = -1.0",
        'force = "sin(9*t)"\nangle = "135 deg"\nweight = 2.0\nweight_angle = -1.2',
        "thrust = -1.0\nallow_tension = true",
        "force = 1.0",
        "",
    ),
    "initial": (
        "curvature = 0.1",
        'curvature = "1 + cos(3*s)"\nnatural_curvature = -0.3',
        'curvature = { pieces = [1.0, "-s"], breaks = [0.3] }',
        'curvature = "sqrt(s - 0.2)"',
        "natural_curvature = [0.3, -0.1]",
        "",
    ),
    "grid": (
        'nodes = "auto"',
        "nodes = 2",
        "nodes = 9\nbreaks = [0.1, 0.2]",
        "nodes = 1",
        "nodes = 6\nnatural_segments = 2",
        "",
    ),
    "solve": (
        "until = 0.5",
        "until = 0.5\ntimes = [0.1, 0.5]",
        'until = 0.5\nmethod = "Radau"\nrtol = 1e-6',
        'until = "equilibrium"\nrtol = 1e-3\nmax_steps = 400',
        "until = 0.5\nmax_steps = 3\ntimes = [0.4]",
        'until = 0.5\ntimes = { count = 7, spacing = "log" }\natol = 1e-6',
        "until = -1.0",
    ),
    "output": ('csv = ["tip_y"]', 'csv = ["volume_fraction"]', 'name = "x"', ""),
}


SWINGING: dict[str, tuple[str | None, ...]] = {
    "inertia": (
        "translational_inertia = 0.1",
        "translational_inertia = 1.0\nrotary_inertia = 0.01\ndamping = 0.0",
        "rotary_inertia = 0.1\ndamping = 0.3",
        "translational_inertia = 0\ndamping = 0",
        None,
    ),
    "load": (
        'thrust = "1 + step(t - 0.1)"\ncouple = 0.1',
        'force = "sin(9*t)"\nangle = "135 deg"\nweight = 2.0\nweight_angle = -1.2',
        "thrust = -1.0\nallow_tension = true",
        "force = 1.0",
    ),
    "initial": (
        'curvature = "1 + cos(3*s)"\nnatural_curvature = -0.3',
        'curvature_rate = { pieces = [0.3, "s"], breaks = [0.4] }',
        "natural_curvature = [0.3, -0.1]",
        "",
    ),
    "grid": ("nodes = 5", "nodes = 4\nnatural_segments = 2"),
    "solve": (
        "until = 0.3\nrtol = 1e-5",
        "until = 0.3\nrtol = 1e-5\nmax_steps = 3\ntimes = [0.2]",
        'until = "equilibrium"\nrtol = 1e-3\nmax_steps = 100',
    ),
    "output": ('csv = ["tip_y"]', 'csv = ["kinetic_energy"]'),
}


def accepted(file: Path) -> Scenario | None:
    try:
        return read_scenario(file)
    except ScenarioError:
        return None


def forms(table: dict[str, Any]) -> st.SearchStrategy[dict[str, str | None]]:
    return st.fixed_dictionaries({name: st.sampled_from(each) for name, each in table.items()})


def check_run_follows_check(folder: Path, parts: dict[str, str | None]) -> None:
    """A file that `check` accepts is run, with or without success; another is refused and leaves nothing behind."""
    file = written(folder, scenario(**parts))
    code = call("run", file, "--output", folder / "out", "--no-report", "--no-film").code
    assert (code in (0, 1)) == (accepted(file) is not None)
    assert (folder / "out").exists() == (code in (0, 1))


@settings(deadline=None, max_examples=60, derandomize=True)
@given(forms(FORMS))
def test_what_check_accepts_run_accepts(tmp_path_factory: pytest.TempPathFactory, parts: dict[str, str | None]) -> None:
    check_run_follows_check(tmp_path_factory.mktemp("case"), parts)


@settings(deadline=None, max_examples=30, derandomize=True)
@given(forms(SWINGING))
def test_what_check_accepts_of_a_rod_with_inertia_run_accepts(
    tmp_path_factory: pytest.TempPathFactory, parts: dict[str, str | None]
) -> None:
    check_run_follows_check(tmp_path_factory.mktemp("case"), parts)


KINDS = [(units, inertia) for units in ("SI", "dimensionless") for inertia in (False, True)]

COMPANIONS = {"weight_angle": ("weight",), "force": ("angle",), "angle": ("force",)}
"""What an offer of a template needs beside it."""

RIVALS = {
    "bending_stiffness": ("youngs_modulus", "section"),
    "mass_per_length": ("density",),
    "rotary_inertia": ("density",),
    "force": ("thrust", "transverse"),
    "angle": ("thrust", "transverse"),
    "result": ("curvature", "natural_curvature"),
}
"""What an offer takes the place of, beside its own key."""


@pytest.mark.parametrize(("units", "inertia"), KINDS)
def test_the_template_runs(units: Any, inertia: bool, tmp_path: Path) -> None:
    file = written(tmp_path, template(units, inertia=inertia))
    assert call("check", file).code == 0
    answer = call("run", file, "--output", tmp_path / "out", "--no-report", "--no-film")
    assert (answer.code, answer.err) == (0, "")


@pytest.mark.parametrize(("units", "inertia"), KINDS)
def test_what_the_template_offers_is_accepted(units: Any, inertia: bool, tmp_path: Path) -> None:
    """Every possibility that the comments name can be used: in the place of what stands there."""
    lines = template(units, inertia=inertia).splitlines()
    offers = [i for i, line in enumerate(lines) if line.startswith("# ") and " = " in line and "{line}" not in line]
    tried = 0
    for i in offers:
        key = lines[i].removeprefix("# ").split(" = ")[0]
        if key in ("result", "preference", "flow", "threshold", "parameters", "h") or "csv =" in lines[i]:
            continue
        rivals = tuple(f"{name} = " for name in (key, *RIVALS.get(key, ())))
        rest = [line for line in lines if key == "name" or not line.startswith(rivals)]
        rest = [_offered(line, COMPANIONS.get(key, ())) for line in rest]
        rest[rest.index(lines[i])] = lines[i].removeprefix("# ")
        assert read_scenario(written(tmp_path, "\n".join(rest))), lines[i]
        tried += 1
    assert tried >= (6 if inertia else 15)


def _offered(line: str, keys: tuple[str, ...]) -> str:
    return line.removeprefix("# ") if line.startswith(tuple(f"# {key} = " for key in keys)) else line
