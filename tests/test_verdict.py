"""Claim: what a verdict says of a rod with inertia, segments or other loads is true of that rod."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from tempfile import mkdtemp
from typing import Any

import numpy as np
import pytest

import plastica as pl
from plastica.equilibria import statics, unloaded
from plastica.errors import ArgumentError
from plastica.motion import outcome, regimes
from plastica.motion.regimes import rows_of
from plastica.show import sections
from plastica.show.report import page
from plastica.show.subject import Subject
from plastica.show.words import number
from plastica.study import sweep_batch, sweep_tasks
from plastica.study.run import solved
from plastica.study.sweep_outputs import REGIMES
from plastica.study.sweep_tasks import compute
from tests.commandline import scenario
from tests.reported import Reader
from tests.rods import NEVER
from tests.swept import plan, values

SOFT = {"k": 0.05, "c": 5.0, "h": 0.1}
"""Parameters of a rod that keeps much of what it is bent to, and yields again when it is let go in mid-course."""

LOADS = {"thrust": pl.Load(thrust=3.0), "transverse": pl.Load(transverse=0.6), "couple": pl.Load(couple=0.8)}


def soft(rate: float = 1.0) -> pl.Material:
    """The soft material where times are measured in a unit of `rate` retardation times."""
    return pl.Material("k*m**2/2", "c*pos(x)**2", "h", SOFT | {"c": SOFT["c"] * rate})


def held(load: pl.Load, segments: int, damping: float | None = None, **inertia: float) -> pl.Solution:
    """A strut, or with a damping a rod, that is still yielding under its load."""
    common: dict[str, Any] = {"natural_segments": segments}
    if damping is None:
        model: pl.Strut | pl.Rod = pl.Strut(soft(), load, pl.Grid(8), **common)
        return pl.solve(model, "0.5 + s", 0.2, until=1.0, rtol=1e-9)
    model = pl.Rod(soft(1.0 / damping), load, pl.Grid(8), damping=damping, **inertia, **common)
    return pl.solve(model, "0.5 + s", 0.2, until=damping, rtol=1e-9)


def check_what_is_kept(load: pl.Load, segments: int) -> None:
    """What a strut is said to keep is what it keeps when it is let go and followed for very long."""
    strut = held(load, segments)
    assert not strut.outcome.resting
    free = pl.solve(strut.model.with_load(pl.Load()), start=strut, until=1e5, rtol=1e-9)
    natural = free.model.layout.natural(free.history.y[-1])
    kept = float(free.model.division.total(natural - strut.first_natural))
    assert abs(strut.outcome.set_curvature - kept) <= 1e-5
    assert abs(kept - float(strut.model.division.total(strut.model.layout.natural(strut.history.y[-1]) - 0.2))) > 1e-3


@pytest.mark.parametrize("load", LOADS)
@pytest.mark.parametrize("segments", [1, 3])
def test_what_a_strut_keeps(load: str, segments: int) -> None:
    check_what_is_kept(LOADS[load], segments)


def check_without_inertia(load: pl.Load, segments: int) -> None:
    """A rod without inertia is the strut, in whatever unit of time, and keeps what it keeps."""
    strut = held(load, segments).outcome
    for damping in (1.0, 9.0, 0.01):
        rod = held(load, segments, damping).outcome
        assert abs(rod.set_curvature - strut.set_curvature) <= 1e-7
        assert abs(rod.set_deflection - strut.set_deflection) <= 1e-7
        assert (rod.headline, rod.memory) == (strut.headline, strut.memory)


@pytest.mark.parametrize("load", LOADS)
@pytest.mark.parametrize("segments", [1, 3])
def test_a_rod_without_inertia_keeps_what_the_strut_keeps(load: str, segments: int) -> None:
    check_without_inertia(LOADS[load], segments)


def test_a_rod_with_ever_less_inertia_keeps_what_the_strut_keeps() -> None:
    strut = held(LOADS["transverse"], 1).outcome.set_curvature
    off = [
        abs(held(LOADS["transverse"], 1, 1.0, translational_inertia=eps).outcome.set_curvature - strut)
        for eps in (1e-2, 1e-3, 1e-4)
    ]
    assert off[0] <= 1e-2
    assert all(3.0 <= more / less <= 30.0 for more, less in pairwise(off)), off


def check_bits() -> None:
    """What is within its threshold and stays so keeps its bits; what goes beyond it on the way does not."""
    laws = soft().laws()
    natural = np.array([0.3, 1.7])
    assert np.array_equal(unloaded.left_without_load(laws, 1.0, natural + 0.01, natural), natural)
    assert unloaded.left_without_load(laws, 1.0, 1.0, 0.3) != 0.3
    assert unloaded.left_without_load(laws, 0.0, 1.0, 0.3) == 0.3
    assert abs(unloaded.left_without_load(laws, 1.0, 3.0, 3.0) - 2.0) <= 1e-12


def test_what_does_not_move_keeps_its_bits() -> None:
    check_bits()


def swinging(material: pl.Material, curvature: float, rate: float = 0.0) -> pl.Solution:
    rod = pl.Rod(material, pl.Load(), pl.Grid(4), rotary_inertia=1.0, damping=0.0)
    return pl.solve(rod, curvature, until=2.0, rtol=1e-6, curvature_rate=rate)


def check_without_damping() -> None:
    """Nothing that is said of a rod without damping has it come to rest."""
    yielding = pl.Material("0.05*m**2", "pos(x)**2", "0.02")
    for verdict in (swinging(NEVER, 0.1).outcome, swinging(NEVER, 0.0, 0.1).outcome, swinging(yielding, 0.5).outcome):
        said = f"{verdict.headline}. {verdict.sentence} {verdict.distance}"
        assert "swings" in said
        for word in ("rest", "returns", "Springs back", "viscous", "visco"):
            assert word not in said, said
    assert swinging(NEVER, 0.1).outcome.headline == "Swings on"
    still = swinging(NEVER, 0.0).outcome
    assert still.headline == "Stays at rest"
    assert "keeps its first natural shape" in still.sentence


def test_a_rod_without_damping_swings() -> None:
    check_without_damping()


def check_names() -> None:
    """A weight across bends a rod and does not buckle it, small thrust or not; one along it does not bend."""
    across = pl.Load(thrust=0.1, weight=2.0, weight_angle="90 deg")
    bent = pl.solve(pl.Strut(NEVER, across, pl.Grid(8)), until=10.0)
    assert bent.outcome.headline == "Bends, but would spring back"
    along = pl.Load(thrust=3.0, weight=0.5)
    buckled = pl.solve(pl.Strut(NEVER, along, pl.Grid(8)), 0.01, until=60.0)
    assert buckled.outcome.headline == "Buckles, but would spring back"


def test_what_bends_and_what_buckles() -> None:
    check_names()


def check_share() -> None:
    """The share by which a drive is within or beyond its threshold is one of its own threshold, not of another's."""
    graded = pl.Material("m**2/2", "pos(x)**2", "1 + m**2")
    strut = pl.Strut(graded, pl.Load(), pl.Grid(4), natural_segments=2)
    sol = pl.solve(strut, "4*step(s - 0.5)", [0.0, 2.0], until=1e-6)
    assert "of segment 1 by the least, 1 EI (1 times it)" in sol.outcome.distance
    beyond = pl.solve(strut, "13*step(s - 0.5)", [0.0, 2.0], until=1e-6)
    assert "of segment 2 is farthest above its threshold, by 4 EI (0.8 of it)" in beyond.outcome.distance


