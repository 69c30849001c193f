"""Take one model through time."""

from __future__ import annotations

import time as clock
from collections.abc import Callable, Iterator, Sequence
from contextlib import closing, nullcontext
from dataclasses import dataclass, replace
from os import PathLike
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from plastica.errors import ArgumentError
from plastica.motion.history import History
from plastica.motion.integrate import Leg, Options, Stop, integrate
from plastica.motion.itinerary import itinerary
from plastica.motion.keeping import Keeping, keeping_in
from plastica.motion.plan import Plan, Problem, Until, make_plan, make_problem, met_start, rest
from plastica.motion.record import Counts
from plastica.motion.resolution import coarse, on_given_nodes
from plastica.motion.retention import Retention
from plastica.motion.solution import Solution
from plastica.numerics.grid import AUTO_NODES, LARGEST_SIZE, Grid
from plastica.physics.initial import Curvature, NaturalCurvature
from plastica.physics.model import Model
from plastica.physics.resolution import too_coarse
from plastica.physics.status import Status, status

__all__ = ["Progress", "Until", "solve"]

Array = NDArray[np.float64]

MOST_STEPS = 200_000
TOLD_EVERY = 0.1  # seconds between two words on the progress of a run

STEP_SHARE = 0.25
"""Share of the tolerance that one step may spend: rods that creep through a bottleneck amplify what they are given. It
brings the largest error over the reference motions from 89 to 23 rtol, at 10 to 20 % more evaluations."""

BDF_SHARE = 0.05
"""The same for SciPy's BDF, whose steps add up to more: the ledger then balances as well as with the other methods."""

SMALLEST_RTOL = 100.0 * float(np.finfo(float).eps)
"""What SciPy's solvers take at the least."""

LEG_STEPS = 2000
"""Steps after which a leg ends in any case, so that a long run has places to be taken up again."""


THINNED = "of so long a run only the states at and next to its times are kept; pictures show the nearest ones"


@dataclass(frozen=True)
class Progress:
    """Where a run has got to: time and last time (user's units), steps, whether the rod yields, wall seconds."""

    t: float
    until: float | None
    steps: int
    yielding: bool
    wall: float


def solve(
    model: Model,
    curvature: Curvature = 0.0,
    natural_curvature: NaturalCurvature = 0.0,
    until: Until = 100.0,
    rtol: float = 1e-8,
    atol: float | None = None,
    method: str = "auto",
    times: Sequence[float] | Array | None = None,
    *,
    curvature_rate: Curvature = 0.0,
    start: Solution | None = None,
    max_steps: int = MOST_STEPS,
    progress: Callable[[Progress], None] | None = None,
    checkpoint: str | PathLike[str] | None = None,
    checkpoint_every: float = 5.0,
    resume: bool = False,
) -> Solution:
    """Integrate a model from an initial shape, with its ledger.

    Parameters
    ----------
    model : Strut or Rod
        The rod, its material, load and grid. With ``Grid(nodes="auto")`` the smallest number of nodes is taken that
        resolves the whole motion to `rtol`.
    curvature : number, text in s, function, Shape or nodal values
        Initial curvature, in 1/m with a specimen, else in units of 1/L. Element ends are added at its jumps.
    natural_curvature : number, or text with a unit, or a sequence of these
        Initial natural curvature, likewise; with several segments one for all of them, or one for each.
    until : number, text with a unit, or "equilibrium"
        Last time (s, or retardation times). "equilibrium" goes on until the rod is at rest, or until it creeps so
        slowly that stepping in time has become pointless; the status says which.
    rtol : float
        Relative tolerance of the time integration, in [1e-13, 1e-2].
    atol : float, optional
        Absolute tolerance on the curvatures, in their units. By default 1e-3 rtol times the initial amplitude
        (at most times one), so that a start from 1e-6 comes out right.
    method : str
        SciPy's "LSODA", "DOP853", "Radau" or "BDF"; "Gauss", collocation in time that conserves energy; or "auto", the
        fastest at equal error of those that never failed in the cases measured: LSODA for a strut, BDF for a rod with
        inertia, Gauss for one with little or no damping.
    times : sequence of float, optional
        Times of the dataset, increasing; by default the accepted steps.
    curvature_rate : number, text in s, function, Shape or nodal values
        Initial rate of curvature of a rod with inertia, in 1/(m s) or 1/(L T); a strut has none of its own.
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
        Where the checkpoint cannot be written, is in use by another process, or belongs to another run. Numerical
        trouble is never raised: it is in `Solution.status`.

    Examples
    --------
    >>> import plastica as pl
    >>> material = pl.Material("k*m**2/2", "c*pos(x)**2", "h", {"k": 1.0, "c": 1.0, "h": 0.1})
    >>> strut = pl.Strut(material, pl.Load(thrust=3.0), pl.Grid(nodes=16))
    >>> sol = pl.solve(strut, curvature="1 + cos(3*s)", until=100.0)
    >>> sol.status.code
    'done'
    """
    if not isinstance(model, Model):
        raise ArgumentError("must be a pl.Strut or a pl.Rod", where="model", value=model)
    plan = make_plan(model, until, rtol, method, times, start, max_steps)
    keeping = keeping_in(checkpoint, checkpoint_every, resume)
    given = _Given(curvature, natural_curvature, atol, start, curvature_rate)
    with nullcontext() if keeping is None else keeping.held():
        if model.grid.nodes != "auto":
            problem = make_problem(model, plan, *given)
            solution = on_given_nodes(_solution(problem, plan, _run(problem, plan, progress, keeping)), problem.missed)
        else:
            solution = _choose_nodes(model, plan, given, progress, keeping)
    return _told_where_it_ends(solution) if plan.settle else solution


