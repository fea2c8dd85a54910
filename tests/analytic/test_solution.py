"""The solution next to special motions and through poles, against the equations of motion.

Steady, sleeping, asymptotic and passing motions are limits, in which roots of the cubic meet. Here
motions come as near to them as 1e-150. What is asked of the closed form shares no code with it:

- θ, φ, ψ, differentiated numerically with more than twice the digits, satisfy Lagrange's equation
  for θ and keep p_φ ∓ p_ψ, E' and ω3, and nothing jumps where its pieces meet;
- T and Δφ are those of mpmath's polynomial roots and complete integrals at five times the digits.

Exactly through a pole φ and ψ are not defined apart. φ jumps by +π as time goes forward, ψ by −π at
the top, where φ + ψ is what is defined, and by +π at the bottom, where φ − ψ is. The rotation from
body to space turns with ω on either side and at the pass itself.
"""

from fractions import Fraction
from itertools import pairwise
from typing import NamedTuple

import mpmath
import numpy as np
import pytest
from flint import arb

import heavytop as ht
from heavytop.analytic.closed_form import ClosedForm
from heavytop.analytic.many_times import DoubleForm
from heavytop.analytic.rising import Rising
from heavytop.analytic.solution import _nearest
from heavytop.classification.reduced import FromScene, Through
from heavytop.errors import NoClosedForm
from heavytop.numbers import Exact, cos
from heavytop.numbers.intervals import working

from ..by_hand import ByHand
from ..motions import product

X = Exact.of
BETSCH = (Fraction("6.375e-3"), Fraction("7.5e-4"), Fraction("0.73575"))
LIE = (Fraction("15.234375"), Fraction("0.46875"), Fraction("147.15"))


class Start(NamedTuple):
    """What a motion starts from; φ₀ = 0.3 and ψ₀ = −0.7."""

    top: tuple
    theta: object
    phidot: object
    omega3: object
    thetadot: object = 0

    @property
    def rising(self):
        """The motion, from exact numbers."""
        state = ht.State(
            self.theta, thetadot=self.thetadot, phi="0.3", phidot=self.phidot, psi="-0.7",
            omega3=self.omega3,
        )  # fmt: skip
        return Rising(FromScene(ht.Top(*self.top), state))

    def given(self, ctx):
        """A, C, gMR, θ, φ̇, ω3, θ̇ as numbers of a context."""
        return [ctx.mpf(1) * _number(ctx, x) for x in (*self.top, *self[1:])]


def _number(ctx, x):
    if isinstance(x, Exact):
        return x.mpf(ctx)
    return ctx.mpf(x.numerator) / x.denominator


UNIT = (2, 1, 2)  # marginal at ω3 = 4
WHITTAKER = (X("pi/3"), X("2/sqrt(3)"), X("2*sqrt(3)"))


def near(e):
    """Motions that differ by e from one that is special; all of them nutate."""
    e = Fraction(e)
    theta, phidot, omega3 = WHITTAKER
    return {
        "marginal top, tilted": Start(UNIT, e, 0, 4),
        "marginal top, pushed": Start(UNIT, 0, 0, 4, e),
        "just slower than marginal, tilted": Start(UNIT, e, 0, 4 - e),
        "just faster than marginal": Start(UNIT, Fraction(1, 1000), 0, 4 + e),
        "unstable sleeper, tilted": Start(UNIT, e, 0, 3),
        "unstable sleeper, pushed": Start(UNIT, 0, 0, 3, e),
        "stable sleeper, tilted": Start(UNIT, e, 0, 5),
        "hanging, tilted": Start((2, 1, -2), e, 0, 3),
        "faster than steady": Start(BETSCH, X("pi/3"), 10 * (1 + e), Fraction("140.6")),
        "slower than steady": Start(BETSCH, X("pi/3"), 10 * (1 - e), Fraction("140.6")),
        "within the separatrix": Start(UNIT, theta, phidot, omega3 - X(e)),
        "beyond the separatrix": Start(UNIT, theta, phidot, omega3 + X(e)),
        "over the top of the separatrix": Start(UNIT, *WHITTAKER, e),
        "past the bottom": Start(LIE, X("pi/2"), X("-60/13") + X(e), 150),
        "past the top": Start(UNIT, e, 1, 3, 2),
        "past the bottom, from it": Start(UNIT, X("pi") - X(e), 1, 3, 2),
        "next to weightless": Start((2, 1, e), Fraction(1, 2), -2, 3, Fraction(1, 4)),
    }


