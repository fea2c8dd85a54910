"""The closed form in doubles against the closed form in balls, at the very same numbers.

A ball holds the true value, so that what is asked of doubles is asked of the truth itself.
"""

import random
import time
from dataclasses import fields
from fractions import Fraction

import mpmath
import numpy as np
import pytest
from flint import arb
from hypothesis import example, given, settings
from hypothesis import strategies as st

import heavytop as ht
from heavytop.analytic.many_times import CHUNK, MOST_PERIODS, DoubleForm
from heavytop.analytic.rising import Rising
from heavytop.classification.reduced import FromAxis, FromScene
from heavytop.errors import NoClosedForm, NotANumber
from heavytop.numbers.intervals import working

from ..motions import SCENES, named, shipped

ANGLES = 1e-15
FEW = 4e-15
BITS = 400


def rising_of(name):
    """A motion by name, its kind not proved."""
    begun = named(name)
    return Rising(FromScene(begun.top, begun.start), proved=False)


def start(top, theta, phidot, psidot, thetadot=0):
    rates = {"thetadot": thetadot, "phidot": phidot, "psidot": psidot}
    return Rising(FromScene(ht.Top(*top), ht.State(theta, **rates)), proved=False)


def exact(rising, t, digits=60):
    """The record in balls, its angles known to so many digits."""
    time = t if isinstance(t, arb) else arb(float(t))
    return rising.settled(
        "the truth",
        lambda found, bits: found.at(time),
        digits,
        of=lambda at: (at.theta, at.phi, at.psi),
    )


def solution(rising, name, bits=BITS):
    """A constant of the motion, as a ball."""
    with working(bits):
        return getattr(rising.solution(bits), name)


NAMES = (
    "kicked", "dropped", "lie", "rising", "falling", "hanging upside down", "force-free",
    "spherical pendulum", "1e-3 past the bottom", "past the top", "1e-9 off uniform",
    "through the top", "through the top, upside down", "planar swing", "planar rotation, backwards",
    "sleeping", "at rest", "uniform", "separatrix", "separatrix, leaving",
    "separatrix, upside down",
)  # fmt: skip
REPEATING = [n for n in NAMES if "separatrix" not in n and n != "uniform"]


def apart(got, want, circle=False):
    with working(BITS):
        difference, turn = arb(float(got)) - want, 2 * arb.pi()
        if circle:
            difference -= turn * ((difference / turn).mid() + arb(0.5)).floor()
        return abs(float(difference))


def worst(rising, times, form=None):
    """Largest error of each angle relative to max(1, |x|), of the rest absolute."""
    double = (form or DoubleForm(rising))(np.array(times))
    errors = dict.fromkeys(("theta", "phi", "psi", "phi_mod", "psi_mod", "axis"), 0)
    for i, t in enumerate(times):
        at = exact(rising, t)
        for name in ("theta", "phi", "psi"):
            want = getattr(at, name)
            error = apart(getattr(double, name)[i], want) / max(1, abs(float(want)))
            errors[name] = max(errors[name], error)
        for name in ("phi", "psi"):
            error = apart(getattr(double, name + "_mod")[i], getattr(at, name), circle=True)
            errors[name + "_mod"] = max(errors[name + "_mod"], error)
        for j in range(3):
            errors["axis"] = max(errors["axis"], apart(double.axis[i, j], at.axis[j]))
    return errors


def holds(errors):
    return (
        max(errors[name] for name in ("theta", "phi", "psi")) <= ANGLES
        and max(errors.values()) < FEW
    )


@pytest.mark.parametrize("name", NAMES)
def test_near_their_start(name):
    """θ, φ, ψ and the axis to a few units in the last place over both directions of time."""
    errors = worst(rising_of(name), [0.0, 1e-9, *np.linspace(-2.1, 2.3, 23)])
    assert holds(errors), errors


@pytest.mark.parametrize(
    ("name", "periods"),
    [(n, (1e6 / 3, -1e6 / 7, 999999.5, -1e6)) for n in REPEATING]
    + [(n, (2e9 / 3, -1.9e9, 2.1e9 + 0.25)) for n in ("kicked", "lie", "past the top")]
    + [("uniform", (1e7 / 3, -1e6))],
)
def test_many_periods_away(name, periods):
    """θ, φ and ψ modulo 2π and the axis keep their digits, close to the most periods there may be.

    Of uniform precession φ modulo 2π is known to 2e-15 where φ itself has 1e-8.
    """
    form = DoubleForm(rising_of(name))
    errors = worst(form.rising, [s * (form.period or 1.0) for s in periods], form)
    assert holds(errors), errors


