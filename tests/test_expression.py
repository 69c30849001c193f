"""Claim: a formula is evaluated as written, its derivatives are exact, and no text does anything else."""

from __future__ import annotations

import builtins
import math
import os
import pickle
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import mpmath
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from plastica.errors import ArgumentError
from plastica.material.expression import Breakpoint, Expression, breakpoints, parse
from tests.patience import calls

EPS = float(np.finfo(float).eps)
VALUES = {"k": 0.7, "m1": 1.5, "c": 2.0, "p": 2.5}


def _pos(x: Any) -> Any:
    return x if x > 0 else mpmath.mpf(0)


FORMULAS: dict[str, Callable[[Any], Any]] = {
    "k*m**2/2": lambda m: mpmath.mpf(0.7) * m**2 / 2,
    "k*m**2*(m**2 - m1**2)**2/m1**4": lambda m: mpmath.mpf(0.7) * m**2 * (m**2 - 2.25) ** 2 / mpmath.mpf(1.5) ** 4,
    "c*pos(m)**3": lambda m: 2 * _pos(m) ** 3,
    "c*pos(m)**p": lambda m: 2 * _pos(m) ** mpmath.mpf(2.5),
    "abs(m)**3": lambda m: abs(m) ** 3,
    "exp(-m**2)": lambda m: mpmath.exp(-(m**2)),
    "log(1 + m**2)": lambda m: mpmath.log(1 + m**2),
    "sin(3*m)*cos(m)": lambda m: mpmath.sin(3 * m) * mpmath.cos(m),
    "tan(m/4)": lambda m: mpmath.tan(m / 4),
    "tanh(m)": mpmath.tanh,
    "sinh(m) - m": lambda m: mpmath.sinh(m) - m,
    "cosh(m) - 1": lambda m: mpmath.cosh(m) - 1,
    "sqrt(1 + m**2)": lambda m: mpmath.sqrt(1 + m**2),
    "atan(c*m)": lambda m: mpmath.atan(2 * m),
    "m/(1 + m**2)**2": lambda m: m / (1 + m**2) ** 2,
    "2**m": lambda m: mpmath.mpf(2) ** m,
    "(1 + m**2)**(-1.5)": lambda m: (1 + m**2) ** mpmath.mpf(-1.5),
    "1/3 - pi*m/2": lambda m: mpmath.mpf(1) / 3 - mpmath.pi * m / 2,
    "(2 + cos(m))**(1 + m/5)": lambda m: (2 + mpmath.cos(m)) ** (1 + m / 5),
}
RATIONAL = {"k*m**2/2", "k*m**2*(m**2 - m1**2)**2/m1**4", "c*pos(m)**3", "abs(m)**3", "m/(1 + m**2)**2"}
POINTS = (-2.3, -1.1, -0.4, 0.3, 0.9, 1.7, 2.6)

HOSTILE = [
    "__import__('os').system('touch hacked')", "m.__class__", "(lambda: 1)()", "[m for m in (1,2)]",
    "open('hacked')", "exec('1')", "eval('1')", "m if m else 1", "m and 1", "not m", "m == 1", "m < 1",
    "(m := 1)", "m = 1", "'a'", '"a"', "f'{m}'", "1j*m", "1_000*m", "0x10*m", "0b1", "1e999*m", "9**9**9",
    "exp(exp(exp(exp(9**9))))", "1/0", "log(0)", "0**-1", "m**1000", "m**(9**9)", "(m**64)**64",
    "((((m**60)**60)**60)**60)", "m**m**m**m**m**1e300", "(" * 240 + "m" + ")" * 240, "(" * 90 + "m",
    "-" * 400 + "m", "m" * 501, "m+" * 200 + "m", "", "   ", "m\nm", "m # comment", "m;1", "\u00b5*m",
    "m\u00b2", "q*m", "pos", "pos()", "pos(m,m)", "pos(x=m)", "pos(*m)", "pos(**m)", "foo(m)", "step(m)", "m()",
    "m[0]", "m@m", "m//2", "m%2", "~m", "m^2", "m!", "{m}", "...", "None", "True", "sqrt(-1)", "(-1)**0.5",
    "1e308*10", "nan", "inf", "oo", "zoo", "m/(m-m)", "log(m-m)", "exp(1000)", "2m", "m m", "m**",
    "1e308*m*1e308", "(1e200*m)**2", "pi(m)", "I", "5.real", "(-2)**m", "0**m", "yield m", "import os",
    "print(m)", "globals()", "abs(m)(m)", "exp(3000*log(m))", "\u0000m", "m\u2028",
    "sin(" * 60 + "m" + ")" * 60, "cosh(" * 50 + "m" + ")" * 50, "*".join(f"({i}+m)" for i in range(1, 56)),
    "*".join(f"sin({i}*m)" for i in range(1, 40)),
]  # fmt: skip


