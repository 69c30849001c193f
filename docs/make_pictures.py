"""Make the pictures of README and docs: `python docs/make_pictures.py`. They are small, and kept in docs/pictures."""

from __future__ import annotations

from pathlib import Path

import numpy as np

import plastica as pl
from plastica.show import plots

FOLDER = Path(__file__).parent / "pictures"


def strut_held_and_released() -> pl.Solution:
    """The motion of the README's example."""
    material = pl.catalogue.material("one-shape", k=0.5)
    thrust = pl.programs.ramp_hold_release(2.2, ramp=1.0, hold=100.0, release=1.0)
    strut = pl.Strut(material, pl.Load(thrust=thrust))
    return pl.solve(strut, curvature=0.1, natural_curvature=0.1, until=150.0)


def bent_back_and_forth() -> object:
    """The loops of a rod that a couple at its end bends back and forth, from the page on results."""
    couple = pl.programs.cycles(-1.0, 1.0, 40.0)
    strut = pl.Strut(pl.catalogue.material("one-shape"), pl.Load(couple=couple), pl.Grid(nodes=8))
    return pl.force_displacement(pl.solve(strut, until=80.0), np.linspace(0.0, 80.0, 4001))


def strip() -> tuple[pl.Material, pl.Specimen]:
    """The strip of `plastica new`."""
    section = {"shape": "rectangle", "width": "20 mm", "thickness": "1.5 mm"}
    specimen = pl.Specimen(length="250 mm", youngs_modulus="2.4 GPa", section=section, retardation_time="120 s")
    size = {"length": specimen.L, "stiffness": specimen.EI, "time": specimen.T}
    return pl.catalogue.material("one-shape", **size), specimen


def charts() -> dict[str, object]:
    """The pictures of the page on equilibria."""
    material, specimen = strip()
    thrusts = np.append(1.3, np.linspace(1.62, 2.59, 15))
    return {
        "equilibria.png": pl.plot(pl.equilibria(material, 2.0, specimen=specimen)),
        "capacity.png": pl.plot(pl.capacity(material, thrusts, specimen=specimen)),
        "phase.png": pl.plot(pl.phase_diagram(material, (0.0, 4.0), (-4.0, 4.0), specimen=specimen)),
    }


def entropy() -> object:
    """The picture of the page on the general rod."""
    strut = pl.Strut(pl.catalogue.material("one-shape"), pl.Load(thrust=3.0), pl.Grid(nodes=24))
    return pl.plot(pl.thermodynamics(pl.solve(strut, curvature=0.1, until=40.0)))


def modes() -> object:
    """The picture of the page on modes: the strip of `plastica new --inertia`, bent by 20 N."""
    section = {"shape": "rectangle", "width": "20 mm", "thickness": "1 mm"}
    specimen = pl.Specimen(
        length="300 mm", youngs_modulus="210 GPa", section=section, density="7850 kg/m**3", retardation_time="0.2 ms"
    )
    size = {"length": specimen.L, "stiffness": specimen.EI, "time": specimen.T}
    material = pl.catalogue.material("never-yields", **size)
    return pl.plot(pl.modes(pl.Rod(material, pl.Load(transverse="20 N"), pl.Grid(nodes=24), specimen)))


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
    figures = {"overview.png": pl.plot(sol), "shapes.png": plots.shapes(sol), "entropy.png": entropy(), **charts()}
    figures["modes.png"] = modes()
    for name, figure in figures.items():
        made = save(figure, name)
        print(made, made.stat().st_size)
