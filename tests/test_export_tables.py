"""Claim: `plastica export --table` writes what the histories and the thermodynamics of a run are, to the last digit."""

from __future__ import annotations

import csv
import io
from pathlib import Path

import numpy as np
import pytest

import plastica as pl
from plastica.study import export
from tests.commandline import call

VARIABLES = {
    "motion": ("tip_y", "work"),
    "force-displacement": ("thrust", "shortening", "work"),
    "moment-curvature": ("curvature", "couple"),
    "thermodynamics": ("total_entropy",),
}


@pytest.fixture(scope="module")
def result(tmp_path_factory: pytest.TempPathFactory) -> Path:
    material = pl.catalogue.material("one-shape")
    load = pl.Load(thrust=pl.programs.cycles(0.0, 2.0, period=2.0, count=2))
    sol = pl.solve(pl.Strut(material, load, pl.Grid(nodes=8)), "1 + s", until=4.0)
    return sol.save(tmp_path_factory.mktemp("tables") / "cycles.nc")


def check_tables(result: Path) -> None:
    """Every number of every table comes back as the same double."""
    sol = pl.read(result)
    sound = {
        "motion": sol.dataset,
        "force-displacement": pl.force_displacement(sol),
        "moment-curvature": pl.moment_curvature(sol),
        "thermodynamics": pl.thermodynamics(sol),
    }
    for table, names in VARIABLES.items():
        done = call("export", str(result), *names, "--table", table)
        assert done.code == 0, done.err
        rows = list(csv.DictReader(io.StringIO(done.out)))
        for name in names:
            variable = sound[table][name]
            written = np.array([float(row[f"{name} [{variable.attrs['units']}]"]) for row in rows])
            assert np.array_equal(written, variable.values.ravel())


def test_tables_are_those_of_the_verbs(result: Path) -> None:
    check_tables(result)


def test_without_variables_it_lists_them(result: Path) -> None:
    done = call("export", str(result), "--table", "force-displacement")
    assert done.code == 0
    assert "shortening (t) [1]" in done.out


def check_a_whole_table(result: Path, folder: Path) -> None:
    """With a file and no variables all of the table is written."""
    for table, file in (("force-displacement", folder / "loop.csv"), ("moment-curvature", folder / "moment.csv")):
        names = list(export.table_of(pl.read(result), table).data_vars)
        done = call("export", str(result), "--table", table, "-o", str(file))
        assert done.code == 0, done.err
        assert file.read_text() == call("export", str(result), *names, "--table", table).out


def test_a_whole_table_is_written(result: Path, tmp_path: Path) -> None:
    check_a_whole_table(result, tmp_path)


def test_a_table_that_is_only_listed_is_caught(
    result: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(export, "write_csv", lambda dataset, names, path: path)
    with pytest.raises(FileNotFoundError):
        check_a_whole_table(result, tmp_path)


def test_an_unknown_table_is_refused(result: Path) -> None:
    done = call("export", str(result), "tip_y", "--table", "forces")
    assert done.code == 2
    assert "force-displacement" in done.err
    with pytest.raises(pl.errors.ArgumentError, match="`table` must be one of motion, force-displacement"):
        export.table_of(pl.read(result), "forces")


def test_a_table_mistaken_for_another_is_caught(result: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    sound = export.table_of
    monkeypatch.setattr(export, "table_of", lambda sol, name: sound(sol, "motion"))
    with pytest.raises(AssertionError):
        check_tables(result)
