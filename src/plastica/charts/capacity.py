"""How crooked a strut may be and still stay near its straight shape for ever: the capacity chart."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from plastica.charts.starts import NODES, interval_of, read_shape, scaled, straight_interval
from plastica.charts.thresholds import Thresholds, thresholds
from plastica.equilibria.catalog import equilibria
from plastica.equilibria.equilibrium_set import EquilibriumSet
from plastica.errors import ArgumentError
from plastica.material.material import Material
from plastica.motion.longtime import omega_limit
from plastica.numerics.grid import Grid
from plastica.physics.initial import Shape
from plastica.physics.load import Load
from plastica.physics.scales import Specimen, unit_of
from plastica.physics.strut import Strut

if TYPE_CHECKING:
    import xarray

__all__ = ["capacity"]

Array = NDArray[np.float64]

NATURAL = "natural"

TRIED = 2.0
"""Largest imperfection tried, in units of the clamp curvature of the outermost limiting equilibrium."""

SMALLEST = 1e-6
"""Smallest one tried, in units of the largest."""

GEOMETRIC, LINEAR = 16, 8
PRECISION = 1e-6
"""Relative width to which the edge is closed in."""

MOST_THRUSTS = 10_000


def capacity(
    material: Material,
    gamma: ArrayLike,
    imperfection: str = NATURAL,
    *,
    specimen: Specimen | None = None,
    rtol: float = 1e-8,
    progress: Callable[[int, int], None] | None = None,
) -> xarray.Dataset:
    """Find, for each thrust, the largest imperfection from which the rod stays near its straight shape for ever.

    The supremum of delta such that every motion from (delta' shape, 0), or (delta', delta') for "natural", with 0 <=
    delta' <= delta ends in the component of the admissible set {|D| <= Theta} that contains alpha = 0 (design,
    section 4); 0 where none does.

    Parameters
    ----------
    material : Material
        The laws.
    gamma : array_like, shape (n,) or a number
        Thrusts >= 0, dimensionless.
    imperfection : str
        "natural": a rod that was made with the curvature delta and lies at rest without load. Or text in s (in m with a
        specimen, else in units of L), the shape of an initial curvature delta * shape(s) of a rod that is naturally
        straight; as written, not normalised.
    specimen : Specimen, optional
        What the material is made into, where its parameters carry units; the result is then in SI besides.
    rtol : float
        Tolerance of the runs.
    progress : callable, optional
        Called with the number of thrusts done and of all.

    Returns
    -------
    xarray.Dataset
        Over `gamma`:

        * `largest`, in 1/L: every start tried up to it stays; infinite where none leaves;
        * `leaves`, in 1/L: the least that was seen to leave, within 1e-6 of `largest`; infinite likewise;
        * `tried`, in 1/L: the largest imperfection that was run; nan where no run was needed, since the admissible set
          is one interval, in which every motion ends (claim 7);
        * `edge`, in 1/L: where the component ends, the largest clamp curvature in it;
        * `runs`: how many were made.

        With a specimen the coordinate `thrust` in N, and `largest_curvature`, `leaves_curvature`, `edge_curvature` in
        1/m. Attributes: `leaves_from`, the least of these thrusts under which a start was seen to leave (None where
        none was), `gamma_star`, `gamma_star_star`, `euler` (see `thresholds`; None where there is none),
        `imperfection`, `sentence`.

    Raises
    ------
    ArgumentError
        Where an argument is of the wrong kind or outside its range.

    Notes
    -----
    Imperfections up to twice the outermost limiting clamp curvature are tried at 24 places, finer toward small ones,
    and the first change from staying to leaving is closed in on by halving. A window of leaving between two of these
    places with staying on both sides is missed. Where the end of a run cannot be told, it counts as leaving. Each
    thrust with a gap takes some 35 runs of about 25 ms.

    *You should see*, for a preference energy with one well: infinity up to gamma**, then a fall. With several wells, or
    with a threshold that grows, the admissible set has other intervals below gamma** too, from gamma = 0 on where two
    wells are parted, and large imperfections leave for these: `leaves_from`, and not gamma**, is the thrust to stay
    below, as far as the thrusts asked for tell. The fall goes on past Euler's load: just above it the rod buckles
    elastically, within its component as long as the tip angle of the buckled shape, which is its drive, is at most
    Theta(0). From gamma = K(k)^2, k = sin(Theta(0)/2), on, the capacity is 0: for "natural" it goes there continuously,
    for shapes it jumps.

    Checked by test_the_edge_is_where_runs_part, test_capacity_ends_where_the_buckled_shape_yields.
    """
    if not isinstance(material, Material):
        raise ArgumentError("must be a pl.Material", where="material", value=material)
    critical = thresholds(material, specimen=specimen)
    thrusts = _thrusts(gamma)
    start = _start(material, imperfection, specimen)
    rows = []
    for i, thrust in enumerate(thrusts.tolist()):
        rows.append(_row(start, equilibria(material, thrust, specimen=specimen), rtol))
        if progress is not None:
            progress(i + 1, thrusts.size)
    return _dataset(thrusts, rows, critical, imperfection, specimen)


@dataclass(frozen=True)
class _Row:
    """What was found for one thrust."""

    largest: float
    leaves: float
    tried: float
    edge: float
    runs: int


@dataclass(frozen=True)
class _Start:
    """A family of starts, one for each dimensionless amplitude delta; `shape` is None for "natural"."""

    strut: Strut
    shape: Shape | None
    size: float

    def stays(self, found: EquilibriumSet, delta: float, rtol: float) -> bool:
        """Tell whether the motion from one of them is seen to end in the component of the straight rod."""
        scales = self.strut.scales
        strut = self.strut.with_load(Load(thrust=scales.to_si("force", found.gamma)))
        amplitude = scales.to_si("curvature", delta)
        if self.shape is None:
            limit = omega_limit(strut, amplitude, amplitude, rtol=rtol)
        else:
            limit = omega_limit(strut, scaled(self.shape, amplitude, strut), 0.0, rtol=rtol)
        if limit.equilibrium is None or limit.stable is False:
            return False
        return interval_of(found, limit.equilibrium.alpha) == 0


def _start(material: Material, imperfection: object, specimen: Specimen | None) -> _Start:
    strut = Strut(material, Load(), Grid(nodes=NODES), specimen)
    if isinstance(imperfection, str) and imperfection == NATURAL:
        return _Start(strut, None, 1.0)
    shape, size = read_shape(imperfection, strut, "imperfection")
    if size == 0.0:
        raise ArgumentError("must not vanish along the rod", where="imperfection", value=imperfection)
    return _Start(strut, shape, size)


def _thrusts(gamma: ArrayLike) -> Array:
    try:
        values = np.atleast_1d(np.asarray(gamma, dtype=float))
    except (TypeError, ValueError):
        raise ArgumentError("must be numbers", where="gamma", value=gamma) from None
    if values.ndim != 1 or not 1 <= values.size <= MOST_THRUSTS:
        raise ArgumentError(f"must be a list of 1 to {MOST_THRUSTS} thrusts", where="gamma", value=values.shape)
    if not np.isfinite(values).all():
        raise ArgumentError("must be finite", where="gamma", value=gamma)
    if values.min() < 0.0:
        raise ArgumentError("must not be negative: tension is not treated", where="gamma", value=gamma)
    return values


def _row(start: _Start, found: EquilibriumSet, rtol: float) -> _Row:
    edge = straight_interval(found)[1]
    if len(found.intervals) == 1 and not found.isolated and found.complete:
        return _Row(math.inf, math.inf, math.nan, edge, 0)
    outermost = max(0.0, *(abs(point.alpha) for point in found.limiting), 2.0 * math.sqrt(found.gamma))
    top = TRIED * outermost / start.size
    places = np.union1d(np.geomspace(SMALLEST * top, top, GEOMETRIC), np.linspace(0.0, top, LINEAR + 2)[1:])
    runs, stays = 0, 0.0

    def within(delta: float) -> bool:
        nonlocal runs
        runs += 1
        return start.stays(found, delta, rtol)

    for place in places.tolist():
        if not within(place):
            leaves = place
            break
        stays = place
    else:
        return _Row(math.inf, math.inf, top, edge, runs)
    if stays == 0.0:
        return _Row(0.0, leaves, leaves, edge, runs)
    tried = leaves
    while leaves - stays > PRECISION * stays:
        middle = math.sqrt(stays * leaves) if leaves > 2.0 * stays else 0.5 * (stays + leaves)
        stays, leaves = (middle, leaves) if within(middle) else (stays, middle)
    return _Row(stays, leaves, tried, edge, runs)


def _dataset(
    gamma: Array, rows: list[_Row], critical: Thresholds, imperfection: str, specimen: Specimen | None
) -> xarray.Dataset:
    import xarray

    words = {
        "largest": "largest imperfection from which the rod stays near its straight shape",
        "leaves": "least imperfection seen to leave",
        "tried": "largest imperfection run",
        "edge": "clamp curvature at which the central component ends",
    }
    data: dict[str, Any] = {}
    for name, said in words.items():
        values = np.array([getattr(row, name) for row in rows], dtype=float)
        data[name] = ("gamma", values, {"units": "1", "long_name": f"{said}, times L"})
        if specimen is not None and name != "tried":
            in_si = specimen.scales.to_si("curvature", values)
            data[f"{name}_curvature"] = ("gamma", in_si, {"units": unit_of("curvature"), "long_name": said})
    data["runs"] = ("gamma", np.array([row.runs for row in rows]), {"units": "1", "long_name": "number of runs"})
    coordinates: dict[str, Any] = {"gamma": ("gamma", gamma, {"units": "1", "long_name": "thrust, in EI/L^2"})}
    if specimen is not None:
        thrust = specimen.scales.to_si("force", gamma)
        coordinates["thrust"] = ("gamma", thrust, {"units": unit_of("force"), "long_name": "thrust"})
    si = "" if specimen is None else "; thrust in N, *_curvature in 1/m"
    facts = {
        "title": "capacity of a strut",
        "leaves_from": _leaves_from(gamma, rows),
        "gamma_star": critical.gamma_star,
        "gamma_star_star": critical.gamma_star_star,
        "euler": critical.euler,
        "imperfection": imperfection,
        "conventions": "gamma in EI/L^2, curvatures in 1/L" + si,
        "sentence": " ".join([*critical.sentences, _words(gamma, rows, critical.gamma_star_star)]),
    }
    return xarray.Dataset(data, coords=coordinates, attrs=facts)


def _leaves_from(gamma: Array, rows: list[_Row]) -> float | None:
    """Return the least thrust under which a start was seen to leave."""
    return min((g for g, row in zip(gamma.tolist(), rows, strict=True) if math.isfinite(row.largest)), default=None)


def _words(gamma: Array, rows: list[_Row], opens: float | None) -> str:
    free = [g for g, row in zip(gamma.tolist(), rows, strict=True) if row.runs == 0]
    bounded = [(g, row) for g, row in zip(gamma.tolist(), rows, strict=True) if math.isfinite(row.largest)]
    words = f"Of {gamma.size} thrusts, {len(free)} have one interval of admissible shapes, in which every motion ends"
    if not bounded:
        return f"{words}; no imperfection that was tried under the others leaves the neighbourhood of the straight rod."
    least = min(bounded, key=lambda pair: pair[1].largest)
    smallest = f"the least of them {least[1].largest:.6g}/L at gamma = {least[0]:.6g}"
    words += f"; {len(bounded)} have a largest imperfection, {smallest}."
    first = min(g for g, _ in bounded)
    words += f" The least of these thrusts under which an imperfection leaves is gamma = {first:.6g}"
    if opens is not None and first < opens:
        return f"{words}, below gamma**: there are other shapes to stay in than those near the straight one."
    return f"{words}; nothing is said of thrusts between those that were computed."
