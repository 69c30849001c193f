"""Claim: no equilibrium hides in a law that varies on a small scale: first pieces follow from the formulas."""

from __future__ import annotations

import math

import numpy as np
import pytest
from benchmarks.completeness import SHAPES, Case, drawn, judged

import plastica as pl
from plastica.equilibria.reach import reach
from plastica.material.discs import enclosed, is_even
from plastica.material.material import Law
from tests.support import EPS

WELL = {"A": 0.006976744186046511, "w": 0.1610273178555029, "m0": 4.0256829463875725}
FAR = {"k": 2.3265670375595646, "p": 1.503945232382771, "z": 4.650429572371512, "h": 0.19525416632646145}


def material(preference: str, threshold: str, parameters: dict[str, float] | None = None) -> pl.Material:
    return pl.Material(preference, "pos(x)**2", threshold, parameters or {})


def check_well() -> None:
    """A well 0.02 wide in a parabola: five limiting equilibria at alpha > 0, two of them 0.0015 apart."""
    law = material("m**2/2+A*(exp(-(m0**2/w)**2)-exp(-((m**2-m0**2)/w)**2))", "4.121129064070283", WELL)
    found = pl.equilibria(law, 15.937296009011641)
    assert found.complete
    right = [point.alpha for point in found.limiting if point.alpha > 0.0]
    assert [round(x, 5) for x in right] == [3.06765, 7.91296, 8.25694, 8.25964, 8.26115]


def check_narrower_well() -> None:
    """A well in the threshold 0.003 wide, in which two limiting equilibria lie, against dense sampling."""
    law = material("m**2/2", "4.1-0.3*exp(-((m**2-16)/0.024)**2)")
    assert judged(Case("Gaussian", 0.0003, law, 15.9))[:3] == (True, True, True)


def check_overflow() -> None:
    """The formula of the preference overflows far out, where it is not needed."""
    found = pl.equilibria(material("k*log(cosh(m/p))*m*tanh(m)", "h*cosh(m/z)", FAR), 26.11026923997844)
    assert found.complete
    assert [round(p.alpha, 5) for p in found.limiting if 10.0 < p.alpha < 11.0] == [10.24613, 10.24862]
    assert reach(26.0, material("log(cosh(m))*m", "cosh(m/5)/5").laws()).alpha < 100.0


def check_drawn(seed: int, count: int) -> None:
    """Laws of the benchmark, against dense sampling."""
    rng = np.random.default_rng(seed)
    answers = [judged(drawn(rng)) for _ in range(count)]
    assert all(answer.right for answer in answers if answer.told)
    assert all(answer.complete for answer in answers)


def check_one_side() -> None:
    """A well on one side only: the laws are not even, though nearly everywhere they are."""
    law = material("m**2/2", "0.5+0.4*exp(-((m-3.01)/0.003)**2)")
    at = [p.alpha for p in pl.equilibria(law, 0.0, alpha=(-5.0, 5.0)).limiting]
    assert at == pytest.approx([-0.5, 0.5])
    deep = material("m**2/2", "0.5+3*exp(-((m-3.01)/0.003)**2)")
    found = pl.equilibria(deep, 0.0)
    assert found.complete
    near = [p.alpha for p in found.limiting if abs(p.alpha) > 1.0]
    edge = 0.003 * math.sqrt(math.log(3.0 / 2.51))
    assert near == pytest.approx([3.01 - edge, 3.01 + edge], abs=1e-5)


def check_reach() -> None:
    """A well far out, between the points at which the laws are compared."""
    law = material("m**2/2", "0.5+60*exp(-((m-50.2)/0.004)**2)")
    assert reach(2.0, law.laws()).natural_curvature > 50.2
    found = pl.equilibria(law, 2.0)
    assert found.complete
    assert sum(50.0 < p.mu_nat < 50.4 for p in found.limiting) == 2


