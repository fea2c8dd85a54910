"""How runs of many tops go wrong, estimated for whole arrays.

The steps leave a relative error δ in the state, which grows as the root of their number. In a
nutation it becomes an error in phase, and N nutations add theirs up. Near the separatrix it grows
besides, as exp(λt) while the axis is beside the vertical, by 1/mc at most in each nutation: there

    f(1 − x) = −P₋² + S x + F x² − 2g x³,    mc ≈ 2g √(S² + 4F P₋²)/F²,    λ² = g − b²/4.

The error at the end is about δ (1 + N) G. ``validation/43_fuzz.py`` holds it against the truth.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from heavytop.exact.pairs import EPSILON
from heavytop.run.estimates import LOCAL_ROUNDING

Array = NDArray[np.float64]

WALK: Final = 4.0  # beside those that any state has, of the root of the number of nutations
MOST_GROWTH: Final = 700.0  # of an exponent


@dataclass(frozen=True, slots=True)
class Outlook:
    """What is to be expected of runs.

    Attributes
    ----------
    rounding : ndarray, shape (k,)
        δ, the relative error that the steps leave in the state.
    growth : ndarray, shape (k,)
        What it is multiplied by until the end.
    rate : ndarray, shape (k,)
        The largest rate in the motion, about [1/s].
    nods : ndarray, shape (k,)
        About how far θ nods, at least [rad]; 0 where it is known to be constant.
    near : ndarray, shape (k,)
        A bound below the distance at which the axis passes a pole, at most 1 [rad].
    turns_back : ndarray, shape (k,)
        About how far cosθ goes beyond the height at which φ̇ changes its sign; not above 0 where it
        does not.
    """

    rounding: Array
    growth: Array
    rate: Array
    nods: Array
    near: Array
    turns_back: Array


@np.errstate(all="ignore")  # what is no number has no outlook either
def outlook(start: Mapping[str, Array], time: Array) -> Outlook:
    """Return what is to be expected of runs, by their starts.

    Parameters
    ----------
    start : mapping from str to ndarray, shape (k,)
        A, C, gMR, theta, thetadot, phidot and psidot.
    time : ndarray, shape (k,)
        Their spans [s].
    """
    theta, thetadot, phidot = (start[name] for name in ("theta", "thetadot", "phidot"))
    sine, cosine, time = np.sin(theta), np.cos(theta), np.abs(time)
    g = start["gMR"] / start["A"]
    b = start["C"] / start["A"] * (start["psidot"] + phidot * cosine)
    above, below = 2 * np.sin(theta / 2) ** 2, 2 * np.cos(theta / 2) ** 2
    speed2, drift = thetadot**2 + (phidot * sine) ** 2, phidot * sine**2
    rate = abs(b) + 2 * np.sqrt(abs(g)) + np.hypot(thetadot, phidot * sine)
    nutations = time * rate / (2 * np.pi)
    growth = (1 + nutations) * _growth(abs(g), np.where(g < 0, -b, b), drift, speed2,
                                       np.where(g < 0, below, above), time)  # fmt: skip
    pull = sine * (phidot**2 * cosine - b * phidot + g)  # θ'' at the start
    nods = abs(thetadot) / rate + abs(pull) / rate**2
    P_plus, P_minus = drift + b * below, drift - b * above
    near = np.minimum(np.minimum(abs(P_plus), abs(P_minus)) / (2 * rate), 1.0)
    return Outlook(EPSILON * (LOCAL_ROUNDING + WALK * np.sqrt(nutations)), growth, rate, nods, near,
                   _turns_back(g, b, drift, speed2, P_plus * P_minus))  # fmt: skip


def _growth(g: Array, b: Array, drift: Array, speed2: Array, above: Array, time: Array) -> Array:
    """G, for g ≥ 0: 1 but beside the separatrix."""
    P, lift = drift - b * above, 2 * g * above
    S, F = 2 * (speed2 - lift - b * P), 4 * g - b**2 - (speed2 - lift)
    S = abs(S) + 2 * EPSILON * (speed2 + lift + abs(b * P))  # it may be all rounding
    mc = 2 * g * np.sqrt(S**2 + 4 * np.maximum(F, 0) * P**2) / F**2
    near = np.where(F > 0, np.maximum(1 / mc, 1.0), 1.0)
    return np.minimum(
        near, np.exp(np.minimum(np.sqrt(np.maximum(g - b**2 / 4, 0)) * time, MOST_GROWTH))
    )


def _turns_back(g: Array, b: Array, drift: Array, speed2: Array, P2: Array) -> Array:
    """How far u goes beyond u_c = a/b, f(u_c)/|f'(u_c)| about; at 0 there are cusps."""
    room = -P2 / b**2  # 1 − u_c²
    left = speed2 - 2 * g * drift / b  # 2 (h − g u_c), which at a start at rest is exactly 0
    beyond = room * left / (2 * (abs(g) * room + left))
    short = np.where(b == 0, -1.0, np.fmin(room, left / (abs(g) + b**2)))
    return np.where((b != 0) & (room > 0) & (left > 0), beyond, short)
