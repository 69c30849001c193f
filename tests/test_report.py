"""Claim: the report is one page that is whole, loads nothing, escapes everything and can be made again."""

from __future__ import annotations

import base64
import itertools
import re
from collections.abc import Callable
from dataclasses import replace
from io import BytesIO
from pathlib import Path

import pytest
from PIL import Image

import plastica as pl
from plastica.errors import ArgumentError, FileError
from plastica.show import report as reports

from .reported import Reader, page, run

SCENARIO = 'title = "</code><script>alert(1)</script>"\n[load]\nthrust = "3 N"  # & so on\n'
KEYS = (
    "verdict",
    "meaning",
    "parameters",
    "admissibility",
    "pictures",
    "ending",
    "events",
    "ledger",
    "promises",
    "origin",
)


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
    assert len(drawings) == 8
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
    # The verdict lets the rod go to see what it keeps: part of the result, done before there is anything to report.
    assert solution.outcome.headline

    def refuse(*args: object, **options: object) -> None:
        raise AssertionError("a report must not solve anything")

    monkeypatch.setattr("plastica.motion.solve.integrate", refuse)
    monkeypatch.setattr("plastica.motion.integrate.integrate", refuse)
    for name in ("LSODA", "DOP853", "Radau", "BDF", "solve_ivp"):
        monkeypatch.setattr(f"scipy.integrate.{name}", refuse)
    assert "Buckles" in reports.page(solution, film_seconds=0.2)
