"""Take one model through time."""

from __future__ import annotations

import time as clock
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import scipy
from numpy.typing import NDArray

from plastica._version import __version__
from plastica.errors import ArgumentError
from plastica.motion.checkpoint import Checkpoint, fingerprint
from plastica.motion.history import History
from plastica.motion.integrate import Leg, Options, Stop, integrate
from plastica.motion.plan import (
    Plan,
    Problem,
    Until,
    landing_points,
    longest_step,
    make_plan,
    make_problem,
    rest,
)
from plastica.motion.resolution import too_coarse
from plastica.motion.solution import Solution
from plastica.motion.status import Counts, Status, status
from plastica.motion.store import strut_to_dict
from plastica.numerics.grid import AUTO_NODES, LARGEST_SIZE, Grid
from plastica.physics.initial import Curvature
from plastica.physics.kernel import Kernel
from plastica.physics.strut import Strut

__all__ = ["Progress", "Until", "solve"]

Array = NDArray[np.float64]

MOST_STEPS = 200_000

STEP_SHARE = 0.25
"""Share of the tolerance that one step may spend: rods that creep through a bottleneck amplify what they are given. It
brings the largest error over the reference motions from 89 to 23 rtol, at 10 to 20 % more evaluations."""

SMALLEST_RTOL = 100.0 * float(np.finfo(float).eps)
"""What SciPy's solvers take at the least."""

LEG_STEPS = 2000
"""Steps after which a leg ends in any case, so that a long run has places to be taken up again."""


@dataclass(frozen=True)
class Progress:
    """Where a run has got to: time and last time (user's units), steps, whether the rod yields, wall seconds."""

    t: float
    until: float | None
    steps: int
    yielding: bool
    wall: float


def solve(
    model: Strut,
    curvature: Curvature = 0.0,
    natural_curvature: float | str = 0.0,
    until: Until = 100.0,
    rtol: float = 1e-8,
    atol: float | None = None,
    method: str = "auto",
    times: Sequence[float] | Array | None = None,
    *,
    start: Solution | None = None,
    max_steps: int = MOST_STEPS,
    progress: Callable[[Progress], None] | None = None,
    checkpoint: str | Path | None = None,
    checkpoint_every: float = 5.0,
    resume: bool = False,
) -> Solution:
    """Integrate a model from an initial shape, with its ledger.

    Parameters
    ----------
    model : Strut
        The rod, its material, load and grid. With ``Grid(nodes="auto")`` the smallest number of nodes is taken that
        resolves the whole motion to `rtol`.
    curvature : number, text in s, function, Shape or nodal values
        Initial curvature, in 1/m with a specimen, else in units of 1/L. Element ends are added at its jumps.
    natural_curvature : number, or text with a unit
        Initial natural curvature, likewise.
    until : number, text with a unit, or "equilibrium"
        Last time (s, or retardation times). "equilibrium" goes on until the rod is at rest, or until it creeps so
        slowly that stepping in time has become pointless; the status says which.
    rtol : float
        Relative tolerance of the time integration, in [1e-13, 1e-2].
    atol : float, optional
        Absolute tolerance on the curvatures, in their units. By default 1e-3 rtol times the initial amplitude
        (at most times one), so that a start from 1e-6 comes out right.
    method : str
        "LSODA", "DOP853", "Radau", "BDF", or "auto", which is LSODA: the fastest at equal error in all cases measured.
    times : sequence of float, optional
        Times of the dataset, increasing; by default the accepted steps.
    start : Solution, optional
        Go on from the last state of this solution, whose clock goes on too; `curvature` and `natural_curvature` are
        then not used. This is how a rod is held, then released.
    max_steps : int
        Steps after which the run gives up, keeping what it has.
    progress : callable, optional
        Called now and then with a `Progress`.
    checkpoint : str or Path, optional
        Folder (made if need be) for the finished part of the run, so that a killed run can be taken up again.
    checkpoint_every : float
        Wall seconds between two checkpoints.
    resume : bool
        Take up what the checkpoint holds. The result equals that of an uninterrupted run to the last bit.

    Returns
    -------
    Solution
        With whatever was computed, and a status that says how it ended.

    Raises
    ------
    ArgumentError
        Where an argument cannot be used.
    FileError
        Where the checkpoint cannot be written, or belongs to another run. Numerical trouble is never raised: it is
        in `Solution.status`.

    Examples
    --------
    >>> import plastica as pl
    >>> material = pl.Material("k*m**2/2", "c*pos(x)**2", "h", {"k": 1.0, "c": 1.0, "h": 0.1})
    >>> strut = pl.Strut(material, pl.Load(thrust=3.0), pl.Grid(nodes=16))
    >>> sol = pl.solve(strut, curvature="1 + cos(3*s)", until=100.0)
    >>> sol.status.code
    'done'
    """
    if not isinstance(model, Strut):
        raise ArgumentError("must be a pl.Strut", where="model", value=model)
    plan = make_plan(model, until, rtol, method, times, start, max_steps)
    keeping = None if checkpoint is None else _Keeping(Path(checkpoint), float(checkpoint_every), resume)
    if model.grid.nodes != "auto":
        problem = make_problem(model, plan, curvature, natural_curvature, atol, start)
        solution = _run(problem, plan, progress, keeping)
    else:
        solution = _choose_nodes(model, plan, curvature, natural_curvature, atol, start, progress, keeping)
    return _told_where_it_ends(solution) if plan.settle else solution


