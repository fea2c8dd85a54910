"""The motion that rises for ever: 1/cos(theta) = 1 + sech(gamma t) (Whittaker; Woodhouse)."""

import mpmath
import numpy as np
from tools import Digits, most, relative

import heavytop as ht
from heavytop.claims import Authority, claim

WHITTAKER = Authority(
    "Whittaker, Analytical Dynamics, sections 71-73; Woodhouse, problem 5.3", "formula"
)


mp = mpmath.MPContext()
mp.dps = 60
DIGITS = 58
SCALED = (-3, 0.5, 1, 5, 10, 20, 30)  # gamma t
TOPS = ((1, "0.5", 1), (3, "0.1", 12), ("0.25", "0.4", 4))  # A, C, gMR; gamma = 1, 2 and 4


def released(A, C, gMR):
    """Woodhouse's start, from which any such top rises, and gamma."""
    gamma = ht.Exact.of(f"sqrt({gMR}/{A})")
    start = ht.State(
        theta="pi/3",
        phidot=f"2*sqrt({gMR}/{A})/sqrt(3)",
        psidot=f"(3*{A}-{C})*sqrt({gMR}/{A})/({C}*sqrt(3))",
    )
    return ht.Top(A=A, C=C, gMR=gMR), start, float(gamma)


def one_minus_u(gt):
    """1 - cos(theta), by the elementary solution."""
    s = mp.sech(mp.mpf(gt))
    return s / (1 + s)


@claim(WHITTAKER, 1e-59, "58 digits are requested; the elementary solution has 60", "closed form")
def whittaker_closed_form():
    """1 − cos θ of three tops up to γt = 30 vs 1/cos θ = 1 + sech γt, relative."""
    off = []
    for values in TOPS:
        *given, gamma = released(*values)
        form = Digits(ht.Motion(*given), DIGITS)
        off += [relative(form(gt / gamma).one_minus_u, one_minus_u(gt)) for gt in SCALED]
    return most(off)


@claim(WHITTAKER, 1e-14, "some twenty roundings", "closed form")
def whittaker_doubles():
    """1 − cos θ in doubles up to γt = 30 vs 1/cos θ = 1 + sech γt, relative."""
    top, start, gamma = released(*TOPS[0])
    gt = np.linspace(0, 30, 301)
    found = ht.Motion(top, start).at(gt / gamma).one_minus_u
    return most(map(relative, found.tolist(), map(one_minus_u, gt.tolist())))


@claim(WHITTAKER, 0, "the start and the verdict are exact", "verdicts")
def whittaker_kind():
    """number of three such tops not proved to lie on the separatrix."""
    verdicts = [ht.classify(*released(*values)[:2]) for values in TOPS]
    return sum(str(v.kind) != "separatrix" or not v.certified for v in verdicts)


GROWN = "rounding of θ grown by exp(γt/2) = 22 000"


@claim(WHITTAKER, 6e-12, GROWN, "integrator", name="whittaker-run-20")
def whittaker_run():
    """θ of the run up to γt = 20 vs 1/cos θ = 1 + sech γt [rad]."""
    gt, (top, start, gamma) = 20, released(*TOPS[0])
    run = ht.propagate(ht.Scene(top, start, time=gt / gamma, quantities=("theta",), digits=8))
    t = np.linspace(0, gt / gamma, 101)
    truth = [mp.acos(1 - one_minus_u(gamma * x)) for x in t]
    return most(abs(mp.mpf(float(x)) - y) for x, y in zip(run(t).theta, truth, strict=True))
