"""Claim: the command runs, tells and goes on with a sweep, and its pictures show what there is."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import plastica as pl
from plastica.errors import ArgumentError
from plastica.study.sweep_engines import check_engine
from tests.commandline import call, scenario, written
from tests.swept import REGIME_SWEEP


@pytest.fixture(scope="module")
def found(tmp_path_factory: pytest.TempPathFactory) -> pl.Sweep:
    folder = tmp_path_factory.mktemp("sweep")
    return pl.sweep(written(folder, REGIME_SWEEP), store=folder / "s.sweep", workers=0)


def check_map(found: pl.Sweep) -> None:
    """The map has, at the place of every member, the colour of its regime."""
    from plastica.show.regimes import LOOKS, regimes_figure

    figure = regimes_figure(found)
    ax = figure.axes[0]
    mesh = ax.collections[0]
    drawn = np.asarray(mesh.get_array()).reshape(5, 6)
    regimes = found.dataset["regime"].values.reshape(6, 5)
    for i in range(6):
        for j in range(5):
            assert list(LOOKS)[int(drawn[j, i])] == regimes[i, j]
    assert (ax.get_xlabel(), ax.get_ylabel()) == ("load.thrust", "initial.amplitude")
    assert ax.get_yscale() == "log"
    edges = np.asarray(mesh.get_coordinates())[0, :, 0]
    thrusts = found.axes[0].values
    assert np.all((edges[:-1] < thrusts) & (thrusts < edges[1:]))


def test_the_map_of_regimes(found: pl.Sweep) -> None:
    check_map(found)


@pytest.mark.parametrize(
    ("over", "table", "panels"),
    [
        ({"load.thrust": [1.0, 2.0, 3.0]}, {}, 1),
        ({"load.thrust": [1.0, 2.0], "initial.curvature": ["s", "1 - s"], "material.parameters.k": [1.0, 2.0]}, {}, 3),
        (
            {"load.thrust": {"from": 1.0, "to": 3.0}, "initial.curvature": {"from": 0.0, "to": 1.0}},
            {"sampling": "random", "members": 12},
            1,
        ),
    ],
)
def test_a_picture_for_every_pair_of_keys(
    over: dict[str, Any], table: dict[str, Any], panels: int, tmp_path: Path
) -> None:
    figure = pl.plot(pl.sweep(scenario(), over, store=tmp_path / "s.sweep", workers=0, **table))
    assert sum(ax.get_visible() for ax in figure.axes) == panels
    figure.savefig(tmp_path / "a.png")


def test_no_picture_without_a_verdict(tmp_path: Path) -> None:
    found = pl.sweep(scenario(), {"load.thrust": [1.0]}, outputs=["final"], store=tmp_path / "s.sweep", workers=0)
    with pytest.raises(ArgumentError, match="must have kept the verdict"):
        pl.plot(found)


# -- the command line ------------------------------------------------------------------------------------------------


def test_the_command_runs_tells_and_goes_on(tmp_path: Path) -> None:
    file = written(tmp_path, REGIME_SWEEP)
    estimate = call("sweep", file, "--estimate", folder=tmp_path)
    assert (estimate.code, estimate.err) == (0, "")
    assert estimate.out.startswith("30 members in 1 chunk: about ")
    assert not (tmp_path / "out").exists()
    answer = call("sweep", file, "--workers", "0", "--plot", "map.svg", "--reports", "1", folder=tmp_path)
    assert (answer.code, answer.err) == (0, "")
    store = tmp_path / "out" / "strut.sweep"
    assert (tmp_path / "map.svg").stat().st_size > 1000
    assert len(list((store / "reports").glob("member-*.html"))) == 1
    for said in ("30 over load.thrust, initial.amplitude (grid), 30 done", "30 done", "recovers", "on the boundary"):
        assert said in answer.out
    before = (store / "log.jsonl").read_bytes()
    again = call("sweep", store, "--workers", "0", "--json", folder=tmp_path)
    told = json.loads(again.out)
    assert (again.code, told["members"], told["done"], told["failed"]) == (0, 30, 30, 0)
    assert (store / "log.jsonl").read_bytes() == before
    status = call("sweep", file, "--status", "--json", folder=tmp_path)
    assert json.loads(status.out)["status"] == {"done": 30}


def test_an_estimate_is_of_this_machine(tmp_path: Path) -> None:
    file = written(tmp_path, REGIME_SWEEP)
    answer = call("sweep", file, "--estimate", "--engine", "dask", "--scheduler", "tcp://h:1", folder=tmp_path)
    assert answer.code == 0
    assert "of this machine, which does not know the workers of tcp://h:1" in answer.err
    assert "of this machine and" in answer.out


def test_failed_members_make_the_exit_code_1(tmp_path: Path) -> None:
    text = (
        scenario(solve="until = 2.0\nmax_steps = 25")
        + '[sweep.over]\n"load.couple" = [0.0, 0.5]\n"load.thrust" = [0.0, 2.0]\n'
    )
    answer = call("sweep", written(tmp_path, text), "--workers", "0", folder=tmp_path)
    assert answer.code == 1
    assert "members did not end as asked" in answer.err
    assert "step_limit" in answer.out


def test_check_and_run_know_the_table(tmp_path: Path) -> None:
    file = written(tmp_path, scenario() + "[sweep]\nsampling = 3\n")
    for command in ("check", "run", "sweep"):
        answer = call(command, file, folder=tmp_path)
        assert answer.code == 2
        assert "`sweep.sampling` must be one of 'grid'" in answer.err
    good = written(tmp_path, scenario() + '[sweep.over]\n"load.thrust" = [1.0]\n', "good.toml")
    assert call("check", good, folder=tmp_path).code == 0
    assert call("run", good, folder=tmp_path).code == 0


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("--engine", "mpi"), "`engine` must be one of"),
        (("--plot", "a.txt"), "must end in one of"),
        (("--workers", "-3"), "`workers` must be"),
        (("--status",), "is no folder of a sweep"),
        (("--scheduler", "tcp://127.0.0.1:8786"), "belongs to engine"),
        (("--engine", "dask", "--scheduler", "localhost"), "must be the address of a scheduler, such as"),
    ],
)
def test_options_that_cannot_be_used(arguments: tuple[str, ...], said: str, tmp_path: Path) -> None:
    answer = call("sweep", written(tmp_path, REGIME_SWEEP), *arguments, folder=tmp_path)
    assert answer.code == 2
    assert said in answer.err
    assert not (tmp_path / "out").exists()


def check_refused_before(folder: Path) -> None:
    """What could not be drawn or written in the end is refused before a store is made."""
    kept = written(folder, REGIME_SWEEP)
    without = written(folder, REGIME_SWEEP.replace('"final", "verdict"', '"final"'), "without.toml")
    (folder / "map.png").mkdir()
    for file, arguments, said in (
        (kept, ("--plot", "a.txt"), "`--plot` must end in one of"),
        (kept, ("--plot", "nowhere/a.png"), "`--plot` must be a file in a folder that exists"),
        (kept, ("--plot", "strut.toml/a.png"), "`--plot` must be a file in a folder that exists"),
        (kept, ("--plot", "map.png"), "`--plot` must be a file in a folder that exists"),
        (without, ("--plot", "a.png"), "must have kept the verdict of its members"),
    ):
        try:
            answer = call("sweep", file, "--workers", "0", *arguments, folder=folder)
        except (OSError, ValueError, KeyError) as error:
            raise AssertionError(f"{arguments} came to {error!r}") from error
        assert answer.code == 2, arguments
        assert said in answer.err, answer.err
        assert not (folder / "out").exists(), arguments
    store = pl.sweep(kept, store=folder / "s.sweep", workers=0).path
    (store / "results.zarr" / "tip_y" / "c" / "0").unlink()
    (store / "reports").write_text("mine")
    for arguments in ((), ("--status",)):
        answer = call("sweep", store, "--workers", "0", "--reports", "1", *arguments, folder=folder)
        assert answer.code == 2, arguments
        assert "`--reports` needs the folder" in answer.err, answer.err
        assert not (store / "results.zarr" / "tip_y" / "c" / "0").exists()
    # What is there may be drawn or written about without anything being computed.
    (store / "reports").unlink()
    answer = call("sweep", store, "--status", "--plot", "b.png", "--reports", "1", folder=folder)
    assert (answer.code, (folder / "b.png").is_file()) == (0, True)


def test_what_is_wanted_is_checked_first(tmp_path: Path) -> None:
    check_refused_before(tmp_path)


RIGHT = ("tcp://127.0.0.1:8786", "host:8786", "tls://a-b.example.org:1", "tcp://[::1]:65535", "ws://[fe80::1%eth0]:80")
WRONG = (
    *("localhost", "", "foo://bar:1", "tcp://127.0.0.1:abc", "tcp://h:0", "tcp://h:65536"),
    *("h:1\n", "a b:1", "[]:1", "tcp://:8786", "tcp://h:1/x"),
)


def check_addresses() -> None:
    """What is no address by its form is refused before anything is made; what may be one is not."""
    for address in (*RIGHT, *WRONG):
        refused = False
        try:
            check_engine("dask", None, address)
        except ArgumentError:
            refused = True
        assert refused == (address in WRONG), address


def test_addresses_are_judged_by_their_form() -> None:
    check_addresses()


def test_a_scenario_without_the_table_is_no_sweep(tmp_path: Path) -> None:
    answer = call("sweep", written(tmp_path, scenario()), folder=tmp_path)
    assert answer.code == 2
    assert "must name what is varied" in answer.err
