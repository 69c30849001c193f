"""What the theory promises of a motion before it is computed: a-priori bounds and continuous dependence."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from plastica.material.material import Laws
from plastica.physics.ledger import liapunov
from plastica.physics.model import Model

__all__ = ["Bounds", "bounds", "bounds_of_energy", "largest_natural_curvature"]

Array = NDArray[np.float64]

SAMPLES = 4001
FARTHEST = 1e8
"""Natural curvature (1/L) up to which the preference energy is searched for values within the energy bound."""


@dataclass(frozen=True)
class Bounds:
    """A-priori bounds of one start, dimensionless; infinite where the theory gives none (an end couple, for one).

    Attributes
    ----------
    energy : float
        Of 1/2 |mu - mu_nat|^2 + kappa(mu_nat): V(0) plus the largest load plus the variation of the loads.
    bending : float
        Of the norm |mu - mu_nat| in L2.
    natural_curvature : float
        Of |mu_nat|: the largest m with kappa(m) within the energy.
    norm : float
        Of |mu| + |mu_nat|: the paper's constant C(mu_0, mu_nat_0, gamma) of theorem 3.1.
    drive : float
        Of |D|.
    growth : float
        C of continuous dependence: two motions that obey these bounds part at most like exp(C t), measured by
        (|mu_1 - mu_2|^2 + (mu_nat_1 - mu_nat_2)^2)^(1/2), squares of natural curvatures weighted by the lengths of
        their segments. Infinite for a rod with inertia, for which the theory gives none.
    """

    energy: float
    bending: float
    natural_curvature: float
    norm: float
    drive: float
    growth: float


def bounds(
    strut: Model, mu: ArrayLike, mu_nat: ArrayLike, start: float, end: float, mu_t: ArrayLike | None = None
) -> Bounds:
    """Compute the a-priori bounds for the start (mu, mu_nat) and the times [start, end].

    With M1 = 0 the energy obeys dE/dt <= d/dt(work), hence E(t) <= V(0) + max int |n_load| + variation of the loads
    (paper, proof of theorem 3.1, extended to loads that vary).

    Parameters
    ----------
    strut : Model
        The model on a definite grid.
    mu : array_like, shape (n,)
        Initial curvature at the nodes, dimensionless.
    mu_nat : float, or array_like of shape (m,) with several segments
        Initial natural curvature, dimensionless.
    start, end : float
        Dimensionless times.
    mu_t : array_like, shape (n,), optional
        Initial rate of curvature of a rod with inertia.

    Returns
    -------
    Bounds
    """
    loads = strut.loads
    if "couple" in dict(loads.sources()):
        return Bounds(*[float("inf")] * 6)
    parts = ((loads.thrust, 1.0), (loads.transverse, 1.0), (loads.weight, 0.5))
    largest = sum(max(map(abs, program.extreme(end))) * share for program, share in parts)
    variation = sum(program.variation(end) * share for program, share in parts)
    first = float(liapunov(strut, start, mu, mu_nat, mu_t))
    # Rounding of V alone must not make the bound fail for a start that sits on it.
    energy = first + largest + variation + 64.0 * np.finfo(float).eps * (abs(first) + largest)
    return bounds_of_energy(strut, energy, end)


def bounds_of_energy(strut: Model, energy: float, end: float) -> Bounds:
    """Compute the bounds that hold for every motion whose stored energy stays within `energy` up to time `end`.

    For two starts take the larger of their energies: the growth then holds for the distance between them.
    """
    loads = strut.loads
    bending = float(np.sqrt(2.0 * max(energy, 0.0)))
    shortest = float(strut.division.lengths.min())
    natural = largest_natural_curvature(strut.laws, energy / shortest)
    m = np.linspace(-natural, natural, SAMPLES) if np.isfinite(natural) else np.zeros(1)
    steepest = float(np.abs(strut.laws.preference.slope(m)).max())
    drive = float(bending / np.sqrt(shortest)) + steepest if np.isfinite(natural) else natural
    slope = sum(max(map(abs, program.extreme(end))) for program in (loads.thrust, loads.transverse, loads.weight))
    growth = float("inf") if strut.has_inertia else _growth(strut.laws, m, drive, slope, strut.damping)
    return Bounds(energy, bending, natural, bending + 2.0 * natural, drive, growth)


def largest_natural_curvature(laws: Laws, energy: float) -> float:
    """Return the largest |m| with kappa(m) <= energy, infinite where kappa does not exceed it far out.

    The energy is scanned on a grid of 1e-8 to 1e8 with 200 points a decade, and the last crossing refined.
    """
    from scipy.optimize import brentq

    m = np.concatenate([[0.0], np.logspace(-8, np.log10(FARTHEST), 3201)])
    within = laws.preference.value(m) <= energy
    if not within.any():
        return 0.0
    last = int(np.nonzero(within)[0][-1])
    if last == m.size - 1:
        return float("inf")

    def gap(x: float) -> float:
        return laws.preference.value_at(x) - energy

    if gap(float(m[last])) * gap(float(m[last + 1])) >= 0.0:
        return float(m[last + 1])
    root = float(brentq(gap, float(m[last]), float(m[last + 1]), xtol=1e-14 * float(m[last + 1])))
    return root * (1.0 + 1e-12)


def _growth(laws: Laws, m: Array, drive: float, load: float, damping: float) -> float:
    """Logarithmic norm of the comparison matrix for (|mu_1 - mu_2|, |mu_nat_1 - mu_nat_2|).

    |J| = |J*| = 2/pi bound the bending part; the flow law enters by the largest slope it reaches, and helps where it
    is monotone and pulls natural curvatures together.
    """
    if not np.isfinite(drive):
        return float("inf")
    excess = max(drive - float(laws.threshold.value(m).min()), 0.0)
    slope = laws.flow.slope(np.linspace(0.0, excess, SAMPLES))
    steepest = float(np.abs(slope).max())
    stiffening = 1.0 + laws.preference.second(m)
    barrier = np.abs(laws.threshold.slope(m))
    pull = float((barrier - stiffening).max()) if slope.min() >= 0.0 else float((barrier + np.abs(stiffening)).max())
    matrix = np.array([[(4.0 * load / np.pi**2 - 1.0) / damping, 1.0 / damping], [steepest, steepest * max(pull, 0.0)]])
    return float(np.linalg.eigvalsh(0.5 * (matrix + matrix.T))[-1])
