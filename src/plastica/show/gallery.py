"""Which picture belongs to which result: what `plastica.plot` looks into."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from plastica.charts.basin import Basin
from plastica.charts.phase import PhaseDiagram
from plastica.equilibria.branches import Branch, FoldCurve
from plastica.equilibria.equilibrium import Equilibrium
from plastica.equilibria.equilibrium_set import EquilibriumSet
from plastica.equilibria.limits import Limit
from plastica.equilibria.mode_set import Modes
from plastica.equilibria.rest import Rest
from plastica.equilibria.spectrum import Spectrum
from plastica.motion.solution import Solution
from plastica.show.admissible import set_figure
from plastica.show.branches import branches_figure, folds_figure
from plastica.show.charts import basin_figure, capacity_figure, is_capacity, phase_figure
from plastica.show.entropy import entropy_figure, is_thermodynamics
from plastica.show.loops import history_figure, is_history
from plastica.show.modes import spectrum_figure
from plastica.show.regimes import regimes_figure
from plastica.show.rods import equilibrium_figure, limit_figure, rest_figure
from plastica.show.vibration import modes_figure
from plastica.study.sweep_result import Sweep

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["drawn"]

_PICTURES: tuple[tuple[type, Callable[[Any], Figure]], ...] = (
    (Equilibrium, equilibrium_figure),
    (EquilibriumSet, set_figure),
    (Spectrum, spectrum_figure),
    (Limit, limit_figure),
    (Rest, rest_figure),
    (Modes, modes_figure),
    (Basin, basin_figure),
    (Sweep, regimes_figure),
)

_DATASETS: tuple[tuple[Callable[[object], bool], Callable[[Any], Figure]], ...] = (
    (is_capacity, capacity_figure),
    (is_thermodynamics, entropy_figure),
    (is_history, history_figure),
)

_SEVERAL: tuple[tuple[type, Callable[[Any], Figure]], ...] = ((Branch, branches_figure), (FoldCurve, folds_figure))


def drawn(result: object, path: Solution | None = None) -> Figure | None:
    """Return the picture of a result; None where there is none for its type.

    Parameters
    ----------
    result : object
        What `plastica.plot` was given.
    path : Solution or None
        A motion to draw into it, which only a phase diagram has a place for.
    """
    if isinstance(result, PhaseDiagram):
        return phase_figure(result, path)
    found: Any = result
    for tells, chart in _DATASETS:
        if tells(found):
            return chart(found)
    if isinstance(result, (Branch, FoldCurve)):
        found = (result,)
    if isinstance(found, (tuple, list)) and found:
        for each, several in _SEVERAL:
            if all(isinstance(part, each) for part in found):
                return several(found)
    for kind, picture in _PICTURES:
        if isinstance(result, kind):
            return picture(result)
    return None
