"""What kill -9 at random moments does to a run: once, twice, and with two processes in one folder at a time.

Each trial starts `plastica run` in a process of its own, kills it, and in the end takes the run up once more. What must
come out is the result of the run that nobody killed, to the last bit, and nothing must be left beside it.
"""

from __future__ import annotations

import contextlib
import io
import multiprocessing
import random
import tempfile
import time
from functools import partial
from pathlib import Path
from unittest.mock import patch

import plastica as pl
from benchmarks.timing import machine
from plastica.doors.cli import main as command_line
from plastica.motion.checkpoint import PATTERN
from plastica.motion.solve import solve
from plastica.study import run as runs

TRIALS = 100
WAYS = ("once", "twice", "two at a time", "two at a time, twice")

TEXT = """
schema = 1
units = "dimensionless"
[material]
name = "one-shape"
[load]
thrust = { program = "cycles", low = 0.0, high = 3.0, period = 2.0, count = 40 }
[initial]
curvature = "0.3*cos(2*s)"
[grid]
nodes = 12
[solve]
until = 80.0
rtol = 1e-8
[output]
film = "none"
report = false
"""

FORK = multiprocessing.get_context("fork")


def run(file: Path, folder: Path) -> int:
    """Run the scenario, or go on with it; every leg is written at once."""
    often = partial(solve, checkpoint_every=0.0)
    with patch.object(runs, "solve", often), contextlib.redirect_stderr(io.StringIO()):
        return command_line(["run", str(file), "--output", str(folder), "--resume", "--quiet"])


def killed(file: Path, folder: Path, moments: list[float]) -> None:
    """Start as many processes as there are moments, and kill each at its own."""
    processes = [FORK.Process(target=run, args=(file, folder)) for _ in moments]
    began = time.perf_counter()
    for process in processes:
        process.start()
    for moment, process in sorted(zip(moments, processes, strict=True), key=lambda pair: pair[0]):
        time.sleep(max(0.0, began + moment - time.perf_counter()))
        process.kill()
    for process in processes:
        process.join()


def main() -> None:
    """Print how many of the trials came out right, and what the kills met."""
    print(f"kills: {machine()}")
    draw = random.Random(1)  # noqa: S311
    with tempfile.TemporaryDirectory() as root:
        file = Path(root) / "long.toml"
        file.write_text(TEXT, encoding="utf-8")
        # The first run imports what the forked ones find there.
        for _ in range(2):
            began = time.perf_counter()
            assert run(file, Path(root) / "whole") == 0
            length = time.perf_counter() - began
        whole = pl.read(Path(root) / "whole" / "long.nc")
        met: dict[str, list[int]] = {way: [] for way in WAYS}
        wrong = 0
        for trial in range(TRIALS):
            way, folder = WAYS[trial % len(WAYS)], Path(root) / f"trial{trial}"
            for _ in range(2 if "twice" in way else 1):
                count = 2 if "two" in way else 1
                killed(file, folder, [draw.uniform(0.0, 1.05 * length) for _ in range(count)])
            met[way].append(len(list(folder.glob(f".long.checkpoint/{PATTERN}"))))
            code = run(file, folder)
            back = pl.read(folder / "long.nc")
            right = code == 0 and back == whole and back.dataset.identical(whole.dataset)
            right = right and [path.name for path in folder.iterdir()] == ["long.nc"]
            if not right:
                wrong += 1
                print(f"trial {trial} ({way}): code {code}, {sorted(path.name for path in folder.iterdir())}")
        for way, found in met.items():
            print(f"killed {way}: {len(found)} trials, {min(found)} to {max(found)} segments found")
        print(f"{TRIALS - wrong} of {TRIALS} ended as if nobody had been killed (a run takes {length:.2f} s)")
