"""Claim: pictures of equilibria, spectra and charts show what was computed, in the user's units."""

from __future__ import annotations

import sys
from typing import Any

import numpy as np
import pytest
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

import plastica as pl
from plastica.errors import ArgumentError
from plastica.show import admissible, charts
from plastica.show.save import save_picture

from .drawn import EVERY, LENGTH, STIFFNESS, drawn, has, made, near, title, unit_of
from .pictured import line, run


@pytest.mark.parametrize("name", EVERY)
def test_every_result_has_a_picture_with_named_axes(name: str) -> None:
    figure = pl.plot(made(name))
    assert isinstance(figure, Figure)
    assert "undecided" in name or figure.axes
    for ax in figure.axes:
        if ax.axison:
            assert ax.get_xlabel() or ax.get_shared_x_axes().get_siblings(ax)
            assert ax.get_ylabel() or not ax.get_yticks().size


def test_one_branch_and_a_list_of_them_have_pictures_too() -> None:
    first = made("branches")[0]
    assert len(pl.plot(first).axes[0].lines) < len(pl.plot(list(made("branches"))).axes[0].lines)
    for wrong in ((), (first, 3.0), [run]):
        with pytest.raises(ArgumentError, match="picture for"):
            pl.plot(wrong)


def test_these_pictures_solve_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    results = [made(name) for name in EVERY]

    def refuse(*args: object, **options: object) -> None:
        raise AssertionError("a picture must not solve anything")

    for module, name in (
        ("motion.solve", "integrate"),
        ("equilibria.rest", "settle"),
        ("equilibria.eigen", "eigenvalues"),
    ):
        monkeypatch.setattr(sys.modules[f"plastica.{module}"], name, refuse)
    for result in results:
        pl.plot(result)


# -- one shape -----------------------------------------------------------------------------------------------------


def check_equilibrium() -> None:
    """The rod ends at its tip, its curvature is phi', the natural curvature its last value; in mm and 1/m in SI."""
    for name, length, milli in (("equilibrium", 1.0, 1.0), ("equilibrium in SI", LENGTH, 1e-3)):
        found = made(name)
        left, right = pl.plot(found).axes
        x, y = line(left, "rod")
        near([x[-1], y[-1]], np.array(found.tip) * length / milli)
        s, curvature = line(right, "curvature")
        near(curvature, found.curvature(s * milli / length) / length)
        assert np.all(line(right, "natural curvature")[1] == found.mu_nat / length)
        assert ("(mm)" in left.get_xlabel()) == (milli != 1.0)


def test_equilibrium() -> None:
    check_equilibrium()
    assert "it stays" in title(pl.plot(made("equilibrium")))
    assert "moves" in title(pl.plot(made("equilibrium in SI")))


def test_rest_is_the_static_shape() -> None:
    found = made("rest")
    left, right = pl.plot(found).axes
    x, y = line(left, "rod")
    assert np.hypot(x[-1] - found.tip[0], y[-1] - found.tip[1]) <= 1e-12
    s, curvature = line(right, "curvature")
    near(curvature, found.at(s))
    assert "stable" in title(pl.plot(found))


# -- all of them under one thrust ----------------------------------------------------------------------------------


MARKS = ("a limit of motions", "repelling, or a saddle", "tangency", "fold")


def check_set() -> None:
    """Ground where |D| <= Theta, marks at the limiting equilibria by what they are, folds, the exact drive."""
    for name, length, stiffness in (("set", 1.0, 1.0), ("set in SI", LENGTH, STIFFNESS)):
        found = made(name)
        upper, lower = pl.plot(found).axes
        spans = [each for each in upper.patches if each.get_label() == "_admissible" and isinstance(each, Rectangle)]
        assert len(spans) == len(found.intervals)
        for span, (low, high) in zip(spans, found.intervals, strict=True):
            near([span.get_x(), span.get_x() + span.get_width()], np.array([low, high]) / length)
        milli = 1e-3 if length != 1.0 else 1.0
        for words in MARKS:
            expected = [p for p in found.limiting if admissible.kind_of(p) == words]
            expected += [f for f in found.folds if words == "fold"]
            if expected:
                near(drawn(upper, words)[1], np.array([p.mu_nat for p in expected]) / length)
                # A fold whose drive is off the scale is marked above only.
                reach = lower.get_ylim()[1] * milli / stiffness
                low = [p for p in expected if words != "fold" or abs(p.drive) <= reach]
                if low:
                    near(drawn(lower, words)[0], np.array([p.alpha for p in low]) / length)
                    near(drawn(lower, words)[1], np.array([p.drive for p in low]) * stiffness / milli)
        assert len(found.limiting) == sum(line(upper, words)[0].size for words in MARKS[:-1] if has(upper, words))


