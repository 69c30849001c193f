"""Claim: what is asked of many struts at once is read in every form, answered with labels, or refused in a sentence."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import plastica as pl
from tests.patience import PATIENCE
from tests.test_many import MATERIAL, READ, SHAPE, STRUT, error_beside_solve, same, singly


def test_forms_of_the_start() -> None:
    """A shape for all, a list of shapes, nodal values, uniform curvatures: the same members, the same numbers."""
    thrust = np.array([1.0, 2.0])
    base = pl.solve_many(STRUT, "0.5", thrust=thrust, until=1.0)
    uniform = np.full((2, 1), 0.5)
    for start in (0.5, ["0.5", "0.5"], np.full((2, 12), 0.5), np.full(12, 0.5), uniform, lambda s: 0.5 + 0.0 * s):
        assert same(pl.solve_many(STRUT, start, thrust=thrust, until=1.0), base)
    rough = pl.solve_many(STRUT, ["step(s - 0.3)", pl.piecewise([0.6], [1.0, 0.0])], thrust=2.0, until=1.0)
    alone = singly(STRUT.with_grid(pl.Grid(12, (0.0, 0.3, 0.6, 1.0))), "step(s - 0.3)", 0.0, until=1.0)
    assert error_beside_solve(rough, 0, alone) <= 1e-7


def test_dataset() -> None:
    """Dimensions, names, units and words; one member where nothing is an array."""
    found = pl.solve_many(STRUT, SHAPE, until=2.0, also=["curvature", "limit"])
    assert dict(found.sizes) == {"member": 1, "s": 12}
    others = {"time_reached", "status", "method", "steps", "nodes", "curvature", "limit_kind"}
    assert {*READ, *others} <= set(found.data_vars)
    assert all({"units", "long_name"} <= set(found[name].attrs) for name in found.data_vars)
    assert float(found.curvature[0] @ found.s_weight) == pytest.approx(float(found.tip_angle[0]), rel=1e-12)
    over_time = pl.solve_many(STRUT, SHAPE, thrust=[1.0, 2.0, 3.0], times=[1.0, 2.0])
    assert over_time.natural_curvature.dims == ("member", "t")
    assert over_time.status.dims == ("member",)
    assert over_time.t.values.tolist() == [1.0, 2.0]


def test_limits() -> None:
    """Where each member ends is what `predict_limit` says of its last state."""
    found = pl.solve_many(STRUT, SHAPE, thrust=[1.0, 3.0], parameters={"h": [3.0, 0.1]}, until=60.0, also=["limit"])
    assert found.limit_kind.values.tolist() == ["interior", "limiting"]
    assert found.limit_stable.values.tolist() == [1, 1]
    sol = pl.solve(STRUT.with_load(pl.Load(thrust=3.0)), SHAPE, until=60.0)
    assert float(found.limit_natural_curvature[1]) == pytest.approx(sol.limit.equilibrium.mu_nat, abs=1e-7)


def test_progress_and_stops() -> None:
    """Progress is told chunk by chunk; what it raises ends the run."""
    said: list[Any] = []
    pl.solve_many(STRUT, SHAPE, thrust=np.linspace(0.0, 3.0, 10), until=0.5, chunk=4, progress=said.append)
    assert [each.members for each in said] == [4, 8, 10]
    assert {each.of for each in said} == {10}

    def interrupt(_: object) -> None:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        pl.solve_many(STRUT, SHAPE, until=0.5, progress=interrupt)


WRONG: dict[str, tuple[dict[str, Any], str]] = {
    "two counts": ({"thrust": [1.0, 2.0], "natural_curvature": [0.0, 0.1, 0.2]}, "must be as many of each"),
    "no number": ({"thrust": [1.0, float("nan")]}, r"`thrust\[1\]` must be finite"),
    "tension": ({"thrust": [1.0, -2.0]}, "must not be negative"),
    "a list among thrusts": ({"thrust": ["1 + t", [1.0]]}, "`thrust` must be a number, a text or a program"),
    "negative factor": ({"thrust": "1 + sin(t)/2", "thrust_factor": [1.0, -1.0]}, "`thrust_factor` must not be"),
    "unknown parameter": ({"parameters": {"z": [1.0]}}, "must be parameters of the material"),
    "parameter not finite": ({"parameters": {"k": [1.0, float("inf")]}}, r"`parameters.k\[1\]` must be finite"),
    "unit without specimen": ({"natural_curvature": "1 1/m"}, "`natural_curvature` must be a number"),
    "nodes": ({"curvature": np.zeros((3, 5))}, "`curvature` must have one value, or one for each of 12 nodes"),
    "complex": ({"thrust": np.array([1.0 + 1.0j, 2.0])}, "`thrust` must be a number, or one for each member"),
    "one complex": ({"thrust": 1.0 + 1.0j}, "`thrust` must be a number, or one for each member"),
    "booleans": ({"thrust": np.array([True, False])}, "`thrust` must be a number, or one for each member"),
    "a boolean among numbers": ({"thrust": [1.0, True]}, "`thrust` must be a number, or one for each member"),
    "one boolean": ({"thrust": True}, "`thrust` must be a number, or one for each member"),
    "boolean factor": ({"thrust_factor": [True, False]}, "`thrust_factor` must be a number"),
    "complex parameter": ({"parameters": {"k": np.array([1.0j, 2.0])}}, "`parameters.k` must be a number"),
    "complex nodes": ({"curvature": np.zeros((3, 12), dtype=complex)}, "`curvature` must be numbers"),
    "huge": ({"natural_curvature": [1e9]}, "`natural_curvature` must stay below"),
    "until": ({"until": "equilibrium"}, "`until` must be a time"),
    "times": ({"times": [1.0, 0.5]}, "`times` must increase"),
    "late times": ({"times": [1.0, 500.0]}, "`times` must increase"),
    "rtol": ({"rtol": 1.0}, "`rtol` must lie"),
    "atol": ({"atol": -1.0}, "`atol` must be a positive"),
    "chunk": ({"chunk": 0}, "`chunk` must be a positive integer"),
    "also": ({"also": "curvature"}, "`also` must be a list"),
    "library": ({"library": "tables"}, "`library` must be one of"),
    "shape parameter": ({"curvature": "a*s", "shape_parameters": {"a": 1.0, "b": 2.0}}, "parameters.b` must occur"),
    "moving break": ({"curvature": "step(s - a)", "shape_parameters": {"a": [0.2, 0.3]}}, "must not move the places"),
    "shape not finite": ({"curvature": "log(a*s)", "shape_parameters": {"a": [1.0, -1.0]}}, "must be finite"),
    "needless": ({"shape_parameters": {"a": 1.0}}, "`shape_parameters` must be given only where"),
    "workers": ({"workers": 2, "library": "array_api_strict"}, "`workers` must be 1"),
}


def check_refused(name: str) -> None:
    """What cannot be used is refused in one sentence, before anything is computed."""
    options, words = WRONG[name]
    said = ""
    try:
        pl.solve_many(STRUT, **options)
    except pl.errors.ArgumentError as error:
        said = str(error)
    assert re.search(words, said)
    assert len(said) < 400


@pytest.mark.parametrize("name", WRONG)
def test_wrong_input(name: str) -> None:
    check_refused(name)


def test_models_that_are_not_for_many() -> None:
    """A rod with inertia, and several natural curvatures, are refused with the way to go."""
    several = pl.Strut(MATERIAL, pl.Load(thrust=1.0), pl.Grid(12), natural_segments=3)
    with pytest.raises(pl.errors.ArgumentError, match=r"one natural curvature.*Take pl\.solve"):
        pl.solve_many(several)
    with pytest.raises(pl.errors.ArgumentError, match=r"must be a pl\.Strut"):
        pl.solve_many(pl.Rod(MATERIAL, pl.Load(thrust=1.0), pl.Grid(12), translational_inertia=0.1))


def test_processes_that_cannot_start(tmp_path: Path) -> None:
    """A script without its guard, whose processes would start processes, is told so."""
    script = tmp_path / "unguarded.py"
    script.write_text(
        "import plastica as pl\n"
        "material = pl.Material('m**2/2', 'pos(x)**2', '0.1')\n"
        "strut = pl.Strut(material, pl.Load(), pl.Grid(8))\n"
        "pl.solve_many(strut, 0.1, thrust=[1.0, 2.0], until=0.1, workers=2)\n"
    )
    done = subprocess.run([sys.executable, str(script)], capture_output=True, text=True, timeout=PATIENCE, check=False)
    assert done.returncode == 1
    # What the interpreter says of the processes it clears away may come after it.
    assert "ArgumentError: `workers` must be processes that can start" in done.stderr
