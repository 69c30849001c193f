"""Claim: the page on the paper names every equation in its order, functions that exist, and tests that are about it."""

from __future__ import annotations

import ast
import importlib
import re
from functools import cache
from pathlib import Path

ROOT = Path(__file__).parent.parent
PAGE = (ROOT / "docs" / "paper.md").read_text(encoding="utf-8")
COUNTS = {1: 3, 2: 22, 3: 83, 4: 33}
"""Numbered lines of each section of the typeset paper."""

RESULTS = (
    "Theorem 3.1",
    "Proposition 3.2",
    "Proposition 3.3",
    "Lemma 4.1",
    "Lemma 4.2",
    "Lemma 4.3",
    "Theorem 4.4",
    "Theorem 4.5",
)


def rows(page: str = PAGE) -> list[list[str]]:
    """The cells of every row of the tables of equations."""
    lines = [line for line in page.splitlines() if re.match(r"\| (\d|Theorem|Proposition|Lemma)", line)]
    return [[cell.strip() for cell in re.split(r"(?<!\\)\|", line)[1:-1]] for line in lines]


def numbers(cell: str) -> list[tuple[int, int]]:
    """The equations that a cell names, ranges written out."""
    found = []
    for section, first, _, last in re.findall(r"(\d)\.(\d+)(?:–(\d)\.(\d+))?", re.sub(r"[A-Z]\w+ \d\.\d", "", cell)):
        found += [(int(section), n) for n in range(int(first), int(last or first) + 1)]
    return found


def test_every_equation_is_there_in_its_order() -> None:
    named = [number for row in rows() for number in numbers(row[0])]
    every = [(section, n) for section, count in COUNTS.items() for n in range(1, count + 1)]
    assert set(named) == set(every)
    firsts = [min(found) for row in rows() if (found := numbers(row[0]))]
    sections = [section for section, _ in firsts]
    assert sections == sorted(sections)


def test_every_result_is_there() -> None:
    for name in RESULTS:
        assert any(row[0].startswith(name) for row in rows()), name


def check_functions(page: str) -> None:
    """Every dotted name leads to an object."""
    found = set(re.findall(r"`(plastica\.[\w.]+)`", page))
    assert len(found) > 30
    for name in found:
        parts = name.split(".")
        module = importlib.import_module(".".join(parts[:3]))
        value = module
        for part in parts[3:]:
            fields = getattr(value, "__dataclass_fields__", {})
            assert hasattr(value, part) or part in fields, name
            value = getattr(value, part, value)


def test_every_function_exists() -> None:
    check_functions(PAGE)


@cache
def module_of(name: str) -> dict[str, ast.FunctionDef]:
    """The functions of a module of tests, by their names."""
    text = (ROOT / "tests" / f"{name}.py").read_text(encoding="utf-8")
    return {node.name: node for node in ast.parse(text).body if isinstance(node, ast.FunctionDef)}


def statements(cell: str) -> set[object]:
    """The equations and the results that a text names."""
    return {*numbers(cell), *(name for name in RESULTS if name in cell)}


def named_by(test: ast.FunctionDef) -> set[object]:
    """What a test says that it is about: by its marker, or by a docstring that begins with "Paper"."""
    told = [word for word in [ast.get_docstring(test) or ""] if word.startswith("Paper ")]
    found = statements(told[0].removeprefix("Paper ").partition(":")[0]) if told else set()
    for mark in test.decorator_list:
        if isinstance(mark, ast.Call) and ast.unparse(mark.func) == "pytest.mark.paper":
            found |= {each for word in mark.args for each in statements(ast.literal_eval(word))}
    return found


def check_tests(page: str) -> None:
    """Every test that is named is one, and names the statement in whose row it is; together they name all of it."""
    count = 0
    for row in rows(page):
        stated, told = statements(row[0]), set()
        for module, name in re.findall(r"`(test_\w+)\.(test_\w+)`", row[3]):
            assert name in module_of(module), f"{module}.{name}"
            about = named_by(module_of(module)[name])
            assert about & stated, f"{module}.{name} is not about {row[0]}"
            told |= about
            count += 1
        assert stated <= told, f"{row[0]}: no test is about {stated - told}"
    assert count > 50


def test_every_test_exists() -> None:
    check_tests(PAGE)


def test_every_row_says_by_what_it_is_checked() -> None:
    for row in rows():
        assert len(row) == 4
        assert "`test_" in row[3], row[0]
