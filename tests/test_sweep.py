"""Claim: each member of a sweep comes out as it would alone, and what is told of a sweep is so."""

from __future__ import annotations

from importlib.metadata import PackageNotFoundError
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import plastica as pl
from plastica.errors import ArgumentError, InadmissibleError, PlasticaError
from plastica.study import sweep_schema, sweep_versions
from plastica.study.sweep_outputs import REGIMES, STATUSES
from plastica.study.sweep_plan import Plan
from plastica.study.sweep_tasks import compute
from tests.commandline import scenario, si_scenario, written
from tests.swept import REGIME_SWEEP, plan, values

# -- each member as it would be alone --------------------------------------------------------------------------------

BATCHES: dict[str, tuple[str, dict[str, Any]]] = {
    "thrust and material": (
        scenario(),
        {"load.thrust": {"from": 0.5, "to": 6.0, "count": 4}, "material.parameters.k": [0.5, 2.0]},
    ),
    "amplitude of a shape": (
        scenario(initial='curvature = "cos(3*s) + 0.1"\nnatural_curvature = 0.1', solve="until = 30.0"),
        {"initial.amplitude": [0.1, 1.0, 8.0], "load.thrust": [2.0, 4.0]},
    ),
    "amplitude of pieces": (
        scenario(initial='curvature = { pieces = [1.0, "-s"], breaks = [0.5] }'),
        {"initial.amplitude": [0.1, 3.0]},
    ),
    "shapes": (
        scenario(),
        {"initial.curvature": ["0.1*cos(s)", "2 - step(s - 0.5)", {"pieces": [1.0, 2.0], "breaks": [0.3]}]},
    ),
    "numbers": (scenario(), {"initial.curvature": [0.1, 3.0], "initial.natural_curvature": [0.0, -1.0]}),
    "programs": (
        scenario(
            load='thrust = { program = "ramp-hold-release", value = 2.0, ramp = 0.2, hold = 1.0, release = 0.1 }',
            solve="until = 20.0",
        ),
        {"load.thrust.value": [1.0, 3.0], "load.thrust.hold": [0.5, 1.0]},
    ),
    "programs of several kinds": (
        scenario(solve="until = 10.0"),
        {"load.thrust": ["2 + sin(t)", {"program": "cycles", "low": 0.0, "high": 3.0, "period": 0.5, "count": 3}]},
    ),
    "a set that is yet to come": (
        scenario(initial="curvature = 1.0\nnatural_curvature = 0.5", solve="until = 0.02", load="thrust = 0.1"),
        {"initial.natural_curvature": [0.5, 0.05, 1.0], "initial.curvature": [1.0, 0.1]},
    ),
    "SI": (
        si_scenario(initial='curvature = "0.4 1/m"\nnatural_curvature = "0.4 1/m"', solve='until = "20 min"'),
        {"load.thrust": {"from": "0.3 N", "to": "2 N", "count": 3}, "initial.amplitude": [1.0, 5.0]},
    ),
    "automatic nodes": (
        scenario(grid='nodes = "auto"', solve="until = 20.0"),
        {"load.thrust": [1.0, 8.0], "initial.curvature": [0.1, 3.0]},
    ),
}


