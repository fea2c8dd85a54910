"""The comparison with the frozen version sees every bit, and lets pass what it should."""

import copy
import math
import sys
from importlib import import_module
from pathlib import Path

import pytest


@pytest.fixture
def compare(monkeypatch):
    monkeypatch.syspath_prepend(str(Path(__file__).parents[1] / "validation"))
    yield import_module("compare")
    sys.modules.pop("compare")


def test_a_motion_is_like_itself_and_every_planted_difference_is_seen(compare, monkeypatch):
    monkeypatch.setattr(sys, "argv", sys.argv)
    old = compare.motion({"scene": "sicm-kicked"})
    assert list(compare.differences(old, compare.motion({"scene": "sicm-kicked"}))) == []
    new = copy.deepcopy(old)
    new["arrays"]["theta"][3] = math.nextafter(new["arrays"]["theta"][3], 9)
    new["exact"][0]["theta"] = "0.100" + new["exact"][0]["theta"][5:]
    new["kind"] = "waves"
    del new["classify"]["document"]["motion"]["why"]
    keys = [key for key, *_ in compare.differences(old, new)]
    assert keys == [
        ".kind",
        ".exact[0].theta",
        ".arrays.theta[3]",
        ".classify.document.motion.why",
    ]


@pytest.mark.parametrize(
    ("old", "new", "seen"),
    [
        ({"t": 0.0}, {"t": -0.0}, 1),
        ({"t": [1.0, 2.0]}, {"t": [1.0]}, 1),
        ({"plan": {"folded": False}}, {"plan": {}}, 1),
        ({"us_per_period": 3.0}, {"us_per_period": 4.0}, 0),
        ({"errors": {"phi": 1e-14}}, {"errors": {"phi": 3e-14}}, 0),
        ({"errors": {"phi": 1e-14}}, {"errors": {"phi": 9e-14}}, 1),
        ({"t": [1.0, 2.0, 3.0]}, {"t": [1.5, 2.5, 3.0]}, 1),  # the first of a column
    ],
)
def test_what_counts_as_a_difference(compare, old, new, seen):
    assert len(list(compare.differences(old, new))) == seen
