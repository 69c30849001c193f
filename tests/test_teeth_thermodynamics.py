"""Claim: the checks of energy and entropy catch the defects that are planted for them."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from plastica.motion import thermodynamics as along
from plastica.physics import thermodynamics as local
from plastica.physics.ledger import rates
from plastica.physics.mixture import Mixture
from plastica.show import entropy as picture
from tests import test_entropy_units, test_mixture, test_thermodynamics
from tests.defects import replacing
from tests.test_thermodynamics import model_of

Defect = Callable[[pytest.MonkeyPatch], None]


def everywhere(name: str, change: Callable[[Any], Any]) -> Defect:
    """A function is changed where it is defined, and in the modules that have imported it."""
    places = [each for each in (local, along, test_thermodynamics) if hasattr(each, name)]

    def plant(patch: pytest.MonkeyPatch) -> None:
        for place in places:
            replacing(place, name, change)(patch)

    return plant


def frozen_free_energy(_sound: Any) -> Any:
    """The natural curvature's own rate is forgotten in psi_t."""

    def rate(model: Any, t: Any, mu: Any, mu_nat: Any, mu_t: Any = None) -> Any:
        first, _ = rates(model, t, mu, mu_nat, mu_t)
        return (mu - model.division.spread(mu_nat)) * first

    return rate


def load_couple(_sound: Any) -> Any:
    """The couple of the loads is taken for the contact couple, with inertia too."""
    return lambda model, t, mu, mu_nat, mu_t=None: model.couple(t, mu) * rates(model, t, mu, mu_nat, mu_t)[0]


def without_preference(sound: Any) -> Any:
    """tau eta_t without what the preference takes."""

    def rate(model: Any, t: Any, mu: Any, mu_nat: Any, mu_t: Any = None) -> Any:
        _, natural_t = rates(model, t, mu, mu_nat, mu_t)
        slope = model.laws.preference.slope(np.asarray(mu_nat))
        return sound(model, t, mu, mu_nat, mu_t) + model.division.spread(slope * natural_t)

    return rate


def never_negative(sound: Any) -> Any:
    """The local law of other theories, not the paper's: entropy falls nowhere."""
    return lambda *arguments: np.maximum(sound(*arguments), 0.0)


def shared_evenly(sound: Any) -> Any:
    """What the whole rod produces is spread along it."""

    def rate(model: Any, *arguments: Any) -> Any:
        local_rate = sound(model, *arguments)
        return np.broadcast_to((local_rate @ model.grid.w)[..., None], local_rate.shape).copy()

    return rate


def total_undivided(sound: Any) -> Any:
    """Densities are not divided by the length."""
    return lambda kind, scales: sound(kind.removesuffix(" density"), scales)


def of_mixture(name: str, change: Callable[[Any], Any]) -> Defect:
    return replacing(Mixture, name, change)


DEFECTS: dict[str, Defect] = {
    "psi_t of a frozen natural curvature": everywhere("free_energy_rate", frozen_free_energy),
    "couple of the loads in spite of inertia": everywhere("power", load_couple),
    "entropy without the preference": everywhere("entropy_rate", without_preference),
    "entropy that falls nowhere": everywhere("entropy_rate", never_negative),
    "entropy spread along the rod": everywhere("entropy_rate", shared_evenly),
    "a digit of the free energy": everywhere("free_energy", lambda sound: lambda *a: sound(*a) * (1.0 + 1e-5)),
    "one point for every step": replacing(along, "_points", lambda sound: lambda history: 1),
    "densities as totals": replacing(along, "_scale", total_undivided),
    "no temperature in the scale": replacing(
        along, "_scale", lambda sound: lambda kind, scales: sound(kind.replace("entropy rate", "power"), scales)
    ),
    "preference slope without m1": of_mixture("mixing_slope", lambda f: lambda self, a: f(self, a) / self.second),
    "threshold without m1": of_mixture("threshold", lambda f: lambda self, a: f(self, a) / self.second),
    "flow without m1": of_mixture("flow", lambda f: lambda self, x: f(self, x) * self.second),
    "strain of the other sign": of_mixture("strain", lambda f: lambda self, mu, a: -f(self, mu, a)),
    "no energy of mixing": of_mixture("mixing_energy", lambda f: lambda self, a: 0.0 * f(self, a)),
    "hatched everywhere": replacing(
        picture, "_hatch", lambda sound: lambda ax, t, s, rate, largest: sound(ax, t, s, -np.abs(rate) - 1.0, largest)
    ),
    "hatched nowhere": replacing(picture, "_hatch", lambda sound: lambda *a: None),
}

CHECKS: dict[str, Callable[[], None]] = {
    "balance, strut": lambda: test_thermodynamics.check_pointwise(model_of("strut", 3)),
    "balance, rod": lambda: test_thermodynamics.check_pointwise(model_of("rod", 1)),
    "rate of the free energy": lambda: test_thermodynamics.check_rate_of_free_energy(model_of("rod", 3)),
    "totals": lambda: test_thermodynamics.check_totals(model_of("rod of damping 0.3", 3)),
    "along a motion": lambda: test_thermodynamics.check_history(test_thermodynamics.motion("strut")),
    "falls somewhere": test_thermodynamics.check_falls_somewhere,
    "segments mend it": test_thermodynamics.check_segments_mend_it,
    "follows the tolerance": test_thermodynamics.check_imbalance_follows_the_tolerance,
    "times": test_thermodynamics.check_times,
    "mixture": lambda: test_mixture.check_mixture(model_of("strut", 3)),
    "conjugate": lambda: test_mixture.check_drive_is_conjugate(model_of("strut", 1)),
    "law of the fraction": test_mixture.check_evolution_of_the_fraction,
    "units": test_entropy_units.check_units,
    "without a temperature": test_entropy_units.check_without_temperature,
    "picture": test_entropy_units.check_picture,
}

TEETH = [
    ("balance, strut", "psi_t of a frozen natural curvature"),
    ("balance, strut", "entropy without the preference"),
    ("balance, strut", "entropy that falls nowhere"),
    ("balance, strut", "entropy spread along the rod"),
    ("balance, rod", "couple of the loads in spite of inertia"),
    ("balance, rod", "entropy without the preference"),
    ("rate of the free energy", "psi_t of a frozen natural curvature"),
    ("rate of the free energy", "a digit of the free energy"),
    ("totals", "a digit of the free energy"),
    ("totals", "entropy without the preference"),
    ("along a motion", "entropy without the preference"),
    ("along a motion", "a digit of the free energy"),
    ("along a motion", "entropy spread along the rod"),
    ("along a motion", "one point for every step"),
    ("falls somewhere", "entropy that falls nowhere"),
    ("segments mend it", "entropy spread along the rod"),
    ("follows the tolerance", "one point for every step"),
    ("times", "one point for every step"),
    ("mixture", "preference slope without m1"),
    ("mixture", "threshold without m1"),
    ("mixture", "strain of the other sign"),
    ("conjugate", "no energy of mixing"),
    ("conjugate", "preference slope without m1"),
    ("law of the fraction", "flow without m1"),
    ("law of the fraction", "threshold without m1"),
    ("units", "densities as totals"),
    ("units", "no temperature in the scale"),
    ("without a temperature", "no temperature in the scale"),
    ("picture", "hatched everywhere"),
    ("picture", "hatched nowhere"),
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
