"""Claim: the report is one page that loads nothing, escapes everything, hides no failure, and explains itself."""

from __future__ import annotations

import base64
import itertools
import re
from collections.abc import Callable
from dataclasses import replace
from functools import cache
from html.parser import HTMLParser
from io import BytesIO
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

import plastica as pl
from plastica.errors import ArgumentError, FileError
from plastica.motion.history import History
from plastica.motion.status import Status
from plastica.show import report as reports
from plastica.show import words
from plastica.show.sections import SECTIONS
from plastica.show.subject import Subject

SCENARIO = 'title = "</code><script>alert(1)</script>"\n[load]\nthrust = "3 N"  # & so on\n'
VOID = {
    "area",
    "base",
    "br",
    "col",
    "embed",
    "hr",
    "img",
    "input",
    "link",
    "meta",
    "source",
    "track",
    "wbr",
    "path",
    "rect",
}
KEYS = ("verdict", "meaning", "parameters", "admissibility", "pictures", "events", "ledger", "promises", "origin")


def strut(thrust: object = 3.0, flow: str = "c*pos(x)**2", **loads: object) -> pl.Strut:
    material = pl.Material("k*m**2/2", flow, "h", {"k": 1.0, "c": 1.0, "h": 0.1})
    return pl.Strut(material, pl.Load(thrust=thrust, **loads), pl.Grid(nodes=8))  # type: ignore[arg-type]


@cache
def run(name: str) -> pl.Solution:
    """The runs that are reported on."""
    laws = pl.Material(
        "k*m**2/2",
        "c*pos(x)**2",
        "h",
        {"k": "0.035 N*m**2", "c": "4 1/(N**2*m**5*s)", "h": "0.003 N*m**2"},
        name="strip <i>no. 1</i>",
        source="own <b>measurements</b>",
    )
    section = {"shape": "rectangle", "width": "20 mm", "thickness": "1 mm"}
    specimen = pl.Specimen(length="250 mm", youngs_modulus="2.1 GPa", section=section, retardation_time="120 s")
    load = pl.Load(thrust=pl.programs.ramp_hold_release("1.6 N", "10 min", "1 h", "0 s"))
    makers: dict[str, Callable[[], pl.Solution]] = {
        "buckles": lambda: pl.solve(strut(), "0.2", until=40.0, rtol=1e-6),
        "held": lambda: pl.solve(
            pl.Strut(laws, load, pl.Grid(nodes=8), specimen=specimen), "0.4 + s", until="2 h", rtol=1e-6
        ),
        "still": lambda: pl.solve(strut(0.0), 0.0, until=5.0),
        "stopped": lambda: pl.solve(strut(), "0.2", until=100.0, max_steps=30),
        "couple": lambda: pl.solve(strut(1.0, couple=0.2), 0.1, until=5.0, rtol=1e-6),
        "inadmissible": lambda: pl.solve(strut(flow="c*pos(x)"), "0.5", until=2.0, rtol=1e-6),
        "cycles": lambda: pl.solve(strut(pl.programs.cycles(0, 3, 0.2)), "0.5", until=12.0, rtol=1e-4),
    }
    return makers[name]()


@cache
def page(name: str, film_seconds: float = 0.0) -> str:
    return reports.page(run(name), film_seconds=film_seconds)


class Reader(HTMLParser):
    """The tags of a page with their attributes, its text, and whether every tag is closed in order."""

    def __init__(self, text: str) -> None:
        super().__init__(convert_charrefs=True)
        self.tags: list[tuple[str, dict[str, str | None]]] = []
        self.open: list[str] = []
        self.headings: list[int] = []
        self.pieces: list[str] = []
        self.feed(text)
        self.close()
        assert self.open == [], f"left open: {self.open}"

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append((tag, dict(attrs)))
        if re.fullmatch(r"h[1-6]", tag):
            self.headings.append(int(tag[1]))
        if tag not in VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append((tag, dict(attrs)))

    def handle_endtag(self, tag: str) -> None:
        if tag not in VOID:
            assert self.open.pop() == tag, f"</{tag}> closes nothing"

    def handle_data(self, data: str) -> None:
        if not {"style", "title"} & set(self.open):
            self.pieces.append(data)

    @property
    def text(self) -> str:
        """What one reads, with single spaces."""
        return re.sub(r"\s+", " ", " ".join(self.pieces))

    def all(self, tag: str) -> list[dict[str, str | None]]:
        """The attributes of every tag of this name."""
        return [attributes for name, attributes in self.tags if name == tag]