class _Given(NamedTuple):
    """What `make_problem` makes a first state and tolerances of, on one grid or several."""

    curvature: Curvature
    natural_curvature: NaturalCurvature
    atol: float | None
    start: Solution | None
    curvature_rate: Curvature


def _told_where_it_ends(solution: Solution) -> Solution:
    """A run that was to go on until rest says what it stopped short of, or that it rests where it cannot stay."""
    code, limit = solution.status.code, solution.limit if solution.status.ok else None
    told = None if limit is None or limit.equilibrium is None else limit
    said = ""
    if code == "creeping" and told is not None:
        said = f" {told.sentence}"
    elif code == "equilibrium" and not (_rests_stably(solution) if told is None else told.stable):
        said = " But it is unstable there: the least disturbance would set it off."
    return replace(solution, status=replace(solution.status, sentence=solution.status.sentence + said))


def _rests_stably(solution: Solution) -> bool:
    """Whether the last state, at rest under loads that have become constant, is a stable shape."""
    from plastica.equilibria.at_rest import held_load
    from plastica.equilibria.statics import unstable_directions

    model, end = solution.model, solution.history.end
    held = model.with_load(held_load(model.load, end * model.scales.time))
    state = solution.history.y[-1]
    return unstable_directions(held, model.layout.mu(state), model.layout.natural(state)) == 0


@dataclass(frozen=True, eq=False)
class _Ran:
    """Legs of a run, and the wall seconds that those computed now have taken."""

    kept: Retention
    history: History
    wall: float

    @property
    def legs(self) -> list[Leg]:
        return self.kept.legs

    @property
    def too_coarse(self) -> bool:
        return self.legs[-1].ending == "too_coarse"


def _run(
    problem: Problem,
    plan: Plan,
    progress: Callable[[Progress], None] | None,
    keeping: Keeping | None,
    *,
    watch_nodes: bool = False,
) -> _Ran:
    began = said = clock.perf_counter()
    checkpoint, former = (None, ()) if keeping is None else keeping.open(problem, plan)
    times, scale = plan.times, problem.strut.scales.time
    until = None if plan.settle else plan.end * scale
    folder = None if keeping is None else keeping.folder
    with closing(Retention(problem.strut, None if times is None else times / scale, folder)) as kept:
        for leg in former:
            kept.add(leg)
        try:
            for leg in _fresh(problem, plan, kept, watch_nodes=watch_nodes):
                # What gave up for want of nodes is not part of the motion, and must not be taken up as such.
                if checkpoint is not None and leg.ending != "too_coarse":
                    checkpoint.keep(leg)
                kept.add(leg)
                now = clock.perf_counter()
                if progress is not None and now - said > TOLD_EVERY:
                    said = now
                    end = leg.history.end * scale
                    progress(Progress(end, until, kept.steps, any(leg.moving_next), now - began))
        finally:
            # An interrupt, too, leaves every finished leg to be taken up.
            if checkpoint is not None:
                checkpoint.flush()
        return _Ran(kept, kept.history(), clock.perf_counter() - began)


def _fresh(problem: Problem, plan: Plan, kept: Retention, *, watch_nodes: bool) -> Iterator[Leg]:
    """Legs that are still to be computed after those that are there."""
    t, y, moving, legs = plan.t0, problem.y0, None, kept.legs
    if legs:
        t, y, moving = legs[-1].history.end, legs[-1].history.y[-1], legs[-1].moving_next
    taken = kept.steps
    unfinished = not legs or legs[-1].ending in ("landed", "switched", "full")
    if not (unfinished and t < plan.end and taken < plan.max_steps):
        return iter(())
    share = BDF_SHARE if plan.method == "BDF" else STEP_SHARE
    options = Options(
        plan.method,
        max(share * plan.rtol, SMALLEST_RTOL),
        share * problem.atol,
        leg_steps=LEG_STEPS,
        most_steps=plan.max_steps,
    )
    stop = _stop(problem, plan, np.maximum(kept.met, np.abs(problem.y0)), watch_nodes=watch_nodes)
    stretches = itinerary(problem.strut, t, plan.end)
    return integrate(problem.strut, y, stretches, options, moving=moving, taken=taken, stop=stop)


