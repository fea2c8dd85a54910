"""Turning points over 100 nutation periods: their times, none missed, none doubled."""

import numpy as np
from claim import claim, finish

import heavytop as ht
from heavytop.run.own_motion import own_motion

PERIODS = 100

for name in ("sicm-kicked", "sicm-dropped", "sicm-forward", "lie-group-benchmark"):
    scene = ht.load_scene(name, overrides=[f"span.periods={PERIODS}"])
    run = ht.propagate(scene)
    truth = own_motion(run)
    turning = run.events.is_turning
    t = run.events.t[turning]
    expected = np.arange(2 * PERIODS + 1) * truth.period / 2  # released at a turning point
    claim(f"{name}: turning points missed or doubled", abs(t.size - expected.size), 0)
    n = np.maximum(np.arange(t.size), 1)
    ulps = np.abs(t - expected) / np.spacing(np.maximum(expected, 1.0)) / np.sqrt(n)
    claim(f"{name}: event time error in ulp sqrt(n)", float(ulps.max()), 4)
    if name == "sicm-dropped":
        claim("sicm-dropped: cusps missing or too many", abs(run.events.count("cusp") - 101), 0)
        claim("sicm-dropped: spurious reversals", run.events.count("reversal"), 0)
finish()
