"""Claim: no test depends on the speed of the machine: waits have one net for all, work is counted, nothing is timed."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest
from hypothesis import HealthCheck, settings

from tests.patience import calls

TESTS = Path(__file__).parent
TIMING = {"perf_counter", "process_time", "thread_time", "monotonic", "perf_counter_ns", "process_time_ns", "sleep"}
"""Functions of `time` that only `tests/patience.py` may use."""

STRANGERS = {"active_count", "Timer"}
"""Functions of `threading` whose answer depends on threads of others, or on when they come."""


def speed(text: str) -> Iterator[str]:
    """What in the text of a test depends on the speed of a machine."""
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name):
            if (node.value.id, node.attr) in {("time", name) for name in TIMING}:
                yield f"line {node.lineno}: time.{node.attr}"
            if (node.value.id, node.attr) in {("threading", name) for name in STRANGERS}:
                yield f"line {node.lineno}: threading.{node.attr}"
        if isinstance(node, ast.ImportFrom) and node.module == "time":
            yield f"line {node.lineno}: from time import"
        if isinstance(node, ast.Call):
            name = node.func.attr if isinstance(node.func, ast.Attribute) else ""
            given = {word.arg: word.value for word in node.keywords}
            limits = [given[word] for word in ("timeout", "deadline") if word in given]
            limits += node.args[:1] if name in ("wait", "join") else []
            for value in limits:
                if isinstance(value, ast.Constant) and isinstance(value.value, int | float):
                    yield f"line {node.lineno}: a limit of {value.value} s"


def test_no_test_is_timed() -> None:
    files = sorted(set(TESTS.glob("*.py")) - {TESTS / "patience.py"})
    assert len(files) > 100
    assert {f.name: found for f in files if (found := list(speed(f.read_text(encoding="utf-8"))))} == {}


@pytest.mark.parametrize(
    "line",
    [
        "began = time.perf_counter()",
        "time.sleep(2.0)",
        "from time import monotonic",
        "subprocess.run(command, timeout=60)",
        "process.wait(60)",
        "process.wait(timeout=60.0)",
        "settings(deadline=200)",
        "assert threading.active_count() > before",
        "threading.Timer(8.0, hire)",
    ],
)
def test_a_timed_test_is_found(line: str) -> None:
    assert len(list(speed(line))) == 1


def test_random_cases_have_no_time_limit() -> None:
    default = settings()
    assert default.deadline is None
    assert default.derandomize
    assert HealthCheck.too_slow in default.suppress_health_check


def test_work_is_counted_alike_each_time() -> None:
    def work(size: int) -> None:
        for _ in range(size):
            len([])

    counts = [calls(lambda size=size: work(size)) for size in (0, 1000, 1000)]
    assert counts[1] == counts[2]
    assert counts[1] - counts[0] == 1000
