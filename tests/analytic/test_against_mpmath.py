"""The solution's elliptic integrals and functions against mpmath's own, at 50 and 100 digits.

mpmath shares no line with FLINT, of which the solution is made. Its functions get the roots that
mpmath finds of the cubic (`test_cubic`) from the numbers of the scene. Jacobi's functions as such
are held against Arb's own theta functions.
"""

from fractions import Fraction
from functools import cache

import pytest
from flint import acb, arb

from heavytop.analytic import balls
from heavytop.analytic.roots import TooFewBits
from heavytop.analytic.theta import Theta
from heavytop.exact.balls import Interval, working

from ..by_hand import ByHand
from ..motions import named
from ..views import Bounds, Digits

pytestmark = pytest.mark.reference

# g ≥ 0, released at a turning point or anywhere between; both sides of the poles and close to them
NUTATIONS = (
    "kicked", "rising", "falling", "cusps", "negative momenta", "spherical pendulum, almost",
    "1e-3 past the bottom", "1e-20 past the top", "1e-20 off uniform",
    "within 1e-9 of the separatrix", "1e-30 beyond the separatrix", "1e-9 of weight",
    "slender and fast",
)  # fmt: skip
SPARE = 260  # digits that Π(n|m) next to a pole and the roots may lose


class Textbook(ByHand):
    """The closed form by mpmath alone: roots by `polyroots`, K, Π and sn by its own functions."""

    def __init__(self, begun, digits):
        super().__init__(begun.top, begun.start, digits + SPARE)
        self.low, self.middle, self.high = self.roots
        self.m = (self.middle - self.low) / (self.high - self.low)
        self.w = self.mp.sqrt(self.g * (self.high - self.low) / 2)
        self.falls = self.mp.sign(self.rate)  # at a turning point 0
        self.upper = abs(self.u0 - self.middle) < abs(self.u0 - self.low)

    @property
    def start(self):
        """The phase x₀ of the start, u = u₁ + (u₂ − u₁) sn²(w t + x₀)."""
        mp = self.mp
        if not self.falls:
            return -mp.ellipk(self.m) if self.upper else mp.zero
        s2 = (self.u0 - self.low) / (self.middle - self.low)
        return -self.falls * mp.ellipf(mp.asin(mp.sqrt(s2)), self.m)

    def turns(self, third):
        """Φ₊ and Φ₋ over a period, by Π(n|m)."""
        reach = self.middle - self.low
        plus = (self.a + self.b) / (1 + self.low) * third(-reach / (1 + self.low), self.m)
        minus = (self.a - self.b) / (1 - self.low) * third(reach / (1 - self.low), self.m)
        return plus / self.w, minus / self.w

    def carlson(self, n, m):
        """Π(n|m) by R_F and R_J, with 1 − m that of the roots."""
        mc = (self.high - self.middle) / (self.high - self.low)
        return self.mp.elliprf(0, mc, 1) + n / 3 * self.mp.elliprj(0, mc, 1, 1 - n)

    def tilt(self, t):
        """u and u̇ at a time."""
        mp = self.mp
        sn, cn, dn = (mp.ellipfun(f, self.w * t + self.start, m=self.m) for f in ("sn", "cn", "dn"))
        reach = self.middle - self.low
        return self.low + reach * sn**2, 2 * reach * self.w * sn * cn * dn


@cache
def textbook(name, digits):
    return Textbook(named(name), digits)


def holds(ball, value, digits):
    """Whether an interval is as narrow as asked and holds a number of twice the digits."""
    size = max(1, abs(ball.middle))
    assert ball.spread <= size / Fraction(10) ** digits
    return value in Interval(ball.middle, ball.spread + size / Fraction(10) ** (2 * digits))


@pytest.mark.parametrize("digits", [50, 100])
@pytest.mark.parametrize("name", NUTATIONS)
def test_periods_and_turns(name, digits):
    """T is 2K/w, Δφ the sum of the turns, and Δψ − κT their difference: K and Π, and Carlson."""
    begun, truth = named(name), textbook(name, digits)
    found = Bounds(begun, digits)
    form, mp, kappa = Digits(begun, digits), truth.mp, truth.omega3 - truth.b
    T = 2 * mp.ellipk(truth.m) / truth.w
    assert holds(found.period, T, digits)
    for third in (mp.ellippi, truth.carlson):
        plus, minus = truth.turns(third)
        assert holds(found.precession, plus + minus, digits)
        assert holds(found.spin, kappa * T + plus - minus, digits)
    for got, want in (
        (form.period, T), (form.precession, plus + minus), (form.relative_spin, plus - minus),
        (form.modulus[0], truth.m), (form.modulus[1], 1 - truth.m),
        (form.mean_rates[0], 2 * plus / T), (form.mean_rates[1], 2 * minus / T),
        (form.lower_turning, -truth.start / truth.w), (form.roots[0], truth.low),
        (form.roots[1], truth.middle), (form.roots[2], truth.high),
    ):  # fmt: skip
        assert abs(mp.mpf(got) - want) <= mp.mpf(10) ** -digits * max(1, abs(want))


