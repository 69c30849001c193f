"""The commands on where a rod can be, and on what it stands: equilibria, spectrum, phase-diagram, capacity."""

from __future__ import annotations

from collections.abc import Callable
from functools import wraps
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final

import click

from plastica.errors import ArgumentError

if TYPE_CHECKING:
    from plastica.motion.solution import Solution

__all__ = ["COMMANDS", "common"]

DONE, FAILED = 0, 1

_FILE = click.Path(path_type=Path)

SUFFIXES: Final = (".png", ".svg", ".pdf")

MOST_COUNT: Final = 200
"""Thrusts of a capacity chart, and eigenvalues: each costs time."""


def _picture(_context: click.Context, _option: click.Parameter, value: Path | None) -> Path | None:
    """Refuse a picture that could not be written, before anything is computed."""
    if value is None:
        return None
    if value.suffix.lower() not in SUFFIXES:
        raise ArgumentError(f"must end in one of {', '.join(SUFFIXES)}", where="--plot", value=str(value))
    if not value.parent.is_dir():
        raise ArgumentError("must be a file in a folder that exists", where="--plot", value=str(value))
    return value


def _apart(command: Callable[..., Any]) -> Callable[..., Any]:
    @wraps(command)
    def checked(**given: Any) -> Any:
        if given["picture"] is not None:
            from plastica.files import refuse_overwriting

            read = (given["scenario"], given.get("result"))
            refuse_overwriting(given["picture"], *(each for each in read if each is not None))
        return command(**given)

    return checked


def common(command: Callable[..., Any]) -> Callable[..., Any]:
    """Add what all of these commands take, the scenario, --json and --plot; no picture takes the place of an input."""
    command = _apart(command)
    for option in (
        click.option(
            "--plot", "picture", type=_FILE, callback=_picture, help="Draw it into this file (.png, .svg or .pdf)."
        ),
        click.option("--json", "as_json", is_flag=True, help="Print one JSON object and nothing else."),
        click.argument("scenario", type=_FILE),
    ):
        command = option(command)
    return command


def _held(command: Callable[..., Any]) -> Callable[..., Any]:
    """Add the two ways to say which thrust is held."""
    for option in (
        click.option("--gamma", type=float, help="Thrust that is held, in EI/L²."),
        click.option("--thrust", help='Thrust that is held, with its unit ("0.6 N") where the scenario is in SI.'),
    ):
        command = option(command)
    return command


@click.command()
@common
@_held
def equilibria(scenario: Path, as_json: bool, picture: Path | None, thrust: str | None, gamma: float | None) -> int:
    """Tell all equilibria of SCENARIO's rod under a thrust that is held for ever.

    Which shapes can it stay in, which of them do motions end at, and where does it snap? The thrust is the largest
    of the scenario unless one is given.
    """
    from plastica.doors.facts import equilibria_facts
    from plastica.doors.held import held
    from plastica.equilibria.catalog import equilibria as all_equilibria

    rod = held(scenario, thrust, gamma)
    found = all_equilibria(rod.material, rod.gamma, specimen=rod.specimen)
    return _told(equilibria_facts(rod, found), "print_equilibria", found, as_json, picture, failed=not found.complete)


@click.command()
@common
@_held
@click.option("--alpha", help="Its curvature at the clamp: a number (times L), or text with a unit (1/m).")
@click.option("--count", default=6, show_default=True, type=click.IntRange(1, MOST_COUNT), help="How many eigenvalues.")
def spectrum(
    scenario: Path,
    as_json: bool,
    picture: Path | None,
    thrust: str | None,
    gamma: float | None,
    alpha: str | None,
    count: int,
) -> int:
    """Tell how fast disturbances of an equilibrium grow or die out while the natural curvature rests.

    The equilibrium is named by its curvature at the clamp (--alpha); without it, it is the static shape that the
    rod takes from SCENARIO's start, with its natural curvature, under the thrust.
    """
    from plastica.doors.facts import spectrum_facts
    from plastica.doors.held import held
    from plastica.equilibria.equilibrium import equilibrium
    from plastica.equilibria.spectrum import spectrum as spectrum_of

    rod = held(scenario, thrust, gamma)
    _ = rod.strut
    place = equilibrium(rod.material, rod.gamma, rod.clamp_curvature(alpha), specimen=rod.specimen)
    found = spectrum_of(place, count)
    return _told(spectrum_facts(rod, found), "print_spectrum", found, as_json, picture)


