"""Claim: the checks of the charts catch the defects that are planted for them."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import pytest

from plastica.charts import basin, capacity, contours, gap, phase, thresholds
from tests import test_capacity, test_phase
from tests.defects import replacing

Patch = pytest.MonkeyPatch
Defect = Callable[[Patch], None]


def setting(place: Any, name: str, value: Any) -> Defect:
    return replacing(place, name, lambda sound: value)


def several(*defects: Defect) -> Defect:
    def spoil(patch: Patch) -> None:
        for defect in defects:
            defect(patch)

    return spoil


def straight_vertices(sound: Any) -> Any:
    """Where the straight line through both values of an edge vanishes."""
    return lambda f, row, u, v, fu, fv: u + (v - u) * np.clip(fu / (fu - fv), 0.0, 1.0)


def no_newton(sound: Any) -> Any:
    return lambda f, g, x, y, reach: (x, y, np.ones(x.shape, dtype=bool))


def without_threshold_slope(sound: Any) -> Any:
    """Theta taken for constant in dG/dalpha."""

    def wrong(gamma: Any, alpha: Any, side: float, laws: Any) -> Any:
        found = sound(gamma, alpha, side, laws)
        end = gap.ends(gamma, alpha)
        return found._replace(by_alpha=found.by_alpha + laws.threshold.slope(end.mu_nat) * end.theta0_slope)

    return wrong


def longer_arm(sound: Any) -> Any:
    """A derivative in gamma that forgets s phi'."""

    def wrong(gamma: Any, alpha: Any, side: float, laws: Any) -> Any:
        found = sound(gamma, alpha, side, laws)
        return found._replace(by_gamma=found.by_gamma - side * gap.ends(gamma, alpha).mu_nat / (2.0 * gamma))

    return wrong


def from_straight(sound: Any) -> Any:
    """A rod that is crooked, but naturally straight, is taken for a natural imperfection."""
    return lambda strut, curvature, natural, **options: sound(strut, curvature, 0.0, **options)


def one_sided(sound: Any) -> Any:
    return lambda laws, gamma, alpha: tuple(c for c in sound(laws, gamma, alpha) if c.side > 0)


def even_grid(gamma: Any, alpha: Any, shape: Any) -> Any:
    return np.meshgrid(np.linspace(*gamma, shape[0]), np.linspace(*alpha, shape[1]), indexing="ij")


DEFECTS: dict[str, Defect] = {
    "a digit of Euler's load": setting(thresholds, "EULER", 2.4674011),
    "a digit of sin x - x cos x": replacing(thresholds, "_lever", lambda sound: lambda x: sound(x) * (1.0 + 1e-12)),
    "a threshold that does not grow, in the slope": replacing(thresholds, "gap", without_threshold_slope),
    "the side of the edge ignored": replacing(
        thresholds, "_edge", lambda sound: lambda *arguments: sound(*arguments)._replace(side=1)
    ),
    "no step of Newton's to gamma**": replacing(
        thresholds,
        "gap",
        lambda sound: lambda *arguments: (found := sound(*arguments))._replace(by_gamma=1e30 * found.by_gamma),
    ),
    "s phi' forgotten": replacing(test_phase, "gap", longer_arm),
    "nothing leaves below the gap": replacing(
        capacity, "_leaves_from", lambda _: lambda gamma, rows: 2.29
    ),
    "any interval counts": setting(capacity, "interval_of", lambda found, alpha: 0),
    "closed in to a thousandth": setting(capacity, "PRECISION", 1e-3),
    "natural imperfections made straight": replacing(capacity, "omega_limit", from_straight),
    "shapes of one length": replacing(
        capacity, "scaled", lambda sound: lambda shape, size, strut: sound(shape, size * strut.scales.length, strut)
    ),
    "limits without a side": replacing(
        basin, "interval_of", lambda sound: lambda found, alpha: abs(sound(found, alpha) or 0)
    ),
    "vertices by straight lines": replacing(contours, "bracketed", straight_vertices),
    "special points by straight lines": replacing(contours, "_newton", no_newton),
    "D = Theta only": replacing(phase, "limiting_components", one_sided),
    "an even grid": several(setting(phase, "tracing_grid", even_grid), setting(phase, "REFINEMENTS", (1.0,))),
    "traced only once": setting(phase, "REFINEMENTS", (1.0,)),
    "one unstable direction too many": replacing(
        phase, "unstable_count", lambda sound: lambda *arguments: sound(*arguments) + 1
    ),
    "no preference in the drive": setting(phase, "drive", lambda end, laws: end.arm),
}

