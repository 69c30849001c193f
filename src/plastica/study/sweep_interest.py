"""The members of a sweep that are most worth a look."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from dataclasses import dataclass
from itertools import zip_longest
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from plastica.errors import ArgumentError
from plastica.study.sweep_outputs import FAILED, REGIMES, STATUSES
from plastica.study.sweep_store import Store

__all__ = ["Interesting", "interesting"]

Array = NDArray[np.float64]
Chosen = list[tuple[int, str]]

MOST_LOOKED_AT: Final = 2_000_000
"""Members among which boundaries are looked for."""

MOST_PAIRS: Final = 3_000
"""Members without a grid among which every pair is looked at."""

EXTREMES: Final = {
    "natural_curvature": "natural curvature",
    "tip_y": "free end farthest across",
    "largest_angle": "largest turn",
}


@dataclass(frozen=True)
class Interesting:
    """A member that is worth a look.

    Attributes
    ----------
    member : int
        Which one.
    why : str
        Why.
    takes : str
        What it takes.
    """

    member: int
    why: str
    takes: str


def interesting(store: Store, count: int, missing: Collection[int]) -> tuple[Interesting, ...]:
    """Choose members: in turn one that failed, one beside which others end differently, and one that is extreme.

    Parameters
    ----------
    store : Store
        The sweep.
    count : int
        How many.
    missing : collection of int
        Chunks that are not done.

    Returns
    -------
    tuple of Interesting

    Raises
    ------
    ArgumentError
        Where the count is not positive.
    """
    if isinstance(count, bool) or not isinstance(count, int) or count < 1:
        raise ArgumentError("must be a positive whole number", where="count", value=count)
    looked_at = min(store.plan.count, MOST_LOOKED_AT)
    present = [each.name for each in store.variables if not each.shape]
    names = [name for name in ("status", "regime", *EXTREMES) if name in present]
    found = store.read(names, 0, looked_at, missing)
    kinds = (_failures(found["status"]), _boundaries(store, found, looked_at, missing), _extremes(found))
    chosen: dict[int, str] = {}
    for turn in zip_longest(*kinds):
        for each in turn:
            if each is not None and len(chosen) < count:
                chosen.setdefault(*each)
    rows = {member: store.values(member, member + 1, missing)[0] for member in chosen}
    return tuple(Interesting(member, why, store.plan.told(rows[member])) for member, why in chosen.items())


def _failures(status: NDArray[Any]) -> Chosen:
    """Members that failed: one of each status first."""
    groups = [
        [(int(member), f"ended with {code}") for member in np.flatnonzero(status == STATUSES.index(code))[:100]]
        for code in sorted(FAILED)
    ]
    return [each for turn in zip_longest(*groups) for each in turn if each is not None]


def _boundaries(store: Store, found: dict[str, NDArray[Any]], count: int, missing: Collection[int]) -> Chosen:
    """Members next to which another comes to something else, those between the rarest regimes first."""
    if "regime" not in found:
        return []
    regime = found["regime"].astype(int)
    told = (regime >= 0) & (regime < REGIMES.index("untold"))
    seen: dict[tuple[int, int], list[int]] = {}
    for left, right in _neighbours(store, count, missing):
        differ = told[left] & told[right] & (regime[left] != regime[right])
        for a, b in zip(left[differ][:1000].tolist(), right[differ][:1000].tolist(), strict=True):
            low, high = sorted((int(regime[a]), int(regime[b])))
            seen.setdefault((low, high), []).append(a)
    groups = [
        [(member, f"on the boundary between {REGIMES[low]} and {REGIMES[high]}") for member in _spread(members)]
        for (low, high), members in sorted(seen.items(), key=lambda each: len(each[1]))
    ]
    return [each for turn in zip_longest(*groups) for each in turn if each is not None]


def _spread(members: list[int]) -> list[int]:
    """The same with the middle one first, then those at the quarters, and so on: far from one another."""
    ordered = sorted(set(members))
    spans, found = [(0, len(ordered))], []
    while spans:
        low, high = spans.pop(0)
        if low < high:
            middle = (low + high) // 2
            found.append(ordered[middle])
            spans += [(low, middle), (middle + 1, high)]
    return found


def _neighbours(
    store: Store, count: int, missing: Collection[int]
) -> Iterator[tuple[NDArray[np.intp], NDArray[np.intp]]]:
    """Pairs of members beside one another: along every axis of a grid, else the nearest of each."""
    plan = store.plan
    if plan.members.sampling == "grid" and count == plan.count:
        # In the order of the values, which a list need not be in.
        places = np.arange(count).reshape(plan.members.shape)
        places = places[np.ix_(*(np.argsort(axis.values, kind="stable") for axis in plan.axes))]
        for axis in range(places.ndim):
            moved = np.moveaxis(places, axis, 0)
            yield moved[:-1].ravel(), moved[1:].ravel()
        return
    some = np.arange(min(count, MOST_PAIRS))
    values = store.values(0, some.size, missing)
    spread = np.ptp(values, axis=0)
    scaled = values / np.where(spread > 0.0, spread, 1.0)
    if some.size < 2:
        return
    from scipy.spatial import cKDTree

    nearest = cKDTree(scaled).query(scaled, k=min(4, some.size))[1]
    for column in np.atleast_2d(nearest).T[1:]:
        yield some, column.astype(np.intp)


def _extremes(found: dict[str, NDArray[Any]]) -> Chosen:
    """The members with the largest numbers."""
    chosen: Chosen = []
    for name, words in EXTREMES.items():
        if name not in found:
            continue
        values = np.abs(found[name])
        if np.isfinite(values).any():
            chosen.append((int(np.nanargmax(values)), f"largest: {words}"))
    return chosen
