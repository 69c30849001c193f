"""What a scenario holds for ever: its material and specimen under one thrust; and how options are read."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from plastica.charts.thresholds import thresholds
from plastica.equilibria.catalog import equilibria_at
from plastica.equilibria.rest import Rest, rest, settle
from plastica.errors import ArgumentError
from plastica.material.material import Material
from plastica.physics.amounts import finite
from plastica.physics.load import Load
from plastica.physics.scales import Scales, Specimen
from plastica.physics.strut import Strut
from plastica.study.scenario import Scenario, read_scenario

__all__ = ["Held", "held", "span", "static_shape"]

EULER = 0.25 * math.pi**2


@dataclass(frozen=True, eq=False)
class Held:
    """A rod under a thrust that stays.

    Attributes
    ----------
    scenario : Scenario
        Where it comes from.
    gamma : float
        The thrust, in EI/L^2.
    source : str
        Why this thrust: "the largest of the scenario", or "as given".
    """

    scenario: Scenario
    gamma: float
    source: str

    @property
    def file(self) -> Path:
        """The scenario's file."""
        return self.scenario.file

    @property
    def title(self) -> str:
        """What the user calls it."""
        return self.scenario.title

    @property
    def material(self) -> Material:
        """Its three laws."""
        return self.scenario.model.material

    @property
    def specimen(self) -> Specimen | None:
        """What it is made into; None in a dimensionless scenario."""
        return self.scenario.model.specimen

    @property
    def strut(self) -> Strut:
        """The rod on its grid.

        Raises
        ------
        ArgumentError
            Where it has inertia: rates are those of a rod without.
        """
        model = self.scenario.problem.strut
        if not isinstance(model, Strut):
            raise ArgumentError(
                "must be left out where rates are asked for, which are those of a rod without inertia",
                where=f"{self.file}: inertia",
                next_step="Leave the section out, and give the specimen a retardation time.",
            )
        return model

    @property
    def scales(self) -> Scales:
        """From dimensionless numbers to those of the scenario."""
        return self.scenario.model.scales

    def clamp_curvature(self, given: str | None) -> float:
        """Return the dimensionless clamp curvature of an equilibrium: as given, or of the start's static shape.

        Raises
        ------
        ArgumentError
            Where the text is none, or there is no static shape to be found.
        """
        if given is not None:
            return _number(given, "1/m", "--alpha", self.specimen, self.scales.curvature)
        shape = static_shape(self.scenario, Load(thrust=self.gamma * self.scales.force))
        alpha = float(shape.model.curvature_between([0.0], shape.mu[None, :], [0.0])[0, 0])
        exact = [each.alpha for each in equilibria_at(self.gamma, float(shape.mu_nat))]
        nearest = min(exact, key=lambda each: abs(each - alpha), default=math.inf)
        if not shape.status.ok or abs(nearest - alpha) > 1e-3 * max(1.0, abs(alpha)):
            raise ArgumentError("must be given where the start comes to no static shape", where="--alpha", value=alpha)
        return nearest

    def thrusts(self, gamma: str | None, thrust: str | None, count: int) -> NDArray[np.float64]:
        """Return thrusts in EI/L^2 for a capacity chart, equally spaced over the range that was given.

        Without a range: one below the thrust at which a gap opens, and the rest from just above it to beyond Euler's
        load.

        Raises
        ------
        ArgumentError
            Where both ranges are given, or one cannot be read.
        """
        if gamma is not None and thrust is not None:
            raise ArgumentError("must not be given together with --thrust", where="--gamma", value=gamma)
        if thrust is not None:
            return np.linspace(*span(thrust, "--thrust", least=0.0, unit="N", specimen=self.specimen), count)
        if gamma is not None:
            return np.linspace(*span(gamma, "--gamma", least=0.0), count)
        opens = thresholds(self.material, specimen=self.specimen).gamma_star_star
        if opens is None or count < 3:
            return np.linspace(0.4 * EULER, 1.05 * EULER, count)
        return np.append(0.8 * opens, np.linspace(1.001 * opens, max(1.05 * EULER, 1.25 * opens), count - 1))


