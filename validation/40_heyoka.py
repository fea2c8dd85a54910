"""heyoka's own `lagrangian` and `hamiltonian` of the same top, typed here by hand.

heyoka derives the equations of motion from L or H by itself and integrates them; nothing of the
package's symbols goes in.
"""

from functools import cache

import heyoka as hy
import numpy as np
from claim import claimed, finish, most

import heavytop as ht

END = 2.0
A, C, GMR = 3.28e-4, 6.60e-5, 0.0456
STARTS = {
    "kicked": (0.1, 0.0, 0.0, 0.0, -15.0, 140.0),
    "moving": (0.8, 0.1, -0.4, 3.0, -5.0, 90.0),
}
ANGLES = hy.make_vars("theta", "phi", "psi")
RATES = hy.make_vars("thetadot", "phidot", "psidot")
MOMENTA = hy.make_vars("p_theta", "p_phi", "p_psi")


def lagrangian():
    (theta, _, _), (tilt, turn, spin) = ANGLES, RATES
    across = tilt**2 + turn**2 * hy.sin(theta) ** 2
    return A / 2 * across + C / 2 * (spin + turn * hy.cos(theta)) ** 2 - GMR * hy.cos(theta)


def hamiltonian():
    (theta, _, _), (p_theta, p_phi, p_psi) = ANGLES, MOMENTA
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
    start = STARTS[name]
    if which == "lagrangian":
        system, begin = hy.lagrangian(lagrangian(), ANGLES, RATES), list(start)
    else:
        system = hy.hamiltonian(hamiltonian(), ANGLES, MOMENTA)
        begin = [*start[:3], *momenta(*start)]
    integrator = hy.taylor_adaptive(system, begin)
    integrator.propagate_until(END)
    return tuple(integrator.state[:3])


def ours(name):
    names = ("theta", "phi", "psi", "thetadot", "phidot", "psidot")
    return ht.Top(A, C, GMR), ht.State(**dict(zip(names, STARTS[name], strict=True)))


def of_the_closed_form(which):
    def measure():
        worst = 0.0
        for name in STARTS:
            at = ht.Motion(*ours(name)).at(END)
            found = np.array([float(at.theta), float(at.phi), float(at.psi)])
            worst = most(worst, float(np.max(np.abs(found - theirs(which, name)))))
        return worst

    return measure


def of_the_run(which, formulation):
    def measure():
        worst = 0.0
        for name in STARTS:
            scene = ht.Scene(*ours(name), time=END, quantities=("theta", "phi", "psi"))
            at = ht.propagate(scene, formulation=formulation)(END)
            found = np.array([float(at.theta), float(at.phi), float(at.psi)])
            worst = most(worst, float(np.max(np.abs(found - theirs(which, name)))))
        return worst

    return measure


for which in ("lagrangian", "hamiltonian"):
    claimed(f"heyoka-{which}-closed-form")(of_the_closed_form(which))
claimed("heyoka-lagrangian-run")(of_the_run("lagrangian", "subsystem"))
claimed("heyoka-hamiltonian-run")(of_the_run("hamiltonian", "axis"))
finish()