def test_shares_are_of_the_threshold_of_the_segment() -> None:
    check_share()


SWEPT = {
    "a weight across": ('weight = 4.0\nweight_angle = "90 deg"', ""),
    "a weight along": ("weight = 0.5", ""),
    "a weight that is askew": ('weight = 1.0\nweight_angle = "10 deg"', ""),
    "nothing else": ("", ""),
    "segments": ("", "natural_segments = 2"),
    "a force across": ("transverse = 0.02", ""),
}
"""What acts beside the thrust, and more of the grid."""

NAMES = {
    (False, False): "recovers",
    (True, False): "buckles",
    (False, True): "permanent set",
    (True, True): "buckles with permanent set",
}


def check_one_verdict(name: str) -> None:
    """A run, a sweep member by member, and a batch come to the same verdict."""
    load, grid = SWEPT[name]
    text = scenario(load=f"thrust = 0.1\n{load}", grid=f"nodes = 8\n{grid}", solve="until = 12.0\nrtol = 1e-6")
    check_members({"load.thrust": [0.0, 0.1, 3.0, 9.0], "initial.curvature": [0.005, 0.3, 2.0]}, text, grid == "")


def check_members(over: dict[str, Any], text: str, batched: bool) -> None:
    made = plan(over, text, outputs=["final", "verdict"])
    alone = plan({**over, "load.couple": [0.0]}, text, outputs=["final", "verdict"]) if batched else made
    rows = values(made)
    told, singly = compute(made, rows), compute(alone, values(alone))
    assert made.batched is batched
    for i, row in enumerate(rows):
        verdict = solved(made.scenario(row)).outcome
        due = NAMES[verdict.shape == "buckled", verdict.memory == "permanent set"]
        for each in (told, singly):
            assert REGIMES[each["regime"][i]] == due, row
            assert bool(each["yielding"][i]) is not verdict.resting, row


