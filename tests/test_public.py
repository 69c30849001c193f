"""Claim: the public names are those of the design note, section 4, with these arguments, attributes and errors."""

from __future__ import annotations

import importlib.metadata
import inspect
import re
import subprocess
import sys
import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import plastica as pl
from plastica import errors
from tests.patience import PATIENCE

ROOT = Path(__file__).parent.parent

SIGNATURES = {
    "Material": "preference, flow, threshold, parameters=…, name=None, source=None",
    "Load": "thrust=0.0, transverse=0.0, couple=0.0, weight=0.0, *weight_angle=0.0, *allow_tension=False",
    "Grid": "nodes=16, breaks=(0.0, 1.0)",
    "Strut": "material, load, grid=…, specimen=None, *natural_segments=1",
    "Rod": "material, load, grid=…, specimen=None, *natural_segments=1, *translational_inertia=None, "
    "*rotary_inertia=None, *damping=None",
    "Specimen": "*length, *bending_stiffness=None, *youngs_modulus=None, *section=None, *retardation_time=None, "
    "*temperature=None, *mass_per_length=None, *rotary_inertia=None, *density=None",
    "Equilibrium": "gamma, alpha, material=None, specimen=None, depth=None, multiplicity=1",
    "Shape": "function, breaks=(), words='a function of s', paces=None",
    "Status": "ok, code, sentence",
    "Verdict": "name, holds, margin, witness, sentence",
    "Ledger": "residual, work, stored_energy, viscous_dissipation, natural_dissipation, kinetic_energy, "
    "largest_energy, unit",
    "solve": "model, curvature=0.0, natural_curvature=0.0, until=100.0, rtol=1e-08, atol=None, method='auto', "
    "times=None, *curvature_rate=0.0, *start=None, *max_steps=200000, *progress=None, *checkpoint=None, "
    "*checkpoint_every=5.0, *resume=False",
    "solve_many": "strut, curvature=0.0, natural_curvature=0.0, thrust=None, parameters=None, until=100.0, rtol=1e-08, "
    "atol=None, times=None, *thrust_factor=None, *shape_parameters=None, *also=(), *chunk=8192, *workers=1, "
    "*library=None, *device=None, *progress=None",
    "equilibrium": "material, gamma, alpha, *specimen=None",
    "equilibria": "material, gamma, alpha=None, *specimen=None",
    "equilibria_at": "gamma, natural_curvature",
    "branches": "natural_curvature, gamma=(0.0, 40.0), count=201",
    "fold_curve": "gamma=(0.0, 40.0), count=201",
    "thresholds": "material, *specimen=None",
    "capacity": "material, gamma, imperfection='natural', *specimen=None, *rtol=1e-08, *progress=None",
    "phase_diagram": "material, gamma=(0.0, 20.0), alpha=(-12.0, 12.0), shape=(400, 400), *specimen=None",
    "basin": "strut, shape='cos(pi*s/2)', amplitude=0.0, natural_curvature=0.0, *rtol=1e-08, *progress=None",
    "spectrum": "equilibrium, count=6, *lowest=0",
    "modes": "rod, equilibrium=None, count=6",
    "asymptotic_phase": "equilibrium, mu, mu_nat, grid",
    "predict_limit": "strut, mu, mu_nat, *rtol=0.0",
    "rest": "model, curvature=0.0, natural_curvature=0.0",
    "omega_limit": "strut, curvature=0.0, natural_curvature=0.0, *rtol=1e-08, *longest=10000000.0",
    "thermodynamics": "solution",
    "time_one_map": "strut, mu, mu_nat, *rtol=1e-10",
    "measured_shape": "file, columns, length, *si, *length_unit=None, *curvature_unit=None, *smoothing=None",
    "read": "path",
    "sweep": "scenario, over=None, *store=None, *sampling=None, *members=None, *seed=None, *csv=None, *outputs=None, "
    "*times=None, *chunk=None, *library=None, *engine='local', *workers=None, *scheduler=None, *progress=None",
    "estimate_sweep": "scenario, over=None, *workers=None, **table",
    "read_sweep": "path",
    "Sweep.to_dataset": "self, variables=None",
    "Sweep.interesting": "self, count=10",
    "Sweep.scenario": "self, member",
    "Sweep.solve": "self, member",
    "piecewise": "breaks, pieces",
    "plot": "result, picture=None, *path=None",
    "moment_curvature": "solution, s=0.0, times=None",
    "force_displacement": "solution, times=None",
    "report": "solution, path, *film_seconds=8.0",
    "film": "solution, path, seconds=8.0, *fps=12.5, *width=720",
    "programs.constant": "value",
    "programs.table": "times, values",
    "programs.ramp_hold_release": "value, ramp, hold, release, *start=0.0, *rest=0.0",
    "programs.cycles": "low, high, period, count=None, shape='triangle', *start=0.0",
    "programs.expression": "text, parameters=None",
    "catalogue.names": "",
    "catalogue.describe": "name",
    "catalogue.material": "name, *length=None, *stiffness=None, *time=None, **parameters",
    "Solution.at": "self, s, t",
    "Solution.save": "self, path",
    "Solution.to_dataset": "self",
    "Material.admissibility": "self, bound=None",
    "Material.with_parameters": "self, **changes",
    "Strut.with_load": "self, load",
    "Strut.with_grid": "self, grid",
    "Load.mirrored": "self",
}
"""Names with their arguments: * before what is given by name only, … for a default made anew each time."""

