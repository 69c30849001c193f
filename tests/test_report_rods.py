"""Claim: the report tells of the general rod its inertia, segments and reactions, and where the theory ends."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

import plastica as pl
from plastica.physics import ledger
from plastica.show import captions, checks, inputs, outlook
from plastica.show import report as reports
from plastica.show.subject import Subject
from plastica.show.words import number

from .pictured import run as strut_run
from .reported import Reader
from .swinging import run
from .test_report import KEYS, check_headings, check_nothing_is_loaded
from .test_report_words import check_pictures_have_words


@cache
def page(name: str) -> str:
    return reports.page(run(name), film_seconds=0.0)


@pytest.mark.parametrize("name", ["rod", "let go", "pieces", "own time"])
def test_the_page_is_whole(name: str) -> None:
    reader = Reader(page(name))
    assert [each["id"] for each in reader.all("section")] == list(KEYS)
    check_headings(page(name))
    check_nothing_is_loaded(page(name))
    check_pictures_have_words(page(name))


def put_in(name: str) -> str:
    """What the section on the input says, in a row."""

    def flat(data: object) -> str:
        if isinstance(data, dict):
            return flat(list(data.values()))
        return " ".join(map(flat, data)) if isinstance(data, (list, tuple)) else str(data)

    return flat(inputs.parameters(Subject(run(name), 0.0)).data)


def check_what_was_put_in() -> None:
    """Inertia, damping, segments and every load are told, dimensionless and as they were given."""
    text = put_in("let go")
    assert "A rod with inertia" in text
    given = ("ρA Mass per length 0.03 kg/m", "ρJ Rotary inertia per length 1 × 10⁻⁹ kg·m", "Initial velocity at rest")
    for each in given:
        assert each in text, each
    model = run("let go").model
    assert isinstance(model, pl.Rod)
    eps = 0.03 * 0.25**4 / (0.035 * 0.02**2)
    assert model.translational_inertia == pytest.approx(eps, rel=1e-12)
    assert f"ε₁ Translational inertia, ρA L⁴/(EI T²) {number(eps)}" in text
    assert "δ Damping, retardation time over T 1" in text
    text = put_in("rod")
    assert "uniform on each of 2 segments" in text
    assert "2, cut at 0.5 L from the clamp" in text
    for each in ("Largest transverse force, in EI/L² 0.5", "Largest weight per length, in EI/L³ 1", "in EI/L 0.3"):
        assert each in text, each
    text = put_in("own time")
    assert "Damping, retardation time over T 0.2" in text
    assert "Initial velocity in motion; the free end at" in text
    assert "A rod without inertia" in put_in("pieces")


def test_what_was_put_in() -> None:
    check_what_was_put_in()
    assert "the scale of time T in which its inertia and damping are given" in Reader(page("own time")).text
    assert "Mass per length ρA 0.03 kg/m" in Reader(page("let go")).text


def test_tension_is_told() -> None:
    assert "Largest tension, in EI/L² 2" in put_in("pulled")
    assert "Largest thrust, in EI/L² 3, or" in put_in("pulled")


def check_where_it_ends() -> None:
    """Where no theory says where a rod ends, the section says why, and draws nothing."""
    for name, reasons in (
        ("own time", ("the model is the rod with inertia", "other loads act (transverse force)")),
        ("rod", ("one for each of 2 segments", "weight per length")),
        ("pieces", ("one for each of 3 segments", "the loads go on changing")),
    ):
        section = outlook.ending(Subject(run(name), 0.0))
        assert section.data["figure"] is None
        assert section.data["cards"] == []
        assert "No limit is predicted" in section.data["headline"]
        for reason in reasons:
            assert reason in section.data["plain"], (name, reason)
    slow = replace(run("own time").model, load=pl.Load(thrust=1.0), translational_inertia=0.0, damping=2.0)
    why = outlook._why_none(Subject(pl.solve(slow, 0.1, until=0.1), 0.0))
    assert "the damping is 2" in why
    assert "the model is the rod with inertia" not in why
    strut = outlook.ending(Subject(pl.solve(replace(slow, damping=1.0), 0.1, until=50.0), 0.0))
    assert "No limit is predicted" not in strut.data["headline"]
    assert strut.data["figure"] is not None
    assert "the rod is pulled" in outlook._why_none(
        Subject(pl.solve(run("pulled").model.with_load(pl.Load(thrust=-1.0, allow_tension=True)), 0.1, until=0.1), 0.0)
    )


def test_where_it_ends() -> None:
    check_where_it_ends()


def check_ledger_has_motion() -> None:
    """The rows of the ledger add up: work less all others is what is left over; motion is one of them for a rod."""
    for name, swings in (("own time", True), ("pieces", False)):
        solution = run(name)
        section = checks.ledger(Subject(solution, 0.0))
        rows = {row[0]: row[2] for row in section.data["rows"]}
        assert ("Change of the kinetic energy" in rows) == swings
        if swings:
            assert rows["Change of the kinetic energy"] == f"{number(solution.ledger.kinetic_energy)} EI/L"
        values = [float(each.split()[0].replace("−", "-")) for each in rows.values() if "×" not in each]
        if len(values) == len(rows):
            left = values[0] - sum(values[1:])
            assert abs(left) <= 5e-4 * sum(map(abs, values))
        assert section.data["balances"]


def test_the_ledger_counts_what_moves() -> None:
    check_ledger_has_motion()
    assert "what is stored, what moves and what is dissipated" in Reader(page("own time")).text


def check_bounds() -> None:
    """The bounds are held against stored and kinetic energy together, and against every segment."""
    solution = run("own time")
    section = checks.promises(Subject(solution, 0.0))
    layout, y = solution.model.layout, solution.history.y
    assert isinstance(solution.model, pl.Rod)
    mu, mu_nat, mu_t = layout.mu(y), layout.natural(y), layout.mu_t(y)
    held = ledger.stored_energy(solution.model, mu, mu_nat) + ledger.kinetic_energy(solution.model, mu, mu_t)
    (row,) = (each for each in section.data["rows"] if each[0].startswith("Stored and kinetic energy"))
    assert row[2] == number(float(held.max()))
    assert section.data["kept"]
    natural = np.abs(layout.natural(y)).max()
    (row,) = (each for each in section.data["rows"] if each[0].startswith("Natural curvature"))
    assert row[2] == number(float(natural))
    assert section.data["growth"] == ""
    assert "the theory does not say of a rod with inertia" in Reader(page("own time")).text


def test_bounds() -> None:
    check_bounds()


def check_pictures_that_are_shown() -> None:
    """Histories where loads change, motion and reactions where there is inertia, and no more."""
    histories, motion = {"force_displacement", "moment_curvature"}, {"free_end", "velocities", "reactions"}
    expected: tuple[tuple[Callable[[], pl.Solution], set[str]], ...] = (
        (lambda: run("rod"), histories | motion),
        (lambda: run("pieces"), histories),
        (lambda: run("own time"), motion),
        (lambda: strut_run("buckles"), set()),
    )
    for make, more in expected:
        names = captions.shown(Subject(make(), 0.0).seen)
        assert set(names) - {"shapes", "natural", "energies", "curvature_map", "loads"} == more
        assert set(captions.captions(Subject(make(), 0.0).seen)) == {"film", *names}


def test_pictures_that_are_shown() -> None:
    check_pictures_that_are_shown()


def test_words_of_segments_and_speed() -> None:
    text = Reader(page("rod")).text
    assert "mean natural curvature moved by" in text
    assert "each of which remembers for itself" in text
    solution = run("own time")
    assert "Largest speed of the free end" in Reader(page("own time")).text
    assert "Largest speed" not in Reader(page("pieces")).text
    for name in ("The free end", "How fast it moves", "What holds it: the clamp"):
        assert name in Reader(page("own time")).text
    assert solution.outcome.headline in Reader(page("own time")).text


def test_a_rod_that_did_not_take_a_step_has_a_page() -> None:
    from plastica.motion.history import History
    from plastica.physics.status import Status

    whole = run("rod")
    none = replace(
        whole,
        history=History.at_rest(0.0, whole.history.y[0]),
        legs=(np.array([0.0]), np.ones((2, 2), dtype=bool)),
        status=Status(False, "solver_failed", "The solver gave up at the start."),
    )
    assert "The solver gave up at the start." in Reader(reports.page(none)).text