@pytest.mark.parametrize("name", ["buckles", "held", "still", "stopped", "couple", "inadmissible"])
def test_the_page_is_whole(name: str) -> None:
    reader = Reader(page(name))
    assert [each["id"] for each in reader.all("section")] == list(KEYS)
    assert {f"#{key}" for key in KEYS} == {each["href"] for each in reader.all("a")}
    assert reader.all("html") == [{"lang": "en"}]
    assert len(reader.all("title")) == 1
    ids = [attributes["id"] for _, attributes in reader.tags if "id" in attributes]
    assert len(ids) == len(set(ids))
    assert run(name).outcome.headline in reader.text


def check_headings(text: str) -> None:
    """One first heading, and none that skips a rank."""
    ranks = Reader(text).headings
    assert ranks[0] == 1
    assert ranks.count(1) == 1
    assert all(b <= a + 1 for a, b in itertools.pairwise(ranks))


@pytest.mark.parametrize("name", ["buckles", "held", "inadmissible"])
def test_headings_and_tables_are_in_order(name: str) -> None:
    check_headings(page(name))
    assert all(each.get("scope") in ("row", "col") for each in Reader(page(name)).all("th"))


# -- nothing is loaded ----------------------------------------------------------------------------------------


def check_nothing_is_loaded(text: str) -> None:
    """No script, no address outside the page, neither in attributes nor in styles, and a policy that forbids it."""
    reader = Reader(text)
    names = {name for name, _ in reader.tags}
    assert not names & {"script", "link", "iframe", "object", "embed", "base", "form", "video", "audio"}
    for tag, attributes in reader.tags:
        for key, value in attributes.items():
            assert not key.startswith("on"), (tag, key)
            if key in ("src", "srcset", "href", "data", "poster", "action"):
                assert str(value).startswith(("data:image/", "#")), (tag, key, str(value)[:40])
    (styles,) = re.findall(r"<style>(.*?)</style>", text, flags=re.S)
    assert "url(" not in styles
    assert "@import" not in styles
    policy = [each.get("content", "") for each in reader.all("meta") if each.get("http-equiv")]
    assert policy == ["default-src 'none'; img-src data:; style-src 'unsafe-inline'"]


def test_the_page_loads_nothing() -> None:
    check_nothing_is_loaded(page("buckles", 0.3))
    check_nothing_is_loaded(page("held"))


def test_drawings_hold_no_scripts_and_refer_to_nothing_outside() -> None:
    drawings = [str(each["src"]) for each in Reader(page("held")).all("img")]
    assert len(drawings) == 5
    for each in drawings:
        kind, data = each.split(";base64,")
        assert kind == "data:image/svg+xml"
        drawing = base64.b64decode(data).decode("utf-8")
        assert "<script" not in drawing
        assert all(
            link.startswith(("#", "data:image/png")) for link in re.findall(r'(?:xlink:)?href="([^"]*)"', drawing)
        )


def test_the_film_is_inside_and_rests_for_those_who_want_no_motion() -> None:
    reader = Reader(page("buckles", 0.3))
    (still,) = reader.all("source")
    assert still["media"] == "(prefers-reduced-motion: reduce)"
    moving = next(each for each in reader.all("img") if str(each["src"]).startswith("data:image/gif"))
    for source, kind, frames in ((moving["src"], "GIF", 4), (still["srcset"], "PNG", 1)):
        with Image.open(BytesIO(base64.b64decode(str(source).split(",")[1]))) as picture:
            assert picture.format == kind
            assert getattr(picture, "n_frames", 1) == frames
            assert picture.size == (int(str(moving["width"])), int(str(moving["height"])))


