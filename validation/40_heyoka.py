"""heyoka's own `lagrangian` and `hamiltonian` of the same top, typed here by hand.

heyoka derives the equations of motion from L or H by itself and integrates them; nothing of the
package's symbols goes in.
"""

from functools import cache

import numpy as np
from tools import most

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
    names = ("theta", "phi", "psi", "thetadot", "phidot", "psidot")
    return ht.Top(A, C, GMR), ht.State(**dict(zip(names, STARTS[name], strict=True)))


def off(angles, which, name):
    return float(np.max(np.abs(np.array([*map(float, angles)]) - theirs(which, name))))


@claim("heyoka-hamiltonian-closed-form", HEYOKA, 2e-12, EXACT, "closed form", of=("hamiltonian",))
@claim("heyoka-lagrangian-closed-form", HEYOKA, 2e-12, EXACT, "closed form", of=("lagrangian",))
def end_of_the_closed_form(which):
    """θ, φ and ψ of two starts after 2 s vs heyoka's {0} [rad]."""
    ends = {name: ht.Motion(*ours(name)).at(END) for name in STARTS}
    return most(off((at.theta, at.phi, at.psi), which, name) for name, at in ends.items())


@claim("heyoka-hamiltonian-run", HEYOKA, 2e-12, RUN, "integrator", of=("hamiltonian", "axis"))
@claim("heyoka-lagrangian-run", HEYOKA, 2e-12, RUN, "integrator", of=("lagrangian", "book's"))
def end_of_the_run(which, form):
    """θ, φ and ψ of the run in the {1} form vs heyoka's {0} [rad]."""
    worst = 0.0
    for name in STARTS:
        scene = ht.Scene(*ours(name), time=END, quantities=("theta", "phi", "psi"))
        at = ht.propagate(scene, formulation="subsystem" if form == "book's" else form)(END)
        worst = most(worst, off((at.theta, at.phi, at.psi), which, name))
    return worst
