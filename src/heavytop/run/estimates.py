"""Estimates of the error, the bits and the time of a run, with which a plan begins.

Rounding takes phase away as the 3/2 power of the number of nutation periods; under projection as
its root, and slowly in proportion. What is wanted is off by its rate times the lost phase. The
numbers here and in the table of formulations are from ``validation/03_benchmarks.py`` and
``18_long_runs.py``; ``validation/11_random_tops.py`` compares the plans that follow with others.
"""

from __future__ import annotations

import math
from functools import cached_property
from typing import Final

from heavytop.analytic.motion import Motion
from heavytop.equations.registry import FORMULATIONS
from heavytop.exact.decimals import DOUBLE, least_bits
from heavytop.exact.pairs import UNIT
from heavytop.scene.quantities import Need, judged_quantities, need_of
from heavytop.scene.scene import Scene

# time
QUADRATURE_US: Final = 2.0  # of psi beside the axis
EVENTS_FACTOR: Final = 3.0  # times as long, with events
PROJECTED: Final = 1.4  # times as long
MPFR_MS: Final = 9.0  # a period in 128 bits; it grows a little faster than their square
CUBIC_BITS: Final = 2400.0  # bits, beyond which it grows as their cube
MOST_TIMED: Final = 2**40  # bits; a plan that takes more is refused
SPARE_STEPS: Final = 1_000_000  # some seconds of them,
STEPS_A_NUTATION: Final = 1_000  # and so many for each nutation: a sound run takes 10 to 40
# error
PLAIN_PHASE: Final = 2.0  # lost after N periods, in units of T 2⁻⁵³ N^{3/2};
WANDER: Final = 40.0  # projected, of T 2⁻⁵³ N^{1/2},
DRIFT_PHASE: Final = 0.1  # and of T 2⁻⁵³ N, where rounding does not average out
LOCAL_ROUNDING: Final = 16.0  # units of rounding in a state at the end, whatever the span
CLOSEST: Final = 1e-4  # of the swing: so near a pole rates are still held to their digits
# digits
DOUBLE_DIGITS: Final = 13  # what double precision can promise at the end of a short run
PLAN_SPARE_BITS: Final = 2.0  # bits, beyond those that have a reason
MOST_TURNS: Final = 2.0**50  # of theta, phi or psi: beyond them a double does not tell turns apart


class CostModel:
    """Estimates for runs of one scene over a span [s]."""

    def __init__(self, scene: Scene, motion: Motion, span: float) -> None:
        self.scene, self.motion, self.span = scene, motion, span
        self.need = need_of(scene.quantities)
        self.reduced = motion.refine("the start", lambda c: c.start.mapped(float))
        self.periods = periods_of(motion, span)
        self.nearest = min(motion.nearest)  # to a pole
        self.rounding = UNIT * LOCAL_ROUNDING * self.growth  # of a state at the end, at least

    @cached_property
    def bits_grown(self) -> float:
        """Bits by which errors grow more than phase errors do, near a separatrix and on it."""
        if self.motion.growth is not None:
            return float(self.motion.growth) * abs(self.span) / math.log(2)
        beside = self.motion.refine("the modulus", lambda c: c.modulus and c.modulus[1].log(), 15)
        return -float(beside or 0) / math.log(2)

    @property
    def growth(self) -> float:
        """The factor of `bits_grown`, as a finite double."""
        return float(2.0 ** min(self.bits_grown, 1010.0))

    @cached_property
    def rate(self) -> float:
        """An upper bound of the rates of the axis [rad/s]."""
        r = self.reduced
        return float(abs(r.a) + abs(r.b) + math.sqrt(2 * (r.kinetic0 + 2 * abs(r.g))))

    def error(self, projected: bool) -> float:
        """The estimated error at the end of a run in doubles."""
        count = self.periods
        lost = PLAIN_PHASE * count**1.5
        if projected:
            lost = WANDER * math.sqrt(count) + DRIFT_PHASE * count
        late = abs(self.span) / max(count, 1.0) * self.rate / 4
        local = float(self.rounding) / self.sharpness
        return float(local + UNIT * self.growth * late * lost)

    def bits(self, formulation: str) -> int:
        """Bits that a run takes for the scene's digits to be right at its end.

        The error of a step is relative to the largest state, a rate; phase errors grow as the 3/2
        power of the time, and by 1/(1 − m) near a separatrix; on one errors grow exponentially.
        """
        lost = math.log2(1 + self.rate) + self.bits_grown - math.log2(self.sharpness)
        if self.motion.period:
            lost += 1.5 * math.log2(1 + self.periods)
        if FORMULATIONS[formulation].grows:  # phi and psi are its largest states
            lost += math.log2(1 + self.rate * abs(self.span))
        return least_bits(self.scene.digits * math.log2(10) + PLAN_SPARE_BITS + lost)

    def seconds(self, formulation: str, projected: bool, bits: int) -> float:
        """Expected time of the steps, without compiling and sampling [s]."""
        entry = FORMULATIONS[formulation]
        us = entry.us  # a nutation period
        if entry.rates and self.need >= Need.PSI:
            us += QUADRATURE_US
        if not entry.starts_at_pole:
            # time scales follow one another down to the pass, and back
            us *= 1 - math.log10(max(min(self.nearest, 1.0), UNIT))
        us *= (PROJECTED if projected else 1.0) * (EVENTS_FACTOR if self.scene.events else 1.0)
        if bits > DOUBLE:
            bits = min(bits, MOST_TIMED)
            us = 1e3 * MPFR_MS * (bits / 128) ** 2.2 * max(1.0, bits / CUBIC_BITS)
        return float(1e-6 * us * self.periods)

    @cached_property
    def sharpness(self) -> float:
        """The factor by which the relative accuracy of rates falls beside a pole.

        1 where rates are not wanted. Beside a pole φ̇ and ψ̇ are P∓/(1 ∓ u) but for regular terms:
        the rounding of P∓ is divided by the square of the distance at the time of interest, and the
        largest of the rates by the least distance.
        """
        if "rates" not in judged_quantities(self.scene.quantities):
            return 1.0
        swing = self.motion.theta_max - self.motion.theta_min
        closest = max(self.nearest, CLOSEST * swing)
        return min(1.0, max(closest**2, self.nearest)) or 1.0  # on a pole for ever they are exact


def periods_of(motion: Motion, span: float) -> float:
    """The number of nutation periods in a span; without nutation, of turns at the natural rate."""
    if motion.regime.steady and motion.kind == "at-rest":
        return 0.0
    if motion.period:
        return abs(span) / float(motion.period)
    r = motion.reduced
    rate = float(abs(r.b)) + math.sqrt(float(abs(r.g))) + float(abs(r.drift0))
    return abs(span) * rate / math.tau


def most_steps(motion: Motion, span: float) -> int:
    """A number of steps that is far above that of any sound run over a span [s]."""
    return int(SPARE_STEPS + STEPS_A_NUTATION * periods_of(motion, span))