def _told_where_it_ends(solution: Solution) -> Solution:
    """A run that was to go on until rest says what it stopped short of, or that it rests where it cannot stay."""
    limit = solution.limit if solution.status.ok else None
    if limit is None or limit.equilibrium is None:
        return solution
    sentence = solution.status.sentence
    if solution.status.code == "creeping":
        sentence += f" {limit.sentence}"
    elif not limit.stable:
        sentence += " But it is unstable there: the least disturbance would set it off."
    return replace(solution, status=replace(solution.status, sentence=sentence))


@dataclass(frozen=True)
class _Keeping:
    """Where and how often a run is kept, and whether a former one is taken up."""

    folder: Path
    every: float
    resume: bool

    def open(self, problem: Problem, plan: Plan) -> tuple[Checkpoint, list[Leg]]:
        described = {
            "model": strut_to_dict(problem.strut),
            "plan": [plan.t0, plan.end, plan.settle, plan.rtol, plan.method, plan.max_steps],
            "versions": [__version__, np.__version__, scipy.__version__],
        }
        identity = fingerprint(described, problem.y0, problem.atol)
        checkpoint = Checkpoint(self.folder, identity, every=self.every)
        if self.resume:
            return checkpoint, checkpoint.load()
        checkpoint.clear(keep_folder=True)
        return checkpoint, []


def _run(
    problem: Problem,
    plan: Plan,
    progress: Callable[[Progress], None] | None,
    keeping: _Keeping | None,
    give_up: Stop | None = None,
) -> Solution:
    began = clock.perf_counter()
    strut = problem.strut
    options = Options(
        plan.method,
        max(STEP_SHARE * plan.rtol, SMALLEST_RTOL),
        STEP_SHARE * problem.atol,
        leg_steps=LEG_STEPS,
        most_steps=plan.max_steps,
        longest_step=longest_step(strut, plan),
    )
    t, y, moving = plan.t0, problem.y0, None
    checkpoint, legs = (None, []) if keeping is None else keeping.open(problem, plan)
    if legs:
        t, y, moving = legs[-1].history.end, legs[-1].history.y[-1], legs[-1].moving_next
    steps = sum(leg.history.steps for leg in legs)
    fresh: Iterator[Leg] = iter(())
    if t < plan.end and steps < plan.max_steps and (not legs or legs[-1].ending in ("landed", "switched", "full")):
        landing = (t, *(knot for knot in landing_points(strut, plan.end) if t < knot < plan.end), plan.end)
        fresh = integrate(
            strut, y, landing, options, moving=moving, taken=steps, stop=_stop(problem, plan, legs, give_up)
        )
    said = began
    for leg in fresh:
        legs.append(leg)
        steps += leg.history.steps
        if checkpoint is not None:
            checkpoint.keep(leg)
        now = clock.perf_counter()
        if progress is not None and now - said > 0.1:
            said = now
            scale = strut.scales.time
            until = None if plan.settle else plan.end * scale
            progress(Progress(leg.history.end * scale, until, steps, leg.moving_next, now - began))
    if checkpoint is not None:
        checkpoint.flush()
    return _solution(problem, plan, legs, clock.perf_counter() - began)


