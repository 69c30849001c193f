"""Where a law may fail to be analytic: kinks, jumps, and roots or powers of what vanishes."""

from __future__ import annotations

from typing import Any

import sympy as sp

from plastica.material import functions as fn
from plastica.material.examined import Examined
from plastica.material.expression import symbol
from plastica.material.material import Law

__all__ = ["rough_places"]


def rough_places(law: Law, bound: float) -> tuple[float, ...]:
    """Find the arguments at which a law or a derivative of it may not be analytic.

    Parameters
    ----------
    law : Law
        The law, with its scales.
    bound : float
        Only |argument| <= bound is looked at, on some 3000 points for arguments of pos and abs that are not linear.

    Returns
    -------
    tuple of float
        In ascending order, in the law's own (dimensionless) variable; empty for a law that is analytic everywhere.
    """
    variable, tree = symbol(str(law.expression.variable)), law.expression.tree
    if all(_analytic(node) for node in tree.atoms(sp.Function, sp.Pow) if fn.depends(node, variable)):
        return ()
    examined = Examined("law", law.expression, dict(law.values), bound * law.argument_scale)
    return tuple(sorted({z / law.argument_scale + 0.0 for z in examined.suspects()}))


def _analytic(node: Any) -> bool:
    """Tell whether a function or a power is analytic wherever its argument is."""
    if node.is_Pow:
        return bool(node.args[1].is_Integer and node.args[1] >= 0)
    return isinstance(node, (sp.exp, sp.sin, sp.cos, sp.tanh, sp.sinh, sp.cosh, sp.atan))
