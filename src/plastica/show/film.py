"""A film of a motion: the rod and its natural shape, and the energies below."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from numpy.typing import NDArray

from plastica.errors import ArgumentError
from plastica.files import write_whole
from plastica.motion.solution import Solution
from plastica.show import arrows as loads
from plastica.show import panels
from plastica.show.encode import ffmpeg, write_gif, write_mp4
from plastica.show.style import INK, MUTED, ROLES, drawing, new_figure
from plastica.show.view import View, frame_times, view

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from PIL.Image import Image

__all__ = ["Reel", "check_suffix", "film", "frames", "reel"]

Array = NDArray[np.float64]

SECONDS: Final = 8.0
FPS: Final = 12.5
PIXELS: Final = 720
"""Of the width."""

WIDTH: Final = 7.2
"""Inches: a film looks the same at every number of pixels."""

MARGINS: Final = 2.1
"""Inches of the width that labels take."""

LOWER: Final = 1.7
"""Inches of the height that the energies take."""

SUFFIXES: Final = (".gif", ".mp4")

LONGEST: Final = 3000
"""Frames of one film."""

TRAIL: Final = 3
"""Earlier shapes that fade behind the rod."""

DRAWN: Final = {"force": ("arrow", "head"), "couple": ("turn", "turn head"), "weight": ("weight", "weight heads")}
"""Load -> the parts of the picture that are its arrow."""


@dataclass(frozen=True, eq=False)
class Reel:
    """A film that was drawn, to be written once or more often.

    Attributes
    ----------
    frames : tuple of Image
        In RGB, all of one size.
    fps : float
        Frames per second.
    """

    frames: tuple[Image, ...]
    fps: float

    @cached_property
    def gif(self) -> bytes:
        """The film as a GIF."""
        stream = BytesIO()
        write_gif(iter(self.frames), stream, self.fps)
        return stream.getvalue()

    def write(self, path: Path) -> Path:
        """Write the film to a file that ends in .gif or .mp4, whole or not at all; errors as for `film`."""
        return write_whole(path, self._fill)

    def _fill(self, path: Path) -> None:
        if path.suffix.lower() == ".gif":
            path.write_bytes(self.gif)
        else:
            write_mp4(iter(self.frames), path, self.fps)


def reel(solution: Solution, seconds: float = SECONDS) -> Reel:
    """Draw a film as `film` does where it is told no more than its length."""
    return Reel(tuple(frames(solution, _count(seconds, FPS), PIXELS)), FPS)


def _count(seconds: float, fps: float) -> int:
    return max(round(seconds * fps), 2)


def film(
    solution: Solution, path: str | Path, seconds: float = SECONDS, *, fps: float = FPS, width: int = PIXELS
) -> Path:
    """Write a film of a motion.

    Above, the rod, clamped at the left, with its natural shape dashed and the loads as arrows; below, the
    energies with a marker that moves along. The clock of the film is not the clock on the wall: half of it follows
    the way of the state, half the axis of time (logarithmic for long runs), so that something happens in every
    frame; the time is written into the picture.

    Parameters
    ----------
    solution : Solution
        A finished motion.
    path : str or Path
        Ends in .gif, or in .mp4 where ffmpeg is installed.
    seconds : float
        How long it runs, in (0, 120].
    fps : float
        Frames per second, in [1, 50]; a GIF rounds to hundredths of a second.
    width : int
        Of the picture, in [240, 1920].

    Returns
    -------
    Path
        The file, which appears whole or not at all.

    Raises
    ------
    ArgumentError
        Where a value is out of range, the suffix is another, or ffmpeg is missing.
    FileError
        Where the file cannot be written.
    """
    target = Path(path)
    count = _checked(solution, target, seconds, fps, width)
    return write_whole(target, lambda aside: Reel(tuple(frames(solution, count, width)), fps)._fill(aside))


def _checked(solution: Solution, target: Path, seconds: float, fps: float, width: int) -> int:
    """Refuse what cannot be filmed, and return the number of frames."""
    if not isinstance(solution, Solution):
        raise ArgumentError("must be a Solution", where="solution", value=solution)
    check_suffix(target)
    ranges = {"seconds": (seconds, 0.0, 120.0), "fps": (fps, 1.0, 50.0), "width": (width, 240, 1920)}
    for name, (value, low, high) in ranges.items():
        if not (isinstance(value, (int, float)) and low <= value <= high and value > 0):
            raise ArgumentError(f"must be a number from {low:g} to {high:g}", where=name, value=value)
    count = _count(seconds, fps)
    if count > LONGEST:
        raise ArgumentError(f"must give at most {LONGEST} frames", where="seconds", value=seconds)
    return count


def check_suffix(target: Path) -> None:
    """Refuse the name of a film that cannot be written.

    Raises
    ------
    ArgumentError
        Where the suffix is none of .gif and .mp4, or ffmpeg is missing.
    """
    if target.suffix.lower() not in SUFFIXES:
        raise ArgumentError("must end in .gif or .mp4", where="path", value=str(target))
    if target.suffix.lower() == ".mp4":
        ffmpeg()


def frames(solution: Solution, count: int, width: int = 720) -> Iterator[Image]:
    """Draw the frames of a film one after the other.

    Parameters
    ----------
    solution : Solution
        A finished motion.
    count : int
        How many; fewer where the run has no extent in time.
    width : int
        In pixels; the height follows from the shape of the motion, and both are even.

    Yields
    ------
    Image
        In RGB.
    """
    seen = view(solution)
    times = frame_times(seen, count)
    with drawing():
        stage = _stage(seen, times, width)
        canvas: Any = FigureCanvasAgg(stage.figure)
        canvas.draw()
        background = canvas.copy_from_bbox(stage.figure.bbox)
        for row in range(times.size):
            stage.show(row)
            canvas.restore_region(background)
            for artist in stage.moving:
                stage.figure.draw_artist(artist)
            yield _image(canvas)


def _image(canvas: Any) -> Image:
    from PIL import Image as Images

    pixels = np.asarray(canvas.buffer_rgba())[..., :3]
    even = pixels[: pixels.shape[0] // 2 * 2, : pixels.shape[1] // 2 * 2]
    return Images.fromarray(np.ascontiguousarray(even))


@dataclass(frozen=True)
class _Stage:
    """The figure of a film with what moves in it, and what each frame shows."""

    figure: Figure
    moving: tuple[Artist, ...]
    parts: dict[str, Any]
    lines: tuple[Array, Array, Array, Array]
    marks: Array
    heights: dict[str, Array]
    arrows: tuple[dict[str, loads.Arrow], ...]
    words: tuple[str, ...]

    def show(self, row: int) -> None:
        """Set every moving part to the state of one frame."""
        x, y, natural_x, natural_y = self.lines
        parts = self.parts
        parts["rod"].set_data(x[row], y[row])
        parts["natural"].set_data(natural_x[row], natural_y[row])
        for k in range(TRAIL):
            back = max(row - 2 * (k + 1), 0)
            parts[f"trail {k}"].set_data(x[back], y[back])
        self._pull(self.arrows[row])
        parts["cursor"].set_xdata([self.marks[row]] * 2)
        for name, values in self.heights.items():
            parts[f"dot {name}"].set_data([self.marks[row]], [values[row]])
        parts["clock"].set_text(self.words[row])

    def _pull(self, drawn: dict[str, loads.Arrow]) -> None:
        """Set the arrows of the loads, and hide those of loads that do not act."""
        for kind, names in DRAWN.items():
            line, head = (self.parts[name] for name in names)
            for part in (line, head):
                part.set_visible(kind in drawn)
            if kind in drawn:
                arrow = drawn[kind]
                line.set_data(arrow.x, arrow.y)
                head.set_data(arrow.head_x, arrow.head_y)
                head.set_marker(arrow.marker)


def _stage(seen: View, times: Array, width: int) -> _Stage:
    """Set the scene: the two pictures with all that rests, and the moving parts."""
    length = seen.length("")
    x, y, natural_x, natural_y = (length(each) for each in seen.centre_lines(times, panels.PLACES[::2]))
    arrows = _arrows(seen, times, x, y)
    found = [loads.reach(each) for each in arrows]
    beyond = np.concatenate([each[0] for each in found]), np.concatenate([each[1] for each in found])
    probe = new_figure(WIDTH, WIDTH).subplots()
    height, breadth = panels.plan_limits(probe, seen, beyond=beyond)
    upper = float(np.clip((WIDTH - MARGINS) * height / breadth, 1.2, 4.6))
    figure = new_figure(WIDTH, upper + LOWER + 1.0)
    figure.set_layout_engine("compressed")
    # A hair more than the width, lest rounding takes a pixel away.
    figure.set_dpi((width + 0.01) / WIDTH)
    ax, below = figure.subplots(2, 1, height_ratios=[upper, LOWER])
    panels.clamp(ax, *panels.plan_limits(ax, seen, beyond=beyond))
    parts = _rod(ax, seen)
    panels.energy_panel(below, seen, without=("liapunov",))
    dots, heights = _dots(below, seen, times)
    parts.update(dots)
    moving = tuple(parts.values())
    for artist in moving:
        artist.set_animated(True)
    words = tuple(seen.time.clock(float(t)) for t in times)
    return _Stage(figure, moving, parts, (x, y, natural_x, natural_y), seen.time(times), heights, arrows, words)


def _arrows(seen: View, times: Array, x: Array, y: Array) -> tuple[dict[str, loads.Arrow], ...]:
    """The arrows of the loads in each frame; the largest of each kind has the same length in every film."""
    model = seen.solution.model
    pulls = [loads.Pull.at(model, float(t)) for t in times / model.scales.time]
    largest = loads.strongest(pulls)
    full = float(seen.length("")(model.scales.length))
    ends = model.layout.mu(seen.states(times)) @ model.grid.w
    return tuple(
        loads.arrows(x[row], y[row], float(ends[row]), pull.over(largest), full) for row, pull in enumerate(pulls)
    )


def _rod(ax: Axes, seen: View) -> dict[str, Any]:
    """The moving parts of the upper picture."""
    ax.set_xlabel(seen.length("Along the clamp's tangent").label)
    ax.set_ylabel(seen.length("Across").label)
    colour = ROLES["natural"][0]
    rod = ROLES["rod"][0]
    parts: dict[str, Any] = {
        f"trail {k}": ax.plot([], [], color=rod, alpha=0.28 - 0.08 * k, linewidth=1.6)[0] for k in range(TRAIL)
    }
    parts["natural"] = ax.plot([], [], color=colour, linestyle=(0, (5, 2)), linewidth=1.7)[0]
    for kind, (line, head) in DRAWN.items():
        thin = kind == "weight"
        parts[line] = ax.plot([], [], color=INK, linewidth=1.1 if thin else 1.6)[0]
        parts[head] = ax.plot([], [], color=INK, marker=(3, 0, 90), markersize=6 if thin else 9, linestyle="none")[0]
    parts["rod"] = ax.plot([], [], color=rod, linewidth=3.4, solid_capstyle="round")[0]
    parts["clock"] = ax.text(
        1.0, 1.02, "", transform=ax.transAxes, fontsize=11, fontweight="bold", ha="right", va="bottom"
    )
    ax.text(0.0, 1.02, "rod", transform=ax.transAxes, color=rod, fontsize=9.5, fontweight="bold", va="bottom")
    ax.annotate(
        "- - natural shape",
        (0.0, 1.02),
        xytext=(34, 0),
        xycoords="axes fraction",
        textcoords="offset points",
        color=colour,
        fontsize=9.5,
        va="bottom",
    )
    return parts


def _dots(ax: Axes, seen: View, times: Array) -> tuple[dict[str, Any], dict[str, Array]]:
    """A line across the energies at the present time, with a dot on every curve."""
    parts: dict[str, Any] = {"cursor": ax.axvline(seen.time.lower, color=MUTED, linewidth=1.0)}
    heights = {}
    for line in ax.lines[:-1]:
        name = str(line.get_label())
        x, y = np.asarray(line.get_xdata(), dtype=float), np.asarray(line.get_ydata(), dtype=float)
        heights[name] = np.interp(seen.time(times), x, y)
        parts[f"dot {name}"] = ax.plot(
            [],
            [],
            marker="o",
            markersize=5.5,
            color=line.get_color(),
            markeredgecolor="white",
            linestyle="none",
            clip_on=False,
        )[0]
    return parts, heights
