"""The closed form against `mpmath.quad` of the reduced equation: times, φ and ψ at a tilt.

With u = m − d cos x between the turning points m ∓ d, the equation u̇² = f(u) is

    ẋ² = 2h + b² − 2g (2m + u),

whatever the sign of g. No elliptic integral, no theta function and no FLINT is in the integrals.
"""

from functools import cache

import mpmath
import pytest

import heavytop as ht

from .rigid_series import motion

KINDS = {
    "kicked": ("3.28e-4", "6.6e-5", "0.0456", "0.1", 0, 0, 0, -15, 140),
    "loops": (2, 1, 3, "0.5", "0.3", "-0.7", 0, -2, 5),
    "falling": (2, "1.5", 3, "1.5", "0.3", "-0.7", 1, "0.5", 3),
    "cusps": (2, 1, 3, "0.5", "0.3", "-0.7", 0, 0, 7),
    "upside down": (2, 1, -3, "0.5", "0.3", "-0.7", "0.25", -2, 5),
    "without weight": (2, 1, 0, "0.5", "0.3", "-0.7", "0.25", -2, 5),
    "1e-9 of weight": (2, 1, "1e-9", "0.5", "0.3", "-0.7", "0.25", -2, 5),
    "1e-3 past the bottom": (2, 1, 3, "2.5", 0, 0, 1, "0.001", "0.002"),
    "1e-3 past the top": (2, 1, 3, "0.001", 0, 0, 2, "0.5", "0.7"),
    "1e-20 off uniform": ("6.375e-3", "7.5e-4", "0.73575", "pi/3", 0, 0, "1e-20", 10, "135.6"),
    "1e-4 within the separatrix": (2, 1, 2, "pi/3", 0, 0, "0.5", 1, "2.4999"),
    "1e-4 beyond the separatrix": (2, 1, 2, "pi/3", 0, 0, "0.5", 1, "2.5001"),
    "slender and fast": (1, "0.001", 3, 1, 1, 2, "0.5", 1, 3000),
}
PARTS = ("0.3", "1.3", "2.6")  # x, of π


class Reduced:
    """One motion by mpmath alone."""

    def __init__(self, begun, digits):
        self.mp = mp = mpmath.MPContext()
        mp.dps = digits + 40
        top, start = begun.top, begun.start
        A, C, gMR = (x.mpf(mp) for x in (top.A, top.C, top.gMR))
        theta, rate, turn, self.omega3 = (
            x.mpf(mp) for x in (start.theta, start.thetadot, start.phidot, start.omega3)
        )
        u0, sine = mp.cos(theta), mp.sin(theta)
        g, self.b = gMR / A, C * self.omega3 / A
        self.a = turn * sine**2 + self.b * u0
        h = (rate**2 + (turn * sine) ** 2) / 2 + g * u0
        f = [2 * g, -(2 * h + self.b**2), 2 * (self.a * self.b - g), 2 * h - self.a**2]
        f = f if g else f[1:]
        found = sorted(mp.polyroots(f, maxsteps=3000, extraprec=800, error=False), key=mp.re)
        inner = [mp.re(u) for u in found if abs(mp.re(u)) <= 1][: 2 if g >= 0 else None][-2:]
        low, high = inner
        self.middle, self.reach = (low + high) / 2, (high - low) / 2
        self.g, self.fast = g, 2 * h + self.b**2 - 4 * g * self.middle

    def u(self, x):
        return self.middle - self.reach * self.mp.cos(x)

    def slow(self, x):
        """dt/dx."""
        return 1 / self.mp.sqrt(self.fast - 2 * self.g * self.u(x))

    def turn(self, x):
        """dφ/dx."""
        return (self.a - self.b * self.u(x)) / (1 - self.u(x) ** 2) * self.slow(x)

    def spin(self, x):
        """dψ/dx = (ω₃ − φ̇ u) dt/dx."""
        return self.omega3 * self.slow(x) - self.turn(x) * self.u(x)

    def integrals(self, end):
        """Time, φ and ψ from the largest θ to x, in pieces that are short beside turning points."""
        mp = self.mp
        cuts = [mp.mpf(10) ** -k for k in (0, 2, 4)]
        ends = [mp.zero, *reversed(cuts), mp.pi - 1, *(mp.pi - c for c in cuts[1:]), mp.pi]
        ends = [x for x in sorted(ends) if x < end] + [end]
        return [mp.quad(rate, ends) for rate in (self.slow, self.turn, self.spin)]


@cache
def reduced(name, digits):
    return Reduced(motion(*KINDS[name]), digits)


@pytest.mark.parametrize("digits", [50, 100])
@pytest.mark.parametrize("name", KINDS)
def test_what_a_period_brings(name, digits):
    begun, truth = motion(*KINDS[name]), reduced(name, digits)
    found, mp = ht.enclose(begun.top, begun.start, digits), truth.mp
    wanted = [2 * part for part in truth.integrals(+mp.pi)]
    for ball, want in zip((found.period, found.precession, found.spin), wanted, strict=True):
        middle = mp.mpf(ball.middle.numerator) / ball.middle.denominator
        assert ball.digits >= digits
        assert abs(middle - want) <= mp.mpf(10) ** (2 - digits) * max(1, abs(want))


@pytest.mark.parametrize("digits", [50, 100])
@pytest.mark.parametrize("name", KINDS)
def test_time_and_angles_at_a_tilt(name, digits):
    """From the largest θ on, t, φ and ψ at a tilt, and θ at that time; before it, mirrored."""
    begun, truth = motion(*KINDS[name]), reduced(name, digits)
    form, mp = begun.form(digits + 10), truth.mp
    lowest = mp.mpf(form.lower_turning)
    if begun.rising.regime.mirrored:
        lowest += mp.mpf(form.period) / 2
    at_lowest = form(form.ctx.mpf(lowest))
    close = mp.mpf(10) ** (2 - digits)
    for part in PARTS if digits == 50 else PARTS[1:2]:
        x = mp.mpf(part) * mp.pi / 3
        t, turned, spun = truth.integrals(x)
        for side in (1, -1):
            at = form(form.ctx.mpf(lowest + side * t))
            assert abs(mp.mpf(at.u) - truth.u(x)) <= close
            for name_, want in (("phi", turned), ("psi", spun)):
                got = side * (mp.mpf(getattr(at, name_)) - mp.mpf(getattr(at_lowest, name_)))
                assert abs(got - want) <= close * max(1, abs(want), abs(mp.mpf(at.psi))), name_
