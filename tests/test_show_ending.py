"""Claim: pictures and report tell where a motion ends, and what is called a prediction is one."""

from __future__ import annotations

import numpy as np
import pytest

import plastica as pl
from plastica.show import ending, outlook, rods, view
from plastica.show.subject import Subject

from .drawn import LENGTH, STIFFNESS, has, made, near, unit_of
from .pictured import line, run, strut
from .reported import Reader, page

# -- limits --------------------------------------------------------------------------------------------------------


def check_tail() -> None:
    """The predicted tail is the law's, in days and mN m^2 in SI; an interior one falls at the gap."""
    for name, time, drive in (("limit", 1.0, 1.0), ("limit in SI", 120.0, STIFFNESS)):
        limit = made(name)
        ax = pl.plot(limit).axes[1]
        t, x = line(ax, "predicted")
        expected = limit.tail(t * unit_of(ax.get_xlabel()) / time) * drive
        assert np.abs(x * unit_of(ax.get_ylabel()) / expected - 1.0).max() <= 1e-12
    limit = made("interior")
    t, x = line(pl.plot(limit).axes[1], "predicted")
    slope = np.polyfit(t, np.log(x), 1)[0]
    assert abs(slope + limit.rate) <= 1e-9 * limit.rate


def test_tail() -> None:
    check_tail()
    assert rods.tail_time(made("arrived")) is None or made("arrived").distance > 0.0


def check_prediction_comes_true() -> None:
    """The tail predicted at t = 40 is what a run ten times as long computes, within a tenth; nothing is fitted."""
    short = run("buckles")
    longer = pl.solve(short.model, start=short, until=400.0)
    tail = ending.tail_of(view.view(short))
    assert tail is not None
    assert tail.kind == "limiting"
    t = longer.dataset["t"].values
    excess = np.abs(longer.dataset["drive"].values) - longer.dataset["threshold"].values
    for when in (80.0, 400.0):
        ahead = tail.later >= 40.0
        predicted = np.exp(np.interp(np.log(when), np.log(tail.later[ahead]), np.log(tail.predicted[ahead])))
        assert abs(predicted / np.interp(when, t, excess) - 1.0) < 0.1
    last = short.dataset.isel(t=-1)
    near(tail.computed[-1], abs(float(last.drive)) - float(last.threshold))


def test_prediction_comes_true() -> None:
    check_prediction_comes_true()


def check_interior_tail() -> None:
    """The distance from the end is that of the states, and the law beside it runs parallel to its end."""
    solution = run("elastic")
    tail, limit = ending.tail_of(view.view(solution)), solution.limit
    assert tail is not None
    assert limit is not None
    assert limit.equilibrium is not None
    assert tail.kind == "interior"
    assert abs(tail.computed[-1] / limit.distance - 1.0) <= 1e-9
    late = tail.t > 5.0
    slope = np.polyfit(tail.t[late], np.log(tail.computed[late]), 1)[0]
    assert abs(slope / limit.rate + 1.0) < 0.02


def test_interior_tail() -> None:
    check_interior_tail()


@pytest.mark.parametrize("name", ["buckles", "held", "long", "elastic", "jump", "short", "still", "stopped"])
def test_ending_is_drawn_for_every_run(name: str) -> None:
    figure = ending.ending(run(name))
    assert len(figure.axes) == (2 if name in ("buckles", "held", "long", "elastic") else 1)
    assert has(figure.axes[0], "rod in the end") == (name not in ("jump", "short", "stopped"))


# -- the section of the report -------------------------------------------------------------------------------------


def check_section() -> None:
    """The report says where it ends: kind, numbers in the end, stability, assumptions, pictures with words."""
    for name, words in (
        ("held", ("creeps on", "halves within", "The end is stable", "Forgotten", "follows the curve", "checked")),
        ("still", ("comes to rest", "Yields no more", "checked")),
        ("stopped", ("cannot be told yet", "What would decide it", "follow the motion further")),
        ("cycles", ("No limit is predicted", "go on changing")),
    ):
        text = Reader(page(name)).text.lower()
        assert "where it ends" in text
        for each in words:
            assert each.lower() in text, f"{name}: {each}"


def test_section() -> None:
    check_section()


def test_section_has_numbers_of_the_limit() -> None:
    solution = run("held")
    section = outlook.ending(Subject(solution, 0.0))
    limit = solution.limit
    assert limit is not None
    assert limit.equilibrium is not None
    cards = {card["name"]: card["value"] for card in section.data["cards"]}
    assert cards["Natural curvature in the end"] == f"{limit.equilibrium.mu_nat / LENGTH:.4g} m⁻¹"
    assert section.data["figure"]["caption"].alt.count("mm") >= 2
    assert len(section.data["assumptions"]) == len(limit.assumptions)


def test_an_unstable_end_is_told() -> None:
    solution = pl.solve(strut(), 0.0, until=5.0)
    section = outlook.ending(Subject(solution, 0.0))
    assert solution.limit is not None
    assert solution.limit.stable is False
    assert not section.data["stable"]
    assert "not stable" in section.data["stability"]
