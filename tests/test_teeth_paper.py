"""Claim: the checks of the paper's statements catch the defects that are planted for them."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import pytest

from plastica.equilibria import catalog, elastica, equilibrium, linear
from plastica.motion import dataset, longtime
from plastica.physics import ledger, thermodynamics
from plastica.physics.model import Model
from plastica.physics.scales import Scales
from tests import test_paper_2, test_paper_3, test_paper_4
from tests.defects import jacobian, rate, replacing

Defect = Callable[[pytest.MonkeyPatch], None]


def everywhere(home: Any, name: str, change: Callable[[Any], Any]) -> Defect:
    """A function is changed where it is defined, and wherever it has been imported, the tests included."""
    sound = getattr(home, name)

    def plant(patch: pytest.MonkeyPatch) -> None:
        for place in list(sys.modules.values()):
            if getattr(place, "__name__", "").startswith(("plastica", "tests.test_paper")):
                for key, value in list(vars(place).items()):
                    if value is sound:
                        patch.setattr(place, key, change(sound))

    return plant


def times(factor: float) -> Callable[[Any], Any]:
    return lambda sound: lambda *arguments, **options: factor * sound(*arguments, **options)


def as_printed(sound: Any) -> Any:
    """The linearisation without the factor gamma, as the paper prints it."""

    def matrix(equilibrium: Any, grid: Any) -> Any:
        out, n = sound(equilibrium, grid), grid.size
        out[:n, :n] = (out[:n, :n] + np.eye(n)) / equilibrium.gamma - np.eye(n)
        return out

    return matrix


def one_side(_sound: Any) -> Any:
    """Natural curvature only grows."""

    def grown(model: Model, mu: Any, mu_nat: Any) -> Any:
        return model.laws.flow.value(model.drive(mu, mu_nat) - model.threshold(mu_nat))

    return grown


def wide(sound: Any) -> Any:
    """The upper end of each interval is a little too high."""

    def widened(*arguments: Any) -> Any:
        parts, alone = sound(*arguments)
        return tuple((low, high + 1e-7) for low, high in parts), alone

    return widened


def longer(sound: Any) -> Any:
    return lambda *arguments, until, **options: sound(*arguments, until=1.001 * until, **options)


def turned(change: Callable[[Any, Any], tuple[Any, Any]]) -> Defect:
    """Tension and shear are changed."""
    return replacing(Model, "force", lambda sound: lambda model, t, theta: change(*sound(model, t, theta)))


def put(place: int, change: Callable[[float, Any], Any]) -> Defect:
    """One number of the fast rate is changed, counted from the natural curvature on."""

    def spoil(strut: Any, t: float, _y: Any, out: Any) -> None:
        at = strut.grid.size + place
        out[at] = change(t, out[at])

    return rate(spoil)


def by_the_clock(strut: Any, t: float, _y: Any, out: Any) -> None:
    out[: strut.grid.size] *= 1.0 + 1e-3 * t


DEFECTS: dict[str, Defect] = {
    "a digit of the angle": replacing(Model, "angle", times(1.0 + 1e-6)),
    "a digit of the arc": everywhere(dataset, "natural_centre_line", lambda f: lambda m, s: f(m * (1.0 + 1e-8), s)),
    "shear of the other sign": turned(lambda N, H: (N, -H)),
    "tension of the other sign": turned(lambda N, H: (-N, H)),
    "a digit of the couple": replacing(Model, "couple", times(1.0 + 1e-6)),
    "a couple without a load": replacing(Model, "couple", lambda f: lambda *a: f(*a) + 1e-9),
    "bending twice": everywhere(thermodynamics, "bending_energy", times(2.0)),
    "a digit of the stored energy": everywhere(ledger, "stored_energy", times(1.0 + 1e-9)),
    "entropy that is lost": put(3, lambda _t, found: -found),
    "a digit of the natural rate": replacing(Model, "natural_rate", times(1.0 + 1e-6)),
    "growth only": replacing(Model, "natural_rate", one_side),
    "a digit of the fast rate": put(0, lambda _t, found: found * (1.0 + 1e-6)),
    "natural curvature that creeps": put(0, lambda _t, found: found + 1e-6),
    "a term of the derivative": jacobian(0, 0),
    "work of the loads added": everywhere(ledger, "potential", times(-1.0)),
    "every state admissible": replacing(equilibrium, "_stays", lambda _sound: lambda *_: True),
    "no state admissible": replacing(equilibrium, "_stays", lambda _sound: lambda *_: False),
    "a digit of the drive": everywhere(elastica, "drive", times(1.0 + 1e-6)),
    "linearisation as printed": everywhere(linear, "linearisation", as_printed),
    "a length too few": replacing(Scales, "force", lambda _sound: property(lambda made: made.stiffness / made.length)),
    "natural curvature against its drive": put(0, lambda _t, found: -found),
    "wide intervals": replacing(catalog, "_intervals", wide),
    "a rate by the clock": rate(by_the_clock),
    "a longer unit of time": replacing(longtime, "solve", longer),
}

CHECKS: dict[str, Callable[[], None]] = {
    "centre line": lambda: test_paper_2.check_centre_line("strut"),
    "natural configuration": test_paper_2.check_natural_configuration,
    "momentum, strut": lambda: test_paper_2.check_vector_balance("strut"),
    "momentum, rod": lambda: test_paper_2.check_vector_balance("rod"),
    "components, strut": lambda: test_paper_2.check_component_balance("strut"),
    "components, rod": lambda: test_paper_2.check_component_balance("rod"),
    "couple": test_paper_2.check_couple,
    "no couple": test_paper_2.check_no_couple,
    "energy": test_paper_2.check_energy,
    "entropy": test_paper_2.check_entropy_grows,
    "production": test_paper_2.check_production,
    "evolution": test_paper_2.check_evolution,
    "ends": test_paper_3.check_strut_ends,
    "right-hand side": test_paper_3.check_right_hand_side,
    "expansion": test_paper_3.check_expansion,
    "V": test_paper_3.check_liapunov,
    "bound of the energy": test_paper_3.check_energy_bound,
    "conditions": lambda: test_paper_3.check_conditions(3.0, 1.2),
    "intervals": lambda: test_paper_3.check_intervals(3.0),
    "around the straight rod": lambda: test_paper_3.check_around_the_straight_rod(3.0),
    "linearisation": lambda: test_paper_3.check_linearisation(3.0, 1.2),
    "dimensions": test_paper_3.check_dimensions,
    "where V stays": test_paper_4.check_where_v_stays,
    "semiflow": test_paper_4.check_semiflow,
    "time-one map": test_paper_4.check_time_one_map,
    "derivative of the map": lambda: test_paper_4.check_derivative(3.0, 1.2),
}

TEETH = [
    ("centre line", "a digit of the angle"),
    ("natural configuration", "a digit of the arc"),
    ("momentum, strut", "shear of the other sign"),
    ("momentum, strut", "a digit of the couple"),
    ("momentum, rod", "shear of the other sign"),
    ("components, strut", "shear of the other sign"),
    ("components, strut", "tension of the other sign"),
    ("components, rod", "a digit of the angle"),
    ("couple", "a digit of the couple"),
    ("no couple", "a couple without a load"),
    ("energy", "bending twice"),
    ("energy", "a digit of the stored energy"),
    ("entropy", "entropy that is lost"),
    ("production", "a digit of the natural rate"),
    ("production", "growth only"),
    ("evolution", "growth only"),
    ("evolution", "a digit of the natural rate"),
    ("ends", "shear of the other sign"),
    ("ends", "tension of the other sign"),
    ("right-hand side", "a digit of the couple"),
    ("right-hand side", "a digit of the fast rate"),
    ("right-hand side", "growth only"),
    ("expansion", "a term of the derivative"),
    ("V", "work of the loads added"),
    ("V", "a digit of the stored energy"),
    ("bound of the energy", "natural curvature against its drive"),
    ("conditions", "every state admissible"),
    ("conditions", "a digit of the couple"),
    ("intervals", "wide intervals"),
    ("around the straight rod", "no state admissible"),
    ("around the straight rod", "a digit of the drive"),
    ("linearisation", "linearisation as printed"),
    ("linearisation", "a digit of the couple"),
    ("dimensions", "a length too few"),
    ("where V stays", "work of the loads added"),
    ("where V stays", "natural curvature that creeps"),
    ("semiflow", "a rate by the clock"),
    ("time-one map", "a longer unit of time"),
    ("derivative of the map", "linearisation as printed"),
    ("derivative of the map", "a longer unit of time"),
]


@pytest.fixture(autouse=True)
def _afresh() -> Iterator[None]:
    """Nothing that is computed with a defect is kept, nor without one."""
    kept = (test_paper_2.motion, test_paper_2.fields, test_paper_4.derivative)
    for each in kept:
        each.cache_clear()
    yield
    for each in kept:
        each.cache_clear()


@pytest.mark.parametrize(("claim", "defect"), TEETH)
def test_catches(claim: str, defect: str, monkeypatch: pytest.MonkeyPatch) -> None:
    DEFECTS[defect](monkeypatch)
    with pytest.raises(AssertionError):
        CHECKS[claim]()


def test_every_check_and_every_defect_is_used() -> None:
    assert {claim for claim, _ in TEETH} == set(CHECKS)
    assert {defect for _, defect in TEETH} == set(DEFECTS)
