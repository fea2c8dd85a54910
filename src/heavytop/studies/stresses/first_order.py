"""The tilt from its first integral, u' = ±sqrt(f(u)), which rests at a turning point for ever.

Where f vanishes its root is not Lipschitz: u = const solves the equation too, and once there a
solver has no reason to leave. A textbook that tells one to flip the sign there does not say when.
"""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from heavytop.analytic.motion import Motion
from heavytop.comparison.adaptive import textbook_solve
from heavytop.numbers.double_double import Array
from heavytop.studies.stresses.methods import Method
from heavytop.studies.stresses.raw import Raw

RESTING: Final = 1e-2  # of the greatest rate


def first_order(motion: Motion, method: Method, end: float, step_limit: int) -> Raw:
    """Solve u' = ±sqrt(f(u)) from the start of a motion, with the sign that it starts with.

    Parameters
    ----------
    motion : Motion
    method : Method
    end : float
        [s]
    step_limit : int
    """
    r = motion.reduced
    g, a, b, h = (float(x) for x in (r.g, r.a, r.b, r.h))
    sign = math.copysign(1.0, float(r.udot0))

    def rate(u: float) -> float:
        f = 2 * (h - g * u) * (1 - u * u) - (a - b * u) ** 2
        return sign * math.sqrt(max(f, 0.0))

    def rates(_: float, y: Array) -> list[float]:
        return [rate(float(y[0]))]

    start = float(r.u0)
    first, tolerances = np.array([start]), (method.rtol, method.atol)
    told = textbook_solve(rates, first, end, method.solver, *tolerances, step_limit)
    raw = Raw(told.status, told.message, told.t, told.steps, told.smallest)
    if told.status != "finished":
        return raw
    u = float(told.state[0])
    fastest = max(abs(rate(x)) for x in np.linspace(u, start, 65))
    return Raw(
        told.status,
        told.message,
        told.t,
        told.steps,
        told.smallest,
        theta=math.acos(max(-1.0, min(1.0, u))),
        moved=abs(math.acos(u) - math.acos(start)),
        resting=abs(rate(u)) < RESTING * fastest,
    )
