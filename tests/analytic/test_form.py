"""The solution as near as 1e-150 to special motions, and exactly through poles, by itself.

Angles, differentiated numerically, satisfy Lagrange's equation and keep p_φ ∓ p_ψ, E' and ω3.
Through a pole φ jumps by π, and ψ by −π at the top, by π at the bottom; the attitude turns with ω.
"""

from fractions import Fraction
from itertools import pairwise

import pytest

import heavytop as ht
from heavytop.exact import PI, Exact, cos
from heavytop.exact.decimals import context

from ..motions import CONE, LIE, MARGINAL, MOTIONS, motion, named, product
from ..views import Bounds, Digits, holds

X = Exact.of
CTX = context(80)


def motion_of(top, theta, phidot, omega3, thetadot=0):
    """The motion from exact numbers; φ₀ = 0.3 and ψ₀ = −0.7."""
    rates = {"thetadot": thetadot, "phidot": phidot, "omega3": omega3}
    return ht.Motion(top, ht.State(theta, phi="0.3", psi="-0.7", **rates))


def near(e):
    """Motions that differ by e from one that is special; all of them nutate."""
    e = Fraction(e)
    theta, phidot, omega3 = map(X, ("pi/3", "2/sqrt(3)", "2*sqrt(3)"))  # Whittaker's
    return {
        "marginal top, tilted": motion_of(MARGINAL, e, 0, 4),
        "stable sleeper, tilted": motion_of(MARGINAL, e, 0, 5),
        "hanging, tilted": motion_of(ht.Top(2, 1, -2), e, 0, 3),
        "faster than steady": motion_of(CONE, X("pi/3"), 10 * (1 + e), Fraction("140.6")),
        "within the separatrix": motion_of(MARGINAL, theta, phidot, omega3 - X(e)),
        "beyond the separatrix": motion_of(MARGINAL, theta, phidot, omega3 + X(e)),
        "past the bottom": motion_of(LIE, X("pi/2"), X("-60/13") + X(e), 150),
        "past the top": motion_of(MARGINAL, e, 1, 3, 2),
        "past the bottom, from it": motion_of(MARGINAL, X("pi") - X(e), 1, 3, 2),
        "next to weightless": motion_of(ht.Top(2, 1, e), Fraction(1, 2), -2, 3, Fraction(1, 4)),
    }


NAMES = tuple(near(1))
TINY = ("1e-3", "1e-30", "1e-150")
PARTS = ("0.001", "0.13", "0.31", "0.501", "0.9", "-0.37")


def residuals(form, t):
    """Lagrange's equation for θ, and the changes of P₋, P₊, ω3 and E', each beside its terms."""
    ctx, at = form.ctx, form(t)
    top, start = form.motion.top, form.motion.start
    numbers = (top.A, top.C, top.gMR, start.theta, start.phidot, start.omega3, start.thetadot)
    A, C, gMR, theta0, phidot0, omega3, thetadot0 = (x.mpf(ctx) for x in numbers)
    g, b, theta = gMR / A, C * omega3 / A, at.theta
    nodding = abs(at.thetadot) / min(theta, ctx.pi - theta)
    h = ctx.mpf("1e-30") / (ctx.sqrt(abs(g)) + abs(b) + abs(at.phidot) + nodding)
    before, after = form(t - h), form(t + h)
    thetadot, phidot, psidot = (
        (getattr(after, name) - getattr(before, name)) / (2 * h) for name in ("theta", "phi", "psi")
    )
    bend = (after.theta - 2 * theta + before.theta) / h**2
    sine, cosine = ctx.sin(theta), ctx.cos(theta)

    def kept(speed, tilt, winding):
        """P₋, P₊ and E', each a sum of terms; with v = 1 ∓ cosθ."""
        above, below = 2 * ctx.sin(tilt / 2) ** 2, 2 * ctx.cos(tilt / 2) ** 2
        energy = speed**2 / 2, (winding * ctx.sin(tilt)) ** 2 / 2, -g * above
        return (winding * below * above, -b * above), (winding * above * below, b * below), energy

    now, then = kept(thetadot, theta, phidot), kept(thetadot0, theta0, phidot0)
    balance = [
        (bend, -sine * cosine * phidot**2, b * sine * phidot, -g * sine),
        (psidot, phidot * cosine, -omega3),
        *((*new, *(-x for x in old)) for new, old in zip(now, then, strict=True)),
    ]
    return [float(abs(sum(terms)) / (sum(map(abs, terms)) or 1)) for terms in balance]


