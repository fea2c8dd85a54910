"""What a scene holds: read exactly, written back, changed, and built in Python."""

import math
import tomllib
from dataclasses import replace
from fractions import Fraction

import pytest
from hypothesis import given
from hypothesis import strategies as st

from heavytop import State, Top
from heavytop.exact import PI, Exact, cos, sqrt, tan
from heavytop.scene.scene import Scene, load_scene, read_scene

from ..motions import BOOK, LIE, SCENES

START = State("0.1", phidot=-15, psidot=140)
CONSTANTS = """\
format = 1
top = {A = 1, C = 1, gMR = 1}
start = {E = 3, p_phi = 1, p_psi = 1, theta = "pi/2", branch = "rising", phi = "90 deg"}
span.periods = -1.5
"""


@pytest.mark.parametrize("name", SCENES)
def test_a_shipped_scene_survives_being_written(name):
    scene = load_scene(name)
    assert (scene.name, bool(scene.title), bool(scene.source)) == (name, True, True)
    assert read_scene(scene.to_toml()) == scene


def test_decimals_are_read_as_decimals_and_not_as_doubles(tmp_path):
    path = tmp_path / "mine.toml"
    path.write_text(load_scene("sicm-kicked").to_toml(), "utf-8")
    scene = load_scene(path)
    assert Fraction(328, 10**6) == scene.top.A
    assert (scene.name, scene) == ("mine", load_scene(str(path)))


def test_a_scene_from_constants_of_the_motion_from_parts_or_of_a_steady_precession():
    scene = read_scene(CONSTANTS)
    assert (scene.start.thetadot, scene.start.phidot, scene.start.phi) == (-2, 1, PI / 2)
    assert (scene.periods, scene.time) == (Fraction(-3, 2), None)
    parts = "mass = 15, distance = 1, gravity = 9.81, A_cm = 0.234375, C_cm = 0.46875"
    built = read_scene(CONSTANTS.replace("A = 1, C = 1, gMR = 1", parts))
    assert built.top == LIE
    text = load_scene("sicm-forward").to_toml().replace("phidot = 15", 'steady = "slow"')
    steady = read_scene(text.replace("thetadot = 0\n", ""))
    assert float(steady.start.phidot) == pytest.approx(6.3668390938832, rel=1e-13)
    for each in (scene, built, steady):
        assert read_scene(each.to_toml()) == each


def test_a_balanced_top_keeps_its_weight():
    top = Top.from_parts(mass=2, distance=0, A_cm=1, C_cm=1, gravity=10)
    again = read_scene(Scene(top, State(1), time=1, quantities=("reaction",)).to_toml()).top
    assert again == top
    assert [*again.reaction([0, 0, 1], [0, 0, 3])] == [0, 0, 20]


def test_changes_displace_their_rivals_and_are_told_by_title_and_source():
    kicked = load_scene("sicm-kicked")
    changes = ["start.psidot=6", "start.omega3=5", "start.theta=30 deg", "span.periods = 3"]
    scene = load_scene("sicm-kicked", [*changes, 'want.events=["cusp"]'])
    assert (scene.start.held, scene.start.theta, scene.events) == ("omega3", PI / 6, ("cusp",))
    assert (scene.time, scene.periods) == (None, 3)
    assert scene.title == f"{kicked.title}; with start.omega3 = 5, start.theta = 30 deg"
    longer = load_scene("sicm-kicked", ["span.time=3", "want.digits=13"])
    assert (longer.title, longer.source, longer.digits) == (kicked.title, kicked.source, 13)
    named = load_scene("sicm-kicked", ["top.gMR=1", "title=mine = {}", "source=me"])
    assert (named.title, named.source) == ("mine = {}", "me")


@given(
    A=st.floats(1e-9, 1e9),
    gMR=st.floats(-1e9, 1e9, allow_subnormal=False).filter(lambda x: x == 0 or abs(x) > 1e-99),
    theta=st.floats(0, math.pi).filter(lambda x: x == 0 or x > 1e-99),
    title=st.text(st.characters(exclude_categories=["C", "Z"]), max_size=50),
)
def test_a_scene_built_from_floats_survives_being_written(A, gMR, theta, title):
    scene = Scene(Top(A, A, gMR), State(theta, omega3=0.1), periods=1 / 3, title=title)
    assert scene.start.theta == theta
    again = read_scene(scene.to_toml())
    assert again == scene
    assert again.to_toml() == scene.to_toml()


@pytest.mark.parametrize("start", [
    State(PI / 7, phidot=2 / sqrt(3), psidot="1337 rpm"), State(theta=1, phidot="1 +\n 1"),
    State("acos(3/4)", phidot=cos(0.3) - PI, psidot=tan(2) / 7),
])  # fmt: skip
def test_irrational_numbers_and_quotes_survive_being_written(start):
    title = 'a "b" \\n c # [top]'
    scene = Scene(Top(1, "1/3", sqrt(2)), start, time=PI, events=(), title=title, source="θ – φ")
    assert tomllib.loads(scene.to_toml())["title"] == scene.title
    assert read_scene(scene.to_toml()) == scene


def test_the_document_has_numbers_where_they_are_exact():
    scene = Scene(Top("3.28e-4", "6.60e-5", "1/3"), State("pi/3", psidot=0.1), time=2, name="x")
    document = scene.document()
    assert document["top"] == {"A": 3.28e-4, "C": 6.6e-5, "gMR": "1/3"}
    assert document["start"]["theta"] == "pi/3"
    assert Exact.of(document["start"]["psidot"]) == 0.1  # the binary value, all 55 digits
    assert (document["span"], document["name"]) == ({"time": 2}, "x")
    assert document["want"]["quantities"] == ["theta", "phi"]


def test_a_scene_is_a_value():
    scene = Scene(BOOK, START, time=2)
    assert hash(scene) == hash(Scene(BOOK, START, time=2.0, name="other"))
    assert replace(scene, time=None, periods=Exact.of(3)).periods == 3
    with pytest.raises(AttributeError):
        scene.time = Exact.of(3)
