"""What may stand in the table [sweep] of a scenario file, and in the arguments of `sweep`."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final, Literal

from pydantic import Field

from plastica.study import fields, schema
from plastica.study.problems import Problems
from plastica.study.sweep_axes import read_axes

__all__ = ["OUTPUTS", "SAMPLINGS", "Sweep", "check_table", "is_drawn"]

SAMPLINGS: Final = ("grid", "list", "latin-hypercube", "random", "csv")
"""How members are made of the values swept over."""

OUTPUTS: Final = ("final", "verdict", "limit", "state", "histories")
"""What can be kept of every member."""


MOST_IN_A_CHUNK: Final = 1_000_000
"""Members of one task: all that they keep is in memory at once."""


class Sweep(schema.Section):
    """What to vary, how, and what to keep."""

    over: fields.Anything = Field(default_factory=dict)
    sampling: Literal["grid", "list", "latin-hypercube", "random", "csv"] = "grid"
    members: fields.Whole | None = None
    seed: fields.Whole = 0
    csv: fields.FilePath | None = None
    outputs: fields.Words = Field(default_factory=lambda: ["final", "verdict"])
    times: Any = None
    chunk: fields.Whole | None = None
    library: Literal["numpy", "numba"] = "numpy"


def check_table(value: object, problems: Problems, *, si: bool) -> Sweep | None:
    """Check the table [sweep] as far as that can be done without the scenario; None, and problems, where it is wrong.

    Parameters
    ----------
    value : object
        What stands there.
    problems : Problems
        Takes the mistakes.
    si : bool
        Whether quantities have units.
    """
    made = schema.validate(Sweep, value, ("sweep",), problems, si=si)
    if made is None:
        return None
    _check_over(made, problems, si=si)
    _check_numbers(made, problems)
    for i, name in enumerate(made.outputs):
        if name not in OUTPUTS:
            known = schema.unknown_key(name, OUTPUTS).removeprefix("is not a known key. ")
            problems.add(("sweep", "outputs", i), f"must be one of the outputs, but is {fields.given(name)}. {known}")
    if made.times is not None:
        schema.validate(schema.Times, {"times": made.times}, ("sweep",), problems, si=si)
    elif "histories" in made.outputs:
        problems.add(("sweep", "times"), 'are missing: outputs = ["histories"] needs times at which to look.')
    return made


def _check_over(made: Sweep, problems: Problems, *, si: bool) -> None:
    over, sampling = made.over, made.sampling
    if not isinstance(over, Mapping):
        problems.add(("sweep", "over"), f"must be a table of keys and their values, but is {fields.given(over)}.")
    elif not over and sampling != "csv":
        problems.add(("sweep", "over"), 'must name what is varied. For example: "load.thrust" = [1.0, 2.0].')
    elif over and sampling == "csv":
        problems.add(("sweep", "over"), 'cannot stand beside sampling = "csv", whose columns name what is varied.')
    else:
        read_axes(over, problems, si=si, counted=not is_drawn(sampling))


def is_drawn(sampling: str) -> bool:
    """Whether members are drawn from ranges, as many as are asked for."""
    return sampling in ("latin-hypercube", "random")


def _check_numbers(made: Sweep, problems: Problems) -> None:
    drawn = is_drawn(made.sampling)
    if drawn and made.members is None:
        problems.add(("sweep", "members"), f'is missing: sampling = "{made.sampling}" needs their number.')
    if not drawn and made.members is not None:
        problems.add(("sweep", "members"), f'belongs to drawn members, not to sampling = "{made.sampling}". Remove it.')
    if (made.sampling == "csv") != (made.csv is not None):
        rule = "is missing: it names the file of members." if made.csv is None else 'belongs to sampling = "csv" only.'
        problems.add(("sweep", "csv"), rule)
    for name in ("members", "chunk"):
        number = getattr(made, name)
        if number is not None and number < 1:
            problems.add(("sweep", name), f"must be at least 1, but is {number}.")
    if made.chunk is not None and made.chunk > MOST_IN_A_CHUNK:
        rule = f"must be at most {MOST_IN_A_CHUNK} members, but is {made.chunk}. Leave it out to have it chosen."
        problems.add(("sweep", "chunk"), rule)
    if made.seed < 0:
        problems.add(("sweep", "seed"), f"must not be negative, but is {made.seed}.")