RESULTS = {"Basin", "EquilibriumSet", "Limit", "Modes", "PhaseDiagram", "Rest", "Solution", "Spectrum", "Thresholds"}
"""What the verbs give back; nobody makes one by hand, but types are annotated with them."""

VARIABLES = {
    ("t", "s"): "curvature angle x y couple shear tension natural_x natural_y entropy_rate",
    ("t",): "natural_curvature drive threshold tip_x tip_y tip_angle liapunov stored_energy work viscous_dissipation "
    "natural_dissipation entropy_production thrust transverse end_couple weight",
}


def found(name: str) -> Any:
    value: Any = pl
    for part in name.split("."):
        value = getattr(value, part)
    return value


def written(signature: inspect.Signature) -> str:
    """A signature in the short form of `SIGNATURES`."""
    out = []
    for parameter in signature.parameters.values():
        star = {parameter.KEYWORD_ONLY: "*", parameter.VAR_KEYWORD: "**"}.get(parameter.kind, "")
        text = f"{star}{parameter.name}"
        if parameter.default is not parameter.empty:
            text += "=…" if repr(parameter.default).startswith("<") else f"={parameter.default!r}"
        out.append(text)
    return ", ".join(out)


@pytest.fixture(scope="module")
def sol() -> pl.Solution:
    material = pl.Material(
        preference="k*m**2/2", flow="c*pos(x)**2", threshold="h", parameters={"k": 1.0, "c": 1.0, "h": 0.1}
    )
    strut = pl.Strut(material, pl.Load(thrust=3.0), pl.Grid(nodes=16))
    return pl.solve(strut, curvature="1 + cos(3*s)", natural_curvature=0.0, until=100.0)


@pytest.mark.parametrize("name", SIGNATURES)
def test_arguments_and_defaults(name: str) -> None:
    assert written(inspect.signature(found(name))) == SIGNATURES[name]


def test_the_package_names_what_it_has() -> None:
    assert dir(pl) == sorted(pl.__all__)
    tops = {name.split(".")[0] for name in SIGNATURES}
    assert set(pl.__all__) == tops | RESULTS | {"__version__"}
    for name in pl.__all__:
        assert getattr(pl, name) is not None
    with pytest.raises(AttributeError, match="no attribute 'fit'"):
        _ = pl.fit


def test_type_checkers_see_what_users_get() -> None:
    """The names under TYPE_CHECKING are those that are imported on use."""
    source = (ROOT / "src" / "plastica" / "__init__.py").read_text(encoding="utf-8")
    block = source.split("if TYPE_CHECKING:")[1].split("_HOMES")[0]
    listed = {name.strip() for line in re.findall(r"import (.+)", block) for name in line.split(",")}
    assert listed == set(pl.__all__) - {"__version__"}


def test_a_solution_has_what_the_design_promises(sol: pl.Solution) -> None:
    assert (sol.status.ok, sol.status.code) == (True, "done")
    assert sol.status.sentence.endswith(".")
    assert sol.ledger.kinetic_energy == 0.0
    for entry in ("residual", "work", "stored_energy", "viscous_dissipation", "natural_dissipation"):
        assert isinstance(getattr(sol.ledger, entry), float)
    assert sol.limit is not None
    assert sol.limit.kind == "limiting"
    assert sol.outcome.headline in str(sol)
    assert np.isfinite(sol.bounds.norm)
    assert sol.to_dataset() is sol.dataset


