"""Claim: a material is what its text says in every unit system, and each hypothesis on it is judged rightly."""

from __future__ import annotations

import pickle

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from plastica.errors import ArgumentError
from plastica.material import catalogue
from plastica.material.admissibility import Verdict
from plastica.material.material import Law, Material, admissible
from tests.patience import calls

EPS = float(np.finfo(float).eps)
GOOD = {"preference": "m**2/2", "flow": "pos(x)**2", "threshold": "0.1"}

EVEN, ZERO, FLAT = "preference is even", "preference vanishes at 0", "preference has slope 0 at 0"
NOT_NEGATIVE, C2, GROWS = (
    "preference is nowhere negative",
    "preference is twice continuously differentiable",
    "preference grows without bound",
)
THRESHOLD_EVEN, THRESHOLD_C1 = "threshold is even", "threshold is continuously differentiable"
BELOW = "threshold is bounded below by a positive number"
NO_FLOW, FLOW, FLOW_C1 = "flow is 0 for x <= 0", "flow is positive for x > 0", "flow is continuously differentiable"
HYPOTHESES = (EVEN, ZERO, FLAT, NOT_NEGATIVE, C2, GROWS, THRESHOLD_EVEN, THRESHOLD_C1, BELOW, NO_FLOW, FLOW, FLOW_C1)

ADMISSIBLE = {
    "preference": [
        "m**2/2",
        "0.05*m**2*(m**2 - 2.25)**2",
        "m**2*(m - 1)**2*(m + 1)**2",
        "cosh(m) - 1",
        "abs(m)**3",
        "log(1 + m**2)",
        "sqrt(1 + m**2) - 1",
        "exp(m) + exp(-m) - 2",
        "m*tanh(m)",
        "m**2*(1 + 0.5*cos(m))",
        "1 - cos(m) + m**2",
        "1e-6*m**40",
        "m**2*((m**2 - 1)**2 + 1e-6)",
        "pos(m)**3 + pos(-m)**3",
        "1e6*m**2",
    ],
    "threshold": [
        "0.1*(1 + m**2)",
        "0.1*(1 + abs(m)**3)",
        "0.1*cosh(m)",
        "sqrt(1 + m**2)",
        "2 + cos(m)",
        "1 + tanh(m)**2",
        "1 + m**4 - m**2",
        "1e-9",
        "1.01 + m**4 - 2*m**2",
        "1 + abs(m)**1.5",
    ],
    "flow": [
        "pos(x)**3",
        "pos(x)**1.5",
        "exp(pos(x)) - 1 - pos(x)",
        "pos(x)**2/(1 + pos(x))",
        "sinh(pos(x))**2",
        "pos(x)**2*exp(-pos(x))",
        "tanh(pos(x))**2",
        "pos(x)**2 - 0.5*pos(x)**3 + pos(x)**4",
        "1e-12*pos(x)**2",
        "pos(3*x)**2",
        "pos(x)*sinh(pos(x))",
    ],
}

