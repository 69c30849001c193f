"""Small motions of a rod about a shape at rest: its modes, on grids that are compared."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from plastica.equilibria.at_rest import AtRest, Motion, at_rest
from plastica.equilibria.equilibrium import Equilibrium
from plastica.equilibria.mode_set import Modes
from plastica.equilibria.rest import Rest
from plastica.equilibria.vibration import Undamped, damped_pairs, relaxation, undamped
from plastica.errors import ArgumentError
from plastica.numerics.grid import LARGEST_NODES
from plastica.physics.linearised import Linearised, linearised
from plastica.physics.model import Model

__all__ = ["modes"]

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

EPS = float(np.finfo(float).eps)

MOST_MODES = 100

FIRST_NODES, NODES_PER_MODE = 12, 2
"""With which the choice of the nodes begins; it ends with twice as many, or more."""

LARGEST_COMPARED = 256
"""Nodes in all beyond which the error is estimated from half as many nodes, not from twice as many."""

CONVERGED = 1e-10
"""Relative change of omega^2 at which more nodes are not asked for."""

ROUNDING = 16.0
"""Of eigenvalues of K, in units of eps times the largest."""

FAINT = 1e-6
"""A free end that moves less across than this share of the largest displacement does not decide a sign."""


class _Solved(NamedTuple):
    """All modes on one grid, dimensionless: numbers ascending (omega^2, or K without inertia), vectors in columns."""

    place: AtRest
    linear: Linearised
    numbers: Array
    floors: Array
    vectors: Array
    found: Undamped | None

    def pairs(self, count: int) -> Complex:
        """Both eigenvalues of the first modes; without inertia there is no second one."""
        if self.found is not None:
            return damped_pairs(self.linear, self.found, count)
        slow = -self.numbers[:count] / self.linear.damping
        return np.stack([slow, np.full(count, -np.inf)], axis=1).astype(complex)


def modes(rod: Model, equilibrium: Equilibrium | Rest | Motion | None = None, count: int = 6) -> Modes:
    """Compute the modes of small motions of a rod about a shape at rest, its natural curvature held.

    In the integral form of the design's section 1.2, to first order in a change u of the curvature, psi = J u:

        M u_tt + delta u_t + u - J*[p psi] = 0,      M = B [eps0 + eps1 (cos BA cos + sin BA sin)] A

    with p the compression by the dead loads, -n.a. Frequencies are those of K x = omega^2 M x; with damping
    lambda^2 M + lambda D + K = 0, where D, the retardation time times the bending stiffness without load, is
    proportional to K without load only: then zeta = delta omega/2.

    Parameters
    ----------
    rod : Rod or Strut
        Under constant loads. Without inertia (a strut) there are rates of decay, but no frequencies.
        ``Grid(nodes="auto")`` takes the smallest number of nodes that resolves all modes asked for.
    equilibrium : Equilibrium, Rest or Solution, optional
        Where to linearise: an equilibrium in closed form under the thrust of the rod, what `rest` found for the rod, or
        a motion that has come to rest. By default the straight rod without natural curvature, or the static shape
        that it comes to under the loads.
    count : int
        How many modes, at most 100 and the number of nodes.

    Returns
    -------
    Modes

    Raises
    ------
    ArgumentError
        Where an argument is of the wrong kind or out of range, the loads vary, or the rod is not at rest there.

    Notes
    -----
    You should see: beta^2 = 3.516, 22.03, 61.70, ... for a straight rod without load whose time is measured in
    (rho A L^4/EI)^(1/2). A dead thrust lowers them: the first is 0 at the thrust at which the rod buckles.

    Good values: 12 nodes give the first two of these to rounding, 16 the first three to 1e-15 and the fourth to 3e-13.

    Limits: a natural curvature that moves is not part of the motion. Where the drive exceeds the threshold it does
    (`Modes.stays`). Under load the damping couples the modes; where several of them do not swing and the load is near
    the buckling load or beyond, which slow eigenvalue goes with which fast one is a convention.

    Checked by test_modes.

    Examples
    --------
    >>> import plastica as pl
    >>> rod = pl.Rod(pl.catalogue.material("one-shape"), pl.Load(), translational_inertia=1.0, damping=0.01)
    >>> pl.modes(rod, count=2).frequencies.round(6).tolist()
    [3.516015, 22.034492]
    """
    whole = isinstance(count, (int, np.integer)) and not isinstance(count, bool)
    if not whole or not 1 <= count <= MOST_MODES:
        raise ArgumentError(f"must be an integer in [1, {MOST_MODES}]", where="count", value=count)
    place = at_rest(rod, equilibrium)
    if rod.grid.nodes == "auto":
        solved, other = _refined(place, int(count))
    else:
        if count > place.model.grid.size:
            raise ArgumentError(
                f"must be at most the number of nodes, {place.model.grid.size}",
                where="count",
                value=count,
                next_step="Take more nodes.",
            )
        solved, other = _solved(place), _compared(place)
    return _finished(solved, _change(solved, other, int(count)), int(count))


def _compared(place: AtRest) -> _Solved | None:
    """The same on twice the nodes; on half of them where that would be many, and None where neither can be."""
    grid = place.model.grid
    if grid.size <= LARGEST_COMPARED and 2 * grid.per_element <= LARGEST_NODES:
        other = place.on(grid.refined())
    else:
        other = place.on(grid.with_nodes(max(2, grid.per_element // 2)))
    return _solved(other) if other.converged else None


def _refined(place: AtRest, count: int) -> tuple[_Solved, _Solved | None]:
    """Double the nodes until the modes asked for agree, or there would be too many."""
    elements = place.model.grid.elements
    nodes = min(max(8, -(-(FIRST_NODES + NODES_PER_MODE * count) // elements)), LARGEST_NODES // 2)
    coarse = _solved(place.on(place.model.grid.with_nodes(nodes)))
    while True:
        nodes *= 2
        fine = _solved(place.on(place.model.grid.with_nodes(nodes)))
        agree = bool(np.all(_change(fine, coarse, count) <= CONVERGED * _size(fine, count)))
        if agree or 2 * nodes > LARGEST_NODES or 2 * nodes * elements > 2 * LARGEST_COMPARED:
            return fine, coarse
        coarse = fine


def _solved(place: AtRest) -> _Solved:
    linear = linearised(place.model, place.theta)
    if not linear.factor.size:
        values, vectors = relaxation(linear)
        floors = np.full(values.size, ROUNDING * EPS * float(np.abs(values).max()))
        return _Solved(place, linear, values, floors, vectors, None)
    found = undamped(linear)
    return _Solved(place, linear, found.squares, found.floors, found.vectors, found)


def _size(solved: _Solved, count: int) -> Array:
    """What a change of the numbers is compared with: themselves, or the first omega^2 without load (1 for K)."""
    least = float(np.linalg.norm(solved.linear.factor, 2)) ** -2.0 if solved.linear.factor.size else 1.0
    return np.asarray(np.maximum(np.abs(solved.numbers[:count]), least))


def _change(solved: _Solved, other: _Solved | None, count: int) -> Array:
    """Estimated errors of the first numbers: how far the other grid's are, and what rounding can do."""
    if other is None:
        return np.full(count, np.nan)
    theirs = np.full(count, np.inf)
    theirs[: other.numbers.size] = other.numbers[:count]
    return np.asarray(np.abs(solved.numbers[:count] - theirs) + solved.floors[:count])


