"""The closed form in doubles against the closed form in balls, at the very same numbers.

A ball holds the true value, so that what is asked of doubles is asked of the truth itself.
"""

from fractions import Fraction

import numpy as np
import pytest
from flint import arb
from hypothesis import example, given, settings
from hypothesis import strategies as st

import heavytop as ht
from heavytop.analytic import doubles
from heavytop.analytic.doubles import FARTHEST, TIMES_AT_ONCE
from heavytop.analytic.motion import ClosedForm
from heavytop.classification.reduced import AxisMotion
from heavytop.errors import NoClosedForm, NotANumber
from heavytop.exact.balls import working

from ..motions import FURTHER, MOTIONS, named, shipped
from .test_form import PARTS, every_motion, near

ANGLES, FEW, BITS = 1e-15, 4e-15, 400
RATES = ("thetadot", "phidot", "psidot", "udot", "uddot")


def distance(got, want, circle=False):
    with working(BITS):
        difference, turn = arb(float(got)) - want, 2 * arb.pi()
        if circle:
            difference -= turn * ((difference / turn).mid() + arb(0.5)).floor()
        return abs(float(difference))


def assert_holds(motion, times, digits=60):
    """θ to 1e-15 and 1 ∓ u to 2e-15 of themselves, zeros to 1e-29; φ, ψ to 1e-15 max(1, |x|).

    Modulo 2π, and of the axis, to 4e-15; rates beside the fastest.
    """
    double = motion.at(np.array(times))
    for i, t in enumerate(times):
        at = motion.reader(t, digits)
        for name in ("theta", "phi", "psi", "one_minus_u", "one_plus_u"):
            size = abs(float(at(name)))
            bound = max((1 if name == "theta" else 2) * ANGLES * size, 1e-29)
            bound = ANGLES * max(1, size) if name in ("phi", "psi") else bound
            assert distance(getattr(double, name)[i], at(name)) <= bound, name
        for name in ("phi", "psi"):
            far = abs(float(at(name))) > 1e12
            assert far or distance(getattr(double, f"{name}_mod")[i], at(name), circle=True) < FEW
        assert max(map(distance, double.axis[i], at("axis"))) < FEW
        for name in RATES if abs(t) < 10 else ():
            scale = max(1, motion.rate) ** (2 if name == "uddot" else 1)
            bound = FEW * max(scale, abs(float(at(name))))
            assert distance(getattr(double, name)[i], at(name)) < bound, name


@pytest.mark.parametrize("name", [*MOTIONS, *FURTHER])
def test_near_the_start_and_many_periods_away(name):
    """θ, φ and ψ modulo 2π and the axis keep their digits, close to the most periods there may be.

    Of uniform precession φ modulo 2π is known to 2e-15 where φ itself has 1e-8.
    """
    motion = named(name)
    assert_holds(motion, [0.0, 1e-9, *np.linspace(-2.1, 2.3, 23)])
    if "separatrix" in name:
        return
    periods = (1e7 / 3, -1e6) if name == "uniform" else (1e6 / 3, -1e6, -1.9e9, 2.1e9 + 0.25)
    assert_holds(motion, [part * (motion.period or 1.0) for part in periods])


@every_motion
def test_next_to_special_motions(name, e):
    """Where roots of the cubic meet: a start is exact, and nothing is ill-posed."""
    motion = near(e)[name]
    lower, T = (motion.ball(each, 60) for each in ("lower_turning", "period"))
    times = [float(lower + T * arb(part)) for part in PARTS]
    assert_holds(motion, [*times, motion.period * 7 / 3, 0.0, 1e-3, -0.3, 2.0], digits=360)


def of_a_scene(x):
    """Whether a scene may have such a number."""
    return x == 0 or abs(x) >= 1e-300


reals = st.floats(-8, 8).filter(of_a_scene)


@settings(max_examples=150, deadline=None)
@example(1, 0.0, 1.0, 1.0, 0.0, 6.5e-235, -1.0)
@example(1, 1.0, 0.0, 3.2e-101, 0.0, 0.0, 1.0)
@example(1, 1.0, 0.0, 3.2e-36, 0.0, 0.0, 1.0)
@example(1, 5.0, 0.0, 4e-46, 0.0, 0.0, 35.0)
@given(
    C=st.floats(0.01, 2), gMR=reals, theta=st.floats(0, 3.14159).filter(of_a_scene),
    thetadot=reals, phidot=reals, psidot=reals, t=st.floats(-50, 50),
)  # fmt: skip
def test_any_top(C, gMR, theta, thetadot, phidot, psidot, t):
    """Whatever the numbers (poles, no weight, no motion): finite, on the sphere, and right.

    θ to 1e-15 of itself, however small, φ and ψ to 1e-15 max(1, |x|); θ below 1e-14 to 1e-29: on
    which side of an exact pass a time lies is told to 1e-30 of a period. Start and time are the
    very doubles; of numbers below 1e-20 that φ follows, 1e-13 of the axis is asked.
    """
    start = ht.State(theta, thetadot=thetadot, phidot=phidot, psidot=psidot)
    motion = ht.Motion(ht.Top(1, C, gMR), start)
    double, at = motion.at([t]), motion.reader(t, 330)
    for name in ("theta", "phi", "psi", *RATES):
        assert np.all(np.isfinite(getattr(double, name))), name
    assert abs(np.linalg.norm(double.axis) - 1) < 1e-15
    assert distance(double.theta[0], at("theta")) < 1e-13
    assert max(map(distance, double.axis[0], at("axis"))) < 1e-13
    if all(x == 0 or abs(x) >= 1e-20 for x in (gMR, theta, thetadot, phidot, psidot, t)):
        for name in ("theta", "phi", "psi"):
            size = abs(float(at(name)))
            bound = max(1e-15 * size, 1e-29) if name == "theta" else 1e-15 * (1 + size)
            assert distance(getattr(double, name)[0], at(name)) <= bound, name


