"""Gauss collocation in time: for rods without damping, whose energy no step may eat.

The method with 5 stages has order 10, conserves quadratic invariants, and neither damps nor excites a vibration that is
too fast for its steps. SciPy's implicit methods damp what they do not follow, and so must follow everything: on the
modes of a grid, of which the fastest is a thousand times faster than the slowest and of no meaning, they hardly move.

E. Hairer, C. Lubich and G. Wanner, Geometric Numerical Integration, 2nd ed., 2006, chapters II.1.3 and VIII.6.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import DenseOutput, OdeSolver
from scipy.linalg.lapack import dgetrf, dgetrs, zgetrf, zgetrs

__all__ = ["STAGES", "Gauss", "Watch"]

Array = NDArray[np.float64]
Rate = Callable[[float, Array], Array]

STAGES = 5
ORDER = STAGES + 1
"""Of the polynomial between the ends of a step; at the ends themselves the order is twice the number of stages."""

SAMPLES = 0.5 - 0.5 * np.cos(np.pi * (np.arange(12) + 0.5) / 12)
"""Where on a step the error of its polynomial is looked at."""

MOST_ITERATIONS = 12
SLOW = 4
"""Newton iterations after which the Jacobian is taken anew."""

NEWTON = 1e-3
"""What a Newton iteration may leave, as a part of the tolerance."""

LEAST_CHANGE, MOST_CHANGE, SAFETY, WORTH = 0.2, 4.0, 0.85, 1.3
"""Of the step; a change by less than the last is not worth a factorisation."""


class Tableau(NamedTuple):
    """Coefficients of a collocation method on [0, 1].

    Attributes
    ----------
    c : ndarray, shape (s,)
        Nodes.
    A : ndarray, shape (s, s)
        Integrals of their Lagrange polynomials, from 0 to each node.
    d : ndarray, shape (s,)
        b^T A^-1, which takes the stages' increments to that of the step.
    values : ndarray, shape (p,), complex
        Eigenvalues of A, of each conjugate pair one, real ones first: A = Re(back diag(values) into).
    into : ndarray, shape (p, s), complex
        Takes stages to their parts along the eigenvectors.
    back : ndarray, shape (s, p), complex
        Takes the parts back to the stages, as the real part: a pair's counts twice.
    """

    c: Array
    A: Array
    d: Array
    values: NDArray[np.complex128]
    into: NDArray[np.complex128]
    back: NDArray[np.complex128]


@cache
def tableau() -> Tableau:
    """Return the coefficients of the Gauss method."""
    x, w = np.polynomial.legendre.leggauss(STAGES)
    return collocation(0.5 * (1.0 + x), 0.5 * w)


def collocation(c: Array, b: Array) -> Tableau:
    """Return the coefficients of collocation at nodes c with weights b."""
    powers = np.arange(c.size)
    vandermonde = c[:, None] ** powers
    A = (c[:, None] ** (powers + 1) / (powers + 1)) @ np.linalg.inv(vandermonde)
    values, vectors = np.linalg.eig(A)
    real = np.flatnonzero(values.imag == 0.0)
    chosen = np.concatenate([real, np.flatnonzero(values.imag > 0.0)])
    twice = np.where(values[chosen].imag == 0.0, 1.0, 2.0)
    return Tableau(
        c,
        A,
        np.asarray(np.linalg.solve(A.T, b), dtype=float),
        values[chosen],
        np.linalg.inv(vectors)[chosen],
        twice * vectors[:, chosen],
    )


@dataclass(frozen=True, eq=False)
class Watch:
    """What of a state the error of a step is measured in.

    Attributes
    ----------
    matrix : ndarray, shape (k, size)
        Takes a state to the components that are looked at.
    groups : tuple of slice
        Components that are compared with the largest of their group.
    atol : ndarray, shape (k,)
        Absolute tolerances.
    """

    matrix: Array
    groups: tuple[slice, ...]
    atol: Array

    def scale(self, y: Array, rtol: float) -> Array:
        """Tolerance of each component at a state."""
        seen = np.abs(self.matrix @ y)
        out = self.atol.copy()
        for group in self.groups:
            out[group] += rtol * seen[group].max(initial=0.0)
        return out

    @classmethod
    def everything(cls, atol: Array) -> Watch:
        """Look at every component, each for itself."""
        return cls(np.eye(atol.size), tuple(slice(i, i + 1) for i in range(atol.size)), atol)


class Gauss(OdeSolver):  # type: ignore[misc]  # SciPy has no types
    """Gauss collocation of order 10 with steps by comparison of one step with two halves.

    Between the ends of a step the error of the polynomial is of order 6: that is what steps are chosen by.

    Parameters
    ----------
    fun, t0, y0, t_bound
        The problem, as for SciPy's solvers.
    jac : callable
        Derivative of `fun` by y.
    rtol : float
        Relative tolerance.
    watch : Watch
        What the error is measured in, with its absolute tolerances.
    max_step : float
        Longest step.
    """

    t: float
    y: Array

    def __init__(
        self,
        fun: Rate,
        t0: float,
        y0: Array,
        t_bound: float,
        *,
        jac: Rate,
        rtol: float,
        watch: Watch,
        max_step: float = np.inf,
    ) -> None:
        super().__init__(fun, t0, y0, t_bound, vectorized=False)
        self.jac, self.rtol, self.watch, self.max_step = jac, rtol, watch, max_step
        self.jacobian = jac(t0, self.y)
        self.njev = 1
        self.factors: dict[float, list[_Factors]] = {}
        self.h = min(self._first_step(), max_step, abs(t_bound - t0))
        self.last: _Halves | None = None

    def _first_step(self) -> float:
        """A hundredth of the time in which the state changes by its tolerance's scale or by itself."""
        slope = self.watch.matrix @ self.fun(self.t, self.y)
        scale = self.watch.scale(self.y, self.rtol) / self.rtol
        fastest = float(np.sqrt(np.mean((slope / scale) ** 2)))
        return 0.01 / max(fastest, 1e-6)

    def _step_impl(self) -> tuple[bool, str | None]:
        t, y = self.t, self.y
        least = 10.0 * np.spacing(t)
        fresh = False
        while True:
            h = min(self.h, self.t_bound - t)
            # What would leave a remnant too short for a step of its own is taken in two equal steps.
            if h < self.t_bound - t < 1.2 * h:
                h = 0.5 * (self.t_bound - t)
            if h < least:
                return False, self.TOO_SMALL_STEP
            found = self._two_halves(t, y, h)
            if found is None:
                if fresh:
                    self.h = 0.25 * h
                else:
                    self.jacobian, fresh = self.jac(t, y), True
                    self.njev += 1
                self.factors.clear()
                continue
            error, iterations, pieces = found
            factor = min(MOST_CHANGE, max(LEAST_CHANGE, SAFETY * max(error, 1e-14) ** (-1.0 / ORDER)))
            if error > 1.0:
                self.h = h * min(factor, 0.9)
                continue
            self.last = pieces
            self.t_old, self.t, self.y = t, t + h if h < self.t_bound - t else self.t_bound, pieces.end
            if factor > WORTH or factor < 1.0:
                self.h = min(h * factor, self.max_step)
            if iterations > SLOW:
                self.jacobian = self.jac(self.t, self.y)
                self.njev += 1
                self.factors.clear()
            return True, None

    def _two_halves(self, t: float, y: Array, h: float) -> tuple[float, int, _Halves] | None:
        """Error of one step against two halves, Newton iterations spent, and the halves; None where Newton failed."""
        half = 0.5 * h
        c = tableau().c
        # No extrapolation of the last step: of what is faster than the steps it makes a guess that is worse than none.
        still = np.zeros((STAGES, y.size))
        first = self._stages(t, y, half, still)
        if first is None:
            return None
        middle = first.end
        second = self._stages(t + half, middle, half, still)
        if second is None:
            return None
        earlier = _Polynomial(t, half, y, first.increments)
        pieces = _Halves(earlier, _Polynomial(earlier.t, half, middle, second.increments), second.end)
        whole = self._stages(t, y, h, pieces(t + h * c).T - y)
        if whole is None:
            return None
        # The polynomials of whole and halves differ by the error of the former; of the gain of halving a quarter
        # is left as a margin where the step is too long for it to be had.
        places = t + h * SAMPLES
        coarse = _Polynomial(t, h, y, whole.increments)
        off = (coarse(places) - pieces(places)).T @ self.watch.matrix.T / 2.0 ** (ORDER - 2)
        scale = self.watch.scale(np.maximum(np.abs(y), np.abs(second.end)), self.rtol)
        error = float(np.sqrt(np.mean((off / scale) ** 2, axis=1)).max())
        return error, max(first.iterations, second.iterations), pieces

    def _stages(self, t: float, y: Array, h: float, guess: Array) -> _Stages | None:
        """Solve D = h A F(y + D) for the stages' increments by simplified Newton steps; None where they diverge."""
        c, A, d, *_ = tableau()
        factors = self._factorised(h)
        scale = self.watch.atol.min() + self.rtol * float(np.abs(y).max())
        D, before = guess, np.inf
        for iteration in range(1, MOST_ITERATIONS + 1):
            slopes = np.array([self.fun(t + h * ci, y + Di) for ci, Di in zip(c, D, strict=True)])
            residual = h * (A @ slopes) - D
            if not np.isfinite(residual).all():
                return None
            change = _solved(factors, residual)
            D = D + change
            size = float(np.sqrt(np.mean(change**2))) / scale
            if not np.isfinite(size):
                return None
            rate = size / before
            if size <= NEWTON or (iteration > 1 and rate < 1.0 and size * rate / (1.0 - rate) <= NEWTON):
                return _Stages(D, y + d @ D, iteration)
            if iteration > 2 and rate > 0.9:
                return None
            before = size
        return None

    def _factorised(self, h: float) -> list[_Factors]:
        """Factors of 1 - h value J, one for each eigenvalue that A is split by."""
        if h not in self.factors:
            if len(self.factors) > 4:
                self.factors.clear()
            self.factors[h] = [_factors(h * value, self.jacobian) for value in tableau().values]
        return self.factors[h]

    def _dense_output_impl(self) -> DenseOutput:
        return self.last