def test_without_film_there_is_none() -> None:
    assert "data:image/gif" not in page("buckles")


# -- text from outside ----------------------------------------------------------------------------------------


def check_text_is_escaped(make: Callable[[pl.Solution], str]) -> None:
    """What a scenario says appears letter for letter, and makes no tag."""
    attack = '<script>alert(1)</script><img src=x onerror="alert(2)"> & "quotes"'
    solution = run("held").with_provenance(
        title=attack, description=attack, scenario=SCENARIO, file="<b>x</b>.toml", strange="<u>odd</u>"
    )
    solution = replace(solution, notes=(attack,), initial="s<0 & <em>1</em>")
    text = make(solution)
    reader = Reader(text)
    assert not {name for name, _ in reader.tags} & {"script", "b", "u", "i", "em"}
    assert not any("onerror" in attributes for _, attributes in reader.tags)
    plain = "".join(reader.pieces)
    assert plain.count(attack) == 3
    assert SCENARIO in plain
    for each in ("strip <i>no. 1</i>", "own <b>measurements</b>", "<b>x</b>.toml", "<u>odd</u>", "s<0 & <em>1</em>"):
        assert each in plain


def test_text_from_outside_is_escaped() -> None:
    check_text_is_escaped(lambda solution: reports.page(solution, film_seconds=0.0))


# -- what it says ---------------------------------------------------------------------------------------------


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
    many = len(run("cycles").events)
    assert many > 100
    assert f"… and {many - 100} more." in Reader(page("cycles")).text


def test_origin_names_version_solver_and_literature() -> None:
    text = Reader(page("buckles")).text
    for each in (pl.__version__, "LSODA", "Rajagopal and C. Rodriguez", "Python"):
        assert each in text
    assert "Hairer" not in text


# -- manners --------------------------------------------------------------------------------------------------


def test_the_same_result_gives_the_same_page() -> None:
    assert reports.page(run("held"), film_seconds=0.2) == reports.page(run("held"), film_seconds=0.2)


def test_the_file_appears_whole(tmp_path: Path) -> None:
    path = pl.report(run("buckles"), tmp_path / "run.html", film_seconds=0.2)
    assert path == tmp_path / "run.html"
    assert [each.name for each in tmp_path.iterdir()] == ["run.html"]
    assert path.read_text(encoding="utf-8") == page("buckles", 0.2)
    assert path.stat().st_size < 3_000_000


def test_impossible_reports_are_refused(tmp_path: Path) -> None:
    solution = run("buckles")
    with pytest.raises(ArgumentError, match=r"`path` must end in \.html"):
        pl.report(solution, tmp_path / "run.pdf")
    with pytest.raises(ArgumentError, match="`solution` must be a Solution"):
        pl.report(None, tmp_path / "run.html")  # type: ignore[arg-type]
    for wrong in (-1.0, 61.0, float("nan"), "8"):
        with pytest.raises(ArgumentError, match="`film_seconds` must be"):
            pl.report(solution, tmp_path / "run.html", film_seconds=wrong)  # type: ignore[arg-type]
    with pytest.raises(FileError):
        pl.report(solution, tmp_path / "nowhere" / "run.html", film_seconds=0.0)
    assert list(tmp_path.iterdir()) == []


def test_a_report_solves_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    solution = run("buckles")

    def refuse(*args: object, **options: object) -> None:
        raise AssertionError("a report must not solve anything")

    monkeypatch.setattr("plastica.motion.solve.integrate", refuse)
    monkeypatch.setattr("plastica.motion.integrate.integrate", refuse)
    for name in ("LSODA", "DOP853", "Radau", "BDF", "solve_ivp"):
        monkeypatch.setattr(f"scipy.integrate.{name}", refuse)
    assert "Buckles" in reports.page(solution, film_seconds=0.2)


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
