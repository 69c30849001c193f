"""Claim: the checks on spectra, counts, kernels and phases catch the defects planted for them."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from plastica.equilibria import eigen, equilibrium, linear, oscillation, spectrum
from plastica.equilibria.linear import Discrete
from tests import test_asymptotic_phase as moving
from tests import test_spectrum as claims
from tests.defects import both

Patch = pytest.MonkeyPatch


def _changed(place: Any, name: str, made: Callable[[Any], Any]) -> Callable[[Patch], None]:
    return lambda patch: patch.setattr(place, name, made(getattr(place, name)))


def _cached(name: str, made: Callable[[Discrete, Any], Any]) -> Callable[[Patch], None]:
    """A defect of a property of every discretised K."""

    def spoil(patch: Patch) -> None:
        sound = vars(Discrete)[name].func
        patch.setattr(Discrete, name, property(lambda self: made(self, sound(self))))

    return spoil


def _nystroem(discrete: Discrete, _sound: Any) -> Any:
    """J by the weights of the nodes up to each: the kernel's kink on the diagonal is not seen."""
    w = discrete.grid.w
    lower = np.tril(np.ones((w.size, w.size))) - 0.5 * np.eye(w.size)
    return np.sqrt(w)[:, None] * lower * np.sqrt(w)


def _definite(discrete: Discrete, _sound: Any) -> Any:
    """The stretches with cos phi < 0 are left out."""
    cos = np.maximum(np.cos(discrete.profile.phi), 0.0)
    return (discrete.M.T * (discrete.gamma * cos)) @ discrete.M


def _upside_down(sound: Any) -> Any:
    """theta_0'(1) with the wrong sign."""

    def ends(gamma: Any, alpha: Any, depth: Any = None) -> Any:
        found = sound(gamma, alpha, depth)
        return found._replace(theta0_slope=-found.theta0_slope)

    return ends


def _without_end(sound: Any) -> Any:
    """The term of the free end is left out: its sign is taken to be that of theta_0."""

    def ends(gamma: Any, alpha: Any) -> Any:
        found = sound(gamma, alpha)
        return found._replace(theta0_slope=np.abs(found.theta0_slope) * np.sign(found.theta0))

    return ends


def _second_gap(patch: Patch) -> None:
    patch.setattr(spectrum.Spectrum, "gap", property(lambda self: -float(self.eigenvalues[1])))


def _returning(change: Callable[[Any], Any]) -> Callable[[Any], Any]:
    """A function whose result is changed."""
    return lambda sound: lambda *arguments: change(sound(*arguments))


DEFECTS: dict[str, Callable[[Patch], None]] = {
    "a digit of K": _cached("K", lambda _, sound: sound * (1.0 + 1e-11)),
    "a hundredth of K": _cached("K", lambda _, sound: sound * 1.01),
    "the Nystroem method": _cached("M", _nystroem),
    "no stretches with cos phi < 0": _cached("K", _definite),
    "error estimates too small": _changed(
        spectrum, "eigenvalues", _returning(lambda found: found._replace(errors=1e-3 * found.errors))
    ),
    "modes without the weights": _changed(
        eigen, "_signed", lambda sound: lambda v, d: sound(v, d) * np.sqrt(d.grid.w)[:, None]
    ),
    "modes of any sign": _changed(eigen, "_signed", lambda sound: lambda v, d: -sound(v, d)),
    "a fold is a large neighbourhood": _changed(spectrum, "FOLD_TOLERANCE", lambda sound: 1e-3),
    "no fold is seen": _changed(spectrum, "FOLD_TOLERANCE", lambda sound: -1.0),
    "the count sees no fold": _changed(oscillation, "FOLD_TOLERANCE", lambda sound: -1.0),
    "the slope at the end upside down": both(
        _changed(oscillation, "ends", _upside_down), _changed(equilibrium, "ends", _upside_down)
    ),
    "no term of the free end": _changed(oscillation, "ends", _without_end),
    "one zero too few": _changed(
        oscillation, "_poles", lambda sound: lambda g, a, depth: np.maximum(sound(g, a, depth) - 2, 0)
    ),
    "zeros of a straight rod": _changed(oscillation, "_poles", lambda sound: lambda g, a, d: sound(g, 0.0 * a, d)),
    "the gap of the second mode": _second_gap,
    "the kernel of a neighbour": _changed(
        spectrum, "profile", lambda sound: lambda gamma, alpha, s, depth: sound(gamma, alpha + 1e-6, s, depth)
    ),
    "no natural curvature in L": _changed(
        spectrum,
        "linearisation",
        lambda sound: lambda equilibrium, grid: sound(equilibrium, grid) * np.append(np.ones(grid.size), 0.0),
    ),
    "the potential of the other sign": _changed(
        linear, "profile", _returning(lambda found: found._replace(phi=found.phi + np.pi))
    ),
    "theta_0 for its slope": _changed(
        equilibrium, "profile", _returning(lambda found: found._replace(theta0_slope=found.theta0))
    ),
}


