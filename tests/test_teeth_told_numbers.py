"""Claim: the checks of told numbers catch numbers that are not true."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from tests import test_told_numbers
from tests.test_teeth import CAUGHT

CHECKS: dict[str, tuple[str, Callable[[str], None]]] = {
    "table of segments": ("rod.md", test_told_numbers.check_table_of_segments),
    "energy": ("accuracy.md", test_told_numbers.check_energy),
}

TEETH: list[tuple[str, str, Callable[[str], str]]] = [
    ("table of segments", "across taken for along", lambda text: text.replace("| 1 | 0.154 |", "| 1 | −8.9·10⁻³ |")),
    ("table of segments", "a wrong digit", lambda text: text.replace("| 2 | 2.9·10⁻² |", "| 2 | 2.6·10⁻² |")),
    ("energy", "told otherwise", lambda text: text.replace("less than 0.7 `rtol`", "less than 7e-4 `rtol`")),
    ("energy", "a bound too small", lambda text: text.replace("less than 0.7 `rtol`", "less than 0.0001 `rtol`")),
]


@pytest.mark.parametrize(("claim", "defect", "spoil"), TEETH, ids=[f"{claim}-{defect}" for claim, defect, _ in TEETH])
def test_catches(claim: str, defect: str, spoil: Callable[[str], str]) -> None:
    page, check = CHECKS[claim]
    text = test_told_numbers.told(page)
    assert spoil(text) != text
    with pytest.raises(CAUGHT):
        check(spoil(text))


def test_every_check_has_a_defect() -> None:
    assert {claim for claim, _, _ in TEETH} == set(CHECKS)
