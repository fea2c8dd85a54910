"""What a newcomer does wrong is answered with what is right, in words that need no manual."""

import inspect
import itertools
import operator
import re
import warnings

import pytest
from typer.testing import CliRunner

import heavytop as ht
from heavytop.cli import app
from heavytop.comparison import METHODS
from heavytop.errors import BadScene, ImpossibleStart, ImpossibleTop
from heavytop.run.verify import missed_digits
from heavytop.scene.scene import load_scene, read_scene, shipped_scenes, shipped_text
from heavytop.studies.methods import taylor_methods

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
    with pytest.raises(ImpossibleStart, match=r"^theta: must lie within \[0, π\] radians$"):
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


# what each public function takes in its places, as it should be; a name alone is taken by name
KICKED = load_scene("sicm-kicked")
TOP, START = KICKED.top, KICKED.start
NUMBERS = {"A": 1, "C": 1, "gMR": 1, "theta": 1}
PLACES = {
    "Motion": {"top": TOP, "start": START},
    "Scene": {"top": TOP, "start": START, "time": 2},
    "State": {"theta": 1},
    "Top": {"A": 1, "C": 1, "gMR": 1},
    "atlas": {"scene": KICKED, "x": "phidot=-20:20:5", "y": "psidot=1:2:3"},
    "classify": {"top": TOP, "start": START},
    "classify_many": NUMBERS,
    "check": {"data": {"t": range(5), "theta": [0.1] * 5}, "scene": KICKED},
    "drift": {"scene": KICKED},
    "enclose": {"top": TOP, "start": START},
    "energy_momentum": {"top": TOP, "p_psi": "0.004"},
    "extend": {"trajectory": None, "time_span": 3},
    "facts": {"motion": ht.Motion(TOP, START)},
    "fold": {"scene": KICKED},
    "load_atlas": {"folder": "nowhere"},
    "load_scene": {"name_or_path": "sicm-kicked"},
    "load_trajectory": {"path": "nowhere"},
    "merge_atlases": {"folders": ["nowhere"], "folder": "nowhere"},
    "motions_many": NUMBERS,
    "plan": {"scene": KICKED},
    "propagate": {"scene": KICKED},
    "propagate_many": NUMBERS | {"time": 1},
    "reference": {"scene": KICKED, "times": [1]},
    "resume": {"folder": "nowhere"},
    "run_errors": {"trajectory": None},
    "sensitivities": {"scene": KICKED},
    "state_transition": {"scene": KICKED},
    "stress": {"cases": ["cusp"]},
    "validate": {"names": ["betsch-cone"]},
    "work_precision": {"scene": KICKED},
    "State.from_constants": {"top": TOP, "E": 1, "p_phi": 1, "p_psi": 1, "theta": 1},
    "State.kicked": {"theta": 1, "omega3": 1, "phidot": 1},
    "State.steady": {"top": TOP, "theta": 1, "omega3": 200},
    "Top.from_parts": dict.fromkeys(("mass", "distance", "A_cm", "C_cm", "gravity"), 1),
    "Top.from_solids": {"parts": [], "gravity": 1},
}
NOT_IT = [object(), "of no use", None, 1j, {}]
A_PATH = {"data", "folder", "name_or_path", "path"}  # which a text can be: it names no file


def named(name):
    return operator.attrgetter(name)(ht)


RIGHT = [("stress", "cases", None), ("merge_atlases", "folder", "of no use")]  # all; where to write
WRONG = [
    (name, place, wrong)
    for name, given in PLACES.items()
    for place, wrong in itertools.product(given, NOT_IT)
    if (name, place, wrong) not in RIGHT
]


@pytest.mark.parametrize(("name", "place", "wrong"), WRONG)
def test_what_a_function_does_not_take_is_refused_by_name(name, place, wrong):
    given = PLACES[name] | {place: wrong}
    if name == "extend" and place == "time_span":
        given["trajectory"] = ht.propagate(KICKED)
    with pytest.raises(ht.HeavyTopError) as refusal:
        named(name)(**given)
    told = str(refusal.value)
    assert (wrong if isinstance(wrong, str) and place in A_PATH else place) in told
    assert told.isprintable() or "\n" in told
    assert len(told) < 300


def test_every_public_function_is_among_them():
    """A function that is new is tried as the others are."""
    known = {n for n in ht.__all__ if inspect.isfunction(getattr(ht, n))}
    assert known <= PLACES.keys()
    for name, given in PLACES.items():
        own = inspect.signature(named(name)).parameters
        needed = [n for n, p in own.items() if p.default is p.empty]
        assert set(needed) <= given.keys() <= own.keys()