# law -> the hypotheses that fail, and only those
INADMISSIBLE = {
    "preference": {
        "m**3": {EVEN, NOT_NEGATIVE, GROWS},
        "m**2 - m**4": {NOT_NEGATIVE, GROWS},
        "abs(m)": {C2},
        "m**2 + 1": {ZERO},
        "m**2 + m": {EVEN, FLAT, NOT_NEGATIVE},
        "tanh(m)**2": {GROWS},
        "m**2/(1 + m**2)": {GROWS},
        "1 - cos(m)": {GROWS},
        "m**2*((m**2 - 1)**2 - 1e-6)": {NOT_NEGATIVE},
        "-m**2": {NOT_NEGATIVE, GROWS},
        "pos(m)**2": {EVEN, C2, GROWS},
        "abs(m)**1.5": {C2},
        "0": {GROWS},
        "sqrt(m**2)": {FLAT, C2},
        "m**2 + pos(m - 1)**2 + pos(-m - 1)**2": {C2},
        "m**2 + 0.001*m**3": {EVEN, NOT_NEGATIVE, GROWS},
        "m**2*(1 - 2*exp(-m**2))": {NOT_NEGATIVE},
        "-(cosh(m) - 1)": {NOT_NEGATIVE, GROWS},
        "m**2*(0.9 + cos(m))": {NOT_NEGATIVE, GROWS},
        "m**2*cosh(0.001*m) + 1e-6*sin(m)**3": {EVEN},
    },
    "threshold": {
        "0.1 + 0.1*m": {THRESHOLD_EVEN, BELOW},
        "1 + abs(m)": {THRESHOLD_C1},
        "1 - m**2": {BELOW},
        "1/(1 + m**2)": {BELOW},
        "exp(-m**2)": {BELOW},
        "m**2": {BELOW},
        "1 + m**4 - 2*m**2": {BELOW},
        "1 + cos(m)": {BELOW},
        "0.5 + cos(m)": {BELOW},
        "-0.1": {BELOW},
        "0": {BELOW},
        "1 + abs(m - 1) + abs(m + 1)": {THRESHOLD_C1},
        "2 + tanh(m)": {THRESHOLD_EVEN},
    },
    "flow": {
        "pos(x)": {FLOW_C1},
        "x**2": {NO_FLOW},
        "pos(x)**2 - pos(x)**3": {FLOW},
        "pos(x - 1)**2": {FLOW},
        "pos(-x)**2": {NO_FLOW, FLOW},
        "pos(x)**2 + 1e-9": {NO_FLOW},
        "pos(x)**2*(pos(x) - 1)**2": {FLOW},
        "exp(pos(x)) - 1": {FLOW_C1},
        "0": {FLOW},
        "-pos(x)**2": {FLOW},
        "sqrt(pos(x))": {FLOW_C1},
        "pos(x)**2*(pos(x) - 0.777)**2": {FLOW},
        "pos(x)**2*cos(x)": {FLOW},
        "pos(x)**2 + pos(x - 1)": {FLOW_C1},
        "exp(x)": {NO_FLOW},
    },
}


def _with(law: str, text: str) -> Material:
    return Material(**{**GOOD, law: text})


def _failing(verdicts: tuple[Verdict, ...]) -> set[str]:
    return {verdict.name for verdict in verdicts if not verdict.holds}


def _deviates(law: Law, verdict: Verdict) -> bool:
    """Tell whether a verdict's witness shows its failure, by the law's own values."""
    m = verdict.witness
    assert m is not None
    if verdict.name in (EVEN, THRESHOLD_EVEN):
        return law.value_at(m) != law.value_at(-m)
    if verdict.name in (NOT_NEGATIVE, BELOW, FLOW):
        return law.value_at(m) <= 1e-12
    if verdict.name == NO_FLOW:
        return m <= 0.0 and law.value_at(m) != 0.0
    return True


def check_admissible_laws_pass() -> None:
    for law, texts in ADMISSIBLE.items():
        for text in texts:
            assert _failing(_with(law, text).admissibility()) == set(), text


def check_inadmissible_laws_are_caught() -> None:
    """Exactly the violated hypotheses fail, each with a witness that shows it."""
    for law, table in INADMISSIBLE.items():
        for text, expected in table.items():
            material = _with(law, text)
            verdicts = material.admissibility()
            assert _failing(verdicts) == expected, (text, _failing(verdicts))
            for verdict in verdicts:
                assert verdict.holds == (verdict.witness is None)
                assert verdict.margin <= 0.0 if not verdict.holds else verdict.margin == verdict.margin
                if not verdict.holds:
                    assert _deviates(getattr(material.laws(), law), verdict), (text, verdict)