def check_enclosure(law: Law, order: int, ends: np.ndarray) -> None:
    """Values on the interval lie in the range, and values about it in the complex plane in the disc."""
    a, b = ends[:-1], ends[1:]
    found = enclosed(law, order, a, b, 4.0)
    x = a[:, None] + (b - a)[:, None] * np.linspace(0.0, 1.0, 33)
    values = (law.value, law.slope)[order](x)
    size = EPS * 1e3 * (1.0 + np.abs(values).max(axis=1))
    assert np.all(values.min(axis=1) >= found.low - size)
    assert np.all(values.max(axis=1) <= found.high + size)
    # what the discs promise: the polynomial through 20 Chebyshev points is off by no more than the bound of its tail
    known = np.isfinite(found.radius)
    nodes = np.cos((2.0 * np.arange(20) + 1.0) * np.pi / 40.0)
    middle, half = 0.5 * (a + b), 0.5 * (b - a)
    at_nodes = (law.value, law.slope)[order](middle[:, None] + half[:, None] * nodes)
    fitted = np.polynomial.chebyshev.Chebyshev.fit
    for i in np.flatnonzero(known):
        polynomial = fitted(nodes, at_nodes[i], 19, domain=[-1.0, 1.0])
        off = np.abs(polynomial(2.0 * (x[i] - middle[i]) / (b - a)[i]) - values[i]).max()
        assert off <= 1e-15 * found.radius[i] + size[i]
        # at the real points of the disc that are not in the interval too
        outer = middle[i] + half[i] * np.linspace(-4.0, 4.0, 33)
        with np.errstate(all="ignore"):
            beyond = (law.value, law.slope)[order](outer)
        assert np.all(np.abs(beyond - found.centre[i]) <= found.radius[i] * (1.0 + 1e-12) + size[i])


def law_of(text: str) -> Law:
    return material("m**2/2", text).laws().threshold


FORMULAS = [
    *(shape.replace("z", "((m-1)/0.3)") for shape in SHAPES.values()),
    "2+cos(3*m)*sin(m)",
    "2+m*tanh(m)/(1+m**2)",
    "log(2+m**2)*sqrt(1+m**2)",
    "exp(-m**2)*sinh(m)+cosh(m/3)",
    "(2+sin(m))**(1+m**2/9)",
    "log(cosh(m))+1/cosh(m)**3",
    "tan(m/9)+3",
]


@pytest.mark.parametrize("text", FORMULAS)
def test_enclosures(text: str) -> None:
    for order in (0, 1):
        check_enclosure(law_of(text), order, np.linspace(-4.0, 4.0, 81))


def test_enclosures_of_kinked_laws() -> None:
    """Discs are those of the branch on which the interval lies; across a kink there is none."""
    found = enclosed(law_of("1+abs(m)**1.5+pos(m-1)"), 0, np.array([-0.1, 0.5, 1.0]), np.array([0.1, 0.6, 1.1]), 4.0)
    assert np.isfinite(found.radius).tolist() == [False, True, True]
    assert (found.low <= [1.0, 1.0 + 0.5**1.5, 2.0]).all()


def test_a_narrow_well() -> None:
    check_well()
    check_narrower_well()


def test_a_formula_that_overflows_far_out() -> None:
    check_overflow()


def test_drawn_laws() -> None:
    check_drawn(11, 6)


def test_a_well_on_one_side() -> None:
    check_one_side()
    assert is_even(law_of("1+m*tanh(m)"))
    assert not is_even(law_of("1+exp(-(m-1)**2)"))


def test_a_well_far_out() -> None:
    check_reach()


def check_told(law: pl.Material) -> None:
    found = pl.equilibria(law, 5.0)
    assert not found.complete
    assert "Not complete" in found.sentence


@pytest.mark.parametrize(
    "threshold",
    ["1+exp(m**4)/(1+exp(m**4))", "1+pos(exp(-((m-3)/1e-4)**2)-0.5)**2"],
    ids=["nan in the range", "kinks that are not found"],
)
def test_what_cannot_be_shown_is_told(threshold: str) -> None:
    check_told(material("m**2/50", threshold))


@pytest.mark.parametrize("text", ["1/cosh(m)", "1/cosh(m)**2", "tanh(m)**2"])
def test_derivatives_where_the_hyperbolic_cosine_overflows(text: str) -> None:
    law = law_of(f"1+{text}")
    assert law.slope_at(2000.0) == law.second_at(2000.0) == 0.0
    x, exact = 0.7, {"1/cosh(m)": lambda t: -math.tanh(t) / math.cosh(t)}.get(text)
    if exact is not None:
        assert law.slope_at(x) == pytest.approx(exact(x), rel=8.0 * EPS)