class _Factors(NamedTuple):
    """LU factors of a matrix, and what solves by them."""

    lu: NDArray[Any]
    pivots: NDArray[np.int32]
    solve: Callable[..., tuple[NDArray[Any], int]]


def _factors(z: complex, jacobian: Array) -> _Factors:
    """Factors of 1 - z J, in real numbers where z is real."""
    factorise, solve = (dgetrf, dgetrs) if z.imag == 0.0 else (zgetrf, zgetrs)
    matrix = (-z.real if z.imag == 0.0 else -z) * jacobian
    matrix.flat[:: len(matrix) + 1] += 1.0
    lu, pivots, _ = factorise(matrix, overwrite_a=True)
    return _Factors(lu, pivots, solve)


def _solved(factors: list[_Factors], residual: Array) -> Array:
    """Solve (1 - h A x J) X = R, stage by stage along the eigenvectors of A; both of shape (s, size).

    That is as many systems of the size of the state as A has eigenvalues, and of each conjugate pair only one, instead
    of one system for all stages together. (E. Hairer and G. Wanner, Solving Ordinary Differential Equations II, 2nd
    ed., 1996, section IV.8.)
    """
    table = tableau()
    parts = table.into @ residual
    for part, each in zip(parts, factors, strict=True):
        right = part if np.iscomplexobj(each.lu) else part.real
        part[:] = each.solve(each.lu, each.pivots, right)[0]
    return np.asarray((table.back @ parts).real)


