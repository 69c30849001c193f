"""Claim: the checks of histories, pictures, film and report of the general rod catch the defects planted for them."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from matplotlib.axes import Axes

from plastica.motion import histories
from plastica.show import (
    arrows,
    captions,
    checks,
    film,
    inputs,
    loops,
    memory,
    outlook,
    panels,
    plots,
    rods,
    swings,
    view,
)
from tests import test_histories, test_report_rods, test_show_rods
from tests.defects import Patch, replacing
from tests.test_teeth import CAUGHT

Check = Callable[[], None]

CHECKS: dict[str, Check] = {
    "loads enclose their work": lambda: test_histories.check_area("strut", test_histories.loaded),
    "rows enclose the work": lambda: test_histories.check_rows("strut"),
    "couples enclose the same": lambda: test_histories.check_area("rod", test_histories.bent),
    "couple at both ends": lambda: test_histories.check_ends("rod"),
    "history at the nodes": lambda: test_histories.check_nodes("rod"),
    "jumps in a history": test_histories.check_jump,
    "units of a history": test_histories.check_units,
    "a loop is what was lost": test_histories.check_elastic_loop_is_empty,
    "kinetic energy as drawn": test_show_rods.check_kinetic,
    "velocities as drawn": test_show_rods.check_velocities,
    "reactions as drawn": test_show_rods.check_reactions,
    "path as drawn": test_show_rods.check_path,
    "segments as drawn": test_show_rods.check_segments,
    "words beside loads": test_show_rods.check_labels_apart,
    "drawn in silence": test_show_rods.check_nothing_is_logged,
    "arcs as drawn": test_show_rods.check_arcs,
    "arrows": test_show_rods.check_arrows,
    "arrows of a film": test_show_rods.check_film_of_loads,
    "loops as drawn": test_show_rods.check_loops,
    "static shapes as drawn": test_show_rods.check_rest,
    "what was put in": test_report_rods.check_what_was_put_in,
    "where it ends": test_report_rods.check_where_it_ends,
    "motion in the ledger": test_report_rods.check_ledger_has_motion,
    "bounds of a rod": test_report_rods.check_bounds,
    "pictures that are shown": test_report_rods.check_pictures_that_are_shown,
}


def one_row(sound: Any) -> Any:
    """A jump has but the row after it."""

    def course(*arguments: Any) -> Any:
        found = sound(*arguments)
        kept = np.append(np.diff(found.t) > 0.0, True)
        rest = {name: values[kept] for name, values in found.loads.items()}
        times = None if found.times is None else found.times[kept]
        return replace(found, t=found.t[kept], y=found.y[kept], loads=rest, times=times)

    return course


def of_loads_alone(sound: Any) -> Any:
    """The couple of a rod with inertia taken from its loads: n.b without accelerations."""

    def couple(model: Any, course: Any, s: Any) -> Any:
        theta = model.angle(model.layout.mu(course.y))
        load = {name: values[:, None] for name, values in course.loads.items()}
        shear = load["thrust"] * np.sin(theta) + load["transverse"] * np.cos(theta)
        return load["couple"] + shear @ (model.grid.w - model.grid.integration(s)).T

    return couple


def renamed(name: str, kind: str) -> Callable[[Patch], None]:
    """A variable of a history scaled as another kind of quantity."""
    return replacing(histories, "KINDS_OF", lambda sound: {**sound, name: (kind, sound[name][1])})


def without(name: str) -> Callable[[Any], Any]:
    """One variable of the dataset read as 0."""

    def made(sound: Any) -> Any:
        return lambda self, wanted: sound(self, wanted) * (0.0 if wanted == name else 1.0)

    return made


def swapped(sound: Any) -> Any:
    """Along taken for across."""
    return lambda *a: tuple(reversed(sound(*a)))


def no_weight(sound: Any) -> Any:
    """The reaction of the weight forgotten."""

    def found(seen: Any) -> Any:
        along, across, couple = sound(seen)
        share, other = seen.solution.model.loads.weight_direction
        weight = seen.values("weight")
        return along - share * weight, across - other * weight, couple

    return found


def all_alike(sound: Any) -> Any:
    """Every segment yields while any does."""
    return lambda solution: [view.yielding(solution)] * solution.model.segments


def first_arc(sound: Any) -> Any:
    """The first segment's arc drawn to the end of the rod."""

    def shape(model: Any, natural: Any, s: Any) -> Any:
        from plastica.motion.dataset import natural_centre_line

        return natural_centre_line(np.asarray(natural)[..., :1], s)

    return shape


def backwards(sound: Any) -> Any:
    """Forces drawn against their direction."""
    return lambda x, y, force, length: sound(x, y, (-force[0], -force[1]), length)


def other_turn(sound: Any) -> Any:
    """Couples drawn against their sense."""
    return lambda x, y, angle, couple, length: sound(x, y, angle, -couple, length)


def always_pushing(sound: Any) -> Any:
    """A film that shows tension as thrust."""
    return staticmethod(lambda model, t: replace(sound(model, t), force=(-abs(sound(model, t).force[0]), 0.0)))


