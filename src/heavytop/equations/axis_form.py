"""The axis form: the axis e and the angular momentum l = L/A, both in space.

The Euler-Poisson equations seen from space. With omega = l + (1/C - 1/A) p_psi e,

    de/dt = omega x e = l x e,
    dl/dt = torque / A = (gMR/A) (-e_y, e_x, 0),

so the equations are quadratic, do not know the spin, are regular at the poles, and l_z = p_phi/A
is a constant. phi is the azimuth of e, whose winding is counted outside; psi needs one
quadrature. Of (phi + psi)' and (phi - psi)' freed from the constant (1/C - 1/A) p_psi,

    sigma' = (p_phi + p_psi) / (A (1 + cos theta)),    regular at the top,
    delta' = (p_phi - p_psi) / (A (1 - cos theta)),    regular at the bottom,

one is carried as the deviation from a uniform rotation, so that nothing in the state grows.
"""

from __future__ import annotations

from functools import cache
from typing import Any

import sympy as sp

from heavytop.equations import lagrangian as lag
from heavytop.equations.formulation import Formulation, time, turned_phi

e_x, e_y, e_z, l_x, l_y, deviation = sp.symbols("e_x e_y e_z l_x l_y deviation", real=True)
g, l_z, n, kappa = sp.symbols("g l_z n kappa", real=True)
P_plus, P_minus, omega3, frame_rate = sp.symbols("P_plus P_minus omega3 frame_rate", real=True)
phi_0, psi_0 = sp.symbols("phi_0 psi_0", real=True)

e = sp.Matrix([e_x, e_y, e_z])
ell = sp.Matrix([l_x, l_y, l_z])


@cache
def axis_form(psi: str | None = None) -> Formulation:
    """Return the axis formulation, with psi carried by ``"sigma"``, ``"delta"`` or not at all."""
    states, derivatives, start = _axis_states()
    if psi is not None:
        states, start = (*states, deviation), (*start, sp.Integer(0))
        derivatives = (*derivatives, _regular_rate(psi) - frame_rate)
    return Formulation(
        name="axis",
        summary="the axis and the angular momentum in space; sees no spin and no pole",
        states=states,
        derivatives=derivatives,
        start=start,
        parameters=_parameters(),
        given=() if psi is None else (frame_rate,),
        outputs=_outputs(psi),
        events={"turning": -ell.cross(e)[2], "reversal": _precession()},
        invariants={
            "energy": ell.dot(ell) / 2 - n**2 / 2 + g * e_z,  # e.e and l.e are its Casimirs
            "p_psi": ell.dot(e),
            "length": e.dot(e),
        },
        spin=ell.dot(e),
        starts_at_pole=True,
        unbounded=False,
        rates=(l_x, l_y),
    )


def _axis_states() -> tuple[tuple[Any, ...], tuple[Any, ...], tuple[Any, ...]]:
    axis = sp.Matrix(lag.axis())
    torque = -g * e.cross(sp.Matrix([0, 0, 1]))  # of V = gMR e_z, divided by A
    momentum = axis.cross(axis.applyfunc(lag.time_derivative)) + lag.momenta()[2] / lag.A * axis
    states = (e_x, e_y, e_z, l_x, l_y)
    derivatives = (*ell.cross(e), torque[0], torque[1])
    start = (*axis, *(lag.normal_form(momentum[i]) for i in range(2)))
    return states, derivatives, start


def _precession() -> Any:
    """Return phidot sin^2(theta), from the vectors: l_z - n e_z has no digits near a pole."""
    return l_z * (e_x**2 + e_y**2) - e_z * (l_x * e_x + l_y * e_y)


def _regular_rate(psi: str) -> Any:
    return P_plus / (1 + e_z) if psi == "sigma" else P_minus / (1 - e_z)


def _parameters() -> dict[Any, Any]:
    _, p_phi, p_psi = lag.momenta()
    return {
        g: lag.gMR / lag.A,
        l_z: p_phi / lag.A,
        n: p_psi / lag.A,
        kappa: p_psi * (1 / lag.C - 1 / lag.A),
        P_plus: (p_phi + p_psi) / lag.A,
        P_minus: (p_phi - p_psi) / lag.A,
        omega3: p_psi / lag.C,
        phi_0: lag.phi,
        psi_0: lag.psi,
    }


def _outputs(psi: str | None) -> dict[str, Any]:
    horizontal = e_x**2 + e_y**2  # sin^2 theta, without cancellation near the poles
    phidot = l_z - e_z * (l_x * e_x + l_y * e_y) / horizontal
    outputs = {
        "theta": sp.atan2(sp.sqrt(horizontal), e_z),
        "phi_mod": sp.atan2(e_x, -e_y),
        "thetadot": -ell.cross(e)[2] / sp.sqrt(horizontal),
        "phidot": phidot,
        "psidot": omega3 - phidot * e_z,
    }
    for i, name in enumerate("xyz"):
        outputs[f"axis_{name}"] = e[i]
        outputs[f"omega_{name}"] = ell[i] + kappa * e[i]
    if psi is not None:
        outputs["psi"] = _spin_angle(psi)
    return outputs


def _spin_angle(psi: str) -> Any:
    turned = turned_phi - phi_0
    if psi == "sigma":
        return psi_0 + (kappa + frame_rate) * time + deviation - turned
    return psi_0 + (kappa - frame_rate) * time - deviation + turned
