"""Claim: whatever a scenario file holds, the answer is one clear message and exit code 2, at once; nothing is written.

The corpus is tests/hostile: the first line of each file says what the message must name. What is too large or too
strange for version control is made here.
"""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.commandline import Answer, call, scenario, si_scenario, snapshot, written
from tests.patience import PATIENCE, calls

CORPUS = Path(__file__).parent / "hostile"
FILES = sorted(CORPUS.glob("*.toml"))

WORK = 3_000_000
"""Functions that an answer may call: some 70 000 for a valid file, and up to 1.2 million for what is very long."""


@pytest.fixture(scope="module", autouse=True)
def _loaded(tmp_path_factory: pytest.TempPathFactory) -> None:
    """Import what `check` needs, and pint, which only strange units need."""
    folder = tmp_path_factory.mktemp("valid")
    assert call("check", written(folder, si_scenario())).code == 0
    assert call("check", written(folder, si_scenario(load='thrust = "1 furlong"'))).code == 2


def refusal(command: str, file: Path, folder: Path) -> Answer:
    """The answer to a hostile file, held to what all such answers have in common."""
    before = snapshot(folder, CORPUS)
    arguments = (command, file, "--output", folder / "out") if command == "run" else (command, file)
    answers: list[Answer] = []
    work = calls(lambda: answers.append(call(*arguments, folder=folder)))
    answer = answers[0]
    check_refusal(answer, file)
    assert work < WORK
    assert snapshot(folder, CORPUS) == before
    return answer


def check_refusal(answer: Answer, file: Path) -> None:
    assert answer.code == 2, answer
    assert answer.out == ""
    assert answer.err.startswith("plastica: ")
    assert file.name in answer.err
    assert "Traceback" not in answer.err
    # Names, rules and next steps are cut to a readable length, whatever the file holds.
    assert max(map(len, answer.err.splitlines())) < 1000
    assert answer.err.isprintable() or answer.err.replace("\n", "").isprintable()


@pytest.mark.parametrize("command", ["check", "run"])
@pytest.mark.parametrize("file", FILES, ids=lambda file: file.stem)
def test_corpus(file: Path, command: str, tmp_path: Path) -> None:
    names = file.read_text(encoding="utf-8").splitlines()[0].removeprefix("# names: ")
    answer = refusal(command, file, tmp_path)
    assert names in answer.err.replace(str(file), ""), answer.err


def test_the_corpus_is_large_enough() -> None:
    assert len(FILES) + len(GENERATED) >= 60


# -- files that no repository should hold --------------------------------------------------------------------------


def _bytes(content: bytes) -> Callable[[Path], None]:
    return lambda file: file.write_bytes(content) and None


def _text(content: str) -> Callable[[Path], None]:
    return _bytes(content.encode())


def _sparse(file: Path) -> None:
    with file.open("wb") as stream:
        stream.truncate(100_000_000)


def _loop(file: Path) -> None:
    file.symlink_to(file.name)


def _fifo(file: Path) -> None:
    os.mkfifo(file)


def _no_file(_file: Path) -> None:
    pass


VALID = scenario()
GENERATED: dict[str, tuple[Callable[[Path], None], str]] = {
    "100 MB": (_sparse, "at most 1000000 bytes"),
    "just too large": (_text(VALID + "#" * 1_000_001), "at most 1000000 bytes"),
    "binary": (_bytes(bytes(range(256)) * 40), "NUL"),
    "image": (_bytes(b"\x89PNG\r\n\x1a\n" + bytes(64)), "NUL"),
    "NUL": (_text(VALID.replace("strut", "str\0ut")), "NUL"),
    "UTF-16": (_bytes(VALID.encode("utf-16")), "UTF-16"),
    "UTF-16 without mark": (_bytes(VALID.encode("utf-16-le")), "NUL"),
    "Latin-1": (_bytes(VALID.replace("A strut", "Stäbchen").encode("latin-1")), "line 3"),
    "truncated UTF-8": (_bytes(VALID.encode() + b"# \xe2\x82"), "UTF-8"),
    "empty": (_text(""), "empty"),
    "blank": (_text("\n \n\t\n"), "empty"),
    "deep arrays": (_text(VALID + "[deep]\na = " + "[" * 100_000 + "]" * 100_000), "deep"),
    "deep tables": (_text(VALID + "[deep]\n" + "a = { " * 50_000 + "}" * 50_000), "deep"),
    "deep keys": (_text("[" + ".".join("a" * 400_000) + "]\n"), "parts"),
    "unclosed brackets": (_text("[" * 900_000), "deep"),
    "quotes": (_text('"' * 900_001), "line 1"),
    "unclosed text": (_text('a = """' + "x" * 900_000), "end of document"),
    "many keys": (_text(VALID + "[many]\n" + "".join(f"k{i} = 1\n" for i in range(60_000))), "words"),
    "many entries": (_text(scenario(solve=f"until = 2.0\ntimes = [{'1, ' * 100_000}]")), "words"),
    "rather many entries": (_text(scenario(solve=f"until = 2.0\ntimes = [{'1, ' * 20_000}]")), "solve.times"),
    "many sections": (_text(VALID + "".join(f"[k{i}]\n" for i in range(11_000))), "entries"),
    "long text": (_text(scenario(head=f'title = "{"x" * 500_000}"\n')), "title"),
    "long number": (_text(scenario(grid="nodes = " + "9" * 5_000)), "digits"),
    "long fraction": (_text(scenario(load="thrust = 0." + "9" * 100_000 + "e999999")), "load.thrust"),
    "hexadecimal number": (_text(scenario(grid="nodes = 0x" + "f" * 400_000)), "grid.nodes"),
    "odd key": (_text(VALID + '[output."\\u001b[31m"]\n'), "output"),
    "odd section": (_text(VALID + '["a\\nb"]\n'), "not a known key"),
    "carriage returns": (_text(VALID.replace("\n", "\r")), "TOML"),
    "folder": (lambda file: file.mkdir(), ""),
    "loop": (_loop, ""),
    "dangling link": (lambda file: file.symlink_to("nowhere.toml"), "does not exist"),
    "named pipe": (_fifo, ""),
    "no file": (_no_file, "does not exist"),
}


