"""Motion: what a user asks of one top and one start, at the ends of what a scene may say too.

Intervals hold the closed form at many more digits. What both may get wrong alike is held against
other authorities, by `test_against_mpmath`, `test_published` and `test_form`.
"""

from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import heavytop as ht
from heavytop.analytic.motion import ClosedForm
from heavytop.classification.reduced import AxisMotion, StartMotion
from heavytop.errors import HeavyTopError, Impossible, NoClosedForm, Unseparated
from heavytop.exact import cos, sqrt
from heavytop.exact.balls import Interval
from heavytop.exact.decimals import context

from ..motions import BOOK, CONE, KICKED, MARGINAL, SCENES, product, shipped
from ..views import Bounds, Digits, holds

RATES = ("thetadot", "phidot", "psidot")
CTX = context(50)


def test_digits_and_many_times():
    """at(t, digits) gives numbers; many times a tuple; without digits arrays."""
    motion = ht.Motion(BOOK, KICKED)
    one = motion.at(2, digits=40)
    assert abs(one.theta - motion.at(2, 60).theta) < 1e-40
    assert motion.at([Fraction(1, 3), 2], digits=40)[1].phi == one.phi
    assert motion.at([0.0, 1.0, 2.0]).theta.shape == (3,)
    assert motion.from_top == 0.1
    assert motion.from_bottom == pytest.approx(np.pi - motion.theta_max, rel=1e-15)
    assert ht.classify(BOOK, KICKED) == motion.verdict
    for late in (1e19, "1e40"):
        assert abs(motion.at(late, digits=20).theta - motion.at(late, 50).theta) < 1e-20
    with pytest.raises(NoClosedForm, match="ask for digits"):
        motion.at(1e30)
    for digits in (0, 10_001, "20"):
        with pytest.raises(ValueError, match="a whole number from 1 to 10000"):
            motion.at(1, digits=digits)
        with pytest.raises(HeavyTopError, match="digits"):
            motion.mpf("period", 10 * digits)
    for name, t, said in (("x", 1, "theta"), ("period", 1, "theta"), ("x", None, "period")):
        with pytest.raises(Impossible, match=f"name = .*one of .*{said}"):
            motion.interval(name, t)


# --- attitude, angular velocity and energy -------------------------------------------------------

NAMES = ("sicm-kicked", "lie-group-benchmark", "through-top", "inverted-gravity", "spin-reversal")


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("t", ["0", "1.81"])
def test_quaternion_omega_and_energy_hold_together(name, t):
    motion, exact = shipped(name), CTX.mpf(t)
    record = motion.at(exact, 50)
    q, omega = record.quaternion, record.omega
    size = max(map(abs, omega))
    axis = product(product(q, (0, 0, 0, 1)), (q[0], *(-x for x in q[1:])))[1:]
    assert max(abs(x - e) for x, e in zip(axis, record.axis, strict=True)) < 1e-45
    if name != "through-top" or exact:  # at the pole itself φ and ψ are of one side
        h = CTX.mpf(10) ** -12 / max(1, size)
        after, before = (motion.at(exact + s * h, 50).quaternion for s in (1, -1))
        spun = product((0, *omega), q)  # dq/dt = ω q / 2; differences are good to h²
        for x, y, z in zip(after, before, spun, strict=True):
            assert abs((x - y) / h - z) < 1e-20 * size
    A, C, gMR = (value.mpf(CTX) for value in (motion.top.A, motion.top.C, motion.top.gMR))
    along = sum(x * y for x, y in zip(omega, record.axis, strict=True))
    across = sum(x * x for x in omega) - along**2
    energy = A / 2 * across + C / 2 * along**2 + gMR * record.axis[2]
    assert abs(energy - record.energy) < 1e-40 * abs(record.energy)
    assert abs(along - record.omega3) < 1e-44 * abs(along)
    double, exact = motion.at(float(t)), motion.at(CTX.mpf(float(t)), 50)
    off = np.abs(double.quaternion - np.array(exact.quaternion, float)).max()
    assert off < 4e-15 * (1 + abs(float(exact.psi)) / 100)
    assert np.abs(double.omega - np.array(exact.omega, float)).max() < 1e-13 * float(size)
    assert double.energy == pytest.approx(float(exact.energy), rel=4e-16)


# --- rates, times and tilts far from 1 -----------------------------------------------------------


