"""The formulations in Euler's angles: Lagrange's equations, their subsystem, Routh's reduction.

All are singular at theta = 0 and pi, and serve for comparison. Lagrange's have phi and psi as
states, which grow without bound and spoil the step control of an integrator that measures its error
against the largest state. The equations do not contain phi and psi, so theta, thetadot, phidot and
psidot form a system of their own (SICM section 2.10). Routh's has theta alone, in an effective
potential with p_phi and p_psi as parameters; p_phi - p_psi cos(theta) is computed as
(p_phi - p_psi) + 2 p_psi sin^2(theta/2), without cancellation near the top.

In the last two, phi and psi follow by quadratures of their deviations from uniform rotations: exact
for any rate of the rotation, and bounded for the mean rate.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import cache
from typing import Any

import sympy as sp

from heavytop.equations import lagrangian as lag
from heavytop.equations.formulation import Formulation, components, time
from heavytop.equations.lagrangian import A, C, gMR, p_psi, theta, thetadot

DEVIATIONS = phi_deviation, psi_deviation = sp.symbols("phi_deviation psi_deviation", real=True)
MEAN_RATES = phi_rate, psi_rate = sp.symbols("phi_rate psi_rate", real=True)
phi_0, psi_0, p_minus, omega3 = sp.symbols("phi_0 psi_0 p_minus omega3", real=True)

_TOP = {A: A, C: C, gMR: gMR}
_STARTS = {phi_0: lag.phi, psi_0: lag.psi}
_precise = p_minus + 2 * p_psi * sp.sin(theta / 2) ** 2  # p_phi - p_psi cos(theta)


@cache
def lagrange_form(_: str | None = None) -> Formulation:
    """Return the six-dimensional textbook formulation."""
    both = lag.COORDINATES + lag.VELOCITIES
    outputs = {symbol.name: symbol for symbol in both}
    return replace(
        subsystem_form(),
        name="lagrange",
        states=both,
        derivatives=lag.VELOCITIES + lag.accelerations(),
        start=both,
        parameters=_TOP,
        outputs=outputs | _space_vectors(outputs),
        reading={symbol.name: symbol for symbol in (*both, *_TOP)},
    )


@cache
def subsystem_form(variant: str | None = None) -> Formulation:
    """Return the four-dimensional subsystem; with ``"angles"``, phi and psi by quadrature."""
    if variant == "angles":
        return with_angles(subsystem_form())
    _, for_phi, for_psi = lag.momenta()
    states = (theta, *lag.VELOCITIES)
    return Formulation(
        name="subsystem",
        states=states,
        derivatives=(thetadot, *lag.accelerations()),
        start=states,
        parameters=_TOP | _STARTS,
        outputs={symbol.name: symbol for symbol in states},
        events={"turning": thetadot, "reversal": lag.phidot},
        invariants={
            "energy": sp.expand(lag.energy() / A) - for_psi**2 / (2 * A * C),
            "p_phi": for_phi / A,
            "p_psi": for_psi / A,
        },
        spin=for_psi / A,
        reading={"phi": phi_0, "psi": psi_0} | {x.name: x for x in (*states, *_TOP)},
    )


@cache
def routh_form(variant: str | None = None) -> Formulation:
    """Return Routh's reduced formulation; with ``"angles"``, phi and psi by quadrature."""
    if variant == "angles":
        return with_angles(routh_form())
    _, for_phi, for_psi = lag.momenta()
    momenta = {p_psi: for_psi, p_minus: for_phi - for_psi, omega3: for_psi / C}
    phidot = _precise / (A * sp.sin(theta) ** 2)
    psidot = omega3 - phidot * sp.cos(theta)
    energy = (lag.reduced_energy() - p_psi**2 / (2 * C)) / A
    return Formulation(
        name="routh",
        states=(theta, thetadot),
        derivatives=(thetadot, _without_cancellation(lag.nutation_acceleration())),
        start=(theta, thetadot),
        parameters=_TOP | momenta | _STARTS,
        outputs={"theta": theta, "thetadot": thetadot, "phidot": phidot, "psidot": psidot},
        events={"turning": thetadot, "reversal": _precise},
        invariants={"energy": _without_cancellation(energy)},
        spin=p_psi / A,
        reading={"phi": phi_0, "psi": psi_0, "phidot": phidot, "omega3": p_psi / C}
        | {x.name: x for x in (theta, thetadot, *_TOP)},
    )


def _without_cancellation(expression: Any) -> Any:
    """Return an expression with p_phi - p_psi cos(theta) in the form that does not cancel."""
    split = expression.subs(lag.p_phi, p_minus + p_psi)
    return split.subs(p_minus + p_psi - p_psi * sp.cos(theta), _precise)


def with_angles(form: Formulation) -> Formulation:
    """Return a formulation with quadratures for phi and psi, and so with the vectors in space."""
    phi = phi_0 + phi_rate * time + phi_deviation
    psi = psi_0 + psi_rate * time + psi_deviation
    rates = (form.outputs["phidot"] - phi_rate, form.outputs["psidot"] - psi_rate)
    outputs = {**form.outputs, "phi": phi, "psi": psi}
    return replace(
        form,
        states=(*form.states, *DEVIATIONS),
        derivatives=(*form.derivatives, *rates),
        start=(*form.start, sp.Integer(0), sp.Integer(0)),
        given=MEAN_RATES,
        outputs=outputs | _space_vectors(outputs),
    )


def _space_vectors(outputs: Mapping[str, Any]) -> dict[str, Any]:
    """Return the axis and the angular velocity in space, of the angles and their rates."""
    values = {symbol: outputs[symbol.name] for symbol in lag.COORDINATES + lag.VELOCITIES}
    omega = (lag.rotation() * lag.angular_velocity()).applyfunc(lag.normal_form)
    named = components("axis", lag.axis()) | components("omega", omega)
    return {name: x.subs(values, simultaneous=True) for name, x in named.items()}
