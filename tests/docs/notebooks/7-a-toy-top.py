# Run after the cells of the notebook that have these names.

# %% measured
assert abs(density / 2700 - 1) < 0.05

# %% solids
for name, value in mine.items():
    assert abs(float(getattr(top, name)) / value - 1) < 1e-12

# %% limit
assert max(shares, key=lambda name: abs(shares[name])) == "radius"
assert abs(shares["thickness"]) < abs(shares["radius"]) / 20
assert shares["stem_mass"] > 5 * abs(shares["disc_mass"])
twice = {name: 2 * best[name] for name in ("disc_mass", "stem_mass")}
assert abs(sleeping_limit(**numbers(**best | twice)) / limit - 1) < 1e-12

# %% motion
assert float(start.omega3) > limit

# %% predict
assert abs(rounds.mean() / exact - 1) < 0.01
assert textbook - exact > 3 * rounds.std()

# %% fast
assert known.fast_top_ratio < 10

# %% camera
assert abs(spin_seen / omega3 - 1) < 0.01
assert abs(2 * np.pi / axis_rate / exact - 1) < 0.02
assert wrong < 0
assert abs(wrong + 30 - spot_rate / (2 * np.pi)) < 0.1

# %% backwards
assert abs(weight.mean() - mine["gMR"]) < 2 * np.hypot(weight.std(), many["gMR"].std())

# %% slowing
exactly = ht.State.steady(top, "15 deg", f"{60 * turns} rpm", "slow")
assert abs(float(exactly.phidot) / steady(omega3) - 1) < 1e-12

# %% solution-1
assert higher > 1.4 * limit

# %% solution-2
assert better.gMR == top.gMR
assert 0.6 * limit < slower < 0.8 * limit

# %% solution-3
assert abs(back / rate - 1) < 1e-12
