"""The command line. Every import that takes time is made by the command that needs it."""

from __future__ import annotations

import io
import os
import sys
import warnings
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from plastica._version import __version__
from plastica.doors.equilibria import COMMANDS
from plastica.doors.modes import modes
from plastica.doors.sweep import sweep
from plastica.doors.telling import (
    DONE,
    FAILED,
    INTERRUPTED,
    MISTAKE,
    NO_MEMORY,
    console,
    exit_code,
    print_json,
    say,
    tell,
    terminable,
)
from plastica.errors import PlasticaError, safe_text

if TYPE_CHECKING:
    from plastica.doors.running import Ran

__all__ = ["cli", "main"]

_FILE = click.Path(path_type=Path)


@click.group(context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100})
@click.version_option(__version__, prog_name="plastica")
def cli() -> None:
    """Slender rods that remember: motion, ledger, verdict; equilibria, limits, capacity.

    Exit codes: 0 done, 1 the computation failed (its status is told, results are kept) or the machine refused (a
    full disk, a folder in use), 2 a mistake in the input (nothing is written), 130 interrupted (Ctrl-C, SIGTERM).
    """


@cli.command()
@click.argument("scenario", type=_FILE)
@click.option("--output", "-o", type=_FILE, help="Folder of the results.  [default: out/<scenario's name>]")
@click.option("--resume", is_flag=True, help="Go on where an interrupted run has stopped.")
@click.option("--quiet", "-q", is_flag=True, help="Print nothing but mistakes and failures.")
@click.option("--json", "as_json", is_flag=True, help="Print one JSON object and nothing else.")
@click.option("--no-report", is_flag=True, help="Write no page with pictures.")
@click.option("--no-film", is_flag=True, help="Write no film.")
def run(
    scenario: Path,
    output: Path | None,
    resume: bool,
    quiet: bool,
    as_json: bool,
    no_report: bool,
    no_film: bool,
) -> int:
    """Run SCENARIO, a file or a folder of *.toml files.

    Writes a result (.nc), a page with pictures (.html), a film and CSV files into the folder --output.
    """
    from plastica.doors.running import Options, attempted, batch, has_kept

    options = Options(output, resume, quiet or as_json, not no_report, not no_film)
    several = scenario.is_dir()
    try:
        ran = batch(scenario, options) if several else [attempted(scenario, options)]
    except KeyboardInterrupt:
        kept = has_kept(scenario, options)
        say("interrupted" + (". To go on from there, give the same command with --resume" if kept else ""))
        return INTERRUPTED
    if as_json:
        each = [one.as_json() for one in ran]
        print_json({"runs": each} if several else each[0])
    elif not quiet and (several or ran[0].facts):
        _print_runs(ran, several=several)
    return _told(ran)


@cli.command()
@click.argument("scenario", type=_FILE)
@click.option("--json", "as_json", is_flag=True, help="Print one JSON object and nothing else.")
def check(scenario: Path, as_json: bool) -> int:
    """Say what is understood of SCENARIO, or all its mistakes, without running it.

    What `check` accepts, `run` accepts. Of a folder, every *.toml file is checked.
    """
    from plastica.doors.running import checked, scenario_files

    several = scenario.is_dir()
    found = [checked(file) for file in (scenario_files(scenario) if several else [scenario])]
    if as_json:
        each = [one.facts for one in found]
        print_json({"scenarios": each} if several else each[0])
    elif several:
        for one in found:
            if one.code == DONE:
                tell(f"{one.file} can be run")
    elif found[0].code == DONE:
        from plastica.doors.tables import print_check

        print_check(console(), found[0].facts, found[0].files)
    return _told(found)


@cli.command()
@click.argument("file", type=_FILE, default=Path("scenario.toml"))
@click.option(
    "--units",
    type=click.Choice(["SI", "dimensionless"]),
    default="SI",
    show_default=True,
    help="Kind of numbers.",
)
@click.option("--inertia", is_flag=True, help="A rod that has mass, and swings.")
def new(file: Path, units: Any, inertia: bool) -> int:
    """Write a commented scenario that runs to FILE (scenario.toml unless named; - prints it)."""
    from plastica.study.template import template, write_template

    if str(file) == "-":
        click.echo(template(units, inertia=inertia), nl=False)
        return DONE
    write_template(file, units, inertia=inertia)
    tell(f"{file} written. Next: plastica check {file}, then plastica run {file}")
    return DONE


