"""What a run is expected to take, against what a scene asks."""

from dataclasses import replace

import heavytop as ht
from heavytop.run.estimates import Forecast


def test_bits_follow_from_digits_and_span():
    scene = ht.load_scene("sicm-kicked", ["want.samples=7"])
    wanted = {13: "double", 14: "64 bits", 30: "128 bits", 60: "256 bits", 1000: "3392 bits"}
    assert {d: ht.plan(replace(scene, digits=d)).precision for d in wanted} == wanted
    assert ht.plan(replace(scene, digits=60)).tolerance == 2.0**-255
    scene = replace(scene, digits=70)
    motion = ht.Motion(scene.top, scene.start)
    far, near = (Forecast(scene, motion, end).bits("axis") for end in (1e6, 1.0))
    assert far > near
