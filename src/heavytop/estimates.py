"""What a plan will cost, and how far off it will end: estimates, from what was measured.

Steps and time grow with the nutation periods; so does the error. An integration in doubles whose
state holds no growing angle loses phase as the 3/2 power of the periods, a projected one as the
square root. ``validation/05_formulations.py`` and ``validation/09_projection.py`` measure what
stands here, ``validation/17_auto.py`` holds the plans that follow from it against every other.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Final

import numpy as np

from heavytop.motion import Motion
from heavytop.scene import Scene
from heavytop.taylor.bits import DOUBLE, LONG_DOUBLE
from heavytop.theory.closed_form import Asymptotic
from heavytop.theory.double_form import DoubleRecord

UNIT: Final = 2.0**-53


@dataclass(frozen=True, slots=True)
class Estimate:
    """What is expected of a run.

    Attributes
    ----------
    seconds : float
        Time to integrate and to sample, without compiling [s].
    error : float
        Largest error at the end of what is wanted, each relative to max(1, |x|).
    """

    seconds: float
    error: float


@dataclass(frozen=True, slots=True)
class Rate:
    """What a formulation does in one nutation period, in doubles.

    Attributes
    ----------
    microseconds : float
        Time of a period without events or samples.
    drift : float
        Phase lost after N periods, in units of T 2⁻⁵³ N^{3/2}.
    """

    microseconds: float
    drift: float


RATES: Final = {
    "cubic": Rate(2.5, 2.0),
    "axis": Rate(3.8, 2.0),
    "attitude": Rate(10.0, 4.0),
    "routh": Rate(21.0, 2.0),
    "subsystem": Rate(36.0, 2.0),
    "lagrange": Rate(30.0, 200.0),
}
QUADRATURE_US: Final = 2.0  # of psi beside the axis
WATCHED: Final = 3.0  # times as long, with events
SAMPLE_US: Final = 2.0
PROJECTED: Final = 1.4  # times as long, and
WANDER: Final = 120.0  # phase after N periods, in units of T 2⁻⁵³ N^{1/2},
STEADY: Final = 0.1  # and of T 2⁻⁵³ N, for starts at which rounding does not average out
LOCAL: Final = 16.0  # units of rounding in a state at the end, whatever the span
LONG_DOUBLE_MS: Final = 0.3  # a period in long doubles,
MPFR_MS: Final = 9.0  # and in 128 bits; it grows a little faster than their square
LOOKED_AT: Final = 65  # times at which the rates are taken


def estimate(
    scene: Scene, motion: Motion, span: float, formulation: str, *, projected: bool, bits: int
) -> Estimate:
    """What is expected of a run of so many seconds.

    Parameters
    ----------
    scene : Scene
        What is wanted of it.
    motion : Motion
    span : float
        Its end [s].
    formulation : str
    projected : bool
    bits : int
        Of the numbers it is made in: 53 are doubles.
    """
    finer = 2.0 ** (DOUBLE - bits)
    error = finer * _error(scene, motion, span, formulation, projected=projected)
    return Estimate(_seconds(scene, motion, span, formulation, projected, bits), error)


def periods_of(motion: Motion, span: float) -> float:
    """How many nutation periods a span has; of what does not nutate, turns of what moves."""
    if motion.period:
        return abs(span) / motion.period
    r = motion.reduced
    fastest = float(abs(r.b)) + math.sqrt(float(abs(r.g))) + float(abs(r.drift0))
    return abs(span) * fastest / math.tau


def _seconds(
    scene: Scene, motion: Motion, span: float, formulation: str, projected: bool, bits: int
) -> float:
    turned = formulation == "axis" and bool({"psi", "attitude"} & set(scene.quantities))
    each = RATES[formulation].microseconds + QUADRATURE_US * turned
    each *= (PROJECTED if projected else 1.0) * (WATCHED if scene.events else 1.0)
    if bits > DOUBLE:
        longer = MPFR_MS * (bits / 128) ** 2.2
        each += 1e3 * (LONG_DOUBLE_MS if bits == LONG_DOUBLE else longer)
    return float(1e-6 * (each * periods_of(motion, span) + SAMPLE_US * scene.samples))


def _error(
    scene: Scene, motion: Motion, span: float, formulation: str, *, projected: bool
) -> float:
    """The largest error of what is wanted, at the times at which it will be looked at."""
    count = periods_of(motion, span)
    walked = RATES[formulation].drift * count**1.5
    lost = WANDER * count**0.5 + STEADY * count if projected else walked
    late = UNIT * abs(span) / max(count, 1.0) * lost * growth(motion, span)
    here = UNIT * LOCAL * growth(motion, span)
    if formulation == "cubic":  # theta from a height
        here /= min(1.0, max(math.sqrt(UNIT), min(motion.from_top, motion.from_bottom)))
    seen = motion.double(np.linspace(0.0, span, LOOKED_AT))
    return float(here + late * _quickest(scene, seen))


def _quickest(scene: Scene, seen: DoubleRecord) -> float:
    """The largest rate of what is wanted, beside max(1, |x|) at the end [1/s]."""
    wants = set(scene.quantities)
    across = seen.phidot * np.sin(seen.theta)
    rates = {"axis": np.hypot(seen.thetadot, across), "theta": seen.thetadot}
    seen_by = wants | ({"axis"} if "attitude" in wants else set())
    found = [0.0, *(float(np.max(abs(rate))) for name, rate in rates.items() if name in seen_by)]
    for angle in ("phi", "psi"):
        if {angle, "attitude"} & wants:
            rate = float(np.max(abs(getattr(seen, f"{angle}dot"))))
            found.append(rate / max(1.0, abs(float(getattr(seen, angle)[-1]))))
    return max(found)


def growth(motion: Motion, span: float) -> float:
    """By how much an error grows beside one in phase: near the separatrix, and on it.

    Parameters
    ----------
    motion : Motion
    span : float
        The end [s].
    """
    path = motion.exact.orbit
    if isinstance(path, Asymptotic):
        return math.exp(min(float(path.w) * abs(span), 700.0))
    return 1.0 if motion.nutation is None else max(1.0, float(1 / motion.nutation.mc))
