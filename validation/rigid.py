"""An independent rigid body with a fixed point: Euler's equations by Taylor series in integers.

It knows no symmetry, no angles and no elliptic functions, and imports nothing of the package. In
the body, with principal moments I, the unit vector r to the centre of mass, the vertical gamma and
the quaternion q (scalar first, body to space),

    I omega' = (I omega) x omega + gMR gamma x r,  gamma' = gamma x omega,  q' = q omega / 2.

Numbers are integers of 2^-BITS; a step is as long as the last terms of the series allow.
"""

import math
from fractions import Fraction
from operator import mul

import mpmath

BITS = 200
ORDER = 40
DROPPED = 140  # bits below 1 at which a series is cut

mp = mpmath.MPContext()
mp.prec = BITS


def fixed(value):
    """Return a number in units of 2^-BITS."""
    return int(mp.nint(mp.ldexp(mpf(value), BITS)))


def mpf(value):
    """Return a decimal string, a Fraction or a number of any other kind as an mpf."""
    if isinstance(value, Fraction):
        return mp.mpf(value.numerator) / value.denominator
    return mp.mpf(value)


def from_angles(theta, phi=0, psi=0):
    """Return the quaternion of R = Rz(phi) Rx(theta) Rz(psi)."""
    half, plus, minus = mpf(theta) / 2, (mpf(phi) + mpf(psi)) / 2, (mpf(phi) - mpf(psi)) / 2
    c, s = mp.cos(half), mp.sin(half)
    return c * mp.cos(plus), s * mp.cos(minus), s * mp.sin(minus), c * mp.sin(plus)


def body_rates(theta, psi, thetadot, phidot, psidot):
    """Return omega in the body, from the rates of the angles."""
    s, c = mp.sin(mpf(theta)), mp.cos(mpf(theta))
    across = mpf(phidot) * s
    cosine, sine = mp.cos(mpf(psi)), mp.sin(mpf(psi))
    thetadot = mpf(thetadot)
    return (
        across * sine + thetadot * cosine,
        across * cosine - thetadot * sine,
        mpf(phidot) * c + mpf(psidot),
    )


def times(p, q):
    """Return the product of two quaternions."""
    w, x, y, z = p
    a, b, c, d = q
    return (
        w * a - x * b - y * c - z * d,
        w * b + x * a + y * d - z * c,
        w * c - x * d + y * a + z * b,
        w * d + x * c - y * b + z * a,
    )


def conjugate(q):
    """Return the inverse of a unit quaternion."""
    w, x, y, z = q
    return w, -x, -y, -z


def rotated(q, vector):
    """Return R(q) vector."""
    return times(times(q, (0, *vector)), conjugate(q))[1:]


class Body:
    """A body at the times it is taken to; `phi` and `psi` are followed when its axis is z."""

    def __init__(self, moments, gMR, arm, q, omega, longest=math.inf):
        self.arm, self.longest, self.t = arm, longest, Fraction(0)
        moments = [mpf(x) for x in moments]
        self.gyric = [
            fixed((moments[(i + 1) % 3] - moments[(i + 2) % 3]) / moments[i]) for i in range(3)
        ]
        self.pull = [fixed(mpf(gMR) / x) for x in moments]
        gamma = rotated(conjugate(q), (0, 0, 1))
        self.state = [fixed(x) for x in (*omega, *gamma, *q)]
        self.turns = [0.0, 0.0]  # phi + psi and phi - psi, followed

    def at(self, times):
        """Go to one time after another."""
        for time in times:
            while self.t < Fraction(time):
                self._step(Fraction(time) - self.t)
            yield self

    @property
    def q(self):
        """The quaternion."""
        return tuple(mp.ldexp(mp.mpf(x), -BITS) for x in self.state[6:])

    @property
    def omega(self):
        """The angular velocity in space."""
        return rotated(self.q, [mp.ldexp(mp.mpf(x), -BITS) for x in self.state[:3]])

    @property
    def axis(self):
        """The arm in space."""
        return rotated(self.q, self.arm)

    @property
    def angles(self):
        """theta, phi and psi, continuous from a start with phi = psi = 0."""
        w, x, y, z = self.q
        plus, minus = (2 * mp.atan2(*pair) for pair in ((z, w), (y, x)))
        plus, minus = (
            a + 2 * mp.pi * mp.nint((turned - a) / (2 * mp.pi))
            for a, turned in zip((plus, minus), self.turns, strict=True)
        )
        return mp.atan2(mp.hypot(x, y), mp.hypot(w, z)) * 2, (plus + minus) / 2, (plus - minus) / 2

    def _step(self, left):
        terms = self._series()
        growth = max((abs(x[-1]).bit_length() - BITS) / ORDER for x in terms)
        h = Fraction(min(2 ** (-DROPPED / ORDER - growth), self.longest))
        h = min(h.limit_denominator(2**40), left)
        size, before = fixed(h), self._directions()
        for i, series in enumerate(terms):
            value = 0
            for term in reversed(series):
                value = term + (value * size >> BITS)
            self.state[i] = value
        self.t += h
        for i, (old, new) in enumerate(zip(before, self._directions(), strict=True)):
            self.turns[i] += (new - old + math.pi) % (2 * math.pi) - math.pi

    def _directions(self):
        w, x, y, z = (math.ldexp(x >> (BITS - 60), -60) for x in self.state[6:])
        return 2 * math.atan2(z, w), 2 * math.atan2(y, x)

    def _series(self):
        terms = [[x] for x in self.state]
        for k in range(1, ORDER + 1):
            rates = self._rates(*terms)
            for series, rate in zip(terms, rates, strict=True):
                series.append(rate // k)
        return terms

    def _rates(self, w1, w2, w3, g1, g2, g3, q0, q1, q2, q3):
        """Return the newest coefficients of the derivatives."""

        def product(a, b):
            return sum(map(mul, a, reversed(b))) >> BITS

        w, g, r = (w1, w2, w3), (g1, g2, g3), self.arm
        crossed = [(1, 2), (2, 0), (0, 1)]
        spins = (
            (
                self.gyric[i] * product(w[j], w[k])
                + self.pull[i] * (g[j][-1] * r[k] - g[k][-1] * r[j])
            )
            >> BITS
            for i, (j, k) in enumerate(crossed)
        )
        falls = (product(g[j], w[k]) - product(g[k], w[j]) for j, k in crossed)
        halves = (
            -product(q1, w1) - product(q2, w2) - product(q3, w3),
            product(q0, w1) + product(q2, w3) - product(q3, w2),
            product(q0, w2) + product(q3, w1) - product(q1, w3),
            product(q0, w3) + product(q1, w2) - product(q2, w1),
        )
        return (*spins, *falls, *(x // 2 for x in halves))


def attitudes_apart(a, b):
    """Return the distance of two quaternions; one and its negative are the same attitude."""
    return min(farthest(a, b), farthest(a, [-x for x in b]))


def farthest(a, b):
    """Return the largest difference of two sequences of numbers, none where one of them is none."""
    apart = [float(abs(mpf(x) - mpf(y))) for x, y in zip(a, b, strict=True)]
    return math.nan if any(map(math.isnan, apart)) else max(apart)
