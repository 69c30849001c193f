"""Laws as tapes: lists of arithmetic steps on numbered registers, for code that is compiled before any law is known."""

from __future__ import annotations

import ast
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from plastica.material.anywhere import written

__all__ = ["CODES", "Tape", "tape_of"]

CODES: Final = {
    name: code
    for code, name in enumerate(
        (
            *("add", "multiply", "divide", "power"),
            *("exp", "log", "sin", "cos", "tan", "tanh", "sinh", "cosh", "sqrt", "atan"),
            *("absolute", "sign", "pos", "above", "step"),
        )
    )
}
"""The number of each operation. The first four take two registers, the others one."""

_BINARY: Final = {ast.Add: "add", ast.Mult: "multiply", ast.Div: "divide"}


@dataclass(frozen=True, eq=False)
class Tape:
    """A law written out.

    Attributes
    ----------
    operations : ndarray of int, shape (k, 4)
        In order: code, register written, and the two that are read (twice the same one where one is).
    constants : ndarray, shape (c,)
        What the registers after those of the arguments hold beforehand.
    first_constant, registers : int
        The register of the first constant, and how many there are: first the argument x, then the parameters, the
        constants, and what is computed.
    result : int
        The register with the law's value.
    """

    operations: NDArray[np.int64]
    constants: NDArray[np.float64]
    first_constant: int
    registers: int
    result: int


def tape_of(
    tree: Any,
    variable: str,
    values: Mapping[str, float],
    varying: Sequence[str],
    argument_scale: float = 1.0,
    value_scale: float = 1.0,
) -> Tape:
    """Write (x, p_1, p_2, ...) -> value_scale * tree(argument_scale * x) on a tape.

    Parameters
    ----------
    tree, variable, values, varying, argument_scale, value_scale
        As in `anywhere.function_of`.

    Returns
    -------
    Tape
    """
    body, arguments = written(tree, variable, values, varying, argument_scale, value_scale)
    writer = _Writer(arguments)
    return writer.tape([ast.Return(ast.Constant(body))] if isinstance(body, float) else body)


class _Writer:
    """Gives every name and constant a register, and every operation a line."""

    def __init__(self, arguments: Sequence[str]) -> None:
        self.places: dict[Any, int] = {name: i for i, name in enumerate(arguments)}
        self.lines: list[tuple[int, int, int, int]] = []
        self.computed = 0

    def tape(self, body: Sequence[ast.stmt]) -> Tape:
        nodes = (node for statement in body for node in ast.walk(statement))
        found = (node.value for node in nodes if isinstance(node, ast.Constant))
        ordered = sorted({value for value in found if isinstance(value, float)})
        first = len(self.places)
        self.places |= {value: first + i for i, value in enumerate(ordered)}
        self.computed = len(self.places)
        result = 0
        for statement in body:
            if isinstance(statement, ast.Assign):
                self.places[ast.unparse(statement.targets[0])] = self.register(statement.value)
            elif isinstance(statement, ast.Return) and statement.value is not None:
                result = self.register(statement.value)
        operations = np.array(self.lines, dtype=np.int64).reshape(-1, 4)
        return Tape(operations, np.array(ordered, dtype=np.float64), first, self.computed, result)

    def register(self, expression: ast.expr) -> int:
        """Where the value of an expression lies."""
        match expression:
            case ast.Constant():
                return self.places[expression.value]
            case ast.BinOp():
                return self.line(_BINARY[type(expression.op)], expression.left, expression.right)
            case ast.Call():
                return self.line(ast.unparse(expression.func), *expression.args)
        return self.places[ast.unparse(expression)]

    def line(self, operation: str, *operands: ast.expr) -> int:
        read = [self.register(each) for each in operands]
        written, self.computed = self.computed, self.computed + 1
        self.lines.append((CODES[operation], written, read[0], read[-1]))
        return written
