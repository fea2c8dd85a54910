"""How quickly what is wanted of a motion changes: what an error in time becomes."""

from __future__ import annotations

from collections.abc import Collection
from functools import lru_cache
from typing import Final

import numpy as np

from heavytop.analytic.many_times import DoubleRecord
from heavytop.analytic.motion import Motion

LOOKED_AT: Final = 65
GOLDEN: Final = 0.6180339887498949  # times spread by it fall on no phase of a nutation twice
SETTLED: Final = 40.0  # of 1/w: after that, an axis that tends to the vertical stands there


def quickest(quantities: Collection[str], motion: Motion, span: float) -> float:
    """The largest rate of some quantities in a nutation, beside max(1, |x|) at the end [1/s].

    Parameters
    ----------
    quantities : collection of str
    motion : Motion
    span : float
        The end [s]. However far it is, one nutation is looked at.

    Examples
    --------
    >>> from heavytop.scene.scene import load_scene
    >>> scene = load_scene("sicm-kicked")
    >>> motion = Motion(scene.top, scene.start)
    >>> [round(quickest(["theta"], motion, n * motion.period), 1) for n in (1, 1e6, 1e15)]
    [2.3, 2.3, 2.3]
    """
    seen = _seen(motion, span)
    wants = set(quantities)
    found = [0.0]
    if "theta" in wants:
        found.append(_largest(seen.thetadot))
    if {"axis", "attitude"} & wants:
        found.append(_largest(np.hypot(seen.thetadot, seen.phidot * np.sin(seen.theta))))
    starts = (motion.start.phi, motion.start.psi)
    means = zip(("phi", "psi"), starts, motion.mean_angle_rates, strict=True)
    for angle, start, mean in means:
        if {angle, "attitude"} & wants:
            end = abs(float(start) + mean * span)
            found.append(_largest(getattr(seen, f"{angle}dot")) / max(1.0, end))
    return max(found)


@lru_cache(maxsize=8)
def _seen(motion: Motion, span: float) -> DoubleRecord:
    """The motion at times spread over one nutation, and at the phases of times up to the end.

    The latter alone may all be turning points, where theta stands still; the former are not where
    a close pass is over in no time, if nobody looks there.
    """
    reach = min(abs(span), motion.period or SETTLED * _slowness(motion) or abs(span))
    spread = reach * np.mod(np.arange(1, LOOKED_AT) * GOLDEN, 1.0)
    even = np.abs(np.linspace(0.0, span, LOOKED_AT)[1:])
    phases = np.mod(even, motion.period) if motion.period else np.minimum(even, reach)
    return motion.double(np.copysign(np.concatenate((spread, phases)), span))


def _slowness(motion: Motion) -> float:
    """1/w of a motion that tends to the vertical [s]; of another 0."""
    rate = motion.exact.growth
    return 0.0 if rate is None else 1 / float(rate)


def _largest(rates: object) -> float:
    return float(np.max(np.abs(np.asarray(rates))))
