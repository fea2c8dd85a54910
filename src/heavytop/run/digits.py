"""How many binary digits a run needs, for the decimal ones a scene wants to be right at its end."""

from __future__ import annotations

from math import log, log2, sqrt
from typing import Final

from heavytop.analytic.motion import Motion
from heavytop.integration.bits import DOUBLE, enough

MOST_DIGITS: Final = 13  # what double precision can promise at the end of a short run
SPARE: Final = 2.0  # bits, beyond those that have a reason
LEAST_FOLDED: Final = 16  # digits of a fold, so that doubles lose nothing
FOLDED_REACH: Final = 2.0**44  # half-periods, unless the scene reaches farther
SPARE_FOLDED: Final = 4.0  # bits
MOST_TURNS: Final = 2.0**60  # of theta, phi or psi that are counted
MOST_BITS: Final = 131_072  # of the numbers that every step is taken in


def bits_for(digits: int, motion: Motion, span: float, *, growing: bool = False) -> int:
    """Return the bits of the numbers of a run.

    Parameters
    ----------
    digits : int
        Decimal digits wanted at the end.
    motion : Motion
    span : float
        How long the run is [s].
    growing : bool
        Whether phi and psi sit in the state, against the largest of which a step is measured.

    Notes
    -----
    Accuracy: ``tests/two_ways/test_precision.py`` holds runs of 14 to 100 digits to the digits
    they were asked for.

    Examples
    --------
    >>> from heavytop.scene.scene import load_scene
    >>> scene = load_scene("sicm-kicked")
    >>> [bits_for(n, Motion(scene.top, scene.start), 3.0) for n in (12, 30, 60)]
    [53, 128, 256]
    """
    if digits <= MOST_DIGITS:
        return DOUBLE
    return enough(digits * log2(10) + SPARE + lost_bits(motion, abs(span), growing=growing))


def needed_to_fold(digits: int, halves: float = FOLDED_REACH) -> float:
    """Return the bits that half a nutation needs, to tell decimal digits so many of it away.

    Parameters
    ----------
    digits : int
    halves : float
        Half-periods that are reached.

    Examples
    --------
    >>> round(needed_to_fold(16), 1), round(needed_to_fold(20, 2e15), 1)
    (101.2, 121.3)
    """
    return max(LEAST_FOLDED, digits) * log2(10) + log2(max(halves, FOLDED_REACH)) + SPARE_FOLDED


def lost_bits(motion: Motion, span: float, *, growing: bool) -> float:
    """Return about how many bits a run of so many seconds loses.

    Steps are measured against the largest state, a rate; phase errors grow as the 3/2 power of
    the time, by 1/(1 - m) near a separatrix, and on one they grow exponentially.
    """
    r = motion.reduced
    fastest = float(abs(r.a) + abs(r.b)) + sqrt(2 * float(r.kinetic0 + 2 * abs(r.g)))
    lost = log2(1 + fastest) + (log2(1 + fastest * span) if growing else 0.0)
    if motion.period:
        lost += 1.5 * log2(1 + span / motion.period)
    if motion.exact.modulus is not None:
        lost -= float(motion.exact.ctx.log(motion.exact.modulus[1], 2))
    if motion.exact.growth is not None:
        lost += float(motion.exact.growth) * span / log(2)
    return lost
