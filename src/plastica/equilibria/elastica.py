"""Equilibria of the strut in closed form: phi'' + gamma sin phi = 0, phi(0) = 0, phi'(0) = alpha.

Everything is dimensionless and vectorised over the thrust gamma, the clamp curvature alpha and the arc length s. How
each regime keeps its digits:

* librating rods (alpha^2 < 4 gamma) are written in u = sqrt(gamma) s, rotating ones in u = alpha s / 2; either form
  holds on the separatrix, where the elliptic functions are hyperbolic;
* the parameter m comes with its complement m1 = |4 gamma - alpha^2| / max(4 gamma, alpha^2), the difference formed in
  twice the precision: next to the separatrix nothing is lost but the rounding of u;
* int cos phi is m1 s + m P / sqrt(gamma), or 2 P / alpha, with P = int cos(2 am); int sin phi is sn^2 over a sum where
  1 - cn or 1 - dn would cancel; the integral of nd^2 is u + m int sd^2: all sums have terms of the size of the result;
* gamma -> 0 is rotating with m -> 0; phi(1) - phi'(1) is then a quadrature or a series, never a difference;
* below |alpha| = 2^-332 the rod is that of 2^-332, scaled: alpha = 0 is no special case.

Limits: gamma and alpha are taken as the doubles they are. Rounding a decimal number to a double already costs its
condition number times eps / 2, which no formula can win back: about exp(sqrt(gamma)) next to the separatrix, and
without bound for a relative error where a quantity passes through zero. A point computed beside others may differ from
the same point computed alone by the rounding of a step of Landen's more.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from plastica.errors import ArgumentError
from plastica.material.material import Laws
from plastica.numerics.jacobi import Jacobi, amplitude_excess, jacobi

__all__ = ["LARGEST_ALPHA", "LARGEST_GAMMA", "Ends", "Profile", "alpha_rate", "drive", "ends", "liapunov", "profile"]

Array = NDArray[np.float64]

LARGEST_GAMMA = 1e5
"""Thrust up to which closed forms are given: exp(2 sqrt(gamma)) must be a double."""

LARGEST_ALPHA = 1e6
"""Clamp curvature up to which closed forms are given; beyond it the tip's angle has lost ten digits."""

DEEPEST = 350.0
"""Depth next to the separatrix up to which 1/cosh^2 has all its digits."""

FLOOR = 2.0**-332
"""Clamp curvature below which the rod is linear in alpha to the last bit, far from where alpha^2 leaves the doubles."""

BLOCK = 4096
"""Points computed at a time: their arrays stay in the processor's cache."""

SPLIT = 134217729.0
"""2^27 + 1: cuts a double into two halves whose products are exact (Dekker)."""

LINEAR = 0.25
"""Parameter of a rotating rod up to which phi - alpha s is summed as a series instead of subtracted."""

GENTLE_GAMMA, GENTLE_ALPHA = 1.0, 4.0
"""Below both, gamma int s sin phi is a quadrature: its closed form subtracts nearly equal numbers."""

PLACES, WEIGHTS = 0.5 + 0.5 * np.polynomial.legendre.leggauss(14)[0], 0.5 * np.polynomial.legendre.leggauss(14)[1]


class Profile(NamedTuple):
    """An equilibrium along the rod; arrays of the broadcast shape of (gamma, alpha, s).

    Attributes
    ----------
    phi : ndarray
        Tangent angle.
    slope : ndarray
        Its slope, the curvature phi'.
    theta0, theta0_slope : ndarray
        Derivative of phi and of phi' in alpha: the kernel of the linearisation.
    x, y : ndarray
        Centre line, int_0^s cos phi and int_0^s sin phi.
    """

    phi: Array
    slope: Array
    theta0: Array
    theta0_slope: Array
    x: Array
    y: Array


class Ends(NamedTuple):
    """An equilibrium at the free end s = 1; arrays of the broadcast shape of (gamma, alpha).

    Attributes
    ----------
    phi : ndarray
        Tangent angle phi(1).
    mu_nat : ndarray
        Natural curvature phi'(1): the end bears no couple.
    theta0, theta0_slope : ndarray
        Derivatives of phi(1) and of mu_nat in alpha; folds are the zeros of the second.
    x, y : ndarray
        Place of the free end.
    arm : ndarray
        phi(1) - phi'(1) = gamma int_0^1 s sin phi, to its own relative accuracy.
    """

    phi: Array
    mu_nat: Array
    theta0: Array
    theta0_slope: Array
    x: Array
    y: Array
    arm: Array


