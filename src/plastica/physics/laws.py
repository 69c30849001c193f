"""The dimensionless laws of a material, for a specimen or for none."""

from __future__ import annotations

from plastica.errors import ArgumentError
from plastica.material.material import Laws, Material
from plastica.physics.scales import Specimen

__all__ = ["laws_of"]


def laws_of(material: Material, specimen: Specimen | None) -> Laws:
    """Return the dimensionless laws of a specimen's material; without a specimen they are dimensionless as written.

    Parameters
    ----------
    material : Material
        The three laws.
    specimen : Specimen or None
        What the material is made into.

    Returns
    -------
    Laws

    Raises
    ------
    ArgumentError
        Where parameters carry units and there is no specimen to measure them by.
    """
    if specimen is not None:
        scales = specimen.scales
        return material.laws(scales.length, scales.stiffness, scales.time)
    if material.has_units:
        raise ArgumentError(
            "must be plain numbers where there is no specimen",
            where="parameters",
            value=dict(material.parameters),
            next_step="Give the model a pl.Specimen, or write the parameters without units.",
        )
    return material.laws()