@pytest.mark.parametrize(("top", "start"), [
    (ht.Top(1, "0.5", "1e300"), ht.State("2.5", thetadot="0.1", phidot=3)),
    (ht.Top(1, "0.5", "1/3"), ht.State("pi/3", phidot="1e15", psidot="1e-16")),
])  # fmt: skip
def test_a_slow_rate_in_a_fast_motion_has_its_digits(top, start):
    """Digits count from max(1, |x|), not from the fastest rate."""
    record = ht.Motion(top, start).at(0, digits=30)
    for name in RATES:
        assert abs(getattr(record, name) - getattr(start, name).mpf(record.t.context)) < 1e-29


@pytest.mark.parametrize("off", [*map(ht.Exact.of, ("1e-290", "-1e-290"))], ids=str)
def test_no_threshold_decides_what_nutates(off):
    for top, start in (
        (CONE, ht.State("pi/3", thetadot=off, phidot=10, psidot="135.6")),
        (CONE, ht.State("pi/3", phidot=10 + off, psidot="135.6")),
        (MARGINAL, ht.State("pi/3", phidot="2/sqrt(3)", omega3=ht.Exact.of("2*sqrt(3)") + off)),
        (MARGINAL, ht.State(0, omega3=3, thetadot=off)),
        (ht.Top(2, 1, off), ht.State("pi/2", phidot=1)),
        (ht.Top(1, 1, off), ht.State("pi/2", psidot=10)),
    ):
        assert (motion := ht.Motion(top, start)).regime.name == "nutating"
    assert motion.precession == pytest.approx(float(off) * np.pi / 50, rel=1e-15, abs=0)


@pytest.mark.parametrize("tilt", ["1e-150", "1e-300"])
@pytest.mark.parametrize("below", [False, True])
def test_doubles_have_rates_where_the_distance_from_a_pole_is_too_small_for_one(tilt, below):
    theta, gMR = (f"pi - {tilt}", -1) if below else (tilt, 1)
    motion = ht.Motion(ht.Top(1, 1, gMR), ht.State(theta, phidot=2, omega3="1e-8"))
    for t in (0.0, 1.0):
        doubles, exact = motion.at(t), motion.at(t, digits=20)
        for name in ("theta", *RATES):
            assert getattr(doubles, name) == pytest.approx(float(getattr(exact, name)), rel=1e-13)


def test_an_angle_too_large_for_a_double_has_a_name():
    motion = ht.Motion(ht.Top(1, 1, 0), ht.State("pi/3", psidot="1e15"))
    with pytest.raises(NoClosedForm, match="digits"):
        motion.at(1e300).psi  # noqa: B018
    exact = motion.at(1e300, digits=20)
    assert abs(exact.psi / (10**15 * exact.t) - 1) < 1e-19


# --- intervals -----------------------------------------------------------------------------------

ONE = Interval(Fraction(1), Fraction(0))


NUMBERS = ("period", "precession", "spin", "relative_spin", "theta_min", "theta_max", "nearest",
           "tilts", "mean_rates", "lower_turning", "modulus", "growth", "amplitude",
           "roots")  # fmt: skip


def compare(motion, digits, more):
    """An interval has its digits and holds the number of more, to which the double is nearest.

    Angles, rates and turns have digits, tilts and vectors decimals.
    """
    bounds, form, pairs = Bounds(motion, digits), Digits(motion, more), []
    for t in (0, "1.3", -7.25, "1e5"):
        at = form(t)
        pairs += [(bounds(x, t), getattr(at, x)) for x in ("u", "theta", "phi", "psi", *RATES)]
        for name in ("axis", "quaternion"):
            pairs += zip(bounds(name, t), getattr(at, name), strict=True)
    for number in NUMBERS:
        found = [getattr(each, number) for each in (bounds, form, bounds.motion)]
        found = [each if isinstance(each, tuple) else (each,) for each in found]
        for interval, exact, double in zip(*found, strict=True):
            assert (interval is None) == (exact is None) == (double is None), number
            if exact is not None:
                pairs.append((interval, exact))
                assert double == pytest.approx(float(exact), rel=1e-16, abs=1e-45), number
    assert all(ball.digits >= digits and holds(ball, x, more - 5) for ball, x in pairs)


@pytest.mark.parametrize("digits", [15, 200])
@pytest.mark.parametrize("name", SCENES)
def test_every_shipped_scene(name, digits):
    compare(shipped(name), digits, digits + 50)


