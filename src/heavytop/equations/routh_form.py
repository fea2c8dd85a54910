"""Routh's reduction: one degree of freedom, theta, in an effective potential.

p_phi and p_psi are parameters. p_phi - p_psi cos(theta) is formed as
(p_phi - p_psi) + 2 p_psi sin^2(theta/2), which keeps its digits near the top.
"""

from __future__ import annotations

from functools import cache
from typing import Any

import sympy as sp

from heavytop.equations import angles, reduction
from heavytop.equations import lagrangian as lag
from heavytop.equations.formulation import Formulation
from heavytop.equations.reduction import p_minus, p_psi

theta, thetadot, A = lag.theta, lag.thetadot, lag.A
omega3 = sp.Symbol("omega3", real=True)
precise = p_minus + 2 * p_psi * sp.sin(theta / 2) ** 2  # p_phi - p_psi cos(theta)


@cache
def routh_form(variant: str | None = None) -> Formulation:
    """Return the reduced formulation; with ``"angles"``, phi and psi by quadrature."""
    carried = variant == "angles"
    phidot = precise / (A * sp.sin(theta) ** 2)
    psidot = omega3 - phidot * sp.cos(theta)
    extra = angles.deviation_rates(phidot, psidot) if carried else ()
    outputs: dict[str, Any] = {
        "theta": theta,
        "thetadot": thetadot,
        "phidot": phidot,
        "psidot": psidot,
    }
    if carried:
        outputs |= angles.angles()
        rates = (thetadot, phidot, psidot)
        outputs |= angles.space_vectors(theta, outputs["phi"], outputs["psi"], rates)
    return Formulation(
        name="routh",
        summary="theta in an effective potential, with p_phi and p_psi as parameters",
        states=(theta, thetadot, *(angles.DEVIATIONS if carried else ())),
        derivatives=(thetadot, _acceleration(), *extra),
        start=(theta, thetadot, *([sp.Integer(0)] * len(extra))),
        parameters=_parameters(),
        given=angles.RATES if carried else (),
        outputs=outputs,
        events={"turning": thetadot, "reversal": precise},
        invariants={"energy": _without_cancellation(_energy())},
        spin=p_psi / A,
        starts_at_pole=False,
        unbounded=False,
        rates=(thetadot,),
    )


def _acceleration() -> Any:
    return _without_cancellation(reduction.nutation_acceleration())


def _energy() -> Any:
    """Return E'/A."""
    return (reduction.reduced_energy() - p_psi**2 / (2 * lag.C)) / A


def _without_cancellation(expression: Any) -> Any:
    split = expression.subs(reduction.p_phi, p_minus + p_psi)
    return split.subs(p_minus + p_psi - p_psi * sp.cos(theta), precise)


def _parameters() -> dict[Any, Any]:
    _, for_phi, for_psi = lag.momenta()
    return {
        A: A,
        lag.C: lag.C,
        lag.gMR: lag.gMR,
        p_psi: for_psi,
        p_minus: for_phi - for_psi,
        omega3: for_psi / lag.C,
        **angles.STARTS,
    }
