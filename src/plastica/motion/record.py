"""What happened during a run, and what it cost."""

from __future__ import annotations

from dataclasses import dataclass

__all__ = ["Counts", "Event"]


@dataclass(frozen=True)
class Event:
    """Something that happened at a time.

    Attributes
    ----------
    t : float
        Time, in the user's units.
    kind : str
        "onset" or "arrest" of yielding, "jump" or "slope" of a load, "quarter_turn" of the tip.
    direction : int
        +1 or -1: the sign of the drive for onset and arrest, of the tip angle for a quarter turn; 0 for loads.
    sentence : str
        The same in words.
    """

    t: float
    kind: str
    direction: int
    sentence: str


@dataclass(frozen=True)
class Counts:
    """What a run cost: accepted steps, evaluations of the right-hand side and of its Jacobian, restarts."""

    steps: int
    rates: int
    jacobians: int
    restarts: int
