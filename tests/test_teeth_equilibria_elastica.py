"""Claim: the checks of the closed forms catch the defects that are planted for them."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import plastica as pl
from plastica.equilibria import elastica, equilibrium
from plastica.numerics import jacobi as elliptic
from tests import test_elastica, test_equilibrium
from tests.defects import replacing
from tests.support import pair

Patch = pytest.MonkeyPatch
Defect = Callable[[Patch], None]


def of(name: str, change: Callable[[Any], Any]) -> Defect:
    """One field of the elliptic functions is changed; `change` gets all of them."""
    return replacing(
        elastica,
        "jacobi",
        lambda sound: lambda *arguments: (f := sound(*arguments))._replace(**{name: change(f)}),
    )


def at(place: int, factor: float) -> Defect:
    """One of phi, phi', theta_0, theta_0', x, y is multiplied."""

    def spoiled(sound: Any) -> Any:
        def wrong(*arguments: Any, **options: Any) -> Any:
            values = list(sound(*arguments, **options))
            values[place] = values[place] * factor
            return tuple(values)

        return wrong

    return replacing(elastica, "_at", spoiled)


def uneven(sound: Any) -> Any:
    """The orbit of -alpha is that of another alpha, by an ulp."""
    return lambda gamma, alpha: sound(gamma, np.where(alpha < 0.0, np.nextafter(alpha, 0.0), alpha))


def setting(place: Any, name: str, value: Any) -> Defect:
    return replacing(place, name, lambda sound: value)


DEFECTS: dict[str, Defect] = {
    "m1 by rounded products": replacing(elastica, "_difference", lambda _: lambda four, size, square: four - square),
    "cn and dn doubled from near one": setting(elliptic, "NEAR", 0.0),
    "one step of Landen's too few": setting(elliptic, "NEGLIGIBLE", 1e-3),
    "whole turns forgotten in the angle": of("half_turns", lambda f: 0.0 * f.half_turns),
    "a digit of the integral of sd^2": of("sd_square", lambda f: f.sd_square * (1.0 + 1e-11)),
    "a digit of the integral of cos": of("cosine", lambda f: f.cosine * (1.0 + 1e-12)),
    "phi' of the other sign": at(1, -1.0),
    "a digit of theta_0": at(2, 1.0 + 1e-11),
    "a digit of theta_0'": at(3, 1.0 + 1e-7),
    "y of the other sign": at(5, -1.0),
    "the arm by a difference": replacing(elastica, "_arm", lambda _: lambda orbit, u, phi, slope, y: phi - slope),
    "a series of three terms": setting(elliptic, "EXCESS_TERMS", 3),
    "uneven by an ulp": replacing(elastica, "_orbit", uneven),
    "V without the end's share": replacing(
        equilibrium,
        "liapunov",
        lambda sound: lambda end, gamma, alpha, laws: sound(end._replace(arm=0.0 * end.arm), gamma, alpha, laws),
    ),
    "drive of the other sign": replacing(equilibrium, "drive", lambda sound: lambda end, laws: -sound(end, laws)),
    "drive without the preference": replacing(equilibrium, "drive", lambda _: lambda end, laws: end.arm),
    "not at the edge": replacing(equilibrium, "_stays", lambda _: lambda drive, threshold: abs(drive) < threshold),
    "half the drive": replacing(equilibrium, "drive", lambda sound: lambda end, laws: 0.5 * sound(end, laws)),
}


def case(regime: str, gamma: float) -> dict[str, Any]:
    found = (c for c in test_elastica.cases() if c["regime"] == regime and float(c["gamma"]) == gamma)
    return max(found, key=lambda c: abs(float(c["alpha"])))


def odd() -> None:
    test_elastica.check_odd(np.array([0.1, 3.0, 60.0]), np.array([0.3, 4.0, 15.0]), np.array([0.3, 0.7, 1.0]))


CHECKS: dict[str, Callable[[], None]] = {
    "accuracy, librating": lambda: test_elastica.check_accuracy(9.87, 3.0),
    "accuracy, rotating": lambda: test_elastica.check_accuracy(9.87, 31.4),
    "accuracy, next to the separatrix": lambda: test_elastica.check_accuracy(
        0.011543212797974595, 0.21487868947826694, bound=25.0
    ),
    "accuracy, small thrust": lambda: test_elastica.check_accuracy(1e-12, 1.0),
    "accuracy, series": lambda: test_elastica.check_accuracy(1.0, 4.0),
    "no loss next to the separatrix": lambda: test_elastica.check_near_separatrix(
        60.0, 2.0 * 60.0**0.5 * (1.0 - 1e-14)
    ),
    "reference, librating": lambda: test_elastica.check_reference(case("librating", 10.0)),
    "reference, rotating": lambda: test_elastica.check_reference(case("rotating", 8.0)),
    "odd to the bit": odd,
    "5 equilibria are equilibria": lambda: test_equilibrium.check_equilibrium(pl.equilibrium(pair("B"), 8.0, -3.0)),
    "energy and drive belong together": lambda: test_equilibrium.check_liapunov_slope("A", 1.0, 4.0),
    "5 admissible is |drive| <= threshold": test_equilibrium.check_verdict,
    "5 the verdict is the rod's": lambda: test_equilibrium.check_equilibrium(pl.equilibrium(pair("A"), 0.4, 0.2)),
}

TEETH = [
    ("accuracy, librating", "one step of Landen's too few"),
    ("accuracy, librating", "a digit of the integral of sd^2"),
    ("accuracy, librating", "a digit of the integral of cos"),
    ("accuracy, librating", "y of the other sign"),
    ("accuracy, rotating", "whole turns forgotten in the angle"),
    ("accuracy, rotating", "a digit of theta_0"),
    ("accuracy, next to the separatrix", "cn and dn doubled from near one"),
    ("accuracy, small thrust", "the arm by a difference"),
    ("accuracy, series", "a series of three terms"),
    ("no loss next to the separatrix", "m1 by rounded products"),
    ("reference, librating", "phi' of the other sign"),
    ("reference, librating", "a digit of the integral of sd^2"),
    ("reference, rotating", "a digit of theta_0'"),
    ("reference, rotating", "drive of the other sign"),
    ("reference, rotating", "V without the end's share"),
    ("odd to the bit", "uneven by an ulp"),
    ("5 equilibria are equilibria", "phi' of the other sign"),
    ("5 equilibria are equilibria", "drive without the preference"),
    ("5 equilibria are equilibria", "V without the end's share"),
    ("energy and drive belong together", "drive of the other sign"),
    ("energy and drive belong together", "a digit of theta_0'"),
    ("5 admissible is |drive| <= threshold", "not at the edge"),
    ("5 the verdict is the rod's", "half the drive"),
]


@pytest.mark.parametrize("claim", CHECKS)
def test_passes_without_a_defect(claim: str) -> None:
    CHECKS[claim]()


@pytest.mark.parametrize(("claim", "defect"), TEETH)
def test_catches(claim: str, defect: str, monkeypatch: pytest.MonkeyPatch) -> None:
    DEFECTS[defect](monkeypatch)
    with pytest.raises(AssertionError):
        CHECKS[claim]()


def test_every_defect_is_caught_by_some_check() -> None:
    assert {defect for _, defect in TEETH} == set(DEFECTS)
    assert {claim for claim, _ in TEETH} == set(CHECKS)
