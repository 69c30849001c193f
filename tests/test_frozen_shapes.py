"""Claim: all shapes of one frozen natural curvature are found, to the largest thrust; what cannot be told is said."""

from __future__ import annotations

import copy
import json
import math
import pickle
from typing import Any

import mpmath as mp
import numpy as np
import pytest

import plastica as pl
from plastica.equilibria.catalog import equilibria_at
from plastica.equilibria.elastica import ends
from plastica.equilibria.equilibrium import Equilibrium
from plastica.equilibria.projection import projection
from plastica.errors import ArgumentError
from tests.support import DATA, EPS

FOLD = (-1.04922961359205, -1.04922961359206)
"""At gamma = 5: natural curvatures of three equilibria, and of one."""


def cases() -> list[dict[str, Any]]:
    return json.loads((DATA / "frozen_equilibria.json").read_text())["cases"]


def check_reference(case: dict[str, Any]) -> None:
    found = equilibria_at(float(case["gamma"]), float(case["natural_curvature"]))
    assert found.complete
    assert [shape.unstable for shape in found] == case["unstable"]
    for shape, alpha in zip(found, case["alpha"], strict=True):
        assert abs(shape.alpha - float(alpha)) <= 8.0 * EPS * max(1.0, abs(float(alpha)))


def check_fold() -> None:
    for natural in FOLD:
        found = equilibria_at(5.0, natural)
        assert [shape.multiplicity for shape in found] == [1, 2]
        assert not found.complete
        assert "cannot tell" in found.sentence
        assert abs(found[1].mu_nat - natural) <= 1e-13
    assert equilibria_at(5.0, -1.0).complete


def exact(gamma: float, shape: Equilibrium, depth: mp.mpf) -> mp.mpf:
    """phi'(1) on a rod of that depth, in high precision."""
    root, part = mp.sqrt(gamma), mp.tanh(abs(depth))
    sign = 1 if shape.alpha > 0.0 else -1
    if depth > 0:
        return sign * 2 * root * part * mp.ellipfun("cn", root, m=part**2)
    return sign * 2 * root / part * mp.ellipfun("dn", root / part, m=part**2)