@pytest.mark.parametrize(
    ("call", "told"),
    [
        (lambda: ht.Motion(START, TOP), "top: a Top, not a State"),
        (lambda: ht.classify(TOP, TOP), "start: a State, not a Top"),
        (lambda: ht.run_errors("x"), 'trajectory: a Trajectory (propagate gives one), not "x"'),
        (lambda: ht.extend(KICKED, 3), "a Trajectory (propagate gives one), not a Scene"),
        (lambda: ht.load_scene(42), "name_or_path: a path, not 42"),
        (lambda: ht.load_scene(b"sicm-kicked"), "name_or_path: a path, not b'sicm-kicked'"),
        (lambda: ht.merge_atlases("out", "all"), 'folders: a list of paths, not "out"'),
        (lambda: ht.merge_atlases([3], "all"), "folders: a path, not 3"),
        (lambda: ht.resume(None), "folder: a path, not None"),
    ],
)
def test_what_is_of_another_type_is_a_type_error(call, told):
    with pytest.raises(TypeError) as error:
        call()
    assert isinstance(error.value, ht.HeavyTopError)
    assert str(error.value).endswith(told)


@pytest.mark.parametrize(
    ("call", "told"),
    [
        (lambda: ht.propagate("sicm-kicked"), 'a Scene (load_scene("sicm-kicked") gives it)'),
        (lambda: ht.propagate("kicked"), "a Scene (load_scene gives one by its name)"),
        (lambda: ht.propagate(KICKED, formulation=[]), "formulation = []: one of auto, cubic"),
        (lambda: ht.propagate(KICKED, formulation="\x1b"), r'formulation = "\x1b": one of auto'),
        (lambda: ht.Scene(TOP, START), "Scene: time: missing: a span is"),
        (lambda: ht.Scene(TOP, START, time=1, name=3), "Scene: name = 3: a text"),
        (lambda: ht.Scene(TOP, START, time="x"), 'Scene: time = "x": unexpected'),
        (lambda: ht.propagate_many(**NUMBERS, time=1, formulation="axes"), 'did you mean "axis"?'),
        (lambda: ht.propagate_many(**NUMBERS, time=1, events="turning"), "a sequence of names"),
        (lambda: ht.propagate_many(**NUMBERS, time=1, events=["tuning"]), "one of turning, rever"),
        (lambda: ht.Motion(TOP, START).at("x"), "t: finite times; texts and exact numbers go with"),
        (lambda: ht.Top(1, [], 1), "C: a number is not a list"),
        (lambda: ht.Top(1, object(), 1), "C: a number is not an object"),
    ],
)
def test_what_is_wrong_is_told(call, told):
    with pytest.raises(ht.HeavyTopError) as error:
        call()
    assert told in str(error.value)


@pytest.mark.parametrize("samples", ["3", 0, -1, 2.5, True])
def test_samples_of_a_continuation_are_counted(samples):
    with pytest.raises(ValueError, match="samples: a whole number from 1 to"):
        ht.extend(ht.propagate(KICKED), 3, samples=samples)


@pytest.mark.parametrize("t", ["x", object(), [[1.0]], None, [1, "a"]])
def test_a_trajectory_is_asked_for_times(t):
    with pytest.raises(ValueError, match="t: a finite time or a one-dimensional array"):
        ht.propagate(KICKED)(t)


# --- the command ---------------------------------------------------------------------------------


def test_what_options_say_wrongly_is_told_behind_a_head():
    result = heavytop_("run", "sicm-kicked", "--set", "top.A=-1")
    told = ["Error: Invalid value: the scene cannot be run so:"]
    assert result.stderr.splitlines()[-2:] == [*told, "--set: top.A = -1: must be greater than 0"]


def test_a_file_of_nearly_this_name_is_named(tmp_path):
    (tmp_path / "my-top.toml").touch()
    for near in ("my-top", "my-top.tml", "mytop.toml"):
        with pytest.raises(BadScene, match=r'did you mean ".*/my-top\.toml"'):
            load_scene(tmp_path / near)
    with pytest.raises(BadScene, match="heavytop scenes lists"):
        load_scene(tmp_path / "other")


