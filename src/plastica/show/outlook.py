"""The section of a report on where the motion ends: the limit in plain words, its stability, and what it rests on."""

from __future__ import annotations

from typing import Any, Final

import numpy as np

from plastica.equilibria.limits import Limit
from plastica.show.captions import Caption
from plastica.show.ending import Tail, tail_of
from plastica.show.measure import Measure
from plastica.show.panels import LOAD_WORDS
from plastica.show.pictures import svg_uri
from plastica.show.rods import tail_time
from plastica.show.subject import Section, Subject
from plastica.show.words import number, pretty

__all__ = ["ending"]

HEADLINES: Final = {
    "interior": "It comes to rest, with the natural curvature that it has now",
    "limiting": "It creeps on, ever more slowly, to where the drive equals the threshold",
    "undecided": "This cannot be told yet",
}
PLAIN: Final = {
    "interior": "The drive stays within the threshold from here on, so the natural curvature moves no more: whatever "
    "set the rod has taken is all that it will take under this load. What is left to do is viscous, and dies out.",
    "limiting": "The drive is still beyond the threshold, if by ever less, so the natural curvature goes on moving. As "
    "it moves the drive sinks; where the two are equal the rod stays. It never quite arrives there, but what is left "
    "can be told.",
    "undecided": "Where a rod ends can only be told once it has forgotten its start, and is neither about to begin or "
    "stop yielding nor close to a shape at which it might snap.",
}
NO_LIMIT: Final = (
    "A place where the rod ends is predicted for a strut of one natural curvature under a thrust that stays as it is, "
    "and no other load. Here {why}: the run shows how far it came, and no more is told."
)


def ending(subject: Subject) -> Section:
    """Where the motion ends: kind, numbers, stability, predicted and computed approach, assumptions."""
    limit = subject.solution.limit
    tail = tail_of(subject.seen)
    data: dict[str, Any] = {
        "headline": "No limit is predicted for this rod and its loads" if limit is None else HEADLINES[limit.kind],
        "plain": NO_LIMIT.format(why=_why_none(subject)) if limit is None else PLAIN[limit.kind],
        "law": "" if limit is None or limit.equilibrium is None else _law(subject, limit),
        "stability": _stability(limit),
        "stable": limit is None or limit.stable is not False,
        "cards": _cards(subject, limit),
        "assumptions": _assumptions(limit),
        "decide": _what_would_decide(subject, limit),
        "figure": None,
    }
    if limit is not None and limit.equilibrium is not None:
        data["figure"] = {"src": svg_uri("ending", subject.solution), "caption": _caption(subject, limit, tail)}
    return Section("ending", "Where it ends", data)


def _why_none(subject: Subject) -> str:
    """Which of the conditions of a prediction are not met."""
    model, end = subject.solution.model, subject.solution.history.end
    settled = model.loads.settled
    others = sorted({name for name, _ in model.loads.sources()} - {"thrust"})
    reasons = (
        (model.has_inertia, "the model is the rod with inertia"),
        (
            not model.has_inertia and model.damping != 1.0,
            f"times are not in the retardation time, but the damping is {number(model.damping)}",
        ),
        (model.segments > 1, f"the natural curvature is one for each of {model.segments} segments"),
        (bool(others), f"other loads act ({', '.join(LOAD_WORDS[name].lower() for name in others)})"),
        (settled is None or settled > end, "the loads go on changing"),
        (model.loads.thrust(end) < 0.0, "the rod is pulled"),
    )
    told = [words for holds, words in reasons if holds]
    return " and ".join([", ".join(told[:-1]), told[-1]] if len(told) > 1 else told)


def _measure(subject: Subject) -> Measure:
    return Measure(subject.solution.model.specimen)


def _law(subject: Subject, limit: Limit) -> str:
    """How fast it gets there, in times that one can picture."""
    span, measure = tail_time(limit), _measure(subject)
    if limit.kind == "interior" and limit.rate is not None and limit.rate > 0.0:
        half = measure.write(float(np.log(2.0)) / limit.rate, "time")
        return f"What is left of the motion halves every {half}: the approach is exponential."
    if limit.kind == "limiting" and span is not None and limit.exponent is not None:
        over = limit.exponent - 1.0
        if abs(over) < 1e-9:
            return f"What is left halves every {measure.write(float(np.log(2.0)) * span, 'time')}."
        factor = 2.0**over
        half = measure.write(span * (factor - 1.0), "time")
        times = "twice" if abs(factor - 2.0) < 1e-9 else f"{number(factor, 3)} times"
        power = "1/t" if abs(over - 1.0) < 1e-9 else f"t to the power −{number(1.0 / over, 3)}"
        return (
            f"The excess of the drive over the threshold halves within {half} from now, the next halving takes "
            f"{times} as long, and so on: in the long run it falls like {power}."
        )
    return "No rate of approach can be told."


