"""Claim: what README, CONTRIBUTING and docs say is so: every block runs, what it shows is what comes, links lead."""

from __future__ import annotations

import ast
import contextlib
import doctest
import importlib
import io
import os
import pkgutil
import re
import shutil
import subprocess
import sys
import tomllib
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

import plastica as pl
from plastica.doors import cli
from plastica.material import catalogue
from plastica.motion import dataset
from plastica.physics import status
from plastica.physics.scales import unit_of
from plastica.study import schema
from tests.patience import PATIENCE
from tests.support import reference, reference_error, solution_of

ROOT = Path(__file__).parent.parent
DOCS = ROOT / "docs"
PAGES = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted(DOCS.glob("*.md"))]

NOT_RUN = {
    "README.md": ("install",),
    "CONTRIBUTING.md": ("install",),
    "accuracy.md": ("bench",),
    "cluster.md": ("cluster",),
}
"""Blocks that only a person runs, by page: the word behind their language."""

UNRUN = {"install", "bench", "cluster"}

LANGUAGES = {
    "python",
    "bash",
    "text",
    "toml",
    "yaml",
    "{toctree}",
    "{automodule}",
    "{autoclass}",
    "{autofunction}",
    "{eval-rst}",
}


@dataclass(frozen=True)
class Block:
    """A fenced block: language, the words behind it, text, and line."""

    language: str
    words: tuple[str, ...]
    text: str
    line: int

    def option(self, name: str) -> str | None:
        return next((word.partition("=")[2] for word in self.words if word.startswith(f"{name}=")), None)


def name_of(page: Path) -> str:
    return page.name


def blocks(page: Path) -> list[Block]:
    text = page.read_text(encoding="utf-8")
    found = re.finditer(r"^```(\S+)([^\n]*)\n(.*?)^```$", text, re.MULTILINE | re.DOTALL)
    return [Block(m[1], tuple(m[2].split()), m[3], text.count("\n", 0, m.start()) + 1) for m in found]


def run_python(block: Block, namespace: dict[str, Any]) -> str:
    said = io.StringIO()
    with contextlib.redirect_stdout(said):
        exec(compile(block.text, f"line {block.line}", "exec"), namespace)  # noqa: S102
    return said.getvalue()


def run_bash(block: Block, folder: Path) -> str:
    path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
    done = subprocess.run(
        ["bash", "-euc", block.text],
        cwd=folder,
        env={**os.environ, "PATH": path, "COLUMNS": "80"},
        capture_output=True,
        text=True,
        timeout=PATIENCE,
        check=False,
    )
    assert done.returncode == int(block.option("exit") or 0), f"line {block.line}: {done.stdout}{done.stderr}"
    assert "Traceback" not in done.stderr
    return done.stdout + done.stderr


def shows(expected: str, printed: str) -> bool:
    """Whether text was printed, white space aside, with `...` for anything."""
    parts = [" ".join(part.split()) for part in expected.split("...")]
    return re.search(".*?".join(re.escape(part) for part in parts), " ".join(printed.split())) is not None


def test_shows_tells_apart() -> None:
    assert shows("a ... c", "x a  b\nc d")
    assert not shows("a ... c", "a b d")
    assert not shows("1.25", "1.26")