@pytest.mark.parametrize("name", SWEPT)
def test_one_verdict(name: str) -> None:
    check_one_verdict(name)


def check_one_verdict_with_inertia(damping: float) -> None:
    """With inertia too, before anything has yielded and after."""
    text = scenario(
        load="thrust = 0.1",
        grid="nodes = 4",
        solve="until = 0.1\nrtol = 1e-4",
        inertia=f"rotary_inertia = 0.5\ndamping = {damping}",
        initial="curvature = 0.1\nnatural_curvature = 0.05",
    )
    check_members({"initial.curvature": [0.1, 1.0, 2.0], "initial.natural_curvature": [0.05, 0.5]}, text, False)


@pytest.mark.parametrize("damping", [1.0, 0.0])
def test_one_verdict_with_inertia(damping: float) -> None:
    check_one_verdict_with_inertia(damping)


def check_a_weight_across_bends() -> None:
    """Under a small thrust and a weight across, a rod bends and keeps a set; it has not buckled."""
    load = pl.Load(thrust=0.1, weight=4.0, weight_angle="90 deg")
    sol = pl.solve(pl.Strut(pl.catalogue.material("one-shape"), load, pl.Grid(8)), 0.01, until=50.0)
    assert (sol.outcome.shape, sol.outcome.headline) == ("bent", "Bends and takes a permanent set")
    assert REGIMES[rows_of(sol).regime[0]] == "permanent set"


def test_a_weight_across_bends() -> None:
    check_a_weight_across_bends()


def set_card(sol: pl.Solution) -> dict[str, str]:
    """The card of the page on what the rod keeps."""
    cards = sections.verdict(Subject(sol, 0.0)).data["cards"]
    return next(card for card in cards if card["name"] == "Permanent set of the free end")


def check_stopped_early(folder: Path) -> None:
    """A run that stopped early tells what it had come to, and judges nothing further, on any page or in any file."""
    strut = pl.Strut(pl.catalogue.material("one-shape"), pl.Load(thrust=3.0), pl.Grid(8))
    sol = pl.solve(strut, 0.1, until=20.0, max_steps=160)
    assert sol.status.code == "step_limit"
    for each in (sol, pl.read(sol.save(folder / "stopped.nc"))):
        verdict = each.outcome
        assert (verdict.shape, verdict.memory, verdict.headline) == ("not judged", "not judged", "Stopped early")
        assert np.isnan([verdict.set_curvature, verdict.set_deflection]).all()
        assert f"After {each.history.end:.4g} retardation times the free end is" in verdict.sentence
        assert "so far. Nothing further is judged." in verdict.sentence
        said = f"{verdict} {each}"
        for word in ("comes to rest", "permanent set", "returns", "would go", "stays"):
            assert word not in said, word
        assert set_card(each)["value"] == "not judged"
    whole = pl.solve(strut, 0.1, until=20.0)
    assert (whole.outcome.memory, sol.outcome.resting) == ("permanent set", False)
    still = pl.solve(pl.Strut(NEVER, pl.Load(thrust=3.0), pl.Grid(8)), 0.1, until=20.0, max_steps=5)
    assert "the natural curvature has not moved so far" in still.outcome.sentence
    coarse = pl.solve(strut.with_load(pl.Load(couple=1e4)), until=1.0)
    assert coarse.outcome.headline == "Not resolved by its grid"
    assert "nothing further is judged" in coarse.outcome.sentence
    assert "The computation is not resolved by its grid." in Reader(page(coarse, film_seconds=0.0)).text


def test_stopped_early(tmp_path: Path) -> None:
    check_stopped_early(tmp_path)


def check_card() -> None:
    """The page says by how much the natural curvature has moved, and by how much once the rod is let go."""
    sol = held(LOADS["transverse"], 3)
    moved = sol.model.layout.natural(sol.history.y[-1]) - sol.first_natural
    now = float(sol.model.division.total(moved))
    assert abs(now - sol.outcome.set_curvature) > 1e-3
    more = set_card(sol)["more"]
    assert f"moved by {number(now)}/L; by {number(sol.outcome.set_curvature)}/L once the rod is let go" in more


def test_card() -> None:
    check_card()


UNSTABLE = {
    "strut": pl.Strut(NEVER, pl.Load(thrust=6.0), pl.Grid(8)),
    "segments": pl.Strut(NEVER, pl.Load(thrust=6.0), pl.Grid(8), natural_segments=2),
    "rod": pl.Rod(NEVER, pl.Load(thrust=6.0), pl.Grid(8), translational_inertia=0.1),
    "weight": pl.Strut(NEVER, pl.Load(weight=9.0), pl.Grid(12)),
    "let go": pl.Strut(NEVER, pl.Load(weight=([0.0, 5.0], [0.0, 9.0])), pl.Grid(12)),
}
STABLE = {
    "strut": UNSTABLE["strut"].with_load(pl.Load(thrust=2.4)),
    "segments": UNSTABLE["segments"].with_load(pl.Load(thrust=2.4)),
    "rod": UNSTABLE["rod"].with_load(pl.Load(thrust=2.4)),
    "weight": UNSTABLE["weight"].with_load(pl.Load(weight=7.8)),
}


