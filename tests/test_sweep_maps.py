"""Claim: pictures of a sweep are drawn over scales that suit the values, leave out nothing unsaid, and can be read."""

from __future__ import annotations

import itertools
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

import plastica as pl
from plastica.show import regimes
from tests.commandline import scenario

RANGE = {"from": 0.5, "to": 5.0}
DECADES = {"from": 0.1, "to": 30.0, "spacing": "log"}


def swept(folder: Path, over: dict[str, Any], **table: Any) -> pl.Sweep:
    return pl.sweep(scenario(), over, store=folder / f"{len(list(folder.iterdir()))}.sweep", workers=0, **table)


def scales_of(found: pl.Sweep) -> tuple[str, str]:
    ax = regimes.regimes_figure(found).axes[0]
    return ax.get_xscale(), ax.get_yscale()


def check_scales(folder: Path) -> None:
    """Ranges that are drawn in ratios, and lists that spread over decades, are drawn over their logarithm."""
    over = {"load.thrust": RANGE, "initial.amplitude": DECADES}
    for sampling in ("latin-hypercube", "random"):
        assert scales_of(swept(folder, over, sampling=sampling, members=12)) == ("linear", "log")
    rng = np.random.default_rng(0)
    even, spread = rng.uniform(0.001, 1.0, 40).tolist(), (10.0 ** rng.uniform(-3.0, 0.0, 40)).tolist()
    lists = {"load.thrust": even, "initial.amplitude": spread}
    assert scales_of(swept(folder, lists, sampling="list")) == ("linear", "log")
    rows = "\n".join(f"{a!r},{b!r}" for a, b in zip(even, spread, strict=True))
    (folder / "rows.csv").write_text(f"load.thrust,initial.amplitude\n{rows}\n")
    file = folder / "csv.toml"
    file.write_text(scenario())
    found = pl.sweep(file, sampling="csv", csv="rows.csv", store=folder / "csv.sweep", workers=0)
    assert scales_of(found) == ("linear", "log")


def test_scales_suit_the_values(tmp_path: Path) -> None:
    check_scales(tmp_path)


SEVEN = {
    "load.thrust": RANGE,
    "initial.amplitude": RANGE,
    "initial.curvature": RANGE,
    "initial.natural_curvature": {"from": 0.1, "to": 0.2},
    "material.parameters.k": {"from": 0.9, "to": 1.1},
    "solve.rtol": {"from": 1e-8, "to": 1e-6},
    "solve.max_steps": [5000, 6000],
}


def check_pairs(folder: Path) -> None:
    """Every pair of up to six keys has a panel; of more keys it is said which pairs have none."""
    for count in (5, 6, 7):
        keys = list(SEVEN)[:count]
        found = swept(folder, {key: SEVEN[key] for key in keys}, sampling="random", members=3)
        figure = regimes.regimes_figure(found)
        drawn = {(ax.get_xlabel(), ax.get_ylabel()) for ax in figure.axes if ax.get_visible()}
        assert drawn == set(itertools.combinations(keys[:6], 2))
        said = figure.legends[0].get_title().get_text()
        assert said == ("Not drawn: pairs with solve.max_steps" if count == 7 else "")


def test_every_pair_has_a_panel_or_is_named(tmp_path: Path) -> None:
    check_pairs(tmp_path)


def check_legend(folder: Path) -> None:
    """Points are explained by points of their shape and colour, areas by patches."""
    over = {"load.thrust": RANGE, "initial.amplitude": DECADES}
    figure = regimes.regimes_figure(swept(folder, over, sampling="random", members=30))
    legend = figure.legends[0]
    names = [text.get_text() for text in legend.get_texts()]
    assert len(names) > 1
    for handle, name in zip(legend.legend_handles, names, strict=True):
        assert isinstance(handle, Line2D)
        assert (handle.get_marker(), handle.get_color()) == (
            regimes.MARKS[list(regimes.LOOKS).index(name)],
            regimes.LOOKS[name],
        )
    grid = {"load.thrust": [1.0, 2.0], "initial.amplitude": [0.1, 1.0]}
    figure = regimes.regimes_figure(swept(folder, grid))
    assert all(isinstance(handle, Patch) for handle in figure.legends[0].legend_handles)


