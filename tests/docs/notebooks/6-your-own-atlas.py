# Run after the cells of the notebook that have these names.

# %% across
second = next(c for c in found.curves if c.name == "cusp" and min(c.y) > 1)
assert np.allclose(second.y, 2 * gMR / p_psi, rtol=1e-12)
for curve, (below, above) in steps.items():
    assert (below == above) == (curve[0] == "steady")

# %% star
assert np.allclose((star.x[0], star.y[0]), (at, kick), rtol=1e-5)

# %% approach
assert np.ptp(np.diff(approach.period)[3:]) < 1e-3

# %% wander
assert spin < limit < faster
assert "separatrix" not in {c.name for c in above.curves}

# %% fall
assert np.degrees(row.theta_max[spins < 0.95 * limit]).min() > 20
assert np.degrees(row.theta_max[spins > 1.05 * limit]).max() < 0.5

# %% best
scrapes = heights < radius * np.tan(np.radians(20))
assert np.all(lowest[:, scrapes] < 0)
assert 0 < np.argmax(row) < len(heights) - 1

# %% solution-1
line = next(c for c in other.curves if c.name == "cusp" and min(c.y) > 1)
assert np.ptp(line.y) > 1
assert abs(known["p_phi"] / known["p_psi"] - 1) < 1e-5
assert abs(known["E_prime"] / gMR - 1) < 1e-5

# %% solution-2
assert set(pendulum.counts) == {"waves", "planar-pendulum"}
assert pendulum.counts["planar-pendulum"] == 201  # the row at 0

# %% solution-3
assert not differ.any()
