"""What a run will cost, how far off it will end, and the bits that its digits take: estimates.

Steps and time grow with the nutation periods; so does the error. An integration in doubles whose
state holds no growing angle loses phase as the 3/2 power of the periods, a projected one as the
square root. ``validation/05_formulations.py`` and ``validation/09_projection.py`` measure what
stands here, ``validation/17_auto.py`` holds the plans that follow from it against every other.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Final

import numpy as np

from heavytop.analytic.motion import Motion
from heavytop.integration.bits import DOUBLE, LONG_DOUBLE, enough
from heavytop.scene.scene import Scene

UNIT: Final = 2.0**-53

# Time of a nutation period without events or samples [µs], and the phase lost after N periods in
# units of T 2⁻⁵³ N^{3/2}
RATES: Final = {
    "cubic": (2.5, 2.0),
    "axis": (3.8, 2.0),
    "attitude": (10.0, 4.0),
    "routh": (21.0, 2.0),
    "subsystem": (36.0, 2.0),
    "lagrange": (30.0, 200.0),
}
QUADRATURE_US: Final = 2.0  # of psi beside the axis
WATCHED: Final = 3.0  # times as long, with events
SAMPLE_US: Final = 2.0
PROJECTED: Final = 1.4  # times as long, and
WANDER: Final = 40.0  # phase after N periods, in units of T 2⁻⁵³ N^{1/2}
STEADY: Final = 0.1  # the same in units of T 2⁻⁵³ N, where rounding does not average out
LOCAL: Final = 16.0  # units of rounding in a state at the end, whatever the span
TURNED: Final = 12.0  # error of the orientation apart from the phase, in such units times N^{1/2}
PINNED: Final = 6.0  # the same, projected
LONG_DOUBLE_MS: Final = 0.3  # a period in long doubles
MPFR_MS: Final = 9.0  # a period in 128 bits; it grows a little faster than their square
HEAVY: Final = 2400.0  # bits, beyond which it grows as their cube
MOST_TIMED: Final = 2**40  # bits; a plan that takes more is refused
EVENT_MS: Final = 1.3  # to polish an event beyond doubles, and to read it
READ_MS: Final = 0.6  # to read a sample beyond doubles
SINGULAR: Final = frozenset({"routh", "subsystem", "lagrange"})  # at the poles
SPARE_STEPS: Final = 1_000_000  # some seconds of them,
STEPS: Final = 1_000  # and so many for each nutation: a sound run takes 10 to 40
MOST_ERROR: Final = 1e300  # so that what is worse than any error is still a number

MOST_DIGITS: Final = 13  # what double precision can promise at the end of a short run
SPARE: Final = 2.0  # bits, beyond those that have a reason
LEAST_FOLDED: Final = 16  # digits of a fold, so that doubles lose nothing
FOLDED_REACH: Final = 2.0**44  # half-periods, unless the scene reaches farther
SPARE_FOLDED: Final = 4.0  # bits
MOST_TURNS: Final = 2.0**60  # of theta, phi or psi that are counted

PLACES: Final = 64  # of a nutation, at which rates are looked at
SHORT_S: Final = 60.0  # below which a time is told in seconds
LONGER: Final = ((31_557_600, "years"), (86_400, "days"), (3600, "h"), (60, "min"))


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


class Forecast:
    """What is expected of the runs of one scene up to a time [s].

    Call it with a formulation, whether it is projected, and the bits of its numbers.
    """

    def __init__(self, scene: Scene, motion: Motion, span: float) -> None:
        self.scene, self.motion, self.span = scene, motion, span
        self.periods = periods_of(motion, span)
        self.returns = motion.regime != "asymptotic"
        self.growth = 2.0 ** min(_bits_grown(motion, span), 1010.0)  # a number still
        self.rounding = UNIT * LOCAL * self.growth  # of a state at the end, whatever the span
        self.nearest = min(motion.from_top, motion.from_bottom)

    def __call__(
        self, formulation: str, *, projected: bool = False, bits: int = DOUBLE
    ) -> Estimate:
        """Time and error of a run in one formulation."""
        error = 2.0 ** (DOUBLE - bits) * self._error(formulation, projected)
        return Estimate(self._seconds(formulation, projected, bits), error)

    def bits(self, formulation: str) -> int:
        """Bits of the numbers of a run, so that the scene's digits are right at its end.

        Steps are measured against the largest state, a rate; phase errors grow as the 3/2 power
        of the time, and by 1/(1 − m) near a separatrix; on one errors grow exponentially.
        ``tests/integration/test_high_precision.py`` holds runs of 14 to 100 digits to their digits.
        """
        if self.scene.digits <= MOST_DIGITS:
            return DOUBLE
        r = self.motion.reduced
        rate = float(abs(r.a) + abs(r.b)) + math.sqrt(2 * float(r.kinetic0 + 2 * abs(r.g)))
        lost = math.log2(1 + rate) + _bits_grown(self.motion, self.span)
        if self.motion.period:
            lost += 1.5 * math.log2(1 + self.periods)
        if formulation == "lagrange":  # phi and psi, which grow, are its largest states
            lost += math.log2(1 + rate * abs(self.span))
        return enough(self.scene.digits * math.log2(10) + SPARE + lost)

    def _seconds(self, formulation: str, projected: bool, bits: int) -> float:
        asked, kind = self.scene.events, self.motion.kind
        turned = formulation == "axis" and bool({"psi", "attitude"} & set(self.scene.quantities))
        each = RATES[formulation][0] + QUADRATURE_US * turned
        if formulation in SINGULAR:  # time scales follow one another down to the pass, and back
            each *= 1 - math.log10(max(min(self.nearest, 1.0), UNIT))
        each *= (PROJECTED if projected else 1.0) * (WATCHED if asked else 1.0)
        sampled = SAMPLE_US
        if bits > DOUBLE:
            bits = min(bits, MOST_TIMED)
            longer = MPFR_MS * (bits / 128) ** 2.2 * max(1.0, bits / HEAVY)
            each += 1e3 * (LONG_DOUBLE_MS if bits == LONG_DOUBLE else longer)
            turning = 2 if "turning" in asked else int(kind == "cusps")
            events = turning + 2 * ("reversal" in asked and kind == "loops")
            each += 1e3 * EVENT_MS * events * self.motion.nutates
            sampled += 1e3 * READ_MS
        return float(1e-6 * (each * self.periods + sampled * self.scene.samples))

    def _error(self, formulation: str, projected: bool) -> float:
        """The largest error of what is wanted, in doubles, at any time that may be looked at."""
        count = self.periods
        lost = RATES[formulation][1] * count * math.sqrt(count)
        if projected:
            lost = WANDER * math.sqrt(count) + STEADY * count
        late = abs(self.span) / max(count, 1.0) * lost
        here = self.rounding
        if formulation == "cubic":  # theta from a height
            here /= min(1.0, max(math.sqrt(UNIT), self.nearest))
        if formulation in SINGULAR:  # beside a pole, θ has the digits that it has beside one
            here *= (1 + count) / max(min(self.nearest, 1.0), 1 / MOST_ERROR)
        aside = (PINNED if projected else TURNED) * math.sqrt(count)
        off = here + UNIT * self.growth * max(late * self.quickest, aside)
        return float(min(off, MOST_ERROR))

    @cached_property
    def quickest(self) -> float:
        """The largest rate of what is wanted, beside max(1, |x|) at the end [1/s].

        Examples
        --------
        >>> from heavytop.scene.scene import load_scene
        >>> scene = load_scene("sicm-kicked", ["want.quantities=['theta']"])
        >>> round(Forecast(scene, Motion(scene.top, scene.start), 2.0).quickest, 1)
        2.3
        """
        wants, start = set(self.scene.quantities), self.scene.start
        theta, phi, psi, axis = _largest_rates(self.motion, self.span)
        mean_phi, mean_psi = self.motion.mean_angle_rates
        phi /= max(1.0, abs(float(start.phi) + mean_phi * self.span))
        psi /= max(1.0, abs(float(start.psi) + mean_psi * self.span))
        rates = {"theta": theta, "axis": axis, "phi": phi, "psi": psi}
        rates["attitude"] = max(axis, phi, psi)
        return max((rates[name] for name in wants & rates.keys()), default=0.0)


def _largest_rates(motion: Motion, span: float) -> tuple[float, float, float, float]:
    """The largest |θ̇|, |φ̇|, |ψ̇| and |ė| of a nutation [rad/s].

    Energy and momenta give all of them by the height u = cos θ alone: φ̇ and ψ̇ − κ are
    ½ P₊/(1 + u) ± ½ P₋/(1 − u), and |ė|² = θ̇² + sin²θ φ̇² is 2 (h − g u). They are looked at
    where u = u₁ + (u₂ − u₁) sin²α, with α spread over a nutation, and where it is at times up to
    the end if α grows evenly. The latter alone may all be turning points, where θ stands still;
    the former are not where a pass so close to a pole that it is over in no time, if nobody looks
    there.
    """
    r, low, high = motion.reduced, *sorted(map(motion.exact.ctx.cos, motion.exact.tilts))
    if low == high:
        phidot, psidot = map(abs, motion.mean_angle_rates)
        return 0.0, phidot, psidot, phidot * math.sin(motion.theta_min)
    alpha = (np.arange(PLACES) + 0.5) * math.pi / (2 * PLACES)
    if motion.period:
        begun = math.asin(min(1.0, math.sqrt(max(0.0, (r.u0 - low) / (high - low)))))
        ahead = np.linspace(0.0, math.pi * span / motion.period, PLACES + 1)[1:]
        alpha = np.concatenate((alpha, ahead + math.copysign(begun, r.udot0)))
    swing = float(high - low)
    from_top = 2 * math.sin(motion.from_top / 2) ** 2 + swing * np.cos(alpha) ** 2
    from_bottom = 2 * math.sin(motion.from_bottom / 2) ** 2 + swing * np.sin(alpha) ** 2
    # nothing is left of a half on whose pole the axis passes
    plus = float(r.P_plus) / (2 * from_bottom) if motion.from_bottom else 0.0
    minus = float(r.P_minus) / (2 * from_top) if motion.from_top else 0.0
    speed2 = 2 * (float(r.over_top) + float(r.g) * from_top)
    nods2 = speed2 - (plus + minus) ** 2 * from_top * from_bottom
    rates = np.sqrt(np.maximum(nods2, 0.0)), plus + minus, float(r.kappa) + plus - minus
    theta, phi, psi = (float(np.max(np.abs(rate))) for rate in rates)
    return theta, phi, psi, math.sqrt(max(0.0, speed2.max()))


def periods_of(motion: Motion, span: float) -> float:
    """How many nutation periods a span has; of what does not nutate, turns of what moves."""
    if motion.period:
        return abs(span) / motion.period
    r = motion.reduced
    rate = float(abs(r.b)) + math.sqrt(float(abs(r.g))) + float(abs(r.drift0))
    return abs(span) * rate / math.tau


def _bits_grown(motion: Motion, span: float) -> float:
    """By how many bits an error grows beside one in phase: near a separatrix, and on it."""
    exact = motion.exact
    if exact.growth is not None:
        return float(exact.growth) * abs(span) / math.log(2)
    return 0.0 if exact.modulus is None else -float(exact.ctx.log(exact.modulus[1], 2))


def needed_to_fold(digits: int, halves: float = FOLDED_REACH) -> float:
    """Bits that half a nutation needs, to tell decimal digits so many half-periods away.

    >>> round(needed_to_fold(16), 1), round(needed_to_fold(20, 2e15), 1)
    (101.2, 121.3)
    """
    reach = math.log2(max(halves, FOLDED_REACH))
    return max(LEAST_FOLDED, digits) * math.log2(10) + reach + SPARE_FOLDED


def most_steps(motion: Motion, span: float) -> int:
    """Steps that no sound run of so many seconds takes, by far."""
    return int(SPARE_STEPS + STEPS * periods_of(motion, span))


def duration(seconds: float) -> str:
    """A time in the unit in which it is read: seconds, minutes, hours, days or years.

    >>> [duration(x) for x in (3.17, 90, 24_400, 3e5, 1e12)]
    ['3.17 s', '1.5 min', '6.78 h', '3.47 days', '3.17e+04 years']
    """
    if seconds < SHORT_S:
        return f"{seconds:.3g} s"
    unit, name = next((u, n) for u, n in LONGER if seconds >= u)
    return f"{seconds / unit:.3g} {name}"
