"""The sketch of a report: a clamped rod, its natural shape, and the loads of the run, as a newcomer needs them.

The curves are a sketch, with the rod bent to the side to which it was, and more or less than its natural shape as it
was. The arrows are the loads that there are, each with the direction that it has where it is largest.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from plastica.motion.solution import Solution
from plastica.show.arrows import Arrow, Pull, arrows
from plastica.show.style import INK, ROLES
from plastica.show.view import View

__all__ = ["Scheme", "loads_at_largest", "scheme"]

Array = NDArray[np.float64]
Curve = tuple[Array, Array]

LENGTH: Final = 330.0
"""Of the rod, in units of the drawing, in which letters are 17 high."""

BENT: Final = 1.05
LESS: Final = 0.35
"""Angle of the free end of the curve that is bent less; of the other one it is `BENT`."""

SLIGHT: Final = 0.45
"""Least length of an arrow, as a share of that of the largest force at the free end."""

GAP: Final = 10.0
TURNING: Final = 36.0
"""Between the free end and the arrows of forces where the arc of a couple is in between; `GAP` where it is not."""

MARGIN: Final = 16.0
LETTER: Final = 9.8
WORDS: Final = {"transverse": "transverse force", "couple": "couple", "weight": "weight"}
SAID: Final = {"transverse force": "a transverse force", "couple": "a couple", "weight": "its weight"}


@dataclass(frozen=True)
class Line:
    """A stroke: its path, colour, width, and whether it is dashed."""

    path: str
    colour: str
    width: float
    dashed: bool = False


@dataclass(frozen=True)
class Label:
    """Words at a place; `anchor` says which end of them lies there."""

    x: float
    y: float
    words: str
    colour: str
    anchor: str = "start"


@dataclass(frozen=True)
class Scheme:
    """What the template draws, with y downward.

    Attributes
    ----------
    box : str
        The part of the plane that is seen.
    clamp : tuple of float
        Left edge, upper edge, width and height of the clamp.
    lines : tuple of Line
        Curves and shafts of arrows.
    heads : tuple of (str, str)
        Heads of arrows: the kind of load, and the path.
    labels : tuple of Label
        Words.
    words : str
        The picture in a sentence.
    """

    box: str
    clamp: tuple[float, float, float, float]
    lines: tuple[Line, ...]
    heads: tuple[tuple[str, str], ...]
    labels: tuple[Label, ...]
    words: str


@dataclass(frozen=True)
class _Drawn:
    """The arrow of one load, with y upward, and places beside which its name may stand."""

    kind: str
    words: str
    arrow: Arrow
    spots: tuple[tuple[float, float], ...]


def loads_at_largest(solution: Solution) -> dict[str, float]:
    """Return the loads that act in a run, dimensionless, each as it is where its magnitude is largest."""
    until = solution.history.end
    found = {name: max(each.extreme(until), key=abs) for name, each in solution.model.loads.sources()}
    return {name: float(value) for name, value in found.items() if value != 0.0}


def scheme(seen: View) -> Scheme:
    """Draw the sketch of a run."""
    side, more = _bent(seen)
    angle = side * (BENT if more else LESS)
    rod, natural = _arc(angle), _arc(side * (LESS if more else BENT))
    model = seen.solution.model
    drawn = _drawn(loads_at_largest(seen.solution), model.loads.weight_direction, rod, angle)
    colours = ROLES["rod"][0], ROLES["natural"][0]
    lines = [
        Line(_path(*natural), colours[1], 3.0, dashed=True),
        Line(_path(*rod), colours[0], 7.0),
        *(Line(_path(each.arrow.x, each.arrow.y), INK, 1.8 if each.kind == "weight" else 3.0) for each in drawn),
    ]
    labels = _labels(rod, natural, drawn)
    heads = tuple((each.kind, path) for each in drawn for path in _heads(each))
    return Scheme(
        _seen([rod, natural, *((each.arrow.x, each.arrow.y) for each in drawn)], labels),
        (-20.0, -40.0, 20.0, 80.0),
        tuple(lines),
        heads,
        tuple(labels),
        _sentence(side, drawn, more=more),
    )


def _bent(seen: View) -> tuple[float, bool]:
    """To which side the rod was bent where it was bent farthest (1 up, -1 down), and whether more than its memory."""
    row = int(np.abs(seen.values("tip_y")).argmax())
    model, state = seen.solution.model, seen.states(seen.t[row : row + 1])[0]
    natural = float(np.ravel(model.division.total(np.atleast_1d(model.layout.natural(state))))[0])
    angle = float(model.layout.mu(state) @ model.grid.w)
    side = -1.0 if float(seen.values("tip_y")[row]) < 0.0 else 1.0
    return side, abs(angle) >= abs(natural)


def _arc(angle: float) -> Curve:
    turned = np.linspace(0.0, angle, 41)
    return LENGTH * np.sin(turned) / angle, LENGTH * (1.0 - np.cos(turned)) / angle


def _drawn(loads: dict[str, float], down: tuple[float, float], rod: Curve, angle: float) -> list[_Drawn]:
    """The arrows of the loads, and their names beside them."""
    x, y = rod
    gap = TURNING if "couple" in loads else GAP
    strongest = max(abs(loads.get(name, 0.0)) for name in ("thrust", "transverse")) or 1.0

    def size(name: str) -> float:
        return float(np.sign(loads[name]) * max(abs(loads[name]) / strongest, SLIGHT))

    found = []
    for name, value in loads.items():
        if name == "thrust":
            found.append(_thrust(size(name), x[-1] + gap, y[-1]))
        elif name == "transverse":
            found.append(_transverse(size(name), x[-1], y[-1] + np.sign(angle) * gap, above=angle > 0.0))
        elif name == "couple":
            turn = arrows(x, y, angle, Pull((0.0, 0.0), float(np.sign(value)), (0.0, 0.0)), LENGTH)["couple"]
            spots = tuple((float(x[-1]) + away, float(y[-1])) for away in (-TURNING, TURNING))
            found.append(_Drawn(name, WORDS[name], turn, spots))
        else:
            found.append(_weight(tuple(np.sign(value) * each for each in down), x, y, angle))
    return found


def _thrust(size: float, x: float, y: float) -> _Drawn:
    """A push ends before the free end, a pull begins there."""
    far = x + 90.0 * abs(size)
    start, end = (far, x) if size > 0.0 else (x, far)
    arrow = Arrow(np.array([start, end]), np.array([y, y]), np.array([end]), np.array([y]), 180.0 if size > 0 else 0.0)
    words = "thrust" if size > 0.0 else "tension"
    return _Drawn("thrust", words, arrow, ((far, y), (0.5 * (x + far), y)))


def _transverse(size: float, x: float, y: float, *, above: bool) -> _Drawn:
    """On the outer side of the free end, whichever way it points."""
    far = y + (80.0 if above else -80.0) * abs(size)
    start, end = (y, far) if (size > 0.0) == above else (far, y)
    xs, ys = np.array([x, x]), np.array([start, end])
    arrow = Arrow(xs, ys, xs[1:], ys[1:], 90.0 if size > 0.0 else -90.0)
    return _Drawn("transverse", WORDS["transverse"], arrow, ((x, 0.5 * (y + far)), (x, far)))


def _weight(direction: tuple[float, ...], x: Array, y: Array, angle: float) -> _Drawn:
    along, across = direction
    # In the sketch the arrows are longer than in pictures, where they must leave room for shapes.
    longer = 1.8
    pull = Pull((0.0, 0.0), 0.0, (longer * along, longer * across))
    arrow = arrows(x, y, angle, pull, LENGTH)["weight"]
    spots = zip(arrow.head_x[::-1].tolist(), arrow.head_y[::-1].tolist(), strict=True)
    return _Drawn("weight", WORDS["weight"], arrow, tuple(spots))


Box = tuple[float, float, float, float]
"""Left, lower, right and upper edge."""

BESIDE: Final = (
    (12.0, 0.0, "start"),
    (-12.0, 0.0, "end"),
    (0.0, 20.0, "middle"),
    (0.0, -20.0, "middle"),
    (-10.0, 16.0, "end"),
    (10.0, 16.0, "start"),
    (10.0, -16.0, "start"),
    (-10.0, -16.0, "end"),
    (0.0, 44.0, "middle"),
    (0.0, -44.0, "middle"),
)
"""Where words may stand beside a place, best first: how far to the right and up, and which end of them lies there."""


def _labels(rod: Curve, natural: Curve, drawn: list[_Drawn]) -> list[Label]:
    """Names of all that is drawn, each at the first of its places where it covers nothing, or the least."""
    strokes = np.concatenate([_points(*each) for each in (rod, natural, *((d.arrow.x, d.arrow.y) for d in drawn))])
    boxes: list[Box] = [(-20.0, -40.0, 2.0, 40.0)]
    clamp = Label(0.0, 62.0, "clamp", INK)
    boxes.append(_box_of(clamp))
    wanted = [
        ("natural shape", ROLES["natural"][0], [(natural[0][k], natural[1][k]) for k in (-1, 30, 20)]),
        *((each.words, INK, list(each.spots)) for each in drawn),
        ("rod now", ROLES["rod"][0], [(rod[0][k], rod[1][k]) for k in (20, 24, 28, 16, 32)]),
    ]
    labels = [clamp]
    for words, colour, spots in wanted:
        offered = [
            Label(float(x + right), float(6.0 - y - up), words, colour, anchor)
            for x, y in spots
            for right, up, anchor in BESIDE
        ]
        labels.append(min(offered, key=lambda each: _covered(_box_of(each), strokes, boxes)))
        boxes.append(_box_of(labels[-1]))
    return labels


def _covered(box: Box, strokes: Array, boxes: list[Box]) -> int:
    left, lower, right, upper = box
    x, y = strokes.T
    inside = (x > left - 4.0) & (x < right + 4.0) & (y > lower - 4.0) & (y < upper + 4.0)
    meets = [left < each[2] and each[0] < right and lower < each[3] and each[1] < upper for each in boxes]
    return int(inside.sum()) + 100 * sum(meets)


def _box_of(label: Label) -> Box:
    width = LETTER * len(label.words)
    left = label.x - {"start": 0.0, "middle": 0.5, "end": 1.0}[label.anchor] * width
    return left, -label.y - 5.0, left + width, -label.y + 14.0


def _points(x: Array, y: Array) -> Array:
    """Points of a stroke so close to one another that no letter slips in between; shape (points, 2)."""
    share = np.linspace(0.0, 1.0, 9)[:, None]
    between = [(1.0 - share) * each[:-1] + share * each[1:] for each in (x, y)]
    found = np.stack([each.ravel() for each in between], axis=1)
    return found[np.isfinite(found).all(axis=1)]


def _path(x: Array, y: Array) -> str:
    """A path with y downward, broken where there is a gap."""
    parts, new = [], True
    for one, two in zip(x, y, strict=True):
        if np.isfinite(one) and np.isfinite(two):
            parts.append(f"{'M' if new else 'L'}{one:.1f} {-two:.1f}")
        new = not (np.isfinite(one) and np.isfinite(two))
    return "".join(parts)


def _heads(drawn: _Drawn) -> list[str]:
    """Triangles that point where the arrow does, their tips a little beyond the ends of the shafts."""
    long, broad = (13.0, 5.0) if drawn.kind == "weight" else (20.0, 8.5)
    turned = np.radians(drawn.arrow.angle)
    ahead, aside = np.array([np.cos(turned), np.sin(turned)]), np.array([-np.sin(turned), np.cos(turned)])
    found = []
    for x, y in zip(drawn.arrow.head_x, drawn.arrow.head_y, strict=True):
        tip = np.array([x, y]) + 0.35 * long * ahead
        back = tip - long * ahead
        corners = (tip, back + broad * aside, back - broad * aside)
        found.append("M" + "L".join(f"{each[0]:.1f} {-each[1]:.1f}" for each in corners) + "Z")
    return found


def _seen(curves: list[Curve], labels: list[Label]) -> str:
    """The least box around all that is drawn, with a margin."""
    xs = [-20.0, 0.0, *(float(each) for x, _ in curves for each in x if np.isfinite(each))]
    ys = [-40.0, 62.0, *(-float(each) for _, y in curves for each in y if np.isfinite(each))]
    for left, lower, right, upper in map(_box_of, labels):
        xs += [left, right]
        ys += [-lower, -upper]
    edge, top = min(xs) - MARGIN, min(ys) - MARGIN
    return f"{edge:.0f} {top:.0f} {max(xs) + MARGIN - edge:.0f} {max(ys) + MARGIN - top:.0f}"


def _sentence(side: float, drawn: list[_Drawn], *, more: bool) -> str:
    names = [SAID.get(each.words, each.words) for each in drawn]
    acting = f"under {', '.join(names[:-1])}{' and ' if names[:-1] else ''}{names[-1]}" if names else "without any load"
    way = "upward" if side > 0.0 else "downward"
    return (
        f"A rod clamped at the left is bent {way}, {acting}; its natural shape, dashed, is curved "
        f"{'less' if more else 'more'}."
    )