def _stability(limit: Limit | None) -> str:
    if limit is None or limit.equilibrium is None:
        return ""
    if limit.stable:
        return "The end is stable: small disturbances do not throw the rod off it."
    return (
        "The end is not stable: there is a shape in which a small disturbance grows. A real rod, which is never quite "
        "free of disturbances, would leave it for another."
    )


def _cards(subject: Subject, limit: Limit | None) -> list[dict[str, str]]:
    """Natural curvature and free end, in the end and now, and how far there is to go."""
    if limit is None or limit.equilibrium is None:
        return []
    end, measure, solution = limit.equilibrium, _measure(subject), subject.solution
    now = float(solution.model.layout.natural(solution.history.y[-1]))
    length = solution.model.scales.length
    tip_x, tip_y = (float(subject.seen.values(name)[-1]) / length for name in ("tip_x", "tip_y"))
    gap = float(np.hypot(end.tip[0] - tip_x, end.tip[1] - tip_y))
    rest = "less than rounding" if gap < 1e-13 else measure.write(gap, "length")
    return [
        {
            "name": "Natural curvature in the end",
            "value": measure.write(end.mu_nat, "curvature"),
            "more": f"now {measure.write(now, 'curvature')}",
        },
        {
            "name": "Free end off the axis in the end",
            "value": measure.write(end.tip[1], "length"),
            "more": f"now {measure.write(tip_y, 'length')}",
        },
        {"name": "Way left for the free end", "value": rest, "more": "from the last state to the end"},
        {
            "name": "Drive in the end",
            "value": measure.write(end.drive or 0.0, "drive"),
            "more": f"threshold there {measure.write(end.threshold or 0.0, 'drive')}",
        },
    ]


def _assumptions(limit: Limit | None) -> list[dict[str, str]]:
    if limit is None:
        return []
    return [
        {"name": each.name, "checked": "checked" if each.checked else "assumed", "sentence": _tidy(each.sentence)}
        for each in limit.assumptions
    ]


def _tidy(sentence: str) -> str:
    text = pretty(sentence)
    return f"{text[0].upper()}{text[1:]}" if text else text


def _what_would_decide(subject: Subject, limit: Limit | None) -> str:
    """What to do where no answer can be given."""
    if limit is None or limit.kind != "undecided":
        return ""
    why = limit.sentence.partition(": ")[2].rpartition(" Integrate")[0] or limit.sentence
    seen = subject.seen
    longer = 3.0 * max(float(seen.t[-1]), subject.solution.model.scales.time)
    how = 'until = "equilibrium"'
    return (
        f"{_tidy(why)} To decide it, follow the motion further: until {subject.write(longer, 'time')}, say, or {how}."
    )


def _caption(subject: Subject, limit: Limit, tail: Tail | None) -> Caption:
    measure = _measure(subject)
    end = limit.equilibrium
    words = "Above, the rod as it is at the end of the run, and (dotted) as it will be in the end."
    alt = ""
    if end is not None:
        alt = (
            f"In the end the free end is {measure.write(end.tip[0], 'length')} along and "
            f"{measure.write(end.tip[1], 'length')} across, with the natural curvature "
            f"{measure.write(end.mu_nat, 'curvature')}."
        )
    if tail is None:
        return Caption("Now and in the end", words, f"Shape of the rod now and in the end. {alt}")
    what = "the excess of the drive over the threshold" if tail.kind == "limiting" else "the distance from the end"
    kind = "drive" if tail.kind == "limiting" else "curvature"
    scale = "on logarithmic axes" if tail.kind == "limiting" else "on a logarithmic axis"
    values = tail.computed[np.isfinite(tail.computed)]
    first, last = measure.write(float(values[0]), kind), measure.write(float(values[-1]), kind)
    return Caption(
        "Now and in the end, and the way there",
        f"{words} Below, {what} {scale}: as computed, and (broken) as the law of approach predicts it. Nothing is "
        "fitted: its rate follows from the equilibrium, and it is joined to one state of the run. The run has come "
        "into the hold of its end where the two lines meet.",
        f"Shape of the rod now and in the end; below it {what}, computed, from {first} down to {last}, and predicted. "
        f"{alt}",
    )
