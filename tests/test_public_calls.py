"""What a public function does not take is refused by an error of the package that names it."""

import inspect
import operator
from dataclasses import replace

import numpy as np
import pytest

import heavytop as ht

from .motions import BOOK as TOP
from .motions import KICKED as START

SCENE = ht.Scene(TOP, START, time="0.01", name="scene")
MOTION = ht.Motion(TOP, START)
RUN = ht.propagate(SCENE)

# what public functions take, by its name, as it should be
GOOD = {
    "A": 1, "C": 1, "gMR": 1, "theta": 1, "time": 2, "top": TOP, "start": START, "scene": SCENE,
    "run": SCENE, "trajectory": RUN, "motion": MOTION, "time_span": 3, "times": [1],
    "x": "phidot=-2:2:3", "y": "psidot=-2:2:3", "vary": "start.psidot=1:2", "so_that": "round=1",
    "over": "start.psidot=1:2:3", "facts": ["round"], "cases": ["kick-1e-9"], "parts": [],
    "methods": ("taylor-axis",), "names": ["betsch-cone"], "E": 1,
    "data": {"t": range(5), "theta": [0.1] * 5},
    "p_phi": 1, "p_psi": 1, "quaternion": [1, 0, 0, 0], "omega3": 200, "phidot": 1, "mass": 1,
    "rotation": [[1, 0, 0], [0, 1, 0], [0, 0, 1]], "distance": 1, "A_cm": 1, "C_cm": 1,
    "gravity": 1, "folder": "nowhere", "path": "no such folder/x.gif", "name_or_path": "mine",
}  # fmt: skip
BESIDES = {  # what is tried though it may be left out
    "Scene": "time", "check": "scene", "explore": "scene path", "stress": "cases methods",
    "validate": "names", "State.from_constants": "E p_phi p_psi theta", "State.steady": "omega3",
    "Top.from_parts": "A_cm C_cm",
}  # fmt: skip
MAKERS = ("Motion", "Scene", "State", "Top", "State.from_quaternion", "State.from_rotation",
          "State.kicked", "Top.from_solids")  # fmt: skip
FUNCTIONS = {n for n in ht.__all__ if inspect.isfunction(getattr(ht, n))}
UNREAD = {"which", "overrides", "resume methods"}  # read after what is wrong besides
NAMES = [("stress", "cases"), ("stress", "methods"), ("explore", "scene")]  # or all
OPTIONAL = [("Scene", "time"), ("State.from_constants", "E"), *NAMES]
ONE_DIMENSION = "reference times", "State.from_rotation rotation", "check undone"
A_PATH = {"data", "folder", "name_or_path", "path"}  # which a text can be: it names no file


def named(name):
    return operator.attrgetter(name)(ht)


def needed(name):
    """What a function needs, as it should be."""
    own = inspect.signature(named(name)).parameters.values()
    empty = [p.name for p in own if p.default is p.empty and p.kind is not p.VAR_KEYWORD]
    return {x: GOOD[x] for x in (*empty, *BESIDES.get(name, "").split())}


def optional(name):
    """What a function may be given besides."""
    others = inspect.signature(named(name)).parameters.keys() - needed(name).keys() - UNREAD
    return sorted(place for place in others if f"{name} {place}" not in UNREAD)


EVERY = sorted({*FUNCTIONS, *MAKERS, *BESIDES})
PLACES = [(n, x, [object(), "of no use", None, 1j, {}]) for n in EVERY for x in needed(n)]
PLACES += [(n, place, (object(), 1j)) for n in EVERY for place in optional(n)]
PLACES += [("propagate_many", x, (-1, "x", None, 30)) for x in ("digits", "events", "formulation")]
PLACES += [
    ("propagate_many", "jobs", (-1, "x")), ("plan", "formulation", [None]),
    ("State", "theta", [np.timedelta64(1, "s")]), ("resume", "jobs", [10**30]),
    ("reference", "events", [None]), *((*x.split(), [np.array(1.0)]) for x in ONE_DIMENSION),
]  # fmt: skip


@pytest.mark.parametrize(("name", "place", "every"), PLACES)
def test_what_a_function_does_not_take_is_refused_by_name(name, place, every):
    for wrong in every:
        if (name, place) in (OPTIONAL if wrong is None else NAMES * isinstance(wrong, str)):
            continue
        with pytest.raises(ht.HeavyTopError) as refusal:
            named(name)(**needed(name) | {place: wrong})
        message = str(refusal.value)
        assert (wrong if isinstance(wrong, str) and place in A_PATH else place) in message
        assert message.isprintable() or "\n" in message
        assert len(message) < 300


