"""Eigenvalues of M x_tt + D x_t + K x = 0, in the form in which those of the slow modes are exact to rounding.

The mass operator integrates four times: its condition grows like n^8, and K x = omega^2 M x solved as it stands loses
the first modes to the rounding of the last. Turned round, M x = omega^-2 K x has the first modes at its large end. With
M = F^T F and K + sigma M = C C^T the singular values of F C^(-T) are (omega^2 + sigma)^(-1/2); the shift sigma is 0
unless K is not, or hardly, positive.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from plastica.physics.linearised import Linearised

__all__ = ["Undamped", "damped_pairs", "relaxation", "undamped"]

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

EPS = float(np.finfo(float).eps)

POSITIVE = 0.1
"""Least eigenvalue of K + sigma M; that of K without load is 1."""

ROUNDING = 16.0
"""Of the singular values, in units of eps times the largest."""

REAL = 1e-8
"""Relative imaginary part below which a pair is two real eigenvalues that rounding has moved off the axis."""


WHOLE = 96
"""Modes up to which the damped problem is solved at once; for more, that of the first is carried over to all."""

RAYLEIGH_STEPS, SAME = 3, 1e-3
"""Steps by which it is, and how far it may go: leaving out all but 96 changes the first eigenvalues by 1e-7."""


@dataclass(frozen=True, eq=False)
class Undamped:
    """All modes of K x = omega^2 M x on one grid.

    Attributes
    ----------
    squares : ndarray, shape (n,)
        omega^2, ascending; negative where the rod diverges.
    floors : ndarray, shape (n,)
        What rounding can do to each.
    sigma : ndarray, shape (n,)
        (omega^2 + shift)^(-1/2), descending.
    basis : ndarray, shape (n, n)
        Modes in columns, normalised by K + shift M.
    shift : float
    """

    squares: Array
    floors: Array
    sigma: Array
    basis: Array
    shift: float

    @property
    def vectors(self) -> Array:
        """Modes in columns, of modal mass 1."""
        return self.basis / self.sigma

    def first(self, count: int) -> Undamped:
        """Return the first of the modes."""
        part = slice(None, count)
        return Undamped(self.squares[part], self.floors[part], self.sigma[part], self.basis[:, part], self.shift)


def undamped(linear: Linearised) -> Undamped:
    """Solve K x = omega^2 M x.

    Parameters
    ----------
    linear : Linearised
        With inertia.

    Returns
    -------
    Undamped
    """
    from scipy.linalg import solve_triangular

    shift = _shift(linear)
    root = np.linalg.cholesky(linear.K + shift * linear.M)
    _, sigma, right = np.linalg.svd(solve_triangular(root, linear.factor.T, lower=True).T, full_matrices=False)
    basis = np.asarray(solve_triangular(root, right.T, lower=True, trans="T"))
    shifted = sigma**-2.0
    floors = 2.0 * ROUNDING * EPS * shifted * (sigma[0] / sigma)
    return Undamped(shifted - shift, floors, sigma, basis, shift)


def _shift(linear: Linearised) -> float:
    """The least of 0, 1, 4, 16, ... times the first omega^2 without load for which K + shift M is well positive."""
    if np.linalg.eigvalsh(linear.K)[0] >= POSITIVE:
        return 0.0
    shift = 1.0 / float(np.linalg.norm(linear.factor, 2)) ** 2
    while np.linalg.eigvalsh(linear.K + shift * linear.M)[0] < POSITIVE:
        shift *= 4.0
    return float(shift)


def relaxation(linear: Linearised) -> tuple[Array, Array]:
    """Eigenvalues of K, ascending, and its vectors in columns: without inertia disturbances decay at K/delta."""
    values, vectors = np.linalg.eigh(linear.K)
    return values, vectors


def damped_pairs(linear: Linearised, found: Undamped, count: int) -> Complex:
    """Solve lambda^2 M + lambda delta + K = 0, and give each of the first undamped modes its two eigenvalues.

    In the basis of the undamped modes, M = diag(sigma^2), K = 1 - shift sigma^2 and D = delta C. With
    lambda = tau + 1/nu, tau^2 = shift, the problem is nu^2 (1 + tau delta C) + nu (2 tau sigma^2 + delta C) + sigma^2,
    bounded whatever the number of nodes. Eigenvalues that are not real come in pairs of their own. Of the real ones,
    half are slow and half are fast, told apart by the sign of z^T (2 lambda M + D) z. One mode after the other takes
    the pair, or the slow and then the fast one, whose vector has most of it. Without load the vectors are the
    undamped modes, and nothing is left to choose.

    Parameters
    ----------
    linear : Linearised
        With inertia.
    found : Undamped
        Its undamped modes.
    count : int
        How many of them.

    Returns
    -------
    ndarray of complex, shape (count, 2)
        In each row the eigenvalue with positive imaginary part and its conjugate, or the slow one and the fast one.
    """
    if linear.damping == 0.0:
        above = np.sqrt((-found.squares[:count]).astype(complex))
        return np.stack([above, -above], axis=1)
    overlap = linear.damping * (found.basis.T @ found.basis)
    overlap = 0.5 * (overlap + overlap.T)
    size = min(found.sigma.size, max(WHOLE, 2 * count + WHOLE // 2))
    part = found.first(size)
    values, vectors = _quadratic(part, overlap[:size, :size])
    first, second = _chosen(part, overlap[:size, :size], values, vectors, count)
    if size < found.sigma.size:
        values = values.copy()
        for i in {*first.tolist(), *second.tolist()}:
            values[i] = _on_all(found, overlap, values[i], vectors[:, i])
    pairs = np.stack([values[first], values[second]], axis=1)
    return np.where((first == second)[:, None], np.stack([pairs[:, 0], pairs[:, 0].conj()], axis=1), pairs)


def _chosen(
    found: Undamped, overlap: Array, values: Complex, vectors: Complex, count: int
) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Which eigenvalues belong to each of the first modes; the same one twice stands for it and its conjugate."""
    swings = np.flatnonzero(values.imag > REAL * np.abs(values))
    still = np.flatnonzero(np.abs(values.imag) <= REAL * np.abs(values))
    mass, viscous, _ = _forms(found, overlap, vectors[:, still])
    kind = (2.0 * values[still] * mass + viscous).real / np.abs(viscous)
    still = still[np.argsort(-kind, kind="stable")]
    slow, fast = still[: still.size // 2], still[still.size // 2 :]
    first = _taken(vectors, np.concatenate([swings, slow]), range(count))
    real = np.flatnonzero(np.isin(first, slow))
    second = first.copy()
    second[real] = _taken(vectors, fast, real.tolist())
    return first, second


def _taken(vectors: Complex, offered: NDArray[np.intp], modes: Iterable[int]) -> NDArray[np.intp]:
    """Let each mode in turn take the vector that has most of it, of those that are left."""
    share, out = np.abs(vectors[:, offered]) ** 2, []
    for k in modes:
        best = int(np.argmax(share[k]))
        out.append(offered[best])
        share[:, best] = -1.0
    return np.array(out, dtype=np.intp)


def _on_all(found: Undamped, overlap: Array, value: complex, vector: Complex) -> complex:
    """Take an eigenvalue from some of the undamped modes to all of them, by Rayleigh's iteration."""
    n, tau = found.sigma.size, float(np.sqrt(found.shift))
    squares, here = found.sigma**2, value
    z: Complex = np.zeros(n, dtype=np.complex128)
    z[: vector.size] = vector
    for _ in range(RAYLEIGH_STEPS):
        whole = here * overlap + np.diag(here * here * squares + 1.0 - found.shift * squares)
        right = 2.0 * here * squares * z + overlap @ z
        try:
            z = np.asarray(np.linalg.solve(whole, right), dtype=np.complex128)
        except np.linalg.LinAlgError:
            break
        z = z / float(np.linalg.norm(z))
        here = complex(_sharpened(found, overlap, np.array([1.0 / (here - tau)]), z[:, None])[0])
    return here if abs(here - value) <= SAME * abs(value) else value


def _quadratic(found: Undamped, overlap: Array) -> tuple[Complex, Complex]:
    """All 2n eigenvalues, and their vectors in the basis of the undamped modes."""
    from scipy.linalg import solve_triangular

    n, tau = found.sigma.size, float(np.sqrt(found.shift))
    identity = np.eye(n)
    inverse = solve_triangular(np.linalg.cholesky(identity + tau * overlap), identity, lower=True)
    middle = inverse @ (2.0 * tau * np.diag(found.sigma**2) + overlap) @ inverse.T
    side = inverse * found.sigma
    nu, vectors = np.linalg.eig(np.block([[-middle, -side], [side.T, np.zeros((n, n))]]))
    vectors = inverse.T @ vectors[:n].astype(complex)
    near = np.abs(nu.imag) <= REAL * np.abs(nu)
    # Two real eigenvalues that rounding made a pair share the plane of their vector's real and imaginary parts.
    vectors[:, near] = np.where(nu.imag[near] < 0.0, vectors[:, near].imag, vectors[:, near].real)
    vectors /= np.linalg.norm(vectors, axis=0)
    return _sharpened(found, overlap, np.where(near, nu.real, nu), vectors), vectors


def _forms(found: Undamped, overlap: Array, vectors: Complex) -> tuple[Complex, Complex, Complex]:
    """z^T M z, z^T D z and z^T K z of every vector, without conjugation."""
    squares = vectors * vectors
    mass = found.sigma**2 @ squares
    return mass, np.sum(vectors * (overlap @ vectors), axis=0), squares.sum(axis=0) - found.shift * mass


def _sharpened(found: Undamped, overlap: Array, nu: Complex, vectors: Complex) -> Complex:
    """The root of the vector's own quadratic next to tau + 1/nu: the error of a vector enters it squared."""
    mass, viscous, stiff = _forms(found, overlap, vectors)
    spread = np.emath.sqrt(viscous * viscous - 4.0 * mass * stiff)
    spread = np.where((np.conj(viscous) * spread).real < 0.0, -spread, spread)
    large = -0.5 * (viscous + spread)
    with np.errstate(all="ignore"):
        roots = np.stack([large / mass, stiff / large])
        off = np.abs(1.0 / (roots - np.sqrt(found.shift)) - nu)
    return np.asarray(np.take_along_axis(roots, np.argmin(off, axis=0)[None], axis=0)[0])
