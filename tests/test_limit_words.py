"""Claim: where a state ends is told in sentences that can be read."""

from __future__ import annotations

import numpy as np

import plastica as pl
from tests.support import pair


def test_an_unstable_end_is_told_in_a_whole_sentence() -> None:
    """The straight rod above Euler's load: frozen, and a resting place only for who does not touch it."""
    strut = pl.Strut(pair("A"), pl.Load(thrust=3.0), pl.Grid(16))
    limit = pl.predict_limit(strut, np.zeros(16), 0.0)
    assert (limit.kind, limit.stable) == ("interior", False)
    assert limit.sentence == (
        "It ends at the static shape of its natural curvature, which is frozen, but only if nothing disturbs it: that "
        "shape is unstable."
    )


def test_a_stable_end_tells_its_rate() -> None:
    strut = pl.Strut(pair("A"), pl.Load(thrust=1.0), pl.Grid(16))
    limit = pl.predict_limit(strut, np.zeros(16), 0.0)
    assert limit.stable
    assert limit.sentence == (
        "It ends at the static shape of its natural curvature, which is frozen: it approaches exponentially, at the "
        f"rate {limit.rate:.4g} per retardation time."
    )