@cli.command()
@click.argument("result", type=_FILE)
@click.argument("variables", nargs=-1)
@click.option("--output", "-o", type=_FILE, help="File to write.  [default: standard output]")
@click.option(
    "--table",
    type=click.Choice(("motion", "force-displacement", "moment-curvature", "thermodynamics")),
    default="motion",
    show_default=True,
    help="What the variables are of: moment and curvature are those at the clamp.",
)
def export(result: Path, variables: tuple[str, ...], output: Path | None, table: str) -> int:
    """Write VARIABLES of a RESULT (.nc) as CSV; without any, list those that it has, or write all to --output."""
    from plastica.files import refuse_overwriting
    from plastica.motion.store import read
    from plastica.study.export import csv_text, table_of, write_csv

    if output is not None:
        refuse_overwriting(output, result)
    dataset = table_of(read(result), table)
    if not variables and output is None:
        for name, variable in dataset.data_vars.items():
            dims = ", ".join(map(str, variable.dims))
            tell(f"{name} ({dims}) [{variable.attrs['units']}]: {variable.attrs['long_name']}")
    elif output is None:
        click.echo(safe_text(csv_text(dataset, variables)), nl=False)
    else:
        names = variables or tuple(map(str, dataset.data_vars))
        tell(f"{write_csv(dataset, names, output)} written")
    return DONE


@cli.command()
@click.argument("result", type=_FILE)
@click.option("--report", "report_file", type=_FILE, help="Write a page with pictures to this file.")
@click.option("--film", "film_file", type=_FILE, help="Write a film to this file (.gif or .mp4).")
@click.option("--json", "as_json", is_flag=True, help="Print one JSON object and nothing else.")
def show(result: Path, report_file: Path | None, film_file: Path | None, as_json: bool) -> int:
    """Print what became of the rod of a RESULT (.nc)."""
    from plastica.doors.numbers import result_facts
    from plastica.files import refuse_overwriting
    from plastica.motion.store import read

    for output in (report_file, film_file):
        if output is not None:
            refuse_overwriting(output, result)
    solution = read(result)
    facts, files = result_facts(solution), []
    if report_file is not None or film_file is not None:
        from plastica.show.report import report_and_film

        files = report_and_film(solution, report_file, film_file)
    if as_json:
        print_json({"result": result, **facts, "files": files})
    else:
        from plastica.doors.tables import print_result

        print_result(console(), facts, files, None)
    return DONE


@cli.command()
@click.argument("shell", type=click.Choice(["bash", "zsh", "fish"]))
def completion(shell: str) -> int:
    """Print the completion script of a SHELL.

    bash: add  eval "$(plastica completion bash)"  to ~/.bashrc; zsh: the same with zsh in ~/.zshrc;
    fish: plastica completion fish > ~/.config/fish/completions/plastica.fish
    """
    from click.shell_completion import get_completion_class

    kind = get_completion_class(shell)
    if kind is None:
        raise click.UsageError(f"there is no completion for {shell}")
    click.echo(kind(cli, {}, "plastica", "_PLASTICA_COMPLETE").source())
    return DONE


def _print_runs(ran: Sequence[Ran], *, several: bool) -> None:
    from plastica.doors.tables import print_batch, print_result

    if several:
        print_batch(console(), [(one.file, one.code, one.words, one.seconds) for one in ran])
    else:
        print_result(console(), ran[0].facts, ran[0].files, ran[0].seconds)


def _told(ended: Sequence[Ran]) -> int:
    """Tell on standard error what went wrong; return the worst exit code."""
    for one in ended:
        if one.message:
            say(one.message)
    return max(one.code for one in ended)


for _command in (*COMMANDS, modes, sweep):
    cli.add_command(_command)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line; return its exit code.

    Parameters
    ----------
    arguments : sequence of str, optional
        By default those of the process.

    Returns
    -------
    int
        0 done, 1 the computation failed or the machine refused, 2 a mistake in the input, 130 interrupted.
    """
    for stream in (sys.stdout, sys.stderr):
        # A terminal that lacks a sign gets "?" in its place.
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="replace")
    if not sys.warnoptions:
        # Numerical trouble is told by the status of a run, in words.
        warnings.simplefilter("ignore", RuntimeWarning)
    given = None if arguments is None else list(arguments)
    try:
        with terminable():
            code = cli.main(args=given, prog_name="plastica", standalone_mode=False)
        sys.stdout.flush()
        return int(code or DONE)
    except click.Abort:
        say("interrupted")
        return INTERRUPTED
    except (click.ClickException, PlasticaError, MemoryError, OSError) as error:
        return _refused(error)


def _refused(error: Exception) -> int:
    """Tell in one message what went wrong; return the exit code."""
    if isinstance(error, click.ClickException):
        said = io.StringIO()
        error.show(said)
        click.echo(safe_text(said.getvalue()), err=True, nl=False)
        return MISTAKE
    if isinstance(error, BrokenPipeError):
        # The reader has seen enough; keep the interpreter from failing once more as it flushes.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return FAILED
    if isinstance(error, PlasticaError):
        say(str(error))
        return exit_code(error)
    say(NO_MEMORY if isinstance(error, MemoryError) else f"cannot read or write: {error}")
    return FAILED
