"""Pictures as data that a page carries in itself."""

from __future__ import annotations

import base64
from io import BytesIO
from typing import TYPE_CHECKING

from plastica.show import plots
from plastica.show.style import drawing

if TYPE_CHECKING:
    from PIL.Image import Image

    from plastica.motion.solution import Solution

__all__ = ["gif_uri", "still_uri", "svg_uri"]

DPI = 144
"""Of the parts of a drawing that are pixels, such as a map of colours."""


def _uri(kind: str, data: bytes) -> str:
    return f"data:image/{kind};base64,{base64.b64encode(data).decode('ascii')}"


def svg_uri(name: str, solution: Solution) -> str:
    """Return a picture of `plastica.show.plots`, by the name of its function, as an SVG data URI.

    The same solution gives the same bytes: no date is written, and names inside are hashed from the content.
    """
    figure = getattr(plots, name)(solution)
    stream = BytesIO()
    with drawing():
        figure.savefig(stream, format="svg", dpi=DPI, metadata={"Date": None})
    return _uri("svg+xml", stream.getvalue())


def gif_uri(data: bytes) -> str:
    """Return a GIF as a data URI."""
    return _uri("gif", data)


def still_uri(frame: Image) -> str:
    """Return one frame as a PNG data URI, for readers who asked for no motion."""
    stream = BytesIO()
    frame.quantize(64).save(stream, format="PNG", optimize=True)
    return _uri("png", stream.getvalue())
