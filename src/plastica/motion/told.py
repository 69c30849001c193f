"""What is told of many members, as labelled arrays in the user's units."""

from __future__ import annotations

from typing import Any, Final

import numpy as np
from numpy.typing import ArrayLike

from plastica.motion.parts import CODES, Part
from plastica.physics.scales import unit_of
from plastica.physics.strut import Strut

__all__ = ["coordinates", "variables"]

WORDS: Final = {
    "natural_curvature": ("curvature", "natural curvature"),
    "drive": ("drive", "driving force on the natural curvature"),
    "threshold": ("drive", "threshold that the drive must exceed"),
    "tip_x": ("length", "free end, along the clamp's tangent"),
    "tip_y": ("length", "free end, across the clamp's tangent"),
    "tip_angle": ("angle", "tangent angle at the free end"),
    "largest_angle": ("angle", "largest tangent angle, without its sign"),
    "liapunov": ("energy", "Liapunov function: stored energy plus potential of the loads"),
    "limit_natural_curvature": ("curvature", "natural curvature of the equilibrium where the member ends"),
}
"""Kind and name of what is a number with a unit."""

COUNTS: Final = {
    "steps": "steps tried",
    "nodes": "nodes per element",
    "limit_stable": "whether that equilibrium is stable: 1, 0, or -1 where it is not known",
}


def coordinates(strut: Strut, part: Part, times: ArrayLike | None) -> dict[str, Any]:
    """Return the coordinates: `member`, `t` where times are given, and `s` with its weights where it is needed."""
    scales = strut.scales
    made: dict[str, Any] = {"member": ("member", np.arange(part.t.size), {"long_name": "member"})}
    if times is not None:
        made["t"] = ("t", np.array(times, dtype=float), _label(strut, "time", "time"))
    if "curvature" in part.told:
        made["s"] = ("s", part.grid.s * scales.length, _label(strut, "length", "arc length from the clamp"))
        made["s_weight"] = ("s", part.grid.w * scales.length, _label(strut, "length", "quadrature weight of the node"))
    return made


def variables(strut: Strut, part: Part, *, over_time: bool) -> dict[str, Any]:
    """Return the variables, scaled and labelled."""
    made: dict[str, Any] = {}
    for name, values in part.told.items():
        if name in WORDS:
            kind, words = WORDS[name]
            dims = ("member", "t") if over_time and values.ndim == 2 else ("member",)
            made[name] = (dims, values * float(getattr(strut.scales, kind)), _label(strut, kind, words))
    if "curvature" in part.told:
        made["curvature"] = (
            ("member", "s"),
            part.told["curvature"] * strut.scales.curvature,
            _label(strut, "curvature", "curvature of the centre line at the time reached"),
        )
    if "limit_kind" in part.told:
        made["limit_kind"] = ("member", part.told["limit_kind"], _words("where the member ends: kind of its limit"))
        made["limit_stable"] = ("member", part.told["limit_stable"], _words(COUNTS["limit_stable"]))
    made["time_reached"] = ("member", part.t * strut.scales.time, _label(strut, "time", "time of the last state"))
    made["status"] = ("member", np.array(CODES)[part.code], _words("how the member ended"))
    methods = np.where(part.singly, "LSODA", "DOP853")
    made["method"] = ("member", methods, _words("DOP853 in the batch, or LSODA where solved singly"))
    for name in ("steps", "nodes"):
        made[name] = ("member", getattr(part, name), _words(COUNTS[name]))
    return made


def _words(words: str) -> dict[str, str]:
    return {"units": "1", "long_name": words}


def _label(strut: Strut, kind: str, words: str) -> dict[str, str]:
    return {"units": unit_of(kind, strut.specimen is None, thermal=False), "long_name": words}


