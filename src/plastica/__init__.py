"""plastica: slender viscoelastic rods whose natural shape evolves."""

from plastica._version import __version__

__all__ = ["__version__"]