def test_the_legend_shows_what_is_drawn(tmp_path: Path) -> None:
    check_legend(tmp_path)


def check_tables(folder: Path) -> None:
    """Tables at an axis are TOML, of which what differs is shown."""
    tables = [{"program": "table", "times": [0.0, 1.0, 9.0], "values": [0.0, peak, peak]} for peak in (1.0, 2.0)]
    found = swept(folder, {"load.thrust": tables, "initial.amplitude": [1.0, 2.0]})
    ax = regimes.regimes_figure(found).axes[0]
    told = [text.get_text() for text in ax.get_xticklabels()]
    assert told == ["…values = [0.0, 1.0, 1.0] }", "…values = [0.0, 2.0, 2.0] }"]
    whole = '{ program = "table", times = [0.0, 1.0, 9.0], values = [0.0, 2.0, 2.0] }'
    assert found.interesting(9)[-1].takes.startswith("load.thrust = { program = ")
    assert found.plan.axes[0].shown(1.0) == whole


def test_tables_at_an_axis(tmp_path: Path) -> None:
    check_tables(tmp_path)


def test_no_two_labels_are_the_same() -> None:
    for words in (["a" * 40, "a" * 50], ["x" * 40 + "1" + "y" * 40 + "1", "x" * 40 + "1" + "y" * 40 + "2"], ["s" * 31]):
        made = regimes.shortened(words)
        assert len(set(made)) == len(words)
        assert max(map(len, made)) <= regimes.MOST_TICK + 5


def check_middle(folder: Path) -> None:
    """Further keys of a grid are held at the middle of their values, in whatever order these are."""
    over = {"load.thrust": [1.0, 2.0], "initial.amplitude": [0.1, 1.0], "initial.natural_curvature": [0.3, 0.1, 0.2]}
    found = swept(folder, over)
    ax = regimes.regimes_figure(found).axes[0]
    assert ax.get_title(loc="left") == "where initial.natural_curvature = 0.2"
    drawn = np.asarray(ax.collections[0].get_array()).reshape(2, 2)
    there = found.dataset["initial.natural_curvature"].values == 0.2
    codes = found.store.read(["regime"], 0, found.members)["regime"][there].reshape(2, 2)
    assert (drawn == codes.T).all()


def test_what_is_held_is_in_the_middle(tmp_path: Path) -> None:
    check_middle(tmp_path)


def check_neighbours(folder: Path) -> None:
    """Members of a grid lie beside one another by their values, not by the order in which these are listed."""
    found = swept(folder, {"load.thrust": [3.0, 0.5, 4.0, 1.0]}, outputs=["final", "verdict"])
    regime = {float(t): r for t, r in zip(found.axes[0].values, found.dataset["regime"].values, strict=True)}
    sides = [(a, b) for a, b in itertools.pairwise(sorted(regime)) if regime[a] != regime[b]]
    named = [each.member for each in found.interesting(9) if "boundary" in each.why]
    assert {float(found.axes[0].values[member]) for member in named} == {a for a, _ in sides}


def test_neighbours_of_lists_in_any_order(tmp_path: Path) -> None:
    check_neighbours(tmp_path)


def test_one_is_singular(tmp_path: Path) -> None:
    found = swept(tmp_path, {"load.thrust": [1.0]})
    assert "1 member over load.thrust" in str(found)
    assert pl.plot(found).get_suptitle() == "A strut: 1 member"
    told = str(pl.estimate_sweep(scenario(), {"load.thrust": [1.0]}, workers=1))
    assert told.startswith("1 member in 1 chunk: about ")
    assert "with 1 worker of this machine and" in told
