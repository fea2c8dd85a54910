"""The solution's elliptic integrals and functions against mpmath's own, at 50 and 100 digits.

mpmath shares no line with FLINT, of which the solution is made. Its functions get the roots that
mpmath finds of the cubic, from the numbers of the scene.
"""

from fractions import Fraction
from functools import cache

import pytest

from .. import views
from ..by_hand import ByHand
from ..motions import FURTHER, named
from ..views import Bounds

pytestmark = pytest.mark.reference

# g ≥ 0, released at a turning point or anywhere between; both sides of the poles and close to them
NUTATIONS = ("rising", "falling", "cusps", "within 1e-9 of the separatrix", *FURTHER)


class Textbook(ByHand):
    """The closed form by mpmath alone: roots by `polyroots`, K, Π and sn by its own functions."""

    def __init__(self, begun, digits):
        # so many may be lost by the roots, and by Π(n|m) next to a pole
        super().__init__(begun.top, begun.start, digits + 260)
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

    @property
    def turns(self):
        """Φ₊ and Φ₋ over a period, by Π(n|m)."""
        reach, third = self.middle - self.low, self.mp.ellippi
        plus = (self.a + self.b) / (1 + self.low) * third(-reach / (1 + self.low), self.m)
        minus = (self.a - self.b) / (1 - self.low) * third(reach / (1 - self.low), self.m)
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
    assert ball.digits >= digits
    return views.holds(ball, value, 2 * digits)


@pytest.mark.parametrize("digits", [50, 100])
@pytest.mark.parametrize("name", NUTATIONS)
def test_periods_and_turns(name, digits):
    """T is 2K/w, Δφ the sum of the turns, and Δψ − κT their difference."""
    truth, found = textbook(name, digits), Bounds(named(name), digits)
    T, (plus, minus) = 2 * truth.mp.ellipk(truth.m) / truth.w, truth.turns
    spin = (truth.omega3 - truth.b) * T + plus - minus
    for got, want in (
        (found.period, T), (found.precession, plus + minus), (found.spin, spin),
        (found.relative_spin, plus - minus), (found.lower_turning, -truth.start / truth.w),
        *zip(found.modulus, (truth.m, 1 - truth.m), strict=True),
        *zip(found.mean_rates, (2 * plus / T, 2 * minus / T), strict=True),
        *zip(found.roots, (truth.low, truth.middle, truth.high), strict=True),
    ):  # fmt: skip
        assert holds(got, want, digits)


@pytest.mark.parametrize("name", NUTATIONS)
def test_constants_of_the_motion(name):
    """Energies and momenta, by their formulas in Euler's angles."""
    begun, truth = named(name), textbook(name, 50)
    A, C = (x.mpf(truth.mp) for x in (begun.top.A, begun.top.C))
    E_prime, p_phi, p_psi = A * truth.h, A * truth.a, A * truth.b
    known = {"E": E_prime + p_psi**2 / (2 * C), "E_prime": E_prime, "p_phi": p_phi, "p_psi": p_psi}
    for constant, value in begun.integrals(50)._asdict().items():
        assert abs(value - known[constant]) < truth.mp.mpf(10) ** -46 * (1 + abs(value)), constant


@pytest.mark.parametrize("digits", [50, 100])
@pytest.mark.parametrize("name", NUTATIONS)
def test_tilts_and_their_rates(name, digits):
    """u and u̇ by sn, cn and dn of mpmath, begun where the start is by its incomplete F."""
    truth, found = textbook(name, digits), Bounds(named(name), digits)
    # (t − start)/T half way between turning points, just past one, and some periods later
    for part in ("0.25", "0.5000001", "-0.7", "3.1"):
        t = Fraction(part) * Fraction(found.period.mid)
        u, udot = truth.tilt(truth.mp.mpf(t.numerator) / t.denominator)
        phidot = (truth.a - truth.b * u) / (1 - u * u)
        rates = {"udot": udot, "phidot": phidot, "psidot": truth.omega3 - phidot * u}
        for quantity, value in ({"u": u} | rates).items():
            assert holds(found(quantity, t), value, digits), quantity


@pytest.mark.parametrize("name", ["kicked", "rising", "falling", "negative momenta"])
def test_angles_by_theta_functions(name):
    """φ and ψ as docs/theory/elliptic.md writes them, by mpmath's θ₁."""
    begun, truth = named(name), textbook(name, 50)
    mp, m, w, low, high = truth.mp, truth.m, truth.w, truth.low, truth.high
    K, other, reach = mp.ellipk(m), mp.ellipk(1 - m), truth.middle - truth.low
    nome, T = mp.exp(-mp.pi * other / K), 2 * K / w
    t, start = T * mp.mpf("0.3"), truth.start

    def swept(x, v):  # π/2 − arg θ₁, zero at the turning point
        return -mp.arg(mp.jtheta(1, mp.pi / (2 * K) * mp.mpc(x, v), nome) / mp.j)

    def grown(turn, tangent_squared, x):  # Φ since x, the start being t = 0
        v = mp.ellipf(mp.atan(mp.sqrt(tangent_squared)), 1 - m)
        sign = mp.sign(turn)
        return (turn - sign * mp.pi) / T * t + sign * (swept(x + w * t, v) - swept(x, v))

    up = (1 - truth.middle) * (high - low) / (reach * (high - 1))
    plus, minus = truth.turns
    by_top = start - K if start > 0 else start + K
    plus, minus = grown(plus, (1 + low) / reach, start), grown(minus, up, by_top)
    at, begins = begun.at(t, 50), begun.at(0, 50)
    kappa = truth.omega3 - truth.b
    assert abs(mp.mpf(at.phi) - mp.mpf(begins.phi) - plus - minus) < mp.mpf(10) ** -48
    assert abs(mp.mpf(at.psi) - mp.mpf(begins.psi) - kappa * t - plus + minus) < mp.mpf(10) ** -46
