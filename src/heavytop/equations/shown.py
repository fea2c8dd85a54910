"""Names for what the derivation shows, and the equations that need more than one of them."""

from __future__ import annotations

from functools import cache
from typing import Any

import sympy as sp

from heavytop.equations import gathered
from heavytop.equations import lagrangian as lag
from heavytop.equations.axis_form import axis_form, e_x, e_y, e_z, g, l_z
from heavytop.equations.reduction import p_phi, p_psi, u, udot

T, V, L, E, R, V_eff = sp.symbols("T V L E R V_eff", real=True)
OMEGA = sp.symbols("omega_1:4", real=True)
MOMENTA = (sp.Symbol("p_theta", real=True), p_phi, p_psi)
AXIS = (e_x, e_y, e_z)
RATES = sp.symbols("edot_x edot_y edot_z ldot_x ldot_y", real=True)


def cubic_equations() -> tuple[tuple[Any, Any], ...]:
    """Return what u stands for, and its squared rate."""
    return (u, sp.cos(lag.theta)), (udot**2, gathered.cubic())


@cache
def axis_equations() -> tuple[tuple[Any, Any], ...]:
    """Return the rates of the axis and of l = L/A, and what l is along the vertical and e."""
    form = axis_form()
    equations = (equation.subs(g, lag.gMR / lag.A) for equation in form.derivatives)
    constants = ((l_z, p_phi / lag.A), (form.spin, p_psi / lag.A))
    return (*zip(RATES, equations, strict=True), *constants)
