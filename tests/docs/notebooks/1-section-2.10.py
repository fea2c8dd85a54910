# Run after the cells of the notebook that have these names.

# %% cell-22
for formula in formulas.values():
    constant = sp.lambdify(symbols, formula.subs(values))
    along = constant(state.theta, state.thetadot, state.phidot, state.psidot)
    assert np.max(np.abs(along / along[0] - 1)) < 1e-13
assert state.psidot.max() == state.psidot[0]
assert state.phidot.min() == state.phidot[0]

# %% cell-28
for tilt in (motion.theta_min, motion.theta_max):
    assert abs(float(V_eff(tilt)) - E) < 1e-15

# %% cell-30
reversals = trajectory.events.theta[np.array(trajectory.events.kind) == "reversal"]
assert np.max(np.abs(reversals - turns_back)) < 1e-14

# %% cell-34
assert abs(period / motion.period - 1) < 1e-13

# %% cell-37
assert np.allclose(rates, [6.366839093883, 21.945335558617], rtol=1e-12)

# %% cell-39
assert 2.7 < heavier.theta_max / motion.theta_max < 3
assert 0.98 < heavier.period / motion.period < 1