def check_members_alone(name: str) -> None:
    """What the batch tells of each member is what `solve` finds, and the verdict that of `Solution.outcome`."""
    text, over = BATCHES[name]
    times = {"SI": ["1 s", "2 min"], "a set that is yet to come": [0.0, 0.01]}.get(name, [0.0, 1.0])
    made = plan(over, text, outputs=["final", "verdict", "limit", "histories"], times=times)
    assert made.batched
    rows = values(made)
    told = compute(made, rows)
    for i, row in enumerate(rows):
        one = made.scenario(row)
        sol = pl.solve(
            one.model,
            one.curvature,
            one.natural_curvature,
            one.until,
            one.rtol,
            one.atol,
            times=np.append(made.times, []),
        )
        data = pl.solve(one.model, one.curvature, one.natural_curvature, one.until, one.rtol).dataset.isel(t=-1)
        length = sol.model.scales.length
        for variable in ("natural_curvature", "tip_x", "tip_y", "tip_angle", "drive", "liapunov"):
            kind = {
                "natural_curvature": 1.0 / length,
                "drive": sol.model.scales.drive,
                "liapunov": sol.model.scales.energy,
            }
            scale = kind.get(variable, 1.0 if variable == "tip_angle" else length)
            assert abs(told[variable][i] - float(data[variable])) <= 300.0 * one.rtol * scale, (variable, i)
            at = sol.dataset[variable].values if variable in sol.dataset else np.nan
            if variable != "drive":
                assert np.abs(told[f"{variable}_history"][i] - at).max() <= 300.0 * one.rtol * scale, (variable, i)
        outcome = sol.outcome
        due = int(outcome.shape == "buckled") + 2 * int(outcome.memory == "permanent set")
        assert REGIMES[told["regime"][i]] == REGIMES[due], (i, outcome.sentence)
        assert bool(told["yielding"][i]) == (outcome.excess > 0.0)


@pytest.mark.parametrize("name", BATCHES)
def test_members_of_a_batch_are_as_they_are_alone(name: str) -> None:
    check_members_alone(name)


def test_members_one_by_one_and_together_are_the_same_to_the_tolerance() -> None:
    over = {"load.thrust": {"from": 0.5, "to": 7.0, "count": 6}, "initial.amplitude": [1.0, 8.0, 40.0]}
    made = plan(over, scenario(solve="until = 30.0"), outputs=["final", "verdict", "limit", "state"])
    alone = plan({**over, "load.couple": [0.0]}, scenario(solve="until = 30.0"), outputs=list(made.outputs))
    assert made.batched
    assert not alone.batched
    a, b = compute(made, values(made)), compute(alone, values(alone))
    assert len(set(a["regime"].tolist())) >= 3
    for name in ("regime", "yielding", "status", "limit_kind", "limit_stable", "nodes"):
        assert np.array_equal(a[name], b[name]), name
    for name in ("natural_curvature", "drive", "tip_x", "tip_y", "largest_angle", "curvature", "time_reached"):
        assert np.abs(a[name] - b[name]).max() <= 1e-6, name


def test_other_models_and_loads_are_computed_one_by_one() -> None:
    text = scenario(inertia="translational_inertia = 0.01", grid="nodes = 8\nnatural_segments = 2")
    made = plan(
        {"load.couple": [0.0, 0.1], "inertia.translational_inertia": [0.01, 0.02]}, text, outputs=["final", "verdict"]
    )
    assert not made.batched
    told = compute(made, values(made))
    assert told["natural_curvature"].shape == (4, 2)
    assert np.isfinite(told["tip_y"]).all()
    assert np.unique(told["tip_y"]).size == 4


def test_machine_code_is_refused_where_it_is_of_no_use(monkeypatch: pytest.MonkeyPatch) -> None:
    over = {"load.thrust": [1.0, 2.0]}
    assert plan(over, library="numba").versions["numba"]
    with pytest.raises(PlasticaError, match=r"`sweep\.library` is of use only where members are computed together"):
        plan(over, scenario(grid="nodes = 16\nnatural_segments = 2"), library="numba")
    with pytest.raises(PlasticaError, match=r"`sweep\.library`.*numpy.*numba"):
        plan(over, library="fortran")

    def missing(name: str) -> str:
        raise PackageNotFoundError(name)

    monkeypatch.setattr(sweep_versions, "version", missing)
    with pytest.raises(PlasticaError, match=r"`sweep\.library` must be installed.*plastica\[fast\]"):
        plan(over, library="numba")


def check_nothing_depends_on_the_chunk(made: Plan) -> None:
    """To the last bit, members come out the same however they are cut into chunks."""
    rows = values(made)
    whole = compute(made, rows)
    for size in (1, 3):
        parts = [compute(made, rows[i : i + size]) for i in range(0, len(rows), size)]
        for name, column in whole.items():
            joined = np.concatenate([part[name] for part in parts])
            assert joined.tobytes() == column.tobytes(), name