def check_scaling_commutes() -> None:
    """kappa(m)*L**2/EI at m*L, L*T*f(EI*x), Theta/EI: the dimensionless laws of a specimen are those of design 1.1."""
    length, stiffness, time_scale = 0.25, 0.035, 120.0
    for name in catalogue.names():
        plain = catalogue.material(name).laws()
        scaled = catalogue.material(name, length=length, stiffness=stiffness, time=time_scale)
        laws = scaled.laws(length, stiffness, time_scale)
        for law in ("preference", "flow", "threshold"):
            for part in ("value", "slope", "second"):
                for u in (-0.8, 0.3, 1.1):
                    one = getattr(getattr(plain, law), f"{part}_at")(u)
                    other = getattr(getattr(laws, law), f"{part}_at")(u)
                    assert abs(one - other) <= 64 * EPS * max(abs(one), 1e-3), (name, law, part)
        si = scaled.laws()
        assert abs(si.preference.value_at(2.0) * length**2 / stiffness - plain.preference.value_at(2.0 * length)) <= (
            64 * EPS * plain.preference.value_at(2.0 * length)
        )


def test_admissible_laws_pass() -> None:
    check_admissible_laws_pass()


@pytest.mark.paper("2.11", "2.20")
def test_inadmissible_laws_are_caught() -> None:
    check_inadmissible_laws_are_caught()


def test_scaling_commutes() -> None:
    check_scaling_commutes()


@pytest.mark.parametrize("name", catalogue.names())
def test_the_catalogue_is_admissible(name: str) -> None:
    assert admissible(catalogue.material(name))
    assert admissible(catalogue.material(name, length="250 mm", stiffness="0.035 N*m**2", time="2 min"))
    entry = catalogue.describe(name)
    for parameter in entry.parameters:
        low, high = parameter.good
        assert low <= parameter.default <= high
        for value in parameter.good:
            assert admissible(catalogue.material(name, **{parameter.name: value}))
        assert parameter.name in str(entry)
        assert parameter.meaning in str(entry)


@settings(deadline=None, max_examples=60, derandomize=True)
@given(
    st.lists(st.floats(-3.0, 3.0), min_size=1, max_size=3),
    st.floats(0.05, 5.0),
    st.floats(-1.0, 1.0).filter(lambda h: abs(h) > 1e-3),
    st.floats(-2.0, 2.0).filter(lambda c: abs(c) > 1e-3),
    st.integers(2, 4),
)
def test_a_random_family_is_judged_rightly(roots: list[float], k: float, h: float, c: float, power: int) -> None:
    """kappa = k m**2 prod (m**2 + a_i)**2 + d m**2 is >= 0 iff d >= 0; Theta and f have the sign of h and c."""
    product = "*".join(f"(m**2 + ({a!r}))**2" for a in roots)
    shift = k * 1e-3
    for d, holds in ((shift, True), (-shift, not any(a <= 0.0 for a in roots))):
        material = Material(
            f"k*m**2*{product} + d*m**2", f"c*pos(x)**{power}", "h*(1 + m**2)", {"k": k, "d": d, "h": h, "c": c}
        )
        failing = _failing(material.admissibility())
        assert (BELOW in failing) == (h < 0.0)
        assert (FLOW in failing) == (c < 0.0)
        if d > 0.0 or not holds:
            assert (NOT_NEGATIVE in failing) == (not holds)
        assert not failing & {EVEN, ZERO, FLAT, C2, GROWS, THRESHOLD_EVEN, THRESHOLD_C1, NO_FLOW, FLOW_C1}


@settings(deadline=None, max_examples=60, derandomize=True)
@given(st.floats(0.05, 20.0), st.floats(0.01, 100.0))
def test_the_well_is_found(m1: float, w: float) -> None:
    material = Material("w*m**2*(m**2 - m1**2)**2/m1**4", GOOD["flow"], "0.1", {"w": w, "m1": m1})
    assert material.well is not None
    assert abs(material.well - m1) <= 4 * EPS * m1
    assert NOT_NEGATIVE not in _failing(material.admissibility())