class _Orbit(NamedTuple):
    """What does not depend on s: thrust, |alpha| (not below FLOOR), and the elliptic parameter."""

    gamma: Array
    alpha: Array
    librating: NDArray[np.bool_]
    rate: Array
    m: Array
    m1: Array


def profile(gamma: ArrayLike, alpha: ArrayLike, s: ArrayLike, depth: ArrayLike | None = None) -> Profile:
    """Return the equilibrium with clamp curvature alpha under thrust gamma at the places s.

    Librating, u = sqrt(gamma) s, k = alpha / (2 sqrt(gamma))::

        phi = 2 atan2(k sn, dn)     phi' = alpha cn      theta0 = (sd - m cn Q) / sqrt(gamma)

    rotating, u = alpha s / 2, m = 4 gamma / alpha^2::

        phi = 2 am                  phi' = alpha dn      theta0 = (2 / alpha) dn (u + m Q)

    with Q = int_0^u sd^2 (design, claim 5). Odd in alpha to the last bit.

    Parameters
    ----------
    gamma : array_like
        Thrust in [0, 1e5], dimensionless.
    alpha : array_like
        Clamp curvature phi'(0), |alpha| <= 1e6, dimensionless.
    s : array_like
        Arc length in [0, 1]. The three broadcast.
    depth : array_like, optional
        Where alpha alone cannot tell how near the separatrix is, |alpha| = 2 gamma^(1/2) tanh(depth) on librating rods,
        or 2 gamma^(1/2) / tanh(-depth) on rotating ones, where it is negative; of alpha only the sign then counts.

    Returns
    -------
    Profile

    Raises
    ------
    ArgumentError
        Where an argument is not finite or outside its range, or they do not broadcast.

    Notes
    -----
    For gamma <= 500 and |alpha| <= 50 the relative error is at most 50 eps max(1, condition in (gamma, alpha)); about
    10 eps is the most that was measured. Checked by `test_accuracy`, `test_accuracy_across_the_separatrix`,
    `test_accuracy_anywhere`.
    """
    where = _floats(s, "s")
    if where.size and not (np.min(where) >= 0.0 and np.max(where) <= 1.0):
        raise ArgumentError("must lie on the rod, in [0, 1]", where="s", value=s)
    g, a = _checked(gamma, alpha)
    return Profile(*_blocked(_profile, g, a, where, *_deep(depth)))


def ends(gamma: ArrayLike, alpha: ArrayLike, depth: ArrayLike | None = None) -> Ends:
    """Return what `profile` gives at the free end, and phi(1) - phi'(1) without cancellation.

    Parameters
    ----------
    gamma, alpha : array_like
        Thrust and clamp curvature as for `profile`; they broadcast.
    depth : array_like, optional
        As for `profile`.

    Returns
    -------
    Ends

    Raises
    ------
    ArgumentError
        Where an argument is not finite or outside its range.
    """
    return Ends(*_blocked(_ends, *_checked(gamma, alpha), *_deep(depth)))


def drive(end: Ends, laws: Laws) -> Array:
    """Return the driving force on the natural curvature, D = phi(1) - phi'(1) - kappa'(phi'(1)).

    Parameters
    ----------
    end : Ends
        Equilibria at the free end.
    laws : Laws
        Dimensionless laws; only the preference energy kappa enters.

    Returns
    -------
    ndarray
    """
    return np.asarray(end.arm - laws.preference.slope(end.mu_nat))


def liapunov(end: Ends, gamma: ArrayLike, alpha: ArrayLike, laws: Laws | None) -> Array:
    """Return the Liapunov function V = 1/2 int (phi' - mu_nat)^2 + kappa(mu_nat) + gamma int cos phi.

    By the first integral phi'^2 / 2 - gamma cos phi = alpha^2 / 2 - gamma it is
    gamma (2 x - cos phi(1)) - mu_nat arm + kappa(mu_nat), whose terms vanish with gamma as V - kappa does.

    Parameters
    ----------
    end : Ends
        Equilibria at the free end.
    gamma, alpha : array_like
        Their thrusts and clamp curvatures.
    laws : Laws or None
        Dimensionless laws; only the preference energy kappa enters. None leaves it out.

    Returns
    -------
    ndarray
    """
    g, _ = np.broadcast_arrays(np.asarray(gamma, dtype=float), np.asarray(alpha, dtype=float))
    bare = g * (2.0 * end.x - np.cos(end.phi)) - end.mu_nat * end.arm
    return np.asarray(bare if laws is None else bare + laws.preference.value(end.mu_nat))


