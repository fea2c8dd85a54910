"""The solution's elliptic integrals and functions against mpmath's own, at 50 and 100 digits.

mpmath shares no line with FLINT, of which the solution is made. Its functions get the roots that
mpmath finds of the cubic (`test_cubic`) from the numbers of the scene. Jacobi's functions as such
are held against Arb's own theta functions.
"""

from fractions import Fraction
from functools import cache

import pytest
from flint import acb, arb

import heavytop as ht
from heavytop.analytic.cubic import TooFewBits
from heavytop.analytic.elliptic import Jacobi
from heavytop.numbers.intervals import Interval, working

from ..by_hand import ByHand
from ..motions import named

pytestmark = pytest.mark.reference

# g ≥ 0, released at a turning point or anywhere between; both sides of the poles and close to them
NUTATIONS = (
    "kicked", "loops", "rising", "falling", "cusps", "negative momenta",
    "spherical pendulum, almost", "1e-3 past the bottom", "1e-3 past the top", "1e-20 past the top",
    "1e-20 off uniform", "within 1e-9 of the separatrix", "1e-30 beyond the separatrix",
    "1e-9 of weight", "slender and fast",
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
    def K(self):
        return self.mp.ellipk(self.m)

    @property
    def start(self):
        """The phase x₀ of the start, u = u₁ + (u₂ − u₁) sn²(w t + x₀)."""
        mp = self.mp
        if not self.falls:
            return -self.K if self.upper else mp.zero
        s2 = (self.u0 - self.low) / (self.middle - self.low)
        return -self.falls * mp.ellipf(mp.asin(mp.sqrt(s2)), self.m)

    @property
    def turns(self):
        """Φ₊ and Φ₋ over a period."""
        mp, reach = self.mp, self.middle - self.low
        plus = (self.a + self.b) / (1 + self.low) * mp.ellippi(-reach / (1 + self.low), self.m)
        minus = (self.a - self.b) / (1 - self.low) * mp.ellippi(reach / (1 - self.low), self.m)
        return plus / self.w, minus / self.w

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
    """T is 2K/w, Δφ the sum of the turns, and Δψ − κT their difference, by K and Π of mpmath."""
    begun, truth = named(name), textbook(name, digits)
    found = ht.enclose(begun.top, begun.start, digits)
    form, T = begun.form(digits), 2 * truth.K / truth.w
    plus, minus = truth.turns
    kappa = truth.omega3 - truth.b
    assert holds(found.period, T, digits)
    assert holds(found.precession, plus + minus, digits)
    assert holds(found.spin, kappa * T + plus - minus, digits)
    bound = truth.mp.mpf(10) ** -digits
    for got, want in (
        (form.period, T), (form.precession, plus + minus), (form.relative_spin, plus - minus),
        (form.modulus[0], truth.m), (form.modulus[1], 1 - truth.m),
        (form.mean_rates[0], 2 * plus / T), (form.mean_rates[1], 2 * minus / T),
    ):  # fmt: skip
        assert abs(truth.mp.mpf(got) - want) <= bound * max(1, abs(want))
    for got, want in zip(form.roots, (truth.low, truth.middle, truth.high), strict=True):
        assert abs(truth.mp.mpf(got) - want) <= bound * max(1, abs(want))


@pytest.mark.parametrize("digits", [50, 100])
@pytest.mark.parametrize("name", NUTATIONS)
def test_tilts_and_their_rates(name, digits):
    """u and u̇ by sn, cn and dn of mpmath, begun where the start is by its incomplete F."""
    begun, truth = named(name), textbook(name, digits)
    found, form, mp = ht.enclose(begun.top, begun.start, digits), begun.form(digits), truth.mp
    # (t − start)/T half way between turning points, just past one, and some periods later
    for part in ("0.25", "0.5000001", "-0.7", "3.1"):
        t = Fraction(part) * Fraction(float(form.period))
        u, udot = truth.tilt(mp.mpf(t.numerator) / t.denominator)
        assert holds(found.u(t), u, digits)
        at = form(t)
        bound = mp.mpf(10) ** -digits
        assert abs(mp.mpf(at.u) - u) <= bound
        assert abs(mp.mpf(at.udot) - udot) <= bound * max(1, begun.rising.rate)
        phidot = (truth.a - truth.b * u) / (1 - u * u)
        assert abs(mp.mpf(at.phidot) - phidot) <= bound * max(1, abs(phidot))
        assert abs(mp.mpf(at.psidot) - truth.omega3 + phidot * u) <= bound * max(
            1, abs(truth.omega3), begun.rising.rate
        )


@pytest.mark.parametrize("digits", [50, 100])
@pytest.mark.parametrize("name", NUTATIONS)
def test_by_carlson(name, digits):
    """The lower turning point nearest the start by R_F, the turns by R_F and R_J."""
    begun, truth = named(name), textbook(name, digits)
    mp, form = truth.mp, begun.form(digits)
    mc = (truth.high - truth.middle) / (truth.high - truth.low)
    K, lower = mp.elliprf(0, mc, 1), -truth.start / truth.w
    if truth.falls:
        s2 = (truth.u0 - truth.low) / (truth.middle - truth.low)
        carlson = mp.sqrt(s2) * mp.elliprf(1 - s2, 1 - truth.m * s2, 1)
        assert abs(carlson / abs(truth.start) - 1) < mp.mpf(10) ** (-digits - 50)
    turned = []
    for momentum, side in ((truth.a + truth.b, 1), (truth.a - truth.b, -1)):
        p = (1 + side * truth.middle) / (1 + side * truth.low)
        third = K + (1 - p) / 3 * mp.elliprj(0, mc, 1, p)
        turned.append(momentum / (1 + side * truth.low) * third / truth.w)
    for got, want in (
        (form.lower_turning, lower), (form.period, 2 * K / truth.w),
        (form.precession, sum(turned)), (form.relative_spin, turned[0] - turned[1]),
    ):  # fmt: skip
        size = max(1, abs(want), *map(abs, turned))
        assert abs(mp.mpf(got) - want) <= mp.mpf(10) ** -digits * size


@pytest.mark.parametrize("digits", [50, 100])
@pytest.mark.parametrize("name", ["loops", "falling", "1e-3 past the top"])
def test_angles_by_theta_functions_of_mpmath(name, digits):
    """φ + ψ and φ − ψ between two times as derivatives of their sweeps: against `jtheta`.

    Each half turns by a rate of its own and by twice the argument of θ₁(z − iβ), which is what
    mpmath's theta functions say here of a whole and of a part of a period.
    """
    begun, truth = named(name), textbook(name, digits)
    mp, form = truth.mp, begun.form(digits)
    q = mp.exp(-mp.pi * mp.ellipk(1 - truth.m) / truth.K)
    low, reach = truth.low, truth.middle - truth.low
    halves = []
    for momentum, side, own in ((truth.a + truth.b, 1, 0), (truth.a - truth.b, -1, 1)):
        near = 1 + side * (low if side > 0 else truth.middle)
        # sn²(i v) = −(1 + u₁)/(u₂ − u₁), or next to u₂ that of the complementary turning point
        tangent2 = near / reach
        if side < 0:
            tangent2 *= (truth.high - low) / (truth.high - 1)
        v = mp.ellipf(mp.atan(mp.sqrt(tangent2)), 1 - truth.m)
        beta = mp.pi * v / (2 * truth.K)
        halves.append((mp.sign(momentum), beta, own))
    turns = truth.turns
    for part in ("0.15", "0.4", "0.85"):
        t = mp.mpf(part) * mp.mpf(form.period)
        x0, x = truth.start / (2 * truth.K), (truth.w * t + truth.start) / (2 * truth.K)
        total = []
        for (sign, beta, own), turn in zip(halves, turns, strict=True):
            swept = []
            for place in (x0, x):
                z = place - mp.mpf(own) / 2
                n = mp.nint(z)
                theta = mp.jtheta(1, mp.pi * (z - n) + mp.mpc(0, 1) * beta, q)
                swept.append((turn - sign * mp.pi) * z + sign * (
                    mp.pi * n - mp.arg(theta / mp.mpc(0, 1))
                ))  # fmt: skip
            total.append(swept[1] - swept[0])
        at, begin = form(form.ctx.mpf(t)), form(0)
        bound = mp.mpf(10) ** (2 - digits)
        assert abs(mp.mpf(at.phi - begin.phi) - total[0] - total[1]) < bound
        kappa = truth.omega3 - truth.b
        assert abs(mp.mpf(at.psi - begin.psi) - kappa * t - total[0] + total[1]) < bound


def test_other_turns_are_told_apart():
    """A modulus or a root off by 1e-45 is seen at 50 digits: no bound here is too wide."""
    begun, truth = named("loops"), textbook("loops", 50)
    mp, found = truth.mp, ht.enclose(begun.top, begun.start, 50)
    wrong = mp.ellipk(truth.m * (1 + mp.mpf(10) ** -45))
    assert holds(found.period, 2 * truth.K / truth.w, 50)
    assert not holds(found.period, 2 * wrong / truth.w, 50)


# --- the functions as such -----------------------------------------------------------------------


TAUS = ("0.005", "0.1", "0.999", "1", "1.31", "4.3", "60")
PLACES = ("-0.5", "-0.47", "-1e-30", "0.2", "0.4999", "0.5", "0.6")
BITS = (64, 150, 380)


def thetas(z, tau):
    return acb.modular_theta(z, acb(0, tau))


@pytest.mark.parametrize("bits", BITS)
@pytest.mark.parametrize("tau", TAUS)
def test_functions_hold_what_arb_says(tau, bits):
    """sn = θ₃θ₁/θ₂θ₄, and likewise cn and dn; each ball is about as small as the bits allow."""
    with working(2 * bits + 400):
        _, two, three, four = (theta.real for theta in thetas(acb(0), arb(tau)))
        scales = three / two, four / two, four / three
        wants = []
        for x in PLACES:
            one_x, two_x, three_x, four_x = (th.real for th in thetas(acb(arb(x)), arb(tau)))
            over = (one_x, two_x, three_x)
            wants.append([k * th / four_x for k, th in zip(scales, over, strict=True)])
    with working(bits):
        jacobi = Jacobi(arb(tau))
        for x, want in zip(PLACES, wants, strict=True):
            for ball, truth in zip(jacobi.functions(arb(x)), want, strict=True):
                assert ball.overlaps(truth)
                assert ball.rad() < arb(2) ** (12 - bits) / min(arb(tau), arb(1))


@pytest.mark.parametrize("bits", BITS)
@pytest.mark.parametrize("tau", TAUS)
def test_the_argument_holds_what_arb_says(tau, bits):
    for x in PLACES:
        for part in ("1e-20", "0.2", "0.4999"):
            with working(2 * bits + 400):
                beta = arb(tau) * arb(part)
                truth = (acb(0, 1) * thetas(acb(arb(x), -beta), arb(tau))[0]).arg()
            with working(bits):
                ball = Jacobi(arb(tau)).argument(arb(x), arb(tau) * arb(part))
                assert ball.overlaps(truth), (x, part)
                assert ball.rad() < arb(2) ** (12 - bits) / min(arb(tau), arb(1)) ** 2


def test_without_a_modulus_they_are_circular():
    with working(100):
        sn, cn, dn = Jacobi(None).functions(arb("0.1"))
        for ball, want in zip((sn, cn, dn), (*arb("0.1").sin_cos_pi(), arb(1)), strict=True):
            assert ball.overlaps(want)
            assert ball.rad() < arb(2) ** -95


def test_what_is_not_known_well_enough_is_refused():
    """A number of periods known to no better than one, and a modulus that is not known."""
    with working(100):
        with pytest.raises(TooFewBits):
            Jacobi(arb(2)).functions(arb(0, 1))
        with pytest.raises(TooFewBits):
            Jacobi(arb(2, 1.9))
