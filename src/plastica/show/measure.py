"""Dimensionless quantities on axes and in words, for a specimen (SI) or for none."""

from __future__ import annotations

from dataclasses import dataclass

from plastica.physics.scales import KINDS, Scales, Specimen
from plastica.show.axes import DIMENSIONLESS, Quantity, axis_unit
from plastica.show.words import amount

__all__ = ["Measure"]


@dataclass(frozen=True)
class Measure:
    """Takes dimensionless values to the user's units.

    Attributes
    ----------
    specimen : Specimen or None
        Whose units; None leaves everything dimensionless.
    """

    specimen: Specimen | None

    @property
    def scales(self) -> Scales:
        """The scales of the specimen, or ones."""
        return Scales.unit() if self.specimen is None else self.specimen.scales

    def axis(self, kind: str, words: str, largest: float = 1.0) -> Quantity:
        """Return the axis for dimensionless values of a kind, in words, with a unit that suits the largest.

        Parameters
        ----------
        kind : str
            A name in `plastica.physics.scales.KINDS`.
        words : str
            What it is.
        largest : float
            Largest magnitude on the axis, dimensionless.
        """
        if self.specimen is None and kind != "angle":
            return Quantity(1.0, DIMENSIONLESS[kind], f"{words} {DIMENSIONLESS[kind]}".strip())
        unit, scale = KINDS[kind][0], float(getattr(self.scales, KINDS[kind][1]))
        factor, name = axis_unit(unit, abs(largest) * scale)
        return Quantity(factor / scale, name, f"{words} ({name})")

    def write(self, value: float, kind: str) -> str:
        """Write a dimensionless value in the user's units, such as "0.64 N" or "2 EI/L²"."""
        return amount(value * float(getattr(self.scales, KINDS[kind][1])), kind, si=self.specimen is not None)
