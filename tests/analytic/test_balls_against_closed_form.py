"""Enclosures against the closed form at many more digits: intervals within intervals.

What both may get wrong alike is held against other authorities, by `test_closed_form`,
`test_elliptic` and `test_reduced_equation`.
"""

from fractions import Fraction

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import heavytop as ht
from heavytop.analytic.closed_form import ClosedForm
from heavytop.analytic.enclosure import enclose, enclose_axis
from heavytop.analytic.rising import Rising
from heavytop.classification.reduced import FromAxis
from heavytop.numbers.intervals import Interval, rational
from heavytop.scene.scene import shipped_scenes

TIMES = (0, "1.3", -7.25, "1e5")


def holds(ball, value, digits):
    """Whether the ball holds a value that is good to so many digits."""
    return value in Interval(
        ball.middle, ball.spread + Fraction(1, 10**digits) * max(1, abs(ball.mid))
    )


def compare(enclosure, form, times=TIMES):
    digits = form.digits - 5
    found = enclosure.period, enclosure.precession, enclosure.spin
    true = form.period, form.precession, form.spin
    for ball, value in zip(found, true, strict=True):
        assert (ball is None) == (value is None)
        if ball is not None:
            assert ball.digits >= enclosure.digits
            assert holds(ball, value, digits)
    pairs = [(enclosure.theta_min, min(form.tilts)), (enclosure.theta_max, max(form.tilts))]
    for t in times:
        record = form(t)
        pairs += [(enclosure.theta(t), record.theta), (enclosure.u(t), record.u)]
        pairs += zip(enclosure.axis(t), record.axis, strict=True)
        pairs += zip(enclosure.quaternion(t), record.quaternion, strict=True)
        turned = [(enclosure.phi(t), record.phi), (enclosure.psi(t), record.psi)]
        rates = record.thetadot, record.phidot, record.psidot
        for ball, value in (*turned, *zip(enclosure.rates(t), rates, strict=True)):
            assert ball.digits >= enclosure.digits
            assert holds(ball, value, digits)
    for ball, value in pairs:
        assert ball.decimals >= enclosure.digits
        assert holds(ball, value, digits)


@pytest.mark.parametrize("digits", [15, 50, 200])
@pytest.mark.parametrize("name", shipped_scenes())
def test_every_shipped_scene(name, digits):
    scene = ht.load_scene(name)
    motion = ht.Motion(scene.top, scene.start)
    enclosure = enclose(scene.top, scene.start, digits)
    compare(enclosure, motion.form(digits + 50))
    if motion.nutates:
        roots = ht.Motion(scene.top, scene.start).form(digits + 50).roots
        for ball, root in zip(enclosure.roots, roots, strict=True):
            assert ball.decimals >= digits
            assert holds(ball, root, digits + 45)


NUMBERS = ("period", "precession", "spin", "relative_spin", "theta_min", "theta_max", "nearest",
           "tilts", "mean_rates", "lower_turning", "reversal", "modulus", "growth")  # fmt: skip


@pytest.mark.parametrize("name", shipped_scenes())
def test_all_three_kinds_of_numbers_are_the_same(name):
    """An interval of 20 digits holds the number of 60, and the float is the nearest to that."""
    scene = ht.load_scene(name)
    motion, enclosure = ht.Motion(scene.top, scene.start), enclose(scene.top, scene.start, 20)
    form = motion.form(60)
    for number in NUMBERS:
        found = [getattr(each, number) for each in (enclosure, form, motion)]
        if not isinstance(found[0], tuple):
            found = [(each,) for each in found]
        for interval, exact, double in zip(*found, strict=True):
            assert (interval is None) == (exact is None) == (double is None), number
            if exact is not None:
                assert holds(interval, exact, 55), number
                assert double == pytest.approx(float(exact), rel=1e-16, abs=1e-45), number


