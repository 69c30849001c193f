"""Claim: the discrete J and J* are exactly adjoint, W B = (W A)^T, and exact for polynomials of the grid's degree."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import plastica as pl
from plastica.errors import ArgumentError
from tests.support import EPS

GRIDS = [
    pl.Grid(2),
    pl.Grid(7),
    pl.Grid(16),
    pl.Grid(64),
    pl.Grid(128),
    pl.Grid(16, (0.0, 0.5, 1.0)),
    pl.Grid(12, (0.0, 0.1, 0.37, 0.9, 1.0)),
]


def check_adjoint(grid: pl.Grid) -> None:
    weighted = grid.w[:, None] * grid.A
    assert np.abs(grid.w[:, None] * grid.B - weighted.T).max() <= 4.0 * EPS * np.abs(weighted).max()


def check_complement(grid: pl.Grid) -> None:
    """B = 1 w^T - A: what is not integrated from the clamp is integrated from the free end."""
    assert np.abs(grid.A + grid.B - grid.w).max() <= 4.0 * EPS


def check_exact(grid: pl.Grid) -> None:
    """A integrates every power below the number of nodes exactly."""
    n = grid.per_element
    for power in {0, 1, n // 2, n - 1}:
        exact = grid.s ** (power + 1) / (power + 1)
        assert np.abs(grid.A @ grid.s**power - exact).max() <= 8.0 * n * EPS


@pytest.mark.parametrize("grid", GRIDS, ids=str)
def test_adjoint(grid: pl.Grid) -> None:
    check_adjoint(grid)


@pytest.mark.parametrize("grid", GRIDS, ids=str)
def test_complement(grid: pl.Grid) -> None:
    check_complement(grid)


@pytest.mark.parametrize("grid", GRIDS, ids=str)
@pytest.mark.paper("2.1, 2.2")
def test_exact_for_polynomials(grid: pl.Grid) -> None:
    check_exact(grid)


@pytest.mark.parametrize("grid", GRIDS, ids=str)
def test_interpolation_and_integration_at_any_place(grid: pl.Grid) -> None:
    s = np.concatenate([np.linspace(0.0, 1.0, 41), grid.s[:3]])
    power = grid.per_element - 1
    assert np.abs(grid.interpolation(s) @ grid.s**power - s**power).max() <= 16.0 * grid.per_element * EPS
    exact = s ** (power + 1) / (power + 1)
    assert np.abs(grid.integration(s) @ grid.s**power - exact).max() <= 8.0 * grid.per_element * EPS
    assert np.array_equal(grid.interpolation(grid.s), np.eye(grid.size))


def test_a_break_belongs_to_the_element_on_its_right() -> None:
    grid = pl.Grid(4, (0.0, 0.5, 1.0))
    values = np.where(grid.s < 0.5, -1.0, 2.0)
    at = grid.interpolation([np.nextafter(0.5, 0.0), 0.5, 1.0]) @ values
    assert np.abs(at - [-1.0, 2.0, 2.0]).max() <= 4.0 * EPS


@given(st.integers(2, 40), st.lists(st.floats(0.02, 0.98), max_size=4, unique_by=lambda x: round(x, 2)))
@settings(deadline=None, max_examples=40, derandomize=True)
def test_any_grid_keeps_the_structure(nodes: int, inner: list[float]) -> None:
    grid = pl.Grid(nodes, (0.0, *sorted(inner), 1.0))
    check_adjoint(grid)
    check_complement(grid)
    assert abs(grid.w.sum() - 1.0) <= 4.0 * EPS
    assert np.all(grid.w > 0.0)
    assert np.all(np.diff(grid.s) > 0.0)


def test_tail_tells_resolved_from_unresolved() -> None:
    fine, coarse = pl.Grid(24), pl.Grid(6)
    assert fine.tail(np.cos(5.0 * fine.s)) <= 1e-12
    assert coarse.tail(np.cos(5.0 * coarse.s)) >= 1e-4


@pytest.mark.parametrize(
    ("arguments", "word"),
    [
        ({"nodes": 1}, "nodes"),
        ({"nodes": 10**9}, "nodes"),
        ({"nodes": 16.0}, "nodes"),
        ({"nodes": True}, "nodes"),
        ({"nodes": "many"}, "nodes"),
        ({"breaks": (0.0, 0.5)}, "breaks"),
        ({"breaks": (0.0, 0.7, 0.5, 1.0)}, "breaks"),
        ({"breaks": (0.0, float("nan"), 1.0)}, "breaks"),
        ({"breaks": "half"}, "breaks"),
        ({"breaks": "01"}, "breaks"),
        ({"breaks": ("0", "1")}, "breaks"),
        ({"nodes": np.array(16.0)}, "nodes"),
        ({"nodes": np.array([16])}, "nodes"),
        ({"breaks": tuple(np.linspace(0.0, 1.0, 5000))}, "breaks"),
        ({"nodes": 256, "breaks": tuple(np.linspace(0.0, 1.0, 100))}, "nodes"),
    ],
)
def test_mistakes(arguments: dict[str, object], word: str) -> None:
    with pytest.raises(ArgumentError, match=f"`{word}` must"):
        pl.Grid(**arguments)  # type: ignore[arg-type]


def test_integers_of_any_kind_are_numbers_of_nodes() -> None:
    for nodes in (np.array(8), np.int32(8)):
        assert pl.Grid(nodes=nodes) == pl.Grid(8)  # type: ignore[arg-type]
        assert type(pl.Grid(nodes=nodes).nodes) is int  # type: ignore[arg-type]
