"""Claim: the members of a sweep are those asked for, and mistakes in what is varied are told before anything runs."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import plastica as pl
from plastica.errors import ArgumentError, FileError, ScenarioError
from plastica.study.reading import document_of
from plastica.study.scenario import read_scenario
from plastica.study.sweep import plan_of
from plastica.study.sweep_axes import Axis, flattened
from plastica.study.sweep_create import create
from plastica.study.sweep_members import Members, members_of
from plastica.study.sweep_reading import _chunk, make_plan
from plastica.study.sweep_store import open_store
from tests.commandline import call, scenario, si_scenario, written
from tests.swept import plan, values

# -- members ---------------------------------------------------------------------------------------------------------


def test_a_grid_is_all_combinations_the_first_key_varying_slowest() -> None:
    made = plan({"load.thrust": [1.0, 2.0], "material.parameters.k": {"from": 0.5, "to": 1.5, "count": 3}})
    assert made.count == 6
    assert values(made).tolist() == [[1, 0.5], [1, 1.0], [1, 1.5], [2, 0.5], [2, 1.0], [2, 1.5]]


def test_a_list_goes_side_by_side() -> None:
    made = plan({"load.thrust": [1.0, 2.0], "initial.natural_curvature": [0.3, 0.4]}, sampling="list")
    assert values(made).tolist() == [[1.0, 0.3], [2.0, 0.4]]
    with pytest.raises(ScenarioError, match=r"as many values of each key .* \(2 of load.thrust, 3 of"):
        plan({"load.thrust": [1.0, 2.0], "initial.curvature": [0.1, 0.2, 0.3]}, sampling="list")


def test_ranges_are_even_or_in_equal_ratios() -> None:
    made = plan({"load.thrust": {"from": 0.5, "to": 8.0, "count": 5, "spacing": "log"}})
    assert np.abs(values(made)[:, 0] / [0.5, 1.0, 2.0, 4.0, 8.0] - 1.0).max() <= 4e-16


def check_whole_ranges() -> None:
    """Between whole ends, values that are whole make whole numbers, as some keys ask for; others do not."""
    powers = plan({"load.thrust": {"from": 1, "to": 100_000, "count": 6, "spacing": "log"}}).axes[0]
    assert (powers.kind, powers.values.tolist()) == ("whole", [1.0, 10.0, 100.0, 1e3, 1e4, 1e5])
    made = plan({"grid.nodes": {"from": 8, "to": 24, "count": 3}}).axes[0]
    assert (made.kind, made.values.tolist()) == ("whole", [8.0, 16.0, 24.0])
    for ends in ((1, 2), (1.0, 3.0)):
        assert plan({"load.thrust": {"from": ends[0], "to": ends[1], "count": 3}}).axes[0].kind == "number"


def test_whole_ranges_are_of_whole_numbers() -> None:
    check_whole_ranges()


CYCLES = 'thrust = { program = "cycles", low = 0.0, high = 2.0, period = 0.5, count = 2 }'


def check_words_of_a_range() -> None:
    """A key of a scenario may be called as a word of a range is: `count` of cycles, one table further in."""
    assert dict(flattened({"load": {"thrust": {"count": [1, 2, 3]}}})) == {"load.thrust.count": [1, 2, 3]}
    text = scenario(load=CYCLES) + "[sweep.over]\nload.thrust.count = [1, 2, 3]\n"
    made = plan(None, text)
    assert [axis.key for axis in made.axes] == ["load.thrust.count"]
    assert values(made)[:, 0].tolist() == [1.0, 2.0, 3.0]


def test_keys_called_as_the_words_of_a_range() -> None:
    check_words_of_a_range()
    with pytest.raises(ScenarioError, match=r"thrust.count'` must be an array of values, or a range"):
        plan({"load.thrust": {"count": 3}}, scenario(load=CYCLES))


def check_latin(members: Members) -> None:
    """Cut into as many equal parts as there are members, each axis has one member in each part."""
    rows = np.concatenate(list(members.blocks(7)))
    for axis, column in zip(members.axes, rows.T, strict=True):
        low, high = axis.values
        place = np.log(column / low) / np.log(high / low) if axis.spacing == "log" else (column - low) / (high - low)
        assert sorted(np.floor(place * members.count).astype(int)) == list(range(members.count))


LATIN = (
    Axis("a", "number", "", np.array([1.0, 3.0]), (), "linear"),
    Axis("b", "number", "", np.array([1.0, 100.0]), (), "log"),
)


def test_a_latin_hypercube_has_one_member_in_every_part() -> None:
    check_latin(members_of(LATIN, "latin-hypercube", 40, 7))


@settings(deadline=None, max_examples=20, derandomize=True)
@given(st.integers(1, 60), st.integers(1, 60), st.integers(0, 2**32))
def test_random_members_do_not_depend_on_blocks(one: int, other: int, seed: int) -> None:
    drawn = members_of(LATIN, "random", 60, seed)
    a, b = (np.concatenate(list(drawn.blocks(size))) for size in (one, other))
    assert np.array_equal(a, b)
    assert np.all((a >= [1.0, 1.0]) & (a < [3.0, 100.0]))


def test_another_seed_draws_others() -> None:
    rows = [np.concatenate(list(members_of(LATIN, "random", 9, seed).blocks(9))) for seed in (0, 1)]
    assert not np.any(rows[0] == rows[1])


def test_drawn_members_choose_among_listed_values() -> None:
    made = plan(
        {"load.thrust": [1.0, 2.0], "initial.curvature": {"from": 0.0, "to": 1.0}}, sampling="random", members=200
    )
    rows = values(made)
    assert set(rows[:, 0]) == {1.0, 2.0}
    assert 60 <= int((rows[:, 0] == 1.0).sum()) <= 140


def test_members_from_a_file(tmp_path: Path) -> None:
    (tmp_path / "members.csv").write_text("load.thrust [mN], material.parameters.h [N*m**2]\n900, 0.003\n1100, 0.004\n")
    file = written(tmp_path, si_scenario() + '[sweep]\nsampling = "csv"\ncsv = "members.csv"\n')
    found = pl.sweep(file, store=tmp_path / "s.sweep", workers=0)
    data = found.dataset
    assert np.abs(data["load.thrust"].values - [0.9, 1.1]).max() <= 1e-15
    assert data["load.thrust"].attrs["units"] == "N"
    assert data["material.parameters.h"].values.tolist() == [0.003, 0.004]
    assert (found.path / "members.csv").read_bytes() == (tmp_path / "members.csv").read_bytes()


BAD_CSV = {
    "": "must have a heading",
    "load.thrust\n": "must have a heading",
    "load.thrust [N], load.thrust [N]\n1,2\n": "must name each key once",
    "load.thrust [N]\n1,2\n": "must have 1 cells in every row, but row 2 has 2",
    "load.thrust [N], initial.amplitude\n1,2\n\n1,\n": "but row 4 has none for `initial.amplitude`",
    "load.thrust [N], initial.amplitude\n ,2\n": "but row 2 has none for `load.thrust`",
    'initial.amplitude\n2.0\n"3,0"\n': "must be plain numbers, which multiply the initial curvature, but is '2.0'",
    "initial.amplitude [mm]\n2.0\n": "must be plain numbers, which multiply the initial curvature",
    "load.thrust [N]\nx\n": "must have numbers below",
    "load.trust [N]\n1\n": "Did you mean `thrust`?",
    "load.thrust [m]\n1\n": "of another kind",
    "load.thrust\n1.0\n": "needs a unit",
    "1.0,2.0\n3.0,4.0\n": "must begin with at most",
}


@pytest.mark.parametrize("text", BAD_CSV)
def test_files_of_members_that_cannot_be_used(text: str, tmp_path: Path) -> None:
    (tmp_path / "members.csv").write_text(text)
    file = written(tmp_path, si_scenario() + '[sweep]\nsampling = "csv"\ncsv = "members.csv"\n')
    answer = call("sweep", file, folder=tmp_path)
    assert answer.code == 2
    said = "must be N" if BAD_CSV[text] == "of another kind" else BAD_CSV[text]
    assert said in answer.err or (said == "must be N" and "must be a quantity in N" in answer.err), answer.err
    assert not (tmp_path / "out").exists()


# -- mistakes --------------------------------------------------------------------------------------------------------

MISTAKES: list[tuple[dict[str, Any], str]] = [
    ({"over": {"load.thrus": [1.0]}}, "Did you mean `thrust`?"),
    ({"over": {"lod.thrust": [1.0]}}, "Did you mean `load`?"),
    ({"over": {"output.name": ["a"]}}, "cannot be varied"),
    ({"over": {"load.thrust": [1.0, -2.0]}}, "'load.thrust'[1]` must not be negative"),
    ({"over": {"load.thrust": ["1 N"]}}, 'Quantities with units need units = "SI"'),
    ({"over": {"load.thrust": []}}, "must have 1 to"),
    ({"over": {"load.thrust": 2.0}}, "must be an array of values, or a range"),
    ({"over": {"load.thrust": {"from": 1.0}}}, ".to` is missing"),
    ({"over": {"load.thrust": {"from": 1.0, "to": 2.0}}}, ".count` is missing"),
    ({"over": {"load.thrust": {"from": 1.0, "to": 1.0, "count": 3}}}, "must be another quantity"),
    ({"over": {"load.thrust": {"from": 0.0, "to": 1.0, "count": 3, "spacing": "log"}}}, "must be of one sign"),
    ({"over": {"load.thrust": {"from": 1.0, "to": 2.0, "count": 3, "step": 1}}}, "step` is not a known key"),
    ({"over": {"load.thrust": {"from": 1.0, "to": 2.0, "count": 1}}}, "must be a whole number from 2 to"),
    ({"over": {"load.thrust.value": [1.0]}}, "must lead to a key of the scenario"),
    ({"over": {"load.thrust": [float("nan")]}}, "must be finite"),
    ({"over": {"material.parameters.h": [0.1, 0.0]}}, "'material.parameters.h'[1]` cannot be used: the material must"),
    ({"over": {"grid.nodes": [8, 1000]}}, "'grid.nodes'[1]`"),
    ({"over": {"initial.amplitude": ["big", "small"]}}, "which multiply the initial curvature, but is 'big'"),
    ({"over": {"initial.amplitude": [2.0, True]}}, "but is True"),
    ({"over": {}}, "must name what is varied"),
    ({"over": [1.0]}, "must be a table of keys"),
    ({"over": {"load.thrust": [1.0]}, "sampling": "all"}, "must be one of 'grid'"),
    ({"over": {"load.thrust": [1.0]}, "members": 3}, "belongs to drawn members"),
    ({"over": {"load.thrust": [1.0]}, "sampling": "random"}, "sweep.members` is missing"),
    ({"over": {"load.thrust": [1.0]}, "outputs": ["finale"]}, "Did you mean `final`?"),
    ({"over": {"load.thrust": [1.0]}, "outputs": ["histories"]}, "needs times at which to look"),
    ({"over": {"load.thrust": [1.0]}, "outputs": ["histories"], "times": [1.0, 9.0]}, "increase within [0, 2]"),
    ({"over": {"load.thrust": [1.0]}, "chunk": 0}, "must be at least 1"),
    ({"over": {"load.thrust": [1.0]}, "chunk": 10**15}, "`sweep.chunk` must be at most 1000000 members"),
    ({"over": {"load.thrust": [1.0]}, "csv": "a.csv"}, 'belongs to sampling = "csv"'),
    ({"over": {"load.thrust": [1.0]}, "seed": -1}, "must not be negative"),
    ({"sampling": "csv", "csv": "../a.csv"}, "must name a file in the folder"),
    ({"over": {"solve.times": [[1.0]]}}, "cannot be varied: all members share it"),
    ({"over": {"grid.nodes": [8, 12]}, "outputs": ["state"]}, "cannot be varied where outputs hold"),
    ({"over": {f"load.a{i}": [1.0] for i in range(2)}}, "2 mistakes"),
    (
        {"over": {"load.thrust": {"from": 0.0, "to": 1.0}}, "sampling": "latin-hypercube", "members": 10**8},
        "must be at most 10000000 for a Latin hypercube",
    ),
    (
        {"over": {f"material.parameters.{name}": {"from": 1.0, "to": 2.0, "count": 100_000} for name in "kc"}},
        "must come to at most 2000000000 members",
    ),
]


def check_chunk_is_bounded() -> None:
    """A task of more members than fit into memory is refused; one of the most members that are allowed is not."""
    over = {"load.thrust": {"from": 0.5, "to": 3.0}}
    assert plan(over, sampling="random", members=3, chunk=10**6).chunk == 10**6
    with pytest.raises(ScenarioError, match=r"`sweep\.chunk` must be at most 1000000 members, but is 1000001"):
        plan(over, sampling="random", members=3, chunk=10**6 + 1)


def test_the_size_of_a_chunk_is_bounded() -> None:
    check_chunk_is_bounded()


@pytest.mark.parametrize(("table", "said"), MISTAKES, ids=[said[:40] for _, said in MISTAKES])
def test_mistakes_are_told(table: dict[str, Any], said: str, tmp_path: Path) -> None:
    with pytest.raises(ScenarioError) as refused:
        pl.sweep(
            written(tmp_path, scenario()),
            table.get("over"),
            store=tmp_path / "s",
            **{k: v for k, v in table.items() if k != "over"},
        )
    assert said in str(refused.value), refused.value
    assert not (tmp_path / "s").exists()


WRONG_KEYS = {
    "load.trust = [1.0]": "line 18: `sweep.over.'load.trust'` is not a known key. Did you mean `thrust`?",
    'load.thrust = [1.0]\n"load.thrust" = [2.0]': "`sweep.over.'load.thrust'` is varied twice",
    '"load.thrust" = [1.0]\nload.thrust = [1.0]': "`sweep.over.'load.thrust'` is varied twice",
    '"load.thrust.value" = [1.0]\nload.thrust = [2.0]': "'load.thrust.value'` is a part of `load.thrust`",
    "load.thrust = { from = 1.0 }": "`sweep.over.'load.thrust'.to` is missing",
}


def check_keys_before_anything(text: str, folder: Path) -> None:
    """What is wrong with the keys of a sweep is said by `plastica check` as by `plastica sweep`, and nothing runs."""
    file = written(folder, scenario() + f"[sweep.over]\n{text}\n")
    for command in ("check", "sweep"):
        answer = call(command, file, folder=folder)
        assert answer.code == 2, answer.out
        assert "1 mistake\n" in answer.err
        assert WRONG_KEYS[text] in answer.err
    assert not (folder / "out").exists()


@pytest.mark.parametrize("text", WRONG_KEYS)
def test_wrong_keys_are_told_before_anything_runs(text: str, tmp_path: Path) -> None:
    check_keys_before_anything(text, tmp_path)


AMPLITUDES_OF_ANOTHER_KIND: list[Any] = [
    ["50 mm", "60 mm"],
    ["2", "3"],
    [True, False],
    [1.0, "3,0"],
    [[1.0], [2.0]],
    {"from": "1 mm", "to": "2 mm", "count": 2},
]


def check_amplitudes(given: Any) -> None:
    """What is no plain number is refused as a factor of the initial curvature; its place was taken for it once."""
    with pytest.raises(ScenarioError, match=r"initial\.amplitude'.* must be (plain numbers|a number)"):
        plan({"initial.amplitude": given}, si_scenario())


@pytest.mark.parametrize("given", AMPLITUDES_OF_ANOTHER_KIND, ids=str)
def test_amplitudes_are_plain_numbers(given: Any) -> None:
    check_amplitudes(given)


TABLE = 'thrust = { program = "table", times = [0.0, 2.0], values = [0.0, 1.0] }'
TABLES = {
    "load.thrust.times": [[0.0, 2.0], [0.0, 1.0, 2.0], [0.0, 2.0]],
    "load.thrust.values": [[0.0, 1.0], [0.0, 1.0, 2.0], [0.0, 3.0]],
}


def check_lists_are_tried_as_they_go_together(folder: Path) -> None:
    """Values that make no scenario but beside one another are a sweep; those that make none there are refused."""
    assert plan(TABLES, scenario(load=TABLE), sampling="list").count == 3
    (folder / "m.csv").write_text("load.thrust.low,load.thrust.high\n0.0,2.0\n3.0,5.0\n4.0,4.5\n", encoding="utf-8")
    file = written(folder, scenario(load=CYCLES))
    assert plan_of(file, {"sampling": "csv", "csv": "m.csv"}).count == 3
    wrong = {**TABLES, "load.thrust.values": [*TABLES["load.thrust.values"][:2], [0.0]]}
    with pytest.raises(ScenarioError, match=r"'load.thrust.values'\[2\]` must have as many entries as `times`"):
        plan(wrong, scenario(load=TABLE), sampling="list")


def test_lists_are_tried_as_they_go_together(tmp_path: Path) -> None:
    check_lists_are_tried_as_they_go_together(tmp_path)


def test_what_goes_wrong_in_a_list_is_told_at_its_place(tmp_path: Path) -> None:
    thrust = [1.0 + 0.01 * i for i in range(100)]
    thrust[61] = -1.0
    with pytest.raises(ScenarioError, match=r"'load.thrust'\[61\]` must not be negative"):
        plan({"load.thrust": thrust, "initial.natural_curvature": thrust}, sampling="list")
    (tmp_path / "m.csv").write_text("load.thrust\n" + "\n".join(map(str, thrust)), encoding="utf-8")
    with pytest.raises(ScenarioError, match=r"`sweep.csv` has a member that cannot be used, with load.thrust = -1: "):
        plan_of(written(tmp_path, scenario()), {"sampling": "csv", "csv": "m.csv"})


def test_what_goes_wrong_at_a_corner_is_told_before_the_sweep() -> None:
    text = scenario(
        material='preference = "k*m**2/2"\nflow = "c*pos(x)**2"\nthreshold = "h - g"\n'
        "parameters = { k = 1.0, c = 1.0, h = 1.0, g = 0.1 }"
    )
    with pytest.raises(ScenarioError, match=r"together cannot be used where material.parameters.h = 0.2, .*g = 0.5"):
        plan({"material.parameters.h": [1.0, 0.2], "material.parameters.g": [0.1, 0.5]}, text)


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ({"engine": "threads"}, "`engine` must be one of local, dask"),
        ({"workers": -1}, "`workers` must be a whole number from 0"),
        ({"workers": True}, "`workers` must be a whole number from 0"),
        ({"scheduler": "tcp://localhost:1"}, '`scheduler` belongs to engine="dask"'),
        ({"engine": "dask", "scheduler": "tcp://localhost:1", "workers": 2}, "`workers` must be left out"),
        ({"engine": "dask", "scheduler": 8786}, "`scheduler` must be the address"),
    ],
)
def test_engines_that_cannot_be_had(arguments: dict[str, Any], said: str, tmp_path: Path) -> None:
    with pytest.raises(ArgumentError) as refused:
        pl.sweep(scenario(), {"load.thrust": [1.0]}, store=tmp_path / "s", **arguments)
    assert said in str(refused.value)
    assert not (tmp_path / "s").exists()


def test_a_scenario_may_be_a_path_a_text_or_read(tmp_path: Path) -> None:
    file = written(tmp_path, scenario())
    plans = [make_plan(document_of(scenario(), file), {"over": {"load.thrust": [1.0]}}).identity]
    for i, either in enumerate((file, str(file), scenario(), read_scenario(file))):
        found = pl.sweep(either, {"load.thrust": [1.0]}, store=tmp_path / f"{i}.sweep", workers=0)
        plans.append(found.store.identity)
    assert len(set(plans)) == 1
    with pytest.raises(ArgumentError, match="must be the path or the text of a scenario"):
        pl.sweep(3, {"load.thrust": [1.0]}, workers=0)  # type: ignore[arg-type]


def check_paths_with_equals(folder: Path) -> None:
    """A name with "=" in it is a path, and one that leads to nothing is told as a file; text has more than one line."""
    file = written(folder, scenario(), "k=1.toml")
    assert plan_of(str(file), {"over": {"load.thrust": [1.0]}}).document.file == file
    with pytest.raises(FileError, match=r"k=2\.toml"):
        plan_of(str(folder / "k=2.toml"), {"over": {"load.thrust": [1.0]}})


def test_a_path_may_have_an_equals_sign(tmp_path: Path) -> None:
    check_paths_with_equals(tmp_path)


DRAWN = '[sweep]\nsampling = "latin-hypercube"\nmembers = 7\nover.load.thrust = { from = 0.5, to = 2.0 }\n'
FROM_FILE = '[sweep]\nsampling = "csv"\ncsv = "members.csv"\n'


def check_another_sampling(folder: Path) -> None:
    """Where the call takes another sampling, what belongs to the file's gives way, in the store too."""
    (folder / "members.csv").write_text("load.thrust\n1.5\n2.5\n", encoding="utf-8")
    drawn, listed = (written(folder, scenario() + text, f"{i}.toml") for i, text in enumerate((DRAWN, FROM_FILE)))
    over = {"load.thrust": [1.0, 2.0]}
    for file, asked, count in (
        (drawn, {"sampling": "grid", "over": over}, 2),
        (drawn, {"sampling": "csv", "csv": "members.csv"}, 2),
        (drawn, {"sampling": "random"}, 7),
        (listed, {"sampling": "list", "over": over}, 2),
        (listed, {"sampling": "random", "over": {"load.thrust": {"from": 1.0, "to": 2.0}}, "members": 4}, 4),
    ):
        made = plan_of(file, asked)
        assert made.count == count
        store = create(folder / f"{made.identity[:8]}.sweep", made)
        again = open_store(store.folder).plan
        assert np.array_equal(values(again), values(made))
        assert {**again.table, "chunk": None} == {**made.table, "chunk": None}


def test_another_sampling_takes_the_place_of_the_files(tmp_path: Path) -> None:
    check_another_sampling(tmp_path)
    with pytest.raises(ScenarioError, match="belongs to drawn members"):
        plan_of(tmp_path / "0.toml", {"sampling": "grid", "over": {"load.thrust": [1.0]}, "members": 3})


def test_the_number_of_chunks_stays_bounded() -> None:
    made = plan({"load.thrust": {"from": 0.5, "to": 3.0, "count": 3}})
    for count, chunk in ((3, 2048), (100_000, 2048), (10**6, 8192), (10**9, 100_000)):
        assert _chunk(replace(made, members=replace(made.members, sampling="random", count=count))) == chunk
