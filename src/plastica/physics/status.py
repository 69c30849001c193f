"""How a computation ended."""

from __future__ import annotations

from dataclasses import dataclass
from math import isfinite

from plastica.errors import safe_text

__all__ = ["LOST", "Status", "error_on_grid", "on_grid", "status"]

LOST = 1e-3
"""How far the grid may put the free end off, in L, before a result counts as not resolved."""


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
    "not_resolved": (False, "{found} But {told} Take more nodes, or breaks where the shape changes fast."),
    "not_found": (False, "No static shape found: {left:.1e} of the balance of moments is left."),
    "never_settled": (False, "Not at rest even at t = {t}; what was computed is kept."),
}


@dataclass(frozen=True)
class Status:
    """How a run, or the search for a static shape, ended.

    Attributes
    ----------
    ok : bool
        Whether the run did what was asked.
    code : str
        "done" (reached `until`), "equilibrium" (at rest, natural curvature frozen), "creeping" (the rate is below the
        tolerance but the rod still yields: it creeps algebraically, and stepping in time has become pointless),
        and where ok is False: "step_limit", "solver_failed", "not_finite", "never_settled"; "not_resolved" (the grid is
        too coarse: the free end may be off by 1e-3 of the length or more), and of a `Rest` "not_found".
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


def on_grid(found: Status, per_element: int, error: float, allowed: float) -> Status:
    """Return the status of what was computed on a grid, once its error is known.

    Parameters
    ----------
    found : Status
        How the computation ended.
    per_element : int
        Nodes per element.
    error : float
        How far the grid may put the free end off, in L; infinite where that cannot be told.
    allowed : float
        What need not be spoken of, in L: the tolerance asked for.

    Returns
    -------
    Status
        Up to `allowed` the same. Above it a sentence more; and above `LOST` "not_resolved", unless it failed already.
    """
    told = error_on_grid(per_element, error, allowed)
    if not told:
        return found
    if error <= LOST or not found.ok:
        return Status(found.ok, found.code, f"{found.sentence} {told}")
    return status("not_resolved", found=found.sentence, told=told)


def error_on_grid(per_element: int, error: float, allowed: float) -> str:
    """Return what is to be told of the error that a grid makes: nothing where it is allowed."""
    if error <= allowed:
        return ""
    if error <= LOST:
        return f"On {per_element} nodes per element the free end is known to {error:.0e} L only."
    by = f"by {error:.1g} L" if isfinite(error) else "by any amount"
    return f"{per_element} nodes per element do not resolve the shape: the free end may be off {by}."
