"""Jacobi's elliptic functions and two of their integrals, from the parameter and its complement.

The complement m1 = 1 - m is an argument of its own: near m = 1 it carries the digits that m has lost.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy import special

__all__ = ["Jacobi", "amplitude_excess", "jacobi"]

Array = NDArray[np.float64]

NEGLIGIBLE = 4e-9
"""Modulus whose square is below the rounding of one: the elliptic functions are circular there."""

NEAR = 0.5
"""sn^2 below which cn and dn are formed from sn: near one they say too little of u to be doubled at each step."""

EXCESS_TERMS = 9
"""Of the Fourier series of am; for m <= 1/4 the nome is below 0.0181 and the tenth term 2e-17 of the first."""


class Jacobi(NamedTuple):
    """Elliptic functions of one argument u and parameter m, and two integrals from 0 to u; arrays of one shape.

    Attributes
    ----------
    sn, cn, dn : ndarray
        Jacobi's three functions.
    half_turns : ndarray
        The whole number j for which u - 2 j K lies in [-K, K]; am u = j pi + atan2((-1)^j sn, (-1)^j cn).
    cosine : ndarray
        Integral of cos(2 am) = 1 - 2 sn^2.
    sd_square : ndarray
        Integral of sd^2 = (sn/dn)^2, so that the integral of nd^2 is u + m times it.
    """

    sn: Array
    cn: Array
    dn: Array
    half_turns: Array
    cosine: Array
    sd_square: Array


def jacobi(u: Array, m: Array, m1: Array) -> Jacobi:
    """Return the elliptic functions of u >= 0 and their integrals.

    Landen's descending transformation (with k1 = (1-k')/(1+k'), u1 = u/(1+k1))::

        sn = (1+k1) sn1 / (1 + k1 sn1^2)        cn = cn1 dn1 / (1 + k1 sn1^2)
        dn = ((1-k1) + k1 cn1^2) / (1 + k1 sn1^2)
        P  = -k1 u / 2 + k1 (1+k1) P1 / 2 + (1+k1) sn1 cn1 dn1 / (1 + k1 sn1^2)

    where P is the integral of cos(2 am), which follows from Gauss's transformation of E. No step subtracts what
    nearly cancels: 1 - k1 = 2k'/(1+k') is formed from k'; where sn^2 < 1/2, cn and dn are formed anew from sn. The
    integral of sd^2 is Carlson's sn^3 R_D(cn^2, 1, dn^2) / 3 on |u| <= K, and multiples of its value at K beyond.

    Parameters
    ----------
    u : ndarray, shape (n,)
        Arguments.
    m, m1 : ndarray, shape (n,)
        Parameter in [0, 1] and its complement 1 - m, each with its own digits; m1 = 0 gives hyperbolic functions.

    Returns
    -------
    Jacobi
    """
    flat = m1 == 0.0
    sn, cn, dn, cosine, turned, mean = _descended(u, np.where(flat, 0.0, m), np.where(flat, 1.0, m1))
    if flat.any():
        over = u[flat]
        sn[flat], cn[flat], dn[flat] = np.tanh(over), 1.0 / np.cosh(over), 1.0 / np.cosh(over)
        cosine[flat], turned[flat] = 2.0 * sn[flat] - over, 0.0
    j = np.rint(turned / np.pi)
    from_turn = np.where(j % 2.0 == 0.0, sn, -sn)
    square = from_turn**3 / 3.0 * special.elliprd(cn * cn, 1.0, dn * dn)
    beyond = j > 0.0
    if beyond.any():
        whole = j[beyond] * np.pi * u[beyond] / turned[beyond]
        square[beyond] += whole * (1.0 + mean[beyond]) / (2.0 * m1[beyond])
    return Jacobi(sn, cn, dn, j, cosine, square)


def _descended(u: Array, m: Array, m1: Array) -> tuple[Array, Array, Array, Array, Array, Array]:
    """Landen's chain: sn, cn, dn, the integral of cos(2 am), pi u / (2 K), and the mean of cos(2 am)."""
    steps = []
    k_squared, kc = m, np.sqrt(m1)
    while True:
        half = 0.5 * (1.0 + kc)
        rise = 0.25 * k_squared / half
        steps.append((u, k_squared, kc, half, rise))
        u, k = u * half, rise / half
        if not np.any(k > NEGLIGIBLE):
            break
        k_squared, kc = k * k, np.sqrt(kc) / half
    s, c, d = np.sin(u), np.cos(u), np.ones_like(u)
    cosine, mean = s * c, np.zeros_like(u)
    for argument, k_squared, kc, half, rise in reversed(steps):
        # With half = 1/(1+k1) and rise = k1/(1+k1) the rounding of half goes as it came, in u and in sn.
        over = 1.0 / (half + rise * s * s)
        both, k = s * c * d * over, 0.5 * rise / half
        cosine, mean = k * (cosine / half - argument) + both, k * (mean - 1.0)
        s, c, d = s * over, half * c * d * over, (kc + rise * c * c) * over
        square = np.minimum(s * s, NEAR)
        near = square < NEAR
        c = np.where(near, np.copysign(np.sqrt(1.0 - square), c), c)
        d = np.where(near, np.sqrt(1.0 - k_squared * square), d)
    return s, c, d, cosine, u, mean


def amplitude_excess(u: Array, m: Array, m1: Array) -> Array:
    """Return am(u) - u for 0 <= m <= 1/4, without the difference.

    With x = pi u / (2 K) and the nome q, am u = x + sum 2 q^n sin(2 n x) / (n (1 + q^(2n))); x - u is the sum of the
    differences of the arithmetic-geometric mean. Both parts are of the size of m.

    Parameters
    ----------
    u, m, m1 : ndarray, shape (n,)
        Argument, parameter and its complement.

    Returns
    -------
    ndarray, shape (n,)
    """
    kc = np.sqrt(m1)
    root = np.sqrt(kc)
    seed = 0.5 * m / ((1.0 + kc) * (1.0 + root) ** 2)
    q = seed * (1.0 + seed**4 * (2.0 + 15.0 * seed**4))
    mean, other, part = 0.5 * (1.0 + kc), root, 0.5 * m / (1.0 + kc)
    loss = part
    for _ in range(3):
        mean, other = 0.5 * (mean + other), np.sqrt(mean * other)
        part = 0.25 * part * part / mean
        loss = loss + part
    x = 2.0 * (u - loss * u)
    before, now, twice = np.zeros_like(x), np.sin(x), 2.0 * np.cos(x)
    power, total = q, -loss * u
    for n in range(1, EXCESS_TERMS + 1):
        total = total + 2.0 * power / (n * (1.0 + power * power)) * now
        before, now, power = now, twice * now - before, power * q
    return total