@pytest.mark.parametrize("command", ["check", "run"])
@pytest.mark.parametrize("name", GENERATED)
def test_made_here(name: str, command: str, tmp_path: Path) -> None:
    make, words = GENERATED[name]
    file = tmp_path / "hostile.toml"
    make(file)
    assert words in refusal(command, file, tmp_path).err


# -- links, folders and permissions --------------------------------------------------------------------------------


def test_a_link_out_of_the_folder_is_not_followed(tmp_path: Path) -> None:
    secret = written(tmp_path, "s,curvature\n" + "".join(f"{i / 10},1.0\n" for i in range(11)), "secret.csv")
    inner = tmp_path / "inner"
    inner.mkdir()
    (inner / "shape.csv").symlink_to(secret)
    file = written(inner, scenario(initial='curvature = { csv = "shape.csv" }'))
    assert "links" in refusal("run", file, tmp_path).err
    (inner / "shape.csv").unlink()
    (inner / "elsewhere").symlink_to(tmp_path)
    file = written(inner, scenario(initial='curvature = { csv = "elsewhere/secret.csv" }'))
    assert "links" in refusal("run", file, tmp_path).err


def test_a_csv_that_is_a_folder_or_too_large(tmp_path: Path) -> None:
    file = written(tmp_path, scenario(initial='curvature = { csv = "shape.csv" }'))
    (tmp_path / "shape.csv").mkdir()
    assert "folder" in refusal("run", file, tmp_path).err
    (tmp_path / "shape.csv").rmdir()
    _sparse(tmp_path / "shape.csv")
    assert "at most 10000000 bytes" in refusal("run", file, tmp_path).err


def test_results_never_replace_a_folder_or_go_into_a_file(tmp_path: Path) -> None:
    file = written(tmp_path, scenario())
    (tmp_path / "taken").write_text("mine")
    before = snapshot(tmp_path)
    for output in ("taken", "taken/inner"):
        answer = call("run", file, "--output", tmp_path / output)
        assert (answer.code, answer.out) == (2, "")
        assert "taken" in answer.err
    assert snapshot(tmp_path) == before
    (tmp_path / "out" / "strut.nc").mkdir(parents=True)
    answer = call("run", file, "--output", tmp_path / "out")
    assert answer.code == 2
    assert "is a folder" in answer.err
    assert list((tmp_path / "out").iterdir()) == [tmp_path / "out" / "strut.nc"]


# -- in processes of their own ----------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["expression-import", "expression-tower-exp", "natural-language"])
def test_in_a_process_of_its_own(name: str, tmp_path: Path) -> None:
    file = CORPUS / f"{name}.toml"
    command = [sys.executable, "-m", "plastica", "run", str(file), "--output", str(tmp_path / "out")]
    done = subprocess.run(command, capture_output=True, text=True, timeout=PATIENCE, cwd=tmp_path, check=False)
    check_refusal(Answer(done.returncode, done.stdout, done.stderr), file)
    assert list(tmp_path.iterdir()) == []


# -- mutations of a valid scenario ------------------------------------------------------------------------------------

ODD = ("nan", "inf", "-1", "0", "true", "[]", "{}", '""', '"3 N"', '"x"', "1e400", "9" * 30, "[[1]]", "1979-05-27", "")
SOURCES = (scenario(), si_scenario())


@settings(deadline=None, max_examples=150, derandomize=True)
@given(
    st.sampled_from(SOURCES),
    st.lists(
        st.tuples(
            st.integers(0, 40), st.sampled_from(("drop", "double", "value", "cut", "insert")), st.sampled_from(ODD)
        ),
        min_size=1,
        max_size=3,
    ),
)
def test_a_mutation_is_understood_or_refused(
    tmp_path_factory: pytest.TempPathFactory, source: str, changes: list[tuple[int, str, str]]
) -> None:
    lines = source.splitlines()
    for place, kind, value in changes:
        at = place % max(len(lines), 1)
        lines = _changed(lines, at, kind, value)
    folder = tmp_path_factory.getbasetemp()
    file = written(folder, "\n".join(lines) + "\n", "mutated.toml")
    answer = call("check", file)
    assert answer.code in (0, 2)
    if answer.code == 2:
        check_refusal(answer, file)


def _changed(lines: list[str], at: int, kind: str, value: str) -> list[str]:
    if not lines or kind == "insert":
        return [*lines[:at], value, *lines[at:]]
    line = lines[at]
    new = {
        "drop": [],
        "double": [line, line],
        "value": [f"{line.partition('=')[0]}= {value}"],
        "cut": [line[: len(line) // 2]],
    }[kind]
    return [*lines[:at], *new, *lines[at + 1 :]]


@settings(deadline=None, max_examples=100, derandomize=True)
@given(st.text(alphabet=st.characters(exclude_categories=("Cs",)), max_size=200))
def test_any_text_is_refused(tmp_path_factory: pytest.TempPathFactory, text: str) -> None:
    file = written(tmp_path_factory.getbasetemp(), text, "any.toml")
    check_refusal(call("check", file), file)
