# Run after the cells of the notebook that have these names.

# %% cell-04
assert [kicked(k).kind for k in kicks] == ["loops", "loops", "cusps", "waves"]

# %% cell-18
seen = k[1:][kinds[1:] != kinds[:-1]]  # where the colour changes
for name in ("second cusp", "through the vertical"):
    assert np.abs(seen - rungs[name]).min() < k[1] - k[0]
for name in ("slow precession", "fast precession"):
    at = np.abs(k - rungs[name]).argmin()
    assert many.theta_max[at] - many.theta_min[at] < 1e-3

# %% cell-20
assert abs(on["second cusp"].theta_max - 0.1) < 1e-15

# %% cell-22
assert (blow.kind, typed.kind) == ("waves", "loops")

# %% cell-28
assert abs(float(half.phidot)) < 1e-9
assert abs(float(half.thetadot)) < 1e-9

# %% cell-30
assert (kicked(12, psidot=140).kind, kicked(20, psidot=140).kind) == ("loops", "waves")
assert abs(low - 15.695837998076) < 1e-11
