"""The initial shape from a CSV file of measured points, (s, curvature) or (x, y)."""

from __future__ import annotations

import csv
import re
from dataclasses import dataclass
from pathlib import Path
from typing import Final, Literal

import numpy as np
from numpy.typing import NDArray

from plastica.errors import ArgumentError, FileError, shown
from plastica.files import read_bytes
from plastica.physics.initial import Shape
from plastica.study.centreline import centre_line, coarse
from plastica.study.smoothing import Smoothed, smooth, thinned
from plastica.units import dimension_of, format_quantity, parse_quantity

__all__ = ["LARGEST_CSV", "MOST_ROWS", "measured_shape"]

Array = NDArray[np.float64]
Columns = Literal["s, curvature", "x, y"]

LARGEST_CSV: Final = 10_000_000
MOST_ROWS: Final = 1_000_000
FEWEST_ROWS: Final = 5
MISFIT: Final = 0.02
"""How much, relative to its length, a measured rod may be longer or shorter than the specimen."""

DEGREE: Final = 48

_HEADING: Final = re.compile(r"\s*([A-Za-z][\w ]*?)\s*(?:[\[(]\s*([^\])]*?)\s*[\])])?\s*")


@dataclass(frozen=True)
class _Table:
    """Two columns of numbers, the units of their headings, and the line of each row."""

    first: Array
    second: Array
    units: tuple[str | None, str | None]
    lines: NDArray[np.int64]


def measured_shape(
    file: str | Path,
    columns: Columns,
    length: float,
    *,
    si: bool,
    length_unit: str | None = None,
    curvature_unit: str | None = None,
    smoothing: float | None = None,
) -> Shape:
    """Read measured points and smooth them to a curvature along the rod.

    From (s, curvature), the curvature is a cubic smoothing spline, given by the polynomial of least degree that departs
    from it by less than its standard error, so that the grid can resolve it. To points (x, y) on the centre line a
    curve is fitted whose curvature is a polynomial, see `plastica.study.centreline`. The weight of the roughness is the
    most likely one, where the scatter of each point is taken to be its own: what neighbouring points share, such as the
    distortion of a lens, cannot be told from the shape. All this is stated in the shape's words.

    Where the weight is given, the curvature from points (x, y) is the derivative of a cubic smoothing spline of the
    tangent angle, which is that of the chords at their middles.

    Parameters
    ----------
    file : str or Path
        Two columns separated by comma, semicolon or tab, with or without a heading such as "s [mm]".
    columns : str
        "s, curvature" or "x, y"; from the clamp to the free end.
    length : float
        Length of the rod, in m, or 1 without a specimen. Measured lengths are scaled to it by at most 2 %.
    si : bool
        Whether a specimen is used, so that columns have units.
    length_unit, curvature_unit : str, optional
        Units of the columns where the heading does not say them.
    smoothing : float, optional
        Weight of the roughness: mean square departure + smoothing * int f''^2 d(s/L) for the curvature or the angle f;
        0 interpolates. By default what the points themselves make most likely.

    Returns
    -------
    Shape

    Raises
    ------
    FileError
        Where the file cannot be read, or has gaps, text, too few or too many rows, or does not fit the rod.
    ArgumentError
        Where a unit is missing or has another dimension.
    """
    source = Path(file)
    table = _read(source)
    kinds = ("m", "1/m") if columns == "s, curvature" else ("m", "m")
    given = (length_unit, curvature_unit if columns == "s, curvature" else length_unit)
    scales = [_scale(*each, si) for each in zip(table.units, given, kinds, ("length", "curvature"), strict=True)]
    first, second = table.first * scales[0], table.second * scales[1]
    if columns == "x, y" and smoothing is None:
        return _from_points(source, table, first, second, length, si)
    if columns == "x, y":
        s, y = _angles(source, table, first, second)
        whole = float(s[-1])
        s = 0.5 * (s[1:] + s[:-1])
    else:
        s, y = _along(source, table, first), second
        s, whole = s - s[0], float(s[-1] - s[0])
    _check_length(source, whole, length, si)
    places, values = thinned(s / whole, y)
    fit = smooth(places, values, smoothing)
    curve = fit.spline.derivative() if columns == "x, y" else fit.spline
    per_length = 1.0 / length if columns == "x, y" else 1.0
    polynomial, rest = _polynomial(curve, fit, places, columns)
    words = _words(source, table, columns, fit, whole / length, si, rest, polynomial.degree(), per_length)
    return _shape(polynomial, length, per_length, words)


