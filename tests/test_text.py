"""Words for people: the nearest name, in one wording, and a time in its unit."""

from heavytop.text import duration, nearest

KNOWN = ("phi", "phidot", "Omega3", "AXIS")
HINTS = {"phidott": "phidot", "PHIDOT": "phidot", "OMEGA3": "Omega3", "axis": "AXIS"}
FAR = ("zz", "", 3, None, "phidot" + 10**6 * " ")


def test_the_nearest_name_is_hinted_at():
    for value, hint in (HINTS | dict.fromkeys(FAR, "")).items():
        assert nearest(value, KNOWN) == (hint and f'did you mean "{hint}"?')
        assert nearest(value, ()) == ""


def test_a_time_is_told_in_its_unit():
    texts = [duration(x) for x in (3.17, 90, 24_400, 3e5, 1e12)]
    assert texts == ["3.17 s", "1.5 min", "6.78 h", "3.47 days", "3.17e+04 years"]