NAMES = tuple(near(1))
TINY = ("1e-3", "1e-10", "1e-30", "1e-45", "1e-150")
PARTS = ("0.001", "0.13", "0.31", "0.501", "0.9", "-0.37")


def places(form):
    """Times spread over a period, the turning points avoided."""
    ctx = form.ctx
    return [ctx.mpf(part) * form.period + form.lower_turning for part in PARTS]


def slopes(form, ctx, t, rate):
    """θ̇, φ̇, ψ̇ and θ̈ by differences of order 8 over 1e-14 of the local time scale."""
    h = ctx.mpf("1e-14") / rate
    around = {k: form(ctx.make_mpf((t + k * h)._mpf_)) for k in range(-4, 5)}

    def value(k, name):
        return ctx.make_mpf(getattr(around[k], name)._mpf_)

    first = [ctx.mpf(n) / d for n, d in ((4, 5), (-1, 5), (4, 105), (-1, 280))]
    second = [ctx.mpf(n) / d for n, d in ((8, 5), (-1, 5), (8, 315), (-1, 560))]
    rates = [
        sum(c * (value(k, name) - value(-k, name)) for k, c in enumerate(first, 1)) / h
        for name in ("theta", "phi", "psi")
    ]
    bend = sum(
        c * (value(k, "theta") - 2 * value(0, "theta") + value(-k, "theta"))
        for k, c in enumerate(second, 1)
    )
    return (*rates, bend / h**2)


def residuals(start, form, t):
    """Lagrange's equation for θ, and the changes of P₋, P₊, ω3 and E', each beside its terms."""
    ctx = mpmath.MPContext()
    ctx.dps = form.ctx.dps
    A, C, gMR, theta0, phidot0, omega3, thetadot0 = start.given(ctx)
    g, b = gMR / A, C * omega3 / A
    at, t = form(t), ctx.make_mpf(t._mpf_)
    theta, thetadot, phidot = (
        ctx.make_mpf(x._mpf_) for x in (at.theta, at.thetadot, at.phidot)
    )  # fmt: skip
    rate = ctx.sqrt(abs(g)) + abs(b) + abs(phidot) + abs(thetadot) / min(theta, ctx.pi - theta)
    thetadot, phidot, psidot, bend = slopes(form, ctx, t, rate)
    sine, cosine = ctx.sin(theta), ctx.cos(theta)

    def momenta(tilt, winding):
        above, below = 2 * ctx.sin(tilt / 2) ** 2, 2 * ctx.cos(tilt / 2) ** 2
        return ((winding * below * above, -b * above), (winding * above * below, b * below))

    def kinetic(speed, tilt, winding):
        return speed**2 / 2, (winding * ctx.sin(tilt)) ** 2 / 2

    (now, then) = (momenta(theta, phidot), momenta(theta0, phidot0))
    lift = [2 * g * ctx.sin(tilt / 2) ** 2 for tilt in (theta, theta0)]
    balance = [
        (bend, -sine * cosine * phidot**2, b * sine * phidot, -g * sine),
        *((*now[k], *(-x for x in then[k])) for k in (0, 1)),
        (psidot, phidot * cosine, -omega3),
        (*kinetic(thetadot, theta, phidot), *(-x for x in kinetic(thetadot0, theta0, phidot0)),
         -lift[0], lift[1]),
    ]  # fmt: skip
    return [float(abs(sum(terms)) / (sum(map(abs, terms)) or 1)) for terms in balance]


@pytest.mark.parametrize("e", TINY)
@pytest.mark.parametrize("name", NAMES)
def test_the_equations_of_motion(name, e):
    """To 50 digits and more, at whatever distance from the special motion."""
    start = near(e)[name]
    form = ClosedForm(start.rising, 160)
    for t in places(form):
        assert max(residuals(start, form, t)) < 1e-50