CHECKS: dict[str, Callable[[], None]] = {
    "thresholds of the reference": test_capacity.check_reference,
    "where the component of a stiff material splits": lambda: test_capacity.check_split(
        test_capacity.OTHERS["stiff"], thresholds.thresholds(test_capacity.OTHERS["stiff"])
    ),
    "natural imperfections part at the edge": lambda: test_capacity.check_edge("A", "natural"),
    "shapes part at the edge": lambda: test_capacity.check_edge("B", test_capacity.BENT),
    "capacity ends": test_capacity.check_end,
    "bows that leave below the gap": test_capacity.check_several_wells,
    "capacity in SI": test_capacity.check_si,
    "basins": test_capacity.check_basin,
    "slopes of the gap": test_phase.check_slopes_of_the_gap,
    "curves hold all roots": lambda: test_phase.check_curves(test_phase.diagram("B"), (0.5, 2.6, 9.3)),
    "vertices are exact": lambda: test_phase.check_vertices(test_phase.diagram("A")),
    "the question of the paper": test_phase.check_paper_question,
    "narrow tongues": test_phase.check_tongues,
    "the grid": lambda: test_phase.check_grid(test_phase.diagram("B", 12.0, 8.0)),
    "marching squares": test_phase.check_marching,
}

TEETH = [
    ("thresholds of the reference", "a digit of Euler's load"),
    ("thresholds of the reference", "a digit of sin x - x cos x"),
    ("thresholds of the reference", "a threshold that does not grow, in the slope"),
    ("thresholds of the reference", "no step of Newton's to gamma**"),
    ("where the component of a stiff material splits", "the side of the edge ignored"),
    ("natural imperfections part at the edge", "any interval counts"),
    ("natural imperfections part at the edge", "closed in to a thousandth"),
    ("natural imperfections part at the edge", "natural imperfections made straight"),
    ("shapes part at the edge", "closed in to a thousandth"),
    ("bows that leave below the gap", "nothing leaves below the gap"),
    ("capacity ends", "any interval counts"),
    ("capacity in SI", "shapes of one length"),
    ("basins", "limits without a side"),
    ("slopes of the gap", "s phi' forgotten"),
    ("curves hold all roots", "D = Theta only"),
    ("vertices are exact", "vertices by straight lines"),
    ("the question of the paper", "special points by straight lines"),
    ("narrow tongues", "an even grid"),
    ("narrow tongues", "traced only once"),
    ("the grid", "one unstable direction too many"),
    ("the grid", "no preference in the drive"),
    ("marching squares", "vertices by straight lines"),
]


@pytest.fixture(autouse=True)
def _fresh_charts() -> Iterator[None]:
    """Charts once made are kept; those made under a defect must not outlive it."""
    for kept in (test_capacity.chart, test_phase.diagram):
        kept.cache_clear()
    yield
    for kept in (test_capacity.chart, test_phase.diagram):
        kept.cache_clear()


@pytest.mark.parametrize(("claim", "defect"), TEETH)
def test_catches(claim: str, defect: str, monkeypatch: pytest.MonkeyPatch) -> None:
    DEFECTS[defect](monkeypatch)
    with pytest.raises(AssertionError):
        CHECKS[claim]()


def test_every_defect_is_caught_by_some_check() -> None:
    assert {defect for _, defect in TEETH} == set(DEFECTS)
    assert {claim for claim, _ in TEETH} == set(CHECKS)
