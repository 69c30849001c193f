"""Claim: a misspelt key is one mistake, told once with the right key; what is missing besides is told as before."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from plastica.errors import ScenarioError
from plastica.study.scenario import read_scenario
from tests.commandline import call, scenario, si_scenario, snapshot, written

SLENDER = 'length = "250 mm"\nyoungs_modulus = "2.1 GPa"\nretardation_time = "2 min"\n'
SCENARIOS = {
    "a strip": si_scenario(
        specimen=f'{SLENDER}section = {{ shape = "rectangle", width = "20 mm", thickness = "1 mm" }}',
        load='thrust = { program = "cycles", low = "0 N", high = "1 N", period = "10 s" }\n'
        'weight = "0.1 N/m"\nweight_angle = "30 deg"',
        initial='curvature = { pieces = ["0.1 1/m", "0.2 1/m"], breaks = ["0.1 m"] }',
        solve='until = "1 min"\ntimes = { count = 10, spacing = "log" }',
    ),
    "a rod with mass": si_scenario(
        specimen='length = "250 mm"\nbending_stiffness = "0.035 N*m**2"',
        inertia='mass_per_length = "0.1 kg/m"',
        load='couple = { program = "table", times = ["0 s", "1 s"], values = ["0 N*m", "0.001 N*m"] }',
        initial='curvature = "0.4 1/m"\ncurvature_rate = "0 1/(m*s)"',
    ),
    "a measured shape": scenario(
        load='force = { program = "ramp-hold-release", value = 1, ramp = 1, hold = 1, release = 1 }\nangle = "30 deg"',
        inertia="translational_inertia = 0.1\ndamping = 1",
        initial='curvature = { csv = "measured.csv", columns = "s, curvature" }',
    )
    + '[sweep]\nsampling = "random"\nmembers = 3\nover = { "load.angle" = [0.1, 0.2] }\noutputs = ["histories"]\n'
    "times = [1.0]\n",
}
KEY = re.compile(r"(?:^|[{,] |^\[)([a-z_]+)(?= =|\])", re.MULTILINE)


def misspelt(key: str, way: int) -> str:
    """A slip of the finger: a letter twice, one left out, two in the wrong order."""
    slips = {key + key[-1]} | ({key[:-1], key[:-2] + key[-1] + key[-2]} - {key} if len(key) > 4 else set())
    return sorted(slips)[way % len(slips)]


def mistakes(folder: Path, text: str) -> tuple[str, ...]:
    with pytest.raises(ScenarioError) as caught:
        read_scenario(written(folder, text))
    return caught.value.problems


def sound(folder: Path, name: str) -> str:
    rows = "".join(f"{i / 10},{0.1 * i}\n" for i in range(11))
    (folder / "measured.csv").write_text(f"s,curvature\n{rows}", encoding="utf-8")
    text = SCENARIOS[name]
    if "[sweep]" not in text:
        read_scenario(written(folder, text))
    return text


def check_a_slip_is_told_once(folder: Path, name: str) -> None:
    """Whatever key of a scenario is misspelt, there is one message: which key was meant."""
    text = sound(folder, name)
    found = list(KEY.finditer(text))
    assert len(found) >= 24
    for way, match in enumerate(found):
        slip = misspelt(match[1], way)
        told = mistakes(folder, text[: match.start(1)] + slip + text[match.end(1) :])
        assert len(told) == 1, (slip, told)
        assert f"{slip}` is not a known key. Did you mean `{match[1]}`?" in told[0]


@pytest.mark.parametrize("name", SCENARIOS)
def test_a_slip_is_told_once(name: str, tmp_path: Path) -> None:
    check_a_slip_is_told_once(tmp_path, name)


def check_what_is_missing_is_told(folder: Path) -> None:
    """A key that no misspelt one was meant to be is missing, and said to be."""
    ramp = 'thrust = { program = "ramp-hold-release", value = 1, ramp = 1, hold = 1, %s }'
    # "reset" resembles "release" as well, but "rest" more.
    nearer = mistakes(folder, scenario(load=ramp % "reset = 0"))
    assert [each.split("`")[1] for each in nearer] == ["load.thrust.release", "load.thrust.reset"]
    # The same key is missing in one table and misspelt in another.
    tables = 'thrust = { program = "table", tmies = [0], values = [1] }\ncouple = { program = "table", values = [1] }'
    elsewhere = mistakes(folder, scenario(load=tables))
    assert [each.split("`")[1] for each in elsewhere] == ["load.thrust.tmies", "load.couple.times"]
    both = mistakes(folder, si_scenario(specimen="lenght = 1\nretardation_time = 2"))
    assert [each.split("`")[1] for each in both] == ["specimen.lenght", "specimen.retardation_time"]
    unlike = mistakes(folder, scenario(solve="duration = 1.0"))
    assert [each.split("`")[1] for each in unlike] == ["solve.until", "solve.duration"]


def test_what_is_missing_is_told(tmp_path: Path) -> None:
    check_what_is_missing_is_told(tmp_path)


def test_a_key_above_the_sections_is_told_once(tmp_path: Path) -> None:
    (told,) = mistakes(tmp_path, scenario(head="until = 2.0\n", solve="rtol = 1e-6"))
    assert told == "line 3: `until` belongs into [solve]."


def test_a_program_without_a_name_says_so(tmp_path: Path) -> None:
    (told,) = mistakes(tmp_path, scenario(load="thrust = { low = 0, high = 1, period = 1 }"))
    assert "`load.thrust.program` is missing: it must be one of constant, table," in told


@pytest.mark.parametrize("command", ["check", "run", "sweep", "modes", "equilibria", "spectrum"])
def test_every_command_tells_it_once(command: str, tmp_path: Path) -> None:
    text = scenario(solve="untill = 2.0", inertia="translational_inertia = 0.1")
    file = written(tmp_path, text + '[sweep.over]\n"load.thrust" = [1.0, 2.0]\n')
    before = snapshot(tmp_path)
    answer = call(command, file, folder=tmp_path)
    assert (answer.code, answer.out) == (2, "")
    assert "1 mistake\n" in answer.err
    assert answer.err.count("`solve.") == 1
    assert "`solve.untill` is not a known key. Did you mean `until`?" in answer.err
    assert snapshot(tmp_path) == before