def _finished(solved: _Solved, change: Array, count: int) -> Modes:
    """Everything in the user's units."""
    place, linear, numbers = solved.place, solved.linear, solved.numbers[:count]
    scales, inertia = place.model.scales, bool(linear.factor.size)
    energy = scales.energy * scales.length**2
    size = energy * scales.time**2 if inertia else scales.length**2
    shapes = _signed(solved.vectors[:, :count] / linear.root[:, None], place).T / np.sqrt(size)
    pairs = solved.pairs(count)
    endless = np.full(count, np.inf)
    known = CONVERGED * _size(solved, count)
    frequencies, errors = _frequencies(numbers, change, known) if inertia else (endless, change / linear.damping)
    return Modes(
        model=place.model,
        mu=place.mu,
        theta=place.theta,
        mu_nat=place.mu_nat,
        frequencies=frequencies * scales.rate,
        squares=(numbers if inertia else frequencies) * scales.rate**2,
        errors=errors * scales.rate,
        eigenvalues=_scaled(pairs, scales.rate),
        damping_ratios=_ratios(*pairs.T) if inertia else endless,
        shapes=shapes,
        mass=linear.nodal(linear.M) * (energy * scales.time**2),
        damping=np.diag(linear.grid.w) * (linear.damping * energy * scales.time),
        stiffness=linear.nodal(linear.K) * energy,
        unstable=_negative(linear.K),
        resolved=bool(np.all(change <= known)),
        stays=place.stays,
    )


def _negative(stiffness: Array) -> int:
    """How many eigenvalues of K are negative beyond rounding."""
    values = np.linalg.eigvalsh(stiffness)
    return int(np.count_nonzero(values < -ROUNDING * EPS * np.abs(values).max()))


def _frequencies(squares: Array, change: Array, known: Array) -> tuple[Array, Array]:
    """Frequencies and their errors, from those of the squares; one that is 0 within an error that is small is 0."""
    zero = (np.abs(squares) <= change) & (change <= known)
    omega = np.sqrt(np.where(zero, 0.0, np.where(squares >= 0.0, squares, np.nan)))
    size = np.sqrt(np.abs(squares))
    return omega, np.where(size * size > change, change / (2.0 * np.maximum(size, 1e-300)), np.sqrt(change))


def _scaled(values: Complex, by: float) -> Complex:
    """Complex numbers times a real one; infinite ones keep an imaginary part of 0."""
    out = np.empty_like(values)
    out.real, out.imag = values.real * by, values.imag * by
    return out


def _ratios(first: Complex, second: Complex) -> Array:
    """-(a + b) / (2 (a b)^(1/2)) of the two eigenvalues; nan where one grows."""
    product = (first * second).real
    decays = (np.maximum(first.real, second.real) <= 0.0) & (product > 0.0)
    ratio = -(first + second).real / (2.0 * np.sqrt(np.where(decays, product, 1.0)))
    return np.asarray(np.where(decays, ratio, np.nan) + 0.0)


def _signed(nodal: Array, place: AtRest) -> Array:
    """Modes whose free end moves to the side of +y, or where it hardly does, whose largest curvature is positive."""
    grid = place.model.grid
    psi = grid.A @ nodal
    x, y = (grid.A @ (part[:, None] * psi) for part in (-np.sin(place.theta), np.cos(place.theta)))
    end = (grid.w * np.cos(place.theta)) @ psi
    largest = np.hypot(x, y).max(axis=0)
    curved = nodal[np.abs(nodal).argmax(axis=0), np.arange(nodal.shape[1])]
    decides = np.where(np.abs(end) >= FAINT * largest, end, curved)
    return nodal * np.where(decides < 0.0, -1.0, 1.0)
