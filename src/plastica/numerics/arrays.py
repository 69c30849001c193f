"""Arrays of any library of the array API standard: what to call, where they lie, and how they are written.

This is the only file that knows an array library by name. Whoever computes calls `Arrays.xp`, or takes the
functions of `Arrays.into`, which write into arrays that can be written and return new ones otherwise.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, Final, TypeAlias

import numpy as np
from numpy.typing import NDArray

from plastica.errors import ArgumentError

__all__ = ["LANES", "AnyArray", "Arrays", "arrays_of", "arrays_on"]

AnyArray: TypeAlias = Any
"""An array of whichever library is in use."""

LANES: Final = 16
"""What the number of columns is a multiple of in every matrix product, so that BLAS treats all columns alike."""


@dataclass(frozen=True)
class Arrays:
    """A library of arrays, on one of its devices.

    Parameters
    ----------
    xp : module
        Its functions, by the names of the array API standard.
    name : str
        What the library is called.
    device : object
        Where its arrays are put; None for its own choice.
    """

    xp: Any = field(default=np, compare=False)
    name: str = "numpy"
    device: Any = None

    @property
    def compiled(self) -> bool:
        """Whether what can be computed in machine code shall be; the arrays are NumPy's."""
        return self.name == "numba"

    @property
    def writable(self) -> bool:
        """Whether functions can be told where to write their result, as those of NumPy can."""
        return self.xp is np

    def of(self, values: Any) -> AnyArray:
        """Return an array of floats on the device, from numbers or a NumPy array; a copy only where one is needed."""
        if self.writable:
            return np.asarray(values, dtype=np.float64)
        made = np.ascontiguousarray(values, dtype=np.float64)
        return self.xp.asarray(made, dtype=self.xp.float64, device=self.device)

    def mask(self, values: Any) -> AnyArray:
        """Return an array of truth values on the device."""
        return self.xp.asarray(np.asarray(values, dtype=bool), dtype=self.xp.bool, device=self.device)

    def host(self, array: AnyArray) -> NDArray[Any]:
        """Return an array as one of NumPy, on the host."""
        if self.writable:
            return np.asarray(array)
        from array_api_compat import is_cupy_array, is_torch_array

        if is_cupy_array(array):
            return np.asarray(array.get())
        if is_torch_array(array):
            return np.asarray(array.detach().cpu().numpy())
        return np.from_dlpack(array) if self.name == "array_api_strict" else np.asarray(array)

    def put(self, target: AnyArray, index: Any, values: AnyArray) -> AnyArray:
        """Return `target` with values at an index: written in place where the library allows it, else a new array.

        Values that lie in the target's own memory have been written there already.
        """
        if hasattr(target, "at"):
            return target.at[index, ...].set(values)
        if self.writable and np.may_share_memory(target[index, ...], values):
            return target
        target[index, ...] = values
        return target

    def put_columns(self, target: AnyArray, columns: NDArray[np.intp], values: NDArray[Any]) -> AnyArray:
        """Return `target` with values from the host in some of its columns (its last axis)."""
        if self.writable:
            target[..., columns] = values
            return target
        # The standard has no such assignment, and JAX would compile it anew for every number of columns.
        whole = np.array(self.host(target))
        whole[..., columns] = values
        return self.xp.asarray(whole, dtype=target.dtype, device=self.device)

    def chosen(self, where: AnyArray, values: AnyArray, target: AnyArray) -> AnyArray:
        """Return `target` with the values where told; written in place where the library allows it."""
        if self.writable:
            np.copyto(target, values, where=where)
            return target
        return self.xp.where(where, values, target)

    def stacked(self, above: AnyArray, last: AnyArray, out: AnyArray) -> AnyArray:
        """Return an array with one more row; where `out` is given, what is above lies there already."""
        if out is None:
            return self.xp.concat([above, self.xp.reshape(last, (1, -1))])
        out[-1, ...] = last
        return out

    def pair(self, first: AnyArray, second: AnyArray, out: AnyArray) -> AnyArray:
        """Return two rows as one array, written into `out` where that is given."""
        if out is None:
            return self.xp.stack([first, second])
        out[0, ...] = first
        out[1, ...] = second
        return out

    def into(self, name: str) -> Callable[..., AnyArray]:
        """Return a function of the standard whose last argument is where to write; it returns what it wrote."""
        function: Callable[..., AnyArray] = getattr(self.xp, name)
        if self.writable:
            # NumPy no longer takes the place of a maximum by position.
            return (lambda a, b, out: function(a, b, out=out)) if name == "maximum" else function
        return lambda *arguments: function(*arguments[:-1])

    def empty(self, *shape: int) -> AnyArray:
        """Return where results of this shape may be written; None where nothing can be."""
        return np.zeros(shape) if self.writable else None

    @cached_property
    def tangent_is_vectorised(self) -> bool:
        """Whether the tangent is computed for many numbers at once, which makes it cheaper than the sine.

        NumPy's sine and cosine of doubles go number by number; its tangent does not on processors with AVX-512.
        """
        if not self.writable:
            return False
        told = np.lib.introspect.opt_func_info(func_name="^tan$", signature="float64")
        return not any("baseline" in each["current"] for kind in told.values() for each in kind.values())


