"""Words for people: the nearest name, in one wording."""

from heavytop.text import nearest

KNOWN = ("phi", "phidot", "Omega3", "AXIS")
HINTS = {"phidott": "phidot", "PHIDOT": "phidot", "OMEGA3": "Omega3", "axis": "AXIS"}
FAR = ("zz", "", 3, None, "phidot" + 10**6 * " ")


def test_the_nearest_name_is_hinted_at():
    for value, hint in (HINTS | dict.fromkeys(FAR, "")).items():
        assert nearest(value, KNOWN) == (hint and f'did you mean "{hint}"?')
        assert nearest(value, ()) == ""
