"""Claim: all roots of a piecewise analytic function are found, double ones included, or the result says what is not."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from plastica.errors import ArgumentError
from plastica.numerics.roots import Root, Roots, roots, roots_of_rows
from tests.support import EPS

Function = Callable[[np.ndarray], np.ndarray]
SCAN = 20_000


def check_sign_changes(f: Function, found: Roots, lo: float, hi: float) -> None:
    """Every sign change of a fine scan is at a root, and signs follow the crossings."""
    assert found.complete, found.sentence
    x = np.linspace(lo, hi, SCAN)
    sign = np.sign(f(x))
    near = np.array([[root.x - root.error, root.x + root.error] for root in found.points]).reshape(-1, 2)
    near = np.concatenate([near, np.array(found.vanishing).reshape(-1, 2)])
    for i in np.flatnonzero(sign[:-1] * sign[1:] < 0.0):
        assert np.any((near[:, 0] <= x[i + 1]) & (near[:, 1] >= x[i])), (x[i], x[i + 1])
    crossings = np.array([root.x for root in found.points if root.kind == "crossing"])
    count = np.searchsorted(crossings, x)
    away = np.ones(x.size, dtype=bool)
    for low, high in near:
        away &= (x < low) | (x > high)
    for low, high in found.vanishing:
        there = (low <= x) & (x <= high)
        assert np.all(np.abs(f(x[there])) <= max(1e-12 * np.abs(f(x)).max(), 1e-270))
        away &= ~there
    away &= sign != 0.0
    kept, parity = sign[away], (-1.0) ** count[away]
    assert np.unique(kept * parity).size <= 1, "the sign does not follow the number of crossings"


def check_roots(f: Function, exact: list[float], **options: Any) -> None:
    """Exactly these simple roots, each within its own error bound and that bound small."""
    found = roots(f, -1.0, 1.0, **options)
    assert found.complete
    assert len(found.points) == len(exact)
    for root, x in zip(found.points, sorted(exact), strict=True):
        assert root.kind == "crossing"
        assert abs(root.x - x) <= root.error + 4.0 * EPS
        assert root.error <= 1e-9


def check_double(shift: float, kind: list[str]) -> None:
    """(x - 0.3)^2 - shift, its terms added up: two roots, one tangency, or none, within 10 eps of the terms."""
    found = roots(lambda x: x * x - 0.6 * x + (0.09 - shift), -1.0, 1.0, size=lambda x: x * x + 0.6 * np.abs(x) + 0.09)
    assert [root.kind for root in found.points] == kind
    for root in found.points:
        assert abs(abs(root.x - 0.3) - np.sqrt(max(shift, 0.0))) <= root.error
        assert root.error <= 1e-7 if root.kind == "tangency" else root.error <= 1e-8


@pytest.mark.parametrize(
    ("shift", "kind"), [(1e-14, ["crossing"] * 2), (0.0, ["tangency"]), (-1e-14, []), (1e-17, ["tangency"])]
)
def test_double_roots(shift: float, kind: list[str]) -> None:
    check_double(shift, kind)


@given(st.lists(st.floats(-0.99, 0.99), min_size=1, max_size=6, unique=True), st.floats(-3.0, 3.0))
@settings(deadline=None, max_examples=60, derandomize=True)
def test_products_with_known_roots(places: list[float], tilt: float) -> None:
    exact = [x for i, x in enumerate(sorted(places)) if i == 0 or x - sorted(places)[i - 1] > 1e-3]
    check_roots(lambda x: np.prod([x - r for r in exact], axis=0) * np.exp(tilt * x), exact)


@given(
    st.lists(st.tuples(st.floats(-2.0, 2.0), st.floats(0.1, 40.0), st.floats(0.0, 6.0)), min_size=1, max_size=4),
    st.floats(-1.0, 1.0),
    st.floats(-0.9, 0.9),
    st.floats(-5.0, 5.0),
)
@settings(deadline=None, max_examples=60, derandomize=True)
def test_every_sign_change_is_accounted_for(
    waves: list[tuple[float, float, float]], level: float, kink: float, steep: float
) -> None:
    def f(x: np.ndarray) -> np.ndarray:
        smooth = sum(size * np.sin(rate * x + phase) for size, rate, phase in waves)
        return np.asarray(smooth + level + steep * np.abs(x - kink) ** 1.5)

    check_sign_changes(f, roots(f, -1.0, 1.0, breaks=[kink]), -1.0, 1.0)


def test_many_roots() -> None:
    found = roots(np.sin, -20.0, 20.0)
    exact = np.pi * np.arange(-6, 7)
    assert found.x.size == 13
    assert np.abs(found.x - exact).max() <= 8.0 * EPS * 20.0
    assert len(roots(lambda x: np.cos(200.0 * x) + x, -3.0, 3.0).points) == 127


def test_roots_of_higher_order_are_one() -> None:
    """Odd ones cross, even ones touch; how far they may be off is said."""
    cubic = roots(lambda x: x**3 - 0.9 * x**2 + 0.27 * x - 0.027, -1.0, 1.0, size=lambda x: (np.abs(x) + 0.3) ** 3)
    quartic = roots(lambda x: x**4, -1.0, 1.0)
    for found, exact, kind in ((cubic, 0.3, "crossing"), (quartic, 0.0, "tangency")):
        (root,) = found.points
        assert (root.kind, found.complete) == (kind, True)
        assert abs(root.x - exact) <= root.error <= 1e-3
    assert quartic.points[0].x == 0.0


def test_kinks_that_touch() -> None:
    (root,) = roots(lambda x: np.abs(x - 0.1), -1.0, 1.0, breaks=[0.1]).points
    assert (root.x, root.kind) == (0.1, "tangency")


def test_roots_at_the_ends_and_at_cuts() -> None:
    found = roots(lambda x: x * (x - 1.0) * (x + 1.0), -1.0, 1.0)
    assert found.x.tolist() == [-1.0, 0.0, 1.0]
    (even,) = roots(lambda x: np.cos(x) - 1.0, 0.0, 1.0, size=lambda x: 1.0 + np.abs(x)).points
    assert (even.x, even.kind) == (0.0, "tangency")


def test_narrow_features() -> None:
    """A layer of relative width 1e-9 at a place that is told; a pair of roots 1e-6 apart."""
    layer = roots(lambda x: np.tanh((x - 0.2) * 1e9) + 0.5, -1.0, 1.0, breaks=[0.2])
    assert layer.x == pytest.approx([0.2 - np.arctanh(0.5) * 1e-9], rel=0.0, abs=1e-15)
    assert np.diff(roots(lambda x: (x - 0.1) * (x - 0.100001), -1.0, 1.0).x) == pytest.approx(1e-6, rel=1e-8)


def test_what_cannot_be_resolved_is_said() -> None:
    jump = roots(lambda x: np.where(x > 0.123, 1.0, -1.0), -1.0, 1.0)
    assert not jump.complete
    assert "0.123" in jump.sentence
    assert not roots(lambda x: np.sin(1.0 / x), -1.0, 1.0, breaks=[0.0]).complete
    assert not roots(lambda x: np.where(np.abs(x) < 0.1, np.nan, x), -1.0, 1.0).complete


def test_what_vanishes_is_said() -> None:
    half = roots(lambda x: np.maximum(x, 0.0), -1.0, 1.0, breaks=[0.0])
    assert (half.points, half.vanishing) == ((), ((-1.0, 0.0),))
    assert "vanishes on [-1, 0]" in half.sentence
    assert roots(np.zeros_like, -1.0, 1.0).vanishing == ((-1.0, 1.0),)


def test_rows_are_single_functions() -> None:
    rates = np.array([1.0, 7.0, 30.0])
    together = roots_of_rows(lambda x, row: np.sin(rates[row] * x + 0.1), -np.ones(3), np.ones(3))
    for rate, found in zip(rates, together, strict=True):
        alone = roots(lambda x, rate=rate: np.sin(rate * x + 0.1), -1.0, 1.0)
        assert found.x.tolist() == alone.x.tolist()


@pytest.mark.parametrize(("lo", "hi"), [(1.0, 1.0), (2.0, 1.0), (np.nan, 1.0), (0.0, np.inf)])
def test_bad_intervals(lo: float, hi: float) -> None:
    with pytest.raises(ArgumentError, match="finite interval"):
        roots(np.sin, lo, hi)


def test_a_root_says_what_it_is() -> None:
    (root,) = roots(lambda x: x - 0.25, 0.0, 1.0).points
    assert isinstance(root, Root)
    assert (root.x, root.kind, root.value) == (0.25, "crossing", 0.0)
    assert 0.0 < root.tolerance <= 64.0 * EPS
