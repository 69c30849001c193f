"""All equilibria of one material under one thrust: what `plastica.equilibria` returns."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from plastica.equilibria.elastica import LARGEST_ALPHA, drive, ends
from plastica.equilibria.oscillation import unstable_count
from plastica.material.material import Laws, Material
from plastica.physics.laws import laws_of
from plastica.physics.scales import Scales, Specimen, unit_of

if TYPE_CHECKING:
    import xarray

__all__ = ["EquilibriumSet", "Fold", "Limiting"]

PLACES = 601
"""Equally spaced clamp curvatures of the curve in the dataset."""


@dataclass(frozen=True)
class Limiting:
    """An equilibrium at which the drive is as large as the threshold, |D| = Theta.

    Attributes
    ----------
    alpha : float
        Curvature at the clamp.
    mu_nat : float
        Natural curvature.
    side : int
        1 where D = Theta, -1 where D = -Theta.
    attracting : bool
        Whether natural curvature that yields near it moves toward it along the curve of equilibria: rate > 0. It is a
        limit of motions where `unstable` is 0 besides.
    rate : float
        r = -(dG/d alpha)/(d mu_nat/d alpha), G = D - side Theta: with the flow law c pos(x)^2 the excess drive dies
        like 1/(r c t) (errata C). Infinite at a fold, of the sign of -dG.
    drive : float
        D there.
    kind : str
        "crossing", or "tangency" where |D| - Theta has a double root as far as doubles can tell.
    unstable : int
        Number of unstable directions at frozen natural curvature; -1 too near a fold to tell.
    error : float
        How far the true alpha may lie from `alpha`.
    """

    alpha: float
    mu_nat: float
    side: int
    attracting: bool
    rate: float
    drive: float
    kind: str
    unstable: int
    error: float


@dataclass(frozen=True)
class Fold:
    """An equilibrium at which theta_0'(1) = d mu_nat / d alpha = 0, so that 0 is a double eigenvalue.

    Attributes
    ----------
    alpha : float
        Curvature at the clamp.
    mu_nat : float
        Natural curvature.
    drive : float
        D there.
    admissible : bool
        Whether |D| <= Theta.
    kind : str
        "crossing" where d mu_nat / d alpha changes sign: two equilibria of one natural curvature meet and vanish;
        "tangency" where it does not (and at the straight rod under gamma = ((k + 1/2) pi)^2, where three meet).
    error : float
        How far the true alpha may lie from `alpha`.
    """

    alpha: float
    mu_nat: float
    drive: float
    admissible: bool
    kind: str
    error: float


@dataclass(frozen=True)
class EquilibriumSet:
    """All equilibria of a material under one thrust, as pieces of the curve alpha -> (phi_alpha', phi_alpha'(1)).

    Everything is dimensionless; with a specimen, `to_dataset` is in SI.

    Attributes
    ----------
    gamma : float
        Thrust.
    intervals : tuple of (float, float)
        The alpha with |D| <= Theta, in ascending order; closed intervals between limiting equilibria or the ends of
        the range, infinite where the set is unbounded and nothing restricts it.
    limiting : tuple of Limiting
        All with |D| = Theta, in ascending alpha.
    isolated : tuple of Limiting
        Those of them that are alone: the drive touches the threshold from above.
    folds : tuple of Fold
        All with d mu_nat / d alpha = 0, in ascending alpha.
    range : tuple of (float, float)
        The alpha looked at.
    bounded : bool or None
        Whether the whole admissible set is bounded; None where the laws do not tell.
    complete : bool
        Whether nothing in the range is missing.
    sentence : str
        All that in words, with the reason why it is complete, or what keeps it from being.
    material : Material
        The laws.
    specimen : Specimen or None
        What it is made into.
    """

    gamma: float
    intervals: tuple[tuple[float, float], ...]
    limiting: tuple[Limiting, ...]
    isolated: tuple[Limiting, ...]
    folds: tuple[Fold, ...]
    range: tuple[float, float]
    bounded: bool | None
    complete: bool
    sentence: str
    material: Material
    specimen: Specimen | None = None

    @property
    def tangencies(self) -> tuple[Limiting, ...]:
        """The limiting equilibria that are double roots: here the number of them changes with the thrust."""
        return tuple(point for point in self.limiting if point.kind == "tangency")

    @property
    def laws(self) -> Laws:
        """The dimensionless laws."""
        return laws_of(self.material, self.specimen)

    def contains(self, alpha: float) -> bool:
        """Tell whether an alpha is in the admissible set, as far as the range goes."""
        return any(lo <= alpha <= hi for lo, hi in self.intervals) or alpha in {p.alpha for p in self.isolated}

    def to_dataset(self) -> xarray.Dataset:
        """Return points, intervals and the curve they lie on as labelled arrays: SI with a specimen."""
        import xarray

        scales = Scales.unit() if self.specimen is None else self.specimen.scales
        data: dict[str, Any] = {}
        for name, (dimension, kind, words, value) in self._quantities().items():
            label = {"units": unit_of(kind, self.specimen is None), "long_name": words}
            data[name] = ((dimension,), scales.to_si(kind, np.asarray(value, dtype=float)), label)
        for name, points in (("limiting", self.limiting), ("fold", self.folds)):
            data[f"{name}_kind"] = ((name,), np.array([p.kind for p in points], dtype=str), {"long_name": "kind"})
        facts = {
            "title": "equilibria of a strut",
            "conventions": "SI" if self.specimen is not None else "dimensionless: curvatures in 1/L, drive in EI",
            "gamma": self.gamma,
            "range": np.array(self.range),
            "complete": int(self.complete),
            "sentence": self.sentence,
        }
        return xarray.Dataset(data, attrs=facts)

    def _quantities(self) -> dict[str, tuple[str, str, str, Any]]:
        """Name -> (dimension, kind of quantity, words, dimensionless values)."""
        limit = min(max(map(abs, self.range)), LARGEST_ALPHA)
        alpha = np.clip(np.linspace(*self.range, PLACES), -limit, limit)
        end, laws = ends(self.gamma, alpha), self.laws
        points, folds, low_high = self.limiting, self.folds, np.array(self.intervals, dtype=float).reshape(-1, 2)
        return {
            "low": ("interval", "curvature", "least clamp curvature of an admissible interval", low_high[:, 0]),
            "high": ("interval", "curvature", "largest clamp curvature of an admissible interval", low_high[:, 1]),
            "limiting_alpha": ("limiting", "curvature", "clamp curvature where |D| = Theta", [p.alpha for p in points]),
            "limiting_natural": ("limiting", "curvature", "natural curvature there", [p.mu_nat for p in points]),
            "limiting_drive": ("limiting", "drive", "driving force there", [p.drive for p in points]),
            "limiting_rate": ("limiting", "ratio", "rate of approach along the curve", [p.rate for p in points]),
            "limiting_side": ("limiting", "ratio", "sign of the driving force", [p.side for p in points]),
            "limiting_unstable": ("limiting", "ratio", "unstable directions", [p.unstable for p in points]),
            "fold_alpha": ("fold", "curvature", "clamp curvature at a fold", [p.alpha for p in folds]),
            "fold_natural": ("fold", "curvature", "natural curvature at a fold", [p.mu_nat for p in folds]),
            "alpha": ("place", "curvature", "curvature at the clamp", alpha),
            "natural_curvature": ("place", "curvature", "natural curvature", end.mu_nat),
            "drive": ("place", "drive", "driving force on the natural curvature", drive(end, laws)),
            "threshold": ("place", "drive", "threshold", laws.threshold.value(end.mu_nat)),
            "unstable": ("place", "ratio", "unstable directions", unstable_count(self.gamma, alpha, end)),
        }

    def __str__(self) -> str:
        lines = [self.sentence]
        for point in self.limiting:
            sign = "+" if point.side > 0 else "-"
            words = "tangency" if point.kind == "tangency" else "attracting" if point.attracting else "repelling"
            more = "" if point.unstable <= 0 else f", {point.unstable} unstable"
            lines.append(f"  alpha = {point.alpha:.10g}, mu_nat = {point.mu_nat:.10g}: D = {sign}Theta, {words}{more}")
        lines += [f"  alpha = {fold.alpha:.10g}, mu_nat = {fold.mu_nat:.10g}: fold" for fold in self.folds]
        return "\n".join(lines)


def interval_words(interval: tuple[float, float]) -> str:
    """Write an interval for people."""
    low = f"[{interval[0]:.6g}" if math.isfinite(interval[0]) else "(-inf"
    high = f"{interval[1]:.6g}]" if math.isfinite(interval[1]) else "inf)"
    return f"{low}, {high}"
