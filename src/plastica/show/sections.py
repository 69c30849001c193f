"""The sections of a report: each is a small function from the subject to the data of its template.

To add one, write a function that returns a `Section` (or None where it has nothing to say), a template
``templates/sections/<key>.html.j2``, and put the function into `SECTIONS` at its place.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

import numpy as np

from plastica.material.material import admissible
from plastica.show.captions import captions, shown
from plastica.show.checks import ledger, origin, promises
from plastica.show.inputs import admissibility, parameters
from plastica.show.outlook import ending
from plastica.show.pictures import gif_uri, still_uri, svg_uri
from plastica.show.scheme import scheme
from plastica.show.subject import Section, Subject
from plastica.show.view import yielding
from plastica.show.words import how_it_ended, number, pretty

__all__ = ["SECTIONS", "Section", "Subject"]

MOST_EVENTS: Final = 100


def verdict(subject: Subject) -> Section:
    """The verdict in words, how the computation ended, how far from the end, and the key numbers."""
    solution = subject.solution
    outcome = solution.outcome
    sentence = outcome.sentence.removeprefix(f"{outcome.headline}.").strip()
    data = {
        "headline": outcome.headline,
        "sentence": pretty(sentence),
        "distance": pretty(outcome.distance),
        "ok": solution.status.ok,
        "code": solution.status.code.replace("_", " "),
        "coarse": solution.status.code == "not_resolved",
        "status": pretty(how_it_ended(solution)),
        "until": subject.write(float(subject.seen.t[-1]), "time"),
        "doubtful": not (solution.status.ok and admissible(solution.model.material)),
        "notes": [pretty(note) for note in solution.notes],
        "cards": _cards(subject),
    }
    return Section("verdict", "Verdict", data)


def _cards(subject: Subject) -> list[dict[str, str]]:
    seen, write, ledger = subject.seen, subject.write, subject.solution.ledger
    angles = seen.values("angle")
    largest = np.maximum(np.abs(angles).max(axis=1), np.abs(seen.values("tip_angle")))
    when = int(np.argmax(largest))
    lost = ledger.entropy_production
    share = (
        f"{number(100.0 * ledger.natural_dissipation / lost, 3)} % of it by yielding"
        if lost > 0.0
        else "nothing was lost"
    )
    return [
        _card("Followed until", write(float(seen.t[-1]), "time"), f"{subject.solution.counts.steps} steps"),
        _card(
            "Free end off the axis",
            write(float(seen.values("tip_y")[-1]), "length"),
            f"at the end; {write(float(seen.values('tip_x')[-1]), 'length')} along the axis",
        ),
        _set_card(subject),
        _card(
            "Largest angle",
            write(float(largest[when]), "angle"),
            f"of the rod against the clamp, at {write(float(seen.t[when]), 'time')}",
        ),
        _card("Energy lost", write(lost, "energy"), share),
        *_speed_card(subject),
        _yielding_card(subject),
        *_fraction_card(subject),
    ]


def _set_card(subject: Subject) -> dict[str, str]:
    """What the rod keeps once it is let go; and by how much its natural curvature has moved by now, and will have."""
    solution, outcome, write = subject.solution, subject.solution.outcome, subject.write
    model, now = solution.model, solution.model.layout.natural(solution.history.y[-1])
    moved = float(model.division.total(now - solution.first_natural)) * model.scales.curvature
    mean = "mean natural curvature" if model.segments > 1 else "natural curvature"
    still = bool(np.array_equal(now, solution.first_natural))
    value = {"permanent set": write(outcome.set_deflection, "length"), "springs back": "none"}
    more = f"the {mean} did not move" if still else f"{mean} moved by {write(moved, 'curvature')}"
    if outcome.memory == "permanent set":
        more += f"; by {write(outcome.set_curvature, 'curvature')} once the rod is let go"
    return _card("Permanent set of the free end", value.get(outcome.memory, "not judged"), more)


def _speed_card(subject: Subject) -> list[dict[str, str]]:
    """For a rod with inertia, how fast its free end was, and is."""
    if not subject.solution.model.has_inertia:
        return []
    seen, write = subject.seen, subject.write
    along, across = seen.velocities(seen.t, np.array([1.0]))
    speed = np.hypot(along, across)[:, 0]
    when = int(speed.argmax())
    at = f"at {write(float(seen.t[when]), 'time')}" if when else "at the start"
    more = f"{at}; {write(float(speed[-1]), 'velocity')} at the end"
    return [_card("Largest speed of the free end", write(float(speed[when]), "velocity"), more)]


def _fraction_card(subject: Subject) -> list[dict[str, str]]:
    """For a material with three preferred shapes, how much of it has gone over to the second."""
    if "volume_fraction" not in subject.seen.dataset:
        return []
    values = subject.solution.model.division.total(subject.seen.values("volume_fraction"))
    return [
        _card(
            "Volume fraction", number(float(values[-1]), 3), f"at the end; {number(float(values[0]), 3)} at the start"
        )
    ]


def _yielding_card(subject: Subject) -> dict[str, str]:
    spans = yielding(subject.solution)
    whole = float(subject.seen.t[-1] - subject.seen.t[0])
    spent = sum(end - begin for begin, end in spans)
    if not spans or whole == 0.0:
        return _card("Time spent yielding", "none", "the drive never exceeded the threshold")
    times = "once" if len(spans) == 1 else f"in {len(spans)} spells"
    share = number(100.0 * spent / whole, 3)
    return _card("Time spent yielding", subject.write(spent, "time"), f"{share} % of the run, {times}")


def _card(name: str, value: str, more: str) -> dict[str, str]:
    return {"name": name, "value": value, "more": more}


def meaning(subject: Subject) -> Section:
    """The theory in two sentences, for somebody who has never heard of it, and the words of the page."""
    model = subject.solution.model
    return Section(
        "meaning",
        "What this means",
        {
            "scheme": scheme(subject.seen),
            "dimensionless": subject.seen.dimensionless,
            "segments": model.segments,
            "inertia": model.has_inertia,
            "damped": model.damping > 0.0,
            "damping_is_one": model.damping == 1.0,
        },
    )


def pictures(subject: Subject) -> Section:
    """The pictures with their captions, the film first."""
    words = captions(subject.seen)
    drawn = [
        {"key": name, "src": svg_uri(name, subject.solution), "caption": words[name]} for name in shown(subject.seen)
    ]
    moving = None
    if subject.film is not None:
        last = subject.film.frames[-1]
        moving = {
            "src": gif_uri(subject.film.gif),
            "still": still_uri(last),
            "caption": words["film"],
            "width": last.width,
            "height": last.height,
        }
    return Section("pictures", "What happened", {"film": moving, "figures": drawn})


def events(subject: Subject) -> Section:
    """What happened on the way, in order of time."""
    found = subject.solution.events
    rows = [(subject.write(event.t, "time"), event.sentence[0].upper() + event.sentence[1:]) for event in found]
    return Section(
        "events",
        "Events",
        {"rows": [(when, pretty(what)) for when, what in rows[:MOST_EVENTS]], "more": max(len(rows) - MOST_EVENTS, 0)},
    )


SECTIONS: Final[tuple[Callable[[Subject], Section | None], ...]] = (
    verdict,
    meaning,
    parameters,
    admissibility,
    pictures,
    ending,
    events,
    ledger,
    promises,
    origin,
)
"""The sections in the order a reader needs them."""