def check_stability() -> None:
    """A run that rests where the least disturbance would set it off says so; Euler's and Greenhill's loads decide."""
    for name, model in UNSTABLE.items():
        assert "unstable" in pl.solve(model, until="equilibrium").status.sentence, name
    for name, model in STABLE.items():
        sol = pl.solve(model, until="equilibrium")
        assert sol.status.code == "equilibrium"
        assert "unstable" not in sol.status.sentence, name


def test_rest_that_cannot_last_is_told() -> None:
    check_stability()


@pytest.mark.parametrize("name", ["curvature", "natural_curvature", "curvature_rate"])
def test_what_is_given_beside_a_start_is_named(name: str) -> None:
    rod = pl.Rod(NEVER, pl.Load(), pl.Grid(4), translational_inertia=0.1)
    start = pl.solve(rod, 0.1, until=0.1, rtol=1e-4)
    with pytest.raises(ArgumentError, match=f"`{name}` must not be given together with `start`"):
        pl.solve(rod, start=start, until=1.0, **{name: 0.5})


def gently(laws: Any, _damping: float, _mean: Any, mu_nat: Any) -> np.ndarray:
    return unloaded.left_without_load(laws, 0.0, mu_nat, mu_nat)


def ever_damped(laws: Any, _damping: float, mean: Any, mu_nat: Any) -> np.ndarray:
    return unloaded.left_without_load(laws, 1.0, mean, mu_nat)


def transverse() -> pl.Load:
    return LOADS["transverse"]


def pushed_anyhow(_loads: Any, thrust: Any) -> Any:
    return np.asarray(thrust) > 0.0


def without_the_way_back(sol: pl.Solution) -> Any:
    rows = rows_of(sol)
    return replace(rows, let_go=rows.drive, relaxed=rows.drive)


def told_for_the_present(subject: Subject) -> dict[str, str]:
    moved = subject.write(subject.solution.outcome.set_curvature, "curvature")
    return {"name": "Permanent set of the free end", "value": "", "more": f"natural curvature moved by {moved}"}


SOUND = outcome.outcome


def as_if_done(sol: pl.Solution) -> Any:
    return SOUND(replace(sol, status=pl.Status(True, "done", "Reached the end.")))


DEFECTS: dict[str, tuple[Callable[[], None], Any, str, object]] = {
    "let go too gently": (lambda: check_what_is_kept(transverse(), 3), "longtime", "left_without_load", gently),
    "let go in another time": (
        lambda: check_without_inertia(transverse(), 1),
        "longtime",
        "left_without_load",
        ever_damped,
    ),
    "followed for too short": (lambda: check_what_is_kept(transverse(), 1), "unloaded", "RELAXED", 0.5),
    "another drive": (check_bits, "unloaded", "_drive", lambda laws, mean, m: mean - 1.01 * m),
    "nothing swings": (check_without_damping, "outcome", "ARRIVED", 9.0),
    "any load bends": (check_names, "regimes", "BENT", 9.0),
    "a weight across is thrust": (check_a_weight_across_bends, "regimes", "thrust_alone", pushed_anyhow),
    "batches judged by another rule": (
        lambda: check_one_verdict("a weight across"),
        "batch",
        "thrust_alone",
        pushed_anyhow,
    ),
    "the way back is not looked at": (
        lambda: check_one_verdict_with_inertia(1.0),
        "tasks",
        "rows_of",
        without_the_way_back,
    ),
    "a verdict on what stopped": (lambda: check_stopped_early(Path(mkdtemp())), "outcome", "outcome", as_if_done),
    "the card tells the end for the present": (check_card, "sections", "_set_card", told_for_the_present),
    "every mode is stable": (check_stability, "statics", "EDGE", 1e9),
    "rounding decides": (check_stability, "statics", "EDGE", -1e9),
}


@pytest.mark.parametrize("defect", DEFECTS)
def test_defects_are_caught(defect: str, monkeypatch: pytest.MonkeyPatch) -> None:
    from plastica.motion import longtime

    check, place, name, value = DEFECTS[defect]
    places = {"longtime": longtime, "unloaded": unloaded, "outcome": outcome, "statics": statics}
    places |= {"regimes": regimes, "batch": sweep_batch, "tasks": sweep_tasks, "sections": sections}
    monkeypatch.setattr(places[place], name, value)
    with pytest.raises(AssertionError):
        check()
