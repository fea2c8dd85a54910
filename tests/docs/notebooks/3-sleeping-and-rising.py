# Run after the cells of the notebook that have these names.

# %% cell-06
assert sp.simplify(curvature - (lag.p_psi**2 / (4 * lag.A) - lag.gMR)) == 0

# %% cell-10
assert 117.194006935 < omega_c < 117.194006936

# %% cell-12
assert pushed(140).theta_max < 0.01
assert slow.theta_max > 1

# %% cell-16
assert np.max(np.abs(many.theta_max - depth(spins))[spins < 117]) < 1e-6

# %% cell-18
assert round(one_per_cent) == 16

# %% cell-20
assert abs(ht.facts(top, ht.State(theta=0, psidot=100)).growth_rate / growth - 1) < 1e-13
assert abs(measured / growth - 1) < 1e-3

# %% cell-22
assert abs(step - expected) < 1e-9

# %% cell-24
assert off < 1e-10

# %% cell-28
assert abs(level - np.pi / 2) < 1e-9

# %% cell-30
for delta in (1e-2, 1e-4, 1e-6):
    tilt = pushed(threshold, delta * np.sqrt(gMR / A)).theta_max
    assert abs(tilt / np.sqrt(2 * delta) - 1) < delta

# %% cell-32
assert abs(needed / rough - 1) < 1e-3

# %% cell-34
assert np.array_equal(loops, (abs(p_phi) < p_psi) & (energy * p_psi > gMR * p_phi))

# %% cell-36
assert abs(below[0] / p_psi - 1) < 1e-12
assert abs((upright[1] - below[1]) / depth_below - 1) < 1e-12
