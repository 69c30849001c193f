"""Claim: the sketch of a report shows the loads that there are, each in its direction, and none that there is not."""

from __future__ import annotations

from itertools import product
from typing import Any

import numpy as np
import pytest

import plastica as pl
from plastica.show import scheme as sketches
from plastica.show.scheme import Scheme, scheme
from plastica.show.view import view

from .reported import Reader, page, run, strut


def sketch(curvature: float = 0.1, natural: float = 0.0, **loads: Any) -> Scheme:
    made = strut(loads.pop("thrust", 0.0), **loads)
    return scheme(view(pl.solve(made, curvature, natural, until=0.5, rtol=1e-4)))


def numbers(path: str) -> np.ndarray:
    """The corners of a path, with y upward."""
    pairs = [each.split() for each in path.strip("MZ").replace("M", "L").split("L")]
    return np.array(pairs, dtype=float) * (1.0, -1.0)


def directions(drawn: Scheme) -> dict[str, set[tuple[int, int]]]:
    """Where the heads of each kind of arrow point, in whole degrees' cosine and sine times 100."""
    found: dict[str, set[tuple[int, int]]] = {}
    for kind, path in drawn.heads:
        tip, one, two = numbers(path)
        along = tip - 0.5 * (one + two)
        x, y = np.round(100.0 * along / np.hypot(*along) / 5.0).astype(int) * 5
        found.setdefault(kind, set()).add((int(x), int(y)))
    return found


def check_loads_of_the_sketch() -> None:
    """An arrow for each load that is not 0, none for the others, each pointing where the load does."""
    assert directions(sketch()) == {}
    assert len(sketch().lines) == 2
    assert directions(sketch(thrust=2.0)) == {"thrust": {(-100, 0)}}
    assert directions(sketch(thrust=-2.0, allow_tension=True)) == {"thrust": {(100, 0)}}
    for sign in (1, -1):
        assert directions(sketch(transverse=0.3 * sign)) == {"transverse": {(0, 100 * sign)}}
        assert directions(sketch(-0.5, transverse=0.3 * sign)) == {"transverse": {(0, 100 * sign)}}
    assert directions(sketch(weight=1.0)) == {"weight": {(-100, 0)}}
    assert directions(sketch(weight=1.0, weight_angle="-90 deg")) == {"weight": {(0, -100)}}
    assert directions(sketch(weight=1.0, weight_angle="150 deg")) == {"weight": {(85, 50)}}
    assert directions(sketch(weight=-1.0, weight_angle="-90 deg", allow_tension=True)) == {"weight": {(0, 100)}}
    every = sketch(thrust=1.0, transverse=-0.2, couple=0.1, weight=0.5, weight_angle="90 deg")
    assert set(directions(every)) == {"thrust", "transverse", "couple", "weight"}
    # Gone again before the end, and never there within the run.
    assert set(directions(sketch(thrust=([0, 0.1, 0.1, 9], [2, 2, 0, 0])))) == {"thrust"}
    assert directions(sketch(thrust=([0, 5, 5, 9], [0, 0, 2, 2]))) == {}


def test_loads_of_the_sketch() -> None:
    check_loads_of_the_sketch()


def check_couple_turns(sign: float) -> None:
    """Its arc goes round the free end the way that the couple turns, and the head points along it."""
    drawn = sketch(couple=0.2 * sign)
    arc = numbers(drawn.lines[-1].path)
    end = numbers(drawn.lines[1].path)[-1]
    spokes = arc - end
    turned = spokes[:-1, 0] * spokes[1:, 1] - spokes[:-1, 1] * spokes[1:, 0]
    assert (np.sign(turned) == sign).all()
    tip, one, two = numbers(drawn.heads[0][1])
    ahead, spoke = tip - 0.5 * (one + two), spokes[-1]
    assert sign * (spoke[0] * ahead[1] - spoke[1] * ahead[0]) > 0.9 * np.hypot(*ahead) * np.hypot(*spoke)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_couple_turns_its_way(sign: float) -> None:
    check_couple_turns(sign)


def test_the_rod_is_bent_to_its_side() -> None:
    for curvature in (0.4, -0.4):
        rod, natural = (numbers(sketch(curvature).lines[k].path)[-1, 1] for k in (1, 0))
        assert np.sign(rod) == np.sign(natural) == np.sign(curvature)
        assert abs(rod) > abs(natural)
    rod, natural = (numbers(sketch(0.1, 2.0).lines[k].path)[-1, 1] for k in (1, 0))
    assert 0.0 < rod < natural


def test_the_sketch_is_told_in_words() -> None:
    assert sketch().words.startswith("A rod clamped at the left is bent upward, without any load;")
    told = sketch(-1.0, thrust=1.0, transverse=-0.2, couple=-0.1, weight=0.5).words
    assert "bent downward, under thrust, a transverse force, a couple and its weight; its natural shape" in told
    assert "under tension; its natural shape, dashed, is curved more." in sketch(
        0.1, 0.5, thrust=-1.0, allow_tension=True
    ).words


def check_words_are_clear(drawn: Scheme) -> None:
    """No words lie on others, and all of it is within the box."""
    left, top, width, height = map(float, drawn.box.split())
    boxes = [sketches._box_of(label) for label in drawn.labels]
    for i, (x0, y0, x1, y1) in enumerate(boxes):
        assert left < x0 < x1 < left + width
        assert top < -y1 < -y0 < top + height
        for one in boxes[:i]:
            assert one[2] <= x0 or x1 <= one[0] or one[3] <= y0 or y1 <= one[1], drawn.labels


@pytest.mark.parametrize("angle", ["0 deg", "60 deg", "-90 deg", "90 deg"])
def test_words_are_clear_of_one_another(angle: str) -> None:
    for thrust, transverse, couple, weight in product((0.0, 1.0), (0.4, 0.0, -0.4), (0.2, 0.0, -0.2), (0.0, 0.5)):
        loads = {"transverse": transverse, "couple": couple}
        loads |= {"weight": weight, "weight_angle": angle} if weight else {}
        check_words_are_clear(sketch(thrust=thrust, **loads))


def test_the_page_shows_the_sketch() -> None:
    for name, kinds in (("buckles", {"thrust"}), ("still", set()), ("couple", {"thrust", "couple"})):
        reader = Reader(page(name))
        drawn = scheme(view(run(name)))
        (picture,) = (each for each in reader.all("svg") if each.get("role") == "img")
        assert picture["aria-label"] == drawn.words
        assert {str(each["class"]) for each in reader.all("path") if each.get("class")} == kinds
        assert [each["d"] for each in reader.all("path") if each.get("class")] == [path for _, path in drawn.heads]
        for label in drawn.labels:
            assert label.words in reader.text
