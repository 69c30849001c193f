"""Claim: motions with inertia or segments can be gone on with, kept, and taken up to the bit; nonsense is refused."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import plastica as pl
from plastica.errors import ArgumentError, FileError
from tests.rods import ELASTIC, INERTIA, KINDS, LOADS, NEVER, last, model
from tests.support import EPS, pair

CASES = {
    "rod": (INERTIA, 1),
    "elastic": (ELASTIC, 1),
    "strut in segments": (None, 3),
    "rod in segments": (INERTIA, (0.0, 0.3, 1.0)),
}


def made(case: str, load: str = "jumps") -> pl.Strut | pl.Rod:
    inertia, segments = CASES[case]
    return model(LOADS[load], nodes=4, segments=segments, inertia=inertia)


def check_gone_on_with(case: str) -> None:
    """Held to t = 1 and gone on to t = 2 is the motion to t = 2: state, ledger and first natural curvature."""
    options: dict[str, Any] = {"rtol": 1e-9}
    whole = pl.solve(made(case), "0.3*cos(2*s)", 0.1, until=2.0, **options)
    first = pl.solve(made(case), "0.3*cos(2*s)", 0.1, until=1.0, **options)
    after = pl.solve(made(case), until=2.0, start=first, **options)
    assert after.history.start == 1.0
    assert np.array_equal(after.first_natural, whole.first_natural)
    layout = whole.model.layout
    state = np.r_[0 : layout.natural_columns.stop, layout.rate_columns]
    assert np.abs(after.history.y[-1] - whole.history.y[-1])[state].max() <= 100.0 * whole.rtol
    work = first.ledger.work + after.ledger.work
    assert abs(work - whole.ledger.work) <= 100.0 * whole.rtol


@pytest.mark.parametrize("case", CASES)
def test_gone_on_with(case: str) -> None:
    check_gone_on_with(case)


def test_gone_on_with_on_another_grid_and_under_another_load() -> None:
    """A rod let go: finer grid, no load; the energy it goes on with is that which it had."""
    held = pl.solve(made("rod in segments"), "0.3*cos(2*s)", 0.1, until=0.8)
    free = model(pl.Load(), nodes=7, segments=(0.0, 0.3, 1.0), inertia=INERTIA)
    freed = pl.solve(free, until=1.0, start=held)
    before, after = held.dataset.isel(t=-1), freed.dataset.isel(t=0)
    for name in ("stored_energy", "kinetic_energy"):
        assert abs(float(after[name]) - float(before[name])) <= 1e-6 * float(before[name])


def check_resumed(case: str, folder: Path) -> None:
    """A run that was killed after its third leg, taken up again, repeats the whole one bit for bit."""
    options: dict[str, Any] = {"curvature": "0.3*cos(2*s)", "natural_curvature": 0.1, "until": 2.0, "rtol": 1e-6}
    whole = pl.solve(made(case), checkpoint=folder, checkpoint_every=0.0, **options)
    kept = sorted(folder.glob("legs-*.npz"))
    assert len(kept) > 3
    for path in kept[3:]:
        path.unlink()
    again = pl.solve(made(case), checkpoint=folder, resume=True, **options)
    assert np.array_equal(again.history.t, whole.history.t)
    assert np.array_equal(again.history.y, whole.history.y)
    assert np.array_equal(again.legs[1], whole.legs[1])


@pytest.mark.parametrize("case", CASES)
def test_resumed(case: str, tmp_path: Path) -> None:
    check_resumed(case, tmp_path / "kept")


def test_the_checkpoint_of_another_inertia_is_refused(tmp_path: Path) -> None:
    options: dict[str, Any] = {"until": 0.2, "checkpoint": tmp_path / "kept", "checkpoint_every": 0.0}
    pl.solve(made("rod"), **options)
    heavier = model(LOADS["jumps"], nodes=4, inertia=INERTIA | {"translational_inertia": 2e-2})
    for other in (heavier, made("strut in segments"), made("rod in segments")):
        with pytest.raises(FileError, match="run"):
            pl.solve(other, **options, resume=True)


def check_file(case: str, path: Path) -> None:
    """What is read is equal to what was written: model, state, legs, and what follows from them."""
    sol = pl.solve(made(case), "0.3*cos(2*s)", 0.1, until=1.3, rtol=1e-6)
    read = pl.read(sol.save(path))
    assert read == sol
    assert read.model == sol.model
    assert np.array_equal(read.history.y, sol.history.y)
    assert np.array_equal(read.legs[1], sol.legs[1])
    assert np.array_equal(read.first_natural, sol.first_natural)
    assert read.ledger == sol.ledger
    assert read.dataset.identical(sol.dataset)


@pytest.mark.parametrize("case", CASES)
def test_file(case: str, tmp_path: Path) -> None:
    check_file(case, tmp_path / "run.nc")


def test_si_and_dimensionless_rods_are_the_same_motion() -> None:
    """A steel strip with mass: what is computed in SI is the dimensionless motion in other units."""
    specimen = pl.Specimen(
        length="250 mm",
        bending_stiffness="0.035 N*m**2",
        retardation_time="0.2 s",
        mass_per_length="0.05 kg/m",
        rotary_inertia="1e-6 kg*m",
    )
    scales = specimen.scales
    material = pl.catalogue.material("one-shape", length=specimen.L, stiffness=specimen.EI, time=specimen.T)
    load = pl.Load(thrust=2.0 * scales.force, transverse=0.5 * scales.force)
    si = pl.solve(pl.Rod(material, load, pl.Grid(8), specimen), "1.2 1/m", "0.2 1/m", until="0.3 s", rtol=1e-9)
    inertia = {
        "translational_inertia": 0.05 * 0.25**4 / (0.035 * 0.2**2),
        "rotary_inertia": 1e-6 * 0.25**2 / (0.035 * 0.2**2),
        "damping": 1.0,
    }
    plain = pl.Rod(pl.catalogue.material("one-shape"), pl.Load(thrust=2.0, transverse=0.5), pl.Grid(8), **inertia)
    bare = pl.solve(plain, 0.3, 0.05, until=1.5, rtol=1e-9)
    one, other = si.dataset.isel(t=-1), bare.dataset.isel(t=-1)
    units = {
        "tip_y": 0.25,
        "velocity_y": 0.25 / 0.2,
        "kinetic_energy": scales.energy,
        "clamp_force_y": scales.force,
        "clamp_couple": scales.force * 0.25,
        "natural_curvature": 4.0,
    }
    for name, unit in units.items():
        scale = float(np.abs(other[name]).max())
        assert np.abs(one[name].to_numpy() / unit - other[name].to_numpy()).max() <= 1e-6 * scale, name


def refused(make: Any, words: str) -> None:
    with pytest.raises(ArgumentError, match=words):
        make()


def test_starts_that_do_not_fit() -> None:
    strut = pl.solve(model(pl.Load(), nodes=4), 0.1, until=0.1)
    rod = pl.solve(made("rod"), 0.1, until=0.1)
    parts = pl.solve(made("strut in segments"), 0.1, until=0.1)
    refused(lambda: pl.solve(made("rod"), until=1.0, start=strut), "start.*inertia")
    refused(lambda: pl.solve(model(pl.Load(), nodes=4), until=1.0, start=rod), "start.*inertia")
    refused(lambda: pl.solve(model(pl.Load(), nodes=4), until=1.0, start=parts), "start.*segments")
    uneven = model(pl.Load(), nodes=4, segments=(0.0, 0.2, 0.5, 1.0))
    refused(lambda: pl.solve(uneven, until=1.0, start=parts), "start.*segments")
    refused(lambda: pl.solve(made("rod"), until=1.0, start=rod, curvature_rate=1.0), "start")


@pytest.mark.parametrize("rate", [1.0, "cos(s)", float("nan"), "1/0", [1.0, 2.0], None, "__import__('os')"], ids=str)
def test_a_strut_has_no_rate_of_curvature_of_its_own(rate: Any) -> None:
    refused(lambda: pl.solve(model(pl.Load()), until=1.0, curvature_rate=rate), "curvature_rate")


@pytest.mark.parametrize("rate", [float("nan"), float("inf"), "1/0", "sin(t)", [1.0, 2.0], None, 1e400], ids=str)
def test_rates_of_curvature_that_are_none(rate: Any) -> None:
    refused(lambda: pl.solve(made("rod"), until=1.0, curvature_rate=rate), "curvature_rate")


@pytest.mark.parametrize("name", ["translational_inertia", "rotary_inertia", "damping"])
@pytest.mark.parametrize("value", [-1e-3, float("nan"), float("inf"), "1 kg/m", "much", True, [0.1], 1e13], ids=str)
def test_inertias_that_are_none(name: str, value: Any) -> None:
    refused(lambda: pl.Rod(NEVER, pl.Load(), pl.Grid(4), **{name: value}), name)


def test_problems_without_an_equation_of_motion() -> None:
    still = {"translational_inertia": 0.0, "rotary_inertia": 0.0, "damping": 0.0}
    refused(lambda: pl.Rod(NEVER, pl.Load(), **still), "damping")
    refused(lambda: pl.solve(made("elastic", "constant"), until="equilibrium"), "until.*damping")
    elastic = pl.Specimen(length="1 m", bending_stiffness="1 N*m**2", mass_per_length="1 kg/m")
    refused(lambda: pl.Strut(pl.Material("m**2/2", "pos(x)**2", "1"), pl.Load(), pl.Grid(4), elastic), "specimen")


def test_a_rod_comes_to_rest() -> None:
    """A rod that swings is not at rest at its turning points, where nothing moves for a moment."""
    heavy = INERTIA | {"translational_inertia": 100.0}
    swinging = model(pl.Load(transverse=0.3), nodes=6, inertia=heavy, material=NEVER)
    sol = pl.solve(swinging, until="equilibrium", rtol=1e-7)
    assert sol.status.code == "equilibrium"
    turns = np.diff(np.sign(np.diff(sol.dataset.tip_y.to_numpy())))
    assert np.count_nonzero(turns) >= 3
    assert np.abs(last(sol)[0] - pl.rest(swinging).mu).max() <= 1e-6
    assert np.abs(sol.dataset.velocity_y.to_numpy()[-1]).max() <= 1e-6


def test_automatic_nodes() -> None:
    """The rod chooses its nodes as the strut does, and says so."""
    load = pl.Load(transverse="0.3*sin(t)**2")
    auto = pl.Rod(pair("A"), load, pl.Grid(nodes="auto"), **INERTIA)
    sol = pl.solve(auto, until=1.0, rtol=1e-6)
    assert sol.status.ok
    assert any("nodes per element chosen" in note for note in sol.notes)
    fine = pl.solve(pl.Rod(pair("A"), load, pl.Grid(nodes=24), **INERTIA), until=1.0, rtol=1e-10)
    assert abs(float(sol.dataset.tip_y[-1]) - float(fine.dataset.tip_y[-1])) <= 1e-6


@pytest.mark.parametrize("kind", KINDS)
def test_curvature_anywhere(kind: str) -> None:
    """`at` gives the nodal values back at the nodes, and between them those of a finer grid, across segments."""
    load = pl.Load(thrust=1.0, transverse="0.5*sin(t)**2")
    coarse, fine = (
        pl.solve(
            model(load, nodes=nodes, segments=2, inertia=KINDS[kind], material=NEVER),
            natural_curvature=[0.2, -0.3],
            curvature="0.2 - 0.5*step(s - 0.5)",
            until=0.5,
            rtol=1e-7,
        )
        for nodes in (6, 9)
    )
    s = np.array([0.0, 0.2, 0.45, 0.5, 0.7, 0.99])
    assert np.abs(coarse.at(s, 0.5) - fine.at(s, 0.5)).max() <= 1e-4
    nodal = coarse.model.layout.mu(coarse.history.y[-1])
    assert np.abs(coarse.at(coarse.grid.s, 0.5) - nodal).max() <= 64.0 * EPS
