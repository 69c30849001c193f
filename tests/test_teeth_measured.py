"""Claim: the checks of measured shapes catch the defects planted for them."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from plastica.study import centreline, smoothing
from tests import test_measured
from tests.defects import Patch, replacing
from tests.test_teeth import CAUGHT

CHECKS: dict[str, Callable[[Path], None]] = {
    "more points": lambda folder: test_measured.check_more_points_never_hurt(folder, "x, y", 8e-5, 2e-2, 30, 300),
    "more curvatures": lambda folder: test_measured.check_more_points_never_hurt(
        folder, "s, curvature", 0.05, 1.5e-2, 30, 300
    ),
    "error and scatter": test_measured.check_error_is_stated,
}


def of_the_noise(factor: float, weight: float) -> Callable[[Any], Any]:
    """Another variance of the noise, and another weight."""

    def made(sound: Any) -> Any:
        def likeliest(*arguments: Any) -> tuple[float, float]:
            found, variance = sound(*arguments)
            return weight * found, factor * variance

        return likeliest

    return made


TEETH: list[tuple[str, str, Callable[[Patch], None]]] = [
    ("more points", "nearly no smoothing", replacing(centreline, "likeliest", of_the_noise(1.0, 1e-6))),
    ("more points", "far too much", replacing(centreline, "likeliest", of_the_noise(1.0, 1e8))),
    ("more curvatures", "nearly no smoothing", replacing(smoothing, "likeliest", of_the_noise(1.0, 1e-6))),
    ("error and scatter", "too large an error", replacing(centreline, "likeliest", of_the_noise(100.0, 1.0))),
]


@pytest.mark.parametrize("claim", CHECKS)
def test_passes_without_a_defect(claim: str, tmp_path: Path) -> None:
    CHECKS[claim](tmp_path)


@pytest.mark.parametrize(("claim", "defect", "spoil"), TEETH, ids=[f"{claim}-{defect}" for claim, defect, _ in TEETH])
def test_catches(
    claim: str, defect: str, spoil: Callable[[Patch], None], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    spoil(monkeypatch)
    with pytest.raises(CAUGHT):
        CHECKS[claim](tmp_path)


def test_every_check_has_a_defect() -> None:
    assert {claim for claim, _, _ in TEETH} == set(CHECKS)