small = st.sampled_from([-5, -2, "-0.3", 0, "0.01", 1, 7])
moments = st.sampled_from([1, "0.5", "3.28e-4"]), st.sampled_from(["1e-6", "3.28e-4"])
tops = st.builds(ht.Top, *moments, st.sampled_from([1, "0.0456", -3, 0]))
angles = st.sampled_from([0, "pi", "pi/3", "pi/2", "0.1", "1.2", 3, "2*pi/3"])
rates = {"thetadot": small, "phidot": small | st.decimals(-50, 50, places=3)}
spins = small | st.integers(-(10**6), 10**6)
starts = st.builds(ht.State, angles, **rates, psidot=spins)
starts |= st.builds(ht.State, angles, **rates, omega3=spins)


@settings(max_examples=150, deadline=None)
@given(tops, starts, st.sampled_from([15, 50]))
def test_random_tops_on_and_off_the_poles(top, start, digits):
    compare(ht.Motion(top, start), digits, 100)


doubles = st.floats(-3, 3, allow_subnormal=False).filter(lambda x: abs(x) > 1e-3 or not x)


@settings(max_examples=100, deadline=None)
@given(st.tuples(*[doubles] * 3).filter(any), st.tuples(*[doubles] * 3), doubles, doubles)
def test_random_axes_of_any_length(e, l, g, kappa):  # noqa: E741
    compare(ClosedForm(AxisMotion(e, l, g, kappa)), 30, 100)


# --- where roots meet ----------------------------------------------------------------------------


def test_too_few_bits_name_what_is_known():
    start = ht.State(theta="pi/3", thetadot="1e-40", phidot=10, omega3="140.6")
    near = Bounds(ClosedForm(StartMotion(CONE, start)))
    near.motion.limit = 128
    for ask in (lambda: near.roots, lambda: near.period):
        with pytest.raises(Unseparated, match=r"u1 and u2 differ by less than .* 128") as refusal:
            ask()
        assert 1e-40 < refusal.value.bound < 1e-15
    late = Bounds(ClosedForm(StartMotion(BOOK, KICKED)))
    late.motion.limit = 96
    with pytest.raises(Unseparated, match=r"theta is known to .* with 96 bits"):
        late("theta", "1e15")


def test_what_cannot_be_proved_is_refused_by_name():
    """√cos²2 = −cos 2 is beyond the algebra of exact numbers."""
    nothing = sqrt(cos(2) ** 2) + cos(2)
    with pytest.raises(Unseparated, match=r"udot0 is less than .* with 4096 bits, and") as refusal:
        ht.Motion(CONE, ht.State(theta=1, thetadot=nothing, phidot=1)).interval("theta_min")
    assert 0 < refusal.value.bound < 1e-300


def test_proofs_on_binary_numbers():
    """|e| = 5: l ∥ e sleeps, l = (0, 1, 3) with g = 1/2 tends to the top, and so on."""

    def of_axis(*numbers):
        return Bounds(AxisMotion(*numbers))

    assert of_axis((0, 0, 5), (0, 0, 2.0), 1.0).roots[1] == ONE
    tending = of_axis((0, 3, 4), (0, 1, 3), 0.5)
    assert (tending.period, tending.roots[1:]) == (None, (ONE, ONE))
    for k in (0, 1):
        assert of_axis((0, 3, 4), (0, 1, 3), np.nextafter(0.5, k)).roots[1 + k] == ONE
    below = of_axis((0, 3, -4), (0, -1, 3), -0.5)
    assert below.roots[:2] == (Interval(Fraction(-1), Fraction(0)),) * 2


def test_heights_keep_their_own_digits_in_a_pass_through_a_pole():
    motion = ht.Motion(ht.Top("0.163", "0.037164", "0.088850568120709"), ht.State("pi - 1e-40"))
    few, many = (motion.at("0.501", digits).one_plus_u for digits in (30, 80))
    assert 0 < many < 1e-79
    assert abs(few / many - 1) < 1e-30


@pytest.mark.parametrize("tiny", [5e-324, Fraction(1, 10**400)])
def test_an_axis_may_be_nearer_to_a_pole_than_a_scene_says(tiny):
    """Runs of many digits pass poles so closely, and doubles are as small."""
    near, at = (Bounds(AxisMotion((0, x, 1), (x, 1, 3), 1)) for x in (tiny, 0))
    assert near("u", 1).mid == at("u", 1).mid