def test_the_dataset_has_what_the_design_promises(sol: pl.Solution) -> None:
    data = sol.dataset
    for dims, names in VARIABLES.items():
        for name in names.split():
            assert data[name].dims == dims, name
            assert data[name].attrs["units"]
            assert data[name].attrs["long_name"]
    assert {name for names in VARIABLES.values() for name in names.split()} == set(data.data_vars)
    assert abs(float(data.s_weight.sum()) - 1.0) <= 1e-15
    assert "t" in data.indexes
    assert "s" in data.indexes


def test_loads_that_are_there_are_in_the_dataset() -> None:
    material = pl.catalogue.material("three-shapes")
    load = pl.Load(thrust=1.0, transverse=0.1, couple=0.1, weight=0.1)
    data = pl.solve(pl.Strut(material, load), 0.1, until=1.0).dataset
    assert {"transverse", "end_couple", "weight", "volume_fraction"} <= set(data.data_vars)


def test_at_takes_scalars_and_broadcasts(sol: pl.Solution) -> None:
    assert isinstance(sol.at(0.5, 1.0), float)
    assert np.shape(sol.at([0.0, 0.5, 1.0], np.array([[0.0], [1.0]]))) == (2, 3)
    assert sol.at(np.zeros((2, 1, 3)), 1.0).shape == (2, 1, 3)  # type: ignore[union-attr]


def test_loads_take_every_form_of_the_design() -> None:
    program = pl.programs.table([0.0, 1.0], [0.0, 1.0])
    for given in (1.0, ([0.0, 1.0], [0.0, 1.0]), (np.array([0.0, 1.0]), np.array([0.0, 1.0])), "t", program):
        assert pl.Load(thrust=given).thrust(1.0) == 1.0


def test_admissibility_is_a_tuple_of_verdicts() -> None:
    verdicts = pl.catalogue.material("one-shape").admissibility()
    assert isinstance(verdicts, tuple)
    assert all(isinstance(verdict, pl.Verdict) and verdict.holds is True for verdict in verdicts)


def test_nouns_are_frozen() -> None:
    strut = pl.Strut(pl.catalogue.material("one-shape"), pl.Load(thrust=1.0))
    for noun, name in ((strut, "load"), (strut.material, "flow"), (strut.load, "thrust"), (strut.grid, "nodes")):
        with pytest.raises(AttributeError):
            setattr(noun, name, None)


def test_every_user_error_is_of_one_family() -> None:
    for name in errors.__all__:
        assert issubclass(getattr(errors, name), errors.PlasticaError)
    assert issubclass(errors.ArgumentError, ValueError)
    assert issubclass(errors.FileError, OSError)
    assert not issubclass(errors.FileError, ValueError)


def test_the_grammar_of_an_error() -> None:
    error = errors.ArgumentError("must lie in [0, 1]", where="s", value=1.5, next_step="Give a place on the rod.")
    assert str(error) == "`s` must lie in [0, 1], but is 1.5. Give a place on the rod."
    assert (error.where, error.rule, error.next_step) == ("s", "must lie in [0, 1]", "Give a place on the rod.")
    long = str(errors.ArgumentError("must be short", where="text", value="x" * 10_000))
    assert len(long) < 250
    several = errors.ScenarioError("run.toml", ("line 3: `a` must be b.", "line 4: `c` must be d."))
    assert str(several) == "run.toml: 2 mistakes\n  line 3: `a` must be b.\n  line 4: `c` must be d."


def test_one_version() -> None:
    assert pl.__version__ == importlib.metadata.version("plastica")
    assert re.fullmatch(r"\d+\.\d+\.\d+", pl.__version__)
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    assert project["project"]["dynamic"] == ["version"]
    said = subprocess.run(
        [sys.executable, "-m", "plastica", "--version"], capture_output=True, text=True, timeout=PATIENCE, check=True
    )
    assert pl.__version__ in said.stdout
    places = {"CHANGELOG.md": rf"^## {pl.__version__}\b", "CITATION.cff": rf"^version: {pl.__version__}$"}
    for file, pattern in places.items():
        assert re.search(pattern, (ROOT / file).read_text(encoding="utf-8"), re.MULTILINE), file
