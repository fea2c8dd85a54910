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

from heavytop.analytic.motion import Motion
from heavytop.integration.bits import DOUBLE, LONG_DOUBLE
from heavytop.run.speeds import quickest
from heavytop.scene.scene import Scene

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
WANDER: Final = 40.0  # phase after N periods, in units of T 2⁻⁵³ N^{1/2},
STEADY: Final = 0.1  # and of T 2⁻⁵³ N, for starts at which rounding does not average out
LOCAL: Final = 16.0  # units of rounding in a state at the end, whatever the span,
TURNED: Final = 12.0  # and of N^{1/2}: how far the whole motion turns away, were it never late,
PINNED: Final = 6.0  # projected
LONG_DOUBLE_MS: Final = 0.3  # a period in long doubles,
MPFR_MS: Final = 9.0  # and in 128 bits; it grows a little faster than their square
HEAVY: Final = 2400.0  # bits, beyond which it grows as their cube
SHORT_S: Final = 60.0  # below which a time is told in seconds
LONGER: Final = ((31_557_600, "years"), (86_400, "days"), (3600, "h"), (60, "min"))
EVENT_MS: Final = 1.3  # to polish one beyond doubles, and to read it,
READ_MS: Final = 0.6  # and to read a sample there
SINGULAR: Final = frozenset({"routh", "subsystem", "lagrange"})  # at the poles
SPARE_STEPS: Final = 1_000_000  # some seconds of them,
STEPS: Final = 1_000  # and so many for each nutation: a sound run takes 10 to 40
MOST_ERROR: Final = 1e300  # so that what is worse than any error is still a number


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


def duration(seconds: float) -> str:
    """A time in the unit in which it is read: seconds, minutes, hours, days or years.

    Examples
    --------
    >>> [duration(x) for x in (3.17, 90, 24_400, 3e5, 1e12)]
    ['3.17 s', '1.5 min', '6.78 h', '3.47 days', '3.17e+04 years']
    """
    if seconds < SHORT_S:
        return f"{seconds:.3g} s"
    unit, name = next((u, n) for u, n in LONGER if seconds >= u)
    return f"{seconds / unit:.3g} {name}"


def most_steps(motion: Motion, span: float) -> int:
    """Steps that no sound run of so many seconds takes, by far.

    Parameters
    ----------
    motion : Motion
    span : float
        Its end [s].

    Examples
    --------
    >>> from heavytop.scene.scene import load_scene
    >>> scene = load_scene("sicm-kicked")
    >>> most_steps(Motion(scene.top, scene.start), 2.0)
    1003683
    """
    return int(SPARE_STEPS + STEPS * periods_of(motion, span))


def _nearest(motion: Motion) -> float:
    """How near a pole the axis comes, at most 1 [rad]."""
    return min(motion.from_top, motion.from_bottom, 1.0)


def _seconds(
    scene: Scene, motion: Motion, span: float, formulation: str, projected: bool, bits: int
) -> float:
    turned = formulation == "axis" and bool({"psi", "attitude"} & set(scene.quantities))
    each = RATES[formulation].microseconds + QUADRATURE_US * turned
    if formulation in SINGULAR:  # where time scales follow one another down to the pass, and back
        each *= 1 - math.log10(max(_nearest(motion), UNIT))
    each *= (PROJECTED if projected else 1.0) * (WATCHED if scene.events else 1.0)
    sampled = SAMPLE_US
    if bits > DOUBLE:
        longer = MPFR_MS * (bits / 128) ** 2.2 * max(1.0, bits / HEAVY)
        each += 1e3 * (LONG_DOUBLE_MS if bits == LONG_DOUBLE else longer)
        each += 1e3 * EVENT_MS * _events_in_a_period(scene, motion)
        sampled += 1e3 * READ_MS
    return float(1e-6 * (each * periods_of(motion, span) + sampled * scene.samples))


def _events_in_a_period(scene: Scene, motion: Motion) -> int:
    """How many of the wanted events a nutation has: two turning points, two reversals, a cusp."""
    if not motion.nutates:
        return 0
    turning = 2 if "turning" in scene.events else int(motion.kind == "cusps")
    return turning + 2 * ("reversal" in scene.events and motion.kind == "loops")


def _error(
    scene: Scene, motion: Motion, span: float, formulation: str, *, projected: bool
) -> float:
    """The largest error of what is wanted, at any time at which it may be looked at."""
    count = periods_of(motion, span)
    walked = RATES[formulation].drift * count * math.sqrt(count)
    lost = WANDER * math.sqrt(count) + STEADY * count if projected else walked
    late = UNIT * abs(span) / max(count, 1.0) * lost * growth(motion, span)
    here = UNIT * LOCAL * growth(motion, span)
    if formulation == "cubic":  # theta from a height
        here /= min(1.0, max(math.sqrt(UNIT), min(motion.from_top, motion.from_bottom)))
    if formulation in SINGULAR:  # beside a pole, θ has the digits that it has beside one
        here *= (1 + count) / max(_nearest(motion), 1 / MOST_ERROR)
    aside = UNIT * (PINNED if projected else TURNED) * math.sqrt(count) * growth(motion, span)
    phase = late * quickest(scene.quantities, motion, span)
    return min(here + max(phase, aside), MOST_ERROR)


def growth(motion: Motion, span: float) -> float:
    """By how much an error grows beside one in phase: near the separatrix, and on it.

    Parameters
    ----------
    motion : Motion
    span : float
        The end [s].
    """
    if (rate := motion.exact.growth) is not None:
        return math.exp(min(float(rate) * abs(span), 700.0))
    modulus = motion.exact.modulus
    return 1.0 if modulus is None else max(1.0, float(1 / modulus[1]))
