"""Claim: numbers that the documentation tells of accuracy are those that are measured."""

from __future__ import annotations

import re
from functools import cache
from pathlib import Path

import numpy as np

import plastica as pl
from tests.rods import ELASTIC, LOADS, NEVER, model

DOCS = Path(__file__).parent.parent / "docs"


def told(page: str) -> str:
    return (DOCS / page).read_text(encoding="utf-8")


def number(cell: str) -> float:
    """Read "−2.3·10⁻³" or "0.154"."""
    plain = cell.strip().replace("−", "-").translate(str.maketrans("⁰¹²³⁴⁵⁶⁷⁸⁹⁻", "0123456789-"))
    return float(plain.replace("·10", "e"))


@cache
def ended(segments: int) -> tuple[float, float, float]:
    """Place of the free end and stored energy of the strut of the table, at its end."""
    material = pl.Material("m**2/2", "pos(x)**2", "h", {"h": 0.1})
    grid = pl.Grid(nodes=16 if segments < 4 else 6)
    strut = pl.Strut(material, pl.Load(thrust=3.0), grid, natural_segments=segments)
    last = pl.solve(strut, 0.1, until=40.0).dataset.isel(t=-1)
    return float(last.tip_x), float(last.tip_y), float(last.stored_energy)


def check_table_of_segments(text: str) -> None:
    """Errors of 1, 2 and 4 segments along, across and in energy, beside 32, are those of the table, beside 64."""
    rows = [line.split("|")[1:-1] for line in text.splitlines() if re.match(r"\| (1|2|4) \|", line)]
    rows = [row for row in rows if len(row) == 5 and "10" in "".join(row)]
    assert [int(row[0]) for row in rows] == [1, 2, 4]
    exact = np.array(ended(32))
    for row in rows:
        found = np.array(ended(int(row[0]))) - exact
        # 32 segments are themselves off by 1/64 of what 4 are.
        slack = np.array([2e-4, 2e-6, 2e-4])
        for known, cell, more in zip(found, (row[1], row[2], row[4]), slack, strict=True):
            assert abs(known - number(cell)) <= 0.02 * abs(number(cell)) + more, (row, known)


def test_the_table_of_segments() -> None:
    check_table_of_segments(told("rod.md"))


def check_energy(text: str) -> None:
    """The energy of elastic rods, from starts of any size, keeps within what the page says."""
    sentence = re.search(r"by less than ([0-9.]+) `rtol` times the largest energy met", text)
    assert sentence is not None
    for seed in (0, 1, 2):
        rng = np.random.default_rng(seed)
        size, wave, natural = rng.uniform(0.1, 2.5), rng.uniform(0.5, 4.0), rng.uniform(-1.0, 1.0)
        rod = model(LOADS["constant"], nodes=4, material=NEVER, inertia=ELASTIC)
        sol = pl.solve(rod, f"{size}*cos({wave}*s)", natural, until=30.0, rtol=1e-4)
        energy = sol.dataset.liapunov.to_numpy()
        assert np.abs(energy - energy[0]).max() <= float(sentence[1]) * 1e-4 * sol.ledger.largest_energy


def test_the_energy_of_elastic_rods() -> None:
    check_energy(told("accuracy.md"))