def test_scales_of_other_worlds_are_judged_too() -> None:
    """A rod of micrometres has curvatures of 1e6 1/m: the range follows the parameters' units."""
    for length, stiffness in ((2e-6, 1e-18), (50.0, 1e9)):
        for name in catalogue.names():
            material = catalogue.material(name, length=length, stiffness=stiffness, time=1e-3)
            assert _failing(material.admissibility()) == set(), name
        material = catalogue.material("three-shapes", length=length, stiffness=stiffness, time=1e-3)
        assert material.well is not None
        assert abs(material.well - 1.5 / length) <= 8 * EPS * 1.5 / length
    units = {"k": "1 N*m**2", "h": "1 N*m**2", "m0": "1e6 1/m", "c": "1 1/(N**2*m**5*s)"}
    for factor, expected in (("2 + cos(m/m0)", set()), ("1 + cos(m/m0)", {BELOW})):
        assert _failing(Material("k*m**2", "c*pos(x)**2", f"h*({factor})", units).admissibility()) == expected


def test_a_material_without_wells_has_none() -> None:
    for text in ("m**2/2", "m**2*((m**2 - 1)**2 + 1e-3)", "cosh(m) - 1"):
        assert _with("preference", text).well is None


def test_judgements_say_where_they_come_from() -> None:
    by_name = {verdict.name: verdict for verdict in Material(**GOOD).admissibility()}
    assert tuple(by_name) == HYPOTHESES
    assert all("from its formula" in verdict.sentence for verdict in by_name.values())
    assert by_name[BELOW].margin == 0.1
    verdict = {v.name: v for v in _with("threshold", "2 + cos(m)").admissibility(bound=2.0)}[BELOW]
    assert "|m| <= 2" in verdict.sentence
    assert abs(verdict.margin - (2.0 + np.cos(2.0))) <= 1e-12
    assert _failing(_with("threshold", "1/(1 + m**2)").admissibility(bound=5.0)) == set()
    assert "must be such that" in Material(GOOD["preference"], "-pos(x)**2", "0.1").admissibility()[10].sentence
    for bound in (0.0, -1.0, float("nan")):
        with pytest.raises(ArgumentError, match="`bound` must be a positive number"):
            Material(**GOOD).admissibility(bound)


def test_judging_is_little_work() -> None:
    Material(**GOOD).admissibility()
    slow = "+".join(f"(1 - cos({i}*m))/{i}" for i in range(1, 9)) + "+m**2*sqrt(1 + m**2)*tanh(m)**2"
    assert calls(lambda: _with("preference", slow).admissibility()) < 1_000_000


