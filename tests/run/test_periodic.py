"""Motions folded onto half a nutation, against the closed form up to 1e12 periods away."""

from copy import copy
from dataclasses import replace
from fractions import Fraction
from functools import cache

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import heavytop as ht
from heavytop.errors import BadScene, Impossible, NotANumber
from heavytop.integration import half_nutation
from heavytop.numbers import Exact
from heavytop.run import periodic
from heavytop.run.periodic import fold
from heavytop.scene.scene import shipped_scenes

from ..motions import BOOK, CONE

DIGITS = 60  # of the closed form
FAR = (0.0, 0.3, -0.7, 7.77, 1e3 + 0.1, 1e6 + 0.2, -1e6 - 0.4, 1e9 + 0.3, 1e12 + 0.45, -1e12 - 0.33)
NEVER = ("separatrix", "planar-asymptotic")


@cache
def motion(name):
    scene = ht.load_scene(name)
    return ht.Motion(scene.top, scene.start)


@cache
def shipped(name):
    return fold(ht.load_scene(name))


PERIODIC = [n for n in shipped_scenes() if n not in NEVER and motion(n).nutates]
STEADY = [n for n in shipped_scenes() if n not in NEVER and not motion(n).nutates]


def off(sample, exact, ctx):
    """Return the largest error of theta, axis, and phi and psi with all their turns."""
    turn = 2 * ctx.pi
    errors = [sample.theta - exact.theta]
    errors += [x - y for x, y in zip(sample.axis, exact.axis, strict=True)]
    for name in ("phi", "psi"):
        whole, rest = getattr(sample, f"{name}_turns"), getattr(sample, f"{name}_mod")
        errors.append(turn * int(whole) + ctx.mpf(rest) - getattr(exact, name))
        assert 0 <= rest <= turn * (1 + ctx.eps)  # which is rounded
    return max(abs(ctx.mpf(error)) for error in errors)


def one(many, i):
    names = many.__slots__
    return replace(many, **{name: getattr(many, name)[i] for name in names})


def worst(folded, truth, times=None):
    """Return the largest errors at far times: of arrays, of single times, of decimals."""
    period = float(folded.period or 1)
    times = [part * period for part in FAR] if times is None else times
    form = truth.form(DIGITS)
    many, found = folded(np.array(times)), [0.0, 0.0, 0.0]
    for i, t in enumerate(times):
        exact = form(t)
        three = (one(many, i), folded(t), folded.decimals(t))
        found = [max(x, off(y, exact, form.ctx)) for x, y in zip(found, three, strict=True)]
    return found


# --- against the closed form -----------------------------------------------------------------


@pytest.mark.parametrize("name", PERIODIC)
def test_a_million_million_periods_away(name):
    arrays, single, decimals = worst(shipped(name), motion(name))
    assert max(arrays, single) < 1e-14
    assert decimals < 1e-20


STEADY_STARTS = {name: (motion(name).top, motion(name).start) for name in STEADY} | {
    "turned": (BOOK, ht.State.steady(BOOK, "0.3", 140, phi=-100, psi=1000)),
    "upright": (BOOK, ht.State(0, phi=1, phidot=30, psi=-2, psidot=90)),
    "hanging, turned": (BOOK, ht.State("pi", phi=1, phidot=30, psi=-2, psidot=90)),
}


@pytest.mark.parametrize("which", STEADY_STARTS)
def test_trivial_where_nothing_nutates(which):
    """On the vertical phi stays what it is, and psi takes the whole spin."""
    top, start = STEADY_STARTS[which]
    folded = fold(ht.Scene(top, start, time=1))
    arrays, single, decimals = worst(folded, ht.Motion(top, start))
    assert max(arrays, single) < 1e-14
    assert decimals < 1e-20
    assert folded.period is folded.precession is folded.spin is None
    assert folded.cost.steps == 0


RATES = ["sicm-kicked", "lie-group-benchmark", "through-top", "steady-betsch", "sleeping"]