def _from_points(source: Path, table: _Table, x: Array, y: Array, length: float, si: bool) -> Shape:
    """Fit a curve to points, its own scatter and smoothness being found."""
    _check_points(source, table, x, y)
    few_x, few_y = coarse(x, y)
    _check_turns(source, table, few_x, few_y)
    try:
        with np.errstate(all="ignore"):
            line = centre_line(x, y)
    except (ArithmeticError, np.linalg.LinAlgError):
        raise _bad(
            source,
            "must have points along a line, but no curve was found that passes them in their order",
            "Sort the points from the clamp to the free end.",
        ) from None
    _check_length(source, line.length, length, si)
    unit = "1/m" if si else "1/L"
    words = (
        f"measured, {source.name}: {x.size} rows (x, y), from which a curve with a curvature of degree "
        f"{line.curvature.degree()} and roughness weight {line.smoothing:.2g} is off by "
        f"{format_quantity(line.scatter, 'm' if si else '')} rms; standard error of the curvature "
        f"{line.error / length:.2g} {unit} rms; measured length scaled by {length / line.length:.4f}"
    )
    return _shape(line.curvature, length, 1.0 / length, words)


def _shape(polynomial: np.polynomial.Legendre, length: float, per_length: float, words: str) -> Shape:
    def function(at: Array) -> Array:
        return np.asarray(polynomial(2.0 * np.asarray(at, dtype=float) / length - 1.0)) * per_length

    return Shape(function, (), words)


def _bad(source: Path, sentence: str, next_step: str = "") -> FileError:
    return FileError(sentence, where=str(source.name), next_step=next_step)


def _read(source: Path) -> _Table:
    raw = read_bytes(source, limit=LARGEST_CSV)
    try:
        text = raw.decode("utf-8-sig")
    except UnicodeDecodeError:
        raise _bad(source, "must be UTF-8 text") from None
    if "\0" in text:
        raise _bad(source, "must be text, but holds NUL bytes")
    lines = text.splitlines()
    if len(lines) > MOST_ROWS + 1:
        raise _bad(source, f"must have at most {MOST_ROWS} rows, but has {len(lines)}")
    start = next((i for i, line in enumerate(lines) if line.strip()), len(lines))
    if start == len(lines):
        raise _bad(source, "must have rows of two numbers, but is empty")
    mark = next((mark for mark in ";\t," if mark in lines[start]), ",")
    units, heading = _headings(lines[start], mark)
    return _numbers(source, lines, start + heading, mark, units)


def _headings(line: str, mark: str) -> tuple[tuple[str | None, str | None], bool]:
    cells = next(csv.reader([line], delimiter=mark))
    found = [_HEADING.fullmatch(cell) for cell in cells]
    if len(cells) != 2 or not all(found) or any(cell.strip().lower() in ("nan", "inf") for cell in cells):
        return (None, None), False
    return (found[0][2] if found[0] else None, found[1][2] if found[1] else None), True


def _numbers(source: Path, lines: list[str], start: int, mark: str, units: tuple[str | None, str | None]) -> _Table:
    pairs, places = [], []
    for i, line in enumerate(lines[start:], start + 1):
        if not line.strip():
            continue
        cells = line.split(mark)
        if len(cells) != 2 or not all(cell.strip() for cell in cells):
            raise _bad(
                source,
                f"must have two numbers on each line, but line {i} is {shown(line[:80])}",
                "Remove rows with gaps.",
            )
        try:
            pair = float(cells[0]), float(cells[1])
        except ValueError:
            raise _bad(source, f"must have two numbers on each line, but line {i} is {shown(line[:80])}") from None
        if not (np.isfinite(pair[0]) and np.isfinite(pair[1])):
            raise _bad(source, f"must have finite numbers, but line {i} is {shown(line[:80])}")
        pairs.append(pair)
        places.append(i)
    if len(pairs) < FEWEST_ROWS:
        raise _bad(source, f"must have at least {FEWEST_ROWS} rows of numbers, but has {len(pairs)}")
    table = np.array(pairs)
    return _Table(table[:, 0].copy(), table[:, 1].copy(), units, np.array(places))


def _scale(heading: str | None, given: str | None, unit: str, name: str, si: bool) -> float:
    """Return the size of a column's unit in SI; one where everything is dimensionless."""
    text = given if given is not None else heading
    if not si:
        if text not in (None, "", "1", "-"):
            raise ArgumentError("must be absent in a dimensionless scenario", where=f"{name}_unit", value=text)
        return 1.0
    if not text:
        raise ArgumentError(
            "must be given, since the heading of the file does not say it",
            where=f"{name}_unit",
            next_step=f'Write it beside `csv`, as {name}_unit = "{unit}", or head the column with "[{unit}]".',
        )
    size, dimension = parse_quantity(f"1 {text}", where=f"{name}_unit")
    if dimension != dimension_of(unit):
        raise ArgumentError(f"must be a unit such as {unit}", where=f"{name}_unit", value=text)
    return size


