"""Every study checks its options at one door: all that is wrong is said at once, in one wording."""

import pickle
from decimal import Decimal
from fractions import Fraction

import numpy as np
import pytest

import heavytop as ht
from heavytop.errors import BadScene
from heavytop.scene.arguments import Range, Refused, one_of, parse_names, parse_options
from heavytop.studies.drift import drift_parameters
from heavytop.studies.work_precision import diagram_parameters, settings

KICKED = ht.load_scene("sicm-kicked")
REAL, WHOLE = Range(0.5, 1e6), Range(1, 2**63 - 1, whole=True)
NO_NUMBERS = [True, np.True_, "1", None, 1j, [1], (1,), {}, b"1", float("nan"), Decimal("sNaN")]


def faults_of(ask, **options):
    with pytest.raises(BadScene) as bad:
        ask(**options)
    return bad.value.faults


def drift(**options):
    usual = {"scene": KICKED, "methods": ["auto"], "periods": 10, "ensemble": 1, "samples": 2}
    return drift_parameters(**usual | {"seed": 0, "jobs": 1} | options)


def work_precision(*, scene=KICKED, methods=("auto",), periods=100, budget=10):
    asked = diagram_parameters(scene, methods, periods=periods, budget=budget)["methods"]
    return {each for text in asked for each in settings(text, scene, periods)}


STUDIES = {"drift": drift, "work_precision": work_precision, "stress": ht.stress}


@pytest.mark.parametrize("kind", [int, float, np.int8, np.float32, Decimal, Fraction])
def test_a_number_of_any_kind_is_a_float_or_an_int(kind):
    assert (found := REAL(kind(7))) == 7
    assert type(found) is float
    if kind in (int, np.int8):
        assert type(WHOLE(kind(7))) is int
    else:
        with pytest.raises(Refused, match="a whole number from 1 to 9223372036854775807"):
            WHOLE(kind(7))


@pytest.mark.parametrize("value", NO_NUMBERS, ids=repr)
def test_what_is_no_number_is_none(value):
    for number in (REAL, WHOLE):
        with pytest.raises(Refused, match="number from"):
            number(value)


@pytest.mark.parametrize(("least", "most"), [(-2, 5), (0.5, 0.75), (1, 2**63 - 1)])
def test_bounds_belong_to_what_they_bound(least, most):
    whole = isinstance(most, int)
    number = Range(least, most, whole=whole)
    assert (number(least), number(most)) == (least, most)
    step = 1 if whole else 1e-9
    for beyond in (least - step, most + step, float("inf"), 10**400, Decimal("1e400")):
        with pytest.raises(Refused, match="number from"):
            number(beyond)


def test_what_is_right_is_kept_where_something_is_wrong():
    table = {"periods": REAL, "seed": WHOLE, "form": one_of({"axis": 5, "cubic": 6})}
    given = {"periods": 2, "seed": 0, "form": "cubic"}
    values, faults = parse_options("some", given, table)
    assert values == {"periods": 2.0, "form": 6}
    (fault,) = faults
    assert (fault.file, fault.line, fault.key, fault.value) == ("some", None, "seed", "0")
    assert parse_options("some", given | {"seed": 3}, table) == (values | {"seed": 3}, [])


def test_a_name_that_is_not_in_the_list_is_refused():
    for value, told in (("axes", '"axes"'), (3, "3"), ("\x1b[2J", '"\\x1b[2J"')):
        known = {"form": one_of({"axis": 0, "cubic": 1})}
        _, (fault,) = parse_options("some", {"form": value}, known)
        assert (fault.value, fault.rule) == (told, "one of axis, cubic")
        assert fault.hint == ('did you mean "axis"?' if value == "axes" else "")


def test_names_are_read_in_their_order_and_every_other_is_told():
    given = ["b", "x", 7, "a", "", "b\x1b", "b" * 100]
    found, faults = parse_names("some", "names", iter(given), one_of({"a": 1, "b": 2}))
    assert found == [2, 1]
    assert [fault.value for fault in faults] == ["x", "7", '""', "b\x1b", "b" * 60]
    assert {fault.key for fault in faults} == {"names"}
    assert faults[1].rule == "a name, as text"


