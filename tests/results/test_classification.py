"""The document of ``classify``: enclosed, decided, and finite, however odd the numbers are."""

import json
from decimal import Decimal

import numpy as np
import pytest

import heavytop as ht
from heavytop.results.classification import classify_scene, motion_summary

from .. import commands
from ..motions import SCENES, shipped


def document(scene, *changes):
    """The document as JSON has it."""
    found = classify_scene(ht.load_scene(scene, changes)).document()
    return json.loads(json.dumps(found, allow_nan=False))


BALL = '{shape = "sphere", radius = "1 cm", mass = "100 g", centre = "5 cm"}'


@pytest.mark.parametrize("verb", ["run", "classify"])
def test_what_parts_make_of_a_top_is_printed_and_in_the_document(verb):
    words = (verb, "sicm-kicked", "--set", f"top={{gravity = 10, solids = [{BALL}]}}")
    numbers = {"A": 2.54e-4, "C": 4e-6, "gMR": 0.05, "mass": 0.1, "distance": 0.05}
    assert commands.document(*words)["top"] == pytest.approx(numbers)
    said = commands.printed(*words).split("\n")
    rows = {line.split("  ")[0]: line.split("  ")[-1].strip() for line in said}
    printed = {"A": "0.000254 kg m²", "C": "4e-06 kg m²", "gMR": "0.05 J", "M": "0.1 kg"}
    assert {**printed, "R": "0.05 m"}.items() <= rows.items()
    assert commands.document(verb, "sicm-kicked")["top"] == {}


@pytest.mark.parametrize("scene", SCENES)
def test_the_kind_is_printed_and_every_number_lies_in_its_enclosure(scene):
    found, said = document(scene), commands.printed("classify", scene)
    assert f"{found['motion']['kind']}, proved" in said
    assert not any(word in said for word in ("nan", "None"))
    for name in ("theta_min", "theta_max", "period", "precession", "spin"):
        bounds, value = found["enclosure"][name], found["motion"][name]
        assert (bounds is None) == (value is None), name
        if bounds is not None:
            low, high = map(float, bounds)
            assert low - abs(low) * 1e-15 <= value <= high + abs(high) * 1e-15, name


OPEN = "start.phidot=sqrt(cos(2)^2) + cos(2)"  # cannot be proved to be zero


@pytest.mark.parametrize("changes", [
    (OPEN,),
    ("top.gMR=0", "start.theta=0", "start.thetadot=3"),
    ("start.theta=pi", "start.phidot=1e300"),
    ("top.A=1e-300", "top.C=1e-300", "top.gMR=1e300"),
    ("start.phi=1e300", "start.psi=-1e300"),
    ("want.digits=5000",),
], ids=str)  # fmt: skip
def test_a_number_that_is_possible_is_classified_however_odd(changes):
    motion = document("sicm-kicked", *changes)["motion"]
    is_open = OPEN in changes
    assert (motion["certified"], motion["kind"] == "undecided") == (not is_open, is_open)
    assert not is_open or 0 < Decimal(motion["bound"]) < Decimal("1e-1000")


ROUNDLESS = {"at-rest", "sleeping", "hanging", "planar-pendulum", "through-top", "through-bottom"}


@pytest.mark.parametrize("scene", SCENES)
def test_a_round_and_the_amplitude_are_those_of_the_angles(scene):
    """Once round is 2π over what φ gains in one second on average, where it has a mean, not 0."""
    motion = shipped(scene)
    found = motion_summary(motion)
    swing = motion.period and pytest.approx(motion.theta_max - motion.theta_min, abs=1e-14)
    assert (found["amplitude"], found["round"]) == (swing, motion.round)
    span = 100 * (motion.period or 1.0)
    turned = np.diff(motion.at([0.0, span]).phi)[0]
    rate = 0.0 if motion.kind in ROUNDLESS or motion.regime.asymptotic else abs(turned) / span
    assert 2 * np.pi / (found["round"] or np.inf) == pytest.approx(rate, abs=1e-12)
