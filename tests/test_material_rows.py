"""Claim: materials that are sorted many at once are sorted as the judge of one would, or left to it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest

import plastica as pl
from plastica.material.rows import DOUBTFUL, FAILS, HOLDS, by_formula, sorted_rows
from plastica.physics.bounds import largest_natural_curvature

COUNT = 60
ENERGY = 3.0


@dataclass(frozen=True)
class Family:
    """Formulas, and what their parameters are drawn from: a range, or a few values."""

    preference: str
    flow: str
    threshold: str
    drawn: dict[str, Any]
    doubtful: float = 0.0
    """The largest share that may be left to the judge."""

    def rows(self) -> dict[str, np.ndarray]:
        rng = np.random.default_rng(5)
        return {
            name: rng.uniform(*of, COUNT) if isinstance(of, tuple) else rng.choice(of, COUNT)
            for name, of in self.drawn.items()
        }

    @property
    def material(self) -> pl.Material:
        first = {name: float(values[0]) for name, values in self.rows().items()}
        return pl.Material(self.preference, self.flow, self.threshold, first)


FLOW = "pos(x)**2"
FAMILIES = {
    "threshold of either sign": Family("k*m**2/2", FLOW, "0.1*((p - 2)**2 - 0.4)", {"p": (0.0, 4.0), "k": (0.5, 2.0)}),
    "stiffness of either sign": Family("k*m**2/2", FLOW, "h", {"k": (-1.0, 1.0), "h": (0.1, 0.2)}),
    "two wells": Family("k*m**2*(m**2 - w**2)**2", FLOW, "0.1", {"k": (0.1, 1.0), "w": (0.1, 5.0)}),
    "two wells, expanded": Family("m**6 - 2*w**2*m**4 + w**4*m**2", FLOW, "0.1", {"w": (0.1, 5.0)}),
    "wells that are hardly too deep": Family(
        "m**2*((m**2 - w**2)**2 + e)", FLOW, "0.1", {"w": (0.5, 5.0), "e": [-1e-5, 0.0, 1e-5]}
    ),
    "thresholds with a narrow dip": Family(
        FLOW.replace("pos(x)", "m"), FLOW, "(m**2 - w**2)**2 + e", {"w": (0.5, 5.0), "e": [-1e-5, 1e-5]}
    ),
    "negative far out": Family("m**2 - e*m**4", FLOW, "0.1", {"e": [-1.0, 0.0, 1e-9]}),
    "lopsided": Family("m**2/2 + e*m**3 + m**4", FLOW, "0.1*(1 + d*m)", {"e": [0.0, 1e-3], "d": [0.0, 1e-3]}),
    "not at rest at 0": Family("m**2 + a*m + b", FLOW, "0.1", {"a": [0.0, 1e-3], "b": [0.0, 1e-3]}, 0.8),
    "powers": Family("abs(m)**n", "pos(x)**q", "0.1", {"n": [1.5, 2.0, 2.2, 3.0], "q": [0.5, 1.0, 1.2, 2.0]}),
    "flow that turns back": Family("m**2", "pos(x)**2*(1 + a*pos(x))", "0.1", {"a": (-1.0, 1.0)}),
    "flow without a threshold": Family("m**2", "pos(x)**2 + a*x", "0.1", {"a": [0.0, 0.1, -0.1]}, 0.8),
    "energy that levels off": Family("m**2/(1 + a*m**2)", FLOW, "0.1", {"a": [0.0, 1.0]}, 0.8),
    "threshold that fades": Family("cosh(m) - 1", FLOW, "h*exp(-m**2) + g", {"h": (0.1, 0.2), "g": (-0.02, 0.02)}, 0.8),
}


def check_sorted_as_judged(name: str) -> None:
    """No material that is sorted is sorted otherwise than the judge would have it, and few are left to him."""
    family = FAMILIES[name]
    material, rows = family.material, family.rows()
    bounded = {} if by_formula(material) else {"energy": np.full(COUNT, ENERGY), "natural": np.zeros(COUNT)}
    codes = sorted_rows(material, rows, 1.0, **bounded)
    due = []
    for i in range(COUNT):
        one = material.with_parameters(**{key: float(values[i]) for key, values in rows.items()})
        reach = largest_natural_curvature(one.laws(), ENERGY)
        holds = all(each.holds for each in one.admissibility(reach if bounded and np.isfinite(reach) else None))
        due.append(HOLDS if holds else FAILS)
    told = codes != DOUBTFUL
    assert np.array_equal(codes[told], np.array(due)[told])
    assert np.mean(~told) <= family.doubtful
    assert len(set(due)) == 2 or name.startswith("two wells")


@pytest.mark.parametrize("name", FAMILIES)
def test_sorted_as_judged(name: str) -> None:
    check_sorted_as_judged(name)


def test_units_change_nothing() -> None:
    """In SI, with natural curvatures in units of 1/L, rows are sorted as without units."""
    rows = {"k": np.array([1.0, -1.0, 1.0]), "h": np.array([0.1, 0.1, -0.1])}
    plain = pl.Material("k*m**2/2", FLOW, "h", {"k": 1.0, "h": 0.1})
    texts = {"k": "0.035 N*m**2", "c": "5 1/(N**2*m**5*s)", "h": "0.0035 N*m**2"}
    si = pl.Material("k*m**2/2", "c*pos(x)**2", "h", texts)
    assert sorted_rows(plain, rows, 1.0).tolist() == [HOLDS, FAILS, FAILS]
    assert sorted_rows(si, {"k": 0.035 * rows["k"], "h": 0.035 * rows["h"]}, 4.0).tolist() == [HOLDS, FAILS, FAILS]