@pytest.mark.parametrize("name", NAMES)
def test_a_time_may_be_split_anyhow(name):
    """The low word is part of the time: any split of the same time is the same place."""
    form, t = DoubleForm(rising_of(name)), np.array([-3.0, -0.75, 0.5, 1.25, 16.0])
    whole = form(t)
    for share in (0.25, 1.0):
        parts = form(t * (1 - share), t * share)
        for angle in ("theta", "phi", "psi"):
            np.testing.assert_allclose(
                getattr(parts, angle), getattr(whole, angle), rtol=1e-15, atol=1e-29
            )


@pytest.mark.parametrize("name", ["uniform", "kicked", "separatrix"])
def test_the_low_word_counts_far_away(name):
    """Nearly half a unit of t = 1e7 s turns φ and ψ by 1e-7 rad, which φ and ψ modulo 2π show."""
    form, t, low = DoubleForm(rising_of(name)), 1e7, 0.49 * np.spacing(1e7)
    with working(BITS):
        at = exact(form.rising, arb(t) + arb(low))
    got = form(t, low)
    for angle in ("phi", "psi"):
        assert apart(getattr(got, angle + "_mod"), getattr(at, angle), circle=True) < FEW
        moved = abs(getattr(got, angle + "_mod") - getattr(form(t), angle + "_mod"))
        assert moved > 1e-10


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
    rising = start((1, C, gMR), theta, phidot, psidot, thetadot=thetadot)
    double, at = DoubleForm(rising)([t]), exact(rising, t, 330)
    for name in ("theta", "phi", "psi", "thetadot", "phidot", "psidot", "udot", "uddot"):
        assert np.all(np.isfinite(getattr(double, name))), name
    assert abs(np.linalg.norm(double.axis) - 1) < 1e-15
    assert apart(double.theta[0], at.theta) < 1e-13
    assert max(apart(*pair) for pair in zip(double.axis[0], at.axis, strict=True)) < 1e-13
    if all(x == 0 or abs(x) >= 1e-20 for x in (gMR, theta, thetadot, phidot, psidot, t)):
        for name in ("theta", "phi", "psi"):
            size = abs(float(getattr(at, name)))
            bound = max(1e-15 * size, 1e-29) if name == "theta" else 1e-15 * (1 + size)
            assert apart(getattr(double, name)[0], getattr(at, name)) <= bound, name


def test_random_tops_far_away():
    """Tops drawn over two decades of weight and all tilts, up to 1e6 s."""
    draw = random.Random(7)
    for _ in range(30):
        A = draw.uniform(0.1, 10)
        gMR = draw.uniform(-1, 1) * 10 ** draw.uniform(-2, 2)
        rising = start(
            (A, draw.uniform(0.01, 2) * A, gMR), draw.uniform(0.01, 3.1), draw.uniform(-5, 5),
            draw.uniform(-20, 20), thetadot=draw.choice([0, draw.uniform(-3, 3)]),
        )  # fmt: skip
        times = [draw.uniform(-1, 1) * 10 ** draw.uniform(-2, 6) for _ in range(5)]
        errors = worst(rising, times)
        assert holds(errors), (rising.source, errors)


@pytest.mark.parametrize("name", SCENES)
def test_shipped_scenes_over_their_whole_span(name):
    """θ, 1 ∓ u to 2e-15 of themselves, zeros to 1e-29; φ, ψ to 1e-15 max(1, |x|); 401 times."""
    scene, motion = ht.load_scene(name), shipped(name)
    end = float(scene.time) if scene.time else float(scene.periods) * motion.period
    t = np.linspace(0.0, end, 401)
    double = motion.at(t)
    with working(BITS):
        records = [motion.rising.solution(BITS).at(arb(x)) for x in t]
        for quantity in ("theta", "phi", "psi", "one_minus_u", "one_plus_u"):
            want = [getattr(record, quantity) for record in records]
            assert all(x.rad() < 1e-40 for x in want)
            values = getattr(double, quantity)
            error = [abs(float(arb(x) - y)) for x, y in zip(values, want, strict=True)]
            size = np.abs([float(x) for x in want])
            allowed = np.maximum(2e-15 * size, 1e-29)
            if quantity in ("phi", "psi"):
                allowed = 1e-15 * np.maximum(1, size)
            assert np.all(error <= allowed), quantity


