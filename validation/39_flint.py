"""FLINT's balls: rigorous integrals, and Weierstrass's elliptic function.

A ball holds what it stands for; where the closed form at 75 digits lies outside, it is wrong. The
integrals know nothing of elliptic functions, and Weierstrass's function nothing of Jacobi's.
"""

from functools import cache

import flint
import mpmath
from flint import acb, arb
from tools import HUNDRED_STEPS, Digits, most, motion_of

import heavytop as ht
from heavytop.claims import Authority, claim
from heavytop.exact.balls import rational_ball

FLINT = Authority(
    "FLINT's interval arithmetic: rigorous integrals, Weierstrass's function", "program"
)


flint.ctx.prec = 300
mp = mpmath.MPContext()
mp.dps = 90
DIGITS = 75  # asked of the closed form
HAS = "75 digits are requested; the interval arithmetic has 90"
OURS = 30  # asked of our own enclosures
NAMES = ("sicm-kicked", "sicm-forward", "simo-wong", "lie-group-benchmark")
TIMES = ("0.1", "1", "2", "7.5")


class Cubic:
    """f(u) = (2/A)(E' - gMR u)(1 - u^2) - ((p_phi - p_psi u)/A)^2 of a scene released at rest."""

    def __init__(self, name):
        self.scene = ht.load_scene(name)
        top, start = self.scene.top, self.scene.start
        exact = top.A, top.C, top.gMR, start.theta, start.phidot, start.omega3
        A, C, gMR, theta, turn, omega3 = (x.ball(flint.ctx.prec) for x in exact)
        u, sine = theta.cos(), theta.sin()
        self.b, self.g = C * omega3 / A, gMR / A
        self.a, self.h = turn * sine**2 + self.b * u, (turn * sine) ** 2 / 2 + self.g * u
        # u0 is a root; the other two solve the quotient, a quadratic
        self.omega3 = omega3
        self.u0, half = u, -(2 * self.h + self.b**2) / (2 * self.g)
        p, q = half + u, (2 * self.a * self.b / (2 * self.g) - 1) + u * (half + u)
        root = (p * p - 4 * q).sqrt()
        one, other = (-p - root) / 2, (-p + root) / 2
        self.low, self.middle = (one, u) if float(one) < float(u) else (u, one)
        self.high, self.at_middle = other, float(one) < float(u)

    def speed(self, angle, analytic):
        """The rate of the angle that makes u = low + (middle - low) sin^2(angle), and that u."""
        u = acb(self.low) + acb(self.middle - self.low) * angle.sin() ** 2
        return ((acb(self.high) - u) * acb(self.g / 2)).sqrt(analytic=analytic), u

    @property
    def period(self):
        whole = acb.integral(lambda x, flag: 2 / self.speed(x, flag)[0], 0, acb.pi() / 2)
        return whole.real

    def turned(self, weight):
        """The integral of phidot over a period, with a weight that depends on u."""

        def rate(angle, flag):
            speed, u = self.speed(angle, flag)
            return 2 * weight(u) * (acb(self.a) - acb(self.b) * u) / ((1 - u * u) * speed)

        return acb.integral(rate, 0, acb.pi() / 2).real

    @property
    def precession(self):
        return self.turned(lambda _: 1)

    @property
    def spin(self):
        return self.omega3 * self.period - self.turned(lambda u: u)

    def u(self, t):
        """cos(theta) by Weierstrass's function; u'^2 = f(u) is its equation, stretched."""
        low, middle, high = self.low, self.middle, self.high
        m = (middle - low) / (high - low)
        tau = acb(0, 1) * acb(1 - m).elliptic_k() / acb(m).elliptic_k()
        period = 2 * acb(m).elliptic_k().real / (self.g * (high - low) / 2).sqrt()
        place = acb(arb(t) / period + (arb(1) / 2 if self.at_middle else 0)) + tau / 2
        shift = (low + middle + high) / 3  # the roots of Weierstrass's cubic add up to zero
        return (place.elliptic_p(tau) * 2 / acb(self.g * period**2)).real + shift


@cache
def cubics():
    return tuple(Cubic(name) for name in NAMES)


def form(cubic):
    return Digits(motion_of(cubic.scene), DIGITS)


def off(enclosure, value):
    """How far a number is from the ball, and 1 if the ball says nothing."""
    mine = arb(mp.nstr(mp.mpf(value), 88))
    apart = abs(enclosure - mine) / most(1.0, abs(float(mine)))
    return 1.0 if float(enclosure.rad()) > 1e-68 else float(apart.abs_upper())


@claim(FLINT, 1e-86, HAS, "closed form")
def flint_period():
    """period of four scenes at 75 digits vs a rigorous integral, relative to max(1, T)."""
    return most(off(x.period, form(x).period) for x in cubics())


@claim(FLINT, 1e-74, f"{HAS}, and lose thirteen where 1 + u₁ = 2.6e-13", "closed form")
def flint_precession():
    """Δφ in a period of four scenes at 75 digits vs a rigorous integral, relative to max(1, Δφ)."""
    return most(off(x.precession, form(x).precession) for x in cubics())


@claim(FLINT, 1e-84, f"{HAS}, and lose four", "closed form")
def flint_weierstrass():
    """cos θ of four scenes at four times at 75 digits vs Weierstrass's function."""
    return most(off(x.u(t), form(x)(t).u) for x in cubics() for t in TIMES)


@claim(FLINT, 0, "an integral without elliptic functions; both are FLINT's balls", "enclosures")
def flint_enclosures():
    """number of twelve enclosures at 30 digits that miss FLINT's integral or are wider than 1e-30.

    Our own enclosures that do not hold FLINT's integral, or are wider than was asked for.
    """
    missed = 0
    for cubic in cubics():
        motion = motion_of(cubic.scene)
        for name in ("period", "precession", "spin"):
            mine, theirs = motion.interval(name, digits=OURS), getattr(cubic, name)
            spread, middle = rational_ball(mine.spread), rational_ball(mine.middle)
            holds = bool(abs(middle - theirs) < spread)  # for all of both balls
            narrow = bool(spread <= arb(10) ** -OURS * abs(middle).max(arb(1)))
            missed += not (holds and narrow)
    return missed


@claim(FLINT, 1e-14, HUNDRED_STEPS, "integrator")
def flint_run():
    """cos θ of the runs at four times vs Weierstrass's function."""
    off = []
    for cubic in cubics():
        run = ht.propagate(ht.load_scene(cubic.scene.name, ["span.time=7.5"]))
        off += [abs(float(run(float(t)).axis[2]) - float(cubic.u(t))) for t in TIMES]
    return most(off)
