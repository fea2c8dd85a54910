"""The nearest name is hinted at, in one wording, and of many names few are told."""

import pytest

from heavytop.text import closest, listed, nearest


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