def test_set() -> None:
    check_set()


def check_limits_of_motions() -> None:
    """At gamma = 3 motions end at the four outer limiting equilibria, not at the two next to the straight rod."""
    upper = pl.plot(made("set")).axes[0]
    assert np.abs(line(upper, "a limit of motions")[0]).min() > 3.0
    assert np.abs(line(upper, "repelling, or a saddle")[0]).max() < 0.2


def test_limits_of_motions() -> None:
    check_limits_of_motions()


def check_broken_where_unstable() -> None:
    """At gamma = 3 the curve is unstable between the two folds, and drawn broken there."""
    found = made("set")
    upper = pl.plot(found).axes[0]
    alpha, values = drawn(upper, "natural curvature, unstable")
    inside = alpha[np.isfinite(values)]
    folds = [f.alpha for f in found.folds]
    step = float(alpha[1] - alpha[0])
    assert abs(inside.min() - min(folds)) <= step
    assert abs(inside.max() - max(folds)) <= 2.0 * step


def test_broken_where_unstable() -> None:
    check_broken_where_unstable()


# -- spectrum ------------------------------------------------------------------------------------------------------


def check_spectrum() -> None:
    """Every eigenvalue is on the line, those that grow as triangles; modes and kernel are the computed ones."""
    found = made("spectrum")
    ax, left, right = pl.plot(found).axes
    grow, die = drawn(ax, "grows")[0], drawn(ax, "decays")[0]
    near(np.sort(np.concatenate([grow, die])), np.sort(np.concatenate([found.lowest, found.eigenvalues])))
    assert grow.size == found.unstable
    assert np.all(grow > 0.0)
    s, first = line(left, "mode 1")
    angle = found.mode_angles(s)[0]
    near(first, angle / np.abs(angle).max())
    near(line(right, "curvature")[1], found.kernel(s))


def test_spectrum() -> None:
    check_spectrum()
    assert made("spectrum").lowest.size == 3
    assert f"unstable in {made('spectrum').unstable} direction" in title(pl.plot(made("spectrum")))
    assert "double eigenvalue" in title(pl.plot(made("spectrum at Euler's load")))


# -- branches and charts -------------------------------------------------------------------------------------------


def check_branches() -> None:
    """Every point of every branch is drawn, solid where stable; folds are marked."""
    found = made("branches")
    ax = pl.plot(found).axes[0]
    lines = [each for each in ax.lines if each.get_label() not in ("fold", "pitchfork")]
    assert len(lines) == sum(len(branch.pieces) for branch in found)
    stable = [each for each in lines if each.get_label() == "stable"]
    assert all(each.get_linestyle() == "-" for each in stable)
    assert len(stable) == sum(count == 0 for branch in found for *_, count in branch.pieces)
    x, y = drawn(ax, "fold")
    near(x, [b.gamma[i] for b in found for i in b.folds])
    near(y, [b.alpha[i] for b in found for i in b.folds])


def test_branches() -> None:
    check_branches()


def test_folds_have_their_cusps() -> None:
    ax = pl.plot(made("folds")).axes[0]
    x, y = drawn(ax, "cusp")
    assert np.abs(np.hypot(x - np.pi**2 / 4.0, y)).min() <= 1e-9
    assert x.size == sum(len(curve.cusps) for curve in made("folds"))


