"""Claim: the checks of the roots, of all equilibria and of their branches catch the defects planted for them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import plastica as pl
from plastica.equilibria import branches as branching
from plastica.equilibria import catalog, frozen, level_curves, projection, reach
from plastica.errors import ArgumentError
from plastica.material import discs
from plastica.numerics import chebyshev
from plastica.numerics import roots as rooting
from tests import test_branches, test_catalog, test_frozen_shapes, test_narrow_laws, test_roots
from tests.defects import replacing
from tests.support import pair

Patch = pytest.MonkeyPatch
Defect = Callable[[Patch], None]


def of_points(change: Callable[[Any], Any]) -> Defect:
    """Every limiting point is changed."""
    return replacing(catalog, "_limiting", lambda sound: lambda *given: [change(p) for p in sound(*given)])


def half_range(sound: Any) -> Any:
    return lambda f, lo, hi, **options: sound(f, 0.5 * np.asarray(lo), 0.5 * np.asarray(hi), **options)


def unflipped(sound: Any) -> Any:
    """The mirror images are given the side of what they mirror."""

    def wrong(*given: Any) -> Any:
        found = sound(*given)
        return found[:2] + [side._replace(side=-side.side) for side in found[2:]]

    return wrong


def widest(known: Any) -> Any:
    """The laws allow everything."""
    return replace(known, longest=np.full(known.longest.size, np.inf), unknown=np.zeros(known.unknown.size, bool))


def unguarded(laws: Any, m: np.ndarray) -> np.ndarray:
    with np.errstate(all="ignore"):
        return np.asarray(np.abs(laws.preference.slope(m)) - laws.threshold.value(m))


def librating(shapes: list[Any], searches: list[Any]) -> tuple[list[Any], list[Any]]:
    return [shape for shape in shapes if shape.depth >= 0.0], searches


def crosswise(sound: Any) -> Any:
    """In the last gap, two roots are joined to one another's successors."""

    def wrong(level: Any, thrust: np.ndarray, *columns: np.ndarray) -> Any:
        gap = sound(level, thrust, *columns)
        if gap is None or len(gap.pairs) < 3 or thrust[1] < 40.0:
            return gap
        first, (a, b), (c, d), *rest = gap.pairs
        return replace(gap, pairs=(first, (a, d), (c, b), *rest))

    return wrong


