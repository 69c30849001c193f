"""The inertia of a rod per length, and the time and the dimensionless numbers that follow from it."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import final

from plastica.errors import ArgumentError
from plastica.physics.amounts import Amount, positive
from plastica.physics.section import Section

__all__ = ["Inertia"]

# As for the scales: beyond these the numbers of a run would leave the doubles.
_SMALLEST, _LARGEST = 1e-150, 1e150


@final
@dataclass(frozen=True)
class Inertia:
    """Mass and rotary inertia of the rod per length (paper, section 2; design, section 1.1).

    Parameters
    ----------
    mass : float
        ρA, in kg/m; 0 for none.
    rotary : float
        ρJ, in kg m; 0 for none.
    """

    mass: float = 0.0
    rotary: float = 0.0

    @classmethod
    def read(cls, mass: Amount | None, rotary: Amount | None, density: Amount | None, section: object) -> Inertia:
        """Read what the user gave: mass per length and rotary inertia, or a density with a section.

        Parameters
        ----------
        mass, rotary, density : str, float or None
            ρA in kg/m, ρJ in kg m, ρ in kg/m³; each a number in SI units or text with a unit.
        section : Section, mapping or None
            The cross section, needed with a density: ρA and ρJ = ρI follow.

        Returns
        -------
        Inertia
            Both per length; 0 where nothing is given.

        Raises
        ------
        ArgumentError
            If one is not positive, or the density lacks a section or stands beside the others.
        """
        if density is None:
            return cls(
                0.0 if mass is None else positive(mass, "kg/m", "mass_per_length"),
                0.0 if rotary is None else positive(rotary, "kg*m", "rotary_inertia"),
            )
        if mass is not None or rotary is not None:
            rule = "must not be given beside `mass_per_length` or `rotary_inertia`, which follow from it"
            raise ArgumentError(rule, where="density", value=density, next_step="Leave out one or the other.")
        if section is None:
            next_step = "Add the section, or give `mass_per_length`."
            raise ArgumentError("must be given with a `section`", where="density", value=density, next_step=next_step)
        rho, shape = positive(density, "kg/m**3", "density"), Section.read(section)
        return cls(rho * shape.area, rho * shape.second_moment)

    def time(self, length: float, stiffness: float) -> float:
        """Return the scale of time of a rod without damping: √(ρA L⁴/EI), or √(ρJ L²/EI) without mass.

        Parameters
        ----------
        length, stiffness : float
            L in m, EI in N m².

        Returns
        -------
        float
            T, in s.

        Raises
        ------
        ArgumentError
            If the rod has no inertia, so that it has no time of its own.
        """
        times = self._times(length, stiffness)
        if not any(times):
            raise ArgumentError(
                "must be given for a rod without inertia",
                where="retardation_time",
                next_step="Give it, or the mass of an undamped rod: `mass_per_length`, or `density` and `section`.",
            )
        return times[0] or times[1]

    def ratios(self, length: float, stiffness: float, time: float) -> tuple[float, float]:
        """Return ε₁ = ρA L⁴/(EI T²) and ε₀ = ρJ L²/(EI T²) (design, section 1.1).

        Parameters
        ----------
        length, stiffness, time : float
            L in m, EI in N m², T in s.

        Returns
        -------
        tuple of float
            Translational and rotary inertia; 0 where none is given.

        Raises
        ------
        ArgumentError
            If one that is given leaves 1e-150 to 1e150.
        """
        # As squares of times, so that the rod that sets the scale has 1 exactly.
        mass, rotary = (min(each / time, _LARGEST) ** 2 for each in self._times(length, stiffness))
        for name, given, ratio in (("mass_per_length", self.mass, mass), ("rotary_inertia", self.rotary, rotary)):
            if given and not _SMALLEST <= ratio <= _LARGEST:
                rule = "must give a dimensionless inertia between 1e-150 and 1e150"
                raise ArgumentError(rule, where=name, value=given, next_step="Check the units.")
        return mass, rotary

    def _times(self, length: float, stiffness: float) -> tuple[float, float]:
        return math.sqrt(self.mass / stiffness) * length * length, math.sqrt(self.rotary / stiffness) * length
