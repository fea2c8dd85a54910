"""mpmath at 125 digits: its own elliptic functions, with its own convention m = k^2."""

from functools import cache

import mpmath
from claim import claimed, finish, most
from flint import arb, fmpq

import heavytop as ht
from heavytop.analytic.solution import first_kind
from heavytop.numbers.intervals import working

mp = mpmath.MPContext()
mp.dps = 130
DIGITS = 125  # asked of the closed form
TIMES = ("0.1", "1", "2", "7.5")
NAMES = ("sicm-kicked", "sicm-forward", "simo-wong", "spherical-pendulum")


BITS = 700  # of the closed form's integrals, for the parameters m of the scenes
CHARACTERISTICS = (-20, -1, 3, 6)  # sevenths, on both sides of zero
TANGENTS = (3, 58)  # tenths


def middle(ball):
    man, exp = ball.mid().man_exp()
    return mp.mpf((int(man), int(exp)))


def nutations():
    """The closed form of each scene in balls, to be used at the working precision."""
    for name in NAMES:
        scene = ht.load_scene(name)
        yield ht.Motion(scene.top, scene.start).rising.solution(BITS).path


def relative(found, exact):
    return abs(mp.mpf(found) / exact - 1)


@claimed("mpmath-first")
def _():
    with working(BITS):
        found = [(path.K, mp.pi / 2, path.roots.m) for path in nutations()]
        found += [
            (first_kind(arb(fmpq(x, 10)), path.roots.mc), mp.atan(mp.mpf(x) / 10), path.roots.m)
            for path in nutations()
            for x in TANGENTS
        ]
    return most(relative(middle(F), mp.ellipf(x, middle(m))) for F, x, m in found)


@claimed("mpmath-third")
def _():
    with working(BITS):
        found = [
            (path.third_kind(arb(fmpq(7 - n, 7))), mp.mpf(n) / 7, path.roots.m)
            for path in nutations()
            for n in CHARACTERISTICS
        ]
    return most(relative(middle(Pi), mp.ellippi(n, middle(m))) for Pi, n, m in found)


class Formula:
    """The textbook's closed form, from the scene's numbers, by mpmath alone."""

    def __init__(self, name):
        self.name, self.scene = name, ht.load_scene(name)
        top, start = self.scene.top, self.scene.start
        self.A, self.C, self.gMR = (x.mpf(mp) for x in (top.A, top.C, top.gMR))
        theta, rate, turn = (x.mpf(mp) for x in (start.theta, start.thetadot, start.phidot))
        u, sine = mp.cos(theta), mp.sin(theta)
        self.p_psi = self.C * start.omega3.mpf(mp)
        self.p_phi = self.A * turn * sine**2 + self.p_psi * u
        energy = self.A * (rate**2 + (turn * sine) ** 2) / 2 + self.gMR * u
        self.roots = self._roots(energy)
        low, middle, high = self.roots
        self.w = mp.sqrt(self.gMR * (high - low) / (2 * self.A))
        self.m = (middle - low) / (high - low)
        self.upper = abs(u - middle) < abs(u - low)  # released at a turning point: which one

    def _roots(self, energy):
        """Roots of (2/A)(E' - gMR u)(1 - u^2) - ((p_phi - p_psi u)/A)^2."""
        A, g, a, b = self.A, self.gMR, self.p_phi / self.A, self.p_psi / self.A
        polynomial = [
            2 * g / A, -2 * energy / A - b**2, 2 * a * b - 2 * g / A, 2 * energy / A - a**2,
        ]  # fmt: skip
        roots = mp.polyroots(polynomial, maxsteps=500, extraprec=600)
        return sorted(mp.re(x) for x in roots)

    @property
    def period(self):
        return 2 * mp.ellipk(self.m) / self.w

    @property
    def precession(self):
        low, middle, _ = self.roots
        terms = (
            (self.p_phi - self.p_psi) / (1 - low) * mp.ellippi((middle - low) / (1 - low), self.m),
            (self.p_phi + self.p_psi) / (1 + low) * mp.ellippi(-(middle - low) / (1 + low), self.m),
        )
        return sum(terms) / (self.A * self.w)

    def theta(self, t):
        low, middle, _ = self.roots
        angle = self.w * t + (mp.ellipk(self.m) if self.upper else 0)
        return mp.acos(low + (middle - low) * mp.ellipfun("sn", angle, m=self.m) ** 2)


@cache
def formulas():
    return tuple(Formula(name) for name in NAMES)


def form(formula):
    return ht.Motion(formula.scene.top, formula.scene.start).form(DIGITS)


@claimed("mpmath-period")
def _():
    return most(relative(form(x).period, x.period) for x in formulas())


@claimed("mpmath-precession")
def _():
    return most(relative(form(x).precession, x.precession) for x in formulas())


@claimed("mpmath-tilt")
def _():
    off = (
        abs(mp.mpf(form(x)(form(x).ctx.mpf(t)).theta) - x.theta(mp.mpf(t)))
        for x in formulas()
        for t in TIMES
    )
    return most(off)


@claimed("mpmath-tilt-run")
def _():
    scene = ht.load_scene("sicm-kicked", ["want.digits=30"])
    run = ht.propagate(scene, formulation="axis")
    truth = next(x for x in formulas() if x.name == "sicm-kicked")
    return most(
        abs(mp.mpf(str(s.theta)) - truth.theta(mp.mpf(str(s.t))))
        for s in run.decimals.samples[1::100]
    )


finish()
