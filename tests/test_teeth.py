"""Claim: every claim's check catches the defect that is planted for it, and passes where there is none."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

import plastica as pl
from plastica import units
from plastica.material import material as laws
from plastica.physics import initial
from plastica.physics.scales import Scales
from tests import (
    test_adjoint,
    test_dependence,
    test_evolution,
    test_expression,
    test_ledger,
    test_load,
    test_material,
    test_programs,
    test_rough_data,
    test_solve,
    test_specimen,
    test_store,
    test_symmetry,
    test_units,
)
from tests.defects import DEFECTS
from tests.support import SHAPES, pair, reference, solution_of

Check = Callable[[Path], None]
CAUGHT = (AssertionError, pytest.fail.Exception)
"""A check that expects an error fails by pytest's own exception where there is none."""


def case(initial: str, name: str, gamma: str) -> dict[str, object]:
    found = [c for c in reference() if (c["initial"], c["pair"], c["gamma"]) == (initial, name, gamma)]
    return found[0]


def reverse() -> dict[str, object]:
    """A reference motion in which yielding stops and starts again to the other side."""
    return next(c for c in reference() if c["initial"] == "reverse" and c["phase_switches"])


def strut(gamma: float = 3.0, *, threshold: float = 0.1, grid: pl.Grid | None = None) -> pl.Strut:
    material = pl.Material("k*m**2/2", "c*pos(x)**2", "h*(1 + m**2)", {"k": 1.0, "c": 1.0, "h": threshold})
    return pl.Strut(material, pl.Load(thrust=gamma), grid or pl.Grid(nodes=12))


def motion(shape: str = "0.3 + cos(3*s)", until: float = 20.0, gamma: float = 3.0) -> pl.Solution:
    return pl.solve(strut(gamma), shape, 0.1, until=until)


def from_rest() -> pl.Solution:
    """A rod that is frozen first and yields later."""
    return pl.solve(strut(), 0.05, 0.01, until=20.0)


def table() -> pl.programs.Program:
    return pl.programs.table([0.0, 5.0, 5.0, 12.0], [1.0, 1.0, 3.0, 0.5])


def flipped(folder: Path) -> None:
    """One bit of one number of a saved result is turned."""
    sol = motion(until=1.0)
    whole = sol.save(folder / "run.nc").read_bytes()
    at = whole.index(sol.history.y[3].tobytes())
    damaged = bytearray(whole)
    damaged[at + 2] ^= 4
    test_store.check_damage(folder / "flipped.nc", bytes(damaged))


def resumed(folder: Path) -> None:
    """A run that is taken up after its first legs, one of which is frozen."""
    load = pl.Load(thrust=pl.programs.cycles(0.0, 3.0, 2.0, 5))
    model = pl.Strut(pair("A", 5.0), load, pl.Grid(nodes=8))
    options = {"curvature": "0.3*cos(2*s)", "until": 12.0, "checkpoint": folder / "c", "checkpoint_every": 0.0}
    whole = pl.solve(model, **options)
    for path in sorted((folder / "c").glob("legs-*.npz"))[3:]:
        path.unlink()
    test_store.check_resumed(whole, pl.solve(model, **options, resume=True))


CHECKS: dict[str, Check] = {
    "1 the ledger balances": lambda _: test_ledger.check_ledger(motion()),
    "1 so does it under all loads": lambda _: test_ledger.check_other_loads(),
    "1 rates balance to rounding": lambda _: test_ledger.check_balance_of_rates(pair("A"), SHAPES["step"]),
    "2 V never increases": lambda _: test_ledger.check_liapunov(motion("0.1 + s/10", gamma=8.0)),
    "3 drive and flow agree, frozen is frozen": lambda _: test_ledger.check_natural(from_rest()),
    "3 the same where the drive turns": lambda _: test_ledger.check_natural(solution_of(reverse())),
    "4 a step decays": lambda _: test_rough_data.check_step(3.0),
    "8 mirror images to the bit": lambda _: test_symmetry.check_mirror(strut(), SHAPES["smooth"], 0.2, until=5.0),
    "8 mirror images under all loads": lambda _: test_symmetry.test_every_load(test_symmetry.LOADS[1]),
    "9 bounds are not exceeded": lambda _: test_dependence.check_bounds(motion("2 + s", 5.0, 0.01)),
    "9 the growth is the true one": lambda _: test_dependence.test_the_growth_is_not_slack_by_an_order(),
    "adjointness": lambda _: test_adjoint.check_adjoint(pl.Grid(12, (0.0, 0.3, 1.0))),
    "complement": lambda _: test_adjoint.check_complement(pl.Grid(12, (0.0, 0.3, 1.0))),
    "exact integrals": lambda _: test_adjoint.check_exact(pl.Grid(12)),
    "reference, smooth": lambda _: test_evolution.check_motion(reference()[1], 1e-8, 1e-6),
    "reference, step": lambda _: test_evolution.check_motion(case("step", "A", "3"), 1e-8, 1e-6),
    "reference, reverse": lambda _: test_evolution.check_motion(reverse(), 1e-8, 1e-6),
    "reference, switches": lambda _: test_evolution.test_switches(reverse()),
    "kernel equals readable rate": lambda _: test_ledger.check_kernel(strut(), SHAPES["smooth"]),
    "SI equals dimensionless": lambda _: test_solve.test_si_and_dimensionless_runs_are_the_same_motion(),
    "hold and release": lambda _: test_solve.test_a_run_goes_on_under_another_load(),
    "laws scale with the specimen": lambda _: test_material.check_scaling_commutes(),
    "groups of the design": lambda _: test_specimen.check_groups(),
    "scales have their dimension": lambda _: test_specimen.check_dimensions(),
    "loads become dimensionless": lambda _: test_load.check_dimensionless(Scales(0.25, 0.035, 120.0)),
    "one-sided limits of loads": lambda _: test_programs.check_pieces(table()),
    "variation of loads": lambda _: test_programs.check_variation(table()),
    "round trip": lambda folder: test_store.check_round_trip(motion(until=1.0), folder / "run.nc"),
    "damage is seen": flipped,
    "resumed to the bit": resumed,
    "no other run's checkpoint": test_store.test_the_checkpoint_of_another_run_is_refused,
    "derivatives are exact": lambda _: test_expression.check_derivatives_are_exact(),
    "kinks": lambda _: test_expression.test_piecewise_functions_at_their_breaks(),
    "hostile text is refused": lambda _: test_expression.check_hostile_text_is_refused(),
    "inadmissible laws are caught": lambda _: test_material.check_inadmissible_laws_are_caught(),
    "conversion is exact": lambda _: test_units.check_conversion_is_exact(),
    "wrong dimensions are refused": lambda _: test_units.check_wrong_dimension_is_refused(),
}
"""The checks, by the claim they hold; numbers are those of the claims in docs/model.md."""

