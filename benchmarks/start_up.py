"""Wall time of `plastica run` without report, beside the imports it cannot do without."""

from __future__ import annotations

import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

from benchmarks.timing import machine, verdict

IMPORTS = "import numpy, scipy.integrate, xarray, sympy, pint, pydantic"
SCENARIO = Path(__file__).parent.parent / "examples" / "pmma_strip.toml"


def wall(command: list[str]) -> float:
    began = time.perf_counter()
    subprocess.run(command, check=True, capture_output=True)
    return time.perf_counter() - began


def main() -> None:
    print(f"start-up ({machine()})")
    with tempfile.TemporaryDirectory() as folder:
        run = [sys.executable, "-m", "plastica", "run", str(SCENARIO), "--output", folder, "--no-report", "--quiet"]
        imports = [sys.executable, "-c", IMPORTS]
        wall(run), wall(imports)
        pairs = [(wall(run), wall(imports)) for _ in range(7)]
    mine, theirs = (statistics.median(times) for times in zip(*pairs, strict=True))
    print(f"plastica run: {mine:.2f} s; the imports alone: {theirs:.2f} s")
    print("  " + verdict("against the imports", mine / theirs, 3.0))
