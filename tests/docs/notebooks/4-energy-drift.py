# Run after the cells of the notebook that have these names.

# %% cell-08
assert abs(methods["RK4"].energy_exponent - 1) < 0.15
assert abs(methods["DOP853"].energy_exponent - 1) < 0.05
strang = errors("Strang", "energy")[1]
assert strang.max() < 1.1 * strang[0]
assert max(last["midpoint"], last["Taylor"]) < 1e-10 * min(last["RK4"], last["Strang"])

# %% cell-12
assert errors("midpoint", "phase_s")[0][-1] < 100
assert errors("Taylor", "phase_s")[1][-1] < 1e-10
for name in ("Strang", "midpoint"):
    assert abs(methods[name].phase_exponent - 1) < 0.2

# %% cell-14
assert np.max(np.abs(fit / phase - 1)) < 0.5
assert alpha / beta < 300

# %% cell-16
for sums, expected in ((walk, 0.5), (travel, 1.5)):
    size = np.sqrt(np.mean(sums**2, axis=0))
    assert abs(np.polyfit(np.log(n[63:]), np.log(size[63:]), 1)[0] - expected) < 0.05

# %% cell-18
for name, expected in {"RK4": (2**5, 2**4), "Strang": (2**2, 2**2)}.items():
    assert np.allclose(fall(pairs[name]), expected, rtol=0.15)

# %% cell-20
assert 12 < methods["Taylor"].steps / 1000 < 14
assert methods["DOP853"].steps < methods["Taylor"].steps

# %% cell-22
assert left < 1.1e-6

# %% cell-24
assert np.allclose((energy, phase), (8, 4), rtol=0.15)

# %% cell-26
assert abs(taylor.energy_exponent - 0.5) < 0.2
assert abs(taylor.phase_exponent - 1.5) < 0.2