def arrays_of(*given: object) -> Arrays:
    """Return the library of the arrays given; NumPy where there are none of another.

    Raises
    ------
    ArgumentError
        Where they are of several libraries.
    """
    arrays = [each for each in given if _foreign(each)]
    if not arrays:
        return Arrays()
    from array_api_compat import array_namespace, device

    try:
        xp = array_namespace(*arrays)
    except TypeError as error:
        raise ArgumentError(f"must be of one library ({error})", where="arrays") from None
    return Arrays(xp, _name(xp), device(arrays[0]))


def arrays_on(library: str | None, device: object, *given: object) -> Arrays:
    """Return a library by its name, or that of the arrays given where no name is.

    Parameters
    ----------
    library : str or None
        "numpy", "numba" (arrays of NumPy, and machine code for what is done most), "cupy", "torch", "jax" or
        "array_api_strict".
    device : object
        A device of that library; None for its own choice, or that of the arrays.
    *given : object
        Arrays that tell the library where no name is given.

    Raises
    ------
    ArgumentError
        Where the library is not known or not installed, or knows no numbers of double precision.
    """
    if library is None:
        found = arrays_of(*given)
        return found if device is None else Arrays(found.xp, found.name, device)
    if library not in _MODULES:
        raise ArgumentError(f"must be one of {', '.join(_MODULES)}", where="library", value=library)
    if library == "numpy":
        return Arrays()
    if library == "numba":
        return Arrays(_compiler(), library)
    return _doubles(Arrays(_namespace(library), library, device))


_MODULES = ("numpy", "numba", "cupy", "torch", "jax", "array_api_strict")


def _compiler() -> Any:
    """NumPy, once it is known that there is a compiler for what is done with it."""
    from importlib.util import find_spec

    if find_spec("numba") is None:
        rule = "must be installed to be used"
        raise ArgumentError(rule, where="library", value="numba", next_step='pip install "plastica[fast]"')
    return np


def _namespace(library: str) -> Any:
    from importlib import import_module

    name = {"cupy": "array_api_compat.cupy", "torch": "array_api_compat.torch", "jax": "jax.numpy"}
    try:
        return import_module(name.get(library, library))
    except ImportError as error:
        rule = f"must be installed to be used ({error})"
        raise ArgumentError(rule, where="library", value=library, next_step="NumPy is always there.") from None


def _doubles(arrays: Arrays) -> Arrays:
    """Refuse a library that silently computes in single precision."""
    made = arrays.xp.asarray(1.0, dtype=arrays.xp.float64, device=arrays.device)
    if str(made.dtype).rsplit(".", 1)[-1] != "float64":
        rule = "must compute in double precision"
        next_step = 'With JAX: jax.config.update("jax_enable_x64", True) before anything else.'
        raise ArgumentError(rule, where="library", value=arrays.name, next_step=next_step)
    return arrays


def _foreign(given: object) -> bool:
    """Tell whether something is an array of a library other than NumPy; such a library has been imported by then."""
    if given is None or isinstance(given, (np.ndarray, np.generic, str, int, float, list, tuple)):
        return False
    module = type(given).__module__.split(".")[0]
    return module in ("cupy", "torch", "jax", "jaxlib", "array_api_strict") and module in sys.modules


def _name(xp: Any) -> str:
    for name in _MODULES[1:]:
        if name in xp.__name__.split("."):
            return name
    return str(xp.__name__)
