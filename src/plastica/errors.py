"""The one family of user errors: where it is, what is wrong, the value given, and the next step."""

from __future__ import annotations

__all__ = ["ArgumentError", "FileError", "InadmissibleError", "PlasticaError", "ScenarioError"]

_NOT_GIVEN = object()
_LONGEST_VALUE = 120


def shown(value: object) -> str:
    """Show a value in a message: its repr, cut to a readable length."""
    text = repr(value)
    return text if len(text) <= _LONGEST_VALUE else f"{text[:_LONGEST_VALUE]}… ({len(text)} characters)"


class PlasticaError(Exception):
    """A mistake in what the user gave. The message says all there is to know to mend it.

    Attributes
    ----------
    where : str
        The argument, key or file at fault.
    rule : str
        What must hold there, as the end of the sentence "`where` ...".
    next_step : str
        What to do about it.
    """

    def __init__(self, rule: str, *, where: str = "", value: object = _NOT_GIVEN, next_step: str = "") -> None:
        self.where, self.rule, self.next_step = where, rule, next_step
        sentence = f"`{where}` {rule}" if where else rule
        if value is not _NOT_GIVEN:
            sentence += f", but is {shown(value)}"
        super().__init__(f"{sentence}. {next_step}".strip() if next_step else f"{sentence}.")


class ArgumentError(PlasticaError, ValueError):
    """An argument of a public function that has a value outside what is allowed."""


class InadmissibleError(PlasticaError, ValueError):
    """A material that violates a hypothesis of the theory; the message holds the witness."""


class FileError(PlasticaError, OSError):
    """A file that cannot be read or written: missing, damaged, too large, of another kind or version."""

    def __str__(self) -> str:
        return str(self.args[0])


class ScenarioError(PlasticaError, ValueError):
    """Every mistake found in one scenario file, reported at once.

    Attributes
    ----------
    problems : tuple of str
        One message each, with line, key, value and what is allowed.
    """

    def __init__(self, file: str, problems: tuple[str, ...]) -> None:
        self.problems = problems
        count = "1 mistake" if len(problems) == 1 else f"{len(problems)} mistakes"
        super().__init__(f"{file}: {count}\n" + "\n".join(f"  {problem}" for problem in problems))

    def __str__(self) -> str:
        return str(self.args[0]).removesuffix(".")
