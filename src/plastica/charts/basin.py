"""Which limit each of many starts reaches."""

from __future__ import annotations

import time as clock
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from plastica.charts.starts import NODES, interval_of, read_shape, scaled, straight_interval
from plastica.equilibria.catalog import equilibria
from plastica.equilibria.equilibrium_set import EquilibriumSet
from plastica.equilibria.limits import Limit
from plastica.errors import ArgumentError
from plastica.motion.longtime import omega_limit
from plastica.numerics.grid import Grid
from plastica.physics.model import Model
from plastica.physics.scales import unit_of
from plastica.physics.strut import Strut, uniform_strut

if TYPE_CHECKING:
    import xarray

__all__ = ["Basin", "basin"]

Array = NDArray[np.float64]

MOST_STARTS = 100_000

NO_INTERVAL = -9999
"""`interval` of a start whose limit could not be told, or lies in no interval."""


@dataclass(frozen=True, eq=False)
class Basin:
    """The limits of a grid of starts (amplitude * shape, natural curvature).

    Everything here is dimensionless; the dataset is in SI with a specimen.

    Attributes
    ----------
    strut : Strut
        The rod under its constant thrust.
    shape : str
        The shape of the initial curvature, as written.
    amplitude, natural_curvature : ndarray, shapes (n,) and (m,)
        The starts.
    alpha : ndarray, shape (n, m)
        Clamp curvature of the limit; nan where it could not be told.
    kind : ndarray of str, shape (n, m)
        "interior", "limiting" or "undecided".
    stable : ndarray of bool, shape (n, m)
        Whether the limit is known to be stable.
    interval : ndarray of int, shape (n, m)
        In which interval of the admissible set the limit lies: 0 that of the straight rod, 1, 2, ... above and -1,
        -2, ... below it; -9999 where it could not be told, or is in none.
    equilibria : EquilibriumSet
        All equilibria under this thrust.
    wall : float
        Seconds taken.
    """

    strut: Strut
    shape: str
    amplitude: Array
    natural_curvature: Array
    alpha: Array
    kind: NDArray[np.str_]
    stable: NDArray[np.bool_]
    interval: NDArray[np.int64]
    equilibria: EquilibriumSet
    wall: float

    def to_dataset(self) -> xarray.Dataset:
        """Return the limits as labelled arrays over amplitude and natural_curvature: SI with a specimen."""
        import xarray

        scales, bare = self.strut.scales, self.strut.specimen is None
        unit = unit_of("curvature", bare)
        plane = ("amplitude", "natural_curvature")
        alpha = scales.to_si("curvature", self.alpha)
        data: dict[str, Any] = {
            "alpha": (plane, alpha, {"units": unit, "long_name": "clamp curvature of the limit"}),
            "kind": (plane, self.kind, {"long_name": "kind of the limit"}),
            "stable": (plane, self.stable, {"units": "1", "long_name": "whether the limit is known to be stable"}),
            "interval": (plane, self.interval, {"units": "1", "long_name": "admissible interval of the limit"}),
        }
        starts = {
            "amplitude": ("amplitude", "factor of the shape of the initial curvature", self.amplitude),
            "natural_curvature": ("natural_curvature", "initial natural curvature", self.natural_curvature),
        }
        coordinates = {
            name: (dim, scales.to_si("curvature", value), {"units": unit, "long_name": words})
            for name, (dim, words, value) in starts.items()
        }
        facts = {
            "title": "basins of the limits of a strut",
            "gamma": self.equilibria.gamma,
            "shape": self.shape,
            "intervals": np.array(self.equilibria.intervals, dtype=float).ravel(),
            "sentence": str(self),
        }
        return xarray.Dataset(data, coords=coordinates, attrs=facts)

    @property
    def dataset(self) -> xarray.Dataset:
        """The same as `to_dataset()`."""
        return self.to_dataset()

    def __str__(self) -> str:
        size = self.alpha.size
        lines = [f"{size} starts under gamma = {self.equilibria.gamma:.6g} ({self.wall:.1f} s):"]
        for number in np.unique(self.interval):
            chosen = self.interval == number
            if number == NO_INTERVAL:
                lines.append(f"  {int(chosen.sum())} end where it cannot be told")
                continue
            where = "near the straight rod" if number == 0 else f"in interval {number:+d}"
            spread = self.alpha[chosen]
            lines.append(f"  {int(chosen.sum())} end {where}, alpha in [{spread.min():.6g}, {spread.max():.6g}]")
        return "\n".join(lines)


