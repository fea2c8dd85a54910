"""The book's subsystem: theta and the three rates, which do not know phi and psi.

The Lagrange equations do not contain phi and psi, so theta, thetadot, phidot and psidot form a
system of their own (SICM section 2.10); phi and psi follow by two quadratures. The poles of the
textbook form stay.
"""

from __future__ import annotations

from functools import cache

import sympy as sp

from heavytop.equations import angles
from heavytop.equations import lagrangian as lag
from heavytop.equations.formulation import Formulation


@cache
def subsystem_form(variant: str | None = None) -> Formulation:
    """Return the four-dimensional subsystem; with ``"angles"``, phi and psi by quadrature."""
    _, p_phi, p_psi = lag.momenta()
    carried = variant == "angles"
    energy = sp.expand(lag.energy() / lag.A) - p_psi**2 / (2 * lag.A * lag.C)
    extra = angles.deviation_rates(lag.phidot, lag.psidot) if carried else ()
    outputs = {s.name: s for s in (lag.theta, *lag.VELOCITIES)}
    if carried:
        outputs |= angles.angles()
        vectors = (lag.theta, outputs["phi"], outputs["psi"], lag.VELOCITIES)
        outputs |= angles.space_vectors(*vectors)
    return Formulation(
        name="subsystem",
        summary="theta and the three rates; phi and psi by quadrature",
        states=(lag.theta, *lag.VELOCITIES, *(angles.DEVIATIONS if carried else ())),
        derivatives=(lag.thetadot, *lag.accelerations(), *extra),
        start=(lag.theta, *lag.VELOCITIES, *([sp.Integer(0)] * len(extra))),
        parameters={lag.A: lag.A, lag.C: lag.C, lag.gMR: lag.gMR, **angles.STARTS},
        given=angles.RATES if carried else (),
        outputs=outputs,
        events={"turning": lag.thetadot, "reversal": lag.phidot},
        invariants={"energy": energy, "p_phi": p_phi / lag.A, "p_psi": p_psi / lag.A},
        spin=p_psi / lag.A,
        starts_at_pole=False,
        unbounded=False,
        rates=lag.VELOCITIES,
    )
