"""Every refusal of a scene: where, which key, which rule, and never a traceback."""

import os
import pickle
from pathlib import Path

import pytest

from heavytop.errors import BadScene, Fault
from heavytop.scene.scene import Scene, load_scene, read_scene
from heavytop.scene.state import State
from heavytop.scene.top import Top

GOOD = """\
format = 1
title = "good"

[top]
A = 3.28e-4
C = 6.60e-5
gMR = 0.0456

[start]
theta = 0.1
phidot = -15
psidot = 140

[span]
time = 2

[want]
quantities = ["theta", "phi"]
events = ["turning"]
samples = 401
digits = 12
"""
TOP, START = Top(1, 1, 1), State(0.1)


def faults_of(text: str, *overrides: str) -> tuple[Fault, ...]:
    with pytest.raises(BadScene) as error:
        read_scene(text, "some.toml", overrides)
    return error.value.faults


def load_fault(path: str | Path) -> Fault:
    with pytest.raises(BadScene) as error:
        load_scene(path)
    (fault,) = error.value.faults
    return fault


CONSTANTS = 'E = 3\np_phi = 1\np_psi = 1\ntheta = 1\nbranch = "falling"'
KICK = "theta = 0.1\nphidot = -15\npsidot = 140"


@pytest.mark.parametrize(
    ("old", "new", "line", "key", "rule"),
    [
        # keys
        ("phidot", "phidott", 11, "start.phidott", 'unknown key (did you mean "phidot"?)'),
        ("gMR = 0.0456", "gMR = 0.0456\nphi = 1", 8, "top.phi", "it belongs in [start]"),
        ("title", "titel", 2, "titel", 'did you mean "title"?'),
        ("[want]", "[wants]", 17, "wants", 'did you mean "want"?'),
        ("gMR = 0.0456", "", 4, "top.gMR", "missing"),
        ("format = 1", "", None, "format", "missing"),
        ("[span]\ntime = 2", "", None, "span", "missing"),
        ("[start]\n" + KICK, "", None, "start", "missing"),
        ("format = 1", "format = 2", 1, "format", "the only format"),
        ("format = 1", "format = true", 1, "format", "the only format"),
        # numbers
        ("theta = 0.1", 'theta = "fast"', 10, "start.theta", 'unexpected "fast"'),
        ("theta = 0.1", "theta = true", 10, "start.theta", "not true or false"),
        ("theta = 0.1", "theta = nan", 10, "start.theta", "finite, not nan"),
        ("theta = 0.1", "theta = {a = 1}", 10, "start.theta", "not a dict"),
        ("theta = 0.1", "theta = 2020-01-01", 10, "start.theta", "not a date"),
        ("theta = 0.1", 'theta = "6 rpm"', 10, "start.theta", "a unit here is deg or rad"),
        ("phidot = -15", 'phidot = "6 deg"', 11, "start.phidot", "a unit here is rpm"),
        ("time = 2", 'time = "2 rad"', 15, "span.time", "no unit"),
        # the top
        ("A = 3.28e-4", "A = 0", 5, "top.A", "must be greater than 0"),
        ("C = 6.60e-5", "C = -1", 6, "top.C", "greater than 0"),
        ("C = 6.60e-5", "C = 6.561e-4", 6, "top.C", "must be at most 2A"),
        ("gMR = 0.0456", "gMR = 0.0456\nmass = 1", 8, "top.mass", "does not go with A, C, gMR"),
        (
            "A = 3.28e-4\nC = 6.60e-5\ngMR = 0.0456",
            "mass = 1\ndistance = 1\ngravity = 9.81\nA_cm = 1\nC_cm = 2.5",
            9, "top.C_cm", "at most 2 A_cm",
        ),
        (
            "A = 3.28e-4\nC = 6.60e-5\ngMR = 0.0456",
            "mass = 1\ndistance = 1\nA_cm = 1\nC_cm = 1",
            4, "top.gravity", "missing",
        ),
        # the start
        ("theta = 0.1", "theta = -0.1", 10, "start.theta", "must lie within [0, π]"),
        ("theta = 0.1", "theta = 3.15", 10, "start.theta", "must lie within [0, π]"),
        ("theta = 0.1", 'theta = "pi + 1e-99"', 10, "start.theta", "must lie within [0, π]"),
        ("psidot = 140", "psidot = 140\nomega3 = 1", 13, "start.omega3", "not both"),
        (KICK, CONSTANTS + "\nphidot = 1", 15, "start.phidot", "does not go with E, p_phi, p_psi"),
        (KICK, CONSTANTS.replace("E = 3\n", ""), 9, "start.E", "missing"),
        (KICK, CONSTANTS.replace("falling", "fallin"), 14, "start.branch", '"falling"?'),
        (KICK, CONSTANTS.replace("E = 3", "E = 0"), 10, "start.E", "at least"),
        (KICK, CONSTANTS.replace("theta = 1", "theta = 0"), 10, "start.E", "at least"),
        (KICK, 'steady = "slow"\ntheta = 0.1', 9, "start.omega3", "missing"),
        (KICK, 'steady = "slow"\ntheta = 0.1\nomega3 = 100', 12, "start.omega3", "at least 116.9"),
        (KICK, 'steady = "quick"\ntheta = 0.1\nomega3 = 140', 10, "start.steady", "slow, fast"),
        (KICK, 'steady = "fast"\ntheta = "pi/2"\nomega3 = 140', 10, "start.steady", "no fast rate"),
        (KICK, 'steady = "slow"\ntheta = 0.1\nomega3 = 140\nE = 1', 13, "start.E", "not go with"),
        # the span
        ("time = 2", "time = 0", 15, "span.time", "not 0"),
        ("time = 2", 'time = "sqrt(8) - 2*sqrt(2)"', 15, "span.time", "not 0"),
        ("time = 2", "periods = 0.0", 15, "span.periods", "not 0"),
        ("time = 2", "time = 2\nperiods = 1", 16, "span.periods", "does not go with time"),
        ("time = 2", "", 14, "span.time", "missing"),
        # what is wanted
        ('["theta", "phi"]', '["theta", "fi"]', 18, "want.quantities", "names out of"),
        ('["theta", "phi"]', '["phi", "phi"]', 18, "want.quantities", "at most once"),
        ('["theta", "phi"]', "[]", 18, "want.quantities", "a list of names"),
        ('["theta", "phi"]', '"theta"', 18, "want.quantities", "a list of names"),
        ('["theta", "phi"]', "[[1]]", 18, "want.quantities", "names out of"),
        ('["turning"]', '["turnings"]', 19, "want.events", 'did you mean "turning"?'),
        ("samples = 401", "samples = 1", 20, "want.samples", "from 2 to 10000000"),
        ("samples = 401", "samples = 401.0", 20, "want.samples", "a whole number"),
        ("samples = 401", "samples = true", 20, "want.samples", "a whole number"),
        ("digits = 12", "digits = 0", 21, "want.digits", "from 1 to 10000"),
        ("digits = 12", 'digits = "12"', 21, "want.digits", "a whole number"),
        # texts
        ('"good"', "1.5", 2, "title", "a text in quotes"),
        ('"good"', '"\\u001b[31m"', 2, "title", "control characters"),
        ('"good"', f'"{"x" * 501}"', 2, "title", "at most 500 characters"),
    ],
)  # fmt: skip
def test_one_fault_is_named_with_its_place(
    old: str, new: str, line: int | None, key: str, rule: str
) -> None:
    assert old in GOOD
    faults = [f for f in faults_of(GOOD.replace(old, new, 1)) if f.key == key]
    assert [(f.file, f.line) for f in faults] == [("some.toml", line)]
    assert rule in str(faults[0])
    place = "some.toml" if line is None else f"some.toml:{line}"
    assert str(faults[0]).startswith(f"{place}: {key}")
    assert str(faults[0]).isprintable()