def _along(source: Path, table: _Table, s: Array) -> Array:
    falling = np.nonzero(np.diff(s) <= 0.0)[0]
    if falling.size:
        line = int(table.lines[falling[0] + 1])
        raise _bad(
            source,
            f"must have increasing s, but line {line} does not go on",
            "Sort the rows from the clamp to the free end.",
        )
    return s


def _angles(source: Path, table: _Table, x: Array, y: Array) -> tuple[Array, Array]:
    """Arc length at the points, and tangent angle at the middles of the chords between them."""
    _check_points(source, table, x, y)
    _check_turns(source, table, x, y)
    chords = np.hypot(np.diff(x), np.diff(y))
    return np.concatenate([[0.0], np.cumsum(chords)]), np.unwrap(np.arctan2(np.diff(y), np.diff(x)))


def _check_points(source: Path, table: _Table, x: Array, y: Array) -> None:
    still = np.nonzero((np.diff(x) == 0.0) & (np.diff(y) == 0.0))[0]
    if still.size:
        raise _bad(
            source,
            f"must have different points, but line {int(table.lines[still[0] + 1])} repeats the one before",
        )
    if x.size <= FEWEST_ROWS:
        raise _bad(source, f"must have at least {FEWEST_ROWS + 1} points, but has {x.size}")


def _check_turns(source: Path, table: _Table, x: Array, y: Array) -> None:
    """Refuse points, or means of neighbouring points, that turn back on themselves."""
    turn = np.abs(np.diff(np.unwrap(np.arctan2(np.diff(y), np.diff(x)))))
    if turn.max() > 0.5 * np.pi:
        row = round((int(np.argmax(turn)) + 1) * (table.lines.size - 1) / (x.size - 1))
        raise _bad(
            source,
            f"must be in order along the rod, but it turns back at line {int(table.lines[row])}",
            "Sort the points from the clamp to the free end.",
        )


def _check_length(source: Path, whole: float, length: float, si: bool) -> None:
    if abs(whole / length - 1.0) > MISFIT:
        got, due = (format_quantity(value, "m" if si else "") for value in (whole, length))
        raise _bad(
            source,
            f"must cover the rod from end to end to 2 %, but measures {got} where the rod has {due}",
            "Check the unit of the column, and that no row is missing at the ends.",
        )


def _polynomial(curve: object, fit: Smoothed, places: Array, columns: Columns) -> tuple[np.polynomial.Legendre, float]:
    """Return the least-degree polynomial that keeps to a curve more closely than the curve to what is measured."""
    x, w = np.polynomial.legendre.leggauss(2 * DEGREE)
    lower, upper = float(places[0]), float(places[-1])
    # Beyond the outermost middles of chords the curve goes on with the value at its end.
    values = np.asarray(curve(np.clip(0.5 * (1.0 + x), lower, upper)))  # type: ignore[operator]
    table = np.polynomial.legendre.legvander(x, DEGREE)
    coefficients = (table * w[:, None]).T @ values * (np.arange(DEGREE + 1) + 0.5)
    size = float(np.sqrt(0.5 * w @ values**2))
    allowed = max(1e-6 * size, 0.3 * fit.error if columns == "s, curvature" else 1e-3 * size)
    for degree in range(DEGREE + 1):
        left = float(np.sqrt(0.5 * w @ (values - table[:, : degree + 1] @ coefficients[: degree + 1]) ** 2))
        if left <= allowed:
            break
    return np.polynomial.Legendre(coefficients[: degree + 1]), left


def _words(
    source: Path,
    table: _Table,
    columns: Columns,
    fit: Smoothed,
    ratio: float,
    si: bool,
    rest: float,
    degree: int,
    per_length: float,
) -> str:
    of = "angle" if columns == "x, y" else "curvature"
    unit = "rad" if columns == "x, y" else ("1/m" if si else "1/L")
    rest_unit = "1/m" if si else "1/L"
    return (
        f"measured, {source.name}: {table.first.size} rows ({columns}), cubic smoothing spline of the {of} with "
        f"roughness weight {fit.smoothing:.2g}, which changes it by {fit.change:.2g} {unit} rms; then a polynomial of "
        f"degree {degree}, within {rest * per_length:.2g} {rest_unit} rms of it; measured length scaled by "
        f"{1.0 / ratio:.4f}"
    )