@pytest.mark.parametrize(
    ("words", "told"),
    [
        ("sicm-kicked", "No such command 'sicm-kicked'"),
        ("help run now", "No such command 'help'"),
        ("runn sicm-kicked", "Did you mean 'run'?"),
        ("--scene x", "No such option: --scene"),
        ("run --scene sicm-dropped", "No such option: --scene"),
        ("run", "Missing argument 'SCENE'"),
        ("atlas", "Missing argument 'SCENE'"),
        ("run sicm-kicked --set start.phidot 14", "'start.phidot' is not KEY=VALUE, in one word"),
        ("run sicm-kicked --set start.theta = 0.2", "'start.theta' is not KEY=VALUE, in one word"),
        ("run sicm-kicked --set start.theta =0.2", "'start.theta' is not KEY=VALUE, in one word"),
        ("run sicm-kicked --set =0.2", "Invalid value for '--set': '=0.2' is not KEY=VALUE"),
        ("run sicm-kicked --set start.theta= 0.2", "argument(s) (0.2)\n"),
        ("run sicm-kicked --set start.theta=30 deg", "argument(s) (deg)\n"),
        ("run sicm-kicked --set start.theta=1 more", "argument(s) (more)\n"),
        ("run sicm-kicked --phidot 14", "No such option: --phidot"),
        ("run sicm-kicked --verbos", "No such option: --verbos (Possible options: --verbose)"),
        ("run sicm-kicked --zzz", "No such option: --zzz\n"),
        ("resume", "Missing argument 'DIR'.\n"),
        ("zzz", "No such command 'zzz'.\n"),
    ],
)
def test_words_that_do_not_fit_are_answered_with_those_that_do(words, told):
    result = heavytop_(*words.split())
    assert result.exit_code == 2
    assert told in result.stderr
    assert result.stdout == ""


def test_a_word_a_terminal_would_act_on_is_not_shown():
    for words in (("\x1b[2J",), ("run", "\x1b[2J"), ("run", "sicm-kicked", "--set", "\x1b[2J")):
        result = heavytop_(*words)
        assert result.exit_code in (2, 3)
        assert "\x1b" not in result.stderr


@pytest.mark.parametrize("place", ["nowhere", "file", "empty"])
def test_what_cannot_be_resumed(place, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "file").touch()
    (tmp_path / "empty").mkdir()
    result = heavytop_("resume", place)
    assert result.exit_code == 3
    assert f"heavytop: {place}: no folder with anything to go on with: neither" in result.stderr


@pytest.mark.parametrize(
    ("words", "told"),
    [
        ("stress --cases cup", "one of cusp, "),
        ("stress --cases cup", 'in all: heavytop stress --list) (did you mean "cusp"?)'),
        ("stress --methods dop853", 'did you mean "dop853-'),
        ("drift sicm-kicked --methods taylor-axes", 'did you mean "taylor-axis"?'),
        ("drift sicm-kicked --methods aut", 'did you mean "auto"?'),
    ],
)
def test_of_many_names_the_nearest_stand_first_and_few_are_told(words, told):
    result = heavytop_(*words.split())
    assert result.exit_code == 2
    assert told in result.stderr
    assert len(result.stderr.splitlines()[-1]) < 450


def test_a_wrong_method_is_answered_with_all_of_them():
    """Every method of the Taylor integrator is one of the patterns, in one of the formulations."""
    with pytest.raises(BadScene) as error:
        ht.drift(KICKED, methods=["zzz"])
    words = re.split(r"[, ]+", str(error.value))
    forms = words[words.index("of", words.index("FORM")) + 1 :]
    told = {word.replace("FORM", form) for word in words for form in forms}
    assert taylor_methods().keys() | METHODS.keys() | {"auto"} <= told


# --- digits that are missed ----------------------------------------------------------------------


@pytest.mark.parametrize(
    ("formulation", "time", "code"),
    [("axis", 2, 0), ("axis", 10_000, 5), ("auto", 2, 0)],
)
def test_missed_digits_are_told_by_the_command_whoever_chose_the_equations(formulation, time, code):
    """And in Python too."""
    changes = [f"span.time={time}", "want.quantities=['theta', 'phi']", "want.events=[]"]
    words = [word for change in changes for word in ("--set", change)]
    by_command = heavytop_("run", "sicm-kicked", *words, "--formulation", formulation)
    assert by_command.exit_code == code
    with warnings.catch_warnings(record=True) as heard:
        warnings.simplefilter("always")
        found = ht.propagate(load_scene("sicm-kicked", changes), formulation=formulation)
    told = [each for each in heard if issubclass(each.category, ht.MissedDigitsWarning)]
    missed = missed_digits(found, ht.run_errors(found))
    assert bool(missed) == bool(told) == (code == 5)
    assert all(name in by_command.stderr for name in missed)
