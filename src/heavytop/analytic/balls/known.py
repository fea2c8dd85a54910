"""What has to be known exactly of a motion before balls can be put around it.

At a turning point, on a pole, at a double root a ball touches a number it must not contain. Where
that happens is settled by a ball that excludes 0, or by a proof.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from heavytop.analytic.balls.reduced import Reduced
from heavytop.analytic.balls.source import Source
from heavytop.numbers.precision import working

_BITS: Final = 128


@dataclass(frozen=True, slots=True)
class Known:
    """What is exactly so; everything but `mirrored` is said of the motion with g ≥ 0.

    Parameters
    ----------
    mirrored : bool
        g < 0: the motion is looked at from below.
    weightless : bool
        g = 0.
    resting : bool
        u̇₀ = 0.
    steady : bool
        u̇₀ = ü₀ = 0, and so θ is constant.
    misses_top, misses_bottom : bool
        P₋ ≠ 0, P₊ ≠ 0.
    asymptotic : bool
        P₋ = 0 and h = g: the axis tends to the top.
    """

    mirrored: bool
    weightless: bool
    resting: bool
    steady: bool
    misses_top: bool
    misses_bottom: bool
    asymptotic: bool

    @classmethod
    def of(cls, source: Source) -> Known:
        """What is exactly so of one motion.

        Raises
        ------
        Unseparated
            Some number could be neither told from 0 nor proved to be 0.
        """
        with working(_BITS):
            reduced = source.reduced(_BITS)
            weightless = _vanishes(source, reduced, "g")
            mirrored = source.inverted
            top, bottom = ("P_plus", "P_minus") if mirrored else ("P_minus", "P_plus")
            surplus = "over_bottom" if mirrored else "over_top"
            resting = _vanishes(source, reduced, "udot0")
            steady = resting and _vanishes(source, reduced, "pull")
            misses_top = not _vanishes(source, reduced, top)
            misses_bottom = not _vanishes(source, reduced, bottom)
            level = not (steady or misses_top) and _vanishes(source, reduced, surplus)
        return cls(mirrored, weightless, resting, steady, misses_top, misses_bottom, level)


def _vanishes(source: Source, reduced: Reduced, name: str) -> bool:
    ball = getattr(reduced, name)
    if ball.is_zero():
        return True
    return not (ball > 0 or ball < 0) and source.vanishes(name)
