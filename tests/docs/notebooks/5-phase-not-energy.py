# Run after the cells of the notebook that have these names.

# %% project
assert energy_error(kept).max() < 1e-14 < 0.2 < error

# %% midpoint
for each in constants(states):
    assert np.abs(each / each[0] - 1).max() < 1e-14

# %% check
for name in ("energy", "p_phi", "p_psi"):
    assert verdict.errors[name].max < 1e-13
assert verdict.digits < 1
assert abs(verdict.growth["phase"] - 1) < 0.02

# %% lateness
assert 45 < quarter < 50

# %% plant
assert np.abs(found - 1e-3).max() < 1e-6

# %% predict
assert abs(predicted[-1] / measured[-1] - 1) < 0.08
assert 1.8 < power < 2.1

# %% growth
assert ahead[-1] > measured[-1] / period

# %% drift
mine = drift.methods[0]
assert max(mine.energy) < 1e-13
assert mine.phase_s[-1] is None
assert abs(mine.phase_exponent - 1) < 0.01

# %% turning-point
assert 20 * at_turn < between

# %% solution-1
assert energy_error(y1).max() == 0
assert frozen.digits < 0.5

# %% solution-2
assert 0.9e-3 < loss < 1.1e-3

# %% solution-3
assert behind[-1] < measured[-1] / 5
assert 0.9 < power < 1.1
