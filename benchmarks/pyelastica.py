"""A cantilever strut to its settled shape, beside PyElastica (discrete Cosserat rods): error of the tip and time.

Thrust P/Pcr = 1.5183887933, whose post-buckled shape has a tip angle of 100 degrees in closed form. Both rods have
rho A = EI = L = 1 and are set off across by a velocity of the same size. PyElastica's rod is extensible and shearable:
at a radius of L/50 the thrust shortens it by 4e-4. Its damping is external, ours internal; at t = 20 both are at rest
to far below their errors.
"""

from __future__ import annotations

from contextlib import redirect_stdout
from importlib import metadata, util
from io import StringIO

import numpy as np

import plastica as pl
from benchmarks.timing import interleaved, machine, verdict

THRUST = 1.5183887933 * np.pi**2 / 4.0
TIP = np.array([0.3489893004, 0.7915394965])
KICK = 0.5
"""Velocity across at the tip."""
UNTIL = 20.0

ELEMENTS = 20
RADIUS = 0.02
REPEAT = 3


def ours(nodes: int = 12, rtol: float = 1e-6, until: float = UNTIL) -> np.ndarray:
    """The same rod with internal damping; its rate of curvature 4 (1 - s)^2 makes a velocity of 1 at the tip."""
    frozen = pl.Material("m**2/2", "pos(x)**2", "1000")
    rod = pl.Rod(frozen, pl.Load(thrust=THRUST), pl.Grid(nodes), translational_inertia=1.0, damping=0.3)
    sol = pl.solve(rod, curvature_rate=f"{KICK}*4*(1 - s)**2", until=until, rtol=rtol)
    theta = sol.model.angle(sol.model.layout.mu(sol.history.y[-1]))
    return np.array([np.cos(theta) @ sol.grid.w, np.sin(theta) @ sol.grid.w])


def at_rest(nodes: int = 12) -> np.ndarray:
    """The shape alone, without a motion."""
    frozen = pl.Material("m**2/2", "pos(x)**2", "1000")
    return np.array(pl.rest(pl.Strut(frozen, pl.Load(thrust=THRUST), pl.Grid(nodes)), "0.3*cos(pi*s/2)").tip)


def theirs(elements: int = ELEMENTS, until: float = UNTIL, damping: float = 1.5) -> np.ndarray:
    """PyElastica as in its own examples: position Verlet, analytical linear damper, one end fixed, endpoint force.

    Its velocity at the start grows linearly from the clamp.
    """
    import elastica as ea

    class System(ea.BaseSystemCollection, ea.Constraints, ea.Forcing, ea.Damping):  # type: ignore[misc, name-defined]
        pass

    area, inertia = np.pi * RADIUS**2, np.pi * RADIUS**4 / 4.0
    start, along, across = np.zeros(3), np.array([1.0, 0.0, 0.0]), np.array([0.0, 1.0, 0.0])
    young = 1.0 / inertia
    rod = ea.CosseratRod.straight_rod(
        elements, start, along, np.array([0.0, 0.0, 1.0]), 1.0, RADIUS, 1.0 / area,
        youngs_modulus=young, shear_modulus=young / 3.0,
    )  # fmt: skip
    rod.velocity_collection[:] = KICK * across[:, None] * rod.position_collection[0]
    # A third of the time in which a stretching wave crosses an element.
    step = 0.3 / elements / np.sqrt(young * area)
    system = System()
    system.append(rod)
    system.constrain(rod).using(ea.OneEndFixedBC, constrained_position_idx=(0,), constrained_director_idx=(0,))
    system.add_forcing_to(rod).using(ea.EndpointForces, start, -THRUST * along, ramp_up_time=step)
    system.dampen(rod).using(ea.AnalyticalLinearDamper, uniform_damping_constant=damping, time_step=step)
    system.finalize()
    with redirect_stdout(StringIO()):
        ea.integrate(ea.PositionVerlet(), system, until, int(until / step), progress_bar=False)
    return np.asarray(rod.position_collection[:2, -1], dtype=float)


def error(tip: np.ndarray) -> float:
    """Largest error of the tip's coordinates, on whichever side it came to rest."""
    return float(np.abs(np.abs(tip) - TIP).max())


def main() -> None:
    print(f"a cantilever strut at P/Pcr = 1.5183887933 to its settled shape ({machine()})")
    mine, still = error(ours()), error(at_rest())
    if util.find_spec("elastica") is None:
        times = interleaved({"motion": ours, "rest": at_rest}, REPEAT)
        print(f"  plastica: motion on 12 nodes: error {mine:.1e}, {times['motion']:.2f} s; ", end="")
        print(f"shape alone: error {still:.1e}, {1e3 * times['rest']:.1f} ms")
        print("  PyElastica not measured here: it is not installed (extra bench)")
        return
    there = error(theirs())
    times = interleaved({"motion": ours, "rest": at_rest, "theirs": theirs}, REPEAT)
    print(f"  plastica: motion on 12 nodes: error {mine:.1e}, {times['motion']:.2f} s; ", end="")
    print(f"shape alone: error {still:.1e}, {1e3 * times['rest']:.1f} ms")
    print(f"  PyElastica {metadata.version('pyelastica')}, {ELEMENTS} elements: ", end="")
    print(f"error {there:.1e}, {times['theirs']:.2f} s")
    print("  " + verdict("time of the motion against PyElastica", times["motion"] / times["theirs"], 1.0))
    print("  " + verdict("its error against PyElastica", mine / there, 1e-3))
