"""The comparison with the frozen version sees every bit, and lets pass what it should."""

import pytest


@pytest.mark.parametrize(("old", "new", "seen"), [
    ({"t": 0.0}, {"t": -0.0}, 1),
    ({"t": [1.0, 2.0]}, {"t": [1.0]}, 1),
    ({"plan": {"folded": False}}, {"plan": {}}, 1),
    ({"us_per_period": 3.0}, {"us_per_period": 4.0}, 0),
    ({"errors": {"phi": 1e-14}}, {"errors": {"phi": 3e-14}}, 0),
    ({"errors": {"phi": 1e-14}}, {"errors": {"phi": 9e-14}}, 1),
    ({"t": [1.0, 2.0, 3.0]}, {"t": [1.5, 2.5, 3.0]}, 1),  # the first of a column
])  # fmt: skip
def test_what_counts_as_a_difference(script, old, new, seen):
    assert len(list(script("compare").differences(old, new))) == seen