every_motion = pytest.mark.parametrize(("name", "e"), [(name, e) for name in NAMES for e in TINY])


@every_motion
def test_the_equations_of_motion(name, e):
    """To 50 digits and more, at whatever distance from the special motion."""
    form = Digits(near(e)[name], 160)
    for part in PARTS:
        assert max(residuals(form, form.ctx.mpf(part) * form.period + form.lower_turning)) < 1e-50


@every_motion
def test_angles_are_continuous_where_their_pieces_meet(name, e):
    form = Digits(near(e)[name], 70)
    ctx = form.ctx
    assert abs(form.lower_turning) <= form.period / 2
    for quarter in (1, 3, 5, -3):
        seam, step = quarter * form.period / 4 + form.lower_turning, ctx.mpf("1e-40") * form.period
        before, after = form(seam - step), form(seam + step)
        for angle in ("theta", "phi", "psi"):
            moved = getattr(after, angle) - getattr(before, angle)
            assert abs(moved) <= 3 * step * abs(getattr(before, angle + "dot")) + ctx.mpf("1e-60")


@pytest.mark.parametrize("e", ["1e-1", "1e-45"])
def test_the_separatrix_of_a_top_that_hardly_falls(e):
    """From its lowest point θ₁ = e: sin(θ/2) = sin(θ₁/2) sech(√(gMR/A) sin(θ₁/2) t), m = 1."""
    c = cos(X(e) / 2)  # ω3 = 4 c and φ̇ = 1/c make P₋ = 0 and E' = gMR
    motion = motion_of(MARGINAL, X(e), 1 / c, 4 * c)
    form, double = Digits(motion, 40), motion.at
    ctx = form.ctx
    depth = ctx.sin(X(e).mpf(ctx) / 2)
    for x in ("-3", "0.2", "61.3"):
        high = float(ctx.mpf(x) / depth)
        low = float(ctx.mpf(x) / depth - high)
        t = ctx.mpf(high) + low
        exact = 2 * ctx.asin(depth * ctx.sech(depth * t))
        assert abs(form(t).theta / exact - 1) < ctx.mpf("1e-38")
        assert abs(float(double(high, t_lo=low).theta / exact) - 1) < 1e-15
        sweep = ctx.atan(ctx.tan(X(e).mpf(ctx) / 2) * ctx.tanh(depth * t))
        exact_phi = ctx.mpf(3) / 10 + c.mpf(ctx) * t + sweep  # Φ₊ = ½ P₊ t/2 + …
        assert abs(form(t).phi - exact_phi) < ctx.mpf("1e-38") * (1 + abs(exact_phi))
        off = abs(float(ctx.mpf(float(double(high, t_lo=low).phi)) - exact_phi))
        assert off <= 1e-15 * max(1, abs(exact_phi))


# --- exactly through a pole ----------------------------------------------------------------------


# a start, the pole that is passed (1 top, −1 bottom), and half periods from u₁ to there
PASSES = {
    "the top, from it": ((2, 1, 3, 0, 0, 2, 3), 1, 1),
    "the top, from afar": ((2, 1, 2, "pi/3", 4, 10, -1), 1, 1),
    "the bottom": ((2, 1, 3, "pi", 0, 2, 3), -1, 0),
    "the bottom, from afar": ((2, 1, 2, "2*pi/3", -4, 10, 1), -1, 0),
    "the top, hanging from it": ((2, 1, -3, 0, 0, 2, 1), 1, 0),
    "the bottom, standing on it": ((2, 1, -3, "pi", 0, 2, 3), -1, 1),
    "a swing": ((2, 1, 3, "2.5", 0, 0, 0.5), -1, 0),
    "turning over, the top": ((2, 1, 3, "2.5", 0, 0, 5), 1, 1),
    "weightless, the top": ((2, 1, 0, 0, 0, 2, 3), 1, 1),
}


