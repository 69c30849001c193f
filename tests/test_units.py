"""Claim: a quantity read from text is the double nearest to its exact SI value, and has the dimension that is due."""

from __future__ import annotations

import re
from fractions import Fraction

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from plastica import units
from plastica.errors import ArgumentError
from tests.patience import calls

EXACT = {
    "250 mm": (0.25, "m"),
    "0.035 N*m**2": (0.035, "N*m**2"),
    "2.4 GPa": (2.4e9, "Pa"),
    "2 days": (172800.0, "s"),
    "1e-3 1/(m*s)": (1e-3, "1/(m*s)"),
    "7 um": (7e-6, "m"),
    "7 µm": (7e-6, "m"),
    "-4.1 N·m²": (-4.1, "N*m**2"),
    "3 N m^2": (3.0, "N*m**2"),
    "1.18 g/cm**3": (1180.0, "kg/m**3"),
    "5 1/(N**2*m**5*s)": (5.0, "1/(N**2*m**5*s)"),
    "0.1 N/mm": (100.0, "N/m"),
    "1 inch": (0.0254, "m"),
    "3 lbf": (float(Fraction(3) * Fraction("0.45359237") * Fraction("9.80665")), "N"),
    "300 K": (300.0, "K"),
    "1 min": (60.0, "s"),
    "1 ms": (1e-3, "s"),
    "4 mm**0.5": (0.12649110640673517, "m**0.5"),
    "90 deg": (1.5707963267948966, "1"),
    "250mm": (0.25, "m"),
}

REFUSED = [
    "", " ", "m", "nan m", "inf m", "-inf m", "1e999 m", "1e99999999999 m", "9**9**9 m", "3 m**9**9", "2 m**99",
    "2 m**(1/3)",
    "20 degC", "3 dB", "3 dBm", "3 °C", "1_000 m", "0x10 m", "3 foo", "3 m)", "3 (m", "3 " + "(" * 90 + "m" + ")" * 90,
    "3 m**", "3 m/", "3 */m", "1 1/m s", "2 3 m", "3 m + 2 m", "3 m; 4 m", "__import__('os') m", "3 __class__", "3 m.x",
    "3 m" * 100, "3 m**1e9", "٣ m", "1e400 m", "3 bit", "3 m**(2", "3 m\x00",
]  # fmt: skip


def check_conversion_is_exact() -> None:
    for text, (value, unit) in EXACT.items():
        assert units.quantity(text, unit, where="length", bare=False) == value, text


def check_wrong_dimension_is_refused() -> None:
    for text, unit in [("3 s", "m"), ("3 N*m", "N*m**2"), ("3 m", "1"), ("3 N", "kg"), ("3 rad", "m")]:
        with pytest.raises(ArgumentError, match="must be a quantity in"):
            units.quantity(text, unit, where="length", bare=True)


def test_conversion_is_exact() -> None:
    check_conversion_is_exact()


def test_wrong_dimension_is_refused() -> None:
    check_wrong_dimension_is_refused()


@pytest.mark.parametrize("text", REFUSED)
def test_anything_else_is_refused_at_once(text: str) -> None:
    units.dimension_of("inch")  # pint is loaded before the count starts

    def refused() -> None:
        with pytest.raises(ArgumentError, match=r"`length` must"):
            units.quantity(text, "m", where="length", bare=False)

    assert calls(refused) < 10_000


@pytest.mark.parametrize("value", [5, 5.0, "5", " -5e0 "])
def test_a_bare_number_is_refused_where_a_unit_is_due(value: str | float) -> None:
    with pytest.raises(ArgumentError, match="must carry a unit such as m"):
        units.quantity(value, "m", where="length", bare=False)
    assert abs(units.quantity(value, "m", where="length", bare=True)) == 5.0
    assert abs(units.quantity(value, "1", where="length", bare=False)) == 5.0


@pytest.mark.parametrize("value", [True, None, [1.0], float("nan"), float("inf"), 10**400, 1j])
def test_other_values_are_refused(value: object) -> None:
    with pytest.raises(ArgumentError, match=r"`length` must be"):
        units.quantity(value, "m", where="length", bare=True)  # type: ignore[arg-type]


def test_the_table_of_the_si_is_equal_to_pints() -> None:
    """Names that are known without pint have exactly the size and dimension that pint gives them."""
    names = [p + u for u in units._PREFIXED for p in units._PREFIXES]
    names += list(units._SECONDS) + [f"{n}s" for n in units._SECONDS if len(n) > 2] + ["K", "rad", "radian"]
    for name in names:
        assert units._named_unit(name) == units._pint_unit(name), name


@pytest.mark.parametrize(
    ("text", "yes"),
    [("3 N", True), ("250mm", True), (" -2e3 m", True), ("5 1/s", True), ("1e3", False), ("5", False), ("3*s", False),
     ("1 + cos(3*s)", False), ("cos(3*s)", False), ("", False), ("2.5e-3", False), ("3 - s", False)],
)  # fmt: skip
def test_quantities_are_told_from_expressions(text: str, yes: bool) -> None:
    assert units.looks_like_quantity(text) is yes


@settings(deadline=None, max_examples=200, derandomize=True)
@given(
    st.floats(1e-9, 1e9),
    st.sampled_from(["m", "N*m**2", "Pa", "s", "1/m", "1/(m*s)", "N", "kg/m**3", "J", "1"]),
)
def test_what_is_written_for_people_reads_back(value: float, unit: str) -> None:
    text = units.format_quantity(value, unit)
    digits = re.match(r"[-+.\de]+", text)
    assert digits is not None
    assert len(re.sub(r"\D", "", digits[0].split("e")[0]).lstrip("0")) <= 4
    back = units.quantity(text, unit, where="value", bare=False)
    assert abs(back - value) <= 5.001e-4 * abs(value)


@settings(deadline=None, max_examples=200, derandomize=True)
@given(st.floats(allow_nan=False, allow_infinity=False))
def test_a_number_in_si_reads_back_to_the_last_bit(value: float) -> None:
    assert units.quantity(f"{value!r} N*m**2", "N*m**2", where="value", bare=False) == value


@pytest.mark.parametrize(
    ("value", "unit", "text"),
    [(0.25, "m", "250 mm"), (0.035, "N*m**2", "35 mN*m**2"), (86400.0, "s", "24 h"), (120.0, "s", "120 s"),
     (0.99999, "m", "1 m"), (0.0, "m", "0 m"), (2.4e9, "Pa", "2.4 GPa"), (4.0, "1/m", "4 1/m"), (0.5, "1", "0.5")],
)  # fmt: skip
def test_quantities_are_written_as_people_write_them(value: float, unit: str, text: str) -> None:
    assert units.format_quantity(value, unit) == text


def test_dimensions_are_written_in_base_units() -> None:
    assert units.dimension_text(units.dimension_of("N*m**2")) == "kg*m**3/s**2"
    assert units.dimension_text(units.dimension_of("1/(m*s)")) == "1/(m*s)"
    assert units.dimension_text(units.dimension_of("1")) == "1"
    assert units.dimension_text(units.dimension_of("m**1.5")) == "m**1.5"