def test_units_are_checked() -> None:
    units = {"k": "0.01 N*m**2", "c": "3 1/(N**2*m**5*s)", "h": "1e-3 N*m**2", "m0": "4 1/m"}
    good = Material("k*m**2/2", "c*pos(x)**2", "h*(1 + (m/m0)**2)", units)
    assert good.has_units
    assert good.values == {"k": 0.01, "c": 3.0, "h": 1e-3, "m0": 4.0}
    for changed, where in [
        ({"k": "0.01 N*m"}, "preference"),
        ({"c": "3 1/s"}, "flow"),
        ({"h": "3 N"}, "threshold"),
        ({"m0": "4 m"}, "threshold"),
    ]:
        with pytest.raises(ArgumentError, match=f"`{where}` must"):
            good.with_parameters(**changed)
    for law, text in [
        ("threshold", "h*exp(m)"),
        ("threshold", "h + m0"),
        ("threshold", "h*2**m"),
        ("flow", "c*sinh(x)**2"),
    ]:
        laws = {"preference": "k*m**2/2", "flow": "c*pos(x)**2", "threshold": "h*(1 + (m/m0)**2)", law: text}
        used = {name: value for name, value in units.items() if any(name in t for t in laws.values())}
        with pytest.raises(ArgumentError, match=f"`{law}` must"):
            Material(**laws, parameters=used)
    # plain numbers leave a law unchecked
    assert Material("k*m**3", "pos(x)**2", "0.1", {"k": 1.0}).has_units is False
    exponent = Material(
        "k*m**2", "c*pos(x)**p", "h", {"k": "1 N*m**2", "c": "1 1/(N**1.5*m**4*s)", "p": 1.5, "h": "1 N*m**2"}
    )
    assert exponent.values["p"] == 1.5


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"preference": 3}, "`preference` must be text"),
        ({"flow": "c*pos(x)**2"}, "`flow` must use known names, which 'c' is not"),
        ({"threshold": "step(m)"}, "`threshold` must be free of step"),
        ({"threshold": "x"}, "`threshold` must use known names"),
        ({"parameters": {"q": 1.0}}, "`parameters` must occur in a law, and 'q' does not"),
        ({"parameters": {"m": 1.0}}, "`parameters` must not have a parameter named 'm'"),
        ({"parameters": {"x": 1.0}}, "`parameters` must not have a parameter named 'x'"),
        ({"parameters": [1.0]}, "`parameters` must be a mapping"),
        ({"threshold": "h", "parameters": {"h": float("nan")}}, "`parameters.h` must be finite"),
        ({"threshold": "h", "parameters": {"h": "0.1"}}, "`parameters.h` must be a number, or text with a unit"),
        ({"threshold": "h", "parameters": {"h": "1 foo"}}, "`parameters.h` must use known units"),
        ({"threshold": "h", "parameters": {"h": True}}, "`parameters.h` must be a number"),
        ({"threshold": "h", "parameters": {"h": None}}, "`parameters.h` must be a number"),
    ],
)
def test_mistakes_are_told_at_construction(arguments: dict[str, object], message: str) -> None:
    with pytest.raises(ArgumentError) as caught:
        Material(**{**GOOD, **arguments})  # type: ignore[arg-type]
    assert message in str(caught.value)


def test_materials_are_values() -> None:
    material = catalogue.material("three-shapes")
    again = pickle.loads(pickle.dumps(material))  # noqa: S301
    assert again == material
    assert hash(again) == hash(material)
    assert Material(**material.to_dict()) == material
    changed = material.with_parameters(m1=2.0)
    assert changed != material
    assert changed.well == 2.0
    assert material.laws() is again.laws()
    law = pickle.loads(pickle.dumps(material.laws().flow))  # noqa: S301
    assert law == material.laws().flow
    assert law.slope_at(0.3) == material.laws().flow.slope_at(0.3)
    given = {"h": 0.1}
    kept = Material("m**2", "pos(x)**2", "h", given)
    given["h"] = 7.0
    assert kept.values["h"] == 0.1
    with pytest.raises(ArgumentError, match="'q' is not"):
        material.with_parameters(q=1.0)


def test_the_catalogue_names_what_it_has() -> None:
    assert len(catalogue.names()) >= 6
    for call, message in [
        (lambda: catalogue.material("one-shap"), 'Did you mean "one-shape"?'),
        (lambda: catalogue.describe("nothing at all"), "Known: one-shape"),
        (lambda: catalogue.material("one-shape", q=1.0), "Known: k, c, h"),
        (lambda: catalogue.material("one-shape", length=1.0), "`stiffness` must be positive, and given together"),
        (lambda: catalogue.material("one-shape", h="1 N*m**2"), "`parameters.h` must be a number"),
        (
            lambda: catalogue.material("one-shape", length=1, stiffness=1, time=1, h="1 m"),
            "`parameters.h` must be a quantity in N*m**2",
        ),
    ]:
        with pytest.raises(ArgumentError) as caught:
            call()
        assert message in str(caught.value)
    material = catalogue.material("one-shape", length="0.5 m", stiffness="2 N*m**2", time="10 s", h="0.3 N*m**2", k=0.5)
    assert material.values["h"] == 0.3
    assert material.values["k"] == 1.0
    assert material.source is not None
    assert "Rajagopal" in material.source
