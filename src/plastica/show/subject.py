"""What a report is about, and what a section of it is made of."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

from plastica.motion.solution import Solution
from plastica.show.view import View, view
from plastica.show.words import Writer

if TYPE_CHECKING:
    from plastica.show.film import Reel

__all__ = ["Section", "Subject"]


@dataclass(frozen=True)
class Section:
    """A part of the page: its anchor (also the name of its template), heading, and data."""

    key: str
    heading: str
    data: dict[str, Any]


@dataclass(frozen=True)
class Subject:
    """What a report is about, how long its film runs (s; 0: no film), and the film where it is drawn already."""

    solution: Solution
    film_seconds: float
    drawn: Reel | None = None

    @cached_property
    def seen(self) -> View:
        """The solution made ready for pictures."""
        return view(self.solution)

    @cached_property
    def film(self) -> Reel | None:
        """The film of the page; None where none is wanted, or nothing moves."""
        if self.film_seconds == 0.0 or self.seen.t.size == 1:
            return None
        # What only tells of a result draws nothing, and does not wait for what draws.
        from plastica.show.film import reel

        return self.drawn or reel(self.solution, self.film_seconds)

    @property
    def write(self) -> Callable[[float, str], str]:
        """Writes a value of a kind in the user's units."""
        return Writer(self.solution).amount

    @property
    def of_scale(self) -> Callable[[float, str], str]:
        """Writes a dimensionless value of a kind in the user's units."""
        return Writer(self.solution).of_scale
