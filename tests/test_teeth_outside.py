"""Claim: the checks of files, pictures, pages, command line and house catch the defects that are planted for them."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import plastica as pl
from plastica.motion import store
from plastica.motion.solve import solve
from plastica.show import checks, report, scheme, sections, view
from plastica.study import building, export, measured, problems, sweep_store
from plastica.study import run as runs
from tests import (
    pictured,
    reported,
    test_cli,
    test_files,
    test_film,
    test_house,
    test_measured,
    test_report,
    test_report_sketch,
    test_report_words,
    test_scenario,
    test_scenario_slips,
    test_show,
)
from tests.commandline import si_scenario, written
from tests.defects import Patch, replacing
from tests.test_teeth import CAUGHT

Check = Callable[[Path], None]


def drawn(name: str) -> pl.Solution:
    return pictured.run(name)


def page(solution: pl.Solution) -> str:
    return report.page(solution, film_seconds=0.0)


def exported(folder: Path) -> None:
    runs.run(written(folder, si_scenario()), folder / "out")
    test_cli.check_export_is_exact(next((folder / "out").glob("*.nc")))


def planted(layer: str, text: str, check: Callable[[Path], None]) -> Check:
    """A check of the house, on a file of one layer that is written for it."""

    def run(folder: Path) -> None:
        file = folder / layer / "planted.py"
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(text, encoding="utf-8")
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(test_house, "PACKAGE", folder)
            check(file)

    return run


CHECKS: dict[str, Check] = {
    "natural curvature as drawn": lambda _: test_show.check_natural_curvature(drawn("held")),
    "energies as drawn": lambda _: test_show.check_energies(drawn("buckles")),
    "shapes as drawn": lambda _: test_show.check_shapes(drawn("buckles")),
    "times of a film": lambda _: test_film.check_frame_times(drawn("long"), 50),
    "frames of a film": lambda _: test_film.check_frames_show_the_rod(drawn("held")),
    "page and file share a film": test_film.check_drawn_once,
    "loads of the sketch": lambda _: test_report_sketch.check_loads_of_the_sketch(),
    "a couple turns its way": lambda _: test_report_sketch.check_couple_turns(-1.0),
    "text is escaped": lambda _: test_report.check_text_is_escaped(page),
    "nothing is loaded": lambda _: test_report.check_nothing_is_loaded(page(reported.run("buckles"))),
    "the ledger is judged in the terminal": lambda _: test_report_words.check_ledger_is_judged(
        test_report_words.told_in_the_terminal
    ),
    "the ledger is judged": lambda _: test_report_words.check_ledger_is_judged(test_report_words.ledger_judgement),
    "pictures have words": lambda _: test_report_words.check_pictures_have_words(page(reported.run("held"))),
    "versions of results are told apart": lambda folder: test_files.check_versions_are_told_apart(
        test_files.result_of_version, folder
    ),
    "versions of sweeps are told apart": lambda folder: test_files.check_versions_are_told_apart(
        test_files.sweep_of_version, folder
    ),
    "units change nothing": test_scenario.check_units_change_nothing,
    "all mistakes at once": test_scenario.check_all_mistakes_at_once,
    "a slip is told once": lambda folder: test_scenario_slips.check_a_slip_is_told_once(folder, "a strip"),
    "what is missing is told": test_scenario_slips.check_what_is_missing_is_told,
    "order of a measured shape": lambda folder: test_measured.check_order(folder, "x, y", 1.0, 2.6, 5e-3),
    "noise is smoothed": lambda folder: test_measured.check_noise_is_smoothed(folder, 0.05),
    "a second run is equal": test_cli.check_runs_again,
    "export is exact": exported,
}


def unescaped(sound: Callable[[], Any]) -> Callable[[], Any]:
    def environment() -> Any:
        made = sound()
        made.autoescape = False
        return made

    return environment


def first_only(sound: Any) -> Any:
    """After the first mistake no other is noted."""
    return lambda self, path, sentence, **more: None if self._found else sound(self, path, sentence, **more)


def unchecked(_: Any) -> Any:
    """A file of any version is taken for one that can be read."""
    return lambda *_: None


def always_pushed(sound: Any) -> Any:
    """The sketch shows a thrust, whether there is one or not."""
    return lambda solution: {"thrust": 1.0, **sound(solution)}


def thrust_alone(sound: Any) -> Any:
    """The sketch shows no other load than the thrust."""
    return lambda solution: {name: value for name, value in sound(solution).items() if name == "thrust"}


def unsigned(sound: Any) -> Any:
    """The sketch takes the magnitude of every load."""
    return lambda solution: {name: abs(value) for name, value in sound(solution).items()}


def lying(sound: Any) -> Any:
    """The sketch shows every weight along the rod."""
    return lambda direction, *more: sound((-1.0, 0.0), *more)


def twice(sound: Any) -> Any:
    """What a misspelt key was meant to be is forgotten."""
    return lambda self, path, sentence, **_: sound(self, path, sentence)


def anything(sound: Any) -> Any:
    """A misspelt key is taken for whatever is missing in its table."""

    def add(self: Any, path: Any, sentence: str, **more: Any) -> None:
        sound(self, path, sentence, **more)
        if "is not a known key" in sentence:
            for each in list(self._found):
                if each.lacks and each.path[:-1] == path[:-1]:
                    sound(self, path, sentence, meant=each.lacks[0])

    return add


def anywhere(sound: Any) -> Any:
    """A key that is misspelt in one table is thought to be missing in none."""

    def add(self: Any, path: Any, sentence: str, lacks: Any = (), meant: Any = None) -> None:
        sound(self, path, sentence, lacks=tuple(each[-1:] for each in lacks), meant=meant and meant[-1:])

    return add


def without_noise(sound: Any) -> Any:
    """Smoothing left out."""
    return lambda s, y, smoothing: sound(s, y, 0.0)


def chord_ends(sound: Any) -> Any:
    """Each chord is given the angle of the next one."""

    def angles(*arguments: Any) -> Any:
        s, theta = sound(*arguments)
        return s, np.append(theta[1:], theta[-1])

    return angles


def longer(sound: Any) -> Any:
    """The rod is drawn a thousandth too long."""
    return lambda self, t, s: tuple(1.001 * each for each in sound(self, t, s))


def without_words(sound: Any) -> Any:
    """Pictures without alternative texts."""
    return lambda *a, **k: re.sub(r' alt="[^"]*"', ' alt=""', sound(*a, **k))


def rounded(sound: Any) -> Any:
    """CSV with six digits."""
    return lambda *a: (tuple(f"{float(cell):.6g}" for cell in row) for row in sound(*a))


def evenly(sound: Any) -> Any:
    """Frames at equal times, whatever happens."""
    return lambda seen, count: np.linspace(seen.t[0], seen.t[-1], count)


def linked(sound: Any) -> Any:
    """A style sheet from elsewhere."""
    return lambda *a, **k: sound(*a, **k).replace("</head>", '<link rel="stylesheet" href="x.css"></head>')


def looser(sound: Any) -> Any:
    """The second run of a scenario is made at another tolerance."""
    calls: list[int] = []

    def run(*arguments: Any, **options: Any) -> Any:
        calls.append(1)
        changed = list(arguments)
        changed[4] = arguments[4] * (1.0 if len(calls) == 1 else 2.0)
        return solve(*changed, **options)

    return run


def one_percent(name: str) -> Callable[[Patch], None]:
    """A variable is drawn one percent too large."""

    def made(sound: Any) -> Any:
        return lambda self, asked: sound(self, asked) * (1.01 if asked == name else 1.0)

    return replacing(view.View, "values", made)


TEETH: list[tuple[str, str, Callable[[Patch], None]]] = [
    ("natural curvature as drawn", "drive one percent too large", one_percent("drive")),
    ("natural curvature as drawn", "natural curvature one percent too large", one_percent("natural_curvature")),
    ("energies as drawn", "stored energy one percent too large", one_percent("stored_energy")),
    ("all mistakes at once", "only the first mistake", replacing(problems.Problems, "add", first_only)),
    ("a slip is told once", "what was meant is forgotten", replacing(problems.Problems, "add", twice)),
    ("what is missing is told", "any slip stands for it", replacing(problems.Problems, "add", anything)),
    ("what is missing is told", "a slip elsewhere stands for it", replacing(problems.Problems, "add", anywhere)),
    ("versions of results are told apart", "any is read", replacing(store, "check_schema", unchecked)),
    ("versions of sweeps are told apart", "any is read", replacing(sweep_store, "check_schema", unchecked)),
    ("loads of the sketch", "a thrust that is not there", replacing(scheme, "loads_at_largest", always_pushed)),
    ("loads of the sketch", "no load but the thrust", replacing(scheme, "loads_at_largest", thrust_alone)),
    ("loads of the sketch", "magnitudes", replacing(scheme, "loads_at_largest", unsigned)),
    ("loads of the sketch", "weight along the rod", replacing(scheme, "_weight", lying)),
    ("a couple turns its way", "magnitudes", replacing(scheme, "loads_at_largest", unsigned)),
    ("text is escaped", "templates that do not escape", replacing(report, "_environment", unescaped)),
    ("nothing is loaded", "a style sheet from elsewhere", replacing(report, "page", linked)),
    (
        "the ledger is judged in the terminal",
        "a bar ten times as high",
        replacing(checks, "LEDGER_SLACK", lambda bar: 10.0 * bar),
    ),
    ("the ledger is judged", "a bar ten times as high", replacing(checks, "LEDGER_SLACK", lambda bar: 10.0 * bar)),
    ("times of a film", "frames at equal times", replacing(view, "frame_times", evenly)),
    (
        "page and file share a film",
        "the page draws its own",
        replacing(report, "page", lambda sound: lambda solution, drawn: sound(solution)),
    ),
    (
        "page and file share a film",
        "the page has another one",
        replacing(sections, "gif_uri", lambda sound: lambda data: sound(data[:-1])),
    ),
    ("export is exact", "six digits", replacing(export, "_rows", rounded)),
    ("noise is smoothed", "no smoothing", replacing(measured, "smooth", without_noise)),
    ("a second run is equal", "another tolerance", replacing(runs, "solve", looser)),
    (
        "units change nothing",
        "text with units a little off",
        replacing(building, "number", lambda sound: lambda v, unit: sound(v, unit) * (1.0 + 1e-3 * isinstance(v, str))),
    ),
    ("shapes as drawn", "a rod too long", replacing(view.View, "centre_lines", longer)),
    ("frames of a film", "a rod too long", replacing(view.View, "centre_lines", longer)),
    ("pictures have words", "no alternative texts", replacing(report, "page", without_words)),
    ("order of a measured shape", "angles of the next chord", replacing(measured, "_angles", chord_ends)),
]


@pytest.mark.parametrize("claim", CHECKS)
def test_passes_without_a_defect(claim: str, tmp_path: Path) -> None:
    CHECKS[claim](tmp_path)


@pytest.mark.parametrize(("claim", "defect", "spoil"), TEETH, ids=[f"{claim}-{defect}" for claim, defect, _ in TEETH])
def test_catches(
    claim: str, defect: str, spoil: Callable[[Patch], None], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    spoil(monkeypatch)
    with pytest.raises(CAUGHT):
        CHECKS[claim](tmp_path)


def test_every_check_has_a_defect() -> None:
    assert {claim for claim, _, _ in TEETH} == set(CHECKS)


HEAD = '"""A file."""\n\n'
HOUSE: dict[str, Check] = {
    "an import to the left": planted("physics", f"{HEAD}from plastica.motion import solve\n", test_house.check_layers),
    "an import to the left in a function": planted(
        "numerics", f"{HEAD}def f():\n    import plastica.units, plastica.physics.strut\n", test_house.check_layers
    ),
    "two layers that never meet": planted(
        "material", f"{HEAD}from plastica.numerics.grid import Grid\n", test_house.check_layers
    ),
    "a library away from home": planted("study", f"{HEAD}import sympy\n", test_house.check_homes),
    "pickles": planted("motion", f"{HEAD}import pickle\n", test_house.check_homes),
    "text that is run": planted("material", f"{HEAD}value = ev" + "al('1')\n", test_house.check_calls),
    "SymPy's own parser": planted("material", f"{HEAD}sp.sympify('1')\n", test_house.check_calls),
    "every error swallowed": planted(
        "doors", f"{HEAD}try:\n    pass\nexcept Exception:\n    pass\n", test_house.check_calls
    ),
    "a long file": planted("doors", HEAD + "x = 1\n" * 400, test_house.check_sizes),
    "a long function": planted("doors", f"{HEAD}def f():\n" + "    x = 1\n" * 60, test_house.check_sizes),
    "no docstring": planted("doors", f"{HEAD}def f():\n    pass\n", test_house.check_docstrings),
    "a wrong list of parameters": planted(
        "doors",
        f'{HEAD}def f(a):\n    """Do.\n\n    Parameters\n    ----------\n    b : int\n        B.\n    """\n',
        test_house.check_docstrings,
    ),
}


@pytest.mark.parametrize("defect", HOUSE)
def test_the_house_catches(defect: str, tmp_path: Path) -> None:
    with pytest.raises(AssertionError):
        HOUSE[defect](tmp_path)


@pytest.mark.parametrize("check", [test_house.check_layers, test_house.check_homes, test_house.check_calls])
def test_the_house_passes_what_is_sound(check: Callable[[Path], None], tmp_path: Path) -> None:
    planted("physics", f"{HEAD}import numpy as np\nfrom plastica.errors import ArgumentError\n", check)(tmp_path)