SEPARATRIX = ht.load_scene("separatrix")
HEAVY = replace(SCENE, top=ht.Top.from_parts(mass=1, distance=1, gravity="9.81", A_cm=1, C_cm=1))
FAST = ht.Scene(ht.Top(1, "1e-7", 1), ht.State(1, psidot="1e7"), time=1)


# a function, what it is given besides, and the keys of all that is wrong
@pytest.mark.parametrize(("name", "given", "keys"), [
    ("Scene", {"periods": 1}, "periods"),
    ("Scene", {"quantities": ("thta",)}, "quantities"),
    ("Scene", {"events": "turning"}, "events"),
    ("Scene", {"start": 0.1}, "start"),
    ("Scene", {"quantities": ("reaction",)}, "top.mass"),
    *(("load_scene", {"name_or_path": "sicm-kicked", "overrides": x}, "overrides")
      for x in ("start.phidot=-14", [-14], np.array([0.5]), None)),
    ("find", {"vary": "psidt=1:2", "so_that": "rond = 3"}, "vary so_that"),
    ("find", {"vary": "start.psidot=1:x", "so_that": "round = 3 kg"}, "vary so_that"),
    ("find", {"vary": "start.psidot=1", "so_that": "kind < waves"}, "vary so_that"),
    ("find", {"vary": "top.A=-3:-1"}, "top.A"),
    ("find", {"scene": HEAVY, "vary": "top.gMR=1:2"}, "top.gMR"),
    ("sweep", {"over": "psidt=1:2", "facts": ["rond", 3]}, "facts facts over"),
    ("sweep", {"over": "start.psidot = 50:400:0"}, "over"),
    ("atlas", {"x": "phidot=5:1:5", "y": "psi=0:1:2", "jobs": 0}, "x y jobs"),
    ("atlas", {"y": "p_psi=0:1:5", "x": "psidot=0:1:5"}, "y"),
    ("atlas", {"x": "phidot=0:1:1000000", "y": "psidot=0:1:1000000"}, "x, y"),
    ("film", {"path": "x.avi", "seconds": 0, "fps": 99, "size": (1, 2)}, "seconds path fps size"),
    ("film", {"size": (4096, 4096), "seconds": 600}, "size"),
    ("film", {"rounds": 1, "time": 2}, "rounds"),
    ("film", {"speed": 1, "time": 2, "seconds": 3}, "speed"),
    ("explore", {"scene": FAST, "path": "x.html"}, "psidot C/A"),
    ("check", {"scene": None}, "scene"),
    *(("reference", {"times": x}, "times") for x in ("0:1", "0:1:0", "0:1:1e-12", ["1/3"], [], 3)),
    *(("reference", {"quantities": x}, "quantities") for x in (["tetha"], "theta")),
    ("reference", {"digits": 1}, "digits"),
    ("reference", {"events": ["cups"]}, "events"),
    *((study, {"scene": SEPARATRIX, "periods": "9", "methods": ["auto", "strang=x"]},
       "periods start methods") for study in ("drift", "work_precision")),
    ("validate", {"names": ["hold", "a\n" * 100, "\udcff", 3]}, "names names names names"),
    ("validate", {"names": "holds"}, "names"),
    ("propagate_many", {"digits": 99, "jobs": 0, "formulation": 3}, "digits jobs formulation"),
    ("propagate_many", {"events": ("turning", "turning")}, "events"),
    ("validate", {"jobs": 0}, "jobs"),
])  # fmt: skip
def test_all_that_is_wrong_is_named_and_nothing_done(name, given, keys, monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(ht.BadScene) as refusal:
        named(name)(**needed(name) | given)
    assert " ".join(fault.key for fault in refusal.value.faults) == keys
    assert not [*tmp_path.iterdir()]


def test_errors_are_of_the_types_that_python_has_for_them():
    with pytest.raises(TypeError, match="top: a Top, not a State"):
        ht.Motion(START, TOP)
    with pytest.raises(ht.ForeignFile, match="null byte"):
        ht.load_atlas("\0")
    with pytest.raises(ht.HeavyTopError, match="path: the name of a file, not '\\.'"):
        RUN.save("")


SHOWN = [TOP, START, SCENE, MOTION, ht.State(theta=1, omega3=0), ht.load_scene("steady-fast")]


@pytest.mark.parametrize("what", SHOWN)
def test_what_is_shown_can_be_read_and_be_made_again(what):
    assert len(str(what)) < 240
    assert "Exact" not in str(what) + repr(what)
    assert eval(repr(what), {name: getattr(ht, name) for name in ht.__all__}) == what
