"""Claim: the checks on rods with inertia and on segments catch the defects planted for them."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import plastica as pl
from plastica.equilibria import rest, statics
from plastica.errors import FileError
from plastica.motion import checkpoint, events, integrate, longtime, plan, store
from plastica.physics import bounds, inertial, kernel
from plastica.physics.layout import Layout
from plastica.physics.model import Model
from plastica.physics.natural import NaturalLaw
from plastica.physics.rod import Rod
from plastica.physics.segments import Division
from tests import test_classical, test_inertia_limit, test_rod, test_rod_runs, test_segments
from tests.defects import single_precision, thawed
from tests.rods import INERTIA, LOADS
from tests.rods import model as made_of

Patch = pytest.MonkeyPatch
Plant = Callable[[Patch], None]


def replacing(place: Any, name: str, made: Callable[[Any], Any]) -> Plant:
    """A defect that puts something made of the sound thing in its place."""
    return lambda patch: patch.setattr(place, name, made(getattr(place, name)))


def constants(**changed: Callable[[Any], Any]) -> Plant:
    """A defect of the matrices of the fast equations with inertia."""

    def made(sound: Any) -> Any:
        def wrong(model: Model) -> Any:
            rod, fixed = sound(model)
            return rod, fixed._replace(**{name: change(fixed) for name, change in changed.items()})

        return wrong

    return replacing(inertial, "_constants", made)


def in_contact(**changed: Callable[[Rod, Any], Any]) -> Plant:
    """A defect of the contact forces and couples; each change gets the rod and what is right."""

    def made(sound: Any) -> Any:
        def wrong(self: Rod, t: float, mu: Any, mu_nat: Any, mu_t: Any = None) -> Any:
            found = sound(self, t, mu, mu_nat, mu_t)
            return found._replace(**{name: change(self, found) for name, change in changed.items()})

        return wrong

    return replacing(Rod, "contact", made)


def method(kind: type, name: str, wrong: Callable[..., Any]) -> Plant:
    """A defect of a method: `wrong` gets what is right and then the arguments."""

    def made(sound: Any) -> Any:
        return lambda *arguments: wrong(sound(*arguments), *arguments)

    return replacing(kind, name, made)


def a_property(kind: type, name: str, wrong: Callable[[Any, Any], Any]) -> Plant:
    """A defect of a property, cached or not: `wrong` gets the object and what is right."""

    def plant(patch: Patch) -> None:
        whole = vars(kind)[name]
        sound = whole.fget if isinstance(whole, property) else whole.func
        patch.setattr(kind, name, property(lambda self: wrong(self, sound(self))))

    return plant


def no_coupling(patch: Patch) -> None:
    """The Jacobian does not know that the moments feel the natural curvature."""
    sound = inertial.inertial_jacobian

    def wrong(parts: inertial.Mover, *arguments: Any) -> Any:
        whole, layout = sound(parts, *arguments), parts.rod.layout

        def jacobian(t: float, y: np.ndarray) -> np.ndarray:
            out = whole(t, y)
            out[layout.rate_columns, layout.natural_columns] = 0.0
            return np.asarray(out)

        return jacobian

    patch.setattr(inertial, "inertial_jacobian", wrong)


def heavier(patch: Patch) -> None:
    """The moment of the loads has a wrong ninth digit, for motions as for shapes at rest."""
    sound = kernel.load_moment

    def wrong(*arguments: Any) -> Any:
        moment, slope = sound(*arguments)
        return (lambda t, theta: moment(t, theta) * (1.0 + 1e-8)), (lambda t, theta: slope(t, theta) * (1.0 + 1e-8))

    for place in (kernel, statics):
        patch.setattr(place, "load_moment", wrong)


def rate_of_strut(change: Callable[[Model, Any, Any], Any]) -> Plant:
    """A defect of the fast equations without inertia: `change` gets the model, the sound maker and the moment."""
    return replacing(kernel, "_uniform_rate", lambda sound: lambda model, moment: change(model, sound, moment))


def an_ulp_for_rods(model: Model, sound: Any, moment: Any) -> Any:
    whole = sound(model, moment)
    return (lambda t, y: whole(t, y) * (1.0 + 2.0**-52)) if isinstance(model, Rod) else whole


def mean_of_nodes(self: Division, _right: Any) -> np.ndarray:
    """The mean over a segment is that of its nodes, without weights."""
    inside = self.owner == np.arange(self.count)[:, None]
    return np.asarray(inside / inside.sum(axis=1, keepdims=True))


def without_rate(found: Any, *_: Any) -> Any:
    """A run goes on from rest instead of from the motion that was."""
    model, y = found
    y[model.layout.rate_columns] = 0.0
    return model, y


def upright(right: pl.Load, load: pl.Load) -> pl.Load:
    """The angle of the weight is not mirrored."""
    return pl.Load(**dict(right.items()), weight_angle=load.weight_angle, allow_tension=load.allow_tension)


def as_strut_under(sound: Any, model: Model, factor: float) -> pl.Strut:
    """A rod is taken for the strut under another thrust than its own."""
    strut = sound(model)
    return strut.with_load(pl.Load(thrust=factor * strut.load.thrust(0.0))) if isinstance(model, Rod) else strut


DEFECTS: dict[str, Plant] = {
    "a digit of the translational inertia": constants(momentum=lambda c: c.momentum * (1.0 + 1e-5)),
    "a digit of the rotary inertia": constants(rotary=lambda c: c.rotary * (1.0 + 1e-5)),
    "inertia by its root": constants(momentum=lambda c: c.momentum / np.sqrt(np.linalg.norm(c.momentum))),
    "damping of inertia dropped": constants(damping=lambda c: 0.5 * c.damping),
    "centrifugal forces dropped from the Jacobian": replacing(
        inertial, "_centrifugal", lambda sound: lambda moved, *_: np.zeros_like(moved.whirl)
    ),
    "the Jacobian without the natural curvature": no_coupling,
    "centrifugal forces dropped from the readable equations": replacing(
        Rod, "_angular_acceleration", lambda sound: lambda self, mu, mu_t, moment: sound(self, mu, 0.0 * mu_t, moment)
    ),
    "the clamp holds no inertia": in_contact(clamp_x=lambda rod, _: rod._whole_load(0.8)[0]),
    "a digit of the clamp's couple": in_contact(clamp_couple=lambda _, right: right.clamp_couple * (1.0 + 1e-6)),
    "tension and shear exchanged": in_contact(tension=lambda _, right: right.shear, shear=lambda _, c: c.tension),
    "a digit of the contact couple": in_contact(couple=lambda _, right: right.couple * (1.0 + 1e-9)),
    "kinetic energy of rotation dropped": method(
        Rod, "kinetic_energy", lambda all_of_it, rod, mu, mu_t: all_of_it - 0.5 * rod.angle(mu_t) ** 2 @ rod.grid.w
    ),
    "a digit of the kinetic energy": method(Rod, "kinetic_energy", lambda right, *_: right * (1.0 + 1e-4)),
    "the swing taken for the rate": method(Layout, "mu_t", lambda _, self, y: y[..., self.rate_columns]),
    "the bound is a third": replacing(
        bounds, "bounds_of_energy", lambda sound: lambda model, energy, end: sound(model, energy / 3.0, end)
    ),
    "the weight's angle is not mirrored": method(pl.Load, "mirrored", upright),
    "a ninth digit of the loads": heavier,
    "an ulp of the rate": rate_of_strut(an_ulp_for_rods),
    "damping without inertia forgotten": rate_of_strut(
        lambda model, sound, moment: sound(replace(model, damping=1.0) if isinstance(model, Rod) else model, moment)
    ),
    "a rod is no strut": replacing(
        longtime, "as_strut", lambda sound: lambda model: None if isinstance(model, Rod) else sound(model)
    ),
    "the strut of another thrust": replacing(
        longtime, "as_strut", lambda sound: lambda model: as_strut_under(sound, model, 1.0 + 1e-9)
    ),
    "any rod is a strut": replacing(
        longtime, "as_strut", lambda _: lambda model: pl.Strut(model.material, model.load, model.grid)
    ),
    "means without weights": a_property(Division, "means", mean_of_nodes),
    "nodes of the segment before": a_property(Division, "owner", lambda _, right: np.maximum(right - 1, 0)),
    "dissipation without lengths": method(
        NaturalLaw, "rate", lambda right, law, mu, mu_nat: (right[0], float(law.drive(mu, mu_nat).dot(right[0])))
    ),
    "a digit of the drive": method(NaturalLaw, "drive", lambda right, *_: right * (1.0 + 1e-9)),
    "all segments do what the first does": method(
        NaturalLaw, "rate", lambda right, *_: (np.full_like(right[0], right[0][0]), right[1])
    ),
    "frozen but for its last step": replacing(integrate._Recorder, "frozen", thawed),
    "events of the first segment": replacing(
        events, "_switch", lambda sound: lambda solution, t, segment, **words: sound(solution, t, 0, **words)
    ),
    "one segment within its threshold is enough": a_property(
        rest.Rest, "admissible", lambda shape, _: bool(np.any(np.abs(shape.drive) <= shape.threshold))
    ),
    "gone on with from rest": replacing(plan, "_taken_up", lambda sound: lambda *a: without_rate(sound(*a))),
    "checkpoint in single precision": replacing(checkpoint, "_leg", single_precision),
    "files forget the damping": replacing(store, "INERTIA", lambda sound: sound[:2]),
    "files forget the segments": replacing(
        store, "model_to_dict", lambda sound: lambda model: {**sound(model), "natural_segments": 3}
    ),
}

Check = Callable[[Path], None]
CHECKS: dict[str, Check] = {
    "post-buckled strut": lambda _: test_classical.check_buckled("rod"),
    "bent cantilever": lambda _: test_classical.check_bent("strut"),
    "arc": lambda _: test_classical.check_arc("rod", 0.5),
    "settled": lambda _: test_classical.check_settled("rod", 100.0),
    "heavy column": lambda _: test_classical.check_greenhill(pl.Load(), test_classical.greenhill()),
    "BEAM": lambda _: test_classical.check_beam(),
    "kernel": lambda _: test_rod.check_kernel(rod("constant")),
    "kernel in segments": lambda _: test_rod.check_kernel(rod("constant", 3)),
    "Newton's laws": lambda _: test_rod.check_newton(rod("jumps", 3)),
    "moments": lambda _: test_rod.check_moments(rod("jumps", 3)),
    "ledger": lambda _: test_rod.check_ledger(test_rod.run("elastic", 2, "cyclic")),
    "conservation": lambda _: test_rod.check_conservation(),
    "rates balance": lambda _: test_rod.check_rates_balance(rod("constant", (0.0, 0.2, 1.0))),
    "mirror": lambda _: test_rod.check_mirror("rod", 3, "constant"),
    "bounds": lambda _: test_rod.check_bounds("strut", 3),
    "no inertia": lambda _: test_inertia_limit.check_no_inertia(1),
    "damping": lambda _: test_inertia_limit.check_damping(),
    "limit told": lambda _: test_inertia_limit.check_limit_told(None, "limiting"),
    "no limit told": lambda _: test_inertia_limit.check_no_limit_told(),
    "limit": lambda _: test_inertia_limit.check_limit((1.0, 0.0)),
    "uniform": lambda _: test_segments.check_uniform(5),
    "convergence": lambda _: test_segments.check_convergence(),
    "general rate": lambda _: test_segments.check_general_rate(),
    "frozen": lambda _: test_segments.check_frozen(test_segments.partly()),
    "events": lambda _: test_segments.check_events(test_segments.partly()),
    "admissible": lambda _: test_segments.check_admissible(),
    "gone on with": lambda _: test_rod_runs.check_gone_on_with("rod"),
    "resumed": lambda folder: test_rod_runs.check_resumed("rod in segments", folder / "kept"),
    "file": lambda folder: test_rod_runs.check_file("elastic", folder / "run.nc"),
    "file in segments": lambda folder: test_rod_runs.check_file("rod in segments", folder / "run.nc"),
}

TEETH = [
    ("post-buckled strut", "a ninth digit of the loads"),
    ("bent cantilever", "a ninth digit of the loads"),
    ("arc", "a ninth digit of the loads"),
    ("settled", "a ninth digit of the loads"),
    ("heavy column", "a ninth digit of the loads"),
    ("BEAM", "a digit of the translational inertia"),
    ("kernel", "a digit of the rotary inertia"),
    ("kernel", "centrifugal forces dropped from the Jacobian"),
    ("kernel", "the Jacobian without the natural curvature"),
    ("kernel", "damping of inertia dropped"),
    ("kernel", "centrifugal forces dropped from the readable equations"),
    ("kernel in segments", "dissipation without lengths"),
    ("kernel in segments", "all segments do what the first does"),
    ("Newton's laws", "the clamp holds no inertia"),
    ("Newton's laws", "a digit of the clamp's couple"),
    ("Newton's laws", "tension and shear exchanged"),
    ("moments", "a digit of the contact couple"),
    ("moments", "centrifugal forces dropped from the readable equations"),
    ("ledger", "a digit of the kinetic energy"),
    ("ledger", "the swing taken for the rate"),
    ("ledger", "dissipation without lengths"),
    ("conservation", "kinetic energy of rotation dropped"),
    ("rates balance", "means without weights"),
    ("rates balance", "damping of inertia dropped"),
    ("mirror", "the weight's angle is not mirrored"),
    ("bounds", "the bound is a third"),
    ("no inertia", "an ulp of the rate"),
    ("damping", "damping without inertia forgotten"),
    ("limit", "inertia by its root"),
    ("limit told", "a rod is no strut"),
    ("limit told", "the strut of another thrust"),
    ("no limit told", "any rod is a strut"),
    ("uniform", "dissipation without lengths"),
    ("convergence", "nodes of the segment before"),
    ("general rate", "a digit of the drive"),
    ("frozen", "frozen but for its last step"),
    ("events", "events of the first segment"),
    ("admissible", "one segment within its threshold is enough"),
    ("gone on with", "gone on with from rest"),
    ("resumed", "checkpoint in single precision"),
    ("file", "files forget the damping"),
    ("file in segments", "files forget the segments"),
]
"""Which check catches which defect."""


def rod(load: str, segments: Any = 1) -> Rod:
    made = made_of(LOADS[load], segments=segments, inertia=INERTIA)
    assert isinstance(made, Rod)
    return made


def forget() -> None:
    for kept in (test_classical.beam, test_segments.bent, test_segments.pointwise):
        kept.cache_clear()


@pytest.fixture(autouse=True)
def _fresh() -> Iterator[None]:
    """Motions once computed are kept; those made under a defect must not outlive it."""
    forget()
    yield
    forget()


@pytest.mark.parametrize(("claim", "defect"), TEETH)
def test_catches(claim: str, defect: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    DEFECTS[defect](monkeypatch)
    with pytest.raises((AssertionError, FileError)):
        CHECKS[claim](tmp_path)


def test_every_check_and_every_defect_is_used() -> None:
    assert {claim for claim, _ in TEETH} == set(CHECKS)
    assert {defect for _, defect in TEETH} == set(DEFECTS)
