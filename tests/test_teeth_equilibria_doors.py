"""Claim: the checks of pictures, pages and commands on equilibria catch the defects that are planted for them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from plastica.doors import facts, held
from plastica.equilibria.limits import Limit
from plastica.show import admissible, branches, charts, ending, modes, outlook, rods

from . import test_cli_equilibria as commands
from . import test_paper as paper
from . import test_show_ending as ends
from . import test_show_equilibria as pictures
from .reported import page

Patch = pytest.MonkeyPatch


def _changed(place: Any, name: str, made: Callable[[Any], Any]) -> Callable[[Patch], None]:
    """A defect that puts something made of the sound thing in its place."""
    return lambda patch: patch.setattr(place, name, made(getattr(place, name)))


def _faster(sound: Any) -> Any:
    return lambda self, later: sound(replace(self, rate=1.5 * self.rate), later)


def _off_axis(sound: Any) -> Any:
    return lambda found, words="rod": replace(sound(found, words), y=-sound(found, words).y)


def _largest_last(sound: Any) -> Any:
    return lambda rod, gamma, source="": sound(rod, gamma, source) | {"thrust": gamma}


def _without_lowest(sound: Any) -> Any:
    return lambda ax, found: sound(ax, replace(found, lowest=found.lowest[:0]))


def _one_look(sound: Any) -> Any:
    return lambda found: dict.fromkeys(sound(found), ("", "#ffffff"))


def _page_anew(check: Callable[[], None]) -> Callable[[Path], None]:
    def run(_folder: Path) -> None:
        page.cache_clear()
        try:
            check()
        finally:
            page.cache_clear()

    return run


def _bare(check: Callable[[], None]) -> Callable[[Path], None]:
    return lambda _folder: check()


CHECKS: dict[str, Callable[[Path], None]] = {
    "picture of an equilibrium": _bare(pictures.check_equilibrium),
    "picture of a set": _bare(pictures.check_set),
    "limits of motions": _bare(pictures.check_limits_of_motions),
    "broken where unstable": _bare(pictures.check_broken_where_unstable),
    "picture of a spectrum": _bare(pictures.check_spectrum),
    "picture of branches": _bare(pictures.check_branches),
    "picture of capacity": _bare(pictures.check_capacity),
    "picture of a phase diagram": _bare(pictures.check_phase),
    "picture of a basin": _bare(pictures.check_basin),
    "picture of a tail": _bare(ends.check_tail),
    "the prediction comes true": _bare(ends.check_prediction_comes_true),
    "the interior tail": _bare(ends.check_interior_tail),
    "where it ends": _page_anew(ends.check_section),
    "command equilibria": commands.check_equilibria,
    "thrust held": commands.check_thrust_held,
    "command spectrum": commands.check_spectrum,
    "command capacity": commands.check_capacity,
    "page on the paper": lambda _folder: paper.check_tests(paper.PAGE),
}

TEETH: list[tuple[str, str, Callable[[Patch], None]]] = [
    ("picture of an equilibrium", "a mirrored rod", _changed(rods, "shape_of", _off_axis)),
    ("picture of a set", "no folds", _changed(admissible, "MARKS", lambda marks: dict(list(marks.items())[:-1]))),
    (
        "limits of motions",
        "every one attracts",
        _changed(admissible, "kind_of", lambda _: lambda p: "a limit of motions"),
    ),
    (
        "broken where unstable",
        "all stable",
        _changed(admissible, "unstable_count", lambda _: lambda gamma, alpha, end: np.zeros(alpha.shape, dtype=int)),
    ),
    ("picture of a spectrum", "lowest left out", _changed(modes, "line_panel", _without_lowest)),
    ("picture of branches", "pieces mixed up", _changed(branches, "LOOKS", lambda looks: {**looks, 0: looks[1]})),
    ("picture of capacity", "not scaled", _changed(charts, "_per_length", lambda _: lambda found: 1.0)),
    ("picture of a phase diagram", "backwards", _changed(charts, "_closed", lambda f: lambda v, c: f(v, c)[::-1])),
    ("picture of a basin", "one colour", _changed(charts, "_basin_looks", _one_look)),
    ("picture of a tail", "half the time", _changed(rods.np, "exp", lambda exp: lambda x: exp(0.5 * x))),
    ("the prediction comes true", "half as fast again", _changed(Limit, "tail", _faster)),
    ("the interior tail", "to another end", _changed(ending, "FLOOR", lambda floor: 1e12 * floor)),
    ("where it ends", "stability not told", _changed(outlook, "_stability", lambda _: lambda limit: "")),
    ("where it ends", "nothing would decide", _changed(outlook, "_what_would_decide", lambda _: lambda s, limit: "")),
    ("command equilibria", "SI not scaled", _changed(facts, "_thrust", _largest_last)),
    ("command equilibria", "all repel", _changed(facts, "standing", lambda _: lambda point: "repelling")),
    ("thrust held", "units read as N", _changed(held, "finite", lambda f: lambda *a: 2.0 * f(*a))),
    ("command spectrum", "the straight rod instead", _changed(held.Held, "clamp_curvature", lambda _: lambda *a: 0.0)),
    ("command capacity", "SI not scaled", _changed(facts, "_thrust", _largest_last)),
    ("page on the paper", "a test that is not there", lambda patch: patch.setattr(paper, "PAGE", _renamed())),
    ("page on the paper", "a test of something else", lambda patch: patch.setattr(paper, "PAGE", _mistaken())),
]


def _renamed() -> str:
    return paper.PAGE.replace("test_reference_limits", "test_no_such_thing")


def _mistaken() -> str:
    return paper.PAGE.replace("test_paper_4.test_semiflow", "test_store.test_an_interrupt_keeps_what_is_finished")


@pytest.mark.parametrize(("claim", "defect", "spoil"), TEETH, ids=[f"{claim}-{defect}" for claim, defect, _ in TEETH])
def test_catches(
    claim: str, defect: str, spoil: Callable[[Patch], None], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "sound").mkdir()
    CHECKS[claim](tmp_path / "sound")
    spoil(monkeypatch)
    (tmp_path / "spoiled").mkdir()
    with pytest.raises(AssertionError):
        CHECKS[claim](tmp_path / "spoiled")


def test_every_check_has_a_defect() -> None:
    assert {claim for claim, _, _ in TEETH} == set(CHECKS)
