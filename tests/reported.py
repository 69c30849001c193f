"""What the claims about the report share: the runs that are reported on, their pages, and a reader of pages."""

from __future__ import annotations

import re
from collections.abc import Callable
from functools import cache
from html.parser import HTMLParser

import plastica as pl
from plastica.show import report as reports

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