def alpha_rate(gamma: float, depth: float) -> float:
    """Return d|alpha|/d|depth|: 2 gamma^(1/2) / cosh(depth)^2, or -2 gamma^(1/2) / sinh(depth)^2 on rotating rods."""
    root = 2.0 * float(np.sqrt(gamma))
    return root / float(np.cosh(depth)) ** 2 if depth >= 0.0 else -root / float(np.sinh(depth)) ** 2


def _deep(depth: ArrayLike | None) -> tuple[Array, ...]:
    """Return the depth as an argument more, or none."""
    if depth is None:
        return ()
    deep = _floats(depth, "depth")
    if deep.size and not np.max(np.abs(deep)) <= DEEPEST:
        raise ArgumentError(f"must lie in [{-DEEPEST:g}, {DEEPEST:g}]", where="depth", value=depth)
    return (deep,)


def _checked(gamma: ArrayLike, alpha: ArrayLike) -> tuple[Array, Array]:
    g, a = _floats(gamma, "gamma"), _floats(alpha, "alpha")
    if g.size and np.min(g) < 0.0:
        raise ArgumentError(
            "must not be negative: tension is not treated",
            where="gamma",
            value=gamma,
            next_step="A thrust is positive where it pushes toward the clamp.",
        )
    if g.size and not np.max(g) <= LARGEST_GAMMA:
        raise ArgumentError(f"must lie in [0, {LARGEST_GAMMA:g}]", where="gamma", value=gamma)
    if a.size and not np.max(np.abs(a)) <= LARGEST_ALPHA:
        raise ArgumentError(f"must lie in [{-LARGEST_ALPHA:g}, {LARGEST_ALPHA:g}]", where="alpha", value=alpha)
    return g, a


def _floats(value: ArrayLike, where: str) -> Array:
    try:
        return np.asarray(value, dtype=float)
    except (TypeError, ValueError):
        raise ArgumentError("must be a number, or an array of numbers", where=where, value=value) from None


def _blocked(compute: Callable[..., tuple[Array, ...]], *arguments: Array) -> tuple[Array, ...]:
    """Apply a function of flat arrays to arrays that broadcast, a block of points at a time."""
    try:
        broadcast = np.broadcast_arrays(*arguments)
    except ValueError:
        names = "`gamma` and `alpha`" if len(arguments) == 2 else "`gamma`, `alpha` and `s`"
        shapes = ", ".join(str(each.shape) for each in arguments)
        raise ArgumentError(f"{names} must broadcast, but are of the shapes {shapes}") from None
    shape, flat = broadcast[0].shape, [np.ravel(each) for each in broadcast]
    with np.errstate(under="ignore"):
        if flat[0].size <= BLOCK:
            return tuple(each.reshape(shape) for each in compute(*flat))
        parts = [compute(*(each[i : i + BLOCK] for each in flat)) for i in range(0, flat[0].size, BLOCK)]
    return tuple(np.concatenate(column).reshape(shape) for column in zip(*parts, strict=True))


def _profile(gamma: Array, alpha: Array, s: Array, *depth: Array) -> tuple[Array, ...]:
    orbit, odd = _orbit(gamma, alpha, *depth)
    phi, slope, theta0, theta0_slope, x, y, _ = _at(orbit, s)
    return odd * phi, odd * slope, theta0, theta0_slope, x, odd * y


def _ends(gamma: Array, alpha: Array, *depth: Array) -> tuple[Array, ...]:
    orbit, odd = _orbit(gamma, alpha, *depth)
    phi, slope, theta0, theta0_slope, x, y, arm = _at(orbit, np.ones_like(gamma), arm=True)
    return odd * phi, odd * slope, theta0, theta0_slope, x, odd * y, odd * arm


def _orbit(gamma: Array, alpha: Array, depth: Array | None = None) -> tuple[_Orbit, Array]:
    """The elliptic parameter of each orbit, and the factor of what is odd in alpha."""
    if depth is not None:
        return _deep_orbit(gamma, alpha, depth)
    size = np.maximum(np.abs(alpha), FLOOR)
    square, four = size * size, 4.0 * gamma
    difference = _difference(four, size, square)
    librating = difference >= 0.0
    largest = np.where(librating, four, square)
    rate = np.where(librating, np.sqrt(gamma), 0.5 * size)
    m = np.where(librating, square, four) / largest
    return _Orbit(gamma, size, librating, rate, m, np.abs(difference) / largest), alpha / size


