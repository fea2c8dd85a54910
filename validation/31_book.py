"""The book (SICM 2.10): its quadratures, its words about its figures, its effective potential."""

import mpmath
import numpy as np
from claim import claimed, finish, most

import heavytop as ht

A, C, gMR = "3.28e-4", "6.60e-5", "0.0456"  # the book's top
mp = mpmath.MPContext()
mp.dps = 60
NODES = 160
STARTS = {  # released at theta = 0.1 with thetadot = 0; the book's sentence and what is held
    "sicm-kicked": "loops",
    "sicm-dropped": "cusps",
    "sicm-forward": "waves",
}


class Book:
    """The book's reduced motion: one degree of freedom in an effective potential."""

    def __init__(self, phidot, omega3):
        self.A, self.C, self.gMR = (mp.mpf(x) for x in (A, C, gMR))
        start = mp.mpf("0.1")
        self.p_psi = self.C * omega3
        self.p_phi = self.A * phidot * mp.sin(start) ** 2 + self.p_psi * mp.cos(start)
        self.E = self.potential(start)

    def potential(self, theta):
        """The effective potential without the constant p_psi^2/2C."""
        drift = self.p_phi - self.p_psi * mp.cos(theta)
        return drift**2 / (2 * self.A * mp.sin(theta) ** 2) + self.gMR * mp.cos(theta)

    def phidot(self, theta):
        return (self.p_phi - self.p_psi * mp.cos(theta)) / (self.A * mp.sin(theta) ** 2)

    def other_end(self, near):
        """The turning point that is not the start: a bracket of the potential, halved."""
        inside = (mp.mpf("0.1") + 3 * near) / 4
        out = near + (near - mp.mpf("0.1")) / 3
        for _ in range(230):
            middle = (inside + out) / 2
            if self.potential(middle) < self.E:
                inside = middle
            else:
                out = middle
        return inside

    def quadrature(self, near):
        """Period and precession, integrated over the angle that makes both ends regular."""
        start, end = mp.mpf("0.1"), self.other_end(near)
        centre, half = (start + end) / 2, abs(end - start) / 2

        def time(angle):
            theta = centre + half * mp.sin(angle)
            height = 2 * (self.E - self.potential(theta)) / self.A
            return half * mp.cos(angle) / mp.sqrt(height)

        def turn(angle):
            return time(angle) * self.phidot(centre + half * mp.sin(angle))

        angles = [mp.pi * ((2 * n + 1) / mp.mpf(2 * NODES) - mp.mpf(1) / 2) for n in range(NODES)]
        step = 2 * mp.pi / NODES  # midpoints of a periodic integrand: the error falls as c^-NODES
        return end, step * sum(map(time, angles)), step * sum(map(turn, angles))


def book_of(name):
    """The book's potential for a shipped start, and the closed form's other end."""
    scene = ht.load_scene(name)
    motion = ht.Motion(scene.top, scene.start)
    phidot = {"sicm-kicked": -15, "sicm-dropped": 0, "sicm-forward": 15}[name]
    held = 140 if name == "sicm-forward" else 140 + phidot * mp.cos(mp.mpf("0.1"))
    low, high = motion.theta_min, motion.theta_max
    return scene, motion, Book(phidot, held), high if high > 0.1001 else low


def relative(found, exact):
    return float(abs(mp.mpf(found) / exact - 1))


QUADRATURES = {}


def quadratures():
    """What the book's quadratures give for each start, once."""
    if not QUADRATURES:
        for name in STARTS:
            scene, motion, book, near = book_of(name)
            QUADRATURES[name] = scene, motion, book.quadrature(mp.mpf(near))
    return QUADRATURES.values()


@claimed("book-period")
def _():
    return most(relative(motion.form(30).period, found[1]) for _, motion, found in quadratures())


@claimed("book-precession")
def _():
    return most(
        relative(motion.form(30).precession, found[2]) for _, motion, found in quadratures()
    )


@claimed("book-range")
def _():
    worst = 0.0
    for _, motion, found in quadratures():
        ends = motion.form(30).tilts
        worst = most(worst, min(relative(end, found[0]) for end in ends))
    return worst


def turning(scene):
    """Times and angles of the turning points of an integrated run."""
    events = ht.propagate(scene).events
    return events, events.t[events.is_turning]


@claimed("book-period-run")
def _():
    worst = 0.0
    for scene, _, found in quadratures():
        _, t = turning(scene)
        expected = np.arange(t.size) * float(found[1]) / 2
        worst = most(worst, float(np.max(np.abs(t - expected))))
    return worst


@claimed("book-precession-run")
def _():
    worst = 0.0
    for scene, _, found in quadratures():
        run = ht.propagate(scene)
        period = float(found[1])
        times = np.arange(1, int(2 / period) + 1) * period
        turned = np.arange(1, times.size + 1) * float(found[2])
        worst = most(worst, float(np.max(np.abs(run(times).phi - turned))))
    return worst


@claimed("book-range-run")
def _():
    worst = 0.0
    for scene, _, found in quadratures():
        events, _ = turning(scene)
        tilts = events.theta[events.is_turning][1::2]
        worst = most(worst, float(np.max(np.abs(tilts - float(found[0])))))
    return worst


@claimed("book-lagrangian")
def _():
    """The book's L, typed here, against that of our symbols at random states."""
    from heavytop.models import lagrangian as ours
    from heavytop.models.numeric import numpy_function

    symbols = (ours.A, ours.C, ours.gMR, *ours.COORDINATES, *ours.VELOCITIES)
    mine = numpy_function([ours.lagrangian()], symbols)
    a, c, g, theta, phi, psi, tilt, turn, spin = np.random.default_rng(3).uniform(0.2, 3, (9, 500))
    across = tilt**2 + turn**2 * np.sin(theta) ** 2
    along = (spin + turn * np.cos(theta)) ** 2
    book = a / 2 * across + c / 2 * along - g * np.cos(theta)
    found = np.ravel(mine(a, c, g, theta, phi, psi, tilt, turn, spin))
    return float(np.max(np.abs(found - book) / (a * across + c * along + g)))


@claimed("book-figures")
def _():
    wrong = 0
    for name, word in STARTS.items():
        scene, motion, _, _ = book_of(name)
        events, _ = turning(scene)
        seen = {"reversal": "loops", "cusp": "cusps"}
        kinds = {seen[kind] for kind in events.kind if kind in seen} or {"waves"}
        wrong += str(motion.kind) != word
        wrong += kinds != {word}
    return wrong


@claimed("book-fastest-precession")
def _():
    events, _ = turning(ht.load_scene("sicm-dropped"))
    lower = np.array(events.kind) == "theta_max"
    exact = float(2 * mp.mpf(gMR) / (mp.mpf(C) * 140))
    return float(np.max(np.abs(events.phidot[lower] - exact)))


finish()
