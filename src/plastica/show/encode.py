"""Frames to a file: GIF with Pillow, MP4 with ffmpeg where it is installed."""

from __future__ import annotations

import shutil
import subprocess
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import IO, TYPE_CHECKING, Final

from plastica.errors import ArgumentError, FileError

if TYPE_CHECKING:
    from PIL.Image import Image

__all__ = ["HOLD", "ffmpeg", "write_gif", "write_mp4"]

HOLD: Final = 1500
"""Milliseconds that a GIF rests on its last frame before it begins anew."""

_COLOURS: Final = 64
_SAMPLES: Final = 6
_PALE: Final = 245


def write_gif(frames: Iterator[Image], path: Path | IO[bytes], fps: float) -> None:
    """Write a looping GIF with one palette for all frames, so that only what changes is stored.

    Parameters
    ----------
    frames : iterator of Image
        In RGB, all of one size.
    path : Path or binary stream
        Where to.
    fps : float
        Frames per second; a GIF counts in hundredths of a second.
    """
    from PIL import Image as Images

    pictures = list(frames)
    palette = _palette(pictures)
    reduced = [picture.quantize(palette=palette, dither=Images.Dither.NONE) for picture in pictures]
    each = max(round(100.0 / fps), 2) * 10
    reduced[0].save(
        path,
        format="GIF",
        save_all=True,
        append_images=reduced[1:],
        duration=[each] * (len(reduced) - 1) + [HOLD],
        loop=0,
        optimize=True,
        disposal=1,
    )


def _palette(pictures: Sequence[Image]) -> Image:
    """The colours of a few frames side by side."""
    from PIL import Image as Images

    step = max(len(pictures) // _SAMPLES, 1)
    chosen = [*pictures[::step][:_SAMPLES], pictures[-1]]
    width, height = chosen[0].size
    sheet = Images.new("RGB", (width, height * len(chosen)), "white")
    for row, picture in enumerate(chosen):
        sheet.paste(picture, (0, row * height))
    palette = sheet.quantize(_COLOURS, method=Images.Quantize.MEDIANCUT, dither=Images.Dither.NONE)
    entries = list(palette.getpalette() or [])
    # The paper must stay white, which the average of a box of pale colours is not.
    for i in range(0, len(entries), 3):
        if min(entries[i : i + 3]) >= _PALE:
            entries[i : i + 3] = [255, 255, 255]
    palette.putpalette(entries)
    return palette


def ffmpeg() -> str:
    """Return the path of ffmpeg.

    Raises
    ------
    ArgumentError
        Where it is not installed.
    """
    found = shutil.which("ffmpeg")
    if found is None:
        raise ArgumentError(
            "must end in .gif where ffmpeg is not installed",
            where="path",
            next_step="Install ffmpeg, or write a .gif.",
        )
    return found


def write_mp4(frames: Iterator[Image], path: Path, fps: float) -> None:
    """Write an MP4 by way of ffmpeg, to which the frames go raw through a pipe.

    Parameters
    ----------
    frames : iterator of Image
        In RGB, all of one size, even in both directions.
    path : Path
        The file.
    fps : float
        Frames per second.

    Raises
    ------
    ArgumentError
        Where ffmpeg is not installed.
    FileError
        Where it fails.
    """
    first = next(frames)
    size = f"{first.width}x{first.height}"
    source = ["-f", "rawvideo", "-pix_fmt", "rgb24", "-s", size, "-r", f"{fps:g}", "-i", "pipe:0"]
    target = ["-an", "-pix_fmt", "yuv420p", "-movflags", "+faststart", "-f", "mp4", str(path)]
    command = [ffmpeg(), "-hide_banner", "-loglevel", "error", "-y", *source, *target]
    raw = b"".join([first.tobytes(), *(frame.tobytes() for frame in frames)])
    done = subprocess.run(command, input=raw, capture_output=True, check=False)  # noqa: S603 - a list, no shell
    if done.returncode != 0:
        words = done.stderr.decode("utf-8", "replace").strip().splitlines()
        raise FileError(f"cannot be written by ffmpeg: {words[-1] if words else 'no reason given'}", where=str(path))