@pytest.mark.parametrize("name", RATES)
def test_rates_attitude_and_angular_velocity(name):
    folded, form = shipped(name), motion(name).form(DIGITS)
    for t in (0.1, 123.4, -1e9):
        mine, exact = folded(t), form(t)
        for value in ("thetadot", "phidot", "psidot", "omega"):
            true = np.array(getattr(exact, value), dtype=float)
            assert getattr(mine, value) == pytest.approx(true, rel=1e-13, abs=1e-12)
        true = np.array(exact.quaternion, dtype=float)
        assert mine.quaternion * np.sign(mine.quaternion @ true) == pytest.approx(true, abs=2e-15)


@pytest.mark.parametrize(
    ("span", "end"), [("time=1000000000.1", None), ("periods=1000000000000.25", "1000000000000.25")]
)
def test_the_end_is_the_exact_decimal(span, end):
    """A thousand million seconds and a tenth are 2e-8 s from the nearest double."""
    folded = fold(ht.load_scene("sicm-kicked", [f"span.{span}"]))
    form = motion("sicm-kicked").form(DIGITS)
    exact = form(form.period * form.ctx.mpf(end) if end else Exact.of("1000000000.1"))
    assert off(folded.end, exact, form.ctx) < 1e-14
    if not end:
        assert off(folded.decimals(Fraction(10_000_000_001, 10)), exact, form.ctx) < 1e-20
        assert off(folded(1000000000.1), exact, form.ctx) > 1e-8


@pytest.mark.parametrize(
    ("name", "digits", "bits", "t"),
    [("sicm-kicked", 50, 256, "543210987654.3"), ("simo-wong", 400, 1408, "123456789.1")],
)
def test_many_digits(name, digits, bits, t):
    """At 400 a step could pass several turning points, if it were allowed to."""
    folded, form = fold(ht.load_scene(name), digits=digits), motion(name).form(digits + 40)
    assert off(folded.decimals(t), form(t), form.ctx) < form.ctx.mpf(10) ** -digits
    assert folded.cost.bits == bits


# --- planted errors ----------------------------------------------------------------------------


# --- every kind of start -------------------------------------------------------------------------


STARTS = {
    "turning but for 1e-100": (
        BOOK, {"theta": "0.1", "thetadot": "-1e-100", "phidot": -15, "psidot": 140}
    ),
    **{
        f"pole {pole} at {rate}": (BOOK, {"theta": pole, "thetadot": rate, "omega3": spin})
        for pole in ("0", "pi")
        for rate, spin in ((10, 140), (-10, 140), (30, 0))
    },
    "beside the top": (BOOK, {"theta": "1e-15", "thetadot": 10, "omega3": 140}),
    "beside the bottom": (BOOK, {"theta": "pi - 1e-15", "thetadot": -10, "omega3": 140}),
    "tilted by 1e-10": (BOOK, {"theta": "1e-10", "omega3": 140}),
    "steady but for 1e-40": (
        CONE, {"theta": "pi/3", "phidot": 10, "thetadot": "1e-40", "psidot": "135.6"}
    ),
    "large angles": (
        BOOK, {"theta": "0.1", "phidot": -15, "psidot": 140, "phi": "1e17", "psi": "-1e18"}
    ),
}  # fmt: skip


@pytest.mark.parametrize("which", STARTS)
def test_every_kind_of_start(which):
    top, start = STARTS[which][0], ht.State(**STARTS[which][1])
    folded = fold(ht.Scene(top, start, time=1))
    times = [part * float(folded.period) for part in (0.0, 0.3, -0.7, 7.77, 1e12 + 0.45)]
    arrays, single, decimals = worst(folded, ht.Motion(top, start), times)
    assert max(arrays, single) < 1e-14
    assert decimals < 1e-16


rate = st.integers(-400, 400).map(lambda n: Fraction(n, 100))
size = st.integers(1, 199).map(lambda n: Fraction(n, 100))


@given(C=size, gMR=rate, theta=size.map(lambda x: x * Fraction(3, 2)), rates=st.tuples(*[rate] * 3))
@settings(max_examples=15, deadline=None)
def test_tops_drawn_at_random(C, gMR, theta, rates):
    thetadot, phidot, psidot = rates
    start = ht.State(theta, thetadot=thetadot, phidot=phidot, psidot=psidot)
    truth = ht.Motion(top := ht.Top(1, C, gMR), start)
    if truth.regime != "asymptotic":
        assert max(worst(fold(ht.Scene(top, start, time=1)), truth)) < 1e-13


