"""The formulations in space: the axis form, and the attitude form, which is derived from it.

The axis form has the axis e and the angular momentum l = L/A, both in space: the Euler-Poisson
equations in the frame of space. With omega = l + (1/C - 1/A) p_psi e,

    de/dt = omega x e = l x e,
    dl/dt = torque / A = (gMR/A) (-e_y, e_x, 0),

so the equations are quadratic, do not know the spin, are regular at the poles, and l_z = p_phi/A
is a constant. phi is the azimuth of e, known modulo 2 pi; psi needs one quadrature. Of (phi + psi)'
and (phi - psi)' freed from the constant (1/C - 1/A) p_psi,

    sigma' = (p_phi + p_psi) / (A (1 + cos theta)),    regular at the top,
    delta' = (p_phi - p_psi) / (A (1 - cos theta)),    regular at the bottom,

one is carried as the deviation from a uniform rotation, so that nothing in the state grows.

The attitude form has a quaternion q freed from the fast spin, and l. The part kappa e of omega,
with kappa = (1/C - 1/A) p_psi, is a uniform rotation about the body's axis and is taken out
exactly,

    attitude = q exp(z kappa t/2),    dq/dt = l q / 2,

with e = q z q* the axis. The equations are quadratic, do not know how the momentum p_psi is made
up of moment and spin, and are regular everywhere. With alpha = q_0 + i q_3 and beta = q_1 + i q_2,

    alpha = cos(theta/2) exp(i (phi + psi - kappa t)/2),
    beta  = sin(theta/2) exp(i (phi - psi + kappa t)/2),

so phi and psi, modulo 2 pi, are read off the quaternion.

Axis, momenta and angular momentum at the start are written out here, as their derivation takes
time: ``tests/equations/test_formulation.py`` proves them equal to those of the Lagrangian.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from typing import Any

import sympy as sp

from heavytop.equations import lagrangian as lag
from heavytop.equations.formulation import Formulation, components, spin, time

Quaternion = tuple[Any, Any, Any, Any]

e_x, e_y, e_z, l_x, l_y, deviation = sp.symbols("e_x e_y e_z l_x l_y deviation", real=True)
g, l_z, n, kappa = sp.symbols("g l_z n kappa", real=True)
P_plus, P_minus, omega3, frame_rate = sp.symbols("P_plus P_minus omega3 frame_rate", real=True)
phi_0, psi_0 = sp.symbols("phi_0 psi_0", real=True)
q = q_0, q_1, q_2, q_3 = sp.symbols("q_0 q_1 q_2 q_3", real=True)

e = sp.Matrix([e_x, e_y, e_z])
ell = sp.Matrix([l_x, l_y, l_z])

_cos, _sin = sp.cos(lag.theta), sp.sin(lag.theta)
_along_axis = lag.psidot + lag.phidot * _cos  # the rate of spin omega3, also of a point mass
_p_psi = lag.C * _along_axis
_p_phi = lag.A * _sin**2 * lag.phidot + _p_psi * _cos

_horizontal = e_x**2 + e_y**2  # sin^2(theta), without cancellation near the poles
_along = l_x * e_x + l_y * e_y  # of l, along the horizontal part of e
_turning = -ell.cross(e)[2]  # thetadot sin(theta)
_precession = l_z * _horizontal - e_z * _along  # phidot sin^2(theta); l_z - n e_z loses digits


@cache
def axis_form(variant: str | None = None) -> Formulation:
    """Return the axis formulation; ``"sigma"`` and ``"delta"`` have psi by their quadrature."""
    if variant in ("sigma", "delta"):
        return _with_psi(axis_form(), 1 if variant == "sigma" else -1)
    if variant is not None:  # "phi", which the axis form has already
        return axis_form()
    sine, cosine = sp.sin(lag.phi), sp.cos(lag.phi)
    across = _p_psi * _sin / lag.A - lag.phidot * _sin * _cos  # of l, from the axis to the vertical
    l_start = (lag.thetadot * cosine + across * sine, lag.thetadot * sine - across * cosine)
    torque = -g * e.cross(sp.Matrix([0, 0, 1]))  # of V = gMR e_z, divided by A
    phidot = l_z - e_z * _along / _horizontal
    return Formulation(
        name="axis",
        states=(e_x, e_y, e_z, l_x, l_y),
        derivatives=(*ell.cross(e), *torque[:2]),
        start=(_sin * sine, -_sin * cosine, _cos, *l_start),
        parameters={
            g: lag.gMR / lag.A,
            l_z: _p_phi / lag.A,
            n: _p_psi / lag.A,
            kappa: _along_axis - _p_psi / lag.A,
            P_plus: (_p_phi + _p_psi) / lag.A,
            P_minus: (_p_phi - _p_psi) / lag.A,
            omega3: _along_axis,
            phi_0: lag.phi,
            psi_0: lag.psi,
        },
        outputs={
            "theta": sp.atan2(sp.sqrt(_horizontal), e_z),
            "phi": sp.atan2(e_x, -e_y),
            "thetadot": _turning / sp.sqrt(_horizontal),
            "phidot": phidot,
            "psidot": omega3 - phidot * e_z,
            **components("axis", e),
            **components("omega", ell + kappa * e),
        },
        events={"turning": _turning, "reversal": _precession},
        invariants={
            "energy": ell.dot(ell) / 2 - n**2 / 2 + g * e_z,  # e.e and l.e are its Casimirs
            "p_psi": ell.dot(e),
            "length": e.dot(e),
        },
        spin=ell.dot(e),
        reading={x.name: x for x in (*e, *ell, g, kappa, phi_0, psi_0)},
        limits=(sp.sqrt(l_x**2 + l_y**2), P_plus / 4, P_minus / 4),
        phi_wraps=True,
    )


def _with_psi(form: Formulation, side: int) -> Formulation:
    """Add the quadrature that gives phi + side psi, regular where e_z = side."""
    momentum = P_plus if side == 1 else P_minus
    uniform = psi_0 + (kappa + side * frame_rate) * time
    psi = uniform + side * (deviation - form.outputs["phi"] + phi_0)
    return replace(
        form,
        states=(*form.states, deviation),
        derivatives=(*form.derivatives, momentum / (1 + side * e_z) - frame_rate),
        start=(*form.start, sp.Integer(0)),
        given=(frame_rate,),
        outputs={**form.outputs, "psi": psi},
        psi_side=side,
    )


# --- the attitude ---------------------------------------------------------------------------------


@cache
def attitude_form(variant: str | None = None) -> Formulation:
    """Return the attitude formulation, the same whether phi and psi are wanted or not."""
    if variant is not None:
        return attitude_form()
    form = axis_form()
    _, *e_of_q = product(product(q, (0, 0, 0, 1)), (q_0, -q_1, -q_2, -q_3))
    axis = dict(zip((e_x, e_y, e_z), map(sp.expand, e_of_q), strict=True))
    outputs, events, invariants, reading = (
        {name: expression.xreplace(axis) for name, expression in each.items()}
        for each in (form.outputs, form.events, form.invariants, form.reading)
    )
    alpha, beta = sp.atan2(q_3, q_0), sp.atan2(q_2, q_1)  # their arguments
    attitude = product(q, (spin[0], 0, 0, spin[1]))
    outputs |= {
        "phi": alpha + beta,
        "psi": alpha - beta + kappa * time,
        "theta": 2 * sp.atan2(sp.sqrt(q_1**2 + q_2**2), sp.sqrt(q_0**2 + q_3**2)),
        **{f"quaternion_{i}": x for i, x in enumerate(attitude)},
    }
    torque = (rate.xreplace(axis) for rate in form.derivatives[3:])
    return replace(
        form,
        name="attitude",
        states=(*q, l_x, l_y),
        derivatives=(*product((0, l_x / 2, l_y / 2, l_z / 2), q), *torque),
        start=(*_start_quaternion(), *form.start[3:]),
        outputs=outputs,
        events=events,
        invariants=invariants | {"length": q_0**2 + q_1**2 + q_2**2 + q_3**2},
        spin=form.spin.xreplace(axis),
        reading=reading,
    )


def product(a: Quaternion, b: Quaternion) -> Quaternion:
    """Return the product of two quaternions, scalar first (Hamilton)."""
    u, v = sp.Matrix(a[1:]), sp.Matrix(b[1:])
    vector = a[0] * v + b[0] * u + u.cross(v)
    return (a[0] * b[0] - u.dot(v), vector[0], vector[1], vector[2])


def _start_quaternion() -> Quaternion:
    """Return the quaternion of Rz(phi) Rx(theta) Rz(psi)."""
    about_z = [(sp.cos(angle / 2), 0, 0, sp.sin(angle / 2)) for angle in (lag.phi, lag.psi)]
    about_x = (sp.cos(lag.theta / 2), sp.sin(lag.theta / 2), 0, 0)
    return product(product(about_z[0], about_x), about_z[1])
