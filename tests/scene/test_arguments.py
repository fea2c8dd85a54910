"""Every study checks its options at one door: all that is wrong is said at once, in one wording."""

from decimal import Decimal
from fractions import Fraction

import numpy as np
import pytest

import heavytop as ht
from heavytop.errors import BadScene, Refused
from heavytop.scene.arguments import Range, gather, integer, one_of, parse_names, parse_options

REAL, WHOLE = Range(0.5, 1e6), Range(1, 2**63 - 1, whole=True)
NO_NUMBERS = [True, np.True_, "1", None, 1j, [1], {}, float("nan"), Decimal("sNaN"), 10**400]


@pytest.mark.parametrize("kind", [int, float, np.int8, np.float32, Decimal, Fraction])
def test_a_number_of_any_kind_is_a_float_or_an_int(kind):
    assert type(REAL(kind(7))) is float
    if kind in (int, np.int8):
        assert type(WHOLE(kind(7))) is int
    else:
        with pytest.raises(Refused, match="a whole number from 1 to 9223372036854775807"):
            WHOLE(kind(7))


@pytest.mark.parametrize("value", [*NO_NUMBERS, 0, 1e20], ids=repr)
def test_what_is_no_number_or_out_of_bounds_is_refused(value):
    for number in (REAL, WHOLE):
        with pytest.raises(Refused, match="number from"):
            number(value)
    assert (REAL(0.5), REAL(1e6), WHOLE(2**63 - 1)) == (0.5, 1e6, 2**63 - 1)


def test_what_several_functions_refuse_is_raised_at_once():
    def refuse_four():
        with gather([("unit", "none")]) as attempt:
            attempt(ht.load_scene, "sicm-kicked", ["start.x=1", "start.y=1"])
            assert attempt(integer, "jobs", 3, 1) == 3
            attempt(integer, "seed", 0, 1)

    with pytest.raises(BadScene) as found:
        refuse_four()
    assert [each.key for each in found.value.faults] == ["unit", "start.x", "start.y", "seed"]
    assert str(found.value).splitlines()[-1] == "seed = 0: a whole number, at least 1"


def test_what_is_right_is_kept_where_something_is_wrong():
    readers = {"periods": REAL, "seed": WHOLE, "form": one_of({"axis": 5, "cubic": 6})}
    given = {"periods": 2, "seed": 0, "form": "axes", "sed": 1}
    values, faults = parse_options("some", given, readers)
    assert values == {"periods": 2.0}
    assert [(f.file, f.key, f.value, f.hint) for f in faults] == [
        ("some", "seed", "0", ""),
        ("some", "form", '"axes"', 'did you mean "axis"?'),
        ("some", "sed", "1", 'did you mean "seed"?'),
    ]


def test_names_are_read_in_their_order_and_every_other_is_told():
    given = ["b", "x", 7, "a", "", "b\x1b", "b" * 100]
    found, faults = parse_names("some", "names", iter(given), one_of({"a": 1, "b": 2}))
    assert found == [2, 1]
    assert [fault.value for fault in faults] == ["x", "7", '""', "b\x1b", "b" * 60]
    assert str(faults[3]).isprintable()
    for wrong in ("a", None, np.array(0.5), []):
        found, faults = parse_names("some", "cases", wrong, one_of({"a": 1}))
        assert (found, [fault.key for fault in faults]) == ([], ["cases"])
