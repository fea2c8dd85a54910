"""What textbooks say in a formula: Landau & Lifshitz on the top, Gauss and Huygens on pendulums."""

import math
from itertools import pairwise

import mpmath
from tools import HUNDRED_STEPS, Digits, farthest, most, relative

import heavytop as ht
from heavytop.claims import Authority, claim

LANDAU = Authority(
    "Landau & Lifshitz, Mechanics, section 33; section 35, problems 2 and 3", "formula"
)
GAUSS = Authority("Gauss: the period of a pendulum by the arithmetic-geometric mean", "formula")
HUYGENS = Authority("Huygens: the conical pendulum", "formula")
GOLDSTEIN = Authority(
    "Goldstein, Classical Mechanics, section 5.7: the rates of steady precession", "formula"
)


mp = mpmath.MPContext()
mp.dps = 50
BOOK = ("3.28e-4", "6.60e-5", "0.0456")
KIND = "uniform-precession"
EXTRAPOLATED = (
    "extrapolated from three spins; the third power of 4A gMR/p_ψ² < 1.4e-6, over 64, is left"
)
TILT = "0.7"  # at which the fast top is let go


def certain(scene_top, omega3):
    """The tags of a sleeping top, empty unless proved."""
    verdict = ht.classify(scene_top, ht.State(theta=0, omega3=omega3))
    return set(verdict.tags) if verdict.certified else set()


@claim(LANDAU, 0, "exact: a sign separates stable, marginal and unstable", "verdicts")
def landau_sleeping():
    """number of tops at p_ψ² = 4A gMR, and 1e-30 above and below, with another stability proved.

    p_psi^2 against 4 A gMR at A = gMR = 1, C = 1/2: omega3 = 4 exactly, and 1e-30 off it.
    """
    top = ht.Top(A=1, C="1/2", gMR=1)
    small = "1e-30"
    cases = ((f"4+{small}", "stable"), ("4", "marginal"), (f"4-{small}", "unstable"))
    return sum(tag not in certain(top, ht.Exact.of(text)) for text, tag in cases)


def fast(omega3):
    """Our period and precession of a fast top, over Landau's formulas, and p_psi^2/4A gMR."""
    motion = Digits(ht.Motion(ht.Top(*BOOK), ht.State(theta=TILT, omega3=omega3)), 48)
    A, C, gMR = map(mp.mpf, BOOK)
    period, turn, p_psi = mp.mpf(motion.period), mp.mpf(motion.precession), C * omega3
    over = period / (2 * mp.pi * A / p_psi), turn / period / (gMR / p_psi)
    return *over, p_psi**2 / (4 * A * gMR)


def next_term(which):
    """What Landau's formula leaves out, in units of 4A gMR/p_psi^2: the limit at endless spin.

    Three spins, each twice the last, take two more powers of the ratio away (Richardson).
    """
    found = []
    for omega3 in (10**5, 2 * 10**5, 4 * 10**5):
        *over, ratio = fast(omega3)
        found.append((over[which] - 1) * ratio)
    for fall in (4, 16):
        found = [(fall * b - a) / (fall - 1) for a, b in pairwise(found)]
    return found[0]


@claim(LANDAU, 5e-19, EXTRAPOLATED, "closed form")
def landau_fast_period():
    """next term of a fast top's period after Landau's 2πA/p_ψ, vs ½ cos θ₀ (derived here),
    relative.

    The pendulum's series of the period: half the cosine of the tilt at which it is let go.
    """
    return relative(next_term(0), mp.cos(mp.mpf(TILT)) / 2)


@claim(LANDAU, 5e-19, EXTRAPOLATED, "closed form")
def landau_fast_precession():
    """next term of a fast top's mean precession after Landau's gMR/p_ψ, vs ¼ cos θ₀ (derived here),
    relative.

    A quarter of that cosine, as for the slow rate of steady precession.
    """
    return relative(next_term(1), mp.cos(mp.mpf(TILT)) / 4)


FREE = ht.Top(A=1, C="1/2", gMR=0)
TOSSED = ht.State(theta="0.5", thetadot="0.1", phidot="0.3", psidot=1)
AFTER = (1, 5, 20)


def cross(x, y):
    pairs = ((1, 2), (2, 0), (0, 1))
    return mp.matrix([x[i] * y[j] - x[j] * y[i] for i, j in pairs])


class Regular:
    """Landau's regular precession, section 33: the axis turns about L at |L|/A."""

    def __init__(self):
        theta, turn = mp.mpf("0.5"), mp.mpf("0.3")
        s, c = mp.sin(theta), mp.cos(theta)
        self.axis = mp.matrix([0, -s, c])
        moving = mp.matrix([turn * s, -mp.mpf("0.1") * c, -mp.mpf("0.1") * s])
        momentum = cross(self.axis, moving) + (1 + turn * c) / 2 * self.axis
        self.rate = mp.norm(momentum)
        self.pole = momentum / self.rate

    def at(self, t):
        along = mp.fdot(self.pole, self.axis) * self.pole
        c, s = mp.cos(self.rate * t), mp.sin(self.rate * t)
        return along + c * (self.axis - along) + s * cross(self.pole, self.axis)

    def off(self, axes):
        """The largest distance of a component at the three times."""
        pairs = zip(axes, map(self.at, AFTER), strict=True)
        return most(abs(mp.mpf(x) - y) for pair in pairs for x, y in zip(*pair, strict=True))


