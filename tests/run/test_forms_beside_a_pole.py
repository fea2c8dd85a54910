"""Forms that are singular at the poles, where the axis passes close to one."""

import pickle

import pytest

import heavytop as ht
from heavytop.errors import Outcome

BESIDE_THE_BOTTOM = ht.Scene(
    ht.Top(26.620571276135763, 18.401594793183584, 97.45205680113948),
    ht.State(3.141592653538415, phi=-2.50134175824008, psidot=1.893466346075836),
    time=-12.155835251833263, quantities=("theta",), events=(),
)  # fmt: skip


def test_a_form_that_is_singular_where_the_axis_goes_ends_by_a_step_limit():
    """1.7e-11 rad from the bottom, whose reciprocals set Routh's form a pace that leads nowhere."""
    with pytest.raises(ht.EndedEarly, match=r"comes 1\.7e-11 rad near one; the axis form") as early:
        ht.propagate(BESIDE_THE_BOTTOM, formulation="routh")
    assert early.value.outcome is Outcome.STEP_LIMIT
    assert 0 < abs(early.value.trajectory.orbit.end) < 12.2
    assert pickle.loads(pickle.dumps(ht.EndedEarly("step-limit", None, "why"))).why == "why"


def test_time_grows_beside_a_pole():
    """At the Lie-group benchmark's pass, 7e-7 rad beside the bottom."""
    quick, slow = (ht.plan(BESIDE_THE_BOTTOM, form).seconds for form in ("axis", "routh"))
    assert slow > 20 * quick