DIPPING = (
    'preference = "k*m**2/2"\nflow = "pos(x)**2"\nthreshold = "h*((p - 2)**2 - 0.004)"\n'
    "parameters = { k = 1.0, h = 0.1, p = 0.0 }"
)
FADING = (
    'preference = "k*(cosh(m) - 1)"\nflow = "pos(x)**2"\nthreshold = "exp(-m**2) + (p - 2)**2 - 0.008"\n'
    "parameters = { k = 1.0, p = 0.0 }"
)
INADMISSIBLE: dict[str, tuple[str, dict[str, Any]]] = {
    "by formula": (DIPPING, {"material.parameters.p": {"from": 0.0, "to": 4.0, "count": 401}}),
    "by formula, under programs": (
        DIPPING,
        {
            "material.parameters.p": {"from": 0.0, "to": 4.0, "count": 101},
            "load.thrust": ["2 + sin(t)", {"program": "constant", "value": 1.0}],
        },
    ),
    "on a range": (
        FADING,
        {"material.parameters.p": {"from": 0.0, "to": 4.0, "count": 401}, "initial.natural_curvature": [0.1, -0.2]},
    ),
}


def check_inadmissible_members(name: str) -> None:
    """Members of a batch are refused where their material is as they would be alone, and only these."""
    material, over = INADMISSIBLE[name]
    made = plan(over, scenario(material=material, solve="until = 0.1"))
    assert made.batched
    rows = values(made)
    refused = compute(made, rows)["status"] == STATUSES.index("refused")
    assert 0 < refused.sum() < len(rows) / 2
    for i in {*np.flatnonzero(np.diff(refused.astype(int))), *np.flatnonzero(np.diff(refused.astype(int))) + 1}:
        try:
            made.scenario(rows[i])
        except InadmissibleError:
            assert refused[i], i
        else:
            assert not refused[i], i
    allowed = plan(over, scenario(material=f"{material}\nallow_inadmissible = true", solve="until = 0.1"))
    assert not (compute(allowed, rows)["status"] == STATUSES.index("refused")).any()


@pytest.mark.parametrize("name", INADMISSIBLE)
def test_inadmissible_members_are_refused(name: str) -> None:
    check_inadmissible_members(name)


JUMPS = ["0.1*cos(s)", "2 - step(s - 0.5)", {"pieces": [1.0, 2.0], "breaks": [0.3]}, "1 + step(s - 0.5)"]


def test_nothing_depends_on_the_chunk_where_shapes_jump() -> None:
    check_nothing_depends_on_the_chunk(plan({"initial.curvature": JUMPS, "load.thrust": [1.0, 2.0]}))


def check_states_share_their_nodes() -> None:
    """Starts that jump elsewhere than the scenario's are refused where states are kept; tried or not, alone or not."""
    halves = scenario(initial="curvature = { pieces = [1.0, 0.0], breaks = [0.5] }")
    for text, shapes in ((scenario(), ["1", JUMPS[2]]), (scenario(), ["1", "step(s - 0.5)"]), (halves, ["1", "s"])):
        for more in ({}, {"load.couple": [0.1]}):
            with pytest.raises(PlasticaError, match=r"initial.curvature.* must jump or bend where that of"):
                plan({"initial.curvature": shapes, **more}, text, outputs=["final", "state"])
            plan({"initial.curvature": shapes, **more}, text)
    with pytest.raises(PlasticaError, match=r"must jump or bend where .*\(0.5 L\)"):
        plan({"initial.curvature": [1.0, 2.0]}, halves, outputs=["state"])
    some = [f"{1 + 0.01 * i:.2f}*step(s - 0.5)" for i in range(40)]
    some[17] = "step(s - 0.25)"
    made = plan({"initial.curvature": some}, halves, outputs=["final", "state"])
    assert made.batched
    told = compute(made, values(made))
    assert told["curvature"].shape == (40, 24)
    assert np.flatnonzero(told["status"] == STATUSES.index("refused")).tolist() == [17]
    assert np.isnan(told["curvature"]).all(axis=1).tolist() == [i == 17 for i in range(40)]
    with pytest.raises(ArgumentError, match="must jump or bend"):
        made.scenario(np.array([17.0]))