def basin(
    strut: Model,
    shape: str = "cos(pi*s/2)",
    amplitude: ArrayLike = 0.0,
    natural_curvature: ArrayLike = 0.0,
    *,
    rtol: float = 1e-8,
    progress: Callable[[int, int], None] | None = None,
) -> Basin:
    """Find the limit of every start (amplitude * shape, natural curvature) of a grid.

    Each motion converges to one equilibrium (claim 7), which `omega_limit` tells.

    Parameters
    ----------
    strut : Strut or Rod
        The rod, of one natural segment and without inertia, under a constant thrust. ``Grid(nodes="auto")`` becomes
        24 nodes.
    shape : str
        Shape of the initial curvature: text in s (in m with a specimen, else in units of L).
    amplitude : array_like
        Factors of the shape; in 1/m with a specimen, for a shape that is written as a plain number.
    natural_curvature : array_like
        Initial natural curvatures, in 1/m with a specimen, else in 1/L.
    rtol : float
        Tolerance of the runs.
    progress : callable, optional
        Called with the number of starts done and of all.

    Returns
    -------
    Basin

    Raises
    ------
    ArgumentError
        Where an argument cannot be used, or the load is not a constant thrust.

    Notes
    -----
    Cost: about 20 ms for each start, more near the border of a basin, where motions are slow.

    Checked by test_basins_part_at_the_edge.
    """
    strut = uniform_strut(strut, "strut")
    if not strut.load.is_constant or {name for name, _ in strut.loads.sources()} - {"thrust"}:
        raise ArgumentError("must be a constant thrust alone", where="load", value=strut.load)
    sizes, naturals = _numbers(amplitude, "amplitude"), _numbers(natural_curvature, "natural_curvature")
    if sizes.size * naturals.size > MOST_STARTS:
        raise ArgumentError(f"must come to at most {MOST_STARTS} starts", where="amplitude", value=sizes.size)
    if strut.grid.nodes == "auto":
        strut = strut.with_grid(Grid(NODES, strut.grid.breaks))
    written, _ = read_shape(shape, strut, "shape")
    found = equilibria(strut.material, float(strut.loads.thrust(0.0)), specimen=strut.specimen)
    straight_interval(found)
    began = clock.perf_counter()
    limits: list[Limit] = []
    for size in sizes.tolist():
        for natural in naturals.tolist():
            limits.append(omega_limit(strut, scaled(written, size, strut), natural, rtol=rtol))
            if progress is not None:
                progress(len(limits), sizes.size * naturals.size)
    return _basin(strut, shape, (sizes, naturals), limits, found, clock.perf_counter() - began)


def _numbers(given: ArrayLike, where: str) -> Array:
    try:
        values = np.atleast_1d(np.asarray(given, dtype=float))
    except (TypeError, ValueError):
        raise ArgumentError("must be numbers", where=where, value=given) from None
    if values.ndim != 1 or not values.size or not np.isfinite(values).all():
        raise ArgumentError("must be a list of finite numbers", where=where, value=given)
    return values


def _basin(
    strut: Strut, shape: str, starts: tuple[Array, Array], limits: list[Limit], found: EquilibriumSet, wall: float
) -> Basin:
    size = (starts[0].size, starts[1].size)
    ends = [None if limit.equilibrium is None else limit.equilibrium.alpha for limit in limits]
    inside = [None if a is None else interval_of(found, a) for a in ends]
    numbers = [NO_INTERVAL if number is None else number for number in inside]
    length = strut.scales.length
    return Basin(
        strut,
        shape,
        starts[0] * length,
        starts[1] * length,
        np.array([np.nan if a is None else a for a in ends]).reshape(size),
        np.array([limit.kind for limit in limits], dtype=str).reshape(size),
        np.array([limit.stable is True for limit in limits]).reshape(size),
        np.array(numbers).reshape(size),
        found,
        wall,
    )