def check_deep(gamma: float, natural: float) -> None:
    """Every shape is one, in high precision; the index sum is 1; and dense sampling sees no more."""
    found = equilibria_at(gamma, natural)
    assert found.complete, found.sentence
    assert sum((-1) ** shape.unstable for shape in found) == 1
    places = [(shape.alpha, shape.depth) for shape in found]
    assert len(set(places)) == len(places)
    with mp.workdps(60 + round(0.9 * math.sqrt(gamma))):
        for shape in found[:: max(1, len(found) // 12)]:
            if shape.depth:
                near = [exact(gamma, shape, shape.depth * (1 + mp.mpf(d))) - mp.mpf(natural) for d in (-1e-12, 1e-12)]
                assert near[0] * near[1] < 0, (shape.alpha, shape.depth)
    t = np.concatenate([np.linspace(1e-9, math.sqrt(gamma) + 20.0, 120_000), np.geomspace(1e-9, 1.0, 2000)])
    t = np.unique(t)
    changes = int(natural == 0.0)
    for sign, turn in ((1.0, 1.0), (-1.0, 1.0), (1.0, -1.0), (-1.0, -1.0)):
        deep = t if turn > 0.0 else t[t > math.asinh(2.0 * math.sqrt(gamma) / max(abs(natural), 1e-6)) * 0.999]
        off = ends(gamma, sign, turn * deep).mu_nat - natural
        changes += int(np.count_nonzero(off[:-1] * off[1:] < 0.0))
    assert len(found) == changes


def check_values() -> None:
    """Angle, tip and energy of a rod that lies deep in the layer, from its depth."""
    gamma = 1e4
    found = equilibria_at(gamma, 0.1)
    outermost = max((shape for shape in found if shape.alpha > 0.0), key=lambda shape: shape.depth or 0.0)
    assert len({shape.alpha for shape in found}) < len(found)
    assert outermost.regime == "librating"
    assert outermost.depth is not None
    with mp.workdps(150):
        root, part = mp.sqrt(gamma), mp.tanh(mp.mpf(outermost.depth))
        sn, dn = (mp.ellipfun(name, root, m=part**2) for name in ("sn", "dn"))
        phi = 2 * mp.atan2(part * sn, dn)
        turns = mp.nint(root / (2 * mp.ellipk(part**2)))
        amplitude = mp.asin((-1) ** int(turns) * sn) + turns * mp.pi
        x = 2 * mp.ellipe(amplitude, part**2) / root - 1
        half = 2 * mp.atan2(part * mp.ellipfun("sn", root / 2, m=part**2), mp.ellipfun("dn", root / 2, m=part**2))
        energy = gamma * (2 * x - mp.cos(phi)) - outermost.mu_nat * (phi - outermost.mu_nat)
    assert outermost.phi(1.0) == pytest.approx(float(phi), rel=1e-12)
    assert outermost.phi(0.5) == pytest.approx(float(half), rel=1e-12)
    assert outermost.tip[0] == pytest.approx(float(x), rel=1e-11)
    assert outermost.liapunov == pytest.approx(float(energy), rel=1e-11)


def check_spectrum() -> None:
    """Eigenvalues from the depth are those from alpha where alpha tells, and keep their digits where it does not."""
    material = pl.catalogue.material("one-shape")
    for shape in equilibria_at(100.0, 0.1):
        deep, plain = pl.spectrum(shape), pl.spectrum(pl.equilibrium(material, 100.0, shape.alpha))
        assert np.all(np.abs(deep.eigenvalues - plain.eigenvalues) <= deep.errors + plain.errors)
        s = np.linspace(0.0, 1.0, 5)
        # What alpha loses next to the separatrix.
        assert np.abs(deep.kernel(s) - plain.kernel(s)).max() <= 10.0 * EPS * math.exp(math.sqrt(100.0))
    for shape in equilibria_at(500.0, 0.1):
        deep = pl.spectrum(shape)
        assert deep.resolved
        assert deep.agree
        assert np.all(deep.errors <= 64.0 * EPS * 500.0 * np.maximum(1.0, np.abs(deep.eigenvalues)))
        assert np.count_nonzero(deep.eigenvalues > 0.0) == min(deep.unstable, deep.eigenvalues.size)


def check_phase() -> None:
    """A small disturbance next to the separatrix, from the depth as from alpha."""
    material, grid = pl.catalogue.material("one-shape"), pl.Grid(40)
    shape = max(equilibria_at(60.0, 0.1), key=lambda each: each.depth if each.unstable == 0 else -np.inf)
    plain = pl.equilibrium(material, 60.0, shape.alpha)
    mu, natural = shape.curvature(grid.s) + 1e-3 * np.cos(grid.s), 0.1 + 1e-3
    deep, known = (projection(each, mu, natural, grid) for each in (shape, plain))
    assert deep.shift == pytest.approx(known.shift, rel=1e-9)
    # Differences with steps in the depth and in alpha: good for a size.
    assert deep.second_order == pytest.approx(known.second_order, rel=0.05)


@pytest.mark.parametrize("case", cases(), ids=lambda case: case["gamma"])
def test_shapes_of_the_reference(case: dict[str, Any]) -> None:
    check_reference(case)


def test_a_pair_that_doubles_cannot_part() -> None:
    check_fold()


@pytest.mark.parametrize(
    ("gamma", "natural"), [(60.0, -0.3), (300.0, 0.0), (700.0, 2.0), (1e3, -3.0), (1e4, 0.1), (1e4, 250.0), (1e5, 0.0)]
)
def test_shapes_of_large_thrusts(gamma: float, natural: float) -> None:
    check_deep(gamma, natural)
    if natural == 0.0:
        # one straight rod, and two for each of Euler's loads that is exceeded
        assert len(equilibria_at(gamma, 0.0)) == 1 + 2 * math.floor(math.sqrt(gamma) / math.pi + 0.5)


def test_values_deep_in_the_layer() -> None:
    check_values()


def test_spectra_deep_in_the_layer() -> None:
    check_spectrum()


def test_projection_deep_in_the_layer() -> None:
    check_phase()


def test_both_coordinates_agree() -> None:
    """The search over alpha and that over the depth, on either side of the thrust at which one takes over."""
    below, above = equilibria_at(50.0, 0.4), equilibria_at(50.0 * (1.0 + 4.0 * EPS), 0.4)
    assert [shape.depth for shape in below] == [None] * len(below)
    assert [shape.alpha for shape in above] == pytest.approx([shape.alpha for shape in below], rel=1e-12)
    assert [shape.unstable for shape in above] == [shape.unstable for shape in below]


def test_they_are_a_tuple() -> None:
    found = equilibria_at(5.0, 0.1)
    assert isinstance(found, tuple)
    for again in (copy.copy(found), pickle.loads(pickle.dumps(found))):  # noqa: S301
        assert (len(again), again.complete, again.sentence) == (3, True, found.sentence)


def test_what_cannot_be_done_is_refused() -> None:
    with pytest.raises(ArgumentError, match="gamma"):
        equilibria_at(1.1e5, 0.0)