@pytest.mark.parametrize("page", PAGES, ids=name_of)
def test_every_block_runs(page: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    shutil.copytree(ROOT / "examples", tmp_path / "examples", ignore=shutil.ignore_patterns("out", "__pycache__"))
    namespace: dict[str, Any] = {"__name__": "docs"}
    printed = ""
    for block in blocks(page):
        assert block.language in LANGUAGES, f"{page.name}:{block.line}: {block.language}"
        if set(block.words) & UNRUN:
            assert set(block.words) <= set(NOT_RUN.get(page.name, ())), f"{page.name}:{block.line}"
        elif block.language == "python":
            printed = run_python(block, namespace)
        elif block.language == "bash":
            printed = run_bash(block, tmp_path)
        elif block.language == "toml":
            tomllib.loads(block.text)
            if file := block.option("file"):
                (tmp_path / file).write_text(block.text, encoding="utf-8")
        elif "output" in block.words:
            assert shows(block.text, printed), f"{page.name}:{block.line} shows\n{block.text}\nbut it is\n{printed}"


def test_blocks_that_are_not_run_are_those_listed() -> None:
    every = ((page.name, word) for page in PAGES for block in blocks(page) for word in block.words)
    marked = {(page, word) for page, word in every if word in UNRUN}
    assert marked == {(page, word) for page, words in NOT_RUN.items() for word in words}


def slug(heading: str) -> str:
    return re.sub(r"[^\w\- ]", "", heading.strip().lower()).replace(" ", "-")


def headings(page: Path) -> list[str]:
    text = re.sub(r"^```.*?^```$", "", page.read_text(encoding="utf-8"), flags=re.MULTILINE | re.DOTALL)
    return re.findall(r"^#+ (.+)$", text, re.MULTILINE)


@pytest.mark.parametrize("page", PAGES, ids=name_of)
def test_links_lead_somewhere(page: Path) -> None:
    text = re.sub(r"^```.*?^```$", "", page.read_text(encoding="utf-8"), flags=re.MULTILINE | re.DOTALL)
    for target in re.findall(r"\]\(([^)\s]+)\)", text):
        file, _, anchor = target.partition("#")
        assert "://" not in target, target
        there = (page.parent / file).resolve() if file else page
        assert there.is_file(), f"{page.name}: {target}"
        if anchor:
            assert anchor in {slug(heading) for heading in headings(there)}, f"{page.name}: {target}"
        if there.suffix in (".png", ".svg"):
            assert there.stat().st_size < 200_000
    for name in re.findall(r"`((?:examples|tests|docs|src|benchmarks)/[\w./-]+)`", text):
        assert (ROOT / name).exists(), f"{page.name}: {name}"


def test_every_page_is_in_the_index() -> None:
    (toctree,) = [block for block in blocks(DOCS / "index.md") if block.language == "{toctree}"]
    listed = [line for line in toctree.text.split() if not line.startswith(":")]
    assert sorted(listed) == sorted(page.stem for page in DOCS.glob("*.md") if page.stem != "index")


def modules() -> list[str]:
    found = pkgutil.walk_packages(pl.__path__, "plastica.")
    return [each.name for each in found if not each.name.endswith("__main__")]


@pytest.mark.parametrize("name", modules())
def test_examples_in_docstrings(name: str) -> None:
    assert doctest.testmod(importlib.import_module(name), optionflags=doctest.ELLIPSIS).failed == 0


# -- pages that list things are complete -----------------------------------------------------------------------


def rows(page: str, heading: str) -> list[list[str]]:
    """The cells of the first table below a heading."""
    text = (DOCS / page).read_text(encoding="utf-8")
    part = re.split(rf"^#+ {re.escape(heading)}$", text, maxsplit=1, flags=re.MULTILINE)[1]
    part = re.split(r"^#+ ", part, maxsplit=1, flags=re.MULTILINE)[0]
    table = re.search(r"(?:^\|.*\n)+", part, re.MULTILINE)
    lines = table[0].splitlines() if table else []
    return [[cell.strip() for cell in re.split(r"(?<!\\)\|", line)[1:-1]] for line in lines[2:]]


def code(cell: str) -> str:
    return re.findall(r"`([^`]+)`", cell)[0]


KEYS: dict[str, type[schema.Section]] = {
    **{f"[{name}]": model for name, model in schema.SECTIONS.items()},
    **{f'program = "{name}"': model for name, model in schema.PROGRAMS.items()},
    "Curvature in pieces": schema.Pieces,
    "Measured curvature": schema.Measured,
    "Times": schema.Spacing,
    "Cross section": schema.CrossSection,
}


def default_words(default: object) -> str:
    """A default as the tables show it: — where leaving the key out means something, none for an empty list."""
    if default is None:
        return "—"
    if default in ([], {}):
        return "none"
    return f"`{str(default).lower() if isinstance(default, bool) else default}`".replace("1e-08", "1e-8")


@pytest.mark.parametrize("heading", KEYS)
def test_every_key_of_a_scenario_is_documented(heading: str) -> None:
    table = {code(row[0]): row[2] for row in rows("scenario.md", heading)}
    fields = {name: field for name, field in KEYS[heading].model_fields.items() if name != "program"}
    assert list(table) == list(fields)
    for name, field in fields.items():
        said = "required" if field.is_required() else default_words(field.default)
        assert table[name] == said, f"{heading} {name}: {table[name]} instead of {said}"


def test_every_variable_is_documented() -> None:
    table = {code(row[0]): row for row in rows("results.md", "Variables")}
    assert list(table) == list(dataset.VARIABLES)
    for name, (dims, kind, words) in dataset.VARIABLES.items():
        assert table[name][1] == ", ".join(dims)
        assert table[name][3] == words
        assert table[name][2] == f"`{'J/K' if kind == 'entropy' else unit_of(kind)}`", name


def test_every_public_name_is_documented() -> None:
    text = (DOCS / "api.md").read_text(encoding="utf-8")
    for name in pl.__all__:
        assert re.search(rf"\b{re.escape(name)}\b", text), name


def test_the_glossary_joins_symbols_and_words() -> None:
    table = rows("glossary.md", "Words and symbols")
    symbols = " ".join(row[1] for row in table)
    every = " ".join(" ".join(row) for row in table)
    for name in (*dataset.VARIABLES, "s", "t", "retardation_time", "temperature", "length", "bending_stiffness"):
        assert f"`{name}`" in every, name
    for symbol in ("mu", "mu_nat", "gamma", "kappa", "Theta", "theta", "f", "D", "V", "A", "B", "w"):
        assert f"`{symbol}`" in symbols, symbol


def test_every_material_is_documented() -> None:
    for name in catalogue.names():
        entry = catalogue.describe(name)
        text = (DOCS / "materials.md").read_text(encoding="utf-8")
        part = re.split(rf"^### {name}$", text, maxsplit=1, flags=re.MULTILINE)[1].split("\n### ")[0]
        for law in (entry.preference, entry.flow, entry.threshold):
            assert f"`{law}`" in part, f"{name}: {law}"
        table = {code(row[0]): row for row in rows("materials.md", name)}
        assert list(table) == [p.name for p in entry.parameters]
        for p in entry.parameters:
            cells = [f"{p.default:g}", f"{p.good[0]:g} to {p.good[1]:g}", f"`{p.dimension}`", p.meaning]
            assert table[p.name][1:] == cells, name


def test_every_status_and_exit_code_is_documented() -> None:
    table = {code(row[0]): row[1] for row in rows("errors.md", "Trouble in the computation")}
    assert table == {name: "yes" if ok else "no" for name, (ok, _) in status._SENTENCES.items()}
    codes = [int(row[0]) for row in rows("errors.md", "Exit codes of the command line")]
    assert codes == [cli.DONE, cli.FAILED, cli.MISTAKE, cli.INTERRUPTED]
    classes = [code(row[0]) for row in rows("errors.md", "In Python")]
    assert sorted([*classes, "PlasticaError"]) == sorted(pl.errors.__all__)


@pytest.mark.parametrize(("nodes", "column", "rtol"), [(12, 3, 1e-8), (16, 2, 1e-6), (24, 3, 1e-8)])
def test_accuracy_is_what_was_measured(nodes: int, column: int, rtol: float) -> None:
    """Largest error over all reference motions, within a factor 3 of the table."""
    table = {int(row[0]): row for row in rows("accuracy.md", "By tolerance and nodes")}
    said = float(table[nodes][column])
    found = max(reference_error(solution_of(case, nodes=nodes, rtol=rtol), case) for case in reference())
    assert said / 3.0 <= found <= 3.0 * said


def test_every_claim_names_a_test_that_exists() -> None:
    table = rows("model.md", "2. What must be true")
    assert [row[0] for row in table] == [str(number) for number in range(1, 10)]
    teeth = "".join(path.read_text(encoding="utf-8") for path in (ROOT / "tests").glob("test_teeth*.py"))
    for number, _, tests in table:
        for name in (named := re.findall(r"`(test_\w+)`", tests)):
            assert (ROOT / "tests" / f"{name}.py").is_file(), name
        planted = f'("{number} ' in teeth or any(f"import {name}" in teeth for name in named)
        assert planted, f"no defect is planted for claim {number}"


def test_references_to_the_design_note_lead_somewhere() -> None:
    """Docstrings cite "design 1.2" and "errata F": the sections of docs/model.md."""
    numbers = {match[1] for h in headings(DOCS / "model.md") if (match := re.match(r"(\d(?:\.\d)?|[A-F])\.? ", h))}
    for path in [*(ROOT / "src").rglob("*.py"), *(ROOT / "tests").glob("test_*.py")]:
        text = path.read_text(encoding="utf-8")
        if path.name == "test_docs.py":
            continue
        for cited in re.findall(r"\bdesign(?: note)?,?(?: section)? (\d(?:\.\d)?)", text):
            assert cited in numbers, f"{path.name} cites design {cited}"
        for cited in re.findall(r"\berrata ([A-F])\b", text):
            assert cited in numbers, f"{path.name} cites errata {cited}"


def test_docs_are_built_without_what_is_not_there() -> None:
    """The configuration of Sphinx is read without Sphinx: its extensions are those that pyproject asks for."""
    config = ast.parse((DOCS / "conf.py").read_text(encoding="utf-8"))
    assigned = [node for node in config.body if isinstance(node, ast.Assign)]
    values = {ast.unparse(node.targets[0]): node.value for node in assigned}
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    known = {each.split(">=")[0].replace("-", "_") for each in project["optional-dependencies"]["docs"]}
    assert ast.literal_eval(values["html_theme"]) in known
    for extension in ast.literal_eval(values["extensions"]):
        assert extension.startswith("sphinx.ext.") or extension in known
