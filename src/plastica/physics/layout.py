"""Where the parts of a state stand in the one vector that solvers see."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

__all__ = ["LEDGER", "Layout"]

Array = NDArray[np.float64]

LEDGER = 3
"""How many integrals of the ledger ride along: work, viscous and natural dissipation."""


@dataclass(frozen=True, eq=False)
class Layout:
    """y = (mu at the n nodes, mu_nat of the m segments, the ledger, and with inertia the swing at the n nodes).

    The swing S mu_t stands for the rate of curvature: measured by it, an error costs as much energy as the same error
    of the curvature, at whatever wave length. Errors of mu_t itself are all but those of the shortest waves: on the
    problem BEAM solvers that look at them take fifty times the steps.

    Parameters
    ----------
    nodes, segments : int
        n and m.
    swing : ndarray of shape (n, n), or None
        S, where the rate of curvature is part of the state.
    """

    nodes: int
    segments: int
    swing: Array | None = None

    @property
    def inertia(self) -> bool:
        """Whether the rate of curvature is part of the state."""
        return self.swing is not None

    @cached_property
    def unwind(self) -> Array:
        """The inverse of S; shape (n, n)."""
        return np.asarray(np.linalg.inv(np.zeros((0, 0)) if self.swing is None else self.swing), dtype=float)

    @property
    def natural_columns(self) -> slice:
        """Columns of the natural curvatures."""
        return slice(self.nodes, self.nodes + self.segments)

    @property
    def ledger_columns(self) -> slice:
        """Columns of work, viscous dissipation and natural dissipation."""
        return slice(self.nodes + self.segments, self.nodes + self.segments + LEDGER)

    @property
    def rate_columns(self) -> slice:
        """Columns of the swing; empty without inertia."""
        return slice(self.nodes + self.segments + LEDGER, self.size)

    @property
    def size(self) -> int:
        """Length of a state."""
        return self.nodes * (2 if self.inertia else 1) + self.segments + LEDGER

    def mu(self, y: Array) -> Array:
        """Curvature at the nodes; shape (..., n)."""
        return y[..., : self.nodes]

    def natural(self, y: Array) -> Array:
        """Natural curvature by segment; shape (..., m), or (...) where m = 1."""
        if self.segments == 1:
            return np.asarray(y[..., self.nodes])
        return y[..., self.natural_columns]

    def ledger(self, y: Array) -> Array:
        """Work, viscous dissipation and natural dissipation; shape (..., 3)."""
        return y[..., self.ledger_columns]

    def mu_t(self, y: Array) -> Array | None:
        """Rate of curvature at the nodes, shape (..., n); None where it is no part of the state."""
        return np.asarray(y[..., self.rate_columns] @ self.unwind.T) if self.inertia else None

    def pack(self, mu: Array, natural: Array | float, mu_t: Array | None = None) -> Array:
        """Return the state with an empty ledger; mu_t is 0 where it is part of the state and not given."""
        y = np.zeros(self.size)
        y[: self.nodes], y[self.natural_columns] = mu, natural
        if self.swing is not None and mu_t is not None:
            y[self.rate_columns] = self.swing @ mu_t
        return y
