"""The nearest name is hinted at, in one wording."""

import pytest

from heavytop.text import closest, nearest


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
