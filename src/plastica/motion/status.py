"""How a computation ended, and what happened on the way."""

from __future__ import annotations

from dataclasses import dataclass

from plastica.errors import safe_text

__all__ = ["Counts", "Event", "Status", "status"]

_SENTENCES = {
    "done": (True, "Reached t = {t}."),
    "equilibrium": (True, "At rest at t = {t}: the rate is below rtol and the drive within its threshold."),
    "creeping": (
        True,
        "At t = {t} the rate is below rtol, but the rod still yields: it creeps algebraically, and stepping further "
        "in time has become pointless.",
    ),
    "step_limit": (
        False,
        "Stopped at t = {t} after {steps} steps, the most allowed; what was computed is kept. Raise max_steps or rtol.",
    ),
    "solver_failed": (
        False,
        "{method} gave up at t = {t} ({reason}); what was computed is kept. Try another method, or a looser rtol.",
    ),
    "not_finite": (
        False,
        "The state stopped being finite after t = {t}; what was computed is kept. Check the laws far from zero.",
    ),
    "never_settled": (False, "Not at rest even at t = {t}; what was computed is kept."),
}


@dataclass(frozen=True)
class Status:
    """How a run ended.

    Attributes
    ----------
    ok : bool
        Whether the run did what was asked.
    code : str
        "done" (reached `until`), "equilibrium" (at rest, natural curvature frozen), "creeping" (the rate is below the
        tolerance but the rod still yields: it creeps algebraically, and stepping in time has become pointless),
        and where ok is False: "step_limit", "solver_failed", "not_finite", "never_settled".
    sentence : str
        The same in words, with the next step where one is needed.
    """

    ok: bool
    code: str
    sentence: str

    def __str__(self) -> str:
        return safe_text(f"{self.code}: {self.sentence}")


def status(code: str, **facts: object) -> Status:
    """Return the status of a code, its sentence filled with facts (t, steps, method, reason)."""
    ok, sentence = _SENTENCES[code]
    return Status(ok, code, sentence.format(**facts))


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