def test_every_fault_is_listed_at_once() -> None:
    text = GOOD.replace("A = 3.28e-4", "A = -1").replace("theta = 0.1", 'theta = "x"')
    text = text.replace("time = 2", "time = 0").replace("digits", "digit")
    faults = faults_of(text.replace("format = 1", "format = 3"), "start.spin=1")
    keys = {"format", "top.A", "start.theta", "start.spin", "span.time", "want.digit"}
    assert {fault.key for fault in faults} == keys


def test_faults_of_one_table_do_not_hide_each_other() -> None:
    text = GOOD.replace("A = 3.28e-4", "A = true").replace("C = 6.60e-5", "C = -1")
    faults = faults_of(text.replace("gMR", "gmr"))
    assert {fault.key for fault in faults} == {"top.A", "top.C", "top.gmr", "top.gMR"}


def test_the_message_has_one_line_a_fault_also_after_pickling() -> None:
    with pytest.raises(BadScene) as error:
        read_scene(GOOD.replace("401", "1").replace("12", "0"), "some.toml")
    again = pickle.loads(pickle.dumps(error.value))
    assert str(again).splitlines() == [str(fault) for fault in error.value.faults]
    assert len(again.faults) == 2


@pytest.mark.parametrize(
    ("change", "key", "rule"),
    [
        ("start.thta=1", "start.thta", 'did you mean "theta"?'),
        ("strat.theta=1", "strat", 'did you mean "start"?'),
        ("start.theta=nan", "start.theta", "finite, not nan"),
        ("start.theta=fast", "start.theta", "unexpected"),
        ("start.theta=", "start.theta", "ends too early"),
        ("start.theta=1\n[evil]\nx=1", "start.theta", "unexpected"),
        ("want.samples=1", "want.samples", "a whole number"),
        ("span.time=0", "span.time", "not 0"),
        ("start=1", "start", "a table"),
        ("theta", "theta", "KEY=VALUE"),
        ("=1", "=1", "KEY=VALUE"),
        ("a.b.c=1", "a.b.c=1", "KEY=VALUE"),
        ("title.x=1", "title.x=1", "KEY=VALUE"),
    ],
)
def test_a_bad_change_is_refused(change: str, key: str, rule: str) -> None:
    (fault,) = faults_of(GOOD, change)
    assert fault.key == key
    assert rule in str(fault)
    assert change.startswith("strat") or fault.file == "--set"


