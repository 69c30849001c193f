"""plastica: slender viscoelastic rods whose natural shape evolves.

The public nouns and verbs; each is imported when it is first used, so that ``import plastica`` is quick.
"""

import sys
from importlib import import_module
from types import ModuleType
from typing import TYPE_CHECKING, Any

from plastica._version import __version__

if TYPE_CHECKING:
    from plastica.charts.basin import Basin, basin
    from plastica.charts.capacity import capacity
    from plastica.charts.phase import PhaseDiagram, phase_diagram
    from plastica.charts.thresholds import Thresholds, thresholds
    from plastica.equilibria.branches import branches, fold_curve
    from plastica.equilibria.catalog import equilibria, equilibria_at
    from plastica.equilibria.equilibrium import Equilibrium, equilibrium
    from plastica.equilibria.equilibrium_set import EquilibriumSet
    from plastica.equilibria.limits import Limit, predict_limit
    from plastica.equilibria.mode_set import Modes
    from plastica.equilibria.modes import modes
    from plastica.equilibria.projection import asymptotic_phase
    from plastica.equilibria.rest import Rest, rest
    from plastica.equilibria.spectrum import Spectrum, spectrum
    from plastica.material import catalogue
    from plastica.material.admissibility import Verdict
    from plastica.material.material import Material
    from plastica.motion.histories import force_displacement, moment_curvature
    from plastica.motion.longtime import omega_limit, time_one_map
    from plastica.motion.many import solve_many
    from plastica.motion.solution import Solution
    from plastica.motion.solve import solve
    from plastica.motion.store import read
    from plastica.motion.thermodynamics import thermodynamics
    from plastica.numerics.grid import Grid
    from plastica.physics import programs
    from plastica.physics.initial import Shape, piecewise
    from plastica.physics.ledger import Ledger
    from plastica.physics.load import Load
    from plastica.physics.rod import Rod
    from plastica.physics.scales import Specimen
    from plastica.physics.status import Status
    from plastica.physics.strut import Strut
    from plastica.show.film import film
    from plastica.show.plots import plot
    from plastica.show.report import report
    from plastica.study.measured import measured_shape
    from plastica.study.sweep import sweep
    from plastica.study.sweep_estimate import estimate_sweep
    from plastica.study.sweep_result import Sweep, read_sweep

_HOMES = {
    "Basin": "plastica.charts.basin",
    "Equilibrium": "plastica.equilibria.equilibrium",
    "EquilibriumSet": "plastica.equilibria.equilibrium_set",
    "Grid": "plastica.numerics.grid",
    "Ledger": "plastica.physics.ledger",
    "Limit": "plastica.equilibria.limits",
    "Load": "plastica.physics.load",
    "Material": "plastica.material.material",
    "Modes": "plastica.equilibria.mode_set",
    "PhaseDiagram": "plastica.charts.phase",
    "Rest": "plastica.equilibria.rest",
    "Shape": "plastica.physics.initial",
    "Solution": "plastica.motion.solution",
    "Specimen": "plastica.physics.scales",
    "Spectrum": "plastica.equilibria.spectrum",
    "Status": "plastica.physics.status",
    "Rod": "plastica.physics.rod",
    "Strut": "plastica.physics.strut",
    "Sweep": "plastica.study.sweep_result",
    "Thresholds": "plastica.charts.thresholds",
    "Verdict": "plastica.material.admissibility",
    "asymptotic_phase": "plastica.equilibria.projection",
    "basin": "plastica.charts.basin",
    "branches": "plastica.equilibria.branches",
    "capacity": "plastica.charts.capacity",
    "equilibria": "plastica.equilibria.catalog",
    "equilibria_at": "plastica.equilibria.catalog",
    "equilibrium": "plastica.equilibria.equilibrium",
    "estimate_sweep": "plastica.study.sweep_estimate",
    "film": "plastica.show.film",
    "fold_curve": "plastica.equilibria.branches",
    "force_displacement": "plastica.motion.histories",
    "measured_shape": "plastica.study.measured",
    "modes": "plastica.equilibria.modes",
    "moment_curvature": "plastica.motion.histories",
    "omega_limit": "plastica.motion.longtime",
    "phase_diagram": "plastica.charts.phase",
    "piecewise": "plastica.physics.initial",
    "plot": "plastica.show.plots",
    "predict_limit": "plastica.equilibria.limits",
    "read": "plastica.motion.store",
    "read_sweep": "plastica.study.sweep_result",
    "report": "plastica.show.report",
    "rest": "plastica.equilibria.rest",
    "solve": "plastica.motion.solve",
    "solve_many": "plastica.motion.many",
    "spectrum": "plastica.equilibria.spectrum",
    "sweep": "plastica.study.sweep",
    "thermodynamics": "plastica.motion.thermodynamics",
    "thresholds": "plastica.charts.thresholds",
    "time_one_map": "plastica.motion.longtime",
}
_MODULES = {"catalogue": "plastica.material.catalogue", "programs": "plastica.physics.programs"}

__all__ = [
    "Basin",
    "Equilibrium",
    "EquilibriumSet",
    "Grid",
    "Ledger",
    "Limit",
    "Load",
    "Material",
    "Modes",
    "PhaseDiagram",
    "Rest",
    "Rod",
    "Shape",
    "Solution",
    "Specimen",
    "Spectrum",
    "Status",
    "Strut",
    "Sweep",
    "Thresholds",
    "Verdict",
    "__version__",
    "asymptotic_phase",
    "basin",
    "branches",
    "capacity",
    "catalogue",
    "equilibria",
    "equilibria_at",
    "equilibrium",
    "estimate_sweep",
    "film",
    "fold_curve",
    "force_displacement",
    "measured_shape",
    "modes",
    "moment_curvature",
    "omega_limit",
    "phase_diagram",
    "piecewise",
    "plot",
    "predict_limit",
    "programs",
    "read",
    "read_sweep",
    "report",
    "rest",
    "solve",
    "solve_many",
    "spectrum",
    "sweep",
    "thermodynamics",
    "thresholds",
    "time_one_map",
]


def __getattr__(name: str) -> Any:
    """Import a public name when it is first used."""
    if name in _HOMES:
        value = getattr(import_module(_HOMES[name]), name)
    elif name in _MODULES:
        value = import_module(_MODULES[name])
    else:
        raise AttributeError(f"module 'plastica' has no attribute {name!r}")
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted(__all__)


class _Package(ModuleType):
    """The package, whose `equilibria` is the verb also after something has imported the layer of that name."""

    def __setattr__(self, name: str, value: Any) -> None:
        if not (name in _HOMES and isinstance(value, ModuleType)):
            super().__setattr__(name, value)


sys.modules[__name__].__class__ = _Package
