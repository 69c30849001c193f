"""Claim: the report explains itself, says what the result says, and hides no failure."""

from __future__ import annotations

import io
import re
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from rich.console import Console

import plastica as pl
from plastica.doors import numbers, tables
from plastica.motion.history import History
from plastica.physics.status import Status
from plastica.show import report as reports
from plastica.show import words
from plastica.show.sections import SECTIONS
from plastica.show.subject import Subject

from .reported import Reader, page, run


def check_pictures_have_words(text: str) -> None:
    """Every picture has an alternative text with numbers, and a caption."""
    reader = Reader(text)
    pictures = reader.all("img")
    assert pictures
    for each in pictures:
        assert len(str(each.get("alt", ""))) > 60
        assert re.search(r"\d", str(each["alt"]))
    assert len(reader.all("figcaption")) == len(pictures)


@pytest.mark.parametrize("name", ["held", "still", "couple"])
def test_every_picture_has_words(name: str) -> None:
    check_pictures_have_words(page(name))


def test_a_newcomer_finds_every_word_explained() -> None:
    text = Reader(page("held")).text
    for word in ("Natural curvature", "Drive", "Threshold", "Retardation time"):
        assert word in text
    assert "springs back" in text
    assert "multiples of the rod’s own scales" not in text
    assert "multiples of the rod’s own scales" in Reader(page("buckles")).text


def test_a_run_in_si_shows_what_was_given_and_its_groups() -> None:
    text = Reader(page("held")).text
    for each in ("250 mm", "2.1 GPa", "rectangle, thickness 1 mm, width 20 mm", "120 s", "0.003 N·m²"):
        assert each in text, each
    assert "0.4 + s (in 1/m, s in m)" in text
    assert "thrust 1.6 N" in text
    gamma = 1.6 * 0.25**2 / (2.1e9 * 0.02 * 0.001**3 / 12)
    assert f"{gamma:.4g}, or {gamma / (np.pi**2 / 4):.3g} times the Euler load" in text
    assert "**" not in text.replace("k*m**2/2", "").replace("c*pos(x)**2", "")


def test_a_material_of_the_catalogue_is_introduced_and_its_volume_fraction_told() -> None:
    three = pl.Strut(pl.catalogue.material("three-shapes"), pl.Load(transverse=2.0), pl.Grid(nodes=8))
    solution = pl.solve(three, until=5.0, rtol=1e-6)
    text = Reader(reports.page(solution, film_seconds=0.0)).text
    assert pl.catalogue.describe("three-shapes").title in text
    assert f"Volume fraction {float(solution.dataset['volume_fraction'][-1]):.3g}" in text
    assert "Volume fraction" not in page("buckles")


def test_key_numbers_are_those_of_the_result() -> None:
    solution, text = run("buckles"), Reader(page("buckles")).text
    data, outcome = solution.dataset, solution.outcome
    assert f"Free end off the axis {float(data['tip_y'][-1]):.4g} L" in text
    assert f"Permanent set of the free end {outcome.set_deflection:.4g} L" in text
    assert f"Energy lost {solution.ledger.entropy_production:.4g} EI/L" in text
    angle = np.degrees(max(np.abs(data["angle"].values).max(), np.abs(data["tip_angle"].values).max()))
    shown = re.search(r"Largest angle ([\d.]+)°", text)
    assert shown is not None
    assert abs(float(shown[1]) - angle) <= 1e-3 * angle


def check_failure_is_told(text: str) -> None:
    """A run that stopped early says so first, with its sentence and how far it came."""
    reader = Reader(text)
    alarms = [each for _, each in reader.tags if each.get("role") == "alert"]
    assert alarms
    body = reader.text
    assert "The computation stopped early (step limit)." in body
    assert run("stopped").status.sentence.split(";")[-1].strip() in body
    assert body.index("stopped early") < body.index(run("stopped").outcome.headline)
    assert "did what was asked" not in body


def test_a_run_that_stopped_early_says_so_first() -> None:
    check_failure_is_told(page("stopped"))
    assert "stopped early" not in page("buckles")
    assert 'role="alert"' not in page("buckles")


def test_a_run_that_did_not_take_a_step_has_a_page() -> None:
    whole = run("buckles")
    none = replace(
        whole,
        history=History.at_rest(0.0, whole.history.y[0]),
        legs=(np.array([0.0]), np.array([True, True])),
        status=Status(False, "solver_failed", "The solver gave up at the start."),
    )
    assert "The solver gave up at the start." in Reader(reports.page(none)).text