PASSES = [("through-top", 0, -np.pi), ("through-bottom", 0, np.pi), ("planar-rotating", 1, -np.pi)]


@pytest.mark.parametrize(("name", "half", "jump"), PASSES)
@pytest.mark.parametrize("ask", ["__call__", "decimals"])
def test_an_exact_pass_through_a_pole(name, half, jump, ask):
    """phi jumps by pi, forward in time; psi back at the top, and forward at the bottom."""
    folded, course = shipped(name), shipped(name).course
    for n in (0, 1, -3):
        pole = course.first + (2 * n + half) * course.half
        around = (pole + dt * course.ctx.mpf("1e-9") for dt in (-1, 0, 1))
        before, at, after = (getattr(folded, ask)(t) for t in around)
        for angle, expected in (("phi", np.pi), ("psi", jump)):
            past, here = (getattr(after, angle) - getattr(x, angle) for x in (before, at))
            assert [float(past), float(here)] == pytest.approx([expected, 0], abs=1e-6)
        for rate in ("thetadot", "phidot", "psidot"):
            later = float(getattr(after, rate))
            assert float(getattr(at, rate)) == pytest.approx(later, rel=1e-6, abs=1e-6)
        assert float(at.theta) == pytest.approx(0 if jump < 0 else np.pi, abs=1e-12)
        assert float(at.axis[2]) == pytest.approx(1 if jump < 0 else -1, abs=1e-12)
        both = zip(before.quaternion, after.quaternion, strict=True)
        assert max(abs(float(x - y)) for x, y in both) < 1e-6


def beside_the_top(miss):
    """Return a start that comes so close to the top [s^-1 of P_minus], from half-way down."""
    phidot = 1 + Exact.of(miss)  # with 1 it would pass through it
    return ht.Top(1, "0.5", 1), ht.State("pi/3", thetadot="3.3", phidot=phidot, omega3=3)


def test_in_the_middle_of_a_close_pass():
    """A million million periods away, where phi turns by a radian in 1e-21 s."""
    top, start = beside_the_top("1e-20")
    folded, form = fold(ht.Scene(top, start, time=1)), ht.Motion(top, start).form(100)
    for n in (3, 10**12):
        middle = form.lower_turning + (n + form.ctx.mpf(0.5)) * form.period
        for later in ("0", "1e-21", "-3e-21", "1e-19"):
            t = middle + form.ctx.mpf(later)
            exact = form(t)
            assert float(exact.theta) < 1e-18
            assert off(folded(t), exact, form.ctx) < 1e-14
            assert off(folded.decimals(t), exact, form.ctx) < 1e-16
            assert off(one(folded([float(t)]), 0), form(float(t)), form.ctx) < 1e-14
    assert abs(form(middle + form.ctx.mpf("1e-21")).phi - form(middle).phi) > 0.1


# --- what it takes, and what is refused ----------------------------------------------------------


def test_the_bits_follow_from_what_is_hard_to_tell():
    easy, near = shipped("sicm-kicked"), shipped("near-separatrix")
    assert (easy.cost.bits, near.cost.bits) == (128, 192)
    far = fold(ht.load_scene("sicm-kicked", ["span.periods=5e14"]))
    assert far.reach > 5e14 * float(far.period) > easy.reach
    assert all(x.cost.closure < 1e-30 for x in (easy, near, far))


def test_as_many_half_periods_as_are_counted():
    """Where rounding takes one beside the nearest."""
    folded = fold(ht.load_scene("sicm-kicked", ["span.periods=5.6e14"]))
    times = np.random.default_rng(5).uniform(-5.6e14, 5.6e14, 1000) * float(folded.period)
    many = folded(times)
    for i, t in enumerate(times.tolist()):
        assert one(many, i).quaternion == pytest.approx(folded(t).quaternion, abs=1e-14)
    assert max(worst(folded, motion("sicm-kicked"), times[:5])[:2]) < 1e-14


TURNS = "at most .* turns are not counted"
UNPROVED = ht.Scene(ht.Top(1, 1, 1), ht.State("sqrt(3+2*sqrt(2))-1-sqrt(2)", psidot=1), time=1)