def test_a_close_pass_with_the_low_word_of_time():
    """Within 1e-7 rad of the pole φ turns at 9e6 rad/s, and t + t_lo still has all its digits."""
    rising = rising_of("lie")
    form = DoubleForm(rising)
    for offset in ("1e-12", "-3e-9", "2e-8", "1e-7"):
        with working(BITS):
            found = rising.solution(BITS)
            t = found.lower_turning + 40 * found.path.period + arb(offset)
            hi = float(t)
            lo = float(t - hi)
            at, got = exact(rising, arb(hi) + arb(lo)), form([hi], [lo])
            assert abs(at.phidot) > 1e6
            assert abs(arb(got.one_plus_u[0]) / at.one_plus_u - 1) < 1e-14
        assert apart(got.phi[0], at.phi) <= ANGLES * abs(float(at.phi))
        assert apart(got.phi_mod[0], at.phi, circle=True) < FEW


@pytest.mark.parametrize("name", NAMES)
def test_rates(name):
    """θ̇, φ̇, ψ̇, u̇ against the balls; ü against ½ f'(u)."""
    rising, times = rising_of(name), np.linspace(-1.9, 2.2, 17)
    double, r = DoubleForm(rising)(times), solution(rising, "start")
    g, b, h, a = (float(x) for x in (r.g, r.b, r.kinetic0 + r.g * r.u0, r.drift0 + r.b * r.u0))
    scale = abs(g) + abs(h) + a * a + b * b
    u = double.u
    half = -g * (1 - u * u) - 2 * u * (h - g * u) + b * (a - b * u)
    assert np.max(abs(double.uddot - half)) <= 1e-14 * scale
    for i, t in enumerate(times):
        at = exact(rising, t)
        for rate in ("thetadot", "phidot", "psidot", "udot"):
            want = getattr(at, rate)
            size = max(1, abs(float(want)), scale**0.5)
            assert apart(getattr(double, rate)[i], want) < FEW * size, rate


def test_by_quadrature():
    """φ(t) is the integral of φ̇ = (a − b cos θ)/sin² θ over θ(t), by mpmath's own sn and quad."""
    form, ctx = DoubleForm(rising_of("rising")), mpmath.MPContext()
    ctx.dps = 20
    A, C, gMR, theta, phidot, psidot, thetadot = map(ctx.mpf, (2, 1, 3, 1.5, 0.5, 3, -1))
    u, sin2 = ctx.cos(theta), ctx.sin(theta) ** 2
    b, g = C * (psidot + phidot * u) / A, gMR / A
    a, h = phidot * sin2 + b * u, (thetadot**2 + phidot**2 * sin2) / 2 + g * u
    u1, u2, u3 = sorted(ctx.polyroots([2 * g, -(2 * h + b * b), 2 * a * b - 2 * g, 2 * h - a * a]))
    w, m = ctx.sqrt(g * (u3 - u1) / 2), (u2 - u1) / (u3 - u1)
    x0 = ctx.ellipf(ctx.asin(ctx.sqrt((u - u1) / (u2 - u1))), m)

    def height(t):
        return u1 + (u2 - u1) * ctx.ellipfun("sn", w * t + x0, m=m) ** 2

    def turn(s):
        return (a - b * height(s)) / (1 - height(s) ** 2)

    for t in (0.7, -1.9):
        points = [ctx.mpf(t) * k / 4 for k in range(5)]
        turned = ctx.quad(turn, points)
        spun = (psidot + phidot * u) * t - ctx.quad(lambda s: turn(s) * height(s), points)
        at = form(t)
        assert abs(ctx.mpf(float(at.theta)) - ctx.acos(height(ctx.mpf(t)))) < ANGLES
        off = ctx.mpf(float(at.phi)) - ctx.mpf("0.3") - turned
        assert abs(off) <= ANGLES * max(1, abs(at.phi))
        off = ctx.mpf(float(at.psi)) + ctx.mpf("0.7") - spun
        assert abs(off) <= ANGLES * max(1, abs(at.psi))


