"""Seals of a sweep: digests of what a chunk holds, by which alone it is known to be done."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

__all__ = ["digest_of", "digest_of_plan", "seal_of"]

Columns = Mapping[str, NDArray[Any]]


def seal_of(identity: str, chunk: int, columns: Columns) -> bytes:
    """Return the seal of a chunk: a digest that holds for this chunk of this sweep only.

    Parameters
    ----------
    identity : str
        The identity of the sweep, `Plan.identity`.
    chunk : int
        Which chunk.
    columns : mapping of str to ndarray
        All that it holds: what its members take, and what came of them.

    Returns
    -------
    bytes, 32 of them
    """
    return hashlib.sha256(f"{identity} {chunk}\n".encode() + digest_of(columns)).digest()


def digest_of(columns: Columns) -> bytes:
    """Return the SHA-256 over names, types, shapes and values of arrays; by itself the seal of stores of version 1."""
    digest = hashlib.sha256()
    for name in sorted(columns):
        values = np.ascontiguousarray(columns[name])
        digest.update(f"{name} {values.dtype.str} {values.shape}\n".encode())
        digest.update(values.tobytes())
    return digest.digest()


def digest_of_plan(described: Mapping[str, Any]) -> str:
    """Return the SHA-256 of what the file of a plan says, but for the digest itself."""
    told = {name: value for name, value in described.items() if name != "digest"}
    return hashlib.sha256(json.dumps(told, sort_keys=True).encode()).hexdigest()
