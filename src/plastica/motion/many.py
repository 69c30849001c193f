"""Many struts through time at once."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from plastica.errors import ArgumentError
from plastica.motion.itinerary import short_changes
from plastica.motion.members import Curvatures, Given, Thrusts, met_shapes, read_members
from plastica.motion.parts import Part, Settings, join, run_part
from plastica.motion.plan import Until, check_rtol
from plastica.numerics.arrays import Arrays, arrays_on
from plastica.numerics.grid import AUTO_NODES, LARGEST_SIZE
from plastica.numerics.stepper import WIDTH, Options
from plastica.physics.amounts import Amount, plain
from plastica.physics.strut import Strut
from plastica.units import quantity

if TYPE_CHECKING:
    import xarray

__all__ = ["Done", "solve_many"]

Array = NDArray[np.float64]

CHUNK: Final = 8192
"""Members that are under way or waiting at a time in one process: what the memory is bounded by."""

MOST_KEPT: Final = 1 << 23
"""Numbers that a chunk keeps of the states at the times asked for: 64 MB."""

ALSO: Final = ("curvature", "limit")
"""What is told only where it is asked for."""

MOST_STEPS: Final = 2000
"""Steps after which the batch gives a member up as too stiff."""

THREADS: Final = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "VECLIB_MAXIMUM_THREADS")
"""Where a worker process reads how many threads its BLAS may start."""


@dataclass(frozen=True)
class Done:
    """How far many runs have come: members done, members in all."""

    members: int
    of: int


def solve_many(
    strut: Strut,
    curvature: Curvatures = 0.0,
    natural_curvature: float | str | ArrayLike = 0.0,
    thrust: Thrusts | None = None,
    parameters: Mapping[str, Amount | ArrayLike] | None = None,
    until: Until = 100.0,
    rtol: float = 1e-8,
    atol: float | None = None,
    times: Sequence[float] | Array | None = None,
    *,
    thrust_factor: ArrayLike | None = None,
    shape_parameters: Mapping[str, ArrayLike] | None = None,
    also: Sequence[str] = (),
    chunk: int = CHUNK,
    workers: int = 1,
    library: str | None = None,
    device: Any = None,
    progress: Callable[[Done], None] | None = None,
) -> xarray.Dataset:
    """Integrate many struts that differ in first state, thrust and parameters, each with its own step.

    Whatever is given as an array (or list) has one entry for each member; what is given once holds for all. All
    members share the grid. A member that the batch cannot finish, because it is stiff or produces no numbers, is
    handed to `solve` afterwards; it neither holds up nor spoils the others. With NumPy what becomes of a member does
    not depend, to the last bit, on which others are computed beside it, in what order, or in how many processes.

    Parameters
    ----------
    strut : Strut
        The model, with one natural curvature. With ``Grid(nodes="auto")`` each member gets the smallest number of
        nodes that resolves its motion to `rtol`.
    curvature : number, text in s, function, Shape, nodal values; list of these; or array of shape (members, nodes)
        Initial curvature, as in `solve`. An array of shape (members, 1) holds uniform curvatures.
    natural_curvature : number, text with a unit, or array of shape (members,)
        Initial natural curvature.
    thrust : number, text, program, or one for each member; optional
        Takes the place of the thrust in the strut's load; the other loads act on every member. Give a table as
        ``pl.programs.table(times, values)``.
    parameters : mapping of str to number, text with a unit, or one for each member; optional
        Parameters of the material that differ from those of `strut`; arrays of numbers are in SI units where the
        material has units.
    until : number, or text with a unit
        Last time (s, or retardation times).
    rtol, atol : float
        Tolerances of each member, as in `solve`.
    times : sequence of float, optional
        Times at which the members are looked at, increasing; by default the last time only. No member is followed
        beyond the last of them.
    thrust_factor : number, or array of shape (members,); optional
        What the thrust of each member is multiplied by.
    shape_parameters : mapping of str to number or array, optional
        Values of the names in a text for `curvature`, such as a in "a*cos(3*s)", one for each member.
    also : sequence of str
        "curvature": the last curvature at the nodes; "limit": where each member ends, by `predict_limit` of its last
        state; "undecided" where that state is not yet held by one static shape.
    chunk : int
        Members that are dealt with at a time in a process; the memory needed grows with it.
    workers : int
        Processes. More than one needs the usual ``if __name__ == "__main__":`` in a script.
    library : str, optional
        "numpy", "numba", "cupy", "torch", "jax" or "array_api_strict"; by default that of the arrays given. "numba"
        is NumPy with the steps in machine code, twice as fast or more; it needs ``pip install "plastica[fast]"``.
    device : object, optional
        A device of the library, such as "cuda".
    progress : callable, optional
        Called with a `Done` whenever a chunk is done.

    Returns
    -------
    xarray.Dataset
        Over `member` (and `t`, where times are given): natural_curvature, drive, threshold, tip_x, tip_y, tip_angle,
        largest_angle, liapunov. Over `member`: time_reached, status (a code as in `Status`; "done" where it went
        well), method ("DOP853" in the batch, "LSODA" where solved singly), steps, nodes; and what `also` asks for. nan
        where a member did not come to a time. The attribute `notes` tells, where there is one, which changes of a load
        are too short to be followed.

    Raises
    ------
    ArgumentError
        Where an argument cannot be used. Numerical trouble is never raised: it is in `status`.

    Examples
    --------
    >>> import plastica as pl
    >>> material = pl.Material("k*m**2/2", "c*pos(x)**2", "h", {"k": 1.0, "c": 1.0, "h": 0.1})
    >>> strut = pl.Strut(material, pl.Load(), pl.Grid(nodes=16))
    >>> found = pl.solve_many(strut, "1 + cos(3*s)", thrust=[1.0, 2.0, 3.0], parameters={"k": [0.5, 1.0, 2.0]})
    >>> found.sizes["member"]
    3
    """
    _check(strut, also, chunk, workers)
    end, asked = _times(strut, until, times)
    check_rtol(rtol)
    arrays = arrays_on(library, device, curvature, natural_curvature, thrust, *(parameters or {}).values())
    if workers > 1 and not arrays.writable:
        raise ArgumentError("must be 1 with a library other than NumPy", where="workers", value=workers)
    settings = Settings(
        end if asked is None else float(asked[-1]),
        asked,
        float(rtol),
        _atol(atol),
        Options(_SHARE * float(rtol), MOST_STEPS, _width(arrays, int(chunk))),
        tuple(also),
    )

    def given(model: Strut) -> Given:
        return read_members(
            model, curvature, natural_curvature, thrust, thrust_factor, parameters, shape_parameters
        ).checked(settings.end)

    run = _Runs(settings, arrays, int(chunk), int(workers), progress)
    auto = strut.grid.nodes == "auto"
    if auto:
        curvature = met_shapes(curvature, strut)
    first = given(strut.with_grid(strut.grid.with_nodes(AUTO_NODES[0])) if auto else strut)
    part = _on_chosen_nodes(run, strut, first, given) if auto else run(first)
    return _dataset(strut, part, times, _short(first, settings.end, auto=auto))


def _short(given: Given, end: float, *, auto: bool) -> tuple[str, ...]:
    """What cannot be shown to be met of the loads and first states of any member."""
    struts = (given.strut.with_load(replace(given.strut.load, thrust=thrust)) for thrust in given.thrusts)
    loads = (note for each in struts for note in short_changes(each, 0.0, end))
    # Of nodes that are still chosen the status of each member tells.
    nodes = () if auto else given.narrow
    return tuple(dict.fromkeys((*nodes, *given.unbounded, *loads)))


def _width(arrays: Arrays, chunk: int) -> int:
    """Columns of a block: few where they should stay in the cache, which machine code sees to by itself."""
    if arrays.compiled:
        return 4 * WIDTH
    # A library on a device is best given all at once.
    return WIDTH if arrays.writable else max(WIDTH, chunk)


_SHARE: Final = 0.25
"""Share of the tolerance that one step may spend, as in `solve`."""


def _check(strut: Strut, also: Sequence[str], chunk: int, workers: int) -> None:
    if not isinstance(strut, Strut):
        raise ArgumentError("must be a pl.Strut", where="strut", value=strut, next_step="Take pl.solve for a pl.Rod.")
    if strut.segments != 1:
        rule = "must have one natural curvature (natural_segments=1)"
        raise ArgumentError(rule, where="strut", value=strut.segments, next_step="Take pl.solve for several segments.")
    if isinstance(also, str) or not set(also) <= set(ALSO):
        raise ArgumentError(f"must be a list of some of {', '.join(ALSO)}", where="also", value=also)
    if "curvature" in also and strut.grid.nodes == "auto":
        raise ArgumentError('must not ask for "curvature" where the number of nodes is open', where="also", value=also)
    for name, value in (("chunk", chunk), ("workers", workers)):
        if isinstance(value, bool) or not isinstance(value, (int, np.integer)) or value < 1:
            raise ArgumentError("must be a positive integer", where=name, value=value)


def _atol(atol: object) -> float | None:
    number = plain(atol)
    if atol is not None and not (isinstance(number, float) and 0.0 < number < np.inf):
        raise ArgumentError("must be a positive number or None", where="atol", value=atol)
    return None if atol is None else float(number)


def _times(strut: Strut, until: Until, times: ArrayLike | None) -> tuple[float, Array | None]:
    """The dimensionless end, and the times at which to look."""
    scale = strut.scales.time
    if isinstance(until, str) and strut.specimen is not None:
        seconds = quantity(until, "s", where="until", bare=False)
    else:
        seconds = plain(until)
    if not (isinstance(seconds, float) and 0.0 < seconds < np.inf):
        rule = "must be a time later than 0"
        next_step = 'For where a member ends, ask for also=["limit"].'
        raise ArgumentError(rule, where="until", value=until, next_step=next_step)
    if times is None:
        return seconds / scale, None
    try:
        asked = np.array(times, dtype=float)
    except (TypeError, ValueError):
        raise ArgumentError("must be a sequence of numbers", where="times", value=times) from None
    fine = asked.ndim == 1 and asked.size > 0 and bool(np.isfinite(asked).all())
    slack = 1.0 + 4.0 * float(np.finfo(float).eps)
    if not fine or np.any(np.diff(asked) <= 0.0) or asked[0] < 0.0 or asked[-1] > seconds * slack or asked[-1] <= 0.0:
        rule = f"must increase within [0, {seconds:g}], to a last one later than 0"
        raise ArgumentError(rule, where="times", value=np.asarray(times).tolist())
    return seconds / scale, asked / scale


@dataclass(frozen=True, eq=False)
class _Runs:
    """How the parts are run: in this process, or in several."""

    settings: Settings
    arrays: Arrays
    chunk: int
    workers: int
    progress: Callable[[Done], None] | None

    def __call__(self, given: Given, settings: Settings | None = None) -> Part:
        """Run all members, a chunk at a time, and join what came of them."""
        # As many chunks for each worker as for any other, so that none waits for the last.
        looks = 1 if self.settings.times is None else self.settings.times.size
        most = min(self.chunk, max(WIDTH, MOST_KEPT // (looks * (given.strut.grid.size + 1))))
        rounds = -(-given.count // (self.workers * most))
        chunk = -(-given.count // (self.workers * rounds))
        pieces = [given.part(i, min(i + chunk, given.count)) for i in range(0, given.count, chunk)]
        found, done = [], 0
        for piece, part in zip(pieces, self._parts(pieces, settings or self.settings), strict=True):
            found.append(part)
            done += piece.count
            if self.progress is not None:
                self.progress(Done(done, given.count))
        return join(found)

    def _parts(self, pieces: Sequence[Given], settings: Settings) -> Iterator[Part]:
        if self.workers == 1 or len(pieces) == 1:
            yield from (run_part(piece, settings, self.arrays) for piece in pieces)
            return
        from concurrent.futures import ProcessPoolExecutor
        from concurrent.futures.process import BrokenProcessPool
        from multiprocessing import get_context

        with _one_thread_each(), ProcessPoolExecutor(min(self.workers, len(pieces)), get_context("spawn")) as pool:
            try:
                yield from pool.map(_in_worker, pieces, [settings] * len(pieces), [self.arrays.name] * len(pieces))
            except BrokenProcessPool:
                raise ArgumentError(
                    "must be processes that can start and stay alive, and one did not",
                    where="workers",
                    value=self.workers,
                    next_step='Call from a script under `if __name__ == "__main__":`, and see that memory suffices.',
                ) from None


def _in_worker(given: Given, settings: Settings, library: str) -> Part:
    return run_part(given, settings, arrays_on(library, None))


@contextmanager
def _one_thread_each() -> Iterator[None]:
    """Let processes that start meanwhile have one thread each: their matrices are small."""
    before = {name: os.environ.get(name) for name in THREADS}
    os.environ.update(dict.fromkeys(THREADS, "1"))
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value


def _on_chosen_nodes(run: _Runs, strut: Strut, first: Given, given: Callable[[Strut], Given]) -> Part:
    """Give each member the smallest number of nodes that resolves its motion, the first that are tried being few."""
    elements = first.strut.grid.elements
    candidates = [nodes for nodes in AUTO_NODES if nodes * elements <= LARGEST_SIZE] or [AUTO_NODES[0]]
    part = run(first, replace(run.settings, watch=len(candidates) > 1))
    for nodes in candidates[1:]:
        left = np.flatnonzero(part.too_coarse)
        if left.size == 0:
            break
        members = given(strut.with_grid(strut.grid.with_nodes(nodes))).chosen(left)
        part = part.with_members(left, run(members, replace(run.settings, watch=nodes != candidates[-1])))
    return part


def _dataset(strut: Strut, part: Part, times: ArrayLike | None, notes: tuple[str, ...]) -> xarray.Dataset:
    import xarray

    from plastica.motion.told import coordinates, variables

    attributes = {
        "title": "motions of many struts whose natural curvature evolves",
        "conventions": "SI" if strut.specimen is not None else "dimensionless: lengths in L, forces in EI/L^2",
    }
    if notes:
        attributes["notes"] = "; ".join(notes)
    told = variables(strut, part, over_time=times is not None)
    return xarray.Dataset(told, coordinates(strut, part, times), attributes)
