"""What a run is expected to cost and how far off it is to end, against motions and runs."""

from dataclasses import replace
from itertools import pairwise

import pytest

import heavytop as ht
from heavytop.run.estimates import Forecast
from heavytop.run.span import span
from heavytop.text import duration


@pytest.mark.parametrize("projected", [False, True])
def test_more_periods_lose_more_also_where_their_number_is_round(projected):
    """At every end, and 65 evenly spread times before it, theta would stand still."""
    scenes = [ht.load_scene("sicm-kicked", [f"span.periods=1e{n}"]) for n in range(4, 16)]
    errors = [
        Forecast(s, ht.Motion(s.top, s.start), span(s, ht.Motion(s.top, s.start))).error(projected)
        for s in scenes
    ]
    assert all(2 < later / sooner < 40 for sooner, later in pairwise(errors))
    assert 1e-12 < errors[0] < 1e-8


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
