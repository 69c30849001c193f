"""What memory a long run takes: by its steps, where times are given and where not, and of a million steps on 32 nodes.

Each figure is the most that a process of its own held at a time, beyond what it held before (`ru_maxrss`). The million
steps are made up, not integrated: what is measured is how they are kept.
"""

from __future__ import annotations

import multiprocessing
import resource
import tempfile
from collections.abc import Callable
from functools import partial
from multiprocessing.connection import Connection
from pathlib import Path
from unittest.mock import patch

import numpy as np

import plastica as pl
from benchmarks.timing import machine
from plastica.motion import retention
from plastica.motion.history import History
from plastica.motion.integrate import Leg
from plastica.motion.retention import Retention

FORK = multiprocessing.get_context("fork")
STEPS = (10_000, 40_000)
SMALL = 2**22
"""Bytes of states kept whole in the runs here, so that what happens beyond shows at once."""

MILLION, LEG, NODES, DEGREE = 1_000_000, 2000, 32, 6


def model(nodes: int) -> pl.Rod:
    material = pl.catalogue.material("one-shape")
    return pl.Rod(material, pl.Load(), pl.Grid(nodes), translational_inertia=1.0, damping=0.0)


def swing(steps: int, times: list[float] | None, folder: Path | None) -> None:
    """Let a rod swing for so many steps."""
    with patch.object(retention, "WHOLE", SMALL):
        made = pl.solve(
            model(8), 0.01, until=1e6, rtol=1e-3, method="DOP853", max_steps=steps, times=times, checkpoint=folder
        )
    assert made.counts.steps == steps


def million(times: bool, folder: Path) -> None:
    """Keep a million steps on 32 nodes, in legs as they come from the integrator."""
    strut = pl.Strut(pl.catalogue.material("one-shape"), pl.Load(thrust=1.0), pl.Grid(NODES))
    kept = Retention(strut, np.array([0.0, 1.0, 1e5]) if times else None, folder)
    first = np.arange(0, LEG * (DEGREE + 1) + 1, DEGREE + 1)
    place = np.linspace(0.0, 1.0, DEGREE + 1)
    for start in range(0, MILLION, LEG):
        t = (start + np.arange(LEG)[:, None] + place).ravel()
        y = 0.1 * np.sin(t[:, None] + np.arange(strut.layout.size))
        kept.add(Leg(History(t, y, first), "full", (True,), (True,), "", 0, 0))
    history = kept.history()
    assert kept.steps == MILLION
    assert history.end == MILLION


def beyond(act: Callable[[], None]) -> float:
    """Return the mebibytes that an act takes at the most, in a process of its own."""
    here, there = FORK.Pipe()

    def measured(told: Connection) -> None:
        before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
        act()
        told.send((resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before) / 1024.0)

    process = FORK.Process(target=measured, args=(there,))
    process.start()
    found = float(here.recv())
    process.join()
    return found


def main() -> None:
    """Print memory over steps."""
    print(f"memory: {machine()}")
    with tempfile.TemporaryDirectory() as root:
        swing(100, None, None)
        for words, times, kept in (
            ("times given", [0.0, 1.0], False),
            ("no times, with a checkpoint", None, True),
            ("no times, no checkpoint", None, False),
        ):
            folder = Path(root) / "kept" if kept else None
            found = [beyond(partial(swing, n, times, folder)) for n in STEPS]
            print(f"{words}: {found[0]:.0f} MiB for {STEPS[0]} steps, {found[1]:.0f} MiB for {STEPS[1]}")
        for words, given in (("times given", True), ("no times, with a checkpoint", False)):
            found_million = beyond(partial(million, given, Path(root)))
            print(f"a million steps on {NODES} nodes, {words}: {found_million:.0f} MiB")