@pytest.mark.parametrize("e", TINY)
@pytest.mark.parametrize("name", NAMES)
def test_the_start_and_the_seams(name, e):
    """The start is the given one, and the angles are continuous where the pieces meet."""
    start = near(e)[name]
    form = ClosedForm(start.rising, 70)
    ctx, at = form.ctx, form(0)
    assert abs(form.lower_turning) <= form.period / 2
    _, _, _, theta, phidot, _, thetadot = start.given(ctx)
    if theta:  # on a pole θ̇ alone is what was given
        assert abs(at.theta - theta) <= abs(theta) * ctx.mpf("1e-70")
        assert abs(at.phidot - phidot) <= ctx.mpf("1e-60") * (1 + abs(phidot))
        assert abs(at.phi - ctx.mpf("0.3")) + abs(at.psi + ctx.mpf("0.7")) < ctx.mpf("1e-60")
    assert abs(at.thetadot - thetadot) < ctx.mpf("1e-60") * (1 + abs(thetadot))
    for quarter in (1, 3, 5, -3):
        seam, step = quarter * form.period / 4 + form.lower_turning, ctx.mpf("1e-40") * form.period
        before, after = form(seam - step), form(seam + step)
        for angle in ("theta", "phi", "psi"):
            moved = getattr(after, angle) - getattr(before, angle)
            assert abs(moved) <= 3 * step * abs(getattr(before, angle + "dot")) + ctx.mpf("1e-60")


@pytest.mark.slow
@pytest.mark.parametrize("e", ["1e-3", "1e-10", "1e-30"])
@pytest.mark.parametrize("name", [n for n in NAMES if "top of" not in n])
def test_periods_and_turns(name, e):
    """T and Δφ to 35 digits; the polynomial loses two thirds of its digits in a triple root."""
    rising = near(e)[name].rising
    form, truth = ClosedForm(rising, 40), ByHand(rising.source.top, rising.source.start, 400, True)
    mp, a, b, (u1, u2, u3) = truth.mp, truth.a, truth.b, truth.roots
    w, m = mp.sqrt(truth.g * (u3 - u1) / 2), (u2 - u1) / (u3 - u1)
    assert abs(mp.mpf(form.period) / (2 * mp.ellipk(m) / w) - 1) < 1e-35
    if "pushed" not in name:
        turn = (a - b) / (1 - u1) * mp.ellippi((u2 - u1) / (1 - u1), m)
        turn += (a + b) / (1 + u1) * mp.ellippi(-(u2 - u1) / (1 + u1), m)
        assert abs(mp.mpf(form.precession) - turn / w) < 1e-35


@pytest.mark.parametrize("e", TINY)
@pytest.mark.parametrize("name", NAMES)
def test_doubles_keep_all_their_digits(name, e):
    """θ to 1e-15 of itself, φ and ψ to 1e-15 max(1, |x|): a start is exact, nothing ill-posed."""
    rising = near(e)[name].rising
    double = DoubleForm(rising)
    lower, T = rising.settled(
        "turning points", lambda found, bits: (found.lower_turning, found.path.period), 60
    )
    times = [float(lower + T * arb(part)) for part in PARTS]
    times += [double.period * 7 / 3, 0.0, 1e-3, -0.3, 2.0]
    record = double(times)
    for i, t in enumerate(times):
        at = rising.settled(
            "the truth", lambda found, bits, t=t: found.at(arb(t)), 360,
            of=lambda at: (at.theta, at.phi, at.psi),
        )  # fmt: skip
        for angle in ("theta", "phi", "psi"):
            want, got = getattr(at, angle), arb(float(getattr(record, angle)[i]))
            size = abs(want) if angle == "theta" else abs(want).max(arb(1))
            assert abs(float(got - want)) <= 1e-15 * float(size), (angle, t)