DEFECTS: dict[str, Defect] = {
    "interpolants hardly resolved": replacing(chebyshev, "_ROUNDING", lambda _: 1.0),
    "no look between the nodes": replacing(chebyshev, "_AT_CHECKS", lambda at: np.zeros_like(at) + np.nan),
    "the ends of pieces not looked at": replacing(chebyshev, "_CHECKS", lambda checks: 0.9 * checks),
    "extrema not cut at": replacing(rooting, "_split", lambda _: lambda pieces: pieces),
    "double roots not looked for": replacing(rooting, "_extrema", lambda _: lambda *given: []),
    "brackets left open": replacing(rooting, "bracketed", lambda _: lambda f, row, u, v, fu, fv: 0.5 * (u + v)),
    "half the range": replacing(catalog, "roots_of_rows", half_range),
    "half the range of shapes": replacing(frozen, "roots_of_rows", half_range),
    "reach too short": replacing(
        catalog, "reach", lambda sound: lambda *given: replace(k := sound(*given), alpha=0.7 * k.alpha)
    ),
    "mirror images on the same side": replacing(catalog, "_limiting_roots", unflipped),
    "a digit of alpha": of_points(lambda p: replace(p, alpha=p.alpha * (1.0 + 1e-12))),
    "a digit of the rate": of_points(lambda p: replace(p, rate=p.rate * (1.0 + 1e-9))),
    "attracting where it repels": of_points(lambda p: replace(p, attracting=not p.attracting)),
    "a drive that only pushes one way": replacing(
        catalog, "drive", lambda sound: lambda end, laws: np.maximum(sound(end, laws), 0.0)
    ),
    "folds on one side": replacing(
        catalog, "_folds", lambda sound: lambda *given: [fold for fold in sound(*given) if fold.alpha > 0.0]
    ),
    "first pieces that no law shortens": replacing(
        catalog, "grain", lambda sound: lambda *given: widest(sound(*given))
    ),
    "a reach that is only sampled": replacing(reach, "_not_free", lambda _: lambda *given: 0.0),
    "an overflow taken for a value": replacing(reach, "_gap", lambda _: unguarded),
    "laws taken to be even": replacing(catalog, "is_even", lambda _: lambda law: True),
    "discs too small": replacing(
        discs, "_made", lambda sound: lambda low, high, centre, radius: sound(low, high, centre, 0.3 * radius)
    ),
    "ranges of sin without their tops": replacing(
        discs, "_wave", lambda sound: lambda u, phase: replace(w := sound(u, phase), high=0.9 * w.high)
    ),
    "a pair at a fold taken for one": replacing(
        frozen, "_told", lambda sound: lambda shapes, searches: frozen.Shapes(tuple(shapes), True, "")
    ),
    "the depth forgotten": replacing(
        catalog, "frozen_equilibrium", lambda sound: lambda gamma, alpha, depth, several: sound(gamma, alpha)
    ),
    "steps in the depth taken for steps in alpha": replacing(projection, "alpha_rate", lambda _: lambda *given: 1.0),
    "rotating rods forgotten": replacing(frozen, "_by_depth", lambda sound: lambda *given: librating(*sound(*given))),
    "roots joined crosswise": replacing(level_curves, "_joined", crosswise),
    "the last fold forgotten": replacing(
        branching, "_fold_alphas", lambda sound: lambda g: [x[:-1] if x.size > 1 else x for x in sound(g)]
    ),
    "stability of the straight rod": replacing(
        branching, "unstable_count", lambda sound: lambda g, a: sound(g, 0.0 * np.asarray(a))
    ),
    "folds at a column": replacing(
        level_curves,
        "_folds",
        lambda sound: lambda level, t, rich: [replace(x, gamma=float(t[0])) for x in sound(level, t, rich)],
    ),
}


def waves() -> None:
    def f(x: np.ndarray) -> np.ndarray:
        return np.asarray(np.sin(300.0 * x) + 0.3 * np.cos(170.0 * x) + 0.5 * np.abs(x - 0.2) ** 1.5)

    test_roots.check_sign_changes(f, rooting.roots(f, -1.0, 1.0, breaks=[0.2]), -1.0, 1.0)


def kinked() -> None:
    material = pl.Material(
        "k*(m**2/2 + pos(abs(m) - 1)**3)", "pos(x)**2", "h*(abs(m - 1) + abs(m + 1))", {"k": 0.3, "h": 0.3}
    )
    test_catalog.check_scan(catalog.equilibria(material, 12.0))


def case(name: str, gamma: float) -> dict[str, Any]:
    return next(c for c in test_catalog.cases() if c["pair"] == name and float(c["gamma"]) == gamma)


def folds(gamma: float) -> dict[str, Any]:
    return next(c for c in test_catalog.limiting_reference()["folds"] if float(c["gamma"]) == gamma)


