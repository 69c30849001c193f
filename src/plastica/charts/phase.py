"""The phase diagram of a material: which equilibria are admissible and stable, over thrust and clamp curvature."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from plastica.charts.components import (
    Component,
    FoldLine,
    Place,
    crossings,
    fold_lines,
    limiting_components,
    tracing_grid,
)
from plastica.equilibria.catalog import equilibria
from plastica.equilibria.elastica import drive, ends
from plastica.equilibria.oscillation import unstable_count
from plastica.errors import ArgumentError
from plastica.material.material import Laws, Material
from plastica.motion.solution import Solution
from plastica.physics.amounts import plain
from plastica.physics.laws import laws_of
from plastica.physics.scales import Scales, Specimen, unit_of
from plastica.physics.strut import Strut, uniform_strut

if TYPE_CHECKING:
    import xarray

__all__ = ["PhaseDiagram", "phase_diagram"]

Array = NDArray[np.float64]

LARGEST_ALPHA = 1e5
"""Clamp curvature up to which a diagram is drawn."""

LARGEST_GAMMA = 600.0
"""Thrust up to which a diagram is drawn: beyond, the layer at the separatrix is narrower than doubles can tell."""

FEWEST, MOST = 2, 5000
MOST_POINTS = 10_000_000

TRACING = (1.0, 1.5)
"""Lines of the grid that curves are traced on, for each line of the diagram; and the fewest and the most of them."""
FEWEST_TRACING, MOST_TRACING = 200, 800

REFINEMENTS = (1.0, 1.7, 2.9)
"""How much finer the curves are traced, one after the other, as long as they miss limiting equilibria."""

CHECKS = np.array([0.1137, 0.3121, 0.5573, 0.7611, 0.9719])
"""Where thrusts are checked, as shares of the range of gamma^(1/2)."""


@dataclass(frozen=True, eq=False)
class PhaseDiagram:
    """Equilibria over the (gamma, alpha) plane, and mapped to the (gamma, mu_nat) plane, mu_nat = phi_alpha'(1).

    Everything here is dimensionless. In datasets `gamma` and `alpha` are too; what has a name in words is in SI with a
    specimen.

    Attributes
    ----------
    material : Material
        The laws.
    specimen : Specimen or None
        What it is made into.
    gamma, alpha : ndarray, shapes (n,) and (m,)
        The grid.
    mu_nat, drive, threshold : ndarray, shape (n, m)
        Natural curvature, driving force and threshold of each equilibrium.
    unstable : ndarray of int, shape (n, m)
        Number of unstable directions at frozen natural curvature; -1 too near a fold to tell.
    components : tuple of Component
        The set of limiting equilibria |D| = Theta within the window, piece by piece: the numerical answer to the
        question about it that the paper leaves open (section 3).
    folds : tuple of FoldLine
        Where dmu_nat/dalpha = 0.
    checked : tuple of float
        Thrusts at which the number of limiting equilibria on the curves was compared with all roots.
    complete : bool
        Whether it agreed at all of them, and all special points of the curves are resolved.
    """

    material: Material
    specimen: Specimen | None
    gamma: Array
    alpha: Array
    mu_nat: Array
    drive: Array
    threshold: Array
    unstable: NDArray[np.int64]
    components: tuple[Component, ...]
    folds: tuple[FoldLine, ...]
    checked: tuple[float, ...]
    complete: bool

    @property
    def admissible(self) -> NDArray[np.bool_]:
        """Where |D| <= Theta; shape (n, m)."""
        return np.asarray(np.abs(self.drive) <= self.threshold)

    @property
    def tangencies(self) -> tuple[Place, ...]:
        """The double roots of |D| = Theta, by thrust."""
        return tuple(sorted((p for c in self.components for p in c.tangencies), key=lambda p: (p.gamma, p.alpha)))

    @property
    def cusps(self) -> tuple[Place, ...]:
        """The cusps of the folds in the (gamma, mu_nat) plane, by thrust."""
        return tuple(sorted((p for line in self.folds for p in line.cusps), key=lambda p: (p.gamma, p.alpha)))

    @cached_property
    def dataset(self) -> xarray.Dataset:
        """The grid: admissible, unstable, natural_curvature, drive and threshold over gamma and alpha."""
        import xarray

        si, scales = self.specimen is not None, Scales.unit() if self.specimen is None else self.specimen.scales
        plane = ("gamma", "alpha")
        data: dict[str, Any] = {
            "admissible": (plane, self.admissible, {"units": "1", "long_name": "whether |drive| <= threshold"}),
            "unstable": (plane, self.unstable, {"units": "1", "long_name": "unstable directions; -1 at a fold"}),
        }
        for name, kind, words, value in (
            ("natural_curvature", "curvature", "natural curvature", self.mu_nat),
            ("drive", "drive", "driving force on the natural curvature", self.drive),
            ("threshold", "drive", "threshold that the drive must exceed", self.threshold),
        ):
            data[name] = (plane, scales.to_si(kind, value), {"units": unit_of(kind, not si), "long_name": words})
        coordinates: dict[str, Any] = {
            "gamma": ("gamma", self.gamma, {"units": "1", "long_name": "thrust, in EI/L^2"}),
            "alpha": ("alpha", self.alpha, {"units": "1", "long_name": "curvature at the clamp, in 1/L"}),
        }
        if si:
            coordinates |= _si_axes(scales, self.gamma, self.alpha)
        facts = {"title": "phase diagram of a strut", "conventions": _conventions(si), "sentence": str(self)}
        return xarray.Dataset(data, coords=coordinates, attrs=facts)

    def to_dataset(self) -> xarray.Dataset:
        """Return the grid, and the limiting curves and folds as lists of points, each with the number of its curve."""
        scales = Scales.unit() if self.specimen is None else self.specimen.scales
        unit = unit_of("curvature", self.specimen is None)
        data: dict[str, Any] = {}
        for name, curves in (("limiting", self.components), ("fold", self.folds)):
            row = f"{name}_point"
            which = np.repeat(np.arange(len(curves)), [c.gamma.size for c in curves])
            joined = [np.concatenate([np.zeros(0), *(getattr(c, z) for c in curves)]) for z in _AXES]
            data[f"{name}_curve"] = (row, which, {"units": "1", "long_name": "number of the curve"})
            data[f"{name}_gamma"] = (row, joined[0], {"units": "1", "long_name": "thrust, in EI/L^2"})
            data[f"{name}_alpha"] = (row, joined[1], {"units": "1", "long_name": "curvature at the clamp, in 1/L"})
            natural = scales.to_si("curvature", joined[2])
            data[f"{name}_natural_curvature"] = (row, natural, {"units": unit, "long_name": "natural curvature"})
        for name, kind in (("rate", float), ("unstable", np.int64)):
            values = np.concatenate([np.zeros(0, dtype=kind), *(getattr(c, name) for c in self.components)])
            words = "rate of approach r" if name == "rate" else "unstable directions; -1 at a fold"
            data[f"limiting_{name}"] = ("limiting_point", values, {"units": "1", "long_name": words})
        for name, places in (("tangency", self.tangencies), ("cusp", self.cusps)):
            for axis in _AXES:
                values = np.array([getattr(p, axis) for p in places], dtype=float)
                named = "natural_curvature" if axis == "mu_nat" else axis
                in_si = scales.to_si("curvature", values) if axis == "mu_nat" else values
                data[f"{name}_{named}"] = (name, in_si, {"units": unit if axis == "mu_nat" else "1"})
        side = [c.side for c in self.components]
        data["component_side"] = ("component", np.array(side, dtype=np.int64), {"long_name": "sign of the drive"})
        kinds = np.array([c.kind for c in self.components], dtype=str)
        data["component_kind"] = ("component", kinds, {"long_name": "closed or open"})
        return self.dataset.assign(data)

    def path(self, solution: Solution) -> xarray.Dataset:
        """Return the path of a run in the diagram.

        Parameters
        ----------
        solution : Solution
            A run of a rod of the same material and specimen, under a thrust alone, which may vary.

        Returns
        -------
        xarray.Dataset
            Over the accepted steps t: `gamma`, `alpha` (the clamp curvature mu(0, t) L) and `natural_curvature`. While
            the rod moves it is no equilibrium, and the point says where it is heading rather than what it is.

        Raises
        ------
        ArgumentError
            Where the run is of another rod, or under other loads.
        """
        import xarray

        strut = _checked_run(solution, self.material, self.specimen)
        history, scales, si = solution.history, strut.scales, self.specimen is not None
        t, y = history.t[history.accepted], history.y[history.accepted]
        n = strut.grid.size
        alpha = strut.curvature_between(t, y[:, :n], [0.0])[:, 0]
        gamma = np.asarray(strut.loads.thrust(t), dtype=float) * np.ones_like(t)
        label = {"units": unit_of("curvature", not si), "long_name": "natural curvature"}
        data: dict[str, Any] = {
            "gamma": ("t", gamma, {"units": "1", "long_name": "thrust, in EI/L^2"}),
            "alpha": ("t", alpha, {"units": "1", "long_name": "curvature at the clamp, in 1/L"}),
            "natural_curvature": ("t", scales.to_si("curvature", y[:, n]), label),
        }
        clock = {"t": ("t", t * scales.time, {"units": unit_of("time", not si), "long_name": "time"})}
        return xarray.Dataset(data, coords=clock, attrs={"title": "path of a run", "conventions": _conventions(si)})

    def __str__(self) -> str:
        share = float(np.mean(self.admissible))
        size = f"{self.gamma.size} x {self.alpha.size} equilibria, {100.0 * share:.1f} % admissible"
        lines = [
            f"Phase diagram over gamma in [{self.gamma[0]:.6g}, {self.gamma[-1]:.6g}], alpha in [{self.alpha[0]:.6g}, "
            f"{self.alpha[-1]:.6g}] ({size}).",
            f"The limiting equilibria are {len(self.components)} component{'' if len(self.components) == 1 else 's'}:",
        ]
        lines += [f"  {component}" for component in self.components]
        cusps = ", ".join(f"({p.gamma:.6g}, {p.mu_nat + 0.0:.6g})" for p in self.cusps)
        lines.append(f"{len(self.folds)} lines of folds" + (f"; cusps at (gamma, mu_nat) = {cusps}." if cusps else "."))
        if self.complete:
            agree = f"At {len(self.checked)} thrusts these curves hold as many limiting equilibria as there are roots."
            lines.append(agree)
        else:
            lines.append("Not complete: the curves are finer than the grid, or miss limiting equilibria.")
        return "\n".join(lines)


_AXES = ("gamma", "alpha", "mu_nat")


def phase_diagram(
    material: Material,
    gamma: tuple[float, float] = (0.0, 20.0),
    alpha: tuple[float, float] = (-12.0, 12.0),
    shape: tuple[int, int] = (400, 400),
    *,
    specimen: Specimen | None = None,
) -> PhaseDiagram:
    """Draw up the phase diagram of a material.

    At every (gamma, alpha) the equilibrium phi'' + gamma sin phi = 0, phi(0) = 0, phi'(0) = alpha, mu_nat = phi'(1),
    its drive D = phi(1) - mu_nat - kappa'(mu_nat), and the number of its unstable directions; the curves |D| = Theta
    and dmu_nat/dalpha = 0 that bound the regions, every point of them exact to the last bits.

    Parameters
    ----------
    material : Material
        The laws; the flow law does not matter.
    gamma, alpha : tuple of (float, float)
        The window, dimensionless: 0 <= gamma <= 600, |alpha| <= 1e5.
    shape : tuple of (int, int)
        Points along each, at least 2 and at most 5000, ten million together.
    specimen : Specimen, optional
        What the material is made into; datasets then have SI values and axes too.

    Returns
    -------
    PhaseDiagram

    Raises
    ------
    ArgumentError
        Where an argument is of the wrong kind, not finite, or an empty range.

    Notes
    -----
    The curves are traced on a grid of their own: with as many thrusts as the diagram (200 to 800, even in gamma^(1/2)),
    half again as many clamp curvatures, up to half of them in the layers at the separatrix, and edges that follow it.
    At five thrusts the number of limiting equilibria on them is compared with all roots of `plastica.equilibria`. Where
    it differs, or a special point cannot be resolved, they are traced anew, 1.7 and then 2.9 times as finely. Loops and
    tongues narrower than the cells, between these thrusts, are missed. Cost: a microsecond for each point of the grid,
    and about ten for the curves.

    Checked by test_curves_hold_every_limiting_equilibrium, test_the_paper_question.

    Examples
    --------
    >>> import plastica as pl
    >>> found = phase_diagram(pl.Material("m**2/2", "pos(x)**2", "0.1"), gamma=(0, 5), alpha=(-6, 6), shape=(60, 60))
    >>> len(found.components), f"{found.tangencies[0].gamma:.6f}"
    (4, '1.618555')
    """
    laws = _laws(material, specimen)
    low, high = _range(gamma, "gamma", 0.0, LARGEST_GAMMA)
    left, right = _range(alpha, "alpha", -LARGEST_ALPHA, LARGEST_ALPHA)
    rows, columns = _shape(shape)
    g, a = np.linspace(low, high, rows), np.linspace(left, right, columns)
    end = ends(g[:, None], a)
    curves = _curves(material, laws, specimen, ((low, high), (left, right)), (rows, columns))
    return PhaseDiagram(
        material,
        specimen,
        g,
        a,
        end.mu_nat,
        drive(end, laws),
        laws.threshold.value(end.mu_nat),
        unstable_count(g[:, None], a, end),
        *curves,
    )


def _curves(
    material: Material,
    laws: Laws,
    specimen: Specimen | None,
    window: tuple[tuple[float, float], tuple[float, float]],
    shape: tuple[int, int],
) -> tuple[tuple[Component, ...], tuple[FoldLine, ...], tuple[float, ...], bool]:
    """Trace the curves, on finer grids as long as a thrust has other limiting equilibria than they say."""
    roots = math.sqrt(window[0][0]) + CHECKS * (math.sqrt(window[0][1]) - math.sqrt(window[0][0]))
    thrusts = tuple((roots**2).tolist())
    sets = [equilibria(material, gamma, window[1], specimen=specimen) for gamma in thrusts]
    # a double root counts as two or none: such a thrust decides nothing
    known = [(s.gamma, len(s.limiting)) for s in sets if s.complete and not s.tangencies]
    lines = np.clip(np.array(TRACING) * shape, FEWEST_TRACING, MOST_TRACING)
    for finer in REFINEMENTS:
        traced = tracing_grid(*window, (int(finer * lines[0]), int(finer * lines[1])))
        components = limiting_components(laws, *traced)
        agree = all(c.resolved for c in components)
        agree &= all(crossings(components, gamma) == count for gamma, count in known)
        if agree:
            break
    return components, fold_lines(*traced), thrusts, agree and len(known) == len(thrusts)


def _laws(material: object, specimen: object) -> Laws:
    if not isinstance(material, Material):
        raise ArgumentError("must be a pl.Material", where="material", value=material)
    if specimen is not None and not isinstance(specimen, Specimen):
        raise ArgumentError("must be a pl.Specimen or None", where="specimen", value=specimen)
    return laws_of(material, specimen)


def _range(given: object, where: str, least: float, most: float) -> tuple[float, float]:
    try:
        low, high = (plain(each) for each in given)  # type: ignore[attr-defined]
    except (TypeError, ValueError):
        raise ArgumentError("must be a pair (low, high)", where=where, value=given) from None
    if not (isinstance(low, float) and isinstance(high, float) and math.isfinite(low) and math.isfinite(high)):
        raise ArgumentError("must be a pair of finite numbers", where=where, value=given)
    if not low < high:
        raise ArgumentError("must be a range, low < high", where=where, value=given)
    if where == "gamma" and low < 0.0:
        raise ArgumentError("must not be negative: tension is not treated", where=where, value=given)
    if low < least or high > most:
        raise ArgumentError(f"must lie in [{least:g}, {most:g}]", where=where, value=given)
    return low, high


def _shape(given: object) -> tuple[int, int]:
    rows: Any
    columns: Any
    try:
        rows, columns = given  # type: ignore[misc]
    except (TypeError, ValueError):
        raise ArgumentError("must be a pair of integers", where="shape", value=given) from None
    for each in (rows, columns):
        whole = isinstance(each, (int, np.integer)) and not isinstance(each, bool)
        if not whole or not FEWEST <= each <= MOST:
            raise ArgumentError(f"must be two integers in [{FEWEST}, {MOST}]", where="shape", value=given)
    if rows * columns > MOST_POINTS:
        raise ArgumentError(f"must come to at most {MOST_POINTS} points", where="shape", value=given)
    return int(rows), int(columns)


def _si_axes(scales: Scales, gamma: ArrayLike, alpha: ArrayLike) -> dict[str, Any]:
    return {
        "thrust": ("gamma", scales.to_si("force", gamma), {"units": "N", "long_name": "thrust"}),
        "clamp_curvature": (
            "alpha",
            scales.to_si("curvature", alpha),
            {"units": "1/m", "long_name": "curvature at the clamp"},
        ),
    }


def _conventions(si: bool) -> str:
    words = "gamma in EI/L^2 and alpha in 1/L; "
    return words + ("all else in SI" if si else "all else dimensionless: lengths in L, forces in EI/L^2")


def _checked_run(solution: object, material: Material, specimen: Specimen | None) -> Strut:
    if not isinstance(solution, Solution):
        raise ArgumentError("must be a pl.Solution", where="solution", value=solution)
    strut = uniform_strut(solution.model, "solution")
    if strut.material != material or strut.specimen != specimen:
        raise ArgumentError("must be a run of the diagram's own material and specimen", where="solution")
    if others := {name for name, _ in strut.loads.sources()} - {"thrust"}:
        raise ArgumentError("must be a run under a thrust alone", where="solution", value=sorted(others))
    return strut