def test_what_is_no_list_of_names_or_an_empty_one_is_refused():
    for given in ("a", b"a", None, 3):
        found, (fault,) = parse_names("some", "names", given, one_of({"a": 1}))
        assert (found, fault.rule) == ([], "a sequence of names")
    for given in ([], iter([])):
        found, (fault,) = parse_names("some", "cases", given, one_of({"a": 1}))
        assert (found, str(fault)) == ([], "some: cases: at least one case")


def test_a_refusal_can_be_pickled_and_read():
    again = pickle.loads(pickle.dumps(Refused("one of a, b", 'did you mean "a"?')))
    assert (again.rule, again.hint) == ("one of a, b", 'did you mean "a"?')
    assert str(again) == 'one of a, b (did you mean "a"?)'


# --- studies ---------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("study", "wrong"),
    [
        ("drift", {"periods": True, "ensemble": 2.0, "samples": None, "seed": 1.5,
                   "methods": ["x", "strang=0"]}),
        ("work_precision", {"periods": "9", "budget": float("nan"),
                            "methods": ["auto=0", 3, "strang=x"]}),
        ("stress", {"cases": ["cups"], "methods": [1, "taylor"], "budget": True,
                    "time_limit": "3", "step_limit": 2.5}),
    ],
)  # fmt: skip
def test_everything_that_is_wrong_is_told_at_once(study, wrong):
    told = [fault.key for fault in faults_of(STUDIES[study], **wrong)]
    names = [key for key, value in wrong.items() if isinstance(value, list) for _ in value]
    assert sorted(told) == sorted(names + [key for key in wrong if key not in names])


@pytest.mark.parametrize("study", STUDIES)
@pytest.mark.parametrize("methods", ["auto", []], ids=repr)
def test_methods_are_a_list_with_something_in_it(study, methods):
    (fault,) = faults_of(STUDIES[study], methods=methods)
    assert fault.key == "methods"
    assert fault.rule == ("a sequence of names" if methods else "at least one method")


@pytest.mark.parametrize(("study", "most"), [("drift", "1e+12"), ("work_precision", "1e+06")])
def test_a_scene_that_is_none_or_does_not_nutate_is_refused_with_all_the_rest(study, most):
    faults = faults_of(STUDIES[study], scene="sicm-kicked", periods=0, methods=["x"])
    assert [fault.key for fault in faults] == ["periods", "scene", "methods"]
    assert (faults[0].rule, faults[1].value) == (f"a number from 1 to {most}", '"sicm-kicked"')
    still = ht.load_scene("separatrix")
    faults = faults_of(STUDIES[study], scene=still, periods=0, methods=["auto", "x"])
    assert [fault.key for fault in faults] == ["periods", "start", "methods"]
    assert {fault.file for fault in faults} == {"separatrix"}
    assert "no nutation period to count: separatrix" in str(faults[1])
    assert faults[1].hint.endswith(" takes a top that nutates")


def test_digits_of_thousands_of_digits_are_no_bug():
    (fault,) = faults_of(work_precision, methods=[f"auto={'1' * 5000}"])
    assert fault.rule == "whole digits after auto=, from 1 to 30"
    assert len(work_precision(methods=["auto=06"])) == len(work_precision(methods=["auto=6"])) == 1


def test_nothing_is_done_twice_under_one_name():
    once = ht.stress(cases=["cusp"], methods=["auto"], budget=0)
    twice = ht.stress(cases=("cusp", "cusp"), methods=iter(["auto"] * 2), budget=Decimal(0))
    assert (twice.cases, twice.methods) == (once.cases, once.methods)
    assert len(twice.skipped) == len(once.skipped) == 1
    assert len(work_precision(methods=["strang=25", "strang=25.0"])) == 1
