"""What a run will cost, how far off it will end, and the bits that its digits take: estimates.

Steps, time and error grow with the nutation periods. An integration in doubles whose state holds
no growing angle loses phase as the 3/2 power of the periods, a projected one as the square root;
what is wanted is off by its rate times the phase that is lost. The numbers here and in the
table of formulations are from ``validation/03_benchmarks.py`` and ``18_long_runs.py``;
``validation/11_random_tops.py`` holds the plans that follow from them against every other.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Final

import numpy as np

from heavytop.analytic.motion import Motion
from heavytop.equations.registry import FORMULATIONS
from heavytop.integration.bits import DOUBLE, enough
from heavytop.scene.quantities import Need, judged, need_of
from heavytop.scene.scene import Scene

UNIT: Final = 2.0**-53


# time
QUADRATURE_US: Final = 2.0  # of psi beside the axis
WATCHED: Final = 3.0  # times as long, with events
PROJECTED: Final = 1.4  # times as long
MPFR_MS: Final = 9.0  # a period in 128 bits; it grows a little faster than their square
HEAVY: Final = 2400.0  # bits, beyond which it grows as their cube
MOST_TIMED: Final = 2**40  # bits; a plan that takes more is refused
EVENT_MS: Final = 1.3  # to polish an event beyond doubles, and to read it
SPARE_STEPS: Final = 1_000_000  # some seconds of them,
STEPS: Final = 1_000  # and so many for each nutation: a sound run takes 10 to 40
# error
WANDER: Final = 40.0  # phase after N periods, projected, in units of T 2⁻⁵³ N^{1/2}
STEADY: Final = 0.1  # the same in units of T 2⁻⁵³ N, where rounding does not average out
LOCAL: Final = 16.0  # units of rounding in a state at the end, whatever the span
TURNED: Final = 12.0  # error of the orientation apart from the phase, in such units times N^{1/2}
PINNED: Final = 6.0  # the same, projected
CLOSEST: Final = 1e-4  # of the swing: so near a pole rates are still held to their digits
MOST_ERROR: Final = 1e300  # so that what is worse than any error is still a number
# digits
MOST_DIGITS: Final = 13  # what double precision can promise at the end of a short run
SPARE: Final = 2.0  # bits, beyond those that have a reason
MOST_TURNS: Final = 2.0**60  # of theta, phi or psi that are counted

PLACES: Final = 64  # of a nutation, at which rates are looked at


@dataclass(frozen=True, slots=True)
class Estimate:
    """What is expected of a run.

    Attributes
    ----------
    seconds : float
        Time to integrate, without compiling and sampling [s].
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
        self.need = need_of(scene.quantities)
        self.periods = periods_of(motion, span)
        self.nearest = min(motion.nearest)  # to a pole
        self.bits_grown = _bits_grown(motion, span)
        self.growth = 2.0 ** min(self.bits_grown, 1010.0)  # a number still
        self.rounding = UNIT * LOCAL * self.growth  # of a state at the end, whatever the span

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
        ``tests/run/test_propagation.py`` holds runs of 14 to 100 digits to their digits.
        """
        if self.scene.digits <= MOST_DIGITS:
            return DOUBLE
        r = self.motion.reduced
        rate = float(abs(r.a) + abs(r.b)) + math.sqrt(2 * float(r.kinetic0 + 2 * abs(r.g)))
        lost = math.log2(1 + rate) + self.bits_grown
        if self.motion.period:
            lost += 1.5 * math.log2(1 + self.periods)
        if formulation == "lagrange":  # phi and psi, which grow, are its largest states
            lost += math.log2(1 + rate * abs(self.span))
        lost -= math.log2(self.sharpness)
        return enough(self.scene.digits * math.log2(10) + SPARE + lost)

    def _seconds(self, formulation: str, projected: bool, bits: int) -> float:
        each, asked = FORMULATIONS[formulation].us, self.scene.events
        if formulation == "axis" and self.need >= Need.PSI:
            each += QUADRATURE_US
        if not FORMULATIONS[formulation].starts_at_pole:
            # time scales follow one another down to the pass, and back
            each *= 1 - math.log10(max(min(self.nearest, 1.0), UNIT))
        each *= (PROJECTED if projected else 1.0) * (WATCHED if asked else 1.0)
        if bits > DOUBLE:
            bits = min(bits, MOST_TIMED)
            each += 1e3 * MPFR_MS * (bits / 128) ** 2.2 * max(1.0, bits / HEAVY)
            turning = 2 if "turning" in asked else int(self.motion.kind == "cusps")
            events = turning + 2 * ("reversal" in asked and self.motion.kind == "loops")
            each += 1e3 * EVENT_MS * events * self.motion.nutates
        return float(1e-6 * each * self.periods)

    def _error(self, formulation: str, projected: bool) -> float:
        """The largest error of what is wanted, in doubles, at any time that may be looked at."""
        count = self.periods
        lost = FORMULATIONS[formulation].phase * count * math.sqrt(count)
        if projected:
            lost = WANDER * math.sqrt(count) + STEADY * count
        late = abs(self.span) / max(count, 1.0) * lost
        here = self.rounding
        if formulation == "cubic":  # theta from a height
            here /= min(1.0, max(math.sqrt(UNIT), self.nearest))
        if not FORMULATIONS[formulation].starts_at_pole:
            # beside a pole, θ has the digits that it has beside one
            here *= (1 + count) / max(min(self.nearest, 1.0), 1 / MOST_ERROR)
        here /= self.sharpness
        aside = (PINNED if projected else TURNED) * math.sqrt(count)
        off = here + UNIT * self.growth * max(late * self.quickest, aside)
        return float(min(off, MOST_ERROR))

    @cached_property
    def sharpness(self) -> float:
        """How much of their digits the rates keep beside a pole; 1 where they are not wanted.

        There φ̇ and ψ̇ are P∓/(1 ∓ u) but for regular terms: the rounding of P∓ is divided by the
        square of the distance where they are looked at, and the largest of the rates by the least
        distance.
        """
        if "rates" not in judged(self.scene.quantities):
            return 1.0
        swing = self.motion.theta_max - self.motion.theta_min
        closest = max(self.nearest, CLOSEST * swing)
        return min(1.0, max(closest**2, self.nearest)) or 1.0  # on a pole for ever they are exact

    @cached_property
    def quickest(self) -> float:
        """The largest rate of what is wanted, beside what its errors are relative to [1/s].

        Examples
        --------
        >>> from heavytop.scene.scene import load_scene
        >>> scene = load_scene("sicm-kicked", ["want.quantities=['theta']"])
        >>> round(Forecast(scene, Motion(scene.top, scene.start), 2.0).quickest, 1)
        2.3
        """
        rates = _largest_rates(self.motion, self.span)
        rates |= {name: rates[name] / turned for name, turned in self.turned.items()}
        return max((rates[name] for name in judged(self.scene.quantities)), default=0.0)

    @cached_property
    def turned(self) -> dict[str, float]:
        """What errors of φ and ψ are relative to: they at the end, or 1 [rad]."""
        start, means = self.scene.start, self.motion.mean_angle_rates
        angles = zip(("phi", "psi"), means, strict=True)
        return {
            name: max(1.0, abs(float(getattr(start, name)) + mean * self.span))
            for name, mean in angles
        }


def _largest_rates(motion: Motion, span: float) -> dict[str, float]:
    """The largest |θ̇|, |φ̇|, |ψ̇|, |ė| of a nutation [rad/s], and how fast the rates change.

    Energy and momenta give them by the height u = cos θ alone: φ̇ and ψ̇ − κ are
    ½ P₊/(1 + u) ± ½ P₋/(1 − u), and |ė|² = θ̇² + sin²θ φ̇² is 2 (h − g u). The change of the rates
    is relative to the largest of them, or to 1 rad/s if that is larger [1/s].
    """
    r, least, greatest = motion.reduced, motion.theta_min, motion.theta_max
    if least == greatest:
        phidot, psidot = map(abs, motion.mean_angle_rates)
        aside = phidot * math.sin(least)
        return {"theta": 0.0, "phi": phidot, "psi": psidot, "axis": aside, "rates": 0.0}
    from_top, from_bottom = _heights(motion, span)
    # nothing is left of a half on whose pole the axis passes
    plus = float(r.P_plus) / (2 * from_bottom) if motion.from_bottom else 0.0
    minus = float(r.P_minus) / (2 * from_top) if motion.from_top else 0.0
    speed2 = 2 * (float(r.over_top) + float(r.g) * from_top)
    phidot, psidot = plus + minus, float(r.kappa) + plus - minus
    thetadot = np.sqrt(np.maximum(speed2 - phidot**2 * from_top * from_bottom, 0.0))
    theta, phi, psi = (float(np.max(np.abs(rate))) for rate in (thetadot, phidot, psidot))
    sine = np.sqrt(from_top * from_bottom)
    pull = phidot**2 * (from_bottom - from_top) / 2 - float(r.b) * phidot + float(r.g)
    turning = thetadot * (np.abs(plus) / from_bottom + np.abs(minus) / from_top)
    changes = float(np.max(sine * np.maximum(np.abs(pull), turning)))
    axis = math.sqrt(max(0.0, speed2.max()))
    changes /= max(1.0, theta, phi, psi)
    return {"theta": theta, "phi": phi, "psi": psi, "axis": axis, "rates": changes}


def _heights(motion: Motion, span: float) -> tuple[Any, Any]:
    """1 ∓ u at places of a nutation, where its rates are looked at.

    They are u = u₁ + (u₂ − u₁) sin²α, with α spread over a nutation, and where it is at times up to
    the end if α grows evenly. The latter alone may all be turning points, where θ stands still;
    the former are not where a pass so close to a pole that it is over in no time, if nobody looks
    there.
    """
    alpha = (np.arange(PLACES) + 0.5) * math.pi / (2 * PLACES)
    swing = _apart(motion.theta_min, motion.theta_max)
    if motion.period:
        r, risen = motion.reduced, _apart(float(motion.start.theta), motion.theta_max)
        begun = math.asin(min(1.0, math.sqrt(max(0.0, risen / swing))))
        ahead = np.linspace(0.0, math.pi * span / motion.period, PLACES + 1)[1:]
        alpha = np.concatenate((alpha, ahead + math.copysign(begun, r.udot0)))
    from_top = 2 * math.sin(motion.from_top / 2) ** 2 + swing * np.cos(alpha) ** 2
    from_bottom = 2 * math.sin(motion.from_bottom / 2) ** 2 + swing * np.sin(alpha) ** 2
    return from_top, from_bottom


def _apart(least: float, greatest: float) -> float:
    """How much higher the axis is at one tilt than at a greater one, without cancellation."""
    return 2 * math.sin((greatest + least) / 2) * math.sin((greatest - least) / 2)


def periods_of(motion: Motion, span: float) -> float:
    """How many nutation periods a span has; of what does not nutate, turns of what moves."""
    if motion.period:
        return abs(span) / float(motion.period)
    r = motion.reduced
    rate = float(abs(r.b)) + math.sqrt(float(abs(r.g))) + float(abs(r.drift0))
    return abs(span) * rate / math.tau


def _bits_grown(motion: Motion, span: float) -> float:
    """By how many bits an error grows beside one in phase: near a separatrix, and on it."""
    if motion.growth is not None:
        return float(motion.growth) * abs(span) / math.log(2)
    modulus = motion.mpf("modulus", 20)
    return 0.0 if modulus is None else -float(modulus[1].context.log(modulus[1], 2))


def most_steps(motion: Motion, span: float) -> int:
    """Steps that no sound run of so many seconds takes, by far."""
    return int(SPARE_STEPS + STEPS * periods_of(motion, span))
