"""Where entropy falls: a bowed strut under 1.22 Euler loads, and the entropy of its cross sections.

The natural curvature of the rod is one number, moved by the mean of the couple along the rod. Near the clamp the couple
is large, near the free end it is small, and at the free end it is 0: there no power is put in, e_t = M mu_t = 0. But
the natural curvature grows there as everywhere, and with it the preference energy that every cross section holds. What
the free end gains in free energy it must take from its entropy, which falls. The rod as a whole produces entropy all
the time. This is why the model of Rajagopal and Rodriguez asks for no more than that: with one natural curvature for
the whole rod, entropy cannot grow at every place.

The more segments have a natural curvature of their own, the less of this there is.

You should see: temperature times entropy at the free end falls to -0.641 EI/L**2, exactly what the free energy there
has risen by; it has fallen over the outer fifth of the rod, and yet risen by 0.976 EI/L in all. The sum of what falls
anywhere at any time is 0.0904 EI/L for one segment, 0.0125 for two, 0.0012 for four, and nothing for sixteen.
"""

import numpy as np

import plastica as pl

material = pl.catalogue.material("one-shape", k=1.0, c=1.0, h=0.1)


def strut(segments: int) -> pl.Solution:
    """Return the motion from a bow of 0.1/L, on a grid with 24 nodes or more."""
    grid = pl.Grid(nodes=24 if segments == 1 else 6)
    model = pl.Strut(material, pl.Load(thrust=3.0), grid, natural_segments=segments)
    return pl.solve(model, curvature=0.1, until=40.0)


sol = strut(1)
heat = pl.thermodynamics(sol)
last = heat.isel(t=-1)
end = sol.grid.interpolation([1.0])[0]
at_end = float(end @ last.entropy.values)
risen = float(end @ (heat.free_energy.values[-1] - heat.free_energy.values[0]))
falls = float(heat.s[last.entropy.values < 0.0][0])
print(f"at the free end: temperature x entropy {at_end:+.4f}, free energy {risen:+.4f} EI/L**2")
print(f"it has fallen beyond s = {falls:.2f} L, and in all it is {float(last.total_entropy):+.4f} EI/L")
print(f"what does not balance anywhere: {heat.attrs['largest_imbalance']:.0e} EI/L**2")


def lost(sol: pl.Solution) -> float:
    """Return what falls, summed over places and times."""
    heat = pl.thermodynamics(sol)
    along = (heat.entropy_rate.clip(max=0.0) * heat.s_weight).sum("s")
    return abs(float(np.trapezoid(along, heat.t)))


amounts = {segments: lost(strut(segments)) for segments in (1, 2, 4, 16)}
print("falls somewhere, by segments:", ", ".join(f"{m}: {each:.4f}" for m, each in amounts.items()))

# The picture hatches where entropy falls; figure.savefig("entropy.png") keeps it.
figure = pl.plot(heat)

assert abs(at_end + 0.641) < 1e-3
assert abs(at_end + risen) < 1e-6
assert 0.78 < falls < 0.83
assert abs(float(last.total_entropy) - 0.976) < 1e-3
assert float(heat.total_entropy_rate.min()) >= 0.0
assert np.allclose(list(amounts.values()), [0.0904, 0.0125, 0.0012, 0.0], atol=1e-4)
assert figure.axes