TEETH: list[tuple[str, Callable[[], None], str]] = [
    ("values", lambda: claims.check_values(claims.cases()[9]), "a digit of K"),
    ("values", lambda: claims.check_values(claims.cases()[9]), "the Nystroem method"),
    ("values", lambda: claims.check_values(claims.cases()[9]), "no stretches with cos phi < 0"),
    ("values", lambda: claims.check_values(claims.cases()[9]), "error estimates too small"),
    ("exact values", claims.check_exact_values, "a digit of K"),
    ("multiplicity", lambda: claims.check_multiplicity(claims.cases()[4]), "a fold is a large neighbourhood"),
    ("multiplicity", lambda: claims.check_multiplicity(claims.cases()[7]), "no fold is seen"),
    ("folds", claims.check_degenerate_at_folds, "the count sees no fold"),
    ("folds", claims.check_degenerate_at_folds, "no fold is seen"),
    ("counts", lambda: claims.check_counts(*claims.plane()), "the slope at the end upside down"),
    ("counts", lambda: claims.check_counts(*claims.plane()), "no term of the free end"),
    ("counts", lambda: claims.check_counts(*claims.plane()), "one zero too few"),
    ("counts", lambda: claims.check_counts(*claims.plane()), "zeros of a straight rod"),
    ("kernel", lambda: claims.check_kernel(5.0, 4.0), "the kernel of a neighbour"),
    ("kernel", lambda: claims.check_kernel(5.0, 4.0), "no natural curvature in L"),
    ("Jordan block", claims.check_jordan_block, "no natural curvature in L"),
    ("Jordan block", claims.check_jordan_block, "no fold is seen"),
    ("real spectrum", lambda: claims.check_real_spectrum(5.0, 4.0), "the potential of the other sign"),
    ("bounds", lambda: claims.check_within_bounds(3.0, 0.0), "the slope at the end upside down"),
    ("modes", lambda: claims.check_modes(5.0, 4.0), "modes without the weights"),
    ("modes", lambda: claims.check_modes(5.0, 4.0), "modes of any sign"),
    ("lowest level", claims.check_lowest_level, "the potential of the other sign"),
    ("decay", lambda: moving.check_decay(5.0, 8.0, (8.0, 30.0)), "the gap of the second mode"),
    ("decay", lambda: moving.check_decay(2.0, 0.0, (2.0, 20.0)), "a hundredth of K"),
    ("phase", lambda: moving.check_phase(1.0, 0.8, 60.0), "theta_0 for its slope"),
    ("projection", lambda: moving.check_projection(5.0, 4.0), "theta_0 for its slope"),
]


@pytest.mark.parametrize(("check", "defect"), [row[1:] for row in TEETH], ids=[f"{row[0]}: {row[2]}" for row in TEETH])
def test_catches(check: Callable[[], None], defect: str, monkeypatch: pytest.MonkeyPatch) -> None:
    check()
    DEFECTS[defect](monkeypatch)
    with pytest.raises(AssertionError):
        check()


def test_every_defect_has_a_check() -> None:
    assert {defect for _, _, defect in TEETH} == set(DEFECTS)