@pytest.mark.parametrize("e", ["1e-1", "1e-8", "1e-20", "1e-45"])
def test_the_separatrix_of_a_top_that_hardly_falls(e):
    """From its lowest point θ₁ = e: sin(θ/2) = sin(θ₁/2) sech(√(gMR/A) sin(θ₁/2) t), m = 1."""
    c = cos(X(e) / 2)  # ω3 = 4 c and φ̇ = 1/c make P₋ = 0 and E' = gMR
    start = Start(UNIT, X(e), 1 / c, 4 * c)
    form, double = ClosedForm(start.rising, 40), DoubleForm(start.rising)
    ctx = form.ctx
    depth = ctx.sin(X(e).mpf(ctx) / 2)
    for x in ("-3", "0.2", "1", "37.7", "-53.1", "61.3"):
        high = float(ctx.mpf(x) / depth)
        low = float(ctx.mpf(x) / depth - high)
        t = ctx.mpf(high) + low
        exact = 2 * ctx.asin(depth * ctx.sech(depth * t))
        assert abs(form(t).theta / exact - 1) < ctx.mpf("1e-38")
        assert abs(float(double(high, low).theta / exact) - 1) < 1e-15
        sweep = ctx.atan(ctx.tan(X(e).mpf(ctx) / 2) * ctx.tanh(depth * t))
        exact_phi = ctx.mpf(3) / 10 + c.mpf(ctx) * t + sweep  # Φ₊ = ½ P₊ t/2 + …
        assert abs(form(t).phi - exact_phi) < ctx.mpf("1e-38") * (1 + abs(exact_phi))
        off = abs(float(ctx.mpf(float(double(high, low).phi)) - exact_phi))
        assert off <= 1e-15 * max(1, abs(exact_phi))


def turns(source):
    """Φ₊ and Φ₋ over a period, and whether the axis reaches the top."""

    def told(found, _):
        return (*found.path.turns, arb(int(found.path.reaches_top)))

    plus, minus, reaches = Rising(source).settled("the turns", told, 80)
    return plus, minus, bool(reaches == 1)


def test_a_close_pass_is_no_exact_one():
    """P₊ = ±1e-70: φ does not jump at the bottom, it turns there, by half a turn either way."""
    start = near("1e-70")["past the bottom"]
    other = start._replace(phidot=X("-60/13") - X("1e-70"))
    with working(400):
        assert abs(turns(start.rising.source)[0] - arb.pi()) < arb("1e-60")
        assert abs(turns(other.rising.source)[0] + arb.pi()) < arb("1e-60")
    for each, side in ((start, 1), (other, -1)):
        form = ClosedForm(each.rising, 120)  # the pass takes 1e-72 s
        pole, h = form.lower_turning, form.ctx.mpf("1e-40")
        assert abs(form(pole + h).phi - form(pole - h).phi - side * form.ctx.pi) < 1e-20
        assert abs(form(pole).phi - form(pole - h).phi - side * form.ctx.pi / 2) < 1e-20


@pytest.mark.parametrize("below", [False, True])
def test_a_motion_through_a_pole_by_decree(below):
    """P₋ of 1e-25, told to be zero, is zero: the axis goes through the top; so from below, P₊."""
    phidot = Fraction(round(Fraction(4 / (1 + np.cos(1.0))) * 10**25), 10**25)
    start = Start(UNIT, 1, phidot, 8, 5)
    if below:
        start = Start((2, 1, -2), X("pi") - 1, phidot, -8, -5)
    plain = start.rising
    told = Rising(Through(plain.source, top=not below, bottom=below))
    assert plain.regime.misses_top
    assert not told.regime.misses_top
    _, minus, reaches = turns(told.source)
    with working(300):
        assert reaches
        assert abs(minus - arb.pi()) < arb("1e-80")
        beside = turns(plain.source)
        assert not beside[2]
        assert abs(abs(beside[1]) - arb.pi()) < arb("1e-17")
    one, other = ClosedForm(plain, 40), ClosedForm(told, 40)
    assert abs(one.period / other.period - 1) < 1e-17


