"""The file a user writes, read into everything that a run needs, or refused with all its mistakes at once."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from plastica.errors import ArgumentError, InadmissibleError
from plastica.material.admissibility import Verdict
from plastica.material.material import Material
from plastica.motion.plan import Plan, Problem
from plastica.motion.solution import Solution
from plastica.numerics.grid import Grid
from plastica.physics.initial import Curvature
from plastica.physics.load import Load
from plastica.physics.model import Model
from plastica.physics.scales import Specimen
from plastica.study import assembly, building, loads, rods, schema, sweep_schema
from plastica.study.problems import Problems
from plastica.study.reading import Document, read_document
from plastica.study.tokens import key_text

__all__ = ["MIGRATIONS", "SCHEMA", "Scenario", "migrated", "read_scenario", "scenario_of"]

Array = NDArray[np.float64]

SCHEMA: Final = 1
"""The version of the file that this package writes; a file without `schema` counts as version 1."""

Migration = Callable[[dict[str, Any]], dict[str, Any]]

MIGRATIONS: Final[Mapping[int, Migration]] = {}
"""From each former version to the next: 1 is the first, so there is none yet (see `migrated`)."""


@dataclass(frozen=True, eq=False)
class Scenario:
    """A scenario that can be run.

    Attributes
    ----------
    file : Path
        Where it was read.
    text : str
        What it says, verbatim.
    title : str
        What the user calls it.
    model : Model
        The rod: a strut, or a rod with inertia.
    curvature, natural_curvature, curvature_rate, start
        What `solve` takes: the initial data, or the solution to go on from.
    until, rtol, atol, method, times, max_steps
        What `solve` takes besides, in SI where the scenario is.
    output : Output
        What to write.
    verdicts : tuple of Verdict
        The hypotheses on the material, judged on the range that the a-priori bound allows.
    allow_inadmissible : bool
        Whether to run it even where a hypothesis fails.
    plan : Plan
        Times and tolerances, dimensionless.
    problem : Problem
        The first state, on the grid (on the smallest that is tried, where the nodes are "auto").
    """

    file: Path
    text: str
    title: str
    model: Model
    curvature: Curvature
    natural_curvature: float | tuple[float, ...]
    curvature_rate: Curvature
    start: Solution | None
    until: float | str
    rtol: float
    atol: float | None
    method: str
    times: Array | None
    max_steps: int
    output: schema.Output
    verdicts: tuple[Verdict, ...]
    allow_inadmissible: bool
    plan: Plan
    problem: Problem

    @property
    def name(self) -> str:
        """The base name of the files to write."""
        return self.output.name or default_name(self.file)

    @property
    def failed(self) -> tuple[Verdict, ...]:
        """The hypotheses that do not hold."""
        return tuple(verdict for verdict in self.verdicts if not verdict.holds)


def default_name(file: Path) -> str:
    """Return the name of a file without suffix, with nothing in it that file systems mind."""
    return re.sub(r"[^A-Za-z0-9._-]", "-", file.stem).lstrip(".-")[:80] or "result"


def migrated(
    data: Mapping[str, Any], migrations: Mapping[int, Migration] = MIGRATIONS, target: int = SCHEMA
) -> dict[str, Any]:
    """Bring a scenario of any former version to the present one, step by step.

    Parameters
    ----------
    data : mapping
        What the file says.
    migrations : mapping of int to callable
        From each version to the next.
    target : int
        The version due.

    Returns
    -------
    dict
        The same in the words of version `target`, without `schema`.

    Raises
    ------
    ArgumentError
        Where the version is no version, or a later one.
    """
    version = data.get("schema", 1)
    if isinstance(version, bool) or not isinstance(version, int) or version < 1:
        allowed = "1" if target == 1 else f"a whole number from 1 to {target}"
        raise ArgumentError(f"must be {allowed}", where="schema", value=version)
    if version > target:
        raise ArgumentError(
            f"must be at most {target}, the version that this plastica reads",
            where="schema",
            value=version,
            next_step="Read the file with a later plastica.",
        )
    present = {key: value for key, value in data.items() if key != "schema"}
    for former in range(version, target):
        present = migrations[former](present)
    return present


def read_scenario(file: str | Path) -> Scenario:
    """Read and check a scenario file.

    Parameters
    ----------
    file : str or Path
        A TOML file; `plastica new` writes one with comments.

    Returns
    -------
    Scenario
        Everything that a run needs: what this function accepts, a run accepts.

    Raises
    ------
    FileError
        Where the file cannot be read.
    ScenarioError
        Where it has mistakes: all of them, each with line, key, value and what is allowed.
    InadmissibleError
        Where the material violates a hypothesis of the theory and `allow_inadmissible` is not set; with the witness.
    """
    return scenario_of(read_document(file))


def scenario_of(document: Document) -> Scenario:
    """Check a document that was read, which may have been changed since; see `read_scenario`."""
    problems = Problems(document)
    try:
        data = migrated(document.data)
    except ArgumentError as error:
        problems.add_error((), error)
        problems.refuse()
        raise
    head = schema.validate(schema.Head, data, (), problems, si=False)
    si = head.units == "SI" if head is not None else "specimen" in data
    _refuse_unknown(data, problems)
    sections = {name: _section(name, data, problems, si=si) for name in schema.SECTIONS}
    rods.check_inertia(data, sections["inertia"], problems, si=si)
    if "sweep" in data:
        sweep_schema.check_table(data["sweep"], problems, si=si)
    nouns = _nouns(sections, data, problems, si=si)
    problems.refuse()
    scenario = _assembled(document, head.title if head else "", nouns, problems)
    _refuse_inadmissible(scenario, document)
    return scenario


def _refuse_unknown(data: Mapping[str, Any], problems: Problems) -> None:
    known = (*schema.SECTIONS, "sweep", "schema", "units", "title")
    for key in data:
        homes = [name for name, model in schema.SECTIONS.items() if key in model.model_fields]
        if key in known:
            continue
        if homes:
            problems.add((key,), f"belongs into [{homes[0]}].", meant=(homes[0], key))
        else:
            schema.add_unknown(problems, (key,), known)


def _section(name: str, data: Mapping[str, Any], problems: Problems, *, si: bool) -> Any:
    if name == "specimen" and not si:
        if name in data:
            rule = 'has no place in a dimensionless scenario. Remove it, or set units = "SI".'
            problems.add((name,), rule)
        return None
    if name not in data:
        if name in ("specimen", "material", "solve"):
            problems.add((name,), f"is missing. Add the section [{name}].", lacks=((name,),))
            return None
        return schema.SECTIONS[name]()
    return schema.validate(schema.SECTIONS[name], data[name], (name,), problems, si=si)


@dataclass(frozen=True, eq=False)
class _Nouns:
    """What the sections became; None where a section has mistakes."""

    si: bool
    specimen: Specimen | None
    material: Material | None
    load: Load | None
    grid: Grid | None
    segments: building.Segments
    inertia: schema.Inertia | None
    start: building.Start | None
    solve: schema.Solve | None
    output: schema.Output | None
    allow_inadmissible: bool


def _nouns(sections: Mapping[str, Any], data: Mapping[str, Any], problems: Problems, *, si: bool) -> _Nouns:
    """Build what can be built, so that the mistakes of all sections are found."""
    folder = problems.document.file.parent
    inertia = sections["inertia"] if "inertia" in data else None
    rod = None if sections["specimen"] is None else building.specimen(sections["specimen"], inertia, problems)
    length = (None if rod is None else rod.L) if si else 1.0
    cells = sections["grid"]

    def built(name: str, build: Callable[[Any], Any]) -> Any:
        return None if sections[name] is None else build(sections[name])

    return _Nouns(
        si=si,
        specimen=rod,
        material=built("material", lambda each: building.material(each, rod, problems, si=si)),
        load=built("load", lambda each: loads.load(each, problems, si=si)),
        grid=built("grid", lambda each: building.grid(each, length, problems)),
        segments=1 if cells is None else building.segments(cells, length, problems, si=si),
        inertia=inertia,
        start=built("initial", lambda each: building.initial(each, folder, length, problems, si=si)),
        solve=sections["solve"],
        output=sections["output"],
        allow_inadmissible=sections["material"] is not None and sections["material"].allow_inadmissible,
    )


def _assembled(document: Document, title: str, nouns: _Nouns, problems: Problems) -> Scenario:
    """Put the nouns together, with every check that a run would make."""
    solve, output = problems.settled(nouns.solve), problems.settled(nouns.output)
    start, model = problems.settled(nouns.start), problems.settled(_model(nouns, problems))
    made, times = assembly.plan(model, solve, start.solution, problems)
    assembly.check_output(model, output, problems)
    plan = problems.settled(made)
    assembly.check_loads(model, plan, problems)
    atol = None if solve.atol is None else building.number(solve.atol, "1/m")
    problem = problems.settled(assembly.first_problem(model, plan, start, atol, problems))
    problems.refuse()
    return Scenario(
        file=document.file,
        text=document.text,
        title=title,
        model=model,
        curvature=start.curvature,
        natural_curvature=start.natural_curvature,
        curvature_rate=start.curvature_rate,
        start=start.solution,
        until=solve.until,
        rtol=solve.rtol,
        atol=atol,
        method=solve.method,
        times=times,
        max_steps=plan.max_steps,
        output=output,
        verdicts=assembly.verdicts(problem, plan),
        allow_inadmissible=nouns.allow_inadmissible,
        plan=plan,
        problem=problem,
    )


def _model(nouns: _Nouns, problems: Problems) -> Model | None:
    material, load = problems.settled(nouns.material), problems.settled(nouns.load)
    grid = problems.settled(nouns.grid)
    with problems.at("material"):
        _ = material.laws()
    return rods.model(material, load, grid, nouns.specimen, nouns.segments, nouns.inertia, problems)


def _refuse_inadmissible(scenario: Scenario, document: Document) -> None:
    if scenario.failed and not scenario.allow_inadmissible:
        sentences = []
        for verdict in scenario.failed:
            law = verdict.name.split()[0]
            path = ("material", law) if ("material", law) in document.lines else ("material",)
            sentences.append(f"\n  line {document.line(path)}: `{key_text(path)}` {verdict.sentence.rstrip('.')}")
        raise InadmissibleError(
            f"{scenario.file}: the material must satisfy the hypotheses of the theory:" + ".".join(sentences),
            next_step="Mend the law, or set allow_inadmissible = true in [material] to run it at your own risk.",
        )