def _deep_orbit(gamma: Array, alpha: Array, depth: Array) -> tuple[_Orbit, Array]:
    """The same from the depth: m = tanh^2, m1 = 1/cosh^2."""
    librating, deep = depth >= 0.0, np.maximum(np.abs(depth), FLOOR)
    root, part = np.sqrt(gamma), np.tanh(deep)
    size = np.where(librating, 2.0 * root * part, 2.0 * root / part)
    rate = np.where(librating, root, 0.5 * size)
    return _Orbit(gamma, size, librating, rate, part * part, np.cosh(deep) ** -2.0), np.sign(alpha)


def _difference(four: Array, size: Array, square: Array) -> Array:
    """4 gamma - alpha^2 to its own relative accuracy, by Dekker's product."""
    high = SPLIT * size
    high = high - (high - size)
    low = size - high
    error = ((high * high - square) + 2.0 * high * low) + low * low
    return (four - square) - error


def _at(orbit: _Orbit, s: Array, *, arm: bool = False) -> tuple[Array, ...]:
    """Everything at s for alpha > 0; the arm too (at s = 1), or nothing in its place."""
    _, alpha, librating, rate, m, m1 = orbit
    u = rate * s
    f = jacobi(u, m, m1)
    phi = _angle(orbit, f)
    slope = alpha * np.where(librating, f.cn, f.dn)
    nd_square = u + m * f.sd_square
    theta0 = np.where(librating, f.sn / f.dn - m * f.cn * f.sd_square, f.dn * nd_square) / rate
    twist = m * f.sn * np.where(librating, f.dn * f.sd_square, -f.cn * nd_square)
    theta0_slope = np.where(librating, f.cn, 1.0 / f.dn) + twist
    along = f.cosine / rate
    x = np.where(librating, m1 * s + m * along, along)
    y = _across(orbit, f)
    lever = _arm(orbit, u, phi, slope, y) if arm else phi
    return phi, slope, theta0, theta0_slope, x, y, lever


def _angle(orbit: _Orbit, f: Jacobi) -> Array:
    sign = np.where(f.half_turns % 2.0 == 0.0, 2.0, -2.0)
    across = np.where(orbit.librating, np.sqrt(orbit.m) * f.sn, sign * f.sn)
    along = np.where(orbit.librating, f.dn, sign * f.cn)
    turns = np.where(orbit.librating, 0.0, f.half_turns)
    return 2.0 * (np.arctan2(across, along) + np.pi * turns)


def _across(orbit: _Orbit, f: Jacobi) -> Array:
    """Int_0^s sin phi: alpha (1 - cn) / gamma librating, (4 / alpha) sn^2 / (1 + dn) rotating."""
    first = np.where(orbit.librating, np.abs(f.cn), f.dn)
    versine = f.sn * f.sn / (1.0 + first)
    versine = np.where(orbit.librating & (f.cn < 0.0), 1.0 + first, versine)
    return versine * orbit.alpha / (orbit.rate * orbit.rate)


def _arm(orbit: _Orbit, u: Array, phi: Array, slope: Array, y: Array) -> Array:
    """phi(1) - phi'(1) without the difference where that would lose digits."""
    arm = phi - slope
    gentle = (orbit.gamma < GENTLE_GAMMA) & (orbit.alpha < GENTLE_ALPHA)
    linear = ~orbit.librating & (orbit.m <= LINEAR) & ~gentle
    if linear.any():
        excess = amplitude_excess(u[linear], orbit.m[linear], orbit.m1[linear])
        arm[linear] = 2.0 * excess + orbit.gamma[linear] * y[linear]
    if gentle.any():
        flat, _ = _orbit(*(np.repeat(each[gentle], PLACES.size) for each in (orbit.gamma, orbit.alpha)))
        f = jacobi(flat.rate * np.tile(PLACES, int(gentle.sum())), flat.m, flat.m1)
        sine = np.sin(_angle(flat, f))
        arm[gentle] = orbit.gamma[gentle] * (sine.reshape(-1, PLACES.size) @ (WEIGHTS * PLACES))
    return arm
