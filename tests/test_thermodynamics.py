"""Claims on energy and entropy along the rod (section 2 of the paper): the isothermal balance e_t = M mu_t holds at
every node and along every motion; entropy may fall somewhere, but never in all; the rod written in its volume fraction
is the same rod."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import plastica as pl
from plastica.physics.ledger import entropy_rate, spending, stored_energy
from plastica.physics.model import Model
from plastica.physics.thermodynamics import free_energy, free_energy_rate, power
from tests.support import EPS, materials, pair

Array = Any
LOADS = pl.Load(thrust=2.0, transverse=0.7, couple=0.4, weight=1.5, weight_angle=0.6)
SEGMENTS = (1, 3)
NAMES = ("strut", "rod", "elastic rod", "rod of damping 0.3")


def model_of(name: str, segments: int, material: pl.Material | None = None, load: pl.Load = LOADS) -> Model:
    """Every kind of model: no inertia, both inertias, no damping, damping that is not 1."""
    grid, made = pl.Grid(9, (0.0, 0.4, 1.0)), material or pair("B")
    if name == "strut":
        return pl.Strut(made, load, grid, natural_segments=segments)
    inertia = {"rod": (0.3, 0.02, 1.0), "elastic rod": (1.0, 0.01, 0.0)}.get(name, (2.0, 0.0, 0.3))
    first, second, damping = inertia
    return pl.Rod(
        made,
        load,
        grid,
        natural_segments=segments,
        translational_inertia=first,
        rotary_inertia=second,
        damping=damping,
    )


def states(model: Model, seed: int = 0, count: int = 5) -> tuple[Array, Array, Array | None]:
    """Some states that no motion has been asked for: curvature, natural curvature, and rate where it is free."""
    random = np.random.default_rng(seed)
    n, m = model.grid.size, model.segments
    natural = random.uniform(-2.0, 2.0, (count, m) if m > 1 else count)
    mu_t = random.uniform(-2.0, 2.0, (count, n)) if model.has_inertia else None
    return random.uniform(-3.0, 3.0, (count, n)), natural, mu_t


# -- the balance at every node ----------------------------------------------------------------------------------


def check_pointwise(model: Model, seed: int = 0) -> None:
    """tau eta_t + psi_t - M mu_t = 0 at every node to rounding, M from the balance of moments, not from the law."""
    mu, natural, mu_t = states(model, seed)
    t = np.zeros(mu.shape[0])
    if isinstance(model, pl.Rod):
        contact = model.contact(t, mu, natural, mu_t)
        first, _, second = model.rate(t, mu, natural, mu_t)
        turn = float(model.rotary_inertia or 0.0) * model.angle(second)
        couple = 0.4 + (contact.shear - turn) @ model.grid.B.T
    else:
        couple, first = model.couple(t, mu), model.rate(t, mu, natural)[0]
    given = couple * first
    produced, stored = (f(model, t, mu, natural, mu_t) for f in (entropy_rate, free_energy_rate))
    # Accelerations take a system of equations, whose condition grows like n^4.
    scale = np.abs(given).max() + np.abs(produced).max() + np.abs(stored).max()
    slack = 64.0 * EPS * scale * (model.grid.size**4 if model.has_inertia else 1.0)
    assert np.abs(produced + stored - given).max() <= slack
    assert np.abs(power(model, t, mu, natural, mu_t) - given).max() <= slack


def check_rate_of_free_energy(model: Model) -> None:
    """psi_t is the derivative of psi along the motion: central differences, error of order step^2 + eps/step."""
    mu, natural, mu_t = states(model, 1)
    t, step = np.zeros(mu.shape[0]), 1e-5
    first, natural_t = model.rate(t, mu, natural, *([] if mu_t is None else [mu_t]))[:2]
    ahead, behind = (free_energy(model, mu + h * first, natural + h * natural_t) for h in (step, -step))
    differences = (ahead - behind) / (2.0 * step)
    exact = free_energy_rate(model, t, mu, natural, mu_t)
    assert np.abs(exact - differences).max() <= 1e-8 * (np.abs(exact).max() + np.abs(ahead).max())


def check_totals(model: Model) -> None:
    """Integrals along the rod are those of the ledger: stored energy, and the two dissipations."""
    mu, natural, mu_t = states(model, 2)
    t, w = np.zeros(mu.shape[0]), model.grid.w
    stored = stored_energy(model, mu, natural)
    assert np.abs(free_energy(model, mu, natural) @ w - stored).max() <= 16.0 * EPS * np.abs(stored).max()
    _, viscous, yielding = spending(model, t, mu, natural, mu_t)
    rate = entropy_rate(model, t, mu, natural, mu_t)
    slack = 64.0 * EPS * np.abs(rate).max()
    assert np.abs(rate @ w - viscous - yielding).max() <= slack
    assert float((rate @ w).min()) >= -slack


@pytest.mark.parametrize("segments", SEGMENTS)
@pytest.mark.parametrize("name", NAMES)
@pytest.mark.paper("2.14")
def test_the_balance_holds_at_every_node(name: str, segments: int) -> None:
    check_pointwise(model_of(name, segments))


@pytest.mark.parametrize("segments", SEGMENTS)
@pytest.mark.parametrize("name", NAMES)
def test_the_free_energy_has_this_rate(name: str, segments: int) -> None:
    check_rate_of_free_energy(model_of(name, segments))


@pytest.mark.parametrize("segments", SEGMENTS)
@pytest.mark.parametrize("name", NAMES)
def test_totals_are_those_of_the_ledger(name: str, segments: int) -> None:
    check_totals(model_of(name, segments))


@given(materials(), st.sampled_from(NAMES), st.sampled_from(SEGMENTS), st.integers(0, 1000))
@settings(deadline=None, max_examples=40, derandomize=True)
def test_balance_for_any_material(material: pl.Material, name: str, segments: int, seed: int) -> None:
    check_pointwise(model_of(name, segments, material), seed)


# -- the balance along a motion ---------------------------------------------------------------------------------


def check_history(sol: pl.Solution) -> None:
    """e = psi + tau eta at every node and time; the whole rod's e is the work less the kinetic energy gained."""
    data, heat = sol.dataset, pl.thermodynamics(sol)
    largest = sol.ledger.largest_energy
    slack = 100.0 * sol.rtol * max(largest, float(np.abs(heat.free_energy).max()))
    assert float(np.abs(heat.imbalance).max()) <= slack
    assert np.array_equal(heat.imbalance, heat.internal_energy - heat.entropy - heat.free_energy)
    assert float(np.abs(heat.total_free_energy - data.stored_energy).max()) <= 16.0 * EPS * largest
    gained = heat.total_internal_energy - heat.total_internal_energy[0]
    kinetic = data.kinetic_energy - data.kinetic_energy[0] if "kinetic_energy" in data else 0.0
    assert float(np.abs(gained + kinetic - data.work).max()) <= slack
    spent = heat.viscous_dissipation + heat.natural_dissipation
    assert float(np.abs(heat.total_entropy - spent).max()) <= slack
    assert float(heat.entropy[0].max()) == float(heat.entropy[0].min()) == 0.0
    for name in ("internal_energy", "entropy"):
        total = (heat[name] * heat.s_weight).sum("s")
        assert float(np.abs(total - heat[f"total_{name}"]).max()) <= 16.0 * EPS * float(np.abs(heat[name]).max())
    assert float(heat.total_entropy.diff("t").min()) >= -slack
    assert float(heat.total_entropy_rate.min()) >= -64.0 * EPS * float(np.abs(heat.entropy_rate).max())
    assert np.array_equal(heat.entropy_rate, data.entropy_rate)