@claim(LANDAU, 5e-79, "75 digits are requested; the formula has 80", "closed form")
def landau_free():
    """axis at three times and period of a free top (gMR = 0) vs a rotation about L at |L|/A,
    relative.
    """
    motion = ht.Motion(FREE, TOSSED)
    with mp.workdps(80):
        exact = Regular()
        period = mp.mpf(motion.mpf("period", 75)) * exact.rate / (2 * mp.pi)
        return most(abs(period - 1), exact.off(motion.at(t, digits=75).axis for t in AFTER))


@claim(LANDAU, 1e-14, "rounding of the axis, a hundred times", "integrator")
def landau_free_run():
    """axis of a free top's run at three times in 20 s vs a rotation about L at |L|/A."""
    scene = ht.Scene(FREE, TOSSED, time=20, quantities=("theta", "phi", "psi"))
    run = ht.propagate(scene)
    return Regular().off(run(float(t)).axis.tolist() for t in AFTER)


SWING = {"theta": "2", "omega3": 0}  # from the upward vertical: pi - 2 from hanging
PENDULUM = ht.Top(A="0.4", C="0.1", gMR="3")


def gauss():
    """The period of a swing, 2 pi sqrt(A/gMR) / agm(1, cos(amplitude/2))."""
    amplitude = mp.pi - 2
    return 2 * mp.pi * mp.sqrt(mp.mpf("0.4") / 3) / mp.agm(1, mp.cos(amplitude / 2))


@claim(GAUSS, 1e-49, "48 digits are requested; the mean has 50", "closed form")
def gauss_pendulum():
    """period of a swing vs the arithmetic-geometric mean, relative."""
    motion = Digits(ht.Motion(PENDULUM, ht.State(**SWING)), 48)
    return relative(2 * mp.mpf(motion.period), gauss())  # a period of theta is half a swing


@claim(GAUSS, 1e-13, HUNDRED_STEPS, "integrator")
def gauss_pendulum_run():
    """distance of the axis from the vertical after five swings and a quarter.

    After five swings and a quarter it hangs, and moves fastest.
    """
    end = float(gauss() * 21 / 4)
    scene = ht.Scene(PENDULUM, ht.State(**SWING), time=end, quantities=("theta",))
    axis = ht.propagate(scene)(end).axis
    return math.hypot(float(axis[0]), float(axis[1]))


@claim(HUYGENS, 1e-13, HUNDRED_STEPS, "closed form", "integrator")
def huygens_conical():
    """θ and φ over 3 s vs a conical pendulum's [rad].

    A conical pendulum turns at sqrt(gMR / A cos(angle from hanging)).
    """
    rate = ht.Exact.of("sqrt(15)")  # sqrt(3/(0.4 cos(pi/3)))
    start = ht.State(theta="2*pi/3", phidot=rate, omega3=0)
    scene = ht.Scene(PENDULUM, start, time=3, quantities=("theta", "phi"))
    run = ht.propagate(scene)
    both = run, ht.Motion(PENDULUM, start).at(run.t)
    tilts = (farthest(each.theta, 2 * math.pi / 3) for each in both)
    return most(*tilts, *(farthest(each.phi, math.sqrt(15) * run.t) for each in both))


@claim(GOLDSTEIN, 1e-49, "the rates are exact; the comparison has 50 digits", "start", "verdicts")
def goldstein_rates():
    """steady rates at θ = 0.1 and ω₃ = 140 vs the quadratic's roots, relative; 1 if not proved
    steady.

    Roots of A cos(theta) W^2 - p_psi W + gMR = 0 at theta = 0.1, omega3 = 140, and the kind.
    """
    A, C, gMR = map(mp.mpf, BOOK)
    c, p, off = mp.cos(mp.mpf("0.1")), C * 140, []
    for which, sign in (("slow", -1), ("fast", 1)):
        start = ht.State.steady(ht.Top(*BOOK), theta="0.1", omega3=140, which=which)
        rate = (p + sign * mp.sqrt(p**2 - 4 * A * gMR * c)) / (2 * A * c)
        off.append(relative(start.phidot.mpf(mp), rate))
        off.append(str(ht.classify(ht.Top(*BOOK), start).kind) != KIND)
    return most(off)


@claim(GOLDSTEIN, 5e-25, "the square of a nutation of 1e-13 rad", "closed form", "start")
def goldstein_nodding():
    """period of small nutation about both steady rates vs 2π √(A/V″) of the effective potential,
    relative.

    Frequency of small nodding about both steady rates, from the effective potential's V''.
    """
    A, C, gMR = map(mp.mpf, BOOK)
    tilt, p, off = mp.mpf("0.1"), C * 140, []
    for which in ("slow", "fast"):
        steady = ht.State.steady(ht.Top(*BOOK), theta="0.1", omega3=140, which=which)
        rate = steady.phidot.mpf(mp)
        a = A * rate * mp.sin(tilt) ** 2 + p * mp.cos(tilt)

        def potential(x, a=a):
            return (a - p * mp.cos(x)) ** 2 / (2 * A * mp.sin(x) ** 2) + gMR * mp.cos(x)

        own = mp.sqrt(mp.diff(potential, tilt, 2) / A)
        momenta = {"phidot": steady.phidot, "psidot": steady.psidot}  # of the steady motion
        nudged = ht.State(theta="0.1", thetadot="1e-12", **momenta)
        off.append(relative(ht.Motion(ht.Top(*BOOK), nudged).mpf("period", 40), 2 * mp.pi / own))
    return most(off)
