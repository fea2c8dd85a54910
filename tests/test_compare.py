"""The comparison with the frozen version sees every bit, and lets pass what it should."""

import pytest

PAIRS = [
    ({"t": 0.0}, {"t": -0.0}, 1),
    ({"t": [1.0, 2.0]}, {"t": [1.0]}, 1),
    ({"plan": {"folded": False}}, {"plan": {}}, 1),
    ({"us_per_period": 3.0}, {"us_per_period": 4.0}, 0),
    ({"errors": {"phi": 1e-14}}, {"errors": {"phi": 3e-14}}, 0),
    ({"errors": {"phi": 1e-14}}, {"errors": {"phi": 9e-14}}, 1),
    ({"t": [1.0, 2.0, 3.0]}, {"t": [1.5, 2.5, 3.0]}, 1),  # the first of a column
]


@pytest.mark.parametrize(("old", "new", "seen"), PAIRS)
def test_what_counts_as_a_difference(validation_script, old, new, seen):
    assert len(list(validation_script("compare").differences(old, new))) == seen
