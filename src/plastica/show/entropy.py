"""The picture of `plastica.thermodynamics`: where along the rod entropy is produced, and where it falls."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Final

import numpy as np
from matplotlib.colors import SymLogNorm
from matplotlib.patches import Patch
from numpy.typing import NDArray

from plastica.show.axes import Quantity, TimeAxis, axis_unit
from plastica.show.style import DIVERGING, INK, OKABE_ITO, drawing, new_figure, room

if TYPE_CHECKING:
    import xarray
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = ["entropy_figure", "is_thermodynamics"]

Array = NDArray[np.float64]

WIDTH: Final = 7.2
MAP_SIZE: Final = (160, 420)
"""Places and times of the map."""

EARLY: Final = 0.02
"""Where half of the entropy is produced within this share of the run, time is drawn on a logarithmic axis."""

DECADES: Final = 1e-3
"""Share of the largest rate below which the colours become linear: between the signs lies nothing but that."""

TOTALS: Final = (
    ("total_internal_energy", "internal energy", OKABE_ITO["black"], "-"),
    ("total_free_energy", "free energy", OKABE_ITO["blue"], (0, (5, 2))),
    ("total_entropy", "temperature × entropy", OKABE_ITO["vermillion"], (0, (1, 1.2))),
)
"""Variable, words, colour and dashes of the lines below the map."""

_LEGEND: Final[dict[str, Any]] = {"frameon": False, "fontsize": 8.5, "borderaxespad": 0.2, "handlelength": 2.6}


def is_thermodynamics(result: object) -> bool:
    """Tell whether a result is the dataset of `plastica.thermodynamics`."""
    return {"internal_energy", "entropy_rate", "imbalance"} <= set(getattr(result, "data_vars", {}))


def entropy_figure(found: xarray.Dataset) -> Figure:
    """Draw the local entropy rate over time and arc length, and the energies of the whole rod.

    Parameters
    ----------
    found : Dataset
        What `plastica.thermodynamics` returned.

    Returns
    -------
    Figure
        Above, the rate in colours, logarithmic but for the smallest; where it is negative the ground is hatched. Below,
        changes since the start of internal energy, free energy and temperature times entropy: the first is the sum of
        the others.
    """
    time = _time(found)
    with drawing():
        figure = new_figure(WIDTH, 5.4)
        upper, lower = figure.subplots(2, 1, sharex=True, height_ratios=[1.35, 1.0])
        _map(figure, upper, found, time)
        _lines(lower, found, time)
        figure.suptitle("Where entropy is produced along the rod", x=0.01, ha="left", fontsize=11, fontweight="bold")
    return figure


def _values(found: xarray.Dataset, name: str) -> Array:
    return np.asarray(found[name].values, dtype=float)


def _time(found: xarray.Dataset) -> TimeAxis:
    """The axis of time: logarithmic where half of the entropy is produced at its very beginning."""
    t, produced = _values(found, "t"), _values(found, "total_entropy")
    span = float(t[-1] - t[0]) or 1.0
    si = found["t"].attrs["units"] == "s"
    factor, unit = axis_unit("s", float(t[-1])) if si else (1.0, "")
    half = float(t[np.argmax(produced >= 0.5 * produced[-1])] - t[0]) if produced[-1] > 0.0 else span
    log = half < EARLY * span and t.size > 2
    origin = float(t[0]) if log else 0.0
    lower = float(t[0])
    if log:
        first = float(t[np.argmax(produced >= 1e-3 * produced[-1])] - t[0])
        lower = 10.0 ** np.floor(np.log10(max(first, 1e-9 * span) / factor)) * factor
    words = "Time since start" if log and origin > 0.0 else "Time"
    natural = "retardation time" if "retardation" in str(found.attrs.get("conventions", "")) else "T"
    label = f"{words} ({unit})" if unit else f"{words} / {natural}"
    scale = "log" if log else "linear"
    end = (float(t[0]) + span - origin) / factor
    return TimeAxis(scale, origin, factor, unit, lower / factor, end, f"{label}{', logarithmic' if log else ''}")


def _axis(found: xarray.Dataset, name: str, words: str, largest: float, dimensionless: str) -> Quantity:
    unit = str(found[name].attrs["units"])
    if unit == "1":
        return Quantity(1.0, dimensionless, f"{words} {dimensionless}")
    factor, shown = axis_unit(unit, largest)
    shown = shown.replace("*", "·")
    return Quantity(factor, shown, f"{words} ({shown})")


def _map(figure: Figure, ax: Axes, found: xarray.Dataset, time: TimeAxis) -> None:
    t, rate, s = (_values(found, name) for name in ("t", "entropy_rate", "s"))
    length = float(_values(found, "s_weight").sum())
    rows, columns = MAP_SIZE
    middle = np.clip(time.times((np.arange(columns) + 0.5) / columns), t[0], t[-1])
    places = (np.arange(rows) + 0.5) / rows * length
    at_times = np.stack([np.interp(middle, t, column) for column in rate.T], axis=1)
    drawn = np.stack([np.interp(places, s, row) for row in at_times], axis=1)
    largest = float(np.abs(drawn).max()) or 1.0
    thermal = " × temperature" if "times temperature" in found["entropy_rate"].attrs["long_name"] else ""
    axis = _axis(found, "entropy_rate", f"Local entropy rate{thermal}", largest, "/ (EI/L²T)")
    across = _axis(found, "s", "Arc length from the clamp", length, "/ L")
    shown, top = axis(drawn), float(axis(largest))
    edges = time(time.times(np.linspace(0.0, 1.0, columns + 1))), across(np.linspace(0.0, length, rows + 1))
    linear = 10.0 ** np.ceil(np.log10(DECADES * top))
    norm = SymLogNorm(linear, linscale=0.6, vmin=-top, vmax=top)
    mesh = ax.pcolormesh(*edges, shown, cmap=DIVERGING, norm=norm, shading="flat", rasterized=True)
    ax.grid(visible=False)
    _hatch(ax, time(middle), across(places), shown, top)
    time.apply(ax, label=False)
    ax.set_ylim(0.0, float(across(length)))
    ax.set_ylabel(across.label)
    bar = figure.colorbar(mesh, ax=ax, pad=0.02, aspect=24)
    bar.set_label(axis.label)
    bar.outline.set_visible(False)


def _hatch(ax: Axes, t: Array, s: Array, rate: Array, largest: float) -> None:
    """Hatch where the entropy falls, and say so."""
    # Rates at the size of rounding have no sign.
    if float(rate.min()) >= -1e-9 * largest:
        return
    ax.contour(t, s, rate, levels=[-1e-9 * largest], colors=[INK], linewidths=[1.2])
    ax.contourf(t, s, rate, levels=[-2.0 * largest, -1e-9 * largest], colors="none", hatches=["////"])
    ax.legend(
        handles=[Patch(facecolor="white", edgecolor=INK, hatch="////", label="entropy falls here")],
        loc="lower left",
        bbox_to_anchor=(0.0, 1.0),
        **_LEGEND,
    )


def _lines(ax: Axes, found: xarray.Dataset, time: TimeAxis) -> None:
    temperature = float(found.attrs.get("temperature", 1.0))
    values = {name: _values(found, name) - _values(found, name)[0] for name, *_ in TOTALS}
    values["total_entropy"] = values["total_entropy"] * temperature
    largest = max(float(np.abs(each).max()) for each in values.values())
    axis = _axis(found, "total_free_energy", "Change since the start", largest, "× L/EI")
    t = time(_values(found, "t"))
    for name, words, colour, dashes in TOTALS:
        ax.plot(t, axis(values[name]), color=colour, linestyle=dashes, label=words)
    time.apply(ax)
    room(ax, *(axis(each) for each in values.values()))
    ax.set_ylabel(axis.label)
    ax.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=3, **_LEGEND)