def one_step(sound: Any) -> Any:
    """The natural curvature of the first segment for the whole rod."""
    return lambda ax, measure, curvature, mu_nat, ends=(0, 1): sound(ax, measure, curvature, np.ravel(mu_nat)[0])


def fewer_rows(sound: Any) -> Any:
    """The ledger of a report without motion."""

    def section(key: str, heading: str, data: Any) -> Any:
        rows = [row for row in data.get("rows", []) if not str(row[0]).startswith("Change of the kinetic")]
        return sound(key, heading, {**data, "rows": rows})

    return section


def data_limits(sound: Any) -> Any:
    """Equal axes by other limits than those that were set."""
    return lambda self, aspect, **options: sound(self, aspect, adjustable="datalim" if aspect == "equal" else None)


def spoiled_view(name: str, made: Callable[[Any], Any]) -> Callable[[Patch], None]:
    return replacing(view.View, name, made)


DEFECTS: dict[str, Callable[[Patch], None]] = {
    "rows of the steps alone": replacing(histories, "_refined", lambda _: lambda solution, course, curves: course),
    "one row at a jump": replacing(histories, "_course", one_row),
    "couple without accelerations": replacing(histories, "_couple", of_loads_alone),
    "a force on the wrong way": replacing(
        test_histories, "CONJUGATE", lambda sound: {**sound, "transverse": "shortening"}
    ),
    "length taken for curvature": renamed("deflection", "curvature"),
    "couple scaled as a force": renamed("couple", "force"),
    "a history at half its couple": replacing(
        histories, "_couple", lambda sound: lambda *a: 0.5 * np.asarray(sound(*a))
    ),
    "no kinetic energy": spoiled_view("values", without("kinetic_energy")),
    "along taken for across": spoiled_view("velocities", swapped),
    "reactions without weight": replacing(swings, "reactions", no_weight),
    "a path across alone": spoiled_view("values", without("tip_x")),
    "all segments alike": replacing(memory, "yielding_by_segment", all_alike),
    "one arc for the whole rod": replacing(view, "natural_shape", first_arc),
    "forces backwards": replacing(arrows, "_force", backwards),
    "couples backwards": replacing(arrows, "_couple", other_turn),
    "tension filmed as thrust": replacing(film.loads.Pull, "at", always_pushing),
    "load and way exchanged": replacing(
        loops, "CONJUGATE", lambda sound: {"transverse": "shortening", "thrust": "deflection"}
    ),
    "one step for all segments": replacing(rods, "curvature_along", one_step),
    "other loads not told": replacing(inputs, "LOAD_KINDS", lambda sound: {}),
    "no reason given": replacing(outlook, "_why_none", lambda sound: lambda subject: ""),
    "a ledger without motion": replacing(checks, "Section", fewer_rows),
    "bounds without motion": replacing(checks, "kinetic_energy", lambda sound: lambda *a: 0.0),
    "words on one line": replacing(panels, "fill", lambda sound: lambda text, width: text),
    "limits that cannot be kept": replacing(Axes, "set_aspect", data_limits),
    "every picture for every run": replacing(captions, "shown", lambda sound: lambda seen: tuple(plots.PICTURES)),
}

TEETH = [
    ("rows enclose the work", "rows of the steps alone"),
    ("loads enclose their work", "a force on the wrong way"),
    ("couples enclose the same", "couple without accelerations"),
    ("couple at both ends", "couple without accelerations"),
    ("history at the nodes", "couple without accelerations"),
    ("history at the nodes", "a history at half its couple"),
    ("jumps in a history", "one row at a jump"),
    ("units of a history", "length taken for curvature"),
    ("units of a history", "couple scaled as a force"),
    ("a loop is what was lost", "a history at half its couple"),
    ("kinetic energy as drawn", "no kinetic energy"),
    ("velocities as drawn", "along taken for across"),
    ("reactions as drawn", "reactions without weight"),
    ("words beside loads", "words on one line"),
    ("drawn in silence", "limits that cannot be kept"),
    ("path as drawn", "a path across alone"),
    ("segments as drawn", "all segments alike"),
    ("arcs as drawn", "one arc for the whole rod"),
    ("arrows", "forces backwards"),
    ("arrows", "couples backwards"),
    ("arrows of a film", "tension filmed as thrust"),
    ("loops as drawn", "load and way exchanged"),
    ("static shapes as drawn", "one step for all segments"),
    ("what was put in", "other loads not told"),
    ("where it ends", "no reason given"),
    ("motion in the ledger", "a ledger without motion"),
    ("bounds of a rod", "bounds without motion"),
    ("pictures that are shown", "every picture for every run"),
]
"""Which check catches which defect."""


@pytest.mark.parametrize(("claim", "defect"), TEETH)
def test_catches(claim: str, defect: str, monkeypatch: pytest.MonkeyPatch) -> None:
    DEFECTS[defect](monkeypatch)
    with pytest.raises((*CAUGHT, KeyError)):
        CHECKS[claim]()


def test_every_check_and_every_defect_is_used() -> None:
    assert {claim for claim, _ in TEETH} == set(CHECKS)
    assert {defect for _, defect in TEETH} == set(DEFECTS)
