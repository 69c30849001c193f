"""Run the benchmarks: all of them, or those named."""

from __future__ import annotations

import sys
from importlib import import_module

NAMES = (
    *("one_solve", "methods", "start_up", "closed_forms", "phase", "branch", "many", "sweep", "beam", "pyelastica"),
    "completeness",
    "kills",
    "memory",
    "limits",
)

if __name__ == "__main__":
    chosen = sys.argv[1:] or NAMES
    if unknown := set(chosen) - set(NAMES):
        sys.exit(f"no benchmark is called {', '.join(sorted(unknown))}; there are {', '.join(NAMES)}")
    for name in chosen:
        import_module(f"benchmarks.{name}").main()