@pytest.mark.parametrize("name", PASSES)
def test_angles_jump_and_the_attitude_turns_on(name):
    """q̇ = ½ ω q with |ω|² = ω3² + 2 (E' − V)/A, and ω3 about the axis, on both sides and at it."""
    (A, C, gMR, theta, phidot, psidot, thetadot), pole, half = PASSES[name]
    begun = motion(A, C, gMR, theta, "0.3", "-0.7", thetadot, phidot, psidot)
    form = Digits(begun, 60)
    ctx, h, r = form.ctx, form.ctx.mpf("1e-12"), begun.reduced
    t = half * form.period / 2 + form.lower_turning + 2 * form.period
    records = [form(t + k * h) for k in (-3, -1, 0, 1, 3)]
    squared = (r.kappa + r.b) ** 2 + 2 * (r.kinetic0 + r.g * (r.u0 - pole))
    slack = 10 * h * (1 + abs(r.kappa) + abs(r.b) + ctx.sqrt(squared))
    first, before, at, after, _ = records
    later = form(t - 3 * h + form.period)
    assert abs(later.phi - first.phi - form.precession) < ctx.mpf("1e-50")
    assert abs(later.psi - first.psi - form.spin) < ctx.mpf("1e-50")
    assert abs(after.phi - before.phi - ctx.pi) < slack
    assert abs(after.psi - before.psi + pole * ctx.pi) < slack
    # the time of the pass is rounded: it is before the pass or after it
    assert min(abs(at.phi - after.phi), abs(at.phi - before.phi)) < slack
    assert min(at.theta, ctx.pi - at.theta) < ctx.mpf("1e-30")
    assert abs(at.axis[2] - pole) < ctx.mpf("1e-50")
    places = [[*record.quaternion] for record in records]
    for one, other in pairwise(places):  # one branch of ±q
        if sum(a * b for a, b in zip(one, other, strict=True)) < 0:
            other[:] = [-x for x in other]
    far, near = (
        [(b - a) / (2 * k * h) for a, b in zip(places[i], places[4 - i], strict=True)]
        for i, k in ((0, 3), (1, 1))
    )
    rate, here = [(9 * b - a) / 8 for a, b in zip(far, near, strict=True)], places[2]
    omega = [2 * x for x in product(rate, [here[0], *(-x for x in here[1:])])]
    assert abs(omega[0]) < ctx.mpf("1e-40")
    assert abs(sum(x * x for x in omega[1:]) / squared - 1) < ctx.mpf("1e-40")
    assert abs(omega[3] - pole * (r.kappa + r.b)) < ctx.mpf("1e-40") * ctx.sqrt(squared)
    for k, q in zip((-3, -1, 1, 3), places[:2] + places[3:], strict=True):
        ahead = [a + k * h * b for a, b in zip(here, rate, strict=True)]
        assert max(abs(a - b) for a, b in zip(q, ahead, strict=True)) < 40 * squared * h**2


# --- the start is the given one ------------------------------------------------------------------


STARTS = {name: named(name) for name in MOTIONS}
STARTS |= {f"{name}, {e}": each for e in TINY for name, each in near(e).items()}


@pytest.mark.parametrize("begun", STARTS.values(), ids=STARTS)
def test_start_is_the_start(begun):
    """At t = 0 every angle and rate is the given one, in the interval too."""
    at, found = begun.at(0, 70), Bounds(begun, 25)
    for each in ("theta", "phi", "psi", "thetadot", "phidot", "psidot"):
        # on a pole φ and ψ, and their rates, have no value of their own
        if begun.start.theta not in (0, PI) or each == "theta":
            given = getattr(begun.start, each).mpf(CTX)
            size = abs(given) if each == "theta" else 1 + abs(given)
            assert abs(getattr(at, each) - given) <= size * CTX.mpf("1e-60")
            assert holds(found(each, 0), given, 38)


@pytest.mark.parametrize(("theta", "up"), [(0, 1), ("pi", -1)])
@pytest.mark.parametrize("thetadot", [1, -1])
@pytest.mark.parametrize("gMR", [3, -3])
def test_start_on_a_pole_names_the_side_it_goes_to(theta, up, thetadot, gMR):
    """φ₀ is where the axis goes; when θ̇₀ points through the pole it is φ₀ + π, and ψ₀ ∓ π."""
    begun = motion(2, 1, gMR, theta, phi="0.3", psi="0.2", thetadot=thetadot, psidot=1)
    at = begun.at(Fraction(1, 10**20), 30)
    turned = thetadot * up < 0
    assert abs(at.phi - CTX.mpf("0.3") - turned * CTX.pi) < 1e-19
    assert abs(at.psi - CTX.mpf("0.2") + up * turned * CTX.pi) < 1e-19
