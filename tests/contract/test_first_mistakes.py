"""What a newcomer does wrong is answered with what is right, in words that need no manual."""

import pytest
from typer.testing import CliRunner

import heavytop as ht
from heavytop.cli import app
from heavytop.errors import BadScene, ImpossibleStart, ImpossibleTop
from heavytop.scene import load_scene, read_scene, shipped_scenes, shipped_text

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


def heavytop_(*words):
    return CliRunner().invoke(app, words)


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


@pytest.mark.parametrize("changes", ["start.phidot=-14", {"start.phidot": -14}, [("a", 1)], [-14]])
def test_changes_are_a_list_of_texts(changes):
    with pytest.raises(BadScene, match=r'a list of texts, such as \["start.phidot=-14"\]'):
        load_scene("sicm-kicked", changes)


@pytest.mark.parametrize("changes", [[], (), ["start.phidot=-14"], ("start.phidot=-14",)])
def test_any_sequence_of_texts_will_do(changes):
    assert load_scene("sicm-kicked", changes).start.phidot == (-14 if changes else -15)


# --- names of scenes -----------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("name", "answer"),
    [
        ("sicm_kicked", 'did you mean "sicm-kicked"?'),
        ("SICM-Kicked.toml", 'did you mean "sicm-kicked"?'),
        ("my-top", 'did you mean "my-top.toml"?'),
        ("zzz", "heavytop scenes lists those that are shipped"),
        ("folder", "folder: scene: a scene is a TOML file, and this is a directory"),
    ],
)
def test_a_name_that_no_scene_has(name, answer, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "my-top.toml").write_text(SCENE, "utf-8")
    (tmp_path / "folder").mkdir()
    result = heavytop_("classify", name)
    assert result.exit_code == 3
    assert answer in result.stderr
    assert result.stderr.count("scene: ") == 1


@pytest.mark.parametrize("name", shipped_scenes())
def test_a_shipped_scene_can_be_taken_over(name, tmp_path):
    """What `heavytop scenes NAME` prints is a file of the same scene."""
    path = tmp_path / "mine.toml"
    path.write_text(heavytop_("scenes", name).stdout, "utf-8")
    assert load_scene(path) == load_scene(name)


def test_a_shipped_scene_for_a_program():
    result = heavytop_("scenes", "sicm-kicked", "--json")
    assert '"schema": "heavytop/scenes/1"' in result.stdout
    assert result.exit_code == 0


@pytest.mark.parametrize("name", ["kicked", "../scene", "my-top.toml", ""])
def test_only_a_shipped_scene_can_be_printed(name):
    result = heavytop_("scenes", name)
    assert result.exit_code == 2
    assert "no shipped scene has this name" in result.stderr
    with pytest.raises(BadScene):
        shipped_text(name)


# --- from Python ---------------------------------------------------------------------------------


@pytest.mark.parametrize("theta", [30, 30.0, "30", "3e1"])
def test_degrees_without_a_unit_are_noticed(theta):
    with pytest.raises(ImpossibleStart, match=r"radians; \S+ degrees are"):
        ht.State(theta=theta)


@pytest.mark.parametrize("theta", [-1, "-30 deg", "200 deg", 181, 3.2])
def test_other_angles_are_only_out_of_range(theta):
    with pytest.raises(ImpossibleStart, match=r"^theta: within \[0, π\] radians$"):
        ht.State(theta=theta)


@pytest.mark.parametrize(
    "make",
    [
        lambda: ht.State.from_constants("sicm-kicked", 1, 1, 1, 1),
        lambda: ht.State.steady(("A", "C"), "pi/3", 140),
    ],
)
def test_a_start_is_made_for_a_top(make):
    with pytest.raises(ImpossibleStart, match="top: a Top"):
        make()


def test_numbers_that_are_none():
    with pytest.raises(ImpossibleTop) as error:
        ht.Top("3,28e-4", "C", None)
    assert [name for name, _ in error.value.broken] == ["A", "C", "gMR"]
    assert "written with a point" in str(error.value)