def test_what_a_change_makes_wrong_elsewhere_is_the_changes_fault() -> None:
    (fault,) = faults_of(GOOD, "top.A=1e-5")
    assert (fault.file, fault.line, fault.key) == ("--set", None, "top.C")
    unsound = GOOD.replace("time = 2", "time = 0")
    places = [(fault.file, fault.line, fault.key) for fault in faults_of(unsound, "top.A=1e-5")]
    assert places == [("some.toml", 6, "top.C"), ("some.toml", 15, "span.time")]


def test_a_change_of_what_a_kick_holds_displaces_the_other() -> None:
    assert read_scene(GOOD, overrides=["start.omega3=1"]).start.held == "omega3"
    held = read_scene(GOOD, overrides=["start.omega3=1", "start.psidot=2"]).start
    assert (held.held, float(held.psidot)) == ("psidot", 2)


@pytest.mark.parametrize(
    ("text", "line", "rule"),
    [
        ("format = 1\n[top\n", 2, "not TOML"),
        ("format = = 1", 1, "not TOML"),
        ("a = 1\na = 2", None, "not TOML"),
        ("a = " + "9" * 5000, None, "not TOML"),
        ("a = " + "[" * 5000, None, "nested too deeply"),
        ("a" + ".a" * 5000 + " = 1\n" + "[" * 3, None, "not TOML"),
        ("#" * 1_000_001, None, "at most 1000000 bytes"),
    ],
)
def test_text_that_is_no_toml_is_refused(text: str, line: int | None, rule: str) -> None:
    (fault,) = faults_of(text)
    assert rule in fault.rule
    assert line is None or fault.line == line


def test_deeply_nested_keys_are_unknown_keys() -> None:
    (fault,) = faults_of(GOOD + "x" + ".x" * 2000 + " = 1")
    assert (fault.key, fault.value) == ("want.x", "a table")


def test_an_unknown_scene_has_its_nearest_name() -> None:
    fault = load_fault("sicm-kiked")
    assert (fault.file, fault.hint) == ("sicm-kiked", 'did you mean "sicm-kicked"?')


@pytest.mark.parametrize(
    "name", ["no/such/scene.toml", "a\0b", "x" * 5000, "", "\x1b[31m", "\ud800"]
)
def test_names_no_file_has_are_refused(name: str) -> None:
    assert str(load_fault(name)).isprintable()


def test_files_that_are_no_scene_are_refused_without_being_read(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    huge, latin, closed = (tmp_path / name for name in ("huge.toml", "latin.toml", "closed.toml"))
    with huge.open("wb") as file:
        file.truncate(10**8)
    latin.write_bytes(b'format = 1\ntitle = "\xe9"\n')
    closed.touch(mode=0)
    for path, rule in (
        (tmp_path, "a directory"), (tmp_path / "pipe", "not a regular file"),
        ("/dev/zero", "not a regular file"), (huge, "at most 1000000 bytes"), (latin, "UTF-8"),
    ):  # fmt: skip
        assert rule in load_fault(path).rule
    assert load_fault(latin).line == 2
    if os.geteuid():  # root may read everything
        assert "ermission" in load_fault(closed).rule


@pytest.mark.parametrize(
    ("values", "key"),
    [
        ({}, "time"),
        ({"time": 1, "periods": 1}, "periods"),
        ({"time": 0}, "time"),
        ({"time": float("nan")}, "time"),
        ({"time": True}, "time"),
        ({"time": 1, "quantities": ("thta",)}, "quantities"),
        ({"time": 1, "events": "turning"}, "events"),
        ({"time": 1, "samples": 1}, "samples"),
        ({"time": 1, "digits": 2.0}, "digits"),
        ({"time": 1, "title": "a\nb"}, "title"),
        ({"time": 1, "start": 0.1}, "start"),
        ({"time": 1, "top": None}, "top"),
    ],
)
def test_a_scene_built_in_python_obeys_the_same_rules(values: dict[str, object], key: str) -> None:
    with pytest.raises(BadScene) as error:
        Scene(**({"top": TOP, "start": START} | values))
    assert [(fault.file, fault.key) for fault in error.value.faults] == [("Scene", key)]