def _read(text: str, variable: str = "m", *, allow_step: bool = False) -> Expression:
    return parse(text, variable=variable, parameters=VALUES, allow_step=allow_step, where="preference")


def check_derivatives_are_exact() -> None:
    """Values and the first two derivatives against 50-digit differentiation, within rounding of the terms' scale."""
    with mpmath.workdps(50):
        for text, reference in FORMULAS.items():
            for order in range(3):
                function = _read(text).derivative(order).scalar(VALUES)
                for m in POINTS:
                    exact = mpmath.diff(reference, mpmath.mpf(m), order) if order else reference(mpmath.mpf(m))
                    scale = max(1.0, abs(float(exact)), abs(m) ** 6)
                    assert abs(function(m) - float(exact)) <= 64 * EPS * scale, (text, order, m)


def check_scalar_equals_array() -> None:
    """The float path and the array path agree, to the last bit where only + - * / are used."""
    grid = np.linspace(-3.0, 3.0, 121)
    for text in FORMULAS:
        for order in range(3):
            expression = _read(text).derivative(order)
            for scales in ((1.0, 1.0), (0.25, 3.7)):
                array = expression.vector(VALUES, *scales)(grid)
                one = np.array([expression.scalar(VALUES, *scales)(float(x)) for x in grid])
                tolerance = 0.0 if text in RATIONAL else 16 * EPS * max(1.0, float(np.max(np.abs(array))))
                assert np.max(np.abs(array - one)) <= tolerance, (text, order, scales)


def check_even_laws_are_even_bitwise() -> None:
    m = np.concatenate([np.random.default_rng(1).normal(size=500) * 3.0, [1e-300, 1e5]])
    for text in (
        "k*m**2/2",
        "k*m**2*(m**2 - m1**2)**2/m1**4",
        "k*(1 + (m/m1)**2)",
        "abs(m)**3",
        "cosh(m) - 1",
        "k*m*tanh(m)",
    ):
        for order, sign in ((0, 1.0), (1, -1.0), (2, 1.0)):
            function = _read(text).derivative(order)
            right, left = function.vector(VALUES)(m), function.vector(VALUES)(-m)
            assert np.array_equal(left, sign * right, equal_nan=True), (text, order)
            one = function.scalar(VALUES)
            assert all(one(-float(x)) == sign * one(float(x)) or math.isnan(one(float(x))) for x in m[:50]), (
                text,
                order,
            )


def check_hostile_text_is_refused() -> None:
    _read("m*sin(m)/cosh(m - 1)")  # SymPy is loaded before the count starts

    def refused(text: str) -> None:
        with pytest.raises(ArgumentError, match=r"^`preference` must"):
            _read(text)

    for text in HOSTILE:
        assert calls(lambda text=text: refused(text)) < 50_000, text


def test_derivatives_are_exact() -> None:
    check_derivatives_are_exact()


def test_scalar_equals_array() -> None:
    check_scalar_equals_array()


