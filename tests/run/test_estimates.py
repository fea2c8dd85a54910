"""The bits that a run is expected to need, and how times are told."""

from dataclasses import replace

import heavytop as ht
from heavytop.run.estimates import Forecast
from heavytop.text import duration


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
