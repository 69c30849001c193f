"""The elastica to sixty digits by mpmath: the textbook's formulas, at the doubles that the package is given.

Theta functions and elliptic integrals of mpmath in a hundred digits: none of the forms that keep digits in doubles is
used here, and none is needed.
"""

from __future__ import annotations

from functools import cache

import mpmath as mp

DIGITS = 110
NAMES = ("phi", "slope", "theta0", "theta0_slope", "x", "y", "arm")
STEP = mp.mpf(10) ** -30


@cache
def exact(gamma: float, alpha: float, s: float = 1.0) -> dict[str, mp.mpf]:
    """Every quantity of `profile` at s, and phi - s phi' (the arm, where s = 1)."""
    with mp.workdps(DIGITS):
        return _exact(mp.mpf(gamma), mp.mpf(alpha), mp.mpf(s))


def exact_at(gamma: str, alpha: str, s: str) -> dict[str, mp.mpf]:
    """The same at decimal numbers that need not be doubles."""
    with mp.workdps(DIGITS):
        return _exact(mp.mpf(gamma), mp.mpf(alpha), mp.mpf(s))


@cache
def sensitivity(gamma: float, alpha: float, s: float = 1.0) -> dict[str, float]:
    """|gamma dq/dgamma| + |alpha dq/dalpha| of every quantity q: what relative errors of the inputs cost."""
    with mp.workdps(DIGITS):
        g, a, at = mp.mpf(gamma), mp.mpf(alpha), mp.mpf(s)
        base = _exact(g, a, at)
        thrust, clamp = _exact(g * (1 + STEP), a, at), _exact(g, a * (1 + STEP), at)
        return {q: float((abs(thrust[q] - base[q]) + abs(clamp[q] - base[q])) / STEP) for q in NAMES}


def _exact(gamma: mp.mpf, alpha: mp.mpf, s: mp.mpf) -> dict[str, mp.mpf]:
    if alpha < 0:
        mirrored = _exact(gamma, -alpha, s)
        return {q: value if q in ("theta0", "theta0_slope", "x") else -value for q, value in mirrored.items()}
    if alpha == 0:
        values = _straight(gamma, s)
    elif gamma == 0:
        values = (alpha * s, alpha, s, mp.mpf(1), mp.sin(alpha * s) / alpha, (1 - mp.cos(alpha * s)) / alpha)
    elif alpha * alpha == 4 * gamma:
        values = _separatrix(gamma, s)
    else:
        values = (_librating if alpha * alpha < 4 * gamma else _rotating)(gamma, alpha, s)
    return dict(zip(NAMES, (*values, values[0] - s * values[1]), strict=True))


def _straight(gamma: mp.mpf, s: mp.mpf) -> tuple[mp.mpf, ...]:
    w = mp.sqrt(gamma)
    return mp.mpf(0), mp.mpf(0), mp.sin(w * s) / w if w else s, mp.cos(w * s), s, mp.mpf(0)


def _separatrix(gamma: mp.mpf, s: mp.mpf) -> tuple[mp.mpf, ...]:
    w = mp.sqrt(gamma)
    u = w * s
    slope = 2 * w * mp.sech(u)
    theta0 = (mp.sinh(u) + u * mp.sech(u)) / (2 * w)
    theta0_slope = (mp.cosh(u) + mp.sech(u) - u * mp.sech(u) * mp.tanh(u)) / 2
    return 4 * mp.atan(mp.tanh(u / 2)), slope, theta0, theta0_slope, 2 * mp.tanh(u) / w - s, (2 * w - slope) / gamma


def _functions(u: mp.mpf, m: mp.mpf) -> tuple[mp.mpf, ...]:
    """sn, cn, dn, am, the integral of dn^2 and that of nd^2 from 0 to u."""
    sn, cn, dn = (mp.ellipfun(name, u, m=m) for name in ("sn", "cn", "dn"))
    turns = mp.nint(u / (2 * mp.ellipk(m)))
    sign = (-1) ** int(turns)
    am = turns * mp.pi + mp.atan2(sign * sn, sign * cn)
    epsilon = mp.ellipe(am, m)
    return sn, cn, dn, am, epsilon, (epsilon - m * sn * cn / dn) / (1 - m)


def _librating(gamma: mp.mpf, alpha: mp.mpf, s: mp.mpf) -> tuple[mp.mpf, ...]:
    w = mp.sqrt(gamma)
    u, k = w * s, alpha / (2 * w)
    sn, cn, dn, _, epsilon, nd = _functions(u, k * k)
    phi, slope = 2 * mp.atan2(k * sn, dn), alpha * cn
    theta0 = (sn / dn + cn * (u - nd)) / w
    return phi, slope, theta0, cn - sn * dn * (u - nd), 2 * epsilon / w - s, (alpha - slope) / gamma


def _rotating(gamma: mp.mpf, alpha: mp.mpf, s: mp.mpf) -> tuple[mp.mpf, ...]:
    m, v = 4 * gamma / alpha**2, alpha * s / 2
    sn, cn, dn, am, epsilon, nd = _functions(v, m)
    slope = alpha * dn
    x = (1 - 2 / m) * s + 4 / (alpha * m) * epsilon
    return 2 * am, slope, 2 / alpha * dn * nd, 1 / dn - m * sn * cn * nd, x, (alpha - slope) / gamma
