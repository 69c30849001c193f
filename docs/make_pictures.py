"""Make the pictures of README and docs: `python docs/make_pictures.py`. They are small, and kept in docs/pictures."""

from __future__ import annotations

from pathlib import Path

import plastica as pl
from plastica.show import plots

FOLDER = Path(__file__).parent / "pictures"


def strut_held_and_released() -> pl.Solution:
    """The motion of the README's example."""
    material = pl.catalogue.material("one-shape", k=0.5)
    thrust = pl.programs.ramp_hold_release(2.2, ramp=1.0, hold=100.0, release=1.0)
    strut = pl.Strut(material, pl.Load(thrust=thrust))
    return pl.solve(strut, curvature=0.1, natural_curvature=0.1, until=150.0)


def save(figure: object, name: str) -> Path:
    """Write a figure with 64 colours, which is what its lines need."""
    from PIL import Image

    path = FOLDER / name
    figure.savefig(path, dpi=80)  # type: ignore[attr-defined]
    with Image.open(path) as picture:
        small = picture.convert("RGB").quantize(128, dither=Image.Dither.NONE)
    small.save(path, optimize=True)
    return path


if __name__ == "__main__":
    FOLDER.mkdir(exist_ok=True)
    sol = strut_held_and_released()
    for made in (save(pl.plot(sol), "overview.png"), save(plots.shapes(sol), "shapes.png")):
        print(made, made.stat().st_size)
