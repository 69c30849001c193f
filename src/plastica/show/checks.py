"""Sections of a report on how far the result can be relied on: ledger, bounds, provenance."""

from __future__ import annotations

from typing import Final

import numpy as np

from plastica.motion.outcome import REFERENCES, provenance
from plastica.motion.solution import Solution
from plastica.physics.ledger import kinetic_energy, stored_energy
from plastica.show.subject import Section, Subject
from plastica.show.words import number

__all__ = ["allowed", "ledger", "origin", "promises"]

LEDGER_SLACK: Final = 100.0
"""The ledger is asked to balance to this many times rtol times the largest energy."""


def allowed(solution: Solution) -> float:
    """Return what the ledger of a motion may leave over, in the units of the ledger."""
    return LEDGER_SLACK * solution.rtol * solution.ledger.largest_energy


def ledger(subject: Subject) -> Section:
    """The balance sheet of the energy, and whether it balances."""
    sheet, write = subject.solution.ledger, subject.write
    rows = [
        ("Work of the loads", "put in by the loads", sheet.work),
        ("Change of the stored energy", "held by the bent rod and its material", sheet.stored_energy),
        ("Viscous dissipation", "lost to the rate of bending", sheet.viscous_dissipation),
        ("Dissipation of the natural curvature", "lost to yielding: the price of the set", sheet.natural_dissipation),
    ]
    if subject.solution.model.has_inertia:
        rows.append(("Change of the kinetic energy", "of the moving rod", sheet.kinetic_energy))
    bar = allowed(subject.solution)
    return Section(
        "ledger",
        "The ledger",
        {
            "rows": [(name, words, write(value, "energy")) for name, words, value in rows],
            "kinetic": subject.solution.model.has_inertia,
            "residual": write(sheet.residual, "energy"),
            "balances": abs(sheet.residual) <= bar,
            "judgement": _judgement(subject, abs(sheet.residual), bar),
        },
    )


def _judgement(subject: Subject, left: float, bar: float) -> str:
    write = subject.write
    if bar == 0.0:
        return "Nothing was put in, stored or lost, so there is nothing to balance."
    limit = f"{write(bar, 'energy')}, which is 100 times the tolerance of the computation times the largest energy met"
    if left > bar:
        return (
            f"The books do not balance: {write(left, 'energy')} are left over, more than {limit}. "
            "Compute again with a smaller tolerance before relying on this result."
        )
    if left == 0.0:
        return f"The books balance to the last digit; up to {limit} would be accepted."
    share = f"{number(100.0 * left / bar, 2)} % of what is accepted"
    return f"The books balance: {write(left, 'energy')} are left over, {share} ({limit})."


def promises(subject: Subject) -> Section:
    """The a-priori bounds, with what was met on the way."""
    solution = subject.solution
    model, layout, w = solution.model, solution.model.layout, solution.model.grid.w
    y, bound = solution.history.y, solution.bounds
    mu, mu_nat, mu_t = layout.mu(y), layout.natural(y), layout.mu_t(y)
    bending = np.sqrt((mu - model.division.spread(mu_nat)) ** 2 @ w)
    held = stored_energy(model, mu, mu_nat) + kinetic_energy(model, mu, mu_t)
    natural = np.abs(mu_nat.reshape(y.shape[0], -1)).max(axis=1)
    energy = "Stored and kinetic energy, in EI/L" if model.has_inertia else "Stored energy, in EI/L"
    met = (
        (energy, bound.energy, held),
        ("Distance of the rod from its natural shape, ‖μ − μ°‖", bound.bending, bending),
        ("Natural curvature |μ°|, in 1/L", bound.natural_curvature, natural),
        ("Size of the state, ‖μ‖ + |μ°|", bound.norm, np.sqrt(mu**2 @ w) + natural),
        ("Drive |D|, in EI", bound.drive, np.abs(model.drive(mu, mu_nat))),
    )
    rows = [
        (name, number(float(most)), number(float(values.max())), _used(float(values.max()), float(most)))
        for name, most, values in met
    ]
    kept = all(float(values.max()) <= most * (1.0 + 1e-9) + 1e-12 for _, most, values in met)
    given = bool(np.isfinite(bound.energy))
    return Section(
        "promises",
        "What the theory promised beforehand",
        {
            "rows": rows,
            "kept": kept,
            "given": given,
            "growth": number(bound.growth, 3) if np.isfinite(bound.growth) else "",
            "unit": "retardation time" if model.damping == 1.0 else "T",
        },
    )


def _used(value: float, most: float) -> str:
    return f"{number(100.0 * value / most, 2)} %" if np.isfinite(most) and most > 0.0 else "–"


_PROVENANCE_WORDS: Final = {
    "plastica_version": "Version of plastica",
    "method": "Solver",
    "rtol": "Relative tolerance",
    "atol": "Absolute tolerance",
    "steps": "Steps",
    "rate_evaluations": "Evaluations of the rate",
    "jacobian_evaluations": "Evaluations of the Jacobian",
    "restarts": "Restarts at switches and knots",
    "nodes": "Nodes",
    "initial_curvature": "Initial curvature",
    "platform": "Platform",
    "file": "Scenario file",
}
_SHOWN_ELSEWHERE: Final = ("scenario", "notes", "title", "description")


def origin(subject: Subject) -> Section:
    """Where the result comes from, the scenario word for word, and the literature."""
    entries = provenance(subject.solution)
    rows = [
        (
            _PROVENANCE_WORDS.get(key, key.replace("_", " ").capitalize()),
            number(value) if isinstance(value, float) else str(value),
        )
        for key, value in entries.items()
        if key not in _SHOWN_ELSEWHERE and value != ""
    ]
    method = subject.solution.method
    return Section(
        "origin",
        "Where this comes from",
        {
            "rows": rows,
            "scenario": entries.get("scenario", ""),
            "references": [text for i, text in enumerate(REFERENCES) if i == 0 or method in text],
        },
    )