class _Stages(NamedTuple):
    increments: Array
    end: Array
    iterations: int


class _Polynomial(DenseOutput):  # type: ignore[misc]  # SciPy has no types
    """The collocation polynomial of a step, through its start and its stages."""

    def __init__(self, t: float, h: float, y: Array, increments: Array) -> None:
        super().__init__(t, t + h)
        self.nodes, self.start = np.concatenate([[0.0], tableau().c]), y
        self.increments = np.vstack([np.zeros_like(y), increments])
        difference = self.nodes[:, None] - self.nodes
        np.fill_diagonal(difference, 1.0)
        self.weights = 1.0 / difference.prod(axis=1)

    def _call_impl(self, t: Array) -> Array:
        x = np.atleast_1d((t - self.t_old) / (self.t - self.t_old))
        difference = x[:, None] - self.nodes
        hit = difference == 0.0
        difference[hit] = 1.0
        terms = self.weights / difference
        rows = terms / terms.sum(axis=1, keepdims=True)
        exact = hit.any(axis=1)
        rows[exact] = hit[exact]
        # What does not change over the step is to come out the same to the last bit.
        out = (self.start + rows @ self.increments).T
        return np.asarray(out[:, 0] if np.ndim(t) == 0 else out)


class _Halves(DenseOutput):  # type: ignore[misc]  # SciPy has no types
    """The collocation polynomials of two half steps, one after the other.

    A vibration that is too fast for the steps vanishes at the stages and is back, with the other sign, at the ends.
    Between them each of the polynomials, then that of Legendre, stays within its size; one polynomial through all the
    states of both halves exceeds it thirtyfold, and hands that on where a step is cut short at a switch.
    """

    degree = 2 * STAGES
    """Of a polynomial with as many nodes as there are states."""

    def __init__(self, first: _Polynomial, second: _Polynomial, end: Array) -> None:
        super().__init__(first.t_old, second.t)
        self.first, self.second, self.end = first, second, end

    def _call_impl(self, t: Array) -> Array:
        times = np.atleast_1d(t)
        out = np.empty((self.end.size, times.size))
        late = times > self.first.t
        for part, chosen in ((self.first, ~late), (self.second, late)):
            if chosen.any():
                out[:, chosen] = part(times[chosen])
        return np.asarray(out[:, 0] if np.ndim(t) == 0 else out)