def test_steady_at_a_tilt_that_vanishes_at_sixty_digits():
    """θ = 1e-70, precessing: neither P₊ nor P₋ is zero, so it is not on the vertical."""
    tilt = X("1e-70")
    omega = Fraction(3)
    # A φ̇² cosθ − C ω3 φ̇ + gMR = 0, C = 1
    spin = (2 * X(omega) ** 2 * cos(tilt) + 2) / omega
    start = Start(UNIT, tilt, omega, spin)
    assert start.rising.regime.name == "steady"
    form = ClosedForm(start.rising, 30)
    assert abs(form(2).phi - Fraction("0.3") - 6) < form.ctx.mpf("1e-30")
    assert abs(form(2).theta / tilt.mpf(form.ctx) - 1) < form.ctx.mpf("1e-30")
    assert float(DoubleForm(start.rising)(2.0).theta) == pytest.approx(1e-70, rel=1e-15)


class Told(FromScene):
    """Numbers of which none is known to vanish."""

    def vanishes(self, name):
        return False


def test_the_limit_of_bits_is_named():
    """Told that it nutates where it is steady, either form says how many bits were tried."""
    start = Start(BETSCH, X("pi/3"), 10, Fraction("140.6")).rising.source
    told = Rising(Told(start.top, start.start), limit=1024)
    with pytest.raises(NoClosedForm, match="1024 bits"):
        DoubleForm(told)
    with pytest.raises(NoClosedForm, match="1024 bits"):
        ClosedForm(told, 30)(1)


# --- exactly through a pole ----------------------------------------------------------------------


# a start, the pole that is passed (1 top, −1 bottom), and half periods from u₁ to there
GIVEN = {
    "the top, from it": (((2, 1, 3), 0, 0, 2, 3), 1, 1),
    "the top, into it": (((2, 1, 3), 0, 0, 2, -3), 1, 1),
    "the top, from afar": (((2, 1, 2), "pi/3", 4, 10, -1), 1, 1),
    "the bottom": (((2, 1, 3), "pi", 0, 2, 3), -1, 0),
    "the bottom, from afar": (((2, 1, 2), "2*pi/3", -4, 10, 1), -1, 0),
    "the top, hanging from it": (((2, 1, -3), 0, 0, 2, 1), 1, 0),
    "the bottom, standing on it": (((2, 1, -3), "pi", 0, 2, 3), -1, 1),
    "a swing": (((2, 1, 3), "2.5", 0, 0, 0.5), -1, 0),
    "turning over, the top": (((2, 1, 3), "2.5", 0, 0, 5), 1, 1),
    "turning over, the bottom": (((2, 1, 3), "2.5", 0, 0, -5), -1, 0),
    "weightless, the top": (((2, 1, 0), 0, 0, 2, 3), 1, 1),
}


def rising_of(top, theta, phidot, psidot, thetadot):
    rates = {"thetadot": thetadot, "phidot": phidot, "psidot": psidot}
    return Rising(FromScene(ht.Top(*top), ht.State(theta, phi="0.3", psi="-0.7", **rates)))


PASSES = {name: (rising_of(*given), pole, half) for name, (given, pole, half) in GIVEN.items()}


def passing(form, half):
    return half * form.period / 2 + form.lower_turning + 2 * form.period


@pytest.mark.parametrize("name", PASSES)
def test_angles_jump_and_the_axis_does_not(name):
    """ė at the pass is θ̇ across the vertical, and the same just before and just after."""
    rising, pole, half = PASSES[name]
    form = ClosedForm(rising, 60)
    ctx, h, r = form.ctx, form.ctx.mpf("1e-15"), form.reduced
    t = passing(form, half)
    before, at, after = (form(t + k * h) for k in (-1, 0, 1))
    speed = ctx.sqrt(2 * (r.kinetic0 + r.g * (r.u0 - pole)))
    slack = 10 * h * (1 + abs(r.kappa) + abs(r.b) + speed)
    assert abs(after.phi - before.phi - ctx.pi) < slack
    assert abs(after.psi - before.psi + pole * ctx.pi) < slack
    # the time of the pass is rounded: it is before the pass or after it
    assert min(abs(at.phi - after.phi), abs(at.phi - before.phi)) < slack
    assert min(at.theta, ctx.pi - at.theta) < ctx.mpf("1e-30")
    assert abs(at.axis[2] - pole) < ctx.mpf("1e-50")
    leaving, coming = (
        [(b - a) / h for a, b in zip(one.axis, two.axis, strict=True)]
        for one, two in ((at, after), (before, at))
    )
    assert abs(ctx.hypot(*leaving[:2]) / speed - 1) < ctx.mpf("1e-12")
    assert max(abs(a - b) for a, b in zip(leaving, coming, strict=True)) < 1e-12 * speed