TEETH = [
    ("1 the ledger balances", "natural dissipation dropped"),
    ("1 the ledger balances", "a digit of the work"),
    ("1 the ledger balances", "dissipation without weights"),
    ("1 so does it under all loads", "the couple taken at s = 0"),
    ("1 rates balance to rounding", "J* by the trapezoidal rule"),
    ("1 rates balance to rounding", "J* without the weights"),
    ("2 V never increases", "thrust of the other sign"),
    ("2 V never increases", "potential of the other sign"),
    ("2 V never increases", "flow against the drive"),
    ("3 drive and flow agree, frozen is frozen", "no threshold"),
    ("3 drive and flow agree, frozen is frozen", "frozen but for its last step"),
    ("3 the same where the drive turns", "flow against the drive"),
    ("4 a step decays", "a digit of the elastic rate"),
    ("4 a step decays", "no element end at a jump"),
    ("8 mirror images to the bit", "a flow uneven by ulps"),
    ("8 mirror images to the bit", "flow to one side only"),
    ("8 mirror images under all loads", "mirror forgets the couple"),
    ("9 bounds are not exceeded", "half the energy in the bound"),
    ("9 the growth is the true one", "half the growth"),
    ("adjointness", "J* by the trapezoidal rule"),
    ("complement", "J* without the weights"),
    ("exact integrals", "a digit of J"),
    ("reference, smooth", "sin by its series"),
    ("reference, smooth", "a digit of the thrust"),
    ("reference, smooth", "J* by the trapezoidal rule"),
    ("reference, step", "no element end at a jump"),
    ("reference, reverse", "flow to one side only"),
    ("reference, reverse", "no threshold"),
    ("reference, switches", "switches at the end of the step"),
    ("kernel equals readable rate", "natural dissipation dropped"),
    ("kernel equals readable rate", "no slope of the drive in the Jacobian"),
    ("kernel equals readable rate", "no coupling in the Jacobian"),
    ("kernel equals readable rate", "no natural dissipation in the Jacobian"),
    ("SI equals dimensionless", "preference scaled by L too often"),
    ("SI equals dimensionless", "flow scaled by L too often"),
    ("hold and release", "the other side of a jump"),
    ("laws scale with the specimen", "threshold scaled by L too often"),
    ("groups of the design", "distributed load by L**2"),
    ("scales have their dimension", "distributed load by L**2"),
    ("loads become dimensionless", "distributed load by L**2"),
    ("one-sided limits of loads", "the other side of a jump"),
    ("variation of loads", "half the variation"),
    ("damage is seen", "digest of nothing"),
    ("resumed to the bit", "checkpoint in single precision"),
    ("no other run's checkpoint", "checkpoint of any run"),
    ("derivatives are exact", "a wrong derivative"),
    ("kinks", "a wrong derivative at a kink"),
    ("hostile text is refused", "steps allowed in laws"),
    ("inadmissible laws are caught", "every hypothesis on evenness holds"),
    ("inadmissible laws are caught", "growth is not judged"),
    ("conversion is exact", "milli taken for centi"),
    ("wrong dimensions are refused", "units of any dimension"),
]
"""Which check catches which defect."""


@pytest.fixture(autouse=True)
def _fresh_laws() -> Iterator[None]:
    """Laws, units and shapes once read are kept; those made under a defect must not outlive it."""
    caches = (laws._laws, units._named_unit, initial._text)
    for kept in caches:
        kept.cache_clear()
    yield
    for kept in caches:
        kept.cache_clear()


@pytest.mark.parametrize("claim", CHECKS)
def test_passes_without_a_defect(claim: str, tmp_path: Path) -> None:
    CHECKS[claim](tmp_path)


@pytest.mark.parametrize(("claim", "defect"), TEETH)
def test_catches(claim: str, defect: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    DEFECTS[defect](monkeypatch)
    with pytest.raises(CAUGHT):
        CHECKS[claim](tmp_path)


def test_every_defect_is_caught_by_some_check() -> None:
    assert {defect for _, defect in TEETH} == set(DEFECTS)
    assert {claim for claim, _ in TEETH} >= set(CHECKS) - {"round trip"}
