"""The one family of user errors: where it is, what is wrong, the value given, and the next step."""

from __future__ import annotations

import errno
import unicodedata
from typing import Final

__all__ = [
    "ArgumentError",
    "FileError",
    "InadmissibleError",
    "PlasticaError",
    "ScenarioError",
    "StorageError",
]

_NOT_GIVEN = object()
_LONGEST_VALUE = 120


_STEERING = frozenset({"Cc", "Cf", "Cs", "Co", "Zl", "Zp"})
"""Categories of the characters that a terminal obeys instead of showing: controls, directions of writing, and alike."""


def safe_text(text: object) -> str:
    """Return text that a terminal only shows: what would steer it is written as an escape; lines stay lines.

    Parameters
    ----------
    text : object
        Anything with words; it may come from a file of somebody else.
    """
    whole = str(text)
    if whole.isprintable():
        return whole
    return "".join(
        each if each == "\n" or unicodedata.category(each) not in _STEERING else _escaped(each) for each in whole
    )


def _escaped(character: str) -> str:
    number = ord(character)
    return f"\\x{number:02x}" if number < 0x100 else f"\\u{number:04x}" if number < 0x10000 else f"\\U{number:08x}"


def one_line(text: object) -> str:
    """Return `safe_text` on one line."""
    return safe_text(text).replace("\n", "\\n")


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
        sentence = f"`{one_line(where)}` {rule}" if where else rule
        if value is not _NOT_GIVEN:
            sentence += f", but is {shown(value)}"
        super().__init__(safe_text(f"{sentence}. {next_step}".strip() if next_step else f"{sentence}."))


class ArgumentError(PlasticaError, ValueError):
    """An argument of a public function that has a value outside what is allowed."""


class InadmissibleError(PlasticaError, ValueError):
    """A material that violates a hypothesis of the theory; the message holds the witness."""


class FileError(PlasticaError, OSError):
    """A file that cannot be read or written: missing, damaged, too large, of another kind or version."""

    def __str__(self) -> str:
        return str(self.args[0])


class StorageError(FileError):
    """A file that the system refuses though its name is right: a full or failing disk, no permission, in use."""


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
        told = "\n".join(f"  {problem}" for problem in problems)
        super().__init__(f"{one_line(file)}: {count}\n{told}")

    def __str__(self) -> str:
        return str(self.args[0]).removesuffix(".")


MISTAKES: Final = frozenset(
    {errno.ENOENT, errno.ENOTDIR, errno.EISDIR, errno.EEXIST, errno.EINVAL, errno.ENAMETOOLONG, errno.ELOOP}
)
"""What the system says where the name is wrong; all else that it refuses is no mistake of the user."""

_FULL = "Make room on the disk, or name a folder on another one."
_CLOSED = "Name a folder that may be written to."
_REMEDIES: Final = {
    errno.ENOSPC: _FULL,
    errno.EDQUOT: _FULL,
    errno.EFBIG: "Name a folder on a disk that takes larger files.",
    errno.EROFS: _CLOSED,
    errno.EACCES: _CLOSED,
    errno.EPERM: _CLOSED,
}


def unusable(path: object, doing: str, error: Exception, *, next_step: str = "") -> FileError:
    """Return the error for a path that the system refuses: a mistake in its name, or trouble with the disk.

    Parameters
    ----------
    path : object
        The file or folder.
    doing : str
        What cannot be done, as the end of "cannot be ...".
    error : Exception
        What the system said.
    next_step : str
        What to do where the name is wrong.

    Returns
    -------
    FileError
        A `StorageError` where the name is not at fault.
    """
    number = getattr(error, "errno", None)
    reason = getattr(error, "strerror", None) or str(error).split("\n")[0]
    named = number in MISTAKES or (doing == "read" and number in (errno.EACCES, errno.EPERM))
    if isinstance(error, OSError) and number is not None and not named:
        return StorageError(f"cannot be {doing}: {reason}", where=str(path), next_step=_REMEDIES.get(number, ""))
    return FileError(f"cannot be {doing}: {reason}", where=str(path), next_step=next_step)
