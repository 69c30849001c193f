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
        "",
    ),
    "initial": (
        "curvature = 0.1",
        'curvature = "1 + cos(3*s)"\nnatural_curvature = -0.3',
        'curvature = { pieces = [1.0, "-s"], breaks = [0.3] }',
        'curvature = "sqrt(s - 0.2)"',
        "",
    ),
    "grid": ('nodes = "auto"', "nodes = 2", "nodes = 9\nbreaks = [0.1, 0.2]", "nodes = 1", ""),
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


def accepted(file: Path) -> Scenario | None:
    try:
        return read_scenario(file)
    except ScenarioError:
        return None


@settings(deadline=None, max_examples=60, derandomize=True)
@given(st.fixed_dictionaries({name: st.sampled_from(forms) for name, forms in FORMS.items()}))
def test_what_check_accepts_run_accepts(tmp_path_factory: pytest.TempPathFactory, parts: dict[str, str]) -> None:
    folder = tmp_path_factory.mktemp("case")
    file = written(folder, scenario(**parts))
    code = call("run", file, "--output", folder / "out", "--no-report", "--no-film").code
    assert (code in (0, 1)) == (accepted(file) is not None)
    assert (folder / "out").exists() == (code in (0, 1))


@pytest.mark.parametrize("units", ["SI", "dimensionless"])
def test_the_template_runs(units: Any, tmp_path: Path) -> None:
    file = written(tmp_path, template(units))
    assert call("check", file).code == 0
    answer = call("run", file, "--output", tmp_path / "out", "--no-report", "--no-film")
    assert (answer.code, answer.err) == (0, "")


@pytest.mark.parametrize("units", ["SI", "dimensionless"])
def test_what_the_template_offers_is_accepted(units: Any, tmp_path: Path) -> None:
    """Every possibility that the comments name can be used: alone in the place of what stands there."""
    lines = template(units).splitlines()
    offers = [i for i, line in enumerate(lines) if line.startswith("# ") and " = " in line and "{line}" not in line]
    tried = 0
    for i in offers:
        key = lines[i].removeprefix("# ").split(" = ")[0]
        if key in ("result", "preference", "flow", "threshold", "parameters", "h") or "csv =" in lines[i]:
            continue
        rest = [line for line in lines if key == "name" or not line.startswith(f"{key} = ")]
        at = rest.index(lines[i])
        rest[at] = lines[i].removeprefix("# ")
        if key == "bending_stiffness":
            rest = [line for line in rest if not line.startswith(("youngs_modulus", "section"))]
        assert read_scenario(written(tmp_path, "\n".join(rest))), lines[i]
        tried += 1
    assert tried >= 10
