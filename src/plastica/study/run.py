"""Run a scenario: solve it, and put its results into one folder."""

from __future__ import annotations

import time
import tomllib
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, replace
from os import PathLike
from pathlib import Path

from plastica.errors import FileError, one_line, unusable
from plastica.files import refuse_overwriting
from plastica.locks import held
from plastica.motion.solution import Solution
from plastica.motion.solve import Progress, solve
from plastica.study.building import named_files
from plastica.study.export import write_csv
from plastica.study.scenario import Scenario, read_scenario

__all__ = ["Finished", "checkpoint_folder", "default_folder", "planned_files", "run", "run_scenario", "solved"]


@dataclass(frozen=True, eq=False)
class Finished:
    """What came of a scenario.

    Attributes
    ----------
    scenario : Scenario
        What was asked.
    solution : Solution
        What was computed; its status says how it ended.
    files : tuple of Path
        What was written.
    seconds : float
        Wall time of it all.
    """

    scenario: Scenario
    solution: Solution
    files: tuple[Path, ...]
    seconds: float


def default_folder(file: str | Path) -> Path:
    """Return where the results of a scenario go unless told otherwise: out/<file name>, in the present folder."""
    return Path("out") / Path(file).stem


def checkpoint_folder(scenario: Scenario, output: Path) -> Path:
    """Return where an unfinished run is kept."""
    return output / f".{scenario.name}.checkpoint"


def planned_files(scenario: Scenario, output: Path, *, report: bool = True, film: bool = True) -> dict[str, Path]:
    """Return the files that a run of a scenario writes, by kind: "result", "csv:<variable>", "report", "film"."""
    name, wanted = scenario.name, scenario.output
    files = {"result": output / f"{name}.nc"}
    files |= {f"csv:{variable}": output / f"{name}-{variable}.csv" for variable in wanted.csv}
    if report and wanted.report:
        files["report"] = output / f"{name}.html"
    if film and wanted.film != "none":
        files["film"] = output / f"{name}.{wanted.film}"
    return files


def run(
    file: str | Path,
    output: str | Path | None = None,
    *,
    resume: bool = False,
    progress: Callable[[Progress], None] | None = None,
) -> Finished:
    """Read a scenario file, solve it, and write its result and CSV files.

    Parameters
    ----------
    file : str or Path
        The scenario.
    output : str or Path, optional
        The folder of the results; by default out/<file name> in the present folder. It is made once the scenario is
        known to be right.
    resume : bool
        Go on from the checkpoint that an interrupted run has left there.
    progress : callable, optional
        Called now and then with a `Progress`.

    Returns
    -------
    Finished
        The solution, with the scenario in its provenance, and the files written.

    Raises
    ------
    PlasticaError
        Where the scenario has mistakes, or a file cannot be read or written. Numerical trouble is a status.
    """
    folder = default_folder(file) if output is None else Path(output)
    return run_scenario(read_scenario(file), folder, resume=resume, progress=progress)


def run_scenario(
    scenario: Scenario,
    output: Path,
    *,
    resume: bool = False,
    progress: Callable[[Progress], None] | None = None,
) -> Finished:
    """Solve a scenario that was read, and write its result and CSV files; see `run`."""
    began = time.perf_counter()
    prepare(scenario, output)
    keeping = checkpoint_folder(scenario, output)
    with held(keeping) as kept:
        solution = solved(scenario, progress=progress, checkpoint=kept, resume=resume)
        solution = described(scenario, solution)
        files = planned_files(scenario, output, report=False, film=False)
        written = [solution.save(files["result"])]
        for variable in scenario.output.csv:
            written.append(write_csv(solution.dataset, [variable], files[f"csv:{variable}"]))
        kept.clear()
    with suppress(OSError):
        # Another process may have come in meanwhile.
        keeping.rmdir()
    return Finished(scenario, solution, tuple(written), time.perf_counter() - began)


def solved(
    scenario: Scenario,
    *,
    progress: Callable[[Progress], None] | None = None,
    checkpoint: PathLike[str] | None = None,
    resume: bool = False,
) -> Solution:
    """Solve what a scenario asks for; the other arguments are those of `plastica.motion.solve.solve`."""
    return solve(
        scenario.model,
        scenario.curvature,
        scenario.natural_curvature,
        scenario.until,
        scenario.rtol,
        scenario.atol,
        scenario.method,
        scenario.times,
        curvature_rate=scenario.curvature_rate,
        start=scenario.start,
        max_steps=scenario.max_steps,
        progress=progress,
        checkpoint=checkpoint,
        resume=resume,
    )


def described(scenario: Scenario, solution: Solution) -> Solution:
    """Return a solution with the scenario in its provenance, and the hypotheses that it waives first in its notes."""
    waived = tuple(f"hypothesis waived by allow_inadmissible: {each.sentence}" for each in scenario.failed)
    origin = {"scenario": scenario.text, "scenario_file": one_line(scenario.file.name)}
    if scenario.title:
        origin["title"] = scenario.title
    return replace(solution, notes=(*waived, *solution.notes)).with_provenance(**origin)


def prepare(scenario: Scenario, output: Path) -> None:
    """Make the folder of the results.

    Raises
    ------
    FileError
        Where it is no folder, cannot be made, holds folders under the names of files to be written, or a file to be
        written is one that is read.
    """
    initial = tomllib.loads(scenario.text).get("initial", {})
    read = (scenario.file, *(scenario.file.parent / name for name in named_files(initial)))
    for path in planned_files(scenario, output).values():
        refuse_overwriting(path, *read)
        if path.is_dir():
            raise FileError(
                "must be a file to be written, but is a folder",
                where=str(path),
                next_step="Name another output.",
            )
    try:
        output.mkdir(parents=True, exist_ok=True)
    except (OSError, ValueError) as error:
        raise unusable(output, "made a folder", error, next_step="Name another folder with --output.") from None