def check_hypotheses(solution: pl.Solution, text: str) -> None:
    """A row for every hypothesis; those that fail are told loudly, with their sentence."""
    reader = Reader(text)
    verdicts = solution.model.material.admissibility()
    for each in verdicts:
        assert each.name[0].upper() + each.name[1:] in reader.text
    failed = [each for each in verdicts if not each.holds]
    assert ("Not for certain" in reader.text) == bool(failed)
    assert f"All {len(verdicts)} hypotheses" in reader.text or failed
    rows = [each for each in reader.all("tr") if each.get("class") == "failed"]
    assert len(rows) == len(failed)
    assert ("open" in reader.all("details")[0]) == bool(failed)


@pytest.mark.parametrize("name", ["buckles", "inadmissible"])
def test_hypotheses_are_told_and_failures_are_loud(name: str) -> None:
    check_hypotheses(run(name), page(name))


def test_notes_stand_beside_the_verdict() -> None:
    solution = replace(run("buckles"), notes=("The flow law was let through although it is not smooth.",))
    text = Reader(reports.page(solution, film_seconds=0.0)).text
    assert "Please note" in text
    assert text.index("let through although") < text.index("A rod of this kind remembers")
    assert "Please note" not in page("buckles")


def check_ledger_is_judged(judge: Callable[[pl.Solution], str]) -> None:
    """A ledger within 100 rtol times the largest energy balances; one beyond does not, and is told with alarm."""
    good = run("buckles")
    assert "The books balance:" in judge(good)
    share = abs(good.ledger.residual) / good.ledger.largest_energy
    assert "The books balance:" in judge(replace(good, rtol=share / 99.0))
    assert "The books do not balance:" in judge(replace(good, rtol=share / 101.0))
    assert "nothing to balance" in judge(run("still"))


def ledger_judgement(solution: pl.Solution) -> str:
    (section,) = [each for make in SECTIONS if make.__name__ == "ledger" and (each := make(Subject(solution, 0.0)))]
    return str(section.data["judgement"])


def test_the_ledger_is_judged_against_its_tolerance() -> None:
    check_ledger_is_judged(ledger_judgement)


def told_in_the_terminal(solution: pl.Solution) -> str:
    """What `plastica run` and `plastica show` print, in the words of the page where it says that nothing is amiss."""
    facts = numbers.result_facts(solution)
    console = Console(file=io.StringIO(), width=200)
    tables.print_result(console, facts, (), None)
    text = console.file.getvalue()
    assert (tables.UNBALANCED in text) != facts["ledger"]["balances"]
    if not facts["ledger"]["balances"]:
        return text
    return "The books balance: nothing to balance"


def test_the_terminal_judges_the_ledger_as_the_page_does() -> None:
    check_ledger_is_judged(told_in_the_terminal)


def test_bounds_are_told_with_what_was_met() -> None:
    assert "stayed within every bound" in Reader(page("buckles")).text
    assert "gives no bound beforehand" in Reader(page("couple")).text
    bound = run("buckles").bounds
    assert words.number(bound.norm) in Reader(page("buckles")).text


def test_events_are_listed_and_long_lists_are_cut() -> None:
    text = Reader(page("buckles")).text
    assert "Yields from the start" in text
    assert "The tip turns past +90 degrees" in text
    assert "None: the rod never yielded" in Reader(page("still")).text
    assert "Largest thrust, in EI/L² γ no thrust" in Reader(page("still")).text
    many = len(run("cycles").events)
    assert many > 100
    assert f"… and {many - 100} more." in Reader(page("cycles")).text


def test_origin_names_version_solver_and_literature() -> None:
    text = Reader(page("buckles")).text
    for each in (pl.__version__, "LSODA", "Rajagopal and C. Rodriguez", "Python"):
        assert each in text
    assert "Hairer" not in text


@pytest.mark.parametrize(
    ("text", "shown"),
    [
        ("by 336.2 uN*m**2", "by 336.2 µN·m²"),
        ("1/(N**2*m**5*s)", "1/(N²·m⁵·s)"),
        ("moved by -0.38 1/m", "moved by −0.38 m⁻¹"),
        ("to 1.154 /L, so", "to 1.154/L, so"),
        ("at 1.4e-05 and 0.0e+00", "at 1.4 × 10⁻⁵ and 0.0"),
        ("visco-elastic, 3-4", "visco-elastic, 3-4"),
    ],
)
def test_units_are_written_as_people_write_them(text: str, shown: str) -> None:
    assert words.pretty(text) == shown


@pytest.mark.parametrize(
    ("value", "shown"),
    [
        (0.0, "0"),
        (1e-9, "1 × 10⁻⁹"),
        (-2.5, "−2.5"),
        (123456.0, "1.235 × 10⁵"),
        (float("inf"), "∞"),
        (float("nan"), "not a number"),
    ],
)
def test_numbers_are_written_as_people_write_them(value: float, shown: str) -> None:
    assert words.number(value) == shown