@click.command("phase-diagram")
@common
@click.option("--gamma", default="0:20", show_default=True, help="Range of thrusts LO:HI, in EI/L².")
@click.option("--alpha", default="-12:12", show_default=True, help="Range of clamp curvatures LO:HI, times L.")
@click.option("--shape", default=400, show_default=True, type=click.IntRange(20, 2000), help="Points each way.")
@click.option("--result", type=_FILE, help="A result (.nc) of the same rod: its path is drawn into the picture.")
def phase_diagram(
    scenario: Path, as_json: bool, picture: Path | None, gamma: str, alpha: str, shape: int, result: Path | None
) -> int:
    """Map the equilibria of SCENARIO's rod over thrust and clamp curvature.

    Where can it stay, where is it stable, and of what pieces is the set at which motions end, where the drive
    equals the threshold?
    """
    from plastica.charts.phase import phase_diagram as diagram
    from plastica.doors.facts import phase_facts
    from plastica.doors.held import held, span
    from plastica.motion.store import read

    rod = held(scenario, None, None)
    ranges = span(gamma, "--gamma", least=0.0), span(alpha, "--alpha")
    found = diagram(rod.material, *ranges, (shape, shape), specimen=rod.specimen)
    path = None if result is None else read(result)
    return _told(phase_facts(rod, found), "print_phase", found, as_json, picture, path=path)


@click.command()
@common
@click.option(
    "--gamma", help="Range of thrusts LO:HI, in EI/L².  [default: about where a gap opens, to beyond Euler's load]"
)
@click.option("--thrust", help='Range of thrusts LO:HI with units ("0.2 N:0.7 N"), where the scenario is in SI.')
@click.option("--count", default=12, show_default=True, type=click.IntRange(1, MOST_COUNT), help="How many thrusts.")
@click.option(
    "--imperfection",
    default="natural",
    show_default=True,
    help='"natural" (a bow without load) or text in s (a bow that the rod is bent into, dimensionless).',
)
def capacity(
    scenario: Path,
    as_json: bool,
    picture: Path | None,
    gamma: str | None,
    thrust: str | None,
    count: int,
    imperfection: str,
) -> int:
    """Tell how large an imperfection SCENARIO's rod bears for ever, thrust by thrust.

    Larger ones creep away from the straight shape, however slowly: for most materials from a thrust well below Euler's
    load on, for some with several preferred shapes under any.
    """
    from plastica.charts.capacity import capacity as chart
    from plastica.doors.facts import capacity_facts
    from plastica.doors.held import held
    from plastica.doors.progress import counter

    rod = held(scenario, None, None)
    thrusts = rod.thrusts(gamma, thrust, count)
    with counter(wanted=not as_json, words="thrusts") as tell:
        found = chart(rod.material, thrusts, imperfection, specimen=rod.specimen, progress=tell)
    return _told(capacity_facts(rod, found), "print_capacity", found, as_json, picture)


def _told(
    facts: dict[str, Any],
    table: str,
    result: object,
    as_json: bool,
    picture: Path | None,
    *,
    failed: bool = False,
    path: Solution | None = None,
) -> int:
    """Draw where asked for, then print the facts as a table or as JSON; the exit code."""
    from plastica.doors import equilibria_tables
    from plastica.doors.telling import console, print_json, say

    files = [] if picture is None else [_drawn(result, picture, path)]
    if as_json:
        print_json({**facts, "files": files})
    else:
        getattr(equilibria_tables, table)(console(), facts, files)
    if failed:
        say(str(facts["sentence"]))
    return FAILED if failed else DONE


def _drawn(result: object, file: Path, path: Solution | None) -> Path:
    from plastica.show.save import save_picture

    return save_picture(result, file, motion=path)


COMMANDS: Final = (equilibria, spectrum, phase_diagram, capacity)
"""What the command line adds to its own."""