@pytest.mark.parametrize("t", [1e-6, 1e-5, 1e-4, 1e-3, 1e-2])
@pytest.mark.parametrize("name", ["dropped", "past the top"])
def test_phi_just_after_a_cusp(name, t):
    """φ grows as t³ from a cusp, 7e-16 rad after 1e-6 s: large terms cancel to 2e-16."""
    form = DoubleForm(rising_of(name))
    for sign in (1, -1):
        want = exact(form.rising, sign * t)
        for angle in ("phi", "psi"):
            got, x = getattr(form(sign * t), angle), getattr(want, angle)
            assert apart(got, x) <= 2.5e-16 * max(1, abs(float(x)))


# --- shapes, parts, speed, and what is refused ---------------------------------------------------

FAMILIES = ("kicked", "lie", "hanging upside down", "separatrix", "uniform", "at rest")


@pytest.mark.parametrize("name", FAMILIES)
def test_times_are_cut_anyhow(name):
    """Bit for bit; θ alone is that of the record, with and without low words of time."""
    form, source = DoubleForm(rising_of(name)), np.random.default_rng(3)
    t = source.uniform(-30, 30, 3 * CHUNK + 17)
    low = t * source.uniform(-1e-17, 1e-17, t.size)
    part = slice(CHUNK - 3, CHUNK + 9)
    whole, some = form(t, low), form(t[part], low[part])
    assert np.array_equal(form.theta(t, low), whole.theta)
    assert np.array_equal(form.theta(t[part], low[part]), whole.theta[part])
    for field in fields(whole):
        one, other = getattr(whole, field.name), getattr(some, field.name)
        np.testing.assert_array_equal(one[part], other, err_msg=field.name)


@pytest.mark.slow
@pytest.mark.parametrize("name", FAMILIES)
def test_a_million_tilts_a_second(name):
    """θ alone, 1e6 times in a second at most, on whatever course; 6e6 to 3e8 were measured."""
    form, t = DoubleForm(rising_of(name)), np.linspace(-3, 40, 10**5)
    spent = []
    while not spent or (min(spent) > 0.1 and len(spent) < 20):
        began = time.process_time()
        form.theta(t)
        spent.append(time.process_time() - began)
    assert min(spent) <= 0.1


@pytest.mark.parametrize("shape", [(), (2, 3), (0,)])
def test_shapes(shape):
    """A scalar gives scalars, an array its shape, and the axis one dimension more."""
    form, t = DoubleForm(rising_of("kicked")), np.full(shape, 2.0)
    record = form(t)
    assert record.theta.shape == record.phi.shape == form.theta(t).shape == shape
    assert record.axis.shape == (*shape, 3)
    assert np.all(record.theta == form([2.0]).theta)


def test_times_that_are_none():
    form = DoubleForm(rising_of("kicked"))
    for call in (form, form.theta):
        for bad in (([np.nan],), ([0.0, np.inf],), ([0.0], [np.nan])):
            with pytest.raises(NotANumber, match="finite"):
                call(*bad)
        for junk in ("x", "pi/3", 1 + 2j, None, [[1], [2, 3]], 10**400):
            with pytest.raises(NotANumber):
                call(junk)
            with pytest.raises(NotANumber):
                call(1.0, junk)
        for t in (form.period * (MOST_PERIODS + 10), 1e308):
            with pytest.raises(NoClosedForm, match="periods"):
                call([t])


def test_reversal_angle():
    """cos θ at which φ̇ turns over: θ = 0.148027354547 in the kicked scene of the book."""
    assert np.arccos(DoubleForm(rising_of("kicked")).reversal_u) == pytest.approx(
        0.148027354547, abs=1e-12
    )
    for name in ("spherical pendulum", "planar swing"):
        assert DoubleForm(rising_of(name)).reversal_u == np.inf


def test_an_axis_longer_by_an_ulp():
    """The axis form's own binary start, |e|² ≠ 1: the closed form is that of those numbers."""
    e = (0.09983341664682815, 0.0, 0.9950041652780259)  # not of unit length
    l = (3.0, -0.5, 28.0)  # noqa: E741
    rising = Rising(FromAxis(e, l, 139.02439024390245, phi0=0.25))
    assert sum(Fraction(x) ** 2 for x in e) != 1
    errors = worst(rising, [-1.0, 0.1, 3.0, 1000.0])
    assert holds(errors), errors
