"""What a run is expected to cost and how far off it is to end, against motions and runs."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

import heavytop as ht
from heavytop.run.estimates import Forecast
from heavytop.text import duration

from .test_planning import drawn, round_periods


@pytest.mark.parametrize("quantities", [("theta",), ("axis",), ("rates",), ("theta", "phi", "psi")])
@pytest.mark.parametrize("projected", [False, True])
def test_more_periods_lose_more_also_where_their_number_is_round(quantities, projected):
    """At every end, and 65 evenly spread times before it, theta would stand still."""
    scenes = (replace(round_periods(f"1e{n}"), quantities=quantities) for n in range(3, 16))
    errors = [ht.plan(s, "axis", projected=projected).estimate.error for s in scenes]
    assert all(2 < later / sooner < 40 for sooner, later in pairwise(errors))
    assert 1e-13 < errors[0] < 1e-10


@pytest.mark.parametrize("seed", range(1, 16))
def test_rates_by_the_height_are_those_by_the_time(seed):
    """By energy and momenta at a height, against the closed form in doubles at many times."""
    scene = drawn(seed)
    motion = ht.Motion(scene.top, scene.start)
    end, times = 100.37 * motion.period, np.linspace(0, motion.period, 4001)
    seen, turned = motion.at(times), motion.at([end])
    across = np.hypot(seen.thetadot, seen.phidot * np.sin(seen.theta))
    every = np.array([seen.thetadot, seen.phidot, seen.psidot])
    changes = abs(np.gradient(every, times, axis=1)).max() / max(1, abs(every).max())
    rates = {"theta": seen.thetadot, "axis": across, "phi": seen.phidot, "psi": seen.psidot}
    for name, rate in (rates | {"rates": changes}).items():
        close = min(motion.from_top, motion.from_bottom) < (0.2 if name == "rates" else 0.05)
        if name in ("phi", "psi", "rates") and close:
            continue  # a close pass is over before anybody looks
        far = max(1, abs(getattr(turned, name)[0])) if name in ("phi", "psi") else 1
        found = Forecast(replace(scene, quantities=(name,)), motion, end).quickest
        assert found == pytest.approx(np.max(abs(rate)) / far, rel=0.02)


def test_bits_follow_from_digits_and_span():
    scene = ht.load_scene("sicm-kicked", ["want.samples=7"])
    wanted = {13: "double", 14: "64 bits", 30: "128 bits", 60: "256 bits", 1000: "3392 bits"}
    assert {d: ht.plan(replace(scene, digits=d)).precision for d in wanted} == wanted
    assert ht.plan(replace(scene, digits=60)).tolerance == 2.0**-255
    scene = replace(scene, digits=70)
    motion = ht.Motion(scene.top, scene.start)
    far, near = (Forecast(scene, motion, end).bits("axis") for end in (1e6, 1.0))
    assert far > near


def test_a_time_is_told_in_its_unit():
    told = [duration(x) for x in (3.17, 90, 24_400, 3e5, 1e12)]
    assert told == ["3.17 s", "1.5 min", "6.78 h", "3.47 days", "3.17e+04 years"]