def check_capacity() -> None:
    """The line is the dataset's, in N and 1/m in SI; the critical thrusts stand where they are."""
    for name in ("capacity", "capacity in SI"):
        found = made(name)
        ax = pl.plot(found).axes[0]
        si = "thrust" in found.coords
        finite = np.isfinite(found["largest"].values)
        thrust = found["thrust" if si else "gamma"].values
        x, y = line(ax, "largest borne")
        near(x, thrust[finite])
        near(y, found["largest_curvature" if si else "largest"].values[finite] / unit_of(ax.get_ylabel()))
        assert ("(N)" in ax.get_xlabel()) == si
        force = STIFFNESS / LENGTH**2 if si else 1.0
        for attribute, sign in (("gamma_star", "γ*:"), ("gamma_star_star", "γ**:"), ("euler", "Euler:")):
            place = float(found.attrs[attribute])
            marks = [each for each in ax.lines if str(each.get_label()).startswith(sign)]
            inside = found["gamma"].values[0] <= place <= found["gamma"].values[-1]
            assert len(marks) == inside
            if inside:
                near(np.asarray(marks[0].get_xdata(), float)[0], place * force)


def test_capacity() -> None:
    check_capacity()


def check_phase() -> None:
    """Curves are the components', marks the tangencies and cusps, the ground admissible and stable as computed."""
    found = made("phase")
    left, right = pl.plot(found).axes
    (mesh,) = left.collections[:1]
    kind = np.asarray(mesh.get_array()).reshape(found.alpha.size, found.gamma.size)
    assert np.array_equal(kind.T < 2, found.admissible)
    assert np.array_equal(kind.T % 2 == 1, found.unstable != 0)
    for ax, name in ((left, "alpha"), (right, "mu_nat")):
        x, y = drawn(ax, "tangency")
        near(x, [p.gamma for p in found.tangencies])
        near(y, [getattr(p, name) for p in found.tangencies])
        every = [each for each in ax.lines if each.get_label() == "|D| = Θ, repelling"]
        assert len(every) == len(found.components)
        for each, component in zip(every, found.components, strict=True):
            near(np.asarray(each.get_ydata(), float)[: component.alpha.size], getattr(component, name))


def test_phase() -> None:
    check_phase()
    assert "(N)" in pl.plot(made("phase in SI")).axes[0].get_xlabel()


def test_path_of_a_run_is_drawn_into_a_phase_diagram() -> None:
    solution = run("buckles")
    found = made("phase")
    left, right = pl.plot(found, path=solution).axes
    way = found.path(solution)
    near(line(left, "path of the run")[1], way["alpha"].values)
    near(line(right, "path of the run")[1], way["natural_curvature"].values)
    assert not has(pl.plot(found).axes[0], "path of the run")


def check_basin() -> None:
    """Every start has the colour of the interval that it ends in."""
    found = made("basin")
    ax = pl.plot(found).axes[0]
    (mesh,) = ax.collections[:1]
    kind = np.asarray(mesh.get_array()).reshape(found.interval.shape)
    looks = charts._basin_looks(found)
    assert len({to_rgb(colour) for _, colour in looks.values()}) == len(looks)
    assert np.array_equal(np.array(list(looks))[kind], found.interval)
    row = made("basin row")
    points = pl.plot(row).axes[0]
    near(drawn(points, "near straight")[1], row.alpha.ravel()[row.interval.ravel() == 0])


def test_basin() -> None:
    check_basin()


# -- files ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("suffix", [".png", ".svg", ".pdf"])
def test_pictures_are_written_whole(suffix: str, tmp_path: Any) -> None:
    path = save_picture(made("equilibrium"), tmp_path / f"x{suffix}")
    assert path.stat().st_size > 5000
    assert [each.name for each in tmp_path.iterdir()] == [path.name]
    again = save_picture(made("equilibrium"), tmp_path / f"y{suffix}")
    assert again.read_bytes() == path.read_bytes()


def test_a_picture_of_another_kind_is_refused(tmp_path: Any) -> None:
    with pytest.raises(ArgumentError, match=r"\.png, \.svg, \.pdf"):
        save_picture(made("equilibrium"), tmp_path / "x.gif")
