"""The document of ``classify``: enclosed, decided, and finite, however odd the numbers are."""

import json
import math
from decimal import Decimal

import numpy as np
import pytest

import heavytop as ht
from heavytop.results.classification import classified
from heavytop.scene.scene_file import shipped_scenes

from .. import commands

THRESHOLD = "2*sqrt(3.28e-4*0.0456)/6.60e-5"


def document(scene, *changes):
    """The document as JSON has it."""
    found = classified(ht.load_scene(scene, changes)).document()
    return json.loads(json.dumps(found, allow_nan=False))


@pytest.mark.parametrize("scene", ["sicm-kicked", "sleeping"])
def test_a_run_says_the_same(scene):
    ran, known = (commands.document(verb, scene) for verb in ("run", "classify"))
    assert known.pop("command") == f"heavytop classify {scene} --json"
    assert ran["motion"] == {name: known["motion"][name] for name in ran["motion"]}
    assert (ran["scene"], ran["constants"]) == (known["scene"], known["constants"])


SOLIDS = """
format = 1
[top]
gravity = 10
solids = [{shape = "sphere", radius = "1 cm", mass = "100 g", centre = "5 cm"}]
[start]
theta = 0.3
psidot = 200
[span]
time = 0.1
"""


@pytest.mark.parametrize("verb", ["run", "classify"])
def test_what_parts_make_of_a_top_is_printed_and_in_the_document(verb, tmp_path):
    (tmp_path / "ball.toml").write_text(SOLIDS, "utf-8")
    numbers = {"A": 2.54e-4, "C": 4e-6, "gMR": 0.05, "mass": 0.1, "distance": 0.05}
    assert commands.document(verb, tmp_path / "ball.toml")["top"] == pytest.approx(numbers)
    said = commands.printed(verb, tmp_path / "ball.toml").split("\n")
    rows = {line.split("  ")[0]: line.split("  ")[-1].strip() for line in said}
    printed = {"A": "0.000254 kg m²", "C": "4e-06 kg m²", "gMR": "0.05 J", "M": "0.1 kg"}
    assert {**printed, "R": "0.05 m"}.items() <= rows.items()
    assert commands.document(verb, "sicm-kicked")["top"] == {}


@pytest.mark.parametrize("scene", shipped_scenes())
def test_every_number_lies_in_its_enclosure(scene):
    found = document(scene)
    for name in ("theta_min", "theta_max", "period", "precession", "spin"):
        bounds, value = found["enclosure"][name], found["motion"][name]
        assert (bounds is None) == (value is None), name
        if bounds is not None:
            low, high = map(float, bounds)
            assert low - abs(low) * 1e-15 <= value <= high + abs(high) * 1e-15, name


def test_a_number_that_cannot_be_proved_zero_is_undecided_with_its_bound():
    motion = document("sicm-kicked", "start.phidot=sqrt(cos(2)^2) + cos(2)")["motion"]
    assert (motion["kind"], motion["certified"]) == ("undecided", False)
    assert 0 < Decimal(motion["bound"]) < Decimal("1e-1000")


ON_TOP = ("start.theta=0", f"start.omega3={THRESHOLD}")
EXTREME = [
    ("top.gMR=0", "start.theta=0", "start.thetadot=3"),
    ("start.theta=pi", "start.phidot=1e300"),
    ("top.A=1e-300", "top.C=1e-300", "top.gMR=1e300"),
    ("start.phi=1e300", "start.psi=-1e300"),
    ON_TOP,
    (*ON_TOP, "start.thetadot=1e-50"),
    ("want.digits=5000",),
]


@pytest.mark.parametrize("changes", EXTREME, ids=str)
def test_a_number_that_is_possible_is_classified_however_odd(changes):
    motion = document("sicm-kicked", *changes)["motion"]
    assert (motion["certified"], motion["kind"] == "undecided") == (True, False)


ROUNDLESS = {"at-rest", "sleeping", "hanging", "planar-pendulum", "through-top", "through-bottom"}


@pytest.mark.parametrize("scene", shipped_scenes())
def test_a_round_and_the_amplitude_are_those_of_the_angles(scene):
    """Once round is 2π over what φ gains in one second on average, where it has a mean, not 0."""
    found, given = document(scene)["motion"], ht.load_scene(scene)
    nods = found["period"] is not None
    tends = found["kind"] == "separatrix" or "asymptotic" in found["tags"]
    assert (found["amplitude"] is not None) == nods
    if nods:
        swing = found["theta_max"] - found["theta_min"]
        assert found["amplitude"] == pytest.approx(swing, abs=1e-14)
    if found["kind"] in ROUNDLESS or tends:
        assert found["round"] is None
        return
    span = 100 * (found["period"] or 1.0)
    turned = np.diff(ht.Motion(given.top, given.start).at([0.0, span]).phi)[0]
    rate = 2 * math.pi / found["round"] if found["round"] else 0.0
    assert rate == pytest.approx(abs(turned) / span, abs=1e-12)
