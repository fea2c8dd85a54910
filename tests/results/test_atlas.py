"""An atlas says how many pixels are of each kind, what its axes are, and what has no pixel."""

from dataclasses import replace

from heavytop.results.atlas import Atlas

AXIS = {"name": "phidot", "low": 0.0, "high": 1.0, "count": 4, "log": True}
FOUND = Atlas(
    scene={"top": {"A": 1.0}, "start": {"phidot": 3}}, axes={"x": AXIS}, shape=(1, 4), what="rows",
    counts={"waves": 1, "loops": 3}, details={"loops, slow": 2}, uncertified=0,
    curves=({"name": "cusps"}, {"name": "cusps"}, {"name": "through-top"}), rows_per_s=2.0,
)  # fmt: skip


def test_it_shows_its_kinds_axes_and_boundaries():
    [table] = FOUND.tables()
    assert table.texts() == [
        ["loops, slow", "2", "50.000%"], ["waves", "1", "25.000%"], ["loops", "1", "25.000%"],
    ]  # fmt: skip
    assert {"x", "held", "boundaries"} <= dict(FOUND.facts()).keys()
    assert "impossible" not in dict(FOUND.facts())
    assert "π rad" in dict(replace(FOUND, counts={"impossible": 4}).facts())["impossible"]
