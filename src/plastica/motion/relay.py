"""Methods that go on where another gave up, and what is said of that."""

from __future__ import annotations

from collections.abc import Sequence

from plastica.motion.integrate import Leg
from plastica.motion.plan import Plan
from plastica.physics.model import Model

__all__ = ["failures", "given_up", "last_method", "next_method", "when_and_why"]


def next_method(plan: Plan, legs: Sequence[Leg], taken: int) -> str | None:
    """Return the method that goes on after some legs and so many steps; None where the run has ended."""
    if not legs:
        return plan.method
    last = legs[-1]
    unfinished = last.ending in ("landed", "switched", "full", "solver_failed")
    if not (unfinished and last.history.last.until(plan.end) > 0.0 and taken < plan.max_steps):
        return None
    return plan.method_after(len(failures(legs)))


def failures(legs: Sequence[Leg]) -> list[Leg]:
    """Return the legs on which a method gave up."""
    return [leg for leg in legs if leg.ending == "solver_failed"]


def last_method(plan: Plan, legs: Sequence[Leg]) -> str:
    """Return the method of the last leg."""
    before = len(failures(legs[:-1]))
    return plan.method_after(before) or plan.method


def given_up(plan: Plan, legs: Sequence[Leg], strut: Model) -> list[str]:
    """Return what is said of methods that gave up, and of those that went on."""
    said = []
    for k, leg in enumerate(failures(legs[:-1])):
        t, reason = when_and_why(leg, strut)
        first, then = plan.method_after(k), plan.method_after(k + 1)
        said.append(f"{first} gave up at t = {t} ({reason}), and {then} went on from there.")
    return said


def when_and_why(leg: Leg, strut: Model) -> tuple[str, str]:
    """Return the last time of a leg with its unit, and why its method gave up."""
    return f"{leg.history.end * strut.scales.time:.6g} {strut.time_unit}", leg.message.rstrip(".") or "no reason given"
