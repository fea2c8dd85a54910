"""The closed form against `mpmath.quad` of the reduced equation: times, φ and ψ at a tilt.

With u = m − d cos x between the turning points m ∓ d, the equation u̇² = f(u) is

    ẋ² = 2h + b² − 2g (2m + u),

whatever the sign of g. No elliptic integral, no theta function and no FLINT is in the integrals.
"""

from functools import cache

import pytest

from ..by_hand import ByHand
from ..motions import named
from ..views import Bounds, Digits

pytestmark = [pytest.mark.reference, pytest.mark.slow]

KINDS = (
    "kicked", "loops", "falling", "cusps", "hanging upside down", "force-free", "1e-9 of weight",
    "1e-3 past the bottom", "1e-3 past the top", "1e-20 off uniform", "1e-4 within the separatrix",
    "1e-4 beyond the separatrix", "slender and fast",
)  # fmt: skip
CASES = [(n, 50) for n in KINDS] + [(n, 100) for n in KINDS[1:9:2]]
PARTS = ("0.3", "1.3", "2.6")  # x, of π


class Reduced(ByHand):
    """One motion by mpmath alone."""

    def __init__(self, begun, digits):
        super().__init__(begun.top, begun.start, digits + 40)
        inner = [u for u in self.roots if abs(u) <= 1]
        low, high = inner[:2] if self.g >= 0 else inner[-2:]
        self.middle, self.reach = (low + high) / 2, (high - low) / 2
        self.fast = 2 * self.h + self.b**2 - 4 * self.g * self.middle

    def u(self, x):
        return self.middle - self.reach * self.mp.cos(x)

    def dt(self, x):
        """dt/dx."""
        return 1 / self.mp.sqrt(self.fast - 2 * self.g * self.u(x))

    def dphi(self, x):
        """dφ/dx."""
        return (self.a - self.b * self.u(x)) / (1 - self.u(x) ** 2) * self.dt(x)

    def dpsi(self, x):
        """dψ/dx = (ω₃ − φ̇ u) dt/dx."""
        return self.omega3 * self.dt(x) - self.dphi(x) * self.u(x)

    def integrals(self, end):
        """Time, φ and ψ from the largest θ to x, in pieces that are short beside turning points."""
        mp = self.mp
        cuts = [mp.mpf(10) ** -k for k in (0, 2, 4)]
        ends = [mp.zero, *reversed(cuts), mp.pi - 1, *(mp.pi - c for c in cuts[1:]), mp.pi]
        ends = [x for x in sorted(ends) if x < end] + [end]
        return [mp.quad(rate, ends) for rate in (self.dt, self.dphi, self.dpsi)]


@cache
def reduced(name, digits):
    return Reduced(named(name), digits)


@pytest.mark.slow
@pytest.mark.parametrize(("name", "digits"), CASES)
def test_what_a_period_brings(name, digits):
    begun, truth = named(name), reduced(name, digits)
    found, mp = Bounds(begun, digits), truth.mp
    wanted = [2 * part for part in truth.integrals(+mp.pi)]
    for ball, want in zip((found.period, found.precession, found.spin), wanted, strict=True):
        middle = mp.mpf(ball.middle.numerator) / ball.middle.denominator
        assert ball.digits >= digits
        assert abs(middle - want) <= mp.mpf(10) ** (2 - digits) * max(1, abs(want))


@pytest.mark.slow
@pytest.mark.parametrize(("name", "digits"), CASES)
def test_time_and_angles_at_a_tilt(name, digits):
    """From the largest θ on, t, φ and ψ at a tilt, and θ at that time; before it, mirrored."""
    begun, truth = named(name), reduced(name, digits)
    form, mp = Digits(begun, digits + 10), truth.mp
    lowest = mp.mpf(form.lower_turning)
    if begun.regime.mirrored:
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
