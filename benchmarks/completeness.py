"""Whether all equilibria are found where the laws have narrow wells, against dense sampling.

Laws are drawn at random: ten kinds of analytic features, 0.002 to 0.1 of the range wide, in the preference energy or in
the threshold, and so high that they come near to making limiting equilibria or unmaking them. What `equilibria` says is
compared with the changes of sign of |D| - Theta, sampled so finely that a feature has hundreds of points, and closer
about every extremum that comes near 0. A case in which an extremum comes too near to tell is left out.
"""

from __future__ import annotations

import argparse
import time
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

import plastica as pl
from plastica.equilibria.elastica import drive, ends

Array = NDArray[np.float64]

SHAPES = {
    "Gaussian": "exp(-z**2)",
    "Lorentzian": "1/(1+z**2)",
    "1/cosh": "1/cosh(z)",
    "tanh": "tanh(z)",
    "derivative of a Gaussian": "z*exp(-z**2)",
    "rounded kink": "sqrt(1+z**2)-1",
    "atan": "atan(z)",
    "rounded logarithm": "log(1+z**2)",
    "1/cosh**2": "1/cosh(z)**2",
    "wave packet": "sin(3*z)*exp(-z**2/4)",
}
NEVER_NEGATIVE = ("Gaussian", "Lorentzian", "1/cosh", "1/cosh**2", "rounded kink", "rounded logarithm")
BASES = (
    ("k*m**2/2", "h"),
    ("k*m**2/2", "h*(1+m**2/50)"),
    ("k*(cosh(m/3)-1)", "h"),
    ("k*m**2/2+k*m**4/400", "h*(2-1/(1+m**2))"),
)
POINTS = 200_000
TOO_NEAR = 1e-9


class Case(NamedTuple):
    """A law with a feature of a given width (share of the range), under a thrust."""

    kind: str
    width: float
    material: pl.Material
    gamma: float


def drawn(rng: np.random.Generator) -> Case:
    """Draw a case."""
    kind = str(rng.choice(list(SHAPES)))
    preference, threshold = BASES[rng.integers(len(BASES))]
    gamma = float(rng.uniform(0.5, 30.0))
    parameters = {"k": float(rng.uniform(0.1, 1.5)), "h": float(10.0 ** rng.uniform(-1.5, 0.5))}
    bare = pl.Material(preference, "pos(x)**2", threshold, parameters)
    far = pl.equilibria(bare, gamma).range[1]
    place = float(rng.uniform(0.1, 0.95)) * far
    end = ends(gamma, place)
    at, share = abs(float(end.mu_nat)) + 0.05, float(10.0 ** rng.uniform(np.log10(0.002), -1.0))
    # z = (m^2 - at^2)/w goes from -1 to 1 within share of the range
    width = share * far * at
    laws = bare.laws()
    gap = abs(abs(float(drive(end, laws))) - laws.threshold.value_at(float(end.mu_nat)))
    height = float(rng.uniform(0.5, 1.6)) * gap * float(rng.choice([-1.0, 1.0]))
    shape = SHAPES[kind].replace("z", "((m**2-q**2)/w)")
    parameters |= {"q": at, "w": width, "A": height * width / (2.0 * at)}
    if rng.uniform() < 0.5:
        preference = f"{preference}+A*({shape})"
    else:
        parameters["A"] = abs(height)
        threshold = f"{threshold}+A*({shape})" if kind in NEVER_NEGATIVE else f"{threshold}+A*(2+{shape})"
    return Case(kind, share, pl.Material(preference, "pos(x)**2", threshold, parameters), gamma)


def excess(case: Case, alpha: Array) -> Array:
    """Return |D| - Theta at clamp curvatures."""
    end, laws = ends(case.gamma, alpha), case.material.laws()
    return np.asarray(np.abs(drive(end, laws)) - laws.threshold.value(end.mu_nat))


def truth(case: Case, far: float) -> Array | None:
    """Return the clamp curvatures in (0, far) next to which |D| - Theta changes its sign; None if one cannot tell."""
    x = np.linspace(0.0, far, POINTS)[1:]
    y = excess(case, x)
    size = np.abs(y)
    near = np.flatnonzero((size[1:-1] <= size[:-2]) & (size[1:-1] <= size[2:])) + 1
    step = x[1] - x[0]
    closer = (x[near][:, None] + step * np.linspace(-1.0, 1.0, 401)).ravel()
    x = np.unique(np.concatenate([x, closer[(closer > 0.0) & (closer <= far)]]))
    y = excess(case, x)
    size = np.abs(y)
    same = np.sign(y[:-2]) * np.sign(y[2:]) > 0.0
    dips = same & (size[1:-1] <= size[:-2]) & (size[1:-1] <= size[2:])
    if np.any(size[1:-1][dips] < TOO_NEAR):
        return None
    changes = np.flatnonzero(np.sign(y[:-1]) * np.sign(y[1:]) < 0.0)
    return np.asarray(0.5 * (x[changes] + x[changes + 1]))


class Answer(NamedTuple):
    """What came of one case: whether it can be told, whether `equilibria` is right, and what it says of itself."""

    told: bool
    right: bool
    complete: bool
    seconds: float


def judged(case: Case) -> Answer:
    """Compare `equilibria` with dense sampling."""
    begin = time.perf_counter()
    found = pl.equilibria(case.material, case.gamma)
    seconds = time.perf_counter() - begin
    exact = truth(case, found.range[1])
    if exact is None:
        return Answer(False, False, found.complete, seconds)
    alpha = np.array([point.alpha for point in found.limiting if point.alpha > 0.0])
    right = alpha.size == exact.size and bool(np.all(np.abs(alpha - exact) <= 2.0 * found.range[1] / POINTS))
    return Answer(True, right, found.complete, seconds)


def main() -> None:
    """Print how many of the cases are right, and how many of those that are wrong call themselves complete."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks completeness")
    parser.add_argument("name", nargs="?")
    parser.add_argument("--cases", type=int, default=1000)
    parser.add_argument("--seed", type=int, default=1)
    asked = parser.parse_args()
    rng = np.random.default_rng(asked.seed)
    cases = [drawn(rng) for _ in range(asked.cases)]
    answers = [judged(case) for case in cases]
    told = [(case, answer) for case, answer in zip(cases, answers, strict=True) if answer.told]
    wide = [answer for case, answer in told if case.width >= 0.004]
    print(f"{len(cases)} laws, {len(told)} can be told by sampling")
    print(f"  right {sum(answer.right for _, answer in told)}")
    print(f"  wrong, and called complete {sum(not a.right and a.complete for _, a in told)}")
    known = sum(answer.complete for answer in wide)
    print(f"  complete {sum(a.complete for _, a in told)}; wells of 0.004 and more {known} of {len(wide)}")
    seconds = [answer.seconds for answer in answers]
    print(f"  seconds each: median {np.median(seconds):.3f}, most {max(seconds):.2f}")
    for case, answer in told:
        if not answer.right:
            print(f"  wrong: {case.kind}, width {case.width:.4g}, complete {answer.complete}: {case}")


if __name__ == "__main__":
    main()