@pytest.mark.parametrize(
    ("name", "override", "message"),
    [
        ("sicm-kicked", "span.periods=1e17", rf"span\.periods = 1e17: {TURNS}"),
        ("steady-betsch", "span.time=1e20", rf"span\.time = 1e20: {TURNS}"),
        ("steady-betsch", "span.periods=3", "no nutation period to count"),
        ("sicm-kicked", "start.phi=1e20", rf"start\.phi = 1e20: {TURNS}"),
        *((name, "span.time=1", "never comes back: there is no") for name in NEVER),
    ],
)
def test_what_cannot_be_folded_is_refused(name, override, message):
    with pytest.raises(BadScene, match=message):
        fold(ht.load_scene(name, [override]))


def test_what_is_not_proved_or_beyond_doubles_is_refused():
    with pytest.raises(BadScene, match="not proved to nutate"):
        fold(UNPROVED)  # a tilt that is zero, and not proved to be
    for rate in ("1e-200", "1e200"):
        start = ht.State("0.5", phidot=rate, omega3=0)
        with pytest.raises(BadScene, match="beyond the range of doubles"):
            fold(ht.Scene(ht.Top(1, "0.5", 0), start, time=1))


TOO_LONG = [
    ("sicm-kicked", half_nutation, "MOST_STEPS", 3, "no turning point in 3 steps"),
    ("near-separatrix", periodic, "MOST_BITS", 128, "takes 192 bits, and 128 are the most"),
]


@pytest.mark.parametrize(("name", "module", "limit", "most", "said"), TOO_LONG)
def test_what_takes_too_long_is_refused(name, module, limit, most, said, monkeypatch):
    monkeypatch.setattr(module, limit, most)
    with pytest.raises(BadScene, match=said):
        fold(ht.load_scene(name))


@pytest.mark.parametrize("name", ["sicm-kicked", "steady-betsch"])
def test_times_that_are_refused(name):
    for wrong in ("soon", None, np.nan, [[1.0]], ["1"], [2**53 + 1], 1j):
        with pytest.raises(NotANumber):
            shipped(name)(wrong)
    for ask, far in (
        (shipped(name), "-1e30"),
        (shipped(name), [0, 1e30]),
        (shipped(name).decimals, 1e30),
    ):
        with pytest.raises(Impossible, match=r"at most .* s from the start"):
            ask(far)


# --- the parts -----------------------------------------------------------------------------------


def test_a_little_less_than_a_turn_is_a_turn():
    folded = fold(ht.Scene(BOOK, ht.State("pi", phi="-1e-20", psidot=90), time=1))
    for sample in (folded(0.0), one(folded([0.0]), 0)):
        assert (sample.phi_turns, sample.phi_mod) == (0, 0.0)


@pytest.mark.parametrize(("digits", "bits"), [(16, 128), (36, 192)])
def test_the_second_swing_measures_the_error(digits, bits):
    """It differs from the first by about as much as the first is off, and that is rounding."""
    folded = fold(ht.load_scene("sicm-dropped"), digits)
    true = motion("sicm-dropped").form(DIGITS + 20).period
    assert folded.cost.bits == bits
    assert 2.0**-bits < folded.cost.closure < 2.0 ** (10 - bits)
    assert 0 < abs(folded.period / true - 1) < 2 * folded.cost.closure


def test_what_is_planted_is_seen():
    """A period that is a double, a turn that is lost, a start that is off by a double."""
    folded = shipped("sicm-kicked")
    course = folded.course
    phi, psi = course.nutation.turned
    lost = course.ctx.nstr(course.ctx.mpf(phi) + 2 * course.ctx.pi, course.ctx.dps)
    half = str(float(course.half))
    plants = {"half": (half, 1e-5), "turned": ((lost, psi), 6), "first": ("1e-15", 1e-15)}
    for name, (wrong, least) in plants.items():
        nutation = copy(course.nutation)
        setattr(nutation, name, wrong)
        own = (course.ctx, nutation, (course.ctx.zero, course.ctx.zero), course.constants)
        off_by = worst(replace(folded, course=type(course)(*own)), motion("sicm-kicked"))
        assert min(off_by) > least