def test_even_laws_are_even_bitwise() -> None:
    check_even_laws_are_even_bitwise()


def test_hostile_text_is_refused() -> None:
    check_hostile_text_is_refused()


def test_nothing_is_executed(monkeypatch: pytest.MonkeyPatch) -> None:
    def caught(*_args: Any, **_keywords: Any) -> Any:
        raise AssertionError("user text was executed")

    _read("m**2")
    for name in ("eval", "exec", "open"):
        monkeypatch.setattr(builtins, name, caught)
    monkeypatch.setattr(os, "system", caught)
    for text in HOSTILE[:8]:
        with pytest.raises(ArgumentError):
            _read(text)


@dataclass(frozen=True)
class Dual:
    """A formula with its exact value, derivative and a bound of what rounding scales with, at one point."""

    text: str
    value: Any
    slope: Any
    scale: Any


def _leaf(draw: st.DrawFn, m: float) -> Dual:
    if draw(st.booleans()):
        return Dual("m", mpmath.mpf(m), mpmath.mpf(1), mpmath.mpf(2 + abs(m)))
    number = draw(st.sampled_from(["2", "0.3", "k", "7", "1.25"]))
    value = mpmath.mpf(VALUES.get(number, 0.0) or float(number))
    return Dual(number, value, mpmath.mpf(0), 1 + value)


UNARY: dict[str, tuple[Callable[[Any], Any], Callable[[Any], Any]]] = {
    "sin": (mpmath.sin, mpmath.cos),
    "cos": (mpmath.cos, lambda u: -mpmath.sin(u)),
    "tanh": (mpmath.tanh, lambda u: mpmath.sech(u) ** 2),
    "atan": (mpmath.atan, lambda u: 1 / (1 + u * u)),
    "pos": (_pos, lambda u: mpmath.mpf(u > 0)),
    "abs": (abs, mpmath.sign),
}


@st.composite
def duals(draw: st.DrawFn, m: float, depth: int = 4) -> Dual:
    kind = draw(st.sampled_from(["leaf", "sum", "difference", "product", "square", *UNARY])) if depth else "leaf"
    if kind == "leaf":
        return _leaf(draw, m)
    a = draw(duals(m, depth - 1))
    if kind in UNARY:
        f, slope = UNARY[kind]
        return Dual(f"{kind}({a.text})", f(a.value), slope(a.value) * a.slope, (1 + a.scale) ** 2)
    if kind == "square":
        return Dual(f"({a.text})**2", a.value**2, 2 * a.value * a.slope, 4 * a.scale**2)
    b = draw(duals(m, depth - 1))
    if kind == "product":
        return Dual(
            f"({a.text})*({b.text})", a.value * b.value, a.slope * b.value + a.value * b.slope, 4 * a.scale * b.scale
        )
    sign = 1 if kind == "sum" else -1
    text = f"({a.text}){'+' if sign > 0 else '-'}({b.text})"
    return Dual(text, a.value + sign * b.value, a.slope + sign * b.slope, a.scale + b.scale)


@settings(deadline=None, max_examples=120, derandomize=True)
@given(st.data(), st.sampled_from([-1.37, -0.22, 0.41, 1.93]))
def test_random_formulas_have_exact_values_and_slopes(data: st.DataObject, m: float) -> None:
    with mpmath.workdps(40):
        dual = data.draw(duals(m))
        expression = _read(dual.text)
        tolerance = 200 * EPS * float(dual.scale)
        assert abs(expression.scalar(VALUES)(m) - float(dual.value)) <= tolerance
        slope = expression.derivative().scalar(VALUES)
        if abs(slope(m * (1 + 1e-9)) - slope(m * (1 - 1e-9))) <= 1e-6 * float(dual.scale):  # no kink within rounding
            assert abs(slope(m) - float(dual.slope)) <= tolerance


