"""What `plastica run` and `plastica check` do with one scenario, and with a folder of them."""

from __future__ import annotations

import time
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from plastica.doors.numbers import check_facts, result_facts
from plastica.doors.telling import DONE, FAILED, NO_MEMORY, exit_code
from plastica.errors import FileError, PlasticaError, StorageError

if TYPE_CHECKING:
    from plastica.study.run import Finished

__all__ = ["Options", "Ran", "attempted", "batch", "checked", "has_kept", "scenario_files", "single"]


@dataclass(frozen=True)
class Options:
    """How to run: where to, and what to leave out."""

    output: Path | None
    resume: bool = False
    quiet: bool = False
    report: bool = True
    film: bool = True


@dataclass(frozen=True)
class Ran:
    """One scenario that was run, checked or refused.

    Attributes
    ----------
    file : Path
        The scenario.
    code : int
        0 done, 1 computation failed, 2 mistake.
    message : str
        What to tell on standard error; "" if all is well.
    facts : dict
        What became of the rod, or what was understood of it; empty if the run was refused.
    files : tuple of Path
        What was written.
    seconds : float
        Wall time.
    """

    file: Path
    code: int
    message: str
    facts: dict[str, Any]
    files: tuple[Path, ...]
    seconds: float

    @property
    def words(self) -> str:
        """The end of the story in a few words."""
        if self.facts and self.code == 0:
            return str(self.facts["verdict"]["headline"])
        # What a run that failed would show is the verdict on a part of what was asked.
        status = self.facts.get("status")
        return (
            f"{status['code']}: {status['sentence']}" if status and not status["ok"] else self.message.splitlines()[0]
        )

    def as_json(self) -> dict[str, Any]:
        """Return everything as plain values."""
        error = {"error": self.message} if self.message else {}
        rest = {
            "exit_code": self.code,
            **error,
            **self.facts,
            "files": list(self.files),
            "seconds": self.seconds,
        }
        return {"scenario": self.file, **rest}


def single(file: Path, options: Options) -> Ran:
    """Run one scenario and write everything it asks for.

    Raises
    ------
    PlasticaError
        Where the scenario has mistakes.
    """
    from plastica.doors.progress import meter
    from plastica.study.run import default_folder, run_scenario
    from plastica.study.scenario import read_scenario

    began = time.perf_counter()
    scenario = read_scenario(file)
    folder = default_folder(file) if options.output is None else options.output
    with meter(wanted=not options.quiet, si=scenario.model.specimen is not None) as tell:
        finished = run_scenario(scenario, folder, resume=options.resume, progress=tell)
    pictures, trouble = _drawn(finished, folder, options)
    status = finished.solution.status
    message = " ".join(f"{file}: {each}" for each in ("" if status.ok else str(status), trouble) if each)
    facts, files = result_facts(finished.solution), (*finished.files, *pictures)
    return Ran(file, FAILED if message else DONE, message, facts, files, time.perf_counter() - began)


def _drawn(finished: Finished, folder: Path, options: Options) -> tuple[list[Path], str]:
    """Write the report and the film; what fails there, where the result is saved already, is told in a sentence."""
    from plastica.motion.solution import UNJUDGED

    try:
        return _pictures(finished, folder, options), ""
    except StorageError as error:
        why = str(error)
    except PlasticaError:
        raise
    except UNJUDGED as error:
        why = f"{NO_MEMORY}." if isinstance(error, MemoryError) else f"drawing fails ({type(error).__name__}: {error})."
    return [], f"{why} The result is saved: {finished.files[0]}"


def _pictures(finished: Finished, folder: Path, options: Options) -> list[Path]:
    """Write the report and the film."""
    from plastica.study.run import planned_files

    files = planned_files(finished.scenario, folder, report=options.report, film=options.film)
    if not {"report", "film"} & files.keys():
        return []
    from plastica.show.report import report_and_film

    return report_and_film(finished.solution, files.get("report"), files.get("film"))


def scenario_files(folder: Path) -> list[Path]:
    """Return the scenarios in a folder, by name.

    Raises
    ------
    FileError
        Where there is none.
    """
    files = sorted(path for path in folder.glob("*.toml") if path.is_file())
    if not files:
        raise FileError(
            "has no scenario (*.toml) in it", where=str(folder), next_step="Name a file, or another folder."
        )
    return files


def attempted(file: Path, options: Options) -> Ran:
    """Run one scenario; a mistake in it is told in the result."""
    began = time.perf_counter()
    try:
        return single(file, options)
    except PlasticaError as error:
        code, message = exit_code(error), str(error)
    except MemoryError:
        code, message = FAILED, f"{file}: {NO_MEMORY}"
    if code == FAILED and has_kept(file, options):
        message += " What is finished is kept: to go on from there, give the same command with --resume"
    return Ran(file, code, message, {}, (), time.perf_counter() - began)


def batch(folder: Path, options: Options) -> list[Ran]:
    """Run every scenario of a folder, each into a folder of its own; a mistake in one does not stop the others."""
    root = options.output or Path("out")
    return [attempted(file, replace(options, output=root / file.stem)) for file in scenario_files(folder)]


def has_kept(scenario: Path, options: Options) -> bool:
    """Whether something of a run, or of one of the runs of a folder, is kept that can be taken up."""
    from plastica.motion.checkpoint import PATTERN
    from plastica.study.run import default_folder

    folders = [options.output or default_folder(scenario)]
    if scenario.is_dir():
        root = options.output or Path("out")
        folders = [root / file.stem for file in scenario_files(scenario)]
    # On how many nodes is a matter of the run: its segments may lie a folder deeper.
    return any(True for folder in folders for _ in folder.glob(f".*.checkpoint/**/{PATTERN}"))


def checked(file: Path) -> Ran:
    """Read one scenario without running it: what is understood of it, and what it would write."""
    from plastica.study.run import default_folder, planned_files
    from plastica.study.scenario import read_scenario

    try:
        scenario = read_scenario(file)
    except PlasticaError as error:
        told = {"scenario": file, "accepted": False, "error": str(error)}
        return Ran(file, exit_code(error), str(error), told, (), 0.0)
    files = tuple(planned_files(scenario, default_folder(file)).values())
    return Ran(file, 0, "", check_facts(scenario), files, 0.0)
