"""The cross section of a rod, its area and its second moment of area."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Final

from plastica.errors import ArgumentError
from plastica.physics.amounts import Amount, plain, positive

__all__ = ["Section"]

_SECTIONS: Final = MappingProxyType(
    {
        "rectangle": (("width", "thickness"),),
        "circle": (("diameter",),),
        "tube": (("outer_diameter", "inner_diameter"), ("outer_diameter", "wall")),
    }
)


@dataclass(frozen=True)
class Section:
    """The cross section of the rod, which gives its area A and second moment of area I.

    Parameters
    ----------
    shape : str
        "rectangle", "circle" or "tube".
    dimensions : tuple of (name, value)
        The sizes: width and thickness; diameter; outer diameter with inner diameter or wall.

    Raises
    ------
    ArgumentError
        If the shape is unknown, a size is missing, unknown, not positive, or does not fit the others.
    """

    shape: str
    dimensions: tuple[tuple[str, Amount], ...]
    second_moment: float = field(init=False, repr=False, compare=False)
    """I, in m⁴: w t³/12; π d⁴/64; π (d⁴ − d_i⁴)/64."""
    area: float = field(init=False, repr=False, compare=False)
    """A, in m²: w t; π d²/4; π (d² − d_i²)/4."""

    def __post_init__(self) -> None:
        names = tuple(sorted(name for name, _ in self.dimensions))
        allowed = _SECTIONS.get(self.shape) if isinstance(self.shape, str) else None
        if allowed is None:
            rule = "must be one of " + ", ".join(_SECTIONS)
            raise ArgumentError(rule, where="section.shape", value=self.shape)
        if names not in [tuple(sorted(choice)) for choice in allowed]:
            choices = " or ".join(" and ".join(choice) for choice in allowed)
            rule = f"must have {choices} for a {self.shape}"
            raise ArgumentError(rule, where="section", value=", ".join(names))
        sizes = {name: positive(value, "m", f"section.{name}") for name, value in self.dimensions}
        area, second_moment = _moments(self.shape, sizes)
        object.__setattr__(self, "area", area)
        object.__setattr__(self, "second_moment", second_moment)

    @classmethod
    def read(cls, given: object) -> Section:
        """Read a section from a mapping such as ``{"shape": "circle", "diameter": "4 mm"}``.

        Parameters
        ----------
        given : mapping or Section
            The shape and its sizes.

        Returns
        -------
        Section
            The section, validated.

        Raises
        ------
        ArgumentError
            If it is not a mapping of this kind.
        """
        if isinstance(given, Section):
            return given
        if not isinstance(given, Mapping) or not all(isinstance(key, str) for key in given):
            example = '{"shape": "rectangle", "width": "20 mm", "thickness": "1.5 mm"}'
            rule = f"must be a mapping of a shape and its sizes, such as {example}"
            raise ArgumentError(rule, where="section", value=given)
        sizes = sorted((name, plain(value)) for name, value in given.items() if name != "shape")
        return cls(given.get("shape", ""), tuple(sizes))

    def to_dict(self) -> dict[str, Amount]:
        """Return the mapping that `read` takes.

        Returns
        -------
        dict
            Shape and sizes as they were given.
        """
        return {"shape": self.shape, **dict(self.dimensions)}


def _moments(shape: str, sizes: Mapping[str, float]) -> tuple[float, float]:
    if shape == "rectangle":
        width, thickness = sizes["width"], sizes["thickness"]
        if thickness > width:
            raise ArgumentError(
                f"must be at most the width, {width:g} m, since a strip bends about its thin axis",
                where="section.thickness",
                value=thickness,
                next_step="Exchange the two.",
            )
        return width * thickness, width * thickness**3 / 12.0
    if shape == "circle":
        return math.pi * sizes["diameter"] ** 2 / 4.0, math.pi * sizes["diameter"] ** 4 / 64.0
    outer = sizes["outer_diameter"]
    key = "wall" if "wall" in sizes else "inner_diameter"
    inner = outer - 2.0 * sizes["wall"] if key == "wall" else sizes["inner_diameter"]
    if not 0.0 < inner < outer:
        rule = f"must be less than {outer / 2.0 if key == 'wall' else outer:g} m to fit the outer diameter"
        raise ArgumentError(rule, where=f"section.{key}", value=sizes[key])
    # Factored, so that a thin wall loses no digits.
    area = math.pi * (outer - inner) * (outer + inner) / 4.0
    return area, area * (outer**2 + inner**2) / 16.0
