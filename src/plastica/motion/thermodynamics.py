"""Energy and entropy along the rod and through a motion: the balance e_t = M mu_t, point by point."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import NDArray

from plastica.errors import ArgumentError
from plastica.motion.history import History
from plastica.motion.solution import Solution
from plastica.physics.ledger import entropy_rate, spending
from plastica.physics.model import Model
from plastica.physics.scales import Scales
from plastica.physics.thermodynamics import bending_energy, free_energy, power, preference_energy

if TYPE_CHECKING:
    import xarray

__all__ = ["QUANTITIES", "thermodynamics"]

Array = NDArray[np.float64]

FIELD, SERIES, PIECES = ("t", "s"), ("t",), ("t", "segment")

QUANTITIES: Final[Mapping[str, tuple[tuple[str, ...], str, str]]] = MappingProxyType(
    {
        "internal_energy": (FIELD, "energy density", "internal energy per length"),
        "free_energy": (FIELD, "energy density", "free energy per length"),
        "bending_energy": (FIELD, "energy density", "bending energy per length"),
        "preference_energy": (PIECES, "energy density", "preference energy per length"),
        "entropy": (FIELD, "entropy density", "entropy per length since the start"),
        "power": (FIELD, "power density", "power of the contact couple per length"),
        "entropy_rate": (FIELD, "entropy rate density", "local entropy production rate"),
        "imbalance": (FIELD, "energy density", "what does not balance per length: error of the computation"),
        "total_internal_energy": (SERIES, "energy", "internal energy of the rod"),
        "total_free_energy": (SERIES, "energy", "free energy of the rod"),
        "total_entropy": (SERIES, "entropy", "entropy of the rod since the start"),
        "total_power": (SERIES, "power", "power of the contact couple on the whole rod"),
        "total_entropy_rate": (SERIES, "entropy rate", "total entropy production rate"),
        "viscous_dissipation_rate": (SERIES, "power", "viscous dissipation per time"),
        "natural_dissipation_rate": (SERIES, "power", "dissipation by the natural curvature per time"),
        "viscous_dissipation": (SERIES, "energy", "viscous dissipation since the start"),
        "natural_dissipation": (SERIES, "energy", "dissipation by the natural curvature since the start"),
        "volume_fraction": (PIECES, "ratio", "volume fraction of the product phase"),
    }
)
"""Name -> (dimensions, kind, words); without several segments the dimension `segment` is left out."""

_UNITS: Final[Mapping[str, tuple[str, str]]] = MappingProxyType(
    {
        "energy density": ("J/m", "J/m"),
        "entropy density": ("J/(m*K)", "J/m"),
        "power density": ("W/m", "W/m"),
        "entropy rate density": ("W/(m*K)", "W/m"),
        "energy": ("J", "J"),
        "entropy": ("J/K", "J"),
        "power": ("W", "W"),
        "entropy rate": ("W/K", "W"),
        "ratio": ("1", "1"),
    }
)
"""Kind -> unit with a temperature, and without, where entropies are given times the temperature."""

BLOCK = 4_000_000
"""Values at nodes and times that are integrated at once: some thirty megabytes for each of a handful of fields."""

LARGEST_TABLE = 20_000_000
"""Times by nodes of the largest field that is made."""


def thermodynamics(solution: Solution) -> xarray.Dataset:
    """Compute energies and entropies of a motion, along the rod and in all.

    The internal energy e per length balances the power of the contact couple, e_t = M mu_t, and splits into entropy
    and free energy, e = tau eta + psi, psi = EI/2 (mu - mu_nat)^2 + kappa(mu_nat) (paper, section 2.2). Entropy is
    counted from the first state of the solution::

        e(s, t)       = psi(s, 0) + int_0^t M mu_t
        tau eta(s, t) = int_0^t [ nu EI mu_t^2 + (EI (mu - mu_nat) - kappa'(mu_nat)) mu_nat_t ]

    Parameters
    ----------
    solution : Solution
        A finished motion of a `Strut` or a `Rod`.

    Returns
    -------
    xarray.Dataset
        Over the coordinates of `Solution.dataset`. Over t and s: `internal_energy`, `free_energy`, `bending_energy`,
        `entropy`, `power`, `entropy_rate`, and `imbalance` = e - tau eta - psi. Over t: `total_internal_energy`,
        `total_free_energy`, `total_entropy`, `total_power`, `total_entropy_rate`, and the two dissipations with their
        rates. Over t, and segment if there are several: `preference_energy`, and `volume_fraction` for materials with
        a second preferred shape. Without a temperature, entropies are given times the temperature.

    Raises
    ------
    ArgumentError
        Where no solution is given, or it has too many times by nodes (20 million).

    Notes
    -----
    Both integrals over time are taken by Gauss's rule on every step of the solver, each on its own: `imbalance` is what
    is left of the balance, and is of the size of the time tolerance. The entropy of a cross section may fall; that of
    the rod never does. Checked by test_thermodynamics.
    """
    import xarray

    if not isinstance(solution, Solution):
        raise ArgumentError("must be a pl.Solution", where="solution", value=solution)
    model, scales = solution.model, solution.model.scales
    if solution.t.size * model.grid.size > LARGEST_TABLE:
        raise ArgumentError(
            f"must have at most {LARGEST_TABLE} times by nodes",
            where="solution",
            value=solution.t.size * model.grid.size,
            next_step="Solve with `times`, and give fewer.",
        )
    data: dict[str, Any] = {}
    values = _values(solution)
    for name, (dims, kind, words) in QUANTITIES.items():
        if name in values:
            found = values[name]
            data[name] = (dims[: found.ndim], found * _scale(kind, scales), _label(kind, words, model))
    return xarray.Dataset(data, coords=solution.dataset.coords, attrs=_attributes(solution, values))


def _values(solution: Solution) -> dict[str, Array]:
    """Every quantity, dimensionless."""
    model, layout, t, y = solution.model, solution.model.layout, solution.t, solution.y
    mu, mu_nat, mu_t = layout.mu(y), layout.natural(y), layout.mu_t(y)
    w, ledger = model.grid.w, layout.ledger(y) - layout.ledger(solution.history.y[0])
    first = solution.history.y[0]
    given, produced = _integrals(solution.history, model, t)
    free = free_energy(model, mu, mu_nat)
    internal = free_energy(model, layout.mu(first), layout.natural(first)) + given
    rate, work = entropy_rate(model, t, mu, mu_nat, mu_t), power(model, t, mu, mu_nat, mu_t)
    _, viscous, natural = spending(model, t, mu, mu_nat, mu_t)
    values = {
        "internal_energy": internal,
        "free_energy": free,
        "bending_energy": bending_energy(model, mu, mu_nat),
        "preference_energy": preference_energy(model, mu_nat),
        "entropy": produced,
        "power": work,
        "entropy_rate": rate,
        "imbalance": internal - produced - free,
        "total_internal_energy": internal @ w,
        "total_free_energy": free @ w,
        "total_entropy": produced @ w,
        "total_power": work @ w,
        "total_entropy_rate": rate @ w,
        "viscous_dissipation_rate": viscous,
        "natural_dissipation_rate": natural,
        "viscous_dissipation": ledger[:, 1],
        "natural_dissipation": ledger[:, 2],
    }
    well = model.material.well
    if well is not None:
        values["volume_fraction"] = mu_nat / (well * model.scales.length)
    return values


def _integrals(history: History, model: Model, t: Array) -> tuple[Array, Array]:
    """Integrals of M mu_t and of tau eta_t from the first time to each of `t`, each of shape (k, n).

    Gauss's rule on every step of the solver, and on the parts into which `t` cuts it: on a step the state is a
    polynomial, and the points of the rule lie inside, where the loads are continuous.
    """
    n = model.grid.size
    ends = np.union1d(history.t[history.accepted], t)
    points, weights = np.polynomial.legendre.leggauss(_points(history))
    sums = np.zeros((2, ends.size, n))
    rows = max(1, BLOCK // (points.size * n))
    for first in range(0, ends.size - 1, rows):
        lower, upper = ends[first : first + rows + 1][:-1], ends[first + 1 : first + rows + 1]
        half = 0.5 * (upper - lower)
        # Rounding must not carry a point out of what was computed.
        times = np.clip(lower[:, None] + half[:, None] * (1.0 + points), history.start, history.end).ravel()
        for row, density in enumerate(_densities(model, times, history(times))):
            parts = np.einsum("j,kjn->kn", weights, density.reshape(half.size, points.size, n))
            sums[row, first + 1 : first + 1 + half.size] = half[:, None] * parts
    totals = np.cumsum(sums, axis=1)
    given, produced = totals[:, np.searchsorted(ends, t)]
    return given, produced


def _points(history: History) -> int:
    """Points of the rule: exact for products of two states, polynomials on a step."""
    return int(np.diff(history.first).max()) + 1 if history.steps else 1


def _densities(model: Model, t: Array, y: Array) -> tuple[Array, Array]:
    layout = model.layout
    mu, mu_nat, mu_t = layout.mu(y), layout.natural(y), layout.mu_t(y)
    return power(model, t, mu, mu_nat, mu_t), entropy_rate(model, t, mu, mu_nat, mu_t)


def _scale(kind: str, scales: Scales) -> float:
    """What one unit of a kind is in SI."""
    size = {"energy": scales.energy, "entropy": scales.energy, "power": scales.power, "entropy rate": scales.power}
    whole = kind.removesuffix(" density")
    scale = 1.0 if kind == "ratio" else size[whole]
    if whole.startswith("entropy"):
        scale /= scales.temperature or 1.0
    return scale / scales.length if kind.endswith("density") else scale


def _label(kind: str, words: str, model: Model) -> dict[str, str]:
    thermal = model.scales.temperature is not None
    unit = "1" if model.specimen is None else _UNITS[kind][0 if thermal else 1]
    if kind.startswith("entropy") and (model.specimen is None or not thermal):
        words += " times temperature"
    return {"units": unit, "long_name": words}


def _attributes(solution: Solution, values: dict[str, Array]) -> dict[str, str | float]:
    """What the numbers refer to, and how well they balance."""
    scale = _scale("energy density", solution.model.scales)
    attributes: dict[str, str | float] = {
        "title": "energy and entropy along the rod",
        "entropy_reference": "the first state of the motion, where it is 0",
        "largest_imbalance": float(np.abs(values["imbalance"]).max()) * scale,
        "largest_free_energy": float(np.abs(values["free_energy"]).max()) * scale,
        "conventions": solution.dataset.attrs["conventions"],
    }
    specimen = solution.model.specimen
    if specimen is not None and specimen.scales.temperature is not None:
        attributes["temperature"] = specimen.scales.temperature
    return attributes
