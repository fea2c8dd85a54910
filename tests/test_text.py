"""The nearest name is hinted at, in one wording, and of many names few are told."""

import re

import pytest

import heavytop as ht
from heavytop.comparison import METHODS
from heavytop.errors import BadScene
from heavytop.studies.methods import taylor_methods
from heavytop.text import closest, listed, nearest

KICKED = ht.load_scene("sicm-kicked")


@pytest.mark.parametrize(
    ("value", "hint"),
    [
        ("phidott", "phidot"), ("PHIDOT", "phidot"), ("OMEGA3", "Omega3"), ("axis", "AXIS"),
        ("zz", ""), ("", ""), (3, ""), (None, ""), ("phidot" + 10**6 * " ", ""),
    ],
    ids=lambda value: str(value)[:10],
)  # fmt: skip
def test_the_nearest_name_is_hinted_at(value, hint):
    known = ("phi", "phidot", "Omega3", "AXIS")
    assert closest(value, known) == hint
    assert nearest(value, known) == (hint and f'did you mean "{hint}"?')
    assert nearest(value, ()) == ""


def test_few_names_are_told_and_of_many_where_they_are():
    many = [f"n{i}" for i in range(21)]
    assert listed(many[:20]) == ", ".join(many[:20])
    assert listed(many, "elsewhere") == "21 names: elsewhere"


def test_a_wrong_method_is_answered_with_all_of_them():
    with pytest.raises(BadScene) as error:
        ht.drift(KICKED, methods=["zzz"])
    told = re.split(r"[, ]+", str(error.value))
    assert taylor_methods().keys() | METHODS.keys() | {"auto"} <= {*told}
