"""Events of many tops: what is known of them beforehand, which zeros count, and true numbers."""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from heavytop.analytic.motion import Motion
from heavytop.classification.arrays import Mask
from heavytop.errors import HeavyTopError
from heavytop.exact.pairs import EPSILON, Array
from heavytop.integration.batch import Zeros, join_zeros
from heavytop.integration.outputs import form_values
from heavytop.run.counts import count_events
from heavytop.run.estimates import LOCAL_ROUNDING

if TYPE_CHECKING:
    from heavytop.run.ensemble import Ensemble


SMALL_NUTATION = 1e-3  # rad: only of a smaller nutation a step may hold two turning points
SHORT = 0.1  # of the shortest time scale: so soon after an event there is no other


class Expected(NamedTuple):
    """What is known of the events of one kind before anything is integrated.

    Attributes
    ----------
    never, begins : ndarray of bool, shape (k,)
        Which tops never have this event, and which start exactly at one.
    risky : ndarray of bool, shape (k,)
        Which tops start at an event and may reach another one in the first step.
    short : ndarray, shape (k,)
        A time after the start in which there is no other event [s].
    rate : ndarray, shape (k,)
        About the largest rate of the motion [1/s].
    """

    never: Mask
    begins: Mask
    risky: Mask
    short: Array
    rate: Array

    @classmethod
    @np.errstate(all="ignore")  # of what is no number nothing is known
    def of(cls, event: str, start: Mapping[str, Array]) -> Expected:
        """What is known of one event function from the starts."""
        theta, thetadot, phidot = (start[name] for name in ("theta", "thetadot", "phidot"))
        sine, cosine, g = np.sin(theta), np.cos(theta), start["gMR"] / start["A"]
        b = start["C"] / start["A"] * (start["psidot"] + phidot * cosine)
        rate = abs(b) + 2 * np.sqrt(abs(g)) + np.hypot(thetadot, phidot * sine)
        short = SHORT / rate
        if event == "turning":
            pull = sine * (phidot**2 * cosine - b * phidot + g)  # θ̈
            nods = abs(thetadot) / rate + abs(pull) / rate**2  # about how far, at least
            begins = (nods > 0) & ((thetadot == 0) | (theta == 0))
            return cls(~(nods > 0), begins, begins & (nods < SMALL_NUTATION), short, rate)
        plus, minus = pole_momenta(start).values()
        never = ~(plus * minus < 0) | ((thetadot == 0) & (phidot == 0))
        begins = ~never & (phidot == 0)
        again = sine * abs(thetadot) / (thetadot**2 + abs(g) * sine**2)  # beside a pole or a cusp
        return cls(never, begins, begins, np.fmin(short, again / 2), rate)


def pole_momenta(start: Mapping[str, Array]) -> dict[str, Array]:
    """(p_φ ± p_ψ)/A, by terms that do not cancel beside a pole, so that the signs are right."""
    theta, phidot = start["theta"], start["phidot"]
    b = start["C"] / start["A"] * (start["psidot"] + phidot * np.cos(theta))
    drift = phidot * np.sin(theta) ** 2
    plus, minus = (2 * b * np.square(half(theta / 2)) for half in (np.cos, np.sin))
    return {"P_plus": drift + plus, "P_minus": drift - minus}


def filter_zeros(run: Ensemble, expected: list[Expected]) -> Zeros:
    """The zeros that count, each once, with those exactly at the start or at the end.

    Whether the start is an event follows from the arguments of `propagate_many`; the integrator may
    find that zero beside the start, or not at all. A zero behind the end by less than its rounding,
    `margin` [s], is at the end.
    """
    found, parts = run.zeros, []
    for code, (event, before) in enumerate(zip(run.events, expected, strict=True)):
        echo = before.begins[found.which]
        echo &= abs(found.t) <= before.short[found.which] / 2
        here = found.at((found.event == code) & ~before.never[found.which] & ~echo)
        last = np.zeros(run.end.size)
        np.maximum.at(last, here.which, abs(here.t))
        zero, slope = form_values(run.formulation, event, run.states, run.parameters, run.end)
        with np.errstate(all="ignore"):
            late = -zero / slope * np.sign(run.end)
            nutations = abs(run.end) * before.rate / (2 * np.pi)
            margin = EPSILON * LOCAL_ROUNDING * (1 + nutations) ** 1.5 / before.rate
            ends = (late > 0) & (late <= margin) & (last < abs(run.end) - margin) & ~before.never
        parts.append(here)
        for where, t in ((before.begins, np.zeros_like(run.end)), (ends, run.end)):
            which = np.flatnonzero(where & np.isfinite(run.end))
            parts.append(Zeros(which, np.full(which.size, code), t[which]))
    return join_zeros(parts)


def count_bounds(motion: Motion, end: float, event: str) -> tuple[float, float]:
    """The least and the greatest number of events from 0 to a time; nan where it is not known."""
    with suppress(HeavyTopError):
        if counts := count_events(motion, end, (event,)):
            return counts[event]
        if motion.regime.steady:
            return 0, 0
    return np.nan, np.nan
