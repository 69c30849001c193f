"""Sweeps that several tests need."""

from __future__ import annotations

from typing import Any

import numpy as np

from plastica.study.reading import document_of
from plastica.study.sweep_plan import Plan
from plastica.study.sweep_reading import make_plan
from tests.commandline import scenario


def plan(over: dict[str, Any] | None = None, text: str | None = None, **table: Any) -> Plan:
    return make_plan(document_of(text or scenario(), "strut.toml"), {"over": over, **table})


def values(made: Plan) -> np.ndarray:
    return np.concatenate(list(made.members.blocks(1000)))


REGIME_SWEEP = scenario(solve="until = 30.0") + (
    '[sweep]\noutputs = ["final", "verdict"]\n[sweep.over]\n'
    "load.thrust = { from = 0.5, to = 5.0, count = 6 }\n"
    '"initial.amplitude" = { from = 0.1, to = 30.0, count = 5, spacing = "log" }\n'
)
"""Thirty members that come to four regimes."""