def test_states_share_their_nodes() -> None:
    check_states_share_their_nodes()


def test_nothing_depends_on_the_chunk() -> None:
    over = {"load.thrust": {"from": 0.5, "to": 6.0, "count": 4}, "initial.amplitude": [0.5, 5.0]}
    check_nothing_depends_on_the_chunk(plan(over, outputs=["final", "verdict", "state"]))


def test_a_member_that_is_refused_is_told_as_such(tmp_path: Path) -> None:
    text = scenario(load='thrust = { program = "table", times = [0.0, 1.0], values = [1.0, 2.0] }')
    over = {"load.thrust.times": [[0.0, 1.0], [0.0, 2.0]] + [[0.0, 1.0 + 0.01 * i] for i in range(40)]}
    over["load.thrust.times"][18] = [1.0, 0.0]
    found = pl.sweep(text, over, store=tmp_path / "s.sweep", workers=0)
    data = found.dataset
    assert found.counts == {"done": 41, "refused": 1}
    assert found.failed == 1
    assert str(data.status.values[18]) == "refused"
    assert np.isnan(data.tip_y.values[18])
    assert np.isfinite(np.delete(data.tip_y.values, 18)).all()
    with pytest.raises(PlasticaError, match="must increase"):
        found.scenario(18)
    assert found.interesting(1)[0].member == 18


# -- what is told of a sweep -----------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def found(tmp_path_factory: pytest.TempPathFactory) -> pl.Sweep:
    folder = tmp_path_factory.mktemp("sweep")
    return pl.sweep(written(folder, REGIME_SWEEP), store=folder / "s.sweep", workers=0)


def test_the_dataset_is_labelled(found: pl.Sweep) -> None:
    data = found.dataset
    assert data.sizes == {"member": 30}
    assert {"load.thrust", "initial.amplitude"} <= set(data.coords)
    for name, variable in data.data_vars.items():
        assert variable.attrs["units"], name
        assert variable.attrs["long_name"], name
    assert set(data.status.values.tolist()) == {"done"}
    assert sum(found.regimes.values()) == 30
    assert found.complete
    assert str(found).startswith("sweep     30 members over load.thrust, initial.amplitude (grid)")
    assert set(found.to_dataset(["tip_y"]).data_vars) == {"tip_y"}
    with pytest.raises(ArgumentError, match="must be variables of the sweep"):
        found.to_dataset(["tip_z"])


def test_xarray_opens_the_results_as_they_are(found: pl.Sweep) -> None:
    import xarray

    data = xarray.open_zarr(found.results, consolidated=False, chunks=None, decode_cf=False)
    assert np.array_equal(data["tip_y"].values, found.dataset["tip_y"].values)
    assert data["regime"].attrs["flag_meanings"].split()[0] == "recovers"


def test_one_member_is_an_ordinary_run(found: pl.Sweep) -> None:
    member = 22
    sol = found.solve(member)
    data = found.dataset.isel(member=member)
    assert abs(float(sol.dataset.tip_y[-1]) - float(data.tip_y)) <= 1e-6
    assert sol.provenance["member"].startswith("member 22: load.thrust = ")
    assert found.values(member) == {
        "load.thrust": float(data["load.thrust"]),
        "initial.amplitude": float(data["initial.amplitude"]),
    }
    for wrong in (-1, 30, 1.5, True, "a"):
        with pytest.raises(ArgumentError, match="must be a member, 0 to 29"):
            found.scenario(wrong)  # type: ignore[arg-type]


