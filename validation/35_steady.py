"""Steady precession: the cone of Betsch and co-workers, spinning at 135.6 and precessing at 10."""

from fractions import Fraction

import numpy as np
from claim import claimed, finish, most

import heavytop as ht

# The cone as METIS states it: height, radius, height of its centre, gravity; its moments for each
# kilogram, and the spin that goes with a precession of 10 rad/s at a tilt of pi/3.
HEIGHT, RADIUS, CENTRE, G = Fraction("0.1"), Fraction("0.05"), Fraction("0.075"), Fraction("9.81")
PRECESSION, COSINE = 10, Fraction(1, 2)
AXIAL = Fraction(3, 10) * RADIUS**2
TRANSVERSE = Fraction(3, 80) * (4 * RADIUS**2 + HEIGHT**2) + CENTRE**2
WEIGHT = G * CENTRE
SPIN = WEIGHT / (AXIAL * PRECESSION) + (TRANSVERSE - AXIAL) / AXIAL * PRECESSION * COSINE


def moved():
    scene = ht.load_scene("steady-betsch")
    return scene, ht.propagate(scene)


@claimed("betsch-cone")
def _():
    top = ht.load_scene("steady-betsch").top
    pairs = ((top.A, TRANSVERSE), (top.C, AXIAL), (top.gMR, WEIGHT))
    return most(abs(a.fraction / b - 1) for a, b in pairs)


@claimed("betsch-spin")
def _():
    scene = ht.load_scene("steady-betsch")
    found = (scene.start.phidot, scene.start.psidot)
    return most(
        abs(float(x) / float(y) - 1) for x, y in zip(found, (PRECESSION, SPIN), strict=True)
    )


@claimed("betsch-balance")
def _():
    scene = ht.load_scene("steady-betsch")
    rate, omega3 = float(scene.start.phidot), float(scene.start.omega3)
    terms = (float(TRANSVERSE * COSINE) * rate**2, -float(AXIAL) * omega3 * rate, float(WEIGHT))
    return abs(sum(terms)) / most(map(abs, terms))


@claimed("betsch-kind")
def _():
    top = ht.Top(A=TRANSVERSE, C=AXIAL, gMR=WEIGHT)
    verdict = ht.classify(top, ht.State(theta="pi/3", phidot=PRECESSION, psidot=SPIN))
    return str(verdict.kind) != "uniform-precession" or not verdict.certified


@claimed("betsch-closed-form")
def _():
    scene, t = ht.load_scene("steady-betsch"), np.linspace(0, 2, 101)
    at = ht.Motion(scene.top, scene.start).at(t)
    off = (at.theta - np.pi / 3, at.phi - PRECESSION * t, at.psi - float(SPIN) * t)
    return most(float(np.max(np.abs(x))) for x in off)


@claimed("betsch-tilt-run")
def _():
    _, run = moved()
    return float(np.max(np.abs(run.theta - np.pi / 3)))


@claimed("betsch-angles-run")
def _():
    _, run = moved()
    off = (run.phi - PRECESSION * run.t, run.psi - float(SPIN) * run.t)
    return most(float(np.max(np.abs(x))) for x in off)


finish()