CHECKS: dict[str, Callable[[], None]] = {
    "simple roots": lambda: test_roots.check_roots(lambda x: (x - 0.31) * (x + 0.7) * np.exp(x), [0.31, -0.7]),
    "two near roots": lambda: test_roots.check_double(1e-14, ["crossing"] * 2),
    "a double root": lambda: test_roots.check_double(0.0, ["tangency"]),
    "a layer at a cut": test_roots.test_narrow_features,
    "sign changes of waves": waves,
    "limiting equilibria, A": lambda: test_catalog.check_reference(case("A", 3.0)),
    "limiting equilibria, B": lambda: test_catalog.check_reference(case("B", 0.5)),
    "folds": lambda: test_catalog.check_folds(folds(20.0)),
    "scan": lambda: test_catalog.check_scan(catalog.equilibria(pair("B"), 30.0)),
    "scan with kinks": kinked,
    "tangency": lambda: test_catalog.check_tangency(0.0, 4, 2, 1),
    "five shapes": lambda: test_branches.check_counts(40.0, 0.1, 5),
    "a narrow well": test_narrow_laws.check_narrower_well,
    "an overflow far out": test_narrow_laws.check_overflow,
    "a well on one side": test_narrow_laws.check_one_side,
    "a well far out": test_narrow_laws.check_reach,
    "enclosures": lambda: test_narrow_laws.check_enclosure(
        test_narrow_laws.law_of("2+cos(3*m)*sin(m)"), 0, np.linspace(-4.0, 4.0, 21)
    ),
    "shapes at a fold": test_frozen_shapes.check_fold,
    "shapes deep in the layer": test_frozen_shapes.check_values,
    "spectra deep in the layer": test_frozen_shapes.check_spectrum,
    "disturbances deep in the layer": test_frozen_shapes.check_phase,
    "shapes of a large thrust": lambda: test_frozen_shapes.check_deep(1e3, -3.0),
    "branches": lambda: test_branches.check_branches(8.0, 0.0, 40.0, 107),
    "fold curve": test_branches.check_fold_curve,
}

TEETH = [
    ("simple roots", "brackets left open"),
    ("two near roots", "extrema not cut at"),
    ("a double root", "double roots not looked for"),
    ("a layer at a cut", "the ends of pieces not looked at"),
    ("sign changes of waves", "interpolants hardly resolved"),
    ("sign changes of waves", "no look between the nodes"),
    ("limiting equilibria, A", "half the range"),
    ("limiting equilibria, A", "reach too short"),
    ("limiting equilibria, A", "mirror images on the same side"),
    ("limiting equilibria, A", "a digit of alpha"),
    ("limiting equilibria, B", "a digit of the rate"),
    ("limiting equilibria, B", "attracting where it repels"),
    ("folds", "folds on one side"),
    ("folds", "half the range"),
    ("scan", "a drive that only pushes one way"),
    ("scan with kinks", "half the range"),
    ("tangency", "double roots not looked for"),
    ("five shapes", "half the range of shapes"),
    ("a narrow well", "first pieces that no law shortens"),
    ("an overflow far out", "an overflow taken for a value"),
    ("a well on one side", "laws taken to be even"),
    ("a well far out", "a reach that is only sampled"),
    ("enclosures", "discs too small"),
    ("enclosures", "ranges of sin without their tops"),
    ("shapes at a fold", "a pair at a fold taken for one"),
    ("shapes deep in the layer", "the depth forgotten"),
    ("spectra deep in the layer", "the depth forgotten"),
    ("disturbances deep in the layer", "steps in the depth taken for steps in alpha"),
    ("shapes of a large thrust", "rotating rods forgotten"),
    ("branches", "roots joined crosswise"),
    ("branches", "stability of the straight rod"),
    ("branches", "folds at a column"),
    ("fold curve", "the last fold forgotten"),
]


@pytest.mark.parametrize("claim", CHECKS)
def test_passes_without_a_defect(claim: str) -> None:
    CHECKS[claim]()


@pytest.mark.parametrize(("claim", "defect"), TEETH)
@pytest.mark.filterwarnings("ignore::RuntimeWarning")
def test_catches(claim: str, defect: str, monkeypatch: Patch) -> None:
    DEFECTS[defect](monkeypatch)
    with pytest.raises((AssertionError, ArgumentError)):
        CHECKS[claim]()


def test_every_defect_is_caught_by_some_check() -> None:
    assert {defect for _, defect in TEETH} == set(DEFECTS)
    assert {claim for claim, _ in TEETH} == set(CHECKS)
