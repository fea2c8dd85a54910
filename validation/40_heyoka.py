"""heyoka's own `lagrangian` and `hamiltonian` of the same top, typed here by hand.

heyoka derives the equations of motion from L or H by itself and integrates them; nothing of the
package's symbols goes in.
"""

from functools import cache

import numpy as np
from tools import angles, farthest, most, state

import heavytop as ht
from heavytop.claims import Authority, claim

HEYOKA = Authority(
    "heyoka's own lagrangian and hamiltonian, with the same integrator as ours", "program"
)


EXACT = "rounding of 240 rad, forty times; only the closed form is our code"
RUN = (
    "rounding of 240 rad, forty times; heyoka integrates both, so this tests our equations and "
    "turns, not its arithmetic"
)
END = 2.0
A, C, GMR = 3.28e-4, 6.60e-5, 0.0456
STARTS = {
    "kicked": (0.1, 0.0, 0.0, 0.0, -15.0, 140.0),
    "moving": (0.8, 0.1, -0.4, 3.0, -5.0, 90.0),
}


def lagrangian(hy, angles, rates):
    (theta, _, _), (tilt, turn, spin) = angles, rates
    across = tilt**2 + turn**2 * hy.sin(theta) ** 2
    return A / 2 * across + C / 2 * (spin + turn * hy.cos(theta)) ** 2 - GMR * hy.cos(theta)


def hamiltonian(hy, angles, momenta):
    (theta, _, _), (p_theta, p_phi, p_psi) = angles, momenta
    drift = (p_phi - p_psi * hy.cos(theta)) / hy.sin(theta)
    kinetic = (p_theta**2 + drift**2) / (2 * A) + p_psi**2 / (2 * C)
    return kinetic + GMR * hy.cos(theta)


def momenta(theta, phi, psi, tilt, turn, spin):
    omega3 = spin + turn * np.cos(theta)
    p_psi = C * omega3
    return A * tilt, A * turn * np.sin(theta) ** 2 + p_psi * np.cos(theta), p_psi


@cache
def theirs(which, name):
    """theta, phi and psi at the end, by heyoka alone."""
    import heyoka as hy

    begin = STARTS[name]
    angles, others = hy.make_vars("theta", "phi", "psi"), hy.make_vars("x", "y", "z")
    if which == "lagrangian":
        system = hy.lagrangian(lagrangian(hy, angles, others), angles, others)
    else:
        system = hy.hamiltonian(hamiltonian(hy, angles, others), angles, others)
        begin = (*begin[:3], *momenta(*begin))
    integrator = hy.taylor_adaptive(system, list(begin))
    integrator.propagate_until(END)
    return tuple(integrator.state[:3])


def ours(name):
    return ht.Top(A, C, GMR), state(*STARTS[name])


def heyoka(which, kind, *form):
    """The claim of one function, by the closed form or by a run in a form."""
    reason, holds = (RUN, "integrator") if form else (EXACT, "closed form")
    return claim(HEYOKA, 2e-12, reason, holds, name=f"heyoka-{which}-{kind}", of=(which, *form))


@heyoka("hamiltonian", "closed-form")
@heyoka("lagrangian", "closed-form")
def end_of_the_closed_form(which):
    """θ, φ and ψ of two starts after 2 s vs heyoka's {0} [rad]."""
    ends = {name: angles(ht.Motion(*ours(name)).at(END)) for name in STARTS}
    return most(farthest(end, theirs(which, name)) for name, end in ends.items())


@heyoka("hamiltonian", "run", "axis")
@heyoka("lagrangian", "run", "book's")
def end_of_the_run(which, form):
    """θ, φ and ψ of the run in the {1} form vs heyoka's {0} [rad]."""
    worst = 0.0
    for name in STARTS:
        scene = ht.Scene(*ours(name), time=END, quantities=("theta", "phi", "psi"))
        at = ht.propagate(scene, formulation="subsystem" if form == "book's" else form)(END)
        worst = most(worst, farthest(angles(at), theirs(which, name)))
    return worst