def static_shape(scenario: Scenario, load: Load) -> Rest:
    """Find the static shape downhill from a scenario's start under other loads, which are constant.

    Where the number of nodes is open it is chosen; for a start that is a former result, it is that of its grid.
    """
    model = scenario.model.with_load(load)
    if scenario.start is None:
        return rest(model, scenario.curvature, scenario.natural_curvature)
    layout, y = scenario.start.model.layout, scenario.start.history.y[-1]
    natural = layout.natural(y)
    nat: float | NDArray[np.float64] = float(natural) if natural.ndim == 0 else natural
    if model.grid.nodes == "auto":
        return settle(model.with_grid(scenario.start.model.grid), layout.mu(y), nat)
    there = scenario.problem.strut
    return settle(there.with_load(load), there.layout.mu(scenario.problem.y0), nat)


def held(file: Path, thrust: str | None, gamma: float | None) -> Held:
    """Read a scenario, and find the thrust that is held.

    Parameters
    ----------
    file : Path
        The scenario.
    thrust : str or None
        Text with a unit in SI, a number otherwise.
    gamma : float or None
        The same in EI/L^2; without either it is the largest thrust of the scenario.

    Raises
    ------
    PlasticaError
        Where the scenario has mistakes, has loads beside a thrust or several segments, or the thrust is given twice or
        is no thrust.
    """
    if thrust is not None and gamma is not None:
        raise ArgumentError("must not be given together with --thrust", where="--gamma", value=gamma)
    scenario = read_scenario(file)
    strut = scenario.problem.strut
    others = sorted({name for name, _ in strut.loads.sources()} - {"thrust"})
    if others:
        raise ArgumentError(
            "must be a thrust alone where equilibria are asked for",
            where=f"{file}: load",
            value=", ".join(others),
            next_step="Leave the other loads out; plastica run follows a rod under any of them.",
        )
    if strut.segments > 1:
        raise ArgumentError(
            "must be 1 where equilibria are asked for",
            where=f"{file}: grid.natural_segments",
            value=strut.segments,
            next_step="Leave it out; plastica run follows a rod with several.",
        )
    if thrust is not None:
        value = _number(thrust, "N", "--thrust", scenario.model.specimen, scenario.model.scales.force)
    elif gamma is not None:
        value = gamma
    else:
        value = max(strut.loads.thrust.extreme(scenario.plan.end))
    where = "--gamma" if thrust is None else "--thrust"
    if not (math.isfinite(value) and value >= 0.0):
        raise ArgumentError("must be a thrust, at least 0 (tension is not treated)", where=where, value=value)
    given = thrust is not None or gamma is not None
    return replace(Held(scenario, float(value), ""), source="as given" if given else "the largest of the scenario")


def span(
    text: str, where: str, *, least: float = -math.inf, unit: str = "", specimen: Specimen | None = None
) -> tuple[float, float]:
    """Read a range LO:HI of dimensionless numbers, or of quantities with units.

    Raises
    ------
    ArgumentError
        Where it is no range, is empty, or begins below `least`.
    """
    low, colon, high = text.partition(":")
    if not colon:
        raise ArgumentError("must be a range LO:HI", where=where, value=text, next_step=f"For example {where} 1:2.")
    scale = 1.0 if specimen is None else specimen.scales.force
    ends = tuple(_number(each.strip(), unit, where, specimen if unit else None, scale) for each in (low, high))
    if not least <= ends[0] < ends[1]:
        from_ = "" if math.isinf(least) else f" and start at {least:g} or above"
        raise ArgumentError(f"must be a range LO:HI with LO below HI{from_}", where=where, value=text)
    return ends[0], ends[1]


def _number(text: str, unit: str, where: str, specimen: Specimen | None, scale: float) -> float:
    """A dimensionless number from text: with a unit where there is a specimen, plain otherwise."""
    try:
        plain = float(text)
    except ValueError:
        if specimen is None:
            raise ArgumentError("must be a plain number in a dimensionless scenario", where=where, value=text) from None
        return finite(text, unit, where) / scale
    if specimen is not None and where == "--thrust":
        finite(text, unit, where)
    if not math.isfinite(plain):
        raise ArgumentError("must be finite", where=where, value=text)
    return plain