small = st.sampled_from([-5, -2, -1, "-0.3", 0, "0.01", 1, "2.5", 7])
tops = st.builds(
    ht.Top,
    A=st.sampled_from([1, 2, "0.5", "3.28e-4"]),
    C=st.sampled_from(["1e-6", "6.6e-5", "3.28e-4"]),
    gMR=st.sampled_from([1, -1, "0.0456", "2.5", -3, 0]),
)
spins = st.tuples(st.sampled_from(["psidot", "omega3"]), small | st.integers(-(10**6), 10**6))
starts = st.builds(
    lambda spin, **rest: ht.State(**{spin[0]: spin[1]}, **rest),
    spin=spins,
    theta=st.sampled_from([0, "pi", "pi/3", "pi/2", "0.1", "1.2", 3, "2*pi/3"]),
    thetadot=small,
    phidot=small | st.decimals(-50, 50, places=3),
)


@settings(max_examples=150, deadline=None)
@given(tops, starts, st.sampled_from([15, 50]))
def test_random_tops_on_and_off_the_poles(top, start, digits):
    compare(enclose(top, start, digits), ht.Motion(top, start).form(100))


doubles = st.floats(-3, 3, allow_subnormal=False).filter(lambda x: abs(x) > 1e-3 or not x)


@settings(max_examples=100, deadline=None)
@given(
    st.tuples(doubles, doubles, doubles).filter(any),
    st.tuples(doubles, doubles, doubles),
    doubles,
    doubles,
)
def test_random_axes_of_any_length(e, l, g, kappa):  # noqa: E741
    form = ClosedForm(Rising(FromAxis(e, l, g, kappa)), 100)
    compare(enclose_axis(e, l, g, kappa, digits=30), form)


def test_angles_of_an_axis_are_counted_from_where_one_says():
    """φ₀ and ψ₀ are added; without them φ₀ is that of the axis, (sin θ sin φ, −sin θ cos φ)."""
    given = {"e": (0.6, 0.0, 0.8), "l": (1.0, 3.0, 4.0), "g": 1.0, "kappa": 0.5, "digits": 30}
    plain, moved = enclose_axis(**given), enclose_axis(**given, phi0=2, psi0="0.25")
    half_pi = ht.Motion(ht.Top(1, 1, 0), ht.State("pi/2")).exact.ctx.pi / 2
    assert abs(float(plain.phi(0).middle) - float(half_pi)) < 1e-15
    for t in (0, 3):
        change = moved.phi(t).middle - plain.phi(t).middle
        assert abs(change - 2 + Fraction(rational(half_pi))) < Fraction(1, 10**29)
        assert abs(moved.psi(t).middle - plain.psi(t).middle - Fraction(1, 4)) < Fraction(1, 10**29)


def test_both_sources_agree():
    """The same motion from a scene and from its axis."""
    top = ht.Top(A=2, C=1, gMR=3)
    start = ht.State(theta="pi/2", thetadot="0.5", phidot=1, omega3=4)
    by_scene = enclose(top, start, 40)
    # e = (0, −1, 0) and l = θ̇ n + φ̇ sin θ e′ + (b, along e), with n = (1, 0, 0) and e′ = ẑ
    by_axis = enclose_axis(e=(0, -1, 0), l=(0.5, -2, 1), g=1.5, kappa=2, digits=40)
    for name in ("period", "precession", "spin", "theta_min", "theta_max"):
        one, other = getattr(by_scene, name), getattr(by_axis, name)
        assert abs(one.middle - other.middle) <= one.spread + other.spread
    assert abs(by_scene.theta(5).middle - by_axis.theta(5).middle) < Fraction(1, 10**39)


def test_a_horizontal_force_free_axis_that_only_precesses_is_steady():
    start = ht.State(theta="pi/2", phidot="1e-20")
    found = enclose(ht.Top(1, 1, 0), start)
    assert not found.nutates
    assert found.period is found.precession is found.spin is None
    assert found.roots == (Interval(Fraction(0), Fraction(0)),) * 2
    assert found.theta("1e20").bounds(15) == ("1.57079632679489", "1.5707963267949")
