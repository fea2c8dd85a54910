"""The cubic formulation: u = cos(theta) in the potential of a cubic, measured from the nearer pole.

udot^2 = f(u) is a cubic, so uddot = f'(u)/2 is quadratic: the cheapest right-hand side, regular at
the poles. As theta near a pole would lose half its digits through u, the state is the height
w = 1 - u from the top, or w = 1 + u from the bottom, and the coefficients are those of distances to
that pole: E' -+ gMR and p_phi -+ p_psi. They are parameters, each rounded once: computed from g, n
and P in each step they would have the same rounding error each time, which is another top.
"""

from __future__ import annotations

from functools import cache
from typing import Any

import sympy as sp

from heavytop.equations import lagrangian as lag
from heavytop.equations.formulation import Formulation

w, wdot = sp.symbols("w wdot", real=True)
g, n, excess, P, h, omega3 = sp.symbols("g n excess P h omega3", real=True)
k_0, k_1, k_2 = sp.symbols("k_0 k_1 k_2", real=True)


@cache
def cubic_form(variant: str | None = None) -> Formulation:
    """Return the formulation in the height from the ``"bottom"``, or else from the top."""
    side = -1 if variant == "bottom" else 1
    u = side * (1 - w)
    sine = sp.sqrt(sp.Abs(w * (2 - w)))  # by rounding w may be an ulp beyond a pole
    phidot = (P + side * n * w) / (w * (2 - w))
    read = (w, wdot, k_0, k_1, k_2, P, n, omega3)
    wdot_squared = 2 * sp.integrate(k_0 + k_1 * w + k_2 * w**2, w) - P**2
    return Formulation(
        name="cubic",
        states=(w, wdot),
        derivatives=(wdot, k_0 + w * (k_1 + k_2 * w)),
        start=(1 - side * sp.cos(lag.theta), side * sp.sin(lag.theta) * lag.thetadot),
        parameters=_parameters(side),
        outputs={
            "theta": sp.atan2(sine, u),
            "thetadot": side * wdot / sine,
            "phidot": phidot,
            "psidot": omega3 - phidot * u,
            "axis_z": u,
        },
        events={"turning": side * wdot, "reversal": P + side * n * w},
        invariants={"energy": h + (wdot**2 - wdot_squared) / 2},
        spin=n,
        reading={x.name: x for x in read} | {"side": sp.Integer(side)},
        limits=(sp.sqrt((k_0 + sp.Abs(k_0)) / 2), n / 2, -n / 2),
    )


def height_cubic(side: int) -> Any:
    """Return wdot^2 as a function of w: f(u) at u = side (1 - w), in distances from that pole."""
    return 2 * (excess + side * g * w) * w * (2 - w) - (P + side * n * w) ** 2


def _parameters(side: int) -> dict[Any, Any]:
    """The constants as functions of A, C, gMR and the start."""
    _, p_phi, p_psi = lag.momenta()
    reduced = lag.energy() / lag.A - p_psi**2 / (2 * lag.A * lag.C)
    values = {g: lag.gMR / lag.A, n: p_psi / lag.A, P: (p_phi - side * p_psi) / lag.A}
    distances = {**values, excess: reduced - side * lag.gMR / lag.A}
    acceleration = sp.Poly(sp.diff(height_cubic(side), w) / 2, w)
    for i, k in enumerate((k_0, k_1, k_2)):
        values[k] = acceleration.coeff_monomial(w**i).subs(distances, simultaneous=True)
    return {**values, h: reduced, omega3: p_psi / lag.C}
