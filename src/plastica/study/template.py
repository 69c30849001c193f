"""The commented scenario that `plastica new` writes."""

from __future__ import annotations

from importlib.resources import files
from pathlib import Path
from typing import Literal

from plastica.errors import FileError, unusable

__all__ = ["template", "write_template"]

Units = Literal["SI", "dimensionless"]


def template(units: Units = "SI", *, inertia: bool = False) -> str:
    """Return a scenario with comments that runs as it is; with `inertia` one of a rod that has mass."""
    name = f"{units}-inertia.toml" if inertia else f"{units}.toml"
    return files(__package__).joinpath("templates", name).read_text(encoding="utf-8")


def write_template(path: str | Path, units: Units = "SI", *, inertia: bool = False) -> Path:
    """Write a scenario with comments to a new file.

    Raises
    ------
    FileError
        Where there is such a file already, or none can be made there.
    """
    target = Path(path)
    try:
        with target.open("x", encoding="utf-8") as stream:
            stream.write(template(units, inertia=inertia))
    except FileExistsError:
        raise FileError(
            "exists already, and is left as it is", where=str(target), next_step="Name another file."
        ) from None
    except (OSError, ValueError) as error:
        raise unusable(target, "written", error, next_step="Name a file in a folder that exists.") from None
    return target