def check_interesting(found: pl.Sweep) -> None:
    """Members said to be on a boundary have a neighbour in the grid that comes to the other regime."""
    regimes = found.dataset["regime"].values.reshape(found.plan.members.shape)
    some = found.interesting(12)
    assert len({each.member for each in some}) == len(some) == 12
    on = [each for each in some if "boundary" in each.why]
    assert len(on) >= 3
    for each in on:
        words = each.why.removeprefix("on the boundary between ").split(" and ", 1)
        i, j = np.unravel_index(each.member, regimes.shape)
        beside = [
            regimes[a, b] for a, b in ((i - 1, j), (i + 1, j), (i, j - 1), (i, j + 1)) if 0 <= a < 6 and 0 <= b < 5
        ]
        assert regimes[i, j] in words
        assert any(other in words and other != regimes[i, j] for other in beside)


def test_members_worth_a_look(found: pl.Sweep) -> None:
    check_interesting(found)
    largest = int(np.abs(found.dataset["natural_curvature"].values).argmax())
    assert largest in {each.member for each in found.interesting(12)}
    with pytest.raises(ArgumentError, match="must be a positive whole number"):
        found.interesting(0)


def test_progress_tells_members_rate_and_time_left(tmp_path: Path) -> None:
    heard: list[Any] = []
    over = {"load.thrust": {"from": 0.5, "to": 3.0, "count": 12}}
    pl.sweep(scenario(), over, store=tmp_path / "s.sweep", workers=0, chunk=4, progress=heard.append)
    assert [now.members for now in heard] == [0, 4, 8, 12]
    assert {now.of for now in heard} == {12}
    assert np.isnan(heard[0].left)
    assert heard[-1].left == 0.0
    assert all(now.rate > 0.0 and now.left == (12 - now.members) / now.rate for now in heard[1:])
    again: list[Any] = []
    pl.sweep(scenario(), over, store=tmp_path / "s.sweep", workers=0, chunk=4, progress=again.append)
    assert [(now.members, now.rate) for now in again] == [(12, 0.0)]


def test_an_estimate_is_told_beforehand(tmp_path: Path) -> None:
    over = {"load.thrust": {"from": 0.5, "to": 3.0, "count": 600}}
    told = pl.estimate_sweep(scenario(), over, workers=1)
    assert (told.members, told.chunks, told.workers, told.pilot) == (600, 1, 1, 512)
    found = pl.sweep(scenario(), over, store=tmp_path / "s.sweep", workers=0)
    held = sum(path.stat().st_size for path in found.results.rglob("*") if path.is_file() and "c" in path.parts)
    assert 0.5 * held <= told.bytes <= 2.0 * held
    assert told.bytes <= told.largest_bytes
    assert 600 * told.seconds_per_member <= told.seconds
    assert "600 members in 1 chunk: about " in str(told)


def test_the_example_shows_what_its_head_says(tmp_path: Path) -> None:
    examples = Path(__file__).resolve().parent.parent / "examples"
    found = pl.sweep(examples / "sweep_pmma_strip.toml", store=tmp_path / "s.sweep", workers=0)
    assert found.regimes == {"recovers": 283, "permanent set": 154}
    thrust, threshold = (axis.values for axis in found.axes)
    kept = (found.dataset["regime"].values == "permanent set").reshape(thrust.size, threshold.size)
    assert not kept[thrust < 0.7328].any()
    highest = [float(threshold[row].max()) for row in kept if row.any()]
    assert np.all(np.diff(highest) >= 0.0)
    assert 0.010 < highest[0] < 0.0115
    assert 0.0245 < highest[-1] < 0.0255


def test_every_key_of_the_table_is_documented() -> None:
    from tests.test_docs import code, rows

    assert [code(row[0]) for row in rows("sweeps.md", "[sweep]")] == list(sweep_schema.Sweep.model_fields)
    table = {code(row[0]) for row in rows("sweeps.md", "What is kept")}
    assert table == set(sweep_schema.OUTPUTS)