@cache
def motion(name: str, segments: int = 1, rtol: float = 1e-8) -> pl.Solution:
    """A motion with a ramp, a jump and yielding, of each kind of model."""
    thrust = pl.programs.table([0.0, 1.0, 6.0, 6.0], [0.0, 3.0, 3.0, 1.0])
    if name == "elastic rod":
        # Smooth from rest: a jump would set every mode of an undamped rod swinging.
        thrust, until = "3*sin(t)**4", 3.0
    else:
        until = 9.0
    model = model_of(name, segments, pair("A"), pl.Load(thrust=thrust)).with_grid(pl.Grid(12))
    if name == "elastic rod":
        never = pl.Material("k*m**2/2", "c*pos(x)**2", "h", {"k": 1.0, "c": 1.0, "h": 50.0})
        model = pl.Rod(never, pl.Load(transverse=thrust), model.grid, translational_inertia=1.0, damping=0.0)
        return pl.solve(model, until=until, rtol=rtol)
    return pl.solve(model, 0.3, 0.2, until=until, rtol=rtol)


@pytest.mark.parametrize(("name", "segments"), [("strut", 1), ("strut", 3), ("rod", 1), ("rod", 3)])
@pytest.mark.paper("2.14")
def test_balance_along_a_motion(name: str, segments: int) -> None:
    sol = motion(name, segments)
    assert sol.status.ok
    assert float(np.abs(sol.dataset.natural_dissipation).max()) > 0.0
    check_history(sol)


def test_an_elastic_rod_produces_no_entropy() -> None:
    sol = motion("elastic rod", rtol=1e-7)
    assert sol.status.ok
    check_history(sol)
    heat = pl.thermodynamics(sol)
    assert float(np.abs(heat.entropy).max()) == 0.0
    assert float(heat.total_free_energy.max()) > 0.01


