"""The attitude form: a quaternion q freed from the fast spin, and l = L/A in space.

omega = l + kappa e with kappa = (1/C - 1/A) p_psi constant, and e fixed in the body: the part
kappa e is a uniform rotation about the body's axis and is taken out exactly,

    attitude = q exp(z kappa t/2),    dq/dt = l q / 2,    dl/dt = (gMR/A) (-e_y, e_x, 0),

with e = q z q* the axis. The equations are quadratic, do not know how the momentum p_psi is made
up of moment and spin, and are regular everywhere. With alpha = q_0 + i q_3 and beta = q_1 + i q_2,

    alpha = cos(theta/2) exp(i (phi + psi - kappa t)/2),
    beta  = sin(theta/2) exp(i (phi - psi + kappa t)/2),

so phi and psi, modulo 2 pi, are read off the quaternion.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from typing import Any

import sympy as sp

from heavytop.equations import lagrangian as lag
from heavytop.equations.euler_poisson import axis_form, e_x, e_y, e_z, kappa, l_x, l_y, l_z
from heavytop.equations.formulation import Formulation, spin, time

Quaternion = tuple[Any, Any, Any, Any]

q = q_0, q_1, q_2, q_3 = sp.symbols("q_0 q_1 q_2 q_3", real=True)


@cache
def attitude_form(variant: str | None = None) -> Formulation:
    """Return the attitude formulation, the same whether phi and psi are wanted or not."""
    if variant is not None:
        return attitude_form()
    seen = axis_form()
    _, *e = product(product(q, (0, 0, 0, 1)), (q_0, -q_1, -q_2, -q_3))
    axis = dict(zip((e_x, e_y, e_z), map(sp.expand, e), strict=True))
    outputs, events, invariants, reading = (
        {name: expression.xreplace(axis) for name, expression in each.items()}
        for each in (seen.outputs, seen.events, seen.invariants, seen.reading)
    )
    alpha, beta = sp.atan2(q_3, q_0), sp.atan2(q_2, q_1)  # their arguments
    attitude = product(q, (spin[0], 0, 0, spin[1]))
    outputs |= {
        "phi": alpha + beta,
        "psi": alpha - beta + kappa * time,
        "theta": 2 * sp.atan2(sp.sqrt(q_1**2 + q_2**2), sp.sqrt(q_0**2 + q_3**2)),
        **{f"quaternion_{i}": x for i, x in enumerate(attitude)},
    }
    torque = (rate.xreplace(axis) for rate in seen.derivatives[3:])
    return replace(
        seen,
        name="attitude",
        states=(*q, l_x, l_y),
        derivatives=(*product((0, l_x / 2, l_y / 2, l_z / 2), q), *torque),
        start=(*_start(), *seen.start[3:]),
        outputs=outputs,
        events=events,
        invariants=invariants | {"length": q_0**2 + q_1**2 + q_2**2 + q_3**2},
        spin=seen.spin.xreplace(axis),
        reading=reading,
    )


def product(a: Quaternion, b: Quaternion) -> Quaternion:
    """Return the product of two quaternions, scalar first (Hamilton)."""
    u, v = sp.Matrix(a[1:]), sp.Matrix(b[1:])
    vector = a[0] * v + b[0] * u + u.cross(v)
    return (a[0] * b[0] - u.dot(v), vector[0], vector[1], vector[2])


def _start() -> Quaternion:
    """Return the quaternion of Rz(phi) Rx(theta) Rz(psi)."""
    about_z = [(sp.cos(angle / 2), 0, 0, sp.sin(angle / 2)) for angle in (lag.phi, lag.psi)]
    about_x = (sp.cos(lag.theta / 2), sp.sin(lag.theta / 2), 0, 0)
    return product(product(about_z[0], about_x), about_z[1])
