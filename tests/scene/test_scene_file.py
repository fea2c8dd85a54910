"""Every refusal of a scene: where, which key, which rule, and never a traceback."""

import re

import pytest

from heavytop import BadScene, ImpossibleStart, load_scene
from heavytop.scene.scene import read_scene

GOOD = load_scene("sicm-kicked").to_toml()
TITLE = '"SICM 2.10, kicked backwards: loops"'


def faults(call, *given, **named):
    """All that is wrong with what is refused."""
    with pytest.raises((BadScene, ImpossibleStart)) as refusal:
        call(*given, **named)
    return refusal.value.faults


BOOK = "A = 3.28e-4\nC = 6.60e-5\ngMR = 0.0456"


@pytest.mark.parametrize(("old", "new", "line", "key", "rule"), [
    ("phidot", "phidott", 14, "start.phidott", 'unknown key (did you mean "phidot"?)'),
    ("gMR = 0.0456", "gMR = 0.0456\nphi = 1", 9, "top.phi", "it belongs in [start]: start.phi"),
    ("gMR", "I3", 8, "top.I3", "unknown key (did you mean C, about the axis?)"),
    ("time = 2", 'time = "2 rad"', 19, "span.time", "a unit here is s or ms"),
    ("gMR = 0.0456", "gMR = 0.0456\nmass = 1", 5, "top.distance", "missing for a top of A, C"),
    (BOOK, "", 5, "top.A", "missing for a top of A, C, gMR: A, C, gMR"),
    (BOOK, "mass = 1\ndistance = 1\nA_cm = 1\nC_cm = 1", 5, "top.gravity", "missing"),
    (BOOK, 'gravity = 9\nsolids = [{shape = "disq"}, {shape = "cone", h = 1}]', 7, "top.solids",
     "of solid 2 h = 1: unknown key (known are radius, apex, base, density, mass); of solid 2 rad"),
    ("time = 2", "time = 2\nperiods = 1", 20, "span.periods", "give time or periods"),
    (', "psi"]', ', "fi"]', 22, "want.quantities", 'a list such as ["theta"]'),
    (', "psi"]', ', "phi"]', 22, "want.quantities", "at most once"),
    (', "cusp"]', ', "cups"]', 23, "want.events", 'did you mean "cusp"?'),
    ("samples = 401", "samples = 1", 24, "want.samples", "from 2 to 10000000"),
    (TITLE, "1.5", 2, "title", "a text in quotes"), ("gMR", "radius", 8, "top.radius", "solids"),
    (TITLE, '"\\u001b[31m"', 2, "title", "control characters"),
    (TITLE, f'"{"x" * 501}"', 2, "title", "at most 500 characters"),
    ("theta = 0.1", "theta = 30 deg", 11, "start.theta", '"30 deg"'),
    ("-15", f"y{'z' * 300}", 14, "start.phidot", "zzz…"),
    ("-15", "-15\nphidot = 1", 15, "start.phidot", "Cannot overwrite a value"),
    ("time", "t", 19, "span.t", "(known are time, periods)"),
    ("[start]\n", "", None, "start", "a scene has a table [start]"),
    ("format = 1", "", None, "format", "begins with format = 1"),
    ('"psi"]', '"psi]', 22, "want.quantities", "stand in quotes"),
    ("phidot", "steady = false\nphidot", 14, "start.steady", "true, or one of slow, fast"),
    ("-15", "{a = 1}", 14, "start.phidot", "a number is not a table"),
    ("-15", "1" * 5000, None, "scene", "an integer has more than 4300 digits"),
])  # fmt: skip
def test_one_fault_is_named_with_its_place(old, new, line, key, rule):
    found = [f for f in faults(read_scene, GOOD.replace(old, new, 1), "some.toml") if f.key == key]
    assert [(f.file, f.line) for f in found] == [("some.toml", line)]
    said = str(found[0])
    assert (rule in said, said.isprintable(), len(said) < 300) == (True, True, True)


def test_every_fault_is_listed_at_once_a_line_each():
    text = GOOD.replace("A = 3.28e-4", "A = true").replace("theta = 0.1", 'theta = "x"')
    text = text.replace("C = 6.60e-5", "C = -1").replace("gMR", "gmr").replace("digits", "digit")
    text = text.replace("time = 2", "time = 0").replace("format = 1", "format = 3")
    with pytest.raises(BadScene) as error:
        read_scene(text, "some.toml", ["start.spin=1"])
    assert {fault.key for fault in error.value.faults} == {
        "format", "top.A", "top.C", "top.gmr", "top.gMR", "start.theta", "start.spin", "span.time",
        "want.digit",
    }  # fmt: skip
    lines = [fault.line or 0 for fault in error.value.faults]
    assert lines == sorted(lines)
    assert str(error.value).splitlines() == [str(fault) for fault in error.value.faults]


CHANGES = {"start.theta=1\n[evil]\nx=1": "start.theta", "start=1": "start", "theta": "theta"}
CHANGES |= {"strat.theta=1": "strat", "a.b.c=1": "a.b.c=1"}


@pytest.mark.parametrize("change", CHANGES)
def test_a_bad_change_is_refused(change):
    (fault,) = faults(read_scene, GOOD, "some.toml", [change])
    assert (fault.key, "--set" in (fault.file, change)) == (CHANGES[change], "strat" not in change)


def test_text_that_is_no_toml_is_refused():
    for text in ("format = 1\n[top\n", "a = 1\na = 2", "a = " + "[" * 5000):
        (fault,) = faults(read_scene, text)
        assert ("[top" not in text) or fault.line == 2


def test_a_name_that_no_file_has_is_refused_with_the_nearest(tmp_path):
    [(tmp_path / name).touch() for name in ("my-top.toml", "toy.toml")]
    for near in ("my-top", "my-top.tml", "mytop.toml"):
        [fault] = faults(load_scene, tmp_path / near)
        assert re.search(r'did you mean ".*/my-top\.toml"', str(fault))
    assert "heavytop scenes lists" in str(*faults(load_scene, tmp_path / "nope"))
    assert faults(load_scene, "sicm-kiked")[0].hint == 'did you mean "sicm-kicked"?'
    for name in ("no/such/scene.toml", "a\0b", "x" * 5000, "", "\x1b[31m", "\ud800"):
        assert str(*faults(load_scene, name)).isprintable()


def test_files_that_are_no_scene_are_refused_without_being_read(tmp_path):
    huge, latin = tmp_path / "huge.toml", tmp_path / "latin.toml"
    with huge.open("wb") as file:
        file.truncate(10**8)
    latin.write_bytes(b'format = 1\ntitle = "\xe9"\n')
    for path, rule in ((tmp_path, "directory"), (huge, "most 1000000 bytes"), (latin, "UTF-8")):
        [fault] = faults(load_scene, path)
        assert rule in fault.rule
        assert str(path) not in fault.rule  # it stands before it
    assert faults(load_scene, latin)[0].line == 2
