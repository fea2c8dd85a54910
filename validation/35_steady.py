"""Steady precession: the cone of Betsch and co-workers, spinning at 135.6 and precessing at 10."""

from fractions import Fraction

import mpmath
import numpy as np
from tools import farthest, most, motion_of

import heavytop as ht
from heavytop.claims import Authority, claim
from heavytop.scene.solids import cone

BETSCH = Authority(
    "Betsch and co-workers: the gyro top in steady precession, as in METIS", "formula"
)


mp = mpmath.MPContext()
mp.dps = 50

# The cone as METIS states it: height, radius, height of its centre, gravity; its moments for each
# kilogram, and the spin that goes with a precession of 10 rad/s at a tilt of pi/3.
HEIGHT, RADIUS, CENTRE, G = Fraction("0.1"), Fraction("0.05"), Fraction("0.075"), Fraction("9.81")
PRECESSION, COSINE = 10, Fraction(1, 2)
AXIAL = Fraction(3, 10) * RADIUS**2
TRANSVERSE = Fraction(3, 80) * (4 * RADIUS**2 + HEIGHT**2) + CENTRE**2
WEIGHT = G * CENTRE
DENSITY = 2700


def spin(rate, number=Fraction):
    """METIS's formula: the spin that goes with a precession."""
    weight, axial, transverse, cosine = map(number, (WEIGHT, AXIAL, TRANSVERSE, COSINE))
    return weight / (axial * rate) + (transverse - axial) / axial * rate * cosine


def decimal(fraction):
    return mp.mpf(fraction.numerator) / fraction.denominator


def exact(value):
    """The fraction that a number is; of a root, which is none, its first fifty digits."""
    return Fraction(str(value.mpf(mp))) if value.fraction is None else value.fraction


SPIN = spin(PRECESSION)


def moved():
    return ht.propagate(ht.load_scene("steady-betsch"))


def off_the_formula(x, t):
    """How far phi and psi are from turning evenly."""
    return most(farthest(x.phi, PRECESSION * t), farthest(x.psi, float(SPIN) * t))


@claim(BETSCH, 0, "both are exact; the claim tests how the scene is read", "constants")
def betsch_cone():
    """moments, weight, precession and spin of the scene vs METIS's cone per kilogram, relative."""
    top, start = ht.load_scene("steady-betsch").top, ht.load_scene("steady-betsch").start
    pairs = ((top.A, TRANSVERSE), (top.C, AXIAL), (top.gMR, WEIGHT), (start.phidot, PRECESSION))
    spun = (exact(start.omega3) - PRECESSION * COSINE) / SPIN  # theta is pi/3
    return most(abs(spun - 1), *(abs(a.fraction / b - 1) for a, b in pairs))


@claim(BETSCH, 2e-49, "both are exact; the comparison has 50 digits", "constants")
def betsch_solid():
    """moments and weight of the cone as a solid of density 2700 vs METIS's formulas, relative.

    The cone as a solid, against METIS's formulas with its mass of density pi r^2 h/3.
    """
    solid = cone(radius="0.05", apex=0, base="0.1", density=DENSITY)
    top = ht.Top.from_solids([solid], gravity="9.81")
    mass = DENSITY * mp.pi * decimal(RADIUS**2 * HEIGHT) / 3
    pairs = ((top.A, TRANSVERSE), (top.C, AXIAL), (top.gMR, WEIGHT))
    return most(abs(found.mpf(mp) / (mass * decimal(each)) - 1) for found, each in pairs)


@claim(BETSCH, 1e-49, "both are exact; the comparison has 50 digits", "start")
def betsch_rates():
    """both steady rates at METIS's spin vs METIS's formula of the spin, and the slow one vs 10,
    relative.

    METIS's formula read the other way: at its spin, 10 rad/s and one other precession.
    """
    top = ht.Top(A=TRANSVERSE, C=AXIAL, gMR=WEIGHT)
    omega3 = SPIN + PRECESSION * COSINE
    starts = [ht.State.steady(top, "pi/3", omega3, which) for which in ("slow", "fast")]
    slow, fast = (start.phidot.mpf(mp) for start in starts)
    off = [
        abs(start.psidot.mpf(mp) / spin(rate, decimal) - 1)
        for start, rate in zip(starts, (slow, fast), strict=True)
    ]
    return most(abs(slow / PRECESSION - 1), *off, int(not fast > 2 * slow))


@claim(BETSCH, 0, "the starts and the verdicts are exact", "verdicts")
def betsch_kind():
    """of METIS's start, and one with 1e-30 less spin: number not proved steady and nutating."""
    top = ht.Top(A=TRANSVERSE, C=AXIAL, gMR=WEIGHT)
    wrong = 0
    for less, kinds in ((0, {"uniform-precession"}), (Fraction(1, 10**30), {"waves", "loops"})):
        verdict = ht.classify(top, ht.State(theta="pi/3", phidot=PRECESSION, psidot=SPIN - less))
        wrong += str(verdict.kind) not in kinds or not verdict.certified
    return wrong


@claim(BETSCH, 1e-12, "rounding of 271 rad, twenty times", "closed form")
def betsch_closed_form():
    """θ, φ and ψ over 2 s vs π/3, 10 t and 135.6 t [rad]."""
    t = np.linspace(0, 2, 101)
    at = motion_of("steady-betsch").at(t)
    return most(farthest(at.theta, np.pi / 3), off_the_formula(at, t))


@claim(BETSCH, 1e-14, "rounding of some hundred steps in doubles, ten times", "integrator")
def betsch_tilt_run():
    """θ over 2 s vs π/3 [rad]."""
    return farthest(moved().theta, np.pi / 3)


@claim(BETSCH, 1e-12, "rounding of 271 rad, twenty times", "integrator")
def betsch_angles_run():
    """φ and ψ over 2 s vs 10 t and 135.6 t [rad]."""
    run = moved()
    return off_the_formula(run, run.t)
