"""What a newcomer does wrong is answered with what is right, in words that need no manual."""

import time

import numpy as np
import pytest

from heavytop.errors import BadScene
from heavytop.scene.scene import Scene, load_scene, read_scene
from heavytop.scene.state import State

from ..motions import BOOK

SCENE = """\
format = 1

[top]
A = 3.28e-4
C = 6.60e-5
gMR = 0.0456

[start]
theta = 0.1    # rad
phidot = -15
psidot = 140

[span]
time = 2

[want]
quantities = ["theta", "phi"]
"""


def answers(text, overrides=()):
    with pytest.raises(BadScene) as error:
        read_scene(text, "top.toml", overrides)
    return str(error.value).splitlines()


MISTAKES = {  # what is written instead of what, and how each answer begins and ends
    "degrees": ("0.1 ", "30", "top.toml:9: start.theta = 30: ", '30 degrees are "30 deg"'),
    "no quotes": ("0.1 ", "30 deg ", "top.toml:9: start.theta = 30 deg: ", '"30 deg")'),
    "an expression": ("0.1 ", "pi/3 ", "top.toml:9: start.theta = pi/3: ", 'quotes: "pi/3")'),
    "comma": ("0.1 ", "0,1 ", "top.toml:9: start.theta = 0,1: ", "has a point: 0.1)"),
    "comma, quoted": ("0.1 ", '"0,1"', "top.toml:9: start.theta", "is written with a point"),
    "end of line": ("-15", "-15,", "top.toml:10: start.phidot = -15,: ", "no comma ends a line)"),
    "open quote": ('"phi"]', '"phi]', "top.toml:17: want.quantities", "a quote is not closed)"),
    "twice": ("-15", "-15\nphidot = 1", "top.toml:11: ", "a key or a table stands twice)"),
    "Hz": ("140", '"22 Hz"', 'top.toml:11: start.psidot = "22 Hz"', "a unit: rpm, deg/s, rad/s"),
    "degree": ("0.1 ", '"30 degrees"', "top.toml:9: start.theta", "and a unit: deg, rad"),
    "seconds": ("= 2", '= "2 s"', 'top.toml:14: span.time = "2 s"', "no unit here"),
    "short name": ("time", "t", "top.toml:14: span.t = 2: ", "(known are time, periods)"),
    "no table": ("[start]\n", "", "top.toml: start: ", "a scene has a table [start]"),
    "no format": ("format = 1", "", "top.toml: format: ", "begins with format = 1"),
    "1e3": ("[want]", "[want]\nsamples = 1e3", "top.toml:17: want.samples", "in digits alone"),
    "a rate": (
        '"theta",',
        '"phidot",',
        "top.toml:17: want.quant",
        "holds thetadot, phidot and psidot)",
    ),
    "no list": ('["theta", "phi"]', '"phi"', "top.toml:17: want.quant", 'such as ["class"]'),
}


@pytest.mark.parametrize("mistake", MISTAKES)
def test_a_mistake_in_a_file_is_answered(mistake):
    old, new, begin, end = MISTAKES[mistake]
    assert old in SCENE
    answer = answers(SCENE.replace(old, new, 1))[0]
    assert answer.startswith(begin)
    assert answer.endswith(end)
    assert answer.isprintable()


@pytest.mark.parametrize(
    ("value", "hint"),
    [("nonsense = = 1", ""), ("phidot = \x1b", "not TOML"), ("phidot = y" + "z" * 300, "zzz…")],
)
def test_a_line_is_shown_short_and_harmless(value, hint):
    [answer] = answers(SCENE.replace("phidot = -15", value))
    assert hint in answer
    assert answer.isprintable()
    assert len(answer) < 300


def test_a_scene_that_is_right_has_no_answer():
    assert read_scene(SCENE).samples == 401


def test_faults_stand_in_the_order_of_their_lines():
    text = SCENE.replace("A = 3.28e-4", "A = 0").replace("= 140", '= "fast"')
    text = text.replace("theta = 0.1", "thtea = 0.1").replace("time = 2", "time = 0")
    assert [int(answer.split(":")[1]) for answer in answers(text)] == [4, 9, 11, 14]


NO_LISTS = ["start.phidot=-14", {"start.phidot": -14}, [("a", 1)], [-14], np.array([0.5]), None]


@pytest.mark.parametrize("changes", NO_LISTS, ids=repr)
def test_changes_are_a_list_of_texts(changes):
    with pytest.raises(BadScene, match=r'a list of texts, such as \["start.phidot=-14"\]') as error:
        load_scene("sicm-kicked", changes)
    assert str(error.value).startswith("heavytop: overrides = ")  # and no option's name


@pytest.mark.parametrize("changes", [[], (), ["start.phidot=-14"], ("start.phidot=-14",)])
def test_any_sequence_of_texts_will_do(changes):
    assert load_scene("sicm-kicked", changes).start.phidot == (-14 if changes else -15)


def test_a_file_of_nearly_this_name_is_named(tmp_path):
    (tmp_path / "my-top.toml").touch()
    for near in ("my-top", "my-top.tml", "mytop.toml"):
        with pytest.raises(BadScene, match=r'did you mean ".*/my-top\.toml"'):
            load_scene(tmp_path / near)
    with pytest.raises(BadScene, match="heavytop scenes lists"):
        load_scene(tmp_path / "other")


def test_a_key_of_many_parts_is_refused_at_once():
    began = time.process_time()
    with pytest.raises(BadScene):
        read_scene("[" + ".".join(["a"] * 400_000) + "]")
    assert time.process_time() - began < 5


def test_a_number_over_two_lines_can_be_written_and_read():
    scene = Scene(BOOK, State(theta=1, phidot="1 +\n 1"), time=1)
    assert read_scene(scene.to_toml()) == scene