def test_arrays_keep_their_shape_and_nothing_warns() -> None:
    for text in ("2", "k", "m", "exp(m)", "1/m", "log(m)", "m**40", "sqrt(m)", "m**-3", "tan(m)"):
        x = np.array([[0.0, 1.0, -1.0], [1e300, -1e300, np.nan]])
        array = _read(text).vector(VALUES)(x)
        assert array.shape == x.shape
        assert array.dtype == np.float64
        one = _read(text).scalar(VALUES)
        same = np.array([[one(float(u)) for u in row] for row in x])
        finite = np.isfinite(array)
        assert np.array_equal(finite, np.isfinite(same))
        assert np.allclose(array[finite], same[finite], rtol=8 * EPS, atol=0.0)


def test_trouble_is_inf_or_nan() -> None:
    cases = [("exp(m)", 1e3, math.inf), ("1/m", 0.0, math.inf), ("log(m)", 0.0, -math.inf), ("cosh(m)", 1e4, math.inf)]
    for text, m, value in cases:
        assert _read(text).scalar(VALUES)(m) == value
    for text, m in [
        ("log(m)", -1.0),
        ("sqrt(m)", -1.0),
        ("sin(m)", math.inf),
        ("pos(m)", math.nan),
        ("abs(m)", math.nan),
    ]:
        assert math.isnan(_read(text).scalar(VALUES)(m))


def test_piecewise_functions_at_their_breaks() -> None:
    assert _read("pos(m)").scalar({})(0.0) == 0.0
    assert _read("pos(m)").derivative().scalar({})(0.0) == 0.0
    assert _read("abs(m)").derivative().scalar({})(0.0) == 0.0
    step = _read("step(t - 1)", "t", allow_step=True)
    assert [step.scalar({})(t) for t in (0.999, 1.0, 1.001)] == [0.0, 1.0, 1.0]
    assert step.vector({})(np.array([0.999, 1.0, 1.001])).tolist() == [0.0, 1.0, 1.0]
    assert step.derivative().scalar({})(1.0) == 0.0


def test_breaks_are_found() -> None:
    text = "step(t - 1) - 2*step(2*t - 7) + pos(t - 1) + abs(3 - t) + sin(t)*pos(t + k) + step(k)"
    expression = _read(text, "t", allow_step=True)
    expected = (Breakpoint(-0.7, "kink"), Breakpoint(1.0, "jump"), Breakpoint(3.0, "kink"), Breakpoint(3.5, "jump"))
    assert breakpoints(expression, VALUES) == expected
    assert breakpoints(_read("sin(t)", "t"), {}) == ()
    curved = _read("abs(cos(3*t)) + pos(t - 0.25)", "t")
    assert [point.position for point in breakpoints(curved, {})] == [0.25]
    inside = [point.position for point in breakpoints(curved, {}, (0.0, 1.0))]
    assert len(inside) == 2
    assert abs(inside[1] - math.pi / 6) <= 2 * EPS


def test_arguments_of_step_are_linear() -> None:
    for text in ("step(t**2 - 1)", "step(sin(t))", "step(pos(t) - 1)"):
        with pytest.raises(ArgumentError, match="linear in t"):
            _read(text, "t", allow_step=True)


def test_expressions_travel() -> None:
    """An expression and its derivatives survive pickling, for workers of a sweep."""
    for order in (0, 1, 2):
        expression = _read("k*m**2*sin(m)").derivative(order)
        again = pickle.loads(pickle.dumps(expression))  # noqa: S301
        assert again == expression
        assert again.scalar(VALUES)(0.3) == expression.scalar(VALUES)(0.3)


@pytest.mark.parametrize("name", ["m", "pi", "sin", "pos", "step", "lambda", "1a", "a b", "", "_a", "é", "a" * 41])
def test_parameters_have_names_of_their_own(name: str) -> None:
    with pytest.raises(ArgumentError, match=r"^`preference` must"):
        parse("m", variable="m", parameters=[name], where="preference")
