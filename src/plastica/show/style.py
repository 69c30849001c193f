"""How the pictures look: a palette that colour-blind people can tell apart, and quiet axes."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, Final

import matplotlib
import numpy as np
from matplotlib.figure import Figure

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from numpy.typing import ArrayLike, NDArray

__all__ = [
    "DIVERGING",
    "INK",
    "MUTED",
    "OKABE_ITO",
    "ROLES",
    "SEQUENTIAL",
    "direct_labels",
    "drawing",
    "new_figure",
    "room",
]

OKABE_ITO: Final = {
    "black": "#000000",
    "orange": "#E69F00",
    "sky blue": "#56B4E9",
    "green": "#009E73",
    "yellow": "#F0E442",
    "blue": "#0072B2",
    "vermillion": "#D55E00",
    "purple": "#CC79A7",
}
"""The palette of M. Okabe and K. Ito, made to be told apart with any kind of colour vision."""

INK: Final = "#1b1f24"
MUTED: Final = "#5d6670"

ROLES: Final = {
    "rod": (OKABE_ITO["blue"], "-"),
    "natural": (OKABE_ITO["vermillion"], "--"),
    "drive": (OKABE_ITO["blue"], "-"),
    "threshold": (INK, (0, (5, 2))),
    "yielding": ("#faecce", "-"),
    "stored": (OKABE_ITO["blue"], "-"),
    "work": (INK, (0, (1, 1.2))),
    "viscous": (OKABE_ITO["green"], (0, (5, 1.5, 1, 1.5))),
    "dissipation": (OKABE_ITO["vermillion"], (0, (5, 2))),
    "liapunov": (OKABE_ITO["purple"], (0, (8, 2))),
    "kinetic": (OKABE_ITO["orange"], (0, (3, 1, 1, 1, 1, 1))),
    "load": (OKABE_ITO["blue"], "-"),
}
"""What a line stands for -> (colour, dashes): the same in every picture, and never colour alone."""

SEQUENTIAL: Final = "viridis"
DIVERGING: Final = "PuOr_r"
"""Colour maps that keep their order for every kind of colour vision and in grey."""

_LOOK: Final[dict[str, Any]] = {
    "figure.facecolor": "white",
    "savefig.facecolor": "white",
    "font.family": "sans-serif",
    "font.sans-serif": ["DejaVu Sans"],
    "font.size": 9.5,
    "axes.titlesize": 10.0,
    "axes.titleweight": "bold",
    "axes.titlelocation": "left",
    "axes.labelsize": 9.5,
    "axes.edgecolor": "#8a939c",
    "axes.labelcolor": INK,
    "axes.linewidth": 0.8,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "axes.axisbelow": True,
    "axes.formatter.useoffset": False,
    "axes.formatter.limits": (-4, 5),
    "axes.formatter.use_mathtext": False,
    "grid.color": "#e4e7ea",
    "grid.linewidth": 0.7,
    "lines.linewidth": 1.8,
    "text.color": INK,
    "xtick.color": MUTED,
    "ytick.color": MUTED,
    "xtick.labelcolor": INK,
    "ytick.labelcolor": INK,
    "xtick.labelsize": 8.5,
    "ytick.labelsize": 8.5,
    "svg.hashsalt": "plastica",
    "svg.fonttype": "path",
    "path.simplify": True,
}


@contextmanager
def drawing() -> Iterator[None]:
    """Draw in the package's look, whatever the user's own settings are, and leave those as they were."""
    with matplotlib.rc_context():
        matplotlib.rcdefaults()
        settings: Any = matplotlib.rcParams
        settings.update(_LOOK)
        yield


def new_figure(width: float = 7.2, height: float = 4.0) -> Figure:
    """Return an empty figure (inches) whose parts make room for each other; no window system takes part."""
    return Figure(figsize=(width, height), layout="constrained")


def room(ax: Axes, *values: ArrayLike, at_least: float = 0.0) -> None:
    """Set the vertical limits so that the values fit with a margin, and rounding noise is not blown up.

    Parameters
    ----------
    ax : Axes
        Where.
    values : array_like
        All that is drawn; what is not finite is left out.
    at_least : float
        Least height of the axis.
    """
    flat = np.concatenate([np.ravel(np.asarray(each, dtype=float)) for each in values])
    flat = flat[np.isfinite(flat)]
    low, high = (float(flat.min()), float(flat.max())) if flat.size else (0.0, 0.0)
    largest = max(abs(low), abs(high))
    height = max(high - low, at_least, 1e-3 * largest, 1e-30)
    if largest == 0.0 and at_least == 0.0:
        height = 1.0
    middle = 0.5 * (low + high)
    low, high = min(low, middle - 0.5 * height), max(high, middle + 0.5 * height)
    ax.set_ylim(low - 0.07 * (high - low), high + 0.07 * (high - low))


def direct_labels(ax: Axes, entries: Sequence[tuple[float, str, str]], size: float = 8.5) -> None:
    """Name lines at the right edge of the axes, moved apart where they would overlap.

    Parameters
    ----------
    ax : Axes
        With its limits set, linear in y.
    entries : sequence of (y, text, colour)
        Where each line ends.
    size : float
        Of the letters, in points.
    """
    if not entries:
        return
    low, high = ax.get_ylim()
    height = ax.bbox.height / ax.figure.dpi
    gap = 1.35 * size / 72.0 / max(height, 0.5)
    order = sorted(range(len(entries)), key=lambda i: entries[i][0])
    wanted = np.array([(entries[i][0] - low) / (high - low) for i in order])
    for i, where in zip(order, _spread(np.clip(wanted, 0.0, 1.0), gap), strict=True):
        _, text, colour = entries[i]
        ax.annotate(
            text,
            (1.0, where),
            xycoords="axes fraction",
            xytext=(5, 0),
            textcoords="offset points",
            color=colour,
            fontsize=size,
            va="center",
            ha="left",
            annotation_clip=False,
        )


def _spread(wanted: NDArray[np.float64], gap: float) -> NDArray[np.float64]:
    """Places at least `gap` apart, in the same order and as near the wanted ones as can be, and inside [0, 1]."""
    blocks: list[list[float]] = []
    for i, place in enumerate(wanted):
        blocks.append([float(place) - i * gap, 1.0])
        while len(blocks) > 1 and blocks[-1][0] < blocks[-2][0]:
            (mean, count), (other, more) = blocks[-2], blocks.pop()
            blocks[-1] = [(mean * count + other * more) / (count + more), count + more]
    flat = np.concatenate([np.full(int(count), mean) for mean, count in blocks])
    places: NDArray[np.float64] = flat + gap * np.arange(wanted.size)
    shift: float = max(float(places[-1]) - 1.0, min(float(places[0]), 0.0))
    return places - shift