@pytest.mark.parametrize("digits", [50, 100])
@pytest.mark.parametrize("name", NUTATIONS)
def test_tilts_and_their_rates(name, digits):
    """u and u̇ by sn, cn and dn of mpmath, begun where the start is by its incomplete F."""
    begun, truth = named(name), textbook(name, digits)
    found, form, mp = Bounds(begun, digits), Digits(begun, digits), truth.mp
    # (t − start)/T half way between turning points, just past one, and some periods later
    for part in ("0.25", "0.5000001", "-0.7", "3.1"):
        t = Fraction(part) * Fraction(float(form.period))
        u, udot = truth.tilt(mp.mpf(t.numerator) / t.denominator)
        assert holds(found("u", t), u, digits)
        at = form(t)
        bound = mp.mpf(10) ** -digits
        assert abs(mp.mpf(at.u) - u) <= bound
        assert abs(mp.mpf(at.udot) - udot) <= bound * max(1, begun.rate)
        phidot = (truth.a - truth.b * u) / (1 - u * u)
        assert abs(mp.mpf(at.phidot) - phidot) <= bound * max(1, abs(phidot))
        assert abs(mp.mpf(at.psidot) - truth.omega3 + phidot * u) <= bound * max(
            1, abs(truth.omega3), begun.rate
        )


def test_other_turns_are_told_apart():
    """A modulus or a root off by 1e-45 is seen at 50 digits: no bound here is too wide."""
    begun, truth = named("rising"), textbook("rising", 50)
    mp, found = truth.mp, Bounds(begun, 50)
    wrong = mp.ellipk(truth.m * (1 + mp.mpf(10) ** -45))
    assert not holds(found.period, 2 * wrong / truth.w, 50)


# --- the functions as such -----------------------------------------------------------------------


PARAMETERS = ("0", "1e-300", "1e-9", "0.3", "0.4999", "0.5001", "0.9", "1-1e-9", "1-1e-300")
PLACES = ("-0.25", "-0.24", "-1e-30", "0.1", "0.25")  # of a period, from the turning point nearest
BITS = (64, 150, 380)


def exactly(text):
    """The parameters m and 1 − m."""
    return (1 - arb(text[2:]), arb(text[2:])) if text[:2] == "1-" else (arb(text), 1 - arb(text))


def thetas(z, tau):
    return acb.modular_theta(z, acb(0, tau))


def series_at(text, bits, place):
    """The series of m, what they take there, and x/2K."""
    series = Theta(*exactly(text), bits)
    z = 2 * series.half * arb(place)
    return series, balls.argument(z, series.hyperbolic)


@pytest.mark.parametrize("bits", BITS)
@pytest.mark.parametrize("m", PARAMETERS)
def test_functions_hold_what_arb_says(m, bits):
    """sn = θ₃θ₁/θ₂θ₄, and likewise cn and dn; each ball is about as small as the bits allow."""
    for place in PLACES:
        for upper in (False, True):
            with working(2 * bits + 1400):
                less, more = exactly(m)
                if less.is_zero():
                    x = arb.pi() * (arb(place) + arb(upper) / 2)
                    want = [x.sin(), x.cos(), arb(1)]
                else:
                    tau = arb(1).agm(more.sqrt()) / arb(1).agm(less.sqrt())
                    _, two, three, four = (theta.real for theta in thetas(acb(0), tau))
                    x = acb(arb(place) + arb(upper) / 2)
                    *over, four_x = (theta.real for theta in thetas(x, tau))
                    scales = three / two, four / two, four / three
                    want = [k * theta / four_x for k, theta in zip(scales, over, strict=True)]
            with working(bits):
                series, at = series_at(m, bits, place)
                under, *found = (series.function(balls, upper, k)(*at) for k in range(4))
                for each, truth in zip(found, want, strict=True):
                    assert (each / under).overlaps(truth)
                    assert (each / under).rad() < arb(2) ** (20 - bits)


@pytest.mark.parametrize("bits", BITS)
@pytest.mark.parametrize("m", PARAMETERS[2:-1])
def test_the_sweeps_hold_what_arb_says(m, bits):
    """π/2 − arg θ₁(z + ib) and −arg θ₂(z + ib), but for a multiple of z where m > ½."""
    for place in PLACES:
        for part in ("1e-20", "0.2", "0.4999"):
            with working(2 * bits + 400):
                less, more = exactly(m)
                means = arb(1).agm(more.sqrt()), arb(1).agm(less.sqrt())
                tau, K = means[0] / means[1], arb.pi() / 2 / means[0]
                beta = tau * arb(part)
                v, z = 2 * K * beta, acb(arb(place), beta)
                truths = [-theta.arg() for theta in thetas(z, tau)[:2]]
                truths[0] += arb.pi() / 2
            with working(bits):
                series, at = series_at(m, bits, place)
                left = arb.pi() - 2 * series.step(v, 1)  # of a real sweep
                for beside, truth in zip((True, False), truths, strict=True):
                    found = series.sweep(balls, v, 1, beside)(*at) + left * arb(place)
                    assert found.overlaps(truth), (place, part, beside)
                    assert found.rad() < arb(2) ** (28 - bits)


def test_a_modulus_that_is_not_known_is_refused():
    with working(100), pytest.raises(TooFewBits):
        Theta(arb(0.5, 0.49999), arb(0.5, 0.49999), 100)
