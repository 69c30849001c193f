"""A million struts to t = 100 on a GPU, beside diffrax on the same one; "not measured here" where there is none.

    python -m benchmarks.gpu [torch|cupy|jax] [MEMBERS]

Without a name every library is tried. The peer in JAX is run by the Python that PEER_PYTHON names, as in
`benchmarks.many`.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
import time
from importlib import import_module
from pathlib import Path

import numpy as np

import plastica as pl
from benchmarks import many, peers

LIBRARIES = ("torch", "cupy", "jax")
RTOL = 1e-8


def device(library: str) -> object:
    """The first GPU that a library sees; an error that says why there is none."""
    module = import_module(library)
    if library == "torch":
        if not module.cuda.is_available():
            raise RuntimeError("torch sees no GPU")
        return "cuda"
    if library == "cupy":
        if module.cuda.runtime.getDeviceCount() == 0:
            raise RuntimeError("cupy sees no GPU")
        return None
    module.config.update("jax_enable_x64", True)
    found = [each for each in module.devices() if each.platform != "cpu"]
    if not found:
        raise RuntimeError("jax sees no GPU")
    return found[0]


def measure(library: str, count: int) -> None:
    try:
        place = device(library)
    except (ImportError, RuntimeError) as error:
        print(f"{library}: not measured here ({error})")
        return

    def run(members: int) -> np.ndarray:
        found = pl.solve_many(
            many.STRUT,
            "1 + cos(3*s)",
            thrust=many.thrusts(members),
            rtol=RTOL,
            chunk=members,
            library=library,
            device=place,
        )
        return np.array([found[name].values for name in ("natural_curvature", "tip_x", "tip_y")])

    run(min(count, 4096))
    began = time.perf_counter()
    ends = run(count)
    taken = time.perf_counter() - began
    print(
        f"{library}: {count} members in {taken:.1f} s, {1e6 * taken / count:.2f} us a member, "
        f"error {many.error(ends):.1e}"
    )


def peer(count: int) -> None:
    grid = many.STRUT.grid
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "grid.npz"
        y0 = np.append(peers.initial(grid.s), 0.0)
        np.savez(file, A=grid.A, B=grid.B, w=grid.w, y0=y0, gamma=many.thrusts(count))
        python = os.environ.get("PEER_PYTHON", sys.executable)
        command = [python, str(many.HERE / "diffrax_peer.py"), str(file), "gpu"]
        done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        print(f"diffrax: not measured here ({done.stderr.strip().splitlines()[-1]})")
        return
    for line in done.stdout.splitlines():
        told = json.loads(line)
        print(f"diffrax Tsit5 at {told['rtol']:g}: {1e6 * told['each']:.2f} us, error {many.error(told['ends']):.1e}")


def main() -> None:
    chosen = [word for word in sys.argv[1:] if word in LIBRARIES] or LIBRARIES
    count = next((int(word) for word in sys.argv[1:] if word.isdigit()), 10**6)
    for library in chosen:
        measure(library, count)
    peer(count)


if __name__ == "__main__":
    main()