def _stop(problem: Problem, plan: Plan, legs: Sequence[Leg], give_up: Stop | None) -> Stop | None:
    """What ends a run early: rest where it is asked for, and the reason to give up where there is one."""
    if not plan.settle:
        return give_up
    n = problem.strut.grid.size
    met = [problem.y0[None, :], *(leg.history.y[leg.history.accepted] for leg in legs)]
    resting = rest(plan, problem, max(float(np.abs(y[:, : n + 1]).max()) for y in met))
    if give_up is None:
        return resting
    return lambda t, y, kern: resting(t, y, kern) or give_up(t, y, kern)


def _status(plan: Plan, legs: Sequence[Leg], steps: int, strut: Strut) -> Status:
    last = legs[-1]
    unit = "s" if strut.specimen is not None else "retardation times"
    t = f"{last.history.end * strut.scales.time:.6g} {unit}"
    reason = last.message.rstrip(".") or "no reason given"
    return status(_code(plan, last), t=t, method=plan.method, steps=steps, reason=reason)


def _code(plan: Plan, last: Leg) -> str:
    if last.ending in ("solver_failed", "not_finite"):
        return last.ending
    if last.ending == "stopped":
        return "creeping" if last.moving_next else "equilibrium"
    if last.history.end < plan.end:
        return "step_limit"
    return "never_settled" if plan.settle else "done"


def _solution(problem: Problem, plan: Plan, legs: Sequence[Leg], wall: float) -> Solution:
    history = History.join([leg.history for leg in legs])
    counts = Counts(
        history.steps,
        sum(leg.rates for leg in legs),
        sum(leg.jacobians for leg in legs),
        max(len(legs) - 1, 0),
    )
    starts = np.array([leg.history.start for leg in legs])
    moving = np.array([leg.moving for leg in legs])
    ends_moving = legs[-1].moving_next
    return Solution(
        model=problem.strut,
        history=history,
        legs=(starts, np.append(moving, ends_moving)),
        status=_status(plan, legs, history.steps, problem.strut),
        counts=counts,
        method=plan.method,
        rtol=plan.rtol,
        atol=float(problem.atol[0]),
        times=_reached(plan.times, history),
        initial=problem.words,
        notes=problem.notes,
        wall=wall,
    )


def _reached(times: Array | None, history: History) -> Array | None:
    if times is None:
        return None
    return times[times <= history.end]


def _choose_nodes(
    model: Strut,
    plan: Plan,
    curvature: Curvature,
    natural_curvature: float | str,
    atol: float | None,
    start: Solution | None,
    progress: Callable[[Progress], None] | None,
    keeping: _Keeping | None,
) -> Solution:
    """Solve with more and more nodes until the Legendre coefficients of the whole motion have decayed."""
    tried: list[str] = []
    size = 0
    for nodes in AUTO_NODES:
        if nodes * size > LARGEST_SIZE:
            break
        here = None
        if keeping is not None:
            keeping.folder.mkdir(exist_ok=True)
            here = replace(keeping, folder=keeping.folder / f"nodes-{nodes}")
        grid = Grid(nodes, model.grid.breaks)
        problem = make_problem(model.with_grid(grid), plan, curvature, natural_curvature, atol, start)
        size = problem.strut.grid.elements
        shortfall = too_coarse(problem.strut, problem.y0[None, :], plan.rtol)
        if shortfall is None:
            solution = _run(problem, plan, progress, here, _coarse(problem, plan))
            shortfall = too_coarse(problem.strut, solution.history.y[solution.history.accepted], plan.rtol)
            if shortfall is None:
                why = "the last Legendre coefficients of curvature and load stay below rtol times their size throughout"
                fewer = f"; too few: {', '.join(tried)}" if tried else ""
                chosen = f"{nodes} nodes per element chosen: {why}{fewer}"
                return replace(solution, notes=(*solution.notes, chosen))
        tried.append(f"{nodes} ({shortfall:.0e})")
    solution = _run(problem, plan, progress, here)
    tail = f"leave a Legendre tail of {shortfall:.0e}: add breaks"
    most = f"{problem.strut.grid.per_element} nodes per element, the most tried, {tail}"
    return replace(solution, notes=(*solution.notes, most))


def _coarse(problem: Problem, plan: Plan) -> Stop:
    """Give up a run as soon as its grid is seen to be too coarse, which is cheaper to see at every tenth step."""
    n, steps, size = problem.strut.grid.size, 0, 0.0

    def coarse(t: float, y: Array, kern: Kernel) -> bool:
        nonlocal steps, size
        steps, size = steps + 1, max(size, float(np.abs(y[:n]).max()))
        return steps % 10 == 0 and too_coarse(problem.strut, y[None, :], plan.rtol, size) is not None

    return coarse
