"""Motions at the ends of what a scene may say: rates, times and tilts far from 1."""

from fractions import Fraction

import numpy as np
import pytest

import heavytop as ht
from heavytop.analytic.enclosure import enclose_axis
from heavytop.errors import Impossible, NoClosedForm, NotANumber, WrongType

RATES = ("thetadot", "phidot", "psidot")


@pytest.mark.parametrize(
    ("top", "start"),
    [
        (ht.Top(1, "0.5", "1e300"), ht.State("2.5", thetadot="0.1", phidot=3)),
        (ht.Top(1, 1, 0), ht.State("0.1", thetadot=2, phidot=-7, psidot="1e100")),
        (ht.Top(1, "0.5", "1/3"), ht.State("pi/3", phidot="1e15", psidot="1e-16")),
    ],
)
def test_a_slow_rate_in_a_fast_motion_has_its_digits(top, start):
    """Digits count from max(1, |x|), not from the fastest rate."""
    record = ht.Motion(top, start).at(0, digits=30)
    for name in RATES:
        assert abs(getattr(record, name) - getattr(start, name).mpf(record.t.context)) < 1e-29


@pytest.mark.parametrize("spin", ["1e30", "1e60", "1e100"])
def test_doubles_have_phidot_of_a_narrow_nutation(spin):
    """There a − b u at the turning points is what two long numbers differ by."""
    start = ht.State("0.1", thetadot=2, phidot=-7, psidot=spin)
    assert ht.Motion(ht.Top(1, 1, 0), start).at(0.0).phidot == pytest.approx(-7, rel=1e-14)


@pytest.mark.parametrize("tilt", ["1e-150", "1e-200", "1e-300"])
@pytest.mark.parametrize("below", [False, True])
def test_doubles_have_rates_where_the_distance_from_a_pole_is_too_small_for_one(tilt, below):
    theta, gMR = (f"pi - {tilt}", -1) if below else (tilt, 1)
    motion = ht.Motion(ht.Top(1, 1, gMR), ht.State(theta, phidot=2, omega3="1e-8"))
    for t in (0.0, 1.0):
        doubles, exact = motion.at(t), motion.at(t, digits=20)
        for name in ("theta", *RATES):
            assert getattr(doubles, name) == pytest.approx(float(getattr(exact, name)), rel=1e-13)


@pytest.mark.filterwarnings("error")
def test_doubles_of_a_motion_whose_acceleration_is_too_large_for_one():
    record = ht.Motion(ht.Top(1, 2, "1e12"), ht.State("2.5", thetadot="1e300")).at(0.0)
    assert record.thetadot == 1e300
    assert record.theta == pytest.approx(2.5, rel=1e-15)
    assert not np.isnan(record.uddot)


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("t", [1e300, -1e300])
def test_an_angle_too_large_for_a_double_has_a_name(t):
    motion = ht.Motion(ht.Top(1, 1, 0), ht.State("pi/3", psidot="1e15"))
    with pytest.raises(NoClosedForm, match="digits"):
        motion.at(t)
    exact = motion.at(t, digits=20)
    assert abs(exact.psi / (10**15 * exact.t) - 1) < 1e-19


@pytest.mark.parametrize(
    ("top", "start", "t"),
    [
        (ht.Top(1, 1, 0), ht.State("1e-160", omega3="1/3"), 1e300),
        (ht.Top(1, "1/3", 0), ht.State("0.1", psidot="1e15"), 1e60),
        (ht.Top("1e300", 1, "1e-200"), ht.State("pi/2", phidot="1e100", psidot="1e-300"), 1e30),
    ],
)
def test_what_does_not_turn_does_not_turn_late(top, start, t):
    doubles, exact = (ht.Motion(top, start).at(t, *digits) for digits in ((), (20,)))
    for name in ("phi", "psi", "phidot", "psidot"):
        assert getattr(doubles, name) == pytest.approx(float(getattr(exact, name)), abs=1e-15)


def test_a_weight_that_counts_as_zero_is_one():
    """The three roots cancel, which is not proved; so many bits as are tried take 20 s."""
    start = ht.State(1, phidot=1, omega3=1)
    undecided = ht.Motion(ht.Top(1, 1, "sqrt(2) + sqrt(3) - sqrt(5 + 2*sqrt(6))"), start)
    free = ht.Motion(ht.Top(1, 1, 0), start)
    assert undecided.exact.modulus == free.exact.modulus
    assert undecided.at(1.0).phi == free.at(1.0).phi
    assert undecided.at(1, digits=30) == free.at(1, digits=30)


@pytest.mark.parametrize("tiny", [5e-324, Fraction(1, 10**400)])
def test_an_axis_may_be_nearer_to_a_pole_than_a_scene_says(tiny):
    """Runs of many digits pass poles so closely, and doubles are as small."""
    near, at = (enclose_axis((0, x, 1), (x, 1, 3), 1) for x in (tiny, 0))
    assert near.u(1).mid == at.u(1).mid


@pytest.mark.parametrize("gMR", [1, -1])
def test_how_near_a_pole_has_its_own_digits(gMR):
    near = "1e-200"
    top = ht.Motion(ht.Top(1, 1, gMR), ht.State(near, phidot=2, omega3=1))
    bottom = ht.Motion(ht.Top(1, 1, -gMR), ht.State(f"pi - {near}", phidot=2, omega3=-1))
    assert top.from_top == pytest.approx(bottom.from_bottom, rel=1e-15)
    assert 0 < top.from_top <= 1e-200


TOP, START = ht.Top("3.28e-4", "6.6e-5", "0.0456"), ht.State("0.1", phidot=-15, psidot=140)


@pytest.mark.parametrize("t", ["x", "pi/3", 1 + 2j, None, [[1], [2, 3]], 10**400])
def test_what_is_no_time_has_a_name(t):
    form = ht.Motion(TOP, START).double
    for ask in (form, form.theta, lambda t: form(1.0, t)):
        with pytest.raises(NotANumber):
            ask(t)


@pytest.mark.parametrize("n", [None, "x", 0.5, [1], np.array([1, 2])])
def test_which_event_is_a_whole_number(n):
    with pytest.raises(NotANumber, match="n: a whole number"):
        ht.enclose(TOP, START).time("turning", n)


@pytest.mark.parametrize(
    ("e", "error"),
    [
        (None, WrongType),
        (1.0, WrongType),
        ("123", WrongType),
        ([], Impossible),
        ((1, 2), Impossible),
        (np.array(2.0), Impossible),
    ],
)
def test_a_vector_has_three_numbers(e, error):
    for vectors in ((e, (1, 2, 3)), ((0, 0, 1), e)):
        with pytest.raises(error, match="three numbers"):
            enclose_axis(*vectors, 1)