def _stop(problem: Problem, plan: Plan, met: Array, *, watch_nodes: bool) -> Stop | None:
    """What ends a run early: too few nodes where these are being chosen, and rest where that is asked for."""
    n, natural = problem.strut.layout.nodes, problem.strut.layout.natural_columns
    criteria: list[Stop] = []
    if watch_nodes:
        criteria.append(coarse(problem.strut, plan.rtol, float(met[:n].max())))
    if plan.settle:
        criteria.append(rest(plan, problem, float(met[: natural.stop].max())))
    if not criteria:
        return None
    return lambda t, y, kern: next((ending for each in criteria if (ending := each(t, y, kern))), None)


def _status(plan: Plan, legs: Sequence[Leg], steps: int, strut: Model) -> Status:
    last = legs[-1]
    t = f"{last.history.end * strut.scales.time:.6g} {strut.time_unit}"
    reason = last.message.rstrip(".") or "no reason given"
    return status(_code(plan, last), t=t, method=plan.method, steps=steps, reason=reason)


def _code(plan: Plan, last: Leg) -> str:
    if last.ending in ("solver_failed", "not_finite"):
        return last.ending
    if last.ending == "at_rest":
        return "creeping" if any(last.moving_next) else "equilibrium"
    if last.history.end < plan.end:
        return "step_limit"
    return "never_settled" if plan.settle else "done"


def _solution(problem: Problem, plan: Plan, ran: _Ran) -> Solution:
    legs, history = ran.legs, ran.history
    counts = Counts(
        ran.kept.steps,
        sum(leg.rates for leg in legs),
        sum(leg.jacobians for leg in legs),
        max(len(legs) - 1, 0),
    )
    starts = np.array([leg.history.start for leg in legs])
    moving = np.array([*(leg.moving for leg in legs), legs[-1].moving_next])
    return Solution(
        model=problem.strut,
        history=history,
        legs=(starts, moving[:, 0] if problem.strut.segments == 1 else moving),
        status=_status(plan, legs, counts.steps, problem.strut),
        counts=counts,
        method=plan.method,
        rtol=plan.rtol,
        atol=float(problem.atol[0]),
        times=_reached(plan.times, history, problem.strut.scales.time),
        initial=problem.words,
        notes=problem.notes if ran.kept.whole else (*problem.notes, THINNED),
        wall=ran.wall,
        first_natural=problem.first_natural,
    )


def _reached(times: Array | None, history: History, scale: float) -> Array | None:
    """Times asked for that the run has come to, in the user's units."""
    if times is None:
        return None
    slack = 1.0 + 4.0 * float(np.finfo(float).eps)
    return np.asarray(times[times / scale <= history.end * slack])


def _choose_nodes(
    model: Model,
    plan: Plan,
    given: _Given,
    progress: Callable[[Progress], None] | None,
    keeping: Keeping | None,
) -> Solution:
    """Solve with more and more nodes until the Legendre coefficients of the whole motion have decayed."""
    if keeping is not None:
        keeping.fresh()
    curvature, rate = met_start(model, given.curvature, given.curvature_rate)
    given, tried = given._replace(curvature=curvature, curvature_rate=rate), list[str]()
    coarsest = make_problem(model.with_grid(model.grid.with_nodes(AUTO_NODES[0])), plan, *given)
    elements = coarsest.strut.grid.elements
    candidates = [nodes for nodes in AUTO_NODES if nodes * elements <= LARGEST_SIZE] or [AUTO_NODES[0]]
    for nodes in candidates:
        here = None if keeping is None else keeping.on(nodes)
        grid = Grid(nodes, model.grid.breaks)
        problem = make_problem(model.with_grid(grid), plan, *given)
        shortfall = too_coarse(problem.strut, problem.y0[None, :], plan.rtol)
        if shortfall is None and problem.missed > plan.rtol:
            shortfall = problem.missed
        if shortfall is None:
            ran = _run(problem, plan, progress, here, watch_nodes=True)
            history = ran.history
            shortfall = too_coarse(problem.strut, history.y[history.accepted], plan.rtol)
            if shortfall is None and not ran.too_coarse:
                why = "the last Legendre coefficients of curvature and load stay below rtol times their size throughout"
                fewer = f"; too few: {', '.join(tried)}" if tried else ""
                return _noted(_solution(problem, plan, ran), f"{nodes} nodes per element chosen: {why}{fewer}")
        tried.append(f"{nodes} ({shortfall or plan.rtol:.0e})")
    solution = on_given_nodes(_solution(problem, plan, _run(problem, plan, progress, here)), problem.missed)
    return _noted(
        solution, f"{nodes} nodes per element, the most tried, leave a Legendre tail of {tried[-1]}: add breaks"
    )


def _noted(solution: Solution, note: str) -> Solution:
    return replace(solution, notes=(*solution.notes, note))