def check_imbalance_follows_the_tolerance() -> None:
    """A thousandth of the tolerance leaves less than a hundredth of the imbalance."""
    coarse, fine = (pl.thermodynamics(motion("strut", 1, rtol)).attrs["largest_imbalance"] for rtol in (1e-6, 1e-9))
    assert fine <= 0.01 * coarse


def test_imbalance_follows_the_tolerance() -> None:
    check_imbalance_follows_the_tolerance()


def check_times() -> None:
    """Times of one's own cut the steps of the solver, and change nothing in what is integrated up to them."""
    steps = motion("strut")
    t = np.linspace(0.0, 9.0, 40)
    asked = pl.solve(motion("strut").model, 0.3, 0.2, until=9.0, times=t)
    there, here = pl.thermodynamics(asked), pl.thermodynamics(steps)
    slack = 100.0 * steps.rtol * float(here.total_internal_energy.max())
    for name in ("total_entropy", "total_internal_energy"):
        both = np.intersect1d(there.t, here.t)
        assert both.size >= 2
        assert float(np.abs(there[name].sel(t=both) - here[name].sel(t=both)).max()) <= slack
    assert np.array_equal(there.t, t)
    check_history(asked)


def test_times_of_ones_own() -> None:
    check_times()


def test_a_run_that_goes_on_counts_from_its_own_start() -> None:
    first = motion("strut")
    second = pl.solve(first.model.with_load(pl.Load()), start=first, until=12.0)
    heat = pl.thermodynamics(second)
    check_history(second)
    assert float(heat.t[0]) == 9.0
    assert np.array_equal(heat.internal_energy[0], heat.free_energy[0])


def test_a_run_without_a_step() -> None:
    sol = pl.solve(pl.Strut(pair("A"), pl.Load()), until="equilibrium")
    assert sol.history.steps == 0
    heat = pl.thermodynamics(sol)
    assert heat.sizes["t"] == 1
    assert float(np.abs(heat.internal_energy).max()) == 0.0


# -- entropy may fall somewhere ---------------------------------------------------------------------------------


@cache
def bowed(segments: int = 1) -> pl.Solution:
    """A slightly bowed strut under 1.22 Euler loads, from its first straight natural shape to where it creeps."""
    grid = pl.Grid(24 if segments == 1 else 6)
    return pl.solve(pl.Strut(pair("A"), pl.Load(thrust=3.0), grid, natural_segments=segments), 0.1, until=40.0)


def check_falls_somewhere() -> None:
    """The outer part of the rod loses entropy while the rod produces it.

    At the free end the couple is 0, so e_t = 0 there: what the end's free energy gains, its entropy loses.
    """
    sol = bowed()
    check_history(sol)
    heat, w = pl.thermodynamics(sol), sol.grid.w
    final = heat.entropy.values[-1]
    assert float(heat.entropy_rate.min()) < -0.05
    assert float(heat.total_entropy_rate.min()) >= 0.0
    end = sol.grid.interpolation([1.0])[0]
    internal, free = heat.internal_energy.values @ end, heat.free_energy.values @ end
    slack = 100.0 * sol.rtol * float(free.max())
    assert np.abs(internal - internal[0]).max() <= slack
    assert abs(final @ end + free[-1] - free[0]) <= slack
    # Numbers that the page on the rod and the example show.
    assert final @ end == pytest.approx(-0.6407, abs=5e-5)
    assert final @ w == pytest.approx(0.9761, abs=5e-5)
    assert np.minimum(final, 0.0) @ w == pytest.approx(-0.0689, abs=5e-4)
    assert float(final[sol.grid.s < 0.78].min()) > 0.0 > float(final[sol.grid.s > 0.81].max())


@pytest.mark.paper("2.15")
def test_entropy_falls_somewhere_but_never_in_all() -> None:
    check_falls_somewhere()


def lost(segments: int) -> float:
    """Temperature times entropy that falls, wherever and whenever it does: the integral of the negative rates."""
    heat = pl.thermodynamics(bowed(segments))
    return -float(np.trapezoid(np.minimum(heat.entropy_rate.values, 0.0) @ bowed(segments).grid.w, heat.t.values))


def check_segments_mend_it() -> None:
    """The more places have a natural curvature of their own, the less entropy falls: with 16 segments, none does."""
    amounts = [lost(m) for m in (1, 2, 4, 8)]
    assert amounts == pytest.approx([0.0904, 0.0125, 0.0012, 2.4e-5], rel=0.03)
    assert float(pl.thermodynamics(bowed(16)).entropy_rate.min()) >= -64.0 * EPS


@pytest.mark.paper("2.15")
def test_with_a_natural_curvature_of_its_own_everywhere_entropy_falls_nowhere() -> None:
    check_segments_mend_it()
