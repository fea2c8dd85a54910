"""What a public function does not take is refused by an error of the package that names it."""

import inspect
import operator

import pytest

import heavytop as ht

TOP = ht.Top("3.28e-4", "6.60e-5", "0.0456")
START = ht.State("0.1", phidot=-15, psidot=140)
SCENE = ht.Scene(TOP, START, time="0.01", name="scene")
MOTION = ht.Motion(TOP, START)
RUN = ht.propagate(SCENE)
NUMBERS = {"A": 1, "C": 1, "gMR": 1, "theta": 1}
PLANE = {"scene": SCENE, "x": "phidot=-2:2:3", "y": "psidot=-2:2:3", "jobs": 1}

# what each public function needs, as it should be
NEEDED = {
    "Motion": {"top": TOP, "start": START},
    "Scene": {"top": TOP, "start": START, "time": 2},
    "State": {"theta": 1},
    "Top": {"A": 1, "C": 1, "gMR": 1},
    "atlas": PLANE,
    "classify": {"top": TOP, "start": START},
    "classify_many": NUMBERS,
    "check": {"data": {"t": range(5), "theta": [0.1] * 5}, "scene": SCENE},
    "certify": {"run": SCENE},
    "drift": {"scene": SCENE},
    "extend": {"trajectory": RUN, "time_span": 3},
    "facts": {"motion": MOTION},
    "find": {"scene": SCENE, "vary": "start.psidot=1:2", "so_that": "round=1"},
    "sweep": {"scene": SCENE, "over": "start.psidot=1:2:3", "facts": ["round"]},
    "explore": {"scene": SCENE, "path": "no such folder/x.html"},
    "film": {"scene": SCENE, "path": "no such folder/x.gif"},
    "load_atlas": {"folder": "nowhere"},
    "load_scene": {"name_or_path": "sicm-kicked"},
    "load_trajectory": {"path": "nowhere"},
    "motions_many": NUMBERS,
    "plan": {"scene": SCENE},
    "propagate": {"scene": SCENE},
    "propagate_many": NUMBERS | {"time": 1},
    "reference": {"scene": SCENE, "times": [1]},
    "resume": {"folder": "nowhere"},
    "run_errors": {"trajectory": RUN},
    "sensitivities": {"top": TOP, "start": START},
    "stress": {"cases": ["kick-1e-9"], "methods": ("taylor-axis",)},
    "validate": {"names": ["betsch-cone"]},
    "work_precision": {"scene": SCENE},
    "State.from_constants": {"top": TOP, "E": 1, "p_phi": 1, "p_psi": 1, "theta": 1},
    "State.from_quaternion": {"quaternion": [1, 0, 0, 0]},
    "State.from_rotation": {"rotation": [[1, 0, 0], [0, 1, 0], [0, 0, 1]]},
    "State.kicked": {"theta": 1, "omega3": 1, "phidot": 1},
    "State.steady": {"top": TOP, "theta": 1, "omega3": 200},
    "Top.from_parts": dict.fromkeys(("mass", "distance", "A_cm", "C_cm", "gravity"), 1),
    "Top.from_solids": {"parts": [], "gravity": 1},
}
WRONG = [object(), "of no use", None, 1j, {}]
NAMES = [("stress", "cases"), ("stress", "methods"), ("explore", "scene")]  # or all
OPTIONAL = [("Scene", "time"), ("State.from_constants", "E"), *NAMES]
A_PATH = {"data", "folder", "name_or_path", "path"}  # which a text can be: it names no file
PLACES = [(name, place) for name, given in NEEDED.items() for place in given if place != "jobs"]


def named(name):
    return operator.attrgetter(name)(ht)


@pytest.mark.parametrize(("name", "place"), PLACES)
def test_what_a_function_does_not_take_is_refused_by_name(name, place):
    for wrong in WRONG:
        if (name, place) in (OPTIONAL if wrong is None else NAMES * isinstance(wrong, str)):
            continue
        with pytest.raises(ht.HeavyTopError) as refusal:
            named(name)(**NEEDED[name] | {place: wrong})
        told = str(refusal.value)
        assert (wrong if isinstance(wrong, str) and place in A_PATH else place) in told
        assert told.isprintable() or "\n" in told
        assert len(told) < 300


def test_every_public_function_is_among_them():
    """A function that is new is tried as the others are."""
    known = {n for n in ht.__all__ if inspect.isfunction(getattr(ht, n))}
    assert known <= NEEDED.keys()
    for name, given in NEEDED.items():
        own = inspect.signature(named(name)).parameters
        empty = {n for n, p in own.items() if p.default is p.empty and p.kind is not p.VAR_KEYWORD}
        assert empty <= given.keys() <= own.keys()


OPTIONS = {
    "Scene": "quantities events samples digits title",
    "atlas": "only folder progress",
    "drift": "methods periods ensemble samples seed folder progress",
    "propagate": "formulation tolerance projected step_limit progress",
    "stress": "budget time_limit folder progress",
    "resume": "jobs progress",
}


@pytest.mark.parametrize("name", OPTIONS)
def test_an_option_of_no_use_is_refused_by_name(name):
    for option in OPTIONS[name].split():
        for wrong in (object(), 1j):
            with pytest.raises(ht.HeavyTopError, match=option):
                named(name)(**NEEDED[name] | {option: wrong})


def test_what_is_of_another_type_is_a_type_error():
    with pytest.raises(TypeError, match="top: a Top, not a State"):
        ht.Motion(START, TOP)


@pytest.mark.parametrize(
    "what", [TOP, START, SCENE, MOTION, ht.State(theta=1, omega3=0), ht.load_scene("steady-fast")]
)
def test_what_is_shown_can_be_read_and_be_made_again(what):
    assert len(str(what)) < 240
    assert "Exact" not in str(what) + repr(what)
    assert eval(repr(what), {name: getattr(ht, name) for name in ht.__all__}) == what