@pytest.mark.parametrize("name", PASSES)
def test_the_attitude_turns_on_smoothly(name):
    """q̇ = ½ ω q with |ω|² = ω3² + 2 (E' − V)/A, and ω3 about the axis, on both sides and at it."""
    rising, pole, half = PASSES[name]
    form = ClosedForm(rising, 60)
    ctx, h = form.ctx, form.ctx.mpf("1e-12")
    t, r = passing(form, half), form.reduced
    places = [[*form(t + k * h).quaternion] for k in (-3, -1, 0, 1, 3)]
    for one, other in pairwise(places):  # one branch of ±q
        if sum(a * b for a, b in zip(one, other, strict=True)) < 0:
            other[:] = [-x for x in other]
    far, near = (
        [(b - a) / (2 * k * h) for a, b in zip(places[i], places[4 - i], strict=True)]
        for i, k in ((0, 3), (1, 1))
    )
    rate = [(9 * b - a) / 8 for a, b in zip(far, near, strict=True)]
    here = places[2]
    omega = [2 * x for x in product(rate, [here[0], *(-x for x in here[1:])])]
    squared = (r.kappa + r.b) ** 2 + 2 * (r.kinetic0 + r.g * (r.u0 - pole))
    assert abs(omega[0]) < ctx.mpf("1e-40")
    assert abs(sum(x * x for x in omega[1:]) / squared - 1) < ctx.mpf("1e-40")
    assert abs(omega[3] - pole * (r.kappa + r.b)) < ctx.mpf("1e-40") * ctx.sqrt(squared)
    for k, q in zip((-3, -1, 1, 3), places[:2] + places[3:], strict=True):
        ahead = [a + k * h * b for a, b in zip(here, rate, strict=True)]
        assert max(abs(a - b) for a, b in zip(q, ahead, strict=True)) < 40 * squared * h**2


@pytest.mark.parametrize("name", PASSES)
def test_doubles_pass_smoothly_too(name):
    """Sampled every 1e-6 s through five passes, axis and attitude move as far as ω lets them."""
    rising, _, half = PASSES[name]
    form = DoubleForm(rising)
    lower, T = rising.settled("T", lambda found, bits: (found.lower_turning, found.path.period), 30)
    pole = float(lower + (half / 2 + 2) * T)
    t = (pole + np.arange(-2, 3)[:, None] * form.period + np.arange(-50, 51) * 1e-6).ravel()
    at = form(np.append(t, pole))
    q = at.quaternion
    r = ClosedForm(rising).reduced
    size = float((r.kappa + r.b) ** 2 + 2 * (r.kinetic0 + abs(r.g) * (1 + abs(r.u0)))) ** 0.5
    apart = np.diff(t) < 2e-6
    turned = 1 - abs(np.sum(q[1:-1] * q[:-2], axis=-1))  # 1 − cos of half the angle
    assert np.all(turned[apart] < (1.001e-6 * size) ** 2 / 8 + 1e-15)
    moved = np.linalg.norm(np.diff(at.axis[:-1], axis=0), axis=-1)
    assert np.all(moved[apart] < 1.001e-6 * size + 1e-15)
    jumps = np.diff(at.phi[:-1])[apart]
    assert np.sum(jumps > 3.1) == 5
    assert np.all((jumps > 3.1) | (abs(jumps) < 1e-4))


def test_a_whole_number_is_found_beside_a_half_in_fewer_bits_than_that_is_told_in():
    with working(300):
        beside = [arb(0.5) + side * arb(2) ** -250 for side in (-1, 1)]
    with working(64):
        assert all(int(_nearest(x).unique_fmpz()) in (0, 1) for x in beside)
