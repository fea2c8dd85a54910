"""mpmath at 100 digits: its own elliptic functions, with its own convention m = k^2."""

from functools import cache

import mpmath
from tools import Digits, most, motion_of, relative

import heavytop as ht
from heavytop.claims import Authority, claim

MPMATH = Authority("mpmath's elliptic functions at 100 digits and more", "program")


mp = mpmath.MPContext()
mp.dps = 130
DIGITS = 125  # asked of the closed form
EVALUATED = "125 digits are requested; the formula is evaluated with 130"
TIMES = ("0.1", "1", "2", "7.5")
NAMES = ("sicm-kicked", "sicm-forward", "simo-wong", "spherical-pendulum")


class Formula:
    """The textbook's closed form, from the scene's numbers, by mpmath alone."""

    def __init__(self, scene):
        self.name, self.scene, top, start = scene.name, scene, scene.top, scene.start
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
        self.risen = (u - low) / (middle - low)

    def _roots(self, energy):
        """Roots of (2/A)(E' - gMR u)(1 - u^2) - ((p_phi - p_psi u)/A)^2."""
        a, b = self.p_phi / self.A, self.p_psi / self.A
        g, h = 2 * self.gMR / self.A, 2 * energy / self.A
        polynomial = [g, -h - b**2, 2 * a * b - g, h - a**2]
        roots = mp.polyroots(polynomial, maxsteps=500, extraprec=600)
        return sorted(mp.re(x) for x in roots)

    @property
    def period(self):
        return 2 * mp.ellipk(self.m) / self.w

    @property
    def thirds(self):
        """Π(n|m) of either half of the precession, n below and above zero, and what times it."""
        low, middle, _ = self.roots
        for momentum, side in ((self.p_phi + self.p_psi, 1), (self.p_phi - self.p_psi, -1)):
            far = 1 + side * low
            third = mp.ellippi(-side * (middle - low) / far, self.m)
            yield third, momentum / (far * self.A * self.w)

    @property
    def precession(self):
        return sum(third * factor for third, factor in self.thirds)

    def theta(self, t):
        low, middle, _ = self.roots
        angle = self.w * t + (mp.ellipk(self.m) if self.upper else 0)
        return mp.acos(low + (middle - low) * mp.ellipfun("sn", angle, m=self.m) ** 2)


@cache
def formulas():
    return tuple(Formula(ht.load_scene(name)) for name in NAMES)


@cache
def moving():
    """The same tops, started between their turning points: up, down and fast."""
    rates = ("-0.7", "0.7", "5")
    with mp.workdps(160):
        scenes = (ht.load_scene(n, [f'start.thetadot="{x}"']) for n in NAMES for x in rates)
        return tuple(map(Formula, scenes))


def form(formula):
    return Digits(motion_of(formula.scene), DIGITS)


@claim(MPMATH, 1e-133, "125 digits are requested; ten more are correct", "closed form")
def mpmath_first():
    """F and K for the times of twelve motions at 125 digits vs mpmath's, relative."""
    with mp.workdps(160):
        off = []
        for x in moving():
            part = mp.ellipf(mp.asin(mp.sqrt(x.risen)), x.m)
            off.append(relative(form(x).period * x.w / 2, mp.ellipk(x.m)))
            off.append(relative(abs(form(x).lower_turning) * x.w, part))
        return most(off)


@claim(MPMATH, 1e-134, "125 digits are requested; ten more are correct", "closed form")
def mpmath_third():
    """Π(n|m) for the angles of twelve motions at 125 digits, n of either sign, vs mpmath's,
    relative.
    """
    off = []
    with mp.workdps(160):
        for x in moving():
            for side, (third, factor) in zip((1, -1), x.thirds, strict=True):
                turn = form(x).precession + side * form(x).relative_spin
                off.append(relative(mp.mpf(turn) / 2 / factor, third))
    return most(off)


@claim(MPMATH, 1e-128, EVALUATED, "closed form")
def mpmath_period():
    """period of four scenes at 125 digits vs the textbook's formula, relative."""
    return most(relative(form(x).period, x.period) for x in formulas())


@claim(MPMATH, 1e-124, f"{EVALUATED}, and loses four in its roots", "closed form")
def mpmath_precession():
    """Δφ in a period of four scenes at 125 digits vs the textbook's formula, relative."""
    return most(relative(form(x).precession, x.precession) for x in formulas())


@claim(MPMATH, 1e-125, f"{EVALUATED}, and loses three", "closed form")
def mpmath_tilt():
    """θ of four scenes at four times at 125 digits vs the textbook's sn [rad]."""
    cases = ((form(x), x, t) for x in formulas() for t in TIMES)
    return most(abs(mp.mpf(ours(t).theta) - x.theta(mp.mpf(t))) for ours, x, t in cases)


@claim(MPMATH, 1e-36, "30 digits are requested; the run carries eight more", "integrator")
def mpmath_tilt_run():
    """θ of the kicked top, run with 30 digits, vs the textbook's sn [rad]."""
    run = ht.propagate(ht.load_scene("sicm-kicked", ["want.digits=30"]), formulation="axis")
    truth = next(x for x in formulas() if x.name == "sicm-kicked")
    found = run.in_mpmath(run.t[1::100])
    pairs = zip(found.t, found.theta, strict=True)
    return most(abs(mp.mpf(str(x)) - truth.theta(mp.mpf(str(t)))) for t, x in pairs)
