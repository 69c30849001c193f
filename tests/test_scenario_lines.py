"""Claim: every key of a scenario file is known with the line it stands on."""

from __future__ import annotations

import tomllib

from hypothesis import given, settings
from hypothesis import strategies as st

from plastica.study.tokens import index_lines, tokens


def paths(value: object, path: tuple[str | int, ...] = ()) -> set[tuple[str | int, ...]]:
    """All key paths of a parsed document."""
    inner = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    return {path} - {()} | {each for key, below in inner for each in paths(below, (*path, key))}


def check_lines(text: str, expected: dict[tuple[str | int, ...], int]) -> None:
    """The index knows every key that tomllib finds, and no other, on the lines expected."""
    lines = index_lines(list(tokens(text)))
    assert set(lines) == paths(tomllib.loads(text))
    assert {path: lines[path] for path in expected} == expected


def test_lines_of_keys() -> None:
    text = '''# comment = 1 [x]
a.b."c d" = 1     # dotted
"e" = """two
lines = 3"""
[t.u]
v = [1, [2, "]"], # inner
  { w = 'x', y = 3.5e-2 }, 1979-05-27 07:32:00,
]
\'f\' = { g.h = true, i = [
] }
[[rows]]
k = 1
[rows.more]
l = "\\"="
[[rows]]
k = -inf
'''
    check_lines(
        text,
        {
            ("a", "b", "c d"): 2,
            ("e",): 3,
            ("t", "u", "v"): 6,
            ("t", "u", "v", 1, 1): 6,
            ("t", "u", "v", 2, "y"): 7,
            ("t", "u", "v", 3): 7,
            ("t", "u", "f", "g", "h"): 9,
            ("rows", 0, "more", "l"): 14,
            ("rows", 1, "k"): 16,
        },
    )


KEYS = st.text("abcxyz_-09", min_size=1, max_size=6) | st.just('"a.b = [c]"') | st.just("'#'")
SCALARS = st.sampled_from(("1", "-2.5e3", "true", '"a, ] = #"', "'[['", '"""m\n\nn"""', "'''q\n'''", "0x1f"))
VALUES = st.recursive(
    SCALARS,
    lambda inner: (
        st.lists(inner, max_size=3).map(lambda items: "[\n" + ",\n ".join(items) + "]")
        | st.lists(
            st.tuples(KEYS, SCALARS.filter(lambda text: "\n" not in text)), max_size=3, unique_by=lambda p: p[0]
        ).map(lambda pairs: "{" + ", ".join(f"{key} = {value}" for key, value in pairs) + "}")
    ),
    max_leaves=6,
)


@settings(deadline=None, max_examples=100, derandomize=True)
@given(st.lists(st.tuples(KEYS, VALUES), max_size=6, unique_by=lambda pair: pair[0]))
def test_lines_of_any_document(pairs: list[tuple[str, str]]) -> None:
    text, expected = "", {}
    for key, value in pairs:
        expected[tomllib.loads(f"{key} = 0").popitem()[0],] = text.count("\n") + 1
        text += f"{key} = {value}\n"
    check_lines(text, expected)


def test_texts_that_are_not_closed_cost_no_more_than_others() -> None:
    """A start that is tried in vain would cost the square of the length: hours for a file of this size."""
    for text in ('"\\' * 400_000, '"""\\' * 200_000, "'''" + "x'" * 300_000):
        assert len(list(tokens(text))) <= 2
