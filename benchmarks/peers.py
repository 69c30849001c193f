"""What a user would write by hand: the strut on Gauss nodes in NumPy, and on finite differences."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.integrate import cumulative_trapezoid, solve_ivp, trapezoid

import plastica as pl

GAMMA, K, C, H = 3.0, 1.0, 1.0, 0.1


def initial(s: np.ndarray) -> np.ndarray:
    return 1.0 + np.cos(3.0 * s)


def gauss(nodes: int = 16) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    grid = pl.Grid(nodes)
    return grid.s, grid.w, grid.A, GAMMA * grid.B


def bare(method: str, rtol: float, atol: float, until: float = 100.0, nodes: int = 16) -> Any:
    """The motion alone: no ledger, no events, no dense output."""
    s, w, A, gB = gauss(nodes)
    n = s.size

    def rate(t: float, y: np.ndarray) -> np.ndarray:
        mu, m = y[:n], y[n]
        out = np.empty(n + 1)
        out[:n] = m - mu + gB @ np.sin(A @ mu)
        drive = w @ mu - m - K * m
        up, down = drive - H, -H - drive
        out[n] = (C * up * up if up > 0.0 else 0.0) - (C * down * down if down > 0.0 else 0.0)
        return out

    return solve_ivp(rate, (0.0, until), np.append(initial(s), 0.0), method=method, rtol=rtol, atol=atol)


def complete(method: str, rtol: float, atol: float, until: float = 100.0, nodes: int = 16) -> Any:
    """The motion with the same ledger quadratures, events and dense output as `solve`."""
    s, w, A, gB = gauss(nodes)
    n = s.size

    def rate(t: float, y: np.ndarray) -> np.ndarray:
        mu, m = y[:n], y[n]
        out = np.empty(n + 4)
        couple = gB @ np.sin(A @ mu)
        mu_t = m - mu + couple
        drive = w @ mu - m - K * m
        up, down = drive - H, -H - drive
        m_t = (C * up * up if up > 0.0 else 0.0) - (C * down * down if down > 0.0 else 0.0)
        weighted = w * mu_t
        out[:n] = mu_t
        out[n] = m_t
        out[n + 1] = weighted @ couple
        out[n + 2] = weighted @ mu_t
        out[n + 3] = drive * m_t
        return out

    def yielding(t: float, y: np.ndarray) -> float:
        return float(abs(w @ y[:n] - y[n] - K * y[n]) - H)

    def quarter(t: float, y: np.ndarray) -> float:
        return float(abs(w @ y[:n]) - 0.5 * np.pi)

    start = np.concatenate([initial(s), np.zeros(4)])
    options = {"method": method, "rtol": rtol, "atol": atol, "events": [yielding, quarter], "dense_output": True}
    return solve_ivp(rate, (0.0, until), start, **options)


def trapezoids(cells: int, method: str = "BDF", rtol: float = 1e-6, until: float = 100.0) -> tuple[float, float, float]:
    """What a user would write: curvature at equidistant points, SciPy's trapezoidal rule for the integrals.

    Returns the natural curvature, the tip's deflection and the curvature at mid-length.
    """
    s = np.linspace(0.0, 1.0, cells + 1)

    def rate(t: float, y: np.ndarray) -> np.ndarray:
        mu, m = y[:-1], y[-1]
        theta = cumulative_trapezoid(mu, s, initial=0.0)
        along = cumulative_trapezoid(np.sin(theta), s, initial=0.0)
        drive = theta[-1] - m - K * m
        m_t = C * max(drive - H, 0.0) ** 2 - C * max(-H - drive, 0.0) ** 2
        return np.append(m - mu + GAMMA * (along[-1] - along), m_t)

    start = np.append(initial(s), 0.0)
    solution = solve_ivp(rate, (0.0, until), start, method=method, rtol=rtol, atol=1e-3 * rtol)
    mu, m = solution.y[:-1, -1], float(solution.y[-1, -1])
    theta = cumulative_trapezoid(mu, s, initial=0.0)
    return m, float(trapezoid(np.sin(theta), s)), float(mu[cells // 2])


def midpoints(cells: int, method: str = "BDF", rtol: float = 1e-6, until: float = 100.0) -> tuple[float, float, float]:
    """The same by somebody who tunes: midpoint sums, half the error of trapezoids, at half their cost.

    Returns the natural curvature, the tip's deflection and the curvature at mid-length.
    """
    h = 1.0 / cells
    s = (np.arange(cells) + 0.5) * h

    def rate(t: float, y: np.ndarray) -> np.ndarray:
        mu, m = y[:cells], y[cells]
        theta = h * (np.cumsum(mu) - 0.5 * mu)
        sine = np.sin(theta)
        couple = GAMMA * h * (np.cumsum(sine[::-1])[::-1] - 0.5 * sine)
        drive = h * mu.sum() - m - K * m
        up, down = drive - H, -H - drive
        m_t = (C * up * up if up > 0.0 else 0.0) - (C * down * down if down > 0.0 else 0.0)
        return np.append(m - mu + couple, m_t)

    start = np.append(initial(s), 0.0)
    solution = solve_ivp(rate, (0.0, until), start, method=method, rtol=rtol, atol=1e-3 * rtol)
    mu, m = solution.y[:cells, -1], float(solution.y[cells, -1])
    theta = h * (np.cumsum(mu) - 0.5 * mu)
    middle = 0.5 * (mu[cells // 2 - 1] + mu[cells // 2])
    return m, float(h * np.sin(theta).sum()), float(middle)
