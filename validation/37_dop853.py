"""scipy's DOP853 on the textbook's equations, typed here by hand (Goldstein, section 5.7)."""

from functools import cache

import numpy as np
from tools import angles, farthest, state

import heavytop as ht
from heavytop.claims import Authority, claim

DOP853 = Authority("scipy's DOP853 on the textbook's equations", "program")

REASON = "the error of DOP853 at its least tolerance, about ten times"
END = 2.0
BOOK = (3.28e-4, 6.60e-5, 0.0456)
STARTS = {
    "kicked": (BOOK, (0.1, 0.0, 0.0, 0.0, -15.0, 140.0)),
    "dropped": (BOOK, (0.1, 0.0, 0.0, 0.0, 0.0, 140.0)),
    "tilted": ((1.3, 0.7, 2.1), (0.8, 0.1, -0.4, 0.6, -0.5, 4.0)),
    "upside down": ((1.3, 0.7, -2.1), (2.1, 0.1, -0.4, 0.3, 0.7, -5.0)),
}


def rates(t, y, A, C, gMR):
    """theta, phi, psi and their rates, for constants p_phi and p_psi never used."""
    theta, _, _, thetadot, phidot, psidot = y
    s, c = np.sin(theta), np.cos(theta)
    spin = C * (psidot + phidot * c)
    tilt = (A * phidot**2 * s * c - spin * phidot * s + gMR * s) / A
    turn = (spin * thetadot - 2 * A * phidot * thetadot * c) / (A * s)
    return thetadot, phidot, psidot, tilt, turn, phidot * thetadot * s - turn * c


@cache
def scipys(name):
    """The three angles at the end, phi and psi continuous from the start."""
    from scipy.integrate import solve_ivp

    top, start = STARTS[name]
    least = {"rtol": 3e-14, "atol": 1e-14}
    return solve_ivp(rates, (0, END), start, method="DOP853", args=top, **least).y[:3, -1]


def ours(name):
    top, start = STARTS[name]
    return ht.Top(*top), state(*start)


def dop853(kind, name, bound, *form):
    """The claim of one start, by the closed form or by a run in a form."""
    holds, words = "integrator" if form else "closed form", f"{kind} {name}".replace(" ", "-")
    return claim(DOP853, bound, REASON, holds, name=f"dop853-{words}", of=(name, *form))


@dop853("closed-form", "upside down", 2e-13)
@dop853("closed-form", "tilted", 1e-13)
@dop853("closed-form", "dropped", 2e-12)
@dop853("closed-form", "kicked", 1e-12)
def end_of_the_closed_form(name):
    """θ, φ and ψ of the {0} top after 2 s vs DOP853 [rad]."""
    return farthest(angles(ht.Motion(*ours(name)).at(END)), scipys(name))


@dop853("run", "upside down", 2e-13, "Lagrange")
@dop853("run", "tilted", 1e-13, "attitude")
@dop853("run", "dropped", 2e-12, "Routh")
@dop853("run", "kicked", 1e-12, "axis")
def end_of_the_run(name, form):
    """θ, φ and ψ of the {0} top, run in the {1} form, vs DOP853 [rad]."""
    scene = ht.Scene(*ours(name), time=END, quantities=("theta", "phi", "psi"))
    return farthest(angles(ht.propagate(scene, formulation=form.lower())(END)), scipys(name))
