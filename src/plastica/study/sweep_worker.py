"""A process that computes chunks of a sweep: it is told their numbers on standard input, and answers a line for each.

Started by `sweep_engines` as ``python -m plastica.study.sweep_worker FOLDER``. It ends with its input: whatever kills
the process that started it, it does not outlive that by more than the chunk it is at.
"""

from __future__ import annotations

import json
import os
import signal
import sys
import warnings
from collections.abc import Sequence
from dataclasses import asdict
from typing import IO, Any

from plastica.errors import PlasticaError

__all__ = ["main"]


def main(arguments: Sequence[str], given: IO[str], answers: IO[str]) -> int:
    """Compute what is asked for.

    Parameters
    ----------
    arguments : sequence of str
        The folder of the sweep.
    given : stream
        Numbers of chunks, a line each.
    answers : stream
        Takes what became of each, a line of JSON: the fields of `Told`, or "error".

    Returns
    -------
    int
        0, or 2 where the sweep cannot be used.
    """
    from plastica.study.sweep_store import open_store
    from plastica.study.sweep_tasks import run_chunk

    def answer(told: dict[str, Any]) -> None:
        answers.write(json.dumps(told) + "\n")
        answers.flush()

    try:
        store = open_store(arguments[0])
        store.check_versions()
        answer({"ready": os.getpid()})
        for line in given:
            answer(asdict(run_chunk(store, int(line))))
    except (PlasticaError, OSError) as error:
        answer({"error": str(error)})
        return 2
    return 0


def _as_process() -> int:
    # Ctrl-C goes to every process of a terminal: the one that started this one sees to its end.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    warnings.simplefilter("ignore")
    # Nothing that a library prints may stand among the answers.
    answers = os.fdopen(os.dup(sys.stdout.fileno()), "w", encoding="utf-8")
    os.dup2(sys.stderr.fileno(), sys.stdout.fileno())
    return main(sys.argv[1:], sys.stdin, answers)


if __name__ == "__main__":
    sys.exit(_as_process())