def test_a_close_pass_with_the_low_word_of_time():
    """Within 1e-7 rad of the pole φ turns at 9e6 rad/s, and t + t_lo still has all its digits."""
    motion = named("lie")
    for offset in ("1e-12", "-3e-9", "1e-7"):
        with working(BITS):
            lower, T = (motion.ball(name, 100) for name in ("lower_turning", "period"))
            t = lower + 40 * T + arb(offset)
            hi, lo = float(t), float(t - float(t))
            at, got = motion.reader(Fraction(hi) + Fraction(lo), 60), motion.at([hi], t_lo=[lo])
            assert abs(at("phidot")) > 1e6
            assert abs(arb(got.one_plus_u[0]) / at("one_plus_u") - 1) < 1e-14
        assert distance(got.phi[0], at("phi")) <= ANGLES * abs(float(at("phi")))
        assert distance(got.phi_mod[0], at("phi"), circle=True) < FEW


@pytest.mark.parametrize("t", [1e-6, -1e-4, 1e-2])
@pytest.mark.parametrize("name", ["dropped", "past the top"])
def test_phi_just_after_a_cusp(name, t):
    """φ grows as t³ from a cusp, 7e-16 rad after 1e-6 s: large terms cancel to 2e-16."""
    motion = named(name)
    for angle in ("phi", "psi"):
        want = motion.reader(t, 60)(angle)
        assert distance(getattr(motion.at(t), angle), want) <= 2.5e-16 * max(1, abs(float(want)))


# --- shapes, parts, speed, and what is refused ---------------------------------------------------

OUTCOMES = (
    "theta", "phi", "psi", "phi_mod", "psi_mod", *RATES, "u", "one_minus_u", "one_plus_u", "axis",
    "quaternion", "omega", "omega3",
)  # fmt: skip
FAMILIES = ("kicked", "lie", "hanging upside down", "separatrix", "uniform", "at rest")


@pytest.mark.parametrize("name", FAMILIES)
def test_times_are_cut_anyhow(name):
    """Bit for bit, with and without low words of time."""
    motion, source = named(name), np.random.default_rng(3)
    t = source.uniform(-30, 30, 3 * TIMES_AT_ONCE + 17)
    low = t * source.uniform(-1e-17, 1e-17, t.size)
    part = slice(TIMES_AT_ONCE - 3, TIMES_AT_ONCE + 9)
    whole, some = motion.at(t, t_lo=low), motion.at(t[part], t_lo=low[part])
    for name in ("t", "energy", *OUTCOMES):
        np.testing.assert_array_equal(getattr(whole, name)[part], getattr(some, name), name)


def test_a_record_shows_where_the_top_is():
    at = shipped("sicm-kicked").at(2.0)
    assert repr(at) == f"<Record: t={at.t}, theta={at.theta}, phi={at.phi}, psi={at.psi}>"


def test_times_that_are_none():
    motion = named("kicked")
    for bad in (([np.nan],), ([0.0], [np.inf]), ("x",), (None,), (1.0, 1j), (10**400,)):
        with pytest.raises(NotANumber):
            motion.at(bad[0], t_lo=bad[1] if len(bad) > 1 else 0.0)
    for t in (motion.period * FARTHEST * 1.01, 1e308):
        with pytest.raises(NoClosedForm, match="periods"):
            motion.at([t])


def test_an_axis_longer_by_an_ulp():
    """The axis form's own binary start, |e|² ≠ 1: the closed form is that of those numbers."""
    e, l = (0.09983341664682815, 0.0, 0.9950041652780259), (3.0, -0.5, 28.0)  # noqa: E741
    assert sum(Fraction(x) ** 2 for x in e) != 1
    motion = ClosedForm(AxisMotion(e, l, 139.02439024390245, phi0=0.25))
    assert_holds(motion, [-1.0, 0.1, 3.0, 1000.0])


@pytest.mark.parametrize("name", FAMILIES)
def test_late_times_are_those_of_many_digits(name, monkeypatch):
    """Beyond MOST_PERIODS in balls, before it in doubles; either is right about the border."""
    motion = named(name)
    near = np.linspace(-1e6, 1e6, 7) * (motion.period or 1)
    early = motion.at(near).axis
    monkeypatch.setattr(doubles, "MOST_PERIODS", 1000)
    np.testing.assert_allclose(motion.at(near).axis, early, rtol=0, atol=1e-13)
    t = 1e15 * (motion.period or 1)
    exact, found = motion.at(t, 60), motion.at([t])
    assert found.theta[0] == pytest.approx(float(exact.theta), abs=1e-15)
    off = found.phi_mod[0] - float(exact.phi % (2 * exact.phi.context.pi))
    assert abs(np.sin(off / 2)) < 1e-14
