"""The versions on which the bits of a sweep depend."""

from __future__ import annotations

from importlib.metadata import PackageNotFoundError, version

import numpy as np

from plastica._version import __version__

__all__ = ["NOT_THERE", "versions"]

NOT_THERE = "none"
"""The version of what is not installed."""


def versions(library: str) -> dict[str, str]:
    """Return the versions here of what computes: plastica, NumPy, SciPy, and the compiler where there is one.

    Parameters
    ----------
    library : str
        "numpy" or "numba".

    Returns
    -------
    dict of str
        `NOT_THERE` for a compiler that is not installed.
    """
    import scipy

    found = {"plastica": __version__, "numpy": np.__version__, "scipy": scipy.__version__}
    if library == "numba":
        try:
            found["numba"] = version("numba")
        except PackageNotFoundError:
            found["numba"] = NOT_THERE
    return found
