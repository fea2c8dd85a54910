"""Studies of many runs: drift, atlas, work and precision, stress."""
